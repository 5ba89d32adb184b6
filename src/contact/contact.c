/* B and D: normals, gaps and the rows of the potential contacts at the current parameters. */
#include "facing.h"
#include <hycokinematics.h>

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
        for (PetscInt c = 0; c < 3; c++) vector[3 * m->facets[f * m->nf + a] + c] += el->N[q][a] * n[c];
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The master point of contact k on the moved mesh; an obstacle's is the slave itself, as is that of a slave node that
   faces no master. */
static void MasterPoint(HycoFE fe, const HycoPairs *pairs, PetscInt k, PetscReal x[3])
{
  const PetscInt lo = pairs->master_start[k], hi = pairs->master_start[k + 1];

  for (PetscInt c = 0; c < 3; c++) {
    x[c] = lo == hi ? fe->X[3 * pairs->slave[k] + c] : 0;
    for (PetscInt j = lo; j < hi; j++) x[c] += pairs->weight[j] * fe->X[3 * pairs->master[j] + c];
  }
}

/* The normal of one contact: given, at the master point x, or from the slave's surface. */
static PetscErrorCode PairNormal(HycoFE fe, const HycoContact *c, PetscInt slave, const PetscReal x[3],
                                 const PetscReal *vector, PetscReal n[3])
{
  PetscReal length = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < 3; k++) {
    n[k] = 0;
    if (vector)
      n[k] = vector[3 * slave + k];
    else if (c->normal[k])
      PetscCall(HycoExprEval(c->normal[k], fe->mu, 1, x, &n[k]));
    if (k < fe->dim) length += n[k] * n[k];
  }
  length = PetscSqrtReal(length);
  HycoCheck(length > 0, "contact %s: the normal at node %d has no length", c->name, (int)fe->mesh->node_id[slave]);
  for (PetscInt k = 0; k < 3; k++) n[k] /= length;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal HycoContactNoGap(HycoFE fe)
{
  return 1e-2 * HycoMeshLength(fe->mesh);
}

/* vector: room for 3 reals a node of the mesh. */
static PetscErrorCode Geometry(HycoFE fe, const HycoPairs *pairs, PetscReal vector[], PetscReal normal[],
                               PetscReal gap[])
{
  PetscInt last = -1;
  PetscReal none = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < pairs->n; k++) {
    const HycoContact *c = &fe->scene->contact[pairs->contact[k]];
    const PetscBool given = (PetscBool)(c->normal[0] || c->normal[1] || c->normal[2]);
    const PetscInt s = pairs->slave[k];
    PetscReal *n = normal + 3 * k, x[3];

    if (!given && last != pairs->contact[k]) {
      PetscInt g = 0;

      PetscCall(HycoMeshFindGroup(fe->mesh, "contact", c->slave, &g));
      PetscCall(HycoSurfaceVectors(fe, g, vector));
    }
    last = pairs->contact[k];
    MasterPoint(fe, pairs, k, x);
    PetscCall(PairNormal(fe, c, s, x, given ? NULL : vector, n));
    if (fe->n_turned) HycoTurnNormal(fe, pairs, k, n);
    if (HycoPairsAlone(fe->scene, pairs, k)) {
      if (none == 0) none = HycoContactNoGap(fe);
      gap[k] = none;
    } else if (c->gap) {
      PetscCall(HycoExprEval(c->gap, fe->mu, 1, x, &gap[k]));
    } else {
      gap[k] = 0;
      for (PetscInt d = 0; d < 3; d++) gap[k] += n[d] * (x[d] - fe->X[3 * s + d]);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoContactGeometry(HycoFE fe, HycoPairs *pairs, PetscReal normal[], PetscReal gap[])
{
  PetscReal *vector;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoPairsMove(fe, pairs));
  PetscCall(PetscMalloc1(3 * fe->mesh->n_nodes, &vector));
  ierr = Geometry(fe, pairs, vector, normal, gap);
  PetscCall(PetscFree(vector));
  PetscCall(ierr);
  PetscCall(HycoContactCheck(fe, pairs, normal, gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds `scale` times the normal at a node to a row: to its free unknowns as entries, to its fixed ones in the gap. */
static void AddToRow(HycoFE fe, PetscInt node, PetscReal scale, const PetscReal normal[3], PetscInt *n, PetscInt dof[],
                     PetscReal value[], PetscReal *gap)
{
  for (PetscInt c = 0; c < fe->dim; c++) {
    const PetscReal entry = scale * normal[c];
    const PetscInt i = node * fe->dim + c;

    if (fe->fixed[i]) {
      *gap -= entry * fe->u0[i];
    } else if (PetscAbsReal(entry) > 1e-14) {
      dof[*n] = i;
      value[(*n)++] = entry;
    }
  }
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
  if (!ierr) ierr = Rows(fe, pairs, normal, start, dof, value, gap);
  PetscCall(PetscFree(normal));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoContactAreas(HycoFE fe, const HycoPairs *pairs, PetscReal area[])
{
  HycoMesh m = fe->mesh;
  const HycoElement *el = HycoElementGetFacet(m->type);
  PetscReal *share;
  PetscInt last = -1;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(m->n_nodes, &share));
  for (PetscInt k = 0; k < pairs->n; k++) {
    if (last != pairs->contact[k]) {
      PetscInt g = 0;

      last = pairs->contact[k];
      PetscCall(HycoMeshFindGroup(m, "contact", fe->scene->contact[last].slave, &g));
      PetscCall(PetscArrayzero(share, m->n_nodes));
      for (PetscInt f = 0; f < m->n_facets; f++) {
        for (PetscInt q = 0; m->facet_group[f] == g && q < el->nq; q++) {
          PetscReal n[3];

          PetscCall(HycoFacetNormal(fe, el, f, q, n));
          for (PetscInt a = 0; a < m->nf; a++)
            share[m->facets[f * m->nf + a]] += el->N[q][a] * PetscSqrtReal(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        }
      }
    }
    area[k] = share[pairs->slave[k]];
  }
  PetscCall(PetscFree(share));
  PetscFunctionReturn(PETSC_SUCCESS);
}
