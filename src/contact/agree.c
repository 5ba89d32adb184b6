/* What the ranks must decide together about the contacts that each has found for its own slaves. */
#include <hycocontactimpl.h>

/* Whether a master node has two contacts of the contact number c. Collective. */
static PetscErrorCode IsShared(MPI_Comm comm, HycoMesh part, HycoMesh m, const HycoPairs *p, PetscInt c,
                               PetscBool *shared)
{
  PetscInt *count, *all;
  PetscSF sf;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(m->n_nodes, &count, part->n_owned, &all));
  for (PetscInt k = 0; k < p->n; k++) {
    /* At this rank's copies; the star forest adds those of all ranks at the owner. */
    for (PetscInt j = p->master_start[k]; p->contact[k] == c && j < p->master_start[k + 1]; j++) count[p->master[j]]++;
  }
  PetscCall(HycoMeshNodeSF(comm, part, m->n_nodes, m->node_global, &sf));
  PetscCall(PetscSFReduceBegin(sf, MPIU_INT, count, all, MPI_SUM));
  PetscCall(PetscSFReduceEnd(sf, MPIU_INT, count, all, MPI_SUM));
  PetscCall(PetscSFDestroy(&sf));
  *shared = PETSC_FALSE;
  for (PetscInt i = 0; i < part->n_owned; i++) *shared = (PetscBool)(*shared || all[i] > 1);
  PetscCall(PetscFree2(count, all));
  HycoAllreduce(shared, 1, HYCO_MPI_BOOL, MPI_LOR, comm);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the contacts that the ranks have found for their own slaves are those of a search on one rank: every contact
   of the scene has slaves, one with drawn masters has at least one master, and pairs are one to one. If not, the caller
   searches on one rank, which reports the error. Collective. Counts alone, since a rank cannot know what another one
   would have found. */
PetscErrorCode HycoContactsSynchronise(MPI_Comm comm, HycoScene scene, HycoMesh part, HycoMesh surface,
                                       const HycoPairs *p, PetscBool *agreed)
{
  PetscInt *n; /* by contact of the scene: all, those with a master */

  PetscFunctionBegin;
  *agreed = PETSC_TRUE;
  PetscCall(PetscCalloc1(2 * scene->n_contacts, &n));
  for (PetscInt k = 0; k < p->n; k++) {
    n[2 * p->contact[k]]++;
    n[2 * p->contact[k] + 1] += p->master_start[k + 1] > p->master_start[k];
  }
  HycoAllreduce(n, 2 * scene->n_contacts, MPIU_INT, MPI_SUM, comm);
  for (PetscInt c = 0; c < scene->n_contacts; c++) {
    const HycoContact contact = scene->contact[c];
    PetscBool shared = PETSC_FALSE;

    /* Two ranks may have given one master to different slaves, which neither sees alone. */
    if (contact->matched) PetscCall(IsShared(comm, part, surface, p, c, &shared));
    if (!n[2 * c] || (contact->master && !HycoPairsFollows(p, c) && !n[2 * c + 1]) || shared) *agreed = PETSC_FALSE;
  }
  PetscCall(PetscFree(n));
  PetscFunctionReturn(PETSC_SUCCESS);
}
