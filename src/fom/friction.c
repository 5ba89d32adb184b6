/*
  Coulomb friction on a path, for small sliding. The contact system of a step has a normal row and dim - 1 tangents for
  each contact with friction,

    K U + B^T r = F,     w = D - B U,     (r_n, r_t) = P(r - rho w)     (HYCO_CONE_COULOMB),

  with D of a tangent the displacement of the slave against the master along it at the last accepted time: -w_t is the
  slip of the step. B is constant along a path, so that K is condensed onto it once. If no coefficient is above 0 at the
  time of a step, the path has the system without tangents, and takes the steps of a scene without friction.
*/
#include <hycofields.h>
#include <hycopath.h>
#include <hycoslip.h>
#include <hycosolverimpl.h>

/* Vectors of a path with an entry for each row of its B. */
#define N_PER_ROW (5 + HYCO_ANDERSON)

struct _n_HycoFriction {
  HycoSystem system; /* with tangents */
  HycoSolver solver;
  Mat B, Bt;
  Vec D, L, L_old, work; /* L: forces of the last step; L_old: of the last accepted one */
  Vec L_before, ahead;   /* of the accepted one before; a start of the next step */
  Vec other[N_PER_ROW];  /* the path's vectors for the system that it does not have now */
  PetscInt rows;         /* of this rank */
  HycoSlip slip;
  PetscInt n_dof;
  PetscReal *u_old; /* n_dof: of the surface at the last accepted time */
  PetscBool used;   /* the path has this system */
};

/* The addresses of the path's vectors with an entry for each row of B. */
static void PerRow(HycoPath p, Vec *at[N_PER_ROW])
{
  at[0] = &p->Lambda;
  at[1] = &p->L_old;
  at[2] = &p->gap_work;
  at[3] = &p->L_last;
  at[4] = &p->L_new;
  for (PetscInt j = 0; j < HYCO_ANDERSON; j++) at[5 + j] = &p->dL[j];
}

