/*
  Rigid motions that soft springs alone hold. K is regular, but its inverse consists of these motions: the flexibility
  of the contacts would be lost in their round-off. A system with friction has them as unknowns of their own, like
  motions of floating bodies, with the springs' stiffness in their block.
*/
#include <hycofomimpl.h>
#include <petscblaslapack.h>

/* Of K's diagonal, the stiffness of a motion on springs: above it K^-1 loses at most four digits to the motion
   (tests/contact/friction_random.py). */
#define SOFT_STIFFNESS 1e-4

/* E = V^T K_s V for the springs' K_s and the n motions of one part from `first` on, on every rank. */
static PetscErrorCode SpringEnergy(HycoFOM f, const HycoMotions *motions, PetscInt first, PetscInt n, PetscReal E[])
{
  HycoFE fe = f->fe;
  const PetscInt dim = fe->dim;
  PetscReal *force;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(fe->n_dof, &force));
  for (PetscInt a = 0; a < n; a++) {
    PetscCall(PetscArrayzero(force, fe->n_dof));
    HycoSpringsAddForces(fe, -1, motions->motion + (size_t)(first + a) * (size_t)fe->n_dof, force);
    for (PetscInt b = 0; b < n; b++) {
      const PetscReal *v = motions->motion + (size_t)(first + b) * (size_t)fe->n_dof;

      E[a * n + b] = 0;
      for (PetscInt i = 0; i < fe->n_dof; i++) {
        if (HycoMeshOwned(fe->mesh, i / dim) >= 0) E[a * n + b] += force[i] * v[i];
      }
    }
  }
  PetscCall(PetscFree(force));
  HycoAllreduce(E, n * n, MPIU_REAL, MPI_SUM, HycoComm(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces the motions of a part by those of which the springs' energy is a sum of squares: their stiffnesses. */
static PetscErrorCode SoftMotionsDiagonalise(HycoFOM f, HycoMotions *motions, PetscInt first, PetscInt n,
                                             PetscReal stiffness[])
{
  const PetscInt rows = f->fe->n_dof;
  PetscReal E[36], work[64];
  PetscBLASInt size = (PetscBLASInt)n, lwork = 64, info;

  PetscFunctionBegin;
  PetscCall(SpringEnergy(f, motions, first, n, E));
  /* One rank decides the vectors for all. */
  if (!f->rank) LAPACKsyev_("V", "U", &size, E, &size, stiffness, work, &lwork, &info);
  HycoBcast(E, n * n, MPIU_REAL, HycoComm(f));
  HycoBcast(stiffness, n, MPIU_REAL, HycoComm(f));
  for (PetscInt i = 0; i < rows; i++) {
    PetscReal old[6];

    for (PetscInt a = 0; a < n; a++) old[a] = motions->motion[(size_t)(first + a) * (size_t)rows + (size_t)i];
    for (PetscInt a = 0; a < n; a++) {
      PetscReal *now = motions->motion + (size_t)(first + a) * (size_t)rows + i;

      *now = 0;
      for (PetscInt b = 0; b < n; b++) *now += E[a * n + b] * old[b];
    }
  }
  /* Round-off of the stiffest one: a motion that the springs do not resist either. */
  for (PetscInt a = 0; a < n; a++) {
    if (!(stiffness[a] > 1e-13 * stiffness[n - 1])) stiffness[a] = 0;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Keeps the soft ones, if springs hold some of them. */
static PetscErrorCode SoftMotionsKeep(HycoFOM f, HycoMotions *motions, PetscReal stiffness[])
{
  HycoSoft *s = &f->soft;
  PetscReal most = 0;
  Vec *v, diagonal, work;

  PetscFunctionBegin;
  PetscCall(HycoFOMMotionVectors(f, motions, &v));
  PetscCall(PetscMalloc1(motions->n, &s->v));
  PetscCall(PetscMalloc1(motions->n, &s->stiffness));
  HycoVecDuplicate(f->U, &diagonal, &work);
  PetscCall(MatGetDiagonal(f->K, diagonal));
  for (PetscInt k = 0; k < motions->n; k++) {
    PetscReal size;

    PetscCall(VecPointwiseMult(work, diagonal, v[k]));
    PetscCall(VecDot(work, v[k], &size));
    if (stiffness[k] > SOFT_STIFFNESS * size) continue;
    most = PetscMax(most, stiffness[k]);
    PetscCall(VecDuplicate(v[k], &s->v[s->n]));
    PetscCall(VecCopy(v[k], s->v[s->n]));
    s->stiffness[s->n++] = stiffness[k];
  }
  HycoDestroyAll(&diagonal, &work);
  PetscCall(VecDestroyVecs(motions->n, &v));
  /* All are those of floating bodies. */
  if (!(most > 0)) PetscCall(HycoFOMForgetSoft(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMForgetSoft(HycoFOM f)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < f->soft.n; k++) PetscCall(VecDestroy(&f->soft.v[k]));
  HycoFreeAll(&f->soft.v, &f->soft.stiffness);
  f->soft.n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At each K: its diagonal is the measure. */
PetscErrorCode HycoFOMFindSoft(HycoFOM f)
{
  HycoMotions motions;
  PetscReal *stiffness;

  PetscFunctionBegin;
  PetscCall(HycoFOMForgetSoft(f));
  if (!f->fe->springs || !HycoSceneHasFriction(f->scene)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoFEUnsupportedMotions(HycoComm(f), f->fe, &motions));
  PetscCall(PetscCalloc1(motions.n + 1, &stiffness));
  for (PetscInt first = 0, n; first < motions.n; first += n) {
    for (n = 1; first + n < motions.n && motions.rigid[first + n].part == motions.rigid[first].part;) n++;
    PetscCall(SoftMotionsDiagonalise(f, &motions, first, n, stiffness + first));
  }
  if (motions.n) PetscCall(SoftMotionsKeep(f, &motions, stiffness));
  PetscCall(PetscFree(stiffness));
  PetscCall(HycoMotionsDestroy(&motions));
  PetscFunctionReturn(PETSC_SUCCESS);
}
