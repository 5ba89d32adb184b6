/*
  Contacts without a free unknown, because all of their nodes are fixed. They have no effect, but the prescribed
  displacements may violate them; then no solution exists.
*/
#include "surface_normals.h"
#include <hycokinematics.h>

/* Scale of the round-off of a gap: its terms may cancel. */
static PetscReal EffectLargest(const PetscReal v[], PetscInt n)
{
  PetscReal largest = 0;

  for (PetscInt c = 0; c < n; c++) largest = PetscMax(largest, PetscAbsReal(v[c]));
  return largest;
}

/* *left: the gap that the prescribed displacements leave (length). Negative beyond round-off is an error; within it,
   0. */
PetscErrorCode HycoContactCheckStill(HycoFE fe, const HycoPairs *pairs, PetscInt k, PetscReal gap, PetscReal *left)
{
  const PetscInt slave = pairs->slave[k], dim = fe->dim;
  /* The gap is a difference of positions: its round-off is theirs. */
  PetscReal size =
      PetscMax(PetscAbsReal(gap) + EffectLargest(fe->X + 3 * slave, 3) + EffectLargest(fe->u0 + slave * dim, dim),
               HycoMeshLength(fe->mesh));

  PetscFunctionBegin;
  for (PetscInt j = pairs->master_start[k]; j < pairs->master_start[k + 1]; j++) {
    const PetscInt i = pairs->master[j];

    size = PetscMax(size, EffectLargest(fe->X + 3 * i, 3) + EffectLargest(fe->u0 + i * dim, dim));
  }
  HycoCheck(*left >= -HYCO_LENGTH_ROUND_OFF * size,
            "contact %s: node %d is fixed%s, and its prescribed displacement penetrates by %g, so that no solution "
            "exists; change the support or the gap",
            fe->scene->contact[pairs->contact[k]]->name, (int)fe->mesh->node_id[slave],
            pairs->master_start[k + 1] > pairs->master_start[k] ? ", as is its master" : "", (double)-*left);
  *left = PetscMax(*left, 0); /* round-off */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The completely fixed nodes of groups without masters, which HycoPairsFind() leaves out, as contacts without masters.
   The caller destroys it. So that prescribed displacements that penetrate an obstacle are an error, not a solution
   without a force. */
static PetscErrorCode FixedAtObstacles(HycoFE fe, const HycoPairs *pairs, HycoPairs *still)
{
  HycoMesh m = fe->mesh;
  HycoScene s = fe->scene;
  PetscBool *is_slave;
  PetscInt room = 0;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(still, sizeof(*still)));
  PetscCall(PetscCalloc1(m->n_nodes, &is_slave));
  for (PetscInt k = 0; k < s->n_contacts; k++) room += s->contact[k]->master ? 0 : HYCO_SIDES * m->n_nodes;
  PetscCall(PetscMalloc1(room, &still->slave));
  PetscCall(PetscMalloc1(room, &still->contact));
  PetscCall(PetscMalloc1(room, &still->side));
  PetscCall(PetscCalloc1(room + 1, &still->master_start));
  for (PetscInt k = 0; k < s->n_contacts; k++) {
    PetscInt n, *slave, *side;

    /* With a master the contact acts on its nodes, whatever the slave is. */
    if (s->contact[k]->master) continue;
    PetscCall(PetscArrayzero(is_slave, m->n_nodes)); /* of this contact: another one does not check its obstacle */
    for (PetscInt j = 0; j < pairs->n; j++) {
      if (pairs->contact[j] == k) is_slave[pairs->slave[j]] = PETSC_TRUE;
    }
    PetscCall(HycoContactSlaves(fe, pairs, k, &n, &slave, &side));
    for (PetscInt j = 0; j < n; j++) {
      const PetscInt i = slave[j];
      PetscBool fixed = (PetscBool)(!is_slave[i] && HycoMeshTied(m, i) < 0);

      for (PetscInt c = 0; c < fe->dim; c++) fixed = (PetscBool)(fixed && fe->fixed[i * fe->dim + c]);
      if (!fixed) continue;
      still->slave[still->n] = i;
      still->side[still->n] = side[j];
      still->contact[still->n++] = k;
    }
    HycoFreeAll(&slave, &side);
  }
  PetscCall(PetscFree(is_slave));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fails if the prescribed displacement of a fixed node penetrates its obstacle. */
static PetscErrorCode CheckObstacles(HycoFE fe, HycoPairs *still, PetscReal normal[], PetscReal gap[])
{
  PetscFunctionBegin;
  PetscCall(HycoContactGeometry(fe, still, normal, gap));
  for (PetscInt k = 0; k < still->n; k++) {
    PetscReal left = gap[k];

    for (PetscInt c = 0; c < fe->dim; c++) {
      const HycoOblique *oblique = HycoFEOblique(fe, still->slave[k] * fe->dim + c);
      PetscReal u = fe->u0[still->slave[k] * fe->dim + c];

      /* An obliquely supported component follows the others: u_c = u0_c + sum of a_d u_d. */
      for (PetscInt d = 0; oblique && d < fe->dim; d++) u += oblique->a[d] * fe->u0[still->slave[k] * fe->dim + d];
      left -= normal[3 * k + c] * u;
    }
    PetscCall(HycoContactCheckStill(fe, still, k, gap[k], &left));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Number of contacts without a free unknown, after the check that none is violated; start: of the rows of B. Not
   collective. */
PetscErrorCode HycoContactCountStill(HycoFE fe, const HycoPairs *pairs, const PetscInt start[], PetscInt *n)
{
  HycoPairs still;
  PetscReal *normal, *gap;

  PetscFunctionBegin;
  PetscCall(FixedAtObstacles(fe, pairs, &still));
  *n = still.n;
  /* A slave without a master at these positions is not one without an effect. */
  for (PetscInt k = 0; k < pairs->n; k++) *n += start[k + 1] == start[k] && !HycoPairsAlone(fe->scene, pairs, k);
  PetscCall(PetscMalloc2(3 * still.n, &normal, still.n, &gap));
  HycoFinally(CheckObstacles(fe, &still, normal, gap), PetscCall(PetscFree2(normal, gap));
              PetscCall(HycoPairsDestroy(&still)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
