/*
  Displacements inside the bodies: modes of their own solutions. The contact problem is solved on the surfaces at points
  of the ranges, which costs no full-order solution; the displacements of each body under these forces and loads, in all
  its turns, give its modes by POD; their coefficients are exact for any forces and loads, because H = N K^-1 V comes
  from a solve for each mode. On the surfaces the model has the displacements themselves.
*/
#include <hycoalgorithms.h>
#include <hycobodiestraining.h>
#include <petscblaslapack.h>

#define MOST_NUMBERS 6e7 /* entries of the sampled displacements on all ranks */
#define LEAST        20  /* samples */
#define MOST_COLUMNS 600 /* of training paths */
#define MOST_MODES   0.5 /* modes for each sample: with more of them the samples do not show all displacements */
#define DOUBLINGS    4   /* of the samples with more modes */
/* Of the displacements at a check, what modes may miss before the samples double, at most UNTIL_SEEN times: ten times
   it, the estimate of u, is then the 0.2 % that the search takes as accurate enough. */
#define MISSED     2e-4
#define UNTIL_SEEN 2 /* doublings while the modes miss more than MISSED */
#define SPREAD     3 /* nodes of theta at which the displacements of each are computed */
/* Of the modes' tolerance, for the displacements of which those of turning bodies are made: a hundredth, so that the
   first compression does not decide. */
#define TURNED_SHARE 1e-2
/* Of the largest sample: smaller ones count as much as this; single precision of the stored responses. */
#define LEAST_SAMPLE    1e-7
#define SCORED          24 /* displacements at all nodes of theta whose stresses show which cells matter */
#define COLUMNS_AT_ONCE 64 /* right-hand sides at once */
#define SAMPLED_TIMES   4  /* times of a path with friction whose forces are samples */
/* Of the largest response in a column: terms without larger entries are left out; single precision of the stored
   responses. */
#define SHORT_TERM 1e-7
#define CHECKS     32 /* points at which the displacements that the modes miss are measured, no samples */

/* Samples: the loads' coefficients and the surfaces' forces, a column each; the last n_checks are
   checks. */
typedef struct {
  PetscInt n, n_checks;
  PetscReal *c, *f;       /* r x n, ns x n column major */
  PetscInt tried;         /* points, solved or not: a larger set begins with them */
  PetscInt expanded, n_U; /* samples whose displacements U has, n_U columns of this rank's part */
  PetscReal *U;
} Sampled;

/* -- forces -- */

/* One point: *solved if its contact problem is. Rank 0. The order of a prediction: fe at mu, rows there, then the
   bodies. */
