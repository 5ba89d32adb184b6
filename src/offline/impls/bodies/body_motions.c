/*
  The rigid motions of bodies that contact alone holds and whose shape changes. Their isostatic supports, the pins, stay
  those of the first sample; the motion that moves one pin by 1 and no other depends on the places of the nodes, and so
  does the work of the loads on it. Predictions make both from the nodes' places at mu, so that the forces of the
  contacts balance the loads there: a table over theta has the coefficients of the motions and the moments of the loads,
  which need no factor and therefore as many values as reproduce them to round-off.
*/
#include <hycobodiestraining.h>
#include <petscblaslapack.h>

#define MOST_VALUES 17  /* of a parameter, */
#define MOST_POINTS 400 /* and in all */
/* Of the largest number of its kind, the table's error: 450 eps, a polynomial of 17 values; then no more are tried. */
#define TABLE_EXACT 1e-13
/* Of the largest number of its kind, the table's error: equilibrium would miss as much, and its residual is 1e-8. */
#define TABLE_ROUGH         1e-8
#define LARGEST_COEFFICIENT 1e4 /* largest coefficient of a motion that moves a pin by 1, beside a body's size */

/* Whether body k has a part in the table. */
static PetscBool BodyMotionsVaries(HycoSubstructures b, const HycoBodiesFactor *factor, PetscInt k)
{
  PetscBool axis = PETSC_FALSE;

  for (PetscInt p = 0; p < b->n_theta; p++) axis = (PetscBool)(axis || HycoBodiesAxis(b, k, p));
  return (PetscBool)(axis && factor->body[k].p > 0);
}

/* C (p x p row major): the combinations of the motions that move each one pin by 1. Collective. */
static PetscErrorCode BodyMotionsCombine(HycoBodiesFactor *factor, const HycoMotions *motions, PetscReal C[])
{
  HycoFE fe = factor->fom->fe;
  HycoMesh m = factor->fom->part;
  const PetscInt p = motions->n;
  PetscBLASInt n, info, *pivot;
  PetscReal *V;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(p, &n));
  PetscCall(PetscCalloc1(p * p, &V));
  PetscCall(PetscMalloc1(p, &pivot));
  for (PetscInt k = 0; k < fe->n_dof; k++) {
    const PetscInt own = HycoMeshOwned(m, k / fe->dim);

    for (PetscInt i = 0; i < p && own >= 0; i++) {
      if ((m->first + own) * fe->dim + k % fe->dim != factor->pins[i]) continue;
      for (PetscInt j = 0; j < p; j++) V[j * p + i] = motions->motion[(size_t)j * (size_t)fe->n_dof + (size_t)k];
    }
  }
  HycoAllreduce(V, p * p, MPIU_REAL, MPI_SUM, HycoComm(factor->fom));
  /* By columns, V has the pins as rows: V c = e_i, and the solutions are the rows of C. */
  for (PetscInt i = 0; i < p * p; i++) C[i] = i % (p + 1) == 0;
  LAPACKgesv_(&n, &n, V, &n, pivot, C, &n, &info);
  HycoFreeAll(&V, &pivot);
  HycoCheckModel(!info, "a body that contact alone holds changes its shape so that its rigid motions need other "
                        "unknowns, which a model of bodies does not support; train a hybrid model");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* row[6 p]: the coefficients of the motions about the bodies' frames. */
