/*
  HycoFE: the scene on one mesh at one parameter value. It moves the nodes, fixes the supports, evaluates materials and
  loads, and assembles K, F, B, D, stresses and norms over the cells of a DM: the whole mesh, a rank's part, or the
  RID.
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
/* The same with the nodes as quadrature points, of weight 1; for facets of second order, except those of hex20,
   which contacts do not support; else NULL. */
const HycoElement *HycoElementGetFacetNodes(HycoCellType type);
/* The functions and their derivatives of a facet of second order with nf nodes at a point of its reference facet: a
   line and quadrilaterals on [-1, 1], triangles with the corners (0, 0), (1, 0), (0, 1). */
void HycoFacetFunctions(PetscInt nf, const PetscReal at[2], PetscReal N[HYCO_FACET_NODES],
                        PetscReal dN[HYCO_FACET_NODES][3]);

#define HYCO_MAX_CELL_DOFS (3 * HYCO_CELL_NODES)
/* For a cell with tied nodes: HycoMeshCellNodes(). */
#define HYCO_MAX_CELL_UNKNOWNS (3 * HYCO_MAX_CELL_NODES)

typedef struct _n_HycoFE *HycoFE;
typedef struct _n_HycoAssemblyMap *HycoAssemblyMap;
typedef struct _n_HycoSprings *HycoSprings;

/* Nodal forces of a uniform load on a surface. */
typedef struct {
  PetscBool ready; /* computed for the current nodes */
  PetscInt n, *node;
  PetscReal *share; /* n x 4: sums of n dS (3) and of dS at each node */
} HycoLoadShares;

/* A support along a direction, which eliminates u_c: u_c = u0 + sum of a_d u_d at a node (oblique.c). */
typedef struct {
  PetscInt node, c, support; /* support: index in the scene */
  PetscReal a[3];            /* 0 at c, and at other eliminated components */
  PetscReal n[3];            /* unit vector of the direction */
} HycoOblique;

