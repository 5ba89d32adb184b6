/* Blocks of the rows of a contact system, each with a cone and its data. */
#include <hycoconeimpl.h>

/* The blocks' cones must be usable here; `of` NULL: all blocks have the first one. */
static PetscErrorCode BlocksCheck(PetscInt n_cones, const HycoCone cones[], PetscInt n, const PetscInt of[])
{
  PetscFunctionBegin;
  PetscCheck(n_cones >= 1 && n >= 0, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
             "%d cones and %d blocks; there must be a cone, and no negative number of blocks", (int)n_cones, (int)n);
  for (PetscInt c = 0; c < n_cones; c++) {
    HycoCheckHandle(cones[c], HYCO_CONE_CLASSID);
    PetscCheck(cones[c]->ops->project, PETSC_COMM_SELF, PETSC_ERR_ORDER,
               "cone %d has no type; call HycoConeSetType() before HycoSystemSetBlocks()", (int)c);
  }
  for (PetscInt k = 0; of && k < n; k++)
    PetscCheck(of[k] >= 0 && of[k] < n_cones, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
               "block %d has cone %d; cones are 0 to %d", (int)k, (int)of[k], (int)n_cones - 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Blocks of consecutive rows: block k has the cone of[k] (NULL: the first) and its data; copies the data, and refers
   to the cones. */
PetscErrorCode HycoBlocksCreate(PetscInt n_cones, const HycoCone cones[], PetscInt n, const PetscInt of[],
                                const PetscReal data[], HycoBlocks **blocks)
{
  HycoBlocks *b;

  PetscFunctionBegin;
  PetscCall(BlocksCheck(n_cones, cones, n, of));
  PetscCall(PetscNew(&b));
  HycoDuplicate(n_cones, cones, &b->cone);
  b->n_cones = n_cones;
  b->n = n;
  for (PetscInt c = 0; c < n_cones; c++) PetscCall(PetscObjectReference((PetscObject)cones[c]));
  PetscCall(PetscCalloc3(n + 1, &b->of, n + 1, &b->row, n + 1, &b->at));
  for (PetscInt k = 0; k < n; k++) {
    b->of[k] = of ? of[k] : 0;
    b->row[k + 1] = b->row[k] + cones[b->of[k]]->size;
    /* Data of a block, as a coefficient of friction, begin at at[k]. */
    b->at[k + 1] = b->at[k] + cones[b->of[k]]->n_data;
  }
  PetscCall(PetscMalloc1(b->at[n] + 1, &b->data));
  if (b->at[n]) PetscCall(PetscArraycpy(b->data, data, b->at[n]));
  *blocks = b;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The blocks of the ordinary problem: one row each, force >= 0. So that one Newton method serves problems with and
   without friction. */
PetscErrorCode HycoBlocksCreateNonnegative(PetscInt n, HycoBlocks **blocks)
{
  HycoCone cone;

  PetscFunctionBegin;
  PetscCall(HycoConeCreate(PETSC_COMM_SELF, &cone));
  PetscCall(HycoConeSetType(cone, HYCO_CONE_NONNEGATIVE));
  PetscCall(HycoBlocksCreate(1, &cone, n, NULL, NULL, blocks));
  PetscCall(HycoConeDestroy(&cone));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The cones by reference; NULL-safe. */
PetscErrorCode HycoBlocksDestroy(HycoBlocks **blocks)
{
  HycoBlocks *b = *blocks;

  PetscFunctionBegin;
  if (!b) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt c = 0; c < b->n_cones; c++) PetscCall(HycoConeDestroy(&b->cone[c]));
  PetscCall(PetscFree3(b->of, b->row, b->at));
  HycoFreeAll(&b->cone, &b->data, blocks);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All ranks' blocks on every rank, in the order of the ranks, for the dense problem. Collective. */
PetscErrorCode HycoBlocksGather(MPI_Comm comm, const HycoBlocks *b, HycoBlocks **all)
{
  PetscInt n, n_data, *of;
  PetscReal *data;

  PetscFunctionBegin;
  PetscCall(HycoConcatenateAll(comm, b->n, b->of, MPIU_INT, sizeof(PetscInt), &n, &of));
  PetscCall(HycoConcatenateAll(comm, b->at[b->n], b->data, MPIU_REAL, sizeof(PetscReal), &n_data, &data));
  PetscCall(HycoBlocksCreate(b->n_cones, b->cone, n, of, data, all));
  HycoFreeAll(&of, &data);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* z = P(y) of block k, whose data (a coefficient of friction, for instance) belong to it and not to its cone. */
PetscErrorCode HycoBlockProject(const HycoBlocks *b, PetscInt k, const PetscReal y[], PetscReal z[])
{
  const HycoCone cone = b->cone[b->of[k]];

  PetscFunctionBegin;
  PetscCall((*cone->ops->project)(cone, b->data + b->at[k], y, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* J: size x size, row by row. */
PetscErrorCode HycoBlockDerivative(const HycoBlocks *b, PetscInt k, const PetscReal y[], PetscReal J[])
{
  const HycoCone cone = b->cone[b->of[k]];

  PetscFunctionBegin;
  PetscCall((*cone->ops->derivative)(cone, b->data + b->at[k], y, J));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces r by the nearest admissible forces, block by block. Whatever a method has left by round-off: reported forces
   obey the law exactly. */
PetscErrorCode HycoBlocksAdmit(const HycoBlocks *b, PetscReal r[])
{
  PetscReal z[HYCO_MAX_BLOCK];

  PetscFunctionBegin;
  for (PetscInt k = 0; k < b->n; k++) {
    PetscCall(HycoBlockProject(b, k, r + b->row[k], z));
    PetscCall(PetscArraycpy(r + b->row[k], z, b->row[k + 1] - b->row[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* max(most, value); a value that is not finite is the largest. */
static PetscReal BlocksMaximum(PetscReal most, PetscReal value)
{
  return value <= PETSC_MAX_REAL ? PetscMax(most, value) : PETSC_MAX_REAL;
}

/* Largest entries of the residual P(r - rho w) - r of the law: of all components, of the missing normal force, and of
   what makes r itself inadmissible. Not collective. r solves the problem exactly if r = P(r - rho w) (Eaves 1971), for
   any rho > 0. */
PetscErrorCode HycoBlocksNaturalMap(const HycoBlocks *b, PetscReal rho, const PetscReal r[], const PetscReal w[],
                                    HycoNaturalMap *map)
{
  PetscReal y[HYCO_MAX_BLOCK], z[HYCO_MAX_BLOCK], own[HYCO_MAX_BLOCK];

  PetscFunctionBegin;
  *map = (HycoNaturalMap){0, 0, 0};
  for (PetscInt k = 0; k < b->n; k++) {
    const PetscInt first = b->row[k], size = b->row[k + 1] - first;

    for (PetscInt i = 0; i < size; i++) y[i] = r[first + i] - rho * w[first + i];
    PetscCall(HycoBlockProject(b, k, y, z));
    PetscCall(HycoBlockProject(b, k, r + first, own));
    /* The first component is the normal force: by how much the law would raise it, where contacts penetrate. */
    map->missing = BlocksMaximum(map->missing, z[0] - r[first]);
    for (PetscInt i = 0; i < size; i++) {
      map->map = BlocksMaximum(map->map, PetscAbsReal(z[i] - r[first + i]));
      map->outside = BlocksMaximum(map->outside, PetscAbsReal(own[i] - r[first + i]));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
