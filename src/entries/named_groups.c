/* The groups of the mesh that a scene names. */
#include <hycocontactimpl.h>

/* The one list of entries that name groups: the checks of a mesh and the inspection both use it. A group may be
   visited several times. */
PetscErrorCode HycoSceneVisitGroups(HycoScene s, HycoGroupVisitor visit, void *context)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n_bodies; k++) PetscCall(visit("body", s->body[k].name, context));
  for (PetscInt k = 0; k < s->n_fixed; k++) PetscCall(visit("fixed", s->fixed[k].group, context));
  for (PetscInt k = 0; k < s->n_loads; k++) PetscCall(visit("load", s->load[k].group, context));
  for (PetscInt k = 0; k < s->n_point_loads; k++) PetscCall(visit("force", s->point_load[k].group, context));
  for (PetscInt k = 0; k < s->n_springs; k++) PetscCall(visit("spring", s->spring[k].group, context));
  for (PetscInt k = 0; k < s->n_ties; k++) PetscCall(visit("tie", s->tie[k].slave, context));
  for (PetscInt k = 0; k < s->n_ties; k++) PetscCall(visit("tie", s->tie[k].master, context));
  for (PetscInt k = 0; k < s->n_contacts; k++) {
    /* A type of contact declares its entries, so that those of programs are found too. */
    for (PetscInt j = 0; j < s->contact[k]->entries.n; j++) {
      const HycoEntry *entry = &s->contact[k]->entries.entry[j];

      if (entry->kind == HYCO_ENTRY_GROUP && entry->text) PetscCall(visit("contact", entry->text, context));
    }
  }
  for (PetscInt k = 0; k < s->n_quantities; k++) {
    if (s->quantity[k].group) PetscCall(visit("output", s->quantity[k].group, context));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
