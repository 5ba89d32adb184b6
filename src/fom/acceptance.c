/*
  Whether a solution of the contact system is one of the problem, and why not. Small-strain theory is linear: it has a
  solution for any load, however large the displacements. Beyond HYCO_MOST of the mesh's extent they are the result of a
  wrong unit, of a missing support, or of round-off where nothing but a small difference of forces holds a body.
*/
#include <hycopath.h>
#include <petscblaslapack.h>

/* A density in kg/m^3 where the stresses are in MPa is too large by 1e12, and strains under weight are about 1e-6. */
#define HYCO_MOST 1e6
/* Of the energies, from stresses, loads and contact forces: solutions have 1e-9 and less; more is an error of the model
   or an unconverged solve. */
#define HYCO_MOST_DEFECT 1e-3

/* The largest displacement relative to the mesh's longest side, or to the largest prescribed displacement if that is
   more. Collective. Moved positions, since a map may scale the mesh; components of all ranks in one reduction. */
static PetscErrorCode AcceptanceRelative(HycoFOM f, const PetscReal u[], PetscReal *relative)
{
  const PetscInt dim = f->fe->dim;
  PetscReal most[8], extent; /* of the coordinates, of their negatives, prescribed, found */

  PetscFunctionBegin;
  for (PetscInt c = 0; c < 6; c++) most[c] = PETSC_MIN_REAL;
  most[6] = most[7] = 0;
  for (PetscInt i = 0; i < f->part->n_nodes; i++) {
    for (PetscInt c = 0; c < dim; c++) {
      most[c] = PetscMax(most[c], f->fe->X[3 * i + c]);
      most[3 + c] = PetscMax(most[3 + c], -f->fe->X[3 * i + c]);
      most[6] = PetscMax(most[6], PetscAbsReal(f->fe->u0[i * dim + c]));
      most[7] = PetscMax(most[7], PetscAbsReal(u[i * dim + c]));
    }
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, most, 8, MPIU_REAL, MPI_MAX, HycoComm(f)));
  /* Both in lengths: a body that is pushed far is judged by how far it is pushed. */
  extent = most[6];
  for (PetscInt c = 0; c < dim; c++) extent = PetscMax(extent, most[c] + most[3 + c]);
  *relative = most[7] / extent;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The motion on which F - B^T L has work; "" if it has none. Collective. With the contact forces L as found: what is
   left of F on the motions that supports leave free (F - B^T L is orthogonal to them in equilibrium). */
