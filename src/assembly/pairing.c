/*
  Potential contacts: the nodes of an obstacle's group, or pairs of nodes by minimal distance between two surfaces
  (section 3), found on the mesh as it stands in the file.
*/
#include <hycofe.h>
#include <stdlib.h>

/* The master nodes in boxes of one edge length, sorted by box, so that a search looks at 3^dim boxes. */
typedef struct {
  long long key;
  PetscInt node;
} Boxed;

typedef struct {
  PetscReal lo[3], edge;
  PetscInt n;
  Boxed *item;
} Boxes;

static long long BoxKey(const PetscInt at[3])
{
  return ((long long)at[0] * 2097152 + at[1]) * 2097152 + at[2];
}

static void BoxOf(const Boxes *b, const PetscReal x[3], PetscInt at[3])
{
  for (PetscInt c = 0; c < 3; c++) at[c] = (PetscInt)PetscFloorReal(PetscMin((x[c] - b->lo[c]) / b->edge, 2e6)) + 2;
}

static int CompareBoxed(const void *a, const void *b)
{
  const Boxed *p = (const Boxed *)a, *q = (const Boxed *)b;

  if (p->key != q->key) return p->key < q->key ? -1 : 1;
  return (p->node > q->node) - (p->node < q->node);
}

static PetscReal Distance(HycoMesh m, PetscInt i, PetscInt j)
{
  PetscReal sum = 0;

  for (PetscInt c = 0; c < 3; c++)
    sum += (m->xyz[3 * i + c] - m->xyz[3 * j + c]) * (m->xyz[3 * i + c] - m->xyz[3 * j + c]);
  return PetscSqrtReal(sum);
}

static PetscErrorCode BoxesCreate(HycoMesh m, PetscInt n, const PetscInt node[], PetscReal edge, Boxes *b)
{
  PetscReal span = 0;

  PetscFunctionBegin;
  for (PetscInt c = 0; c < 3; c++) {
    PetscReal hi = PETSC_MIN_REAL;

    b->lo[c] = PETSC_MAX_REAL;
    for (PetscInt k = 0; k < n; k++) {
      b->lo[c] = PetscMin(b->lo[c], m->xyz[3 * node[k] + c]);
      hi = PetscMax(hi, m->xyz[3 * node[k] + c]);
    }
    span = PetscMax(span, hi - b->lo[c]);
  }
  b->edge = PetscMax(PetscMax(edge, span * 1e-6), PETSC_SMALL * 1e-200);
  b->n = n;
  PetscCall(PetscMalloc1(n, &b->item));
  for (PetscInt k = 0; k < n; k++) {
    PetscInt at[3];

    BoxOf(b, m->xyz + 3 * node[k], at);
    b->item[k].key = BoxKey(at);
    b->item[k].node = node[k];
  }
  qsort(b->item, (size_t)n, sizeof(Boxed), CompareBoxed);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The nearest master within one edge of node i, or -1; of equally near ones the smallest tag. */
static PetscInt BoxesNearest(HycoMesh m, const Boxes *b, PetscInt i)
{
  PetscInt at[3], best = -1;
  PetscReal distance = 0;

  BoxOf(b, m->xyz + 3 * i, at);
  for (PetscInt k = 0; k < 27; k++) {
    const PetscInt near[3] = {at[0] + k % 3 - 1, at[1] + k / 3 % 3 - 1, at[2] + k / 9 - 1};
    const long long key = BoxKey(near);
    PetscInt lo = 0, hi = b->n;

    if (near[0] < 0 || near[1] < 0 || near[2] < 0) continue;
    while (lo < hi) {
      const PetscInt mid = lo + (hi - lo) / 2;

      if (b->item[mid].key < key)
        lo = mid + 1;
      else
        hi = mid;
    }
    for (; lo < b->n && b->item[lo].key == key; lo++) {
      const PetscInt j = b->item[lo].node;
      const PetscReal d = Distance(m, i, j);

      if (best < 0 || d < distance || (d == distance && m->node_id[j] < m->node_id[best])) {
        best = j;
        distance = d;
      }
    }
  }
  return best;
}

/* The tolerance when none is stated: a tenth of the shortest edge between the slave's facet corners. */
static PetscReal DefaultTolerance(HycoMesh m, PetscInt group)
{
  PetscReal shortest = PETSC_MAX_REAL;

  for (PetscInt f = 0; f < m->n_facets; f++) {
    if (m->facet_group[f] != group) continue;
    for (PetscInt v = 0; v + 1 < m->nf; v++)
      shortest = PetscMin(shortest, Distance(m, m->facets[f * m->nf + v], m->facets[f * m->nf + v + 1]));
  }
  return shortest < PETSC_MAX_REAL ? shortest / 10 : 0;
}

static PetscErrorCode Complain(HycoMesh m, const HycoContact *c, PetscInt missed, PetscInt slaves, PetscInt first,
                               PetscReal tolerance, PetscInt n_master, const PetscInt master[])
{
  PetscReal nearest = PETSC_MAX_REAL;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n_master; k++) nearest = PetscMin(nearest, Distance(m, first, master[k]));
  HycoFail("contact %s: %d of the %d nodes of %s have no node of %s within %g; the first is node %d, %g away; mesh "
           "both surfaces alike, or raise contact_%s_tolerance",
           c->name, (int)missed, (int)slaves, c->slave, c->master, (double)tolerance, (int)m->node_id[first],
           (double)nearest, c->name);
}

