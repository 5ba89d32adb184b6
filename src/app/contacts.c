/* Results of each contact of the scene: in reports, in the text, as columns of tables. */
#include "driver.h"
#include <math.h>

/* Resultants on the slave's side; the master has the opposite ones. Moments are about the origin: in 2D the z
   component alone, in 1D none. */
PetscErrorCode DriverReportCarried(cJSON *json, PetscInt dim, PetscInt n, const HycoContactResult r[])
{
  cJSON *all = cJSON_AddObjectToObject(json, "contacts");

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) {
    cJSON *one = cJSON_AddObjectToObject(all, r[k].name);

    ReportNumbers(one, {"n", r[k].n}, {"n_active", r[k].n_active});
    ReportVector(one, "force", dim, r[k].force);
    if (dim == 2) ReportVector(one, "moment", 1, r[k].moment + 2);
    if (dim == 3) ReportVector(one, "moment", 3, r[k].moment);
    ReportNumbers(one, {"area", r[k].area}, {"pressure_max", r[k].pressure}, {"pressure_min", r[k].pressure_min});
    /* One contact's resultant is in the lines that follow in any case. */
    if (n > 1)
      PetscCall(
          DriverPrint("contact %s: %d of %d active, force on the slave (%.6g, %.6g, %.6g), largest pressure %.6g\n",
                      r[k].name, (int)r[k].n_active, (int)r[k].n, (double)r[k].force[0], (double)r[k].force[1],
                      (double)r[k].force[2], (double)r[k].pressure));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The model and its results are on rank 0; names are borrowed from each rank's scene, since addresses cannot be
   sent. */
PetscErrorCode DriverGetCarried(HycoROM model, HycoScene scene, PetscInt *n, HycoContactResult **result)
{
  const HycoContactResult *r = NULL;
  const char **names;
  PetscInt all;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetContacts(scene, &all, NULL));
  PetscCall(PetscMalloc1(all, result));
  PetscCall(PetscMalloc1(all, &names));
  PetscCall(HycoSceneGetContacts(scene, &all, names));
  *n = 0;
  HycoOnRoot(PETSC_COMM_WORLD, HycoROMGetContacts(model, n, &r));
  /* The model's own array, which the next prediction overwrites. */
  if (r) PetscCall(PetscArraycpy(*result, r, *n));
  PetscCallMPI(MPI_Bcast(n, 1, MPIU_INT, 0, PETSC_COMM_WORLD));
  HycoBcast(*result, *n * (PetscInt)sizeof(**result), MPI_BYTE, PETSC_COMM_WORLD);
  for (PetscInt k = 0; k < *n; k++) (*result)[k].name = names[k];
  PetscCall(PetscFree(names));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The columns of a contact in a table; their names follow the contact's name and a dot. */
enum { WIDTH = 10 };
/* One function for names and values: they cannot get out of step. */
static PetscInt ContactColumnsList(PetscInt dim, const HycoContactResult *r, const char *name[WIDTH],
                                   PetscReal value[WIDTH])
{
  static const char *const force[] = {"force_x", "force_y", "force_z"}, *const moment[] = {"moment_x", "moment_y",
                                                                                           "moment_z"};
  PetscInt n = 0;

  name[n] = "n_active", value[n++] = r->n_active;
  for (PetscInt c = 0; c < dim; c++) name[n] = force[c], value[n++] = r->force[c];
  /* In 2D only the moment about z, in 1D none. */
  for (PetscInt c = dim == 2 ? 2 : 0; dim > 1 && c < 3; c++) name[n] = moment[c], value[n++] = r->moment[c];
  name[n] = "area", value[n++] = r->area;
  name[n] = "pressure_max", value[n++] = r->pressure;
  name[n] = "pressure_min", value[n++] = r->pressure_min;
  return n;
}

/* Names only: a table needs them before there is a result. */
PetscErrorCode DriverCarriedColumns(HycoScene scene, PetscInt dim, DriverCarried *columns)
{
  const HycoContactResult none = {.name = NULL};
  const char **contact, *name[WIDTH];
  PetscReal value[WIDTH];

  PetscFunctionBegin;
  columns->dim = dim;
  PetscCall(HycoSceneGetContacts(scene, &columns->n_contacts, NULL));
  PetscCall(PetscMalloc1(columns->n_contacts, &contact));
  PetscCall(HycoSceneGetContacts(scene, &columns->n_contacts, contact));
  /* The values of `none` are not used: only the names and their number. */
  columns->each = ContactColumnsList(dim, &none, name, value);
  PetscCall(PetscMalloc1(columns->n_contacts * columns->each, &columns->name));
  for (PetscInt k = 0; k < columns->n_contacts * columns->each; k++)
    PetscCall(
        PetscSNPrintf(columns->name[k], DRIVER_LINE, "%s.%s", contact[k / columns->each], name[k % columns->each]));
  PetscCall(PetscFree(contact));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* n = 0: the model does not have all forces (NaN in tables). */
void DriverCarriedFill(const DriverCarried *columns, PetscInt n, const HycoContactResult r[], PetscReal v[])
{
  const char *name[WIDTH];

  for (PetscInt k = 0; k < columns->n_contacts; k++, v += columns->each) {
    if (n)
      ContactColumnsList(columns->dim, &r[k], name, v);
    else
      for (PetscInt c = 0; c < columns->each; c++) v[c] = NAN;
  }
}
