/*
  The model of bodies as substructures. Bodies (connected parts of the mesh; ties connect) touch only through their
  surfaces. In the axes of a body at one point of the parameters, on the unknowns of the surfaces that may touch,

      C_b = N_b K_b^-1 N_b^T,   R_b = N_b K_b^-1 F_b,

  and at mu, where the body is turned by Q, scaled, and stiffer by the factor kappa (Q^T K(mu) Q = kappa K),

      u_b = Q (kappa^-1 (R_b c - C_b f) + Z_b x),   f = Q^T B_b^T L,   W = sum_b B_b Q C_b Q^T B_b^T / kappa

  with the rigid motions Z_b of a body that contact alone holds. The parameters theta that change a body otherwise, its
  shape or the ratio of its moduli, have samples, between which the entries of its blocks are interpolated.
*/
#ifndef HYCOBODIES_H
#define HYCOBODIES_H

#include <hycoalgorithms.h>
#include <hycolcp.h>
#include <hycolinear.h>
#include <hycomaterialimpl.h>
#include <hycoromimpl.h>
#include <hycocontactstate.h>
#include <hycosolverimpl.h>
#include <petscblaslapack.h>

/* Where a body is, relative to its nodes at another point: x = s Q X + t. */
typedef struct {
  PetscReal Q[9], s;  /* Q row major, orthogonal */
  PetscReal residual; /* relative distance of the nodes from this map */
} HycoPose;
/* The nodes' sums over each of n bodies of fom's part (of: by node), with those of X0 (3 a node): pose[n].
   Collective. */
PetscErrorCode HycoBodyPoses(HycoFOM fom, PetscInt n, const PetscInt of[], const PetscReal X0[], HycoPose pose[]);
/* The pose from n points x of their reference X. */
void HycoPoseFit(PetscInt dim, PetscInt n, const PetscReal X[], const PetscReal x[], HycoPose *pose);
/* The exponent p with which the stiffness of a body scales: s^p. */
PetscInt HycoPosePower(HycoFE fe);
/* out = Q v, or Q^T v, for dim components. */
static inline void HycoPoseTurn(const PetscReal Q[9], PetscInt dim, PetscBool back, const PetscReal v[],
                                PetscReal out[])
{
  for (PetscInt c = 0; c < dim; c++) {
    out[c] = 0;
    for (PetscInt d = 0; d < dim; d++) out[c] += (back ? Q[3 * d + c] : Q[3 * c + d]) * v[d];
  }
}

/* Where contacts are: a mesh with all of their surfaces, and its rows of B and gaps at its parameters: one for each
   contact, or with tangents. Borrowed. */
typedef struct {
  HycoFE fe;
  HycoPairs *pairs;
  HycoRows *rows;
  PetscInt n;              /* rows */
  const PetscInt *contact; /* by row: of the scene */
} HycoBodiesSurface;
static inline HycoBodiesSurface HycoBodiesSurfaceNormal(HycoFE fe, HycoPairs *pairs, HycoRows *rows)
{
  return (HycoBodiesSurface){fe, pairs, rows, pairs->n, pairs->contact};
}
static inline HycoBodiesSurface HycoBodiesSurfaceOf(HycoROM m)
{
  return HycoBodiesSurfaceNormal(m->fe, &m->pairs, &m->rows);
}

/* to += factor times from, n numbers. */
static inline void HycoBodiesAdd(PetscInt n, PetscReal factor, const PetscReal from[], PetscReal to[])
{
  const PetscBLASInt size = (PetscBLASInt)n, one = 1;

  BLASaxpy_(&size, &factor, from, &one, to, &one);
}

/* A matrix of a body, rows x n, its flexibility or the responses of other unknowns: the sum over its terms of share[]
   C_t, the share of a term its polynomial of theta, one of those that are orthonormal on the samples; the first is
   constant. An unknown has its columns of all terms side by side, because a prediction reads them together. */
typedef struct {
  PetscInt rows, n, n_terms, n_wide; /* n: unknowns; terms; those in double precision, the first ones */
  PetscInt *term;                    /* their polynomials, the constant one first */
  PetscReal *polynomial;             /* samples x terms row major: at the samples */
  PetscReal *wide;
  float *narrow;
} HycoFlexibility;
/* From the samples at the tensor's nodes, by columns. least 0: all terms in double precision; > 0: the first one and
   those with entries above `single`, the others in single precision, without those whose entries are all below `least`,
   relative to the scales of their row and column: scale[rows + n], or NULL for the roots of the diagonal. */
