/* Models whose surfaces move past each other: what their programs search on, and the problem before its contacts. */
#include "travel.h"
#include <hycobodies.h>
#include <hycosamples.h>
#include <string.h>

#define POINTS 9 /* at which it is found out which bodies turn and which displacements are prescribed */
/* Of an entry of Q, which is at most 1: 4500 eps, the fit of a rotation to thousands of nodes. */
#define TURNED_ENTRY 1e-12

PetscErrorCode HycoTravelDestroy(HycoTravel *travel)
{
  PetscFunctionBegin;
  if (!*travel) PetscFunctionReturn(PETSC_SUCCESS);
  HycoFreeAll(&(*travel)->value, &(*travel)->node, travel);
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define ADD_VALUE(t, ...) HYCO_APPEND((t)->n_values, (t)->value, (TravelValue){__VA_ARGS__})

/* Moves the model. */
static PetscErrorCode MovedSurfaceUpdate(HycoTravel t, const PetscReal mu[])
{
  const HycoBodiesSurface s = HycoBodiesSurfaceOf(t->m);
  const PetscInt n = t->m->model->scene->n_parameters;
  PetscBool same;

  PetscFunctionBegin;
  PetscCall(PetscArraycmp(mu, t->mu, n, &same));
  if (same && t->placed) PetscFunctionReturn(PETSC_SUCCESS);
  t->placed = PETSC_FALSE;
  PetscCall(HycoROMBringRows(t->m, mu));
  PetscCall(HycoBodiesPrepare(t->bodies, &s, mu));
  PetscCall(PetscArraycpy(t->mu, mu, n));
  t->placed = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- what cannot be exported -- */

static PetscErrorCode MovedSurfaceCheck(HycoROM m)
{
  const HycoFE fe = m->fe;
  const HycoScene s = m->model->scene;

  PetscFunctionBegin;
  HycoCheck(
      !HycoMeshIsQuadratic(fe->mesh) && fe->dim > 1,
      "export: contacts that travel on cells of second order, or in 1D, cannot be exported; use cells of first order");
  HycoCheck(
      !fe->n_turned && !fe->n_oblique,
      "export: contacts that travel beside supports along directions, or with -hyco_regularise, cannot be exported");
  for (PetscInt c = 0; c < s->n_contacts; c++) {
    const HycoContact of = s->contact[c];

    HycoCheck(HycoPairsFollows(&m->pairs, c) && !of->integrated && of->master,
              "export: contact %s: where contacts travel, only those of type surface that do can be exported",
              of->name);
    HycoCheck(HycoContactAverages(of) && !of->gap,
              "export: contact %s: a normal or a gap that the scene gives cannot be exported where contacts travel",
              of->name);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- samples -- */

/* The product of Lagrange's polynomials of sample j of a body. */
static PetscErrorCode WriteWeight(HycoSubstructures b, PetscInt k, PetscInt j, HycoScene s, HycoText *t)
{
  const HycoTensor *of = &b->body[k].tensor;
  PetscReal factor = 1;

  PetscFunctionBegin;
  for (PetscInt p = b->n_theta - 1; p >= 0; j /= of->n[p], p--) {
    const PetscInt at = j % of->n[p];
    char x[HYCO_LINE];

    HycoFormat(x, "%s%s%s",
               b->variable[p] == HYCO_BODIES_LOGARITHM    ? "ln("
               : b->variable[p] == HYCO_BODIES_RECIPROCAL ? "(-1/"
                                                          : "(",
               s->parameter[b->theta[p]], ")");
    for (PetscInt i = 0; i < of->n[p]; i++) {
      if (i == at) continue;
      factor /= of->x[p][at] - of->x[p][i];
      PetscCall(HycoTextAdd(t, "(%s-(%.17g))*", x, (double)of->x[p][i]));
    }
  }
  PetscCall(HycoTextAdd(t, "(%.17g)", (double)factor));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoExportWeights(HycoROM m, PetscInt *n, char ***text)
{
  const HycoSubstructures b = (HycoSubstructures)m->model->data;

  PetscFunctionBegin;
  *n = 0;
  *text = NULL;
  for (PetscInt k = 0; k < b->n; k++) {
    for (PetscInt j = 0; j < b->body[k].n_samples && b->body[k].n_samples > 1; j++) {
      HycoText t = {0};
      PetscBool known = PETSC_FALSE;

      PetscCall(WriteWeight(b, k, j, m->model->scene, &t));
      for (PetscInt i = 0; i < *n && !known; i++) known = (PetscBool)!strcmp((*text)[i], t.text);
      if (known) PetscCall(PetscFree(t.text));
      if (known) continue;
      PetscCall(PetscRealloc((size_t)(*n + 1) * sizeof(**text), text));
      (*text)[(*n)++] = t.text;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- surfaces -- */

/* Marks the nodes of the contacts' facets, and numbers them. */
static PetscErrorCode FindNodes(HycoTravel t, HycoExportModel *out, PetscInt number[])
{
  HycoMesh m = t->m->fe->mesh;
  const HycoScene s = t->m->model->scene;
  Surfaces *u = &out->m.surfaces;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < m->n_nodes; i++) number[i] = -1;
  for (PetscInt c = 0; c < 2 * s->n_contacts; c++) {
    const char *group = c % 2 ? s->contact[c / 2]->master : s->contact[c / 2]->slave;
    PetscInt g = 0;

    PetscCall(HycoMeshFindGroup(m, "contact", group, &g));
    for (PetscInt f = 0; f < m->n_facets; f++) {
      for (PetscInt a = 0; a < m->nf && m->facet_group[f] == g; a++) number[m->facets[f * m->nf + a]] = 0;
    }
  }
  PetscCall(PetscMalloc1(m->n_nodes + t->m->pairs.n, &t->node));
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    if (number[i] < 0) continue;
    HycoCheck(HycoMeshTied(m, i) < 0, "export: contacts that travel on tied nodes, as node %d, cannot be exported",
              (int)m->node_id[i]);
    t->node[u->n_nodes] = i;
    number[i] = u->n_nodes++; /* ascending, as in the mesh */
  }
  /* A slave on an edge is a node of each of its sides. */
  for (PetscInt k = 0; k < t->m->pairs.n; k++) {
    if (t->m->pairs.side[k] != HYCO_ONE_SIDE) t->node[u->n_nodes++] = t->m->pairs.slave[k];
  }
  PetscCall(PetscMalloc1(u->n_nodes, &u->body));
  PetscCall(PetscMalloc1(3 * u->n_nodes, &u->drawn));
  for (PetscInt i = 0; i < u->n_nodes; i++) {
    u->body[i] = (int)m->node_body[t->node[i]];
    PetscCall(PetscArraycpy(u->drawn + 3 * i, m->xyz + 3 * t->node[i], 3));
  }
  PetscCall(PetscMalloc1(3 * s->n_bodies, &u->map));
  for (PetscInt k = 0; k < 3 * s->n_bodies; k++) {
    const HycoExpr map = s->body[k / 3].map[k % 3];
    PetscInt at = -1;

    if (map) PetscCall(HycoParse(s, HycoExportEntry(s, HycoExprKey(map)), NULL, NULL, &out->code, &at, NULL, NULL));
    HycoCheck(!map || at >= 0, "export: the map %s cannot be exported: it is no expression that is known",
              HycoExprKey(map));
    u->map[k] = (int)at;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A group's facets and border, as the search has them. */
static PetscErrorCode AddSurface(HycoTravel t, PetscInt group, const PetscInt number[], HycoExportModel *out)
{
  const HycoFE fe = t->m->fe;
  Surfaces *u = &out->m.surfaces;
  Surface *of = &u->surface[out->n_surfaces];
  HycoMasterSearch search;

  PetscFunctionBegin;
  PetscCall(HycoMasterSearchCreateOn(fe, group, group, PETSC_FALSE, &search));
  PetscCall(HycoMasterSearchBorder(&search));
  of->first = out->n_surfaces ? of[-1].first + of[-1].n : 0;
  of->n = search.n;
  of->n_border = search.n_border;
  of->border = 2 * out->n_border;
  of->at_border = out->n_surfaces * u->n_nodes;
  of->side = search.n && fe->mirrored[fe->mesh->node_body[search.node[0]]] ? -1 : 1;
  PetscCall(PetscRealloc((size_t)((of->first + of->n) * u->nf + 1) * sizeof(*u->facet), &u->facet));
  PetscCall(PetscRealloc((size_t)(of->border + 2 * of->n_border + 1) * sizeof(*u->border), &u->border));
  PetscCall(PetscRealloc((size_t)(of->at_border + u->n_nodes + 1) * sizeof(*u->at_border), &u->at_border));
  for (PetscInt k = 0; k < of->n * u->nf; k++) u->facet[of->first * u->nf + k] = number[search.node[k]];
  for (PetscInt k = 0; k < 2 * of->n_border; k++) u->border[of->border + k] = number[search.border[k]];
  for (PetscInt i = 0; i < u->n_nodes; i++) u->at_border[of->at_border + i] = search.at_border[t->node[i]];
  u->n_facets = PetscMax(u->n_facets, of->n);
  out->n_facets += of->n;
  out->n_border += of->n_border;
  out->n_surfaces++;
  PetscCall(HycoMasterSearchDestroy(&search));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The shape functions at the points of a facet. */
static PetscErrorCode TakeElement(const HycoFE fe, Surfaces *u)
{
  const HycoElement *el = HycoElementGetFacet(fe->mesh->type);

  PetscFunctionBegin;
  u->dim = fe->dim;
  u->nf = el->nv;
  u->nq = el->nq;
  u->around = fe->formulation == HYCO_AXISYMMETRIC ? 2 * PETSC_PI : 0;
  u->touches = HycoContactTouches(fe);
  PetscCall(PetscMalloc1(el->nq, &u->w));
  PetscCall(PetscMalloc1(el->nq * el->nv, &u->N));
  PetscCall(PetscMalloc1(2 * el->nq * el->nv, &u->dN));
  for (PetscInt k = 0; k < el->nq * el->nv; k++) {
    const PetscInt q = k / el->nv, a = k % el->nv;

    u->w[q] = el->w[q];
    u->N[k] = el->N[q][a];
    for (PetscInt d = 0; d < 2; d++) u->dN[2 * k + d] = el->dN[q][a][d];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The slaves' nodes: of those on edges the ones that FindNodes() has added, which their sides' facets get as well. */
static PetscErrorCode PlaceSlaves(HycoTravel t, const PetscInt number[], Surfaces *u)
{
  const HycoPairs *pairs = &t->m->pairs;
  const HycoMesh m = t->m->fe->mesh;
  PetscInt next = u->n_nodes;

  PetscFunctionBegin;
  for (PetscInt k = pairs->n - 1; k >= 0; k--) {
    PetscInt g = 0, *at = u->facet + u->surface[2 * pairs->contact[k]].first * u->nf;

    u->search[pairs->contact[k]].first = k;
    u->search[pairs->contact[k]].n++;
    u->slave[k] = number[pairs->slave[k]];
    if (pairs->side[k] == HYCO_ONE_SIDE) continue;
    u->slave[k] = --next;
    PetscCall(HycoMeshFindGroup(m, "contact", t->m->model->scene->contact[pairs->contact[k]]->slave, &g));
    for (PetscInt f = 0; f < m->n_facets * m->nf; f++) {
      if (m->facet_group[f / m->nf] != g) continue;
      if (m->facets[f] == pairs->slave[k] && m->facet_side[f] == pairs->side[k]) *at = u->slave[k];
      at++;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Slave and master of each contact of the scene, and its slave nodes. */
static PetscErrorCode FindSurfaces(HycoTravel t, const PetscInt number[], HycoExportModel *out)
{
  const HycoScene s = t->m->model->scene;
  const HycoPairs *pairs = &t->m->pairs;
  Surfaces *u = &out->m.surfaces;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(s->n_contacts, &u->search));
  PetscCall(PetscCalloc1(s->n_contacts, &u->reach));
  PetscCall(PetscCalloc1(2 * s->n_contacts, &u->surface));
  PetscCall(PetscMalloc1(pairs->n, &u->slave));
  u->n_searches = s->n_contacts;
  for (PetscInt c = 0; c < s->n_contacts; c++) {
    PetscInt g[2] = {0, 0};

    PetscCall(HycoMeshFindGroup(t->m->fe->mesh, "contact", s->contact[c]->slave, &g[0]));
    PetscCall(HycoMeshFindGroup(t->m->fe->mesh, "contact", s->contact[c]->master, &g[1]));
    for (PetscInt k = 0; k < 2; k++) PetscCall(AddSurface(t, g[k], number, out));
    u->search[c] = (Facing){.slave = 2 * c, .master = 2 * c + 1, .edges = pairs->search[c].edges};
    u->reach[c] = pairs->search[c].reach;
  }
  PetscCall(PlaceSlaves(t, number, u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The places of the nodes' unknowns; those that supports prescribe somewhere in the ranges, and the bodies that turn,
   have values. turns: by body. */
static PetscErrorCode FindPlaces(HycoTravel t, const PetscBool moves[], const PetscBool turns[], HycoExportModel *out)
{
  const HycoSubstructures b = t->bodies->bodies;
  const HycoFE fe = t->m->fe;
  Surfaces *u = &out->m.surfaces;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(u->n_nodes * u->dim, &u->place));
  PetscCall(PetscMalloc1(u->n_nodes * u->dim, &u->given));
  PetscCall(PetscMalloc1(u->n_nodes, &u->pose));
  for (PetscInt k = 0; k < b->n; k++) {
    for (PetscInt term = 0; term < b->body[k].C.n_terms; term++) ADD_VALUE(t, FLEXIBLE, k, term);
  }
  for (PetscInt i = 0; i < u->n_nodes; i++) {
    PetscInt body = -1;

    for (PetscInt c = 0; c < u->dim; c++) {
      const PetscInt dof = t->node[i] * u->dim + c, at = t->bodies->loc[dof];

      u->place[i * u->dim + c] = fe->fixed[dof] ? PRESCRIBED : at >= 0 && at < b->ns ? (int)at : UNKNOWN;
      u->given[i * u->dim + c] = -1;
      if (u->place[i * u->dim + c] >= 0) body = HycoBodiesAt(b, at);
      if (!fe->fixed[dof] || !moves[dof]) continue;
      u->given[i * u->dim + c] = (int)t->n_values;
      ADD_VALUE(t, HELD, dof, 0);
    }
    u->pose[i] = body >= 0 && turns[body] ? -2 - (int)body : -1;
  }
  for (PetscInt k = 0; k < b->n; k++) {
    for (PetscInt i = 0; i < u->n_nodes && turns[k]; i++) {
      if (u->pose[i] == -2 - (int)k) u->pose[i] = (int)t->n_values;
    }
    for (PetscInt e = 0; e < 9 && turns[k]; e++) ADD_VALUE(t, TURN, k, e);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* moves: by unknown, whether a displacement is prescribed that is not 0; turns: by body. */
static PetscErrorCode FindMotions(HycoTravel t, PetscBool moves[], PetscBool turns[])
{
  const HycoFE fe = t->m->fe;
  HycoSamples samples;
  const PetscReal *mu;
  PetscInt n;
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  PetscCall(HycoSamplesCreate(t->m->model->scene, &samples));
  PetscCall(HycoSamplesAddScattered(samples, POINTS));
  PetscCall(HycoSamplesGet(samples, &n, NULL, &mu));
  for (PetscInt i = 0; i < n && !ierr; i++) {
    ierr = MovedSurfaceUpdate(t, mu + i * t->m->model->scene->n_parameters);
    for (PetscInt k = 0; k < fe->n_dof && !ierr; k++)
      moves[k] = (PetscBool)(moves[k] || (fe->fixed[k] && fe->u0[k] != 0));
    for (PetscInt k = 0; k < 9 * t->bodies->bodies->n && !ierr; k++)
      turns[k / 9] =
          (PetscBool)(turns[k / 9] || PetscAbsReal(t->bodies->pose[k / 9].Q[k % 9] - (k % 9 % 4 == 0)) > TURNED_ENTRY);
  }
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MovedSurfaceMake(HycoTravel t, HycoExportModel *out)
{
  PetscInt *number;
  PetscBool *moves, *turns;

  PetscFunctionBegin;
  PetscCall(MovedSurfaceCheck(t->m));
  t->bodies = (HycoBodiesWork)t->m->work;
  PetscCall(TakeElement(t->m->fe, &out->m.surfaces));
  PetscCall(PetscMalloc1(t->m->fe->mesh->n_nodes, &number));
  PetscCall(PetscCalloc2(t->m->fe->n_dof, &moves, t->bodies->bodies->n, &turns));
  PetscCall(FindNodes(t, out, number));
  PetscCall(FindSurfaces(t, number, out));
  PetscCall(FindMotions(t, moves, turns));
  PetscCall(FindPlaces(t, moves, turns, out));
  PetscCall(PetscFree2(moves, turns));
  PetscCall(PetscFree(number));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether parameters move a surface whose masters are searched for: a map without any only places it. */
static PetscErrorCode MovedSurfaceIsMoving(HycoROM m, PetscBool *travels)
{
  const HycoScene s = m->model->scene;
  const HycoMesh mesh = m->fe->mesh;
  PetscBool all[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  *travels = PETSC_FALSE;
  for (PetscInt p = 0; p < HYCO_MAX_PARAMETERS; p++) all[p] = PETSC_TRUE;
  for (PetscInt c = 0; c < 2 * s->n_contacts; c++) {
    PetscInt g = 0;

    if (!HycoPairsFollows(&m->pairs, c / 2)) continue;
    PetscCall(HycoMeshFindGroup(mesh, "contact", c % 2 ? s->contact[c / 2]->master : s->contact[c / 2]->slave, &g));
    for (PetscInt k = 0; k < 3 * mesh->n_facets; k++) {
      const HycoExpr map = s->body[mesh->node_body[mesh->facets[k / 3 * mesh->nf]]].map[k % 3];

      *travels = (PetscBool)(*travels || (mesh->facet_group[k / 3] == g && HycoExprChanges(map, all)));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTravelCreate(HycoROM m, HycoExportModel *out, HycoTravel *travel)
{
  HycoTravel t;
  PetscBool travels;

  PetscFunctionBegin;
  *travel = NULL;
  PetscCall(MovedSurfaceIsMoving(m, &travels));
  if (!travels) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscNew(&t));
  t->m = m;
  *travel = t;
  PetscCall(MovedSurfaceMake(t, out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the problem -- */

void HycoTravelUnknowns(HycoTravel t, PetscReal z[])
{
  const PetscInt p = t->bodies->bodies->p;

  for (PetscInt i = 0; i < p; i++) z[i] = t->bodies->x[i];
  for (PetscInt i = 0; i < t->bodies->bodies->ns; i++) z[p + i] = t->bodies->f[i];
}

PetscErrorCode HycoTravelResidual(HycoTravel t, const PetscReal mu[], const PetscReal z[], PetscReal w[])
{
  const HycoBodiesWork o = t->bodies;
  const HycoSubstructures b = o->bodies;

  PetscFunctionBegin;
  PetscCall(MovedSurfaceUpdate(t, mu));
  PetscCall(PetscArrayzero(t->m->Lambda, t->m->model->pairs.n));
  PetscCall(PetscArraycpy(o->x, z, b->p));
  PetscCall(HycoBodiesRespond(o, z + b->p));
  HycoBodiesWorkOnMotions(o, w);
  for (PetscInt k = 0; k < b->ns; k++) w[b->p + k] = -o->u[k];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTravelMotions(HycoTravel t, const PetscReal mu[], PetscReal Z[])
{
  PetscFunctionBegin;
  PetscCall(MovedSurfaceUpdate(t, mu));
  PetscCall(PetscArraycpy(Z, t->bodies->Z, t->bodies->bodies->ns * t->bodies->bodies->p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal HycoTravelValue(HycoTravel t, PetscInt i)
{
  const TravelValue *v = &t->value[i];

  if (v->from == FLEXIBLE && t->bodies->bodies->body[v->index].n_samples > 1)
    return t->bodies->share[v->index][v->part] / t->bodies->kappa[v->index];
  if (v->from == FLEXIBLE) return 1 / t->bodies->kappa[v->index];
  return v->from == HELD ? t->m->fe->u0[v->index] : t->bodies->pose[v->index].Q[v->part];
}

PetscInt HycoTravelBody(HycoTravel t, PetscInt body)
{
  const HycoSubstructures b = t->bodies->bodies;

  for (PetscInt i = 0; i < t->n_values; i++) {
    const PetscInt k = t->value[i].index;

    if (t->value[i].from == TURN && b->probe->cell_body[b->cell[k]] == body) return k;
  }
  return -1;
}

PetscReal HycoTravelNumbers(HycoTravel t)
{
  PetscReal sum = 0;

  for (PetscInt k = 0; k < t->bodies->bodies->n; k++)
    sum += t->bodies->bodies->body[k].C.n_terms * PetscSqr((PetscReal)t->bodies->bodies->body[k].n);
  return sum;
}

PetscErrorCode HycoTravelBlocks(HycoTravel t, PetscInt first, HycoExportModel *out)
{
  const HycoSubstructures b = t->bodies->bodies;
  Surfaces *u = &out->m.surfaces;
  size_t at = 0;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < u->n_nodes * u->dim; i++) u->given[i] += u->given[i] < 0 ? 0 : (int)first;
  for (PetscInt i = 0; i < u->n_nodes; i++) u->pose[i] += u->pose[i] < 0 ? 0 : (int)first;
  out->n_flexible = (PetscInt)HycoTravelNumbers(t);
  PetscCall(PetscMalloc1(out->n_flexible + 1, &out->m.flexibility));
  PetscCall(PetscMalloc1(t->n_values + 1, &out->m.block));
  for (PetscInt i = 0; i < t->n_values && t->value[i].from == FLEXIBLE; i++) {
    const HycoFlexibility *f = &b->body[t->value[i].index].C;
    const size_t n = (size_t)f->n;

    if (!n) continue;
    out->m.block[out->m.n_blocks++] = (Block){(int)b->start[t->value[i].index], (int)n, (int)(first + i), (int)at};
    for (size_t k = 0; k < n * n; k++)
      out->m.flexibility[at++] = HycoFlexibilityEntry(f, t->value[i].part, (PetscInt)(k / n), (PetscInt)(k % n));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
