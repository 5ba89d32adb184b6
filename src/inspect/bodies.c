/* Cells and bodies of the mesh: shapes of cells, parts that share no node. */
#include "inspect.h"
#include <hycokinematics.h>
#include <stdlib.h>
#include <string.h>

/* Of the mesh's length, the distance of two nodes: mesh files have 9 digits or more, and no edge is as short. */
#define SAME_PLACE 1e-8

/* From the reference simplex to the regular one, inverted. Column by column: J maps from the element's reference
   simplex, whose edges are not alike; a regular cell must have the ratio 1. */
static void ToRegular(PetscInt dim, PetscReal J[3][3])
{
  const PetscReal a = 1 / PetscSqrtReal(3), b = 1 / PetscSqrtReal(6);

  for (PetscInt c = 0; c < dim; c++) {
    const PetscReal x = J[c][0], y = J[c][1];

    J[c][1] = 2 * a * y - a * x;
    if (dim == 3) J[c][2] = PetscSqrtReal(1.5) * J[c][2] - b * (x + y);
  }
}

/* The map from the regular pyramid or prism at its axis. They are stored as hexahedra with repeated nodes, and
   measured by dN a regular one would seem stretched where nodes coincide. */
static void FromAxis(HycoCellType shape, const PetscInt node[], const PetscReal X[], PetscReal J[3][3])
{
  for (PetscInt c = 0; c < 3; c++) {
    PetscReal x[6];

    for (PetscInt a = 0; a < HycoCellKinds[shape].nv; a++) x[a] = X[3 * node[a] + c];
    if (shape == HYCO_PYRAMID5) {
      J[c][0] = (x[1] - x[0] + x[2] - x[3]) / 2;
      J[c][1] = (x[3] - x[0] + x[2] - x[1]) / 2;
      J[c][2] = PetscSqrtReal(2) * (x[4] - (x[0] + x[1] + x[2] + x[3]) / 4); /* sides are 1, the height 1 / sqrt(2) */
    } else {
      J[c][0] = (x[1] - x[0] + x[4] - x[3]) / 2;
      J[c][1] = (x[2] - x[0] + x[5] - x[3]) / 2;
      J[c][1] = (2 * J[c][1] - J[c][0]) / PetscSqrtReal(3);
      J[c][2] = (x[3] + x[4] + x[5] - x[0] - x[1] - x[2]) / 3;
    }
  }
}

/* Aspect ratio of a cell at a quadrature point, 1 if it is regular there: k + sqrt(k^2 - 1) with the condition
   number k = |J| |J^-1| / dim in the Frobenius norm of the map from the regular cell. Exact for rectangles. */
