/*
  Files of fields on one mesh: PATH.xdmf with its numbers in PATH.h5, or one PATH.vtkhdf; for one solution, or for
  several times. Each rank writes its rows in the file's order.
*/
#include <hycofields.h>
#include <hycofile.h>
#include <hycofom.h>
#include <hycoh5.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

static const char *const topology[HYCO_N_CELL_TYPES] = {"Polyline",
                                                        "Triangle",
                                                        "Quadrilateral",
                                                        "Tetrahedron",
                                                        "Hexahedron",
                                                        "Triangle_6",
                                                        "Quadrilateral_8",
                                                        "Quadrilateral_9",
                                                        "Tetrahedron_10",
                                                        "Hexahedron_20",
                                                        "Hexahedron_27",
                                                        NULL,
                                                        NULL};
/* XDMF's codes of the shapes in a mixed topology. */
static const unsigned char code[HYCO_N_CELL_TYPES] = {
    [HYCO_TRI3] = 4, [HYCO_QUAD4] = 5, [HYCO_TET4] = 6, [HYCO_PYRAMID5] = 7, [HYCO_PRISM6] = 8, [HYCO_HEX8] = 9};

/* The length of the ending .vtkhdf or .xdmf of a path; 0: another ending. */
static size_t FieldFileEnding(const char path[])
{
  const size_t n = strlen(path);

  if (n > 5 && strcmp(path + n - 5, ".xdmf") == 0) return 5;
  return n > 7 && strcmp(path + n - 7, ".vtkhdf") == 0 ? 7 : 0;
}

