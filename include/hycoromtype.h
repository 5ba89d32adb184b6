/*
  A type of reduced model: what HycoROM and HycoReducer ask of it. A program adds one by HycoROMRegister() before it
  trains or loads such models; they are then trained, saved, loaded, predicted and compared by the same calls and
  commands as the library's own (examples/ladder/model.c).
*/
#ifndef HYCOROMTYPE_H
#define HYCOROMTYPE_H

#include <hycoh5.h>
#include <hycoreducer.h>

#if defined(__cplusplus)
extern "C" {
#endif

/* The settings that a search for a recipe varies. */
typedef enum {
  HYCO_SETTINGS_MODES, /* how many modes */
  HYCO_SETTINGS_RID,   /* these, the size of the RID, which displacements are full order */
  HYCO_SETTINGS_NONE   /* none: one attempt */
} HycoSettings;

/* What a type is, without any model of it. */
typedef struct {
  const char *title; /* in words: "hybrid hyper-reduced" */
  HycoSettings settings;
  PetscBool whole;       /* the whole mesh is its RID: nothing seeds one */
  PetscBool stiffness;   /* it has a reduced stiffness, whose condition is reported */
  PetscBool constrains;  /* the gap of each contact of A_lambda is held nonnegative */
  PetscBool forces;      /* it gives the forces of all contacts as those of the full order: HycoFOMSolveForces() */
  PetscBool force_basis; /* it takes -hyco_dual nnmf and snapshots */
  PetscBool history;     /* its solve has the paths of scenes with a history */
  PetscBool cells; /* its mesh is of the cells that its modes choose alone, with the surfaces of contacts and loads */
} HycoROMTraits;

/* The system on the RID before reduction, for the indicator (43). Borrowed. */
typedef struct {
  Mat K, B; /* over the unknowns of the RID's mesh; B: the contacts of A_lambda */
  Vec F, D;
  IS is_A, is_I;
} HycoLocal;

/* NULL for what a type does not do. Not collective, unless said. */
typedef struct _HycoROMOps {
  /* -- training; the reducer's state is on rank 0 -- */
  PetscErrorCode (*setfromoptions)(HycoReducer); /* its options of the training, on every rank */
  PetscErrorCode (*resettraining)(HycoReducer);  /* frees what they and a run have made, on every rank */
  PetscErrorCode (*begin)(HycoReducer);          /* before any solve: refuses what it is not for. Collective */
  PetscErrorCode (*startpoints)(HycoReducer, HycoSamples *);                 /* chooses its own training points: */
  PetscErrorCode (*choosepoints)(HycoReducer, HycoSnapshots, HycoSamples *); /* first ones; those. Collective */
  PetscErrorCode (*modes)(HycoReducer, HycoSnapshots); /* modes beside or instead of the solutions' POD. Collective */
  PetscErrorCode (*build)(HycoROM, HycoReducer); /* the model, on rank 0, its mesh, contacts and modes being there */
  PetscErrorCode (*finish)(HycoReducer, HycoROM, HycoTraining *); /* checks over the ranges; changed on rank 0.
                                                                     Collective */
  PetscErrorCode (*report)(HycoReducer, HycoROM, HycoTraining *); /* summary and facts. Rank 0 */
  PetscReal (*cost)(HycoReducer, const HycoAttempt *);            /* operations of an online solve at a new stiffness */
  PetscBool (*offers)(HycoReducer, PetscBool targets); /* whether a search tries it unasked, -target_... given or not */
  /* -- online -- */
  PetscErrorCode (*options)(HycoROM);                               /* its options of a model */
  PetscErrorCode (*setup)(HycoROM);                                 /* default: HycoROMSetUpDefault() */
  PetscErrorCode (*reset)(HycoROM);                                 /* frees what setup and solve have made */
  PetscErrorCode (*solve)(HycoROM, const PetscReal mu[]);           /* ends with HycoROMSetSolution() */
  PetscErrorCode (*reconstruct)(HycoROM);                           /* forces outside A_lambda */
  PetscErrorCode (*energy)(HycoROM, PetscReal *, PetscBool *known); /* strain energy, if it has it at hand */
  PetscErrorCode (*condition)(HycoROM, PetscReal *);                /* of the reduced stiffness; 0: not known */
  PetscErrorCode (*local)(HycoROM, HycoLocal *);
  PetscErrorCode (*features)(HycoROM, PetscReal misfit[2]); /* what tells of its errors, >= 0 */
  PetscErrorCode (*estimate)(HycoROM, HycoPrediction *);    /* its errors, where nothing was held out */
  PetscErrorCode (*view)(HycoROM, PetscViewer);
  PetscErrorCode (*save)(HycoROM, HycoH5);
  PetscErrorCode (*load)(HycoROM, HycoH5);
  PetscErrorCode (*destroy)(HycoROM); /* its data */
} HycoROMOps;

/* Adds a type: `create` calls HycoROMSetType...() of the model that it is given. Not collective. */
PetscErrorCode HycoROMRegister(const char name[], PetscErrorCode (*create)(HycoROM));
/* In create: what the type does, copied; its data, which ops->destroy frees. */
PetscErrorCode HycoROMSetOps(HycoROM model, const HycoROMOps *ops, const HycoROMTraits *traits, void *data);
PetscErrorCode HycoROMGetData(HycoROM model, void *data);
/* The registered type of a model that has none yet; fails with the names where there is none of that name. */
PetscErrorCode HycoROMSetType(HycoROM model, HycoROMType type);
/* Modes and contacts of a model under training or loaded. Any output may be NULL. */
PetscErrorCode HycoROMGetDimensions(HycoROM model, PetscInt *n_modes, PetscInt *n_contacts);
/* In setup: every contact the model's own, on all of its mesh; what a type without setup has. */
PetscErrorCode HycoROMSetUpDefault(HycoROM model);
/* The end of a solve at mu: coefficients of the modes and forces of all contacts, copied (NULL: as they are in the
   model); the residuals of (16) that they leave at the contacts are measured. */
PetscErrorCode HycoROMSetSolution(HycoROM model, const PetscReal mu[], const PetscReal gamma[],
                                  const PetscReal Lambda[]);

/* In build: the training points (n x n_parameters), the contact forces there (n_contacts x n column major) and the
   modes' coefficients (n_modes x n column major). Any output may be NULL. Borrowed. Rank 0. */
PetscErrorCode HycoReducerGetSolutions(HycoReducer reducer, PetscInt *n, const PetscReal *mu[],
                                       const PetscReal *Lambda[], const PetscReal *gamma[]);

#if defined(__cplusplus)
}
#endif
#endif
