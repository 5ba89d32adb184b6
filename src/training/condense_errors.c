/*
  What a condensed model estimates its errors by: each value of each parameter that is not affine is left out and its
  training points are predicted from the others, forces and displacements. Largest errors, added up over the parameters;
  relative to the point's own size, or a hundredth of the largest.
*/
#include <hycoalgorithms.h>
#include <hycocondensed.h>
#include <hycolcp.h>
#include <hycotrainerimpl.h>

#define SMALL  1e-2 /* of the largest: what smaller ones are divided by */
#define MARGIN 1.5  /* on the displacement: the modes' part is no larger with one value less than with all */

/* The modes that remain without a value, in all modes: r x l column major, orthonormal. */
typedef struct {
  PetscInt l;
  PetscReal *V;
} Kept;

typedef struct {
  PetscInt p, i;                /* parameter, number of the value that is left out */
  PetscReal largest, largest_u; /* forces, displacements in training */
  PetscInt last;                /* node of the flexibility that M holds, and whether it is definite */
  PetscBool definite;
  PetscReal *L, *d;             /* work: forces, coefficients */
  PetscReal force, u, u_forces; /* the errors of a point */
} Work;

static PetscReal Norm(PetscInt n, const PetscReal x[], const PetscReal minus[])
{
  PetscReal sum = 0;

  for (PetscInt i = 0; i < n; i++) sum += PetscSqr(x[i] - (minus ? minus[i] : 0));
  return PetscSqrtReal(sum);
}

static PetscReal Relative(PetscReal lost, PetscReal size, PetscReal largest)
{
  size = PetscMax(size, SMALL * largest);
  return size > 0 ? lost / size : lost > 0 ? 1 : 0;
}