static PetscErrorCode FindPairs(HycoMesh m, const HycoContact *c, PetscInt index, PetscInt gs, PetscInt gm,
                                HycoPairs *p)
{
  const PetscInt *slave = m->group_node + m->group_start[gs], n_slave = m->group_start[gs + 1] - m->group_start[gs];
  const PetscInt *master = m->group_node + m->group_start[gm], n_master = m->group_start[gm + 1] - m->group_start[gm];
  const PetscReal tolerance = c->tolerance >= 0 ? c->tolerance : DefaultTolerance(m, gs);
  PetscInt missed = 0, first = -1, *partner_of;
  Boxes boxes;

  PetscFunctionBegin;
  HycoCheck(n_slave && n_master, "contact %s: the group %s is empty", c->name, n_slave ? c->master : c->slave);
  PetscCall(BoxesCreate(m, n_master, master, tolerance, &boxes));
  PetscCall(PetscMalloc1(m->n_nodes, &partner_of));
  for (PetscInt i = 0; i < m->n_nodes; i++) partner_of[i] = -1;
  for (PetscInt k = 0; k < n_slave; k++) {
    const PetscInt j = BoxesNearest(m, &boxes, slave[k]);

    if (j < 0 || Distance(m, slave[k], j) > tolerance) {
      if (!missed++) first = slave[k];
      continue;
    }
    HycoCheck(j != slave[k], "contact %s: node %d is in both %s and %s; the two surfaces must be apart", c->name,
              (int)m->node_id[j], c->slave, c->master);
    HycoCheck(partner_of[j] < 0,
              "contact %s: nodes %d and %d of %s are both nearest to node %d of %s; mesh both surfaces alike", c->name,
              (int)m->node_id[partner_of[j]], (int)m->node_id[slave[k]], c->slave, (int)m->node_id[j], c->master);
    partner_of[j] = slave[k];
    p->slave[p->n] = slave[k];
    p->master[p->n] = j;
    p->contact[p->n++] = index;
  }
  PetscCall(PetscFree(partner_of));
  PetscCall(PetscFree(boxes.item));
  if (missed) PetscCall(Complain(m, c, missed, n_slave, first, tolerance, n_master, master));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A node's row pivot in gap coordinates is its own: no node may be the slave of two contacts. */
static PetscErrorCode CheckSlaves(HycoScene scene, HycoMesh m, const HycoPairs *p)
{
  PetscInt *seen;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_nodes, &seen));
  for (PetscInt i = 0; i < m->n_nodes; i++) seen[i] = -1;
  for (PetscInt k = 0; k < p->n; k++) {
    HycoCheck(seen[p->slave[k]] < 0, "node %d is a slave of the contacts %s and %s; a node may be the slave of one",
              (int)m->node_id[p->slave[k]], scene->contact[seen[p->slave[k]]].name, scene->contact[p->contact[k]].name);
    seen[p->slave[k]] = p->contact[k];
  }
  PetscCall(PetscFree(seen));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An obstacle's nodes, but those that are wholly fixed: they cannot meet it. */
