/* The classes: their registration with PETSc, and the check of handles passed by a caller. */
#include <hycoimpl.h>
#include <string.h>

PetscClassId HYCO_SCENE_CLASSID, HYCO_SAMPLES_CLASSID, HYCO_SYSTEM_CLASSID, HYCO_SOLVER_CLASSID, HYCO_FOM_CLASSID,
    HYCO_SNAPSHOTS_CLASSID, HYCO_REDUCER_CLASSID, HYCO_ROM_CLASSID, HYCO_MATERIAL_CLASSID, HYCO_CONTACT_CLASSID,
    HYCO_CONE_CLASSID;

/* Each class with the function that creates its objects, for messages. */
static const struct {
  PetscClassId *id;
  const char *name, *maker;
} classes[] = {
    {&HYCO_SCENE_CLASSID, "HycoScene", "HycoSceneLoad()"},
    {&HYCO_SAMPLES_CLASSID, "HycoSamples", "HycoSamplesCreate()"},
    {&HYCO_SYSTEM_CLASSID, "HycoSystem", "HycoSystemCreate()"},
    {&HYCO_SOLVER_CLASSID, "HycoSolver", "HycoSolverCreate()"},
    {&HYCO_FOM_CLASSID, "HycoFOM", "HycoFOMCreate()"},
    {&HYCO_SNAPSHOTS_CLASSID, "HycoSnapshots", "HycoSnapshotsOpen()"},
    {&HYCO_REDUCER_CLASSID, "HycoReducer", "HycoReducerCreate()"},
    {&HYCO_ROM_CLASSID, "HycoROM", "HycoROMLoad()"},
    {&HYCO_MATERIAL_CLASSID, "HycoMaterial", "HycoMaterialCreate()"},
    {&HYCO_CONTACT_CLASSID, "HycoContact", "HycoContactCreate()"},
    {&HYCO_CONE_CLASSID, "HycoCone", "HycoConeCreate()"},
};

PetscErrorCode HycoClassesRegister(void)
{
  PetscFunctionBegin;
  for (size_t k = 0; k < sizeof(classes) / sizeof(classes[0]); k++)
    PetscCall(PetscClassIdRegister(classes[k].name, classes[k].id));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At PetscFinalize(): the numbers are PETSc's, and HycoPackageCheck() must fail until they are registered again. */
PetscErrorCode HycoClassesForget(void)
{
  PetscFunctionBegin;
  for (size_t k = 0; k < sizeof(classes) / sizeof(classes[0]); k++) *classes[k].id = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A class without its number would be an error deep inside PETSc, in a line that no user understands. */
PetscErrorCode HycoPackageCheck(void)
{
  PetscFunctionBegin;
  PetscCheck(*classes[0].id, PETSC_COMM_SELF, PETSC_ERR_ORDER,
             "hyco is not initialised; call HycoInitialize(), after or in place of PetscInitialize()");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A freed handle may still be readable: PetscHeaderDestroy() clears the class id, so that this finds most of them. For
   programs that call the library: hyco itself passes no wrong handle. */
PetscErrorCode HycoHandleCheck(const void *handle, const PetscClassId *classid, const char function[])
{
  size_t k = 0;

  PetscFunctionBegin;
  while (classes[k].id != classid) k++;
  PetscCheck(handle, PETSC_COMM_SELF, PETSC_ERR_ARG_NULL, "%s: the handle is NULL; create it by %s first", function,
             classes[k].maker);
  PetscCheck(*classid && ((const struct _p_PetscObject *)handle)->classid == *classid, PETSC_COMM_SELF,
             PETSC_ERR_ARG_WRONG, "%s: the handle is not a %s, or it was destroyed; create it by %s first", function,
             classes[k].name, classes[k].maker);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The caller pops the tab. */
PetscErrorCode HycoViewBegin_Private(PetscObject object, PetscViewer *viewer, PetscBool *ascii)
{
  PetscFunctionBegin;
  if (!*viewer) PetscCall(PetscViewerASCIIGetStdout(HycoComm(object), viewer));
  PetscCall(PetscObjectTypeCompare((PetscObject)*viewer, PETSCVIEWERASCII, ascii));
  if (!*ascii) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscObjectPrintClassNamePrefixType(object, *viewer));
  PetscCall(PetscViewerASCIIPushTab(*viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The global database first: a caller's option is there, and an object's own may be a scene's. */
PetscErrorCode HycoViewFromOptions_Private(PetscObject object, PetscObject owner, const char option[])
{
  const PetscOptions own = object->options;
  PetscBool global;
  PetscErrorCode caught;
  char why[HYCO_LINE];

  PetscFunctionBegin;
  HycoCheckGiven(option);
  PetscCall(PetscOptionsHasName(NULL, owner ? owner->prefix : object->prefix, option, &global));
  if (global) object->options = NULL;
  HycoCatch(PetscObjectViewFromOptions(object, owner, option), caught, why);
  object->options = own;
  HycoCheck(!caught, "%s: %s", option, why);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoOptionsInherit(PetscObject object, PetscObject from)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectSetOptions(object, from->options));
  PetscCall(PetscObjectSetOptionsPrefix(object, from->prefix));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFreeAll_Private(void *const addresses[])
{
  PetscFunctionBegin;
  for (; *addresses; addresses++) PetscCall(PetscFree(*(void **)*addresses));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoDestroyAll_Private(void *const addresses[])
{
  PetscFunctionBegin;
  for (; *addresses; addresses++) PetscCall(PetscObjectDestroy((PetscObject *)*addresses));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoVecDuplicate_Private(Vec v, Vec *const copies[])
{
  PetscFunctionBegin;
  for (; *copies; copies++) PetscCall(VecDuplicate(v, *copies));
  PetscFunctionReturn(PETSC_SUCCESS);
}

const char *HycoVersion(void)
{
  return HYCO_VERSION;
}
