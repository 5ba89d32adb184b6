/* The problem of the bodies' contacts for gradients: x the rigid motions, L the contact forces; w is the loads' work on the
   motions that contact does not do, with the opposite sign, and the gaps of the displacements under z. */
#include <hycobodies.h>

/* z NULL: the caller wants the sizes alone. */
PetscErrorCode HycoBodiesUnknowns(HycoROM m, PetscInt *p, PetscInt *n, PetscReal z[])
{
  HycoBodiesWork o = (HycoBodiesWork)m->work;

  PetscFunctionBegin;
  *p = o->bodies->p;
  *n = m->model->pairs.n;
  if (!z) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscArraycpy(z, o->x, *p));
  PetscCall(PetscArraycpy(z + *p, m->Lambda, *n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The gaps, and the largest term of one. */
static void Gaps(HycoROM m, PetscReal w[], PetscReal *size)
{
  HycoBodiesWork o = (HycoBodiesWork)m->work;

  *size = 0;
  for (PetscInt k = 0; k < m->model->pairs.n; k++) {
    PetscReal bu = 0;

    for (PetscInt j = o->row_start[k]; j < o->row_start[k + 1]; j++) bu += o->row[j] * o->u[o->row_at[j]];
    w[k] = m->rows.gap[k] - bu;
    /* An empty row has no gap: its slave has no master here. */
    if (o->row_start[k] < o->row_start[k + 1])
      *size = PetscMax(*size, PetscMax(PetscAbsReal(bu), PetscAbsReal(m->rows.gap[k])));
  }
}

/* Moves the model to mu and to the forces z, also where no solution is there: finite differences of w by mu. w
   NULL: only the state, for HycoROMOps.expand. */
PetscErrorCode HycoBodiesResidual(HycoROM m, const PetscReal mu[], const PetscReal z[], PetscReal w[], PetscReal *size)
{
  HycoBodiesWork o = (HycoBodiesWork)m->work;
  const HycoSubstructures b = o->bodies;
  const HycoBodiesSurface s = HycoBodiesSurfaceOf(m);

  PetscFunctionBegin;
  if (mu) PetscCall(HycoROMBringRows(m, mu));
  if (mu) PetscCall(HycoBodiesPrepare(o, &s, mu));
  PetscCall(PetscArraycpy(o->x, z, b->p));
  PetscCall(PetscArraycpy(m->Lambda, z + b->p, m->model->pairs.n));
  /* Displacements follow from forces and motions without a solve, because the flexibility is explicit. */
  HycoBodiesGiven(o, &s, m->Lambda);
  if (!w) PetscFunctionReturn(PETSC_SUCCESS);
  /* First the motions, then the contacts: the order of the unknowns z. */
  for (PetscInt i = 0; i < b->p; i++) {
    w[i] = 0;
    for (PetscInt j = 0; j < b->r; j++) w[i] -= o->work[i * b->r + j] * o->c[j];
    for (PetscInt k = 0; k < b->ns; k++) w[i] += o->Z[k * b->p + i] * o->f[k];
  }
  Gaps(m, w + b->p, size);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At the parameters of the last HycoBodiesResidual(), and only for the k contacts of the active set. */
PetscErrorCode HycoBodiesJacobian(HycoROM m, PetscInt k, const PetscInt contact[], PetscReal M[])
{
  PetscFunctionBegin;
  PetscCall(HycoBodiesMatrix((HycoBodiesWork)m->work, k, contact, M));
  PetscFunctionReturn(PETSC_SUCCESS);
}
