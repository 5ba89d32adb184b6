/* A mesh in a model file. */
#include <hycoromimpl.h>
#include <stdio.h>

/* The groups' names, one on each line. */
PetscErrorCode HycoMeshMoveGroupNames(HycoH5 h, const char name[], HycoMesh m)
{
  char *names, *word, *rest;
  size_t length = 1;
  PetscInt g = 0;

  PetscFunctionBegin;
  if (!HycoH5Reads(h)) {
    for (g = 0; g < m->n_groups; g++) length += strlen(m->group_name[g]) + 1;
    PetscCall(PetscCalloc1(length, &names));
    for (g = 0; g < m->n_groups; g++) {
      PetscCall(PetscStrlcat(names, m->group_name[g], length));
      /* A newline separates: names of groups cannot contain it, since they come from lines of a file. */
      PetscCall(PetscStrlcat(names, "\n", length));
    }
    PetscCall(HycoH5WriteText(h, name, names));
  } else {
    PetscCall(PetscCalloc1(m->n_groups + 1, &m->group_name));
    PetscCall(HycoH5LoadText(h, name, &names));
    for (word = strtok_r(names, "\n", &rest); word && g < m->n_groups; word = strtok_r(NULL, "\n", &rest))
      PetscCall(PetscStrallocpy(word, &m->group_name[g++]));
  }
  PetscCall(PetscFree(names));
  HycoCheck(g == m->n_groups, "the model's group names are damaged");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const char *MeshFileEntry(const char prefix[], const char name[], char path[128])
{
  (void)snprintf(path, 128, "%s/%s", prefix, name);
  return path;
}

PetscErrorCode HycoMeshMove(HycoH5 h, const char prefix[], PetscInt n_bodies, HycoMesh *mesh)
{
  HycoMesh m;
  PetscInt head[2], last;
  char path[128];

  PetscFunctionBegin;
  if (HycoH5Reads(h)) {
    PetscCall(PetscNew(mesh));
    (*mesh)->n_nodes = (*mesh)->n_cells = (*mesh)->n_facets = (*mesh)->n_groups = -1;
  }
  m = *mesh;
  head[0] = (PetscInt)m->type;
  head[1] = m->dim;
  PetscCall(HycoH5Ints(h, MeshFileEntry(prefix, "head", path), 0, HYCO_N_MESH_TYPES - 1, 2, head));
  /* Everything below has sizes that follow from type and dimension. */
  m->type = (HycoCellType)head[0];
  m->dim = HycoElementGet(m->type)->dim;
  m->nv = HycoElementGet(m->type)->nv;
  m->nf = HycoElementGetFacet(m->type)->nv;
  PetscCall(HycoH5Real(h, MeshFileEntry(prefix, "xyz", path), &m->n_nodes, 3, &m->xyz));
  /* Each array of indices is checked against the size that was read before it: a damaged file is refused, not
     followed. */
  last = m->n_nodes - 1;
  PetscCall(HycoH5Int(h, MeshFileEntry(prefix, "node_id", path), 0, PETSC_MAX_INT, &m->n_nodes, 1, &m->node_id));
  PetscCall(HycoH5Int(h, MeshFileEntry(prefix, "node_body", path), 0, n_bodies - 1, &m->n_nodes, 1, &m->node_body));
  PetscCall(HycoH5Int(h, MeshFileEntry(prefix, "cells", path), 0, last, &m->n_cells, m->nv, &m->cells));
  PetscCall(HycoH5Int(h, MeshFileEntry(prefix, "cell_id", path), 0, PETSC_MAX_INT, &m->n_cells, 1, &m->cell_id));
  PetscCall(HycoH5Int(h, MeshFileEntry(prefix, "cell_body", path), 0, n_bodies - 1, &m->n_cells, 1, &m->cell_body));
  PetscCall(HycoH5Int(h, MeshFileEntry(prefix, "facets", path), 0, last, &m->n_facets, m->nf, &m->facets));
  PetscCall(HycoH5Int(h, MeshFileEntry(prefix, "group_dim", path), 0, 3, &m->n_groups, 1, &m->group_dim));
  PetscCall(HycoMeshMoveGroupNames(h, MeshFileEntry(prefix, "group_name", path), m));
  PetscCall(HycoH5Starts(h, MeshFileEntry(prefix, "group_start", path), m->n_groups, &m->group_start));
  PetscCall(HycoH5Int(h, MeshFileEntry(prefix, "group_node", path), 0, last, &m->group_start[m->n_groups], 1,
                      &m->group_node));
  PetscCall(
      HycoH5Int(h, MeshFileEntry(prefix, "facet_group", path), 0, m->n_groups - 1, &m->n_facets, 1, &m->facet_group));
  PetscCall(
      HycoH5Int(h, MeshFileEntry(prefix, "facet_cell", path), -1, m->n_cells - 1, &m->n_facets, 1, &m->facet_cell));
  if (!HycoH5Reads(h)) PetscFunctionReturn(PETSC_SUCCESS);
  /* Derived: a collapsed cell has repeated nodes. */
  for (PetscInt e = 0; e < m->n_cells; e++) m->mixed = (PetscBool)(m->mixed || HycoMeshShape(m, e) != m->type);
  /* Groups of cells serve the whole mesh alone, and are read with it (whole_mesh.c). */
  PetscCall(PetscCalloc1(m->n_groups + 1, &m->group_cell_start));
  PetscCall(PetscMalloc1(1, &m->group_cell));
  PetscFunctionReturn(PETSC_SUCCESS);
}
