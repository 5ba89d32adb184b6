/* Registries of types by name, the library's and a program's: materials, contacts, forms of the solver, models. */
#ifndef HYCOREGISTRY_H
#define HYCOREGISTRY_H

#include <hycoimpl.h>

typedef void HycoVoidFn(void); /* any function, cast back when called */

/* A static variable with its first member set; filled by src/package and by programs, emptied by PetscFinalize(). */
typedef struct _n_HycoRegistry HycoRegistry;
struct _n_HycoRegistry {
  PetscBool sorted; /* names in alphabetical order; else in the order of registration */
  /* state */
  PetscBool begun;
  PetscInt n;
  char **name; /* n entries, then NULL */
  PetscFunctionList create;
  HycoRegistry *next; /* list of all registries in use */
};

/* Adds a type, or replaces one of the same name. The options of a program's type are then listed too: an earlier
   result of HycoGetOptionTable() is invalid. Not collective. */
PetscErrorCode HycoRegistryAdd(HycoRegistry *registry, const char name[], HycoVoidFn *create);
/* Defines XRegister() of a class: function(name, create). */
#define HycoDefineRegister(function, registry, creator)                                                                \
  PetscErrorCode function(const char name[], creator)                                                                  \
  {                                                                                                                    \
    PetscFunctionBegin;                                                                                                \
    PetscCall(HycoRegistryAdd(&registry, name, (HycoVoidFn *)create));                                                 \
    PetscFunctionReturn(PETSC_SUCCESS);                                                                                \
  }
/* The function that creates a type, in *create: NULL if there is no type of this name. Not collective. */
#define HycoRegistryFind(registry, name, create) HycoRegistryFind_Private(registry, name, (HycoVoidFn **)(create))
PetscErrorCode HycoRegistryFind_Private(HycoRegistry *registry, const char name[], HycoVoidFn **create);
/* All names; NULL ends. Borrowed, until another type is added; each name until PetscFinalize(). Not collective. */
PetscErrorCode HycoRegistryNames(HycoRegistry *registry, PetscInt *n, const char *const **names);
/* "obstacle, pair or surface; did you mean pair?", for a name that is not registered. Not collective. */
PetscErrorCode HycoRegistryList(HycoRegistry *registry, const char name[], char list[HYCO_LINE]);

#endif
