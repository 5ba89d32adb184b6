/* Errors of a prediction against the full-order solution. */
#include <hycofomimpl.h>
#include <hycoreducerimpl.h>

/* Sums and maxima of one quantity, and the quotient they end in. */
typedef struct {
  PetscReal lost2, size2, lost, size;
} Norms;

static void Add(Norms *n, PetscReal value, PetscReal reference)
{
  n->lost2 += (value - reference) * (value - reference);
  n->size2 += reference * reference;
  n->lost = PetscMax(n->lost, PetscAbsReal(value - reference));
  n->size = PetscMax(n->size, PetscAbsReal(reference));
}

/* The errors in H1 and its dual. */
static PetscErrorCode CompareH1(HycoROM m, const PetscReal U[], const PetscReal u[], const PetscReal lambda[],
                                HycoErrors *e)
{
  PetscReal lost, size;

  PetscFunctionBegin;
  if (!m->norms) PetscCall(HycoNormsCreate(m->scene, m->whole, &m->norms));
  PetscCall(HycoNormH1(m->norms, U, u, &lost));
  PetscCall(HycoNormH1(m->norms, u, NULL, &size));
  e->u_h1 = HycoRelative(lost, size);
  for (int rid = 0; rid < 2; rid++) {
    PetscCall(HycoNormDual(m->norms, m, (PetscBool)rid, m->Lambda, lambda, &lost));
    PetscCall(HycoNormDual(m->norms, m, (PetscBool)rid, lambda, NULL, &size));
    *(rid ? &e->lambda_rid_dual : &e->lambda_dual) = HycoRelative(lost, size);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMMeasureRID(HycoROM m, const PetscReal u[], const PetscReal sigma[], const PetscReal inelastic[],
                                 const PetscReal lambda[], HycoLost lost[])
{
  const PetscReal *stress, *flow = NULL;
  const PetscInt dim = m->mesh->dim, ns = m->fe->n_sigma;
  Norms rid = {0}, s = {0}, s11 = {0}, lr = {0}, l = {0}, p = {0};

  PetscFunctionBegin;
  for (PetscInt k = 0; k < m->mesh->n_nodes * dim; k++) {
    if (m->role[k / dim] != HYCO_ROLE_OUTSIDE) Add(&rid, m->U[k], u[k]);
  }
  PetscCall(HycoROMGetRID(m, NULL, NULL, NULL, NULL, NULL, &stress));
  for (PetscInt k = 0; sigma && k < m->mesh->n_cells * ns; k++) {
    Add(&s, stress[k], sigma[k]);
    if (k % ns == 0) Add(&s11, stress[k], sigma[k]);
  }
  for (PetscInt k = 0; k < m->pairs.n; k++) {
    Add(&l, m->Lambda[k], lambda[k]);
    if (m->in_rid[k]) Add(&lr, m->Lambda[k], lambda[k]);
  }
  if (inelastic) PetscCall(HycoROMGetInelastic(m, NULL, &flow));
  for (PetscInt k = 0; inelastic && k < m->mesh->n_cells; k++) Add(&p, flow[k], inelastic[k]);
  lost[HYCO_ERROR_U_RID] = (HycoLost){rid.lost, rid.size};
  lost[HYCO_ERROR_SIGMA] = (HycoLost){PetscSqrtReal(s.lost2), PetscSqrtReal(s.size2)};
  lost[HYCO_ERROR_SIGMA_11] = (HycoLost){s11.lost, s11.size};
  lost[HYCO_ERROR_LAMBDA] = (HycoLost){PetscSqrtReal(l.lost2), PetscSqrtReal(l.size2)};
  lost[HYCO_ERROR_LAMBDA_RID] = (HycoLost){PetscSqrtReal(lr.lost2), PetscSqrtReal(lr.size2)};
  lost[HYCO_ERROR_INELASTIC] = (HycoLost){PetscSqrtReal(p.lost2), PetscSqrtReal(p.size2)};
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMCompareRID(HycoROM m, const PetscReal u[], const PetscReal sigma[], const PetscReal lambda[],
                                 HycoErrors *e, HycoForceErrors *forces)
{
  HycoLost lost[HYCO_N_ERRORS] = {{0}};
  const HycoLost *l = &lost[HYCO_ERROR_LAMBDA], *lr = &lost[HYCO_ERROR_LAMBDA_RID];

  PetscFunctionBegin;
  PetscCall(HycoROMMeasureRID(m, u, sigma, NULL, lambda, lost));
  e->u_rid = HycoRelative(lost[HYCO_ERROR_U_RID].lost, lost[HYCO_ERROR_U_RID].size);
  e->sigma = HycoRelative(lost[HYCO_ERROR_SIGMA].lost, lost[HYCO_ERROR_SIGMA].size);
  e->sigma_11 = HycoRelative(lost[HYCO_ERROR_SIGMA_11].lost, lost[HYCO_ERROR_SIGMA_11].size);
  e->lambda_rid = HycoRelative(lr->lost, lr->size);
  e->lambda = HycoRelative(l->lost, l->size);
  if (forces) *forces = (HycoForceErrors){l->lost, l->size, lr->lost, lr->size};
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The part of values on the whole mesh that belongs to n nodes or cells of it. */
static PetscErrorCode TakeRows(PetscInt n, const PetscInt whole[], PetscInt width, const PetscReal value[],
                               PetscReal **rows)
{
  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n * width, rows));
  for (PetscInt i = 0; i < n; i++)
    PetscCall(PetscArraycpy(*rows + i * width, value + (size_t)whole[i] * (size_t)width, width));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Compare(HycoROM m, HycoFOM f, const PetscReal U[], const PetscReal sigma[], HycoErrors *e)
{
  const PetscInt dim = m->mesh->dim;
  const PetscReal *found;
  PetscReal *u_rid, *sigma_rid;
  Norms u = {0};

  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  HycoCheck(m->whole_nodes == f->n_nodes && m->whole_cells == f->n_cells && m->pairs.n == f->n_contacts,
            "the model was trained on a mesh of %d nodes and %d cells; the scene's has %d and %d: compare on the "
            "training mesh",
            (int)m->whole_nodes, (int)m->whole_cells, (int)f->n_nodes, (int)f->n_cells);
  PetscCall(HycoROMGetWholeU(m, NULL, &found));
  for (PetscInt k = 0; k < m->whole_nodes * dim; k++) Add(&u, found[k], U[k]);
  PetscCall(TakeRows(m->mesh->n_nodes, m->mesh->node_whole, dim, U, &u_rid));
  PetscCall(TakeRows(m->mesh->n_cells, m->mesh->cell_whole, m->fe->n_sigma, sigma, &sigma_rid));
  PetscCall(HycoROMCompareRID(m, u_rid, sigma_rid, f->lambda, e, NULL));
  e->u = HycoRelative(PetscSqrtReal(u.lost2), PetscSqrtReal(u.size2));
  PetscCall(PetscFree(u_rid));
  PetscCall(PetscFree(sigma_rid));
  PetscCall(CompareH1(m, m->U_whole, U, f->lambda, e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMCompare(HycoROM m, HycoFOM f, HycoErrors *e)
{
  const PetscReal *U, *sigma;

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  PetscCall(HycoFOMGetSolution(f, NULL, &U, NULL, NULL, NULL, &sigma));
  HycoOnRoot(HycoComm(f), Compare(m, f, U, sigma, e));
  PetscFunctionReturn(PETSC_SUCCESS);
}
