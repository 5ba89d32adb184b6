/* HycoSnapshots: a folder with one file for each parameter value, complete or absent. */
#include <hycopath.h>
#include <hycosnapshotsimpl.h>
#include <hycofields.h>
#include <hycofile.h>
#include <hycoh5.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* An existing folder is used as it is: solutions in it are kept. What killed runs left is removed. Rank 0. An
   existing folder is the usual case: a run that was killed goes on where it was. */
static PetscErrorCode MakeFolder(const char folder[])
{
  struct stat info;
  char all[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  HycoCheck(strlen(folder) < PETSC_MAX_PATH_LEN - 64, "the snapshot folder's name is too long");
  if (mkdir(folder, 0777) != 0) {
    HycoCheck(errno == EEXIST && stat(folder, &info) == 0 && S_ISDIR(info.st_mode),
              "the snapshot folder %s cannot be created; check that its parent folder exists and is writable", folder);
  }
  /* Tried now: the first solution may take an hour. */
  HycoCheck(access(folder, W_OK) == 0, "the snapshot folder %s is not writable", folder);
  snprintf(all, sizeof(all), "%s/", folder);
  /* Files under temporary names of processes that are gone. */
  PetscCall(HycoFileSweep(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0 makes the folder before any rank opens a file in it. The fingerprint is of scene and mesh: solutions of
   another one are refused by it. */
static PetscErrorCode SnapshotsBegin(HycoSnapshots s)
{
  PetscFunctionBegin;
  HycoOnRoot(HycoComm(s), MakeFolder(s->folder));
  PetscCall(HycoSceneFingerprint(s->scene, &s->fingerprint));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every rank computes the fingerprint after the folder is there; an error destroys the object before it returns. */
PetscErrorCode HycoSnapshotsOpen(MPI_Comm comm, HycoScene scene, const char folder[], HycoSnapshots *snapshots)
{
  HycoSnapshots s;

  PetscFunctionBegin;
  HycoCheckHandle(scene, HYCO_SCENE_CLASSID);
  HycoCheckGiven(folder);
  HycoCheckGiven(snapshots);
  PetscCall(PetscHeaderCreate(s, HYCO_SNAPSHOTS_CLASSID, "HycoSnapshots", "Store of full-order solutions", "Hyco", comm,
                              HycoSnapshotsDestroy, HycoSnapshotsView));
  PetscCall(PetscObjectReference((PetscObject)scene));
  s->scene = scene;
  PetscCall(PetscCalloc2(HycoSize(comm), &s->solved, HycoSize(comm), &s->written));
  PetscCall(PetscStrncpy(s->folder, folder, sizeof(s->folder)));
  HycoOnError(SnapshotsBegin(s), PetscCall(HycoSnapshotsDestroy(&s)));
  *snapshots = s;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CloseSample(HycoSnapshots s)
{
  PetscFunctionBegin;
  if (s->last) PetscCall(HycoH5Close(&s->last, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A file of a sample may be open: it is kept open between reads of its fields. */
PetscErrorCode HycoSnapshotsDestroy(HycoSnapshots *snapshots)
{
  PetscFunctionBegin;
  HycoDestroyBegin(snapshots, HYCO_SNAPSHOTS_CLASSID);
  PetscCall(CloseSample(*snapshots));
  PetscCall(PetscFree2((*snapshots)->solved, (*snapshots)->written));
  HycoFreeAll(&(*snapshots)->piece, &(*snapshots)->lost);
  PetscCall(HycoSceneDestroy(&(*snapshots)->scene));
  PetscCall(PetscHeaderDestroy(snapshots));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The path of the file of a parameter value. */
static PetscErrorCode SamplePath(HycoSnapshots s, const PetscReal mu[], char path[PETSC_MAX_PATH_LEN])
{
  /* By the bits of mu: equal values are the same file, and a change of the last digit is another solution. */
  const unsigned long long hash = HycoHash(HYCO_HASH_START, mu, (size_t)s->scene->n_parameters * sizeof(PetscReal));

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(path, PETSC_MAX_PATH_LEN, "%s/%016llx.h5", s->folder, hash));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The path of the file that says why there is no solution there: as of a solution, with another end. */
static PetscErrorCode LostPath(HycoSnapshots s, const PetscReal mu[], char path[PETSC_MAX_PATH_LEN])
{
  char *end;

  PetscFunctionBegin;
  PetscCall(SamplePath(s, mu, path));
  PetscCall(PetscStrrchr(path, '.', &end));
  PetscCall(PetscStrncpy(end, "none", PETSC_MAX_PATH_LEN - (size_t)(end - path)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fails if the history differs from that with which the file was made; files of earlier versions do not store it. */
static PetscErrorCode CheckHistory(HycoSnapshots s, HycoH5 h, const char path[])
{
  char *made;

  PetscFunctionBegin;
  if (!HycoH5Has(h, "history")) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoH5LoadText(h, "history", &made));
  HycoFinally(HycoSceneCompareHistory(s->scene, made, path), PetscCall(PetscFree(made)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Another scene's solutions would silently give a wrong model. Of a changed history, the message says what changed. */
PetscErrorCode HycoSnapshotsCheckFile(HycoSnapshots s, HycoH5 h, const char path[])
{
  char *text, mine[32];
  int same;

  PetscFunctionBegin;
  PetscCall(HycoH5LoadText(h, "fingerprint", &text));
  snprintf(mine, sizeof(mine), "%016llx", s->fingerprint);
  same = strcmp(text, mine) == 0;
  PetscCall(PetscFree(text));
  /* Names the entry, where it is one of the history; otherwise returns. */
  if (!same) PetscCall(CheckHistory(s, h, path));
  HycoCheck(same,
            "%s is a snapshot of another scene%s or mesh; remove the folder %s, or name another by -hyco_snapshots",
            path, s->scene->n_times ? ", history" : "", s->folder);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The file of a parameter value, which must belong to this scene. The store owns it, and keeps it open until another
   is needed: judging a path reads a file several times for each listed time, and opening it reads all of it. */
static PetscErrorCode OpenSample(HycoSnapshots s, const PetscReal mu[], HycoH5 *h)
{
  char path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(SamplePath(s, mu, path));
  if (!s->last || strcmp(path, s->last_path)) {
    PetscCall(CloseSample(s));
    PetscCall(HycoH5OpenOr(path, "remove it and run again", &s->last));
    PetscCall(PetscStrncpy(s->last_path, path, sizeof(s->last_path)));
    HycoOnError(HycoSnapshotsCheckFile(s, s->last, path), PetscCall(CloseSample(s)));
  }
  *h = s->last;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a file says that there is no equilibrium at mu, and how it says that (NULL: not asked). Rank 0. */
static PetscErrorCode ReadLost(HycoSnapshots s, const PetscReal mu[], PetscBool *lost, char why[HYCO_LINE])
{
  char path[PETSC_MAX_PATH_LEN], *text = NULL;
  HycoH5 h;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(LostPath(s, mu, path));
  *lost = (PetscBool)(access(path, F_OK) == 0);
  if (!*lost) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoH5OpenOr(path, "remove it and run again", &h));
  ierr = HycoSnapshotsCheckFile(s, h, path);
  if (!ierr) ierr = HycoH5LoadText(h, "no_equilibrium", &text);
  PetscCall(HycoH5Close(&h, PETSC_FALSE));
  if (text && why) HycoFormat(why, "%s", text);
  PetscCall(PetscFree(text));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* missing[]: the samples without a file, in order. On rank 0. Twins in the list are solved once. Files that exist
   are opened: one of another scene is refused before hours of solves. */
static PetscErrorCode FindMissing(HycoSnapshots s, PetscInt n, PetscInt n_par, const PetscReal mu[],
                                  PetscInt *n_missing, PetscInt missing[])
{
  PetscFunctionBegin;
  *n_missing = 0;
  for (PetscInt k = 0; k < n; k++) {
    char path[PETSC_MAX_PATH_LEN];
    PetscBool lost;
    HycoH5 h;

    PetscCall(ReadLost(s, mu + k * n_par, &lost, NULL));
    if (lost) continue;
    PetscCall(SamplePath(s, mu + k * n_par, path));
    if (access(path, F_OK) != 0) {
      PetscBool twin = PETSC_FALSE;

      /* O(n^2) comparisons of a few numbers: nothing beside one solve. */
      for (PetscInt j = 0; j < *n_missing && !twin; j++)
        PetscCall(PetscArraycmp(mu + missing[j] * n_par, mu + k * n_par, n_par, &twin));
      if (!twin) missing[(*n_missing)++] = k;
      continue;
    }
    PetscCall(OpenSample(s, mu + k * n_par, &h));
    /* The largest sliding of stored solutions counts for this training's warning. */
    if (HycoH5Has(h, "sliding")) {
      PetscReal sliding;

      PetscCall(HycoH5ReadReal(h, "sliding", 1, 1, &sliding));
      s->sliding = PetscMax(s->sliding, sliding);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest sliding of the last solution, whose summary has been made if it is no path. */
static PetscReal SlidingOf(HycoFOM fom)
{
  PetscReal sliding = fom->path ? 0 : fom->summary.sliding;

  for (PetscInt k = 0; fom->path && k < fom->path->n_steps; k++)
    sliding = PetscMax(sliding, fom->path->steps[k].sliding);
  return sliding;
}

/* Writes whose the data are. The fingerprint first, without which a file is not read; `history` lets a message say
   what changed. Rank 0. */
static PetscErrorCode WriteOwner(HycoSnapshots s, HycoH5 h, const PetscReal mu[])
{
  char fingerprint[32], *history;
  PetscErrorCode ierr = PETSC_SUCCESS;

  PetscFunctionBegin;
  snprintf(fingerprint, sizeof(fingerprint), "%016llx", s->fingerprint);
  PetscCall(HycoH5WriteText(h, "fingerprint", fingerprint));
  /* Empty without a history. */
  PetscCall(HycoSceneWriteHistory(s->scene, &history));
  if (history[0]) ierr = HycoH5WriteText(h, "history", history);
  PetscCall(PetscFree(history));
  PetscCall(ierr);
  PetscCall(HycoH5WriteReal(h, "mu", s->scene->n_parameters, 1, mu));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes the data of a solution that are on rank 0. */
static PetscErrorCode WriteHead(HycoSnapshots s, HycoFOM fom, HycoH5 h, const PetscReal mu[])
{
  const PetscReal sliding = SlidingOf(fom);

  PetscFunctionBegin;
  PetscCall(WriteOwner(s, h, mu));
  PetscCall(HycoH5WriteReal(h, "sliding", 1, 1, &sliding));
  s->sliding = PetscMax(s->sliding, sliding);
  if (fom->path) {
    HycoHistory history_of = {0};

    HycoPathGetHistory(fom->path, &history_of);
    s->time_error = PetscMax(s->time_error, history_of.time_error);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes the forces of springs, zero on fixed unknowns, if the scene has any. Collective. */
static PetscErrorCode WriteSprings(HycoFOM fom, HycoH5 h, const char name[])
{
  const HycoFileOrder *rows;
  PetscReal *force;

  PetscFunctionBegin;
  if (!fom->scene->n_springs) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoFOMGetRows(fom, &rows));
  PetscCall(PetscCalloc1(fom->fe->n_dof, &force));
  /* -K u, the force on the body. */
  HycoSpringsAddForces(fom->fe, 1, fom->u, force);
  for (PetscInt k = 0; k < fom->fe->n_dof; k++) force[k] = fom->fe->fixed[k] ? 0 : force[k];
  HycoFinally(HycoFieldWrite(h, rows, fom->n_nodes, name, HYCO_ON_NODES, MPIU_REAL, fom->fe->dim, 1, force),
              PetscCall(PetscFree(force)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every rank writes its rows in the mesh file's order, so that a file does not depend on the number of ranks. */
static PetscErrorCode WriteFields(HycoSnapshots s, HycoFOM fom, HycoH5 h, const PetscReal mu[], const PetscReal force[])
{
  const PetscInt dim = fom->fe->dim;
  const HycoFileOrder *rows;

  PetscFunctionBegin;
  HycoOnRoot(HycoComm(fom), WriteHead(s, fom, h, mu));
  /* Contacts in the order of the mesh file, gathered by numbers and not by ranks. */
  PetscCall(HycoFOMWriteForces(fom, h, "lambda"));
  PetscCall(HycoFOMGetRows(fom, &rows));
  PetscCall(HycoFieldWrite(h, rows, fom->n_nodes, "U", HYCO_ON_NODES, MPIU_REAL, dim, 1, fom->u));
  PetscCall(HycoFieldWrite(h, rows, fom->n_cells, "sigma", HYCO_ON_CELLS, MPIU_REAL, fom->fe->n_sigma, 1, fom->sigma));
  PetscCall(HycoFieldWrite(h, rows, fom->n_nodes, "force", HYCO_ON_NODES, MPIU_REAL, dim, 1, force));
  PetscCall(WriteSprings(fom, h, "spring"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes the solution, each rank its rows. Collective on the group. HDF5 of the group, each rank its rows; the
   file is renamed into place when complete (HycoH5Close()), or removed. */
static PetscErrorCode WriteSample(HycoSnapshots s, HycoFOM fom, const PetscReal mu[], const PetscReal force[])
{
  char path[PETSC_MAX_PATH_LEN];
  HycoH5 h;
  PetscErrorCode ierr, failed;

  PetscFunctionBegin;
  PetscCall(SamplePath(s, mu, path));
  PetscCall(HycoH5CreateShared(HycoComm(fom), path, &h));
  ierr = WriteFields(s, fom, h, mu, force);
  /* Per rank, for the report's balance. */
  s->bytes += HycoH5Written(h);
  /* Collective, also after an error: the other ranks of the group are in it. */
  failed = HycoH5Close(&h, (PetscBool)!ierr);
  PetscCall(ierr ? ierr : failed);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* "step-0003/U"; without a history only the field's name. */
static void NameField(HycoSnapshots s, PetscInt k, const char field[], char name[HYCO_LINE])
{
  if (s->scene->n_times)
    HycoFormat(name, "step-%04d/%s", (int)k, field);
  else
    HycoFormat(name, "%s", field);
}

/* A path while it is written to its file. */
typedef struct {
  HycoSnapshots s;
  HycoH5 h;
  PetscReal *force, *inelastic;
  PetscInt n_between; /* number of steps written that do not end at a listed time */
  PetscInt slot;      /* of the last of these: number of its subinterval, counted from the path's start */
} PathWriter;

const char *const HycoSnapshotFriction[] = {"friction_x", "friction_y", "friction_z", "friction_work"};

/* At most this number of steps between two listed times are stored, one in each of as many equal subintervals. */
#define MOST_BETWEEN 5

static void NameBetween(PetscInt k, char name[HYCO_LINE])
{
  HycoFormat(name, "between-%04d", (int)k);
}

/* Writes the displacements of an accepted step between listed times: more data for the modes without further solves. */
static PetscErrorCode WriteBetween(HycoFOM fom, void *ctx)
{
  PathWriter *w = (PathWriter *)ctx;
  const HycoPath p = fom->path;
  const PetscReal *times = fom->scene->times + p->step - 1;
  /* p->step is the next listed time: its interval begins with times[0] here. */
  const PetscInt slot = p->step * MOST_BETWEEN + (PetscInt)(MOST_BETWEEN * (p->t - times[0]) / (times[1] - times[0]));
  const HycoFileOrder *rows;
  char name[HYCO_LINE];

  PetscFunctionBegin;
  if (slot == w->slot) PetscFunctionReturn(PETSC_SUCCESS);
  w->slot = slot;
  NameBetween(w->n_between++, name);
  PetscCall(HycoFOMGetRows(fom, &rows));
  PetscCall(HycoFieldWrite(w->h, rows, fom->n_nodes, name, HYCO_ON_NODES, MPIU_REAL, fom->fe->dim, 1, fom->u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes the forces of supports, with which outputs of predicted paths are compared, if the scene names one. They
   follow from the other fields only without a history. Collective. */
static PetscErrorCode WriteReactions(HycoFOM fom, HycoH5 h, const char name[], PetscReal reaction[])
{
  const HycoFileOrder *rows;

  PetscFunctionBegin;
  if (!HycoSceneHasReactions(fom->scene)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoFOMGetRows(fom, &rows));
  PetscCall(HycoFOMReactions(fom, reaction));
  PetscCall(HycoFieldWrite(h, rows, fom->n_nodes, name, HYCO_ON_NODES, MPIU_REAL, fom->fe->dim, 1, reaction));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes what outputs need of friction, a field for each component of the tangential force and one for the work.
   Collective. */
static PetscErrorCode WriteFriction(HycoFOM fom, PathWriter *w, PetscInt step)
{
  const HycoShear *shear = fom->pairs.shear;
  PetscReal *value;
  PetscErrorCode ierr = PETSC_SUCCESS;

  PetscFunctionBegin;
  if (!shear) PetscFunctionReturn(PETSC_SUCCESS);
  /* Components one by one: a field has one number per contact. */
  PetscCall(PetscMalloc1(fom->pairs.n + 1, &value));
  for (PetscInt c = 0; c < HYCO_SNAPSHOT_FRICTION && !ierr; c++) {
    char name[HYCO_LINE];

    for (PetscInt k = 0; k < fom->pairs.n; k++) value[k] = c < 3 ? shear->force[3 * k + c] : shear->work[k];
    NameField(w->s, step, HycoSnapshotFriction[c], name);
    ierr = HycoContactsWrite(HycoComm(fom), w->h, name, &fom->pairs, fom->n_contacts, MPIU_REAL, value);
  }
  PetscCall(PetscFree(value));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A HycoStepMonitor: writes the fields of a listed time. The forces are the internal forces f_int. */
static PetscErrorCode WriteStep(HycoFOM fom, const HycoStep *step, void *ctx)
{
  PathWriter *w = (PathWriter *)ctx;
  const PetscInt dim = fom->fe->dim;
  const HycoFileOrder *rows;
  char name[HYCO_LINE];

  PetscFunctionBegin;
  PetscCall(HycoFOMGetRows(fom, &rows));
  PetscCall(HycoFOMStress(fom));
  /* The accumulated inelastic strain; stresses come from HycoFOMStress(). */
  PetscCall(HycoFEStateFields(fom->fe, fom->path->begin, NULL, NULL, w->inelastic, NULL));
  PetscCall(HycoFOMToLocal(fom, fom->path->f_old, w->force));
  HycoSpringsAddForces(fom->fe, 1, fom->u, w->force); /* the forces of springs are a field of their own */
  /* Internal forces at fixed unknowns are reactions, stored as a field of their own. */
  for (PetscInt k = 0; k < fom->fe->n_dof; k++) w->force[k] = fom->fe->fixed[k] ? 0 : w->force[k];
  NameField(w->s, step->index, "lambda", name);
  PetscCall(HycoFOMWriteForces(fom, w->h, name));
  NameField(w->s, step->index, "U", name);
  PetscCall(HycoFieldWrite(w->h, rows, fom->n_nodes, name, HYCO_ON_NODES, MPIU_REAL, dim, 1, fom->u));
  NameField(w->s, step->index, "sigma", name);
  PetscCall(HycoFieldWrite(w->h, rows, fom->n_cells, name, HYCO_ON_CELLS, MPIU_REAL, fom->fe->n_sigma, 1, fom->sigma));
  NameField(w->s, step->index, "force", name);
  PetscCall(HycoFieldWrite(w->h, rows, fom->n_nodes, name, HYCO_ON_NODES, MPIU_REAL, dim, 1, w->force));
  NameField(w->s, step->index, "reaction", name);
  PetscCall(WriteReactions(fom, w->h, name, w->force));
  PetscCall(WriteFriction(fom, w, step->index));
  NameField(w->s, step->index, "spring", name);
  PetscCall(WriteSprings(fom, w->h, name));
  NameField(w->s, step->index, "inelastic", name);
  PetscCall(HycoFieldWrite(w->h, rows, fom->n_cells, name, HYCO_ON_CELLS, MPIU_REAL, 1, 1, w->inelastic));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A full-order solution with its outputs, and its processor time on all ranks of the group. */
static PetscErrorCode SnapshotsSolve(HycoSnapshots s, HycoFOM fom, const PetscReal mu[], HycoSummary *summary)
{
  PetscFunctionBegin;
  PetscCall(HycoFOMSolve(fom, s->scene->n_parameters, mu));
  if (!fom->solved) PetscFunctionReturn(PETSC_SUCCESS); /* a path without a listed time */
  PetscCall(HycoFOMGetSummary(fom, summary));
  if (HycoRank(HycoComm(fom)) != 0) PetscFunctionReturn(PETSC_SUCCESS);
  s->spent += summary->seconds.cpu;
  s->timed++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes that there is no equilibrium at mu, so that a later run does not look for it again. Rank 0 of the group. */
static PetscErrorCode WriteLost(HycoSnapshots s, const PetscReal mu[], const char why[])
{
  char path[PETSC_MAX_PATH_LEN];
  HycoH5 h;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(LostPath(s, mu, path));
  PetscCall(HycoH5Create(path, &h));
  ierr = WriteOwner(s, h, mu);
  if (!ierr) ierr = HycoH5WriteText(h, "no_equilibrium", why);
  PetscCall(HycoH5Close(&h, (PetscBool)!ierr));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves the path and writes its file; a path that does not reach its end is an error, but one beyond which there is no
   equilibrium is `lost`. Fields are written while the path is solved, by the monitor: no listed time is held in memory.
   `taken` follows at the end, when the number of steps is known. */
static PetscErrorCode WritePath(PathWriter *w, HycoFOM fom, const PetscReal mu[], char lost[HYCO_LINE])
{
  HycoHistory history;
  HycoSummary summary;
  char at[HYCO_LINE];

  PetscFunctionBegin;
  PetscCall(HycoFOMSetStepMonitor(fom, WriteStep, w));
  fom->path->between = WriteBetween;
  PetscCall(SnapshotsSolve(w->s, fom, mu, &summary));
  PetscCall(HycoFOMGetHistory(fom, &history));
  HycoSceneNamePoint(w->s->scene, mu, at);
  lost[0] = '\0';
  if (history.no_equilibrium) HycoFormat(lost, "%s ends at t = %g: %s", at, (double)history.t, history.why);
  if (lost[0]) PetscFunctionReturn(PETSC_SUCCESS);
  /* Half of a path would train a model that is wrong at the end and does not know it. */
  HycoCheck(history.ended, "the path at %s ends at t = %.10g: %s", at, (double)history.t, history.why);
  HycoOnRoot(HycoComm(fom), WriteHead(w->s, fom, w->h, mu));
  HycoOnRoot(HycoComm(fom), HycoH5WriteReal(w->h, "taken", history.n_taken, 1, history.taken));
  HycoOnRoot(HycoComm(fom), HycoH5WriteReal(w->h, "time_error", 1, 1, &history.time_error));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves and stores one path by one group, with the fields of its listed times. Collective on the group. The file
   is shared by the group and stays incomplete, and is removed, if the path fails. */
static PetscErrorCode SolvePath(HycoSnapshots s, HycoFOM fom, const PetscReal mu[], PetscReal force[])
{
  PathWriter w = {.s = s, .force = force};
  char path[PETSC_MAX_PATH_LEN], lost[HYCO_LINE] = "";
  PetscErrorCode ierr, failed;

  PetscFunctionBegin;
  /* All points would write the same checkpoint. */
  PetscCheck(!fom->path->checkpoint[0], HycoComm(fom), PETSC_ERR_USER,
             "-hyco_checkpoint is for hyco solve; training stores each solved path in its snapshot folder");
  PetscCheck(!fom->path->fclib[0], HycoComm(fom), PETSC_ERR_USER, "-hyco_write_fclib is for hyco solve; remove it");
  PetscCall(SamplePath(s, mu, path));
  PetscCall(PetscMalloc1(fom->part->n_cells, &w.inelastic));
  PetscCall(HycoH5CreateShared(HycoComm(fom), path, &w.h));
  ierr = WritePath(&w, fom, mu, lost);
  s->bytes += HycoH5Written(w.h);
  failed = HycoH5Close(&w.h, (PetscBool)(!ierr && !lost[0]));
  PetscCall(PetscFree(w.inelastic));
  PetscCall(ierr ? ierr : failed);
  if (lost[0]) HycoOnRoot(HycoComm(fom), WriteLost(s, mu, lost));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves, checks and stores one sample by one group. Collective on the group. */
static PetscErrorCode SolveSample(HycoSnapshots s, HycoFOM fom, const PetscReal mu[], PetscReal force[])
{
  HycoSummary summary;
  char at[HYCO_LINE], lost[HYCO_LINE];

  PetscFunctionBegin;
  if (fom->path) {
    PetscCall(SolvePath(s, fom, mu, force));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SnapshotsSolve(s, fom, mu, &summary));
  /* Full order has added a spring to a body that nothing holds; a reduced stiffness has no such term. */
  HycoCheck(!summary.regularised[0],
            "neither supports nor contact keep %s: full order can be regularised, but a reduced model cannot; fix a "
            "component",
            summary.regularised);
  HycoSceneNamePoint(s->scene, mu, at);
  if (summary.reason == HYCO_DIVERGED_FLOATING) {
    HycoFormat(lost, "%s: %s", at, summary.why);
    HycoOnRoot(HycoComm(fom), WriteLost(s, mu, lost));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCheck(summary.reason >= 0, HycoComm(fom), PETSC_ERR_USER, "the snapshot at %s: %s", at, summary.why);
  PetscCall(HycoFOMStress(fom));
  PetscCall(HycoFOMGetForces(fom, force));
  PetscCall(WriteSample(s, fom, mu, force));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A HycoPath's interrupt, because a path may take hours. Called between steps: raises the error of another group,
   so that this one does not go on for hours. */
static PetscErrorCode SnapshotsPollErrors(void *ctx)
{
  PetscFunctionBegin;
  PetscCall(HycoQueueHear((HycoQueue)ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The samples of SolveMissing(). */
typedef struct {
  PetscInt n_all, n_par, n, *missing;
  const PetscReal *mu;
  HycoProgress progress;
  void *ctx;
} Missing;

/* This rank's group solves samples from the queue. Rank 0 reports how many are stored. Rank 0 of the communicator
   reports for all groups; k < 0: the queue is empty, the only way out without an error. */
static PetscErrorCode SolveQueued(HycoSnapshots s, HycoQueue queue, const Missing *m, HycoFOM fom, PetscReal force[])
{
  PetscInt k, n_stored;
  char at[HYCO_LINE];

  PetscFunctionBegin;
  for (PetscBool first = PETSC_TRUE;; first = PETSC_FALSE) {
    PetscCall(HycoQueueTake(queue, &k));
    if (HycoRank(HycoComm(s)) == 0 && m->progress && !first) {
      PetscCall(HycoQueueDone(queue, &n_stored));
      if (n_stored < m->n) PetscCall(m->progress(m->n_all - m->n + n_stored, m->n_all, m->ctx));
    }
    if (k < 0) PetscFunctionReturn(PETSC_SUCCESS);
    HycoSceneNamePoint(s->scene, m->mu + m->missing[k] * m->n_par, at);
    PetscCall(HycoSnapshotsNote(s, queue, "begins %s", at));
    PetscCall(SolveSample(s, fom, m->mu + m->missing[k] * m->n_par, force));
  }
}

/* A group has a full-order model of its own, whose factor it keeps from point to point. A long path looks between its
   steps whether another group has failed. */
static PetscErrorCode SolveGroup(HycoSnapshots s, HycoQueue queue, const Missing *m)
{
  MPI_Comm group;
  HycoFOM fom;
  PetscReal *force;

  PetscFunctionBegin;
  PetscCall(HycoQueueGetGroup(queue, &group));
  /* On the group's communicator: each group has the whole mesh distributed over its ranks. */
  PetscCall(HycoFOMCreate(group, s->scene, &fom));
  if (fom->path) {
    fom->path->interrupt = SnapshotsPollErrors;
    fom->path->interrupt_ctx = queue;
  }
  PetscCall(PetscMalloc1(fom->fe->n_dof, &force));
  HycoFinally(SolveQueued(s, queue, m, fom, force), PetscCall(PetscFree(force)); PetscCall(HycoFOMDestroy(&fom)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Returns the group's error after the other groups were told of it. HycoQueueEnd() is called on every rank, with
   an error too: the other groups wait for it. */
static PetscErrorCode SolveAndTell(HycoSnapshots s, HycoQueue queue, const Missing *m)
{
  const PetscErrorCode ierr = HycoQueueEnd(queue, SolveGroup(s, queue, m));

  PetscFunctionBegin;
  PetscCall(HycoSnapshotsNote(s, queue, "%s", ierr ? "fails" : "ends"));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the counts of a queue whose tasks are done. */
static PetscErrorCode CountWork(HycoSnapshots s, HycoQueue queue)
{
  PetscInt groups, left;
  PetscReal spent[2] = {s->spent, s->timed};

  PetscFunctionBegin;
  PetscCall(HycoQueueCount(queue, &groups, s->solved));
  PetscCall(HycoQueueLeft(queue, &left));
  s->n_groups = PetscMax(s->n_groups, groups);
  s->unsolved = PetscMax(s->unsolved, left);
  HycoAllreduce(spent, 2, MPIU_REAL, MPI_SUM, HycoComm(s));
  s->n_timed = (PetscInt)spent[1];
  s->cpu = spent[0] / PetscMax(spent[1], 1);
  PetscCallMPI(MPI_Allgather(&s->bytes, 1, MPIU_REAL, s->written, 1, MPIU_REAL, HycoComm(s)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The queue orders the points by stiffness; an error of one group ends the work of all. A queue and groups exist
   for one call; HycoOnEach() raises the first error on every rank. */
static PetscErrorCode SolveMissing(HycoSnapshots s, const Missing *m)
{
  HycoQueue queue;

  PetscFunctionBegin;
  PetscCall(HycoSnapshotsReadMonitor(s));
  PetscCall(HycoSnapshotsCreateQueue(HycoComm(s), s->scene, m->n_par, m->mu, m->n, m->missing, m->n_all, &queue));
  HycoOnEach(HycoComm(s), SolveAndTell(s, queue, m));
  PetscCall(CountWork(s, queue));
  PetscCall(HycoQueueDestroy(&queue));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks the samples without an equilibrium; the store keeps their number, and the text of the first. Rank 0. */
static PetscErrorCode FindLost(HycoSnapshots s, const Missing *m, PetscBool lost[])
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < m->n_all; k++) {
    PetscBool known = PETSC_FALSE;
    char why[HYCO_LINE];
    unsigned long long key;

    PetscCall(ReadLost(s, m->mu + k * m->n_par, &lost[k], why));
    if (!lost[k]) continue;
    key = HycoHash(HYCO_HASH_START, m->mu + k * m->n_par, (size_t)m->n_par * sizeof(PetscReal));
    for (PetscInt j = 0; j < s->n_lost && !known; j++) known = (PetscBool)(s->lost[j] == key);
    if (known) continue;
    if (!s->n_lost) HycoFormat(s->first_lost, "%s", why);
    HycoGrow(s->n_lost, s->room_lost, s->lost);
    s->lost[s->n_lost++] = key;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Removes the samples without an equilibrium from the set. */
static PetscErrorCode DropLost(HycoSnapshots s, const Missing *m, HycoSamples samples)
{
  PetscBool *lost;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_all, &lost));
  HycoOnRoot(HycoComm(s), FindLost(s, m, lost));
  PetscCallMPI(MPI_Bcast(&s->n_lost, 1, MPIU_INT, 0, HycoComm(s)));
  PetscCallMPI(MPI_Bcast(s->first_lost, HYCO_LINE, MPI_CHAR, 0, HycoComm(s)));
  HycoBcast(lost, m->n_all, MPIU_BOOL, HycoComm(s));
  PetscCall(HycoSamplesDrop(samples, lost));
  PetscCall(PetscFree(lost));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points that are stored are not solved again, whatever their order or number was in an earlier run. */
PetscErrorCode HycoSnapshotsFill(HycoSnapshots s, HycoSamples samples, HycoProgress progress, void *ctx)
{
  Missing m = {.progress = progress, .ctx = ctx};

  PetscFunctionBegin;
  HycoCheckHandle(s, HYCO_SNAPSHOTS_CLASSID);
  PetscCall(HycoSamplesGet(samples, &m.n_all, &m.n_par, &m.mu));
  HycoCheck(m.n_all > 0, "the set of samples is empty");
  PetscCall(PetscMalloc1(m.n_all, &m.missing));
  /* One rank looks into the folder: others might see it in another state. */
  HycoOnRoot(HycoComm(s), FindMissing(s, m.n_all, m.n_par, m.mu, &m.n, m.missing));
  PetscCallMPI(MPI_Bcast(&m.n, 1, MPIU_INT, 0, HycoComm(s)));
  HycoBcast(m.missing, m.n, MPIU_INT, HycoComm(s));
  if (m.n) {
    PetscCall(SolveMissing(s, &m));
    if (HycoRank(HycoComm(s)) == 0 && progress) PetscCall(progress(m.n_all, m.n_all, ctx));
  }
  /* Each group's first rank knows its own. */
  HycoAllreduce(&s->sliding, 1, MPIU_REAL, MPI_MAX, HycoComm(s));
  HycoAllreduce(&s->time_error, 1, MPIU_REAL, MPI_MAX, HycoComm(s));
  PetscCall(PetscFree(m.missing));
  PetscCall(DropLost(s, &m, samples));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoSnapshotsGetSolved, (HycoSnapshots s, PetscInt *n_groups, const PetscInt *solved[]), s,
                 HYCO_SNAPSHOTS_CLASSID, HycoCheckGiven(n_groups);
                 HycoCheckGiven(solved); *n_groups = s->n_groups; *solved = s->solved)
HycoDefineMethod(HycoSnapshotsGetBalance, (HycoSnapshots s, PetscInt *unsolved, const PetscReal *written[]), s,
                 HYCO_SNAPSHOTS_CLASSID, HycoCheckGiven(unsolved);
                 HycoCheckGiven(written); *unsolved = s->unsolved; *written = s->written)

/* Rows lo .. lo + rows - 1 of the n samples at mu. */
static PetscErrorCode ReadColumns(HycoSnapshots s, PetscInt n, const PetscReal mu[], const char field[], PetscInt lo,
                                  PetscInt rows, PetscInt total, PetscScalar data[], PetscInt lda)
{
  const PetscInt n_steps = HycoSnapshotsSteps(s->scene), n_par = s->scene->n_parameters;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) {
    char name[HYCO_LINE];
    HycoH5 h;
    PetscInt size, one;

    PetscCall(OpenSample(s, mu + k * n_par, &h));
    for (PetscInt j = 0; j < n_steps; j++) {
      NameField(s, j, field, name);
      PetscCall(HycoH5GetSize(h, name, &size, &one));
      /* A mesh that was refined after the first solutions. */
      HycoCheck(size == total, "%s: %s has %d rows, and other snapshots have %d; remove the folder", s->last_path, name,
                (int)size, (int)total);
      /* Straight into the column of the dense matrix, whose rows are this rank's. */
      PetscCall(HycoH5ReadRows(h, name, lo, rows, 1, data + (size_t)(k * n_steps + j) * (size_t)lda));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All solutions have the same size; the first one gives it. */
static PetscErrorCode FirstSize(HycoSnapshots s, HycoSamples samples, const char field[], PetscInt *rows)
{
  const PetscReal *mu;
  char name[HYCO_LINE];
  HycoH5 h;
  PetscInt one;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(samples, NULL, NULL, &mu));
  PetscCall(OpenSample(s, mu, &h));
  NameField(s, 0, field, name);
  PetscCall(HycoH5GetSize(h, name, rows, &one));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* 0: no solution is stored yet. Rank 0 reads, the others learn it. */
PetscErrorCode HycoSnapshotsGetRows(HycoSnapshots s, HycoSamples samples, const char field[], PetscInt *n)
{
  PetscFunctionBegin;
  *n = 0;
  HycoOnRoot(HycoComm(s), FirstSize(s, samples, field, n));
  PetscCallMPI(MPI_Bcast(n, 1, MPIU_INT, 0, HycoComm(s)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A column for each sample and listed time; each rank reads its own rows of every file. */
PetscErrorCode HycoSnapshotsGetField(HycoSnapshots s, HycoSamples samples, PetscInt first, PetscInt n,
                                     const char field[], PetscInt block, Mat *S)
{
  PetscInt n_par, total = 0, blocks, own = PETSC_DECIDE, lo, hi, lda;
  const PetscReal *mu;
  PetscScalar *data;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(samples, NULL, &n_par, &mu));
  PetscCall(HycoSnapshotsGetRows(s, samples, field, &total));
  /* Rows of a node or cell stay on one rank: `block` rows belong together. */
  blocks = total / block;
  PetscCall(PetscSplitOwnership(HycoComm(s), &own, &blocks));
  PetscCall(MatCreateDense(HycoComm(s), own * block, PETSC_DECIDE, total, n * HycoSnapshotsSteps(s->scene), NULL, S));
  PetscCall(MatGetOwnershipRange(*S, &lo, &hi));
  PetscCall(MatDenseGetLDA(*S, &lda));
  PetscCall(MatDenseGetArray(*S, &data));
  HycoOnEach(HycoComm(s), ReadColumns(s, n, mu + first * n_par, field, lo, hi - lo, total, data, lda));
  PetscCall(MatDenseRestoreArray(*S, &data));
  PetscCall(HycoMatAssemble(*S));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The number of steps between listed times in the file of mu; 0 for older versions. Numbered without a gap: the
   first name that is missing ends the list. */
static PetscErrorCode CountBetween(HycoSnapshots s, const PetscReal mu[], PetscInt *n)
{
  char name[HYCO_LINE];
  HycoH5 h;

  PetscFunctionBegin;
  PetscCall(OpenSample(s, mu, &h));
  for (*n = 0;; (*n)++) {
    NameBetween(*n, name);
    if (!HycoH5Has(h, name)) break;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The columns of the steps between listed times, which are numbered in the file. */
static PetscErrorCode ReadBetween(HycoSnapshots s, const PetscReal mu[], PetscInt n, PetscInt lo, PetscInt rows,
                                  PetscScalar data[], PetscInt lda)
{
  char name[HYCO_LINE];
  HycoH5 h;

  PetscFunctionBegin;
  PetscCall(OpenSample(s, mu, &h));
  for (PetscInt k = 0; k < n; k++) {
    NameBetween(k, name);
    PetscCall(HycoH5ReadRows(h, name, lo, rows, 1, data + (size_t)k * (size_t)lda));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0 counts, so that all ranks create the same matrix; each reads its rows. Steps between listed times, without
   those at them, which HycoSnapshotsGetField() reads. */
PetscErrorCode HycoSnapshotsGetBetween(HycoSnapshots s, const PetscReal mu[], PetscInt rows, PetscInt total, Mat *U)
{
  PetscInt n = 0, lo, hi, lda;
  PetscScalar *data;

  PetscFunctionBegin;
  HycoOnRoot(HycoComm(s), CountBetween(s, mu, &n));
  PetscCallMPI(MPI_Bcast(&n, 1, MPIU_INT, 0, HycoComm(s)));
  PetscCall(MatCreateDense(HycoComm(s), rows, PETSC_DECIDE, total, n, NULL, U));
  PetscCall(MatGetOwnershipRange(*U, &lo, &hi));
  PetscCall(MatDenseGetLDA(*U, &lda));
  PetscCall(MatDenseGetArray(*U, &data));
  HycoOnEach(HycoComm(s), ReadBetween(s, mu, n, lo, hi - lo, data, lda));
  PetscCall(MatDenseRestoreArray(*U, &data));
  PetscCall(HycoMatAssemble(*U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* k: the listed time, 0 without a history. */
PetscErrorCode HycoSnapshotsReadRows(HycoSnapshots s, const PetscReal mu[], PetscInt k, const char field[],
                                     PetscInt first, PetscInt n, PetscReal value[])
{
  char name[HYCO_LINE];
  HycoH5 h;

  PetscFunctionBegin;
  PetscCall(OpenSample(s, mu, &h));
  NameField(s, k, field, name);
  PetscCall(HycoH5ReadRows(h, name, first, n, 1, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Files of earlier versions lack fields that were added since. */
PetscErrorCode HycoSnapshotsHas(HycoSnapshots s, const PetscReal mu[], PetscInt k, const char field[], PetscBool *has)
{
  char name[HYCO_LINE];
  HycoH5 h;

  PetscFunctionBegin;
  PetscCall(OpenSample(s, mu, &h));
  NameField(s, k, field, name);
  *has = HycoH5Has(h, name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The times of full order's steps, and the estimate of their error; the caller frees them. -1: their number is the
   file's. */
PetscErrorCode HycoSnapshotsReadTaken(HycoSnapshots s, const PetscReal mu[], PetscInt *n, PetscReal **taken,
                                      PetscReal *time_error)
{
  HycoH5 h;
  PetscInt one = 1;

  PetscFunctionBegin;
  *n = -1;
  PetscCall(OpenSample(s, mu, &h));
  PetscCall(HycoH5LoadReal(h, "taken", n, &one, taken));
  *time_error = 0;
  if (HycoH5Has(h, "time_error")) PetscCall(HycoH5ReadReal(h, "time_error", 1, 1, time_error)); /* none in older ones */
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSnapshotsView(HycoSnapshots s, PetscViewer viewer)
{
  PetscFunctionBegin;
  HycoViewBegin(s, HYCO_SNAPSHOTS_CLASSID, viewer);
  PetscCall(PetscViewerASCIIPrintf(viewer, "folder: %s\n", s->folder));
  PetscCall(PetscViewerASCIIPrintf(viewer, "of the scene and mesh with fingerprint %016llx\n", s->fingerprint));
  PetscCall(PetscViewerASCIIPopTab(viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineViewFromOptions(HycoSnapshots, HYCO_SNAPSHOTS_CLASSID)
