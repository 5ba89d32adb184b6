/* What is left to hyco: the form by the contacts, direct or iterative by the memory that a factor of K is estimated to
 * take. */
#include <hycosolverimpl.h>
#include <stdio.h>
#include <unistd.h>

const char *const HycoLinearNames[] = {"auto", "direct", "iterative", NULL};

/* Rows no longer than a plane mesh has: the factor stays near the size of the matrix, and need not be estimated. */
#define HYCO_PLANE_ROW 20

/* Bytes that this machine could still give. */
static PetscReal Available(void)
{
  FILE *file = fopen("/proc/meminfo", "r");
  char line[128];
  double kb = 0;

  while (file && kb == 0 && fgets(line, sizeof(line), file)) {
    if (sscanf(line, "MemAvailable: %lf kB", &kb) != 1) kb = 0;
  }
  if (file) fclose(file);
  return kb > 0 ? 1024 * kb : (PetscReal)sysconf(_SC_PHYS_PAGES) * (PetscReal)sysconf(_SC_PAGESIZE) / 2;
}

/* The same for all machines that the ranks are on, four fifths of it. */
static PetscErrorCode Limit(HycoSolver s, PetscReal *bytes)
{
  MPI_Comm node;
  PetscMPIInt rank;
  PetscReal mine;

  PetscFunctionBegin;
  *bytes = s->memory;
  if (*bytes > 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Comm_split_type(HycoComm(s), MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &node));
  PetscCallMPI(MPI_Comm_rank(node, &rank));
  mine = rank == 0 ? 0.8 * Available() : 0;
  PetscCallMPI(MPI_Allreduce(&mine, bytes, 1, MPIU_REAL, MPI_SUM, HycoComm(s)));
  PetscCallMPI(MPI_Comm_free(&node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What a factor of K (with the contacts, in the dual form) would take. */
static PetscErrorCode Estimate(HycoSolver s, HycoForm form, PetscReal *bytes)
{
  HycoSystem y = s->system;
  HycoDirect probe = NULL;
  PetscReal begin = HycoNow();

  PetscFunctionBegin;
  if (form == HYCO_FORM_DUAL) {
    if (!s->direct) PetscCall(HycoDirectCreate(HycoComm(s), &s->direct));
    PetscCall(HycoDirectPinKernel(s->direct, y->K));
    PetscCall(
        HycoDirectAnalyse(s->direct, y->K, y->Bt, y->B, y->symmetric, bytes)); /* the factorisation goes on from it */
  } else {
    PetscCall(HycoDirectCreate(HycoComm(s), &probe));
    PetscCall(HycoDirectPinKernel(probe, y->K));
    PetscCall(HycoDirectAnalyse(probe, y->K, NULL, NULL, y->symmetric, bytes));
    PetscCall(HycoDirectDestroy(&probe));
  }
  s->bytes = *bytes;
  s->seconds_factor += HycoNow() - begin;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TakeIterative(HycoSolver s, HycoForm *form)
{
  PetscBool possible = PETSC_FALSE;

  PetscFunctionBegin;
  if (s->system->symmetric && s->system->m && s->type != HYCO_TYPE_LEMKE)
    PetscCall(HycoPrimalPossible(s->system, &possible));
  if (s->linear == HYCO_LINEAR_ITERATIVE) {
    PetscCheck(s->form == HYCO_FORM_AUTO || s->form == HYCO_FORM_PRIMAL, HycoComm(s), PETSC_ERR_USER,
               "-hyco_linear iterative solves the primal form; take away -hyco_solver_form, or say primal");
    PetscCheck(possible || !s->system->m, HycoComm(s), PETSC_ERR_USER,
               "-hyco_linear iterative needs a symmetric system, the types active_set or tao, and for each contact an "
               "unknown of its own; use -hyco_linear direct");
  }
  s->iterative = (PetscBool)(possible || (s->linear == HYCO_LINEAR_ITERATIVE && !s->system->m));
  if (possible) *form = HYCO_FORM_PRIMAL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether an automatic choice is iterative. Estimates of free memory change as it fills: each K is asked about once. */
static PetscErrorCode DecideByMemory(HycoSolver s, HycoForm *form)
{
  PetscReal bytes, limit;
  MatInfo info;

  PetscFunctionBegin;
  PetscCall(MatGetInfo(s->system->K, MAT_GLOBAL_SUM, &info));
  if (info.nz_used <= HYCO_PLANE_ROW * (PetscReal)s->system->n || !s->system->symmetric)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(Estimate(s, *form, &bytes));
  PetscCall(Limit(s, &limit));
  if (bytes > limit) PetscCall(TakeIterative(s, form));
  if (s->iterative)
    PetscCall(PetscSNPrintf(s->why_iterative, sizeof(s->why_iterative), " (a factor would take %.3g GB of %.3g GB)",
                            (double)(1e-9 * bytes), (double)(1e-9 * limit)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoChooseLinear(HycoSolver s, HycoForm *form)
{
  PetscBool aij, same;
  PetscObjectId id;

  PetscFunctionBegin;
  s->linear_method[0] = '\0';
  PetscCall(PetscObjectTypeCompareAny((PetscObject)s->system->K, &aij, MATSEQAIJ, MATMPIAIJ, ""));
  PetscCall(PetscObjectGetId((PetscObject)s->system->K, &id));
  same = (PetscBool)(s->chosen_for == id && s->linear == HYCO_LINEAR_AUTO);
  s->chosen_for = id;
  if (same) {
    if (s->iterative && s->system->m) *form = HYCO_FORM_PRIMAL;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  s->iterative = PETSC_FALSE;
  s->why_iterative[0] = '\0';
  if (!aij) PetscFunctionReturn(PETSC_SUCCESS);
  if (s->linear == HYCO_LINEAR_AUTO) PetscCall(DecideByMemory(s, form));
  if (s->linear == HYCO_LINEAR_ITERATIVE) PetscCall(TakeIterative(s, form));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Few contacts: the dual, with its dense flexibility. About as many as unknowns: the primal. */
PetscErrorCode HycoChooseForm(HycoSolver s, HycoForm *form)
{
  PetscBool aij, possible = PETSC_FALSE;

  PetscFunctionBegin;
  *form = s->form;
  if (*form != HYCO_FORM_AUTO) PetscFunctionReturn(PETSC_SUCCESS);
  *form = HYCO_FORM_DUAL;
  if (s->type == HYCO_TYPE_LEMKE || (s->type == HYCO_TYPE_TAO && s->tao_type >= HYCO_TAO_SEMISMOOTH))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscObjectTypeCompareAny((PetscObject)s->system->K, &aij, MATSEQAIJ, MATMPIAIJ, ""));
  if (aij && s->system->symmetric && (4 * s->system->m > s->system->n || s->system->m > 6000))
    PetscCall(HycoPrimalPossible(s->system, &possible));
  if (possible) *form = HYCO_FORM_PRIMAL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The TAO type for the system, and whether type, form and system go together. */
PetscErrorCode HycoChooseTao(HycoSolver s, HycoForm form)
{
  PetscFunctionBegin;
  PetscCheck(
      form == HYCO_FORM_DUAL || s->type == HYCO_TYPE_TAO ||
          (form == HYCO_FORM_PRIMAL && s->type == HYCO_TYPE_ACTIVE_SET),
      HycoComm(s), PETSC_ERR_USER,
      "%s needs the matrix of the dual form; use -hyco_solver_form dual, or -hyco_solver_type tao with dual_free",
      HycoSolverTypes[s->type]);
  s->tao = s->tao_type;
  if (s->tao == HYCO_TAO_AUTO) s->tao = s->system->symmetric ? HYCO_TAO_GPCG : HYCO_TAO_SEMISMOOTH;
  if (s->type != HYCO_TYPE_TAO || !s->system->m) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(s->system->symmetric || HycoTaoSemismooth(s->tao), HycoComm(s), PETSC_ERR_USER,
             "TAO's %s needs a symmetric system and this one is not; use -hyco_tao_type ssils, asils, ssfls or asfls",
             HycoTaoTypes[s->tao]);
  PetscCheck(form == HYCO_FORM_DUAL || !HycoTaoSemismooth(s->tao), HycoComm(s), PETSC_ERR_USER,
             "TAO's %s needs the matrix of the dual form; use -hyco_solver_form dual", HycoTaoTypes[s->tao]);
  PetscCheck(form != HYCO_FORM_DUAL_FREE || s->tao != HYCO_TAO_BQPIP, HycoComm(s), PETSC_ERR_USER,
             "TAO's bqpip reads the matrix of the dual form; use -hyco_solver_form dual");
  PetscCheck(form != HYCO_FORM_DUAL_FREE || s->system->symmetric, HycoComm(s), PETSC_ERR_USER,
             "the form dual_free needs a symmetric system; use -hyco_solver_form dual");
  PetscFunctionReturn(PETSC_SUCCESS);
}
