/* HycoFOM: reads and distributes the mesh, assembles (16), solves it, and gathers the solution in the file's order. */
#include <hycofields.h>
#include <hycogradient.h>
#include <hycopath.h>

/* NULL-safe; the last reference frees. What is aliased
   on one rank (surface, fe_surface, u_surface) is freed once. */
PetscErrorCode HycoFOMDestroy(HycoFOM *fom)
{
  HycoFOM f;

  PetscFunctionBegin;
  HycoDestroyBegin(fom, HYCO_FOM_CLASSID);
  f = *fom;
  PetscCall(HycoFOMForgetSoft(f));
  PetscCall(HycoPathFree(&f->path));
  HycoDestroyAll(&f->solver, &f->system, &f->given_solver, &f->given_system, &f->given_F, &f->K, &f->B, &f->Bt, &f->U,
                 &f->Lambda, &f->F, &f->D, &f->to_local, &f->to_surface, &f->U_local, &f->U_surface);
  if (f->fe_surface != f->fe) PetscCall(HycoFEDestroy(&f->fe_surface));
  PetscCall(HycoFEDestroy(&f->fe));
  if (f->surface != f->part) PetscCall(HycoMeshDestroy(&f->surface));
  PetscCall(HycoMeshDestroy(&f->part));
  PetscCall(HycoFileOrderDestroy(&f->rows));
  PetscCall(DMDestroy(&f->dm));
  PetscCall(HycoPairsDestroy(&f->pairs));
  for (PetscInt k = 0; k < f->n_released; k++) PetscCall(VecDestroy(&f->released[k]));
  PetscCall(PetscFree(f->released));
  if (f->u_surface != f->u) PetscCall(PetscFree(f->u_surface));
  HycoFreeAll(&f->u, &f->u_all, &f->sigma_all);
  PetscCall(HycoFieldFileDestroy(&f->set));
  HycoFreeAll(&f->contact_result, &f->reaction);
  PetscCall(HycoGradientDestroy(&f->gradient));
  HycoFreeAll(&f->lambda, &f->lambda_all, &f->needed, &f->sigma, &f->gap);
  PetscCall(HycoSceneDestroy(&f->scene));
  PetscCall(PetscHeaderDestroy(fom));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Partitions the DM so that few contacts are cut; contacts' pairs become heavy edges of the graph. */
static PetscErrorCode FOMDistribute(HycoFOM f)
{
  const HycoPartitioner cut = (HycoPartitioner)f->partition;
  PetscInt n = 0, *pairs = NULL;
  HycoMesh mesh;
  PetscBool done;

  PetscFunctionBegin;
  PetscCall(DMPlexIsDistributed(f->dm, &done));
  if (f->size == 1 || done) {
    PetscCall(HycoMeshDistribute(&f->dm, f->scene, NULL, 0, NULL, cut, f->mesh_write));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoPlexToMesh(f->dm, f->scene, &mesh));
  /* the file's first bad cell is named; refined cells are checked later */
  if (!f->scene->refine) HycoOnEach(HycoComm(f), HycoMeshCheckCells(mesh));
  if (mesh->n_cells) PetscCall(HycoContactsNeighbours(f->scene, mesh, &n, &pairs));
  /* The tables outlive the DM, which FOMDistribute() replaces: the partitioner needs them. */
  PetscCall(HycoMeshDetach(mesh)); /* so that it does not live beside the distributed one */
  PetscCall(HycoMeshDistribute(&f->dm, f->scene, mesh, n, pairs, cut, f->mesh_write));
  PetscCall(PetscFree(pairs));
  PetscCall(HycoMeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the mesh, and makes its parts and its contacts. With several ranks the fe of a part comes before the search,
   which needs positions; on one rank after it, so that errors come in the same order. */
static PetscErrorCode ReadMesh(HycoFOM f)
{
  PetscFunctionBegin;
  PetscCall(HycoMeshLoad(HycoComm(f), f->scene, &f->dm));
  PetscCall(FOMDistribute(f));
  PetscCall(HycoPlexToMesh(f->dm, f->scene, &f->part));
  /* A part knows its own nodes; the mesh has its number as a fact. */
  f->n_nodes = f->size == 1 ? f->part->n_nodes : f->part->n_whole_nodes;
  f->n_cells = f->size == 1 ? f->part->n_cells : f->part->n_whole_cells;
  /* On one rank the reader has checked them, before ties. */
  if (f->size > 1) HycoOnEach(HycoComm(f), HycoMeshCheckCells(f->part));
  if (f->size > 1) HycoOnEach(HycoComm(f), HycoFECreate(f->scene, f->part->dm, &f->fe));
  f->contact_cpu -= HycoCPU();
  PetscCall(HycoFOMFindContacts(f));
  PetscCall(HycoPairsCheckQuantities(HycoComm(f), f->scene, f->surface, &f->pairs));
  f->contact_cpu += HycoCPU();
  if (f->size > 1) PetscFunctionReturn(PETSC_SUCCESS);
  HycoOnEach(HycoComm(f), HycoFECreate(f->scene, f->part->dm, &f->fe));
  f->fe_surface = f->fe;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates the scatter of U to each rank's part. */
static PetscErrorCode CreateScatter(HycoFOM f)
{
  const PetscInt dim = f->part->dim;
  IS is;

  PetscFunctionBegin;
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, f->part->n_nodes * dim, &f->U_local));
  /* By node: blocks of dim, so that indices are a third as many. */
  if (f->part->node_global)
    PetscCall(ISCreateBlock(PETSC_COMM_SELF, dim, f->part->n_nodes, f->part->node_global, PETSC_COPY_VALUES, &is));
  else
    PetscCall(ISCreateStride(PETSC_COMM_SELF, f->part->n_nodes * dim, 0, 1, &is));
  PetscCall(VecScatterCreate(f->U, is, f->U_local, NULL, &f->to_local));
  PetscCall(ISDestroy(&is));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Unknowns of B's columns by the numbers of the distributed vectors. */
static PetscInt GlobalNode(HycoFOM f, PetscInt node)
{
  return f->surface->node_global ? f->surface->node_global[node] : node;
}

/* Composes B with the slaves of its rows, which do not change. Collective. The solver's gap coordinates need a slave
   for each row. */
static PetscErrorCode TellSlaves(HycoFOM f)
{
  PetscScalar *slave;
  Vec slaves;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(f->B, NULL, &slaves));
  PetscCall(VecGetArray(slaves, &slave));
  for (PetscInt k = 0; k < f->pairs.n; k++) slave[k] = GlobalNode(f, HycoPairsSlave(&f->pairs, k)) * f->part->dim;
  PetscCall(VecRestoreArray(slaves, &slave));
  PetscCall(PetscObjectCompose((PetscObject)f->B, HYCO_SLAVES, (PetscObject)slaves));
  PetscCall(VecDestroy(&slaves));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates B and Bt with the pattern for any parameters: all components of a contact's nodes. Each rank has the rows
   of its contacts. Preallocated by the widest contact; rows are local, therefore nothing is sent at assembly. */
static PetscErrorCode CreateB(HycoFOM f)
{
  const PetscInt dim = f->part->dim, entries = f->width * dim;

  PetscFunctionBegin;
  PetscCall(MatCreate(HycoComm(f), &f->B));
  PetscCall(MatSetSizes(f->B, f->pairs.n, f->part->n_owned * dim, f->n_contacts, f->n_nodes * dim));
  PetscCall(MatSetType(f->B, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(f->B, entries, NULL));
  PetscCall(MatMPIAIJSetPreallocation(f->B, entries, NULL, entries, NULL));
  /* A row may get nodes that it had not at the first parameters. */
  PetscCall(MatSetOption(f->B, MAT_NEW_NONZERO_LOCATION_ERR, PETSC_FALSE));
  PetscCall(MatSetOption(f->B, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
  PetscCall(TellSlaves(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the options of paths; without a scene they are only declared. */
static PetscErrorCode ReadPath(HycoFOM f, HycoOptionItems PetscOptionsObject)
{
  PetscFunctionBegin;
  if (!f->path) PetscCall(HycoPathNew(HycoComm(f), f->scene, &f->path));
  PetscCall(HycoPathSetFromOptions(f->path, PetscOptionsObject));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A scene without a history refuses the options of paths: an option without effect is an error. */
static PetscErrorCode SetFromOptions(HycoFOM f)
{
  PetscFunctionBegin;
  PetscObjectOptionsBegin((PetscObject)f);
  PetscCall(HycoOptionsFor("full order"));
  PetscCall(HycoOptionsBool(
      "-hyco_regularise", "full order: rigid motions that neither supports nor contact hold are taken out, not refused",
      &f->regularise, NULL));
  PetscCall(HycoOptionsReal("-hyco_regularise_tol",
                            "with -hyco_regularise: share of the loads on such a motion that may be unbalanced", 0, 1,
                            &f->regularise_tol, NULL));
  PetscCall(HycoOptionsWord("-hyco_partition", "partitioner of the mesh; PT-Scotch is also used if METIS fails",
                            HycoPartitioners, &f->partition, NULL));
  PetscCall(HycoOptionsString(
      "-hyco_mesh_write", "<file.h5> write the mesh, with the scene's refinement, in PETSc's HDF5 format of a DMPlex",
      f->mesh_write, sizeof(f->mesh_write), NULL));
  PetscCall(HycoOptionsName("-hyco_fom_view", "print sizes, system and solver after each full-order solve"));
  /* What follows is listed under this title by `hyco help`. */
  PetscCall(HycoOptionsFor("history"));
  if (!f->scene || f->scene->n_times > 0)
    PetscCall(ReadPath(f, PetscOptionsObject));
  else
    PetscCall(HycoPathRefuseOptions(f));
  PetscCall(HycoOptionsFor(""));
  PetscOptionsEnd();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On defaults alone, without a scene; also for the declaration of options. Defaults of options; everything else is
   zero. */
static PetscErrorCode FOMCreate(MPI_Comm comm, HycoFOM *fom)
{
  PetscFunctionBegin;
  PetscCall(PetscHeaderCreate(*fom, HYCO_FOM_CLASSID, "HycoFOM", "Full-order model", "Hyco", comm, HycoFOMDestroy,
                              HycoFOMView));
  PetscCallMPI(MPI_Comm_rank(HycoComm(*fom), &(*fom)->rank));
  PetscCallMPI(MPI_Comm_size(HycoComm(*fom), &(*fom)->size));
  (*fom)->regularise_tol = 1e-2;
  (*fom)->partition = HYCO_PARTITION_METIS;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Declares the options on an object without a scene, for -help and the check of names. */
PetscErrorCode HycoFOMDeclare(PetscOptions options)
{
  HycoFOM f;

  PetscFunctionBegin;
  PetscCall(FOMCreate(PETSC_COMM_SELF, &f));
  HycoDeclare(f, options, SetFromOptions, HycoFOMDestroy);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Order: mesh, K and vectors, B, scatters, solver, path. Nothing is assembled yet. Collective. */
static PetscErrorCode SetUp(HycoFOM f)
{
  PetscFunctionBegin;
  PetscCall(HycoSceneGiveOptions(f->scene, (PetscObject)f));
  PetscCall(SetFromOptions(f));
  f->summary.seconds.setup = -HycoNow();
  HycoLogged(HYCO_EVENT_MESH, ReadMesh(f));
  PetscCall(HycoFECreateMatrix(f->fe, HycoComm(f), f->part->n_owned, f->part->first, &f->K));
  PetscCall(MatCreateVecs(f->K, &f->U, &f->F));
  if (f->n_contacts) {
    PetscCall(CreateB(f));
    PetscCall(MatCreateVecs(f->B, NULL, &f->Lambda));
    PetscCall(VecDuplicate(f->Lambda, &f->D));
  }
  PetscCall(CreateScatter(f));
  if (f->size > 1) PetscCall(HycoFOMSetUpSurface(f));
  PetscCall(HycoSystemCreate(HycoComm(f), &f->system));
  PetscCall(HycoSolverCreate(HycoComm(f), &f->solver));
  PetscCall(HycoOptionsInherit((PetscObject)f->solver, (PetscObject)f));
  PetscCall(HycoSolverSetFromOptions(f->solver));
  PetscCall(PetscMalloc1(f->fe->n_dof, &f->u));
  if (f->size == 1) f->u_surface = f->u;
  PetscCall(PetscCalloc1(f->pairs.n + 1, &f->lambda));
  PetscCall(PetscCalloc1(f->pairs.n + 1, &f->gap));
  /* Last: it borrows K, the vectors, system and solver. */
  if (f->path) PetscCall(HycoFOMPathCreate(f));
  f->summary.seconds.setup += HycoNow();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads and distributes the mesh and finds the contacts; holds a reference to the scene. Collective on comm; after an
   error *fom is NULL. A set of points uses one model: mesh, pairing and patterns stay. */
PetscErrorCode HycoFOMCreate(MPI_Comm comm, HycoScene scene, HycoFOM *fom)
{
  PetscFunctionBegin;
  HycoCheckHandle(scene, HYCO_SCENE_CLASSID);
  HycoCheckGiven(fom);
  PetscCall(FOMCreate(comm, fom));
  PetscCall(PetscObjectReference((PetscObject)scene));
  (*fom)->scene = scene;
  HycoOnError(SetUp(*fom), PetscCall(HycoFOMDestroy(fom)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Without K, solver and path: for models that need the mesh and its contacts (on rank 0) alone. Collective. */
PetscErrorCode HycoFOMCreateMesh(MPI_Comm comm, HycoScene scene, HycoFOM *fom)
{
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(FOMCreate(comm, fom));
  PetscCall(PetscObjectReference((PetscObject)scene));
  (*fom)->scene = scene;
  PetscCall(HycoSceneGiveOptions(scene, (PetscObject)*fom));
  ierr = SetFromOptions(*fom);
  /* A training would write the mesh once more at each of its parts. */
  (*fom)->mesh_write[0] = '\0'; /* only for solves */
  if (!ierr) ierr = ReadMesh(*fom);
  if (!ierr && (*fom)->size > 1) ierr = HycoFOMKeepOnRoot(*fom);
  if (!ierr && (*fom)->size > 1) ierr = HycoFOMSetUpSurface(*fom);
  if (ierr) PetscCall(HycoFOMDestroy(fom));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Borrowed: for options and reports of a calling program. */
PetscErrorCode HycoFOMGetSolver(HycoFOM f, HycoSolver *solver)
{
  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  HycoCheckGiven(solver);
  *solver = f->solver;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows and gaps of a process's contacts, and how many have no effect. The caller frees the rows, also after an
   error. */
static PetscErrorCode ComputeRows(HycoFE fe, HycoPairs *pairs, HycoRows *r, PetscInt *n_still)
{
  PetscFunctionBegin;
  PetscCall(HycoContactRows(fe, pairs, r));
  PetscCall(HycoContactCountStill(fe, pairs, r->start, n_still));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same for all contacts on rank 0, for the error of the first of them. */
static PetscErrorCode ComputeWhole(HycoFOM f, HycoMesh mesh, HycoPairs *pairs)
{
  HycoRows r = {0};
  PetscInt n_still;
  HycoFE fe;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoFECreate(f->scene, mesh->dm, &fe));
  ierr = HycoFESetParameters(fe, f->fe->mu);
  /* A whole-mesh decision: the surface alone cannot tell whether a map mirrors a body. */
  if (!ierr) ierr = PetscArraycpy(fe->mirrored, f->fe->mirrored, f->scene->n_bodies);
  if (!ierr) ierr = ComputeRows(fe, pairs, &r, &n_still);
  PetscCall(HycoRowsDestroy(&r));
  PetscCall(HycoFEDestroy(&fe));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Raises the error that the whole surfaces have, which is the same on any number of ranks. An error of one rank
   depends on the partition: it is replaced by that of the whole surfaces, if they fail as well. */
static PetscErrorCode RaiseWhole(HycoFOM f)
{
  HycoPairs pairs;
  HycoMesh mesh;
  PetscErrorCode ierr = 0;
  char message[HYCO_LINE] = "";

  PetscFunctionBegin;
  if (f->n_turned || f->size == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoFOMGatherContacts(f, &mesh, &pairs));
  /* The other ranks wait in the reductions below: the error is raised by all, later. */
  PetscCall(HycoCatchBegin());
  if (mesh) ierr = ComputeWhole(f, mesh, &pairs);
  PetscCall(HycoCatchEnd(ierr, message));
  PetscCall(HycoPairsDestroy(&pairs));
  PetscCall(HycoMeshDestroy(&mesh));
  PetscCall(HycoErrorSync(HycoComm(f), ierr, message));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes each rank's rows; an error of any is raised on all. */
static PetscErrorCode AllRows(HycoFOM f, HycoRows *r)
{
  char message[HYCO_LINE] = "";
  PetscBool failed;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  HycoCatch(ComputeRows(f->fe_surface, &f->pairs, r, &f->summary.n_still), ierr, message);
  failed = (PetscBool)(message[0] != '\0');
  HycoAllreduce(&failed, 1, HYCO_MPI_BOOL, MPI_LOR, HycoComm(f));
  /* On rank 0 with all contacts: the first error in the order of one rank, the same line on any number. */
  if (failed) PetscCall(RaiseWhole(f));
  PetscCall(HycoErrorSync(HycoComm(f), ierr, message));
  HycoAllreduce(&f->summary.n_still, 1, MPIU_INT, MPI_SUM, HycoComm(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets D and, if the parameters that it depends on have changed, B. Rows are set by INSERT_VALUES, as each contact
   has one row. */
static PetscErrorCode FOMInsert(HycoFOM f, PetscBool rows_changed, const HycoRows *r)
{
  const PetscInt dim = f->part->dim;
  PetscInt *column, first;

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(f->gap, r->gap, f->pairs.n));
  PetscCall(HycoVecWrite(f->D, f->pairs.n, f->gap));
  if (!rows_changed) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetOwnershipRange(f->B, &first, NULL));
  PetscCall(PetscMalloc1(f->width * dim, &column));
  for (PetscInt k = 0; k < f->pairs.n; k++) {
    const PetscInt row = first + k, lo = r->start[k], n = r->start[k + 1] - lo;

    for (PetscInt j = 0; j < n; j++) column[j] = GlobalNode(f, r->dof[lo + j] / dim) * dim + r->dof[lo + j] % dim;
    PetscCall(MatSetValues(f->B, 1, &row, n, column, r->value + lo, INSERT_VALUES));
  }
  PetscCall(PetscFree(column));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On moved surfaces: the masters, and the widest row of all ranks; *wider: it has grown with the masters that mortars
   meet. Collective. */
static PetscErrorCode FindMasters(HycoFOM f, PetscBool *wider)
{
  PetscInt width;

  PetscFunctionBegin;
  *wider = PETSC_FALSE;
  if (!f->searches) PetscFunctionReturn(PETSC_SUCCESS);
  width = HycoPairsWidth(&f->pairs);
  HycoAllreduce(&width, 1, MPIU_INT, MPI_MAX, HycoComm(f));
  *wider = (PetscBool)(width > f->width);
  /* Never narrower, so that the room of B does not change back and forth. */
  f->width = PetscMax(f->width, width);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Given normals that lead into the slave's body, where the scene gives any. */
static PetscErrorCode CheckNormals(HycoFOM f)
{
  PetscReal *normal, *gap;
  PetscBool any = PETSC_FALSE;

  PetscFunctionBegin;
  for (PetscInt c = 0; c < f->scene->n_contacts; c++)
    any = (PetscBool)(any || !HycoContactAverages(f->scene->contact[c]));
  if (!any || f->n_turned) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc2(3 * f->pairs.n, &normal, f->pairs.n, &gap));
  HycoOnEach(HycoComm(f), HycoContactGeometry(f->fe_surface, &f->pairs, normal, gap));
  HycoFinally(HycoContactCheckNormals(HycoComm(f), f->fe_surface, &f->pairs, normal),
              PetscCall(PetscFree2(normal, gap)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* B and B^T (explicit, since PETSc's products with a parallel transpose are slower) and D. Collective. */
static PetscErrorCode AssembleContact(HycoFOM f, PetscBool rows_changed)
{
  HycoRows r = {0};
  PetscBool wider;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(FindMasters(f, &wider));
  /* A search may have found other masters: entries of the former ones would stay in the pattern and widen every
     product. */
  if (f->n_contacts && rows_changed && (f->Bt || wider) && f->searches) { /* removes entries of former masters */
    PetscCall(MatDestroy(&f->B));
    PetscCall(CreateB(f));
  } else if (f->n_contacts && rows_changed && f->Bt)
    PetscCall(MatZeroEntries(f->B));
  ierr = AllRows(f, &r); /* without contacts there may be obstacles whose nodes are all fixed */
  if (!ierr && f->n_contacts) ierr = CheckNormals(f);
  if (!ierr && f->n_contacts) ierr = FOMInsert(f, rows_changed, &r);
  PetscCall(HycoRowsDestroy(&r));
  PetscCall(ierr);
  if (!f->n_contacts || !rows_changed) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoMatAssemble(f->B));
  PetscCall(MatDestroy(&f->Bt)); /* a rotated normal may have added an entry to B */
  PetscCall(MatTranspose(f->B, MAT_INITIAL_MATRIX, &f->Bt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At the first parameters: supports are the same at all of them. Collective. */
static PetscErrorCode CountFree(HycoFOM f)
{
  PetscInt mine = 0;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < f->part->n_nodes; i++) {
    /* Each node once. */
    for (PetscInt c = 0; HycoMeshOwned(f->part, i) >= 0 && c < f->fe->dim; c++)
      mine += !f->fe->fixed[i * f->fe->dim + c];
  }
  PetscCallMPI(MPI_Allreduce(&mine, &f->n_free, 1, MPIU_INT, MPI_SUM, HycoComm(f)));
  PetscCheck(f->n_free, HycoComm(f), PETSC_ERR_USER, "every displacement of the scene is fixed; remove a support");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Moduli may be invalid in the cells of one rank alone: all ranks end with its line. */
static PetscErrorCode AssembleStiffness(HycoFOM f)
{
  PetscFunctionBegin;
  HycoOnEach(HycoComm(f), HycoFEAssembleStiffness(f->fe, f->K));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the loads at the pinned unknowns, which belong to the balance. Pins are no supports: without them the loads
   there would be lost from the balance. */
static PetscErrorCode AssembleForce(HycoFOM f)
{
  PetscFunctionBegin;
  if (f->n_pins) PetscCall(HycoFESetPins(f->fe, 0, NULL, NULL));
  HycoOnEach(HycoComm(f), HycoFEAssembleForce(f->fe, f->F));
  if (!f->n_pins) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoFESetPins(f->fe, f->n_pins, f->pin_tag, f->pin_component));
  PetscCall(HycoFOMBalance(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Moves this rank's surfaces, and searches for the masters on them. The mirror signs are those that all ranks agree
   on, also where a rank has no cell of a body. */
static PetscErrorCode MoveSurface(HycoFOM f, const PetscReal mu[])
{
  PetscFunctionBegin;
  if (!f->fe_surface) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoFESetParameters(f->fe_surface, mu));
  PetscCall(PetscArraycpy(f->fe_surface->mirrored, f->fe->mirrored, f->scene->n_bodies));
  if (f->searches) PetscCall(HycoPairsMove(f->fe_surface, &f->pairs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Moves the mesh to mu on all ranks: parts first, then facets that are newly needed, then surfaces and masters.
   Collective. */
PetscErrorCode HycoFOMSetParameters(HycoFOM f, const PetscReal mu[])
{
  PetscFunctionBegin;
  HycoOnEach(HycoComm(f), HycoFESetParameters(f->fe, mu));
  if (f->size == 1) PetscFunctionReturn(PETSC_SUCCESS);
  /* The flag is the same on all ranks: it follows from the parameters. */
  if (f->fe->contact_changed) PetscCall(HycoFEAgreeOnMirrors(HycoComm(f), f->fe));
  f->contact_cpu -= HycoCPU();
  PetscCall(HycoFOMFetchMasters(f));
  HycoOnEach(HycoComm(f), MoveSurface(f, mu));
  f->contact_cpu += HycoCPU();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* K, F, B, D of (16) at mu; only what has changed since the last call. After an error everything is assembled again.
   Collective. */
PetscErrorCode HycoFOMAssemble(HycoFOM f, const PetscReal mu[])
{
  PetscFunctionBegin;
  f->solved = f->given = f->sigma_ready = f->all_ready = PETSC_FALSE;
  PetscCall(HycoFOMSetParameters(f, mu));
  /* An error in what follows makes the next call assemble everything. */
  f->fe->ready = PETSC_FALSE; /* until everything that depends on it is assembled */
  /* Motions that contact prevents depend on the masters of now: those of the last point may be on the other side. */
  f->contact_cpu -= HycoCPU();
  if (f->searches) HycoOnEach(HycoComm(f), f->fe_surface ? HycoPairsMove(f->fe_surface, &f->pairs) : PETSC_SUCCESS);
  f->contact_cpu += HycoCPU();
  if (f->fe->stiffness_changed || f->fe->contact_changed) PetscCall(HycoFOMRelease(f));
  if (!f->n_free) PetscCall(CountFree(f));
  if (f->fe->stiffness_changed) {
    HycoLogged(HYCO_EVENT_ASSEMBLE, AssembleStiffness(f));
    /* At each assembly: a path may have left a tangent in K, and new values reset the knowledge of definiteness. */
    PetscCall(MatSetOption(f->K, MAT_SPD, PETSC_TRUE));
    PetscCall(HycoFOMSetMotions(f));
  }
  HycoLogged(HYCO_EVENT_FORCE, AssembleForce(f));
  f->contact_cpu -= HycoCPU();
  HycoLogged(HYCO_EVENT_CONTACT, AssembleContact(f, f->fe->contact_changed));
  f->contact_cpu += HycoCPU();
  PetscCall(HycoSystemSetMatrices(f->system, f->K, f->Bt, f->B, PETSC_TRUE));
  PetscCall(HycoSystemSetVectors(f->system, f->F, f->D));
  f->fe->ready = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks that all ranks pass the same point: otherwise K would be inconsistent, and a rank with an error would leave
   the others waiting. */
static PetscErrorCode CheckPoint(HycoFOM f, PetscInt n, const PetscReal mu[])
{
  PetscReal bounds[2 * HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  HycoOnEach(HycoComm(f), HycoSceneCheckParameters(f->scene, n, mu));
  if (f->size == 1) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt p = 0; p < n; p++) {
    bounds[p] = mu[p];
    bounds[n + p] = -mu[p];
  }
  HycoAllreduce(bounds, 2 * n, MPIU_REAL, MPI_MAX, HycoComm(f));
  for (PetscInt p = 0; p < n; p++) {
    /* The largest value, and minus the smallest. */
    HycoCheck(bounds[p] == -bounds[n + p],
              "%s is %.10g on one rank and %.10g on another; all ranks need the same point", f->scene->parameter[p],
              (double)-bounds[n + p], (double)bounds[p]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves (16) at the point mu (n parameters), or its path. Whether the result is a solution is judged in
   HycoFOMGetSummary(). Collective. */
PetscErrorCode HycoFOMSolve(HycoFOM f, PetscInt n, const PetscReal mu[])
{
  HycoSeconds *t;
  PetscReal begin = HycoNow(), cpu = HycoCPU();

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  t = &f->summary.seconds;
  PetscCall(HycoInterruptCheck());
  PetscCall(CheckPoint(f, n, mu));
  if (f->path) {
    PetscCall(HycoPathSolve(f, mu));
    f->cpu = HycoCPU() - cpu;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoFOMAssemble(f, mu));
  t->assemble = HycoNow() - begin;
  PetscCall(HycoSolverSetSystem(f->solver, f->system));
  HycoLogged(HYCO_EVENT_SOLVE, HycoSolverSolve(f->solver, f->U, f->Lambda));
  PetscCall(HycoSolverGetSeconds(f->solver, &t->factor, &t->solve));
  /* Only with -hyco_regularise has it something to check. */
  PetscCall(HycoFOMCheckContactBalance(f));
  PetscCall(HycoFOMGather(f));
  t->total = HycoNow() - begin;
  f->cpu = HycoCPU() - cpu;
  f->solved = PETSC_TRUE;
  PetscCall(HycoFOMViewFromOptions(f, NULL, "-hyco_fom_view"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Borrowed; its matrices are those of the last assembly. */
PetscErrorCode HycoFOMGetSystem(HycoFOM f, HycoSystem *system)
{
  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  HycoCheckGiven(system);
  *system = f->system;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of the rank with the largest part: its own unknowns, those of other ranks in its rows, and the number of these
   ranks. By the ranges of ownership; a neighbour counts once. */
static PetscErrorCode LargestPart(HycoFOM f, PetscInt largest[3])
{
  const PetscInt dim = f->part->dim, *start;
  PetscBool *neighbour;
  PetscInt rank;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRanges(f->U, &start));
  PetscCall(PetscCalloc1(f->size, &neighbour));
  largest[0] = f->part->n_owned * dim;
  largest[1] = (f->part->n_nodes - f->part->n_owned) * dim;
  largest[2] = 0;
  for (PetscInt i = 0; i < f->part->n_nodes; i++) {
    if (HycoMeshOwned(f->part, i) >= 0) continue;
    /* The owner by bisection of the ranges. */
    PetscCall(PetscFindInt(f->part->node_global[i] * dim, f->size + 1, start, &rank));
    if (rank < 0) rank = -rank - 2; /* between two ranks' first unknowns */
    largest[2] += !neighbour[rank];
    neighbour[rank] = PETSC_TRUE;
  }
  PetscCall(PetscFree(neighbour));
  HycoAllreduce(largest, 3, MPIU_INT, MPI_MAX, HycoComm(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The ranks' shares of the searches for masters so far, and the time of all that contacts need before a solve. CPU and
   not wall time: ranks wait for each other in collective calls. */
static PetscErrorCode ViewContacts(HycoFOM f, PetscViewer viewer)
{
  PetscInt64 most = f->pairs.queries, all = f->pairs.queries;
  PetscInt patches[2] = {f->patches[0], f->patches[1]};
  PetscReal cpu = f->contact_cpu, sum = cpu;

  PetscFunctionBegin;
  HycoAllreduce(&cpu, 1, MPIU_REAL, MPI_MAX, HycoComm(f));
  HycoAllreduce(&sum, 1, MPIU_REAL, MPI_SUM, HycoComm(f));
  PetscCall(PetscViewerASCIIPrintf(viewer, "contacts: %.4g s of CPU on a rank at most, %.4g s on all\n", (double)cpu,
                                   (double)sum));
  /* Shares say something on several ranks alone. */
  if (f->size == 1) PetscFunctionReturn(PETSC_SUCCESS);
  HycoAllreduce(&most, 1, MPIU_INT64, MPI_MAX, HycoComm(f));
  HycoAllreduce(&all, 1, MPIU_INT64, MPI_SUM, HycoComm(f));
  HycoAllreduce(patches, 2, MPIU_INT, MPI_MAX, HycoComm(f));
  if (all)
    PetscCall(PetscViewerASCIIPrintf(viewer,
                                     "a rank: at most %lld of %lld searches for a master, on %d of %d patches\n",
                                     (long long)most, (long long)all, (int)patches[0], (int)patches[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective; after the set-up, whose sizes it prints. */
PetscErrorCode HycoFOMView(HycoFOM f, PetscViewer viewer)
{
  PetscInt largest[3] = {0, 0, 0};

  PetscFunctionBegin;
  HycoViewBegin(f, HYCO_FOM_CLASSID, viewer);
  PetscCall(PetscViewerASCIIPrintf(viewer, "%d nodes, %d cells, %d contacts, on %d ranks\n", (int)f->n_nodes,
                                   (int)f->n_cells, (int)f->n_contacts, (int)f->size));
  if (f->size > 1) {
    /* The balance of the partition: its largest part sets the time. */
    PetscCall(LargestPart(f, largest));
    PetscCall(PetscViewerASCIIPrintf(viewer, "a rank: at most %d unknowns of its own, %d of %d others\n",
                                     (int)largest[0], (int)largest[1], (int)largest[2]));
  }
  if (f->n_contacts) PetscCall(ViewContacts(f, viewer));
  PetscCall(HycoSystemView(f->system, viewer));
  PetscCall(HycoSolverView(f->solver, viewer));
  PetscCall(PetscViewerASCIIPopTab(viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineViewFromOptions(HycoFOM, HYCO_FOM_CLASSID)
