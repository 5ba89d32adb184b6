/* Memory and time of a solve, and the number of solves of a training. */
#include "inspect.h"
#include <hycolinear.h>
#include <sys/resource.h>
#include <time.h>

/* Assumed number of solutions if no training points are given. */
#define TYPICAL_TRAINING 100
/* Speed of a sparse factorisation relative to a matrix product: announced against measured times
   (tests/command/check.py). */
#define SPARSE_SHARE 0.5

/* Memory of the process now, summed over all ranks. ru_maxrss is in kilobytes on Linux, and is the largest so far. */
static PetscErrorCode CostResident(MPI_Comm comm, PetscReal *bytes)
{
  struct rusage usage;
  PetscReal mine;

  PetscFunctionBegin;
  getrusage(RUSAGE_SELF, &usage);
  mine = 1024 * (PetscReal)usage.ru_maxrss;
  PetscCallMPI(MPI_Allreduce(&mine, bytes, 1, MPIU_REAL, MPI_SUM, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Floating-point operations per second on this process. of[0]: a small matrix product; a peak of which a sparse
   factorisation reaches the share SPARSE_SHARE. of[1]: a matrix times a vector, which memory bounds, and hardly the
   kernels of BLAS. */
static PetscErrorCode CostSpeed(PetscReal of[2])
{
  const PetscBLASInt n = 256, m = 700, step = 1;
  const PetscScalar one = 1, zero = 0;
  PetscScalar *a;
  clock_t begin;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m * (m + 2), &a));
  for (PetscInt k = 0; k < m * (m + 2); k++) a[k] = 1;
  /* The first product also loads the kernels: the maximum leaves it out. */
  of[0] = of[1] = 0;
  for (PetscInt k = 0; k < 10; k++) { /* the fastest, in CPU time, because others may use the machine */
    begin = clock();
    BLASgemm_("N", "N", &n, &n, &n, &one, a, &n, a + n * n, &n, &zero, a + 2 * n * n, &n);
    of[0] = PetscMax(of[0], 2. * n * n * n * CLOCKS_PER_SEC / PetscMax((PetscReal)(clock() - begin), 1));
    begin = clock();
    for (PetscInt j = 0; j < 4; j++)
      BLASgemv_("N", &m, &m, &one, a, &m, a + m * m, &step, &zero, a + m * (m + 1), &step);
    of[1] = PetscMax(of[1], 8. * m * m * CLOCKS_PER_SEC / PetscMax((PetscReal)(clock() - begin), 1));
  }
  PetscCall(PetscFree(a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Only the symbolic analysis is done: MUMPS then knows the size of the factor and the operations, and nothing of
   that size is allocated. */
PetscErrorCode HycoInspectCost(HycoFOM f, PetscReal assembly, HycoInspection *in, PetscReal speed[2])
{
  HycoDirect probe;
  PetscReal begin = HycoNow();

  PetscFunctionBegin;
  PetscCall(CostResident(HycoComm(f), &in->resident));
  PetscCall(HycoDirectCreate(HycoComm(f), &probe));
  PetscCall(HycoDirectPinKernel(probe, f->K));
  PetscCall(HycoDirectAnalyse(probe, f->K, f->n_contacts ? f->Bt : NULL, f->n_contacts ? f->B : NULL, PETSC_TRUE,
                              &in->bytes));
  begin = HycoNow() - begin;
  PetscCall(CostSpeed(speed));
  in->first = assembly + begin + HycoDirectOperations(probe) / (SPARSE_SHARE * speed[0] * f->size);
  in->next = 20 * in->bytes / 8 / (SPARSE_SHARE * speed[0] * f->size); /* a few products with the factor */
  PetscCall(HycoDirectDestroy(&probe));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A solution whose stiffness was factorised before costs no factor: those that differ in loads or gaps alone share one.
   Without samples a typical number of points, for an order of magnitude. */
PetscErrorCode HycoInspectionCountTraining(HycoScene s, HycoSamples samples, PetscInt *n_training,
                                           PetscInt *n_stiffness)
{
  PetscBool reaches[HYCO_MAX_PARAMETERS], any = PETSC_FALSE;
  PetscInt n = TYPICAL_TRAINING, held;
  const PetscReal *mu = NULL;

  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SCENE_CLASSID);
  HycoCheckGiven(n_training);
  HycoCheckGiven(n_stiffness);
  HycoSceneReaches(s, reaches);
  for (PetscInt p = 0; p < s->n_parameters; p++) any = (PetscBool)(any || reaches[p]);
  if (samples) PetscCall(HycoSamplesGet(samples, &n, NULL, &mu));
  held = PetscMin(PetscMax(n, 20), 30);
  *n_training = n + held;
  *n_stiffness = any ? n : 1;
  for (PetscInt k = 1; mu && any && k < n; k++) { /* previous ones */
    PetscBool seen = PETSC_FALSE;

    for (PetscInt j = 0; j < k && !seen; j++) {
      seen = PETSC_TRUE;
      for (PetscInt p = 0; p < s->n_parameters; p++)
        seen = (PetscBool)(seen && (!reaches[p] || mu[j * s->n_parameters + p] == mu[k * s->n_parameters + p]));
    }
    *n_stiffness -= seen;
  }
  if (any) *n_stiffness += held; /* held-out points may share stiffnesses, which is neglected here */
  PetscFunctionReturn(PETSC_SUCCESS);
}
