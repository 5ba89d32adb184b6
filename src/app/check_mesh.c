/* hyco check: cells, bodies and groups of the mesh. */
#include "check.h"
#include <hycokinematics.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Cells with a larger aspect ratio are reported: the solver can handle them, but they resolve poorly along their
   length. */
#define LONG_CELL 100
/* Share of the mesh's length up to which two nodes are at the same place. */
#define SAME_PLACE 1e-8
/* Groups with this share of common nodes are reported as alike. */
#define ALIKE 0.95

/* From the reference simplex to the regular one, inverted. */
static void ToRegular(PetscInt dim, PetscReal J[3][3])
{
  const PetscReal a = 1 / PetscSqrtReal(3), b = 1 / PetscSqrtReal(6);

  for (PetscInt c = 0; c < dim; c++) {
    const PetscReal x = J[c][0], y = J[c][1];

    J[c][1] = 2 * a * y - a * x;
    if (dim == 3) J[c][2] = PetscSqrtReal(1.5) * J[c][2] - b * (x + y);
  }
}

/* The map from the regular pyramid or prism at its axis. */
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
static PetscReal Stretch(HycoCellType shape, const PetscInt node[], const PetscReal X[], PetscInt q)
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

void CheckReportCells(Check *check, HycoFE fe)
{
  HycoMesh m = fe->mesh;

  for (PetscInt e = 0; e < m->n_cells && m->dim > 1; e++) {
    const PetscInt b = m->cell_body[e];
    const HycoCellType shape = HycoMeshShape(m, e);
    PetscInt node[HYCO_CELL_NODES];
    const PetscInt n = HycoMeshOwnNodes(m, e, node);

    for (PetscInt q = 0; q < (shape >= HYCO_N_MESH_TYPES || n == m->dim + 1 ? 1 : HycoElementGet(shape)->nq); q++) {
      const PetscReal stretch = Stretch(shape, node, fe->X, q);

      if (stretch <= check->stretch[b] * (1 + 1e-6)) continue; /* round-off, whose root remains for a square */
      check->stretch[b] = stretch;
      check->stretched[b] = m->cell_id[e];
    }
  }
}

static PetscInt Root(PetscInt part[], PetscInt i)
{
  while (part[i] != i) i = part[i] = part[part[i]];
  return i;
}

/* The number of parts of each body that share no node. */
static PetscErrorCode CountParts(HycoMesh m, PetscInt n_bodies, PetscInt n[])
{
  PetscInt *part;
  PetscBool *seen;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_nodes, &part));
  PetscCall(PetscMalloc1(m->n_nodes, &seen));
  for (PetscInt b = 0; b < n_bodies; b++) {
    n[b] = 0;
    for (PetscInt i = 0; i < m->n_nodes; i++) part[i] = i;
    PetscCall(PetscArrayzero(seen, m->n_nodes));
    for (PetscInt k = 0; k < m->n_cells * m->nv; k++) {
      if (m->cell_body[k / m->nv] == b) part[Root(part, m->cells[k])] = Root(part, m->cells[k - k % m->nv]);
    }
    for (PetscInt e = 0; e < m->n_cells; e++) {
      const PetscInt root = Root(part, m->cells[e * m->nv]);

      if (m->cell_body[e] != b || seen[root]) continue;
      seen[root] = PETSC_TRUE;
      n[b]++;
    }
  }
  PetscCall(PetscFree(part));
  PetscCall(PetscFree(seen));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks the nodes of contacts' and ties' surfaces: a body may touch itself there. */
