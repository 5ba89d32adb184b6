/*
  Contact forces outside the RID, (41): the nonnegative combination of dual snapshots that agrees with the RID's forces
  and vanishes where the predicted displacement leaves a gap. ([B D - D]_- in the printed paper is [B U - D]_-.) With
  many snapshots (41) has many minimisers, among which round-off would choose: a small weight on the coefficients
  selects one close to the least norm.

  With friction a snapshot has the normal and the tangential forces of all contacts, with one coefficient. Where mu is
  that of the snapshots their combinations stay in Coulomb's cone, which is convex; the path makes them obey the law.
*/
#include <hycoalgorithms.h>
#include <hycohybrid.h>

const char *const HycoReconstructSolvers[] = {"auto", "nnls", "tao", NULL};
enum { SOLVER_AUTO, SOLVER_NNLS, SOLVER_TAO };

/* Explicit least squares: Lawson and Hanson's active set method, or TAO; with auto or tao the other one if the first
   does not converge. */
static PetscErrorCode ReconstructSolve(PetscInt solver, PetscInt m, PetscInt n, const PetscReal A[],
                                       const PetscReal b[], PetscReal c[])
{
  PetscBool solved = PETSC_FALSE;

  PetscFunctionBegin;
  if (solver == SOLVER_TAO) PetscCall(HycoTaoNNLS(m, n, A, b, HYCO_TAO_BNLS, HYCO_RESIDUAL, c, NULL, &solved));
  /* TAO's own word is its recomputed optimality, to HYCO_RESIDUAL. */
  if (solved) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoNNLS(m, n, A, b, c, NULL));
  if (solver != SOLVER_AUTO) PetscFunctionReturn(PETSC_SUCCESS);
  /* By the optimality conditions of (41), not by the method's count of iterations. */
  PetscCall(HycoNNLSCheck(m, n, A, b, c, HYCO_RESIDUAL, NULL, &solved));
  if (!solved) PetscCall(HycoTaoNNLS(m, n, A, b, HYCO_TAO_BNLS, HYCO_RESIDUAL, c, NULL, &solved));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Weight of the combination's norm relative to the largest snapshot force in the RID: it changes forces by 1e-6, its
   square, and keeps round-off from choosing (tests/models/consistency.py). */
#define LEAST_NORM_WEIGHT 1e-3

/* Data that are constant over predictions, without the contacts whose force is zero in every snapshot. */
struct _n_HycoReconstruction {
  PetscInt n, *contact, *row; /* the rows of these contacts: indices in pairs, and of the rows in S_lambda */
  PetscReal *S;               /* n x n_dual column major: these rows of S_lambda */
  PetscReal scale;            /* the largest snapshot force in the RID */
  PetscReal *open, *d, *h, *c;
  HycoWeighted weighted;
};

/* The forces by row, and the first row of each contact (NULL: a row is a contact). */
static PetscReal *ReconstructForces(HycoROM m, const PetscInt **first)
{
  HycoGalerkinFriction friction = ((HycoHybridWork)m->work)->galerkin.friction;
  PetscReal *force = m->Lambda;

  *first = friction ? HycoGalerkinFrictionForces(friction, &force) : NULL;
  return force;
}

/* Keeps the contacts that have a force in some dual snapshot: (41) can give no force to others. S is repacked by those
   rows. The shift, the square of a small force, keeps the normal equations definite where snapshots are dependent. */
