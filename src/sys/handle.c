/*
  The handles that live. A copy of one that was destroyed, or one that was never made, is looked up here and refused by
  name: nothing is read where it points. Open addressing with linear probing (Knuth, The Art of Computer Programming
  3, 6.4, algorithm R removes); plain malloc, so that PETSc's books of memory hold only what the user made.
*/
#include <hycoimpl.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
  const void *handle; /* NULL: free */
  const char *maker;
} Slot;

static Slot *table;
static size_t room, n_live; /* room: a power of two, at least twice n_live */

static size_t Home(const void *handle)
{
  return (size_t)(((uint64_t)(uintptr_t)handle * 0x9E3779B97F4A7C15ULL) >> 32) & (room - 1);
}

/* Where the handle stands, or where it would. */
static size_t Find(const void *handle)
{
  size_t at = Home(handle);

  while (table[at].handle && table[at].handle != handle) at = (at + 1) & (room - 1);
  return at;
}

static PetscErrorCode Grow(void)
{
  Slot *old = table;
  const size_t had = room;

  PetscFunctionBegin;
  table = calloc(had ? 2 * had : 16, sizeof(*table));
  if (!table) table = old;
  PetscCheck(table != old, PETSC_COMM_SELF, PETSC_ERR_MEM, "no memory for another handle");
  room = had ? 2 * had : 16;
  for (size_t k = 0; k < had; k++) {
    if (old[k].handle) table[Find(old[k].handle)] = old[k];
  }
  free(old);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoHandleOpen(const void *handle, const char maker[])
{
  const Slot slot = {handle, maker};

  PetscFunctionBegin;
  if (2 * (n_live + 1) > room) PetscCall(Grow());
  table[Find(handle)] = slot;
  n_live++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

void HycoHandleClose(const void *handle)
{
  size_t hole = n_live ? Find(handle) : 0;

  if (!n_live || !table[hole].handle) return;
  for (size_t at = (hole + 1) & (room - 1); table[at].handle; at = (at + 1) & (room - 1)) {
    const size_t home = Home(table[at].handle);

    if (((at - home) & (room - 1)) < ((at - hole) & (room - 1))) continue; /* its home lies behind the hole */
    table[hole] = table[at];
    hole = at;
  }
  table[hole].handle = NULL;
  if (--n_live) return;
  free(table);
  table = NULL;
  room = 0;
}

PetscErrorCode HycoHandleCheck(const void *handle, const char maker[], const char function[])
{
  const Slot *slot;

  PetscFunctionBegin;
  PetscCheck(handle, PETSC_COMM_SELF, PETSC_ERR_ARG_NULL, "%s: the handle is NULL; make it by %s first", function,
             maker);
  slot = n_live ? &table[Find(handle)] : NULL;
  PetscCheck(slot && slot->handle && strcmp(slot->maker, maker) == 0, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG,
             "%s: the handle was destroyed, or never made; make it by %s first", function, maker);
  PetscFunctionReturn(PETSC_SUCCESS);
}