static PetscErrorCode SolveOne(HycoBodiesWork o, const HycoBodiesSurface *s, const PetscReal mu[], PetscReal Lambda[],
                               PetscBool *solved)
{
  PetscFunctionBegin;
  PetscCall(HycoFESetParameters(s->fe, mu));
  PetscCall(HycoContactRows(s->fe, s->pairs, s->rows));
  PetscCall(HycoBodiesSolve(o, s, mu, Lambda, solved));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A share for point k of a sequence: irregular, and any. */
static PetscReal SomeShare(PetscInt k)
{
  const PetscReal share = (k + 1) * 0.6180339887;

  return share - (PetscInt)share;
}

/* A path with friction at mu: the forces at some of its times are samples. It takes the steps between the stops of the
   history, and ends where one has no solution. Rank 0. */
static PetscErrorCode SolvePath(HycoBodiesFriction f, HycoBodiesWork o, HycoScene scene, HycoFE fe, PetscInt k,
                                const PetscReal mu[], Sampled *sampled, PetscBool *solved)
{
  const HycoSubstructures b = o->bodies;
  const PetscReal first = scene->times[0], last = scene->times[scene->n_times - 1];
  PetscReal t = first;
  PetscInt seen = 0, its;
  HycoKKT kkt;

  PetscFunctionBegin;
  PetscCall(HycoBodiesFrictionBegin(f));
  while (t <= last) {
    PetscReal all[HYCO_MAX_PARAMETERS];

    HycoSceneSetTime(scene, mu, t, all);
    PetscCall(HycoFESetParameters(fe, all));
    PetscCall(HycoBodiesFrictionPrepare(f, o, all));
    PetscCall(HycoBodiesFrictionSolve(f, o, t, &kkt, &its, solved));
    if (!*solved) break;
    PetscCall(HycoBodiesFrictionAccept(f, o, t));
    /* Another time within each quarter for each point: all times are seen, not four of them. */
    /* Samples of forces are spread over the path. */
    if (t >= first + (last - first) * (seen + SomeShare(k)) / SAMPLED_TIMES && seen < SAMPLED_TIMES) {
      PetscCall(PetscArraycpy(sampled->c + sampled->n * b->r, o->c, b->r));
      PetscCall(PetscArraycpy(sampled->f + sampled->n * b->ns, o->f, b->ns));
      sampled->n++;
      seen++;
    }
    if (t >= last) break;
    t = HycoSceneNextStop(scene, t);
  }
  *solved = (PetscBool)(seen > 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A time of the history for point k of the sequence. Elastic bodies have no past: a point of a history is solved
   at one of its times as if it were none. */
static PetscReal SomeTime(HycoScene s, PetscInt k)
{
  return s->n_times ? s->times[0] + SomeShare(k) * (s->times[s->n_times - 1] - s->times[0]) : 0;
}

/* friction: NULL, or of paths. */
static PetscErrorCode SolvePoints(HycoReducer t, HycoBodiesWork o, const HycoBodiesSurface *s,
                                  HycoBodiesFriction friction, HycoSamples points, Sampled *sampled)
{
  const HycoSubstructures b = o->bodies;
  const PetscInt p = t->scene->n_parameters;
  PetscReal *Lambda, *bound, *norm, most = 0;
  const PetscReal *mu;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(points, &n, NULL, &mu));
  /* The former checks become samples, the last CHECKS points are the new ones: the points of a larger set begin
     with those of a smaller. */
  if (n > sampled->tried) sampled->n_checks = 0;
  PetscCall(PetscMalloc3(s->pairs->n + 1, &Lambda, n, &bound, n, &norm));
  for (PetscInt k = sampled->tried; k < n; k++) {
    char message[HYCO_LINE];
    PetscReal all[HYCO_MAX_PARAMETERS];
    PetscBool solved = PETSC_FALSE;
    PetscErrorCode ierr;

    PetscCall(HycoReducerTell(t, "samples of bodies", k, n));
    HycoSceneSetTime(t->scene, mu + k * p, SomeTime(t->scene, k), all);
    PetscCall(HycoCatchBegin()); /* points that full order would refuse, too */
    if (friction)
      ierr = SolvePath(friction, o, t->scene, s->fe, k, mu + k * p, sampled, &solved);
    else
      ierr = SolveOne(o, s, all, Lambda, &solved);
    PetscCall(HycoCatchEnd(ierr, message));
    bound[k] = norm[k] = 0;
    if (ierr || !solved) continue;
    bound[k] = HycoBodiesBound(o, &norm[k]);
    most = PetscMax(most, norm[k]);
    /* SolvePath() has stored its samples. */
    if (friction) continue;
    PetscCall(PetscArraycpy(sampled->c + sampled->n * b->r, o->c, b->r));
    PetscCall(PetscArraycpy(sampled->f + sampled->n * b->ns, o->f, b->ns));
    sampled->n++;
    sampled->n_checks += p && !t->scene->n_times && k >= n - CHECKS;
  }
  if (!sampled->tried) b->forces = 0;
  for (PetscInt k = sampled->tried; k < n && most > 0; k++)
    /* A bound relative to tiny forces would say nothing about those that matter. */
    b->forces = PetscMax(b->forces, bound[k] * norm[k] / PetscMax(norm[k], HYCO_SMALL_FORCE * most));
  sampled->tried = n;
  PetscCall(PetscFree3(Lambda, bound, norm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One of so many columns of the training paths is taken. */
static PetscInt PathStride(HycoReducer t)
{
  return 1 + (t->n_s - 1) / MOST_COLUMNS;
}

/* The forces of column k of the training solutions, by row of the contact problem. */
static PetscErrorCode TakeForces(HycoReducer t, HycoSnapshots store, HycoBodiesFriction friction, PetscInt n,
                                 PetscInt k, PetscReal L[])
{
  const PetscInt n_steps = HycoSnapshotsSteps(t->scene);
  const PetscReal *normal = t->Lambda + (size_t)k * (size_t)n, *all;
  PetscReal *component, *force;
  PetscInt n_par;

  PetscFunctionBegin;
  if (!friction) PetscCall(PetscArraycpy(L, normal, n));
  if (!friction) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSamplesGet(t->columns, NULL, &n_par, &all));
  PetscCall(PetscMalloc2(n + 1, &component, 3 * n + 1, &force));
  for (PetscInt c = 0; c < 3; c++) {
    PetscCall(
        HycoSnapshotsReadRows(store, all + k / n_steps * n_par, k % n_steps, HycoSnapshotFriction[c], 0, n, component));
    for (PetscInt i = 0; i < n; i++) force[3 * i + c] = component[i];
  }
  HycoContactStateForces(HycoBodiesFrictionState(friction), normal, force, L);
  PetscCall(PetscFree2(component, force));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the elastic part of the training paths: their loads and contact forces at the listed times. Their forces are the
   very ones that predictions will have. */
static PetscErrorCode TakePaths(HycoReducer t, HycoSnapshots store, HycoBodiesWork o, const HycoBodiesSurface *s,
                                HycoBodiesFriction friction, PetscInt every, Sampled *sampled)
{
  const HycoSubstructures b = o->bodies;
  const HycoBodiesSurface *rows = friction ? HycoBodiesFrictionSurface(friction) : s;
  PetscReal *L;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(rows->n + 1, &L));
  if (friction) PetscCall(HycoBodiesFrictionBegin(friction));
  for (PetscInt k = 0; k < t->n_s; k += every) {
    PetscReal mu[HYCO_MAX_PARAMETERS];

    PetscCall(HycoReducerColumn(t, k, mu));
    PetscCall(HycoFESetParameters(s->fe, mu));
    PetscCall(HycoContactRows(s->fe, s->pairs, s->rows));
    /* Forces of the training paths are given: no contact problem, only f = B^T L in the bodies' axes. */
    if (friction)
      PetscCall(HycoBodiesFrictionPrepare(friction, o, mu));
    else
      PetscCall(HycoBodiesPrepare(o, s, mu));
    PetscCall(TakeForces(t, store, friction, s->pairs->n, k, L));
    HycoBodiesDisplacementsOfForces(o, rows, L);
    PetscCall(PetscArraycpy(sampled->c + sampled->n * b->r, o->c, b->r));
    PetscCall(PetscArraycpy(sampled->f + sampled->n * b->ns, o->f, b->ns));
    sampled->n++;
  }
  PetscCall(PetscFree(L));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0. Online code on the surfaces' mesh, which rank 0 alone has: the samples are those that a prediction would
   find. The work is freed before an error returns. The contact problem on the surfaces alone is far cheaper than one of
   full order: there can be many samples. */
static PetscErrorCode SampleForces(HycoReducer t, HycoSnapshots store, HycoFOM f, HycoSamples points, Sampled *sampled)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  struct _n_HycoBodiesWork work = {0};
  HycoRows rows = {0};
  const HycoBodiesSurface s = HycoBodiesSurfaceNormal(f->fe_surface, &f->pairs, &rows);
  HycoBodiesFriction friction = NULL;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  if (HycoSceneHasFriction(t->scene)) PetscCall(HycoBodiesFrictionCreate(t->scene, &s, b->p, &friction));
  ierr = HycoBodiesSetUp(&work, b, t->scene, friction ? HycoBodiesFrictionSurface(friction) : &s, NULL);
  if (!ierr) ierr = SolvePoints(t, &work, &s, friction, points, sampled);
  /* Elastic bodies with friction have enough paths of their own. */
  if (!ierr && t->scene->n_times && (!friction || HycoBodiesFlow(t)) && !sampled->expanded)
    ierr = TakePaths(t, store, &work, &s, friction, PathStride(t), sampled);
  PetscCall(HycoBodiesReset(&work));
  PetscCall(HycoBodiesFrictionDestroy(&friction));
  PetscCall(HycoRowsDestroy(&rows));
  /* It is at the last point's parameters. */
  f->fe_surface->ready = PETSC_FALSE;
  PetscCall(ierr);
  HycoCheckModel(sampled->n > sampled->n_checks,
                 "the contact problem of the bodies is solved at none of the points of the ranges");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The samples on every rank, at `wanted` points or as many as there is room for: *all. Collective. */
static PetscErrorCode BodyFieldsSample(HycoReducer t, HycoSnapshots store, HycoFOM f, PetscInt wanted, PetscBool *all,
                                       Sampled *sampled)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  const PetscInt nodes = PetscMin(SPREAD, HycoBodiesGrid(b, 0, NULL));
  /* Of samples, so that U, nodes x samples on all ranks, has no more than MOST_NUMBERS entries. */
  const PetscReal most = MOST_NUMBERS / ((PetscReal)t->sizes[0] * t->sizes[3] * nodes);
  const PetscBool friction = HycoSceneHasFriction(t->scene);
  HycoSamples points;
  PetscInt n = PetscMax(LEAST, PetscMin(wanted, (PetscInt)PetscMin(most, 1e6)));
  PetscErrorCode ierr;

  PetscFunctionBegin;
  *all = (PetscBool)(n >= wanted && t->scene->n_parameters);
  PetscCall(HycoSamplesCreate(t->scene, &points));
  PetscCall(HycoSamplesAddPoint(points, b->first));
  /* A path with friction gives several samples, and no checks. */
  if (t->scene->n_parameters) PetscCall(HycoSamplesAddScattered(points, friction ? n / SAMPLED_TIMES : n + CHECKS));
  PetscCall(HycoSamplesGet(points, &n, NULL, NULL));
  if (friction) n *= SAMPLED_TIMES;
  if (t->scene->n_times) n += 1 + t->n_s / PathStride(t);
  PetscCall(PetscRealloc(((size_t)n * (size_t)b->r + 1) * sizeof(PetscReal), &sampled->c));
  PetscCall(PetscRealloc(((size_t)n * (size_t)b->ns + 1) * sizeof(PetscReal), &sampled->f));
  {
    char message[HYCO_LINE] = "";
    PetscErrorCode caught = PETSC_SUCCESS;

    PetscCall(HycoCatchBegin());
    /* Not HycoOnRoot(): the points are destroyed on every rank before the error returns. */
    if (f->rank == 0) caught = SampleForces(t, store, t->fom, points, sampled);
    PetscCall(HycoCatchEnd(caught, message));
    ierr = HycoErrorSync(HycoComm(t), caught, message);
  }
  PetscCall(HycoSamplesDestroy(&points));
  PetscCall(ierr);
  PetscCallMPI(MPI_Bcast(&sampled->n, 1, MPIU_INT, 0, HycoComm(t)));
  PetscCallMPI(MPI_Bcast(&sampled->n_checks, 1, MPIU_INT, 0, HycoComm(t)));
  /* The loads' coefficients only: the forces are read on rank 0. */
  HycoBcast(sampled->c, sampled->n * b->r, MPIU_REAL, HycoComm(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- displacements -- */

/* n vectors like the loads. */
static PetscErrorCode CreateVectors(HycoBodiesFactor *factor, PetscInt n, Vec v[])
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) PetscCall(VecDuplicate(factor->fom->F, &v[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode DestroyVectors(PetscInt n, Vec v[])
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) PetscCall(VecDestroy(&v[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The displacements of this rank's part, n columns, at most COLUMNS_AT_ONCE, for loads with coefficients c (r x n;
   NULL: none) and the z of the dense problem (p + ns, n columns; read on rank 0). Collective. */
static PetscErrorCode BodyFieldsExpand(HycoSubstructures b, HycoBodiesFactor *factor, PetscInt n, const PetscReal c[],
                                       const PetscReal z[], PetscReal u[])
{
  HycoFOM f = factor->fom;
  Vec F[COLUMNS_AT_ONCE], x[COLUMNS_AT_ONCE];

  PetscFunctionBegin;
  PetscCall(CreateVectors(factor, n, F));
  PetscCall(CreateVectors(factor, n, x));
  for (PetscInt j = 0; j < n; j++) {
    PetscCall(VecZeroEntries(F[j]));
    /* The load of a sample from its coefficients: the vectors of loads themselves are not stored. */
    for (PetscInt k = 0; c && k < b->r; k++) PetscCall(VecAXPY(F[j], c[j * b->r + k], factor->basis[k]));
  }
  PetscCall(HycoBodiesExtend(b, factor, n, F, z, x));
  for (PetscInt j = 0; j < n; j++, u += f->fe->n_dof) {
    PetscCall(HycoFOMToLocal(f, x[j], u));
    /* Modes vanish where displacements are prescribed, as those of a POD do. */
    for (PetscInt i = 0; i < f->fe->n_dof; i++) u[i] = f->fe->fixed[i] ? 0 : u[i];
  }
  PetscCall(DestroyVectors(n, F));
  PetscCall(DestroyVectors(n, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the displacements of sample k are computed at node j of n. With many nodes of theta each sample is
   computed at about SPREAD of them, shifted from sample to sample: every node sees some samples. */
static PetscBool BodyFieldsIsSampled(PetscInt k, PetscInt j, PetscInt n)
{
  return (PetscBool)(n <= SPREAD || (j + k) % (n / SPREAD) == 0);
}

/* BodyFieldsExpand() with the factor at theta, or what an interrupted training has kept of that. Collective. */
static PetscErrorCode ExpandAt(HycoReducer t, HycoBodiesFactor *factor, const PetscReal theta[], PetscInt n,
                               const PetscReal c[], const PetscReal z[], PetscReal u[])
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  unsigned long long key = HycoBodiesKey(b, factor, "displacements", -1, theta);
  const HycoPieceArray array = {n * factor->fom->fe->n_dof, u};
  PetscBool found;

  PetscFunctionBegin;
  key = HycoPieceAdd(key, (size_t)(n * b->r) * sizeof(*c), c);
  key = HycoPieceAdd(key, (size_t)n * (size_t)(b->p + b->ns) * sizeof(*z), z);
  PetscCall(HycoSnapshotsFindPiece(t->store, key, 1, &array, &found));
  if (found) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoBodiesRefactor(t, factor, theta));
  PetscCall(BodyFieldsExpand(b, factor, n, c, z, u));
  PetscCall(HycoSnapshotsKeepPiece(t->store, key, 1, &array));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The displacements of these samples at theta, n columns. Collective. */
static PetscErrorCode ExpandSamples(HycoReducer t, HycoBodiesFactor *factor, const PetscReal theta[],
                                    const Sampled *sampled, PetscInt n, const PetscInt sample[], PetscReal u[])
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  const PetscInt n_z = b->p + b->ns;
  PetscReal *c, *z;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(COLUMNS_AT_ONCE * b->r + 1, &c, (size_t)COLUMNS_AT_ONCE * (size_t)n_z + 1,
                         &z)); /* z of motions: 0 */
  /* Several right-hand sides at once: MUMPS reads its factor once for all of them. */
  for (PetscInt first = 0; first < n; first += COLUMNS_AT_ONCE) {
    const PetscInt many = PetscMin(COLUMNS_AT_ONCE, n - first);

    for (PetscInt j = 0; j < many; j++) {
      const size_t k = (size_t)sample[first + j];

      PetscCall(PetscArraycpy(c + j * b->r, sampled->c + k * (size_t)b->r, b->r));
      PetscCall(PetscArraycpy(z + (size_t)j * (size_t)n_z + b->p, sampled->f + k * (size_t)b->ns, b->ns));
    }
    PetscCall(ExpandAt(t, factor, theta, many, c, z, u + (size_t)first * (size_t)factor->fom->fe->n_dof));
  }
  PetscCall(PetscFree2(c, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rigid motions at theta. Collective. */
static PetscErrorCode ExpandMotions(HycoReducer t, HycoBodiesFactor *factor, const PetscReal theta[], PetscReal u[])
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  PetscReal *c, *z;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(b->r + 1, &c, b->p + b->ns + 1, &z));
  for (PetscInt k = 0; k < b->p; k++, u += factor->fom->fe->n_dof) {
    /* A motion of unit size; its place in z is before those of the surfaces. */
    z[k] = 1;
    PetscCall(ExpandAt(t, factor, theta, 1, c, z, u));
    z[k] = 0;
  }
  PetscCall(PetscFree2(c, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds to sampled->U the displacements of the samples that it has not at node j, and at first the rigid motions there.
   Collective. */
static PetscErrorCode ExpandNode(HycoReducer t, HycoBodiesFactor *factor, PetscInt j, Sampled *sampled)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  const size_t n_dof = (size_t)factor->fom->fe->n_dof;
  const PetscInt last = sampled->n - sampled->n_checks, nodes = HycoBodiesGrid(b, 0, NULL);
  PetscReal theta[HYCO_MAX_PARAMETERS], *U;
  PetscInt *sample, n = 0;

  PetscFunctionBegin;
  HycoBodiesPoint(t, j, theta);
  PetscCall(PetscMalloc1(sampled->n + 1, &sample));
  for (PetscInt k = sampled->expanded; k < last; k++) {
    if (BodyFieldsIsSampled(k, j, nodes)) sample[n++] = k;
  }
  /* Columns of earlier rounds stay: doubling the samples computes the new ones only. */
  PetscCall(PetscRealloc((n_dof * (size_t)(sampled->n_U + n + b->p) + 1) * sizeof(PetscReal), &sampled->U));
  U = sampled->U + n_dof * (size_t)sampled->n_U;
  PetscCall(ExpandSamples(t, factor, theta, sampled, n, sample, U));
  PetscCall(HycoBodiesMoveTo(t, factor, theta));
  /* Stresses of about SCORED samples show where cells matter; with inelastic bodies the cells follow from the
     laws. */
  for (PetscInt k = 0; k < n && !HycoBodiesFlow(t); k += 1 + n * nodes / SCORED)
    PetscCall(HycoBodiesAddScores(t, factor, U + n_dof * (size_t)k));
  sampled->n_U += n;
  if (!sampled->expanded) {
    PetscCall(ExpandMotions(t, factor, theta, U + n_dof * (size_t)n));
    sampled->n_U += b->p;
  }
  PetscCall(PetscFree(sample));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the displacements of the modes of inelastic forces. */
static PetscErrorCode ExpandStrains(HycoBodiesFactor *factor, Sampled *sampled)
{
  const size_t n_dof = (size_t)factor->fom->fe->n_dof;

  PetscFunctionBegin;
  PetscCall(PetscRealloc((n_dof * (size_t)(sampled->n_U + factor->n_strains) + 1) * sizeof(PetscReal), &sampled->U));
  for (PetscInt k = 0; k < factor->n_strains; k++)
    PetscCall(HycoFOMToLocal(factor->fom, factor->strain[k], sampled->U + n_dof * (size_t)sampled->n_U++));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The forces are those of any theta, so that there are all patterns. Collective. */
static PetscErrorCode ExpandAll(HycoReducer t, HycoBodiesFactor *factor, Sampled *sampled)
{
  const PetscInt nodes = HycoBodiesGrid(HycoTrainingOfBodies(t)->bodies, 0, NULL);

  PetscFunctionBegin;
  /* Node by node of the grid, because each one has a factor of its own. */
  for (PetscInt j = 0; j < nodes; j++) {
    PetscCall(ExpandNode(t, factor, j, sampled));
    PetscCall(HycoReducerTell(t, "displacements of the bodies", j + 1, nodes));
  }
  if (!sampled->expanded) PetscCall(ExpandStrains(factor, sampled));
  /* The checks are at points that no mode has seen. */
  sampled->expanded = sampled->n - sampled->n_checks;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* value = G u at the unknowns of a body that have modes, else 0. Zero outside the body and at unknowns that need
   no modes (skip: `bare` ones too), so that POD spends none on them. Modes of different bodies have disjoint rows. */
static void TurnField(HycoReducer t, const HycoBodiesFactor *factor, PetscInt body, const PetscReal G[], PetscBool back,
                      PetscBool skip, const PetscReal u[], PetscReal value[])
{
  HycoFOM f = factor->fom;
  const PetscInt dim = f->fe->dim;

  for (PetscInt i = 0; i < f->part->n_nodes; i++) {
    PetscReal turned[3] = {0, 0, 0};

    if (HycoTrainingOfBodies(t)->parts.of[i] == body) HycoPoseTurn(G, dim, back, u + i * dim, turned);
    for (PetscInt c = 0; c < dim; c++)
      value[i * dim + c] = f->fe->fixed[i * dim + c] || (skip && factor->bare[i * dim + c]) ? 0 : turned[c];
  }
}

/* An empty dense matrix with n columns in the file's order. As the snapshots' matrices, so that POD and rows of V are
   the same functions for both. */
static PetscErrorCode CreateColumns(HycoReducer t, HycoFOM f, PetscInt n, Mat *S)
{
  const PetscInt dim = t->sizes[3];
  const HycoFileOrder *order;

  PetscFunctionBegin;
  PetscCall(HycoFOMGetRows(f, &order));
  PetscCall(MatCreateDense(HycoComm(t), dim * (order ? order->n[HYCO_ON_NODES] : f->part->n_nodes), PETSC_DECIDE,
                           t->sizes[0] * dim, n, NULL, S));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The columns of one body in the turns G (9 numbers each). Collective. */
static PetscErrorCode TurnedColumns(HycoReducer t, const HycoBodiesFactor *factor, PetscInt body, PetscInt n,
                                    const PetscReal U[], PetscInt turns, const PetscReal G[], PetscBool skip, Mat *S)
{
  HycoFOM f = factor->fom;
  PetscReal *value;
  PetscScalar *s;
  PetscInt lda;

  PetscFunctionBegin;
  PetscCall(CreateColumns(t, f, n * turns, S));
  PetscCall(MatDenseGetLDA(*S, &lda));
  PetscCall(PetscMalloc1(f->fe->n_dof + 1, &value));
  PetscCall(MatDenseGetArray(*S, &s));
  for (PetscInt k = 0; k < n * turns; k++) {
    TurnField(t, factor, body, G + 9 * (k % turns), PETSC_FALSE, skip, U + (size_t)(k / turns) * (size_t)f->fe->n_dof,
              value);
    /* Rows in the file's order: the POD does not depend on the partition. */
    PetscCall(HycoFOMToRows(f, HYCO_ON_NODES, MPIU_REAL, t->sizes[3], value, s + (size_t)k * (size_t)lda));
  }
  PetscCall(MatDenseRestoreArray(*S, &s));
  PetscCall(PetscFree(value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* In all of its turns: its own axes turn with the parameters, and a basis of turns spans every direction of the field.
   Collective. */
static PetscErrorCode BodyColumns(HycoReducer t, const HycoBodiesFactor *factor, PetscInt body, PetscInt n,
                                  const PetscReal U[], Mat *S)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  const PetscInt first = b->turn_start[body];

  PetscFunctionBegin;
  PetscCall(TurnedColumns(t, factor, body, n, U, b->turn_start[body + 1] - first, b->G + 9 * first, PETSC_TRUE, S));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Scales the columns to length 1 if they are not small. Collective. POD weighs by energy: samples with small loads
   would leave no mode, though the error is judged relative to each. */
static PetscErrorCode ScaleColumns(Mat S)
{
  PetscReal *norm, most = 0;
  PetscScalar *s;
  PetscInt n, lda, rows;

  PetscFunctionBegin;
  PetscCall(MatGetSize(S, NULL, &n));
  PetscCall(MatDenseGetLDA(S, &lda));
  PetscCall(MatGetLocalSize(S, &rows, NULL));
  PetscCall(PetscMalloc1(n + 1, &norm));
  PetscCall(MatGetColumnNorms(S, NORM_2, norm));
  for (PetscInt k = 0; k < n; k++) most = PetscMax(most, norm[k]);
  PetscCall(MatDenseGetArray(S, &s));
  for (PetscInt k = 0; k < n; k++) {
    /* Not those of round-off: scaled to 1 they would be modes of noise. */
    const PetscReal scale = most > 0 ? 1 / PetscMax(norm[k], LEAST_SAMPLE * most) : 0;

    for (PetscInt i = 0; i < rows; i++) s[(size_t)k * (size_t)lda + (size_t)i] *= scale;
  }
  PetscCall(MatDenseRestoreArray(S, &s));
  PetscCall(PetscFree(norm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The displacements of a body that turns, each of length 1, by fewer: *count singular values times modes of them, in
   `few` (n_dof each), to a share of the tolerance of the modes. Each of them is turned in several ways, and the cost of
   the modes grows with the square of their number. Collective. */
static PetscErrorCode BodyFieldsCompress(HycoReducer t, const HycoBodiesFactor *factor, PetscInt body, PetscInt n,
                                         const PetscReal U[], PetscInt *count, PetscReal **few)
{
  static const PetscReal as_it_is[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  const size_t n_dof = (size_t)factor->fom->fe->n_dof;
  PetscReal *sigma, norm;
  Mat S, W;

  PetscFunctionBegin;
  /* All unknowns of the body: those that need no modes turn into others that do. */
  PetscCall(TurnedColumns(t, factor, body, n, U, 1, as_it_is, PETSC_FALSE, &S));
  PetscCall(PetscMalloc1(n + 1, &sigma));
  PetscCall(ScaleColumns(S));
  PetscCall(MatNorm(S, NORM_FROBENIUS, &norm));
  *count = 0;
  if (norm > 0) PetscCall(HycoReducerPOD(t, S, TURNED_SHARE * HycoTrainingOfBodies(t)->pod_tol, 0, &W, count, sigma));
  PetscCall(MatDestroy(&S));
  PetscCall(PetscMalloc1(n_dof * (size_t)*count + 1, few));
  for (PetscInt k = 0; k < *count; k++) {
    PetscReal *own = *few + (size_t)k * n_dof;
    PetscScalar *w;

    PetscCall(MatDenseGetColumn(W, k, &w));
    PetscCall(HycoFOMFromRows(factor->fom, HYCO_ON_NODES, t->sizes[3], w, own));
    PetscCall(MatDenseRestoreColumn(W, &w));
    for (size_t i = 0; i < n_dof; i++) own[i] *= sigma[k];
  }
  if (norm > 0) PetscCall(MatDestroy(&W));
  PetscCall(PetscFree(sigma));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The matrix whose POD gives the modes of a body: its displacements in all of its turns. Collective. */
static PetscErrorCode ModeColumns(HycoReducer t, const HycoBodiesFactor *factor, PetscInt body, PetscInt n,
                                  const PetscReal U[], Mat *S)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  PetscReal *few = NULL;
  PetscInt count;

  PetscFunctionBegin;
  if (b->turn_start[body + 1] - b->turn_start[body] > 1) {
    PetscCall(BodyFieldsCompress(t, factor, body, n, U, &count, &few));
    PetscCall(BodyColumns(t, factor, body, count, few, S));
    PetscCall(PetscFree(few));
  } else {
    PetscCall(BodyColumns(t, factor, body, n, U, S));
    PetscCall(ScaleColumns(*S));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The modes of all bodies in V, and their singular values in sigma. Collective. */
static PetscErrorCode FindModes(HycoReducer t, const HycoBodiesFactor *factor, PetscInt n, const PetscReal U[], Mat *V,
                                PetscReal **sigma)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;

  PetscFunctionBegin;
  *V = NULL;
  *sigma = NULL;
  PetscCall(PetscCalloc1(b->n + 1, &b->mode_start));
  for (PetscInt k = 0; k < b->n; k++) {
    PetscReal *own, norm;
    PetscInt l = 0, columns;
    Mat S, W = NULL, joined;

    PetscCall(ModeColumns(t, factor, k, n, U, &S));
    PetscCall(MatGetSize(S, NULL, &columns));
    PetscCall(MatNorm(S, NORM_FROBENIUS, &norm));
    PetscCall(PetscCalloc1(columns + 1, &own));
    /* A body that does not move, or has no unknown of its own left, has no modes. */
    if (norm > 0) PetscCall(HycoReducerPOD(t, S, HycoTrainingOfBodies(t)->pod_tol, t->max_modes, &W, &l, own));
    PetscCall(MatDestroy(&S));
    b->mode_start[k + 1] = b->mode_start[k] + l;
    PetscCall(PetscRealloc((size_t)(b->mode_start[k + 1] + 1) * sizeof(PetscReal), sigma));
    PetscCall(PetscArraycpy(*sigma + b->mode_start[k], own, l));
    PetscCall(PetscFree(own));
    if (!l) PetscCall(MatDestroy(&W));
    if (!l) continue;
    if (*V) {
      /* Disjoint rows: the joined columns are orthonormal without another QR factorisation. */
      PetscCall(HycoJoinColumns(V, &W, &joined));
      *V = joined;
    } else
      *V = W;
  }
  b->l = b->mode_start[b->n];
  HycoCheckModel(b->l, "the bodies have no displacement at any point of the ranges; check the loads");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* norm: of the columns of S that the modes V miss. Collective. */
static PetscErrorCode BodyFieldsMissedNorm(HycoReducer t, Mat V, Mat S, PetscReal norm[])
{
  PetscBLASInt m, l, n, ld[2];
  const PetscReal one = 1, minus = -1;
  const PetscScalar *v;
  PetscScalar *s;
  PetscReal *c;
  PetscInt rows, modes, columns, lda[2];

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(V, &rows, NULL));
  PetscCall(MatGetSize(V, NULL, &modes));
  PetscCall(MatGetSize(S, NULL, &columns));
  PetscCall(PetscMalloc1((size_t)modes * (size_t)columns + 1, &c));
  /* S - V V^T S: its columns' norms by difference of matrices, since 1 - |V^T s|^2 would lose half of the digits. */
  PetscCall(HycoReducerMultiply(t, V, S, c));
  PetscCall(MatDenseGetLDA(V, &lda[0]));
  PetscCall(MatDenseGetLDA(S, &lda[1]));
  PetscCall(PetscBLASIntCast(rows, &m));
  PetscCall(PetscBLASIntCast(modes, &l));
  PetscCall(PetscBLASIntCast(columns, &n));
  for (int k = 0; k < 2; k++) PetscCall(PetscBLASIntCast(PetscMax(1, lda[k]), &ld[k]));
  PetscCall(MatDenseGetArrayRead(V, &v));
  PetscCall(MatDenseGetArray(S, &s));
  if (rows) BLASgemm_("N", "N", &m, &n, &l, &minus, v, &ld[0], c, &l, &one, s, &ld[1]);
  PetscCall(MatDenseRestoreArray(S, &s));
  PetscCall(MatDenseRestoreArrayRead(V, &v));
  PetscCall(MatGetColumnNorms(S, NORM_2, norm));
  PetscCall(PetscFree(c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* square[n]: of the displacements U (n_dof x n) of all ranks. Collective. */
static PetscErrorCode BodyFieldsSquares(HycoFOM f, PetscInt n, const PetscReal U[], PetscReal square[])
{
  PetscFunctionBegin;
  PetscCall(PetscArrayzero(square, n));
  for (PetscInt i = 0; i < f->fe->n_dof; i++) {
    if (HycoMeshOwned(f->part, i / f->fe->dim) < 0) continue;
    for (PetscInt k = 0; k < n; k++) square[k] += PetscSqr(U[(size_t)k * (size_t)f->fe->n_dof + (size_t)i]);
  }
  HycoAllreduce(square, n, MPIU_REAL, MPI_SUM, HycoComm(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* b->left at the checks. A turned field is the sum of q_j G_j u with |q|^2 = dim. Collective. What the modes miss at
   samples that they were not made of; it is the model's own estimate of its displacements. */
static PetscErrorCode MeasureLeft(HycoReducer t, HycoBodiesFactor *factor, const Sampled *sampled, Mat V)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  const PetscInt n = sampled->n_checks;
  const size_t n_dof = (size_t)factor->fom->fe->n_dof;
  PetscReal theta[HYCO_MAX_PARAMETERS], *U, *all, *lost, *norm;
  PetscInt *sample;

  PetscFunctionBegin;
  b->left = b->l ? PetscSqrtReal(HycoTrainingOfBodies(t)->pod_tol) : 0; /* what the modes may leave out elsewhere */
  PetscCall(PetscMalloc3(n_dof * (size_t)n + 1, &U, n, &all, b->dim * b->dim * n, &norm));
  PetscCall(PetscCalloc1(n, &lost));
  PetscCall(PetscMalloc1(n + 1, &sample));
  for (PetscInt k = 0; k < n; k++) sample[k] = sampled->n - n + k;
  HycoBodiesPoint(t, 0, theta);
  /* A point that is no sample. */
  PetscCall(ExpandSamples(t, factor, b->n_theta ? factor->between : theta, sampled, n, sample, U));
  PetscCall(PetscFree(sample));
  PetscCall(BodyFieldsSquares(factor->fom, n, U, all));
  for (PetscInt k = 0; k < b->n && n; k++) {
    const PetscInt turns = b->turn_start[k + 1] - b->turn_start[k];
    Mat S;

    PetscCall(BodyColumns(t, factor, k, n, U, &S));
    PetscCall(BodyFieldsMissedNorm(t, V, S, norm));
    PetscCall(MatDestroy(&S));
    /* |sum of q_j r_j|^2 <= |q|^2 sum of |r_j|^2 (Cauchy-Schwarz). */
    for (PetscInt i = 0; i < n * turns; i++) lost[i / turns] += (turns > 1 ? b->dim : 1) * PetscSqr(norm[i]);
  }
  for (PetscInt k = 0; k < n; k++) {
    if (all[k] > 0) b->left = PetscMax(b->left, PetscSqrtReal(lost[k] / all[k]));
  }
  PetscCall(PetscFree(lost));
  PetscCall(PetscFree3(U, all, norm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- coefficients -- */

/* The turned mode back in the body's axes, as a load: v = G^T V_i. Collective. V_i . (G u) = (G^T V_i) . u: one
   solve with this load gives the mode's coefficient for any forces, by reciprocity (K is symmetric). */
static PetscErrorCode TurnMode(HycoReducer t, const HycoBodiesFactor *factor, PetscInt body, PetscInt turn,
                               const PetscScalar column[], Vec v)
{
  HycoFOM f = factor->fom;
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  PetscReal *local, *turned;
  PetscScalar *a;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(f->fe->n_dof + 1, &local, f->fe->n_dof + 1, &turned));
  /* The mode lies by rows of the file, the turn needs the nodes of the part. */
  PetscCall(HycoFOMFromRows(f, HYCO_ON_NODES, b->dim, column, local));
  TurnField(t, factor, body, b->G + 9 * turn, PETSC_TRUE, PETSC_TRUE, local, turned);
  PetscCall(VecGetArray(v, &a));
  for (PetscInt i = 0; i < f->fe->n_dof; i++) {
    /* A load vector has each unknown once, on its owner. */
    const PetscInt own = HycoMeshOwned(f->part, i / b->dim);

    if (own >= 0) a[own * b->dim + i % b->dim] = turned[i];
  }
  PetscCall(VecRestoreArray(v, &a));
  PetscCall(PetscFree2(local, turned));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* v = 1 at an unknown, else 0. The right-hand side by which a row of K^-1 is obtained. */
static PetscErrorCode SetUnit(PetscInt row, Vec v)
{
  PetscInt lo, hi;
  PetscScalar *a;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(v, &lo, &hi));
  PetscCall(VecZeroEntries(v));
  PetscCall(VecGetArray(v, &a));
  if (row >= lo && row < hi) a[row - lo] = 1;
  PetscCall(VecRestoreArray(v, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* H and a of a body (hycobodies.h) at its samples, one after the other and each by columns. */
typedef struct {
  PetscInt rows;
  PetscReal *H, *a;
} Coefficient;

static PetscErrorCode AllocateCoefficients(HycoSubstructures b, Coefficient own[])
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < b->n; k++) {
    HycoSubstructure *s = &b->body[k];
    size_t rows;

    s->l = b->mode_start[k + 1] - b->mode_start[k];
    /* A row for each mode in each turn, and one for each unknown inside the chosen cells, at each sample. */
    own[k].rows = (b->turn_start[k + 1] - b->turn_start[k]) * s->l + s->m;
    rows = (size_t)s->n_samples * (size_t)own[k].rows;
    PetscCall(PetscCalloc1(rows * (size_t)s->n + 1, &own[k].H));
    PetscCall(PetscCalloc1(rows * (size_t)(b->r + b->p) + 1, &own[k].a));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first row of a body among those of the inelastic fields. */
static size_t StrainRows(HycoSubstructures b, PetscInt body)
{
  size_t rows = 0;

  for (PetscInt k = 0; k < body; k++)
    rows += (size_t)b->body[k].n_samples * (size_t)(b->turn_start[k + 1] - b->turn_start[k]) * (size_t)b->body[k].l;
  return rows;
}

/* Row i of a body as a load: one of its modes in one of its turns, or an unknown inside. Collective. */
static PetscErrorCode SetRow(HycoReducer t, HycoBodiesFactor *factor, PetscInt k, PetscInt i, Mat V, Vec v)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  const PetscInt l = b->body[k].l, turned = l * (b->turn_start[k + 1] - b->turn_start[k]);
  const PetscScalar *columns;
  PetscInt lda;

  PetscFunctionBegin;
  /* The unknowns inside come after all modes. */
  if (i >= turned) {
    PetscCall(SetUnit(factor->row[b->inner_start[k] + i - turned], v));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatDenseGetLDA(V, &lda));
  PetscCall(MatDenseGetArrayRead(V, &columns));
  PetscCall(
      TurnMode(t, factor, k, b->turn_start[k] + i / l, columns + (size_t)(b->mode_start[k] + i % l) * (size_t)lda, v));
  PetscCall(MatDenseRestoreArrayRead(V, &columns));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* H and a of a body at one of its samples, where the factor is. x: the loads' displacements. Collective. */
static PetscErrorCode BodyCoefficients(HycoReducer t, HycoBodiesFactor *factor, PetscInt k, PetscInt sample, Mat V,
                                       const Vec x[], Coefficient *own)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  HycoSubstructure *s = &b->body[k];
  /* Modes in each turn, then the unknowns inside; COLUMNS_AT_ONCE at once, since MUMPS is several times
     faster on blocks. */
  const PetscInt rows = own->rows;
  PetscReal *H = own->H + (size_t)sample * (size_t)rows * (size_t)s->n;
  PetscReal *a = own->a + (size_t)sample * (size_t)rows * (size_t)(b->r + b->p);
  PetscReal *u, *g;
  Vec v[COLUMNS_AT_ONCE];

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(COLUMNS_AT_ONCE * b->ns + 1, &u, COLUMNS_AT_ONCE * b->p + 1, &g));
  PetscCall(CreateVectors(factor, COLUMNS_AT_ONCE, v));
  for (PetscInt first = 0; first < rows; first += COLUMNS_AT_ONCE) {
    const PetscInt many = PetscMin(COLUMNS_AT_ONCE, rows - first);

    for (PetscInt j = 0; j < many; j++) PetscCall(SetRow(t, factor, k, first + j, V, v[j]));
    PetscCall(HycoBodiesReduce(b, factor, many, v, u, g));
    for (PetscInt j = 0; j < many; j++) {
      const PetscInt row = first + j;

      /* H = -N K^-1 v has a column for each unknown of the surfaces, so that a prediction adds those of the few loaded
         ones. */
      for (PetscInt d = 0; d < s->n; d++) H[(size_t)d * (size_t)rows + (size_t)row] = u[j * b->ns + b->start[k] + d];
      for (PetscInt d = 0; d < b->r; d++) PetscCall(VecDot(v[j], x[d], &a[d * rows + row]));
      for (PetscInt d = 0; d < b->p; d++) a[(b->r + d) * rows + row] = g[j * b->p + d];
      for (PetscInt d = 0; d < factor->n_strains; d++)
        PetscCall(VecDot(
            v[j], factor->strain[d],
            &b->inelastic
                 ->fields[(StrainRows(b, k) + (size_t)(sample * rows + row)) * (size_t)factor->n_strains + (size_t)d]));
    }
  }
  PetscCall(DestroyVectors(COLUMNS_AT_ONCE, v));
  PetscCall(PetscFree2(u, g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* scale[rows + n] of H: of its rows, alike for the modes and for the unknowns inside; of its columns relative to
   these. */
static void ResponseScales(const HycoSubstructure *s, const Coefficient *own, PetscReal scale[])
{
  const PetscInt rows = own->rows, columns = s->n_samples * s->n;
  PetscReal most[2] = {0, 0}, *column = scale + rows;

  for (PetscInt q = 0; q < columns; q++) {
    for (PetscInt i = 0; i < rows; i++) {
      PetscReal *group = &most[i >= rows - s->m];

      *group = PetscMax(*group, PetscAbsReal(own->H[(size_t)q * (size_t)rows + (size_t)i]));
    }
  }
  for (PetscInt i = 0; i < rows; i++) scale[i] = most[i >= rows - s->m];
  for (PetscInt d = 0; d < s->n; d++) column[d] = 0;
  for (PetscInt q = 0; q < columns; q++) {
    PetscReal *to = &column[q % s->n];

    for (PetscInt i = 0; i < rows; i++) {
      if (scale[i] > 0) *to = PetscMax(*to, PetscAbsReal(own->H[(size_t)q * (size_t)rows + (size_t)i]) / scale[i]);
    }
  }
}

/* H of a body from its samples; least: see HycoFlexibilityCreate(). */
static PetscErrorCode TakeResponses(HycoSubstructure *s, const Coefficient *own, PetscReal least)
{
  const PetscReal **sample;
  PetscReal *scale;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(s->n_samples, &sample));
  PetscCall(PetscMalloc1(own->rows + s->n + 1, &scale));
  for (PetscInt q = 0; q < s->n_samples; q++) sample[q] = own->H + (size_t)q * (size_t)own->rows * (size_t)s->n;
  if (least > 0) ResponseScales(s, own, scale);
  PetscCall(HycoFlexibilityDestroy(&s->H));
  PetscCall(HycoFlexibilityCreate(&s->tensor, own->rows, s->n, sample, scale, least, PETSC_MAX_REAL, &s->H));
  PetscCall(PetscFree(scale));
  PetscCall(PetscFree(sample));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* a of a body from its samples, all of it: a few columns. */
static PetscErrorCode TakeLoads(HycoSubstructures b, HycoSubstructure *s, const Coefficient *own)
{
  const PetscInt n = b->r + b->p;
  const PetscReal **sample;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(s->n_samples, &sample));
  for (PetscInt q = 0; q < s->n_samples; q++) sample[q] = own->a + (size_t)q * (size_t)own->rows * (size_t)n;
  PetscCall(HycoFlexibilityCreate(&s->tensor, own->rows, n, sample, NULL, 0, 0, &s->a));
  PetscCall(PetscFree(sample));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* row[own->rows] of body k for sample j at these weights, from the samples of H if `full`. */
static PetscErrorCode RowsAt(HycoSubstructures b, PetscInt k, const Coefficient *own, const Sampled *sampled,
                             PetscInt j, const PetscReal weight[], PetscBool full, PetscReal row[])
{
  const HycoSubstructure *s = &b->body[k];
  PetscReal *share, *f, *c;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(s->n_samples, &share));
  PetscCall(PetscCalloc2(s->n + 1, &f, b->r + b->p + 1, &c)); /* no motion of the body as a whole */
  PetscCall(PetscArrayzero(row, own->rows));
  for (PetscInt i = 0; i < s->n; i++) f[i] = -sampled->f[(size_t)j * (size_t)b->ns + (size_t)(b->start[k] + i)];
  PetscCall(PetscArraycpy(c, sampled->c + j * b->r, b->r));
  HycoFlexibilityShares(&s->a, s->n_samples, weight, share);
  PetscCall(HycoFlexibilityMultiply(&s->a, share, c, row));
  HycoFlexibilityShares(&s->H, s->n_samples, weight, share);
  if (!full) PetscCall(HycoFlexibilityMultiply(&s->H, share, f, row));
  for (PetscInt q = 0; q < s->n_samples * s->n && full; q++) {
    if (f[q % s->n] != 0)
      HycoBodiesAdd(own->rows, weight[q / s->n] * f[q % s->n], own->H + (size_t)q * (size_t)own->rows, row);
  }
  PetscCall(PetscFree2(f, c));
  PetscCall(PetscFree(share));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Raises *error to that of the rows of body k for the last samples' loads and forces, relative to the rows of each: by
   H as it is stored, at theta. Rank 0. */
static PetscErrorCode StoredError(HycoSubstructures b, PetscInt k, const Coefficient *own, const Sampled *sampled,
                                  const PetscReal theta[], PetscReal *error)
{
  const HycoSubstructure *s = &b->body[k];
  PetscReal mu[HYCO_MAX_PARAMETERS] = {0}, *weight, *row, *stored;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < b->n_theta; p++) mu[b->theta[p]] = theta[p];
  PetscCall(PetscMalloc3(s->n_samples, &weight, own->rows + 1, &row, own->rows + 1, &stored));
  PetscCall(HycoBodiesWeights(b, k, mu, weight));
  for (PetscInt j = PetscMax(0, sampled->n - CHECKS); j < sampled->n; j++) {
    PetscReal size = 0, missed = 0;

    PetscCall(RowsAt(b, k, own, sampled, j, weight, PETSC_TRUE, row));
    PetscCall(RowsAt(b, k, own, sampled, j, weight, PETSC_FALSE, stored));
    for (PetscInt i = 0; i < own->rows; i++) {
      size += PetscSqr(row[i]);
      missed += PetscSqr(row[i] - stored[i]);
    }
    if (size > 0) *error = PetscMax(*error, PetscSqrtReal(missed / size));
  }
  PetscCall(PetscFree3(weight, row, stored));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* H of all bodies with small terms in single precision and without those that have no effect, or all of them if that
   adds too much to what the modes miss; what it adds joins b->left. Rank 0. */
static PetscErrorCode StoreCoefficients(HycoReducer t, const HycoBodiesFactor *factor, const Sampled *sampled,
                                        const Coefficient own[])
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  PetscReal theta[HYCO_MAX_PARAMETERS], error = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < b->n; k++) {
    HycoSubstructure *s = &b->body[k];
    PetscReal added = 0;

    PetscCall(TakeLoads(b, s, &own[k]));
    PetscCall(TakeResponses(s, &own[k], s->n_samples > 1 ? SHORT_TERM : 0));
    if (s->n_samples == 1) continue;
    /* Between the samples, and at the ends of the ranges, where polynomials are largest. */
    PetscCall(StoredError(b, k, &own[k], sampled, factor->between, &added));
    for (PetscInt end = 0; end < 2; end++) {
      HycoBodiesPoint(t, end ? HycoBodiesGrid(b, 0, NULL) - 1 : 0, theta);
      PetscCall(StoredError(b, k, &own[k], sampled, theta, &added));
    }
    if (added > HYCO_SHORTENED * MISSED) {
      PetscCall(TakeResponses(s, &own[k], 0));
      added = 0;
    }
    error = PetscMax(error, added);
  }
  b->left += error;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The key of the coefficients, but for body and theta: they follow from the modes, turns, unknowns inside and inelastic
   responses. Collective. */
static PetscErrorCode KeyCoefficients(HycoReducer t, const HycoBodiesFactor *factor, Mat V, unsigned long long *key)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  const PetscScalar *v;
  PetscInt rows, lda;

  PetscFunctionBegin;
  *key = HYCO_HASH_START;
  PetscCall(MatGetLocalSize(V, &rows, NULL));
  PetscCall(MatDenseGetLDA(V, &lda));
  PetscCall(MatDenseGetArrayRead(V, &v));
  for (PetscInt j = 0; j < b->l; j++) *key = HycoPieceAdd(*key, (size_t)rows * sizeof(*v), v + (size_t)j * (size_t)lda);
  PetscCall(MatDenseRestoreArrayRead(V, &v));
  for (PetscInt d = 0; d < factor->n_strains; d++) {
    PetscCall(VecGetLocalSize(factor->strain[d], &rows));
    PetscCall(VecGetArrayRead(factor->strain[d], &v));
    *key = HycoPieceAdd(*key, (size_t)rows * sizeof(*v), v);
    PetscCall(VecRestoreArrayRead(factor->strain[d], &v));
  }
  *key = HycoPieceAdd(*key, (size_t)(9 * b->n_turns) * sizeof(*b->G), b->G);
  *key = HycoPieceAdd(*key, (size_t)b->inner_start[b->n] * sizeof(*factor->row), factor->row);
  PetscCall(HycoPieceJoin(HycoComm(t), key));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* H and a of all bodies at node j of theta, or what an interrupted training has kept of them; modes: the key of
   KeyCoefficients(). Collective. */
static PetscErrorCode NodeCoefficients(HycoReducer t, HycoBodiesFactor *factor, PetscInt j, Mat V,
                                       unsigned long long modes, Coefficient own[])
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  const PetscInt root = t->rank ? 0 : 1;
  PetscReal theta[HYCO_MAX_PARAMETERS];
  PetscBool there = PETSC_FALSE;
  Vec *x;

  PetscFunctionBegin;
  HycoBodiesPoint(t, j, theta);
  PetscCall(PetscMalloc1(b->r + 1, &x));
  for (PetscInt k = 0; k < b->n; k++) {
    const PetscInt sample = HycoBodiesSampleOf(b, k, j), H = own[k].rows * b->body[k].n,
                   a = own[k].rows * (b->r + b->p), fields = own[k].rows * factor->n_strains;
    const unsigned long long key = HycoHash(HycoBodiesKey(b, factor, "coefficients", k, theta), &modes, sizeof(modes));
    HycoPieceArray array[3] = {{0}};
    PetscBool found;

    /* Nodes that differ only in parameters that do not change the body are no samples of it. */
    if (sample < 0) continue;
    array[0] = (HycoPieceArray){root * H, own[k].H + (size_t)sample * (size_t)H};
    array[1] = (HycoPieceArray){root * a, own[k].a + (size_t)sample * (size_t)a};
    if (fields)
      array[2] = (HycoPieceArray){root * fields, b->inelastic->fields + StrainRows(b, k) * (size_t)factor->n_strains +
                                                     (size_t)sample * (size_t)fields};
    PetscCall(HycoSnapshotsFindPiece(t->store, key, 3, array, &found));
    if (found) continue;
    PetscCall(HycoBodiesRefactor(t, factor, theta));
    /* The displacements K^-1 F of the basis of the loads. */
    if (!there) PetscCall(CreateVectors(factor, b->r, x));
    if (!there) PetscCall(HycoBodiesExtend(b, factor, b->r, factor->basis, NULL, x));
    there = PETSC_TRUE;
    PetscCall(BodyCoefficients(t, factor, k, sample, V, x, &own[k]));
    PetscCall(HycoSnapshotsKeepPiece(t->store, key, 3, array));
  }
  if (there) PetscCall(DestroyVectors(b->r, x));
  PetscCall(PetscFree(x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From the last node to the first: its factor is still there after ExpandAll(), and the kept ones are those used
   last. */
static PetscErrorCode AllCoefficients(HycoReducer t, HycoBodiesFactor *factor, const Sampled *sampled, Mat V,
                                      Coefficient own[])
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  const PetscInt nodes = HycoBodiesGrid(b, 0, NULL);
  unsigned long long modes;

  PetscFunctionBegin;
  PetscCall(AllocateCoefficients(b, own));
  if (b->inelastic) PetscCall(PetscCalloc1(StrainRows(b, b->n) * (size_t)factor->n_strains + 1, &b->inelastic->fields));
  PetscCall(KeyCoefficients(t, factor, V, &modes));
  for (PetscInt j = nodes - 1; j >= 0; j--) { /* the last factor is there */
    PetscCall(NodeCoefficients(t, factor, j, V, modes, own));
    PetscCall(HycoReducerTell(t, "coefficients of the modes", nodes - j, nodes));
  }
  HycoOnRoot(HycoComm(t), StoreCoefficients(t, factor, sampled, own));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode BodyFieldsCoefficients(HycoReducer t, HycoBodiesFactor *factor, const Sampled *sampled, Mat V)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  Coefficient *own;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(b->n, &own));
  ierr = AllCoefficients(t, factor, sampled, V, own);
  for (PetscInt k = 0; k < b->n; k++) HycoFreeAll(&own[k].H, &own[k].a);
  PetscCall(PetscFree(own));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces the modes of the training solutions. Collective. The reducer takes V and sigma over. VtU, the
   coefficients of the training solutions, must be those of these modes: the model is judged by them. */
static PetscErrorCode TakeModes(HycoReducer t, HycoSnapshots store, Mat V, PetscReal sigma[])
{
  Mat S;

  PetscFunctionBegin;
  t->l = HycoTrainingOfBodies(t)->bodies->l;
  PetscCall(PetscFree(t->sigma));
  t->sigma = sigma;
  PetscCall(PetscFree(t->VtU));
  PetscCall(PetscMalloc1(t->l * t->n_s, &t->VtU));
  PetscCall(HycoReducerGetDisplacements(t, store, &S));
  /* V^T U of the training solutions, by which regressions and the report measure what the modes miss. */
  PetscCall(HycoReducerMultiply(t, V, S, t->VtU));
  HycoDestroyAll(&S, &t->V);
  t->V = V;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* factor->in_mesh. Rank 0. By number in the whole mesh, because the surfaces' mesh and the model's have different
   local ones. */
static PetscErrorCode FindInMesh(HycoReducer t, HycoBodiesFactor *factor)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  HycoMesh surface = t->fom->surface;
  PetscBool *contact;
  PetscInt *node, n = 0, at;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(surface->n_nodes, &contact));
  PetscCall(PetscMalloc1(surface->n_nodes, &node));
  /* The contacts that the model keeps, with their masters over the ranges. */
  PetscCall(HycoReducerMarkContacts(t, contact));
  for (PetscInt i = 0; i < surface->n_nodes; i++) {
    if (contact[i]) node[n++] = surface->node_whole ? surface->node_whole[i] : i;
  }
  PetscCall(PetscSortInt(n, node));
  for (PetscInt k = 0; k < b->ns; k++) {
    PetscCall(PetscFindInt(b->dof[k] / b->dim, n, node, &at));
    factor->in_mesh[k] = (PetscBool)(at >= 0);
  }
  HycoFreeAll(&node, &contact);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What modes may miss at a check; a tolerance of the user's that leaves out more is no reason for more samples. */
static PetscReal BodyFieldsMissedShare(HycoReducer t)
{
  return PetscMax(MISSED, 10 * PetscSqrtReal(HycoTrainingOfBodies(t)->pod_tol));
}

/* The modes of `wanted` samples, the number `doubled` of doublings; *enough: the samples are many more than the modes
   of any body, which miss little at the checks, or there is no room for more. Collective. */
static PetscErrorCode ModesOf(HycoReducer t, HycoSnapshots store, HycoBodiesFactor *factor, PetscInt wanted,
                              PetscInt doubled, Sampled *sampled, Mat *V, PetscReal **sigma, PetscBool *enough)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  PetscBool all;

  PetscFunctionBegin;
  /* Samples are solutions of the condensed bodies: each costs a dense contact problem and no factor. */
  PetscCall(BodyFieldsSample(t, store, factor->fom, wanted, &all, sampled));
  PetscCall(ExpandAll(t, factor, sampled));
  if (!HycoBodiesFlow(t)) PetscCall(HycoBodiesChooseCells(t, factor)); /* else those with laws are chosen */
  PetscCall(PetscFree(b->mode_start));
  PetscCall(FindModes(t, factor, sampled->n_U, sampled->U, V, sigma));
  if (!t->scene->n_times) PetscCall(MeasureLeft(t, factor, sampled, *V));
  PetscCall(PetscInfo(NULL, "%d samples of bodies, of which %d are checks: %d modes miss %.1e\n", (int)sampled->n,
                      (int)sampled->n_checks, (int)b->l, (double)b->left));
  /* If the modes are nearly as many as the samples, further samples would give further modes. */
  *enough = PETSC_TRUE;
  for (PetscInt k = 0; k < b->n; k++)
    *enough = (PetscBool)(*enough && b->mode_start[k + 1] - b->mode_start[k] <= MOST_MODES * sampled->expanded);
  HycoTrainingOfBodies(t)->filled = (PetscBool) !*enough;
  /* What modes miss at the checks is doubled for at most a few times: geometry parameters may never be spanned. */
  if (sampled->n_checks && doubled < UNTIL_SEEN) *enough = (PetscBool)(*enough && b->left <= BodyFieldsMissedShare(t));
  *enough = (PetscBool)(*enough || !all);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Samples are doubled until the modes are few beside them and miss little. Only the last V and sigma survive. sampled
   keeps what earlier rounds have found: doubling adds to it. */
PetscErrorCode HycoBodiesFields(HycoReducer t, HycoSnapshots store, HycoBodiesFactor *factor)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  PetscReal *sigma = NULL;
  Mat V = NULL;
  Sampled sampled = {0};
  PetscBool enough = PETSC_FALSE;
  PetscErrorCode ierr = PETSC_SUCCESS;

  PetscFunctionBegin;
  if (t->scene->n_times) {
    PetscCall(PetscFree(b->inner_start));
    PetscCall(PetscCalloc1(b->n + 1, &b->inner_start));
  }
  PetscCall(PetscCalloc1(factor->fom->part->n_cells + 1, &factor->score));
  PetscCall(PetscCalloc1(factor->fom->fe->n_dof + 1, &factor->known));
  PetscCall(PetscCalloc1(factor->fom->fe->n_dof + 1, &factor->bare));
  PetscCall(PetscCalloc1(b->ns + 1, &factor->in_mesh));
  /* The surfaces' mesh is on rank 0. */
  HycoOnRoot(HycoComm(t), FindInMesh(t, factor));
  HycoBcast(factor->in_mesh, b->ns, HYCO_MPI_BOOL, HycoComm(t));
  PetscCall(PetscCalloc1(factor->fom->fe->n_dof + 1, &factor->moved));
  for (PetscInt n = HycoTrainingOfBodies(t)->samples, k = 0; !ierr && !enough && k <= DOUBLINGS; n *= 2, k++) {
    PetscCall(MatDestroy(&V));
    PetscCall(PetscFree(sigma));
    ierr = ModesOf(t, store, factor, n, k, &sampled, &V, &sigma, &enough);
  }
  PetscCall(PetscFree(sampled.U));
  /* Rows of H and a for the modes that were kept: only once, after the last doubling. */
  if (!ierr) ierr = BodyFieldsCoefficients(t, factor, &sampled, V);
  HycoFreeAll(&sampled.c, &sampled.f);
  if (ierr) {
    PetscCall(MatDestroy(&V));
    PetscCall(PetscFree(sigma));
  }
  PetscCall(ierr);
  PetscCall(TakeModes(t, store, V, sigma));
  PetscFunctionReturn(PETSC_SUCCESS);
}
