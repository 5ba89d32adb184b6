/*
  VTKHDF 2.0, an unstructured grid: VTK's HDF5 layout (docs.vtk.org, VTKHDF file format). Fields of several times are
  concatenated in one dataset; the mesh, which all share, is stored once.
*/
#include <hycofields.h>

#define ROOT "VTKHDF/"

/* VTK's numbers of the cell types. */
static const unsigned char vtk_type[HYCO_N_CELL_TYPES] = {3, 5, 9, 10, 12, 22, 23, 28, 24, 25, 29, 14, 13};

/* Writes a one-dimensional dataset of n integers, value, value + step, ... On one process. */
static PetscErrorCode WriteSequence(HycoH5 h, const char name[], PetscInt n, PetscInt value, PetscInt step)
{
  PetscInt *all;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &all));
  for (PetscInt k = 0; k < n; k++) all[k] = value + k * step;
  HycoFinally(HycoH5WriteInt(h, name, n, HYCO_H5_LINE, all), PetscCall(PetscFree(all)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On one process. One piece: the numbers of points, cells and ids are lists of length 1. */
static PetscErrorCode WriteHead(HycoFieldFile f, const HycoCellList *cells)
{
  /* Version 2.0 of the format is the first with steps. */
  static const PetscInt version[2] = {2, 0};
  const PetscInt n_cells = HycoFieldFileCount(f, HYCO_ON_CELLS);

  PetscFunctionBegin;
  PetscCall(WriteSequence(f->h, ROOT "NumberOfPoints", 1, HycoFieldFileCount(f, HYCO_ON_NODES), 0));
  PetscCall(WriteSequence(f->h, ROOT "NumberOfCells", 1, n_cells, 0));
  PetscCall(WriteSequence(f->h, ROOT "NumberOfConnectivityIds", 1, cells->all, 0));
  PetscCall(HycoH5WriteAttributeInt(f->h, "VTKHDF", "Version", 2, version));
  PetscCall(HycoH5WriteAttribute(f->h, "VTKHDF", "Type", "UnstructuredGrid"));
  PetscCall(HycoH5WriteAttribute(f->h, "VTKHDF", "title", f->scene->title));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes rows of nodes or cells at the current time, in a dataset that concatenates those of all times. Row f->n of
   times: `first` counts from the beginning of the dataset. Its size is fixed by the times declared at creation. */
static PetscErrorCode WriteRows(HycoFieldFile f, const char set[], HycoPlace place, PetscInt cols,
                                const PetscReal rows[])
{
  const PetscInt all = HycoFieldFileCount(f, place), own = f->order ? f->order->n[place] : all,
                 first = f->order ? f->order->first[place] : 0, times = PetscMax(f->most, 1);

  PetscFunctionBegin;
  /* The product is formed in 64 bits, since the indices may have 32. */
  HycoCheck((PetscInt64)all * times < PETSC_MAX_INT,
            "%s: %d times of %d nodes or cells are too many for one dataset; give an output that ends in .xdmf",
            f->path, (int)times, (int)all);
  PetscCall(HycoH5WriteRows(f->h, set, MPIU_REAL, all * times, cols, all * f->n + first, own, rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes the cells' types, and the offset of each cell's nodes: one more than cells, written by the process of the
   last. */
static PetscErrorCode WriteTypes(HycoFieldFile f, const HycoCellList *cells)
{
  const HycoFileOrder *order = f->order;
  const PetscInt all = HycoFieldFileCount(f, HYCO_ON_CELLS), first = order ? order->first[HYCO_ON_CELLS] : 0,
                 own = order ? order->n[HYCO_ON_CELLS] : all, begins = own + (first + own == all);
  PetscInt *start;
  unsigned char *type;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(begins, &start, own, &type));
  for (PetscInt k = 0; k < begins; k++) start[k] = cells->first + cells->start[k];
  for (PetscInt k = 0; k < own; k++) type[k] = vtk_type[cells->shape[k]];
  ierr = HycoH5WriteRows(f->h, ROOT "Offsets", MPIU_INT, all + 1, HYCO_H5_LINE, first, begins, start);
  if (!ierr) ierr = HycoH5WriteRows(f->h, ROOT "Types", MPI_UNSIGNED_CHAR, all, HYCO_H5_LINE, first, own, type);
  PetscCall(PetscFree2(start, type));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0 creates the groups before the collective writes that need them. HycoOnRoot() ends all ranks with the same
   error. */
static PetscErrorCode WriteCells(HycoFieldFile f, const HycoCellList *cells)
{
  PetscFunctionBegin;
  HycoOnRoot(f->comm, WriteHead(f, cells));
  PetscCall(HycoCellListWrite(f->h, ROOT "Connectivity", cells));
  PetscCall(WriteTypes(f, cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points that move are written by HycoVTKWritePoints() for each time. */
PetscErrorCode HycoVTKWriteMesh(HycoFieldFile f, const PetscReal X[])
{
  HycoMesh m = f->mesh;
  HycoCellList cells;

  PetscFunctionBegin;
  PetscCall(HycoCellListCreate(f->order, m, NULL, &cells));
  HycoFinally(WriteCells(f, &cells), PetscCall(HycoCellListDestroy(&cells)));
  /* Ids and cells are common to all times, and their offsets stay 0 in Steps. */
  if (!f->points)
    PetscCall(HycoFieldWrite(f->h, f->order, m->n_nodes, ROOT "Points", HYCO_ON_NODES, MPIU_REAL, 3, 3, X));
  PetscCall(HycoFieldWrite(f->h, f->order, m->n_nodes, ROOT "PointData/node_id", HYCO_ON_NODES, MPIU_INT, 1,
                           HYCO_H5_LINE, m->node_id));
  PetscCall(HycoFieldWrite(f->h, f->order, m->n_cells, ROOT "CellData/cell_id", HYCO_ON_CELLS, MPIU_INT, 1,
                           HYCO_H5_LINE, m->cell_id));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* VTK has three coordinates also in 1D and 2D. A path has one set of points; a set of parameter values moves them
   at each step. */
PetscErrorCode HycoVTKWritePoints(HycoFieldFile f, const PetscReal X[])
{
  void *rows;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoFieldRows(f->order, f->mesh->n_nodes, HYCO_ON_NODES, MPIU_REAL, 3, X, &rows));
  ierr = WriteRows(f, ROOT "Points", HYCO_ON_NODES, 3, (const PetscReal *)rows);
  if (f->order) PetscCall(PetscFree(rows));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* VTK's order of a symmetric tensor is xx, yy, zz, xy, yz, xz. */
static void VtkhdfPermute(PetscInt n, const PetscReal tensor[], PetscReal out[])
{
  static const PetscInt from[6] = {0, 3, 5, 1, 4, 2};

  for (PetscInt k = 0; k < n; k++) {
    for (PetscInt c = 0; c < 6; c++) out[6 * k + c] = tensor[6 * k + from[c]];
  }
}

/* set: the dataset's name, for its attributes. */
PetscErrorCode HycoVTKWriteField(HycoFieldFile f, const HycoField *field, const PetscReal rows[], char set[HYCO_LINE])
{
  const PetscInt n = f->order ? f->order->n[field->place] : HycoFieldFileCount(f, field->place);
  PetscReal *tensor = NULL;

  PetscFunctionBegin;
  HycoFormat(set, ROOT "%s/%s", field->place == HYCO_ON_CELLS ? "CellData" : "PointData", field->name);
  /* VTK orders a symmetric tensor xx yy zz xy yz xz, XDMF row by row. */
  if (field->components == 6) {
    PetscCall(PetscMalloc1(6 * n, &tensor));
    VtkhdfPermute(n, rows, tensor);
    rows = tensor;
  }
  HycoFinally(WriteRows(f, set, field->place, field->components == 1 ? HYCO_H5_LINE : field->components, rows),
              PetscCall(PetscFree(tensor)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes the offset of each time's mesh and fields: 0 for constant ones, its own for a point's nodes and parameters.
   On one process. */
static PetscErrorCode WriteSteps(HycoFieldFile f)
{
  static const char *const zeros[] = {"PartOffsets", "CellOffsets", "ConnectivityIdOffsets", "PointDataOffsets/node_id",
                                      "CellDataOffsets/cell_id"};
  char name[HYCO_LINE];

  PetscFunctionBegin;
  PetscCall(HycoH5WriteReal(f->h, ROOT "Steps/Values", f->n, HYCO_H5_LINE, f->t));
  PetscCall(HycoH5WriteAttributeInt(f->h, ROOT "Steps", "NSteps", 1, &f->n));
  /* One part at each time, of the same cells. */
  PetscCall(WriteSequence(f->h, ROOT "Steps/NumberOfParts", f->n, 1, 0));
  for (size_t k = 0; k < sizeof(zeros) / sizeof(zeros[0]); k++) {
    HycoFormat(name, ROOT "Steps/%s", zeros[k]);
    PetscCall(WriteSequence(f->h, name, f->n, 0, 0));
  }
  PetscCall(
      WriteSequence(f->h, ROOT "Steps/PointOffsets", f->n, 0, f->points ? HycoFieldFileCount(f, HYCO_ON_NODES) : 0));
  for (PetscInt p = 0; p < f->scene->n_parameters; p++) {
    HycoFormat(name, ROOT "Steps/FieldDataOffsets/%s", f->scene->parameter[p]);
    /* Each row of a point's parameters; a path has one row for all its times. */
    PetscCall(WriteSequence(f->h, name, f->n, 0, f->points));
  }
  for (PetscInt k = 0; k < f->n_fields; k++) {
    const HycoField *field = &f->field[k];

    HycoFormat(name, ROOT "Steps/%s/%s", field->place == HYCO_ON_CELLS ? "CellDataOffsets" : "PointDataOffsets",
               field->name);
    PetscCall(WriteSequence(f->h, name, f->n, 0, HycoFieldFileCount(f, field->place)));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A file of one solution has no group Steps. */
PetscErrorCode HycoVTKWriteTimes(HycoFieldFile f)
{
  PetscFunctionBegin;
  if (f->most) HycoOnRoot(f->comm, WriteSteps(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}
