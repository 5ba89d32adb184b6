/*
  Paths of bodies that deform inelastically. With alpha, the coefficients of the nodal forces of inelastic strains, all
  displacements are linear in loads, alpha and contact forces L, exactly but for the modes:

      u = (R c + P alpha - C B^T L) / kappa

  On a set of closed contacts, L = W_aa^-1 (B P alpha - w), so that the displacements of the cells with laws are affine
  in alpha alone, u = u_0 + S alpha, and one step in time is the small problem

      r(alpha) = T^T q(u_0 + S alpha) - alpha = 0,      dr/dalpha = sum over these cells of T_e^T (K_e - K_e,t) S_e - 1

  solved by Newton's method; its tangent is kept while it contracts, also from step to step. Then the set is checked: forces, and gaps of all contacts;
  if one is violated, the contact problem at alpha gives the next set. The set of a step is the first one of the next.
*/
#include "bodies_path.h"
#include <petscblaslapack.h>

#define ROUNDS    30    /* of sets in a step */
#define MOST_ITS  30    /* of Newton's method in a step */
#define HALVINGS  6     /* of a step of Newton's method */
#define CONTRACTS 0.2   /* of the residual in an iteration: more, and the tangent is made again */
#define VIOLATED  1e-11 /* share of the largest force or gap: less is round-off */
#define DEPENDENT 1e-12 /* share of the diagonal of W: contacts that repeat others */

/* -- responses of contacts -- */

