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
} beat = {.lock = PTHREAD_MUTEX_INITIALIZER, .ends = PTHREAD_COND_INITIALIZER, .period = 60};

static double Now(void)
{
  struct timespec now;

  clock_gettime(CLOCK_REALTIME, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Called with the lock held. */
static void Clear(void)
{
  if (beat.bar) fprintf(stderr, "\r\033[K");
  beat.bar = PETSC_FALSE;
}

static void Tell(double now)
{
  const char *doing = HycoLogDoing();
  const int terminal = isatty(STDERR_FILENO);

  if (!doing || DriverIsQuiet() || now - beat.last < (terminal ? 2 : beat.period)) return;
  fprintf(stderr, "%safter %.0f s: %s%s", terminal ? "\r\033[K" : "", now - beat.begin, doing, terminal ? "" : "\n");
  fflush(stderr);
  beat.bar = (PetscBool)terminal;
  if (!terminal) beat.last = now;
}

static void *Beat(void *unused)
{
  pthread_mutex_lock(&beat.lock);
  while (!beat.over) {
    const double next = Now() + PetscMin(1, beat.period / 2);
    const struct timespec until = {(time_t)next, (long)(1e9 * (next - (double)(time_t)next))};

    (void)pthread_cond_timedwait(&beat.ends, &beat.lock, &until);
    if (!beat.over) Tell(Now());
  }
  pthread_mutex_unlock(&beat.lock);
  return unused;
}

void DriverBeatBegin(void)
{
  PetscMPIInt rank;

  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  if (rank) return;
  beat.begin = beat.last = Now();
  beat.runs = (PetscBool)(pthread_create(&beat.thread, NULL, Beat, NULL) == 0); /* otherwise there is no such
                                                                                   progress */
}

void DriverBeatSetPeriod(PetscReal seconds)
{
  pthread_mutex_lock(&beat.lock);
  beat.period = (double)seconds;
  pthread_mutex_unlock(&beat.lock);
}

PetscReal DriverBeatPeriod(void)
{
  return (PetscReal)beat.period;
}

void DriverBeatHold(void)
{
  pthread_mutex_lock(&beat.lock);
  Clear();
  beat.last = Now();
  pthread_mutex_unlock(&beat.lock);
}

void DriverBeatEnd(void)
{
  if (!beat.runs) return;
  pthread_mutex_lock(&beat.lock);
  beat.over = PETSC_TRUE;
  Clear();
  pthread_cond_signal(&beat.ends);
  pthread_mutex_unlock(&beat.lock);
  pthread_join(beat.thread, NULL);
  beat.runs = PETSC_FALSE;
}
