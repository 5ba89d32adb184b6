/* Errors are caught as one line of text and synchronised over all ranks, so that no rank waits for a failed one. */
#include <hycoimpl.h>
#include <stdlib.h>
#include <stdarg.h>
#include <string.h>

/* An environment variable, because errors may come before options are read. */
PetscBool HycoWantsTrace(void)
{
  const char *trace = getenv("HYCO_TRACE");

  return (PetscBool)(trace && trace[0] && strcmp(trace, "0") != 0);
}

static char caught_line[HYCO_LINE];

/* Keeps the first message of an error, where it is raised; the calls that it passes through add none. PETSc's own
   checks have a text as well, which may be all there is. */
static PetscErrorCode CatchHandler(MPI_Comm comm, int line, const char *function, const char *file, PetscErrorCode code,
                                   PetscErrorType type, const char *message, void *ctx)
{
  (void)comm, (void)line, (void)function, (void)file, (void)ctx;
  /* PETSc calls the handler again in each function on the way up. */
  if (type == PETSC_ERROR_INITIAL) {
    if (message && message[0]) {
      snprintf(caught_line, sizeof(caught_line), "%s", message);
    } else {
      snprintf(caught_line, sizeof(caught_line), "PETSc error %d in %s()", (int)code, function ? function : "?");
    }
  }
  return code;
}

/* The number of bytes of the character at `c` if it can be printed, in UTF-8 without control characters; 0: it cannot.
   No full check of UTF-8: enough that nothing moves the cursor. */
static size_t ErrorPrintable(const unsigned char *c)
{
  const size_t n = c[0] < 0x80 ? 1 : c[0] >= 0xc2 && c[0] < 0xe0 ? 2 : (c[0] & 0xf0) == 0xe0 ? 3 : c[0] < 0xf5 ? 4 : 0;

  if (c[0] < ' ' || c[0] == 0x7f || (c[0] >= 0x80 && c[0] < 0xc2)) return 0;
  for (size_t k = 1; k < n; k++) {
    if ((c[k] & 0xc0) != 0x80) return 0;
  }
  return c[0] == 0xc2 && c[1] < 0xa0 ? 0 : n;
}

/* A message may quote a file's bytes: control characters would move a terminal's cursor or break the one line. */
void HycoMakePrintable(char text[])
{
  for (char *c = text; c && *c;) {
    const size_t n = ErrorPrintable((const unsigned char *)c);

    if (!n) *c = strchr(" \t\r\n", *c) ? ' ' : '?';
    c += n ? n : 1;
  }
}

/* With a decimal point in any locale: the calling program may have set another. */
void HycoFormat(char line[HYCO_LINE], const char format[], ...)
{
  void *before = HycoPointBegin();
  va_list args;

  va_start(args, format);
  vsnprintf(line, HYCO_LINE, format, args);
  va_end(args);
  HycoPointEnd(before);
}

/* Cut at the length of a line: the first names are enough for a message. */
PetscErrorCode HycoListAdd(char list[HYCO_LINE], const char between[], const char name[])
{
  PetscFunctionBegin;
  HycoCheckGiven(list);
  HycoCheckGiven(between);
  HycoCheckGiven(name);
  PetscCall(PetscStrlcat(list, list[0] ? between : "", HYCO_LINE));
  PetscCall(PetscStrlcat(list, name, HYCO_LINE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Until HycoCatchEnd(), on every path: handlers form a stack. Catching may be nested, but only the last message is
   kept. */
PetscErrorCode HycoCatchBegin(void)
{
  PetscFunctionBegin;
  caught_line[0] = '\0';
  PetscCall(PetscPushErrorHandler(CatchHandler, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The line of the error that was caught, or an empty one. The caller decides, usually after all ranks have agreed.
   */
PetscErrorCode HycoCatchEnd(PetscErrorCode caught, char message[HYCO_LINE])
{
  PetscFunctionBegin;
  HycoCheckGiven(message);
  PetscCall(PetscPopErrorHandler());
  message[0] = '\0';
  if (caught) snprintf(message, HYCO_LINE, "%s", caught_line[0] ? caught_line : "unknown error");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The message was caught without printing; an error other than "no model" is raised again with it. */
PetscErrorCode HycoCatchNoModel(PetscErrorCode caught, const char message[])
{
  PetscFunctionBegin;
  if (!caught || caught == HYCO_ERR_NO_MODEL) PetscFunctionReturn(PETSC_SUCCESS);
  SETERRQ(PETSC_COMM_SELF, caught, "%s", message);
}

/* Collective, also without an error. The first rank that failed is heard: others often fail as a consequence. message:
   this rank's, empty if it has not failed. */
PetscErrorCode HycoErrorSync(MPI_Comm comm, PetscErrorCode caught, const char message[])
{
  PetscMPIInt size, mine, first;
  /* Broadcast as bytes: the ranks run the same program. */
  struct {
    PetscErrorCode code;
    char line[HYCO_LINE];
  } said;

  PetscFunctionBegin;
  HycoCheckGiven(message);
  PetscCallMPI(MPI_Comm_size(comm, &size));
  mine = message[0] ? HycoRank(comm) : size;
  first = mine;
  if (size > 1) PetscCallMPI(MPI_Allreduce(&mine, &first, 1, MPI_INT, MPI_MIN, comm));
  if (first == size) PetscFunctionReturn(PETSC_SUCCESS);
  if (HycoRank(comm) == first) {
    said.code = caught > PETSC_ERR_MAX_VALUE ? caught : PETSC_ERR_USER;
    snprintf(said.line, sizeof(said.line), "%s", message);
  }
  if (size > 1) PetscCallMPI(MPI_Bcast(&said, sizeof(said), MPI_BYTE, first, comm));
  SETERRQ(comm, said.code, "%s", said.line);
}
