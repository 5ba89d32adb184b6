/* The scene's parts: expressions, bodies, supports, loads, contacts; and how its entries are stored. */
#ifndef HYCOSCENEIMPL_H
#define HYCOSCENEIMPL_H

#include <hycocontact.h>
#include <hycoimpl.h>
#include <hycomaterial.h>
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
/* The same of an expression that may name `temperature`, n values; NULL where it does not. */
PetscErrorCode HycoExprEvalHot(HycoExpr expr, const PetscReal mu[], PetscInt n, const PetscReal xyz[],
                               const PetscReal temperature[], PetscReal value[]);
/* Whether x, y or z appears; whether any parameter p with changed[p] does. NULL-safe (false). */
PetscBool HycoExprInSpace(HycoExpr expr);
/* Whether `temperature` does, which only a law's constants and the expansion may name. NULL-safe. */
PetscBool HycoExprInHeat(HycoExpr expr);
/* Fails where it does. */
PetscErrorCode HycoExprRefuseHeat(HycoExpr expr);
PetscBool HycoExprChanges(HycoExpr expr, const PetscBool changed[]);
const char *HycoExprKey(HycoExpr expr);

/* Entries of the scene that a law or a contact type declares. */
#define HYCO_MAX_DECLARED 32
typedef struct {
  char *name, *title; /* "young", "Young's modulus" */
  HycoEntryKind kind;
  PetscBool required;
  HycoExpr expr;    /* of an expression that the scene gives */
  char *text;       /* of a group, a text */
  PetscBool heat;   /* its expression may name `temperature` */
  PetscReal value;  /* of a length, and where the scene gives no expression */
  PetscReal lo, hi; /* of a law's constant: open interval */
} HycoEntry;
typedef struct {
  PetscInt n;
  HycoEntry entry[HYCO_MAX_DECLARED];
} HycoDeclared;

/* The next entry; `declared` holds it. */
PetscErrorCode HycoDeclaredAdd(HycoDeclared *declared, const char name[], const char title[], HycoEntryKind kind,
                               PetscBool required, HycoEntry **entry);
/* In any letter case; NULL: there is none. */
HycoEntry *HycoDeclaredFind(HycoDeclared *declared, const char name[]);
/* What the scene's entry `key` says. */
PetscErrorCode HycoDeclaredRead(HycoScene scene, const char key[], const char text[], HycoEntry *entry);
PetscErrorCode HycoDeclaredView(const HycoDeclared *declared, PetscViewer viewer);
PetscErrorCode HycoDeclaredDestroy(HycoDeclared *declared);

typedef struct {
  char *name;
  HycoMaterial law;
  PetscBool bbar;    /* mean dilatation (B-bar) instead of the displacements' own at each point */
  PetscBool element; /* whether the scene says so; if not, HycoFE chooses by the law */
  HycoExpr map[3];   /* moved coordinates; NULL: not moved */
  HycoExpr force[3]; /* body force per unit volume; NULL: none */
  HycoExpr density;  /* mass per unit volume, of gravity and rotation; NULL: none */
  HycoExpr temperature, reference, expansion; /* K; thermal strain expansion (temperature - reference); NULL: none */
} HycoBody;

typedef struct {
  char *group;
  HycoExpr value[3];             /* prescribed displacement of component c; NULL: free */
  HycoExpr normal, direction[3]; /* prescribed displacement along a direction; NULL: none */
} HycoFixed;

typedef struct {
  char *group;
  HycoExpr pressure;    /* positive pushes against the outward normal; NULL: none */
  HycoExpr traction[3]; /* force per unit surface; NULL: none */
} HycoLoad;

/* Forces on each point of a group of points, per unit length of a group of lines in space. */
typedef struct {
  char *group;
  HycoExpr force[3]; /* NULL: none */
} HycoPointLoad;

