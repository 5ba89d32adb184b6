/*
  The flexibility of a body as a polynomial of the parameters that change its shape (hycobodies.h), between its
  surfaces, or of its modes and unknowns inside under forces on them. The samples are its values at the nodes of a
  tensor grid; polynomials that are orthonormal on the nodes give its terms, of which the first is constant and the
  others become small fast. A prediction is limited by reading them: small ones in single precision are half as long,
  and those without effect are left out.
*/
#include <hycobodies.h>
#include <petscblaslapack.h>

/* Diagonal of the mean over the samples, square root; 0: an unknown that does not move. */
static void FlexibilityScales(const HycoFlexibility *f, PetscInt n_samples, const PetscReal *const sample[],
                              PetscReal scale[])
{
  for (PetscInt i = 0; i < f->n; i++) {
    PetscReal sum = 0;

    for (PetscInt s = 0; s < n_samples; s++) sum += sample[s][(size_t)i * (size_t)(f->n + 1)];
    scale[i] = PetscSqrtReal(PetscMax(sum, 0) / n_samples);
  }
}

/* columns (length x n_samples): of an unknown in all terms. X: length x n_samples. */
static PetscErrorCode FlexibilityTransform(PetscInt length, PetscInt n_samples, const PetscReal Q[],
                                           const PetscReal *const sample[], PetscInt unknown, PetscReal X[],
                                           PetscReal columns[])
{
  const PetscReal one = 1, zero = 0;
  PetscBLASInt rows, terms;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(length, &rows));
  PetscCall(PetscBLASIntCast(n_samples, &terms));
  for (PetscInt s = 0; s < n_samples; s++)
    PetscCall(PetscArraycpy(X + (size_t)s * (size_t)length, sample[s] + (size_t)unknown * (size_t)length, length));
  /* Q is by rows: its transpose as BLAS sees it. */
  if (rows) BLASgemm_("N", "T", &rows, &terms, &terms, &one, X, &rows, Q, &terms, &zero, columns, &rows);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* size[t]: of the entries of a term relative to the scales of their row and column, anywhere in the ranges. */
static PetscErrorCode TermSizes(const HycoFlexibility *f, PetscInt n_samples, const PetscReal Q[],
                                const PetscReal *const sample[], const PetscReal row_scale[],
                                const PetscReal column_scale[], PetscReal size[])
{
  const size_t length = (size_t)f->rows * (size_t)n_samples;
  PetscReal *X, *columns;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(size, n_samples));
  PetscCall(PetscMalloc2(length + 1, &X, length + 1, &columns));
  for (PetscInt u = 0; u < f->n; u++) {
    /* It moves in no sample, as where a support holds it. */
    if (!(column_scale[u] > 0)) continue;
    PetscCall(FlexibilityTransform(f->rows, n_samples, Q, sample, u, X, columns));
    for (PetscInt t = 0; t < n_samples; t++) {
      PetscReal most = 0;

      for (PetscInt i = 0; i < f->rows; i++) {
        if (row_scale[i] > 0) most = PetscMax(most, PetscAbsReal(columns[t * f->rows + i]) / row_scale[i]);
      }
      size[t] = PetscMax(size[t], most / column_scale[u]);
    }
  }
  for (PetscInt t = 0; t < n_samples; t++) {
    PetscReal peak = 0;

    /* The largest value of the polynomial at the nodes bounds what the term adds inside the ranges, up to the
       small growth between them. */
    for (PetscInt s = 0; s < n_samples; s++) peak = PetscMax(peak, PetscAbsReal(Q[s * n_samples + t]));
    size[t] *= peak;
  }
  PetscCall(PetscFree2(X, columns));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The terms, the constant one first, the others by their size: large ones are wide. */
static PetscErrorCode ChooseTerms(HycoFlexibility *f, PetscInt n_samples, PetscReal size[], PetscReal least,
                                  PetscReal single)
{
  PetscInt *order;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n_samples, &order));
  for (PetscInt t = 0; t < n_samples; t++) {
    order[t] = t;
    size[t] = -size[t];
  }
  PetscCall(PetscSortRealWithArrayInt(n_samples - 1, size + 1, order + 1));
  f->n_terms = f->n_wide = 1;
  for (PetscInt t = 1; t < n_samples && -size[t] >= least; t++) {
    f->n_terms++;
    f->n_wide += -size[t] > single;
  }
  PetscCall(PetscArraycpy(f->term, order, f->n_terms));
  PetscCall(PetscFree(order));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* size_t before the product: n^2 times the terms exceeds 32 bits at a few thousand unknowns. */
PetscErrorCode HycoFlexibilityAllocate(HycoFlexibility *f)
{
  const size_t entries = (size_t)f->rows * (size_t)f->n;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(entries * (size_t)f->n_wide + 1, &f->wide));
  PetscCall(PetscMalloc1(entries * (size_t)(f->n_terms - f->n_wide) + 1, &f->narrow));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The polynomials of the kept terms at the samples. */
