/*
  Flow of von Mises type, which the laws with creep and plasticity share: small strain, implicit Euler, one scalar
  equation a point. A law gives the creep strain of a step at a constant equivalent stress and the yield stress by the
  plastic strain, or one of the two; the rest is src/material/flow.c (formulas: docs/materials.md).
*/
#ifndef HYCOFLOW_H
#define HYCOFLOW_H

#include <hycomaterialimpl.h>

#define HYCO_FLOW_CONSTANTS 6

/* A point of a step, to the functions of a rule. */
typedef struct {
  PetscReal c[HYCO_FLOW_CONSTANTS]; /* the law's own constants: those after young and poisson */
  PetscReal dt, temperature;        /* the temperature at the step's end */
  PetscReal creep0, plastic0;       /* accumulated equivalent strains at its begin */
  PetscReal scratch[2];             /* for prepare() */
} HycoFlowPoint;

typedef struct {
  PetscInt n_constants; /* of the law's own */
  /* Optional: what does not depend on the stress, once a point; why: a reason to refuse the point, left NULL. */
  void (*prepare)(HycoFlowPoint *, const char **why);
  /* Equivalent creep strain of the step at the equivalent stress q > 0, 0 or more and increasing in q, its derivative
   *in slope; may overflow. NULL: no creep. */
  PetscReal (*creep)(const HycoFlowPoint *, PetscReal q, PetscReal *slope);
  /* Its integral over q from 0; NULL: none is known, and the law has no incremental potential. */
  PetscReal (*creep_integral)(const HycoFlowPoint *, PetscReal q);
  /* Yield stress after the plastic strain p, not decreasing, its derivative in *slope; a negative value: never yields.
     NULL: no plasticity. */
  PetscReal (*yield)(const HycoFlowPoint *, PetscReal p, PetscReal *slope);
  /* Its integral from plastic0 to plastic0 + dp. */
  PetscReal (*yield_integral)(const HycoFlowPoint *, PetscReal dp);
} HycoFlowRule;

/* In a law's create(): begin declares young and poisson, the law then its own constants, and end gives it the rule
   (which stays where it is). */
PetscErrorCode HycoFlowBegin(HycoMaterial material);
PetscErrorCode HycoFlowEnd(HycoMaterial material, const HycoFlowRule *rule);

#endif
