/* Halton's sequence (J. H. Halton, Numer. Math. 2 (1960) 84-90): a sequence of points that fills a cube evenly. */
#include <hycoalgorithms.h>

/* The j-th prime, from 0. */
static PetscInt HaltonPrime(PetscInt j)
{
  PetscInt n = 2;

  for (;; n++) {
    PetscInt d = 2;

    while (d * d <= n && n % d) d++;
    if (d * d > n && j-- == 0) return n;
  }
}

/* Entry j of the k-th point, in [0, 1): the digits of k in the j-th prime base, mirrored. */
PetscReal HycoHalton(PetscInt k, PetscInt j)
{
  const PetscInt base = HaltonPrime(j);
  PetscReal value = 0, share = 1;

  for (; k > 0; k /= base) {
    share /= (PetscReal)base;
    value += share * (PetscReal)(k % base);
  }
  return value;
}
