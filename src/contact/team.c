/*
  A search for masters on several ranks. Each rank gets a block of the slave nodes and the patches that may contain
  their nearest points (divide.c), in the order of the whole surface, so that its answers are those of a search on the
  whole surface.
*/
#include "divide.h"

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

/* The answers to a part's queries, with the numbers of rank 0. */
static PetscErrorCode AnswerPart(const Job *job, const HycoTeamPart *part, Answer answer[])
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
  PetscInt size[HYCO_TEAM_SIZES], *integer;
  PetscReal *real;
  Answer *mine, *all;
  PetscMPIInt *count, *offset; /* of the answers by rank */
} Room;

static PetscErrorCode RoomCreate(const Job *job, const HycoTeamPlan *plan, Room *r)
{
  PetscInt integers = HycoTeamIntegers(r->size, job->nf), reals = HycoTeamReals(r->size);

  PetscFunctionBegin;
  if (plan) PetscCall(PetscMalloc1(plan->first[plan->ranks], &r->all));
  if (plan) PetscCall(PetscCalloc2(plan->ranks, &r->count, plan->ranks, &r->offset));
  for (PetscMPIInt k = 0; plan && k < plan->ranks; k++) {
    const PetscInt *size = plan->size + HYCO_TEAM_SIZES * k;

    integers = PetscMax(integers, HycoTeamIntegers(size, job->nf));
    reals = PetscMax(reals, HycoTeamReals(size));
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
static PetscErrorCode Distribute(MPI_Comm comm, const Job *job, HycoTeamPlan *plan, Room *r)
{
  PetscFunctionBegin;
  for (PetscMPIInt k = plan ? plan->ranks - 1 : -1; k >= 0; k--) {
    const PetscInt *size = plan->size + HYCO_TEAM_SIZES * k;

    HycoTeamPlanFill(plan, k, r->integer, r->real);
    if (!k) break;
    PetscCallMPI(MPI_Send(r->integer, (PetscMPIInt)HycoTeamIntegers(size, job->nf), MPIU_INT, k, 0, comm));
    PetscCallMPI(MPI_Send(r->real, (PetscMPIInt)HycoTeamReals(size), MPIU_REAL, k, 0, comm));
  }
  if (plan) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(
      MPI_Recv(r->integer, (PetscMPIInt)HycoTeamIntegers(r->size, job->nf), MPIU_INT, 0, 0, comm, MPI_STATUS_IGNORE));
  PetscCallMPI(MPI_Recv(r->real, (PetscMPIInt)HycoTeamReals(r->size), MPIU_REAL, 0, 0, comm, MPI_STATUS_IGNORE));
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
static PetscErrorCode Work(HycoTeam *team, const Job *job, HycoTeamPlan *plan, Room *r)
{
  HycoTeamPart part;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Scatter(plan ? plan->size : NULL, HYCO_TEAM_SIZES, MPIU_INT, r->size, HYCO_TEAM_SIZES, MPIU_INT, 0,
                           team->comm));
  HycoOnEach(team->comm, RoomCreate(job, plan, r));
  PetscCall(Distribute(team->comm, job, plan, r));
  HycoTeamPartSet(&part, r->size, r->integer, r->real);
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

/* Plans a search, divides it, and sorts its answers. */
static PetscErrorCode Lead(HycoTeam *team, const Job *job, const HycoPartners *t, PetscInt n, const PetscInt slave[],
                           HycoTeamPlan *plan, Room *room, HycoProjection at[], HycoVerdict why[])
{
  PetscMPIInt ranks;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(team->comm, &ranks));
  HycoOnEach(team->comm, HycoTeamPlanCreate(t, n, slave, ranks, plan));
  PetscCall(Work(team, job, plan, room));
  for (PetscInt k = 0; k < n; k++) {
    at[plan->slave[k].index] = room->all[k].at;
    why[plan->slave[k].index] = room->all[k].why;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTeamSearch(HycoTeam *team, HycoPartners *t, const HycoQuery *query, PetscInt n,
                              const PetscInt slave[], HycoProjection at[], HycoVerdict why[])
{
  Job job;
  HycoTeamPlan plan = {.t = NULL};
  Room room = {.integer = NULL};
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(&job, sizeof(job)));
  job.nf = t->nf;
  job.query = *query;
  team->whole = PetscMax(team->whole, t->n);
  PetscCallMPI(MPI_Bcast(&job, sizeof(job), MPI_BYTE, 0, team->comm));
  ierr = Lead(team, &job, t, n, slave, &plan, &room, at, why);
  PetscCall(HycoTeamPlanDestroy(&plan));
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
