/*
  Scan for singular reduced stiffness matrices within the parameters' ranges. The reduced stiffness Vbar[A]^T K[A, A u
  I] Vbar[A u I] is not symmetric: its determinant may change sign between two training points although the model is
  accurate at both; near the zero predictions are arbitrary. A grid over the ranges of the parameters that change the
  stiffness, distributed over the ranks, gives the sign and the smallest singular value. Two sign changes between
  neighbouring points are not detected; a finer grid detects them.
*/
#include <hycoalgorithms.h>
#include <hycogalerkintraining.h>
#include <hycotable.h>

#define LARGEST 2500 /* number of unknowns above which a dense factor at every point takes minutes */

/* The parameters over whose ranges the reduced stiffness is scanned. The others do not change the matrix, and a grid
   over them would repeat it. */
static PetscErrorCode FindParameters(HycoROM m, PetscBool reaches[])
{
  const HycoScene s = m->model->scene;

  PetscFunctionBegin;
  PetscCall(HycoROMSetUp(m));
  HycoSceneReaches(s, reaches);
  for (PetscInt p = 0; p < s->n_parameters; p++) reaches[p] = (PetscBool)(reaches[p] && s->hi[p] > s->lo[p]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Number of points for each parameter that changes the stiffness: the given one; else some hundred in all, fewer if
   the factors of that many unknowns would take more than seconds. */
static PetscErrorCode ChooseGrid(PetscInt asked, PetscInt unknowns, PetscInt n_par, const PetscBool reaches[],
                                 PetscInt *each, PetscInt *n)
{
  const PetscReal most = PetscMin(401, 5e10 / PetscPowReal((PetscReal)unknowns, 3));
  PetscInt q = 0;
  PetscReal all;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < n_par; p++) q += reaches[p];
  /* A number that was given is per parameter. */
  *each = asked;
  if (!asked) *each = q > 12 || !q ? 1 : PetscMax(2, PetscMin(101, (PetscInt)PetscPowReal(most, 1 / (PetscReal)q)));
  all = PetscPowReal((PetscReal)*each, (PetscReal)q);
  /* In reals: the product of many parameters overflows integers. */
  HycoCheck(all <= 1e6, "-hyco_scan %d gives %.0e points for %d parameters; give a smaller number", (int)asked,
            (double)all, (int)q);
  *n = (PetscInt)(all + 0.5);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Point k of the closed grid; the middle of the range for other parameters, and for a grid of one point. */
static void GridPoint(HycoScene s, const PetscBool reaches[], PetscInt each, PetscInt k, PetscReal mu[])
{
  for (PetscInt p = s->n_parameters - 1; p >= 0; p--) {
    mu[p] = (s->lo[p] + s->hi[p]) / 2;
    if (!reaches[p] || each == 1) continue;
    mu[p] = s->lo[p] + (s->hi[p] - s->lo[p]) * (PetscReal)(k % each) / (PetscReal)(each - 1);
    k /= each;
  }
}

/* Points first .. last-1: sign of the determinant, smallest singular value over the largest. */
static PetscErrorCode ScanMine(HycoROM m, const PetscBool reaches[], PetscInt each, PetscInt first, PetscInt last,
                               PetscReal sign[], PetscReal ratio[])
{
  PetscReal mu[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  for (PetscInt k = first; k < last; k++) {
    Mat dense;
    PetscScalar *a;
    PetscInt s;

    GridPoint(m->model->scene, reaches, each, k, mu);
    /* Without a solve, which might not converge just there. */
    PetscCall(HycoGalerkinAssemble(m, mu));
    PetscCall(MatConvert(((HycoGalerkin)m->work)->Kr, MATSEQDENSE, MAT_INITIAL_MATRIX, &dense));
    PetscCall(MatDenseGetArray(dense, &a));
    PetscCall(HycoSingularity(m->n, a, &s, &ratio[k]));
    PetscCall(MatDenseRestoreArray(dense, &a));
    PetscCall(MatDestroy(&dense));
    sign[k] = s;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* "(0.05, 0.17)" */
static void ScanFormatPoint(HycoScene s, const PetscReal mu[], char text[HYCO_LINE])
{
  size_t at = 0;

  for (PetscInt p = 0; p < s->n_parameters && at + 32 < HYCO_LINE; p++)
    at += (size_t)snprintf(text + at, HYCO_LINE - at, "%s%.6g", p ? ", " : "(", (double)mu[p]);
  snprintf(text + at, HYCO_LINE - at, s->n_parameters ? ")" : "()");
}

/* Stores the result of the scan in the model; fails if the determinant changes sign. */
static PetscErrorCode ScanConclude(HycoReducer t, HycoROM m, const PetscBool reaches[], PetscInt each,
                                   const PetscReal sign[], const PetscReal ratio[])
{
  HycoGalerkinModel g = (HycoGalerkinModel)m->model->data;
  HycoScan *s = &g->scan;
  PetscInt positive = 0, worst = 0, change = 0;
  PetscReal mu[HYCO_MAX_PARAMETERS];
  char here[HYCO_LINE], there[HYCO_LINE];

  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n; k++) {
    positive += sign[k] > 0;
    if (ratio[k] < ratio[worst]) worst = k;
    /* The sign of the determinant says which side a point is on, not which side is right: changes count. */
    if (k && !change && sign[k] != sign[0]) change = k;
  }
  /* The smaller of the two groups of signs. */
  s->n_singular = PetscMin(positive, s->n - positive);
  s->smallest = ratio[worst];
  GridPoint(m->model->scene, reaches, each, worst, s->at);
  /* Without a change of sign a small singular value alone is no proof; it is stored and shown. */
  if (t->keep_singular || (!change && ratio[worst] > 0)) PetscFunctionReturn(PETSC_SUCCESS);
  GridPoint(m->model->scene, reaches, each, PetscMax(change - 1, 0), mu);
  ScanFormatPoint(m->model->scene, mu, here);
  GridPoint(m->model->scene, reaches, each, change, mu);
  ScanFormatPoint(m->model->scene, mu, there);
  HycoFailNoModel(
      "the reduced stiffness is singular inside the parameters' ranges: between %s and %s its determinant "
      "changes sign, and predictions near there are arbitrary; enlarge the RID (-hyco_rid_layers 1), change "
      "the modes (-hyco_pod_tol), or keep the model: -hyco_keep_singular",
      here, there);
}

/* Monitors the training paths first .. last-1. The tangents of a path depend on its strains: they are watched where the
   path goes. */
static PetscErrorCode ScanMyPaths(HycoReducer t, HycoROM m, PetscInt first, PetscInt last, PetscInt each,
                                  PetscInt stride, PetscReal sign[], PetscReal ratio[])
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  PetscInt n_par;
  const PetscReal *mu;
  PetscErrorCode ierr = PETSC_SUCCESS;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, NULL, &n_par, &mu));
  /* Only tangents matter: forces outside the RID would double the time. */
  m->reconstruct = PETSC_FALSE;
  for (PetscInt k = first; k < last && !ierr; k++) {
    g->watch = (HycoWatch){stride, sign + k * each, ratio + k * each};
    ierr = HycoROMPredict(m, n_par, mu + k * n_par);
  }
  g->watch = (HycoWatch){0, NULL, NULL};
  m->reconstruct = PETSC_TRUE;
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The result for n tangents, `each` of them along one training path. */
static PetscErrorCode ConcludePaths(HycoReducer t, HycoROM m, PetscInt n, PetscInt each, const PetscReal sign[],
                                    const PetscReal ratio[])
{
  HycoScan *s = &((HycoGalerkinModel)m->model->data)->scan;
  PetscInt positive = 0, worst = 0, change = -1, n_par;
  const PetscReal *mu;
  char here[HYCO_LINE];

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, NULL, &n_par, &mu));
  s->n = 0;
  for (PetscInt k = 0; k < n; k++) {
    /* Strides leave out times, and a path that ends early has none there. */
    if (sign[k] == 0) continue; /* not computed */
    s->n++;
    positive += sign[k] > 0;
    if (ratio[k] < ratio[worst] || sign[worst] == 0) worst = k;
    /* The first tangent of negative sign is the one that the message shows. */
    if (sign[k] < 0 && change < 0) change = k;
  }
  s->n_singular = PetscMin(positive, s->n - positive);
  s->smallest = ratio[worst];
  /* The path is named by its parameters; its time would not help to choose settings. */
  PetscCall(PetscArraycpy(s->at, mu + worst / each * n_par, n_par));
  if (t->keep_singular || !s->n_singular) PetscFunctionReturn(PETSC_SUCCESS);
  ScanFormatPoint(m->model->scene, mu + change / each * n_par, here);
  HycoFailNoModel(
      "the reduced tangent becomes singular along the training path at %s: its determinant changes sign at %d "
      "of %d times, and predictions near there are arbitrary; enlarge the RID (-hyco_rid_layers 1), change the modes "
      "(-hyco_pod_tol), or keep the model: -hyco_keep_singular",
      here, (int)s->n_singular, (int)s->n);
}

