/*
  Points of the inelastic laws along paths with closed forms, one line for each row: name, computed, exact, bound in per
  cent (absolute where exact is 0). test_points cost prints instead the cost of a point in microseconds.
*/
#include <hyco.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#define MAX_STATE 16

/* A point of a law in 1D (strain and stress are scalars), or in 3D, under uniaxial stress. */
typedef struct {
  HycoMaterial law;
  PetscInt dim, ns;
  PetscReal constant[8], temperature;
  PetscReal strain[6], stress[6], state[MAX_STATE]; /* accepted */
} Point;

static PetscErrorCode Begin(const char type[], PetscInt dim, PetscInt n, const PetscReal constant[], Point *a)
{
  PetscFunctionBegin;
  PetscCall(PetscMemzero(a, sizeof(*a)));
  PetscCall(HycoMaterialCreate(PETSC_COMM_SELF, &a->law));
  PetscCall(HycoMaterialSetType(a->law, type));
  a->dim = dim;
  a->ns = dim == 1 ? 1 : 6;
  a->constant[0] = 1e5;
  a->constant[1] = 0.3;
  a->temperature = 623;
  for (PetscInt j = 0; j < n; j++) a->constant[2 + j] = constant[j];
  PetscFunctionReturn(0);
}

/* A step of time dt to a strain, from the accepted state; accept: it becomes the accepted state. */
static PetscErrorCode Step(Point *a, PetscReal dt, const PetscReal strain[], PetscBool accept, PetscReal stress[],
                           PetscReal tangent[])
{
  const PetscReal *constant[8];
  PetscReal state[MAX_STATE];
  HycoMaterialPoints p = {.n = 1,
                          .dim = a->dim,
                          .n_strain = a->ns,
                          .constant = constant,
                          .dt = dt,
                          .strain0 = a->strain,
                          .strain = strain,
                          .stress0 = a->stress,
                          .temperature0 = &a->temperature,
                          .temperature = &a->temperature,
                          .state0 = a->state,
                          .state = state,
                          .stress = stress,
                          .tangent = tangent};

  PetscFunctionBegin;
  for (PetscInt j = 0; j < 8; j++) constant[j] = &a->constant[j];
  PetscCall(HycoMaterialUpdate(a->law, &p));
  PetscCheck(p.failed < 0, PETSC_COMM_SELF, PETSC_ERR_USER, "the law fails: %s", p.why);
  if (!accept) PetscFunctionReturn(0);
  for (PetscInt c = 0; c < a->ns; c++) {
    a->strain[c] = strain[c];
    a->stress[c] = stress[c];
  }
  for (PetscInt k = 0; k < a->ns + 2; k++) a->state[k] = state[k];
  PetscFunctionReturn(0);
}

/* A step with a given strain along x (or, with held false, stress), and in 3D no transverse stress. */
static PetscErrorCode Uniaxial(Point *a, PetscReal dt, PetscBool held, PetscReal value)
{
  PetscReal strain[6], stress[6], C[36];

  const PetscReal elastic = (value - a->stress[0]) / a->constant[0]; /* distance from the yield surface, elastic or
                                                                        not */

  PetscFunctionBegin;
  for (PetscInt c = 0; c < 6; c++) strain[c] = a->strain[c] + (held || c > 2 ? 0 : c ? -0.3 * elastic : elastic);
  if (held) strain[0] = value;
  for (PetscInt k = 0; k < 60; k++) {
    PetscReal along, across = 0;

    PetscCall(Step(a, dt, strain, PETSC_FALSE, stress, C));
    if (a->dim == 1) {
      if (held) break;
      along = value - stress[0];
      strain[0] += along / C[0];
    } else if (held) { /* yy = zz = e */
      along = 0;
      across = -(stress[1] + stress[2]) / (C[7] + C[8] + C[13] + C[14]);
      strain[1] += across;
      strain[2] += across;
    } else { /* xx and yy = zz: two equations */
      const PetscReal m[4] = {C[0], C[1] + C[2], C[6] + C[12], C[7] + C[8] + C[13] + C[14]};
      const PetscReal r[2] = {value - stress[0], -(stress[1] + stress[2])}, det = m[0] * m[3] - m[1] * m[2];

      along = r[0];
      strain[0] += (m[3] * r[0] - m[1] * r[1]) / det;
      across = (m[0] * r[1] - m[2] * r[0]) / det;
      strain[1] += across;
      strain[2] += across;
    }
    if (fabs(along) <= 1e-13 * (1 + fabs(value)) && fabs(across) < 1e-17) break;
  }
  PetscCall(Step(a, dt, strain, PETSC_TRUE, stress, C));
  PetscFunctionReturn(0);
}

