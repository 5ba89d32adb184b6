/* HycoMaterial's struct, and the functions through which the element loop uses a law. */
#ifndef HYCOMATERIALIMPL_H
#define HYCOMATERIALIMPL_H

#include <hycomaterial.h>
#include <hycosceneimpl.h>

/* A direction of change of a step's data, and the derivatives of its results along it, by point as in
   HycoMaterialPoints. */
typedef struct {
  const PetscReal *strain, *state0; /* at the step's end; at its begin */
  const PetscReal *const *constant; /* as in HycoMaterialPoints; NULL: these and the temperatures stay */
  const PetscReal *temperature;     /* NULL: stays */
  PetscReal *state, *stress, *lost; /* lost: of what the stress lacks of that of an elastic strain */
  /* raised over the points: the largest rate of an equivalent stress; that at which points on their yield surface, or
     at rest, leave it */
  PetscReal rate, apart;
} HycoMaterialDerivative;
/* After HycoMaterialUpdate() of these points, whose solved equations are kept in `solved` (solved_size bytes each), and
   are there unless `fresh`. */
typedef PetscErrorCode (*HycoMaterialDerivatives)(HycoMaterial material, const HycoMaterialPoints *points,
                                                  PetscBool fresh, void *solved, HycoMaterialDerivative *slope);

struct _p_HycoMaterial {
  PETSCHEADER(struct _HycoMaterialOps);
  /* constants declared by the type */
  HycoDeclared constants;
  PetscInt n_state;
  char **state_name; /* n_state, or NULL */
  PetscBool linear, heat;
  HycoFormulation formulation; /* of the scene; in 1D and 3D HYCO_PLANE_STRAIN */
  const char *folder;          /* folder of the scene's relative paths; borrowed */
  HycoExpr temperature;        /* owned by the body; NULL: it has none */
  void *data;
  HycoMaterialDerivatives slopes; /* NULL: the law has no derivatives by its data, or its tangents are not exact */
  size_t solved_size;
};

/* Components of strain and stress in `dim` dimensions. */
static inline PetscInt HycoStrainSize(PetscInt dim)
{
  return dim == 1 ? 1 : dim == 2 ? 4 : 6;
}
/* Whether a body of the scene deforms inelastically. */
static inline PetscBool HycoSceneFlows(HycoScene scene)
{
  for (PetscInt b = 0; b < scene->n_bodies; b++) {
    if (!scene->body[b].law->linear) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}
/* Von Mises' equivalent of a stress (xx, yy, zz, xy, yz, xz as far as HycoStrainSize(); 1D: its size). */
PetscReal HycoMises(PetscInt dim, const PetscReal stress[]);
/* Number of reals of a tangent: 2 if it is isotropic (Lame's lambda and mu) and a 2D scene is one of plane strain,
   else the square of HycoStrainSize(). */
PetscInt HycoMaterialTangentSize(HycoMaterial material, PetscInt dim);
/* Checks that the library supports the law in this dimension and formulation, with or without a history of the
   scene. */
PetscErrorCode HycoMaterialSetUp(HycoMaterial material, PetscInt dim, HycoFormulation formulation,
                                 PetscBool has_history);
/* Whether the tangent changes with the parameters p with changed[p]. */
PetscBool HycoMaterialChanges(HycoMaterial material, const PetscBool changed[]);
/* Whether a constant varies in space, itself or by the temperature. */
PetscBool HycoMaterialInSpace(HycoMaterial material);
/* The constants at n points x (n x 3), their temperatures (NULL: none) and mu; work: room for n reals a constant.
   Fails if a constant is outside its interval. */
PetscErrorCode HycoMaterialConstants(HycoMaterial material, const PetscReal mu[], PetscInt n, const PetscReal x[],
                                     const PetscReal temperature[], PetscReal work[], const PetscReal *constant[]);
/* Elastic tangents there: of a linear law its tangents, of another law those at rest. Also fails if the law refuses
   a point or returns a tangent that is not symmetric and definite. */
PetscErrorCode HycoMaterialTangents(HycoMaterial material, PetscInt dim, const PetscReal mu[], PetscInt n,
                                    const PetscReal x[], const PetscReal temperature[], PetscReal work[],
                                    PetscReal tangent[]);
/* stress = tangent . strain at a point. */
void HycoTangentApply(PetscBool isotropic, PetscInt dim, const PetscReal tangent[], const PetscReal strain[],
                      PetscReal stress[]);

/* Young's modulus and Poisson's ratio, the first two constants of isotropic laws; Lame's constants from them. */
PetscErrorCode HycoElasticDeclare(HycoMaterial material);
PetscErrorCode HycoElasticLame(HycoMaterial material, HycoMaterialPoints *points, PetscReal lame[]);

PetscErrorCode HycoMaterialCreate_Elastic(HycoMaterial material);
PetscErrorCode HycoMaterialCreate_J2(HycoMaterial material);
PetscErrorCode HycoMaterialCreate_Norton(HycoMaterial material);
PetscErrorCode HycoMaterialCreate_StrainHardening(HycoMaterial material);
PetscErrorCode HycoMaterialCreate_LimbackAndersson(HycoMaterial material);

#endif