/* For a scene with a history: the tangents along the training paths; for long paths and large models some of them. */
static PetscErrorCode ScanPaths(HycoReducer t, HycoROM m)
{
  const PetscInt each = t->scene->n_times + 1;
  PetscInt n, stride;
  PetscReal *sign, *ratio;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, &n, NULL, NULL));
  HycoOnEach(HycoComm(t), HycoROMSetUp(m));
  if (m->n > LARGEST) PetscFunctionReturn(PETSC_SUCCESS);
  /* So that all singular value decompositions together take some 5e10 operations. */
  stride = 1 + (PetscInt)((PetscReal)(n * each) * PetscPowReal((PetscReal)m->n, 3) / 5e10);
  PetscCall(PetscCalloc2(n * each, &sign, n * each, &ratio));
  HycoOnEach(HycoComm(t), ScanMyPaths(t, m, t->rank * n / HycoSize(HycoComm(t)),
                                      (t->rank + 1) * n / HycoSize(HycoComm(t)), each, stride, sign, ratio));
  /* Each path is on one rank, and zero elsewhere: sums collect. */
  HycoAllreduce(sign, n * each, MPIU_REAL, MPI_SUM, HycoComm(t));
  HycoAllreduce(ratio, n * each, MPIU_REAL, MPI_SUM, HycoComm(t));
  HycoOnRoot(HycoComm(t), ConcludePaths(t, m, n * each, each, sign, ratio));
  PetscCall(PetscFree2(sign, ratio));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each rank scans its share of the grid; rank 0 concludes from all signs and ratios. Models with more unknowns than
   LARGEST are not scanned: each point needs a dense factorisation. */
