/* hyco check: contacts, ties, and rigid motions that contact alone prevents. */
#include "check.h"
#include <string.h>

/* Of the master's facets, the slave's: above it the slave is reported as coarser; half as large again, so that meshes
   of one size never are (tests/command/check.py). */
#define COARSER 1.5
/* Of the master's facets, a second-order slave's: below it pressures alternate by 8 to 13 % of the peak from node to
   node (tests/contact/mortar.py). */
#define FINER 0.5
/* Of the master's modulus, the slave's: above it the slave is reported as stiffer; half as large again, so that equal
   materials never are (tests/command/check.py). */
#define STIFFER 1.5
/* Of the mesh's extent, the smallest gap of a contact: a larger one does not close by small displacements. */
#define DISTANT 0.1

/* Rank 0, as the other parts of the report: the inspection is complete there. */
PetscErrorCode CheckReportTies(Check *check)
{
  cJSON *list = cJSON_AddArrayToObject(check->json, "ties");

  PetscFunctionBegin;
  for (PetscInt k = 0; k < check->in.n_ties; k++) {
    const HycoTieInspection *t = &check->in.tie[k];
    cJSON *one = cJSON_CreateObject();

    cJSON_AddStringToObject(one, "name", t->name);
    cJSON_AddNumberToObject(one, "n_nodes", t->n_nodes);
    cJSON_AddItemToArray(list, one);
    if (t->coarse > 0) cJSON_AddNumberToObject(one, "slave_over_master", t->coarse);
    /* A mortar tie integrates over both sides, and does not depend on which is finer. */
    if (t->coarse > COARSER && !t->mortar)
      CheckReportWarning(
          check,
          "tie %s: the slave's facets (%s) are %.2g times as long as the master's (%s), and the forces between them "
          "are then inaccurate; the finer side should be the slave, or method: mortar",
          t->name, t->slave, (double)t->coarse, t->master);
    PetscCall(DriverPrint("tie %s: %d nodes of %s follow %s\n", t->name, (int)t->n_nodes, t->slave, t->master));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The slave should be the softer side, and of equally stiff ones the finer: at all points of the ranges, so that no
   parameter decides. Contacts that are integrated do not lose force between a coarse slave's nodes. */
static void WarnOrder(Check *check, const HycoContactInspection *c)
{
  if (c->stiff_min > STIFFER)
    CheckReportWarning(check,
                       "contact %s: the slave (%s) is %.2g to %.2g times as stiff as the master (%s); pressures are "
                       "more accurate with the softer side as slave: exchange the two",
                       c->name, c->slave, (double)c->stiff_min, (double)c->stiff_max, c->master);
  else if (c->coarse > COARSER && !c->integrated && !(c->stiff_max > 0 && c->stiff_max * STIFFER < 1))
    CheckReportWarning(
        check,
        "contact %s: the slave's facets (%s) are %.2g times as long as the master's (%s); the finer side should "
        "be the slave",
        c->name, c->slave, (double)c->coarse, c->master);
}

/* What is probably a mistake, not what is an error: the scene can be solved. */
static void ContactCheckWarn(Check *check, const HycoContactInspection *c)
{
  const PetscReal length = check->in.length;

  /* One of the three: each explains the next, so that a user mends the first cause. */
  if (!c->n)
    CheckReportWarning(check, "contact %s has no effect: all displacements of every node of %s are fixed", c->name,
                       c->slave);
  else if (!c->facing_max)
    CheckReportWarning(
        check, "contact %s never faces its master: no node of %s faces %s at any of the points that were assembled",
        c->name, c->slave, c->master);
  else if (c->master && c->gap_min > DISTANT * length)
    CheckReportWarning(
        check, "contact %s: the smallest gap is %.3g, %.2g of the mesh's extent; small displacements cannot close it",
        c->name, (double)c->gap_min, (double)(c->gap_min / length));
  if (c->buried > 0)
    CheckReportWarning(check,
                       "contact %s: its gap overlaps at every node, by %.2g %% of its body's extent; is the sign right "
                       "(above 0 the surfaces are apart)?",
                       c->name, 100 * (double)c->buried);
  if (c->integrated && c->quadratic && c->coarse > 0 && c->coarse < FINER)
    CheckReportWarning(
        check,
        "contact %s: the slave's facets (%s) are %.2g times as long as the master's (%s); with cells of "
        "second order pressures then alternate from node to node: make the slave at most twice as fine%s",
        c->name, c->slave, (double)c->coarse, c->master,
        c->stiff_max > 0 && c->stiff_max * STIFFER < 1 ? "" : ", or exchange slave and master");
  WarnOrder(check, c);
}

/* The same two surfaces, exchanged. */
static void WarnBothWays(Check *check, PetscInt k)
{
  const HycoContactInspection *c = &check->in.contact[k];

  for (PetscInt j = 0; j < k && c->master; j++) {
    const HycoContactInspection *other = &check->in.contact[j];

    if (other->master && !strcmp(other->slave, c->master) && !strcmp(other->master, c->slave))
      CheckReportWarning(check,
                         "contacts %s and %s are one contact declared both ways: its pressures are divided between "
                         "them; remove one",
                         other->name, c->name);
  }
}

/* One line for each contact, composed of what is known. */
static PetscErrorCode ContactCheckPrint(const HycoContactInspection *c)
{
  PetscFunctionBegin;
  PetscCall(DriverPrint("contact %s, %s: %d nodes of %s", c->name, c->type, (int)c->n, c->slave));
  if (c->master) PetscCall(DriverPrint(" against %s", c->master));
  if (c->master && c->n < c->n_slaves)
    PetscCall(DriverPrint(" (of the group's %d nodes %.0f %% have no contact)", (int)c->n_slaves,
                          100 - 100 * (double)c->n / (double)c->n_slaves));
  if (c->facing_max && c->master)
    PetscCall(c->facing_min == c->n
                  ? DriverPrint(", all of which face it")
                  : DriverPrint(", %d to %d of which face it", (int)c->facing_min, (int)c->facing_max));
  if (c->facing_max && c->facing_min < c->n && c->tolerance >= 0)
    PetscCall(
        DriverPrint("; %d face nothing within the tolerance of %g", (int)(c->n - c->facing_max), (double)c->tolerance));
  if (c->facing_max) PetscCall(DriverPrint("; gaps from %.4g to %.4g", (double)c->gap_min, (double)c->gap_max));
  if (c->facing_max && c->gap_min < 0) PetscCall(DriverPrint(" (below 0 the bodies overlap before any load)"));
  if (c->between)
    PetscCall(DriverPrint("; %d have no node opposite: type: mortar gives better pressures there", (int)c->between));
  PetscCall(DriverPrint("\n"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Extremes over the points that were assembled: a contact may face its master at the centre and leave it at a
   corner of the ranges. */
PetscErrorCode CheckReportContacts(Check *check)
{
  const PetscInt n_without = check->in.n_without;
  cJSON *contacts = cJSON_AddArrayToObject(check->json, "contacts");

  PetscFunctionBegin;
  for (PetscInt k = 0; k < check->in.n_scene_contacts; k++) {
    const HycoContactInspection *c = &check->in.contact[k];
    cJSON *contact = cJSON_CreateObject();

    cJSON_AddItemToArray(contacts, contact);
    cJSON_AddStringToObject(contact, "name", c->name);
    cJSON_AddStringToObject(contact, "type", c->type);
    ReportNumbers(contact, {"n", c->n}, {"n_facing_min", c->facing_min}, {"n_facing_max", c->facing_max});
    /* Without a node that faces a master there is no gap; a key of an arbitrary value would be read as one. */
    if (c->facing_max) cJSON_AddNumberToObject(contact, "gap_min", c->gap_min);
    if (c->facing_max) cJSON_AddNumberToObject(contact, "gap_max", c->gap_max);
    if (c->between) cJSON_AddNumberToObject(contact, "n_between_nodes", c->between);
    if (c->coarse > 0) cJSON_AddNumberToObject(contact, "slave_over_master", c->coarse);
    if (c->stiff_max > 0)
      ReportNumbers(contact, {"stiffness_over_master_min", c->stiff_min}, {"stiffness_over_master_max", c->stiff_max});
    PetscCall(ContactCheckPrint(c));
    ContactCheckWarn(check, c);
    WarnBothWays(check, k);
  }
  cJSON_AddNumberToObject(check->json, "n_without_effect", n_without);
  if (n_without)
    PetscCall(DriverPrint("%d contact%s between fixed displacements: without effect\n", (int)n_without,
                          n_without > 1 ? "s lie" : " lies"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Motions that contact alone prevents are no warning by themselves, but the user should know that loads must press
   the bodies together. */
PetscErrorCode CheckReportMotions(Check *check)
{
  const HycoInspection *in = &check->in;
  cJSON *list = cJSON_AddArrayToObject(check->json, "free_motions");

  PetscFunctionBegin;
  cJSON_AddStringToObject(check->json, "regularised", in->regularised);
  if (in->regularised[0])
    PetscCall(DriverPrint("regularised: neither supports nor contact keep %s\n", in->regularised));
  for (PetscInt k = 0; k < in->n_motions; k++) {
    cJSON_AddItemToArray(list, cJSON_CreateString(in->motion[k]));
    PetscCall(DriverPrint("no support keeps %s: contact alone does\n", in->motion[k]));
  }
  if (in->loose)
    CheckReportWarning(
        check,
        "%d rigid motion%s prevented only by contact: full order can solve this if the loads press the bodies "
        "together, and so can reduced models",
        (int)in->loose, in->loose > 1 ? "s are" : " is");
  cJSON_AddNumberToObject(check->json, "n_lifted", in->n_lifted);
  if (in->n_lifted)
    CheckReportWarning(check, "solve fails at %d of the %d points assembled, the first %s", (int)in->n_lifted,
                       (int)in->n_systems, in->lifted);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nothing moves a scene without loads, prescribed displacements, heat and overlapping gaps. */
void CheckReportLoads(Check *check)
{
  PetscBool loaded = check->in.loaded;

  for (PetscInt k = 0; k < check->in.n_scene_contacts && !loaded; k++)
    loaded = (PetscBool)(check->in.contact[k].facing_max && check->in.contact[k].gap_min < 0);
  if (!loaded)
    CheckReportWarning(check, "nothing loads the bodies: no force, pressure, traction, gravity, rotation, prescribed "
                              "displacement, heat or overlap acts at any of the points that were assembled");
}
