/*
  Resonance inside the parameters' ranges. The reduced stiffness Vbar[A]^T K[A, A u I] Vbar[A u I] is not symmetric: its
  determinant may change sign between two training points where the model looks good, and between them predictions are
  arbitrary. A grid over the ranges of the parameters that reach the stiffness, spread over the ranks, shows the sign
  and the smallest singular value. Two crossings between neighbouring points go unseen: a finer grid sees them.
*/
#include <hycoalgorithms.h>
#include <hycoreducerimpl.h>
#include <unistd.h>

#define LARGEST 2500 /* unknowns: beyond, a dense factor at every point takes minutes */

/* Which parameters reach the stiffness. */
static PetscErrorCode FindParameters(HycoROM m, PetscBool reaches[])
{
  HycoScene s = m->scene;
  PetscReal mu[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  PetscCall(HycoROMSetUp(m));
  for (PetscInt p = 0; p < s->n_parameters; p++) mu[p] = s->lo[p];
  PetscCall(HycoFESetParameters(m->fe, mu));
  for (PetscInt p = 0; p < s->n_parameters; p++) {
    mu[p] = s->hi[p];
    PetscCall(HycoFESetParameters(m->fe, mu));
    reaches[p] = (PetscBool)(s->hi[p] > s->lo[p] && m->fe->stiffness_changed);
  }
  m->fe->ready = PETSC_FALSE; /* nothing is assembled at these values */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* So many points for each parameter that reaches the stiffness: as asked; else some hundred in all, fewer where the
   factors of that many unknowns would take more than seconds. */
static PetscErrorCode ChooseGrid(PetscInt asked, PetscInt unknowns, PetscInt n_par, const PetscBool reaches[],
                                 PetscInt *each, PetscInt *n)
{
  const PetscReal most = PetscMin(401, 5e10 / PetscPowReal((PetscReal)unknowns, 3));
  PetscInt q = 0;
  PetscReal all;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < n_par; p++) q += reaches[p];
  *each = asked;
  if (!asked) *each = q > 12 || !q ? 1 : PetscMax(2, PetscMin(101, (PetscInt)PetscPowReal(most, 1 / (PetscReal)q)));
  all = PetscPowReal((PetscReal)*each, (PetscReal)q);
  HycoCheck(all <= 1e6, "-hyco_scan %d gives %.0e points for %d parameters; give less", (int)asked, (double)all,
            (int)q);
  *n = (PetscInt)(all + 0.5);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Point k of the closed grid; the middle of the range for what does not matter, and for a grid of one point. */
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

    GridPoint(m->scene, reaches, each, k, mu);
    PetscCall(HycoROMAssemble(m, mu));
    PetscCall(MatConvert(m->Kr, MATSEQDENSE, MAT_INITIAL_MATRIX, &dense));
    PetscCall(MatDenseGetArray(dense, &a));
    PetscCall(HycoSingularity(m->n, a, &s, &ratio[k]));
    PetscCall(MatDenseRestoreArray(dense, &a));
    PetscCall(MatDestroy(&dense));
    sign[k] = s;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* "(0.05, 0.17)" */
static void Say(HycoScene s, const PetscReal mu[], char text[HYCO_LINE])
{
  size_t at = 0;

  for (PetscInt p = 0; p < s->n_parameters && at + 32 < HYCO_LINE; p++)
    at += (size_t)snprintf(text + at, HYCO_LINE - at, "%s%.6g", p ? ", " : "(", (double)mu[p]);
  snprintf(text + at, HYCO_LINE - at, s->n_parameters ? ")" : "()");
}

/* Keeps what the scan found in the model; fails where the determinant changes sign. */
static PetscErrorCode Conclude(HycoReducer t, HycoROM m, const PetscBool reaches[], PetscInt each,
                               const PetscReal sign[], const PetscReal ratio[])
{
  HycoScan *s = &m->scan;
  PetscInt positive = 0, worst = 0, change = 0;
  PetscReal mu[HYCO_MAX_PARAMETERS];
  char here[HYCO_LINE], there[HYCO_LINE];

  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n; k++) {
    positive += sign[k] > 0;
    if (ratio[k] < ratio[worst]) worst = k;
    if (k && !change && sign[k] != sign[0]) change = k;
  }
  s->n_singular = PetscMin(positive, s->n - positive);
  s->smallest = ratio[worst];
  GridPoint(m->scene, reaches, each, worst, s->at);
  if (t->keep_singular || (!change && ratio[worst] > 0)) PetscFunctionReturn(PETSC_SUCCESS);
  GridPoint(m->scene, reaches, each, PetscMax(change - 1, 0), mu);
  Say(m->scene, mu, here);
  GridPoint(m->scene, reaches, each, change, mu);
  Say(m->scene, mu, there);
  HycoFailNoModel(
      "the reduced stiffness is singular inside the parameters' ranges: between %s and %s its determinant "
      "changes sign, and predictions near there are arbitrary; enlarge the RID (-hyco_rid_layers 1), change "
      "the modes (-hyco_pod_tol), or keep the model: -hyco_keep_singular",
      here, there);
}

static PetscErrorCode Scan(HycoReducer t, HycoROM m, PetscBool reaches[])
{
  PetscInt each = 0;
  PetscReal *sign, *ratio;
  PetscMPIInt size;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(HycoComm(t), &size));
  HycoOnEach(HycoComm(t), FindParameters(m, reaches));
  if (m->n > LARGEST) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ChooseGrid(t->scan, m->n, m->scene->n_parameters, reaches, &each, &m->scan.n));
  PetscCall(PetscCalloc2(m->scan.n, &sign, m->scan.n, &ratio));
  HycoOnEach(HycoComm(t),
             ScanMine(m, reaches, each, t->rank * m->scan.n / size, (t->rank + 1) * m->scan.n / size, sign, ratio));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sign, (PetscMPIInt)m->scan.n, MPIU_REAL, MPI_SUM, HycoComm(t)));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, ratio, (PetscMPIInt)m->scan.n, MPIU_REAL, MPI_SUM, HycoComm(t)));
  HycoOnRoot(HycoComm(t), Conclude(t, m, reaches, each, sign, ratio));
  PetscCall(PetscFree2(sign, ratio));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoReducerScan(HycoReducer t, const char candidate[], const char path[], HycoScan *found)
{
  HycoROM m = NULL;
  PetscBool reaches[HYCO_MAX_PARAMETERS];
  PetscErrorCode ierr;
  char message[HYCO_LINE];

  PetscFunctionBegin;
  HycoOnEach(HycoComm(t), HycoROMLoad(candidate, &m));
  PetscCall(HycoCatchBegin());
  ierr = Scan(t, m, reaches);
  if (!ierr && t->rank == 0) ierr = HycoReducerTabulate(m, reaches);
  if (!ierr && t->rank == 0) ierr = HycoROMRewrite(m, path);
  PetscCall(HycoCatchEnd(ierr, message));
  *found = m->scan;
  if (t->rank == 0) (void)unlink(candidate);
  PetscCall(HycoErrorSync(HycoComm(t), ierr, message));
  PetscCall(HycoROMDestroy(&m));
  PetscCallMPI(MPI_Bcast(found, sizeof(*found), MPI_BYTE, 0, HycoComm(t)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