PetscErrorCode HycoFlexibilityCreate(const HycoTensor *tensor, PetscInt rows, PetscInt n,
                                     const PetscReal *const sample[], const PetscReal scale[], PetscReal least,
                                     PetscReal single, HycoFlexibility *f);
PetscErrorCode HycoFlexibilityDestroy(HycoFlexibility *f);
/* Room for rows, n, n_terms, n_wide; the polynomials of `term`; entry i of an unknown's column in a term. */
PetscErrorCode HycoFlexibilityAllocate(HycoFlexibility *f);
PetscErrorCode HycoFlexibilityTakePolynomials(HycoFlexibility *f, const HycoTensor *tensor);
PetscReal HycoFlexibilityEntry(const HycoFlexibility *f, PetscInt t, PetscInt unknown, PetscInt i);
void HycoFlexibilitySetEntry(HycoFlexibility *f, PetscInt t, PetscInt unknown, PetscInt i, PetscReal value);
/* share[n_terms] from the weights of the samples. */
void HycoFlexibilityShares(const HycoFlexibility *f, PetscInt n_samples, const PetscReal weight[], PetscReal share[]);
/* The column of an unknown; to += factor times that of one term. */
void HycoFlexibilityColumn(const HycoFlexibility *f, const PetscReal share[], PetscInt unknown, PetscReal column[]);
void HycoFlexibilityAdd(const HycoFlexibility *f, PetscInt t, PetscInt unknown, PetscReal factor, PetscReal to[]);
/* y += the sum of x[n] times the columns. */
PetscErrorCode HycoFlexibilityMultiply(const HycoFlexibility *f, const PetscReal share[], const PetscReal x[],
                                       PetscReal y[]);
/* to[n] = the sum over the terms of share times from, `stride` apart: in the order of HycoFlexibilityColumn(), so that
   products that are kept give the same bits as those that are not. */
void HycoFlexibilityBlend(const HycoFlexibility *f, const PetscReal share[], PetscInt n, size_t stride,
                          const PetscReal from[], PetscReal to[]);

/* One body. R, Z and work are row major, one sample after the other. */
typedef struct {
  HycoTensor tensor;        /* over the parameters theta; one node along those that do not change its shape */
  PetscInt n_samples, n, l; /* n: unknowns of its surfaces; l: modes */
  PetscInt m;               /* unknowns inside whose displacements are exact */
  HycoFlexibility C;
  PetscReal *R, *Z, *work; /* n x r; n x p; p x r, the work of the loads on the rigid motions */
  HycoFlexibility H, a;    /* l rows for each turn, then m rows: of the n forces; of the r loads, then the p motions */
  PetscReal *gram;         /* r x r: of the errors of R at held-out samples in the norm of C^-1, summed; 0 */
} HycoSubstructure;

/* Whether a cell's body may deform inelastically. */
static inline PetscBool HycoInelasticFlows(HycoFE fe, PetscInt cell)
{
  return (PetscBool)!fe->scene->body[fe->mesh->cell_body[cell]].law->linear;
}
/* The unknown of fe's mesh that is unknown i of cell e. */
static inline PetscInt HycoCellUnknown(HycoMesh m, PetscInt e, PetscInt i)
{
  return m->cells[e * m->nv + i / m->dim] * m->dim + i % m->dim;
}
/* What is inelastic: u = ... + P alpha / kappa, alpha = T^T s of what the stresses lack of the elastic ones at few
   points. */
typedef struct {
  PetscInt m, n_points; /* modes; integration points at which the laws are evaluated */
  PetscInt *point;   /* the number of its cell in the whole mesh times the points of a cell, plus its own; ascending */
  PetscReal *weight; /* of the points, at the bodies' first place */
  PetscReal amplification; /* 2-norm of the inverse of the modes at these points; 1 with a cubature */
  PetscBool weighted;      /* a cubature, otherwise interpolation */
  PetscReal *T, *there;    /* (n_points n_sigma) x m row major: the coefficients are T^T s; the modes there (zero with a
                              cubature) */
  PetscReal *P;            /* ns x m: surfaces */
  PetscReal *fields;       /* modes of displacement, by body, sample and turn, x m */
  PetscInt nd, *dof, *body; /* the free unknowns of the points' cells (node of the whole mesh times dim plus component,
                               ascending); their bodies */
  PetscReal *C, *R, *A, *Z; /* their displacements: nd x ns, nd x r, nd x m; by rigid motions, nd x p */
} * HycoBodiesInelastic;

