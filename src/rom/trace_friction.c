/* The state of the contacts with friction at the listed times of a predicted path. */
#include <hycoromimpl.h>

/* The arrays of listed time k. */
static HycoShear ShearAt(HycoROM m, PetscInt k)
{
  const size_t n = (size_t)m->model->pairs.n;
  PetscReal *at = m->trace.shear + 8 * n * (size_t)k;

  return (HycoShear){.force = at, .slip = at + 3 * n, .work = at + 6 * n, .state = at + 7 * n};
}

/* After HycoTraceList(), which has made that time the shown one. */
PetscErrorCode HycoTraceListShear(HycoROM m, const HycoShear *shear)
{
  const HycoShear at = ShearAt(m, m->trace.shown);
  const PetscInt n = m->model->pairs.n;

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(at.force, shear->force, 3 * n));
  PetscCall(PetscArraycpy(at.slip, shear->slip, 3 * n));
  PetscCall(PetscArraycpy(at.work, shear->work, n));
  PetscCall(PetscArraycpy(at.state, shear->state, n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Both lists of contacts point to `seen`, a copy of the four addresses: the arrays are the trace's or the
   caller's. */
void HycoTraceShowOther(HycoROM m, const HycoShear *shear)
{
  m->trace.seen = *shear;
  m->pairs.shear = m->whole_pairs.shear = &m->trace.seen;
}

void HycoTraceShow(HycoROM m, PetscInt k)
{
  HycoShear shear;

  if (!m->trace.shear) return;
  shear = ShearAt(m, k);
  HycoTraceShowOther(m, &shear);
}
