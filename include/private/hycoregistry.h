/* Types that the library has and a program adds, by name: of materials, contacts, forms of the solver, models. */
#ifndef HYCOREGISTRY_H
#define HYCOREGISTRY_H

#include <hycoimpl.h>

typedef void HycoVoidFn(void); /* any function, to be cast back */

/* Made as a static variable with its first two members; emptied by PetscFinalize(). */
typedef struct _n_HycoRegistry HycoRegistry;
struct _n_HycoRegistry {
  PetscErrorCode (*add_own)(void); /* adds the library's, with the first use */
  PetscBool sorted;                /* names in the alphabet's order; else in that of registration */
  /* state */
  PetscBool begun, adding_own;
  PetscInt n;
  char **name; /* n, and NULL */
  HycoVoidFn **create;
  HycoRegistry *next; /* of all that have begun */
};

/* Adds a type, or replaces that of the same name. Options of a program's type are then listed too: what
   HycoGetOptionTable() gave is no more. Not collective. */
#define HycoRegistryAdd(registry, name, create) HycoRegistryAdd_Private(registry, name, (HycoVoidFn *)(create))
PetscErrorCode HycoRegistryAdd_Private(HycoRegistry *registry, const char name[], HycoVoidFn *create);
/* The function that makes a type, in *create: NULL where there is none of this name. Not collective. */
#define HycoRegistryFind(registry, name, create) HycoRegistryFind_Private(registry, name, (HycoVoidFn **)(create))
PetscErrorCode HycoRegistryFind_Private(HycoRegistry *registry, const char name[], HycoVoidFn **create);
/* All names; NULL ends. Borrowed, until another is added; each name until PetscFinalize(). Not collective. */
PetscErrorCode HycoRegistryNames(HycoRegistry *registry, PetscInt *n, const char *const **names);
/* "obstacle, pair or surface; did you mean pair?", for a name that is not registered. Not collective. */
PetscErrorCode HycoRegistryList(HycoRegistry *registry, const char name[], char list[HYCO_LINE]);

#endif
