/* Given temperature fields of the bodies, and their thermal strains: expansion (T - reference), isotropic. */
#include <hycokinematics.h>

/* Only if a body has a temperature; others keep NULL. */
PetscErrorCode HycoHeatCreate(HycoFE fe)
{
  const PetscInt n = fe->mesh->n_cells * HycoElementGet(fe->mesh->type)->nq;
  PetscBool any = PETSC_FALSE;

  PetscFunctionBegin;
  for (PetscInt b = 0; b < fe->scene->n_bodies; b++) any = (PetscBool)(any || fe->scene->body[b].temperature);
  if (!any) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc1(n, &fe->temperature));
  PetscCall(PetscCalloc1(n, &fe->thermal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One cell: temperatures and strains at its points. T (K) and expansion (T - reference) at the integration points; a
   law may need T without an expansion. */
static PetscErrorCode SetCell(HycoFE fe, const HycoElement *el, PetscInt cell)
{
  const HycoBody *body = &fe->scene->body[fe->mesh->cell_body[cell]];
  PetscReal x[3 * HYCO_CELL_POINTS], reference[HYCO_CELL_POINTS], expansion[HYCO_CELL_POINTS],
      *T = fe->temperature + cell * el->nq;

  PetscFunctionBegin;
  for (PetscInt q = 0; q < el->nq; q++) HycoPointPlace(fe, el, cell, q, x + 3 * q);
  PetscCall(HycoExprEval(body->temperature, fe->mu, el->nq, x, T));
  for (PetscInt q = 0; q < el->nq; q++) {
    char place[HYCO_LINE];

    /* Also NaN fails here: laws take logarithms and exponentials of T. */
    if (T[q] >= 0) continue;
    PetscCall(HycoExprPlace(body->temperature, fe->mu, x + 3 * q, place));
    HycoFail("%s is %g at %s; a temperature is in kelvin and not below 0", HycoExprKey(body->temperature), (double)T[q],
             place);
  }
  if (!body->expansion) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoExprEval(body->reference, fe->mu, el->nq, x, reference));
  /* The coefficient may depend on T: it is the mean one from the reference to T, not the slope at T. */
  PetscCall(HycoExprEvalHot(body->expansion, fe->mu, el->nq, x, T, expansion));
  for (PetscInt q = 0; q < el->nq; q++)
    HycoCheck(reference[q] >= 0, "%s is %g; a temperature is in kelvin and not below 0", HycoExprKey(body->reference),
              (double)reference[q]);
  for (PetscInt q = 0; q < el->nq; q++) fe->thermal[cell * el->nq + q] = expansion[q] * (T[q] - reference[q]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Only bodies whose expressions changed; all after the nodes moved. Not collective. Temperatures are at integration
   points: laws and thermal strains read them there. */
PetscErrorCode HycoFESetHeat(HycoFE fe, PetscBool all, const PetscBool changed[])
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);

  PetscFunctionBegin;
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++) {
    const HycoBody *body = &fe->scene->body[fe->mesh->cell_body[e]];

    if (body->temperature && (all || HycoExprChanges(body->temperature, changed) ||
                              HycoExprChanges(body->reference, changed) || HycoExprChanges(body->expansion, changed)))
      PetscCall(SetCell(fe, el, e));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
