/*
  HycoFE: the scene on one mesh at one parameter value. It moves the nodes, fixes the supports, evaluates materials and
  loads, and assembles K, F, B, D, stresses and norms over the cells it has: the whole mesh, a rank's part, or the RID.
*/
#ifndef HYCOFE_H
#define HYCOFE_H

#include <hycomesh.h>
#include <petscmat.h>

/* The most quadrature points of a cell. */
#define HYCO_CELL_POINTS 27

/* Shape functions at the quadrature points of the reference cell (or facet). */
typedef struct {
  PetscInt dim, nv, nq;
  PetscReal w[HYCO_CELL_POINTS], N[HYCO_CELL_POINTS][HYCO_CELL_NODES], dN[HYCO_CELL_POINTS][HYCO_CELL_NODES][3];
} HycoElement;

const HycoElement *HycoElementGet(HycoCellType type);
/* The facet of a cell type: a point, a line of two or three nodes, tri3 or tri6, quad4, quad8 or quad9. */
const HycoElement *HycoElementGetFacet(HycoCellType type);
/* The same with the nodes in place of the quadrature points, of weight 1; of second order but hex20, which no contact
   has; else NULL. */
const HycoElement *HycoElementGetFacetNodes(HycoCellType type);

#define HYCO_MAX_CELL_DOFS (3 * HYCO_CELL_NODES)
/* Of a cell with tied nodes: HycoMeshCellNodes(). */
#define HYCO_MAX_CELL_UNKNOWNS (3 * HYCO_MAX_CELL_NODES)

typedef struct _n_HycoFE *HycoFE;
typedef struct _n_HycoAssemblyMap *HycoAssemblyMap;
typedef struct _n_HycoSprings *HycoSprings;

/* What a uniform load gives to the nodes that carry it. */
typedef struct {
  PetscBool ready; /* for the nodes as they are */
  PetscInt n, *node;
  PetscReal *share; /* n x 4: the sum of n dS, of dS */
} HycoLoadShares;

/* A support along a direction, which takes the place of u_c: u_c = u0 + sum of a_d u_d at a node (oblique.c). */
typedef struct {
  PetscInt node, c, support; /* of the scene */
  PetscReal a[3];            /* 0 at c, and at others that take a place */
  PetscReal n[3];            /* its direction, of unit length */
} HycoOblique;

struct _n_HycoFE {
  /* borrowed */
  HycoScene scene;
  HycoMesh mesh;
  /* sizes: space dimension, n_nodes * dim, stress components */
  PetscInt dim, n_dof, n_sigma;
  HycoFormulation formulation; /* in 1D and 3D HYCO_PLANE_STRAIN */
  /* what no parameter reaches */
  PetscBool *constant; /* by cell: neither its nodes nor its material */
  PetscInt n_constant;
  PetscBool fixed_constant; /* the supports' values, and the nodes that they hold */
  PetscBool *bbar;          /* by body: the dilatation is the cells' mean */
  signed char *drawn_sign;  /* by cell: the sign of its volume in the mesh file's coordinates */
  /* of a cubature (borrowed; set before anything is assembled): how often each cell's integrals count; NULL: once.
     all_facets: loads act on facets whose cell the mesh does not have, too (2D, 3D) */
  const PetscReal *cell_weight;
  PetscBool all_facets;
  /* kept from one parameter value to the next */
  HycoAssemblyMap places; /* of the entries of K; made by the second assembly into it */
  PetscInt n_loads;
  HycoLoadShares *shares; /* n_loads: by load of the scene */
  /* -hyco_regularise: unknowns held beside the scene's supports; the motions (n_turned x n_dof, orthonormal) that the
     contacts' normals are turned to leave alone */
  PetscInt n_pins, *pin, n_turned;
  PetscReal *released;
  /* the parameters, and what the last HycoFESetParameters changed */
  PetscBool ready;
  PetscReal mu[HYCO_MAX_PARAMETERS];
  PetscBool stiffness_changed, contact_changed;
  PetscBool gap_changed; /* the contacts' gaps, or what the supports take from them */
  /* geometry at mu */
  PetscReal *X;         /* n_nodes x 3, moved nodes */
  PetscBool *mirrored;  /* by body: its map is a mirror image */
  PetscInt place;       /* of the nodes: a number that no other place has, on this process */
  PetscReal *kept;      /* by point, nv x 3 gradients and the weight at kept_place: HycoFEKeepGradients(); or NULL */
  PetscReal *kept_mean; /* the same by cell of the mean gradients, nv x 3; NULL: no body is bbar */
  PetscInt kept_place;
  /* supports at mu */
  PetscBool *fixed; /* n_dof */
  PetscReal *u0;    /* n_dof, prescribed displacement, 0 where free; of an oblique support the offset */
  PetscInt n_oblique, room_oblique, *oblique_at; /* by dof: which, or -1; only with n_oblique */
  HycoOblique *oblique;
  PetscBool lifted; /* whether any of u0 is not 0 */
  PetscBool plain; /* matrices are those of the displacements: neither oblique supports nor ties take a place in them */
  /* temperature and thermal strain at mu, by cell and integration point; NULL: no body has a temperature */
  PetscReal *temperature, *thermal;
  /* tangents at mu: those of cell e from tangent_start[e], tangent_size[body] reals for each of its points */
  PetscReal *tangent;
  PetscInt *tangent_start, *tangent_size;
  HycoSprings springs; /* at mu; NULL: the scene has none */
};

