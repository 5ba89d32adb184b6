/*
  The fields of a path at its listed times, for ParaView: one .h5 with all numbers and an .xdmf that strings them
  together. Each rank writes its rows of the file's order.
*/
#include <hycofile.h>
#include <hycofields.h>
#include <hycoh5.h>
#include <hycopath.h>
#include <hycomaterialimpl.h>
#include <string.h>
#include <unistd.h>

#define MOST_FIELDS 24

struct _n_HycoSeries {
  HycoSeriesSource from; /* of the last time */
  char path[PETSC_MAX_PATH_LEN], h5_path[PETSC_MAX_PATH_LEN];
  HycoH5 h, part;   /* part: this time's alone, beside the checkpoint; NULL: none */
  PetscInt n, room; /* times */
  PetscReal *t;
  PetscInt n_fields;
  HycoField field[MOST_FIELDS]; /* of the last time, without data */
  char name[MOST_FIELDS][64];
};

static PetscInt CountItems(HycoSeries s, HycoPlace place)
{
  return place == HYCO_ON_CELLS ? s->from.n_cells : s->from.n_nodes;
}

/* "step-0003/nodes/displacement" */
static void NameSet(const HycoField *field, PetscInt k, char name[HYCO_LINE])
{
  HycoFormat(name, "step-%04d/%s/%s", (int)k, field->place == HYCO_ON_CELLS ? "cells" : "nodes", field->name);
}

