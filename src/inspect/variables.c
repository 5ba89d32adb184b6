/* What each variable affects, from the entries that contain it. */
#include "inspect.h"
#include <hycomaterialimpl.h>

const char *const HycoAffectedNames[HYCO_N_AFFECTED] = {"maps", "stiffness", "laws",  "temperatures", "contact rows",
                                                        "gaps", "friction",  "loads", "supports"};

/* Components that are not given are NULL, and never change. */
static PetscBool AnyChanges(HycoExpr const e[3], const PetscBool changed[])
{
  return (PetscBool)(HycoExprChanges(e[0], changed) || HycoExprChanges(e[1], changed) ||
                     HycoExprChanges(e[2], changed));
}

/* A variable reaches what its entries do; a map moves everything on its body. */
static void FindReach(HycoScene s, PetscInt p, PetscBool does[HYCO_N_AFFECTED])
{
  PetscBool changed[HYCO_MAX_PARAMETERS] = {PETSC_FALSE};
  HycoChanges c;

  changed[p] = PETSC_TRUE;
  c = HycoSceneChanges(s, changed);
  does[HYCO_AFFECTS_MAPS] = c.nodes;
  does[HYCO_AFFECTS_STIFFNESS] = c.stiffness;
  does[HYCO_AFFECTS_ROWS] = (PetscBool)(c.rows && s->n_contacts);
  for (PetscInt k = 0; k < s->n_contacts; k++) {
    const HycoContact contact = s->contact[k];

    /* The coefficient of friction is an entry of a contact too, but none of its gap; no entry is named "". */
    does[HYCO_AFFECTS_GAPS] =
        (PetscBool)(does[HYCO_AFFECTS_GAPS] || c.nodes || HycoDeclaredChanges(&contact->entries, "", changed));
    does[HYCO_AFFECTS_FRICTION] =
        (PetscBool)(does[HYCO_AFFECTS_FRICTION] || HycoExprChanges(contact->friction, changed));
  }
  does[HYCO_AFFECTS_LOADS] = HycoSceneLoadsChange(s, changed);
  for (PetscInt b = 0; b < s->n_bodies; b++) {
    const HycoMaterial law = s->body[b].law;
    HycoExpr const heat[3] = {s->body[b].temperature, s->body[b].reference, s->body[b].expansion};

    does[HYCO_AFFECTS_TEMPERATURES] = (PetscBool)(does[HYCO_AFFECTS_TEMPERATURES] || AnyChanges(heat, changed));
    /* What changes the stiffness is listed as that; constants of plastic laws change the stress alone. */
    for (PetscInt j = 0; j < law->constants.n && !c.stiffness; j++)
      does[HYCO_AFFECTS_LAWS] =
          (PetscBool)(does[HYCO_AFFECTS_LAWS] || HycoExprChanges(law->constants.entry[j].expr, changed));
  }
  for (PetscInt k = 0; k < s->n_fixed; k++)
    does[HYCO_AFFECTS_SUPPORTS] = (PetscBool)(does[HYCO_AFFECTS_SUPPORTS] || AnyChanges(s->fixed[k].value, changed) ||
                                              HycoExprChanges(s->fixed[k].normal, changed));
}

/* Parameters, then time and tables, as in the expressions: the report names what each affects. */
PetscErrorCode HycoInspectVariables(HycoInspection *in)
{
  HycoScene s = in->whole->scene;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < s->n_variables; p++) {
    in->variable[p].name = s->parameter[p];
    in->variable[p].wide = (PetscBool)(p < s->n_parameters && s->wide[p]);
    FindReach(s, p, in->variable[p].affects);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
