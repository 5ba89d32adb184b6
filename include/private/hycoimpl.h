/* Common to every file of the library: PETSc versions, errors on every rank, HDF5 files. */
#ifndef HYCOIMPL_H
#define HYCOIMPL_H

#include <hycoprogram.h>
#include <hycotolerance.h>
#include <petsc/private/petscimpl.h>
#include <petscmat.h>
#include <stdio.h>
#include <strings.h>

/* Raises the caught error again, unless it is HYCO_ERR_NO_MODEL. */
PetscErrorCode HycoCatchNoModel(PetscErrorCode caught, const char message[]);

/* Catches an error of `call`: its code, 0 if there is none, and its line. */
#define HycoCatch(call, caught, message)                                                                               \
  do {                                                                                                                 \
    PetscCall(HycoCatchBegin());                                                                                       \
    (caught) = (call);                                                                                                 \
    PetscCall(HycoCatchEnd((caught), (message)));                                                                      \
  } while (0)

/* HycoFail() and HycoCheck() with HYCO_ERR_NO_MODEL. */
#define HycoFailNoModel(...) HycoFailAs(HYCO_ERR_NO_MODEL, __VA_ARGS__)
#define HycoCheckModel(condition, ...)                                                                                 \
  do {                                                                                                                 \
    if (PetscUnlikely(!(condition))) HycoFailNoModel(__VA_ARGS__);                                                     \
  } while (0)

/* Fails if SIGINT came since HycoInterruptBegin() and its owner wants to end: where work can end without loss, between
   solves. Not collective. */
PetscErrorCode HycoInterruptCheck(void);

