/* A few contacts near a prediction, for its derivatives: moved on an fe of their own, they leave the prediction's rows,
   and what is kept with these, in place. */
#include <hycoromimpl.h>

static PetscErrorCode DropContacts(HycoNear *near)
{
  PetscFunctionBegin;
  PetscCall(HycoPairsDestroy(&near->pairs));
  PetscCall(HycoRowsDestroy(&near->rows));
  PetscCall(HycoCarriedDestroy(&near->carried));
  PetscCall(PetscFree(near->Lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoNearDestroy(HycoNear *near)
{
  PetscFunctionBegin;
  PetscCall(DropContacts(near));
  PetscCall(HycoFEDestroy(&near->fe));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define EXCHANGE(type, a, b)                                                                                           \
  do {                                                                                                                 \
    type kept = a;                                                                                                     \
                                                                                                                       \
    a = b;                                                                                                             \
    b = kept;                                                                                                          \
  } while (0)

void HycoROMExchange(HycoROM m, PetscInt side)
{
  HycoNear *near = &m->near[side];

  EXCHANGE(HycoFE, m->fe, near->fe);
  EXCHANGE(HycoPairs, m->pairs, near->pairs);
  EXCHANGE(HycoRows, m->rows, near->rows);
  EXCHANGE(HycoCarried, m->carried, near->carried);
  EXCHANGE(PetscReal *, m->Lambda, near->Lambda);
}

/* The fe stays from gradient to gradient, where it was; contacts are those of each. */
PetscErrorCode HycoROMMakeNear(HycoROM m, PetscInt n, const PetscInt contact[])
{
  PetscFunctionBegin;
  for (PetscInt side = 0; side < 2; side++) {
    HycoNear *near = &m->near[side];

    PetscCall(DropContacts(near));
    if (!near->fe) {
      PetscCall(HycoFECreate(m->model->scene, m->model->mesh->dm, &near->fe));
      PetscCall(HycoFEUseSurfaces(near->fe));
    }
    PetscCall(HycoPairsSelect(&m->pairs, n, contact, NULL, &near->pairs));
    PetscCall(PetscMalloc1(n + 1, &near->Lambda));
    for (PetscInt k = 0; k < n; k++) near->Lambda[k] = m->Lambda[contact[k]];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
