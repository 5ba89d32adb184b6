/* The model of bodies on paths: set-up, the ops of the path, training and report. A step in time is in
   bodies_newton.c. */
#include "bodies_path.h"
#include <petscviewer.h>

/* -- ops of the path -- */

/* Sets the displacements of the surfaces and of the points' cells. */
static void MoveAll(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;

  HycoBodiesMove(&w->bodies, &w->surface, m->U);
  for (PetscInt i = 0; i < w->bodies.bodies->inelastic->nd; i++) m->U[w->at[i]] = w->u[w->at[i]];
}

/* The laws of all points in the cells at the forces L (by row), which gives the state at t1: the search has evaluated
   them at the chosen points only and stored nothing. */
static PetscErrorCode SettleCells(HycoROM m, PetscReal t0, PetscReal t1, const PetscReal alpha[], const PetscReal L[],
                                  HycoStepAttempt *a)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoPath p = w->path;
  const PetscReal begin = HycoNow();

  PetscFunctionBegin;
  PetscCall(HycoBodiesMoveCells(m, alpha, L));
  PetscCall(PetscArrayzero(p->f_local, m->fe->n_dof));
  PetscCall(
      HycoFEStepBodies(m->fe, HYCO_BODIES_FLOWING, w->u, t0, t1, p->begin, p->end, p->f_local, PETSC_FALSE, &a->law));
  a->seconds_law += HycoNow() - begin;
  if (a->law.failed) HycoFormat(a->why, "%s", a->law.why);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Displacements of the surfaces and the cells, the state of these, and the residuals, recomputed from them. */
static PetscErrorCode BodiesPathState(HycoROM m, PetscReal t0, PetscReal t1, const PetscReal alpha[],
                                      const PetscReal Lambda[], HycoStepAttempt *a)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoPath p = w->path;
  PetscReal residual = 0;

  PetscFunctionBegin;
  a->law.dt_factor = 1; /* elastic bodies: no law asks for shorter steps */
  if (w->n_rows || !w->friction)
    PetscCall(SettleCells(m, t0, t1, alpha, w->friction ? HycoBodiesFrictionForces(w->friction) : Lambda, a));
  if (a->why[0]) PetscFunctionReturn(PETSC_SUCCESS);
  /* The getters of contact results read the normal forces, with friction too. */
  PetscCall(PetscArraycpy(m->Lambda, Lambda, m->model->pairs.n));
  if (w->friction)
    PetscCall(HycoBodiesFrictionMove(w->friction, &w->bodies, &p->kkt));
  else {
    PetscCall(HycoBodiesStrain(&w->bodies, &w->surface, alpha));
    HycoBodiesDisplacementsOfForces(&w->bodies, &w->surface, Lambda);
    MoveAll(m);
    PetscCall(HycoBodiesMeasure(m, PETSC_FALSE, &p->kkt, &residual));
  }
  /* Equilibrium holds by condensation, but for rigid motions; what is left of it is Newton's residual of alpha. */
  p->kkt.stationarity = PetscMax(p->kkt.stationarity, a->residual);
  /* Recomputed from U and Lambda: the search's own word is not enough. */
  residual = PetscMax(w->friction ? HycoKKTMax(&p->kkt) : residual, a->residual);
  a->converged = (PetscBool)(residual <= HYCO_RESIDUAL);
  if (!a->converged) HycoFormat(a->why, "the residual of the contacts is %.1e", (double)residual);
  if (!a->converged && p->no_equilibrium[0]) HycoFormat(a->why, "%s", p->no_equilibrium);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* First with the tangent that is kept while it contracts; if that fails, once more from the last accepted time
   with a new tangent in each iteration, before the path halves the step. */
