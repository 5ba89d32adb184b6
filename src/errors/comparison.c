/* Comparison by rows of the whole mesh, for held-out points in training and for the command. */
#include <hycocomparison.h>

/* Rows are dealt out in the file's order, in equal shares, independent of the partition: so each rank reads one
   contiguous part of the modes. m: on rank 0; NULL on the others, whose star forests have no leaves. */
PetscErrorCode HycoComparisonCreate(HycoFOM f, HycoROM m, HycoComparison *c)
{
  const PetscInt all[HYCO_COMPARED] = {f->n_nodes, f->n_cells, f->n_cells}, dim = f->part->dim;
  PetscInt head[2] = {m ? m->model->l : 0, m ? m->model->n_fe : 0};

  PetscFunctionBegin;
  PetscCall(PetscMemzero(c, sizeof(*c)));
  c->f = f;
  c->width[0] = dim;
  c->width[1] = f->fe->n_sigma;
  c->width[2] = 1;
  c->n_fields = f->scene->n_times ? HYCO_COMPARED : HYCO_COMPARED - 1;
  for (PetscInt k = 0; k < c->n_fields; k++) {
    const PetscInt n_rid = !m ? 0 : k ? m->model->mesh->n_cells : m->model->mesh->n_nodes;
    PetscLayout layout;

    PetscCall(PetscLayoutCreateFromSizes(HycoComm(f), PETSC_DECIDE, all[k], 1, &layout));
    PetscCall(PetscLayoutGetRange(layout, &c->first[k], &c->n[k]));
    c->n[k] -= c->first[k];
    PetscCall(PetscMalloc2(c->n[k] * c->width[k], &c->value[k], n_rid * c->width[k], &c->rid[k]));
    PetscCall(PetscSFCreate(HycoComm(f), &c->sf[k]));
    PetscCall(PetscSFSetGraphLayout(c->sf[k], layout, n_rid, NULL, PETSC_COPY_VALUES,
                                    !m  ? NULL
                                    : k ? m->model->mesh->cell_whole
                                        : m->model->mesh->node_whole));
    PetscCall(PetscLayoutDestroy(&layout));
  }
  /* l modes and n_fe unknowns of the RID that are taken as computed, with hybrid models. */
  PetscCallMPI(MPI_Bcast(head, 2, MPIU_INT, 0, HycoComm(f)));
  c->l = head[0];
  c->n_fe = head[1];
  PetscCall(PetscMalloc1(c->n_fe, &c->fe_dof));
  for (PetscInt k = 0; m && k < c->n_fe; k++)
    c->fe_dof[k] = m->model->mesh->node_whole[m->model->fe_dof[k] / dim] * dim + m->model->fe_dof[k] % dim;
  HycoBcast(c->fe_dof, c->n_fe, MPIU_INT, HycoComm(f));
  PetscCall(PetscMalloc2(c->l + c->n_fe, &c->coefficient, c->n[0] * dim, &c->U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The model and the full-order model are borrowed. */
PetscErrorCode HycoComparisonDestroy(HycoComparison *c)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < c->n_fields; k++) {
    PetscCall(PetscFree2(c->value[k], c->rid[k]));
    PetscCall(PetscSFDestroy(&c->sf[k]));
  }
  PetscCall(PetscFree(c->fe_dof));
  PetscCall(PetscFree2(c->coefficient, c->U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From the ranks' rows to the RID on rank 0. */
PetscErrorCode HycoComparisonBring(HycoComparison *c)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < c->n_fields; k++)
    PetscCall(HycoSFBcast(c->sf[k], MPIU_REAL, c->width[k], c->value[k], c->rid[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Completes displacements by supports along a direction and ties, on the ranks' parts. */
static PetscErrorCode ComparisonComplete(HycoComparison *c)
{
  HycoFE fe = c->f->fe;
  PetscReal *u;
  PetscInt any = fe->n_oblique + fe->mesh->n_tied;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &any, 1, MPIU_INT, MPI_MAX, HycoComm(c->f)));
  /* All ranks agree: FromRows and ToRows are collective. */
  if (!any) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(fe->n_dof, &u));
  PetscCall(HycoFOMFromRows(c->f, HYCO_ON_NODES, fe->dim, c->U, u));
  HycoFEComplete(fe, u);
  PetscCall(HycoFOMToRows(c->f, HYCO_ON_NODES, MPIU_REAL, fe->dim, u, c->U));
  PetscCall(PetscFree(u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* U = r(u0) + V gamma (30), with the full-order values. of: the rank that has the model. lda: rows of V on this rank,
   which may be more than those of the comparison. Displacements of the whole mesh are formed by rows, without ever
   being on one rank. */
PetscErrorCode HycoComparisonPredict(HycoComparison *c, HycoROM m, PetscMPIInt of, const PetscReal V[], PetscInt lda)
{
  const PetscInt n = c->n[0] * c->width[0], first = c->first[0] * c->width[0];
  PetscMPIInt count;

  PetscFunctionBegin;
  if (c->f->rank == of) {
    PetscCall(PetscArraycpy(c->coefficient, m->gamma, c->l));
    /* Appended, so that one broadcast sends both. */
    for (PetscInt k = 0; k < c->n_fe; k++) c->coefficient[c->l + k] = m->U[m->model->fe_dof[k]];
  }
  PetscCall(PetscMPIIntCast(c->l + c->n_fe, &count));
  PetscCallMPI(MPI_Bcast(c->coefficient, count, MPIU_REAL, of, HycoComm(c->f)));
  PetscCall(HycoFOMToRows(c->f, HYCO_ON_NODES, MPIU_REAL, c->width[0], c->f->fe->u0, c->U));
  for (PetscInt j = 0; j < c->l; j++) {
    for (PetscInt i = 0; i < n; i++) c->U[i] += V[(size_t)j * (size_t)lda + (size_t)i] * c->coefficient[j];
  }
  for (PetscInt k = 0; k < c->n_fe; k++) {
    if (c->fe_dof[k] >= first && c->fe_dof[k] < first + n) c->U[c->fe_dof[k] - first] = c->coefficient[c->l + k];
  }
  PetscCall(ComparisonComplete(c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* square: |U - u|^2 and |u|^2 over the whole mesh, on all ranks. */
PetscErrorCode HycoComparisonSquares(const HycoComparison *c, PetscReal square[2])
{
  PetscFunctionBegin;
  square[0] = square[1] = 0;
  for (PetscInt i = 0; i < c->n[0] * c->width[0]; i++) {
    square[0] += (c->U[i] - c->value[0][i]) * (c->U[i] - c->value[0][i]);
    square[1] += c->value[0][i] * c->value[0][i];
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, square, 2, MPIU_REAL, MPI_SUM, HycoComm(c->f)));
  /* Against a solution of 0 the size of the mesh tells round-off. */
  if (square[1] == 0 && square[0] <= PetscSqr(HYCO_NOTHING * HycoMeshLength(c->f->part)) * (PetscReal)c->f->n_nodes)
    square[0] = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}
