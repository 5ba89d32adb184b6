/*
  A shared library written by hand with the symbols of MFront's generic C interface (the symbols and structs listed in
  src/material/impls/mfront/mfront.c; MFront itself was not available): Norton's creep of exponent 1 with implicit
  Euler, which has a solution in closed form. Its symmetric tensors are xx, yy, zz, xy, xz, yz with shear times sqrt(2).
  Built with -DCRASH it crashes when it is loaded.
*/
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct begin {
  const double *gradients, *forces, *density, *properties, *internal, *stored, *dissipated, *external;
};
struct end {
  const double *gradients;
  double *forces;
  const double *density, *properties;
  double *internal, *stored, *dissipated;
  const double *external;
};
struct data {
  char *message;
  double dt, *K, *rdt, *speed_of_sound;
  struct begin s0;
  struct end s1;
};

/* sigma = bulk tr(eps) + 2 g dev(eps - creep0), g = G / (1 + 3 G A dt); creep = creep0 + 3/2 A dt s */
static int integrate(struct data *d, int n)
{
  const double E = d->s1.properties[0], nu = d->s1.properties[1], A = d->s1.properties[2];
  const double G = E / (2 * (1 + nu)), bulk = E / (3 * (1 - 2 * nu)), option = d->K[0];
  const double g = option < 0 ? G : G / (1 + 3 * G * A * d->dt);
  double trace = 0, mean = 0, stored = 0;

  if (A < 0) {
    strcpy(d->message, "the rate is negative");
    return -1;
  }
  for (int c = 0; c < 3; c++) {
    trace += d->s1.gradients[c];
    mean += (d->s1.gradients[c] - d->s0.internal[c]) / 3;
  }
  for (int c = 0; c < n && option >= 0; c++) {
    const double dev = 2 * g * (d->s1.gradients[c] - d->s0.internal[c] - (c < 3 ? mean : 0));

    d->s1.forces[c] = dev + (c < 3 ? bulk * trace : 0);
    d->s1.internal[c] = d->s0.internal[c] + 1.5 * A * d->dt * dev;
    stored += d->s1.forces[c] * (d->s1.gradients[c] - d->s1.internal[c]) / 2;
  }
  if (option >= 0) {
    d->s1.internal[n] = d->s0.internal[n] + d->dt;
    *d->s1.stored = stored;
  }
  for (int r = 0; r < n && option != 0; r++) {
    for (int c = 0; c < n; c++) d->K[r * n + c] = (r == c ? 2 * g : 0) + (r < 3 && c < 3 ? bulk - 2 * g / 3 : 0);
  }
  *d->rdt = 1;
  return 1;
}

#define BEHAVIOUR(name, version, interface)                                                                            \
  int name##_Tridimensional(struct data *d);                                                                           \
  int name##_PlaneStrain(struct data *d);                                                                              \
  int name##_Tridimensional(struct data *d)                                                                            \
  {                                                                                                                    \
    return integrate(d, 6);                                                                                            \
  }                                                                                                                    \
  int name##_PlaneStrain(struct data *d)                                                                               \
  {                                                                                                                    \
    return integrate(d, 4);                                                                                            \
  }                                                                                                                    \
  const char *name##_mfront_interface = interface;                                                                     \
  unsigned short name##_mfront_mkt = 1, name##_api_version = version, name##_BehaviourType = 1,                        \
                 name##_BehaviourKinematic = 1, name##_SymmetryType = 0, name##_nMaterialProperties = 3,               \
                 name##_nInternalStateVariables = 2, name##_nExternalStateVariables = 0,                               \
                 name##_ComputesInternalEnergy = 1, name##_requiresStiffnessTensor = 0,                                \
                 name##_requiresThermalExpansionCoefficientTensor = 0;                                                 \
  const char *name##_MaterialProperties[3] = {"YoungModulus", "PoissonRatio", "A"};                                    \
  const char *name##_InternalStateVariables[2] = {"CreepStrain", "Age"};                                               \
  int name##_InternalStateVariablesTypes[2] = {1, 0};                                                                  \
  const char *const *name##_ExternalStateVariables = 0

BEHAVIOUR(Maxwell, 1, "Generic");
BEHAVIOUR(Old, 0, "Generic");
BEHAVIOUR(Other, 1, "Cyrano");

#ifdef CRASH
__attribute__((constructor)) static void die(void)
{
  abort();
}
#endif
