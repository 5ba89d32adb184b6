/*
  Files that are written whole or not at all, and the temporary names that this takes.

  A file is written beside its place under the name PATH.hyco-NODE-PID-NUMBER.KIND and renamed: NODE stands for the
  machine and its space of process ids, so that no two processes share a name. What a killed process left is told by its
  name, and removed by the next run that writes there.
*/
#ifndef HYCOFILE_H
#define HYCOFILE_H

#include <hycoimpl.h>

typedef struct _n_HycoFile *HycoFile;

typedef enum {
  HYCO_FILE_TEXT,   /* may go to a device or a pipe */
  HYCO_FILE_NUMBERS /* may not; is forced to the disk before it takes its place */
} HycoFileKind;

/* Room for a temporary name beside a path. */
#define HYCO_FILE_NAME (PETSC_MAX_PATH_LEN + 96)

/* Begins the file at `path`: where that is a link, at its end; text for a character device, a pipe or an open
   descriptor (/dev/stdout) is written directly. Fails for a folder and what else is no file. On this process alone. */
PetscErrorCode HycoFileCreate(const char path[], HycoFileKind kind, HycoFile *file);
/* Whether what is at `path` will be written directly; fails where Create would, for what is there and is no file.
   `option`: that named it, for the message, or "". On this process alone. */
PetscErrorCode HycoFileCheckPlace(const char option[], const char path[], HycoFileKind kind, PetscBool *direct);
FILE *HycoFileStream(HycoFile file);
/* All that was written so far has gone to the disk's file, or fails. */
PetscErrorCode HycoFileFlush(HycoFile file);
/* commit: the file takes its place, or fails with the system's reason and leaves none; else it is removed. Frees. */
PetscErrorCode HycoFileClose(HycoFile *file, PetscBool commit);

/* A name beside `path` (or the file that it is a link to) for what this run alone writes, reads and removes. Not
   created. On rank 0 of comm; the same on every rank. Collective. */
PetscErrorCode HycoFileScratch(MPI_Comm comm, const char path[], const char kind[], char scratch[HYCO_FILE_NAME]);
/* Makes that file, empty, for the one that will be at `path`. On this process alone. */
PetscErrorCode HycoFileOpenScratch(const char scratch[], const char path[], int *fd);
/* Writes bytes at a place of an open file, all of them, or fails as a full disk makes it; the same of an errno that is
   not 0. `path`: what messages name. On this process alone. */
PetscErrorCode HycoFilePut(int fd, const char path[], const void *data, size_t bytes, size_t place);
PetscErrorCode HycoFileComplain(const char path[], int failed);
/* The file `scratch` takes the place of `path`. On this process alone. */
PetscErrorCode HycoFileKeep(const char scratch[], const char path[]);
/* The path that a temporary name belongs to: what a message names. A path that is none is returned as it is. */
void HycoFileOwner(const char name[], char owner[HYCO_FILE_NAME]);
/* Removes what dead processes have left of the file `path`, or, when it ends in '/', of all files in that folder. On
   this process alone. */
PetscErrorCode HycoFileSweep(const char path[]);

/* The end of a chain of links, whether or not it exists. A link of /proc is an open descriptor, and an end. */
void HycoFileFollow(const char path[], char end[PETSC_MAX_PATH_LEN]);

/* Which file a path leads to: of what exists, by device and inode; of what does not, by its folder and name. */
typedef struct {
  unsigned long long device, inode; /* of the file, or of its folder */
  PetscBool exists, open_device;    /* open_device: a character device, for any number of writers */
  char name[PETSC_MAX_PATH_LEN];    /* in the folder, where the file does not exist */
} HycoFileIdentity;

/* Links are followed. A path whose folder does not exist is only itself. On this process alone. */
void HycoFileIdentify(const char path[], HycoFileIdentity *identity);
PetscBool HycoFileSame(const HycoFileIdentity *a, const HycoFileIdentity *b);

#endif
