/* The file's order: rows by ascending tag, in contiguous blocks over the processes, or all on rank 0. */
#include <hycomesh.h>

/* The star forest from rows of the file (roots) to this process's owned nodes or cells (leaves). Roots are in
   blocks of equal size, or all on rank 0 if `root`. */
static PetscErrorCode CreateSF(HycoFileOrder *o, HycoPlace place, PetscInt n, const PetscInt leaf[],
                               const PetscInt row[], PetscBool root)
{
  PetscLayout layout;

  PetscFunctionBegin;
  /* PETSC_DECIDE balances the rows; with `root` rank 0 has all and the other blocks are empty, as for formats that
     one process writes. */
  PetscCall(PetscLayoutCreateFromSizes(o->comm,
                                       !root                    ? PETSC_DECIDE
                                       : HycoRank(o->comm) == 0 ? o->all[place]
                                                                : 0,
                                       o->all[place], 1, &layout));
  PetscCall(PetscLayoutGetRange(layout, &o->first[place], &o->n[place]));
  o->n[place] -= o->first[place];
  PetscCall(PetscSFCreate(o->comm, &o->sf[place]));
  PetscCall(PetscSFSetGraphLayout(o->sf[place], layout, n, (PetscInt *)leaf, PETSC_COPY_VALUES, row));
  PetscCall(PetscLayoutDestroy(&layout));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows of nodes and of cells by ascending tag. Each row has one leaf: a node at its owner, a cell at the owner of its
   first node, so that overlapping parts send nothing twice. Collective. Files are then the same byte by byte, whatever
   the number of ranks. */
PetscErrorCode HycoFileOrderCreate(MPI_Comm comm, HycoMesh m, PetscBool root, HycoFileOrder **order)
{
  PetscInt *leaf, *row;
  HycoFileOrder *o;

  PetscFunctionBegin;
  PetscCall(PetscNew(&o));
  o->comm = comm;
  o->all[HYCO_ON_NODES] = m->n_whole_nodes;
  o->all[HYCO_ON_CELLS] = m->n_whole_cells;
  PetscCall(PetscMalloc2(PetscMax(m->n_nodes, m->n_cells), &leaf, PetscMax(m->n_nodes, m->n_cells), &row));
  for (PetscInt on_cells = 0; on_cells < 2; on_cells++) {
    /* Row: the place of the tag among all tags (HycoRankInts()), the same on any number of ranks. */
    const PetscInt *whole = on_cells ? m->cell_whole : m->node_whole;
    PetscInt n = 0;

    for (PetscInt k = 0; k < (on_cells ? m->n_cells : m->n_nodes); k++) {
      if (HycoMeshOwned(m, on_cells ? m->cells[k * m->nv] : k) < 0) continue;
      leaf[n] = k;
      row[n++] = whole[k];
    }
    PetscCall(CreateSF(o, on_cells ? HYCO_ON_CELLS : HYCO_ON_NODES, n, leaf, row, root));
  }
  PetscCall(PetscFree2(leaf, row));
  *order = o;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* NULL-safe; the communicator is borrowed and stays. */
PetscErrorCode HycoFileOrderDestroy(HycoFileOrder **order)
{
  PetscFunctionBegin;
  if (!*order) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < HYCO_N_PLACES; k++) PetscCall(PetscSFDestroy(&(*order)->sf[k]));
  PetscCall(PetscFree(*order));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* `width` values as one MPI type: a star forest then moves whole rows in one message. */
static PetscErrorCode CreateUnit(MPI_Datatype type, PetscInt width, MPI_Datatype *unit)
{
  PetscMPIInt count;

  PetscFunctionBegin;
  PetscCall(PetscMPIIntCast(width, &count));
  PetscCallMPI(MPI_Type_contiguous(count, type, unit));
  PetscCallMPI(MPI_Type_commit(unit));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PetscSFBcastBegin() and -End() for rows of `width` values. Collective. */
PetscErrorCode HycoSFBcast(PetscSF sf, MPI_Datatype type, PetscInt width, const void *root, void *leaf)
{
  MPI_Datatype unit;

  PetscFunctionBegin;
  PetscCall(CreateUnit(type, width, &unit));
  PetscCall(PetscSFBcastBegin(sf, unit, root, leaf, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(sf, unit, root, leaf, MPI_REPLACE));
  PetscCallMPI(MPI_Type_free(&unit));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The reverse: leaf to root, for star forests with one leaf per root, hence MPI_REPLACE. Collective. With several
   leaves at one root the last would win, which MPI does not define. */
PetscErrorCode HycoSFSend(PetscSF sf, MPI_Datatype type, PetscInt width, const void *leaf, void *root)
{
  MPI_Datatype unit;

  PetscFunctionBegin;
  PetscCall(CreateUnit(type, width, &unit));
  PetscCall(PetscSFReduceBegin(sf, unit, leaf, root, MPI_REPLACE));
  PetscCall(PetscSFReduceEnd(sf, unit, leaf, root, MPI_REPLACE));
  PetscCallMPI(MPI_Type_free(&unit));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Roots without a leaf do not occur: every node and every cell of the mesh has an owner. */
PetscErrorCode HycoFileOrderSend(const HycoFileOrder *o, HycoPlace place, MPI_Datatype type, PetscInt components,
                                 const void *value, void *rows)
{
  PetscFunctionBegin;
  PetscCall(HycoSFSend(o->sf[place], type, components, value, rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows of the file to all nodes or cells of a part, those of other owners included: another star forest than that
   of Create, in which ghosts have no leaf. Made at each call, because fields are read seldom. Collective. */
PetscErrorCode HycoFileOrderFetch(const HycoFileOrder *o, HycoMesh m, HycoPlace place, PetscInt components,
                                  const PetscReal rows[], PetscReal value[])
{
  const PetscBool on_cells = (PetscBool)(place == HYCO_ON_CELLS);
  PetscLayout layout;
  PetscSF sf;

  PetscFunctionBegin;
  PetscCall(PetscLayoutCreateFromSizes(o->comm, o->n[place], o->all[place], 1, &layout));
  PetscCall(PetscSFCreate(o->comm, &sf));
  /* ilocal NULL: leaves are contiguous, entry k of value[]. */
  PetscCall(PetscSFSetGraphLayout(sf, layout, on_cells ? m->n_cells : m->n_nodes, NULL, PETSC_OWN_POINTER,
                                  on_cells ? m->cell_whole : m->node_whole));
  PetscCall(HycoSFBcast(sf, MPIU_REAL, components, rows, value));
  PetscCall(PetscSFDestroy(&sf));
  PetscCall(PetscLayoutDestroy(&layout));
  PetscFunctionReturn(PETSC_SUCCESS);
}
