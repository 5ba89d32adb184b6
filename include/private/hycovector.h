/* Vectors of three components. */
#ifndef HYCOVECTOR_H
#define HYCOVECTOR_H
#include <petscmath.h>

/* -- begin: in exported models too -- */
static inline PetscReal HycoDot(const PetscReal a[3], const PetscReal b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
static inline PetscReal HycoLength(const PetscReal a[3])
{
  return PetscSqrtReal(HycoDot(a, a));
}
static inline PetscReal HycoDistance(const PetscReal a[3], const PetscReal b[3])
{
  const PetscReal d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};

  return HycoLength(d);
}
/* Scales to unit length; 0 stays 0. */
static inline void HycoNormalise(PetscReal v[3])
{
  const PetscReal length = HycoLength(v);

  for (PetscInt c = 0; c < 3 && length > 0; c++) v[c] /= length;
}
/* The length of the component of r tangential to the surface with normal n. */
static inline PetscReal HycoTangentialLength(const PetscReal r[3], const PetscReal n[3])
{
  const PetscReal height = HycoDot(r, n);
  const PetscReal t[3] = {r[0] - height * n[0], r[1] - height * n[1], r[2] - height * n[2]};

  return HycoLength(t);
}
/* w times the normal of a facet with the tangents t. */
static inline void HycoFacetCross(const PetscReal t[2][3], PetscReal w, PetscReal n[3])
{
  for (PetscInt c = 0; c < 3; c++) {
    const PetscInt d = (c + 1) % 3, e = (c + 2) % 3;

    n[c] = w * (t[0][d] * t[1][e] - t[0][e] * t[1][d]);
  }
}
/* -- end: in exported models too -- */

#endif