/* What of a parameter is interpolated: itself, its logarithm, or -1 over it. */
enum { HYCO_BODIES_PLAIN, HYCO_BODIES_LOGARITHM, HYCO_BODIES_RECIPROCAL, HYCO_BODIES_VARIABLES };
static inline PetscReal HycoBodiesVariable(PetscInt variable, PetscReal value)
{
  if (variable == HYCO_BODIES_LOGARITHM) return PetscLogReal(value);
  return variable == HYCO_BODIES_RECIPROCAL ? -1 / value : value;
}
static inline PetscReal HycoBodiesValue(PetscInt variable, PetscReal x)
{
  if (variable == HYCO_BODIES_LOGARITHM) return PetscExpReal(x);
  return variable == HYCO_BODIES_RECIPROCAL ? -1 / x : x;
}

/* The rigid motions of bodies that contact alone holds, where the shape of one changes: a table over the variables of
   theta. Of each motion the coefficients (HycoRigidRow()) of the one that moves its pin by 1 and no other one, then of
   each body and load the sums of the load times those rows, 6 numbers each, about the centre and by the size of the
   body. */
typedef struct {
  PetscInt *n_nodes, *body; /* values of each theta; by motion: the body that it moves */
  PetscReal *node, *frame;  /* the values; by body: 3 of its centre, its size */
  HycoGridField table;      /* no rows: no shape of such a body changes */
} HycoBodiesMotions;

typedef struct _n_HycoSubstructures {
  PetscInt dim, n;      /* bodies */
  PetscInt n_variables; /* of the scene: its parameters, the time and tables of a history */
  PetscReal *first;     /* the parameters at which the bodies' axes are those of the scene (HycoBodiesReference()) */
  PetscInt n_theta, *theta, *variable, *n_nodes; /* the parameters that change the shape of a body; HYCO_BODIES_PLAIN,
                                                    ...: what of each is interpolated; values of each */
  PetscReal *node;  /* the values of these variables, one parameter after the other, ascending */
  PetscReal forces; /* HycoBodiesBound(), the largest at the sampled points of the ranges; forces below a tenth of the
                       largest relative to that tenth */
  PetscReal bound;  /* of |C~ - C| relative to C at held-out samples; 0: nothing is interpolated */
  PetscReal left;   /* by the modes, of displacements at points of the ranges of which they were not made, relative */
  HycoSubstructure *body;
  PetscInt ns, *start, *dof; /* unknowns of the surfaces, body after body: start[n + 1]; node of the whole mesh times
                                dim plus component, n_s */
  PetscInt ni, *inner_start, *inner; /* the same for the unknowns inside: those of the cells that the scene's outputs
                                        need, if they are few, and of the cells with the largest stresses */
  PetscInt p;                        /* rigid motions that contact alone prevents */
  HycoBodiesMotions motions;
  /* loads: c = A (the turned loads at r unknowns of the cells of `probe`) */
  HycoMesh probe;
  PetscInt *cell; /* by body: a cell of `probe`, whose nodes and moduli show where and how stiff the body is */
  PetscInt r, *at, *at_body; /* r: the unknown of `probe`, and its body */
  PetscReal *A;              /* r x r row major */
  /* fields: gamma = sum over turns j of the body, Q = sum q_j G_j, of q_j ((a c - H f) / kappa + g x) */
  PetscInt l, *mode_start;       /* modes by body: n + 1 */
  PetscInt n_turns, *turn_start; /* by body: n + 1 */
  PetscReal *G;                  /* n_turns x 9, orthonormal */
  HycoBodiesInelastic inelastic; /* NULL: no history */
} * HycoSubstructures;

/* Rows of B in the bodies' axes that the last prediction had too, and what follows from them (bodies_row_cache.c). */
typedef struct {
  PetscBool same;          /* the rows are the last ones */
  PetscInt count;          /* of the rows so far that were not the last ones */
  PetscInt m, *start, *at; /* the last rows, of m contacts */
  PetscReal *value;
  PetscReal **P, **W; /* by contact and body: C_b B_b^T, n x terms; B C_b B_b^T, m x terms; NULL: not yet, or 0 */
  PetscReal **blend;  /* by contact and body: P at the weights of its samples; NULL: not made. Of bodies with several */
  PetscInt *at_weights, *weights; /* by contact and body: which weights; by body: the number of the present ones */
  PetscReal bytes;                /* of all P, W and blend */
} HycoBodiesRowCache;