/* Of a body's cells: whether their tangents are Lame's lambda and mu, or else n_sigma x n_sigma. */
static inline PetscBool HycoFEIsIsotropic(HycoFE fe, PetscInt cell)
{
  return (PetscBool)(fe->tangent_size[fe->mesh->cell_body[cell]] == 2);
}

/* The unknowns of the whole mesh, where fe's is a part or a surface of it. */
static inline PetscInt HycoFEUnknowns(HycoFE fe)
{
  return fe->mesh->n_whole_nodes ? fe->mesh->n_whole_nodes * fe->dim : fe->n_dof;
}

PetscErrorCode HycoFECreate(HycoScene scene, HycoMesh mesh, HycoFE *fe);
PetscErrorCode HycoFEDestroy(HycoFE *fe);
/* For who comes to the same nodes again and again, as a path does: the shape functions' gradients are kept until the
   nodes move. */
PetscErrorCode HycoFEKeepGradients(HycoFE fe);
/* Puts the nodes where the file has them; for geometry alone. */
PetscErrorCode HycoFESetDrawn(HycoFE fe);
/* Fails for a cell without volume as drawn. */
PetscErrorCode HycoMeshCheckCells(HycoMesh mesh);
/* After HycoFESetParameters() on parts of a mesh: which bodies are mirrored is the same on all; fails where a map folds
   a body between them. Collective. */
PetscErrorCode HycoFEAgreeOnMirrors(MPI_Comm comm, HycoFE fe);
/* Brings everything to mu (length scene->n_variables), touching only what depends on what changed. */
PetscErrorCode HycoFESetParameters(HycoFE fe, const PetscReal mu[]);
/* What the parameters p with changed[p] reach: the bodies' maps, K, the rows of B, the gaps. */
typedef struct {
  PetscBool nodes, stiffness, rows, gaps;
} HycoChanges;
HycoChanges HycoSceneChanges(HycoScene scene, const PetscBool changed[]);
/* Which parameters (room for n_parameters) reach the stiffness or the contacts' rows. */
void HycoSceneReaches(HycoScene scene, PetscBool reaches[]);

/* A rigid motion of one connected part of the mesh: t + omega x (X - centre) / size. */
typedef struct {
  PetscInt part, body;
  PetscReal centre[3], size, rigid[6]; /* translations (dim), then rotations (2D: 1, 3D: 3) */
} HycoRigid;

/* Rigid motions that the supports leave free, an orthonormal basis of the kernel of K. */
typedef struct {
  PetscInt n;
  PetscReal *motion;       /* n x n_dof, zero where fixed */
  char (*name)[HYCO_LINE]; /* "body pellet from moving along (0, 0, 1)", "... from turning about (0, 0, 1) through (0,
                              10)" */
  HycoRigid *rigid;        /* n */
} HycoMotions;

/* Holds the unknowns `component` of the nodes with these tags (those that this mesh has) beside the scene's supports,
   in place of the last ones; n = 0: none. */
PetscErrorCode HycoFESetPins(HycoFE fe, PetscInt n, const PetscInt tag[], const PetscInt component[]);
/* Finds them on the mesh of which each process has a part; motion: of the part's unknowns. Collective. */
PetscErrorCode HycoFEFreeMotions(MPI_Comm comm, HycoFE fe, HycoMotions *motions);
PetscErrorCode HycoMotionsDestroy(HycoMotions *motions);
/* "body B from moving along ..." for the combination of motions with these coefficients. */
void HycoMotionsName(HycoFE fe, const HycoMotions *motions, const PetscReal coefficient[], char name[HYCO_LINE]);

/* Element stiffness of a cell, row major, nodes outer, components inner: of its body alone, for displacements, nv * dim
   square; with the springs on it, of the unknowns, which oblique supports and ties make others: of the nodes that
   HycoMeshCellNodes() gives (room for HYCO_MAX_CELL_UNKNOWNS square). */
