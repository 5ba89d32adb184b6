/* The environment: clocks, a locale with a decimal point, memory of the machine, kernels, threads and memory of
   BLAS. */
#define _GNU_SOURCE /* MAP_ANONYMOUS, RTLD_DEFAULT */
#include <hycobindings.h>
#include <hycoimpl.h>
#include <dlfcn.h>
#include <locale.h>
#include <petscblaslapack.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

/* OpenBLAS allocates this much address space at its first call, and tries without end if it cannot. */
#define BLAS_BUFFER (((size_t)136) << 20)

/* For this thread alone, and cheaply: setlocale() would change the whole program. NULL: nothing is to be restored. */
void *HycoPointBegin(void)
{
  static locale_t plain;

  if (!plain) plain = newlocale(LC_NUMERIC_MASK, "C", (locale_t)0);
  return plain ? (void *)uselocale(plain) : NULL;
}

void HycoPointEnd(void *before)
{
  if (before) (void)uselocale((locale_t)before);
}

/* strtod() stops at a point if the locale has a decimal comma: 0.5 would be read as 0. */
double HycoNumber(const char text[], char **end)
{
  void *before = HycoPointBegin();
  const double number = strtod(text, end);

  HycoPointEnd(before);
  return number;
}

/* In bytes; 0: not known. */
PetscReal HycoMachineMemory(void)
{
  const long pages = sysconf(_SC_PHYS_PAGES), size = sysconf(_SC_PAGESIZE);

  return pages > 0 && size > 0 ? (PetscReal)pages * (PetscReal)size : 0;
}

/* The newest OpenBLAS kernels that this processor supports; NULL: none newer than Prescott's. */
static const char *KernelsOfProcessor(void)
{
#if defined(__x86_64__)
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw") &&
      __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512cd"))
    return "SkylakeX";
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return "Haswell";
#endif
  return NULL;
}

/* OpenBLAS takes its oldest kernels on processors that it does not know. The variable stays for a new start where the
   kernels in use do not change. */
PetscBool HycoBLASChooseKernels(void)
{
  static const char choice[] = "OPENBLAS_CORETYPE";
  union {
    void *address;
    const char *(*name)(void);
    void (*act)(void);
  } call, forget, choose;
  const char *kernels = KernelsOfProcessor();

  call.address = dlsym(RTLD_DEFAULT, "openblas_get_corename");
  /* Only if OpenBLAS has fallen back to its oldest kernels, and the user has chosen none. */
  if (!kernels || !call.address || getenv(choice) || strcmp(call.name(), "Prescott") || setenv(choice, kernels, 1))
    return PETSC_TRUE;
  forget.address = dlsym(RTLD_DEFAULT, "gotoblas_dynamic_quit");
  choose.address = dlsym(RTLD_DEFAULT, "gotoblas_dynamic_init");
  if (!forget.address || !choose.address) return PETSC_FALSE;
  /* what the library does when it is loaded */
  forget.act();
  choose.act();
  return (PetscBool)(strcmp(call.name(), kernels) == 0);
}

/* By dlsym(), as any BLAS may be linked. */
int HycoBLASSetThreads(int n)
{
  static const char *const asked[] = {"OPENBLAS_NUM_THREADS", "GOTO_NUM_THREADS", "MKL_NUM_THREADS",
                                      "BLIS_NUM_THREADS",     "OMP_NUM_THREADS",  NULL};
  static const char *const names[][2] = {{"openblas_set_num_threads", "openblas_get_num_threads"},
                                         {"MKL_Set_Num_Threads", "MKL_Get_Max_Threads"}};
  union {
    void *address;
    void (*set)(int);
    int (*get)(void);
  } set, get;

  for (int k = 0; asked[k]; k++) {
    /* Any of these is the user's choice, whichever library is linked. */
    if (getenv(asked[k])) return 0;
  }
  for (int k = 0; k < 2 && n > 0; k++) {
    set.address = dlsym(RTLD_DEFAULT, names[k][0]);
    get.address = dlsym(RTLD_DEFAULT, names[k][1]);
    if (set.address && get.address) {
      const int before = get.get();

      if (before != n) set.set(n);
      return before;
    }
  }
  return 0;
}

/* The factorisation makes BLAS allocate its buffers now, where a lack of memory can be reported. OpenBLAS ends the
   program without a message if it cannot have its buffers. */
PetscErrorCode HycoReserveBLAS(void)
{
  static PetscBool done;
  PetscScalar a[4] = {2, 1, 1, 2};
  PetscBLASInt two = 2, pivot[2], info;
  void *probe;

  PetscFunctionBegin;
  if (done) PetscFunctionReturn(PETSC_SUCCESS);
  /* Not malloc(), which fills the memory if MALLOC_PERTURB_ is set: 0.1 s. */
  probe = mmap(NULL, BLAS_BUFFER, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  HycoCheck(probe != MAP_FAILED, "not enough memory: BLAS needs %d MB of address space; raise the limit (ulimit -v)",
            (int)(BLAS_BUFFER >> 20));
  (void)munmap(probe, BLAS_BUFFER);
  LAPACKgetrf_(&two, &two, a, &two, pivot, &info);
  done = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of all threads of the process. */
PetscReal HycoCPU(void)
{
  struct timespec now;

  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return (PetscReal)now.tv_sec + 1e-9 * (PetscReal)now.tv_nsec;
}

/* Seconds of a clock that nobody sets, hence for differences alone. */
PetscReal HycoNow(void)
{
  struct timespec now;

  clock_gettime(CLOCK_MONOTONIC, &now);
  return (PetscReal)now.tv_sec + 1e-9 * (PetscReal)now.tv_nsec;
}
