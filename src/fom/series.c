/*
  The fields of a path at its listed times, for ParaView: one .h5 with all numbers and an .xdmf that strings them
  together. Ranks bring what they own to rank 0, where it is put in the order of the mesh file's tags, whatever the
  ranks.
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
  char path[PETSC_MAX_PATH_LEN], h5_path[PETSC_MAX_PATH_LEN];
  HycoItems node, cell;
  PetscInt nv, *cells; /* rank 0: n_all x nv, node numbers */
  PetscReal *X;        /* rank 0: nodes as moved, n_all x 3 */
  HycoH5 h;            /* rank 0 */
  PetscInt n, room;    /* times */
  PetscReal *t;
  PetscInt n_fields;
  HycoField field[MOST_FIELDS]; /* of the last time; rank 0 owns the data */
  char name[MOST_FIELDS][64];
};

/* The mesh on rank 0: cells by their nodes' tags. */
static PetscErrorCode BringMesh(HycoFOM f, HycoSeries s)
{
  HycoMesh m = f->part;
  PetscReal *tags, *all;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_cells * m->nv, &tags));
  for (PetscInt k = 0; k < m->n_cells * m->nv; k++) tags[k] = (PetscReal)m->node_id[m->cells[k]];
  PetscCall(HycoItemsBring(f, &s->cell, m->nv, tags, &all));
  PetscCall(PetscFree(tags));
  s->nv = m->nv;
  if (f->rank == 0) PetscCall(PetscMalloc1(s->cell.n_all * m->nv, &s->cells));
  for (PetscInt k = 0; k < s->cell.n_all * m->nv; k++) s->cells[k] = HycoItemsFind(&s->node, (PetscInt)all[k]);
  PetscCall(PetscFree(all));
  PetscCall(HycoItemsBring(f, &s->node, 3, f->fe->X, &s->X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds a field of this time. */
static PetscErrorCode AddField(HycoFOM f, HycoSeries s, const char name[], PetscBool on_cells, PetscInt components,
                               const PetscReal value[])
{
  HycoField *field = &s->field[s->n_fields];
  PetscReal *all;

  PetscFunctionBegin;
  if (s->n_fields == MOST_FIELDS) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoItemsBring(f, on_cells ? &s->cell : &s->node, components, value, &all));
  PetscCall(PetscStrncpy(s->name[s->n_fields], name, sizeof(s->name[0])));
  field->name = s->name[s->n_fields];
  field->place = on_cells ? HYCO_ON_CELLS : HYCO_ON_NODES;
  field->components = components;
  field->data = all;
  s->n_fields++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AddDisplacement(HycoFOM f, HycoSeries s)
{
  const PetscInt dim = f->part->dim;
  const PetscScalar *u;
  PetscReal *u3;

  PetscFunctionBegin;
  PetscCall(VecScatterBegin(f->to_local, f->U, f->U_local, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(f->to_local, f->U, f->U_local, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(PetscCalloc1(3 * f->part->n_nodes, &u3));
  PetscCall(VecGetArrayRead(f->U_local, &u));
  for (PetscInt k = 0; k < f->fe->n_dof; k++) u3[3 * (k / dim) + k % dim] = u[k];
  PetscCall(VecRestoreArrayRead(f->U_local, &u));
  PetscCall(AddField(f, s, "displacement", PETSC_FALSE, 3, u3));
  PetscCall(PetscFree(u3));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stress, its von Mises value, inelastic strain, temperature, and the laws' own variables. */
static PetscErrorCode AddState(HycoFOM f, HycoSeries s)
{
  const PetscInt n = f->part->n_cells, ns = f->fe->n_sigma;
  HycoFEState state = f->path->begin;
  PetscReal *sigma, *tensor, *mises, *inelastic, *temperature;
  const char *const *names;
  PetscInt n_names;

  PetscFunctionBegin;
  PetscCall(PetscCalloc5(n * ns, &sigma, 6 * n, &tensor, n, &mises, n, &inelastic, n, &temperature));
  PetscCall(HycoFEStateFields(f->fe, state, sigma, mises, inelastic, temperature));
  HycoTensor6(n, ns, sigma, tensor);
  PetscCall(AddField(f, s, "stress", PETSC_TRUE, 6, tensor));
  PetscCall(AddField(f, s, "mises", PETSC_TRUE, 1, mises));
  PetscCall(AddField(f, s, "inelastic", PETSC_TRUE, 1, inelastic));
  PetscCall(AddField(f, s, "temperature", PETSC_TRUE, 1, temperature));
  PetscCall(HycoFEStateGetNames(state, &n_names, &names));
  for (PetscInt k = 0; k < n_names; k++) {
    PetscCall(HycoFEStateVariable(f->fe, state, names[k], mises));
    PetscCall(AddField(f, s, names[k], PETSC_TRUE, 1, mises));
  }
  PetscCall(PetscFree5(sigma, tensor, mises, inelastic, temperature));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Contact force, pressure and gap by node, on rank 0, where the contacts are. */
static PetscErrorCode FillContacts(HycoFOM f, HycoSeries s, PetscReal force[], PetscReal pressure[], PetscReal open[])
{
  const PetscInt m = f->pairs.n, dim = f->part->dim;
  const PetscInt *tag = f->fe_surface->mesh->node_id;
  PetscReal *normal, *gap, *area;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(3 * m, &normal, m, &gap, m, &area));
  PetscCall(HycoContactGeometry(f->fe_surface, &f->pairs, normal, gap));
  PetscCall(HycoContactAreas(f->fe_surface, &f->pairs, area));
  for (PetscInt k = 0; k < m; k++) {
    const PetscInt slave = HycoItemsFind(&s->node, tag[HycoPairsSlave(&f->pairs, k)]), *master;
    const PetscReal *weight, lambda = f->lambda[k], *n = normal + 3 * k;
    PetscInt masters;

    if (HycoPairsAlone(f->scene, &f->pairs, k)) continue;
    HycoPairsMasters(&f->pairs, k, &masters, &master, &weight);
    pressure[slave] = area[k] > 0 ? lambda / area[k] : 0;
    open[slave] = gap[k];
    for (PetscInt c = 0; c < dim; c++) {
      force[3 * slave + c] -= lambda * n[c];
      open[slave] -= n[c] * s->field[0].data[3 * slave + c];
      for (PetscInt j = 0; j < masters; j++) {
        const PetscInt at = HycoItemsFind(&s->node, tag[master[j]]);

        force[3 * at + c] += weight[j] * lambda * n[c];
        open[slave] += weight[j] * n[c] * s->field[0].data[3 * at + c];
      }
    }
  }
  PetscCall(PetscFree3(normal, gap, area));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AddContacts(HycoFOM f, HycoSeries s)
{
  static const char *const name[3] = {"contact_force", "contact_pressure", "gap"};
  const PetscInt n = s->node.n_all;
  PetscReal *value[3] = {NULL, NULL, NULL};

  PetscFunctionBegin;
  if (!f->n_contacts) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < 3; k++) {
    HycoField *field = &s->field[s->n_fields + k];

    if (f->rank == 0) PetscCall(PetscCalloc1((k ? 1 : 3) * n, &value[k]));
    PetscCall(PetscStrncpy(s->name[s->n_fields + k], name[k], sizeof(s->name[0])));
    *field = (HycoField){s->name[s->n_fields + k], HYCO_ON_NODES, k ? 1 : 3, value[k]};
  }
  HycoOnRoot(HycoComm(f), FillContacts(f, s, value[0], value[1], value[2]));
  s->n_fields += 3;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ForgetFields(HycoSeries s)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n_fields; k++) PetscCall(PetscFree(s->field[k].data));
  s->n_fields = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The fields of the last time, into a file, under "step-0003/". */
static PetscErrorCode WriteFields(HycoSeries s, HycoH5 h, PetscInt k)
{
  PetscFunctionBegin;
  for (PetscInt j = 0; j < s->n_fields; j++) {
    char name[HYCO_LINE];

    HycoFormat(name, "step-%04d/%s/%s", (int)k, s->field[j].place == HYCO_ON_CELLS ? "cells" : "nodes",
               s->field[j].name);
    PetscCall(HycoH5WriteReal(h, name, s->field[j].place == HYCO_ON_CELLS ? s->cell.n_all : s->node.n_all,
                              s->field[j].components, s->field[j].data));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What does not change in time. */
static PetscErrorCode WriteMesh(HycoFOM f, HycoSeries s)
{
  const PetscInt head[2] = {(PetscInt)f->part->type, f->part->dim};
  HycoScene scene = f->scene;

  PetscFunctionBegin;
  PetscCall(HycoH5Create(s->h5_path, &s->h));
  PetscCall(HycoH5WriteText(s->h, "title", scene->title));
  PetscCall(HycoH5WriteInt(s->h, "mesh/head", 2, 1, head));
  PetscCall(HycoH5WriteReal(s->h, "mesh/xyz", s->node.n_all, 3, s->X));
  PetscCall(HycoH5WriteInt(s->h, "mesh/cells", s->cell.n_all, s->nv, s->cells));
  PetscCall(HycoH5WriteInt(s->h, "mesh/node_id", s->node.n_all, 1, s->node.tag));
  PetscCall(HycoH5WriteInt(s->h, "mesh/cell_id", s->cell.n_all, 1, s->cell.tag));
  for (PetscInt p = 0; p < scene->n_parameters; p++) {
    char name[HYCO_LINE];

    HycoFormat(name, "mu/%s", scene->parameter[p]);
    PetscCall(HycoH5WriteReal(s->h, name, 1, 1, &f->path->mu[p]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMSetSeries(HycoFOM f, const char path[])
{
  HycoSeries s;

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  HycoCheck(f->path, "HycoFOMSetSeries: the scene has no history; HycoFOMWrite() writes its solution");
  HycoOnRoot(HycoComm(f), HycoFieldsCheckPath(path));
  PetscCall(PetscNew(&s));
  PetscCall(PetscStrncpy(s->path, path, sizeof(s->path)));
  PetscCall(PetscSNPrintf(s->h5_path, sizeof(s->h5_path), "%.*s.h5", (int)strlen(path) - 5, path));
  PetscCall(HycoSeriesDestroy(&f->path->series));
  f->path->series = s;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSeriesBegin(HycoFOM f)
{
  HycoSeries s = f->path->series;

  PetscFunctionBegin;
  if (!s) PetscFunctionReturn(PETSC_SUCCESS);
  s->n = 0;
  if (s->h) PetscCall(HycoH5Close(&s->h, PETSC_FALSE)); /* of a path without any time */
  if (!s->node.own) PetscCall(HycoItemsCreate(f, &s->node, &s->cell));
  PetscCall(PetscFree(s->cells));
  PetscCall(PetscFree(s->X));
  PetscCall(BringMesh(f, s));
  HycoOnRoot(HycoComm(f), WriteMesh(f, s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One time's fields in a file of their own, beside the checkpoint. */
static void NamePart(HycoFOM f, PetscInt k, char path[PETSC_MAX_PATH_LEN])
{
  snprintf(path, PETSC_MAX_PATH_LEN, "%.*s.step-%04d.h5", PETSC_MAX_PATH_LEN - 32, f->path->checkpoint, (int)k);
}

static PetscErrorCode SavePart(HycoFOM f, HycoSeries s, PetscInt k)
{
  char path[PETSC_MAX_PATH_LEN], list[HYCO_LINE] = "";
  HycoH5 h;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  NamePart(f, k, path);
  for (PetscInt j = 0; j < s->n_fields; j++) PetscCall(HycoListAdd(list, " ", s->field[j].name));
  PetscCall(HycoH5Create(path, &h));
  ierr = WriteFields(s, h, k);
  if (!ierr) ierr = HycoH5WriteText(h, "fields", list);
  PetscCall(HycoH5Close(&h, (PetscBool)!ierr));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The fields that the file lists, in place of those of the last time. */
static PetscErrorCode ReadFields(HycoSeries s, HycoH5 h, PetscInt k)
{
  char *list = NULL, *word, *rest;

  PetscFunctionBegin;
  PetscCall(HycoH5LoadText(h, "fields", &list));
  for (word = strtok_r(list, " ", &rest); word && s->n_fields < MOST_FIELDS; word = strtok_r(NULL, " ", &rest)) {
    HycoField *field = &s->field[s->n_fields];
    char name[HYCO_LINE];
    PetscReal *data;
    PetscInt rows = -1, cols = -1;

    HycoFormat(name, "step-%04d/nodes/%s", (int)k, word);
    PetscCall(PetscStrncpy(s->name[s->n_fields], word, sizeof(s->name[0])));
    *field = (HycoField){s->name[s->n_fields], HycoH5Has(h, name) ? HYCO_ON_NODES : HYCO_ON_CELLS, 0, NULL};
    if (field->place == HYCO_ON_CELLS) HycoFormat(name, "step-%04d/cells/%s", (int)k, word);
    PetscCall(HycoH5LoadReal(h, name, &rows, &cols, &data));
    field->components = cols;
    field->data = data;
    s->n_fields++;
    HycoCheck(rows == (field->place == HYCO_ON_CELLS ? s->cell.n_all : s->node.n_all), "its field %s has %d rows", word,
              (int)rows);
  }
  PetscCall(PetscFree(list));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LoadPart(HycoFOM f, HycoSeries s, PetscInt k)
{
  char path[PETSC_MAX_PATH_LEN];
  HycoH5 h;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  NamePart(f, k, path);
  HycoCheck(access(path, R_OK) == 0,
            "there is no %s, with the fields of a time before the checkpoint: the run that wrote this had no series of "
            "fields; start again without -hyco_resume, or resume without -output",
            path);
  PetscCall(HycoH5Open(path, &h));
  ierr = ReadFields(s, h, k);
  PetscCall(HycoH5Close(&h, PETSC_FALSE));
  if (!ierr) ierr = WriteFields(s, s->h, k);
  PetscCall(ierr);
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
    PetscCall(ForgetFields(s));
    HycoOnRoot(HycoComm(f), LoadPart(f, s, k));
    PetscCall(NoteTime(s, f->path->steps[k].t));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSeriesAdd(HycoFOM f)
{
  HycoSeries s = f->path->series;

  PetscFunctionBegin;
  if (!s) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ForgetFields(s));
  PetscCall(AddDisplacement(f, s));
  PetscCall(AddState(f, s));
  PetscCall(AddContacts(f, s));
  HycoOnRoot(HycoComm(f), WriteFields(s, s->h, s->n));
  if (f->path->checkpoint[0]) HycoOnRoot(HycoComm(f), SavePart(f, s, s->n));
  PetscCall(NoteTime(s, f->path->t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void WriteItem(FILE *out, const char kind[], PetscInt rows, PetscInt cols, const char h5[], const char name[])
{
  fprintf(out, "     <DataItem Format=\"HDF\" %s Dimensions=\"%ld %ld\">%s:/%s</DataItem>\n", kind, (long)rows,
          (long)cols, h5, name);
}

/* One time: the mesh, which all share, and its fields. */
static void WriteTime(HycoSeries s, FILE *out, const char h5[], HycoCellType type, PetscInt k)
{
  char name[HYCO_LINE], kind[64];

  fprintf(out, "   <Grid Name=\"mesh\">\n    <Time Value=\"%.17g\"/>\n", (double)s->t[k]);
  fprintf(out, "    <Topology TopologyType=\"%s\" NumberOfElements=\"%ld\"%s>\n", HycoFieldsTopology(type),
          (long)s->cell.n_all, type == HYCO_LINE2 ? " NodesPerElement=\"2\"" : "");
  snprintf(kind, sizeof(kind), "NumberType=\"Int\" Precision=\"%d\"", (int)sizeof(PetscInt));
  WriteItem(out, kind, s->cell.n_all, s->nv, h5, "mesh/cells");
  fprintf(out, "    </Topology>\n    <Geometry GeometryType=\"XYZ\">\n");
  WriteItem(out, "Precision=\"8\"", s->node.n_all, 3, h5, "mesh/xyz");
  fprintf(out, "    </Geometry>\n");
  for (PetscInt j = 0; j < s->n_fields; j++) {
    const HycoField *field = &s->field[j];

    fprintf(out, "    <Attribute Name=\"%s\" AttributeType=\"%s\" Center=\"%s\">\n", field->name,
            field->components == 1   ? "Scalar"
            : field->components == 3 ? "Vector"
                                     : "Tensor6",
            field->place == HYCO_ON_CELLS ? "Cell" : "Node");
    HycoFormat(name, "step-%04d/%s/%s", (int)k, field->place == HYCO_ON_CELLS ? "cells" : "nodes", field->name);
    WriteItem(out, "Precision=\"8\"", field->place == HYCO_ON_CELLS ? s->cell.n_all : s->node.n_all, field->components,
              h5, name);
    fprintf(out, "    </Attribute>\n");
  }
  fprintf(out, "   </Grid>\n");
}

/* The two files take their places, the numbers first. */
static PetscErrorCode WriteSeries(HycoFOM f, HycoSeries s)
{
  const char *slash = strrchr(s->h5_path, '/');
  char h5[6 * PETSC_MAX_PATH_LEN];
  HycoFile out;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  HycoFieldsEscape(slash ? slash + 1 : s->h5_path, h5);
  PetscCall(HycoFileCreate(s->path, HYCO_FILE_TEXT, &out));
  fprintf(HycoFileStream(out), "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\">\n <Domain>\n"
                               "  <Grid Name=\"history\" GridType=\"Collection\" CollectionType=\"Temporal\">\n");
  for (PetscInt k = 0; k < s->n; k++) WriteTime(s, HycoFileStream(out), h5, f->part->type, k);
  fprintf(HycoFileStream(out), "  </Grid>\n </Domain>\n</Xdmf>\n");
  ierr = HycoFileFlush(out);
  if (!ierr) ierr = HycoH5WriteReal(s->h, "t", s->n, 1, s->t);
  if (!ierr) ierr = HycoH5Close(&s->h, PETSC_TRUE);
  if (!ierr)
    ierr = HycoFileClose(&out, PETSC_TRUE);
  else
    PetscCall(HycoFileClose(&out, PETSC_FALSE));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSeriesEnd(HycoFOM f)
{
  HycoSeries s = f->path->series;

  PetscFunctionBegin;
  if (!s || !s->n) PetscFunctionReturn(PETSC_SUCCESS);
  HycoOnRoot(HycoComm(f), WriteSeries(f, s));
  PetscCall(ForgetFields(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSeriesDestroy(HycoSeries *series)
{
  HycoSeries s = *series;

  PetscFunctionBegin;
  if (!s) PetscFunctionReturn(PETSC_SUCCESS);
  if (s->h) PetscCall(HycoH5Close(&s->h, PETSC_FALSE));
  PetscCall(ForgetFields(s));
  PetscCall(HycoItemsDestroy(&s->node));
  PetscCall(HycoItemsDestroy(&s->cell));
  PetscCall(PetscFree(s->cells));
  PetscCall(PetscFree(s->X));
  PetscCall(PetscFree(s->t));
  PetscCall(PetscFree(*series));
  PetscFunctionReturn(PETSC_SUCCESS);
}
