/* Obstacles: the displacement of a group's nodes along the normal is at most the gap. */
#include <hycocontactimpl.h>

/* Without a master: the gap and the normal are expressions of the position. */
PetscErrorCode HycoContactCreate_Obstacle(HycoContact contact)
{
  PetscFunctionBegin;
  PetscCall(HycoContactDeclare(contact, "group", "the nodes that may meet it", HYCO_ENTRY_GROUP, PETSC_TRUE));
  PetscCall(HycoContactDeclareNormal(contact));
  PetscCall(HycoContactDeclare(contact, "gap", "the initial gap", HYCO_ENTRY_EXPRESSION, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}