static void Row(const char name[], PetscReal computed, PetscReal exact, PetscReal bound)
{
  printf("%s\t%.17g\t%.17g\t%g\n", name, (double)computed, (double)exact, (double)bound);
}

/* Richardson's limit of f with errors in h, h^2, ... from steps h, h/2, h/4, ... */
#define LEVELS 7
static PetscReal Limit(PetscReal f[LEVELS])
{
  PetscReal power = 1;

  for (PetscInt k = 1; k < LEVELS; k++) {
    power *= 2;
    for (PetscInt j = LEVELS - 1; j >= k; j--) f[j] += (f[j] - f[j - 1]) / (power - 1);
  }
  return f[LEVELS - 1];
}

/* A value at the end of a path of n equal steps in time. */
typedef PetscErrorCode (*Path)(PetscInt dim, PetscInt n, PetscReal *value);

/* The order in time and the limit of small steps, in 1D and under uniaxial stress in 3D. */
static PetscErrorCode Rows(const char name[], Path path, PetscInt first, PetscReal exact)
{
  PetscFunctionBegin;
  for (PetscInt dim = 1; dim <= 3; dim += 2) {
    PetscReal f[LEVELS], coarse, fine;
    char line[128];

    for (PetscInt k = 0; k < LEVELS; k++) PetscCall((*path)(dim, first << k, &f[k]));
    coarse = fabs(f[LEVELS - 2] - exact);
    fine = fabs(f[LEVELS - 1] - exact);
    snprintf(line, sizeof(line), "%s, %dD, order in time", name, (int)dim);
    Row(line, log(coarse / fine) / log(2.0), 1, 2);
    snprintf(line, sizeof(line), "%s, %dD, limit of small steps", name, (int)dim);
    Row(line, Limit(f), exact, 1e-6);
  }
  PetscFunctionReturn(0);
}

/* Norton, constant strain: s = s0 (1 + (n-1) E A s0^(n-1) t)^(-1/(n-1)); s0 = 100, t = 1000. */
static const PetscReal norton[2] = {1e-14, 4}, steep[2] = {1e-30, 12};

static PetscErrorCode Relaxation(PetscInt dim, PetscInt n, const PetscReal constant[2], PetscReal *value)
{
  const PetscReal none[4] = {constant[0], constant[1], -1, 0};
  Point a;

  PetscFunctionBegin;
  PetscCall(Begin(HYCO_MATERIAL_NORTON, dim, 4, none, &a));
  PetscCall(Uniaxial(&a, 0, PETSC_TRUE, 1e-3));
  for (PetscInt k = 0; k < n; k++) PetscCall(Uniaxial(&a, 1000. / (PetscReal)n, PETSC_TRUE, 1e-3));
  *value = a.stress[0];
  PetscCall(HycoMaterialDestroy(&a.law));
  PetscFunctionReturn(0);
}

static PetscErrorCode Relaxation4(PetscInt dim, PetscInt n, PetscReal *value)
{
  PetscFunctionBegin;
  PetscCall(Relaxation(dim, n, norton, value));
  PetscFunctionReturn(0);
}

static PetscErrorCode Relaxation12(PetscInt dim, PetscInt n, PetscReal *value)
{
  PetscFunctionBegin;
  PetscCall(Relaxation(dim, n, steep, value));
  PetscFunctionReturn(0);
}

static PetscReal Relaxed(const PetscReal constant[2])
{
  const PetscReal n = constant[1], s0 = 100;

  return s0 * pow(1 + (n - 1) * 1e5 * constant[0] * pow(s0, n - 1) * 1000, -1 / (n - 1));
}

/* Strain hardening, n = 1, m = 1/2: p dp/dt = (A s)^2 / 2. At the stress s0 until p0 = A s0 sqrt(100), then relaxing
   with s = s0 - E (p - p0): (p0 + s0/E) (1/s - 1/s0) - ln(s0/s) / E = E A^2 t / 2. */
static PetscErrorCode RelaxationHardening(PetscInt dim, PetscInt n, PetscReal *value)
{
  const PetscReal constant[3] = {2e-7, 1, 0.5};
  Point a;

  PetscFunctionBegin;
  PetscCall(Begin(HYCO_MATERIAL_STRAIN_HARDENING, dim, 3, constant, &a));
  PetscCall(Uniaxial(&a, 100, PETSC_FALSE, 100));
  for (PetscInt k = 0; k < n; k++) PetscCall(Uniaxial(&a, 1000. / (PetscReal)n, PETSC_TRUE, a.strain[0]));
  *value = a.stress[0];
  PetscCall(HycoMaterialDestroy(&a.law));
  PetscFunctionReturn(0);
}

