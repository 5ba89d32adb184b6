/* A mesh of your own: a DMPlex with labels in place of a mesh file. Here it is PETSc's box, as its options define it.

     build/ladder/dmplex SCENE -dm_plex_dim 2 -dm_plex_simplex 0 -dm_plex_box_faces 8,8
*/
#include <hyco.h>
#include <petscdmplex.h>

/* A label from one of the box's sides; DMPlex numbers them in "Face Sets". */
static PetscErrorCode NameSide(DM dm, PetscInt side, const char name[])
{
  DMLabel sides, label;
  IS facets;

  PetscFunctionBegin;
  PetscCall(DMCreateLabel(dm, name));
  PetscCall(DMGetLabel(dm, name, &label));
  PetscCall(DMGetLabel(dm, "Face Sets", &sides));
  PetscCall(DMLabelGetStratumIS(sides, side, &facets));
  if (facets) PetscCall(DMLabelSetStratumIS(label, 1, facets));
  PetscCall(ISDestroy(&facets));
  PetscFunctionReturn(0);
}

/* The box with its body "block" and sides "low" and "high" (the last axis), "left" and "right" (the first). */
static PetscErrorCode CreateMesh(DM *dm)
{
  PetscInt dim, first, last;

  PetscFunctionBegin;
  PetscCall(DMCreate(PETSC_COMM_WORLD, dm));
  PetscCall(DMSetType(*dm, DMPLEX));
  PetscCall(DMSetFromOptions(*dm)); /* also distributes it */
  PetscCall(DMGetDimension(*dm, &dim));
  PetscCall(DMCreateLabel(*dm, "block"));
  PetscCall(DMPlexGetHeightStratum(*dm, 0, &first, &last));
  for (PetscInt cell = first; cell < last; cell++) PetscCall(DMSetLabelValue(*dm, "block", cell, 1));
  PetscCall(NameSide(*dm, 1, "low"));
  PetscCall(NameSide(*dm, dim == 2 ? 3 : 2, "high"));
  PetscCall(NameSide(*dm, dim == 2 ? 4 : 6, "left"));
  PetscCall(NameSide(*dm, dim == 2 ? 2 : 5, "right"));
  PetscFunctionReturn(0);
}

static PetscErrorCode Run(const char *path)
{
  DM dm;
  HycoScene scene;
  HycoFOM fom;
  HycoSummary s;

  PetscFunctionBegin;
  PetscCall(CreateMesh(&dm));
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, path, &scene)); /* a scene without an entry mesh: */
  PetscCall(HycoSceneSetDM(scene, dm));
  PetscCall(DMDestroy(&dm)); /* the scene holds a reference */
  PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, scene, &fom));
  PetscCall(HycoFOMSolve(fom, 0, NULL));
  PetscCall(HycoFOMGetSummary(fom, &s));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s: %d unknowns, contact force %.10g, energy %.10g\n",
                        HycoReasonName(s.reason), (int)s.n_dof, (double)s.total_contact_force,
                        (double)s.strain_energy));
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscCall(HycoInitialize(&argc, &argv));
  PetscCheck(argc > 1, PETSC_COMM_WORLD, PETSC_ERR_USER, "usage: dmplex SCENE -dm_plex_dim 2 -dm_plex_box_faces 8,8");
  PetscCall(Run(argv[1]));
  return (int)HycoFinalize();
}
