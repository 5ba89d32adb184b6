/* Normals and gaps of the potential contacts at the current parameters. */
#include "surface_normals.h"
#include "nearest.h"
#include <hycokinematics.h>
#include <hycovector.h>

PetscReal HycoContactTouches(HycoFE fe)
{
  return HYCO_POSITION_ROUND_OFF * HycoMeshLength(fe->mesh);
}

/* Removes from a normal the directions of released rigid motions at the contact, so that the discretisation of a
   surface does not resist them. At most dim - 1 directions, orthonormalised; nearly dependent ones are left out. */
void HycoTurnNormal(HycoFE fe, const HycoPairs *pairs, PetscInt k, PetscReal n[3])
{
  PetscReal unit[3][3], length;
  PetscInt n_units = 0;

  for (PetscInt a = 0; a < fe->n_turned && n_units + 1 < fe->dim; a++) {
    PetscReal *d = unit[n_units], before;

    /* The relative motion of slave and master under the a-th released rigid motion; common motion is no sliding. */
    HycoPairsJump(pairs, k, fe->dim, fe->released + (size_t)a * (size_t)fe->n_dof, d);
    before = HycoDot(d, d);
    for (PetscInt b = 0; b < n_units; b++) {
      const PetscReal dot = HycoDot(d, unit[b]);

      for (PetscInt c = 0; c < 3; c++) d[c] -= dot * unit[b][c];
    }
    length = PetscSqrtReal(HycoDot(d, d));
    /* Round-off of an orthonormal motion over all unknowns. */
    if (length <= 1e-9 / PetscSqrtReal((PetscReal)HycoFEUnknowns(fe)) || length * length < 0.01 * before) continue;
    for (PetscInt c = 0; c < 3; c++) d[c] /= length;
    n_units++;
  }
  for (PetscInt b = 0; b < n_units; b++) {
    const PetscReal dot = HycoDot(n, unit[b]);

    for (PetscInt c = 0; c < 3; c++) n[c] -= dot * unit[b][c];
  }
  length = PetscSqrtReal(HycoDot(n, n));
  for (PetscInt c = 0; c < 3 && length > 0; c++) n[c] /= length;
}

/* The master point of contact k on the moved mesh; for an obstacle, a rigid body and a slave node that faces no
   master, the slave itself. */
static void MasterPoint(HycoFE fe, const HycoPairs *pairs, PetscInt k, PetscReal x[3])
{
  const PetscBool rigid = fe->scene->contact[pairs->contact[k]]->rigid;
  const PetscInt lo = pairs->master_start[k], hi = rigid ? lo : pairs->master_start[k + 1];

  for (PetscInt c = 0; c < 3; c++) {
    x[c] = lo == hi ? fe->X[3 * pairs->slave[k] + c] : 0;
    for (PetscInt j = lo; j < hi; j++) x[c] += pairs->weight[j] * fe->X[3 * pairs->master[j] + c];
  }
}