/* The forces at node k of the whole grid without the nodes with that value; *solved: there are any. */
static PetscErrorCode PredictForces(HycoCondensed c, PetscInt k, const PetscReal mu[], Work *w, PetscBool *solved)
{
  const PetscReal *own = c->Lambda + (size_t)k * (size_t)c->m;
  const PetscInt node = HycoCondensedNode(c, &c->field[HYCO_FIELD_G], k);
  PetscInt its;
  HycoLCPStatus status = HYCO_LCP_RAY;

  PetscFunctionBegin;
  if (node != w->last || c->stiff[w->p])
    PetscCall(HycoCondensedFlexibility(c, mu, c->stiff[w->p] ? w->p : -1, c->stiff[w->p] ? w->i : -1, &w->definite));
  w->last = node;
  PetscCall(HycoGridFieldEvaluate(&c->field[HYCO_FIELD_GAP], mu, w->p, w->i, c->g));
  for (PetscInt j = 0; j < c->m; j++) c->active[j] = (PetscBool)(own[j] > 0);
  if (w->definite)
    PetscCall(HycoLCPActiveSet(c->m, c->M, c->g, PETSC_TRUE, c->set_factor, 50 + 4 * c->m, NULL, NULL, c->active, w->L,
                               &its, &status));
  *solved = (PetscBool)(status == HYCO_LCP_SOLVED);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The error of the displacement with these forces, by the modes and fields without that value; and H (L - own). */
static PetscErrorCode PredictDisplacement(HycoTrainer t, HycoCondensed c, PetscInt k, const PetscReal mu[],
                                          const Kept *kept, Work *w)
{
  const PetscInt s = c->sample[k], r = c->l, m = c->m;
  const PetscReal *own = c->Lambda + (size_t)k * (size_t)m, *u = t->responses.C + (size_t)s * (size_t)r;
  const HycoGridField *H = &c->field[HYCO_FIELD_H];
  const PetscReal *h = H->data + (size_t)HycoCondensedNode(c, H, k) * (size_t)H->rows;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < r; i++) {
    w->d[i] = 0;
    for (PetscInt j = 0; j < m; j++) w->d[i] += h[i * m + j] * (w->L[j] - own[j]);
  }
  w->u_forces = Relative(Norm(r, w->d, NULL), t->U_norm[s], w->largest_u);
  PetscCall(HycoGridFieldEvaluate(H, mu, c->stiff[w->p] ? w->p : -1, c->stiff[w->p] ? w->i : -1, c->H));
  PetscCall(HycoGridFieldEvaluate(&c->field[HYCO_FIELD_FREE], mu, w->p, w->i, c->a));
  for (PetscInt i = 0; i < r; i++) {
    for (PetscInt j = 0; j < m; j++) c->a[i] -= c->H[i * m + j] * w->L[j];
  }
  for (PetscInt i = 0; i < r; i++) w->d[i] = 0;
  for (PetscInt j = 0; j < kept->l; j++) {
    const PetscReal *v = kept->V + (size_t)j * (size_t)r;
    PetscReal dot = 0;

    for (PetscInt i = 0; i < r; i++) dot += v[i] * c->a[i];
    for (PetscInt i = 0; i < r; i++) w->d[i] += dot * v[i];
  }
  w->u = Relative(Norm(r, w->d, u), t->U_norm[s], w->largest_u);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The number of node k of a tensor along axis p. */
static PetscInt Along(PetscInt dim, const PetscInt n[], PetscInt p, PetscInt k)
{
  for (PetscInt q = dim - 1; q > p; q--) k /= n[q];
  return k % n[p];
}

/* POD of the columns that do not stem from that value. */
static PetscErrorCode KeepModes(HycoTrainer t, HycoCondensed c, PetscInt p, PetscInt i, Kept *kept)
{
  const HycoResponses *x = &t->responses;
  const HycoTensor *G = &c->field[HYCO_FIELD_G].tensor;
  const PetscInt r = x->r, n = HycoTensorSize(&c->field[HYCO_FIELD_GAP].tensor), nodes = HycoTensorSize(G);
  PetscReal *columns, *sigma;
  const PetscScalar *v;
  PetscInt count = 0;
  Mat S, V;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1((size_t)r * (size_t)(n + nodes * x->q), &columns));
  for (PetscInt k = 0; k < n; k++) {
    if (Along(c->dim, c->n, p, k) == i) continue;
    PetscCall(PetscArraycpy(columns + (size_t)(count++) * (size_t)r, x->C + (size_t)c->sample[k] * (size_t)r, r));
  }
  for (PetscInt k = 0; k < nodes; k++) {
    if (c->stiff[p] && Along(c->dim, G->n, p, k) == i) continue;
    PetscCall(PetscArraycpy(columns + (size_t)count * (size_t)r, x->C + (size_t)(t->n_s + k * x->q) * (size_t)r,
                            (size_t)r * (size_t)x->q));
    count += x->q;
  }
  PetscCall(PetscCalloc1(PetscMax(r, count) + 1, &sigma));
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, r, count, columns, &S));
  PetscCall(HycoPOD(S, t->tol[HYCO_SEED_DISPLACEMENT], t->noise, t->max_modes, &V, &kept->l, sigma));
  PetscCall(PetscMalloc1((size_t)r * (size_t)kept->l + 1, &kept->V));
  if (kept->l) {
    PetscCall(MatDenseGetArrayRead(V, &v));
    PetscCall(PetscArraycpy(kept->V, v, (size_t)r * (size_t)kept->l));
    PetscCall(MatDenseRestoreArrayRead(V, &v));
    PetscCall(MatDestroy(&V));
  }
  PetscCall(MatDestroy(&S));
  PetscCall(PetscFree(columns));
  PetscCall(PetscFree(sigma));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Node k of the whole grid predicted without its value of parameter p. */
