/* Pairs: the master of a slave node is one fixed node of the other surface. */
#include "../../surface_normals.h"
#include "../../master_search.h"

/* Of the slave's facet, the tangential distance of a pair's nodes beyond the drawn one: half, beyond which another node
   is nearer. */
#define HYCO_APART_SHARE 0.5

/* Whether each slave node (except those that need none) has its own master at most `far` away. */
static PetscErrorCode AreMatched(const HycoMasterSearch *t, const HycoMatch *m, const HycoProjection at[],
                                 const PetscBool *needs, PetscReal far, PetscBool *matched)
{
  PetscInt *taken;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(t->n_nodes, &taken));
  *matched = PETSC_TRUE;
  /* Two slaves with one master would share its unknowns; the sides of one slave may. */
  for (PetscInt k = 0; k < m->n && *matched; k++) {
    const PetscInt own = HycoMasterSearchNode(t, m->slave[k]) + 1;

    if (!at[k].n && needs && !needs[k]) continue;
    *matched =
        (PetscBool)(at[k].n == 1 && at[k].distance <= far && (!taken[at[k].node[0]] || taken[at[k].node[0]] == own));
    if (*matched) taken[at[k].node[0]] = own;
  }
  PetscCall(PetscFree(taken));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest distance of a pair's nodes along their normals: as given; else any, if the surfaces touch somewhere. */
static PetscReal PairFarthest(PetscReal stated, const HycoMatch *m)
{
  if (stated >= 0) return stated;
  for (PetscInt k = 0; k < m->n; k++) {
    if (m->at[k].n && m->at[k].distance <= m->small) return PETSC_MAX_REAL;
  }
  return m->small;
}

/* For surfaces that do not coincide as drawn: matches nodes along the normals, if all slave nodes that face the
   master are matched one to one; the others have no contact (n = 0). */
