/* The scene's parts: expressions, bodies, supports, loads, contacts; and the storage of its entries. */
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
/* Whether two expressions have the same text, or both are NULL. */
PetscBool HycoExprAlike(HycoExpr a, HycoExpr b);
/* The place of an evaluation, for messages: the coordinates, and the parameters in the expression. */
PetscErrorCode HycoExprPlace(HycoExpr expr, const PetscReal mu[], const PetscReal xyz[3], char place[HYCO_LINE]);
/* Values at n points (n x 3 coordinates) and mu; fails for a value that is not finite. */
PetscErrorCode HycoExprEval(HycoExpr expr, const PetscReal mu[], PetscInt n, const PetscReal xyz[], PetscReal value[]);
/* The same for an expression that may contain `temperature`, n values; NULL if it does not. */
PetscErrorCode HycoExprEvalHot(HycoExpr expr, const PetscReal mu[], PetscInt n, const PetscReal xyz[],
                               const PetscReal temperature[], PetscReal value[]);
/* Whether x, y or z appears; whether any parameter p with changed[p] does. NULL-safe (false). */
PetscBool HycoExprInSpace(HycoExpr expr);
/* Whether `temperature` appears, which only constants of laws and the expansion may contain. NULL-safe. */
PetscBool HycoExprInHeat(HycoExpr expr);
/* Fails if it appears. */
PetscErrorCode HycoExprRefuseHeat(HycoExpr expr);
PetscBool HycoExprChanges(HycoExpr expr, const PetscBool changed[]);
const char *HycoExprKey(HycoExpr expr);

/* Entries of the scene that a law or a contact type declares. */
#define HYCO_MAX_DECLARED 32
typedef struct {
  char *name, *title; /* "young", "Young's modulus" */
  HycoEntryKind kind;
  PetscBool required;
  HycoExpr expr;    /* of an expression given in the scene */
  char *text;       /* of a group, a text */
  PetscBool heat;   /* its expression may contain `temperature` */
  PetscBool law;    /* of a contact: belongs to its law, so that the rows of B do not depend on it */
  PetscReal value;  /* of a length, or if the scene gives no expression */
  PetscReal lo, hi; /* of a law's constant: open interval */
} HycoEntry;
typedef struct {
  PetscInt n;
  HycoEntry entry[HYCO_MAX_DECLARED];
} HycoDeclared;

/* Adds an entry; `declared` owns it. */
PetscErrorCode HycoDeclaredAdd(HycoDeclared *declared, const char name[], const char title[], HycoEntryKind kind,
                               PetscBool required, HycoEntry **entry);
/* In upper or lower case; NULL: there is none. */
HycoEntry *HycoDeclaredFind(HycoDeclared *declared, const char name[]);
/* Reads the scene's entry `key`. */
PetscErrorCode HycoDeclaredRead(HycoScene scene, const char key[], const char text[], HycoEntry *entry);
/* Whether an expression other than that of the entry `except` and those of laws (NULL: any) changes with the parameters
   p with changed[p]. */
PetscBool HycoDeclaredChanges(const HycoDeclared *declared, const char except[], const PetscBool changed[]);
PetscErrorCode HycoDeclaredView(const HycoDeclared *declared, PetscViewer viewer);
PetscErrorCode HycoDeclaredDestroy(HycoDeclared *declared);

typedef struct {
  char *name;
  HycoMaterial law;
  PetscBool bbar;    /* mean dilatation (B-bar) instead of the dilatation at each point */
  PetscBool element; /* whether the scene gives the element; if not, HycoFE chooses by the law */
  HycoExpr map[3];   /* moved coordinates; NULL: not moved */
  HycoExpr force[3]; /* body force per unit volume; NULL: none */
  HycoExpr density;  /* mass per unit volume, for gravity and rotation; NULL: none */
  HycoExpr temperature, reference, expansion; /* K; thermal strain expansion (temperature - reference); NULL: none */
} HycoBody;

typedef struct {
  char *group;
  HycoExpr value[3];             /* prescribed displacement of component c; NULL: free */
  HycoExpr normal, direction[3]; /* prescribed displacement along a direction; NULL: none */
} HycoFixed;

