/* The primal form, inside. */
#ifndef GAP_H
#define GAP_H

#include <hycosolverimpl.h>

/* More contacts than this share of the unknowns are an obstacle under a whole body. */
#define HYCO_MANY_SHARE 0.25

/* What the form keeps. */
typedef struct {
  Mat T, Kg, Kw, H; /* H: the copy that TAO's types scale */
  KSP ksp;
  PetscInt *pivot, *contact, n, m; /* this rank's contacts' pivot unknowns, the contacts' numbers on it; of all ranks */
  HycoOperatorState transformed, seen; /* of which T is; about which `possible` was found */
  PetscBool possible;                  /* each contact row has an unknown that no other row has */
  PetscBool *active;                   /* of this rank's n */
  PetscBool started;                   /* active holds a solution's set */
  HycoTao tao;
} Gap;

/*
  Gap coordinates. HycoGapSetUp() makes T, Kg, Kw, the pivots and the solver unless K and B are as they were;
  HycoGapWork() prepares Kw, a copy of Kg that keeps its pattern; HycoSolveOnSet() solves Kg y = f with y = d at this
  rank's n rows a[], through Kw, its solver and rhs. Collective.
*/
PetscErrorCode HycoGapSetUp(HycoSolver s, Gap *g);
PetscErrorCode HycoGapWork(Mat Kw);
PetscErrorCode HycoSolveOnSet(Mat Kg, Mat Kw, KSP ksp, Vec f, PetscInt n, const PetscInt a[], const PetscReal d[],
                              Vec rhs, Vec y, PetscBool *singular);
/* For each of this rank's contact rows the unknown with its largest entry that no other row has (global number);
   HYCO_NO_PIVOT: none; HYCO_IDLE: the row is empty, of a contact between fixed unknowns. *all: no rank has a row of the
   former. Collective. */
enum { HYCO_NO_PIVOT = -1, HYCO_IDLE = -2 };
PetscErrorCode HycoGapPivots(HycoSystem system, PetscInt pivot[], PetscBool *all);
/* Whether gap coordinates exist: each contact row has an unknown that no other row has. Collective. */
PetscErrorCode HycoGapPossible(HycoSystem system, PetscBool *possible);
/*
  Where the active set of min 1/2 y^T K y - f^T y, y <= bound (PETSC_INFINITY: none) starts: set is 1 at its bound, else
  0; *made says whether K has what the coarser problems need, else set is not touched. Collective.
*/
PetscErrorCode HycoMultilevelStart(Mat K, Vec f, Vec bound, Vec set, PetscBool *made);
/* Whether a held unknown pulls at its bound, or a free one is past it, beyond round-off. `largest` is the largest
   force, `size` the largest gap or displacement, `diagonal` the unknown's own stiffness. */
static inline PetscBool HycoPulls(PetscReal force, PetscReal largest, PetscReal diagonal, PetscReal bound)
{
  return (PetscBool)(force < -1e-12 * largest - 16 * PETSC_MACHINE_EPSILON * diagonal * PetscAbsReal(bound));
}
static inline PetscBool HycoPenetrates(PetscReal value, PetscReal bound, PetscReal size)
{
  return (PetscBool)(value > bound + 1e-14 * size);
}

#endif
