/*
  An estimate of the error of a prediction from quantities known online, calibrated in training on held-out solutions
  (calibrate.c). log e = c_0 + sum_j c_j log(1 + f_j / floor_j), c_j >= 0, of five features:

    0  misfit       relative distance of the full-order displacements from the values that the modes alone give there
    1  penetration  at the contacts that (38) does not constrain, relative to B U
    2  adhesion     forces of these contacts where the predicted displacement leaves a gap, relative to the forces
    3  distance     to the nearest training point, each parameter scaled to its range
    4  tail         the last quarter of the modes' coefficients relative to all: indicates the error of truncation

  Outside the region of training the estimate is multiplied by (1 + b / d)^2, b the scaled distance from it and d the
  spacing of the training points, or by the Lebesgue function of what is interpolated there if that is more. K's rows on
  the interface lack the cells outside the RID, so that no residual can be computed there; the misfit measures the
  disagreement between the two sides of the interface instead.

  Held-out points do not have every regime that a prediction may meet. Where a feature is larger than at all held-out
  points, the estimates are multiplied by the ratio, and a ratio above HYCO_UNSEEN is reported. Features 1, 2 and, of
  these only for this purpose:

    5  inconsistency  |B u - D| of the closed contacts, weighted by their forces, relative to their largest displacement
    6  new contacts   share of the force at contacts that no training solution closes
    7  outside        share of the force outside the RID; of bodies, beside cells with modes at some of their nodes
    alone 8  remainder      of the reconstruction (41), relative to the forces in the RID

  6 and 8 do not concern models that give accurate forces of all contacts, and 7 concerns their stresses alone. A
  displacement that does not follow its forces is a failure of the prediction.

  The scene's outputs have formulas of their own, for absolute errors: an output may pass through zero. An estimate is
  at least HYCO_OUTPUT_ROUND_OFF of the largest absolute value of the output at the held-out points.
*/
#include <hycoalgorithms.h>
#include <hycoquantities.h>
#include <hycoromimpl.h>
#include <petscviewer.h>
#include <stdio.h>

enum {
  MISFIT,
  PENETRATION,
  ADHESION,
  DISTANCE = HYCO_ESTIMATE_DISTANCE,
  TAIL,
  INCONSISTENCY = HYCO_ESTIMATE_FEATURES,
  NEW_CONTACTS,
  OUTSIDE,
  REMAINDER
};
const char *const HycoFeatureNames[] = {"misfit of the full-order displacements",
                                        "penetration",
                                        "adhesion",
                                        "distance",
                                        "tail",
                                        "difference between displacements and gaps at closed contacts",
                                        "share of the force at contacts that no training solution closes",
                                        "share of the force outside the RID, or beside cells that it has in part",
                                        "remainder of the reconstructed forces"};

/* Values of the features up to which no regime is new; 0: not used for this purpose. */
static const PetscReal slight[HYCO_FEATURES] = {1e-6, 1e-6, 1e-3, 0, 0, 1e-7, 0.02, 0.02, 0.02};
#define MOST_FACTOR 100 /* of the estimates in a new regime */
/* Share of the force at new contacts that is a new regime: half, also if held-out points had it. */
#define NEW_REGIME_FORCE (0.5 / HYCO_UNSEEN)
/* Of the largest displacement of closed contacts, its distance from their gaps: 0.1 %, the accuracy of good models;
   smaller distances are none in practice. */
#define INCONSISTENT 1e-3
/* Of the largest displacement of closed contacts, the same in a model without held-out points: ten times INCONSISTENT.
   */
#define UNJUDGED 1e-2

/* Of sums of squares; x / 0 counts as 1, a full error, and stays finite for the formulas. */
static PetscReal EstimateQuotient(PetscReal part2, PetscReal size2)
{
  return size2 > 0 ? PetscSqrtReal(part2 / size2) : part2 > 0 ? 1 : 0;
}

/* How far the full-order displacements are from what the modes alone would give there, relative to their size: a basis
   that describes the solution well makes both agree. */