static PetscErrorCode ScanGrid(HycoReducer t, HycoROM m, PetscBool reaches[])
{
  HycoGalerkinModel g = (HycoGalerkinModel)m->model->data;
  PetscInt each = 0;
  PetscReal *sign, *ratio;

  PetscFunctionBegin;
  /* Each rank has the model, and needs its online data for its share. */
  HycoOnEach(HycoComm(t), FindParameters(m, reaches));
  if (m->n > LARGEST) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ChooseGrid(t->scan, m->n, m->model->scene->n_parameters, reaches, &each, &g->scan.n));
  /* Zeros outside the rank's share: the sums below collect. */
  PetscCall(PetscCalloc2(g->scan.n, &sign, g->scan.n, &ratio));
  HycoOnEach(HycoComm(t), ScanMine(m, reaches, each, t->rank * g->scan.n / HycoSize(HycoComm(t)),
                                   (t->rank + 1) * g->scan.n / HycoSize(HycoComm(t)), sign, ratio));
  HycoAllreduce(sign, g->scan.n, MPIU_REAL, MPI_SUM, HycoComm(t));
  HycoAllreduce(ratio, g->scan.n, MPIU_REAL, MPI_SUM, HycoComm(t));
  HycoOnRoot(HycoComm(t), ScanConclude(t, m, reaches, each, sign, ratio));
  PetscCall(PetscFree2(sign, ratio));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The table last, on rank 0: the scan assembles, as it needs points everywhere. The caller broadcasts the model
   with both. */
PetscErrorCode HycoGalerkinFinish(HycoReducer t, HycoROM m, HycoTraining *report)
{
  PetscBool reaches[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  if (t->scene->n_times)
    PetscCall(ScanPaths(t, m));
  else {
    PetscCall(ScanGrid(t, m, reaches));
    /* One rank suffices: a table has few nodes. */
    HycoOnRoot(HycoComm(t), HycoGalerkinTabulate(m, reaches));
  }
  report->scan = ((HycoGalerkinModel)m->model->data)->scan;
  PetscCallMPI(MPI_Bcast(&report->scan, sizeof(report->scan), MPI_BYTE, 0, HycoComm(t)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A sparse factor (bordered paths) is linear in n; then the cells' laws, and the modes' products. In operations of a
   prediction: LU of the reduced matrix, assembly of the RID's cells, products with the modes. Only comparisons of
   attempts use it. */
PetscReal HycoGalerkinCost(HycoReducer t, const HycoAttempt *a)
{
  const PetscReal dim = t->sizes[3],
                  cell = dim == 1   ? 2
                         : dim == 2 ? 8
                                    : 24,
                  l = a->n_modes, n = l + (PetscReal)a->n_fe_dofs;

  return (t->scene->n_times && n > 700 ? 4e5 * n : n * n * n * 2 / 3) + 20 * (PetscReal)a->rid_elements * cell * cell +
         2 * (PetscReal)a->rid_nodes * dim * l * (l + 10);
}