/* What solves change. In the bodies' axes: c of the loads (r); displacements of the surfaces without contact (free, ns)
   and with it, then of the unknowns inside (u, ns + ni); forces on the surfaces (f, ns); x (p). */
typedef struct _n_HycoBodiesPerturbed *HycoBodiesPerturbed;
typedef struct _n_HycoBodiesWork {
  HycoSubstructures bodies;                /* borrowed */
  PetscReal **weight;                      /* by body: of its samples */
  PetscReal **share, **share_H, **share_a; /* by body: of the terms of C, H, a */
  PetscReal **R;                           /* by body: at these weights */
  PetscReal **blend;  /* by body with several samples: the columns of its flexibility with these weights, n x n; */
  PetscBool *blended; /* by place: whether they are there */
  PetscInt n_contacts;
  PetscReal **response;      /* by contact and body: C row^T at the present parameters, NULL: 0; */
  PetscBool *responded;      /* by contact: whether they are there */
  HycoFE fe;                 /* on probe */
  PetscBool prepared;        /* what HycoBodiesPrepare() makes is that at `mu` */
  PetscBool lacks;           /* a slave meets nodes that have no flexibility: there is no solution */
  PetscReal *mu, *reference; /* variables; by body: where its reference was taken */
  PetscReal *X0, *E0;        /* by body: nodes of its cell and the largest entry of its tangents in its own axes */
  PetscInt *E_at;            /* which entry */
  HycoPose *pose;
  PetscReal *kappa, *c, *elastic, *free, *u, *f, *x; /* elastic: free, without inelastic strains */
  PetscReal *Z, *work;                               /* ns x p, p x r row major: of all bodies, interpolated */
  PetscInt n_loc, *loc;                   /* by unknown of the surface's mesh: its place, with ns added inside; or -1 */
  PetscInt n_placed, *placed, *placed_in; /* its nodes with a place, and their bodies */
  PetscInt *row_start, *row_at, row_room; /* the rows of B in the bodies' axes */
  PetscReal *row;
  HycoBodiesRowCache kept;
  PetscReal *gap;    /* by contact: without the forces */
  PetscBool *active; /* contacts of the first problem */
  /* bodies_system.c: x are the motions, W a shell on this work */
  HycoSystem system;
  Mat W, B; /* of `rows_B` */
  PetscReal *rows_B;
  Vec D, F, motion, L;           /* F, motion: NULL without motions */
  PetscReal *bent, *bent_by;     /* -C f / kappa of the surfaces (ns), and the forces by contact that it belongs to, */
  PetscBool is_bent;             /* if any */
  PetscReal *response_u, *terms; /* u - free (ns) and, by contact, the terms of the gap at the last residuals */
  HycoSolver solver;             /* borrowed, or `own` */
  HycoSolver own;
  HycoReason reason; /* of the last solve; its iterations */
  PetscInt its;
  char method[64];
  const PetscReal *alpha,
      *dalpha; /* of gradients: the inelastic strains, and their change (borrowed); NULL: there are none */
  HycoBodiesPerturbed beside; /* of gradients (bodies_gradient.c); NULL: not needed yet */
} * HycoBodiesWork;

/* NULL-safe. */
PetscErrorCode HycoBodiesDestroy(HycoSubstructures *bodies);
/* Points the bodies' tensors to the values of theta. */
void HycoBodiesSetTensors(HycoSubstructures bodies);
/* Points the table of the motions to its values. */
void HycoBodiesSetMotions(HycoSubstructures bodies);
/* The rows of the rigid motions of body k for component c at X, in its own axes. */
void HycoBodiesRigidRow(HycoSubstructures bodies, PetscInt k, const PetscReal X[3], PetscInt c, PetscReal row[6]);
/* Whether axis p of theta changes the shape of body k. */
static inline PetscBool HycoBodiesAxis(HycoSubstructures bodies, PetscInt k, PetscInt p)
{
  return (PetscBool)(bodies->body[k].tensor.n[p] > 1);
}
/* The parameters at which the axes of body k are those of the scene: `first`, with those that change its shape as in
   mu. */
