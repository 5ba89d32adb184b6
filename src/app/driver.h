/* The command line: what the commands share. */
#ifndef HYCO_DRIVER_H
#define HYCO_DRIVER_H

#include <hyco.h>
#include <cjson/cJSON.h>

/* What compat the driver needs of the library's own. */
#include <hycoimpl.h>

#define DRIVER_LINE 1024

typedef struct {
  const char *name;
  PetscErrorCode (*run)(void);
  PetscErrorCode (*declare)(
      PetscOptions); /* declares its own options: calls all that read some (HycoOptionsRecord()) */
  const char *usage, *meaning;
} Command;

extern const Command commands[]; /* ends with name NULL */

/* -- args.c: options -- */

/* Every option on the command line is one that `command` knows, or PETSc's; no stray words. */
PetscErrorCode DriverCheckArguments(const Command *command, int argc, char **argv);
/* Nothing was given that nobody read. To be called when all options have been read and before anything is written. */
PetscErrorCode DriverCheckLeft(void);
/* The same before the solvers have run: what is meant for them (-hyco_mumps_..., -hyco_tao_... with that type) passes.
 */
PetscErrorCode DriverCheckLeftEarly(void);
/* Declares -name and reads its value, "" when absent; the text is one of HycoOptionsString(). */
PetscErrorCode DriverGet(const char name[], const char text[], char value[PETSC_MAX_PATH_LEN]);
/* -scene, -model, -output, -report, -table, which several commands take; NULL: not read. */
PetscErrorCode DriverReadFiles(char scene[], char model[], char output[], char report[], char table[]);
/* Fails for a value that is "". */
PetscErrorCode DriverRequire(const char name[], const char value[]);
/* Prints the options of a command (NULL: all). On this process alone. */
PetscErrorCode DriverHelp(const Command *command);

/* -- outputs.c: files -- */

/* The files that `command` is to write are files of their own, none of which it reads, whatever their names, in folders
   that may be written; or devices. Before any work; counts no option as read. Collective. */
PetscErrorCode DriverCheckOutputs(const Command *command);
/* The scene's mesh is none of them. Collective. */
PetscErrorCode DriverCheckMesh(HycoScene scene);

/* -- points.c: points in the space of parameters; without a scene, what gets some only declares its options -- */

/* One point: -mu v,v,... or -mu_NAME v. */
PetscErrorCode DriverGetPoint(HycoScene scene, PetscReal mu[]);
/* Whether -mu or a -mu_NAME was given. */
PetscErrorCode DriverHasPoint(HycoScene scene, PetscBool *given);
/* A set of points: -grid (with -grid_type), -values_NAME, or -points. *given: whether any was. */
PetscErrorCode DriverGetSamples(HycoScene scene, HycoSamples *samples, PetscBool *given);
/* Whether any point-set option was given. */
PetscErrorCode DriverHasSamples(HycoScene scene, PetscBool *given);
/* The points among which a greedy training chooses: -training_grid, closed unless -grid_type says otherwise. */
PetscErrorCode DriverGetTrainingGrid(HycoScene scene, HycoSamples *samples);
/* The points that models are judged by: -validation_grid or -validation_points; NULL when neither is given. */
PetscErrorCode DriverGetValidation(HycoScene scene, HycoSamples *samples);

/* -- status.c: how the command ends -- */

enum {
  DRIVER_DONE = 0,
  DRIVER_FAILED = 1, /* one line said why; nothing half-written */
  DRIVER_MISSED = 3  /* what was asked for is written, but misses a target or the default bar */
};

/* What is written misses what was asked: one line on stderr from rank 0, beginning "hyco: missed:", an entry of
   "missed" in the report, which must be written after this, and the exit status DRIVER_MISSED unless an error follows.
   The text says what was reached, what was asked and what to do. To be called on every rank, for the ranks end with one
   status. */
PetscErrorCode DriverMissed(const char format[], ...) PETSC_ATTRIBUTE_FORMAT(1, 2);
void DriverReportMissed(cJSON *json);
/* The exit status of a run that ended with `ierr`; to be called once, at the end. */
int DriverEndStatus(PetscErrorCode ierr);
/* -- launch.c: ranks and threads -- */

/* Reads the launcher's variables; to be called before MPI begins. */
void DriverNoteLaunch(void);
/* Settings of MPI for a process that no launcher has started; to be called before MPI begins. What the environment sets
   already stays. */
void DriverStartAlone(void);
/* Fails where a launcher of another MPI has started several processes, each of which would do all the work and write
   the same files. Collective. */
