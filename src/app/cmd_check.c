/* hyco check: reads and assembles a whole scene, solves only on request; reports its contents and its cost. */
#include "check.h"
#include <hycobodies.h>
#include <hycoquantities.h>
#include <hycomaterialimpl.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* Up to this number of parameters all corners of the ranges are checked, above it only the ends of each. */
#define MOST_CORNERS 4
#define WIDE         10 /* ratio of a range's ends from which polynomials in its logarithm interpolate better */

void CheckReportWarning(Check *check, const char format[], ...)
{
  char line[HYCO_LINE];
  va_list args;

  va_start(args, format);
  vsnprintf(line, sizeof(line), format, args);
  va_end(args);
  cJSON_AddItemToArray(check->warnings, cJSON_CreateString(line));
}

/* The centre of the ranges, then their corners, or with many parameters the ends of each. The caller frees mu. */
static PetscErrorCode ListPoints(HycoScene s, PetscInt *n, PetscReal **mu)
{
  const PetscInt p = s->n_parameters;

  PetscFunctionBegin;
  *n = p ? 1 + (p <= MOST_CORNERS ? 1 << p : 2 * p) : 1;
  PetscCall(PetscMalloc1(*n * p + 1, mu));
  for (PetscInt k = 0; k < *n; k++) {
    for (PetscInt j = 0; j < p; j++) {
      PetscReal *v = *mu + k * p + j;
      const PetscBool corner = (PetscBool)(k && (p <= MOST_CORNERS || (k - 1) / 2 == j));
      const PetscInt bit = p <= MOST_CORNERS ? j : 0;

      *v = (s->lo[j] + s->hi[j]) / 2;
      if (corner) *v = ((k - 1) >> bit) & 1 ? s->hi[j] : s->lo[j];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On rank 0. */
static PetscErrorCode Measure(Check *check, const PetscReal mu[], PetscBool first)
{
  HycoFE fe = check->whole->fe;

  PetscFunctionBegin;
  if (check->whole != check->fom) PetscCall(HycoFOMAssemble(check->whole, mu));
  CheckReportCells(check, fe);
  PetscCall(CheckReportGaps(check, fe, first));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* "radius = 4.02, load = 0, t = 1: ", for the variables v; "" if there are none. */
static PetscErrorCode NamePoint(HycoScene s, const PetscReal v[], char place[HYCO_LINE])
{
  const PetscInt n = s->n_parameters + (s->n_times > 0); /* tables follow from the time */

  PetscFunctionBegin;
  place[0] = '\0';
  for (PetscInt p = 0; p < n; p++) {
    char value[HYCO_LINE];

    HycoFormat(value, "%s%s = %g", p ? "" : "at ", s->parameter[p], (double)v[p]);
    PetscCall(HycoListAdd(place, ", ", value));
  }
  if (n) PetscCall(HycoListAdd(place, "", ": "));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Assembles K, F, B and D for the variables v as solve does; its errors are reported with the point. Collective. */
static PetscErrorCode Assemble(Check *check, const PetscReal v[], PetscBool first)
{
  HycoFOM f = check->fom;
  char message[HYCO_LINE], place[HYCO_LINE];
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoCatchBegin());
  ierr = HycoFOMAssemble(f, v);
  PetscCall(HycoCatchEnd(ierr, message));
  PetscCall(NamePoint(f->scene, v, place));
  HycoCheck(!ierr, "%s%s", place, message);
  HycoOnRoot(HycoComm(f), Measure(check, v, first));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks a point of the ranges: with a history at the end and at the begin. Collective. */
static PetscErrorCode CheckPoint(Check *check, const PetscReal mu[], PetscBool first)
{
  HycoScene s = check->fom->scene;
  PetscReal v[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  if (!s->n_times) {
    PetscCall(Assemble(check, mu, first));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  HycoSceneSetTime(s, mu, s->times[s->n_times - 1], v);
  PetscCall(Assemble(check, v, first));
  HycoSceneSetTime(s, mu, s->times[0], v);
  PetscCall(Assemble(check, v, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- description of the scene: rank 0 -- */

/* The number of nodes of each tie's slave; *n: of all ties. */
static PetscErrorCode PrintTies(Check *check, HycoMesh m, PetscInt *n)
{
  HycoScene s = check->fom->scene;
  cJSON *list = cJSON_AddArrayToObject(check->json, "ties");

  PetscFunctionBegin;
  *n = 0;
  for (PetscInt t = 0; t < s->n_ties; t++) {
    PetscInt entry = 0, nodes = 0;
    cJSON *one = cJSON_CreateObject();

    for (; m->ties && entry < m->ties->n; entry++)
      nodes += m->ties->tie[entry] == t && (!entry || m->ties->slave[entry - 1] != m->ties->slave[entry]);
    cJSON_AddStringToObject(one, "name", s->tie[t].name);
    cJSON_AddNumberToObject(one, "n_nodes", nodes);
    cJSON_AddItemToArray(list, one);
    PetscCall(CheckReportTie(check, t, one));
    PetscCall(DriverPrint("tie %s: %d nodes of %s follow %s\n", s->tie[t].name, (int)nodes, s->tie[t].slave,
                          s->tie[t].master));
    *n += nodes;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The cells by type, "quad4 (24), tri3 (12)", and with their numbers to the report; of a mesh of one type only its
 * name.
 */
static PetscErrorCode NameCells(Check *check, char name[HYCO_LINE])
{
  HycoMesh m = check->whole->part;
  cJSON *types = cJSON_AddObjectToObject(check->json, "cell_types");
  PetscInt n[HYCO_N_CELL_TYPES] = {0};

  PetscFunctionBegin;
  name[0] = '\0';
  for (PetscInt e = 0; e < m->n_cells; e++) n[HycoMeshShape(m, e)]++;
  for (int t = 0; t < HYCO_N_CELL_TYPES; t++) {
    char one[HYCO_LINE];

    if (!n[t]) continue;
    cJSON_AddNumberToObject(types, HycoCellKinds[t].name, n[t]);
    HycoFormat(one, n[t] < m->n_cells ? "%s (%d)" : "%s", HycoCellKinds[t].name, (int)n[t]);
    PetscCall(HycoListAdd(name, ", ", one));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PrintMesh(Check *check)
{
  HycoFOM f = check->fom;
  HycoMesh m = f->part;
  const char *title;
  char cells[HYCO_LINE];
  PetscInt n_fixed = f->n_nodes * m->dim - f->n_free, n_tied;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetTitle(f->scene, &title));
  PetscCall(DriverPrint("scene: %s\n", title[0] ? title : "(no title)"));
  PetscCall(NameCells(check, cells));
  PetscCall(
      DriverPrint("mesh %s: %dD, %s%s, %d nodes, %d cells; %d free unknowns, and %d fixed by supports%s\n",
                  f->scene->dm ? "of the program" : f->scene->mesh_path, (int)m->dim, cells,
                  f->scene->face_nodes ? " (the file's hex20 cells with nodes on faces and inside, for contact)" : "",
                  (int)f->n_nodes, (int)f->n_cells, (int)f->n_free, (int)n_fixed, f->scene->n_ties ? " and ties" : ""));
  PetscCall(PrintTies(check, m, &n_tied));
  cJSON_AddNumberToObject(check->json, "dimension", m->dim);
  cJSON_AddStringToObject(check->json, "cell_type", HycoCellKinds[m->type].name);
  cJSON_AddBoolToObject(check->json, "hex20_as_hex27", f->scene->face_nodes);
  ReportNumbers(check->json, {"n_nodes", f->n_nodes}, {"n_cells", f->n_cells}, {"n_dof", f->n_free},
                {"n_fixed", n_fixed - n_tied * m->dim}, {"n_contacts", f->n_contacts},
                {"points_checked", check->n_points});
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a motion is that of a rigid body, whose node moves (contact type rigid). */
static PetscBool IsRigidBodys(HycoFOM f, const PetscReal motion[])
{
  HycoMesh m = f->part;
  PetscReal at = 0, most = 0;

  for (PetscInt i = 0; i < HycoFEUnknowns(f->fe); i++) most = PetscMax(most, PetscAbsReal(motion[i]));
  for (PetscInt k = 0; k < f->scene->n_contacts; k++) {
    const HycoContact contact = f->scene->contact[k];
    PetscInt g = 0;

    if (!contact->rigid) continue;
    while (strcmp(m->group_name[g], contact->master)) g++; /* it is there: the contacts are set up */
    for (PetscInt c = 0; c < m->dim; c++)
      at = PetscMax(at, PetscAbsReal(motion[m->group_node[m->group_start[g]] * m->dim + c]));
  }
  return (PetscBool)(at > 1e-6 * most);
}

/* Evaluates the outputs of a body at rest: refuses groups and components that solve would refuse. */
static PetscErrorCode CheckOutputs(Check *check)
{
  HycoFE fe = check->whole->fe;
  PetscReal *u, *sigma, *reaction, value[HYCO_MAX_QUANTITIES];
  PetscErrorCode ierr;

  PetscFunctionBegin;
  if (!fe->scene->n_quantities) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc3(fe->n_dof, &u, fe->mesh->n_cells * fe->n_sigma, &sigma, fe->n_dof, &reaction));
  ierr = HycoQuantitiesMeasure(HycoComm(check->whole), fe, u, sigma, reaction, NULL, value);
  PetscCall(PetscFree3(u, sigma, reaction));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reports motions that the supports leave free: contact prevents them, or -hyco_regularise removes them; others are
   an error of the assembly. */
static PetscErrorCode PrintMotions(Check *check)
{
  HycoFOM f = check->whole;
  cJSON *list = cJSON_AddArrayToObject(check->json, "free_motions");
  HycoMotions free = {0, NULL, NULL, NULL, NULL};
  PetscInt loose = 0;

  PetscFunctionBegin;
  cJSON_AddStringToObject(check->json, "regularised", f->summary.regularised);
  if (f->summary.regularised[0]) {
    PetscCall(DriverPrint("regularised: neither supports nor contact keep %s\n", f->summary.regularised));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoFEFreeMotions(HycoComm(f), f->fe, &free));
  for (PetscInt k = 0; k < free.n; k++) {
    cJSON_AddItemToArray(list, cJSON_CreateString(free.name[k]));
    PetscCall(DriverPrint("no support keeps %s: contact alone does\n", free.name[k]));
    loose += !IsRigidBodys(f, free.motion + k * HycoFEUnknowns(f->fe));
  }
  if (loose)
    CheckReportWarning(
        check,
        "%d rigid motion%s prevented only by contact: full order can solve this if the loads press the bodies "
        "together, and so can models of bodies, hybrid and projection-based ones; a condensed model needs a support or "
        "a soft spring",
        (int)loose, loose > 1 ? "s are" : " is");
  PetscCall(HycoMotionsDestroy(&free));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscBool AnyChanges(HycoExpr const e[3], const PetscBool changed[])
{
  return (PetscBool)(HycoExprChanges(e[0], changed) || HycoExprChanges(e[1], changed) ||
                     HycoExprChanges(e[2], changed));
}

enum { MAPS, STIFFNESS, LAWS, TEMPERATURES, ROWS, GAPS, LOADS, SUPPORTS, N_REACHED };
static const char *const reached[N_REACHED] = {"maps",         "stiffness", "laws",  "temperatures",
                                               "contact rows", "gaps",      "loads", "supports"};

/* What a variable affects, from the entries that contain it; a map moves everything on its body. "laws": constants
   that do not affect the elastic stiffness. */
static void FindReach(HycoScene s, PetscInt p, PetscBool does[N_REACHED])
{
  PetscBool changed[HYCO_MAX_PARAMETERS] = {PETSC_FALSE};
  HycoChanges c;

  changed[p] = PETSC_TRUE;
  c = HycoSceneChanges(s, changed);
  does[MAPS] = c.nodes;
  does[STIFFNESS] = c.stiffness;
  does[ROWS] = (PetscBool)(c.rows && s->n_contacts);
  does[GAPS] = (PetscBool)(c.gaps && s->n_contacts);
  for (PetscInt k = 0; k < s->n_loads; k++)
    does[LOADS] = (PetscBool)(does[LOADS] || HycoExprChanges(s->load[k].pressure, changed) ||
                              AnyChanges(s->load[k].traction, changed));
  for (PetscInt k = 0; k < s->n_point_loads; k++)
    does[LOADS] = (PetscBool)(does[LOADS] || AnyChanges(s->point_load[k].force, changed));
  for (PetscInt b = 0; b < s->n_bodies; b++) {
    const HycoMaterial law = s->body[b].law;
    HycoExpr const heat[3] = {s->body[b].temperature, s->body[b].reference, s->body[b].expansion};

    does[LOADS] = (PetscBool)(does[LOADS] || AnyChanges(s->body[b].force, changed) ||
                              HycoSceneHasInertia(s, &s->body[b], changed));
    does[TEMPERATURES] = (PetscBool)(does[TEMPERATURES] || AnyChanges(heat, changed));
    for (PetscInt j = 0; j < law->constants.n && !c.stiffness; j++)
      does[LAWS] = (PetscBool)(does[LAWS] || HycoExprChanges(law->constants.entry[j].expr, changed));
  }
  for (PetscInt k = 0; k < s->n_fixed; k++)
    does[SUPPORTS] = (PetscBool)(does[SUPPORTS] || AnyChanges(s->fixed[k].value, changed) ||
                                 HycoExprChanges(s->fixed[k].normal, changed));
}

/* Reports a parameter, or the time of a history, or one of its tables. */
static PetscErrorCode PrintReach(Check *check, PetscInt p, cJSON *reaches)
{
  HycoScene s = check->fom->scene;
  PetscBool does[N_REACHED] = {PETSC_FALSE};
  const char *what = p < s->n_parameters ? "parameter" : p == s->n_parameters ? "time" : "table";
  cJSON *list = cJSON_AddArrayToObject(reaches, s->parameter[p]);
  char words[HYCO_LINE] = "";

  PetscFunctionBegin;
  FindReach(s, p, does);
  for (PetscInt k = 0; k < N_REACHED; k++) {
    if (!does[k]) continue;
    PetscCall(HycoListAdd(words, ", ", reached[k]));
    cJSON_AddItemToArray(list, cJSON_CreateString(reached[k]));
  }
  if (!words[0] && p == s->n_parameters)
    PetscFunctionReturn(PETSC_SUCCESS); /* laws and tables depend on time in any
                                           case */
  PetscCall(DriverPrint("%s %s", what, s->parameter[p]));
  if (p < s->n_parameters) PetscCall(DriverPrint(" from %g to %g", (double)s->lo[p], (double)s->hi[p]));
  PetscCall(DriverPrint(": affects %s\n", words[0] ? words : "nothing"));
  if (p < s->n_parameters && does[STIFFNESS] && !does[MAPS] && s->lo[p] > 0 && s->hi[p] >= WIDE * s->lo[p]) {
    cJSON_AddItemToArray(cJSON_GetObjectItem(check->json, "wide_ranges"), cJSON_CreateString(s->parameter[p]));
    PetscCall(DriverPrint(
        "  for a condensed model, let its logarithm be the parameter: q from %.4g to %.4g, and 10^q in place of "
        "%s\n",
        log10((double)s->lo[p]), log10((double)s->hi[p]), s->parameter[p]));
  }
  if (!words[0]) CheckReportWarning(check, "the %s %s affects nothing: no expression uses it", what, s->parameter[p]);
  if (p < s->n_parameters && s->lo[p] == s->hi[p])
    CheckReportWarning(check, "the range of the parameter %s is a single value", s->parameter[p]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Describe(Check *check)
{
  HycoScene s = check->fom->scene;
  cJSON *reaches;

  PetscFunctionBegin;
  PetscCall(PrintMesh(check));
  PetscCall(CheckReportBodies(check));
  CheckReportContacts(check);
  PetscCall(PrintMotions(check));
  PetscCall(CheckOutputs(check));
  reaches = cJSON_AddObjectToObject(check->json, "parameters");
  cJSON_AddArrayToObject(check->json, "wide_ranges");
  for (PetscInt p = 0; p < s->n_variables; p++) PetscCall(PrintReach(check, p, reaches));
  if (s->n_times)
    PetscCall(DriverPrint("history of %d times from %g to %g\n", (int)s->n_times, (double)s->times[0],
                          (double)s->times[s->n_times - 1]));
  cJSON_AddNumberToObject(check->json, "n_times", s->n_times);
  PetscCall(CheckReportGroups(check));
  PetscCall(DriverPrint("%d point%s of the ranges assembled%s%s\n", (int)check->n_points,
                        check->n_points > 1 ? "s" : "",
                        s->n_parameters > MOST_CORNERS ? ": the centre and the ends of each parameter"
                        : s->n_parameters              ? ": the centre and the corners"
                                                       : "",
                        s->n_times ? ", each at the first and the last time" : ""));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* How the parameters enter the bodies, with changes from the point mu; of scenes with contact whose bodies are all
   linear. Collective. */
static PetscErrorCode PrintBodies(Check *check, const PetscReal mu[])
{
  HycoFOM f = check->fom;
  HycoBodyParts parts;
  char text[HYCO_LINE];

  PetscFunctionBegin;
  if (!f->n_contacts || !f->scene->n_parameters || f->scene->n_times) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoBodyPartsFind(f, mu, &parts));
  PetscCall(HycoBodyPartsDescribe(f->scene, &parts, text));
  PetscCall(HycoBodyPartsDestroy(&parts));
  PetscCall(DriverPrint("%s\n", text));
  if (check->json) cJSON_AddStringToObject(check->json, "bodies_by_parameter", text);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the command -- */

static PetscErrorCode ReadSolve(PetscBool *solve)
{
  PetscFunctionBegin;
  *solve = PETSC_FALSE;
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "hyco", NULL);
  PetscCall(HycoOptionsFlag("-check_solve", "solve at the centre of the ranges, so that seconds are measured", solve));
  PetscOptionsEnd();
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DeclareCheck(PetscOptions options)
{
  char path[PETSC_MAX_PATH_LEN];
  PetscBool solve;

  PetscFunctionBegin;
  (void)options;
  PetscCall(DriverReadFiles(path, NULL, NULL, path, NULL));
  PetscCall(DriverGetSamples(NULL, PETSC_FALSE, NULL, NULL));
  PetscCall(ReadSolve(&solve));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Create(HycoFOM fom, Check *check)
{
  const PetscInt bodies = fom->scene->n_bodies, contacts = fom->scene->n_contacts;

  PetscFunctionBegin;
  check->fom = fom;
  PetscCall(ReportCreate("check", fom->scene, NULL, &check->json));
  check->warnings = cJSON_CreateArray();
  PetscCall(PetscCalloc1(contacts, &check->contact));
  PetscCall(PetscCalloc1(bodies, &check->stretch));
  PetscCall(PetscCalloc1(bodies, &check->stretched));
  for (PetscInt k = 0; k < contacts; k++) {
    check->contact[k].facing_min = PETSC_MAX_INT;
    check->contact[k].gap_min = PETSC_MAX_REAL;
    check->contact[k].gap_max = -PETSC_MAX_REAL;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Prints the warnings and writes the report. */
static PetscErrorCode Finish(Check *check)
{
  const int n = cJSON_GetArraySize(check->warnings);

  PetscFunctionBegin;
  for (int k = 0; k < n; k++)
    PetscCall(DriverPrint("warning: %s\n", cJSON_GetStringValue(cJSON_GetArrayItem(check->warnings, k))));
  PetscCall(DriverPrint("%d warning%s, no error\n", n, n == 1 ? "" : "s"));
  cJSON_AddItemToObject(check->json, "warnings", check->warnings);
  cJSON_AddNumberToObject(check->json, "n_warnings", n);
  PetscCall(ReportWrite(&check->json));
  PetscCall(PetscFree(check->contact));
  PetscCall(PetscFree(check->stretch));
  PetscCall(PetscFree(check->stretched));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks all points, the centre last, where the costs are measured. */
static PetscErrorCode Visit(Check *check, PetscBool solve, Cost *cost)
{
  const PetscInt p = check->fom->scene->n_parameters;
  PetscReal *mu, begin;

  PetscFunctionBegin;
  PetscCall(ListPoints(check->fom->scene, &check->n_points, &mu));
  for (PetscInt k = 1; k < check->n_points; k++) PetscCall(CheckPoint(check, mu + k * p, (PetscBool)(k == 1)));
  begin = HycoNow();
  PetscCall(CheckPoint(check, mu, (PetscBool)(check->n_points == 1)));
  begin = HycoNow() - begin;
  PetscCall(CheckReportEstimate(check, begin, cost));
  HycoOnRoot(HycoComm(check->fom), Describe(check));
  PetscCall(PrintBodies(check, mu));
  if (solve) PetscCall(CheckReportSolve(check, mu, cost));
  PetscCall(PetscFree(mu));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CommandCheck(void)
{
  HycoScene scene;
  HycoSamples samples = NULL;
  HycoFOM fom;
  Check check = {0};
  Cost cost = {0};
  PetscBool given, solve;
  char path[PETSC_MAX_PATH_LEN], report[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(DriverReadFiles(path, NULL, NULL, report, NULL));
  PetscCall(DriverRequire("scene", path));
  PetscCall(ReadSolve(&solve));
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, path, &scene));
  PetscCall(DriverCheckMesh(scene));
  PetscCall(DriverGetSamples(scene, PETSC_FALSE, &samples, &given));
  PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, scene, &fom));
  PetscCall(DriverCheckLeftEarly());
  check.whole = fom;
  if (fom->size > 1) HycoOnRoot(PETSC_COMM_WORLD, HycoFOMCreate(PETSC_COMM_SELF, scene, &check.whole));
  PetscCall(Create(fom, &check));
  HycoStaged(HYCO_STAGE_FULL_ORDER, Visit(&check, solve, &cost));
  PetscCall(CheckReportCountTraining(scene, samples, given, &cost));
  PetscCall(CheckReportCost(&check, &cost, given));
  PetscCall(Finish(&check));
  if (fom->size > 1 && fom->rank == 0) PetscCall(HycoFOMDestroy(&check.whole));
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}