static PetscReal RelaxedHardening(void)
{
  const PetscReal E = 1e5, A = 2e-7, p0 = A * 100 * 10, right = E * A * A * 1000 / 2;
  PetscReal x = 1 / 60.; /* 1/s, by Newton */

  for (PetscInt k = 0; k < 100; k++)
    x -= ((p0 + 100 / E) * (x - 0.01) - log(100 * x) / E - right) / (p0 + 100 / E - 1 / (x * E));
  return 1 / x;
}

/* Limback-Andersson, constant strain: ds/dt = -E a sinh(b s)^2, coth(b s) - coth(b s0) = E a b t. */
static PetscErrorCode RelaxationSinh(PetscInt dim, PetscInt n, PetscReal *value)
{
  const PetscReal constant[4] = {1.08e9, 650, 201000, -1};
  Point a;

  PetscFunctionBegin;
  PetscCall(Begin(HYCO_MATERIAL_LIMBACK_ANDERSSON, dim, 4, constant, &a));
  PetscCall(Uniaxial(&a, 0, PETSC_TRUE, 2e-3));
  for (PetscInt k = 0; k < n; k++) PetscCall(Uniaxial(&a, 1000. / (PetscReal)n, PETSC_TRUE, 2e-3));
  *value = a.stress[0];
  PetscCall(HycoMaterialDestroy(&a.law));
  PetscFunctionReturn(0);
}

static PetscReal RelaxedSinh(void)
{
  const PetscReal T = 623, modulus = 1.148e5 - 59.9 * T, b = 650 / modulus,
                  rate = 1.08e9 * modulus / T * exp(-201000 / (8.31446261815324 * T));

  return atanh(1 / (1 / tanh(b * 200) + 1e5 * rate * b * 1000)) / b;
}

/* Maxwell with n = 1 at a constant strain rate: s = eps' / A (1 - exp(-E A t)). */
static PetscErrorCode Pulled(PetscInt dim, PetscInt n, PetscReal *value)
{
  const PetscReal constant[4] = {2e-8, 1, -1, 0};
  Point a;

  PetscFunctionBegin;
  PetscCall(Begin(HYCO_MATERIAL_NORTON, dim, 4, constant, &a));
  for (PetscInt k = 1; k <= n; k++)
    PetscCall(Uniaxial(&a, 1000. / (PetscReal)n, PETSC_TRUE, 2e-3 * (PetscReal)k / (PetscReal)n));
  *value = a.stress[0];
  PetscCall(HycoMaterialDestroy(&a.law));
  PetscFunctionReturn(0);
}

/* Creep at a constant stress: exact at any step. */
static PetscErrorCode Creep(void)
{
  static const struct {
    const char *type, *name;
    PetscReal constant[4], exact;
  } law[] = {
      {"norton", "Norton n = 4", {1e-12, 4, -1, 0}, 1e-12 * 1e8 * 1000},
      {"norton", "Norton n = 12", {1e-30, 12, -1, 0}, 1e-30 * 1e24 * 1000},
      {"strain_hardening", "strain hardening", {1e-12, 4, 0.5, 0}, 1e-12 * 1e8 * 31.622776601683793},
      {"limback_andersson", "Limback-Andersson", {1.08e9, 650, 201000, -1}, 0},
  };

  PetscFunctionBegin;
  for (PetscInt k = 0; k < 4; k++) {
    for (PetscInt dim = 1; dim <= 3; dim += 2) {
      const PetscReal T = 623, modulus = 1.148e5 - 59.9 * T, sh = sinh(650 * 100 / modulus);
      const PetscReal exact =
          k < 3 ? law[k].exact : 1000 * 1.08e9 * modulus / T * sh * sh * exp(-201000 / (8.31446261815324 * T));
      char line[128];
      Point a;

      PetscCall(Begin(law[k].type, dim, 4, law[k].constant, &a));
      PetscCall(Uniaxial(&a, 0, PETSC_FALSE, 100));
      for (PetscInt j = 0; j < 10; j++) PetscCall(Uniaxial(&a, 100, PETSC_FALSE, 100));
      snprintf(line, sizeof(line), "steady creep, %s, %dD: strain in 10 steps", law[k].name, (int)dim);
      Row(line, a.strain[0] - 1e-3, exact, 1e-6);
      if (dim == 3)
        Row("the same across, over the strain along", (a.strain[1] + 3e-4) / (a.strain[0] - 1e-3), -0.5, 1e-6);
      PetscCall(HycoMaterialDestroy(&a.law));
    }
  }
  PetscFunctionReturn(0);
}

