/*
  The direct solver of the dual form: MUMPS (P. R. Amestoy et al., SIAM J. Matrix Anal. Appl. 23 (2001) 15-41) on

    [ K  Bt ] [x]   [F]
    [ B   0 ] [L] = [D]

  with the forces, and the pinned unknowns of floating bodies, as Schur variables z = (x_pinned, L): they are eliminated
  last, so that one factorisation of K gives the flexibility without solves:

    M = [ K'    A ]      q = (-f', g),     w = q + M z,     w = 0 for x_pinned,  0 <= w complementary to L >= 0
        [ -A^T  S ]

  with S = B K^-1 Bt and g = D - B K^-1 F when nothing is pinned.
*/
#include <hycolinear.h>
#include <dmumps_c.h>

struct _n_HycoDirect {
  MPI_Comm comm;
  PetscMPIInt rank;
  PetscBool alone; /* one process */
  DMUMPS_STRUC_C id;
  PetscBool begun;                           /* a MUMPS instance exists */
  PetscInt n, m, n_pinned, n_schur, *pinned; /* pinned: on every rank, ascending */
  PetscBool symmetric;
  PetscObjectId K_id, B_id; /* matrices whose pattern was analysed */
  PetscObjectState K_pattern, B_pattern;
  PetscReal *rhs, *reduced; /* rank 0: n + m, n_schur */
  VecScatter to_root;
  Vec root;
};

enum { BEGIN = -1, END = -2, ANALYSE = 1, FACTOR = 2, SOLVE = 3 };
#define ICNTL(d, k) ((d)->id.icntl[(k)-1])
#define INFOG(d, k) ((d)->id.infog[(k)-1])

/* MUMPS's single entry point: the job decides. */
static void MumpsCall(HycoDirect d, int job)
{
  d->id.job = job;
  dmumps_c(&d->id);
}

