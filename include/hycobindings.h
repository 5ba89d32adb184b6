/* For bindings to other languages: the layout of the public structs. With it a binding reads results by name, without a
   compiler and without a second declaration of each struct (python/hyco). */
#ifndef HYCOBINDINGS_H
#define HYCOBINDINGS_H

#include <hycosys.h>

#if defined(__cplusplus)
extern "C" {
#endif

/* A member of a struct: `count` items of `size` bytes, from byte `offset` on. A struct within another contributes its
   own members, "kkt.penetration". */
typedef struct {
  const char *name;
  char kind; /* 'i': signed integer or enum; 'f': real; 'S': characters, up to a 0; 'z': const char*; 'p': other
               pointer */
  size_t offset, size, count;
} HycoMember;

/*
  Gets the size in bytes of a type of the library, and the n members of a struct in their order. Types: HycoSummary,
  HycoStep, HycoHistory, HycoReaction, HycoContactResult, HycoPrediction, HycoGradient, HycoFit with all of their
  members; HycoTraining with those of its members that are numbers or texts of the whole training; PetscInt, PetscReal,
  PetscBool and MPI_Comm with n = 0. Fails for another name. `n` and `fields` may be NULL. Not collective. Borrowed from
  the library.
*/
PetscErrorCode HycoGetLayout(const char type[], size_t *size, PetscInt *n, const HycoMember *fields[]);

/*
  For a program whose environment is not hyco's to set; the command does both. If OpenBLAS does not know this processor
  because it is newer, and has selected its oldest kernels: selects those that the processor supports, unless
  OPENBLAS_CORETYPE is set. No thread may be in BLAS. False: it cannot in a running process; OPENBLAS_CORETYPE is set
  for the next one. Not collective.
*/
PetscBool HycoBLASChooseKernels(void);
/* Sets the number of OpenBLAS's or MKL's threads, and returns the number before. 0, and nothing is set: n is 0, another
   BLAS, or a variable such as OPENBLAS_NUM_THREADS or OMP_NUM_THREADS chooses it. hyco is made for one thread per rank:
   set 1 before a call, and the former number after it. Not collective. */
int HycoBLASSetThreads(int n);

/*
  For a language that handles Ctrl-C itself. Between the two, SIGINT only makes the library call `ask` between two
  solves (of points, of samples, steps of a path): 0: it goes on; else the call fails there, as all that follow until
  HycoInterruptEnd(). That returns whether a signal came of which `ask` was not told, and gives the signal back to its
  former handler. Pairs may be nested: the outermost counts. Of one process and one thread.
*/
void HycoInterruptBegin(int (*ask)(void));
PetscBool HycoInterruptEnd(void);

#if defined(__cplusplus)
}
#endif
#endif
