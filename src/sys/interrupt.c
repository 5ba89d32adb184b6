/* Ctrl-C in a program whose language has a handler of its own, which must not run inside a call: the library asks it
   between solves. */
#include <hycobindings.h>
#include <hycoimpl.h>
#include <signal.h>

static volatile sig_atomic_t came;
static PetscBool ends;     /* the owner wants to end */
static int depth;          /* pairs of Begin and End */
static int (*asked)(void); /* of the outermost pair */
static struct sigaction before;

static void InterruptAdd(int number)
{
  (void)number;
  came = 1;
}

/* SA_RESTART: reads, writes and waits of MPI and HDF5 go on. */
void HycoInterruptBegin(int (*ask)(void))
{
  struct sigaction mine = {.sa_handler = InterruptAdd, .sa_flags = SA_RESTART};

  if (depth++) return;
  came = 0;
  ends = PETSC_FALSE;
  asked = ask;
  sigemptyset(&mine.sa_mask);
  sigaction(SIGINT, &mine, &before);
}

PetscBool HycoInterruptEnd(void)
{
  if (--depth) return PETSC_FALSE;
  sigaction(SIGINT, &before, NULL);
  return (PetscBool)(came && !ends);
}

/* An end stays one: a search that takes the first failure for a bad attempt fails at the next. */
PetscErrorCode HycoInterruptCheck(void)
{
  PetscFunctionBegin;
  if (depth && came && !ends) {
    came = 0;
    ends = (PetscBool)((*asked)() != 0);
  }
  if (depth && ends) SETERRQ(PETSC_COMM_SELF, HYCO_ERR_INTERRUPTED, "interrupted");
  PetscFunctionReturn(PETSC_SUCCESS);
}