struct _n_HycoFE {
  HycoScene scene;  /* borrowed */
  DM dm;            /* NULL: of HycoFECreateRead() */
  HycoMesh mesh;    /* its tables, borrowed from it; or surface */
  HycoMesh surface; /* of HycoFECreateSurface(): the tables without cells, whose arrays are the DM's; else NULL */
  /* sizes: space dimension, n_nodes * dim, stress components */
  PetscInt dim, n_dof, n_sigma;
  HycoFormulation formulation; /* in 1D and 3D HYCO_PLANE_STRAIN */
  /* what no parameter changes */
  PetscBool *constant; /* by cell: neither its nodes nor its material change */
  PetscInt n_constant;
  PetscBool fixed_constant; /* the supports' values and nodes do not change */
  PetscBool *bbar;          /* by body: mean dilatation of each cell (B-bar) */
  signed char *drawn_sign;  /* by cell: the sign of its volume in the mesh file's coordinates */
  /* for a cubature (borrowed; set before anything is assembled): weight of each cell's integrals; NULL: 1.
     all_facets: loads also act on facets whose cell is not in the mesh (2D, 3D); heat_is_load: with a history too,
     forces of thermal strains are loads, with elastic tangents */
  const PetscReal *cell_weight;
  PetscBool all_facets, heat_is_load;
  PetscBool without_cells; /* tangents, heat and springs stay those of a former mu, heat is no load */
  PetscBool keeps_sides;   /* maps mirror what they did: parameters stay close to those of the first call */
  PetscBool *on_surface;   /* by node: it moves, as HycoFEUseSurfaces() wants; NULL: all do */
  /* kept from one parameter value to the next */
  HycoAssemblyMap places; /* positions of the element entries in K; created by the second assembly */
  PetscInt n_loads;
  HycoLoadShares *shares; /* n_loads: by load of the scene */
  /* -hyco_regularise: unknowns fixed in addition to the scene's supports; the motions (n_turned x n_dof,
     orthonormal) that the contacts' normals are turned not to resist */
  PetscInt n_pins, *pin, n_turned;
  PetscReal *released;
  /* the parameters, and what the last HycoFESetParameters() changed */
  PetscBool ready;
  PetscReal mu[HYCO_MAX_PARAMETERS];
  PetscBool stiffness_changed, contact_changed;
  PetscBool gap_changed;   /* the gaps of the contacts, or the supports' contribution to them, have changed */
  PetscBool supports_only; /* the latter alone */
  /* geometry at mu */
  PetscReal *X;         /* n_nodes x 3, moved nodes */
  PetscBool *mirrored;  /* by body: its map reverses orientation */
  PetscInt place;       /* of the nodes: a number that is unique on this process for each position of the nodes */
  PetscInt *moved_at;   /* by body: the place at which its nodes moved last */
  PetscBool joint;      /* cells have nodes of other bodies: a body's map moves them too */
  PetscInt drawn;       /* the same, of the nodes, normals and gaps of contacts; 0: not at a parameter value */
  PetscReal *kept;      /* gradients (nv x 3) and weight of each point, computed at kept_place:
                           HycoFEKeepGradients(); or NULL */
  PetscReal *kept_mean; /* mean gradients of each cell, nv x 3; NULL: no body uses bbar */
  PetscInt kept_place;
  PetscReal *lanes; /* the same for several cells at once, computed at lanes_place (linear_fields.c); or NULL */
  PetscInt lanes_place;
  PetscReal **kept_stiffness; /* by cell: of the forces of prescribed displacements, made at kept_at, which `stiffened`
                                 counts: HycoFEKeepStiffness(); or NULL */
  PetscInt *kept_at, stiffened;
  PetscReal *weight; /* of each point, and by cell the place at which HycoPointWeights() found them; or NULL */
  PetscInt *weighed_at;
  /* supports at mu */
  PetscBool *fixed; /* n_dof */
  PetscReal *u0;    /* n_dof: prescribed displacement, 0 where free; the offset of an oblique support */
  PetscInt n_oblique, room_oblique, *oblique_at; /* by dof: index in oblique, or -1; allocated if n_oblique > 0 */
  HycoOblique *oblique;
  PetscBool lifted; /* whether any entry of u0 is not 0 */
  PetscBool plain;  /* matrices are those of the displacements: oblique supports and ties are not eliminated */
  /* temperature and thermal strain at mu, by cell and integration point; NULL: no body has a temperature */
  PetscReal *temperature, *thermal;
  /* tangents at mu: those of cell e from tangent_start[e], tangent_size[body] reals for each of its points */
  PetscReal *tangent;
  PetscInt *tangent_start, *tangent_size;
  HycoSprings springs; /* at mu; NULL: the scene has no springs */
  PetscReal *room;     /* for element matrices: HycoFEElementRoom() */
  size_t n_room;
};

/* Whether the tangents of a cell's body are Lame's lambda and mu, or else n_sigma x n_sigma. */
static inline PetscBool HycoFEIsIsotropic(HycoFE fe, PetscInt cell)
{
  return (PetscBool)(fe->tangent_size[fe->mesh->cell_body[cell]] == 2);
}

/* The number of unknowns of the whole mesh, also where fe's mesh is a part or a surface of it. */
static inline PetscInt HycoFEUnknowns(HycoFE fe)
{
  return fe->mesh->n_whole_nodes ? fe->mesh->n_whole_nodes * fe->dim : fe->n_dof;
}

/* The scene on a DM: the whole mesh distributed over its ranks, a rank's surfaces, an RID, other submeshes, or a DMPlex
   of the caller, whose labels are the scene's groups. Collective on the DM if it has no tables yet (HycoMeshOf()). */
