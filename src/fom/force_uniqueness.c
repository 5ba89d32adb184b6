/*
  Whether the contact forces are unique: they are if the rows of B of the closed contacts are independent. Slaves whose
  own unknowns are all fixed (a rigid tool) may be more than their masters' unknowns can distinguish: then forces can be
  redistributed among them without any other change.
*/
#include <hycofomimpl.h>
#include <hycolcp.h>

typedef struct {
  PetscInt m, *start, *dof;
  PetscReal *value, *gap;
} Rows;

/* Marks contacts whose gap is closed, and that have an unknown. */
static void MarkClosed(HycoFOM f, const Rows *r, PetscBool in[])
{
  PetscReal scale = 0;

  for (PetscInt pass = 0; pass < 2; pass++) {
    for (PetscInt k = 0; k < r->m; k++) {
      PetscReal left = r->gap[k], size = PetscAbsReal(r->gap[k]);

      for (PetscInt j = r->start[k]; j < r->start[k + 1]; j++) {
        left -= r->value[j] * f->u_surface[r->dof[j]];
        size += PetscAbsReal(r->value[j] * f->u_surface[r->dof[j]]);
      }
      scale = PetscMax(scale, size);
      in[k] = (PetscBool)(r->start[k + 1] > r->start[k] && (f->lambda[k] > 0 || left <= 1e-9 * scale));
    }
  }
}

/* Removes repeatedly the rows with an unknown that occurs in no other row: they are independent. */
static PetscErrorCode Peel(const Rows *r, PetscInt n_dof, PetscBool in[])
{
  PetscInt *count;
  PetscBool change = PETSC_TRUE;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(n_dof, &count));
  for (PetscInt k = 0; k < r->m; k++) {
    for (PetscInt j = r->start[k]; in[k] && j < r->start[k + 1]; j++) count[r->dof[j]]++;
  }
  while (change) {
    change = PETSC_FALSE;
    for (PetscInt k = 0; k < r->m; k++) {
      PetscBool own = PETSC_FALSE;

      if (!in[k]) continue;
      for (PetscInt j = r->start[k]; j < r->start[k + 1]; j++)
        own = (PetscBool)(own || (count[r->dof[j]] == 1 && PetscAbsReal(r->value[j]) > 1e-6));
      if (!own) continue;
      for (PetscInt j = r->start[k]; j < r->start[k + 1]; j++) count[r->dof[j]]--;
      in[k] = PETSC_FALSE;
      change = PETSC_TRUE;
    }
  }
  PetscCall(PetscFree(count));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* n minus the rank of the remaining rows. */
static PetscErrorCode Dependent(const Rows *r, PetscInt n_dof, PetscInt n, const PetscBool in[], PetscInt *dependent)
{
  PetscReal *G, *full;
  PetscInt *row, rank, i = 0;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(n_dof, &full));
  PetscCall(PetscMalloc2((size_t)n * (size_t)n, &G, n, &row));
  for (PetscInt k = 0; k < r->m; k++) {
    if (in[k]) row[i++] = k;
  }
  for (PetscInt a = 0; a < n; a++) {
    for (PetscInt j = r->start[row[a]]; j < r->start[row[a] + 1]; j++) full[r->dof[j]] = r->value[j];
    for (PetscInt b = 0; b < n; b++) {
      PetscReal sum = 0;

      for (PetscInt j = r->start[row[b]]; j < r->start[row[b] + 1]; j++) sum += r->value[j] * full[r->dof[j]];
      G[(size_t)a * (size_t)n + (size_t)b] = sum;
    }
    for (PetscInt j = r->start[row[a]]; j < r->start[row[a] + 1]; j++) full[r->dof[j]] = 0;
  }
  PetscCall(HycoGramRank(n, G, &rank));
  *dependent = n - rank;
  PetscCall(PetscFree(full));
  PetscCall(PetscFree2(G, row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFOMCountDependent(HycoFOM f, PetscInt *dependent)
{
  const PetscInt m = f->pairs.n, n_dof = f->fe_surface->n_dof;
  const size_t entries = (size_t)HycoPairsWidth(&f->pairs) * (size_t)f->fe->dim * (size_t)m;
  Rows r = {m, NULL, NULL, NULL, NULL};
  PetscBool *in, pressed = PETSC_FALSE;
  PetscInt n = 0;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  *dependent = 0;
  PetscCall(PetscMalloc5(m + 1, &r.start, entries, &r.dof, entries, &r.value, m, &r.gap, m, &in));
  ierr = HycoContactRows(f->fe_surface, &f->pairs, r.start, r.dof, r.value, r.gap);
  if (!ierr) MarkClosed(f, &r, in);
  if (!ierr) ierr = Peel(&r, n_dof, in);
  for (PetscInt k = 0; k < m && !ierr; k++) {
    n += in[k];
    pressed = (PetscBool)(pressed || (in[k] && f->lambda[k] > 0));
  }
  if (pressed) ierr = Dependent(&r, n_dof, n, in, dependent);
  PetscCall(PetscFree5(r.start, r.dof, r.value, r.gap, in));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
