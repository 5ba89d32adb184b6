/*
  The norms of the paper's section 3 on the whole mesh: |u|_H1^2 = u^T H u with H the mass plus the gradient's matrix
  (times the mesh's length squared, so that units do not matter), and the norm of a force in the dual of H1 (test
  functions that vanish on the supports), sup r.v / |v|_H1 = sqrt(r^T M^-1 r) with M the part of H on the free unknowns.
  On a mesh that the parameters move, both are those at the middle of the ranges, so that one factor serves every point.
*/
#include <hycocomparison.h>
#include <hycolinear.h>

struct _n_HycoNorms {
  HycoFOM f; /* borrowed */
  HycoFE fe;
  Mat H, M;
  Vec x, y;
  KSP ksp;
};

/* The H1 norm's matrix, scaled by the mesh's length so that both parts have one unit. Scaled by the length
   squared: a gradient times a length has the unit of the displacement. */
static PetscErrorCode AssembleNorm(HycoNorms h, Mat *A)
{
  HycoMesh part = h->f->part;

  PetscFunctionBegin;
  PetscCall(HycoFECreateMatrix(h->fe, HycoComm(h->f), part->n_owned, part->first, A));
  HycoOnEach(HycoComm(h->f), HycoFEAssembleH1(h->fe, HycoMeshLength(part), *A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At the centre of the ranges: errors of a set of points are comparable only in one norm, not in that of each
   moved mesh. */
PetscErrorCode HycoNormsCreate(HycoFOM f, HycoNorms *norms)
{
  HycoScene scene = f->scene;
  HycoNorms h;
  PetscReal mu[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  PetscCall(PetscNew(&h));
  *norms = h;
  h->f = f;
  for (PetscInt p = 0; p < scene->n_parameters; p++) mu[p] = (scene->lo[p] + scene->hi[p]) / 2;
  HycoOnEach(HycoComm(f), HycoFECreate(scene, f->part->dm, &h->fe));
  HycoOnEach(HycoComm(f), HycoFESetParameters(h->fe, mu));
  PetscCall(AssembleNorm(h, &h->M));
  /* M is assembled with the supports, H without; the order matters, as both use one FE. */
  PetscCall(PetscArrayzero(h->fe->fixed, h->fe->n_dof)); /* prescribed displacements are included in the norm */
  /* Without conditions along oblique directions and ties. */
  h->fe->plain = PETSC_TRUE;
  PetscCall(AssembleNorm(h, &h->H));
  PetscCall(MatCreateVecs(h->M, &h->x, &h->y));
  PetscCall(HycoDefiniteSolver(h->M, "the H1 norm's matrix", &h->ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* In the opposite order of creation. */
PetscErrorCode HycoNormsDestroy(HycoNorms *norms)
{
  HycoNorms h = *norms;

  PetscFunctionBegin;
  if (!h) PetscFunctionReturn(PETSC_SUCCESS);
  HycoDestroyAll(&h->ksp, &h->H, &h->M, &h->x, &h->y);
  PetscCall(HycoFEDestroy(&h->fe));
  PetscCall(PetscFree(*norms));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* sqrt(x.y). Round-off can make a square of 0 slightly negative. */
static PetscErrorCode NormRoot(HycoNorms h, PetscReal *norm)
{
  PetscScalar square;

  PetscFunctionBegin;
  PetscCall(VecDot(h->x, h->y, &square));
  *norm = PetscSqrtReal(PetscMax(square, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets x from values by node in the file's order, of which this rank has its rows. Each rank sets the nodes that
   it owns. */
static PetscErrorCode SetFromRows(HycoNorms h, const PetscReal rows[])
{
  HycoMesh part = h->f->part;
  const PetscInt dim = part->dim;
  PetscScalar *x;
  PetscReal *value;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(part->n_nodes * dim, &value));
  PetscCall(HycoFOMFromRows(h->f, HYCO_ON_NODES, dim, rows, value));
  PetscCall(VecGetArray(h->x, &x));
  for (PetscInt i = 0; i < part->n_nodes; i++) {
    const PetscInt place = HycoMeshOwned(part, i);

    if (place >= 0) PetscCall(PetscArraycpy(x + place * dim, value + i * dim, dim));
  }
  PetscCall(VecRestoreArray(h->x, &x));
  PetscCall(PetscFree(value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* |u - minus|, or |u| if minus is NULL; both by rows in the file's order. sqrt(v . H v); a norm of the difference needs
   no second product. */
PetscErrorCode HycoNormH1(HycoNorms h, const PetscReal u[], const PetscReal minus[], PetscReal *norm)
{
  HycoMesh part = h->f->part;
  const HycoFileOrder *order;
  PetscInt n;
  PetscReal *rows;

  PetscFunctionBegin;
  PetscCall(HycoFOMGetRows(h->f, &order));
  n = part->dim * (order ? order->n[HYCO_ON_NODES] : part->n_nodes);
  PetscCall(PetscMalloc1(n, &rows));
  for (PetscInt i = 0; i < n; i++) rows[i] = minus ? u[i] - minus[i] : u[i];
  PetscCall(SetFromRows(h, rows));
  PetscCall(PetscFree(rows));
  PetscCall(MatMult(h->H, h->x, h->y));
  PetscCall(NormRoot(h, norm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds B^T (L - minus) to a vector in the file's order. Rank 0. By the contact rows of the current positions,
   which HycoROMComplete() fills for the contacts outside the RID as well. */
static PetscErrorCode AddForces(HycoNorms h, HycoROM m, PetscBool rid_only, const PetscReal L[],
                                const PetscReal minus[], Vec file, PetscBool *any)
{
  const PetscInt dim = h->f->part->dim;

  PetscFunctionBegin;
  PetscCall(HycoROMComplete(m));
  for (PetscInt k = 0; k < m->model->pairs.n; k++) {
    const PetscReal force = minus ? L[k] - minus[k] : L[k];

    if (force == 0 || (rid_only && !m->model->in_rid[k])) continue;
    *any = PETSC_TRUE;
    for (PetscInt j = m->rows.start[k]; j < m->rows.start[k + 1]; j++) {
      const PetscInt dof = m->rows.dof[j];

      PetscCall(VecSetValue(file, m->model->mesh->node_whole[dof / dim] * dim + dof % dim, m->rows.value[j] * force,
                            ADD_VALUES));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Only rank 0 has forces to add; the assembly sends them to the owners of the rows. sqrt(r . M^-1 r) for r = B^T L: one
   solve with the factor of M. */
PetscErrorCode HycoNormDual(HycoNorms h, HycoROM m, PetscBool rid_only, const PetscReal L[], const PetscReal minus[],
                            PetscReal *norm)
{
  const PetscInt dim = h->f->part->dim;
  const PetscScalar *rows;
  const HycoFileOrder *order;
  PetscBool any = PETSC_FALSE;
  Vec file;

  PetscFunctionBegin;
  *norm = 0;
  PetscCall(HycoFOMGetRows(h->f, &order));
  PetscCall(VecCreateMPI(HycoComm(h->f), dim * (order ? order->n[HYCO_ON_NODES] : h->f->part->n_nodes), PETSC_DETERMINE,
                         &file));
  HycoOnRoot(HycoComm(h->f), AddForces(h, m, rid_only, L, minus, file, &any));
  PetscCall(HycoVecAssemble(file));
  PetscCall(VecGetArrayRead(file, &rows));
  PetscCall(SetFromRows(h, rows));
  PetscCall(VecRestoreArrayRead(file, &rows));
  PetscCall(VecDestroy(&file));
  PetscCallMPI(MPI_Bcast(&any, 1, HYCO_MPI_BOOL, 0, HycoComm(h->f)));
  /* No force: a solve with a zero right-hand side is spared, on all ranks alike. */
  if (!any) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPSolve(h->ksp, h->x, h->y));
  PetscCall(NormRoot(h, norm));
  PetscFunctionReturn(PETSC_SUCCESS);
}
