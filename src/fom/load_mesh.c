/*
  The mesh of a scene: its file on rank 0 with its ties, PETSc's HDF5 format by all ranks, or the DM of a calling
  program. Ties are found by the search for the masters of contacts.
*/
#include <hycocontactimpl.h>

/* Ties must be found in the mesh file, before it is refined or distributed. A tied node's masters are found by
   positions, which a DMPlex from another program need not have in this form. */
static PetscErrorCode CheckTies(HycoScene scene)
{
  size_t length;

  PetscFunctionBegin;
  if (!scene->n_ties) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscStrlen(scene->mesh_path, &length));
  /* A DMPlex in memory, or PETSc's file of one. */
  HycoCheck(!scene->dm && (length < 3 || strcmp(scene->mesh_path + length - 3, ".h5")),
            "tie %s: ties need the mesh as a gmsh file, not as a DMPlex", scene->tie[0].name);
  HycoCheck(!scene->refine, "tie %s: scene_refine cannot refine a mesh with ties; refine the file (gmsh -refine)",
            scene->tie[0].name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0. Degenerate facets would give misleading errors of the tie search. */
static PetscErrorCode ReadMesh(HycoScene scene, HycoMesh *mesh)
{
  HycoTies ties = NULL;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoMeshRead(scene, mesh));
  if (!scene->n_ties) PetscFunctionReturn(PETSC_SUCCESS);
  ierr = HycoMeshCheckCells(*mesh);
  if (!ierr) ierr = HycoTiesFind(scene, *mesh, &ties);
  if (!ierr) ierr = HycoMeshSetTies(*mesh, ties);
  PetscCall(HycoTiesDestroy(&ties));
  /* The caller has no handle to free after an error. */
  if (ierr) PetscCall(HycoMeshDestroy(mesh));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The DM of the scene, with tags and labels; a file's DM is on rank 0, an HDF5 one is not yet balanced. Collective. */
PetscErrorCode HycoMeshLoad(MPI_Comm comm, HycoScene scene, DM *dm)
{
  HycoMesh mesh = NULL;
  size_t length;

  PetscFunctionBegin;
  PetscCall(CheckTies(scene));
  if (scene->dm) {
    int same;

    PetscCallMPI(MPI_Comm_compare(comm, HycoComm(scene->dm), &same));
    HycoCheck(same == MPI_IDENT || same == MPI_CONGRUENT,
              "the scene's DM lives on other processes than the model; for training give -hyco_groups 1");
    /* The tags that HycoPlexComplete() composes belong to the clone; the caller's DM stays without. */
    PetscCall(DMClone(scene->dm, dm));
    PetscCall(HycoPlexComplete(*dm));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscStrlen(scene->mesh_path, &length));
  if (length > 3 && strcmp(scene->mesh_path + length - 3, ".h5") == 0) {
    PetscCall(HycoPlexRead(comm, scene->mesh_path, dm));
    PetscCall(HycoPlexComplete(*dm));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  HycoOnRoot(comm, ReadMesh(scene, &mesh));
  PetscCall(HycoPlexFromMesh(comm, mesh, dm));
  if (mesh) PetscCall(HycoMeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Local tables of the mesh without its distribution: for programs on one rank. Collective. Refined as the scene says,
   like every mesh of a model. */
PetscErrorCode HycoMeshCreate(MPI_Comm comm, HycoScene scene, HycoMesh *mesh)
{
  DM dm;

  PetscFunctionBegin;
  PetscCall(HycoMeshLoad(comm, scene, &dm));
  PetscCall(HycoPlexRefine(&dm, scene, scene->refine));
  PetscCall(HycoPlexToMesh(dm, scene, mesh));
  PetscCall(DMDestroy(&dm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Everything that reading checks, without a model: the mesh is made and dropped. Collective. */
PetscErrorCode HycoSceneCheckMesh(MPI_Comm comm, HycoScene scene)
{
  HycoMesh mesh;

  PetscFunctionBegin;
  HycoCheckHandle(scene, HYCO_SCENE_CLASSID);
  PetscCall(HycoMeshCreate(comm, scene, &mesh));
  PetscCall(HycoMeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}
