/* Norton creep, rate q^exponent in time; with a yield stress, J2 plasticity with linear hardening in addition. */
#include <hycoflow.h>

/* -- begin: in exported models too -- */
enum { NORTON_RATE, NORTON_EXPONENT, NORTON_YIELD, NORTON_HARDENING, NORTON_N_CONSTANTS };

/* dp = dt rate q^exponent; q > 0 here. */
static PetscReal NortonCreep(const HycoFlowPoint *p, PetscReal q, PetscReal *slope)
{
  const PetscReal dp = p->dt * p->c[NORTON_RATE] * PetscPowReal(q, p->c[NORTON_EXPONENT]);

  *slope = p->c[NORTON_EXPONENT] * dp / q;
  return dp;
}

/* Integral of dp over q, for the incremental potential. */
static PetscReal NortonCreepIntegral(const HycoFlowPoint *p, PetscReal q)
{
  return p->dt * p->c[NORTON_RATE] * PetscPowReal(q, p->c[NORTON_EXPONENT]) * q / (p->c[NORTON_EXPONENT] + 1);
}

/* Negative: no yield stress. */
static PetscReal NortonYield(const HycoFlowPoint *p, PetscReal x, PetscReal *slope)
{
  *slope = p->c[NORTON_HARDENING];
  return p->c[NORTON_YIELD] < 0 ? -1 : p->c[NORTON_YIELD] + p->c[NORTON_HARDENING] * x;
}

/* Of the linear Y, exact: yield dp + hardening (p0 dp + dp^2 / 2). */
static PetscReal NortonYieldIntegral(const HycoFlowPoint *p, PetscReal dp)
{
  return dp * (p->c[NORTON_YIELD] + p->c[NORTON_HARDENING] * (p->plastic0 + dp / 2));
}

const HycoFlowRule HycoFlowNorton = {.n_constants = NORTON_N_CONSTANTS,
                                     .creep = NortonCreep,
                                     .creep_integral = NortonCreepIntegral,
                                     .yield = NortonYield,
                                     .yield_integral = NortonYieldIntegral};
/* -- end: in exported models too -- */

/* The exponent is at least 1: below, the slope of the creep rate is infinite at q = 0. */
PetscErrorCode HycoMaterialCreate_Norton(HycoMaterial material)
{
  PetscFunctionBegin;
  PetscCall(HycoElasticDeclare(material));
  PetscCall(HycoMaterialDeclare(material, "rate", "the creep rate at the stress 1", HYCO_REQUIRED, HYCO_NOT_NEGATIVE,
                                PETSC_INFINITY));
  PetscCall(HycoMaterialDeclare(material, "exponent", "the creep exponent", HYCO_REQUIRED, HYCO_FROM_ONE, 100));
  PetscCall(HycoMaterialDeclare(material, "yield", "the yield stress", -1, 0, PETSC_INFINITY)); /* -1: none */
  PetscCall(HycoMaterialDeclare(material, "hardening", "the hardening modulus", 0, HYCO_NOT_NEGATIVE, PETSC_INFINITY));
  PetscCall(HycoFlowEnd(material, &HycoFlowNorton));
  PetscFunctionReturn(PETSC_SUCCESS);
}
