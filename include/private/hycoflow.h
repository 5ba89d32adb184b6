/*
  Flow of von Mises type, common to the laws with creep and plasticity: small strain, implicit Euler, one scalar
  equation at each point. A law gives the creep strain of a step at a constant equivalent stress, the yield stress as a
  function of the plastic strain, or both; src/material/flow.c does the rest (formulas: docs/materials.md).
*/
#ifndef HYCOFLOW_H
#define HYCOFLOW_H

#include <hycomaterialimpl.h>

/* -- begin: in exported models too -- */
#define HYCO_FLOW_CONSTANTS 6

/* Data of a point and a step, passed to the functions of a rule. */
typedef struct {
  PetscReal c[HYCO_FLOW_CONSTANTS]; /* the law's own constants: those after young and poisson */
  PetscReal dt, temperature;        /* the temperature at the step's end */
  PetscReal creep0, plastic0;       /* accumulated equivalent strains at the begin of the step */
  PetscReal scratch[2];             /* for prepare() */
} HycoFlowPoint;

typedef struct {
  PetscInt n_constants; /* number of the law's own constants */
  PetscBool hardens;    /* creep depends on creep0 */
  /* Optional: computes what does not depend on the stress, once per point; why: the reason for which the point is
     refused, left NULL otherwise. */
  void (*prepare)(HycoFlowPoint *, const char **why);
  /* Equivalent creep strain of the step at the equivalent stress q > 0: not negative, increasing in q, with its
     derivative in *slope; may overflow. NULL: no creep. */
  PetscReal (*creep)(const HycoFlowPoint *, PetscReal q, PetscReal *slope);
  /* Its integral over q from 0; NULL: not known, and the law has no incremental potential. */
  PetscReal (*creep_integral)(const HycoFlowPoint *, PetscReal q);
  /* Yield stress at the plastic strain p, not decreasing, with its derivative in *slope; a negative value: never
     yields. NULL: no plasticity. */
  PetscReal (*yield)(const HycoFlowPoint *, PetscReal p, PetscReal *slope);
  /* Its integral from plastic0 to plastic0 + dp. */
  PetscReal (*yield_integral)(const HycoFlowPoint *, PetscReal dp);
} HycoFlowRule;
/* -- end: in exported models too -- */
extern const HycoFlowRule HycoFlowJ2, HycoFlowNorton, HycoFlowStrainHardening, HycoFlowLimbackAndersson;

/* The law at points whose constants are young, poisson and the rule's own; `failed` and `why` are set by the caller. */
void HycoFlowUpdate(const HycoFlowRule *rule, HycoMaterialPoints *points);

/* In a law's create(): after HycoElasticDeclare() for young and poisson, and its own constants; the rule must be
   static. */
PetscErrorCode HycoFlowEnd(HycoMaterial material, const HycoFlowRule *rule);

#endif
