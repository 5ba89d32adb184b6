/* HDF5: typed arrays and text by name, checked against the expected size; whole-file writes are atomic. */
#ifndef HYCOH5_H
#define HYCOH5_H

#include <hycosys.h>

#if defined(__cplusplus)
extern "C" {
#endif

typedef struct _n_HycoH5 *HycoH5;

/* Begins a file in memory; HycoH5Close(commit) writes it and gives it its name (hycofile.h), HycoH5Close(no commit)
   forgets it. */
PetscErrorCode HycoH5Create(const char path[], HycoH5 *file);
/* The same of all ranks: a file on a disk that all see, to which each writes its rows (HycoH5WriteRows). The calls
   below that are not collective are rank 0's. One rank: HycoH5Create(). Collective, as HycoH5Close() is then. */
PetscErrorCode HycoH5CreateShared(MPI_Comm comm, const char path[], HycoH5 *file);
/* The same without a file: HycoH5GetImage() gives its bytes (the caller frees them by PetscFree()), HycoH5OpenImage()
   opens such bytes, which must outlive it. `name`: what messages call it. */
PetscErrorCode HycoH5CreateImage(const char name[], HycoH5 *file);
PetscErrorCode HycoH5GetImage(HycoH5 file, void **image, size_t *size);
PetscErrorCode HycoH5OpenImage(const char name[], void *image, size_t size, HycoH5 *file);
/* Opens for reading: refused where a seal does not match, or has been lost. */
PetscErrorCode HycoH5Open(const char path[], HycoH5 *file);
/* The same; where the file is damaged, the complaint ends with the remedy. */
PetscErrorCode HycoH5OpenOr(const char path[], const char remedy[], HycoH5 *file);
/* Whether a model or a snapshot is at `path`: it took hours, and nothing else may take its place. */
PetscErrorCode HycoH5IsPrecious(const char path[], PetscBool *precious);
PetscErrorCode HycoH5Close(HycoH5 *file, PetscBool commit);

#define HYCO_H5_LINE (-1)
/* Writes rows x cols (cols 1: a vector; HYCO_H5_LINE: a set of one dimension). Groups in the name ("mesh/cells") are
   made as needed. */
PetscErrorCode HycoH5WriteReal(HycoH5 file, const char name[], PetscInt rows, PetscInt cols, const PetscReal *data);
PetscErrorCode HycoH5WriteInt(HycoH5 file, const char name[], PetscInt rows, PetscInt cols, const PetscInt *data);
/* Writes rows of a set of rows x cols numbers (or HYCO_H5_LINE), of type MPIU_REAL, MPIU_INT or
   MPI_UNSIGNED_CHAR: this rank's rows first .. first + n - 1. The set is made when its first rows are written.
   Collective, unless the file is one process's. */
PetscErrorCode HycoH5WriteRows(HycoH5 file, const char name[], MPI_Datatype type, PetscInt rows, PetscInt cols,
                               PetscInt first, PetscInt n, const void *data);
PetscErrorCode HycoH5WriteText(HycoH5 file, const char name[], const char text[]);
/* Gives a set or group that is there an attribute: text, or n integers; one of that name stays as it is. */
PetscErrorCode HycoH5WriteAttribute(HycoH5 file, const char at[], const char name[], const char text[]);
PetscErrorCode HycoH5WriteAttributeInt(HycoH5 file, const char at[], const char name[], PetscInt n,
                                       const PetscInt value[]);

/* Whether the file has a dataset of that name. */
PetscBool HycoH5Has(HycoH5 file, const char name[]);
/* Size of a dataset. */
PetscErrorCode HycoH5GetSize(HycoH5 file, const char name[], PetscInt *rows, PetscInt *cols);
/* Reads a dataset whose size must be rows x cols, into the caller's memory; its values must be finite. */
PetscErrorCode HycoH5ReadReal(HycoH5 file, const char name[], PetscInt rows, PetscInt cols, PetscReal *data);
/* The same into new memory; a size given as -1 is taken from the file. Integers must lie in [lo, hi]. */
PetscErrorCode HycoH5LoadReal(HycoH5 file, const char name[], PetscInt *rows, PetscInt *cols, PetscReal **data);
PetscErrorCode HycoH5LoadInt(HycoH5 file, const char name[], PetscInt lo, PetscInt hi, PetscInt *rows, PetscInt *cols,
                             PetscInt **data);
/* Whether the file is read; else it is being made. */
PetscBool HycoH5Reads(HycoH5 file);
/* One line for both ways: writes the array to a file that is being made, loads it into new memory from one that is
   read; then a number of rows < 0 is taken from the file, and integers must lie in [lo, hi]. */
PetscErrorCode HycoH5Real(HycoH5 file, const char name[], PetscInt *rows, PetscInt cols, PetscReal **data);
PetscErrorCode HycoH5Int(HycoH5 file, const char name[], PetscInt lo, PetscInt hi, PetscInt *rows, PetscInt cols,
                         PetscInt **data);
/* The same for arrays of n numbers that are there. */
PetscErrorCode HycoH5Reals(HycoH5 file, const char name[], PetscInt n, PetscReal data[]);
PetscErrorCode HycoH5Ints(HycoH5 file, const char name[], PetscInt lo, PetscInt hi, PetscInt n, PetscInt data[]);
/* And for where each of n parts begins: n + 1 integers, ascending from 0. */
PetscErrorCode HycoH5Starts(HycoH5 file, const char name[], PetscInt n, PetscInt **start);
/* Rows [start, start + n) of a two-dimensional dataset. */
PetscErrorCode HycoH5ReadRows(HycoH5 file, const char name[], PetscInt start, PetscInt n, PetscInt cols,
                              PetscReal *data);
PetscErrorCode HycoH5LoadText(HycoH5 file, const char name[], char **text);

#if defined(__cplusplus)
}
#endif
#endif
