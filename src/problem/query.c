/* Queries of a scene: parameters, options, words, fingerprint. */
#include <hycocontactimpl.h>
#include <stdio.h>
#include <string.h>
#include <petscviewer.h>

/* Borrowed arrays in the order of the components of mu. Any address may be NULL. */
PetscErrorCode HycoSceneGetParameters(HycoScene scene, PetscInt *n, const char *const *names[], const PetscReal *lo[],
                                      const PetscReal *hi[])
{
  PetscFunctionBegin;
  HycoCheckHandle(scene, HYCO_SCENE_CLASSID);
  if (n) *n = scene->n_parameters;
  if (names) *names = (const char *const *)scene->parameter;
  if (lo) *lo = scene->lo;
  if (hi) *hi = scene->hi;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Outputs in the order of the entries, which is that of all arrays of their values. names: room for
   HYCO_MAX_QUANTITIES, or NULL; borrowed. */
PetscErrorCode HycoSceneGetQuantities(HycoScene scene, PetscInt *n, const char *names[HYCO_MAX_QUANTITIES])
{
  PetscFunctionBegin;
  HycoCheckHandle(scene, HYCO_SCENE_CLASSID);
  HycoCheckGiven(n);
  *n = scene->n_quantities;
  for (PetscInt k = 0; k < *n && names; k++) names[k] = scene->quantity[k].name;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSceneGetQuantityUnits(HycoScene scene, PetscInt *n, const char *units[HYCO_MAX_QUANTITIES])
{
  PetscFunctionBegin;
  HycoCheckHandle(scene, HYCO_SCENE_CLASSID);
  HycoCheckGiven(n);
  *n = scene->n_quantities;
  for (PetscInt k = 0; k < *n && units; k++) units[k] = scene->quantity[k].unit;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The order is that of the numbers in pairs, results and fields: by the entries of the scene. Called with NULL
   first for the number, because scenes have no limit of contacts, unlike outputs. */
PetscErrorCode HycoSceneGetContacts(HycoScene scene, PetscInt *n, const char *names[])
{
  PetscFunctionBegin;
  HycoCheckHandle(scene, HYCO_SCENE_CLASSID);
  HycoCheckGiven(n);
  *n = scene->n_contacts;
  for (PetscInt k = 0; k < *n && names; k++) names[k] = scene->contact[k]->name;
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoSceneGetTitle, (HycoScene scene, const char *title[]), scene, HYCO_SCENE_CLASSID,
                 HycoCheckGiven(title);
                 *title = scene->title)
HycoDefineMethod(HycoSceneGetMesh, (HycoScene scene, const char *path[]), scene, HYCO_SCENE_CLASSID,
                 HycoCheckGiven(path);
                 *path = scene->mesh_path)
HycoDefineMethod(HycoSceneHasContact, (HycoScene scene, PetscBool *contact), scene, HYCO_SCENE_CLASSID,
                 HycoCheckGiven(contact);
                 *contact = (PetscBool)(scene->n_contacts > 0))
HycoDefineMethod(HycoSceneGetOptions, (HycoScene scene, PetscOptions *options), scene, HYCO_SCENE_CLASSID,
                 HycoCheckGiven(options);
                 *options = scene->options)

/* "radius = 4, load = 0.1"; cut at the end of the line. */
void HycoSceneNamePoint(HycoScene s, const PetscReal mu[], char at[HYCO_LINE])
{
  at[0] = '\0';
  for (PetscInt p = 0; p < s->n_parameters; p++) {
    const size_t length = strlen(at);

    snprintf(at + length, HYCO_LINE - length, "%s%s = %.10g", p ? ", " : "", s->parameter[p], (double)mu[p]);
  }
}

/* Before anything is assembled or predicted: a wrong number of values, or a point at which nothing was trained,
   would still give plausible numbers. */
PetscErrorCode HycoSceneCheckParameters(HycoScene scene, PetscInt n, const PetscReal mu[])
{
  PetscFunctionBegin;
  HycoCheckHandle(scene, HYCO_SCENE_CLASSID);
  PetscCheck(mu || !n, PETSC_COMM_SELF, PETSC_ERR_ARG_NULL, "the parameter values' address is NULL");
  if (n != scene->n_parameters) {
    char list[HYCO_LINE] = "";

    for (PetscInt p = 0; p < scene->n_parameters; p++) PetscCall(HycoListAdd(list, ", ", scene->parameter[p]));
    HycoFailAs(HYCO_ERR_VALUE, "%d parameter values were given; the scene has %d: %s", (int)n, (int)scene->n_parameters,
               list[0] ? list : "none");
  }
  for (PetscInt p = 0; p < n; p++) {
    /* A grid's last value may exceed its range by round-off. */
    const PetscReal slack = 1e-12 * PetscMax(PetscAbsReal(scene->lo[p]), PetscAbsReal(scene->hi[p]));

    HycoCheckValue(!PetscIsInfOrNanReal(mu[p]), "%s is not a finite number", scene->parameter[p]);
    HycoCheckValue(
        scene->extrapolate || (mu[p] >= scene->lo[p] - slack && mu[p] <= scene->hi[p] + slack),
        "%s = %.10g lies outside its range [%.10g, %.10g]; widen the range of a scene by -parameter_%s_range "
        "LO,HI, or permit it in a model by -extrapolate",
        scene->parameter[p], (double)mu[p], (double)scene->lo[p], (double)scene->hi[p], scene->parameter[p]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoSceneSetExtrapolate, (HycoScene scene, PetscBool extrapolate), scene, HYCO_SCENE_CLASSID,
                 scene->extrapolate = extrapolate)

/* The scene shares the DM with the caller. A former one is released after the new one is referenced, since both
   may be the same. */
PetscErrorCode HycoSceneSetDM(HycoScene scene, DM dm)
{
  PetscBool is_plex;

  PetscFunctionBegin;
  HycoCheckHandle(scene, HYCO_SCENE_CLASSID);
  HycoCheckGiven(dm);
  PetscCall(PetscObjectTypeCompare((PetscObject)dm, DMPLEX, &is_plex));
  HycoCheck(is_plex, "HycoSceneSetDM: the DM is not a DMPlex");
  PetscCall(PetscObjectReference((PetscObject)dm));
  PetscCall(DMDestroy(&scene->dm));
  scene->dm = dm;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Hashes the vertices' coordinates of the calling program's mesh, in an order independent of the number of processes.
   Collective. By exclusive or of one hash for each vertex: any order and partition gives the same. The global vector
   has each vertex once. */
static PetscErrorCode HashDM(HycoScene scene, unsigned long long *hash)
{
  unsigned long long all = 0, one;
  const PetscScalar *x;
  PetscInt n, dim;
  Vec place;

  PetscFunctionBegin;
  PetscCall(DMGetCoordinateDim(scene->dm, &dim));
  /* The coordinates alone: meshes of the same points with other cells or labels have the same fingerprint, unlike
     meshes of files, whose whole text counts. */
  PetscCall(DMGetCoordinates(scene->dm, &place));
  PetscCall(VecGetLocalSize(place, &n));
  PetscCall(VecGetArrayRead(place, &x));
  for (PetscInt k = 0; k < n; k += dim) all ^= HycoHash(HYCO_HASH_START, x + k, (size_t)dim * sizeof(*x));
  PetscCall(VecRestoreArrayRead(place, &x));
  PetscCallMPI(MPI_Allreduce(&all, &one, 1, MPI_UNSIGNED_LONG_LONG, MPI_BXOR, HycoComm(scene->dm)));
  *hash = HycoHash(*hash, &one, sizeof(one));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The mesh enters the fingerprint by its bytes, so that an edited mesh of the same name makes snapshots stale. */
static PetscErrorCode HashFile(HycoScene scene, unsigned long long *hash)
{
  unsigned char buffer[65536];
  FILE *file = fopen(scene->mesh_path, "rb");
  size_t n;

  PetscFunctionBegin;
  HycoCheck(scene->mesh_path[0], "the scene has no mesh; write scene: mesh: FILE.msh, or give -scene_mesh FILE.msh");
  HycoCheckFile(file, "the mesh %s cannot be opened", scene->mesh_path);
  while ((n = fread(buffer, 1, sizeof(buffer), file)) > 0) *hash = HycoHash(*hash, buffer, n);
  fclose(file);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether solutions may differ from those of versions that did not search for masters on moved surfaces. */
static PetscBool MayMoveSurfaces(HycoScene scene)
{
  PetscBool surface = PETSC_FALSE, map = PETSC_FALSE;

  for (PetscInt k = 0; k < scene->n_contacts; k++)
    surface = (PetscBool)(surface || scene->contact[k]->ops->find != NULL);
  for (PetscInt b = 0; b < scene->n_bodies; b++)
    map = (PetscBool)(map || scene->body[b].map[0] || scene->body[b].map[1] || scene->body[b].map[2]);
  return (PetscBool)(surface && map);
}

/* Scenes of one fingerprint have the same solutions at given parameters. The entries are sorted by key. Collective.
   */
PetscErrorCode HycoSceneFingerprint(HycoScene scene, unsigned long long *hash)
{
  PetscFunctionBegin;
  *hash = HYCO_HASH_START;
  for (PetscInt k = 0; k < scene->n_entries; k++) {
    /* What does not change a solution at given parameters: method, ranges, outputs, texts. */
    if (strncasecmp(scene->key[k], "hyco_", 5) == 0 || strncasecmp(scene->key[k], "parameter_", 10) == 0 ||
        strncasecmp(scene->key[k], "output_", 7) == 0 || strcasecmp(scene->key[k], "scene_mesh") == 0 ||
        strcasecmp(scene->key[k], "scene_title") == 0 || strncasecmp(scene->key[k], "scene_unit_", 11) == 0)
      continue;
    *hash = HycoHash(*hash, scene->key[k], strlen(scene->key[k]) + 1);
    *hash = HycoHash(*hash, scene->value[k], strlen(scene->value[k]) + 1);
  }
  if (MayMoveSurfaces(scene)) *hash = HycoHash(*hash, "masters where they are", 22);
  if (scene->dm)
    PetscCall(HashDM(scene, hash));
  else
    HycoOnRoot(HycoComm(scene), HashFile(scene, hash));
  PetscCallMPI(MPI_Bcast(hash, 1, MPI_UNSIGNED_LONG_LONG, 0, HycoComm(scene)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The entries as they were given, after options have replaced some: what a run used can be read off a model. */
PetscErrorCode HycoSceneView(HycoScene scene, PetscViewer viewer)
{
  PetscFunctionBegin;
  HycoCheckHandle(scene, HYCO_SCENE_CLASSID);
  if (!viewer) PetscCall(PetscViewerASCIIGetStdout(HycoComm(scene), &viewer));
  PetscCall(PetscViewerASCIIPrintf(viewer, "scene: %s\n", scene->title[0] ? scene->title : "(no title)"));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  mesh: %s\n", scene->mesh_path[0] ? scene->mesh_path : "(none)"));
  for (PetscInt p = 0; p < scene->n_parameters; p++) {
    PetscCall(PetscViewerASCIIPrintf(viewer, "  parameter %s in [%g, %g]\n", scene->parameter[p], (double)scene->lo[p],
                                     (double)scene->hi[p]));
  }
  for (PetscInt k = 0; k < scene->n_entries; k++) {
    const char *key = scene->key[k];

    /* The header and the ranges have been shown above in their own form. */
    if (strncasecmp(key, "scene_", 6) == 0 || strncasecmp(key, "parameter_", 10) == 0) continue;
    PetscCall(PetscViewerASCIIPrintf(viewer, "  %s: %s\n", key, scene->value[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
