/* The cones of contacts: the struct, and lists of blocks. */
#ifndef HYCOCONEIMPL_H
#define HYCOCONEIMPL_H

#include <hycocone.h>
#include <hycoimpl.h>

struct _p_HycoCone {
  PETSCHEADER(struct _HycoConeOps);
  PetscInt size, n_data; /* of a block: components, data */
  PetscBool nonnegative; /* trait: each component >= 0, so that every method and form of the library applies */
  void *data;
};

/* Blocks of rows, in their order: those of a rank, or all. */
typedef struct {
  PetscInt n_cones;
  HycoCone *cone; /* referenced */
  PetscInt n;     /* blocks */
  PetscInt *of;   /* n: the cone of each */
  PetscInt *row;  /* n + 1: its first row */
  PetscInt *at;   /* n + 1: its first entry in `data` */
  PetscReal *data;
} HycoBlocks;
/* Copies the arrays; references the cones. Fails for a number that is not that of a cone. Not collective. */
PetscErrorCode HycoBlocksCreate(PetscInt n_cones, const HycoCone cones[], PetscInt n, const PetscInt of[],
                                const PetscReal data[], HycoBlocks **blocks);
/* n blocks of one nonnegative force each. Not collective. */
PetscErrorCode HycoBlocksCreateNonnegative(PetscInt n, HycoBlocks **blocks);
/* NULL-safe. */
PetscErrorCode HycoBlocksDestroy(HycoBlocks **blocks);
/* The blocks of all ranks, by rank, on each of them. The caller destroys them. Collective. */
PetscErrorCode HycoBlocksGather(MPI_Comm comm, const HycoBlocks *blocks, HycoBlocks **all);
/* Of block k: z = P(y), its rows only. z is not y. */
PetscErrorCode HycoBlockProject(const HycoBlocks *blocks, PetscInt k, const PetscReal y[], PetscReal z[]);
/* Of block k: J = dP/dy, size x size row by row. */
PetscErrorCode HycoBlockDerivative(const HycoBlocks *blocks, PetscInt k, const PetscReal y[], PetscReal J[]);
/* r = P(r) on all rows. */
PetscErrorCode HycoBlocksAdmit(const HycoBlocks *blocks, PetscReal r[]);
/* The largest entries of the natural map at the forces r with w, z = P(r - rho w): missing [z_n - r_n]^+, map |z - r|,
   outside |P(r) - r|; in units of force. PETSC_MAX_REAL for values that are not finite. */
typedef struct {
  PetscReal missing, map, outside;
} HycoNaturalMap;
PetscErrorCode HycoBlocksNaturalMap(const HycoBlocks *blocks, PetscReal rho, const PetscReal r[], const PetscReal w[],
                                    HycoNaturalMap *map);

PetscErrorCode HycoConeCreate_Nonnegative(HycoCone cone);
PetscErrorCode HycoConeCreate_Coulomb(HycoCone cone);

#endif