static PetscReal EstimateMisfit(HycoROM m)
{
  PetscReal lost = 0, size = 0;

  for (PetscInt f = 0; f < m->model->n_fe; f++) {
    const PetscInt dof = m->model->fe_dof[f];
    PetscReal by_modes = m->fe->u0[dof];

    /* V has rows of full-order unknowns too, in whose place the displacement has the unknowns. */
    for (PetscInt j = 0; j < m->model->l; j++)
      by_modes += m->model->V[(size_t)dof * (size_t)m->model->l + (size_t)j] * m->gamma[j];
    lost += (m->U[dof] - by_modes) * (m->U[dof] - by_modes);
    size += m->U[dof] * m->U[dof];
  }
  return EstimateQuotient(lost, size);
}

/* Penetration of the contacts that the reduced system does not constrain, and forces on those that are open: what (38)
   leaves unchecked outside the RID. */
static void EstimateContacts(HycoROM m, PetscReal *penetration, PetscReal *adhesion)
{
  PetscReal in = 0, moved = 0, stuck = 0, force = 0;

  for (PetscInt k = 0; k < m->model->pairs.n; k++) {
    const PetscReal bu = HycoROMAddRow(m, k, 0);

    moved += bu * bu;
    force += m->Lambda[k] * m->Lambda[k];
    /* Contacts of A_lambda satisfy (38) by the solve. */
    if (m->model->in_rid[k] && m->model->traits.constrains) continue;
    if (bu > m->rows.gap[k])
      in += (bu - m->rows.gap[k]) * (bu - m->rows.gap[k]);
    else if (bu < m->rows.gap[k])
      stuck += m->Lambda[k] * m->Lambda[k];
  }
  *penetration = EstimateQuotient(in, moved);
  *adhesion = EstimateQuotient(stuck, force);
}

/* What the displacement misses of the gaps at contacts with a force, relative to the largest displacement of the
   contacts' nodes, along the surface too: where contacts close without a gap, that across it is round-off. */
static PetscReal EstimateSceneResidual(HycoROM m)
{
  const PetscInt dim = m->fe->dim;
  PetscReal lost = 0, force = 0, size = 0;

  for (PetscInt k = 0; k < m->model->pairs.n; k++) {
    /* All components of the nodes that the rows name, also those along the surface, which the rows themselves do not
       read. */
    for (PetscInt j = m->rows.start[k] * dim; j < m->rows.start[k + 1] * dim; j++)
      size = PetscMax(size, PetscAbsReal(m->U[m->rows.dof[j / dim] / dim * dim + j % dim]));
    if (!(m->Lambda[k] > 0)) continue;
    /* B u - D, weighted by the force: an open contact's gap is no inconsistency. */
    lost += m->Lambda[k] * PetscSqr(HycoROMAddRow(m, k, -m->rows.gap[k]));
    force += m->Lambda[k];
  }
  return EstimateQuotient(force > 0 ? lost / force : 0, size * size);
}

/* Shares of the force that indicate a regime: at contacts without a force in training, and outside the RID. */
static void EstimateShares(HycoROM m, PetscReal *fresh, PetscReal *outside)
{
  PetscReal sum = 0;

  *fresh = *outside = 0;
  for (PetscInt k = 0; k < m->model->pairs.n; k++) {
    const PetscReal force = PetscMax(m->Lambda[k], 0);

    sum += force;
    /* Not every model knows which contacts had a force in training. */
    if (m->model->closed && !m->model->closed[k]) *fresh += force;
    if (!m->model->in_rid[k]) *outside += force;
  }
  if (!(sum > 0)) return;
  *fresh /= sum;
  *outside /= sum;
}

/* A parameter without a range counts by its own unit. Euclidean, with the widths of the ranges as units: parameters of
   different dimensions become comparable. */
