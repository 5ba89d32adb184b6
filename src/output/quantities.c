/*
  Quantities: the largest, smallest or mean value of a field over a group. Displacements are those of nodes, stresses
  the cells' means: for a group of facets those of the cells that they bound, for points and lines those of the cells
  around them. A mean is the integral over the cells or facets of the group over their volume or area; for points the
  arithmetic mean. Other quantities: the forces of supports, results of contacts.
*/
#include <hycofields.h>
#include <hycokinematics.h>
#include <hycomaterialimpl.h>
#include <hycoquantities.h>
#include <math.h>
#include <string.h>

enum { U, UX, UY, UZ, XX, YY, ZZ, XY, YZ, XZ, RR, TT, MISES, FIRST };

typedef struct {
  PetscReal most, least, sum, weight;
  PetscReal *slope; /* n_dof: of the sum with respect to the displacements; NULL: not wanted */
} Sum;

/* Where a quantity is evaluated: cells (all, or of group g), facets of group g, or its nodes. */
typedef struct {
  PetscInt group, dim;
  PetscInt body; /* the body with the group's name; -1: none */
} Place;

/* Where an output is evaluated: a group of cells, facets or nodes; a body's name is its group of cells. */
static PetscErrorCode FindPlace(HycoScene scene, HycoMesh m, const HycoQuantity *q, Place *p)
{
  PetscFunctionBegin;
  p->group = p->body = -1;
  /* Without a group the whole mesh, which is cells. */
  p->dim = m->dim;
  if (!q->group) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoMeshFindGroup(m, "output", q->group, &p->group));
  p->dim = m->group_dim[p->group];
  for (PetscInt b = 0; b < scene->n_bodies; b++) {
    if (strcmp(scene->body[b].name, q->group) == 0) p->body = b;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* in[n_cells]: marks the cells of a place that consists of cells. A body's cells by its number, and those of a
   group of cells by its list: a name can be both. */
static void MarkCells(HycoMesh m, const Place *p, PetscBool in[])
{
  for (PetscInt e = 0; e < m->n_cells; e++) in[e] = (PetscBool)(p->group < 0 || m->cell_body[e] == p->body);
  for (PetscInt k = p->group < 0 ? 0 : m->group_cell_start[p->group];
       p->group >= 0 && k < m->group_cell_start[p->group + 1]; k++)
    in[m->group_cell[k]] = PETSC_TRUE;
}

/* in[n_cells]: marks the cells around the nodes of a place. */
static PetscErrorCode MarkAround(HycoMesh m, const Place *p, PetscBool in[])
{
  PetscBool *node;
  PetscInt of[HYCO_MAX_CELL_NODES];

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(m->n_nodes, &node));
  for (PetscInt k = m->group_start[p->group]; k < m->group_start[p->group + 1]; k++)
    node[m->group_node[k]] = PETSC_TRUE;
  for (PetscInt e = 0; e < m->n_cells; e++) {
    const PetscInt n = HycoMeshCellNodes(m, e, of);

    /* in[] comes from the caller with whatever it had. */
    in[e] = PETSC_FALSE;
    for (PetscInt v = 0; v < n; v++) in[e] = (PetscBool)(in[e] || node[of[v]]);
  }
  PetscCall(PetscFree(node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reactions need all cells around their nodes, displacements and stresses the cells or facets of the group.
   Quantities of contacts need none. */
PetscErrorCode HycoQuantityMarkCells(HycoScene scene, HycoMesh m, PetscInt k, PetscBool in[])
{
  const HycoQuantity *q = &scene->quantity[k];
  Place p;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(in, m->n_cells));
  if (q->kind >= HYCO_QUANTITY_FORCE) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(FindPlace(scene, m, q, &p));
  if (q->kind == HYCO_QUANTITY_REACTION && p.group >= 0) {
    PetscCall(MarkAround(m, &p, in));
    /* So that neither cells nor facets of the group are marked below: its nodes decide. */
    p.dim = -1;
  } else if (p.dim == m->dim)
    MarkCells(m, &p, in);
  else if (p.dim < m->dim - 1)
    PetscCall(MarkAround(m, &p, in));
  for (PetscInt f = 0; f < m->n_facets && p.dim == m->dim - 1; f++) {
    /* The stress on a facet is that of its cell. */
    if (m->facet_group[f] == p.group && m->facet_cell[f] >= 0) in[m->facet_cell[f]] = PETSC_TRUE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The union over all outputs. A model must contain all of these cells, or the output has no value. */
PetscErrorCode HycoQuantitiesMarkCells(HycoScene scene, HycoMesh m, PetscBool needed[])
{
  PetscBool *in;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_cells, &in));
  for (PetscInt e = 0; e < m->n_cells; e++) needed[e] = PETSC_FALSE;
  for (PetscInt k = 0; k < scene->n_quantities; k++) {
    PetscCall(HycoQuantityMarkCells(scene, m, k, in));
    for (PetscInt e = 0; e < m->n_cells; e++) needed[e] = (PetscBool)(needed[e] || in[e]);
  }
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool HycoQuantityOfStress(const HycoQuantity *q)
{
  return (PetscBool)(q->kind <= HYCO_QUANTITY_MEAN && q->field >= XX);
}

PetscBool HycoQuantityOfPosition(const HycoQuantity *q)
{
  return (PetscBool)((q->kind <= HYCO_QUANTITY_MEAN && q->field < XX) || q->kind == HYCO_QUANTITY_FRICTION);
}

PetscBool HycoSceneQuantityIsOfPosition(HycoScene scene, PetscInt q)
{
  return (PetscBool)(scene && q >= 0 && q < scene->n_quantities && HycoQuantityOfPosition(&scene->quantity[q]));
}

/* A subset of HycoQuantitiesMarkCells(): stresses cost more to store than displacements, and outputs of
   displacements do not need them. */
PetscErrorCode HycoQuantitiesMarkStressed(HycoScene scene, HycoMesh m, PetscBool stressed[])
{
  PetscBool *in;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_cells, &in));
  PetscCall(PetscArrayzero(stressed, m->n_cells));
  for (PetscInt k = 0; k < scene->n_quantities; k++) {
    if (!HycoQuantityOfStress(&scene->quantity[k])) continue;
    PetscCall(HycoQuantityMarkCells(scene, m, k, in));
    for (PetscInt e = 0; e < m->n_cells; e++) stressed[e] = (PetscBool)(stressed[e] || in[e]);
  }
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* field: U is the length of the displacement, UX .. its components. */
static PetscReal OfNode(HycoFE fe, PetscInt field, const PetscReal u[], PetscInt node)
{
  PetscReal sum = 0;

  if (field != U) return u[node * fe->dim + field - UX];
  for (PetscInt c = 0; c < fe->dim; c++) sum += u[node * fe->dim + c] * u[node * fe->dim + c];
  return PetscSqrtReal(sum);
}

/* The direction from the z axis to the centroid of a cell, which is not the mean of its nodes if it is a pyramid; 0 if
   the centroid is on the axis. */
static PetscErrorCode AwayFromZ(HycoFE fe, PetscInt cell, PetscReal out[2])
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);
  const PetscReal *weight;
  PetscReal r, farthest = 0, volume = 0;

  PetscFunctionBegin;
  out[0] = out[1] = 0;
  PetscCall(HycoPointWeights(fe, el, cell, &weight));
  for (PetscInt q = 0; q < el->nq; q++) {
    const PetscReal w = weight[q];
    PetscReal x[3];

    HycoPointPlace(fe, el, cell, q, x);
    for (PetscInt c = 0; c < 2; c++) out[c] += w * x[c];
    farthest = PetscMax(farthest, PetscSqrtReal(x[0] * x[0] + x[1] * x[1]));
    volume += w;
  }
  r = PetscSqrtReal(out[0] * out[0] + out[1] * out[1]);
  /* r is the centroid's distance times the volume; below round-off of the cell's own extent it has no direction. */
  for (PetscInt c = 0; c < 2; c++) out[c] = r > 1e-9 * volume * farthest ? out[c] / r : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The field of a stress s (6: xx, yy, zz, xy, yz, xz); n: the direction from the z axis, for r and t about it in 2D and
   3D; in an axisymmetric scene they are about its axis. A cell around the z axis has the mean over the directions. */
static PetscErrorCode OfStress(HycoFE fe, PetscInt field, const PetscReal s[6], const PetscReal n[2], PetscReal *value)
{
  PetscReal mises, principal[3];

  PetscFunctionBegin;
  if (field >= XX && field <= XZ) *value = s[field - XX];
  /* The axisymmetric components are radial, axial, hoop: nothing has to be turned. */
  if ((field == RR || field == TT) && fe->formulation == HYCO_AXISYMMETRIC) {
    *value = field == RR ? s[0] : s[2];
  } else if (field == RR || field == TT) {
    /* The mean of both over all directions, since the shear's part cancels. */
    if (n[0] == 0 && n[1] == 0)
      *value = (s[0] + s[1]) / 2;
    else if (field == RR)
      *value = n[0] * n[0] * s[0] + n[1] * n[1] * s[1] + 2 * n[0] * n[1] * s[3];
    else
      *value = n[1] * n[1] * s[0] + n[0] * n[0] * s[1] - 2 * n[0] * n[1] * s[3];
  }
  if (field == MISES) *value = HycoMises(fe->dim, s);
  if (field > MISES) {
    /* Principal stresses are asked for by few outputs, so they are computed for the cell alone. */
    PetscCall(HycoStressInvariants(1, fe->dim, s, &mises, principal));
    *value = principal[field - FIRST];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The stress of a cell, and what OfStress() needs of its place. */
static PetscErrorCode TakeStress(HycoFE fe, PetscInt field, const PetscReal sigma[], PetscInt cell, PetscReal s[6],
                                 PetscReal n[2])
{
  PetscFunctionBegin;
  PetscCall(PetscArrayzero(s, 6));
  PetscCall(PetscArraycpy(s, sigma + cell * fe->n_sigma, fe->n_sigma));
  if ((field == RR || field == TT) && fe->formulation != HYCO_AXISYMMETRIC) PetscCall(AwayFromZ(fe, cell, n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Value in a cell. */
static PetscErrorCode OfCell(HycoFE fe, PetscInt field, const PetscReal sigma[], PetscInt cell, PetscReal *value)
{
  PetscReal s[6], n[2];

  PetscFunctionBegin;
  PetscCall(TakeStress(fe, field, sigma, cell, s, n));
  PetscCall(OfStress(fe, field, s, n, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Step of differences by a stress as a share of its largest component: near the cube root of eps. */
#define STRESS_STEP 1e-5

/* slope += factor times the derivative of the field in a cell. */
static PetscErrorCode AddCellDerivative(HycoFE fe, PetscInt field, const PetscReal sigma[], PetscInt cell,
                                        PetscReal factor, PetscReal slope[])
{
  PetscReal s[6], n[2], by[6] = {0}, most = 0;

  PetscFunctionBegin;
  PetscCall(TakeStress(fe, field, sigma, cell, s, n));
  for (PetscInt k = 0; k < fe->n_sigma; k++) most = PetscMax(most, PetscAbsReal(s[k]));
  for (PetscInt k = 0; k < fe->n_sigma; k++) {
    /* Exact of a component; without a stress any step is. */
    const PetscReal at = s[k], step = most > 0 ? STRESS_STEP * most : 1;
    PetscReal value[2] = {0, 0};

    for (PetscInt j = 0; j < 2; j++) {
      s[k] = at + (j ? step : -step);
      PetscCall(OfStress(fe, field, s, n, &value[j]));
    }
    s[k] = at;
    by[k] = (value[1] - value[0]) / (2 * step);
  }
  PetscCall(HycoFEAddStressDerivatives(fe, cell, by, factor, slope));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same of OfNode(). */
static void AddNodeDerivative(HycoFE fe, PetscInt field, const PetscReal u[], PetscInt node, PetscReal factor,
                              PetscReal slope[])
{
  const PetscReal length = field == U ? OfNode(fe, U, u, node) : 0;

  if (field != U) slope[node * fe->dim + field - UX] += factor;
  for (PetscInt c = 0; c < fe->dim && length > 0; c++)
    slope[node * fe->dim + c] += factor * u[node * fe->dim + c] / length;
}

/* Of an extreme, within which a cell's value may become it: the error of a model. */
#define CLOSE_TO_EXTREME 0.01

/* Keeps the marked cells in which the field is close to the extreme `value`. */
static PetscErrorCode KeepClose(HycoFE fe, const HycoQuantity *q, const PetscReal u[], const PetscReal sigma[],
                                PetscReal value, PetscBool in[])
{
  HycoMesh m = fe->mesh;
  PetscInt node[HYCO_MAX_CELL_NODES];

  PetscFunctionBegin;
  for (PetscInt e = 0; e < m->n_cells; e++) {
    const PetscInt n = in[e] ? HycoMeshCellNodes(m, e, node) : 0;
    PetscReal least = PETSC_MAX_REAL, here;

    /* Displacements are at nodes: a cell is decisive if any of its nodes is. */
    for (PetscInt v = 0; v < n && q->field < XX; v++)
      least = PetscMin(least, PetscAbsReal(OfNode(fe, q->field, u, node[v]) - value));
    if (n && q->field >= XX) {
      PetscCall(OfCell(fe, q->field, sigma, e, &here));
      least = PetscAbsReal(here - value);
    }
    /* CLOSE_TO_EXTREME leaves room for the extreme to move to a neighbour within the model's error. */
    in[e] = (PetscBool)(in[e] && least <= CLOSE_TO_EXTREME * PetscAbsReal(value));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Keeps one marked cell, at a node of the group that a support holds along the axis. */
static PetscErrorCode KeepSupported(HycoFE fe, const HycoQuantity *q, PetscBool in[])
{
  HycoMesh m = fe->mesh;
  PetscInt of[HYCO_MAX_CELL_NODES], n, held = -1, kept = -1;
  Place p;

  PetscFunctionBegin;
  PetscCall(FindPlace(fe->scene, m, q, &p));
  n = p.group < 0 ? m->n_nodes : m->group_start[p.group + 1] - m->group_start[p.group];
  for (PetscInt k = 0; k < n && held < 0; k++) {
    const PetscInt i = p.group < 0 ? k : m->group_node[m->group_start[p.group] + k];

    if (HycoFESupports(fe, i * m->dim + q->field)) held = i;
  }
  /* One cell is enough: a balanced reaction is computed from loads and contact forces, and the cell only keeps a
     supported node in the RID. */
  for (PetscInt e = 0; e < m->n_cells && kept < 0; e++) {
    const PetscInt n_of = in[e] ? HycoMeshCellNodes(m, e, of) : 0;

    for (PetscInt v = 0; v < n_of; v++) kept = of[v] == held ? e : kept;
  }
  for (PetscInt e = 0; e < m->n_cells && kept >= 0; e++) in[e] = (PetscBool)(e == kept);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For derivatives: outputs are measured many times beside mu, and a maximum is decided by cells that are close to
   it. The others cannot become the largest within a small step, so that leaving them out changes nothing. */
PetscErrorCode HycoQuantitiesMarkDecisive(HycoFE fe, const PetscReal u[], const PetscReal sigma[],
                                          const PetscReal value[], const PetscBool without[], PetscBool balanced,
                                          PetscBool needed[])
{
  const HycoScene scene = fe->scene;
  HycoMesh m = fe->mesh;
  PetscBool *in;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_cells, &in));
  PetscCall(PetscArrayzero(needed, m->n_cells));
  for (PetscInt k = 0; k < scene->n_quantities; k++) {
    const HycoQuantity *q = &scene->quantity[k];

    if (without[k]) continue;
    PetscCall(HycoQuantityMarkCells(scene, m, k, in));
    /* Only extremes: a mean has no decisive cell, and needs all of its group. */
    if (q->kind < HYCO_QUANTITY_MEAN) PetscCall(KeepClose(fe, q, u, sigma, value[k], in));
    /* Rotated unknowns of oblique supports hold several axes at once, which one cell might not show. */
    if (q->kind == HYCO_QUANTITY_REACTION && balanced && !fe->n_oblique) PetscCall(KeepSupported(fe, q, in));
    for (PetscInt e = 0; e < m->n_cells; e++) needed[e] = (PetscBool)(needed[e] || in[e]);
  }
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Over all processes' copies: extremes need no owner. */
static void QuantitiesExtend(Sum *s, PetscReal value)
{
  s->most = PetscMax(s->most, value);
  s->least = PetscMin(s->least, value);
}

/* Adds a cell or facet with these nodes and the value of the cell (stress), or those of its nodes (NULL); the sums are
   integrals for a mean, which alone needs them, otherwise the weight counts. The owner of its first node adds it,
   so that each counts once over all processes. */
static PetscErrorCode AddEntity(HycoFE fe, const HycoQuantity *quantity, const PetscReal u[], const PetscReal sigma[],
                                PetscInt cell, PetscInt facet, const PetscReal *value, Sum *s)
{
  HycoMesh m = fe->mesh;
  const HycoElement *el = facet < 0 ? HycoElementGet(m->type) : HycoElementGetFacet(m->type);
  const PetscInt *node = facet < 0 ? m->cells + cell * m->nv : m->facets + facet * m->nf, field = quantity->field;
  const PetscReal *weight = NULL;
  PetscReal at[HYCO_CELL_NODES], of[HYCO_CELL_NODES] = {0}, all = 0;

  PetscFunctionBegin;
  if (value) QuantitiesExtend(s, *value);
  for (PetscInt a = 0; a < el->nv && !value; a++) {
    at[a] = OfNode(fe, field, u, node[a]);
    QuantitiesExtend(s, at[a]);
  }
  if (HycoMeshOwned(m, node[0]) < 0) PetscFunctionReturn(PETSC_SUCCESS); /* added by another process */
  s->weight += quantity->kind != HYCO_QUANTITY_MEAN;
  if (facet < 0 && quantity->kind == HYCO_QUANTITY_MEAN) PetscCall(HycoPointWeights(fe, el, cell, &weight));
  for (PetscInt q = 0; q < el->nq && quantity->kind == HYCO_QUANTITY_MEAN; q++) {
    PetscReal n[3], w = facet < 0 ? weight[q] : 0, here = value ? *value : 0;

    if (facet >= 0) {
      PetscCall(HycoFacetNormal(fe, el, facet, q, n));
      for (PetscInt c = 0; c < 3; c++) w += n[c] * n[c];
      /* The length of the normal is the weighted area. */
      w = PetscSqrtReal(w);
    }
    for (PetscInt a = 0; a < el->nv && !value; a++) here += el->N[q][a] * at[a];
    s->sum += w * here;
    s->weight += w;
    all += w;
    for (PetscInt a = 0; a < el->nv && s->slope; a++) of[a] += w * el->N[q][a];
  }
  if (s->slope && value) PetscCall(AddCellDerivative(fe, field, sigma, cell, all, s->slope));
  for (PetscInt a = 0; a < el->nv && s->slope && !value; a++) AddNodeDerivative(fe, field, u, node[a], of[a], s->slope);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds a group of points or lines: its nodes, or the cells around them. */
static PetscErrorCode AddNodes(HycoFE fe, const HycoQuantity *q, const PetscReal u[], const PetscReal sigma[],
                               const Place *p, Sum *s)
{
  HycoMesh m = fe->mesh;
  const PetscInt field = q->field;
  PetscBool *in;

  PetscFunctionBegin;
  for (PetscInt k = m->group_start[p->group]; field < XX && k < m->group_start[p->group + 1]; k++) {
    const PetscReal value = OfNode(fe, field, u, m->group_node[k]);

    QuantitiesExtend(s, value);
    /* Extremes may see a node twice, sums may not. */
    if (HycoMeshOwned(m, m->group_node[k]) < 0) continue;
    s->sum += value;
    s->weight += 1;
    if (s->slope) AddNodeDerivative(fe, field, u, m->group_node[k], 1, s->slope);
  }
  if (field < XX) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc1(m->n_cells, &in));
  PetscCall(MarkAround(m, p, in));
  for (PetscInt e = 0; e < m->n_cells; e++) {
    PetscReal value = 0;

    if (!in[e]) continue;
    PetscCall(OfCell(fe, field, sigma, e, &value));
    /* Stresses are constant in cells: those around the points stand for the value there. */
    PetscCall(AddEntity(fe, q, u, sigma, e, -1, &value, s));
  }
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks that the scene has the axis of a force. */
static PetscErrorCode CheckAxis(HycoFE fe, const HycoQuantity *q, const char what[])
{
  PetscFunctionBegin;
  HycoCheck(q->field < fe->dim, "output_%s: the mesh has %d space dimension%s and no %s along %c", q->name,
            (int)fe->dim, fe->dim == 1 ? "" : "s", what, "xyz"[q->field]);
  HycoCheck(q->field || fe->formulation != HYCO_AXISYMMETRIC,
            "output_%s: in an axisymmetric scene the %s along the radius x sums to zero; use y", q->name, what);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the supports' force along an axis at the nodes of a group, or at all; the weight counts the fixed unknowns.
   reaction: by unknown, along an oblique direction with the opposite sign. */
static PetscErrorCode AddReactions(HycoFE fe, const HycoQuantity *q, const PetscReal reaction[], Sum *s)
{
  HycoMesh m = fe->mesh;
  PetscInt n;
  Place p;

  PetscFunctionBegin;
  PetscCall(CheckAxis(fe, q, "reaction"));
  PetscCall(FindPlace(fe->scene, m, q, &p));
  n = p.group < 0 ? m->n_nodes : m->group_start[p.group + 1] - m->group_start[p.group];
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt i = p.group < 0 ? k : m->group_node[m->group_start[p.group] + k], dof = i * fe->dim + q->field;

    if (HycoMeshOwned(m, i) < 0) continue;
    /* Only supports: at other nodes the residual of equilibrium is contact, springs or round-off. */
    if (fe->fixed[dof]) s->sum += reaction[dof];
    s->weight += HycoFESupports(fe, dof);
    for (PetscInt c = 0; c < fe->dim; c++) {
      const HycoOblique *oblique = HycoFEOblique(fe, i * fe->dim + c);

      /* Its reaction is one number along the direction a; the axis has its component of it. */
      if (!oblique || oblique->a[q->field] == 0) continue;
      s->sum -= oblique->a[q->field] * reaction[i * fe->dim + c];
      s->weight += 1;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the results of one contact, or of all of them, or takes those of the part of quantity i. contact NULL: the scene
   is only checked, and the value is not a number. */
static PetscErrorCode AddContacts(HycoFE fe, PetscInt i, const HycoContactResult contact[], PetscReal *value)
{
  const HycoQuantity *q = &fe->scene->quantity[i];
  const PetscInt n = fe->scene->n_contacts, part = HycoQuantityOfPart(q) ? n + i : -1;
  const PetscBool turns = (PetscBool)(fe->dim == 3 || (fe->dim == 2 && q->field == 2));
  const PetscBool axisymmetric = (PetscBool)(fe->formulation == HYCO_AXISYMMETRIC);

  PetscFunctionBegin;
  if (q->kind == HYCO_QUANTITY_FORCE) PetscCall(CheckAxis(fe, q, "force"));
  if (q->kind == HYCO_QUANTITY_FRICTION && q->field != HYCO_FRICTION_WORK) PetscCall(CheckAxis(fe, q, "friction"));
  HycoCheck(q->kind != HYCO_QUANTITY_MOMENT || (turns && !axisymmetric), "output_%s: there is no moment about %c%s",
            q->name, "xyz"[q->field],
            axisymmetric   ? " in an axisymmetric scene"
            : fe->dim == 2 ? " in 2D; use z"
                           : " in 1D");
  /* The smallest pressure starts at the largest number, which any contact replaces. */
  *value = !contact ? NAN : q->kind == HYCO_QUANTITY_PRESSURE_MIN ? PETSC_MAX_REAL : 0;
  for (PetscInt c = part < 0 ? 0 : part; contact && c < (part < 0 ? n : part + 1); c++) {
    const HycoContactResult *r = &contact[c];

    /* Results of parts are stored after those of the contacts, at n + i. */
    if (part < 0 && q->contact && strcmp(q->contact, r->name)) continue;
    if (q->kind == HYCO_QUANTITY_PRESSURE)
      *value = PetscMax(*value, r->pressure);
    else if (q->kind == HYCO_QUANTITY_PRESSURE_MIN)
      *value = PetscMin(*value, r->pressure_min);
    else if (q->kind == HYCO_QUANTITY_AREA)
      *value += r->area;
    else if (q->kind == HYCO_QUANTITY_FRICTION)
      *value += q->field == HYCO_FRICTION_WORK ? r->friction_work : r->friction[q->field];
    else
      *value += q->kind == HYCO_QUANTITY_FORCE ? r->force[q->field] : r->moment[q->field];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A group of points or lines is evaluated at its nodes, one of cells or facets by entity. Stresses on a facet are those
   of its cell. */
static PetscErrorCode QuantitiesMeasure(HycoFE fe, const HycoQuantity *q, const PetscReal u[], const PetscReal sigma[],
                                        Sum *s)
{
  HycoMesh m = fe->mesh;
  PetscBool *in;
  Place p;

  PetscFunctionBegin;
  HycoCheck(q->field < UX || q->field > UZ || q->field - UX < fe->dim,
            "output_%s: the mesh has %d space dimension%s and no %s", q->name, (int)fe->dim, fe->dim == 1 ? "" : "s",
            HycoQuantityFields[q->field]);
  PetscCall(FindPlace(fe->scene, m, q, &p));
  if (p.dim < m->dim - 1) {
    PetscCall(AddNodes(fe, q, u, sigma, &p, s));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscCalloc1(m->n_cells, &in));
  if (p.dim == m->dim) MarkCells(m, &p, in);
  for (PetscInt k = 0; k < m->n_cells + m->n_facets; k++) {
    const PetscInt facet = k < m->n_cells ? -1 : k - m->n_cells, cell = facet < 0 ? k : m->facet_cell[facet];
    PetscReal value = 0;

    /* cell < 0: another process has the facet's cell. */
    if (facet < 0 ? !in[k] : p.dim == m->dim || m->facet_group[facet] != p.group || cell < 0) continue;
    if (q->field >= XX) PetscCall(OfCell(fe, q->field, sigma, cell, &value));
    PetscCall(AddEntity(fe, q, u, sigma, cell, facet, q->field >= XX ? &value : NULL, s));
  }
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A quantity from fields or reactions, summed over the processes. Collective. The least is negated, so that one
   MPI_MAX serves both ends. */
static PetscErrorCode MeasureBodies(MPI_Comm comm, HycoFE fe, const HycoQuantity *q, const PetscReal u[],
                                    const PetscReal sigma[], const PetscReal reaction[], PetscReal *value)
{
  const PetscBool is_reaction = (PetscBool)(q->kind == HYCO_QUANTITY_REACTION);
  Sum s = {.most = -PETSC_INFINITY, .least = PETSC_INFINITY};
  const char *group = q->group ? q->group : "any group";
  PetscReal ends[2], sums[2];

  PetscFunctionBegin;
  HycoOnEach(comm, is_reaction ? AddReactions(fe, q, reaction, &s) : QuantitiesMeasure(fe, q, u, sigma, &s));
  ends[0] = s.most;
  ends[1] = -s.least;
  sums[0] = s.sum;
  sums[1] = s.weight;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, ends, 2, MPIU_REAL, MPI_MAX, comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPIU_REAL, MPI_SUM, comm));
  /* After the sums: every process raises the same error. */
  HycoCheck(sums[1] > 0 || !is_reaction, "output_%s: no support fixes %c on %s", q->name, "xyz"[q->field], group);
  HycoCheck(sums[1] > 0, "output_%s: the group %s has no cell, facet or node", q->name,
            q->group ? q->group : "of all cells");
  *value = is_reaction                    ? sums[0]
           : q->kind == HYCO_QUANTITY_MAX ? ends[0]
           : q->kind == HYCO_QUANTITY_MIN ? -ends[1]
                                          : sums[0] / sums[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same cells, facets or nodes as in the mean. */
PetscErrorCode HycoQuantityMeanDerivative(HycoFE fe, PetscInt k, const PetscReal u[], const PetscReal sigma[],
                                          PetscReal slope[])
{
  Sum s = {.most = -PETSC_INFINITY, .least = PETSC_INFINITY, .slope = slope};

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(slope, fe->n_dof));
  PetscCall(QuantitiesMeasure(fe, &fe->scene->quantity[k], u, sigma, &s));
  for (PetscInt i = 0; i < fe->n_dof; i++) slope[i] /= s.weight;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* value[n_quantities] is the same on all ranks. */
PetscErrorCode HycoQuantitiesMeasure(MPI_Comm comm, HycoFE fe, const PetscBool without[], const PetscReal u[],
                                     const PetscReal sigma[], const PetscReal reaction[],
                                     const HycoContactResult contact[], PetscReal value[])
{
  const HycoScene scene = fe->scene;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < scene->n_quantities; k++) {
    if (without && without[k]) continue;
    /* Contacts' results are already summed over the ranks; those of bodies are summed here. */
    if (scene->quantity[k].kind >= HYCO_QUANTITY_FORCE)
      HycoOnEach(comm, AddContacts(fe, k, contact, &value[k]));
    else
      PetscCall(MeasureBodies(comm, fe, &scene->quantity[k], u, sigma, reaction, &value[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