static PetscErrorCode MarkSurfaces(HycoScene s, HycoMesh m, PetscBool of_surface[])
{
  PetscInt g = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < 2 * (s->n_contacts + s->n_ties); k++) {
    const PetscInt c = k / 2;
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
   the body is open there, like at a crack, though its cells may hang together elsewhere. */
static PetscErrorCode CountDoubled(HycoScene s, HycoMesh m, PetscInt n[], PetscInt pair[][2])
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
    for (PetscInt c = 0; c < 3; c++) place[i].at[c] = PetscFloorReal(m->xyz[3 * i + c] / step + 0.5);
  }
  qsort(place, (size_t)m->n_nodes, sizeof(*place), ComparePlaces);
  for (PetscInt k = 1; k < m->n_nodes; k++) {
    const Place *p = &place[k - 1], *q = &place[k];

    if (p->body != q->body || p->body < 0 || of_surface[p->node] || of_surface[q->node]) continue;
    if (memcmp(p->at, q->at, sizeof(p->at)) != 0) continue;
    if (!n[p->body]++) {
      pair[p->body][0] = m->node_id[p->node];
      pair[p->body][1] = m->node_id[q->node];
    }
  }
  PetscCall(PetscFree(place));
  PetscCall(PetscFree(of_surface));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckReportBodies(Check *check)
{
  HycoMesh m = check->whole->part;
  HycoScene s = check->fom->scene;
  cJSON *bodies = cJSON_AddArrayToObject(check->json, "bodies");
  PetscInt *parts, *doubled, (*pair)[2];

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(s->n_bodies, &parts));
  PetscCall(PetscCalloc1(s->n_bodies, &doubled));
  PetscCall(PetscCalloc1(s->n_bodies, &pair));
  PetscCall(CountParts(m, s->n_bodies, parts));
  PetscCall(CountDoubled(s, m, doubled, pair));
  for (PetscInt b = 0; b < s->n_bodies; b++) {
    cJSON *body = cJSON_CreateObject();
    PetscInt cells = 0;

    for (PetscInt e = 0; e < m->n_cells; e++) cells += m->cell_body[e] == b;
    cJSON_AddItemToArray(bodies, body);
    cJSON_AddStringToObject(body, "name", s->body[b].name);
    ReportNumbers(body, {"n_cells", cells}, {"n_parts", parts[b]}, {"n_doubled", doubled[b]},
                  {"stretch", check->stretch[b]}, {"stretched_cell", check->stretched[b]});
    PetscCall(DriverPrint("body %s: %d cells", s->body[b].name, (int)cells));
    if (m->dim > 1)
      PetscCall(DriverPrint("; the most stretched one, %d, is %.3g times as long as wide", (int)check->stretched[b],
                            (double)check->stretch[b]));
    PetscCall(DriverPrint("\n"));
    if (parts[b] > 1)
      CheckReportWarning(
          check,
          "body %s consists of %d parts that share no node; if it should be one piece, the mesh has duplicate "
          "nodes (gmsh: Coherence, or BooleanFragments)",
          s->body[b].name, (int)parts[b]);
    if (doubled[b])
      CheckReportWarning(
          check,
          "body %s: %d node%s on another node of the body, such as %d on %d; the body is open there, as at a "
          "crack; if it should be whole, the mesh has duplicate nodes (gmsh: Coherence, or BooleanFragments)",
          s->body[b].name, (int)doubled[b], doubled[b] == 1 ? " lies" : "s lie", (int)pair[b][1], (int)pair[b][0]);
    if (check->stretch[b] > LONG_CELL)
      CheckReportWarning(check, "body %s: cell %d is %.3g times as long as wide", s->body[b].name,
                         (int)check->stretched[b], (double)check->stretch[b]);
  }
  HycoFreeAll(&parts, &doubled, &pair);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The number of common nodes of the groups g and h; both are ascending. */
static PetscInt Common(HycoMesh m, PetscInt g, PetscInt h)
{
  PetscInt n = 0, j = m->group_start[h];

  for (PetscInt i = m->group_start[g]; i < m->group_start[g + 1]; i++) {
    while (j < m->group_start[h + 1] && m->group_node[j] < m->group_node[i]) j++;
    n += j < m->group_start[h + 1] && m->group_node[j] == m->group_node[i];
  }
  return n;
}

