/*
  An exported model as an FMU for co-simulation, FMI 3.0, declared here as its standard has it. Variables: time (0), the
  parameters as inputs (1, ...), the outputs, the KKT residual. model.h, written by scripts/fmu, names the model:
  MODEL(predict) is its function, or with MODEL_PATH MODEL(step): of a history, whose state a step of the FMU advances.
  FMI gives more than that uses: some parameters are unused.
*/
#include "model.h"
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT
#endif

typedef enum { FMI_OK, FMI_WARNING, FMI_DISCARD, FMI_ERROR } Status;
typedef void (*Log)(void *environment, Status status, const char *category, const char *message);

enum { FIRST_OUTPUT = 1 + MODEL(N_PARAMETERS), KKT = FIRST_OUTPUT + MODEL(N_OUTPUTS) };

typedef struct {
  double time, mu[MODEL(N_PARAMETERS)];
  MODEL(result) result;
  bool current; /* the result is that of mu, with this status */
  Status status;
#if defined(MODEL_PATH)
  MODEL(state) begin, end; /* of the last step */
  bool steps;              /* it has left the initialization, in which inputs change the first step */
#endif
  void *work, *environment;
  Log log;
} Instance;

/* The importer's log, if it gave one; the status is passed on. */
static Status report(Instance *o, Status status, const char message[])
{
  if (o->log) o->log(o->environment, status, "results", message);
  return status;
}

/* At the first output that is read after a change of an input: importers set and get variables one by one. */
static Status evaluate(Instance *o)
{
  int status;

  if (o->current) return o->status;
#if defined(MODEL_PATH)
  o->end = o->begin;
  status = MODEL(step)(o->mu, o->time, &o->end, &o->result, o->work);
#else
  status = MODEL(predict)(o->mu, &o->result, o->work);
#endif
  o->current = true;
  o->status = FMI_OK;
  if (status == MODEL(OUTSIDE))
    o->status = report(o, FMI_WARNING, "an input is outside the range in which the model was trained");
  else if (status != MODEL(OK))
    o->status = report(o, FMI_DISCARD, "the contact problem was not solved");
  return o->status;
}

/* The middle of the ranges, where the model is valid, until inputs are set. */
static void begin(Instance *o)
{
  o->time = 0;
  o->current = false;
#if defined(MODEL_PATH)
  MODEL(start)(&o->begin);
  o->steps = false;
#endif
  for (int p = 0; p < MODEL(N_PARAMETERS); p++) o->mu[p] = (MODEL(lo)[p] + MODEL(hi)[p]) / 2;
}

EXPORT const char *fmi3GetVersion(void);
const char *fmi3GetVersion(void)
{
  return "3.0";
}

#define FUNCTION(name, ...)                                                                                            \
  EXPORT Status fmi3##name(__VA_ARGS__);                                                                               \
  Status fmi3##name(__VA_ARGS__)

EXPORT void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible,
                                         bool logging, bool events, bool early, const uint32_t required[], size_t n,
                                         void *environment, Log log, void *update);
void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible,
                                  bool logging, bool events, bool early, const uint32_t required[], size_t n,
                                  void *environment, Log log, void *update)
{
  Instance *o = NULL;

  if (token && !strcmp(token, MODEL_TOKEN)) o = calloc(1, sizeof(*o));
  if (!o) return NULL;
  o->work = malloc(MODEL(work_size)());
  o->environment = environment;
  o->log = log;
  begin(o);
  if (o->work) return o;
  free(o);
  return NULL;
}

EXPORT void fmi3FreeInstance(void *instance);
void fmi3FreeInstance(void *instance)
{
  if (instance) free(((Instance *)instance)->work);
  free(instance);
}

FUNCTION(GetFloat64, void *instance, const uint32_t at[], size_t n, double value[], size_t n_values)
{
  Instance *o = instance;
  Status status = FMI_OK;

  if (n != n_values) return report(o, FMI_ERROR, "a value for each variable is expected");
  for (size_t i = 0; i < n; i++) {
    if (at[i] > KKT) return report(o, FMI_ERROR, "there is no such variable");
    if (at[i] >= FIRST_OUTPUT) status = evaluate(o);
    value[i] = at[i] == 0             ? o->time
               : at[i] < FIRST_OUTPUT ? o->mu[at[i] - 1]
               : at[i] == KKT         ? o->result.kkt
                                      : o->result.output[at[i] - FIRST_OUTPUT];
  }
  return status;
}

FUNCTION(SetFloat64, void *instance, const uint32_t at[], size_t n, const double value[], size_t n_values)
{
  Instance *o = instance;

  if (n != n_values) return report(o, FMI_ERROR, "a value for each variable is expected");
  /* All or none is set. */
  for (size_t i = 0; i < n; i++) {
    if (at[i] < 1 || at[i] >= FIRST_OUTPUT) return report(o, FMI_ERROR, "the variable is no input");
  }
  for (size_t i = 0; i < n; i++) o->mu[at[i] - 1] = value[i];
#if defined(MODEL_PATH)
  o->current = o->current && o->steps; /* inputs belong to the next step */
#else
  o->current = false;
#endif
  return FMI_OK;
}

/* Changes of mode, which mean nothing here. */
#define MODE(name)                                                                                                     \
  FUNCTION(name, void *instance)                                                                                       \
  {                                                                                                                    \
    return FMI_OK;                                                                                                     \
  }