typedef struct {
  char *group;
  HycoExpr pressure;    /* positive: acts against the outward normal; NULL: none */
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

/* Two surfaces tied together: the slave's nodes follow the master's facets. */
typedef struct {
  char *name, *slave, *master;
  PetscReal tolerance; /* largest distance in the mesh file; negative: derived from the slave's facets */
  PetscBool mortar; /* a slave follows its mean over the facets around it, by the integrals of mortar contacts; else the
                          nearest point */
} HycoTie;

/* The formulation of a 2D scene: plane strain (thickness 1, eps_zz = 0), plane stress (sigma_zz = 0), or a body of
   revolution about x = 0: x is the radius, y the axis, zz the hoop; all integrals are over the full circle. */
typedef enum { HYCO_PLANE_STRAIN, HYCO_PLANE_STRESS, HYCO_AXISYMMETRIC } HycoFormulation;

/* An output of the scene, a number for each solution: the largest, smallest or mean value of a field over a group;
   the force of supports along an axis; from HYCO_QUANTITY_FORCE on, a result of a contact: its resultant along an
   axis, its moment about one, the tangential resultant along an axis or the work of friction, its closed area, its
   largest and smallest pressure. */
typedef enum {
  HYCO_QUANTITY_MAX,
  HYCO_QUANTITY_MIN,
  HYCO_QUANTITY_MEAN,
  HYCO_QUANTITY_REACTION,
  HYCO_QUANTITY_FORCE,
  HYCO_QUANTITY_MOMENT,
  HYCO_QUANTITY_FRICTION,
  HYCO_QUANTITY_AREA,
  HYCO_QUANTITY_PRESSURE,
  HYCO_QUANTITY_PRESSURE_MIN
} HycoQuantityKind;
/* Over the listed times of a path: the least of an output that is a minimum, else the largest; or what `path`
   states. */
typedef enum { HYCO_EXTREME_OWN, HYCO_EXTREME_MAX, HYCO_EXTREME_MIN, HYCO_EXTREME_ABSOLUTE } HycoExtreme;
typedef struct {
  char *name, *group; /* group NULL: all of the mesh */
  char *contact;      /* NULL: all contacts */
  char *unit;         /* from the scene's units; "": not known */
  PetscBool given;    /* the kind and the field are given */
  HycoQuantityKind kind;
  PetscInt field; /* index in HycoQuantityFields; along or about an axis 0 to 2; HYCO_FRICTION_WORK */
  HycoExtreme path;
} HycoQuantity;
extern const char *const HycoQuantityFields[]; /* NULL ends */
#define HYCO_FRICTION_WORK 3
/* What it is, whatever the units: works include moments. */
typedef enum {
  HYCO_DIMENSION_LENGTH,
  HYCO_DIMENSION_STRESS,
  HYCO_DIMENSION_FORCE,
  HYCO_DIMENSION_WORK,
  HYCO_DIMENSION_AREA
} HycoDimension;
HycoDimension HycoQuantityDimension(const HycoQuantity *quantity);
/* Its unit, from those of the scene; "": not known. */
void HycoQuantityUnit(HycoScene scene, const HycoQuantity *quantity, char unit[HYCO_LINE]);

/* -- begin: in exported models too -- */
/* A time table: linear between its rows, constant before the first and after the last. */
typedef struct {
  PetscInt n;
  const PetscReal *t, *value;
} HycoTimeTable;

/* Linear between the rows; before the first and after the last row the value stays. */
static inline PetscReal HycoTableValue(const HycoTimeTable *table, PetscReal t)
{
  PetscInt k = 0;

  /* At a row's time its value exactly. */
  while (k < table->n && table->t[k] <= t) k++;
  if (k == 0) return table->value[0];
  if (k == table->n) return table->value[k - 1];
  return table->value[k - 1] +
         (table->value[k] - table->value[k - 1]) * ((t - table->t[k - 1]) / (table->t[k] - table->t[k - 1]));
}
/* -- end: in exported models too -- */

/* The kinds of unit of the fields. */
enum { HYCO_UNIT_LENGTH, HYCO_UNIT_FORCE, HYCO_UNIT_STRESS, HYCO_N_UNITS };

struct _p_HycoScene {
  PETSCHEADER(int);
  PetscOptions options; /* every entry, those of the command line included */
  PetscBool *shared; /* by entry: an option of PETSc's solvers, which is in the global options while the scene exists */
  char *title, *mesh_path, *unit[HYCO_N_UNITS]; /* units: notes, "" where the scene has none */
  DM dm;                                        /* the mesh of a calling program; NULL: mesh_path */
  PetscBool face_nodes;                         /* rank 0, once the mesh is read: its hex20 cells are read as hex27 */
  PetscInt refine;                              /* how often the mesh's cells are halved */
  HycoFormulation formulation;
  char *folder; /* folder of the entries' relative paths */
  /* parameters */
  PetscInt n_parameters;
  PetscInt n_variables; /* variables of expressions: the parameters; with a history also t and its tables' values */
  char *parameter[HYCO_MAX_PARAMETERS]; /* names of the variables, the parameters' first */
  PetscReal lo[HYCO_MAX_PARAMETERS], hi[HYCO_MAX_PARAMETERS];
  PetscBool wide[HYCO_MAX_PARAMETERS]; /* a positive stiffness over more than a decade: its logarithm is sampled */
  PetscBool extrapolate;               /* values outside the ranges are accepted */
  /* history; without one n_times is 0 */
  PetscInt n_times, n_tables;
  PetscReal *times; /* increasing; the first is the start of the path */
  HycoTimeTable table[HYCO_MAX_PARAMETERS];
  /* names of constants; their expressions are the entries' texts */
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
  /* entries, sorted by key, as in a model file */
  PetscInt n_entries;
  char **key, **value;
};

/* The value of parameter p at a share of the way from lo to hi, of scene->wide ones of their logarithms. */
PetscReal HycoSceneBetween(HycoScene scene, PetscInt p, PetscReal lo, PetscReal hi, PetscReal share);

/* Registers the entries constant_NAME, once all variables are known. */
PetscErrorCode HycoSceneReadConstants(HycoScene scene);
/* The expression of an entry, with the scene's constants substituted. */
PetscErrorCode HycoSceneExpression(HycoScene scene, const char key[], const char text[], HycoExpr *expr);
/* Reads an entry of gravity or rotation; checks all of them. */
PetscErrorCode HycoSceneReadMotion(HycoScene scene, PetscInt entry);
PetscErrorCode HycoSceneCheckMotion(HycoScene scene);
/* Whether a body's mass causes a force that changes with the parameters p with changed[p] (NULL: any force). */
PetscBool HycoSceneHasInertia(HycoScene scene, const HycoBody *body, const PetscBool changed[]);
PetscErrorCode HycoSceneDestroyMotion(HycoScene scene);
/* Reads an entry tie_NAME_...; checks all of them. */
PetscErrorCode HycoSceneReadTie(HycoScene scene, PetscInt entry, const char name[], PetscInt field);
PetscErrorCode HycoSceneCheckTies(HycoScene scene);
PetscErrorCode HycoSceneDestroyTies(HycoScene scene);
/* Reads an entry output_NAME_...; checks all of them. */
PetscErrorCode HycoSceneReadQuantity(HycoScene scene, PetscInt entry, const char name[], PetscInt field);
PetscErrorCode HycoSceneCheckQuantities(HycoScene scene);
/* Whether the scene has a quantity of kind `first`, or of a kind from `first` to `last`. */
PetscBool HycoSceneHasOutputs(HycoScene scene, HycoQuantityKind first, HycoQuantityKind last);
PetscBool HycoSceneHasReactions(HycoScene scene);
/* Whether the quantities need the bodies' fields; the results of contacts. */
PetscBool HycoSceneHasFieldOutputs(HycoScene scene);
PetscBool HycoSceneHasContactOutputs(HycoScene scene);
/* Calls `visit` for each group of the mesh that the scene names, as often as it does, with the entry's key for
   messages; ends at the first error. Not collective. */
typedef PetscErrorCode (*HycoGroupVisitor)(const char key[], const char name[], void *context);
PetscErrorCode HycoSceneVisitGroups(HycoScene scene, HycoGroupVisitor visit, void *context);
/* Reads the history's entries, once the parameters are read. */
PetscErrorCode HycoSceneReadHistory(HycoScene scene);
/* Fails if time changes what must be constant: the bodies' places, the rows of B. */
PetscErrorCode HycoSceneCheckHistory(HycoScene scene);
PetscErrorCode HycoSceneDestroyHistory(HycoScene scene);
/* "gap = 0.05, q2 = 40" */
void HycoSceneNamePoint(HycoScene scene, const PetscReal mu[], char at[HYCO_LINE]);
/* The variables at time t: the parameters mu (n_parameters), t, the tables' values; out has room for n_variables. */
void HycoSceneSetTime(HycoScene scene, const PetscReal mu[], PetscReal t, PetscReal out[]);
/* The first time after t at which a step ends: a listed one, or a row of a table. */
PetscReal HycoSceneNextStop(HycoScene scene, PetscReal t);
/* The history's entries, one line "key value" each; the caller frees *text (PetscFree). Without a history: empty. */
PetscErrorCode HycoSceneWriteHistory(HycoScene scene, char **text);
/* Fails if the history of a scene differs from that of the file at `path`, which stored the lines made[] of
   HycoSceneWriteHistory(), and names the difference. */
PetscErrorCode HycoSceneCompareHistory(HycoScene scene, const char made[], const char path[]);
PetscBool HycoIsVariableName(const char word[]);

/* Builds a scene from n (key, value) entries; `folder`: folder of a relative mesh path. */
/* Gives an object the scene's options, with what the global ones say now, and its prefix. Not collective. */
PetscErrorCode HycoSceneGiveOptions(HycoScene scene, PetscObject object);
PetscErrorCode HycoSceneFromEntries(MPI_Comm comm, PetscInt n, char *const key[], char *const value[],
                                    const char folder[], HycoScene *scene);
/* The entries as text, one "key\tvalue" per line, and back. The caller frees the text. */
PetscErrorCode HycoSceneToText(HycoScene scene, char **text);
PetscErrorCode HycoSceneFromText(MPI_Comm comm, const char text[], HycoScene *scene);
/* The range of each parameter covered by n points (n x n_parameters): from the least to the largest value, plus half
   the widest step between two values at either end, so that grids of cell centres cover the ranges; clipped to the
   ranges. */
PetscErrorCode HycoSamplesReach(HycoScene scene, PetscInt n, const PetscReal mu[], PetscReal lo[], PetscReal hi[]);
/* The scene of a set of points. Borrowed. */
PetscErrorCode HycoSamplesGetScene(HycoSamples samples, HycoScene *scene);
/* A hash of everything that determines a full-order solution: entries (except hyco_ ones) and the mesh file's bytes.
   Collective. */
PetscErrorCode HycoSceneFingerprint(HycoScene scene, unsigned long long *hash);

#endif