static PetscErrorCode FindObstacle(HycoScene scene, HycoMesh m, PetscInt index, PetscInt group, const PetscInt held[],
                                   HycoPairs *p)
{
  PetscFunctionBegin;
  HycoCheck(m->group_start[group + 1] > m->group_start[group], "contact %s: the group %s is empty",
            scene->contact[index].name, m->group_name[group]);
  for (PetscInt k = m->group_start[group]; k < m->group_start[group + 1]; k++) {
    if (held[m->group_node[k]] == m->dim) continue;
    p->slave[p->n] = m->group_node[k];
    p->master[p->n] = -1;
    p->contact[p->n++] = index;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Number of fixed components of each node. */
static PetscErrorCode CountHeld(HycoScene scene, HycoMesh m, PetscInt held[])
{
  PetscBool *fixed;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(m->n_nodes * m->dim, &fixed));
  for (PetscInt k = 0; k < scene->n_fixed; k++) {
    PetscInt g = 0;

    PetscCall(HycoMeshFindGroup(m, "fixed", scene->fixed[k].group, &g));
    for (PetscInt c = 0; c < m->dim; c++) {
      for (PetscInt j = m->group_start[g]; scene->fixed[k].value[c] && j < m->group_start[g + 1]; j++)
        fixed[m->group_node[j] * m->dim + c] = PETSC_TRUE;
    }
  }
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    held[i] = 0;
    for (PetscInt c = 0; c < m->dim; c++) held[i] += fixed[i * m->dim + c];
  }
  PetscCall(PetscFree(fixed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPairsFind(HycoScene scene, HycoMesh m, HycoPairs *pairs)
{
  PetscInt *held, total = 0, gs = 0, gm = 0;

  PetscFunctionBegin;
  pairs->n = 0;
  for (PetscInt k = 0; k < scene->n_contacts; k++) {
    PetscCall(HycoMeshFindGroup(m, "contact", scene->contact[k].slave, &gs));
    total += m->group_start[gs + 1] - m->group_start[gs];
  }
  PetscCall(PetscMalloc1(total, &pairs->slave));
  PetscCall(PetscMalloc1(total, &pairs->master));
  PetscCall(PetscMalloc1(total, &pairs->contact));
  PetscCall(PetscMalloc1(m->n_nodes, &held));
  PetscCall(CountHeld(scene, m, held));
  for (PetscInt k = 0; k < scene->n_contacts; k++) {
    const HycoContact *c = &scene->contact[k];

    PetscCall(HycoMeshFindGroup(m, "contact", c->slave, &gs));
    if (c->type == HYCO_CONTACT_PAIR) {
      PetscCall(HycoMeshFindGroup(m, "contact", c->master, &gm));
      PetscCall(FindPairs(m, c, k, gs, gm, pairs));
    } else
      PetscCall(FindObstacle(scene, m, k, gs, held, pairs));
  }
  PetscCall(PetscFree(held));
  PetscCall(CheckSlaves(scene, m, pairs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPairsDestroy(HycoPairs *pairs)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(pairs->slave));
  PetscCall(PetscFree(pairs->master));
  PetscCall(PetscFree(pairs->contact));
  pairs->n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}
