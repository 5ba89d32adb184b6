/* hyco: the table of commands. */
#include "driver.h"
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

const Command commands[] = {
    {"check", CommandCheck, DeclareCheck, "hyco check -scene FOLDER [-check_solve] [-report R.json]",
     "read a scene and assemble it at the corners of its ranges: report its contents, likely mistakes, and the cost of "
     "a solve and of a training (-grid N,N,...)",
     "HycoFOM HycoSolver"},
    {"solve", CommandSolve, DeclareSolve, "hyco solve -scene FOLDER -mu V,V,... [-output F.xdmf] [-report R.json]",
     "solve full order, for one point or for a set of points (-table T.csv)", "HycoFOM HycoSolver"},
    {"train", CommandTrain, DeclareTrain,
     "hyco train -scene FOLDER -grid N,N,... | -greedy -training_grid N,N,... -model M.h5 [-report R.json]",
     "solve a set of points at full order (resumable), or choose the points one by one; reduce, and write the model; "
     "with -target_u 1e-2 -target_lambda 5e-2 ... the cheapest model of this accuracy",
     "HycoFOM HycoSolver HycoSnapshots HycoReducer HycoROM"},
    {"predict", CommandPredict, DeclarePredict,
     "hyco predict -model M.h5 -mu V,V,... [-output F.xdmf] [-report R.json]",
     "solve the reduced model, for one point or for a set of points (-table T.csv), and estimate its errors; reads "
     "only the model file, except with -hyco_fallback or -hyco_full_displacement, which need -scene FOLDER",
     "HycoFOM HycoSolver HycoROM"},
    {"compare", CommandCompare, DeclareCompare,
     "hyco compare -scene FOLDER -model M.h5 -mu V,V,... | -grid N,N,... [-report R.json] [-table T.csv]",
     "errors and speed-up of the reduced model, relative to full order, over a set of points",
     "HycoFOM HycoSolver HycoROM"},
    {"fit", CommandFit, DeclareFit, "hyco fit -model M.h5 -target_OUTPUT V ... [-scene FOLDER] [-report R.json]",
     "find the parameter values at which a model's outputs are closest to targets, within its ranges and by its "
     "gradients; with -scene FOLDER the answer is checked by one full-order solve",
     "HycoFOM HycoSolver HycoROM"},
    {"export", CommandExport, DeclareExport, "hyco export -model M.h5 -c FILE.c",
     "write the predictions of a model of bodies as C99 without dependencies, and compare it with the model", ""},
    {"view", CommandView, DeclareView, "hyco view -model M.h5 | -scene FOLDER",
     "describe the contents of a model or a scene", ""},
    {NULL, NULL, NULL, NULL, NULL, NULL},
};

static char message[DRIVER_LINE];

/* Keeps the text of an error where it is raised, not of the calls that it passes through; of several errors the last is
   the one that ends the run. DriverStop() prints it as one line. */
static PetscErrorCode KeepMessage(MPI_Comm comm, int line, const char *function, const char *file, PetscErrorCode code,
                                  PetscErrorType type, const char *text, void *ctx)
{
  if (HycoWantsTrace()) (void)!PetscTraceBackErrorHandler(comm, line, function, file, code, type, text, ctx);
  if (type == PETSC_ERROR_INITIAL) {
    /* Errors that a user can mend have a text written for them; all others are defects, shown with their place. */
    if (code == PETSC_ERR_USER || code == PETSC_ERR_ORDER || code > PETSC_ERR_MAX_VALUE)
      snprintf(message, sizeof(message), "%s", text ? text : "");
    else
      snprintf(message, sizeof(message), "internal error %d in %s (%s:%d): %s", (int)code, function ? function : "?",
               file ? file : "?", line, text ? text : "");
    /* Names from files may contain control characters, and end up on a terminal. */
    HycoMakePrintable(message);
  }
  return code;
}

static int stopped; /* used only by LeakSanitizer */

