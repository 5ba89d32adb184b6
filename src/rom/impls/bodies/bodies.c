/*
  The model of bodies as substructures (hycobodies.h): linear elastic bodies whose stiffness changes only by rigid
  motions, uniform scaling and a factor. The contact search is that of full order, on the bodies' surfaces at mu;
  nothing is interpolated, so that forces and surface displacements are those of full order.
*/
#include <hycobodies.h>
#include <hycoromtypes.h>
#include <petscviewer.h>
#include <string.h>

/* The estimate of u over what the modes miss at the checks: a response that no sample has is missed ten times as much as the
   worst of some tens of points. */
#define BEYOND   10
#define ROUNDING 1e-10 /* relative, of exact results */
#define ACTIVE   0.3   /* assumed share of closed contacts, and entries of a row of B, for costs */
#define ENTRIES  15

static HycoBodiesSurface SurfaceOf(HycoROM m)
{
  return HycoBodiesSurfaceNormal(m->fe, &m->model->pairs, &m->rows);
}

static PetscErrorCode SetUp(HycoROM m)
{
  HycoBodiesSurface s;

  PetscFunctionBegin;
  PetscCall(HycoROMSetUpDefault(m));
  s = SurfaceOf(m);
  PetscCall(
      HycoBodiesSetUp((HycoBodiesWork)m->work, (HycoSubstructures)m->model->data, m->model->scene, &s, m->solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Reset(HycoROM m)
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

/* The residual of equilibrium along the rigid motions that contact alone prevents, relative to the terms of each. */
static PetscReal Unbalanced(HycoBodiesWork o)
{
  const HycoSubstructures b = o->bodies;
  PetscReal most = 0;

  for (PetscInt i = 0; i < b->p; i++) {
    PetscReal sum = 0, size = 0;

    for (PetscInt j = 0; j < b->r; j++) sum += o->work[i * b->r + j] * o->c[j];
    size = PetscAbsReal(sum);
    for (PetscInt k = 0; k < b->ns; k++) {
      sum -= o->Z[k * b->p + i] * o->f[k];
      size += PetscAbsReal(o->Z[k * b->p + i] * o->f[k]);
    }
    if (size > 0) most = PetscMax(most, PetscAbsReal(sum) / size);
  }
  return most;
}

void HycoBodiesMeasure(HycoROM m, HycoKKT *kkt)
{
  PetscReal gaps = 0, u = 0, most = 0, in = 0, pulls = 0, both = 0;

  for (PetscInt k = 0; k < m->model->pairs.n; k++) {
    const PetscReal left = m->rows.gap[k] - HycoROMAddRow(m, k, 0);
    PetscReal sum = 0;

    if (m->rows.start[k] == m->rows.start[k + 1]) continue;
    for (PetscInt j = m->rows.start[k]; j < m->rows.start[k + 1]; j++)
      sum += PetscAbsReal(m->rows.value[j] * m->U[m->rows.dof[j]]);
    u = PetscMax(u, sum);
    gaps = PetscMax(gaps, PetscAbsReal(m->rows.gap[k]));
    most = PetscMax(most, PetscAbsReal(m->Lambda[k]));
    in = PetscMax(in, -left);
    pulls = PetscMax(pulls, -m->Lambda[k]);
    both = PetscMax(both, PetscAbsReal(left * m->Lambda[k]));
  }
  gaps = PetscMax(gaps, u);
  kkt->rounding = 0;
  kkt->stationarity = Unbalanced((HycoBodiesWork)m->work);
  kkt->penetration = gaps > 0 ? in / gaps : 0;
  kkt->adhesion = most > 0 ? pulls / most : 0;
  kkt->complementarity = gaps > 0 && most > 0 ? both / (gaps * most) : 0;
}

/* The modes where displacements are not exact. */
static void Expand(HycoROM m, const PetscInt loc[])
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
  const HycoBodiesSurface s = SurfaceOf(m);

  PetscFunctionBegin;
  PetscCall(HycoBodiesExpand(o, m->gamma));
  Expand(m, o->loc);
  HycoBodiesMove(o, &s, m->U);
  HycoFEComplete(m->fe, m->U);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Solve(HycoROM m, const PetscReal mu[])
{
  HycoBodiesWork o = (HycoBodiesWork)m->work;
  HycoPrediction *p = &m->prediction;
  const HycoBodiesSurface s = SurfaceOf(m);
  PetscReal begin = HycoNow(), solve, norm;
  PetscBool solved;

  PetscFunctionBegin;
  PetscCall(HycoROMBringRows(m, mu));
  solve = HycoNow();
  p->seconds.factor = 0;
  p->seconds.assemble = solve - begin;
  PetscCall(HycoBodiesSolve(o, &s, mu, m->Lambda, &solved));
  PetscCall(ExpandAll(m));
  HycoBodiesMeasure(m, &p->kkt);
  p->interpolation_error = HycoBodiesBound(o, &norm);
  p->iterations = o->its;
  p->reason = solved && HycoKKTMax(&p->kkt) > m->solver->rtol ? HYCO_DIVERGED_RESIDUAL : o->reason;
  PetscCall(PetscStrncpy(p->method, o->method, sizeof(p->method)));
  p->seconds.solve = HycoNow() - solve;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The bound of the forces; nothing indicates errors of displacements, which are as accurate as the modes everywhere. */
static PetscErrorCode Features(HycoROM m, PetscReal misfit[2])
{
  PetscFunctionBegin;
  misfit[0] = m->prediction.interpolation_error;
  misfit[1] = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The forces have the bound, displacements the error of the modes. Where nothing is interpolated, stresses in cells
   without modes have that of round-off. */
static PetscErrorCode Estimate(HycoROM m, HycoPrediction *p)
{
  const HycoSubstructures b = (HycoSubstructures)m->model->data;

  PetscFunctionBegin;
  p->estimated_error_lambda = PetscMax(p->interpolation_error, ROUNDING);
  if (b->n_theta && !m->model->estimates.n) /* errors of interpolated displacements are not known */
    PetscFunctionReturn(PETSC_SUCCESS);
  p->estimated_error_u = PetscMax(BEYOND * b->left, ROUNDING);
  if (b->ni && !b->n_theta) p->estimated_error_sigma = ROUNDING;
  PetscFunctionReturn(PETSC_SUCCESS);
}

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
  else
    PetscCall(PetscViewerASCIIPrintf(viewer, "  nothing is interpolated: forces are those of full order\n"));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  fields and stresses on %d of %d elements, or the whole mesh\n",
                                   (int)m->model->mesh->n_cells, (int)m->model->whole_cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- training -- */

PetscErrorCode HycoBodiesOptions(HycoReducer t)
{
  static const char *const laws[] = {"auto", "interpolation", "cubature", NULL};
  static const char *const of_history[] = {"-hyco_bodies_inelastic_tol", "-hyco_bodies_cells", "-hyco_bodies_laws",
                                           "-hyco_bodies_cubature_tol"};
  HycoBodiesTraining s;
  PetscBool set[4] = {PETSC_FALSE, PETSC_FALSE, PETSC_FALSE, PETSC_FALSE};

  PetscFunctionBegin;
  PetscCall(PetscNew(&s));
  t->training = s;
  s->pod_tol = 1e-10;
  s->samples = 60;
  s->inelastic_tol = 1e-10;
  s->cells = 2;
  s->cubature_tol = 1e-4;
  s->tol = 1e-5;
  s->most_samples = 60;
  PetscObjectOptionsBegin((PetscObject)t);
  PetscCall(HycoOptionsFor("bodies"));
  PetscCall(HycoOptionsReal("-hyco_bodies_pod_tol", "bodies: energy left out of the displacement modes of each body", 0,
                            1, &s->pod_tol, NULL));
  PetscCall(HycoOptionsInt(
      "-hyco_bodies_samples",
      "bodies: contact problems on the surfaces alone whose displacements give the modes; twice as many, up to four "
      "times, while a body has more modes than half of them",
      1, 100000, &s->samples, NULL));
  PetscCall(HycoOptionsReal("-hyco_bodies_tol",
                            "bodies: samples of bodies whose shape or ratio of moduli changes are added until the "
                            "relative error of their flexibility at held-out samples is no larger",
                            0, 1, &s->tol, NULL));
  PetscCall(HycoOptionsInt("-hyco_bodies_max_samples", "bodies: largest number of these samples", 1, 100000,
                           &s->most_samples, NULL));
  PetscCall(HycoOptionsFor("bodies, of a history"));
  PetscCall(HycoOptionsReal("-hyco_bodies_inelastic_tol",
                            "bodies, with a history: energy left out of the modes of the inelastic strain", 0, 1,
                            &s->inelastic_tol, &set[0]));
  PetscCall(HycoOptionsInt("-hyco_bodies_cells",
                           "bodies, with a history: number of points with laws for each mode of the inelastic strain",
                           1, 1000000, &s->cells, &set[1]));
  PetscCall(HycoOptionsWord("-hyco_bodies_laws",
                            "bodies, with a history: coefficients of the inelastic modes by interpolation at few "
                            "points, or by Galerkin's method with a cubature (auto: where a law yields)",
                            laws, &s->laws, &s->named));
  PetscCall(HycoOptionsReal("-hyco_bodies_cubature_tol",
                            "bodies, with a history: relative error of the cubature in training", 1e-12, 1,
                            &s->cubature_tol, &set[3]));
  PetscOptionsEnd();
  set[2] = s->named;
  for (int k = 0; k < 4; k++)
    HycoCheck(!set[k] || !t->scene || t->scene->n_times,
              "%s is for scenes with a history, and this scene has none; remove it", of_history[k]);
  if (t->scene && t->scene->n_times) PetscCall(HycoBodiesTakePath(t->prototype));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesResetTraining(HycoReducer t)
{
  HycoBodiesTraining s = (HycoBodiesTraining)t->training;

  PetscFunctionBegin;
  PetscCall(HycoBodyPartsDestroy(&s->parts));
  PetscCall(MatDestroy(&s->strains.V));
  PetscCall(PetscFree(s->strains.sigma));
  PetscCall(HycoBodiesDestroy(&s->bodies));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Over paths the laws in few cells, unless an option names how. */
const char *const *HycoBodiesVariants(HycoReducer t)
{
  static const char *const variants[] = {"interpolation", "cubature", NULL};

  return HycoBodiesFlow(t) && !HycoTrainingOfBodies(t)->named ? variants : NULL;
}

PetscErrorCode HycoBodiesSetVariant(HycoReducer t, const char name[])
{
  PetscFunctionBegin;
  HycoTrainingOfBodies(t)->laws = strcmp(name, "cubature") == 0 ? HYCO_BODIES_CUBATURE : HYCO_BODIES_INTERPOLATION;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The unknowns of the model's mesh whose displacements are exact. */
static PetscErrorCode TakeExact(HycoROM m, HycoSubstructures b)
{
  HycoMesh mesh = m->model->mesh;
  const PetscInt cells = b->inelastic ? b->inelastic->nd : 0;
  PetscInt *sorted, *dof, n = 0, all = b->ns + b->ni + cells;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(all + 1, &sorted));
  PetscCall(PetscArraycpy(sorted, b->dof, b->ns));
  PetscCall(PetscArraycpy(sorted + b->ns, b->inner, b->ni));
  if (cells) PetscCall(PetscArraycpy(sorted + b->ns + b->ni, b->inelastic->dof, cells));
  PetscCall(PetscSortRemoveDupsInt(&all, sorted));
  PetscCall(PetscMalloc1(mesh->n_nodes * mesh->dim + 1, &dof));
  for (PetscInt i = 0; i < mesh->n_nodes * mesh->dim; i++) {
    PetscInt at;

    PetscCall(PetscFindInt(mesh->node_whole[i / mesh->dim] * mesh->dim + i % mesh->dim, all, sorted, &at));
    if (at >= 0) dof[n++] = i;
  }
  PetscCall(HycoROMSetFE(m, HYCO_HYBRID_CONTACT, n, dof));
  PetscCall(PetscFree(dof));
  PetscCall(PetscFree(sorted));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesBuild(HycoROM m, HycoReducer t)
{
  HycoBodiesTraining s = (HycoBodiesTraining)t->training;
  HycoSubstructures none = (HycoSubstructures)m->model->data;

  PetscFunctionBegin;
  PetscCall(HycoBodiesDestroy(&none));
  m->model->data = s->bodies;
  s->bodies = NULL;
  PetscCall(HycoFloatingDestroy(&m->model->floating)); /* their equilibrium is an equation of the model */
  for (PetscInt k = 0; k < m->model->pairs.n; k++) m->model->in_rid[k] = 1;
  PetscCall(TakeExact(m, (HycoSubstructures)m->model->data));
  if (t->scene->n_times) PetscCall(HycoROMSetDomain(m, NULL));
  PetscCall(HycoReducerJudge(t, m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Build(HycoROM m, HycoReducer t)
{
  PetscFunctionBegin;
  if (t->scene->n_times) { /* a model of paths has its own */
    PetscCall(HycoBodiesTakePath(m));
    PetscCall((*m->ops->build)(m, t));
  } else
    PetscCall(HycoBodiesBuild(m, t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Report(HycoReducer t, HycoROM m, HycoTraining *r)
{
  HycoSubstructures b = (HycoSubstructures)m->model->data;
  const char *filled = "; displacements still need more modes than half of the samples, so that those away from the "
                       "contact are less accurate (-hyco_bodies_samples)";
  char bound[HYCO_LINE / 4];

  PetscFunctionBegin;
  PetscCall(HycoTrainingAddFact(r, "n_bodies", (PetscReal)b->n));
  PetscCall(HycoTrainingAddFact(r, "n_surface_unknowns", (PetscReal)b->ns));
  PetscCall(HycoTrainingAddFact(r, "n_body_samples", (PetscReal)HycoBodiesGrid(b, 0, NULL)));
  PetscCall(HycoTrainingAddFact(r, "force_bound", b->forces));
  if (b->n_theta)
    snprintf(bound, sizeof(bound),
             "%d samples of their shapes and stiffnesses, contact forces within %.2g %% (bound at "
             "held-out samples)",
             (int)HycoBodiesGrid(b, 0, NULL), 100 * (double)b->forces);
  else
    snprintf(bound, sizeof(bound), "nothing is interpolated, contact forces are exact");
  HycoFormat(r->summary,
             "%d bod%s with %d unknowns on the surfaces that may touch and %d exact ones inside; %s; %d independent "
             "load%s, %d "
             "displacement modes%s\n",
             (int)b->n, b->n == 1 ? "y" : "ies", (int)b->ns, (int)b->ni, bound, (int)b->r, b->r == 1 ? "" : "s",
             (int)r->n_modes, HycoTrainingOfBodies(t)->filled ? filled : "");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal Cost(HycoReducer t, const HycoAttempt *a)
{
  const PetscReal active = ACTIVE * (PetscReal)t->sizes[2], row = ENTRIES * active;

  return row * row + active * active * active / 3 + 2 * (PetscReal)a->n_modes * (PetscReal)a->rid_nodes * t->sizes[3];
}

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
  static const HycoROMOps ops = {.setfromoptions = HycoBodiesOptions,
                                 .resettraining = HycoBodiesResetTraining,
                                 .begin = HycoBodiesBegin,
                                 .modes = HycoBodiesModes,
                                 .build = Build,
                                 .report = Report,
                                 .cost = Cost,
                                 .offers = HycoBodiesOffers,
                                 .work = HycoBodiesOperations,
                                 .variants = HycoBodiesVariants,
                                 .setvariant = HycoBodiesSetVariant,
                                 .setup = SetUp,
                                 .reset = Reset,
                                 .solve = Solve,
                                 .unknowns = HycoBodiesUnknowns,
                                 .residual = HycoBodiesResidual,
                                 .jacobian = HycoBodiesJacobian,
                                 .expand = ExpandAll,
                                 .features = Features,
                                 .estimate = Estimate,
                                 .view = HycoBodiesView,
                                 .save = HycoBodiesFile,
                                 .load = HycoBodiesFile,
                                 .destroy = HycoBodiesDestroyModel};
  HycoSubstructures b;

  PetscFunctionBegin;
  PetscCall(HycoBodiesCreate(&b));
  PetscCall(HycoROMSetOps(m, &ops, &traits, b));
  PetscFunctionReturn(PETSC_SUCCESS);
}
