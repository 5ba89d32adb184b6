/*
  Springs to the ground: a traction -k u on the surface of a body (an elastic foundation), or a force -k u at points.
  The matrix of each facet,

    integral of N_a N_b (diag(k_x, k_y, k_z) + k_n n n^T),

  belongs to the cell that the facet bounds, that of a point to a cell around it: the cells' loops thus add it to K, to
  the lifting and to the RID.
*/
#include <hycokinematics.h>

#define MAX_FACET_DOFS (3 * HYCO_FACET_NODES)

struct _n_HycoSprings {
  PetscInt n, *start;     /* the springs of cell e are start[e] .. start[e + 1] - 1; n_cells + 1 */
  PetscInt *spring;       /* index in the scene */
  PetscInt *facet, *node; /* one of these, the other is -1 */
  PetscInt size;          /* square of the number of a facet's unknowns */
  PetscReal *K;           /* n x size: row major over the facet's or the point's unknowns */
};

/* Whether a spring of the scene acts at each node of its group, not on facets. */
static PetscBool AtPoints(HycoMesh m, PetscInt group)
{
  return (PetscBool)(m->dim == 1 || m->group_dim[group] == 0);
}

/* Visits each facet and each point with a spring, in the order of the scene's springs; cell: the cell to which it
   belongs. A point is visited on the process that owns it. around: a cell of each node, which gets the stiffness of a
   spring at the point. */
