/*
  Coulomb friction between condensed bodies. A contact with friction has a normal row and dim - 1 tangents, as at full
  order (fom/friction.c); W = sum_b B_b C_b B_b^T has as many. With the rigid motions x that contact alone prevents the
  forces r of a step solve

      w = q - B P alpha / kappa + W r - G x,     G^T r = f,     r = P(r - rho w),     G = B Z,

  by the same cone and the same method as full order: nothing but theta is interpolated. W does not change along a path,
  so that a step is a small dense problem. Elastic bodies have no alpha; for the others this is the contact problem at
  alpha, whose derivative dr / dalpha Newton's method on alpha needs (bodies_newton.c).
*/
#include "bodies_friction.h"
#include <hycopath.h>
#include <hycoalgorithms.h>
#include <hycolcp.h>

/* Change of a piece of the law up to which the derivative of the forces is kept: the rod takes 28 to 38 % less time
   with the results of before to 1e-10 (scripts/friction-rod). */
#define TURNED_PIECE 0.02

/* The surface with tangents, whose rows are those of each step. */
static PetscErrorCode CreateSurface(HycoBodiesFriction f)
{
  const HycoPairs *pairs = f->normal.pairs;
  const PetscInt n = f->state->row[f->state->n];

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n + 1, &f->contact));
  for (PetscInt k = 0; k < pairs->n; k++) {
    /* Every row of a contact has its scene entry: the gap and the normal are found by it. */
    for (PetscInt r = f->state->row[k]; r < f->state->row[k + 1]; r++) f->contact[r] = pairs->contact[k];
  }
  f->all = (HycoBodiesSurface){f->normal.fe, f->normal.pairs, &f->rows, n, f->contact};
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The method is always semismooth: the active set of other scenes has no cone. An error leaves a handle that
   HycoBodiesFrictionDestroy() frees. */
