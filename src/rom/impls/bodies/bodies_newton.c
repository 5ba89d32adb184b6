/*
  Paths of bodies that deform inelastically. With alpha, the coefficients of the nodal forces of inelastic strains, all
  displacements are linear in loads, alpha and contact forces L, exactly but for the modes:

      u = (R c + P alpha - C B^T L) / kappa

  On a set of closed contacts, L = W_aa^-1 (B P alpha - w), so that the strains of the points with laws are affine in
  alpha alone, e = e_0 + S alpha, and one step in time is the small problem

      r(alpha) = T^T s(e_0 + S alpha) - alpha = 0,      dr/dalpha = sum over points of T_p^T (C - C_t) S_p - 1

  with what their stresses lack of the elastic ones, s = C (e - e_th) - sigma. It is solved by Newton's method; its
  tangent is kept while it contracts, also from step to step. Then the set is checked: forces, and gaps of all contacts;
  if one is violated, the contact problem at alpha gives the next set. The set of a step is the first one of the next.

  Rigid motions x that contact alone prevents do not strain the points. On a set, with G = B Z of the motions and f the
  work of the loads on them, W_aa L - G x = B P alpha - w and G^T L = f. W_aa is factored with rho G G^T added, which
  keeps L and moves x by rho f: alone it may be singular where the pins of a body's flexibility are.

  With friction the forces are those of the contact problem at alpha (bodies_friction.c), L(alpha), and the set is their
  linear map L_k + Z (alpha - alpha_k) on the states found there: which contacts are open, stick or slip. A round is the
  same small problem on that map, then the contact problem at the new alpha; it was the last one if the forces are those
  of the map. Where no state changes, and in 2D, the map is exact, and most steps take one round; in 3D the directions
  of slip turn, and rounds are a Newton's method. States that change in every round end the step, which is halved.
*/
#include "bodies_path.h"

#define ROUNDS   30 /* of sets in a step */
#define KEPT     8  /* of these, with the map of other directions of slip */
#define MOST_ITS 30 /* of Newton's method in a step */
#define HALVINGS 6  /* of a step of Newton's method */
/* Of the largest force or gap: 45,000 eps, ten times a solve on the set; a set with less is not changed. */
#define VIOLATED 1e-11
/* Of the largest force: a tenth of the residual of 1e-8; forces with friction are those of the linear map. */
#define MAP_AGREES 1e-9

/* y = beta y + factor A x of a table by rows, n x l; transposed: A^T x. BLAS sees a table by rows as its transpose by
   columns, hence the exchanged letters. */
static PetscErrorCode BodiesNewtonMultiply(PetscBool transposed, PetscInt n, PetscInt l, const PetscReal A[],
                                           const PetscReal x[], PetscReal factor, PetscReal beta, PetscReal y[])
{
  PetscBLASInt rows, columns, each = 1;

  PetscFunctionBegin;
  if (!n || !l) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscBLASIntCast(n, &rows));
  PetscCall(PetscBLASIntCast(l, &columns));
  BLASgemv_(transposed ? "N" : "T", &columns, &rows, &factor, A, &columns, x, &each, &beta, y, &each);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- responses of contacts -- */

/* n_set = -1 equals no set, so that ChooseSet() factors again; the columns stay valid. */
void HycoBodiesRestart(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;

  w->n_set = -1;
  w->fresh = PETSC_TRUE;
}

/* The columns contain B, C and kappa: any change of rows, poses or stiffness makes all of them stale. */
PetscErrorCode HycoBodiesForget(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;

  PetscFunctionBegin;
  for (PetscInt k = 0; w->column && k < w->surface.n; k++) PetscCall(PetscFree(w->column[k]));
  HycoBodiesRestart(m);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The displacements of the surfaces by a unit force at contact k, y. */
static void BodiesNewtonStore(HycoBodiesWork o, PetscInt k, PetscReal y[])
{
  const HycoSubstructures b = o->bodies;

  PetscCallVoid(PetscArrayzero(y, b->ns));
  for (PetscInt e = o->row_start[k]; e < o->row_start[k + 1]; e++) {
    const PetscInt body = HycoBodiesAt(b, o->row_at[e]), lo = b->start[body];
    const HycoSubstructure *own = &b->body[body];

    /* C is symmetric, so that a stored column is the row that the unit force needs. */
    for (PetscInt t = 0; t < own->C.n_terms; t++)
      HycoFlexibilityAdd(&own->C, t, o->row_at[e] - lo, -o->share[body][t] * o->row[e] / o->kappa[body], y + lo);
  }
}

/* Strains of the points (n_rows x k) from displacements of the cells (nd x k). */
static void TakeStrains(HycoROM m, PetscInt k, const PetscReal cells[], PetscReal strain[])
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscInt ns = m->fe->n_sigma, nq = HycoElementGet(m->model->mesh->type)->nq,
                 n = m->model->mesh->nv * m->model->mesh->dim;

  PetscCallVoid(PetscArrayzero(strain, w->n_rows * k));
  for (PetscInt r = 0; r < w->n_rows; r++) {
    const PetscInt *at = w->cell_at + w->point[r / ns] / nq * n;

    for (PetscInt i = 0; i < n; i++) {
      /* A prescribed displacement: AddSupports() adds its strain. */
      if (at[i] < 0) continue;
      if (k == 1)
        strain[r] += w->B[r * n + i] * cells[at[i]];
      else
        HycoBodiesAdd(k, w->B[r * n + i], cells + at[i] * k, strain + r * k);
    }
  }
}

/* The column of contact k, if it is not there. On demand: only contacts that enter the set at some time need one, and
   each costs a response of the bodies. */
