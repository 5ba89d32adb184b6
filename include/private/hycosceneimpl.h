/* The scene's parts: expressions, bodies, supports, loads, contacts; and how its entries are stored. */
#ifndef HYCOSCENEIMPL_H
#define HYCOSCENEIMPL_H

#include <hycoimpl.h>
#include <hycoscene.h>
#include <hycosamples.h>

#define HYCO_MAX_PARAMETERS 32

typedef struct _n_HycoExpr *HycoExpr;

/* An expression in x, y, z and the n parameters `names`; `key` names the entry in messages. */
PetscErrorCode HycoExprCreate(const char key[], const char text[], PetscInt n, const char *const names[],
                              HycoExpr *expr);
PetscErrorCode HycoExprDestroy(HycoExpr *expr);
/* Where it was evaluated, for messages: the coordinates, and the parameters that it reads. */
PetscErrorCode HycoExprPlace(HycoExpr expr, const PetscReal mu[], const PetscReal xyz[3], char place[HYCO_LINE]);
/* Values at n points (n x 3 coordinates) and mu; fails on a value that is not finite. */
PetscErrorCode HycoExprEval(HycoExpr expr, const PetscReal mu[], PetscInt n, const PetscReal xyz[], PetscReal value[]);
/* Whether x, y or z appears; whether any parameter p with changed[p] does. NULL-safe (false). */
PetscBool HycoExprInSpace(HycoExpr expr);
PetscBool HycoExprChanges(HycoExpr expr, const PetscBool changed[]);
const char *HycoExprKey(HycoExpr expr);

typedef struct {
  char *name;
  HycoExpr young,
      poisson;       /* Young's modulus (1D: the stiffness nu of a unit cross-section), Poisson's ratio (0 in 1D) */
  PetscBool bbar;    /* mean dilatation (B-bar) instead of the displacements' own at each point */
  HycoExpr map[3];   /* moved coordinates; NULL: not moved */
  HycoExpr force[3]; /* body force per unit volume; NULL: none */
} HycoBody;

typedef struct {
  char *group;
  HycoExpr value[3]; /* prescribed displacement of component c; NULL: free */
} HycoFixed;

typedef struct {
  char *group;
  HycoExpr pressure;    /* positive pushes against the outward normal; NULL: none */
  HycoExpr traction[3]; /* force per unit surface; NULL: none */
} HycoLoad;

typedef enum {
  HYCO_CONTACT_OBSTACLE, /* n . u <= gap on the nodes of a group */
  HYCO_CONTACT_PAIR,     /* n . (u_slave - u_master) <= gap on node pairs */
  HYCO_CONTACT_SURFACE   /* the same at a slave node's projection on the master's facets */
} HycoContactType;

typedef struct {
  char *name;
  HycoContactType type;
  char *slave, *master; /* groups; an obstacle has only the slave ("group") */
  PetscReal tolerance;  /* largest distance to the master in the mesh file, where no map moves the surfaces; < 0: from
                           the facets' size */
  PetscReal overlap;    /* largest overlap before any load where the gap is measured; < 0: from the facets' size */
  HycoExpr normal[3];   /* all or none: outward normal of the slave side, at the master point (obstacle: slave) */
  HycoExpr gap;         /* NULL: measured along the normal between the moved nodes */
} HycoContact;

struct _p_HycoScene {
  PETSCHEADER(int);
  PetscOptions options; /* every entry, the command line's already in */
  char *title, *mesh_path;
  PetscInt refine; /* times that the mesh's cells are halved */
  /* parameters */
  PetscInt n_parameters;
  char *parameter[HYCO_MAX_PARAMETERS];
  PetscReal lo[HYCO_MAX_PARAMETERS], hi[HYCO_MAX_PARAMETERS];
  PetscBool extrapolate; /* values outside the ranges pass */
  /* description */
  PetscInt n_bodies, n_fixed, n_loads, n_contacts;
  HycoBody *body;
  HycoFixed *fixed;
  HycoLoad *load;
  HycoContact *contact;
  /* entries, sorted by key: what a model file carries */
  PetscInt n_entries;
  char **key, **value;
};

/* Builds a scene from n (key, value) entries; `folder` is where a relative mesh path starts. */
PetscErrorCode HycoSceneFromEntries(MPI_Comm comm, PetscInt n, char *const key[], char *const value[],
                                    const char folder[], HycoScene *scene);
/* The entries as text, one "key\tvalue" per line, and back. The caller frees the text. */
PetscErrorCode HycoSceneToText(HycoScene scene, char **text);
PetscErrorCode HycoSceneFromText(MPI_Comm comm, const char text[], HycoScene *scene);
/* What n points (n x n_parameters) reach of each parameter: from the least to the largest value, and half the widest
   step between two more at either end, so that grids of cell centres reach the ends of the ranges; never past the
   ranges. */
PetscErrorCode HycoSamplesReach(HycoScene scene, PetscInt n, const PetscReal mu[], PetscReal lo[], PetscReal hi[]);
/* The scene of a set of points. Borrowed. */
PetscErrorCode HycoSamplesGetScene(HycoSamples samples, HycoScene *scene);
/* A hash of all that decides a full-order solution: entries (but not hyco_ ones) and the mesh file's bytes. Collective.
 */
PetscErrorCode HycoSceneFingerprint(HycoScene scene, unsigned long long *hash);

#endif
