/* HycoMaterial: a material law. A body of the scene names its type (`law:`, by default elastic) and gives its
   constants. */
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

/* Value of `initial` for a constant that the scene must give. */
#define HYCO_REQUIRED PETSC_INFINITY
/* Bound of a constant that may be 0, but not negative: any number below 0, as bounds are excluded. */
#define HYCO_NOT_NEGATIVE (-1e-300)
/* Bound of an interval that begins with 1 included: the number before 1, as bounds are excluded. */
#define HYCO_FROM_ONE (1 - PETSC_MACHINE_EPSILON)
/* Bound of an interval that ends with 1 included: the number after 1, as bounds are excluded. */
#define HYCO_TO_ONE (1 + PETSC_MACHINE_EPSILON)

/*
  n integration points of one law. Strain and stress have n_strain components per point: 1D (xx), 2D (xx, yy, zz, xy),
  3D (xx, yy, zz, xy, yz, xz), with shear strains as angles (gamma = 2 eps), so that stress . strain is twice the
  energy. Strains exclude the thermal strain, which the library subtracts. Arrays that the caller does not provide or
  request are NULL. A nonlinear law may be called for its elastic tangent: strain and strain0 are then the same array. A
  linear law is called for its tangent only, without strains. Temperatures are NULL in a body without a temperature.
*/
/* -- begin: in exported models too -- */
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
  /* out, n each, densities by volume. A law may omit them: then no energy is stored and all work is dissipated. If it
     sets only `stored`, the increment is the dissipated energy divided by the equivalent stress */
  PetscReal *stored;     /* elastic energy at the step's end */
  PetscReal *dissipated; /* by the step: (stress0 + stress) / 2 : its inelastic strain */
  PetscReal *increment;  /* equivalent inelastic strain of the step, 0 or more */
  PetscReal *potential;  /* whose gradient with respect to strain is the stress; omitted if there is none */
  PetscReal dt_factor;   /* out: factor by which the law suggests to multiply the step; 1 by default */
  PetscInt failed;       /* out: a point where the law has no solution; -1 by default */
  const char *why;       /* out: the reason, "the yield stress is negative" */
} HycoMaterialPoints;
/* -- end: in exported models too -- */

typedef struct _HycoMaterialOps *HycoMaterialOps;
struct _HycoMaterialOps {
  /* Optional: declares constants that depend on the law's text entries in the scene, HycoMaterialDeclareText(). */
  PetscErrorCode (*declare)(HycoMaterial);
  /* Optional: checks the space dimension, sets the number of state variables. */
  PetscErrorCode (*setup)(HycoMaterial, PetscInt dim);
  /* The law: computes the requested arrays at all points. One of update and isotropic is required. */
  PetscErrorCode (*update)(HycoMaterial, HycoMaterialPoints *points);
  /* A linear law with an isotropic tangent: Lame's lambda and mu, lame[n x 2], which make the element kernels faster.
     stress = lambda tr(eps) I + 2 mu eps; in 1D stress = mu eps. For a nonlinear law: its elastic part. */
  PetscErrorCode (*isotropic)(HycoMaterial, HycoMaterialPoints *points, PetscReal lame[]);
  /* Whether the tangent changes if the constants j with changed[j] change; NULL: with any constant. */
  PetscBool (*depends)(HycoMaterial, const PetscBool changed[]);
  PetscErrorCode (*destroy)(HycoMaterial);
};

/* Adds a law that scenes can then name. create() declares its constants and sets its operations. Not collective. */
PetscErrorCode HycoMaterialRegister(const char name[], PetscErrorCode (*create)(HycoMaterial));

/* Creates a law without a type. The caller owns it. Collective. */
PetscErrorCode HycoMaterialCreate(MPI_Comm comm, HycoMaterial *material);
PetscErrorCode HycoMaterialDestroy(HycoMaterial *material);
/* Sets the type. Fails for an unknown type, with the list of the registered ones. */
PetscErrorCode HycoMaterialSetType(HycoMaterial material, HycoMaterialType type);
PetscErrorCode HycoMaterialGetType(HycoMaterial material, HycoMaterialType *type);
PetscErrorCode HycoMaterialView(HycoMaterial material, PetscViewer viewer);

/* In create(): declares the next constant, with `title` for messages ("Young's modulus"), its default value
   (HYCO_REQUIRED: the scene must give it), and the open interval lo < value < hi. */
PetscErrorCode HycoMaterialDeclare(HycoMaterial material, const char name[], const char title[], PetscReal initial,
                                   PetscReal lo, PetscReal hi);
PetscErrorCode HycoMaterialSetOps(HycoMaterial material, const struct _HycoMaterialOps *ops);
/* In create(): declares an entry of the scene that is a text, such as a file name. Get returns its value, in declare().
   Borrowed. */
PetscErrorCode HycoMaterialDeclareText(HycoMaterial material, const char name[], const char title[]);
PetscErrorCode HycoMaterialGetText(HycoMaterial material, const char name[], const char **text);
/* Sets the number of state variables of an integration point (default: none), which are 0 at the beginning. names: for
   outputs, or NULL. */
PetscErrorCode HycoMaterialSetStateSize(HycoMaterial material, PetscInt n_state);
PetscErrorCode HycoMaterialSetStateNames(HycoMaterial material, PetscInt n_state, const char *const names[]);
/* Whether the law uses temperatures, so that its body must have one (default: false). */
PetscErrorCode HycoMaterialSetHeat(HycoMaterial material, PetscBool heat);
/* Whether stress = tangent . strain with a tangent that depends on the constants only (default: true). A scene with a
   nonlinear law needs a history. */
PetscErrorCode HycoMaterialSetLinear(HycoMaterial material, PetscBool linear);
PetscErrorCode HycoMaterialSetData(HycoMaterial material, void *data);
PetscErrorCode HycoMaterialGetData(HycoMaterial material, void *data);

/* Evaluates the law at points whose constants are given. For a linear law the library computes the stress from the
   tangent, for which the caller provides memory too, and the tangent from isotropic(). Not collective. */
PetscErrorCode HycoMaterialUpdate(HycoMaterial material, HycoMaterialPoints *points);

#if defined(__cplusplus)
}
#endif
#endif
