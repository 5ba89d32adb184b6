/*
  A search for masters on several ranks. Rank 0 halves the slave nodes by recursive bisection (M. Berger, S. Bokhari,
  IEEE Trans. Comput. C-36 (1987) 570-580), a block per rank. The patches that may contain the nearest points of a block
  are those nearer to its box than a bound of the distance to the nearest point. Each rank gets its block and these
  patches, in the order of the whole surface, so that its answers are those of a search on the whole surface.
*/
#include "partners.h"

/* Share of the coordinates' size: more than the round-off of a distance. */
#define ROUND_OFF 1e-12

/* Sent to all ranks before each search. */
typedef struct {
  PetscBool ends;
  PetscInt nf;
  HycoQuery query;
} Job;

typedef struct {
  HycoProjection at;
  HycoVerdict why;
} Answer;

/* The slave nodes of one rank and the patches of their search. Its nodes are the slaves, then the patches' nodes in
   ascending order. */
typedef struct {
  PetscInt n_slaves, n_patches, n_nodes; /* n_nodes: of the patches */
  PetscInt *patch, *global, *node;       /* numbers on rank 0 of the patches, of their nodes; the patches' nodes */
  PetscReal *X, *outward, *normal;       /* by node, by slave, by patch; x 3 */
} Part;
#define SIZES 3

static PetscInt Integers(const PetscInt size[SIZES], PetscInt nf)
{
  return (1 + nf) * size[1] + size[2];
}

static PetscInt Reals(const PetscInt size[SIZES])
{
  return 6 * size[0] + 3 * size[1] + 3 * size[2];
}

/* A part in the two arrays in which it is sent. */
static void PartSet(Part *p, const PetscInt size[SIZES], PetscInt integer[], PetscReal real[])
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

/* On rank 0: the division of a search. */
typedef struct {
  const HycoPartners *t;
  const PetscInt *node;                 /* of the slaves, by their numbers in the search */
  HycoPoint *slave;                     /* the slaves in the order of the ranks */
  PetscReal *centre, *radius, at_least; /* balls around the patches; how far beyond its bound a block searches */
  PetscInt *first;                      /* ranks + 1: the slaves of each rank */
  PetscInt **patch, **global;           /* by rank, as in a part; owned */
  PetscInt *size;                       /* SIZES by rank */
  PetscInt *seen;                       /* by node of the search */
} Plan;

