/* Groups of ranks that solve points: their number, the queue of the points, the lines of -hyco_groups_monitor. */
#include <hycosnapshotsimpl.h>
#include <stdarg.h>
#include <sys/stat.h>
#include <unistd.h>

/* Read from the options of the caller's object; there is no object of its own whose prefix could apply. */
static PetscErrorCode ReadGroups(MPI_Comm comm, PetscOptions options, PetscInt *groups, PetscBool *monitor)
{
  PetscFunctionBegin;
  PetscOptionsBegin(comm, NULL, "HycoSnapshots", NULL);
  /* PetscOptionsBegin() takes the global database; a scene may have its own. */
  PetscOptionsObject->options = options;
  PetscCall(HycoOptionsInt(
      "-hyco_groups",
      "number of groups of ranks that solve snapshots at the same time (0: as many as the memory allows)", 0,
      PETSC_MAX_INT, groups, NULL));
  PetscCall(HycoOptionsFlag("-hyco_groups_monitor",
                            "print a numbered line when a group of ranks begins a point, fails, or finds none left",
                            monitor));
  PetscOptionsEnd();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For the table of options: reads into variables that nobody uses. */
PetscErrorCode HycoSnapshotsDeclare(PetscOptions options)
{
  PetscInt groups = 0;
  PetscBool monitor = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(ReadGroups(PETSC_COMM_SELF, options, &groups, &monitor));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* As many groups as points or ranks, unless memory forbids: one rank a point has no communication at all. */
PetscErrorCode HycoSnapshotsChooseGroups(MPI_Comm comm, HycoScene scene, PetscInt n, PetscInt *groups)
{
  PetscMPIInt size;
  PetscBool monitor = PETSC_FALSE;
  struct stat info;

  PetscFunctionBegin;
  HycoCheckHandle(scene, HYCO_SCENE_CLASSID);
  HycoCheckGiven(groups);
  *groups = 0;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(ReadGroups(comm, scene->options, groups, &monitor));
  HycoCheck(*groups <= size, "-hyco_groups is %d on %d ranks; it can be at most the number of ranks", (int)*groups,
            (int)size);
  if (*groups) PetscFunctionReturn(PETSC_SUCCESS);
  /* A DM of the program lives on all ranks. */
  *groups = scene->dm ? 1 : PetscMax(1, PetscMin((PetscInt)size, n));
  if (stat(scene->mesh_path, &info) == 0) {
    /* An estimate from the mesh file's size, eightfold with each refinement: a group takes about 400 times the
       file. All groups may take half of the memory. */
    const double factor = 400.0 * (double)info.st_size * (double)((size_t)1 << 3 * scene->refine),
                 memory = (double)sysconf(_SC_PHYS_PAGES) * (double)sysconf(_SC_PAGE_SIZE);

    while (*groups > 1 && *groups * factor > memory / 2) (*groups)--;
  }
  /* Nodes of a cluster may have other memory: rank 0 decides. */
  PetscCallMPI(MPI_Bcast(groups, 1, MPIU_INT, 0, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* kind[i]: the first of the points list[] (n of them) that shares a stiffness, and thus a factor, with list[i]. */
static PetscErrorCode FindKinds(HycoScene scene, PetscInt n_par, const PetscReal mu[], PetscInt n,
                                const PetscInt list[], PetscInt kind[])
{
  PetscBool reaches[HYCO_MAX_PARAMETERS];
  PetscInt *first, n_kinds = 0;

  PetscFunctionBegin;
  HycoSceneReaches(scene, reaches);
  PetscCall(PetscMalloc1(n, &first));
  for (PetscInt i = 0; i < n; i++) {
    PetscInt k;

    for (k = 0; k < n_kinds; k++) {
      const PetscReal *a = mu + list[first[k]] * n_par, *b = mu + list[i] * n_par;
      PetscInt p = 0;

      /* Equal values of all parameters that the stiffness depends on, bit for bit: the factor is reused only then. */
      while (p < n_par && (!reaches[p] || a[p] == b[p])) p++;
      if (p == n_par) break;
    }
    if (k == n_kinds) first[n_kinds++] = i;
    kind[i] = first[k];
  }
  PetscCall(PetscFree(first));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* `list` are the points that are not in the store yet. The kinds are found on rank 0 alone, since their search is
   quadratic at worst. */
PetscErrorCode HycoSnapshotsCreateQueue(MPI_Comm comm, HycoScene scene, PetscInt n_par, const PetscReal mu[],
                                        PetscInt n, const PetscInt list[], PetscInt n_all, HycoQueue *queue)
{
  PetscInt groups, *kind;

  PetscFunctionBegin;
  HycoCheckGiven(mu || !n);
  HycoCheckGiven(list || !n);
  HycoCheckGiven(queue);
  PetscCall(HycoSnapshotsChooseGroups(comm, scene, n_all, &groups));
  PetscCall(PetscMalloc1(n, &kind));
  HycoOnRoot(comm, FindKinds(scene, n_par, mu, n, list, kind));
  HycoBcast(kind, n, MPIU_INT, comm);
  /* Points of one kind go to one group as far as possible, which keeps the factor. */
  PetscCall(HycoQueueCreate(comm, groups, n, kind, queue));
  PetscCall(PetscFree(kind));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Read when solves begin, after the program has set its options. */
PetscErrorCode HycoSnapshotsReadMonitor(HycoSnapshots s)
{
  PetscInt groups = 0;

  PetscFunctionBegin;
  s->monitor = PETSC_FALSE;
  PetscCall(ReadGroups(HycoComm(s), s->scene->options, &groups, &s->monitor));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For -hyco_groups_monitor: what each group does and when, in one order of events. */
PetscErrorCode HycoSnapshotsNote(HycoSnapshots s, HycoQueue queue, const char format[], ...)
{
  PetscInt number, color;
  MPI_Comm group;
  PetscViewer viewer;
  char what[HYCO_LINE];
  va_list args;

  PetscFunctionBegin;
  if (!s->monitor) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoQueueGetGroup(queue, &group));
  /* One line for each group. The number orders lines of groups that print at the same time. */
  if (HycoRank(group)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoQueueNumber(queue, &number, &color));
  va_start(args, format);
  PetscCall(PetscVSNPrintf(what, sizeof(what), format, NULL, args));
  va_end(args);
  PetscCall(PetscViewerASCIIGetStdout(PETSC_COMM_SELF, &viewer));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  event %d: group %d %s\n", (int)number, (int)color, what));
  PetscCall(PetscViewerFlush(viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}
