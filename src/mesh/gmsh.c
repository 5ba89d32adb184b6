/*
  The mesh file, read by gmsh's own library (formats 2.2 and 4.1, text and binary) on one process and checked: what
  comes out has finite coordinates, cells of one type, each in one body, facets that bound exactly one cell.
*/
#include <hycomesh.h>
#include "libgmsh.h"
#include "msh.h"
#include <locale.h>
#include <stdio.h>
#include <string.h>

/* gmsh's element types in the order of HycoCellType. */
static const int gmsh_type[HYCO_N_CELL_TYPES] = {1, 2, 3, 4, 5};
static const PetscInt cell_dim[HYCO_N_CELL_TYPES] = {1, 2, 2, 3, 3};
static const PetscInt cell_nodes[HYCO_N_CELL_TYPES] = {2, 3, 4, 4, 8};
static const PetscInt facet_nodes[HYCO_N_CELL_TYPES] = {1, 2, 2, 3, 4};

static const HycoGmsh *gmsh;

/* What one physical group holds, as read. */
typedef struct {
  int dim, tag;
  char name[256];
  PetscInt body;  /* index in scene->body or -1 */
  PetscInt n, nv; /* elements and nodes of each */
  PetscInt inner; /* facets between two cells */
  size_t *node, *id;
} Group;

typedef struct {
  PetscInt n_groups, dim;
  Group *group;
  size_t *tag; /* ascending tags of the kept nodes */
  PetscInt n_tags;
  PetscInt *last, *before;  /* of each cell its last facet, of each facet the cell's one before, or -1 */
  PetscInt *start, *around; /* the cells around each node */
  size_t *node;             /* node tags of the cells */
} Reader;

static PetscErrorCode CheckGmsh(int ierr, const char path[])
{
  char *why = NULL;
  int ignore;
  char line[HYCO_LINE];

  PetscFunctionBegin;
  if (!ierr) PetscFunctionReturn(PETSC_SUCCESS);
  gmsh->gmshLoggerGetLastError(&why, &ignore);
  snprintf(line, sizeof(line), "%s", why ? why : "unknown");
  gmsh->gmshFree(why);
  HycoFail("the mesh %s cannot be read: %s", path, line);
}