void HycoBodiesReference(HycoSubstructures bodies, PetscInt k, const PetscReal mu[], PetscReal reference[]);
/* weight[n_samples]: of the samples of body k at mu. */
PetscErrorCode HycoBodiesWeights(HycoSubstructures bodies, PetscInt k, const PetscReal mu[], PetscReal weight[]);
/* Prepares solves with contacts on this mesh, whose nodes have their numbers in the whole mesh. *work is all zero;
   HycoBodiesReset() frees it, after an error too. solver: its type, tolerance and limits apply (borrowed); NULL: the
   defaults. */
PetscErrorCode HycoBodiesSetUp(HycoBodiesWork work, HycoSubstructures bodies, HycoScene scene,
                               const HycoBodiesSurface *surface, HycoSolver solver);
PetscErrorCode HycoBodiesReset(HycoBodiesWork work);
/* The forces of all contacts at mu, where the surface's rows are; u, f, x, c and poses are set. *solved: the
   complementarity problem is. */
PetscErrorCode HycoBodiesSolve(HycoBodiesWork work, const HycoBodiesSurface *surface, const PetscReal mu[],
                               PetscReal Lambda[], PetscBool *solved);
/* The parts of HycoBodiesSolve(): the bodies, loads and rows at mu; the gaps without forces for inelastic strains alpha
   (NULL: none); the forces then. HycoBodiesDisplacementsOfForces(): f and u for given forces. */
PetscErrorCode HycoBodiesPrepare(HycoBodiesWork work, const HycoBodiesSurface *surface, const PetscReal mu[]);
PetscErrorCode HycoBodiesStrain(HycoBodiesWork work, const HycoBodiesSurface *surface, const PetscReal alpha[]);
PetscErrorCode HycoBodiesContact(HycoBodiesWork work, const HycoBodiesSurface *surface, PetscReal Lambda[],
                                 PetscBool *solved);
void HycoBodiesDisplacementsOfForces(HycoBodiesWork work, const HycoBodiesSurface *surface, const PetscReal Lambda[]);
/* After HycoBodiesPrepare(), with x set: u for forces f on the surfaces' unknowns (ns). */
PetscErrorCode HycoBodiesRespond(HycoBodiesWork work, const PetscReal f[]);
/* Compares the rows of m contacts with the last ones: kept.same, and takes them. */
PetscErrorCode HycoBodiesKeepRows(HycoBodiesWork work, PetscInt m);
PetscErrorCode HycoBodiesResetRowCache(HycoBodiesWork work);
/* If the rows are the last ones: P and W of n contacts, unless they need too much memory (kept.same is false then). */
PetscErrorCode HycoBodiesKeep(HycoBodiesWork work, PetscInt n, const PetscInt contact[]);
/* row[n]: of the matrix W at the present parameters, contact k with n contacts; u -= C B^T Lambda. */
void HycoBodiesRowCacheGet(HycoBodiesWork work, PetscInt k, PetscInt n, const PetscInt contact[], PetscReal row[]);
PetscErrorCode HycoBodiesRowCacheDisplace(HycoBodiesWork work, PetscInt m, const PetscReal Lambda[], PetscReal u[]);
/* Friction between the bodies (bodies_friction.c): steps of a path on the rows with tangents. surface: with the normal
   rows alone (borrowed). */
typedef struct _n_HycoBodiesFriction *HycoBodiesFriction;
PetscErrorCode HycoBodiesFrictionCreate(HycoScene scene, const HycoBodiesSurface *surface, PetscInt p,
                                        HycoBodiesFriction *friction);
PetscErrorCode HycoBodiesFrictionDestroy(HycoBodiesFriction *friction);
/* The surface with tangents, for HycoBodiesSetUp(). Borrowed. */
const HycoBodiesSurface *HycoBodiesFrictionSurface(HycoBodiesFriction friction);
/* At the start of a path: no slip, no forces. */
PetscErrorCode HycoBodiesFrictionBegin(HycoBodiesFriction friction);
/* HycoBodiesPrepare() with tangents, once the surface's fe is at mu. */
PetscErrorCode HycoBodiesFrictionPrepare(HycoBodiesFriction friction, HycoBodiesWork work, const PetscReal mu[]);
/* The forces of the step to the time t, and u, f of work; *solved: the residual of the contacts, recomputed from them,
   is small. */