PetscErrorCode HycoFECreate(HycoScene scene, DM dm, HycoFE *fe);
/* On its nodes and facets alone, without the cells and their materials. */
PetscErrorCode HycoFECreateSurface(HycoScene scene, DM dm, HycoFE *fe);
/* On the tables of a file just read (borrowed), before they become a DM: a tie's weights are part of the topology. */
PetscErrorCode HycoFECreateRead(HycoScene scene, HycoMesh mesh, HycoFE *fe);
PetscErrorCode HycoFEDestroy(HycoFE *fe);
/* Before the first HycoFESetParameters(): only the surfaces are needed, at parameters close to each other. Later nodes
   of no facet, tie or support are where the mesh file has them. */
PetscErrorCode HycoFEUseSurfaces(HycoFE fe);
/* Keeps the gradients of the shape functions until the nodes move: for paths, which evaluate the same nodes many
   times. */
PetscErrorCode HycoFEKeepGradients(HycoFE fe);
/* Keeps the stiffness of cells with prescribed displacements until nodes or moduli change: for an fe of few cells. */
PetscErrorCode HycoFEKeepStiffness(HycoFE fe);
/* Puts the nodes at their coordinates in the mesh file; for geometry only. */
PetscErrorCode HycoFESetDrawn(HycoFE fe);
/* Fails for a cell whose volume in the mesh file is zero. */
PetscErrorCode HycoMeshCheckCells(HycoMesh mesh);
/* After HycoFESetParameters() on the parts of a mesh: makes the mirrored bodies the same on all ranks. Fails if a
   map folds a body across parts. Collective. */
PetscErrorCode HycoFEAgreeOnMirrors(MPI_Comm comm, HycoFE fe);
/* Updates everything to mu (length scene->n_variables); recomputes only what depends on the parameters that changed. */
PetscErrorCode HycoFESetParameters(HycoFE fe, const PetscReal mu[]);
/* What the parameters p with changed[p] affect: the bodies' maps, K, the rows of B, the gaps. */
typedef struct {
  PetscBool nodes, stiffness, rows, gaps;
} HycoChanges;
HycoChanges HycoSceneChanges(HycoScene scene, const PetscBool changed[]);
/* Whether they change the entries of the loads, inertia included. */
PetscBool HycoSceneLoadsChange(HycoScene scene, const PetscBool changed[]);
/* Whether they change the map of a body. */
PetscBool HycoBodyMoves(const HycoBody *body, const PetscBool changed[]);
/* Whether they change the values or directions of supports with nodes in a mesh (NULL: of any); moved: they move
   nodes. */
PetscBool HycoSceneSupportsChange(HycoScene scene, HycoMesh on, const PetscBool changed[], PetscBool moved);
/* Whether they change F: loads, supports, heat, and what moves or stiffens. */
PetscBool HycoSceneForcesChange(HycoScene scene, const PetscBool changed[]);
/* Which parameters (room for n_parameters) affect the stiffness or the contacts' rows. */
void HycoSceneReaches(HycoScene scene, PetscBool reaches[]);

/* A rigid motion of one connected part of the mesh: t + omega x (X - centre) / size. */
typedef struct {
  PetscInt part, body;
  PetscReal centre[3], size, rigid[6]; /* translations (dim), then rotations (2D: 1, 3D: 3) */
} HycoRigid;

/* Rigid motions that the supports leave free: an orthonormal basis of the null space of K. */
typedef struct {
  PetscInt n;
  PetscReal *motion;       /* n x n_dof, zero where fixed */
  char (*name)[HYCO_LINE]; /* "body pellet from moving along (0, 0, 1)", "... from turning about (0, 0, 1) through (0,
                              10)" */
  HycoRigid *rigid;        /* n */
  PetscInt *part;          /* by node: the connected part that it is in, numbered over all processes */
} HycoMotions;

/* row[n]: component c at x of the n rigid motions, which it returns: translations, then turns. */
PetscInt HycoRigidRow(PetscInt dim, const PetscReal x[3], PetscInt c, PetscReal row[6]);
/* Component c of a rigid motion at x. */
PetscReal HycoRigidAt(const HycoRigid *rigid, PetscInt dim, const PetscReal x[3], PetscInt c);

/* Fixes the unknowns `component` of the nodes with these tags (those that this mesh has) in addition to the scene's
   supports, and replaces the previous ones; n = 0: none. */
