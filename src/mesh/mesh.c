/* HycoMesh: groups, adjacency. */
#include "plex.h"
#include <hycocontactimpl.h>
#include <string.h>

const HycoCellKind HycoCellKinds[HYCO_N_CELL_TYPES] = {
    {"line2", 1, 2, 1, 1, PETSC_FALSE}, {"tri3", 2, 3, 2, 2, PETSC_FALSE},  {"quad4", 2, 4, 2, 2, PETSC_FALSE},
    {"tet4", 3, 4, 3, 3, PETSC_FALSE},  {"hex8", 3, 8, 4, 4, PETSC_FALSE},  {"tri6", 2, 6, 3, 2, PETSC_TRUE},
    {"quad8", 2, 8, 3, 2, PETSC_TRUE},  {"quad9", 2, 9, 3, 2, PETSC_TRUE},  {"tet10", 3, 10, 6, 3, PETSC_TRUE},
    {"hex20", 3, 20, 8, 4, PETSC_TRUE}, {"hex27", 3, 27, 9, 4, PETSC_TRUE}, {"pyramid5", 3, 5, 4, 4, PETSC_FALSE},
    {"prism6", 3, 6, 4, 4, PETSC_FALSE}};

/* The container, composed with a DM, of its tables. */
#define TABLES "HycoTables"

/* The destructor of the container on the DM, and for tables without a DM; also of half-made tables, whose other arrays
   are NULL. Called when the last reference to the DM goes. */
