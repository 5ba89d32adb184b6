/*
  Rigid motions and K: those that the supports leave free are its kernel, so that the solver can hold them by contact;
  all of them are what an algebraic multigrid must know (its near-kernel).

  Those that contact does not hold either are refused, or released (-hyco_regularise): as many unknowns as they are get
  pinned like supports, the contacts' normals are turned so that they stay tangential, and of the loads what is left on
  them, checked to be little, is taken away: then the pins carry nothing, and the solution is that of the free body but
  for these motions, which are taken out of it.
*/
#include <hycofomimpl.h>
#include <string.h>

/* The motions as distributed vectors; rank 0 has them. */
static PetscErrorCode Spread(HycoFOM f, const PetscReal motion[], PetscInt n, Vec v[])
{
  const PetscInt dim = f->fe->dim;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(VecDuplicate(f->U, &v[k]));
    for (PetscInt i = 0; f->rank == 0 && i < f->n_nodes * dim; i++) {
      const PetscInt node = f->global ? f->global[i / dim] : i / dim;

      PetscCall(VecSetValue(v[k], node * dim + i % dim, motion[(size_t)k * (size_t)(f->n_nodes * dim) + (size_t)i],
                            INSERT_VALUES));
    }
    PetscCall(VecAssemblyBegin(v[k]));
    PetscCall(VecAssemblyEnd(v[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* "body upper from turning about (0, 0, 1) through (0, 10, 0); nor body ..." */
static void Names(HycoFOM f, const HycoMotions *free, PetscInt n, const PetscReal unheld[], const char between[],
                  size_t room, char list[])
{
  list[0] = '\0';
  for (PetscInt k = 0; k < n; k++) {
    char name[HYCO_LINE];

    HycoMotionsName(f->fe_whole, free, unheld + k * free->n, name);
    if (strlen(list) + strlen(name) + strlen(between) + 1 > room) break;
    if (k) strcat(list, between);
    strcat(list, name);
  }
}

/* Adds a combination to fe->released, made orthonormal to those there; what brings nothing new is left out. */
static void AddReleased(HycoFE fe, const HycoMotions *free, const PetscReal z[])
{
  const size_t n_dof = (size_t)fe->n_dof;
  PetscReal *u = fe->released + (size_t)fe->n_released * n_dof, norm = 0, before = 0;

  for (size_t i = 0; i < n_dof; i++) {
    u[i] = 0;
    for (PetscInt a = 0; a < free->n; a++) u[i] += z[a] * free->motion[(size_t)a * n_dof + i];
    before += u[i] * u[i];
  }
  for (PetscInt k = 0; k < 2 * fe->n_released; k++) { /* twice: round-off */
    const PetscReal *w = fe->released + (size_t)(k % fe->n_released) * n_dof;
    PetscReal dot = 0;

    for (size_t i = 0; i < n_dof; i++) dot += u[i] * w[i];
    for (size_t i = 0; i < n_dof; i++) u[i] -= dot * w[i];
  }
  for (size_t i = 0; i < n_dof; i++) norm += u[i] * u[i];
  if (norm < 0.01 * before) return;
  for (size_t i = 0; i < n_dof; i++) u[i] /= PetscSqrtReal(norm);
  fe->n_released++;
}

/* All that nothing holds is released, first what is tangential in one sense: the normals can be turned for that alone.
 */
static PetscErrorCode Release(HycoFE fe, const HycoMotions *free, PetscInt n_alike, const PetscReal alike[],
                              PetscInt n_unheld, const PetscReal unheld[])
{
  PetscFunctionBegin;
  PetscCall(PetscMalloc1((size_t)(n_alike + n_unheld) * (size_t)fe->n_dof, &fe->released));
  for (PetscInt k = 0; k < n_alike; k++) AddReleased(fe, free, alike + k * free->n);
  fe->n_turned = fe->n_released;
  for (PetscInt k = 0; k < n_unheld; k++) AddReleased(fe, free, unheld + k * free->n);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Motions that nothing holds are refused, or released. */
static PetscErrorCode FindReleased(HycoFOM f, const HycoMotions *free)
{
  PetscInt n_unheld = 0, n_alike = 0;
  PetscReal *unheld = NULL, *alike = NULL;
  PetscErrorCode ierr;
  char list[HYCO_LINE / 2];

  PetscFunctionBegin;
  ierr = HycoFEFindUnheld(f->fe_whole, &f->pairs, free, &n_unheld, &unheld, &n_alike, &alike);
  Names(f, free, n_unheld, unheld, "; nor ", sizeof(list), list);
  Names(f, free, n_unheld, unheld, "; ", sizeof(f->summary.regularised), f->summary.regularised);
  if (!ierr && n_unheld && f->regularise) ierr = Release(f->fe_whole, free, n_alike, alike, n_unheld, unheld);
  PetscCall(PetscFree(unheld));
  PetscCall(PetscFree(alike));
  PetscCall(ierr);
  HycoCheck(!n_unheld || f->regularise,
            "no support%s keeps %s; fix a component on one of its groups, or -hyco_regularise solves without %s",
            f->pairs.n ? " and no contact" : "", list, n_unheld > 1 ? "these motions" : "that motion");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* As many unknowns as are released, pivots of the motions' rows, apart from the contacts: by tag and component. */
static PetscErrorCode ChoosePins(HycoFOM f, PetscInt tag[], PetscInt component[])
{
  HycoFE fe = f->fe_whole;
  const PetscInt n = fe->n_released, dim = fe->dim;
  PetscBool *contact;
  PetscReal *row, unit[HYCO_MAX_PINS];

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(fe->mesh->n_nodes, &contact));
  HycoPairsMark(&f->pairs, contact);
  PetscCall(PetscMalloc1(n * fe->n_dof, &row));
  for (PetscInt i = 0; i < fe->n_dof; i++) {
    for (PetscInt k = 0; k < n; k++)
      row[i * n + k] = contact[i / dim] ? 0 : fe->released[(size_t)k * (size_t)fe->n_dof + (size_t)i];
  }
  for (PetscInt p = 0; p < n; p++) {
    PetscReal best = 0;
    PetscInt at = 0;

    for (PetscInt i = 0; i < fe->n_dof; i++) {
      PetscReal size = 0;

      for (PetscInt k = 0; k < n; k++) size += row[i * n + k] * row[i * n + k];
      if (size > best * (1 + 1e-10)) at = i;
      best = PetscMax(best, size);
    }
    tag[p] = fe->mesh->node_id[at / dim];
    component[p] = at % dim;
    for (PetscInt k = 0; k < n; k++) unit[k] = row[at * n + k] / PetscSqrtReal(best);
    for (PetscInt i = 0; i < fe->n_dof && best > 0; i++) {
      PetscReal dot = 0;

      for (PetscInt k = 0; k < n; k++) dot += row[i * n + k] * unit[k];
      for (PetscInt k = 0; k < n; k++) row[i * n + k] -= dot * unit[k];
    }
  }
  PetscCall(PetscFree(contact));
  PetscCall(PetscFree(row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0: what the supports leave free, and of it what contact does not hold; pins for that, the last ones if there
 * are. */
static PetscErrorCode FindPins(HycoFOM f)
{
  HycoFE fe = f->fe_whole;
  HycoMotions free = {0, NULL, NULL, NULL};
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  PetscCall(HycoFESetPins(fe, 0, NULL, NULL));
  PetscCall(PetscFree(fe->released));
  fe->n_released = fe->n_turned = 0;
  PetscCall(HycoFEFreeMotions(fe, &free));
  f->summary.regularised[0] = '\0';
  if (free.n) ierr = FindReleased(f, &free);
  PetscCall(HycoMotionsDestroy(&free));
  PetscCall(ierr);
  HycoCheck(fe->n_released <= HYCO_MAX_PINS, "%d motions are held by nothing; at most %d can be regularised",
            (int)fe->n_released, HYCO_MAX_PINS);
  HycoCheck(!f->pinned || f->n_pins == fe->n_released,
            "%d motions are held by nothing at this point, %d at the last one; solve such points apart",
            (int)fe->n_released, (int)f->n_pins);
  if (!f->pinned && fe->n_released) PetscCall(ChoosePins(f, f->pin_tag, f->pin_component));
  f->n_pins = fe->n_released;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMRelease(HycoFOM f)
{
  PetscInt n;

  PetscFunctionBegin;
  HycoOnRoot(HycoComm(f), FindPins(f));
  PetscCallMPI(MPI_Bcast(&f->n_pins, 1, MPIU_INT, 0, HycoComm(f)));
  PetscCallMPI(MPI_Bcast(f->pin_tag, HYCO_MAX_PINS, MPIU_INT, 0, HycoComm(f)));
  PetscCallMPI(MPI_Bcast(f->pin_component, HYCO_MAX_PINS, MPIU_INT, 0, HycoComm(f)));
  n = f->n_pins;
  if (n || f->fe->n_pins) PetscCall(HycoFESetPins(f->fe, n, f->pin_tag, f->pin_component));
  if (f->fe_whole != f->fe && f->rank == 0) PetscCall(HycoFESetPins(f->fe_whole, n, f->pin_tag, f->pin_component));
  if (!f->pinned && n) {
    PetscCall(PetscMalloc1(n, &f->released));
    f->n_released = n;
  } else {
    for (PetscInt k = 0; k < n; k++) PetscCall(VecDestroy(&f->released[k]));
  }
  PetscCall(Spread(f, f->rank ? NULL : f->fe_whole->released, n, f->released));
  f->pinned = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What forces do on a motion, and the same with no sign: how much of it is not balanced. */
static PetscErrorCode Work(Vec force, Vec motion, PetscReal *on, PetscReal *all)
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

/* The share of the forces' work on a released motion that is not balanced must be little: it would accelerate the body.
 */
static PetscErrorCode CheckBalance(HycoFOM f, const char forces[], PetscReal share)
{
  PetscFunctionBegin;
  PetscCallMPI(MPI_Bcast(f->summary.regularised, sizeof(f->summary.regularised), MPI_CHAR, 0, HycoComm(f)));
  PetscCheck(share <= f->regularise_tol, HycoComm(f), PETSC_ERR_USER,
             "no equilibrium: nothing keeps %s, and of what the %s do there %.2g is not balanced "
             "(-hyco_regularise_tol %g)",
             f->summary.regularised, forces, (double)share, (double)f->regularise_tol);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMBalance(HycoFOM f)
{
  const PetscInt dim = f->fe->dim;
  PetscReal on, all, worst = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < f->n_pins; k++) {
    PetscCall(Work(f->F, f->released[k], &on, &all));
    PetscCall(VecAXPY(f->F, -on, f->released[k]));
    worst = PetscMax(worst, all > 0 ? PetscAbsReal(on) / all : 0);
  }
  PetscCall(CheckBalance(f, "loads", worst));
  for (PetscInt k = 0; k < f->fe->n_pins; k++) { /* a support's row */
    const PetscInt node = f->fe->pin[k] / dim, row = f->part->node_global ? f->part->node_global[node] : node;

    if (row >= f->first && row < f->first + f->n_owned)
      PetscCall(VecSetValue(f->F, row * dim + f->fe->pin[k] % dim, 0, INSERT_VALUES));
  }
  PetscCall(VecAssemblyBegin(f->F));
  PetscCall(VecAssemblyEnd(f->F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

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
    if (size > 0) worst = PetscMax(worst, PetscAbsReal(on) / (size * all));
  }
  PetscCall(VecDestroy(&force));
  PetscCall(CheckBalance(f, "contact forces", worst));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void HycoFOMTakeOutReleased(HycoFOM f)
{
  const HycoFE fe = f->fe_whole;

  for (PetscInt k = 0; k < fe->n_turned; k++) {
    const PetscReal *motion = fe->released + (size_t)k * (size_t)fe->n_dof;
    PetscReal dot = 0;

    for (PetscInt i = 0; i < fe->n_dof; i++) dot += f->u[i] * motion[i];
    for (PetscInt i = 0; i < fe->n_dof; i++) f->u[i] -= dot * motion[i];
  }
}

static PetscErrorCode SetKernel(HycoFOM f)
{
  HycoMotions motions = {0, NULL, NULL, NULL};
  MatNullSpace kernel;
  PetscInt n;
  Vec *v;

  PetscFunctionBegin;
  HycoOnRoot(HycoComm(f), HycoFEFreeMotions(f->fe_whole, &motions));
  n = motions.n;
  PetscCallMPI(MPI_Bcast(&n, 1, MPIU_INT, 0, HycoComm(f)));
  f->summary.free_motion[0] = '\0'; /* rank 0 spreads the summary */
  if (f->rank == 0 && n)
    PetscCall(PetscStrncpy(f->summary.free_motion, motions.name[0], sizeof(f->summary.free_motion)));
  if (!n) {
    PetscCall(MatSetNullSpace(f->K, NULL));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc1(n, &v));
  PetscCall(Spread(f, motions.motion, n, v));
  PetscCall(MatNullSpaceCreate(HycoComm(f), PETSC_FALSE, n, v, &kernel));
  PetscCall(MatSetNullSpace(f->K, kernel));
  PetscCall(MatNullSpaceDestroy(&kernel));
  for (PetscInt k = 0; k < n; k++) PetscCall(VecDestroy(&v[k]));
  PetscCall(PetscFree(v));
  PetscCall(HycoMotionsDestroy(&motions));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Modified Gram-Schmidt, twice; what depends on those before goes. */
static PetscErrorCode Orthonormalize(PetscInt *n, Vec v[])
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

/* Translations and rotations of the moved nodes, zero where fixed. */
static PetscErrorCode SetNearKernel(HycoFOM f)
{
  const PetscInt dim = f->fe->dim;
  MatNullSpace rigid, near;
  PetscInt n;
  const Vec *v;
  Vec x, *moves;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(f->U, &x));
  PetscCall(VecSetBlockSize(x, dim));
  for (PetscInt i = 0; i < f->part->n_nodes; i++) {
    const PetscInt row = f->part->node_global ? f->part->node_global[i] : i;

    if (row < f->first || row >= f->first + f->n_owned) continue;
    for (PetscInt c = 0; c < dim; c++) PetscCall(VecSetValue(x, row * dim + c, f->fe->X[3 * i + c], INSERT_VALUES));
  }
  PetscCall(VecAssemblyBegin(x));
  PetscCall(VecAssemblyEnd(x));
  PetscCall(MatNullSpaceCreateRigidBody(x, &rigid));
  PetscCall(MatNullSpaceGetVecs(rigid, NULL, &n, &v)); /* lent for reading */
  PetscCall(PetscMalloc1(n, &moves));
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(VecDuplicate(v[k], &moves[k]));
    PetscCall(VecCopy(v[k], moves[k]));
    for (PetscInt i = 0; i < f->part->n_nodes * dim; i++) {
      const PetscInt node = f->part->node_global ? f->part->node_global[i / dim] : i / dim;

      if (f->fe->fixed[i] && node >= f->first && node < f->first + f->n_owned)
        PetscCall(VecSetValue(moves[k], node * dim + i % dim, 0, INSERT_VALUES));
    }
    PetscCall(VecAssemblyBegin(moves[k]));
    PetscCall(VecAssemblyEnd(moves[k]));
  }
  PetscCall(Orthonormalize(&n, moves));
  PetscCall(MatNullSpaceCreate(HycoComm(f), PETSC_FALSE, n, moves, &near));
  PetscCall(MatSetNearNullSpace(f->K, near));
  PetscCall(MatNullSpaceDestroy(&near));
  PetscCall(MatNullSpaceDestroy(&rigid));
  for (PetscInt k = 0; k < n; k++) PetscCall(VecDestroy(&moves[k]));
  PetscCall(PetscFree(moves));
  PetscCall(VecDestroy(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMSetMotions(HycoFOM f)
{
  PetscFunctionBegin;
  PetscCall(SetKernel(f));
  PetscCall(SetNearKernel(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}
