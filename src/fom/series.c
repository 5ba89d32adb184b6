/* The fields of a path at its listed times: each is added to one file, and written to a separate file beside a
   checkpoint. */
#include <hycofile.h>
#include <hycofields.h>
#include <hycoh5.h>
#include <hycopath.h>
#include <hycomaterialimpl.h>
#include <string.h>
#include <unistd.h>

struct _n_HycoSeries {
  HycoSeriesSource from; /* of the last time */
  HycoFieldFile file;
  HycoH5 part; /* file of this time beside the checkpoint; NULL: none */
};

/* Writes a field of this time. One write to the series, a second one to the separate file, from which a resumed run
   restores the series. */
static PetscErrorCode AddField(HycoSeries s, const char name[], HycoPlace place, PetscInt components,
                               const PetscReal value[])
{
  const HycoField field = {name, place, components, value};
  char set[HYCO_LINE];

  PetscFunctionBegin;
  PetscCall(HycoFieldFileAdd(s->file, &field));
  HycoFieldName(&field, s->file->n, set);
  if (s->part) PetscCall(HycoFieldWriteData(s->part, s->from.rows, HycoFieldFileCount(s->file, place), set, &field));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* VTK's vectors have three components in every dimension. u is complete at all nodes of the part, ghosts included. */
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

/* Adds stress, von Mises stress, inelastic strain, temperature, and the laws' own variables. */
static PetscErrorCode AddState(HycoSeries s)
{
  const HycoSeriesSource *f = &s->from;
  const PetscInt n = f->fe->mesh->n_cells, ns = f->fe->n_sigma;
  HycoFEState state = f->state;
  PetscReal *sigma, *tensor, *mises, *inelastic, *temperature, *nodal, *nodal_mises;
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
  PetscCall(PetscCalloc2(6 * f->fe->mesh->n_nodes, &nodal, f->fe->mesh->n_nodes, &nodal_mises));
  PetscCall(HycoNodalStress(f->fe, sigma, nodal, nodal_mises));
  PetscCall(AddField(s, "nodal_stress", HYCO_ON_NODES, 6, nodal));
  PetscCall(AddField(s, "nodal_mises", HYCO_ON_NODES, 1, nodal_mises));
  PetscCall(PetscFree2(nodal, nodal_mises));
  PetscCall(HycoFEStateGetNames(state, &n_names, &names));
  /* Laws' own variables by name; cells of other laws have NaN. */
  for (PetscInt k = 0; k < n_names; k++) {
    PetscCall(HycoFEStateVariable(f->fe, state, names[k], mises));
    PetscCall(AddField(s, names[k], HYCO_ON_CELLS, 1, mises));
  }
  PetscCall(PetscFree5(sigma, tensor, mises, inelastic, temperature));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds contact force, pressure, gap and the contact by node; with friction the tangential traction, the slip and the
   state. */
static PetscErrorCode AddContacts(HycoSeries s)
{
  const HycoSeriesSource *f = &s->from;
  HycoContactFields c;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  if (!f->n_contacts) PetscFunctionReturn(PETSC_SUCCESS);
  ierr = HycoContactFieldsCreate(f->comm, f->fe_surface, f->pairs, f->u_surface, f->lambda, &c);
  /* Contacts live on surfaces, fields on the parts' nodes. */
  if (!ierr) ierr = HycoContactFieldsToPart(f->comm, f->fe, f->fe_surface->mesh, &c);
  if (!ierr) ierr = AddField(s, "contact_force", HYCO_ON_NODES, 3, c.force);
  if (!ierr) ierr = AddField(s, "contact_pressure", HYCO_ON_NODES, 1, c.pressure);
  if (!ierr) ierr = AddField(s, "gap", HYCO_ON_NODES, 1, c.gap_node);
  if (!ierr) ierr = AddField(s, "contact", HYCO_ON_NODES, 1, c.which);
  if (!ierr && c.has_friction) ierr = AddField(s, "contact_traction", HYCO_ON_NODES, 3, c.traction);
  if (!ierr && c.has_friction) ierr = AddField(s, "contact_slip", HYCO_ON_NODES, 3, c.slip);
  if (!ierr && c.has_friction) ierr = AddField(s, "contact_state", HYCO_ON_NODES, 1, c.state);
  PetscCall(HycoContactFieldsDestroy(&c));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The file at `path` is written completely or not at all, at HycoSeriesClose(); most: number of times. Collective. A
   series that ends early is closed all the same, with the times that it has. */
PetscErrorCode HycoSeriesCreate(MPI_Comm comm, const char path[], PetscInt most, HycoSeries *series)
{
  HycoFieldFile file;
  HycoSeries s;

  PetscFunctionBegin;
  PetscCall(HycoFieldFileCreate(comm, path, most, PETSC_FALSE, &file));
  PetscCall(PetscNew(&s));
  s->file = file;
  *series = s;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For the next solve; replaces a former series. Collective. */
PetscErrorCode HycoFOMSetSeries(HycoFOM f, const char path[])
{
  HycoSeries s;

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  HycoCheck(f->path, "HycoFOMSetSeries: the scene has no history; HycoFOMWrite() writes its solution");
  PetscCall(HycoSeriesCreate(HycoComm(f), path, f->scene->n_times, &s));
  PetscCall(HycoSeriesDestroy(&f->path->series));
  f->path->series = s;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The data of full order at its last time. Borrowed pointers, read again at each time, since the masters' search may
   replace the surfaces. */
static PetscErrorCode SeriesFields(HycoFOM f, HycoSeriesSource *from)
{
  HycoPath p = f->path;

  PetscFunctionBegin;
  /* begin: the state at p->t, since an accepted step has become the begin of the next. */
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

/* Writes mesh and parameters; fields follow by HycoSeriesAddTime(). Collective. */
PetscErrorCode HycoSeriesOpen(HycoSeries s, const HycoSeriesSource *from)
{
  PetscFunctionBegin;
  s->from = *from;
  PetscCall(HycoFieldFileOpen(s->file, from->rows, from->fe->mesh, from->fe->scene, from->fe->X, from->mu));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At the path's first time: the mesh is that of the moved nodes there. Collective. Without a series nothing is written,
   and all its functions return at once. */
PetscErrorCode HycoSeriesBegin(HycoFOM f)
{
  HycoSeriesSource from;

  PetscFunctionBegin;
  if (!f->path->series) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SeriesFields(f, &from));
  PetscCall(HycoSeriesOpen(f->path->series, &from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The name of one time's separate file, beside the checkpoint. */
static void NamePart(HycoFOM f, PetscInt k, char path[PETSC_MAX_PATH_LEN])
{
  snprintf(path, PETSC_MAX_PATH_LEN, "%.*s.step-%04d.h5", PETSC_MAX_PATH_LEN - 32, f->path->checkpoint, (int)k);
}

/* Writes the list of fields. */
static PetscErrorCode WriteList(HycoSeries s)
{
  char list[HYCO_LINE] = "";

  PetscFunctionBegin;
  for (PetscInt j = 0; j < s->file->n_fields; j++) PetscCall(HycoListAdd(list, " ", s->file->field[j].name));
  PetscCall(HycoH5WriteText(s->part, "fields", list));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads this rank's rows of one field of an earlier time from its file. */
static PetscErrorCode ReadField(HycoFOM f, HycoH5 h, const HycoFileOrder *order, const char set[],
                                const HycoField *field, PetscReal **rows)
{
  const PetscInt all = HycoFieldFileCount(f->path->series->file, field->place),
                 n = order ? order->n[field->place] : all;
  PetscInt n_rows, cols;

  PetscFunctionBegin;
  PetscCall(HycoH5GetSize(h, set, &n_rows, &cols));
  /* A file of another mesh, beside a checkpoint of this one. */
  HycoCheck(n_rows == all, "its field %s has %d rows", field->name, (int)n_rows);
  PetscCall(PetscMalloc1(n * cols, rows));
  PetscCall(HycoH5ReadRows(h, set, order ? order->first[field->place] : 0, n, cols, *rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fields of nodes and of cells have separate names in the file; the place is found by trial. The components are the
   number of the dataset's columns. */
static PetscErrorCode CopyField(HycoFOM f, HycoSeries s, HycoH5 h, const char name[], PetscInt k)
{
  HycoField field = {name, HYCO_ON_NODES, 0, NULL};
  const HycoFileOrder *order;
  PetscReal *rows = NULL;
  PetscInt n_rows;
  char set[HYCO_LINE];

  PetscFunctionBegin;
  PetscCall(HycoFOMGetRows(f, &order));
  /* The name contains the place. */
  HycoFieldName(&field, k, set);
  if (!HycoH5Has(h, set)) field.place = HYCO_ON_CELLS;
  HycoFieldName(&field, k, set);
  HycoOnEach(HycoComm(f), ReadField(f, h, order, set, &field, &rows));
  PetscCall(HycoH5GetSize(h, set, &n_rows, &field.components));
  HycoFinally(HycoFieldFileAddRows(s->file, &field, rows), PetscCall(PetscFree(rows)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies the fields that a file lists into the series. */
static PetscErrorCode CopyFields(HycoFOM f, HycoSeries s, HycoH5 h, PetscInt k)
{
  char *list = NULL, *word, *rest;
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  HycoOnEach(HycoComm(f), HycoH5LoadText(h, "fields", &list));
  /* The list was written with the fields: laws may have changed since, the file has not. */
  for (word = strtok_r(list, " ", &rest); word && !ierr; word = strtok_r(NULL, " ", &rest))
    ierr = CopyField(f, s, h, word, k);
  PetscCall(PetscFree(list));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A resumed run appends to the fields of the run before; if that wrote none, the series would begin in the middle. */
static PetscErrorCode OpenPart(HycoFOM f, PetscInt k, HycoH5 *h)
{
  char path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  NamePart(f, k, path);
  HycoCheck(access(path, R_OK) == 0,
            "the file %s is missing, with the fields of a time before the checkpoint (the first run had no -output); "
            "start again without -hyco_resume, or resume without -output",
            path);
  PetscCall(HycoH5Open(path, h));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Restores the times before the checkpoint from their separate files. Collective. */
PetscErrorCode HycoSeriesRestore(HycoFOM f)
{
  HycoSeries s = f->path->series;

  PetscFunctionBegin;
  for (PetscInt k = 0; s && k < f->path->n_steps; k++) {
    HycoH5 h = NULL;

    /* Times of the checkpoint's steps, in order: the series continues where the first run's did. */
    PetscCall(HycoFieldFileBeginTime(s->file, f->path->steps[k].t));
    HycoOnEach(HycoComm(f), OpenPart(f, k, &h));
    HycoFinally(CopyFields(f, s, h, k), PetscCall(HycoH5Close(&h, PETSC_FALSE)));
    PetscCall(HycoFieldFileEndTime(s->file));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A time of a path of any model: full order or reduced. Collective. */
PetscErrorCode HycoSeriesAddTime(HycoSeries s, const HycoSeriesSource *from)
{
  PetscFunctionBegin;
  s->from = *from;
  PetscCall(HycoFieldFileBeginTime(s->file, from->t));
  /* The list of fields last: it makes the separate file complete. */
  PetscCall(AddDisplacement(s));
  PetscCall(AddState(s));
  PetscCall(AddContacts(s));
  if (s->part) HycoOnRoot(s->from.comm, WriteList(s));
  PetscCall(HycoFieldFileEndTime(s->file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The separate file is complete before the checkpoint that refers to it is written. Collective. */
PetscErrorCode HycoSeriesAdd(HycoFOM f)
{
  HycoSeries s = f->path->series;
  HycoSeriesSource from;
  char path[PETSC_MAX_PATH_LEN];
  PetscErrorCode ierr, failed;

  PetscFunctionBegin;
  if (!s) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SeriesFields(f, &from));
  if (f->path->checkpoint[0]) {
    /* By the number of times so far: a resumed run continues the numbers. */
    NamePart(f, s->file->n, path);
    PetscCall(HycoH5CreateShared(HycoComm(f), path, &s->part));
  }
  ierr = HycoSeriesAddTime(s, &from);
  failed = HycoH5Close(&s->part, (PetscBool)!ierr);
  PetscCall(ierr ? ierr : failed);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A path without any listed time leaves no file. */
PetscErrorCode HycoSeriesClose(HycoSeries s)
{
  PetscFunctionBegin;
  if (s->file->n) PetscCall(HycoFieldFileCommit(s->file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective. The file appears under its name only here. */
PetscErrorCode HycoSeriesEnd(HycoFOM f)
{
  PetscFunctionBegin;
  if (f->path->series) PetscCall(HycoSeriesClose(f->path->series));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* NULL-safe. A series that was not closed leaves no file. */
PetscErrorCode HycoSeriesDestroy(HycoSeries *series)
{
  HycoSeries s = *series;

  PetscFunctionBegin;
  if (!s) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoFieldFileDestroy(&s->file));
  PetscCall(PetscFree(*series));
  PetscFunctionReturn(PETSC_SUCCESS);
}