static void CheckTwins(Check *check, HycoMesh m)
{
  for (PetscInt g = 0; g < m->n_groups; g++) {
    for (PetscInt h = 0; h < g; h++) {
      const PetscInt n = m->group_start[g + 1] - m->group_start[g], k = m->group_start[h + 1] - m->group_start[h];
      PetscInt common;

      if (strcasecmp(m->group_name[g], m->group_name[h]) == 0)
        CheckReportWarning(
            check,
            "the groups %s and %s differ only in upper and lower case, which options do not distinguish; rename one",
            m->group_name[h], m->group_name[g]);
      if (m->group_dim[g] != m->group_dim[h] || !n || PetscMin(n, k) < ALIKE * PetscMax(n, k)) continue;
      common = Common(m, g, h);
      if (common == n && common == k)
        CheckReportWarning(check, "the groups %s and %s have the same nodes", m->group_name[h], m->group_name[g]);
      else if (common >= ALIKE * PetscMax(n, k))
        CheckReportWarning(check, "the groups %s (%d nodes) and %s (%d) have %d nodes in common", m->group_name[h],
                           (int)k, m->group_name[g], (int)n, (int)common);
    }
  }
}

/* Sets used[g] for the group `name`; fails if there is none. */
static PetscErrorCode Use(HycoMesh m, const char key[], const char name[], PetscBool used[])
{
  PetscInt g = 0;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(m, key, name, &g));
  used[g] = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks the groups used in the scene: bodies, supports, loads, contacts with the entries of their types, outputs, the
   region of interest. */
static PetscErrorCode MarkUsed(HycoScene s, HycoMesh m, PetscBool used[])
{
  char *region[64];
  PetscInt n = 64;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n_bodies; k++) PetscCall(Use(m, "body", s->body[k].name, used));
  for (PetscInt k = 0; k < s->n_fixed; k++) PetscCall(Use(m, "fixed", s->fixed[k].group, used));
  for (PetscInt k = 0; k < s->n_loads; k++) PetscCall(Use(m, "load", s->load[k].group, used));
  for (PetscInt k = 0; k < s->n_point_loads; k++) PetscCall(Use(m, "force", s->point_load[k].group, used));
  for (PetscInt k = 0; k < s->n_springs; k++) PetscCall(Use(m, "spring", s->spring[k].group, used));
  for (PetscInt k = 0; k < 2 * s->n_ties; k++)
    PetscCall(Use(m, "tie", k % 2 ? s->tie[k / 2].master : s->tie[k / 2].slave, used));
  for (PetscInt k = 0; k < s->n_contacts; k++) {
    for (PetscInt j = 0; j < s->contact[k]->entries.n; j++) {
      const HycoEntry *entry = &s->contact[k]->entries.entry[j];

      if (entry->kind == HYCO_ENTRY_GROUP && entry->text) PetscCall(Use(m, "contact", entry->text, used));
    }
  }
  for (PetscInt k = 0; k < s->n_quantities; k++) {
    if (s->quantity[k].group) PetscCall(Use(m, "output", s->quantity[k].group, used));
  }
  PetscCall(PetscOptionsGetStringArray(s->options, NULL, "-hyco_rid_groups", region, &n, NULL));
  for (PetscInt k = 0; k < n && n < 64; k++) {
    PetscCall(Use(m, "hyco_rid_groups", region[k], used));
    PetscCall(PetscFree(region[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckReportGroups(Check *check)
{
  HycoMesh m = check->whole->part;
  cJSON *unused = cJSON_AddArrayToObject(check->json, "unused_groups");
  char list[HYCO_LINE] = "";
  PetscBool *used;

  PetscFunctionBegin;
  CheckTwins(check, m);
  PetscCall(PetscCalloc1(m->n_groups, &used));
  PetscCall(MarkUsed(check->fom->scene, m, used));
  for (PetscInt g = 0; g < m->n_groups; g++) {
    if (used[g] && m->group_start[g] == m->group_start[g + 1])
      CheckReportWarning(check, "the group %s has no nodes of a body", m->group_name[g]);
    if (used[g]) continue;
    cJSON_AddItemToArray(unused, cJSON_CreateString(m->group_name[g]));
    PetscCall(HycoListAdd(list, ", ", m->group_name[g]));
  }
  if (list[0]) CheckReportWarning(check, "no entry of the scene uses these groups of the mesh: %s", list);
  PetscCall(PetscFree(used));
  PetscFunctionReturn(PETSC_SUCCESS);
}
