/*
  Which facets around a slave count, on a surface that no map moves: those of which a part looks at the master, whatever
  its distance. Beyond the master's border, or on another side of the body, a facet faces nothing, and its area and
  normal are no part of a contact's.
*/
#include "surface_normals.h"
#include "master_search.h"
#include <hycocarriers.h>
#include <hycokinematics.h>

/* Place on the line from a facet's middle to a node at which it is tested: near the node, but inside. */
#define NEAR_NODE 0.9
/* Distance of a tested point from its facet as a share of the facet's radius: above the round-off of the ray, below any
   gap that is drawn. */
#define LIFTED 1e-3

/* The contacts of one run at the slaves, chained by node: the facets that count, and how many do not. */
typedef struct {
  HycoPairs *p;
  PetscInt *head, *next, *mask, *left; /* by node; by contact of the run: next, mask, left */
  PetscInt first;
  PetscBool all; /* any facet may face nothing; else one with a node that has no master */
} Masks;

/* Whether a node of facet f that can have a contact has no master, while another has one. */
static PetscBool IsLone(const Masks *s, HycoMesh m, PetscInt f)
{
  PetscInt met = 0, lone = 0;

  for (PetscInt a = HycoMeshFirstCarrier(m); a < m->nf; a++) {
    PetscBool master = PETSC_FALSE;

    for (PetscInt k = s->head[m->facets[f * m->nf + a]]; k >= 0; k = s->next[k])
      master = (PetscBool)(master || s->p->master_start[s->first + k + 1] > s->p->master_start[s->first + k]);
    met += master;
    lone += !master;
  }
  return (PetscBool)(met && lone);
}

/* Whether a point at x looks at the master: the search has it as one more slave. small: of the facet's size, below
   which a distance has no direction. */
