/* Progress on the terminal. */
#include "driver.h"
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static PetscBool quiet = PETSC_FALSE;

PetscBool DriverIsQuiet(void)
{
  return quiet;
}

/* Called by every command with a report; -progress belongs to the same lines. */
PetscErrorCode DriverReadQuiet(void)
{
  PetscReal seconds = 60;

  PetscFunctionBegin;
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "hyco", NULL);
  PetscCall(HycoOptionsFlag("-quiet", "print errors only; results are in -report and -table", &quiet));
  PetscCall(HycoOptionsReal("-progress", "<seconds> interval between progress lines in a file", 0.01, PETSC_MAX_REAL,
                            &seconds, NULL));
  PetscOptionsEnd();
  DriverProgressSetPeriod(seconds);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Messages of an interrupted training, prepared in advance, because a signal handler can do little more than write. */
static char kept_in[PETSC_MAX_PATH_LEN], last_words[2][PETSC_MAX_PATH_LEN + 256];
static const char *volatile words;
static volatile sig_atomic_t speaks;

/* Two buffers in turn: a signal may arrive while one is written. */
static void SetLastWords(const char what[])
{
  static int next;

  next = !next;
  snprintf(last_words[next], sizeof(last_words[next]),
           "\nhyco: interrupted; %s solutions are stored in %s: the same command continues from there\n", what,
           kept_in);
  words = last_words[next];
}

/* Async-signal-safe: only write() and _exit(). The solutions are on disk already. */
static void ProgressInterrupted(int number)
{
  if (speaks && words) (void)!write(STDERR_FILENO, words, strlen(words));
  _exit(128 + number);
}

/* Rank 0 speaks for all; every rank ends. */
PetscErrorCode DriverCatchInterrupt(const char folder[])
{
  PetscFunctionBegin;
  speaks = HycoRank(PETSC_COMM_WORLD) == 0;
  PetscCall(PetscStrncpy(kept_in, folder, sizeof(kept_in)));
  SetLastWords("the");
  signal(SIGINT, ProgressInterrupted);
  signal(SIGTERM, ProgressInterrupted);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Holds the progress line first, which would otherwise be in the middle of the text. */
PetscErrorCode DriverPrint(const char format[], ...)
{
  va_list args;

  PetscFunctionBegin;
  if (HycoRank(PETSC_COMM_WORLD) == 0 && !quiet) {
    DriverProgressHold();
    va_start(args, format);
    vfprintf(stdout, format, args);
    va_end(args);
    /* Output to a file is buffered in blocks: a run of hours would show nothing. */
    fflush(stdout);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whole per cent where digits would only pretend accuracy, otherwise two digits. */
void DriverPercent(PetscReal share, char text[32])
{
  const double percent = 100 * (double)share;

  snprintf(text, 32, percent >= 99.5 && percent < 1e6 ? "%.0f %%" : "%.2g %%", percent);
}

#define TERMINAL 79 /* columns: a longer line could not be overwritten */

/* A bar, or a line a minute (-progress); n = 0: the number is not known. The last line only if there was another,
   unless `ends`. */
static void ProgressShow(const char word[], PetscInt done, PetscInt n, PetscBool ends)
{
  static PetscReal begin = -1, last = -1;
  static PetscInt first = 0;
  static PetscBool shown;
  static char before[DRIVER_LINE];
  const PetscReal now = HycoNow();
  const int terminal = isatty(STDERR_FILENO);
  char share[64] = "", left[64] = "";

  if (last < 0) last = now;
  /* Another step: the time left is estimated from its own begin. */
  if (begin < 0 || done < first || strcmp(word, before)) {
    begin = now;
    first = done;
    shown = PETSC_FALSE;
    snprintf(before, sizeof(before), "%s", word);
  }
  if (n) snprintf(share, sizeof(share), " of %d", (int)n);
  if (n && (done > first || done == n))
    snprintf(left, sizeof(left), ", %.0f s left",
             done > first ? (double)(now - begin) / (done - first) * (n - done) : 0.);
  if (!quiet && (done == n ? ends || shown : now - last > (terminal ? 0.2 : DriverProgressPeriod()))) {
    last = now;
    shown = PETSC_TRUE;
    DriverProgressHold();
    fprintf(stderr, "%s%.*s %d%s%s%s", terminal ? "\r\033[K" : "",
            terminal ? TERMINAL - 16 - (int)(strlen(share) + strlen(left)) : DRIVER_LINE, word, (int)done, share, left,
            terminal && done != n ? "" : "\n");
    fflush(stderr);
  }
  if (done == n) begin = -1;
}

/* A HycoProgress of solutions: it also renews the last words, which count those of former calls for other points
   too. */
PetscErrorCode DriverProgress(PetscInt done, PetscInt n, void *ctx)
{
  static PetscInt before, last;
  char stored[64];

  PetscFunctionBegin;
  if (done < last) before += last;
  last = done;
  snprintf(stored, sizeof(stored), "%d", (int)(before + done));
  if (kept_in[0]) SetLastWords(stored);
  ProgressShow((const char *)ctx, done, n, PETSC_TRUE);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The monitor that a training calls, with how many of n pieces of a phase are done. */
PetscErrorCode DriverPhase(const char phase[], PetscInt done, PetscInt n, void *ctx)
{
  char word[DRIVER_LINE];

  PetscFunctionBegin;
  (void)ctx;
  snprintf(word, sizeof(word), "%s:", phase);
  ProgressShow(word, done, n, PETSC_FALSE);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For a loop of the command itself, on rank 0. */
PetscErrorCode DriverSetPhase(PetscInt done, PetscInt n)
{
  PetscFunctionBegin;
  if (HycoRank(PETSC_COMM_WORLD) == 0) PetscCall(DriverPhase("points", done, n, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DriverReadMonitor(PetscBool *monitor)
{
  PetscFunctionBegin;
  *monitor = PETSC_FALSE;
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "hyco", NULL);
  PetscCall(HycoOptionsFlag("-hyco_monitor", "print a line per iteration of the active set", monitor));
  PetscOptionsEnd();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One line per iteration of each contact problem; of a path there are as many problems as iterations of Newton's
   method. */
PetscErrorCode DriverMonitor(PetscInt iteration, PetscInt n_active, PetscInt changes, void *ctx)
{
  PetscFunctionBegin;
  (void)ctx;
  PetscCall(DriverPrint("  active set, iteration %d: %d active, %d to change\n", (int)iteration, (int)n_active,
                        (int)changes));
  PetscFunctionReturn(PETSC_SUCCESS);
}