static PetscErrorCode BodiesPathIterate(HycoPath p, PetscReal t0, PetscReal t1, HycoStepAttempt *a)
{
  HycoROM m = (HycoROM)p->ctx;
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  PetscScalar *alpha, *L;

  PetscFunctionBegin;
  PetscCall(VecGetArray(p->U, &alpha));
  PetscCall(VecGetArray(p->contact.Lambda, &L));
  /* The option tangent renews in each iteration from the first one on. */
  w->always = (PetscBool)(p->method == HYCO_NEWTON_TANGENT);
  PetscCall(HycoBodiesSearch(m, t0, t1, alpha, L, a));
  /* Iterations with a kept tangent are many and cheap: they must not keep steps shorter than those of full order. */
  a->easy = (PetscBool)!a->why[0];
  if (a->why[0] && !w->always && (w->n_rows || !w->friction)) { /* again from the begin of the step */
    /* alpha and the forces of the last accepted time. */
    PetscCall(HycoVecRead(p->U_old, p->n_free, alpha));
    PetscCall(HycoVecRead(p->contact.L_old, p->n_contacts, L));
    a->why[0] = '\0';
    a->iterations = 0;
    w->always = PETSC_TRUE;
    PetscCall(HycoBodiesSearch(m, t0, t1, alpha, L, a));
  }
  if (!a->why[0]) PetscCall(BodiesPathState(m, t0, t1, alpha, L, a));
  PetscCall(VecRestoreArray(p->U, &alpha));
  PetscCall(VecRestoreArray(p->contact.Lambda, &L));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the responses are those at the present rows, places, stiffness and samples, which become the last ones. */
static PetscBool BodiesPathIsUnchanged(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const HycoBodiesWork o = &w->bodies;
  /* Also when something else differs: the next call compares with this state. */
  PetscBool same = (PetscBool)(o->kept.same && w->place == m->fe->place);
  PetscReal *last = w->last;

  w->place = m->fe->place;
  for (PetscInt k = 0; k < o->bodies->n; k++) {
    for (PetscInt q = 0; q <= o->bodies->body[k].n_samples; q++, last++) {
      /* The weights of the samples and kappa together determine a body's stiffness at the present parameters. */
      const PetscReal now = q ? o->weight[k][q - 1] : o->kappa[k];

      same = (PetscBool)(same && now == *last);
      *last = now;
    }
  }
  return same;
}

/* Rows at mu first, then the bodies that they turn with. Nothing of Newton's tables is computed again if rows,
   places and stiffness stay, as in most steps. */
static PetscErrorCode BodiesPathAssemble(HycoPath p, const PetscReal mu[], PetscBool elastic)
{
  HycoROM m = (HycoROM)p->ctx;
  HycoBodiesPath w = (HycoBodiesPath)m->work;

  PetscFunctionBegin;
  (void)elastic;
  PetscCall(HycoROMBringRows(m, mu));
  if (w->friction)
    PetscCall(HycoBodiesFrictionPrepare(w->friction, &w->bodies, mu));
  else
    PetscCall(HycoBodiesPrepare(&w->bodies, &w->surface, mu));
  /* Elastic bodies with friction need no tables of strains. */
  if ((w->friction && !w->n_rows) || BodiesPathIsUnchanged(m)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoBodiesForget(m));
  PetscCall(HycoBodiesScale(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The trace and the listed times need gamma, which is expanded for accepted steps only. */
static PetscErrorCode BodiesPathAccept(HycoPath p, const HycoStepAttempt *a)
{
  HycoROM m = (HycoROM)p->ctx;
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscScalar *alpha;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(p->U, &alpha));
  PetscCall(HycoBodiesExpand(&w->bodies, m->gamma));
  HycoBodiesAddStrains(&w->bodies, alpha, m->gamma);
  MoveAll(m);
  PetscCall(PetscArraycpy(w->accepted, m->U, m->fe->n_dof));
  PetscCall(HycoBodiesLawsRecord(m, alpha));
  PetscCall(VecRestoreArrayRead(p->U, &alpha));
  PetscCall(HycoTraceAdd(m, p->t));
  p->now.stored = a->law.stored;
  if (w->friction) {
    PetscBool disproven;

    PetscCall(HycoBodiesFrictionAccept(w->friction, &w->bodies, p->t));
    PetscCall(HycoBodiesFrictionDisproven(w->friction, &disproven));
    p->now.disproven += disproven;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The part of s at the points that the modes do not have, relative to s. */
static PetscReal BodiesPathMisfit(HycoROM m, const PetscReal alpha[])
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscInt l = w->bodies.bodies->inelastic->m;
  PetscReal rest = 0, size = 0;

  for (PetscInt i = 0; i < w->n_rows; i++) {
    PetscReal left = w->s[i];

    /* there[] has the modes' stresses at the points: what is left is not represented by any alpha, and laws at other
       points miss it too. */
    for (PetscInt k = 0; k < l; k++) left -= w->there[i * l + k] * alpha[k];
    rest += left * left;
    size += w->s[i] * w->s[i];
  }
  return size > 0 ? PetscSqrtReal(rest / size) : 0;
}

/* The displacements at the last accepted time: the work may have a step that was refused. */
static void MoveBack(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;

  for (PetscInt i = 0; i < m->fe->n_dof; i++) {
    if (w->bodies.loc[i] >= 0) m->U[i] = w->accepted[i];
  }
  for (PetscInt i = 0; i < w->bodies.bodies->inelastic->nd; i++) m->U[w->at[i]] = w->accepted[w->at[i]];
}

/* p->why is set if the path ended early: the work then has the refused step, and the listed time is that of the
   last accepted one. */
static PetscErrorCode BodiesPathRecord(HycoPath p)
{
  HycoROM m = (HycoROM)p->ctx;
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const HycoRows *rows = w->surface.rows;
  const PetscScalar *alpha;
  PetscBool *loose;

  PetscFunctionBegin;
  PetscCall(HycoVecRead(p->contact.Lambda, m->model->pairs.n, m->Lambda));
  PetscCall(HycoROMExpandModal(m));
  /* Exact displacements of surfaces and cells over those of the modes, in this order. */
  MoveBack(m);
  HycoFEComplete(m->fe, m->U);
  PetscCall(VecGetArrayRead(p->U, &alpha));
  /* The largest of the listed times is a feature of the estimate. */
  w->misfit = PetscMax(w->misfit, BodiesPathMisfit(m, alpha));
  PetscCall(VecRestoreArrayRead(p->U, &alpha));
  PetscCall(HycoTraceRecord(m, PETSC_TRUE, p->begin, &p->now));
  m->imbalance = PetscMax(m->imbalance, HycoBodiesImbalance(&w->bodies, PETSC_FALSE));
  loose = &m->trace.loose[m->trace.n_listed - 1];
  if (w->friction)
    *loose = HycoBodiesFrictionFreeMotion(w->friction, m->loose);
  else if (p->now.total_contact_force > 0 || HycoBodiesLoaded(&w->bodies)) {
    char name[HYCO_LINE];

    PetscCall(HycoBodiesFreeMotion(&w->bodies, &w->surface, m->Lambda, loose, name));
    if (*loose && !m->prediction.loose) {
      PetscCall(PetscStrncpy(p->loose, name, sizeof(p->loose)));
      p->loose_at[0] = p->t;
    }
    if (*loose) p->loose_at[1] = p->t;
    if (*loose) HycoPathNameTimes(p->loose, p->loose_at, m->loose);
  }
  m->prediction.loose = (PetscBool)(m->prediction.loose || *loose);
  PetscCall(HycoRowsCountDependent(rows, m->fe->n_dof, m->U, m->Lambda,
                                   w->friction ? HycoBodiesFrictionState(w->friction) : NULL, &p->now.n_dependent));
  PetscCall(PetscArraycpy(w->motions + p->n_steps * w->bodies.bodies->p, w->bodies.x, w->bodies.bodies->p));
  p->steps[p->n_steps++] = p->now;
  PetscCall(PetscMemzero(&p->now, sizeof(p->now)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the problem of a step, for programs: from rest -- */

/* By row, with friction. alpha is in HycoBodiesPath. */
static PetscErrorCode BodiesPathUnknowns(HycoROM m, PetscInt *p, PetscInt *n, PetscReal z[])
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;

  PetscFunctionBegin;
  PetscCall(HycoBodiesUnknowns(m, p, n, w->friction ? NULL : z));
  if (!w->friction) PetscFunctionReturn(PETSC_SUCCESS);
  *n = w->surface.n;
  if (z) PetscCall(PetscArraycpy(z, w->bodies.x, *p));
  if (z) PetscCall(PetscArraycpy(z + *p, HycoBodiesFrictionForces(w->friction), *n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The parts that are probed for bodies that flow: the tables at mu, the displacements of the cells. */
static PetscErrorCode ProbeCells(HycoROM m, const PetscReal alpha[], const PetscReal L[])
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  PetscScalar *kept;

  PetscFunctionBegin;
  if (!w->bodies.bodies->inelastic->nd) PetscFunctionReturn(PETSC_SUCCESS);
  if (!BodiesPathIsUnchanged(m)) {
    PetscCall(HycoBodiesForget(m));
    PetscCall(HycoBodiesScale(m));
  }
  PetscCall(HycoBodiesProbeCells(m, alpha, L));
  PetscCall(VecGetArray(w->alpha, &kept));
  PetscCall(PetscArraycpy(kept, alpha, w->bodies.bodies->inelastic->m));
  PetscCall(VecRestoreArray(w->alpha, &kept));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* mu: the variables, with the time. Of bodies that flow, z ends with alpha. */
static PetscErrorCode BodiesPathResidual(HycoROM m, const PetscReal mu[], const PetscReal z[], PetscReal w[],
                                         PetscReal *size)
{
  HycoBodiesPath o = (HycoBodiesPath)m->work;
  const PetscInt p = o->bodies.bodies->p;

  PetscFunctionBegin;
  m->trace.n_listed = 0; /* the outputs are those of this state, and of no path */
  if (!o->friction) {
    PetscCall(HycoBodiesResidual(m, mu, z, w, size));
    PetscCall(ProbeCells(m, z + p + o->surface.n, z + p));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoROMBringRows(m, mu));
  PetscCall(HycoBodiesFrictionProbe(o->friction, &o->bodies, mu, z, w + p));
  PetscCall(ProbeCells(m, z + p + o->surface.n, z + p));
  HycoBodiesWorkOnMotions(&o->bodies, w);
  HycoBodiesFrictionNormal(o->friction, m->Lambda);
  HycoTraceShowOther(m, &HycoBodiesFrictionState(o->friction)->shear);
  *size = 0; /* it is for differences, which programs do not take */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The motions and the forces give the rest: elastic bodies without friction do not depend on the times before. */
static PetscErrorCode BodiesPathLineariseAtStep(HycoROM m, PetscInt k, PetscInt listed, PetscBool *able)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscInt p = w->bodies.bodies->p, n = m->model->pairs.n;
  PetscReal *z, size;

  PetscFunctionBegin;
  if (w->path->flows) {
    if (k >= 0 && !w->friction) PetscCall(BodiesPathAssemble(w->path, m->fe->mu, PETSC_FALSE));
    PetscCall(HycoBodiesLawsLinearise(m, k, able));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  /* Models of elastic bodies that have unknowns of cells are of older files. */
  *able = (PetscBool)!w->bodies.bodies->inelastic->nd;
  if (*able && w->friction) PetscCall(HycoBodiesSensitivityLinearise(m, w->friction, &w->bodies, k, NULL, able));
  if (!*able || k < 0 || w->friction) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(p + n + 1, &z));
  PetscCall(PetscArraycpy(z, w->motions + listed * p, p));
  PetscCall(PetscArraycpy(z + p, m->Lambda, n));
  HycoFinally(HycoBodiesResidual(m, m->fe->mu, z, NULL, &size), PetscCall(PetscFree(z)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode BodiesPathStepResidual(HycoROM m, const PetscInt **row, PetscReal w[], PetscReal *size)
{
  HycoBodiesPath o = (HycoBodiesPath)m->work;

  PetscFunctionBegin;
  HycoBodiesWorkOnMotions(&o->bodies, w);
  if (o->friction)
    HycoBodiesSensitivityResidual(o->friction, row, w + o->bodies.bodies->p, size);
  else
    PetscCall(HycoBodiesLawsResidual(m, row, w, size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode BodiesPathPerturbedState(HycoROM m, const PetscReal mu[], PetscInt n, const PetscInt contact[],
                                               PetscBool rows, const PetscReal z[], PetscInt point, PetscReal w[])
{
  HycoBodiesPath o = (HycoBodiesPath)m->work;

  PetscFunctionBegin;
  if (o->friction)
    PetscCall(HycoBodiesSensitivityPerturbed(m, o->friction, mu, contact, rows, z, point, w));
  else
    PetscCall(HycoBodiesNear(m, mu, n, contact, rows, z, point, w));
  if (o->path->flows) PetscCall(HycoBodiesLawsPerturbed(m, mu, point));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode BodiesPathSensitivity(HycoROM m, PetscInt parameter, const PetscReal weight[3],
                                            const PetscInt point[3], const PetscReal q[], PetscReal dz[],
                                            PetscBool *regular)
{
  HycoBodiesPath o = (HycoBodiesPath)m->work;

  PetscFunctionBegin;
  if (o->path->flows)
    PetscCall(HycoBodiesLawsSensitivity(m, parameter, weight, point, q, dz, regular));
  else
    PetscCall(HycoBodiesSensitivityAdvance(o->friction, parameter, weight, point, q, dz, regular));
  if (*regular && !o->path->flows) HycoBodiesSensitivityAccept(o->friction, parameter, dz);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode BodiesPathFieldDerivatives(HycoROM m, PetscInt n, const PetscInt contact[],
                                                 const PetscReal weight[2], const PetscInt point[2],
                                                 const PetscReal dz[], const PetscBool modes[], const PetscBool dofs[],
                                                 PetscReal dgamma[], PetscReal dU[])
{
  PetscFunctionBegin;
  PetscCall(HycoBodiesDerivatives(m, n, contact, weight, point, dz, modes, dofs, dgamma, dU));
  if (((HycoBodiesPath)m->work)->path->flows) HycoBodiesLawsDerivatives(m, dU);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode BodiesPathShow(HycoROM m, PetscInt parameter, PetscBool rows, PetscReal step,
                                     const PetscReal dz[])
{
  PetscFunctionBegin;
  PetscCall(HycoBodiesSensitivityView(m, ((HycoBodiesPath)m->work)->friction, parameter, rows, step, dz));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of that state. */
static PetscErrorCode BodiesPathExpand(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscScalar *alpha;

  PetscFunctionBegin;
  PetscCall(HycoBodiesExpand(&w->bodies, m->gamma));
  PetscCall(VecGetArrayRead(w->alpha, &alpha));
  HycoBodiesAddStrains(&w->bodies, alpha, m->gamma);
  PetscCall(VecRestoreArrayRead(w->alpha, &alpha));
  PetscCall(HycoROMExpandModal(m));
  MoveAll(m);
  HycoFEComplete(m->fe, m->U);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- set-up -- */

/* The unknowns of the cells in fe's mesh, and back. The laws are evaluated in few cells: their displacements are found
   by number in the file's list, which ascends. */
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

    /* A file's numbers are those of the whole mesh; the model's mesh has its own. */
    PetscCall(PetscFindInt(mesh->node_whole[local / mesh->dim] * mesh->dim + local % mesh->dim, in->nd, in->dof, &at));
    w->cell_at[k] = PetscMax(at, -1);
    if (at >= 0) w->at[at] = local;
  }
  for (PetscInt i = 0; i < in->nd; i++) HycoCheck(w->at[i] >= 0, "%s: bodies/inelastic/dof is damaged", m->model->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The points in the model's mesh. */
static PetscErrorCode FindPoints(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoBodiesInelastic in = w->bodies.bodies->inelastic;
  HycoMesh mesh = m->model->mesh;
  const PetscInt nq = HycoElementGet(mesh->type)->nq;
  PetscInt *whole, *cell;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(in->n_points + 1, &w->point));
  PetscCall(PetscMalloc2(mesh->n_cells, &whole, mesh->n_cells, &cell));
  for (PetscInt e = 0; e < mesh->n_cells; e++) cell[e] = e;
  PetscCall(PetscArraycpy(whole, mesh->cell_whole, mesh->n_cells));
  /* The points are stored by cells of the whole mesh; the model's mesh has some of them in another order. */
  PetscCall(PetscSortIntWithArray(mesh->n_cells, whole, cell));
  for (PetscInt i = 0; i < in->n_points; i++) {
    PetscInt at;

    PetscCall(PetscFindInt(in->point[i] / nq, mesh->n_cells, whole, &at));
    /* The seal finds flipped bits, not a file that was changed on purpose. */
    HycoCheck(at >= 0 && HycoInelasticFlows(m->fe, cell[at]), "%s: bodies/inelastic/point is damaged", m->model->path);
    w->point[i] = cell[at] * nq + in->point[i] % nq;
  }
  PetscCall(PetscFree2(whole, cell));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sizes are those of HycoBodiesPath; the columns of contacts follow on demand. */
static PetscErrorCode BodiesPathAllocate(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoBodiesInelastic in = w->bodies.bodies->inelastic;
  const PetscInt n = m->model->mesh->nv * m->model->mesh->dim, l = in->m, ns = m->fe->n_sigma, pairs = w->surface.n;
  const PetscInt rows = w->n_rows = in->n_points * ns;
  PetscInt samples = 0;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(rows * n + 1, &w->B));
  PetscCall(PetscCalloc1(rows * l + 1, &w->T));
  PetscCall(PetscCalloc1(rows * l + 1, &w->there));
  PetscCall(PetscCalloc1(in->n_points + 1, &w->weight));
  PetscCall(PetscCalloc1((m->model->scene->n_times + 1) * w->bodies.bodies->p + 1, &w->motions));
  PetscCall(PetscMalloc1(pairs * l + 1, &w->BP));
  PetscCall(PetscMalloc1(pairs * w->bodies.bodies->p + 1, &w->G));
  PetscCall(PetscCalloc2(w->bodies.bodies->p * l + 1, &w->x, w->bodies.bodies->p + 1, &w->x0));
  PetscCall(PetscMalloc1(rows * l + 1, &w->response));
  PetscCall(PetscMalloc1(rows * w->bodies.bodies->r + 1, &w->loads));
  PetscCall(PetscMalloc1(rows * l + 1, &w->S));
  PetscCall(PetscMalloc1(rows * l + 1, &w->X));
  PetscCall(PetscCalloc1(rows + 1, &w->e0));
  PetscCall(PetscCalloc1(rows + 1, &w->e));
  PetscCall(PetscCalloc1(rows + 1, &w->s));
  PetscCall(PetscCalloc1(in->n_points + 1, &w->size));
  PetscCall(PetscCalloc1(rows * ns + 1, &w->lost));
  PetscCall(PetscCalloc1(m->fe->n_dof, &w->u));
  PetscCall(PetscCalloc1(m->fe->n_dof, &w->accepted));
  PetscCall(PetscCalloc1(l + 1, &w->r));
  PetscCall(PetscMalloc1(l * l + 1, &w->J));
  PetscCall(PetscMalloc1(l + 1, &w->pivot));
  PetscCall(PetscCalloc1(pairs + 1, &w->column));
  PetscCall(PetscCalloc1(pairs + 1, &w->gap));
  /* kappa and the weights of the samples of each body: what BodiesPathIsUnchanged() compares. */
  for (PetscInt k = 0; k < w->bodies.bodies->n; k++) samples += 1 + w->bodies.bodies->body[k].n_samples;
  PetscCall(PetscCalloc1(samples + 1, &w->last));
  PetscCall(PetscMalloc1(pairs + 1, &w->set));
  /* No set yet: -1 equals no number of contacts, not even 0. */
  w->n_set = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* p borrows alpha and L as its unknowns: for the path driver alpha is the "displacement", n_free its length. With
   elastic tangents J would be 1, and Newton's method a fixed-point iteration. */
static PetscErrorCode CreatePath(HycoROM m)
{
  static const HycoPathOps ops = {.assemble = BodiesPathAssemble,
                                  .iterate = BodiesPathIterate,
                                  .accept = BodiesPathAccept,
                                  .record = BodiesPathRecord};
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoPath p;

  PetscFunctionBegin;
  PetscCall(HycoPathNew(PETSC_COMM_SELF, m->model->scene, &w->path));
  p = w->path;
  PetscCall(HycoTraceOptions(m, p));
  HycoCheck(
      p->method != HYCO_NEWTON_ELASTIC,
      "-hyco_newton elastic is not for models of bodies, whose tangents are small; use auto, modified or tangent");
  /* The tangent costs one product of the size of the points' table: kept while it contracts. */
  if (p->method == HYCO_NEWTON_AUTO) p->method = HYCO_NEWTON_MODIFIED;
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, w->bodies.bodies->inelastic->m, &w->alpha));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, m->model->pairs.n, &w->L));
  p->ops = &ops;
  p->ctx = m;
  p->fe = m->fe;
  /* The driver copies and restores U and Lambda when a step is refused: they must be all of the state but that of the
     laws. */
  p->U = w->alpha;
  p->contact.Lambda = w->L;
  p->n_contacts = m->model->pairs.n;
  p->n_free = w->bodies.bodies->inelastic->m;
  PetscCall(HycoPathSetUp(p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The order: the surfaces before the bodies' work, which borrows them, and the points before the arrays of their
   number. */
static PetscErrorCode SetUp(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;

  PetscFunctionBegin;
  PetscCall(HycoROMSetUpDefault(m));
  w->bodies.bodies = (HycoSubstructures)m->model->data;
  m->n = w->bodies.bodies->inelastic->m;
  /* The mesh has few cells: pressures act on facets of the surfaces whose cells it lacks. */
  m->fe->all_facets = PETSC_TRUE;
  w->surface = HycoBodiesSurfaceOf(m);
  if (HycoSceneHasFriction(m->model->scene)) {
    PetscCall(HycoBodiesFrictionCreate(m->model->scene, &w->surface, w->bodies.bodies->p, &w->friction));
    w->surface = *HycoBodiesFrictionSurface(w->friction);
    m->friction = HycoBodiesFrictionState(w->friction);
  }
  w->gaps = w->friction ? 0 : w->surface.n;
  PetscCall(HycoBodiesSetUp(&w->bodies, w->bodies.bodies, m->model->scene, &w->surface, m->solver));
  PetscCall(FindUnknowns(m));
  PetscCall(FindPoints(m));
  PetscCall(BodiesPathAllocate(m));
  PetscCall(CreatePath(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Also after a set-up that failed half-way: all parts are NULL-safe, and `bodies` is set first. */
static PetscErrorCode BodiesPathReset(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;

  PetscFunctionBegin;
  if (!w) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoBodiesForget(m));
  HycoFreeAll(&w->at, &w->cell_at, &w->point, &w->B, &w->T, &w->there, &w->weight, &w->BP, &w->response, &w->loads,
              &w->column, &w->set, &w->U, &w->Z, &w->S, &w->z, &w->e0, &w->gap, &w->last, &w->u, &w->e, &w->s, &w->size,
              &w->lost, &w->X, &w->r, &w->J, &w->pivot);
  HycoFreeAll(&w->G, &w->Y, &w->H, &w->accepted, &w->motions);
  PetscCall(PetscFree2(w->x, w->x0));
  HycoDestroyAll(&w->alpha, &w->L);
  PetscCall(HycoPathFree(&w->path));
  PetscCall(HycoBodiesLawsDestroy(w));
  if (w->bodies.bodies) PetscCall(HycoBodiesReset(&w->bodies));
  PetscCall(HycoBodiesSensitivityDestroy(w->friction));
  PetscCall(HycoBodiesFrictionDestroy(&w->friction));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The path itself is HycoTraceFollow(): this only resets what would carry over from another prediction. */
static PetscErrorCode BodiesPathSolve(HycoROM m, const PetscReal mu[])
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;

  PetscFunctionBegin;
  /* A feature of this path alone. */
  w->misfit = 0;
  HycoBodiesRestart(m); /* the same factors whatever was predicted before */
  if (w->friction) PetscCall(HycoBodiesFrictionBegin(w->friction));
  PetscCall(HycoBodiesLawsBegin(m));
  PetscCall(HycoTraceFollow(m, w->path, mu));
  PetscCall(PetscStrncpy(m->prediction.method, w->friction ? HYCO_SOLVER_SEMISMOOTH : HycoNewtons[w->path->method],
                         sizeof(m->prediction.method)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The part of the inelastic forces that the modes do not have; and the bound of interpolated flexibilities. */
static PetscErrorCode BodiesPathFeatures(HycoROM m, PetscReal misfit[2])
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;

  PetscFunctionBegin;
  misfit[0] = w->bodies.bodies->bound;
  misfit[1] = w->misfit;
  m->stretch = HycoBodiesStretch(&w->bodies);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The amplification is the factor between an error of the strains at the points and one of the fields, as found in
   training. */
static PetscErrorCode BodiesPathView(HycoROM m, PetscViewer viewer)
{
  HycoBodiesInelastic in = ((HycoSubstructures)m->model->data)->inelastic;

  PetscFunctionBegin;
  PetscCall(HycoBodiesView(m, viewer));
  PetscCall(
      PetscViewerASCIIPrintf(viewer,
                             "  inelastic modes: %d; laws at %d points, in %d of %d elements; an error of the modes is "
                             "amplified up to %.3g times\n",
                             (int)in->m, (int)in->n_points, (int)m->model->mesh->n_cells, (int)m->model->whole_cells,
                             (double)in->amplification));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Unknowns, residual and expand serve programs too. No estimate of its own: those of held-out paths apply. */
PetscErrorCode HycoBodiesTakePath(HycoROM m)
{
  static const HycoROMTraits traits = {.title = "condensed bodies",
                                       .settings = HYCO_SETTINGS_NONE,
                                       .constrains = PETSC_TRUE,
                                       .history = PETSC_TRUE,
                                       .surfaces = PETSC_TRUE,
                                       .cells = PETSC_TRUE,
                                       .friction = PETSC_TRUE,
                                       .integrals = PETSC_TRUE,
                                       .work = sizeof(struct _n_HycoBodiesPath),
                                       .resultants = PETSC_TRUE};
  static const HycoROMOps ops = {.setup = SetUp,
                                 .reset = BodiesPathReset,
                                 .solve = BodiesPathSolve,
                                 .unknowns = BodiesPathUnknowns,
                                 .residual = BodiesPathResidual,
                                 .linearise = BodiesPathLineariseAtStep,
                                 .jacobian = HycoBodiesJacobian,
                                 .perturbed = BodiesPathPerturbedState,
                                 .step_residual = BodiesPathStepResidual,
                                 .sensitivity = BodiesPathSensitivity,
                                 .show = BodiesPathShow,
                                 .slope = BodiesPathFieldDerivatives,
                                 .expand = BodiesPathExpand,
                                 .features = BodiesPathFeatures,
                                 .view = BodiesPathView,
                                 .save = HycoBodiesFile,
                                 .load = HycoBodiesFile,
                                 .destroy = HycoBodiesDestroyModel};

  PetscFunctionBegin;
  PetscCall(HycoROMSetOps(m, &ops, &traits, m->model->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}
