/* Contacts with friction, at full order and in a model (hycoslip.h). */
#include <hycoentries.h>
#include <hycosceneimpl.h>
#include <hycoslip.h>

/* Share of mu r_n from which a contact counts as slipping: 1 less the residual of the forces, 1e-8. */
#define SLIPS (1 - 1e-8)
/* Of the largest displacement: 4500 eps, a slip that is the difference of displacements, and does no work. */
#define SLIP_ROUND_OFF 1e-12

/* The rows of the contacts and their cones. */
static PetscErrorCode CountRows(HycoSlip *s, HycoScene scene, const HycoPairs *pairs)
{
  const PetscInt n = s->n;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(n + 1, &s->row, n, &s->of, n, &s->mu));
  PetscCall(PetscMalloc2(2 * n, &s->data, 6 * n, &s->tangent));
  s->row[0] = 0;
  for (PetscInt k = 0; k < n; k++) {
    s->of[k] = scene->contact[pairs->contact[k]]->friction != NULL;
    /* A contact without friction keeps its one row: both kinds are in one system. */
    s->row[k + 1] = s->row[k] + (s->of[k] ? s->dim : 1);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* cone[0] for contacts without friction, cone[1] for those with; of[k] tells which. Collective on comm (the cones). */
PetscErrorCode HycoSlipCreate(MPI_Comm comm, HycoScene scene, const HycoPairs *pairs, PetscInt dim, HycoSlip *s)
{
  const PetscInt n = pairs->n;

  PetscFunctionBegin;
  s->n = n;
  s->dim = dim;
  PetscCall(CountRows(s, scene, pairs));
  for (PetscInt c = 0; c < 2; c++) {
    PetscCall(HycoConeCreate(comm, &s->cone[c]));
    PetscCall(HycoConeSetSize(s->cone[c], c ? dim : 1));
    PetscCall(HycoConeSetType(s->cone[c], c ? HYCO_CONE_COULOMB : HYCO_CONE_NONNEGATIVE));
  }
  /* Zero: no force, no slip, open. */
  PetscCall(PetscCalloc4(3 * n, &s->shear.force, 3 * n, &s->shear.slip, n, &s->shear.work, n, &s->shear.state));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Grouped as allocated: each PetscFreeN() gets the pointers of one PetscMallocN(). */
PetscErrorCode HycoSlipDestroy(HycoSlip *s)
{
  PetscFunctionBegin;
  for (PetscInt c = 0; c < 2; c++) PetscCall(HycoConeDestroy(&s->cone[c]));
  PetscCall(PetscFree3(s->row, s->of, s->mu));
  PetscCall(PetscFree2(s->data, s->tangent));
  PetscCall(PetscFree4(s->shear.force, s->shear.slip, s->shear.work, s->shear.state));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Forces, slip, work and state are those since the path began. */
PetscErrorCode HycoSlipBegin(HycoSlip *s)
{
  PetscFunctionBegin;
  PetscCall(PetscArrayzero(s->shear.force, 3 * s->n));
  PetscCall(PetscArrayzero(s->shear.slip, 3 * s->n));
  PetscCall(PetscArrayzero(s->shear.work, s->n));
  PetscCall(PetscArrayzero(s->shear.state, s->n));
  s->n_taken = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At the moved slave nodes X. Local: a negative coefficient is an error on the rank that has the contact. */
PetscErrorCode HycoSlipCoefficients(HycoSlip *s, HycoFE fe, const HycoPairs *pairs)
{
  PetscInt n = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n; k++) {
    HycoExpr friction = fe->scene->contact[pairs->contact[k]]->friction;
    const PetscReal *x = fe->X + 3 * pairs->slave[k];
    char place[HYCO_LINE];

    s->mu[k] = 0;
    if (!friction) continue;
    PetscCall(HycoExprEval(friction, fe->mu, 1, x, &s->mu[k]));
    if (s->mu[k] < 0) {
      PetscCall(HycoExprPlace(friction, fe->mu, x, place));
      HycoFail("%s is %g at %s; a coefficient of friction must be 0 or more", HycoExprKey(friction), (double)s->mu[k],
               place);
    }
    /* Its forces are round-off of the normal ones. */
    if (s->mu[k] < PETSC_MACHINE_EPSILON) s->mu[k] = 0;
    s->data[n++] = s->mu[k];
    /* g = 0: friction without a threshold (coulomb.c). Only contacts with friction have data, in the order of the
       blocks. */
    s->data[n++] = 0;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Local: the caller reduces over the ranks. */
PetscBool HycoSlipHasFriction(const HycoSlip *s)
{
  for (PetscInt k = 0; k < s->n; k++) {
    if (s->mu[k] > 0) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* Of contact k, with the forces r and w of its rows. */
static void SlipAdd(HycoSlip *h, PetscInt k, const PetscReal r[], const PetscReal w[], PetscReal most)
{
  const HycoShear *s = &h->shear;
  const PetscReal *t = h->tangent + 6 * k;
  PetscReal size = 0, work = 0;

  for (PetscInt j = 0; j + 1 < h->dim && h->of[k]; j++) {
    size += r[j + 1] * r[j + 1];
    /* -w_t is the slip and -r_t the force on the slave: the work is what friction dissipates, >= 0. */
    if (r[0] > 0) work -= r[j + 1] * w[j + 1];
    for (PetscInt c = 0; c < 3 && r[0] > 0; c++) s->slip[3 * k + c] -= w[j + 1] * t[3 * j + c];
  }
  s->state[k] = !(r[0] > 0) ? HYCO_OPEN : PetscSqrtReal(size) < SLIPS * h->mu[k] * r[0] ? HYCO_STICK : HYCO_SLIP;
  /* Sticking contacts have slips of round-off, whose work would add up over many steps. */
  if (PetscAbsReal(work) > SLIP_ROUND_OFF * PetscSqrtReal(size) * most) s->work[k] += work;
}

/* L, w: by row of this rank, w = D - B U. most: the largest displacement, the scale of round-off. */
void HycoSlipAdd(HycoSlip *s, const PetscReal L[], const PetscReal w[], PetscReal most)
{
  HycoSlipVectors(s, L);
  for (PetscInt k = 0; k < s->n; k++) SlipAdd(s, k, L + s->row[k], w + s->row[k], most);
}

/* The times of the last two accepted steps, which HycoSlipExtrapolate() needs; n_taken: whether there are two. */
void HycoSlipTake(HycoSlip *s, PetscReal t)
{
  s->t_before = s->t;
  s->t = t;
  s->n_taken++;
}

/* Linear. The solver takes it only where its residual is smaller than that of L: not where a load is reversed. */
PetscBool HycoSlipExtrapolate(const HycoSlip *s, PetscReal t, PetscInt n, const PetscReal L[], const PetscReal before[],
                              PetscReal r[])
{
  PetscReal ratio;

  if (s->n_taken < 2 || !(s->t > s->t_before)) return PETSC_FALSE;
  ratio = (t - s->t) / (s->t - s->t_before);
  if (!(ratio > 0) || PetscIsInfReal(ratio)) return PETSC_FALSE;
  for (PetscInt i = 0; i < n; i++) r[i] = L[i] + ratio * (L[i] - before[i]);
  return PETSC_TRUE;
}

/* The force is the one on the slave, the opposite of the multiplier (SlipAdd()). */
void HycoSlipForces(const HycoSlip *s, const PetscReal normal[], const PetscReal force[], PetscReal L[])
{
  for (PetscInt k = 0; k < s->n; k++) {
    L[s->row[k]] = normal[k];
    for (PetscInt j = s->row[k] + 1; j < s->row[k + 1]; j++) {
      const PetscReal *t = s->tangent + 6 * k + 3 * (j - s->row[k] - 1), *f = force + 3 * k;

      L[j] = -(f[0] * t[0] + f[1] * t[1] + f[2] * t[2]);
    }
  }
}

void HycoSlipVectors(HycoSlip *s, const PetscReal L[])
{
  for (PetscInt k = 0; k < s->n; k++) {
    for (PetscInt c = 0; c < 3; c++) s->shear.force[3 * k + c] = 0;
    for (PetscInt j = s->row[k] + 1; j < s->row[k + 1]; j++) {
      const PetscReal *t = s->tangent + 6 * k + 3 * (j - s->row[k] - 1);

      for (PetscInt c = 0; c < 3; c++) s->shear.force[3 * k + c] -= L[j] * t[c];
    }
  }
}

PetscInt HycoSlipCountRows(HycoScene scene, const HycoPairs *pairs, PetscInt dim)
{
  PetscInt n = 0;

  for (PetscInt k = 0; k < pairs->n; k++) n += scene->contact[pairs->contact[k]]->friction ? dim : 1;
  return n;
}

/* sum: the work, and the number of slipping contacts as a real, so that one reduction serves both. Local. */
void HycoSlipSum(const HycoSlip *s, PetscReal sum[2])
{
  sum[0] = sum[1] = 0;
  for (PetscInt k = 0; k < s->n; k++) {
    sum[0] += s->shear.work[k];
    sum[1] += s->of[k] && s->shear.state[k] == HYCO_SLIP;
  }
}
