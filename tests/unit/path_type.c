/*
  A type of paths of this program: the whole mesh on one process with a sparse K, in its simplest form. No line of it
  knows of friction: its rows are those of HycoPathRows(), and with a scene's friction the path has it. Compared with
  full order, with friction and without.
*/
#include "check.h"
#include <hyco.h>
#include <hycopath.h>
#include <unistd.h>

#define SCENE                                                                                                          \
  "scene: {mesh: %s/examples/lapjoint/lapjoint.msh, parameters: [stroke]}\n"                                           \
  "parameter: {stroke: {range: [0.02, 0.08]}}\n"                                                                       \
  "body: {lower: {young: 2.1e5, poisson: 0.3}, upper: {young: 2.1e5, poisson: 0.3}}\n"                                 \
  "fixed: {clamped: {x: 0, y: 0}, pulled: {x: stroke*s, y: 0}}\n"                                                      \
  "pressure: {lower_washer: 100*bolt, upper_washer: 100*bolt}\n"                                                       \
  "contact: {lap: {type: surface, slave: upper_face, master: lower_face%s}}\n"                                         \
  "history: {times: [0, 1, 1.5, 2, 2.5, 3], tables: {bolt: [[0, 0], [1, 1]], s: [[1, 0], [2, 1], [3, -1]]}}\n"

/* -- the type -- */

typedef struct {
  HycoFE fe;
  Mat K, B, Bt;
  Vec U, L, rhs, D;
  HycoSystem system;
  HycoSolver solver;
} Type;