/* The margin of 16 is for endings that are added to it. */
PetscErrorCode HycoFieldsNumbers(const char path[], char numbers[PETSC_MAX_PATH_LEN])
{
  size_t ending;

  PetscFunctionBegin;
  HycoCheckGiven(path);
  HycoCheckGiven(numbers);
  ending = FieldFileEnding(path);
  HycoCheck(
      ending && strlen(path) < PETSC_MAX_PATH_LEN - 16,
      "the output is named %s; give a name that ends in .xdmf (with the numbers in a .h5 file beside it) or in .vtkhdf",
      path);
  if (ending == 5)
    snprintf(numbers, PETSC_MAX_PATH_LEN, "%.*s.h5", (int)strlen(path) - 5, path);
  else
    PetscCall(PetscStrncpy(numbers, path, PETSC_MAX_PATH_LEN));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Before the solution is computed, which may take hours: a model must not be overwritten by a mistyped -o. */
PetscErrorCode HycoFieldsCheckPath(const char path[])
{
  char h5[PETSC_MAX_PATH_LEN];
  struct stat info;
  PetscBool precious;

  PetscFunctionBegin;
  PetscCall(HycoFieldsNumbers(path, h5));
  /* Writability is checked when the command reads its options; this is about what may not be replaced. */
  if (stat(h5, &info) != 0) PetscFunctionReturn(PETSC_SUCCESS);
  HycoCheck(S_ISREG(info.st_mode),
            "%s is not a file (a folder, a device, a pipe), and the numbers of %s would be written there; give the "
            "output another name",
            h5, path);
  PetscCall(HycoH5IsPrecious(h5, &precious));
  HycoCheck(!precious,
            "%s is a model or a snapshot, and the numbers of %s would be written there; give the output another name",
            h5, path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* most: of times or points; 0: one solution, without times. Nothing is written until HycoFieldFileOpen(). */
PetscErrorCode HycoFieldFileCreate(MPI_Comm comm, const char path[], PetscInt most, PetscBool points,
                                   HycoFieldFile *file)
{
  HycoFieldFile f;

  PetscFunctionBegin;
  HycoCheckValue(!points || most > 0, "a file of %d points was asked for; at least 1 is expected", (int)most);
  HycoOnRoot(comm, HycoFieldsCheckPath(path));
  PetscCall(PetscNew(&f));
  f->comm = comm;
  f->most = most;
  f->points = points;
  f->vtk = (PetscBool)(FieldFileEnding(path) == 7);
  PetscCall(PetscStrncpy(f->path, path, sizeof(f->path)));
  PetscCall(HycoFieldsNumbers(path, f->h5_path));
  /* Times arrive one by one; none is allocated while fields are written. */
  PetscCall(PetscMalloc1(most, &f->t));
  *file = f;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of the whole mesh, not of this rank: datasets have one size on all ranks. */
PetscInt HycoFieldFileCount(HycoFieldFile f, HycoPlace place)
{
  return f->order ? f->order->all[place] : place == HYCO_ON_CELLS ? f->mesh->n_cells : f->mesh->n_nodes;
}

/* The title, cell type and dimension. On one process. */
static PetscErrorCode WriteHead(HycoFieldFile f)
{
  const PetscInt head[2] = {(PetscInt)f->mesh->type, f->mesh->dim};

  PetscFunctionBegin;
  PetscCall(HycoH5WriteText(f->h, "title", f->scene->title));
  PetscCall(HycoH5WriteInt(f->h, "mesh/head", 2, 1, head)); /* cell type (HycoCellType), dimension */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A mixed mesh's cells by shape, for the .xdmf. Collective with an order. XDMF has no connectivity with offsets: a
   mixed topology is one list with a code before each cell's nodes. */
static PetscErrorCode WriteTopology(HycoFieldFile f)
{
  HycoCellList cells;

  PetscFunctionBegin;
  PetscCall(HycoCellListCreate(f->order, f->mesh, code, &cells));
  f->n_items = cells.all;
  HycoFinally(HycoCellListWrite(f->h, "mesh/topology", &cells), PetscCall(HycoCellListDestroy(&cells)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* order, mesh, scene and X are borrowed until the file is committed. Opening again starts anew: a file that was
   not committed is discarded. */
PetscErrorCode HycoFieldFileOpen(HycoFieldFile f, const HycoFileOrder *order, HycoMesh mesh, HycoScene scene,
                                 const PetscReal X[], const PetscReal mu[])
{
  PetscFunctionBegin;
  f->order = order;
  f->mesh = mesh;
  f->scene = scene;
  f->n = f->n_fields = 0;
  PetscCall(PetscFree(f->mu));
  PetscCall(PetscMalloc1(PetscMax(f->most, 1) * scene->n_parameters + 1, &f->mu));
  PetscCall(PetscArraycpy(f->mu, mu, scene->n_parameters));
  /* A former file that was not committed is dropped: false removes it. */
  PetscCall(HycoH5Close(&f->h, PETSC_FALSE));
  PetscCall(HycoH5CreateShared(f->comm, f->h5_path, &f->h));
  if (f->vtk) {
    PetscCall(HycoVTKWriteMesh(f, X));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  HycoOnRoot(f->comm, WriteHead(f));
  PetscCall(HycoFieldsWriteMesh(f->h, "mesh", order, mesh, X, PETSC_TRUE));
  /* One shape needs no codes: XDMF reads the cells' table as it is. */
  if (mesh->mixed) PetscCall(WriteTopology(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* "nodes/displacement", for times "step-0003/nodes/displacement" */
static void NameSet(HycoFieldFile f, PetscInt k, const HycoField *field, char name[HYCO_LINE])
{
  const char *folder = field->place == HYCO_ON_CELLS ? "cells" : "nodes";

  if (f->most)
    HycoFieldName(field, k, name);
  else
    HycoFormat(name, "%s/%s", folder, field->name);
}

/* Steps have a folder each, so that all times have fields of the same names. Four digits keep the order of names
   that of times for readers that sort. */
void HycoFieldName(const HycoField *field, PetscInt k, char name[HYCO_LINE])
{
  HycoFormat(name, "step-%04d/%s/%s", (int)k, field->place == HYCO_ON_CELLS ? "cells" : "nodes", field->name);
}

/* The attribute names of an existing dataset: those of the contacts in their order, with blanks between. The field
   `contact` has the number of a contact; the names make it readable. */
static PetscErrorCode NameContacts(HycoFieldFile f, const char set[])
{
  size_t length = 1, at = 0;
  char *names;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < f->scene->n_contacts; k++) length += strlen(f->scene->contact[k]->name) + 1;
  PetscCall(PetscCalloc1(length, &names));
  for (PetscInt k = 0; k < f->scene->n_contacts; k++)
    at += (size_t)snprintf(names + at, length - at, "%s%s", k ? " " : "", f->scene->contact[k]->name);
  PetscCall(HycoH5WriteAttribute(f->h, set, "names", names));
  PetscCall(PetscFree(names));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes the unit of a field, as given in the scene, and the names of its components, to an existing dataset. On one
   process. Units are the scene's text; without them only the components are described. */
static PetscErrorCode FieldFileDescribe(HycoFieldFile f, const char set[], const HycoField *field)
{
  static const char *const lengths[] = {"displacement", "gap", "contact_slip", NULL},
                           *const forces[] = {"contact_force", NULL},
                           *const stresses[] = {"stress",       "mises",       "principal_stress", "contact_pressure",
                                                "nodal_stress", "nodal_mises", "contact_traction", NULL};
  const char *const *const kinds[3] = {lengths, forces, stresses};

  PetscFunctionBegin;
  for (PetscInt kind = 0; kind < 3; kind++) {
    for (PetscInt k = 0; kinds[kind][k]; k++) {
      if (!strcmp(field->name, kinds[kind][k]) && f->scene->unit[kind] && f->scene->unit[kind][0])
        PetscCall(HycoH5WriteAttribute(f->h, set, "unit", f->scene->unit[kind]));
    }
  }
  /* By name: fields carry no kind, and these names are those of the documented outputs. */
  if (!strcmp(field->name, "contact")) PetscCall(NameContacts(f, set));
  if (!strcmp(field->name, "principal_stress"))
    PetscCall(HycoH5WriteAttribute(f->h, set, "components", "1 2 3"));
  else if (field->components == 3)
    PetscCall(HycoH5WriteAttribute(f->h, set, "components", "x y z"));
  /* The two formats order symmetric tensors differently; what is written says so itself. */
  else if (field->components == 6)
    PetscCall(HycoH5WriteAttribute(f->h, set, "components", f->vtk ? "xx yy zz xy yz xz" : "xx xy xz yy yz zz"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* rows: this rank's, in the file's order. The names are noted for the .xdmf, which is written at the end. */
PetscErrorCode HycoFieldFileAddRows(HycoFieldFile f, const HycoField *field, const PetscReal rows[])
{
  const PetscInt all = HycoFieldFileCount(f, field->place), own = f->order ? f->order->n[field->place] : all,
                 first = f->order ? f->order->first[field->place] : 0;
  HycoField *noted = &f->field[f->n_fields];
  char set[HYCO_LINE];

  PetscFunctionBegin;
  /* A fixed table: the fields of a file are known when it is designed, hence an internal error. */
  PetscCheck(f->n_fields < HYCO_MOST_FIELDS, f->comm, PETSC_ERR_PLIB,
             "%s: no room for the field %s; there are %d already", f->path, field->name, HYCO_MOST_FIELDS);
  PetscCall(PetscStrncpy(f->name[f->n_fields], field->name, sizeof(f->name[0])));
  *noted = *field;
  noted->name = f->name[f->n_fields++];
  /* The data belong to the caller and are gone when the .xdmf is written; only name, place and size are kept. */
  noted->data = NULL;
  if (f->vtk)
    PetscCall(HycoVTKWriteField(f, field, rows, set));
  else {
    NameSet(f, f->n, field, set);
    PetscCall(HycoH5WriteRows(f->h, set, MPIU_REAL, all, field->components, first, own, rows));
  }
  HycoOnRoot(f->comm, FieldFileDescribe(f, set, field));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* As HycoFieldFileAddRows(), for data at the nodes or cells of the part, which it sends to the ranks that write
   them. */
PetscErrorCode HycoFieldFileAdd(HycoFieldFile f, const HycoField *field)
{
  const PetscInt n = HycoFieldFileCount(f, field->place);
  void *rows;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoFieldRows(f->order, n, field->place, MPIU_REAL, field->components, field->data, &rows));
  ierr = HycoFieldFileAddRows(f, field, (const PetscReal *)rows);
  /* Without an order the rows are the caller's own array. */
  if (rows != field->data) PetscCall(PetscFree(rows));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The list of fields starts anew: every time has the same ones. */
PetscErrorCode HycoFieldFileBeginTime(HycoFieldFile f, PetscReal t)
{
  PetscFunctionBegin;
  PetscCheck(f->n < f->most, PETSC_COMM_SELF, PETSC_ERR_PLIB, "there are more times than the %d that were declared",
             (int)f->most);
  f->t[f->n] = t;
  f->n_fields = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A point's number is its time: viewers show several meshes of one topology as a series. */
PetscErrorCode HycoFieldFileBeginPoint(HycoFieldFile f, const PetscReal X[], const PetscReal mu[])
{
  const PetscInt n_par = f->scene->n_parameters;
  char set[HYCO_LINE];

  PetscFunctionBegin;
  PetscCall(HycoFieldFileBeginTime(f, f->n));
  PetscCall(PetscArraycpy(f->mu + f->n * n_par, mu, n_par));
  /* A .vtkhdf has the points of all times in one dataset, an .xdmf a dataset for each. */
  if (f->vtk) {
    PetscCall(HycoVTKWritePoints(f, X));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  HycoFormat(set, "step-%04d/xyz", (int)f->n);
  PetscCall(HycoFieldWrite(f->h, f->order, f->mesh->n_nodes, set, HYCO_ON_NODES, MPIU_REAL, 3, 3, X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* n counts times that are complete, and names the next step. */
PetscErrorCode HycoFieldFileEndTime(HycoFieldFile f)
{
  PetscFunctionBegin;
  f->n++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------------------------------ XDMF */

/* Escapes a name for XML. */
static void FieldFileEscape(const char name[], char out[6 * PETSC_MAX_PATH_LEN])
{
  static const char special[] = "&<>\"'";
  static const char *const entity[] = {"&amp;", "&lt;", "&gt;", "&quot;", "&apos;"};

  for (; *name; name++) {
    const char *at = strchr(special, *name);

    /* Each character becomes at most 6, which is the room that out[] has. */
    if (at)
      out += sprintf(out, "%s", entity[at - special]);
    else
      *out++ = *name;
  }
  *out = '\0';
}

/* cols 0: a dataset of one dimension. The path of the .h5 is relative to the .xdmf, so that both can be moved
   together. */
static void WriteItem(FILE *out, const char kind[], PetscInt rows, PetscInt cols, const char h5[], const char name[])
{
  fprintf(out, "    <DataItem Format=\"HDF\" %s Dimensions=\"%ld", kind, (long)rows);
  if (cols) fprintf(out, " %ld", (long)cols);
  fprintf(out, "\">%s:/%s</DataItem>\n", h5, name);
}

/* The mesh, whose cells are common to all times, and the fields of one. */
static void WriteGrid(HycoFieldFile f, FILE *out, const char h5[], PetscInt k)
{
  const HycoCellType type = f->mesh->type;
  const PetscInt n_cells = HycoFieldFileCount(f, HYCO_ON_CELLS);
  char name[HYCO_LINE], kind[64];

  fprintf(out, "  <Grid Name=\"mesh\" GridType=\"Uniform\">\n");
  /* A single solution has no time: viewers would show a series of one. */
  if (f->most) fprintf(out, "   <Time Value=\"%.17g\"/>\n", (double)f->t[k]);
  fprintf(out, "   <Topology TopologyType=\"%s\" NumberOfElements=\"%ld\"%s>\n",
          f->mesh->mixed ? "Mixed" : topology[type], (long)n_cells, type == HYCO_LINE2 ? " NodesPerElement=\"2\"" : "");
  snprintf(kind, sizeof(kind), "NumberType=\"Int\" Precision=\"%d\"", (int)sizeof(PetscInt));
  if (f->mesh->mixed)
    WriteItem(out, kind, f->n_items, 0, h5, "mesh/topology");
  else
    WriteItem(out, kind, n_cells, f->mesh->nv, h5, "mesh/cells");
  fprintf(out, "   </Topology>\n   <Geometry GeometryType=\"XYZ\">\n");
  /* In a file of points each mesh has coordinates of its own, since maps move the nodes with the parameters. */
  HycoFormat(name, f->points ? "step-%04d/xyz" : "mesh/xyz", (int)k);
  WriteItem(out, "Precision=\"8\"", HycoFieldFileCount(f, HYCO_ON_NODES), 3, h5, name);
  fprintf(out, "   </Geometry>\n");
  for (PetscInt j = 0; j < f->n_fields; j++) {
    const HycoField *field = &f->field[j];

    fprintf(out, "   <Attribute Name=\"%s\" AttributeType=\"%s\" Center=\"%s\">\n", field->name,
            field->components == 1   ? "Scalar"
            : field->components == 3 ? "Vector"
                                     : "Tensor6",
            field->place == HYCO_ON_CELLS ? "Cell" : "Node");
    NameSet(f, k, field, name);
    WriteItem(out, "Precision=\"8\"", HycoFieldFileCount(f, field->place), field->components, h5, name);
    fprintf(out, "   </Attribute>\n");
  }
  fprintf(out, "  </Grid>\n");
}

/* Writes the text, which is renamed after the numbers. On rank 0. */
static PetscErrorCode WriteText(HycoFieldFile f, HycoFile *out)
{
  const char *slash = strrchr(f->h5_path, '/');
  char h5[6 * PETSC_MAX_PATH_LEN];
  FILE *text;

  PetscFunctionBegin;
  FieldFileEscape(slash ? slash + 1 : f->h5_path, h5);
  PetscCall(HycoFileCreate(f->path, HYCO_FILE_TEXT, out));
  text = HycoFileStream(*out);
  fprintf(text, "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\">\n <Domain>\n");
  if (f->most) fprintf(text, "  <Grid Name=\"history\" GridType=\"Collection\" CollectionType=\"Temporal\">\n");
  /* One grid if no times were declared. */
  for (PetscInt k = 0; k < PetscMax(f->n, !f->most); k++) WriteGrid(f, text, h5, k);
  fprintf(text, "%s </Domain>\n</Xdmf>\n", f->most ? "  </Grid>\n" : "");
  PetscCall(HycoFileFlush(*out));
  if (f->most) PetscCall(HycoH5WriteReal(f->h, "t", f->n, 1, f->t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------------------------------ end */

/* A function, since HycoOnRoot() returns from the one that calls it. */
static PetscErrorCode EndText(HycoFieldFile f, HycoFile *out)
{
  PetscFunctionBegin;
  HycoOnRoot(f->comm, HycoFileClose(out, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes the parameters: a number each, for points one for each point. On one process. */
static PetscErrorCode WriteParameters(HycoFieldFile f)
{
  const PetscInt n_par = f->scene->n_parameters, rows = f->points ? f->n : 1;
  PetscReal *column;
  PetscErrorCode ierr = 0;
  char name[HYCO_LINE];

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(rows, &column));
  for (PetscInt p = 0; p < n_par && !ierr; p++) {
    for (PetscInt k = 0; k < rows; k++) column[k] = f->mu[k * n_par + p];
    HycoFormat(name, "%s/%s", f->vtk ? "VTKHDF/FieldData" : "mu", f->scene->parameter[p]);
    /* VTK's field data are one-dimensional, while .h5 files of .xdmf have columns. */
    ierr = HycoH5WriteReal(f->h, name, rows, f->vtk ? HYCO_H5_LINE : 1, column);
  }
  PetscCall(PetscFree(column));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Renames the files, the numbers first: otherwise the .xdmf could refer to no numbers, or to those of another run. */
static PetscErrorCode FieldFileRename(HycoFieldFile f, HycoFile *out)
{
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  HycoOnRoot(f->comm, WriteParameters(f));
  if (f->vtk)
    PetscCall(HycoVTKWriteTimes(f));
  else
    HycoOnRoot(f->comm, WriteText(f, out));
  PetscCall(HycoH5Close(&f->h, PETSC_TRUE));
  if (!f->vtk) ierr = EndText(f, out);
  /* Numbers without their .xdmf cannot be opened by a viewer. */
  if (ierr) (void)remove(f->h5_path);
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* `out` is closed on every path: an error in between leaves no temporary file. */
PetscErrorCode HycoFieldFileCommit(HycoFieldFile f)
{
  HycoFile out = NULL;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCheck(f->h, PETSC_COMM_SELF, PETSC_ERR_ORDER, "nothing was added to %s; add a solution first", f->path);
  ierr = FieldFileRename(f, &out);
  if (out) PetscCall(HycoFileClose(&out, PETSC_FALSE));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A file that was not committed is removed: only Commit closes it as complete. NULL-safe. */
PetscErrorCode HycoFieldFileDestroy(HycoFieldFile *file)
{
  HycoFieldFile f = *file;

  PetscFunctionBegin;
  if (!f) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoH5Close(&f->h, PETSC_FALSE));
  HycoFreeAll(&f->t, &f->mu, file);
  PetscFunctionReturn(PETSC_SUCCESS);
}
