/*
  How far a prediction can be trusted: an estimate of its error from what is known online, calibrated at training
  (calibrate.c). log e = c_0 + sum_j c_j log(1 + f_j / floor_j), c_j >= 0, of four features:

    0  misfit       distance of the full-order displacements from what the modes alone give there, over their size
    1  penetration  of the contacts outside A_lambda, which no equation of (38) hears of, over the size of B U
    2  adhesion     forces reconstructed where the predicted displacement leaves a gap, over the size of the forces
    3  distance     to the nearest training point, each parameter scaled to its range

  Outside what training has seen the estimate is multiplied by (1 + b / d)^2, b the scaled distance from it and d the
  training points' spacing. K's rows on the interface are cut off with the RID's elements, so that no residual can be
  formed there; the misfit says instead how far the two sides of the interface disagree.
*/
#include <hycoalgorithms.h>
#include <hycocondensed.h>
#include <hycomodelimpl.h>
#include <petscviewer.h>

enum { MISFIT, PENETRATION, ADHESION, DISTANCE };

static PetscReal Quotient(PetscReal part2, PetscReal size2)
{
  return size2 > 0 ? PetscSqrtReal(part2 / size2) : part2 > 0 ? 1 : 0;
}

static PetscReal Misfit(HycoModel m)
{
  PetscReal lost = 0, size = 0;

  for (PetscInt f = 0; f < m->n_fe; f++) {
    const PetscInt dof = m->fe_dof[f];
    PetscReal by_modes = m->fe->u0[dof];

    for (PetscInt j = 0; j < m->l; j++) by_modes += m->V[(size_t)dof * (size_t)m->l + (size_t)j] * m->gamma[j];
    lost += (m->U[dof] - by_modes) * (m->U[dof] - by_modes);
    size += m->U[dof] * m->U[dof];
  }
  return Quotient(lost, size);
}

static void Contacts(HycoModel m, PetscReal *penetration, PetscReal *adhesion)
{
  PetscReal in = 0, moved = 0, stuck = 0, force = 0;

  for (PetscInt k = 0; k < m->pairs.n; k++) {
    const PetscReal bu = HycoModelAddRow(m, k, 0);

    moved += bu * bu;
    force += m->Lambda[k] * m->Lambda[k];
    if (m->in_rid[k]) continue;
    if (bu > m->gap[k])
      in += (bu - m->gap[k]) * (bu - m->gap[k]);
    else if (bu < m->gap[k])
      stuck += m->Lambda[k] * m->Lambda[k];
  }
  *penetration = Quotient(in, moved);
  *adhesion = Quotient(stuck, force);
}

PetscReal HycoTrustDistance(HycoScene s, const PetscReal a[], const PetscReal b[])
{
  PetscReal sum = 0;

  for (PetscInt p = 0; p < s->n_parameters; p++) {
    const PetscReal width = s->hi[p] > s->lo[p] ? s->hi[p] - s->lo[p] : 1, step = (a[p] - b[p]) / width;

    sum += step * step;
  }
  return PetscSqrtReal(sum);
}

