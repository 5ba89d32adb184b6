/* Greedy training (section 5.4): the indicator of a model at a parameter value. All on one process. */
#ifndef GREEDY_H
#define GREEDY_H

#include <hycoreducerimpl.h>

typedef struct {
  PetscReal eta; /* the indicator to reduce: eta_u + eta_lambda (43), also for paths, or I (45); infinite: x/0 or not
                    solved */
  PetscReal eta_u, eta_lambda;
  PetscReal size; /* orders points with an infinite eta: the sum of the numerators; infinite if not solved */
  PetscBool solved;
} HycoIndication;

typedef struct _n_HycoIndicator *HycoIndicator;

/* Whether this kind uses the interpolated solutions (43); they need the whole mesh from the model's file. */
PetscBool HycoIndicatorInterpolates(HycoIndicatorKind kind);
PetscBool HycoIndicatorOnWhole(HycoIndicatorKind kind);
/*
  Creates the indicator of `model` (borrowed). U_at: snapshots on the unknowns of the model's mesh (n_dof x n row major)
  at the n points (n x n_parameters), borrowed; NULL unless the kind interpolates. length: of the whole mesh. Not
  collective.
*/
PetscErrorCode HycoIndicatorCreate(HycoROM model, HycoIndicatorKind kind, PetscInt n, const PetscReal points[],
                                   const PetscReal U_at[], PetscReal length, HycoIndicator *indicator);
PetscErrorCode HycoIndicatorDestroy(HycoIndicator *indicator);
/* Predicts at mu and computes the indicator of the prediction. The result does not depend on earlier calls. */
PetscErrorCode HycoIndicatorEvaluate(HycoIndicator indicator, const PetscReal mu[], HycoIndication *value);

#endif