PetscErrorCode HycoFlexibilityTakePolynomials(HycoFlexibility *f, const HycoTensor *tensor)
{
  const PetscInt n = HycoTensorSize(tensor);
  PetscReal *Q;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n * n, &Q));
  PetscCall(HycoTensorPolynomials(tensor, Q));
  PetscCall(PetscMalloc1(n * f->n_terms, &f->polynomial));
  for (PetscInt s = 0; s < n; s++) {
    for (PetscInt t = 0; t < f->n_terms; t++) f->polynomial[s * f->n_terms + t] = Q[s * n + f->term[t]];
  }
  PetscCall(PetscFree(Q));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The constant term is always wide: the others are small beside it, so that their single precision is relative to
   less. */
PetscErrorCode HycoFlexibilityCreate(const HycoTensor *tensor, PetscInt rows, PetscInt n,
                                     const PetscReal *const sample[], const PetscReal scale[], PetscReal least,
                                     PetscReal single, HycoFlexibility *f)
{
  const PetscInt n_samples = HycoTensorSize(tensor);
  const size_t length = (size_t)rows * (size_t)n_samples;
  PetscReal *Q, *X, *columns, *size, *diagonal = NULL;

  PetscFunctionBegin;
  *f = (HycoFlexibility){.rows = rows, .n = n, .n_terms = n_samples, .n_wide = n_samples};
  PetscCall(PetscMalloc1(n_samples, &f->term));
  PetscCall(PetscMalloc4(n_samples * n_samples, &Q, length + 1, &X, length + 1, &columns, n_samples, &size));
  PetscCall(HycoTensorPolynomials(tensor, Q));
  for (PetscInt t = 0; t < n_samples; t++) f->term[t] = t;
  if (least > 0) {
    if (!scale) PetscCall(PetscMalloc1(n + 1, &diagonal));
    if (!scale) FlexibilityScales(f, n_samples, sample, diagonal);
    PetscCall(TermSizes(f, n_samples, Q, sample, scale ? scale : diagonal, scale ? scale + rows : diagonal, size));
    PetscCall(ChooseTerms(f, n_samples, size, least, single));
    PetscCall(PetscFree(diagonal));
  }
  PetscCall(HycoFlexibilityTakePolynomials(f, tensor));
  PetscCall(HycoFlexibilityAllocate(f));
  for (PetscInt u = 0; u < n; u++) {
    PetscCall(FlexibilityTransform(rows, n_samples, Q, sample, u, X, columns));
    for (PetscInt t = 0; t < f->n_terms; t++) {
      for (PetscInt i = 0; i < rows; i++)
        HycoFlexibilitySetEntry(f, t, u, i, columns[(size_t)f->term[t] * (size_t)rows + (size_t)i]);
    }
  }
  PetscCall(PetscFree4(Q, X, columns, size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFlexibilityDestroy(HycoFlexibility *f)
{
  PetscFunctionBegin;
  HycoFreeAll(&f->term, &f->polynomial, &f->wide, &f->narrow);
  *f = (HycoFlexibility){0};
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first entry of an unknown's column in a term among `terms` such columns. */
static size_t FlexibilityEntry(const HycoFlexibility *f, PetscInt terms, PetscInt t, PetscInt unknown)
{
  return ((size_t)unknown * (size_t)terms + (size_t)t) * (size_t)f->rows;
}

/* Of term t, for loops over single entries, as those of a file. Predictions use whole columns instead. */
PetscReal HycoFlexibilityEntry(const HycoFlexibility *f, PetscInt t, PetscInt unknown, PetscInt i)
{
  if (t < f->n_wide) return f->wide[FlexibilityEntry(f, f->n_wide, t, unknown) + (size_t)i];
  return f->narrow[FlexibilityEntry(f, f->n_terms - f->n_wide, t - f->n_wide, unknown) + (size_t)i];
}

/* A later sum of terms has the rounding of narrow ones to float: the trainings measure errors after it. */
void HycoFlexibilitySetEntry(HycoFlexibility *f, PetscInt t, PetscInt unknown, PetscInt i, PetscReal value)
{
  if (t < f->n_wide)
    f->wide[FlexibilityEntry(f, f->n_wide, t, unknown) + (size_t)i] = value;
  else
    f->narrow[FlexibilityEntry(f, f->n_terms - f->n_wide, t - f->n_wide, unknown) + (size_t)i] = (float)value;
}

/* weight: of the samples in the interpolation at a point (Lagrange). Of the polynomials' values at the samples it
   makes theirs at the point. */
void HycoFlexibilityShares(const HycoFlexibility *f, PetscInt n_samples, const PetscReal weight[], PetscReal share[])
{
  for (PetscInt t = 0; t < f->n_terms; t++) {
    share[t] = 0;
    for (PetscInt s = 0; s < n_samples; s++) share[t] += weight[s] * f->polynomial[s * f->n_terms + t];
  }
}

/* Narrow entries are widened in the loop, which the compiler vectorises; sums are in double precision. */
void HycoFlexibilityAdd(const HycoFlexibility *f, PetscInt t, PetscInt unknown, PetscReal factor, PetscReal to[])
{
  if (t < f->n_wide)
    /* By the same routine as sums of blended columns: with one sample kept products have the same bits. */
    HycoBodiesAdd(f->rows, factor, f->wide + FlexibilityEntry(f, f->n_wide, t, unknown), to);
  else {
    const float *narrow = f->narrow + FlexibilityEntry(f, f->n_terms - f->n_wide, t - f->n_wide, unknown);

    for (PetscInt i = 0; i < f->rows; i++) to[i] += factor * narrow[i];
  }
}

/* to[n] += the sum over `terms` terms of share times from, `stride` apart. Four at a time: `to` is read and written
   less often. For both precisions in one order, so that sums of kept products and of columns have the same bits. */
#define ADD_TERMS(name, type)                                                                                          \
  HYCO_FOUR_AT_ONCE static void name(PetscInt terms, const PetscReal share[], size_t n, size_t stride,                 \
                                     const type from[], PetscReal to[])                                                \
  {                                                                                                                    \
    PetscInt t = 0;                                                                                                    \
                                                                                                                       \
    for (; t + 4 <= terms; t += 4, from += 4 * stride) {                                                               \
      const type *a = from, *b = a + stride, *c = b + stride, *d = c + stride;                                         \
                                                                                                                       \
      for (size_t i = 0; i < n; i++)                                                                                   \
        to[i] += share[t] * a[i] + share[t + 1] * b[i] + share[t + 2] * c[i] + share[t + 3] * d[i];                    \
    }                                                                                                                  \
    for (; t + 2 <= terms; t += 2, from += 2 * stride) {                                                               \
      const type *a = from, *b = a + stride;                                                                           \
                                                                                                                       \
      for (size_t i = 0; i < n; i++) to[i] += share[t] * a[i] + share[t + 1] * b[i];                                   \
    }                                                                                                                  \
    for (; t < terms; t++, from += stride) {                                                                           \
      for (size_t i = 0; i < n; i++) to[i] += share[t] * from[i];                                                      \
    }                                                                                                                  \
  }
ADD_TERMS(AddTerms, PetscReal)
ADD_TERMS(AddShortTerms, float)

/* to[n] = the same of the wide terms. */
static void SumWide(const HycoFlexibility *f, const PetscReal share[], size_t n, size_t stride, const PetscReal from[],
                    PetscReal to[])
{
  for (size_t i = 0; i < n; i++) to[i] = share[0] * from[i];
  AddTerms(f->n_wide - 1, share + 1, n, stride, from + stride, to);
}

void HycoFlexibilityColumn(const HycoFlexibility *f, const PetscReal share[], PetscInt unknown, PetscReal column[])
{
  const size_t n = (size_t)f->rows;
  const PetscInt narrow = f->n_terms - f->n_wide;

  SumWide(f, share, n, n, f->wide + FlexibilityEntry(f, f->n_wide, 0, unknown), column);
  AddShortTerms(narrow, share + f->n_wide, n, n, f->narrow + FlexibilityEntry(f, narrow, 0, unknown), column);
}

void HycoFlexibilityBlend(const HycoFlexibility *f, const PetscReal share[], PetscInt n, size_t stride,
                          const PetscReal from[], PetscReal to[])
{
  SumWide(f, share, (size_t)n, stride, from, to);
  AddTerms(f->n_terms - f->n_wide, share + f->n_wide, (size_t)n, stride, from + (size_t)f->n_wide * stride, to);
}

/* Wide columns of a run of unknowns with x are one matrix; x is that of forces, whose runs are a few since contact
   zones are connected. */
PetscErrorCode HycoFlexibilityMultiply(const HycoFlexibility *f, const PetscReal share[], const PetscReal x[],
                                       PetscReal y[])
{
  const PetscInt narrow = f->n_terms - f->n_wide;
  const PetscBLASInt each = 1;
  const PetscReal one = 1;
  PetscBLASInt rows, columns;
  PetscReal *factor;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(f->rows, &rows));
  PetscCall(PetscMalloc1(f->n * f->n_wide + narrow + 1, &factor));
  for (PetscInt d = 0, end; d < f->n && rows; d = end + 1) {
    for (end = d; end < f->n && x[end] != 0; end++) {
      for (PetscInt t = 0; t < f->n_wide; t++) factor[(end - d) * f->n_wide + t] = share[t] * x[end];
    }
    PetscCall(PetscBLASIntCast((end - d) * f->n_wide, &columns));
    /* An unknown without a force ends a run at once. */
    if (columns)
      BLASgemv_("N", &rows, &columns, &one, f->wide + FlexibilityEntry(f, f->n_wide, 0, d), &rows, factor, &each, &one,
                y, &each);
  }
  for (PetscInt d = 0; d < f->n && narrow; d++) {
    if (x[d] == 0) continue;
    for (PetscInt t = 0; t < narrow; t++) factor[t] = share[f->n_wide + t] * x[d];
    AddShortTerms(narrow, factor, (size_t)f->rows, (size_t)f->rows, f->narrow + FlexibilityEntry(f, narrow, 0, d), y);
  }
  PetscCall(PetscFree(factor));
  PetscFunctionReturn(PETSC_SUCCESS);
}
