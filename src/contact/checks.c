/* Checks that a contact's geometry is suitable for small displacements, and measures whether they stay small. */
#include "surface_normals.h"
#include <hycovector.h>

/* Of the slave's facet, the largest overlap before any load: half, beyond which the nearest facet may be one of the
   body's other side. */
#define HYCO_OVERLAP_SHARE 0.5

/* Cosine of the angle between a given normal and the surface's outward one, below which it is refused: 84 degrees,
   while surfaces that face each other are within 72. */
#define ALONG_SURFACE 0.1

/* The size of facets around a node, of one surface at a time: the slave's or the master's of a contact of the scene. */
typedef struct {
  const char *group;
  PetscReal *size;
} Sizes;

/* Sizes of a whole surface are computed once, when the first of its nodes is needed. */
static PetscErrorCode SizeAt(HycoFE fe, const char group[], PetscInt node, Sizes *s, PetscReal *size)
{
  PetscInt g = 0;

  PetscFunctionBegin;
  /* Groups follow each other in the order of the contacts: pointers suffice. */
  if (s->group != group) {
    PetscCall(HycoMeshFindGroup(fe->mesh, "contact", group, &g));
    if (!s->size) PetscCall(PetscMalloc1(fe->mesh->n_nodes, &s->size));
    HycoSurfaceSizes(fe, g, s->size);
    s->group = group;
  }
  *size = s->size[node];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest overlap allowed for contact k before any load, and whether its gap exceeds it; a gap given in the
   scene may. */
static PetscErrorCode AllowedOverlap(HycoFE fe, const HycoPairs *p, PetscInt k, PetscReal gap, Sizes *sizes,
                                     PetscReal *allowed, PetscBool *deep)
{
  HycoContact c = fe->scene->contact[p->contact[k]];
  PetscReal size = 0;

  PetscFunctionBegin;
  *deep = PETSC_FALSE;
  /* A gap given by the scene is no overlap of drawn surfaces. */
  if (c->gap || c->ops->gap || gap >= 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoContactGetLength(c, "overlap", allowed));
  /* The scene gives none: half of the facets around the slave. */
  if (*allowed < 0) {
    PetscCall(SizeAt(fe, c->slave, p->slave[k], sizes, &size));
    *allowed = size > 0 ? HYCO_OVERLAP_SHARE * size : PETSC_MAX_REAL;
  }
  *deep = (PetscBool)(-gap > *allowed + HYCO_LENGTH_ROUND_OFF * HycoMeshLength(fe->mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses the overlap, with the name of the deepest contact k. */
static PetscErrorCode RefuseOverlap(HycoFE fe, const HycoPairs *p, PetscInt k, PetscReal gap, PetscReal allowed)
{
  HycoContact c = fe->scene->contact[p->contact[k]];
  PetscReal r[3], stated;

  PetscFunctionBegin;
  PetscCall(HycoContactGetLength(c, "overlap", &stated));
  HycoPairsJump(p, k, 3, fe->X, r);
  /* The advice has 1 % more than the deepest node, so that it works when copied. */
  HycoFail("contact %s: before any load node %d of %s lies %.4g deep in %s (its master point is %.4g away), and %.4g "
           "is allowed%s; check the positions of the bodies, or allow an intended overlap by contact_%s_overlap %.4g",
           c->name, (int)fe->mesh->node_id[p->slave[k]], c->slave, -(double)gap, c->master, (double)HycoLength(r),
           (double)allowed, stated < 0 ? ", half of its facet" : "", c->name, -1.01 * (double)gap);
}

/* Refuses contacts that overlap too deeply before any load, then lets each type verify its pairs. The deepest
   contact is named, whatever the order. Not collective. */
PetscErrorCode HycoContactCheck(HycoFE fe, const HycoPairs *pairs, const PetscReal normal[], const PetscReal gap[])
{
  Sizes sizes = {NULL, NULL};
  PetscReal allowed = 0, worst = 0;
  PetscInt deepest = -1;
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < pairs->n && !ierr; k++) {
    PetscReal here;
    PetscBool deep;

    /* A slave that faces no master has no overlap. */
    if (pairs->master_start[k] == pairs->master_start[k + 1]) continue;
    ierr = AllowedOverlap(fe, pairs, k, gap[k], &sizes, &here, &deep);
    if (!ierr && deep && (deepest < 0 || gap[k] < worst)) {
      deepest = k;
      worst = gap[k];
      allowed = here;
    }
  }
  PetscCall(PetscFree(sizes.size));
  PetscCall(ierr);
  for (PetscInt k = 0, next; k < pairs->n; k = next) {
    HycoContact c = fe->scene->contact[pairs->contact[k]];

    /* The pairs of one contact are contiguous: verify() gets all of them at once. */
    next = HycoPairsRun(pairs, k);
    if (c->ops->verify) PetscCall((*c->ops->verify)(c, fe, pairs, k, next, normal));
  }
  /* After verify(): normals that do not face each other may be the cause. */
  if (deepest >= 0) PetscCall(RefuseOverlap(fe, pairs, deepest, worst, allowed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The least cosine between a given normal and the outward normal at a slave that faces a master, and the largest at any
   slave; 2: there is none. */
static PetscErrorCode FindCosines(HycoFE fe, const HycoPairs *p, PetscInt first, PetscInt last,
                                  const PetscReal normal[], PetscReal *least, PetscReal *most)
{
  const HycoContact c = fe->scene->contact[p->contact[first]];
  PetscReal *cosine;
  PetscInt g = 0;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(fe->mesh, "contact", c->slave, &g));
  PetscCall(PetscMalloc1(last - first, &cosine));
  PetscCall(HycoSidesFacing(fe, g, last - first, p->slave + first, normal + 3 * first, cosine, NULL));
  for (PetscInt k = first; k < last; k++) {
    *most = PetscMax(*most, cosine[k - first]);
    if (c->master && !c->rigid && !HycoPairsAlone(fe->scene, p, k)) *least = PetscMin(*least, cosine[k - first]);
  }
  PetscCall(PetscFree(cosine));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On all ranks alike: a rank may have only those slaves of an obstacle that look away from it. */
PetscErrorCode HycoContactCheckNormals(MPI_Comm comm, HycoFE fe, const HycoPairs *pairs, const PetscReal normal[])
{
  const HycoScene s = fe->scene;
  PetscReal *worst; /* by contact: the least cosine, minus the largest one */

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(2 * s->n_contacts, &worst));
  for (PetscInt c = 0; c < s->n_contacts; c++) {
    worst[2 * c] = 2;
    worst[2 * c + 1] = 2; /* minus -2: no slave */
  }
  for (PetscInt k = 0, next; k < pairs->n; k = next) {
    const PetscInt c = pairs->contact[k];
    PetscReal most = -2;

    next = HycoPairsRun(pairs, k);
    if (HycoContactAverages(s->contact[c])) continue;
    PetscCall(FindCosines(fe, pairs, k, next, normal, &worst[2 * c], &most));
    worst[2 * c + 1] = -most;
  }
  HycoAllreduce(worst, 2 * s->n_contacts, MPIU_REAL, MPI_MIN, comm);
  for (PetscInt c = 0; c < s->n_contacts; c++) {
    const PetscReal cosine = PetscMin(worst[2 * c], -worst[2 * c + 1]);
    const PetscBool into = (PetscBool)(cosine < -ALONG_SURFACE);

    if (cosine >= ALONG_SURFACE || worst[2 * c + 1] == 2) continue;
    PetscCall(PetscFree(worst));
    HycoFail("contact %s: its normal points %s %s; give one that points out of the slave's body, or none, and the "
             "surface's own is taken",
             s->contact[c]->name, into ? "into the body of its slave" : "along the surface of its slave",
             s->contact[c]->slave);
  }
  PetscCall(PetscFree(worst));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The size of the master's facet at contact k, or else of the slave's. */
static PetscErrorCode FacetAt(HycoFE fe, const HycoPairs *p, PetscInt k, Sizes sizes[2], PetscReal *size)
{
  HycoContact c = fe->scene->contact[p->contact[k]];

  PetscFunctionBegin;
  *size = 0;
  if (p->master_start[k] == p->master_start[k + 1]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SizeAt(fe, c->master, p->master[p->master_start[k]], &sizes[0], size));
  /* A master of single nodes has no facets. */
  if (!(*size > 0)) PetscCall(SizeAt(fe, c->slave, p->slave[k], &sizes[1], size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On a mesh with the whole surfaces; a model keeps them, whose mesh may lack facets of masters. */
PetscErrorCode HycoContactFacets(HycoFE fe, const HycoPairs *pairs, PetscReal facet[])
{
  Sizes sizes[2] = {{NULL, NULL}, {NULL, NULL}};
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < pairs->n && !ierr; k++) ierr = FacetAt(fe, pairs, k, sizes, &facet[k]);
  HycoFreeAll(&sizes[0].size, &sizes[1].size);
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For an active contact, the tangential motion over the facet's size: the measure of whether displacements are small.
   overlap: of the unloaded gaps. index: from contacts to entries of L and facet (NULL: the same). For remarks to the
   user: a large sliding or overlap makes small displacements or pairs doubtful, but is no error. */
PetscErrorCode HycoContactMeasure(HycoFE fe, HycoPairs *pairs, const PetscReal u[], const PetscReal L[],
                                  const PetscInt index[], const PetscReal facet[], HycoContactFacts *state)
{
  Sizes sizes[2] = {{NULL, NULL}, {NULL, NULL}};
  PetscReal *normal, *gap;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(state, sizeof(*state)));
  PetscCall(PetscMalloc2(3 * pairs->n, &normal, pairs->n, &gap));
  ierr = HycoContactGeometry(fe, pairs, normal, gap);
  for (PetscInt k = 0; !ierr && k < pairs->n; k++) {
    const PetscInt at = index ? index[k] : k;
    PetscReal r[3], size;

    /* It faces no master: there is nothing to measure. */
    if (HycoPairsAlone(fe->scene, pairs, k)) continue;
    state->n_facing++;
    state->overlap = PetscMax(state->overlap, -gap[k]);
    if (pairs->master_start[k] == pairs->master_start[k + 1] || !(L[at] > 0)) continue;
    HycoPairsJump(pairs, k, fe->dim, u, r);
    /* Surfaces that a map moves are whole in every mesh, and may meet other masters. */
    if (facet && !HycoPairsMoved(pairs, k))
      size = facet[at];
    else
      ierr = FacetAt(fe, pairs, k, sizes, &size);
    if (!ierr && size > 0) state->sliding = PetscMax(state->sliding, HycoTangentialLength(r, normal + 3 * k) / size);
  }
  if (state->overlap <= HYCO_LENGTH_ROUND_OFF * HycoMeshLength(fe->mesh)) state->overlap = 0;
  PetscCall(PetscFree2(normal, gap));
  HycoFreeAll(&sizes[0].size, &sizes[1].size);
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
