/* Tables of results whose rows lie on several ranks: CSV, or HDF5 with one dataset of one
   dimension for each column. */
#include "driver.h"
#include <hycofile.h>
#include <hycoh5.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define BLOCK  1024 /* rows that are formatted and sent at a time */
#define NUMBER 64   /* room for a number in CSV */

/* The contents of a table. */
typedef struct {
  PetscInt n_par;
  const char *const *par, *const *names;
  const PetscReal *mu;
  const DriverRows *rows;
} Table;

/* Zero rows: a point that is not reached has converged = 0. */
PetscErrorCode DriverRowsAdd(DriverRows *rows, PetscInt first, PetscInt n, PetscReal **value)
{
  PetscFunctionBegin;
  PetscCall(PetscRealloc((size_t)(rows->n_pieces + 1) * sizeof(*rows->piece), &rows->piece));
  PetscCall(PetscCalloc1((size_t)n * (size_t)rows->width, value));
  rows->piece[rows->n_pieces++] = (DriverPiece){first, n, *value};
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Pieces are allocated as rows come, since a queue gives a rank an unknown number of points. */
PetscErrorCode DriverRowsFree(DriverRows *rows)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < rows->n_pieces; k++) PetscCall(PetscFree(rows->piece[k].value));
  PetscCall(PetscFree(rows->piece));
  rows->n_pieces = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For results that every rank has: rank 0's are written. */
DriverRows DriverRowsOfRoot(PetscInt n, PetscInt width, PetscReal value[], DriverPiece *piece)
{
  *piece = (DriverPiece){0, HycoRank(PETSC_COMM_WORLD) ? 0 : n, value};
  return (DriverRows){.n = n, .width = width, .n_pieces = 1, .piece = piece};
}

/* PETSc's infinity is a large number; in a table it is infinite. */
static double TableInfinite(PetscReal value)
{
  return value > PETSC_MAX_REAL / 8 ? HUGE_VAL : (double)value;
}

/* Parameters with ten digits, because -points may read them back; results with eight. */
static size_t FormatRow(const Table *t, PetscInt k, const PetscReal value[], char *text, size_t room)
{
  const PetscInt width = t->rows->width;
  size_t at = 0;

  for (PetscInt p = 0; p < t->n_par; p++)
    at += (size_t)snprintf(text + at, room - at, "%.10g,", (double)t->mu[k * t->n_par + p]);
  for (PetscInt c = 0; c < width; c++)
    at += (size_t)snprintf(text + at, room - at, "%.8g%c", TableInfinite(value[c]), c < width - 1 ? ',' : '\n');
  return at;
}

/* Writes a piece of the rank `owner` (NULL on the others) on rank 0. Point to point between the owner and rank 0,
   block by block: no rank needs room for another's rows. */
