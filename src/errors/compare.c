/* Errors of a prediction against the full-order solution. */
#include <hycocomparison.h>
#include <hycoreducerimpl.h>

/* Sums and maxima of one quantity, and the quotient computed from them. */
typedef struct {
  PetscReal lost2, size2, lost, size;
} Norms;

/* lost2 and size2 are sums of squares, lost and size maxima. */
static void CompareAdd(Norms *n, PetscReal value, PetscReal reference)
{
  n->lost2 += (value - reference) * (value - reference);
  n->size2 += reference * reference;
  n->lost = PetscMax(n->lost, PetscAbsReal(value - reference));
  n->size = PetscMax(n->size, PetscAbsReal(reference));
}

/* What round-off leaves of the stresses of cell e: that of the strains of its displacements, which a rigid motion may
   make large, times the modulus; of a path the round-off of its steps adds up. */
static PetscReal CompareRoundOff(HycoROM m, PetscInt e, const PetscReal u[], PetscReal least)
{
  const HycoMesh mesh = m->model->mesh;
  const PetscReal *tangent = m->fe->tangent + m->fe->tangent_start[e];
  PetscReal most = least, size = 0, modulus = 0;
  PetscInt of[HYCO_MAX_CELL_NODES];
  const PetscInt n = HycoMeshCellNodes(mesh, e, of);

  for (PetscInt v = 0; v < n; v++) {
    for (PetscInt i = 0; i < mesh->dim; i++) {
      most = PetscMax(most, PetscAbsReal(u[of[v] * mesh->dim + i]));
      size = PetscMax(size, PetscAbsReal(m->fe->X[of[v] * 3 + i] - m->fe->X[of[0] * 3 + i]));
    }
  }
  for (PetscInt k = 0; k < m->fe->tangent_size[mesh->cell_body[e]]; k++)
    modulus = PetscMax(modulus, PetscAbsReal(tangent[k]));
  return size > 0 ? 16 * HYCO_NOTHING * modulus * most / size : 0;
}

/* U, u: displacements of the RID's nodes; sigma: (cells of the RID) x (components); Lambda, lambda: forces of all
   contacts, also of those outside the RID, which are reconstructed. NULL sigma or inelastic: not compared. Differences
   and sizes, not quotients: a path divides them by its own largest sizes. */
