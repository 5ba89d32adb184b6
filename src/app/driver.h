/* The command line: common declarations of the commands. */
#ifndef HYCO_DRIVER_H
#define HYCO_DRIVER_H

#include <hyco.h>
#include <cjson/cJSON.h>

#include <hycoprogram.h>

#define DRIVER_LINE 1024

typedef struct {
  const char *name;
  PetscErrorCode (*run)(void);
  PetscErrorCode (*declare)(
      PetscOptions); /* declares its own options: calls all functions that read options (HycoOptionsRecord()) */
  const char *usage, *meaning;
  const char *classes; /* those whose objects read their options in it */
} Command;

extern const Command commands[]; /* ends with name NULL */

/* -- args.c: options -- */

/* Checks that every option on the command line is known to `command`, or PETSc's, and that there are no other words. */
PetscErrorCode DriverCheckArguments(const Command *command, int argc, char **argv);
/* Fails for options that were given on the command line, but that no rank has read: at the end of each command, when
   its results are written. */
PetscErrorCode DriverCheckLeft(void);
/* The same before the solvers have run: options that one of them may read are accepted. */
PetscErrorCode DriverCheckLeftEarly(void);
/* Fails for an option on the command line that only such objects read (HycoOption.only), with the reason. */
PetscErrorCode DriverRefuseOnly(const char only[], const char reason[]);
/* Declares -name and reads its value, "" if absent; `text` as in HycoOptionsString(). */
PetscErrorCode DriverGet(const char name[], const char text[], char value[PETSC_MAX_PATH_LEN]);
/* Reads -scene, -model, -output, -report, -table, common to several commands; NULL: not read. */
PetscErrorCode DriverReadFiles(char scene[], char model[], char output[], char report[], char table[]);
/* Fails for a value that is "". */
PetscErrorCode DriverRequire(const char name[], const char value[]);
/* Prints the options of a command (NULL: all). On this process alone. */
PetscErrorCode DriverHelp(const Command *command);
/* hyco help output: a line for each key, column and dataset that the command writes, with tabs between its parts:
   place, commands, name, kind, unit, meaning. */
PetscErrorCode DriverHelpOutput(void);
/* Whether an object of the command reads an option of the library. Of a model's, some are read by one command only. */
PetscBool DriverReads(const Command *command, const HycoOption *option);

/* -- outputs.c: files -- */

/* Checks that the files to be written by `command` are distinct, are not among those it reads, whatever their names,
   and are in writable folders, or are devices. Before any work; does not count an option as read. Collective. */
PetscErrorCode DriverCheckOutputs(const Command *command);
/* Checks that the scene's mesh is not one of them. Collective. */
PetscErrorCode DriverCheckMesh(HycoScene scene);

/* -- points.c: points in the parameter space; without a scene, these functions only declare their options -- */

/* One point: -mu v,v,... or -mu_NAME v. held: values of parameters that need no -mu_NAME, NaN: it needs one; NULL: all
   do. */
PetscErrorCode DriverGetPoint(HycoScene scene, const PetscReal held[], PetscReal mu[]);
/* -extrapolate, of predict and compare. */
PetscErrorCode DriverReadExtrapolate(PetscBool *extrapolate);
/* -hold_NAME v, held[n_parameters]; NaN: not given. */
PetscErrorCode DriverGetHeld(HycoScene scene, PetscReal held[]);
/* Whether -mu or a -mu_NAME was given. */
PetscErrorCode DriverHasPoint(HycoScene scene, PetscBool *given);
/* A set of points: -grid (closed: by default with the ends of the ranges), -values_NAME, -points or -scatter. *given:
   whether any was. */
PetscErrorCode DriverGetSamples(HycoScene scene, PetscBool closed, HycoSamples *samples, PetscBool *given);
/* Whether any point-set option was given. */
PetscErrorCode DriverHasSamples(HycoScene scene, PetscBool *given);
/* The points from which a greedy training chooses: -training_grid, closed unless -grid_type is given. */
PetscErrorCode DriverGetTrainingGrid(HycoScene scene, HycoSamples *samples);
/* The points by which models are judged: -validation_grid or -validation_points; NULL if neither is given. */
PetscErrorCode DriverGetValidation(HycoScene scene, HycoSamples *samples);

/* -- status.c: exit status -- */

enum {
  DRIVER_DONE = 0,
  DRIVER_FAILED = 1, /* one line gives the reason; nothing is half-written */
  DRIVER_MISSED = 3  /* results are written, but miss a target or the default limits */
};

