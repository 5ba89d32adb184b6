/*
  Supports along any direction: n.u = v at a node. Of the node's displacements, the one with the largest entry of n is
  expressed by the others,

    u_c = o + sum of a_d u_d,    a_d = -n_d / n_c,  o = v / n_c,

  and its unknown is replaced by the offset u_c - sum of a_d u_d, which is fixed to o, as other supports fix their
  unknowns. The stiffness, the loads and the contacts' rows are those of the new unknowns, T^T K T, T^T F and B T;
  HycoFEComplete() computes the displacements. Several directions at a node are eliminated one by one.
*/
#include <hycokinematics.h>
#include <hycovector.h>

/* Of a normal's length, what other supports at the node leave: 4.5e6 eps; the supports say the same. */
#define ELIMINATED 1e-9
/* Of a normal's length, what other supports at the node leave: two planes at less than 0.6 degrees are refused, since
   their line moves by 100 times the error of either. */
#define NEARLY_PARALLEL 1e-2

/* The room stays for the next parameters. */
void HycoObliqueClear(HycoFE fe)
{
  fe->n_oblique = 0;
}

/* Eliminates from the row n.u = v the other directions at the node. */
static void ObliqueSubstitute(HycoFE fe, PetscInt node, PetscReal n[3], PetscReal *v)
{
  for (PetscInt k = 0; k < fe->n_oblique; k++) {
    const HycoOblique *o = &fe->oblique[k];
    PetscReal share;

    if (o->node != node) continue;
    share = n[o->c];
    n[o->c] = 0;
    for (PetscInt d = 0; d < fe->dim; d++) n[d] += share * o->a[d];
    /* The offset of the other support moves to the right-hand side. */
    *v -= share * fe->u0[node * fe->dim + o->c];
  }
}

/* For a row without free displacements: checks that it agrees with what is already fixed. */
static PetscErrorCode CheckSame(HycoFE fe, PetscInt node, const PetscReal n[3], PetscReal v, PetscReal size,
                                const char key[])
{
  PetscReal rest = v;

  PetscFunctionBegin;
  for (PetscInt d = 0; d < fe->dim; d++) {
    /* All components with an entry of n are fixed here. */
    rest -= n[d] * fe->u0[node * fe->dim + d];
    size = PetscMax(size, PetscAbsReal(fe->u0[node * fe->dim + d]));
  }
  HycoCheck(PetscAbsReal(rest) <= 1e-9 * size,
            "node %d is fixed twice along the direction of %s, to values that differ by %g; remove it from one support",
            (int)fe->mesh->node_id[node], key, (double)rest);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds n.u = v at a node. The largest free entry of n is eliminated (|a_d| <= 1 then bounds the growth of
   round-off); entries equal to 1e-9 count as ties, and the first component wins, so that round-off does not choose.
   Not collective. */
PetscErrorCode HycoObliqueAdd(HycoFE fe, PetscInt support, PetscInt node, const PetscReal direction[3], PetscReal value,
                              const char key[])
{
  PetscReal n[3], v = value, best = 0;
  HycoOblique *o;
  PetscInt c = -1;

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(n, direction, 3));
  HycoNormalise(n);
  ObliqueSubstitute(fe, node, n, &v);
  for (PetscInt d = 0; d < fe->dim; d++) {
    if (fe->fixed[node * fe->dim + d] || PetscAbsReal(n[d]) <= best * (1 + 1e-9)) continue;
    best = PetscAbsReal(n[d]);
    c = d;
  }
  /* The direction depends on supports before: it must ask for the same value. */
  if (best <= ELIMINATED) {
    PetscCall(CheckSame(fe, node, n, v, PetscAbsReal(value), key));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  HycoCheck(best > NEARLY_PARALLEL,
            "%s: at node %d its direction is nearly parallel to that of another support; give both the same direction",
            key, (int)fe->mesh->node_id[node]);
  HycoGrow(fe->n_oblique, fe->room_oblique, fe->oblique);
  o = &fe->oblique[fe->n_oblique];
  *o = (HycoOblique){.node = node, .c = c, .support = support};
  PetscCall(PetscArraycpy(o->n, direction, 3));
  HycoNormalise(o->n);
  /* Fixed components keep their coefficient: their u0 enters the sum (HycoFEComplete()). */
  for (PetscInt d = 0; d < fe->dim; d++) o->a[d] = d == c ? 0 : -n[d] / n[c];
  fe->fixed[node * fe->dim + c] = PETSC_TRUE;
  fe->u0[node * fe->dim + c] = v / n[c];
  /* Earlier rows must not refer to an unknown that is now dependent. */
  for (PetscInt k = 0; k < fe->n_oblique; k++) { /* substitutes u_c in other rows */
    HycoOblique *other = &fe->oblique[k];
    PetscReal share;

    if (other->node != node) continue;
    share = other->a[c];
    other->a[c] = 0;
    for (PetscInt d = 0; d < fe->dim; d++) other->a[d] += share * o->a[d];
    fe->u0[node * fe->dim + other->c] += share * fe->u0[node * fe->dim + c];
  }
  fe->n_oblique++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The inverse list, from unknown to its support, for the element loops. */
PetscErrorCode HycoObliqueIndex(HycoFE fe)
{
  PetscFunctionBegin;
  if (!fe->n_oblique) PetscFunctionReturn(PETSC_SUCCESS);
  if (!fe->oblique_at) PetscCall(PetscMalloc1(fe->n_dof, &fe->oblique_at));
  for (PetscInt k = 0; k < fe->n_dof; k++) fe->oblique_at[k] = -1;
  for (PetscInt k = 0; k < fe->n_oblique; k++) fe->oblique_at[fe->oblique[k].node * fe->dim + fe->oblique[k].c] = k;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At fe's parameters; NULL for all other unknowns. */
const HycoOblique *HycoFEOblique(HycoFE fe, PetscInt dof)
{
  return fe->n_oblique && fe->oblique_at[dof] >= 0 ? &fe->oblique[fe->oblique_at[dof]] : NULL;
}

/* Ke <- T^T Ke T in place: rows and columns of the eliminated component are added to those of the free ones; its own
   stay, as the diagonal of the fixed unknown. */
void HycoObliqueStiffness(HycoFE fe, PetscInt cell, PetscReal Ke[])
{
  const PetscInt dim = fe->dim;
  PetscInt node[HYCO_MAX_CELL_NODES], n;

  if (!fe->n_oblique || fe->plain) return;
  n = dim * HycoMeshCellNodes(fe->mesh, cell, node);
  for (PetscInt k = 0; k < n; k++) {
    const HycoOblique *o = HycoFEOblique(fe, node[k / dim] * dim + k % dim);

    for (PetscInt d = 0; o && d < dim; d++) {
      const PetscInt to = k - k % dim + d;

      /* Rows, then columns: the columns' loop takes the new entries of row `to`, which gives a^2 on the diagonal. */
      for (PetscInt j = 0; o->a[d] != 0 && j < n; j++) Ke[to * n + j] += o->a[d] * Ke[k * n + j];
      for (PetscInt j = 0; o->a[d] != 0 && j < n; j++) Ke[j * n + to] += o->a[d] * Ke[j * n + k];
    }
  }
}