/* Appends elements of the types to the group. */
static PetscErrorCode AddElements(const char path[], Group *g, size_t n_types, const int types[], size_t *const ids[],
                                  const size_t n_ids[], size_t *const nodes[], const size_t n_nodes[])
{
  PetscFunctionBegin;
  for (size_t t = 0; t < n_types; t++) {
    PetscInt nv = n_ids[t] ? (PetscInt)(n_nodes[t] / n_ids[t]) : 0;
    int known = types[t] == 15;

    for (int k = 0; k < HYCO_N_CELL_TYPES; k++) known = known || types[t] == gmsh_type[k];
    HycoCheck(
        known,
        "%s: group \"%s\" has elements of gmsh type %d; hyco takes line2, tri3, quad4, tet4 and hex8 (first order)",
        path, g->name, types[t]);
    if (!n_ids[t]) continue;
    HycoCheck(!g->n || g->nv == nv, "%s: group \"%s\" mixes elements of %d and %d nodes; hyco takes one type per mesh",
              path, g->name, (int)g->nv, (int)nv);
    g->nv = nv;
    HycoCheck((size_t)g->n + n_ids[t] <= (size_t)PETSC_MAX_INT / 8, "%s: group \"%s\" has too many elements", path,
              g->name);
    PetscCall(PetscRealloc(((size_t)g->n + n_ids[t]) * sizeof(size_t), &g->id));
    PetscCall(PetscRealloc(((size_t)g->n + n_ids[t]) * (size_t)nv * sizeof(size_t), &g->node));
    PetscCall(PetscArraycpy(g->id + g->n, ids[t], n_ids[t]));
    PetscCall(PetscArraycpy(g->node + (size_t)g->n * (size_t)nv, nodes[t], n_nodes[t]));
    g->n += (PetscInt)n_ids[t];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Appends the elements of one entity to its group. */
static PetscErrorCode ReadEntity(const char path[], Group *g, int entity)
{
  int *types = NULL, ierr;
  size_t n_types = 0, **ids = NULL, *n_ids = NULL, nn = 0, **nodes = NULL, *n_nodes = NULL, mm = 0;
  PetscErrorCode refused = 0;

  PetscFunctionBegin;
  gmsh->gmshModelMeshGetElements(&types, &n_types, &ids, &n_ids, &nn, &nodes, &n_nodes, &mm, g->dim, entity, &ierr);
  if (!ierr) refused = AddElements(path, g, n_types, types, ids, n_ids, nodes, n_nodes);
  for (size_t t = 0; t < nn; t++) gmsh->gmshFree(ids[t]);
  for (size_t t = 0; t < mm; t++) gmsh->gmshFree(nodes[t]);
  gmsh->gmshFree(ids);
  gmsh->gmshFree(n_ids);
  gmsh->gmshFree(nodes);
  gmsh->gmshFree(n_nodes);
  gmsh->gmshFree(types);
  PetscCall(CheckGmsh(ierr, path));
  PetscCall(refused);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadGroup(HycoScene scene, Group *g)
{
  char *name = NULL;
  int *entities = NULL, ierr;
  size_t n_entities = 0;
  PetscErrorCode refused = 0;

  PetscFunctionBegin;
  gmsh->gmshModelGetPhysicalName(g->dim, g->tag, &name, &ierr);
  if (!ierr && name && name[0])
    snprintf(g->name, sizeof(g->name), "%s", name);
  else
    snprintf(g->name, sizeof(g->name), "group_%d_%d", g->dim, g->tag);
  gmsh->gmshFree(name);
  g->body = -1;
  for (PetscInt b = 0; b < scene->n_bodies; b++) {
    if (g->dim > 0 && strcmp(scene->body[b].name, g->name) == 0) g->body = b;
  }
  gmsh->gmshModelGetEntitiesForPhysicalGroup(g->dim, g->tag, &entities, &n_entities, &ierr);
  PetscCall(CheckGmsh(ierr, scene->mesh_path));
  for (size_t k = 0; k < n_entities && !refused; k++) refused = ReadEntity(scene->mesh_path, g, entities[k]);
  gmsh->gmshFree(entities);
  PetscCall(refused);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every body is a group of cells, all of one type; other groups may be anything below. */
static PetscErrorCode CheckBodies(HycoScene scene, Reader *r, HycoMesh m)
{
  PetscInt cells = 0, nv = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < r->n_groups; k++) {
    if (r->group[k].body >= 0) r->dim = PetscMax(r->dim, r->group[k].dim);
  }
  for (PetscInt b = 0; b < scene->n_bodies; b++) {
    char list[HYCO_LINE] = "";
    PetscInt n = 0;

    for (PetscInt k = 0; k < r->n_groups; k++) {
      if (r->group[k].dim == 0) continue;
      if (r->group[k].body == b) {
        n += r->group[k].n;
        HycoCheck(r->group[k].dim == r->dim, "body %s is a group of dimension %d; the other bodies have dimension %d",
                  r->group[k].name, r->group[k].dim, (int)r->dim);
        HycoCheck(!nv || nv == r->group[k].nv, "%s mixes cells of %d and %d nodes; hyco takes one cell type per mesh",
                  scene->mesh_path, (int)nv, (int)r->group[k].nv);
        nv = r->group[k].nv;
      }
      if (!r->dim || r->group[k].dim == r->dim) PetscCall(HycoListAdd(list, ", ", r->group[k].name));
    }
    HycoCheck(n, "body \"%s\" has no cells in %s; its cell groups are: %s", scene->body[b].name, scene->mesh_path,
              list[0] ? list : "(none)");
    cells += n;
  }
  for (int t = 0; t < HYCO_N_CELL_TYPES; t++) {
    if (cell_dim[t] == r->dim && cell_nodes[t] == nv) m->type = (HycoCellType)t;
  }
  HycoCheck(cell_dim[m->type] == r->dim && cell_nodes[m->type] == nv,
            "%s: cells of dimension %d with %d nodes are no line2, tri3, quad4, tet4 or hex8", scene->mesh_path,
            (int)r->dim, (int)nv);
  m->dim = r->dim;
  m->nv = nv;
  m->nf = facet_nodes[m->type];
  m->n_cells = cells;
  PetscFunctionReturn(PETSC_SUCCESS);
}

typedef struct {
  size_t tag;
  PetscInt place;
} Tagged;

static int CompareTagged(const void *a, const void *b)
{
  const size_t ta = ((const Tagged *)a)->tag, tb = ((const Tagged *)b)->tag;

  return (ta > tb) - (ta < tb);
}

/* Index of a node tag among the kept ones, or -1. */
static PetscInt FindTag(const Reader *r, size_t tag)
{
  PetscInt lo = 0, hi = r->n_tags;

  if (hi > 0 && r->tag[hi - 1] - r->tag[0] == (size_t)hi - 1) /* no tag is missing between the first and the last */
    return tag >= r->tag[0] && tag <= r->tag[hi - 1] ? (PetscInt)(tag - r->tag[0]) : -1;
  while (lo < hi) {
    PetscInt mid = lo + (hi - lo) / 2;

    if (r->tag[mid] < tag)
      lo = mid + 1;
    else
      hi = mid;
  }
  return lo < r->n_tags && r->tag[lo] == tag ? lo : -1;
}

/* The cells in the order of their tags. */
static PetscErrorCode PlaceCells(HycoScene scene, HycoMesh m, const Tagged order[], size_t *const source[],
                                 const PetscInt body[], size_t node[])
{
  PetscFunctionBegin;
  for (PetscInt e = 0; e < m->n_cells; e++) {
    HycoCheck(!e || order[e].tag != order[e - 1].tag, "%s: cell %ld lies in two bodies; each cell must lie in one",
              scene->mesh_path, (long)order[e].tag);
    HycoCheck(order[e].tag < PETSC_MAX_INT, "%s: the cell tag %ld is too large", scene->mesh_path, (long)order[e].tag);
    m->cell_id[e] = (PetscInt)order[e].tag;
    m->cell_body[e] = body[order[e].place];
    PetscCall(PetscArraycpy(node + (size_t)e * (size_t)m->nv, source[order[e].place], m->nv));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cells, ascending by tag, with node tags for now (in `node`). */
static PetscErrorCode CollectCells(HycoScene scene, Reader *r, HycoMesh m, size_t **node)
{
  Tagged *order;
  size_t **source;
  PetscInt n = 0, *body;
  PetscErrorCode refused;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1((size_t)m->n_cells * (size_t)m->nv, node));
  PetscCall(PetscMalloc1(m->n_cells, &m->cell_id));
  PetscCall(PetscMalloc1(m->n_cells, &m->cell_body));
  PetscCall(PetscMalloc3(m->n_cells, &order, m->n_cells, &source, m->n_cells, &body));
  for (PetscInt k = 0; k < r->n_groups; k++) {
    Group *g = &r->group[k];

    for (PetscInt e = 0; g->body >= 0 && e < g->n; e++) {
      source[n] = g->node + (size_t)e * (size_t)m->nv;
      order[n].tag = g->id[e];
      order[n].place = n;
      body[n++] = g->body;
    }
  }
  qsort(order, (size_t)n, sizeof(*order), CompareTagged);
  refused = PlaceCells(scene, m, order, source, body, *node);
  PetscCall(PetscFree3(order, source, body));
  PetscCall(refused);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static int CompareSize(const void *a, const void *b)
{
  const size_t ta = *(const size_t *)a, tb = *(const size_t *)b;

  return (ta > tb) - (ta < tb);
}

/* Takes the kept ones of the file's nodes. */
static PetscErrorCode PlaceNodes(HycoScene scene, Reader *r, HycoMesh m, size_t n, const size_t tags[],
                                 const double xyz[])
{
  PetscInt found = 0;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < m->n_nodes; i++) m->node_id[i] = -1;
  for (size_t k = 0; k < n; k++) {
    const PetscInt i = FindTag(r, tags[k]);

    if (i < 0) continue;
    HycoCheck(m->node_id[i] < 0, "%s: node %ld stands twice", scene->mesh_path, (long)tags[k]);
    HycoCheck(tags[k] < PETSC_MAX_INT, "%s: the node tag %ld is too large", scene->mesh_path, (long)tags[k]);
    m->node_id[i] = (PetscInt)tags[k];
    found++;
    for (int c = 0; c < 3; c++) {
      m->xyz[3 * i + c] = xyz[3 * k + (size_t)c];
      HycoCheck(!PetscIsInfOrNanReal(m->xyz[3 * i + c]), "%s: node %ld has a coordinate that is not finite",
                scene->mesh_path, (long)tags[k]);
    }
  }
  HycoCheck(found == m->n_nodes, "%s: its cells name %d nodes that the file does not define", scene->mesh_path,
            (int)(m->n_nodes - found));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nodes of the cells, ascending by tag, and the cells' node indices. */
static PetscErrorCode CollectNodes(HycoScene scene, Reader *r, HycoMesh m, const size_t node[])
{
  const size_t total = (size_t)m->n_cells * (size_t)m->nv;
  size_t *tags = NULL, n_file = 0, n_xyz = 0, n_par = 0;
  double *xyz = NULL, *par = NULL;
  int ierr;
  PetscErrorCode refused = 0;

  PetscFunctionBegin;
  HycoCheck(total <= (size_t)PETSC_MAX_INT, "%s: %ld nodes of cells are more than this PETSc's integers count",
            scene->mesh_path, (long)total);
  HycoDuplicate(total, node, &r->tag);
  qsort(r->tag, total, sizeof(size_t), CompareSize);
  for (size_t k = 0; k < total; k++) {
    if (!k || r->tag[k] != r->tag[k - 1]) r->tag[r->n_tags++] = r->tag[k];
  }
  m->n_nodes = r->n_tags;
  PetscCall(PetscMalloc1((size_t)m->n_nodes * 3, &m->xyz));
  PetscCall(PetscMalloc1(m->n_nodes, &m->node_id));
  PetscCall(PetscMalloc1(total, &m->cells));
  gmsh->gmshModelMeshGetNodes(&tags, &n_file, &xyz, &n_xyz, &par, &n_par, -1, -1, 0, 0, &ierr);
  if (!ierr) refused = PlaceNodes(scene, r, m, n_file, tags, xyz);
  gmsh->gmshFree(tags);
  gmsh->gmshFree(xyz);
  gmsh->gmshFree(par);
  PetscCall(CheckGmsh(ierr, scene->mesh_path));
  PetscCall(refused);
  for (size_t k = 0; k < total; k++) m->cells[k] = FindTag(r, node[k]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the cell has all of node[0..n). */
static PetscBool CellHas(HycoMesh m, PetscInt cell, PetscInt n, const PetscInt node[])
{
  for (PetscInt k = 0; k < n; k++) {
    PetscBool has = PETSC_FALSE;

    for (PetscInt v = 0; v < m->nv; v++) has = (PetscBool)(has || m->cells[cell * m->nv + v] == node[k]);
    if (!has) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* Reverses the facet if its normal points into the cell. In 1D there is nothing to reverse. */
static void TurnOutward(HycoMesh m, PetscInt cell, PetscInt facet[])
{
  PetscReal inside[3] = {0, 0, 0}, normal[3] = {0, 0, 0}, out = 0;

  if (m->dim == 1) return;
  for (PetscInt c = 0; c < 3; c++) {
    for (PetscInt v = 0; v < m->nv; v++) inside[c] += m->xyz[3 * m->cells[cell * m->nv + v] + c] / m->nv;
  }
  {
    const PetscReal *p = m->xyz + 3 * facet[0], *q = m->xyz + 3 * facet[1], *s = m->xyz + 3 * facet[m->nf - 1];

    if (m->dim == 2) {
      normal[0] = q[1] - p[1];
      normal[1] = p[0] - q[0];
    } else {
      for (PetscInt c = 0; c < 3; c++) {
        const PetscInt d = (c + 1) % 3, e = (c + 2) % 3;

        normal[c] = (q[d] - p[d]) * (s[e] - p[e]) - (q[e] - p[e]) * (s[d] - p[d]);
      }
    }
    for (PetscInt c = 0; c < 3; c++) out += normal[c] * (p[c] - inside[c]);
  }
  if (out < 0) {
    const PetscInt first = m->dim == 2 ? 0 : 1, last = m->nf - 1, keep = facet[first];

    facet[first] = facet[last];
    facet[last] = keep;
  }
}

/* Format 2.2 saves a facet once for each of its groups, and gmsh then gives every group all copies: one counts. */
static PetscBool HasTwin(const Reader *r, HycoMesh m, PetscInt cell, PetscInt group, const PetscInt facet[])
{
  for (PetscInt f = r->last[cell]; f >= 0; f = r->before[f]) {
    const PetscInt *other = m->facets + f * m->nf;
    PetscInt same = 0;

    for (PetscInt v = 0; v < m->nf; v++) {
      for (PetscInt w = 0; w < m->nf; w++) same += facet[v] == other[w];
    }
    if (m->facet_group[f] == group && same == m->nf) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

static PetscErrorCode AddFacets(HycoScene scene, Reader *r, HycoMesh m, Group *g, PetscInt group,
                                const PetscInt start[], const PetscInt around[])
{
  PetscFunctionBegin;
  if (g->dim != m->dim - 1) PetscFunctionReturn(PETSC_SUCCESS);
  HycoCheck(!g->n || g->nv == m->nf, "%s: group \"%s\" has facets of %d nodes where the cells' have %d",
            scene->mesh_path, g->name, (int)g->nv, (int)m->nf);
  for (PetscInt f = 0; f < g->n; f++) {
    PetscInt *facet = m->facets + m->n_facets * m->nf, cell = -1, n = 0;
    PetscBool missing = PETSC_FALSE;

    for (PetscInt v = 0; v < m->nf; v++) {
      facet[v] = FindTag(r, g->node[f * m->nf + v]);
      missing = (PetscBool)(missing || facet[v] < 0);
    }
    for (PetscInt k = missing ? 0 : start[facet[0]]; k < (missing ? 0 : start[facet[0] + 1]); k++) {
      if (CellHas(m, around[k], m->nf, facet)) {
        cell = around[k];
        n++;
      }
    }
    HycoCheck(n > 0, "%s: facet %ld of group \"%s\" bounds no cell of a body", scene->mesh_path, (long)g->id[f],
              g->name);
    if (n > 1) { /* between two cells: no boundary, but its nodes are still in the group */
      g->inner++;
      continue;
    }
    if (HasTwin(r, m, cell, group, facet)) continue;
    TurnOutward(m, cell, facet);
    r->before[m->n_facets] = r->last[cell];
    r->last[cell] = m->n_facets;
    m->facet_group[m->n_facets] = group;
    m->facet_cell[m->n_facets] = cell;
    m->n_facets++;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nodes and cells of each group as CSR lists. */
static PetscErrorCode AddMembers(Reader *r, HycoMesh m, Group *g, PetscInt group, const PetscInt start[],
                                 const PetscInt around[], PetscInt *n_node, PetscInt *n_cell)
{
  PetscInt first = *n_node;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < g->n * g->nv; k++) {
    const PetscInt i = FindTag(r, g->node[k]);

    if (i >= 0) m->group_node[(*n_node)++] = i;
  }
  {
    PetscInt n = *n_node - first;

    PetscCall(PetscSortRemoveDupsInt(&n, m->group_node + first));
    *n_node = first + n;
  }
  m->group_start[group + 1] = *n_node;
  for (PetscInt e = 0; g->dim == m->dim && e < g->n; e++) {
    PetscInt cell = -1, node[8];

    for (PetscInt v = 0; v < m->nv; v++) node[v] = FindTag(r, g->node[e * m->nv + v]);
    for (PetscInt k = start[PetscMax(node[0], 0)]; node[0] >= 0 && k < start[node[0] + 1]; k++) {
      if (CellHas(m, around[k], m->nv, node)) cell = around[k];
    }
    if (cell >= 0) m->group_cell[(*n_cell)++] = cell;
  }
  m->group_cell_start[group + 1] = *n_cell;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CollectGroups(HycoScene scene, Reader *r, HycoMesh m)
{
  PetscInt n_facets = 0, n_members = 0, n_cells = 0, n_node = 0, n_cell = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < r->n_groups; k++) {
    n_members += r->group[k].n * r->group[k].nv;
    if (r->group[k].dim == m->dim - 1) n_facets += r->group[k].n;
    if (r->group[k].dim == m->dim) n_cells += r->group[k].n;
  }
  m->n_groups = r->n_groups;
  PetscCall(PetscCalloc1(m->n_groups, &m->group_name));
  PetscCall(PetscMalloc1(m->n_groups, &m->group_dim));
  PetscCall(PetscCalloc1(m->n_groups + 1, &m->group_start));
  PetscCall(PetscCalloc1(m->n_groups + 1, &m->group_cell_start));
  PetscCall(PetscMalloc1(n_members, &m->group_node));
  PetscCall(PetscMalloc1(n_cells, &m->group_cell));
  PetscCall(PetscMalloc1(n_facets * m->nf, &m->facets));
  PetscCall(PetscMalloc1(n_facets, &m->facet_group));
  PetscCall(PetscMalloc1(n_facets, &m->facet_cell));
  PetscCall(PetscMalloc1(n_facets, &r->before));
  PetscCall(PetscMalloc1(m->n_cells, &r->last));
  for (PetscInt e = 0; e < m->n_cells; e++) r->last[e] = -1;
  for (PetscInt k = 0; k < r->n_groups; k++) {
    PetscCall(PetscStrallocpy(r->group[k].name, &m->group_name[k]));
    m->group_dim[k] = r->group[k].dim;
    PetscCall(AddFacets(scene, r, m, &r->group[k], k, r->start, r->around));
    PetscCall(AddMembers(r, m, &r->group[k], k, r->start, r->around, &n_node, &n_cell));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A load pushes on a boundary, not between two cells. */
static PetscErrorCode CheckLoads(HycoScene scene, Reader *r)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < scene->n_loads; k++) {
    for (PetscInt g = 0; g < r->n_groups; g++) {
      HycoCheck(!r->group[g].inner || strcmp(r->group[g].name, scene->load[k].group),
                "the load on %s: %d of its facets lie between two cells; give a group on the boundary",
                r->group[g].name, (int)r->group[g].inner);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two cells with the same nodes: a cell saved once per group, as format 2.2 does. */
static PetscErrorCode CheckTwins(HycoScene scene, HycoMesh m, const PetscInt start[], const PetscInt around[])
{
  PetscFunctionBegin;
  for (PetscInt e = 0; e < m->n_cells; e++) {
    const PetscInt *cell = m->cells + e * m->nv;

    for (PetscInt k = start[cell[0]]; k < start[cell[0] + 1]; k++) {
      HycoCheck(around[k] >= e || !CellHas(m, around[k], m->nv, cell),
                "%s: cells %d and %d have the same nodes: is one cell in two bodies? Format 2.2 saves a cell once for "
                "each of its groups; save as 4.1 to keep it in several",
                scene->mesh_path, (int)m->cell_id[around[k]], (int)m->cell_id[e]);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether two bodies move a node differently. */
static PetscBool SameMap(const HycoBody *a, const HycoBody *b)
{
  for (PetscInt c = 0; c < 3; c++) {
    if (a->map[c] || b->map[c]) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

static PetscErrorCode SetNodeBodies(HycoScene scene, HycoMesh m)
{
  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_nodes, &m->node_body));
  for (PetscInt i = 0; i < m->n_nodes; i++) m->node_body[i] = -1;
  for (PetscInt k = 0; k < m->n_cells * m->nv; k++) {
    PetscInt *body = &m->node_body[m->cells[k]], b = m->cell_body[k / m->nv];

    if (*body >= 0 && *body != b) {
      HycoCheck(SameMap(&scene->body[*body], &scene->body[b]),
                "%s: the bodies %s and %s share node %d, and a map moves one of them", scene->mesh_path,
                scene->body[*body].name, scene->body[b].name, (int)m->node_id[m->cells[k]]);
      *body = PetscMin(*body, b);
    } else
      *body = b;
  }
  /* A mesh of the line or the plane must lie in it. */
  for (PetscInt c = m->dim; c < 3; c++) {
    PetscReal lo = PETSC_MAX_REAL, hi = PETSC_MIN_REAL, size = 0;

    for (PetscInt i = 0; i < m->n_nodes; i++) {
      lo = PetscMin(lo, m->xyz[3 * i + c]);
      hi = PetscMax(hi, m->xyz[3 * i + c]);
      size = PetscMax(size, PetscAbsReal(m->xyz[3 * i] - m->xyz[0]));
    }
    HycoCheck(hi - lo <= 1e-9 * size, "%s has cells of dimension %d, but its %c coordinates run from %g to %g",
              scene->mesh_path, (int)m->dim, "xyz"[c], (double)lo, (double)hi);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadGroups(HycoScene scene, Reader *r)
{
  int *dim_tags = NULL, ierr;
  size_t n = 0;

  PetscFunctionBegin;
  gmsh->gmshModelGetPhysicalGroups(&dim_tags, &n, -1, &ierr);
  PetscCall(CheckGmsh(ierr, scene->mesh_path));
  HycoCheck(n,
            "%s has no physical groups; name the bodies and surfaces in gmsh (Physical Volume, Physical Surface, ...)",
            scene->mesh_path);
  r->n_groups = (PetscInt)(n / 2);
  PetscCall(PetscCalloc1(r->n_groups, &r->group));
  for (PetscInt k = 0; k < r->n_groups; k++) {
    r->group[k].dim = dim_tags[2 * k];
    r->group[k].tag = dim_tags[2 * k + 1];
  }
  gmsh->gmshFree(dim_tags);
  for (PetscInt k = 0; k < r->n_groups; k++) PetscCall(ReadGroup(scene, &r->group[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Between gmshInitialize and gmshFinalize. */
static PetscErrorCode ReadOpen(HycoScene scene, Reader *r, HycoMesh m)
{
  int ierr;

  PetscFunctionBegin;
  gmsh->gmshOptionSetNumber("General.Terminal", 0, &ierr);
  gmsh->gmshOpen(scene->mesh_path, &ierr);
  PetscCall(CheckGmsh(ierr, scene->mesh_path));
  PetscCall(ReadGroups(scene, r));
  PetscCall(CheckBodies(scene, r, m));
  PetscCall(CollectCells(scene, r, m, &r->node));
  PetscCall(CollectNodes(scene, r, m, r->node));
  PetscCall(HycoMeshNodeCells(m, &r->start, &r->around));
  PetscCall(CheckTwins(scene, m, r->start, r->around));
  PetscCall(CollectGroups(scene, r, m));
  PetscCall(CheckLoads(scene, r));
  PetscCall(SetNodeBodies(scene, m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* gmsh opens a path that does not exist without a word, and runs a .geo. */
static PetscErrorCode CheckPath(HycoScene scene)
{
  PetscFunctionBegin;
  HycoCheck(scene->mesh_path[0], "the scene names no mesh; write scene: mesh: FILE.msh, or give -scene_mesh FILE.msh");
  PetscCall(HycoMshCheck(scene->mesh_path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMeshRead(HycoScene scene, HycoMesh *mesh)
{
  Reader r = {0};
  HycoMesh m;
  PetscErrorCode ierr;
  int gerr;
  char locale[HYCO_LINE];
  void *before;

  PetscFunctionBegin;
  PetscCall(CheckPath(scene));
  PetscCall(HycoGmshLoad(&gmsh));
  PetscCall(PetscNew(&m));
  snprintf(locale, sizeof(locale), "%s", setlocale(LC_ALL, NULL)); /* gmsh sets one for the whole program */
  before = HycoPointBegin();
  HycoGmshInitialize(gmsh->gmshInitialize, &gerr);
  ierr = CheckGmsh(gerr, scene->mesh_path);
  if (!ierr) ierr = ReadOpen(scene, &r, m);
  gmsh->gmshFinalize(&gerr);
  HycoPointEnd(before);
  (void)setlocale(LC_ALL, locale);
  for (PetscInt k = 0; k < r.n_groups; k++) {
    PetscCall(PetscFree(r.group[k].id));
    PetscCall(PetscFree(r.group[k].node));
  }
  PetscCall(PetscFree(r.group));
  PetscCall(PetscFree(r.tag));
  PetscCall(PetscFree(r.last));
  PetscCall(PetscFree(r.before));
  PetscCall(PetscFree(r.start));
  PetscCall(PetscFree(r.around));
  PetscCall(PetscFree(r.node));
  if (!ierr) ierr = HycoMeshCheckGroups(m, scene);
  if (ierr) PetscCall(HycoMeshDestroy(&m));
  PetscCall(ierr);
  *mesh = m;
  PetscFunctionReturn(PETSC_SUCCESS);
}
