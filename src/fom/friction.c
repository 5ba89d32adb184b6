/*
  Friction at full order: the contact system with tangents beside the one without, and the state of the contacts in a
  checkpoint. The steps are those of any path with friction (path_friction.c). B is constant along a path, so that K is
  condensed onto it once.
*/
#include <hycofields.h>
#include <hycopath.h>
#include <hycosolverimpl.h>

/* For the pairs of f, whose number of contacts stays along a path. The solver is one for blocks with cones; the
   user's options come after it, so that they may replace the type. Collective. */
PetscErrorCode HycoFrictionCreate(HycoFOM f)
{
  HycoPath p = f->path;
  HycoPathContact *c = &p->other;

  PetscFunctionBegin;
  PetscCall(HycoContactStateCreate(p->comm, f->scene, &f->pairs, f->fe->dim, &p->friction));
  HycoVecDuplicate(p->friction->L, &c->Lambda, &c->D);
  PetscCall(HycoPathContactSetUp(c));
  PetscCall(HycoSystemCreate(p->comm, &c->system));
  PetscCall(HycoSolverCreate(p->comm, &c->solver));
  /* The cone of Coulomb is no set of bounds: neither active set nor TAO takes it. */
  PetscCall(HycoSolverSetType(c->solver, HYCO_SOLVER_SEMISMOOTH));
  PetscCall(HycoOptionsInherit((PetscObject)c->solver, (PetscObject)f));
  PetscCall(HycoSolverSetFromOptions(c->solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* B and its transpose anew. As many entries in a tangential row as in a normal one, hence the same room. */
static PetscErrorCode FillB(HycoFOM f, HycoPathContact *c, const HycoRows *rows)
{
  const PetscInt dim = f->fe->dim, entries = f->width * dim, *global = f->surface->node_global;
  PetscInt first, *column;

  PetscFunctionBegin;
  HycoDestroyAll(&c->B, &c->Bt);
  PetscCall(MatCreateAIJ(HycoComm(f), rows->n, f->part->n_owned * dim, PETSC_DETERMINE, f->n_nodes * dim, entries, NULL,
                         entries, NULL, &c->B));
  PetscCall(MatSetOption(c->B, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
  PetscCall(MatGetOwnershipRange(c->B, &first, NULL));
  PetscCall(PetscMalloc1(entries + 1, &column));
  for (PetscInt k = 0; k < rows->n; k++) {
    const PetscInt at = first + k, lo = rows->start[k], n = rows->start[k + 1] - lo;

    for (PetscInt j = 0; j < n; j++) {
      const PetscInt node = rows->dof[lo + j] / dim;

      /* From the unknowns of the surface's tables to those of the distributed vectors. */
      column[j] = (global ? global[node] : node) * dim + rows->dof[lo + j] % dim;
    }
    PetscCall(MatSetValues(c->B, 1, &at, n, column, rows->value + lo, INSERT_VALUES));
  }
  PetscCall(PetscFree(column));
  PetscCall(HycoMatAssemble(c->B));
  PetscCall(MatTranspose(c->B, MAT_INITIAL_MATRIX, &c->Bt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At each step: tangents turn with the surfaces of its begin, and gaps change with their displacements then; B changes
   only with the nodes of the contacts. */
static PetscErrorCode FOMFrictionAssemble(HycoFOM f, HycoPathContact *c, HycoRows *rows)
{
  PetscFunctionBegin;
  HycoOnEach(HycoComm(f), HycoContactStateRows(f->path->friction, f->fe_surface, rows));
  if (!c->B || f->fe->contact_changed) PetscCall(FillB(f, c, rows));
  PetscCall(HycoVecWrite(c->D, rows->n, rows->gap));
  PetscCall(HycoSystemSetMatrices(c->system, f->K, c->Bt, c->B, PETSC_TRUE));
  PetscCall(HycoSystemSetVectors(c->system, f->F, c->D));
  HycoSystemSetSoft(c->system, &f->soft);
  f->pairs.shear = &f->path->friction->shear;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFrictionAssemble(HycoFOM f)
{
  HycoRows rows = {0};

  PetscFunctionBegin;
  HycoFinally(FOMFrictionAssemble(f, HycoPathContactGet(f->path, PETSC_TRUE), &rows),
              PetscCall(HycoRowsDestroy(&rows)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The columns of a checkpoint: tangential force, slip, work and state of each contact. */
#define N_STATE 8
static PetscReal *FOMFrictionColumn(const HycoShear *s, PetscInt c, PetscInt *stride)
{
  *stride = c < 6 ? 3 : 1;
  return c < 3 ? s->force + c : c < 6 ? s->slip + (c - 3) : c < 7 ? s->work : s->state;
}

/* Each column in the order of one rank, so that a checkpoint resumes on any number of ranks. Collective. Slip and force
   at the begin of a step are the path's memory of friction. */
PetscErrorCode HycoFrictionSave(HycoFOM f, HycoH5 h)
{
  PetscReal *value;
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(f->pairs.n + 1, &value));
  for (PetscInt c = 0; c < N_STATE && !ierr; c++) {
    char name[32];
    PetscInt stride;
    /* Forces, slips, works and states of contacts in one list of columns. */
    const PetscReal *from = FOMFrictionColumn(&f->path->friction->shear, c, &stride);

    for (PetscInt k = 0; k < f->pairs.n; k++) value[k] = from[k * stride];
    PetscCall(PetscSNPrintf(name, sizeof(name), "friction/%d", (int)c));
    ierr = HycoContactsWrite(HycoComm(f), h, name, &f->pairs, f->n_contacts, MPIU_REAL, value);
  }
  PetscCall(PetscFree(value));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0 alone. The file is closed also after an error; columns that were read stay for the caller to free. */
static PetscErrorCode ReadColumns(HycoFOM f, PetscReal *value[N_STATE])
{
  HycoH5 h;
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  PetscCall(HycoH5OpenOr(f->path->checkpoint, "remove -hyco_resume", &h));
  for (PetscInt c = 0; c < N_STATE && !ierr; c++) {
    PetscInt rows = f->n_contacts, one = 1;
    char name[32];

    PetscCall(PetscSNPrintf(name, sizeof(name), "friction/%d", (int)c));
    /* Sizes are given, so that a checkpoint with other contacts is refused. */
    ierr = HycoH5LoadReal(h, name, &rows, &one, &value[c]);
  }
  PetscCall(HycoH5Close(&h, PETSC_FALSE));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From the order of one rank on rank 0 to the contacts of each rank, by way of Lambda, which is restored. */
static PetscErrorCode TakeColumns(HycoFOM f, PetscReal *const value[N_STATE])
{
  const PetscScalar *mine;
  Vec lambda;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(f->Lambda, &lambda));
  PetscCall(VecCopy(f->Lambda, lambda));
  for (PetscInt c = 0; c < N_STATE; c++) {
    PetscInt stride;
    PetscReal *to = FOMFrictionColumn(&f->path->friction->shear, c, &stride);

    /* Its scatter from rank 0 is the only one in the order of the contacts, hence the detour. */
    PetscCall(HycoFOMSetLambda(f, value[c]));
    PetscCall(VecGetArrayRead(f->Lambda, &mine));
    for (PetscInt k = 0; k < f->pairs.n; k++) to[k * stride] = mine[k];
    PetscCall(VecRestoreArrayRead(f->Lambda, &mine));
  }
  PetscCall(VecCopy(lambda, f->Lambda));
  PetscCall(VecDestroy(&lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The tangential components follow from the saved vectors of force and this run's tangents. Collective. */
PetscErrorCode HycoFrictionLoad(HycoFOM f)
{
  HycoPath p = f->path;
  HycoContactState s = p->friction;
  PetscReal *value[N_STATE] = {NULL};
  const PetscScalar *normal;
  PetscScalar *L;
  PetscReal most;

  PetscFunctionBegin;
  HycoOnRoot(HycoComm(f), ReadColumns(f, value));
  PetscCall(TakeColumns(f, value));
  for (PetscInt c = 0; c < N_STATE; c++) PetscCall(PetscFree(value[c]));
  PetscCall(VecGetArrayRead(f->Lambda, &normal));
  PetscCall(VecGetArray(s->L, &L));
  HycoContactStateForces(s, normal, s->shear.force, L);
  PetscCall(VecRestoreArray(s->L, &L));
  PetscCall(VecRestoreArrayRead(f->Lambda, &normal));
  PetscCall(VecCopy(s->L, HycoPathContactGet(p, PETSC_TRUE)->Lambda));
  PetscCall((*p->ops->surfaces)(p, s->u_old, &most));
  PetscFunctionReturn(PETSC_SUCCESS);
}
