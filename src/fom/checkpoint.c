/*
  A checkpoint file with a path's last accepted step: displacements and forces of the nodes by their tags, the state of
  the cells by their tags, the contact forces in the contacts' order, so that another number of ranks can resume.
  Written completely or not at all, after each accepted step; the fields of a series are in separate files beside it.
*/
#include <hycofields.h>
#include <hycopath.h>
#include <stddef.h>
#include <string.h>
#include <unistd.h>

#define FORMAT 1

/* A HycoStep as reals. */
typedef struct {
  size_t at;
  PetscBool is_int;
} Member;
#define INT(name)                                                                                                      \
  {                                                                                                                    \
    offsetof(HycoStep, name), PETSC_TRUE                                                                               \
  }
#define REAL(name)                                                                                                     \
  {                                                                                                                    \
    offsetof(HycoStep, name), PETSC_FALSE                                                                              \
  }
static const Member member[] = {INT(index),          REAL(t),
                                INT(substeps),       INT(cuts),
                                INT(iterations),     INT(most_iterations),
                                INT(factors),        INT(active_set_iterations),
                                INT(n_active),       REAL(total_contact_force),
                                REAL(lambda_max),    REAL(u_norm2),
                                REAL(mises),         REAL(inelastic),
                                REAL(residual),      REAL(kkt),
                                REAL(work),          REAL(contact_work),
                                REAL(stored),        REAL(dissipated),
                                REAL(thermal),       REAL(energy_defect),
                                REAL(seconds),       REAL(seconds_factor),
                                REAL(seconds_solve), REAL(seconds_law)};
/* Behind the quantities: what older checkpoints do not have. */
static const Member later[] = {INT(linear_iterations), INT(most_linear_iterations),
                               REAL(friction_work),    INT(n_slipping),
                               INT(disproven),         REAL(sliding),
                               INT(n_dependent)};
#define N_MEMBERS ((PetscInt)(sizeof(member) / sizeof(member[0])))
#define N_LATER   ((PetscInt)(sizeof(later) / sizeof(later[0])))

#define STEP_COLS(f) (N_MEMBERS + (f)->scene->n_quantities + N_LATER)

/* All members in one array of reals: an int32 is exact in a double. */
static void MembersToReals(PetscInt n, const Member m[], const HycoStep *s, PetscReal v[])
{
  for (PetscInt j = 0; j < n; j++) {
    const char *at = (const char *)s + m[j].at;

    v[j] = m[j].is_int ? (PetscReal) * (const PetscInt *)(const void *)at : *(const PetscReal *)(const void *)at;
  }
}

/* The reverse of what was written: integers are stored as reals, exactly up to 2^53. */
static void RealsToMembers(PetscInt n, const Member m[], const PetscReal v[], HycoStep *s)
{
  for (PetscInt j = 0; j < n; j++) {
    char *at = (char *)s + m[j].at;

    if (m[j].is_int)
      *(PetscInt *)(void *)at = (PetscInt)v[j];
    else
      *(PetscReal *)(void *)at = v[j];
  }
}

/* A row of the file: members, outputs, then what later versions added, so that older rows are a beginning of it. */
static void StepToReals(HycoFOM f, const HycoStep *s, PetscReal v[])
{
  const PetscInt n = f->scene->n_quantities;

  MembersToReals(N_MEMBERS, member, s, v);
  for (PetscInt k = 0; k < n; k++) v[N_MEMBERS + k] = s->quantity[k];
  MembersToReals(N_LATER, later, s, v + N_MEMBERS + n);
}

/* Missing columns of older files are 0 (LoadSteps()). */
static void RealsToStep(HycoFOM f, const PetscReal v[], HycoStep *s)
{
  const PetscInt n = f->scene->n_quantities;

  RealsToMembers(N_MEMBERS, member, v, s);
  for (PetscInt k = 0; k < n; k++) s->quantity[k] = v[N_MEMBERS + k];
  RealsToMembers(N_LATER, later, v + N_MEMBERS + n, s);
}

