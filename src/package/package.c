/*
  The package: the one file that knows every class and every type of the library. It registers them at the start, so
  that no class needs to know its types, nor the readers of options the classes.
*/
#include <hycoconeimpl.h>
#include <hycocontactimpl.h>
#include <hycoextensions.h>
#include <hycomaterialimpl.h>
#include <hycoromtypes.h>
#include <hycotrainers.h>
#include <hycosolverimpl.h>
#include <hycosnapshots.h>

static PetscBool initialized = PETSC_FALSE;

/* PETSc assigns class ids anew after PetscFinalize(). */
static PetscErrorCode PackageReset(void)
{
  PetscFunctionBegin;
  PetscCall(HycoClassesForget());
  initialized = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoDeclareClasses(PetscOptions options)
{
  PetscFunctionBegin;
  PetscCall(HycoSolverDeclare(options));
  PetscCall(HycoFOMDeclare(options));
  PetscCall(HycoSnapshotsDeclare(options));
  PetscCall(HycoReducerDeclare(options));
  PetscCall(HycoROMDeclare(options));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A solver searches the forms in this order. */
static PetscErrorCode RegisterForms(void)
{
  PetscFunctionBegin;
  PetscCall(HycoSolverRegister("dual", HycoSolverFormCreate_Dual));
  PetscCall(HycoSolverRegister("primal", HycoSolverFormCreate_Primal));
  PetscCall(HycoSolverRegister("dual_free", HycoSolverFormCreate_Shell));
  PetscCall(HycoSolverRegister("projected", HycoSolverFormCreate_Projected));
  PetscCall(HycoSolverRegister("linear", HycoSolverFormCreate_Linear));
  PetscCall(HycoSolverRegister("condensed", HycoSolverFormCreate_Condensed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A type of model, which is solved, and its trainer, which makes it: the latter needs the parts of the library for
   training. */
static PetscErrorCode RegisterModels(void)
{
  PetscFunctionBegin;
  PetscCall(HycoROMRegister(HYCO_ROM_HYBRID, HycoROMCreate_Hybrid));
  PetscCall(HycoROMRegister(HYCO_ROM_PROJECTION, HycoROMCreate_Projection));
  PetscCall(HycoROMRegister(HYCO_ROM_BODIES, HycoROMCreate_Bodies));
  PetscCall(HycoTrainerRegister(HYCO_ROM_HYBRID, HycoTrainerCreate_Hybrid));
  PetscCall(HycoTrainerRegister(HYCO_ROM_PROJECTION, HycoTrainerCreate_Projection));
  PetscCall(HycoTrainerRegister(HYCO_ROM_BODIES, HycoTrainerCreate_Bodies));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The flag is set first, so that nothing below may start a second registration. */
PetscErrorCode HycoInitializePackage(void)
{
  PetscFunctionBegin;
  if (initialized) PetscFunctionReturn(PETSC_SUCCESS);
  initialized = PETSC_TRUE;
  PetscCall(HycoClassesRegister());
  PetscCall(PetscRegisterFinalize(PackageReset));
  PetscCall(HycoTaoRegisterAll());
  PetscCall(HycoConeRegister(HYCO_CONE_NONNEGATIVE, HycoConeCreate_Nonnegative));
  PetscCall(HycoConeRegister(HYCO_CONE_COULOMB, HycoConeCreate_Coulomb));
  /* The names are those of body_NAME_law in the scene. */
  PetscCall(HycoMaterialRegister(HYCO_MATERIAL_ELASTIC, HycoMaterialCreate_Elastic));
  PetscCall(HycoMaterialRegister(HYCO_MATERIAL_J2, HycoMaterialCreate_J2));
  PetscCall(HycoMaterialRegister(HYCO_MATERIAL_NORTON, HycoMaterialCreate_Norton));
  PetscCall(HycoMaterialRegister(HYCO_MATERIAL_STRAIN_HARDENING, HycoMaterialCreate_StrainHardening));
  PetscCall(HycoMaterialRegister(HYCO_MATERIAL_LIMBACK_ANDERSSON, HycoMaterialCreate_LimbackAndersson));
  /* The names are those of contact_NAME_type in the scene. */
  PetscCall(HycoContactRegister(HYCO_CONTACT_OBSTACLE, HycoContactCreate_Obstacle));
  PetscCall(HycoContactRegister(HYCO_CONTACT_PAIR, HycoContactCreate_Pair));
  PetscCall(HycoContactRegister(HYCO_CONTACT_SURFACE, HycoContactCreate_Surface));
  PetscCall(HycoContactRegister(HYCO_CONTACT_MORTAR, HycoContactCreate_Mortar));
  PetscCall(HycoContactRegister(HYCO_CONTACT_RIGID, HycoContactCreate_Rigid));
  PetscCall(RegisterForms());
  PetscCall(RegisterModels());
  PetscCall(HycoExtensionsRegister());
  HycoOptionsSetDeclare(HycoDeclareClasses);
  HycoOptionsSetProbe(HycoSolversProbe);
  PetscFunctionReturn(PETSC_SUCCESS);
}
