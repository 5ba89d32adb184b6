/* The last solution of a full-order model: its values, their summary, and access to them. */
#include <hycofields.h>
#include <hycoquantities.h>
#include <hycopath.h>

PetscErrorCode HycoFOMToLocal(HycoFOM f, Vec v, PetscReal value[])
{
  Vec local;

  PetscFunctionBegin;
  PetscCall(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, f->fe->n_dof, value, &local));
  PetscCall(VecScatterBegin(f->to_local, v, local, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(f->to_local, v, local, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecDestroy(&local));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMToSurface(HycoFOM f, Vec v, PetscReal value[])
{
  const PetscScalar *from;
  Vec at = f->to_surface ? f->U_surface : v;

  PetscFunctionBegin;
  if (f->to_surface) {
    PetscCall(VecScatterBegin(f->to_surface, v, at, INSERT_VALUES, SCATTER_FORWARD));
    PetscCall(VecScatterEnd(f->to_surface, v, at, INSERT_VALUES, SCATTER_FORWARD));
  }
  PetscCall(VecGetArrayRead(at, &from));
  if (f->rank == 0) PetscCall(PetscArraycpy(value, from, f->fe_surface->n_dof));
  PetscCall(VecRestoreArrayRead(at, &from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMGather(HycoFOM f)
{
  const PetscScalar *v;
  PetscScalar *local;
  Vec shown = f->U;

  PetscFunctionBegin;
  PetscCall(VecScatterBegin(f->to_local, f->U, f->U_local, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(f->to_local, f->U, f->U_local, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetArray(f->U_local, &local));
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
  if (f->to_surface && f->rank == 0) HycoFEComplete(f->fe_surface, f->u_surface);
  if (f->n_turned) PetscCall(VecDestroy(&shown));
  if (!f->n_contacts) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecScatterBegin(f->lambda_to_root, f->Lambda, f->lambda_root, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(f->lambda_to_root, f->Lambda, f->lambda_root, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetArrayRead(f->lambda_root, &v));
  if (f->rank == 0) PetscCall(PetscArraycpy(f->lambda, v, f->n_contacts));
  PetscCall(VecRestoreArrayRead(f->lambda_root, &v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On rank 0. */
static PetscErrorCode MeasureContacts(HycoFOM f, HycoSummary *s)
{
  HycoContactState state;

  PetscFunctionBegin;
  PetscCall(HycoContactMeasure(f->fe_surface, &f->pairs, f->u_surface, f->lambda, NULL, &state));
  s->n_facing = state.n_facing;
  s->overlap = state.overlap;
  s->sliding = state.sliding;
  s->n_active = 0;
  s->total_contact_force = s->lambda_max = s->lambda_norm2 = 0;
  for (PetscInt k = 0; k < f->n_contacts; k++) {
    s->n_active += f->lambda[k] > 0;
    s->total_contact_force += f->lambda[k];
    s->lambda_max = PetscMax(s->lambda_max, f->lambda[k]);
    s->lambda_norm2 += f->lambda[k] * f->lambda[k];
  }
  s->lambda_norm2 = PetscSqrtReal(s->lambda_norm2);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MeasureDisplacements(HycoFOM f, HycoSummary *s)
{
  const PetscInt dim = f->fe->dim;
  PetscReal ends[6], sum = 0; /* the largest, and the negated smallest */

  PetscFunctionBegin;
  for (PetscInt c = 0; c < 6; c++) ends[c] = PETSC_MIN_REAL;
  for (PetscInt k = 0; k < f->fe->n_dof; k++) {
    if (HycoMeshOwned(f->part, k / dim) < 0) continue;
    sum += f->u[k] * f->u[k];
    ends[k % dim] = PetscMax(ends[k % dim], f->u[k]);
    ends[3 + k % dim] = PetscMax(ends[3 + k % dim], -f->u[k]);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, ends, 6, MPIU_REAL, MPI_MAX, HycoComm(f)));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPIU_REAL, MPI_SUM, HycoComm(f)));
  s->u_norm2 = PetscSqrtReal(sum);
  for (PetscInt c = 0; c < dim; c++) {
    s->u_max[c] = ends[c];
    s->u_min[c] = ends[3 + c] == 0 ? 0 : -ends[3 + c];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective. */
static PetscErrorCode SumContacts(HycoFOM f)
{
  const PetscInt n = f->scene->n_contacts;
  HycoContactFields c;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  if (!f->contact_result) PetscCall(PetscMalloc1(n, &f->contact_result));
  ierr = HycoContactFieldsCreate(HycoComm(f), f->fe_surface, &f->pairs, f->u_surface, f->lambda, &c);
  if (!ierr && f->rank == 0)
    HycoContactResults(f->fe_surface, &f->pairs, c.normal, c.area, f->lambda, 0, f->contact_result);
  PetscCall(HycoContactFieldsDestroy(&c));
  PetscCall(ierr);
  PetscCallMPI(
      MPI_Bcast(f->contact_result, (PetscMPIInt)((size_t)n * sizeof(*f->contact_result)), MPI_BYTE, 0, HycoComm(f)));
  for (PetscInt k = 0; k < n; k++) f->contact_result[k].name = f->scene->contact[k]->name;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMMeasureQuantities(HycoFOM f, PetscReal value[])
{
  PetscReal *reaction = NULL;

  PetscFunctionBegin;
  if (!f->scene->n_quantities) PetscFunctionReturn(PETSC_SUCCESS);
  if (HycoSceneAsksFields(f->scene)) PetscCall(HycoFOMStress(f));
  if (HycoSceneAsksContacts(f->scene)) PetscCall(SumContacts(f));
  if (HycoSceneHasReactions(f->scene)) {
    PetscCall(PetscMalloc1(f->fe->n_dof, &reaction));
    PetscCall(HycoFOMReactions(f, reaction));
  }
  PetscCall(HycoQuantitiesMeasure(HycoComm(f), f->fe, f->u, f->sigma, reaction, f->contact_result, value));
  PetscCall(PetscFree(reaction));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMGetSummary(HycoFOM f, HycoSummary *out)
{
  HycoSummary *s;
  PetscReal defect;
  char why[HYCO_LINE];

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  s = &f->summary;
  PetscCheck(f->solved, PETSC_COMM_SELF, PETSC_ERR_ORDER, "call HycoFOMSolve() before HycoFOMGetSummary()");
  s->dim = f->fe->dim;
  s->n_dof = f->n_free;
  s->n_contacts = f->n_contacts;
  PetscCall(HycoSolverGetIterations(f->given ? f->given_solver : f->solver, &s->iterations));
  PetscCall(HycoSolverGetKKT(f->solver, &s->kkt));
  PetscCall(HycoSolverGetReason(f->given ? f->given_solver : f->solver, &s->reason));
  if (f->given) s->kkt = f->given_kkt;
  if (f->path)
    HycoPathSummary(f, s);
  else
    PetscCall(HycoFOMEnergy(f, s));
  PetscCall(MeasureDisplacements(f, s));
  /* forces of another solution do not satisfy the identity, and rounding of U changes it as it does the residual */
  defect = f->path || f->given || s->energy_defect <= s->kkt.rounding ? 0 : s->energy_defect;
  PetscCall(HycoFOMJudge(f, f->u, f->n_contacts ? f->Lambda : NULL, defect, &s->reason, &s->u_relative, why));
  PetscCall(PetscStrncpy(s->why, why, sizeof(s->why)));
  HycoOnRoot(HycoComm(f), MeasureContacts(f, s));
  if (s->reason > 0 && f->n_contacts) HycoOnRoot(HycoComm(f), HycoFOMCountDependent(f, &s->n_dependent));
  PetscCall(HycoFOMMeasureQuantities(f, s->quantity));
  PetscCallMPI(MPI_Bcast(s, sizeof(*s), MPI_BYTE, 0, HycoComm(f)));
  *out = *s;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMGetContacts(HycoFOM f, PetscInt *n, const HycoContactResult *result[])
{
  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  PetscCheck(f->solved, PETSC_COMM_SELF, PETSC_ERR_ORDER, "call HycoFOMSolve() before HycoFOMGetContacts()");
  PetscCall(SumContacts(f));
  *n = f->scene->n_contacts;
  *result = f->contact_result;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMStress(HycoFOM f)
{
  const PetscScalar *u;

  PetscFunctionBegin;
  if (f->sigma_ready) PetscFunctionReturn(PETSC_SUCCESS);
  if (!f->sigma) PetscCall(PetscMalloc1(f->part->n_cells * f->fe->n_sigma, &f->sigma));
  PetscCall(VecGetArrayRead(f->U_local, &u));
  if (f->path)
    PetscCall(HycoFEStateFields(f->fe, f->path->begin, f->sigma, NULL, NULL, NULL));
  else
    PetscCall(HycoFEStress(f->fe, u, f->sigma));
  PetscCall(VecRestoreArrayRead(f->U_local, &u));
  f->sigma_ready = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gathers the whole solution on rank 0. */
static PetscErrorCode BringTogether(HycoFOM f)
{
  HycoFileOrder *all;

  PetscFunctionBegin;
  PetscCall(HycoFOMStress(f));
  if (f->size == 1 || f->all_ready) PetscFunctionReturn(PETSC_SUCCESS);
  if (f->rank == 0 && !f->u_all) PetscCall(PetscMalloc1(f->n_nodes * f->fe->dim, &f->u_all));
  if (f->rank == 0 && !f->sigma_all) PetscCall(PetscMalloc1(f->n_cells * f->fe->n_sigma, &f->sigma_all));
  PetscCall(HycoFileOrderCreate(HycoComm(f), f->part, f->surface, PETSC_TRUE, &all));
  PetscCall(HycoFileOrderSend(all, HYCO_ON_NODES, MPIU_REAL, f->fe->dim, f->u, f->u_all));
  PetscCall(HycoFileOrderSend(all, HYCO_ON_CELLS, MPIU_REAL, f->fe->n_sigma, f->sigma, f->sigma_all));
  PetscCall(HycoFileOrderDestroy(&all));
  f->all_ready = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMGetSolution(HycoFOM f, PetscInt *n_nodes, const PetscReal *U[], PetscInt *n_contacts,
                                  const PetscReal *Lambda[], PetscInt *n_cells, const PetscReal *sigma[])
{
  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  PetscCheck(f->solved, PETSC_COMM_SELF, PETSC_ERR_ORDER, "call HycoFOMSolve() before HycoFOMGetSolution()");
  PetscCall(BringTogether(f));
  if (n_nodes) *n_nodes = f->rank ? 0 : f->n_nodes;
  if (U) *U = f->size > 1 ? f->u_all : f->u;
  if (n_contacts) *n_contacts = f->rank ? 0 : f->n_contacts;
  if (Lambda) *Lambda = f->lambda;
  if (n_cells) *n_cells = f->rank ? 0 : f->n_cells;
  if (sigma) *sigma = f->size > 1 ? f->sigma_all : f->sigma;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMGetForces(HycoFOM f, PetscReal forces[])
{
  Vec work;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(f->F, &work));
  if (f->n_contacts) {
    PetscCall(MatMult(f->Bt, f->Lambda, work));
    PetscCall(VecAYPX(work, -1, f->F));
  } else
    PetscCall(VecCopy(f->F, work));
  PetscCall(HycoFOMToLocal(f, work, forces));
  for (PetscInt k = 0; k < f->fe->n_dof; k++) forces[k] = f->fe->fixed[k] ? 0 : forces[k];
  PetscCall(VecDestroy(&work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMGetRows(HycoFOM f, const HycoFileOrder **rows)
{
  PetscFunctionBegin;
  if (f->size > 1 && !f->rows) PetscCall(HycoFileOrderCreate(HycoComm(f), f->part, f->surface, PETSC_FALSE, &f->rows));
  *rows = f->rows;
  PetscFunctionReturn(PETSC_SUCCESS);
}

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
  PetscCall(PetscMemcpy(rows, value, (size_t)(n * components) * (size_t)size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The last solution in the form for output. Collective. */
static PetscErrorCode Look(HycoFOM f, HycoSolution *solution)
{
  PetscFunctionBegin;
  *solution = (HycoSolution){.fe = f->fe,
                             .surface = f->fe_surface,
                             .pairs = &f->pairs,
                             .u = f->u,
                             .u_surface = f->u_surface,
                             .lambda = f->lambda};
  PetscCall(HycoFOMGetRows(f, &solution->order));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMWrite(HycoFOM f, const char path[])
{
  HycoSolution solution;

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  PetscCheck(f->solved, PETSC_COMM_SELF, PETSC_ERR_ORDER, "call HycoFOMSolve() before HycoFOMWrite()");
  PetscCall(Look(f, &solution));
  PetscCall(HycoSolutionWrite(path, &solution));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMWriteBegin(HycoFOM f, const char path[], PetscInt n)
{
  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  HycoCheck(!f->path, "HycoFOMWriteBegin: the scene has a history; HycoFOMSetSeries() writes its path");
  PetscCall(HycoFieldFileDestroy(&f->set));
  PetscCall(HycoFieldFileCreate(HycoComm(f), path, n, PETSC_TRUE, &f->set));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMWriteAdd(HycoFOM f)
{
  HycoSolution solution;

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  PetscCheck(f->solved && f->set, PETSC_COMM_SELF, PETSC_ERR_ORDER,
             "call HycoFOMWriteBegin() and HycoFOMSolve() before HycoFOMWriteAdd()");
  PetscCall(Look(f, &solution));
  PetscCall(HycoSolutionAdd(f->set, &solution));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMWriteEnd(HycoFOM f)
{
  PetscErrorCode ierr;

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  PetscCheck(f->set, PETSC_COMM_SELF, PETSC_ERR_ORDER, "call HycoFOMWriteBegin() before HycoFOMWriteEnd()");
  ierr = HycoFieldFileCommit(f->set);
  PetscCall(HycoFieldFileDestroy(&f->set));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
