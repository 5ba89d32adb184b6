/*
  Primary creep with strain hardening: at a constant stress p = rate q^exponent t^time_exponent; under a varying stress,
  the rate depends on the accumulated strain and the current stress. A step treats the stress at its end as constant and
  is then exact: with m the time exponent,

    dp = (p0^(1/m) + dt (rate q^exponent)^(1/m))^m - p0
*/
#include <hycoflow.h>

/* -- begin: in exported models too -- */
enum { HARDENS_RATE, HARDENS_EXPONENT, HARDENS_TIME_EXPONENT, HARDENS_N_CONSTANTS };

/* scratch: p0^(1/m) */
static void StrainHardeningPrepare(HycoFlowPoint *p, const char **why)
{
  (void)why;
  p->scratch[0] = PetscPowReal(p->creep0, 1 / p->c[HARDENS_TIME_EXPONENT]);
}

/* log1p and expm1 where the step is small against p0, since the difference of two powers would cancel. */
static PetscReal StrainHardeningCreep(const HycoFlowPoint *p, PetscReal q, PetscReal *slope)
{
  const PetscReal m = p->c[HARDENS_TIME_EXPONENT], before = p->scratch[0];
  const PetscReal more = p->dt * PetscPowReal(p->c[HARDENS_RATE] * PetscPowReal(q, p->c[HARDENS_EXPONENT]), 1 / m);
  PetscReal after;

  if (!(more > 0)) {
    /* The power law's derivative: d more / d q = exponent / m * more / q, and after' = m after / (before + more). */
    *slope = 0;
    return 0;
  }
  after = PetscPowReal(before + more, m);
  *slope = p->c[HARDENS_EXPONENT] * more * after / ((before + more) * q);
  return before > more ? p->creep0 * expm1(m * log1p(more / before)) : after - p->creep0;
}

const HycoFlowRule HycoFlowStrainHardening = {.n_constants = HARDENS_N_CONSTANTS,
                                              .hardens = PETSC_TRUE,
                                              .prepare = StrainHardeningPrepare,
                                              .creep = StrainHardeningCreep};
/* -- end: in exported models too -- */

/* Without an integral of creep, which has no closed form: the law has no potential. */
PetscErrorCode HycoMaterialCreate_StrainHardening(HycoMaterial material)
{
  PetscFunctionBegin;
  PetscCall(HycoElasticDeclare(material));
  PetscCall(HycoMaterialDeclare(material, "rate", "the creep strain at the stress 1 after the time 1", HYCO_REQUIRED,
                                HYCO_NOT_NEGATIVE, PETSC_INFINITY));
  PetscCall(HycoMaterialDeclare(material, "exponent", "the creep exponent", HYCO_REQUIRED, HYCO_FROM_ONE, 100));
  PetscCall(HycoMaterialDeclare(material, "time_exponent", "the exponent of time", HYCO_REQUIRED, 0, HYCO_TO_ONE));
  PetscCall(HycoFlowEnd(material, &HycoFlowStrainHardening));
  PetscFunctionReturn(PETSC_SUCCESS);
}
