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
  char **state_name; /* n_state, or NULL */
  PetscBool linear, heat;
  HycoFormulation formulation; /* of the scene; in 1D and 3D HYCO_PLANE_STRAIN */
  const char *folder;          /* where the scene's relative paths start; borrowed */
  HycoExpr temperature;        /* of the body, which owns it; NULL: it has none */
  void *data;
};

/* Components of strain and stress in `dim` dimensions. */
static inline PetscInt HycoStrainSize(PetscInt dim)
{
  return dim == 1 ? 1 : dim == 2 ? 4 : 6;
}
/* Von Mises' equivalent of a stress (xx, yy, zz, xy, yz, xz as far as HycoStrainSize(); 1D: its size). */
PetscReal HycoMises(PetscInt dim, const PetscReal stress[]);
/* Reals of a tangent: 2 where it is isotropic (Lame's lambda and mu) and a 2D scene is one of plane strain, else the
   square of HycoStrainSize(). */
PetscInt HycoMaterialTangentSize(HycoMaterial material, PetscInt dim);
/* Whether the law is one that the library solves with, in this dimension and formulation, and with a history of the
   scene or without. */
PetscErrorCode HycoMaterialSetUp(HycoMaterial material, PetscInt dim, HycoFormulation formulation,
                                 PetscBool has_history);
/* Whether the tangent changes where the parameters p with changed[p] do. */
PetscBool HycoMaterialChanges(HycoMaterial material, const PetscBool changed[]);
/* The constants at n points x (n x 3), their temperatures (NULL: none) and mu; work: room for n reals a constant. Fails
   where a constant leaves its interval. */
PetscErrorCode HycoMaterialConstants(HycoMaterial material, const PetscReal mu[], PetscInt n, const PetscReal x[],
                                     const PetscReal temperature[], PetscReal work[], const PetscReal *constant[]);
/* Elastic tangents there: of a linear law the tangents, of another those at rest. Fails also where the law refuses a
   point or gives a tangent that is not symmetric and definite. */
PetscErrorCode HycoMaterialTangents(HycoMaterial material, PetscInt dim, const PetscReal mu[], PetscInt n,
                                    const PetscReal x[], const PetscReal temperature[], PetscReal work[],
                                    PetscReal tangent[]);
/* stress = tangent . strain at a point. */
void HycoTangentApply(PetscBool isotropic, PetscInt dim, const PetscReal tangent[], const PetscReal strain[],
                      PetscReal stress[]);

/* Young's modulus and Poisson's ratio, the first two constants of isotropic laws; Lame's of them. */
PetscErrorCode HycoElasticDeclare(HycoMaterial material);
PetscErrorCode HycoElasticLame(HycoMaterial material, HycoMaterialPoints *points, PetscReal lame[]);

PetscErrorCode HycoMaterialCreate_Elastic(HycoMaterial material);
PetscErrorCode HycoMaterialCreate_J2(HycoMaterial material);
PetscErrorCode HycoMaterialCreate_Norton(HycoMaterial material);
PetscErrorCode HycoMaterialCreate_StrainHardening(HycoMaterial material);
PetscErrorCode HycoMaterialCreate_LimbackAndersson(HycoMaterial material);
PetscErrorCode HycoMaterialCreate_MFront(HycoMaterial material);

#endif
