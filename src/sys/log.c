/* Stages and events of -log_view, registered at the first use. */
#include <hycoimpl.h>

static const char *const event_names[HYCO_N_EVENTS] = {
    "HycoMesh",   "HycoAssemble", "HycoForce", "HycoContact", "HycoSearch",   "HycoReduce", "HycoFactor",
    "HycoForces", "HycoIterate",  "HycoKKT",   "HycoPOD",     "HycoDEIM",     "HycoRID",    "HycoROM",
    "HycoScan",   "HycoLoad",     "HycoSetUp", "HycoSolve",   "HycoReconstr", "HycoBodies"};
static const char *const event_words[HYCO_N_EVENTS] = {"the mesh",
                                                       "assembling the stiffness",
                                                       "assembling the loads",
                                                       "the contacts",
                                                       "the search for masters",
                                                       "the reduced system",
                                                       "factorisation",
                                                       "contact forces",
                                                       "iterations",
                                                       "residuals",
                                                       "modes (POD)",
                                                       "DEIM points",
                                                       "the reduced domain (RID)",
                                                       "the reduced model",
                                                       "scan for a singular stiffness",
                                                       "loading",
                                                       "set-up of a prediction",
                                                       "solving",
                                                       "reconstruction of forces",
                                                       "samples of bodies"};
static const char *const stage_names[HYCO_N_STAGES] = {"hyco full order", "hyco reduction", "hyco online"};
static PetscLogEvent events[HYCO_N_EVENTS];
static PetscLogStage stages[HYCO_N_STAGES];
static PetscBool registered = PETSC_FALSE;
/* The running events, innermost last; another thread may read them. */
#define DEEPEST 16
static volatile int depth, running[DEEPEST];
static const char *volatile stage_runs;

/* Read by the thread of the progress, without a lock: it may show a word that is just over, never a wrong pointer.
   */
const char *HycoLogDoing(void)
{
  const int n = depth;

  return n > 0 && n <= DEEPEST ? event_words[running[n - 1]] : stage_runs;
}

/* Deeper events are counted but not noted, so that begin and end stay paired. */
static void LogRegistered(HycoEvent event, PetscBool begin)
{
  if (begin && depth < DEEPEST) running[depth] = (int)event;
  depth += begin ? 1 : -1;
}

/* If a name cannot be registered, its time counts for the enclosing event. At the first event, when PETSc has been
   initialised. */
static PetscErrorCode LogRegister(void)
{
  PetscClassId id;

  PetscFunctionBegin;
  registered = PETSC_TRUE;
  PetscCall(PetscClassIdRegister("hyco", &id));
  for (int k = 0; k < HYCO_N_EVENTS; k++) PetscCall(PetscLogEventRegister(event_names[k], id, &events[k]));
  for (int k = 0; k < HYCO_N_STAGES; k++) PetscCall(PetscLogStageRegister(stage_names[k], &stages[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Without PETSc's objects: an event of hyco spans several. */
PetscErrorCode HycoLogEvent(HycoEvent event, PetscBool begin)
{
  PetscFunctionBegin;
  if (!registered) PetscCall(LogRegister());
  LogRegistered(event, begin);
  if (begin)
    PetscCall(PetscLogEventBegin(events[event], 0, 0, 0, 0));
  else
    PetscCall(PetscLogEventEnd(events[event], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoLogStage(HycoStage stage, PetscBool begin)
{
  PetscFunctionBegin;
  if (!registered) PetscCall(LogRegister());
  stage_runs = begin ? stage_names[stage] + 5 : NULL; /* without "hyco" */
  if (begin)
    PetscCall(PetscLogStagePush(stages[stage]));
  else
    PetscCall(PetscLogStagePop());
  PetscFunctionReturn(PETSC_SUCCESS);
}
