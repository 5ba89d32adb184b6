/* Progress within a long step: its name, as a line a minute in a file, or with the seconds on a terminal. A separate
   thread, because a factorisation or a solver does not report progress. */
#include "driver.h"
#include <pthread.h>
#include <stdio.h>
#include <time.h>
#include <unistd.h>

static struct {
  pthread_t thread;
  pthread_mutex_t lock;
  pthread_cond_t ends;
  PetscBool runs, over, bar; /* bar: the terminal has an unfinished line */
  double begin, last, period;
} progress = {.lock = PTHREAD_MUTEX_INITIALIZER, .ends = PTHREAD_COND_INITIALIZER, .period = 60};

/* The realtime clock, which pthread_cond_timedwait() uses. */
static double ProgressThreadNow(void)
{
  struct timespec now;

  clock_gettime(CLOCK_REALTIME, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Called with the lock held. */
static void ProgressThreadClear(void)
{
  if (progress.bar) fprintf(stderr, "\r\033[K");
  progress.bar = PETSC_FALSE;
}

/* In the thread, with the lock held. HycoLogDoing() is the event of -log_view that the main thread is in. */
static void PrintStep(double now)
{
  const char *doing = HycoLogDoing();
  const int terminal = isatty(STDERR_FILENO);

  if (!doing || DriverIsQuiet() || now - progress.last < (terminal ? 2 : progress.period)) return;
  fprintf(stderr, "%safter %.0f s: %s%s", terminal ? "\r\033[K" : "", now - progress.begin, doing,
          terminal ? "" : "\n");
  fflush(stderr);
  progress.bar = (PetscBool)terminal;
  if (!terminal) progress.last = now;
}

/* Wakes up at most once a second, so that the end does not wait for it longer. */
static void *ProgressThreadRun(void *unused)
{
  pthread_mutex_lock(&progress.lock);
  while (!progress.over) {
    /* Half a period at most, so that a line is late by no more than that. */
    const double next = ProgressThreadNow() + PetscMin(1, progress.period / 2);
    const struct timespec until = {(time_t)next, (long)(1e9 * (next - (double)(time_t)next))};

    (void)pthread_cond_timedwait(&progress.ends, &progress.lock, &until);
    if (!progress.over) PrintStep(ProgressThreadNow());
  }
  pthread_mutex_unlock(&progress.lock);
  return unused;
}

/* A thread, because factorisations and solves in libraries do not return for minutes: a file would get no line,
   and a batch system might take the run for dead. Rank 0 alone prints. */
void DriverProgressBegin(void)
{
  if (HycoRank(PETSC_COMM_WORLD)) return;
  progress.begin = progress.last = ProgressThreadNow();
  progress.runs =
      (PetscBool)(pthread_create(&progress.thread, NULL, ProgressThreadRun, NULL) == 0); /* otherwise there is no such
                                                                                   progress */
}

/* Under the lock: the thread may be reading it. */
void DriverProgressSetPeriod(PetscReal seconds)
{
  pthread_mutex_lock(&progress.lock);
  progress.period = (double)seconds;
  pthread_mutex_unlock(&progress.lock);
}

PetscReal DriverProgressPeriod(void)
{
  return (PetscReal)progress.period;
}

/* Before any other output: removes an unfinished line, and delays the next. */
void DriverProgressHold(void)
{
  pthread_mutex_lock(&progress.lock);
  ProgressThreadClear();
  progress.last = ProgressThreadNow();
  pthread_mutex_unlock(&progress.lock);
}

/* Joined before MPI ends: the thread must not print afterwards. */
void DriverProgressEnd(void)
{
  if (!progress.runs) return;
  pthread_mutex_lock(&progress.lock);
  progress.over = PETSC_TRUE;
  ProgressThreadClear();
  pthread_cond_signal(&progress.ends);
  pthread_mutex_unlock(&progress.lock);
  pthread_join(progress.thread, NULL);
  progress.runs = PETSC_FALSE;
}