PetscErrorCode HycoTrustMeasure(HycoModel m, PetscReal feature[])
{
  const PetscInt n_par = m->scene->n_parameters;

  PetscFunctionBegin;
  PetscCall(HycoModelComplete(m));
  feature[MISFIT] = Misfit(m);
  Contacts(m, &feature[PENETRATION], &feature[ADHESION]);
  feature[DISTANCE] = m->n_points && n_par ? PETSC_MAX_REAL : 0;
  for (PetscInt k = 0; n_par && k < m->n_points; k++)
    feature[DISTANCE] = PetscMin(feature[DISTANCE], HycoTrustDistance(m->scene, m->fe->mu, m->points + k * n_par));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What training has seen of each parameter: from its least to its largest value, and half the widest step between two
   more at either end, so that grids of cell centres reach the ends of the ranges; never past the ranges. */
static PetscErrorCode FindReach(HycoModel m)
{
  const HycoScene s = m->scene;
  const PetscInt n = m->n_points, n_par = s->n_parameters;
  PetscReal *value;

  PetscFunctionBegin;
  if (m->reach) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(2 * n_par + 1, &m->reach));
  PetscCall(PetscMalloc1(n + 1, &value));
  for (PetscInt p = 0; p < n_par; p++) {
    PetscReal step = 0;

    for (PetscInt k = 0; k < n; k++) value[k] = m->points[k * n_par + p];
    PetscCall(PetscSortReal(n, value));
    for (PetscInt k = 1; k < n; k++) step = PetscMax(step, value[k] - value[k - 1]);
    step = 0.5 * step * (1 + 1e-9);
    m->reach[2 * p] = n ? PetscMax(s->lo[p], value[0] - step) : s->lo[p];
    m->reach[2 * p + 1] = n ? PetscMin(s->hi[p], value[n - 1] + step) : s->hi[p];
  }
  PetscCall(PetscFree(value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The nearest point of what training has seen, and how far outside it mu is. */
static PetscReal Beyond(HycoModel m, const PetscReal mu[], PetscReal nearest[])
{
  const HycoScene s = m->scene;
  PetscReal most = 0;

  for (PetscInt p = 0; p < s->n_parameters; p++) {
    const PetscReal width = s->hi[p] > s->lo[p] ? s->hi[p] - s->lo[p] : 1;

    nearest[p] = PetscMin(PetscMax(mu[p], m->reach[2 * p]), m->reach[2 * p + 1]);
    most = PetscMax(most, PetscAbsReal(mu[p] - nearest[p]) / width);
  }
  return most > 1e-12 ? most : 0;
}

static PetscReal Estimate(const HycoTrust *t, const PetscReal coefficient[], const PetscReal feature[])
{
  PetscReal sum = coefficient[HYCO_TRUST_FEATURES];

  for (PetscInt j = 0; j < HYCO_TRUST_FEATURES; j++) sum += coefficient[j] * PetscLogReal(1 + feature[j] / t->floor[j]);
  return PetscExpReal(PetscMin(sum, 200));
}

/* A condensed model's own estimates; those of older files by values left out in training. */
static void Condensed(HycoModel m, HycoPrediction *p)
{
  const HycoCondensed c = m->condensed;
  PetscReal growth = 1, law[HYCO_N_LAWS];

  if (c->law) {
    HycoCondensedLaw(c, m->fe->mu, law);
    for (PetscInt j = 0; j < HYCO_N_LAWS; j++)
      law[j] = law[j] < 0 || c->scale[j] < 0 ? -1 : PetscMax(HYCO_LAW_FLOOR, law[j] * c->scale[j]);
    p->estimated_error_u = law[HYCO_LAW_U];
    p->estimated_error_lambda = p->interpolation_error = law[HYCO_LAW_LAMBDA];
    p->estimated_error_u_full = law[HYCO_LAW_U_FULL];
    return;
  }
  for (PetscInt q = 0; q < c->dim; q++) {
    if (!c->affine[q]) growth *= HycoPolynomialGrowth(c->n[q], c->x[q], m->fe->mu[q]);
  }
  p->estimated_error_lambda = p->interpolation_error;
  if (c->errors_u[0] < 0) return; /* an older file */
  p->estimated_error_u = c->errors_u[0] * growth;
  p->estimated_error_u_full = c->errors_u[1] * growth;
}

PetscErrorCode HycoTrustEstimate(HycoModel m, HycoPrediction *p)
{
  PetscReal nearest[HYCO_MAX_PARAMETERS], feature[HYCO_TRUST_FEATURES], outside;

  PetscFunctionBegin;
  p->estimated_error_u = p->estimated_error_lambda = -1;
  PetscCall(FindReach(m));
  p->beyond = Beyond(m, m->fe->mu, nearest);
  p->estimated_error_u_full = -1;
  if (m->condensed && p->reason > 0) Condensed(m, p);
  if (!m->trust.n || p->reason <= 0 || !m->reconstruct) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoTrustMeasure(m, feature));
  outside = 1 + (p->beyond > 0 ? HycoTrustDistance(m->scene, m->fe->mu, nearest) / m->trust.floor[DISTANCE] : 0);
  p->estimated_error_u = Estimate(&m->trust, m->trust.u, feature) * outside * outside;
  if (m->trust.force > 0) /* without a force in training there is nothing to be calibrated on */
    p->estimated_error_lambda = Estimate(&m->trust, m->trust.lambda, feature) * outside * outside;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTrustView(HycoModel m, PetscViewer viewer)
{
  PetscFunctionBegin;
  if (m->trust.n)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  estimates its errors, by %d predictions of held-out solutions\n",
                                     (int)m->trust.n));
  else if (m->type == HYCO_MODEL_CONDENSED)
    PetscCall(PetscViewerASCIIPrintf(
        viewer, "  estimates its errors by values left out%s\n",
        !m->condensed->law && m->condensed->errors_u[0] < 0 ? ", and none of u: an older file" : ""));
  else
    PetscCall(PetscViewerASCIIPrintf(viewer, "  does not estimate its errors: not calibrated\n"));
  if (m->search) PetscCall(PetscViewerASCIIPrintf(viewer, "%s", m->search));
  PetscFunctionReturn(PETSC_SUCCESS);
}
