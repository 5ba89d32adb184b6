/* Common to every file of the library: PETSc versions, errors on every rank, HDF5 files. */
#ifndef HYCOIMPL_H
#define HYCOIMPL_H

#include <hycocompat.h>
#include <hycosys.h>
#include <petsc/private/petscimpl.h>
#include <petscmat.h>
#include <stdio.h>
#include <strings.h>

/* Length of a message or a name that the library builds. */
#define HYCO_LINE 1024

/* Error code: these solutions give no useful model with these settings. A search then tries other settings, and an
   estimate is left out; any other error (disk, memory, a damaged file) ends a run. */
#define HYCO_ERR_NO_MODEL ((PetscErrorCode)(PETSC_ERR_MAX_VALUE + 1))

/* Fails on every rank with the message of the lowest rank whose `message` is not empty, and with the error `caught`
   there if that is HYCO_ERR_NO_MODEL, else PETSC_ERR_USER. Collective. */
PetscErrorCode HycoErrorSync(MPI_Comm comm, PetscErrorCode caught, const char message[]);

/* Begin and end catching PETSc errors on this rank as text: between the two, errors print nothing. */
PetscErrorCode HycoCatchBegin(void);
PetscErrorCode HycoCatchEnd(PetscErrorCode caught, char message[HYCO_LINE]);
/* Raises the caught error again, unless it is HYCO_ERR_NO_MODEL. */
PetscErrorCode HycoCatchNoModel(PetscErrorCode caught, const char message[]);

/* Runs `call` on rank 0 of comm; its error is raised on every rank. Collective. */
#define HycoOnRoot(comm, call)                                                                                         \
  do {                                                                                                                 \
    char message_[HYCO_LINE] = "";                                                                                     \
    PetscMPIInt rank_;                                                                                                 \
    PetscErrorCode caught_ = 0;                                                                                        \
    PetscCallMPI(MPI_Comm_rank((comm), &rank_));                                                                       \
    if (rank_ == 0) {                                                                                                  \
      PetscCall(HycoCatchBegin());                                                                                     \
      caught_ = (call);                                                                                                \
      PetscCall(HycoCatchEnd(caught_, message_));                                                                      \
    }                                                                                                                  \
    PetscCall(HycoErrorSync((comm), caught_, message_));                                                               \
  } while (0)

/* Runs `call`, which may differ from rank to rank, on every rank; an error on any rank is raised on all. Collective. */
#define HycoOnEach(comm, call)                                                                                         \
  do {                                                                                                                 \
    char message_[HYCO_LINE] = "";                                                                                     \
    PetscErrorCode caught_;                                                                                            \
    PetscCall(HycoCatchBegin());                                                                                       \
    caught_ = (call);                                                                                                  \
    PetscCall(HycoCatchEnd(caught_, message_));                                                                        \
    PetscCall(HycoErrorSync((comm), caught_, message_));                                                               \
  } while (0)

/* Replaces bytes that are no printable characters in UTF-8: blanks by a blank, others by ?. */
void HycoMakePrintable(char text[]);
/* Formats a line like printf; truncated to HYCO_LINE. */
void HycoFormat(char line[HYCO_LINE], const char format[], ...) PETSC_ATTRIBUTE_FORMAT(2, 3);

/* Appends `name` to a list of names, with `between` before all but the first; truncated to HYCO_LINE. */
PetscErrorCode HycoListAdd(char list[HYCO_LINE], const char between[], const char name[]);

/* Raises a user's error on this rank: one line, with numbers as C's printf writes them (PETSc would write 2 as
   "2."). */
#define HycoFail(...)                                                                                                  \
  do {                                                                                                                 \
    char line_[HYCO_LINE];                                                                                             \
    HycoFormat(line_, __VA_ARGS__);                                                                                    \
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER, "%s", line_);                                                             \
  } while (0)
/* The same with HYCO_ERR_NO_MODEL. */
#define HycoFailNoModel(...)                                                                                           \
  do {                                                                                                                 \
    char line_[HYCO_LINE];                                                                                             \
    HycoFormat(line_, __VA_ARGS__);                                                                                    \
    SETERRQ(PETSC_COMM_SELF, HYCO_ERR_NO_MODEL, "%s", line_);                                                          \
  } while (0)
