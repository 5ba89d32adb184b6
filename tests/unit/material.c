/* Material laws: `elastic` compared with Hooke's law, and a history-dependent law through the same interface, a
   Maxwell element in 1D: at constant strain n steps of implicit Euler give the stress E eps / (1 + E A dt)^n. */
#include "check.h"
#include <hycofe.h>
#include <hycomaterialimpl.h>

static PetscErrorCode UpdateMaxwell(HycoMaterial law, HycoMaterialPoints *p)
{
  const PetscReal *young = p->constant[0], *rate = p->constant[1];

  PetscFunctionBegin;
  (void)law;
  for (PetscInt i = 0; i < p->n; i++) {
    const PetscReal tangent = young[i] / (1 + young[i] * rate[i] * p->dt);

    p->stress[i] = tangent * (p->strain[i] - p->state0[i]);
    p->state[i] = p->state0[i] + p->dt * rate[i] * p->stress[i];
    if (p->tangent) p->tangent[i] = tangent;
    if (p->dt > 10) p->dt_factor = 0.5;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The tangent does not depend on `shift`. */
static PetscBool DependsMaxwell(HycoMaterial law, const PetscBool changed[])
{
  (void)law;
  return (PetscBool)(changed[0] || changed[1]);
}

static PetscErrorCode CreateMaxwell(HycoMaterial law)
{
  static const struct _HycoMaterialOps ops = {.update = UpdateMaxwell, .depends = DependsMaxwell};

  PetscFunctionBegin;
  PetscCall(HycoMaterialDeclare(law, "young", "Young's modulus", HYCO_REQUIRED, 0, PETSC_INFINITY));
  PetscCall(HycoMaterialDeclare(law, "rate", "strain rate by stress", HYCO_REQUIRED, 0, PETSC_INFINITY));
  PetscCall(HycoMaterialDeclare(law, "shift", "a strain without stress", 0, -1, 1));
  PetscCall(HycoMaterialSetStateSize(law, 1));
  PetscCall(HycoMaterialSetLinear(law, PETSC_FALSE));
  PetscCall(HycoMaterialSetOps(law, &ops));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Maxwell's law over several steps: stress, tangent and the factor of the next step. */
static PetscErrorCode TestMemory(void)
{
  const PetscReal young[2] = {100, 200}, rate[2] = {1e-3, 2e-3}, shift[2] = {0, 0}, strain[2] = {0.01, 0.02};
  const PetscReal *constant[3] = {young, rate, shift};
  PetscReal state[2][2] = {{0, 0}, {0, 0}}, stress[2], tangent[2];
  HycoMaterialPoints p = {
      .n = 2, .dim = 1, .n_strain = 1, .constant = constant, .dt = 0.5, .strain = strain, .stress = stress};
  HycoMaterial law;

  PetscFunctionBegin;
  PetscCall(HycoMaterialCreate(PETSC_COMM_SELF, &law));
  PetscCall(HycoMaterialSetType(law, "maxwell"));
  p.tangent = tangent;
  for (PetscInt step = 0; step < 8; step++) {
    p.state0 = state[step % 2];
    p.state = state[(step + 1) % 2];
    PetscCall(HycoMaterialUpdate(law, &p));
  }
  for (PetscInt i = 0; i < 2; i++) {
    const PetscReal q = 1 + young[i] * rate[i] * 0.5;

    CHECK_NEAR(stress[i], young[i] * strain[i] / PetscPowReal(q, 8), 1e-13);
    CHECK_NEAR(tangent[i], young[i] / q, 1e-12);
  }
  CHECK_NEAR(p.dt_factor, 1, 0);
  p.dt = 20;
  PetscCall(HycoMaterialUpdate(law, &p));
  CHECK_NEAR(p.dt_factor, 0.5, 0);
  PetscCall(HycoMaterialDestroy(&law));
  CHECK(!law, "Destroy clears the handle");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Hooke's law: stress and tangent by Lame's constants. */
static PetscErrorCode TestElastic(PetscInt dim)
{
  const PetscReal young = 210, poisson = 0.3, lambda = young * poisson / ((1 + poisson) * (1 - 2 * poisson)),
                  mu = young / (2 * (1 + poisson)), *constant[2] = {&young, &poisson};
  const PetscReal strain[6] = {1e-3, -2e-3, 5e-4, 3e-3, -1e-3, 2e-3};
  PetscReal stress[6], tangent[36];
  const PetscInt n = HycoStrainSize(dim);
  HycoMaterialPoints p = {.n = 1, .dim = dim, .n_strain = n, .constant = constant, .strain = strain, .stress = stress};
  HycoMaterial law;

  PetscFunctionBegin;
  PetscCall(HycoMaterialCreate(PETSC_COMM_SELF, &law));
  PetscCall(HycoMaterialSetType(law, HYCO_MATERIAL_ELASTIC));
  p.tangent = tangent;
  PetscCall(HycoMaterialUpdate(law, &p));
  for (PetscInt r = 0; r < n; r++) {
    PetscReal hooke = mu * strain[r], sum = 0;

    if (r < 3) hooke = lambda * (strain[0] + strain[1] + strain[2]) + 2 * mu * strain[r];
    if (dim == 1) hooke = young * strain[0];
    for (PetscInt c = 0; c < n; c++) sum += tangent[r * n + c] * strain[c];
    CHECK_NEAR(stress[r], hooke, 1e-13);
    CHECK_NEAR(sum, hooke, 1e-13);
  }
  PetscCall(HycoMaterialDestroy(&law));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static char *const keys[] = {"scene_parameters", "parameter_a_range", "body_rod_law",
                             "body_rod_young",   "body_rod_rate",     "body_rod_shift"};
static char *const values[] = {"a", "0,1", "maxwell", "100", "1e-3", "a/10"};

/* The law in a scene: which parameters affect the tangent; the library solves with linear laws. */
static PetscErrorCode TestScene(void)
{
  const PetscBool changed[1] = {PETSC_TRUE};
  PetscBool reaches[1];
  HycoScene scene;

  PetscFunctionBegin;
  PetscCall(HycoSceneFromEntries(PETSC_COMM_SELF, 6, keys, values, "/", &scene));
  CHECK(!HycoMaterialChanges(scene->body[0].law, changed), "shift reaches no tangent");
  HycoSceneReaches(scene, reaches);
  CHECK(!reaches[0], "a reaches no stiffness");
  CHECK_FAILS(HycoMaterialSetUp(scene->body[0].law, 1, HYCO_PLANE_STRAIN, PETSC_FALSE),
              "body rod: its law maxwell is history-dependent");
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PetscCall(HycoMaterialRegister("maxwell", CreateMaxwell));
  PetscCall(TestMemory());
  for (PetscInt dim = 1; dim <= 3; dim++) PetscCall(TestElastic(dim));
  PetscCall(TestScene());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
