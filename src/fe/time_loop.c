/* Integrates the laws along known displacements. */
#include <hycoinelastic.h>

/* Two states that alternate as begin and end, so that a step copies nothing. */
PetscErrorCode HycoTimeLoopBegin(HycoFE fe, HycoTimeLoop *m)
{
  PetscFunctionBegin;
  *m = (HycoTimeLoop){.fe = fe};
  PetscCall(HycoFEStateCreate(fe, &m->state));
  PetscCall(HycoFEStateCreate(fe, &m->end));
  PetscCall(PetscCalloc1(fe->n_dof, &m->f_int));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One step without tangents: u is known, and no equilibrium is solved. The internal forces stay in m->f_int (n_dof). */
PetscErrorCode HycoTimeLoopStep(HycoTimeLoop *m, const PetscReal u[], PetscReal t0, PetscReal t1,
                                HycoFEStepReport *report)
{
  const HycoFEState state = m->state;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(m->f_int, m->fe->n_dof));
  PetscCall(HycoFEStep(m->fe, u, t0, t1, m->state, m->end, m->f_int, PETSC_FALSE, report));
  /* The accepted state becomes the begin of the next step; the old one is overwritten by it. */
  m->state = m->end;
  m->end = state;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Frees what HycoTimeLoopBegin() allocated, also after a failed step. */
PetscErrorCode HycoTimeLoopEnd(HycoTimeLoop *m)
{
  PetscFunctionBegin;
  PetscCall(HycoFEStateDestroy(&m->state));
  PetscCall(HycoFEStateDestroy(&m->end));
  PetscCall(PetscFree(m->f_int));
  PetscFunctionReturn(PETSC_SUCCESS);
}
