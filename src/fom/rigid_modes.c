/*
  Rigid motions and K: the motions that the supports leave free are its null space, so that the solver can prevent them
  by contact; all rigid motions are the near-null space for an algebraic multigrid.

  Motions that contact does not prevent either are refused, or released (-hyco_regularise): as many unknowns are pinned
  like supports, the contacts' normals are turned so that these motions stay tangential, and the loads' remaining work
  on them, which must be small, is removed. Then the pins carry no force, and the solution is that of the free body up
  to these motions, which are removed from it.
*/
#include <hycofomimpl.h>
#include <limits.h>
#include <string.h>

/* The motions as distributed vectors; the caller destroys them by VecDestroyVecs(). Collective. */
PetscErrorCode HycoFOMMotionVectors(HycoFOM f, const HycoMotions *motions, Vec **v)
{
  const PetscInt dim = f->fe->dim;

  PetscFunctionBegin;
  /* In the layout of displacements, as PETSc's null space and products with F need them. */
  PetscCall(VecDuplicateVecs(f->U, motions->n, v));
  for (PetscInt k = 0; k < motions->n; k++) {
    const PetscReal *motion = motions->motion + (size_t)k * (size_t)f->fe->n_dof;
    PetscScalar *own;

    PetscCall(VecGetArray((*v)[k], &own));
    for (PetscInt i = 0; i < f->part->n_nodes; i++) {
      const PetscInt at = HycoMeshOwned(f->part, i);

      /* Each node's motion from its owner. */
      if (at >= 0) PetscCall(PetscArraycpy(own + at * dim, motion + i * dim, dim));
    }
    PetscCall(VecRestoreArray((*v)[k], &own));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Their values at the nodes of this rank's contacts (n x n_dof of fe_surface). */
static PetscErrorCode ToSurface(HycoFOM f, PetscInt n, const Vec v[], PetscReal **values)
{
  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n * f->fe_surface->n_dof, values));
  for (PetscInt k = 0; k < n; k++) PetscCall(HycoFOMToSurface(f, v[k], *values + k * f->fe_surface->n_dof));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* "body upper from turning about (0, 0, 1) through (0, 10, 0); nor body ..." As many as there is room for. */
static void RigidModesNames(HycoFOM f, const HycoMotions *free, PetscInt n, const PetscReal unconstrained[],
                            const char between[], size_t room, char list[])
{
  list[0] = '\0';
  for (PetscInt k = 0; k < n; k++) {
    char name[HYCO_LINE];

    HycoMotionsName(f->fe, free, unconstrained + k * free->n, name);
    /* The first ones are enough for a message. */
    if (strlen(list) + strlen(name) + strlen(between) + 1 > room) break;
    if (k) strcat(list, between);
    strcat(list, name);
  }
}

/* Adds a combination to the released motions, orthonormalised against the existing ones; a dependent one is left out.
   Dependent: less than a tenth remains. z: coefficients of the n motions. */
static PetscErrorCode AddReleased(HycoFOM f, PetscInt n, const Vec motion[], const PetscReal z[])
{
  PetscReal norm, before;
  Vec u;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(f->U, &u));
  PetscCall(VecSet(u, 0));
  PetscCall(VecMAXPY(u, n, z, (Vec *)motion));
  PetscCall(VecNorm(u, NORM_2, &before));
  for (PetscInt k = 0; k < 2 * f->n_released; k++) { /* twice, against round-off */
    PetscScalar dot;

    PetscCall(VecDot(u, f->released[k % f->n_released], &dot));
    PetscCall(VecAXPY(u, -dot, f->released[k % f->n_released]));
  }
  PetscCall(VecNorm(u, NORM_2, &norm));
  /* Motions are known within the error of the facets: what is left of a tenth would be that error. */
  if (norm < 0.1 * before) {
    PetscCall(VecDestroy(&u));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecScale(u, 1 / norm));
  f->released[f->n_released++] = u;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Combinations of motions that contact does not prevent: all of them, and those that are tangential in the same
   sense. */
typedef struct {
  PetscInt n, n_alike;
  PetscReal *all, *alike;
} Unconstrained;

/* Names them, and refuses them unless they are to be released. Rank 0, whose sums decide. All ranks have the same
   combinations; rank 0 gives the text. */
static PetscErrorCode NameUnconstrained(HycoFOM f, const HycoMotions *free, const Unconstrained *z)
{
  char list[HYCO_LINE / 2];

  PetscFunctionBegin;
  RigidModesNames(f, free, z->n, z->all, "; nor ", sizeof(list), list);
  RigidModesNames(f, free, z->n, z->all, "; ", sizeof(f->summary.regularised), f->summary.regularised);
  HycoCheck(!z->n || f->regularise,
            "no support%s keeps %s; fix a component on one of its groups, or -hyco_regularise solves without %s",
            f->n_contacts ? " and no contact" : "", list, z->n > 1 ? "these motions" : "that motion");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the combinations that no contact prevents. The normals of the smooth surface need the facets around the
   neighbours of each contact's nodes too. */
static PetscErrorCode FindUnconstrained(HycoFOM f, const HycoMotions *free, Unconstrained *z)
{
  HycoFE wide = f->size > 1 ? NULL : f->fe_surface;
  HycoMesh mesh = NULL;
  PetscInt *index = NULL;
  PetscErrorCode ierr = PETSC_SUCCESS;

  PetscFunctionBegin;
  if (f->size > 1) ierr = HycoFOMWiden(f, &mesh, &wide, &index);
  if (!ierr)
    ierr = HycoFEFindUnconstrained(HycoComm(f), f->fe_surface, wide, index, &f->pairs, free, &z->n, &z->all,
                                   &z->n_alike, &z->alike);
  if (f->size > 1) PetscCall(HycoFEDestroy(&wide));
  PetscCall(HycoMeshDestroy(&mesh));
  PetscCall(PetscFree(index));
  PetscCall(ierr);
  /* The names go into messages, which are the same on every rank. */
  HycoOnRoot(HycoComm(f), NameUnconstrained(f, free, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Releases unconstrained motions, first those that are tangential in the same sense: the normals can be turned only
   for these. With turned normals the motions are free also on the mesh; the others are only kept from the pins'
   forces. */
static PetscErrorCode FindReleased(HycoFOM f, const HycoMotions *free)
{
  Unconstrained z = {0, 0, NULL, NULL};
  HycoMotions at_surface = *free;
  PetscErrorCode ierr;
  Vec *motion;

  PetscFunctionBegin;
  PetscCall(HycoFOMMotionVectors(f, free, &motion));
  PetscCall(ToSurface(f, free->n, motion, &at_surface.motion));
  ierr = FindUnconstrained(f, &at_surface, &z);
  if (!ierr) PetscCall(PetscMalloc1(z.n + z.n_alike, &f->released));
  /* Only if something is to be released at all. */
  for (PetscInt k = 0; !ierr && k < z.n_alike && z.n; k++)
    PetscCall(AddReleased(f, free->n, motion, z.alike + k * free->n));
  /* The first ones: their normals are turned, and only they are removed from the solution. */
  f->n_turned = f->n_released;
  for (PetscInt k = 0; !ierr && k < z.n; k++) PetscCall(AddReleased(f, free->n, motion, z.all + k * free->n));
  PetscCall(VecDestroyVecs(free->n, &motion));
  HycoFreeAll(&at_surface.motion, &z.all, &z.alike);
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of the released motions at this rank's unknowns, zero at the contacts' nodes. Pins at contacts' nodes
   would carry contact forces. */
static PetscErrorCode ReleasedRows(HycoFOM f, PetscReal row[])
{
  const PetscInt n = f->n_released, n_own = f->part->n_owned * f->fe->dim;
  PetscScalar *mark;
  const PetscScalar *v;
  PetscBool *node;
  Vec contact;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(f->U, &contact));
  PetscCall(VecSet(contact, 0));
  PetscCall(PetscCalloc1(f->surface->n_nodes, &node));
  HycoPairsMark(&f->pairs, node);
  for (PetscInt i = 0; i < f->surface->n_nodes; i++) {
    const PetscInt at = f->surface->node_global ? f->surface->node_global[i] : i;

    /* Surfaces know contact nodes of other ranks: the vector brings the mark to the owner. */
    if (node[i]) PetscCall(VecSetValue(contact, at * f->fe->dim, 1, INSERT_VALUES));
  }
  PetscCall(PetscFree(node));
  PetscCall(HycoVecAssemble(contact));
  PetscCall(VecGetArray(contact, &mark));
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(VecGetArrayRead(f->released[k], &v));
    for (PetscInt i = 0; i < n_own; i++) row[i * n + k] = mark[i / f->fe->dim * f->fe->dim] > 0 ? 0 : v[i];
    PetscCall(VecRestoreArrayRead(f->released[k], &v));
  }
  PetscCall(VecRestoreArray(contact, &mark));
  PetscCall(VecDestroy(&contact));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The squared length. */
static PetscReal RowSize(PetscInt n, const PetscReal row[])
{
  PetscReal size = 0;

  for (PetscInt k = 0; k < n; k++) size += row[k] * row[k];
  return size;
}

/* The longest of all ranks' rows, among equal ones that of the node with the smallest tag: its tag and component,
   and the row. tag: of this rank's nodes. Equal within 1e-10: symmetric bodies have many such rows. */
static PetscErrorCode LongestRow(HycoFOM f, const PetscInt tag[], const PetscReal row[], PetscInt *pin,
                                 PetscInt *component, PetscReal longest[])
{
  const PetscInt n = f->n_released, dim = f->fe->dim, n_own = f->part->n_owned * dim;
  PetscReal best = 0;
  PetscInt64 key = LLONG_MAX, all;
  PetscInt at = -1;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < n_own; i++) best = PetscMax(best, RowSize(n, row + i * n));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &best, 1, MPIU_REAL, MPI_MAX, HycoComm(f)));
  for (PetscInt i = 0; i < n_own; i++) {
    const PetscInt64 here = (PetscInt64)tag[i / dim] * dim + i % dim;

    if (here >= key || RowSize(n, row + i * n) < best * (1 - 1e-10)) continue;
    key = here;
    at = i;
  }
  PetscCallMPI(MPI_Allreduce(&key, &all, 1, MPIU_INT64, MPI_MIN, HycoComm(f)));
  /* One rank has it, the others add 0: the sum broadcasts it without knowing the rank. */
  for (PetscInt k = 0; k < n; k++) longest[k] = at >= 0 && key == all ? row[at * n + k] : 0;
  HycoAllreduce(longest, n, MPIU_REAL, MPI_SUM, HycoComm(f));
  *pin = (PetscInt)(all / dim);
  *component = (PetscInt)(all % dim);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* As many unknowns as released motions, pivots of the motions' rows, not at contacts: by tag and component.
   Gram-Schmidt on rows with pivoting: the pinned rows are well conditioned. Chosen once, since pins change the
   pattern of fixed unknowns. */
static PetscErrorCode ChoosePins(HycoFOM f)
{
  const PetscInt n = f->n_released, n_own = f->part->n_owned * f->fe->dim;
  PetscReal *row, unit[HYCO_MAX_PINS], length;
  PetscInt *tag;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(n * n_own, &row, f->part->n_owned, &tag));
  PetscCall(ReleasedRows(f, row));
  for (PetscInt i = 0; i < f->part->n_nodes; i++) {
    if (HycoMeshOwned(f->part, i) >= 0) tag[HycoMeshOwned(f->part, i)] = f->part->node_id[i];
  }
  for (PetscInt p = 0; p < n; p++) {
    /* Over all ranks; equal rows by the smallest tag, so that the choice does not depend on the partition. */
    PetscCall(LongestRow(f, tag, row, &f->pin_tag[p], &f->pin_component[p], unit));
    length = PetscSqrtReal(RowSize(n, unit));
    for (PetscInt k = 0; k < n && length > 0; k++) unit[k] /= length;
    /* What the pin already holds is taken from the other rows. */
    for (PetscInt i = 0; i < n_own && length > 0; i++) {
      PetscReal dot = 0;

      for (PetscInt k = 0; k < n; k++) dot += row[i * n + k] * unit[k];
      for (PetscInt k = 0; k < n; k++) row[i * n + k] -= dot * unit[k];
    }
  }
  PetscCall(PetscFree2(row, tag));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the pins, on the part and on the surfaces, and the motions for which the normals there are turned. Pins are
   set after the contacts' motions are known; 0 removes them. */
static PetscErrorCode SetPins(HycoFOM f, PetscInt n)
{
  HycoFE fe = f->fe_surface;
  PetscReal *released;

  PetscFunctionBegin;
  /* Nothing to remove where there were none. */
  if (n || f->fe->n_pins) PetscCall(HycoFESetPins(f->fe, n, f->pin_tag, f->pin_component));
  if (fe != f->fe) PetscCall(HycoFESetPins(fe, n, f->pin_tag, f->pin_component));
  PetscCall(ToSurface(f, n ? f->n_turned : 0, f->released, &released));
  PetscCall(PetscFree(fe->released));
  fe->released = released;
  fe->n_turned = n ? f->n_turned : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the unconstrained motions at the current parameters and releases them (-hyco_regularise), or refuses them.
   Before K is assembled, as pins belong to its fixed unknowns. Collective. */
PetscErrorCode HycoFOMRelease(HycoFOM f)
{
  HycoMotions free;
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  /* The motions are those without pins. */
  PetscCall(SetPins(f, 0));
  for (PetscInt k = 0; k < f->n_released; k++) PetscCall(VecDestroy(&f->released[k]));
  PetscCall(PetscFree(f->released));
  f->n_released = f->n_turned = 0;
  PetscCall(HycoFEFreeMotions(HycoComm(f), f->fe, &free));
  f->summary.regularised[0] = '\0';
  if (free.n) ierr = FindReleased(f, &free);
  PetscCall(HycoMotionsDestroy(&free));
  PetscCall(ierr);
  HycoCheck(f->n_released <= HYCO_MAX_PINS, "%d rigid motions are unconstrained; at most %d can be regularised",
            (int)f->n_released, HYCO_MAX_PINS);
  /* The matrix's pattern and the factor's size depend on the pins. */
  HycoCheck(!f->pinned || f->n_pins == f->n_released,
            "%d rigid motions are unconstrained at this point, and %d at the last one; solve such points separately",
            (int)f->n_released, (int)f->n_pins);
  if (!f->pinned && f->n_released) PetscCall(ChoosePins(f));
  f->n_pins = f->n_released;
  PetscCall(SetPins(f, f->n_pins));
  f->pinned = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The work of forces on a motion, and the sum of its terms' magnitudes, which shows how much is not balanced. */
static PetscErrorCode RigidModesWork(Vec force, Vec motion, PetscReal *on, PetscReal *all)
{
  Vec absolute;

  PetscFunctionBegin;
  PetscCall(VecDot(force, motion, on));
  PetscCall(VecDuplicate(force, &absolute));
  PetscCall(VecPointwiseMult(absolute, force, motion));
  PetscCall(VecNorm(absolute, NORM_1, all));
  PetscCall(VecDestroy(&absolute));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The share of the forces' work on a released motion that is not balanced must be small: otherwise it would accelerate
   the body. A disc under its own symmetric load has round-off here, a missing support has 1. The message needs the
   motion's name, which rank 0 has. */
static PetscErrorCode CheckBalance(HycoFOM f, const char forces[], PetscReal share)
{
  PetscFunctionBegin;
  PetscCallMPI(MPI_Bcast(f->summary.regularised, sizeof(f->summary.regularised), MPI_CHAR, 0, HycoComm(f)));
  PetscCheck(share <= f->regularise_tol, HycoComm(f), PETSC_ERR_USER,
             "no equilibrium: nothing keeps %s, and the %s on this motion are unbalanced by a share of %.2g "
             "(-hyco_regularise_tol allows %g)",
             f->summary.regularised, forces, (double)share, (double)f->regularise_tol);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes F orthogonal to the released motions, so that pins carry nothing. Collective. */
PetscErrorCode HycoFOMBalance(HycoFOM f)
{
  const PetscInt dim = f->fe->dim;
  PetscReal on, all, worst = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < f->n_pins; k++) {
    PetscCall(RigidModesWork(f->F, f->released[k], &on, &all));
    /* The motions are orthonormal, so that one pass suffices in any order. */
    PetscCall(VecAXPY(f->F, -on, f->released[k]));
    worst = PetscMax(worst, all > 0 ? PetscAbsReal(on) / all : 0);
  }
  /* After all motions: the message names the whole set. */
  PetscCall(CheckBalance(f, "loads", worst));
  for (PetscInt k = 0; k < f->fe->n_pins; k++) { /* row of a support */
    const PetscInt own = HycoMeshOwned(f->part, f->fe->pin[k] / dim);

    if (own >= 0) PetscCall(VecSetValue(f->F, (f->part->first + own) * dim + f->fe->pin[k] % dim, 0, INSERT_VALUES));
  }
  PetscCall(HycoVecAssemble(f->F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After the solve: contact forces with turned normals must not push along a released motion. Collective. */
PetscErrorCode HycoFOMCheckContactBalance(HycoFOM f)
{
  PetscReal on, all, size, worst = 0;
  HycoReason reason;
  Vec force;

  PetscFunctionBegin;
  PetscCall(HycoSolverGetReason(f->solver, &reason));
  if (!f->n_pins || !f->n_contacts || reason < 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(f->F, &force));
  PetscCall(MatMult(f->Bt, f->Lambda, force));
  PetscCall(VecNorm(force, NORM_1, &size));
  for (PetscInt k = 0; k < f->n_pins; k++) {
    PetscCall(VecNorm(f->released[k], NORM_INFINITY, &all));
    PetscCall(VecDot(force, f->released[k], &on));
    /* Relative to all contact forces on the largest displacement of the motion. */
    if (size > 0) worst = PetscMax(worst, PetscAbsReal(on) / (size * all));
  }
  PetscCall(VecDestroy(&force));
  PetscCall(CheckBalance(f, "contact forces", worst));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The solution is determined up to the motions for which the normals are turned (n_turned, the first ones); the shown
   one is orthogonal to them. The others are no motions of the mesh, whose facets resist them: they stay in u. */
PetscErrorCode HycoFOMTakeOutReleased(HycoFOM f, Vec u)
{
  PetscScalar dot;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < f->n_turned; k++) {
    PetscCall(VecDot(u, f->released[k], &dot));
    PetscCall(VecAXPY(u, -dot, f->released[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The solver prevents these motions by contact; NULL where supports prevent all. */
static PetscErrorCode SetKernel(HycoFOM f)
{
  HycoMotions motions;
  MatNullSpace kernel;
  Vec *v;

  PetscFunctionBegin;
  PetscCall(HycoFEFreeMotions(HycoComm(f), f->fe, &motions));
  if (motions.n) {
    PetscCall(HycoFOMMotionVectors(f, &motions, &v));
    PetscCall(MatNullSpaceCreate(HycoComm(f), PETSC_FALSE, motions.n, v, &kernel));
    PetscCall(MatSetNullSpace(f->K, kernel));
    PetscCall(MatNullSpaceDestroy(&kernel));
    PetscCall(VecDestroyVecs(motions.n, &v));
  } else
    /* A null space of former parameters would stay. */
    PetscCall(MatSetNullSpace(f->K, NULL));
  PetscCall(HycoMotionsDestroy(&motions));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Modified Gram-Schmidt, twice; dependent vectors are removed. Twice, against round-off of nearly dependent motions. */
static PetscErrorCode RigidModesOrthonormalize(PetscInt *n, Vec v[])
{
  PetscInt kept = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < *n; k++) {
    PetscReal before, size;
    Vec w = v[k];

    PetscCall(VecNorm(w, NORM_2, &before));
    for (PetscInt j = 0; j < 2 * kept; j++) {
      PetscScalar dot;

      PetscCall(VecDot(w, v[j % kept], &dot));
      PetscCall(VecAXPY(w, -dot, v[j % kept]));
    }
    PetscCall(VecNorm(w, NORM_2, &size));
    /* Exact vectors up to round-off: what is left of a dependent one is noise. */
    if (size > 1e-8 * before) {
      PetscCall(VecScale(w, 1 / size));
      v[k] = v[kept];
      v[kept++] = w;
    }
  }
  for (PetscInt k = kept; k < *n; k++) PetscCall(VecDestroy(&v[k]));
  *n = kept;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets translations and rotations of the moved nodes, zero where fixed. For an algebraic multigrid, in block layout.
   MatNullSpaceCreateRigidBody() gives them without supports; zeros at fixed rows match K. With its block size and these
   vectors GAMG's coarse spaces represent rigid motions exactly, on which its convergence depends (Vanek, Mandel and
   Brezina 1996). */
static PetscErrorCode SetNearKernel(HycoFOM f)
{
  const PetscInt dim = f->fe->dim;
  MatNullSpace rigid, near;
  PetscInt n;
  const Vec *v;
  Vec x, *moves;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(f->U, &x));
  /* MatNullSpaceCreateRigidBody() takes the dimension from it. */
  PetscCall(VecSetBlockSize(x, dim));
  for (PetscInt i = 0; i < f->part->n_nodes; i++) {
    const PetscInt own = HycoMeshOwned(f->part, i);

    for (PetscInt c = 0; c < dim && own >= 0; c++)
      PetscCall(VecSetValue(x, (f->part->first + own) * dim + c, f->fe->X[3 * i + c], INSERT_VALUES));
  }
  PetscCall(HycoVecAssemble(x));
  PetscCall(MatNullSpaceCreateRigidBody(x, &rigid));
  PetscCall(MatNullSpaceGetVecs(rigid, NULL, &n, &v)); /* borrowed */
  PetscCall(PetscMalloc1(n, &moves));
  for (PetscInt k = 0; k < n; k++) {
    /* Vectors of a null space are locked for reading: they are copied. */
    PetscCall(VecDuplicate(v[k], &moves[k]));
    PetscCall(VecCopy(v[k], moves[k]));
    for (PetscInt i = 0; i < f->part->n_nodes * dim; i++) {
      const PetscInt own = HycoMeshOwned(f->part, i / dim);

      if (f->fe->fixed[i] && own >= 0)
        PetscCall(VecSetValue(moves[k], (f->part->first + own) * dim + i % dim, 0, INSERT_VALUES));
    }
    PetscCall(HycoVecAssemble(moves[k]));
  }
  PetscCall(RigidModesOrthonormalize(&n, moves));
  PetscCall(MatNullSpaceCreate(HycoComm(f), PETSC_FALSE, n, moves, &near));
  PetscCall(MatSetNearNullSpace(f->K, near));
  HycoDestroyAll(&near, &rigid);
  for (PetscInt k = 0; k < n; k++) PetscCall(VecDestroy(&moves[k]));
  PetscCall(PetscFree(moves));
  PetscCall(VecDestroy(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After each change of K or of the nodes, because both depend on positions. Collective. */
PetscErrorCode HycoFOMSetMotions(HycoFOM f)
{
  PetscFunctionBegin;
  PetscCall(SetKernel(f));
  PetscCall(SetNearKernel(f));
  PetscCall(HycoFOMFindSoft(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}