/* J2 in tension, and in tension, compression and tension again: isotropic hardening by the accumulated plastic
   strain, exact at any step. With Voce's hardening the strain at a given stress is known: p = -ln(1 - (s - Y)/S)/r. */
static PetscErrorCode Plastic(void)
{
  const PetscReal linear[4] = {250, 2000, 0, 0}, perfect[4] = {250, 0, 0, 0}, voce[4] = {250, 0, 100, 50};
  const PetscReal E = 1e5, H = 2000, Et = E * H / (E + H);

  PetscFunctionBegin;
  for (PetscInt dim = 1; dim <= 3; dim += 2) {
    PetscReal top, low, p;
    char line[128];
    Point a;

    PetscCall(Begin(HYCO_MATERIAL_J2, dim, 4, linear, &a));
    for (PetscInt k = 1; k <= 5; k++) PetscCall(Uniaxial(&a, 1, PETSC_TRUE, 2e-3 * (PetscReal)k));
    top = 250 + Et * (0.01 - 250 / E);
    snprintf(line, sizeof(line), "J2, linear hardening, %dD: pulled to 1 %%", (int)dim);
    Row(line, a.stress[0], top, 1e-6);
    for (PetscInt k = 1; k <= 4; k++) PetscCall(Uniaxial(&a, 1, PETSC_TRUE, 0.01 - 5e-3 * (PetscReal)k));
    low = -(top + Et * (0.02 - 2 * top / E)); /* it yields at -top */
    snprintf(line, sizeof(line), "J2, linear hardening, %dD: then pushed to -1 %%", (int)dim);
    Row(line, a.stress[0], low, 1e-6);
    PetscCall(Uniaxial(&a, 1, PETSC_TRUE, 0.005));
    snprintf(line, sizeof(line), "J2, linear hardening, %dD: and pulled to 0.5 %%", (int)dim);
    Row(line, a.stress[0], -low + Et * (0.015 + 2 * low / E), 1e-6);
    PetscCall(HycoMaterialDestroy(&a.law));

    PetscCall(Begin(HYCO_MATERIAL_J2, dim, 4, perfect, &a));
    for (PetscInt k = 1; k <= 5; k++) PetscCall(Uniaxial(&a, 1, PETSC_TRUE, 2e-3 * (PetscReal)k));
    snprintf(line, sizeof(line), "J2, perfect, %dD: pulled to 1 %%", (int)dim);
    Row(line, a.stress[0], 250, 1e-6);
    PetscCall(HycoMaterialDestroy(&a.law));

    PetscCall(Begin(HYCO_MATERIAL_J2, dim, 4, voce, &a));
    for (PetscInt k = 1; k <= 4; k++) PetscCall(Uniaxial(&a, 1, PETSC_FALSE, 330 * (PetscReal)k / 4));
    p = -log(1 - 0.8) / 50;
    snprintf(line, sizeof(line), "J2, Voce, %dD: strain at 330", (int)dim);
    Row(line, a.strain[0], 330 / E + p, 1e-6);
    for (PetscInt k = 0; k <= 34; k++) /* to -340, with p as in tension up to 340 */
      PetscCall(Uniaxial(&a, 1, PETSC_FALSE, -10 * (PetscReal)k));
    snprintf(line, sizeof(line), "J2, Voce, %dD: strain at -340 after it", (int)dim);
    Row(line, a.strain[0], -340 / E + p - (-log(1 - 0.9) / 50 - p), 1e-6);
    PetscCall(HycoMaterialDestroy(&a.law));
  }
  PetscFunctionReturn(0);
}

/* Norton with a yield stress: at a constant strain beyond yield, it relaxes from the yield stress like Norton alone;
   at a constant strain rate, perfect plasticity takes the part that creep at the yield stress does not. */
static PetscErrorCode Both(void)
{
  const PetscReal constant[4] = {1e-14, 4, 200, 0};

  PetscFunctionBegin;
  for (PetscInt dim = 1; dim <= 3; dim += 2) {
    char line[128];
    Point a;

    PetscCall(Begin(HYCO_MATERIAL_NORTON, dim, 4, constant, &a));
    for (PetscInt k = 1; k <= 100; k++) PetscCall(Uniaxial(&a, 0.1, PETSC_TRUE, 1e-4 * (PetscReal)k));
    snprintf(line, sizeof(line), "Norton and J2, perfect, %dD: pulled to 1 %% fast", (int)dim);
    Row(line, a.stress[0], 200, 1e-6);
    snprintf(line, sizeof(line), "the same: creep and plastic strain, %dD", (int)dim);
    Row(line, a.state[a.ns] + a.state[a.ns + 1], 0.01 - 2e-3, 1e-6);
    PetscCall(HycoMaterialDestroy(&a.law));
  }
  PetscFunctionReturn(0);
}

