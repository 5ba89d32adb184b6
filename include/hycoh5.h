/* HDF5: typed arrays and text by name, checked against the expected size; whole-file writes are atomic. */
#ifndef HYCOH5_H
#define HYCOH5_H

#include <hycosys.h>

#if defined(__cplusplus)
extern "C" {
#endif

typedef struct _n_HycoH5 *HycoH5;

/* Creates a file in memory. HycoH5Close(commit) writes it and gives it its name (hycofile.h); HycoH5Close(no commit)
   discards it. */
PetscErrorCode HycoH5Create(const char path[], HycoH5 *file);
/* Creates a file of all ranks on a disk that all can access; each rank writes its rows (HycoH5WriteRows). The functions
   below that are not collective are called on rank 0. On one rank this is HycoH5Create(). Collective; HycoH5Close() is
   then collective too. */
PetscErrorCode HycoH5CreateShared(MPI_Comm comm, const char path[], HycoH5 *file);
/* The same for a table, whose datasets are its columns and nothing else. */
PetscErrorCode HycoH5CreateTable(MPI_Comm comm, const char path[], HycoH5 *file);
/* Creates an image in memory without a file. HycoH5GetImage() returns its bytes (the caller frees them by PetscFree());
   HycoH5OpenImage() opens such bytes, which must outlive it. `name` is used in messages. */
PetscErrorCode HycoH5CreateImage(const char name[], HycoH5 *file);
PetscErrorCode HycoH5GetImage(HycoH5 file, void **image, size_t *size);
PetscErrorCode HycoH5OpenImage(const char name[], void *image, size_t size, HycoH5 *file);
/* Opens a file for reading. Fails if its seal does not match or is missing. */
PetscErrorCode HycoH5Open(const char path[], HycoH5 *file);
/* The same; if the file is damaged, the message ends with the remedy. */
PetscErrorCode HycoH5OpenOr(const char path[], const char remedy[], HycoH5 *file);
/* Whether there is a model or a snapshot at `path`, which must not be overwritten by anything else. */
PetscErrorCode HycoH5IsPrecious(const char path[], PetscBool *precious);
PetscErrorCode HycoH5Close(HycoH5 *file, PetscBool commit);

#define HYCO_H5_LINE (-1)
/* Writes rows x cols numbers (cols 1: a vector; HYCO_H5_LINE: a dataset of one dimension). Groups in the name
   ("mesh/cells") are created as needed. */
PetscErrorCode HycoH5WriteReal(HycoH5 file, const char name[], PetscInt rows, PetscInt cols, const PetscReal *data);
PetscErrorCode HycoH5WriteInt(HycoH5 file, const char name[], PetscInt rows, PetscInt cols, const PetscInt *data);
/* The same in single precision; reals are read from it as from the others. */
PetscErrorCode HycoH5WriteSingle(HycoH5 file, const char name[], PetscInt rows, PetscInt cols, const float *data);
/* Writes this rank's rows first .. first + n - 1 of a dataset of rows x cols numbers (or HYCO_H5_LINE), of type
   MPIU_REAL, MPIU_INT or MPI_UNSIGNED_CHAR. The dataset is created when its first rows are written. Collective, unless
   the file belongs to one process. */
PetscErrorCode HycoH5WriteRows(HycoH5 file, const char name[], MPI_Datatype type, PetscInt rows, PetscInt cols,
                               PetscInt first, PetscInt n, const void *data);
PetscErrorCode HycoH5WriteText(HycoH5 file, const char name[], const char text[]);
/* Adds an attribute, a text or n integers, to an existing dataset or group; an existing attribute of that name is not
   changed. */
PetscErrorCode HycoH5WriteAttribute(HycoH5 file, const char at[], const char name[], const char text[]);
PetscErrorCode HycoH5WriteAttributeInt(HycoH5 file, const char at[], const char name[], PetscInt n,
                                       const PetscInt value[]);

/* Whether the file has a dataset of that name. */
PetscBool HycoH5Has(HycoH5 file, const char name[]);
/* The bytes of numbers and text that this process has written to the file so far, without HDF5's own. */
PetscReal HycoH5Written(HycoH5 file);
/* Size of a dataset. */
PetscErrorCode HycoH5GetSize(HycoH5 file, const char name[], PetscInt *rows, PetscInt *cols);
/* Reads a dataset whose size must be rows x cols, into the caller's memory; its values must be finite. */
PetscErrorCode HycoH5ReadReal(HycoH5 file, const char name[], PetscInt rows, PetscInt cols, PetscReal *data);
/* Reads a dataset into new memory; a size given as -1 is taken from the file. Integers must lie in [lo, hi]. */
PetscErrorCode HycoH5LoadReal(HycoH5 file, const char name[], PetscInt *rows, PetscInt *cols, PetscReal **data);
PetscErrorCode HycoH5LoadInt(HycoH5 file, const char name[], PetscInt lo, PetscInt hi, PetscInt *rows, PetscInt *cols,
                             PetscInt **data);
/* Whether the file is open for reading; otherwise it is being written. */
PetscBool HycoH5Reads(HycoH5 file);
/* Writes the array to a file that is being written, or loads it into new memory from a file that is read. In the second
   case a number of rows < 0 is taken from the file, and integers must lie in [lo, hi]. */
PetscErrorCode HycoH5Real(HycoH5 file, const char name[], PetscInt *rows, PetscInt cols, PetscReal **data);
PetscErrorCode HycoH5Int(HycoH5 file, const char name[], PetscInt lo, PetscInt hi, PetscInt *rows, PetscInt cols,
                         PetscInt **data);
/* The same for existing arrays of n numbers. */
PetscErrorCode HycoH5Reals(HycoH5 file, const char name[], PetscInt n, PetscReal data[]);
PetscErrorCode HycoH5Ints(HycoH5 file, const char name[], PetscInt lo, PetscInt hi, PetscInt n, PetscInt data[]);
/* The same for the offsets of n parts: n + 1 integers, ascending from 0. */
PetscErrorCode HycoH5Starts(HycoH5 file, const char name[], PetscInt n, PetscInt **start);
/* Rows [start, start + n) of a two-dimensional dataset. */
PetscErrorCode HycoH5ReadRows(HycoH5 file, const char name[], PetscInt start, PetscInt n, PetscInt cols,
                              PetscReal *data);
PetscErrorCode HycoH5LoadText(HycoH5 file, const char name[], char **text);

#if defined(__cplusplus)
}
#endif
#endif