PetscErrorCode DriverCheckLaunch(void);
/* Where OpenBLAS does not know this processor, which is younger, and takes the kernels of its oldest: starts this
   program anew with those that the processor runs (a factor takes half the time), unless OPENBLAS_CORETYPE says which.
   The library reads that variable when it is loaded, before main(). */
void DriverChooseKernels(char **argv);
/* One thread a rank for the BLAS, unless its variables, or OpenMP's, say how many. (A BLAS reads them when it is
   loaded, before main().) */
void DriverOneThread(void);

/* -- sources.c -- */

/* "options_from" in the report: what PETSC_OPTIONS, the files .petscrc and -options_file say, by name; nothing if none
   says anything. On this process alone. */
PetscErrorCode DriverReportSources(cJSON *json);

/* -- report.c: JSON -- */

/* A report with command, scene title, mu (NULL: none) and ranks. */
PetscErrorCode ReportCreate(const char command[], HycoScene scene, const PetscReal mu[], cJSON **json);
/* Into the report, and, where they matter, on the terminal: the largest initial overlap, the sliding, and that nothing
   faces anything. */
PetscErrorCode ReportContacts(cJSON *json, PetscInt n_contacts, PetscInt n_facing, PetscReal overlap,
                              PetscReal sliding);
/* The scene's quantities, in the report and in words. */
PetscErrorCode ReportQuantities(cJSON *json, HycoScene scene, const PetscReal value[]);
/* A table's columns: `n` of them, then the scene's quantities; names: room for HYCO_MAX_QUANTITIES more. */
PetscErrorCode ReportColumns(HycoScene scene, PetscInt n, const char *const columns[], PetscInt *n_all,
                             const char *names[]);
void ReportKKT(cJSON *json, const HycoKKT *kkt);
void ReportSeconds(cJSON *json, const HycoSeconds *seconds);
void ReportVector(cJSON *json, const char name[], PetscInt n, const PetscReal v[]);
/* Mean and largest of an error, in the report and in words, over the converged of n points, and at how many it is not
   defined (x/0; also added to all_undefined). value: n x n_columns row major; column, converged: which of these. */
void ReportError(cJSON *json, const char name[], PetscInt n, PetscInt n_columns, const PetscReal value[],
                 PetscInt column, PetscInt converged, PetscInt *all_undefined);
/* Adds memory_mb and what was missed, writes to -report (if given) on rank 0 and frees. */
PetscErrorCode ReportWrite(cJSON **json);
/* The report of a set of points, n rows of values by column (one named "converged"), and their table at `table`
   ("": none); fails when a point did not converge. */
PetscErrorCode ReportSet(const char command[], const char table[], HycoScene scene, HycoSamples samples,
                         PetscInt n_columns, const char *const columns[], const PetscReal value[], PetscReal seconds);
/* Writes text to a file, whole or not at all, or into a device. On this process alone. */
PetscErrorCode DriverWriteText(const char path[], const char text[]);

/* Writes a CSV: the parameters of each point, then its columns (n x n_columns row major); to a path that ends in .h5 a
   dataset for each. Collective. */
PetscErrorCode DriverWriteTable(const char path[], HycoScene scene, PetscInt n, const PetscReal mu[],
                                PetscInt n_columns, const char *const names[], const PetscReal value[]);

/* Where train keeps its solutions, with a model of this name. */
PetscErrorCode DriverSnapshotFolder(const char model[], char folder[PETSC_MAX_PATH_LEN]);

/* -- contacts.c: what each contact of the scene carries -- */

/* In the report, and in words where there are several. */
PetscErrorCode DriverReportCarried(cJSON *json, PetscInt dim, PetscInt n, const HycoContactResult r[]);
/* Of rank 0's last prediction, on all ranks; n is 0 where the model has not the forces of all contacts. The caller
   frees the results. Collective. */
PetscErrorCode DriverGetCarried(HycoROM model, HycoScene scene, PetscInt *n, HycoContactResult **result);
/* Columns of a table: CONTACT.n_active, CONTACT.force_x, ..., `each` of them a contact; the caller frees the names. */
typedef struct {
  PetscInt dim, n_contacts, each;
  char (*name)[DRIVER_LINE];
} DriverCarried;
PetscErrorCode DriverCarriedColumns(HycoScene scene, PetscInt dim, DriverCarried *columns);
/* Their values in a row; n = 0: not known. v: n_contacts x each. */
void DriverCarriedFill(const DriverCarried *columns, PetscInt n, const HycoContactResult r[], PetscReal v[]);

/* -- progress.c -- */

