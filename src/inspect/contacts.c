/* Gaps, whether surfaces face each other, which side of contacts and ties has the finer facets. */
#include "inspect.h"
#include <hycocarriers.h>

/* Slave's facet size over the master's around contact k; 0: one of the groups is not a surface. size: room for 2
   reals a node. */
static PetscReal InspectContactsCoarseness(const HycoPairs *p, PetscInt k, PetscInt n_nodes, const PetscReal size[])
{
  PetscReal master = 0;

  for (PetscInt j = p->master_start[k]; j < p->master_start[k + 1]; j++)
    master += p->weight[j] * size[n_nodes + p->master[j]];
  return master > 0 ? size[p->slave[k]] / master : 0;
}

/* The facet sizes of two groups: room for 2 reals a node. size[0 .. n) of the slave, [n .. 2 n) of the master. */
static PetscErrorCode FacetSizes(HycoFE fe, const char key[], const char slave[], const char master[], PetscReal size[])
{
  PetscInt g = 0;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(fe->mesh, key, slave, &g));
  HycoSurfaceSizes(fe, g, size);
  PetscCall(HycoMeshFindGroup(fe->mesh, key, master, &g));
  HycoSurfaceSizes(fe, g, size + fe->mesh->n_nodes);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The median over the contacts of one entry; for types with a search, whose meshes need not match. */
