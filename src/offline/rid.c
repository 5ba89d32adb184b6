/* Omega_A: supports of the interpolation points, region of interest, contact extension, layers. */
#include <hycodomain.h>
#include <string.h>

/* Cells all of whose nodes lie in the union of the points' supports (20). */
static PetscErrorCode AddSupports(HycoMesh m, const HycoRIDRecipe *r, const PetscInt start[], const PetscInt around[],
                                  PetscBool in[])
{
  PetscBool *covered;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(m->n_nodes, &covered));
  for (PetscInt k = 0; k < r->n_nodes; k++) {
    for (PetscInt j = start[r->nodes[k]]; j < start[r->nodes[k] + 1]; j++) {
      for (PetscInt v = 0; v < m->nv; v++) covered[m->cells[around[j] * m->nv + v]] = PETSC_TRUE;
    }
  }
  for (PetscInt k = 0; k < r->n_cells; k++) {
    for (PetscInt v = 0; v < m->nv; v++) covered[m->cells[r->cells[k] * m->nv + v]] = PETSC_TRUE;
  }
  for (PetscInt e = 0; e < m->n_cells; e++) {
    PetscBool all = PETSC_TRUE;

    for (PetscInt v = 0; v < m->nv; v++) all = (PetscBool)(all && covered[m->cells[e * m->nv + v]]);
    if (all) in[e] = PETSC_TRUE;
  }
  PetscCall(PetscFree(covered));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The region of interest: cells of cell groups, cells behind facet groups, cells at nodes of smaller groups. */