static PetscErrorCode TypeRows(HycoPath p)
{
  Type *t = (Type *)p->ctx;
  HycoRows rows = {0};

  PetscFunctionBegin;
  PetscCall(HycoPathRows(p, t->fe, &rows));
  PetscCall(MatZeroEntries(t->B));
  for (PetscInt k = 0; k < rows.n; k++)
    PetscCall(MatSetValues(t->B, 1, &k, rows.start[k + 1] - rows.start[k], rows.dof + rows.start[k],
                           rows.value + rows.start[k], ADD_VALUES));
  PetscCall(HycoMatAssemble(t->B));
  PetscCall(MatTranspose(t->B, p->contact.Bt ? MAT_REUSE_MATRIX : MAT_INITIAL_MATRIX, &t->Bt));
  p->contact.Bt = t->Bt;
  PetscCall(HycoVecWrite(t->D, rows.n, rows.gap));
  PetscCall(HycoRowsDestroy(&rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TypeAssemble(HycoPath p, const PetscReal mu[], PetscBool elastic)
{
  Type *t = (Type *)p->ctx;

  PetscFunctionBegin;
  (void)elastic;
  PetscCall(HycoFESetParameters(t->fe, mu));
  if (t->fe->stiffness_changed) {
    PetscCall(HycoFEAssembleStiffness(t->fe, t->K));
    PetscCall(HycoMatAssemble(t->K));
  }
  PetscCall(TypeRows(p));
  t->fe->lifted = PETSC_FALSE; /* supports move by ops->moves */
  PetscCall(HycoFEAssembleForce(t->fe, p->F));
  t->fe->ready = PETSC_TRUE;
  PetscCall(HycoSystemSetMatrices(t->system, t->K, t->Bt, t->B, PETSC_TRUE));
  PetscCall(HycoSystemSetVectors(t->system, t->rhs, t->D));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* f_int and F - f_int, 0 where fixed. */
static PetscErrorCode TypeStep(HycoPath p, PetscReal t0, PetscReal t1, PetscBool tangent, HycoFEStepReport *report)
{
  Type *t = (Type *)p->ctx;
  const PetscScalar *F;
  PetscScalar *u, *r;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(p->f_local, t->fe->n_dof));
  PetscCall(VecGetArray(t->U, &u));
  PetscCall(HycoFEStep(t->fe, u, t0, t1, p->begin, p->end, p->f_local, tangent, report));
  PetscCall(VecRestoreArray(t->U, &u));
  PetscCall(HycoVecWrite(p->f_int, t->fe->n_dof, p->f_local));
  PetscCall(VecGetArrayRead(p->F, &F));
  PetscCall(VecGetArray(p->r, &r));
  for (PetscInt i = 0; i < t->fe->n_dof; i++) r[i] = t->fe->fixed[i] ? 0 : F[i] - p->f_local[i];
  PetscCall(VecRestoreArray(p->r, &r));
  PetscCall(VecRestoreArrayRead(p->F, &F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TypeMove(HycoPath p, Vec rhs)
{
  const PetscScalar *u;
  PetscBool moved;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(p->U, &u));
  PetscCall(HycoPathMoves(p, u, p->work, &moved));
  PetscCall(VecRestoreArrayRead(p->U, &u));
  if (!moved) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecAXPY(rhs, 1, p->work));
  PetscCall(VecAXPY(rhs, -1, p->F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TypeAccept(HycoPath p, const HycoStepAttempt *a)
{
  PetscFunctionBegin;
  (void)p, (void)a;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TypeSurfaces(HycoPath p, PetscReal u[], PetscReal *most)
{
  PetscFunctionBegin;
  PetscCall(HycoVecRead(p->U, p->fe->n_dof, u));
  PetscCall(VecNorm(p->U, NORM_INFINITY, most));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TypeRecord(HycoPath p)
{
  PetscFunctionBegin;
  p->steps[p->n_steps++] = p->now;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TypeCreate(HycoScene scene, HycoFE fe, HycoPairs *pairs, Type *t, HycoPath *path)
{
  static const HycoPathOps ops = {.assemble = TypeAssemble,
                                  .step = TypeStep,
                                  .moves = TypeMove,
                                  .accept = TypeAccept,
                                  .surfaces = TypeSurfaces,
                                  .record = TypeRecord};
  HycoPath p;

  PetscFunctionBegin;
  PetscCall(HycoPathNew(PETSC_COMM_SELF, scene, path));
  p = *path;
  p->ops = &ops;
  p->ctx = t;
  p->fe = t->fe = fe;
  PetscCall(HycoSystemCreate(PETSC_COMM_SELF, &t->system));
  PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &t->solver));
  PetscCall(HycoSolverSetFromOptions(t->solver));
  p->contact.system = t->system;
  p->contact.solver = t->solver;
  PetscCall(HycoPathSetContacts(p, pairs, &p->n_contacts));
  PetscCall(HycoFECreateMatrix(fe, PETSC_COMM_SELF, fe->mesh->n_nodes, 0, &t->K));
  PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, p->n_contacts, fe->n_dof, 16, NULL, &t->B));
  PetscCall(MatCreateVecs(t->B, &t->U, &t->L));
  HycoVecDuplicate(t->L, &t->D);
  HycoVecDuplicate(t->U, &t->rhs);
  p->K = t->K;
  p->U = t->U;
  p->rhs = t->rhs;
  p->contact.B = t->B;
  p->contact.D = t->D;
  p->contact.Lambda = t->L;
  p->n_free = fe->n_dof;
  PetscCall(HycoPathSetUp(p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TypeDestroy(Type *t, HycoPath *path)
{
  PetscFunctionBegin;
  PetscCall(HycoPathFree(path));
  HycoDestroyAll(&t->K, &t->B, &t->Bt, &t->U, &t->L, &t->rhs, &t->D, &t->system, &t->solver);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the comparison -- */

static PetscErrorCode TestPath(const char friction[])
{
  char file[] = "path_type_XXXXXX", text[4096];
  const PetscReal mu[1] = {0.06};
  const PetscScalar *u, *v;
  HycoHistory full;
  HycoScene scene;
  HycoPath path;
  HycoFOM f;
  Type t = {0};
  PetscReal lost = 0, most = 0;
  int fd = mkstemp(file);

  PetscFunctionBegin;
  snprintf(text, sizeof(text), SCENE, getenv("HYCO_SOURCE"), friction);
  CHECK(write(fd, text, strlen(text)) == (ssize_t)strlen(text), "the scene is written");
  close(fd);
  PetscCall(HycoSceneLoad(PETSC_COMM_SELF, file, &scene));
  unlink(file);
  PetscCall(HycoFOMCreate(PETSC_COMM_SELF, scene, &f));
  PetscCall(HycoFOMSolve(f, 1, mu));
  PetscCall(HycoFOMGetHistory(f, &full));
  PetscCall(TypeCreate(scene, f->fe, &f->pairs, &t, &path));
  PetscCall(HycoPathBegin(path, mu));
  PetscCall(HycoPathRun(path));
  CHECK(path->ended && path->n_steps == full.n, "%d of %d times: %s", (int)path->n_steps, (int)full.n, path->why);
  for (PetscInt k = 0; k < full.n && k < path->n_steps; k++) {
    CHECK_NEAR(path->steps[k].friction_work, full.step[k].friction_work, 1e-9 * (1 + full.step[k].friction_work));
    CHECK(path->steps[k].n_slipping == full.step[k].n_slipping, "%d slip, at full order %d",
          (int)path->steps[k].n_slipping, (int)full.step[k].n_slipping);
  }
  CHECK((friction[0] != '\0') == (full.step[full.n - 1].friction_work > 1), "friction works in one scene");
  PetscCall(VecGetArrayRead(path->U, &u));
  PetscCall(VecGetArrayRead(f->U, &v));
  for (PetscInt i = 0; i < f->fe->n_dof; i++) {
    lost = PetscMax(lost, PetscAbsReal(u[i] - v[i]));
    most = PetscMax(most, PetscAbsReal(v[i]));
  }
  CHECK(lost <= 1e-9 * most, "displacements differ by %g of %g", (double)lost, (double)most);
  PetscCall(VecRestoreArrayRead(f->U, &v));
  PetscCall(VecRestoreArrayRead(path->U, &u));
  PetscCall(TypeDestroy(&t, &path));
  PetscCall(HycoFOMDestroy(&f));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PetscCall(TestPath(""));
  PetscCall(TestPath(", friction: 0.3"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
