/* HycoScene: the user's description of bodies, supports, loads, contacts and parameters (architecture: scene/). */
#ifndef HYCOSCENE_H
#define HYCOSCENE_H

#include <hycosys.h>
#include <petscdm.h>

#if defined(__cplusplus)
extern "C" {
#endif

typedef struct _p_HycoScene *HycoScene;

/* What an entry that a law or a contact type declares has as its value. */
typedef enum {
  HYCO_ENTRY_EXPRESSION, /* in x, y, z and the parameters */
  HYCO_ENTRY_GROUP,      /* a physical group of the mesh, or a text */
  HYCO_ENTRY_LENGTH      /* a number, 0 or more; -1 where the scene gives none */
} HycoEntryKind;

/*
  Reads a scene. Collective on `comm`. The caller owns `*scene`.

  `path` is a folder that holds scene.yaml, or a YAML file. Entries of PETSc's options database
  whose name is a scene entry (-scene_mesh, -body_pellet_young, -hyco_pod_tol, ...) win over the file's.
  Errors: a missing or unreadable file, an entry that the scene does not know (with the nearest
  known one), an expression that does not parse or names something unknown, a range that is empty.
*/
PetscErrorCode HycoSceneLoad(MPI_Comm comm, const char path[], HycoScene *scene);

/* Frees the scene and sets the handle to NULL. NULL-safe. Collective. */
PetscErrorCode HycoSceneDestroy(HycoScene *scene);

/* Number of parameters, their names in declared order, and their closed ranges lo[i] <= mu_i <= hi[i].
   Any output may be NULL. Not collective. Borrowed. */
PetscErrorCode HycoSceneGetParameters(HycoScene scene, PetscInt *n, const char *const *names[], const PetscReal *lo[],
                                      const PetscReal *hi[]);

/* The quantities that the scene's `output` entries name, in the order of HycoSummary's and HycoPrediction's. Not
   collective. Borrowed. */
#define HYCO_MAX_QUANTITIES 16
PetscErrorCode HycoSceneGetQuantities(HycoScene scene, PetscInt *n, const char *names[HYCO_MAX_QUANTITIES]);

/* The number of the scene's contacts and, in names (room for n; may be NULL), what it calls them, in the order of
   HycoFOMGetContacts() and HycoROMGetContacts(). Not collective. Borrowed. */
PetscErrorCode HycoSceneGetContacts(HycoScene scene, PetscInt *n, const char *names[]);

/* Whether parameter values outside the ranges are refused (default) or taken. Not collective. */
PetscErrorCode HycoSceneSetExtrapolate(HycoScene scene, PetscBool extrapolate);

/* The scene's title (may be empty). Not collective. Borrowed. */
PetscErrorCode HycoSceneGetTitle(HycoScene scene, const char *title[]);

/*
  Gives the scene a mesh of the program's own in place of a file: a DMPlex of segments, triangles, quadrilaterals,
  tetrahedra or hexahedra, interpolated, with a DMLabel for each group that the scene names. Points of a label, whatever
  their values, are in the group: cells for a body, facets for a surface, vertices for points. The DM may be
  distributed, by whatever partitioner, or not; its own numbering of vertices and cells gives the node and cell tags of
  outputs. It is referenced, and not changed. Collective on the DM's communicator, which is that of the models made from
  the scene.
*/
PetscErrorCode HycoSceneSetDM(HycoScene scene, DM dm);

/* Where the scene's mesh file is. Not collective. Borrowed. */
PetscErrorCode HycoSceneGetMesh(HycoScene scene, const char *path[]);

/* Fails with a clear line when mu[i] (length n) is not finite or leaves its range. Not collective. */
PetscErrorCode HycoSceneCheckParameters(HycoScene scene, PetscInt n, const PetscReal mu[]);

/* Whether the scene has any contact. Not collective. */
PetscErrorCode HycoSceneHasContact(HycoScene scene, PetscBool *contact);

/* The times that its history lists, increasing, the begin of the path first; n is 0 for a scene without history. Either
   output may be NULL. Not collective. Borrowed. */
PetscErrorCode HycoSceneGetHistory(HycoScene scene, PetscInt *n, const PetscReal *times[]);

/* Fails with one line where the scene has a history, for `what` ("hyco train"), which takes none. Not collective. */
PetscErrorCode HycoSceneRefuseHistory(HycoScene scene, const char what[]);

/* The options that the scene carries (its hyco: section, overridden by the command line). Not collective. Borrowed. */
PetscErrorCode HycoSceneGetOptions(HycoScene scene, PetscOptions *options);

/* Prints what the scene says, in words, on an ASCII viewer. Collective. */
PetscErrorCode HycoSceneView(HycoScene scene, PetscViewer viewer);

/* View as an option of this name says: PetscObjectViewFromOptions(). Collective. */
PetscErrorCode HycoSceneViewFromOptions(HycoScene object, PetscObject owner, const char option[]);

#if defined(__cplusplus)
}
#endif
#endif
