/*
  Data of a model as functions of the parameters: exact sums of products of the scene's expressions. Which products, a
  fit at points over the ranges finds; a third of the points shows that it is exact.
*/
#include "export.h"
#include <math.h>
#include <string.h>

/* Of a function's own norm, what former functions leave of it: the coefficients of a sum then lose at most 5 of 16
   digits, and FIT_TOLERANCE stays attainable. */
#define INDEPENDENT     1e-5
#define MIXED           12    /* combinations of the rows by which functions are chosen */
#define MOST            40    /* functions */
#define MOST_CANDIDATES 3000  /* candidates: more take too long */
#define SAME_VALUE      1e-13 /* of a function's value: 450 eps, two orders of evaluating one expression */
#define PASSES          3     /* of a solution by a pseudo-inverse */
/* Of the square of an expression's norm, left by a sum of others: the square of INDEPENDENT. */
#define DEPENDENT 1e-10

static PetscReal FitProduct(PetscInt n, const PetscReal a[], const PetscReal b[])
{
  PetscReal sum = 0;

  for (PetscInt i = 0; i < n; i++) sum += a[i] * b[i];
  return sum;
}

/* v -= its part along q, of length 1. */
static void FitDeflate(PetscInt n, const PetscReal q[], PetscReal v[])
{
  const PetscReal sum = FitProduct(n, v, q);

  for (PetscInt i = 0; i < n; i++) v[i] -= sum * q[i];
}

/* -- atoms -- */

PetscReal HycoVariableAt(HycoScene s, PetscInt p, PetscReal share)
{
  const PetscReal at = share * (PetscReal)(s->n_times - 1);
  const PetscInt j = (PetscInt)at;

  if (p != s->n_parameters || s->n_times < 2) return s->lo[p] + (s->hi[p] - s->lo[p]) * share;
  /* What a function does in a short interval is seen as well as in a long one. */
  return s->times[j] + (s->times[j + 1] - s->times[j]) * (at - (PetscReal)j);
}

static PetscReal ValueOf(const HycoAtoms *atoms, const HycoAtom *a, const PetscReal mu[])
{
  return value_of(atoms->code.text + a->code, mu, NULL);
}