/* The results miss a target: prints one line on stderr from rank 0, beginning "hyco: missed:", adds an entry of
   "missed" in the report, which must be written after this, and sets the exit status DRIVER_MISSED unless an error
   follows. The text says what was reached, what was required and what to do. To be called on every rank, because all
   have the same exit status. */
PetscErrorCode DriverMissed(const char format[], ...) PETSC_ATTRIBUTE_FORMAT(1, 2);
void DriverReportMissed(cJSON *json);
/* The exit status of a run that ended with `ierr`; to be called once, at the end. */
int DriverEndStatus(PetscErrorCode ierr);
/* -- launch.c: ranks and threads -- */

/* Reads the launcher's variables; to be called before MPI begins. */
void DriverNoteLaunch(void);
/* Settings of MPI for a process without a launcher; to be called before MPI begins. Variables of the environment
   take precedence. */
void DriverStartAlone(void);
/* Prints an error found before MPI begins, once for all ranks. Returns false. */
PetscBool DriverRefuseEarly(const char text[]);
/* Raises the limit of the stack if it is too low, and starts the program again; false, with a line on stderr: it cannot
 * be raised. */
PetscBool DriverHasStack(char **argv);
/* Fails if a launcher of another MPI has started several processes, each of which would do all the work and write
   the same files. Collective. */
PetscErrorCode DriverCheckLaunch(void);
/* HycoBLASChooseKernels() (a factor takes half the time); where it cannot, the program is started again, unless argv is
   NULL. */
void DriverChooseKernels(char **argv);

/* -- option_files.c -- */

/* Before PETSc reads them: whether option files, and those that they name, come to an end and are YAML where they are
   to be; false, with a line on stderr: not. */
PetscBool DriverCheckOptionFiles(int argc, char **argv);
/* "options_from" in the report: the options in PETSC_OPTIONS, the files .petscrc and -options_file, by name; nothing
   if there are none. On this process alone. */
PetscErrorCode DriverReportOptionFiles(cJSON *json);

/* -- report.c: JSON -- */

/* A report with command, scene title, mu (NULL: none) and ranks. */
PetscErrorCode ReportCreate(const char command[], HycoScene scene, const PetscReal mu[], cJSON **json);
/* A line if sliding, the largest of all solutions, is above 1. */
PetscErrorCode DriverWarnSliding(PetscReal sliding);
PetscErrorCode DriverWarnSteps(PetscReal time_error);
/* Adds to the report, and prints where relevant: the largest initial overlap, the sliding, and whether no contact
   faces a master. */
PetscErrorCode ReportContacts(cJSON *json, PetscInt n_contacts, PetscInt n_facing, PetscReal overlap,
                              PetscReal sliding);
/* The scene's quantities, in the report and in the text. */
PetscErrorCode ReportQuantities(cJSON *json, HycoScene scene, const PetscReal value[]);
/* A table's columns: `n` of them, then the scene's quantities; names: room for HYCO_MAX_QUANTITIES more. */
PetscErrorCode ReportColumns(HycoScene scene, PetscInt n, const char *const columns[], PetscInt *n_all,
                             const char *names[]);
/* After these columns of outputs, names[n .. *n_all), their extremes along a path: "path_NAME", in extreme[]. */
PetscErrorCode ReportExtremes(PetscInt n, const char *names[], PetscInt *n_all,
                              char extreme[HYCO_MAX_QUANTITIES][DRIVER_LINE]);
/* Adds numbers in this order: ReportNumbers(json, {"n_dof", n}, {"seconds", t}). */
#define ReportNumbers(json, ...)                                                                                       \
  ReportNumbers_Private(json, (PetscInt)(sizeof((ReportNumber[]){__VA_ARGS__}) / sizeof(ReportNumber)),                \
                        (const ReportNumber[]){__VA_ARGS__})
typedef struct {
  const char *name;
  double value;
} ReportNumber;
void ReportNumbers_Private(cJSON *json, PetscInt n, const ReportNumber number[]);
void ReportKKT(cJSON *json, const HycoKKT *kkt);
void ReportSeconds(cJSON *json, const HycoSeconds *seconds);
/* What a prediction gains: processor time of a point or path of a set at full order and predicted, with outputs and
   estimates, and of the training (0: not known). Prints a line, and adds `gain`. */