#define HycoCheckModel(condition, ...)                                                                                 \
  do {                                                                                                                 \
    if (PetscUnlikely(!(condition))) HycoFailNoModel(__VA_ARGS__);                                                     \
  } while (0)
#define HycoCheck(condition, ...)                                                                                      \
  do {                                                                                                                 \
    if (PetscUnlikely(!(condition))) HycoFail(__VA_ARGS__);                                                            \
  } while (0)

/* Fails for NULL and for an object of another class. Not collective. `classid` is one of HYCO_..._CLASSID. */
PetscErrorCode HycoHandleCheck(const void *handle, const PetscClassId *classid, const char function[]);
#define HycoCheckHandle(handle, classid) PetscCall(HycoHandleCheck((handle), &(classid), PETSC_FUNCTION_NAME))
/* Begins a View: checks the object; `viewer` becomes stdout if it is NULL; on an ASCII viewer prints the object's class
   and name, and pushes a tab, which the caller pops; with another viewer returns from the calling function. */
#define HycoViewBegin(object, classid, viewer)                                                                         \
  do {                                                                                                                 \
    PetscBool ascii_;                                                                                                  \
    HycoCheckHandle(object, classid);                                                                                  \
    PetscCall(HycoViewBegin_Private((PetscObject)(object), &(viewer), &ascii_));                                       \
    if (!ascii_) PetscFunctionReturn(PETSC_SUCCESS);                                                                   \
  } while (0)
PetscErrorCode HycoViewBegin_Private(PetscObject object, PetscViewer *viewer, PetscBool *ascii);
/* Defines XViewFromOptions() of a class. */
#define HycoDefineViewFromOptions(Class, classid)                                                                      \
  PetscErrorCode Class##ViewFromOptions(Class object, PetscObject owner, const char option[])                          \
  {                                                                                                                    \
    PetscFunctionBegin;                                                                                                \
    HycoCheckHandle(object, classid);                                                                                  \
    PetscCall(PetscObjectViewFromOptions((PetscObject)object, owner, option));                                         \
    PetscFunctionReturn(PETSC_SUCCESS);                                                                                \
  }
/* Defines a method of a class that executes statements once the handle is checked, for setters and getters. */
#define HycoDefineMethod(function, arguments, object, classid, ...)                                                    \
  PetscErrorCode function arguments                                                                                    \
  {                                                                                                                    \
    PetscFunctionBegin;                                                                                                \
    HycoCheckHandle(object, classid);                                                                                  \
    __VA_ARGS__;                                                                                                       \
    PetscFunctionReturn(PETSC_SUCCESS);                                                                                \
  }
/* The communicator of an object of any class. */
#define HycoComm(object) PetscObjectComm((PetscObject)(object))
/* Begins a Destroy: returns from the calling function for NULL; checks the object, removes one reference and, unless that
   was the last, sets `*object` to NULL and returns. */
#define HycoDestroyBegin(object, classid)                                                                              \
  do {                                                                                                                 \
    if (!(object) || !*(object)) PetscFunctionReturn(PETSC_SUCCESS);                                                   \
    HycoCheckHandle(*(object), classid);                                                                               \
    if (--((PetscObject) * (object))->refct > 0) {                                                                     \
      *(object) = NULL;                                                                                                \
      PetscFunctionReturn(PETSC_SUCCESS);                                                                              \
    }                                                                                                                  \
  } while (0)

/* Concatenates every rank's n items, of an MPI type of `size` bytes, by rank, in *all on rank 0 (elsewhere NULL,
 *n_all 0); the caller frees it by PetscFree(). Collective. */
PetscErrorCode HycoConcatenate(MPI_Comm comm, PetscInt n, const void *mine, MPI_Datatype type, size_t size,
                               PetscInt *n_all, void *all);
/* Sends n rows of `size` bytes, row k to rank to[k]; *got: the *n_got rows that arrive, by the rank that sent them and
   then in its order. The caller frees it by PetscFree(). Collective. */
PetscErrorCode HycoSendRows(MPI_Comm comm, PetscInt n, const PetscMPIInt to[], size_t size, const void *row,
                            PetscInt *n_got, void *got);

/* MPI_Bcast() from rank 0 and MPI_Allreduce() in place, with a PetscInt count: a count too large for MPI is an
   error. */
