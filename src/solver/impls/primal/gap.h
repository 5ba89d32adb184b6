/* The primal form: private header. */
#ifndef GAP_H
#define GAP_H

#include <hycosolverimpl.h>

/* Share of contacts among the unknowns, above which there is an obstacle along a whole body: a rope has a contact for
   each, a solid for less than a tenth. */
#define HYCO_MANY_SHARE 0.25

/* Data of the form. */
typedef struct {
  Mat T, Kg, Kw, H; /* H: a copy that TAO's types may scale */
  KSP ksp;
  PetscInt *pivot, *contact, n, m; /* pivot unknowns of this rank's contacts, and the numbers of these contacts; n on
                                      this rank, m on all */
  HycoOperatorState transformed, seen; /* operators from which T was made; from which `possible` was computed */
  PetscBool possible;                  /* each contact row has an unknown that occurs in no other row */
  PetscBool *active;                   /* of this rank's n */
  PetscBool started;                   /* active is the set of a solution */
  HycoTao tao;
} Gap;

/*
  Gap coordinates. HycoGapSetUp() makes T, Kg, Kw, the pivots and the solver unless K and B are unchanged; HycoGapWork()
  prepares Kw, a copy of Kg with the same pattern; HycoSolveOnSet() solves Kg y = f with y = d at this rank's n rows
  a[], through Kw, its solver and rhs. Collective.
*/
PetscErrorCode HycoGapSetUp(HycoSolver s, Gap *g);
PetscErrorCode HycoGapWork(Mat Kw);
PetscErrorCode HycoSolveOnSet(Mat Kg, Mat Kw, KSP ksp, Vec f, PetscInt n, const PetscInt a[], const PetscReal d[],
                              Vec rhs, Vec y, PetscBool *singular);
/* For each of this rank's contact rows the unknown with its largest entry that occurs in no other row (global
   number); HYCO_NO_PIVOT: none; HYCO_IDLE: the row is empty, of a contact between fixed unknowns. *all: no rank has
   a row with HYCO_NO_PIVOT. Collective. */
enum { HYCO_NO_PIVOT = -1, HYCO_IDLE = -2 };
PetscErrorCode HycoGapPivots(HycoSystem system, PetscInt pivot[], PetscBool *all);
/* Whether gap coordinates exist: each contact row has an unknown that occurs in no other row. Collective. */
PetscErrorCode HycoGapPossible(HycoSystem system, PetscBool *possible);
/*
  The initial active set for min 1/2 y^T K y - f^T y, y <= bound (PETSC_INFINITY: none): set is 1 at unknowns at their
  bounds, else 0; *made: K has the properties that the coarser problems need, else set is not changed. Collective.
*/
PetscErrorCode HycoMultilevelStart(Mat K, Vec f, Vec bound, Vec set, PetscBool *made);
/* Whether a contact at its bound is under tension, or a free unknown exceeds its bound, beyond round-off. `largest`
   is the largest force, `size` the largest gap or displacement, `diagonal` the unknown's own stiffness. */
static inline PetscBool HycoPulls(PetscReal force, PetscReal largest, PetscReal diagonal, PetscReal bound)
{
  return (PetscBool)(force < -1e-12 * largest - HYCO_NOTHING * diagonal * PetscAbsReal(bound));
}
static inline PetscBool HycoPenetrates(PetscReal value, PetscReal bound, PetscReal size)
{
  return (PetscBool)(value > bound + 1e-14 * size);
}

#endif