static PetscErrorCode WritePiece(const Table *t, PetscMPIInt owner, const DriverPiece *piece, FILE *stream)
{
  const MPI_Comm comm = PETSC_COMM_WORLD;
  const size_t room = (size_t)BLOCK * (size_t)(t->n_par + t->rows->width) * NUMBER + 1;
  PetscInt n = piece ? piece->n : 0;
  PetscMPIInt rank, length, most;
  char *text;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  /* The others have nothing to do with this piece. */
  if (rank && rank != owner) PetscFunctionReturn(PETSC_SUCCESS);
  if (rank) PetscCallMPI(MPI_Send(&n, 1, MPIU_INT, 0, 0, comm));
  if (!rank && owner) PetscCallMPI(MPI_Recv(&n, 1, MPIU_INT, owner, 0, comm, MPI_STATUS_IGNORE));
  PetscCall(PetscMPIIntCast((PetscInt)room, &most));
  PetscCall(PetscMalloc1(room, &text));
  for (PetscInt begin = 0; begin < n; begin += BLOCK) {
    size_t at = 0;

    for (PetscInt k = begin; piece && k < PetscMin(n, begin + BLOCK); k++)
      at += FormatRow(t, piece->first + k, piece->value + (size_t)k * (size_t)t->rows->width, text + at, room - at);
    PetscCall(PetscMPIIntCast((PetscInt)at, &length));
    if (rank) PetscCallMPI(MPI_Send(text, length, MPI_CHAR, 0, 0, comm));
    if (!rank && owner) {
      MPI_Status status;

      PetscCallMPI(MPI_Recv(text, most, MPI_CHAR, owner, 0, comm, &status));
      PetscCallMPI(MPI_Get_count(&status, MPI_CHAR, &length));
    }
    if (!rank) (void)!fwrite(text, 1, (size_t)length, stream); /* closing the file reports a failure */
  }
  PetscCall(PetscFree(text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void WriteHead(const Table *t, FILE *stream)
{
  for (PetscInt p = 0; p < t->n_par; p++) fprintf(stream, "%s,", t->par[p]);
  for (PetscInt c = 0; c < t->rows->width; c++)
    fprintf(stream, "%s%c", t->names[c], c < t->rows->width - 1 ? ',' : '\n');
}

/* CSV, piece by piece in the order of their rows. Ranks agree on the piece with the smallest first row, by
   MPI_MINLOC: a rank's own pieces ascend. */
static PetscErrorCode WriteText(const char path[], const Table *t)
{
  const DriverRows *rows = t->rows;
  struct {
    long first;
    int rank;
  } mine, next;
  HycoFile out = NULL;
  PetscInt at = 0;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &mine.rank));
  HycoOnRoot(PETSC_COMM_WORLD, HycoFileCreate(path, HYCO_FILE_TEXT, &out));
  if (out) WriteHead(t, HycoFileStream(out));
  for (;;) {
    mine.first = at < rows->n_pieces ? (long)rows->piece[at].first : LONG_MAX;
    PetscCallMPI(MPI_Allreduce(&mine, &next, 1, MPI_LONG_INT, MPI_MINLOC, PETSC_COMM_WORLD));
    if (next.first == LONG_MAX) break;
    PetscCall(
        WritePiece(t, next.rank, next.rank == mine.rank ? &rows->piece[at] : NULL, out ? HycoFileStream(out) : NULL));
    /* Only the rank whose piece was written moves on. */
    at += next.rank == mine.rank;
  }
  HycoOnRoot(PETSC_COMM_WORLD, HycoFileClose(&out, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Parameter `par`, or column `c` if par < 0, as a dataset; each rank writes its rows. Collective writes: as many
   rounds as the rank with the most pieces has, with empty ones for the others. */
static PetscErrorCode WriteColumn(HycoH5 file, const Table *t, PetscInt rounds, PetscInt par, PetscInt c)
{
  const DriverRows *rows = t->rows;

  PetscFunctionBegin;
  for (PetscInt r = 0; r < rounds; r++) {
    const DriverPiece none = {0, 0, NULL}, *p = r < rows->n_pieces ? &rows->piece[r] : &none;
    PetscReal *column;

    PetscCall(PetscMalloc1(p->n, &column));
    for (PetscInt k = 0; k < p->n; k++)
      column[k] = par < 0 ? TableInfinite(p->value[(size_t)k * (size_t)rows->width + (size_t)c])
                          : t->mu[(p->first + k) * t->n_par + par];
    PetscCall(HycoH5WriteRows(file, par < 0 ? t->names[c] : t->par[par], MPIU_REAL, rows->n, HYCO_H5_LINE, p->first,
                              p->n, column));
    PetscCall(PetscFree(column));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A dataset for each column, in rounds of as many rows as a rank keeps in a piece. No rank holds the whole table.
   */
static PetscErrorCode WriteColumns(const char path[], const Table *t)
{
  HycoH5 file;
  PetscInt rounds = t->rows->n_pieces;
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  /* HDF5 writes collectively: a rank that left earlier would block the others. */
  HycoAllreduce(&rounds, 1, MPIU_INT, MPI_MAX, PETSC_COMM_WORLD);
  PetscCall(HycoH5CreateTable(PETSC_COMM_WORLD, path, &file));
  for (PetscInt p = 0; p < t->n_par && !ierr; p++) ierr = WriteColumn(file, t, rounds, p, 0);
  for (PetscInt c = 0; c < t->rows->width && !ierr; c++) ierr = WriteColumn(file, t, rounds, -1, c);
  if (ierr) PetscCall(HycoH5Close(&file, PETSC_FALSE));
  PetscCall(ierr);
  PetscCall(HycoH5Close(&file, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* By the ending of the name. */
PetscErrorCode DriverWriteTable(const char path[], HycoScene scene, const PetscReal mu[], const char *const names[],
                                const DriverRows *rows)
{
  Table t = {.names = names, .mu = mu, .rows = rows};
  const char *dot = strrchr(path, '.');
  const PetscBool h5 = (PetscBool)(dot && strcmp(dot, ".h5") == 0);

  PetscFunctionBegin;
  PetscCall(HycoSceneGetParameters(scene, &t.n_par, &t.par, NULL, NULL));
  PetscCall((h5 ? WriteColumns : WriteText)(path, &t));
  PetscFunctionReturn(PETSC_SUCCESS);
}