/* Whether muParser has the same values at the ends and the middle of the ranges; axis as in FitAdd(). */
static PetscErrorCode FitAgreesWithParser(HycoScene s, const char key[], const char text[], const PetscReal x[],
                                          PetscInt axis, const PetscReal code[], PetscBool *agrees)
{
  PetscReal mu[HYCO_MAX_PARAMETERS], mine, theirs, first = 0, to[3] = {x[0], x[1], x[2]};
  HycoExpr e;
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  if (axis >= 0) to[axis] += 1;
  PetscCall(HycoSceneExpression(s, key, text, &e));
  *agrees = PETSC_TRUE;
  for (PetscInt k = 0; k < 3 && !ierr && *agrees; k++) {
    for (PetscInt p = 0; p < s->n_variables; p++) mu[p] = s->lo[p] + (s->hi[p] - s->lo[p]) * (PetscReal)k / 2;
    mine = value_of(code, mu, NULL);
    /* An atom that is not finite somewhere in the ranges is no candidate. */
    if (PetscIsInfOrNanReal(mine)) *agrees = PETSC_FALSE;
    if (*agrees) ierr = HycoExprEval(e, mu, 1, to, &theirs);
    if (*agrees && !ierr && axis >= 0) ierr = HycoExprEval(e, mu, 1, x, &first);
    if (*agrees && !ierr)
      *agrees = (PetscBool)(PetscAbsReal(mine - (theirs - first)) <=
                            SAME_VALUE * PetscMax(PetscAbsReal(theirs), PetscAbsReal(first)));
  }
  PetscCall(HycoExprDestroy(&e));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether an atom is a sum of the n others and, or of a constant (constant: whether that counts), by its values at
   irregular points of the ranges: then its products are sums of theirs. */
static PetscErrorCode IsSum(HycoScene s, const HycoAtoms *all, const HycoAtom *one, PetscBool constant, PetscInt n,
                            const HycoAtom atom[], PetscBool *is)
{
  const PetscInt N = 2 * (n + 2) + 16;
  PetscReal mu[HYCO_MAX_PARAMETERS], *q;
  PetscInt kept = 0;

  PetscFunctionBegin;
  *is = PETSC_FALSE;
  PetscCall(PetscMalloc1((n + 2) * N, &q));
  for (PetscInt k = !constant; k < n + 2; k++) { /* the constant, the others, then `one` */
    PetscReal *v = q + kept * N, size, left;

    for (PetscInt i = 0; i < N; i++) {
      for (PetscInt p = 0; p < s->n_variables; p++) {
        const PetscReal at = (PetscReal)(i + 1) * 0.61803398874989485 * (1 + 0.75487766624669276 * (PetscReal)p);

        mu[p] = HycoVariableAt(s, p, at - PetscFloorReal(at));
      }
      v[i] = k ? ValueOf(all, k <= n ? &atom[k - 1] : one, mu) : 1;
    }
    size = PetscSqrtReal(FitProduct(N, v, v));
    for (PetscInt j = 0; j < 2 * kept; j++) FitDeflate(N, q + j % kept * N, v); /* twice, against round-off */
    left = PetscSqrtReal(FitProduct(N, v, v));
    *is = (PetscBool)(left <= DEPENDENT * size);
    for (PetscInt i = 0; i < N && !*is; i++) v[i] /= left;
    kept += !*is;
  }
  PetscCall(PetscFree(q));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* axis: of a change of the place by 1, as the entries of a turn by a map; -1: none. Atoms on which muParser and the
   parser differ are left out silently, the fit then decides without them; so are constants, and multiples of others. */
static PetscErrorCode FitAdd(HycoScene s, const char key[], const char text[], const PetscReal x[3], PetscInt axis,
                             PetscBool space, PetscBool weight, HycoAtoms *all)
{
  HycoAtom one = {.change = (PetscBool)(axis >= 0), .weight = weight};
  PetscReal to[3] = {x[0], x[1], x[2]};
  PetscBool agrees = PETSC_TRUE, sum = PETSC_FALSE;

  PetscFunctionBegin;
  if (axis >= 0) to[axis] += 1;
  PetscCall(HycoParse(s, text, to, axis < 0 ? NULL : x, &all->code, &one.code, NULL, NULL));
  one.n = all->code.n - one.code;
  if (one.code < 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(FitAgreesWithParser(s, key, text, x, axis, all->code.text + one.code, &agrees));
  for (PetscInt k = -1; k < all->n && agrees && !sum; k++)
    PetscCall(IsSum(s, all, &one, (PetscBool)(k < 0), k >= 0, all->atom + PetscMax(k, 0), &sum));
  /* At each place another sum, of a few functions: all of them would be too many candidates. */
  if (agrees && !sum && space) PetscCall(IsSum(s, all, &one, PETSC_TRUE, all->n, all->atom, &sum));
  if (!agrees || sum) PetscFunctionReturn(PETSC_SUCCESS);
  HycoGrow(all->n, all->room, all->atom);
  all->atom[all->n++] = one;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoAtomsAddWeight(HycoScene s, const char text[], HycoAtoms *atoms)
{
  const PetscReal nowhere[3] = {0, 0, 0};

  PetscFunctionBegin;
  PetscCall(FitAdd(s, "weight of a sample", text, nowhere, -1, PETSC_FALSE, PETSC_TRUE, atoms));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The atoms of an entry, whose text is that of HycoExportHeat(). */
static PetscErrorCode AddEntry(HycoScene s, const char key[], const char text[], PetscBool travels, PetscInt n,
                               const PetscReal x[], HycoAtoms *atoms)
{
  const PetscBool map = (PetscBool)(strstr(key, "_map_") != NULL);
  PetscInt at;
  PetscBool uses, space;

  PetscFunctionBegin;
  PetscCall(HycoParse(s, text, x, NULL, &atoms->code, &at, &uses, &space));
  if (at < 0 || !uses) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt c = 0; space && map && c < 3; c++)
    PetscCall(FitAdd(s, key, text, x, c, PETSC_FALSE, PETSC_FALSE, atoms));
  for (PetscInt i = 0; !(map && travels) && i < (space ? n : 1); i++)
    PetscCall(FitAdd(s, key, text, x + 3 * i, -1, space, PETSC_FALSE, atoms));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoAtomsFind(HycoScene s, PetscBool travels, PetscInt n, const PetscReal x[], HycoAtoms *atoms)
{
  PetscFunctionBegin;
  for (PetscInt p = 0; p < s->n_variables; p++)
    PetscCall(FitAdd(s, s->parameter[p], s->parameter[p], x, -1, PETSC_FALSE, PETSC_FALSE, atoms));
  for (PetscInt k = 0; k < s->n_entries; k++) {
    char *text;

    /* Entries that cannot change K, F, B or D, and constants, which occur within other entries. */
    if (!strncmp(s->key[k], "output_", 7) || !strncmp(s->key[k], "scene_", 6) || !strncmp(s->key[k], "constant_", 9))
      continue;
    PetscCall(HycoExportHeat(s, s->key[k], s->value[k], &text));
    HycoFinally(AddEntry(s, s->key[k], text, travels, n, x, atoms), PetscCall(PetscFree(text)));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* value[n x atoms] */
PetscErrorCode HycoAtomsTabulate(HycoScene s, const HycoAtoms *all, PetscInt n, const PetscReal mu[], PetscReal value[])
{
  PetscFunctionBegin;
  for (PetscInt i = 0; i < n * all->n; i++)
    value[i] = ValueOf(all, &all->atom[i % all->n], mu + i / all->n * s->n_variables);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- candidates -- */

/* Not finite where a divisor is 0. */
PetscErrorCode HycoFunctionsEvaluate(HycoScene s, const HycoAtoms *atoms, PetscInt n, const HycoFunction f[],
                                     const PetscReal mu[], PetscReal value[])
{
  PetscReal *atom;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(atoms->n + 1, &atom));
  PetscCall(HycoAtomsTabulate(s, atoms, 1, mu, atom));
  for (PetscInt k = 0; k < n; k++) value[k] = product(f[k].of, atom);
  PetscCall(PetscFree(atom));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds a candidate a b d / c, unless a weight of a sample is a divisor, or two of the factors; f NULL: counts it. */
static void FitCandidate(const HycoAtom atom[], PetscInt a, PetscInt b, PetscInt c, PetscInt d, PetscInt *n,
                         HycoFunction f[])
{
  const HycoFunction one = {{(int)a, (int)b, (int)d, (int)c}};
  PetscInt weights = 0;

  for (PetscInt k = 0; k < 3; k++) weights += one.of[k] >= 0 && atom[one.of[k]].weight;
  if (weights > 1 || (c >= 0 && (atom[c].weight || a == c || b == c))) return;
  if (f) f[*n] = one;
  ++*n;
}

/* All candidates of a level, the simpler ones first; f NULL: counts them. */
static PetscInt FitCandidates(PetscInt m, const HycoAtom atom[], PetscInt level, HycoFunction f[])
{
  PetscInt n = 0;

  /* The constant first: the choice prefers earlier candidates. */
  for (PetscInt a = -1; a < m; a++) FitCandidate(atom, a, -1, -1, -1, &n, f);
  for (PetscInt k = 0; level > 0 && k < (m + 1) * m; k++) FitCandidate(atom, k / m - 1, -1, k % m, -1, &n, f);
  for (PetscInt c = -1; level > 1 && c < (level > 2 ? m : 0); c++) {
    for (PetscInt k = 0; k < m * m; k++) {
      if (k / m <= k % m) FitCandidate(atom, k / m, k % m, c, -1, &n, f);
    }
  }
  for (PetscInt k = 0; level > 3 && k < m * m * m; k++) {
    if (k / m / m <= k / m % m && k / m % m <= k % m) FitCandidate(atom, k / m / m, k / m % m, -1, k % m, &n, f);
  }
  return n;
}

/* The same from functions that are known to matter: these, and their products with one atom that is neither a weight
   nor a turn, `only` this (-1: any). */
static PetscInt FromSeeds(PetscInt m, const HycoAtom atom[], PetscInt only, PetscInt n_seeds, const HycoFunction seed[],
                          HycoFunction f[])
{
  PetscInt n = 0;

  if (only >= 0 && (atom[only].weight || atom[only].change)) return 0;
  for (PetscInt k = 0; k < n_seeds * (m + 1); k++) {
    const PetscInt a = k % (m + 1) - 1;
    HycoFunction one = seed[k / (m + 1)];
    PetscInt slot = 0;

    while (slot < 3 && one.of[slot] >= 0) slot++;
    if (a >= 0 && ((only >= 0 && a != only) || slot == 3 || atom[a].weight || atom[a].change || a == one.of[3]))
      continue;
    if (a >= 0) one.of[slot] = (int)a;
    if (f) f[n] = one;
    n++;
  }
  return n;
}

/* -- the fit -- */

/* Whether a point is one of those that check the fit. */
static PetscBool FitIsCheckPoint(PetscInt k)
{
  return (PetscBool)(k % 3 == 2);
}

/* Value r of the fit's rows at point i; the scale of its errors. */
static PetscReal FitValue(const HycoFitData *d, PetscInt i, PetscInt r)
{
  return d->y[(size_t)i * (size_t)d->stride + (size_t)d->row[r]];
}

static PetscReal ScaleOf(const HycoFitData *d, PetscInt r)
{
  return d->scale[d->group[d->row[r]]];
}

/* values[k * N + i] of the functions at all N points, without those that are 0 or not finite somewhere. */
static void FitTabulate(const HycoFitData *d, PetscInt *n, HycoFunction f[], PetscReal value[])
{
  PetscInt kept = 0;

  for (PetscInt k = 0; k < *n; k++) {
    PetscReal *v = value + (size_t)kept * (size_t)d->n_points, most = 0, sum = 0;

    for (PetscInt i = 0; i < d->n_points; i++) {
      v[i] = product(f[k].of, d->atom + (size_t)i * (size_t)d->n_atoms);
      most = PetscMax(most, PetscAbsReal(v[i]));
      sum += v[i];
    }
    if (most > 0 && !PetscIsInfOrNanReal(sum)) f[kept++] = f[k];
  }
  *n = kept;
}

/* Combinations of the rows at the fitted points, in units of their groups: target[MIXED * N], other points 0. */
static void FitCombineRows(const HycoFitData *d, PetscReal target[])
{
  for (PetscInt i = 0; i < MIXED * d->n_points; i++) target[i] = 0;
  for (PetscInt i = 0; i < d->n_points; i++) {
    for (PetscInt r = 0; r < d->n_rows && !FitIsCheckPoint(i); r++) {
      if (ScaleOf(d, r) == 0) continue;
      for (PetscInt c = 0; c < MIXED; c++) {
        /* Irregular weights: no row cancels in all combinations. The cost of a choice is then that of MIXED rows,
           not of all. */
        const PetscReal share = (r + 1) * (0.61803398874989485 + 0.075 * c);

        target[c * d->n_points + i] += (share - PetscFloorReal(share) - 0.5) * FitValue(d, i, r) / ScaleOf(d, r);
      }
    }
  }
}

/* What the targets lose by a function that is orthogonal to the chosen ones, relative to its square; 0: it depends on
   them. */
static PetscReal FitGain(PetscInt N, const PetscReal v[], PetscReal size, const PetscReal target[])
{
  const PetscReal left = FitProduct(N, v, v);
  PetscReal gain = 0;

  /* A function that depends on the chosen ones would fit round-off with large coefficients. */
  if (!(left > PetscSqr(INDEPENDENT) * size) || PetscIsInfOrNanReal(left)) return 0;
  for (PetscInt c = 0; c < MIXED; c++) gain += PetscSqr(FitProduct(N, v, target + c * N));
  return gain / left;
}

/* Orthogonal matching pursuit: the n candidates by which the targets are lost, one after the other, to round-off; the
   simpler ones first where they do as much. */
static PetscErrorCode FitChoose(const HycoFitData *d, PetscInt *n, HycoFunction f[], PetscReal value[])
{
  const PetscInt N = d->n_points, most = PetscMin(*n, PetscMin(MOST, N / 3));
  PetscReal *v, *target, *size, *q, all;
  PetscInt *chosen, m = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc5((size_t)*n * (size_t)N, &v, MIXED * N, &target, *n, &size, N, &q, most + 1, &chosen));
  FitCombineRows(d, target);
  all = FitProduct(MIXED * N, target, target);
  PetscCall(PetscArraycpy(v, value, (size_t)*n * (size_t)N));
  for (PetscInt k = 0; k < *n; k++) {
    for (PetscInt i = 2; i < N; i += 3) v[(size_t)k * (size_t)N + (size_t)i] = 0; /* not fitted */
    size[k] = FitProduct(N, v + (size_t)k * (size_t)N, v + (size_t)k * (size_t)N);
  }
  while (m < most && FitProduct(MIXED * N, target, target) > 1e-28 * all) {
    PetscReal best = 0;

    chosen[m] = -1;
    for (PetscInt k = 0; k < *n; k++) {
      const PetscReal gain = FitGain(N, v + (size_t)k * (size_t)N, size[k], target);

      /* Not for a difference of round-off: the simpler one comes first. */
      if (gain <= (1 + 1e-9) * best) continue;
      best = gain;
      chosen[m] = k;
    }
    if (chosen[m] < 0) break;
    PetscCall(PetscArraycpy(q, v + (size_t)chosen[m] * (size_t)N, N));
    best = PetscSqrtReal(FitProduct(N, q, q));
    for (PetscInt i = 0; i < N; i++) q[i] /= best;
    /* Gram-Schmidt for all candidates at once. */
    for (PetscInt k = 0; k < *n; k++) FitDeflate(N, q, v + (size_t)k * (size_t)N);
    for (PetscInt c = 0; c < MIXED; c++) FitDeflate(N, q, target + c * N);
    m++;
  }
  if (!m) chosen[m++] = 0; /* all is 0 */
  PetscCall(PetscSortInt(m, chosen));
  for (PetscInt k = 0; k < m; k++) {
    PetscCall(PetscArraymove(value + (size_t)k * (size_t)N, value + (size_t)chosen[k] * (size_t)N, N));
    f[k] = f[chosen[k]];
  }
  *n = m;
  PetscCall(PetscFree5(v, target, size, q, chosen));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Least squares at the fitted points: the coefficients and sizes of fit's functions, and the error at the others. */
static PetscErrorCode FitSolve(const HycoFitData *d, const PetscReal value[], HycoExportFit *fit)
{
  const PetscInt N = d->n_points, n = fit->n;
  PetscReal *A, *P, *left;
  PetscInt *at, m = 0;

  PetscFunctionBegin;
  HycoFreeAll(&fit->coefficient, &fit->size);
  PetscCall(PetscCalloc1((size_t)n * (size_t)d->n_rows + 1, &fit->coefficient));
  PetscCall(PetscCalloc1(n + 1, &fit->size));
  PetscCall(PetscMalloc4((size_t)n * (size_t)N, &A, (size_t)n * (size_t)N, &P, N, &left, N, &at));
  for (PetscInt i = 0; i < N; i++) {
    if (!FitIsCheckPoint(i)) at[m++] = i;
  }
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal *v = value + (size_t)k * (size_t)N;

    for (PetscInt i = 0; i < N; i++) fit->size[k] = PetscMax(fit->size[k], PetscAbsReal(v[i]));
    for (PetscInt i = 0; i < m; i++) A[k * m + i] = v[at[i]] / fit->size[k];
  }
  PetscCall(HycoPseudoInverse(m, n, A, 1e-14, P)); /* n x m by columns */
  fit->worst = 0;
  fit->worst_row = d->row[0];
  for (PetscInt r = 0; r < d->n_rows; r++) {
    PetscReal *c = fit->coefficient + r;
    const size_t next = (size_t)d->n_rows;

    /* Refined: a product with a pseudo-inverse loses the digits of its condition. */
    for (PetscInt pass = 0; pass < PASSES; pass++) {
      for (PetscInt i = 0; i < m; i++) {
        left[i] = FitValue(d, at[i], r);
        for (PetscInt k = 0; k < n; k++) left[i] -= c[(size_t)k * next] * A[k * m + i];
      }
      for (PetscInt i = 0; i < m; i++) {
        for (PetscInt k = 0; k < n; k++) c[(size_t)k * next] += P[i * n + k] * left[i];
      }
    }
    for (PetscInt k = 0; k < n; k++) c[(size_t)k * next] /= fit->size[k];
    for (PetscInt i = 2; i < N; i += 3) { /* FitIsCheckPoint() */
      PetscReal error = -FitValue(d, i, r);

      for (PetscInt k = 0; k < n; k++) error += c[(size_t)k * next] * value[(size_t)k * (size_t)N + (size_t)i];
      /* Also where the scale is 0 and the error, too; otherwise the division gives infinity, which is refused. */
      if (PetscAbsReal(error) <= fit->worst * ScaleOf(d, r)) continue;
      fit->worst = PetscAbsReal(error) / ScaleOf(d, r);
      fit->worst_row = d->row[r];
    }
  }
  PetscCall(PetscFree4(A, P, left, at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoExportFitFree(HycoExportFit *fit)
{
  PetscFunctionBegin;
  HycoFreeAll(&fit->function, &fit->coefficient, &fit->size);
  *fit = (HycoExportFit){0};
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Leaves out the functions whose part of each row is below a share of the row's group, round-off, as long as the fit is
   as good. */
static PetscErrorCode FitReduce(const HycoFitData *d, PetscReal tol, const PetscReal value[], HycoExportFit *fit)
{
  PetscReal *less;
  HycoExportFit part = {0};

  PetscFunctionBegin;
  PetscCall(PetscMalloc1((size_t)fit->n * (size_t)d->n_points, &less));
  for (PetscReal share = 1e-6; share > 1e-13; share *= 1e-3) {
    PetscCall(HycoExportFitFree(&part));
    PetscCall(PetscMalloc1(fit->n, &part.function));
    for (PetscInt k = 0; k < fit->n; k++) {
      PetscReal most = 0;

      for (PetscInt r = 0; r < d->n_rows; r++) {
        const PetscReal here = fit->size[k] * PetscAbsReal(fit->coefficient[(size_t)k * (size_t)d->n_rows + (size_t)r]);

        if (ScaleOf(d, r) > 0) most = PetscMax(most, here / ScaleOf(d, r));
      }
      if (most <= share) continue;
      PetscCall(PetscArraycpy(less + (size_t)part.n * (size_t)d->n_points, value + (size_t)k * (size_t)d->n_points,
                              d->n_points));
      part.function[part.n++] = fit->function[k];
    }
    if (part.n) PetscCall(FitSolve(d, less, &part));
    if (!part.n || part.worst > tol) continue;
    PetscCall(HycoExportFitFree(fit));
    *fit = part;
    part = (HycoExportFit){0};
    break;
  }
  PetscCall(HycoExportFitFree(&part));
  PetscCall(PetscFree(less));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The arrays are the caller's, also when worst > tol. */
PetscErrorCode HycoFitFunctions(const HycoAtoms *atoms, PetscInt level, PetscBool together, PetscInt n_seeds,
                                const HycoFunction seed[], PetscReal tol, const HycoFitData *d, HycoExportFit *fit)
{
  const HycoAtom *atom = atoms->atom;
  const PetscInt most = level < 0 ? FromSeeds(atoms->n, atom, -2 - level, n_seeds, seed, NULL)
                                  : FitCandidates(atoms->n, atom, level, NULL);
  PetscReal *value;

  PetscFunctionBegin;
  PetscCall(HycoExportFitFree(fit));
  fit->worst = PETSC_MAX_REAL;
  if (most < 1 || most > MOST_CANDIDATES) PetscFunctionReturn(PETSC_SUCCESS);
  fit->n = most;
  PetscCall(PetscMalloc1(most, &fit->function));
  PetscCall(PetscMalloc1((size_t)most * (size_t)d->n_points, &value));
  if (level < 0)
    (void)FromSeeds(atoms->n, atom, -2 - level, n_seeds, seed, fit->function);
  else
    (void)FitCandidates(atoms->n, atom, level, fit->function);
  FitTabulate(d, &fit->n, fit->function, value);
  if (together && fit->n > d->n_points / 2) fit->n = 0;
  if (!together) PetscCall(FitChoose(d, &fit->n, fit->function, value));
  if (fit->n) PetscCall(FitSolve(d, value, fit));
  if (fit->worst <= tol) PetscCall(FitReduce(d, tol, value, fit));
  PetscCall(PetscFree(value));
  PetscFunctionReturn(PETSC_SUCCESS);
}
