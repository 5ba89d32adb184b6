/*
  The model of bodies as substructures (hycobodies.h): linear elastic bodies whose stiffness changes only by rigid
  motions, uniform scaling and a factor. The contact search is that of full order, on the bodies' surfaces at mu;
  nothing is interpolated, so that forces and surface displacements are those of full order.
*/
#include <hycobodies.h>
#include <hycoromtypes.h>
#include <petscviewer.h>
#include <string.h>

/* The estimate of u over what the modes miss at the checks: a response that no sample has is missed ten times as much
   as the worst of some tens of points. */
#define BEYOND 10
/* Of the results, the estimate of exact ones: the residual of solves, 1e-8 at most and 1e-10 as a rule. */
#define EXACT_ERROR 1e-10

/* HycoROMSetUpDefault() makes fe and rows, which the surface borrows. */
static PetscErrorCode SetUp(HycoROM m)
{
  HycoBodiesSurface s;

  PetscFunctionBegin;
  PetscCall(HycoROMSetUpDefault(m));
  s = HycoBodiesSurfaceOf(m);
  PetscCall(
      HycoBodiesSetUp((HycoBodiesWork)m->work, (HycoSubstructures)m->model->data, m->model->scene, &s, m->solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode BodiesReset(HycoROM m)
{
  PetscFunctionBegin;
  PetscCall(HycoBodiesReset((HycoBodiesWork)m->work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesDestroyModel(HycoROM m)
{
  HycoSubstructures b = (HycoSubstructures)m->model->data;

  PetscFunctionBegin;
  PetscCall(HycoBodiesDestroy(&b));
  m->model->data = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of the system that the forces solve, and how far its gaps are from those of the displacements that are reported. */
PetscErrorCode HycoBodiesMeasure(HycoROM m, PetscBool solved, HycoKKT *kkt, PetscReal *residual)
{
  const HycoBodiesWork o = (HycoBodiesWork)m->work;
  const PetscInt n = m->model->pairs.n;
  PetscReal *gap, misfit;

  PetscFunctionBegin;
  if (solved)
    PetscCall(HycoSolverGetKKT(o->solver, kkt));
  else {
    PetscCall(HycoBodiesUpdateSystem(o));
    PetscCall(HycoVecWrite(o->L, n, m->Lambda));
    if (o->motion) PetscCall(HycoVecWrite(o->motion, o->bodies->p, o->x));
    PetscCall(HycoSystemComputeKKT(o->system, o->motion, o->L, kkt));
  }
  PetscCall(PetscMalloc1(n + 1, &gap));
  for (PetscInt k = 0; k < n; k++) gap[k] = m->rows.gap[k] - HycoROMAddRow(m, k, 0);
  PetscCall(HycoSystemMisfit(o->system, gap, &misfit));
  PetscCall(PetscFree(gap));
  kkt->penetration = PetscMax(kkt->penetration, misfit);
  *residual = PetscMax(o->system->beyond, misfit);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The modes where displacements are not exact. */
static void BodiesExpand(HycoROM m, const PetscInt loc[])
{
  const PetscInt l = m->model->l;

  for (PetscInt i = 0; i < m->fe->n_dof; i++) {
    m->U[i] = m->fe->u0[i];
    for (PetscInt j = 0; j < l && loc[i] < 0 && !m->fe->fixed[i]; j++)
      m->U[i] += m->model->V[(size_t)i * (size_t)l + (size_t)j] * m->gamma[j];
  }
}

/* gamma and U from the forces and motions of the work. */
static PetscErrorCode ExpandAll(HycoROM m)
{
  HycoBodiesWork o = (HycoBodiesWork)m->work;
  const HycoBodiesSurface s = HycoBodiesSurfaceOf(m);

  PetscFunctionBegin;
  PetscCall(HycoBodiesExpand(o, m->gamma));
  BodiesExpand(m, o->loc);
  HycoBodiesMove(o, &s, m->U);
  HycoFEComplete(m->fe, m->U);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Says of a solve that failed what full order says, if the loads lift a body off. */
static PetscErrorCode NameLifted(HycoROM m, const HycoBodiesSurface *s)
{
  HycoPrediction *p = &m->prediction;
  PetscBool lift_off;
  char name[HYCO_LINE] = "";

  PetscFunctionBegin;
  PetscCall(HycoBodiesLiftOff((HycoBodiesWork)m->work, s, m->Lambda, name, &lift_off));
  if (!lift_off) PetscFunctionReturn(PETSC_SUCCESS);
  p->reason = HYCO_DIVERGED_FLOATING;
  PetscCall(PetscSNPrintf(p->why, sizeof(p->why), "%s%s%s", HycoReasonName(p->reason),
                          name[0] ? "; no support keeps " : "", name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Assembly is the rows' search and gaps; a factor does not exist. The reason of the solver counts only if the
   recomputed residuals agree. */
static PetscErrorCode BodiesSolve(HycoROM m, const PetscReal mu[])
{
  HycoBodiesWork o = (HycoBodiesWork)m->work;
  HycoPrediction *p = &m->prediction;
  const HycoBodiesSurface s = HycoBodiesSurfaceOf(m);
  PetscReal begin = HycoNow(), solve, norm, residual;
  PetscBool solved;

  PetscFunctionBegin;
  PetscCall(HycoROMBringRows(m, mu));
  solve = HycoNow();
  p->seconds.factor = 0;
  p->seconds.assemble = solve - begin;
  PetscCall(HycoBodiesSolve(o, &s, mu, m->Lambda, &solved));
  PetscCall(ExpandAll(m));
  PetscCall(HycoBodiesMeasure(m, PETSC_TRUE, &p->kkt, &residual));
  m->imbalance = HycoBodiesImbalance(o, PETSC_FALSE);
  /* The bound of theory.md: from the samples' error e and the present forces; 0 where nothing is interpolated. */
  p->interpolation_error = HycoBodiesBound(o, &norm);
  PetscCall(HycoBodiesFreeMotion(o, &s, m->Lambda, &p->loose, m->loose));
  p->iterations = o->its;
  p->reason = solved && residual > m->solver->rtol ? HYCO_DIVERGED_RESIDUAL : o->reason;
  if (p->reason < 0) PetscCall(NameLifted(m, &s));
  PetscCall(PetscStrncpy(p->method, o->method, sizeof(p->method)));
  p->seconds.solve = HycoNow() - solve;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The bound of the forces; nothing indicates errors of displacements, which are as accurate as the modes everywhere. */
static PetscErrorCode BodiesFeatures(HycoROM m, PetscReal misfit[2])
{
  PetscFunctionBegin;
  misfit[0] = m->prediction.interpolation_error;
  misfit[1] = 0;
  m->stretch = HycoBodiesStretch((HycoBodiesWork)m->work);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The forces have the bound, displacements the error of the modes. Where nothing is interpolated, stresses in cells
   without modes have that of round-off. */
static PetscErrorCode BodiesEstimate(HycoROM m, HycoPrediction *p)
{
  const HycoSubstructures b = (HycoSubstructures)m->model->data;

  PetscFunctionBegin;
  p->estimated_error_lambda = PetscMax(p->interpolation_error, EXACT_ERROR);
  if (b->n_theta && !m->model->estimates.n) /* errors of interpolated displacements are not known */
    PetscFunctionReturn(PETSC_SUCCESS);
  p->estimated_error_u = PetscMax(BEYOND * b->left, EXACT_ERROR);
  if (b->ni && !b->n_theta) p->estimated_error_sigma = EXACT_ERROR;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The last axis is the fastest, as in HycoTensor. theta NULL: only the number of nodes. */
PetscInt HycoBodiesGrid(HycoSubstructures b, PetscInt k, PetscReal theta[])
{
  PetscInt n = 1;
  const PetscReal *node = b->node;

  for (PetscInt p = 0; p < b->n_theta; p++) {
    n *= b->n_nodes[p];
    node += b->n_nodes[p];
  }
  for (PetscInt p = b->n_theta - 1; theta && p >= 0; p--) {
    node -= b->n_nodes[p];
    /* Nodes are of the interpolated variable, for instance 1/radius; theta is the parameter itself. */
    theta[p] = HycoBodiesValue(b->variable[p], node[k % b->n_nodes[p]]);
    k /= b->n_nodes[p];
  }
  return n;
}

/* What a user must know to trust the model: sizes, whether anything is interpolated, and the bound if so. */
PetscErrorCode HycoBodiesView(HycoROM m, PetscViewer viewer)
{
  HycoSubstructures b = (HycoSubstructures)m->model->data;

  PetscFunctionBegin;
  PetscCall(PetscViewerASCIIPrintf(viewer, "  %d bodies; unknowns of the surfaces that may touch:", (int)b->n));
  for (PetscInt k = 0; k < b->n; k++)
    PetscCall(PetscViewerASCIIPrintf(viewer, "%s %d", k ? "," : "", (int)(b->start[k + 1] - b->start[k])));
  PetscCall(PetscViewerASCIIPrintf(viewer,
                                   "\n  contacts: %d; independent loads: %d; rigid motions held by contact: %d\n",
                                   (int)m->model->pairs.n, (int)b->r, (int)b->p));
  if (b->n_theta)
    PetscCall(PetscViewerASCIIPrintf(viewer,
                                     "  contact forces within %.1e (bound at held-out samples of the bodies, %d "
                                     "samples)\n",
                                     (double)b->forces, (int)HycoBodiesGrid(b, 0, NULL)));
  else if (b->inelastic)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  elastic responses are exact, %d modes of what is inelastic are not\n",
                                     (int)b->inelastic->m));
  else
    PetscCall(PetscViewerASCIIPrintf(viewer, "  nothing is interpolated: forces are those of full order\n"));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  fields and stresses on %d of %d elements, or the whole mesh\n",
                                   (int)m->model->mesh->n_cells, (int)m->model->whole_cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The traits and ops without a history; HycoBodiesTakePath() replaces both when a file or a scene has one. `data`
   exists from the beginning, since load and training fill it. Settings: none, as there is nothing to search, so that
   training makes one model only. */
PetscErrorCode HycoROMCreate_Bodies(HycoROM m)
{
  static const HycoROMTraits traits = {.title = "condensed bodies",
                                       .settings = HYCO_SETTINGS_NONE,
                                       .constrains = PETSC_TRUE,
                                       .forces = PETSC_TRUE,
                                       .own_modes = PETSC_TRUE,
                                       .surfaces = PETSC_TRUE,
                                       .history = PETSC_TRUE,
                                       .integrals = PETSC_TRUE,
                                       .cells = PETSC_TRUE,
                                       .uniform = PETSC_TRUE,
                                       .friction = PETSC_TRUE,
                                       .work = sizeof(*(HycoBodiesWork)NULL),
                                       .resultants = PETSC_TRUE};
  static const HycoROMOps ops = {.setup = SetUp,
                                 .reset = BodiesReset,
                                 .solve = BodiesSolve,
                                 .unknowns = HycoBodiesUnknowns,
                                 .residual = HycoBodiesResidual,
                                 .jacobian = HycoBodiesJacobian,
                                 .perturbed = HycoBodiesNear,
                                 .slope = HycoBodiesDerivatives,
                                 .expand = ExpandAll,
                                 .features = BodiesFeatures,
                                 .estimate = BodiesEstimate,
                                 .view = HycoBodiesView,
                                 .save = HycoBodiesFile,
                                 .load = HycoBodiesFile,
                                 .destroy = HycoBodiesDestroyModel};
  HycoSubstructures b;

  PetscFunctionBegin;
  PetscCall(PetscNew(&b));
  PetscCall(HycoROMSetOps(m, &ops, &traits, b));
  PetscFunctionReturn(PETSC_SUCCESS);
}
