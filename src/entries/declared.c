/* Entries that laws and contact types declare, and their values from the scene. */
#include <hycosceneimpl.h>
#include <petscviewer.h>
#include <string.h>

/* value -1: a length that was not given. *entry stays valid, since the array does not grow. */
PetscErrorCode HycoDeclaredAdd(HycoDeclared *d, const char name[], const char title[], HycoEntryKind kind,
                               PetscBool required, HycoEntry **entry)
{
  HycoEntry *e = &d->entry[d->n];

  PetscFunctionBegin;
  HycoCheckGiven(name);
  HycoCheckGiven(title);
  PetscCheck(d->n < HYCO_MAX_DECLARED, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE, "%s: a type has at most %d entries",
             name, HYCO_MAX_DECLARED);
  PetscCheck(!HycoDeclaredFind(d, name), PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG,
             "the entry %s is declared twice by its type", name);
  PetscCall(PetscStrallocpy(name, &e->name));
  PetscCall(PetscStrallocpy(title, &e->title));
  e->kind = kind;
  e->required = required;
  e->value = -1;
  d->n++;
  *entry = e;
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoEntry *HycoDeclaredFind(HycoDeclared *d, const char name[])
{
  for (PetscInt j = 0; j < d->n; j++) {
    if (strcasecmp(d->entry[j].name, name) == 0) return &d->entry[j];
  }
  return NULL;
}

/* A length is a number without parameters: the search for masters depends on it. */
PetscErrorCode HycoDeclaredRead(HycoScene s, const char key[], const char text[], HycoEntry *e)
{
  char *end;

  PetscFunctionBegin;
  switch (e->kind) {
  case HYCO_ENTRY_EXPRESSION:
    PetscCall(HycoExprDestroy(&e->expr)); /* the same entry in other letter case */
    PetscCall(HycoSceneExpression(s, key, text, &e->expr));
    if (!e->heat) PetscCall(HycoExprRefuseHeat(e->expr));
    break;
  case HYCO_ENTRY_GROUP:
    PetscCall(PetscFree(e->text));
    PetscCall(PetscStrallocpy(text, &e->text));
    break;
  case HYCO_ENTRY_LENGTH:
    e->value = HycoNumber(text, &end);
    HycoCheck(*end == '\0' && end != text && e->value >= 0, "%s is \"%s\"; it must be a length, 0 or more", key, text);
    break;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* except: the entry of that name is left out, and with it those of the law; NULL: none is. */
PetscBool HycoDeclaredChanges(const HycoDeclared *d, const char except[], const PetscBool changed[])
{
  for (PetscInt j = 0; j < d->n; j++) {
    if (except && (d->entry[j].law || !strcmp(d->entry[j].name, except))) continue;
    if (HycoExprChanges(d->entry[j].expr, changed)) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

PetscErrorCode HycoDeclaredView(const HycoDeclared *d, PetscViewer viewer)
{
  PetscFunctionBegin;
  for (PetscInt j = 0; j < d->n; j++)
    PetscCall(PetscViewerASCIIPrintf(viewer, "%s: %s%s\n", d->entry[j].name, d->entry[j].title,
                                     d->entry[j].required ? " (required)" : ""));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Also of declarations that no entry has filled. */
PetscErrorCode HycoDeclaredDestroy(HycoDeclared *d)
{
  PetscFunctionBegin;
  for (PetscInt j = 0; j < d->n; j++) {
    HycoFreeAll(&d->entry[j].name, &d->entry[j].title, &d->entry[j].text);
    PetscCall(HycoExprDestroy(&d->entry[j].expr));
  }
  d->n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}
