/* Obstacles: the nodes of a group do not move farther than the gap along the normal. */
#include <hycocontactimpl.h>

PetscErrorCode HycoContactCreate_Obstacle(HycoContact contact)
{
  PetscFunctionBegin;
  PetscCall(HycoContactDeclare(contact, "group", "the nodes that may meet it", HYCO_ENTRY_GROUP, PETSC_TRUE));
  PetscCall(HycoContactDeclareNormal(contact));
  PetscCall(HycoContactDeclare(contact, "gap", "the initial gap", HYCO_ENTRY_EXPRESSION, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}
