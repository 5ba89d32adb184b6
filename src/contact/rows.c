/* B and D: normals, gaps and the rows of the potential contacts at the current parameters. */
#include "facing.h"
#include <hycokinematics.h>
#include <hycovector.h>

/* Adds the values of tied nodes on a surface, by node and component (v, n_nodes x width), to their masters, which
   have the contact there. Vectors, of which only the direction matters, are added by the size of the weights: on cells
   of second order some are negative, and a sum could have the opposite direction. */
static void PassTied(HycoMesh m, PetscInt width, PetscReal v[])
{
  for (PetscInt k = 0; k < m->n_tied; k++) {
    const PetscReal *weight = m->ties->weight + m->tied_entry[k];

    for (PetscInt j = m->tied_start[k]; j < m->tied_start[k + 1]; j++) {
      const PetscReal w = weight[j - m->tied_start[k]];

      for (PetscInt c = 0; c < width; c++)
        v[m->tied_master[j] * width + c] += (width > 1 ? PetscAbsReal(w) : w) * v[m->tied[k] * width + c];
    }
  }
}

/* Adds n dS at a point of a facet to its node a, by the node's function N. Where a node has no area, on the axis, the
   sum would be round-off: it is then weighted by N^2, and along the axis, by symmetry. */
static void AddVector(HycoFE fe, PetscInt node, PetscReal N, const PetscReal n[3], PetscReal vector[3])
{
  const PetscBool none = HycoNodeHasNoArea(fe, node);

  for (PetscInt c = none; c < 3; c++) vector[c] += (none ? N * N : N) * n[c];
}

