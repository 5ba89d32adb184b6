/*
  The choice of full-order displacements (section 5.2). Full row rank is not a sufficient criterion: choices that
  satisfy it differ a hundredfold in error. A choice is judged by the condition of its basis and by the model's error on
  the training snapshots.

  rank: the smallest number that gives B[A_lambda, A_c] Vbar[A_c,:] full row rank. Start: the contacts whose balance
  rows K V depend on those of others; then exchanges one by one while the mean training error of u decreases. all: the
  modes' coefficients follow from U[A] by ridge regression, whose ridge is chosen by the same error.
*/
#include <hycoalgorithms.h>
#include <hycogalerkintraining.h>
#include <hycohybrid.h>
#include <hycocontactstate.h>
#include <hycotrainers.h>

#define WORST HYCO_JUDGED_WORST

/* The options of this type. */
typedef struct {
  PetscInt trials; /* rank: largest number of choices that are judged; 0: automatic */
  PetscReal ridge; /* all; < 0: automatic */
} * Training;

/* Declared with the type, so that the help lists them under it. */
static PetscErrorCode SetFromOptions(HycoReducer t)
{
  Training s;

  PetscFunctionBegin;
  PetscCall(PetscNew(&s));
  t->training = s;
  /* Not 0, which is a value of its own: plain least squares. */
  s->ridge = -1;
  PetscObjectOptionsBegin((PetscObject)t);
  PetscCall(HycoOptionsFor("hybrid"));
  PetscCall(HycoOptionsInt(
      "-hyco_hybrid_trials",
      "with -hyco_hybrid rank: number of candidate sets that are judged by their training error (0: from the size)", 0,
      PETSC_MAX_INT / 8, &s->trials, NULL));
  PetscCall(HycoOptionsReal("-hyco_hybrid_ridge",
                            "with -hyco_hybrid all: strength of the ridge regression for the modes (-1: by the "
                            "training error; 0: plain least squares)",
                            -1, 1, &s->ridge, NULL));
  PetscOptionsEnd();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of A_lambda that need a displacement of their own: with friction without tangents that act on none. */
static PetscErrorCode ListRows(HycoROM m, PetscInt *n, PetscInt **row)
{
  HycoGalerkin g = (HycoGalerkin)m->work;

  PetscFunctionBegin;
  *n = 0;
  PetscCall(PetscMalloc1(m->n_L, row));
  for (PetscInt r = 0; r < m->n_L; r++) {
    const PetscBool normal = (PetscBool)(r == HycoGalerkinFirstRow(g, HycoGalerkinContactOf(g, r)));

    if (normal || g->own_rows.start[r + 1] > g->own_rows.start[r]) (*row)[(*n)++] = r;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The unknown of each row of A_lambda that may be full order: its largest entry in A not taken by another. */
static PetscErrorCode FullOrderUnknownsCandidates(HycoROM m, PetscInt n, const PetscInt row[], PetscInt candidate[])
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const PetscInt dim = m->model->mesh->dim;
  PetscInt *sets;
  PetscBool *taken;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(m->model->mesh->n_nodes * dim, &taken, m->model->mesh->n_nodes, &sets));
  PetscCall(HycoROMGetDomain(m, sets));
  for (PetscInt k = 0; k < n; k++) candidate[k] = -1;
  for (PetscInt pass = 0; pass < 2; pass++) { /* first those with slave in A: the others have only shared masters */
    for (PetscInt k = 0; k < n; k++) {
      const PetscInt slave = HycoPairsSlave(&m->model->pairs, m->contact[HycoGalerkinContactOf(g, row[k])]);
      PetscReal best = 0;

      if ((sets[slave] == 2) != (pass == 0)) continue;
      for (PetscInt t = g->own_rows.start[row[k]]; t < g->own_rows.start[row[k] + 1]; t++) {
        const PetscInt dof = g->own_rows.dof[t];

        if (taken[dof] || sets[dof / dim] < 2) continue;
        /* Equal entries: the first, whatever round-off says. */
        if (PetscAbsReal(g->own_rows.value[t]) <= best * (1 + 1e-12)) continue;
        best = PetscAbsReal(g->own_rows.value[t]);
        candidate[k] = dof;
      }
      if (candidate[k] >= 0) taken[candidate[k]] = PETSC_TRUE;
    }
  }
  PetscCall(PetscFree2(taken, sets));
  for (PetscInt k = 0; k < n; k++)
    HycoCheckModel(candidate[k] >= 0,
                   "the contact of node %d has no displacement of its own in A that could stay full order; use "
                   "-hyco_hybrid contact",
                   (int)m->slave_id[m->contact[HycoGalerkinContactOf(g, row[k])]]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Smallest singular value of B[A_lambda, A_c] Vbar[A_c,:] over its largest, for the current choice. */
static PetscErrorCode RowRank(HycoROM m, PetscReal *ratio)
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  Mat dense;
  PetscScalar *b;
  PetscReal smallest, largest;
  PetscInt n, *row;

  PetscFunctionBegin;
  *ratio = 1;
  if (!m->m) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ListRows(m, &n, &row));
  PetscCall(MatConvert(g->Br, MATSEQDENSE, MAT_INITIAL_MATRIX, &dense));
  PetscCall(MatDenseGetArray(dense, &b));
  /* The listed rows, moved to the front. */
  for (PetscInt k = 0; k < n * m->n; k++) b[k] = b[k / n * m->n_L + row[k % n]];
  /* More rows than columns cannot have full row rank, whatever the smallest singular value. */
  PetscCall(HycoExtremeSingularValues(n, m->n, b, &smallest, &largest));
  PetscCall(MatDenseRestoreArray(dense, &b));
  PetscCall(MatDestroy(&dense));
  PetscCall(PetscFree(row));
  *ratio = n > m->n || largest == 0 ? 0 : smallest / largest;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The model at the middle of the parameters' ranges, without full-order unknowns, to inspect its rows. */
static PetscErrorCode FullOrderUnknownsAssembled(HycoReducer t, HycoROM m)
{
  PetscInt n_par;
  const PetscReal *mu;
  PetscReal middle[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, NULL, &n_par, &mu));
  for (PetscInt p = 0; p < n_par; p++) middle[p] = (t->scene->lo[p] + t->scene->hi[p]) / 2;
  m->reconstruct = PETSC_FALSE;
  /* The result does not matter: only rows and matrices are read. */
  PetscCall(HycoROMPredict(m, n_par, middle));
  m->reconstruct = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A V on some rows and columns of A: P[k * l + j] for row k and mode j. */
static PetscErrorCode TimesModes(HycoROM m, Mat A, IS rows, IS columns, PetscReal P[])
{
  Mat Vt, V, part, modes, product;
  IS all;
  const PetscScalar *p;
  PetscInt n;

  PetscFunctionBegin;
  /* V is stored by rows: as a dense matrix of PETSc it is its transpose. */
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, m->model->l, m->fe->n_dof, m->model->V, &Vt));
  PetscCall(MatTranspose(Vt, MAT_INITIAL_MATRIX, &V));
  PetscCall(ISCreateStride(PETSC_COMM_SELF, m->model->l, 0, 1, &all));
  PetscCall(MatCreateSubMatrix(A, rows, columns, MAT_INITIAL_MATRIX, &part));
  PetscCall(MatCreateSubMatrix(V, columns, all, MAT_INITIAL_MATRIX, &modes));
  PetscCall(MatMatMult(part, modes, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &product));
  PetscCall(ISGetLocalSize(rows, &n));
  PetscCall(MatDenseGetArrayRead(product, &p));
  for (PetscInt k = 0; k < n; k++) {
    /* Back to rows, as the rank revealing factorisation wants them. */
    for (PetscInt j = 0; j < m->model->l; j++) P[k * m->model->l + j] = p[j * n + k];
  }
  PetscCall(MatDenseRestoreArrayRead(product, &p));
  HycoDestroyAll(&product, &modes, &part, &all, &V, &Vt);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* B[A_lambda, A_c] V[A_c,:], and the candidates' rows of K V. */
static PetscErrorCode ContactRows(HycoROM m, PetscInt n, const PetscInt row[], const PetscInt candidate[],
                                  PetscReal BV[], PetscReal KV[])
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  IS candidates, unknowns, listed, rows;

  PetscFunctionBegin;
  /* B at the training parameters that FullOrderUnknownsAssembled() has set. */
  PetscCall(HycoGalerkinContactMatrix(m));
  PetscCall(ISCreateStride(PETSC_COMM_SELF, m->fe->n_dof, 0, 1, &unknowns));
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, n, candidate, PETSC_COPY_VALUES, &candidates));
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, n, row, PETSC_COPY_VALUES, &listed));
  PetscCall(ISCreateSubIS(g->sets.is_rows, listed, &rows));
  PetscCall(TimesModes(m, g->B, rows, g->sets.is_Ac, BV));
  PetscCall(TimesModes(m, g->K, candidates, unknowns, KV));
  HycoDestroyAll(&rows, &listed, &candidates, &unknowns);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Numerical rank of B[A_lambda, A_c] V[A_c,:] and the n listed rows that the modes resolve best (first `rank` of
   pivot), by their balance rows K V or by their rows B V weighted with the singular values. */