#define HycoBcast(data, n, type, comm)                                                                                 \
  do {                                                                                                                 \
    PetscMPIInt count_;                                                                                                \
    PetscCall(PetscMPIIntCast((n), &count_));                                                                          \
    PetscCallMPI(MPI_Bcast((data), count_, (type), 0, (comm)));                                                        \
  } while (0)
#define HycoAllreduce(data, n, type, op, comm)                                                                         \
  do {                                                                                                                 \
    PetscMPIInt count_;                                                                                                \
    PetscCall(PetscMPIIntCast((n), &count_));                                                                          \
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, (data), count_, (type), (op), (comm)));                                   \
  } while (0)

/* 64-bit FNV-1a hash, continued from `hash` (start with HYCO_HASH_START). */
#define HYCO_HASH_START 14695981039346656037ULL
unsigned long long HycoHash(unsigned long long hash, const void *data, size_t bytes);

/* Events and stages of -log_view, in the order of the names in log.c. */
typedef enum {
  HYCO_EVENT_MESH,
  HYCO_EVENT_ASSEMBLE, /* K */
  HYCO_EVENT_FORCE,    /* F */
  HYCO_EVENT_CONTACT,  /* B, D */
  HYCO_EVENT_SEARCH,   /* this process's queries for masters */
  HYCO_EVENT_REDUCE,   /* the reduced system from K, F, B, D of the RID */
  HYCO_EVENT_FACTOR,   /* with the computation of the flexibility */
  HYCO_EVENT_FORCES,   /* the complementarity problem: active set, Lemke, TAO */
  HYCO_EVENT_ITERATE,  /* conjugate gradients under constraints */
  HYCO_EVENT_KKT,
  HYCO_EVENT_POD,
  HYCO_EVENT_DEIM,
  HYCO_EVENT_RID,
  HYCO_EVENT_MODEL, /* choice of the full-order unknowns, writing */
  HYCO_EVENT_SCAN,
  HYCO_EVENT_LOAD,
  HYCO_EVENT_SETUP, /* online */
  HYCO_EVENT_SOLVE, /* the solve of any contact system */
  HYCO_EVENT_RECONSTRUCT,
  HYCO_N_EVENTS
} HycoEvent;
typedef enum { HYCO_STAGE_FULL_ORDER, HYCO_STAGE_REDUCTION, HYCO_STAGE_ONLINE, HYCO_N_STAGES } HycoStage;
PetscErrorCode HycoLogEvent(HycoEvent event, PetscBool begin);
PetscErrorCode HycoLogStage(HycoStage stage, PetscBool begin);
/* Whether the environment variable HYCO_TRACE requests PETSc's trace of an error. */
PetscBool HycoWantsTrace(void);
/* The name of what runs now: the innermost event, else the stage, else NULL. May be called from any thread. */
const char *HycoLogDoing(void);
/* PetscCall(call) within the event, or the stage; both also end on an error. */
#define HycoLogged(event, call)                                                                                        \
  do {                                                                                                                 \
    PetscErrorCode logged_;                                                                                            \
    PetscCall(HycoLogEvent((event), PETSC_TRUE));                                                                      \
    logged_ = (call);                                                                                                  \
    PetscCall(HycoLogEvent((event), PETSC_FALSE));                                                                     \
    PetscCall(logged_);                                                                                                \
  } while (0)
#define HycoStaged(stage, call)                                                                                        \
  do {                                                                                                                 \
    PetscErrorCode logged_;                                                                                            \
    PetscCall(HycoLogStage((stage), PETSC_TRUE));                                                                      \
    logged_ = (call);                                                                                                  \
    PetscCall(HycoLogStage((stage), PETSC_FALSE));                                                                     \
    PetscCall(logged_);                                                                                                \
  } while (0)

/* The seal of a file with these bytes, to be appended to them. */
#define HYCO_SEAL 24
void HycoSealMake(const void *data, size_t bytes, unsigned char seal[HYCO_SEAL]);
/* Computes the seal of a file, and its size. */
PetscErrorCode HycoSealFile(const char path[], size_t *size, unsigned char seal[HYCO_SEAL]);
/* Size of a file, and whether it has a seal; fails if it has one that does not match its bytes. */
PetscErrorCode HycoSealCheck(const char path[], size_t *size, PetscBool *sealed);