/* Copies the normal components; tangential ones become 0. */
static PetscErrorCode CopyNormal(HycoFOM f, Vec from, PetscBool with, Vec to)
{
  const HycoFriction r = f->friction;
  const PetscScalar *a;
  PetscScalar *b;

  PetscFunctionBegin;
  PetscCall(VecSet(to, 0));
  PetscCall(VecGetArrayRead(from, &a));
  PetscCall(VecGetArray(to, &b));
  /* with: `from` has the rows with tangents and `to` one per contact; else the reverse. slip.row[k]: the normal row
     of contact k. */
  for (PetscInt k = 0; k < f->pairs.n; k++) b[with ? k : r->slip.row[k]] = a[with ? r->slip.row[k] : k];
  PetscCall(VecRestoreArray(to, &b));
  PetscCall(VecRestoreArrayRead(from, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gives the path the system with or without tangents. Of the forces at hand it keeps the normal ones. */
static PetscErrorCode FOMFrictionUse(HycoFOM f, PetscBool use)
{
  HycoFriction r = f->friction;
  HycoPath p = f->path;
  Vec *at[N_PER_ROW];

  PetscFunctionBegin;
  PerRow(p, at);
  /* The path's vectors are exchanged for those of the other size. The first two are forces, which both systems have;
     the others are work space and the history of the acceleration. */
  for (PetscInt j = 0; j < N_PER_ROW && use != r->used; j++) {
    Vec before = *at[j];

    *at[j] = r->other[j];
    r->other[j] = before;
    if (j < 2) PetscCall(CopyNormal(f, before, r->used, *at[j]));
  }
  r->used = p->has_friction = use;
  p->system = use ? r->system : f->system;
  p->solver = use ? r->solver : f->solver;
  p->B = use ? r->B : f->B;
  p->Bt = use ? r->Bt : f->Bt;
  p->D = use ? r->D : f->D;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For the pairs of f, whose number of contacts stays along a path. The solver is one for blocks with cones; the
   user's options come after it, so that they may replace the type. Collective. */
PetscErrorCode HycoFrictionCreate(HycoFOM f)
{
  HycoFriction r;

  PetscFunctionBegin;
  PetscCheck(f->fe->dim > 1, HycoComm(f), PETSC_ERR_USER,
             "the mesh has 1 space dimension, in which nothing slides; remove the contacts' friction");
  PetscCall(PetscNew(&r));
  f->friction = r;
  PetscCall(HycoSlipCreate(HycoComm(f), f->scene, &f->pairs, f->fe->dim, &r->slip));
  /* A row for the normal and dim - 1 for the tangents of contacts with friction. */
  r->rows = r->slip.row[f->pairs.n];
  PetscCall(VecCreate(HycoComm(f), &r->L));
  PetscCall(VecSetSizes(r->L, r->rows, PETSC_DETERMINE));
  PetscCall(VecSetType(r->L, VECSTANDARD));
  HycoVecDuplicate(r->L, &r->D, &r->L_old, &r->L_before, &r->ahead, &r->work);
  for (PetscInt j = 0; j < N_PER_ROW; j++) PetscCall(VecDuplicate(r->L, &r->other[j]));
  PetscCall(HycoSystemCreate(HycoComm(f), &r->system));
  PetscCall(HycoSolverCreate(HycoComm(f), &r->solver));
  /* The cone of Coulomb is no set of bounds: neither active set nor TAO takes it. */
  PetscCall(HycoSolverSetType(r->solver, HYCO_SOLVER_SEMISMOOTH));
  PetscCall(HycoOptionsInherit((PetscObject)r->solver, (PetscObject)f));
  PetscCall(HycoSolverSetFromOptions(r->solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The path gets its own vectors back first: each is freed by its owner. NULL-safe. */
PetscErrorCode HycoFrictionDestroy(HycoFOM f)
{
  HycoFriction r = f->friction;

  PetscFunctionBegin;
  if (!r) PetscFunctionReturn(PETSC_SUCCESS);
  if (r->B) PetscCall(FOMFrictionUse(f, PETSC_FALSE)); /* the path frees its own vectors, f Lambda */
  f->pairs.shear = NULL;
  HycoDestroyAll(&r->solver, &r->system, &r->B, &r->Bt, &r->D, &r->L, &r->L_old, &r->L_before, &r->ahead, &r->work);
  for (PetscInt j = 0; j < N_PER_ROW; j++) PetscCall(VecDestroy(&r->other[j]));
  PetscCall(HycoSlipDestroy(&r->slip));
  HycoFreeAll(&r->u_old, &f->friction);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A new path: no forces and no slip yet; u_old = 0, so that the slip of the first step counts from the undeformed
   bodies. */
PetscErrorCode HycoFrictionBegin(HycoFOM f)
{
  HycoFriction r = f->friction;

  PetscFunctionBegin;
  /* The former path may have ended in a system with friction. */
  if (r->B) PetscCall(FOMFrictionUse(f, PETSC_FALSE));
  PetscCall(VecSet(r->L, 0));
  PetscCall(VecSet(r->L_old, 0));
  PetscCall(VecSet(f->path->Lambda, 0));
  PetscCall(PetscFree(r->u_old));
  r->n_dof = f->fe_surface->n_dof;
  PetscCall(PetscCalloc1(r->n_dof, &r->u_old));
  PetscCall(HycoSlipBegin(&r->slip));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Local: the coefficients may be invalid on one rank only, so that the caller wraps it in HycoOnEach(). */
static PetscErrorCode ComputeRows(HycoFOM f, HycoFriction r, HycoRows *rows)
{
  PetscFunctionBegin;
  PetscCall(HycoSlipCoefficients(&r->slip, f->fe_surface, &f->pairs));
  PetscCall(HycoContactTangentRows(f->fe_surface, &f->pairs, r->slip.row, r->u_old, r->slip.tangent, rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* B and its transpose anew. As many entries in a tangential row as in a normal one, hence the same room. */
static PetscErrorCode FillB(HycoFOM f, HycoFriction r, const HycoRows *rows)
{
  const PetscInt dim = f->fe->dim, entries = f->width * dim, *global = f->surface->node_global;
  PetscInt first, *column;

  PetscFunctionBegin;
  HycoDestroyAll(&r->B, &r->Bt);
  PetscCall(MatCreateAIJ(HycoComm(f), r->rows, f->part->n_owned * dim, PETSC_DETERMINE, f->n_nodes * dim, entries, NULL,
                         entries, NULL, &r->B));
  PetscCall(MatSetOption(r->B, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
  PetscCall(MatGetOwnershipRange(r->B, &first, NULL));
  PetscCall(PetscMalloc1(entries + 1, &column));
  for (PetscInt k = 0; k < r->rows; k++) {
    const PetscInt at = first + k, lo = rows->start[k], n = rows->start[k + 1] - lo;

    for (PetscInt j = 0; j < n; j++) {
      const PetscInt node = rows->dof[lo + j] / dim;

      /* From the unknowns of the surface's tables to those of the distributed vectors. */
      column[j] = (global ? global[node] : node) * dim + rows->dof[lo + j] % dim;
    }
    PetscCall(MatSetValues(r->B, 1, &at, n, column, rows->value + lo, INSERT_VALUES));
  }
  PetscCall(PetscFree(column));
  PetscCall(HycoMatAssemble(r->B));
  PetscCall(MatTranspose(r->B, MAT_INITIAL_MATRIX, &r->Bt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The order matters: rows need the coefficients, FOMFrictionUse() needs the matrices of the system to which it may
   change. */
static PetscErrorCode FOMFrictionAssemble(HycoFOM f, HycoFriction r, HycoRows *rows)
{
  PetscBool has_friction;

  PetscFunctionBegin;
  HycoOnEach(HycoComm(f), ComputeRows(f, r, rows));
  /* Gaps change with each step (u_old), B only with the nodes of the contacts. */
  if (!r->B || f->fe->contact_changed) PetscCall(FillB(f, r, rows));
  PetscCall(HycoVecWrite(r->D, r->rows, rows->gap));
  PetscCall(HycoSystemSetMatrices(r->system, f->K, r->Bt, r->B, PETSC_TRUE));
  PetscCall(HycoSystemSetVectors(r->system, f->F, r->D));
  HycoSystemSetSoft(r->system, &f->soft);
  PetscCall(HycoSystemSetBlocks(r->system, 2, r->slip.cone, f->pairs.n, r->slip.of, r->slip.data));
  /* Whether a coefficient is above 0 on some rank. */
  has_friction = HycoSlipHasFriction(&f->friction->slip);
  HycoAllreduce(&has_friction, 1, HYCO_MPI_BOOL, MPI_LOR, HycoComm(f));
  PetscCall(FOMFrictionUse(f, has_friction));
  f->pairs.shear = &r->slip.shear;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The other start of the step to the time that is assembled. */
static PetscErrorCode FOMFrictionExtrapolate(HycoFOM f)
{
  HycoFriction r = f->friction;
  const PetscScalar *L, *before;
  PetscScalar *ahead;
  PetscBool has;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(r->L_old, &L));
  PetscCall(VecGetArrayRead(r->L_before, &before));
  PetscCall(VecGetArray(r->ahead, &ahead));
  /* The time stands after the parameters, among the variables of expressions. */
  has = HycoSlipExtrapolate(&r->slip, f->fe->mu[f->scene->n_parameters], r->rows, L, before, ahead);
  PetscCall(VecRestoreArray(r->ahead, &ahead));
  PetscCall(VecRestoreArrayRead(r->L_before, &before));
  PetscCall(VecRestoreArrayRead(r->L_old, &L));
  PetscCall(HycoSolverSetOtherStart(r->solver, has ? r->ahead : NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At each step: tangents turn with the surfaces of its begin. */
PetscErrorCode HycoFrictionAssemble(HycoFOM f)
{
  HycoFriction r = f->friction;
  HycoRows rows = {0};

  PetscFunctionBegin;
  PetscCheck(r->n_dof == f->fe_surface->n_dof, PETSC_COMM_SELF, PETSC_ERR_PLIB, "the surfaces changed along a path");
  HycoFinally(FOMFrictionAssemble(f, r, &rows), PetscCall(HycoRowsDestroy(&rows)));
  PetscCall(FOMFrictionExtrapolate(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The forces of the step with all rows, and the normal ones as the model's. */
static PetscErrorCode TakeForces(HycoFOM f)
{
  HycoFriction r = f->friction;

  PetscFunctionBegin;
  if (r->used) {
    /* The path's Lambda is the vector with tangents now; f->Lambda has the normal components for outputs and files. */
    PetscCall(VecCopy(f->path->Lambda, r->L));
    PetscCall(CopyNormal(f, r->L, PETSC_TRUE, f->Lambda));
  } else
    PetscCall(CopyNormal(f, f->Lambda, PETSC_FALSE, r->L));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether on some rank a contact with a force has no friction, or nothing rubs at all. */
static PetscBool FOMFrictionSmooth(HycoFOM f)
{
  const HycoFriction r = f->friction;
  const PetscScalar *L;
  PetscBool smooth = (PetscBool)!r->used;

  PetscCallAbort(PETSC_COMM_SELF, VecGetArrayRead(r->L, &L));
  for (PetscInt k = 0; k < f->pairs.n && !smooth; k++)
    smooth = (PetscBool)(!(r->slip.mu[k] > 0) && L[r->slip.row[k]] > 0);
  PetscCallAbort(PETSC_COMM_SELF, VecRestoreArrayRead(r->L, &L));
  return smooth;
}

PetscErrorCode HycoFrictionMoves(HycoFOM f, PetscBool *moves)
{
  PetscInt p;
  const Vec *v;

  PetscFunctionBegin;
  *moves = PETSC_FALSE;
  PetscCall(HycoKernelVectors(f->K, &p, &v));
  if (!p) PetscFunctionReturn(PETSC_SUCCESS);
  *moves = FOMFrictionSmooth(f);
  HycoAllreduce(moves, 1, HYCO_MPI_BOOL, MPI_LOR, HycoComm(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Names the first motion that no contact force holds at the accepted time, and notes the time. Slips of later steps
   begin from there. */
static PetscErrorCode NameFreeMotion(HycoFOM f)
{
  HycoFriction r = f->friction;
  HycoPath path = f->path;
  HycoMotions motions;
  HycoBlocks *blocks;
  PetscReal *A, *L, *first;
  PetscInt p, n, loose = 0;
  const Vec *v;

  PetscFunctionBegin;
  PetscCall(HycoKernelVectors(f->K, &p, &v));
  if (!p) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoBlocksGather(HycoComm(f), r->system->blocks, &blocks));
  PetscCall(VecGetSize(r->L, &n));
  PetscCall(PetscMalloc3(p * n, &A, n, &L, p, &first));
  PetscCall(HycoMotionRows(r->B, p, v, r->work, A));
  PetscCall(HycoVecGather(r->L, L));
  PetscCall(HycoBlocksFreeMotions(blocks, p, A, L, &loose, first));
  if (loose && !path->loose[0]) {
    /* In the order of the null space, which is made from them. */
    PetscCall(HycoFEFreeMotions(HycoComm(f), f->fe, &motions));
    if (motions.n == p) HycoMotionsName(f->fe, &motions, first, path->loose);
    PetscCall(HycoMotionsDestroy(&motions));
    path->loose_at[0] = path->t;
  }
  if (loose) path->loose_at[1] = path->t;
  PetscCall(PetscFree3(A, L, first));
  PetscCall(HycoBlocksDestroy(&blocks));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where a body may move freely because a coefficient is 0, it stays: with the least slip. */
static PetscErrorCode FOMFrictionLeastSlip(HycoFOM f)
{
  HycoFriction r = f->friction;
  HycoBlocks *blocks;
  PetscReal *A, *w, *L, *move, *x, *first;
  PetscInt p, n, loose;
  PetscBool moves;
  const Vec *v;

  PetscFunctionBegin;
  PetscCall(HycoKernelVectors(f->K, &p, &v));
  PetscCall(HycoFrictionMoves(f, &moves));
  if (!moves) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoBlocksGather(HycoComm(f), r->system->blocks, &blocks));
  PetscCall(VecGetSize(r->L, &n));
  PetscCall(PetscMalloc6(p * n, &A, n, &w, n, &L, p, &move, p, &x, p, &first));
  PetscCall(HycoMotionRows(r->B, p, v, r->work, A));
  /* How far the step has moved along them. */
  PetscCall(VecWAXPY(f->path->work, -1, f->path->U_old, f->U));
  for (PetscInt i = 0; i < p; i++) PetscCall(VecDot(f->path->work, v[i], &move[i]));
  PetscCall(MatMult(r->B, f->U, r->work));
  PetscCall(VecAYPX(r->work, -1, r->D));
  PetscCall(HycoVecGather(r->work, w));
  PetscCall(HycoVecGather(r->L, L));
  PetscCall(HycoBlocksLeastSlip(blocks, p, A, w, L, move, x, &loose, first));
  if (loose) PetscCall(VecMAXPY(f->U, p, x, (Vec *)v));
  PetscCall(PetscFree6(A, w, L, move, x, first));
  PetscCall(HycoBlocksDestroy(&blocks));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The forces of the accepted step, and where the bodies are whose place it leaves open. Collective. */
PetscErrorCode HycoFrictionTake(HycoFOM f)
{
  PetscFunctionBegin;
  PetscCall(TakeForces(f));
  PetscCall(FOMFrictionLeastSlip(f));
  PetscCall(NameFreeMotion(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* (L0 + L1) / 2 . B (U1 - U0) with tangents, also where one of the two times has none. */
PetscErrorCode HycoFrictionWork(HycoFOM f, PetscReal *sum)
{
  HycoFriction r = f->friction;
  HycoPath p = f->path;
  PetscReal both[2];

  PetscFunctionBegin;
  PetscCall(VecWAXPY(p->work, -1, p->U_old, f->U));
  /* The trapezoidal rule over the step, exact where forces change linearly. */
  PetscCall(MatMult(r->B, p->work, r->work));
  PetscCall(VecDot(r->L, r->work, &both[0]));
  PetscCall(VecDot(r->L_old, r->work, &both[1]));
  *sum = (both[0] + both[1]) / 2;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On rank 0: the dense problem of the last step, from the forces before it (all rows). */
static PetscErrorCode WriteProblem(HycoFOM f, const HycoBlocks *blocks, Vec before)
{
  const PetscScalar *L;
  const PetscReal *z;
  PetscReal *start;
  HycoLCP lcp;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  HycoSolverGetDense(f->friction->solver, &lcp, &z);
  lcp.blocks = blocks;
  /* The unknowns of rigid motions, which come first, begin at 0, as in SolveForces() of the dual form. */
  PetscCall(PetscCalloc1(lcp.p + lcp.n + 1, &start));
  PetscCall(VecGetArrayRead(before, &L));
  PetscCall(PetscArraycpy(start + lcp.p, L, lcp.n));
  PetscCall(VecRestoreArrayRead(before, &L));
  ierr = HycoLCPWriteFclib(&lcp, f->fe->dim, z, start, f->path->fclib);
  PetscCall(PetscFree(start));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The problem of the accepted step as a file of FCLIB. Collective. */
static PetscErrorCode WriteFclib(HycoFOM f)
{
  HycoFriction r = f->friction;
  HycoBlocks *blocks;
  VecScatter to_root;
  Vec before;

  PetscFunctionBegin;
  PetscCheck(r->used, HycoComm(f), PETSC_ERR_USER,
             "-hyco_write_fclib: no coefficient of friction is above 0 at t = %g; name another time by "
             "-hyco_write_fclib_time",
             (double)f->path->t);
  PetscCall(HycoBlocksGather(HycoComm(f), r->system->blocks, &blocks));
  /* The forces before the step: L_old still has them, since it is taken over after the file. */
  PetscCall(VecScatterCreateToZero(r->L_old, &to_root, &before));
  PetscCall(VecScatterBegin(to_root, r->L_old, before, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(to_root, r->L_old, before, INSERT_VALUES, SCATTER_FORWARD));
  HycoOnRoot(HycoComm(f), WriteProblem(f, blocks, before));
  PetscCall(VecScatterDestroy(&to_root));
  PetscCall(VecDestroy(&before));
  PetscCall(HycoBlocksDestroy(&blocks));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After HycoFrictionTake(), which sets L. w = D - B U with the old D: its tangential part is minus the slip of the
   step. Afterwards u_old is the accepted surface. Collective. */
PetscErrorCode HycoFrictionAccept(HycoFOM f)
{
  HycoFriction r = f->friction;
  const PetscScalar *L, *w;
  PetscReal most;

  PetscFunctionBegin;
  PetscCall(VecNorm(f->U, NORM_INFINITY, &most));
  PetscCall(MatMult(r->B, f->U, r->work));
  PetscCall(VecAYPX(r->work, -1, r->D));
  PetscCall(VecGetArrayRead(r->L, &L));
  PetscCall(VecGetArrayRead(r->work, &w));
  HycoSlipAdd(&r->slip, L, w, most);
  PetscCall(VecRestoreArrayRead(r->work, &w));
  PetscCall(VecRestoreArrayRead(r->L, &L));
  if (f->path->fclib[0] && f->path->t == f->path->fclib_time) PetscCall(WriteFclib(f));
  PetscCall(VecCopy(r->L_old, r->L_before));
  PetscCall(VecCopy(r->L, r->L_old));
  HycoSlipTake(&r->slip, f->path->t);
  PetscCall(HycoFOMToSurface(f, f->U, r->u_old));
  HycoFEComplete(f->fe_surface, r->u_old);
  /* A negative sign of det J at the solution: the step has several solutions (force_uniqueness.c). */
  f->path->now.disproven += r->used && r->solver->sign < 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

Vec HycoFrictionBefore(HycoFriction r)
{
  return r->L_before;
}

const HycoSlip *HycoFrictionSlip(HycoFriction r)
{
  return &r->slip;
}

/* Sums over the contacts of all ranks: the work since the path began and the number of contacts that slip now.
   Collective. Both sums in one reduction. */
PetscErrorCode HycoFrictionMeasure(HycoFOM f, HycoStep *s)
{
  HycoFriction r = f->friction;
  PetscReal sum[2];

  PetscFunctionBegin;
  HycoSlipSum(&r->slip, sum);
  HycoAllreduce(sum, 2, MPIU_REAL, MPI_SUM, HycoComm(f));
  s->friction_work = sum[0];
  s->n_slipping = (PetscInt)sum[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The columns of a checkpoint: tangential force, slip, work and state of each contact. */
#define N_STATE 8
static PetscReal *FOMFrictionColumn(const HycoShear *s, PetscInt c, PetscInt *stride)
{
  *stride = c < 6 ? 3 : 1;
  return c < 3 ? s->force + c : c < 6 ? s->slip + (c - 3) : c < 7 ? s->work : s->state;
}

/* Each column in the order of one rank, so that a checkpoint resumes on any number of ranks. Collective. Slip and force
   at the begin of a step are the path's memory of friction. */
PetscErrorCode HycoFrictionSave(HycoFOM f, HycoH5 h)
{
  PetscReal *value;
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(f->pairs.n + 1, &value));
  for (PetscInt c = 0; c < N_STATE && !ierr; c++) {
    char name[32];
    PetscInt stride;
    /* Forces, slips, works and states of contacts in one list of columns. */
    const PetscReal *from = FOMFrictionColumn(&f->friction->slip.shear, c, &stride);

    for (PetscInt k = 0; k < f->pairs.n; k++) value[k] = from[k * stride];
    PetscCall(PetscSNPrintf(name, sizeof(name), "friction/%d", (int)c));
    ierr = HycoContactsWrite(HycoComm(f), h, name, &f->pairs, f->n_contacts, MPIU_REAL, value);
  }
  PetscCall(PetscFree(value));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0 alone. The file is closed also after an error; columns that were read stay for the caller to free. */
static PetscErrorCode ReadColumns(HycoFOM f, PetscReal *value[N_STATE])
{
  HycoH5 h;
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  PetscCall(HycoH5OpenOr(f->path->checkpoint, "remove -hyco_resume", &h));
  for (PetscInt c = 0; c < N_STATE && !ierr; c++) {
    PetscInt rows = f->n_contacts, one = 1;
    char name[32];

    PetscCall(PetscSNPrintf(name, sizeof(name), "friction/%d", (int)c));
    /* Sizes are given, so that a checkpoint with other contacts is refused. */
    ierr = HycoH5LoadReal(h, name, &rows, &one, &value[c]);
  }
  PetscCall(HycoH5Close(&h, PETSC_FALSE));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From the order of one rank on rank 0 to the contacts of each rank, by way of Lambda, which is restored. */
static PetscErrorCode TakeColumns(HycoFOM f, PetscReal *const value[N_STATE])
{
  const PetscScalar *mine;
  Vec lambda;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(f->Lambda, &lambda));
  PetscCall(VecCopy(f->Lambda, lambda));
  for (PetscInt c = 0; c < N_STATE; c++) {
    PetscInt stride;
    PetscReal *to = FOMFrictionColumn(&f->friction->slip.shear, c, &stride);

    /* Its scatter from rank 0 is the only one in the order of the contacts, hence the detour. */
    PetscCall(HycoFOMSetLambda(f, value[c]));
    PetscCall(VecGetArrayRead(f->Lambda, &mine));
    for (PetscInt k = 0; k < f->pairs.n; k++) to[k * stride] = mine[k];
    PetscCall(VecRestoreArrayRead(f->Lambda, &mine));
  }
  PetscCall(VecCopy(lambda, f->Lambda));
  PetscCall(VecDestroy(&lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The tangential components follow from the saved vectors of force and this run's tangents. Collective. */
PetscErrorCode HycoFrictionLoad(HycoFOM f)
{
  HycoFriction r = f->friction;
  PetscReal *value[N_STATE] = {NULL};
  const PetscScalar *normal;
  PetscScalar *L;

  PetscFunctionBegin;
  HycoOnRoot(HycoComm(f), ReadColumns(f, value));
  PetscCall(TakeColumns(f, value));
  for (PetscInt c = 0; c < N_STATE; c++) PetscCall(PetscFree(value[c]));
  PetscCall(VecGetArrayRead(f->Lambda, &normal));
  PetscCall(VecGetArray(r->L, &L));
  HycoSlipForces(&r->slip, normal, r->slip.shear.force, L);
  PetscCall(VecRestoreArray(r->L, &L));
  PetscCall(VecRestoreArrayRead(f->Lambda, &normal));
  PetscCall(VecCopy(r->L, r->L_old));
  if (r->used) PetscCall(VecCopy(r->L, f->path->Lambda));
  PetscCall(HycoFOMToSurface(f, f->U, r->u_old));
  HycoFEComplete(f->fe_surface, r->u_old);
  PetscFunctionReturn(PETSC_SUCCESS);
}