PetscErrorCode DriverReportGain(cJSON *json, const char point[], PetscReal full, PetscReal reduced, PetscReal training);
void ReportVector(cJSON *json, const char name[], PetscInt n, const PetscReal v[]);
/* Mean and largest of an error, in the report and in the text, over the converged of n points, and the number of
   points where it is not defined (x/0; also added to all_undefined). value: n x n_columns row major; column,
   converged: column numbers. */
void ReportError(cJSON *json, const char name[], PetscInt n, PetscInt n_columns, const PetscReal value[],
                 PetscInt column, PetscInt converged, PetscInt *all_undefined);
/* The same of the absolute error of an output of the scene. */
void ReportOutputError(cJSON *json, const char name[], PetscInt n, PetscInt n_columns, const PetscReal value[],
                       PetscInt column, PetscInt converged);
/* Adds memory_mb and the missed targets, writes to -report (if given) on rank 0 and frees. */
PetscErrorCode ReportWrite(cJSON **json);
/* Writes text to a file, completely or not at all, or to a device. On this process alone. */
PetscErrorCode DriverWriteText(const char path[], const char text[]);

/* -- table.c: rows of results, one for each point -- */

/* Points of a set that have a gradient, those of them that converged and have none, and why the first has not. */
typedef struct {
  PetscInt n_found, n;
  char why[HYCO_LINE];
} DriverLacking;

/* Rows first .. first + n - 1, n x width row major. */
typedef struct {
  PetscInt first, n;
  PetscReal *value;
} DriverPiece;
/* The rows of a table that this rank has, in ascending pieces; every row is on one rank. */
typedef struct {
  PetscInt n, width; /* rows on all ranks; columns */
  PetscInt n_pieces;
  DriverPiece *piece;
  DriverLacking lacking; /* of -gradient */
} DriverRows;

/* Adds a piece after the others; value: its n x width zeros, which the rows own. */
PetscErrorCode DriverRowsAdd(DriverRows *rows, PetscInt first, PetscInt n, PetscReal **value);
/* Frees the pieces that DriverRowsAdd() made. */
PetscErrorCode DriverRowsFree(DriverRows *rows);
/* All n rows as those of rank 0, whatever the other ranks have; value and piece are borrowed. */
DriverRows DriverRowsOfRoot(PetscInt n, PetscInt width, PetscReal value[], DriverPiece *piece);
/* Writes a CSV: the parameters of each point (mu: of all points), then its columns; for a path that ends in .h5 one
   dataset for each, to which each rank writes its rows. Collective. */
PetscErrorCode DriverWriteTable(const char path[], HycoScene scene, const PetscReal mu[], const char *const names[],
                                const DriverRows *rows);
/* The report of a set of points from the rows of their values (one column is named "converged"), and their table at
   `table` ("": none); fails if a point did not converge or has no gradient. Collective. */
PetscErrorCode ReportSet(const char command[], const char table[], HycoScene scene, HycoSamples samples,
                         const char *const columns[], const DriverRows *rows, PetscReal seconds);

/* The folder of train's solutions for a model of this name. */
PetscErrorCode DriverSnapshotFolder(const char model[], char folder[PETSC_MAX_PATH_LEN]);

/* -- contacts.c: results of each contact of the scene -- */

/* In the report, and in the text if there are several. */
PetscErrorCode DriverReportCarried(cJSON *json, PetscInt dim, PetscInt n, const HycoContactResult r[]);
/* Those of rank 0's last prediction, on all ranks; n is 0 if the model does not have the forces of all contacts. The
   caller frees the results. Collective. */
PetscErrorCode DriverGetCarried(HycoROM model, HycoScene scene, PetscInt *n, HycoContactResult **result);
/* Columns of a table: CONTACT.n_active, CONTACT.force_x, ..., `each` of them for a contact; the caller frees the
   names. */
typedef struct {
  PetscInt dim, n_contacts, each;
  char (*name)[DRIVER_LINE];
} DriverCarried;
PetscErrorCode DriverCarriedColumns(HycoScene scene, PetscInt dim, DriverCarried *columns);
/* Their values in a row; n = 0: not known. v: n_contacts x each. */
void DriverCarriedFill(const DriverCarried *columns, PetscInt n, const HycoContactResult r[], PetscReal v[]);

/* -- gradients.c: derivatives of the outputs -- */

