/* Values of a solution between the distributed vectors, a rank's part, its contacts' surfaces, and the rows of
   files. */
#include <hycofields.h>
#include <hycofomimpl.h>

/* value[n_dof] of this rank's part, ghosts included. Collective. */
PetscErrorCode HycoFOMToLocal(HycoFOM f, Vec v, PetscReal value[])
{
  Vec local;

  PetscFunctionBegin;
  /* The scatter writes into value[] itself. */
  PetscCall(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, f->fe->n_dof, value, &local));
  PetscCall(HycoScatter(f->to_local, v, local));
  PetscCall(VecDestroy(&local));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* value[] of fe_surface's unknowns; on one rank these are all. Collective. */
PetscErrorCode HycoFOMToSurface(HycoFOM f, Vec v, PetscReal value[])
{
  /* On one rank the surface has the mesh's unknowns. */
  Vec at = f->to_surface ? f->U_surface : v;

  PetscFunctionBegin;
  if (f->to_surface) {
    PetscCall(HycoScatter(f->to_surface, v, at));
  }
  PetscCall(HycoVecRead(at, f->fe_surface->n_dof, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The last solution as local arrays: u (parts), u_surface, lambda. U_local keeps the motions that are taken out of
   u, as forces are computed from the former. Collective. */
PetscErrorCode HycoFOMGather(HycoFOM f)
{
  PetscScalar *local;
  Vec shown = f->U;

  PetscFunctionBegin;
  PetscCall(HycoScatter(f->to_local, f->U, f->U_local));
  PetscCall(VecGetArray(f->U_local, &local));
  /* The vectors have the eliminated unknowns' offsets; arrays have displacements. */
  HycoFEComplete(f->fe, local);
  PetscCall(VecRestoreArray(f->U_local, &local));
  if (f->n_turned) {
    PetscCall(VecDuplicate(f->U, &shown));
    PetscCall(VecCopy(f->U, shown));
    PetscCall(HycoFOMTakeOutReleased(f, shown));
  }
  PetscCall(HycoFOMToLocal(f, shown, f->u));
  HycoFEComplete(f->fe, f->u);
  if (f->to_surface) PetscCall(HycoFOMToSurface(f, shown, f->u_surface));
  if (f->to_surface) HycoFEComplete(f->fe_surface, f->u_surface);
  if (f->n_turned) PetscCall(VecDestroy(&shown));
  if (!f->n_contacts) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoVecRead(f->Lambda, f->pairs.n, f->lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The number of each contact in the order of one rank, for all rows of B in the order of the ranks; on rank 0, the
   caller frees it. Collective. */
PetscErrorCode HycoFOMGetNumbers(HycoFOM f, PetscInt **number)
{
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoConcatenate(HycoComm(f), f->pairs.n, f->pairs.number, MPIU_INT, sizeof(PetscInt), &n, number));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0: Lambda in the order of one rank, borrowed; with one rank it is f->lambda. Collective. */
PetscErrorCode HycoFOMGetLambda(HycoFOM f, const PetscReal *lambda[])
{
  PetscInt n, *number;
  const PetscScalar *mine;
  PetscReal *all;

  PetscFunctionBegin;
  *lambda = f->lambda;
  if (f->size == 1 || !f->n_contacts) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoFOMGetNumbers(f, &number));
  PetscCall(VecGetArrayRead(f->Lambda, &mine));
  PetscCall(HycoConcatenate(HycoComm(f), f->pairs.n, mine, MPIU_REAL, sizeof(PetscReal), &n, &all));
  PetscCall(VecRestoreArrayRead(f->Lambda, &mine));
  if (f->rank == 0 && !f->lambda_all) PetscCall(PetscMalloc1(f->n_contacts, &f->lambda_all));
  /* n is 0 on the other ranks. */
  for (PetscInt k = 0; k < n; k++) f->lambda_all[number[k]] = all[k];
  HycoFreeAll(&number, &all);
  *lambda = f->lambda_all;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On rank 0, which has the forces of all. */
static PetscErrorCode CheckForces(const PetscReal Lambda[])
{
  PetscFunctionBegin;
  HycoCheckGiven(Lambda);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The reverse: lambda of rank 0 (order of one rank) to the rows of the ranks. Collective. */
PetscErrorCode HycoFOMSetLambda(HycoFOM f, const PetscReal lambda[])
{
  PetscInt *number = NULL;

  PetscFunctionBegin;
  if (!f->n_contacts) PetscFunctionReturn(PETSC_SUCCESS);
  HycoOnRoot(HycoComm(f), CheckForces(lambda));
  if (f->size > 1) PetscCall(HycoFOMGetNumbers(f, &number));
  /* Rank 0 has all values; assembly sends each to its row. */
  for (PetscInt k = 0; f->rank == 0 && k < f->n_contacts; k++)
    PetscCall(VecSetValue(f->Lambda, k, lambda[number ? number[k] : k], INSERT_VALUES));
  PetscCall(HycoVecAssemble(f->Lambda));
  PetscCall(PetscFree(number));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* In the order of one rank, written by all ranks. Collective. */
PetscErrorCode HycoFOMWriteForces(HycoFOM f, HycoH5 h, const char name[])
{
  const PetscScalar *lambda = NULL;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  if (f->n_contacts) PetscCall(VecGetArrayRead(f->Lambda, &lambda));
  ierr = HycoContactsWrite(HycoComm(f), h, name, &f->pairs, f->n_contacts, MPIU_REAL, lambda);
  if (f->n_contacts) PetscCall(VecRestoreArrayRead(f->Lambda, &lambda));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* NULL on one rank, where the part is the file's order. Created at the first call. Collective. */
PetscErrorCode HycoFOMGetRows(HycoFOM f, const HycoFileOrder **rows)
{
  PetscFunctionBegin;
  if (f->size > 1 && !f->rows) PetscCall(HycoFileOrderCreate(HycoComm(f), f->part, PETSC_FALSE, &f->rows));
  *rows = f->rows;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows of a file to the values of this rank's nodes or cells, ghosts included. Collective. */
PetscErrorCode HycoFOMFromRows(HycoFOM f, HycoPlace place, PetscInt components, const PetscReal rows[],
                               PetscReal value[])
{
  const PetscInt n = place == HYCO_ON_CELLS ? f->part->n_cells : f->part->n_nodes;
  const HycoFileOrder *order;

  PetscFunctionBegin;
  PetscCall(HycoFOMGetRows(f, &order));
  if (order)
    PetscCall(HycoFileOrderFetch(order, f->part, place, components, rows, value));
  else
    PetscCall(PetscArraycpy(value, rows, n * components));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Owned values to the rows of a file. Collective. */
PetscErrorCode HycoFOMToRows(HycoFOM f, HycoPlace place, MPI_Datatype type, PetscInt components, const void *value,
                             void *rows)
{
  const HycoFileOrder *order;
  const PetscInt n = place == HYCO_ON_CELLS ? f->part->n_cells : f->part->n_nodes;
  PetscMPIInt size;

  PetscFunctionBegin;
  PetscCall(HycoFOMGetRows(f, &order));
  if (order) {
    PetscCall(HycoFileOrderSend(order, place, type, components, value, rows));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCallMPI(MPI_Type_size(type, &size));
  /* One rank: the file's order is the mesh's. */
  PetscCall(PetscMemcpy(rows, value, (size_t)(n * components) * (size_t)size));
  PetscFunctionReturn(PETSC_SUCCESS);
}