PetscErrorCode HycoROMMeasureRID(HycoROM m, const PetscReal u[], const PetscReal sigma[], const PetscReal inelastic[],
                                 const PetscReal lambda[], HycoErrorNorm lost[])
{
  const PetscReal *stress, *flow = NULL;
  const PetscInt dim = m->model->mesh->dim, ns = m->fe->n_sigma, *node;
  PetscInt n_nodes;
  Norms rid = {0}, s = {0}, s11 = {0}, lr = {0}, l = {0}, p = {0};
  PetscReal length = HycoMeshLength(m->model->mesh), noise = 0;

  PetscFunctionBegin;
  PetscCall(ISGetLocalSize(m->model->rid, &n_nodes));
  PetscCall(ISGetIndices(m->model->rid, &node));
  for (PetscInt k = 0; k < n_nodes * dim; k++) {
    const PetscInt i = node[k / dim] * dim + k % dim;

    CompareAdd(&rid, m->U[i], u[i]);
  }
  PetscCall(ISRestoreIndices(m->model->rid, &node));
  /* Against 0, of which no share tells round-off: by the size of the mesh. */
  if (rid.size > 0)
    length = 0;
  else if (rid.lost <= HYCO_NOTHING * length)
    rid.lost = 0;
  PetscCall(HycoROMGetRID(m, NULL, NULL, NULL, NULL, NULL, &stress));
  for (PetscInt k = 0; sigma && k < m->model->mesh->n_cells * ns; k++) {
    CompareAdd(&s, stress[k], sigma[k]);
    if (k % ns == 0) CompareAdd(&s11, stress[k], sigma[k]);
    noise += PetscSqr(CompareRoundOff(m, k / ns, m->U, length));
  }
  for (PetscInt k = 0; k < m->model->pairs.n; k++) {
    CompareAdd(&l, m->Lambda[k], lambda[k]);
    if (m->model->in_rid[k]) CompareAdd(&lr, m->Lambda[k], lambda[k]);
  }
  if (inelastic) PetscCall(HycoROMGetInelastic(m, NULL, &flow));
  for (PetscInt k = 0; inelastic && k < m->model->mesh->n_cells; k++) CompareAdd(&p, flow[k], inelastic[k]);
  lost[HYCO_ERROR_U_RID] = (HycoErrorNorm){rid.lost, rid.size};
  noise = PetscSqrtReal(noise);
  lost[HYCO_ERROR_SIGMA] = (HycoErrorNorm){PetscMax(PetscSqrtReal(s.lost2) - noise, 0), PetscSqrtReal(s.size2)};
  /* Where this component vanishes, its difference is the round-off of the others. */
  lost[HYCO_ERROR_SIGMA_11] = (HycoErrorNorm){s11.lost <= 1e-12 * s.size ? 0 : PetscMax(s11.lost - noise, 0), s11.size};
  lost[HYCO_ERROR_LAMBDA] = (HycoErrorNorm){PetscSqrtReal(l.lost2), PetscSqrtReal(l.size2)};
  lost[HYCO_ERROR_LAMBDA_RID] = (HycoErrorNorm){PetscSqrtReal(lr.lost2), PetscSqrtReal(lr.size2)};
  lost[HYCO_ERROR_INELASTIC] = (HycoErrorNorm){PetscSqrtReal(p.lost2), PetscSqrtReal(p.size2)};
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The relative errors of the paper's section 3, without those of the whole mesh, which need its rows. */
PetscErrorCode HycoROMCompareRID(HycoROM m, const PetscReal u[], const PetscReal sigma[], const PetscReal lambda[],
                                 HycoErrors *e, HycoForceErrors *forces)
{
  HycoErrorNorm lost[HYCO_N_ERRORS] = {{0}};
  const HycoErrorNorm *l = &lost[HYCO_ERROR_LAMBDA], *lr = &lost[HYCO_ERROR_LAMBDA_RID];

  PetscFunctionBegin;
  PetscCall(HycoROMMeasureRID(m, u, sigma, NULL, lambda, lost));
  e->u_rid = HycoRelative(lost[HYCO_ERROR_U_RID].lost, lost[HYCO_ERROR_U_RID].size);
  e->sigma = HycoRelative(lost[HYCO_ERROR_SIGMA].lost, lost[HYCO_ERROR_SIGMA].size);
  e->sigma_norm2 = lost[HYCO_ERROR_SIGMA].size;
  e->sigma_11 = HycoRelative(lost[HYCO_ERROR_SIGMA_11].lost, lost[HYCO_ERROR_SIGMA_11].size);
  e->lambda_rid = HycoRelative(lr->lost, lr->size);
  e->lambda = HycoRelative(l->lost, l->size);
  if (forces) *forces = (HycoForceErrors){l->lost, l->size, lr->lost, lr->size};
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Modes, norms and star forests of the last model with which a full-order model was compared. */
typedef struct {
  PetscObjectId id; /* the model's, on rank 0 */
  HycoComparison rows;
  HycoNorms norms;
  PetscReal *V; /* the modes in these rows, column major */
} * HycoCompared;

#define COMPARED "HycoCompared" /* they are composed with the full-order model */

/* PETSc calls it when the full-order model is destroyed, or another is composed under the name. */
static PetscErrorCode DestroyCompared(HycoContained contained)
{
  HycoCompared k = (HycoCompared)HycoContainedContext(contained);

  PetscFunctionBegin;
  PetscCall(HycoComparisonDestroy(&k->rows));
  PetscCall(HycoNormsDestroy(&k->norms));
  HycoFreeAll(&k->V, &k);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* This rank's rows of the modes on the whole mesh, from the model's file. A model in memory has its modes on the RID
   only. */
static PetscErrorCode ReadModes(HycoCompared k, const char path[])
{
  const PetscInt dim = k->rows.width[0], n = k->rows.n[0] * dim, l = k->rows.l;
  PetscReal *V;
  HycoH5 h;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1((size_t)n * (size_t)l, &k->V));
  PetscCall(PetscMalloc1((size_t)n * (size_t)l, &V));
  PetscCall(HycoH5OpenOr(path, "train the model again", &h));
  ierr = HycoH5ReadRows(h, "whole/V", k->rows.first[0] * dim, n, l, V);
  PetscCall(HycoH5Close(&h, PETSC_FALSE));
  /* The file has a row per unknown; the sum over modes runs along columns. */
  for (PetscInt i = 0; !ierr && i < n; i++) {
    for (PetscInt j = 0; j < l; j++) k->V[(size_t)j * (size_t)n + (size_t)i] = V[(size_t)i * (size_t)l + (size_t)j];
  }
  PetscCall(PetscFree(V));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Only rank 0 has the model; every rank reads its own rows of the modes from the file, so that none has them all. For
   all comparisons with this model. */
static PetscErrorCode CompareFill(HycoROM m, HycoFOM f, HycoCompared k)
{
  char path[PETSC_MAX_PATH_LEN] = "";

  PetscFunctionBegin;
  PetscCall(HycoComparisonCreate(f, m, &k->rows));
  if (f->rank == 0) PetscCall(PetscStrncpy(path, m->model->path, sizeof(path)));
  PetscCallMPI(MPI_Bcast(path, sizeof(path), MPI_CHAR, 0, HycoComm(f)));
  HycoOnEach(HycoComm(f), ReadModes(k, path));
  PetscCall(HycoNormsCreate(f, &k->norms));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Those for this model. Collective. Compared by the id, because a new model may have the address of a destroyed
   one. Reading the modes and the norm's factor takes longer than a comparison. */
static PetscErrorCode CompareKeep(HycoROM m, HycoFOM f, HycoCompared *k)
{
  PetscObjectId id = 0;
  PetscContainer container;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  if (f->rank == 0) PetscCall(PetscObjectGetId((PetscObject)m, &id));
  PetscCallMPI(MPI_Bcast(&id, 1, MPIU_INT64, 0, HycoComm(f)));
  PetscCall(PetscObjectQuery((PetscObject)f, COMPARED, (PetscObject *)&container));
  if (container) {
    PetscCall(PetscContainerGetPointer(container, (void **)k));
    if ((*k)->id == id) PetscFunctionReturn(PETSC_SUCCESS);
  }
  /* Frees the former model's before the new one's are allocated. */
  PetscCall(PetscObjectCompose((PetscObject)f, COMPARED, NULL));
  PetscCall(PetscNew(k));
  (*k)->id = id;
  PetscCall(PetscContainerCreate(PETSC_COMM_SELF, &container));
  PetscCall(PetscContainerSetPointer(container, *k));
  PetscCall(PetscContainerSetCtxDestroy(container, DestroyCompared));
  ierr = CompareFill(m, f, *k);
  if (!ierr) ierr = PetscObjectCompose((PetscObject)f, COMPARED, (PetscObject)container);
  PetscCall(PetscContainerDestroy(&container));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0. The same number of nodes and cells is taken for the same mesh. */
static PetscErrorCode CompareCheck(HycoROM m, HycoFOM f)
{
  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  HycoCheck(m->model->whole_nodes == f->n_nodes && m->model->whole_cells == f->n_cells &&
                m->model->pairs.n == f->n_contacts,
            "the model was trained on a mesh of %d nodes and %d cells, and the scene's mesh has %d and %d; compare on "
            "the training mesh",
            (int)m->model->whole_nodes, (int)m->model->whole_cells, (int)f->n_nodes, (int)f->n_cells);
  PetscCheck(m->solved, PETSC_COMM_SELF, PETSC_ERR_ORDER, "call HycoROMPredict() before HycoROMCompare()");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The errors in H1 and its dual. Collective. m and lambda are NULL on the other ranks, and AddForces() uses them on
   rank 0 only. The norms of the paper: displacements in H1, forces in its dual. */
static PetscErrorCode CompareH1(HycoROM m, const PetscReal lambda[], HycoCompared k, HycoErrors *e)
{
  PetscReal lost, size;

  PetscFunctionBegin;
  PetscCall(HycoNormH1(k->norms, k->rows.U, k->rows.value[0], &lost));
  PetscCall(HycoNormH1(k->norms, k->rows.value[0], NULL, &size));
  /* In any norm round-off against 0 is no error. */
  e->u_h1 = size > 0 || e->u > 0 ? HycoRelative(lost, size) : 0;
  for (int rid = 0; rid < 2; rid++) {
    PetscCall(HycoNormDual(k->norms, m, (PetscBool)rid, m ? m->Lambda : NULL, lambda, &lost));
    PetscCall(HycoNormDual(k->norms, m, (PetscBool)rid, lambda, NULL, &size));
    *(rid ? &e->lambda_rid_dual : &e->lambda_dual) = HycoRelative(lost, size);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each rank compares its rows of the whole mesh; the RID and the contacts are compared on rank 0, which has the model.
   *e is set on rank 0 alone. */
PetscErrorCode HycoROMCompare(HycoROM m, HycoFOM f, HycoErrors *e)
{
  HycoErrors found = {0};
  HycoCompared k;
  PetscReal square[2];
  const PetscReal *lambda;

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  HycoCheckGiven(e);
  PetscCheck(f->solved, PETSC_COMM_SELF, PETSC_ERR_ORDER, "call HycoFOMSolve() before HycoROMCompare()");
  HycoOnRoot(HycoComm(f), CompareCheck(m, f));
  PetscCall(CompareKeep(m, f, &k));
  PetscCall(HycoFOMStress(f));
  PetscCall(HycoFOMGetLambda(f, &lambda));
  /* In the order of the file, of which each rank has a block. */
  PetscCall(HycoFOMToRows(f, HYCO_ON_NODES, MPIU_REAL, k->rows.width[0], f->u, k->rows.value[0]));
  PetscCall(HycoFOMToRows(f, HYCO_ON_CELLS, MPIU_REAL, k->rows.width[1], f->sigma, k->rows.value[1]));
  PetscCall(HycoComparisonBring(&k->rows));
  PetscCall(HycoComparisonPredict(&k->rows, m, 0, k->V, k->rows.n[0] * k->rows.width[0]));
  HycoOnRoot(HycoComm(f), HycoROMCompareRID(m, k->rows.rid[0], k->rows.rid[1], lambda, &found, NULL));
  PetscCall(HycoComparisonSquares(&k->rows, square));
  /* Squares are summed over the ranks before the root and the quotient. */
  found.u = HycoRelative(PetscSqrtReal(square[0]), PetscSqrtReal(square[1]));
  PetscCall(CompareH1(m, lambda, k, &found));
  if (f->rank == 0) *e = found;
  PetscFunctionReturn(PETSC_SUCCESS);
}
