/*
  Tolerances that several files share. Here and elsewhere the comment of a #define whose value has a fraction says "of
  QUANTITY: REASON" of a tolerance, which is relative to that quantity, and "WHAT: REASON" of another number; eps is the
  round-off of a double, 2.2e-16. scripts/tolerances makes docs/decisions/tolerances.md of these comments.
*/
#ifndef HYCOTOLERANCE_H
#define HYCOTOLERANCE_H

/* -- terms and geometry -- */

/* Of the sum of the absolute terms of a difference: 16 eps, the rounding of sixteen of its terms. */
#define HYCO_NOTHING (16 * PETSC_MACHINE_EPSILON)
/* Of the mesh's length, or the size of its coordinates: 4500 eps, a gap, which is the difference of sums of weighted
   coordinates. */
#define HYCO_LENGTH_ROUND_OFF 1e-12

/* -- forces, gaps and their balance -- */

/* Of forces, or of gaps, their residuals: the default of -hyco_solver_rtol, and that of what is not solved by a
   HycoSolver. */
#define HYCO_RESIDUAL 1e-8
/* Of the largest contact force: 4.5e5 eps, the solve with a factor of a flexibility whose condition is 1e5. */
#define HYCO_FORCE_ROUND_OFF 1e-10
/* Of the largest force, or of the largest gap: ten times the tolerance of the residuals, 1e-8; a contact with less may
   open or close by a small change. */
#define HYCO_UNDECIDED 1e-7
/* Of the largest rate of the forces, or of the gaps: as HYCO_UNDECIDED of forces and gaps. */
#define HYCO_RATE_ROUND_OFF 1e-7
/* Of the friction mu r_n, by which a tangential force may miss the border of its cone: 100 times the tolerance of the
   residuals, 1e-8; nearer to it the contact slips, or may slip. */
#define HYCO_CONE_BORDER 1e-6
/* Of the largest gap without forces, a penetration: 450 eps, a row of B times the displacements; with less no contact
   joins a problem. */
#define HYCO_NO_PENETRATION 1e-13
/* Of the gaps without forces, the most that is taken for round-off of the displacements: a body on a soft spring moves
   far and is pushed back as far; more is an error (tests/models/bodies.py). */
#define HYCO_GAP_ROUND_OFF 1e-6
/* Of the largest gap or force, that by which iterative solves must violate a condition before the set changes: a tenth
   of the tolerance of the residuals, 1e-8. */
#define HYCO_SET_NOISE 1e-9
/* Of the loads, what no forces balance: a tenth of the tolerance of the residuals, 1e-8; less is balance. */
#define HYCO_BALANCED 1e-9
/* Of the sum of the loads and forces, times the reach of a motion, their work on it: 4500 eps, a sum of thousands of
   terms. */
#define HYCO_LOADS_ROUND_OFF 1e-12
/* Of the sum of its absolute terms, the work of the loads on a motion: 450 eps, a sum of thousands of terms whose
   roundings differ in sign. */
#define HYCO_WORK_ROUND_OFF 1e-13

/* -- dense matrices -- */

/* Of the diagonal entry, or of the scaled diagonal's 1, a pivot: 4500 eps, a hundred times the round-off of a
   flexibility, about 1e-14. */
#define HYCO_DEPENDENT 1e-12
/* Of the largest singular value, one that counts as 0: 4.5e5 eps, rows of contacts that follow from each other by
   normals and weights. */
#define HYCO_RANK 1e-10
/* Of the square of a motion, what contacts resist of it: its length to 1e-7, the angle between normals that are equal
   but for the coordinates of a mesh file. */
#define HYCO_FREE_MOTION 1e-14

/* -- methods -- */

/* Of the forces of a step, Newton's method where a path is compared with another, a perturbed one or a program's: 4500
   eps, the least that it reaches on thousands of unknowns. */
#define HYCO_TIGHT_NEWTON 1e-12
/* Residual over that before, of an iteration with the factor of another matrix, above which the factor is made again:
   iterations that contract by five cost less than a factor, 28 to 38 % of a path of the rod (scripts/friction-rod). */
#define HYCO_LAGGED_CONTRACTION 0.2
/* Of the largest slope of a value, that by which the slopes to its two sides differ: over steps of 3e-5 of the range
   curvature makes less than 1e-3 of it, a contact that opens more (tests/fom/gradients.py). */
#define HYCO_KINK 1e-3
/* Of the displacements, the error from which a model is none: half, as the prediction 0 has the error 1. */
#define HYCO_USELESS_ERROR 0.5

#endif