static PetscErrorCode ForEach(HycoFE fe, const PetscInt around[],
                              PetscErrorCode (*visit)(HycoFE, PetscInt spring, PetscInt cell, PetscInt facet,
                                                      PetscInt node, void *),
                              void *ctx)
{
  HycoMesh m = fe->mesh;

  PetscFunctionBegin;
  for (PetscInt s = 0; s < fe->scene->n_springs; s++) {
    PetscInt g = 0;

    PetscCall(HycoMeshFindGroup(m, "spring", fe->scene->spring[s].group, &g));
    for (PetscInt k = m->group_start[g]; AtPoints(m, g) && k < m->group_start[g + 1]; k++) {
      const PetscInt i = m->group_node[k];

      if (HycoMeshOwned(m, i) >= 0 && around[i] >= 0) PetscCall((*visit)(fe, s, around[i], -1, i, ctx));
    }
    for (PetscInt f = 0; f < m->n_facets && !AtPoints(m, g); f++) {
      /* a model's contact surfaces have facets whose cells are not in the mesh */
      if (m->facet_group[f] == g && m->facet_cell[f] >= 0 && m->facet_cell[f] < m->n_cells)
        PetscCall((*visit)(fe, s, m->facet_cell[f], f, -1, ctx));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* First pass: numbers per cell. */
static PetscErrorCode SpringsCount(HycoFE fe, PetscInt spring, PetscInt cell, PetscInt facet, PetscInt node, void *ctx)
{
  PetscFunctionBegin;
  (void)fe, (void)spring, (void)facet, (void)node;
  ((HycoSprings)ctx)->start[cell + 1]++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* start[cell] is the position of the cell's next spring. */
static PetscErrorCode SpringsInsert(HycoFE fe, PetscInt spring, PetscInt cell, PetscInt facet, PetscInt node, void *ctx)
{
  HycoSprings s = (HycoSprings)ctx;
  const PetscInt at = s->start[cell]++;

  PetscFunctionBegin;
  (void)fe;
  s->spring[at] = spring;
  s->facet[at] = facet;
  s->node[at] = node;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* NULL-safe. */
PetscErrorCode HycoSpringsDestroy(HycoSprings *springs)
{
  HycoSprings s = *springs;

  PetscFunctionBegin;
  if (!s) PetscFunctionReturn(PETSC_SUCCESS);
  HycoFreeAll(&s->start, &s->spring, &s->facet, &s->node, &s->K, springs);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* CSR by cell of all springs. Two passes in the same order; a point belongs to its first cell, which is that of the
   smallest tag. Not collective. */
PetscErrorCode HycoSpringsCreate(HycoFE fe)
{
  HycoMesh m = fe->mesh;
  HycoSprings s;
  PetscInt *around; /* by node: its cell with the smallest tag, or -1 */

  PetscFunctionBegin;
  if (!fe->scene->n_springs) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscNew(&s));
  fe->springs = s;
  PetscCall(PetscMalloc1(m->n_nodes, &around));
  for (PetscInt i = 0; i < m->n_nodes; i++) around[i] = -1;
  /* Descending: the cell with the smallest tag is written last. */
  for (PetscInt k = m->n_cells * m->nv - 1; k >= 0; k--) around[m->cells[k]] = k / m->nv;
  PetscCall(PetscCalloc1(m->n_cells + 2, &s->start));
  PetscCall(ForEach(fe, around, SpringsCount, s));
  for (PetscInt e = 0; e < m->n_cells; e++) s->start[e + 1] += s->start[e];
  s->n = s->start[m->n_cells];
  s->size = m->nf * m->dim * m->nf * m->dim;
  PetscCall(PetscMalloc1(s->n, &s->spring));
  PetscCall(PetscMalloc1(s->n, &s->facet));
  PetscCall(PetscMalloc1(s->n, &s->node));
  PetscCall(PetscMalloc1(s->n * s->size, &s->K));
  PetscCall(ForEach(fe, around, SpringsInsert, s));
  /* SpringsInsert() has moved each start to the end of its cell: back by one. */
  for (PetscInt e = m->n_cells; e > 0; e--) s->start[e] = s->start[e - 1];
  s->start[0] = 0;
  PetscCall(PetscFree(around));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The four stiffnesses at a point. */
static PetscErrorCode SpringsEvaluate(HycoFE fe, const HycoSpring *spring, const PetscReal x[3], PetscReal k[4])
{
  PetscFunctionBegin;
  for (PetscInt c = 0; c < 4; c++) {
    char place[HYCO_LINE];

    k[c] = 0;
    if (!spring->stiffness[c]) continue;
    PetscCall(HycoExprEval(spring->stiffness[c], fe->mu, 1, x, &k[c]));
    if (k[c] >= 0) continue;
    PetscCall(HycoExprPlace(spring->stiffness[c], fe->mu, x, place));
    HycoFail("%s is %g at %s; the stiffness of a spring must be 0 or more", HycoExprKey(spring->stiffness[c]),
             (double)k[c], place);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nodes of spring k; returns their number. */
static PetscInt SpringsNodes(HycoMesh m, const HycoSprings s, PetscInt k, const PetscInt *node[])
{
  *node = s->facet[k] < 0 ? &s->node[k] : m->facets + s->facet[k] * m->nf;
  return s->facet[k] < 0 ? 1 : m->nf;
}

/* In an axisymmetric scene a point is a circle, with its total stiffness. */
static PetscErrorCode PointMatrix(HycoFE fe, const HycoSpring *spring, PetscInt node, PetscReal K[])
{
  PetscReal k[4];

  PetscFunctionBegin;
  PetscCall(SpringsEvaluate(fe, spring, fe->X + 3 * node, k));
  for (PetscInt c = 0; c < fe->dim; c++) K[c * fe->dim + c] = k[c];
  /* The normal of an end of a line is its axis. */
  if (fe->dim == 1) K[0] += k[3];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Normal and area at each Gauss point: n n^T dS = (n dS)(n dS)^T / dS. By the consistent matrix, which couples the
   nodes of a facet, and not by lumped springs. */
static PetscErrorCode FacetMatrix(HycoFE fe, const HycoSpring *spring, PetscInt facet, PetscReal K[])
{
  HycoMesh m = fe->mesh;
  const HycoElement *el = HycoElementGetFacet(m->type);
  const PetscInt n = m->nf * m->dim;

  PetscFunctionBegin;
  for (PetscInt q = 0; q < el->nq; q++) {
    PetscReal normal[3], x[3] = {0, 0, 0}, k[4], area = 0;

    PetscCall(HycoFacetNormal(fe, el, facet, q, normal));
    for (PetscInt c = 0; c < 3; c++) area += normal[c] * normal[c];
    area = PetscSqrtReal(area);
    for (PetscInt a = 0; a < m->nf; a++) {
      for (PetscInt c = 0; c < 3; c++) x[c] += el->N[q][a] * fe->X[3 * m->facets[facet * m->nf + a] + c];
    }
    PetscCall(SpringsEvaluate(fe, spring, x, k));
    for (PetscInt r = 0; r < n; r++) {
      for (PetscInt t = 0; t < n; t++) {
        const PetscInt c = r % m->dim, d = t % m->dim;
        /* The part along the normal needs both directions at the point: it is integrated, not averaged. */
        const PetscReal along = k[3] != 0 ? k[3] * normal[c] * normal[d] / area : 0;

        K[r * n + t] += el->N[q][r / m->dim] * el->N[q][t / m->dim] * (along + (c == d ? area * k[c] : 0));
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Evaluated when the nodes move or a stiffness changes. Springs are part of K, assembled with the matrices of their
   cells. */
PetscErrorCode HycoSpringsSet(HycoFE fe)
{
  HycoSprings s = fe->springs;

  PetscFunctionBegin;
  for (PetscInt k = 0; s && k < s->n; k++) {
    PetscReal *K = s->K + k * s->size;
    const HycoSpring *spring = &fe->scene->spring[s->spring[k]];

    PetscCall(PetscArrayzero(K, s->size));
    if (s->facet[k] < 0)
      PetscCall(PointMatrix(fe, spring, s->node[k], K));
    else
      PetscCall(FacetMatrix(fe, spring, s->facet[k], K));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether this process counts spring k: it owns the spring's node with the smallest tag. A part has all facets with a
   node that it owns, but not all facets of its cells. */
static PetscBool IsOwn(HycoFE fe, PetscInt k)
{
  const PetscInt *node, n = SpringsNodes(fe->mesh, fe->springs, k, &node);
  PetscInt least = node[0];

  for (PetscInt a = 1; a < n; a++) least = PetscMin(least, node[a]);
  return (PetscBool)(HycoMeshOwned(fe->mesh, least) >= 0);
}

/* Adds the matrices of the cell's springs to Ke (before nodes are summed or eliminated). counted: only those that
   this process counts, for sums over ranks. */
void HycoSpringsAddStiffness(HycoFE fe, PetscInt cell, PetscBool counted, PetscReal Ke[])
{
  HycoMesh m = fe->mesh;
  const HycoSprings s = fe->springs;
  const PetscInt *corner = m->cells + cell * m->nv, dim = m->dim, n = m->nv * dim;

  for (PetscInt k = s ? s->start[cell] : 0; s && k < s->start[cell + 1]; k++) {
    const PetscReal *K = s->K + k * s->size;
    const PetscInt *node;
    const PetscInt n_nodes = SpringsNodes(m, s, k, &node), size = n_nodes * dim;
    PetscInt at[HYCO_FACET_NODES];

    if (counted && !IsOwn(fe, k)) continue;
    for (PetscInt a = 0; a < n_nodes; a++) {
      /* The first place of a repeated node: SumRepeated() adds the others. */
      for (at[a] = 0; corner[at[a]] != node[a];) at[a]++;
    }
    for (PetscInt r = 0; r < size; r++) {
      for (PetscInt t = 0; t < size; t++)
        Ke[(at[r / dim] * dim + r % dim) * n + at[t / dim] * dim + t % dim] += K[r * size + t];
    }
  }
}

/* Cells whose springs depend on a parameter are not constant. */
void HycoSpringsMarkVarying(HycoFE fe, const PetscBool changed[])
{
  for (PetscInt e = 0; fe->springs && e < fe->mesh->n_cells; e++) {
    for (PetscInt k = fe->springs->start[e]; k < fe->springs->start[e + 1]; k++) {
      const HycoSpring *spring = &fe->scene->spring[fe->springs->spring[k]];

      for (PetscInt c = 0; c < 4; c++) {
        if (HycoExprChanges(spring->stiffness[c], changed)) fe->constant[e] = PETSC_FALSE;
      }
    }
  }
}

/* Force of spring k on the unknowns of its nodes at u: -K u; returns its energy, u^T K u / 2. */
static PetscReal SpringForce(HycoFE fe, PetscInt k, const PetscReal u[], PetscReal force[MAX_FACET_DOFS])
{
  const HycoSprings s = fe->springs;
  const PetscReal *K = s->K + k * s->size;
  const PetscInt *node, n = SpringsNodes(fe->mesh, s, k, &node) * fe->dim;
  PetscReal energy = 0;

  for (PetscInt r = 0; r < n; r++) {
    force[r] = 0;
    for (PetscInt t = 0; t < n; t++) force[r] -= K[r * n + t] * u[node[t / fe->dim] * fe->dim + t % fe->dim];
    /* force is -K u. */
    energy -= force[r] * u[node[r / fe->dim] * fe->dim + r % fe->dim] / 2;
  }
  return energy;
}

/* f += scale times the springs' forces -K u, of all springs in this process's tables: complete at owned nodes. */
void HycoSpringsAddForces(HycoFE fe, PetscReal scale, const PetscReal u[], PetscReal f[])
{
  for (PetscInt k = 0; fe->springs && k < fe->springs->n; k++) {
    const PetscInt *node, n = SpringsNodes(fe->mesh, fe->springs, k, &node) * fe->dim;
    PetscReal force[MAX_FACET_DOFS];

    (void)SpringForce(fe, k, u, force);
    for (PetscInt r = 0; r < n; r++) f[node[r / fe->dim] * fe->dim + r % fe->dim] += scale * force[r];
  }
}

/* u^T K u / 2 of the springs that this process counts; the sum over ranks is the total. */
PetscReal HycoSpringsEnergy(HycoFE fe, const PetscReal u[])
{
  PetscReal sum = 0, force[MAX_FACET_DOFS];

  for (PetscInt k = 0; fe->springs && k < fe->springs->n; k++) {
    if (IsOwn(fe, k)) sum += SpringForce(fe, k, u, force);
  }
  return sum;
}

/* Visits the counted springs; Gram matrices of rigid modes are sums over them. */
PetscErrorCode HycoSpringsVisit(HycoFE fe, HycoSpringVisit visit, void *ctx)
{
  const HycoSprings s = fe->springs;

  PetscFunctionBegin;
  for (PetscInt k = 0; s && k < s->n; k++) {
    const PetscInt *node, n = SpringsNodes(fe->mesh, s, k, &node);

    if (IsOwn(fe, k)) PetscCall((*visit)(fe, s->spring[k], n, node, s->K + k * s->size, ctx));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
