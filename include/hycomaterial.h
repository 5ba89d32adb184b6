/* HycoMaterial: a material law. A body of the scene names its type (`law:`, by default elastic) and gives its
 * constants. */
#ifndef HYCOMATERIAL_H
#define HYCOMATERIAL_H

#include <hycosys.h>

#if defined(__cplusplus)
extern "C" {
#endif

typedef struct _p_HycoMaterial *HycoMaterial;
typedef const char *HycoMaterialType;
#define HYCO_MATERIAL_ELASTIC "elastic" /* isotropic linear elasticity: young, poisson; in 1D sigma = young eps */

/* Laws of scenes with a history: docs/materials.md. */
#define HYCO_MATERIAL_J2                "j2"
#define HYCO_MATERIAL_NORTON            "norton"
#define HYCO_MATERIAL_STRAIN_HARDENING  "strain_hardening"
#define HYCO_MATERIAL_LIMBACK_ANDERSSON "limback_andersson"
#define HYCO_MATERIAL_MFRONT            "mfront" /* from a shared library with MFront's generic C interface */

/* As a constant's value for `initial`: the scene must give it. */
#define HYCO_REQUIRED PETSC_INFINITY
/* As the lower bound of a constant that may be 0, but not negative. */
#define HYCO_NOT_NEGATIVE (-1e-300)
/* As a bound that is in the interval itself, of constants from 1 on or up to it. */
#define HYCO_FROM_ONE (1 - PETSC_MACHINE_EPSILON)
#define HYCO_TO_ONE   (1 + PETSC_MACHINE_EPSILON)

/*
  n integration points of one law. Strain and stress have n_strain components a point: 1D (xx), 2D
  (xx, yy, zz, xy), 3D (xx, yy, zz, xy, yz, xz), shear strains as angles (gamma = 2 eps), so that stress . strain is
  twice the energy. Strains are without the thermal strain, which the library takes out. What a caller does not have or
  does not ask for is NULL, and a law that is not linear may be asked for its elastic tangent: strain and strain0 are
  then the same array. A linear law is asked for its tangent alone, without strains; temperatures are NULL in a body
  that has none.
*/
typedef struct {
  PetscInt n, dim, n_strain;
  const PetscReal *const *constant; /* [j][i]: value of the j-th declared constant at point i */
  PetscReal dt;
  const PetscReal *strain0, *strain;           /* n x n_strain: at the step's begin and end */
  const PetscReal *stress0;                    /* n x n_strain */
  const PetscReal *temperature0, *temperature; /* n */
  const PetscReal *state0;                     /* n x n_state */
  PetscReal *state;                            /* out: at the step's end */
  PetscReal *stress;                           /* out: n x n_strain */
  PetscReal *tangent; /* out: n x n_strain x n_strain, d stress / d strain of the step, row major, symmetric */
  /* out, n each, densities by volume; a law may leave them: then nothing is stored, all work is dissipated,
     and where it stores, the increment is what is dissipated over the equivalent stress */
  PetscReal *stored;     /* elastic energy at the step's end */
  PetscReal *dissipated; /* by the step: (stress0 + stress) / 2 : its inelastic strain */
  PetscReal *increment;  /* equivalent inelastic strain of the step, 0 or more */
  PetscReal *potential;  /* of which stress is the gradient by strain; left where there is none */
  PetscReal dt_factor;   /* out: what the law would multiply the step by; 1 unless it sets it */
  PetscInt failed;       /* out: a point where the law has no answer; -1 unless it sets it */
  const char *why;       /* out: the reason, "the yield stress is negative" */
} HycoMaterialPoints;

typedef struct _HycoMaterialOps *HycoMaterialOps;
struct _HycoMaterialOps {
  /* Optional: declares constants that depend on what the scene says in the law's texts, HycoMaterialDeclareText(). */
  PetscErrorCode (*declare)(HycoMaterial);
  /* Optional: refuses a space dimension, sets the number of state variables. */
  PetscErrorCode (*setup)(HycoMaterial, PetscInt dim);
  /* The law: fills what is asked for at all points; one of update and isotropic is required. */
  PetscErrorCode (*update)(HycoMaterial, HycoMaterialPoints *points);
  /* A linear law with an isotropic tangent: Lame's lambda and mu, lame[n x 2], which make the element kernels faster.
     stress = lambda tr(eps) I + 2 mu eps; in 1D stress = mu eps. Of a law that is not linear: its elastic part. */
  PetscErrorCode (*isotropic)(HycoMaterial, HycoMaterialPoints *points, PetscReal lame[]);
  /* Whether the tangent changes where the constants j with changed[j] do; NULL: with any. */
  PetscBool (*depends)(HycoMaterial, const PetscBool changed[]);
  PetscErrorCode (*destroy)(HycoMaterial);
};

/* Adds a law, which scenes then name: create() declares its constants and sets its operations. Not collective. */
PetscErrorCode HycoMaterialRegister(const char name[], PetscErrorCode (*create)(HycoMaterial));

/* A law without type. The caller owns it. Collective. */
PetscErrorCode HycoMaterialCreate(MPI_Comm comm, HycoMaterial *material);
PetscErrorCode HycoMaterialDestroy(HycoMaterial *material);
/* Fails with the list of those that are registered. */
PetscErrorCode HycoMaterialSetType(HycoMaterial material, HycoMaterialType type);
PetscErrorCode HycoMaterialGetType(HycoMaterial material, HycoMaterialType *type);
PetscErrorCode HycoMaterialView(HycoMaterial material, PetscViewer viewer);

/* In create(): the next constant, `title` for messages ("Young's modulus"), its value where the scene gives none
   (HYCO_REQUIRED: it must), and the open interval lo < value < hi. */
PetscErrorCode HycoMaterialDeclare(HycoMaterial material, const char name[], const char title[], PetscReal initial,
                                   PetscReal lo, PetscReal hi);
PetscErrorCode HycoMaterialSetOps(HycoMaterial material, const struct _HycoMaterialOps *ops);
/* In create(): an entry of the scene that is a text, such as a file's name; then its value, to be read in declare().
   Borrowed. */
PetscErrorCode HycoMaterialDeclareText(HycoMaterial material, const char name[], const char title[]);
PetscErrorCode HycoMaterialGetText(HycoMaterial material, const char name[], const char **text);
/* State variables of an integration point, 0 at the beginning; none unless set. names: for outputs, or NULL. */
PetscErrorCode HycoMaterialSetStateSize(HycoMaterial material, PetscInt n_state);
PetscErrorCode HycoMaterialSetStateNames(HycoMaterial material, PetscInt n_state, const char *const names[]);
/* Whether the law reads temperatures, so that its body must have one; false unless set. */
PetscErrorCode HycoMaterialSetHeat(HycoMaterial material, PetscBool heat);
/* Whether stress = tangent . strain with a tangent that depends on the constants alone; true unless set. A scene with a
   body whose law is not linear needs a history. */
PetscErrorCode HycoMaterialSetLinear(HycoMaterial material, PetscBool linear);
PetscErrorCode HycoMaterialSetData(HycoMaterial material, void *data);
PetscErrorCode HycoMaterialGetData(HycoMaterial material, void *data);

/* The law at points whose constants are given. Of a linear law the library makes the stress from the tangent, which
   then has room too, and the tangent from isotropic(). Not collective. */
PetscErrorCode HycoMaterialUpdate(HycoMaterial material, HycoMaterialPoints *points);

#if defined(__cplusplus)
}
#endif
#endif
