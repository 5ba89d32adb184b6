/* Rate-independent plasticity: von Mises, isotropic hardening Y(p) = yield + hardening p + saturation (1 - exp(-rate
   p)). */
#include <hycoflow.h>

enum { YIELD, HARDENING, SATURATION, RATE, N_CONSTANTS };

/* Y(p) and its slope. */
static PetscReal Yield(const HycoFlowPoint *p, PetscReal x, PetscReal *slope)
{
  const PetscReal left = p->c[SATURATION] > 0 ? p->c[SATURATION] * PetscExpReal(-p->c[RATE] * x) : 0;

  *slope = p->c[HARDENING] + p->c[RATE] * left;
  return p->c[YIELD] + p->c[HARDENING] * x + (p->c[SATURATION] - left);
}

/* Integral of Y from plastic0 to plastic0 + dp; expm1 for small steps. */
static PetscReal YieldIntegral(const HycoFlowPoint *p, PetscReal dp)
{
  const PetscReal r = p->c[RATE], left = PetscExpReal(-r * p->plastic0);
  PetscReal sum = dp * (p->c[YIELD] + p->c[HARDENING] * (p->plastic0 + dp / 2));

  if (r > 0) sum += p->c[SATURATION] * (dp + left * expm1(-r * dp) / r);
  return sum;
}

/* Without hardening and saturation perfect plasticity, whose tangent is singular along the flow: allowed, since the
   structure may still carry the load. */
PetscErrorCode HycoMaterialCreate_J2(HycoMaterial material)
{
  static const HycoFlowRule rule = {.n_constants = N_CONSTANTS, .yield = Yield, .yield_integral = YieldIntegral};

  PetscFunctionBegin;
  PetscCall(HycoElasticDeclare(material));
  PetscCall(HycoMaterialDeclare(material, "yield", "the yield stress", HYCO_REQUIRED, 0, PETSC_INFINITY));
  PetscCall(HycoMaterialDeclare(material, "hardening", "the hardening modulus", 0, HYCO_NOT_NEGATIVE, PETSC_INFINITY));
  PetscCall(HycoMaterialDeclare(material, "saturation", "the saturation stress of Voce's hardening", 0,
                                HYCO_NOT_NEGATIVE, PETSC_INFINITY));
  PetscCall(HycoMaterialDeclare(material, "rate", "the rate of Voce's hardening with plastic strain", 0,
                                HYCO_NOT_NEGATIVE, PETSC_INFINITY));
  PetscCall(HycoFlowEnd(material, &rule));
  PetscFunctionReturn(PETSC_SUCCESS);
}
