/* HycoFOM: reads and spreads the mesh, assembles (16), solves it, brings the solution home in the file's order. */
#include <hycopath.h>
#include <hycofields.h>

PetscErrorCode HycoFOMDestroy(HycoFOM *fom)
{
  HycoFOM f;

  PetscFunctionBegin;
  if (!fom || !*fom) PetscFunctionReturn(PETSC_SUCCESS);
  HycoCheckHandle(*fom, HYCO_FOM_CLASSID);
  HycoDereference(fom);
  f = *fom;
  PetscCall(HycoPathDestroy(f));
  PetscCall(HycoSolverDestroy(&f->solver));
  PetscCall(HycoSystemDestroy(&f->system));
  PetscCall(HycoSolverDestroy(&f->given_solver));
  PetscCall(HycoSystemDestroy(&f->given_system));
  PetscCall(VecDestroy(&f->given_F));
  PetscCall(MatDestroy(&f->K));
  PetscCall(MatDestroy(&f->B));
  PetscCall(MatDestroy(&f->Bt));
  PetscCall(VecDestroy(&f->U));
  PetscCall(VecDestroy(&f->Lambda));
  PetscCall(VecDestroy(&f->F));
  PetscCall(VecDestroy(&f->D));
  PetscCall(VecScatterDestroy(&f->to_local));
  PetscCall(VecScatterDestroy(&f->to_root));
  PetscCall(VecScatterDestroy(&f->lambda_to_root));
  PetscCall(VecDestroy(&f->U_local));
  PetscCall(VecDestroy(&f->U_root));
  PetscCall(VecDestroy(&f->lambda_root));
  if (f->fe_whole != f->fe) PetscCall(HycoFEDestroy(&f->fe_whole));
  PetscCall(HycoFEDestroy(&f->fe));
  if (f->part != f->whole) PetscCall(HycoMeshDestroy(&f->part));
  PetscCall(HycoMeshDestroy(&f->whole));
  PetscCall(DMDestroy(&f->dm));
  PetscCall(HycoPairsDestroy(&f->pairs));
  for (PetscInt k = 0; k < f->n_released; k++) PetscCall(VecDestroy(&f->released[k]));
  PetscCall(PetscFree(f->released));
  PetscCall(PetscFree(f->global));
  PetscCall(PetscFree(f->u));
  PetscCall(PetscFree(f->lambda));
  PetscCall(PetscFree(f->sigma));
  PetscCall(PetscFree(f->gap));
  PetscCall(HycoSceneDestroy(&f->scene));
  PetscCall(PetscHeaderDestroy(fom));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Pairs of nodes that the contacts on the undistributed mesh tie. Rank 0. */
static PetscErrorCode FindTies(HycoFOM f, HycoMesh mesh, PetscInt *n, PetscInt **ties)
{
  HycoPairs p;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  *n = 0;
  ierr = HycoPairsFind(f->scene, mesh, &p);
  if (!ierr) {
    PetscCall(PetscMalloc1(2 * p.n * HycoPairsWidth(&p), ties));
    for (PetscInt k = 0; k < p.n; k++) {
      const PetscInt *master;
      const PetscReal *weight;
      PetscInt masters;

      HycoPairsMasters(&p, k, &masters, &master, &weight);
      for (PetscInt j = 0; j < masters; j++, (*n)++) {
        (*ties)[2 * *n] = HycoPairsSlave(&p, k);
        (*ties)[2 * *n + 1] = master[j];
      }
    }
  }
  PetscCall(HycoPairsDestroy(&p));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cuts the DM for the ranks. */
static PetscErrorCode Distribute(HycoFOM f)
{
  const HycoPartitioner cut = (HycoPartitioner)f->partition;
  PetscInt n_owned, first, n_ties = 0, *ties = NULL;
  HycoMesh mesh;
  PetscBool done;

  PetscFunctionBegin;
  PetscCall(DMPlexIsDistributed(f->dm, &done));
  if (f->size == 1 || done) {
    PetscCall(HycoMeshDistribute(&f->dm, f->scene, NULL, 0, NULL, cut, f->mesh_write));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoPlexToMesh(f->dm, f->scene, &mesh, &n_owned, &first));
  PetscCallMPI(MPI_Allreduce(&mesh->n_cells, &f->n_cells, 1, MPIU_INT, MPI_SUM, HycoComm(f)));
  PetscCheck(f->n_cells >= f->size, HycoComm(f), PETSC_ERR_USER,
             "the mesh has %d cells; run it on at most as many ranks", (int)f->n_cells);
  if (!f->scene->refine) HycoOnRoot(HycoComm(f), FindTies(f, mesh, &n_ties, &ties)); /* else they are yet to be found */
  PetscCall(HycoMeshDistribute(&f->dm, f->scene, mesh, n_ties, ties, cut, f->mesh_write));
  PetscCall(PetscFree(ties));
  PetscCall(HycoMeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The mesh, its parts and its contacts. */
static PetscErrorCode ReadMesh(HycoFOM f)
{
  PetscInt sizes[5] = {0, 0, 0, 0, 0};

  PetscFunctionBegin;
  PetscCall(HycoMeshLoad(HycoComm(f), f->scene, &f->dm));
  PetscCall(Distribute(f));
  PetscCall(HycoPlexToMesh(f->dm, f->scene, &f->part, &f->n_owned, &f->first));
  if (f->size == 1)
    f->whole = f->part;
  else
    PetscCall(HycoMeshGather(HycoComm(f), f->part, f->n_owned, f->first, NULL, &f->whole, &f->global));
  HycoOnRoot(HycoComm(f), HycoPairsFind(f->scene, f->whole, &f->pairs));
  if (f->rank == 0) {
    sizes[0] = f->whole->n_nodes;
    sizes[1] = f->whole->n_cells;
    sizes[2] = f->pairs.n;
    sizes[3] = HycoPairsWidth(&f->pairs);
    sizes[4] = f->pairs.room > 0;
  }
  PetscCallMPI(MPI_Bcast(sizes, 5, MPIU_INT, 0, HycoComm(f)));
  f->n_nodes = sizes[0];
  f->n_cells = sizes[1];
  f->n_contacts = sizes[2];
  f->width = sizes[3];
  f->searches = (PetscBool)(sizes[4] != 0);
  HycoOnEach(HycoComm(f), HycoFECreate(f->scene, f->part, &f->fe));
  f->fe_whole = f->fe;
  if (f->size > 1) {
    f->fe_whole = NULL;
    HycoOnRoot(HycoComm(f), HycoFECreate(f->scene, f->whole, &f->fe_whole));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Scatters of U to each rank's part and to rank 0 in the file's order; of Lambda to rank 0. */
static PetscErrorCode CreateScatters(HycoFOM f)
{
  const PetscInt dim = f->part->dim, n_root = f->rank == 0 ? f->n_nodes : 0, m_root = f->rank == 0 ? f->n_contacts : 0;
  IS is;

  PetscFunctionBegin;
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, f->part->n_nodes * dim, &f->U_local));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, n_root * dim, &f->U_root));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, m_root, &f->lambda_root));
  if (f->part->node_global)
    PetscCall(ISCreateBlock(PETSC_COMM_SELF, dim, f->part->n_nodes, f->part->node_global, PETSC_COPY_VALUES, &is));
  else
    PetscCall(ISCreateStride(PETSC_COMM_SELF, f->part->n_nodes * dim, 0, 1, &is));
  PetscCall(VecScatterCreate(f->U, is, f->U_local, NULL, &f->to_local));
  PetscCall(ISDestroy(&is));
  if (f->global)
    PetscCall(ISCreateBlock(PETSC_COMM_SELF, dim, n_root, f->global, PETSC_COPY_VALUES, &is));
  else
    PetscCall(ISCreateStride(PETSC_COMM_SELF, n_root * dim, 0, 1, &is));
  PetscCall(VecScatterCreate(f->U, is, f->U_root, NULL, &f->to_root));
  PetscCall(ISDestroy(&is));
  if (f->n_contacts) {
    PetscCall(ISCreateStride(PETSC_COMM_SELF, m_root, 0, 1, &is));
    PetscCall(VecScatterCreate(f->Lambda, is, f->lambda_root, NULL, &f->lambda_to_root));
    PetscCall(ISDestroy(&is));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* B and Bt with the pattern that any parameter gives: all components of a contact's nodes. */
static PetscErrorCode CreateB(HycoFOM f)
{
  const PetscInt dim = f->part->dim, entries = f->width * dim;

  PetscFunctionBegin;
  PetscCall(MatCreate(HycoComm(f), &f->B));
  PetscCall(MatSetSizes(f->B, PETSC_DECIDE, f->n_owned * dim, f->n_contacts, f->n_nodes * dim));
  PetscCall(MatSetType(f->B, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(f->B, entries, NULL));
  PetscCall(MatMPIAIJSetPreallocation(f->B, entries, NULL, entries, NULL));
  PetscCall(MatSetOption(f->B, MAT_NEW_NONZERO_LOCATION_ERR, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SetFromOptions(HycoFOM f)
{
  PetscFunctionBegin;
  PetscObjectOptionsBegin((PetscObject)f);
  PetscCall(HycoOptionsBool(
      "-hyco_regularise", "full order: rigid motions that neither supports nor contact hold are taken out, not refused",
      &f->regularise, NULL));
  PetscCall(HycoOptionsReal("-hyco_regularise_tol",
                            "of such a motion: the share of the loads on it that may be unbalanced", 0, 1,
                            &f->regularise_tol, NULL));
  PetscCall(HycoOptionsWord("-hyco_partition", "cuts the mesh for the ranks; PT-Scotch also where METIS fails",
                            HycoPartitioners, &f->partition, NULL));
  PetscCall(HycoOptionsString(
      "-hyco_mesh_write", "<file.h5>: writes the mesh, refined as the scene says, in PETSc's HDF5 format of a DMPlex",
      f->mesh_write, sizeof(f->mesh_write), NULL));
  if (!f->scene || f->scene->n_times > 0) PetscCall(HycoPathSetFromOptions(f, PetscOptionsObject));
  PetscCall(HycoOptionsName("-hyco_fom_view", "after each full-order solve: sizes, system, solver"));
  PetscOptionsEnd();
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Create(MPI_Comm comm, HycoFOM *fom)
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

PetscErrorCode HycoFOMDeclare(PetscOptions options)
{
  HycoFOM f;

  PetscFunctionBegin;
  PetscCall(Create(PETSC_COMM_SELF, &f));
  HycoDeclare(f, options, SetFromOptions, HycoFOMDestroy);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SetUp(HycoFOM f)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectSetOptions((PetscObject)f, f->scene->options));
  PetscCall(SetFromOptions(f));
  f->summary.seconds.setup = -HycoNow();
  HycoLogged(HYCO_EVENT_MESH, ReadMesh(f));
  PetscCall(HycoFECreateMatrix(f->fe, HycoComm(f), f->n_owned, f->first, &f->K));
  PetscCall(MatCreateVecs(f->K, &f->U, &f->F));
  if (f->n_contacts) {
    PetscCall(CreateB(f));
    PetscCall(MatCreateVecs(f->B, NULL, &f->Lambda));
    PetscCall(VecDuplicate(f->Lambda, &f->D));
  }
  PetscCall(CreateScatters(f));
  PetscCall(HycoSystemCreate(HycoComm(f), &f->system));
  PetscCall(HycoSolverCreate(HycoComm(f), &f->solver));
  PetscCall(PetscObjectSetOptions((PetscObject)f->solver, f->scene->options));
  PetscCall(HycoSolverSetFromOptions(f->solver));
  if (f->rank == 0) {
    PetscCall(PetscMalloc1(f->n_nodes * f->part->dim, &f->u));
    PetscCall(PetscCalloc1(f->n_contacts + 1, &f->lambda));
    PetscCall(PetscCalloc1(f->n_contacts + 1, &f->gap));
    PetscCall(PetscMalloc1(f->n_cells * f->fe->n_sigma, &f->sigma));
  }
  if (f->path) PetscCall(HycoPathCreate(f));
  f->summary.seconds.setup += HycoNow();
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMCreate(MPI_Comm comm, HycoScene scene, HycoFOM *fom)
{
  PetscErrorCode ierr;

  PetscFunctionBegin;
  HycoCheckHandle(scene, HYCO_SCENE_CLASSID);
  PetscCall(Create(comm, fom));
  PetscCall(PetscObjectReference((PetscObject)scene));
  (*fom)->scene = scene;
  ierr = SetUp(*fom);
  if (ierr) PetscCall(HycoFOMDestroy(fom));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMGetSolver(HycoFOM f, HycoSolver *solver)
{
  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  *solver = f->solver;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* B (if what it depends on changed) and D, from rank 0. */
static PetscErrorCode FillContact(HycoFOM f, PetscBool rows_changed)
{
  PetscErrorCode ierr;
  const PetscInt m = f->pairs.n, dim = f->part->dim, entries = f->width * dim * m;
  PetscInt *start, *dof;
  PetscReal *value;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(m + 1, &start, entries, &dof, entries, &value));
  ierr = HycoContactRows(f->fe_whole, &f->pairs, start, dof, value, f->gap);
  if (!ierr) ierr = HycoContactCountStill(f->fe_whole, &f->pairs, start, &f->summary.n_still);
  for (PetscInt k = 0; !ierr && k < m; k++) {
    PetscCall(VecSetValue(f->D, k, f->gap[k], INSERT_VALUES));
    for (PetscInt j = start[k]; rows_changed && j < start[k + 1]; j++) {
      const PetscInt node = f->global ? f->global[dof[j] / dim] : dof[j] / dim;

      PetscCall(MatSetValue(f->B, k, node * dim + dof[j] % dim, value[j], INSERT_VALUES));
    }
  }
  PetscCall(PetscFree3(start, dof, value));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AssembleContact(HycoFOM f, PetscBool rows_changed)
{
  PetscFunctionBegin;
  if (!f->n_contacts) { /* perhaps obstacles whose nodes are all fixed */
    HycoOnRoot(HycoComm(f), HycoContactCountStill(f->fe_whole, &f->pairs, NULL, &f->summary.n_still));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (rows_changed && f->Bt && f->searches) { /* entries of masters that are left behind must not stay */
    PetscCall(MatDestroy(&f->B));
    PetscCall(CreateB(f));
  } else if (rows_changed && f->Bt)
    PetscCall(MatZeroEntries(f->B));
  HycoOnRoot(HycoComm(f), FillContact(f, rows_changed));
  PetscCall(VecAssemblyBegin(f->D));
  PetscCall(VecAssemblyEnd(f->D));
  if (!rows_changed) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatAssemblyBegin(f->B, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(f->B, MAT_FINAL_ASSEMBLY));
  PetscCall(MatDestroy(&f->Bt)); /* a normal that turns may have brought B an entry */
  PetscCall(MatTranspose(f->B, MAT_INITIAL_MATRIX, &f->Bt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CountFree(HycoFOM f)
{
  PetscInt mine = 0;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < f->part->n_nodes; i++) {
    const PetscInt row = (f->part->node_global ? f->part->node_global[i] : i) - f->first;

    for (PetscInt c = 0; row >= 0 && row < f->n_owned && c < f->fe->dim; c++) mine += !f->fe->fixed[i * f->fe->dim + c];
  }
  PetscCallMPI(MPI_Allreduce(&mine, &f->n_free, 1, MPIU_INT, MPI_SUM, HycoComm(f)));
  PetscCheck(f->n_free, HycoComm(f), PETSC_ERR_USER,
             "every displacement of the scene is fixed; there is nothing to solve");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The loads at the pinned unknowns belong to the balance too. */
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

PetscErrorCode HycoFOMAssemble(HycoFOM f, const PetscReal mu[])
{
  PetscFunctionBegin;
  f->solved = f->given = f->sigma_ready = PETSC_FALSE;
  HycoOnEach(HycoComm(f), HycoFESetParameters(f->fe, mu));
  if (f->fe_whole != f->fe) HycoOnRoot(HycoComm(f), HycoFESetParameters(f->fe_whole, mu));
  f->fe->ready = PETSC_FALSE; /* until all that depends on it is assembled */
  if (f->fe->stiffness_changed || f->fe->contact_changed) PetscCall(HycoFOMRelease(f));
  if (!f->n_free) PetscCall(CountFree(f));
  if (f->fe->stiffness_changed) {
    PetscCall(HycoLogEvent(HYCO_EVENT_ASSEMBLE, PETSC_TRUE));
    HycoOnEach(HycoComm(f), HycoFEAssembleStiffness(f->fe, f->K));
    PetscCall(HycoLogEvent(HYCO_EVENT_ASSEMBLE, PETSC_FALSE));
    PetscCall(MatSetOption(f->K, MAT_SPD, PETSC_TRUE));
    PetscCall(HycoFOMSetMotions(f));
  }
  PetscCall(HycoLogEvent(HYCO_EVENT_FORCE, PETSC_TRUE));
  PetscCall(AssembleForce(f));
  PetscCall(HycoLogEvent(HYCO_EVENT_FORCE, PETSC_FALSE));
  HycoLogged(HYCO_EVENT_CONTACT, AssembleContact(f, f->fe->contact_changed));
  PetscCall(HycoSystemSetMatrices(f->system, f->K, f->Bt, f->B, PETSC_TRUE));
  PetscCall(HycoSystemSetVectors(f->system, f->F, f->D));
  f->fe->ready = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMGather(HycoFOM f)
{
  const PetscScalar *v;

  PetscFunctionBegin;
  PetscCall(VecScatterBegin(f->to_local, f->U, f->U_local, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(f->to_local, f->U, f->U_local, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterBegin(f->to_root, f->U, f->U_root, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(f->to_root, f->U, f->U_root, INSERT_VALUES, SCATTER_FORWARD));
  if (f->n_contacts) {
    PetscCall(VecScatterBegin(f->lambda_to_root, f->Lambda, f->lambda_root, INSERT_VALUES, SCATTER_FORWARD));
    PetscCall(VecScatterEnd(f->lambda_to_root, f->Lambda, f->lambda_root, INSERT_VALUES, SCATTER_FORWARD));
  }
  if (f->rank) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetArrayRead(f->U_root, &v));
  PetscCall(PetscArraycpy(f->u, v, f->n_nodes * f->fe->dim));
  PetscCall(VecRestoreArrayRead(f->U_root, &v));
  PetscCall(VecGetArrayRead(f->lambda_root, &v));
  PetscCall(PetscArraycpy(f->lambda, v, f->n_contacts));
  PetscCall(VecRestoreArrayRead(f->lambda_root, &v));
  HycoFOMTakeOutReleased(f);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The ranks ask for one point: with several, K would be of no scene, and a rank alone in its error would leave the
   others waiting. */
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
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, bounds, (PetscMPIInt)(2 * n), MPIU_REAL, MPI_MAX, HycoComm(f)));
  for (PetscInt p = 0; p < n; p++) {
    HycoCheck(bounds[p] == -bounds[n + p], "%s is %.10g on one rank and %.10g on another; give all of them one point",
              f->scene->parameter[p], (double)-bounds[n + p], (double)bounds[p]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMSolve(HycoFOM f, PetscInt n, const PetscReal mu[])
{
  HycoSeconds *t;
  PetscReal begin = HycoNow();

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  t = &f->summary.seconds;
  PetscCall(CheckPoint(f, n, mu));
  if (f->path) {
    PetscCall(HycoPathSolve(f, mu));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoFOMAssemble(f, mu));
  t->assemble = HycoNow() - begin;
  PetscCall(HycoSolverSetSystem(f->solver, f->system));
  HycoLogged(HYCO_EVENT_SOLVE, HycoSolverSolve(f->solver, f->U, f->Lambda));
  PetscCall(HycoSolverGetSeconds(f->solver, &t->factor, &t->solve));
  PetscCall(HycoFOMCheckContactBalance(f));
  PetscCall(HycoFOMGather(f));
  t->total = HycoNow() - begin;
  f->solved = PETSC_TRUE;
  PetscCall(HycoFOMViewFromOptions(f, NULL, "-hyco_fom_view"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMGetSystem(HycoFOM f, HycoSystem *system)
{
  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  *system = f->system;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MeasureContacts(HycoFOM f, HycoSummary *s)
{
  HycoContactState state;

  PetscFunctionBegin;
  PetscCall(HycoContactMeasure(f->fe_whole, &f->pairs, f->u, f->lambda, NULL, &state));
  s->n_facing = state.n_facing;
  s->overlap = state.overlap;
  s->sliding = state.sliding;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMGetSummary(HycoFOM f, HycoSummary *out)
{
  HycoSummary *s;

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  s = &f->summary;
  PetscCheck(f->solved, PETSC_COMM_SELF, PETSC_ERR_ORDER, "call HycoFOMSolve() before HycoFOMGetSummary()");
  s->dim = f->fe->dim;
  s->n_dof = f->n_free;
  s->n_contacts = f->n_contacts;
  PetscCall(HycoSolverGetIterations(f->given ? f->given_solver : f->solver, &s->iterations));
  PetscCall(HycoSolverGetKKT(f->solver, &s->kkt));
  PetscCall(HycoSolverGetReason(f->given ? f->given_solver : f->solver, &s->reason));
  if (f->given) s->kkt = f->given_kkt;
  if (f->path)
    HycoPathSummary(f, s);
  else
    PetscCall(HycoFOMEnergy(f, s));
  s->n_facing = 0;
  s->overlap = s->sliding = 0;
  HycoOnRoot(HycoComm(f), MeasureContacts(f, s));
  if (s->reason > 0 && f->n_contacts) HycoOnRoot(HycoComm(f), HycoFOMCountDependent(f, &s->n_dependent));
  s->n_active = 0;
  s->total_contact_force = s->lambda_max = s->lambda_norm2 = s->u_norm2 = 0;
  if (f->rank == 0) {
    for (PetscInt k = 0; k < f->n_contacts; k++) {
      s->n_active += f->lambda[k] > 0;
      s->total_contact_force += f->lambda[k];
      s->lambda_max = PetscMax(s->lambda_max, f->lambda[k]);
      s->lambda_norm2 += f->lambda[k] * f->lambda[k];
    }
    for (PetscInt c = 0; c < s->dim; c++) s->u_min[c] = s->u_max[c] = f->u[c];
    for (PetscInt k = 0; k < f->n_nodes * s->dim; k++) {
      s->u_norm2 += f->u[k] * f->u[k];
      s->u_min[k % s->dim] = PetscMin(s->u_min[k % s->dim], f->u[k]);
      s->u_max[k % s->dim] = PetscMax(s->u_max[k % s->dim], f->u[k]);
    }
    s->lambda_norm2 = PetscSqrtReal(s->lambda_norm2);
    s->u_norm2 = PetscSqrtReal(s->u_norm2);
  }
  PetscCallMPI(MPI_Bcast(s, sizeof(*s), MPI_BYTE, 0, HycoComm(f)));
  *out = *s;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stresses, computed by cell on every rank, brought to rank 0. */
static PetscErrorCode GatherStress(HycoFOM f)
{
  const PetscInt ns = f->fe->n_sigma, n_root = f->rank == 0 ? f->n_cells * ns : 0;
  const PetscScalar *u, *v;
  PetscReal *sigma;
  Vec all, root;
  VecScatter scatter;
  IS is;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(f->part->n_cells * ns, &sigma));
  PetscCall(VecGetArrayRead(f->U_local, &u));
  if (f->path)
    PetscCall(HycoFEStateFields(f->fe, f->path->begin, sigma, NULL, NULL, NULL));
  else
    PetscCall(HycoFEStress(f->fe, u, sigma));
  PetscCall(VecRestoreArrayRead(f->U_local, &u));
  if (f->size == 1) {
    PetscCall(PetscArraycpy(f->sigma, sigma, f->n_cells * ns));
    PetscCall(PetscFree(sigma));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecCreateMPI(HycoComm(f), PETSC_DECIDE, f->n_cells * ns, &all));
  for (PetscInt e = 0; e < f->part->n_cells; e++) {
    for (PetscInt k = 0; k < ns; k++)
      PetscCall(VecSetValue(all, f->part->cell_whole[e] * ns + k, sigma[e * ns + k], INSERT_VALUES));
  }
  PetscCall(PetscFree(sigma));
  PetscCall(VecAssemblyBegin(all));
  PetscCall(VecAssemblyEnd(all));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, n_root, &root));
  PetscCall(ISCreateStride(PETSC_COMM_SELF, n_root, 0, 1, &is));
  PetscCall(VecScatterCreate(all, is, root, NULL, &scatter));
  PetscCall(VecScatterBegin(scatter, all, root, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter, all, root, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetArrayRead(root, &v));
  if (f->rank == 0) PetscCall(PetscArraycpy(f->sigma, v, n_root));
  PetscCall(VecRestoreArrayRead(root, &v));
  PetscCall(VecScatterDestroy(&scatter));
  PetscCall(ISDestroy(&is));
  PetscCall(VecDestroy(&root));
  PetscCall(VecDestroy(&all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMGetSolution(HycoFOM f, PetscInt *n_nodes, const PetscReal *U[], PetscInt *n_contacts,
                                  const PetscReal *Lambda[], PetscInt *n_cells, const PetscReal *sigma[])
{
  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  PetscCheck(f->solved, PETSC_COMM_SELF, PETSC_ERR_ORDER, "call HycoFOMSolve() before HycoFOMGetSolution()");
  if (!f->sigma_ready) PetscCall(GatherStress(f));
  f->sigma_ready = PETSC_TRUE;
  if (n_nodes) *n_nodes = f->rank ? 0 : f->n_nodes;
  if (U) *U = f->u;
  if (n_contacts) *n_contacts = f->rank ? 0 : f->n_contacts;
  if (Lambda) *Lambda = f->lambda;
  if (n_cells) *n_cells = f->rank ? 0 : f->n_cells;
  if (sigma) *sigma = f->sigma;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMGetForces(HycoFOM f, PetscReal forces[])
{
  Vec work, root;
  const PetscScalar *v;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(f->F, &work));
  if (f->n_contacts) {
    PetscCall(MatMult(f->Bt, f->Lambda, work));
    PetscCall(VecAYPX(work, -1, f->F));
  } else
    PetscCall(VecCopy(f->F, work));
  PetscCall(VecDuplicate(f->U_root, &root));
  PetscCall(VecScatterBegin(f->to_root, work, root, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(f->to_root, work, root, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetArrayRead(root, &v));
  for (PetscInt k = 0; f->rank == 0 && k < f->n_nodes * f->fe->dim; k++) forces[k] = f->fe_whole->fixed[k] ? 0 : v[k];
  PetscCall(VecRestoreArrayRead(root, &v));
  PetscCall(VecDestroy(&root));
  PetscCall(VecDestroy(&work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMWrite(HycoFOM f, const char path[])
{
  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  PetscCheck(f->solved, PETSC_COMM_SELF, PETSC_ERR_ORDER, "call HycoFOMSolve() before HycoFOMWrite()");
  HycoOnRoot(HycoComm(f), HycoSolutionWrite(path, f->fe_whole, &f->pairs, f->u, f->lambda, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMView(HycoFOM f, PetscViewer viewer)
{
  PetscBool ascii;

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  PetscCall(HycoViewBegin((PetscObject)f, &viewer, &ascii));
  if (!ascii) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscViewerASCIIPrintf(viewer, "%d nodes, %d cells, %d contacts, on %d ranks\n", (int)f->n_nodes,
                                   (int)f->n_cells, (int)f->n_contacts, (int)f->size));
  PetscCall(HycoSystemView(f->system, viewer));
  PetscCall(HycoSolverView(f->solver, viewer));
  PetscCall(PetscViewerASCIIPopTab(viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineViewFromOptions(HycoFOM, HYCO_FOM_CLASSID)