PetscErrorCode HycoFESetPins(HycoFE fe, PetscInt n, const PetscInt tag[], const PetscInt component[]);
/* Finds them on the distributed mesh; motion: of the unknowns of this process's part. Collective. */
PetscErrorCode HycoFEFreeMotions(MPI_Comm comm, HycoFE fe, HycoMotions *motions);
/* The same without the springs, which then hold nothing. */
PetscErrorCode HycoFEUnsupportedMotions(MPI_Comm comm, HycoFE fe, HycoMotions *motions);
/* Of a process's own mesh of cells around supports and loads, whose nodes are in these parts (part: by node). */
PetscErrorCode HycoFEMotionsOfParts(HycoFE fe, PetscInt n_parts, const PetscInt part[], HycoMotions *motions);
PetscErrorCode HycoMotionsDestroy(HycoMotions *motions);
/* "body B from moving along ..." for the combination of motions with these coefficients. */
void HycoMotionsName(HycoFE fe, const HycoMotions *motions, const PetscReal coefficient[], char name[HYCO_LINE]);

/* Element stiffness of a cell, row major, nodes outer, components inner. HycoFEBodyStiffness(): of its body only,
   for displacements, nv * dim square. HycoFEElementStiffness(): with its springs, of the unknowns after oblique
   supports and ties are eliminated, square over the unknowns at the nodes that HycoMeshCellNodes() returns.
   HycoFEElementRoom(): room for it, which belongs to fe, until the next call. */
PetscErrorCode HycoFEBodyStiffness(HycoFE fe, PetscInt cell, PetscReal Ke[]);
PetscErrorCode HycoFEElementRoom(HycoFE fe, PetscInt cell, PetscReal **Ke);
PetscErrorCode HycoFEElementStiffness(HycoFE fe, PetscInt cell, PetscReal Ke[]);
/* The terms of HycoFEElementStiffness() that this process counts, for sums over all processes: of the body if it owns
   the cell's first node, and its springs. */
PetscErrorCode HycoFECountedStiffness(HycoFE fe, PetscInt cell, PetscReal Ke[]);

/* Creates an empty, preallocated AIJ matrix for K or a norm over the nodes `n_owned` from `first` of the distributed
   numbering. */
PetscErrorCode HycoFECreateMatrix(HycoFE fe, MPI_Comm comm, PetscInt n_owned, PetscInt first, Mat *A);
/* K (11): rows and columns of fixed unknowns have only their own diagonal. Sets local values only; the assembly
   alone communicates. */
PetscErrorCode HycoFEAssembleStiffness(HycoFE fe, Mat K);
/* F (12), with the lifting of the prescribed displacements: K u0 moved to the right-hand side, F_i = K_ii u0_i where
   fixed; and with the forces of thermal strains, unless the scene has a history (HycoFEStep() then has them in
   f_int) and heat_is_load is not set. */
PetscErrorCode HycoFEAssembleForce(HycoFE fe, Vec F);
/* For supports along a direction: the support that eliminates an unknown, or NULL. For these and for ties: sets the
   eliminated displacements from the others (u: n_dof); transforms nodal forces to those of the unknowns, T^T f. All
   at fe's parameters. */
const HycoOblique *HycoFEOblique(HycoFE fe, PetscInt dof);
void HycoFEComplete(HycoFE fe, PetscReal u[]);
void HycoFEGeneralise(HycoFE fe, PetscReal f[]);
/* For ties only: adds nodal forces of tied nodes to their masters, and sets them to 0 at the tied nodes. */
void HycoFEPassTied(HycoFE fe, PetscReal f[]);
/* Whether a support (not a tie) fixes an unknown. */
static inline PetscBool HycoFESupports(HycoFE fe, PetscInt dof)
{
  return (PetscBool)(fe->fixed[dof] && HycoMeshTied(fe->mesh, dof / fe->dim) < 0);
}
/* The loads on all of fe's unknowns (n_dof; complete on the nodes that a part owns), fixed ones too, without
   lifting. */
