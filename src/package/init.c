/* Start and end of the package, and the error handler of a program started by it: one line per error. */
#include <hycoimpl.h>
#include <slepcsys.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static PetscBool began_petsc = PETSC_FALSE, handles = PETSC_FALSE;

/* The line of an error: hyco's own message, or PETSc's with its location. */
static void ErrorsCompose(char said[HYCO_LINE], int line, const char function[], const char file[], PetscErrorCode code,
                          const char message[])
{
  /* Codes of messages that are written for the user; others need PETSc's location. */
  const PetscBool own = (PetscBool)(code == PETSC_ERR_USER || code == PETSC_ERR_ORDER || code > PETSC_ERR_MAX_VALUE ||
                                    code == PETSC_ERR_ARG_NULL || code == PETSC_ERR_ARG_WRONG);
  char text[HYCO_LINE];

  snprintf(text, sizeof(text), "%s", message ? message : "");
  HycoMakePrintable(text);
  if (own && text[0])
    snprintf(said, HYCO_LINE, "%s", text);
  else
    HycoFormat(said, "%s (PETSc error %d in %s(), %s:%d; HYCO_TRACE=1 shows the calls)", text[0] ? text : "failed",
               (int)code, function ? function : "?", file ? file : "?", line);
}

/* Prints it on rank 0 of the object with the error. */
static void ErrorsPrint(MPI_Comm comm, int line, const char function[], const char file[], PetscErrorCode code,
                        const char message[])
{
  char said[HYCO_LINE];

  if (HycoRank(comm)) return;
  ErrorsCompose(said, line, function, file, code, message);
  fprintf(stderr, "hyco: error: %s\n", said);
  fflush(stderr);
}

/* One text for the process, as PETSc's stack of error handlers is. */
static char kept[HYCO_LINE];
static char kept_kind;

/* Only the first error of a chain has the message: the others are the callers' lines of the trace. */
static PetscErrorCode ErrorsKeepFirst(MPI_Comm comm, int line, const char *function, const char *file,
                                      PetscErrorCode code, PetscErrorType type, const char *text, void *ctx)
{
  (void)comm, (void)ctx;
  if (type != PETSC_ERROR_INITIAL) return code;
  ErrorsCompose(kept, line, function, file, code, text);
  kept_kind = code == HYCO_ERR_VALUE ? 'v' : code == HYCO_ERR_NO_FILE ? 'f' : 0;
  return code;
}

/* For bindings, which raise the text as an exception of their language. Calls with true and false must be paired. */
PetscErrorCode HycoKeepErrors(PetscBool keep)
{
  kept[0] = kept_kind = '\0';
  return keep ? PetscPushErrorHandler(ErrorsKeepFirst, NULL) : PetscPopErrorHandler();
}

const char *HycoKeptError(void)
{
  return kept;
}

char HycoKeptErrorKind(void)
{
  return kept_kind;
}

/* Replaces PETSc's error handler, which prints a call trace. In main() PETSc aborts by MPI; a process that runs
   alone exits without the messages that launchers add to an abort. */
static PetscErrorCode OneLine(MPI_Comm comm, int line, const char *function, const char *file, PetscErrorCode code,
                              PetscErrorType type, const char *text, void *ctx)
{
  (void)ctx;
  if (type == PETSC_ERROR_INITIAL) ErrorsPrint(comm, line, function, file, code, text);
  if (HycoSize(PETSC_COMM_WORLD) == 1 && function && strcmp(function, "main") == 0) {
    fflush(NULL);
    _exit(1);
  }
  return code;
}

/* PETSc or SLEPc may run already, started by the program: then they are used, and not ended by HycoFinalize(). The
   error handler is replaced in programs that leave the start to hyco only. Errors before PETSc runs cannot use its
   macros. */
PetscErrorCode HycoInitialize(int *argc, char ***argv)
{
  PetscBool petsc, slepc;
  PetscErrorCode ierr;

  ierr = PetscInitialized(&petsc);
  if (ierr) return ierr;
  if (!petsc) {
    ierr = PetscInitialize(argc, argv, NULL, NULL);
    if (ierr) return ierr;
    began_petsc = PETSC_TRUE;
    handles = (PetscBool)(!HycoWantsTrace() && PetscPushErrorHandler(OneLine, NULL) == 0);
  }
  ierr = SlepcInitialized(&slepc);
  if (!ierr && !slepc) ierr = SlepcInitialize(argc, argv, NULL, NULL);
  return ierr ? ierr : HycoInitializePackage();
}

/* In the reverse order of the start; the handler is removed while PETSc still exists. */
PetscErrorCode HycoFinalize(void)
{
  PetscErrorCode ierr = SlepcFinalize();

  if (ierr) return ierr;
  if (handles) ierr = PetscPopErrorHandler();
  handles = PETSC_FALSE;
  if (ierr) return ierr;
  return began_petsc ? PetscFinalize() : 0;
}
