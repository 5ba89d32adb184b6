/*
  The search for settings: which settings of the reduction give the cheapest online model whose errors at the held-out
  points are small enough. The snapshots are read and their bases made once; an attempt truncates the bases, builds the
  RID and the model on it and predicts the held-out points.

  Only settings that no option fixes are varied. The settings of a kind are tried in the order of their cost, and the
  first that meet the targets end their kind. The cost is a count of operations, not a time, so that the choice is the
  same on any machine and number of ranks.

  If no settings meet the user's targets, solutions are added where the best model has the largest errors, and the
  search starts again. Next to an added solution the model is more accurate than elsewhere, so that its errors at those
  held-out points no longer show how accurate it is: fresh ones judge it. If it misses the targets there, the former
  held-out points become training points, and the search starts again with the fresh ones.
*/
#include <hycoreducerimpl.h>
#include <stdio.h>
#include <string.h>

/* Default targets: errors that most studies can ignore. */
static const PetscReal usual[HYCO_N_ERRORS] = {
    [HYCO_ERROR_U] = 2e-3, [HYCO_ERROR_SIGMA] = 2e-2, [HYCO_ERROR_LAMBDA] = 1e-2, [HYCO_ERROR_INELASTIC] = 2e-2};

#define EXTENSION     2.5 /* edges of the contact surface's facets */
#define MANY_UNKNOWNS 600 /* largest RID for which "all" is tried automatically: its reduced matrix is dense */
#define STALE                                                                                                          \
  3 /* attempts without progress that end a kind: a larger RID does not help if the basis lacks                        \
       solutions */
#define PROGRESS     0.95
#define WILD         50  /* multiple of the target: above it no attempt so far gives a useful model */
#define FEW_UNKNOWNS 300 /* a dense matrix of this size is cheap */
#define MAX_ATTEMPTS 64
#define ROUND        4   /* share of the training points that is added at a time, as a divisor */
#define TELLING      0.3 /* correlation above which a parameter explains the errors */
#define WHOLE        -1

/* Sizes of RIDs and bases, the cheapest first; layers WHOLE: the whole mesh. */
typedef struct {
  PetscReal tol;
  PetscInt layers;
  PetscBool extended;
} Size;
static const Size sizes[] = {{1e-5, 0, PETSC_FALSE}, {1e-5, 1, PETSC_FALSE},     {1e-7, 1, PETSC_FALSE},
                             {1e-7, 1, PETSC_TRUE},  {1e-10, 1, PETSC_FALSE},    {1e-10, 1, PETSC_TRUE},
                             {1e-13, 1, PETSC_TRUE}, {1e-10, 2, PETSC_TRUE},     {1e-13, 2, PETSC_TRUE},
                             {1e-13, 3, PETSC_TRUE}, {1e-13, WHOLE, PETSC_FALSE}};
enum { N_SIZES = sizeof(sizes) / sizeof(sizes[0]), FIRST_USUAL = 3 };

/* For paths, with the cells at a plane of symmetry as the RID, all displacements of A full order. */
static const PetscReal plane_tol[] = {1e-9, 1e-12, 1e-14};
enum { N_PLANES = sizeof(plane_tol) / sizeof(plane_tol[0]) };

typedef struct {
  HycoReducer t;
  HycoSnapshots store;
  const char *const *types;  /* the registered ones */
  HycoReducerSettings given; /* as given by the options */
  PetscReal extension;       /* of the settings that extend the contact */
  const char *plane;         /* plane of symmetry; NULL: none */
  PetscBool targets;         /* given by the user */
  PetscInt first;            /* number of training points that were given */
  PetscBool near;            /* solutions were added near the held-out points */
  PetscReal target[HYCO_N_ERRORS];
  PetscInt n;
  HycoAttempt attempt[MAX_ATTEMPTS];
  HycoHeldOut *rows[MAX_ATTEMPTS]; /* for paths: results of each attempt that was judged at all held-out points; else
                                      NULL */
  PetscReal force;                 /* HycoHeldOutForce() of the held-out points */
  PetscInt *order;                 /* held-out points, those with the largest errors in the last attempts first */
  PetscReal least, *ratio;         /* least ratio so far; ratios of the best model at its held-out points */
} Search;

void HycoReducerSettingsDescribe(const HycoReducerSettings *r, size_t length, char text[])
{
  const char *kind = HycoHybrids[r->hybrid];

  if (!r->rid)
    snprintf(text, length, "%s, pod_tol %g", r->type, (double)r->pod_tol);
  else if (r->whole)
    snprintf(text, length, "%s, pod_tol %g, hybrid %s, the whole mesh as RID", r->type, (double)r->pod_tol, kind);
  else
    snprintf(text, length, "%s, pod_tol %g, hybrid %s, layers %d, contact extension %.3g%s%s", r->type,
             (double)r->pod_tol, kind, (int)r->layers, (double)r->contact_extension, r->plane ? ", at " : "",
             r->plane ? r->plane : "");
}