static PetscReal InspectBodiesStretch(HycoCellType shape, const PetscInt node[], const PetscReal X[], PetscInt q)
{
  const HycoElement *el = HycoElementGet(shape);
  const PetscInt dim = HycoCellKinds[shape].dim;
  PetscReal J[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, norm = 0, inverse = 0, det = 0, k;

  if (shape >= HYCO_N_MESH_TYPES) FromAxis(shape, node, X, J);
  for (PetscInt c = 0; c < dim && shape < HYCO_N_MESH_TYPES; c++) {
    for (PetscInt d = 0; d < dim; d++) {
      J[c][d] = 0;
      for (PetscInt a = 0; a < el->nv; a++) J[c][d] += X[3 * node[a] + c] * el->dN[q][a][d];
    }
  }
  if (shape < HYCO_N_MESH_TYPES && el->nv == dim + 1) ToRegular(dim, J);
  for (PetscInt c = 0; c < dim; c++) {
    for (PetscInt d = 0; d < dim; d++) {
      const PetscInt c1 = (c + 1) % 3, c2 = (c + 2) % 3, d1 = (d + 1) % 3, d2 = (d + 2) % 3;
      /* In 1D and 2D the rest of J is the identity: the cofactors are those of the smaller matrix. */
      const PetscReal minor = J[c1][d1] * J[c2][d2] - J[c1][d2] * J[c2][d1];

      norm += J[c][d] * J[c][d];
      inverse += minor * minor;
      if (c == 0) det += J[c][d] * minor;
    }
  }
  k = PetscMax(PetscSqrtReal(norm * inverse) / (PetscAbsReal(det) * dim), 1); /* no division by 0, because K is
                                                                                 assembled */
  return k + PetscSqrtReal(k * k - 1);
}

/* The ratio varies inside a cell that is no simplex: the worst quadrature point counts. A one-dimensional cell has no
   shape. Long cells are less accurate, and slow down iterative solvers. */
void HycoInspectCells(HycoInspection *in, HycoFE fe)
{
  HycoMesh m = fe->mesh;

  for (PetscInt e = 0; e < m->n_cells && m->dim > 1; e++) {
    HycoBodyInspection *b = &in->body[m->cell_body[e]];
    const HycoCellType shape = HycoMeshShape(m, e);
    PetscInt node[HYCO_CELL_NODES];
    const PetscInt n = HycoMeshOwnNodes(m, e, node);

    for (PetscInt q = 0; q < (shape >= HYCO_N_MESH_TYPES || n == m->dim + 1 ? 1 : HycoElementGet(shape)->nq); q++) {
      const PetscReal stretch = InspectBodiesStretch(shape, node, fe->X, q);

      if (stretch <= b->stretch * (1 + 1e-6)) continue; /* round-off, whose root remains for a square */
      b->stretch = stretch;
      b->stretched = m->cell_id[e];
    }
  }
}

/* Halves the paths on the way: the trees stay flat. */
static PetscInt InspectBodiesRoot(PetscInt part[], PetscInt i)
{
  while (part[i] != i) i = part[i] = part[part[i]];
  return i;
}

/* The number of parts of each body that share no node. By union of the nodes of each cell, in turn for each body,
   so that bodies that share nodes do not join. */
static PetscErrorCode CountParts(HycoMesh m, PetscInt n_bodies, PetscInt n[])
{
  PetscInt *part;
  PetscBool *seen;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(m->n_nodes, &part, m->n_nodes, &seen));
  for (PetscInt b = 0; b < n_bodies; b++) {
    n[b] = 0;
    for (PetscInt i = 0; i < m->n_nodes; i++) part[i] = i;
    PetscCall(PetscArrayzero(seen, m->n_nodes));
    for (PetscInt k = 0; k < m->n_cells * m->nv; k++) {
      /* Joins each node of a cell with its first one. */
      if (m->cell_body[k / m->nv] == b)
        part[InspectBodiesRoot(part, m->cells[k])] = InspectBodiesRoot(part, m->cells[k - k % m->nv]);
    }
    for (PetscInt e = 0; e < m->n_cells; e++) {
      const PetscInt root = InspectBodiesRoot(part, m->cells[e * m->nv]);

      /* A part is counted by the first cell of its root, so that nodes without a cell of this body are none. */
      if (m->cell_body[e] != b || seen[root]) continue;
      seen[root] = PETSC_TRUE;
      n[b]++;
    }
  }
  PetscCall(PetscFree2(part, seen));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks the nodes of contacts' and ties' surfaces: a body may touch itself there. */
static PetscErrorCode MarkSurfaces(HycoScene s, HycoMesh m, PetscBool of_surface[])
{
  PetscInt g = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < 2 * (s->n_contacts + s->n_ties); k++) {
    const PetscInt c = k / 2;
    /* An obstacle has no master. */
    const char *name = c < s->n_contacts ? (k % 2 ? s->contact[c]->slave : s->contact[c]->master)
                                         : (k % 2 ? s->tie[c - s->n_contacts].slave : s->tie[c - s->n_contacts].master);

    if (!name) continue;
    PetscCall(HycoMeshFindGroup(m, "contact", name, &g));
    for (PetscInt i = m->group_start[g]; i < m->group_start[g + 1]; i++) of_surface[m->group_node[i]] = PETSC_TRUE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A node's place in steps of SAME_PLACE, and its body. */
typedef struct {
  double at[3];
  PetscInt body, node;
} Place;

/* By place, then body, then node: nodes at one place are neighbours afterwards, and the order is the same on every
   machine, which qsort() alone does not promise for equal ones. */
static int ComparePlaces(const void *a, const void *b)
{
  const Place *p = (const Place *)a, *q = (const Place *)b;

  for (PetscInt c = 0; c < 3; c++) {
    if (p->at[c] != q->at[c]) return p->at[c] < q->at[c] ? -1 : 1;
  }
  if (p->body != q->body) return p->body < q->body ? -1 : 1;
  return (p->node > q->node) - (p->node < q->node);
}

/* By body, the number of its nodes that lie on another of its nodes, away from contacts and ties, and the first pair:
   the body is open there, like at a crack, though its cells may hang together elsewhere. After sorting by place,
   equal ones are neighbours: O(n log n). */
static PetscErrorCode CountDoubled(HycoScene s, HycoMesh m, HycoBodyInspection body[])
{
  const PetscReal step = SAME_PLACE * HycoMeshLength(m);
  PetscBool *of_surface;
  Place *place;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_nodes, &place));
  PetscCall(PetscCalloc1(m->n_nodes, &of_surface));
  PetscCall(MarkSurfaces(s, m, of_surface));
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    place[i] = (Place){.body = m->node_body[i], .node = i};
    /* Rounded to a grid that is much finer than any cell: coordinates of a mesh file have some digits only. */
    for (PetscInt c = 0; c < 3; c++) place[i].at[c] = PetscFloorReal(m->xyz[3 * i + c] / step + 0.5);
  }
  qsort(place, (size_t)m->n_nodes, sizeof(*place), ComparePlaces);
  for (PetscInt k = 1; k < m->n_nodes; k++) {
    const Place *p = &place[k - 1], *q = &place[k];

    if (p->body != q->body || p->body < 0 || of_surface[p->node] || of_surface[q->node]) continue;
    if (memcmp(p->at, q->at, sizeof(p->at)) != 0) continue;
    /* The first pair is named, by the tags of the file, for the user to look at. */
    if (!body[p->body].n_doubled++) {
      body[p->body].doubled[0] = m->node_id[p->node];
      body[p->body].doubled[1] = m->node_id[q->node];
    }
  }
  HycoFreeAll(&place, &of_surface);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The types of cells that occur, with their numbers. A mixed mesh stores all cells as hexahedra with repeated
   nodes: HycoMeshShape() gives what they are. */
