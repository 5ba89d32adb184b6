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

PetscErrorCode HycoROMMeasureErrors(HycoROM m, const PetscReal u_full[], const PetscReal sigma[],
                                    const PetscReal inelastic[], const PetscReal lambda[], HycoLost lost[])
{
  const PetscReal *U, *stress, *flow = NULL;
  const PetscInt dim = m->mesh->dim, ns = m->fe->n_sigma;
  Norms u = {0}, rid = {0}, s = {0}, s11 = {0}, lr = {0}, l = {0}, p = {0};

  PetscFunctionBegin;
  PetscCall(HycoROMGetWholeU(m, NULL, &U));
  for (PetscInt k = 0; k < m->whole_nodes * dim; k++) Add(&u, U[k], u_full[k]);
  for (PetscInt i = 0; i < m->mesh->n_nodes; i++) {
    for (PetscInt c = 0; m->role[i] != HYCO_ROLE_OUTSIDE && c < dim; c++)
      Add(&rid, m->U[i * dim + c], u_full[m->mesh->node_whole[i] * dim + c]);
  }
  PetscCall(HycoROMGetRID(m, NULL, NULL, NULL, NULL, NULL, &stress));
  for (PetscInt k = 0; sigma && k < m->mesh->n_cells * ns; k++) {
    const PetscReal reference = sigma[m->mesh->cell_whole[k / ns] * ns + k % ns];

    Add(&s, stress[k], reference);
    if (k % ns == 0) Add(&s11, stress[k], reference);
  }
  if (inelastic) PetscCall(HycoROMGetInelastic(m, NULL, &flow));
  for (PetscInt e = 0; inelastic && e < m->mesh->n_cells; e++) Add(&p, flow[e], inelastic[m->mesh->cell_whole[e]]);
  for (PetscInt k = 0; k < m->pairs.n; k++) {
    Add(&l, m->Lambda[k], lambda[k]);
    if (m->in_rid[k]) Add(&lr, m->Lambda[k], lambda[k]);
  }
  lost[HYCO_ERROR_U] = (HycoLost){PetscSqrtReal(u.lost2), PetscSqrtReal(u.size2)};
  lost[HYCO_ERROR_U_RID] = (HycoLost){rid.lost, rid.size};
  lost[HYCO_ERROR_SIGMA] = (HycoLost){PetscSqrtReal(s.lost2), PetscSqrtReal(s.size2)};
  lost[HYCO_ERROR_SIGMA_11] = (HycoLost){s11.lost, s11.size};
  lost[HYCO_ERROR_LAMBDA] = (HycoLost){PetscSqrtReal(l.lost2), PetscSqrtReal(l.size2)};
  lost[HYCO_ERROR_LAMBDA_RID] = (HycoLost){PetscSqrtReal(lr.lost2), PetscSqrtReal(lr.size2)};
  lost[HYCO_ERROR_INELASTIC] = (HycoLost){PetscSqrtReal(p.lost2), PetscSqrtReal(p.size2)};
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMCompareFields(HycoROM m, const PetscReal u[], const PetscReal sigma[], const PetscReal lambda[],
                                    HycoErrors *e, HycoForceErrors *forces)
{
  HycoLost lost[HYCO_N_ERRORS];
  PetscReal relative[HYCO_N_ERRORS];

  PetscFunctionBegin;
  PetscCall(HycoROMMeasureErrors(m, u, sigma, NULL, lambda, lost));
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) relative[j] = HycoRelative(lost[j].lost, lost[j].size);
  e->u = relative[HYCO_ERROR_U];
  e->u_rid = relative[HYCO_ERROR_U_RID];
  e->sigma = relative[HYCO_ERROR_SIGMA];
  e->sigma_11 = relative[HYCO_ERROR_SIGMA_11];
  e->lambda_rid = relative[HYCO_ERROR_LAMBDA_RID];
  e->lambda = relative[HYCO_ERROR_LAMBDA];
  if (forces)
    *forces = (HycoForceErrors){lost[HYCO_ERROR_LAMBDA].lost, lost[HYCO_ERROR_LAMBDA].size,
                                lost[HYCO_ERROR_LAMBDA_RID].lost, lost[HYCO_ERROR_LAMBDA_RID].size};
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Compare(HycoROM m, HycoFOM f, const PetscReal U[], const PetscReal sigma[], HycoErrors *e)
{
  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  HycoCheck(m->whole_nodes == f->n_nodes && m->whole_cells == f->n_cells && m->pairs.n == f->n_contacts,
            "the model was trained on a mesh of %d nodes and %d cells; the scene's has %d and %d: compare on the "
            "training mesh",
            (int)m->whole_nodes, (int)m->whole_cells, (int)f->n_nodes, (int)f->n_cells);
  PetscCall(HycoROMCompareFields(m, U, sigma, f->lambda, e, NULL));
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
