/*
  The rigid motions of bodies whose shape changes, and the work of the loads on them, from the places of the nodes at mu
  and a table (body_motions.c): Z^T (F - B^T L) = 0 holds on the moved shape whatever is interpolated.
*/
#include <hycobodies.h>

/* Points the table's tensor to its values. */
void HycoBodiesSetMotions(HycoSubstructures b)
{
  HycoTensor *t = &b->motions.table.tensor;
  const PetscReal *node = b->motions.node;

  t->dim = b->n_theta;
  for (PetscInt p = 0; p < b->n_theta; node += t->n[p++]) {
    t->n[p] = b->motions.n_nodes[p];
    t->degree[p] = t->n[p] - 1;
    t->x[p] = node;
  }
}

void HycoBodiesRigidRow(HycoSubstructures b, PetscInt k, const PetscReal X[3], PetscInt c, PetscReal row[6])
{
  const PetscReal *frame = b->motions.frame + 4 * k;
  PetscReal at[3];
  PetscInt n;

  for (PetscInt d = 0; d < 3; d++) at[d] = (X[d] - frame[d]) / frame[3];
  n = HycoRigidRow(b->dim, at, c, row);
  /* Beyond them the row has the numbers of the component alone. */
  for (PetscInt a = n; a < 6; a++) row[a] = 0;
}

/* The centres of the nodes of the body's cell, at its reference and now. */
static void BodiesMotionsCentres(HycoBodiesWork o, PetscInt k, PetscReal before[3], PetscReal now[3])
{
  HycoMesh m = o->bodies->probe;
  const PetscInt e = o->bodies->cell[k];

  for (PetscInt c = 0; c < 3; c++) before[c] = now[c] = 0;
  for (PetscInt v = 0; v < 3 * m->nv; v++) {
    before[v % 3] += o->X0[3 * k * m->nv + v] / m->nv;
    now[v % 3] += o->fe->X[3 * m->cells[e * m->nv + v / 3] + v % 3] / m->nv;
  }
}

/* Z of the unknowns of the surfaces of body k, whose nodes are turned back to the body's own axes. */
static void PlaceMotions(HycoBodiesWork o, const HycoBodiesSurface *s, PetscInt k, const PetscReal rigid[])
{
  const HycoSubstructures b = o->bodies;
  const HycoPose *pose = &o->pose[k];
  PetscReal before[3], now[3];

  BodiesMotionsCentres(o, k, before, now);
  for (PetscInt i = 0; i < o->n_placed; i++) {
    const PetscInt *loc = o->loc + o->placed[i] * b->dim;
    PetscReal from[3], X[3] = {0, 0, 0}, row[6];

    if (o->placed_in[i] != k) continue;
    for (PetscInt c = 0; c < 3; c++) from[c] = (s->fe->X[3 * o->placed[i] + c] - now[c]) / pose->s;
    HycoPoseTurn(pose->Q, b->dim, PETSC_TRUE, from, X);
    for (PetscInt c = 0; c < 3; c++) X[c] += before[c];
    for (PetscInt c = 0; c < b->dim; c++) {
      if (loc[c] < 0 || loc[c] >= b->ns) continue;
      HycoBodiesRigidRow(b, k, X, c, row);
      for (PetscInt j = 0; j < b->p; j++) {
        PetscReal *z = &o->Z[loc[c] * b->p + j];

        *z = 0;
        for (PetscInt a = 0; a < 6 && b->motions.body[j] == k; a++) *z += rigid[6 * j + a] * row[a];
      }
    }
  }
}

PetscErrorCode HycoBodiesMoveMotions(HycoBodiesWork o, const HycoBodiesSurface *s, const PetscReal mu[])
{
  const HycoSubstructures b = o->bodies;
  PetscReal x[HYCO_MAX_PARAMETERS], *rigid;

  PetscFunctionBegin;
  if (!b->motions.table.rows) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt p = 0; p < b->n_theta; p++) x[p] = HycoBodiesVariable(b->variable[p], mu[b->theta[p]]);
  PetscCall(PetscMalloc1(b->motions.table.rows, &rigid));
  PetscCall(HycoGridFieldEvaluate(&b->motions.table, x, rigid));
  for (PetscInt i = 0; i < b->p; i++) {
    const PetscInt k = b->motions.body[i];
    const PetscReal *moment = rigid + 6 * (b->p + k * b->r);

    if (b->body[k].n_samples == 1) continue;
    for (PetscInt j = 0; j < b->r; j++, moment += 6) {
      o->work[i * b->r + j] = 0;
      for (PetscInt a = 0; a < 6; a++) o->work[i * b->r + j] += rigid[6 * i + a] * moment[a];
    }
  }
  for (PetscInt k = 0; k < b->n && s; k++) {
    if (b->body[k].n_samples > 1) PlaceMotions(o, s, k, rigid);
  }
  PetscCall(PetscFree(rigid));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the work of the loads -- */

/* Of the terms of a load's work, their sum: the coefficients carry the interpolation of the loads, whose residual is
   INDEPENDENT_LOAD. */
#define CANCELS 1e-11

/* The work of the loads on motion i; 0 where vectors of the basis cancel, as it is of a load that does not act on
   it. */
PetscReal HycoBodiesLoadWork(HycoBodiesWork o, PetscInt i)
{
  const PetscInt r = o->bodies->r;
  PetscReal sum = 0, terms = 0;

  for (PetscInt j = 0; j < r; j++) {
    const PetscReal term = o->work[i * r + j] * o->c[j];

    sum += term;
    terms += PetscAbsReal(term);
  }
  return PetscAbsReal(sum) > CANCELS * terms ? sum : 0;
}

/* The round-off of these works: loads that balance themselves leave it beside the work of tiny ones. */
PetscReal HycoBodiesLoadRounding(HycoBodiesWork o)
{
  const HycoSubstructures b = o->bodies;
  PetscReal all = 0, most = 0;

  for (PetscInt j = 0; j < b->r; j++) all += PetscAbsReal(o->c[j]);
  for (PetscInt i = 0; i < b->p * b->r; i++) most = PetscMax(most, PetscAbsReal(o->work[i]));
  return HYCO_WORK_ROUND_OFF * most * all;
}

PetscBool HycoBodiesLoaded(HycoBodiesWork o)
{
  PetscReal all = 0;

  for (PetscInt j = 0; j < o->bodies->r; j++) all += PetscAbsReal(o->c[j]);
  return (PetscBool)(all > 0);
}
