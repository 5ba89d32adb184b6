/* Facets of second order, which may be curved: private to contact/. */
#ifndef HYCO_CURVED_H
#define HYCO_CURVED_H
#include <hycomesh.h>

/* The nodes of a facet: its corners, the middles of its sides, of which the k-th follows the k-th corner, and perhaps
   the middle. A line has two corners. */
typedef struct {
  PetscInt nf, corners;
  const PetscReal *X[HYCO_FACET_NODES];
} HycoCurved;

/* The facet's point nearest to x, as weights of its nodes, of which some may be negative. Returns the squared
   distance. */
PetscReal HycoCurvedProject(const HycoCurved *facet, const PetscReal x[3], PetscReal weight[HYCO_FACET_NODES]);
/* A box that contains the facet; for straight sides that of its corners. */
void HycoCurvedBox(const HycoCurved *facet, PetscReal lo[3], PetscReal hi[3]);

#endif
