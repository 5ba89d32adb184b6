/*
  Friction of a path, at full order and in a model. The contact system of a step has a normal row and dim - 1 tangents
  for each contact with friction,

    K U + B^T r = F,     w = D - B U,     (r_n, r_t) = P(r - rho w)     (HYCO_CONE_COULOMB),

  with D of a tangent the displacement of the slave against the master along it at the last accepted time
  (HycoContactStateRows()): -w_t is the slip of the step. A type of path whose B has these rows, and that sets
  path->friction and ops->surfaces, has friction.
*/
#include <hycofields.h>
#include <hycopath.h>
#include <hycosolverimpl.h>

/* The cone of Coulomb is no set of bounds: neither active set nor TAO takes it. */
PetscErrorCode HycoPathSetContacts(HycoPath p, HycoPairs *pairs, PetscInt *rows)
{
  PetscFunctionBegin;
  p->pairs = pairs;
  if (rows) *rows = HycoContactStateCountRows(p->scene, pairs, p->fe->dim);
  if (!HycoSceneHasFriction(p->scene)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoContactStateCreate(p->comm, p->scene, pairs, p->fe->dim, &p->friction));
  PetscCall(HycoSolverSetType(p->contact.solver, HYCO_SOLVER_SEMISMOOTH));
  PetscCall(HycoSolverSetFromOptions(p->contact.solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPathRows(HycoPath p, HycoFE fe, HycoRows *rows)
{
  PetscFunctionBegin;
  PetscCall(p->friction ? HycoContactStateRows(p->friction, fe, rows) : HycoContactRows(fe, p->pairs, rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoPathContact *HycoPathContactGet(HycoPath p, PetscBool tangents)
{
  return p->has_friction == tangents || !p->other.system ? &p->contact : &p->other;
}

/* Copies the normal components; tangential ones become 0. */
static PetscErrorCode CopyNormal(HycoContactState s, Vec from, PetscBool tangents, Vec to)
{
  const PetscScalar *a;
  PetscScalar *b;

  PetscFunctionBegin;
  PetscCall(VecSet(to, 0));
  PetscCall(VecGetArrayRead(from, &a));
  PetscCall(VecGetArray(to, &b));
  /* tangents: those of `from`, and `to` has one row a contact; else the reverse. */
  for (PetscInt k = 0; k < s->n; k++) b[tangents ? k : s->row[k]] = a[tangents ? s->row[k] : k];
  PetscCall(VecRestoreArray(to, &b));
  PetscCall(VecRestoreArrayRead(from, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gives the path the system with or without tangents, with the normal ones of the forces at hand. */
static PetscErrorCode PathFrictionUse(HycoPath p, PetscBool use)
{
  const HycoPathContact before = p->contact;

  PetscFunctionBegin;
  if (use == p->has_friction || !p->other.system) PetscFunctionReturn(PETSC_SUCCESS);
  p->contact = p->other;
  p->other = before;
  PetscCall(CopyNormal(p->friction, before.Lambda, p->has_friction, p->contact.Lambda));
  PetscCall(CopyNormal(p->friction, before.L_old, p->has_friction, p->contact.L_old));
  p->has_friction = use;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The former path may have ended in a system with friction. */
PetscErrorCode HycoPathFrictionBegin(HycoPath p)
{
  PetscFunctionBegin;
  if (!p->friction) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoContactStateBegin(p->friction));
  if (!p->other.system) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PathFrictionUse(p, PETSC_FALSE));
  PetscCall(VecSet(p->contact.Lambda, 0));
  PetscCall(VecSet(p->other.Lambda, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The owner has its own Lambda and D back; the others are the path's. */
PetscErrorCode HycoPathFrictionDestroy(HycoPath p)
{
  HycoPathContact *c = &p->other;

  PetscFunctionBegin;
  if (c->system) PetscCall(PathFrictionUse(p, PETSC_FALSE));
  if (c->system) HycoDestroyAll(&c->solver, &c->system, &c->B, &c->Bt, &c->D, &c->Lambda);
  PetscCall(HycoPathContactReset(c));
  PetscCall(HycoContactStateDestroy(&p->friction));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where no coefficient is above 0 the path takes the steps of a scene without friction. */
PetscErrorCode HycoPathFrictionSetStep(HycoPath p, PetscReal t)
{
  PetscBool use = PETSC_TRUE;
  HycoPathContact *c;

  PetscFunctionBegin;
  if (!p->friction || !p->n_contacts) PetscFunctionReturn(PETSC_SUCCESS);
  if (p->other.system) PetscCall(HycoContactStateHasFriction(p->friction, &use));
  PetscCall(PathFrictionUse(p, use));
  p->has_friction = use;
  c = HycoPathContactGet(p, PETSC_TRUE);
  PetscCall(HycoContactStateSetStep(p->friction, t, c->system, c->solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether on some rank a contact with a force has no friction, or nothing rubs at all. */
static PetscErrorCode PathFrictionSmooth(HycoPath p, PetscBool *smooth)
{
  const HycoContactState s = p->friction;
  const PetscScalar *L;
  Vec all = HycoPathContactGet(p, PETSC_TRUE)->Lambda;

  PetscFunctionBegin;
  *smooth = (PetscBool)!p->has_friction;
  PetscCall(VecGetArrayRead(all, &L));
  for (PetscInt k = 0; k < s->n && !*smooth; k++) *smooth = (PetscBool)(!(s->mu[k] > 0) && L[s->row[k]] > 0);
  PetscCall(VecRestoreArrayRead(all, &L));
  HycoAllreduce(smooth, 1, HYCO_MPI_BOOL, MPI_LOR, p->comm);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPathFrictionMoves(HycoPath p, PetscBool *moves)
{
  PetscInt n;
  const Vec *v;

  PetscFunctionBegin;
  *moves = PETSC_FALSE;
  PetscCall(HycoKernelVectors(p->K, &n, &v));
  if (n) PetscCall(PathFrictionSmooth(p, moves));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Names the first motion that no contact force holds at the accepted time, and notes the time. Slips of later steps
   begin from there. */
static PetscErrorCode NameFreeMotion(HycoPath path)
{
  HycoPathContact *c = HycoPathContactGet(path, PETSC_TRUE);
  HycoMotions motions;
  HycoBlocks *blocks;
  PetscReal *A, *L, *first;
  PetscInt p, n, loose = 0;
  const Vec *v;

  PetscFunctionBegin;
  PetscCall(HycoKernelVectors(path->K, &p, &v));
  if (!p) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoBlocksGather(path->comm, c->system->blocks, &blocks));
  PetscCall(VecGetSize(c->Lambda, &n));
  PetscCall(PetscMalloc3(p * n, &A, n, &L, p, &first));
  PetscCall(HycoMotionRows(c->B, p, v, c->gap_work, A));
  PetscCall(HycoVecGather(c->Lambda, L));
  PetscCall(HycoBlocksFreeMotions(blocks, p, A, L, &loose, first));
  if (loose && !path->loose[0]) {
    /* In the order of the null space, which is made from them. */
    PetscCall(HycoFEFreeMotions(path->comm, path->fe, &motions));
    if (motions.n == p) HycoMotionsName(path->fe, &motions, first, path->loose);
    PetscCall(HycoMotionsDestroy(&motions));
    path->loose_at[0] = path->t;
  }
  if (loose) path->loose_at[1] = path->t;
  PetscCall(PetscFree3(A, L, first));
  PetscCall(HycoBlocksDestroy(&blocks));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where a body may move freely because a coefficient is 0, it stays: with the least slip. */
static PetscErrorCode PathFrictionLeastSlip(HycoPath path)
{
  HycoPathContact *c = HycoPathContactGet(path, PETSC_TRUE);
  HycoBlocks *blocks;
  PetscReal *A, *w, *L, *move, *x, *first;
  PetscInt p, n, loose;
  PetscBool moves;
  const Vec *v;

  PetscFunctionBegin;
  PetscCall(HycoKernelVectors(path->K, &p, &v));
  PetscCall(HycoPathFrictionMoves(path, &moves));
  if (!moves) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoBlocksGather(path->comm, c->system->blocks, &blocks));
  PetscCall(VecGetSize(c->Lambda, &n));
  PetscCall(PetscMalloc6(p * n, &A, n, &w, n, &L, p, &move, p, &x, p, &first));
  PetscCall(HycoMotionRows(c->B, p, v, c->gap_work, A));
  /* How far the step has moved along them. */
  PetscCall(VecWAXPY(path->work, -1, path->U_old, path->U));
  for (PetscInt i = 0; i < p; i++) PetscCall(VecDot(path->work, v[i], &move[i]));
  PetscCall(MatMult(c->B, path->U, c->gap_work));
  PetscCall(VecAYPX(c->gap_work, -1, c->D));
  PetscCall(HycoVecGather(c->gap_work, w));
  PetscCall(HycoVecGather(c->Lambda, L));
  PetscCall(HycoBlocksLeastSlip(blocks, p, A, w, L, move, x, &loose, first));
  if (loose) PetscCall(VecMAXPY(path->U, p, x, (Vec *)v));
  PetscCall(PetscFree6(A, w, L, move, x, first));
  PetscCall(HycoBlocksDestroy(&blocks));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPathFrictionTake(HycoPath p)
{
  PetscFunctionBegin;
  if (!p->friction || !p->n_contacts) PetscFunctionReturn(PETSC_SUCCESS);
  if (p->other.system) PetscCall(CopyNormal(p->friction, p->contact.Lambda, p->has_friction, p->other.Lambda));
  PetscCall(PathFrictionLeastSlip(p));
  PetscCall(NameFreeMotion(p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* (L0 + L1) / 2 . B (U1 - U0) with tangents, also where one of the two times has none. */
PetscErrorCode HycoPathFrictionWork(HycoPath p, PetscReal *sum)
{
  HycoPathContact *c = HycoPathContactGet(p, PETSC_TRUE);
  PetscReal both[2];

  PetscFunctionBegin;
  PetscCall(VecWAXPY(p->work, -1, p->U_old, p->U));
  /* The trapezoidal rule over the step, exact where forces change linearly. */
  PetscCall(MatMult(c->B, p->work, c->gap_work));
  PetscCall(VecDot(c->Lambda, c->gap_work, &both[0]));
  PetscCall(VecDot(p->friction->L, c->gap_work, &both[1]));
  *sum = (both[0] + both[1]) / 2;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On rank 0: the dense problem of the last step, from the forces before it (all rows). */
static PetscErrorCode WriteProblem(HycoPath p, const HycoBlocks *blocks, Vec before)
{
  const PetscScalar *L;
  const PetscReal *z;
  PetscReal *start;
  HycoLCP lcp;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  HycoSolverGetDense(p->contact.solver, &lcp, &z);
  lcp.blocks = blocks;
  /* The unknowns of rigid motions, which come first, begin at 0, as in SolveForces() of the dual form. */
  PetscCall(PetscCalloc1(lcp.p + lcp.n + 1, &start));
  PetscCall(VecGetArrayRead(before, &L));
  PetscCall(PetscArraycpy(start + lcp.p, L, lcp.n));
  PetscCall(VecRestoreArrayRead(before, &L));
  ierr = HycoLCPWriteFclib(&lcp, p->fe->dim, z, start, p->fclib);
  PetscCall(PetscFree(start));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The problem of the accepted step as a file of FCLIB. Collective. */
static PetscErrorCode WriteFclib(HycoPath p)
{
  HycoBlocks *blocks;
  VecScatter to_root;
  Vec before;

  PetscFunctionBegin;
  PetscCheck(p->has_friction, p->comm, PETSC_ERR_USER,
             "-hyco_write_fclib: no coefficient of friction is above 0 at t = %g; name another time by "
             "-hyco_write_fclib_time",
             (double)p->t);
  PetscCall(HycoBlocksGather(p->comm, p->contact.system->blocks, &blocks));
  PetscCall(VecScatterCreateToZero(p->friction->L, &to_root, &before));
  PetscCall(VecScatterBegin(to_root, p->friction->L, before, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(to_root, p->friction->L, before, INSERT_VALUES, SCATTER_FORWARD));
  HycoOnRoot(p->comm, WriteProblem(p, blocks, before));
  PetscCall(VecScatterDestroy(&to_root));
  PetscCall(VecDestroy(&before));
  PetscCall(HycoBlocksDestroy(&blocks));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* w = D - B U with the D of the step: its tangential part is minus the slip. */
PetscErrorCode HycoPathFrictionAccept(HycoPath p)
{
  HycoPathContact *c = HycoPathContactGet(p, PETSC_TRUE);
  const PetscScalar *L, *w;
  PetscReal most, *u;

  PetscFunctionBegin;
  if (!p->friction || !p->n_contacts) PetscFunctionReturn(PETSC_SUCCESS);
  /* Before the state of the forces before the step is lost. */
  if (p->fclib[0] && p->t == p->fclib_time) PetscCall(WriteFclib(p));
  PetscCall(PetscMalloc1(p->friction->n_dof + 1, &u));
  PetscCall((*p->ops->surfaces)(p, u, &most));
  PetscCall(MatMult(c->B, p->U, c->gap_work));
  PetscCall(VecAYPX(c->gap_work, -1, c->D));
  PetscCall(VecGetArrayRead(c->Lambda, &L));
  PetscCall(VecGetArrayRead(c->gap_work, &w));
  PetscCall(HycoContactStateAccept(p->friction, p->t, L, w, most, u));
  PetscCall(VecRestoreArrayRead(c->gap_work, &w));
  PetscCall(VecRestoreArrayRead(c->Lambda, &L));
  PetscCall(PetscFree(u));
  /* A negative sign of det J at the solution: the step has several solutions (force_uniqueness.c). */
  p->now.disproven += p->has_friction && p->contact.solver->sign < 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}