/* Accelerations of the whole scene: gravity; angular speed about an axis through a point. NULL: none. */
typedef struct {
  HycoExpr gravity[3], speed, axis[3], through[3];
} HycoMotion;

/* Springs to the ground: force per displacement and unit surface; of a group of points, per point. */
typedef struct {
  char *group;
  HycoExpr stiffness[4]; /* along x, y, z and the surface's normal, 0 or more; NULL: none */
} HycoSpring;

/* Surfaces of two bodies that move as one: the slave's nodes follow the master's facets. */
typedef struct {
  char *name, *slave, *master;
  PetscReal tolerance; /* largest distance as drawn; negative: by the slave's facets */
} HycoTie;

/* What a 2D scene stands for: a slice of thickness 1 that does not stretch (eps_zz = 0) or is free to (sigma_zz = 0),
   or a body of revolution about x = 0: x is the radius, y the axis, zz the hoop; all integrals are over the full
   circle. */
typedef enum { HYCO_PLANE_STRAIN, HYCO_PLANE_STRESS, HYCO_AXISYMMETRIC } HycoFormulation;

/* A number that the scene asks of each solution: the largest, smallest or mean value of a field over a group; the force
   of its supports along an axis; from HYCO_QUANTITY_FORCE on what a contact carries: its resultant along an axis, its
   moment about one, its largest pressure. */
typedef enum {
  HYCO_QUANTITY_MAX,
  HYCO_QUANTITY_MIN,
  HYCO_QUANTITY_MEAN,
  HYCO_QUANTITY_REACTION,
  HYCO_QUANTITY_FORCE,
  HYCO_QUANTITY_MOMENT,
  HYCO_QUANTITY_PRESSURE
} HycoQuantityKind;
typedef struct {
  char *name, *group; /* group NULL: all of the mesh */
  char *contact;      /* NULL: all of them */
  PetscBool given;    /* the kind and the field are */
  HycoQuantityKind kind;
  PetscInt field; /* of HycoQuantityFields; along or about an axis 0 to 2 */
} HycoQuantity;
extern const char *const HycoQuantityFields[]; /* NULL ends */

/* A quantity over time: linear between its rows, constant before the first and after the last. */
typedef struct {
  PetscInt n;
  PetscReal *t, *value;
} HycoTimeTable;

/* What fields are measured in. */
enum { HYCO_UNIT_LENGTH, HYCO_UNIT_FORCE, HYCO_UNIT_STRESS, HYCO_N_UNITS };

struct _p_HycoScene {
  PETSCHEADER(int);
  PetscOptions options;                         /* every entry, the command line's already in */
  char *title, *mesh_path, *unit[HYCO_N_UNITS]; /* units: notes, "" where the scene has none */
  DM dm;                                        /* the program's own mesh; NULL: mesh_path */
  PetscBool face_nodes;                         /* rank 0, once the mesh is read: its hex20 cells are read as hex27 */
  PetscInt refine;                              /* times that the mesh's cells are halved */
  HycoFormulation formulation;
  char *folder; /* where relative paths of entries start */
  /* parameters */
  PetscInt n_parameters;
  PetscInt n_variables; /* of expressions: the parameters; with a history t and its tables' values too */
  char *parameter[HYCO_MAX_PARAMETERS]; /* names of the variables, the parameters' first */
  PetscReal lo[HYCO_MAX_PARAMETERS], hi[HYCO_MAX_PARAMETERS];
  PetscBool extrapolate; /* values outside the ranges pass */
  /* history; without one n_times is 0 */
  PetscInt n_times, n_tables;
  PetscReal *times; /* increasing; the first is where the path begins */
  HycoTimeTable table[HYCO_MAX_PARAMETERS];
  /* names that stand for expressions; the texts are the entries' */
  PetscInt n_constants, *constant;
  /* description */
  PetscInt n_bodies, n_fixed, n_loads, n_point_loads, n_springs, n_contacts, n_ties;
  HycoBody *body;
  HycoFixed *fixed;
  HycoLoad *load;
  HycoPointLoad *point_load;
  HycoMotion motion;
  HycoSpring *spring;
  HycoContact *contact;
  HycoTie *tie;
  PetscInt n_quantities;
  HycoQuantity *quantity;
  /* entries, sorted by key: what a model file carries */
  PetscInt n_entries;
  char **key, **value;
};