static PetscErrorCode PlanDestroy(Plan *p, PetscMPIInt ranks)
{
  PetscFunctionBegin;
  for (PetscMPIInt r = 0; r < ranks && p->patch; r++) {
    PetscCall(PetscFree(p->patch[r]));
    PetscCall(PetscFree(p->global[r]));
  }
  HycoFreeAll(&p->slave, &p->centre, &p->radius, &p->first, &p->patch, &p->global, &p->size, &p->seen);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The balls around the patches, and the margin for coincident points of HycoPartnersProject() and for round-off. */
static void SetBalls(Plan *p)
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
static PetscErrorCode FindNear(const Plan *p, PetscInt first, PetscInt last, PetscInt n, const PetscInt patch[],
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

/* Divides the slaves first .. last - 1, near n patches (owned), over the ranks from .. to - 1. */
static PetscErrorCode Divide(Plan *p, PetscMPIInt from, PetscMPIInt to, PetscInt first, PetscInt last, PetscInt n,
                             PetscInt *patch)
{
  const PetscMPIInt ranks[3] = {from, from + (to - from) / 2, to};
  PetscInt ends[3] = {first, 0, last}, axis = 0;
  PetscReal lo[3], hi[3];

  PetscFunctionBegin;
  if (to - from == 1) {
    p->first[to] = last;
    p->patch[from] = patch;
    p->size[SIZES * from] = last - first;
    p->size[SIZES * from + 1] = n;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  BlockBox(p->slave + first, last - first, lo, hi);
  for (PetscInt c = 1; c < 3; c++) axis = hi[c] - lo[c] > hi[axis] - lo[axis] ? c : axis;
  ends[1] = first + (PetscInt)((PetscInt64)(last - first) * (ranks[1] - from) / (to - from));
  HycoPointsSplit(p->slave, first, ends[1], last, axis);
  for (PetscInt half = 0; half < 2; half++) {
    PetscInt n_near, *near;

    PetscCall(FindNear(p, ends[half], ends[half + 1], n, patch, &n_near, &near));
    PetscCall(Divide(p, ranks[half], ranks[half + 1], ends[half], ends[half + 1], n_near, near));
  }
  PetscCall(PetscFree(patch));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lists the nodes of a rank's patches. */
static PetscErrorCode ListNodes(Plan *p, PetscMPIInt rank)
{
  const HycoPartners *t = p->t;
  PetscInt *size = p->size + SIZES * rank, *global;

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

static PetscErrorCode PlanCreate(const HycoPartners *t, PetscInt n, const PetscInt slave[], PetscMPIInt ranks, Plan *p)
{
  PetscInt *all;

  PetscFunctionBegin;
  p->t = t;
  p->node = slave;
  PetscCall(PetscCalloc1(SIZES * ranks, &p->size));
  PetscCall(PetscMalloc1(n, &p->slave));
  PetscCall(PetscCalloc1(3 * t->n, &p->centre));
  PetscCall(PetscCalloc1(t->n, &p->radius));
  PetscCall(PetscCalloc1(ranks + 1, &p->first));
  PetscCall(PetscCalloc1(ranks, &p->global));
  PetscCall(PetscCalloc1(ranks, &p->patch));
  PetscCall(PetscCalloc1(t->n_nodes, &p->seen));
  PetscCall(PetscMalloc1(t->n, &all));
  for (PetscInt k = 0; k < n; k++) {
    p->slave[k].index = k;
    PetscCall(PetscArraycpy(p->slave[k].x, t->X + 3 * slave[k], 3));
  }
  for (PetscInt k = 0; k < t->n; k++) all[k] = k;
  SetBalls(p);
  PetscCall(Divide(p, 0, ranks, 0, n, t->n, all));
  for (PetscMPIInt r = 0; r < ranks; r++) PetscCall(ListNodes(p, r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fills the arrays of a rank's part; seen[] then has the part's number of each of its nodes. */
static void Fill(Plan *p, PetscMPIInt rank, PetscInt integer[], PetscReal real[])
{
  const HycoPartners *t = p->t;
  Part part;

  PartSet(&part, p->size + SIZES * rank, integer, real);
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

/* The answers to a part's queries, with the numbers of rank 0. */
static PetscErrorCode AnswerPart(const Job *job, const Part *part, Answer answer[])
{
  HycoPartners t = {.nf = job->nf, .n = part->n_patches, .node = part->node, .normal = part->normal};
  HycoProjection *at;
  HycoVerdict *why;
  PetscInt *slave;

  PetscFunctionBegin;
  t.X = part->X;
  t.n_nodes = part->n_slaves + part->n_nodes;
  t.outward = part->outward;
  PetscCall(PetscMalloc3(part->n_slaves, &at, part->n_slaves, &why, part->n_slaves, &slave));
  for (PetscInt k = 0; k < part->n_slaves; k++) slave[k] = k;
  PetscCall(HycoPartnersAnswer(&t, &job->query, part->n_slaves, slave, at, why));
  for (PetscInt k = 0; k < part->n_slaves; k++) {
    for (PetscInt a = 0; a < at[k].n; a++) at[k].node[a] = part->global[at[k].node[a] - part->n_slaves];
    if (at[k].n) at[k].patch = part->patch[at[k].patch];
    answer[k].at = at[k];
    answer[k].why = why[k];
  }
  PetscCall(PetscFree3(at, why, slave));
  PetscCall(HycoPartnersForget(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Room for a rank's own part, and its answers; on rank 0 also for the part of any other rank, and for all answers. */
typedef struct {
  PetscInt size[SIZES], *integer;
  PetscReal *real;
  Answer *mine, *all;
  PetscMPIInt *count, *offset; /* of the answers by rank */
} Room;

static PetscErrorCode RoomCreate(const Job *job, const Plan *plan, PetscMPIInt ranks, Room *r)
{
  PetscInt integers = Integers(r->size, job->nf), reals = Reals(r->size);

  PetscFunctionBegin;
  if (plan) PetscCall(PetscMalloc1(plan->first[ranks], &r->all));
  if (plan) PetscCall(PetscCalloc2(ranks, &r->count, ranks, &r->offset));
  for (PetscMPIInt k = 0; plan && k < ranks; k++) {
    const PetscInt *size = plan->size + SIZES * k;

    integers = PetscMax(integers, Integers(size, job->nf));
    reals = PetscMax(reals, Reals(size));
    r->count[k] = (PetscMPIInt)size[0];
    r->offset[k] = (PetscMPIInt)plan->first[k];
  }
  HycoCheck(integers < PETSC_MPI_INT_MAX && reals < PETSC_MPI_INT_MAX,
            "a rank's part of a contact's surfaces has %d facets, too many for MPI; use more ranks", (int)r->size[1]);
  PetscCall(PetscMalloc1(integers, &r->integer));
  PetscCall(PetscMalloc1(reals, &r->real));
  PetscCall(PetscCalloc1(r->size[0], &r->mine));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode RoomDestroy(Room *r)
{
  PetscFunctionBegin;
  HycoFreeAll(&r->integer, &r->real, &r->mine, &r->all);
  PetscCall(PetscFree2(r->count, r->offset));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sends each rank its part; rank 0's own comes last, because all pass through the same arrays. Allocates nothing. */
static PetscErrorCode Distribute(MPI_Comm comm, const Job *job, Plan *plan, PetscMPIInt ranks, Room *r)
{
  PetscFunctionBegin;
  for (PetscMPIInt k = ranks - 1; plan && k >= 0; k--) {
    const PetscInt *size = plan->size + SIZES * k;

    Fill(plan, k, r->integer, r->real);
    if (!k) break;
    PetscCallMPI(MPI_Send(r->integer, (PetscMPIInt)Integers(size, job->nf), MPIU_INT, k, 0, comm));
    PetscCallMPI(MPI_Send(r->real, (PetscMPIInt)Reals(size), MPIU_REAL, k, 0, comm));
  }
  if (plan) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Recv(r->integer, (PetscMPIInt)Integers(r->size, job->nf), MPIU_INT, 0, 0, comm, MPI_STATUS_IGNORE));
  PetscCallMPI(MPI_Recv(r->real, (PetscMPIInt)Reals(r->size), MPIU_REAL, 0, 0, comm, MPI_STATUS_IGNORE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Collect(MPI_Comm comm, const Room *r)
{
  MPI_Datatype type;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Type_contiguous((PetscMPIInt)sizeof(Answer), MPI_BYTE, &type));
  PetscCallMPI(MPI_Type_commit(&type));
  PetscCallMPI(MPI_Gatherv(r->mine, (PetscMPIInt)r->size[0], type, r->all, r->count, r->offset, type, 0, comm));
  PetscCallMPI(MPI_Type_free(&type));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Divides one search and answers it; plan: on rank 0, else NULL. On an error all ranks return. Collective. */
static PetscErrorCode Work(HycoTeam *team, const Job *job, Plan *plan, Room *r)
{
  PetscMPIInt ranks;
  Part part;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(team->comm, &ranks));
  PetscCallMPI(MPI_Scatter(plan ? plan->size : NULL, SIZES, MPIU_INT, r->size, SIZES, MPIU_INT, 0, team->comm));
  HycoOnEach(team->comm, RoomCreate(job, plan, ranks, r));
  PetscCall(Distribute(team->comm, job, plan, ranks, r));
  PartSet(&part, r->size, r->integer, r->real);
  team->queries += part.n_slaves;
  team->patches = PetscMax(team->patches, part.n_patches);
  HycoOnEach(team->comm, AnswerPart(job, &part, r->mine));
  PetscCall(Collect(team->comm, r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same on a rank that helps. */
static PetscErrorCode Help(HycoTeam *team, const Job *job)
{
  Room room = {.integer = NULL};
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoErrorSync(team->comm, PETSC_SUCCESS, "")); /* rank 0's plan */
  ierr = Work(team, job, NULL, &room);
  PetscCall(RoomDestroy(&room));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTeamSearch(HycoTeam *team, HycoPartners *t, const HycoQuery *query, PetscInt n,
                              const PetscInt slave[], HycoProjection at[], HycoVerdict why[])
{
  Job job;
  Plan plan = {.t = NULL};
  Room room = {.integer = NULL};
  PetscMPIInt ranks;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(team->comm, &ranks));
  PetscCall(PetscMemzero(&job, sizeof(job)));
  job.nf = t->nf;
  job.query = *query;
  team->whole = PetscMax(team->whole, t->n);
  PetscCallMPI(MPI_Bcast(&job, sizeof(job), MPI_BYTE, 0, team->comm));
  HycoOnEach(team->comm, PlanCreate(t, n, slave, ranks, &plan));
  ierr = Work(team, &job, &plan, &room);
  for (PetscInt k = 0; k < n && !ierr; k++) {
    at[plan.slave[k].index] = room.all[k].at;
    why[plan.slave[k].index] = room.all[k].why;
  }
  PetscCall(PlanDestroy(&plan, ranks));
  PetscCall(RoomDestroy(&room));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTeamServe(HycoTeam *team)
{
  Job job;

  PetscFunctionBegin;
  for (;;) {
    PetscCallMPI(MPI_Bcast(&job, sizeof(job), MPI_BYTE, 0, team->comm));
    if (job.ends) PetscFunctionReturn(PETSC_SUCCESS);
    (void)Help(team, &job); /* its error is also rank 0's, which raises it and dismisses the ranks */
  }
}

PetscErrorCode HycoTeamDismiss(HycoTeam *team)
{
  Job job;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(&job, sizeof(job)));
  job.ends = PETSC_TRUE;
  PetscCallMPI(MPI_Bcast(&job, sizeof(job), MPI_BYTE, 0, team->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}