static PetscErrorCode PointLooks(HycoMasterSearch *t, PetscReal small, const PetscReal out[3], PetscBool *looks)
{
  const PetscInt slave = t->n_nodes + t->n_slots;
  HycoProjection at;
  HycoVerdict why;
  PetscReal r[3];

  PetscFunctionBegin;
  PetscCall(HycoMasterSearchJudge(t, slave, PETSC_MAX_REAL, small, &at, &why));
  *looks = (PetscBool)(why == HYCO_FOUND);
  if (!*looks) PetscFunctionReturn(PETSC_SUCCESS);
  HycoMasterSearchAcross(t, slave, &at, r);
  /* Beside the border, however little: the limit of nodes is a share of the master's facets, which may be wide. */
  *looks = (PetscBool) !(HycoMasterSearchOnBorder(t, &at) && HycoTangentialLength(r, out) > small);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether any part of facet f does: its middle, or a point near one of its nodes. x, out: of the slave that is placed
   there. */
static PetscErrorCode FacetLooks(HycoMasterSearch *t, PetscInt f, PetscReal x[3], PetscReal out[3], PetscBool *looks)
{
  HycoMesh m = t->fe->mesh;
  const PetscInt *node = m->facets + f * m->nf;
  PetscReal middle[3];

  PetscFunctionBegin;
  for (PetscInt c = 0; c < 3; c++) {
    middle[c] = 0;
    for (PetscInt a = 0; a < m->nf; a++) middle[c] += t->fe->X[3 * node[a] + c] / m->nf;
  }
  PetscCall(HycoFacetVector(t->fe, f, out));
  HycoNormalise(out);
  *looks = PETSC_FALSE;
  /* A facet on the axis has no normal. */
  for (PetscInt a = -1; a < m->nf && !*looks && HycoDot(out, out) > 0; a++) {
    const PetscReal *end = a < 0 ? middle : t->fe->X + 3 * node[a];

    for (PetscInt c = 0; c < 3; c++) x[c] = middle[c] + NEAR_NODE * (end[c] - middle[c]);
    PetscCall(PointLooks(t, LIFTED * HycoDistance(middle, t->fe->X + 3 * node[0]), out, looks));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void NoteFacet(Masks *s, HycoMesh m, PetscInt f, PetscBool counts)
{
  for (PetscInt a = 0; a < m->nf; a++) {
    const PetscInt at = f * m->nf + a;

    for (PetscInt k = s->head[m->facets[at]]; k >= 0; k = s->next[k]) {
      const PetscInt side = s->p->side[s->first + k];

      if (side != HYCO_ONE_SIDE && side != m->facet_side[at]) continue;
      if (m->facet_rank[at] >= HYCO_MASK_BITS)
        s->left[k] = PETSC_MIN_INT / 2; /* too many facets: all count */
      else if (counts)
        s->mask[k] |= 1 << m->facet_rank[at];
      else
        s->left[k]++;
    }
  }
}

static PetscErrorCode NoteFacets(HycoMasterSearch *t, Masks *s)
{
  HycoMesh m = t->fe->mesh;
  HycoMasterSearch one = *t;
  PetscReal *X, *outward;
  const PetscInt n = t->n_nodes + t->n_slots;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(3 * (n + 1), &X, 3 * (n + 1), &outward));
  PetscCall(PetscArraycpy(X, t->X, 3 * n));
  PetscCall(PetscArraycpy(outward, t->outward, 3 * n));
  one.X = X;
  one.outward = outward;
  for (PetscInt f = 0; f < m->n_facets; f++) {
    PetscBool looks, near = PETSC_FALSE;

    for (PetscInt a = 0; a < m->nf && m->facet_group[f] == t->slave; a++)
      near = (PetscBool)(near || s->head[m->facets[f * m->nf + a]] >= 0);
    if (!near) continue;
    looks = PETSC_TRUE;
    if (s->all || IsLone(s, m, f)) PetscCall(FacetLooks(&one, f, X + 3 * n, outward + 3 * n, &looks));
    NoteFacet(s, m, f, looks);
  }
  PetscCall(PetscFree2(X, outward));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The tree and the border are there before the copy of the search is made: they belong to it. */
static PetscErrorCode MasksRun(HycoMasterSearch *t, PetscInt last, Masks *s)
{
  PetscFunctionBegin;
  if (!t->n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoMasterSearchReady(t));
  PetscCall(HycoMasterSearchBorder(t));
  PetscCall(NoteFacets(t, s));
  for (PetscInt k = 0; k < last - s->first; k++) {
    PetscInt *side = &s->p->side[s->first + k];

    if (s->left[k] > 0 && s->mask[k]) *side = (HYCO_SIDES + 1) * s->mask[k] + *side + 1;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of contact number `index`, whose pairs from `first` on are complete. Not collective. */
PetscErrorCode HycoPairsMask(HycoFE fe, PetscInt index, PetscInt first, HycoPairs *p)
{
  const HycoContact c = fe->scene->contact[index];
  const PetscInt n = p->n - first;
  HycoMasterSearch t;
  const HycoMesh m = fe->mesh;
  Masks s = {.p = p, .first = first};
  PetscInt edges, g = 0;
  PetscBool any;

  PetscFunctionBegin;
  PetscCall(HycoPairsEdges(fe, p, index, &edges));
  if (fe->dim == 1 || !n || !c->master || c->rigid || HycoPairsFollows(p, index)) PetscFunctionReturn(PETSC_SUCCESS);
  any = s.all = (PetscBool)(edges & HYCO_SLAVE_EDGE);
  PetscCall(PetscMalloc1(fe->mesh->n_nodes, &s.head));
  PetscCall(PetscMalloc1(n, &s.next));
  PetscCall(PetscCalloc1(n, &s.mask));
  PetscCall(PetscCalloc1(n, &s.left));
  for (PetscInt i = 0; i < fe->mesh->n_nodes; i++) s.head[i] = -1;
  for (PetscInt k = 0; k < n; k++) {
    s.next[k] = s.head[p->slave[first + k]];
    s.head[p->slave[first + k]] = k;
  }
  PetscCall(HycoMeshFindGroup(m, "contact", c->slave, &g));
  for (PetscInt f = 0; f < m->n_facets && !any; f++) any = (PetscBool)(m->facet_group[f] == g && IsLone(&s, m, f));
  PetscCall(PetscMemzero(&t, sizeof(t)));
  if (any) PetscCall(HycoMasterSearchCreate(fe, c, PETSC_FALSE, edges, &t));
  HycoFinally(MasksRun(&t, p->n, &s), HycoFreeAll(&s.head, &s.next, &s.mask, &s.left);
              PetscCall(HycoMasterSearchDestroy(&t)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
