/*
  The derivative of the solution z = (x, L) of a dense complementarity problem: w = q + M z, w = 0 in the rows of x,
  0 <= L complementary to w in the others. Where q changes by q', closed contacts keep w' = 0 and open ones L' = 0. For
  contacts with neither force nor gap, which are undecided, it is one-sided: 0 <= L' complementary to w' >= 0, a problem
  of these contacts alone once the others are eliminated.
*/
#include <hycolcp.h>
#include <petscblaslapack.h>

/* Of the largest gap, what a force moves by its own flexibility: 4.5e5 eps of the terms of a gap; a smaller force may
   be the round-off of gaps (tests/fom/gradients.py, a floating body just above the load 0). */
#define OWN_GAP 1e-10
/* Of a contact's flexibility, what closed contacts leave of it: 100 times HYCO_DEPENDENT, as each product with the
   inverse loses two digits. */
#define DEPENDENT_ROW 1e-10
/* Of its terms, the change of a gap: what is left of 16 digits after a factor of condition 1e7. */
#define GAP_RATE_ROUND_OFF 1e-9
/* Of the largest pivot of the scaled matrix, the least one: 45 eps, as the entries of the scaled matrix are at most 1.
   */
#define REGULAR 1e-14
/* Of a motion's largest entry of all contacts, those of the set: less is the round-off of normals
   (tests/fom/gradients.py, bodies barely held). */
#define FREE_ENTRY 1e-9
/* Of the largest force: 45,000 eps; where closed contacts do not determine the solution, a force above it closes its
   own (tests/fom/gradients.py, bodies barely held). */
#define SMALL_CLOSES 1e-11

struct _n_HycoTangent {
  PetscInt p, n;             /* unknowns x; contacts */
  PetscInt n_set, *set;      /* x and the closed contacts */
  PetscInt n_open, *open;    /* undecided contacts that may close */
  PetscReal *lu, *scale;     /* n_set square, column major, of the scaled matrix; n_set */
  PetscReal *S, *out, *into; /* Schur complement of the undecided; M_open,set; M_set^-1 M_set,open; by columns */
  PetscReal *v;              /* n_set */
  PetscBLASInt *ipiv;
};

/* NULL-safe; also of one whose creation found a singular set. */
PetscErrorCode HycoTangentDestroy(HycoTangent *tangent)
{
  HycoTangent t = *tangent;

  PetscFunctionBegin;
  if (!t) PetscFunctionReturn(PETSC_SUCCESS);
  HycoFreeAll(&t->set, &t->open, &t->lu, &t->scale, &t->S, &t->out, &t->into, &t->v, &t->ipiv, tangent);
  PetscFunctionReturn(PETSC_SUCCESS);
}

enum { OPEN, UNDECIDED, CLOSED };

/* By force and gap; M: of p unknowns and the contacts. A force counts if it is not small beside the largest, and its
   flexibility moves the gap by more than round-off. */
static void TangentStates(PetscInt p, PetscInt n, const PetscReal M[], const PetscReal L[], const PetscReal w[],
                          PetscReal size, PetscInt state[])
{
  PetscReal most = 0;

  for (PetscInt i = 0; i < n; i++) most = PetscMax(most, L[i]);
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal flexibility = M[(size_t)(p + i) * (size_t)(p + n) + (size_t)(p + i)];
    /* A contact whose own row is flexible must press noticeably: otherwise it may open for a small change. */
    const PetscBool closed =
        (PetscBool)(L[i] > HYCO_UNDECIDED * most && (flexibility <= 0 || L[i] * flexibility > OWN_GAP * size));

    state[i] = closed ? CLOSED : w[i] <= HYCO_UNDECIDED * size ? UNDECIDED : OPEN;
  }
}

/* Where the closed contacts do not determine the solution, small forces do: those above round-off close theirs. Whether
   there are some. */
