/*
  Reactions that follow from balance: the forces of all supports, loads and contacts on connected bodies sum to zero
  along an axis. Where a quantity's group has every support of such bodies along its axis, and no spring acts there, the
  reaction is minus the sum of the loads and of the contact forces on these bodies, whatever the displacements are.
*/
#include <hycoquantities.h>

PetscErrorCode HycoJoinBodies(MPI_Comm comm, HycoScene scene, HycoMesh m, PetscInt part[])
{
  const PetscInt n = scene->n_bodies;
  PetscBool *joined, change = PETSC_TRUE;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(n * n, &joined));
  for (PetscInt k = 0; k < m->n_cells * m->nv; k++)
    joined[m->cell_body[k / m->nv] * n + m->node_body[m->cells[k]]] = PETSC_TRUE;
  for (PetscInt k = 0; k < m->n_tied; k++) {
    for (PetscInt j = m->tied_start[k]; j < m->tied_start[k + 1]; j++)
      joined[m->node_body[m->tied[k]] * n + m->node_body[m->tied_master[j]]] = PETSC_TRUE;
  }
  /* A rank's part may contain none of the nodes that two bodies share. */
  HycoAllreduce(joined, n * n, HYCO_MPI_BOOL, MPI_LOR, comm);
  for (PetscInt b = 0; b < n; b++) part[b] = b;
  /* The least number spreads along chains of bodies, until nothing changes. */
  while (change) {
    change = PETSC_FALSE;
    for (PetscInt k = 0; k < n * n; k++) {
      const PetscInt a = k / n, b = k % n, least = PetscMin(part[a], part[b]);

      if (!joined[k] || part[a] == part[b]) continue;
      part[a] = part[b] = least;
      change = PETSC_TRUE;
    }
  }
  PetscCall(PetscFree(joined));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a support can have a force along an axis. A direction that varies in space is taken to act: the answer
   then errs to the safe side. */
