/* The last solution of a full-order model: its values, their summary, and access to them. */
#include <hycofields.h>
#include <hycoquantities.h>
#include <hycopath.h>

/* Measures of contact over all ranks. Collective. */
static PetscErrorCode MeasureContacts(HycoFOM f, HycoSummary *s)
{
  PetscReal sum[2] = {0, 0}, most[3] = {0, 0, 0};
  PetscInt n[2] = {0, 0};
  HycoContactFacts state;

  PetscFunctionBegin;
  /* Reads normals and gaps at the present parameters. */
  HycoOnEach(HycoComm(f), HycoContactMeasure(f->fe_surface, &f->pairs, f->u_surface, f->lambda, NULL, NULL, &state));
  n[0] = state.n_facing;
  most[0] = state.overlap;
  most[1] = state.sliding;
  for (PetscInt k = 0; k < f->pairs.n; k++) {
    /* Exact zeros: the solver sets open contacts to 0. */
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

/* Collective. */
static PetscErrorCode NameInitialOverlap(HycoFOM f, HycoSummary *s)
{
  PetscReal *normal, *gap, *share;

  PetscFunctionBegin;
  s->buried[0] = '\0';
  /* Without an overlap no contact is buried; the same on every rank. */
  if (!(s->overlap > 0)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc3(3 * f->pairs.n, &normal, f->pairs.n, &gap, f->scene->n_contacts, &share));
  HycoOnEach(HycoComm(f), HycoContactGeometry(f->fe_surface, &f->pairs, normal, gap));
  PetscCall(HycoContactInitialOverlap(HycoComm(f), f->fe, f->fe_surface, &f->pairs, gap, share));
  for (PetscInt c = 0; c < f->scene->n_contacts; c++) {
    char one[HYCO_LINE];

    if (!(share[c] > 0)) continue;
    HycoFormat(one, "%s%s (by %.2g %%)", s->buried[0] ? ", " : "", f->scene->contact[c]->name, 100 * (double)share[c]);
    PetscCall(PetscStrlcat(s->buried, one, sizeof(s->buried)));
  }
  PetscCall(PetscFree3(normal, gap, share));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sum of squares over owned nodes, extremes over all. */
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
    /* Not -0. */
    s->u_min[c] = ends[3 + c] == 0 ? 0 : -ends[3 + c];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of all ranks. Pressures are extremes, everything else sums. */
static PetscErrorCode SumResult(HycoFOM f, HycoContactResult *r)
{
  PetscReal sum[11];
  PetscInt n[2] = {r->n, r->n_active};

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(sum, r->force, 3));
  PetscCall(PetscArraycpy(sum + 3, r->moment, 3));
  sum[6] = r->area;
  PetscCall(PetscArraycpy(sum + 7, r->friction, 3));
  sum[10] = r->friction_work;
  HycoAllreduce(n, 2, MPIU_INT, MPI_SUM, HycoComm(f));
  HycoAllreduce(sum, 11, MPIU_REAL, MPI_SUM, HycoComm(f));
  HycoAllreduce(&r->pressure, 1, MPIU_REAL, MPI_MAX, HycoComm(f));
  HycoAllreduce(&r->pressure_min, 1, MPIU_REAL, MPI_MIN, HycoComm(f));
  PetscCall(PetscArraycpy(r->force, sum, 3));
  PetscCall(PetscArraycpy(r->moment, sum + 3, 3));
  r->area = sum[6];
  PetscCall(PetscArraycpy(r->friction, sum + 7, 3));
  r->friction_work = sum[10];
  r->n = n[0];
  /* The minimum over no contact is the neutral element. */
  if (!r->n) r->pressure_min = 0;
  r->n_active = n[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective. Results of contacts and their parts in f->contact_result. */
static PetscErrorCode SumContacts(HycoFOM f)
{
  const PetscInt n = HycoSceneResults(f->scene);
  HycoContactFields c;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  if (!f->contact_result) PetscCall(PetscMalloc1(n, &f->contact_result));
  ierr = HycoContactFieldsCreate(HycoComm(f), f->fe_surface, &f->pairs, f->u_surface, f->lambda, &c);
  if (!ierr)
    ierr =
        HycoContactResults(f->fe_surface, &f->pairs, c.normal, c.area, f->lambda, c.pressure_of, 0, f->contact_result);
  PetscCall(HycoContactFieldsDestroy(&c));
  PetscCall(ierr);
  /* Forces add up over ranks, pressures take the largest and the smallest. */
  for (PetscInt k = 0; k < n; k++) PetscCall(SumResult(f, &f->contact_result[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Values of the scene's outputs at the last solution; stresses, contacts and reactions only if an output needs them.
   Collective. */
PetscErrorCode HycoFOMMeasureQuantities(HycoFOM f, PetscReal value[])
{
  PetscReal *reaction = NULL;

  PetscFunctionBegin;
  if (!f->scene->n_quantities) PetscFunctionReturn(PETSC_SUCCESS);
  /* Reactions need none. */
  if (HycoSceneHasOutputs(f->scene, HYCO_QUANTITY_MAX, HYCO_QUANTITY_MEAN)) PetscCall(HycoFOMStress(f));
  if (HycoSceneHasContactOutputs(f->scene)) PetscCall(SumContacts(f));
  /* A product with K on all unknowns: only where an output asks for it. */
  if (HycoSceneHasReactions(f->scene)) {
    PetscCall(PetscMalloc1(f->fe->n_dof, &reaction));
    PetscCall(HycoFOMReactions(f, reaction));
  }
  PetscCall(HycoQuantitiesMeasure(HycoComm(f), f->fe, NULL, f->u, f->sigma, reaction, f->contact_result, value));
  PetscCall(PetscFree(reaction));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The sums over the steps of a path. */
static void SumPath(HycoFOM f, HycoSummary *s)
{
  const HycoPath p = f->path;

  s->iterations = 0;
  s->seconds.factor = s->seconds.solve = 0;
  for (PetscInt k = 0; k < p->n_steps; k++) {
    s->iterations += p->steps[k].iterations;
    s->seconds.factor += p->steps[k].seconds_factor;
    s->seconds.solve += p->steps[k].seconds_solve;
  }
  s->kkt = p->kkt;
  /* Each step was judged when it was accepted. */
  s->reason = p->ended ? HYCO_CONVERGED : HYCO_DIVERGED_STEP;
  s->strain_energy = p->work_done.stored;
  s->external_work = p->work_done.loads + p->work_done.supports;
  s->gap_work = p->work_done.contact;
  s->energy_defect = p->work_done.defect;
}

/* Judges the last solution and measures it; *out is rank 0's, because sums may differ in the last bits. Collective. */
PetscErrorCode HycoFOMGetSummary(HycoFOM f, HycoSummary *out)
{
  HycoSummary *s;
  PetscReal defect, cpu = HycoCPU();
  char why[HYCO_LINE];

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  HycoCheckGiven(out);
  s = &f->summary;
  s->dim = f->fe->dim;
  s->n_dof = f->n_free;
  s->n_contacts = f->n_contacts;
  /* A path without a listed time has no more than this. */
  if (!f->solved && f->path && f->path->why[0]) {
    *out = (HycoSummary){.dim = s->dim, .n_dof = s->n_dof, .n_contacts = s->n_contacts, .seconds = s->seconds};
    out->reason = HYCO_DIVERGED_STEP;
    PetscCall(PetscStrncpy(out->why, f->path->why, sizeof(out->why)));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCheck(f->solved, PETSC_COMM_SELF, PETSC_ERR_ORDER, "call HycoFOMSolve() before HycoFOMGetSummary()");
  /* given: forces were prescribed, and another solver was used. */
  PetscCall(HycoSolverGetIterations(f->given ? f->given_solver : f->solver, &s->iterations));
  PetscCall(HycoSolverGetKKT(f->solver, &s->kkt));
  PetscCall(HycoSolverGetReason(f->given ? f->given_solver : f->solver, &s->reason));
  if (f->given) s->kkt = f->given_kkt;
  if (f->path)
    SumPath(f, s);
  else
    PetscCall(HycoFOMEnergy(f, s));
  PetscCall(MeasureDisplacements(f, s));
  /* forces of another solution do not satisfy the identity, and rounding of U changes it as it does the residual */
  defect = f->path || f->given || s->energy_defect <= s->kkt.rounding ? 0 : s->energy_defect;
  PetscCall(HycoFOMJudge(f, f->u, f->n_contacts ? f->Lambda : NULL, defect, &s->reason, &s->u_relative, why));
  if (!f->path) HycoSolverExplain(f->given ? f->given_solver : f->solver, why);
  PetscCall(PetscStrncpy(s->why, why, sizeof(s->why)));
  PetscCall(MeasureContacts(f, s));
  why[0] = '\0';
  if (f->path && f->path->loose[0]) HycoPathNameTimes(f->path->loose, f->path->loose_at, why);
  /* Of a path at its end, if nothing presses: friction may hold what normal forces do not. */
  if (s->reason > 0 && !f->given && !why[0] && (!f->path || !s->n_active)) PetscCall(HycoFOMNameFreeMotion(f, why));
  PetscCall(PetscStrncpy(s->loose, why, sizeof(s->loose)));
  PetscCall(NameInitialOverlap(f, s));
  for (PetscInt k = 0; f->path && k < f->path->n_steps; k++)
    s->sliding = PetscMax(s->sliding, f->path->steps[k].sliding); /* contacts may be open at the end */
  s->n_dependent = 0;
  if (s->reason > 0 && f->n_contacts && !f->path) PetscCall(HycoFOMCountDependent(f, &s->n_dependent));
  for (PetscInt k = 0; f->path && k < f->path->n_steps; k++)
    s->n_dependent = PetscMax(s->n_dependent, f->path->steps[k].n_dependent);
  PetscCall(HycoFOMMeasureQuantities(f, s->quantity));
  s->seconds.cpu = f->cpu + HycoCPU() - cpu;
  HycoAllreduce(&s->seconds.cpu, 1, MPIU_REAL, MPI_SUM, HycoComm(f));
  PetscCallMPI(MPI_Bcast(s, sizeof(*s), MPI_BYTE, 0, HycoComm(f)));
  *out = *s;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Borrowed until the next solve. Collective. */
PetscErrorCode HycoFOMGetContacts(HycoFOM f, PetscInt *n, const HycoContactResult *result[])
{
  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  HycoCheckGiven(n);
  HycoCheckGiven(result);
  PetscCheck(f->solved, PETSC_COMM_SELF, PETSC_ERR_ORDER, "call HycoFOMSolve() before HycoFOMGetContacts()");
  PetscCall(SumContacts(f));
  *n = f->scene->n_contacts;
  *result = f->contact_result;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Volume means by cell of this rank, once per solution. Not collective. */
PetscErrorCode HycoFOMStress(HycoFOM f)
{
  const PetscScalar *u;

  PetscFunctionBegin;
  if (f->sigma_ready) PetscFunctionReturn(PETSC_SUCCESS);
  if (!f->sigma) PetscCall(PetscMalloc1(f->part->n_cells * f->fe->n_sigma, &f->sigma));
  PetscCall(VecGetArrayRead(f->U_local, &u));
  /* Stresses of a path are those of the laws' state. */
  if (f->path && !f->path->beside)
    PetscCall(HycoFEStateFields(f->fe, f->path->begin, f->sigma, NULL, NULL, NULL));
  else
    PetscCall(HycoFEStress(f->fe, u, f->sigma));
  PetscCall(VecRestoreArrayRead(f->U_local, &u));
  f->sigma_ready = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gathers the whole solution on rank 0. Rows in the file's order, the same on any number of ranks; the only place
   where a solution is gathered. */
static PetscErrorCode BringTogether(HycoFOM f)
{
  HycoFileOrder *all;

  PetscFunctionBegin;
  PetscCall(HycoFOMStress(f));
  if (f->size == 1 || f->all_ready) PetscFunctionReturn(PETSC_SUCCESS);
  if (f->rank == 0 && !f->u_all) PetscCall(PetscMalloc1(f->n_nodes * f->fe->dim, &f->u_all));
  if (f->rank == 0 && !f->sigma_all) PetscCall(PetscMalloc1(f->n_cells * f->fe->n_sigma, &f->sigma_all));
  /* All rows on rank 0 (PETSC_TRUE), not a block per rank. */
  PetscCall(HycoFileOrderCreate(HycoComm(f), f->part, PETSC_TRUE, &all));
  PetscCall(HycoFileOrderSend(all, HYCO_ON_NODES, MPIU_REAL, f->fe->dim, f->u, f->u_all));
  PetscCall(HycoFileOrderSend(all, HYCO_ON_CELLS, MPIU_REAL, f->fe->n_sigma, f->sigma, f->sigma_all));
  PetscCall(HycoFileOrderDestroy(&all));
  f->all_ready = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Borrowed until the next solve; rank 0 alone has arrays. Collective. */
PetscErrorCode HycoFOMGetSolution(HycoFOM f, PetscInt *n_nodes, const PetscReal *U[], PetscInt *n_contacts,
                                  const PetscReal *Lambda[], PetscInt *n_cells, const PetscReal *sigma[])
{
  const PetscReal *lambda;

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  PetscCheck(f->solved, PETSC_COMM_SELF, PETSC_ERR_ORDER, "call HycoFOMSolve() before HycoFOMGetSolution()");
  PetscCall(BringTogether(f));
  if (n_nodes) *n_nodes = f->rank ? 0 : f->n_nodes;
  /* On one rank the solution itself, without a copy. */
  if (U) *U = f->size > 1 ? f->u_all : f->u;
  if (n_contacts) *n_contacts = f->rank ? 0 : f->n_contacts;
  PetscCall(HycoFOMGetLambda(f, &lambda));
  if (Lambda) *Lambda = f->rank ? NULL : lambda;
  if (n_cells) *n_cells = f->rank ? 0 : f->n_cells;
  if (sigma) *sigma = f->size > 1 ? f->sigma_all : f->sigma;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* F - B^T L at local unknowns, 0 where fixed: the forces that the displacements balance. Collective. */
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

/* The last solution in the form for output. Collective. */
static PetscErrorCode SolutionFields(HycoFOM f, HycoSolution *solution)
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

/* One file per solution. Collective. */
PetscErrorCode HycoFOMWrite(HycoFOM f, const char path[])
{
  HycoSolution solution;

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  HycoCheckGiven(path);
  PetscCheck(f->solved, PETSC_COMM_SELF, PETSC_ERR_ORDER, "call HycoFOMSolve() before HycoFOMWrite()");
  PetscCall(SolutionFields(f, &solution));
  PetscCall(HycoSolutionWrite(path, &solution));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A file of n solutions (a batch); HycoFOMWriteAdd() adds the last one, HycoFOMWriteEnd() puts it in place.
   Collective. */
PetscErrorCode HycoFOMWriteBegin(HycoFOM f, const char path[], PetscInt n)
{
  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  HycoCheckGiven(path);
  HycoCheck(!f->path, "HycoFOMWriteBegin: the scene has a history; HycoFOMSetSeries() writes its path");
  PetscCheck(!f->set, PETSC_COMM_SELF, PETSC_ERR_ORDER,
             "call HycoFOMWriteEnd() of the last file before HycoFOMWriteBegin() of %s", path);
  PetscCall(HycoFieldFileCreate(HycoComm(f), path, n, PETSC_TRUE, &f->set));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective; may be called once for each solve of the batch. */
PetscErrorCode HycoFOMWriteAdd(HycoFOM f)
{
  HycoSolution solution;

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  PetscCheck(f->solved && f->set, PETSC_COMM_SELF, PETSC_ERR_ORDER,
             "call HycoFOMWriteBegin() and HycoFOMSolve() before HycoFOMWriteAdd()");
  PetscCall(SolutionFields(f, &solution));
  PetscCall(HycoSolutionAdd(f->set, &solution));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The set is destroyed also if the file cannot be put in place. */
PetscErrorCode HycoFOMWriteEnd(HycoFOM f)
{
  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  PetscCheck(f->set, PETSC_COMM_SELF, PETSC_ERR_ORDER, "call HycoFOMWriteBegin() before HycoFOMWriteEnd()");
  HycoFinally(HycoFieldFileCommit(f->set), PetscCall(HycoFieldFileDestroy(&f->set)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
