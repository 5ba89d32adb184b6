/* The forces of a cell's thermal and inelastic strains. */
#include <hycoinelasticforces.h>
#include <hycokinematics.h>

#define ROUNDING 256 /* units of round-off in sums of a cell's forces */

PetscErrorCode HycoInelasticCellHeat(HycoFE fe, PetscInt e, PetscReal heat[])
{
  PetscFunctionBegin;
  PetscCall(PetscArrayzero(heat, fe->mesh->nv * fe->mesh->dim));
  if (fe->scene->body[fe->mesh->cell_body[e]].expansion) PetscCall(HycoCellHeat(fe, e, heat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoInelasticCellForce(HycoFE fe, PetscInt e, const PetscReal Ke[], const PetscReal heat[],
                                      const PetscReal u[], HycoFEState state, PetscReal q[], PetscReal *summands)
{
  HycoMesh m = fe->mesh;
  const PetscInt n = m->nv * m->dim;
  PetscReal f[HYCO_MAX_CELL_DOFS], most = 0, size = 0;

  PetscFunctionBegin;
  PetscCall(HycoFEStateForce(fe, state, e, f));
  for (PetscInt i = 0; i < n; i++) {
    PetscReal sum = PetscAbsReal(heat[i]);

    q[i] = -heat[i] - f[i];
    for (PetscInt j = 0; j < n; j++) {
      const PetscReal part = Ke[i * n + j] * u[HycoCellUnknown(m, e, j)];

      q[i] += part;
      sum += PetscAbsReal(part);
    }
    most = PetscMax(most, PetscAbsReal(q[i]));
    size = PetscMax(size, sum);
  }
  if (most <= ROUNDING * PETSC_MACHINE_EPSILON * size) PetscCall(PetscArrayzero(q, n));
  if (summands) *summands = size;
  PetscFunctionReturn(PETSC_SUCCESS);
}
