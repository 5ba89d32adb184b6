/*
  A step of bodies with a history on small distorted meshes: nodal forces compared with differences of the potential,
  the tangent stiffness with differences of the forces, the identity of energies, restoring the elastic tangents, states
  and their copies.
*/
#include "check.h"
#include <hycoinelastic.h>
#include <hycomaterialimpl.h>
#include "patch.h"

typedef struct {
  HycoScene scene;
  HycoMesh mesh;
  HycoFE fe;
  HycoFEState begin, end;
  PetscReal *u, *f, *work;
  PetscReal mu[1]; /* t */
} Model;

static char *const keys[] = {"scene_mesh",
                             "body_block_young",
                             "body_block_poisson",
                             "body_block_law_type",
                             "body_block_law_rate",
                             "body_block_law_exponent",
                             "body_block_law_yield",
                             "body_block_law_hardening",
                             "body_block_element",
                             "body_block_temperature",
                             "body_block_reference_temperature",
                             "body_block_expansion",
                             "history_times"};
#define N_KEYS 13

static PetscErrorCode Load(const Patch *p, const char element[], Model *m)
{
  char path[256], name[16];
  char *values[N_KEYS] = {path, "1e5*(1 + 0*t)", "0.3", "norton", "1e-10", "3", "150", "2000",
                          name, "300 + 20*x",    "293", "1e-5",   "0,1,2"};

  PetscFunctionBegin;
  snprintf(path, sizeof(path), "/tmp/hyco_inelastic_%s_%ld.msh", p->name, (long)getpid());
  snprintf(name, sizeof(name), "%s", element);
  PetscCall(PatchWrite(p, path));
  PetscCall(HycoSceneFromEntries(PETSC_COMM_SELF, N_KEYS, keys, values, "/", &m->scene));
  PetscCall(HycoMeshCreate(PETSC_COMM_SELF, m->scene, &m->mesh));
  unlink(path);
  PetscCall(HycoFECreate(m->scene, m->mesh->dm, &m->fe));
  m->mu[0] = 1;
  PetscCall(HycoFESetParameters(m->fe, m->mu));
  PetscCall(HycoFEStateCreate(m->fe, &m->begin));
  PetscCall(HycoFEStateCreate(m->fe, &m->end));
  PetscCall(PetscCalloc3(m->fe->n_dof, &m->u, m->fe->n_dof, &m->f, m->fe->n_dof, &m->work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Free(Model *m)
{
  PetscFunctionBegin;
  PetscCall(PetscFree3(m->u, m->f, m->work));
  PetscCall(HycoFEStateDestroy(&m->begin));
  PetscCall(HycoFEStateDestroy(&m->end));
  PetscCall(HycoFEDestroy(&m->fe));
  PetscCall(HycoMeshDestroy(&m->mesh));
  PetscCall(HycoSceneDestroy(&m->scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Step(Model *m, PetscBool tangent, PetscReal f[], HycoFEStepReport *report)
{
  PetscFunctionBegin;
  PetscCall(PetscArrayzero(f, m->fe->n_dof));
  PetscCall(HycoFEStep(m->fe, m->u, 0, 1, m->begin, m->end, f, tangent, report));
  CHECK(!report->failed, "%s", report->why);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The stiffness with fe's current tangents, dense. */
static PetscErrorCode Stiffness(Model *m, PetscReal **K)
{
  const PetscInt n = m->fe->n_dof;
  Mat A;

  PetscFunctionBegin;
  PetscCall(HycoFECreateMatrix(m->fe, PETSC_COMM_SELF, m->mesh->n_nodes, 0, &A));
  PetscCall(HycoFEAssembleStiffness(m->fe, A));
  PetscCall(PetscMalloc1(n * n, K));
  for (PetscInt r = 0; r < n; r++) {
    for (PetscInt c = 0; c < n; c++) PetscCall(MatGetValue(A, r, c, *K + r * n + c));
  }
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Central differences in every unknown, at the second step of a path. */
static PetscErrorCode TestDerivatives(const Patch *p, const char element[])
{
  const PetscReal h = 1e-9;
  HycoFEStepReport report, side[2];
  PetscReal *K, *elastic, *again, scale = 0, worst_f = 0, worst_K = 0, first;
  unsigned long long seed = 5;
  PetscInt n;
  Model m;

  PetscFunctionBegin;
  PetscCall(Load(p, element, &m));
  n = m.fe->n_dof;
  PetscCall(Stiffness(&m, &elastic));
  for (PetscInt i = 0; i < n; i++) m.u[i] = 3e-3 * Draw(&seed);
  PetscCall(Step(&m, PETSC_FALSE, m.f, &report));
  first = report.stored;
  PetscCall(HycoFEStateCopy(m.end, m.begin));
  for (PetscInt i = 0; i < n; i++) m.u[i] += 2e-3 * Draw(&seed);
  PetscCall(Step(&m, PETSC_TRUE, m.f, &report));
  CHECK(report.increment > 1e-4, "%s: it flows: %g", p->name, (double)report.increment);
  CHECK(report.has_potential, "Norton with hardening has a potential");
  CHECK_NEAR((report.work - (report.stored - first) - report.dissipated - report.thermal) / report.work, 0, 1e-12);
  CHECK_NEAR(report.moduli / report.work, 0, 1e-12);
  CHECK(report.dissipated > 0, "flow dissipates: %g", (double)report.dissipated);
  PetscCall(Stiffness(&m, &K));
  for (PetscInt k = 0; k < n * n; k++) scale = PetscMax(scale, PetscAbsReal(elastic[k]));
  for (PetscInt j = 0; j < n; j++) {
    const PetscReal at = m.u[j];
    PetscReal *f[2] = {m.work, NULL};

    PetscCall(PetscMalloc1(n, &f[1]));
    for (PetscInt s = 0; s < 2; s++) {
      m.u[j] = at + (s ? h : -h);
      PetscCall(Step(&m, PETSC_FALSE, f[s], &side[s]));
    }
    m.u[j] = at;
    for (PetscInt i = 0; i < n; i++)
      worst_K = PetscMax(worst_K, PetscAbsReal((f[1][i] - f[0][i]) / (2 * h) - K[i * n + j]) / scale);
    worst_f = PetscMax(worst_f, PetscAbsReal((side[1].potential - side[0].potential) / (2 * h) - m.f[j]));
    PetscCall(PetscFree(f[1]));
  }
  CHECK(worst_K <= 1e-6, "%s %s: the stiffness misses the differences by %g", p->name, element, (double)worst_K);
  CHECK(worst_f <= 1e-3, "%s %s: the forces miss the potential's by %g", p->name, element, (double)worst_f);
  PetscCall(HycoFEElasticTangent(m.fe));
  PetscCall(Stiffness(&m, &again));
  CHECK(memcmp(elastic, again, (size_t)(n * n) * sizeof(*elastic)) == 0, "the elastic tangents are back");
  PetscCall(PetscFree(elastic));
  PetscCall(PetscFree(again));
  PetscCall(PetscFree(K));
  PetscCall(Free(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A repeated step gives the same bits; the state's reals describe it completely. */
static PetscErrorCode TestState(void)
{
  const PetscInt *start;
  PetscReal *values, *kept, sigma[64], mises[16], inelastic[16], temperature[16], creep[16];
  const char *const *names;
  HycoFEStepReport report;
  unsigned long long seed = 9;
  PetscInt n, n_names, size;
  Model m;

  PetscFunctionBegin;
  PetscCall(Load(&patches[HYCO_QUAD4], "bbar", &m));
  for (PetscInt i = 0; i < m.fe->n_dof; i++) m.u[i] = 4e-3 * Draw(&seed);
  PetscCall(Step(&m, PETSC_FALSE, m.f, &report));
  PetscCall(HycoFEStateGet(m.end, &start, &values));
  n = start[m.mesh->n_cells];
  size = start[1] / 4;
  CHECK(size == 2 * 4 + 4 + 6, "reals of a point: %d", (int)size);
  PetscCall(PetscMalloc1(n, &kept));
  PetscCall(PetscArraycpy(kept, values, n));
  PetscCall(HycoFEStateFields(m.fe, m.end, sigma, mises, inelastic, temperature));
  PetscCall(HycoFEStateVariable(m.fe, m.end, "creep_strain", creep));
  PetscCall(HycoFEStateGetNames(m.end, &n_names, &names));
  CHECK(n_names == 6 && strcmp(names[0], "inelastic_xx") == 0, "%d names", (int)n_names);
  CHECK(creep[0] > 0 && inelastic[0] >= creep[0], "%g of %g is creep", (double)creep[0], (double)inelastic[0]);
  CHECK(temperature[0] > 300 && temperature[0] < 320, "T = %g", (double)temperature[0]);
  CHECK(mises[0] > 0, "q = %g", (double)mises[0]);
  PetscCall(PetscArrayzero(values, n));
  PetscCall(Step(&m, PETSC_TRUE, m.f, &report));
  CHECK(memcmp(kept, values, (size_t)n * sizeof(*kept)) == 0, "the same step gives the same bits");
  m.mu[0] = 2;
  PetscCall(HycoFESetParameters(m.fe, m.mu));
  PetscCall(Step(&m, PETSC_FALSE, m.f, &report));
  PetscCall(PetscFree(kept));
  PetscCall(Free(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A program's law that computes only stress, state and tangent: a Maxwell element. */
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
    if (p->dt > 0.5) p->dt_factor = 0.5;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CreateMaxwell(HycoMaterial law)
{
  static const struct _HycoMaterialOps ops = {.update = UpdateMaxwell};

  PetscFunctionBegin;
  PetscCall(HycoMaterialDeclare(law, "young", "Young's modulus", HYCO_REQUIRED, 0, PETSC_INFINITY));
  PetscCall(HycoMaterialDeclare(law, "rate", "strain rate by stress", HYCO_REQUIRED, 0, PETSC_INFINITY));
  PetscCall(HycoMaterialSetStateSize(law, 1));
  PetscCall(HycoMaterialSetLinear(law, PETSC_FALSE));
  PetscCall(HycoMaterialSetOps(law, &ops));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A law that this program registers, in one step of a bar: its stress in closed form. */
static PetscErrorCode TestProgram(void)
{
  static char *const names[] = {"scene_mesh", "body_block_law", "body_block_young", "body_block_rate", "history_times"};
  char path[256];
  char *values[] = {path, "maxwell", "100", "0.01", "0,1"};
  const PetscReal strain = 0.3, stress = 100 * 0.3 / 2;
  const PetscReal *values0;
  PetscReal *K, sum = 0;
  HycoFEStepReport report;
  Model m;

  PetscFunctionBegin;
  snprintf(path, sizeof(path), "/tmp/hyco_inelastic_program_%ld.msh", (long)getpid());
  PetscCall(HycoMaterialRegister("maxwell", CreateMaxwell));
  PetscCall(PatchWrite(&patches[HYCO_LINE2], path));
  PetscCall(HycoSceneFromEntries(PETSC_COMM_SELF, 5, names, values, "/", &m.scene));
  PetscCall(HycoMeshCreate(PETSC_COMM_SELF, m.scene, &m.mesh));
  unlink(path);
  PetscCall(HycoFECreate(m.scene, m.mesh->dm, &m.fe));
  m.mu[0] = 1;
  PetscCall(HycoFESetParameters(m.fe, m.mu));
  PetscCall(HycoFEStateCreate(m.fe, &m.begin));
  PetscCall(HycoFEStateCreate(m.fe, &m.end));
  PetscCall(PetscCalloc3(m.fe->n_dof, &m.u, m.fe->n_dof, &m.f, m.fe->n_dof, &m.work));
  PetscCall(Stiffness(&m, &K));
  for (PetscInt i = 0; i < m.fe->n_dof; i++) sum += K[i * m.fe->n_dof + i];
  CHECK_NEAR(sum, 2 * 100 * (1 / 0.2 + 1 / 0.55 + 1 / 0.25), 1e-10); /* at rest it is elastic */
  PetscCall(PetscFree(K));
  for (PetscInt i = 0; i < m.fe->n_dof; i++) m.u[i] = strain * m.mesh->xyz[3 * i];
  PetscCall(Step(&m, PETSC_TRUE, m.f, &report));
  PetscCall(HycoFEStateGet(m.end, NULL, (PetscReal **)&values0));
  CHECK_NEAR(values0[1], stress, 1e-12); /* strain, stress, ... of the first point */
  CHECK(!report.has_potential, "the law tells no potential");
  CHECK_NEAR(report.dt_factor, 0.5, 0);
  CHECK_NEAR(report.work, stress / 2 * strain, 1e-12);
  CHECK_NEAR(report.dissipated, report.work, 1e-12);
  PetscCall(Stiffness(&m, &K));
  sum = 0;
  for (PetscInt i = 0; i < m.fe->n_dof; i++) sum += K[i * m.fe->n_dof + i];
  CHECK_NEAR(sum, 100 * (1 / 0.2 + 1 / 0.55 + 1 / 0.25), 1e-10); /* E / (1 + E A dt) */
  PetscCall(PetscFree(K));
  PetscCall(Free(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PetscCall(TestDerivatives(&patches[HYCO_LINE2], "standard"));
  PetscCall(TestDerivatives(&patches[HYCO_TRI3], "standard"));
  PetscCall(TestDerivatives(&patches[HYCO_QUAD4], "standard"));
  PetscCall(TestDerivatives(&patches[HYCO_QUAD4], "bbar"));
  PetscCall(TestDerivatives(&patches[HYCO_TET4], "standard"));
  PetscCall(TestDerivatives(&patches[HYCO_HEX8], "bbar"));
  PetscCall(TestState());
  PetscCall(TestProgram());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