#if defined(__SANITIZE_ADDRESS__)
/* Called by LeakSanitizer at the end: a refused run does not free its objects. */
int __lsan_is_turned_off(void);
int __lsan_is_turned_off(void)
{
  return stopped;
}
#endif

/* Ends a failed run: one line from the lowest rank with the error. Ranks that wait for this one in a collective call
   are ended too. */
static void DriverStop(void)
{
  PetscMPIInt rank;
  MPI_Request request;
  int together = 0;

  stopped = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  if (rank == 0) {
    fprintf(stderr, "hyco: error: %s\n", message);
    fflush(stderr);
  }
  MPI_Ibarrier(MPI_COMM_WORLD, &request);
  /* Three seconds for the others to arrive, in steps of 10 ms. */
  for (int k = 0; k < 300 && !together; k++) {
    const struct timespec nap = {0, 10000000};

    MPI_Test(&request, &together, MPI_STATUS_IGNORE);
    if (!together) nanosleep(&nap, NULL);
  }
  if (!together) {
    /* Rank 0 has not spoken for this error, since it waits in a call of its own. */
    if (rank) fprintf(stderr, "hyco: error on rank %d: %s\n", rank, message);
    fflush(stderr);
    MPI_Abort(MPI_COMM_WORLD, 1);
  }
}

/* NULL: there is no such command. */
static const Command *FindCommand(const char name[])
{
  for (PetscInt k = 0; commands[k].name; k++) {
    if (strcmp(name, commands[k].name) == 0) return &commands[k];
  }
  return NULL;
}