static PetscErrorCode CompareFacets(HycoInspection *in, HycoFE fe, PetscInt contact)
{
  /* `between` counts slaves that face a facet rather than a node: their meshes do not match. */
  const HycoPairs *p = &in->whole->pairs;
  HycoContact c = fe->scene->contact[contact];
  PetscReal *size, *ratio;
  PetscInt n = 0;

  PetscFunctionBegin;
  if (!c->master || !c->ops->find || fe->dim == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc2(2 * fe->mesh->n_nodes, &size, p->n, &ratio));
  PetscCall(FacetSizes(fe, "contact", c->slave, c->master, size));
  for (PetscInt k = 0; k < p->n; k++) {
    if (p->contact[k] != contact || p->master_start[k] == p->master_start[k + 1]) continue;
    ratio[n++] = InspectContactsCoarseness(p, k, fe->mesh->n_nodes, size);
    /* Integrated contacts have several masters even where the meshes match. */
    in->contact[contact].between += !c->integrated && p->master_start[k + 1] > p->master_start[k] + 1;
  }
  PetscCall(PetscSortReal(n, ratio));
  if (n) in->contact[contact].coarse = ratio[n / 2];
  PetscCall(PetscFree2(size, ratio));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* How hard the cell is pressed in, E / (1 - nu^2) of an isotropic law; of another one the mean stiffness along the
   axes. */
static PetscReal PlaneModulus(HycoFE fe, PetscInt cell)
{
  const PetscReal *c = fe->tangent + fe->tangent_start[cell];
  PetscReal sum = 0;

  if (HycoFEIsIsotropic(fe, cell)) return c[0] + 2 * c[1] > 0 ? 4 * c[1] * (c[0] + c[1]) / (c[0] + 2 * c[1]) : 0;
  for (PetscInt d = 0; d < fe->dim; d++) sum += c[d * (fe->n_sigma + 1)] / fe->dim;
  return sum;
}

/* The median over the facets of a group; 0: no cell is behind them. */
static PetscErrorCode SurfaceModulus(HycoFE fe, const char key[], const char name[], PetscReal *modulus)
{
  HycoMesh m = fe->mesh;
  PetscReal *each;
  PetscInt g = 0, n = 0;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(m, key, name, &g));
  PetscCall(PetscMalloc1(m->n_facets, &each));
  for (PetscInt f = 0; f < m->n_facets; f++) {
    if (m->facet_group[f] == g && m->facet_cell[f] >= 0) each[n++] = PlaneModulus(fe, m->facet_cell[f]);
  }
  PetscCall(PetscSortReal(n, each));
  *modulus = n ? each[n / 2] : 0;
  PetscCall(PetscFree(each));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At fe's parameters: the ratio of the two sides' moduli, whose extremes over the points are kept. */
static PetscErrorCode CompareStiffness(HycoInspection *in, HycoFE fe, PetscInt contact, PetscBool first)
{
  HycoContact c = fe->scene->contact[contact];
  HycoContactInspection *r = &in->contact[contact];
  PetscReal slave, master;

  PetscFunctionBegin;
  if (!c->master || !c->ops->find || fe->dim == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SurfaceModulus(fe, "contact", c->slave, &slave));
  PetscCall(SurfaceModulus(fe, "contact", c->master, &master));
  if (!(slave > 0 && master > 0)) PetscFunctionReturn(PETSC_SUCCESS);
  r->stiff_min = first ? slave / master : PetscMin(r->stiff_min, slave / master);
  r->stiff_max = PetscMax(r->stiff_max, slave / master);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The facets of a tie's sides, over its nodes. By the largest of its masters, since mortar ties have many of small
   weight. */
static PetscErrorCode CompareTie(HycoFE fe, PetscInt tie, PetscReal *coarse)
{
  HycoMesh m = fe->mesh;
  const HycoTie *t = &fe->scene->tie[tie];
  PetscReal *size, *ratio;
  PetscInt n = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(2 * m->n_nodes, &size, m->n_tied, &ratio));
  PetscCall(FacetSizes(fe, "tie", t->slave, t->master, size));
  for (PetscInt k = 0; k < m->n_tied; k++) {
    PetscReal master = 0;

    for (PetscInt j = m->tied_start[k]; j < m->tied_start[k + 1]; j++)
      /* size has the slave's facets first, then the master's. */
      master = PetscMax(master, size[m->n_nodes + m->tied_master[j]]);
    if (m->ties->tie[m->tied_entry[k]] == tie) ratio[n++] = size[m->tied[k]] / master;
  }
  PetscCall(PetscSortReal(n, ratio));
  /* The median: at an edge of the surfaces single ratios are wide of it. */
  *coarse = n ? ratio[n / 2] : 0;
  PetscCall(PetscFree2(size, ratio));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A node has one entry for each of its masters; it is counted once. */
PetscErrorCode HycoInspectTies(HycoInspection *in)
{
  HycoFE fe = in->whole->fe;
  HycoScene s = fe->scene;
  const HycoTies ties = fe->mesh->ties;

  PetscFunctionBegin;
  for (PetscInt t = 0; t < s->n_ties; t++) {
    HycoTieInspection *one = &in->tie[t];

    *one = (HycoTieInspection){
        .name = s->tie[t].name, .slave = s->tie[t].slave, .master = s->tie[t].master, .mortar = s->tie[t].mortar};
    for (PetscInt e = 0; ties && e < ties->n; e++)
      one->n_nodes += ties->tie[e] == t && (!e || ties->slave[e - 1] != ties->slave[e]);
    PetscCall(CompareTie(fe, t, &one->coarse));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The extremes start reversed, and are narrowed at each inspected point. tolerance -1: not given in the scene. */
PetscErrorCode HycoInspectContactsBegin(HycoInspection *in)
{
  HycoScene s = in->whole->scene;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n_contacts; k++) {
    const HycoContact c = s->contact[k];

    in->contact[k] = (HycoContactInspection){.name = c->name,
                                             .type = ((PetscObject)c)->type_name,
                                             .slave = c->slave,
                                             .master = c->master,
                                             .integrated = c->integrated,
                                             .facing_min = PETSC_MAX_INT,
                                             .gap_min = PETSC_MAX_REAL,
                                             .gap_max = -PETSC_MAX_REAL};
    PetscCall(HycoContactGetLength(c, "tolerance", &in->contact[k].tolerance));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At one point of the ranges; the extremes over all points grow with each call. Facets are compared at the first
   point only (`first`). */
PetscErrorCode HycoInspectGaps(HycoInspection *in, HycoFE fe, PetscBool first)
{
  HycoPairs *p = &in->whole->pairs;
  HycoScene s = fe->scene;
  const PetscReal length = HycoMeshLength(fe->mesh);
  PetscReal *normal, *gap, *share;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(3 * p->n, &normal, p->n, &gap, s->n_contacts, &share));
  PetscCall(HycoContactGeometry(fe, p, normal, gap));
  PetscCall(HycoContactCheckNormals(PETSC_COMM_SELF, fe, p, normal));
  PetscCall(HycoContactInitialOverlap(PETSC_COMM_SELF, fe, fe, p, gap, share));
  for (PetscInt c = 0; c < s->n_contacts; c++) {
    HycoContactInspection *r = &in->contact[c];
    PetscInt facing = 0, g = 0;

    PetscCall(HycoMeshFindGroup(fe->mesh, "contact", s->contact[c]->slave, &g));
    /* Where some nodes of a facet carry no contact anyway, they are not compared. */
    r->n_slaves = HycoMeshFirstCarrier(fe->mesh) ? 0 : fe->mesh->group_start[g + 1] - fe->mesh->group_start[g];
    r->quadratic = HycoMeshIsQuadratic(fe->mesh);
    r->n = 0;
    r->buried = PetscMax(r->buried, share[c]);
    for (PetscInt k = 0; k < p->n; k++) {
      if (p->contact[k] != c) continue;
      r->n++;
      /* No master is opposite: the gap means nothing. */
      if (HycoPairsAlone(s, p, k)) continue;
      facing++;
      /* Surfaces that touch are reported as touching, not as penetrating by 1e-17. */
      if (PetscAbsReal(gap[k]) <= HYCO_LENGTH_ROUND_OFF * length) gap[k] = 0;
      r->gap_min = PetscMin(r->gap_min, gap[k]);
      r->gap_max = PetscMax(r->gap_max, gap[k]);
    }
    r->facing_min = PetscMin(r->facing_min, facing);
    r->facing_max = PetscMax(r->facing_max, facing);
    if (HycoPairsFollows(p, c)) r->tolerance = -1; /* surfaces that move are searched at any distance */
    if (first) PetscCall(CompareFacets(in, fe, c));
    PetscCall(CompareStiffness(in, fe, c, first));
  }
  PetscCall(PetscFree3(normal, gap, share));
  PetscFunctionReturn(PETSC_SUCCESS);
}
