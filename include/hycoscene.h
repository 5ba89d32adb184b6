/* HycoScene: the user's description of bodies, supports, loads, contacts and parameters (architecture: scene/). */
#ifndef HYCOSCENE_H
#define HYCOSCENE_H

#include <hycosys.h>
#include <petscdm.h>

#if defined(__cplusplus)
extern "C" {
#endif

typedef struct _p_HycoScene *HycoScene;

/* Kinds of values of the entries that a law or a contact type declares. */
typedef enum {
  HYCO_ENTRY_EXPRESSION, /* in x, y, z and the parameters */
  HYCO_ENTRY_GROUP,      /* a physical group of the mesh, or a text */
  HYCO_ENTRY_LENGTH      /* a number, 0 or more; -1 if the scene does not give it */
} HycoEntryKind;

/*
  Reads a scene. Collective on `comm`. The caller owns `*scene`.

  `path` is a folder with scene.yaml, or a YAML file. Entries of PETSc's options database whose name is a scene entry
  (-scene_mesh, -body_pellet_young, -hyco_pod_tol, ...) take precedence over those of the file. Errors: a missing or
  unreadable file, an unknown entry (with the nearest known one), an expression that is not valid or uses an unknown
  name, an empty range.
*/
PetscErrorCode HycoSceneLoad(MPI_Comm comm, const char path[], HycoScene *scene);

/* Frees the scene and sets the handle to NULL. NULL-safe. Collective. */
PetscErrorCode HycoSceneDestroy(HycoScene *scene);

/* Gets the number of parameters, their names in the order of the scene, and their closed ranges lo[i] <= mu_i <= hi[i].
   Any output may be NULL. Not collective. Borrowed. */
PetscErrorCode HycoSceneGetParameters(HycoScene scene, PetscInt *n, const char *const *names[], const PetscReal *lo[],
                                      const PetscReal *hi[]);

/* Gets the names of the scene's `output` entries, in the order of the quantities of HycoSummary and HycoPrediction. Not
   collective. Borrowed. */
#define HYCO_MAX_QUANTITIES 16
PetscErrorCode HycoSceneGetQuantities(HycoScene scene, PetscInt *n, const char *names[HYCO_MAX_QUANTITIES]);
/* Gets their units in the same order, products of those of `scene: unit`: "N mm" of a moment; "": not known, as of
   areas. Not collective. Borrowed. */
PetscErrorCode HycoSceneGetQuantityUnits(HycoScene scene, PetscInt *n, const char *units[HYCO_MAX_QUANTITIES]);
/* Whether output q is of displacements, or of friction: it is arbitrary where the position of a body is
   (HycoPrediction.loose). Not collective. */
PetscBool HycoSceneQuantityIsOfPosition(HycoScene scene, PetscInt q);
/* at[k]: the number in `other` of the scene's output k, by name and definition; -1: `other` does not have it. Not
   collective. */
void HycoSceneMatchQuantities(HycoScene scene, HycoScene other, PetscInt at[]);

/* Gets the number of the scene's contacts and, in names (room for n; may be NULL), their names, in the order of
   HycoFOMGetContacts() and HycoROMGetContacts(). Not collective. Borrowed. */
PetscErrorCode HycoSceneGetContacts(HycoScene scene, PetscInt *n, const char *names[]);

/* Whether parameter values outside the ranges are accepted (default: refused). Not collective. */
PetscErrorCode HycoSceneSetExtrapolate(HycoScene scene, PetscBool extrapolate);

/* Gets the scene's title (may be empty). Not collective. Borrowed. */
PetscErrorCode HycoSceneGetTitle(HycoScene scene, const char *title[]);

/*
  Gives the scene a mesh of the program in place of a file: a DMPlex of segments, triangles, quadrilaterals,
  tetrahedra or hexahedra, interpolated, with a DMLabel for each group that the scene names. Points of a label, whatever
  their values, are in the group: cells for a body, facets for a surface, vertices for points. The DM may be
  distributed, by any partitioner, or not; its numbering of vertices and cells gives the node and cell tags of outputs.
  It is referenced, and not changed. Collective on the DM's communicator, which is that of the models made from the
  scene.
*/
PetscErrorCode HycoSceneSetDM(HycoScene scene, DM dm);
/* Reads the mesh: fails if it, or one of its groups that the scene names, is missing. Keeps nothing. Collective on
   comm. */
PetscErrorCode HycoSceneCheckMesh(MPI_Comm comm, HycoScene scene);

/* Gets the path of the scene's mesh file. Not collective. Borrowed. */
PetscErrorCode HycoSceneGetMesh(HycoScene scene, const char *path[]);

/* Fails with one line if an mu[i] (length n) is not finite or outside its range. Not collective. */
PetscErrorCode HycoSceneCheckParameters(HycoScene scene, PetscInt n, const PetscReal mu[]);

/* Whether the scene has any contact. Not collective. */
PetscErrorCode HycoSceneHasContact(HycoScene scene, PetscBool *contact);

/* Gets the listed times of its history, increasing, with the beginning of the path first; n is 0 for a scene without a
   history. Either output may be NULL. Not collective. Borrowed. */
PetscErrorCode HycoSceneGetHistory(HycoScene scene, PetscInt *n, const PetscReal *times[]);
/* Whether a contact of the scene has friction. Not collective. */
PetscBool HycoSceneHasFriction(HycoScene scene);

/* Fails with one line if the scene has a history, for a function `what` ("hyco train") that does not support one. Not
   collective. */
PetscErrorCode HycoSceneRefuseHistory(HycoScene scene, const char what[]);

/* Gets the options of the scene (its hyco: section, overridden by the command line). Not collective. Borrowed. */
PetscErrorCode HycoSceneGetOptions(HycoScene scene, PetscOptions *options);

/* Describes the scene on an ASCII viewer. Collective. */
PetscErrorCode HycoSceneView(HycoScene scene, PetscViewer viewer);

/* Views the object as requested by the option of this name: PetscObjectViewFromOptions(). Collective. */
PetscErrorCode HycoSceneViewFromOptions(HycoScene object, PetscObject owner, const char option[]);

#if defined(__cplusplus)
}
#endif
#endif