/* Prints on rank 0. */
PetscErrorCode Say(const char format[], ...) PETSC_ATTRIBUTE_FORMAT(1, 2);
/* A share in percent: "0.12 %", "120 %". */
void DriverPercent(PetscReal share, char text[32]);
/* A HycoProgress: a bar that moves on a terminal, a line a minute elsewhere. ctx: a word for what is done. */
PetscErrorCode DriverProgress(PetscInt done, PetscInt n, void *ctx);
/* A HycoPhaseMonitor: the same, where it takes long. */
PetscErrorCode DriverPhase(const char phase[], PetscInt done, PetscInt n, void *ctx);
/* The same of the points of a set, on rank 0. */
PetscErrorCode DriverSetPhase(PetscInt done, PetscInt n);
/* -quiet: from here on neither words nor progress; errors are told all the same. */
PetscErrorCode DriverReadQuiet(void);
PetscBool DriverIsQuiet(void);
/* Ctrl-C and termination end the run with 130 or 143 and one line, of where the solutions are that are kept. */
PetscErrorCode DriverCatchInterrupt(const char folder[]);
/* -hyco_monitor */
PetscErrorCode DriverReadMonitor(PetscBool *monitor);
/* A HycoMonitor. */
PetscErrorCode DriverMonitor(PetscInt iteration, PetscInt n_active, PetscInt changes, void *ctx);

/* -- beat.c -- */

/* Rank 0's thread that tells what a long step is: begun, ended, put off by what else is said. */
void DriverBeatBegin(void);
void DriverBeatHold(void);
void DriverBeatEnd(void);
/* Seconds between lines of progress in a file. */
void DriverBeatSetPeriod(PetscReal seconds);
PetscReal DriverBeatPeriod(void);

/* -- greedy.c -- */

/* What a greedy training said, on rank 0: its table, and how it ended. */
typedef struct {
  HycoScene scene;                /* borrowed */
  char table[PETSC_MAX_PATH_LEN]; /* "": none */
  char *text;                     /* the table; PetscFree() it */
  size_t length, room;
  PetscInt iterations, infinite;
  PetscReal max_eta, target;
  char stop[16];
} GreedyLog;

/* A point (NULL: none) in words ("mu1 = 0.05, mu2 = 0.1") and as columns ("0.05,0.1,"; may be NULL). */
PetscErrorCode DriverFormatPoint(HycoScene scene, const PetscReal mu[], char words[DRIVER_LINE],
                                 char columns[DRIVER_LINE]);
/* Reads the options of train -greedy, makes the training set and sets the reducer, which will fill `log`; without a
   scene, declares them. */
PetscErrorCode DriverReadGreedy(HycoScene scene, HycoReducer reducer, HycoSamples *training, GreedyLog *log);
/* Says that the loop ended short of what was asked: of -target, or, where that was left to its default, of the limits
   that were given. Collective. */
PetscErrorCode DriverJudgeGreedy(const GreedyLog *log);
void DriverReportGreedy(cJSON *json, const GreedyLog *log);

/* -- fallback.c: predict with the scene at hand -- */

/* When predict solves full order instead, whether it solves for the displacement alone, and with what. */
typedef struct {
  PetscBool on, displacement;
  PetscReal target_u, target_lambda; /* 0: none */
  HycoScene scene;                   /* NULL unless on or displacement */
  HycoFOM fom;                       /* made by the first solve */
  PetscReal strain_energy;           /* of the last */
} Fallback;

/* -target_KIND: a relative error above 0 and at most 1; 0 when absent. */
PetscErrorCode DriverReadTarget(HycoErrorKind kind, PetscReal *target);
/* Reads the options and the scene, which must be the model's. Collective. */
PetscErrorCode DriverReadFallback(HycoROM model, PetscBool extrapolate, Fallback *fallback);
PetscErrorCode DriverEndFallback(Fallback *fallback);
/* Why this prediction is not enough; "": it is. */
void DriverWantsFullOrder(const Fallback *fallback, const HycoPrediction *p, char why[DRIVER_LINE]);
/* Solves at mu (length n); the results take the prediction's place, u over the whole mesh. Collective. */
PetscErrorCode DriverSolveFullOrder(Fallback *fallback, PetscInt n, const PetscReal mu[], HycoPrediction *p);

/* One full solve at mu (length n) with the forces of the condensed model's last prediction, held on rank 0: u over the
   whole mesh takes the place of the prediction's, residuals of (16) that of its own. Collective. */
PetscErrorCode DriverSolveDisplacement(Fallback *fallback, HycoROM model, PetscInt n, const PetscReal mu[],
                                       HycoPrediction *p);

/* -- search.c: what train tried, and what the model is worth -- */