static PetscErrorCode AddGroup(HycoMesh m, const char name[], const PetscInt start[], const PetscInt around[],
                               PetscBool in[])
{
  PetscInt g = 0;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(m, "hyco_rid_groups", name, &g));
  if (m->group_dim[g] == m->dim) {
    for (PetscInt k = m->group_cell_start[g]; k < m->group_cell_start[g + 1]; k++) in[m->group_cell[k]] = PETSC_TRUE;
  } else if (m->group_dim[g] == m->dim - 1) {
    for (PetscInt f = 0; f < m->n_facets; f++) {
      if (m->facet_group[f] == g) in[m->facet_cell[f]] = PETSC_TRUE;
    }
  } else {
    for (PetscInt k = m->group_start[g]; k < m->group_start[g + 1]; k++) {
      for (PetscInt j = start[m->group_node[k]]; j < start[m->group_node[k] + 1]; j++) in[around[j]] = PETSC_TRUE;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AddRegion(HycoScene scene, HycoMesh m, const char text[], const PetscInt start[],
                                const PetscInt around[], PetscBool in[])
{
  HycoExpr expr;
  PetscReal *value;

  PetscFunctionBegin;
  PetscCall(HycoExprCreate("hyco_rid_region", text, 0, NULL, &expr));
  (void)scene;
  PetscCall(PetscMalloc1(m->n_nodes, &value));
  PetscCall(HycoExprEval(expr, NULL, m->n_nodes, m->xyz, value));
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    for (PetscInt j = start[i]; value[i] > 0 && j < start[i + 1]; j++) in[around[j]] = PETSC_TRUE;
  }
  PetscCall(PetscFree(value));
  PetscCall(HycoExprDestroy(&expr));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MarkNodes(HycoMesh m, const PetscBool in[], PetscBool node[])
{
  PetscFunctionBegin;
  PetscCall(PetscArrayzero(node, m->n_nodes));
  for (PetscInt k = 0; k < m->n_cells * m->nv; k++) {
    if (in[k / m->nv]) node[m->cells[k]] = PETSC_TRUE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Section 7.2: cells on Gamma^C with a node closer than d to a node of Gamma^C that Omega_A has. */
static PetscErrorCode ExtendContact(HycoScene scene, HycoMesh m, const HycoPairs *pairs, PetscReal d,
                                    const PetscInt start[], const PetscInt around[], PetscBool in[])
{
  PetscBool *node, *contact;
  PetscInt *list, n = 0, n_in = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_nodes, &node));
  PetscCall(PetscCalloc2(m->n_nodes, &contact, m->n_nodes, &list));
  PetscCall(MarkNodes(m, in, node));
  PetscCall(HycoPairsMarkSurfaces(scene, m, pairs, contact));
  for (PetscInt pass = 0; pass < 2; pass++) { /* those in Omega_A first */
    for (PetscInt i = 0; i < m->n_nodes; i++) {
      if (contact[i] && node[i] == (pass == 0)) list[n++] = i;
    }
    if (pass == 0) n_in = n;
  }
  for (PetscInt k = n_in; k < n; k++) {
    PetscBool near = PETSC_FALSE;

    for (PetscInt j = 0; j < n_in && !near; j++) {
      PetscReal sum = 0;

      for (PetscInt c = 0; c < 3; c++)
        sum +=
            (m->xyz[3 * list[k] + c] - m->xyz[3 * list[j] + c]) * (m->xyz[3 * list[k] + c] - m->xyz[3 * list[j] + c]);
      near = (PetscBool)(sum < d * d);
    }
    for (PetscInt j = start[list[k]]; near && j < start[list[k] + 1]; j++) {
      PetscInt on = 0;

      for (PetscInt v = 0; v < m->nv; v++) on += contact[m->cells[around[j] * m->nv + v]];
      if (on >= m->nf) in[around[j]] = PETSC_TRUE;
    }
  }
  PetscCall(PetscFree(node));
  PetscCall(PetscFree2(contact, list));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Surfaces that do not match: the cells with the masters of the slaves that Omega_A has, so that their gaps can be
   computed. (Their other neighbours then have an interface of their own: the other way round all of Gamma^C would
   come.) */
static PetscErrorCode CompleteSlaves(HycoMesh m, const HycoPairs *pairs, const PetscInt start[],
                                     const PetscInt around[], PetscBool in[])
{
  PetscBool *node;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_nodes, &node));
  PetscCall(MarkNodes(m, in, node));
  for (PetscInt k = 0; k < pairs->n; k++) {
    const PetscInt *master;
    const PetscReal *weight;
    PetscInt n;

    HycoPairsMasters(pairs, k, &n, &master, &weight);
    if (n < 2 || !node[HycoPairsSlave(pairs, k)]) continue;
    for (PetscInt j = start[master[0]]; j < start[master[0] + 1]; j++) {
      PetscInt has = 0;

      for (PetscInt v = 0; v < m->nv; v++) {
        for (PetscInt i = 0; i < n; i++) has += m->cells[around[j] * m->nv + v] == master[i];
      }
      if (has == n) in[around[j]] = PETSC_TRUE;
    }
  }
  PetscCall(PetscFree(node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Moved surfaces: the cells around all nodes of contacts that have one in Omega_A. A slave outside would close, on its
   way, the masters of all places to the interface, and leave no contact node of the master's body in A. */
static PetscErrorCode CompleteMoved(HycoMesh m, const HycoPairs *pairs, const PetscInt start[], const PetscInt around[],
                                    PetscBool in[])
{
  PetscBool *node, grown = (PetscBool)(pairs->room > 0);

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_nodes, &node));
  while (grown) {
    grown = PETSC_FALSE;
    PetscCall(MarkNodes(m, in, node));
    for (PetscInt k = 0; k < pairs->n; k++) {
      const PetscInt slave = HycoPairsSlave(pairs, k), *master;
      const PetscReal *weight;
      PetscBool any = node[slave];
      PetscInt n;

      if (!HycoPairsMoved(pairs, k)) continue;
      HycoPairsMasters(pairs, k, &n, &master, &weight);
      for (PetscInt j = 0; j < n; j++) any = (PetscBool)(any || node[master[j]]);
      for (PetscInt j = -1; any && j < n; j++) {
        const PetscInt i = j < 0 ? slave : master[j];

        for (PetscInt e = start[i]; e < start[i + 1]; e++) {
          grown = (PetscBool)(grown || !in[around[e]]);
          in[around[e]] = PETSC_TRUE;
        }
      }
    }
  }
  PetscCall(PetscFree(node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cells that share a node with Omega_A. */
static PetscErrorCode AddLayer(HycoMesh m, PetscBool in[], PetscInt *added)
{
  PetscBool *node;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_nodes, &node));
  PetscCall(MarkNodes(m, in, node));
  *added = 0;
  for (PetscInt k = 0; k < m->n_cells * m->nv; k++) {
    if (!node[m->cells[k]] || in[k / m->nv]) continue;
    in[k / m->nv] = PETSC_TRUE;
    (*added)++;
  }
  PetscCall(PetscFree(node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoRIDBuild(HycoScene scene, HycoMesh m, const HycoPairs *pairs, const HycoRIDRecipe *r, PetscBool in[])
{
  PetscInt *start, *around, added = 1;

  PetscFunctionBegin;
  for (PetscInt e = 0; e < m->n_cells; e++) in[e] = r->whole;
  PetscCall(HycoMeshNodeCells(m, &start, &around));
  PetscCall(AddSupports(m, r, start, around, in));
  for (PetscInt k = 0; k < r->n_groups; k++) PetscCall(AddGroup(m, r->groups[k], start, around, in));
  if (r->region) PetscCall(AddRegion(scene, m, r->region, start, around, in));
  if (r->extension > 0) PetscCall(ExtendContact(scene, m, pairs, r->extension, start, around, in));
  PetscCall(CompleteSlaves(m, pairs, start, around, in));
  PetscCall(CompleteMoved(m, pairs, start, around, in));
  for (PetscInt k = 0; k < r->layers && added; k++) PetscCall(AddLayer(m, in, &added));
  PetscCall(CompleteSlaves(m, pairs, start, around, in));
  PetscCall(CompleteMoved(m, pairs, start, around, in));
  PetscCall(PetscFree(start));
  PetscCall(PetscFree(around));
  PetscFunctionReturn(PETSC_SUCCESS);
}
