/* Rate-independent plasticity: von Mises, isotropic hardening Y(p) = yield + hardening p + saturation (1 - exp(-rate
   p)). */
#include <hycoflow.h>

/* -- begin: in exported models too -- */
enum { J2_YIELD, J2_HARDENING, J2_SATURATION, J2_RATE, J2_N_CONSTANTS };

/* Y(p) and its slope. */
static PetscReal J2Yield(const HycoFlowPoint *p, PetscReal x, PetscReal *slope)
{
  const PetscReal left = p->c[J2_SATURATION] > 0 ? p->c[J2_SATURATION] * PetscExpReal(-p->c[J2_RATE] * x) : 0;

  *slope = p->c[J2_HARDENING] + p->c[J2_RATE] * left;
  return p->c[J2_YIELD] + p->c[J2_HARDENING] * x + (p->c[J2_SATURATION] - left);
}

/* Integral of Y from plastic0 to plastic0 + dp; expm1 for small steps. */
static PetscReal J2YieldIntegral(const HycoFlowPoint *p, PetscReal dp)
{
  const PetscReal r = p->c[J2_RATE], left = PetscExpReal(-r * p->plastic0);
  PetscReal sum = dp * (p->c[J2_YIELD] + p->c[J2_HARDENING] * (p->plastic0 + dp / 2));

  if (r > 0) sum += p->c[J2_SATURATION] * (dp + left * expm1(-r * dp) / r);
  return sum;
}

const HycoFlowRule HycoFlowJ2 = {.n_constants = J2_N_CONSTANTS, .yield = J2Yield, .yield_integral = J2YieldIntegral};
/* -- end: in exported models too -- */

/* Without hardening and saturation perfect plasticity, whose tangent is singular along the flow: allowed, since the
   structure may still carry the load. */
PetscErrorCode HycoMaterialCreate_J2(HycoMaterial material)
{
  PetscFunctionBegin;
  PetscCall(HycoElasticDeclare(material));
  PetscCall(HycoMaterialDeclare(material, "yield", "the yield stress", HYCO_REQUIRED, 0, PETSC_INFINITY));
  PetscCall(HycoMaterialDeclare(material, "hardening", "the hardening modulus", 0, HYCO_NOT_NEGATIVE, PETSC_INFINITY));
  PetscCall(HycoMaterialDeclare(material, "saturation", "the saturation stress of Voce's hardening", 0,
                                HYCO_NOT_NEGATIVE, PETSC_INFINITY));
  PetscCall(HycoMaterialDeclare(material, "rate", "the rate of Voce's hardening with plastic strain", 0,
                                HYCO_NOT_NEGATIVE, PETSC_INFINITY));
  PetscCall(HycoFlowEnd(material, &HycoFlowJ2));
  PetscFunctionReturn(PETSC_SUCCESS);
}
