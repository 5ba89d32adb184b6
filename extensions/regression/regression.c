/*
  The regression model: every coefficient, contact force, stress and inelastic strain is a function of the parameters,
  with a history one at each listed time, by radial basis functions with a linear polynomial,

    y(mu) = sum over the training points k of c_k phi(|mu - mu_k|) + a + b . mu,    sum of c_k (1, mu_k) = 0

  with the parameters scaled by their ranges, which reproduces the training values. All functions have the same weights,
  y(mu) = sum of w_k(mu) y_k. Contact forces and inelastic strains are cut off at 0. No law is evaluated and no equation
  solved, so that bodies may penetrate, as the residuals at the contacts show. It is a baseline without mechanics for
  the other models.
*/
#include <hycoalgorithms.h>
#include <hycomaterialimpl.h>
#include <hycoreducerimpl.h>
#include <hycoextensions.h>
#include <hycoromtype.h>
#include <petscviewer.h>

enum { KERNEL_CUBIC, KERNEL_THIN_PLATE, KERNEL_LINEAR };
static const char *const kernels[] = {"cubic", "thin_plate", "linear", NULL};

typedef struct {
  HycoSnapshots store; /* borrowed, of this run */
  PetscInt kernel;
} * Training;

/* Values: a column for each training point, with a history one for each of its listed times, point after point. */
typedef struct {
  PetscInt kernel, n_columns;
  PetscReal *gamma, *Lambda;    /* l, N_lambda rows */
  PetscReal *sigma, *inelastic; /* with a history: n_cells x n_sigma, n_cells rows */
} * Regression;

typedef struct {
  PetscReal *inverse;        /* of the system for c, a, b (symmetric) */
  PetscReal *right, *weight; /* its right-hand side; the points' weights, followed by those of a, b */
  PetscReal largest;         /* largest contact force in training */
  HycoStep *step;            /* by listed time */
} * Work;

/* -- training -- */

