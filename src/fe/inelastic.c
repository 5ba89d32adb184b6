/*
  A time step of bodies with a history: strains of the displacement at the integration points, evaluation of the laws in
  batches, their stresses as nodal forces, and their consistent tangents in place of fe's. A point's reals in a state
  are

    strain (n_sigma), stress (n_sigma), temperature, thermal strain, stored energy, accumulated inelastic strain,
    the law's state variables
*/
#include <hycoinelastic.h>
#include <hycokinematics.h>
#include <hycomaterialimpl.h>

#define BATCH              16 /* cells of one body whose points a law evaluates together */
#define NO_TEMPERATURE_YET -1 /* temperature of a point before its first step */
#define N_PLAIN            4
/* Displacements as a share of the mesh's length, at which laws are tried for whether they yield: above any small
   displacement. */
#define LARGE_DISPLACEMENT 0.3
#define STRESS_ROUND_OFFS  256 /* units of round-off in what a stress loses */

struct _n_HycoFEState {
  PetscInt n_cells, *start; /* n_cells + 1 */
  PetscReal *value;
  PetscInt n_names;
  char **name; /* of the laws' state variables */
};

/* The position of a point's reals. */
typedef struct {
  PetscReal *strain, *stress, *temperature, *thermal, *stored, *accumulated, *variable;
} Point;

/* Laws of different bodies have different numbers of variables; a cell has one law. */
static PetscInt PointSize(HycoFE fe, PetscInt cell)
{
  return 2 * fe->n_sigma + N_PLAIN + fe->scene->body[fe->mesh->cell_body[cell]].law->n_state;
}

/* Pointers into the packed state; nothing is copied. */
static Point PointAt(HycoFE fe, HycoFEState state, PetscInt cell, PetscInt q)
{
  PetscReal *value = state->value + state->start[cell] + q * PointSize(fe, cell);
  PetscReal *plain = value + 2 * fe->n_sigma;
  const Point p = {value, value + fe->n_sigma, plain, plain + 1, plain + 2, plain + 3, plain + N_PLAIN};

  return p;
}