/* Notes the entries constant_NAME, once all variables are known. */
PetscErrorCode HycoSceneReadConstants(HycoScene scene);
/* The expression of an entry, with the scene's constants put in. */
PetscErrorCode HycoSceneExpression(HycoScene scene, const char key[], const char text[], HycoExpr *expr);
/* Reads an entry of gravity or rotation; checks them. */
PetscErrorCode HycoSceneReadMotion(HycoScene scene, PetscInt entry);
PetscErrorCode HycoSceneCheckMotion(HycoScene scene);
/* Whether a body's mass makes a force, which changes with the parameters p with changed[p] (NULL: whether there is). */
PetscBool HycoSceneHasInertia(HycoScene scene, const HycoBody *body, const PetscBool changed[]);
PetscErrorCode HycoSceneDestroyMotion(HycoScene scene);
/* Reads an entry tie_NAME_...; checks all of them. */
PetscErrorCode HycoSceneReadTie(HycoScene scene, PetscInt entry, const char name[], PetscInt field);
PetscErrorCode HycoSceneCheckTies(HycoScene scene);
PetscErrorCode HycoSceneDestroyTies(HycoScene scene);
/* Reads an entry output_NAME_...; checks all of them. */
PetscErrorCode HycoSceneReadQuantity(HycoScene scene, PetscInt entry, const char name[], PetscInt field);
PetscErrorCode HycoSceneCheckQuantities(HycoScene scene);
/* Whether one of them is of kind `first` or of one from there to `last`. */
PetscBool HycoSceneAsks(HycoScene scene, HycoQuantityKind first, HycoQuantityKind last);
static inline PetscBool HycoSceneHasReactions(HycoScene scene)
{
  return HycoSceneAsks(scene, HYCO_QUANTITY_REACTION, HYCO_QUANTITY_REACTION);
}
/* Whether they need the bodies' fields, what contacts carry. */
static inline PetscBool HycoSceneAsksFields(HycoScene scene)
{
  return HycoSceneAsks(scene, HYCO_QUANTITY_MAX, HYCO_QUANTITY_REACTION);
}
static inline PetscBool HycoSceneAsksContacts(HycoScene scene)
{
  return HycoSceneAsks(scene, HYCO_QUANTITY_FORCE, HYCO_QUANTITY_PRESSURE);
}
/* Reads the history's entries, once the parameters are read. */
PetscErrorCode HycoSceneReadHistory(HycoScene scene);
/* Fails where the history reaches what must not change in time: the bodies' places, the rows of B. */
PetscErrorCode HycoSceneCheckHistory(HycoScene scene);
PetscErrorCode HycoSceneDestroyHistory(HycoScene scene);
/* "gap = 0.05, q2 = 40" */
void HycoSceneNamePoint(HycoScene scene, const PetscReal mu[], char at[HYCO_LINE]);
/* The variables at time t: the parameters mu (n_parameters), t, the tables' values; out has room for n_variables. */
void HycoSceneSetTime(HycoScene scene, const PetscReal mu[], PetscReal t, PetscReal out[]);
/* The first time after t at which a step ends: a listed one, or a row of a table. */
/* Fails where the history of a scene is not that which the model at `path` was trained with, naming what differs. */
PetscErrorCode HycoSceneCompareHistory(HycoScene trained, HycoScene scene, const char path[]);
PetscReal HycoSceneNextStop(HycoScene scene, PetscReal t);
PetscBool HycoIsVariableName(const char word[]);

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
