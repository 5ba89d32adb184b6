/*
  The error estimates of a condensed model: each value of each parameter that is not affine is left out, and its
  training points are predicted from the others, forces and displacements; relative to the point's own size, or a share
  of the largest. Training reports the largest errors, summed over the parameters. The error at a left-out value is a
  divided difference times the product of the distances to the other values: these differences, and their decay with the
  order, give the estimate of the errors between the values (condensed_estimate.c).
*/
#include <hycoalgorithms.h>
#include <hycocondensed.h>

#define SMALL 1e-2 /* share of the largest by which smaller sizes are replaced in a division */
#define LAST  4    /* the last of this many parts of the force patterns stands for forces outside the patterns */
#define CUT   1.3  /* margin of the modes' part over the largest in training */
#define SHARE 0.9  /* quantile of the divided differences along a parameter that the estimate uses */

typedef struct {
  PetscInt p, i;                /* parameter, index of the left-out value */
  PetscReal largest, largest_u; /* forces, displacements in training */
  PetscInt last;                /* last: node whose flexibility is in M; and whether it is definite */
  PetscBool definite;
  PetscReal *L, *d;           /* work: forces, coefficients */
  PetscReal force;            /* error of a point's forces */
  PetscReal law[HYCO_N_LAWS]; /* and the errors for the estimate */
  PetscInt n_differences;
  PetscReal *difference[HYCO_N_LAWS]; /* along the parameter */
} Work;

static PetscReal Norm(PetscInt n, const PetscReal x[], const PetscReal minus[])
{
  PetscReal sum = 0;

  for (PetscInt i = 0; i < n; i++) sum += PetscSqr(x[i] - (minus ? minus[i] : 0));
  return PetscSqrtReal(sum);
}

static PetscReal Relative(PetscReal lost, PetscReal size, PetscReal least)
{
  size = PetscMax(size, least);
  return size > 0 ? lost / size : lost > 0 ? 1 : 0;
}

