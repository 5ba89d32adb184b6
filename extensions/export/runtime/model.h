/* The data of an exported model. */
#ifndef HYCO_EXPORTED_MODEL
#define HYCO_EXPORTED_MODEL

#if defined(HYCO_EXPORTED)
#define DATA const
#else
#define DATA /* the exporter fills them */
#endif

enum { OK, OUTSIDE, DIVERGED, NO_MEMORY };                                             /* status */
enum { SUM, LARGEST, SMALLEST, CLOSED, PRESSURE, PRESSURE_SMALLEST, RESULTANT, WORK }; /* kinds of output */
enum { COMPONENT, NORM, MISES, PRINCIPAL }; /* what counts of an item; PRINCIPAL + k */

/* An output: a number for each of n items, combined as its kind says. The items are places with `width` values each,
   from value `first` on, or contacts, from `first` on in Model.contact; -1: always open. A RESULTANT: the value `width`
   (-1: 0) and the contacts' forces along axis `of`, from 3 on the moments around it, times the weights of the contacts
   minus those of the masters, which follow them by node. WORK: of friction, of blocks instead of contacts. */
typedef struct Output {
  int kind, of, n, width, first, weight; /* weight: place of the first in Model.weight; -1: all are 1, or as found */
} Output;

/* Places first .. first + n - 1, which have the flexibility (n x n) from `at` on in Model.flexibility, times a
   value. */
typedef struct {
  int first, n, value, at;
} Block;

enum { PRESCRIBED = -1, UNKNOWN = -2 };     /* instead of a place: moved by a support; not among the model's unknowns */
enum { WIDE = 3 * (1 + HYCO_FACET_NODES) }; /* entries of a row, at most */

/* The facets of a group, and of a master its border as HycoMasterSearch has it. */
typedef struct {
  PetscInt first, n, side, n_border, border, at_border; /* side: -1, of a mirrored body */
} Surface;

/* The contacts first .. first + n - 1: the nodes of a surface with their masters on another. */
typedef struct {
  PetscInt slave, master, first, n, edges; /* edges: as of HycoMasterSearch */
} Facing;

/* n_nodes 0: no surface moves. */
typedef struct {
  PetscInt dim, n_nodes, nf, nq, n_searches, n_facets; /* nodes and points of a facet; of the largest master */
  double around, touches;                              /* 2 pi in an axisymmetric scene; 0; gaps that are round-off */
  DATA double *w, *N, *dN;                             /* nq; nq x nf; nq x nf x 2 */
  DATA Surface *surface;
  DATA Facing *search;
  DATA double *reach;                    /* by search: of a master */
  DATA PetscInt *facet, *border, *slave; /* slave: the node of each */
  DATA PetscBool *at_border;
  DATA int *place, *given; /* n_nodes x dim; given: the value that is a prescribed displacement; -1: it is 0 */
  DATA int *pose;          /* by node: the first of nine values that turn its body; -1: none */
  DATA int *body, *map;    /* by node; by body and axis: the expression of its map in Model.code, -1: none */
  DATA double *drawn;      /* the nodes as drawn, n_nodes x 3 */
} Surfaces;

/* Expressions of a body that flows: the constants of its law, then these. */
enum { TEMPERATURE = 8, EXPANSION, REFERENCE, SLOTS };

/* Points first .. first + n - 1 of a body that flows: the rule of its law; alike: all have the expressions of the first
   one. */
typedef struct {
  int rule, first, n, alike;
} Flowing;

typedef struct {
  int n_parameters, n_atoms, n_functions, n_motions, n_places, n_stiffness, n_values, n_terms, n_outputs;
  int n_contacts, n_blocks;  /* n_places contacts, and no blocks, unless surfaces move */
  int areas;                 /* of contacts: the first of their values, unless surfaces move */
  int n_slip, n_tables;      /* blocks of contacts with friction, with the others; tables of a history */
  int n_stops;               /* times at which steps end as well */
  double tolerance, least;   /* of the KKT residual; the smallest step in time */
  DATA double *code;         /* expressions */
  DATA int *atom, *function; /* the expressions of the parameters, in code; n_functions x 4: see product() */
  DATA double *offset;       /* n_motions + n_places + n_values rows of n_functions: w and the values for z = 0 */
  DATA int *stiffness;       /* functions by which the next two are multiplied, n_stiffness of each */
  DATA double *W, *A;        /* lower triangle of n_places rows, where there are no blocks; n_motions x n_places */
  DATA int *value, *factor;  /* of n_terms: the value to which it adds, and its function */
  DATA double *term;         /* (n_motions + n_places + n_modes) x n_terms */
  DATA Output *output;
  DATA int *contact;
  DATA double *weight;
  DATA Block *block;
  DATA double *flexibility;
  Surfaces surfaces;
  DATA int *row, *coefficient; /* by block: its first row, with the end; the value that is its coefficient, -1: 0 */
  DATA int *normal;            /* by row: it is one; NULL: all are */
  DATA int *table;             /* by table: its first row, with the end; rows: */
  DATA double *table_t, *table_value, *stop;
  /* Bodies that flow: their modes; points with laws, those whose increments bound a step, those that give alpha, each
     part of the one before; components of their strains, which are the first values, point by point; what follows. */
  int n_modes, n_points, n_settled, n_chosen, n_strain, n_flowing, n_lost, newton_most;
  double newton_rtol, most_increment;
  DATA Flowing *flowing;
  DATA int *constant;             /* by these, SLOTS each: the expressions in code, -1: 0 */
  DATA double *point, *P, *T;     /* n_points x 3; like A, n_modes x n_places; n_chosen x n_strain x n_modes */
  DATA int *lost_value, *lost_at; /* of n_lost: the value that lacks a share of a component of what a stress has lost */
  DATA double *lost_share;
} Model;

/* What a step leaves for the next; of doubles alone, in the caller's memory. */
typedef struct {
  double *taken, *t, *t_before, *dt,
      *mu;                /* steps so far; times of the last two; size of the next, 0: any; parameters */
  double *z, *before;     /* motions and forces of the last; forces of the one before */
  double *place, *work;   /* by row: of tangents, how far they are from where they began; by block */
  double *alpha, *flowed; /* n_modes; of the laws, by point */
} State;

#endif