void HycoReducerGetSettings(HycoReducer t, HycoReducerSettings *r)
{
  *r = (HycoReducerSettings){.type = t->prototype->type,
                             .rid = (PetscBool)(t->prototype->traits.settings == HYCO_SETTINGS_RID),
                             .pod_tol = t->tol[HYCO_SEED_DISPLACEMENT],
                             .contact_extension = t->extension,
                             .layers = t->layers,
                             .hybrid = t->hybrid,
                             .whole = t->whole_rid,
                             .ridge = -1};
}

/* The stress and force tolerances follow that of the displacement if they were equal to it. */
static PetscErrorCode SetSettings(HycoReducer t, const HycoReducerSettings *r)
{
  PetscFunctionBegin;
  PetscCall(HycoReducerSetType(t, r->type));
  for (PetscInt k = HYCO_SEED_STRESS; k <= HYCO_SEED_FORCE; k++) {
    if (t->tol[k] == t->tol[HYCO_SEED_DISPLACEMENT]) t->tol[k] = r->pod_tol;
  }
  t->tol[HYCO_SEED_INELASTIC] = t->tol[HYCO_SEED_STRESS];
  t->tol[HYCO_SEED_SPRING] = t->tol[HYCO_SEED_FORCE];
  t->tol[HYCO_SEED_DISPLACEMENT] = r->pod_tol;
  t->extension = r->contact_extension;
  t->layers = r->layers;
  t->hybrid = r->hybrid;
  t->whole_rid = (PetscBool)(r->whole || t->prototype->traits.whole);
  t->plane = r->plane;
  t->ridge = r->ridge;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal EdgeLength(HycoMesh m, PetscInt a, PetscInt b)
{
  PetscReal sum = 0;

  for (PetscInt c = 0; c < 3; c++)
    sum += (m->xyz[3 * a + c] - m->xyz[3 * b + c]) * (m->xyz[3 * a + c] - m->xyz[3 * b + c]);
  return PetscSqrtReal(sum);
}

/* Mean length of an edge of the slave surfaces' facets; 0 without any. Rank 0. */
static PetscErrorCode SurfaceEdge(HycoReducer t, PetscReal *mean)
{
  const HycoMesh m = t->fom->surface;
  PetscReal sum = 0;
  PetscInt n = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < t->scene->n_contacts; k++) {
    PetscInt g = 0;

    PetscCall(HycoMeshFindGroup(m, "contact", t->scene->contact[k]->slave, &g));
    for (PetscInt f = 0; f < m->n_facets; f++) {
      const PetscInt *node = m->facets + f * m->nf,
                     corners = HycoMeshIsQuadratic(m) ? HycoCellKinds[m->type].corners : HycoFacetCorners(m->nf, node);

      if (m->facet_group[f] != g || m->nf < 2) continue;
      for (PetscInt j = 0; j < corners; j++) sum += EdgeLength(m, node[j], node[(j + 1) % corners]);
      n += corners;
    }
  }
  *mean = n ? sum / n : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest quotient of an error and its target at a held-out point. */
static PetscReal Quotient(const Search *s, const HycoHeldOut *row)
{
  PetscReal ratio = 0;

  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) {
    if (s->target[j] > 0) ratio = PetscMax(ratio, HycoHeldOutError(row, (HycoErrorKind)j, s->force) / s->target[j]);
  }
  return ratio;
}

