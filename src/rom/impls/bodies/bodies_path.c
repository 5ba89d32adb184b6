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
#include <hycobodies.h>
#include <hycoinelasticmodes.h>
#include <hycopath.h>
#include <petscblaslapack.h>
#include <petscviewer.h>

#define ROUNDS    30    /* of sets in a step */
#define MOST_ITS  30    /* of Newton's method in a step */
#define HALVINGS  6     /* of a step of Newton's method */
#define CONTRACTS 0.2   /* of the residual in an iteration: more, and the tangent is made again */
#define VIOLATED  1e-11 /* share of the largest force or gap: less is round-off */
#define DEPENDENT 1e-12 /* share of the diagonal of W: contacts that repeat others */
#define USELESS   0.5   /* mean error of the training displacements */

typedef struct _n_HycoBodiesPath {
  struct _n_HycoBodiesWork bodies; /* the first, as in the model without a history */
  HycoPath path;
  Vec alpha, L;
  PetscInt *at, *cell_at;        /* by unknown of the cells: of fe's mesh; by cell and its unknown: its row, or -1 */
  PetscReal *Ke, *heat, *weight; /* by cell: elastic stiffness, force of thermal strains, 2-norm of its part of T */
  PetscReal *BP, *response;      /* contacts x m: B P / kappa; nd x m: A / kappa */
  PetscReal **column;       /* by contact: gaps of all contacts, then cells, for a unit force; NULL: not needed yet */
  PetscBool fresh;          /* rows or stiffness have changed since the set was factored */
  PetscInt n_set, *set;     /* closed contacts */
  PetscReal *U;             /* n_set x n_set: upper factor of W_aa */
  PetscReal *Z, *S;         /* n_set x m: forces per alpha; nd x m: displacements of the cells per alpha */
  PetscReal *z, *u0;        /* n_set, nd: the same at alpha = 0 */
  PetscReal *u, *q, *r, *J; /* n_dof, columns of T, m, m x m */
  PetscBLASInt *pivot;      /* of J's factor, */
  PetscBool factored;       /* which belongs to the set */
  PetscBool always;         /* a new tangent in each iteration */
  PetscReal norm, floor;    /* of alpha and T q; of r: round-off */
  PetscReal misfit;         /* of q in the span of the modes in the cells, the largest of the listed times */
} * HycoBodiesPath;

static HycoBodiesSurface SurfaceOf(HycoROM m)
{
  return (HycoBodiesSurface){m->fe, &m->model->pairs, &m->rows};
}

/* -- responses of contacts -- */

static PetscErrorCode Forget(HycoBodiesPath w, PetscInt n)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; w->column && k < n; k++) PetscCall(PetscFree(w->column[k]));
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

/* B P / kappa and A / kappa. */
static void Scale(HycoROM m)
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
  const HycoBodiesSurface s = SurfaceOf(m);

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
  const HycoBodiesSurface s = SurfaceOf(m);
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

/* -- ops of the path -- */

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
  const HycoBodiesSurface s = SurfaceOf(m);
  PetscBool solved;

  PetscFunctionBegin;
  PetscCall(HycoBodiesStrain(&w->bodies, &s, alpha));
  PetscCall(HycoBodiesContact(&w->bodies, &s, Lambda, &solved));
  a->active_its += w->bodies.its;
  if (!solved) HycoFormat(a->why, "the contact problem has no solution");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Newton's method on sets of contacts until one holds. */
static PetscErrorCode Search(HycoROM m, PetscReal t0, PetscReal t1, PetscReal alpha[], PetscReal Lambda[],
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

/* Displacements of the surfaces and the cells, and the residuals, recomputed from them. */
static void Settle(HycoROM m, const PetscReal Lambda[], HycoStepAttempt *a)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const HycoBodiesSurface s = SurfaceOf(m);

  PetscCallVoid(PetscArraycpy(m->Lambda, Lambda, m->model->pairs.n));
  HycoBodiesGiven(&w->bodies, &s, Lambda);
  HycoBodiesMove(&w->bodies, &s, m->U);
  for (PetscInt i = 0; i < w->bodies.bodies->inelastic->nd; i++) m->U[w->at[i]] = w->u[w->at[i]];
  HycoBodiesMeasure(m, &w->path->kkt);
  w->path->kkt.stationarity = a->residual;
  a->converged = (PetscBool)(HycoKKTMax(&w->path->kkt) <= 1e-8);
  if (!a->converged) HycoFormat(a->why, "the residual of the contacts is %.1e", (double)HycoKKTMax(&w->path->kkt));
}