#if defined(MODEL_PATH)
/* The first time, once inputs are set. */
FUNCTION(ExitInitializationMode, void *instance)
{
  Instance *o = instance;

  o->steps = true;
  return evaluate(o);
}

/* A step without a solution leaves all as it was. */
FUNCTION(DoStep, void *instance, double time, double step, bool past, bool *event, bool *terminate, bool *early,
         double *last)
{
  Instance *o = instance;
  const Instance before = *o;
  Status status = FMI_ERROR;

  *event = *terminate = *early = false;
  if (step > 0) {
    o->begin = o->end;
    o->time = time + step;
    o->current = false;
    status = evaluate(o);
  } else {
    (void)report(o, status, "a step must be longer than 0");
  }
  if (status > FMI_WARNING) *o = before;
  *last = o->time;
  return status;
}
#else
MODE(ExitInitializationMode)

/* Outputs depend on the inputs alone, so that a step only moves the time. */
FUNCTION(DoStep, void *instance, double time, double step, bool past, bool *event, bool *terminate, bool *early,
         double *last)
{
  Instance *o = instance;

  o->time = *last = time + step;
  *event = *terminate = *early = false;
  return evaluate(o);
}
#endif

FUNCTION(EnterInitializationMode, void *instance, bool has_tolerance, double tolerance, double start, bool has_stop,
         double stop)
{
  ((Instance *)instance)->time = start;
  return FMI_OK;
}

FUNCTION(Reset, void *instance)
{
  begin(instance);
  return FMI_OK;
}

MODE(EnterEventMode)
MODE(EnterStepMode)
MODE(EnterConfigurationMode)
MODE(ExitConfigurationMode)
MODE(EvaluateDiscreteStates)
MODE(Terminate)

FUNCTION(SetDebugLogging, void *instance, bool on, size_t n, const char *const categories[])
{
  return FMI_OK;
}

FUNCTION(UpdateDiscreteStates, void *instance, bool *again, bool *terminate, bool *nominals, bool *states,
         bool *has_next, double *next)
{
  *again = *terminate = *nominals = *states = *has_next = false;
  return FMI_OK;
}

/* Types without variables, and what modelDescription.xml does not promise. */
#define NONE(name, ...)                                                                                                \
  FUNCTION(name, void *instance, __VA_ARGS__)                                                                          \
  {                                                                                                                    \
    return report(instance, FMI_ERROR, "fmi3" #name "() has no meaning for this model");                               \
  }
#define TYPE(name, type)                                                                                               \
  NONE(Get##name, const uint32_t at[], size_t n, type value[], size_t m)                                               \
  NONE(Set##name, const uint32_t at[], size_t n, const type value[], size_t m)
#define DERIVATIVE(name)                                                                                               \
  NONE(name, const uint32_t unknown[], size_t n, const uint32_t known[], size_t m, const double seed[], size_t k,      \
       double value[], size_t l)
TYPE(Float32, float)
TYPE(Int8, int8_t)
TYPE(UInt8, uint8_t)
TYPE(Int16, int16_t)
TYPE(UInt16, uint16_t)
TYPE(Int32, int32_t)
TYPE(UInt32, uint32_t)
TYPE(Int64, int64_t)
TYPE(UInt64, uint64_t)
TYPE(Boolean, bool)
NONE(GetString, const uint32_t at[], size_t n, const char *value[], size_t m)
NONE(SetString, const uint32_t at[], size_t n, const char *const value[], size_t m)
NONE(GetBinary, const uint32_t at[], size_t n, size_t size[], const uint8_t *value[], size_t m)
NONE(SetBinary, const uint32_t at[], size_t n, const size_t size[], const uint8_t *const value[], size_t m)
NONE(GetClock, const uint32_t at[], size_t n, bool value[])
NONE(SetClock, const uint32_t at[], size_t n, const bool value[])
NONE(GetIntervalDecimal, const uint32_t at[], size_t n, double interval[], int qualifier[])
NONE(SetIntervalDecimal, const uint32_t at[], size_t n, const double interval[])
NONE(GetIntervalFraction, const uint32_t at[], size_t n, uint64_t count[], uint64_t resolution[], int qualifier[])
NONE(SetIntervalFraction, const uint32_t at[], size_t n, const uint64_t count[], const uint64_t resolution[])
NONE(GetShiftDecimal, const uint32_t at[], size_t n, double shift[])
NONE(SetShiftDecimal, const uint32_t at[], size_t n, const double shift[])
NONE(GetShiftFraction, const uint32_t at[], size_t n, uint64_t count[], uint64_t resolution[])
NONE(SetShiftFraction, const uint32_t at[], size_t n, const uint64_t count[], const uint64_t resolution[])
NONE(GetNumberOfVariableDependencies, uint32_t at, size_t *n)
NONE(GetVariableDependencies, uint32_t at, size_t element[], uint32_t of[], size_t of_element[], int kind[], size_t n)
NONE(GetOutputDerivatives, const uint32_t at[], size_t n, const int32_t order[], double value[], size_t m)
DERIVATIVE(GetDirectionalDerivative)
DERIVATIVE(GetAdjointDerivative)
NONE(GetFMUState, void **state)
NONE(SetFMUState, void *state)
NONE(FreeFMUState, void **state)
NONE(SerializedFMUStateSize, void *state, size_t *size)
NONE(SerializeFMUState, void *state, uint8_t bytes[], size_t size)
NONE(DeserializeFMUState, const uint8_t bytes[], size_t size, void **state)
