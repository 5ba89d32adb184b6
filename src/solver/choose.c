/* Chooses a direct or an iterative solver, by the estimated memory of a factor of K. */
#include <hycosolverimpl.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

const char *const HycoLinearNames[] = {"auto", "direct", "iterative", NULL};

/* Rows of at most a plane mesh's length: the factor's size is close to that of the matrix, and is not estimated. */
#define HYCO_PLANE_ROW 20

/* Free memory of this machine in bytes. */
static PetscReal FormChoiceAvailable(void)
{
  FILE *file = fopen("/proc/meminfo", "r");
  char line[128];
  double kb = 0;

  /* MemAvailable counts what the kernel can reclaim, which MemFree does not. Without it, half of the physical
     memory. */
  while (file && kb == 0 && fgets(line, sizeof(line), file)) {
    if (sscanf(line, "MemAvailable: %lf kB", &kb) != 1) kb = 0;
  }
  if (file) fclose(file);
  return kb > 0 ? 1024 * kb : (PetscReal)sysconf(_SC_PHYS_PAGES) * (PetscReal)sysconf(_SC_PAGESIZE) / 2;
}

/* Four fifths of the free memory of all machines of the ranks, the same on every rank. The memory set by the user,
   or one share for each machine, read by its first rank. */
PetscErrorCode HycoSolverMemory(HycoSolver s, PetscReal *bytes)
{
  MPI_Comm node;
  PetscReal mine;

  PetscFunctionBegin;
  *bytes = s->memory;
  if (*bytes > 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Comm_split_type(HycoComm(s), MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &node));
  /* One rank per machine reads it: the sum over all ranks would count a machine's memory as often as it has ranks. */
  mine = HycoRank(node) == 0 ? 0.8 * FormChoiceAvailable() : 0;
  PetscCallMPI(MPI_Allreduce(&mine, bytes, 1, MPIU_REAL, MPI_SUM, HycoComm(s)));
  PetscCallMPI(MPI_Comm_free(&node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Memory of the form's factor: its own estimate, or that of a factor of K. Analysis without numbers; a form may keep
   it for its factorisation. */
static PetscErrorCode FormChoiceEstimate(HycoSolver s, HycoSolverForm form, PetscReal *bytes)
{
  HycoDirect probe = NULL;
  PetscReal begin = HycoNow();

  PetscFunctionBegin;
  if (form->ops->estimate)
    PetscCall(form->ops->estimate(s, form, bytes));
  else {
    PetscCall(HycoDirectCreate(HycoComm(s), &probe));
    /* A floating body's K is singular: it is factored with its motions pinned. */
    PetscCall(HycoDirectPinKernel(probe, s->system->K));
    PetscCall(HycoDirectAnalyse(probe, s->system->K, NULL, NULL, s->system->symmetric, bytes));
    PetscCall(HycoDirectDestroy(&probe));
  }
  s->stiffness.bytes = *bytes;
  s->seconds_factor += HycoNow() - begin;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Iterations need a form that supports them: of the built-in ones, linear without contact, else primal. */
static PetscErrorCode TakeIterative(HycoSolver s, HycoSolverForm *form)
{
  char why[HYCO_LINE], asked[sizeof(s->form_name)];
  HycoSolverForm other;

  PetscFunctionBegin;
  s->iterative = PETSC_TRUE;
  /* Restored below: the choice is of this K, and the next one is again made with the user's form. */
  PetscCall(PetscStrncpy(asked, s->form_name, sizeof(asked)));
  /* An automatic choice may leave the user's form; a stated choice may not. */
  if (s->linear == HYCO_LINEAR_AUTO) s->form_name[0] = '\0';
  PetscCall(HycoSolverAcceptingForm(s, NULL, &other, why));
  PetscCall(PetscStrncpy(s->form_name, asked, sizeof(s->form_name)));
  s->iterative = (PetscBool)(other != NULL);
  if (other) *form = other;
  PetscCheck(other || s->linear != HYCO_LINEAR_ITERATIVE || !asked[0] || strcmp(asked, "primal") == 0 ||
                 strcmp(asked, "projected") == 0,
             HycoComm(s), PETSC_ERR_USER,
             "-hyco_linear iterative works with the forms primal and projected only; remove -hyco_solver_form, or set "
             "one of these");
  PetscCheck(other || s->linear != HYCO_LINEAR_ITERATIVE, HycoComm(s), PETSC_ERR_USER,
             "-hyco_linear iterative needs a symmetric system, the types active_set or tao, and for each contact an "
             "unknown of its own; use -hyco_linear direct");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether an automatic choice is iterative. The free memory changes as it is used, so that the choice is made once
   for each K. */
static PetscErrorCode DecideByMemory(HycoSolver s, HycoSolverForm *form)
{
  PetscReal bytes, limit;
  MatInfo info;

  PetscFunctionBegin;
  /* A plane mesh's factor is small, and its estimate would cost an analysis. */
  PetscCall(MatGetInfo(s->system->K, MAT_GLOBAL_SUM, &info));
  if (info.nz_used <= HYCO_PLANE_ROW * (PetscReal)s->system->n || !s->system->symmetric)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(FormChoiceEstimate(s, *form, &bytes));
  PetscCall(HycoSolverMemory(s, &limit));
  if (bytes > limit) PetscCall(TakeIterative(s, form));
  if (s->iterative)
    PetscCall(PetscSNPrintf(s->why_iterative, sizeof(s->why_iterative),
                            " (a factor would need %.3g GB, and %.3g GB are available)", (double)(1e-9 * bytes),
                            (double)(1e-9 * limit)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Direct or iterative for this K, and the form that goes with it. With automatic choice once per K. Collective. */
PetscErrorCode HycoChooseLinear(HycoSolver s, HycoSolverForm *form)
{
  PetscBool aij, same;
  PetscObjectId id;

  PetscFunctionBegin;
  s->linear_method[0] = '\0';
  if (!s->system->K) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscObjectTypeCompareAny((PetscObject)s->system->K, &aij, MATSEQAIJ, MATMPIAIJ, ""));
  PetscCall(PetscObjectGetId((PetscObject)s->system->K, &id));
  same = (PetscBool)(s->chosen_for == id && s->linear == HYCO_LINEAR_AUTO);
  /* By the identity of the object and not by its state: a K with other values has the same pattern and memory. */
  s->chosen_for = id;
  /* The form was found as for a direct solver, and is replaced again. */
  if (same && s->iterative) PetscCall(TakeIterative(s, form));
  if (same) PetscFunctionReturn(PETSC_SUCCESS);
  s->iterative = PETSC_FALSE;
  s->why_iterative[0] = '\0';
  /* A dense K has a factor of its own size, and no multigrid. */
  if (!aij) PetscFunctionReturn(PETSC_SUCCESS);
  if (s->linear == HYCO_LINEAR_AUTO) PetscCall(DecideByMemory(s, form));
  if (s->linear == HYCO_LINEAR_ITERATIVE) PetscCall(TakeIterative(s, form));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sums of conjugate-gradient iterations, for the report. */
void HycoCountLinear(HycoSolver s, PetscInt its)
{
  s->linear_its += its;
  s->linear_solves++;
  s->linear_most = PetscMax(s->linear_most, its);
}

/* ksp NULL: the own interface to MUMPS. Written into s->linear_method, which reports show. */
PetscErrorCode HycoNameLinear(HycoSolver s, KSP ksp)
{
  KSPType method;
  PCType pc;
  MatSolverType package = NULL;
  PC handle;

  PetscFunctionBegin;
  if (!ksp) {
    PetscCall(PetscSNPrintf(s->linear_method, sizeof(s->linear_method), "direct: mumps, %.3g GB estimated",
                            (double)(1e-9 * s->stiffness.bytes)));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(KSPGetType(ksp, &method));
  PetscCall(KSPGetPC(ksp, &handle));
  PetscCall(PCGetType(handle, &pc));
  if (strcmp(pc, PCSHELL) == 0) PetscCall(PCShellGetName(handle, &pc)); /* the preconditioner inside the shell */
  /* The package is a fact of a factor alone. */
  if (!s->iterative) PetscCall(PCFactorGetMatSolverType(handle, &package));
  if (package)
    PetscCall(PetscSNPrintf(s->linear_method, sizeof(s->linear_method), "direct: %s by %s", pc, package));
  else
    PetscCall(PetscSNPrintf(s->linear_method, sizeof(s->linear_method), "iterative: %s with %s%s", method, pc,
                            s->why_iterative));
  PetscFunctionReturn(PETSC_SUCCESS);
}