/* NULL-safe, also for no address. */
PetscErrorCode HycoFEStateDestroy(HycoFEState *state)
{
  PetscFunctionBegin;
  if (!state || !*state) PetscFunctionReturn(PETSC_SUCCESS);
  HycoFreeAll(&(*state)->start, &(*state)->value);
  for (PetscInt k = 0; k < (*state)->n_names; k++) PetscCall(PetscFree((*state)->name[k]));
  HycoFreeAll(&(*state)->name, state);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lists the names of the laws' variables without repetition. */
static PetscErrorCode ListNames(HycoScene scene, HycoFEState s)
{
  PetscInt room = 0;

  PetscFunctionBegin;
  for (PetscInt b = 0; b < scene->n_bodies; b++) room += scene->body[b].law->n_state;
  PetscCall(PetscCalloc1(room, &s->name));
  for (PetscInt b = 0; b < scene->n_bodies; b++) {
    const HycoMaterial law = scene->body[b].law;

    for (PetscInt k = 0; law->state_name && k < law->n_state; k++) {
      PetscBool seen = PETSC_FALSE;

      for (PetscInt j = 0; j < s->n_names && !seen; j++) PetscCall(PetscStrcmp(s->name[j], law->state_name[k], &seen));
      /* Laws of one kind in several bodies have the same variables. */
      if (!seen) PetscCall(PetscStrallocpy(law->state_name[k], &s->name[s->n_names++]));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Zero except for the temperature, which tells a first step: a rise from an unknown temperature is no strain. */
PetscErrorCode HycoFEStateCreate(HycoFE fe, HycoFEState *state)
{
  const PetscInt n = fe->mesh->n_cells, nq = HycoElementGet(fe->mesh->type)->nq;
  HycoFEState s;

  PetscFunctionBegin;
  PetscCall(PetscNew(state));
  s = *state;
  s->n_cells = n;
  PetscCall(PetscMalloc1(n + 1, &s->start));
  s->start[0] = 0;
  /* Packed: bodies with small states do not pay for the largest. */
  for (PetscInt e = 0; e < n; e++) s->start[e + 1] = s->start[e] + nq * PointSize(fe, e);
  PetscCall(PetscCalloc1(s->start[n], &s->value));
  for (PetscInt e = 0; e < n; e++) {
    for (PetscInt q = 0; q < nq; q++) *PointAt(fe, s, e, q).temperature = NO_TEMPERATURE_YET;
  }
  PetscCall(ListNames(fe->scene, s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The layout of both must come from the same mesh and laws. */
PetscErrorCode HycoFEStateCopy(HycoFEState from, HycoFEState to)
{
  PetscFunctionBegin;
  PetscCheck(from->n_cells == to->n_cells && from->start[from->n_cells] == to->start[to->n_cells], PETSC_COMM_SELF,
             PETSC_ERR_ARG_INCOMP, "the states belong to two meshes");
  PetscCall(PetscArraycpy(to->value, from->value, from->start[from->n_cells]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Borrowed; start: n_cells + 1 offsets. Files write the reals as they are. */
PetscErrorCode HycoFEStateGet(HycoFEState state, const PetscInt **start, PetscReal **values)
{
  PetscFunctionBegin;
  if (start) *start = state->start;
  if (values) *values = state->value;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFEStateGetNames(HycoFEState state, PetscInt *n, const char *const *names[])
{
  PetscFunctionBegin;
  *n = state->n_names;
  *names = (const char *const *)state->name;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The points of some cells of one body: the law's input and output, and the kinematics for its nodal forces. */
typedef struct {
  const PetscReal *u;
  PetscReal t0, t1;
  HycoFEState begin, end;
  PetscReal *f_int;
  PetscBool tangents;
  HycoFEStepReport *report;
  PetscInt n, cell[BATCH];
  PetscReal *memory, *x, *w, *strain0, *strain, *stress0, *stress, *temperature0, *temperature, *state0, *state;
  PetscReal *stored, *dissipated, *increment, *potential, *tangent, *constant;
  PetscInt nv;
  PetscReal (*g)[3], (*mean)[3]; /* nv by point, by cell */
} Batch;

/* Allocates all arrays of a batch at once. Room for the largest law, allocated once per step and used by all
   batches. */
static PetscErrorCode BatchCreate(HycoFE fe, Batch *b)
{
  const PetscInt n = BATCH * HycoElementGet(fe->mesh->type)->nq, ns = fe->n_sigma;
  PetscInt n_state = 0, room, at = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < fe->scene->n_bodies; k++) n_state = PetscMax(n_state, fe->scene->body[k].law->n_state);
  {
    struct {
      PetscReal **array;
      PetscInt size;
    } part[] = {{&b->x, 3},
                {&b->w, 1},
                {&b->strain0, ns},
                {&b->strain, ns},
                {&b->stress0, ns},
                {&b->stress, ns},
                {&b->temperature0, 1},
                {&b->temperature, 1},
                {&b->state0, n_state},
                {&b->state, n_state},
                {&b->stored, 1},
                {&b->dissipated, 1},
                {&b->increment, 1},
                {&b->potential, 1},
                {&b->tangent, ns * ns},
                {&b->constant, HYCO_MAX_DECLARED}};
    const PetscInt parts = (PetscInt)(sizeof(part) / sizeof(part[0]));

    /* One allocation: arrays of a batch lie side by side in the cache. */
    room = 0;
    for (PetscInt k = 0; k < parts; k++) room += part[k].size * n;
    PetscCall(PetscMalloc1(room, &b->memory));
    for (PetscInt k = 0; k < parts; k++) {
      *part[k].array = b->memory + at;
      at += part[k].size * n;
    }
  }
  b->nv = fe->mesh->nv;
  PetscCall(PetscMalloc2(n * b->nv, &b->g, BATCH * b->nv, &b->mean));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All work arrays are parts of one block. */
static PetscErrorCode BatchDestroy(Batch *b)
{
  PetscFunctionBegin;
  PetscCall(PetscFree2(b->g, b->mean));
  PetscCall(PetscFree(b->memory));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes strains at the end of the step and reads the state at its begin; the law's strains exclude thermal strain.
   Total and thermal strains go to the state separately. Gradients are kept in the batch for InelasticScatter(), which
   needs them for the forces. */
static PetscErrorCode InelasticGather(HycoFE fe, const HycoElement *el, Batch *b)
{
  const PetscInt ns = fe->n_sigma, body = fe->mesh->cell_body[b->cell[0]];
  const PetscInt n_state = fe->scene->body[body].law->n_state;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < b->n; k++) {
    const PetscInt cell = b->cell[k];

    if (fe->bbar[body]) PetscCall(HycoMeanGradients(fe, el, cell, b->mean + k * b->nv));
    for (PetscInt q = 0; q < el->nq; q++) {
      const PetscInt i = k * el->nq + q;
      const PetscReal T = fe->temperature ? fe->temperature[cell * el->nq + q] : 0;
      const PetscReal hot = fe->thermal ? fe->thermal[cell * el->nq + q] : 0;
      const Point from = PointAt(fe, b->begin, cell, q), to = PointAt(fe, b->end, cell, q);
      PetscReal strain[6];

      PetscCall(HycoGradients(fe, el, cell, q, b->g + i * b->nv, &b->w[i]));
      HycoPointStrain(fe, el, cell, b->u, b->g + i * b->nv, fe->bbar[body] ? b->mean + k * b->nv : NULL, strain);
      HycoPointPlace(fe, el, cell, q, b->x + 3 * i);
      for (PetscInt c = 0; c < ns; c++) {
        to.strain[c] = strain[c];
        b->strain[i * ns + c] = strain[c] - (c < 3 ? hot : 0);
        /* Of a virgin point both are 0: its thermal strain at the first time acts as a strain from the stress-free
           state. */
        b->strain0[i * ns + c] = from.strain[c] - (c < 3 ? *from.thermal : 0);
        b->stress0[i * ns + c] = from.stress[c];
      }
      for (PetscInt j = 0; j < n_state; j++) b->state0[i * n_state + j] = from.variable[j];
      /* The first step begins at the temperature at which it ends. */
      b->temperature0[i] = *from.temperature == NO_TEMPERATURE_YET ? T : *from.temperature;
      b->temperature[i] = *to.temperature = T;
      *to.thermal = hot;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A linear law: stress and energy by fe's tangents. The potential of a linear law is its stored energy; Newton's
   line search adds it to those of the other laws. */
static void InelasticLinear(HycoFE fe, const HycoElement *el, Batch *b)
{
  const PetscInt ns = fe->n_sigma, size = fe->tangent_size[fe->mesh->cell_body[b->cell[0]]];

  for (PetscInt i = 0; i < b->n * el->nq; i++) {
    /* Lame's constants (2) or a full tangent. */
    const PetscReal *C = fe->tangent + fe->tangent_start[b->cell[i / el->nq]] + i % el->nq * size;
    const PetscReal *strain = b->strain + i * ns;
    PetscReal *stress = b->stress + i * ns;

    HycoTangentApply((PetscBool)(size == 2), fe->dim, C, strain, stress);
    b->stored[i] = b->dissipated[i] = b->increment[i] = 0;
    for (PetscInt c = 0; c < ns; c++) b->stored[i] += stress[c] * strain[c] / 2;
    b->potential[i] = b->stored[i];
  }
}

/* Sets energies that a law does not compute: without a stored energy, all of the work is dissipated; with one, the
   equivalent inelastic strain is the dissipation over the mean equivalent stress. */
static void InelasticComplete(HycoFE fe, const HycoElement *el, Batch *b)
{
  const PetscInt ns = fe->n_sigma;

  for (PetscInt i = 0; i < b->n * el->nq; i++) {
    const PetscBool stores = (PetscBool)!PetscIsNanReal(b->stored[i]);
    PetscReal mean[6], equivalent;

    if (!stores) b->stored[i] = 0;
    for (PetscInt c = 0; c < ns; c++) mean[c] = (b->stress0[i * ns + c] + b->stress[i * ns + c]) / 2;
    /* The balance: work of the step (trapezoidal rule) less the change of the stored energy. */
    if (PetscIsNanReal(b->dissipated[i])) {
      b->dissipated[i] = *PointAt(fe, b->begin, b->cell[i / el->nq], i % el->nq).stored - b->stored[i];
      for (PetscInt c = 0; c < ns; c++) b->dissipated[i] += mean[c] * (b->strain[i * ns + c] - b->strain0[i * ns + c]);
    }
    if (!PetscIsNanReal(b->increment[i])) continue;
    equivalent = HycoMises(fe->dim, mean);
    b->increment[i] = stores && equivalent > 0 ? PetscMax(b->dissipated[i], 0) / equivalent : 0;
  }
}

/* Evaluates the law of a body at n points of the batch; *failed: it has no solution at one. NaN marks what the law does
   not compute; InelasticComplete() replaces it. A failure is reported, not raised: the caller halves the step. */
static PetscErrorCode InelasticUpdate(HycoFE fe, PetscInt of, PetscInt n, Batch *b, PetscBool *failed)
{
  const HycoBody *body = &fe->scene->body[of];
  const PetscReal *constant[HYCO_MAX_DECLARED];
  HycoMaterialPoints p = {.n = n,
                          .dim = fe->dim,
                          .n_strain = fe->n_sigma,
                          .constant = constant,
                          .dt = b->t1 - b->t0,
                          .strain0 = b->strain0,
                          .strain = b->strain,
                          .stress0 = b->stress0,
                          .temperature0 = body->temperature ? b->temperature0 : NULL,
                          .temperature = body->temperature ? b->temperature : NULL,
                          .state0 = b->state0,
                          .state = b->state,
                          .stress = b->stress,
                          .tangent = b->tangents ? b->tangent : NULL,
                          .stored = b->stored,
                          .dissipated = b->dissipated,
                          .increment = b->increment,
                          .potential = b->potential};
  const PetscReal nothing = NAN;

  PetscFunctionBegin;
  PetscCall(HycoMaterialConstants(body->law, fe->mu, p.n, b->x, p.temperature, b->constant, constant));
  for (PetscInt i = 0; i < p.n; i++) b->stored[i] = b->increment[i] = b->dissipated[i] = b->potential[i] = nothing;
  PetscCall(HycoMaterialUpdate(body->law, &p));
  b->report->dt_factor = PetscMin(b->report->dt_factor, p.dt_factor);
  *failed = (PetscBool)(p.failed >= 0);
  /* The first point that fails is named. */
  if (*failed && !b->report->failed)
    HycoFormat(b->report->why, "body %s, law %s: %s at x = %g, y = %g, z = %g", body->name,
               ((PetscObject)body->law)->type_name, p.why ? p.why : "no answer", (double)b->x[3 * p.failed],
               (double)b->x[3 * p.failed + 1], (double)b->x[3 * p.failed + 2]);
  b->report->failed = (PetscBool)(b->report->failed || *failed);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds a point's energies, so that the identity of the report holds. Trapezoidal rule of stress times strain
   increment. moduli: the rest of the balance, from moduli that changed with temperature during the step. Only cells
   whose first node is owned are counted, so that sums over ranks count each once. */
static void InelasticCount(HycoFE fe, Batch *b, PetscInt i, const Point *from, const Point *to)
{
  HycoFEStepReport *r = b->report;
  PetscReal work = 0, thermal = 0;

  for (PetscInt c = 0; c < fe->n_sigma; c++) {
    const PetscReal mean = (from->stress[c] + to->stress[c]) / 2;

    work += mean * (to->strain[c] - from->strain[c]);
    if (c < 3) thermal += mean * (*to->thermal - *from->thermal);
  }
  r->work += b->w[i] * work;
  r->stored += b->w[i] * b->stored[i];
  r->dissipated += b->w[i] * b->dissipated[i];
  r->thermal += b->w[i] * thermal;
  r->moduli += b->w[i] * (work - thermal - b->dissipated[i] - (b->stored[i] - *from->stored));
  /* One law without a potential is enough: the line search then has no function to minimise. */
  if (PetscIsNanReal(b->potential[i]))
    r->has_potential = PETSC_FALSE;
  else
    r->potential += b->w[i] * b->potential[i];
}

/* Writes the batch's results to the state, f_int, the tangents and the report. f_int is complete at owned nodes, as
   every part has all cells around these. */
static void InelasticScatter(HycoFE fe, const HycoElement *el, Batch *b, PetscBool linear)
{
  HycoMesh m = fe->mesh;
  const PetscInt ns = fe->n_sigma, body = m->cell_body[b->cell[0]], n_state = fe->scene->body[body].law->n_state;

  for (PetscInt k = 0; k < b->n; k++) {
    const PetscInt cell = b->cell[k];
    PetscReal f[HYCO_MAX_CELL_DOFS] = {0};

    for (PetscInt q = 0; q < el->nq; q++) {
      const PetscInt i = k * el->nq + q;
      const Point from = PointAt(fe, b->begin, cell, q), to = PointAt(fe, b->end, cell, q);
      PetscReal s[6] = {0, 0, 0, 0, 0, 0};

      for (PetscInt c = 0; c < ns; c++) s[c] = to.stress[c] = b->stress[i * ns + c];
      for (PetscInt j = 0; j < n_state && !linear; j++) to.variable[j] = b->state[i * n_state + j];
      *to.stored = b->stored[i];
      *to.accumulated = *from.accumulated + b->increment[i];
      HycoPointForce(fe, el, b->g + i * b->nv, fe->bbar[body] ? b->mean + k * b->nv : NULL, b->w[i], s, f);
      b->report->increment = PetscMax(b->report->increment, b->increment[i]);
      if (HycoMeshOwned(fe->mesh, fe->mesh->cells[cell * fe->mesh->nv]) >= 0) InelasticCount(fe, b, i, &from, &to);
      /* Symmetrised, because K is assembled and factored as a symmetric matrix. */
      for (PetscInt r = 0; r < ns && b->tangents && !linear; r++) {
        const PetscReal *C = b->tangent + i * ns * ns;

        for (PetscInt c = 0; c < ns; c++)
          fe->tangent[fe->tangent_start[cell] + (q * ns + r) * ns + c] = (C[r * ns + c] + C[c * ns + r]) / 2;
      }
    }
    for (PetscInt r = 0; r < m->nv * fe->dim; r++)
      b->f_int[m->cells[cell * m->nv + r / fe->dim] * fe->dim + r % fe->dim] += f[r];
  }
}

/* The four phases of one batch; a batch with a failure leaves no results. */
static PetscErrorCode InelasticStep(HycoFE fe, const HycoElement *el, Batch *b)
{
  PetscBool failed = PETSC_FALSE, linear;

  PetscFunctionBegin;
  if (!b->n) PetscFunctionReturn(PETSC_SUCCESS);
  linear = fe->scene->body[fe->mesh->cell_body[b->cell[0]]].law->linear;
  PetscCall(InelasticGather(fe, el, b));
  if (linear)
    InelasticLinear(fe, el, b);
  else
    PetscCall(InelasticUpdate(fe, fe->mesh->cell_body[b->cell[0]], b->n * el->nq, b, &failed));
  if (!linear && !failed) InelasticComplete(fe, el, b);
  /* The state before stays untouched by a failed batch: the step is tried again. */
  if (!failed) InelasticScatter(fe, el, b, linear);
  b->n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Batches never mix bodies, as each has its law. */
static PetscErrorCode StepAll(HycoFE fe, HycoBodies bodies, Batch *b)
{
  HycoMesh m = fe->mesh;
  const HycoElement *el = HycoElementGet(m->type);

  PetscFunctionBegin;
  for (PetscInt e = 0; e < m->n_cells; e++) {
    const PetscBool linear = fe->scene->body[m->cell_body[e]].law->linear;

    /* Linear cells of a model's path are a constant matrix. */
    if (bodies == HYCO_BODIES_FLOWING && linear) continue;
    if (b->n == BATCH || (b->n && m->cell_body[e] != m->cell_body[b->cell[0]])) PetscCall(InelasticStep(fe, el, b));
    b->cell[b->n++] = e;
  }
  PetscCall(InelasticStep(fe, el, b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One step from t0 to t1 for all or for inelastic bodies: adds internal forces to f_int[n_dof] (N), writes state
   `end`, optionally replaces fe's tangents by the consistent ones. Complete at owned nodes; report sums are those of
   this process. Not collective. */
PetscErrorCode HycoFEStepBodies(HycoFE fe, HycoBodies bodies, const PetscReal u[], PetscReal t0, PetscReal t1,
                                HycoFEState begin, HycoFEState end, PetscReal f_int[], PetscBool tangent,
                                HycoFEStepReport *report)
{
  const HycoFEStepReport fresh = {.dt_factor = 1, .has_potential = PETSC_TRUE};
  Batch b = {.u = u, .t0 = t0, .t1 = t1, .begin = begin, .end = end, .f_int = f_int, .tangents = tangent};

  PetscFunctionBegin;
  PetscCheck(begin != end, PETSC_COMM_SELF, PETSC_ERR_ARG_IDN, "a step begins and ends in the same state");
  PetscCheck(t1 >= t0, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE, "a step from %g goes back to %g", (double)t0,
             (double)t1);
  *report = fresh;
  b.report = report;
  /* Iterations of a step evaluate the same nodes. */
  PetscCall(HycoFEKeepGradients(fe));
  PetscCall(BatchCreate(fe, &b));
  HycoFinally(StepAll(fe, bodies, &b), PetscCall(BatchDestroy(&b)));
  /* Springs are in no batch; their stored energy is counted by their owners. */
  if (fe->springs && !report->failed) { /* once for all bodies */
    const PetscReal energy = HycoSpringsEnergy(fe, u);

    HycoSpringsAddForces(fe, -1, u, f_int);
    report->stored += energy;
    report->potential += energy;
  }
  HycoFEPassTied(fe, f_int);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stress and energy of linear laws at displacements u: they do not depend on the past. Once for each listed time: no
   step of a linear law needs the one before. */
PetscErrorCode HycoFELinearStress(HycoFE fe, const PetscReal u[], HycoFEState state, PetscReal *stored)
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);
  const PetscInt ns = fe->n_sigma;

  PetscFunctionBegin;
  *stored = 0;
  PetscCall(HycoFEKeepGradients(fe));
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++) {
    const PetscInt body = fe->mesh->cell_body[e], size = fe->tangent_size[body];
    PetscReal mean[HYCO_CELL_NODES][3];

    if (!fe->scene->body[body].law->linear) continue;
    if (fe->bbar[body]) PetscCall(HycoMeanGradients(fe, el, e, mean));
    for (PetscInt q = 0; q < el->nq; q++) {
      const PetscReal *C = fe->tangent + fe->tangent_start[e] + q * size;
      const PetscReal hot = fe->thermal ? fe->thermal[e * el->nq + q] : 0;
      const Point to = PointAt(fe, state, e, q);
      PetscReal *g = HycoKeptGradients(fe, el, e, q), strain[6];

      HycoPointStrain(fe, el, e, u, (PetscReal(*)[3])g, fe->bbar[body] ? mean : NULL, strain);
      /* Stresses are those of the elastic part. */
      for (PetscInt c = 0; c < 3; c++) strain[c] -= hot;
      HycoTangentApply((PetscBool)(size == 2), fe->dim, C, strain, to.stress);
      *to.stored = 0;
      for (PetscInt c = 0; c < ns; c++) *to.stored += to.stress[c] * strain[c] / 2;
      *stored += g[3 * el->nv] * *to.stored;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of all bodies. Elastic ones have no state, but their internal forces are part of f_int. */
PetscErrorCode HycoFEStep(HycoFE fe, const PetscReal u[], PetscReal t0, PetscReal t1, HycoFEState begin,
                          HycoFEState end, PetscReal f_int[], PetscBool tangent, HycoFEStepReport *report)
{
  PetscFunctionBegin;
  PetscCall(HycoFEStepBodies(fe, HYCO_BODIES_ALL, u, t0, t1, begin, end, f_int, tangent, report));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Elastic tangents in place of consistent ones. Linear cells whose constants no parameter changes were never
   replaced. */
PetscErrorCode HycoFEElasticTangent(HycoFE fe)
{
  PetscFunctionBegin;
  PetscCall(HycoFESetTangents(fe, PETSC_FALSE, PETSC_TRUE, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Internal forces of one cell from stored stresses, B^T sigma (nv x dim, N), without a law's evaluation. */
PetscErrorCode HycoFEStateForce(HycoFE fe, HycoFEState state, PetscInt cell, PetscReal f[])
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);
  const PetscBool bbar = fe->bbar[fe->mesh->cell_body[cell]];
  PetscReal g[HYCO_CELL_NODES][3], mean[HYCO_CELL_NODES][3], w;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(f, fe->mesh->nv * fe->dim));
  if (bbar) PetscCall(HycoMeanGradients(fe, el, cell, mean));
  for (PetscInt q = 0; q < el->nq; q++) {
    PetscReal s[6] = {0, 0, 0, 0, 0, 0};

    PetscCall(HycoGradients(fe, el, cell, q, g, &w));
    /* In 2D the out-of-plane components beyond n_sigma do no work. */
    PetscCall(PetscArraycpy(s, PointAt(fe, state, cell, q).stress, fe->n_sigma));
    HycoPointForce(fe, el, g, bbar ? mean : NULL, w, s, f);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- laws at some points -- */

/* B: n_sigma x (nv dim), row major: the strain of unit displacements, or their work with unit stresses. By
   HycoPointForce(), so that bbar is in it. */
PetscErrorCode HycoFEPointRows(HycoFE fe, PetscInt cell, PetscInt q, PetscReal B[], PetscReal *weight)
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);
  const PetscBool bbar = fe->bbar[fe->mesh->cell_body[cell]];
  const PetscInt n = fe->mesh->nv * fe->dim;
  PetscReal g[HYCO_CELL_NODES][3], mean[HYCO_CELL_NODES][3];

  PetscFunctionBegin;
  if (bbar) PetscCall(HycoMeanGradients(fe, el, cell, mean));
  PetscCall(HycoGradients(fe, el, cell, q, g, weight));
  PetscCall(PetscArrayzero(B, fe->n_sigma * n));
  for (PetscInt c = 0; c < fe->n_sigma; c++) {
    PetscReal unit[6] = {0};

    /* A row of B is what a unit stress does at the nodes, per weight. */
    unit[c] = 1;
    HycoPointForce(fe, el, g, bbar ? mean : NULL, 1, unit, B + c * n);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* s = C (strain - thermal strain) - stress, 0 where it is round-off. Returns the largest of the terms. */
static PetscReal InelasticStressLost(HycoFE fe, PetscInt cell, PetscInt q, const PetscReal elastic[],
                                     const PetscReal stress[], PetscReal s[])
{
  const PetscInt ns = fe->n_sigma, size = fe->tangent_size[fe->mesh->cell_body[cell]];
  PetscReal most = 0, terms = 0;

  HycoTangentApply((PetscBool)(size == 2), fe->dim, fe->tangent + fe->tangent_start[cell] + q * size, elastic, s);
  for (PetscInt c = 0; c < ns; c++) {
    terms = PetscMax(terms, PetscMax(PetscAbsReal(s[c]), PetscAbsReal(stress[c])));
    s[c] -= stress[c];
    most = PetscMax(most, PetscAbsReal(s[c]));
  }
  /* An elastic point must have exactly no inelastic stress: modes of round-off would enter the bases. */
  if (most <= STRESS_ROUND_OFFS * PETSC_MACHINE_EPSILON * terms)
    for (PetscInt c = 0; c < ns; c++) s[c] = 0;
  return terms;
}

/* C : (e - e_th) - sigma, the stress that the elastic one loses by flow: its divergence is the nodal force of the
   inelastic strains. */
void HycoFEInelasticStress(HycoFE fe, HycoFEState state, PetscInt cell, PetscInt q, PetscReal s[])
{
  const Point p = PointAt(fe, state, cell, q);
  PetscReal elastic[6];

  for (PetscInt c = 0; c < fe->n_sigma; c++) elastic[c] = p.strain[c] - (c < 3 ? *p.thermal : 0);
  /* The tangents must be elastic here (HycoFEElasticTangent()). */
  (void)InelasticStressLost(fe, cell, q, elastic, p.stress, s);
}

/* The law's input at n points of one body, without thermal strains. For models with laws at few points, which bring
   their own strains. */
static void GatherPoints(HycoFE fe, const HycoElement *el, PetscInt n, const PetscInt point[], const PetscReal strain[],
                         Batch *b)
{
  const PetscInt ns = fe->n_sigma;

  for (PetscInt i = 0; i < n; i++) {
    const PetscInt cell = point[i] / el->nq, q = point[i] % el->nq;
    const PetscInt n_state = fe->scene->body[fe->mesh->cell_body[cell]].law->n_state;
    const PetscReal T = fe->temperature ? fe->temperature[point[i]] : 0, hot = fe->thermal ? fe->thermal[point[i]] : 0;
    const Point from = PointAt(fe, b->begin, cell, q);

    HycoPointPlace(fe, el, cell, q, b->x + 3 * i);
    for (PetscInt c = 0; c < ns; c++) {
      b->strain[i * ns + c] = strain[i * ns + c] - (c < 3 ? hot : 0);
      b->strain0[i * ns + c] = from.strain[c] - (c < 3 ? *from.thermal : 0);
      b->stress0[i * ns + c] = from.stress[c];
    }
    for (PetscInt j = 0; j < n_state; j++) b->state0[i * n_state + j] = from.variable[j];
    /* At a first step the temperature has not changed. */
    b->temperature0[i] = *from.temperature == NO_TEMPERATURE_YET ? T : *from.temperature;
    b->temperature[i] = T;
  }
}

/* What their stresses lose against the elastic ones, and the tangents of that. */
static void ScatterPoints(HycoFE fe, const HycoElement *el, PetscInt n, const PetscInt point[], const Batch *b,
                          PetscReal s[], PetscReal size[], PetscReal tangent[])
{
  const PetscInt ns = fe->n_sigma;

  for (PetscInt i = 0; i < n; i++) {
    const PetscInt cell = point[i] / el->nq, q = point[i] % el->nq;
    const PetscReal *C = fe->tangent + fe->tangent_start[cell] + q * ns * ns, *Ct = b->tangent + i * ns * ns;

    size[i] = InelasticStressLost(fe, cell, q, b->strain + i * ns, b->stress + i * ns, s + i * ns);
    for (PetscInt r = 0; r < ns && b->tangents; r++) {
      /* The symmetric part, as the global tangent takes. */
      for (PetscInt c = 0; c < ns; c++)
        tangent[(i * ns + r) * ns + c] = C[r * ns + c] - (Ct[r * ns + c] + Ct[c * ns + r]) / 2;
    }
  }
}

/* s, size and tangent by point; the state at the end is not kept, since the caller may repeat the step. */
PetscErrorCode HycoFEStepPoints(HycoFE fe, PetscInt n, const PetscInt point[], const PetscReal strain[], PetscReal t0,
                                PetscReal t1, HycoFEState begin, PetscReal s[], PetscReal size[], PetscReal tangent[],
                                HycoFEStepReport *report)
{
  const HycoFEStepReport fresh = {.dt_factor = 1};
  const HycoElement *el = HycoElementGet(fe->mesh->type);
  const PetscInt ns = fe->n_sigma, *of = fe->mesh->cell_body;
  Batch b = {.t0 = t0, .t1 = t1, .begin = begin, .tangents = (PetscBool)(tangent != NULL), .report = report};
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  *report = fresh;
  PetscCall(BatchCreate(fe, &b));
  for (PetscInt from = 0, more = 0; from < n && !ierr; from += more, more = 0) {
    const PetscInt body = of[point[from] / el->nq];
    PetscBool failed = PETSC_TRUE;

    /* Points of one body that follow each other share an evaluation. */
    while (from + more < n && more < BATCH * el->nq && of[point[from + more] / el->nq] == body) more++;
    GatherPoints(fe, el, more, point + from, strain + from * ns, &b);
    ierr = InelasticUpdate(fe, body, more, &b, &failed);
    if (!ierr && !failed)
      ScatterPoints(fe, el, more, point + from, &b, s + from * ns, size + from,
                    tangent ? tangent + from * ns * ns : NULL);
  }
  PetscCall(BatchDestroy(&b));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Volume means by cell: stress (n_sigma each), von Mises stress, accumulated inelastic strain, temperature; NULL
   outputs are skipped. Fields in files are by cell, while states are by point. */
PetscErrorCode HycoFEStateFields(HycoFE fe, HycoFEState state, PetscReal sigma[], PetscReal mises[],
                                 PetscReal inelastic[], PetscReal temperature[])
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);
  const PetscInt ns = fe->n_sigma;

  PetscFunctionBegin;
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++) {
    PetscReal sum[9] = {0}, volume = 0;

    for (PetscInt q = 0; q < el->nq; q++) {
      const Point p = PointAt(fe, state, e, q);
      PetscReal g[HYCO_CELL_NODES][3], w;

      if (HycoGradientsKept(fe))
        w = HycoKeptGradients(fe, el, e, q)[3 * el->nv];
      else
        PetscCall(HycoGradients(fe, el, e, q, g, &w));
      volume += w;
      for (PetscInt c = 0; c < ns; c++) sum[c] += w * p.stress[c];
      sum[6] += w * HycoMises(fe->dim, p.stress);
      sum[7] += w * *p.accumulated;
      /* A virgin point counts as 0. */
      sum[8] += w * PetscMax(*p.temperature, 0);
    }
    for (PetscInt c = 0; sigma && c < ns; c++) sigma[e * ns + c] = sum[c] / volume;
    if (mises) mises[e] = sum[6] / volume;
    if (inelastic) inelastic[e] = sum[7] / volume;
    if (temperature) temperature[e] = sum[8] / volume;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Volume mean by cell of a law's variable; 0 in bodies whose law does not have it. */
PetscErrorCode HycoFEStateVariable(HycoFE fe, HycoFEState state, const char name[], PetscReal value[])
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);

  PetscFunctionBegin;
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++) {
    const HycoMaterial law = fe->scene->body[fe->mesh->cell_body[e]].law;
    PetscReal g[HYCO_CELL_NODES][3], w, volume = 0;
    PetscInt which = -1;

    value[e] = 0;
    for (PetscInt k = 0; law->state_name && k < law->n_state && which < 0; k++) {
      PetscBool same;

      PetscCall(PetscStrcmp(law->state_name[k], name, &same));
      /* -1: the law of this body has no such variable. */
      if (same) which = k;
    }
    for (PetscInt q = 0; q < el->nq && which >= 0; q++) {
      PetscCall(HycoGradients(fe, el, e, q, g, &w));
      volume += w;
      value[e] += w * PointAt(fe, state, e, q).variable[which];
    }
    if (volume > 0) value[e] /= volume;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A rate of this size along the deviator of the stress: a tensor, so that a reversal is a change. */
static void RateAlong(HycoFE fe, const PetscReal stress[], PetscReal size, PetscReal rate[])
{
  const PetscInt ns = fe->n_sigma;
  const PetscReal mean = ns > 3 ? (stress[0] + stress[1] + stress[2]) / 3 : 0;
  PetscReal norm = 0;

  for (PetscInt c = 0; c < ns; c++) {
    rate[c] = c < 3 ? stress[c] - mean : PETSC_SQRT2 * stress[c];
    norm += PetscSqr(rate[c]);
  }
  for (PetscInt c = 0; c < ns; c++) rate[c] *= norm > 0 ? size / PetscSqrtReal(norm) : 0;
}

/* Of the batch's points, which do not move: only creep strains them. */
static PetscErrorCode BatchRates(HycoFE fe, const HycoElement *el, Batch *b, PetscReal rate[], PetscReal *largest)
{
  PetscBool failed = PETSC_FALSE;

  PetscFunctionBegin;
  if (!b->n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(InelasticGather(fe, el, b));
  PetscCall(InelasticUpdate(fe, fe->mesh->cell_body[b->cell[0]], b->n * el->nq, b, &failed));
  if (!failed) InelasticComplete(fe, el, b);
  for (PetscInt i = 0; i < b->n * el->nq; i++) {
    const PetscInt cell = b->cell[i / el->nq];

    RateAlong(fe, b->stress + i * fe->n_sigma, failed ? 0 : b->increment[i] / (b->t1 - b->t0),
              rate + (cell * el->nq + i % el->nq) * fe->n_sigma);
    *largest = PetscMax(*largest, *PointAt(fe, b->begin, cell, i % el->nq).accumulated);
  }
  b->n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A step without strain in so short a time that stresses do not change. Begin and end are one state: what
   InelasticGather() writes is what it has. */
PetscErrorCode HycoFERates(HycoFE fe, const PetscReal u[], PetscReal t, PetscReal dt, HycoFEState state,
                           PetscReal rate[], PetscReal *largest)
{
  const HycoMesh m = fe->mesh;
  const HycoElement *el = HycoElementGet(m->type);
  HycoFEStepReport report = {.dt_factor = 1};
  Batch b = {.u = u, .t0 = t, .t1 = t + dt, .begin = state, .end = state, .report = &report};

  PetscFunctionBegin;
  *largest = 0;
  PetscCall(HycoFEKeepGradients(fe));
  PetscCall(BatchCreate(fe, &b));
  for (PetscInt e = 0; e < m->n_cells; e++) {
    if (fe->scene->body[m->cell_body[e]].law->linear) continue;
    if (b.n == BATCH || (b.n && m->cell_body[e] != m->cell_body[b.cell[0]]))
      PetscCall(BatchRates(fe, el, &b, rate, largest));
    b.cell[b.n++] = e;
  }
  PetscCall(BatchRates(fe, el, &b, rate, largest));
  PetscCall(BatchDestroy(&b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* In no time creep does nothing: what deforms or fails now yields. */
PetscErrorCode HycoFEYields(HycoFE fe, PetscReal t, PetscBool *yields)
{
  const PetscReal size = LARGE_DISPLACEMENT * HycoMeshLength(fe->mesh);
  HycoFEStepReport report;
  HycoFEState begin, end;
  PetscReal *u, *f;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(fe->n_dof, &u));
  PetscCall(PetscCalloc1(fe->n_dof, &f));
  /* Strains far beyond any yield limit, without symmetry: no cell is left unstrained, and no random numbers are
     used. */
  for (PetscInt i = 0; i < fe->n_dof; i++) u[i] = size * PetscSinReal(1.7 * i * i + i);
  PetscCall(HycoFEStateCreate(fe, &begin));
  PetscCall(HycoFEStateCreate(fe, &end));
  ierr = HycoFEStepBodies(fe, HYCO_BODIES_FLOWING, u, t, t, begin, end, f, PETSC_FALSE, &report);
  PetscCall(HycoFEStateDestroy(&begin));
  PetscCall(HycoFEStateDestroy(&end));
  HycoFreeAll(&u, &f);
  PetscCall(ierr);
  *yields = (PetscBool)(report.failed || report.increment > 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}
