/*
  How the parameters enter the bodies, by evaluation. At each of some points the nodes of a body are compared with
  those at a first point, by the similar map nearest to them (Procrustes), and the forces of a random displacement that
  is turned with the body, K(mu) Q v, with Q K v: they are proportional if and only if K(mu) = kappa Q K Q^T, whatever
  the laws, springs, supports and formulation are. So a body whose supports do not turn with it is not called rigidly
  moved.
*/
#include <hycobodiestraining.h>
#include <string.h>

/* Of a map or of a stiffness, its residual: 45,000 eps, expressions at thousands of nodes and a product with K; similar
   ones have 1e-13 (tests/models/bodies.py). */
#define SIMILAR       1e-11
#define SAME_QUANTITY 1e-10 /* of a quantity, its change: ten times SIMILAR */
#define JOINT         3     /* points at which all parameters change */

/* -- the bodies -- */

PetscErrorCode HycoBodyPartsDestroy(HycoBodyParts *parts)
{
  PetscFunctionBegin;
  HycoFreeAll(&parts->name, &parts->of, &parts->enters, &parts->support, &parts->together);
  parts->n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The connected parts, and the scene's bodies in each. Collective. */
static PetscErrorCode FindParts(HycoFOM f, HycoBodyParts *parts)
{
  const PetscInt n_bodies = f->scene->n_bodies;
  HycoMotions motions;
  PetscBool *in;

  PetscFunctionBegin;
  parts->n_parameters = f->scene->n_parameters;
  PetscCall(HycoFEFreeMotions(HycoComm(f), f->fe, &motions));
  /* HycoFEFreeMotions() has found the connected parts, over all ranks and ties; the array changes its owner. */
  parts->of = motions.part;
  motions.part = NULL;
  PetscCall(HycoMotionsDestroy(&motions));
  parts->n = 0;
  for (PetscInt i = 0; i < f->part->n_nodes; i++) parts->n = PetscMax(parts->n, parts->of[i] + 1);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &parts->n, 1, MPIU_INT, MPI_MAX, HycoComm(f)));
  PetscCall(PetscCalloc1(parts->n, &parts->name));
  PetscCall(PetscCalloc1(parts->n * parts->n_parameters + 1, &parts->enters));
  PetscCall(PetscMalloc1(parts->n * parts->n_parameters + 1, &parts->support));
  for (PetscInt k = 0; k < parts->n * parts->n_parameters; k++) parts->support[k] = -1;
  PetscCall(PetscMalloc1(parts->n, &parts->together));
  PetscCall(PetscCalloc1(parts->n * n_bodies, &in));
  for (PetscInt e = 0; e < f->part->n_cells; e++)
    /* All nodes of a cell are in one part: the first one stands for it. */
    in[parts->of[f->part->cells[e * f->part->nv]] * n_bodies + f->part->cell_body[e]] = PETSC_TRUE;
  HycoAllreduce(in, parts->n * n_bodies, HYCO_MPI_BOOL, MPI_LOR, HycoComm(f));
  for (PetscInt k = 0; k < parts->n * n_bodies; k++) {
    char *name = parts->name[k / n_bodies];
    const size_t length = strlen(name);

    parts->together[k / n_bodies] = PETSC_TRUE;
    if (in[k]) snprintf(name + length, 64 - length, "%s%s", length ? " + " : "", f->scene->body[k % n_bodies].name);
  }
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* State of a comparison. */
typedef struct {
  HycoFOM f;
  HycoBodyParts *parts;
  const PetscReal *first;        /* the first point */
  PetscReal *X0;                 /* the nodes there */
  Mat K;                         /* at the current point */
  Vec v, y, now, product, F0, F; /* at the first point: v, K v, F */
  HycoPose *pose;
  PetscReal *kappa,
      *off;        /* by body: the factor of the stiffness, the relative distance from it; without stiffness 1, 0 */
  PetscReal *load; /* n x 2: change of the load with and without that factor, relative */
} Compared;

