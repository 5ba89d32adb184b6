/*
  Mortar contacts: the gap of a slave node is the mean of the distance over the slave's facets around it, weighted by a
  dual function, so that a uniform pressure passes between meshes that do not match.
*/
#include "../../surface_normals.h"
#include "../../mortar.h"

/* Refuses what the integrals do not cover. */
static PetscErrorCode CheckSupported(HycoContact c, HycoFE fe)
{
  HycoMesh m = fe->mesh;
  PetscInt g = 0;

  PetscFunctionBegin;
  /* In 1D a contact is between two points. */
  HycoCheck(m->dim > 1, "contact %s: type mortar integrates over facets, which a 1D mesh does not have; use type: pair",
            c->name);
  PetscCall(HycoMeshFindGroup(m, "contact", c->slave, &g));
  for (PetscInt k = m->group_start[g]; k < m->group_start[g + 1]; k++)
    HycoCheck(
        HycoMeshTied(m, m->group_node[k]) < 0,
        "contact %s: node %d of %s is tied to another surface, and type mortar needs facets whose nodes are free; "
        "use type: surface, or let that surface be the master of the tie",
        c->name, (int)m->node_id[m->group_node[k]], c->slave);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fails for slave nodes without a facing part of the master, of which a scene that gives a tolerance may have some. */
static PetscErrorCode CheckSurfaceNormals(HycoContact c, HycoFE fe, const HycoPairs *p, PetscInt first,
                                          PetscReal tolerance)
{
  const HycoMesh m = fe->mesh;
  PetscInt alone = 0, one = -1;
  PetscReal stated;

  PetscFunctionBegin;
  PetscCall(HycoContactGetLength(c, "tolerance", &stated));
  for (PetscInt k = first; k < p->n; k++) {
    if (p->master_start[k + 1] > p->master_start[k]) continue;
    /* The first such node, to be named. */
    if (!alone++) one = p->slave[k];
  }
  /* A stated tolerance means that nodes beyond it have no contact; but not that all of them have none. */
  if (!alone || (stated >= 0 && (p->facts || alone < p->n - first))) PetscFunctionReturn(PETSC_SUCCESS);
  HycoFail("contact %s: %d of the %d nodes of %s face no part of %s within %g, among them node %d; draw the surfaces "
           "closer, remove these nodes from %s, extend %s, or give a %scontact_%s_tolerance, with which nodes that do "
           "not face %s have no contact",
           c->name, (int)alone, (int)(p->n - first), c->slave, c->master, (double)tolerance, (int)m->node_id[one],
           c->slave, c->master, stated >= 0 ? "larger " : "", c->name, c->master);
}

/* Whether a contact without a master is one of several sides of its node of which another one has a master. */
static PetscBool IsOtherSide(const HycoPairs *p, PetscInt first, PetscInt k)
{
  PetscBool other = PETSC_FALSE;

  for (PetscInt j = PetscMax(k - HYCO_SIDES, first); j < PetscMin(k + HYCO_SIDES, p->n); j++)
    other = (PetscBool)(other || (p->slave[j] == p->slave[k] && p->master_start[j + 1] > p->master_start[j]));
  return other;
}

/* Why the contacts from `first` on have no master: FOUND, they have one, or are near it. */
static PetscErrorCode FindReasons(HycoMasterSearch *t, PetscReal tolerance, PetscInt first, const HycoPairs *p,
                                  PetscInt slave[], PetscBool met[], HycoVerdict why[])
{
  const HycoQuery query = {.tolerance = tolerance, .small = tolerance};
  const PetscBool round = (PetscBool)(t->edges & HYCO_SLAVE_ROUND);

  PetscFunctionBegin;
  if (p->n > first && round) PetscCall(HycoMasterSearchReady(t));
  for (PetscInt k = first; k < p->n; k++) {
    HycoProjection at;

    slave[k - first] = HycoMasterSearchSlave(t, p->slave[k], HycoSideOf(p->side[k]));
    met[k - first] = (PetscBool)(p->master_start[k + 1] > p->master_start[k]);
    why[k - first] = HYCO_FOUND;
    if (!met[k - first] && round)
      PetscCall(HycoMasterSearchNearest(t, &query, p->slave[k], p->side[k], &at, &why[k - first]));
  }
  if (!p->facts) PetscCall(HycoMasterSearchForgive(t, p->n - first, slave, met, why));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Leaves out, from contact `first` on, those without a master that another side of their node has, or, on a surface
   that goes round, that do not look at the master. */
static PetscErrorCode DropAlone(HycoMasterSearch *t, PetscReal tolerance, PetscInt first, HycoPairs *p)
{
  PetscInt *which, *slave, n = 0;
  HycoVerdict *why;
  PetscBool *met;
  HycoPairs kept;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscMalloc4(p->n, &which, p->n, &slave, p->n, &met, p->n, &why));
  ierr = FindReasons(t, tolerance, first, p, slave, met, why);
  for (PetscInt k = 0; k < p->n && !ierr; k++) {
    if (k < first || met[k - first] ||
        (!IsOtherSide(p, first, k) && (why[k - first] == HYCO_FOUND || why[k - first] == HYCO_FAR)))
      which[n++] = k;
  }
  if (n < p->n && !ierr) {
    ierr = HycoPairsSelect(p, n, which, NULL, &kept);
    if (!ierr) ierr = HycoPairsDestroy(p);
    if (!ierr) *p = kept;
  }
  PetscCall(PetscFree4(which, slave, met, why));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fails if no node of the whole surface is left. */
static PetscErrorCode FindDrawn(HycoContact c, HycoFE fe, PetscInt index, PetscInt first, PetscReal tolerance,
                                HycoPairs *pairs)
{
  HycoMasterSearch t;
  HycoPairs listed;
  PetscInt *which, edges;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(pairs->n - first, &which));
  for (PetscInt k = first; k < pairs->n; k++) which[k - first] = k;
  PetscCall(HycoPairsSelect(pairs, pairs->n - first, which, NULL, &listed));
  PetscCall(PetscFree(which));
  pairs->n = first;
  pairs->queries += listed.n;
  HycoFinally(HycoMortarRows(c, fe, &listed, 0, listed.n, tolerance, pairs), PetscCall(HycoPairsDestroy(&listed)));
  PetscCall(HycoPairsEdges(fe, pairs, index, &edges));
  PetscCall(HycoMasterSearchCreate(fe, c, PETSC_FALSE, edges, &t));
  HycoFinally(DropAlone(&t, tolerance, first, pairs), PetscCall(HycoMasterSearchDestroy(&t)));
  HycoCheck(pairs->n > first || pairs->facts,
            "contact %s: no node of %s faces %s within %g; check that these are the "
            "surfaces in contact",
            c->name, c->slave, c->master, (double)tolerance);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On surfaces that a map moves only the slaves are listed. */
static PetscErrorCode SetUp(HycoContact c, HycoFE fe, PetscInt index, HycoPairs *pairs)
{
  const PetscInt first = pairs->n;
  PetscReal tolerance;

  PetscFunctionBegin;
  PetscCall(CheckSupported(c, fe));
  PetscCall(HycoMasterSearchMatch(c, fe, index, PETSC_FALSE, NULL, NULL, pairs));
  if (pairs->n == first || HycoPairsFollows(pairs, index)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoContactGetLength(c, "tolerance", &tolerance));
  if (tolerance < 0) {
    PetscInt g = 0;

    PetscCall(HycoMeshFindGroup(fe->mesh, "contact", c->slave, &g));
    tolerance = pairs->facts ? pairs->facts[index].small : HycoSurfaceTolerance(fe->mesh, g);
  }
  PetscCall(FindDrawn(c, fe, index, first, tolerance, pairs));
  PetscCall(CheckSurfaceNormals(c, fe, pairs, first, tolerance));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At moved nodes. */
static PetscErrorCode MortarFind(HycoContact c, HycoFE fe, const HycoPairs *of, PetscInt first, PetscInt last,
                                 HycoPairs *found)
{
  PetscFunctionBegin;
  PetscCall(HycoMortarRows(c, fe, of, first, last, of->search[of->contact[first]].reach, found));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At moved nodes a slave without facing facets has no masters, and no error: it may come back. integrated: gaps are
   sums over many nodes, so that touching surfaces need a threshold for zero. */
PetscErrorCode HycoContactCreate_Mortar(HycoContact contact)
{
  static const struct _HycoContactOps ops = {.setup = SetUp, .find = MortarFind};

  PetscFunctionBegin;
  PetscCall(HycoMasterSearchDeclare(contact));
  PetscCall(HycoContactSetOps(contact, &ops));
  contact->integrated = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}
