/* Matrices of thin bodies (ropes, strips): reverse Cuthill-McKee order leaves little fill, so that a plain factor is
   fastest. */
#include <hycolinear.h>

/* More entries in a row than a strip of quadrilaterals has: no order is computed. */
#define HYCO_THIN_ROW 20
/* Largest mean row length of an envelope for which PETSc's own factor is faster than a multifrontal one. */
#define HYCO_THIN_ENVELOPE 32

/* Entries between the first nonzero of each row and its diagonal, in the order of `order`. The envelope bounds the
   fill of a factor in this order. */
static PetscErrorCode BandedEnvelope(Mat K, IS order, PetscReal *sum)
{
  PetscInt n;
  const PetscInt *ia, *ja, *old, *new_of;
  PetscBool done;
  IS inverse;

  PetscFunctionBegin;
  *sum = 0;
  PetscCall(ISInvertPermutation(order, PETSC_DECIDE, &inverse));
  PetscCall(ISGetIndices(order, &old));
  PetscCall(ISGetIndices(inverse, &new_of));
  PetscCall(MatGetRowIJ(K, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
  PetscCheck(done, PETSC_COMM_SELF, PETSC_ERR_SUP, "the matrix gives no access to its rows");
  for (PetscInt i = 0; i < n; i++) {
    PetscInt first = i;

    for (PetscInt k = ia[old[i]]; k < ia[old[i] + 1]; k++) first = PetscMin(first, new_of[ja[k]]);
    /* A Cholesky factor fills a row from its first entry on, and nothing before it. */
    *sum += i - first;
  }
  PetscCall(MatRestoreRowIJ(K, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
  PetscCall(ISRestoreIndices(order, &old));
  PetscCall(ISRestoreIndices(inverse, &new_of));
  PetscCall(ISDestroy(&inverse));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On several ranks, without an order: whether there are at most two neighbours on average, as in a mesh of lines.
   Several ranks have no common order to judge by. */
static PetscErrorCode IsLine(Mat K, PetscBool *line)
{
  PetscInt n;
  MatInfo info;

  PetscFunctionBegin;
  PetscCall(MatGetSize(K, &n, NULL));
  PetscCall(MatGetInfo(K, MAT_GLOBAL_SUM, &info));
  *line = (PetscBool)(info.nz_used <= 3 * (PetscReal)n);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reverse Cuthill-McKee with PETSc's own Cholesky factor; pc has the type of Cholesky. */
PetscErrorCode HycoBandedSolver(PC pc)
{
  MPI_Comm comm = PetscObjectComm((PetscObject)pc);
  KSP each;

  PetscFunctionBegin;
  if (HycoSize(comm) > 1) { /* every rank factors all of it, which takes less time than communication */
    PetscCall(PCSetType(pc, PCREDUNDANT));
    PetscCall(PCRedundantSetNumber(pc, HycoSize(comm)));
    PetscCall(PCRedundantGetKSP(pc, &each));
    PetscCall(KSPSetType(each, KSPPREONLY));
    PetscCall(KSPGetPC(each, &pc));
    PetscCall(PCSetType(pc, PCCHOLESKY));
  }
  PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERPETSC));
  PetscCall(PCFactorSetMatOrderingType(pc, MATORDERINGRCM));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a factor in reverse Cuthill-McKee order is small. Collective. */
PetscErrorCode HycoBanded(Mat K, PetscBool *thin)
{
  PetscInt n;
  MatInfo info;
  PetscBool aij;
  PetscReal sum;
  IS row, col;

  PetscFunctionBegin;
  *thin = PETSC_FALSE;
  PetscCall(PetscObjectTypeCompare((PetscObject)K, MATSEQAIJ, &aij));
  if (!aij) {
    PetscCall(PetscObjectTypeCompare((PetscObject)K, MATMPIAIJ, &aij));
    if (aij) PetscCall(IsLine(K, thin));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatGetSize(K, &n, NULL));
  PetscCall(MatGetInfo(K, MAT_LOCAL, &info));
  /* Long rows: no order makes the envelope small. */
  if (info.nz_used > HYCO_THIN_ROW * (PetscReal)n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetOrdering(K, MATORDERINGRCM, &row, &col));
  PetscCall(BandedEnvelope(K, row, &sum));
  HycoDestroyAll(&row, &col);
  *thin = (PetscBool)(sum <= HYCO_THIN_ENVELOPE * (PetscReal)n);
  PetscFunctionReturn(PETSC_SUCCESS);
}