/* Unit normals of the contacts first .. last - 1, all of c, at their master points; vector: room for 3 reals a node. */
static PetscErrorCode GeometryNormals(HycoFE fe, HycoContact c, const HycoPairs *pairs, PetscInt first, PetscInt last,
                                      const HycoContactPoints *points, PetscReal vector[], PetscReal normal[])
{
  PetscInt g = 0;

  PetscFunctionBegin;
  /* In this order: the type's own, the slave surface's averaged normal, the scene's expressions at the master point. */
  PetscCall(PetscArrayzero(normal, 3 * points->n));
  if (c->ops->normal) {
    PetscCall((*c->ops->normal)(c, points, normal));
  } else if (HycoContactAverages(c)) {
    PetscCall(HycoMeshFindGroup(fe->mesh, "contact", c->slave, &g));
    PetscCall(HycoSurfaceVectors(fe, g, vector));
    for (PetscInt k = first; k < last; k++)
      PetscCall(PetscArraycpy(normal + 3 * (k - first), vector + 3 * pairs->slave[k], 3));
    PetscCall(HycoSideSums(fe, g, last - first, pairs->slave + first, pairs->side + first, normal, NULL));
  } else {
    for (PetscInt i = 0; i < 3 * points->n; i++) {
      if (c->normal[i % 3])
        PetscCall(HycoExprEval(c->normal[i % 3], fe->mu, 1, points->master + i - i % 3, &normal[i]));
    }
  }
  for (PetscInt i = 0; i < points->n; i++) {
    PetscReal *n = normal + 3 * i, length = 0;

    for (PetscInt d = 0; d < fe->dim; d++) length += n[d] * n[d];
    length = PetscSqrtReal(length);
    /* Only the mesh's components count: an expression for the third one in 2D would shorten the row of B. */
    HycoCheck(length > 0, "contact %s: the normal at node %d has length zero", c->name,
              (int)fe->mesh->node_id[pairs->slave[first + i]]);
    for (PetscInt d = 0; d < 3; d++) n[d] /= length;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The placeholder is far beyond any displacement, and of a size that does not spoil the scaling of D. */
PetscReal HycoContactNoGap(HycoFE fe)
{
  return 1e-2 * HycoMeshLength(fe->mesh);
}

/* Their gaps for these normals; the gap of a contact that faces no master is a placeholder. */
static PetscErrorCode GeometryGaps(HycoFE fe, HycoContact c, const HycoPairs *pairs, PetscInt first,
                                   const HycoContactPoints *points, const PetscReal normal[], PetscReal gap[])
{
  const PetscReal zero = HycoContactTouches(fe);

  PetscFunctionBegin;
  if (c->ops->gap) PetscCall((*c->ops->gap)(c, points, normal, gap));
  for (PetscInt i = 0; i < points->n; i++) {
    const PetscReal *n = normal + 3 * i, *x = points->master + 3 * i;

    /* In this order: no master at all, the type's gap (set above), the scene's expression, the distance along the
       normal. */
    if (HycoPairsAlone(fe->scene, pairs, first + i)) {
      gap[i] = HycoContactNoGap(fe);
    } else if (!c->ops->gap && c->gap) {
      PetscCall(HycoExprEval(c->gap, fe->mu, 1, x, &gap[i]));
    } else if (!c->ops->gap) {
      gap[i] = 0;
      for (PetscInt d = 0; d < 3; d++) gap[i] += n[d] * (x[d] - points->slave[3 * i + d]);
      /* surfaces that touch have gaps of 0, and not the round-off of a sum: unloaded they would press with it */
      if (PetscAbsReal(gap[i]) <= zero) gap[i] = 0;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* work: room for 3 reals a node of the mesh and 6 a contact. */
static PetscErrorCode GeometryCompute(HycoFE fe, const HycoPairs *pairs, PetscReal work[], PetscReal normal[],
                                      PetscReal gap[])
{
  PetscReal *slave = work + 3 * fe->mesh->n_nodes, *master = slave + 3 * pairs->n;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < pairs->n; k++) {
    PetscCall(PetscArraycpy(slave + 3 * k, fe->X + 3 * pairs->slave[k], 3));
    MasterPoint(fe, pairs, k, master + 3 * k);
  }
  /* Contacts of one scene entry in one batch: expressions are evaluated for all of its points at once. */
  for (PetscInt k = 0, next; k < pairs->n; k = next) {
    HycoContact c = fe->scene->contact[pairs->contact[k]];
    HycoContactPoints points = {.mu = fe->mu, .slave = slave + 3 * k, .master = master + 3 * k};

    next = HycoPairsRun(pairs, k);
    points.n = next - k;
    PetscCall(GeometryNormals(fe, c, pairs, k, next, &points, work, normal + 3 * k));
    /* In the axes of oblique supports, where the rows of B live. */
    for (PetscInt i = k; i < next && fe->n_turned; i++) HycoTurnNormal(fe, pairs, i, normal + 3 * i);
    PetscCall(GeometryGaps(fe, c, pairs, k, &points, normal + 3 * k, gap + k));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Keeps what was computed for the state of fe; not normals that are turned, which is no part of it. Several functions
   ask for normals and gaps at the same positions; fe->drawn numbers these. */
static PetscErrorCode KeepGeometry(HycoFE fe, HycoPairs *pairs, const PetscReal normal[], const PetscReal gap[])
{
  PetscFunctionBegin;
  pairs->drawn = 0;
  if (!fe->drawn || fe->n_turned) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscRealloc((size_t)(4 * pairs->n + 1) * sizeof(PetscReal), &pairs->geometry));
  PetscCall(PetscArraycpy(pairs->geometry, normal, 3 * pairs->n));
  PetscCall(PetscArraycpy(pairs->geometry + 3 * pairs->n, gap, pairs->n));
  pairs->drawn = fe->drawn;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Unit normals (n x 3, from slave to master) and gaps D (n, length) at the current parameters; searches masters
   first if surfaces have moved. Along a path in which nothing of them changes they are computed once. Not
   collective. */
PetscErrorCode HycoContactGeometry(HycoFE fe, HycoPairs *pairs, PetscReal normal[], PetscReal gap[])
{
  PetscReal *work;

  PetscFunctionBegin;
  /* The same positions and variables: normals and gaps are those of the last call. */
  if (fe->drawn && pairs->drawn == fe->drawn && !fe->n_turned) {
    PetscCall(PetscArraycpy(normal, pairs->geometry, 3 * pairs->n));
    PetscCall(PetscArraycpy(gap, pairs->geometry + 3 * pairs->n, pairs->n));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoPairsMove(fe, pairs));
  PetscCall(PetscMalloc1(3 * fe->mesh->n_nodes + 6 * pairs->n, &work));
  HycoFinally(GeometryCompute(fe, pairs, work, normal, gap), PetscCall(PetscFree(work)));
  /* After both are known: an overlap or a normal to the wrong side is an error of the scene. */
  PetscCall(HycoContactCheck(fe, pairs, normal, gap));
  PetscCall(KeepGeometry(fe, pairs, normal, gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}
