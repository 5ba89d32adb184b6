/*
  A model without contact forces: no training solution had any, so that it has no force vector (44), or none of its
  contacts is in the RID. It is valid where no contact presses; where its displacement penetrates, it does not converge.
*/
#include <hycogalerkin.h>

/* Not asked if the caller wants displacements only (-hyco_reconstruct false). */
PetscErrorCode HycoGalerkinCheckContactBasis(HycoROM m)
{
  HycoPrediction *p = &m->prediction;
  PetscReal in = 0, size = 0;

  PetscFunctionBegin;
  if (m->n_L || p->reason <= 0 || (m->ops->reconstruct && !m->reconstruct)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoROMComplete(m));
  /* A model that has no contact in its RID converges with any penetration: only the whole displacement shows it. */
  for (PetscInt k = 0; k < m->model->pairs.n; k++) {
    const PetscReal bu = HycoROMAddRow(m, k, 0);

    in = PetscMax(in, bu - m->rows.gap[k]);
    size = PetscMax(size, PetscMax(PetscAbsReal(bu), PetscAbsReal(m->rows.gap[k])));
  }
  if (in <= m->solver->rtol * size) PetscFunctionReturn(PETSC_SUCCESS);
  p->kkt.penetration = in / size;
  p->reason = HYCO_DIVERGED_NO_CONTACT_BASIS;
  PetscFunctionReturn(PETSC_SUCCESS);
}
