/* A prediction: checks the parameters, solves by the type's op, reconstructs; and functions common to the types. */
#include <hycoromimpl.h>

/* Sizes of the model's mesh, not of fe's, which may have fewer nodes. The solver reads the options of the scene in
   the file. */
PetscErrorCode HycoROMSetUpFields(HycoROM m)
{
  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->model->pairs.n, &m->slave_id));
  for (PetscInt k = 0; k < m->model->pairs.n; k++) m->slave_id[k] = m->model->mesh->node_id[m->model->pairs.slave[k]];
  PetscCall(PetscCalloc1(m->model->l, &m->gamma));
  /* Zeros: nodes outside the RID are never written by some types. */
  PetscCall(PetscCalloc1(m->model->mesh->n_nodes * m->model->mesh->dim, &m->U));
  PetscCall(PetscCalloc1(m->model->pairs.n, &m->Lambda));
  PetscCall(PetscMalloc1(m->model->mesh->n_cells * m->fe->n_sigma, &m->stress));
  PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &m->solver));
  PetscCall(HycoOptionsInherit((PetscObject)m->solver, (PetscObject)m));
  PetscCall(HycoSolverSetFromOptions(m->solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For types without a reduced mesh: every contact has a multiplier of its own, Lambda is complete (spread). */
PetscErrorCode HycoROMSetUpDefault(HycoROM m)
{
  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  PetscCall(HycoFECreate(m->model->scene, m->model->mesh->dm, &m->fe));
  m->n = m->model->l;
  m->m = m->n_L = m->model->pairs.n;
  m->spread = PETSC_TRUE;
  m->of_fe = &m->pairs;
  PetscCall(PetscMalloc1(m->m, &m->contact));
  for (PetscInt k = 0; k < m->m; k++) m->contact[k] = k;
  PetscCall(HycoROMSetUpFields(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A handle's own pairs. Masters of moved surfaces change with each prediction, so that they are copied; otherwise
   the arrays of the model are used, which handles share. */
PetscErrorCode HycoROMTakePairs(const HycoPairs *of, HycoPairs *own)
{
  PetscFunctionBegin;
  if (of->room)
    PetscCall(HycoPairsRenumber(of, NULL, own));
  else
    *own = *of;
  own->geometry = NULL; /* what is kept of it is the handle's */
  own->drawn = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Arrays of the model are not freed: room is 0 for those that are shared. */
PetscErrorCode HycoROMDropPairs(HycoPairs *own)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(own->geometry));
  if (own->room) PetscCall(HycoPairsDestroy(own));
  PetscCall(PetscMemzero(own, sizeof(*own)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Once; a refusal (an error of options, say) leaves `ready` false, and the next call begins anew. */
PetscErrorCode HycoROMSetUp(HycoROM m)
{
  PetscFunctionBegin;
  if (m->ready) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoROMReset(m)); /* removes incomplete data after a refusal */
  PetscCall(HycoROMTakePairs(&m->model->pairs, &m->pairs));
  /* Zeroed, so that reset can free what setup had not made yet. */
  if (m->model->traits.work) PetscCall(PetscCalloc1(m->model->traits.work, (char **)&m->work));
  if (m->ops->setup)
    PetscUseTypeMethod(m, setup);
  else
    PetscCall(HycoROMSetUpDefault(m));
  m->ready = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The order: a solve on the RID, forces elsewhere (41), then the balance of floating bodies, which all forces
   enter. */
PetscErrorCode HycoROMPredict(HycoROM m, PetscInt n, const PetscReal mu[])
{
  HycoPrediction *p;
  PetscReal begin = HycoNow(), cpu = HycoCPU();

  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  p = &m->prediction;
  PetscCall(HycoInterruptCheck());
  PetscCall(HycoSceneCheckParameters(m->model->scene, n, mu));
  /* Before the set-up, so that after an error no getter returns the results of the prediction before. */
  m->solved = m->measured = m->whole_current = m->balanced = PETSC_FALSE;
  HycoLogged(HYCO_EVENT_SETUP, HycoROMSetUp(m));
  p->seconds.setup = HycoNow() - begin;
  begin = HycoNow();
  m->remainder = 0;
  m->imbalance = m->corrected = -1;
  p->loose = PETSC_FALSE;
  p->why[0] = m->loose[0] = '\0';
  PetscUseTypeMethod(m, solve, mu);
  PetscCall(PetscStrncpy(p->free_motion, p->loose ? m->loose : "", sizeof(p->free_motion)));
  /* a path is reconstructed at its listed times */
  if (m->ops->reconstruct && m->reconstruct && p->reason > 0 && !m->model->scene->n_times)
    HycoLogged(HYCO_EVENT_RECONSTRUCT, (*m->ops->reconstruct)(m));
  /* After the reconstruction: it scales all forces. */
  if (p->reason > 0 && !m->model->scene->n_times) PetscCall(HycoFloatingBalance(m));
  p->seconds.total = HycoNow() - begin;
  p->seconds.cpu = HycoCPU() - cpu;
  m->solved = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Recomputes the residuals at the contacts for a model that solves no system; its equilibrium is not measured. */
static void MeasureContacts(HycoROM m, HycoKKT *kkt)
{
  PetscReal size = 0, most = 0, in = 0, pulls = 0, both = 0;

  for (PetscInt k = 0; k < m->model->pairs.n; k++) {
    const PetscReal bu = HycoROMAddRow(m, k, 0);

    most = PetscMax(most, PetscAbsReal(m->Lambda[k]));
    size = PetscMax(size, PetscMax(PetscAbsReal(bu), PetscAbsReal(m->rows.gap[k])));
    in = PetscMax(in, bu - m->rows.gap[k]);
    pulls = PetscMax(pulls, -m->Lambda[k]);
  }
  /* Quotients first: products may overflow. */
  for (PetscInt k = 0; k < m->model->pairs.n && size > 0 && most > 0; k++)
    both = PetscMax(both, PetscAbsReal(HycoROMAddRow(m, k, -m->rows.gap[k]) / size * (m->Lambda[k] / most)));
  kkt->stationarity = kkt->rounding = 0;
  kkt->penetration = size > 0 ? in / size : 0;
  kkt->adhesion = most > 0 ? pulls / most : 0;
  kkt->complementarity = both;
}

/* For types without a system (regression): gamma and Lambda are given, and residuals are measured all the same. A
   NaN in either is a diverged prediction. */
PetscErrorCode HycoROMSetSolution(HycoROM m, const PetscReal mu[], const PetscReal gamma[], const PetscReal Lambda[])
{
  HycoPrediction *p = &m->prediction;
  PetscReal sum = 0;

  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  HycoCheckGiven(mu);
  PetscCheck(m->gamma, PETSC_COMM_SELF, PETSC_ERR_ORDER,
             "HycoROMSetSolution() is for a type's solve, after HycoROMSetUp()");
  if (gamma) PetscCall(PetscArraycpy(m->gamma, gamma, m->model->l));
  if (Lambda) PetscCall(PetscArraycpy(m->Lambda, Lambda, m->model->pairs.n));
  PetscCall(HycoROMBringRows(m, mu));
  PetscCall(HycoROMExpand(m));
  for (PetscInt j = 0; j < m->model->l; j++) sum += m->gamma[j];
  for (PetscInt k = 0; k < m->model->pairs.n; k++) sum += m->Lambda[k];
  /* Such a type satisfies no condition by construction: residuals are what it really misses. */
  MeasureContacts(m, &p->kkt);
  p->iterations = 0;
  p->reason = PetscIsInfOrNanReal(sum) ? HYCO_DIVERGED_RESIDUAL : HYCO_CONVERGED;
  PetscCall(PetscStrncpy(p->method, m->model->type, sizeof(p->method)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The type's op reads `work`; for a type without work it is called regardless. Only what setup makes goes:
   options, the model and its whole mesh stay. */
PetscErrorCode HycoROMReset(HycoROM m)
{
  PetscFunctionBegin;
  m->ready = m->solved = m->whole_current = m->beyond_current = PETSC_FALSE;
  if (m->work || !m->model->traits.work) PetscTryTypeMethod(m, reset);
  PetscCall(PetscFree(m->work));
  PetscCall(HycoOutputCellsDestroy(&m->output_cells));
  PetscCall(HycoOutputCellsDestroy(&m->few));
  PetscCall(HycoCarriedDestroy(&m->carried));
  for (PetscInt side = 0; side < 2; side++) PetscCall(HycoNearDestroy(&m->near[side]));
  PetscCall(HycoFEDestroy(&m->fe_floating));
  PetscCall(HycoSolverDestroy(&m->solver));
  PetscCall(HycoFEDestroy(&m->fe_beyond));
  PetscCall(HycoRowsDestroy(&m->rows));
  PetscCall(HycoFEDestroy(&m->fe));
  /* It points into data that the type has freed. */
  m->of_fe = NULL;
  PetscCall(HycoROMDropPairs(&m->pairs));
  PetscCall(HycoTraceFree(m));
  HycoFreeAll(&m->contact, &m->gamma, &m->U, &m->Lambda, &m->stress, &m->slave_id, &m->modal, &m->rigid);
  PetscFunctionReturn(PETSC_SUCCESS);
}
