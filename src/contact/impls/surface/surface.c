/*
  Surface contacts: the master of a slave node is its projection on the master's facets. On surfaces that a map moves,
  the projection is computed on the moved nodes: a slave node has a master if the nearest point's normal opposes its
  own, that point is within reach, and the node is not past the master's border.
*/
#include "../../surface_normals.h"
#include "../../master_search.h"

/* If the scene gives a largest distance of masters, a node that faces none within it has no contact. */
static PetscErrorCode SurfaceFind(HycoMasterSearch *t, HycoContact c, HycoMatch *m)
{
  PetscReal stated;

  PetscFunctionBegin;
  (void)t;
  PetscCall(HycoContactGetLength(c, "tolerance", &stated));
  for (PetscInt k = 0; k < m->n && stated >= 0; k++) {
    if (m->why[k] == HYCO_FOUND) continue;
    m->at[k].n = 0;
    m->why[k] = HYCO_FOUND;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the user can do about nodes without a master. */
static PetscErrorCode SurfaceAdvice(HycoMasterSearch *t, HycoContact c, PetscInt n, const PetscInt missed[],
                                    char text[HYCO_LINE])
{
  PetscBool facing = PETSC_FALSE;
  PetscReal farthest = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) {
    HycoProjection at;
    HycoVerdict why;

    /* Without any limit of distance: does the node face the master at all? */
    PetscCall(HycoMasterSearchJudge(t, missed[k], PETSC_MAX_REAL, 0, &at, &why));
    facing = (PetscBool)(facing || why == HYCO_FOUND);
    farthest = PetscMax(farthest, at.distance);
  }
  if (facing)
    HycoFormat(text,
               "draw the surfaces closer, or allow the distance by contact_%s_tolerance %.4g; nodes that do not face "
               "%s then have no contact",
               c->name, 1.01 * (double)farthest, c->master);
  else
    HycoFormat(text, "remove nodes that do not face %s from %s, or extend %s", c->master, c->slave, c->master);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On moved surfaces the position as drawn need not face anything: only the slaves are listed, without the judgement
   that SurfaceFind() belongs to. */
static PetscErrorCode SetUp(HycoContact c, HycoFE fe, PetscInt index, HycoPairs *pairs)
{
  PetscFunctionBegin;
  PetscCall(HycoMasterSearchMatch(c, fe, index, PETSC_FALSE, HycoPairsFollows(pairs, index) ? NULL : SurfaceFind,
                                  SurfaceAdvice, pairs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The contacts first .. last - 1 of a moved surface in one tree, in their order, also without a master (n = 0): sizes
   stay the same at every parameter. */
static PetscErrorCode FindIn(HycoMasterSearch *t, const HycoPairs *of, PetscInt first, PetscInt last, HycoPairs *found)
{
  const PetscInt index = of->contact[first];
  const HycoQuery query = {.moved = PETSC_TRUE, .tolerance = of->search[index].reach};

  PetscFunctionBegin;
  /* A facet has at most nf nodes: the width of a projection. */
  PetscCall(HycoPairsReserve(found, last - first, t->nf));
  for (PetscInt k = first; k < last; k++) {
    HycoProjection at;
    HycoVerdict why;

    PetscCall(HycoMasterSearchNearest(t, &query, of->slave[k], of->side[k], &at, &why));
    HycoPairsAppend(found, index, of->slave[k], of->side[k], at.n, at.node, at.weight);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Logged as a whole. */
static PetscErrorCode FindAll(HycoMasterSearch *t, const HycoPairs *of, PetscInt first, PetscInt last, HycoPairs *found)
{
  PetscFunctionBegin;
  HycoLogged(HYCO_EVENT_SEARCH, FindIn(t, of, first, last, found));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SurfaceFindMoved(HycoContact c, HycoFE fe, const HycoPairs *of, PetscInt first, PetscInt last,
                                       HycoPairs *found)
{
  HycoMasterSearch t;
  PetscInt edges;

  PetscFunctionBegin;
  PetscCall(HycoPairsEdges(fe, of, of->contact[first], &edges));
  PetscCall(HycoMasterSearchCreate(fe, c, PETSC_FALSE, edges, &t));
  HycoFinally(FindAll(&t, of, first, last, found), PetscCall(HycoMasterSearchDestroy(&t)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoContactCreate_Surface(HycoContact contact)
{
  static const struct _HycoContactOps ops = {.setup = SetUp, .find = SurfaceFindMoved};

  PetscFunctionBegin;
  PetscCall(HycoMasterSearchDeclare(contact));
  PetscCall(HycoContactSetOps(contact, &ops));
  PetscFunctionReturn(PETSC_SUCCESS);
}