static PetscErrorCode FreeTables(void *tables)
{
  HycoMesh m = (HycoMesh)tables;

  PetscFunctionBegin;
  for (PetscInt g = 0; m->group_name && g < m->n_groups; g++) PetscCall(PetscFree(m->group_name[g]));
  HycoFreeAll(&m->group_name, &m->group_dim, &m->group_start, &m->group_node, &m->group_cell_start, &m->group_cell,
              &m->xyz, &m->node_id, &m->node_body, &m->node_global, &m->node_whole, &m->node_point, &m->cell_point,
              &m->cells, &m->cell_id, &m->cell_body, &m->cell_whole, &m->facets, &m->facet_group, &m->facet_cell,
              &m->facet_point, &m->facet_side, &m->facet_rank);
  PetscCall(HycoMeshSetTies(m, NULL));
  PetscCall(PetscFree(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A caller has a reference to the DM, not to the tables: they go when the DM's last reference does. */
PetscErrorCode HycoMeshDestroy(HycoMesh *mesh)
{
  HycoMesh m = *mesh;
  DM dm = m ? m->dm : NULL;

  PetscFunctionBegin;
  *mesh = NULL;
  /* The tables go with the DM's last reference. */
  if (dm)
    PetscCall(DMDestroy(&dm));
  else if (m)
    PetscCall(FreeTables(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The DM owns the tables, and they do not hold it: a circle would keep both alive. */
PetscErrorCode HycoMeshSetDM(HycoMesh m, DM dm)
{
  PetscContainer container;

  PetscFunctionBegin;
  PetscCall(PetscContainerCreate(PETSC_COMM_SELF, &container));
  PetscCall(PetscContainerSetPointer(container, m));
  PetscCall(PetscContainerSetUserDestroy(container, FreeTables));
  PetscCall(PetscObjectCompose((PetscObject)dm, TABLES, (PetscObject)container));
  PetscCall(PetscContainerDestroy(&container));
  m->dm = dm;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The tables that a DM already has (borrowed), NULL: none. Not collective. Several models of one DM share the
   tables. */
PetscErrorCode HycoMeshQuery(DM dm, HycoMesh *mesh)
{
  PetscContainer container;

  PetscFunctionBegin;
  *mesh = NULL;
  PetscCall(PetscObjectQuery((PetscObject)dm, TABLES, (PetscObject *)&container));
  if (container) PetscCall(PetscContainerGetPointer(container, (void **)mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The container must not free the tables when it goes, hence the destructor is removed first. The tables are then the
   caller's alone. */
PetscErrorCode HycoMeshDetach(HycoMesh m)
{
  PetscContainer container;
  DM dm = m->dm;

  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)dm, TABLES, (PetscObject *)&container));
  PetscCall(PetscContainerSetUserDestroy(container, NULL));
  PetscCall(PetscObjectCompose((PetscObject)dm, TABLES, NULL));
  m->dm = NULL;
  PetscCall(DMDestroy(&dm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Linear search: a mesh has tens of groups. The message lists all groups and the nearest name. */
PetscErrorCode HycoMeshFindGroup(HycoMesh mesh, const char key[], const char name[], PetscInt *group)
{
  char list[HYCO_LINE] = "";
  const char *near;

  PetscFunctionBegin;
  for (PetscInt g = 0; g < mesh->n_groups; g++) {
    if (strcmp(mesh->group_name[g], name) == 0) {
      *group = g;
      PetscFunctionReturn(PETSC_SUCCESS);
    }
    PetscCall(HycoListAdd(list, ", ", mesh->group_name[g]));
  }
  /* A typing error is the usual reason. */
  near = HycoNearest(name, mesh->n_groups, (const char *const *)mesh->group_name);
  if (near) HycoFail("%s: the mesh has no group \"%s\"; its groups are: %s; did you mean %s?", key, name, list, near);
  HycoFail("%s: the mesh has no group \"%s\"; its groups are: %s", key, name, list);
}

/* Refuses expressions for components that the mesh does not have. */
static PetscErrorCode CheckComponents(HycoMesh mesh, HycoExpr component[3])
{
  PetscFunctionBegin;
  for (PetscInt c = mesh->dim; c < 3; c++) {
    HycoCheck(!component[c], "%s: the mesh has %d space dimension%s and no component %c; remove the entry",
              HycoExprKey(component[c]), (int)mesh->dim, mesh->dim > 1 ? "s" : "", "xyz"[c]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Forces act on points, or on lines in space; on a surface a traction is required. */
static PetscErrorCode CheckPointLoad(HycoMesh mesh, const HycoPointLoad *load)
{
  PetscInt group, dim;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(mesh, "force", load->group, &group));
  dim = mesh->group_dim[group];
  HycoCheck(dim < mesh->dim, "the force on %s: that group has cells, and is not a body of the scene; add it under body",
            load->group);
  /* In 2D a line is the boundary, in 3D it is an edge or a wire. */
  HycoCheck(!dim || dim < mesh->dim - 1,
            "the force on %s: that group is a boundary; write traction: %s: {...} (force per unit %s)", load->group,
            load->group, mesh->dim == 3 ? "area" : "length");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stiffness per area of a surface, or of single points; a normal component needs a surface. Lines in 3D have no area
   and no normal. */
static PetscErrorCode CheckSpring(HycoMesh mesh, const HycoSpring *spring)
{
  PetscInt group, dim;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(mesh, "spring", spring->group, &group));
  dim = mesh->group_dim[group];
  HycoCheck(!dim || dim == mesh->dim - 1,
            "the spring on %s needs a group of points or of dimension %d; that group has "
            "dimension %d",
            spring->group, (int)mesh->dim - 1, (int)dim);
  HycoCheck(dim == mesh->dim - 1 || !spring->stiffness[3],
            "%s: the group %s is of points and has no normal; write x, y, z", HycoExprKey(spring->stiffness[3]),
            spring->group);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Both sides must have facets: a slave's weights are shape functions of the master's facet. */
static PetscErrorCode CheckTie(HycoMesh mesh, const HycoTie *tie)
{
  PetscFunctionBegin;
  HycoCheck(mesh->dim > 1, "tie %s: ties are for 2D and 3D; in 1D let both bodies share the node", tie->name);
  for (PetscInt side = 0; side < 2; side++) {
    const char *name = side ? tie->master : tie->slave;
    PetscInt group = 0;

    PetscCall(HycoMeshFindGroup(mesh, "tie", name, &group));
    /* Both sides are surfaces: points have no facets to project to. */
    HycoCheck(mesh->group_dim[group] == mesh->dim - 1,
              "tie %s: its %s must be a group of dimension %d; %s has dimension %d", tie->name,
              side ? "master" : "slave", (int)mesh->dim - 1, name, (int)mesh->group_dim[group]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* That the contact's groups are in the mesh, and surfaces where required. */
static PetscErrorCode CheckContact(HycoMesh mesh, HycoContact contact)
{
  PetscInt group;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(mesh, "contact", contact->slave, &group));
  HycoCheck(!HycoContactAverages(contact) || mesh->group_dim[group] == mesh->dim - 1,
            "contact %s: the group %s is not a surface and has no normal; give normal: {x: ..., ...}", contact->name,
            contact->slave);
  if (!contact->master) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoMeshFindGroup(mesh, "contact", contact->master, &group));
  /* Types that search need facets to project to. */
  HycoCheck(!contact->ops->find || mesh->group_dim[group] == mesh->dim - 1,
            "contact %s: the master group %s has dimension %d; a group of dimension %d is needed", contact->name,
            contact->master, (int)mesh->group_dim[group], (int)mesh->dim - 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Everything the scene says about groups is checked here, before any assembly: existence, dimension, components.
   Not collective; the same result on every rank once group_dim is. */
PetscErrorCode HycoMeshCheckGroups(HycoMesh mesh, HycoScene scene)
{
  PetscInt group;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < scene->n_fixed; k++)
    PetscCall(HycoMeshFindGroup(mesh, "fixed", scene->fixed[k].group, &group));
  for (PetscInt k = 0; k < scene->n_fixed; k++) PetscCall(CheckComponents(mesh, scene->fixed[k].value));
  for (PetscInt k = 0; k < scene->n_fixed; k++) PetscCall(CheckComponents(mesh, scene->fixed[k].direction));
  for (PetscInt k = 0; k < scene->n_bodies; k++) PetscCall(CheckComponents(mesh, scene->body[k].force));
  for (PetscInt k = 0; k < scene->n_loads; k++) PetscCall(CheckComponents(mesh, scene->load[k].traction));
  for (PetscInt k = 0; k < scene->n_point_loads; k++) PetscCall(CheckComponents(mesh, scene->point_load[k].force));
  for (PetscInt k = 0; k < scene->n_springs; k++) PetscCall(CheckComponents(mesh, scene->spring[k].stiffness));
  PetscCall(CheckComponents(mesh, scene->motion.gravity));
  for (PetscInt k = 0; k < scene->n_contacts; k++) PetscCall(CheckComponents(mesh, scene->contact[k]->normal));
  for (PetscInt k = 0; k < scene->n_loads; k++) {
    PetscCall(HycoMeshFindGroup(mesh, scene->load[k].pressure ? "pressure" : "traction", scene->load[k].group, &group));
    HycoCheck(mesh->group_dim[group] == mesh->dim - 1,
              "the load on %s needs a group of dimension %d; that group has dimension %d", scene->load[k].group,
              (int)mesh->dim - 1, (int)mesh->group_dim[group]);
  }
  for (PetscInt k = 0; k < scene->n_point_loads; k++) PetscCall(CheckPointLoad(mesh, &scene->point_load[k]));
  for (PetscInt k = 0; k < scene->n_springs; k++) PetscCall(CheckSpring(mesh, &scene->spring[k]));
  for (PetscInt k = 0; k < scene->n_contacts; k++) PetscCall(CheckContact(mesh, scene->contact[k]));
  for (PetscInt k = 0; k < scene->n_ties; k++) PetscCall(CheckTie(mesh, &scene->tie[k]));
  HycoCheck(!scene->n_contacts || mesh->type != HYCO_HEX20,
            "contact %s: the mesh has hex20 cells, at whose corners a uniform pressure would give tensile forces; use "
            "hex27 cells, or a mesh file, whose hex20 cells are read as hex27",
            scene->contact[0]->name);
  for (PetscInt k = 0; k < scene->n_contacts; k++)
    HycoCheck(!HycoMeshIsQuadratic(mesh) || !scene->contact[k]->ops->find || scene->contact[k]->integrated,
              "contact %s: type surface needs first-order cells, and the mesh has %s; use type: mortar, matching "
              "meshes with type: pair, or mesh with gmsh -order 1",
              scene->contact[k]->name, HycoCellKinds[mesh->type].name);
  /* Outputs last: their group alone is checked, its meaning by the outputs. */
  for (PetscInt k = 0; k < scene->n_quantities; k++) {
    if (scene->quantity[k].group) PetscCall(HycoMeshFindGroup(mesh, "output", scene->quantity[k].group, &group));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether two bodies move a shared node to the same place: here, whether their maps are written alike. */
static PetscBool SameMap(const HycoBody *a, const HycoBody *b)
{
  for (PetscInt c = 0; c < 3; c++) {
    if (!HycoExprAlike(a->map[c], b->map[c])) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* The body of each node: the one of its cells, the first in the scene's order at a shared node. Needed since maps
   and laws belong to bodies, while nodes are moved one by one. Checks that a shared node has one motion. */
PetscErrorCode HycoMeshSetNodeBodies(HycoScene scene, HycoMesh m)
{
  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_nodes, &m->node_body));
  for (PetscInt i = 0; i < m->n_nodes; i++) m->node_body[i] = -1;
  for (PetscInt k = 0; k < m->n_cells * m->nv; k++) {
    PetscInt *body = &m->node_body[m->cells[k]], b = m->cell_body[k / m->nv];

    if (*body >= 0 && *body != b) {
      HycoCheck(SameMap(&scene->body[*body], &scene->body[b]),
                "%s: the bodies %s and %s share node %d and have different maps; give both the same map, or the mesh a "
                "node for each and the scene a tie",
                scene->mesh_path, scene->body[*body].name, scene->body[b].name, (int)m->node_id[m->cells[k]]);
      *body = PetscMin(*body, b);
    } else
      *body = b;
  }
  for (PetscInt k = 0; k < m->n_tied; k++) { /* masters whose cells are on other processes */
    for (PetscInt j = m->tied_start[k]; j < m->tied_start[k + 1]; j++) {
      PetscInt *body = &m->node_body[m->tied_master[j]];

      if (*body < 0) *body = m->ties->body[m->tied_entry[k] + j - m->tied_start[k]];
    }
  }
  /* A 1D or 2D mesh must lie on the line or in the plane. */
  for (PetscInt c = m->dim; c < 3; c++) {
    PetscReal lo = PETSC_MAX_REAL, hi = PETSC_MIN_REAL, size = 0;

    for (PetscInt i = 0; i < m->n_nodes; i++) {
      lo = PetscMin(lo, m->xyz[3 * i + c]);
      hi = PetscMax(hi, m->xyz[3 * i + c]);
      for (PetscInt d = 0; d < m->dim; d++) size = PetscMax(size, PetscAbsReal(m->xyz[3 * i + d] - m->xyz[d]));
    }
    /* Round-off of the file's decimals is allowed, relative to the mesh's extent. */
    HycoCheck(hi - lo <= 1e-9 * size, "%s has cells of dimension %d, but its %c coordinates run from %g to %g",
              scene->mesh_path, (int)m->dim, "xyz"[c], (double)lo, (double)hi);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* In place; lists made in order (most of them) are only scanned. */
PetscErrorCode HycoSortUnique(PetscInt *n, PetscInt a[])
{
  PetscBool sorted;

  PetscFunctionBegin;
  PetscCall(PetscSortedInt(*n, a, &sorted));
  if (sorted)
    PetscCall(PetscSortedRemoveDupsInt(n, a));
  else
    PetscCall(PetscSortRemoveDupsInt(n, a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ends[c]: the largest coordinate c, ends[3 + c]: minus the smallest, so that one reduction with MPI_MAX gives
   both ends over all ranks. */
void HycoMeshEnds(HycoMesh m, PetscReal ends[6])
{
  for (PetscInt c = 0; c < 6; c++) ends[c] = PETSC_MIN_REAL;
  for (PetscInt k = 0; k < 3 * m->n_nodes; k++) {
    ends[k % 3] = PetscMax(ends[k % 3], m->xyz[k]);
    ends[3 + k % 3] = PetscMax(ends[3 + k % 3], -m->xyz[k]);
  }
}

/* The longest side of the bounding box of the whole mesh (length): the scale of tolerances. A part uses the whole
   mesh's value, so that tolerances do not depend on the partition. Asked for each node: visited once. */
PetscReal HycoMeshLength(HycoMesh m)
{
  PetscReal ends[6];

  if (m->whole_length > 0) return m->whole_length;
  if (m->length > 0) return m->length;
  HycoMeshEnds(m, ends);
  for (PetscInt c = 0; c < 3; c++) m->length = PetscMax(m->length, ends[c] + ends[3 + c]);
  return m->length;
}

/* The star forest from the owners' nodes (contiguous numbers of the distributed vectors) to n given ones.
   Collective; the caller destroys it. */
PetscErrorCode HycoMeshNodeSF(MPI_Comm comm, HycoMesh part, PetscInt n, const PetscInt global[], PetscSF *sf)
{
  PetscLayout layout;

  PetscFunctionBegin;
  /* PETSC_DETERMINE needs a reduction, so that ranks without nodes must call this too. */
  PetscCall(PetscLayoutCreateFromSizes(comm, part->n_owned, PETSC_DETERMINE, 1, &layout));
  PetscCall(PetscSFCreate(comm, sf));
  PetscCall(PetscSFSetGraphLayout(*sf, layout, n, NULL, PETSC_OWN_POINTER, global));
  PetscCall(PetscLayoutDestroy(&layout));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Neighbouring entries mostly have one owner, so that the last one is tried before the search. */
PetscErrorCode HycoMeshOwners(MPI_Comm comm, HycoMesh part, PetscInt n, const PetscInt global[], PetscMPIInt owner[])
{
  PetscLayout layout;
  PetscMPIInt last = 0;

  PetscFunctionBegin;
  PetscCall(PetscLayoutCreateFromSizes(comm, part->n_owned, PETSC_DETERMINE, 1, &layout));
  for (PetscInt k = 0; k < n; k++) {
    /* Bisection only when the owner changes. */
    if (global[k] < layout->range[last] || global[k] >= layout->range[last + 1])
      PetscCall(PetscLayoutFindOwner(layout, global[k], &last));
    owner[k] = last;
  }
  PetscCall(PetscLayoutDestroy(&layout));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The cells around each node in CSR, masters of tied nodes included; cells ascend at each node. The caller frees both
   arrays. Two passes: count, then fill. */
PetscErrorCode HycoMeshNodeCells(HycoMesh m, PetscInt **start, PetscInt **cell)
{
  PetscInt *next, node[HYCO_MAX_CELL_NODES];

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(m->n_nodes + 1, start));
  for (PetscInt e = 0; e < m->n_cells; e++) {
    const PetscInt n = HycoMeshCellNodes(m, e, node);

    /* Counts at node + 1; the sums below turn them into starts. */
    for (PetscInt v = 0; v < n; v++) (*start)[node[v] + 1]++;
  }
  for (PetscInt i = 0; i < m->n_nodes; i++) (*start)[i + 1] += (*start)[i];
  PetscCall(PetscMalloc1((*start)[m->n_nodes], cell));
  HycoDuplicate(m->n_nodes, *start, &next);
  for (PetscInt e = 0; e < m->n_cells; e++) {
    const PetscInt n = HycoMeshCellNodes(m, e, node);

    for (PetscInt v = 0; v < n; v++) (*cell)[next[node[v]]++] = e;
  }
  PetscCall(PetscFree(next));
  PetscFunctionReturn(PETSC_SUCCESS);
}