static PetscErrorCode ResolvedRows(HycoROM m, PetscInt n, const PetscInt row[], const PetscInt candidate[],
                                   PetscBool balance, PetscInt *rank, PetscInt pivot[])
{
  const PetscInt l = m->model->l;
  PetscReal *BV, *KV;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(l * n, &BV, l * n, &KV));
  PetscCall(ContactRows(m, n, row, candidate, BV, KV));
  *rank = 0;
  {
    PetscReal smallest = 0, largest = 1;

    for (PetscInt r = PetscMin(l, n); r > 0 && !*rank;
         r--) { /* the first r modes that are independent on the contacts */
      PetscReal *first;

      PetscCall(PetscMalloc1(r * n, &first));
      for (PetscInt k = 0; k < n; k++) PetscCall(PetscArraycpy(first + k * r, BV + k * l, r));
      PetscCall(HycoExtremeSingularValues(r, n, first, &smallest, &largest));
      if (smallest > 1e-10 * largest) *rank = r;
      PetscCall(PetscFree(first));
    }
  }
  /* A contact that only weak modes resolve is not resolved by a truncated basis. */
  for (PetscInt k = 0; k < n * l; k++) BV[k] *= m->model->sigma[k % l] / m->model->sigma[0];
  PetscCall(HycoPivotColumns(l, n, balance ? KV : BV, *rank, pivot));
  PetscCall(PetscFree2(BV, KV));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A judged set of candidates; stored by its hash, so that none is judged twice. */
