/*
  A type of reduced model: its operations for HycoROM. A program adds a type by HycoROMRegister(), and its training by
  HycoTrainerRegister() (hycotrainer.h), before it trains or loads such models. They are then trained, saved, loaded,
  predicted and compared by the same functions and commands as the types of the library (examples/ladder/model.c).
*/
#ifndef HYCOROMTYPE_H
#define HYCOROMTYPE_H

#include <hycoh5.h>
#include <hycorom.h>

#if defined(__cplusplus)
extern "C" {
#endif

/* The settings that a search varies. */
typedef enum {
  HYCO_SETTINGS_MODES, /* the number of modes */
  HYCO_SETTINGS_RID,   /* the same, the size of the RID, which displacements are full order */
  HYCO_SETTINGS_NONE   /* none: one attempt */
} HycoSettings;

/* Properties of a type. */
typedef struct {
  const char *title; /* "hybrid hyper-reduced" */
  size_t work;       /* bytes of HycoROMGetWork() */
  HycoSettings settings;
  PetscBool whole;       /* the RID is the whole mesh, so that it has no seeds */
  PetscBool stiffness;   /* there is a reduced stiffness, whose condition is reported */
  PetscBool constrains;  /* the gap of each contact of A_lambda is constrained to be nonnegative */
  PetscBool forces;      /* it gives accurate forces of all contacts, for HycoFOMSolveForces() */
  PetscBool force_basis; /* it supports -hyco_dual nnmf and snapshots */
  PetscBool history;     /* it supports the paths of scenes with a history */
  PetscBool resultants;  /* its contact forces are multipliers of contacts: reactions are those in balance with them */
  PetscBool surfaces;    /* the displacements of the contacts' surfaces are its own, beside those of the modes */
  PetscBool uniform; /* its errors do not follow the features: the estimates are a multiple of their largest at held-out
                        points, and no less than those of ops->estimate */
  PetscBool own_modes; /* its modes are displacements of its own: solutions choose only the cells of its mesh, for which
                            those at held-out points serve, and a search tries it before the training points are
                            solved */
  PetscBool integrals; /* it takes contacts whose rows are integrals, with any number of masters (type mortar) */
  PetscBool friction;  /* it takes contacts with friction */
  PetscBool cells;     /* its mesh consists of the cells that it chooses, and of the surfaces of contacts and, without
                      `surfaces`, loads */
} HycoROMTraits;

/* The system on the RID before reduction, for the indicator (43). Borrowed. */
typedef struct {
  Mat K, B; /* over the unknowns of the RID's mesh; B: all contacts, with the rows of those in A_lambda */
  Vec F, D;
  IS is_A, is_I, is_A_lambda;
} HycoLocal;

/* An operation that a type does not have is NULL. Not collective, unless stated. */
typedef struct _HycoROMOps {
  PetscErrorCode (*options)(HycoROM);                     /* its options of a model */
  PetscErrorCode (*setup)(HycoROM);                       /* default: HycoROMSetUpDefault() */
  PetscErrorCode (*reset)(HycoROM);                       /* frees what setup and solve have allocated */
  PetscErrorCode (*solve)(HycoROM, const PetscReal mu[]); /* ends with HycoROMSetSolution() */
  PetscErrorCode (*reconstruct)(HycoROM);                 /* forces outside A_lambda */
  PetscErrorCode (*energy)(HycoROM, PetscReal *,
                           PetscBool *known);        /* strain energy, if it is known without further cost */
  PetscErrorCode (*condition)(HycoROM, PetscReal *); /* of the reduced stiffness; 0: not known */
  PetscErrorCode (*local)(HycoROM, HycoLocal *);
  PetscErrorCode (*features)(HycoROM, PetscReal misfit[2]); /* features that indicate its errors, >= 0 */
  PetscErrorCode (*estimate)(HycoROM, HycoPrediction *);    /* its errors, without held-out points */
  /* gradients; without `residual` the type has none. Its problem is w = q + M z, z = (x, L): w = 0 for the p unknowns
     x, 0 <= w complementary to the n forces L >= 0. Of paths: of a step from rest of elastic bodies, mu with the time,
     with friction L by row (tangents follow the normal of their contact) */
  PetscErrorCode (*unknowns)(HycoROM, PetscInt *p, PetscInt *n, PetscReal z[]); /* z (p + n) of the last solve; NULL:
                                                                                   only the sizes */
  PetscErrorCode (*residual)(HycoROM, const PetscReal mu[], const PetscReal z[], PetscReal w[],
                             PetscReal *size); /* moves the data to mu (NULL: they are there) and takes z; w (p + n;
                                                  NULL: not needed); size: of gaps and displacements of the contacts */
  PetscErrorCode (*linearise)(
      HycoROM, PetscInt k, PetscInt listed,
      PetscBool *able); /* NULL, or of paths; able: the problem becomes that of accepted step k, the
                                               listed time `listed` (-1: none), whose parameters and forces the model
                                               has; k < 0: only asks. With friction or laws with a past, for each step
                                               from the first one on */
  PetscErrorCode (*jacobian)(HycoROM, PetscInt k, const PetscInt contact[],
                             PetscReal M[]); /* of x and these k forces, p + k square by columns, at the last mu */
  PetscErrorCode (*perturbed)(
      HycoROM, const PetscReal mu[], PetscInt n, const PetscInt contact[], PetscBool rows, const PetscReal z[],
      PetscInt point, PetscReal w[]); /* NULL, or in place of `residual` beside the last prediction: w of z to the first
                                         order, of n contacts; rows: theirs change, and are those that the model has at
                                         the time. Keeps the change of the data as that of `point`, 1 to 4 */
  PetscErrorCode (*slope)(HycoROM, PetscInt n, const PetscInt contact[], const PetscReal weight[2],
                          const PetscInt point[2], const PetscReal dz[], const PetscBool modes[],
                          const PetscBool dofs[], PetscReal dgamma[],
                          PetscReal dU[]); /* with `perturbed`: the derivatives of the modes' coefficients and of the
                                              full-order displacements, for those of the data (the weighted sum of the
                                              changes at two points) and of z; modes (l), dofs (of mesh): which of them
                                              are wanted */
  /* then: of the step that `linearise` took. Its row of the normal, by contact, w with no slip before (p + n), and
     size as of `residual` */
  PetscErrorCode (*step_residual)(HycoROM, const PetscInt **row, PetscReal w[], PetscReal *size);
  PetscErrorCode (*sensitivity)(
      HycoROM, PetscInt parameter, const PetscReal weight[3], const PetscInt point[3], const PetscReal q[],
      PetscReal dz[], PetscBool *regular); /* the derivative of z from q of that w, and from those of the steps before;
                                              regular: the states of contacts and laws determine it */
  PetscErrorCode (*show)(HycoROM, PetscInt parameter, PetscBool rows, PetscReal step,
                         const PetscReal dz[]); /* the friction of the model's contacts becomes that of z moved so */
  PetscErrorCode (*expand)(HycoROM);            /* sets what a solve sets (modes, displacements, forces) from that z */
  PetscErrorCode (*view)(HycoROM, PetscViewer);
  PetscErrorCode (*save)(HycoROM, HycoH5);
  PetscErrorCode (*load)(HycoROM, HycoH5);
  PetscErrorCode (*destroy)(HycoROM); /* frees its data */
} HycoROMOps;

/* Adds a type: `create` calls HycoROMSetOps() for the model that it is given. Not collective. */
PetscErrorCode HycoROMRegister(const char name[], PetscErrorCode (*create)(HycoROM));
/* In create: sets the operations and properties of the type, which are copied, and its data, which ops->destroy frees.
 */
PetscErrorCode HycoROMSetOps(HycoROM model, const HycoROMOps *ops, const HycoROMTraits *traits, void *data);
PetscErrorCode HycoROMGetData(HycoROM model, void *data);
/* What setup and solve of the type change: traits.work bytes, zeros before setup and NULL without it; freed after
   reset. The data do not change after build and load: other handles on the model (HycoROMClone()) use the same. */
PetscErrorCode HycoROMGetWork(HycoROM model, void *work);
/* Sets the type of a model that has none yet. Fails for an unknown type, with the registered names. */
PetscErrorCode HycoROMSetType(HycoROM model, HycoROMType type);
/* Gets the numbers of modes and contacts of a model that is in training or loaded. Any output may be NULL. */
PetscErrorCode HycoROMGetDimensions(HycoROM model, PetscInt *n_modes, PetscInt *n_contacts);
/* In setup: the default set-up, in which all contacts and all of the mesh belong to the model. */
PetscErrorCode HycoROMSetUpDefault(HycoROM model);
/* Ends a solve at mu: sets the coefficients of the modes and the forces of all contacts, which are copied (NULL: those
   in the model), and computes the residuals of (16) at the contacts. */
PetscErrorCode HycoROMSetSolution(HycoROM model, const PetscReal mu[], const PetscReal gamma[],
                                  const PetscReal Lambda[]);

#if defined(__cplusplus)
}
#endif
#endif