static PetscErrorCode CountTypes(HycoInspection *in, HycoMesh m)
{
  PetscInt n[HYCO_N_CELL_TYPES] = {0};

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(HYCO_N_CELL_TYPES, &in->type, HYCO_N_CELL_TYPES, &in->cells));
  for (PetscInt e = 0; e < m->n_cells; e++) n[HycoMeshShape(m, e)]++;
  for (int t = 0; t < HYCO_N_CELL_TYPES; t++) {
    if (!n[t]) continue;
    in->type[in->n_types] = HycoCellKinds[t].name;
    in->cells[in->n_types++] = n[t];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0, on the whole mesh: parts of ranks would cut bodies. Names are borrowed from the scene. */
PetscErrorCode HycoInspectBodies(HycoInspection *in)
{
  HycoMesh m = in->whole->part;
  PetscInt *parts;

  PetscFunctionBegin;
  PetscCall(CountTypes(in, m));
  PetscCall(PetscMalloc1(in->n_bodies, &parts));
  PetscCall(CountParts(m, in->n_bodies, parts));
  PetscCall(CountDoubled(in->whole->scene, m, in->body));
  for (PetscInt b = 0; b < in->n_bodies; b++) {
    in->body[b].name = in->whole->scene->body[b].name;
    in->body[b].n_parts = parts[b];
  }
  for (PetscInt e = 0; e < m->n_cells; e++) in->body[m->cell_body[e]].n_cells++;
  PetscCall(PetscFree(parts));
  PetscFunctionReturn(PETSC_SUCCESS);
}