/* Columns of the file: U, F_old, f_old for a node; the state of a cell, as long as the longest one. */
#define NODE_COLS(f) (3 * (f)->part->dim)
/* A rectangular dataset needs one width: the longest state of any cell on any rank. */
static PetscErrorCode StateCols(HycoFOM f, PetscInt *cols)
{
  const PetscInt *start;
  PetscReal *value;

  PetscFunctionBegin;
  PetscCall(HycoFEStateGet(f->path->begin, &start, &value));
  *cols = 1;
  for (PetscInt e = 0; e < f->part->n_cells; e++) *cols = PetscMax(*cols, start[e + 1] - start[e]);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, cols, 1, MPIU_INT, MPI_MAX, HycoComm(f)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Identifies the scene and the point of a checkpoint. Scene, mesh, point and outputs: a checkpoint of another one
   would resume silently wrong. */
static PetscErrorCode CheckpointIdentify(HycoFOM f, char text[HYCO_LINE])
{
  HycoScene scene = f->scene;
  unsigned long long hash;

  PetscFunctionBegin;
  PetscCall(HycoSceneFingerprint(scene, &hash));
  /* Bit for bit: a resumed path must be the same path. */
  hash = HycoHash(hash, f->path->mu, (size_t)scene->n_parameters * sizeof(PetscReal));
  for (PetscInt k = 0; k < scene->n_entries; k++) { /* the stored steps contain the outputs */
    if (strncasecmp(scene->key[k], "output_", 7)) continue;
    hash = HycoHash(hash, scene->key[k], strlen(scene->key[k]) + 1);
    hash = HycoHash(hash, scene->value[k], strlen(scene->value[k]) + 1);
  }
  HycoFormat(text, "%016llx", hash);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies nodes' values (n_nodes of the part x NODE_COLS) from or to the vectors; owned nodes only. */
static PetscErrorCode MoveNodes(HycoFOM f, PetscBool out, PetscReal value[])
{
  const PetscInt dim = f->part->dim, cols = NODE_COLS(f);
  Vec vec[3] = {f->U, f->path->F_old, f->path->f_old};

  PetscFunctionBegin;
  for (PetscInt j = 0; j < 3; j++) {
    PetscScalar *v;

    PetscCall(VecGetArray(vec[j], &v));
    for (PetscInt i = 0; i < f->part->n_nodes; i++) {
      const PetscInt row = HycoMeshOwned(f->part, i);

      /* Owned nodes: ghosts follow from them after a resume. */
      for (PetscInt c = 0; row >= 0 && c < dim; c++) {
        PetscReal *at = value + i * cols + j * dim + c;

        if (out)
          *at = v[row * dim + c];
        else
          v[row * dim + c] = *at;
      }
    }
    PetscCall(VecRestoreArray(vec[j], &v));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* States are packed by cell; in the file each cell has a row of the same width. */
static PetscErrorCode MoveState(HycoFOM f, PetscBool out, PetscInt cols, PetscReal value[])
{
  const PetscInt *start;
  PetscReal *state;

  PetscFunctionBegin;
  /* Borrowed: the state is filled in place. */
  PetscCall(HycoFEStateGet(f->path->begin, &start, &state));
  for (PetscInt e = 0; e < f->part->n_cells; e++) {
    const PetscInt n = start[e + 1] - start[e];

    if (out)
      PetscCall(PetscArraycpy(value + e * cols, state + start[e], n));
    else
      PetscCall(PetscArraycpy(state + start[e], value + e * cols, n));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Number of reals that describe the position on the path. */
#define N_POSITION 8
#define N_HEAD                                                                                                         \
  (N_POSITION + (PetscInt)(sizeof(HycoWork) / sizeof(PetscReal)) + (PetscInt)(sizeof(HycoKKT) / sizeof(PetscReal)))
/* The numbers of a path that resume needs beside its fields. HycoWork and HycoKKT consist of reals alone. */
static void MoveHead(HycoPath p, PetscBool out, PetscReal head[])
{
  PetscReal *work = (PetscReal *)&p->work_done, *kkt = (PetscReal *)&p->kkt;
  const size_t n_work = sizeof(HycoWork) / sizeof(PetscReal), n_kkt = sizeof(HycoKKT) / sizeof(PetscReal);

  if (out) {
    head[0] = p->t;
    head[1] = p->dt;
    /* Exact: numbers of steps are below 2^53. */
    head[2] = (PetscReal)p->step;
    head[3] = (PetscReal)p->n_steps;
    head[4] = p->time_error;
    head[5] = p->largest;
    head[6] = p->ahead;
    head[7] = p->rated_by;
    memcpy(head + N_POSITION, work, n_work * sizeof(PetscReal));
    memcpy(head + N_POSITION + n_work, kkt, n_kkt * sizeof(PetscReal));
  } else {
    p->t = head[0];
    p->dt = head[1];
    p->step = (PetscInt)head[2];
    p->n_steps = (PetscInt)head[3];
    p->time_error = head[4];
    p->largest = head[5];
    p->ahead = head[6];
    p->rated_by = head[7];
    memcpy(work, head + N_POSITION, n_work * sizeof(PetscReal));
    memcpy(kkt, head + N_POSITION + n_work, n_kkt * sizeof(PetscReal));
  }
}

/* The data of a checkpoint except nodes and cells: on rank 0; after CheckpointSpread() on all, without the forces. */
typedef struct {
  PetscReal *lambda, *head, *steps, *orders, *taken; /* taken: none in older files */
  PetscInt cell_cols, n_steps, n_orders, n_taken;
} Content;

/* Rank 0. The key is compared before anything else is read. */
static PetscErrorCode WriteContent(HycoFOM f, HycoH5 h, const Content *c, const char key[])
{
  const PetscInt format = FORMAT;

  PetscFunctionBegin;
  PetscCall(HycoH5WriteInt(h, "checkpoint/format", 1, 1, &format));
  PetscCall(HycoH5WriteText(h, "checkpoint/key", key));
  PetscCall(HycoH5WriteReal(h, "head", N_HEAD, 1, c->head));
  /* One row more than listed times: the sums since the last one. */
  PetscCall(HycoH5WriteReal(h, "steps", c->n_steps + 1, STEP_COLS(f), c->steps));
  if (c->n_orders) PetscCall(HycoH5WriteReal(h, "orders", c->n_orders, 1, c->orders));
  PetscCall(HycoH5WriteReal(h, "taken", c->n_taken, 1, c->taken));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes nodes and cells, each rank its rows. In the file's order, so that another number of ranks can resume. */
static PetscErrorCode WriteItems(HycoFOM f, HycoH5 h)
{
  HycoMesh m = f->part;
  const HycoFileOrder *rows;
  PetscReal *node, *cell;
  PetscInt cols;

  PetscFunctionBegin;
  PetscCall(HycoFOMGetRows(f, &rows));
  /* The widest state of all ranks, so that rows have one length. */
  PetscCall(StateCols(f, &cols));
  PetscCall(PetscCalloc2(m->n_nodes * NODE_COLS(f), &node, m->n_cells * cols, &cell));
  PetscCall(MoveNodes(f, PETSC_TRUE, node));
  PetscCall(MoveState(f, PETSC_TRUE, cols, cell));
  PetscCall(HycoFieldWrite(h, rows, m->n_nodes, "node_tag", HYCO_ON_NODES, MPIU_INT, 1, 1, m->node_id));
  PetscCall(HycoFieldWrite(h, rows, m->n_nodes, "node", HYCO_ON_NODES, MPIU_REAL, NODE_COLS(f), NODE_COLS(f), node));
  PetscCall(HycoFieldWrite(h, rows, m->n_cells, "cell_tag", HYCO_ON_CELLS, MPIU_INT, 1, 1, m->cell_id));
  PetscCall(HycoFieldWrite(h, rows, m->n_cells, "cell", HYCO_ON_CELLS, MPIU_REAL, cols, cols, cell));
  PetscCall(PetscFree2(node, cell));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All ranks take part in each dataset but the content, which rank 0 writes alone. */
static PetscErrorCode WriteAll(HycoFOM f, HycoH5 h, const Content *c, const char key[])
{
  PetscFunctionBegin;
  HycoOnRoot(HycoComm(f), WriteContent(f, h, c, key));
  if (f->n_contacts) PetscCall(HycoFOMWriteForces(f, h, "lambda"));
  if (f->path->friction) PetscCall(HycoFrictionSave(f, h));
  PetscCall(WriteItems(f, h));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Also of a content that was read in part. */
static PetscErrorCode FreeContent(Content *c)
{
  PetscFunctionBegin;
  HycoFreeAll(&c->lambda, &c->head, &c->steps, &c->orders, &c->taken);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses to overwrite a file that is not a checkpoint. Models and snapshots are expensive to make. */
static PetscErrorCode CheckPlace(const char option[], const char path[])
{
  PetscBool precious;

  PetscFunctionBegin;
  if (access(path, F_OK)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoH5IsPrecious(path, &precious));
  HycoCheck(!precious, "%s %s is a model or a snapshot and is not overwritten; give the file another name", option,
            path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The listed time whose step is written for FCLIB. */
static PetscErrorCode CheckFclib(HycoFOM f)
{
  const HycoPath p = f->path;
  const PetscReal last = f->scene->times[f->scene->n_times - 1], tol = 1e-9 * (last - f->scene->times[0]);
  PetscBool listed = PETSC_FALSE;

  PetscFunctionBegin;
  HycoCheck(p->fclib[0], "-hyco_write_fclib_time needs a file; name it by -hyco_write_fclib FILE.h5");
  HycoCheck(f->path->friction, "-hyco_write_fclib is for contacts with friction, and this scene has none; remove it");
  if (!p->fclib_timed) p->fclib_time = last;
  for (PetscInt k = 0; k < f->scene->n_times && !listed; k++) {
    listed = (PetscBool)(PetscAbsReal(f->scene->times[k] - p->fclib_time) <= tol);
    if (listed) p->fclib_time = f->scene->times[k];
  }
  HycoCheck(listed, "-hyco_write_fclib_time %g is not one of the history's times", (double)p->fclib_time);
  PetscCall(CheckPlace("-hyco_write_fclib", p->fclib));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Before the path is computed, not after it. Collective. */
PetscErrorCode HycoPathCheckPlace(HycoFOM f)
{
  PetscFunctionBegin;
  if (f->path->checkpoint[0]) HycoOnRoot(HycoComm(f), CheckPlace("-hyco_checkpoint", f->path->checkpoint));
  if (f->path->fclib[0] || f->path->fclib_timed) HycoOnEach(HycoComm(f), CheckFclib(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes to a temporary file that replaces the former checkpoint at its close: an interruption leaves one that is
   complete. Collective. */
PetscErrorCode HycoPathSave(HycoFOM f)
{
  HycoPath p = f->path;
  Content c = {.n_steps = p->n_steps, .n_orders = p->n_orders, .n_taken = p->n_taken};
  char key[HYCO_LINE];
  HycoH5 h;
  PetscErrorCode ierr, failed;

  PetscFunctionBegin;
  if (!p->checkpoint[0]) PetscFunctionReturn(PETSC_SUCCESS);
  /* Collective: the fingerprint reads the mesh's numbers of all ranks. */
  PetscCall(CheckpointIdentify(f, key));
  PetscCall(PetscMalloc1(N_HEAD, &c.head));
  MoveHead(p, PETSC_TRUE, c.head);
  PetscCall(PetscMalloc1((p->n_steps + 1) * STEP_COLS(f), &c.steps));
  for (PetscInt k = 0; k < p->n_steps; k++) StepToReals(f, &p->steps[k], c.steps + k * STEP_COLS(f));
  StepToReals(f, &p->now, c.steps + p->n_steps * STEP_COLS(f));
  HycoDuplicate(p->n_orders, p->orders, &c.orders);
  HycoDuplicate(p->n_taken, p->taken, &c.taken);
  PetscCall(HycoH5CreateShared(HycoComm(f), p->checkpoint, &h));
  ierr = WriteAll(f, h, &c, key);
  /* Also after an error, without which the other ranks would wait. */
  failed = HycoH5Close(&h, (PetscBool)!ierr);
  PetscCall(FreeContent(&c));
  PetscCall(ierr ? ierr : failed);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What an older checkpoint does not have is 0. Number of stored steps (with the current one) and their reals. */
static PetscErrorCode LoadSteps(HycoFOM f, HycoH5 h, PetscInt *rows, PetscReal **steps)
{
  const PetscInt full = STEP_COLS(f);
  PetscInt cols;
  PetscReal *found;

  PetscFunctionBegin;
  PetscCall(HycoH5GetSize(h, "steps", rows, &cols));
  /* A width that no version has: the load below reports it. */
  if (cols < full - N_LATER || cols > full) cols = full;
  PetscCall(HycoH5LoadReal(h, "steps", rows, &cols, &found));
  PetscCall(PetscCalloc1(*rows * full + 1, steps));
  for (PetscInt k = 0; k < *rows; k++) PetscCall(PetscArraycpy(*steps + k * full, found + k * cols, cols));
  PetscCall(PetscFree(found));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks format, key and sizes before the path is changed. Rank 0. All of it into memory first: a damaged file leaves
   the path at its begin. */
static PetscErrorCode ReadOpened(HycoFOM f, HycoH5 h, const char key[], Content *c)
{
  char *text = NULL;
  PetscInt one = 1, rows = -1, *format = NULL, n_nodes, n_cells, cols;
  PetscBool same;

  PetscFunctionBegin;
  HycoCheck(HycoH5Has(h, "checkpoint/key"), "%s is not a checkpoint of a history", f->path->checkpoint);
  PetscCall(HycoH5LoadInt(h, "checkpoint/format", 1, FORMAT, &one, &one, &format));
  PetscCall(PetscFree(format));
  PetscCall(HycoH5LoadText(h, "checkpoint/key", &text));
  same = (PetscBool)(strcmp(text, key) == 0);
  PetscCall(PetscFree(text));
  HycoCheck(same,
            "the checkpoint %s belongs to another scene, mesh or point; remove -hyco_resume, or name another file",
            f->path->checkpoint);
  rows = N_HEAD;
  PetscCall(HycoH5LoadReal(h, "head", &rows, &one, &c->head));
  PetscCall(LoadSteps(f, h, &rows, &c->steps));
  c->n_steps = rows - 1;
  /* Before any allocation by these numbers. */
  HycoCheck(c->n_steps >= 0 && c->n_steps <= f->scene->n_times && c->head[2] >= 0 &&
                c->head[2] <= (PetscReal)f->scene->n_times && c->head[3] == (PetscReal)c->n_steps,
            "the checkpoint %s is damaged", f->path->checkpoint);
  rows = -1;
  /* Missing if no order was observed. */
  if (HycoH5Has(h, "orders")) PetscCall(HycoH5LoadReal(h, "orders", &rows, &one, &c->orders));
  c->n_orders = PetscMax(0, rows);
  rows = -1;
  if (HycoH5Has(h, "taken")) PetscCall(HycoH5LoadReal(h, "taken", &rows, &one, &c->taken));
  c->n_taken = PetscMax(0, rows);
  PetscCall(HycoH5GetSize(h, "node", &n_nodes, &cols));
  PetscCall(HycoH5GetSize(h, "cell", &n_cells, &c->cell_cols));
  HycoCheck(n_nodes == f->n_nodes && cols == NODE_COLS(f) && n_cells == f->n_cells, "the checkpoint %s is damaged",
            f->path->checkpoint);
  rows = f->n_contacts;
  if (rows) PetscCall(HycoH5LoadReal(h, "lambda", &rows, &one, &c->lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The file is closed on an error too. On rank 0; nodes and cells are read by each rank later, by ReadRows(). */
static PetscErrorCode ReadContent(HycoFOM f, const char key[], Content *c)
{
  HycoH5 h;

  PetscFunctionBegin;
  PetscCall(HycoH5OpenOr(f->path->checkpoint, "remove -hyco_resume", &h));
  HycoFinally(ReadOpened(f, h, key, c), PetscCall(HycoH5Close(&h, PETSC_FALSE)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sends n reals of rank 0 to every rank. */
static PetscErrorCode CheckpointSpread(HycoFOM f, PetscInt n, PetscReal **array)
{
  PetscMPIInt count;

  PetscFunctionBegin;
  PetscCall(PetscMPIIntCast(n, &count));
  if (f->rank) PetscCall(PetscMalloc1(n + 1, array));
  PetscCallMPI(MPI_Bcast(*array, count, MPIU_REAL, 0, HycoComm(f)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0 has read the small arrays; the sizes come first, since the others allocate by them. */
static PetscErrorCode SpreadContent(HycoFOM f, Content *c)
{
  PetscInt size[4] = {c->cell_cols, c->n_steps, c->n_orders, c->n_taken};

  PetscFunctionBegin;
  PetscCallMPI(MPI_Bcast(size, 4, MPIU_INT, 0, HycoComm(f)));
  c->cell_cols = size[0];
  c->n_steps = size[1];
  c->n_orders = size[2];
  c->n_taken = size[3];
  PetscCall(CheckpointSpread(f, N_HEAD, &c->head));
  PetscCall(CheckpointSpread(f, (c->n_steps + 1) * STEP_COLS(f), &c->steps));
  /* Empty arrays are not in the file. */
  if (c->n_orders) PetscCall(CheckpointSpread(f, c->n_orders, &c->orders));
  if (c->n_taken) PetscCall(CheckpointSpread(f, c->n_taken, &c->taken));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Opened for each dataset: the ranks read their rows at different times. */
static PetscErrorCode ReadRows(HycoFOM f, const char name[], PetscInt first, PetscInt n, PetscInt cols,
                               PetscReal rows[])
{
  HycoH5 h;

  PetscFunctionBegin;
  PetscCall(HycoH5OpenOr(f->path->checkpoint, "remove -hyco_resume", &h));
  HycoFinally(HycoH5ReadRows(h, name, first, n, cols, rows), PetscCall(HycoH5Close(&h, PETSC_FALSE)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads values of all nodes or cells of the part, each rank its rows. */
static PetscErrorCode ReadItems(HycoFOM f, const char name[], HycoPlace place, PetscInt cols, PetscReal value[])
{
  const HycoFileOrder *order;
  PetscReal *rows;

  PetscFunctionBegin;
  PetscCall(HycoFOMGetRows(f, &order));
  /* One rank: rows are the mesh's own order. */
  if (!order) {
    PetscCall(ReadRows(f, name, 0, place == HYCO_ON_CELLS ? f->n_cells : f->n_nodes, cols, value));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc1(order->n[place] * cols, &rows));
  HycoOnEach(HycoComm(f), ReadRows(f, name, order->first[place], order->n[place], cols, rows));
  PetscCall(HycoFileOrderFetch(order, f->part, place, cols, rows, value));
  PetscCall(PetscFree(rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Values of ghosts come with the parts; the columns of cells must be those of the present laws. */
static PetscErrorCode TakeContent(HycoFOM f, const Content *c)
{
  HycoPath p = f->path;
  PetscReal *mine;
  PetscInt cols;

  PetscFunctionBegin;
  PetscCall(StateCols(f, &cols));
  PetscCheck(cols == c->cell_cols, HycoComm(f), PETSC_ERR_USER,
             "the checkpoint has %d reals a cell, the laws have %d; remove -hyco_resume", (int)c->cell_cols, (int)cols);
  PetscCall(PetscMalloc1(f->part->n_nodes * NODE_COLS(f), &mine));
  PetscCall(ReadItems(f, "node", HYCO_ON_NODES, NODE_COLS(f), mine));
  PetscCall(MoveNodes(f, PETSC_FALSE, mine));
  PetscCall(PetscFree(mine));
  PetscCall(PetscMalloc1(f->part->n_cells * cols, &mine));
  PetscCall(ReadItems(f, "cell", HYCO_ON_CELLS, cols, mine));
  PetscCall(MoveState(f, PETSC_FALSE, cols, mine));
  PetscCall(PetscFree(mine));
  PetscCall(HycoFOMSetLambda(f, c->lambda));
  MoveHead(p, PETSC_FALSE, c->head);
  for (PetscInt k = 0; k < c->n_steps; k++) RealsToStep(f, c->steps + k * STEP_COLS(f), &p->steps[k]);
  RealsToStep(f, c->steps + c->n_steps * STEP_COLS(f), &p->now);
  PetscCall(PetscFree(p->orders));
  HycoDuplicate(c->n_orders, c->orders, &p->orders);
  /* Room without spare: the next entry makes more. */
  p->n_orders = p->room_orders = c->n_orders;
  PetscCall(PetscFree(p->taken));
  HycoDuplicate(c->n_taken, c->taken, &p->taken);
  p->n_taken = p->room_taken = c->n_taken;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Continues from the checkpoint, or leaves the path at its begin if there is no file. K, B, D are assembled at the
   resumed time; fields of earlier times come from the separate files. Collective. Then the path is where the run before
   was after its last accepted step, to the last bit; with friction but for
   the forces before the last ones, from which starts are extrapolated. */
PetscErrorCode HycoPathLoad(HycoFOM f)
{
  HycoPath p = f->path;
  Content c = {.n_steps = 0};
  char key[HYCO_LINE];
  PetscInt there = f->rank == 0 && access(p->checkpoint, F_OK) == 0;

  PetscFunctionBegin;
  PetscCheck(p->checkpoint[0], HycoComm(f), PETSC_ERR_USER,
             "-hyco_resume needs a checkpoint; name it by -hyco_checkpoint FILE.h5");
  PetscCallMPI(MPI_Bcast(&there, 1, MPIU_INT, 0, HycoComm(f)));
  if (!there) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CheckpointIdentify(f, key));
  HycoOnRoot(HycoComm(f), ReadContent(f, key, &c));
  PetscCall(SpreadContent(f, &c));
  PetscCall(TakeContent(f, &c));
  PetscCall(FreeContent(&c));
  /* Before the contacts' forces are used: B and the masters are those of the resumed time. */
  PetscCall(HycoPathAssemble(p, p->t)); /* quantities available without another step */
  if (f->path->friction) PetscCall(HycoFrictionLoad(f));
  PetscCall(HycoFOMGather(f));
  PetscCall(HycoSeriesRestore(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}
