/* What the text of the library's search takes from elsewhere, in files of exported models alone. */
#include <float.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#define HYCO_EXPORTED
#define HYCO_FACET_NODES 4
#define PETSC_MAX_REAL   DBL_MAX
#define PETSC_MIN_REAL   (-DBL_MAX)
#define PetscMin(a, b)   ((a) < (b) ? (a) : (b))
#define PetscMax(a, b)   ((a) < (b) ? (b) : (a))
#define PetscAbsReal     fabs
#define PETSC_INFINITY   HUGE_VAL
#define PetscSqrtReal    sqrt
#define PetscExpReal     exp
#define PetscLogReal     log
#define PetscPowReal     pow

typedef double PetscReal;
typedef int PetscInt;
typedef enum { PETSC_FALSE, PETSC_TRUE } PetscBool;
typedef void *HycoFE;
