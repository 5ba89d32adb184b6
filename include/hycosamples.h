/* HycoSamples: an ordered set of points in the scene's parameter space. */
#ifndef HYCOSAMPLES_H
#define HYCOSAMPLES_H

#include <hycoscene.h>

#if defined(__cplusplus)
extern "C" {
#endif

typedef struct _p_HycoSamples *HycoSamples;

/* Creates an empty set over the scene's parameters. It holds a reference to the scene. Not collective. The caller owns
   it. */
PetscErrorCode HycoSamplesCreate(HycoScene scene, HycoSamples *samples);
/* Frees; sets the handle to NULL; NULL-safe. */
PetscErrorCode HycoSamplesDestroy(HycoSamples *samples);

/*
  Appends the tensor grid of counts[i] >= 1 points per parameter (length = number of parameters), the last
  parameter running fastest. closed = PETSC_FALSE: the cell centres lo + (k + 1/2) (hi - lo) / counts;
  closed = PETSC_TRUE: both ends included (counts[i] >= 2).
*/
PetscErrorCode HycoSamplesAddGrid(HycoSamples samples, const PetscInt counts[], PetscBool closed);
/* Appends the closed grid, the default of hyco train; of a parameter with counts[i] = 1 the middle of its range. */
PetscErrorCode HycoSamplesAddTrainingGrid(HycoSamples samples, const PetscInt counts[]);
/* Appends the tensor grid of the roots of Chebyshev polynomials over each range, counts[i] >= 1 of them: nodes for
   interpolation by polynomials. */
PetscErrorCode HycoSamplesAddChebyshev(HycoSamples samples, const PetscInt counts[]);
/* Appends `count` >= 1 points spread over the ranges: a quarter of them at corners, with up to three parameters half,
   until there are all; a quarter on faces (one parameter at an end of its range); the rest inside, as Halton's
   sequence, with as many values of each parameter as points, whereas a grid with as many points has few. A larger set
   contains the smaller ones. */
PetscErrorCode HycoSamplesAddScattered(HycoSamples samples, PetscInt count);
/* Appends the tensor product of the lists values[i][0..counts[i]-1], the last parameter running fastest. */
PetscErrorCode HycoSamplesAddProduct(HycoSamples samples, const PetscInt counts[], const PetscReal *const values[]);
/* Appends one point (length = number of parameters); fails outside the range. */
PetscErrorCode HycoSamplesAddPoint(HycoSamples samples, const PetscReal mu[]);
/* Appends the points of another set over the same parameters. */
PetscErrorCode HycoSamplesAddSet(HycoSamples samples, HycoSamples other);
/* Appends the points of a CSV file: a header with the parameters' names in any order, then a point per line.
   Fails for a file without a point. Collective on the scene's communicator. */
PetscErrorCode HycoSamplesAddFile(HycoSamples samples, const char path[]);

/*
  Creates `count` points spread evenly over the region of the set (from the smallest to the largest value of each
  parameter, plus half of the widest step between two values at either end, within the scene's range): half of them
  inside, a quarter at corners of the region, other ones with each call until all were there, and a quarter on its
  faces. None of them is in the set: they are held-out points. They have the numbers first, first + 1, ... of one
  sequence, so that later calls continue it. slow[p] (may be NULL): a new value of this parameter is expensive; if other
  parameters are not, groups of `together` >= 1 successive points share its value. Without parameters that vary there
  are no such points. The caller owns *unseen. Not collective.
*/
PetscErrorCode HycoSamplesOutsideTraining(HycoSamples samples, PetscInt first, PetscInt count, PetscInt together,
                                          const PetscBool slow[], HycoSamples *unseen);
/* The points of `samples` that are not in `seen`, in their order. The caller owns *rest. Not collective. */
PetscErrorCode HycoSamplesExcept(HycoSamples samples, HycoSamples seen, HycoSamples *rest);

/* Removes the points for which drop[n_points] is true; the others keep their order. Not collective. */
PetscErrorCode HycoSamplesDrop(HycoSamples samples, const PetscBool drop[]);
/* Removes duplicate points and keeps the first of each, in the same order. n_dropped: number of removed points (may be
   NULL). Not collective. */
PetscErrorCode HycoSamplesDropTwins(HycoSamples samples, PetscInt *n_dropped);

/* Number of points and their values, point by point (n_points x n_parameters, row major). Borrowed. */
PetscErrorCode HycoSamplesGet(HycoSamples samples, PetscInt *n_points, PetscInt *n_parameters, const PetscReal *mu[]);

/* Describes the object on an ASCII viewer (NULL: stdout). Collective. */
PetscErrorCode HycoSamplesView(HycoSamples object, PetscViewer viewer);
/* Views the object as requested by the option of this name: PetscObjectViewFromOptions(). Collective. */
PetscErrorCode HycoSamplesViewFromOptions(HycoSamples object, PetscObject owner, const char option[]);

#if defined(__cplusplus)
}
#endif
#endif
