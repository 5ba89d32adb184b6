/*
  Files that are written either completely or not at all, and their temporary names.

  A file is written in its folder under the name PATH.hyco-NODE-PID-NUMBER.KIND and then renamed. NODE identifies the
  machine and its space of process ids, so that no two processes share a name. The name shows whether a file was left by
  a killed process; the next run that writes there removes it.
*/
#ifndef HYCOFILE_H
#define HYCOFILE_H

#include <hycoprogram.h>
#include <stdio.h>

#if defined(__cplusplus)
extern "C" {
#endif

typedef struct _n_HycoFile *HycoFile;

typedef enum {
  HYCO_FILE_TEXT,   /* may be written to a device or a pipe */
  HYCO_FILE_NUMBERS /* may not; flushed to the disk before it is renamed */
} HycoFileKind;

/* Room for a temporary name beside a path. */
#define HYCO_FILE_NAME (PETSC_MAX_PATH_LEN + 96)

/* Begins the file at `path`. A link is followed to its end; text for a character device, a pipe or an open
   descriptor (/dev/stdout) is written directly. Fails for a folder and anything else that is not a file. On this
   process alone. */
PetscErrorCode HycoFileCreate(const char path[], HycoFileKind kind, HycoFile *file);
/* Whether `path` will be written directly; fails where HycoFileCreate() would because something at `path` is not a
   file. `option`: the option that gave the path, for the message, or "". On this process alone. */
PetscErrorCode HycoFileCheckPlace(const char option[], const char path[], HycoFileKind kind, PetscBool *direct);
FILE *HycoFileStream(HycoFile file);
/* Flushes what was written so far to the disk, or fails. */
PetscErrorCode HycoFileFlush(HycoFile file);
/* commit: renames the file to its path, or fails with the system's reason and leaves no file; else removes it.
   Frees. */
PetscErrorCode HycoFileClose(HycoFile *file, PetscBool commit);

/* A name beside `path` (or the file that it links to) for a file that only this run writes, reads and removes. Not
   created. On rank 0 of comm; the same on every rank. Collective. */
PetscErrorCode HycoFileScratch(MPI_Comm comm, const char path[], const char kind[], char scratch[HYCO_FILE_NAME]);
/* Creates that file, empty; `path` is the file that it will replace. On this process alone. */
PetscErrorCode HycoFileOpenScratch(const char scratch[], const char path[], int *fd);
/* Writes all bytes at a position of an open file, or fails with the error of a full disk; raises the same error for
   an errno other than 0. `path`: the name in messages. On this process alone. */
PetscErrorCode HycoFilePut(int fd, const char path[], const void *data, size_t bytes, size_t place);
PetscErrorCode HycoFileComplain(const char path[], int failed);
/* Renames `scratch` to `path`. On this process alone. */
PetscErrorCode HycoFileKeep(const char scratch[], const char path[]);
/* The path of a temporary name, for messages. Other names are returned unchanged. */
void HycoFileOwner(const char name[], char owner[HYCO_FILE_NAME]);
/* Removes temporary files of dead processes for the file `path`, or, if it ends in '/', for all files in that
   folder. On this process alone. */
PetscErrorCode HycoFileSweep(const char path[]);

/* The end of a chain of links, whether or not it exists. A link in /proc is an open descriptor, and counts as an
   end. */
void HycoFileFollow(const char path[], char end[PETSC_MAX_PATH_LEN]);

/* Identifies the file at a path: by device and inode if it exists, else by its folder and name. */
typedef struct {
  unsigned long long device, inode; /* of the file, or of its folder */
  PetscBool exists, open_device;    /* open_device: a character device, which any number of programs may write to */
  char name[PETSC_MAX_PATH_LEN];    /* in the folder, where the file does not exist */
} HycoFileIdentity;

/* Links are followed. A path whose folder does not exist is only itself. On this process alone. */
void HycoFileIdentify(const char path[], HycoFileIdentity *identity);
PetscBool HycoFileSame(const HycoFileIdentity *a, const HycoFileIdentity *b);

#if defined(__cplusplus)
}
#endif
#endif