static PetscErrorCode LeaveOutOne(HycoTrainer t, HycoCondensed c, PetscInt k, const PetscReal mu[], const Kept *kept,
                                  Work *w)
{
  const PetscReal *own = c->Lambda + (size_t)k * (size_t)c->m;
  PetscBool solved = PETSC_FALSE;

  PetscFunctionBegin;
  w->force = w->u = w->u_forces = 1;
  PetscCall(PredictForces(c, k, mu, w, &solved));
  if (!solved) PetscFunctionReturn(PETSC_SUCCESS);
  w->force = Relative(Norm(c->m, w->L, own), Norm(c->m, own, NULL), w->largest);
  if (c->l) PetscCall(PredictDisplacement(t, c, k, mu, kept, w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The values of parameter p, one after the other. */
static PetscErrorCode LeaveOutParameter(HycoTrainer t, HycoCondensed c, PetscInt p, Work *w)
{
  const PetscInt n = HycoTensorSize(&c->field[HYCO_FIELD_GAP].tensor);
  const PetscReal *mu;
  PetscReal worst[3] = {0, 0, 0};

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, NULL, NULL, &mu));
  c->by_parameter[p] = 0;
  if (c->affine[p] || c->n[p] == 1) PetscFunctionReturn(PETSC_SUCCESS);
  w->p = p;
  for (w->i = 0; w->i < c->n[p]; w->i++) {
    Kept kept = {0};

    w->last = -1;
    if (c->l) PetscCall(KeepModes(t, c, p, w->i, &kept));
    for (PetscInt k = 0; k < n; k++) {
      if (Along(c->dim, c->n, p, k) != w->i) continue;
      PetscCall(LeaveOutOne(t, c, k, mu + c->sample[k] * c->dim, &kept, w));
      worst[0] = PetscMax(worst[0], w->force);
      worst[1] = PetscMax(worst[1], w->u);
      worst[2] = PetscMax(worst[2], w->u_forces);
    }
    PetscCall(PetscFree(kept.V));
  }
  c->by_parameter[p] = worst[0];
  c->errors[2] += worst[0];
  for (PetscInt j = 0; j < 2; j++) c->errors_u[j] += worst[1 + j];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the first l modes miss of the training solutions, and the patterns of the forces between them: these displace by
   no more than the training forces do, force by force. */
static PetscReal ModesError(HycoTrainer t, HycoCondensed c, Work *w)
{
  const PetscInt n = HycoTensorSize(&c->field[HYCO_FIELD_GAP].tensor), r = c->l, m = c->m;
  const HycoGridField *H = &c->field[HYCO_FIELD_H];
  PetscReal cut = 0, compliance = 0;

  for (PetscInt k = 0; k < n; k++) {
    const PetscInt s = c->sample[k];
    const PetscReal *L = c->Lambda + (size_t)k * (size_t)m, *u = t->responses.C + (size_t)s * (size_t)r,
                    *h = H->data + (size_t)HycoCondensedNode(c, H, k) * (size_t)H->rows, force = Norm(m, L, NULL);

    cut = PetscMax(cut, Relative(Norm(r - t->l, u + t->l, NULL), t->U_norm[s], w->largest_u));
    for (PetscInt i = 0; i < r; i++) {
      w->d[i] = 0;
      for (PetscInt j = 0; j < m; j++) w->d[i] += h[i * m + j] * L[j];
    }
    if (force > 0) compliance = PetscMax(compliance, Norm(r, w->d, NULL) / force);
  }
  return cut + t->responses.missed * compliance;
}

PetscErrorCode HycoTrainerLeaveOut(HycoTrainer t)
{
  HycoCondensed c = t->condensed;
  Work w = {0};

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(c->m, &w.L, c->l + 1, &w.d));
  for (PetscInt k = 0; k < t->n_s; k++) {
    w.largest = PetscMax(w.largest, Norm(c->m, t->Lambda + (size_t)k * (size_t)c->m, NULL));
    w.largest_u = PetscMax(w.largest_u, t->U_norm[k]);
  }
  c->errors[2] = c->errors_u[0] = c->errors_u[1] = 0;
  for (PetscInt p = 0; p < c->dim; p++) PetscCall(LeaveOutParameter(t, c, p, &w));
  if (c->l) c->errors_u[0] = MARGIN * (c->errors_u[0] + ModesError(t, c, &w));
  PetscCall(PetscFree2(w.L, w.d));
  PetscFunctionReturn(PETSC_SUCCESS);
}
