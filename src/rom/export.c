/* Formats in which a model's predictions become a program of their own; the core has none. */
#include <hycoregistry.h>
#include <hycoromimpl.h>

static HycoRegistry formats = {.sorted = PETSC_TRUE};

HycoDefineRegister(HycoExporterRegister, formats, HycoExporter create)

/* The registry is empty unless an extension has filled it. */
PetscErrorCode HycoROMExport(HycoROM m, const char format[], const char path[], char **description)
{
  HycoExporter write;

  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  HycoCheckGiven(format);
  HycoCheckGiven(path);
  HycoCheckGiven(description);
  PetscCall(HycoRegistryFind(&formats, format, &write));
  HycoCheck(write, "this build has no export to %s; build it with the extension export (HYCO_EXTENSIONS)", format);
  PetscCall(write(m, path, description));
  PetscFunctionReturn(PETSC_SUCCESS);
}