PetscErrorCode HycoBodiesFrictionSolve(HycoBodiesFriction friction, HycoBodiesWork work, PetscReal t, HycoKKT *kkt,
                                       PetscInt *its, PetscBool *solved);
/* The solved step becomes the state of the contacts at t. */
PetscErrorCode HycoBodiesFrictionAccept(HycoBodiesFriction friction, HycoBodiesWork work, PetscReal t);
/* The parts of a step of bodies that deform inelastically: the forces at alpha (`again`: not the first alpha of the
   step), with x of work, o->free and the gaps; u, f and the residuals for these forces. */
PetscErrorCode HycoBodiesFrictionSolveContact(HycoBodiesFriction friction, HycoBodiesWork work, PetscReal t,
                                              const PetscReal alpha[], PetscBool again, PetscInt *its,
                                              PetscBool *solved);
PetscErrorCode HycoBodiesFrictionMove(HycoBodiesFriction friction, HycoBodiesWork work, HycoKKT *kkt);
/* w (by row) of a step from rest to mu with the motions and forces z, which become those of the last step. */
PetscErrorCode HycoBodiesFrictionProbe(HycoBodiesFriction friction, HycoBodiesWork work, const PetscReal mu[],
                                       const PetscReal z[], PetscReal w[]);
/* After a solve that failed: whether no forces with this friction balance the loads on the rigid motions. */
PetscErrorCode HycoBodiesFrictionNoEquilibrium(HycoBodiesFriction friction, HycoBodiesWork work, char name[HYCO_LINE],
                                               PetscBool *no_equilibrium);
/*
  The derivatives of a path of elastic bodies (bodies_sensitivity.c), as the ops `linearise`, `step_residual`,
  `perturbed`, `sensitivity` and `show`; Destroy before that of the friction.
*/
PetscErrorCode HycoBodiesSensitivityDestroy(HycoBodiesFriction friction);
PetscErrorCode HycoBodiesSensitivityLinearise(HycoROM model, HycoBodiesFriction friction, HycoBodiesWork work,
                                              PetscInt k, const PetscReal alpha[], PetscBool *able);
void HycoBodiesSensitivityResidual(HycoBodiesFriction friction, const PetscInt **row, PetscReal w[], PetscReal *size);
PetscErrorCode HycoBodiesSensitivityPerturbed(HycoROM model, HycoBodiesFriction friction, const PetscReal mu[],
                                              const PetscInt row[], PetscBool rows, const PetscReal z[], PetscInt point,
                                              PetscReal w[]);
PetscErrorCode HycoBodiesSensitivityAdvance(HycoBodiesFriction friction, PetscInt parameter, const PetscReal weight[3],
                                            const PetscInt point[3], const PetscReal q[], PetscReal dz[],
                                            PetscBool *regular);
/* After the last HycoBodiesSensitivityAdvance() of a parameter: its slips and work. */
void HycoBodiesSensitivityAccept(HycoBodiesFriction friction, PetscInt parameter, const PetscReal dz[]);
PetscErrorCode HycoBodiesSensitivityView(HycoROM model, HycoBodiesFriction friction, PetscInt parameter, PetscBool rows,
                                         PetscReal step, const PetscReal dz[]);
/* By row. Borrowed. */
const PetscReal *HycoBodiesFrictionForces(HycoBodiesFriction friction);
/* The derivative of the forces last found by alpha: Z (n_set x m row major), of the rows set[] of closed contacts, from
   BP = B P / kappa (rows x m). *changed, true: Z is wanted in any case; afterwards whether set and Z have been made
   anew. */
PetscErrorCode HycoBodiesFrictionDerive(HycoBodiesFriction friction, PetscInt m, const PetscReal BP[],
                                        PetscBool *changed, PetscInt *n_set, PetscInt set[], PetscReal **Z,
                                        PetscBool *regular);
/* The normal forces of the solved step; the state of the contacts, whose arrays the friction owns; whether the last
   step has further solutions. */
void HycoBodiesFrictionNormal(HycoBodiesFriction friction, PetscReal Lambda[]);
HycoContactState HycoBodiesFrictionState(HycoBodiesFriction friction);
/* Whether a state accepted since the begin left a rigid motion free, which is then named unless name is NULL, or the
   last one has loads but no forces. */