/* The kernel is one of the library's enum, in the order of the words. */
static PetscErrorCode SetFromOptions(HycoReducer t)
{
  Training s;

  PetscFunctionBegin;
  PetscCall(PetscNew(&s));
  t->training = s;
  PetscObjectOptionsBegin((PetscObject)t);
  PetscCall(HycoOptionsFor("regression"));
  PetscCall(HycoOptionsWord("-hyco_regression_kernel",
                            "radial basis functions of the distance r: r^3, r^2 log r, r; with a linear polynomial",
                            kernels, &s->kernel, NULL));
  PetscOptionsEnd();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The modes are those of displacements, which the reducer has; only the store is kept for RegressionBuild(). */
static PetscErrorCode RegressionModes(HycoReducer t, HycoSnapshots store)
{
  PetscFunctionBegin;
  ((Training)t->training)->store = store;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads a field of the training paths in the model's cells, `width` numbers each. */
static PetscErrorCode ReadCells(HycoReducer t, HycoROM m, const char field[], PetscInt width, PetscReal value[])
{
  const HycoSnapshots store = ((Training)t->training)->store;
  const PetscInt steps = HycoSnapshotsSteps(t->scene), n_cells = m->model->mesh->n_cells;
  const PetscReal *mu;
  PetscReal *all;
  PetscInt n_par;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, NULL, &n_par, &mu));
  PetscCall(PetscMalloc1(t->sizes[1] * width, &all));
  for (PetscInt k = 0; k < t->n_s; k++) {
    PetscCall(HycoSnapshotsReadRows(store, mu + k / steps * n_par, k % steps, field, 0, t->sizes[1] * width, all));
    for (PetscInt e = 0; e < n_cells; e++)
      PetscCall(PetscArraycpy(value + ((size_t)k * (size_t)n_cells + (size_t)e) * (size_t)width,
                              all + m->model->mesh->cell_whole[e] * width, width));
  }
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Columns by training point and, with a history, by listed time: the same weights serve all of its times. */
static PetscErrorCode RegressionBuild(HycoROM m, HycoReducer t)
{
  Regression r = (Regression)m->model->data;
  const PetscInt n_sigma = t->fom->fe->n_sigma;
  const size_t n_s = (size_t)t->n_s, cells = n_s * (size_t)m->model->mesh->n_cells;

  PetscFunctionBegin;
  r->kernel = ((Training)t->training)->kernel;
  r->n_columns = t->n_s;
  HycoDuplicate(n_s * (size_t)m->model->l, t->VtU, &r->gamma);
  HycoDuplicate(n_s * (size_t)m->model->pairs.n, t->Lambda, &r->Lambda);
  if (t->scene->n_times) {
    PetscCall(PetscMalloc1(cells * (size_t)n_sigma + 1, &r->sigma));
    PetscCall(PetscMalloc1(cells + 1, &r->inelastic));
    PetscCall(ReadCells(t, m, "sigma", n_sigma, r->sigma));
    PetscCall(ReadCells(t, m, "inelastic", 1, r->inelastic));
  }
  PetscCall(HycoROMSetFE(m, HYCO_HYBRID_CONTACT, 0, NULL));
  PetscCall(HycoReducerJudge(t, m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Without errors of its own: at the training points it has none. */
static PetscErrorCode RegressionReport(HycoReducer t, HycoROM m, HycoTraining *out)
{
  PetscFunctionBegin;
  (void)t;
  snprintf(out->summary, sizeof(out->summary),
           "regression: %d snapshots; %d displacement modes, %d contact forces; stresses in %d elements (%.1f %%)\n",
           (int)out->n_samples, (int)out->n_modes, (int)m->model->pairs.n, (int)m->model->mesh->n_cells,
           100 * (double)out->rid_fraction);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- online -- */

static PetscReal RegressionKernel(PetscInt kernel, PetscReal r)
{
  /* All three are conditionally positive definite of order 2 at most: the linear polynomial makes the system
     regular. */
  if (kernel == KERNEL_CUBIC) return r * r * r;
  if (kernel == KERNEL_LINEAR) return r;
  return r > 0 ? r * r * PetscLogReal(r) : 0;
}

/* The system's column of a point: kernels at the training points, 1, the scaled parameters. */
static void RegressionColumn(HycoROM m, const PetscReal mu[], PetscReal column[])
{
  const HycoScene s = m->model->scene;
  const PetscInt n = m->model->n_points, n_par = s->n_parameters;

  for (PetscInt k = 0; k < n; k++)
    column[k] = RegressionKernel(((Regression)m->model->data)->kernel,
                                 HycoEstimatesDistance(s, mu, m->model->points + k * n_par));
  column[n] = 1;
  for (PetscInt p = 0; p < n_par; p++)
    column[n + 1 + p] = (mu[p] - s->lo[p]) / (s->hi[p] > s->lo[p] ? s->hi[p] - s->lo[p] : 1);
}

/* Of the largest singular value of the polynomials at the points: 450 eps; points on one plane do not determine the
   polynomial, and its least norm is taken. */
#define SINGULAR 1e-13

/* The inverse of the system, with the polynomial's columns beside and below the kernels'. */
static PetscErrorCode RegressionInvert(HycoROM m)
{
  const Work w = (Work)m->work;
  const PetscInt n = m->model->n_points, size = n + 1 + m->model->scene->n_parameters;
  PetscReal *A;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1((size_t)size * (size_t)size, &A));
  PetscCall(PetscMalloc1((size_t)size * (size_t)size, &w->inverse));
  for (PetscInt k = 0; k < n; k++) {
    PetscReal *column = A + (size_t)k * (size_t)size;

    RegressionColumn(m, m->model->points + k * m->model->scene->n_parameters, column);
    /* Beside the kernels the same numbers as below them: the system is symmetric, with zeros in its last block. */
    for (PetscInt i = n; i < size; i++) A[(size_t)i * (size_t)size + (size_t)k] = column[i];
  }
  PetscCall(HycoPseudoInverse(size, size, A, SINGULAR, w->inverse));
  PetscCall(PetscFree(A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The system depends on the points alone: it is inverted once, and a prediction is a product. */
static PetscErrorCode SetUp(HycoROM m)
{
  Regression r = (Regression)m->model->data;
  const Work w = (Work)m->work;
  const PetscInt size = m->model->n_points + 1 + m->model->scene->n_parameters;

  PetscFunctionBegin;
  HycoCheck(r->n_columns == m->model->n_points * HycoSnapshotsSteps(m->model->scene), "%s: regression/gamma is damaged",
            m->model->path);
  PetscCall(HycoROMSetUpDefault(m));
  PetscCall(PetscMalloc1(size, &w->right));
  PetscCall(PetscMalloc1(size, &w->weight));
  PetscCall(PetscCalloc1(PetscMax(1, m->model->scene->n_times), &w->step));
  w->largest = 0;
  for (PetscInt k = 0; k < r->n_columns * m->model->pairs.n; k++) w->largest = PetscMax(w->largest, r->Lambda[k]);
  PetscCall(RegressionInvert(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of the work data alone: the model's values stay. */
static PetscErrorCode RegressionReset(HycoROM m)
{
  const Work w = (Work)m->work;

  PetscFunctionBegin;
  HycoFreeAll(&w->inverse, &w->right, &w->weight, &w->step);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The training points' weights at mu. */
static void RegressionWeigh(HycoROM m, const PetscReal mu[])
{
  const Work w = (Work)m->work;
  const PetscInt n = m->model->n_points, size = n + 1 + m->model->scene->n_parameters;

  RegressionColumn(m, mu, w->right);
  for (PetscInt k = 0; k < n; k++) {
    w->weight[k] = 0;
    for (PetscInt i = 0; i < size; i++) w->weight[k] += w->inverse[(size_t)k * (size_t)size + (size_t)i] * w->right[i];
  }
}

/* The weighted sum of the points' columns of listed time `step`, `rows` numbers each; values below `least` are
   raised to it. */
static void RegressionSum(HycoROM m, PetscInt step, PetscInt rows, const PetscReal data[], PetscReal least,
                          PetscReal value[])
{
  const Work w = (Work)m->work;
  const PetscInt steps = HycoSnapshotsSteps(m->model->scene);

  for (PetscInt i = 0; i < rows; i++) value[i] = 0;
  for (PetscInt k = 0; k < m->model->n_points; k++) {
    const PetscReal *column = data + (size_t)(k * steps + step) * (size_t)rows;

    for (PetscInt i = 0; i < rows; i++) value[i] += w->weight[k] * column[i];
  }
  for (PetscInt i = 0; i < rows; i++) value[i] = PetscMax(value[i], least);
}

#define NO_FORCE 1e-12 /* of the largest force in training: 4500 eps, a sum over the training points */

/* Displacement and forces at mu (all variables), with a history at listed time `step`. */
static PetscErrorCode RegressionEvaluate(HycoROM m, PetscInt step, const PetscReal mu[])
{
  const Regression r = (Regression)m->model->data;
  const Work w = (Work)m->work;

  PetscFunctionBegin;
  RegressionSum(m, step, m->model->l, r->gamma, PETSC_MIN_REAL, m->gamma);
  RegressionSum(m, step, m->model->pairs.n, r->Lambda, 0, m->Lambda);
  for (PetscInt k = 0; k < m->model->pairs.n; k++)
    m->Lambda[k] = m->Lambda[k] > NO_FORCE * w->largest ? m->Lambda[k] : 0;
  PetscCall(HycoROMSetSolution(m, mu, NULL, NULL));
  m->beyond_current = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the current listed time, with the fields of its cells. */
static PetscErrorCode RegressionList(HycoROM m, PetscInt step, PetscReal t)
{
  const Regression r = (Regression)m->model->data;
  const Work w = (Work)m->work;
  const PetscInt n_cells = m->model->mesh->n_cells, ns = m->fe->n_sigma;
  HycoStep *s = &w->step[step];
  PetscReal *sigma, *inelastic;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(s, sizeof(*s)));
  s->index = step;
  s->t = t;
  s->kkt = HycoKKTMax(&m->prediction.kkt);
  s->stored = NAN; /* not known */
  PetscCall(HycoTraceAdd(m, t));
  PetscCall(HycoTraceList(m, &sigma, &inelastic));
  RegressionSum(m, step, n_cells * ns, r->sigma, PETSC_MIN_REAL, sigma);
  RegressionSum(m, step, n_cells, r->inelastic, 0, inelastic);
  for (PetscInt e = 0; e < n_cells; e++) {
    s->mises = PetscMax(s->mises, HycoMises(m->fe->dim, sigma + e * ns));
    s->inelastic = PetscMax(s->inelastic, inelastic[e]);
  }
  HycoTraceMeasure(m, s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All listed times; the residuals are the largest of them. */
static PetscErrorCode RegressionPath(HycoROM m, const PetscReal mu[])
{
  const HycoScene s = m->model->scene;
  const Work w = (Work)m->work;
  HycoPrediction *p = &m->prediction;
  HycoReason reason = HYCO_CONVERGED;
  HycoKKT worst = {0};

  PetscFunctionBegin;
  PetscCall(HycoTraceBegin(m));
  for (PetscInt k = 0; k < s->n_times; k++) {
    PetscReal all[HYCO_MAX_PARAMETERS];

    HycoSceneSetTime(s, mu, s->times[k], all);
    PetscCall(RegressionEvaluate(m, k, all));
    PetscCall(RegressionList(m, k, s->times[k]));
    worst.penetration = PetscMax(worst.penetration, p->kkt.penetration);
    worst.adhesion = PetscMax(worst.adhesion, p->kkt.adhesion);
    worst.complementarity = PetscMax(worst.complementarity, p->kkt.complementarity);
    if (p->reason < 0) reason = p->reason;
  }
  p->kkt = worst;
  p->reason = reason;
  m->trace.history = (HycoHistory){.n = s->n_times,
                                   .step = w->step,
                                   .ended = PETSC_TRUE,
                                   .t = s->times[s->n_times - 1],
                                   .why = "",
                                   .newton = "none",
                                   .n_taken = s->n_times,
                                   .taken = s->times};
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Weights once for the whole path: they depend on mu and not on time. */
static PetscErrorCode RegressionSolve(HycoROM m, const PetscReal mu[])
{
  PetscReal all[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  RegressionWeigh(m, mu);
  if (m->model->scene->n_times) {
    PetscCall(RegressionPath(m, mu));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  HycoSceneSetTime(m->model->scene, mu, 0, all);
  PetscCall(RegressionEvaluate(m, 0, all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- file, description -- */

/* Writes to the model file, or reads from it. */
static PetscErrorCode RegressionMove(HycoROM m, HycoH5 h)
{
  Regression r = (Regression)m->model->data;
  const PetscInt n_sigma = HycoStrainSize(m->model->mesh->dim);

  PetscFunctionBegin;
  if (HycoH5Reads(h)) {
    PetscCall(HycoROMLoadWord(m, h, "regression/kernel", kernels, &r->kernel));
    r->n_columns = -1;
  } else
    PetscCall(HycoH5WriteText(h, "regression/kernel", kernels[r->kernel]));
  PetscCall(HycoH5Real(h, "regression/gamma", &r->n_columns, m->model->l, &r->gamma));
  PetscCall(HycoH5Real(h, "regression/Lambda", &r->n_columns, m->model->pairs.n, &r->Lambda));
  if (!m->model->scene->n_times) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoH5Real(h, "regression/sigma", &r->n_columns, m->model->mesh->n_cells * n_sigma, &r->sigma));
  PetscCall(HycoH5Real(h, "regression/inelastic", &r->n_columns, m->model->mesh->n_cells, &r->inelastic));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode RegressionView(HycoROM m, PetscViewer viewer)
{
  const Regression r = (Regression)m->model->data;

  PetscFunctionBegin;
  PetscCall(PetscViewerASCIIPrintf(viewer,
                                   "  regression: %s radial basis functions and a linear polynomial of %d parameters, "
                                   "from %d solutions; %d contact forces, stresses in %d of %d elements\n",
                                   kernels[r->kernel], (int)m->model->scene->n_parameters, (int)r->n_columns,
                                   (int)m->model->pairs.n, (int)m->model->mesh->n_cells, (int)m->model->whole_cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The work data belong to the class. */
static PetscErrorCode RegressionDestroy(HycoROM m)
{
  Regression r = (Regression)m->model->data;

  PetscFunctionBegin;
  HycoFreeAll(&r->gamma, &r->Lambda, &r->sigma, &r->inelastic, &m->model->data);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* No settings: neither modes nor tolerances may be reduced online, since each value is a function of its own. */
static PetscErrorCode RegressionCreate(HycoROM m)
{
  static const HycoROMTraits traits = {.title = "regression",
                                       .work = sizeof(*(Work)NULL),
                                       .settings = HYCO_SETTINGS_NONE,
                                       .history = PETSC_TRUE,
                                       .integrals = PETSC_TRUE};
  static const HycoROMOps ops = {.setup = SetUp,
                                 .reset = RegressionReset,
                                 .solve = RegressionSolve,
                                 .view = RegressionView,
                                 .save = RegressionMove,
                                 .load = RegressionMove,
                                 .destroy = RegressionDestroy};
  Regression r;

  PetscFunctionBegin;
  PetscCall(PetscNew(&r));
  PetscCall(HycoROMSetOps(m, &ops, &traits, r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CreateTrainer(HycoTrainerOps *ops)
{
  PetscFunctionBegin;
  *ops = (HycoTrainerOps){
      .setfromoptions = SetFromOptions, .modes = RegressionModes, .build = RegressionBuild, .report = RegressionReport};
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode RegressionRegister(void)
{
  PetscFunctionBegin;
  PetscCall(HycoROMRegister(HYCO_ROM_REGRESSION, RegressionCreate));
  PetscCall(HycoTrainerRegister(HYCO_ROM_REGRESSION, CreateTrainer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineExtension(regression, RegressionRegister())
