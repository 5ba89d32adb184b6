/*
  Ties: the displacement of a tied node is that of a point of the master's surface, u_s = sum of w_m u_m. Its unknown is
  replaced by the difference from this sum, which is fixed to 0, as for a support along a direction (oblique.c):
  stiffness, loads and norm are T^T K T, T^T F; HycoFEComplete() computes the displacements. The node is moved to that
  point, so that a rigid motion of the masters is also one of the slaves.
*/
#include <hycokinematics.h>
#include <hycovector.h>

/* Before normals and gaps are computed. A map that opens the tie by more than its tolerance is an error. */
PetscErrorCode HycoTiedPlace(HycoFE fe)
{
  HycoMesh m = fe->mesh;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < m->n_tied; k++) {
    const PetscInt entry = m->tied_entry[k];
    const PetscReal *weight = m->ties->weight + entry;
    PetscReal *X = fe->X + 3 * m->tied[k], at[3] = {0, 0, 0};

    for (PetscInt j = m->tied_start[k]; j < m->tied_start[k + 1]; j++) {
      for (PetscInt c = 0; c < 3; c++) at[c] += weight[j - m->tied_start[k]] * fe->X[3 * m->tied_master[j] + c];
    }
    /* A map that is common to both sides moves the slave with its masters. */
    HycoCheck(HycoDistance(X, at) <= m->ties->reach[entry],
              "tie %s: maps move node %d of %s %g away from its master, farther than the tolerance %g; move both "
              "bodies in the same way there",
              fe->scene->tie[m->ties->tie[entry]].name, (int)m->node_id[m->tied[k]],
              fe->scene->tie[m->ties->tie[entry]].slave, (double)HycoDistance(X, at), (double)m->ties->reach[entry]);
    PetscCall(PetscArraycpy(X, at, 3));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether supports fix component c of the masters of tied node k, so that its own support is redundant. */
static PetscBool MastersHold(HycoFE fe, PetscInt k, PetscInt c)
{
  HycoMesh m = fe->mesh;
  const PetscReal own = fe->u0[m->tied[k] * fe->dim + c], *weight = m->ties->weight + m->tied_entry[k];
  PetscReal u = 0, size = PetscAbsReal(own);

  for (PetscInt j = m->tied_start[k]; j < m->tied_start[k + 1]; j++) {
    const PetscInt dof = m->tied_master[j] * fe->dim + c;

    /* An oblique support fixes another quantity under this unknown's name. */
    if (!fe->fixed[dof] || HycoFEOblique(fe, dof)) return PETSC_FALSE;
    u += weight[j - m->tied_start[k]] * fe->u0[dof];
    size += PetscAbsReal(fe->u0[dof]);
  }
  return (PetscBool)(PetscAbsReal(u - own) <= 1e-9 * size);
}

/* The difference from the masters is fixed to 0. A support of the slave itself must follow from those of its
   masters. */
PetscErrorCode HycoTiedFix(HycoFE fe)
{
  HycoMesh m = fe->mesh;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < m->n_tied; k++) {
    const HycoTie *tie = &fe->scene->tie[m->ties->tie[m->tied_entry[k]]];

    for (PetscInt c = 0; c < fe->dim; c++) {
      const PetscInt dof = m->tied[k] * fe->dim + c;

      HycoCheck(!fe->fixed[dof] || MastersHold(fe, k, c),
                "node %d is tied (tie %s, slave %s) and fixed in %c, and its masters are not fixed in the same way; "
                "exchange slave and master, or remove the node from the support",
                (int)m->node_id[m->tied[k]], tie->name, tie->slave, "xyz"[c]);
      fe->fixed[dof] = PETSC_TRUE;
      /* The unknown is the difference from the masters, not the displacement. */
      fe->u0[dof] = 0;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A direction is the same for slave and masters only if it is constant in space and all masters are in its group. */
PetscErrorCode HycoTiedCheckOblique(HycoFE fe, const HycoFixed *fixed, PetscInt group, PetscInt node)
{
  HycoMesh m = fe->mesh;
  const PetscInt k = HycoMeshTied(m, node), *of = m->group_node + m->group_start[group];
  PetscBool alike = (PetscBool)!HycoExprInSpace(fixed->normal);

  PetscFunctionBegin;
  for (PetscInt c = 0; c < 3; c++) alike = (PetscBool)(alike && !HycoExprInSpace(fixed->direction[c]));
  for (PetscInt j = m->tied_start[k]; j < m->tied_start[k + 1]; j++) {
    PetscInt at;

    PetscCall(PetscFindInt(m->tied_master[j], m->group_start[group + 1] - m->group_start[group], of, &at));
    alike = (PetscBool)(alike && at >= 0);
  }
  HycoCheck(alike,
            "node %d is tied (tie %s) and fixed by %s, and its masters are not fixed in the same way; exchange slave "
            "and master, or remove the node from the support",
            (int)m->node_id[node], fe->scene->tie[m->ties->tie[m->tied_entry[k]]].name, HycoExprKey(fixed->normal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Extends a matrix of n rows to `to` > n rows; the new rows and columns are 0. */
static void TiedGrow(PetscInt n, PetscInt to, PetscReal Ke[])
{
  for (PetscInt r = to - 1; r >= 0; r--) {
    for (PetscInt t = to - 1; t >= 0; t--) Ke[r * to + t] = r < n && t < n ? Ke[r * n + t] : 0;
  }
}

/* Ke <- T^T Ke T, extended by the masters that are not nodes of the cell; the slaves' rows stay for their
   differences. */
void HycoTiedStiffness(HycoFE fe, PetscInt cell, PetscReal Ke[])
{
  HycoMesh m = fe->mesh;
  const PetscInt dim = fe->dim;
  PetscInt node[HYCO_MAX_CELL_NODES], n, own;

  if (!m->ties) return;
  own = HycoMeshOwnNodes(m, cell, node);
  n = HycoMeshCellNodes(m, cell, node);
  if (n > own) TiedGrow(own * dim, n * dim, Ke);
  for (PetscInt a = 0; a < own && !fe->plain; a++) {
    const PetscInt k = HycoMeshTied(m, node[a]), size = n * dim;

    for (PetscInt j = k < 0 ? 0 : m->tied_start[k]; k >= 0 && j < m->tied_start[k + 1]; j++) {
      const PetscReal w = m->ties->weight[m->tied_entry[k] + j - m->tied_start[k]];
      PetscInt b = 0;

      /* It is there: HycoMeshCellNodes() lists the masters of all tied nodes of the cell. */
      while (node[b] != m->tied_master[j]) b++;
      for (PetscInt c = 0; c < dim; c++) {
        for (PetscInt t = 0; t < size; t++) Ke[(b * dim + c) * size + t] += w * Ke[(a * dim + c) * size + t];
        for (PetscInt t = 0; t < size; t++) Ke[t * size + b * dim + c] += w * Ke[t * size + a * dim + c];
      }
    }
  }
}

/* u_slave from its masters. A master is never a slave, so that the order is free. */
void HycoTiedComplete(HycoFE fe, PetscReal u[])
{
  HycoMesh m = fe->mesh;

  for (PetscInt k = 0; k < m->n_tied; k++) {
    const PetscReal *weight = m->ties->weight + m->tied_entry[k];

    for (PetscInt c = 0; c < fe->dim; c++) {
      PetscReal sum = 0;

      for (PetscInt j = m->tied_start[k]; j < m->tied_start[k + 1]; j++)
        sum += weight[j - m->tied_start[k]] * u[m->tied_master[j] * fe->dim + c];
      u[m->tied[k] * fe->dim + c] = sum;
    }
  }
}

/* f_master += w f_slave; the slave keeps its own. */
void HycoTiedGeneralise(HycoFE fe, PetscReal f[])
{
  HycoMesh m = fe->mesh;

  for (PetscInt k = 0; k < m->n_tied; k++) {
    const PetscReal *weight = m->ties->weight + m->tied_entry[k];

    for (PetscInt j = m->tied_start[k]; j < m->tied_start[k + 1]; j++) {
      for (PetscInt c = 0; c < fe->dim; c++)
        f[m->tied_master[j] * fe->dim + c] += weight[j - m->tied_start[k]] * f[m->tied[k] * fe->dim + c];
    }
  }
}

/* Moves the forces of slaves to masters and clears them: for internal forces, whose equilibrium is that of free
   nodes. */
void HycoFEPassTied(HycoFE fe, PetscReal f[])
{
  HycoTiedGeneralise(fe, f);
  for (PetscInt k = 0; k < fe->mesh->n_tied * fe->dim; k++) f[fe->mesh->tied[k / fe->dim] * fe->dim + k % fe->dim] = 0;
}
