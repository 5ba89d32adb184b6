/* The condensed model's part of the model file: the grid's values, each field's degrees and data. */
#include <hycocondensed.h>
#include <stdio.h>

#define SETTLED "condensed/settled" /* -B K^-1 F; in older files "condensed/g" includes D */

static void Dataset(HycoCondensed c, PetscInt f, char path[64])
{
  if (c->exact_gap && f == HYCO_FIELD_GAP)
    (void)snprintf(path, 64, SETTLED);
  else
    (void)snprintf(path, 64, "condensed/%s", HycoGridFieldNames[f]);
}

/* How gaps and loads are evaluated from the scene. */
static PetscErrorCode MoveGiven(HycoH5 h, HycoCondensed c)
{
  PetscFunctionBegin;
  if (HycoH5Reads(h)) c->exact_gap = HycoH5Has(h, SETTLED);
  if (!c->exact_gap) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoH5Ints(h, "condensed/exact_loads", 0, 1, 1, &c->exact_loads));
  if (HycoH5Reads(h)) c->n_probes = c->exact_loads && HycoH5Has(h, "condensed/probes") ? -1 : 0;
  if (c->exact_loads && c->n_probes) PetscCall(HycoH5Real(h, "condensed/probes", &c->n_probes, 3, &c->probe));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The values of parameter p: ascending. */
static PetscErrorCode MoveValues(HycoH5 h, HycoROM m, PetscInt p)
{
  HycoCondensed c = (HycoCondensed)m->model->data;
  char path[64];

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(path, sizeof(path), "condensed/values_%d", (int)p));
  if (HycoH5Reads(h)) c->n[p] = -1;
  PetscCall(HycoH5Real(h, path, &c->n[p], 1, &c->x[p]));
  HycoCheck(c->n[p] > 0, "%s: %s is damaged", m->model->path, path);
  for (PetscInt k = 1; k < c->n[p]; k++)
    HycoCheck(c->x[p][k] > c->x[p][k - 1], "%s: %s is damaged", m->model->path, path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The data of the estimated errors, which older files do not have. */
static PetscErrorCode MoveLaw(HycoH5 h, HycoCondensed c)
{
  PetscFunctionBegin;
  if (HycoH5Reads(h) ? !HycoH5Has(h, "condensed/law") : !c->law) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoH5Real(h, "condensed/law", &c->dim, HYCO_N_LAWS, &c->law));
  PetscCall(HycoH5Int(h, "condensed/law_flat", 0, 1, &c->dim, 1, &c->flat));
  PetscCall(HycoH5Reals(h, "condensed/law_cut", 1, &c->cut));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MoveField(HycoH5 h, HycoROM m, PetscInt f)
{
  HycoCondensed c = (HycoCondensed)m->model->data;
  HycoGridField *field = &c->field[f];
  PetscInt n = HycoTensorSize(&field->tensor);
  char path[64];

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(path, sizeof(path), "condensed/degree_%s", HycoGridFieldNames[f]));
  PetscCall(HycoH5Ints(h, path, 0, PETSC_MAX_INT, c->dim, field->tensor.degree));
  for (PetscInt p = 0; p < c->dim; p++)
    HycoCheck(field->tensor.degree[p] < field->tensor.n[p], "%s: %s is damaged", m->model->path, path);
  Dataset(c, f, path);
  PetscCall(HycoH5Real(h, path, &n, field->rows, &field->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedMove(HycoROM m, HycoH5 h)
{
  HycoCondensed c = (HycoCondensed)m->model->data;
  PetscInt n;

  PetscFunctionBegin;
  if (m->model->scene->n_times) { /* already read: a model of paths has its own */
    PetscCall(HycoCondensedTakePath(m));
    PetscCall((*m->ops->load)(m, h));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  c->dim = m->model->scene->n_parameters;
  c->m = m->model->pairs.n;
  c->l = m->model->l;
  for (PetscInt p = 0; p < c->dim; p++) PetscCall(MoveValues(h, m, p));
  PetscCall(HycoH5Ints(h, "condensed/stiff", 0, 1, c->dim, c->stiff));
  PetscCall(HycoH5Ints(h, "condensed/affine", 0, 1, c->dim, c->affine));
  if (HycoH5Reads(h)) PetscCall(HycoCondensedAllocate(c));
  PetscCall(MoveGiven(h, c));
  PetscCall(HycoH5Reals(h, "condensed/left_out", 3, c->errors));
  PetscCall(MoveLaw(h, c));
  if (HycoH5Reads(h)) c->errors_u[0] = c->errors_u[1] = -1;
  if (HycoH5Has(h, "condensed/left_out_u")) PetscCall(HycoH5Reals(h, "condensed/left_out_u", 2, c->errors_u));
  n = HycoTensorSize(&c->field[HYCO_FIELD_GAP].tensor);
  PetscCall(HycoH5Real(h, "condensed/lambda", &n, c->m, &c->Lambda));
  n = HycoTensorSize(&c->field[HYCO_FIELD_G].tensor);
  PetscCall(HycoH5Real(h, "condensed/bounds", &n, 2, &c->bounds));
  for (PetscInt k = 0; k < n; k++)
    HycoCheck(c->bounds[2 * k] >= 0 && c->bounds[2 * k + 1] >= c->bounds[2 * k], "%s: condensed/bounds is damaged",
              m->model->path);
  for (PetscInt f = 0; f < HYCO_N_FIELDS; f++) PetscCall(MoveField(h, m, f));
  PetscFunctionReturn(PETSC_SUCCESS);
}
