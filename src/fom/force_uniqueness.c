/*
  Whether the contact forces are unique: they are if the rows of B of the closed contacts are independent, with the
  tangents of those that stick. Slaves whose own unknowns are all fixed (a rigid tool) may be more than their masters'
  unknowns can distinguish: then forces can be redistributed among them without any other change. So can friction and
  normal forces of contacts with one slave node.
*/
#include <hycofomimpl.h>
#include <hycopath.h>
#include <hycolcp.h>

/* By row, from the contacts' normal forces: a tangent that sticks has that of its normal, since it may give forces to
   others, and others have 0. slip: NULL: a row for each contact. */
static void RowForces(HycoContactState slip, PetscInt m, const PetscReal lambda[], PetscReal force[],
                      PetscBool tangent[])
{
  for (PetscInt k = 0; k < (slip ? slip->n : m); k++) {
    const PetscInt row = slip ? slip->row[k] : k;
    const PetscBool sticks = (PetscBool)(slip && slip->shear.state[k] == HYCO_STICK);

    force[row] = lambda[k];
    tangent[row] = PETSC_FALSE;
    for (PetscInt i = row + 1; slip && i < slip->row[k + 1]; i++) {
      force[i] = sticks ? PetscMax(lambda[k], 0) : 0;
      tangent[i] = PETSC_TRUE;
    }
  }
}

/* Marks rows of contacts whose gap is closed, and that have an unknown. The scale is of all contacts, so that round-off
   counts equally everywhere; two passes, since it is known after the first. 1e-9 of it: a gap that the solver has left
   by round-off is closed. */
