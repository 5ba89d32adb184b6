/*
  Displacements under given contact forces: K U = F - B^T Lambda, (16) without its inequalities, for models that predict
  only forces. The factor is that of K, without contacts, and is kept while K is
  unchanged.
*/
#include <hycoalgorithms.h>
#include <hycofomimpl.h>

/* Creates a solver without contacts; in the other one they are unknowns. The factor of the contact solver may be that
   of another form. Once for a model: predictions at several points share the factor if the stiffness does. */
static PetscErrorCode SetUp(HycoFOM f)
{
  PetscFunctionBegin;
  if (f->given_solver) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSystemCreate(HycoComm(f), &f->given_system));
  PetscCall(HycoSolverCreate(HycoComm(f), &f->given_solver));
  PetscCall(HycoOptionsInherit((PetscObject)f->given_solver, (PetscObject)f));
  PetscCall(HycoSolverSetFromOptions(f->given_solver));
  PetscCall(HycoSolverSetType(f->given_solver, HYCO_SOLVER_ACTIVE_SET)); /* without its contacts */
  PetscCall(HycoSolverSetForm(f->given_solver, HYCO_FORM_AUTO));
  PetscCall(VecDuplicate(f->F, &f->given_F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of the largest value of a Gram matrix: a motion's length to 1e-6, the accuracy of normals; less, and closed contacts
   do not determine it. */
#define ACTS    1e-12
#define REPEATS 2 /* the second removes the rounding of the first */

/* Adds the rigid motions that contact alone prevents, which K leaves open: so that the contacts with a force close, in
   the sense of least squares. */
static PetscErrorCode CloseContacts(HycoFOM f)
{
  const Vec *z;
  PetscReal *gram, *inverse, *right, *x, size;
  PetscInt p = 0;
  Vec *at, gap;

  PetscFunctionBegin;
  if (f->n_contacts) PetscCall(HycoKernelVectors(f->K, &p, &z));
  if (!p) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicateVecs(f->D, p, &at));
  PetscCall(VecDuplicate(f->D, &gap));
  PetscCall(PetscMalloc4(p * p, &gram, p * p, &inverse, p, &right, p, &x));
  PetscCall(HycoFOMMoveClosed(f, p, z, at, &size));
  for (PetscInt i = 0; i < p; i++) PetscCall(VecMDot(at[i], p, at, gram + i * p));
  PetscCall(HycoPseudoInverse(p, p, gram, ACTS, inverse));
  for (int r = 0; r < REPEATS; r++) {
    PetscCall(MatMult(f->B, f->U, gap));
    PetscCall(VecAYPX(gap, -1, f->D));
    PetscCall(VecMDot(gap, p, at, right));
    for (PetscInt i = 0; i < p; i++) {
      x[i] = 0;
      for (PetscInt j = 0; j < p; j++) x[i] += inverse[i * p + j] * right[j];
    }
    for (PetscInt i = 0; i < p; i++) PetscCall(VecAXPY(f->U, x[i], z[i]));
  }
  PetscCall(PetscFree4(gram, inverse, right, x));
  PetscCall(VecDestroyVecs(p, &at));
  PetscCall(VecDestroy(&gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* U under given forces (Lambda on rank 0, in the order of one rank). The KKT residuals are those of (16), thus they
   show what the forces violate. Collective. One linear solve in place of a contact problem: what
   -hyco_full_displacement costs. */
PetscErrorCode HycoFOMSolveForces(HycoFOM f, PetscInt n, const PetscReal mu[], const PetscReal Lambda[])
{
  HycoSeconds *t;
  PetscReal begin = HycoNow();

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  PetscCall(HycoSceneRefuseHistory(f->scene, "HycoFOMSolveForces()"));
  t = &f->summary.seconds;
  PetscCall(HycoSceneCheckParameters(f->scene, n, mu));
  PetscCall(SetUp(f));
  PetscCall(HycoFOMAssemble(f, mu));
  PetscCall(VecCopy(f->F, f->given_F));
  if (f->n_contacts) {
    PetscCall(HycoFOMSetLambda(f, Lambda));
    PetscCall(MatMult(f->Bt, f->Lambda, f->given_F));
    /* given_F = F - B^T L. */
    PetscCall(VecAYPX(f->given_F, -1, f->F));
  }
  t->assemble = HycoNow() - begin;
  /* K U = given_F. Without contacts the system is linear: one factorisation as long as K is unchanged. */
  PetscCall(HycoSystemSetMatrices(f->given_system, f->K, NULL, NULL, PETSC_TRUE));
  PetscCall(HycoSystemSetVectors(f->given_system, f->given_F, NULL));
  PetscCall(HycoSolverSetSystem(f->given_solver, f->given_system));
  HycoLogged(HYCO_EVENT_SOLVE, HycoSolverSolve(f->given_solver, f->U, NULL));
  PetscCall(CloseContacts(f));
  PetscCall(HycoSolverGetSeconds(f->given_solver, &t->factor, &t->solve));
  HycoLogged(HYCO_EVENT_KKT, HycoSystemComputeKKT(f->system, f->U, f->Lambda, &f->given_kkt));
  PetscCall(HycoFOMGather(f));
  t->total = HycoNow() - begin;
  f->solved = f->given = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}
