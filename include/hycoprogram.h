/*
  Services that the library shares with programs on it: errors of one line on every rank, communication, stages of
  -log_view, recorded options. hyco.h does not include it.
*/
#ifndef HYCOPROGRAM_H
#define HYCOPROGRAM_H

#include <hycocompat.h>
#include <hycosys.h>
#include <errno.h>

#if defined(__cplusplus)
extern "C" {
#endif

/* Length of a message or a name that the library builds. */
#define HYCO_LINE 1024

/* Error code: these solutions give no useful model with these settings. A search then tries other settings, and an
   estimate is left out; any other error (disk, memory, a damaged file) ends a run. */
#define HYCO_ERR_NO_MODEL ((PetscErrorCode)(PETSC_ERR_MAX_VALUE + 1))
/* Kinds of a user's errors: HycoKeptErrorKind(). */
#define HYCO_ERR_VALUE       ((PetscErrorCode)(PETSC_ERR_MAX_VALUE + 2))
#define HYCO_ERR_NO_FILE     ((PetscErrorCode)(PETSC_ERR_MAX_VALUE + 3))
#define HYCO_ERR_INTERRUPTED ((PetscErrorCode)(PETSC_ERR_MAX_VALUE + 4))

/* -- errors -- */

/* Fails on every rank with the message of the lowest rank whose `message` is not empty, and with the error `caught`
   there if that is one of hyco's own, else PETSC_ERR_USER. Collective. */
PetscErrorCode HycoErrorSync(MPI_Comm comm, PetscErrorCode caught, const char message[]);

/* Begin and end catching PETSc errors on this rank as text: between the two, errors print nothing. */
PetscErrorCode HycoCatchBegin(void);
PetscErrorCode HycoCatchEnd(PetscErrorCode caught, char message[HYCO_LINE]);

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
#define HycoFail(...) HycoFailAs(PETSC_ERR_USER, __VA_ARGS__)
#define HycoFailAs(code, ...)                                                                                          \
  do {                                                                                                                 \
    char line_[HYCO_LINE];                                                                                             \
    const PetscErrorCode code_ = (code);                                                                               \
    HycoFormat(line_, __VA_ARGS__);                                                                                    \
    SETERRQ(PETSC_COMM_SELF, code_, "%s", line_);                                                                      \
  } while (0)
#define HycoCheck(condition, ...)                                                                                      \
  do {                                                                                                                 \
    if (PetscUnlikely(!(condition))) HycoFail(__VA_ARGS__);                                                            \
  } while (0)
/* Of a value that a caller gives; of a file that was not opened, right after the attempt. */
#define HycoCheckValue(condition, ...)                                                                                 \
  do {                                                                                                                 \
    if (PetscUnlikely(!(condition))) HycoFailAs(HYCO_ERR_VALUE, __VA_ARGS__);                                          \
  } while (0)
#define HycoCheckFile(condition, ...)                                                                                  \
  do {                                                                                                                 \
    if (PetscUnlikely(!(condition))) HycoFailAs(errno == ENOENT ? HYCO_ERR_NO_FILE : PETSC_ERR_USER, __VA_ARGS__);     \
  } while (0)

/* -- communication and memory -- */

/* The communicator of an object of any class. */
#define HycoComm(object) PetscObjectComm((PetscObject)(object))
/* This process's rank in a communicator, and the number of its ranks. */
static inline PetscMPIInt HycoRank(MPI_Comm comm)
{
  PetscMPIInt rank = 0;

  (void)MPI_Comm_rank(comm, &rank);
  return rank;
}
static inline PetscMPIInt HycoSize(MPI_Comm comm)
{
  PetscMPIInt size = 1;

  (void)MPI_Comm_size(comm, &size);
  return size;
}
/* Concatenates every rank's n items, of an MPI type of `size` bytes, by rank, in *all on rank 0 (elsewhere NULL,
 *n_all 0); the caller frees it by PetscFree(). Collective. */
PetscErrorCode HycoConcatenate(MPI_Comm comm, PetscInt n, const void *mine, MPI_Datatype type, size_t size,
                               PetscInt *n_all, void *all);

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

/* A copy of `n` items of type `type`: *to = copy of from. */
#define HycoDuplicate(n, from, to)                                                                                     \
  do {                                                                                                                 \
    PetscCall(PetscMalloc1((n), (to)));                                                                                \
    PetscCall(PetscArraycpy(*(to), (from), (n)));                                                                      \
  } while (0)

/* -- the log -- */

/* Stages of -log_view. */
typedef enum { HYCO_STAGE_FULL_ORDER, HYCO_STAGE_REDUCTION, HYCO_STAGE_ONLINE, HYCO_N_STAGES } HycoStage;
PetscErrorCode HycoLogStage(HycoStage stage, PetscBool begin);
/* Whether the environment variable HYCO_TRACE requests PETSc's trace of an error. */
PetscBool HycoWantsTrace(void);
/* The name of what runs now: the innermost event, else the stage, else NULL. May be called from any thread. */
const char *HycoLogDoing(void);
/* PetscCall(call) within the stage, which also ends on an error. */
#define HycoStaged(stage, call)                                                                                        \
  do {                                                                                                                 \
    PetscErrorCode logged_;                                                                                            \
    PetscCall(HycoLogStage((stage), PETSC_TRUE));                                                                      \
    logged_ = (call);                                                                                                  \
    PetscCall(HycoLogStage((stage), PETSC_FALSE));                                                                     \
    PetscCall(logged_);                                                                                                \
  } while (0)

/* Seconds since the first call, on this rank's clock. */
PetscReal HycoNow(void);

/* -- options and their sources -- */

/* Recorded declarations; the strings of an option are one allocation, at its name. */
typedef struct {
  PetscInt n, room;
  HycoOption *option;
} HycoOptionList;
/* Runs `declare` with an empty database; its declarations are added to the list, and no option is read. */
PetscErrorCode HycoOptionsRecord(HycoOptionList *list, PetscErrorCode (*declare)(PetscOptions));
PetscErrorCode HycoOptionListDestroy(HycoOptionList *list);
/* The option of this name (without dash; the entry mu_ matches mu_radius), or NULL. Borrowed. */
const HycoOption *HycoOptionListFind(const HycoOptionList *list, const char name[]);
/* What a class declares for an option (name without the dash), or NULL. Borrowed. */
const HycoOption *HycoOptionFind(const char name[]);
/* The known name nearest to `word`, of those that the classes declare and (if not NULL) those in `more`; NULL: none
   is near. Borrowed. */
const char *HycoOptionNearest(const char word[], const HycoOptionList *more);
/* Fails for the former name of an option, with its present name. */
PetscErrorCode HycoOptionsCheckName(const char name[]);
/* Whether a name (without the dash) has the prefix of hyco's Tao, KSP, PC, MUMPS or SVD ("hyco_tao_", ...), and whether
   one of them reads it: found by such objects with this option alone. Not collective. */
PetscErrorCode HycoOptionsOfSolver(const char name[], PetscBool *prefix, PetscBool *reads);
/* Whether an option's name (without dash) begins like an entry of a scene. */
PetscBool HycoIsSceneKey(const char name[]);

/* Whether a text is no YAML, is nested too deeply, or has two documents; problem: "line 3: ...", "" if it has none. It
   needs no PETSc. */
PetscBool HycoYAMLHasProblem(const char text[], char problem[HYCO_LINE]);

#if defined(__cplusplus)
}
#endif
#endif
