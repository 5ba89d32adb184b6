/*
  The norms of the paper's section 3 on the whole mesh: |u|_H1^2 = u^T H u with H the mass plus the gradient's matrix
  (times the mesh's length squared, so that units do not matter), and the norm of a force in the dual of H1 (test
  functions that vanish on the supports), sup r.v / |v|_H1 = sqrt(r^T M^-1 r) with M the part of H on the free unknowns.
  On a mesh that the parameters move, both are those of the middle of the ranges, so that one factor serves every point.
*/
#include <hycolinear.h>
#include <hycoromimpl.h>

struct _n_HycoNorms {
  PetscInt dim;
  HycoFE fe;
  Mat H, M;
  Vec x, y;
  KSP ksp;
};

static PetscErrorCode AssembleNorm(HycoFE fe, Mat *A)
{
  PetscFunctionBegin;
  PetscCall(HycoFECreateMatrix(fe, PETSC_COMM_SELF, fe->mesh->n_nodes, 0, A));
  PetscCall(HycoFEAssembleH1(fe, HycoMeshLength(fe->mesh), *A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoNormsCreate(HycoScene scene, HycoMesh whole, HycoNorms *norms)
{
  HycoNorms h;
  PetscReal mu[HYCO_MAX_PARAMETERS];
  PetscBool singular;

  PetscFunctionBegin;
  PetscCall(PetscNew(&h));
  *norms = h;
  h->dim = whole->dim;
  for (PetscInt p = 0; p < scene->n_parameters; p++) mu[p] = (scene->lo[p] + scene->hi[p]) / 2;
  PetscCall(HycoFECreate(scene, whole, &h->fe));
  PetscCall(HycoFESetParameters(h->fe, mu));
  PetscCall(AssembleNorm(h->fe, &h->M));
  PetscCall(PetscArrayzero(h->fe->fixed, h->fe->n_dof)); /* prescribed displacements count in the norm */
  PetscCall(AssembleNorm(h->fe, &h->H));
  PetscCall(MatSetOption(h->M, MAT_SPD, PETSC_TRUE));
  PetscCall(MatCreateVecs(h->M, &h->x, &h->y));
  PetscCall(HycoDirectSolver(PETSC_COMM_SELF, "hyco_norm_", h->M, PETSC_TRUE, &h->ksp));
  PetscCall(HycoFactor(h->ksp, &singular));
  PetscCheck(!singular, PETSC_COMM_SELF, PETSC_ERR_PLIB, "the H1 norm's matrix is singular");
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoNormsDestroy(HycoNorms *norms)
{
  HycoNorms h = *norms;

  PetscFunctionBegin;
  if (!h) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPDestroy(&h->ksp));
  PetscCall(MatDestroy(&h->H));
  PetscCall(MatDestroy(&h->M));
  PetscCall(VecDestroy(&h->x));
  PetscCall(VecDestroy(&h->y));
  PetscCall(HycoFEDestroy(&h->fe));
  PetscCall(PetscFree(*norms));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoNormH1(HycoNorms h, const PetscReal u[], const PetscReal minus[], PetscReal *norm)
{
  PetscScalar *x, square;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(VecGetSize(h->x, &n));
  PetscCall(VecGetArray(h->x, &x));
  for (PetscInt i = 0; i < n; i++) x[i] = minus ? u[i] - minus[i] : u[i];
  PetscCall(VecRestoreArray(h->x, &x));
  PetscCall(MatMult(h->H, h->x, h->y));
  PetscCall(VecDot(h->x, h->y, &square));
  *norm = PetscSqrtReal(PetscMax(square, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoNormDual(HycoNorms h, HycoROM m, PetscBool rid_only, const PetscReal L[], const PetscReal minus[],
                            PetscReal *norm)
{
  PetscScalar *r, square;
  PetscBool any = PETSC_FALSE;

  PetscFunctionBegin;
  *norm = 0;
  PetscCall(HycoROMComplete(m));
  PetscCall(VecSet(h->x, 0));
  PetscCall(VecGetArray(h->x, &r));
  for (PetscInt k = 0; k < m->pairs.n; k++) {
    const PetscReal force = minus ? L[k] - minus[k] : L[k];

    if (force == 0 || (rid_only && !m->in_rid[k])) continue;
    any = PETSC_TRUE;
    for (PetscInt j = m->rows.start[k]; j < m->rows.start[k + 1]; j++) {
      const PetscInt dof = m->rows.dof[j];

      r[m->mesh->node_whole[dof / h->dim] * h->dim + dof % h->dim] += m->rows.value[j] * force;
    }
  }
  PetscCall(VecRestoreArray(h->x, &r));
  if (!any) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPSolve(h->ksp, h->x, h->y));
  PetscCall(VecDot(h->x, h->y, &square));
  *norm = PetscSqrtReal(PetscMax(square, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