/* -gradient */
PetscErrorCode DriverReadGradient(PetscBool *gradient);
/* In the report and in the text. */
PetscErrorCode DriverReportGradient(cJSON *json, HycoScene scene, const HycoGradient *gradient);
/* Columns of a table, if `on`: d_OUTPUT_d_PARAMETER, and the number of kinks; the caller frees the names. */
typedef struct {
  PetscBool on;
  PetscInt n;
  char (*name)[DRIVER_LINE];
} DriverGradients;
PetscErrorCode DriverGradientColumns(HycoScene scene, DriverGradients *columns);
/* Their values in a row (v: n). */
void DriverGradientFill(const DriverGradients *columns, const HycoGradient *gradient, PetscReal v[]);
/* Ends catching the error of the gradient of a converged point: fills its columns (v: n, NaN before), or counts it. */
PetscErrorCode DriverGradientCatch(const DriverGradients *columns, const HycoGradient *gradient, PetscErrorCode caught,
                                   DriverLacking *lacking, PetscReal v[]);
/* Sums the points of all ranks; fails if there are some and none has a gradient. Collective. */
PetscErrorCode DriverGradientsEnd(DriverLacking *lacking);

/* -- progress.c -- */

/* Prints on rank 0. */
PetscErrorCode DriverPrint(const char format[], ...) PETSC_ATTRIBUTE_FORMAT(1, 2);
/* A share in percent: "0.12 %", "120 %". */
void DriverPercent(PetscReal share, char text[32]);
/* A HycoProgress: a bar on a terminal, a line a minute elsewhere. ctx: a word for the activity. */
PetscErrorCode DriverProgress(PetscInt done, PetscInt n, void *ctx);
/* A HycoPhaseMonitor: the same, for long phases. */
PetscErrorCode DriverPhase(const char phase[], PetscInt done, PetscInt n, void *ctx);
/* The same for the points of a set, on rank 0. */
PetscErrorCode DriverSetPhase(PetscInt done, PetscInt n);
/* -quiet: from here on neither text nor progress is printed; errors are. */
PetscErrorCode DriverReadQuiet(void);
PetscBool DriverIsQuiet(void);
/* Ctrl-C and termination end the run with status 130 or 143 and one line, which gives the folder of the stored
   solutions. */
PetscErrorCode DriverCatchInterrupt(const char folder[]);
/* -hyco_monitor */
PetscErrorCode DriverReadMonitor(PetscBool *monitor);
/* A HycoMonitor. */
PetscErrorCode DriverMonitor(PetscInt iteration, PetscInt n_active, PetscInt changes, void *ctx);

/* -- progress_thread.c -- */

/* Rank 0's thread that prints the current long step: started, ended, delayed by other output. */
void DriverProgressBegin(void);
void DriverProgressHold(void);
void DriverProgressEnd(void);
/* Seconds between lines of progress in a file. */
void DriverProgressSetPeriod(PetscReal seconds);
PetscReal DriverProgressPeriod(void);

/* -- greedy.c -- */

/* Output of a greedy training, on rank 0: its table, and how it ended. */
typedef struct {
  HycoScene scene;                /* borrowed */
  char table[PETSC_MAX_PATH_LEN]; /* "": none */
  char *text;                     /* the table; PetscFree() it */
  size_t length, room;
  PetscInt iterations, infinite;
  PetscReal max_eta, target;
  char stop[16];
} GreedyLog;

/* A point (NULL: none) as text ("mu1 = 0.05, mu2 = 0.1") and as columns ("0.05,0.1,"; may be NULL). */
PetscErrorCode DriverFormatPoint(HycoScene scene, const PetscReal mu[], char words[DRIVER_LINE],
                                 char columns[DRIVER_LINE]);
/* Reads the options of train -greedy, creates the training set and sets the reducer, which fills `log`; without a
   scene, declares them. */
PetscErrorCode DriverReadGreedy(HycoScene scene, HycoReducer reducer, HycoSamples *training, GreedyLog *log);
/* Reports that the loop ended without meeting -target or, if that has its default, the limits that were given.
   Collective. */
PetscErrorCode DriverJudgeGreedy(const GreedyLog *log);
void DriverReportGreedy(cJSON *json, const GreedyLog *log);

/* -- full_order.c: predict with the scene -- */

/* When predict solves full order instead, whether it solves for the displacement only, and the objects for it. */
typedef struct {
  PetscBool on, displacement;
  PetscReal target_u, target_lambda;               /* 0: none */
  HycoScene scene;                                 /* NULL unless on or displacement */
  HycoFOM fom;                                     /* created by the first solve */
  PetscReal strain_energy;                         /* of the last solve */
  PetscInt n_outputs, output[HYCO_MAX_QUANTITIES]; /* by output of the model: its number in that scene, -1: none */
} Fallback;

