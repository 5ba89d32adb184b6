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
  PetscCall(PetscArraycpy(value, from, f->fe_surface->n_dof));
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
  if (f->to_surface) HycoFEComplete(f->fe_surface, f->u_surface);
  if (f->n_turned) PetscCall(VecDestroy(&shown));
  if (!f->n_contacts) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetArrayRead(f->Lambda, &v));
  PetscCall(PetscArraycpy(f->lambda, v, f->pairs.n));
  PetscCall(VecRestoreArrayRead(f->Lambda, &v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMGetNumbers(HycoFOM f, PetscInt **number)
{
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoConcatenate(HycoComm(f), f->pairs.n, f->pairs.number, MPIU_INT, sizeof(PetscInt), &n, number));
  PetscFunctionReturn(PETSC_SUCCESS);
}

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
  for (PetscInt k = 0; k < n; k++) f->lambda_all[number[k]] = all[k];
  HycoFreeAll(&number, &all);
  *lambda = f->lambda_all;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMSetLambda(HycoFOM f, const PetscReal lambda[])
{
  PetscInt *number = NULL;

  PetscFunctionBegin;
  if (!f->n_contacts) PetscFunctionReturn(PETSC_SUCCESS);
  if (f->size > 1) PetscCall(HycoFOMGetNumbers(f, &number));
  for (PetscInt k = 0; f->rank == 0 && k < f->n_contacts; k++)
    PetscCall(VecSetValue(f->Lambda, k, lambda[number ? number[k] : k], INSERT_VALUES));
  PetscCall(VecAssemblyBegin(f->Lambda));
  PetscCall(VecAssemblyEnd(f->Lambda));
  PetscCall(PetscFree(number));
  PetscFunctionReturn(PETSC_SUCCESS);
}

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

static PetscErrorCode MeasureContacts(HycoFOM f, HycoSummary *s)
{
  PetscReal sum[2] = {0, 0}, most[3] = {0, 0, 0};
  PetscInt n[2] = {0, 0};
  HycoContactState state;

  PetscFunctionBegin;
  HycoOnEach(HycoComm(f), HycoContactMeasure(f->fe_surface, &f->pairs, f->u_surface, f->lambda, NULL, &state));
  n[0] = state.n_facing;
  most[0] = state.overlap;
  most[1] = state.sliding;
  for (PetscInt k = 0; k < f->pairs.n; k++) {
    n[1] += f->lambda[k] > 0;
    sum[0] += f->lambda[k];
    most[2] = PetscMax(most[2], f->lambda[k]);
    sum[1] += f->lambda[k] * f->lambda[k];
  }
  HycoAllreduce(n, 2, MPIU_INT, MPI_SUM, HycoComm(f));
  HycoAllreduce(sum, 2, MPIU_REAL, MPI_SUM, HycoComm(f));
  HycoAllreduce(most, 3, MPIU_REAL, MPI_MAX, HycoComm(f));
  s->n_facing = n[0];
  s->n_active = n[1];
  s->overlap = most[0];
  s->sliding = most[1];
  s->lambda_max = most[2];
  s->total_contact_force = sum[0];
  s->lambda_norm2 = PetscSqrtReal(sum[1]);
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

/* Of all ranks. */
static PetscErrorCode SumResult(HycoFOM f, HycoContactResult *r)
{
  PetscReal sum[7];
  PetscInt n[2] = {r->n, r->n_active};

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(sum, r->force, 3));
  PetscCall(PetscArraycpy(sum + 3, r->moment, 3));
  sum[6] = r->area;
  HycoAllreduce(n, 2, MPIU_INT, MPI_SUM, HycoComm(f));
  HycoAllreduce(sum, 7, MPIU_REAL, MPI_SUM, HycoComm(f));
  HycoAllreduce(&r->pressure, 1, MPIU_REAL, MPI_MAX, HycoComm(f));
  PetscCall(PetscArraycpy(r->force, sum, 3));
  PetscCall(PetscArraycpy(r->moment, sum + 3, 3));
  r->area = sum[6];
  r->n = n[0];
  r->n_active = n[1];
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
  if (!ierr)
    HycoContactResults(f->fe_surface, &f->pairs, c.normal, c.area, f->lambda, c.pressure_of, 0, f->contact_result);
  PetscCall(HycoContactFieldsDestroy(&c));
  PetscCall(ierr);
  for (PetscInt k = 0; k < n; k++) PetscCall(SumResult(f, &f->contact_result[k]));
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
  why[0] = '\0';
  if (s->reason > 0 && !f->path && !f->given) PetscCall(HycoFOMNameLoose(f, why));
  PetscCall(PetscStrncpy(s->loose, why, sizeof(s->loose)));
  PetscCall(MeasureContacts(f, s));
  if (s->reason > 0 && f->n_contacts) PetscCall(HycoFOMCountDependent(f, &s->n_dependent));
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
  PetscCall(HycoFileOrderCreate(HycoComm(f), f->part, PETSC_TRUE, &all));
  PetscCall(HycoFileOrderSend(all, HYCO_ON_NODES, MPIU_REAL, f->fe->dim, f->u, f->u_all));
  PetscCall(HycoFileOrderSend(all, HYCO_ON_CELLS, MPIU_REAL, f->fe->n_sigma, f->sigma, f->sigma_all));
  PetscCall(HycoFileOrderDestroy(&all));
  f->all_ready = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMGetSolution(HycoFOM f, PetscInt *n_nodes, const PetscReal *U[], PetscInt *n_contacts,
                                  const PetscReal *Lambda[], PetscInt *n_cells, const PetscReal *sigma[])
{
  const PetscReal *lambda;

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  PetscCheck(f->solved, PETSC_COMM_SELF, PETSC_ERR_ORDER, "call HycoFOMSolve() before HycoFOMGetSolution()");
  PetscCall(BringTogether(f));
  if (n_nodes) *n_nodes = f->rank ? 0 : f->n_nodes;
  if (U) *U = f->size > 1 ? f->u_all : f->u;
  if (n_contacts) *n_contacts = f->rank ? 0 : f->n_contacts;
  PetscCall(HycoFOMGetLambda(f, &lambda));
  if (Lambda) *Lambda = f->rank ? NULL : lambda;
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
  if (f->size > 1 && !f->rows) PetscCall(HycoFileOrderCreate(HycoComm(f), f->part, PETSC_FALSE, &f->rows));
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