PetscReal HycoEstimatesDistance(HycoScene s, const PetscReal a[], const PetscReal b[])
{
  PetscReal sum = 0;

  for (PetscInt p = 0; p < s->n_parameters; p++) {
    const PetscReal width = s->hi[p] > s->lo[p] ? s->hi[p] - s->lo[p] : 1,
                    step = s->wide[p] && a[p] > 0 && b[p] > 0
                               ? PetscLogReal(a[p] / b[p]) / PetscLogReal(s->hi[p] / s->lo[p])
                               : (a[p] - b[p]) / width;

    sum += step * step;
  }
  return PetscSqrtReal(sum);
}

/* Tail of the POD modes only: supremizers have no singular value. */
static PetscReal EstimateTail(HycoROM m)
{
  PetscReal last = 0, all = 0;
  const PetscInt l = HycoROMCountPOD(m);

  for (PetscInt j = 0; j < l; j++) {
    all += m->gamma[j] * m->gamma[j];
    /* The last quarter: if it carries much, more modes would too. */
    if (j >= 3 * l / 4) last += m->gamma[j] * m->gamma[j];
  }
  return EstimateQuotient(last, all);
}

/* For the current solution; for a path at the listed time that is selected. */
static PetscErrorCode MeasureOne(HycoROM m, PetscReal feature[])
{
  const PetscInt n_par = m->model->scene->n_parameters;

  PetscFunctionBegin;
  /* Reconstructed forces and whole displacements first: most features need them. */
  PetscCall(HycoROMComplete(m));
  feature[MISFIT] = feature[PENETRATION] = feature[ADHESION] = 0;
  if (m->ops->features)
    PetscUseTypeMethod(m, features, feature); /* features 0 and 1 */
  else {
    feature[MISFIT] = EstimateMisfit(m);
    EstimateContacts(m, &feature[PENETRATION], &feature[ADHESION]);
  }
  feature[INCONSISTENCY] = EstimateSceneResidual(m);
  feature[NEW_CONTACTS] = feature[OUTSIDE] = feature[REMAINDER] = 0;
  if (!m->model->traits.forces) {
    EstimateShares(m, &feature[NEW_CONTACTS], &feature[OUTSIDE]);
    feature[REMAINDER] = m->remainder;
  } else
    PetscCall(HycoROMShareDiscontinuous(m, &feature[OUTSIDE]));
  feature[TAIL] = EstimateTail(m);
  /* 0 without stored points or parameters: a feature that is constant drops out of the calibration. */
  feature[DISTANCE] = m->model->n_points && n_par ? PETSC_MAX_REAL : 0;
  for (PetscInt k = 0; n_par && k < m->model->n_points; k++)
    feature[DISTANCE] =
        PetscMin(feature[DISTANCE], HycoEstimatesDistance(m->model->scene, m->fe->mu, m->model->points + k * n_par));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For a path the largest values over its listed times. The selected time is restored: the caller's getters refer
   to it. */
PetscErrorCode HycoEstimatesFeatures(HycoROM m, PetscReal feature[])
{
  const PetscInt shown = m->trace.shown;
  PetscReal one[HYCO_FEATURES];

  PetscFunctionBegin;
  /* Without a history there is one solution. */
  if (!m->trace.n_listed) {
    PetscCall(MeasureOne(m, feature));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscArrayzero(feature, HYCO_FEATURES));
  for (PetscInt k = 0; k < m->trace.n_listed; k++) {
    PetscCall(HycoROMSetStep(m, k));
    PetscCall(MeasureOne(m, one));
    for (PetscInt j = 0; j < HYCO_FEATURES; j++) feature[j] = PetscMax(feature[j], one[j]);
  }
  PetscCall(HycoROMSetStep(m, shown));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The range of each parameter covered by training. Once for a model: it depends on the training points alone, and
   clones share it. */
static PetscErrorCode FindReach(HycoROM m)
{
  const PetscInt n_par = m->model->scene->n_parameters;

  PetscFunctionBegin;
  if (m->model->reach) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(2 * n_par + 1, &m->model->reach));
  PetscCall(HycoSamplesReach(m->model->scene, m->model->n_points, m->model->points, m->model->reach,
                             m->model->reach + n_par));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The nearest point of the region of training, and the distance of mu from it. */
static PetscReal EstimateBeyond(HycoROM m, const PetscReal mu[], PetscReal nearest[])
{
  const HycoScene s = m->model->scene;
  PetscReal most = 0;

  for (PetscInt p = 0; p < s->n_parameters; p++) {
    /* A parameter of one value has no width; its distance is then absolute. */
    const PetscReal width = s->hi[p] > s->lo[p] ? s->hi[p] - s->lo[p] : 1;

    nearest[p] = PetscMin(PetscMax(mu[p], m->model->reach[p]), m->model->reach[s->n_parameters + p]);
    most = PetscMax(most, PetscAbsReal(mu[p] - nearest[p]) / width);
  }
  /* Round-off of a range's end that was written in decimal is not outside. */
  return most > 1e-12 ? most : 0;
}

/* term[j]: log(1 + f_j / floor_j) */
static PetscReal EstimateEvaluate(const PetscReal coefficient[], const PetscReal term[])
{
  PetscReal sum = coefficient[HYCO_ESTIMATE_FEATURES];

  for (PetscInt j = 0; j < HYCO_ESTIMATE_FEATURES; j++) sum += coefficient[j] * term[j];
  return PetscExpReal(PetscMin(sum, 200));
}

/* The largest ratio of a feature to that at the held-out points; 1: none is larger. */
static PetscReal EstimateOutsideTraining(HycoROM m, const PetscReal feature[], PetscInt *which)
{
  PetscReal most = 1;

  *which = -1;
  for (PetscInt j = 0; j < HYCO_FEATURES; j++) {
    const PetscReal met = m->model->estimates.reached[j],
                    reached = j == NEW_CONTACTS ? PetscMin(met, NEW_REGIME_FORCE) : met;

    /* slight: changes below it are round-off of the feature, whatever the held-out values were. A negative `reached` is
       a feature that no held-out point had. */
    if (!(slight[j] > 0) || reached < 0 || (j <= PENETRATION && m->ops->features)) continue;
    if (!(feature[j] > most * PetscMax(reached, slight[j]))) continue;
    most = feature[j] / PetscMax(reached, slight[j]);
    *which = j;
  }
  return most;
}

/* Whether the displacement follows the forces; in models without held-out points only if their forces are accurate. */
static PetscBool ExceedsSceneResidual(HycoROM m, PetscReal inconsistency)
{
  const HycoEstimates *t = &m->model->estimates;

  if (!t->n || t->reached[INCONSISTENCY] < 0) return (PetscBool)(m->model->traits.forces && inconsistency > UNJUDGED);
  /* An error that the held-out points had too is in their estimates already. */
  return (PetscBool)(inconsistency > PetscMax(INCONSISTENT, HYCO_UNSEEN * t->reached[INCONSISTENCY]));
}

/* A formula fitted to few points may grow or fall without measure between them: in regimes that held-out points had, no
   more than a multiple of their largest error, and no less than a share of it. Along paths errors also peak between
   training points (where a body begins to collapse) without a sign in the features: there, an error of twice the
   largest is within five estimates. */
#define MOST_OVER 3
/* Number of held-out points from which their largest error is not raised: of 20 the largest is within a factor of later
   ones. */
#define MANY_HELD_OUT 20.
#define MOST_UNDER    30
/* Largest held-out error of paths over an estimate, at most: two fifths of it, since errors peak between paths without
   a sign in the features. */
#define MOST_UNDER_PATH 2.5
#define MOST_FOLLOWED   10

/* The fit extrapolates in its features; estimates far outside the errors that it was fitted to are not supported
   by any of them. largest: of the held-out errors; 0: not known. */
static PetscReal EstimateClamped(HycoROM m, PetscReal estimate, PetscReal largest)
{
  const PetscReal under = m->trace.n_listed ? MOST_UNDER_PATH : MOST_UNDER;

  return largest > 0 ? PetscMax(PetscMin(estimate, MOST_OVER * largest), largest / under) : estimate;
}

/* From a formula, or for a type whose errors do not follow the features from their largest: the largest of few is a
   smaller one. */
static PetscReal EstimateError(HycoROM m, const PetscReal law[], const PetscReal term[], PetscReal largest)
{
  const PetscReal few = PetscSqrtReal(PetscMax(1, MANY_HELD_OUT / (PetscReal)m->model->estimates.n));

  return m->model->traits.uniform ? MOST_OVER * few * largest
                                  : EstimateClamped(m, EstimateEvaluate(law, term), largest);
}

/* The norm of the predicted field that the output follows, and the kind of error of that field. */
PetscReal HycoOutputNorm(const HycoQuantity *q, const HycoPrediction *p, HycoEstimateKind *kind)
{
  const PetscBool forces = (PetscBool)(q->kind >= HYCO_QUANTITY_FORCE);

  if (kind) *kind = forces ? HYCO_ESTIMATE_LAMBDA : HycoQuantityOfPosition(q) ? HYCO_ESTIMATE_U : HYCO_ESTIMATE_SIGMA;
  return forces ? p->lambda_norm2 : p->u_norm2;
}

/* Of a type whose errors do not follow the features. Few held-out points seldom have the largest error: it grows with
   the field that the output follows, and with the estimated error of that field, whose bound knows many samples, as far
   as the output followed its errors; at most MOST_FOLLOWED times. (Sets of 8 of 100 points of examples/hertz, blocks
   and pellet: the largest error times the factor bounds 96.5 to 100 % of the others, by output; so 99.5 to 100 %.) */
static PetscReal FollowField(HycoROM m, PetscInt q, const HycoPrediction *p, const PetscReal field[])
{
  const HycoOutputEstimate *o = &m->model->estimates.output[q];
  HycoEstimateKind kind;
  PetscReal norm = HycoOutputNorm(&m->model->scene->quantity[q], p, &kind), own;

  if (!(o->norm > 0)) return EstimateError(m, NULL, NULL, o->largest);
  norm = PetscMax(norm, HYCO_SMALL_FORCE * o->norm);
  own = EstimateError(m, NULL, NULL, o->relative * norm);
  return PetscMax(own, PetscMin(MOST_FOLLOWED * own, o->amplified * PetscMax(field[kind], 0) * norm));
}

/* The estimates of the calibrated formulas, times `factor`. */
static void EvaluateFormulas(HycoROM m, const PetscReal feature[], PetscReal factor, HycoPrediction *p)
{
  const HycoEstimates *t = &m->model->estimates;
  PetscReal *const own[HYCO_N_ESTIMATES] = {&p->estimated_error_u, &p->estimated_error_sigma,
                                            &p->estimated_error_lambda};
  PetscReal term[HYCO_ESTIMATE_FEATURES], estimate[HYCO_N_ESTIMATES], field[HYCO_N_ESTIMATES];

  /* As in the fit of the laws: log(1 + f / floor) is flat for features that are small against their floor and linear in
     log f above. */
  for (PetscInt j = 0; j < HYCO_ESTIMATE_FEATURES; j++) term[j] = PetscLogReal(1 + feature[j] / t->floor[j]);
  for (PetscInt e = 0; e < HYCO_N_ESTIMATES; e++) { /* a type's own estimates are least values, or replaced */
    estimate[e] = t->has[e] ? EstimateError(m, t->law[e], term, t->largest[e]) : -1;
    field[e] = m->model->traits.uniform ? PetscMax(estimate[e], *own[e]) : estimate[e];
    /* Errors of round-off are no less at a point where those of the held-out ones were. */
    if (field[e] >= 0) field[e] = PetscMax(field[e], HYCO_OUTPUT_ROUND_OFF);
    *own[e] = field[e] < 0               ? -1
              : m->model->traits.uniform ? PetscMax(estimate[e] * factor, field[e])
                                         : field[e] * factor;
  }
  for (PetscInt q = 0; q < t->n_outputs; q++) {
    const HycoOutputEstimate *o = &t->output[q];

    /* An output that nearly vanishes has round-off of its usual size, which no feature shows. */
    if (o->has && !PetscIsInfOrNanReal(p->quantity[q]))
      p->estimated_error_quantity[q] =
          PetscMax(m->model->traits.uniform ? FollowField(m, q, p, field) : EstimateError(m, o->law, term, o->largest),
                   HYCO_OUTPUT_ROUND_OFF * o->magnitude) *
          factor;
  }
}

/* What a new regime adds to the estimates. Of forces beside cells that have modes at some of their nodes alone, which
   are accurate, the stresses of such cells alone have none: *torn. */
static PetscReal OutsideTrainingFactor(HycoROM m, HycoPrediction *p, const PetscReal feature[],
                                       PetscBool *discontinuous)
{
  p->unseen = EstimateOutsideTraining(m, feature, &p->unseen_feature);
  *discontinuous = (PetscBool)(m->model->traits.uniform && p->unseen_feature == OUTSIDE && p->unseen > HYCO_UNSEEN);
  return *discontinuous ? 1 : PetscMin(p->unseen, MOST_FACTOR);
}

/* From the features of the prediction; nearest: the point of the region of training. */
static PetscErrorCode EvaluateFeatures(HycoROM m, const PetscReal nearest[], HycoPrediction *p)
{
  const HycoEstimates *t = &m->model->estimates;
  PetscReal feature[HYCO_FEATURES], outside;
  PetscBool discontinuous;

  PetscFunctionBegin;
  PetscCall(HycoEstimatesFeatures(m, feature));
  p->inconsistency = feature[INCONSISTENCY];
  p->inconsistent = ExceedsSceneResidual(m, p->inconsistency);
  if (t->n) {
    const PetscReal factor = OutsideTrainingFactor(m, p, feature, &discontinuous);

    /* Beyond the training the estimates grow with the square of the distance in units of a usual distance between
       points. */
    outside = 1 + (p->beyond > 0 ? HycoEstimatesDistance(m->model->scene, m->fe->mu, nearest) / t->floor[DISTANCE] : 0);
    outside = p->beyond > 0 ? PetscMax(outside * outside, m->stretch) : 1;
    /* Beside contacts that no solution closed no error was ever measured. */
    if (p->unseen_feature != NEW_CONTACTS || p->unseen <= HYCO_UNSEEN)
      EvaluateFormulas(m, feature, outside * factor, p);
    for (PetscInt q = 0; discontinuous && q < t->n_outputs; q++) {
      if (HycoQuantityOfStress(&m->model->scene->quantity[q])) p->estimated_error_quantity[q] = -1;
    }
  }
  /* Displacements that miss the gaps are wrong by at least that. */
  if (p->inconsistent && p->estimated_error_u >= 0)
    p->estimated_error_u = PetscMax(p->estimated_error_u, p->inconsistency);
  if (p->inconsistent && p->estimated_error_sigma >= 0)
    p->estimated_error_sigma = PetscMax(p->estimated_error_sigma, p->inconsistency);
  /* Full order may choose another position. */
  if (p->loose) p->estimated_error_u = -1;
  for (PetscInt q = 0; p->loose && q < m->model->scene->n_quantities; q++) {
    if (HycoQuantityOfPosition(&m->model->scene->quantity[q])) p->estimated_error_quantity[q] = -1;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Forces that had to be changed so much to balance, or do not balance, are wrong by about that. Reactions that are
   measured may also miss the balance by their own error. */
static PetscErrorCode EstimateBalance(HycoROM m, HycoPrediction *p)
{
  const PetscReal limit = PetscMax(HYCO_RESIDUAL, p->estimated_error_lambda < 0 ? UNJUDGED : p->estimated_error_lambda);

  PetscFunctionBegin;
  p->unbalanced = (PetscBool)(p->balance > limit);
  for (PetscInt q = 0; q < m->model->scene->n_quantities && !m->model->scene->n_times; q++) {
    PetscReal miss, size;

    PetscCall(HycoROMGetMiss(m, q, p->quantity[q], &miss, &size));
    if (!(size > 0)) continue;
    p->balance = PetscMax(p->balance, miss / size);
    p->unbalanced = (PetscBool)(p->unbalanced || miss > limit * size + PetscMax(p->estimated_error_quantity[q], 0));
  }
  if (p->estimated_error_lambda >= 0)
    p->estimated_error_lambda = PetscMax(p->estimated_error_lambda, PetscMax(m->corrected, m->imbalance));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* First everything is set to "not known", so that every early end leaves a valid prediction. */
PetscErrorCode HycoEstimatesEvaluate(HycoROM m, HycoPrediction *p)
{
  PetscReal nearest[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  for (PetscInt q = 0; q < HYCO_MAX_QUANTITIES; q++) p->estimated_error_quantity[q] = -1;
  p->estimated_error_u = p->estimated_error_lambda = p->estimated_error_sigma = -1;
  p->inconsistency = -1;
  p->balance = p->reason > 0 ? m->imbalance : -1;
  p->inconsistent = p->unbalanced = PETSC_FALSE;
  p->unseen = 1;
  p->unseen_feature = -1;
  PetscCall(FindReach(m));
  /* Reported whether or not there are estimates. */
  p->beyond = EstimateBeyond(m, m->fe->mu, nearest);
  m->stretch = 1;
  if (p->reason > 0) PetscTryTypeMethod(m, estimate, p);
  /* Features of forces outside the RID need the reconstruction. */
  if (p->reason <= 0 || (m->ops->reconstruct && !m->reconstruct)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(EvaluateFeatures(m, nearest, p));
  PetscCall(EstimateBalance(m, p));
  /* Full order may find other nodal forces, as far away as they are. */
  if (p->n_dependent > 0) p->estimated_error_lambda = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}
/* "u 1.2e-04, stress 3e-03, contact forces 2e-02" */
static void DescribeErrors(const PetscReal error[], char text[HYCO_LINE])
{
  char u[32];

  snprintf(u, sizeof(u), error[HYCO_ESTIMATE_U] < 0 ? "not compared" : "%.2g", (double)error[HYCO_ESTIMATE_U]);
  snprintf(text, HYCO_LINE, "u %s, stress %.2g, contact forces %.2g", u, (double)error[HYCO_ESTIMATE_SIGMA],
           (double)error[HYCO_ESTIMATE_LAMBDA]);
}

/* Errors that were measured, of the held-out points, come before what is estimated from them. */
PetscErrorCode HycoEstimatesView(HycoROM m, PetscViewer viewer)
{
  const HycoEstimates *t = &m->model->estimates;
  char median[HYCO_LINE], largest[HYCO_LINE];

  PetscFunctionBegin;
  if (t->n_held) {
    DescribeErrors(t->median, median);
    DescribeErrors(t->largest, largest);
    PetscCall(PetscViewerASCIIPrintf(viewer, "  errors at %d held-out points: median %s; largest %s\n", (int)t->n_held,
                                     median, largest));
  }
  for (PetscInt q = 0; q < t->n_outputs; q++) {
    const HycoOutputEstimate *o = &t->output[q];

    if (o->magnitude >= 0 && o->median < 0)
      PetscCall(PetscViewerASCIIPrintf(viewer, "    output %s: not compared, not estimated\n",
                                       m->model->scene->quantity[q].name));
    else if (o->magnitude >= 0)
      PetscCall(PetscViewerASCIIPrintf(viewer,
                                       "    output %s: median %.2g, largest %.2g (values up to %.4g); error %s\n",
                                       m->model->scene->quantity[q].name, (double)o->median, (double)o->largest,
                                       (double)o->magnitude, o->has ? "estimated" : "not estimated"));
    else
      PetscCall(PetscViewerASCIIPrintf(viewer, "    output %s: not known, not estimated\n",
                                       m->model->scene->quantity[q].name));
  }
  if (t->n)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  error estimates: calibrated on %d predictions of held-out solutions\n",
                                     (int)t->n));
  else if (!m->ops->estimate)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  error estimates: none, not calibrated\n"));
  if (m->model->search) PetscCall(PetscViewerASCIIPrintf(viewer, "%s", m->model->search));
  PetscFunctionReturn(PETSC_SUCCESS);
}