static PetscErrorCode TakeCoefficients(HycoSubstructures b, const HycoMotions *motions, const PetscReal C[],
                                       PetscReal row[])
{
  PetscReal most = 0;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < b->p; i++) {
    const PetscInt k = b->motions.body[i];
    const PetscReal *frame = b->motions.frame + 4 * k;
    PetscReal *own = row + 6 * i, largest = 0;

    for (PetscInt j = 0; j < b->p; j++) {
      const HycoRigid *r = &motions->rigid[j];
      const PetscInt turns = b->dim == 3 ? 3 : b->dim == 2;

      /* What another body's motion has here is round-off. */
      if (r->part != k) continue;
      for (PetscInt d = 0; d < b->dim; d++) own[d] += C[i * b->p + j] * HycoRigidAt(r, b->dim, frame, d);
      for (PetscInt d = 0; d < turns; d++)
        own[b->dim + d] += C[i * b->p + j] * r->rigid[b->dim + d] * frame[3] / r->size;
    }
    for (PetscInt a = 0; a < 6; a++) largest = PetscMax(largest, PetscAbsReal(own[a]));
    for (PetscInt a = 0; a < 6; a++) own[a] = PetscAbsReal(own[a]) > PETSC_MACHINE_EPSILON * largest ? own[a] : 0;
    most = PetscMax(most, largest);
  }
  HycoCheckModel(most < LARGEST_COEFFICIENT,
                 "a body that contact alone holds changes its shape so that its rigid motions need other "
                 "unknowns, which a model of bodies does not support; train a hybrid model");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* row[6 r n]: by body and load, the sums of the load times the rows of the rigid motions. Collective. */
static PetscErrorCode TakeMoments(HycoSubstructures b, HycoBodiesFactor *factor, PetscReal row[])
{
  HycoFE fe = factor->fom->fe;
  HycoMesh m = factor->fom->part;
  const PetscInt n = 6 * b->n * b->r;
  PetscReal *terms;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(n + 1, &terms));
  for (PetscInt d = 0; d < b->r; d++) {
    const PetscScalar *F;

    PetscCall(VecGetArrayRead(factor->basis[d], &F));
    for (PetscInt i = 0; i < fe->n_dof; i++) {
      const PetscInt own = HycoMeshOwned(m, i / b->dim);
      const PetscReal force = own < 0 ? 0 : F[own * b->dim + i % b->dim];
      PetscReal motion[6];
      PetscInt k, at;

      if (force == 0) continue;
      k = factor->owner[own];
      at = 6 * (k * b->r + d);
      HycoBodiesRigidRow(b, k, fe->X + 3 * (i / b->dim), i % b->dim, motion);
      for (PetscInt a = 0; a < 6; a++) {
        row[at + a] += force * motion[a];
        terms[at + a] += PetscAbsReal(force * motion[a]);
      }
    }
    PetscCall(VecRestoreArrayRead(factor->basis[d], &F));
  }
  HycoAllreduce(row, n, MPIU_REAL, MPI_SUM, HycoComm(factor->fom));
  HycoAllreduce(terms, n, MPIU_REAL, MPI_SUM, HycoComm(factor->fom));
  for (PetscInt i = 0; i < n; i++) row[i] = PetscAbsReal(row[i]) > HYCO_WORK_ROUND_OFF * terms[i] ? row[i] : 0;
  PetscCall(PetscFree(terms));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The numbers of the table at the variables x. Collective. */
static PetscErrorCode BodyMotionsEvaluate(HycoReducer t, HycoBodiesFactor *factor, const PetscReal x[], PetscReal row[])
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  PetscReal theta[HYCO_MAX_PARAMETERS], *C;
  HycoMotions motions;
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < b->n_theta; p++) theta[p] = HycoBodiesValue(b->variable[p], x[p]);
  PetscCall(HycoBodiesMoveTo(t, factor, theta));
  PetscCall(PetscArrayzero(row, b->motions.table.rows));
  PetscCall(HycoFEFreeMotions(HycoComm(t), factor->fom->fe, &motions));
  PetscCall(PetscMalloc1(b->p * b->p, &C));
  /* Of other numbers training has no factor: HycoBodiesCondense() refuses them. */
  if (motions.n == b->p) ierr = BodyMotionsCombine(factor, &motions, C);
  if (motions.n == b->p && !ierr) ierr = TakeCoefficients(b, &motions, C, row);
  if (!ierr) ierr = TakeMoments(b, factor, row + 6 * b->p);
  PetscCall(PetscFree(C));
  PetscCall(HycoMotionsDestroy(&motions));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The centre and half the extent of each body at the first point. Collective. */