static PetscErrorCode NameLifted(HycoFOM f, Mat Bt, Vec L, char name[HYCO_LINE])
{
  PetscReal *coefficient, work = 0;
  HycoMotions motions;
  Vec rest, *v;

  PetscFunctionBegin;
  name[0] = '\0';
  PetscCall(HycoFEFreeMotions(HycoComm(f), f->fe, &motions));
  PetscCall(HycoFOMMotionVectors(f, &motions, &v));
  PetscCall(VecDuplicate(f->F, &rest));
  PetscCall(VecCopy(f->F, rest));
  if (L) PetscCall(MatMult(Bt, L, rest));
  if (L) PetscCall(VecAYPX(rest, -1, f->F));
  PetscCall(PetscMalloc1(motions.n, &coefficient));
  PetscCall(VecMDot(rest, motions.n, v, coefficient));
  for (PetscInt k = 0; k < motions.n; k++) work = PetscMax(work, PetscAbsReal(coefficient[k]));
  if (work > 0) HycoMotionsName(f->fe, &motions, coefficient, name);
  PetscCall(PetscFree(coefficient));
  PetscCall(VecDestroy(&rest));
  PetscCall(VecDestroyVecs(motions.n, &v));
  PetscCall(HycoMotionsDestroy(&motions));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows with a force within round-off of the largest do not hold anything. */
PetscErrorCode HycoFOMMoveClosed(HycoFOM f, PetscInt p, const Vec v[], Vec w[], PetscReal *size)
{
  const PetscScalar *force;
  PetscReal most, square;
  PetscInt n;

  PetscFunctionBegin;
  *size = 0;
  PetscCall(VecNorm(f->Lambda, NORM_INFINITY, &most));
  PetscCall(VecGetLocalSize(f->Lambda, &n));
  PetscCall(VecGetArrayRead(f->Lambda, &force));
  for (PetscInt k = 0; k < p; k++) {
    PetscScalar *own;

    PetscCall(MatMult(f->B, v[k], w[k]));
    PetscCall(VecDot(w[k], w[k], &square));
    *size = PetscMax(*size, square);
    PetscCall(VecGetArray(w[k], &own));
    for (PetscInt i = 0; i < n; i++) own[i] = most > 0 && force[i] > 1e-12 * most ? own[i] : 0;
    PetscCall(VecRestoreArray(w[k], &own));
  }
  PetscCall(VecRestoreArrayRead(f->Lambda, &force));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* gram (p x p): of the rows of B with a force, times the motions v; *size as above. Motions that these rows resist are
   held by contact; the others could go on for ever. */
static PetscErrorCode HeldBy(HycoFOM f, PetscInt p, const Vec v[], PetscReal gram[], PetscReal *size)
{
  Vec *w;

  PetscFunctionBegin;
  PetscCall(VecDuplicateVecs(f->Lambda, p, &w));
  PetscCall(HycoFOMMoveClosed(f, p, v, w, size));
  for (PetscInt k = 0; k < p; k++) PetscCall(VecMDot(w[k], p, w, gram + k * p));
  PetscCall(VecDestroyVecs(p, &w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Names a rigid motion that the closed contacts with a force do not resist: the solution is one of several. name is
   "" if there is none. A Gram matrix of the size of the null space decides. Collective. */
PetscErrorCode HycoFOMNameFreeMotion(HycoFOM f, char name[HYCO_LINE])
{
  HycoMotions motions;
  PetscReal *gram, *value, *work, size;
  PetscBLASInt n, lwork, info;
  PetscInt p = 0;
  const Vec *v;

  PetscFunctionBegin;
  name[0] = '\0';
  if (f->n_contacts && f->K) PetscCall(HycoKernelVectors(f->K, &p, &v));
  if (!p) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscBLASIntCast(p, &n));
  lwork = 8 * n;
  PetscCall(PetscMalloc3(p * p, &gram, p, &value, 8 * p, &work));
  PetscCall(HeldBy(f, p, v, gram, &size));
  LAPACKsyev_("V", "U", &n, gram, &n, value, work, &lwork, &info);
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK syev: %d", (int)info);
  /* Squares: a share of 1e-7 of the motion. */
  if (value[0] <= 1e-14 * size) {
    PetscCall(HycoFEFreeMotions(HycoComm(f), f->fe, &motions));
    /* The same motions in the same order as the vectors of the null space: SetKernel() (rigid_modes.c) made these
       from them. */
    if (motions.n == p) HycoMotionsName(f->fe, &motions, gram, name);
    PetscCall(HycoMotionsDestroy(&motions));
  }
  PetscCall(PetscFree3(gram, value, work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Turns a converged reason into a divergence if displacements or the energy defect are too large, and writes why (one
   line; "" for an accepted solution). *relative: the largest displacement over the mesh's extent. Collective. A solver
   may converge to something that no linear theory allows, of a nearly singular K. */
PetscErrorCode HycoFOMJudge(HycoFOM f, const PetscReal u[], Vec L, PetscReal energy_defect, HycoReason *reason,
                            PetscReal *relative, char why[HYCO_LINE])
{
  char name[HYCO_LINE];

  PetscFunctionBegin;
  PetscCall(AcceptanceRelative(f, u, relative));
  /* Written so that NaN diverges. */
  if (*reason > 0 && !(*relative <= HYCO_MOST))
    *reason = HYCO_DIVERGED_DISPLACEMENT;
  else if (*reason > 0 && !(energy_defect <= HYCO_MOST_DEFECT))
    *reason = HYCO_DIVERGED_ENERGY;
  HycoFormat(why, "%s", *reason < 0 ? HycoReasonName(*reason) : "");
  if (*reason == HYCO_DIVERGED_FLOATING) /* on a path with friction L has the rows with tangents */
    PetscCall(NameLifted(f, f->path ? f->path->contact.Bt : f->Bt, L, name));
  if (*reason == HYCO_DIVERGED_FLOATING && name[0])
    HycoFormat(why, "%s; no support keeps %s",
               f->path && f->path->has_friction
                   ? "no equilibrium: no contact forces with this friction balance the load"
                   : HycoReasonName(*reason),
               name);
  /* Friction always has a factor: another solver is no advice. */
  if (*reason == HYCO_DIVERGED_HELD && f->path && f->path->has_friction)
    HycoFormat(why,
               "not converged: no equilibrium was found for a body that friction holds; it may slide at this load: "
               "reduce the load, raise the friction, or add a support or a spring");
  if (*reason == HYCO_DIVERGED_DISPLACEMENT)
    HycoFormat(why, "%s (%.1e times the mesh's extent)", HycoReasonName(*reason), (double)*relative);
  if (*reason == HYCO_DIVERGED_ENERGY)
    HycoFormat(why, "%s (identity to %.1e)", HycoReasonName(*reason), (double)energy_defect);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of the system just assembled, without a solve; with friction it is not decided. Collective. */
PetscErrorCode HycoFOMLiftOff(HycoFOM f, char why[HYCO_LINE])
{
  char name[HYCO_LINE];
  PetscBool lift_off = PETSC_FALSE;
  Vec L;

  PetscFunctionBegin;
  why[0] = '\0';
  if (!f->n_contacts || HycoSceneHasFriction(f->scene)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(f->Lambda, &L));
  PetscCall(HycoSystemLiftOff(f->system, L, &lift_off));
  if (lift_off) PetscCall(NameLifted(f, f->Bt, L, name));
  if (lift_off)
    HycoFormat(why, "%s%s%s", HycoReasonName(HYCO_DIVERGED_FLOATING), name[0] ? "; no support keeps " : "", name);
  PetscCall(VecDestroy(&L));
  PetscFunctionReturn(PETSC_SUCCESS);
}