static double Seconds(void)
{
  struct timespec t;

  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Microseconds per point for stress, state and tangent in 3D, 1000 points at a time; most deform inelastically, by
   less than 1e-2. */
static PetscErrorCode Cost(const char type[], const char name[], PetscInt n_constants, const PetscReal own[])
{
  enum { N = 1000 };
  static PetscReal value[8][N], strain[N][6], state[N][MAX_STATE], stress[N][6], tangent[N][36], zero[N][MAX_STATE],
      T[N];
  const PetscReal *constant[8];
  PetscReal best = 1e9;
  Point a;
  HycoMaterialPoints p = {.n = N,
                          .dim = 3,
                          .n_strain = 6,
                          .constant = constant,
                          .dt = 0.1,
                          .strain0 = zero[0],
                          .strain = strain[0],
                          .stress0 = zero[0],
                          .temperature0 = T,
                          .temperature = T,
                          .state0 = zero[0],
                          .state = state[0],
                          .stress = stress[0],
                          .tangent = tangent[0]};

  PetscFunctionBegin;
  PetscCall(Begin(type, 3, n_constants, own, &a));
  for (PetscInt i = 0; i < N; i++) {
    T[i] = a.temperature;
    for (PetscInt j = 0; j < 8; j++) value[j][i] = a.constant[j];
    for (PetscInt c = 0; c < 6; c++) strain[i][c] = 2e-3 * sin((double)(7 * i + 3 * c + 1));
  }
  for (PetscInt j = 0; j < 8; j++) constant[j] = value[j];
  for (PetscInt k = 0; k < 50; k++) {
    double t = Seconds();

    PetscCall(HycoMaterialUpdate(a.law, &p));
    t = Seconds() - t;
    if (t < best) best = t;
  }
  printf("%s: %.3f us a point\n", name, 1e6 * (double)best / N);
  PetscCall(HycoMaterialDestroy(&a.law));
  PetscFunctionReturn(0);
}

static PetscErrorCode Costs(void)
{
  const PetscReal j2[4] = {250, 2000, 0, 0}, voce[4] = {250, 500, 120, 40}, plain[4] = {1e-12, 4, -1, 0},
                  twelve[4] = {1e-30, 12, -1, 0}, both[4] = {1e-13, 3.419, 200, 2000}, hardening[3] = {1e-12, 4, 0.5},
                  zircaloy[4] = {1.08e9, 650, 201000, -1};

  PetscFunctionBegin;
  PetscCall(Cost(HYCO_MATERIAL_J2, "J2, linear hardening", 4, j2));
  PetscCall(Cost(HYCO_MATERIAL_J2, "J2, Voce", 4, voce));
  PetscCall(Cost(HYCO_MATERIAL_NORTON, "Norton n = 4", 4, plain));
  PetscCall(Cost(HYCO_MATERIAL_NORTON, "Norton n = 12", 4, twelve));
  PetscCall(Cost(HYCO_MATERIAL_NORTON, "Norton n = 3.419 and J2", 4, both));
  PetscCall(Cost(HYCO_MATERIAL_STRAIN_HARDENING, "strain hardening", 3, hardening));
  PetscCall(Cost(HYCO_MATERIAL_LIMBACK_ANDERSSON, "Limback-Andersson", 4, zircaloy));
  PetscFunctionReturn(0);
}

static PetscErrorCode Run(PetscBool cost)
{
  PetscFunctionBegin;
  if (cost) {
    PetscCall(Costs());
    PetscFunctionReturn(0);
  }
  PetscCall(Rows("relaxation, Norton n = 4", Relaxation4, 64, Relaxed(norton)));
  PetscCall(Rows("relaxation, Norton n = 12", Relaxation12, 64, Relaxed(steep)));
  PetscCall(Rows("relaxation, strain hardening", RelaxationHardening, 64, RelaxedHardening()));
  PetscCall(Rows("relaxation, Limback-Andersson", RelaxationSinh, 64, RelaxedSinh()));
  PetscCall(Rows("pulled evenly, Maxwell", Pulled, 64, 2e-6 / 2e-8 * -expm1(-1e5 * 2e-8 * 1000)));
  PetscCall(Creep());
  PetscCall(Plastic());
  PetscCall(Both());
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscCall(HycoInitialize(&argc, &argv));
  PetscCall(Run((PetscBool)(argc > 1 && strcmp(argv[1], "cost") == 0)));
  return (int)HycoFinalize();
}