PetscErrorCode HycoSurfaceVectors(HycoFE fe, PetscInt group, PetscReal vector[])
{
  HycoMesh m = fe->mesh;
  const HycoElement *el = HycoElementGetFacet(m->type);

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(vector, 3 * m->n_nodes));
  for (PetscInt f = 0; f < m->n_facets; f++) {
    if (m->facet_group[f] != group) continue;
    for (PetscInt q = 0; q < el->nq; q++) {
      PetscReal n[3];

      PetscCall(HycoFacetNormal(fe, el, f, q, n));
      for (PetscInt a = 0; a < m->nf; a++) {
        const PetscInt node = m->facets[f * m->nf + a];

        AddVector(fe, node, el->N[q][a], n, vector + 3 * node);
      }
    }
  }
  PassTied(m, 3, vector);
  PetscFunctionReturn(PETSC_SUCCESS);
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
static PetscErrorCode Normals(HycoFE fe, HycoContact c, const HycoPairs *pairs, PetscInt first, PetscInt last,
                              const HycoContactPoints *points, PetscReal vector[], PetscReal normal[])
{
  PetscInt g = 0;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(normal, 3 * points->n));
  if (c->ops->normal) {
    PetscCall((*c->ops->normal)(c, points, normal));
  } else if (HycoContactAverages(c)) {
    PetscCall(HycoMeshFindGroup(fe->mesh, "contact", c->slave, &g));
    PetscCall(HycoSurfaceVectors(fe, g, vector));
    for (PetscInt k = first; k < last; k++)
      PetscCall(PetscArraycpy(normal + 3 * (k - first), vector + 3 * pairs->slave[k], 3));
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
    HycoCheck(length > 0, "contact %s: the normal at node %d has length zero", c->name,
              (int)fe->mesh->node_id[pairs->slave[first + i]]);
    for (PetscInt d = 0; d < 3; d++) n[d] /= length;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal HycoContactNoGap(HycoFE fe)
{
  return 1e-2 * HycoMeshLength(fe->mesh);
}

/* Their gaps for these normals; the gap of a contact that faces no master is a placeholder. */
static PetscErrorCode Gaps(HycoFE fe, HycoContact c, const HycoPairs *pairs, PetscInt first,
                           const HycoContactPoints *points, const PetscReal normal[], PetscReal gap[])
{
  PetscFunctionBegin;
  if (c->ops->gap) PetscCall((*c->ops->gap)(c, points, normal, gap));
  for (PetscInt i = 0; i < points->n; i++) {
    const PetscReal *n = normal + 3 * i, *x = points->master + 3 * i;

    if (HycoPairsAlone(fe->scene, pairs, first + i)) {
      gap[i] = HycoContactNoGap(fe);
    } else if (!c->ops->gap && c->gap) {
      PetscCall(HycoExprEval(c->gap, fe->mu, 1, x, &gap[i]));
    } else if (!c->ops->gap) {
      gap[i] = 0;
      for (PetscInt d = 0; d < 3; d++) gap[i] += n[d] * (x[d] - points->slave[3 * i + d]);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* work: room for 3 reals a node of the mesh and 6 a contact. */
static PetscErrorCode Geometry(HycoFE fe, const HycoPairs *pairs, PetscReal work[], PetscReal normal[], PetscReal gap[])
{
  PetscReal *slave = work + 3 * fe->mesh->n_nodes, *master = slave + 3 * pairs->n;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < pairs->n; k++) {
    PetscCall(PetscArraycpy(slave + 3 * k, fe->X + 3 * pairs->slave[k], 3));
    MasterPoint(fe, pairs, k, master + 3 * k);
  }
  for (PetscInt k = 0, next; k < pairs->n; k = next) {
    HycoContact c = fe->scene->contact[pairs->contact[k]];
    HycoContactPoints points = {.mu = fe->mu, .slave = slave + 3 * k, .master = master + 3 * k};

    next = HycoPairsRun(pairs, k);
    points.n = next - k;
    PetscCall(Normals(fe, c, pairs, k, next, &points, work, normal + 3 * k));
    for (PetscInt i = k; i < next && fe->n_turned; i++) HycoTurnNormal(fe, pairs, i, normal + 3 * i);
    PetscCall(Gaps(fe, c, pairs, k, &points, normal + 3 * k, gap + k));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoContactGeometry(HycoFE fe, HycoPairs *pairs, PetscReal normal[], PetscReal gap[])
{
  PetscReal *work;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoPairsMove(fe, pairs));
  PetscCall(PetscMalloc1(3 * fe->mesh->n_nodes + 6 * pairs->n, &work));
  ierr = Geometry(fe, pairs, work, normal, gap);
  PetscCall(PetscFree(work));
  PetscCall(ierr);
  PetscCall(HycoContactCheck(fe, pairs, normal, gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The row B T of a node's unknowns for a normal. */
static void OfUnknowns(HycoFE fe, PetscInt node, const PetscReal normal[3], PetscReal along[3])
{
  for (PetscInt c = 0; c < 3; c++) along[c] = normal[c];
  for (PetscInt c = 0; c < fe->dim; c++) {
    const HycoOblique *oblique = HycoFEOblique(fe, node * fe->dim + c);

    for (PetscInt d = 0; oblique && d < fe->dim; d++) along[d] += oblique->a[d] * normal[c];
  }
}

/* Adds `scale` times the normal at a node to a row: entries for its free unknowns, a change of the gap for its fixed
   ones. */
static void AddToRow(HycoFE fe, PetscInt node, PetscReal scale, const PetscReal normal[3], PetscInt *n, PetscInt dof[],
                     PetscReal value[], PetscReal *gap)
{
  PetscReal along[3];

  OfUnknowns(fe, node, normal, along);
  for (PetscInt c = 0; c < fe->dim; c++) {
    const PetscReal entry = scale * along[c];
    const PetscInt i = node * fe->dim + c;

    if (fe->fixed[i]) {
      *gap -= entry * fe->u0[i];
    } else if (PetscAbsReal(entry) > 1e-14) {
      dof[*n] = i;
      value[(*n)++] = entry;
    }
  }
}

/* Contacts with the same slave node must have different normals: the share of each in the force would not be unique
   with parallel ones. before: the previous contact with k's slave, -1: none. */
static PetscErrorCode CheckCorner(HycoFE fe, const HycoPairs *pairs, PetscInt k, const PetscInt before[],
                                  const PetscReal normal[])
{
  const PetscInt slave = pairs->slave[k];
  PetscReal base[3][3], rest[3] = {0, 0, 0}, size = 0;
  PetscInt n = 0;

  PetscFunctionBegin;
  for (PetscInt j = k; j >= 0; j = before[j], n++) { /* k's own last: Gram-Schmidt in reverse order */
    OfUnknowns(fe, slave, normal + 3 * j, base[n]);
    for (PetscInt c = 0; c < 3; c++) base[n][c] = c < fe->dim && !fe->fixed[slave * fe->dim + c] ? base[n][c] : 0;
  }
  for (PetscInt a = n - 1; a >= 0; a--) {
    PetscCall(PetscArraycpy(rest, base[a], 3));
    size = HycoLength(rest);
    for (PetscInt b = a + 1; b < n; b++) {
      const PetscReal along = HycoDot(base[a], base[b]);

      for (PetscInt c = 0; c < 3; c++) rest[c] -= along * base[b][c];
    }
    PetscCall(PetscArraycpy(base[a], rest, 3));
    HycoNormalise(base[a]);
  }
  HycoCheck(!size || HycoLength(rest) > 1e-3 * size,
            "node %d is a slave of the contacts %s and %s, whose normals there are parallel, so that the forces would "
            "not be unique; remove it from one contact",
            (int)fe->mesh->node_id[slave], fe->scene->contact[pairs->contact[before[k]]]->name,
            fe->scene->contact[pairs->contact[k]]->name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckCorners(HycoFE fe, const HycoPairs *pairs, const PetscReal normal[])
{
  PetscInt *last, *before;
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(fe->mesh->n_nodes, &last, pairs->n, &before));
  for (PetscInt i = 0; i < fe->mesh->n_nodes; i++) last[i] = -1;
  for (PetscInt k = 0; k < pairs->n && !ierr; k++) {
    before[k] = -1;
    if (HycoPairsAlone(fe->scene, pairs, k)) continue;
    before[k] = last[pairs->slave[k]];
    last[pairs->slave[k]] = k;
    if (before[k] >= 0) ierr = CheckCorner(fe, pairs, k, before, normal);
  }
  PetscCall(PetscFree2(last, before));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Rows(HycoFE fe, const HycoPairs *pairs, const PetscReal normal[], PetscInt start[],
                           PetscInt dof[], PetscReal value[], PetscReal gap[])
{
  PetscInt n = 0;

  PetscFunctionBegin;
  start[0] = 0;
  for (PetscInt k = 0; k < pairs->n; k++) {
    const PetscReal drawn = gap[k];

    if (!HycoPairsAlone(fe->scene, pairs, k)) AddToRow(fe, pairs->slave[k], 1, normal + 3 * k, &n, dof, value, &gap[k]);
    for (PetscInt j = pairs->master_start[k]; j < pairs->master_start[k + 1]; j++)
      AddToRow(fe, pairs->master[j], -pairs->weight[j], normal + 3 * k, &n, dof, value, &gap[k]);
    start[k + 1] = n;
    if (start[k + 1] == start[k] && !HycoPairsAlone(fe->scene, pairs, k))
      PetscCall(HycoContactCheckStill(fe, pairs, k, drawn, &gap[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoContactRows(HycoFE fe, HycoPairs *pairs, PetscInt start[], PetscInt dof[], PetscReal value[],
                               PetscReal gap[])
{
  PetscReal *normal;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(3 * pairs->n, &normal));
  ierr = HycoContactGeometry(fe, pairs, normal, gap);
  if (!ierr) ierr = CheckCorners(fe, pairs, normal);
  if (!ierr) ierr = Rows(fe, pairs, normal, start, dof, value, gap);
  PetscCall(PetscFree(normal));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The part of each node (share, n_nodes) in the area of the surface `group`. */
static PetscErrorCode Shares(HycoFE fe, PetscInt group, PetscReal share[])
{
  HycoMesh m = fe->mesh;
  const HycoElement *el = HycoElementGetFacet(m->type);

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(share, m->n_nodes));
  for (PetscInt f = 0; f < m->n_facets; f++) {
    for (PetscInt q = 0; m->facet_group[f] == group && q < el->nq; q++) {
      PetscReal n[3];

      PetscCall(HycoFacetNormal(fe, el, f, q, n));
      for (PetscInt a = 0; a < m->nf; a++) {
        const PetscInt node = m->facets[f * m->nf + a];

        if (!HycoNodeHasNoArea(fe, node)) share[node] += el->N[q][a] * PetscSqrtReal(HycoDot(n, n));
      }
    }
  }
  PassTied(m, 1, share);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoContactAreas(HycoFE fe, const HycoPairs *pairs, PetscReal area[])
{
  PetscReal *share;
  PetscInt last = -1;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(fe->mesh->n_nodes, &share));
  for (PetscInt k = 0; k < pairs->n; k++) {
    if (last != pairs->contact[k]) {
      PetscInt g = 0;

      last = pairs->contact[k];
      PetscCall(HycoMeshFindGroup(fe->mesh, "contact", fe->scene->contact[last]->slave, &g));
      PetscCall(Shares(fe, g, share));
    }
    area[k] = share[pairs->slave[k]];
  }
  PetscCall(PetscFree(share));
  PetscFunctionReturn(PETSC_SUCCESS);
}