static PetscErrorCode SetUp(HycoROM m)
{
  const HycoHybridModel h = (HycoHybridModel)m->model->data;
  const PetscInt *first;
  PetscInt N = m->model->pairs.n;
  HycoReconstruction r;

  PetscFunctionBegin;
  PetscCall(PetscNew(&r));
  ((HycoHybridWork)m->work)->reconstruction = r;
  (void)ReconstructForces(m, &first);
  if (first) N = first[N];
  PetscCall(PetscMalloc1(N, &r->contact));
  PetscCall(PetscMalloc1(N, &r->row));
  for (PetscInt k = 0; k < m->model->pairs.n; k++) {
    const PetscInt begin = first ? first[k] : k, end = first ? first[k + 1] : k + 1;
    PetscBool any = PETSC_FALSE;

    for (PetscInt j = 0; j < h->n_dual; j++) {
      const PetscReal force = h->S_lambda[(size_t)j * (size_t)N + (size_t)begin];

      any = (PetscBool)(any || force != 0);
      /* The scale of forces in the RID, where (41) fits them: the weight on c is relative to it. */
      if (m->model->in_rid[k]) r->scale = PetscMax(r->scale, force);
    }
    for (PetscInt row = begin; any && row < end; row++) {
      r->contact[r->n] = k;
      r->row[r->n++] = row;
    }
  }
  /* Few rows: many contacts of a surface never close in training. */
  PetscCall(PetscMalloc1((size_t)r->n * (size_t)h->n_dual, &r->S));
  for (PetscInt j = 0; j < h->n_dual; j++) {
    for (PetscInt k = 0; k < r->n; k++)
      r->S[(size_t)j * (size_t)r->n + (size_t)k] = h->S_lambda[(size_t)j * (size_t)N + (size_t)r->row[k]];
  }
  PetscCall(PetscMalloc4(r->n, &r->open, r->n, &r->d, r->n, &r->h, h->n_dual, &r->c));
  PetscCall(HycoWeightedCreate(r->n, h->n_dual, r->S, LEAST_NORM_WEIGHT * LEAST_NORM_WEIGHT * r->scale * r->scale,
                               &r->weighted));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The weighted problem keeps a factor of S between predictions, which goes with it. */
PetscErrorCode HycoReconstructionDestroy(HycoReconstruction *reconstruction)
{
  HycoReconstruction r = *reconstruction;

  PetscFunctionBegin;
  if (!r) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoWeightedDestroy(&r->weighted));
  HycoFreeAll(&r->contact, &r->row, &r->S);
  PetscCall(PetscFree4(r->open, r->d, r->h, r->c));
  PetscCall(PetscFree(*reconstruction));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* (41) as explicit least squares: A has a row for each force in the RID, each open contact and each coefficient. */
static PetscErrorCode SolveWrittenOut(HycoROM m, const PetscReal L[])
{
  const HycoHybridModel h = (HycoHybridModel)m->model->data;
  HycoReconstruction r = ((HycoHybridWork)m->work)->reconstruction;
  const PetscInt n = h->n_dual;
  PetscInt rows = n;
  PetscReal *A, *b;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < r->n; k++) rows += m->model->in_rid[r->contact[k]] + (r->open[k] < 0);
  PetscCall(PetscCalloc2((size_t)rows * (size_t)n, &A, rows, &b));
  for (PetscInt j = 0; j < n; j++) {
    const PetscReal *s = r->S + (size_t)j * (size_t)r->n;
    PetscReal *a = A + (size_t)j * (size_t)rows;
    PetscInt row = 0;

    for (PetscInt k = 0; k < r->n; k++) {
      if (m->model->in_rid[r->contact[k]]) {
        b[row] = L[r->row[k]];
        a[row++] = s[k];
      }
      /* [B U - D]- times the combined force: its right-hand side is 0. */
      if (r->open[k] < 0) a[row++] = r->open[k] * s[k];
    }
    /* The small weight on each coefficient, a row each. */
    a[row + j] = LEAST_NORM_WEIGHT * r->scale;
  }
  PetscCall(ReconstructSolve(h->reconstruct_solver, rows, n, A, b, r->c));
  PetscCall(PetscFree2(A, b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The difference of the combination's forces in the RID from the multipliers there, relative to these. */
static PetscReal ReconstructRemainder(HycoROM m, const PetscReal L[], const HycoReconstruction r, PetscInt n_dual)
{
  PetscReal lost = 0, size = 0;

  for (PetscInt i = 0; i < r->n; i++) {
    const PetscReal force = L[r->row[i]];
    PetscReal rest = force;

    /* Outside the RID the combination is the only value there is. */
    if (!m->model->in_rid[r->contact[i]]) continue;
    for (PetscInt j = 0; j < n_dual; j++) rest -= r->c[j] * r->S[(size_t)j * (size_t)r->n + (size_t)i];
    lost += rest * rest;
    size += force * force;
  }
  return size > 0 ? PetscSqrtReal(lost / size) : 0;
}

/* (41): nonnegative least squares for the coefficients of the dual snapshots. The RID's forces shall be met, and
   contacts that the predicted displacements leave open shall have none, weighted by the gap. Forces of the RID
   itself are kept. */
PetscErrorCode HycoHybridReconstruct(HycoROM m)
{
  const HycoHybridModel h = (HycoHybridModel)m->model->data;
  const PetscInt N = m->model->pairs.n, *first;
  PetscReal force = 0, *L = ReconstructForces(m, &first);
  HycoReconstruction r;
  PetscBool solved = PETSC_FALSE;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < m->m; k++) force += m->Lambda[m->contact[k]];
  /* Nothing is outside, nothing to combine, or no force in the RID that says how much. */
  if (m->m == N || !h->n_dual || !m->m || force == 0) PetscFunctionReturn(PETSC_SUCCESS);
  if (!((HycoHybridWork)m->work)->reconstruction) PetscCall(SetUp(m));
  PetscCall(HycoROMComplete(m));
  r = ((HycoHybridWork)m->work)->reconstruction;
  for (PetscInt i = 0; i < r->n; i++) {
    const PetscInt k = r->contact[i];

    r->open[i] = HycoROMAddRow(m, k, -m->rows.gap[k]);
    r->d[i] = (m->model->in_rid[k] ? 1 : 0) + (r->open[i] < 0 ? r->open[i] * r->open[i] : 0);
    r->h[i] = m->model->in_rid[k] ? L[r->row[i]] : 0;
  }
  /* By the normal equations with changing weights: no matrix of all rows is formed. It may stop early, then the
     explicit problem decides. */
  if (h->reconstruct_solver != SOLVER_TAO && r->scale > 0)
    PetscCall(HycoWeightedNNLS(r->weighted, r->d, r->h, HYCO_RESIDUAL, r->c, &solved));
  if (!solved) PetscCall(SolveWrittenOut(m, L));
  m->remainder = PetscMax(m->remainder, ReconstructRemainder(m, L, r, h->n_dual));
  for (PetscInt j = 0; j < h->n_dual; j++) {
    const PetscReal *s = r->S + (size_t)j * (size_t)r->n;

    if (r->c[j] == 0) continue;
    m->spread = PETSC_TRUE;
    for (PetscInt i = 0; i < r->n; i++) {
      if (!m->model->in_rid[r->contact[i]] && !HycoPairsAlone(m->model->scene, &m->pairs, r->contact[i]))
        L[r->row[i]] += r->c[j] * s[i];
    }
  }
  for (PetscInt k = 0; first && k < N; k++) m->Lambda[k] = L[first[k]];
  PetscFunctionReturn(PETSC_SUCCESS);
}