static PetscBool CloseMore(PetscInt n, const PetscReal L[], PetscInt state[])
{
  PetscReal most = 0;
  PetscBool more = PETSC_FALSE;

  for (PetscInt i = 0; i < n; i++) most = PetscMax(most, L[i]);
  for (PetscInt i = 0; i < n; i++) {
    if (state[i] != UNDECIDED || !(L[i] > SMALL_CLOSES * most)) continue;
    state[i] = CLOSED;
    more = PETSC_TRUE;
  }
  return more;
}

/* A looser question than the state: contacts for which it is false need no row of the derivative. */
PetscBool HycoTangentMayClose(PetscReal L, PetscReal w, PetscReal size)
{
  return (PetscBool)(L > 0 || w <= HYCO_UNDECIDED * size);
}

/* Whether no contact of the set acts on x[j], unlike others. */
static PetscBool IsFree(HycoTangent t, PetscBool rigid, const PetscReal M[], PetscInt j)
{
  const size_t n = (size_t)(t->p + t->n);
  const PetscInt first = rigid ? t->p : 0; /* beyond what is round-off between motions; of the set too */
  PetscReal all = 0, set = 0;

  for (size_t i = (size_t)first; i < n; i++) all = PetscMax(all, PetscAbsReal(M[i * n + (size_t)j]));
  for (PetscInt i = first; i < t->n_set; i++) set = PetscMax(set, PetscAbsReal(M[(size_t)t->set[i] * n + (size_t)j]));
  return (PetscBool)(set <= FREE_ENTRY * all);
}

/* The columns of M of the set, scaled to entries of order 1: the rows of x and of contacts have different units. */
static PetscErrorCode TangentFactor(HycoTangent t, PetscBool rigid, const PetscReal M[], PetscBool *regular)
{
  const size_t n = (size_t)(t->p + t->n), m = (size_t)t->n_set;
  PetscBLASInt mb, info;
  PetscReal least = PETSC_MAX_REAL, most = 0, usual = 0;

  PetscFunctionBegin;
  *regular = PETSC_TRUE;
  if (!m) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscBLASIntCast(t->n_set, &mb));
  for (size_t j = 0; j < m; j++) {
    const PetscReal diagonal =
        rigid && j < (size_t)t->p ? 0 : PetscAbsReal(M[(size_t)t->set[j] * n + (size_t)t->set[j]]);

    t->scale[j] = diagonal > 0 ? 1 / PetscSqrtReal(diagonal) : 0;
    if (j >= (size_t)t->p) usual = PetscMax(usual, t->scale[j]);
  }
  /* A contact at a node that a motion alone moves has no flexibility of its own: as the others, so that the motion's
     row sees it. */
  for (size_t j = (size_t)t->p; j < m; j++) t->scale[j] = t->scale[j] > 0 ? t->scale[j] : usual;
  for (size_t j = 0; j < m; j++) { /* without a diagonal: by the largest entry of the row, once the others are scaled */
    PetscReal largest = 0;

    if (t->scale[j] > 0) continue;
    for (size_t i = 0; i < m; i++)
      largest =
          PetscMax(largest, PetscAbsReal(M[(size_t)t->set[i] * n + (size_t)t->set[j]]) * PetscMax(t->scale[i], 0));
    /* Negative marks a row scaled here, so that it does not count as scaled for the others of the loop. */
    t->scale[j] = largest > 0 ? -1 / largest : -1;
  }
  for (size_t j = 0; j < m; j++) t->scale[j] = PetscAbsReal(t->scale[j]);
  for (PetscInt j = 0; j < t->p && *regular; j++) *regular = (PetscBool)!IsFree(t, rigid, M, j);
  if (!*regular) PetscFunctionReturn(PETSC_SUCCESS);
  for (size_t j = 0; j < m; j++) {
    for (size_t i = 0; i < m; i++) {
      /* What M has between rigid motions is round-off. */
      const PetscReal entry = rigid && PetscMax(i, j) < (size_t)t->p ? 0 : M[(size_t)t->set[j] * n + (size_t)t->set[i]];

      t->lu[j * m + i] = entry * t->scale[i] * t->scale[j];
    }
  }
  LAPACKgetrf_(&mb, &mb, t->lu, &mb, t->ipiv, &info);
  for (size_t j = 0; j < m; j++) {
    least = PetscMin(least, PetscAbsReal(t->lu[j * m + j]));
    most = PetscMax(most, PetscAbsReal(t->lu[j * m + j]));
  }
  *regular = (PetscBool)(!info && least > REGULAR * most);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x = M_set^-1 x */
