/*
  The path of a hybrid or projection-based model: the time stepping and Newton's method of full order (src/fom) on the
  reduced unknowns. The laws are integrated only at the integration points of the RID's cells; an iteration is one
  contact system

    V[A]^T K_t[A,A+I] V[A+I] x' + V[A_c]^T B^T L = V[A]^T (F - f_int) + V[A]^T K_t V x

  with K_t = d f_int / d U, the true derivative, so that the convergence is quadratic. The reduced problem has no
  potential: steps are accepted by their residual. Each path starts with no contact closed, whatever was solved before.
*/
#include <hycoalgorithms.h>
#include <hycogalerkin.h>
#include <hycopath.h>

struct _n_HycoGalerkinPath {
  HycoPath path;
  HycoNewton method;      /* of predictions */
  HycoLinearForce linear; /* of the linear bodies, on A */
  PetscReal *held, *u;    /* fe's unknowns: prescribed displacements at the last accepted time; displacements of an
                             iteration */
  PetscBool moved;        /* the attempt's prescribed displacements are in U */
};

/* K and Kr. The first one is assembled again as in later assemblies, so that the sums have the same bits. Called when
   the path needs a new linear part. */
static PetscErrorCode GalerkinPathStiffness(HycoPath p)
{
  HycoROM m = (HycoROM)p->ctx;
  HycoGalerkin g = (HycoGalerkin)m->work;

  PetscFunctionBegin;
  PetscCall(HycoFEAssembleStiffness(m->fe, g->K));
  if (!g->reduced) PetscCall(HycoFEAssembleStiffness(m->fe, g->K));
  HycoLogged(HYCO_EVENT_REDUCE, HycoReducedFillStiffness(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The loads only, without the effect of moved supports. */
static PetscErrorCode GalerkinPathLoads(HycoPath p)
{
  HycoROM m = (HycoROM)p->ctx;
  HycoGalerkin g = (HycoGalerkin)m->work;
  const PetscBool lifted = m->fe->lifted;

  PetscFunctionBegin;
  /* HycoFEAssembleForce() would subtract K u0; here f_int contains the whole displacement. */
  m->fe->lifted = PETSC_FALSE;
  HycoLogged(HYCO_EVENT_FORCE, HycoFEAssembleForce(m->fe, g->F));
  m->fe->lifted = lifted;
  HycoLogged(HYCO_EVENT_REDUCE, HycoReducedFillVectors(m));
  PetscCall(VecCopy(g->Fr, p->F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Brings the reduced system to the parameters of a time. What did not change is kept: the linear cells' stiffness, the
   rows of B, the loads. Until all is current, fe->ready is false, so that an error leaves no half-assembled system in
   use. */
static PetscErrorCode GalerkinPathAssemble(HycoPath p, const PetscReal mu[], PetscBool elastic)
{
  HycoROM m = (HycoROM)p->ctx;
  HycoGalerkin g = (HycoGalerkin)m->work;
  HycoFE fe = m->fe;

  PetscFunctionBegin;
  PetscCall(HycoFESetParameters(fe, mu));
  PetscCall(HycoGalerkinCreateSets(m));
  fe->ready = PETSC_FALSE; /* until everything that depends on it is assembled */
  g->path->moved = PETSC_FALSE;
  m->beyond_current = PETSC_FALSE;
  /* Later stiffnesses are tangents, which Newton's method assembles with the laws' states. */
  if (fe->stiffness_changed && (elastic || !p->n_taken))
    PetscCall(GalerkinPathStiffness(p)); /* the first is the elastic one */
  PetscCall(HycoLinearForceSet(g->path->linear, fe->stiffness_changed));
  /* B is filled on demand: a step that only changes gaps keeps it. */
  if (fe->contact_changed) g->current_B = PETSC_FALSE;
  /* With friction at each step: gaps of tangents are the slave's last places. */
  if (fe->contact_changed || fe->gap_changed || g->friction) HycoLogged(HYCO_EVENT_CONTACT, HycoGalerkinOwnRows(m));
  if (m->n_L && fe->contact_changed) HycoLogged(HYCO_EVENT_REDUCE, HycoReducedFillContact(m));
  PetscCall(GalerkinPathLoads(p));
  fe->ready = PETSC_TRUE;
  if (!g->system->K) PetscCall(HycoSystemSetMatrices(g->system, g->Kr, g->Btr, g->Br, g->model->symmetric));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* U of the iteration in path->u: the supports have their values of the last accepted time until the first contact
   system of the step has moved them. */
static PetscErrorCode GalerkinPathDisplace(HycoROM m)
{
  HycoGalerkinPath q = ((HycoGalerkin)m->work)->path;

  PetscFunctionBegin;
  PetscCall(HycoGalerkinExpand(m));
  PetscCall(PetscArraycpy(q->u, m->U, m->fe->n_dof));
  /* At the first iteration of a step the internal forces must be those of the accepted state; the supports' motion
     enters as a load. */
  for (PetscInt k = 0; k < m->fe->n_dof && !q->moved; k++) {
    if (HycoFESupports(m->fe, k)) q->u[k] = q->held[k];
  }
  /* Tied and oblique nodes follow the values that have just been put back. */
  if (!q->moved) HycoFEComplete(m->fe, q->u);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Residual and, on request, consistent tangent of a time step: the laws of the cells that flow, plus the linear cells'
   forces by their constant matrix, tested with the modes. */
static PetscErrorCode GalerkinPathStep(HycoPath p, PetscReal t0, PetscReal t1, PetscBool tangent,
                                       HycoFEStepReport *report)
{
  HycoROM m = (HycoROM)p->ctx;
  HycoGalerkinPath q = ((HycoGalerkin)m->work)->path;

  PetscFunctionBegin;
  PetscCall(GalerkinPathDisplace(m));
  PetscCall(PetscArrayzero(p->f_local, m->fe->n_dof));
  PetscCall(HycoFEStepBodies(m->fe, HYCO_BODIES_FLOWING, q->u, t0, t1, p->begin, p->end, p->f_local, tangent, report));
  /* A sum over some cells with test functions of the modes is no gradient of an energy: no line search on it. */
  report->has_potential = PETSC_FALSE;
  if (report->failed) PetscFunctionReturn(PETSC_SUCCESS);
  HycoLinearForceAdd(q->linear, q->u, p->f_local);
  /* Before the test: forces at tied nodes belong to their masters, which may be in A. */
  HycoFEPassTied(m->fe, p->f_local);
  PetscCall(HycoReducedTest(m, p->f_local, p->f_int));
  PetscCall(VecWAXPY(p->r, -1, p->f_int, p->F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the effect of supports that move in this step to the right-hand side. The loads alone are subtracted, because
   HycoPathMoves() adds to them. */
static PetscErrorCode GalerkinPathMoveSupports(HycoPath p, Vec rhs)
{
  HycoROM m = (HycoROM)p->ctx;
  HycoGalerkin g = (HycoGalerkin)m->work;
  const PetscScalar *F;
  PetscBool moved;

  PetscFunctionBegin;
  PetscCall(HycoPathMoves(p, g->path->u, g->F, &moved));
  g->path->moved = PETSC_TRUE;
  if (!moved) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetArrayRead(g->F, &F));
  PetscCall(HycoReducedTest(m, F, p->work));
  PetscCall(VecRestoreArrayRead(g->F, &F));
  PetscCall(VecAXPY(rhs, 1, p->work));
  /* What remains is the part of the supports alone. */
  PetscCall(VecAXPY(rhs, -1, p->F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After an accepted step: the prescribed displacements become the held ones, and the displacements enter the trace from
   which states are replayed. */
static PetscErrorCode GalerkinPathAccept(HycoPath p, const HycoStepAttempt *a)
{
  HycoROM m = (HycoROM)p->ctx;
  HycoGalerkin g = (HycoGalerkin)m->work;

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(g->path->held, m->fe->u0, m->fe->n_dof));
  if (g->friction)
    PetscCall(HycoGalerkinUnpack(m));
  else
    PetscCall(HycoGalerkinExpand(m));
  PetscCall(HycoTraceAdd(m, p->t));
  if (g->friction) PetscCall(HycoGalerkinFrictionAccept(m, p->t));
  p->now.stored = a->law.stored;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ops->accept has expanded them. */
static PetscErrorCode GalerkinPathSurfaces(HycoPath p, PetscReal u[], PetscReal *most)
{
  HycoROM m = (HycoROM)p->ctx;

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(u, m->U, m->fe->n_dof));
  *most = 0;
  for (PetscInt i = 0; i < m->fe->n_dof; i++) *most = PetscMax(*most, PetscAbsReal(u[i]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Completes the state at the accepted time, and its energy, for the linear bodies. */
static PetscErrorCode CompleteState(HycoROM m, HycoPath p)
{
  PetscReal stored;

  PetscFunctionBegin;
  PetscCall(HycoFELinearStress(m->fe, m->U, p->begin, &stored));
  p->now.stored += stored;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Called before listed time k: if its tangent is monitored, it must be the current one. */
static void GalerkinPathRefreshTangent(HycoROM m, PetscInt k)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const PetscBool watched = (PetscBool)(g->watch.stride && k % g->watch.stride == 0);

  g->path->path->method = watched ? HYCO_NEWTON_TANGENT : g->path->method;
}

/* Monitors the last tangent: whether the path comes close to a singular one. */
static PetscErrorCode GalerkinPathMonitorTangent(HycoROM m, PetscInt k)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  Mat dense;
  PetscScalar *a;
  PetscInt sign;

  PetscFunctionBegin;
  GalerkinPathRefreshTangent(m, k + 1);
  /* Not at each time: an SVD per listed time would double the cost of a training path. */
  if (!g->watch.stride || k % g->watch.stride) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatConvert(g->Kr, MATSEQDENSE, MAT_INITIAL_MATRIX, &dense));
  PetscCall(MatDenseGetArray(dense, &a));
  PetscCall(HycoSingularity(m->n, a, &sign, &g->watch.ratio[k]));
  PetscCall(MatDenseRestoreArray(dense, &a));
  PetscCall(MatDestroy(&dense));
  g->watch.sign[k] = sign;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A listed time: completes what the getters return there and stores it, since the next step overwrites it. */
static PetscErrorCode GalerkinPathRecord(HycoPath p)
{
  HycoROM m = (HycoROM)p->ctx;
  HycoGalerkin g = (HycoGalerkin)m->work;

  PetscFunctionBegin;
  PetscCall(GalerkinPathMonitorTangent(m, p->n_steps));
  PetscCall(HycoGalerkinUnpack(m));
  if (g->friction) PetscCall(HycoGalerkinFrictionShow(m));
  PetscCall(HycoGalerkinCheckContactBasis(m));
  PetscCall(CompleteState(m, p));
  /* After the state is complete: (41) reads the whole displacement at the contacts. With friction it was done when
     the step was accepted. */
  if (m->ops->reconstruct && m->reconstruct && !g->friction)
    HycoLogged(HYCO_EVENT_RECONSTRUCT, (*m->ops->reconstruct)(m));
  if (!g->friction) PetscCall(HycoFloatingBalance(m));
  PetscCall(HycoTraceRecord(m, PETSC_FALSE, p->begin, &p->now));
  p->steps[p->n_steps++] = p->now;
  PetscCall(PetscMemzero(&p->now, sizeof(p->now)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The constant matrix of the cells without history. Only rows of A are tested, but the forces of tied nodes are passed
   to their masters afterwards, so those rows are needed too. */
static PetscErrorCode CreateLinear(HycoROM m)
{
  HycoMesh mesh = m->fe->mesh;
  PetscInt *sets;
  PetscBool *inside;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(m->model->mesh->n_nodes, &inside, m->model->mesh->n_nodes, &sets));
  PetscCall(HycoROMGetDomain(m, sets));
  /* 2 is A: rows of the interface are never tested. */
  for (PetscInt i = 0; i < mesh->n_nodes; i++) inside[i] = (PetscBool)(sets[i] == 2);
  for (PetscInt k = 0; k < mesh->n_tied; k++)
    inside[mesh->tied[k]] = PETSC_TRUE; /* whose forces are added to the
                                           masters */
  PetscCall(HycoLinearForceCreate(m->fe, inside, &((HycoGalerkin)m->work)->path->linear));
  PetscCall(PetscFree2(inside, sets));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The path borrows matrices and vectors of the Galerkin work, and only adds the history's own state. */
PetscErrorCode HycoGalerkinPathCreate(HycoROM m)
{
  static const HycoPathOps ops = {.assemble = GalerkinPathAssemble,
                                  .step = GalerkinPathStep,
                                  .stiffness = GalerkinPathStiffness,
                                  .moves = GalerkinPathMoveSupports,
                                  .accept = GalerkinPathAccept,
                                  .surfaces = GalerkinPathSurfaces,
                                  .record = GalerkinPathRecord};
  HycoGalerkin g = (HycoGalerkin)m->work;
  HycoPath p;

  PetscFunctionBegin;
  PetscCall(PetscNew(&g->path));
  PetscCall(HycoPathNew(PETSC_COMM_SELF, m->model->scene, &p));
  g->path->path = p;
  PetscCall(HycoTraceOptions(m, p));
  if (p->method == HYCO_NEWTON_AUTO) p->method = HYCO_NEWTON_MODIFIED; /* a tangent costs more than the laws */
  g->path->method = (HycoNewton)p->method;
  p->ops = &ops;
  p->ctx = m;
  p->fe = m->fe;
  p->contact.system = g->system;
  p->contact.solver = m->solver;
  p->K = g->Kr;
  p->contact.B = g->Br;
  p->contact.Bt = g->Btr;
  p->U = g->x;
  p->contact.Lambda = g->L;
  p->rhs = g->Fr;
  p->contact.D = g->Dr;
  p->n_contacts = m->n_L;
  p->n_free = m->n;
  if (g->friction) PetscCall(HycoPathSetContacts(p, &g->own_pairs, NULL));
  g->state = p->friction;
  PetscCall(HycoPathSetUp(p));
  /* Newton's next iteration corrects what a refinement would. */
  PetscCall(HycoSolverSetRefine(m->solver, PETSC_FALSE));
  PetscCall(PetscMalloc2(m->fe->n_dof, &g->path->held, m->fe->n_dof, &g->path->u));
  PetscCall(CreateLinear(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoGalerkinPathDestroy(HycoGalerkinPath *path)
{
  PetscFunctionBegin;
  if (!*path) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoPathFree(&(*path)->path));
  PetscCall(PetscFree2((*path)->held, (*path)->u));
  PetscCall(HycoLinearForceDestroy(&(*path)->linear));
  PetscCall(PetscFree(*path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* held = 0: at the path's begin no support has moved. The trace then holds all listed times; m shows the last one. */
PetscErrorCode HycoGalerkinPathSolve(HycoROM m, const PetscReal mu[])
{
  HycoGalerkinPath q = ((HycoGalerkin)m->work)->path;
  const char *method;

  PetscFunctionBegin;
  GalerkinPathRefreshTangent(m, 0);
  PetscCall(PetscArrayzero(q->held, m->fe->n_dof));
  if (((HycoGalerkin)m->work)->friction) PetscCall(HycoGalerkinFrictionBegin(m));
  PetscCall(HycoTraceFollow(m, q->path, mu));
  PetscCall(HycoSolverGetMethod(m->solver, &method));
  PetscCall(PetscStrncpy(m->prediction.method, method, sizeof(m->prediction.method)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