typedef struct {
  PetscBool on;                    /* a target was given */
  PetscReal target[HYCO_N_ERRORS]; /* 0: none */
  PetscInt budget;                 /* of solutions added to meet them; < 0: the default */
  HycoScene scene;                 /* borrowed */
  PetscInt n_points, n;            /* training points, with what was added; attempts in all */
  char table[PETSC_MAX_PATH_LEN];  /* "": none */
  char *text;                      /* the table; PetscFree() it */
  size_t length, room;
} Search;

/* -target_max_added. */
PetscErrorCode DriverReadBudget(PetscInt *budget);
/* The -target_ options. */
PetscErrorCode DriverReadTargets(Search *search);
/* Hands them to the reducer, which will tell `search` of its attempts. */
PetscErrorCode DriverSetSearch(Search *search, HycoScene scene, HycoReducer reducer, PetscInt n_points);
/* Says what was chosen and the errors at held-out points; where they miss the targets, or the least that a model should
   be good for, so loudly (DriverMissed()). Collective. */
PetscErrorCode DriverJudgeModel(const Search *search, const HycoTraining *training);
void DriverReportModel(cJSON *json, const Search *search, const HycoTraining *training);

/* -- steps.c: the listed times of a path; reduced: those of predict, whose numbers are of the RID -- */

/* A line on rank 0; n: how many times the scene lists. */
PetscErrorCode DriverSayStep(const HycoStep *step, PetscInt n);
/* A CSV ("": none) with a row for each of n times. Collective. */
PetscErrorCode DriverWriteSteps(const char table[], HycoScene scene, const PetscReal mu[], PetscBool reduced,
                                PetscInt n, const HycoStep step[]);
/* An array of n for each of their numbers, and of the scene's quantities under `outputs`. */
PetscErrorCode DriverReportSteps(cJSON *history, HycoScene scene, PetscBool reduced, PetscInt n, const HycoStep step[]);

/* -- solve_history.c: a path -- */

/* How many times the scene lists; whether unread options have been looked for. */
typedef struct {
  PetscInt n;
  PetscBool checked;
} DriverPath;
/* A HycoStepMonitor; ctx: a DriverPath. */
PetscErrorCode DriverMonitorStep(HycoFOM fom, const HycoStep *step, void *ctx);
PetscErrorCode DriverReportHistory(cJSON *json, HycoScene scene, const HycoHistory *history);
/* After the solve: the table ("": none), a summary; fails where the path has not reached its end. Collective. */
PetscErrorCode DriverEndHistory(HycoFOM fom, HycoScene scene, const PetscReal mu[], const char table[]);

/* -- predict_history.c: a reduced path -- */

/* The listed times that a prediction reached. On every rank. */
typedef struct {
  PetscInt n;
  HycoStep *step; /* PetscFree() it */
  PetscBool ended;
  PetscReal t;
  char why[DRIVER_LINE];
  PetscBool balanced;          /* -hyco_residual */
  HycoEquilibrium equilibrium; /* then, on rank 0; the model's */
} DriverReducedPath;
/* The last prediction's, model on rank 0. Collective. */
PetscErrorCode DriverGetReducedPath(HycoROM model, DriverReducedPath *path);
/* A line a time; the table ("": none). Collective. */
PetscErrorCode DriverSayReducedPath(HycoScene scene, const PetscReal mu[], const DriverReducedPath *path,
                                    const char table[]);
PetscErrorCode DriverReportReducedPath(cJSON *json, HycoScene scene, const DriverReducedPath *path);
/* How far from equilibrium it is, where that is asked for. */
PetscErrorCode DriverSayEquilibrium(const DriverReducedPath *path);

/* -- compare_history.c -- */

/* The numbers of a point; one point on one group; their statistics, table ("": none) and report, on every rank; fails
   where a reduced path did not reach its end. */
PetscInt DriverPathColumns(void);
PetscErrorCode DriverComparePath(HycoFOM fom, HycoROM model, PetscBool root, PetscInt n_par, const PetscReal mu[],
                                 PetscReal v[]);
PetscErrorCode DriverReportPaths(HycoScene scene, PetscBool contact, PetscInt n, const PetscReal mu[],
                                 const PetscReal value[], const char table[]);

PetscErrorCode CommandCheck(void);
PetscErrorCode CommandSolve(void);
PetscErrorCode CommandTrain(void);
PetscErrorCode CommandPredict(void);
PetscErrorCode CommandCompare(void);
PetscErrorCode CommandView(void);
PetscErrorCode DeclareCheck(PetscOptions options);
PetscErrorCode DeclareSolve(PetscOptions options);
PetscErrorCode DeclareTrain(PetscOptions options);
PetscErrorCode DeclarePredict(PetscOptions options);
PetscErrorCode DeclareCompare(PetscOptions options);
PetscErrorCode DeclareView(PetscOptions options);

#endif
