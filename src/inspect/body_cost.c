/* Time of the training of a model of bodies and of its predictions, from sizes: in order of magnitude. */
#include "inspect.h"
#include <hycobodiestraining.h>

/* What a training finds itself, as assumed here, at least and at most: values of a parameter that changes a shape;
   samples of displacements (as many rounds double them), and where a body turns. Of all values together; nodes of these
   at which displacements are sampled; seconds of reading and recognition; modes of a body; closed contacts and entries
   of a row of B; held-out solutions; unknowns inside. */
static const PetscReal VALUES[2] = {3, 5}, SAMPLES[2] = {93, 273}, OF_TURNS[2] = {93, 993};
#define MOST_VALUES 60
#define SPREAD      3
/* Seconds of reading and recognition: announced against measured times (tests/models/bodies.py). */
#define START       0.3
#define MODES       80
#define ENTRIES     15
#define HELD        8
#define INNER       1800
#define INNER_TABLE 6e6
#define TURNS       3

/* Speed of a prediction relative to a product with a vector: announced against measured times (tests/models/bodies.py).
   */
#define ONLINE_SHARE 0.65
/* Speed of solves with sparse factors relative to a product of large matrices: announced against measured
   times (tests/models/bodies.py). */
#define SOLVE_SHARE 0.12
/* Speed of products of narrow matrices relative to one of large ones: announced against measured times
   (tests/models/bodies.py). */
#define NARROW_SHARE 0.25
/* Speed of decompositions relative to a product of large matrices: announced against measured times
   (tests/models/bodies.py). */
#define POD_SHARE 0.12
/* Factor of the ends of the announced range: the speed of a machine varies by as much (tests/models/bodies.py). */
#define RANGE_MARGIN 1.5
/* Seconds of a solve beside its operations: announced against measured times (tests/models/bodies.py). */
#define EACH_SOLVE 5e-5

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
   mesh; values: of all parameters of its shape. */
static void AddBody(const HycoInspection *in, PetscReal ns, PetscReal share, PetscInt axes, PetscReal values,
                    PetscBool turned, PetscReal columns, PetscReal speed, PetscReal *training, PetscReal *prediction)
{
  const PetscReal entries = share * in->bytes / 8, rows = share * (PetscReal)in->n_free, most = PetscMin(columns, rows),
                  inner = PetscMin(PetscMin(INNER, INNER_TABLE / (ns * values)), rows),
                  modes = MODES * (turned ? TURNS : 1), turns = PetscMin(TURNS * most / 2, rows);

  /* Condensations, those held out too; their factors are counted with the full-order solutions. */
  *training += (values + 2 * axes) * ns * ns * ns / NARROW_SHARE;
  /* Displacements, and the rows of the model. */
  *training += (columns + (modes + inner) * values) * (4 * entries / SOLVE_SHARE + EACH_SOLVE * speed);
  /* POD of the last samples, and before of half and a quarter of them; a turned body has several fields for each
     mode. */
  *training += 1.3 * (6 * rows * most * most + 20 * most * most * most) / POD_SHARE;
  if (turned) *training += (6 * rows + 20 * turns) * turns * turns / POD_SHARE;
  *prediction += HYCO_ASSUMED_CLOSED * ns * ns * (values > 1 ? values : 1) +
                 2 * HYCO_ASSUMED_CLOSED * ns * (modes + inner) * values;
}

/* The costs of a model of bodies: in->body_values values of the parameters that change a body, 0: no such model.
   Collective. */
PetscErrorCode HycoInspectBodyCost(HycoFOM f, const HycoBodyParts *parts, const PetscReal mu[],
                                   const PetscReal speed[2], HycoInspection *in)
{
  PetscInt shape[HYCO_MAX_PARAMETERS];
  const PetscInt n_theta = HycoBodyPartsShapes(parts, -1, shape);
  const PetscReal active = HYCO_ASSUMED_CLOSED * (PetscReal)f->n_contacts;
  PetscReal ns = 0;
  PetscBool *turned, any = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(HycoBodyPartsRefuse(f, parts, in->no_bodies));
  if (f->scene->n_times || in->no_bodies[0]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc1(parts->n, &turned));
  PetscCall(FindTurned(f, parts, mu, turned));
  HycoOnRoot(HycoComm(f), CountSurface(f, &ns));
  PetscCallMPI(MPI_Bcast(&ns, 1, MPIU_REAL, 0, HycoComm(f)));
  for (PetscInt b = 0; b < parts->n; b++) any = (PetscBool)(any || turned[b]);
  for (int end = 0; end < 2; end++) {
    const PetscReal samples = any ? OF_TURNS[end] : SAMPLES[end];
    PetscReal training = 0, prediction = 0;

    for (PetscInt b = 0; b < parts->n; b++) {
      const PetscInt axes = HycoBodyPartsShapes(parts, b, shape);
      const PetscReal values = PetscMin(PetscPowReal(VALUES[end], (PetscReal)axes), MOST_VALUES);

      AddBody(in, PetscMax(ns / parts->n, 1), 1. / (PetscReal)parts->n, axes, values, turned[b],
              samples * (n_theta ? SPREAD : 1), speed[0], &training, &prediction);
    }
    /* W and its factor, twice for contacts that join; the search; parameters, loads and outputs. */
    prediction += 2 * (ENTRIES * active * ns + active * active * active / 3) + 2e4 * (PetscReal)f->n_contacts + 4e5;
    in->body_prediction = prediction / (ONLINE_SHARE * speed[1]);
    in->body_values = (PetscInt)PetscMin(PetscPowReal(VALUES[end], (PetscReal)n_theta), MOST_VALUES);
    in->body_training[end] = ((training / speed[0] + samples * in->body_prediction) / f->size + START +
                              (HELD + (n_theta ? in->body_values + 2 * n_theta : 0)) * in->first) *
                             (end ? RANGE_MARGIN : 1 / RANGE_MARGIN);
  }
  PetscCall(PetscFree(turned));
  PetscFunctionReturn(PETSC_SUCCESS);
}