static PetscErrorCode SupportActs(const HycoFixed *fixed, PetscInt axis, PetscBool *acts)
{
  const PetscReal mu[HYCO_MAX_PARAMETERS] = {0}, x[3] = {0, 0, 0}; /* a direction does not change with parameters */
  HycoExpr direction = fixed->direction[axis];
  PetscReal value = 1;

  PetscFunctionBegin;
  if (direction && !HycoExprInSpace(direction)) PetscCall(HycoExprEval(direction, mu, 1, x, &value));
  *acts = (PetscBool)(fixed->value[axis] || (direction && value != 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks the parts of a group's nodes, on which a support or (in: NULL) a spring acts: inside[] of the nodes with in[],
   outside[] of the others. */
static PetscErrorCode MarkGroup(HycoMesh m, const char key[], const char name[], const PetscInt part[],
                                const PetscBool in[], PetscBool inside[], PetscBool outside[])
{
  PetscInt g = 0;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(m, key, name, &g));
  for (PetscInt k = m->group_start[g]; k < m->group_start[g + 1]; k++) {
    const PetscInt i = m->group_node[k];

    if (in && HycoMeshTied(m, i) >= 0) continue; /* its masters have the support */
    (in && in[i] ? inside : outside)[part[m->node_body[i]]] = PETSC_TRUE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks the parts that supports of the quantity's group hold along its axis, and those that something else holds.
   A spring's force is a reaction of none of the groups, so it always counts as outside. */
static PetscErrorCode MarkHeld(HycoScene scene, HycoMesh m, const HycoQuantity *q, const PetscInt part[],
                               const PetscBool in[], PetscBool inside[], PetscBool outside[])
{
  PetscFunctionBegin;
  for (PetscInt s = 0; s < scene->n_fixed; s++) {
    PetscBool acts = PETSC_FALSE;

    /* A support along an oblique direction acts along each axis on which it has a component. */
    PetscCall(SupportActs(&scene->fixed[s], q->field, &acts));
    if (acts) PetscCall(MarkGroup(m, "fixed", scene->fixed[s].group, part, in, inside, outside));
  }
  for (PetscInt s = 0; s < scene->n_springs; s++) {
    const HycoSpring *spring = &scene->spring[s];

    if (spring->stiffness[q->field] || spring->stiffness[3])
      PetscCall(MarkGroup(m, "spring", spring->group, part, NULL, inside, outside));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* in[n_nodes]: marks the group of a quantity; without one all nodes. */
static PetscErrorCode MarkNodes(HycoMesh m, const HycoQuantity *q, PetscBool in[])
{
  PetscInt g = 0;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < m->n_nodes; i++) in[i] = (PetscBool)!q->group;
  if (!q->group) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoMeshFindGroup(m, "output", q->group, &g));
  for (PetscInt k = m->group_start[g]; k < m->group_start[g + 1]; k++) in[m->group_node[k]] = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* held: 2 x n_bodies for each quantity: inside its group, outside it. */
static PetscErrorCode MarkAll(HycoScene scene, HycoMesh m, const PetscInt part[], PetscBool held[])
{
  const PetscInt n = scene->n_bodies;
  PetscBool *in;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_nodes, &in));
  for (PetscInt k = 0; k < scene->n_quantities; k++) {
    const HycoQuantity *q = &scene->quantity[k];

    if (q->kind != HYCO_QUANTITY_REACTION) continue;
    PetscCall(MarkNodes(m, q, in));
    PetscCall(MarkHeld(scene, m, q, part, in, held + 2 * k * n, held + (2 * k + 1) * n));
  }
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* balanced: n_quantities x n_bodies: whether quantity k follows from the balance of body b. It does for none of
   them if a body is also held from outside the group, since only the sum of both is known. */
PetscErrorCode HycoQuantitiesBalance(MPI_Comm comm, HycoScene scene, HycoMesh m, PetscBool balanced[])
{
  const PetscInt n = scene->n_bodies;
  PetscBool *held;
  PetscInt *part;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &part));
  PetscCall(PetscCalloc1(2 * scene->n_quantities * n, &held));
  /* Bodies that are tied to each other have one balance: forces between them are not known one by one. */
  PetscCall(HycoJoinBodies(comm, scene, m, part));
  HycoOnEach(comm, MarkAll(scene, m, part, held));
  /* Each rank sees the nodes of its part alone, and a group may be on several. */
  HycoAllreduce(held, 2 * scene->n_quantities * n, HYCO_MPI_BOOL, MPI_LOR, comm);
  for (PetscInt k = 0; k < scene->n_quantities; k++) {
    const PetscBool *inside = held + 2 * k * n, *outside = inside + n;
    PetscBool follows = PETSC_TRUE;

    /* Of all bodies: the reaction is one number, the sum over the group, so one undetermined body spoils it. */
    for (PetscInt b = 0; b < n; b++) follows = (PetscBool)(follows && !(inside[b] && outside[b]));
    for (PetscInt b = 0; b < n; b++) balanced[k * n + b] = (PetscBool)(follows && inside[part[b]]);
  }
  HycoFreeAll(&held, &part);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks the cells around the points and lines of a load. node[]: room for the nodes. */
static PetscErrorCode MarkPoints(HycoMesh m, const HycoPointLoad *load, PetscBool node[], PetscBool needed[])
{
  PetscInt g = 0;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(m, "force", load->group, &g));
  PetscCall(PetscArrayzero(node, m->n_nodes));
  for (PetscInt k = m->group_start[g]; k < m->group_start[g + 1]; k++) node[m->group_node[k]] = PETSC_TRUE;
  for (PetscInt k = 0; k < m->n_cells * m->nv; k++) {
    /* A concentrated force goes to a node; the cells around it are what makes the node part of the RID. */
    if (node[m->cells[k]]) needed[k / m->nv] = PETSC_TRUE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* needed[n_cells]: cells at which loads must be integrated. of[]: the bodies whose volume forces count; loads on
   groups count on all. */
PetscErrorCode HycoMarkLoads(HycoScene scene, HycoMesh m, const PetscBool of[], PetscBool needed[])
{
  PetscBool *node;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(needed, m->n_cells));
  PetscCall(PetscMalloc1(m->n_nodes, &node));
  for (PetscInt s = 0; s < scene->n_loads; s++) {
    PetscInt g = 0;

    PetscCall(HycoMeshFindGroup(m, "load", scene->load[s].group, &g));
    for (PetscInt f = 0; f < m->n_facets; f++) {
      /* A facet without a cell belongs to another rank. */
      if (m->facet_group[f] == g && m->facet_cell[f] >= 0) needed[m->facet_cell[f]] = PETSC_TRUE;
    }
  }
  for (PetscInt s = 0; s < scene->n_point_loads; s++) PetscCall(MarkPoints(m, &scene->point_load[s], node, needed));
  PetscCall(PetscFree(node));
  for (PetscInt e = 0; e < m->n_cells; e++) {
    const HycoBody *body = &scene->body[m->cell_body[e]];

    if (!of[m->cell_body[e]]) continue;
    /* By what the scene says, not by values: a force that is zero at these parameters may not be at others. */
    if (body->force[0] || body->force[1] || body->force[2] || HycoSceneHasInertia(scene, body, NULL))
      needed[e] = PETSC_TRUE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* So that the RID contains them: the reduced model integrates its loads there. */
PetscErrorCode HycoQuantitiesMarkLoads(HycoScene scene, HycoMesh m, const PetscBool balanced[], PetscBool needed[])
{
  PetscBool *of;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(scene->n_bodies, &of));
  /* The balance of a body needs all loads on it, wherever on the body they act. */
  for (PetscInt k = 0; k < scene->n_quantities * scene->n_bodies; k++)
    of[k % scene->n_bodies] = (PetscBool)(of[k % scene->n_bodies] || balanced[k]);
  HycoFinally(HycoMarkLoads(scene, m, of, needed), PetscCall(PetscFree(of)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