static PetscErrorCode BodiesNewtonColumn(HycoROM m, PetscInt k)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const HycoBodiesWork o = &w->bodies;
  const HycoSubstructures b = o->bodies;
  HycoBodiesInelastic in = b->inelastic;
  const PetscInt n = w->gaps;
  PetscReal *y, *cells;

  PetscFunctionBegin;
  if (w->column[k]) PetscFunctionReturn(PETSC_SUCCESS);
  /* One array of three parts: gaps of all contacts (W_kj, positive on the diagonal), strains of the points,
     displacements of their cells. */
  PetscCall(PetscCalloc1(n + w->n_rows + in->nd + 1, &w->column[k]));
  PetscCall(PetscMalloc1(b->ns + 1, &y));
  if (n) BodiesNewtonStore(o, k, y);
  for (PetscInt j = 0; j < n; j++) {
    for (PetscInt e = o->row_start[j]; e < o->row_start[j + 1]; e++) w->column[k][j] -= o->row[e] * y[o->row_at[e]];
  }
  cells = w->column[k] + n + w->n_rows;
  for (PetscInt i = 0; i < in->nd; i++) {
    const PetscReal *C = in->C + (size_t)i * (size_t)b->ns;

    for (PetscInt e = o->row_start[k]; e < o->row_start[k + 1]; e++)
      cells[i] -= C[o->row_at[e]] * o->row[e] / o->kappa[in->body[i]];
  }
  TakeStrains(m, 1, cells, w->column[k] + n);
  PetscCall(PetscFree(y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* B at fe's nodes, and T and the modes there: what a stress does at the nodes follows the body's size, w B, and the
   modes' displacements are those of forces at the first one. */
static PetscErrorCode TakePoints(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoBodiesInelastic in = w->bodies.bodies->inelastic;
  const PetscInt ns = m->fe->n_sigma, nq = HycoElementGet(m->model->mesh->type)->nq,
                 n = m->model->mesh->nv * m->model->mesh->dim, size = ns * in->m;
  const PetscReal of = m->fe->dim == 3 || m->fe->formulation == HYCO_AXISYMMETRIC ? 3 : 2;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < in->n_points; p++) {
    PetscReal weight, factor, sum = 0;

    PetscCall(HycoFEPointRows(m->fe, w->point[p] / nq, w->point[p] % nq, w->B + p * ns * n, &weight));
    /* w ~ s^of and B ~ 1/s, so that w B, the force of a unit stress, grows as s^(of - 1) = (w / w_0)^((of - 1) /
       of) when the body is scaled by s. */
    factor = PetscPowReal(weight / in->weight[p], (of - 1) / of);
    for (PetscInt i = p * size; i < (p + 1) * size; i++) {
      w->T[i] = in->T[i] * factor;
      w->there[i] = in->there[i] / factor;
      sum += w->T[i] * w->T[i];
    }
    w->weight[p] = PetscSqrtReal(sum);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What does not depend on the set or the time: B P / kappa and the points' strains by alpha and by loads. Done
   again only if rows, poses or stiffness have changed (Unchanged()). */
PetscErrorCode HycoBodiesScale(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const HycoBodiesWork o = &w->bodies;
  const HycoSubstructures b = o->bodies;
  HycoBodiesInelastic in = b->inelastic;
  const PetscInt l = in->m;
  PetscReal *cells;

  PetscFunctionBegin;
  PetscCall(TakePoints(m));
  PetscCall(PetscArrayzero(w->BP, w->surface.n * l));
  for (PetscInt k = 0; k < w->surface.n; k++) {
    for (PetscInt e = o->row_start[k]; e < o->row_start[k + 1]; e++) {
      const PetscReal value = o->row[e] / o->kappa[HycoBodiesAt(b, o->row_at[e])];

      for (PetscInt j = 0; j < l; j++) w->BP[k * l + j] += value * in->P[o->row_at[e] * l + j];
    }
  }
  for (PetscInt k = 0; k < w->surface.n; k++) HycoBodiesMotionRow(o, k, w->G + k * b->p);
  PetscCall(PetscMalloc1(in->nd * PetscMax(l, b->r) + 1, &cells));
  for (PetscInt i = 0; i < in->nd * l; i++) cells[i] = in->A[i] / o->kappa[in->body[i / l]];
  TakeStrains(m, l, cells, w->response);
  /* The strains by loads are those at c, the coefficients of the loads, and serve all times of a path. */
  for (PetscInt i = 0; i < in->nd * b->r; i++) cells[i] = in->R[i] / o->kappa[in->body[i / b->r]];
  TakeStrains(m, b->r, cells, w->loads);
  PetscCall(PetscFree(cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- a set of closed contacts -- */

/* An entry of W_aa, with rho G G^T. */
static PetscReal SetEntry(const HycoBodiesPath w, PetscInt p, PetscInt k, PetscInt i)
{
  PetscReal value = w->column[k][i];

  for (PetscInt d = 0; d < p; d++) value += w->rho * w->G[k * p + d] * w->G[i * p + d];
  return value;
}

/* rho: both terms of the diagonal are of one size. */
static void WeighMotions(HycoBodiesPath w, PetscInt p)
{
  PetscReal flexibility = 0, motions = 0;

  for (PetscInt i = 0; i < w->n_set; i++) {
    flexibility += w->column[w->set[i]][w->set[i]];
    for (PetscInt d = 0; d < p; d++) motions += PetscSqr(w->G[w->set[i] * p + d]);
  }
  w->rho = motions > 0 ? flexibility / motions : 0;
}

/* Factors W_aa as a whole. *independent: no contact depends on those before it. */
static PetscErrorCode FactorAll(HycoROM m, PetscBool *independent)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscInt n = w->n_set, p = w->bodies.bodies->p;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) {
    for (PetscInt i = 0; i < n; i++) w->U[k * n + i] = i <= k ? SetEntry(w, p, w->set[k], w->set[i]) : 0;
  }
  /* By columns, the upper triangle: the factor and trsm read nothing below it. */
  PetscCall(HycoCholesky("U", n, w->U, NULL, independent));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same contact by contact; those that depend on the ones before them leave the set. Cholesky by rows without
   pivoting: a contact that is dependent would have a pivot of round-off, and its force would be arbitrary. */
static PetscErrorCode FactorEach(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscInt n = w->n_set, p = w->bodies.bodies->p;

  PetscFunctionBegin;
  w->n_set = 0;
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt contact = w->set[k], rank = w->n_set;
    const PetscReal diagonal = SetEntry(w, p, contact, contact);
    PetscReal *u = w->U + (size_t)rank * (size_t)n, pivot = diagonal;

    for (PetscInt i = 0; i < rank; i++) {
      const PetscReal *other = w->U + (size_t)i * (size_t)n;

      u[i] = SetEntry(w, p, contact, w->set[i]);
      for (PetscInt d = 0; d < i; d++) u[i] -= other[d] * u[d];
      u[i] /= other[i];
      pivot -= u[i] * u[i];
    }
    if (!(pivot > HYCO_DEPENDENT * diagonal)) continue;
    u[rank] = PetscSqrtReal(pivot);
    w->set[w->n_set++] = contact;
  }
  /* The leading dimension shrinks from n to the rank; columns move down in order, so that none is overwritten
     before it is read. */
  for (PetscInt j = 0; j < w->n_set; j++) PetscCall(PetscArraymove(w->U + j * w->n_set, w->U + j * n, j + 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The fast LAPACK factor first: dependent contacts (equal rows of B, as at shared corners) are rare. */
static PetscErrorCode BodiesNewtonFactor(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  PetscBool independent = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(PetscFree(w->U));
  PetscCall(PetscMalloc1((size_t)w->n_set * (size_t)w->n_set + 1, &w->U));
  /* Columns are kept for the path: a contact that closes again costs nothing. */
  for (PetscInt k = 0; k < w->n_set; k++) PetscCall(BodiesNewtonColumn(m, w->set[k]));
  WeighMotions(w, w->bodies.bodies->p);
  PetscCall(FactorAll(m, &independent));
  if (!independent) PetscCall(FactorEach(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* X = W_aa^-1 X, n_set x k row major. */
static void SolveOnSet(const HycoBodiesPath w, PetscInt k, PetscReal X[])
{
  const PetscReal one = 1;
  PetscBLASInt n, columns;

  if (!w->n_set || !k) return;
  PetscCallVoid(PetscBLASIntCast(w->n_set, &n));
  PetscCallVoid(PetscBLASIntCast(k, &columns));
  /* X^T is stored: X^T <- X^T U^-1 U^-T */
  BLAStrsm_("R", "U", "N", "N", &columns, &n, &one, w->U, &n, X, &columns);
  BLAStrsm_("R", "U", "T", "N", &columns, &n, &one, w->U, &n, X, &columns);
}

/* Y = W_aa^-1 G, and G^T Y, whose size is p: W_aa^-1 is positive definite, so that it is singular only where the set
   does not determine a motion. */
static PetscErrorCode TakeMotions(HycoBodiesPath w, PetscInt p)
{
  PetscBool regular;

  PetscFunctionBegin;
  w->loose = PETSC_FALSE;
  if (!p) PetscFunctionReturn(PETSC_SUCCESS);
  /* Their sizes follow the set. */
  HycoFreeAll(&w->Y, &w->H);
  PetscCall(PetscMalloc1(w->n_set * p + 1, &w->Y));
  PetscCall(PetscCalloc1(p * p, &w->H));
  for (PetscInt i = 0; i < w->n_set; i++) PetscCall(PetscArraycpy(w->Y + i * p, w->G + w->set[i] * p, p));
  SolveOnSet(w, p, w->Y);
  for (PetscInt i = 0; i < w->n_set; i++) {
    for (PetscInt d = 0; d < p * p; d++) w->H[d] += w->G[w->set[i] * p + d / p] * w->Y[i * p + d % p];
  }
  /* Symmetric, so that by rows or by columns is the same. */
  PetscCall(HycoCholesky("U", p, w->H, NULL, &regular));
  /* No error: the next set, or the contact problem, may hold the motion. */
  w->loose = (PetscBool)!regular;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The forces X = W_aa^-1 (given), n_set x k, and the motions x, p x k, with G^T X = work (k = 1), or 0 (NULL). */
static PetscErrorCode BodiesNewtonBalance(HycoBodiesPath w, PetscInt p, PetscInt k, const PetscReal work[],
                                          PetscReal X[], PetscReal x[])
{
  PetscBLASInt n, columns, info;
  PetscReal *right;

  PetscFunctionBegin;
  SolveOnSet(w, k, X);
  if (!p || w->loose) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc1(p * k + 1, &right)); /* by columns of p */
  for (PetscInt j = 0; j < p * k; j++) {
    right[j] = work ? work[j % p] : 0;
    for (PetscInt i = 0; i < w->n_set; i++) right[j] -= w->G[w->set[i] * p + j % p] * X[i * k + j / p];
  }
  PetscCall(PetscBLASIntCast(p, &n));
  PetscCall(PetscBLASIntCast(k, &columns));
  LAPACKpotrs_("U", &n, &columns, w->H, &n, right, &n, &info);
  for (PetscInt i = 0; i < w->n_set; i++) {
    for (PetscInt j = 0; j < p * k; j++) X[i * k + j / p] += w->Y[i * p + j % p] * right[j];
  }
  for (PetscInt j = 0; j < p * k; j++) x[j % p * k + j / p] = right[j] - (work ? w->rho * work[j % p] : 0);
  PetscCall(PetscFree(right));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* S = response + the strains of the forces Z. */
static PetscErrorCode AddForces(const HycoBodiesPath w, PetscInt l)
{
  const PetscReal one = 1;
  PetscReal *strain;
  PetscBLASInt rows, modes, n;

  PetscFunctionBegin;
  if (w->summed) PetscFunctionReturn(PETSC_SUCCESS);
  w->summed = PETSC_TRUE;
  /* Without contacts the strains follow alpha alone. */
  PetscCall(PetscArraycpy(w->S, w->response, w->n_rows * l));
  if (!w->n_set || !l || !w->n_rows) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1((size_t)w->n_set * (size_t)w->n_rows, &strain));
  for (PetscInt i = 0; i < w->n_set; i++)
    PetscCall(PetscArraycpy(strain + i * w->n_rows, w->column[w->set[i]] + w->gaps, w->n_rows));
  PetscCall(PetscBLASIntCast(w->n_rows, &rows));
  PetscCall(PetscBLASIntCast(l, &modes));
  PetscCall(PetscBLASIntCast(w->n_set, &n));
  /* One product of n_set rows instead of a loop over contacts: S is the largest table of a step. */
  BLASgemm_("N", "T", &modes, &rows, &n, &one, w->Z, &modes, strain, &rows, &one, w->S, &modes); /* S, Z by rows */
  PetscCall(PetscFree(strain));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* e += S alpha: by S, or by the terms of its sum, which a set with no tangent of its own does without. */
static PetscErrorCode AddStrains(HycoBodiesPath w, PetscInt l, const PetscReal alpha[])
{
  PetscFunctionBegin;
  PetscCall(BodiesNewtonMultiply(PETSC_FALSE, w->n_rows, l, w->summed ? w->S : w->response, alpha, 1, 1, w->e));
  for (PetscInt i = 0; i < w->n_set && !w->summed; i++) {
    PetscReal force = 0;

    for (PetscInt k = 0; k < l; k++) force += w->Z[i * l + k] * alpha[k];
    HycoBodiesAdd(w->n_rows, force, w->column[w->set[i]] + w->gaps, w->e);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What depends on the set but not on the loads: the factor, Z, S. */
static PetscErrorCode TakeSet(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscInt l = w->bodies.bodies->inelastic->m;

  PetscFunctionBegin;
  w->factored = PETSC_FALSE;
  PetscCall(BodiesNewtonFactor(m));
  PetscCall(PetscFree(w->Z));
  PetscCall(PetscMalloc1(w->n_set * l + 1, &w->Z));
  /* L = W_aa^-1 (B P alpha - w): Z is its derivative by alpha. */
  for (PetscInt i = 0; i < w->n_set; i++) PetscCall(PetscArraycpy(w->Z + i * l, w->BP + w->set[i] * l, l));
  PetscCall(TakeMotions(w, w->bodies.bodies->p));
  PetscCall(BodiesNewtonBalance(w, w->bodies.bodies->p, l, NULL, w->Z, w->x));
  w->summed = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The displacements of the points' cells are exact, so that the laws of whole cells can be stepped at them
   (Settle()). Forces off the set are 0 and need no column. */
PetscErrorCode HycoBodiesMoveCells(HycoROM m, const PetscReal alpha[], const PetscReal Lambda[])
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const HycoSubstructures b = w->bodies.bodies;
  HycoBodiesInelastic in = b->inelastic;
  PetscReal *cells;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(in->nd + 1, &cells));
  PetscCall(BodiesNewtonMultiply(PETSC_FALSE, in->nd, b->r, in->R, w->bodies.c, 1, 1, cells));
  PetscCall(BodiesNewtonMultiply(PETSC_FALSE, in->nd, in->m, in->A, alpha, 1, 1, cells));
  for (PetscInt i = 0; i < in->nd; i++) cells[i] /= w->bodies.kappa[in->body[i]];
  PetscCall(BodiesNewtonMultiply(PETSC_FALSE, in->nd, b->p, in->Z, w->bodies.x, 1, 1, cells));
  for (PetscInt i = 0; i < w->n_set; i++) {
    HycoBodiesAdd(in->nd, Lambda[w->set[i]], w->column[w->set[i]] + w->gaps + w->n_rows, cells);
  }
  /* Only the points' cells have displacements afterwards; elsewhere u keeps the prescribed values alone. */
  PetscCall(PetscArraycpy(w->u, m->fe->u0, m->fe->n_dof));
  for (PetscInt i = 0; i < in->nd; i++) w->u[w->at[i]] += cells[i];
  HycoFEComplete(m->fe, w->u);
  PetscCall(PetscFree(cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesProbeCells(HycoROM m, const PetscReal alpha[], const PetscReal Lambda[])
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;

  PetscFunctionBegin;
  w->n_set = 0;
  for (PetscInt k = 0; k < w->surface.n; k++) {
    if (Lambda[k] == 0) continue;
    PetscCall(BodiesNewtonColumn(m, k));
    w->set[w->n_set++] = k;
  }
  PetscCall(HycoBodiesMoveCells(m, alpha, Lambda));
  HycoBodiesRestart(m);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* e += the strains of prescribed displacements. The responses of training are those of unprescribed displacements: what
   supports move is added here. */
static void AddSupports(HycoROM m, PetscReal e[])
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscInt ns = m->fe->n_sigma, nq = HycoElementGet(m->model->mesh->type)->nq,
                 n = m->model->mesh->nv * m->model->mesh->dim;

  for (PetscInt r = 0; r < w->n_rows && m->fe->lifted; r++) {
    const PetscInt cell = w->point[r / ns] / nq;

    for (PetscInt i = 0; i < n; i++) e[r] += w->B[r * n + i] * m->fe->u0[HycoCellUnknown(m->model->mesh, cell, i)];
  }
}

/* e0, the strains of the points at alpha = 0, with the forces z. */
static PetscErrorCode TakeStrainsOfLoads(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const HycoBodiesWork o = &w->bodies;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(w->e0, w->n_rows));
  PetscCall(BodiesNewtonMultiply(PETSC_FALSE, w->n_rows, o->bodies->r, w->loads, o->c, 1, 0, w->e0));
  AddSupports(m, w->e0);
  for (PetscInt k = 0; k < w->n_set; k++) HycoBodiesAdd(w->n_rows, w->z[k], w->column[w->set[k]] + w->gaps, w->e0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The part of the loads: forces and strains of the points at alpha = 0. */
static PetscErrorCode TakeLoads(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const HycoBodiesWork o = &w->bodies;
  const PetscInt p = o->bodies->p;
  PetscReal *work;

  PetscFunctionBegin;
  PetscCall(PetscFree(w->z));
  PetscCall(PetscMalloc1(w->n_set + 1, &w->z));
  PetscCall(HycoBodiesStrain(o, &w->surface, NULL));
  PetscCall(PetscArraycpy(w->gap, o->gap, w->surface.n));
  /* At alpha = 0 the set's forces close the gaps that the loads leave: W_aa z = -w. */
  for (PetscInt i = 0; i < w->n_set; i++) w->z[i] = -o->gap[w->set[i]];
  PetscCall(PetscCalloc1(p + 1, &work));
  for (PetscInt i = 0; i < p; i++) work[i] = HycoBodiesLoadWork(o, i);
  PetscCall(BodiesNewtonBalance(w, p, 1, work, w->z, w->x0));
  PetscCall(PetscFree(work));
  PetscCall(TakeStrainsOfLoads(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes the contacts with forces the set. *same: they are it already. */
static PetscErrorCode ChooseSet(HycoROM m, const PetscReal Lambda[], PetscBool *same)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscInt n = w->surface.n;
  PetscInt count = 0, kept = 0;

  PetscFunctionBegin;
  /* Both counts equal: the set has the same members, whatever their order. */
  for (PetscInt k = 0; k < n; k++) count += Lambda[k] > 0;
  for (PetscInt i = 0; i < w->n_set; i++) kept += Lambda[w->set[i]] > 0;
  *same = (PetscBool)(!w->fresh && w->n_set == count && kept == count);
  if (*same) PetscFunctionReturn(PETSC_SUCCESS);
  w->fresh = PETSC_FALSE;
  w->n_set = 0;
  for (PetscInt k = 0; k < n; k++) {
    if (Lambda[k] > 0) w->set[w->n_set++] = k;
  }
  PetscCall(TakeSet(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The forces on the set and the rigid motions, and whether a condition is violated. */
static PetscErrorCode BodiesNewtonCheck(HycoROM m, const PetscReal alpha[], PetscReal Lambda[], PetscBool *violated)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const HycoBodiesWork o = &w->bodies;
  const PetscInt l = o->bodies->inelastic->m, p = o->bodies->p;
  PetscReal most = 0, size = 0;

  PetscFunctionBegin;
  *violated = PETSC_FALSE;
  PetscCall(PetscArrayzero(Lambda, w->surface.n));
  PetscCall(PetscArraycpy(o->gap, w->gap, w->surface.n)); /* gap -= B P alpha */
  PetscCall(BodiesNewtonMultiply(PETSC_FALSE, w->surface.n, l, w->BP, alpha, -1, 1, o->gap));
  /* The forces are affine in alpha, as the strains are: no solve. */
  for (PetscInt i = 0; i < w->n_set; i++) {
    PetscReal *force = &Lambda[w->set[i]];

    *force = w->z[i];
    for (PetscInt k = 0; k < l; k++) *force += w->Z[i * l + k] * alpha[k];
    most = PetscMax(most, PetscAbsReal(*force));
  }
  for (PetscInt k = 0; k < w->surface.n; k++) {
    /* The scale of a violation is the largest gap without forces: near closure all gaps are round-off. */
    if (o->row_start[k] < o->row_start[k + 1]) size = PetscMax(size, PetscAbsReal(o->gap[k]));
  }
  for (PetscInt d = 0; d < p && !w->loose; d++) {
    o->x[d] = w->x0[d];
    for (PetscInt k = 0; k < l; k++) o->x[d] += w->x[d * l + k] * alpha[k];
  }
  PetscCall(BodiesNewtonMultiply(PETSC_FALSE, w->surface.n, p, w->G, o->x, -1, 1, o->gap));
  for (PetscInt k = 0; k < w->surface.n; k++) {
    PetscReal gap = o->gap[k];

    if (Lambda[k] < -VIOLATED * most) *violated = PETSC_TRUE;
    /* Closed contacts have no gap by construction; contacts without a master have none at all. */
    if (Lambda[k] != 0 || o->row_start[k] == o->row_start[k + 1]) continue;
    for (PetscInt i = 0; i < w->n_set; i++) gap += w->column[w->set[i]][k] * Lambda[w->set[i]];
    if (gap < -VIOLATED * size) *violated = PETSC_TRUE;
  }
  /* Tensile forces of round-off become 0, so that ChooseSet() does not take them for closed. */
  for (PetscInt i = 0; i < w->n_set; i++) Lambda[w->set[i]] = PetscMax(Lambda[w->set[i]], 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- Newton's method on a set -- */

/* The laws at alpha: s, r = T^T s - alpha, and its size. */
static PetscErrorCode BodiesNewtonEvaluate(HycoROM m, PetscReal t0, PetscReal t1, const PetscReal alpha[],
                                           PetscBool tangent, HycoStepAttempt *a)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoBodiesInelastic in = w->bodies.bodies->inelastic;
  const PetscReal begin = HycoNow();
  PetscReal sum[2] = {0, 0}, terms = 0;

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(w->e, w->e0, w->n_rows));
  PetscCall(AddStrains(w, in->m, alpha));
  /* The state at t0 is only read: a refused or repeated step starts from it again. */
  PetscCall(HycoFEStepPoints(m->fe, in->n_points, w->point, w->e, t0, t1, w->path->begin, w->s, w->size,
                             tangent ? w->lost : NULL, &a->law));
  a->seconds_law += HycoNow() - begin;
  if (a->law.failed) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscArrayzero(w->r, in->m));
  PetscCall(BodiesNewtonMultiply(PETSC_TRUE, w->n_rows, in->m, w->T, w->s, 1, 0, w->r));
  for (PetscInt p = 0; p < in->n_points; p++) terms += PetscSqr(w->weight[p] * w->size[p]);
  for (PetscInt k = 0; k < in->m; k++) {
    sum[0] += PetscSqr(w->r[k]);
    sum[1] += PetscSqr(alpha[k]);
    w->r[k] -= alpha[k];
  }
  /* Relative to the larger of alpha and T^T s: from alpha = 0 on, as at first yield, one of them alone would be 0. */
  w->norm = PetscSqrtReal(PetscMax(sum[0], sum[1]));
  /* s is a difference of elastic and true stresses: where a point is nearly elastic, its round-off is that of the
     terms. */
  w->floor = HYCO_NOTHING * PetscSqrtReal(terms);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Factors J = 1 - sum of T_p^T (C - C_t) S_p at the laws' tangents; it is stored by rows. */
PetscErrorCode HycoBodiesTangent(HycoROM m, HycoStepAttempt *a)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscInt ns = m->fe->n_sigma, l = w->bodies.bodies->inelastic->m;
  const PetscReal minus = -1, one = 1;
  PetscBLASInt lb, rows, info;

  PetscFunctionBegin;
  PetscCall(AddForces(w, l));
  PetscCall(PetscBLASIntCast(l, &lb));
  PetscCall(PetscBLASIntCast(w->n_rows, &rows));
  PetscCall(PetscArrayzero(w->J, l * l));
  for (PetscInt k = 0; k < l; k++) w->J[k * (l + 1)] = 1;
  PetscCall(PetscArrayzero(w->X, w->n_rows * l));
  for (PetscInt i = 0; i < w->n_rows; i++) {
    PetscReal *X = w->X + i * l;

    for (PetscInt c = 0; c < ns; c++) {
      const PetscReal lost = w->lost[i * ns + c], *S = w->S + (i / ns * ns + c) * l;

      /* C - C_t is 0 at points that stay elastic. */
      for (PetscInt k = 0; k < l && lost != 0; k++) X[k] += lost * S[k];
    }
  }
  if (l && rows) BLASgemm_("N", "T", &lb, &lb, &rows, &minus, w->X, &lb, w->T, &lb, &one, w->J, &lb);
  LAPACKgetrf_(&lb, &lb, w->J, &lb, w->pivot, &info);
  w->factored = (PetscBool)!info;
  /* No error: the path halves the step. */
  if (info) HycoFormat(a->why, "the tangent of the inelastic strains is singular");
  a->factors++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesSolveTangent(HycoBodiesPath w, PetscReal x[])
{
  PetscBLASInt lb, one = 1, info;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(w->bodies.bodies->inelastic->m, &lb));
  /* J lies by rows, LAPACK has factored J^T. */
  if (lb) LAPACKgetrs_("T", &lb, &one, w->J, &lb, w->pivot, x, &lb, &info);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* alpha += J^-1 r */
static PetscErrorCode BodiesNewtonAdvance(HycoROM m, PetscReal alpha[], HycoStepAttempt *a)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscInt l = w->bodies.bodies->inelastic->m;

  PetscFunctionBegin;
  if (a->why[0]) PetscFunctionReturn(PETSC_SUCCESS);
  /* r becomes the step, so that BodiesNewtonEvaluate() must run before the next one. */
  PetscCall(HycoBodiesSolveTangent(w, w->r));
  for (PetscInt k = 0; k < l; k++) alpha[k] += w->r[k];
  a->iterations++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Evaluates at alpha, with the tangent if there is none, or if the present one has not reduced r enough from *before,
   which becomes the norm of r. A tangent costs more than several residuals: it stays as long as it contracts. */
static PetscErrorCode EvaluateOrRenew(HycoROM m, PetscReal t0, PetscReal t1, const PetscReal alpha[], PetscReal *before,
                                      HycoStepAttempt *a)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscInt l = w->bodies.bodies->inelastic->m;
  PetscBool tangent = (PetscBool)(!w->factored || w->always);

  PetscFunctionBegin;
  a->law.failed = PETSC_FALSE;
  for (int pass = 0; pass < 2 && !a->law.failed; pass++) {
    PetscReal norm = 0;

    PetscCall(BodiesNewtonEvaluate(m, t0, t1, alpha, tangent, a));
    for (PetscInt i = 0; i < l; i++) norm += PetscSqr(w->r[i]);
    norm = PetscSqrtReal(norm);
    /* At most two passes: the second has the tangent and is always accepted. */
    if (tangent || norm <= HYCO_LAGGED_CONTRACTION * *before || norm <= PetscMax(w->path->rtol * w->norm, w->floor)) {
      *before = norm;
      break;
    }
    tangent = PETSC_TRUE;
  }
  if (tangent && !a->law.failed && *before > PetscMax(w->path->rtol * w->norm, w->floor))
    PetscCall(HycoBodiesTangent(m, a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Evaluates at alpha; with the tangent of each iteration the step from `last` is halved while r is larger than
   before. */
static PetscErrorCode EvaluateStep(HycoROM m, PetscReal t0, PetscReal t1, PetscReal alpha[], const PetscReal last[],
                                   PetscReal *norm, HycoStepAttempt *a)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscReal before = *norm;

  PetscFunctionBegin;
  PetscCall(EvaluateOrRenew(m, t0, t1, alpha, norm, a));
  for (PetscInt k = 0; k < HALVINGS && w->always && (a->law.failed || !(*norm <= before)) && a->iterations; k++) {
    /* Towards the last point, whose residual is known to be finite. */
    for (PetscInt i = 0; i < w->bodies.bodies->inelastic->m; i++) alpha[i] = (alpha[i] + last[i]) / 2;
    a->why[0] = '\0'; /* of a singular tangent at the point before */
    PetscCall(EvaluateOrRenew(m, t0, t1, alpha, norm, a));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves r = 0 on the set; else a->why. Convergence is judged relative to the size of the strains, w->norm, and to a
   floor below which all is round-off. */
static PetscErrorCode BodiesNewtonSolve(HycoROM m, PetscReal t0, PetscReal t1, PetscReal alpha[], HycoStepAttempt *a)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  /* Of each set or map: how many a step has is a matter of its rounds. */
  const PetscInt most = a->iterations + (w->path->max_its ? w->path->max_its : MOST_ITS);
  /* PETSC_MAX_REAL: the first residual contracts from it, and the tangent of the last step stays. */
  PetscReal norm = PETSC_MAX_REAL, *last;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(w->bodies.bodies->inelastic->m + 1, &last));
  PetscCall(PetscArraycpy(last, alpha, w->bodies.bodies->inelastic->m));
  while (!a->why[0]) {
    PetscCall(EvaluateStep(m, t0, t1, alpha, last, &norm, a));
    if (a->law.failed) {
      HycoFormat(a->why, "%s", a->law.why);
      break;
    }
    a->residual = norm > w->floor ? norm / w->norm : 0;
    if (norm <= PetscMax(w->path->rtol * w->norm, w->floor)) break;
    if (a->iterations >= most || PetscIsInfOrNanReal(norm)) {
      HycoFormat(a->why, "the residual of the inelastic strains is %.1e after %d iterations", (double)a->residual,
                 (int)a->iterations);
      break;
    }
    PetscCall(PetscArraycpy(last, alpha, w->bodies.bodies->inelastic->m));
    PetscCall(BodiesNewtonAdvance(m, alpha, a));
  }
  PetscCall(PetscFree(last));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- sets -- */

/* Without a force there is no set to begin with, as in the first step of a path or after a contact has opened. */
static PetscBool BodiesNewtonHasForce(HycoROM m, const PetscReal Lambda[])
{
  const HycoBodiesPath w = (HycoBodiesPath)m->work;

  for (PetscInt k = 0; k < w->surface.n; k++) {
    if (Lambda[k] > 0) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* The forces of the contact problem at alpha. */
static PetscErrorCode BodiesNewtonContacts(HycoROM m, const PetscReal alpha[], PetscReal Lambda[], HycoStepAttempt *a)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  PetscBool solved;

  PetscFunctionBegin;
  PetscCall(HycoBodiesStrain(&w->bodies, &w->surface, alpha));
  PetscCall(HycoBodiesContact(&w->bodies, &w->surface, Lambda, &solved));
  /* Reported as iterations of contact problems, apart from those of Newton's method. */
  a->active_its += w->bodies.its;
  if (!solved) HycoFormat(a->why, "the contact problem has no solution");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The set of these forces; or of the contact problem's, if it does not determine the rigid motions. Without any closed
   contact these are those of the contact problem, and no load acts on them. */
static PetscErrorCode BodiesNewtonChoose(HycoROM m, const PetscReal alpha[], PetscReal Lambda[], PetscBool *same,
                                         HycoStepAttempt *a)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;

  PetscFunctionBegin;
  PetscCall(ChooseSet(m, Lambda, same));
  if (!w->loose || !w->n_set || a->why[0]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(BodiesNewtonContacts(m, alpha, Lambda, a));
  PetscCall(ChooseSet(m, Lambda, same));
  if (w->loose && w->n_set && !a->why[0])
    HycoFormat(a->why, "the closed contacts do not determine the motion of a body that contact alone holds");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- friction -- */

/* Force i of the set by the linear map. */
static PetscReal BodiesNewtonMapped(const HycoBodiesPath w, PetscInt l, PetscInt i, const PetscReal alpha[])
{
  PetscReal force = w->z[i];

  for (PetscInt k = 0; k < l; k++) force += w->Z[i * l + k] * alpha[k];
  return force;
}

/* The linear map at the contact problem's solution for alpha, and the strains with it. */
static PetscErrorCode TakeStates(HycoROM m, const PetscReal alpha[], HycoStepAttempt *a)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscInt l = w->bodies.bodies->inelastic->m;
  const PetscReal *L = HycoBodiesFrictionForces(w->friction);
  PetscBool changed = w->fresh, regular;

  PetscFunctionBegin;
  if (w->fresh) w->factored = PETSC_FALSE;
  PetscCall(HycoBodiesFrictionDerive(w->friction, l, w->BP, &changed, &w->n_set, w->set, &w->Z, &regular));
  if (!regular) HycoFormat(a->why, "the contact forces with friction have no derivative");
  w->fresh = (PetscBool)!regular;
  if (changed) {
    /* The tangent of other states stays while it contracts, like that of other strains. */
    w->summed = PETSC_FALSE;
    for (PetscInt k = 0; k < w->n_set; k++) PetscCall(BodiesNewtonColumn(m, w->set[k]));
    PetscCall(PetscFree(w->z));
    PetscCall(PetscMalloc1(w->n_set + 1, &w->z));
  }
  for (PetscInt i = 0; i < w->n_set; i++) {
    w->z[i] = 0;
    w->z[i] = L[w->set[i]] - BodiesNewtonMapped(w, l, i, alpha);
  }
  PetscCall(TakeStrainsOfLoads(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the forces at alpha are those of the linear map. */
static PetscBool BodiesNewtonMapAgrees(HycoROM m, const PetscReal alpha[])
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscReal *L = HycoBodiesFrictionForces(w->friction);
  PetscReal most = 0, apart = 0;
  PetscInt i = 0;

  for (PetscInt k = 0; k < w->surface.n; k++) {
    PetscReal force = 0;

    if (i < w->n_set && w->set[i] == k) force = BodiesNewtonMapped(w, w->bodies.bodies->inelastic->m, i++, alpha);
    most = PetscMax(most, PetscAbsReal(L[k]));
    apart = PetscMax(apart, PetscAbsReal(L[k] - force));
  }
  return (PetscBool)(apart <= MAP_AGREES * most);
}

/* The contact problem at alpha. */
static PetscErrorCode BodiesNewtonSolveContact(HycoROM m, PetscReal t1, const PetscReal alpha[], PetscBool again,
                                               HycoStepAttempt *a)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  PetscBool solved, no_equilibrium = PETSC_FALSE;
  PetscInt its;
  char name[HYCO_LINE] = "";

  PetscFunctionBegin;
  PetscCall(
      HycoBodiesFrictionSolveContact(w->friction, &w->bodies, t1, w->n_rows ? alpha : NULL, again, &its, &solved));
  a->active_its += its;
  if (!solved) HycoFormat(a->why, "no equilibrium: no contact forces with this friction balance the load");
  if (!solved) PetscCall(HycoBodiesFrictionNoEquilibrium(w->friction, &w->bodies, name, &no_equilibrium));
  if (no_equilibrium)
    HycoFormat(w->path->no_equilibrium, "%s%s%s", a->why,
               name[0] ? "; no support keeps " : "; a body that contact alone holds slides away", name);
  if (!solved && w->path->no_equilibrium[0]) HycoFormat(a->why, "%s", w->path->no_equilibrium);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Elastic bodies have the first contact problem alone. */
static PetscErrorCode SearchStates(HycoROM m, PetscReal t0, PetscReal t1, PetscReal alpha[], HycoStepAttempt *a)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  PetscBool done = (PetscBool)!w->n_rows;

  PetscFunctionBegin;
  PetscCall(BodiesNewtonSolveContact(m, t1, alpha, PETSC_FALSE, a));
  if (done) a->iterations = 1;
  for (PetscInt round = 0; !done && round < ROUNDS && !a->why[0]; round++) {
    const PetscInt before = a->iterations;

    /* A map that is kept converges in few rounds, or is made again. */
    if (round >= KEPT) w->fresh = PETSC_TRUE;
    PetscCall(TakeStates(m, alpha, a));
    if (!a->why[0]) PetscCall(BodiesNewtonSolve(m, t0, t1, alpha, a));
    /* alpha is that of the contact problem. */
    done = (PetscBool)(a->iterations == before);
    if (done || a->why[0]) break;
    PetscCall(BodiesNewtonSolveContact(m, t1, alpha, PETSC_TRUE, a));
    done = BodiesNewtonMapAgrees(m, alpha);
  }
  if (!done && !a->why[0]) HycoFormat(a->why, "contacts stick and slip in turn");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- derivatives of a step -- */

PetscErrorCode HycoBodiesTakeSet(HycoROM m, const PetscReal Lambda[])
{
  PetscBool same;

  PetscFunctionBegin;
  PetscCall(ChooseSet(m, Lambda, &same));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesTakeMap(HycoROM m, const PetscReal alpha[], HycoStepAttempt *a)
{
  PetscFunctionBegin;
  ((HycoBodiesPath)m->work)->fresh = PETSC_TRUE; /* that of these directions of slip */
  PetscCall(TakeStates(m, alpha, a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesMoveSet(HycoBodiesPath w, const PetscReal q[], PetscReal dz[])
{
  const PetscInt p = w->bodies.bodies->p;
  PetscReal *force, *work;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(dz, p + w->surface.n));
  PetscCall(PetscMalloc2(w->n_set + 1, &force, p + 1, &work));
  for (PetscInt i = 0; i < w->n_set; i++) force[i] = -q[p + w->set[i]];
  for (PetscInt d = 0; d < p; d++) work[d] = -q[d];
  PetscCall(BodiesNewtonBalance(w, p, 1, work, force, dz));
  for (PetscInt i = 0; i < w->n_set; i++) dz[p + w->set[i]] = force[i];
  PetscCall(PetscFree2(force, work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- a step -- */

/* The set of the last step first: in most steps it holds, and no contact problem is solved at all. */
PetscErrorCode HycoBodiesSearch(HycoROM m, PetscReal t0, PetscReal t1, PetscReal alpha[], PetscReal Lambda[],
                                HycoStepAttempt *a)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  PetscBool same, violated = PETSC_TRUE;

  PetscFunctionBegin;
  if (w->bodies.lacks) HycoFormat(a->why, "%s", HycoReasonName(HYCO_DIVERGED_SURFACE));
  if (a->why[0]) PetscFunctionReturn(PETSC_SUCCESS);
  if (w->friction) {
    PetscCall(SearchStates(m, t0, t1, alpha, a));
    HycoBodiesFrictionNormal(w->friction, Lambda);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  /* The forces of the contact problem name the next set. Opening and closing single contacts by the sign of their
     violation would cycle. */
  if (!BodiesNewtonHasForce(m, Lambda)) PetscCall(BodiesNewtonContacts(m, alpha, Lambda, a));
  PetscCall(BodiesNewtonChoose(m, alpha, Lambda, &same, a));
  for (PetscInt round = 0; violated && round < ROUNDS && !a->why[0]; round++) {
    /* Again in each round: e0 and z belong to the set. */
    PetscCall(TakeLoads(m));
    PetscCall(BodiesNewtonSolve(m, t0, t1, alpha, a));
    if (a->why[0]) break;
    PetscCall(BodiesNewtonCheck(m, alpha, Lambda, &violated));
    if (!violated) break;
    PetscCall(BodiesNewtonContacts(m, alpha, Lambda, a));
    PetscCall(BodiesNewtonChoose(m, alpha, Lambda, &same, a));
    if (same) break; /* the violation was round-off */
    violated = PETSC_TRUE;
  }
  if (violated && !a->why[0] && !same) HycoFormat(a->why, "contacts open and close in turn");
  PetscFunctionReturn(PETSC_SUCCESS);
}
