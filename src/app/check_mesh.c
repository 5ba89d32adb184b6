/* hyco check: the mesh, its bodies and groups. */
#include "check.h"
#include <string.h>

/* Cells with a larger aspect ratio are reported: the solver can handle them, but they resolve poorly along their
   length. */
#define LONG_CELL 100

/* The cells by type, "quad4 (24), tri3 (12)", and with their numbers to the report; of a mesh of one type only its
   name. */
static PetscErrorCode NameCells(Check *check, char name[HYCO_LINE])
{
  const HycoInspection *in = &check->in;
  cJSON *types = cJSON_AddObjectToObject(check->json, "cell_types");

  PetscFunctionBegin;
  name[0] = '\0';
  for (PetscInt t = 0; t < in->n_types; t++) {
    char one[HYCO_LINE];

    cJSON_AddNumberToObject(types, in->type[t], in->cells[t]);
    /* A single type's number is that of all cells, which has been printed. */
    HycoFormat(one, in->n_types > 1 ? "%s (%d)" : "%s", in->type[t], (int)in->cells[t]);
    PetscCall(HycoListAdd(name, ", ", one));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* n_dof counts what is solved for; the printed line adds what supports and ties take. */
PetscErrorCode CheckReportMesh(Check *check)
{
  const HycoInspection *in = &check->in;
  const char *title;
  char cells[HYCO_LINE];
  PetscInt n_tied = 0;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetTitle(check->scene, &title));
  PetscCall(DriverPrint("scene: %s\n", title[0] ? title : "(no title)"));
  PetscCall(NameCells(check, cells));
  PetscCall(DriverPrint("mesh %s: %dD, %s%s, %d nodes, %d cells; %d free unknowns, and %d fixed by supports%s\n",
                        in->mesh ? in->mesh : "of the program", (int)in->dim, cells,
                        in->face_nodes ? " (the file's hex20 cells with nodes on faces and inside, for contact)" : "",
                        (int)in->n_nodes, (int)in->n_cells, (int)in->n_free, (int)in->n_fixed,
                        in->n_ties ? " and ties" : ""));
  PetscCall(CheckReportTies(check));
  /* The solver counts unknowns of tied nodes as fixed; the report does not. */
  for (PetscInt t = 0; t < in->n_ties; t++) n_tied += in->tie[t].n_nodes;
  cJSON_AddNumberToObject(check->json, "dimension", in->dim);
  cJSON_AddStringToObject(check->json, "cell_type", in->cell_type);
  cJSON_AddBoolToObject(check->json, "hex20_as_hex27", in->face_nodes);
  ReportNumbers(check->json, {"n_nodes", in->n_nodes}, {"n_cells", in->n_cells}, {"n_dof", in->n_free},
                {"n_fixed", in->n_fixed - n_tied * in->dim}, {"n_contacts", in->n_contacts},
                {"points_checked", in->n_points});
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The text of a body, and its warnings. */
static PetscErrorCode PrintBody(Check *check, const HycoBodyInspection *b)
{
  PetscFunctionBegin;
  PetscCall(DriverPrint("body %s: %d cells", b->name, (int)b->n_cells));
  if (check->in.dim > 1)
    PetscCall(DriverPrint("; the most stretched one, %d, is %.3g times as long as wide", (int)b->stretched,
                          (double)b->stretch));
  PetscCall(DriverPrint("\n"));
  if (b->n_parts > 1)
    CheckReportWarning(
        check,
        "body %s consists of %d parts that share no node; if it should be one piece, the mesh has duplicate "
        "nodes (gmsh: Coherence, or BooleanFragments)",
        b->name, (int)b->n_parts);
  /* Meshes that were glued without merging nodes: the body would tear there without any message. */
  if (b->n_doubled)
    CheckReportWarning(
        check,
        "body %s: %d node%s on another node of the body, such as %d on %d; the body is open there, as at a "
        "crack; if it should be whole, the mesh has duplicate nodes (gmsh: Coherence, or BooleanFragments)",
        b->name, (int)b->n_doubled, b->n_doubled == 1 ? " lies" : "s lie", (int)b->doubled[1], (int)b->doubled[0]);
  if (b->stretch > LONG_CELL)
    CheckReportWarning(check, "body %s: cell %d is %.3g times as long as wide", b->name, (int)b->stretched,
                       (double)b->stretch);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Parts and doubled nodes are reported together: nodes at the same place that are not shared are the usual reason
   why a body falls apart. */
PetscErrorCode CheckReportBodies(Check *check)
{
  cJSON *bodies = cJSON_AddArrayToObject(check->json, "bodies");

  PetscFunctionBegin;
  for (PetscInt k = 0; k < check->in.n_bodies; k++) {
    const HycoBodyInspection *b = &check->in.body[k];
    cJSON *body = cJSON_CreateObject();

    cJSON_AddItemToArray(bodies, body);
    cJSON_AddStringToObject(body, "name", b->name);
    ReportNumbers(body, {"n_cells", b->n_cells}, {"n_parts", b->n_parts}, {"n_doubled", b->n_doubled},
                  {"stretch", b->stretch}, {"stretched_cell", b->stretched});
    PetscCall(PrintBody(check, b));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A user may have confused them. A warning only: two names for one surface may be meant. */
static void WarnOfAlike(Check *check, const HycoAlikeGroups *a)
{
  if (a->letters)
    CheckReportWarning(
        check, "the groups %s and %s differ only in upper and lower case, which options do not distinguish; rename one",
        a->name[0], a->name[1]);
  if (a->nodes && a->common == a->n[0] && a->common == a->n[1])
    CheckReportWarning(check, "the groups %s and %s have the same nodes", a->name[0], a->name[1]);
  else if (a->nodes)
    CheckReportWarning(check, "the groups %s (%d nodes) and %s (%d) have %d nodes in common", a->name[0], (int)a->n[0],
                       a->name[1], (int)a->n[1], (int)a->common);
}

/* Unused groups in one line: a mesh may have many that are not meant for the scene. */
PetscErrorCode CheckReportGroups(Check *check)
{
  const HycoInspection *in = &check->in;
  cJSON *unused = cJSON_AddArrayToObject(check->json, "unused_groups");
  char list[HYCO_LINE] = "";

  PetscFunctionBegin;
  for (PetscInt k = 0; k < in->n_alike; k++) WarnOfAlike(check, &in->alike[k]);
  for (PetscInt g = 0; g < in->n_groups; g++) {
    /* Used but empty: a support or load there has no effect. */
    if (in->used[g] && in->empty[g]) CheckReportWarning(check, "the group %s has no nodes of a body", in->group[g]);
    if (in->used[g]) continue;
    cJSON_AddItemToArray(unused, cJSON_CreateString(in->group[g]));
    PetscCall(HycoListAdd(list, ", ", in->group[g]));
  }
  if (list[0]) CheckReportWarning(check, "no entry of the scene uses these groups of the mesh: %s", list);
  PetscFunctionReturn(PETSC_SUCCESS);
}
