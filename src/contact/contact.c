/* HycoContact: the class of contacts, its registry, and the scene's entries of a contact. */
#include <hycocontactimpl.h>
#include <hycoregistry.h>
#include <string.h>

/* Sorted by name, so that the list of a message does not depend on the order in which extensions register. */
static HycoRegistry types = {.sorted = PETSC_TRUE};

HycoDefineRegister(HycoContactRegister, types, PetscErrorCode (*create)(HycoContact))

/* Without a type: HycoContactSetType() gives the methods and the entries, and HycoContactComplete() checks them once
   the scene has been read. */
PetscErrorCode HycoContactCreate(MPI_Comm comm, HycoContact *contact)
{
  PetscFunctionBegin;
  HycoCheckGiven(contact);
  PetscCall(HycoPackageCheck());
  PetscCall(PetscHeaderCreate(*contact, HYCO_CONTACT_CLASSID, "HycoContact", "Contact discretisation", "Hyco", comm,
                              HycoContactDestroy, HycoContactView));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The type's destroy comes first: it may still read the entries. */
PetscErrorCode HycoContactDestroy(HycoContact *contact)
{
  PetscFunctionBegin;
  HycoDestroyBegin(contact, HYCO_CONTACT_CLASSID);
  if ((*contact)->ops->destroy) PetscCall((*(*contact)->ops->destroy)(*contact));
  PetscCall(HycoDeclaredDestroy(&(*contact)->entries));
  PetscCall(PetscHeaderDestroy(contact));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each type may have friction, unless it has an entry of this name itself. */
static PetscErrorCode DeclareFriction(HycoContact contact)
{
  HycoEntry *entry;

  PetscFunctionBegin;
  if (HycoDeclaredFind(&contact->entries, "friction")) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoDeclaredAdd(&contact->entries, "friction", "coefficient of friction", HYCO_ENTRY_EXPRESSION,
                            PETSC_FALSE, &entry));
  entry->law = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The type's constructor declares its entries, which the scene then reads. */
PetscErrorCode HycoContactSetType(HycoContact contact, HycoContactType type)
{
  PetscErrorCode (*create)(HycoContact);

  PetscFunctionBegin;
  HycoCheckHandle(contact, HYCO_CONTACT_CLASSID);
  HycoCheckGiven(type);
  PetscCall(HycoRegistryFind(&types, type, &create));
  if (!create) {
    char list[HYCO_LINE];

    PetscCall(HycoRegistryList(&types, type, list));
    HycoFail("contact %s: the type \"%s\" is unknown; it must be %s",
             ((PetscObject)contact)->name ? ((PetscObject)contact)->name : "(none)", type, list);
  }
  PetscCall(PetscObjectChangeTypeName((PetscObject)contact, type));
  /* The type name is set before, since errors of the constructor name the type. Friction is declared after it, so
     that a type may take the name for itself. */
  PetscCall((*create)(contact));
  PetscCall(DeclareFriction(contact));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoContactGetType, (HycoContact contact, HycoContactType *type), contact, HYCO_CONTACT_CLASSID,
                 HycoCheckGiven(type);
                 *type = ((PetscObject)contact)->type_name)

PetscErrorCode HycoContactView(HycoContact contact, PetscViewer viewer)
{
  PetscFunctionBegin;
  HycoViewBegin(contact, HYCO_CONTACT_CLASSID, viewer);
  PetscCall(HycoDeclaredView(&contact->entries, viewer));
  if (contact->ops->view) PetscCall((*contact->ops->view)(contact, viewer));
  PetscCall(PetscViewerASCIIPopTab(viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For constructors of types only: the scene reads the entries right after the type is set, and rejects others.
   `required`: HycoContactComplete() refuses a scene without it. */
PetscErrorCode HycoContactDeclare(HycoContact contact, const char name[], const char title[], HycoEntryKind kind,
                                  PetscBool required)
{
  HycoEntry *entry;

  PetscFunctionBegin;
  HycoCheckHandle(contact, HYCO_CONTACT_CLASSID);
  HycoCheckGiven(name);
  HycoCheckGiven(title);
  PetscCall(HycoDeclaredAdd(&contact->entries, name, title, kind, required, &entry));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Three scalar entries, and not a vector: an absent component is 0, and all absent mean the surface's averaged
   normal. */
PetscErrorCode HycoContactDeclareNormal(HycoContact contact)
{
  static const char *const names[] = {"normal_x", "normal_y", "normal_z"};

  PetscFunctionBegin;
  for (PetscInt c = 0; c < 3; c++)
    PetscCall(HycoContactDeclare(contact, names[c], "component of the normal", HYCO_ENTRY_EXPRESSION, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoContactSetOps, (HycoContact contact, const struct _HycoContactOps *ops), contact,
                 HYCO_CONTACT_CLASSID, HycoCheckGiven(ops);
                 *contact->ops = *ops)
HycoDefineMethod(HycoContactSetData, (HycoContact contact, void *data), contact, HYCO_CONTACT_CLASSID,
                 contact->data = data)
HycoDefineMethod(HycoContactGetData, (HycoContact contact, void *data), contact, HYCO_CONTACT_CLASSID,
                 HycoCheckGiven(data);
                 *(void **)data = contact->data)

/* Values of a declared expression at n points, for types outside the library. */
PetscErrorCode HycoContactEvaluate(HycoContact contact, const char name[], const PetscReal mu[], PetscInt n,
                                   const PetscReal x[], PetscReal value[])
{
  const HycoEntry *entry;

  PetscFunctionBegin;
  HycoCheckHandle(contact, HYCO_CONTACT_CLASSID);
  HycoCheckGiven(name);
  entry = HycoDeclaredFind(&contact->entries, name);
  HycoCheck(entry && entry->expr, "contact %s has no expression %s", contact->name, name);
  PetscCall(HycoExprEval(entry->expr, mu, n, x, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A length of the scene's entry, or -1 if it is not given. A length is a number, which no parameter changes: it decides
   the pairing. */
PetscErrorCode HycoContactGetLength(HycoContact contact, const char name[], PetscReal *length)
{
  const HycoEntry *entry;

  PetscFunctionBegin;
  HycoCheckHandle(contact, HYCO_CONTACT_CLASSID);
  HycoCheckGiven(name);
  HycoCheckGiven(length);
  entry = HycoDeclaredFind(&contact->entries, name);
  *length = entry && entry->kind == HYCO_ENTRY_LENGTH ? entry->value : -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After the entries are read: checks the required ones and copies those that the library itself needs. */
PetscErrorCode HycoContactComplete(HycoContact contact)
{
  static const char *const groups[] = {"group", "slave", "master"}, *const normals[] = {"normal_x", "normal_y",
                                                                                        "normal_z"};
  HycoDeclared *d = &contact->entries;
  HycoEntry *e;

  PetscFunctionBegin;
  /* Borrowed from the object, whose name the scene sets before the entries are read. */
  contact->name = ((PetscObject)contact)->name;
  for (PetscInt j = 0; j < d->n; j++)
    HycoCheck(!d->entry[j].required || d->entry[j].expr || d->entry[j].text || d->entry[j].value >= 0,
              "contact %s, type %s, has no %s (%s)", contact->name, ((PetscObject)contact)->type_name, d->entry[j].name,
              d->entry[j].title);
  for (PetscInt k = 0; k < 3; k++) {
    if ((e = HycoDeclaredFind(d, groups[k])) && e->text) *(k < 2 ? &contact->slave : &contact->master) = e->text;
    if ((e = HycoDeclaredFind(d, normals[k]))) contact->normal[k] = e->expr;
  }
  if ((e = HycoDeclaredFind(d, "gap"))) contact->gap = e->expr;
  /* An entry of this name that the type declares itself is no coefficient of Coulomb's law. */
  if ((e = HycoDeclaredFind(d, "friction")) && e->law) contact->friction = e->expr;
  PetscCheck(contact->slave, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG,
             "the contact type %s declares neither group nor slave as required", ((PetscObject)contact)->type_name);
  PetscFunctionReturn(PETSC_SUCCESS);
}
