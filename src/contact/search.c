/*
  The queries of a search for masters: the projection of each slave node, and its position relative to the master.
*/
#include "master_search.h"

/* Of 1, a cosine, what a side of an edge opposes a facet of the master less than another side at the node: from there
   on it lies beside the facet, as the underside of a wedge whose flank lies on it (tests/contact/whole_skins.py). */
#define BESIDE 0.2

/* Whether the direction to a master point misses it: by its angle to the normal, or past the border. */
static PetscErrorCode FindMiss(HycoMasterSearch *t, PetscInt slave, const HycoProjection *at, HycoVerdict *why)
{
  const PetscReal *out = HycoMasterSearchOutward(t, slave);
  PetscReal r[3];
  PetscBool past = PETSC_FALSE;

  PetscFunctionBegin;
  HycoMasterSearchAcross(t, slave, at, r);
  /* A normal that is farther than the limit angle from the direction to the master point. */
  if (PetscAbsReal(HycoDot(r, out)) < -HYCO_OPPOSED * at->distance) *why = HYCO_ASKEW;
  PetscCall(HycoMasterSearchIsPast(t, slave, at, &past));
  if (past) *why = HYCO_PAST;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether another side at the slave's node meets its facet of the master. */
static PetscBool IsBeside(const HycoMasterSearch *t, PetscInt slave, const HycoProjection *at)
{
  const PetscReal *normal = t->normal + 3 * at->patch;
  PetscBool beside = PETSC_FALSE;
  PetscInt first, n;

  if (slave < t->n_nodes || slave >= t->n_nodes + t->n_slots) return PETSC_FALSE;
  HycoMasterSearchSides(t, HycoMasterSearchNode(t, slave), HYCO_ONE_SIDE, &first, &n);
  for (PetscInt j = first; j < first + n; j++)
    beside =
        (PetscBool)(beside || HycoDot(t->outward + 3 * j, normal) < HycoDot(t->outward + 3 * slave, normal) - BESIDE);
  return beside;
}

/* Verdict on a slave as drawn: met, turned away, too far, askew (its normal misses the master point), past the
   border. Within `small` the direction is round-off and is not judged. On a surface that goes round, of which parts
   face nothing by nature, only a slave in front of the master is too far. */
PetscErrorCode HycoMasterSearchJudge(HycoMasterSearch *t, PetscInt slave, PetscReal tolerance, PetscReal small,
                                     HycoProjection *at, HycoVerdict *why)
{
  HycoProjection nearest;
  PetscBool far;

  PetscFunctionBegin;
  *why = HYCO_FOUND;
  HycoMasterSearchProject(t, slave, PETSC_FALSE, at);
  if (!at->n) {
    /* Reported before the distance, because a larger tolerance would not help. */
    *why = HYCO_TURNED;
    HycoMasterSearchProject(t, slave, PETSC_TRUE, at);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (IsBeside(t, slave, at)) {
    *why = HYCO_TURNED;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  far = (PetscBool)(at->distance > tolerance);
  if (HycoMasterSearchOutward(t, slave) && at->distance > small && (!far || (t->edges & HYCO_SLAVE_ROUND)))
    PetscCall(FindMiss(t, slave, at, why));
  if (!far || *why != HYCO_FOUND) PetscFunctionReturn(PETSC_SUCCESS);
  *why = HYCO_FAR;
  if (!(t->edges & HYCO_EDGES)) PetscFunctionReturn(PETSC_SUCCESS);
  /* Another part of the master is nearer. */
  HycoMasterSearchProject(t, slave, PETSC_TRUE, &nearest);
  if (nearest.patch != at->patch && at->distance > 2 * nearest.distance) *why = HYCO_TURNED;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On moved surfaces; n = 0: it has no master. reach: masters beyond it are none, as in training; a large number
   otherwise. */
static PetscErrorCode MasterSearchUpdate(HycoMasterSearch *t, PetscInt slave, PetscReal reach, HycoProjection *at)
{
  PetscBool past;

  PetscFunctionBegin;
  HycoMasterSearchProject(t, slave, PETSC_FALSE, at);
  if (at->n && (at->distance > reach || IsBeside(t, slave, at))) at->n = 0;
  if (!at->n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoMasterSearchIsPast(t, slave, at, &past));
  if (past) at->n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Also the place of the event of -log_view. */
static PetscErrorCode AnswerAll(HycoMasterSearch *t, const HycoQuery *q, PetscInt n, const PetscInt slave[],
                                HycoProjection at[], HycoVerdict why[])
{
  PetscFunctionBegin;
  /* The tree is not made for a rank without slaves. */
  if (n) PetscCall(HycoMasterSearchReady(t));
  for (PetscInt k = 0; k < n; k++) {
    why[k] = HYCO_FOUND;
    /* On moved surfaces every slave stays a contact, with or without a master: no verdict. */
    if (q->moved)
      PetscCall(MasterSearchUpdate(t, slave[k], q->tolerance, &at[k]));
    else
      PetscCall(HycoMasterSearchJudge(t, slave[k], q->tolerance, q->small, &at[k], &why[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscInt FindRoot(PetscInt root[], PetscInt i)
{
  while (root[i] != i) i = root[i] = root[root[i]];
  return i;
}

/* Facets are joined at the nodes, on edges at the sides, that they share. */
PetscErrorCode HycoMasterSearchForgive(const HycoMasterSearch *t, PetscInt n, const PetscInt slave[],
                                       const PetscBool met[], HycoVerdict why[])
{
  const HycoMesh m = t->fe->mesh;
  PetscBool *meets, any = PETSC_FALSE;
  PetscInt *root;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) any = (PetscBool)(any || met[k]);
  if (!any || !(t->edges & HYCO_SLAVE_EDGE)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(t->n_nodes + t->n_slots, &root));
  PetscCall(PetscCalloc1(t->n_nodes + t->n_slots, &meets));
  for (PetscInt i = 0; i < t->n_nodes + t->n_slots; i++) root[i] = i;
  for (PetscInt k = 0, first = 0; k < m->n_facets * m->nf; k++) {
    if (m->facet_group[k / m->nf] != t->slave || m->facet_side[k] == HYCO_NO_SIDE) continue;
    if (k % m->nf == 0) first = HycoMasterSearchSlave(t, m->facets[k], m->facet_side[k]);
    root[FindRoot(root, HycoMasterSearchSlave(t, m->facets[k], m->facet_side[k]))] = FindRoot(root, first);
  }
  for (PetscInt k = 0; k < n; k++) meets[FindRoot(root, slave[k])] |= met[k];
  for (PetscInt k = 0; k < n; k++) {
    PetscInt first = slave[k], sides = 1;
    PetscBool alone = PETSC_TRUE;

    if (first < t->n_nodes) HycoMasterSearchSides(t, first, HYCO_ONE_SIDE, &first, &sides);
    for (PetscInt j = first; j < first + sides; j++) alone = (PetscBool)(alone && !meets[FindRoot(root, j)]);
    if (why[k] == HYCO_FAR && alone) why[k] = HYCO_TURNED;
  }
  HycoFreeAll(&root, &meets);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscInt RankOf(const HycoProjection *at, HycoVerdict why)
{
  if (why == HYCO_FOUND) return at->n ? 2 : 0;
  return why == HYCO_FAR;
}

PetscBool HycoVerdictIsBetter(const HycoProjection *at, HycoVerdict why, const HycoProjection *best, HycoVerdict other)
{
  const PetscInt rank = RankOf(at, why), than = RankOf(best, other);

  return (PetscBool)(rank > than || (rank == 2 && than == 2 && at->distance < best->distance));
}

/* Not logged: it is for one node. */
PetscErrorCode HycoMasterSearchNearest(HycoMasterSearch *t, const HycoQuery *q, PetscInt node, PetscInt side,
                                       HycoProjection *at, HycoVerdict *why)
{
  PetscInt first, n;

  PetscFunctionBegin;
  HycoMasterSearchSides(t, node, side, &first, &n);
  for (PetscInt j = first; j < first + n; j++) {
    HycoProjection here;
    HycoVerdict verdict;

    PetscCall(AnswerAll(t, q, 1, &j, &here, &verdict));
    if (j > first && !HycoVerdictIsBetter(&here, verdict, at, *why)) continue;
    *at = here;
    *why = verdict;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Logged as a whole: an event per node would cost more than the projection. */
PetscErrorCode HycoMasterSearchFind(HycoMasterSearch *t, const HycoQuery *q, PetscInt n, const PetscInt slave[],
                                    HycoProjection at[], HycoVerdict why[])
{
  PetscFunctionBegin;
  HycoLogged(HYCO_EVENT_SEARCH, AnswerAll(t, q, n, slave, at, why));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the pairs of one contact. Nearest node, whatever its normal: for the partitioner's edges a hint is enough. */
static PetscErrorCode AddNeighbours(HycoMesh m, PetscInt slave, PetscInt master, PetscInt *n, PetscInt pairs[])
{
  const PetscInt lo = m->group_start[master], n_masters = m->group_start[master + 1] - lo;
  HycoPatches patches;

  PetscFunctionBegin;
  /* An empty master is an error that the search of contacts words better. */
  if (!n_masters) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoPatchesCreate(m->xyz, n_masters, 1, 1, m->group_node + lo, NULL, &patches));
  for (PetscInt k = m->group_start[slave]; k < m->group_start[slave + 1]; k++, (*n)++) {
    HycoProjection at;

    HycoPatchesProject(patches, m->xyz + 3 * m->group_node[k], NULL, &at);
    pairs[2 * *n] = m->group_node[k];
    pairs[2 * *n + 1] = at.node[0];
  }
  PetscCall(HycoPatchesDestroy(&patches));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Pairs (slave, nearest master node) for heavy edges of the partition, on the mesh as drawn; the caller frees them.
   Rigid bodies are left out, because one node would draw all slaves to one rank. */
PetscErrorCode HycoContactsNeighbours(HycoScene scene, HycoMesh m, PetscInt *n, PetscInt **pairs)
{
  PetscInt g[2] = {0, 0}, room = 0;

  PetscFunctionBegin;
  *n = 0;
  /* The first pass counts, the second fills. */
  for (PetscInt pass = 0; pass < 2; pass++) {
    if (pass) PetscCall(PetscMalloc1(2 * room, pairs));
    for (PetscInt k = 0; k < scene->n_contacts; k++) {
      HycoContact c = scene->contact[k];

      if (!c->master || c->rigid) continue;
      PetscCall(HycoMeshFindGroup(m, "contact", c->slave, &g[0]));
      PetscCall(HycoMeshFindGroup(m, "contact", c->master, &g[1]));
      room += m->group_start[g[0] + 1] - m->group_start[g[0]];
      if (pass) PetscCall(AddNeighbours(m, g[0], g[1], n, *pairs));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
