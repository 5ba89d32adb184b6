/* The condensed model's part of the model file: the grid's values, each field's degrees and data. */
#include <hycocondensed.h>
#include <stdio.h>

#define SETTLED "condensed/settled" /* -B K^-1 F, which older files have in "condensed/g" with D */

static void Dataset(HycoCondensed c, PetscInt f, char path[64])
{
  if (c->exact_gap && f == HYCO_FIELD_GAP)
    (void)snprintf(path, 64, SETTLED);
  else
    (void)snprintf(path, 64, "condensed/%s", HycoGridFieldNames[f]);
}

PetscErrorCode HycoCondensedSave(HycoROM m, HycoH5 h)
{
  HycoCondensed c = (HycoCondensed)m->data;
  char path[64];

  PetscFunctionBegin;
  for (PetscInt p = 0; p < c->dim; p++) {
    PetscCall(PetscSNPrintf(path, sizeof(path), "condensed/values_%d", (int)p));
    PetscCall(HycoH5WriteReal(h, path, c->n[p], 1, c->x[p]));
  }
  PetscCall(HycoH5WriteInt(h, "condensed/stiff", c->dim, 1, c->stiff));
  PetscCall(HycoH5WriteInt(h, "condensed/affine", c->dim, 1, c->affine));
  PetscCall(HycoH5WriteInt(h, "condensed/exact_loads", 1, 1, &c->exact_loads));
  if (c->exact_loads && c->n_probes) PetscCall(HycoH5WriteReal(h, "condensed/probes", c->n_probes, 3, c->probe));
  PetscCall(HycoH5WriteReal(h, "condensed/left_out", 3, 1, c->errors));
  PetscCall(HycoH5WriteReal(h, "condensed/law", c->dim, HYCO_N_LAWS, c->law));
  PetscCall(HycoH5WriteInt(h, "condensed/law_flat", c->dim, 1, c->flat));
  PetscCall(HycoH5WriteReal(h, "condensed/law_cut", 1, 1, &c->cut));
  PetscCall(HycoH5WriteReal(h, "condensed/lambda", HycoTensorSize(&c->field[HYCO_FIELD_GAP].tensor), c->m, c->Lambda));
  PetscCall(HycoH5WriteReal(h, "condensed/bounds", HycoTensorSize(&c->field[HYCO_FIELD_G].tensor), 2, c->bounds));
  for (PetscInt f = 0; f < HYCO_N_FIELDS; f++) {
    const HycoGridField *field = &c->field[f];

    Dataset(c, f, path);
    PetscCall(HycoH5WriteReal(h, path, HycoTensorSize(&field->tensor), field->rows, field->data));
    PetscCall(PetscSNPrintf(path, sizeof(path), "condensed/degree_%s", HycoGridFieldNames[f]));
    PetscCall(HycoH5WriteInt(h, path, c->dim, 1, field->tensor.degree));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LoadFlags(HycoH5 h, const char name[], PetscInt n, PetscInt flags[])
{
  PetscInt *read, one = 1;

  PetscFunctionBegin;
  PetscCall(HycoH5LoadInt(h, name, 0, 1, &n, &one, &read));
  PetscCall(PetscArraycpy(flags, read, n));
  PetscCall(PetscFree(read));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* How gaps and loads come from the scene. */
static PetscErrorCode LoadGiven(HycoH5 h, HycoCondensed c)
{
  PetscInt three = 3;

  PetscFunctionBegin;
  c->exact_gap = HycoH5Has(h, SETTLED);
  if (!c->exact_gap) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(LoadFlags(h, "condensed/exact_loads", 1, &c->exact_loads));
  c->n_probes = -1;
  if (c->exact_loads && HycoH5Has(h, "condensed/probes"))
    PetscCall(HycoH5LoadReal(h, "condensed/probes", &c->n_probes, &three, &c->probe));
  else
    c->n_probes = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The values of parameter p: ascending. */
static PetscErrorCode LoadValues(HycoH5 h, HycoROM m, PetscInt p)
{
  HycoCondensed c = (HycoCondensed)m->data;
  char path[64];
  PetscInt one = 1;

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(path, sizeof(path), "condensed/values_%d", (int)p));
  c->n[p] = -1;
  PetscCall(HycoH5LoadReal(h, path, &c->n[p], &one, &c->x[p]));
  HycoCheck(c->n[p] > 0, "%s: %s is damaged", m->path, path);
  for (PetscInt k = 1; k < c->n[p]; k++) HycoCheck(c->x[p][k] > c->x[p][k - 1], "%s: %s is damaged", m->path, path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The law of the estimated errors, which older files do not have. */
static PetscErrorCode LoadLaw(HycoH5 h, HycoCondensed c)
{
  PetscInt laws = HYCO_N_LAWS;

  PetscFunctionBegin;
  if (!HycoH5Has(h, "condensed/law")) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoH5LoadReal(h, "condensed/law", &c->dim, &laws, &c->law));
  PetscCall(PetscMalloc1(c->dim + 1, &c->flat));
  PetscCall(LoadFlags(h, "condensed/law_flat", c->dim, c->flat));
  PetscCall(HycoH5ReadReal(h, "condensed/law_cut", 1, 1, &c->cut));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LoadField(HycoH5 h, HycoROM m, PetscInt f)
{
  HycoCondensed c = (HycoCondensed)m->data;
  HycoGridField *field = &c->field[f];
  PetscInt n = HycoTensorSize(&field->tensor), rows = field->rows, dim = c->dim, one = 1, *degree;
  char path[64];

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(path, sizeof(path), "condensed/degree_%s", HycoGridFieldNames[f]));
  PetscCall(HycoH5LoadInt(h, path, 0, PETSC_MAX_INT, &dim, &one, &degree));
  PetscCall(PetscArraycpy(field->tensor.degree, degree, dim));
  PetscCall(PetscFree(degree));
  for (PetscInt p = 0; p < dim; p++)
    HycoCheck(field->tensor.degree[p] < field->tensor.n[p], "%s: %s is damaged", m->path, path);
  Dataset(c, f, path);
  PetscCall(HycoH5LoadReal(h, path, &n, &rows, &field->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedLoad(HycoROM m, HycoH5 h)
{
  HycoCondensed c = (HycoCondensed)m->data;
  PetscInt n, three = 3, two = 2, one = 1;
  PetscReal *errors;

  PetscFunctionBegin;
  c->dim = m->scene->n_parameters;
  c->m = m->pairs.n;
  c->l = m->l;
  for (PetscInt p = 0; p < c->dim; p++) PetscCall(LoadValues(h, m, p));
  PetscCall(LoadFlags(h, "condensed/stiff", c->dim, c->stiff));
  PetscCall(LoadFlags(h, "condensed/affine", c->dim, c->affine));
  PetscCall(HycoCondensedAllocate(c));
  PetscCall(LoadGiven(h, c));
  PetscCall(HycoH5LoadReal(h, "condensed/left_out", &three, &one, &errors));
  PetscCall(PetscArraycpy(c->errors, errors, 3));
  PetscCall(PetscFree(errors));
  PetscCall(LoadLaw(h, c));
  c->errors_u[0] = c->errors_u[1] = -1;
  if (HycoH5Has(h, "condensed/left_out_u")) PetscCall(HycoH5ReadReal(h, "condensed/left_out_u", 2, 1, c->errors_u));
  n = HycoTensorSize(&c->field[HYCO_FIELD_GAP].tensor);
  PetscCall(HycoH5LoadReal(h, "condensed/lambda", &n, &c->m, &c->Lambda));
  n = HycoTensorSize(&c->field[HYCO_FIELD_G].tensor);
  PetscCall(HycoH5LoadReal(h, "condensed/bounds", &n, &two, &c->bounds));
  for (PetscInt k = 0; k < n; k++)
    HycoCheck(c->bounds[2 * k] >= 0 && c->bounds[2 * k + 1] >= c->bounds[2 * k], "%s: condensed/bounds is damaged",
              m->path);
  for (PetscInt f = 0; f < HYCO_N_FIELDS; f++) PetscCall(LoadField(h, m, f));
  PetscFunctionReturn(PETSC_SUCCESS);
}