/* Ranks that see no more than a part of a plane of symmetry must agree on whether a map mirrors. */
static PetscErrorCode MoveTo(HycoFOM f, const PetscReal mu[])
{
  PetscFunctionBegin;
  HycoOnEach(HycoComm(f), HycoFESetParameters(f->fe, mu));
  if (f->size > 1) PetscCall(HycoFEAgreeOnMirrors(HycoComm(f), f->fe));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* to = Q from (back: Q^T from) on this rank's unknowns, by body. */
static PetscErrorCode RecogniseRotate(const Compared *c, PetscBool back, Vec from, Vec to)
{
  HycoMesh m = c->f->part;
  const PetscInt dim = m->dim;
  const PetscScalar *a;
  PetscScalar *b;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(from, &a));
  PetscCall(VecGetArray(to, &b));
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    const PetscInt own = HycoMeshOwned(m, i);

    /* Both vectors have owned unknowns only, by node. */
    if (own >= 0) HycoPoseTurn(c->pose[c->parts->of[i]].Q, dim, back, a + own * dim, b + own * dim);
  }
  PetscCall(VecRestoreArray(to, &b));
  PetscCall(VecRestoreArrayRead(from, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A displacement that is 0 where fixed, of this rank's unknowns. Deterministic and the same on any number of
   ranks: a function of the node's number in the whole mesh. */
static PetscErrorCode SetProbe(Compared *c)
{
  HycoMesh m = c->f->part;
  const PetscInt dim = m->dim;
  PetscScalar *v;

  PetscFunctionBegin;
  PetscCall(VecGetArray(c->v, &v));
  for (PetscInt k = 0; k < m->n_nodes * dim; k++) {
    const PetscInt own = HycoMeshOwned(m, k / dim), whole = m->node_whole ? m->node_whole[k / dim] : k / dim;
    const PetscReal number = (PetscReal)(whole * dim + k % dim + 1);

    /* A chirp: no two nodes have the same value, and no rigid motion or symmetry hides a change. */
    if (own >= 0) v[own * dim + k % dim] = c->f->fe->fixed[k] ? 0 : PetscSinReal(1.7 * number * number + number);
  }
  PetscCall(VecRestoreArray(c->v, &v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

enum { AA, AB, BB, AT_FIXED, F00, F0F, FF, SUMS };

/* Sums over the free unknowns of each body of a = Q K v and b = K(mu) Q v, and of the loads. */
static PetscErrorCode RecogniseSums(Compared *c, PetscReal sum[])
{
  HycoMesh m = c->f->part;
  const PetscInt dim = m->dim;
  const PetscScalar *a, *b, *v, *F0, *F;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(sum, SUMS * c->parts->n));
  PetscCall(VecGetArrayRead(c->y, &a));
  PetscCall(VecGetArrayRead(c->product, &b));
  PetscCall(VecGetArrayRead(c->now, &v));
  PetscCall(VecGetArrayRead(c->F0, &F0));
  PetscCall(VecGetArrayRead(c->F, &F));
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    const PetscInt own = HycoMeshOwned(m, i);
    PetscReal *s = sum + SUMS * c->parts->of[i], Qa[3], QF[3];

    /* Ghosts are counted on their owner. */
    if (own < 0) continue;
    HycoPoseTurn(c->pose[c->parts->of[i]].Q, dim, PETSC_FALSE, a + own * dim, Qa);
    HycoPoseTurn(c->pose[c->parts->of[i]].Q, dim, PETSC_FALSE, F0 + own * dim, QF);
    for (PetscInt d = 0; d < dim; d++) {
      const PetscInt k = own * dim + d;

      /* A turned probe that does not vanish at a support: the support does not turn with the body. */
      s[AT_FIXED] += c->f->fe->fixed[i * dim + d] ? PetscAbsReal(v[k]) : 0;
      if (c->f->fe->fixed[i * dim + d]) continue;
      s[AA] += Qa[d] * Qa[d];
      s[AB] += Qa[d] * b[k];
      s[BB] += b[k] * b[k];
      s[F00] += QF[d] * QF[d];
      s[F0F] += QF[d] * F[k];
      s[FF] += F[k] * F[k];
    }
  }
  PetscCall(VecRestoreArrayRead(c->y, &a));
  PetscCall(VecRestoreArrayRead(c->product, &b));
  PetscCall(VecRestoreArrayRead(c->now, &v));
  PetscCall(VecRestoreArrayRead(c->F0, &F0));
  PetscCall(VecRestoreArrayRead(c->F, &F));
  /* One reduction for all bodies and sums. */
  HycoAllreduce(sum, SUMS * c->parts->n, MPIU_REAL, MPI_SUM, HycoComm(c->f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest entry of K(mu) Q v - kappa Q K v relative to the root of the mean square, by body: |b - kappa a| from the
   sums alone would be exact to the root of the round-off only. off: how far K(mu) is from a turned and scaled K; load:
   how far F is, without and with the factor. */
static PetscErrorCode RecogniseDistances(Compared *c, const PetscReal sum[])
{
  HycoMesh m = c->f->part;
  const PetscInt dim = m->dim, n = c->parts->n;
  const PetscScalar *a, *b, *F0, *F;
  PetscReal *rest;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(3 * n, &rest));
  PetscCall(VecGetArrayRead(c->y, &a));
  PetscCall(VecGetArrayRead(c->product, &b));
  PetscCall(VecGetArrayRead(c->F0, &F0));
  PetscCall(VecGetArrayRead(c->F, &F));
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    const PetscInt own = HycoMeshOwned(m, i), body = c->parts->of[i];
    PetscReal Qa[3], QF[3], *r = rest + 3 * body;

    if (own < 0) continue;
    HycoPoseTurn(c->pose[body].Q, dim, PETSC_FALSE, a + own * dim, Qa);
    HycoPoseTurn(c->pose[body].Q, dim, PETSC_FALSE, F0 + own * dim, QF);
    for (PetscInt d = 0; d < dim; d++) {
      const PetscInt k = own * dim + d;

      if (c->f->fe->fixed[i * dim + d]) continue;
      /* Entry by entry at the factor that RecogniseSums() has found. */
      r[0] += PetscSqr(b[k] - c->kappa[body] * Qa[d]);
      r[1] += PetscSqr(F[k] - QF[d]);
      r[2] += PetscSqr(F[k] - c->kappa[body] * QF[d]);
    }
  }
  PetscCall(VecRestoreArrayRead(c->y, &a));
  PetscCall(VecRestoreArrayRead(c->product, &b));
  PetscCall(VecRestoreArrayRead(c->F0, &F0));
  PetscCall(VecRestoreArrayRead(c->F, &F));
  HycoAllreduce(rest, 3 * n, MPIU_REAL, MPI_SUM, HycoComm(c->f));
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal size = PetscMax(sum[SUMS * k + F00], sum[SUMS * k + FF]);

    c->off[k] = sum[SUMS * k + BB] > 0 ? PetscSqrtReal(rest[3 * k] / sum[SUMS * k + BB]) : 0;
    if (sum[SUMS * k + AT_FIXED] > SIMILAR * c->f->n_nodes) c->off[k] = 1; /* supports that do not turn */
    /* Loads that turn with the body, with and without its factor. */
    c->load[2 * k] = size > 0 ? PetscSqrtReal(rest[3 * k + 1] / size) : 0;
    c->load[2 * k + 1] = size > 0 ? PetscSqrtReal(rest[3 * k + 2] / size) : 0;
  }
  PetscCall(PetscFree(rest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Poses, factors and changes of the loads at mu relative to the first point. Collective. */
static PetscErrorCode RecogniseCompare(Compared *c, const PetscReal mu[])
{
  PetscReal *sum;

  PetscFunctionBegin;
  PetscCall(MoveTo(c->f, mu));
  PetscCall(HycoBodyPoses(c->f, c->parts->n, c->parts->of, c->X0, c->pose));
  HycoOnEach(HycoComm(c->f), HycoFEAssembleStiffness(c->f->fe, c->K));
  HycoOnEach(HycoComm(c->f), HycoFEAssembleForce(c->f->fe, c->F));
  PetscCall(RecogniseRotate(c, PETSC_FALSE, c->v, c->now));
  PetscCall(MatMult(c->K, c->now, c->product));
  PetscCall(PetscMalloc1(SUMS * c->parts->n, &sum));
  PetscCall(RecogniseSums(c, sum));
  /* The factor in the sense of least squares. */
  for (PetscInt k = 0; k < c->parts->n; k++)
    c->kappa[k] = sum[SUMS * k + AA] > 0 ? sum[SUMS * k + AB] / sum[SUMS * k + AA] : 1;
  PetscCall(RecogniseDistances(c, sum));
  PetscCall(PetscFree(sum));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The ways in which body k differs from the first point. A ratio kappa / s^p apart from 1 is a change of moduli;
   without it, kappa is that of the size alone. Loads count as unchanged if they are F or kappa F: prescribed
   displacements act by K. */
static PetscInt RecogniseDifferences(const Compared *c, PetscInt k)
{
  const HycoPose *pose = &c->pose[k];
  const PetscReal scaled = PetscPowReal(pose->s, (PetscReal)HycoPosePower(c->f->fe));
  PetscReal turned = 0;
  PetscInt ways = 0;

  /* Not similar in nodes or stiffness: the other ways have no meaning then. */
  if (pose->residual > SIMILAR || c->off[k] > SIMILAR || !(c->kappa[k] > 0)) return HYCO_ENTERS_SHAPE;
  for (PetscInt d = 0; d < 9; d++) turned = PetscMax(turned, PetscAbsReal(pose->Q[d] - (d % 4 == 0)));
  if (turned > SAME_QUANTITY) ways |= HYCO_ENTERS_PLACE;
  if (PetscAbsReal(pose->s - 1) > SAME_QUANTITY) ways |= HYCO_ENTERS_SIZE;
  if (PetscAbsReal(c->kappa[k] / scaled - 1) > SAME_QUANTITY) ways |= HYCO_ENTERS_FACTOR;
  if (PetscMin(c->load[2 * k], c->load[2 * k + 1]) > SAME_QUANTITY) ways |= HYCO_ENTERS_LOADS;
  return ways;
}

/* Whether the nodes of each body have moved, beyond turning and scaling. Collective. A pose has no translation, which
   changes neither K nor its axes but the place of the contacts. Relative to the whole mesh's extent: a small body far
   from the origin has no more digits. */
static PetscErrorCode RecogniseShifted(Compared *c, PetscBool moved[])
{
  const PetscReal length = HycoMeshLength(c->f->part);

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(moved, c->parts->n));
  for (PetscInt i = 0; i < 3 * c->f->part->n_nodes; i++) {
    if (PetscAbsReal(c->f->fe->X[i] - c->X0[i]) > 1e-12 * length) moved[c->parts->of[i / 3]] = PETSC_TRUE;
  }
  HycoAllreduce(moved, c->parts->n, HYCO_MPI_BOOL, MPI_LOR, HycoComm(c->f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the direction of an oblique support at node i is not the one that turns with its body. */
static PetscErrorCode StaysBehind(const Compared *c, const HycoFixed *fixed, PetscInt i, PetscBool *stays)
{
  const HycoPose *pose = &c->pose[c->parts->of[i]];
  const PetscInt dim = c->f->part->dim;
  PetscReal before[3] = {0, 0, 0}, turned[3] = {0, 0, 0}, now[3] = {0, 0, 0}, along = 0, size[2] = {0, 0};

  PetscFunctionBegin;
  for (PetscInt d = 0; d < dim; d++) {
    if (!fixed->direction[d]) continue;
    PetscCall(HycoExprEval(fixed->direction[d], c->first, 1, c->X0 + 3 * i, &before[d]));
    PetscCall(HycoExprEval(fixed->direction[d], c->f->fe->mu, 1, c->f->fe->X + 3 * i, &now[d]));
  }
  HycoPoseTurn(pose->Q, dim, PETSC_FALSE, before, turned);
  for (PetscInt d = 0; d < dim; d++) {
    along += now[d] * turned[d];
    size[0] += now[d] * now[d];
    size[1] += turned[d] * turned[d];
  }
  *stays = (PetscBool)(PetscAbsReal(along) < (1 - SAME_QUANTITY) * PetscSqrtReal(size[0] * size[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* support[]: by body, as in HycoBodyParts. After RecogniseCompare(). Collective. */
static PetscErrorCode FindSupports(const Compared *c, PetscInt support[])
{
  HycoMesh m = c->f->part;
  HycoScene s = c->f->scene;
  const PetscScalar *v;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < c->parts->n; k++) support[k] = -1;
  PetscCall(VecGetArrayRead(c->now, &v));
  for (PetscInt k = 0; k < s->n_fixed; k++) {
    const HycoFixed *fixed = &s->fixed[k];
    PetscInt g = 0;

    PetscCall(HycoMeshFindGroup(m, "fixed", fixed->group, &g));
    for (PetscInt j = m->group_start[g]; j < m->group_start[g + 1]; j++) {
      const PetscInt i = m->group_node[j], own = HycoMeshOwned(m, i);
      PetscBool stays = PETSC_FALSE;

      /* A body that changes its shape has no turn. */
      if (own < 0 || c->pose[c->parts->of[i]].residual > SIMILAR) continue;
      /* As in RecogniseSums(): the turned probe does not vanish there. */
      for (PetscInt d = 0; d < m->dim; d++)
        stays = (PetscBool)(stays || (fixed->value[d] && PetscAbsReal(v[own * m->dim + d]) > SIMILAR));
      if (fixed->normal && !stays) PetscCall(StaysBehind(c, fixed, i, &stays));
      if (stays) support[c->parts->of[i]] = k;
    }
  }
  PetscCall(VecRestoreArrayRead(c->now, &v));
  HycoAllreduce(support, c->parts->n, MPIU_INT, MPI_MAX, HycoComm(c->f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stores nodes, K v and F at this point, with which the others are compared. Collective. K v for one v (SetProbe()) in
   place of K: matrices that differ agree on it by chance only. */
static PetscErrorCode SetReference(Compared *c, const PetscReal mu[])
{
  PetscFunctionBegin;
  PetscCall(MoveTo(c->f, mu));
  PetscCall(PetscArraycpy(c->X0, c->f->fe->X, 3 * c->f->part->n_nodes));
  HycoOnEach(HycoComm(c->f), HycoFEAssembleStiffness(c->f->fe, c->K));
  HycoOnEach(HycoComm(c->f), HycoFEAssembleForce(c->f->fe, c->F0));
  PetscCall(SetProbe(c));
  PetscCall(MatMult(c->K, c->v, c->y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All parameters at once, compared with points that have the same values of those that change shapes. Collective.
   Parameters that turn or scale a body each alone may shear it together, as two maps of one body do. */
static PetscErrorCode VisitTogether(Compared *c, const PetscReal first[])
{
  HycoScene s = c->f->scene;
  PetscReal mu[HYCO_MAX_PARAMETERS], from[HYCO_MAX_PARAMETERS];
  PetscInt shape[HYCO_MAX_PARAMETERS];
  const PetscInt n = HycoBodyPartsShapes(c->parts, -1, shape);

  PetscFunctionBegin;
  for (PetscInt q = 0; s->n_parameters > 1 && q < JOINT; q++) {
    PetscCall(PetscArraycpy(from, first, s->n_variables));
    PetscCall(PetscArraycpy(mu, first, s->n_variables));
    for (PetscInt p = 0; p < s->n_parameters; p++) {
      /* Irrational steps: no two parameters move in proportion, at which joint changes might cancel. */
      const PetscReal at = (q + 1) * 0.6180339887 + p * 0.7548776662;

      mu[p] = s->lo[p] + (at - (PetscInt)at) * (s->hi[p] - s->lo[p]);
    }
    for (PetscInt k = 0; k < n; k++) from[shape[k]] = mu[shape[k]];
    if (n) PetscCall(SetReference(c, from));
    PetscCall(RecogniseCompare(c, mu));
    for (PetscInt k = 0; k < c->parts->n; k++)
      if (RecogniseDifferences(c, k) & HYCO_ENTERS_SHAPE) c->parts->together[k] = PETSC_FALSE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each parameter alone at two points. Collective. Two points inside the range: one could be a mirror or a period
   of an expression, at which nothing seems to change. */
static PetscErrorCode RecogniseVisit(Compared *c, const PetscReal first[])
{
  /* Not at simple fractions, where symmetric expressions have equal values. */
  static const PetscReal share[2] = {0.137, 0.829};
  HycoScene s = c->f->scene;
  PetscReal mu[HYCO_MAX_PARAMETERS];
  PetscBool *moved;
  PetscInt *support;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(c->parts->n, &moved, c->parts->n, &support));
  for (PetscInt q = 0; q < 2 * s->n_parameters; q++) {
    const PetscInt p = q / 2;

    if (!(s->hi[p] > s->lo[p])) continue;
    PetscCall(PetscArraycpy(mu, first, s->n_variables));
    mu[p] = s->lo[p] + share[q % 2] * (s->hi[p] - s->lo[p]);
    PetscCall(RecogniseCompare(c, mu));
    PetscCall(RecogniseShifted(c, moved));
    PetscCall(FindSupports(c, support));
    for (PetscInt k = 0; k < c->parts->n; k++) {
      PetscInt ways = RecogniseDifferences(c, k);

      /* A body that is only moved needs no sample: in its own axes it stays the same. */
      if (moved[k] && !(ways & (HYCO_ENTERS_SHAPE | HYCO_ENTERS_SIZE))) ways |= HYCO_ENTERS_PLACE;
      c->parts->enters[k * s->n_parameters + p] |= ways;
      if (ways & HYCO_ENTERS_SHAPE) c->parts->support[k * s->n_parameters + p] = support[k];
    }
  }
  PetscCall(PetscFree2(moved, support));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each parameter alone first: VisitTogether() needs to know which ones change shapes. */
static PetscErrorCode CompareAll(Compared *c, const PetscReal first[])
{
  PetscFunctionBegin;
  PetscCall(SetReference(c, first));
  PetscCall(RecogniseVisit(c, first));
  PetscCall(VisitTogether(c, first));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Measured and not derived from the expressions: whether a map turns, scales or bends is seen in the matrices that it
   makes. */
PetscErrorCode HycoBodyPartsFind(HycoFOM f, const PetscReal first[], HycoBodyParts *parts)
{
  Compared c = {.f = f, .parts = parts, .first = first};
  Vec *const all[6] = {&c.y, &c.now, &c.product, &c.F0, &c.F, &c.v};
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(parts, sizeof(*parts)));
  PetscCall(MoveTo(f, first));
  PetscCall(FindParts(f, parts));
  PetscCall(HycoFECreateMatrix(f->fe, HycoComm(f), f->part->n_owned, f->part->first, &c.K));
  PetscCall(MatCreateVecs(c.K, &c.v, NULL));
  for (int k = 0; k < 5; k++) PetscCall(VecDuplicate(c.v, all[k]));
  PetscCall(PetscMalloc1(3 * f->part->n_nodes, &c.X0));
  PetscCall(PetscMalloc4(parts->n, &c.pose, parts->n, &c.kappa, parts->n, &c.off, 2 * parts->n, &c.load));
  ierr = CompareAll(&c, first);
  PetscCall(PetscFree4(c.pose, c.kappa, c.off, c.load));
  PetscCall(PetscFree(c.X0));
  for (int k = 0; k < 6; k++) PetscCall(VecDestroy(all[k]));
  PetscCall(MatDestroy(&c.K));
  f->fe->ready = PETSC_FALSE; /* matrices of fom do not belong to its present parameters */
  /* An attempt of a search may fail here and go on with another type: nothing may leak. */
  if (ierr) PetscCall(HycoBodyPartsDestroy(parts));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- in words -- */

/* "moves body cylinder rigidly, changes the loads of body block"; "" if the parameter enters no body. Loads of a path
   depend on time, and are not told. */
static PetscErrorCode DescribeOne(HycoScene s, const HycoBodyParts *parts, PetscInt p, char text[HYCO_LINE])
{
  static const struct {
    PetscInt way;
    const char *before, *after;
  } words[] = {{HYCO_ENTERS_PLACE, "moves", " rigidly"},
               {HYCO_ENTERS_SIZE, "enlarges", " uniformly"},
               {HYCO_ENTERS_FACTOR, "scales the stiffness of", ""},
               {HYCO_ENTERS_LOADS, "changes loads or given displacements of", ""},
               {HYCO_ENTERS_SHAPE, "changes the shape or the material of", ", which needs samples"}};

  PetscFunctionBegin;
  text[0] = '\0';
  for (size_t w = 0; w < sizeof(words) / sizeof(words[0]); w++) {
    char names[HYCO_LINE] = "", one[HYCO_LINE];

    /* Of a path every load changes in time: the words would tell nothing. */
    if (s->n_times && words[w].way == HYCO_ENTERS_LOADS) continue;
    for (PetscInt k = 0; k < parts->n; k++) {
      const PetscInt enters = parts->enters[k * parts->n_parameters + p];

      if (parts->support[k * parts->n_parameters + p] >= 0) continue; /* below */

      /* A body that needs samples has nothing exact to tell of this parameter. */
      if (!(enters & words[w].way) || (words[w].way != HYCO_ENTERS_SHAPE && enters & HYCO_ENTERS_SHAPE)) continue;
      PetscCall(HycoListAdd(names, ", ", parts->name[k]));
    }
    if (!names[0]) continue;
    HycoFormat(one, "%s body %s%s", words[w].before, names, words[w].after);
    PetscCall(HycoListAdd(text, ", ", one));
  }
  for (PetscInt k = 0; k < parts->n; k++) {
    const PetscInt support = parts->support[k * parts->n_parameters + p];
    char one[HYCO_LINE];

    if (support < 0) continue;
    HycoFormat(one, "turns body %s without its support %s, which needs samples", parts->name[k],
               s->fixed[support].group);
    PetscCall(HycoListAdd(text, ", ", one));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* parameter[] may not be NULL; a caller that wants the number alone gives room for all. */
PetscInt HycoBodyPartsShapes(const HycoBodyParts *parts, PetscInt b, PetscInt parameter[])
{
  PetscInt n = 0;

  for (PetscInt p = 0; p < parts->n_parameters; p++) {
    PetscBool any = PETSC_FALSE;

    for (PetscInt k = 0; k < parts->n; k++) {
      /* b < 0: any body. */
      if ((b < 0 || k == b) && parts->enters[k * parts->n_parameters + p] & HYCO_ENTERS_SHAPE) any = PETSC_TRUE;
    }
    if (any) parameter[n++] = p;
  }
  return n;
}

/* The first body that no model of bodies can represent, for the message; -1: none. */
PetscInt HycoBodyPartsFail(const HycoBodyParts *parts)
{
  for (PetscInt k = 0; k < parts->n; k++) {
    if (!parts->together[k]) return k;
  }
  return -1;
}

/* For hyco check and for training: why a model of bodies suits the scene, or why not. */
PetscErrorCode HycoBodyPartsDescribe(HycoScene s, const HycoBodyParts *parts, char text[HYCO_LINE])
{
  PetscInt shape[HYCO_MAX_PARAMETERS], body;
  char one[HYCO_LINE], line[HYCO_LINE];

  PetscFunctionBegin;
  text[0] = '\0';
  for (PetscInt p = 0; p < s->n_parameters; p++) {
    PetscCall(DescribeOne(s, parts, p, one));
    HycoFormat(line, "%s: %s", s->parameter[p],
               one[0]       ? one
               : s->n_times ? "leaves places and elastic stiffness as they are"
                            : "enters no body");
    PetscCall(HycoListAdd(text, "; ", line));
  }
  /* What no parameter does alone cannot be told by parameter. */
  body = HycoBodyPartsFail(parts);
  if (body >= 0) {
    HycoFormat(line, "body %s changes its shape where parameters change together", parts->name[body]);
    PetscCall(HycoListAdd(text, "; ", line));
  } else if (!HycoBodyPartsShapes(parts, -1, shape))
    PetscCall(HycoListAdd(text, "; ", "no body needs a sample"));
  if (HycoBodyPartsShapes(parts, -1, shape) > HYCO_MOST_THETA) {
    HycoFormat(line, "a model of bodies samples at most %d such parameters, and is none here", HYCO_MOST_THETA);
    PetscCall(HycoListAdd(text, "; ", line));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