/* alpha and the forces of the last accepted time. */
static PetscErrorCode Retry(HycoPath p, PetscReal alpha[], PetscReal Lambda[])
{
  const PetscScalar *old;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(p->U_old, &old));
  PetscCall(PetscArraycpy(alpha, old, p->n_free));
  PetscCall(VecRestoreArrayRead(p->U_old, &old));
  PetscCall(VecGetArrayRead(p->L_old, &old));
  PetscCall(PetscArraycpy(Lambda, old, p->n_contacts));
  PetscCall(VecRestoreArrayRead(p->L_old, &old));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Iterate(HycoPath p, PetscReal t0, PetscReal t1, HycoStepAttempt *a)
{
  HycoROM m = (HycoROM)p->ctx;
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  PetscScalar *alpha, *L;

  PetscFunctionBegin;
  PetscCall(VecGetArray(p->U, &alpha));
  PetscCall(VecGetArray(p->Lambda, &L));
  w->always = (PetscBool)(p->method == HYCO_NEWTON_TANGENT);
  PetscCall(Search(m, t0, t1, alpha, L, a));
  if (a->why[0] && !w->always) { /* again from the begin of the step */
    PetscCall(Retry(p, alpha, L));
    a->why[0] = '\0';
    a->iterations = 0;
    w->always = PETSC_TRUE;
    PetscCall(Search(m, t0, t1, alpha, L, a));
  }
  if (!a->why[0]) Settle(m, L, a);
  PetscCall(VecRestoreArray(p->U, &alpha));
  PetscCall(VecRestoreArray(p->Lambda, &L));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Elastic stiffness and forces of heat of the cells, with elastic tangents. */
static PetscErrorCode PrepareCells(HycoROM m, PetscBool stiffness)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscInt n = m->model->mesh->nv * m->model->mesh->dim;
  PetscReal load[HYCO_MAX_CELL_DOFS];

  PetscFunctionBegin;
  PetscCall(HycoFEElasticTangent(m->fe));
  for (PetscInt e = 0; e < m->model->mesh->n_cells; e++) {
    if (stiffness) PetscCall(HycoFEBodyStiffness(m->fe, e, w->Ke + e * n * n));
    PetscCall(HycoInelasticCellLoad(m->fe, e, load, w->heat + e * n));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Assemble(HycoPath p, const PetscReal mu[], PetscBool elastic)
{
  HycoROM m = (HycoROM)p->ctx;
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const HycoBodiesSurface s = SurfaceOf(m);
  PetscBool stiffness, rows;

  PetscFunctionBegin;
  (void)elastic;
  PetscCall(HycoROMBringRows(m, mu));
  stiffness = m->fe->stiffness_changed;
  rows = m->fe->contact_changed;
  PetscCall(PrepareCells(m, stiffness));
  PetscCall(HycoBodiesPrepare(&w->bodies, &s, mu));
  if (!stiffness && !rows) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(Forget(w, m->model->pairs.n));
  w->fresh = PETSC_TRUE;
  Scale(m);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Accept(HycoPath p, const HycoStepAttempt *a)
{
  HycoROM m = (HycoROM)p->ctx;
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const PetscScalar *alpha;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(p->U, &alpha));
  PetscCall(HycoBodiesExpand(&w->bodies, m->gamma));
  HycoBodiesAddStrains(&w->bodies, alpha, m->gamma);
  PetscCall(VecRestoreArrayRead(p->U, &alpha));
  PetscCall(HycoTraceAdd(m, p->t));
  p->now.stored = a->law.stored;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The part of q in the cells that the modes do not have, relative to q. */
static PetscReal Misfit(HycoROM m, const PetscReal alpha[])
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoBodiesInelastic in = w->bodies.bodies->inelastic;
  const PetscInt n = in->n_cells * m->model->mesh->nv * m->model->mesh->dim;
  PetscReal rest = 0, size = 0;

  for (PetscInt i = 0; i < n; i++) {
    PetscReal left = w->q[i];

    for (PetscInt k = 0; k < in->m; k++) left -= in->there[i * in->m + k] * alpha[k];
    rest += left * left;
    size += w->q[i] * w->q[i];
  }
  return size > 0 ? PetscSqrtReal(rest / size) : 0;
}

static PetscErrorCode Record(HycoPath p)
{
  HycoROM m = (HycoROM)p->ctx;
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  const HycoBodiesSurface s = SurfaceOf(m);
  const PetscScalar *alpha, *L;
  HycoFEStepReport report;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(p->Lambda, &L));
  PetscCall(PetscArraycpy(m->Lambda, L, m->model->pairs.n));
  PetscCall(VecRestoreArrayRead(p->Lambda, &L));
  PetscCall(HycoROMExpand(m));
  HycoBodiesMove(&w->bodies, &s, m->U);
  for (PetscInt i = 0; i < w->bodies.bodies->inelastic->nd; i++) m->U[w->at[i]] = w->u[w->at[i]];
  PetscCall(VecGetArrayRead(p->U, &alpha));
  w->misfit = PetscMax(w->misfit, Misfit(m, alpha));
  PetscCall(VecRestoreArrayRead(p->U, &alpha));
  PetscCall(HycoFEStepBodies(m->fe, HYCO_BODIES_LINEAR, m->U, p->t, p->t, p->end, p->begin, p->f_local, PETSC_FALSE,
                             &report));
  p->now.stored += report.stored;
  PetscCall(HycoTraceRecord(m, p->begin, &p->now));
  p->steps[p->n_steps++] = p->now;
  PetscCall(PetscMemzero(&p->now, sizeof(p->now)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- set-up -- */

/* The unknowns of the cells in fe's mesh, and back. */
static PetscErrorCode FindUnknowns(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoBodiesInelastic in = w->bodies.bodies->inelastic;
  HycoMesh mesh = m->model->mesh;
  const PetscInt n = mesh->nv * mesh->dim;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(in->nd + 1, &w->at));
  PetscCall(PetscMalloc1(mesh->n_cells * n, &w->cell_at));
  for (PetscInt i = 0; i < in->nd; i++) w->at[i] = -1;
  for (PetscInt k = 0; k < mesh->n_cells * n; k++) {
    const PetscInt local = HycoCellUnknown(mesh, k / n, k % n);
    PetscInt at;

    PetscCall(PetscFindInt(mesh->node_whole[local / mesh->dim] * mesh->dim + local % mesh->dim, in->nd, in->dof, &at));
    w->cell_at[k] = PetscMax(at, -1);
    if (at >= 0) w->at[at] = local;
  }
  for (PetscInt i = 0; i < in->nd; i++) HycoCheck(w->at[i] >= 0, "%s: bodies/inelastic/dof is damaged", m->model->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Allocate(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoBodiesInelastic in = w->bodies.bodies->inelastic;
  const PetscInt n = m->model->mesh->nv * m->model->mesh->dim, cells = in->n_cells, l = in->m,
                 pairs = m->model->pairs.n;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(cells * n * n, &w->Ke));
  PetscCall(PetscCalloc1(cells * n, &w->heat));
  PetscCall(PetscCalloc1(cells * n, &w->q));
  PetscCall(PetscCalloc1(cells, &w->weight));
  PetscCall(PetscMalloc1(pairs * l + 1, &w->BP));
  PetscCall(PetscMalloc1(in->nd * l + 1, &w->response));
  PetscCall(PetscMalloc1(in->nd * l + 1, &w->S));
  PetscCall(PetscCalloc1(in->nd + 1, &w->u0));
  PetscCall(PetscCalloc1(m->fe->n_dof, &w->u));
  PetscCall(PetscCalloc1(l + 1, &w->r));
  PetscCall(PetscMalloc1(l * l + 1, &w->J));
  PetscCall(PetscMalloc1(l + 1, &w->pivot));
  PetscCall(PetscCalloc1(pairs + 1, &w->column));
  PetscCall(PetscMalloc1(pairs + 1, &w->set));
  w->n_set = -1;
  for (PetscInt i = 0; i < cells * n * l; i++) w->weight[i / (n * l)] += PetscSqr(in->T[i]);
  for (PetscInt e = 0; e < cells; e++) w->weight[e] = PetscSqrtReal(w->weight[e]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CreatePath(HycoROM m)
{
  static const HycoPathOps ops = {.assemble = Assemble, .iterate = Iterate, .accept = Accept, .record = Record};
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoPath p;

  PetscFunctionBegin;
  PetscCall(HycoPathNew(PETSC_COMM_SELF, m->model->scene, &w->path));
  p = w->path;
  PetscCall(HycoTraceOptions(m, p));
  HycoCheck(
      p->method != HYCO_NEWTON_ELASTIC,
      "-hyco_newton elastic is not for models of bodies, whose tangents are small; use auto, modified or tangent");
  if (p->method == HYCO_NEWTON_AUTO) p->method = HYCO_NEWTON_MODIFIED;
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, w->bodies.bodies->inelastic->m, &w->alpha));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, m->model->pairs.n, &w->L));
  p->ops = &ops;
  p->ctx = m;
  p->fe = m->fe;
  p->U = w->alpha;
  p->Lambda = w->L;
  p->n_contacts = m->model->pairs.n;
  p->n_free = w->bodies.bodies->inelastic->m;
  PetscCall(HycoPathSetUp(p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SetUp(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;
  HycoBodiesSurface s;

  PetscFunctionBegin;
  PetscCall(HycoROMSetUpDefault(m));
  w->bodies.bodies = (HycoSubstructures)m->model->data;
  m->n = w->bodies.bodies->inelastic->m;
  m->fe->all_facets = PETSC_TRUE;
  s = SurfaceOf(m);
  PetscCall(HycoBodiesSetUp(&w->bodies, w->bodies.bodies, m->model->scene, &s, m->solver));
  PetscCall(FindUnknowns(m));
  PetscCall(Allocate(m));
  PetscCall(CreatePath(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Reset(HycoROM m)
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;

  PetscFunctionBegin;
  if (!w) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(Forget(w, m->model->pairs.n));
  HycoFreeAll(&w->at, &w->cell_at, &w->Ke, &w->heat, &w->weight, &w->BP, &w->response, &w->column, &w->set, &w->U,
              &w->Z, &w->S, &w->z, &w->u0, &w->u, &w->q, &w->r, &w->J, &w->pivot);
  PetscCall(VecDestroy(&w->alpha));
  PetscCall(VecDestroy(&w->L));
  PetscCall(HycoPathFree(&w->path));
  if (w->bodies.bodies) PetscCall(HycoBodiesReset(&w->bodies));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Solve(HycoROM m, const PetscReal mu[])
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;

  PetscFunctionBegin;
  w->misfit = 0;
  w->fresh = PETSC_TRUE; /* the same factors whatever was predicted before */
  PetscCall(Forget(w, m->model->pairs.n));
  PetscCall(HycoTraceFollow(m, w->path, mu));
  PetscCall(PetscStrncpy(m->prediction.method, HycoNewtons[w->path->method], sizeof(m->prediction.method)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The part of the inelastic forces that the modes do not have; and the bound of interpolated flexibilities. */
static PetscErrorCode Features(HycoROM m, PetscReal misfit[2])
{
  HycoBodiesPath w = (HycoBodiesPath)m->work;

  PetscFunctionBegin;
  misfit[0] = w->bodies.bodies->bound;
  misfit[1] = w->misfit;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- training and report -- */

static PetscErrorCode Build(HycoROM m, HycoReducer t)
{
  char worst[HYCO_LINE] = "";
  HycoBodiesInelastic in;

  PetscFunctionBegin;
  PetscCall(HycoBodiesBuild(m, t));
  in = ((HycoSubstructures)m->model->data)->inelastic;
  if (!(m->model->numbers[1] < USELESS)) HycoReducerNameWorst(t, worst);
  HycoCheckModel(m->model->numbers[1] < USELESS,
                 "the model of bodies misses its own training displacements by %.0f %% on average (%d inelastic modes, "
                 "%d cells)%s: use more cells (-hyco_bodies_cells), fewer modes (-hyco_bodies_inelastic_tol), or train "
                 "a hybrid model",
                 100 * (double)m->model->numbers[1], (int)in->m, (int)in->n_cells, worst);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Report(HycoReducer t, HycoROM m, HycoTraining *r)
{
  HycoSubstructures b = (HycoSubstructures)m->model->data;

  PetscFunctionBegin;
  (void)t;
  PetscCall(HycoTrainingAddFact(r, "n_bodies", (PetscReal)b->n));
  PetscCall(HycoTrainingAddFact(r, "n_surface_unknowns", (PetscReal)b->ns));
  PetscCall(HycoTrainingAddFact(r, "n_inelastic_modes", (PetscReal)b->inelastic->m));
  PetscCall(HycoTrainingAddFact(r, "inelastic_amplification", b->inelastic->amplification));
  snprintf(r->summary, sizeof(r->summary),
           "bodies: %d, with %d unknowns on the surfaces that may touch; %d vectors of loads; %d inelastic modes, laws "
           "in %d of %d elements; %d displacement modes\n",
           (int)b->n, (int)b->ns, (int)b->r, (int)b->inelastic->m, (int)m->model->mesh->n_cells,
           (int)m->model->whole_cells, (int)r->n_modes);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode View(HycoROM m, PetscViewer viewer)
{
  HycoBodiesInelastic in = ((HycoSubstructures)m->model->data)->inelastic;

  PetscFunctionBegin;
  PetscCall(HycoBodiesView(m, viewer));
  PetscCall(PetscViewerASCIIPrintf(viewer,
                                   "  inelastic modes: %d; laws in %d of %d elements; an error of the modes is "
                                   "amplified up to %.3g times\n",
                                   (int)in->m, (int)in->n_cells, (int)m->model->whole_cells,
                                   (double)in->amplification));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Operations of an iteration: the tangent in the cells, and its factor. */
static PetscReal Cost(HycoReducer t, const HycoAttempt *a)
{
  HycoBodiesTraining s = HycoTrainingOfBodies(t);
  const PetscReal m = (PetscReal)s->strains.l, n = (PetscReal)(t->fom->part->nv * t->sizes[3]);

  (void)a;
  return (PetscReal)(t->n_seeds_cell) * (2 * n * n * m + 2 * n * m * m) + m * m * m;
}

PetscErrorCode HycoBodiesTakePath(HycoROM m)
{
  static const HycoROMTraits traits = {.title = "substructured",
                                       .settings = HYCO_SETTINGS_NONE,
                                       .constrains = PETSC_TRUE,
                                       .history = PETSC_TRUE,
                                       .surfaces = PETSC_TRUE,
                                       .cells = PETSC_TRUE,
                                       .work = sizeof(struct _n_HycoBodiesPath),
                                       .resultants = PETSC_TRUE};
  static const HycoROMOps ops = {.setfromoptions = HycoBodiesOptions,
                                 .resettraining = HycoBodiesResetTraining,
                                 .begin = HycoBodiesBegin,
                                 .modes = HycoBodiesModes,
                                 .build = Build,
                                 .report = Report,
                                 .cost = Cost,
                                 .setup = SetUp,
                                 .reset = Reset,
                                 .solve = Solve,
                                 .features = Features,
                                 .view = View,
                                 .save = HycoBodiesFile,
                                 .load = HycoBodiesFile,
                                 .destroy = HycoBodiesDestroyModel};

  PetscFunctionBegin;
  PetscCall(HycoROMSetOps(m, &ops, &traits, m->model->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}