/* Fails for NULL and for an object of another class. Not collective. `classid` is one of HYCO_..._CLASSID. */
PetscErrorCode HycoHandleCheck(const void *handle, const PetscClassId *classid, const char function[]);
/* An address that a caller must give. */
#define HycoCheckGiven(pointer)                                                                                        \
  PetscCheck((pointer), PETSC_COMM_SELF, PETSC_ERR_ARG_NULL, "%s: argument " #pointer " is NULL", PETSC_FUNCTION_NAME)
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
PetscErrorCode HycoViewFromOptions_Private(PetscObject object, PetscObject owner, const char option[]);
/* Gives an object another's options and prefix: what is inside an object reads what the object does. */
PetscErrorCode HycoOptionsInherit(PetscObject object, PetscObject from);
/* Defines XViewFromOptions() of a class. */
#define HycoDefineViewFromOptions(Class, classid)                                                                      \
  PetscErrorCode Class##ViewFromOptions(Class object, PetscObject owner, const char option[])                          \
  {                                                                                                                    \
    PetscFunctionBegin;                                                                                                \
    HycoCheckHandle(object, classid);                                                                                  \
    PetscCall(HycoViewFromOptions_Private((PetscObject)object, owner, option));                                        \
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
/* Begins a Destroy: returns from the calling function for NULL; checks the object, removes one reference and, unless
   that was the last, sets `*object` to NULL and returns. */
#define HycoDestroyBegin(object, classid)                                                                              \
  do {                                                                                                                 \
    if (!(object) || !*(object)) PetscFunctionReturn(PETSC_SUCCESS);                                                   \
    HycoCheckHandle(*(object), classid);                                                                               \
    if (--((PetscObject) * (object))->refct > 0) {                                                                     \
      *(object) = NULL;                                                                                                \
      PetscFunctionReturn(PETSC_SUCCESS);                                                                              \
    }                                                                                                                  \
  } while (0)

/* HycoConcatenate() on every rank. Collective. */
PetscErrorCode HycoConcatenateAll(MPI_Comm comm, PetscInt n, const void *mine, MPI_Datatype type, size_t size,
                                  PetscInt *n_all, void *all);

/* All entries of a vector, on every rank. Collective. */
PetscErrorCode HycoVecGather(Vec v, PetscReal all[]);
/* Copies this rank's first n entries from or to an array. Not collective. */
PetscErrorCode HycoVecRead(Vec v, PetscInt n, PetscReal value[]);
PetscErrorCode HycoVecWrite(Vec v, PetscInt n, const PetscReal value[]);
/* Begins and ends a forward scatter that inserts. Collective. */
PetscErrorCode HycoScatter(VecScatter scatter, Vec from, Vec to);

/* Begins and ends the assembly. Collective. */
PetscErrorCode HycoMatAssemble(Mat A);
PetscErrorCode HycoVecAssemble(Vec v);

/* Sends n rows of `size` bytes, row k to rank to[k]; *got: the *n_got rows that arrive, by the rank that sent them and
   then in its order. The caller frees it by PetscFree(). Collective. */
PetscErrorCode HycoSendRows(MPI_Comm comm, PetscInt n, const PetscMPIInt to[], size_t size, const void *row,
                            PetscInt *n_got, void *got);

#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__) &&                       \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
/* Of a function with loops: four numbers at once where the processor can; without fused operations, so that the bits
   are those of any other. */
#define HYCO_FOUR_AT_ONCE __attribute__((target_clones("avx2", "default")))
#else
#define HYCO_FOUR_AT_ONCE
#endif

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
  HYCO_EVENT_BODIES, /* modes of a model of bodies */
  HYCO_N_EVENTS
} HycoEvent;
PetscErrorCode HycoLogEvent(HycoEvent event, PetscBool begin);
/* PetscCall(call) within the event, which also ends on an error. */
#define HycoLogged(event, call)                                                                                        \
  do {                                                                                                                 \
    PetscErrorCode logged_;                                                                                            \
    PetscCall(HycoLogEvent((event), PETSC_TRUE));                                                                      \
    logged_ = (call);                                                                                                  \
    PetscCall(HycoLogEvent((event), PETSC_FALSE));                                                                     \
    PetscCall(logged_);                                                                                                \
  } while (0)

/* PetscCall(call) after the statements, which also run after an error of it. */
#define HycoFinally(call, ...)                                                                                         \
  do {                                                                                                                 \
    const PetscErrorCode finally_ = (call);                                                                            \
    __VA_ARGS__;                                                                                                       \
    PetscCall(finally_);                                                                                               \
  } while (0)
/* PetscCall(call) after the statements, which run only after an error of it. */
#define HycoOnError(call, ...)                                                                                         \
  do {                                                                                                                 \
    const PetscErrorCode failed_ = (call);                                                                             \
    if (failed_) {                                                                                                     \
      __VA_ARGS__;                                                                                                     \
    }                                                                                                                  \
    PetscCall(failed_);                                                                                                \
  } while (0)

/* The seal of a file with these bytes, to be appended to them. */
#define HYCO_CHECKSUM 24
void HycoChecksumMake(const void *data, size_t bytes, unsigned char seal[HYCO_CHECKSUM]);
/* Computes the seal of a file, and its size. */
PetscErrorCode HycoChecksumFile(const char path[], size_t *size, unsigned char seal[HYCO_CHECKSUM]);
/* Size of a file, and whether it has a seal; fails if it has one that does not match its bytes. */
PetscErrorCode HycoChecksumCheck(const char path[], size_t *size, PetscBool *sealed);

/* The text without the mark of UTF-8 (a byte order mark) with which spreadsheets and editors of Windows begin one. */
static inline char *HycoSkipMark(char *text)
{
  return text + 3 * !strncmp(text, "\xef\xbb\xbf", 3);
}
/* strtod() with a decimal point, whatever the locale of the calling program. */
double HycoNumber(const char text[], char **end);
/* Between the two calls, this thread reads and writes numbers with a decimal point. */
void *HycoPointBegin(void);
void HycoPointEnd(void *before);

/* Makes BLAS allocate its memory now, or fails: without memory, OpenBLAS would try again without end. On this
   process alone. */
PetscErrorCode HycoReserveBLAS(void);
/* Of this machine, in bytes; 0: not known. */
PetscReal HycoMachineMemory(void);

/* lost / size; 0/0 counts as 0, x/0 is PETSC_INFINITY. */
static inline PetscReal HycoRelative(PetscReal lost, PetscReal size)
{
  return size > 0 ? lost / size : lost > 0 ? PETSC_INFINITY : 0;
}

/* CPU seconds of this process. */
PetscReal HycoCPU(void);

/* The table of HycoGetOptionTable() is recorded again at its next call. */
PetscErrorCode HycoOptionsForgetTable(void);
/* Creates an object of each class and calls its SetFromOptions with `options` (src/package): the declaration pass of
   the table. */
PetscErrorCode HycoDeclareClasses(PetscOptions options);
void HycoOptionsSetDeclare(PetscErrorCode (*declare)(PetscOptions));
/* Makes each kind of object that reads options of a prefix of hyco's solvers read the global ones, one after the other
   (src/package). */
void HycoOptionsSetProbe(PetscErrorCode (*probe)(const char name[]));
PetscErrorCode HycoSolversProbe(const char name[]);
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

/* PetscFree() of each pointer, given by its address. */
#define HycoFreeAll(...) PetscCall(HycoFreeAll_Private((void *[]){__VA_ARGS__, NULL}))
PetscErrorCode HycoFreeAll_Private(void *const addresses[]);
/* Destroys each object of PETSc, given by its address, like its class's Destroy function. */
#define HycoDestroyAll(...) PetscCall(HycoDestroyAll_Private((void *[]){__VA_ARGS__, NULL}))
PetscErrorCode HycoDestroyAll_Private(void *const addresses[]);

/* Duplicates of a vector, at the addresses that follow. */
#define HycoVecDuplicate(v, ...) PetscCall(HycoVecDuplicate_Private((v), (Vec *[]){__VA_ARGS__, NULL}))
PetscErrorCode HycoVecDuplicate_Private(Vec v, Vec *const copies[]);
/* Room for entry n of an array with room for `room` entries, which doubles. */
#define HycoGrow(n, room, array)                                                                                       \
  do {                                                                                                                 \
    if ((n) == (room)) {                                                                                               \
      (room) = 2 * (room) + 64;                                                                                        \
      PetscCall(PetscRealloc((size_t)(room) * sizeof(*(array)), &(array)));                                            \
    }                                                                                                                  \
  } while (0)

#endif