PetscErrorCode HycoFELoads(HycoFE fe, PetscReal f[]);
/* The forces of supports on the fixed unknowns (r: n_dof, 0 at the others; valid at the nodes that this process
   owns): f_int minus the loads, where no contact presses. f_int: NULL: K u. For an oblique support, the component c
   of its force; the others are -a_d times it. */
PetscErrorCode HycoFEReactions(HycoFE fe, const PetscReal u[], const PetscReal f_int[], PetscReal r[]);
/* K u minus the loads at the free unknowns (r: n_dof, 0 at fixed ones, whose displacements are those prescribed at fe's
   parameters; complete on the nodes that a part owns). held: without the cells that have no fixed unknown, whose part
   depends on the parameters by nodes and stiffnesses alone. */
PetscErrorCode HycoFEImbalance(HycoFE fe, const PetscReal u[], PetscBool held, PetscReal r[]);
/* The norm matrix of H1: mass plus length^2 times gradient, fixed unknowns as in K. The length is that of the whole
   mesh (HycoMeshLength()), so that the norm does not depend on the unit; it is 1 in the paper's section 6. */
PetscErrorCode HycoFEAssembleH1(HycoFE fe, PetscReal length, Mat M);

/* Stress of u (n_dof, local order) from the elastic tangents, without the stress of thermal strain, averaged over
   each cell: sigma n_cells x n_sigma. */
PetscErrorCode HycoFEStress(HycoFE fe, const PetscReal u[], PetscReal sigma[]);
/* The same in the marked cells (in: NULL: all; 0 in others) for many u and parameters: *kept (the caller's, NULL at
   first, freed with PetscFree()) has the nodes and the mean gradients of the cells, 6 nv numbers each, so that those of
   cells whose nodes do not move are computed once. */
PetscErrorCode HycoFEStressMatrixKept(HycoFE fe, const PetscBool in[], const PetscReal u[], PetscReal **kept,
                                      PetscReal sigma[]);
/* slope (n_dof) += factor times the derivative of by . sigma of a cell with respect to the displacements. */
PetscErrorCode HycoFEAddStressDerivatives(HycoFE fe, PetscInt cell, const PetscReal by[6], PetscReal factor,
                                          PetscReal slope[]);
/* The volumes of the cells, of the full circle in an axisymmetric scene. */
PetscErrorCode HycoFEVolumes(HycoFE fe, PetscReal volume[]);
/* Adds the nodal forces of body forces to a cell's unknowns (f: nv x dim). */
PetscErrorCode HycoFEBodyForce(HycoFE fe, PetscInt cell, PetscReal f[]);
/* Elastic energy of each cell: 1/2 u^T K u without thermal strains and springs. */
PetscErrorCode HycoFEEnergy(HycoFE fe, const PetscReal u[], PetscReal energy[]);
/* The terms of the energy identity of a linear scene that thermal strain e adds to F.u, by cell: the integral of e :
   C : (e - 2 eps(u)). */
PetscErrorCode HycoFEHeatWork(HycoFE fe, const PetscReal u[], PetscReal work[]);

/* Springs to the ground (springs.c), at fe's parameters: f += scale (-K u), their forces on the unknowns (n_dof;
   complete on the nodes that a part owns); their energy u^T K u / 2, of the springs that this process counts. */
void HycoSpringsAddForces(HycoFE fe, PetscReal scale, const PetscReal u[], PetscReal f[]);
PetscReal HycoSpringsEnergy(HycoFE fe, const PetscReal u[]);
/* Visits each spring that this process counts: its number in the scene, its n nodes, its matrix (n dim square, row
   major). */
typedef PetscErrorCode (*HycoSpringVisit)(HycoFE fe, PetscInt spring, PetscInt n, const PetscInt node[],
                                          const PetscReal K[], void *ctx);
PetscErrorCode HycoSpringsVisit(HycoFE fe, HycoSpringVisit visit, void *ctx);

#endif
