/*
  Checks a mesh file against the scene and converts it to tables on one process: cells of one type, smaller ones
  collapsed, each in one body; facets that bound exactly one cell.
*/
#include "plex.h"
#include "msh.h"
#include <string.h>

typedef HycoMshGroup Group;

typedef struct {
  HycoMsh file;
  PetscInt n_groups;
  Group *group;             /* of the file */
  PetscInt *index;          /* for each node of the file its index in the mesh, or -1 */
  PetscInt *last, *before;  /* for each cell its last facet, for each facet the previous one of the cell, or -1 */
  PetscInt *start, *around; /* the cells around each node */
} Reader;

/* Chooses the mesh's type for cells of these shapes, and widens the groups of cells and facets to it. */
static PetscErrorCode ChooseType(HycoScene scene, Reader *r, HycoMesh m, PetscInt shapes)
{
  PetscFunctionBegin;
  m->type = HycoShapesType(shapes);
  m->mixed = (PetscBool)(shapes != (PetscInt)1 << m->type);
  if (m->type == HYCO_HEX20 && scene->n_contacts) { /* the corners of quad8 would have negative forces under a
                                                       uniform pressure */
    PetscCall(HycoMshAddFaceNodes(scene->mesh_path, &r->file));
    m->type = HYCO_HEX27;
    /* Reported by hyco check: the mesh has nodes that are not in the file. */
    scene->face_nodes = PETSC_TRUE;
  }
  m->nv = HycoCellKinds[m->type].nv;
  m->nf = HycoCellKinds[m->type].nf;
  for (PetscInt k = 0; k < r->n_groups && m->mixed; k++) {
    Group *g = &r->group[k];
    const PetscInt nv = g->dim == m->dim ? m->nv : g->dim == 2 ? m->nf : g->nv;
    const HycoCellType shape = HycoMshType(g->dim, g->nv);

    /* A group outside the bodies may be of second order: it stays as it is, and AddMembers() takes none of its
       cells. */
    if (g->n && shape < HYCO_N_CELL_TYPES && !HycoCellKinds[shape].quadratic) PetscCall(HycoMshWiden(g, nv));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every body is a group of cells, of types that can be in one mesh; other groups may have any lower dimension.
   r->group[k].body is the body of each group, -1: none. */
static PetscErrorCode CheckBodies(HycoScene scene, Reader *r, HycoMesh m)
{
  PetscInt cells = 0, shapes = 0, nv = 0;

  PetscFunctionBegin;
  /* Groups of the name of a body, in any dimension; a body's group of points is not one. */
  for (PetscInt k = 0; k < r->n_groups; k++) {
    Group *g = &r->group[k];

    g->body = -1;
    for (PetscInt b = 0; b < scene->n_bodies; b++) {
      if (g->dim > 0 && strcmp(scene->body[b].name, g->name) == 0) g->body = b;
    }
    if (g->body >= 0) m->dim = PetscMax(m->dim, g->dim);
  }
  for (PetscInt b = 0; b < scene->n_bodies; b++) {
    char list[HYCO_LINE] = "";
    HycoCellType shape;
    PetscInt n = 0;

    for (PetscInt k = 0; k < r->n_groups; k++) {
      if (r->group[k].dim == 0) continue;
      if (r->group[k].body == b) {
        n += r->group[k].n;
        HycoCheck(r->group[k].n, "body \"%s\" is a group of dimension %d without cells in %s; mesh with gmsh -%d",
                  r->group[k].name, r->group[k].dim, scene->mesh_path, r->group[k].dim);
        HycoCheck(r->group[k].dim == m->dim, "body %s is a group of dimension %d; the other bodies have dimension %d",
                  r->group[k].name, r->group[k].dim, (int)m->dim);
        shape = HycoMshType(m->dim, r->group[k].nv);
        HycoCheck(shape < HYCO_N_CELL_TYPES,
                  "%s: cells of dimension %d with %d nodes are of no type that hyco supports", scene->mesh_path,
                  (int)m->dim, (int)r->group[k].nv);
        shapes |= r->group[k].shapes;
        HycoCheck(HycoShapesType(shapes) < HYCO_N_CELL_TYPES,
                  "%s mixes cells of %d and %d nodes; only first-order cells may be of several types: mesh with gmsh "
                  "-order 1, or recombine all surfaces, or none",
                  scene->mesh_path, (int)nv, (int)r->group[k].nv);
        nv = r->group[k].nv;
      }
      if (!m->dim || r->group[k].dim == m->dim) PetscCall(HycoListAdd(list, ", ", r->group[k].name));
    }
    HycoCheck(n, "body \"%s\" has no cells in %s; its cell groups are: %s", scene->body[b].name, scene->mesh_path,
              list[0] ? list : "(none)");
    cells += n;
  }
  m->n_cells = cells;
  PetscCall(ChooseType(scene, r, m, shapes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collects the cells in the order of their tags, still with the file's node indices. */
static PetscErrorCode CollectCells(HycoScene scene, Reader *r, HycoMesh m)
{
  PetscInt *order, *tag, *body, n = 0;
  const PetscInt **source;

  PetscFunctionBegin;
  HycoCheck(m->n_cells <= PETSC_MAX_INT / 8,
            "%s has %ld cells, more than the integers of this PETSc can count; use a PETSc with 64-bit indices",
            scene->mesh_path, (long)m->n_cells);
  PetscCall(PetscMalloc1(m->n_cells * m->nv, &m->cells));
  PetscCall(PetscMalloc1(m->n_cells, &m->cell_id));
  PetscCall(PetscMalloc1(m->n_cells, &m->cell_body));
  PetscCall(PetscMalloc4(m->n_cells, &order, m->n_cells, &tag, m->n_cells, &body, m->n_cells, &source));
  for (PetscInt k = 0; k < r->n_groups; k++) {
    const Group *g = &r->group[k];

    for (PetscInt e = 0; g->body >= 0 && e < g->n; e++, n++) {
      /* All groups of bodies have m->nv nodes by now (ChooseType()). */
      source[n] = g->node + e * m->nv;
      tag[n] = g->id[e];
      body[n] = g->body;
      order[n] = n;
    }
  }
  /* By tag: file order would depend on the groups' order. */
  PetscCall(PetscSortIntWithPermutation(n, tag, order));
  for (PetscInt e = 0; e < n; e++) {
    m->cell_id[e] = tag[order[e]];
    m->cell_body[e] = body[order[e]];
    PetscCall(PetscArraycpy(m->cells + e * m->nv, source[order[e]], m->nv));
  }
  PetscCall(PetscFree4(order, tag, body, source));
  for (PetscInt e = 1; e < n; e++)
    HycoCheck(m->cell_id[e] != m->cell_id[e - 1], "%s: cell %ld belongs to two bodies; each cell must belong to one",
              scene->mesh_path, (long)m->cell_id[e]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nodes of the cells, ascending by tag, and the cells' node indices. r->index: from a node of the file to one of the
   mesh. */
static PetscErrorCode CollectNodes(Reader *r, HycoMesh m)
{
  const HycoMsh *file = &r->file;
  PetscInt n = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(file->n_nodes, &r->index));
  for (PetscInt i = 0; i < file->n_nodes; i++) r->index[i] = -1;
  /* First marks, then the indices: nodes without a cell (centres of arcs) would make K singular and are left out. */
  for (PetscInt k = 0; k < m->n_cells * m->nv; k++) r->index[m->cells[k]] = 0;
  for (PetscInt i = 0; i < file->n_nodes; i++) m->n_nodes += r->index[i] == 0;
  PetscCall(PetscMalloc1(3 * m->n_nodes, &m->xyz));
  PetscCall(PetscMalloc1(m->n_nodes, &m->node_id));
  for (PetscInt i = 0; i < file->n_nodes; i++) {
    if (r->index[i] < 0) continue;
    m->node_id[n] = file->tag[i];
    PetscCall(PetscArraycpy(m->xyz + 3 * n, file->xyz + 3 * i, 3));
    r->index[i] = n++;
  }
  for (PetscInt k = 0; k < m->n_cells * m->nv; k++) m->cells[k] = r->index[m->cells[k]];
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

/* Whether the facet is already in the group: a file may list it several times, and it counts once. Facets are compared
   by their number in the cell, because those of collapsed cells repeat a node. */
static PetscBool HasTwin(const Reader *r, HycoMesh m, PetscInt cell, PetscInt group, const PetscInt facet[])
{
  const PetscInt number = HycoCellFace(m, cell, facet);

  for (PetscInt f = r->last[cell]; f >= 0; f = r->before[f]) {
    if (m->facet_group[f] == group && HycoMeshFacetNumber(m, f) == number) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* Whether a cell of the group has all of these nodes of the file. */
static PetscBool GroupHas(const Group *g, PetscInt n, const PetscInt node[])
{
  for (PetscInt e = 0; e < g->n; e++) {
    PetscInt found = 0;

    for (PetscInt k = 0; k < n; k++) {
      PetscInt v = 0;

      while (v < g->nv && g->node[e * g->nv + v] != node[k]) v++;
      found += v < g->nv;
    }
    /* All nodes of the facet: it is a side of this cell, or inside it. */
    if (found == n) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* Fails for facet f of a group, which bounds no cell of a body: with the group of cells that has it, if there is one.
 */
static PetscErrorCode RefuseFacet(HycoScene scene, const Reader *r, HycoMesh m, const Group *g, PetscInt f)
{
  const char *name = NULL;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < r->n_groups && !name; k++) {
    const Group *cells = &r->group[k];

    if (cells->dim == m->dim && cells->body < 0 && GroupHas(cells, g->nv, g->node + f * g->nv)) name = cells->name;
  }
  HycoCheck(!name,
            "%s: the group \"%s\" is on the cells of \"%s\", which is no body of the scene (facet %ld); add the entry "
            "body: {%s: {young: ...}}",
            scene->mesh_path, g->name, name, (long)g->id[f], name);
  HycoFail("%s: facet %ld of group \"%s\" is not a facet of any cell of a body", scene->mesh_path, (long)g->id[f],
           g->name);
}

/* The facets of one group. Each is searched among the cells around its first node; one cell: boundary, two: inner.
   m->facets is written in place, and kept only if the facet counts. */
static PetscErrorCode AddFacets(HycoScene scene, Reader *r, HycoMesh m, Group *g, PetscInt group,
                                const PetscInt start[], const PetscInt around[])
{
  PetscFunctionBegin;
  if (g->dim != m->dim - 1) PetscFunctionReturn(PETSC_SUCCESS);
  HycoCheck(!g->n || g->nv == m->nf, "%s: group \"%s\" has facets of %d nodes, and those of the cells have %d",
            scene->mesh_path, g->name, (int)g->nv, (int)m->nf);
  for (PetscInt f = 0; f < g->n; f++) {
    PetscInt *facet = m->facets + m->n_facets * m->nf, cell = -1, n = 0;
    PetscBool missing = PETSC_FALSE;

    for (PetscInt v = 0; v < m->nf; v++) {
      facet[v] = r->index[g->node[f * m->nf + v]];
      missing = (PetscBool)(missing || facet[v] < 0);
    }
    for (PetscInt k = missing ? 0 : start[facet[0]]; k < (missing ? 0 : start[facet[0] + 1]); k++) {
      /* The first test is cheap; the second one excludes diagonals, whose nodes the cell has too. */
      if (CellHas(m, around[k], m->nf, facet) && HycoCellFace(m, around[k], facet) >= 0) {
        cell = around[k];
        n++;
      }
    }
    if (!n) PetscCall(RefuseFacet(scene, r, m, g, f));
    if (n > 1) { /* between two cells: not a boundary, but its nodes are in the group */
      g->inner++;
      continue;
    }
    if (HasTwin(r, m, cell, group, facet)) continue;
    r->before[m->n_facets] = r->last[cell];
    r->last[cell] = m->n_facets;
    m->facet_group[m->n_facets] = group;
    m->facet_cell[m->n_facets] = cell;
    m->n_facets++;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nodes and cells of each group as CSR lists. Nodes may lie outside the bodies (index -1) and are then left out, with
   the cells that have them. Points and lines too, for supports, forces and outputs. */
static PetscErrorCode AddMembers(Reader *r, HycoMesh m, Group *g, PetscInt group, const PetscInt start[],
                                 const PetscInt around[], PetscInt *n_node, PetscInt *n_cell)
{
  PetscInt first = *n_node;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < g->n * g->nv; k++) {
    const PetscInt i = r->index[g->node[k]];

    if (i >= 0) m->group_node[(*n_node)++] = i;
  }
  {
    PetscInt n = *n_node - first;

    PetscCall(HycoSortUnique(&n, m->group_node + first));
    *n_node = first + n;
  }
  m->group_start[group + 1] = *n_node;
  for (PetscInt e = 0; g->dim == m->dim && g->nv == m->nv && e < g->n; e++) {
    PetscInt cell = -1, node[HYCO_CELL_NODES];

    /* Cells outside the bodies have nodes -1, which CellHas() finds in no cell. */
    for (PetscInt v = 0; v < m->nv; v++) node[v] = r->index[g->node[e * m->nv + v]];
    for (PetscInt k = start[PetscMax(node[0], 0)]; node[0] >= 0 && k < start[node[0] + 1]; k++) {
      if (CellHas(m, around[k], m->nv, node)) cell = around[k];
    }
    if (cell >= 0) m->group_cell[(*n_cell)++] = cell;
  }
  m->group_cell_start[group + 1] = *n_cell;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All groups with one allocation by upper bounds; last and before chain the facets of each cell for the search for
   duplicates. */
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
  /* -1: no facet of the cell so far. */
  for (PetscInt e = 0; e < m->n_cells; e++) r->last[e] = -1;
  for (PetscInt k = 0; k < r->n_groups; k++) {
    PetscCall(PetscStrallocpy(r->group[k].name, &m->group_name[k]));
    m->group_dim[k] = r->group[k].dim;
    PetscCall(AddFacets(scene, r, m, &r->group[k], k, r->start, r->around));
    PetscCall(AddMembers(r, m, &r->group[k], k, r->start, r->around, &n_node, &n_cell));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The triangles of smaller cells must not be a part of a neighbour's quadrilateral: displacements would be
   discontinuous there. */
static PetscErrorCode CheckConforming(HycoScene scene, HycoMesh m, const PetscInt start[], const PetscInt around[])
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < m->n_cells * HycoFacetCount(m->type) && m->mixed && m->dim == 3; k++) {
    const PetscInt e = k / HycoFacetCount(m->type);
    PetscInt facet[HYCO_FACET_NODES];

    /* Faces with 3 different nodes: triangles of pyramids, prisms and tetrahedra. */
    if (HycoMeshFace(m, e, k % HycoFacetCount(m->type), facet) != 3) continue;
    for (PetscInt j = start[facet[0]]; j < start[facet[0] + 1]; j++)
      HycoCheck(!CellHas(m, around[j], m->nf, facet) || HycoCellFace(m, around[j], facet) >= 0,
                "%s: the cells %d and %d share three of the four nodes of a face; between quadrilateral and triangular "
                "faces a mesh needs pyramids (gmsh makes them beside extruded, recombined volumes)",
                scene->mesh_path, (int)m->cell_id[e], (int)m->cell_id[around[j]]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A load must act on a boundary, not between two cells, and so must a surface of springs. */
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
  for (PetscInt k = 0; k < scene->n_springs; k++) {
    for (PetscInt g = 0; g < r->n_groups; g++) {
      HycoCheck(!r->group[g].inner || !r->group[g].dim || strcmp(r->group[g].name, scene->spring[k].group),
                "the spring on %s: %d of its facets lie between two cells; give a group on the boundary",
                r->group[g].name, (int)r->group[g].inner);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Detects two cells with the same nodes: format 2.2 stores a cell once for each of its groups; and a cell within the
   nodes of another one. */
static PetscErrorCode CheckTwins(HycoScene scene, HycoMesh m, const PetscInt start[], const PetscInt around[])
{
  PetscFunctionBegin;
  for (PetscInt e = 0; e < m->n_cells; e++) {
    const PetscInt *cell = m->cells + e * m->nv;

    /* Twins share every node: those around the first one suffice. */
    for (PetscInt k = start[cell[0]]; k < start[cell[0] + 1]; k++) {
      const PetscInt other = around[k];
      const PetscBool alike = (PetscBool)(HycoMeshShape(m, e) == HycoMeshShape(m, other));

      /* Each pair once. */
      if (other == e || (alike && other > e) || !CellHas(m, other, m->nv, cell)) continue;
      HycoCheck(!alike,
                "%s: cells %d and %d have the same nodes; a cell must belong to one body (format 2.2 repeats a cell "
                "for each of its groups: save as 4.1)",
                scene->mesh_path, (int)m->cell_id[other], (int)m->cell_id[e]);
      HycoFail("%s: cell %d has only nodes of cell %d, so that they overlap; remove one of them", scene->mesh_path,
               (int)m->cell_id[e], (int)m->cell_id[other]);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The order matters: types before cells, cells before nodes, and the checks that need the cells around a node
   before groups. */
static PetscErrorCode MakeTables(HycoScene scene, Reader *r, HycoMesh m)
{
  PetscFunctionBegin;
  PetscCall(HycoMshRead(scene->mesh_path, &r->file));
  r->n_groups = r->file.n_groups;
  r->group = r->file.group;
  PetscCall(CheckBodies(scene, r, m));
  PetscCall(CollectCells(scene, r, m));
  PetscCall(CollectNodes(r, m));
  PetscCall(HycoMeshNodeCells(m, &r->start, &r->around));
  PetscCall(CheckTwins(scene, m, r->start, r->around));
  /* Needs the cells around each node, as hanging nodes show there. */
  PetscCall(CheckConforming(scene, m, r->start, r->around));
  PetscCall(CollectGroups(scene, r, m));
  PetscCall(CheckLoads(scene, r));
  PetscCall(HycoMeshSetNodeBodies(scene, m));
  PetscCall(HycoMeshCheckGroups(m, scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The scene's mesh file as tables; the caller destroys them. One process: errors are passed on by the caller. */
PetscErrorCode HycoMeshRead(HycoScene scene, HycoMesh *mesh)
{
  Reader r = {0};
  HycoMesh m;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  HycoCheck(scene->mesh_path[0], "the scene has no mesh; write scene: mesh: FILE.msh, or give -scene_mesh FILE.msh");
  PetscCall(PetscNew(&m));
  ierr = MakeTables(scene, &r, m);
  PetscCall(HycoMshDestroy(&r.file));
  HycoFreeAll(&r.index, &r.last, &r.before, &r.start, &r.around);
  /* The file's tables and the reader's are freed in any case; the mesh only after an error. */
  if (ierr) PetscCall(HycoMeshDestroy(&m));
  PetscCall(ierr);
  *mesh = m;
  PetscFunctionReturn(PETSC_SUCCESS);
}