/* The forces at node k of the whole grid without the nodes with that value; *solved: the problem was solved. */
static PetscErrorCode PredictForces(HycoCondensed c, PetscInt k, const PetscReal mu[], Work *w, PetscBool *solved)
{
  const PetscReal *own = c->Lambda + (size_t)k * (size_t)c->m;
  const PetscInt node = HycoCondensedNode(c, &c->field[HYCO_FIELD_G], k);

  PetscFunctionBegin;
  if (node != w->last || c->stiff[w->p])
    PetscCall(HycoCondensedFlexibility(c, mu, c->stiff[w->p] ? w->p : -1, c->stiff[w->p] ? w->i : -1, &w->definite));
  w->last = node;
  PetscCall(HycoCondensedFreeGap(c, mu, w->p, w->i));
  for (PetscInt j = 0; j < c->m; j++) c->active[j] = (PetscBool)(own[j] > 0);
  *solved = PETSC_FALSE;
  if (w->definite) PetscCall(HycoCondensedSolveForces(c, w->L, solved));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The error of the displacement, with all modes, by the fields without that value; and that of H (L - own), caused
   by the forces' error alone. */
static PetscErrorCode PredictDisplacement(HycoReducer t, HycoCondensed c, PetscInt k, const PetscReal mu[], Work *w)
{
  const PetscInt s = c->sample[k], r = c->l, m = c->m;
  const PetscReal *own = c->Lambda + (size_t)k * (size_t)m, *u = Condensing(t)->responses.C + (size_t)s * (size_t)r;
  const HycoGridField *H = &c->field[HYCO_FIELD_H];
  const PetscReal *h = H->data + (size_t)HycoCondensedNode(c, H, k) * (size_t)H->rows;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < r; i++) {
    w->d[i] = 0;
    for (PetscInt j = 0; j < m; j++) w->d[i] += h[i * m + j] * (w->L[j] - own[j]);
  }
  w->law[HYCO_LAW_U_FULL] = Relative(Norm(r, w->d, NULL), t->U_norm[s], SMALL * w->largest_u);
  PetscCall(HycoGridFieldEvaluate(H, mu, c->stiff[w->p] ? w->p : -1, c->stiff[w->p] ? w->i : -1, c->H));
  PetscCall(HycoCondensedEvaluate(c, HYCO_FIELD_FREE, mu, w->p, w->i, c->a));
  for (PetscInt i = 0; i < r; i++) {
    for (PetscInt j = 0; j < m; j++) c->a[i] -= c->H[i * m + j] * w->L[j];
  }
  w->law[HYCO_LAW_U] = Relative(Norm(r, c->a, u), t->U_norm[s], SMALL * w->largest_u);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The number of node k of a tensor along axis p. */
static PetscInt Along(PetscInt dim, const PetscInt n[], PetscInt p, PetscInt k)
{
  for (PetscInt q = dim - 1; q > p; q--) k /= n[q];
  return k % n[p];
}

/* Node k of the whole grid predicted without its value of parameter p. */
static PetscErrorCode LeaveOutOne(HycoReducer t, HycoCondensed c, PetscInt k, const PetscReal mu[], Work *w)
{
  const PetscReal *own = c->Lambda + (size_t)k * (size_t)c->m;
  PetscBool solved = PETSC_FALSE;
  PetscReal lost, size;

  PetscFunctionBegin;
  w->force = 1;
  for (PetscInt j = 0; j < HYCO_N_LAWS; j++) w->law[j] = 1;
  PetscCall(PredictForces(c, k, mu, w, &solved));
  if (!solved) PetscFunctionReturn(PETSC_SUCCESS);
  lost = Norm(c->m, w->L, own);
  size = Norm(c->m, own, NULL);
  w->force = Relative(lost, size, SMALL * w->largest);
  w->law[HYCO_LAW_LAMBDA] = Relative(lost, size, HYCO_SMALL_FORCE * w->largest);
  if (c->l) PetscCall(PredictDisplacement(t, c, k, mu, w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the remainder along p vanishes at the nodes: the fields have the highest degree. */
static PetscBool Interpolates(HycoCondensed c, PetscInt p)
{
  return (PetscBool)(c->field[c->stiff[p] ? HYCO_FIELD_G : HYCO_FIELD_GAP].tensor.degree[p] == c->n[p] - 1);
}

/* Fits the estimate along p from the divided differences; with less than three values the decay is not known. */
static PetscErrorCode FitLaw(HycoCondensed c, PetscInt p, Work *w)
{
  const HycoGridField *G = &c->field[HYCO_FIELD_G], *gap = &c->field[HYCO_FIELD_GAP];
  static const PetscReal margin[HYCO_N_LAWS] = {0.7, 1.5, 1.5}; /* chosen from scenes in 2D and 3D */
  PetscReal decay = 1, other = 0;

  PetscFunctionBegin;
  c->flat[p] = !Interpolates(c, p);
  if (!c->flat[p]) {
    PetscCall(HycoTensorDecay(&gap->tensor, p, gap->rows, gap->data, &decay));
    if (c->stiff[p]) PetscCall(HycoTensorDecay(&G->tensor, p, G->rows, G->data, &other));
    decay = c->stiff[p] ? other : decay;
  }
  for (PetscInt j = 0; j < HYCO_N_LAWS; j++) {
    const PetscInt at = (PetscInt)(SHARE * (PetscReal)(w->n_differences - 1) + 0.5);

    PetscCall(PetscSortReal(w->n_differences, w->difference[j]));
    c->law[p * HYCO_N_LAWS + j] = c->n[p] < 3 ? -1 : margin[j] * decay * w->difference[j][at];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Leaves out the values of parameter p one after the other. */
static PetscErrorCode LeaveOutParameter(HycoReducer t, HycoCondensed c, PetscInt p, Work *w)
{
  const PetscInt n = HycoTensorSize(&c->field[HYCO_FIELD_GAP].tensor);
  const PetscReal *mu;
  PetscReal worst = 0;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, NULL, NULL, &mu));
  c->by_parameter[p] = 0;
  for (PetscInt j = 0; j < HYCO_N_LAWS; j++) c->law[p * HYCO_N_LAWS + j] = 0;
  if (c->affine[p] || c->n[p] == 1) PetscFunctionReturn(PETSC_SUCCESS);
  w->p = p;
  w->n_differences = 0;
  for (w->i = 0; w->i < c->n[p]; w->i++) {
    const PetscReal product = Interpolates(c, p) ? HycoPolynomialProduct(c->n[p], c->x[p], w->i, c->x[p][w->i]) : 1;

    w->last = -1;
    for (PetscInt k = 0; k < n; k++) {
      if (Along(c->dim, c->n, p, k) != w->i) continue;
      PetscCall(LeaveOutOne(t, c, k, mu + c->sample[k] * c->dim, w));
      worst = PetscMax(worst, w->force);
      for (PetscInt j = 0; j < HYCO_N_LAWS; j++) w->difference[j][w->n_differences] = w->law[j] / product;
      w->n_differences++;
    }
  }
  c->by_parameter[p] = worst;
  c->errors[2] += worst;
  PetscCall(FitLaw(c, p, w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The error of the first l modes on the training solutions and on the force patterns between them: forces outside
   the patterns displace at most as the last patterns do, for the same force. */
static PetscReal ModesError(HycoReducer t, HycoCondensed c, Work *w)
{
  const HycoResponses *x = &Condensing(t)->responses;
  const PetscInt n = HycoTensorSize(&c->field[HYCO_FIELD_GAP].tensor), r = c->l,
                 nodes = HycoTensorSize(&c->field[HYCO_FIELD_G].tensor);
  PetscReal cut = 0, compliance = 0;

  for (PetscInt k = 0; k < n; k++) {
    const PetscInt s = c->sample[k];

    cut = PetscMax(
        cut, Relative(Norm(r - t->l, x->C + (size_t)s * (size_t)r + t->l, NULL), t->U_norm[s], SMALL * w->largest_u));
  }
  for (PetscInt j = x->sampled - 1 - x->sampled / LAST; j >= 0 && j < x->sampled; j++) {
    for (PetscInt k = 0; k < nodes; k++) {
      const PetscReal *column = x->C + (size_t)(t->n_s + k * x->q + j) * (size_t)r;

      compliance = PetscMax(compliance, Norm(r, column, NULL) / x->scale[j]);
    }
  }
  return CUT * (cut + x->missed * compliance);
}

PetscErrorCode HycoCondensedLeaveOut(HycoReducer t)
{
  HycoCondensed c = Condensing(t)->condensed;
  const PetscInt n = HycoTensorSize(&c->field[HYCO_FIELD_GAP].tensor);
  Work w = {0};

  PetscFunctionBegin;
  PetscCall(PetscFree(c->law));
  PetscCall(PetscFree(c->flat));
  PetscCall(PetscCalloc1(c->dim * HYCO_N_LAWS + 1, &c->law));
  PetscCall(PetscCalloc1(c->dim + 1, &c->flat));
  PetscCall(PetscCalloc2(c->m, &w.L, c->l + 1, &w.d));
  for (PetscInt j = 0; j < HYCO_N_LAWS; j++) PetscCall(PetscMalloc1(n, &w.difference[j]));
  for (PetscInt k = 0; k < t->n_s; k++) {
    w.largest = PetscMax(w.largest, Norm(c->m, t->Lambda + (size_t)k * (size_t)c->m, NULL));
    w.largest_u = PetscMax(w.largest_u, t->U_norm[k]);
  }
  c->errors[2] = 0;
  for (PetscInt p = 0; p < c->dim; p++) PetscCall(LeaveOutParameter(t, c, p, &w));
  c->cut = c->l ? ModesError(t, c, &w) : 0;
  for (PetscInt j = 0; j < HYCO_N_LAWS; j++) PetscCall(PetscFree(w.difference[j]));
  PetscCall(PetscFree2(w.L, w.d));
  PetscFunctionReturn(PETSC_SUCCESS);
}
