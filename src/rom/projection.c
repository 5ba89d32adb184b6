/*
  The projection-based model (44), online: modes for the displacements, nonnegative vectors for the contact forces, on
  the whole mesh (Balajewicz, Amsallem, Farhat, Int. J. Numer. Meth. Engng 106 (2016) 644-663; the paper's 6.3):

      V^T K V gamma + (V_lambda^T B V)^T Lambda_r = V^T F,   0 <= Lambda_r  complementary to  V_lambda^T (D - B V gamma)
  >= 0

  Its stiffness is the hybrid model's with every node in A and no full-order unknown; this file adds the forces. Only
  V_lambda^T of the gaps is held nonnegative: contacts may penetrate one by one.
*/
#include <hycoromimpl.h>

const char *const HycoROMTypes[] = {"hybrid", "projection", "condensed", NULL};
const char *const HycoDuals[] = {"fe", "nnmf", "snapshots", NULL};

PetscErrorCode HycoProjectionFillContact(HycoROM m)
{
  const PetscInt l = m->l, n = m->l_lambda;
  const HycoRows *rows = &m->own_rows;
  PetscReal *BV;
  PetscScalar *b, *bt;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(l, &BV));
  PetscCall(MatZeroEntries(m->Br));
  PetscCall(MatDenseGetArray(m->Br, &b));
  PetscCall(MatDenseGetArray(m->Btr, &bt));
  for (PetscInt c = 0; c < m->m; c++) {
    const PetscInt k = m->contact[c];

    PetscCall(PetscArrayzero(BV, l));
    for (PetscInt t = rows->start[c]; t < rows->start[c + 1]; t++) {
      for (PetscInt j = 0; j < l; j++) BV[j] += rows->value[t] * m->Vp[(size_t)rows->dof[t] * (size_t)l + (size_t)j];
    }
    for (PetscInt j = 0; j < l; j++) {
      for (PetscInt i = 0; i < n; i++) b[j * n + i] += m->V_lambda[(size_t)i * (size_t)m->pairs.n + (size_t)k] * BV[j];
    }
  }
  for (PetscInt j = 0; j < l; j++) {
    for (PetscInt i = 0; i < n; i++) bt[i * l + j] = b[j * n + i];
  }
  PetscCall(MatDenseRestoreArray(m->Btr, &bt));
  PetscCall(MatDenseRestoreArray(m->Br, &b));
  PetscCall(PetscFree(BV));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoProjectionFillGap(HycoROM m)
{
  PetscScalar *d;

  PetscFunctionBegin;
  PetscCall(VecGetArray(m->Dr, &d));
  for (PetscInt i = 0; i < m->l_lambda; i++) {
    const PetscReal *v = m->V_lambda + (size_t)i * (size_t)m->pairs.n;

    d[i] = 0;
    for (PetscInt c = 0; c < m->m; c++) d[i] += v[m->contact[c]] * m->own_rows.gap[c];
  }
  PetscCall(VecRestoreArray(m->Dr, &d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoProjectionExpand(HycoROM m)
{
  const PetscScalar *L;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(m->L, &L));
  for (PetscInt i = 0; i < m->l_lambda; i++) {
    const PetscReal *v = m->V_lambda + (size_t)i * (size_t)m->pairs.n;

    for (PetscInt c = 0; c < m->m; c++) m->Lambda[m->contact[c]] += L[i] * v[m->contact[c]];
  }
  PetscCall(VecRestoreArrayRead(m->L, &L));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoProjectionView(HycoROM m, PetscViewer viewer)
{
  PetscFunctionBegin;
  PetscCall(PetscViewerASCIIPrintf(viewer, "  on the whole mesh: %d elements, %d nodes, %d contacts\n",
                                   (int)m->whole_cells, (int)m->whole_nodes, (int)m->pairs.n));
  if (m->counts[1])
    PetscCall(PetscViewerASCIIPrintf(viewer, "  supremizers of the dual snapshots, which join the modes: %d\n",
                                     (int)m->counts[1]));
  PetscCall(PetscViewerASCIIPrintf(
      viewer, "  force vectors: %d (%s); energy of the training forces that they leave out: %.2e\n", (int)m->l_lambda,
      m->dual == HYCO_DUAL_NNMF ? "nonnegative factorisation of the dual snapshots" : "the dual snapshots",
      (double)m->dual_misfit));
  PetscFunctionReturn(PETSC_SUCCESS);
}
