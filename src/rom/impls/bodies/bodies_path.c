/* The model of bodies on paths: set-up, the ops of the path, training and report. A step in time is in bodies_newton.c. */
#include "bodies_path.h"
#include <petscviewer.h>

/* -- ops of the path -- */

/* Displacements of the surfaces and the cells, and the residuals, recomputed from them. */
static void Settle(HycoROM m, const PetscReal Lambda[], HycoStepAttempt *a)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const HycoBodiesSurface s = HycoBodiesSurfaceOf(m);

  PetscCallVoid(PetscArraycpy(m->Lambda, Lambda, m->model->pairs.n));
  HycoBodiesGiven(&w->bodies, &s, Lambda);
  HycoBodiesMove(&w->bodies, &s, m->U);
  for (PetscInt i = 0; i < w->bodies.bodies->inelastic->nd; i++) m->U[w->at[i]] = w->u[w->at[i]];
  HycoBodiesMeasure(m, &w->path->kkt);
  w->path->kkt.stationarity = a->residual;
  a->converged = (PetscBool)(HycoKKTMax(&w->path->kkt) <= 1e-8);
  if (!a->converged) HycoFormat(a->why, "the residual of the contacts is %.1e", (double)HycoKKTMax(&w->path->kkt));
}

/* alpha and the forces of the last accepted time. */
static PetscErrorCode Retry(HycoPath p, PetscReal alpha[], PetscReal Lambda[])
{
  const PetscScalar *old;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(p->U_old, &old));
  PetscCall(PetscArraycpy(alpha, old, p->n_free));
  PetscCall(VecRestoreArrayRead(p->U_old, &old));
  PetscCall(VecGetArrayRead(p->L_old, &old));
  PetscCall(PetscArraycpy(Lambda, old, p->n_contacts));
  PetscCall(VecRestoreArrayRead(p->L_old, &old));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Iterate(HycoPath p, PetscReal t0, PetscReal t1, HycoStepAttempt *a)
{
  HycoROM m = (HycoROM)p->ctx;
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  PetscScalar *alpha, *L;

  PetscFunctionBegin;
  PetscCall(VecGetArray(p->U, &alpha));
  PetscCall(VecGetArray(p->Lambda, &L));
  w->always = (PetscBool)(p->method == HYCO_NEWTON_TANGENT);
  PetscCall(HycoBodiesSearch(m, t0, t1, alpha, L, a));
  if (a->why[0] && !w->always) { /* again from the begin of the step */
    PetscCall(Retry(p, alpha, L));
    a->why[0] = '\0';
    a->iterations = 0;
    w->always = PETSC_TRUE;
    PetscCall(HycoBodiesSearch(m, t0, t1, alpha, L, a));
  }
  if (!a->why[0]) Settle(m, L, a);
  PetscCall(VecRestoreArray(p->U, &alpha));
  PetscCall(VecRestoreArray(p->Lambda, &L));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Elastic stiffness and forces of heat of the cells, with elastic tangents. */
static PetscErrorCode PrepareCells(HycoROM m, PetscBool stiffness)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscInt n = m->model->mesh->nv * m->model->mesh->dim;

  PetscFunctionBegin;
  PetscCall(HycoFEElasticTangent(m->fe));
  for (PetscInt e = 0; e < m->model->mesh->n_cells; e++) {
    if (stiffness) PetscCall(HycoFEBodyStiffness(m->fe, e, w->Ke + e * n * n));
    PetscCall(HycoInelasticCellHeat(m->fe, e, w->heat + e * n));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Assemble(HycoPath p, const PetscReal mu[], PetscBool elastic)
{
  HycoROM m = (HycoROM)p->ctx;
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const HycoBodiesSurface s = HycoBodiesSurfaceOf(m);
  PetscBool stiffness, rows;

  PetscFunctionBegin;
  (void)elastic;
  PetscCall(HycoROMBringRows(m, mu));
  stiffness = m->fe->stiffness_changed;
  rows = m->fe->contact_changed;
  PetscCall(PrepareCells(m, stiffness));
  PetscCall(HycoBodiesPrepare(&w->bodies, &s, mu));
  if (!stiffness && !rows) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoBodiesForget(m));
  w->fresh = PETSC_TRUE;
  HycoBodiesScale(m);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Accept(HycoPath p, const HycoStepAttempt *a)
{
  HycoROM m = (HycoROM)p->ctx;
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscScalar *alpha;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(p->U, &alpha));
  PetscCall(HycoBodiesExpand(&w->bodies, m->gamma));
  HycoBodiesAddStrains(&w->bodies, alpha, m->gamma);
  PetscCall(VecRestoreArrayRead(p->U, &alpha));
  PetscCall(HycoTraceAdd(m, p->t));
  p->now.stored = a->law.stored;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The part of q in the cells that the modes do not have, relative to q. */
static PetscReal Misfit(HycoROM m, const PetscReal alpha[])
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoBodiesInelastic in = w->bodies.bodies->inelastic;
  const PetscInt n = in->n_cells * m->model->mesh->nv * m->model->mesh->dim;
  PetscReal rest = 0, size = 0;

  for (PetscInt i = 0; i < n; i++) {
    PetscReal left = w->q[i];

    for (PetscInt k = 0; k < in->m; k++) left -= in->there[i * in->m + k] * alpha[k];
    rest += left * left;
    size += w->q[i] * w->q[i];
  }
  return size > 0 ? PetscSqrtReal(rest / size) : 0;
}

static PetscErrorCode Record(HycoPath p)
{
  HycoROM m = (HycoROM)p->ctx;
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const HycoBodiesSurface s = HycoBodiesSurfaceOf(m);
  const PetscScalar *alpha, *L;
  HycoFEStepReport report;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(p->Lambda, &L));
  PetscCall(PetscArraycpy(m->Lambda, L, m->model->pairs.n));
  PetscCall(VecRestoreArrayRead(p->Lambda, &L));
  PetscCall(HycoROMExpand(m));
  HycoBodiesMove(&w->bodies, &s, m->U);
  for (PetscInt i = 0; i < w->bodies.bodies->inelastic->nd; i++) m->U[w->at[i]] = w->u[w->at[i]];
  PetscCall(VecGetArrayRead(p->U, &alpha));
  w->misfit = PetscMax(w->misfit, Misfit(m, alpha));
  PetscCall(VecRestoreArrayRead(p->U, &alpha));
  PetscCall(HycoFEStepBodies(m->fe, HYCO_BODIES_LINEAR, m->U, p->t, p->t, p->end, p->begin, p->f_local, PETSC_FALSE,
                             &report));
  p->now.stored += report.stored;
  PetscCall(HycoTraceRecord(m, p->begin, &p->now));
  p->steps[p->n_steps++] = p->now;
  PetscCall(PetscMemzero(&p->now, sizeof(p->now)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- set-up -- */

/* The unknowns of the cells in fe's mesh, and back. */
static PetscErrorCode FindUnknowns(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoBodiesInelastic in = w->bodies.bodies->inelastic;
  HycoMesh mesh = m->model->mesh;
  const PetscInt n = mesh->nv * mesh->dim;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(in->nd + 1, &w->at));
  PetscCall(PetscMalloc1(mesh->n_cells * n, &w->cell_at));
  for (PetscInt i = 0; i < in->nd; i++) w->at[i] = -1;
  for (PetscInt k = 0; k < mesh->n_cells * n; k++) {
    const PetscInt local = HycoCellUnknown(mesh, k / n, k % n);
    PetscInt at;

    PetscCall(PetscFindInt(mesh->node_whole[local / mesh->dim] * mesh->dim + local % mesh->dim, in->nd, in->dof, &at));
    w->cell_at[k] = PetscMax(at, -1);
    if (at >= 0) w->at[at] = local;
  }
  for (PetscInt i = 0; i < in->nd; i++) HycoCheck(w->at[i] >= 0, "%s: bodies/inelastic/dof is damaged", m->model->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Allocate(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoBodiesInelastic in = w->bodies.bodies->inelastic;
  const PetscInt n = m->model->mesh->nv * m->model->mesh->dim, cells = in->n_cells, l = in->m,
                 pairs = m->model->pairs.n;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(cells * n * n, &w->Ke));
  PetscCall(PetscCalloc1(cells * n, &w->heat));
  PetscCall(PetscCalloc1(cells * n, &w->q));
  PetscCall(PetscCalloc1(cells, &w->weight));
  PetscCall(PetscMalloc1(pairs * l + 1, &w->BP));
  PetscCall(PetscMalloc1(in->nd * l + 1, &w->response));
  PetscCall(PetscMalloc1(in->nd * l + 1, &w->S));
  PetscCall(PetscCalloc1(in->nd + 1, &w->u0));
  PetscCall(PetscCalloc1(m->fe->n_dof, &w->u));
  PetscCall(PetscCalloc1(l + 1, &w->r));
  PetscCall(PetscMalloc1(l * l + 1, &w->J));
  PetscCall(PetscMalloc1(l + 1, &w->pivot));
  PetscCall(PetscCalloc1(pairs + 1, &w->column));
  PetscCall(PetscMalloc1(pairs + 1, &w->set));
  w->n_set = -1;
  for (PetscInt i = 0; i < cells * n * l; i++) w->weight[i / (n * l)] += PetscSqr(in->T[i]);
  for (PetscInt e = 0; e < cells; e++) w->weight[e] = PetscSqrtReal(w->weight[e]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CreatePath(HycoROM m)
{
  static const HycoPathOps ops = {.assemble = Assemble, .iterate = Iterate, .accept = Accept, .record = Record};
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoPath p;

  PetscFunctionBegin;
  PetscCall(HycoPathNew(PETSC_COMM_SELF, m->model->scene, &w->path));
  p = w->path;
  PetscCall(HycoTraceOptions(m, p));
  HycoCheck(
      p->method != HYCO_NEWTON_ELASTIC,
      "-hyco_newton elastic is not for models of bodies, whose tangents are small; use auto, modified or tangent");
  if (p->method == HYCO_NEWTON_AUTO) p->method = HYCO_NEWTON_MODIFIED;
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, w->bodies.bodies->inelastic->m, &w->alpha));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, m->model->pairs.n, &w->L));
  p->ops = &ops;
  p->ctx = m;
  p->fe = m->fe;
  p->U = w->alpha;
  p->Lambda = w->L;
  p->n_contacts = m->model->pairs.n;
  p->n_free = w->bodies.bodies->inelastic->m;
  PetscCall(HycoPathSetUp(p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SetUp(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoBodiesSurface s;

  PetscFunctionBegin;
  PetscCall(HycoROMSetUpDefault(m));
  w->bodies.bodies = (HycoSubstructures)m->model->data;
  m->n = w->bodies.bodies->inelastic->m;
  m->fe->all_facets = PETSC_TRUE;
  s = HycoBodiesSurfaceOf(m);
  PetscCall(HycoBodiesSetUp(&w->bodies, w->bodies.bodies, m->model->scene, &s, m->solver));
  PetscCall(FindUnknowns(m));
  PetscCall(Allocate(m));
  PetscCall(CreatePath(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Reset(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;

  PetscFunctionBegin;
  if (!w) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoBodiesForget(m));
  HycoFreeAll(&w->at, &w->cell_at, &w->Ke, &w->heat, &w->weight, &w->BP, &w->response, &w->column, &w->set, &w->U,
              &w->Z, &w->S, &w->z, &w->u0, &w->u, &w->q, &w->r, &w->J, &w->pivot);
  PetscCall(VecDestroy(&w->alpha));
  PetscCall(VecDestroy(&w->L));
  PetscCall(HycoPathFree(&w->path));
  if (w->bodies.bodies) PetscCall(HycoBodiesReset(&w->bodies));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Solve(HycoROM m, const PetscReal mu[])
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;

  PetscFunctionBegin;
  w->misfit = 0;
  w->fresh = PETSC_TRUE; /* the same factors whatever was predicted before */
  PetscCall(HycoBodiesForget(m));
  PetscCall(HycoTraceFollow(m, w->path, mu));
  PetscCall(PetscStrncpy(m->prediction.method, HycoNewtons[w->path->method], sizeof(m->prediction.method)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The part of the inelastic forces that the modes do not have; and the bound of interpolated flexibilities. */
static PetscErrorCode Features(HycoROM m, PetscReal misfit[2])
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;

  PetscFunctionBegin;
  misfit[0] = w->bodies.bodies->bound;
  misfit[1] = w->misfit;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode View(HycoROM m, PetscViewer viewer)
{
  HycoBodiesInelastic in = ((HycoSubstructures)m->model->data)->inelastic;

  PetscFunctionBegin;
  PetscCall(HycoBodiesView(m, viewer));
  PetscCall(PetscViewerASCIIPrintf(viewer,
                                   "  inelastic modes: %d; laws in %d of %d elements; an error of the modes is "
                                   "amplified up to %.3g times\n",
                                   (int)in->m, (int)in->n_cells, (int)m->model->whole_cells,
                                   (double)in->amplification));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesTakePath(HycoROM m)
{
  static const HycoROMTraits traits = {.title = "condensed bodies",
                                       .settings = HYCO_SETTINGS_NONE,
                                       .constrains = PETSC_TRUE,
                                       .history = PETSC_TRUE,
                                       .surfaces = PETSC_TRUE,
                                       .cells = PETSC_TRUE,
                                       .work = sizeof(struct _n_HycoBodiesPath),
                                       .resultants = PETSC_TRUE};
  static const HycoROMOps ops = {.setup = SetUp,
                                 .reset = Reset,
                                 .solve = Solve,
                                 .features = Features,
                                 .view = View,
                                 .save = HycoBodiesFile,
                                 .load = HycoBodiesFile,
                                 .destroy = HycoBodiesDestroyModel};

  PetscFunctionBegin;
  PetscCall(HycoROMSetOps(m, &ops, &traits, m->model->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}
