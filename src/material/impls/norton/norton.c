/* Norton creep, rate q^exponent in time; with a yield stress, J2 plasticity with linear hardening in addition. */
#include <hycoflow.h>

enum { RATE, EXPONENT, YIELD, HARDENING, N_CONSTANTS };

/* dp = dt rate q^exponent; q > 0 here. */
static PetscReal Creep(const HycoFlowPoint *p, PetscReal q, PetscReal *slope)
{
  const PetscReal dp = p->dt * p->c[RATE] * PetscPowReal(q, p->c[EXPONENT]);

  *slope = p->c[EXPONENT] * dp / q;
  return dp;
}

/* Integral of dp over q, for the incremental potential. */
static PetscReal CreepIntegral(const HycoFlowPoint *p, PetscReal q)
{
  return p->dt * p->c[RATE] * PetscPowReal(q, p->c[EXPONENT]) * q / (p->c[EXPONENT] + 1);
}

/* Negative: no yield stress. */
static PetscReal Yield(const HycoFlowPoint *p, PetscReal x, PetscReal *slope)
{
  *slope = p->c[HARDENING];
  return p->c[YIELD] < 0 ? -1 : p->c[YIELD] + p->c[HARDENING] * x;
}

/* Of the linear Y, exact: yield dp + hardening (p0 dp + dp^2 / 2). */
static PetscReal YieldIntegral(const HycoFlowPoint *p, PetscReal dp)
{
  return dp * (p->c[YIELD] + p->c[HARDENING] * (p->plastic0 + dp / 2));
}

/* The exponent is at least 1: below, the slope of the creep rate is infinite at q = 0. */
PetscErrorCode HycoMaterialCreate_Norton(HycoMaterial material)
{
  static const HycoFlowRule rule = {.n_constants = N_CONSTANTS,
                                    .creep = Creep,
                                    .creep_integral = CreepIntegral,
                                    .yield = Yield,
                                    .yield_integral = YieldIntegral};

  PetscFunctionBegin;
  PetscCall(HycoElasticDeclare(material));
  PetscCall(HycoMaterialDeclare(material, "rate", "the creep rate at the stress 1", HYCO_REQUIRED, HYCO_NOT_NEGATIVE,
                                PETSC_INFINITY));
  PetscCall(HycoMaterialDeclare(material, "exponent", "the creep exponent", HYCO_REQUIRED, HYCO_FROM_ONE, 100));
  PetscCall(HycoMaterialDeclare(material, "yield", "the yield stress", -1, 0, PETSC_INFINITY)); /* -1: none */
  PetscCall(HycoMaterialDeclare(material, "hardening", "the hardening modulus", 0, HYCO_NOT_NEGATIVE, PETSC_INFINITY));
  PetscCall(HycoFlowEnd(material, &rule));
  PetscFunctionReturn(PETSC_SUCCESS);
}
