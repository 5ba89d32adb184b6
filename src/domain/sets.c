/* The sets A, I and A_lambda of an RID, by node and by contact: (21)-(22), (32)-(37). */
#include <hycodomain.h>

PetscErrorCode HycoRIDSets(HycoMesh m, const HycoPairs *pairs, const PetscBool in[], PetscInt role[], PetscInt in_rid[])
{
  PetscFunctionBegin;
  for (PetscInt i = 0; i < m->n_nodes; i++) role[i] = HYCO_ROLE_OUTSIDE;
  for (PetscInt k = 0; k < m->n_cells * m->nv; k++) {
    if (in[k / m->nv]) role[m->cells[k]] = HYCO_ROLE_A;
  }
  for (PetscInt k = 0; k < m->n_cells * m->nv; k++) { /* connected to Omega_B */
    if (!in[k / m->nv] && role[m->cells[k]] == HYCO_ROLE_A) role[m->cells[k]] = HYCO_ROLE_INTERFACE;
  }
  for (PetscInt k = 0; k < pairs->n; k++) { /* Gamma_I^C: the gap cannot be computed, one node of the pair is missing */
    const PetscInt s = pairs->slave[k], r = pairs->master[k];

    if (r < 0 || (role[s] == HYCO_ROLE_OUTSIDE) == (role[r] == HYCO_ROLE_OUTSIDE)) continue;
    if (role[s] != HYCO_ROLE_OUTSIDE)
      role[s] = HYCO_ROLE_INTERFACE;
    else
      role[r] = HYCO_ROLE_INTERFACE;
  }
  for (PetscInt k = 0; k < pairs->n; k++)
    in_rid[k] =
        role[pairs->slave[k]] == HYCO_ROLE_A || (pairs->master[k] >= 0 && role[pairs->master[k]] == HYCO_ROLE_A);
  PetscFunctionReturn(PETSC_SUCCESS);
}
