/* F: body forces, pressures, tractions, forces on points and lines, thermal strains, and the lifting of prescribed
   displacements. */
#include "inertia.h"
#include <hycovector.h>
#include <hycomaterialimpl.h>

/* Where forces are added: a vector in the distributed numbering, without fixed unknowns; or all of fe's unknowns. */
typedef struct {
  Vec vec;
  PetscReal *own; /* the entries of a vector on one process */
  PetscReal *all; /* n_dof; NULL: the vector */
} Into;

/* A single entry is a call of several functions in a Vec. */
static inline PetscErrorCode AddEntry(Into F, PetscInt i, PetscReal value)
{
  PetscFunctionBegin;
  if (F.own)
    F.own[i] += value;
  else
    PetscCall(VecSetValue(F.vec, i, value, ADD_VALUES));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds a component of a force at a node to F, in generalised unknowns: a tied node passes it to its masters by the
   weights, an oblique support passes the eliminated component to the free ones (T^T F). */
static PetscErrorCode AddNode(HycoFE fe, PetscInt node, PetscInt c, PetscReal value, Into F)
{
  const PetscInt global = fe->mesh->node_global ? fe->mesh->node_global[node] : node;
  const PetscInt tied = HycoMeshTied(fe->mesh, node);
  const HycoOblique *oblique;

  PetscFunctionBegin;
  if (F.all) {
    F.all[node * fe->dim + c] += value;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (tied >= 0) {
    const PetscInt first = fe->mesh->tied_start[tied];
    const PetscReal *weight = fe->mesh->ties->weight + fe->mesh->tied_entry[tied];

    for (PetscInt j = first; j < fe->mesh->tied_start[tied + 1]; j++)
      /* Recursion of one level: a master is not tied, but may have a support. */
      PetscCall(AddNode(fe, fe->mesh->tied_master[j], c, weight[j - first] * value, F));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  /* The force on a fixed unknown goes to the support. */
  if (!fe->fixed[node * fe->dim + c]) PetscCall(AddEntry(F, global * fe->dim + c, value));
  oblique = HycoFEOblique(fe, node * fe->dim + c);
  for (PetscInt d = 0; oblique && d < fe->dim; d++) {
    if (!fe->fixed[node * fe->dim + d]) PetscCall(AddEntry(F, global * fe->dim + d, oblique->a[d] * value));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The body forces of a body at fe's parameters. */
typedef struct {
  PetscInt body; /* -1: not set */
  PetscBool any, uniform;
  HycoAcceleration motion;
  PetscReal f[3]; /* uniform: per volume */
} BodyForce;

/* Force per volume plus gravity and centrifugal force at x. Forces per volume act on the moved body, not per drawn
   volume. */
static PetscErrorCode ForceAt(HycoFE fe, const BodyForce *b, const PetscReal x[3], PetscReal f[3])
{
  const HycoBody *body = &fe->scene->body[b->body];

  PetscFunctionBegin;
  PetscCall(HycoInertiaForce(fe, body, &b->motion, x, f));
  for (PetscInt c = 0; c < fe->dim; c++) {
    PetscReal own = 0;

    if (body->force[c]) PetscCall(HycoExprEval(body->force[c], fe->mu, 1, x, &own));
    f[c] += own;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* That of the cell's body, unless it is there: cells of a body follow each other. */
static PetscErrorCode SetBodyForce(HycoFE fe, PetscInt cell, BodyForce *b)
{
  HycoMesh m = fe->mesh;
  const HycoBody *body = &fe->scene->body[m->cell_body[cell]];

  PetscFunctionBegin;
  if (b->body == m->cell_body[cell]) PetscFunctionReturn(PETSC_SUCCESS);
  b->body = m->cell_body[cell];
  b->any =
      (PetscBool)(body->force[0] || body->force[1] || body->force[2] || HycoSceneHasInertia(fe->scene, body, NULL));
  if (!b->any) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoAccelerationSet(fe, body, &b->motion));
  b->uniform = (PetscBool)(b->motion.square == 0 && !HycoExprInSpace(body->density));
  for (PetscInt c = 0; c < 3; c++) b->uniform = (PetscBool)(b->uniform && !HycoExprInSpace(body->force[c]));
  if (b->uniform) PetscCall(ForceAt(fe, b, fe->X + 3 * m->cells[cell * m->nv], b->f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Those of one cell (nv x dim, N), the integrals of N_a f at X(mu). */
static PetscErrorCode IntegrateBodyForce(HycoFE fe, PetscInt cell, const BodyForce *b, PetscReal value[])
{
  HycoMesh m = fe->mesh;
  const HycoElement *el = HycoElementGet(m->type);
  const PetscReal *weight;
  PetscReal f[3];

  PetscFunctionBegin;
  PetscCall(HycoPointWeights(fe, el, cell, &weight));
  PetscCall(PetscArraycpy(f, b->f, 3));
  for (PetscInt q = 0; q < el->nq; q++) {
    PetscReal x[3];

    /* Expressions cost more than the point's gradients. */
    if (!b->uniform) HycoPointPlace(fe, el, cell, q, x);
    if (!b->uniform) PetscCall(ForceAt(fe, b, x, f));
    for (PetscInt c = 0; c < m->dim; c++) {
      for (PetscInt a = 0; f[c] != 0 && a < m->nv; a++) value[a * m->dim + c] += weight[q] * f[c] * el->N[q][a];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFEBodyForce(HycoFE fe, PetscInt cell, PetscReal value[])
{
  BodyForce b = {.body = -1};

  PetscFunctionBegin;
  PetscCall(SetBodyForce(fe, cell, &b));
  if (b.any) PetscCall(IntegrateBodyForce(fe, cell, &b, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A cell's forces on its unknowns. */
static PetscErrorCode AddCell(HycoFE fe, PetscInt cell, const PetscReal f[], Into F)
{
  HycoMesh m = fe->mesh;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < m->nv * m->dim; k++)
    PetscCall(AddNode(fe, m->cells[cell * m->nv + k / m->dim], k % m->dim, f[k], F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether this process applies a load to a facet: the process that has its cell does. */
static PetscBool ForceIsLocal(HycoFE fe, PetscInt facet)
{
  return (PetscBool)(fe->all_facets || fe->mesh->facet_cell[facet] >= 0);
}

/* Quadrature of t dS - p n dS, for loads that vary over the facet; n has the length of the area element. A pressure
   acts against the outward normal. */
static PetscErrorCode AddFacetLoad(HycoFE fe, const HycoLoad *load, PetscInt facet, Into F)
{
  HycoMesh m = fe->mesh;
  const HycoElement *el = HycoElementGetFacet(m->type);

  PetscFunctionBegin;
  for (PetscInt q = 0; q < el->nq; q++) {
    PetscReal n[3], x[3] = {0, 0, 0}, p = 0, area;

    PetscCall(HycoFacetNormal(fe, el, facet, q, n));
    /* dS times the weight of the point, since n has this length. */
    area = PetscSqrtReal(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (PetscInt a = 0; a < m->nf; a++) {
      for (PetscInt c = 0; c < 3; c++) x[c] += el->N[q][a] * fe->X[3 * m->facets[facet * m->nf + a] + c];
    }
    if (load->pressure) PetscCall(HycoExprEval(load->pressure, fe->mu, 1, x, &p));
    for (PetscInt c = 0; c < m->dim; c++) {
      PetscReal t = 0;

      if (load->traction[c]) PetscCall(HycoExprEval(load->traction[c], fe->mu, 1, x, &t));
      for (PetscInt a = 0; a < m->nf; a++)
        PetscCall(AddNode(fe, m->facets[facet * m->nf + a], c, (t * area - p * n[c]) * el->N[q][a], F));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sums of n dS and dS around each node that the load acts on. A uniform load is then a product for each node, not an
   integral: moved nodes alone make it again. */
static PetscErrorCode SetShares(HycoFE fe, PetscInt group, HycoLoadShares *s)
{
  HycoMesh m = fe->mesh;
  const HycoElement *el = HycoElementGetFacet(m->type);
  PetscReal *sum;
  PetscInt n = 0;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(4 * m->n_nodes, &sum));
  for (PetscInt f = 0; f < m->n_facets; f++) {
    /* Facets that a rank shares are integrated by each for its own nodes. */
    if (m->facet_group[f] != group || !ForceIsLocal(fe, f)) continue;
    for (PetscInt q = 0; q < el->nq; q++) {
      PetscReal v[4];

      PetscCall(HycoFacetNormal(fe, el, f, q, v));
      v[3] = PetscSqrtReal(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
      for (PetscInt a = 0; a < m->nf; a++) {
        for (PetscInt c = 0; c < 4; c++) sum[4 * m->facets[f * m->nf + a] + c] += el->N[q][a] * v[c];
      }
    }
  }
  for (PetscInt i = 0; i < m->n_nodes; i++) n += sum[4 * i + 3] != 0; /* the corners of quad8 have negative shares */
  /* The same nodes as at the last position: no allocation along a study. */
  if (n != s->n) {
    HycoFreeAll(&s->node, &s->share);
    PetscCall(PetscMalloc1(n, &s->node));
    PetscCall(PetscMalloc1(4 * n, &s->share));
    s->n = n;
  }
  for (PetscInt i = 0, k = 0; i < m->n_nodes; i++) {
    if (sum[4 * i + 3] == 0) continue;
    s->node[k] = i;
    PetscCall(PetscArraycpy(s->share + 4 * k++, sum + 4 * i, 4));
  }
  PetscCall(PetscFree(sum));
  s->ready = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A load that is constant in space: its values times the nodes' shares of the surface. Saves evaluations of
   expressions and of normals while the nodes stay in place: four reals per node. */
static PetscErrorCode AddUniformLoad(HycoFE fe, const HycoLoad *load, PetscInt group, HycoLoadShares *s, Into F)
{
  PetscReal p = 0, t[3] = {0, 0, 0};

  PetscFunctionBegin;
  if (!s->ready) PetscCall(SetShares(fe, group, s));
  if (!s->n) PetscFunctionReturn(PETSC_SUCCESS);
  /* At any node: the value does not depend on the place. */
  if (load->pressure) PetscCall(HycoExprEval(load->pressure, fe->mu, 1, fe->X + 3 * s->node[0], &p));
  for (PetscInt c = 0; c < 3 && c < fe->dim; c++) {
    if (load->traction[c]) PetscCall(HycoExprEval(load->traction[c], fe->mu, 1, fe->X + 3 * s->node[0], &t[c]));
  }
  for (PetscInt k = 0; k < s->n; k++) {
    for (PetscInt c = 0; c < fe->dim; c++)
      PetscCall(AddNode(fe, s->node[k], c, t[c] * s->share[4 * k + 3] - p * s->share[4 * k + c], F));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The stiffness of a cell, kept from one parameter value to the next where HycoFEKeepStiffness() was called. */
static PetscErrorCode ForceStiffness(HycoFE fe, PetscInt cell, PetscReal **Ke)
{
  const size_t n = (size_t)(HycoMeshCellSize(fe->mesh, cell) * fe->dim);

  PetscFunctionBegin;
  /* Oblique supports, whose directions may change, are eliminated in it. */
  if (!fe->kept_stiffness || fe->n_oblique) {
    PetscCall(HycoFEElementRoom(fe, cell, Ke));
    PetscCall(HycoFEElementStiffness(fe, cell, *Ke));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!fe->kept_stiffness[cell]) PetscCall(PetscMalloc1(n * n, &fe->kept_stiffness[cell]));
  *Ke = fe->kept_stiffness[cell];
  if (fe->kept_at[cell] == fe->stiffened) PetscFunctionReturn(PETSC_SUCCESS);
  fe->kept_at[cell] = 0; /* until it is there */
  PetscCall(HycoFEElementStiffness(fe, cell, *Ke));
  fe->kept_at[cell] = fe->stiffened;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFEKeepStiffness(HycoFE fe)
{
  PetscFunctionBegin;
  if (fe->kept_stiffness) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc1(fe->mesh->n_cells + 1, &fe->kept_stiffness));
  PetscCall(PetscCalloc1(fe->mesh->n_cells + 1, &fe->kept_at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Moves K u0 of one cell to the right-hand side. */
static PetscErrorCode AddLifting(HycoFE fe, PetscInt cell, Into F)
{
  HycoMesh m = fe->mesh;
  PetscInt node[HYCO_MAX_CELL_NODES];
  const PetscInt n = m->dim * HycoMeshCellNodes(m, cell, node);
  PetscReal *Ke, u0[HYCO_MAX_CELL_UNKNOWNS];
  PetscBool any = PETSC_FALSE;

  PetscFunctionBegin;
  /* u0 is mostly zero; a cell without prescribed values is skipped. */
  for (PetscInt k = 0; k < n; k++) {
    u0[k] = fe->u0[node[k / m->dim] * m->dim + k % m->dim];
    any = (PetscBool)(any || u0[k] != 0);
  }
  if (!any) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ForceStiffness(fe, cell, &Ke));
  for (PetscInt k = 0; k < n; k++) {
    /* u0 has the offsets of oblique supports, too: Ke is that of the eliminated unknowns. */
    const PetscInt i = node[k / m->dim], c = k % m->dim, global = m->node_global ? m->node_global[i] : i;

    /* The row of a fixed unknown is its diagonal alone (K is reduced in the same way), so that the solution there is
       u0. */
    if (fe->fixed[i * m->dim + c]) {
      PetscCall(AddEntry(F, global * m->dim + c, Ke[k * n + k] * u0[k]));
    } else {
      PetscReal sum = 0;

      for (PetscInt j = 0; j < n; j++) sum += Ke[k * n + j] * u0[j];
      PetscCall(AddEntry(F, global * m->dim + c, -sum)); /* T^T K T also has contributions of other cells */
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Forces of the thermal strains, w B^T C (alpha dT), added to push (nv x dim, N). With bbar as for every stress, so
   that a free expansion has none. */
PetscErrorCode HycoCellHeat(HycoFE fe, PetscInt cell, PetscReal push[])
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);
  const PetscInt size = fe->tangent_size[fe->mesh->cell_body[cell]];
  const PetscBool bbar = fe->bbar[fe->mesh->cell_body[cell]];
  PetscReal g[HYCO_CELL_NODES][3], mean[HYCO_CELL_NODES][3], w;

  PetscFunctionBegin;
  if (bbar) PetscCall(HycoMeanGradients(fe, el, cell, mean));
  for (PetscInt q = 0; q < el->nq; q++) {
    /* Isotropic expansion: equal normal strains, no shear. */
    const PetscReal hot = fe->thermal[cell * el->nq + q], strain[6] = {hot, hot, hot, 0, 0, 0};
    PetscReal stress[6];

    PetscCall(HycoGradients(fe, el, cell, q, g, &w));
    HycoTangentApply(HycoFEIsIsotropic(fe, cell), fe->dim, fe->tangent + fe->tangent_start[cell] + q * size, strain,
                     stress);
    HycoPointForce(fe, el, g, bbar ? mean : NULL, w, stress, push);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds body forces and forces of thermal strains of a cell. With a history, thermal strains enter through the laws'
   stresses, not as forces, unless fe->heat_is_load. */
static PetscErrorCode AddVolume(HycoFE fe, PetscInt cell, BodyForce *b, Into F)
{
  const HycoBody *body = &fe->scene->body[fe->mesh->cell_body[cell]];
  const PetscInt n = fe->mesh->nv * fe->mesh->dim;
  const PetscBool hot =
      (PetscBool)(fe->thermal && !fe->without_cells && (!fe->scene->n_times || fe->heat_is_load) && body->expansion);
  PetscReal f[HYCO_MAX_CELL_DOFS];

  PetscFunctionBegin;
  PetscCall(SetBodyForce(fe, cell, b));
  if (b->any) {
    PetscCall(PetscArrayzero(f, n));
    PetscCall(IntegrateBodyForce(fe, cell, b, f));
    PetscCall(AddCell(fe, cell, f, F));
  }
  /* Thermal stress C eps_thermal as nodal forces, of linear scenes. */
  if (hot) {
    PetscCall(PetscArrayzero(f, n));
    PetscCall(HycoCellHeat(fe, cell, f));
    PetscCall(AddCell(fe, cell, f, F));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The force per unit length along a segment: its ends, and its middle if of second order. Integral of N_a f ds over the
   moved segment (force per length, N/m). By the length of the moved segment. */
static PetscErrorCode AddSegment(HycoFE fe, const HycoPointLoad *load, const PetscInt node[], Into F)
{
  /* First-order segments: two points integrate a linear load times a linear function. */
  const HycoElement *el = HycoMeshIsQuadratic(fe->mesh) ? HycoElementGetFacet(HYCO_TRI6) : HycoElementGet(HYCO_LINE2);

  PetscFunctionBegin;
  for (PetscInt q = 0; q < el->nq; q++) {
    PetscReal x[3] = {0, 0, 0}, slope[3] = {0, 0, 0}, f;

    for (PetscInt a = 0; a < el->nv; a++) {
      for (PetscInt c = 0; c < 3; c++) x[c] += el->N[q][a] * fe->X[3 * node[a] + c];
      for (PetscInt c = 0; c < 3; c++) slope[c] += el->dN[q][a][0] * fe->X[3 * node[a] + c];
    }
    for (PetscInt c = 0; c < 3; c++) {
      if (!load->force[c]) continue;
      PetscCall(HycoExprEval(load->force[c], fe->mu, 1, x, &f));
      for (PetscInt a = 0; a < el->nv; a++)
        PetscCall(AddNode(fe, node[a], c, f * el->w[q] * el->N[q][a] * HycoLength(slope), F));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Forces on points and along lines in space. Points: the whole force at each node (N). Lines: segments are found
   again at each call, which is cheap against the loop over cells. */
static PetscErrorCode AddPointLoad(HycoFE fe, const HycoPointLoad *load, Into F)
{
  HycoMesh m = fe->mesh;
  PetscInt g = 0, n, *segment;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(m, "force", load->group, &g));
  /* A point's force acts once, at its owner's row: entries of ghosts are dropped at the assembly. */
  if (m->group_dim[g] == 0) {
    for (PetscInt k = m->group_start[g]; k < m->group_start[g + 1]; k++) {
      const PetscInt i = m->group_node[k];

      for (PetscInt c = 0; c < m->dim; c++) {
        PetscReal f;

        if (!load->force[c]) continue;
        PetscCall(HycoExprEval(load->force[c], fe->mu, 1, fe->X + 3 * i, &f));
        PetscCall(AddNode(fe, i, c, f, F));
      }
    }
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoMeshLine(m, g, &n, &segment));
  for (PetscInt k = 0; k < n; k++) {
    PetscErrorCode ierr = AddSegment(fe, load, segment + (HycoMeshIsQuadratic(m) ? 3 : 2) * k, F);

    if (ierr) PetscCall(PetscFree(segment));
    PetscCall(ierr);
  }
  PetscCall(PetscFree(segment));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The loop is the same for F (vector: eliminated unknowns, with lifting) and for all unknowns (array: plain nodal
   forces, from which reactions are computed). */
static PetscErrorCode AddForces(HycoFE fe, Into F)
{
  HycoMesh m = fe->mesh;
  BodyForce b = {.body = -1};

  PetscFunctionBegin;
  for (PetscInt e = 0; e < m->n_cells; e++) {
    PetscCall(AddVolume(fe, e, &b, F));
    if (fe->lifted && F.vec) PetscCall(AddLifting(fe, e, F));
  }
  for (PetscInt k = 0; k < fe->scene->n_loads; k++) {
    const HycoLoad *load = &fe->scene->load[k];
    PetscBool in_space = HycoExprInSpace(load->pressure);
    PetscInt g = 0;

    PetscCall(HycoMeshFindGroup(m, "load", load->group, &g));
    for (PetscInt c = 0; c < m->dim; c++) in_space = (PetscBool)(in_space || HycoExprInSpace(load->traction[c]));
    /* Shares are kept by load, as each may act on another surface. */
    if (!in_space) PetscCall(AddUniformLoad(fe, load, g, &fe->shares[k], F));
    for (PetscInt f = 0; f < m->n_facets && in_space; f++) {
      if (m->facet_group[f] == g && ForceIsLocal(fe, f)) PetscCall(AddFacetLoad(fe, load, f, F));
    }
  }
  for (PetscInt k = 0; k < fe->scene->n_point_loads; k++) PetscCall(AddPointLoad(fe, &fe->scene->point_load[k], F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The end of an assembly is collective: a rank with an error takes part in it, so that the others do not wait. F
   (distributed, N). Entries of other ranks are dropped, because their owners have the same cells. Collective. */
PetscErrorCode HycoFEAssembleForce(HycoFE fe, Vec F)
{
  Into into = {.vec = F};
  PetscMPIInt size;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(VecSet(F, 0));
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)F), &size));
  if (size == 1) {
    PetscCall(VecGetArray(F, &into.own));
    HycoFinally(AddForces(fe, into), PetscCall(VecRestoreArray(F, &into.own)));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  /* Without it ghost entries would be sent, and added to those of the owner. */
  PetscCall(VecSetOption(F, VEC_IGNORE_OFF_PROC_ENTRIES, PETSC_TRUE));
  ierr = AddForces(fe, into);
  PetscCall(HycoVecAssemble(F));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Applied forces at all local unknowns, f[n_dof], without elimination; complete at owned nodes. Not collective. */
PetscErrorCode HycoFELoads(HycoFE fe, PetscReal f[])
{
  PetscFunctionBegin;
  PetscCall(PetscArrayzero(f, fe->n_dof));
  PetscCall(AddForces(fe, (Into){.all = f}));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* r += K u of the cells; held: only of those with a fixed unknown. */
static PetscErrorCode AddElastic(HycoFE fe, const PetscReal u[], PetscBool held, PetscReal r[])
{
  HycoMesh m = fe->mesh;
  PetscReal *Ke;

  PetscFunctionBegin;
  for (PetscInt e = 0; e < m->n_cells; e++) {
    PetscInt node[HYCO_MAX_CELL_NODES];
    const PetscInt n = m->dim * HycoMeshCellNodes(m, e, node);
    PetscBool holds = (PetscBool)!held;

    /* Other cells do not contribute to the rows that are wanted. */
    for (PetscInt k = 0; k < n; k++) holds = (PetscBool)(holds || fe->fixed[node[k / m->dim] * m->dim + k % m->dim]);
    if (!holds) continue;
    PetscCall(HycoFEElementRoom(fe, e, &Ke));
    PetscCall(HycoFEElementStiffness(fe, e, Ke));
    for (PetscInt k = 0; k < n * n; k++) {
      const PetscInt j = node[k % n / m->dim] * m->dim + k % n % m->dim;

      /* u may be without prescribed values: fixed unknowns take those at fe's parameters. */
      r[node[k / n / m->dim] * m->dim + k / n % m->dim] += Ke[k] * (fe->fixed[j] ? fe->u0[j] : u[j]);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* r = internal minus applied forces at supported unknowns, 0 elsewhere: f_int if it is given (histories), else K u of
   the cells with a fixed unknown, since the assembled K has only the diagonal in these rows. Complete at owned nodes.
   Not collective. Contact forces are not in it: the caller subtracts what they press on supports. */
PetscErrorCode HycoFEReactions(HycoFE fe, const PetscReal u[], const PetscReal f_int[], PetscReal r[])
{
  PetscFunctionBegin;
  PetscCall(HycoFELoads(fe, r));
  HycoFEGeneralise(fe, r);
  for (PetscInt k = 0; k < fe->n_dof; k++) r[k] = (f_int ? f_int[k] : 0) - r[k];
  if (!f_int) PetscCall(AddElastic(fe, u, PETSC_TRUE, r));
  for (PetscInt k = 0; k < fe->n_dof; k++) r[k] = HycoFESupports(fe, k) ? r[k] : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For derivatives at fixed free unknowns: unlike the residual of K U = F it needs no assembled K. Not collective. */
PetscErrorCode HycoFEImbalance(HycoFE fe, const PetscReal u[], PetscBool held, PetscReal r[])
{
  PetscFunctionBegin;
  PetscCall(HycoFELoads(fe, r));
  HycoFEGeneralise(fe, r);
  for (PetscInt k = 0; k < fe->n_dof; k++) r[k] = -r[k];
  PetscCall(AddElastic(fe, u, held, r));
  for (PetscInt k = 0; k < fe->n_dof; k++) r[k] = fe->fixed[k] ? 0 : r[k];
  PetscFunctionReturn(PETSC_SUCCESS);
}