/* The errors at the held-out points that were predicted, and their largest quotient. */
static PetscErrorCode Summarise(Search *s, const HycoHeldOutRace *race, const HycoHeldOut rows[], HycoAttempt *a)
{
  HycoHeldOut *some;
  PetscReal force = s->force;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(race->n, &some));
  for (PetscInt k = 0; k < race->n; k++) some[k] = race->n == a->n_held ? rows[k] : rows[race->order[k]];
  if (race->n == a->n_held || !(force > 0)) force = HycoHeldOutForce(race->n, some);
  PetscCall(HycoHeldOutSummarise(race->n, some, force, &a->held_out));
  PetscCall(PetscFree(some));
  if (race->n == a->n_held && !a->held_out.not_converged) s->force = force;
  a->ratio = 0;
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) {
    if (!(s->target[j] > 0) || a->held_out.largest[j] / s->target[j] <= a->ratio) continue;
    a->ratio = a->held_out.largest[j] / s->target[j];
    a->worst = (HycoErrorKind)j;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reorders the points: the next attempt begins with those where this one had the largest errors; for a dropped one,
   with the one at which it was dropped. */
static PetscErrorCode Reorder(Search *s, const HycoHeldOutRace *race, const HycoHeldOut rows[], PetscInt n)
{
  PetscReal *key;
  PetscInt *order = s->order, last = race->n - 1;

  PetscFunctionBegin;
  if (race->n < n) {
    const PetscInt point = order[last];

    PetscCall(PetscArraymove(order + 1, order, last));
    order[0] = point;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc1(n, &key));
  for (PetscInt k = 0; k < n; k++) {
    key[k] = -Quotient(s, &rows[k]);
    order[k] = k;
  }
  PetscCall(PetscSortRealWithArrayInt(n, key, order));
  PetscCall(PetscFree(key));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Judges the model at the held-out points; for paths only until it is clear that the settings will not be chosen,
   unless `all` is set. */
static PetscErrorCode Judge(Search *s, HycoROM model, PetscBool all, HycoAttempt *a)
{
  HycoReducer t = s->t;
  const PetscInt n = a->n_held;
  PetscInt beaten;
  HycoHeldOut *rows;
  HycoHeldOutRace race = {
      .order = s->order, .target = s->target, .force = s->force, .all = (PetscBool)(all || t->exhaustive)};

  PetscFunctionBegin;
  race.most = HycoAttemptsLimit(s->n - 1, s->attempt, a->cost, &beaten);
  PetscCall(PetscCalloc1(n, &rows));
  s->rows[s->n - 1] = rows;
  PetscCall(HycoReducerPredictHeldOut(t, model, s->store, t->scene->n_times ? &race : NULL, rows));
  if (!t->scene->n_times) race.n = n;
  PetscCall(Summarise(s, &race, rows, a));
  if (race.lost) {
    a->dropped_at = s->order[race.n - 1];
    a->beaten_by = a->held_out.not_converged ? 0 : beaten;
  }
  for (PetscInt k = 0; k < race.n && a->ratio <= s->least && !a->beaten_by; k++) {
    const PetscInt point = race.n < n ? s->order[k] : k;

    s->ratio[point] = Quotient(s, &rows[point]);
  }
  if (!a->beaten_by) s->least = PetscMin(s->least, a->ratio);
  if (t->scene->n_times) PetscCall(Reorder(s, &race, rows, n));
  if (race.n < n || !t->scene->n_times) PetscCall(PetscFree(s->rows[s->n - 1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes the bases for the current settings, and the type's own modes. */
static PetscErrorCode TakeModes(HycoReducer t, HycoSnapshots store)
{
  PetscFunctionBegin;
  PetscCall(HycoReducerTakeBases(t));
  if (t->prototype->ops->begin) PetscCall((*t->prototype->ops->begin)(t));
  if (t->prototype->ops->modes) HycoStaged(HYCO_STAGE_FULL_ORDER, (*t->prototype->ops->modes)(t, store));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes bases, RID and model for the current settings, and judges the model. */
static PetscErrorCode BuildAndJudge(Search *s, PetscBool all, HycoAttempt *a)
{
  HycoReducer t = s->t;
  HycoTraining report = {0};
  HycoROM model;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(TakeModes(t, s->store));
  PetscCall(HycoReducerBuild(t, PETSC_FALSE, &model, &report));
  a->n_modes = report.n_modes;
  a->n_fe_dofs = report.n_fe_dofs;
  a->n_flexibilities = report.n_flexibilities;
  a->rid_nodes = report.rid_nodes;
  a->rid_elements = report.rid_elements;
  a->rid_contacts = report.rid_contacts;
  a->rid_fraction = report.rid_fraction;
  a->cost = t->prototype->ops->cost ? (*t->prototype->ops->cost)(t, a) : 0;
  PetscCallMPI(MPI_Bcast(&t->ridge, 1, MPIU_REAL, 0, HycoComm(t)));
  a->settings.ridge = t->ridge;
  ierr = Judge(s, model, all, a); /* a model may refuse to predict */
  PetscCall(HycoROMDestroy(&model));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Builds a model with these settings and judges it, at all held-out points or as far as necessary; an error becomes
   a failed attempt. Collective. */
static PetscErrorCode Try(Search *s, const HycoReducerSettings *settings, PetscBool all)
{
  HycoReducer t = s->t;
  HycoAttempt *a = &s->attempt[s->n];
  PetscErrorCode ierr;
  char message[HYCO_LINE], what[HYCO_LINE];

  PetscFunctionBegin;
  if (s->n == MAX_ATTEMPTS) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMemzero(a, sizeof(*a)));
  a->number = ++s->n;
  a->settings = *settings;
  a->ratio = PETSC_INFINITY;
  a->dropped_at = -1;
  PetscCall(HycoSamplesGet(t->held, &a->n_held, NULL, NULL));
  HycoReducerSettingsDescribe(settings, sizeof(what), what);
  HycoFormat(t->doing, "settings %d, %s", (int)a->number, what);
  t->most_full_order =
      t->pinned[HYCO_CHOICE_HYBRID] || settings->hybrid != HYCO_HYBRID_ALL || settings->plane ? 0 : MANY_UNKNOWNS;
  PetscCall(SetSettings(t, settings));
  PetscCall(HycoCatchBegin());
  t->trying = PETSC_TRUE;
  ierr = BuildAndJudge(s, all, a);
  t->trying = PETSC_FALSE;
  t->doing[0] = '\0';
  PetscCall(HycoCatchEnd(ierr, message));
  t->most_full_order = 0;
  PetscCall(HycoCatchNoModel(ierr, message));
  if (message[0]) a->ratio = PETSC_INFINITY;
  PetscCall(PetscStrncpy(a->failure, message, sizeof(a->failure)));
  if (t->attempt) HycoOnRoot(HycoComm(t), t->attempt(a, t->attempt_ctx));
  if (t->phase) HycoOnRoot(HycoComm(t), t->phase("settings tried", s->n, 0, t->phase_ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The settings of a size where no option fixes them. */
static HycoReducerSettings SettingsFor(const Search *s, const Size *size)
{
  const PetscBool *pinned = s->t->pinned;
  HycoReducerSettings r = s->given;

  if (!pinned[HYCO_CHOICE_TOLERANCE]) r.pod_tol = size->tol;
  if (!pinned[HYCO_CHOICE_LAYERS]) r.layers = PetscMax(size->layers, 0);
  if (!pinned[HYCO_CHOICE_EXTENSION]) r.contact_extension = size->extended ? s->extension : 0;
  if (!pinned[HYCO_CHOICE_WHOLE]) r.whole = (PetscBool)(size->layers == WHOLE);
  return r;
}

static PetscBool Same(const HycoReducerSettings *a, const HycoReducerSettings *b)
{
  return (PetscBool)(strcmp(a->type, b->type) == 0 && a->pod_tol == b->pod_tol && a->layers == b->layers &&
                     a->whole == b->whole && a->contact_extension == b->contact_extension && a->hybrid == b->hybrid &&
                     a->plane == b->plane);
}

/* Whether the whole mesh as RID gives a useful model: not if every unknown would be full order, unless there are
   few. */
static PetscBool WholeIsSmall(HycoReducer t, HycoHybrid hybrid)
{
  const PetscBool all = (PetscBool)(hybrid == HYCO_HYBRID_ALL || 2 * t->sizes[2] > t->sizes[0]);

  return (PetscBool)(!all || t->sizes[0] * t->sizes[3] <= FEW_UNKNOWNS);
}

/* Tries the sizes in order until one meets the targets, without those that do not differ in the settings that the
   type reads. Dropped attempts on paths do not show whether there is progress: all sizes are tried. */
static PetscErrorCode TrySizes(Search *s, const HycoROM type, HycoHybrid hybrid, PetscBool *met)
{
  const PetscInt first = s->n;
  PetscReal least = PETSC_INFINITY;

  PetscFunctionBegin;
  *met = PETSC_FALSE;
  for (PetscInt k = s->targets ? 0 : FIRST_USUAL, stale = 0; k < N_SIZES && stale < STALE && !*met; k++) {
    HycoReducerSettings r = SettingsFor(s, &sizes[k]);
    PetscBool done = PETSC_FALSE;

    r.type = type->type;
    r.rid = (PetscBool)(type->traits.settings == HYCO_SETTINGS_RID);
    r.hybrid = s->t->pinned[HYCO_CHOICE_HYBRID] ? s->given.hybrid : hybrid;
    if (!r.rid) {
      r.layers = s->given.layers;
      r.contact_extension = s->given.contact_extension;
      r.whole = s->given.whole;
    }
    for (PetscInt j = first; j < s->n; j++) done = (PetscBool)(done || Same(&r, &s->attempt[j].settings));
    if (done || (r.whole && !s->given.whole && !WholeIsSmall(s->t, hybrid))) continue;
    PetscCall(Try(s, &r, PETSC_FALSE));
    stale = least > WILD || s->attempt[s->n - 1].ratio < PROGRESS * least || s->t->scene->n_times ? 0 : stale + 1;
    least = PetscMin(least, s->attempt[s->n - 1].ratio);
    *met = (PetscBool)(least <= 1);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Counts the contacts whose slave is in a group of supports. */
static PetscErrorCode CountContacts(HycoReducer t, const char group[], PetscInt *n)
{
  const HycoMesh m = t->fom->surface;
  const HycoPairs *pairs = &t->fom->pairs;
  PetscBool *in;
  PetscInt g = 0;

  PetscFunctionBegin;
  *n = 0;
  PetscCall(HycoMeshFindGroup(m, "fixed", group, &g));
  PetscCall(PetscCalloc1(m->n_nodes, &in));
  for (PetscInt k = m->group_start[g]; k < m->group_start[g + 1]; k++) in[m->group_node[k]] = PETSC_TRUE;
  for (PetscInt k = 0; k < pairs->n; k++) *n += in[HycoPairsSlave(pairs, k)];
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The support that is most probably a plane of symmetry across the contacts: it fixes one component at 0, and most
   of the contacts have nodes on it; the first among equals; -1: none. Rank 0. */
static PetscErrorCode FindPlane(HycoReducer t, PetscInt *plane)
{
  const HycoScene s = t->scene;
  PetscBool every[HYCO_MAX_PARAMETERS];
  PetscInt most = 2;

  PetscFunctionBegin;
  *plane = -1;
  for (PetscInt p = 0; p < HYCO_MAX_PARAMETERS; p++) every[p] = PETSC_TRUE;
  for (PetscInt k = 0; k < s->n_fixed; k++) {
    const PetscReal origin[3] = {0, 0, 0};
    PetscInt held = 0, n;
    PetscReal value = 0;

    for (PetscInt c = 0; c < 3; c++) {
      const HycoExpr e = s->fixed[k].value[c];

      if (!e) continue;
      held++;
      if (HycoExprInSpace(e) || HycoExprChanges(e, every)) value = 1;
      if (value == 0) PetscCall(HycoExprEval(e, t->fom->fe_surface->mu, 1, origin, &value));
    }
    if (held != 1 || value != 0) continue;
    PetscCall(CountContacts(t, s->fixed[k].group, &n));
    if (n <= most) continue;
    most = n;
    *plane = k;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerFindPlane(HycoReducer t, const char **group)
{
  PetscInt plane = -1;

  PetscFunctionBegin;
  if (t->scene->n_times && t->sizes[3] == 3) HycoOnRoot(HycoComm(t), FindPlane(t, &plane));
  PetscCallMPI(MPI_Bcast(&plane, 1, MPIU_INT, 0, HycoComm(t)));
  *group = plane < 0 ? NULL : t->scene->fixed[plane].group;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For paths, the equations in a small RID hardly determine modes that no load affects there, unless the RID cuts the
   bodies from side to side. The cells at a plane of symmetry do, and all nodes of the plane are inside. */
static PetscErrorCode TryPlanes(Search *s, const HycoROM type, PetscBool *met)
{
  const PetscBool *pinned = s->t->pinned;

  PetscFunctionBegin;
  *met = PETSC_FALSE;
  if (!s->plane || s->given.whole || (pinned[HYCO_CHOICE_HYBRID] && s->given.hybrid != HYCO_HYBRID_ALL))
    PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < N_PLANES && !*met; k++) {
    const Size size = {plane_tol[k], 0, PETSC_FALSE};
    HycoReducerSettings r = SettingsFor(s, &size);

    r.type = type->type;
    r.rid = PETSC_TRUE;
    r.hybrid = HYCO_HYBRID_ALL;
    r.plane = s->plane;
    if (k && pinned[HYCO_CHOICE_TOLERANCE]) break;
    PetscCall(Try(s, &r, PETSC_FALSE));
    *met = (PetscBool)(s->attempt[s->n - 1].ratio <= 1);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Tries all of A full order, if "auto" keeps the contacts' displacements and is not accurate enough. */
static PetscErrorCode TryHybrids(Search *s, const HycoROM type)
{
  PetscBool met = PETSC_FALSE;

  PetscFunctionBegin;
  if (strcmp(type->type, HYCO_ROM_HYBRID) == 0) PetscCall(TryPlanes(s, type, &met));
  if (met) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(TrySizes(s, type, HYCO_HYBRID_AUTO, &met));
  if (!met && !s->t->pinned[HYCO_CHOICE_HYBRID] && s->t->sizes[2]) PetscCall(TrySizes(s, type, HYCO_HYBRID_ALL, &met));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One attempt, for a type whose online cost hardly depends on the modes. */
static PetscErrorCode TryOne(Search *s, const HycoROM type)
{
  const Size size = {1e-12, 1, PETSC_FALSE};
  HycoReducerSettings r = SettingsFor(s, &size);

  PetscFunctionBegin;
  r.type = type->type;
  r.rid = PETSC_FALSE;
  PetscCall(Try(s, &r, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TryType(Search *s, const char name[])
{
  HycoReducer t = s->t;
  HycoROM type;
  PetscBool met, wanted;

  PetscFunctionBegin;
  PetscCall(HycoROMCreate(&type));
  PetscCall(HycoROMSetType(type, name));
  if (t->pinned[HYCO_CHOICE_TYPE])
    wanted = (PetscBool)(strcmp(name, s->given.type) == 0);
  else
    wanted = type->ops->offers && (type->traits.history || !t->scene->n_times) ? (*type->ops->offers)(t, s->targets)
                                                                               : PETSC_FALSE;
  if (wanted && type->traits.settings == HYCO_SETTINGS_NONE) PetscCall(TryOne(s, type));
  if (wanted && type->traits.settings == HYCO_SETTINGS_RID) PetscCall(TryHybrids(s, type));
  if (wanted && type->traits.settings == HYCO_SETTINGS_MODES) PetscCall(TrySizes(s, type, HYCO_HYBRID_AUTO, &met));
  PetscCall(HycoROMDestroy(&type));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Tries all types in the order of their names. */
static PetscErrorCode TryAll(Search *s)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; s->types[k]; k++) PetscCall(TryType(s, s->types[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The attempt chosen so far; a dropped one that may be chosen now is judged first. */
static PetscErrorCode Choose(Search *s, HycoAttempt **chosen)
{
  HycoAttempt *again;

  PetscFunctionBegin;
  while (s->n < MAX_ATTEMPTS && (again = HycoAttemptsReopen(s->n, s->attempt))) {
    const HycoReducerSettings settings = again->settings;

    again->reopened = PETSC_TRUE;
    PetscCall(Try(s, &settings, PETSC_TRUE));
  }
  *chosen = HycoAttemptsChoose(s->n, s->attempt);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether all settings are fixed, or there are no held-out points. */
static PetscBool Settled(HycoReducer t)
{
  PetscBool open = PETSC_FALSE;

  for (PetscInt k = 0; k < HYCO_CHOICE_WHOLE; k++) open = (PetscBool)(open || !t->pinned[k]);
  if (t->pinned[HYCO_CHOICE_TYPE] && t->prototype->traits.settings == HYCO_SETTINGS_NONE) open = PETSC_FALSE;
  return (PetscBool)(!t->search || !t->held || !open);
}

/* Correlation of the held-out points' errors with their distance from the nearest training value of parameter p. */
static PetscReal Correlation(const Search *s, PetscInt n, const PetscReal held[], PetscInt n_train,
                             const PetscReal train[], PetscInt p)
{
  const PetscInt n_par = s->t->scene->n_parameters;
  PetscReal mean[2] = {0, 0}, square[2] = {0, 0}, both = 0;

  for (PetscInt pass = 0; pass < 2; pass++) {
    for (PetscInt k = 0; k < n; k++) {
      PetscReal x = PETSC_MAX_REAL;
      const PetscReal y = PetscLogReal(PetscMin(PetscMax(s->ratio[k], 1e-6), 1e6));

      for (PetscInt i = 0; i < n_train; i++) x = PetscMin(x, PetscAbsReal(train[i * n_par + p] - held[k * n_par + p]));
      if (!pass) {
        mean[0] += x / n;
        mean[1] += y / n;
      } else {
        square[0] += (x - mean[0]) * (x - mean[0]);
        square[1] += (y - mean[1]) * (y - mean[1]);
        both += (x - mean[0]) * (y - mean[1]);
      }
    }
  }
  return square[0] > 0 && square[1] > 0 ? both / PetscSqrtReal(square[0] * square[1]) : 0;
}

/* Adds unseen points, each near one of the held-out points with the largest errors, which stay unseen; and finds the
   parameter whose training values are too far apart (-1: none in particular). */
static PetscErrorCode AddPoints(Search *s, HycoSamples samples, PetscInt n_add, PetscInt *added, PetscInt *by)
{
  HycoReducer t = s->t;
  const PetscInt n_par = t->scene->n_parameters, among = 8 * n_add;
  PetscInt n, n_train, m, *order;
  const PetscReal *held, *train, *mu;
  PetscReal *key, largest = TELLING;
  PetscBool *used;
  HycoSamples drawn, unseen;

  PetscFunctionBegin;
  *added = 0;
  PetscCall(HycoSamplesGet(t->held, &n, NULL, &held));
  PetscCall(HycoSamplesGet(samples, &n_train, NULL, &train));
  *by = -1;
  for (PetscInt p = 0; p < n_par; p++) {
    const PetscReal c = Correlation(s, n, held, n_train, train, p);

    if (c > largest) {
      largest = c;
      *by = p;
    }
  }
  PetscCall(HycoSamplesUnseen(samples, t->drawn, among, 1, NULL, &drawn));
  t->drawn += among;
  PetscCall(HycoSamplesExcept(drawn, t->held, &unseen));
  PetscCall(HycoSamplesDestroy(&drawn));
  PetscCall(HycoSamplesGet(unseen, &m, NULL, &mu));
  PetscCall(PetscMalloc2(n, &key, n, &order));
  PetscCall(PetscCalloc1(m, &used));
  for (PetscInt k = 0; k < n; k++) {
    key[k] = -s->ratio[k];
    order[k] = k;
  }
  PetscCall(PetscSortRealWithArrayInt(n, key, order));
  for (PetscInt k = 0; k < PetscMin(n, n_add); k++) {
    PetscReal least = PETSC_MAX_REAL;
    PetscInt at = -1;

    for (PetscInt j = 0; j < m; j++) {
      const PetscReal d = HycoEstimatesDistance(t->scene, held + order[k] * n_par, mu + j * n_par);

      if (used[j] || d >= least) continue;
      least = d;
      at = j;
    }
    if (at < 0) break;
    used[at] = PETSC_TRUE;
    PetscCall(HycoSamplesAddPoint(samples, mu + at * n_par));
    ++*added;
  }
  PetscCall(PetscFree2(key, order));
  PetscCall(PetscFree(used));
  PetscCall(HycoSamplesDestroy(&unseen));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Frees the data of attempts. */
static void Forget(Search *s)
{
  for (PetscInt k = 0; k < s->n; k++) (void)!PetscFree(s->rows[k]);
  (void)!PetscFree2(s->ratio, s->order);
  s->n = 0;
  s->force = 0;
}

/* Tries all settings that are not fixed, with the present bases. */
static PetscErrorCode Attempts(Search *s)
{
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(s->t->held, &n, NULL, NULL));
  Forget(s);
  PetscCall(PetscMalloc2(n, &s->ratio, n, &s->order));
  for (PetscInt k = 0; k < n; k++) {
    s->ratio[k] = 1; /* until an attempt gives another value */
    s->order[k] = k;
  }
  s->least = PETSC_INFINITY;
  PetscCall(TryAll(s));
  if (s->t->phase) HycoOnRoot(HycoComm(s->t), s->t->phase("settings tried", s->n, s->n, s->t->phase_ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Begins *grown with the first training points, unless it has begun. The caller owns it. */
static PetscErrorCode BeginGrown(Search *s, HycoSamples *grown)
{
  PetscFunctionBegin;
  if (*grown) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSamplesCreate(s->t->scene, grown));
  PetscCall(HycoSamplesAddSet(*grown, s->t->samples));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Trains on these points from now on; solves those that are not solved. */
static PetscErrorCode TrainOn(Search *s, HycoSamples grown)
{
  HycoReducer t = s->t;

  PetscFunctionBegin;
  t->samples = grown;
  PetscCall(HycoReducerCount(t));
  PetscCall(HycoReducerResetBases(t));
  HycoStaged(HYCO_STAGE_FULL_ORDER, HycoSnapshotsFill(s->store, grown, t->progress, t->progress_ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Attempts, and solutions added until the targets are met or the budget is used up: in *grown, with the first ones
   (NULL: none was added; the caller owns it). */
static PetscErrorCode Rounds(Search *s, HycoSamples *grown, HycoTraining *report)
{
  HycoReducer t = s->t;
  const PetscInt budget = t->budget < 0 ? s->first : t->budget;
  PetscInt by = -1, n;

  PetscFunctionBegin;
  for (;;) {
    const PetscInt left = budget - (report->n_added - report->n_former),
                   n_add = PetscMin(PetscMax(2, s->first / ROUND), left);

    PetscCall(HycoReducerReduce(t, s->store, PETSC_TRUE));
    PetscCall(Attempts(s));
    if (!s->targets || s->least <= 1 || n_add < 1 || !t->scene->n_parameters) break;
    PetscCall(BeginGrown(s, grown));
    PetscCall(AddPoints(s, *grown, n_add, &n, &by));
    if (!n) break;
    report->n_added += n;
    s->near = PETSC_TRUE;
    if (t->added) HycoOnRoot(HycoComm(t), t->added(n, by, PETSC_FALSE, t->attempt_ctx));
    PetscCall(TrainOn(s, *grown));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Builds the model with the best settings; if the scan of the ranges or its own training solutions refuse it, the
   next one. */
static PetscErrorCode BuildBest(Search *s, HycoROM *model, HycoTraining *report)
{
  HycoReducer t = s->t;
  HycoAttempt *best = NULL;
  PetscErrorCode ierr;
  char message[HYCO_LINE] = "";

  PetscFunctionBegin;
  for (;;) {
    HycoTraining built = {0};

    PetscCall(Choose(s, &best));
    if (!best) break;
    PetscCall(SetSettings(t, &best->settings));
    PetscCall(TakeModes(t, s->store));
    PetscCall(HycoCatchBegin());
    ierr = HycoReducerBuild(t, PETSC_TRUE, model, &built);
    PetscCall(HycoCatchEnd(ierr, message));
    PetscCall(HycoCatchNoModel(ierr, message));
    if (message[0]) {
      PetscCall(PetscStrncpy(best->failure, message, sizeof(best->failure)));
      continue;
    }
    built.n_added = report->n_added;
    built.n_former = report->n_former;
    built.n_fresh = report->n_fresh;
    *report = built;
    report->chosen = *best;
    report->chosen.of = s->n;
    t->judged_held = s->rows[best->number - 1];
    s->rows[best->number - 1] = NULL;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt k = s->n - 1; k > 0 && !best; k--) { /* one that is not refused for its cost */
    if (s->attempt[k].settings.hybrid != HYCO_HYBRID_ALL) best = &s->attempt[k];
  }
  HycoFail("none of %d settings gave a model; the error of one of them: %s", (int)s->n,
           (best ? best : &s->attempt[0])->failure);
}

/* Judges the model at fresh held-out points. met: at these and at the former ones it meets the targets. */
static PetscErrorCode JudgeFresh(Search *s, HycoROM model, HycoSamples *former, HycoTraining *report, PetscBool *met)
{
  HycoReducer t = s->t;
  PetscInt n;

  PetscFunctionBegin;
  HycoStaged(HYCO_STAGE_FULL_ORDER, HycoReducerHoldOutFresh(t, s->store, former, &report->n_fresh));
  s->near = PETSC_FALSE;
  PetscCall(PetscFree(t->judged_held));
  PetscCall(HycoSamplesGet(t->held, &n, NULL, NULL));
  PetscCall(PetscMalloc1(n, &t->judged_held));
  PetscCall(HycoReducerPredictHeldOut(t, model, s->store, NULL, t->judged_held));
  s->force = HycoHeldOutForce(n, t->judged_held);
  *met = (PetscBool)(s->least <= 1);
  for (PetscInt k = 0; k < n; k++) *met = (PetscBool)(*met && Quotient(s, &t->judged_held[k]) <= 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Builds the best model. If solutions were added near its held-out points, and it misses the targets at fresh ones, or
   missed them at the former, these become training points: *again. */
static PetscErrorCode Conclude(Search *s, HycoROM *model, HycoSamples *grown, HycoTraining *report, PetscBool *again)
{
  HycoReducer t = s->t;
  HycoSamples former;
  PetscBool met = PETSC_FALSE;
  PetscInt n;

  PetscFunctionBegin;
  *again = PETSC_FALSE;
  PetscCall(BuildBest(s, model, report));
  if (!s->near) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(JudgeFresh(s, *model, &former, report, &met));
  if (!met) {
    *again = PETSC_TRUE;
    PetscCall(PetscFree(t->judged_held));
    PetscCall(HycoROMDestroy(model));
    PetscCall(HycoSamplesGet(former, &n, NULL, NULL));
    report->n_added += n;
    report->n_former += n;
    if (t->added) HycoOnRoot(HycoComm(t), t->added(n, -1, PETSC_TRUE, t->attempt_ctx));
    PetscCall(HycoSamplesAddSet(*grown, former));
    PetscCall(TrainOn(s, *grown));
  }
  PetscCall(HycoSamplesDestroy(&former));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Learn(Search *s, HycoROM *model, HycoSamples *grown, HycoTraining *report)
{
  HycoReducer t = s->t;
  PetscReal edge = 0;
  PetscBool again = PETSC_TRUE;

  PetscFunctionBegin;
  HycoReducerGetSettings(t, &s->given);
  HycoOnRoot(HycoComm(t), SurfaceEdge(t, &edge));
  PetscCallMPI(MPI_Bcast(&edge, 1, MPIU_REAL, 0, HycoComm(t)));
  s->extension = EXTENSION * edge;
  PetscCall(HycoReducerFindPlane(t, &s->plane));
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) s->targets = (PetscBool)(s->targets || t->target[j] > 0);
  PetscCall(PetscArraycpy(s->target, s->targets ? t->target : usual, HYCO_N_ERRORS));
  PetscCall(HycoSamplesGet(t->samples, &s->first, NULL, NULL));
  while (again) {
    PetscCall(Rounds(s, grown, report));
    PetscCall(Conclude(s, model, grown, report, &again));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerLearn(HycoReducer t, HycoSnapshots store, HycoROM *model, HycoSamples *grown,
                                HycoTraining *report)
{
  Search *s;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  *grown = NULL;
  t->plane = NULL;
  if (Settled(t)) {
    PetscCall(HycoReducerReduce(t, store, PETSC_FALSE));
    PetscCall(TakeModes(t, store));
    PetscCall(HycoReducerBuild(t, PETSC_TRUE, model, report));
    HycoReducerGetSettings(t, &report->chosen.settings);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscNew(&s));
  s->t = t;
  s->store = store;
  PetscCall(HycoROMTypeNames(&s->types));
  ierr = Learn(s, model, grown, report);
  Forget(s);
  PetscCall(PetscFree(s));
  t->ridge = -1;
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
