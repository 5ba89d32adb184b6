/*
  The model file, and the same bytes in memory, by which a model is sent from rank 0 to the others. Groups: /mesh and
  /problem (read for the online phase), /reconstruction, /training, /whole (read only for a field on the whole mesh).
  Every index is checked on load.
*/
#include <hycoromimpl.h>
#include <string.h>

/* The file's format version, raised when a reader of older versions must not read the file. 2: contacts have
   weighted masters. 3: problem/type; a file without it is hybrid. 4: further types. 5: masters are
   searched on surfaces that a map moves, and a slave node may face none; models without such surfaces are written as
   4. 6: models of scenes with a history. 7: hybrid ones with friction. The kind is common to all types, so that an
   older reader can report the format. */
#define HYCO_ROM_FORMAT 7
#define HYCO_ROM_PATHS  6
#define HYCO_ROM_MOVED  5
#define HYCO_ROM_STILL  4
#define HYCO_ROM_OLDEST 2
#define HYCO_ROM_KIND   "hyco hybrid model"

/* Moves the ties of the whole mesh, if there are any; sets them in the model's meshes. */
static PetscErrorCode MoveTies(HycoH5 h, HycoROM m)
{
  HycoTies t = m->model->mesh->ties;

  PetscFunctionBegin;
  if (HycoH5Reads(h) ? !HycoH5Has(h, "ties/slave") : !t) PetscFunctionReturn(PETSC_SUCCESS);
  if (HycoH5Reads(h)) {
    PetscCall(HycoTiesCreate(0, m->model->mesh->type, &t));
    /* HycoH5Int() allocates what it reads; -1: the number follows from the file. */
    HycoFreeAll(&t->slave, &t->master, &t->tie, &t->body, &t->weight, &t->reach);
    t->n = -1;
  }
  PetscCall(HycoH5Int(h, "ties/slave", 0, PETSC_MAX_INT, &t->n, 1, &t->slave));
  PetscCall(HycoH5Int(h, "ties/master", 0, PETSC_MAX_INT, &t->n, 1, &t->master));
  PetscCall(HycoH5Int(h, "ties/tie", 0, m->model->scene->n_ties - 1, &t->n, 1, &t->tie));
  PetscCall(HycoH5Int(h, "ties/body", 0, m->model->scene->n_bodies - 1, &t->n, 1, &t->body));
  PetscCall(HycoH5Real(h, "ties/weight", &t->n, 1, &t->weight));
  PetscCall(HycoH5Real(h, "ties/reach", &t->n, 1, &t->reach));
  if (!HycoH5Reads(h)) PetscFunctionReturn(PETSC_SUCCESS);
  HycoFinally(HycoMeshSetTies(m->model->mesh, t), PetscCall(HycoTiesDestroy(&t)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Written where a surface goes round an edge: a model without them has none. */
static PetscErrorCode MoveSides(HycoH5 h, HycoPairs *p)
{
  static const char name[] = "problem/pairs/side";
  PetscBool any = PETSC_FALSE;

  PetscFunctionBegin;
  if (HycoH5Reads(h) && !HycoH5Has(h, name)) PetscCall(PetscMalloc1(p->n + 1, &p->side));
  for (PetscInt k = 0; k < p->n && p->side; k++) {
    if (HycoH5Reads(h)) p->side[k] = HYCO_ONE_SIDE;
    any = (PetscBool)(any || p->side[k] != HYCO_ONE_SIDE);
  }
  if (HycoH5Reads(h) ? !p->side : any) PetscCall(HycoH5Int(h, name, HYCO_ONE_SIDE, PETSC_MAX_INT, &p->n, 1, &p->side));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Number of contacts and of entries follow from the file when it is read: -1 means "not known yet". */
static PetscErrorCode MovePairs(HycoH5 h, PetscInt n_nodes, PetscInt n_contacts, HycoPairs *p)
{
  PetscInt *entries;

  PetscFunctionBegin;
  if (HycoH5Reads(h)) p->n = -1;
  PetscCall(HycoH5Int(h, "problem/pairs/slave", 0, n_nodes - 1, &p->n, 1, &p->slave));
  PetscCall(HycoH5Int(h, "problem/pairs/contact", 0, n_contacts - 1, &p->n, 1, &p->contact));
  PetscCall(MoveSides(h, p));
  PetscCall(HycoH5Starts(h, "problem/pairs/master_start", p->n, &p->master_start));
  /* Masters of all contacts in one array (CSR), whose length is known after the starts. */
  entries = &p->master_start[p->n];
  PetscCall(HycoH5Int(h, "problem/pairs/master", 0, n_nodes - 1, entries, 1, &p->master));
  PetscCall(HycoH5Real(h, "problem/pairs/weight", entries, 1, &p->weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Words, not numbers, are stored: the order of an enumeration may change between versions. */
PetscErrorCode HycoROMLoadWord(HycoROM m, HycoH5 h, const char name[], const char *const words[], PetscInt *index)
{
  char *text;

  PetscFunctionBegin;
  PetscCall(HycoH5LoadText(h, name, &text));
  for (*index = 0; words[*index] && strcmp(text, words[*index]); (*index)++)
    ;
  PetscCall(PetscFree(text));
  HycoCheck(words[*index], "%s: %s is damaged", m->model->path, name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first files have no type: they are hybrid. */
static PetscErrorCode LoadType(HycoH5 h, HycoROM m)
{
  char *type = NULL;

  PetscFunctionBegin;
  if (HycoH5Has(h, "problem/type"))
    PetscCall(HycoH5LoadText(h, "problem/type", &type));
  else
    PetscCall(PetscStrallocpy(HYCO_ROM_HYBRID, &type));
  HycoFinally(HycoROMSetType(m, type), PetscCall(PetscFree(type)));
  PetscTryTypeMethod(m, load, h);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* training/reached: the features' largest values at the held-out points; training/closed: by contact, whether a
   training solution closes it. training/held_out: the number of predictions, medians and largest errors.
   training/estimates: the number behind them, the largest force, the floors, and for each error whether it has an
   estimate, the coefficients, the constant. training/outputs: a row for each output of the scene: whether it has an
   estimate, its largest absolute value, median and largest error, the coefficients, the constant. training/followed: a
   row for each of them: norm, relative, amplified. */
enum {
  HELD_NUMBERS = 1 + 2 * HYCO_N_ESTIMATES,
  OUTPUT_NUMBERS = 5 + HYCO_ESTIMATE_FEATURES,
  FOLLOWED_NUMBERS = 3,
  ESTIMATE_NUMBERS = 2 + HYCO_ESTIMATE_FEATURES + HYCO_N_ESTIMATES * (2 + HYCO_ESTIMATE_FEATURES)
};

/* One row of OUTPUT_NUMBERS for each output of the scene, in the order that LoadOutputEstimates() expects. */
static PetscErrorCode SaveOutputEstimates(HycoH5 h, HycoROM m)
{
  const HycoEstimates *t = &m->model->estimates;
  PetscReal numbers[HYCO_MAX_QUANTITIES * OUTPUT_NUMBERS], *at = numbers;

  PetscFunctionBegin;
  if (!t->n_outputs) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt q = 0; q < t->n_outputs; q++) {
    const HycoOutputEstimate *o = &t->output[q];

    *at++ = o->has;
    *at++ = o->magnitude;
    *at++ = o->median;
    *at++ = o->largest;
    /* The constant and a coefficient for each feature. */
    for (PetscInt j = 0; j <= HYCO_ESTIMATE_FEATURES; j++) *at++ = o->law[j];
  }
  PetscCall(HycoH5WriteReal(h, "training/outputs", t->n_outputs, OUTPUT_NUMBERS, numbers));
  at = numbers;
  for (PetscInt q = 0; q < t->n_outputs; q++) {
    *at++ = t->output[q].norm;
    *at++ = t->output[q].relative;
    *at++ = t->output[q].amplified;
  }
  PetscCall(HycoH5WriteReal(h, "training/followed", t->n_outputs, FOLLOWED_NUMBERS, numbers));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The held-out errors, the fitted laws of the estimates and the features reached in training. Infinite errors are
   written as the largest number, because a model file holds finite numbers only. */
static PetscErrorCode SaveEstimates(HycoH5 h, HycoROM m)
{
  const HycoEstimates *t = &m->model->estimates;
  PetscReal numbers[ESTIMATE_NUMBERS], *at = numbers;

  PetscFunctionBegin;
  if (m->model->search) PetscCall(HycoH5WriteText(h, "training/search", m->model->search));
  if (t->n_held) {
    numbers[0] = (PetscReal)t->n_held;
    for (PetscInt e = 0; e < HYCO_N_ESTIMATES; e++) {
      numbers[1 + e] = PetscMin(t->median[e], PETSC_MAX_REAL);
      numbers[1 + HYCO_N_ESTIMATES + e] = PetscMin(t->largest[e], PETSC_MAX_REAL);
    }
    PetscCall(HycoH5WriteReal(h, "training/held_out", HELD_NUMBERS, 1, numbers));
    PetscCall(HycoH5WriteReal(h, "training/cpu", 1, 1, &t->cpu));
  }
  /* Errors of outputs are stored without estimates too: `view` shows them. */
  PetscCall(SaveOutputEstimates(h, m));
  if (!t->n) PetscFunctionReturn(PETSC_SUCCESS);
  *at++ = (PetscReal)t->n;
  *at++ = t->force;
  for (PetscInt j = 0; j < HYCO_ESTIMATE_FEATURES; j++) *at++ = t->floor[j];
  for (PetscInt e = 0; e < HYCO_N_ESTIMATES; e++) {
    *at++ = t->has[e];
    for (PetscInt j = 0; j <= HYCO_ESTIMATE_FEATURES; j++) *at++ = t->law[e][j];
  }
  PetscCall(HycoH5WriteReal(h, "training/estimates", ESTIMATE_NUMBERS, 1, numbers));
  PetscCall(HycoH5WriteReal(h, "training/reached", HYCO_FEATURES, 1, t->reached));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Before the cast: a damaged number outside int's range would be undefined behaviour. */
static PetscBool IsCount(PetscReal x)
{
  return (PetscBool)(x >= 1 && x <= (PetscReal)PETSC_MAX_INT);
}

/* Median and largest held-out errors; absent in models that were not judged. */
static PetscErrorCode LoadHeldOut(HycoH5 h, HycoROM m)
{
  HycoEstimates *t = &m->model->estimates;
  PetscReal *numbers;
  PetscInt n = HELD_NUMBERS, one = 1;
  PetscBool good;

  PetscFunctionBegin;
  if (!HycoH5Has(h, "training/held_out")) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoH5LoadReal(h, "training/held_out", &n, &one, &numbers));
  /* Stored as a real beside the errors, one dataset instead of two. */
  good = IsCount(numbers[0]);
  t->n_held = good ? (PetscInt)numbers[0] : 0;
  for (PetscInt e = 0; e < HYCO_N_ESTIMATES; e++) {
    t->median[e] = numbers[1 + e];
    t->largest[e] = numbers[1 + HYCO_N_ESTIMATES + e];
    good = (PetscBool)(good && t->median[e] >= -1 && t->largest[e] >= t->median[e]);
  }
  PetscCall(PetscFree(numbers));
  HycoCheck(good, "%s: training/held_out is damaged", m->model->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Older files do not have it. */
static PetscErrorCode LoadCost(HycoH5 h, HycoROM m)
{
  PetscReal *cpu;
  PetscInt one = 1;

  PetscFunctionBegin;
  if (!HycoH5Has(h, "training/cpu")) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoH5LoadReal(h, "training/cpu", &one, &one, &cpu));
  m->model->estimates.cpu = *cpu;
  PetscCall(PetscFree(cpu));
  HycoCheck(m->model->estimates.cpu >= 0, "%s: training/cpu is damaged", m->model->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Older files have none of this. */
static PetscErrorCode LoadReached(HycoH5 h, HycoROM m)
{
  PetscReal *numbers;
  PetscInt n = HYCO_FEATURES, one = 1;
  PetscBool good = PETSC_TRUE;

  PetscFunctionBegin;
  /* -1: not known, and then not judged. */
  for (PetscInt j = 0; j < HYCO_FEATURES; j++) m->model->estimates.reached[j] = -1;
  if (!HycoH5Has(h, "training/reached")) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoH5LoadReal(h, "training/reached", &n, &one, &numbers));
  for (PetscInt j = 0; j < HYCO_FEATURES; j++) {
    m->model->estimates.reached[j] = numbers[j];
    good = (PetscBool)(good && numbers[j] >= 0);
  }
  PetscCall(PetscFree(numbers));
  HycoCheck(good, "%s: training/reached is damaged", m->model->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* training/trust of older files: no tail, no stress; count, floors, coefficients of u and of the forces, force. */
static PetscErrorCode LoadOldEstimates(HycoH5 h, HycoROM m)
{
  /* The tail is the last feature, which these files lack: its floor is 1 and its coefficient 0. */
  const PetscInt features = HYCO_ESTIMATE_FEATURES - 1;
  HycoEstimates *t = &m->model->estimates;
  PetscReal *numbers, *at;
  PetscInt n = 2 + features + 2 * (features + 1), one = 1;
  PetscBool good;

  PetscFunctionBegin;
  PetscCall(HycoH5LoadReal(h, "training/trust", &n, &one, &numbers));
  at = numbers;
  good = IsCount(*at);
  t->n = good ? (PetscInt)*at : 0;
  at++;
  t->floor[features] = 1;
  for (PetscInt j = 0; j < features; j++) {
    t->floor[j] = *at++;
    good = (PetscBool)(good && t->floor[j] > 0);
  }
  for (PetscInt k = 0; k < 2; k++) {
    PetscReal *law = t->law[k ? HYCO_ESTIMATE_LAMBDA : HYCO_ESTIMATE_U];

    for (PetscInt j = 0; j < features; j++) law[j] = *at++;
    law[HYCO_ESTIMATE_FEATURES] = *at++;
  }
  t->force = *at;
  t->has[HYCO_ESTIMATE_U] = PETSC_TRUE;
  t->has[HYCO_ESTIMATE_LAMBDA] = (PetscBool)(t->force > 0); /* without a force nothing was calibrated */
  PetscCall(PetscFree(numbers));
  HycoCheck(good && t->force >= 0, "%s: training/trust is damaged", m->model->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Older files do not have it. */
static PetscErrorCode LoadFollowed(HycoH5 h, HycoROM m)
{
  PetscReal *numbers;
  PetscInt n = m->model->scene->n_quantities, width = FOLLOWED_NUMBERS;

  PetscFunctionBegin;
  if (!HycoH5Has(h, "training/followed")) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoH5LoadReal(h, "training/followed", &n, &width, &numbers));
  for (PetscInt q = 0; q < n; q++) {
    HycoOutputEstimate *o = &m->model->estimates.output[q];

    o->norm = numbers[FOLLOWED_NUMBERS * q];
    o->relative = numbers[FOLLOWED_NUMBERS * q + 1];
    o->amplified = numbers[FOLLOWED_NUMBERS * q + 2];
  }
  PetscCall(PetscFree(numbers));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The estimates of outputs, which need the number of held-out points that LoadEstimates() has read. */
static PetscErrorCode LoadOutputEstimates(HycoH5 h, HycoROM m)
{
  HycoEstimates *t = &m->model->estimates;
  PetscReal *numbers, *at;
  PetscInt n = m->model->scene->n_quantities, width = OUTPUT_NUMBERS;
  PetscBool good = PETSC_TRUE;

  PetscFunctionBegin;
  if (!HycoH5Has(h, "training/outputs")) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoH5LoadReal(h, "training/outputs", &n, &width, &numbers));
  at = numbers;
  t->n_outputs = n;
  for (PetscInt q = 0; q < n; q++) {
    HycoOutputEstimate *o = &t->output[q];

    o->has = (PetscBool)(*at++ > 0.5);
    o->magnitude = *at++;
    o->median = *at++;
    o->largest = *at++;
    for (PetscInt j = 0; j <= HYCO_ESTIMATE_FEATURES; j++) o->law[j] = *at++;
    /* An estimate without held-out points or size cannot have been written. */
    good = (PetscBool)(good && (!o->has || (o->magnitude > 0 && t->n)));
  }
  PetscCall(PetscFree(numbers));
  HycoCheck(good, "%s: training/outputs is damaged", m->model->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The laws of the estimates, or those of older files under their former name. Every number is checked: a damaged file
   must not give a plausible estimate. */
static PetscErrorCode LoadEstimates(HycoH5 h, HycoROM m)
{
  HycoEstimates *t = &m->model->estimates;
  PetscReal *numbers, *at;
  PetscInt n = ESTIMATE_NUMBERS, one = 1;
  PetscBool good;

  PetscFunctionBegin;
  if (HycoH5Has(h, "training/search")) PetscCall(HycoH5LoadText(h, "training/search", &m->model->search));
  PetscCall(LoadHeldOut(h, m));
  PetscCall(LoadCost(h, m));
  PetscCall(LoadReached(h, m));
  /* Its numbers are of formulas with fewer features. */
  if (HycoH5Has(h, "training/trust")) PetscCall(LoadOldEstimates(h, m));
  if (!HycoH5Has(h, "training/estimates")) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoH5LoadReal(h, "training/estimates", &n, &one, &numbers));
  at = numbers;
  good = IsCount(*at);
  t->n = good ? (PetscInt)*at : 0;
  at++;
  t->force = *at++;
  for (PetscInt j = 0; j < HYCO_ESTIMATE_FEATURES; j++) {
    t->floor[j] = *at++;
    good = (PetscBool)(good && t->floor[j] > 0);
  }
  for (PetscInt e = 0; e < HYCO_N_ESTIMATES; e++) {
    t->has[e] = (PetscBool)(*at++ > 0.5);
    for (PetscInt j = 0; j <= HYCO_ESTIMATE_FEATURES; j++) t->law[e][j] = *at++;
  }
  PetscCall(PetscFree(numbers));
  HycoCheck(good && t->force >= 0, "%s: training/estimates is damaged", m->model->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes or reads; reading has an order, since the outputs' estimates refer to the others. */
static PetscErrorCode MoveEstimates(HycoH5 h, HycoROM m)
{
  PetscFunctionBegin;
  if (!HycoH5Reads(h)) {
    PetscCall(SaveEstimates(h, m));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(LoadEstimates(h, m));
  PetscCall(LoadOutputEstimates(h, m));
  PetscCall(LoadFollowed(h, m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sizes of the whole mesh, the kind of hybrid, and the numbers of snapshots' modes, in one dataset. */
static PetscErrorCode MoveSizes(HycoH5 h, HycoROM m)
{
  PetscInt sizes[6] = {m->model->whole_nodes, m->model->whole_cells, (PetscInt)m->model->hybrid,
                       m->model->counts[0],   m->model->counts[1],   m->model->counts[2]};

  PetscFunctionBegin;
  PetscCall(HycoH5Ints(h, "problem/sizes", 0, PETSC_MAX_INT, 6, sizes));
  m->model->whole_nodes = sizes[0];
  m->model->whole_cells = sizes[1];
  m->model->hybrid = (HycoHybrid)sizes[2];
  for (PetscInt k = 0; k < 3; k++) m->model->counts[k] = sizes[3 + k];
  /* An enumeration from a file: out of range it would index tables of names. */
  HycoCheck(sizes[2] <= HYCO_HYBRID_ALL && m->model->whole_nodes > 0 && m->model->whole_cells > 0,
            "%s: problem/sizes is damaged", m->model->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The search for masters on moved surfaces; files before format 5 have none, and keep the masters as drawn. */
static PetscErrorCode MoveReach(HycoH5 h, HycoROM m)
{
  PetscFunctionBegin;
  if (HycoH5Reads(h) ? !HycoH5Has(h, "problem/reach") : !m->model->pairs.room) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoH5Real(h, "problem/reach", &m->model->scene->n_contacts, 1, &m->model->master_reach));
  if (!HycoH5Reads(h)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoPairsSetSearch(m->model->scene, m->model->mesh, &m->model->pairs));
  for (PetscInt c = 0; c < m->model->scene->n_contacts; c++)
    HycoCheck(m->model->pairs.room && m->model->master_reach[c] >= 0, "%s: problem/reach is damaged", m->model->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The scene as text: a model needs neither the scene's folder nor its options afterwards. */
static PetscErrorCode MoveScene(HycoH5 h, HycoROM m)
{
  char *text;

  PetscFunctionBegin;
  PetscCall(HycoH5Reads(h) ? HycoH5LoadText(h, "problem/scene", &text) : HycoSceneToText(m->model->scene, &text));
  HycoFinally(HycoH5Reads(h) ? HycoSceneFromText(PETSC_COMM_SELF, text, &m->model->scene)
                             : HycoH5WriteText(h, "problem/scene", text),
              PetscCall(PetscFree(text)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Moves the type and its data. */
static PetscErrorCode MoveType(HycoH5 h, HycoROM m)
{
  PetscFunctionBegin;
  if (HycoH5Reads(h)) {
    PetscCall(LoadType(h, m));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoH5WriteText(h, "problem/type", m->model->type));
  PetscTryTypeMethod(m, save, h);
  if (!HycoH5Has(h, "reconstruction")) /* older readers require it for every type */
    PetscCall(HycoH5WriteReal(h, "reconstruction/S_lambda", 0, m->model->pairs.n, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Which program trained the model, from what; the fingerprint identifies the scene and mesh of its snapshots. */
static PetscErrorCode MoveProvenance(HycoH5 h, HycoROM m)
{
  char *text;

  PetscFunctionBegin;
  if (!HycoH5Reads(h)) {
    PetscCall(HycoH5WriteText(h, "training/provenance", m->model->provenance));
    PetscCall(HycoH5WriteText(h, "training/fingerprint", m->model->fingerprint));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoH5LoadText(h, "training/provenance", &m->model->provenance));
  PetscCall(HycoH5LoadText(h, "training/fingerprint", &text));
  /* A hash of fixed length: a longer text is cut and then differs. */
  PetscCall(PetscStrncpy(m->model->fingerprint, text, sizeof(m->model->fingerprint)));
  PetscCall(PetscFree(text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The sets A and I as a number per node; the dataset keeps its former name, so that models of older versions load. */
static PetscErrorCode MoveDomain(HycoH5 h, HycoROM m)
{
  PetscInt *sets = NULL;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  /* Two sets of nodes become one number per node, the form of older files. */
  if (!HycoH5Reads(h)) {
    PetscCall(PetscMalloc1(m->model->mesh->n_nodes, &sets));
    PetscCall(HycoROMGetDomain(m, sets));
  }
  ierr = HycoH5Int(h, "problem/role", 0, 2, &m->model->mesh->n_nodes, 1, &sets);
  if (!ierr && HycoH5Reads(h)) ierr = HycoROMSetDomain(m, sets);
  PetscCall(PetscFree(sets));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Moves everything except the whole mesh. */
static PetscErrorCode MoveProblem(HycoH5 h, HycoROM m)
{
  PetscInt n_dof, *nodes;

  PetscFunctionBegin;
  PetscCall(MoveScene(h, m));
  PetscCall(HycoMeshMove(h, "mesh", m->model->scene->n_bodies, &m->model->mesh));
  PetscCall(MoveTies(h, m));
  PetscCall(MoveSizes(h, m));
  /* Every index is checked against sizes that were read before it: the order of this function is the order of the
     checks. */
  nodes = &m->model->mesh->n_nodes;
  n_dof = *nodes * m->model->mesh->dim;
  PetscCall(HycoH5Int(h, "mesh/node_whole", 0, m->model->whole_nodes - 1, nodes, 1, &m->model->mesh->node_whole));
  PetscCall(HycoH5Int(h, "mesh/cell_whole", 0, m->model->whole_cells - 1, &m->model->mesh->n_cells, 1,
                      &m->model->mesh->cell_whole));
  if (HycoH5Reads(h)) PetscCall(HycoMeshCreateDM(m->model->scene, m->model->mesh));
  PetscCall(MoveDomain(h, m));
  PetscCall(MovePairs(h, *nodes, m->model->scene->n_contacts, &m->model->pairs));
  PetscCall(HycoH5Int(h, "problem/in_rid", 0, 1, &m->model->pairs.n, 1, &m->model->in_rid));
  PetscCall(MoveReach(h, m));
  if (HycoH5Reads(h) ? HycoH5Has(h, "problem/facet") : m->model->facet != NULL)
    PetscCall(HycoH5Real(h, "problem/facet", &m->model->pairs.n, 1, &m->model->facet));
  PetscCall(HycoFloatingMove(h, m));
  if (HycoH5Reads(h)) m->model->l = m->model->n_fe = m->model->n_points = -1;
  PetscCall(HycoH5Real(h, "problem/singular_values", &m->model->l, 1, &m->model->sigma));
  PetscCall(HycoH5Real(h, "problem/V", &n_dof, m->model->l, &m->model->V));
  PetscCall(HycoH5Int(h, "problem/fe_dof", 0, n_dof - 1, &m->model->n_fe, 1, &m->model->fe_dof));
  for (PetscInt k = 1; k < m->model->n_fe; k++)
    HycoCheck(m->model->fe_dof[k] > m->model->fe_dof[k - 1], "%s: problem/fe_dof is damaged", m->model->path);
  PetscCall(MoveType(h, m));
  PetscCall(HycoH5Real(h, "training/points", &m->model->n_points, m->model->scene->n_parameters, &m->model->points));
  PetscCall(HycoH5Reals(h, "training/numbers", 3, m->model->numbers));
  /* None in models of earlier versions. */
  if (HycoH5Reads(h) ? HycoH5Has(h, "training/time_error") : m->model->time_error > 0) {
    if (HycoH5Reads(h)) m->model->n_stops = -1;
    PetscCall(HycoH5Reals(h, "training/time_error", 1, &m->model->time_error));
    if (HycoH5Reads(h) ? HycoH5Has(h, "training/stops") : m->model->n_stops > 0)
      PetscCall(HycoH5Real(h, "training/stops", &m->model->n_stops, 1, &m->model->stops));
    else
      m->model->n_stops = 0;
  }
  if (HycoH5Reads(h) ? HycoH5Has(h, "training/closed") : m->model->closed != NULL)
    PetscCall(HycoH5Int(h, "training/closed", 0, 1, &m->model->pairs.n, 1, &m->model->closed));
  PetscCall(MoveEstimates(h, m));
  PetscCall(MoveProvenance(h, m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes everything except the whole mesh. */
static PetscErrorCode SaveProblem(HycoH5 h, HycoROM m)
{
  /* The oldest format that can hold the model, so that earlier versions still read what they know. */
  PetscInt format = m->model->pairs.room ? HYCO_ROM_MOVED : HYCO_ROM_STILL;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < m->model->pairs.n; k++) {
    if (HycoPairsAlone(m->model->scene, &m->model->pairs, k)) format = HYCO_ROM_MOVED;
  }
  if (m->model->scene->n_times) format = HYCO_ROM_PATHS;
  if (HycoSceneHasFriction(m->model->scene) && m->ops->reconstruct) format = HYCO_ROM_FORMAT;
  PetscCall(HycoH5WriteText(h, "kind", HYCO_ROM_KIND));
  PetscCall(HycoH5WriteInt(h, "format", 1, 1, &format));
  PetscCall(MoveProblem(h, m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0 has the problem; the whole mesh is written by rows from all ranks. */
static PetscErrorCode SaveAll(HycoH5 h, HycoROM m, HycoFOM mesh, PetscInt l, Mat V)
{
  PetscFunctionBegin;
  HycoOnRoot(HycoComm(mesh), SaveProblem(h, m));
  PetscCall(HycoROMWriteWhole(h, mesh, l, V));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Committed only if all went well on every rank; an error of the write counts before that of the close. */
PetscErrorCode HycoROMSave(HycoROM m, HycoFOM mesh, PetscInt l, Mat V, const char path[])
{
  HycoH5 h;
  PetscErrorCode ierr, failed;

  PetscFunctionBegin;
  PetscCall(HycoH5CreateShared(HycoComm(mesh), path, &h));
  ierr = SaveAll(h, m, mesh, l, V);
  failed = HycoH5Close(&h, (PetscBool)!ierr);
  PetscCall(ierr ? ierr : failed);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fields, solutions and snapshots are HDF5 files too: the message says which file to give. A format that is too new or
   too old is refused before anything else is read. */
static PetscErrorCode CheckKind(HycoH5 h, const char path[])
{
  char *kind;
  PetscInt one = 1, *format, version, same;

  PetscFunctionBegin;
  HycoCheck(HycoH5Has(h, "kind"),
            "%s is not a hyco model (it may contain fields or a solution); give the file that hyco train wrote", path);
  PetscCall(HycoH5LoadText(h, "kind", &kind));
  same = strcmp(kind, HYCO_ROM_KIND) == 0;
  PetscCall(PetscFree(kind));
  HycoCheck(same, "%s is not a hyco model", path);
  PetscCall(HycoH5LoadInt(h, "format", 0, PETSC_MAX_INT, &one, &one, &format));
  version = *format;
  PetscCall(PetscFree(format));
  /* Both directions: a newer file may have datasets that change the meaning of those known here. */
  HycoCheck(version >= HYCO_ROM_OLDEST && version <= HYCO_ROM_FORMAT,
            "%s has model format %d, and this hyco (%s) reads formats %d to %d; train it again, or use the version "
            "that wrote it",
            path, (int)version, HycoVersion(), HYCO_ROM_OLDEST, HYCO_ROM_FORMAT);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads from an open file, and closes it; a refused file leaves no model. `path`: its name in messages. */
static PetscErrorCode RomFileLoad(HycoH5 *h, const char path[], HycoROM *model)
{
  HycoROM m;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  *model = NULL;
  PetscCall(HycoROMCreate(&m));
  PetscCall(PetscStrncpy(m->model->path, path, sizeof(m->model->path)));
  PetscCall(HycoLogEvent(HYCO_EVENT_LOAD, PETSC_TRUE));
  ierr = CheckKind(*h, m->model->path);
  if (!ierr) ierr = MoveProblem(*h, m);
  PetscCall(HycoLogEvent(HYCO_EVENT_LOAD, PETSC_FALSE));
  PetscCall(HycoH5Close(h, PETSC_FALSE));
  /* The scene in the file has a hyco: section: its options hold unless the command line differs. */
  if (!ierr) ierr = HycoSceneGiveOptions(m->model->scene, (PetscObject)m);
  if (!ierr) ierr = HycoROMSetFromOptions(m);
  /* The first error is the one to report. */
  if (ierr) (void)!HycoROMDestroy(&m);
  PetscCall(ierr);
  *model = m;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Not collective. The whole-mesh part stays in the file, whose path the model keeps. */
PetscErrorCode HycoROMLoad(const char path[], HycoROM *model)
{
  HycoH5 h;

  PetscFunctionBegin;
  PetscCheck(path && model, PETSC_COMM_SELF, PETSC_ERR_ARG_NULL,
             "HycoROMLoad: the path or the handle's address is NULL");
  *model = NULL;
  PetscCall(HycoH5OpenOr(path, "if it was a model, train it again", &h));
  PetscCall(RomFileLoad(&h, path, model));
  PetscCall(HycoROMViewFromOptions(*model, NULL, "-hyco_rom_view"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The bytes of the file without the whole mesh, which rank 0 sends to the other ranks. */
static PetscErrorCode MakeImage(HycoROM m, void **image, size_t *size)
{
  HycoH5 h;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoH5CreateImage("the model", &h));
  /* The file in memory: ranks get bytes and load them as a file, so that one code serves both. */
  ierr = SaveProblem(h, m);
  if (!ierr) ierr = HycoH5GetImage(h, image, size);
  PetscCall(HycoH5Close(&h, PETSC_FALSE));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads a model from these bytes. */
static PetscErrorCode FromImage(void *image, size_t size, HycoROM *model)
{
  HycoH5 h;

  PetscFunctionBegin;
  PetscCall(HycoH5OpenImage("the model", image, size, &h));
  PetscCall(RomFileLoad(&h, "", model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest message: an MPI count is an int. */
#define MOST_BYTES ((size_t)1 << 30)

/* As the bytes of a model file, so that what ranks get is what a file would give. In pieces, since the count of an
   MPI message is an int. */
PetscErrorCode HycoROMBroadcast(MPI_Comm comm, HycoROM *model)
{
  PetscMPIInt rank;
  void *image = NULL;
  size_t size = 0;
  PetscInt64 bytes;
  PetscErrorCode ierr = PETSC_SUCCESS;
  char message[HYCO_LINE] = "";

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (HycoSize(comm) == 1) PetscFunctionReturn(PETSC_SUCCESS);
  HycoOnRoot(comm, MakeImage(*model, &image, &size));
  bytes = (PetscInt64)size;
  PetscCallMPI(MPI_Bcast(&bytes, 1, MPIU_INT64, 0, comm));
  if (rank) PetscCall(PetscMalloc((size_t)bytes, &image));
  for (size_t at = 0; at < (size_t)bytes; at += MOST_BYTES)
    PetscCallMPI(
        MPI_Bcast((char *)image + at, (PetscMPIInt)PetscMin(MOST_BYTES, (size_t)bytes - at), MPI_BYTE, 0, comm));
  /* An earlier model of this rank, from before the scan. */
  if (rank) PetscCall(HycoROMDestroy(model));
  PetscCall(HycoCatchBegin());
  if (rank) ierr = FromImage(image, (size_t)bytes, model);
  PetscCall(HycoCatchEnd(ierr, message));
  PetscCall(PetscFree(image));
  PetscCall(HycoErrorSync(comm, ierr, message));
  PetscFunctionReturn(PETSC_SUCCESS);
}
