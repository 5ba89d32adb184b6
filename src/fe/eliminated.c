/* Eliminated displacements, those of tied nodes and along oblique supports: u = T u, and forces T^T f. */
#include <hycokinematics.h>

/* f <- T^T f: ties first, because a master may have an oblique support. The eliminated components keep their forces. */
void HycoFEGeneralise(HycoFE fe, PetscReal f[])
{
  HycoTiedGeneralise(fe, f);
  for (PetscInt k = 0; k < fe->n_oblique; k++) {
    const HycoOblique *o = &fe->oblique[k];

    for (PetscInt d = 0; d < fe->dim; d++) f[o->node * fe->dim + d] += o->a[d] * f[o->node * fe->dim + o->c];
  }
}

/* The displacements of eliminated components: offset + a.u, then ties, whose masters must be complete. Ties last:
   masters of tied nodes may have oblique supports. */
void HycoFEComplete(HycoFE fe, PetscReal u[])
{
  for (PetscInt k = 0; k < fe->n_oblique; k++) {
    const HycoOblique *o = &fe->oblique[k];
    PetscReal sum = fe->u0[o->node * fe->dim + o->c];

    for (PetscInt d = 0; d < fe->dim; d++) sum += o->a[d] != 0 ? o->a[d] * u[o->node * fe->dim + d] : 0;
    u[o->node * fe->dim + o->c] = sum;
  }
  HycoTiedComplete(fe, u);
}