PetscErrorCode HycoBodiesForget(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;

  PetscFunctionBegin;
  for (PetscInt k = 0; w->column && k < m->model->pairs.n; k++) PetscCall(PetscFree(w->column[k]));
  w->n_set = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscInt BodyOf(HycoSubstructures b, PetscInt place)
{
  PetscInt k = 0;

  while (place >= b->start[k + 1]) k++;
  return k;
}

/* The displacements of the surfaces by a unit force at contact k, y. */
static void Push(HycoBodiesWork o, PetscInt k, PetscReal y[])
{
  const HycoSubstructures b = o->bodies;

  PetscCallVoid(PetscArrayzero(y, b->ns));
  for (PetscInt e = o->row_start[k]; e < o->row_start[k + 1]; e++) {
    const PetscInt body = BodyOf(b, o->row_at[e]), lo = b->start[body];
    const HycoSubstructure *own = &b->body[body];

    for (PetscInt q = 0; q < own->n_samples; q++) {
      const PetscReal *C = own->C + ((size_t)q * (size_t)own->n + (size_t)(o->row_at[e] - lo)) * (size_t)own->n;
      const PetscReal share = o->weight[body][q] * o->row[e] / o->kappa[body];

      for (PetscInt i = 0; i < own->n; i++) y[lo + i] -= share * C[i];
    }
  }
}

/* The column of contact k, if it is not there. */
static PetscErrorCode Column(HycoROM m, PetscInt k)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const HycoBodiesWork o = &w->bodies;
  const HycoSubstructures b = o->bodies;
  HycoBodiesInelastic in = b->inelastic;
  const PetscInt n = m->model->pairs.n;
  PetscReal *y;

  PetscFunctionBegin;
  if (w->column[k]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc1(n + in->nd + 1, &w->column[k]));
  PetscCall(PetscMalloc1(b->ns + 1, &y));
  Push(o, k, y);
  for (PetscInt j = 0; j < n; j++) {
    for (PetscInt e = o->row_start[j]; e < o->row_start[j + 1]; e++) w->column[k][j] -= o->row[e] * y[o->row_at[e]];
  }
  for (PetscInt i = 0; i < in->nd; i++) {
    const PetscReal *C = in->C + (size_t)i * (size_t)b->ns;

    for (PetscInt e = o->row_start[k]; e < o->row_start[k + 1]; e++)
      w->column[k][n + i] -= C[o->row_at[e]] * o->row[e] / o->kappa[in->body[i]];
  }
  PetscCall(PetscFree(y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void HycoBodiesScale(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const HycoBodiesWork o = &w->bodies;
  const HycoSubstructures b = o->bodies;
  HycoBodiesInelastic in = b->inelastic;
  const PetscInt l = in->m;

  PetscCallVoid(PetscArrayzero(w->BP, m->model->pairs.n * l));
  for (PetscInt k = 0; k < m->model->pairs.n; k++) {
    for (PetscInt e = o->row_start[k]; e < o->row_start[k + 1]; e++) {
      const PetscReal value = o->row[e] / o->kappa[BodyOf(b, o->row_at[e])];

      for (PetscInt j = 0; j < l; j++) w->BP[k * l + j] += value * in->P[o->row_at[e] * l + j];
    }
  }
  for (PetscInt i = 0; i < in->nd * l; i++) w->response[i] = in->A[i] / o->kappa[in->body[i / l]];
}

/* -- a set of closed contacts -- */

/* Factors W_aa, contact by contact; those that depend on the ones before them leave the set. */
static PetscErrorCode Factor(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscInt n = w->n_set;

  PetscFunctionBegin;
  PetscCall(PetscFree(w->U));
  PetscCall(PetscMalloc1((size_t)n * (size_t)n + 1, &w->U));
  w->n_set = 0;
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt contact = w->set[k], rank = w->n_set;
    PetscReal *u = w->U + (size_t)rank * (size_t)n, pivot;

    PetscCall(Column(m, contact));
    pivot = w->column[contact][contact];
    for (PetscInt i = 0; i < rank; i++) {
      const PetscReal *other = w->U + (size_t)i * (size_t)n;

      u[i] = w->column[contact][w->set[i]];
      for (PetscInt d = 0; d < i; d++) u[i] -= other[d] * u[d];
      u[i] /= other[i];
      pivot -= u[i] * u[i];
    }
    if (!(pivot > DEPENDENT * w->column[contact][contact])) continue;
    u[rank] = PetscSqrtReal(pivot);
    w->set[w->n_set++] = contact;
  }
  for (PetscInt j = 0; j < w->n_set; j++) PetscCall(PetscArraymove(w->U + j * w->n_set, w->U + j * n, j + 1));
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

/* What depends on the set but not on the loads: the factor, Z, S. */
static PetscErrorCode TakeSet(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoBodiesInelastic in = w->bodies.bodies->inelastic;
  const PetscInt l = in->m, n = m->model->pairs.n;

  PetscFunctionBegin;
  w->factored = PETSC_FALSE;
  PetscCall(Factor(m));
  PetscCall(PetscFree(w->Z));
  PetscCall(PetscMalloc1(w->n_set * l + 1, &w->Z));
  for (PetscInt i = 0; i < w->n_set; i++) PetscCall(PetscArraycpy(w->Z + i * l, w->BP + w->set[i] * l, l));
  SolveOnSet(w, l, w->Z);
  PetscCall(PetscArraycpy(w->S, w->response, in->nd * l));
  for (PetscInt i = 0; i < w->n_set; i++) {
    const PetscReal *cell = w->column[w->set[i]] + n;

    for (PetscInt j = 0; j < in->nd; j++) {
      for (PetscInt k = 0; k < l; k++) w->S[j * l + k] += cell[j] * w->Z[i * l + k];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The part of the loads: forces and displacements of the cells at alpha = 0. */
static PetscErrorCode TakeLoads(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const HycoBodiesWork o = &w->bodies;
  const HycoSubstructures b = o->bodies;
  HycoBodiesInelastic in = b->inelastic;
  const HycoBodiesSurface s = HycoBodiesSurfaceOf(m);

  PetscFunctionBegin;
  PetscCall(PetscFree(w->z));
  PetscCall(PetscMalloc1(w->n_set + 1, &w->z));
  PetscCall(HycoBodiesStrain(o, &s, NULL));
  for (PetscInt i = 0; i < w->n_set; i++) w->z[i] = -o->gap[w->set[i]];
  SolveOnSet(w, 1, w->z);
  for (PetscInt i = 0; i < in->nd; i++) {
    w->u0[i] = 0;
    for (PetscInt j = 0; j < b->r; j++) w->u0[i] += in->R[i * b->r + j] * o->c[j] / o->kappa[in->body[i]];
    for (PetscInt k = 0; k < w->n_set; k++) w->u0[i] += w->column[w->set[k]][m->model->pairs.n + i] * w->z[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes the contacts with forces the set. *same: they are it already. */
static PetscErrorCode ChooseSet(HycoROM m, const PetscReal Lambda[], PetscBool *same)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscInt n = m->model->pairs.n;
  PetscInt count = 0, kept = 0;

  PetscFunctionBegin;
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

/* The forces on the set, and whether a condition is violated. */
static PetscErrorCode Check(HycoROM m, const PetscReal alpha[], PetscReal Lambda[], PetscBool *violated)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const HycoBodiesWork o = &w->bodies;
  const HycoSubstructures b = o->bodies;
  const HycoBodiesSurface s = HycoBodiesSurfaceOf(m);
  const PetscInt l = b->inelastic->m;
  PetscReal most = 0, size = 0;

  PetscFunctionBegin;
  *violated = PETSC_FALSE;
  PetscCall(PetscArrayzero(Lambda, m->model->pairs.n));
  PetscCall(HycoBodiesStrain(o, &s, alpha));
  for (PetscInt i = 0; i < w->n_set; i++) {
    PetscReal *force = &Lambda[w->set[i]];

    *force = w->z[i];
    for (PetscInt k = 0; k < l; k++) *force += w->Z[i * l + k] * alpha[k];
    most = PetscMax(most, PetscAbsReal(*force));
  }
  for (PetscInt k = 0; k < m->model->pairs.n; k++) {
    if (o->row_start[k] < o->row_start[k + 1]) size = PetscMax(size, PetscAbsReal(o->gap[k]));
  }
  for (PetscInt k = 0; k < m->model->pairs.n; k++) {
    PetscReal gap = o->gap[k];

    if (Lambda[k] < -VIOLATED * most) *violated = PETSC_TRUE;
    if (Lambda[k] != 0 || o->row_start[k] == o->row_start[k + 1]) continue;
    for (PetscInt i = 0; i < w->n_set; i++) gap += w->column[w->set[i]][k] * Lambda[w->set[i]];
    if (gap < -VIOLATED * size) *violated = PETSC_TRUE;
  }
  for (PetscInt i = 0; i < w->n_set; i++) Lambda[w->set[i]] = PetscMax(Lambda[w->set[i]], 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- Newton's method on a set -- */

/* u = u_0 + S alpha on the unknowns of the cells. */
static void Displace(HycoROM m, const PetscReal alpha[])
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoBodiesInelastic in = w->bodies.bodies->inelastic;

  PetscCallVoid(PetscArraycpy(w->u, m->fe->u0, m->fe->n_dof));
  for (PetscInt i = 0; i < in->nd; i++) {
    PetscReal u = w->u0[i];

    for (PetscInt k = 0; k < in->m; k++) u += w->S[i * in->m + k] * alpha[k];
    w->u[w->at[i]] += u;
  }
  HycoFEComplete(m->fe, w->u);
}

/* The laws at alpha: q, r = T^T q - alpha, and its size. */
static PetscErrorCode Evaluate(HycoROM m, PetscReal t0, PetscReal t1, const PetscReal alpha[], PetscBool tangent,
                               HycoStepAttempt *a)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoPath p = w->path;
  HycoMesh mesh = m->model->mesh;
  const PetscInt n = mesh->nv * mesh->dim, l = w->bodies.bodies->inelastic->m;
  const PetscReal *T = w->bodies.bodies->inelastic->T, begin = HycoNow();
  PetscReal sum[2] = {0, 0}, size, terms = 0;

  PetscFunctionBegin;
  Displace(m, alpha);
  PetscCall(PetscMemzero(&a->law, sizeof(a->law)));
  PetscCall(PetscArrayzero(p->f_local, m->fe->n_dof));
  PetscCall(HycoFEStepBodies(m->fe, HYCO_BODIES_FLOWING, w->u, t0, t1, p->begin, p->end, p->f_local, tangent, &a->law));
  a->seconds_law += HycoNow() - begin;
  if (a->law.failed) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscArrayzero(w->r, l));
  for (PetscInt e = 0; e < mesh->n_cells; e++) {
    PetscReal *q = w->q + e * n;

    if (!HycoInelasticFlows(m->fe, e)) continue;
    PetscCall(HycoInelasticCellForce(m->fe, e, w->Ke + e * n * n, w->heat + e * n, w->u, p->end, q, &size));
    terms += PetscSqr(w->weight[e] * size);
    for (PetscInt i = 0; i < n; i++) {
      for (PetscInt k = 0; k < l; k++) w->r[k] += T[(e * n + i) * l + k] * q[i];
    }
  }
  for (PetscInt k = 0; k < l; k++) {
    sum[0] += PetscSqr(w->r[k]);
    sum[1] += PetscSqr(alpha[k]);
    w->r[k] -= alpha[k];
  }
  w->norm = PetscSqrtReal(PetscMax(sum[0], sum[1]));
  w->floor = 16 * PETSC_MACHINE_EPSILON * PetscSqrtReal(terms);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* J -= T_e^T (K_e - K_e,t) S_e; work: 2 n m. */
static PetscErrorCode AddCell(HycoROM m, PetscInt e, PetscReal work[])
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscInt n = m->model->mesh->nv * m->model->mesh->dim, l = w->bodies.bodies->inelastic->m;
  PetscReal lost[HYCO_MAX_CELL_DOFS * HYCO_MAX_CELL_DOFS], *S = work, *X = work + n * l;
  const PetscReal minus = -1, one = 1, zero = 0;
  PetscBLASInt lb, nb;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(l, &lb));
  PetscCall(PetscBLASIntCast(n, &nb));
  PetscCall(HycoFEBodyStiffness(m->fe, e, lost));
  for (PetscInt i = 0; i < n * n; i++) lost[i] = w->Ke[e * n * n + i] - lost[i];
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt row = w->cell_at[e * n + i];

    if (row < 0)
      PetscCall(PetscArrayzero(S + i * l, l));
    else
      PetscCall(PetscArraycpy(S + i * l, w->S + row * l, l));
  }
  /* rows of S, X and T_e are l long */
  BLASgemm_("N", "N", &lb, &nb, &nb, &one, S, &lb, lost, &nb, &zero, X, &lb);
  BLASgemm_("N", "T", &lb, &lb, &nb, &minus, X, &lb, w->bodies.bodies->inelastic->T + (size_t)(e * n) * (size_t)l, &lb,
            &one, w->J, &lb);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Factors J = 1 - sum of T_e^T (K_e - K_e,t) S_e at the laws' tangents; it is stored by rows. */
static PetscErrorCode Tangent(HycoROM m, HycoStepAttempt *a)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscInt n = m->model->mesh->nv * m->model->mesh->dim, l = w->bodies.bodies->inelastic->m;
  PetscReal *work;
  PetscBLASInt lb, info;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(l, &lb));
  PetscCall(PetscArrayzero(w->J, l * l));
  for (PetscInt k = 0; k < l; k++) w->J[k * (l + 1)] = 1;
  PetscCall(PetscMalloc1(2 * n * l + 1, &work));
  for (PetscInt e = 0; e < m->model->mesh->n_cells; e++) {
    if (HycoInelasticFlows(m->fe, e)) PetscCall(AddCell(m, e, work));
  }
  PetscCall(PetscFree(work));
  LAPACKgetrf_(&lb, &lb, w->J, &lb, w->pivot, &info);
  w->factored = (PetscBool)!info;
  if (info) HycoFormat(a->why, "the tangent of the inelastic strains is singular");
  a->factors++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* alpha += J^-1 r */
static PetscErrorCode Advance(HycoROM m, PetscReal alpha[], HycoStepAttempt *a)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscInt l = w->bodies.bodies->inelastic->m;
  PetscBLASInt lb, one = 1, info;

  PetscFunctionBegin;
  if (a->why[0]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscBLASIntCast(l, &lb));
  LAPACKgetrs_("T", &lb, &one, w->J, &lb, w->pivot, w->r, &lb, &info);
  for (PetscInt k = 0; k < l; k++) alpha[k] += w->r[k];
  a->iterations++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Evaluates at alpha, with the tangent if there is none, or if the present one has not reduced r enough from *before,
   which becomes the norm of r. */
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

    PetscCall(Evaluate(m, t0, t1, alpha, tangent, a));
    for (PetscInt i = 0; i < l; i++) norm += PetscSqr(w->r[i]);
    norm = PetscSqrtReal(norm);
    if (tangent || norm <= CONTRACTS * *before || norm <= PetscMax(w->path->rtol * w->norm, w->floor)) {
      *before = norm;
      break;
    }
    tangent = PETSC_TRUE;
  }
  if (tangent && !a->law.failed && *before > PetscMax(w->path->rtol * w->norm, w->floor)) PetscCall(Tangent(m, a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Evaluates at alpha; with the tangent of each iteration the step from `last` is halved while r is larger than before. */
static PetscErrorCode EvaluateStep(HycoROM m, PetscReal t0, PetscReal t1, PetscReal alpha[], const PetscReal last[],
                                   PetscReal *norm, HycoStepAttempt *a)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscReal before = *norm;

  PetscFunctionBegin;
  PetscCall(EvaluateOrRenew(m, t0, t1, alpha, norm, a));
  for (PetscInt k = 0; k < HALVINGS && w->always && (a->law.failed || !(*norm <= before)) && a->iterations; k++) {
    for (PetscInt i = 0; i < w->bodies.bodies->inelastic->m; i++) alpha[i] = (alpha[i] + last[i]) / 2;
    PetscCall(EvaluateOrRenew(m, t0, t1, alpha, norm, a));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves r = 0 on the set; else a->why. */
static PetscErrorCode Newton(HycoROM m, PetscReal t0, PetscReal t1, PetscReal alpha[], HycoStepAttempt *a)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscInt most = w->path->max_its ? w->path->max_its : MOST_ITS;
  PetscReal norm = PETSC_MAX_REAL, *last;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(w->bodies.bodies->inelastic->m + 1, &last));
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
    PetscCall(Advance(m, alpha, a));
  }
  PetscCall(PetscFree(last));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- sets -- */

static PetscBool Presses(HycoROM m, const PetscReal Lambda[])
{
  for (PetscInt k = 0; k < m->model->pairs.n; k++) {
    if (Lambda[k] > 0) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* The forces of the contact problem at alpha. */
static PetscErrorCode Contacts(HycoROM m, const PetscReal alpha[], PetscReal Lambda[], HycoStepAttempt *a)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const HycoBodiesSurface s = HycoBodiesSurfaceOf(m);
  PetscBool solved;

  PetscFunctionBegin;
  PetscCall(HycoBodiesStrain(&w->bodies, &s, alpha));
  PetscCall(HycoBodiesContact(&w->bodies, &s, Lambda, &solved));
  a->active_its += w->bodies.its;
  if (!solved) HycoFormat(a->why, "the contact problem has no solution");
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesSearch(HycoROM m, PetscReal t0, PetscReal t1, PetscReal alpha[], PetscReal Lambda[],
                                HycoStepAttempt *a)
{
  PetscBool same, violated = PETSC_TRUE;

  PetscFunctionBegin;
  if (!Presses(m, Lambda)) PetscCall(Contacts(m, alpha, Lambda, a));
  PetscCall(ChooseSet(m, Lambda, &same));
  for (PetscInt round = 0; violated && round < ROUNDS && !a->why[0]; round++) {
    PetscCall(TakeLoads(m));
    PetscCall(Newton(m, t0, t1, alpha, a));
    if (a->why[0]) break;
    PetscCall(Check(m, alpha, Lambda, &violated));
    if (!violated) break;
    PetscCall(Contacts(m, alpha, Lambda, a));
    PetscCall(ChooseSet(m, Lambda, &same));
    if (same) break; /* the violation was round-off */
    violated = PETSC_TRUE;
  }
  if (violated && !a->why[0] && !same) HycoFormat(a->why, "contacts open and close in turn");
  PetscFunctionReturn(PETSC_SUCCESS);
}
