/*
  The factors of the bodies. K couples no bodies: each has a factor of its own block with the unknowns of its surfaces
  last, and is factored again only where its own parameters of theta change. The Schur complement is its flexibility
  C_b; the unknowns that MUMPS pins for a body that contact alone holds are its isostatic supports, and give the rigid
  motions.
*/
#include <hycobodiestraining.h>
#include <string.h>

/* Share of the memory for factors of samples that are kept: the rest is for snapshots and flexibilities. */
#define KEPT_FACTORS 0.3

/* Exact equality: theta comes from Node() each time, by the same operations, and a factor serves no other point. */
static PetscBool BodyFactorsIsSame(PetscInt n, const PetscReal a[], const PetscReal b[])
{
  for (PetscInt p = 0; p < n; p++) {
    if (a[p] != b[p]) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* -- blocks -- */

/* The unknowns of each body on this rank. Bodies share no node, so each has a block of K of its own, which is factored
   by itself. */
static PetscErrorCode TakeRows(HycoReducer t, HycoBodiesFactor *factor)
{
  HycoMesh m = factor->fom->part;
  const PetscInt dim = m->dim;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_owned + 1, &factor->owner));
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    /* By owned node, in the order of the distributed vectors; `of` is by local node with ghosts. */
    if (HycoMeshOwned(m, i) >= 0) factor->owner[HycoMeshOwned(m, i)] = HycoTrainingOfBodies(t)->parts.of[i];
  }
  for (PetscInt k = 0; k < factor->n; k++) {
    PetscInt *global, n = 0;

    PetscCall(PetscMalloc1(m->n_owned * dim + 1, &global));
    for (PetscInt i = 0; i < m->n_owned * dim; i++) {
      if (factor->owner[i / dim] == k) global[n++] = m->first * dim + i;
    }
    PetscCall(ISCreateGeneral(HycoComm(t), n, global, PETSC_COPY_VALUES, &factor->body[k].global));
    PetscCall(ISSetBlockSize(factor->body[k].global, dim)); /* its matrix is ordered by node */
    PetscCall(PetscFree(global));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of N are body after body, so that those of one are a stride on each rank; a body without surfaces has
   no N and no C, and takes part by its factor alone. */
PetscErrorCode HycoBodiesSplit(HycoReducer t, Mat N, HycoBodiesFactor *factor)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  PetscInt lo, hi;

  PetscFunctionBegin;
  factor->n = b->n;
  PetscCall(PetscCalloc1(b->n, &factor->body));
  PetscCall(TakeRows(t, factor));
  PetscCall(MatGetOwnershipRange(N, &lo, &hi));
  for (PetscInt k = 0; k < b->n; k++) {
    HycoBodyFactor *body = &factor->body[k];
    const PetscInt begin = PetscMax(lo, b->start[k]), end = PetscMin(hi, b->start[k + 1]);
    IS surface;

    /* A body that nothing may touch has no rows in the dense problem. */
    if (b->start[k] == b->start[k + 1]) continue;
    /* The part of the body's rows that this rank has; possibly none, but the call is collective. */
    PetscCall(ISCreateStride(HycoComm(t), PetscMax(end - begin, 0), begin, 1, &surface));
    PetscCall(MatCreateSubMatrix(N, surface, body->global, MAT_INITIAL_MATRIX, &body->N));
    PetscCall(ISDestroy(&surface));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gives each pin, an unknown of K, to its body. Collective. */
static PetscErrorCode SharePins(HycoSubstructures b, HycoBodiesFactor *factor)
{
  const PetscInt lo = factor->fom->part->first * b->dim, hi = lo + factor->fom->part->n_owned * b->dim;
  PetscInt *at; /* by pin: its body, its number in the body's block */

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(2 * b->p + 1, &at));
  for (PetscInt i = 0; i < b->p; i++) {
    PetscInt first;

    /* The owner alone knows the pin's body and place; the maximum over ranks passes them on. */
    at[2 * i] = at[2 * i + 1] = -1;
    if (factor->pins[i] < lo || factor->pins[i] >= hi) continue;
    at[2 * i] = factor->owner[(factor->pins[i] - lo) / b->dim];
    /* Not collective: only the rank that has the pin asks. */
    PetscCall(MatGetOwnershipRange(factor->body[at[2 * i]].K, &first, NULL));
    PetscCall(ISLocate(factor->body[at[2 * i]].global, factor->pins[i], &at[2 * i + 1]));
    at[2 * i + 1] += first;
  }
  HycoAllreduce(at, 2 * b->p, MPIU_INT, MPI_MAX, HycoComm(factor->fom));
  for (PetscInt k = 0; k < b->n; k++) {
    HycoBodyFactor *body = &factor->body[k];

    PetscCall(PetscMalloc2(b->p + 1, &body->motion, b->p + 1, &body->pin));
    for (PetscInt i = 0; i < b->p; i++) {
      if (at[2 * i] != k) continue;
      body->motion[body->p] = i;
      body->pin[body->p++] = at[2 * i + 1];
    }
  }
  PetscCall(PetscFree(at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The isostatic supports are the same at all samples, because their motions are unknowns, whatever a new choice would
   be. Collective. */
static PetscErrorCode TakePins(HycoReducer t, HycoBodiesFactor *factor)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  PetscInt kernel;

  PetscFunctionBegin;
  PetscCall(HycoKernelSize(factor->fom->K, &kernel));
  if (!factor->pins) b->p = kernel;
  HycoCheckModel(kernel == b->p, "the number of rigid motions that contact alone prevents changes with the parameters, "
                                 "which a model of bodies does not support; train a hybrid model");
  if (factor->pins) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(b->p + 1, &factor->pins));
  PetscCall(HycoKernelPins(factor->fom->K, b->p, factor->pins));
  PetscCall(SharePins(b, factor));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* own: theta, as at `first` where it does not change the body. */
static void OwnTheta(HycoSubstructures b, PetscInt k, const PetscReal theta[], PetscReal own[])
{
  for (PetscInt p = 0; p < b->n_theta; p++) own[p] = HycoBodiesAxis(b, k, p) ? theta[p] : b->first[b->theta[p]];
}

/* -- factors -- */

/* The nodes at theta. Collective. */
PetscErrorCode HycoBodiesMoveTo(HycoReducer t, HycoBodiesFactor *factor, const PetscReal theta[])
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  HycoFOM f = factor->fom;
  PetscReal mu[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  /* Positions are kept from sample to sample: the grid changes one axis at a time. */
  if (factor->theta && BodyFactorsIsSame(b->n_theta, theta, factor->theta)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree(factor->theta));
  factor->assembled = PETSC_FALSE;
  /* All other parameters are those of the first point: they enter by poses and factors, exactly. */
  PetscCall(PetscArraycpy(mu, b->first, b->n_variables));
  for (PetscInt p = 0; p < b->n_theta; p++) mu[b->theta[p]] = theta[p];
  f->fe->ready = PETSC_FALSE;
  HycoOnEach(HycoComm(f), HycoFESetParameters(f->fe, mu));
  /* Whether a map mirrors a body must be the same decision on all ranks. */
  if (f->size > 1) PetscCall(HycoFEAgreeOnMirrors(HycoComm(f), f->fe));
  HycoDuplicate(b->n_theta + 1, theta, &factor->theta);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* K, and the blocks of the bodies, at theta. Collective. K of all bodies, though only one may be factored:
   assembly is cheap beside a factor, and at one theta it is done once. The null space is attached for TakePins(). */
static PetscErrorCode AssembleAt(HycoReducer t, HycoBodiesFactor *factor, const PetscReal theta[])
{
  HycoFOM f = factor->fom;

  PetscFunctionBegin;
  PetscCall(HycoBodiesMoveTo(t, factor, theta));
  if (factor->assembled) PetscFunctionReturn(PETSC_SUCCESS);
  HycoOnEach(HycoComm(f), HycoFEAssembleStiffness(f->fe, f->K));
  /* Rigid motions at these positions: a turn depends on the nodes. */
  PetscCall(HycoFOMSetMotions(f));
  for (PetscInt k = 0; k < factor->n; k++) {
    HycoBodyFactor *body = &factor->body[k];

    PetscCall(MatCreateSubMatrix(f->K, body->global, body->global, body->K ? MAT_REUSE_MATRIX : MAT_INITIAL_MATRIX,
                                 &body->K));
  }
  PetscCall(TakePins(t, factor));
  factor->assembled = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses bodies that need more memory than there is: the factors, of which the analysis has the sizes, a Schur
   complement on every rank, the flexibilities at the first samples and at those beside them, and the sampled
   displacements. Collective. */
static PetscErrorCode CheckMemory(HycoReducer t, HycoBodiesFactor *factor)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  PetscReal limit, all, bytes = 0, flexibilities = 0, most = 0;
  HycoSolver solver;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < b->n; k++) {
    PetscInt axes = 0;

    /* Three values along each axis to begin with, and held-out ones beside them. */
    for (PetscInt p = 0; p < b->n_theta; p++) axes += HycoBodiesAxis(b, k, p);
    bytes += factor->body[k].bytes;
    /* The Schur complement of one body at a time is on every rank while it is formed. */
    most = PetscMax(most, PetscSqr((PetscReal)(factor->body[k].p + b->body[k].n)));
    flexibilities += (PetscPowReal(3, (PetscReal)axes) + 2 * axes) * PetscSqr((PetscReal)b->body[k].n);
  }
  all = bytes + 8 * (most * factor->fom->size + flexibilities +
                     (PetscReal)t->sizes[0] * b->dim * HycoTrainingOfBodies(t)->samples);
  PetscCall(HycoFOMGetSolver(factor->fom, &solver));
  PetscCall(HycoSolverMemory(solver, &limit));
  HycoCheckModel(all <= limit,
                 "a model of bodies needs %.3g GB to be made (the factor %.3g GB, flexibilities of %d unknowns on "
                 "surfaces %.3g GB), and %.3g GB are available (-hyco_memory); train a hybrid model",
                 (double)(1e-9 * all), (double)(1e-9 * bytes), (int)b->ns, (double)(8e-9 * flexibilities),
                 (double)(1e-9 * limit));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A further factor of a body beside those that are kept, or in the place of the last one if they would take more than a
   share of the memory. Collective. */
static PetscErrorCode NextFactor(HycoBodiesFactor *factor, HycoBodyFactor *body)
{
  PetscReal limit, bytes = body->bytes;
  HycoSolver solver;

  PetscFunctionBegin;
  body->now = body->n_kept - 1;
  /* The last one was analysed but not factored yet: it is still free. */
  if (body->n_kept && !body->kept[body->now].theta) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoFOMGetSolver(factor->fom, &solver));
  PetscCall(HycoSolverMemory(solver, &limit));
  for (PetscInt k = 0; k < factor->n; k++) bytes += factor->body[k].n_kept * factor->body[k].bytes;
  if (body->n_kept && bytes > KEPT_FACTORS * limit) {
    /* theta NULL: not factored, so that BodyFactorsRecall() does not find the old one while it is replaced. */
    PetscCall(PetscFree(body->kept[body->now].theta));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscRealloc((size_t)(body->n_kept + 1) * sizeof(*body->kept), &body->kept));
  body->now = body->n_kept++;
  body->kept[body->now].theta = NULL;
  PetscCall(HycoDirectCreate(HycoComm(factor->fom), &body->kept[body->now].direct));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Before the factor. Collective. The pins before the analysis, which orders them into the Schur complement beside
   the surfaces' unknowns. A kept analysis of the same pattern is used again. */
static PetscErrorCode BodyFactorsAnalyse(HycoBodiesFactor *factor, HycoBodyFactor *body)
{
  PetscFunctionBegin;
  PetscCall(NextFactor(factor, body));
  body->direct = body->kept[body->now].direct;
  PetscCall(HycoDirectPin(body->direct, body->p, body->pin));
  PetscCall(HycoDirectAnalyse(body->direct, body->K, NULL, body->N, PETSC_TRUE, &body->bytes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The flexibility and the rigid motions from the Schur complement M, by columns. Rank 0. */
static PetscErrorCode TakeBlock(HycoSubstructures b, const HycoBodyFactor *body, PetscInt n_own, const PetscReal M[],
                                HycoBodyRecord *record)
{
  const size_t p = (size_t)body->p, n = (size_t)n_own;

  PetscFunctionBegin;
  for (size_t j = 0; j < n; j++) {
    /* M is by columns with the p pins first: rows of a surface column are its work on the motions, then C. */
    const PetscReal *column = M + (p + j) * (p + n);

    PetscCall(PetscArraycpy(record->C + j * n, column + p, n));
    for (size_t i = 0; i < p; i++) record->Z[j * (size_t)b->p + (size_t)body->motion[i]] = column[i];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Factors a body; record: takes its block; NULL: it is not needed. theta: its own. Collective. */
static PetscErrorCode BodyFactorsFactor(HycoReducer t, HycoBodiesFactor *factor, PetscInt k, const PetscReal theta[],
                                        HycoBodyRecord *record)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  HycoBodyFactor *body = &factor->body[k];
  const PetscBool first = (PetscBool)!body->n_kept;
  PetscReal *M;
  PetscBool singular;
  size_t n;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(AssembleAt(t, factor, theta));
  /* Before the first factor of all: their sizes are needed for CheckMemory(), which refuses before any factor. */
  for (PetscInt j = 0; j < b->n && first; j++) PetscCall(BodyFactorsAnalyse(factor, &factor->body[j]));
  if (first) PetscCall(CheckMemory(t, factor));
  PetscCall(BodyFactorsAnalyse(factor, body));
  n = (size_t)(body->p + b->body[k].n);
  PetscCall(PetscCalloc1(n * n + 1, &M));
  /* M is on every rank, and freed before an error returns: it is the largest array here. */
  ierr = HycoDirectFactor(body->direct, body->K, NULL, body->N, M, &singular);
  if (!ierr && record && !t->rank) ierr = TakeBlock(b, body, b->body[k].n, M, record);
  PetscCall(PetscFree(M));
  PetscCall(ierr);
  HycoCheckModel(!singular, "the stiffness of the bodies is singular; check supports and springs");
  HycoDuplicate(b->n_theta + 1, theta, &body->kept[body->now].theta);
  HycoTrainingOfBodies(t)->n_factors++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The factor of a body at its own theta, if it is kept. */
static PetscBool BodyFactorsRecall(HycoBodyFactor *body, PetscInt n, const PetscReal theta[])
{
  for (PetscInt i = 0; i < body->n_kept; i++) {
    if (!body->kept[i].theta || !BodyFactorsIsSame(n, theta, body->kept[i].theta)) continue;
    body->now = i;
    body->direct = body->kept[i].direct;
    return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* Afterwards every body has its factor at theta; no body is condensed, its record stays. */
PetscErrorCode HycoBodiesRefactor(HycoReducer t, HycoBodiesFactor *factor, const PetscReal theta[])
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  PetscReal own[HYCO_MAX_PARAMETERS] = {0};

  PetscFunctionBegin;
  for (PetscInt k = 0; k < factor->n; k++) {
    /* Only the axes that change this body: at others its factor is the same. */
    OwnTheta(b, k, theta, own);
    if (!BodyFactorsRecall(&factor->body[k], b->n_theta, own)) PetscCall(BodyFactorsFactor(t, factor, k, own, NULL));
  }
  /* BodyFactorsFactor() may have moved the nodes to positions of another body's sample. */
  PetscCall(HycoBodiesMoveTo(t, factor, theta));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- solves -- */

/* in[k n + j]: load j, or z of it, is not zero on body k. */
static PetscErrorCode FindLoaded(HycoSubstructures b, HycoBodiesFactor *factor, PetscInt n, const Vec F[],
                                 const PetscReal z[], PetscBool in[])
{
  const PetscInt n_z = b->p + b->ns, rows = factor->fom->part->n_owned * b->dim;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(in, n * factor->n));
  for (PetscInt j = 0; j < n; j++) {
    const PetscScalar *a;

    PetscCall(VecGetArrayRead(F[j], &a));
    for (PetscInt i = 0; i < rows; i++) {
      if (a[i] != 0) in[factor->owner[i / b->dim] * n + j] = PETSC_TRUE;
    }
    PetscCall(VecRestoreArrayRead(F[j], &a));
    for (PetscInt k = 0; k < factor->n && z && !factor->fom->rank; k++) {
      const PetscReal *own = z + (size_t)j * (size_t)n_z;

      for (PetscInt i = 0; i < factor->body[k].p; i++)
        in[k * n + j] = (PetscBool)(in[k * n + j] || own[factor->body[k].motion[i]] != 0);
      for (PetscInt i = b->start[k]; i < b->start[k + 1]; i++)
        in[k * n + j] = (PetscBool)(in[k * n + j] || own[b->p + i] != 0);
    }
  }
  /* Every rank must make the same solves: which loads a body has is known after this only. */
  HycoAllreduce(in, n * factor->n, HYCO_MPI_BOOL, MPI_LOR, HycoComm(factor->fom));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The loads of a body: *many of n, number[many], restricted to it in v[many]. Collective. */
static PetscErrorCode TakeLoaded(const HycoBodyFactor *body, PetscInt n, const Vec F[], const PetscBool in[],
                                 PetscInt *many, PetscInt **number, Vec **v)
{
  Vec first;

  PetscFunctionBegin;
  *many = 0;
  PetscCall(PetscMalloc1(n + 1, number));
  for (PetscInt j = 0; j < n; j++) {
    /* Most loads act on few bodies: a solve for each of the others would return zeros. */
    if (in[j]) (*number)[(*many)++] = j;
  }
  *v = NULL;
  if (!*many) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatCreateVecs(body->K, &first, NULL));
  PetscCall(VecDuplicateVecs(first, *many, v));
  PetscCall(VecDestroy(&first));
  /* Reverse: from the vector of all bodies to the body's own. */
  for (PetscInt j = 0; j < *many; j++) PetscCall(VecISCopy(F[(*number)[j]], body->global, SCATTER_REVERSE, (*v)[j]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* HycoDirectReduceMany() gives -N K^-1 F (D = 0): u and the work have the opposite sign. A body without surfaces
   and motions has nothing to give. */
static PetscErrorCode ReduceBody(HycoSubstructures b, HycoBodiesFactor *factor, PetscInt k, PetscInt n, const Vec F[],
                                 const PetscBool in[], PetscReal u[], PetscReal work[])
{
  const HycoBodyFactor *body = &factor->body[k];
  /* Motions of this body first, then its surfaces, as MUMPS returns the reduced vector. */
  const PetscInt n_q = body->p + b->body[k].n;
  PetscInt many, *number;
  PetscReal *q;
  Vec *v;

  PetscFunctionBegin;
  if (!n_q) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(TakeLoaded(body, n, F, in, &many, &number, &v));
  PetscCall(PetscMalloc1((size_t)n_q * (size_t)many + 1, &q));
  PetscCall(HycoDirectReduceMany(body->direct, many, v, q));
  for (PetscInt j = 0; j < many; j++) {
    const PetscReal *own = q + (size_t)j * (size_t)n_q;

    /* Rows of the dense problem are numbered over all bodies. */
    for (PetscInt i = 0; i < body->p; i++) work[number[j] * b->p + body->motion[i]] = -own[i];
    for (PetscInt i = 0; i < b->body[k].n; i++)
      u[(size_t)number[j] * (size_t)b->ns + (size_t)(b->start[k] + i)] = -own[body->p + i];
  }
  PetscCall(PetscFree(q));
  PetscCall(VecDestroyVecs(many, &v));
  PetscCall(PetscFree(number));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* u: the displacements of the surfaces' unknowns under F; work: of F on the rigid motions. */
PetscErrorCode HycoBodiesReduce(HycoSubstructures b, HycoBodiesFactor *factor, PetscInt n, const Vec F[], PetscReal u[],
                                PetscReal work[])
{
  PetscBool *in;

  PetscFunctionBegin;
  /* Bodies without the load keep zeros. */
  PetscCall(PetscArrayzero(u, (size_t)b->ns * (size_t)n));
  PetscCall(PetscArrayzero(work, b->p * n));
  PetscCall(PetscMalloc1(n * factor->n + 1, &in));
  /* On all ranks alike: whether a body is loaded is a collective decision, since its solve is. */
  PetscCall(FindLoaded(b, factor, n, F, NULL, in));
  for (PetscInt k = 0; k < factor->n; k++) PetscCall(ReduceBody(b, factor, k, n, F, in + k * n, u, work));
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x is zero where a body is not loaded. q is read on rank 0 only, z NULL: no forces of contacts. */
static PetscErrorCode ExtendBody(HycoSubstructures b, HycoBodiesFactor *factor, PetscInt k, PetscInt n, const Vec F[],
                                 const PetscReal z[], const PetscBool in[], Vec x[])
{
  const HycoBodyFactor *body = &factor->body[k];
  const PetscInt n_q = body->p + b->body[k].n;
  PetscInt many, *number;
  PetscReal *q;
  Vec *v;

  PetscFunctionBegin;
  PetscCall(TakeLoaded(body, n, F, in, &many, &number, &v));
  PetscCall(PetscCalloc1((size_t)n_q * (size_t)many + 1, &q));
  for (PetscInt j = 0; j < many && z && !factor->fom->rank; j++) {
    const PetscReal *all = z + (size_t)number[j] * (size_t)(b->p + b->ns);
    PetscReal *own = q + (size_t)j * (size_t)n_q;

    for (PetscInt i = 0; i < body->p; i++) own[i] = all[body->motion[i]];
    PetscCall(PetscArraycpy(own + body->p, all + b->p + b->start[k], b->body[k].n));
  }
  /* In place: v holds the loads, then the displacements. */
  PetscCall(HycoDirectExpandMany(body->direct, many, v, q, v));
  for (PetscInt j = 0; j < many; j++) PetscCall(VecISCopy(x[number[j]], body->global, SCATTER_FORWARD, v[j]));
  PetscCall(PetscFree(q));
  PetscCall(VecDestroyVecs(many, &v));
  PetscCall(PetscFree(number));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x: displacements everywhere from loads F and surface forces z, with the factors that are there. */
PetscErrorCode HycoBodiesExtend(HycoSubstructures b, HycoBodiesFactor *factor, PetscInt n, const Vec F[],
                                const PetscReal z[], Vec x[])
{
  PetscBool *in;

  PetscFunctionBegin;
  /* Bodies add disjoint parts of the displacement. */
  for (PetscInt j = 0; j < n; j++) PetscCall(VecZeroEntries(x[j]));
  PetscCall(PetscMalloc1(n * factor->n + 1, &in));
  PetscCall(FindLoaded(b, factor, n, F, z, in));
  for (PetscInt k = 0; k < factor->n; k++) PetscCall(ExtendBody(b, factor, k, n, F, z, in + k * n, x));
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- records -- */

/* R and the work of each vector of the basis of the loads on a body. Collective. */
static PetscErrorCode BodyFactorsRespond(HycoSubstructures b, HycoBodiesFactor *factor, PetscInt k,
                                         HycoBodyRecord *record)
{
  const PetscInt n = b->body[k].n;
  PetscReal *u, *work;
  PetscBool *in;
  PetscInt p;
  const Vec *motion;

  PetscFunctionBegin;
  PetscCall(HycoKernelVectors(factor->fom->K, &p, &motion));
  PetscCall(PetscCalloc2(b->ns * b->r + 1, &u, b->p * b->r + 1, &work));
  PetscCall(PetscMalloc1(b->r * factor->n + 1, &in));
  /* The basis of loads as vectors; a vector may load several bodies. */
  PetscCall(FindLoaded(b, factor, b->r, factor->basis, NULL, in));
  PetscCall(ReduceBody(b, factor, k, b->r, factor->basis, in + k * b->r, u, work));
  /* The vectors have length 1, and round-off of it on bodies that they do not load. */
  for (PetscInt d = 0; d < b->r; d++)
    PetscCall(HycoMotionClean(b->p, motion, NULL, factor->pins, factor->basis[d], HYCO_NOTHING, work + d * b->p));
  /* By unknown, as predictions read them: R c is then one product by rows. */
  for (PetscInt d = 0; d < b->r && !factor->fom->rank; d++) {
    for (PetscInt i = 0; i < n; i++) record->R[i * b->r + d] = u[d * b->ns + b->start[k] + i];
    for (PetscInt i = 0; i < b->p; i++) record->work[i * b->r + d] = work[d * b->p + i];
  }
  PetscCall(PetscFree(in));
  PetscCall(PetscFree2(u, work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The key of what is computed at these values of theta (NULL: at all) for body k, which follows from the surfaces'
   unknowns and the loads' basis. */
unsigned long long HycoBodiesKey(HycoSubstructures b, const HycoBodiesFactor *factor, const char what[], PetscInt k,
                                 const PetscReal theta[])
{
  unsigned long long key = HycoHash(factor->key, what, strlen(what) + 1);

  key = HycoHash(key, &k, sizeof(k));
  return HycoHash(key, theta, (size_t)b->n_theta * sizeof(*theta));
}

/* The common part of all keys. Collective. */
PetscErrorCode HycoBodiesBeginKeys(HycoReducer t, HycoBodiesFactor *factor)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  const size_t rows = (size_t)(factor->fom->part->n_owned * b->dim);
  unsigned long long key = HycoHash(HYCO_HASH_START, HycoVersion(), strlen(HycoVersion()));

  PetscFunctionBegin;
  key = HycoPieceAdd(key, (size_t)b->n_variables * sizeof(PetscReal), b->first);
  key = HycoPieceAdd(key, (size_t)(b->n + 1) * sizeof(PetscInt), b->start);
  key = HycoPieceAdd(key, (size_t)b->ns * sizeof(PetscInt), b->dof);
  for (PetscInt k = 0; k < factor->n_basis; k++) {
    const PetscScalar *v;

    PetscCall(VecGetArrayRead(factor->basis[k], &v));
    key = HycoPieceAdd(key, rows * sizeof(PetscScalar), v);
    PetscCall(VecRestoreArrayRead(factor->basis[k], &v));
  }
  PetscCall(HycoPieceJoin(HycoComm(t), &key));
  factor->key = key;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A body condensed at its own theta, or what an interrupted training has kept of that. Collective. */
static PetscErrorCode MakeRecord(HycoReducer t, HycoBodiesFactor *factor, PetscInt k, HycoBodyRecord *r)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  const unsigned long long key = HycoBodiesKey(b, factor, "record", k, r->theta);
  const PetscInt root = t->rank ? 0 : 1, n = b->body[k].n;
  HycoPieceArray array[] = {
      {root * n * n, NULL}, {root * n * b->r, NULL}, {root * n * b->p, NULL}, {root * b->p * b->r, NULL}};
  PetscBool found;

  PetscFunctionBegin;
  for (int j = 0; j < HYCO_PIECE_ARRAYS; j++) PetscCall(PetscCalloc1(array[j].n + 1, &array[j].value));
  r->C = array[0].value;
  r->R = array[1].value;
  r->Z = array[2].value;
  r->work = array[3].value;
  PetscCall(HycoSnapshotsFindPiece(t->store, key, HYCO_PIECE_ARRAYS, array, &found));
  if (found) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(BodyFactorsFactor(t, factor, k, r->theta, r));
  PetscCall(BodyFactorsRespond(b, factor, k, r));
  PetscCall(HycoSnapshotsKeepPiece(t->store, key, HYCO_PIECE_ARRAYS, array));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* *at: the record of body k at theta, condensed if there is none (*fresh). Collective. Records are found by the
   body's own theta: another value of a parameter that does not change it is no further sample. */
static PetscErrorCode CondenseBody(HycoReducer t, HycoBodiesFactor *factor, PetscInt k, const PetscReal theta[],
                                   PetscInt *at, PetscBool *fresh)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  HycoBodyFactor *body = &factor->body[k];
  PetscReal own[HYCO_MAX_PARAMETERS] = {0};
  HycoBodyRecord *record;

  PetscFunctionBegin;
  OwnTheta(b, k, theta, own);
  for (*at = 0; *at < body->n_records; (*at)++) {
    if (BodyFactorsIsSame(b->n_theta, own, body->record[*at].theta)) PetscFunctionReturn(PETSC_SUCCESS);
  }
  *fresh = PETSC_TRUE;
  /* The number of motions is known by the first assembly. */
  if (!factor->pins) PetscCall(AssembleAt(t, factor, own));
  /* record[] holds numbers, not addresses, since the array moves. */
  PetscCall(PetscRealloc((size_t)(body->n_records + 1) * sizeof(*record), &body->record));
  record = &body->record[body->n_records++];
  PetscCall(PetscMemzero(record, sizeof(*record)));
  HycoDuplicate(b->n_theta + 1, own, &record->theta);
  PetscCall(MakeRecord(t, factor, k, record));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every rank has the records with theta; the rest is on rank 0. */
PetscErrorCode HycoBodiesCondense(HycoReducer t, HycoBodiesFactor *factor, const PetscReal theta[], PetscInt record[])
{
  PetscBool fresh = PETSC_FALSE;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < factor->n; k++) PetscCall(CondenseBody(t, factor, k, theta, &record[k], &fresh));
  if (fresh) PetscCall(HycoReducerTell(t, "flexibilities of the bodies", ++factor->n_condensed, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- end -- */

/* Records and kept factors are lists of their own: flexibilities outlive the factors they came from. */
static PetscErrorCode ReleaseBody(HycoBodyFactor *body)
{
  PetscFunctionBegin;
  for (PetscInt i = 0; i < body->n_kept; i++) {
    PetscCall(HycoDirectDestroy(&body->kept[i].direct));
    PetscCall(PetscFree(body->kept[i].theta));
  }
  for (PetscInt i = 0; i < body->n_records; i++) {
    HycoBodyRecord *r = &body->record[i];

    HycoFreeAll(&r->theta, &r->C, &r->R, &r->Z, &r->work, &r->L);
  }
  HycoFreeAll(&body->kept, &body->record, &body->sample);
  PetscCall(PetscFree2(body->motion, body->pin));
  HycoDestroyAll(&body->global, &body->K, &body->N);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesReleaseFactor(HycoBodiesFactor *factor)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < factor->n; k++) PetscCall(ReleaseBody(&factor->body[k]));
  for (PetscInt k = 0; k < factor->n_basis; k++) PetscCall(VecDestroy(&factor->basis[k]));
  for (PetscInt k = 0; k < factor->n_strains; k++) PetscCall(VecDestroy(&factor->strain[k]));
  HycoFreeAll(&factor->body, &factor->owner, &factor->basis, &factor->strain, &factor->theta, &factor->between,
              &factor->pins, &factor->score, &factor->moved, &factor->known, &factor->bare, &factor->in_mesh,
              &factor->row);
  PetscCall(HycoFOMDestroy(&factor->fom));
  PetscFunctionReturn(PETSC_SUCCESS);
}
