/*
  The inelastic laws at points: tangents compared with differences of the stress, stresses with those of the potential,
  the scalar equation, the same bits in batches of any size, far trial states, refusals.
*/
#include "check.h"
#include <hycomaterialimpl.h>

#define ROOM 40 /* reals of a point's state or tangent */

typedef struct {
  const char *type;
  PetscReal constant[6];           /* after young and poisson, in the order of their declaration */
  PetscReal temperature, dt, size; /* size of strains that cause inelastic flow */
  PetscBool potential;
} Case;

static const Case cases[] = {
    {"j2", {250, 0, 0, 0}, 0, 1, 4e-3, PETSC_TRUE},
    {"j2", {250, 2000, 0, 0}, 0, 1, 4e-3, PETSC_TRUE},
    {"j2", {250, 500, 120, 40}, 0, 1, 4e-3, PETSC_TRUE},
    {"norton", {1e-12, 4, -1, 0}, 0, 100, 4e-3, PETSC_TRUE},
    {"norton", {2e-4, 1, -1, 0}, 0, 3, 4e-3, PETSC_TRUE},
    {"norton", {1e-33, 12, -1, 0}, 0, 1e4, 4e-3, PETSC_TRUE},
    {"norton", {1e-12, 4, 150, 2000}, 0, 10, 4e-3, PETSC_TRUE},
    {"norton", {1e-13, 3.4, 150, 0}, 0, 10, 4e-3, PETSC_TRUE},
    {"strain_hardening", {1e-12, 4, 0.5}, 0, 100, 4e-3, PETSC_FALSE},
    {"limback_andersson", {1.08e9, 650, 201000, -1}, 650, 10, 4e-3, PETSC_TRUE},
};
#define N_CASES ((PetscInt)(sizeof(cases) / sizeof(cases[0])))

/* A law and one point of it, with constants of the case. */
typedef struct {
  HycoMaterial law;
  PetscInt dim, ns, n_state;
  PetscReal constant[8], temperature, state0[ROOM], stress0[6], strain0[6];
  const PetscReal *constants[8];
  HycoMaterialPoints p;
  PetscReal strain[6], stress[6], state[ROOM], tangent[36], stored, dissipated, increment, potential;
} One;