PetscBool HycoBodiesFrictionFreeMotion(HycoBodiesFriction friction, char name[HYCO_LINE]);
PetscErrorCode HycoBodiesFrictionDisproven(HycoBodiesFriction friction, PetscBool *disproven);
/* Parts of a solve for gradients. HycoBodiesBring(): the data of the bodies, c and the rows at mu, as
   HycoBodiesPrepare(); o->gap: those of the rows (surface NULL: these stay). HycoBodiesBlend(): sum[n] of the samples'
   numbers by their weights. HycoBodiesAddCompliance(): u -= C f / kappa. HycoBodiesRows(): those of the fields of body
   k, of which n are turns times modes, then the unknowns inside; HycoBodiesAddRows(): row += a x - H f. */
PetscErrorCode HycoBodiesBring(HycoBodiesWork work, const HycoBodiesSurface *surface, const PetscReal mu[]);
PetscReal HycoBodiesStretch(HycoBodiesWork work);
PetscErrorCode HycoBodiesBlend(PetscInt n_samples, const PetscReal weight[], PetscInt n, const PetscReal data[],
                               PetscReal sum[]);
PetscErrorCode HycoBodiesAddCompliance(HycoBodiesWork work, const PetscReal f[], PetscReal u[]);
PetscErrorCode HycoBodiesRows(HycoBodiesWork work, PetscInt k, PetscInt n, PetscReal row[]);
PetscErrorCode HycoBodiesAddRows(HycoBodiesWork work, PetscInt k, const PetscReal share_a[], const PetscReal share_H[],
                                 const PetscReal x[], const PetscReal f[], PetscReal row[]);
PetscErrorCode HycoBodiesResetPerturbed(HycoBodiesWork work);
/* Z and work of the bodies in the table of motions, at mu, where the surface's nodes are (NULL: Z stays). */
PetscErrorCode HycoBodiesMoveMotions(HycoBodiesWork work, const HycoBodiesSurface *surface, const PetscReal mu[]);
/* The derivatives of the displacements u[nd] of the points' cells, as HycoBodiesDerivatives(), with those of inelastic
   strains. */
PetscErrorCode HycoBodiesCellsDerivatives(HycoBodiesWork work, PetscInt n, const PetscInt contact[],
                                          const PetscReal weight[2], const PetscInt point[2], const PetscReal dz[],
                                          const PetscReal dalpha[], const PetscReal u[], PetscReal du[]);
/* The gaps of the model's contacts, and the largest term of one. */
void HycoBodiesGaps(HycoROM model, PetscReal w[], PetscReal *size);
/* w[p] of the present loads and forces, on the motions that contact alone prevents. */
void HycoBodiesWorkOnMotions(HycoBodiesWork work, PetscReal w[]);
/* The part of the loads, without round-off. */
PetscReal HycoBodiesLoadWork(HycoBodiesWork work, PetscInt motion);
PetscBool HycoBodiesLoaded(HycoBodiesWork work);
/* Of the loads' parts on all motions. */
PetscReal HycoBodiesLoadRounding(HycoBodiesWork work);
/* The contact system: D, F, B and W at the prepared parameters by HycoBodiesUpdateSystem().
   HycoBodiesBend(): `bent` of these forces. */
PetscErrorCode HycoBodiesCreateSystem(HycoBodiesWork work);
PetscErrorCode HycoBodiesDestroySystem(HycoBodiesWork work);
PetscErrorCode HycoBodiesUpdateSystem(HycoBodiesWork work);
PetscErrorCode HycoBodiesBend(HycoBodiesWork work, const PetscReal Lambda[]);
/* M of n contacts at the prepared parameters: p + n square by columns. */
PetscErrorCode HycoBodiesMatrix(HycoBodiesWork work, PetscInt n, const PetscInt contact[], PetscReal M[]);
/* Ops of gradients. */
PetscErrorCode HycoBodiesUnknowns(HycoROM model, PetscInt *p, PetscInt *n, PetscReal z[]);
PetscErrorCode HycoBodiesResidual(HycoROM model, const PetscReal mu[], const PetscReal z[], PetscReal w[],
                                  PetscReal *size);
PetscErrorCode HycoBodiesJacobian(HycoROM model, PetscInt k, const PetscInt contact[], PetscReal M[]);
PetscErrorCode HycoBodiesNear(HycoROM model, const PetscReal mu[], PetscInt n, const PetscInt contact[], PetscBool rows,
                              const PetscReal z[], PetscInt point, PetscReal w[]);