static PetscErrorCode SetFrames(HycoReducer t, HycoBodiesFactor *factor)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  const HycoFOM f = factor->fom;
  PetscReal *reach;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(4 * b->n, &b->motions.frame));
  PetscCall(PetscMalloc1(6 * b->n, &reach));
  for (PetscInt i = 0; i < 6 * b->n; i++) reach[i] = PETSC_MIN_REAL;
  /* The negative least coordinates beside the largest ones: one reduction. */
  for (PetscInt i = 0; i < 3 * f->part->n_nodes; i++) {
    PetscReal *own = reach + 6 * HycoTrainingOfBodies(t)->parts.of[i / 3] + i % 3;

    own[0] = PetscMax(own[0], f->fe->X[i]);
    own[3] = PetscMax(own[3], -f->fe->X[i]);
  }
  HycoAllreduce(reach, 6 * b->n, MPIU_REAL, MPI_MAX, HycoComm(f));
  for (PetscInt k = 0; k < b->n; k++) {
    const PetscReal *own = reach + 6 * k;
    PetscReal *frame = b->motions.frame + 4 * k;

    frame[3] = 0;
    for (PetscInt c = 0; c < 3; c++) {
      frame[c] = (own[c] - own[3 + c]) / 2;
      frame[3] = PetscMax(frame[3], (own[c] + own[3 + c]) / 2);
    }
  }
  PetscCall(PetscFree(reach));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The table with the numbers of values in motions.n_nodes. Collective. */