/* -target_KIND: a relative error above 0 and at most 1; 0 when absent. */
PetscErrorCode DriverReadTarget(HycoErrorKind kind, PetscReal *target);
/* Reads the options and the scene, which must be the model's. Collective. */
PetscErrorCode DriverReadFallback(HycoROM model, PetscBool extrapolate, Fallback *fallback);
PetscErrorCode DriverEndFallback(Fallback *fallback);
/* The reason why this prediction is not sufficient; "": it is. */
void DriverWantsFullOrder(const Fallback *fallback, const HycoPrediction *p, char why[DRIVER_LINE]);
/* Solves at mu (length n); the results replace the prediction's, u over the whole mesh. Collective. */
PetscErrorCode DriverSolveFullOrder(Fallback *fallback, PetscInt n, const PetscReal mu[], HycoPrediction *p);

/* One full-order solve at mu (length n) with the forces of the model's last prediction, which are on rank
   0: u over the whole mesh replaces the prediction's, and the residuals of (16) replace its own. Collective. */
PetscErrorCode DriverSolveDisplacement(Fallback *fallback, HycoROM model, PetscInt n, const PetscReal mu[],
                                       HycoPrediction *p);

/* -- report_training.c: the attempts of train, and the errors of the model -- */

typedef struct {
  PetscBool on;                                       /* a target was given */
  PetscReal target[HYCO_N_ERRORS];                    /* 0: none */
  PetscReal aim[HYCO_N_ERRORS], limit[HYCO_N_ERRORS]; /* HycoReducerGetTargets() */
  PetscInt budget;                                    /* of solutions added to meet them; < 0: the default */
  HycoScene scene;                                    /* borrowed */
  PetscInt n_points, n;                               /* training points, including added ones; number of attempts */
  char table[PETSC_MAX_PATH_LEN];                     /* "": none */
  char *text;                                         /* the table; PetscFree() it */
  size_t length, room;
  HycoAttempt fastest; /* of those within the limits; number 0: none */
} Search;

/* -target_max_added. */
PetscErrorCode DriverReadBudget(PetscInt *budget);
/* The -target_ options. */
PetscErrorCode DriverReadTargets(Search *search);
/* Passes them to the reducer, which will report its attempts to `search`. */
PetscErrorCode DriverSetSearch(Search *search, HycoScene scene, HycoReducer reducer, PetscInt n_points);
/* Prints the chosen settings and the errors at held-out points; if they miss the targets, or the default limits,
   calls DriverMissed(). Collective. */
PetscErrorCode DriverJudgeModel(const Search *search, const HycoTraining *training);
void DriverReportModel(cJSON *json, const Search *search, const HycoTraining *training);

/* -- steps.c: the listed times of a path; reduced: those of predict, whose values are those of the RID -- */

/* Prints a line on rank 0; n: number of listed times of the scene. */
PetscErrorCode DriverPrintStep(const HycoStep *step, PetscInt n, PetscBool reduced);
/* Says that contact forces are not unique, if there are dependent contacts: of a path with the listed times. */
PetscErrorCode DriverPrintDependent(PetscInt n_dependent, PetscInt n, const HycoStep step[]);
/* What forces and moments miss of balance; < 0: not compared. */
PetscErrorCode DriverPrintBalance(PetscReal balance);
/* A CSV ("": none) with a row for each of n times. Collective. */
PetscErrorCode DriverWriteSteps(const char table[], HycoScene scene, const PetscReal mu[], PetscBool reduced,
                                PetscInt n, const HycoStep step[]);
/* An array of the values at each of n times, with the scene's quantities under `outputs`. */
PetscErrorCode DriverReportSteps(cJSON *history, HycoScene scene, PetscBool reduced, PetscInt n, const HycoStep step[]);

/* -- solve_path.c: a path -- */

/* The number of listed times of the scene; whether unread options have been checked. */
typedef struct {
  PetscInt n;
} DriverPath;
/* A HycoStepMonitor; ctx: a DriverPath. */
PetscErrorCode DriverMonitorStep(HycoFOM fom, const HycoStep *step, void *ctx);
PetscErrorCode DriverReportHistory(cJSON *json, HycoScene scene, const HycoHistory *history);
/* After the solve: the table ("": none), a summary; fails if the path has not reached its end. Collective. */
PetscErrorCode DriverEndHistory(HycoFOM fom, HycoScene scene, const PetscReal mu[], const char table[]);

