/* Time of the training of a model of bodies and of its predictions, from sizes: in order of magnitude. */
#include "inspect.h"
#include <hycobodiestraining.h>

/* What a training finds itself, as assumed here: values of a parameter that changes a shape, and of all together; nodes of
   these at which displacements are sampled; samples of displacements where nothing changes a shape, else, and where a body turns; seconds of reading and recognition; modes of a body;
   closed contacts and entries of a row of B; held-out solutions; unknowns inside. */
#define VALUES      5
#define MOST_VALUES 15
#define SPREAD      3
#define FEW         120
#define MANY        240
#define OF_TURNS    600
#define START       0.3
#define MODES       80
#define ACTIVE      0.3
#define ENTRIES     15
#define HELD        8
#define INNER       1800
#define INNER_TABLE 6e6
#define TURNS       3

/* Sparse factors, solves with them, and dense products on narrow matrices, relative to a product of large ones. */
#define SOLVE_SHARE  0.12
#define NARROW_SHARE 0.25

/* The unknowns of the surfaces that may touch. Rank 0. */
static PetscErrorCode CountSurface(HycoFOM f, PetscReal *n)
{
  PetscBool *in;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(f->surface->n_nodes + 1, &in));
  PetscCall(HycoPairsMarkSurfaces(f->scene, f->surface, &f->pairs, in));
  *n = 0;
  for (PetscInt i = 0; i < f->surface->n_nodes; i++) *n += in[i] ? f->fe->dim : 0;
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* turned[]: the bodies that a parameter turns, at the ends of its range relative to mu. Collective. */
static PetscErrorCode FindTurned(HycoFOM f, const HycoBodyParts *parts, const PetscReal mu[], PetscBool turned[])
{
  const HycoScene s = f->scene;
  HycoPose *pose;
  PetscReal *X, *at;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(3 * f->part->n_nodes + 1, &X, parts->n, &pose, s->n_variables + 1, &at));
  HycoOnEach(HycoComm(f), HycoFESetParameters(f->fe, mu));
  PetscCall(PetscArraycpy(X, f->fe->X, 3 * f->part->n_nodes));
  for (PetscInt k = 0; k < 2 * s->n_parameters; k++) {
    PetscCall(PetscArraycpy(at, mu, s->n_parameters));
    at[k / 2] = k % 2 ? s->hi[k / 2] : s->lo[k / 2];
    f->fe->ready = PETSC_FALSE;
    HycoOnEach(HycoComm(f), HycoFESetParameters(f->fe, at));
    PetscCall(HycoBodyPoses(f, parts->n, parts->of, X, pose));
    for (PetscInt b = 0; b < parts->n; b++) {
      for (PetscInt d = 0; d < 9 && parts->enters[b * parts->n_parameters + k / 2] & HYCO_ENTERS_PLACE; d++)
        turned[b] = (PetscBool)(turned[b] || PetscAbsReal(pose[b].Q[d] - (d % 4 == 0)) > 1e-9);
    }
  }
  f->fe->ready = PETSC_FALSE;
  PetscCall(PetscFree3(X, pose, at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the work of one body: of its samples and modes, and of a prediction. ns: unknowns of its surfaces; share: of the
   mesh. */
static void AddBody(const HycoInspection *in, PetscReal factor, PetscReal ns, PetscReal share, PetscInt axes,
                    PetscBool turned, PetscReal columns, PetscReal *training, PetscReal *prediction)
{
  const PetscReal values = PetscMin(PetscPowReal(VALUES, (PetscReal)axes), MOST_VALUES),
                  entries = share * in->bytes / 8, rows = share * (PetscReal)in->n_free, most = PetscMin(columns, rows),
                  inner = PetscMin(PetscMin(INNER, INNER_TABLE / (ns * values)), rows),
                  modes = MODES * (turned ? TURNS : 1);

  /* Condensations, those held out too. */
  *training += (values + 2 * axes) * (share * factor + ns * ns * ns) / NARROW_SHARE;
  /* Displacements, and the rows of the model. */
  *training += (columns + (modes + inner) * values) * 4 * entries / SOLVE_SHARE;
  /* POD of the last samples, and before of half and a quarter of them; a turned body has several fields for each mode. */
  *training += 1.3 * (6 * rows * most * most + 20 * most * most * most) / NARROW_SHARE;
  if (turned) *training += 6 * rows * PetscSqr(TURNS * most / 2) / NARROW_SHARE;
  *prediction += ACTIVE * ns * ns * (values > 1 ? values : 1) + 2 * ACTIVE * ns * (modes + inner) * values;
}

/* The costs of a model of bodies: in->body_values values of the parameters that change a body, 0: no such model. factor:
   operations of K's. speed: of products a second, on each rank. Collective. */
PetscErrorCode HycoInspectBodyCost(HycoFOM f, const HycoBodyParts *parts, const PetscReal mu[], PetscReal factor,
                                   PetscReal speed, HycoInspection *in)
{
  PetscInt shape[HYCO_MAX_PARAMETERS];
  const PetscInt n_theta = HycoBodyPartsShapes(parts, -1, shape);
  PetscReal ns = 0, training = 0, prediction = 0, active = ACTIVE * (PetscReal)f->n_contacts, samples;
  PetscBool *turned, any = PETSC_FALSE;

  PetscFunctionBegin;
  if (f->scene->n_times || HycoBodyPartsFail(parts) >= 0 || n_theta > 3) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc1(parts->n, &turned));
  PetscCall(FindTurned(f, parts, mu, turned));
  HycoOnRoot(HycoComm(f), CountSurface(f, &ns));
  PetscCallMPI(MPI_Bcast(&ns, 1, MPIU_REAL, 0, HycoComm(f)));
  in->body_values = (PetscInt)PetscMin(PetscPowReal(VALUES, (PetscReal)n_theta), MOST_VALUES);
  for (PetscInt b = 0; b < parts->n; b++) any = (PetscBool)(any || turned[b]);
  samples = any ? OF_TURNS : n_theta ? MANY : FEW;
  for (PetscInt b = 0; b < parts->n; b++)
    AddBody(in, factor, PetscMax(ns / parts->n, 1), 1. / (PetscReal)parts->n, HycoBodyPartsShapes(parts, b, shape),
            turned[b], samples * (n_theta ? SPREAD : 1), &training, &prediction);
  /* W and its factor, twice for contacts that join; the search; parameters, loads and outputs. */
  prediction += 2 * (ENTRIES * active * ns + active * active * active / 3) + 2e4 * (PetscReal)f->n_contacts + 4e5;
  training += samples * prediction / NARROW_SHARE;
  in->body_training = training / (speed * f->size) + HELD * in->first + START;
  in->body_prediction = prediction / (NARROW_SHARE * speed);
  PetscCall(PetscFree(turned));
  PetscFunctionReturn(PETSC_SUCCESS);
}
