/* Given gaps whose sign is probably wrong: a contact that overlaps everywhere, and deeply. */
#include "surface_normals.h"

/* Of a body's extent, an overlap at every node: parts are fitted with interferences of 0.05 to 0.3 % of their diameter,
   and metals yield beyond; 1 % is hardly meant, while a clearance of this size is common. */
#define LARGE_OVERLAP 0.01

/* The extents of the bodies (the diagonals of their boxes) at the present positions, over all ranks. */
static PetscErrorCode OverlapBodySizes(MPI_Comm comm, HycoFE fe, PetscReal extent[])
{
  const PetscInt n = fe->scene->n_bodies;
  PetscReal *box;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(6 * n, &box));
  for (PetscInt k = 0; k < 6 * n; k++) box[k] = -PETSC_MAX_REAL;
  for (PetscInt i = 0; i < fe->mesh->n_nodes; i++) {
    PetscReal *of = box + 6 * fe->mesh->node_body[i];

    for (PetscInt c = 0; c < 3; c++) {
      of[c] = PetscMax(of[c], fe->X[3 * i + c]);
      of[3 + c] = PetscMax(of[3 + c], -fe->X[3 * i + c]);
    }
  }
  HycoAllreduce(box, 6 * n, MPIU_REAL, MPI_MAX, comm);
  for (PetscInt b = 0; b < n; b++) {
    const PetscReal *of = box + 6 * b;

    extent[b] = PetscSqrtReal(PetscSqr(of[0] + of[3]) + PetscSqr(of[1] + of[4]) + PetscSqr(of[2] + of[5]));
  }
  PetscCall(PetscFree(box));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For each contact of the scene: its largest gap, and minus the smallest extent of its bodies. */
static void OverlapGather(HycoFE fe, const HycoPairs *p, const PetscReal gap[], const PetscReal extent[],
                          PetscReal most[])
{
  HycoMesh m = fe->mesh;

  for (PetscInt k = 0; k < p->n; k++) {
    PetscReal *of = most + 2 * p->contact[k];

    if (HycoPairsAlone(fe->scene, p, k)) continue;
    of[0] = PetscMax(of[0], gap[k]);
    of[1] = PetscMax(of[1], -extent[m->node_body[p->slave[k]]]);
    for (PetscInt j = p->master_start[k]; j < p->master_start[k + 1]; j++)
      of[1] = PetscMax(of[1], -extent[m->node_body[p->master[j]]]);
  }
}

/* By the smallest overlap of a contact, not the largest: a rounded obstacle may reach deep at one node. */
PetscErrorCode HycoContactInitialOverlap(MPI_Comm comm, HycoFE fe, HycoFE surface, const HycoPairs *pairs,
                                         const PetscReal gap[], PetscReal share[])
{
  HycoScene s = fe->scene;
  PetscReal *extent, *most;
  PetscBool any = PETSC_FALSE;

  PetscFunctionBegin;
  for (PetscInt c = 0; c < s->n_contacts; c++) {
    share[c] = 0;
    any = (PetscBool)(any || (s->contact[c]->gap && !s->contact[c]->ops->gap));
  }
  /* Drawn overlaps are refused elsewhere, by the size of facets. */
  if (!any) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc2(s->n_bodies, &extent, 2 * s->n_contacts, &most));
  for (PetscInt k = 0; k < 2 * s->n_contacts; k++) most[k] = -PETSC_MAX_REAL;
  PetscCall(OverlapBodySizes(comm, fe, extent));
  OverlapGather(surface, pairs, gap, extent, most);
  HycoAllreduce(most, 2 * s->n_contacts, MPIU_REAL, MPI_MAX, comm);
  for (PetscInt c = 0; c < s->n_contacts; c++) {
    const PetscReal *of = most + 2 * c;

    if (!s->contact[c]->gap || s->contact[c]->ops->gap || of[0] == -PETSC_MAX_REAL || !(of[1] < 0)) continue;
    if (of[0] < LARGE_OVERLAP * of[1]) share[c] = of[0] / of[1];
  }
  PetscCall(PetscFree2(extent, most));
  PetscFunctionReturn(PETSC_SUCCESS);
}
