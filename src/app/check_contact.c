/* hyco check: gaps, whether surfaces face each other, which side of contacts and ties has the finer facets. */
#include "check.h"

/* Facets of the slave larger than the master's by this factor are reported as coarser. */
#define COARSER 1.5
/* A smallest gap above this share of the mesh's extent does not close by small displacements. */
#define FAR 0.1
/* Share of the mesh's extent: a smaller gap is round-off. */
#define ROUNDING 1e-12

/* Slave's facet size over the master's around contact k; 0: one of the groups is not a surface. size: room for 2
   reals a node. */
static PetscReal Coarseness(const HycoPairs *p, PetscInt k, PetscInt n_nodes, const PetscReal size[])
{
  PetscReal master = 0;

  for (PetscInt j = p->master_start[k]; j < p->master_start[k + 1]; j++)
    master += p->weight[j] * size[n_nodes + p->master[j]];
  return master > 0 ? size[p->slave[k]] / master : 0;
}

/* The facet sizes of two groups: room for 2 reals a node. */
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
static PetscErrorCode CompareFacets(Check *check, HycoFE fe, PetscInt contact)
{
  const HycoPairs *p = &check->whole->pairs;
  HycoContact c = fe->scene->contact[contact];
  PetscReal *size, *ratio;
  PetscInt n = 0;

  PetscFunctionBegin;
  if (!c->master || !c->ops->find || fe->dim == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc2(2 * fe->mesh->n_nodes, &size, p->n, &ratio));
  PetscCall(FacetSizes(fe, "contact", c->slave, c->master, size));
  for (PetscInt k = 0; k < p->n; k++) {
    if (p->contact[k] != contact || p->master_start[k] == p->master_start[k + 1]) continue;
    ratio[n++] = Coarseness(p, k, fe->mesh->n_nodes, size);
    check->contact[contact].between += !c->integrated && p->master_start[k + 1] > p->master_start[k] + 1;
  }
  PetscCall(PetscSortReal(n, ratio));
  if (n) check->contact[contact].coarse = ratio[n / 2];
  PetscCall(PetscFree2(size, ratio));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckReportTie(Check *check, PetscInt tie, cJSON *report)
{
  HycoFE fe = check->whole->fe;
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
      master = PetscMax(master, size[m->n_nodes + m->tied_master[j]]);
    if (m->ties->tie[m->tied_entry[k]] == tie) ratio[n++] = size[m->tied[k]] / master;
  }
  PetscCall(PetscSortReal(n, ratio));
  if (n) cJSON_AddNumberToObject(report, "slave_over_master", ratio[n / 2]);
  if (n && ratio[n / 2] > COARSER)
    CheckReportWarning(
        check,
        "tie %s: the slave's facets (%s) are %.2g times as long as the master's (%s), and the forces between them "
        "are then inaccurate; the finer side should be the slave",
        t->name, t->slave, (double)ratio[n / 2], t->master);
  PetscCall(PetscFree2(size, ratio));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckReportGaps(Check *check, HycoFE fe, PetscBool first)
{
  HycoPairs *p = &check->whole->pairs;
  HycoScene s = fe->scene;
  const PetscReal length = HycoMeshLength(fe->mesh);
  PetscReal *normal, *gap;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(3 * p->n, &normal, p->n, &gap));
  PetscCall(HycoContactGeometry(fe, p, normal, gap));
  for (PetscInt c = 0; c < s->n_contacts; c++) {
    ContactRange *r = &check->contact[c];
    PetscInt facing = 0;

    r->n = 0;
    for (PetscInt k = 0; k < p->n; k++) {
      if (p->contact[k] != c) continue;
      r->n++;
      if (HycoPairsAlone(s, p, k)) continue;
      facing++;
      if (PetscAbsReal(gap[k]) <= ROUNDING * length) gap[k] = 0;
      r->gap_min = PetscMin(r->gap_min, gap[k]);
      r->gap_max = PetscMax(r->gap_max, gap[k]);
    }
    r->facing_min = PetscMin(r->facing_min, facing);
    r->facing_max = PetscMax(r->facing_max, facing);
    if (first) PetscCall(CompareFacets(check, fe, c));
  }
  check->n_without = PetscMax(check->n_without, check->fom->summary.n_still);
  PetscCall(PetscFree2(normal, gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void Warn(Check *check, HycoContact c, const ContactRange *r)
{
  const PetscReal length = HycoMeshLength(check->whole->part);

  if (!r->n)
    CheckReportWarning(check, "contact %s has no effect: all displacements of every node of %s are fixed", c->name,
                       c->slave);
  else if (!r->facing_max)
    CheckReportWarning(
        check, "contact %s never faces its master: no node of %s faces %s at any of the points that were assembled",
        c->name, c->slave, c->master);
  else if (c->master && r->gap_min > FAR * length)
    CheckReportWarning(
        check, "contact %s: the smallest gap is %.3g, %.2g of the mesh's extent; small displacements cannot close it",
        c->name, (double)r->gap_min, (double)(r->gap_min / length));
  if (r->coarse > COARSER && !c->integrated)
    CheckReportWarning(
        check,
        "contact %s: the slave's facets (%s) are %.2g times as long as the master's (%s); the finer side should "
        "be the slave",
        c->name, c->slave, (double)r->coarse, c->master);
}

static void Print(const Check *check, PetscInt contact, const ContactRange *r)
{
  const HycoContact c = check->fom->scene->contact[contact];
  PetscReal stated;

  PetscCallVoid(HycoContactGetLength(c, "tolerance", &stated));
  PetscCallVoid(
      DriverPrint("contact %s, %s: %d nodes of %s", c->name, ((PetscObject)c)->type_name, (int)r->n, c->slave));
  if (c->master) PetscCallVoid(DriverPrint(" against %s", c->master));
  if (r->facing_max && c->master)
    PetscCallVoid(r->facing_min == r->n
                      ? DriverPrint(", all of which face it")
                      : DriverPrint(", %d to %d of which face it", (int)r->facing_min, (int)r->facing_max));
  if (r->facing_max && r->facing_min < r->n && stated >= 0 && !HycoPairsFollows(&check->whole->pairs, contact))
    PetscCallVoid(
        DriverPrint("; %d face nothing within the tolerance of %g", (int)(r->n - r->facing_max), (double)stated));
  if (r->facing_max) PetscCallVoid(DriverPrint("; gaps from %.4g to %.4g", (double)r->gap_min, (double)r->gap_max));
  if (r->facing_max && r->gap_min < 0) PetscCallVoid(DriverPrint(" (below 0 the bodies overlap before any load)"));
  if (r->between)
    PetscCallVoid(
        DriverPrint("; %d have no node opposite: type: mortar gives better pressures there", (int)r->between));
  PetscCallVoid(DriverPrint("\n"));
}

void CheckReportContacts(Check *check)
{
  HycoScene s = check->fom->scene;
  cJSON *contacts = cJSON_AddArrayToObject(check->json, "contacts");

  for (PetscInt k = 0; k < s->n_contacts; k++) {
    const ContactRange *r = &check->contact[k];
    cJSON *contact = cJSON_CreateObject();

    cJSON_AddItemToArray(contacts, contact);
    cJSON_AddStringToObject(contact, "name", s->contact[k]->name);
    cJSON_AddStringToObject(contact, "type", ((PetscObject)s->contact[k])->type_name);
    ReportNumbers(contact, {"n", r->n}, {"n_facing_min", r->facing_min}, {"n_facing_max", r->facing_max});
    if (r->facing_max) cJSON_AddNumberToObject(contact, "gap_min", r->gap_min);
    if (r->facing_max) cJSON_AddNumberToObject(contact, "gap_max", r->gap_max);
    if (r->between) cJSON_AddNumberToObject(contact, "n_between_nodes", r->between);
    if (r->coarse > 0) cJSON_AddNumberToObject(contact, "slave_over_master", r->coarse);
    Print(check, k, r);
    Warn(check, s->contact[k], r);
  }
  cJSON_AddNumberToObject(check->json, "n_without_effect", check->n_without);
  if (check->n_without)
    PetscCallVoid(DriverPrint("%d contact%s between fixed displacements: without effect\n", (int)check->n_without,
                              check->n_without > 1 ? "s lie" : " lies"));
}