PetscErrorCode HycoFEBodyStiffness(HycoFE fe, PetscInt cell, PetscReal Ke[]);
PetscErrorCode HycoFEElementStiffness(HycoFE fe, PetscInt cell, PetscReal Ke[]);

/* An empty, preallocated AIJ matrix for K or a norm over the nodes `n_owned` from `first` of the distributed numbering.
 */
PetscErrorCode HycoFECreateMatrix(HycoFE fe, MPI_Comm comm, PetscInt n_owned, PetscInt first, Mat *A);
/* K (11): rows and columns of fixed unknowns hold only their own diagonal. Local values only: no communication but the
   assembly's. */
PetscErrorCode HycoFEAssembleStiffness(HycoFE fe, Mat K);
/* F (12), with the lifting of the prescribed displacements: K u0 moved to the right, F_i = K_ii u0_i where fixed; and
   with what the thermal strains push, unless the scene has a history (HycoFEStep() has it in f_int). */
PetscErrorCode HycoFEAssembleForce(HycoFE fe, Vec F);
/* Of supports along a direction: the one in the place of an unknown, or NULL. Of these and of ties: brings
   displacements to be what they are at these places (u: n_dof); nodal forces to be those of the unknowns, T^T f. All at
   fe's parameters. */
const HycoOblique *HycoFEOblique(HycoFE fe, PetscInt dof);
void HycoFEComplete(HycoFE fe, PetscReal u[]);
void HycoFEGeneralise(HycoFE fe, PetscReal f[]);
/* Of ties alone: nodal forces of tied nodes pass to what they follow, and none is left at them. */
void HycoFEPassTied(HycoFE fe, PetscReal f[]);
/* Whether a support fixes an unknown, not a tie. */
static inline PetscBool HycoFESupports(HycoFE fe, PetscInt dof)
{
  return (PetscBool)(fe->fixed[dof] && HycoMeshTied(fe->mesh, dof / fe->dim) < 0);
}
/* The loads at all of fe's unknowns (n_dof; a part has all of its own nodes'), fixed ones too, without lifting. */
PetscErrorCode HycoFELoads(HycoFE fe, PetscReal f[]);
/* The forces of supports on the fixed unknowns (r: n_dof, 0 at the others; right at the nodes that this process owns):
   f_int less the loads, where no contact presses. f_int: NULL: K u. Of an oblique support the component c of its
   force, whose others are -a_d times that. */
PetscErrorCode HycoFEReactions(HycoFE fe, const PetscReal u[], const PetscReal f_int[], PetscReal r[]);
/* The norm matrix of H1: mass plus length^2 times gradient, fixed unknowns as in K. The length, of the whole mesh
   (HycoMeshLength()), keeps the norm the same in any unit; it is 1 in the paper's section 6. */
PetscErrorCode HycoFEAssembleH1(HycoFE fe, PetscReal length, Mat M);

/* Stress of u (n_dof, local order) by the elastic tangents, without the thermal strain's, averaged over each cell:
   sigma n_cells x n_sigma. */
PetscErrorCode HycoFEStress(HycoFE fe, const PetscReal u[], PetscReal sigma[]);
/* The volumes of the cells, of the full circle in an axisymmetric scene. */
PetscErrorCode HycoFEVolumes(HycoFE fe, PetscReal volume[]);
/* What the body forces give to a cell's unknowns (f: nv x dim, added to). */
PetscErrorCode HycoFEBodyForce(HycoFE fe, PetscInt cell, PetscReal f[]);
/* Elastic energy of each cell: 1/2 u^T K u without thermal strains and springs. */
PetscErrorCode HycoFEEnergy(HycoFE fe, const PetscReal u[], PetscReal energy[]);
/* What the energy identity of a linear scene has beside F.u where there is thermal strain e, of each cell: the integral
   of e : C : (e - 2 eps(u)). */
PetscErrorCode HycoFEHeatWork(HycoFE fe, const PetscReal u[], PetscReal work[]);

/* Springs to the ground (springs.c), at fe's parameters: f += scale (-K u), what they do to the unknowns (n_dof; a part
   has all of its own nodes'); their energy u^T K u / 2, of those that count on this process. */
void HycoSpringsAddForces(HycoFE fe, PetscReal scale, const PetscReal u[], PetscReal f[]);
PetscReal HycoSpringsEnergy(HycoFE fe, const PetscReal u[]);
/* Each that counts on this process: its number in the scene, its n nodes, its matrix (n dim square, row major). */
typedef PetscErrorCode (*HycoSpringVisit)(HycoFE fe, PetscInt spring, PetscInt n, const PetscInt node[],
                                          const PetscReal K[], void *ctx);
PetscErrorCode HycoSpringsVisit(HycoFE fe, HycoSpringVisit visit, void *ctx);

#endif