static PetscErrorCode Begin(const Case *c, PetscInt dim, One *o)
{
  PetscFunctionBegin;
  PetscCall(PetscMemzero(o, sizeof(*o)));
  PetscCall(HycoMaterialCreate(PETSC_COMM_SELF, &o->law));
  PetscCall(HycoMaterialSetType(o->law, c->type));
  PetscCall(HycoMaterialSetUp(o->law, dim, HYCO_PLANE_STRAIN, PETSC_TRUE));
  o->dim = dim;
  o->ns = HycoStrainSize(dim);
  o->n_state = o->law->n_state;
  o->constant[0] = 1e5;
  o->constant[1] = 0.3;
  for (PetscInt j = 0; j < 6; j++) o->constant[2 + j] = c->constant[j];
  for (PetscInt j = 0; j < 8; j++) o->constants[j] = &o->constant[j];
  o->temperature = c->temperature;
  o->p = (HycoMaterialPoints){.n = 1,
                              .dim = dim,
                              .n_strain = o->ns,
                              .constant = o->constants,
                              .dt = c->dt,
                              .strain0 = o->strain0,
                              .strain = o->strain,
                              .stress0 = o->stress0,
                              .temperature0 = &o->temperature,
                              .temperature = &o->temperature,
                              .state0 = o->state0,
                              .state = o->state,
                              .stress = o->stress,
                              .tangent = o->tangent,
                              .stored = &o->stored,
                              .dissipated = &o->dissipated,
                              .increment = &o->increment,
                              .potential = &o->potential};
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Draws a strain of the size, and takes a step: the state becomes the begin of the next one. */
static PetscErrorCode Drawn(One *o, PetscReal size, unsigned long long *seed)
{
  PetscFunctionBegin;
  for (PetscInt c = 0; c < o->ns; c++) o->strain[c] = size * Draw(seed);
  PetscCall(HycoMaterialUpdate(o->law, &o->p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Accept(One *o)
{
  PetscFunctionBegin;
  PetscCall(PetscArraycpy(o->state0, o->state, o->n_state));
  PetscCall(PetscArraycpy(o->stress0, o->stress, o->ns));
  PetscCall(PetscArraycpy(o->strain0, o->strain, o->ns));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Central differences of stress and potential by strain; points within a step of the yield surface are skipped. */
static PetscErrorCode TestTangent(const Case *c, PetscInt dim)
{
  unsigned long long seed = 7;
  PetscReal worst = 0, worst_stress = 0;
  PetscInt flowed = 0;
  One o;

  PetscFunctionBegin;
  PetscCall(Begin(c, dim, &o));
  for (PetscInt k = 0; k < 20; k++) {
    PetscReal tangent[36], stress[6], increment;
    const PetscReal h = 1e-6 * c->size;

    PetscCall(Drawn(&o, k % 4 ? c->size : c->size / 20, &seed));
    PetscCall(PetscArraycpy(tangent, o.tangent, o.ns * o.ns));
    PetscCall(PetscArraycpy(stress, o.stress, o.ns));
    increment = o.increment;
    flowed += increment > 0;
    for (PetscInt j = 0; j < o.ns; j++) {
      const PetscReal at = o.strain[j];
      PetscReal side[2][6], potential[2], flow[2];

      for (PetscInt s = 0; s < 2; s++) {
        o.strain[j] = at + (s ? h : -h);
        PetscCall(HycoMaterialUpdate(o.law, &o.p));
        PetscCall(PetscArraycpy(side[s], o.stress, o.ns));
        potential[s] = o.potential;
        flow[s] = o.increment;
      }
      o.strain[j] = at;
      if ((flow[0] > 0) != (flow[1] > 0)) continue;
      for (PetscInt r = 0; r < o.ns; r++)
        worst = PetscMax(worst, PetscAbsReal((side[1][r] - side[0][r]) / (2 * h) - tangent[r * o.ns + j]) / 1e5);
      if (c->potential)
        worst_stress = PetscMax(worst_stress, PetscAbsReal((potential[1] - potential[0]) / (2 * h) - stress[j]) / 250);
    }
    PetscCall(HycoMaterialUpdate(o.law, &o.p));
    if (k % 3 == 0) PetscCall(Accept(&o));
  }
  CHECK(flowed >= 5, "%s flows in %d steps of 20", c->type, (int)flowed);
  CHECK(worst <= 1e-6, "%s in %dD: its tangent misses the differences by %g", c->type, (int)dim, (double)worst);
  CHECK(worst_stress <= 1e-6, "%s in %dD: its stress misses the potential's by %g", c->type, (int)dim,
        (double)worst_stress);
  PetscCall(HycoMaterialDestroy(&o.law));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Far from the yield surface, and with trial stresses that overflow creep: the flow rule is satisfied. */
static PetscErrorCode TestFar(const Case *c)
{
  One o;

  PetscFunctionBegin;
  PetscCall(Begin(c, 3, &o));
  for (PetscReal size = 1e-9; size < 1e3; size *= 10) {
    PetscReal q = 0, trial = 3e5 / 2.6 * size;

    o.strain[3] = PetscSqrtReal(3.0) * size; /* shear: q_tr = sqrt3 G gamma */
    PetscCall(HycoMaterialUpdate(o.law, &o.p));
    q = PetscSqrtReal(3.0) * o.stress[3];
    CHECK(o.p.failed < 0 && q >= 0 && q <= trial * (1 + 1e-14), "%s at the strain %g: q = %g, trial %g", c->type,
          (double)size, (double)q, (double)trial);
    CHECK_NEAR((q + 3e5 / 2.6 * o.increment) / trial, 1, 1e-8);
    if (strcmp(c->type, "norton") == 0 && c->constant[2] < 0)
      CHECK_NEAR(o.increment / (c->dt * c->constant[0] * PetscPowReal(q, c->constant[1])), 1, 1e-12);
    for (PetscInt k = 0; k < 36; k++) CHECK(PetscAbsReal(o.tangent[k]) < 1e6, "a tangent that is not finite");
  }
  PetscCall(HycoMaterialDestroy(&o.law));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define MANY 100000

/* The same points one by one, in odd batches and all at once. */
static PetscErrorCode TestBatches(const Case *c)
{
  static const PetscInt batches[] = {MANY, 1, 3, 64, 1000};
  const PetscInt few = 2000;
  PetscReal *block, *constant, *temperature, *strain, *zero, *out[5];
  const PetscReal *constants[8];
  unsigned long long seed = 3;
  PetscInt ns, n_state, size;
  One o;

  PetscFunctionBegin;
  PetscCall(Begin(c, 2, &o));
  ns = o.ns;
  n_state = o.n_state;
  size = ns + n_state + ns * ns;
  PetscCall(PetscMalloc1(MANY * (9 + ns), &block));
  PetscCall(PetscCalloc1(MANY * (n_state + 2 * ns), &zero));
  constant = block;
  temperature = block + 8 * MANY;
  strain = block + 9 * MANY;
  for (PetscInt i = 0; i < MANY; i++) {
    for (PetscInt j = 0; j < 8; j++) constant[j * MANY + i] = o.constant[j];
    temperature[i] = c->temperature;
    for (PetscInt k = 0; k < ns; k++) strain[i * ns + k] = c->size * Draw(&seed);
  }
  for (PetscInt b = 0; b < 5; b++) {
    const PetscInt n = b ? few : MANY;

    PetscCall(PetscMalloc1(n * size, &out[b]));
    for (PetscInt at = 0; at < n; at += batches[b]) {
      HycoMaterialPoints p = o.p;

      p.n = PetscMin(batches[b], n - at);
      for (PetscInt j = 0; j < 8; j++) constants[j] = constant + j * MANY + at;
      p.constant = constants;
      p.temperature = p.temperature0 = temperature + at;
      p.strain0 = p.stress0 = zero;
      p.strain = strain + at * ns;
      p.state0 = zero;
      p.stress = out[b] + at * ns;
      p.state = out[b] + n * ns + at * n_state;
      p.tangent = out[b] + n * (ns + n_state) + at * ns * ns;
      p.stored = p.dissipated = p.increment = p.potential = NULL;
      PetscCall(HycoMaterialUpdate(o.law, &p));
      CHECK(p.failed < 0, "%s failed", c->type);
    }
    for (PetscInt part = 0; b && part < 3; part++) {
      const PetscInt first[3] = {0, ns, ns + n_state}, width[3] = {ns, n_state, ns * ns};

      CHECK(memcmp(out[b] + first[part] * n, out[0] + first[part] * MANY, (size_t)(width[part] * n) * sizeof(**out)) ==
                0,
            "%s: a batch of %d has other bits", c->type, (int)batches[b]);
    }
  }
  for (PetscInt b = 0; b < 5; b++) PetscCall(PetscFree(out[b]));
  PetscCall(PetscFree(block));
  PetscCall(PetscFree(zero));
  PetscCall(HycoMaterialDestroy(&o.law));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static char *const keys[] = {"body_rod_law_type", "body_rod_law_rate",    "body_rod_law_exponent",
                             "body_rod_young",    "body_rod_temperature", "history_times",
                             "history_tables_q",  "body_rod_expansion",   "body_rod_reference_temperature"};
static char *const cold_keys[] = {"body_rod_law", "body_rod_young", "body_rod_yield", "body_rod_poisson"};
static char *const cold_values[] = {"j2", "1e5 - temperature", "250", "0.3"};
static char *const values[] = {"norton",  "1e-10*q", "4",  "1e5-10*temperature", "300+t", "0,1",
                               "0 1,1 2", "1e-5",    "293"};

/* Entries of a nested law; which changes affect the elastic tangent; constants outside their interval. */
static PetscErrorCode TestScene(void)
{
  const PetscBool t_alone[2] = {PETSC_TRUE, PETSC_FALSE}, q_alone[2] = {PETSC_FALSE, PETSC_TRUE};
  const PetscReal x[3] = {0, 0, 0}, T = 310;
  PetscReal work[8], mu[2] = {0, 1};
  const PetscReal *constant[8];
  HycoScene scene;
  HycoMaterial law;

  PetscFunctionBegin;
  PetscCall(HycoSceneFromEntries(PETSC_COMM_SELF, 9, keys, values, "/", &scene));
  law = scene->body[0].law;
  CHECK(HycoMaterialChanges(law, t_alone), "young depends on the temperature, and that on t");
  CHECK(!HycoMaterialChanges(law, q_alone), "the creep rate does not reach the elastic tangent");
  PetscCall(HycoMaterialConstants(law, mu, 1, x, &T, work, constant));
  CHECK_NEAR(constant[0][0], 1e5 - 3100, 1e-10);
  CHECK_NEAR(constant[2][0], 1e-10, 1e-24);
  mu[1] = -1;
  CHECK_FAILS(HycoMaterialConstants(law, mu, 1, x, &T, work, constant), "body_rod_law_rate is -1e-10");
  PetscCall(HycoSceneDestroy(&scene));
  CHECK_FAILS(HycoSceneFromEntries(PETSC_COMM_SELF, 4, cold_keys, cold_values, "/", &scene), "has no temperature");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < N_CASES; k++) {
    for (PetscInt dim = 1; dim <= 3; dim++) PetscCall(TestTangent(&cases[k], dim));
    PetscCall(TestFar(&cases[k]));
    PetscCall(TestBatches(&cases[k]));
  }
  PetscCall(TestScene());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
