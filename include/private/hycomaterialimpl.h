/* HycoMaterial's struct, and what the element loop asks of a law. */
#ifndef HYCOMATERIALIMPL_H
#define HYCOMATERIALIMPL_H

#include <hycomaterial.h>
#include <hycosceneimpl.h>

struct _p_HycoMaterial {
  PETSCHEADER(struct _HycoMaterialOps);
  /* what the type declares */
  HycoDeclared constants;
  PetscInt n_state;
  PetscBool linear;
  void *data;
};

/* Components of strain and stress in `dim` dimensions. */
static inline PetscInt HycoStrainSize(PetscInt dim)
{
  return dim == 1 ? 1 : dim == 2 ? 4 : 6;
}
/* Reals of a tangent: 2 where it is isotropic (Lame's lambda and mu), else the square of HycoStrainSize(). */
PetscInt HycoMaterialTangentSize(HycoMaterial material, PetscInt dim);
/* Whether the law is one that the library solves with, in this dimension. */
PetscErrorCode HycoMaterialSetUp(HycoMaterial material, PetscInt dim);
/* Whether the tangent changes where the parameters p with changed[p] do. */
PetscBool HycoMaterialChanges(HycoMaterial material, const PetscBool changed[]);
/* Tangents of a linear law at n points x (n x 3) and mu; work: room for n reals a constant. Fails where a constant
   leaves its interval, and where the law refuses a point or gives a tangent that is not symmetric and definite. */
PetscErrorCode HycoMaterialTangents(HycoMaterial material, PetscInt dim, const PetscReal mu[], PetscInt n,
                                    const PetscReal x[], PetscReal work[], PetscReal tangent[]);
/* stress = tangent . strain at a point. */
void HycoTangentApply(PetscBool isotropic, PetscInt dim, const PetscReal tangent[], const PetscReal strain[],
                      PetscReal stress[]);

PetscErrorCode HycoMaterialCreate_Elastic(HycoMaterial material);

#endif
