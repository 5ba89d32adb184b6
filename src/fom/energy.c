/*
  The energies of a full-order solution, and their identity. With the whole stiffness (no unknown eliminated), loads F,
  support reactions R and the gap D as drawn, K U = F + R - B^T L and L_i (D - B U)_i = 0 give

    2 W = F.U + R.u0 - L.D

  With thermal strains, F includes their nodal forces, and their own work is added: HycoFEHeatWork().

  W is computed from the stresses, the work from F and the element matrices, so that an error in one of them is visible.
*/
#include <hycofomimpl.h>

/* F.U over this rank's free unknowns; F includes the lifting -K u0 of the prescribed displacements, which is added
   back below. */
static PetscErrorCode FreeWork(HycoFOM f, PetscReal *work)
{
  const PetscInt dim = f->part->dim;
  const PetscScalar *F, *u;

  PetscFunctionBegin;
  *work = 0;
  PetscCall(VecGetArrayRead(f->F, &F));
  PetscCall(VecGetArrayRead(f->U_local, &u));
  for (PetscInt i = 0; i < f->part->n_nodes; i++) {
    const PetscInt row = HycoMeshOwned(f->part, i);

    for (PetscInt c = 0; row >= 0 && c < dim; c++) {
      /* Rows of fixed unknowns have K_ii u0_i in F, which is no load. */
      if (!f->fe->fixed[i * dim + c]) *work += F[row * dim + c] * u[i * dim + c];
    }
  }
  PetscCall(VecRestoreArrayRead(f->F, &F));
  PetscCall(VecRestoreArrayRead(f->U_local, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* u0.K (2 u - u0) of one cell, as far as this rank counts it: u0.K (u - u0), removed from F.U by the lifting, and the
 * elastic part u0.K u of R.u0. */
static PetscErrorCode LiftingWork(HycoFE fe, PetscInt cell, const PetscReal u[], PetscReal *work)
{
  HycoMesh m = fe->mesh;
  PetscInt node[HYCO_MAX_CELL_NODES];
  const PetscInt n = m->dim * HycoMeshCellNodes(m, cell, node);
  PetscReal *Ke;
  PetscBool any = PETSC_FALSE;

  PetscFunctionBegin;
  *work = 0;
  for (PetscInt k = 0; k < n; k++) any = (PetscBool)(any || fe->u0[node[k / m->dim] * m->dim + k % m->dim] != 0);
  if (!any) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoFEElementRoom(fe, cell, &Ke));
  PetscCall(HycoFECountedStiffness(fe, cell, Ke));
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal u0 = fe->u0[node[k / m->dim] * m->dim + k % m->dim];

    for (PetscInt j = 0; u0 != 0 && j < n; j++) {
      const PetscInt dof = node[j / m->dim] * m->dim + j % m->dim;

      /* u0 of oblique supports and ties are offsets: Ke is that of the eliminated unknowns. */
      *work += u0 * Ke[k * n + j] * (2 * (fe->fixed[dof] ? fe->u0[dof] : u[dof]) - fe->u0[dof]);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sums strain energy, lifting and thermal work over what this rank counts: the cells whose first node it owns, its
   springs. */
static PetscErrorCode CellSums(HycoFOM f, PetscReal *strain, PetscReal *lifting)
{
  const PetscScalar *u;
  PetscReal *each, *heat = NULL, one;

  PetscFunctionBegin;
  *lifting = 0;
  PetscCall(PetscMalloc1(f->part->n_cells, &each));
  PetscCall(VecGetArrayRead(f->U_local, &u));
  PetscCall(HycoFEEnergy(f->fe, u, each));
  *strain = HycoSpringsEnergy(f->fe, u);
  if (f->fe->thermal) {
    PetscCall(PetscMalloc1(f->part->n_cells, &heat));
    PetscCall(HycoFEHeatWork(f->fe, u, heat));
  }
  for (PetscInt e = 0; e < f->part->n_cells; e++) {
    /* For all cells here: those of other owners may have springs that this rank counts. */
    PetscCall(LiftingWork(f->fe, e, u, &one));
    *lifting += one;
    if (HycoMeshOwned(f->part, f->part->cells[e * f->part->nv]) < 0) continue;
    *strain += each[e];
    if (heat) *lifting += heat[e];
  }
  PetscCall(PetscFree(heat));
  PetscCall(VecRestoreArrayRead(f->U_local, &u));
  PetscCall(PetscFree(each));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of this rank's contacts: L.D with the gap as drawn, and the work of contacts on fixed unknowns, L.(B u0) over
   those. The difference of the two gaps is what fixed unknowns have moved to D. */
static PetscErrorCode ContactSums(HycoFOM f, PetscReal *gap_work, PetscReal *fixed_work)
{
  PetscReal *normal, *gap;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(3 * f->pairs.n, &normal, f->pairs.n, &gap));
  PetscCall(HycoContactGeometry(f->fe_surface, &f->pairs, normal, gap));
  *gap_work = *fixed_work = 0;
  for (PetscInt k = 0; k < f->pairs.n; k++) {
    *gap_work += f->lambda[k] * gap[k];
    /* f->gap is D, from which B u0 of fixed unknowns is taken away. */
    *fixed_work += f->lambda[k] * (gap[k] - f->gap[k]);
  }
  PetscCall(PetscFree2(normal, gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sum of K_ii U_i^2, to detect an energy that is a small difference. The strain energy of a nearly rigid motion is far
   below it, and has that much fewer digits. */
static PetscErrorCode NodalEnergy(HycoFOM f, PetscReal *sum)
{
  Vec work;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(f->U, &work));
  PetscCall(MatGetDiagonal(f->K, work));
  PetscCall(VecPointwiseMult(work, work, f->U));
  PetscCall(VecDot(work, f->U, sum));
  PetscCall(VecDestroy(&work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* 2 W, the works and the defect of their identity relative to the largest of the three, from stresses, loads and
   contact forces. The defect is independent of the solver. Collective. */
PetscErrorCode HycoFOMEnergy(HycoFOM f, HycoSummary *s)
{
  PetscReal mine[4] = {0, 0, 0, 0}, all[4], free_work = 0, lifting = 0, nodal, largest;

  PetscFunctionBegin;
  PetscCall(FreeWork(f, &free_work));
  PetscCall(CellSums(f, &mine[0], &lifting));
  /* Gaps at the current parameters: they may fail where the search fails. */
  HycoOnEach(HycoComm(f), ContactSums(f, &mine[2], &mine[3]));
  mine[1] = free_work + lifting;
  PetscCallMPI(MPI_Allreduce(mine, all, 4, MPIU_REAL, MPI_SUM, HycoComm(f)));
  s->strain_energy = all[0];
  /* Loads on free unknowns, supports by the lifting, and moving obstacles. */
  s->external_work = all[1] + all[3];
  s->gap_work = all[2];
  largest = PetscMax(PetscMax(2 * s->strain_energy, PetscAbsReal(s->external_work)), PetscAbsReal(s->gap_work));
  PetscCall(NodalEnergy(f, &nodal));
  largest = PetscMax(largest, 1e-6 * nodal); /* the energy of a body that only moves rigidly is round-off */
  s->energy_defect = PetscAbsReal(2 * s->strain_energy - s->external_work + s->gap_work);
  if (largest > 0) s->energy_defect /= largest;
  PetscFunctionReturn(PETSC_SUCCESS);
}
