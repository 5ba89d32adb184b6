/* The state of contacts with friction, at full order and in a model (hycocontactstate.h). */
#include <hycoentries.h>
#include <hycosceneimpl.h>
#include <hycocontactstate.h>
#include <hycosolverimpl.h>

/* Share of mu r_n from which a contact counts as slipping: 1 less the residual of the forces, 1e-8. */
#define SLIPS (1 - 1e-8)
/* Of the largest displacement: 4500 eps, a slip that is the difference of displacements, and does no work. */
#define SLIP_ROUND_OFF 1e-12

/* The rows of the contacts and their cones. */
static PetscErrorCode CountRows(HycoContactState s, HycoScene scene)
{
  const PetscInt n = s->n;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(n + 1, &s->row, n, &s->of, n, &s->mu));
  PetscCall(PetscMalloc2(2 * n, &s->data, 6 * n, &s->tangent));
  s->row[0] = 0;
  for (PetscInt k = 0; k < n; k++) {
    s->of[k] = scene->contact[s->pairs->contact[k]]->friction != NULL;
    /* A contact without friction keeps its one row: both kinds are in one system. */
    s->row[k + 1] = s->row[k] + (s->of[k] ? s->dim : 1);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* cone[0] for contacts without friction, cone[1] for those with; of[k] tells which. Collective on comm (the cones). */
PetscErrorCode HycoContactStateCreate(MPI_Comm comm, HycoScene scene, HycoPairs *pairs, PetscInt dim,
                                      HycoContactState *state)
{
  const PetscInt n = pairs->n;
  HycoContactState s;

  PetscFunctionBegin;
  PetscCheck(dim > 1, comm, PETSC_ERR_USER,
             "the mesh has 1 space dimension, in which nothing slides; remove the contacts' friction");
  PetscCall(PetscNew(state));
  s = *state;
  s->comm = comm;
  s->pairs = pairs;
  s->n = n;
  s->dim = dim;
  PetscCall(CountRows(s, scene));
  for (PetscInt c = 0; c < 2; c++) {
    PetscCall(HycoConeCreate(comm, &s->cone[c]));
    PetscCall(HycoConeSetSize(s->cone[c], c ? dim : 1));
    PetscCall(HycoConeSetType(s->cone[c], c ? HYCO_CONE_COULOMB : HYCO_CONE_NONNEGATIVE));
  }
  /* Zero: no force, no slip, open. */
  PetscCall(PetscCalloc4(3 * n, &s->shear.force, 3 * n, &s->shear.slip, n, &s->shear.work, n, &s->shear.state));
  PetscCall(VecCreate(comm, &s->L));
  PetscCall(VecSetSizes(s->L, s->row[n], PETSC_DETERMINE));
  PetscCall(VecSetType(s->L, VECSTANDARD));
  HycoVecDuplicate(s->L, &s->L_before, &s->ahead);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Grouped as allocated: each PetscFreeN() gets the pointers of one PetscMallocN(). */
PetscErrorCode HycoContactStateDestroy(HycoContactState *state)
{
  HycoContactState s = *state;

  PetscFunctionBegin;
  if (!s) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt c = 0; c < 2; c++) PetscCall(HycoConeDestroy(&s->cone[c]));
  PetscCall(PetscFree3(s->row, s->of, s->mu));
  PetscCall(PetscFree2(s->data, s->tangent));
  PetscCall(PetscFree4(s->shear.force, s->shear.slip, s->shear.work, s->shear.state));
  HycoDestroyAll(&s->L, &s->L_before, &s->ahead);
  HycoFreeAll(&s->u_old, state);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoContactStateBegin(HycoContactState s)
{
  PetscFunctionBegin;
  PetscCall(PetscArrayzero(s->shear.force, 3 * s->n));
  PetscCall(PetscArrayzero(s->shear.slip, 3 * s->n));
  PetscCall(PetscArrayzero(s->shear.work, s->n));
  PetscCall(PetscArrayzero(s->shear.state, s->n));
  PetscCall(VecSet(s->L, 0));
  PetscCall(PetscFree(s->u_old));
  s->n_taken = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At the moved slave nodes X. Local: a negative coefficient is an error on the rank that has the contact. */
PetscErrorCode HycoContactStateCoefficients(HycoContactState s, HycoFE fe)
{
  PetscInt n = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n; k++) {
    HycoExpr friction = fe->scene->contact[s->pairs->contact[k]]->friction;
    const PetscReal *x = fe->X + 3 * s->pairs->slave[k];
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

/* u_old = 0: the slip of the first step counts from the undeformed bodies. */
PetscErrorCode HycoContactStateRows(HycoContactState s, HycoFE fe, HycoRows *rows)
{
  PetscFunctionBegin;
  if (!s->u_old) {
    s->n_dof = fe->n_dof;
    PetscCall(PetscCalloc1(s->n_dof, &s->u_old));
  }
  PetscCheck(s->n_dof == fe->n_dof, PETSC_COMM_SELF, PETSC_ERR_PLIB, "the surfaces changed along a path");
  PetscCall(HycoContactStateCoefficients(s, fe));
  PetscCall(HycoContactTangentRows(fe, s->pairs, s->row, s->u_old, s->tangent, rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoContactStateHasFriction(HycoContactState s, PetscBool *has_friction)
{
  PetscFunctionBegin;
  *has_friction = PETSC_FALSE;
  for (PetscInt k = 0; k < s->n && !*has_friction; k++) *has_friction = (PetscBool)(s->mu[k] > 0);
  HycoAllreduce(has_friction, 1, HYCO_MPI_BOOL, MPI_LOR, s->comm);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of contact k, with the forces r and w of its rows. */
static void AddSlip(HycoContactState h, PetscInt k, const PetscReal r[], const PetscReal w[], PetscReal most)
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
void HycoContactStateAddSlips(HycoContactState s, const PetscReal L[], const PetscReal w[], PetscReal most)
{
  HycoContactStateVectors(s, L);
  for (PetscInt k = 0; k < s->n; k++) AddSlip(s, k, L + s->row[k], w + s->row[k], most);
}

PetscErrorCode HycoContactStateAccept(HycoContactState s, PetscReal t, const PetscReal L[], const PetscReal w[],
                                      PetscReal most, const PetscReal u[])
{
  PetscFunctionBegin;
  HycoContactStateAddSlips(s, L, w, most);
  PetscCall(VecCopy(s->L, s->L_before));
  PetscCall(HycoVecWrite(s->L, s->row[s->n], L));
  PetscCall(PetscArraycpy(s->u_old, u, s->n_dof));
  s->t_before = s->t;
  s->t = t;
  s->n_taken++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Linear. The solver takes it only where its residual is smaller than that of L: not where a load is reversed. */
PetscErrorCode HycoContactStateExtrapolate(HycoContactState s, PetscReal t, PetscReal r[], PetscBool *has)
{
  const PetscReal ratio = s->n_taken < 2 || !(s->t > s->t_before) ? 0 : (t - s->t) / (s->t - s->t_before);
  const PetscScalar *L, *before;

  PetscFunctionBegin;
  *has = (PetscBool)(ratio > 0 && !PetscIsInfReal(ratio));
  if (!*has) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetArrayRead(s->L, &L));
  PetscCall(VecGetArrayRead(s->L_before, &before));
  for (PetscInt i = 0; i < s->row[s->n]; i++) r[i] = L[i] + ratio * (L[i] - before[i]);
  PetscCall(VecRestoreArrayRead(s->L_before, &before));
  PetscCall(VecRestoreArrayRead(s->L, &L));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoContactStateSetStep(HycoContactState s, PetscReal t, HycoSystem system, HycoSolver solver)
{
  PetscScalar *ahead;
  PetscBool has;

  PetscFunctionBegin;
  PetscCall(HycoSystemSetBlocks(system, 2, s->cone, s->n, s->of, s->data));
  PetscCall(VecGetArrayWrite(s->ahead, &ahead));
  PetscCall(HycoContactStateExtrapolate(s, t, ahead, &has));
  PetscCall(VecRestoreArrayWrite(s->ahead, &ahead));
  PetscCall(HycoSolverSetOtherStart(solver, has ? s->ahead : NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The force is the one on the slave, the opposite of the multiplier (AddSlip()). */
void HycoContactStateForces(HycoContactState s, const PetscReal normal[], const PetscReal force[], PetscReal L[])
{
  for (PetscInt k = 0; k < s->n; k++) {
    L[s->row[k]] = normal[k];
    for (PetscInt j = s->row[k] + 1; j < s->row[k + 1]; j++) {
      const PetscReal *t = s->tangent + 6 * k + 3 * (j - s->row[k] - 1), *f = force + 3 * k;

      L[j] = -(f[0] * t[0] + f[1] * t[1] + f[2] * t[2]);
    }
  }
}

void HycoContactStateVectors(HycoContactState s, const PetscReal L[])
{
  for (PetscInt k = 0; k < s->n; k++) {
    for (PetscInt c = 0; c < 3; c++) s->shear.force[3 * k + c] = 0;
    for (PetscInt j = s->row[k] + 1; j < s->row[k + 1]; j++) {
      const PetscReal *t = s->tangent + 6 * k + 3 * (j - s->row[k] - 1);

      for (PetscInt c = 0; c < 3; c++) s->shear.force[3 * k + c] -= L[j] * t[c];
    }
  }
}

PetscInt HycoContactStateCountRows(HycoScene scene, const HycoPairs *pairs, PetscInt dim)
{
  PetscInt n = 0;

  for (PetscInt k = 0; k < pairs->n; k++) n += scene->contact[pairs->contact[k]]->friction ? dim : 1;
  return n;
}

/* The number of slipping contacts is summed as a real, so that one reduction serves both. */
PetscErrorCode HycoContactStateMeasure(HycoContactState s, HycoStep *step)
{
  PetscReal sum[2] = {0, 0};

  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n; k++) {
    sum[0] += s->shear.work[k];
    sum[1] += s->of[k] && s->shear.state[k] == HYCO_SLIP;
  }
  HycoAllreduce(sum, 2, MPIU_REAL, MPI_SUM, s->comm);
  step->friction_work = sum[0];
  step->n_slipping = (PetscInt)sum[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}