/* Notes a field of this time; NULL: there are too many. */
static PetscErrorCode NoteField(HycoSeries s, const char name[], HycoPlace place, PetscInt components,
                                HycoField **field)
{
  PetscFunctionBegin;
  *field = NULL;
  if (s->n_fields == MOST_FIELDS) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscStrncpy(s->name[s->n_fields], name, sizeof(s->name[0])));
  *field = &s->field[s->n_fields];
  **field = (HycoField){s->name[s->n_fields++], place, components, NULL, 0};
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes a field of this time; missing: at nodes off its surface. */
static PetscErrorCode AddPartial(HycoSeries s, const char name[], HycoPlace place, PetscInt components,
                                 const PetscReal value[], PetscReal missing)
{
  const HycoFileOrder *rows = s->from.rows;
  HycoField *field;
  char set[HYCO_LINE];

  PetscFunctionBegin;
  PetscCall(NoteField(s, name, place, components, &field));
  if (!field) PetscFunctionReturn(PETSC_SUCCESS);
  NameSet(field, s->n, set);
  field->data = value;
  field->missing = missing;
  PetscCall(HycoFieldWriteData(s->h, rows, CountItems(s, place), set, field));
  if (s->part) PetscCall(HycoFieldWriteData(s->part, rows, CountItems(s, place), set, field));
  field->data = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AddField(HycoSeries s, const char name[], HycoPlace place, PetscInt components,
                               const PetscReal value[])
{
  PetscFunctionBegin;
  PetscCall(AddPartial(s, name, place, components, value, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AddDisplacement(HycoSeries s)
{
  const HycoSeriesSource *f = &s->from;
  const PetscInt dim = f->fe->dim;
  PetscReal *u3;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(3 * f->fe->mesh->n_nodes, &u3));
  for (PetscInt k = 0; k < f->fe->n_dof; k++) u3[3 * (k / dim) + k % dim] = f->u[k];
  PetscCall(AddField(s, "displacement", HYCO_ON_NODES, 3, u3));
  PetscCall(PetscFree(u3));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stress, its von Mises value, inelastic strain, temperature, and the laws' own variables. */
static PetscErrorCode AddState(HycoSeries s)
{
  const HycoSeriesSource *f = &s->from;
  const PetscInt n = f->fe->mesh->n_cells, ns = f->fe->n_sigma;
  HycoFEState state = f->state;
  PetscReal *sigma, *tensor, *mises, *inelastic, *temperature;
  const char *const *names;
  PetscInt n_names;

  PetscFunctionBegin;
  PetscCall(PetscCalloc5(n * ns, &sigma, 6 * n, &tensor, n, &mises, n, &inelastic, n, &temperature));
  PetscCall(HycoFEStateFields(f->fe, state, sigma, mises, inelastic, temperature));
  HycoTensor6(n, ns, sigma, tensor);
  PetscCall(AddField(s, "stress", HYCO_ON_CELLS, 6, tensor));
  PetscCall(AddField(s, "mises", HYCO_ON_CELLS, 1, mises));
  PetscCall(AddField(s, "inelastic", HYCO_ON_CELLS, 1, inelastic));
  PetscCall(AddField(s, "temperature", HYCO_ON_CELLS, 1, temperature));
  PetscCall(HycoFEStateGetNames(state, &n_names, &names));
  for (PetscInt k = 0; k < n_names; k++) {
    PetscCall(HycoFEStateVariable(f->fe, state, names[k], mises));
    PetscCall(AddField(s, names[k], HYCO_ON_CELLS, 1, mises));
  }
  PetscCall(PetscFree5(sigma, tensor, mises, inelastic, temperature));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Contact force, pressure and gap by node. */
static PetscErrorCode AddContacts(HycoSeries s)
{
  const HycoSeriesSource *f = &s->from;
  HycoContactFields c;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  if (!f->n_contacts) PetscFunctionReturn(PETSC_SUCCESS);
  ierr = HycoContactFieldsCreate(f->comm, f->fe_surface, f->pairs, f->u_surface, f->lambda, &c);
  if (!ierr) ierr = AddField(s, "contact_force", HYCO_ON_SURFACE, 3, c.force);
  if (!ierr) ierr = AddField(s, "contact_pressure", HYCO_ON_SURFACE, 1, c.pressure);
  if (!ierr) ierr = AddPartial(s, "gap", HYCO_ON_SURFACE, 1, c.gap_node, NAN);
  PetscCall(HycoContactFieldsDestroy(&c));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What does not change in time. */
static PetscErrorCode WriteMesh(HycoSeries s)
{
  const HycoSeriesSource *f = &s->from;

  PetscFunctionBegin;
  HycoOnRoot(f->comm, HycoFieldsWriteHead(s->h, f->fe->mesh, f->fe->scene, f->mu, NULL));
  PetscCall(HycoFieldsWriteMesh(s->h, "mesh", f->rows, f->fe->mesh, f->fe->X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSeriesCreate(MPI_Comm comm, const char path[], HycoSeries *series)
{
  HycoSeries s;

  PetscFunctionBegin;
  HycoOnRoot(comm, HycoFieldsCheckPath(path));
  PetscCall(PetscNew(&s));
  PetscCall(PetscStrncpy(s->path, path, sizeof(s->path)));
  PetscCall(PetscSNPrintf(s->h5_path, sizeof(s->h5_path), "%.*s.h5", (int)strlen(path) - 5, path));
  *series = s;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMSetSeries(HycoFOM f, const char path[])
{
  HycoSeries s;

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  HycoCheck(f->path, "HycoFOMSetSeries: the scene has no history; HycoFOMWrite() writes its solution");
  PetscCall(HycoSeriesCreate(HycoComm(f), path, &s));
  PetscCall(HycoSeriesDestroy(&f->path->series));
  f->path->series = s;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the full order has at its last time. */
static PetscErrorCode Look(HycoFOM f, HycoSeriesSource *from)
{
  HycoPath p = f->path;

  PetscFunctionBegin;
  *from = (HycoSeriesSource){.comm = HycoComm(f),
                             .fe = f->fe,
                             .state = p->begin,
                             .fe_surface = f->fe_surface,
                             .pairs = &f->pairs,
                             .n_nodes = f->n_nodes,
                             .n_cells = f->n_cells,
                             .n_contacts = f->n_contacts,
                             .u = f->u,
                             .u_surface = f->u_surface,
                             .lambda = f->lambda,
                             .mu = p->mu,
                             .t = p->t};
  PetscCall(HycoFOMGetRows(f, &from->rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSeriesOpen(HycoSeries s, const HycoSeriesSource *from)
{
  PetscFunctionBegin;
  s->n = 0;
  s->from = *from;
  if (s->h) PetscCall(HycoH5Close(&s->h, PETSC_FALSE));
  PetscCall(HycoH5CreateShared(from->comm, s->h5_path, &s->h));
  PetscCall(WriteMesh(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSeriesBegin(HycoFOM f)
{
  HycoSeriesSource from;

  PetscFunctionBegin;
  if (!f->path->series) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(Look(f, &from));
  PetscCall(HycoSeriesOpen(f->path->series, &from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One time's fields in a file of their own, beside the checkpoint. */
static void NamePart(HycoFOM f, PetscInt k, char path[PETSC_MAX_PATH_LEN])
{
  snprintf(path, PETSC_MAX_PATH_LEN, "%.*s.step-%04d.h5", PETSC_MAX_PATH_LEN - 32, f->path->checkpoint, (int)k);
}

/* What fields there are. */
static PetscErrorCode WriteList(HycoSeries s)
{
  char list[HYCO_LINE] = "";

  PetscFunctionBegin;
  for (PetscInt j = 0; j < s->n_fields; j++) PetscCall(HycoListAdd(list, " ", s->field[j].name));
  PetscCall(HycoH5WriteText(s->part, "fields", list));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* This rank's rows of one field of an earlier time, from its file. */
static PetscErrorCode ReadField(HycoFOM f, HycoH5 h, const HycoFileOrder *order, const char set[],
                                const HycoField *field, PetscReal **rows)
{
  const PetscInt all = CountItems(f->path->series, field->place), n = order ? order->n[field->place] : all;
  PetscInt n_rows, cols;

  PetscFunctionBegin;
  PetscCall(HycoH5GetSize(h, set, &n_rows, &cols));
  HycoCheck(n_rows == all, "its field %s has %d rows", field->name, (int)n_rows);
  PetscCall(PetscMalloc1(n * cols, rows));
  PetscCall(HycoH5ReadRows(h, set, order ? order->first[field->place] : 0, n, cols, *rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CopyField(HycoFOM f, HycoSeries s, HycoH5 h, const char name[], PetscInt k)
{
  const HycoFileOrder *order;
  HycoField *field;
  PetscReal *rows = NULL;
  PetscInt n_rows;
  char set[HYCO_LINE];

  PetscFunctionBegin;
  PetscCall(HycoFOMGetRows(f, &order));
  PetscCall(NoteField(s, name, HYCO_ON_NODES, 0, &field));
  if (!field) PetscFunctionReturn(PETSC_SUCCESS);
  NameSet(field, k, set);
  if (!HycoH5Has(h, set)) field->place = HYCO_ON_CELLS;
  NameSet(field, k, set);
  HycoOnEach(HycoComm(f), ReadField(f, h, order, set, field, &rows));
  PetscCall(HycoH5GetSize(h, set, &n_rows, &field->components));
  PetscCall(HycoH5WriteRows(s->h, set, MPIU_REAL, n_rows, field->components, order ? order->first[field->place] : 0,
                            order ? order->n[field->place] : n_rows, rows));
  PetscCall(PetscFree(rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The fields that a file lists, into the series. */
static PetscErrorCode CopyFields(HycoFOM f, HycoSeries s, HycoH5 h, PetscInt k)
{
  char *list = NULL, *word, *rest;
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  HycoOnEach(HycoComm(f), HycoH5LoadText(h, "fields", &list));
  for (word = strtok_r(list, " ", &rest); word && !ierr; word = strtok_r(NULL, " ", &rest))
    ierr = CopyField(f, s, h, word, k);
  PetscCall(PetscFree(list));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode OpenPart(HycoFOM f, PetscInt k, HycoH5 *h)
{
  char path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  NamePart(f, k, path);
  HycoCheck(access(path, R_OK) == 0,
            "there is no %s, with the fields of a time before the checkpoint: the run that wrote this had no series of "
            "fields; start again without -hyco_resume, or resume without -output",
            path);
  PetscCall(HycoH5Open(path, h));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode NoteTime(HycoSeries s, PetscReal t)
{
  PetscFunctionBegin;
  if (s->n == s->room) {
    s->room = 2 * s->room + 64;
    PetscCall(PetscRealloc((size_t)s->room * sizeof(*s->t), &s->t));
  }
  s->t[s->n++] = t;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSeriesRestore(HycoFOM f)
{
  HycoSeries s = f->path->series;

  PetscFunctionBegin;
  for (PetscInt k = 0; s && k < f->path->n_steps; k++) {
    HycoH5 h = NULL;
    PetscErrorCode ierr;

    s->n_fields = 0;
    HycoOnEach(HycoComm(f), OpenPart(f, k, &h));
    ierr = CopyFields(f, s, h, k);
    PetscCall(HycoH5Close(&h, PETSC_FALSE));
    PetscCall(ierr);
    PetscCall(NoteTime(s, f->path->steps[k].t));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AddFields(HycoSeries s)
{
  PetscFunctionBegin;
  s->n_fields = 0;
  PetscCall(AddDisplacement(s));
  PetscCall(AddState(s));
  PetscCall(AddContacts(s));
  if (s->part) HycoOnRoot(s->from.comm, WriteList(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSeriesAddTime(HycoSeries s, const HycoSeriesSource *from)
{
  PetscFunctionBegin;
  s->from = *from;
  PetscCall(AddFields(s));
  PetscCall(NoteTime(s, from->t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSeriesAdd(HycoFOM f)
{
  HycoSeries s = f->path->series;
  HycoSeriesSource from;
  char path[PETSC_MAX_PATH_LEN];
  PetscErrorCode ierr, failed;

  PetscFunctionBegin;
  if (!s) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(Look(f, &from));
  if (f->path->checkpoint[0]) {
    NamePart(f, s->n, path);
    PetscCall(HycoH5CreateShared(HycoComm(f), path, &s->part));
  }
  ierr = HycoSeriesAddTime(s, &from);
  failed = HycoH5Close(&s->part, (PetscBool)!ierr);
  PetscCall(ierr ? ierr : failed);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void WriteItem(FILE *out, const char kind[], PetscInt rows, PetscInt cols, const char h5[], const char name[])
{
  fprintf(out, "     <DataItem Format=\"HDF\" %s Dimensions=\"%ld %ld\">%s:/%s</DataItem>\n", kind, (long)rows,
          (long)cols, h5, name);
}

/* One time: the mesh, which all share, and its fields. */
static void WriteTime(HycoSeries s, FILE *out, const char h5[], PetscInt k)
{
  const HycoSeriesSource *f = &s->from;
  const HycoCellType type = f->fe->mesh->type;
  char name[HYCO_LINE], kind[64];

  fprintf(out, "   <Grid Name=\"mesh\">\n    <Time Value=\"%.17g\"/>\n", (double)s->t[k]);
  fprintf(out, "    <Topology TopologyType=\"%s\" NumberOfElements=\"%ld\"%s>\n", HycoFieldsTopology(type),
          (long)f->n_cells, type == HYCO_LINE2 ? " NodesPerElement=\"2\"" : "");
  snprintf(kind, sizeof(kind), "NumberType=\"Int\" Precision=\"%d\"", (int)sizeof(PetscInt));
  WriteItem(out, kind, f->n_cells, f->fe->mesh->nv, h5, "mesh/cells");
  fprintf(out, "    </Topology>\n    <Geometry GeometryType=\"XYZ\">\n");
  WriteItem(out, "Precision=\"8\"", f->n_nodes, 3, h5, "mesh/xyz");
  fprintf(out, "    </Geometry>\n");
  for (PetscInt j = 0; j < s->n_fields; j++) {
    const HycoField *field = &s->field[j];

    fprintf(out, "    <Attribute Name=\"%s\" AttributeType=\"%s\" Center=\"%s\">\n", field->name,
            field->components == 1   ? "Scalar"
            : field->components == 3 ? "Vector"
                                     : "Tensor6",
            field->place == HYCO_ON_CELLS ? "Cell" : "Node");
    NameSet(field, k, name);
    WriteItem(out, "Precision=\"8\"", CountItems(s, field->place), field->components, h5, name);
    fprintf(out, "    </Attribute>\n");
  }
  fprintf(out, "   </Grid>\n");
}

/* The text, and the last of the numbers. On rank 0. */
static PetscErrorCode WriteText(HycoSeries s, HycoFile *out)
{
  const char *slash = strrchr(s->h5_path, '/');
  char h5[6 * PETSC_MAX_PATH_LEN];
  FILE *text;

  PetscFunctionBegin;
  HycoFieldsEscape(slash ? slash + 1 : s->h5_path, h5);
  PetscCall(HycoFileCreate(s->path, HYCO_FILE_TEXT, out));
  text = HycoFileStream(*out);
  fprintf(text, "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\">\n <Domain>\n"
                "  <Grid Name=\"history\" GridType=\"Collection\" CollectionType=\"Temporal\">\n");
  for (PetscInt k = 0; k < s->n; k++) WriteTime(s, text, h5, k);
  fprintf(text, "  </Grid>\n </Domain>\n</Xdmf>\n");
  PetscCall(HycoFileFlush(*out));
  PetscCall(HycoH5WriteReal(s->h, "t", s->n, 1, s->t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The two files take their places, the numbers first. */
static PetscErrorCode WriteSeries(HycoSeries s, HycoFile *out)
{
  PetscFunctionBegin;
  HycoOnRoot(s->from.comm, WriteText(s, out));
  PetscCall(HycoH5Close(&s->h, PETSC_TRUE));
  HycoOnRoot(s->from.comm, HycoFileClose(out, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSeriesClose(HycoSeries s)
{
  HycoFile out = NULL;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  if (!s->n) PetscFunctionReturn(PETSC_SUCCESS);
  ierr = WriteSeries(s, &out);
  if (out) PetscCall(HycoFileClose(&out, PETSC_FALSE));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSeriesEnd(HycoFOM f)
{
  PetscFunctionBegin;
  if (f->path->series) PetscCall(HycoSeriesClose(f->path->series));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSeriesDestroy(HycoSeries *series)
{
  HycoSeries s = *series;

  PetscFunctionBegin;
  if (!s) PetscFunctionReturn(PETSC_SUCCESS);
  if (s->h) PetscCall(HycoH5Close(&s->h, PETSC_FALSE));
  PetscCall(PetscFree(s->t));
  PetscCall(PetscFree(*series));
  PetscFunctionReturn(PETSC_SUCCESS);
}
