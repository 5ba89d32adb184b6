/*
  A rigid body, whose surface is given by its gap like an obstacle's. It translates with one node of the mesh, which is
  the master of all of the contact's nodes: supports, forces and springs of that node are those of the body.
*/
#include "../../surface_normals.h"

/* All slaves have the same master with weight 1; the rank that has no slaves need not have the master's node. */
static PetscErrorCode SetUp(HycoContact c, HycoFE fe, PetscInt index, HycoPairs *pairs)
{
  HycoMesh m = fe->mesh;
  const PetscReal one = 1;
  PetscBool shared = PETSC_FALSE;
  PetscInt g = 0, body, n, *slave, *side;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(m, "contact", c->master, &g));
  if (pairs->facts && m->group_start[g + 1] == m->group_start[g])
    PetscFunctionReturn(PETSC_SUCCESS); /* no slaves here */
  HycoCheck(m->group_start[g + 1] == m->group_start[g] + 1,
            "contact %s: its master is the one node that the rigid body moves with, and %s has %d nodes; give a group "
            "of one point",
            c->name, c->master, (int)(m->group_start[g + 1] - m->group_start[g]));
  /* Of the contact's own group, and by its number in this mesh: each rank with slaves has a copy of the node. */
  body = m->group_node[m->group_start[g]];
  PetscCall(HycoMeshFindGroup(m, "contact", c->slave, &g));
  PetscCall(HycoContactSlaves(fe, pairs, index, &n, &slave, &side));
  PetscCall(HycoPairsReserve(pairs, n, 1));
  for (PetscInt k = m->group_start[g]; k < m->group_start[g + 1]; k++)
    shared = (PetscBool)(shared || m->group_node[k] == body);
  for (PetscInt k = 0; k < n; k++) HycoPairsAppend(pairs, index, slave[k], side[k], 1, &body, &one);
  HycoFreeAll(&slave, &side);
  HycoCheck(!shared, "contact %s: its slave %s has the node that the rigid body moves with (%s); leave it out", c->name,
            c->slave, c->master);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* rigid: the gap is measured from the slave's position, since the master node is not on the surface. A normal is
   required for the same reason: there is no facet to take it from. */
PetscErrorCode HycoContactCreate_Rigid(HycoContact contact)
{
  static const struct _HycoContactOps ops = {.setup = SetUp};

  PetscFunctionBegin;
  PetscCall(HycoContactDeclare(contact, "slave", "the nodes that may meet it", HYCO_ENTRY_GROUP, PETSC_TRUE));
  PetscCall(HycoContactDeclare(contact, "master", "the node that it moves with", HYCO_ENTRY_GROUP, PETSC_TRUE));
  PetscCall(HycoContactDeclareNormal(contact));
  PetscCall(HycoContactDeclare(contact, "gap", "the initial gap", HYCO_ENTRY_EXPRESSION, PETSC_TRUE));
  PetscCall(HycoContactSetOps(contact, &ops));
  contact->rigid = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}
