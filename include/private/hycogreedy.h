/* Greedy training (section 5.4), inside: the indicator of a model at a parameter value. All on one process. */
#ifndef HYCOGREEDY_H
#define HYCOGREEDY_H

#include <hycoreducerimpl.h>

typedef struct {
  PetscReal eta; /* what is to fall: eta_u + eta_lambda (43) and of paths, or I (45); infinite: x/0 or not solved */
  PetscReal eta_u, eta_lambda;
  PetscReal size; /* ranks what is infinite: the numerators' sum; infinite when not solved */
  PetscBool solved;
} HycoIndication;

typedef struct _n_HycoIndicator *HycoIndicator;

/* Whether this kind judges by the interpolated solutions (43); on the whole mesh, which the model's file must have. */
PetscBool HycoIndicatorInterpolates(HycoIndicatorKind kind);
PetscBool HycoIndicatorOnWhole(HycoIndicatorKind kind);
/*
  The indicator of `model` (borrowed). U_at: snapshots on the unknowns of the model's mesh (n_dof x n row major) at the
  n points (n x n_parameters); NULL unless the kind
  interpolates; borrowed. length: of the whole mesh. Not collective.
*/
PetscErrorCode HycoIndicatorCreate(HycoROM model, HycoIndicatorKind kind, PetscInt n, const PetscReal points[],
                                   const PetscReal U_at[], PetscReal length, HycoIndicator *indicator);
PetscErrorCode HycoIndicatorDestroy(HycoIndicator *indicator);
/* Predicts at mu and judges the prediction. What it gives does not depend on what was asked before. */
PetscErrorCode HycoIndicatorEvaluate(HycoIndicator indicator, const PetscReal mu[], HycoIndication *value);

#endif