/* Ends the MUMPS instance: pattern, analysis and factor. */
static PetscErrorCode MumpsRelease(HycoDirect d)
{
  PetscFunctionBegin;
  if (d->begun) MumpsCall(d, END);
  d->begun = PETSC_FALSE;
  d->K_id = d->B_id = 0;
  HycoFreeAll(&d->id.irn_loc, &d->id.jcn_loc, &d->id.a_loc, &d->id.perm_in, &d->id.listvar_schur, &d->rhs, &d->reduced);
  HycoDestroyAll(&d->to_root, &d->root);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* MUMPS itself is started by the first analysis. */
PetscErrorCode HycoDirectCreate(MPI_Comm comm, HycoDirect *d)
{
  PetscFunctionBegin;
  PetscCall(PetscNew(d));
  (*d)->comm = comm;
  PetscCallMPI(MPI_Comm_rank(comm, &(*d)->rank));
  (*d)->alone = (PetscBool)(HycoSize(comm) == 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective, as the end of a MUMPS instance is. */
PetscErrorCode HycoDirectDestroy(HycoDirect *d)
{
  PetscFunctionBegin;
  if (!*d) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MumpsRelease(*d));
  HycoFreeAll(&(*d)->pinned, d);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Other pinned unknowns invalidate the analysis. */
PetscErrorCode HycoDirectPin(HycoDirect d, PetscInt n, const PetscInt pinned[])
{
  PetscBool same = (PetscBool)(n == d->n_pinned);

  PetscFunctionBegin;
  /* Both lists are ascending. */
  for (PetscInt k = 0; same && k < n; k++) same = (PetscBool)(pinned[k] == d->pinned[k]);
  if (same) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MumpsRelease(d));
  PetscCall(PetscFree(d->pinned));
  HycoDuplicate(n + 1, pinned, &d->pinned);
  d->n_pinned = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

const PetscInt *HycoDirectPinned(HycoDirect d)
{
  return d->pinned;
}

/* The unknowns of a singular K that become Schur variables. Collective. */
PetscErrorCode HycoDirectPinKernel(HycoDirect d, Mat K)
{
  PetscInt n, *pinned;

  PetscFunctionBegin;
  PetscCall(HycoKernelSize(K, &n));
  PetscCall(PetscMalloc1(n + 1, &pinned));
  PetscCall(HycoKernelPins(K, n, pinned));
  PetscCall(HycoDirectPin(d, n, pinned));
  PetscCall(PetscFree(pinned));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collects the entries of the saddle point in this rank's rows of K, B (and Bt): the lower triangle when symmetric.
   pattern: also their places; values if a_loc exists. */
static PetscErrorCode MumpsEntries(HycoDirect d, Mat A, PetscInt row0, PetscInt col0, PetscBool pattern, MUMPS_INT8 *at)
{
  PetscInt lo, hi;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(A, &lo, &hi));
  for (PetscInt r = lo; r < hi; r++) {
    PetscInt n;
    const PetscInt *cols;
    const PetscScalar *vals;

    PetscCall(MatGetRow(A, r, &n, &cols, &vals));
    for (PetscInt k = 0; k < n; k++) {
      /* The lower triangle: MUMPS would add both entries of a symmetric pair. */
      if (d->symmetric && col0 + cols[k] > row0 + r) continue;
      if (pattern) {
        d->id.irn_loc[*at] = (MUMPS_INT)(row0 + r + 1);
        d->id.jcn_loc[*at] = (MUMPS_INT)(col0 + cols[k] + 1);
      }
      if (d->id.a_loc) d->id.a_loc[*at] = vals[k];
      (*at)++;
    }
    PetscCall(MatRestoreRow(A, r, &n, &cols, &vals));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The second call (values) visits the entries in the same order as the first one (places). */
static PetscErrorCode AllEntries(HycoDirect d, Mat K, Mat Bt, Mat B, PetscBool pattern)
{
  MUMPS_INT8 at = 0;

  PetscFunctionBegin;
  PetscCall(MumpsEntries(d, K, 0, 0, pattern, &at));
  if (B) PetscCall(MumpsEntries(d, B, d->n, 0, pattern, &at));
  /* Symmetric: the lower triangle suffices. */
  if (B && !d->symmetric) PetscCall(MumpsEntries(d, Bt, 0, d->n, pattern, &at));
  d->id.nnz_loc = at;
  if (d->alone) { /* centralised entries: no communication */
    d->id.nnz = at;
    d->id.irn = d->id.irn_loc;
    d->id.jcn = d->id.jcn_loc;
    d->id.a = d->id.a_loc;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Allocates for all entries, including those not used. */
static PetscErrorCode CountEntries(Mat K, Mat Bt, Mat B, size_t *n)
{
  const Mat all[3] = {K, Bt, B};

  PetscFunctionBegin;
  /* MUMPS dislikes empty arrays. */
  *n = 1;
  for (int k = 0; k < 3; k++) {
    MatInfo info;

    if (!all[k]) continue;
    PetscCall(MatGetInfo(all[k], MAT_LOCAL, &info));
    *n += (size_t)info.nz_used;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The elimination order: nested dissection, with pinned unknowns and forces last. On rank 0. Contacts last: they are
   the Schur complement. */
static PetscErrorCode PlaceLast(HycoDirect d, const PetscInt place[])
{
  PetscInt *at, next = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(d->n, &at));
  PetscCall(PetscMalloc1(d->n + d->m, &d->id.perm_in));
  for (PetscInt i = 0; i < d->n; i++) at[place[i]] = i;
  for (PetscInt k = 0; k < d->n_pinned; k++) at[place[d->pinned[k]]] = -1;
  for (PetscInt p = 0; p < d->n; p++) {
    /* Among the rest the order of the dissection stays, which keeps its fill. */
    if (at[p] >= 0) d->id.perm_in[at[p]] = (MUMPS_INT)(++next);
  }
  for (PetscInt k = 0; k < d->n_pinned; k++) d->id.perm_in[d->pinned[k]] = (MUMPS_INT)(++next);
  for (PetscInt k = 0; k < d->m; k++) d->id.perm_in[d->n + k] = (MUMPS_INT)(++next);
  PetscCall(PetscFree(at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Debian's MUMPS has no METIS; its own orders give several times the fill for 3D meshes. */
static PetscErrorCode MumpsOrder(HycoDirect d, Mat K)
{
  PetscInt *place = NULL;

  PetscFunctionBegin;
  if (!d->symmetric) PetscFunctionReturn(PETSC_SUCCESS); /* MUMPS chooses */
  if (d->rank == 0) PetscCall(PetscMalloc1(d->n, &place));
  PetscCall(HycoDissection(d->comm, K, place));
  if (d->rank == 0) PetscCall(PlaceLast(d, place));
  PetscCall(PetscFree(place));
  ICNTL(d, 7) = 1; /* the order is given in PERM_IN */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -hyco_mumps_icntl_K and -hyco_mumps_cntl_K set MUMPS's controls. After the defaults, so that the user's values
   win. */
static PetscErrorCode ReadControls(HycoDirect d)
{
  PetscFunctionBegin;
  for (int k = 1; k <= 58; k++) {
    char name[32];
    PetscInt i = ICNTL(d, k);
    PetscReal r;

    PetscCall(PetscSNPrintf(name, sizeof(name), "-icntl_%d", k));
    PetscCall(PetscOptionsGetInt(NULL, "hyco_mumps_", name, &i, NULL));
    ICNTL(d, k) = (MUMPS_INT)i;
    /* There are 60 integer controls, and fewer real ones. */
    if (k > 15) continue;
    r = d->id.cntl[k - 1];
    PetscCall(PetscSNPrintf(name, sizeof(name), "-cntl_%d", k));
    PetscCall(PetscOptionsGetReal(NULL, "hyco_mumps_", name, &r, NULL));
    d->id.cntl[k - 1] = r;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* sym 1: positive definite, which needs no pivoting; Schur variables are not factored. */
static PetscErrorCode MumpsBegin(HycoDirect d)
{
  PetscFunctionBegin;
  PetscCall(PetscMemzero(&d->id, sizeof(d->id)));
  d->id.comm_fortran = (MUMPS_INT)MPI_Comm_c2f(d->comm);
  d->id.par = 1;
  d->id.sym = d->symmetric ? 1 : 0;
  MumpsCall(d, BEGIN);
  PetscCheck(INFOG(d, 1) >= 0, d->comm, PETSC_ERR_LIB, "MUMPS could not start (INFOG(1) = %d)", (int)INFOG(d, 1));
  d->begun = PETSC_TRUE;
  ICNTL(d, 1) = ICNTL(d, 2) = ICNTL(d, 3) = -1; /* no output */
  ICNTL(d, 4) = 0;
  ICNTL(d, 14) = 50;                  /* workspace increase over the estimate, in per cent */
  ICNTL(d, 18) = d->alone ? 0 : 3;    /* distributed entries */
  ICNTL(d, 28) = 1;                   /* sequential analysis */
  if (!d->symmetric) ICNTL(d, 8) = 0; /* no scaling: it would take a tenth of the time without better residuals */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Declares the Schur variables; their matrix is centralised by rows. The complement is on rank 0, by rows. */
static PetscErrorCode DeclareSchur(HycoDirect d)
{
  PetscFunctionBegin;
  PetscCall(PetscMalloc1(d->n_schur + 1, &d->id.listvar_schur));
  for (PetscInt k = 0; k < d->n_pinned; k++) d->id.listvar_schur[k] = (MUMPS_INT)(d->pinned[k] + 1);
  for (PetscInt k = 0; k < d->m; k++) d->id.listvar_schur[d->n_pinned + k] = (MUMPS_INT)(d->n + k + 1);
  d->id.size_schur = (MUMPS_INT)d->n_schur;
  ICNTL(d, 19) = d->n_schur ? 1 : 0;
  d->id.nprow = d->id.npcol = 1;
  d->id.mblock = d->id.nblock = 100;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After an analysis: a failed one is no pattern. Object and nonzero state: values may change without a new one. */
static PetscErrorCode NotePattern(HycoDirect d, Mat K, Mat B)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectGetId((PetscObject)K, &d->K_id));
  PetscCall(MatGetNonzeroState(K, &d->K_pattern));
  d->B_id = 0;
  d->B_pattern = 0;
  if (!B) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscObjectGetId((PetscObject)B, &d->B_id));
  PetscCall(MatGetNonzeroState(B, &d->B_pattern));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Analysis of the pattern, with the room for right-hand sides on rank 0. */
static PetscErrorCode MumpsAnalyse(HycoDirect d, Mat K, Mat Bt, Mat B)
{
  size_t room;
  Vec x;

  PetscFunctionBegin;
  PetscCall(MumpsBegin(d));
  PetscCall(CountEntries(K, d->symmetric ? NULL : Bt, B, &room));
  PetscCall(PetscMalloc1(room, &d->id.irn_loc));
  PetscCall(PetscMalloc1(room, &d->id.jcn_loc));
  PetscCall(AllEntries(d, K, Bt, B, PETSC_TRUE));
  d->id.n = (MUMPS_INT)(d->n + d->m);
  PetscCall(DeclareSchur(d));
  PetscCall(MumpsOrder(d, K));
  PetscCall(ReadControls(d));
  MumpsCall(d, ANALYSE);
  PetscCheck(INFOG(d, 1) >= 0, d->comm, PETSC_ERR_LIB,
             "MUMPS could not analyse K (INFOG(1) = %d, INFOG(2) = %d); use -hyco_linear iterative, or other "
             "-hyco_mumps_icntl_...",
             (int)INFOG(d, 1), (int)INFOG(d, 2));
  /* Used by the analysis alone. */
  PetscCall(PetscFree(d->id.perm_in));
  PetscCall(MatCreateVecs(K, &x, NULL));
  PetscCall(VecScatterCreateToZero(x, &d->to_root, &d->root));
  PetscCall(VecDestroy(&x));
  if (d->rank == 0) {
    PetscCall(PetscMalloc1(d->n + d->m, &d->rhs));
    PetscCall(PetscMalloc1(d->n_schur + 1, &d->reduced));
  }
  PetscCall(NotePattern(d, K, B));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether K and B have the analysed pattern; releases what is analysed if not. */
static PetscErrorCode SamePattern(HycoDirect d, Mat K, Mat B, PetscBool *same)
{
  PetscObjectId K_id, B_id = 0;
  PetscObjectState K_pattern, B_pattern = 0;

  PetscFunctionBegin;
  PetscCall(PetscObjectGetId((PetscObject)K, &K_id));
  PetscCall(MatGetNonzeroState(K, &K_pattern));
  if (B) {
    PetscCall(PetscObjectGetId((PetscObject)B, &B_id));
    PetscCall(MatGetNonzeroState(B, &B_pattern));
  }
  *same = (PetscBool)(d->begun && d->K_id == K_id && d->B_id == B_id && d->K_pattern == K_pattern &&
                      d->B_pattern == B_pattern);
  /* Values may differ: the analysis depends on the pattern. */
  if (!*same) PetscCall(MumpsRelease(d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* *bytes: MUMPS's estimate for its factor over all ranks, plus the dense Schur complement. Keeps the analysis while
   the patterns are unchanged. Collective. */
PetscErrorCode HycoDirectAnalyse(HycoDirect d, Mat K, Mat Bt, Mat B, PetscBool symmetric, PetscReal *bytes)
{
  PetscBool same = PETSC_FALSE;

  PetscFunctionBegin;
  if (symmetric != d->symmetric) PetscCall(MumpsRelease(d));
  PetscCall(SamePattern(d, K, B, &same));
  if (!same) {
    PetscCall(MatGetSize(K, &d->n, NULL));
    d->m = 0;
    if (B) PetscCall(MatGetSize(B, &d->m, NULL));
    d->symmetric = symmetric;
    d->n_schur = d->n_pinned + d->m;
    PetscCall(MumpsAnalyse(d, K, Bt, B));
  }
  /* INFOG(17): megabytes over all ranks. */
  *bytes = 1e6 * (PetscReal)INFOG(d, 17) + 8. * (PetscReal)d->n_schur * (PetscReal)d->n_schur;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Floating-point operations of the elimination, estimated by the analysis. */
PetscReal HycoDirectOperations(HycoDirect d)
{
  return (PetscReal)d->id.rinfog[0];
}

/* Sends rank 0's Schur complement (by rows; the lower triangle when symmetric) to M on every rank, by columns. The
   sign: MUMPS eliminates -B K^-1 Bt, and S is positive. */
static PetscErrorCode SpreadSchur(HycoDirect d, PetscReal M[])
{
  const size_t n = (size_t)d->n_schur;

  PetscFunctionBegin;
  for (size_t i = 0; i < n && d->rank == 0; i++) {
    for (size_t j = 0; j < i; j++) {
      const PetscReal lower = M[i * n + j], upper = d->symmetric ? lower : M[j * n + i];

      M[j * n + i] = lower;
      M[i * n + j] = upper;
    }
  }
  for (size_t j = 0; j < n && d->rank == 0; j++) {
    for (size_t i = (size_t)d->n_pinned; i < n; i++) M[j * n + i] = -M[j * n + i];
  }
  /* Column by column: counts of MPI are ints. */
  for (size_t j = 0; j < n; j++) HycoBcast(M + j * n, n, MPIU_REAL, d->comm);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Factors, and sets M (n_schur x n_schur, by columns) on every rank. *singular: MUMPS met a zero pivot. Collective. */
PetscErrorCode HycoDirectFactor(HycoDirect d, Mat K, Mat Bt, Mat B, PetscReal M[], PetscBool *singular)
{
  PetscFunctionBegin;
  PetscCheck(d->begun, d->comm, PETSC_ERR_ORDER, "call HycoDirectAnalyse() before HycoDirectFactor()");
  PetscCall(PetscMalloc1((size_t)d->id.nnz_loc + 1, &d->id.a_loc));
  PetscCall(AllEntries(d, K, Bt, B, PETSC_FALSE));
  if (d->rank == 0) d->id.schur = M;
  d->id.schur_lld = (MUMPS_INT)d->n_schur;
  /* Each round has four times the extra workspace. */
  for (;;) {
    MumpsCall(d, FACTOR);
    /* -8, -9 and similar codes: the workspace was underestimated */
    if ((INFOG(d, 1) != -8 && INFOG(d, 1) != -9 && INFOG(d, 1) != -17 && INFOG(d, 1) != -20) || ICNTL(d, 14) > 3000)
      break;
    ICNTL(d, 14) *= 4;
  }
  PetscCall(PetscFree(d->id.a_loc));
  *singular = (PetscBool)(INFOG(d, 1) == -10);
  PetscCheck(INFOG(d, 1) != -13, d->comm, PETSC_ERR_USER,
             "the factor of the stiffness does not fit into memory (%d MB estimated); use -hyco_linear iterative, or "
             "more ranks on more machines",
             (int)INFOG(d, 17));
  PetscCheck(INFOG(d, 1) >= 0 || *singular, d->comm, PETSC_ERR_LIB,
             "MUMPS could not factor K (INFOG(1) = %d, INFOG(2) = %d); use -hyco_linear iterative, or other "
             "-hyco_mumps_icntl_...",
             (int)INFOG(d, 1), (int)INFOG(d, 2));
  if (!*singular) PetscCall(SpreadSchur(d, M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies a distributed vector of n unknowns to rank 0's right-hand side, or back. MUMPS has centralised right-hand
   sides. */
static PetscErrorCode MumpsFetch(HycoDirect d, Vec v)
{
  PetscFunctionBegin;
  PetscCall(HycoScatter(d->to_root, v, d->root));
  if (d->rank) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoVecRead(d->root, d->n, d->rhs));
  d->id.rhs = d->rhs;
  d->id.nrhs = 1;
  d->id.lrhs = d->id.n;
  /* The reduced right-hand side of the Schur unknowns. */
  d->id.redrhs = d->reduced;
  d->id.lredrhs = d->id.size_schur;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* MUMPS returns the solution on rank 0, from which the ranks get their rows. */
static PetscErrorCode MumpsDeliver(HycoDirect d, Vec v)
{
  PetscFunctionBegin;
  if (d->rank == 0) {
    PetscCall(HycoVecWrite(d->root, d->n, d->rhs));
  }
  PetscCall(VecScatterBegin(d->to_root, d->root, v, INSERT_VALUES, SCATTER_REVERSE));
  PetscCall(VecScatterEnd(d->to_root, d->root, v, INSERT_VALUES, SCATTER_REVERSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* part: 0 without Schur variables, 1 reduction to them, 2 expansion from them (ICNTL(26)). If there are none, the
   expansion alone solves. */
static PetscErrorCode MumpsRun(HycoDirect d, int part)
{
  PetscFunctionBegin;
  if (part == 1 && !d->n_schur) PetscFunctionReturn(PETSC_SUCCESS);
  ICNTL(d, 26) = d->n_schur ? part : 0;
  MumpsCall(d, SOLVE);
  PetscCheck(INFOG(d, 1) >= 0, d->comm, PETSC_ERR_LIB, "MUMPS could not solve (INFOG(1) = %d, INFOG(2) = %d)",
             (int)INFOG(d, 1), (int)INFOG(d, 2));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* q of the Schur variables from F and D, by forward substitution. Collective. */
PetscErrorCode HycoDirectReduce(HycoDirect d, const Vec v[], const PetscReal stiffness[], PetscReal least, Vec F,
                                const PetscReal D[], PetscReal q[])
{
  PetscFunctionBegin;
  PetscCall(MumpsFetch(d, F));
  if (d->rank == 0) PetscCall(PetscArraycpy(d->rhs + d->n, D, d->m));
  PetscCall(MumpsRun(d, 1));
  for (PetscInt k = 0; k < d->n_schur && d->rank == 0; k++) q[k] = k < d->n_pinned ? -d->reduced[k] : d->reduced[k];
  HycoBcast(q, d->n_schur, MPIU_REAL, d->comm);
  if (v) PetscCall(HycoMotionClean(d->n_pinned, v, stiffness, d->pinned, F, least, q));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x from the Schur variables z, by back substitution; after HycoDirectReduce(), whose right-hand side MUMPS keeps.
   Collective. */
PetscErrorCode HycoDirectExpand(HycoDirect d, const PetscReal z[], Vec x)
{
  PetscFunctionBegin;
  if (d->rank == 0) PetscCall(PetscArraycpy(d->reduced, z, d->n_schur));
  PetscCall(MumpsRun(d, 2));
  PetscCall(MumpsDeliver(d, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The condensation (ICNTL(26) = 1) of k right-hand sides F, with room for k reduced ones. Collective. */
static PetscErrorCode CondenseMany(HycoDirect d, PetscInt k, const Vec F[], PetscReal **all, PetscReal **reduced)
{
  const size_t rows = (size_t)(d->n + d->m);

  PetscFunctionBegin;
  *all = *reduced = NULL;
  if (d->rank == 0) PetscCall(PetscCalloc1(rows * (size_t)k + 1, all));
  if (d->rank == 0) PetscCall(PetscCalloc1((size_t)d->n_schur * (size_t)k + 1, reduced));
  for (PetscInt j = 0; j < k; j++) {
    PetscCall(MumpsFetch(d, F[j]));
    if (d->rank == 0) PetscCall(PetscArraycpy(*all + rows * (size_t)j, d->rhs, d->n));
  }
  /* Not d->rhs, whose room is for one; the next MumpsFetch() sets it back. */
  d->id.rhs = *all;
  d->id.redrhs = *reduced;
  d->id.nrhs = (MUMPS_INT)k;
  PetscCall(MumpsRun(d, 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One call of MUMPS for all right-hand sides: its substitutions then use matrix products (BLAS 3). */
PetscErrorCode HycoDirectReduceMany(HycoDirect d, PetscInt k, const Vec F[], PetscReal q[])
{
  PetscReal *all, *reduced;

  PetscFunctionBegin;
  if (!k) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CondenseMany(d, k, F, &all, &reduced));
  /* Work on pinned motions has the opposite sign, as in SpreadSchur(). */
  for (PetscInt i = 0; i < k * d->n_schur && d->rank == 0; i++)
    q[i] = i % d->n_schur < d->n_pinned ? -reduced[i] : reduced[i];
  HycoFreeAll(&all, &reduced);
  HycoBcast(q, k * d->n_schur, MPIU_REAL, d->comm);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Condenses the same F again, because MUMPS keeps the reduced right-hand sides of its last call only. */
PetscErrorCode HycoDirectExpandMany(HycoDirect d, PetscInt k, const Vec F[], const PetscReal z[], Vec x[])
{
  const size_t rows = (size_t)(d->n + d->m);
  PetscReal *all, *reduced;

  PetscFunctionBegin;
  if (!k) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CondenseMany(d, k, F, &all, &reduced));
  if (d->rank == 0) PetscCall(PetscArraycpy(reduced, z, (size_t)d->n_schur * (size_t)k));
  /* Phase 2: the expansion from the Schur unknowns. */
  PetscCall(MumpsRun(d, 2));
  for (PetscInt j = 0; j < k; j++) {
    if (d->rank == 0) PetscCall(PetscArraycpy(d->rhs, all + rows * (size_t)j, d->n));
    PetscCall(MumpsDeliver(d, x[j]));
  }
  HycoFreeAll(&all, &reduced);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x = K^-1 r with pinned unknowns 0. Collective. */
PetscErrorCode HycoDirectSolve(HycoDirect d, Vec r, Vec x)
{
  PetscFunctionBegin;
  PetscCall(MumpsFetch(d, r));
  if (d->rank == 0) PetscCall(PetscArrayzero(d->rhs + d->n, d->m));
  PetscCall(MumpsRun(d, 0));
  /* Pinned unknowns are Schur variables, and no part of this solve. */
  for (PetscInt k = 0; k < d->n_pinned && d->rank == 0; k++) d->rhs[d->pinned[k]] = 0;
  PetscCall(MumpsDeliver(d, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}