static PetscErrorCode MarkClosed(MPI_Comm comm, const HycoRows *r, const PetscReal u[], const PetscReal lambda[],
                                 const PetscBool tangent[], PetscBool in[])
{
  PetscReal scale = 0;

  PetscFunctionBegin;
  for (PetscInt pass = 0; pass < 2; pass++) {
    for (PetscInt k = 0; k < r->n; k++) {
      PetscReal left = r->gap[k], size = PetscAbsReal(r->gap[k]);

      for (PetscInt j = r->start[k]; j < r->start[k + 1]; j++) {
        left -= r->value[j] * u[r->dof[j]];
        size += PetscAbsReal(r->value[j] * u[r->dof[j]]);
      }
      if (!tangent[k]) scale = PetscMax(scale, size);
      /* A row without entries resists nothing. */
      in[k] = (PetscBool)(r->start[k + 1] > r->start[k] && (lambda[k] > 0 || (!tangent[k] && left <= 1e-9 * scale)));
    }
    if (!pass) HycoAllreduce(&scale, 1, MPIU_REAL, MPI_MAX, comm);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* In how many of all ranks' rows each unknown of the surface occurs. Collective. Counts are sums over ranks at the
   owners, then sent back. */
static PetscErrorCode CountRows(HycoFOM f, const HycoRows *r, const PetscBool in[], PetscReal count[])
{
  const PetscInt n_dof = f->fe_surface->n_dof;
  Vec all, mine;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(count, n_dof));
  for (PetscInt k = 0; k < r->n; k++) {
    for (PetscInt j = r->start[k]; in[k] && j < r->start[k + 1]; j++) count[r->dof[j]]++;
  }
  /* One rank: the counts are complete. */
  if (!f->to_surface) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(f->U, &all));
  PetscCall(VecSet(all, 0));
  PetscCall(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, n_dof, count, &mine));
  PetscCall(VecScatterBegin(f->to_surface, mine, all, ADD_VALUES, SCATTER_REVERSE));
  PetscCall(VecScatterEnd(f->to_surface, mine, all, ADD_VALUES, SCATTER_REVERSE));
  PetscCall(VecDestroy(&mine));
  PetscCall(HycoFOMToSurface(f, all, count));
  PetscCall(VecDestroy(&all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Removes this rank's rows with an unknown that occurs in no other row, until there are none. An entry below 1e-6
   does not make a row independent in finite precision. */
static PetscBool PeelOwn(const HycoRows *r, PetscReal count[], PetscBool in[])
{
  PetscBool change = PETSC_TRUE, any = PETSC_FALSE;

  while (change) {
    change = PETSC_FALSE;
    for (PetscInt k = 0; k < r->n; k++) {
      PetscBool own = PETSC_FALSE;

      if (!in[k]) continue;
      for (PetscInt j = r->start[k]; j < r->start[k + 1]; j++)
        own = (PetscBool)(own || (count[r->dof[j]] == 1 && PetscAbsReal(r->value[j]) > 1e-6));
      if (!own) continue;
      /* A row less: its other unknowns may now be the own ones of further rows. */
      for (PetscInt j = r->start[k]; j < r->start[k + 1]; j++) count[r->dof[j]]--;
      in[k] = PETSC_FALSE;
      change = any = PETSC_TRUE;
    }
  }
  return any;
}

/* Removes repeatedly the rows with an unknown that occurs in no other row: they are independent. Exact and cheap;
   only what remains needs a dense Gram matrix. Ranks may remove rows at the same time: each counts on an unknown
   that is in no other row. */
static PetscErrorCode ForceRankRemoveIndependent(HycoFOM f, const HycoRows *r, PetscBool in[])
{
  PetscReal *count;
  PetscBool change = PETSC_TRUE;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(f->fe_surface->n_dof, &count));
  while (change) {
    /* Over all ranks: a master node may occur in rows of several. */
    PetscCall(CountRows(f, r, in, count));
    change = PeelOwn(r, count, in);
    HycoAllreduce(&change, 1, HYCO_MPI_BOOL, MPI_LOR, HycoComm(f));
  }
  PetscCall(PetscFree(count));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The remaining rows of all ranks, with unknowns by their numbers in the distributed vectors, on rank 0. Collective;
   the caller frees them. */
static PetscErrorCode GatherRest(HycoFOM f, const HycoRows *r, const PetscBool in[], HycoRows *rest)
{
  const PetscInt dim = f->fe->dim, *global = f->surface->node_global;
  PetscInt n = 0, *end, *dof, n_values, m = 0;
  PetscReal *value;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(r->n, &end, r->start[r->n], &dof, r->start[r->n], &value));
  /* Lengths instead of starts: those of several ranks can be concatenated. */
  for (PetscInt k = 0; k < r->n; k++) {
    if (in[k]) end[m++] = r->start[k + 1] - r->start[k];
    for (PetscInt j = r->start[k]; in[k] && j < r->start[k + 1]; j++, n++) {
      dof[n] = global ? global[r->dof[j] / dim] * dim + r->dof[j] % dim : r->dof[j];
      value[n] = r->value[j];
    }
  }
  PetscCall(HycoConcatenate(HycoComm(f), n, dof, MPIU_INT, sizeof(PetscInt), &n_values, &rest->dof));
  PetscCall(HycoConcatenate(HycoComm(f), n, value, MPIU_REAL, sizeof(PetscReal), &n_values, &rest->value));
  PetscCall(HycoConcatenate(HycoComm(f), m, end, MPIU_INT, sizeof(PetscInt), &rest->n, &rest->start));
  PetscCall(PetscFree3(end, dof, value));
  for (PetscInt k = 0, next = 0; k <= rest->n && rest->start; k++) { /* from lengths to starts */
    const PetscInt here = next;

    next += k < rest->n ? rest->start[k] : 0;
    rest->start[k] = here;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The number of rows minus their rank; the unknowns are numbered anew, those that occur. Rank 0. By the Gram matrix (n
   x n, dense): n is small after peeling. Each dependent row is a direction in which contact forces are arbitrary while
   displacements are not. */
static PetscErrorCode ForceRankDependent(const HycoRows *r, PetscInt *dependent)
{
  const PetscInt n = r->n, n_values = r->start[n];
  PetscReal *G, *full;
  PetscInt *dof, *at, n_dof = n_values, rank;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(n_values, &dof, n_values, &at));
  PetscCall(PetscArraycpy(dof, r->dof, n_values));
  PetscCall(HycoSortUnique(&n_dof, dof));
  for (PetscInt j = 0; j < n_values; j++) PetscCall(PetscFindInt(r->dof[j], n_dof, dof, &at[j]));
  PetscCall(PetscCalloc1(n_dof, &full));
  PetscCall(PetscMalloc1((size_t)n * (size_t)n, &G));
  for (PetscInt a = 0; a < n; a++) {
    /* Row a as a full vector, cleared again below: products with all others cost only their entries. */
    for (PetscInt j = r->start[a]; j < r->start[a + 1]; j++) full[at[j]] = r->value[j];
    for (PetscInt b = 0; b < n; b++) {
      PetscReal sum = 0;

      for (PetscInt j = r->start[b]; j < r->start[b + 1]; j++) sum += r->value[j] * full[at[j]];
      G[(size_t)a * (size_t)n + (size_t)b] = sum;
    }
    for (PetscInt j = r->start[a]; j < r->start[a + 1]; j++) full[at[j]] = 0;
  }
  PetscCall(HycoGramRank(n, G, &rank));
  *dependent = n - rank;
  PetscCall(PetscFree2(dof, at));
  HycoFreeAll(&full, &G);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same for the rows that are marked, on all ranks. A row without force cannot exchange it with others. */
static PetscErrorCode CountRemaining(HycoFOM f, const HycoRows *r, const PetscReal lambda[], const PetscBool in[],
                                     PetscInt *dependent)
{
  HycoRows rest = {0};
  PetscBool pressed = PETSC_FALSE;

  PetscFunctionBegin;
  *dependent = 0;
  for (PetscInt k = 0; k < r->n; k++) pressed = (PetscBool)(pressed || (in[k] && lambda[k] > 0));
  HycoAllreduce(&pressed, 1, HYCO_MPI_BOOL, MPI_LOR, HycoComm(f));
  /* Dependent rows without any force: forces 0 are unique. */
  if (!pressed) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(GatherRest(f, r, in, &rest));
  HycoOnRoot(HycoComm(f), ForceRankDependent(&rest, dependent));
  HycoFreeAll(&rest.start, &rest.dof, &rest.value);
  HycoBcast(dependent, 1, MPIU_INT, HycoComm(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows that share no unknown with another closed row are independent; only the rest needs a rank. */
static PetscErrorCode ForceRankCount(HycoFOM f, HycoContactState slip, HycoRows *r, PetscReal force[],
                                     PetscBool tangent[], PetscBool in[], PetscInt *dependent)
{
  PetscFunctionBegin;
  if (slip)
    HycoOnEach(HycoComm(f),
               HycoContactTangentRows(f->fe_surface, &f->pairs, slip->row, f->u_surface, slip->tangent, r));
  else
    HycoOnEach(HycoComm(f), HycoContactRows(f->fe_surface, &f->pairs, r));
  RowForces(slip, r->n, f->lambda, force, tangent);
  PetscCall(MarkClosed(HycoComm(f), r, f->u_surface, force, tangent, in));
  PetscCall(ForceRankRemoveIndependent(f, r, in));
  PetscCall(CountRemaining(f, r, force, in, dependent));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* By how many the rows of closed contacts exceed their rank: contact forces are unique if 0. Collective. */
PetscErrorCode HycoFOMCountDependent(HycoFOM f, PetscInt *dependent)
{
  const HycoContactState slip = f->path ? f->path->friction : NULL;
  const PetscInt m = slip ? slip->row[slip->n] : f->pairs.n;
  HycoRows r = {0};
  PetscReal *force;
  PetscBool *in, *tangent;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(m, &in, m, &force, m, &tangent));
  HycoFinally(ForceRankCount(f, slip, &r, force, tangent, in, dependent), PetscCall(HycoRowsDestroy(&r));
              PetscCall(PetscFree3(in, force, tangent)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The marked rows, which the caller frees. */
static PetscErrorCode AcceptResidual(const HycoRows *r, const PetscBool in[], HycoRows *rest)
{
  PetscInt n = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(r->n + 1, &rest->start));
  PetscCall(PetscMalloc1(r->start[r->n] + 1, &rest->dof));
  PetscCall(PetscMalloc1(r->start[r->n] + 1, &rest->value));
  rest->start[0] = 0;
  for (PetscInt k = 0; k < r->n; k++) {
    for (PetscInt j = r->start[k]; in[k] && j < r->start[k + 1]; j++) {
      rest->dof[n] = r->dof[j];
      rest->value[n++] = r->value[j];
    }
    /* After its entries: starts are those of the next row. */
    if (in[k]) rest->start[++rest->n] = n;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same for the rows of a reduced system, on one process; dof < n_dof. */
PetscErrorCode HycoRowsCountDependent(const HycoRows *r, PetscInt n_dof, const PetscReal u[], const PetscReal lambda[],
                                      HycoContactState slip, PetscInt *dependent)
{
  const PetscInt m = r->n;
  HycoRows rest = {0};
  PetscReal *count, *force;
  PetscBool *in, *tangent, pressed = PETSC_FALSE;

  PetscFunctionBegin;
  *dependent = 0;
  PetscCall(PetscMalloc3(m, &in, m, &force, m, &tangent));
  RowForces(slip, m, lambda, force, tangent);
  PetscCall(PetscCalloc1(n_dof + 1, &count));
  PetscCall(MarkClosed(PETSC_COMM_SELF, r, u, force, tangent, in));
  for (PetscInt k = 0; k < m; k++) {
    for (PetscInt j = r->start[k]; in[k] && j < r->start[k + 1]; j++) count[r->dof[j]]++;
  }
  /* Once: on one process rows leave in one sweep, and those that stay are few. */
  (void)PeelOwn(r, count, in);
  for (PetscInt k = 0; k < m; k++) pressed = (PetscBool)(pressed || (in[k] && force[k] > 0));
  /* Without a force nothing can be redistributed. */
  if (pressed) {
    PetscCall(AcceptResidual(r, in, &rest));
    PetscCall(ForceRankDependent(&rest, dependent));
  }
  PetscCall(PetscFree3(in, force, tangent));
  HycoFreeAll(&rest.start, &rest.dof, &rest.value, &count);
  PetscFunctionReturn(PETSC_SUCCESS);
}