/* -- predict_path.c: a reduced path -- */

/* The listed times that a prediction reached. On every rank. */
typedef struct {
  PetscInt n;
  HycoStep *step; /* PetscFree() it */
  PetscBool ended;
  PetscReal t, time_error;
  char why[DRIVER_LINE];
  PetscBool balanced;          /* -hyco_residual */
  HycoEquilibrium equilibrium; /* its result, on rank 0; borrowed from the model */
} DriverReducedPath;
/* That of the last prediction, model on rank 0. Collective. */
PetscErrorCode DriverGetReducedPath(HycoROM model, DriverReducedPath *path);
/* Prints a line for each time; the table ("": none). Collective. */
PetscErrorCode DriverPrintReducedPath(HycoScene scene, const PetscReal mu[], const DriverReducedPath *path,
                                      const char table[]);
PetscErrorCode DriverReportReducedPath(cJSON *json, HycoScene scene, const DriverReducedPath *path);
/* Prints its residual of equilibrium, if requested. */
PetscErrorCode DriverPrintEquilibrium(const DriverReducedPath *path);

/* -- compare_report.c: the columns of compare's table, and its report -- */

/* The errors of a point, in this order; those of a path are the HYCO_N_ERRORS at its worst listed time, then as many at
   its end. */
enum {
  DRIVER_U,
  DRIVER_U_H1,
  DRIVER_U_RID,
  DRIVER_SIGMA,
  DRIVER_SIGMA_11,
  DRIVER_LAMBDA_RID,
  DRIVER_LAMBDA_RID_DUAL,
  DRIVER_LAMBDA,
  DRIVER_LAMBDA_DUAL
};
/* The columns that follow the errors, of a point or of a path. */
enum {
  DRIVER_CONVERGED,
  DRIVER_FALLBACK,
  DRIVER_REACHED = DRIVER_FALLBACK,
  DRIVER_KKT,
  DRIVER_COVERED,
  DRIVER_ITERATIONS = DRIVER_COVERED,
  DRIVER_CPU_FOM,
  DRIVER_CPU_ROM,
  DRIVER_LAMBDA_NORM, /* of full order, of points alone */
  DRIVER_SIGMA_NORM
};
#define DRIVER_ESTIMATES                                                                                               \
  3 /* of u, stress and forces (NaN: none); HycoPrediction.unseen, .loose, .rid_fraction follow */
/* From column n_errors on those above, from `estimates` on the estimates, from `outputs` on the absolute error of each
   output; of a path at its worst time, then of each at the end. */
typedef struct {
  PetscBool paths;
  PetscInt n_errors, estimates, outputs, n;
  const char *names[3 * (HYCO_MAX_QUANTITIES + HYCO_N_ERRORS)];
  char text[3 * (HYCO_MAX_QUANTITIES + HYCO_N_ERRORS)][DRIVER_LINE];
} DriverColumns;
PetscErrorCode DriverCompareColumns(PetscBool paths, PetscInt n_outputs, const char *const outputs[],
                                    DriverColumns *columns);
/* value: n rows, on every rank; training: as of DriverReportGain(). Fails if a prediction did not converge. */
PetscErrorCode DriverReportComparison(HycoScene scene, PetscBool contact, PetscReal training,
                                      const DriverColumns *columns, PetscInt n, const PetscReal value[]);

PetscErrorCode CommandCheck(void);
PetscErrorCode CommandSolve(void);
PetscErrorCode CommandTrain(void);
PetscErrorCode CommandPredict(void);
PetscErrorCode CommandCompare(void);
PetscErrorCode CommandFit(void);
PetscErrorCode CommandExport(void);
PetscErrorCode CommandView(void);
PetscErrorCode DeclareCheck(PetscOptions options);
PetscErrorCode DeclareSolve(PetscOptions options);
PetscErrorCode DeclareTrain(PetscOptions options);
PetscErrorCode DeclarePredict(PetscOptions options);
PetscErrorCode DeclareCompare(PetscOptions options);
PetscErrorCode DeclareFit(PetscOptions options);
PetscErrorCode DeclareExport(PetscOptions options);
PetscErrorCode DeclareView(PetscOptions options);

#endif