/* The same with these rows, and (rows false) the gaps of the prediction's. */
PetscErrorCode HycoBodiesNearSurface(HycoROM model, const HycoBodiesSurface *surface, const PetscReal gaps[],
                                     const PetscReal mu[], PetscInt n, const PetscInt contact[], PetscBool rows,
                                     const PetscReal z[], PetscInt point, PetscReal w[]);
PetscErrorCode HycoBodiesDerivatives(HycoROM model, PetscInt n, const PetscInt contact[], const PetscReal weight[2],
                                     const PetscInt point[2], const PetscReal dz[], const PetscBool modes[],
                                     const PetscBool dofs[], PetscReal dgamma[], PetscReal dU[]);
/* Sets the displacements of the surfaces and, after HycoBodiesExpand(), of the unknowns inside in U (by unknown of the
   surface's mesh) without prescribed ones. */
void HycoBodiesMove(HycoBodiesWork work, const HycoBodiesSurface *surface, PetscReal U[]);
/* After a solve: a bound of |L~ - L|_W relative to *norm = |L~|_W, from the errors of flexibilities and loads at
   held-out samples of the bodies; 0 without forces. */
PetscReal HycoBodiesBound(HycoBodiesWork work, PetscReal *norm);
/* The body of a place, of the surfaces or, from ns on, inside. */
PetscInt HycoBodiesAt(HycoSubstructures bodies, PetscInt place);
/* The coefficients of the modes, and the displacements of the unknowns inside. */
PetscErrorCode HycoBodiesExpand(HycoBodiesWork work, PetscReal gamma[]);
/* Adds those of inelastic strains to gamma; of one body. */
void HycoBodiesAddStrains(HycoBodiesWork work, const PetscReal alpha[], PetscReal gamma[]);
void HycoBodiesAddStrainsOf(HycoBodiesWork work, PetscInt body, const PetscReal alpha[], PetscReal gamma[]);
/* Reads from or writes to the model's file. */
PetscErrorCode HycoBodiesFile(HycoROM model, HycoH5 file);
/* Makes the model one of paths (bodies_path.c). */
PetscErrorCode HycoBodiesTakePath(HycoROM model);
/* Ops of both kinds of models. */
PetscErrorCode HycoBodiesView(HycoROM model, PetscViewer viewer);
PetscErrorCode HycoBodiesDestroyModel(HycoROM model);
/* theta of node k of the grid of all values; the number of nodes. */
PetscInt HycoBodiesGrid(HycoSubstructures bodies, PetscInt k, PetscReal theta[]);
/* Names the body that moves most with the motions d[p] at the forces L, as full order does. */
PetscErrorCode HycoBodiesNameMotion(HycoBodiesWork work, const HycoBodiesSurface *surface, const PetscReal L[],
                                    const PetscReal d[], char name[HYCO_LINE]);
/* After a solve that failed: whether no pressures balance the loads on the rigid motions; name: how the body moves. */
PetscErrorCode HycoBodiesLiftOff(HycoBodiesWork work, const HycoBodiesSurface *surface, const PetscReal L[],
                                 char name[HYCO_LINE], PetscBool *lift_off);
/* g (p): row k of the contacts times the motions. */
void HycoBodiesMotionRow(HycoBodiesWork work, PetscInt k, PetscReal g[]);
/* The residuals of the contact system (solved: those of the solve just done), `stationarity` that of floating bodies;
   U must have the gaps of the system. *residual: the largest without the effect of rounding the terms whose sum the
   displacements are, which judges the solve. */
PetscErrorCode HycoBodiesMeasure(HycoROM model, PetscBool solved, HycoKKT *kkt, PetscReal *residual);
/* Of the motions that contact alone prevents, HycoROMImbalance(); -1 (beyond: 0): there are none. beyond: without
   round-off, to judge a solve. */
PetscReal HycoBodiesImbalance(HycoBodiesWork work, PetscBool beyond);
/* Whether the contacts with a force leave a rigid motion free, and its name ("": none). */
PetscErrorCode HycoBodiesFreeMotion(HycoBodiesWork work, const HycoBodiesSurface *surface, const PetscReal Lambda[],
                                    PetscBool *loose, char name[HYCO_LINE]);

#endif
