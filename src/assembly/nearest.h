/* The nearest point of a surface as drawn: private to assembly/. */
#ifndef HYCO_NEAREST_H
#define HYCO_NEAREST_H
#include <hycomesh.h>

/* A point of a patch: sum of weight[a] times node[a]. Weights are positive and sum to 1; nodes ascend. */
typedef struct {
  PetscInt n, node[4];
  PetscReal weight[4], distance;
} HycoProjection;

typedef struct _n_HycoPatches *HycoPatches;

/* n patches of nf nodes each: 1 points, 2 segments, 3 triangles, 4 bilinear quadrilaterals. node (n x nf) is borrowed.
   The caller destroys it. */
PetscErrorCode HycoPatchesCreate(HycoMesh mesh, PetscInt n, PetscInt nf, const PetscInt node[], HycoPatches *patches);
PetscErrorCode HycoPatchesDestroy(HycoPatches *patches);
/* The patches' point nearest to x; of equally near ones that of the first patch. */
void HycoPatchesProject(HycoPatches patches, const PetscReal x[3], HycoProjection *p);

#endif
