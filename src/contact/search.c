/*
  The queries of a search for masters: the projection of each slave node, and its position relative to the master. On
  one process they are answered one after the other; on several ranks each answers a part of them (team.c).
*/
#include "partners.h"

PetscErrorCode HycoPartnersJudge(HycoPartners *t, PetscInt slave, PetscReal tolerance, PetscReal small,
                                 HycoProjection *at, HycoVerdict *why)
{
  const PetscReal *out = HycoPartnersOutward(t, slave);
  PetscReal r[3];
  PetscBool past = PETSC_FALSE;

  PetscFunctionBegin;
  *why = HYCO_MET;
  HycoPartnersProject(t, slave, PETSC_FALSE, at);
  if (!at->n) {
    *why = HYCO_TURNED;
    HycoPartnersProject(t, slave, PETSC_TRUE, at);
  }
  if (*why == HYCO_MET && at->distance > tolerance) *why = HYCO_FAR;
  if (*why != HYCO_MET || !out || at->distance <= small) PetscFunctionReturn(PETSC_SUCCESS);
  HycoPartnersAcross(t, slave, at, r);
  if (PetscAbsReal(HycoDot(r, out)) < -HYCO_OPPOSED * at->distance) *why = HYCO_ASKEW;
  PetscCall(HycoPartnersIsPast(t, slave, at, &past));
  if (past) *why = HYCO_PAST;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On moved surfaces; n = 0: it has no master. */
static PetscErrorCode Follow(HycoPartners *t, PetscInt slave, PetscReal reach, HycoProjection *at)
{
  PetscBool past;

  PetscFunctionBegin;
  HycoPartnersProject(t, slave, PETSC_FALSE, at);
  if (at->n && at->distance > reach) at->n = 0;
  if (!at->n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoPartnersIsPast(t, slave, at, &past));
  if (past) at->n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AnswerAll(HycoPartners *t, const HycoQuery *q, PetscInt n, const PetscInt slave[],
                                HycoProjection at[], HycoVerdict why[])
{
  PetscFunctionBegin;
  if (n) PetscCall(HycoPartnersReady(t));
  for (PetscInt k = 0; k < n; k++) {
    why[k] = HYCO_MET;
    if (q->moved)
      PetscCall(Follow(t, slave[k], q->tolerance, &at[k]));
    else
      PetscCall(HycoPartnersJudge(t, slave[k], q->tolerance, q->small, &at[k], &why[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPartnersAnswer(HycoPartners *t, const HycoQuery *q, PetscInt n, const PetscInt slave[],
                                  HycoProjection at[], HycoVerdict why[])
{
  PetscFunctionBegin;
  HycoLogged(HYCO_EVENT_SEARCH, AnswerAll(t, q, n, slave, at, why));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoPartnersSearch(HycoPartners *t, const HycoQuery *q, PetscInt n, const PetscInt slave[],
                                  HycoProjection at[], HycoVerdict why[])
{
  PetscFunctionBegin;
  if (t->fe->team)
    PetscCall(HycoTeamSearch(t->fe->team, t, q, n, slave, at, why));
  else
    PetscCall(HycoPartnersAnswer(t, q, n, slave, at, why));
  PetscFunctionReturn(PETSC_SUCCESS);
}