static void TangentSolve(HycoTangent t, PetscReal x[])
{
  const PetscBLASInt m = (PetscBLASInt)t->n_set, one = 1;
  PetscBLASInt info;

  /* No unknown and no closed contact. */
  if (!m) return;
  for (PetscBLASInt i = 0; i < m; i++) x[i] *= t->scale[i];
  LAPACKgetrs_("N", &m, &one, t->lu, &m, t->ipiv, x, &m, &info);
  for (PetscBLASInt i = 0; i < m; i++) x[i] *= t->scale[i];
}

/* Without the contacts whose rows depend on closed ones, which these decide. S is the Schur complement of the undecided
   contacts; into and out couple them with the set. */
static PetscErrorCode TangentCondense(HycoTangent t, const PetscReal M[])
{
  const size_t n = (size_t)(t->p + t->n), m = (size_t)t->n_set;
  PetscInt kept = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m * (size_t)t->n_open + 1, &t->into));
  PetscCall(PetscMalloc1(m * (size_t)t->n_open + 1, &t->out));
  PetscCall(PetscMalloc1((size_t)t->n_open * (size_t)t->n_open + 1, &t->S));
  for (PetscInt k = 0; k < t->n_open; k++) {
    const size_t at = (size_t)t->open[k];
    PetscReal *into = t->into + m * (size_t)kept, *out = t->out + m * (size_t)kept, left = M[at * n + at],
              size = PetscAbsReal(left);

    for (size_t i = 0; i < m; i++) {
      into[i] = M[at * n + (size_t)t->set[i]];
      out[i] = M[(size_t)t->set[i] * n + at];
    }
    TangentSolve(t, into);
    for (size_t i = 0; i < m; i++) left -= out[i] * into[i];
    for (size_t i = 0; i < m; i++) size += PetscAbsReal(out[i] * into[i]);
    /* A dropped contact's columns are overwritten by the next one's: into and out hold the kept ones, contiguous. */
    if (left > DEPENDENT_ROW * size) t->open[kept++] = t->open[k];
  }
  t->n_open = kept;
  for (PetscInt j = 0; j < kept; j++) {
    for (PetscInt i = 0; i < kept; i++) {
      PetscReal sum = M[(size_t)t->open[j] * n + (size_t)t->open[i]];

      for (size_t k = 0; k < m; k++) sum -= t->out[m * (size_t)i + k] * t->into[m * (size_t)j + k];
      t->S[j * kept + i] = sum;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For these states; *regular false: the closed contacts do not determine the solution. */
static PetscErrorCode CreateFor(PetscInt p, PetscBool rigid, PetscInt n, const PetscReal M[], const PetscInt state[],
                                HycoTangent *tangent, PetscBool *regular)
{
  HycoTangent t;

  PetscFunctionBegin;
  PetscCall(PetscNew(tangent));
  t = *tangent;
  t->p = p;
  t->n = n;
  PetscCall(PetscMalloc1(p + n + 1, &t->set));
  PetscCall(PetscMalloc1(n + 1, &t->open));
  for (PetscInt i = 0; i < p; i++) t->set[t->n_set++] = i;
  for (PetscInt i = 0; i < n; i++) {
    /* Motions first, then closed contacts: the equations that hold to both sides. */
    if (state[i] == CLOSED) t->set[t->n_set++] = p + i;
    if (state[i] == UNDECIDED) t->open[t->n_open++] = p + i;
  }
  PetscCall(PetscMalloc1((size_t)t->n_set * (size_t)t->n_set + 1, &t->lu));
  PetscCall(PetscMalloc1(t->n_set + 1, &t->scale));
  PetscCall(PetscMalloc1(t->n_set + 1, &t->v));
  PetscCall(PetscMalloc1(t->n_set + 1, &t->ipiv));
  PetscCall(TangentFactor(t, rigid, M, regular));
  if (*regular) PetscCall(TangentCondense(t, M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* M is read here alone. */
PetscErrorCode HycoTangentCreate(PetscInt p, PetscBool rigid, PetscInt n, const PetscReal M[], const PetscReal L[],
                                 const PetscReal w[], PetscReal size, HycoTangent *tangent, PetscBool *regular)
{
  PetscInt *state;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n + 1, &state));
  TangentStates(p, n, M, L, w, size, state);
  *tangent = NULL;
  do {
    PetscCall(HycoTangentDestroy(tangent));
    PetscCall(CreateFor(p, rigid, n, M, state, tangent, regular));
  } while (!*regular && CloseMore(n, L, state));
  PetscCall(PetscFree(state));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Those that are left after the dependent ones were dropped. */
PetscInt HycoTangentUndecided(HycoTangent t)
{
  return t->n_open;
}

/* The undecided contacts: q becomes their gaps' change, which is 0 where it is round-off; *kink: some are not. */
static void TangentGaps(HycoTangent t, const PetscReal q[], int sign, PetscReal change[], PetscBool *kink)
{
  *kink = PETSC_FALSE;
  for (PetscInt k = 0; k < t->n_open; k++) {
    const PetscReal *out = t->out + (size_t)k * (size_t)t->n_set;
    PetscReal size;

    change[k] = sign * q[t->open[k]];
    size = PetscAbsReal(change[k]);
    for (PetscInt i = 0; i < t->n_set; i++) {
      change[k] += sign * out[i] * t->v[i];
      size += PetscAbsReal(out[i] * t->v[i]);
    }
    /* A sum of terms that cancel: 0, and no kink. */
    if (PetscAbsReal(change[k]) <= GAP_RATE_ROUND_OFF * size) change[k] = 0;
    *kink = (PetscBool)(*kink || change[k] != 0);
  }
}

/* q: change of q along the parameter, p + n; sign: -1 for the derivative to the left, whose conditions 0 <= L' hold
   for the opposite change. *kink: undecided contacts change with the side. */
PetscErrorCode HycoTangentSolve(HycoTangent t, const PetscReal q[], int sign, PetscReal z[], PetscBool *kink)
{
  PetscReal *change, *force;
  PetscInt its = 0;
  HycoLCPStatus status = HYCO_LCP_SOLVED;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < t->n_set; i++) t->v[i] = -q[t->set[i]];
  TangentSolve(t, t->v);
  PetscCall(PetscArrayzero(z, t->p + t->n));
  PetscCall(PetscCalloc2(t->n_open + 1, &change, t->n_open + 1, &force));
  TangentGaps(t, q, sign, change, kink);
  if (*kink) PetscCall(HycoLCPLemke(t->n_open, t->S, change, 50 + 10 * t->n_open, force, &its, &status));
  /* Without a solution of the small problem the undecided contacts stay open. */
  for (PetscInt k = 0; k < t->n_open && status == HYCO_LCP_SOLVED; k++) {
    z[t->open[k]] = sign * force[k];
    for (PetscInt i = 0; i < t->n_set; i++)
      t->v[i] -= t->into[(size_t)k * (size_t)t->n_set + (size_t)i] * sign * force[k];
  }
  for (PetscInt i = 0; i < t->n_set; i++) z[t->set[i]] = t->v[i];
  PetscCall(PetscFree2(change, force));
  PetscFunctionReturn(PETSC_SUCCESS);
}