typedef struct {
  PetscReal u, lambda, rank;
} Verdict;

/* Of an error: solves with a residual of 1e-8 may be in another order on other numbers of ranks. */
#define SAME_ERROR 1e-6

/* most: a mean error of u above it is of no interest. */
static PetscErrorCode JudgeSet(HycoReducer t, HycoROM m, PetscInt n, const PetscInt dof[], PetscReal most, Verdict *v)
{
  PetscFunctionBegin;
  PetscCall(HycoROMSetFE(m, HYCO_HYBRID_RANK, n, dof));
  PetscCall(FullOrderUnknownsAssembled(t, m));
  PetscCall(RowRank(m, &v->rank));
  v->u = v->lambda = WORST;
  /* A rank-deficient choice is not worth a prediction of every snapshot. */
  if (v->rank > 1e-10) PetscCall(HycoReducerJudgeMeans(t, m, most, &v->u, &v->lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of equal errors the better conditioned, so that round-off does not choose. */
static PetscBool FullOrderUnknownsBetter(const Verdict *a, const Verdict *b)
{
  if (a->u < b->u * (1 - SAME_ERROR)) return PETSC_TRUE;
  return (PetscBool)(a->u <= b->u * (1 + SAME_ERROR) && a->rank > b->rank * (1 + SAME_ERROR));
}

/* Exchanges one of n full-order unknowns for one of N candidates while the error decreases. chosen[k]: candidate k is
   full order. */
static PetscErrorCode FullOrderUnknownsExchange(HycoReducer t, HycoROM m, PetscInt N, PetscInt n,
                                                const PetscInt candidate[], PetscBool chosen[], Verdict *best)
{
  /* a trial solves every snapshot: their number is limited by the work, so that a large model does not take hours */
  const PetscInt limit = ((Training)t->training)->trials ? ((Training)t->training)->trials
                                                         : 1 + (PetscInt)(1e6 / ((PetscReal)t->n_s * (PetscReal)m->n));
  PetscInt trials = 1, n_seen = 0, *dof;
  unsigned long long *seen;
  PetscBool improved = PETSC_TRUE;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(n, &dof, limit + 1, &seen));
  while (improved && trials < limit) {
    PetscInt out = -1, in = -1;
    Verdict verdict, round = *best;

    improved = PETSC_FALSE;
    for (PetscInt i = 0; i < N; i++) {
      for (PetscInt j = 0; j < N && trials < limit; j++) {
        PetscInt k = 0;
        PetscBool past = PETSC_FALSE;
        unsigned long long hash;

        if (!chosen[i] || chosen[j]) continue;
        chosen[i] = PETSC_FALSE;
        chosen[j] = PETSC_TRUE;
        hash = HycoSetHash(N, chosen);
        for (PetscInt s = 0; s < n_seen; s++) past = (PetscBool)(past || seen[s] == hash);
        for (PetscInt c = 0; c < N; c++) {
          if (chosen[c]) dof[k++] = candidate[c];
        }
        /* Each trial costs a solve for every snapshot; sets are recognised by their hash. */
        if (!past) {
          seen[n_seen++] = hash;
          PetscCall(HycoReducerTell(t, "choices of full-order displacements", trials, limit));
          trials++;
          PetscCall(JudgeSet(t, m, n, dof, round.u * (1 + SAME_ERROR), &verdict));
          if (FullOrderUnknownsBetter(&verdict, &round)) {
            round = verdict;
            out = i;
            in = j;
          }
        }
        chosen[i] = PETSC_TRUE;
        chosen[j] = PETSC_FALSE;
      }
    }
    if (out >= 0) {
      chosen[out] = PETSC_FALSE;
      chosen[in] = PETSC_TRUE;
      *best = round;
      improved = PETSC_TRUE;
    }
  }
  PetscCall(PetscFree2(dof, seen));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One start, then exchanges. Starts 0 and 1: the contacts that the modes do not resolve, by balance rows and by
   contact rows; later ones: the same number, evenly distributed. */
static PetscErrorCode SearchFrom(HycoReducer t, HycoROM m, PetscInt start, PetscInt *n, PetscInt dof[],
                                 Verdict *verdict)
{
  PetscInt rank = 0, N, *row, *candidate, *pivot;
  PetscBool *chosen;

  PetscFunctionBegin;
  /* No full-order unknowns: the rank of (38) is that of the modes alone. */
  PetscCall(HycoROMSetFE(m, HYCO_HYBRID_RANK, 0, NULL));
  PetscCall(FullOrderUnknownsAssembled(t, m));
  PetscCall(ListRows(m, &N, &row));
  PetscCall(PetscMalloc3(N, &candidate, N, &pivot, N, &chosen));
  PetscCall(FullOrderUnknownsCandidates(m, N, row, candidate));
  PetscCall(ResolvedRows(m, N, row, candidate, (PetscBool)(start == 0), &rank, pivot));
  PetscCall(PetscFree(row));
  for (PetscInt k = 0; k < N; k++) chosen[k] = (PetscBool)(start < 2);
  /* A pivot is a contact that the modes resolve: it needs no displacement of its own. */
  for (PetscInt k = 0; k < rank && start < 2; k++) chosen[pivot[k]] = PETSC_FALSE;
  for (PetscInt k = 0; k < N - rank && start >= 2; k++) chosen[(k * N / (N - rank) + start - 2) % N] = PETSC_TRUE;
  /* First the start is judged, then what the exchanges have left is listed. */
  for (PetscInt pass = 0; pass < 2; pass++) {
    *n = 0;
    for (PetscInt k = 0; k < N; k++) {
      if (chosen[k]) dof[(*n)++] = candidate[k];
    }
    if (pass) break;
    PetscCall(JudgeSet(t, m, *n, dof, PETSC_INFINITY, verdict));
    if (*n && *n < N) PetscCall(FullOrderUnknownsExchange(t, m, N, *n, candidate, chosen, verdict));
  }
  PetscCall(PetscFree3(candidate, pivot, chosen));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The best result of several starts; of one if a trial is expensive. Exchanges end in local minima: several starts
   where trials are cheap. */
static PetscErrorCode ChooseRank(HycoReducer t, HycoROM m, Verdict *best)
{
  const PetscInt room = HycoContactStateCountRows(t->scene, &m->model->pairs, m->model->mesh->dim),
                 starts = (PetscReal)t->n_s * (PetscReal)m->model->l < 1e4 ? 5 : 1;
  PetscInt n = 0, other = 0, *dof, *trial;
  Verdict verdict;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(room, &dof, room, &trial));
  for (PetscInt start = 0; start < starts; start++) {
    PetscCall(SearchFrom(t, m, start, &other, trial, &verdict));
    /* The first start holds unless another is better: an order without ties by chance. */
    if (start && !FullOrderUnknownsBetter(&verdict, best)) continue;
    *best = verdict;
    n = other;
    PetscCall(PetscArraycpy(dof, trial, n));
  }
  PetscCall(HycoROMSetFE(m, HYCO_HYBRID_RANK, n, dof));
  PetscCall(PetscFree2(dof, trial));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks nodes of the model's mesh that belong to a contact, on moved surfaces at any parameters. */
static PetscErrorCode MarkContact(HycoReducer t, HycoROM m, PetscBool contact[])
{
  const PetscInt n = t->fom->surface->n_nodes;
  PetscBool *met;

  PetscFunctionBegin;
  /* Nothing moves: the pairs are the contact nodes. */
  if (!t->fom->searches) {
    HycoPairsMark(&m->model->pairs, contact);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscCalloc1(n, &met));
  HycoPairsMark(&t->met.rows, met);
  for (PetscInt i = 0; i < n; i++) {
    /* Masters over the whole ranges, not only at one point. */
    if (met[i]) contact[t->surface_node[i]] = PETSC_TRUE;
  }
  PetscCall(PetscFree(met));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The free unknowns of the nodes of A: all, or those of contact nodes. Fixed ones have no equation, and their values
   are in the lifting. */
static PetscErrorCode FreeUnknowns(HycoReducer t, HycoROM m, PetscBool contact_only, PetscInt *n, PetscInt dof[])
{
  const PetscInt dim = m->model->mesh->dim, *node;
  PetscInt n_A;
  PetscBool *contact;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(m->model->mesh->n_nodes, &contact));
  PetscCall(MarkContact(t, m, contact));
  *n = 0;
  PetscCall(ISGetLocalSize(m->model->inside, &n_A));
  PetscCall(ISGetIndices(m->model->inside, &node));
  for (PetscInt k = 0; k < n_A * dim; k++) {
    /* Nodes of A in ascending order, so that fe_dof is too. */
    const PetscInt i = node[k / dim] * dim + k % dim;

    if (!t->fixed[i] && (contact[i / dim] || !contact_only)) dof[(*n)++] = i;
  }
  PetscCall(ISRestoreIndices(m->model->inside, &node));
  PetscCall(PetscFree(contact));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Number of successive worse ridges that end the race of paths: above the best the errors grow with the ridge. */
#define WORSE_RIDGES 3

/* The ridge for paths: each trial takes seconds, and some of the paths suffice to reject a ridge that is worse than
   the best. Fails if an attempt of the search has training errors of one half with any ridge. */
static PetscErrorCode EarlyStopRidges(HycoReducer t, HycoROM m, PetscReal *strength)
{
  HycoJudged *judged, *its;
  PetscInt n, in_a_row = 0;
  PetscReal least = PETSC_MAX_REAL;
  PetscBool any = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, &n, NULL, NULL));
  PetscCall(PetscMalloc2(n, &judged, n, &its));
  for (PetscReal ridge = 1e-14; ridge < 1e-5 && in_a_row < WORSE_RIDGES; ridge *= 10) {
    PetscReal u;
    PetscBool lost;

    /* A new regression of the modes on A's unknowns; the reduced matrix follows. */
    PetscCall(HycoGalerkinSetRidge(m, ridge));
    PetscCall(HycoReducerJudgeEarlyStop(t, m, any ? its : NULL, t->trying ? HYCO_USELESS_ERROR : PETSC_INFINITY, judged,
                                        &u, &lost));
    /* Errors have one minimum over the ridge as a rule: after WORSE_RIDGES worse ones in a row the search ends. */
    in_a_row += any;
    if (lost || !(u < least)) continue;
    /* The errors of the best so far, by path: the next ridge races against them. */
    PetscCall(PetscArraycpy(its, judged, n));
    least = u;
    *strength = ridge;
    in_a_row = 0;
    any = PETSC_TRUE;
  }
  PetscCall(PetscFree2(judged, its));
  HycoCheckModel(any, "the model misses its own training displacements by half or more");
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define RIDGES 10

/* The ridge with the least mean training error. */
static PetscErrorCode TryRidges(HycoReducer t, HycoROM m, PetscReal *strength)
{
  PetscReal least = PETSC_MAX_REAL, u, lambda;
  PetscInt tried = 0;

  PetscFunctionBegin;
  *strength = 0;
  for (PetscReal ridge = 1e-14; ridge < 1e-5; ridge *= 10) {
    PetscCall(HycoReducerTell(t, "ridges", tried++, RIDGES));
    PetscCall(HycoGalerkinSetRidge(m, ridge));
    /* Ends early when the mean exceeds the least so far. */
    PetscCall(HycoReducerJudgeMeans(t, m, least, &u, &lambda));
    if (!(u < least)) continue;
    least = u;
    *strength = ridge;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes all of A, with the ridge of the least training error. Without an interface there is no regression. */
static PetscErrorCode ChooseAll(HycoReducer t, HycoROM m, PetscInt n, const PetscInt dof[])
{
  const PetscReal given = ((Training)t->training)->ridge;
  PetscReal strength = given >= 0 ? given : t->ridge;
  PetscInt n_rid, n_A;

  PetscFunctionBegin;
  PetscCall(HycoROMSetFE(m, HYCO_HYBRID_ALL, n, dof));
  PetscCall(ISGetLocalSize(m->model->rid, &n_rid));
  PetscCall(ISGetLocalSize(m->model->inside, &n_A));
  if (n_rid == n_A) PetscFunctionReturn(PETSC_SUCCESS);
  if (strength < 0) PetscCall(t->scene->n_times ? EarlyStopRidges(t, m, &strength) : TryRidges(t, m, &strength));
  PetscCall(HycoGalerkinSetRidge(m, strength));
  /* The attempt's choice: the final model is built with it, without another race. */
  if (t->trying) t->ridge = strength;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Chooses the full-order displacements; sets the training errors with this choice. Rank 0. `auto` takes the
   contacts' displacements, and all of A only where A has no others. */
static PetscErrorCode ChooseUnknowns(HycoReducer t, HycoROM m)
{
  PetscInt n_all, n_contact, *all, *contact;
  HycoHybrid kind = t->hybrid;
  Verdict v = {0, 0, 1};

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(m->model->mesh->n_nodes * m->model->mesh->dim, &all,
                         m->model->mesh->n_nodes * m->model->mesh->dim, &contact));
  PetscCall(FreeUnknowns(t, m, PETSC_FALSE, &n_all, all));
  PetscCall(FreeUnknowns(t, m, PETSC_TRUE, &n_contact, contact));
  /* A search limits the size of dense matrices by it. */
  t->n_unknowns = n_all;
  HycoCheckModel(n_all, "the RID has no interior node; enlarge it: -hyco_rid_layers 1, or smaller tolerances");
  if (!n_contact && kind != HYCO_HYBRID_ALL)
    kind = HYCO_HYBRID_CONTACT; /* no contact in the RID: plain hyper-reduction (31) */
  if (kind == HYCO_HYBRID_AUTO) kind = n_contact < n_all ? HYCO_HYBRID_CONTACT : HYCO_HYBRID_ALL;
  if (kind == HYCO_HYBRID_CONTACT && n_contact == n_all && n_contact) {
    HycoFailNoModel("-hyco_hybrid contact leaves no equation for the modes, because every unknown of A belongs to a "
                    "contact; use rank, all or auto");
  }
  /* n_all^2 reals and n_all^3 operations for each factor. */
  HycoCheckModel(kind != HYCO_HYBRID_ALL || !t->most_full_order || n_all <= t->most_full_order,
                 "the RID has %d unknowns, too many to keep all of them full order in a dense matrix; use -hyco_hybrid "
                 "contact or rank",
                 (int)n_all);
  if (kind == HYCO_HYBRID_RANK) PetscCall(ChooseRank(t, m, &v));
  if (kind == HYCO_HYBRID_ALL) PetscCall(ChooseAll(t, m, n_all, all));
  if (kind == HYCO_HYBRID_CONTACT) PetscCall(HycoROMSetFE(m, HYCO_HYBRID_CONTACT, n_contact, contact));
  PetscCall(HycoROMSetUp(m));
  HycoCheckModel(
      !HycoSceneHasFriction(t->scene) || m->n_L <= m->n,
      "the RID's contacts have %d normal and tangential forces, and the model only %d displacements to balance them; "
      "use -hyco_hybrid contact, or a larger RID (-hyco_rid_layers)",
      (int)m->n_L, (int)m->n);
  /* After the choice: training errors in the file are those of the final model. */
  PetscCall(HycoReducerJudge(t, m));
  PetscCall(PetscFree2(all, contact));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The forces of column k by row of the contacts at fe's parameters: friction is stored as a vector. */
static PetscErrorCode ReadRows(HycoReducer t, HycoContactState state, PetscInt k, PetscReal force[], PetscReal S[])
{
  const PetscInt N = state->n, steps = HycoSnapshotsSteps(t->scene);
  PetscReal *component;
  const PetscReal *mu;
  PetscInt n_par;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->columns, NULL, &n_par, &mu));
  PetscCall(PetscMalloc1(N, &component));
  for (PetscInt c = 0; c < 3; c++) {
    PetscCall(
        HycoSnapshotsReadRows(t->store, mu + k / steps * n_par, k % steps, HycoSnapshotFriction[c], 0, N, component));
    for (PetscInt i = 0; i < N; i++) force[3 * i + c] = component[i];
  }
  PetscCall(PetscFree(component));
  HycoContactStateForces(state, t->Lambda + (size_t)k * (size_t)N, force, S);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* HycoReducerDualSnapshots() with tangential forces. */
static PetscErrorCode FillRows(HycoReducer t, HycoROM m, HycoFE fe, HycoContactState state)
{
  HycoHybridModel h = (HycoHybridModel)m->model->data;
  const PetscInt N = state->n, n = state->row[N];
  PetscReal mu[HYCO_MAX_PARAMETERS], *force;
  HycoRows rows = {0};

  PetscFunctionBegin;
  h->n_dual = 0;
  PetscCall(PetscMalloc1((size_t)n * (size_t)t->n_s + 1, &h->S_lambda));
  PetscCall(PetscMalloc1(3 * N, &force));
  for (PetscInt k = 0; k < t->n_s; k++) {
    PetscReal size = 0;

    for (PetscInt i = 0; i < N; i++) size += t->Lambda[(size_t)k * (size_t)N + (size_t)i];
    if (!(size > 0)) continue;
    PetscCall(HycoReducerColumn(t, k, mu));
    PetscCall(HycoFESetParameters(fe, mu));
    PetscCall(HycoContactStateRows(state, fe, &rows)); /* the tangents */
    PetscCall(ReadRows(t, state, k, force, h->S_lambda + (size_t)h->n_dual++ * (size_t)n));
  }
  PetscCall(HycoRowsDestroy(&rows));
  PetscCall(PetscFree(force));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode FrictionSnapshots(HycoReducer t, HycoROM m)
{
  HycoPairs pairs;
  HycoContactState state;
  HycoFE fe;

  PetscFunctionBegin;
  PetscCall(HycoROMTakePairs(&m->model->pairs, &pairs));
  PetscCall(HycoFECreateSurface(t->scene, m->model->mesh->dm, &fe));
  PetscCall(HycoContactStateCreate(PETSC_COMM_SELF, t->scene, &pairs, fe->dim, &state));
  HycoFinally(FillRows(t, m, fe, state), PetscCall(HycoContactStateDestroy(&state)); PetscCall(HycoFEDestroy(&fe));
              PetscCall(HycoROMDropPairs(&pairs)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The dual snapshots first: judging does not reconstruct, but the file and predictions need them. */
static PetscErrorCode FullOrderUnknownsBuild(HycoROM m, HycoReducer t)
{
  HycoHybridModel h = (HycoHybridModel)m->model->data;

  PetscFunctionBegin;
  if (HycoSceneHasFriction(t->scene))
    PetscCall(FrictionSnapshots(t, m));
  else
    PetscCall(HycoReducerDualSnapshots(t, &h->n_dual, &h->S_lambda));
  PetscCall(ChooseUnknowns(t, m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The default type. */
static PetscBool FullOrderUnknownsIsOffered(HycoReducer t, PetscBool targets, size_t length, char why[])
{
  (void)t, (void)targets, (void)length, (void)why;
  return PETSC_TRUE;
}

/* The text that training prints; a report has the same numbers one by one. */
static PetscErrorCode FullOrderUnknownsReport(HycoReducer t, HycoROM m, HycoTraining *r)
{
  PetscFunctionBegin;
  (void)t, (void)m;
  snprintf(r->summary, sizeof(r->summary),
           "%d snapshots; modes: %d displacement, %d stress, %d force, %d dual\n"
           "RID: %d elements (%.1f %%), %d nodes, %d in A, %d contacts; %d full-order displacements\n",
           (int)r->n_samples, (int)r->n_modes, (int)r->n_stress_modes, (int)r->n_force_modes, (int)r->n_dual_modes,
           (int)r->rid_elements, 100 * (double)r->rid_fraction, (int)r->rid_nodes, (int)r->rid_a_nodes,
           (int)r->rid_contacts, (int)r->n_fe_dofs);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The modes are those of the snapshots: there is no function of its own for them. */
PetscErrorCode HycoTrainerCreate_Hybrid(HycoTrainerOps *ops)
{
  PetscFunctionBegin;
  *ops = (HycoTrainerOps){.setfromoptions = SetFromOptions,
                          .build = FullOrderUnknownsBuild,
                          .finish = HycoGalerkinFinish,
                          .report = FullOrderUnknownsReport,
                          .cost = HycoGalerkinCost,
                          .offers = FullOrderUnknownsIsOffered};
  PetscFunctionReturn(PETSC_SUCCESS);
}