/* strtod() with a decimal point, whatever the locale of the calling program. */
double HycoNumber(const char text[], char **end);
/* Between the two calls, this thread reads and writes numbers with a decimal point. */
void *HycoPointBegin(void);
void HycoPointEnd(void *before);

/* Makes BLAS allocate its memory now, or fails: without memory, OpenBLAS would try again without end. On this
   process alone. */
PetscErrorCode HycoReserveBLAS(void);

/* lost / size; 0/0 counts as 0, x/0 is PETSC_INFINITY. */
static inline PetscReal HycoRelative(PetscReal lost, PetscReal size)
{
  return size > 0 ? lost / size : lost > 0 ? PETSC_INFINITY : 0;
}

/* Seconds since the first call, on this rank's clock. */
PetscReal HycoNow(void);
/* CPU seconds of this process. */
PetscReal HycoCPU(void);

/* Recorded declarations; the strings of an option are one allocation, at its name. */
typedef struct {
  PetscInt n, room;
  HycoOption *option;
} HycoOptionList;
/* Runs `declare` with an empty database; its declarations are added to the list, and no option is read. */
PetscErrorCode HycoOptionsRecord(HycoOptionList *list, PetscErrorCode (*declare)(PetscOptions));
PetscErrorCode HycoOptionListDestroy(HycoOptionList *list);
/* The table of HycoGetOptionTable() is recorded again at its next call. */
PetscErrorCode HycoOptionsForgetTable(void);
/* The option of this name (without dash; the entry mu_ matches mu_radius), or NULL. Borrowed. */
const HycoOption *HycoOptionListFind(const HycoOptionList *list, const char name[]);
/* Creates an object of each class and calls its SetFromOptions with `options` (src/package): the declaration pass of
   the table. */
PetscErrorCode HycoDeclareClasses(PetscOptions options);
void HycoOptionsSetDeclare(PetscErrorCode (*declare)(PetscOptions));
/* Registers the ids of all classes; sets them to 0, after PetscFinalize(); fails before the first. Not collective. */
PetscErrorCode HycoClassesRegister(void);
PetscErrorCode HycoClassesForget(void);
PetscErrorCode HycoPackageCheck(void);
/* Registers hyco's methods as types of Tao, beside TAO's. */
PetscErrorCode HycoTaoRegisterAll(void);
PetscErrorCode HycoSolverDeclare(PetscOptions options);
PetscErrorCode HycoFOMDeclare(PetscOptions options);
PetscErrorCode HycoSnapshotsDeclare(PetscOptions options);
PetscErrorCode HycoReducerDeclare(PetscOptions options);
PetscErrorCode HycoROMDeclare(PetscOptions options);
/* Calls SetFromOptions of `object` with `options`, then destroys it. */
#define HycoDeclare(object, options, set, destroy)                                                                     \
  do {                                                                                                                 \
    PetscErrorCode declared_;                                                                                          \
    PetscCall(PetscObjectSetOptions((PetscObject)(object), (options)));                                                \
    declared_ = set(object);                                                                                           \
    PetscCall(destroy(&(object)));                                                                                     \
    PetscCall(declared_);                                                                                              \
  } while (0)

/* What a class declares for an option (name without the dash), or NULL. Borrowed. */
const HycoOption *HycoOptionFind(const char name[]);
/* The known name nearest to `word`, of those that the classes declare and (if not NULL) those in `more`; NULL: none
   is near. Borrowed. */
const char *HycoOptionNearest(const char word[], const HycoOptionList *more);
/* Fails for the former name of an option, with its present name. */
PetscErrorCode HycoOptionsCheckName(const char name[]);
/* Whether an option's name (without dash) begins like an entry of a scene. */
PetscBool HycoIsSceneKey(const char name[]);

/* PetscFree() of each pointer, given by its address. */
#define HycoFreeAll(...) PetscCall(HycoFreeAll_Private((void *[]){__VA_ARGS__, NULL}))
PetscErrorCode HycoFreeAll_Private(void *const addresses[]);

/* A copy of `n` items of type `type`: *to = copy of from. */
#define HycoDuplicate(n, from, to)                                                                                     \
  do {                                                                                                                 \
    PetscCall(PetscMalloc1((n), (to)));                                                                                \
    PetscCall(PetscArraycpy(*(to), (from), (n)));                                                                      \
  } while (0)

#endif