static PetscErrorCode MatchAlong(HycoMasterSearch *t, HycoContact c, HycoMatch *m)
{
  HycoProjection *along;
  PetscBool *needs, matched;
  PetscReal stated;

  PetscFunctionBegin;
  PetscCall(HycoContactGetLength(c, "tolerance", &stated));
  PetscCall(HycoMasterSearchReady(t));
  PetscCall(PetscMalloc2(m->n, &along, m->n, &needs));
  for (PetscInt k = 0; k < m->n; k++) {
    const PetscReal *out = HycoMasterSearchOutward(t, m->slave[k]);
    HycoProjection nearest;

    along[k].n = 0; /* this matches mirrored surfaces at any distance */
    /* A node without an outward normal (of no facet) has no line to search along. */
    if (out) HycoPatchesAlongLine(t->patches, t->X + 3 * m->slave[k], out, m->small, &along[k]);
    HycoMasterSearchProject(t, m->slave[k], PETSC_TRUE, &nearest);
    /* Nodes whose nearest facet faces away need no partner: they are on a side that the contact does not meet. */
    needs[k] = (PetscBool)(!out || HycoDot(out, t->normal + 3 * nearest.patch) <= HYCO_OPPOSED);
  }
  PetscCall(AreMatched(t, m, along, needs, PairFarthest(stated, m), &matched));
  for (PetscInt k = 0; matched && k < m->n; k++) {
    const PetscReal *out = HycoMasterSearchOutward(t, m->slave[k]);

    m->at[k] = along[k];
    /* A partner behind the surface, seen through the body. */
    if (m->at[k].n && HycoDot(out, t->normal + 3 * m->at[k].patch) > HYCO_OPPOSED) m->at[k].n = 0;
    m->why[k] = HYCO_FOUND;
  }
  PetscCall(PetscFree2(along, needs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The type for meshes that do not match. */
static const char *ForOthers(HycoMesh m)
{
  return HycoMeshIsQuadratic(m) ? "mortar" : "surface";
}

/* Checks that each master has one slave. A master with two slaves would make rows of B dependent up to round-off. */
static PetscErrorCode CheckMasters(const HycoMasterSearch *t, HycoContact c, const HycoMatch *match)
{
  HycoMesh m = t->fe->mesh;
  PetscInt *partner_of;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_nodes, &partner_of));
  for (PetscInt i = 0; i < m->n_nodes; i++) partner_of[i] = -1;
  for (PetscInt k = 0; k < match->n; k++) {
    const PetscInt j = match->at[k].node[0], own = HycoMasterSearchNode(t, match->slave[k]);

    if ((match->why[k] != HYCO_FOUND && match->why[k] != HYCO_ASKEW) || !match->at[k].n) continue;
    if (partner_of[j] >= 0 && partner_of[j] != own) {
      const PetscInt other = partner_of[j];

      /* Before the error, which does not return here. */
      PetscCall(PetscFree(partner_of));
      HycoFail("contact %s: nodes %d and %d of %s are both nearest to node %d of %s; use matching meshes, or type: %s",
               c->name, (int)m->node_id[other], (int)m->node_id[own], c->slave, (int)m->node_id[j], c->master,
               ForOthers(m));
    }
    partner_of[j] = own;
  }
  PetscCall(PetscFree(partner_of));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nearest nodes, if they match one to one; else nodes along the normals, if these do. Coinciding meshes take the
   first way; the second is for gaps. */
static PetscErrorCode PairMatch(HycoMasterSearch *t, HycoContact c, HycoMatch *m)
{
  PetscBool matched;

  PetscFunctionBegin;
  PetscCall(AreMatched(t, m, m->at, NULL, PetscMin(m->small, m->tolerance), &matched));
  for (PetscInt k = 0; k < m->n; k++) matched = (PetscBool)(matched && m->why[k] == HYCO_FOUND);
  /* A rank's part cannot be matched along normals: one-to-one is a property of the whole surfaces. */
  HycoCheck(matched || !m->part, "contact %s: its nodes are not matched as drawn", c->name);
  if (!matched) PetscCall(MatchAlong(t, c, m));
  PetscCall(CheckMasters(t, c, m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Without a stated tolerance a larger one cannot be advised. */
static PetscErrorCode PairAdvice(HycoMasterSearch *t, HycoContact c, PetscInt n, const PetscInt missed[],
                                 char text[HYCO_LINE])
{
  PetscReal stated;

  PetscFunctionBegin;
  (void)n;
  (void)missed;
  PetscCall(HycoContactGetLength(c, "tolerance", &stated));
  if (stated >= 0)
    HycoFormat(text, "use matching meshes, a larger contact_%s_tolerance, or type: %s", c->name,
               ForOthers(t->fe->mesh));
  else
    HycoFormat(text, "use matching meshes, or type: %s", ForOthers(t->fe->mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Without a find method: a pair keeps its two nodes, and PairVerify() refuses maps that move them apart. */
static PetscErrorCode SetUp(HycoContact c, HycoFE fe, PetscInt index, HycoPairs *pairs)
{
  PetscFunctionBegin;
  PetscCall(HycoMasterSearchMatch(c, fe, index, PETSC_TRUE, PairMatch, PairAdvice, pairs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks that the nodes of pairs still face each other after a map has moved them. */
static PetscErrorCode PairVerify(HycoContact c, HycoFE fe, const HycoPairs *p, PetscInt first, PetscInt last,
                                 const PetscReal normal[])
{
  HycoMesh m = fe->mesh;
  PetscReal *size = NULL;

  PetscFunctionBegin;
  for (PetscInt k = first; k < last; k++) {
    PetscReal now[3], drawn[3], along, limit;

    if (p->master_start[k] == p->master_start[k + 1]) continue;
    HycoPairsJump(p, k, 3, fe->X, now);
    HycoPairsJump(p, k, 3, m->xyz, drawn);
    along = HycoTangentialLength(now, normal + 3 * k);
    /* Allowed: the distance along the surface as drawn, plus half a facet. */
    if (along <= HycoLength(drawn)) continue;
    if (!size) {
      PetscInt g = 0;

      PetscCall(HycoMeshFindGroup(m, "contact", c->slave, &g));
      PetscCall(PetscMalloc1(m->n_nodes, &size));
      HycoSurfaceSizes(fe, g, size);
    }
    limit = size[p->slave[k]];
    if (!(limit > 0) || along <= HycoLength(drawn) + HYCO_APART_SHARE * limit) continue;
    PetscCall(PetscFree(size));
    HycoFail("contact %s: a map moves node %d of %s and node %d of %s, which face each other as drawn, %.4g apart "
             "along the surface, more than half of a facet (%.4g); a pair keeps its nodes: use type: surface",
             c->name, (int)m->node_id[p->slave[k]], c->slave, (int)m->node_id[p->master[p->master_start[k]]], c->master,
             (double)along, (double)limit);
  }
  PetscCall(PetscFree(size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* matched: masters are one to one, which the ranks of a distributed mesh must check together. */
PetscErrorCode HycoContactCreate_Pair(HycoContact contact)
{
  static const struct _HycoContactOps ops = {.setup = SetUp, .verify = PairVerify};

  PetscFunctionBegin;
  PetscCall(HycoMasterSearchDeclare(contact));
  PetscCall(HycoContactSetOps(contact, &ops));
  contact->matched = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}