/* Before PETSc, which would print its own help for -help. */
static PetscBool AsksHelp(int argc, char **argv)
{
  for (int k = 1; k < argc; k++) {
    if (strcmp(argv[k], "-help") == 0 || strcmp(argv[k], "--help") == 0 || strcmp(argv[k], "-h") == 0 ||
        (k == 1 && strcmp(argv[k], "help") == 0))
      return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* Output that needs no PETSc: no command, an unknown one, -version. Returns -1 to continue. */
static int AnswerAtOnce(int argc, char **argv)
{
  const Command *command = argc > 1 ? FindCommand(argv[1]) : NULL;

  for (int k = 1; k < argc; k++) {
    if (strcmp(argv[k], "-version") == 0 || strcmp(argv[k], "--version") == 0) {
      printf("hyco %s\n", HycoVersion());
      return 0;
    }
  }
  /* After -version, which is answered with any command. */
  if (command) return -1;
  if (argc > 1) {
    const char *names[8], *near;
    PetscInt n = 0;

    for (; commands[n].name; n++) names[n] = commands[n].name;
    near = HycoNearest(argv[1], n, names);
    fprintf(
        stderr,
        "hyco: error: there is no command \"%s\"; the commands are check, solve, train, predict, compare, fit, export "
        "and view%s%s%s\n",
        argv[1], near ? "; did you mean " : "", near ? near : "", near ? "?" : "");
  } else
    fprintf(
        stderr,
        "hyco: error: give a command: check, solve, train, predict, compare, fit, export or view (hyco -help explains "
        "them)\n");
  return 1;
}

/* Checks that cost nothing come first; DriverProgressBegin() starts the thread after them, since a refused run
   needs none. */
static PetscErrorCode DriverRun(const Command *command, int argc, char **argv)
{
  PetscFunctionBegin;
  PetscCall(DriverCheckLaunch());
  PetscCall(DriverCheckArguments(command, argc, argv));
  PetscCall(DriverCheckOutputs(command));
  DriverProgressBegin();
  PetscCall(command->run());
  /* A check of a scene makes no solver. */
  PetscCall(command->run == CommandCheck ? DriverCheckLeftEarly() : DriverCheckLeft());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* In place of PetscErrorPrintf while PETSc starts: DriverStart() prints one line instead of a trace. */
static PetscErrorCode PrintNothing(const char format[], ...)
{
  (void)format;
  return 0;
}

/* PETSc reads the option files and the options; an error is printed as one line instead of PETSc's trace. Output to a
   closed pipe ("hyco ... | head") is no error, and PETSc must not abort at its signal. */
static PetscErrorCode DriverStart(int *argc, char ***argv)
{
  PetscErrorCode (*const printf_of_petsc)(const char[], ...) = PetscErrorPrintf;
  PetscErrorCode ierr;
  HycoErrorText said = NULL;

  if (!DriverHasStack(*argv) || !DriverCheckOptionFiles(*argc, *argv)) return PETSC_ERR_USER;
  /* PETSc prints its trace while it starts, before an error handler can be set. */
  PetscErrorPrintf = PrintNothing;
  ierr = HycoInitialize(argc, argv);
  signal(SIGPIPE, SIG_IGN);
  if (PetscErrorPrintf == PrintNothing) PetscErrorPrintf = printf_of_petsc;
  if (!ierr) return 0;
  stopped = 1;
  (void)!PetscErrorMessage(ierr, NULL, &said);
  fprintf(stderr, "hyco: error: PETSc cannot be initialised%s%s\n", said && said[0] ? ": " : "", said ? said : "");
  return ierr;
}

/* hyco help, hyco COMMAND -help: the declarations of the classes and the commands, for which PETSc is needed. */
static int DriverPrintHelp(char **argv)
{
  const Command *command = argv[1] ? FindCommand(argv[1]) : NULL;
  PetscErrorCode ierr = 0;
  int argc = 1;

  /* Help needs PETSc, but no other rank and no network. */
  DriverStartAlone();
  if (DriverStart(&argc, &argv)) return DRIVER_FAILED;
  if (HycoRank(MPI_COMM_WORLD) == 0) {
    if (!command && argv[1] && argv[2]) command = FindCommand(argv[2]); /* hyco help COMMAND */
    ierr = !command && argv[1] && argv[2] && strcmp(argv[2], "output") == 0 ? DriverHelpOutput() : DriverHelp(command);
  }
  fflush(stdout); /* PETSc gives the signal of a closed pipe back at its end */
  return HycoFinalize() || ierr ? DRIVER_FAILED : DRIVER_DONE;
}

/* Whether it solves full order. Otherwise a restart, where it is needed, would take longer than a prediction. */
static int DriverFactors(const Command *command)
{
  return command->run == CommandSolve || command->run == CommandTrain || command->run == CommandCompare;
}

/* The order matters: help needs no MPI; kernels of BLAS and its threads are chosen before these libraries read the
   environment; messages are kept only once PETSc is there to raise errors. */
int main(int argc, char **argv)
{
  PetscErrorCode ierr;
  PetscBool listed = PETSC_FALSE;
  int status;

  /* A line in one piece: glibc 2.37 and later write to an unbuffered stream in pieces of 128 bytes, which launchers and
     other ranks mix up. */
  setvbuf(stderr, NULL, _IOLBF, BUFSIZ);
  if (AsksHelp(argc, argv)) return DriverPrintHelp(argv);
  status = AnswerAtOnce(argc, argv);
  if (status >= 0) return status;
  if (DriverFactors(FindCommand(argv[1]))) DriverChooseKernels(argv);
  (void)HycoBLASSetThreads(1); /* threads of all ranks together would exceed the cores */
  DriverNoteLaunch();
  DriverStartAlone();
  if (DriverStart(&argc, &argv)) return 1;
  PetscPushErrorHandler(KeepMessage, NULL); /* after PetscInitialize(), where PETSc's memory log (-malloc_dump)
                                               begins */
  signal(SIGXFSZ, SIG_IGN);                 /* a file beyond the size limit is reported as a failed write */
  ierr = DriverRun(FindCommand(argv[1]), argc, argv);
  DriverProgressEnd();
  PetscPopErrorHandler();
  if (ierr) DriverStop();
  fflush(stdout);
  /* Unread options have been checked; as PETSc does if they are asked for. */
  PetscOptionsHasName(NULL, NULL, "-options_left", &listed);
  if (!listed) PetscOptionsSetValue(NULL, "-options_left", "0");
  status = DriverEndStatus(ierr);
  return HycoFinalize() ? DRIVER_FAILED : status;
}
