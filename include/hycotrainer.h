/*
  The training of a type of reduced model (hycoromtype.h): its operations for HycoReducer. Models load and predict
  without it.
*/
#ifndef HYCOTRAINER_H
#define HYCOTRAINER_H

#include <hycoreducer.h>

#if defined(__cplusplus)
extern "C" {
#endif

/* An operation that a type does not have is NULL, except build. Not collective, unless stated. The state of the reducer
   is on rank 0. */
typedef struct _HycoTrainerOps {
  PetscErrorCode (*setfromoptions)(HycoReducer); /* its options of the training, on every rank */
  PetscErrorCode (*reset)(HycoReducer);          /* frees what these options and a run have allocated, on every rank */
  PetscErrorCode (*begin)(HycoReducer); /* before any solve: refuses unsupported scenes and options. Collective */
  PetscErrorCode (*modes)(HycoReducer,
                          HycoSnapshots); /* modes in addition to or instead of the solutions' POD. Collective */
  PetscErrorCode (*build)(HycoROM,
                          HycoReducer); /* builds the model, on rank 0, where its mesh, contacts and modes exist */
  PetscErrorCode (*finish)(HycoReducer, HycoROM,
                           HycoTraining *); /* checks over the ranges; may change the model, on rank 0. Collective */
  PetscErrorCode (*report)(HycoReducer, HycoROM, HycoTraining *); /* summary and facts. Rank 0 */
  PetscReal (*cost)(HycoReducer, const HycoAttempt *);            /* operations of an online solve at a new stiffness */
  PetscBool (*offers)(HycoReducer, PetscBool targets, size_t length,
                      char why[]); /* whether a search tries it by default, with or without -target_...; if not,
                                      `why` may get a reason for the user. Of types with own_modes `begin` is called
                                      before, and its refusal is the reason */
  PetscReal (*work)(HycoReducer);  /* operations of making a model, if they are many, from the sizes of the scene */
  const char *const *(*variants)(
      HycoReducer); /* ways to make a model, of which a search tries one after the other until
                                                  one meets the targets: their names, then NULL; NULL: one way */
  PetscErrorCode (*setvariant)(HycoReducer, const char name[]);
} HycoTrainerOps;

/* Adds the training of a type that HycoROMRegister() adds: `create` sets the operations, which are all NULL before. Not
   collective. */
PetscErrorCode HycoTrainerRegister(const char name[], PetscErrorCode (*create)(HycoTrainerOps *ops));

/* In build: gets the training points (n x n_parameters), the contact forces there (n_contacts x n column major) and the
   modes' coefficients (n_modes x n column major). Any output may be NULL. Borrowed. Rank 0. */
PetscErrorCode HycoReducerGetSolutions(HycoReducer reducer, PetscInt *n, const PetscReal *mu[],
                                       const PetscReal *Lambda[], const PetscReal *gamma[]);

#if defined(__cplusplus)
}
#endif
#endif
