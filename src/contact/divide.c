/*
  The division of a search for masters. Rank 0 halves the slave nodes by recursive bisection (M. Berger, S. Bokhari,
  IEEE Trans. Comput. C-36 (1987) 570-580), a block per rank. The patches that may contain the nearest points of a block
  are those nearer to its box than a bound of the distance to the nearest point. To find few of them, a rank's block is
  halved further, down to some slaves.
*/
#include "divide.h"

/* Share of the coordinates' size: more than the round-off of a distance. */
#define ROUND_OFF 1e-12
#define BLOCKS    64 /* into which a rank's slaves are halved to find the patches that they may meet */

void HycoTeamPartSet(HycoTeamPart *p, const PetscInt size[HYCO_TEAM_SIZES], PetscInt integer[], PetscReal real[])
{
  p->n_slaves = size[0];
  p->n_patches = size[1];
  p->n_nodes = size[2];
  p->patch = integer;
  p->global = p->patch + p->n_patches;
  p->node = p->global + p->n_nodes;
  p->X = real;
  p->outward = p->X + 3 * (p->n_slaves + p->n_nodes);
  p->normal = p->outward + 3 * p->n_slaves;
}

PetscErrorCode HycoTeamPlanDestroy(HycoTeamPlan *p)
{
  PetscFunctionBegin;
  for (PetscMPIInt r = 0; r < p->ranks && p->patch; r++) {
    PetscCall(PetscFree(p->patch[r]));
    PetscCall(PetscFree(p->global[r]));
  }
  HycoFreeAll(&p->slave, &p->centre, &p->radius, &p->first, &p->patch, &p->global, &p->size, &p->seen, &p->near);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The balls around the patches, and the margin for coincident points of HycoPartnersProject() and for round-off. */
static void SetBalls(HycoTeamPlan *p)
{
  const HycoPartners *t = p->t;
  PetscReal widest = 0, farthest = 0;

  for (PetscInt k = 0; k < t->n; k++) {
    PetscReal *centre = p->centre + 3 * k;

    for (PetscInt a = 0; a < t->nf; a++) {
      for (PetscInt c = 0; c < 3; c++) centre[c] += t->X[3 * t->node[k * t->nf + a] + c] / t->nf;
    }
    for (PetscInt a = 0; a < t->nf; a++)
      p->radius[k] = PetscMax(p->radius[k], HycoDistance(centre, t->X + 3 * t->node[k * t->nf + a]));
    widest = PetscMax(widest, p->radius[k]);
    farthest = PetscMax(farthest, HycoLength(centre) + p->radius[k]);
  }
  p->at_least = 2 * HYCO_SAME_POINT * widest + ROUND_OFF * farthest;
}

/* The box of a block of slaves. */
static void BlockBox(const HycoPoint slave[], PetscInt n, PetscReal lo[3], PetscReal hi[3])
{
  for (PetscInt c = 0; c < 3; c++) {
    lo[c] = PETSC_MAX_REAL;
    hi[c] = PETSC_MIN_REAL;
    for (PetscInt k = 0; k < n; k++) {
      lo[c] = PetscMin(lo[c], slave[k].x[c]);
      hi[c] = PetscMax(hi[c], slave[k].x[c]);
    }
  }
}

/* The distances of a point from the nearest and from the farthest point of a box. */
static void Distances(const PetscReal lo[3], const PetscReal hi[3], const PetscReal x[3], PetscReal *least,
                      PetscReal *most)
{
  PetscReal near[3], far[3];

  for (PetscInt c = 0; c < 3; c++) {
    near[c] = PetscMax(PetscMax(lo[c] - x[c], x[c] - hi[c]), 0);
    far[c] = PetscMax(hi[c] - x[c], x[c] - lo[c]);
  }
  *least = HycoLength(near);
  *most = HycoLength(far);
}

/* Of n patches, those that may contain the nearest point of a slave in the block, in the same order. No slave is
   farther from its nearest point than the farthest corner of the box from any node of the patches. */
static PetscErrorCode FindNear(const HycoTeamPlan *p, PetscInt first, PetscInt last, PetscInt n, const PetscInt patch[],
                               PetscInt *n_near, PetscInt **near)
{
  const HycoPartners *t = p->t;
  PetscReal lo[3], hi[3], least, most, reach = PETSC_MAX_REAL;

  PetscFunctionBegin;
  *n_near = 0;
  PetscCall(PetscMalloc1(n, near));
  BlockBox(p->slave + first, last - first, lo, hi);
  for (PetscInt k = 0; k < n && first < last; k++) {
    Distances(lo, hi, t->X + 3 * t->node[patch[k] * t->nf], &least, &most);
    reach = PetscMin(reach, most);
  }
  reach += p->at_least + ROUND_OFF * (HycoLength(lo) + HycoLength(hi));
  for (PetscInt k = 0; k < n && first < last; k++) {
    Distances(lo, hi, p->centre + 3 * patch[k], &least, &most);
    if (least - p->radius[patch[k]] <= reach) (*near)[(*n_near)++] = patch[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rearranges the slaves first .. last - 1 along the longest side of their box: those before `mid` come first. */
static void Halve(HycoTeamPlan *p, PetscInt first, PetscInt mid, PetscInt last)
{
  PetscReal lo[3], hi[3];
  PetscInt axis = 0;

  BlockBox(p->slave + first, last - first, lo, hi);
  for (PetscInt c = 1; c < 3; c++) axis = hi[c] - lo[c] > hi[axis] - lo[axis] ? c : axis;
  HycoPointsSplit(p->slave, first, mid, last, axis);
}

/* Marks those of n patches that may contain nearest points of the slaves first .. last - 1, divided into blocks. */
static PetscErrorCode MarkNear(HycoTeamPlan *p, PetscInt blocks, PetscInt first, PetscInt last, PetscInt n,
                               const PetscInt patch[])
{
  const PetscInt ends[3] = {first, (first + last) / 2, last};

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n && blocks == 1; k++) p->near[patch[k]] = PETSC_TRUE;
  if (blocks > 1) Halve(p, first, ends[1], last);
  for (PetscInt half = 0; half < 2 && blocks > 1; half++) {
    PetscInt n_near, *near;
    PetscErrorCode ierr;

    PetscCall(FindNear(p, ends[half], ends[half + 1], n, patch, &n_near, &near));
    ierr = MarkNear(p, blocks / 2, ends[half], ends[half + 1], n_near, near);
    PetscCall(PetscFree(near));
    PetscCall(ierr);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gives the slaves first .. last - 1 to a rank, with those of n patches that they may meet. */
static PetscErrorCode Assign(HycoTeamPlan *p, PetscMPIInt rank, PetscInt first, PetscInt last, PetscInt n,
                             const PetscInt patch[])
{
  PetscInt *size = p->size + HYCO_TEAM_SIZES * rank, n_near = 0;

  PetscFunctionBegin;
  PetscCall(MarkNear(p, BLOCKS, first, last, n, patch));
  for (PetscInt k = 0; k < n; k++) n_near += p->near[patch[k]];
  PetscCall(PetscMalloc1(n_near, &p->patch[rank]));
  p->first[rank + 1] = last;
  size[0] = last - first;
  size[1] = n_near;
  n_near = 0;
  for (PetscInt k = 0; k < n; k++) {
    if (p->near[patch[k]]) p->patch[rank][n_near++] = patch[k];
    p->near[patch[k]] = PETSC_FALSE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Divides the slaves first .. last - 1, near n patches, over the ranks from .. to - 1. */
static PetscErrorCode Divide(HycoTeamPlan *p, PetscMPIInt from, PetscMPIInt to, PetscInt first, PetscInt last,
                             PetscInt n, const PetscInt patch[])
{
  const PetscMPIInt ranks[3] = {from, from + (to - from) / 2, to};
  const PetscInt ends[3] = {first, first + (PetscInt)((PetscInt64)(last - first) * (ranks[1] - from) / (to - from)),
                            last};

  PetscFunctionBegin;
  if (to - from == 1) {
    PetscCall(Assign(p, from, first, last, n, patch));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  Halve(p, first, ends[1], last);
  for (PetscInt half = 0; half < 2; half++) {
    PetscInt n_near, *near;
    PetscErrorCode ierr;

    PetscCall(FindNear(p, ends[half], ends[half + 1], n, patch, &n_near, &near));
    ierr = Divide(p, ranks[half], ranks[half + 1], ends[half], ends[half + 1], n_near, near);
    PetscCall(PetscFree(near));
    PetscCall(ierr);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lists the nodes of a rank's patches. */
static PetscErrorCode ListNodes(HycoTeamPlan *p, PetscMPIInt rank)
{
  const HycoPartners *t = p->t;
  PetscInt *size = p->size + HYCO_TEAM_SIZES * rank, *global;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(PetscMin(size[1] * t->nf, t->n_nodes), &global));
  p->global[rank] = global;
  for (PetscInt k = 0; k < size[1] * t->nf; k++) {
    const PetscInt node = t->node[p->patch[rank][k / t->nf] * t->nf + k % t->nf];

    if (p->seen[node] == rank + 1) continue;
    p->seen[node] = rank + 1;
    global[size[2]++] = node;
  }
  PetscCall(PetscSortInt(size[2], global));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTeamPlanCreate(const HycoPartners *t, PetscInt n, const PetscInt slave[], PetscMPIInt ranks,
                                  HycoTeamPlan *p)
{
  PetscInt *all;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  p->t = t;
  p->ranks = ranks;
  p->node = slave;
  PetscCall(PetscCalloc1(HYCO_TEAM_SIZES * ranks, &p->size));
  PetscCall(PetscMalloc1(n, &p->slave));
  PetscCall(PetscCalloc1(3 * t->n, &p->centre));
  PetscCall(PetscCalloc1(t->n, &p->radius));
  PetscCall(PetscCalloc1(ranks + 1, &p->first));
  PetscCall(PetscCalloc1(ranks, &p->global));
  PetscCall(PetscCalloc1(ranks, &p->patch));
  PetscCall(PetscCalloc1(t->n_nodes, &p->seen));
  PetscCall(PetscCalloc1(t->n, &p->near));
  PetscCall(PetscMalloc1(t->n, &all));
  for (PetscInt k = 0; k < n; k++) {
    p->slave[k].index = k;
    PetscCall(PetscArraycpy(p->slave[k].x, t->X + 3 * slave[k], 3));
  }
  for (PetscInt k = 0; k < t->n; k++) all[k] = k;
  SetBalls(p);
  ierr = Divide(p, 0, ranks, 0, n, t->n, all);
  PetscCall(PetscFree(all));
  PetscCall(ierr);
  for (PetscMPIInt r = 0; r < ranks; r++) PetscCall(ListNodes(p, r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void HycoTeamPlanFill(HycoTeamPlan *p, PetscMPIInt rank, PetscInt integer[], PetscReal real[])
{
  const HycoPartners *t = p->t;
  HycoTeamPart part;

  HycoTeamPartSet(&part, p->size + HYCO_TEAM_SIZES * rank, integer, real);
  for (PetscInt k = 0; k < part.n_slaves; k++) {
    const PetscInt node = p->node[p->slave[p->first[rank] + k].index];

    for (PetscInt c = 0; c < 3; c++) {
      part.X[3 * k + c] = t->X[3 * node + c];
      part.outward[3 * k + c] = t->outward[3 * node + c];
    }
  }
  for (PetscInt i = 0; i < part.n_nodes; i++) {
    part.global[i] = p->global[rank][i];
    p->seen[part.global[i]] = part.n_slaves + i;
    for (PetscInt c = 0; c < 3; c++) part.X[3 * (part.n_slaves + i) + c] = t->X[3 * part.global[i] + c];
  }
  for (PetscInt k = 0; k < part.n_patches; k++) {
    part.patch[k] = p->patch[rank][k];
    for (PetscInt a = 0; a < t->nf; a++) part.node[k * t->nf + a] = p->seen[t->node[part.patch[k] * t->nf + a]];
    for (PetscInt c = 0; c < 3; c++) part.normal[3 * k + c] = t->normal[3 * part.patch[k] + c];
  }
}