static PetscErrorCode FillTable(HycoReducer t, HycoBodiesFactor *factor)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  HycoBodiesMotions *m = &b->motions;
  PetscInt n = 0, all = 1;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < b->n_theta; p++) {
    n += m->n_nodes[p];
    all *= m->n_nodes[p];
  }
  HycoFreeAll(&m->node, &m->table.data);
  PetscCall(PetscMalloc1(n + 1, &m->node));
  PetscCall(PetscMalloc1((size_t)all * (size_t)m->table.rows, &m->table.data));
  n = 0;
  for (PetscInt p = 0; p < b->n_theta; n += m->n_nodes[p++])
    PetscCall(HycoChebyshevNodes(m->n_nodes[p], HycoBodiesVariable(b->variable[p], t->scene->lo[b->theta[p]]),
                                 HycoBodiesVariable(b->variable[p], t->scene->hi[b->theta[p]]), m->node + n));
  HycoBodiesSetMotions(b);
  for (PetscInt j = 0; j < all; j++) {
    PetscReal x[HYCO_MAX_PARAMETERS];

    for (PetscInt p = b->n_theta - 1, rest = j; p >= 0; rest /= m->n_nodes[p--])
      x[p] = m->table.tensor.x[p][rest % m->n_nodes[p]];
    PetscCall(BodyMotionsEvaluate(t, factor, x, m->table.data + (size_t)j * (size_t)m->table.rows));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest difference of the table from the numbers at points where theta p changes, relative to the largest of each
   motion or load. Collective. */
static PetscErrorCode DirectionError(HycoReducer t, HycoBodiesFactor *factor, PetscInt p, PetscReal *error)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  const HycoBodiesMotions *m = &b->motions;
  PetscReal *here, *there;

  PetscFunctionBegin;
  *error = 0;
  PetscCall(PetscMalloc2(m->table.rows, &here, m->table.rows, &there));
  for (PetscInt side = 0; side < 3; side++) {
    PetscReal x[HYCO_MAX_PARAMETERS];

    for (PetscInt q = 0; q < b->n_theta; q++) {
      const PetscReal lo = HycoBodiesVariable(b->variable[q], t->scene->lo[b->theta[q]]);
      const PetscReal hi = HycoBodiesVariable(b->variable[q], t->scene->hi[b->theta[q]]);

      /* The ends, and no simple fractions, at which the nodes of symmetric tables are. */
      x[q] = lo + (q == p ? 0.5 * (PetscReal)side : 0.2718) * (hi - lo);
      if (q == p && side == 1) x[q] = lo + 0.4142 * (hi - lo);
    }
    PetscCall(BodyMotionsEvaluate(t, factor, x, here));
    PetscCall(HycoGridFieldEvaluate(&m->table, x, there));
    for (PetscInt i = 0; i < m->table.rows; i += 6) {
      PetscReal largest = 0, off = 0;

      for (PetscInt a = 0; a < 6; a++) {
        largest = PetscMax(largest, PetscAbsReal(here[i + a]));
        off = PetscMax(off, PetscAbsReal(here[i + a] - there[i + a]));
      }
      if (largest > 0) *error = PetscMax(*error, off / largest);
    }
  }
  PetscCall(PetscFree2(here, there));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Values are added to the parameter with the largest error until all numbers are exact. Collective. */
static PetscErrorCode RefineTable(HycoReducer t, HycoBodiesFactor *factor)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  PetscInt worst, all = 1;
  PetscReal e[HYCO_MAX_PARAMETERS], most;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < b->n_theta; p++) all *= b->motions.n_nodes[p];
  do {
    worst = -1;
    most = 0;
    PetscCall(FillTable(t, factor));
    for (PetscInt p = 0; p < b->n_theta; p++) {
      const PetscInt n = b->motions.n_nodes[p];

      PetscCall(DirectionError(t, factor, p, &e[p]));
      most = PetscMax(most, e[p]);
      if (e[p] <= TABLE_EXACT || n >= MOST_VALUES || all / n * (2 * n - 1) > MOST_POINTS) continue;
      if (worst < 0 || e[p] > e[worst]) worst = p;
    }
    if (worst >= 0) {
      const PetscInt n = b->motions.n_nodes[worst];

      b->motions.n_nodes[worst] = 2 * n - 1;
      all = all / n * (2 * n - 1);
    }
  } while (worst >= 0);
  HycoCheckModel(
      most <= TABLE_ROUGH,
      "the rigid motions of a body that contact alone holds cannot be interpolated over the parameters of its "
      "shape (relative error %.2g); train a hybrid model",
      (double)most);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesTakeMotions(HycoReducer t, HycoBodiesFactor *factor)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  HycoBodiesMotions *m = &b->motions;
  PetscReal theta[HYCO_MAX_PARAMETERS];
  PetscBool any = PETSC_FALSE;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < b->n; k++) any = (PetscBool)(any || BodyMotionsVaries(b, factor, k));
  if (!any) PetscFunctionReturn(PETSC_SUCCESS);
  m->table.rows = 6 * (b->p + b->n * b->r);
  PetscCall(PetscMalloc1(b->p, &m->body));
  for (PetscInt k = 0; k < b->n; k++) {
    for (PetscInt i = 0; i < factor->body[k].p; i++) m->body[factor->body[k].motion[i]] = k;
  }
  PetscCall(PetscMalloc1(b->n_theta, &m->n_nodes));
  for (PetscInt p = 0; p < b->n_theta; p++) {
    theta[p] = b->first[b->theta[p]];
    m->n_nodes[p] = 1;
    for (PetscInt k = 0; k < b->n; k++) {
      if (BodyMotionsVaries(b, factor, k) && HycoBodiesAxis(b, k, p)) m->n_nodes[p] = 3;
    }
  }
  PetscCall(HycoBodiesMoveTo(t, factor, theta));
  PetscCall(SetFrames(t, factor));
  PetscCall(RefineTable(t, factor));
  PetscFunctionReturn(PETSC_SUCCESS);
}
