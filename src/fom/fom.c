/* HycoFOM: reads and distributes the mesh, assembles (16), solves it, and gathers the solution in the file's order. */
#include <hycofields.h>
#include <hycopath.h>

PetscErrorCode HycoFOMDestroy(HycoFOM *fom)
{
  HycoFOM f;

  PetscFunctionBegin;
  if (!fom || !*fom) PetscFunctionReturn(PETSC_SUCCESS);
  HycoCheckHandle(*fom, HYCO_FOM_CLASSID);
  HycoDereference(fom);
  f = *fom;
  PetscCall(HycoComparedDestroy(&f->compared));
  PetscCall(HycoPathFree(&f->path));
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
  PetscCall(VecScatterDestroy(&f->to_surface));
  PetscCall(VecScatterDestroy(&f->lambda_to_root));
  PetscCall(VecDestroy(&f->U_local));
  PetscCall(VecDestroy(&f->U_surface));
  PetscCall(VecDestroy(&f->lambda_root));
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
  PetscCall(PetscFree(f->u));
  PetscCall(PetscFree(f->u_all));
  PetscCall(PetscFree(f->sigma_all));
  PetscCall(HycoFieldFileDestroy(&f->set));
  PetscCall(PetscFree(f->contact_result));
  PetscCall(PetscFree(f->reaction));
  PetscCall(PetscFree(f->lambda));
  PetscCall(PetscFree(f->sigma));
  PetscCall(PetscFree(f->gap));
  PetscCall(HycoSceneDestroy(&f->scene));
  PetscCall(PetscHeaderDestroy(fom));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMarkContactGroups(HycoScene scene, HycoMesh mesh, PetscBool group[])
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < 2 * scene->n_contacts; k++) {
    HycoContact c = scene->contact[k / 2];
    PetscInt g = 0;

    if (k % 2 && !c->master) continue;
    PetscCall(HycoMeshFindGroup(mesh, "contact", k % 2 ? c->master : c->slave, &g));
    group[g] = PETSC_TRUE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gathers the contacts' surfaces on rank 0 (in 1D all of the mesh: its facets need their cells). */
static PetscErrorCode GatherSurface(HycoFOM f, HycoMesh part)
{
  PetscBool *in;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(part->n_groups, &in));
  PetscCall(HycoMarkContactGroups(f->scene, part, in));
  PetscCall(HycoMeshGather(HycoComm(f), part, part->dim > 1 ? in : NULL, NULL, &f->surface));
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the contacts, and the pairs of their nodes for the partitioner, as indices in the whole mesh; the node of a
   rigid body is in no pair, otherwise all of its contact's surface would be on one rank. Rank 0. */
static PetscErrorCode FindTies(HycoFOM f, PetscInt *n, PetscInt **ties)
{
  HycoPairs *p = &f->pairs;

  PetscFunctionBegin;
  *n = 0;
  PetscCall(HycoPairsFind(f->scene, f->surface, &f->team, p));
  PetscCall(PetscMalloc1(2 * p->n * HycoPairsWidth(p), ties));
  for (PetscInt k = 0; k < p->n; k++) {
    const PetscInt *master;
    const PetscReal *weight;
    PetscInt masters;

    HycoPairsMasters(p, k, &masters, &master, &weight);
    if (f->scene->contact[p->contact[k]]->rigid) continue;
    for (PetscInt j = 0; j < masters; j++, (*n)++) {
      (*ties)[2 * *n] = f->surface->node_whole[HycoPairsSlave(p, k)];
      (*ties)[2 * *n + 1] = f->surface->node_whole[master[j]];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Partitions the DM so that no contact is cut, if the contacts can be found before; *found: they were. */
static PetscErrorCode Distribute(HycoFOM f, PetscBool *found)
{
  const HycoPartitioner cut = (HycoPartitioner)f->partition;
  PetscInt n_ties = 0, *ties = NULL;
  HycoMesh mesh;
  PetscBool done;

  PetscFunctionBegin;
  *found = PETSC_FALSE;
  PetscCall(DMPlexIsDistributed(f->dm, &done));
  if (f->size == 1 || done) {
    PetscCall(HycoMeshDistribute(&f->dm, f->scene, NULL, 0, NULL, cut, f->mesh_write));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoPlexToMesh(f->dm, f->scene, &mesh));
  PetscCheck(mesh->n_whole_cells >= f->size, HycoComm(f), PETSC_ERR_USER,
             "the mesh has %d cells; use at most as many ranks", (int)mesh->n_whole_cells);
  if (!f->scene->refine) { /* otherwise the contacts are found later */
    HycoOnEach(HycoComm(f), HycoMeshCheckCells(mesh));
    PetscCall(GatherSurface(f, mesh));
    HycoOnRootWithTeam(&f->team, FindTies(f, &n_ties, &ties));
    PetscCall(HycoMeshDestroy(&f->surface));
    *found = PETSC_TRUE;
  }
  PetscCall(HycoMeshDistribute(&f->dm, f->scene, mesh, mesh->n_cells ? n_ties : 0, ties, cut, f->mesh_write));
  PetscCall(PetscFree(ties));
  PetscCall(HycoMeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the mesh, and makes its parts and its contacts. */
static PetscErrorCode ReadMesh(HycoFOM f)
{
  PetscInt sizes[3] = {0, 0, 0};
  PetscBool found;

  PetscFunctionBegin;
  PetscCall(HycoMeshLoad(HycoComm(f), f->scene, &f->dm));
  PetscCall(Distribute(f, &found));
  PetscCall(HycoPlexToMesh(f->dm, f->scene, &f->part));
  if (f->size == 1) {
    f->surface = f->part;
    f->n_nodes = f->part->n_nodes;
    f->n_cells = f->part->n_cells;
  } else {
    if (!found) HycoOnEach(HycoComm(f), HycoMeshCheckCells(f->part));
    PetscCall(GatherSurface(f, f->part));
    f->n_nodes = f->part->n_whole_nodes;
    f->n_cells = f->part->n_whole_cells;
  }
  if (f->size == 1) HycoOnRoot(HycoComm(f), HycoPairsFind(f->scene, f->surface, NULL, &f->pairs));
  if (f->size > 1 && !found) HycoOnRootWithTeam(&f->team, HycoPairsFind(f->scene, f->surface, &f->team, &f->pairs));
  if (f->rank == 0) {
    sizes[0] = f->pairs.n;
    sizes[1] = HycoPairsWidth(&f->pairs);
    sizes[2] = f->pairs.room > 0;
  }
  PetscCallMPI(MPI_Bcast(sizes, 3, MPIU_INT, 0, HycoComm(f)));
  f->n_contacts = sizes[0];
  f->width = sizes[1];
  f->searches = (PetscBool)(sizes[2] != 0);
  HycoOnEach(HycoComm(f), HycoFECreate(f->scene, f->part, &f->fe));
  if (f->size == 1)
    f->fe_surface = f->fe;
  else
    HycoOnRoot(HycoComm(f), HycoFECreate(f->scene, f->surface, &f->fe_surface));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates the scatters of U to each rank's part and to the surfaces on rank 0, and of Lambda to rank 0. */
static PetscErrorCode CreateScatters(HycoFOM f)
{
  const PetscInt dim = f->part->dim, m_root = f->rank == 0 ? f->n_contacts : 0;
  const PetscInt n_surface = f->surface ? f->surface->n_nodes : 0;
  IS is;

  PetscFunctionBegin;
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, f->part->n_nodes * dim, &f->U_local));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, m_root, &f->lambda_root));
  if (f->part->node_global)
    PetscCall(ISCreateBlock(PETSC_COMM_SELF, dim, f->part->n_nodes, f->part->node_global, PETSC_COPY_VALUES, &is));
  else
    PetscCall(ISCreateStride(PETSC_COMM_SELF, f->part->n_nodes * dim, 0, 1, &is));
  PetscCall(VecScatterCreate(f->U, is, f->U_local, NULL, &f->to_local));
  PetscCall(ISDestroy(&is));
  if (f->size > 1) {
    PetscCall(VecCreateSeq(PETSC_COMM_SELF, n_surface * dim, &f->U_surface));
    PetscCall(ISCreateBlock(PETSC_COMM_SELF, dim, n_surface, f->surface ? f->surface->node_global : NULL,
                            PETSC_COPY_VALUES, &is));
    PetscCall(VecScatterCreate(f->U, is, f->U_surface, NULL, &f->to_surface));
    PetscCall(ISDestroy(&is));
  }
  if (f->n_contacts) {
    PetscCall(ISCreateStride(PETSC_COMM_SELF, m_root, 0, 1, &is));
    PetscCall(VecScatterCreate(f->Lambda, is, f->lambda_root, NULL, &f->lambda_to_root));
    PetscCall(ISDestroy(&is));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscInt GlobalNode(HycoFOM f, PetscInt node)
{
  return f->surface->node_global ? f->surface->node_global[node] : node;
}

/* Composes B with the slaves of its rows, which do not change. Collective. */
static PetscErrorCode TellSlaves(HycoFOM f)
{
  Vec slaves;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(f->B, NULL, &slaves));
  for (PetscInt k = 0; f->rank == 0 && k < f->pairs.n; k++)
    PetscCall(VecSetValue(slaves, k, GlobalNode(f, HycoPairsSlave(&f->pairs, k)) * f->part->dim, INSERT_VALUES));
  PetscCall(VecAssemblyBegin(slaves));
  PetscCall(VecAssemblyEnd(slaves));
  PetscCall(PetscObjectCompose((PetscObject)f->B, HYCO_SLAVES, (PetscObject)slaves));
  PetscCall(VecDestroy(&slaves));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates B and Bt with the pattern for any parameters: all components of a contact's nodes. */
static PetscErrorCode CreateB(HycoFOM f)
{
  const PetscInt dim = f->part->dim, entries = f->width * dim;

  PetscFunctionBegin;
  PetscCall(MatCreate(HycoComm(f), &f->B));
  PetscCall(MatSetSizes(f->B, PETSC_DECIDE, f->part->n_owned * dim, f->n_contacts, f->n_nodes * dim));
  PetscCall(MatSetType(f->B, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(f->B, entries, NULL));
  PetscCall(MatMPIAIJSetPreallocation(f->B, entries, NULL, entries, NULL));
  PetscCall(MatSetOption(f->B, MAT_NEW_NONZERO_LOCATION_ERR, PETSC_FALSE));
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
  PetscCall(HycoOptionsFor("history"));
  if (!f->scene || f->scene->n_times > 0)
    PetscCall(ReadPath(f, PetscOptionsObject));
  else
    PetscCall(HycoPathRefuseOptions(f));
  PetscCall(HycoOptionsFor(""));
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
  (*fom)->team.comm = HycoComm(*fom);
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
  PetscCall(HycoFECreateMatrix(f->fe, HycoComm(f), f->part->n_owned, f->part->first, &f->K));
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
  PetscCall(PetscMalloc1(f->fe->n_dof, &f->u));
  f->u_surface = f->u;
  if (f->size > 1) PetscCall(PetscMalloc1(f->fe_surface ? f->fe_surface->n_dof : 0, &f->u_surface));
  if (f->rank == 0) {
    PetscCall(PetscCalloc1(f->n_contacts + 1, &f->lambda));
    PetscCall(PetscCalloc1(f->n_contacts + 1, &f->gap));
  }
  if (f->path) PetscCall(HycoFOMPathCreate(f));
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

PetscErrorCode HycoFOMCreateMesh(MPI_Comm comm, HycoScene scene, HycoFOM *fom)
{
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(Create(comm, fom));
  PetscCall(PetscObjectReference((PetscObject)scene));
  (*fom)->scene = scene;
  PetscCall(PetscObjectSetOptions((PetscObject)*fom, scene->options));
  PetscCall(SetFromOptions(*fom));
  (*fom)->mesh_write[0] = '\0'; /* only for solves */
  ierr = ReadMesh(*fom);
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

/* Sets B (if the parameters that it depends on have changed) and D, from rank 0. */
static PetscErrorCode FillContact(HycoFOM f, PetscBool rows_changed)
{
  PetscErrorCode ierr;
  const PetscInt m = f->pairs.n, dim = f->part->dim, entries = f->width * dim * m;
  PetscInt *start, *dof;
  PetscReal *value;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(m + 1, &start, entries, &dof, entries, &value));
  ierr = HycoContactRows(f->fe_surface, &f->pairs, start, dof, value, f->gap);
  if (!ierr) ierr = HycoContactCountStill(f->fe_surface, &f->pairs, start, &f->summary.n_still);
  for (PetscInt k = 0; !ierr && k < m; k++) {
    PetscCall(VecSetValue(f->D, k, f->gap[k], INSERT_VALUES));
    for (PetscInt j = start[k]; rows_changed && j < start[k + 1]; j++)
      PetscCall(MatSetValue(f->B, k, GlobalNode(f, dof[j] / dim) * dim + dof[j] % dim, value[j], INSERT_VALUES));
  }
  PetscCall(PetscFree3(start, dof, value));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AssembleContact(HycoFOM f, PetscBool rows_changed)
{
  PetscFunctionBegin;
  if (!f->n_contacts) { /* there may be obstacles whose nodes are all fixed */
    HycoOnRoot(HycoComm(f), HycoContactCountStill(f->fe_surface, &f->pairs, NULL, &f->summary.n_still));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (rows_changed && f->Bt && f->searches) { /* removes entries of former masters */
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
  PetscCall(MatDestroy(&f->Bt)); /* a rotated normal may have added an entry to B */
  PetscCall(MatTranspose(f->B, MAT_INITIAL_MATRIX, &f->Bt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CountFree(HycoFOM f)
{
  PetscInt mine = 0;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < f->part->n_nodes; i++) {
    for (PetscInt c = 0; HycoMeshOwned(f->part, i) >= 0 && c < f->fe->dim; c++)
      mine += !f->fe->fixed[i * f->fe->dim + c];
  }
  PetscCallMPI(MPI_Allreduce(&mine, &f->n_free, 1, MPIU_INT, MPI_SUM, HycoComm(f)));
  PetscCheck(f->n_free, HycoComm(f), PETSC_ERR_USER, "every displacement of the scene is fixed; remove a support");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the loads at the pinned unknowns, which belong to the balance. */
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

/* Searches for the masters on moved surfaces. Rank 0. */
static PetscErrorCode Move(HycoFOM f)
{
  PetscErrorCode ierr;

  PetscFunctionBegin;
  f->fe_surface->team = &f->team;
  ierr = HycoPairsMove(f->fe_surface, &f->pairs);
  f->fe_surface->team = NULL;
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMSetParameters(HycoFOM f, const PetscReal mu[])
{
  PetscFunctionBegin;
  HycoOnEach(HycoComm(f), HycoFESetParameters(f->fe, mu));
  if (f->size == 1) PetscFunctionReturn(PETSC_SUCCESS);
  if (f->fe->contact_changed) PetscCall(HycoFEAgreeOnMirrors(HycoComm(f), f->fe));
  HycoOnRoot(HycoComm(f), HycoFESetParameters(f->fe_surface, mu));
  if (f->rank == 0) PetscCall(PetscArraycpy(f->fe_surface->mirrored, f->fe->mirrored, f->scene->n_bodies));
  if (f->searches) HycoOnRootWithTeam(&f->team, Move(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMAssemble(HycoFOM f, const PetscReal mu[])
{
  PetscFunctionBegin;
  f->solved = f->given = f->sigma_ready = f->all_ready = PETSC_FALSE;
  PetscCall(HycoFOMSetParameters(f, mu));
  f->fe->ready = PETSC_FALSE; /* until everything that depends on it is assembled */
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
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, bounds, (PetscMPIInt)(2 * n), MPIU_REAL, MPI_MAX, HycoComm(f)));
  for (PetscInt p = 0; p < n; p++) {
    HycoCheck(bounds[p] == -bounds[n + p],
              "%s is %.10g on one rank and %.10g on another; all ranks need the same point", f->scene->parameter[p],
              (double)-bounds[n + p], (double)bounds[p]);
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

/* Of the rank with the largest part: its own unknowns, those of other ranks in its rows, and the number of these
   ranks. */
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
    PetscCall(PetscFindInt(f->part->node_global[i] * dim, f->size + 1, start, &rank));
    if (rank < 0) rank = -rank - 2; /* between two ranks' first unknowns */
    largest[2] += !neighbour[rank];
    neighbour[rank] = PETSC_TRUE;
  }
  PetscCall(PetscFree(neighbour));
  HycoAllreduce(largest, 3, MPIU_INT, MPI_MAX, HycoComm(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The ranks' shares of the searches for masters so far. Collective. */
static PetscErrorCode ViewSearch(HycoFOM f, PetscViewer viewer)
{
  PetscInt64 most = f->team.queries, all = f->team.queries;
  PetscInt patches[2] = {f->team.patches, f->team.whole};

  PetscFunctionBegin;
  HycoAllreduce(&most, 1, MPIU_INT64, MPI_MAX, HycoComm(f));
  HycoAllreduce(&all, 1, MPIU_INT64, MPI_SUM, HycoComm(f));
  HycoAllreduce(patches, 2, MPIU_INT, MPI_MAX, HycoComm(f));
  if (all)
    PetscCall(PetscViewerASCIIPrintf(viewer,
                                     "a rank: at most %lld of %lld searches for a master, on %d of %d patches\n",
                                     (long long)most, (long long)all, (int)patches[0], (int)patches[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMView(HycoFOM f, PetscViewer viewer)
{
  PetscInt largest[3] = {0, 0, 0};
  PetscBool ascii;

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  PetscCall(HycoViewBegin((PetscObject)f, &viewer, &ascii));
  if (!ascii) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscViewerASCIIPrintf(viewer, "%d nodes, %d cells, %d contacts, on %d ranks\n", (int)f->n_nodes,
                                   (int)f->n_cells, (int)f->n_contacts, (int)f->size));
  if (f->size > 1) {
    PetscCall(LargestPart(f, largest));
    PetscCall(PetscViewerASCIIPrintf(viewer, "a rank: at most %d unknowns of its own, %d of %d others\n",
                                     (int)largest[0], (int)largest[1], (int)largest[2]));
    PetscCall(ViewSearch(f, viewer));
  }
  PetscCall(HycoSystemView(f->system, viewer));
  PetscCall(HycoSolverView(f->solver, viewer));
  PetscCall(PetscViewerASCIIPopTab(viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineViewFromOptions(HycoFOM, HYCO_FOM_CLASSID)
