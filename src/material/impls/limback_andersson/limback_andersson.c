/*
  Secondary thermal creep of Zircaloy after M. Limback, T. Andersson, ASTM STP 1295 (1996) 448-468 (stress-relieved):
  with the temperature T and the modulus E' = 1.148e5 - 59.9 T (MPa, unless the scene gives another)

      creep rate = rate E' / T sinh(factor q / E')^2 exp(-activation / (R T))
*/
#include <hycoflow.h>

/* -- begin: in exported models too -- */
#define GAS_CONSTANT 8.31446261815324 /* J / (mol K): exact by definition of the SI */

enum { LIMBACK_RATE, LIMBACK_FACTOR, LIMBACK_ACTIVATION, LIMBACK_MODULUS, LIMBACK_N_CONSTANTS };

/* scratch: dt rate E'/T exp(-Q/RT), factor / E'. What does not depend on q, once per point and step. */
static void LimbackAnderssonPrepare(HycoFlowPoint *p, const char **why)
{
  const PetscReal T = p->temperature, modulus = p->c[LIMBACK_MODULUS] < 0 ? 1.148e5 - 59.9 * T : p->c[LIMBACK_MODULUS];

  if (!(T > 0)) *why = "creep of Limback and Andersson needs a temperature above 0 K";
  /* Above about 1643 degrees C, far outside of the law's range. */
  if (!(modulus > 0)) *why = "the temperature is too high: the modulus 1.148e5 - 59.9 T is not positive";
  p->scratch[0] =
      *why ? 0
           : p->dt * p->c[LIMBACK_RATE] * modulus / T * PetscExpReal(-p->c[LIMBACK_ACTIVATION] / (GAS_CONSTANT * T));
  p->scratch[1] = *why ? 0 : p->c[LIMBACK_FACTOR] / modulus;
}

/* Creep strain of the step at q, and its derivative. */
static PetscReal LimbackAnderssonCreep(const HycoFlowPoint *p, PetscReal q, PetscReal *slope)
{
  /* cosh from sinh: one exponential fewer; both overflow to infinity, which the bracket of the iteration takes. */
  const PetscReal sh = sinh(p->scratch[1] * q), ch = PetscSqrtReal(1 + sh * sh);

  *slope = 2 * p->scratch[0] * p->scratch[1] * sh * ch;
  return p->scratch[0] * sh * sh;
}

/* sinh(2 x) / 4 - x / 2, by its series where the difference cancels. */
static PetscReal LimbackAnderssonCreepIntegral(const HycoFlowPoint *p, PetscReal q)
{
  const PetscReal x = p->scratch[1] * q, y = x * x;
  const PetscReal sum = x > 0.1 ? sinh(2 * x) / 4 - x / 2
                                : x * y * (1.0 / 3 + y * (1.0 / 15 + y * (2.0 / 315 + y * (1.0 / 2835 + y / 77962.5))));

  return x > 0 ? p->scratch[0] / p->scratch[1] * sum : 0;
}

const HycoFlowRule HycoFlowLimbackAndersson = {.n_constants = LIMBACK_N_CONSTANTS,
                                               .prepare = LimbackAnderssonPrepare,
                                               .creep = LimbackAnderssonCreep,
                                               .creep_integral = LimbackAnderssonCreepIntegral};
/* -- end: in exported models too -- */

/* The constants are those of the paper, for MPa and hours: a scene in other units must give rate and modulus. */
PetscErrorCode HycoMaterialCreate_LimbackAndersson(HycoMaterial material)
{
  PetscFunctionBegin;
  PetscCall(HycoElasticDeclare(material));
  PetscCall(
      HycoMaterialDeclare(material, "rate", "the creep rate (K / (MPa h))", 1.08e9, HYCO_NOT_NEGATIVE, PETSC_INFINITY));
  PetscCall(HycoMaterialDeclare(material, "factor", "the factor of the stress", 650, 0, PETSC_INFINITY));
  PetscCall(HycoMaterialDeclare(material, "activation", "the activation energy (J/mol)", 201000, HYCO_NOT_NEGATIVE,
                                PETSC_INFINITY));
  PetscCall(HycoMaterialDeclare(material, "modulus", "the modulus E' of creep", -1, 0, PETSC_INFINITY)); /* -1: a
                                                                                                            function
                                                                                                            of T */
  PetscCall(HycoMaterialSetHeat(material, PETSC_TRUE));
  PetscCall(HycoFlowEnd(material, &HycoFlowLimbackAndersson));
  PetscFunctionReturn(PETSC_SUCCESS);
}