PetscErrorCode HycoBodiesFrictionCreate(HycoScene scene, const HycoBodiesSurface *surface, PetscInt p,
                                        HycoBodiesFriction *friction)
{
  HycoBodiesFriction f;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(PetscNew(friction));
  f = *friction;
  f->normal = *surface;
  f->p = p;
  PetscCall(HycoContactStateCreate(PETSC_COMM_SELF, scene, surface->pairs, surface->fe->dim, &f->state));
  /* Rows of normals and tangents, whose number fixes the sizes below. */
  PetscCall(CreateSurface(f));
  n = p + f->all.n;
  PetscCall(PetscCalloc1(surface->fe->n_dof, &f->U));
  PetscCall(PetscCalloc1(n + 1, &f->w));
  PetscCall(PetscCalloc1(n + 1, &f->q));
  PetscCall(PetscCalloc1(n + 1, &f->z));
  PetscCall(PetscCalloc1(n + 1, &f->ahead));
  PetscCall(HycoConeFactorCreate(&f->factor));
  PetscCall(HycoTaoCreate(PETSC_COMM_SELF, NULL, &f->tao));
  PetscCall(HycoTaoSetType(f->tao, HYCO_TAO_SEMISMOOTH_NEWTON, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesFrictionDestroy(HycoBodiesFriction *friction)
{
  HycoBodiesFriction f = *friction;

  PetscFunctionBegin;
  if (!f) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoTaoDestroy(&f->tao));
  PetscCall(HycoConeFactorDestroy(&f->factor));
  PetscCall(HycoBlocksDestroy(&f->blocks)); /* before the cones, which they refer to */
  PetscCall(HycoContactStateDestroy(&f->state));
  PetscCall(HycoRowsDestroy(&f->rows));
  HycoFreeAll(&f->contact, &f->M, &f->weights_of, &f->kappa_of, &f->pieces, &f->q, &f->z, &f->ahead, &f->U, &f->w,
              &f->taken, friction);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The surface with a row for each normal and tangent. Borrowed; the normal rows alone are those of the model. */
const HycoBodiesSurface *HycoBodiesFrictionSurface(HycoBodiesFriction f)
{
  return &f->all;
}

/* W depends on the parameters through the bodies' weights and poses, but not on time. */
PetscErrorCode HycoBodiesFrictionBegin(HycoBodiesFriction f)
{
  PetscFunctionBegin;
  PetscCall(HycoContactStateBegin(f->state));
  f->n_taken = 0;
  f->present = f->loose = f->unloaded_body = PETSC_FALSE;
  HycoConeFactorForget(f->factor); /* a path does not depend on those before */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether M is that of the present rows and bodies, to which it belongs afterwards. */
static PetscErrorCode BodiesFrictionIsCurrent(HycoBodiesFriction f, HycoBodiesWork o, PetscBool *belongs)
{
  const PetscInt n = o->bodies->n;

  PetscFunctionBegin;
  *belongs = (PetscBool)(f->M && o->kept.same && f->rows_of == o->kept.count && !o->bodies->p);
  if (!f->kappa_of) {
    PetscCall(PetscCalloc1(n, &f->kappa_of));
    PetscCall(PetscCalloc1(n, &f->weights_of));
  }
  for (PetscInt k = 0; k < n; k++) {
    *belongs = (PetscBool)(*belongs && f->kappa_of[k] == o->kappa[k] && f->weights_of[k] == o->kept.weights[k]);
    f->kappa_of[k] = o->kappa[k];
    f->weights_of[k] = o->kept.weights[k];
  }
  f->rows_of = o->kept.count;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* W of all rows, also of open contacts, since the path keeps it for all of its steps; from the columns that are kept
   while the rows are the same. Loads and coefficients of friction do not enter, so that it often is that of the last
   path. */
static PetscErrorCode BodiesFrictionCondense(HycoBodiesFriction f, HycoBodiesWork o)
{
  const PetscInt n = f->all.n;
  PetscInt *row;
  PetscBool belongs;

  PetscFunctionBegin;
  PetscCall(BodiesFrictionIsCurrent(f, o, &belongs));
  f->present = PETSC_TRUE;
  if (belongs) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree(f->M));
  PetscCall(PetscMalloc1(n + 1, &row));
  for (PetscInt k = 0; k < n; k++) row[k] = k;
  /* Without this the first step of a path would find that its rows are new and keep nothing. */
  if (!o->kept.same) PetscCall(HycoBodiesKeepRows(o, n)); /* those of now */
  PetscCall(PetscMalloc1(PetscSqr((size_t)(f->p + n)) + 1, &f->M));
  PetscCall(HycoBodiesMatrix(o, n, row, f->M));
  HycoConeFactorForget(f->factor);
  PetscCall(PetscFree(row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Called for each step, as gaps and coefficients of friction change in time. */
PetscErrorCode HycoBodiesFrictionPrepare(HycoBodiesFriction f, HycoBodiesWork o, const PetscReal mu[])
{
  PetscFunctionBegin;
  PetscCall(HycoContactStateRows(f->state, f->normal.fe, &f->rows));
  PetscCall(HycoBodiesPrepare(o, &f->all, mu));
  PetscCall(HycoBlocksDestroy(&f->blocks)); /* of other coefficients */
  PetscCall(HycoBlocksCreate(2, f->state->cone, f->state->n, f->state->of, f->state->data, &f->blocks));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* w = D - B U of the displacements found, and the residuals of the natural map at it. */
static PetscErrorCode BodiesFrictionMeasure(HycoBodiesFriction f, HycoBodiesWork o, const PetscReal L[], HycoKKT *kkt)
{
  /* Below it gaps are round-off of the coordinates. */
  PetscReal size = HYCO_NOTHING / HYCO_RESIDUAL * HycoMeshLength(f->normal.fe->mesh), force = 0;
  HycoNaturalMap map;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < f->all.n; k++) {
    PetscReal bu = 0, terms = 0;

    for (PetscInt e = f->rows.start[k]; e < f->rows.start[k + 1]; e++) {
      bu += f->rows.value[e] * f->U[f->rows.dof[e]];
      terms += PetscAbsReal(f->rows.value[e] * f->U[f->rows.dof[e]]);
    }
    f->w[k] = f->rows.gap[k] - bu;
    force = PetscMax(force, PetscAbsReal(L[k]));
    if (f->rows.start[k] == f->rows.start[k + 1]) continue;
    size = PetscMax(size, PetscMax(PetscAbsReal(f->rows.gap[k]), terms));
    /* Where all contacts stick without a gap, nothing moves, and what is left is the round-off of gaps without
       forces. */
    size = PetscMax(size, HYCO_GAP_ROUND_OFF * PetscAbsReal(o->gap[k]));
  }
  f->most = 0;
  for (PetscInt i = 0; i < f->normal.fe->n_dof; i++) f->most = PetscMax(f->most, PetscAbsReal(f->U[i]));
  *kkt = (HycoKKT){0};
  if (!(force > 0)) force = 1;
  /* rho = force / gap makes both arguments of the projection equally large in the units of forces. */
  PetscCall(HycoBlocksNaturalMap(f->blocks, size > 0 ? force / size : 1, L, f->w, &map));
  kkt->penetration = map.missing / force;
  kkt->adhesion = map.outside / force;
  kkt->complementarity = map.map / force;
  kkt->stationarity = HycoBodiesImbalance(o, PETSC_TRUE);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of the motions, p x rows by columns. */
static void MotionRows(HycoBodiesFriction f, PetscReal A[])
{
  const PetscInt n = f->all.n, p = f->p;

  for (PetscInt k = 0; k < p * n; k++) A[k] = f->M[(size_t)(p + k / p) * (size_t)(p + n) + (size_t)(k % p)];
}

/* As at full order: bodies stay along motions that no contact force acts on. */
static PetscErrorCode BodiesFrictionLeastSlip(HycoBodiesFriction f)
{
  const PetscInt n = f->all.n, p = f->p, last = (f->n_taken - 1) * (p + n);
  PetscReal *A, *w, *move, *x, *first;
  PetscBool smooth;
  PetscInt loose;

  PetscFunctionBegin;
  PetscCall(HycoContactStateHasFriction(f->state, &smooth));
  smooth = (PetscBool)!smooth;
  for (PetscInt k = 0; k < f->state->n && !smooth; k++)
    smooth = (PetscBool)(!(f->state->mu[k] > 0) && f->z[p + f->state->row[k]] > 0);
  if (!p || !smooth) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc5(p * n, &A, p + n, &w, p, &move, p, &x, p, &first));
  MotionRows(f, A);
  PetscCall(PetscArraycpy(w, f->q, p + n));
  for (PetscInt k = 0; k < p + n; k++) {
    for (PetscInt i = p; i < p + n; i++) w[i] += f->M[(size_t)k * (size_t)(p + n) + (size_t)i] * f->z[k];
  }
  for (PetscInt i = 0; i < p; i++) move[i] = f->z[i] - (f->n_taken ? f->taken[last + i] : 0);
  PetscCall(HycoBlocksLeastSlip(f->blocks, p, A, w + p, f->z + p, move, x, &loose, first));
  for (PetscInt i = 0; i < p; i++) f->z[i] += x[i];
  PetscCall(PetscFree5(A, w, move, x, first));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The problem at alpha (NULL: elastic bodies). The first start of a step is the accepted forces of the last one, not
   those of an attempt: a halved step must give what it would have given at once. `again`: at another alpha of the same
   step, from the forces found there. */
PetscErrorCode HycoBodiesFrictionSolveContact(HycoBodiesFriction f, HycoBodiesWork o, PetscReal t,
                                              const PetscReal alpha[], PetscBool again, PetscInt *its,
                                              PetscBool *solved)
{
  const PetscInt n = f->all.n, p = f->p;
  HycoLCP lcp = {.n = n,
                 .p = p,
                 .q = f->q,
                 .symmetric = PETSC_TRUE,
                 .blocks = f->blocks,
                 .cone = f->factor,
                 .rounding = HycoBodiesLoadRounding(o),
                 .warm = PETSC_TRUE,
                 .given = PETSC_TRUE};

  PetscBool has;

  PetscFunctionBegin;
  if (!f->present) PetscCall(BodiesFrictionCondense(f, o));
  lcp.M = f->M;
  if (alpha) PetscCall(HycoBodiesStrain(o, &f->all, alpha));
  for (PetscInt i = 0; i < p; i++) f->q[i] = -HycoBodiesLoadWork(o, i);
  PetscCall(PetscArraycpy(f->q + p, o->gap, n));
  if (!again) {
    PetscCall(PetscArrayzero(f->z, p));
    PetscCall(HycoVecRead(f->state->L, n, f->z + p)); /* a step that was refused leaves no trace */
    PetscCall(HycoContactStateExtrapolate(f->state, t, f->ahead + p, &has));
    if (has) lcp.other = f->ahead;
  }
  PetscCall(HycoTaoSolveLCP(f->tao, &lcp, NULL, f->z, its, solved));
  PetscCall(HycoBlocksAdmit(f->blocks, f->z + p)); /* inadmissible by round-off; residuals are recomputed */
  if (*solved) PetscCall(BodiesFrictionLeastSlip(f));
  PetscCall(PetscArraycpy(o->x, f->z, p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Displacements follow from the forces by the bodies' flexibilities, and the residuals from both, not from the solver's
   word. */
PetscErrorCode HycoBodiesFrictionMove(HycoBodiesFriction f, HycoBodiesWork o, HycoKKT *kkt)
{
  const HycoFE fe = f->normal.fe;

  PetscFunctionBegin;
  HycoBodiesDisplacementsOfForces(o, &f->all, f->z + f->p);
  PetscCall(PetscArraycpy(f->U, fe->u0, fe->n_dof));
  HycoBodiesMove(o, &f->all, f->U);
  HycoFEComplete(fe, f->U);
  PetscCall(BodiesFrictionMeasure(f, o, f->z + f->p, kkt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A step of elastic bodies. What follows a solve is done for forces that did not converge too: their residuals are
   reported. */
PetscErrorCode HycoBodiesFrictionSolve(HycoBodiesFriction f, HycoBodiesWork o, PetscReal t, HycoKKT *kkt, PetscInt *its,
                                       PetscBool *solved)
{
  PetscFunctionBegin;
  PetscCall(HycoBodiesFrictionSolveContact(f, o, t, NULL, PETSC_FALSE, its, solved));
  PetscCall(HycoBodiesFrictionMove(f, o, kkt));
  *solved = (PetscBool)(*solved && HycoKKTMax(kkt) <= HYCO_RESIDUAL);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* w = D - B U of a step from rest, without slip before it, for any forces and alpha: what a program of the model is
   made of. */
PetscErrorCode HycoBodiesFrictionProbe(HycoBodiesFriction f, HycoBodiesWork o, const PetscReal mu[],
                                       const PetscReal z[], PetscReal w[])
{
  HycoKKT kkt;

  PetscFunctionBegin;
  PetscCall(HycoBodiesFrictionBegin(f));
  PetscCall(HycoBodiesFrictionPrepare(f, o, mu));
  if (o->bodies->inelastic->m) PetscCall(HycoBodiesStrain(o, &f->all, z + f->p + f->all.n));
  PetscCall(PetscArraycpy(f->z, z, f->p + f->all.n));
  PetscCall(PetscArraycpy(o->x, z, f->p));
  PetscCall(HycoBodiesFrictionMove(f, o, &kkt));
  PetscCall(PetscArraycpy(w, f->w, f->all.n));
  /* The forces of the tangents, for the results of the contacts. */
  HycoContactStateAddSlips(f->state, f->z + f->p, f->w, f->most);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rigid motion of body b in the displacements U of its surface; *share: the sum of their squares. */
static PetscErrorCode FitRigid(HycoFE fe, HycoBodiesWork o, PetscInt b, const PetscReal U[], HycoRigid *r,
                               PetscReal *share)
{
  const PetscInt dim = fe->dim, n_rigid = dim == 2 ? 3 : 6, lo = o->bodies->start[b], hi = o->bodies->start[b + 1];
  PetscReal gram[36] = {0}, inverse[36], right[6] = {0};
  PetscInt n = 0;

  PetscFunctionBegin;
  *share = 0;
  *r = (HycoRigid){.part = b, .body = o->bodies->probe->cell_body[o->bodies->cell[b]]};
  for (PetscInt pass = 0; pass < 3; pass++) {
    for (PetscInt i = 0; i < fe->n_dof; i++) {
      const PetscReal *X = fe->X + 3 * (i / dim);
      const PetscInt c = i % dim;
      PetscReal x[3], row[6];

      if (o->loc[i] < lo || o->loc[i] >= hi) continue;
      if (!pass) {
        r->centre[c] += X[c];
        n += !c;
      }
      for (PetscInt k = 0; k < 3; k++) x[k] = X[k] - r->centre[k];
      if (pass == 1) r->size = PetscMax(r->size, PetscAbsReal(x[c]));
      if (pass < 2) continue;
      for (PetscInt k = 0; k < 3; k++) x[k] /= r->size;
      HycoRigidRow(dim, x, c, row);
      for (PetscInt k = 0; k < n_rigid * n_rigid; k++) gram[k] += row[k / n_rigid] * row[k % n_rigid];
      for (PetscInt k = 0; k < n_rigid; k++) right[k] += row[k] * U[i];
      *share += U[i] * U[i];
    }
    for (PetscInt k = 0; !pass && k < 3 && n; k++) r->centre[k] /= (PetscReal)n;
  }
  PetscCall(HycoPseudoInverse(n_rigid, n_rigid, gram, 1e-12, inverse));
  for (PetscInt k = 0; k < n_rigid * n_rigid; k++) r->rigid[k / n_rigid] += inverse[k] * right[k % n_rigid];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Names the body that moves most with the motions d, as full order does. */
PetscErrorCode HycoBodiesNameMotion(HycoBodiesWork o, const HycoBodiesSurface *s, const PetscReal L[],
                                    const PetscReal d[], char name[HYCO_LINE])
{
  const HycoFE fe = s->fe;
  const PetscInt p = o->bodies->p;
  PetscReal *U, *rest, *x, share, most = 0, one = 1;
  HycoRigid rigid = {0}, r;
  HycoMotions motions = {.n = 1, .rigid = &rigid};

  PetscFunctionBegin;
  PetscCall(PetscCalloc3(fe->n_dof, &U, fe->n_dof, &rest, p, &x));
  PetscCall(PetscArraycpy(x, o->x, p));
  PetscCall(PetscArrayzero(o->x, p));
  HycoBodiesDisplacementsOfForces(o, s, L);
  HycoBodiesMove(o, s, rest);
  PetscCall(PetscArraycpy(o->x, d, p));
  HycoBodiesDisplacementsOfForces(o, s, L);
  HycoBodiesMove(o, s, U);
  PetscCall(PetscArraycpy(o->x, x, p));
  HycoBodiesDisplacementsOfForces(o, s, L);
  for (PetscInt i = 0; i < fe->n_dof; i++) U[i] -= rest[i];
  for (PetscInt b = 0; b < o->bodies->n; b++) {
    PetscCall(FitRigid(fe, o, b, U, &r, &share));
    if (share > most) rigid = r;
    most = PetscMax(most, share);
  }
  name[0] = '\0';
  if (most > 0) HycoMotionsName(fe, &motions, &one, name);
  PetscCall(PetscFree3(U, rest, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesFrictionNoEquilibrium(HycoBodiesFriction f, HycoBodiesWork o, char name[HYCO_LINE],
                                               PetscBool *no_equilibrium)
{
  const PetscInt n = f->all.n, p = f->p;
  PetscReal *A, *load, *r;
  PetscBool exists;

  PetscFunctionBegin;
  *no_equilibrium = PETSC_FALSE;
  if (!p) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc3(p * n, &A, p, &load, n, &r));
  for (PetscInt i = 0; i < p; i++) load[i] = -f->q[i];
  MotionRows(f, A);
  PetscCall(HycoBlocksBalance(f->blocks, p, A, load, HycoBodiesLoadRounding(o), r, &exists));
  *no_equilibrium = (PetscBool)!exists;
  if (*no_equilibrium) {
    PetscReal size = 0;

    PetscCall(HycoBlocksLeaveSlide(f->blocks, p, A, load, r));
    for (PetscInt k = 0; k < p * n; k++) load[k % p] -= A[k] * r[k / p];
    for (PetscInt i = 0; i < p; i++) size = PetscMax(size, PetscAbsReal(load[i]));
    for (PetscInt i = 0; i < p && size > 0; i++) load[i] /= size;
    PetscCall(HycoBodiesNameMotion(o, &f->all, f->z + p, load, name));
  }
  PetscCall(PetscFree3(A, load, r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The forces by row. Borrowed. */
const PetscReal *HycoBodiesFrictionForces(HycoBodiesFriction f)
{
  return f->z + f->p;
}

/* The rows of the contacts with a force, and Z. Exact while no contact opens, closes, or changes between stick and
   slip, and in 2D; in 3D the direction of a slip turns. Nothing is done while the pieces are the same. */
PetscErrorCode HycoBodiesFrictionDerive(HycoBodiesFriction f, PetscInt m, const PetscReal BP[], PetscBool *changed,
                                        PetscInt *n_set, PetscInt set[], PetscReal **Z, PetscBool *regular)
{
  const PetscInt n = f->all.n, p = f->p;
  const PetscReal *pieces;
  PetscReal *dq, *dz;
  PetscInt n_pieces;

  PetscFunctionBegin;
  *regular = PETSC_TRUE;
  HycoConeFactorGetPieces(f->factor, &n_pieces, &pieces);
  if (!*changed) {
    PetscBool near = PETSC_TRUE;

    /* Slips that turn change the map a little, and the rounds of the search correct it; other states by much more. */
    for (PetscInt i = 0; i < n_pieces && near; i++)
      near = (PetscBool)(PetscAbsReal(pieces[i] - f->pieces[i]) <= TURNED_PIECE);
    if (near) PetscFunctionReturn(PETSC_SUCCESS);
  }
  *changed = PETSC_TRUE;
  PetscCall(PetscFree(f->pieces));
  HycoDuplicate(n_pieces + 1, pieces, &f->pieces);
  *n_set = 0;
  for (PetscInt k = 0; k < f->state->n; k++) {
    for (PetscInt i = f->state->row[k]; i < f->state->row[k + 1] && f->z[p + f->state->row[k]] > 0; i++)
      set[(*n_set)++] = i;
  }
  PetscCall(PetscFree(*Z));
  PetscCall(PetscMalloc1(*n_set * m + 1, Z));
  PetscCall(PetscCalloc2((p + n) * m + 1, &dq, (p + n) * m + 1, &dz));
  for (PetscInt i = 0; i < n * m; i++) dq[i % m * (p + n) + p + i / m] = -BP[i];
  /* Without a force there is nothing to derive, and floating bodies have no place. */
  if (*n_set && m) PetscCall(HycoConeFactorTangent(f->factor, m, dq, dz, regular));
  for (PetscInt i = 0; i < *n_set * m; i++) (*Z)[i] = dz[i % m * (p + n) + p + set[i / m]];
  PetscCall(PetscFree2(dq, dz));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the contacts with a force, and of these the tangents that stick, leave a rigid motion free, which is named:
   the slips of later states begin from there. Without any force bodies stay where they are, but for what loads that
   balance themselves ask for. */
static PetscErrorCode FindFreeMotions(HycoBodiesFriction f, HycoBodiesWork o, PetscReal t)
{
  const PetscInt p = f->p;
  const PetscReal *L = f->z + p;
  PetscReal *A, *first, most = 0;
  PetscInt n;

  PetscFunctionBegin;
  if (!p) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < f->state->n; k++) most = PetscMax(most, L[f->state->row[k]]);
  f->unloaded_body = (PetscBool)(!(most > 0) && (f->unloaded_body || HycoBodiesLoaded(o)));
  if (!(most > 0)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc2(p * f->all.n, &A, p, &first));
  MotionRows(f, A);
  PetscCall(HycoBlocksFreeMotions(f->blocks, p, A, L, &n, first));
  if (n && !f->loose) {
    PetscCall(HycoBodiesNameMotion(o, &f->all, L, first, f->name));
    f->at[0] = t;
  }
  if (n) f->at[1] = t;
  f->loose = (PetscBool)(f->loose || n);
  PetscCall(PetscFree2(A, first));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool HycoBodiesFrictionFreeMotion(HycoBodiesFriction f, char name[HYCO_LINE])
{
  if (f->loose && name) HycoPathNameTimes(f->name, f->at, name);
  return (PetscBool)(f->loose || f->unloaded_body);
}

/* Slip, forces and displacements change here only, so that a halved step repeats from the same state. */
PetscErrorCode HycoBodiesFrictionAccept(HycoBodiesFriction f, HycoBodiesWork o, PetscReal t)
{
  const size_t n = (size_t)(f->p + f->all.n);

  PetscFunctionBegin;
  PetscCall(FindFreeMotions(f, o, t));
  if (f->n_taken == f->room) {
    f->room = 2 * f->room + 64;
    PetscCall(PetscRealloc((size_t)f->room * n * sizeof(PetscReal) + 1, &f->taken));
  }
  PetscCall(PetscArraycpy(f->taken + (size_t)f->n_taken++ * n, f->z, n));
  PetscCall(HycoContactStateAccept(f->state, t, f->z + f->p, f->w, f->most, f->U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first row of each contact is its normal one. */
void HycoBodiesFrictionNormal(HycoBodiesFriction f, PetscReal Lambda[])
{
  for (PetscInt k = 0; k < f->state->n; k++) Lambda[k] = f->z[f->p + f->state->row[k]];
}

/* Borrowed, for outputs and fields: slip, states and work since the path began. */
HycoContactState HycoBodiesFrictionState(HycoBodiesFriction f)
{
  return f->state;
}

/* Of the solution that is accepted; needs a factor, which the next step begins with. */
PetscErrorCode HycoBodiesFrictionDisproven(HycoBodiesFriction f, PetscBool *disproven)
{
  PetscInt sign;

  PetscFunctionBegin;
  PetscCall(HycoConeFactorSign(f->factor, &sign));
  *disproven = (PetscBool)(sign < 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}
