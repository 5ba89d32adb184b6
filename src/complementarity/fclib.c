/*
  A problem with friction as a file of FCLIB (V. Acary et al., "FCLIB: a collection of discrete 3D frictional contact
  problems", Inria technical report 444, 2014), in its layout `fclib_local`:

      u = W r + V l + q,   V^T r + R l + s = 0,   r and u + (mu |u_t|, 0, 0) in dual cones

  u and r are w and the forces of lcp, l its free unknowns; matrices have compressed columns (nz = -1).
*/
#include <hycoh5.h>
#include <hycolcp.h>
#include <string.h>

typedef struct {
  const HycoLCP *lcp;
  const char *path;
  HycoH5 h;
  PetscInt dim, m; /* components of a contact, and of all in the file */
  PetscInt *row;   /* m: the row of z, or -1: a tangent that the contact does not have, without flexibility */
  PetscReal *mu;   /* by contact */
} File;

/* The rows and coefficients of the contacts. Contacts without friction have the coefficient 0. */
static PetscErrorCode ListRows(File *f)
{
  const HycoBlocks *b = f->lcp->blocks;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < b->n; k++) {
    const PetscInt size = b->row[k + 1] - b->row[k];
    HycoConeType type;
    PetscBool coulomb;

    PetscCall(HycoConeGetType(b->cone[b->of[k]], &type));
    coulomb = (PetscBool)(strcmp(type, HYCO_CONE_COULOMB) == 0);
    HycoCheck(coulomb ? b->data[b->at[k] + 1] == 0 : size == 1 && b->cone[b->of[k]]->nonnegative,
              "%s: contact %d has the law %s, and FCLIB's files know Coulomb's law alone", f->path, (int)k, type);
    f->mu[k] = coulomb ? b->data[b->at[k]] : 0;
    for (PetscInt j = 0; j < f->dim; j++) f->row[k * f->dim + j] = j < size ? f->lcp->p + b->row[k] + j : -1;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode WriteInt(const File *f, const char group[], const char name[], PetscInt n, const PetscInt data[])
{
  char path[64];

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(path, sizeof(path), "%s/%s", group, name));
  PetscCall(HycoH5WriteInt(f->h, path, n, HYCO_H5_LINE, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode WriteReal(const File *f, const char group[], const char name[], PetscInt n,
                                const PetscReal data[])
{
  char path[64];

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(path, sizeof(path), "%s/%s", group, name));
  PetscCall(HycoH5WriteReal(f->h, path, n, HYCO_H5_LINE, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The m x n matrix of the entries sign * M(row[i], column[j]), without those that are 0; -1: there is no such row. */
static PetscErrorCode WriteMatrix(const File *f, const char group[], PetscInt m, const PetscInt row[], PetscInt n,
                                  const PetscInt column[], PetscReal sign)
{
  const size_t size = (size_t)(f->lcp->p + f->lcp->n), room = (size_t)m * (size_t)n + 1;
  /* nz = -1 marks compressed columns in CSparse's format, which FCLIB has taken over. */
  const PetscInt columns = -1;
  PetscInt *start, *i, count = 0;
  PetscReal *x;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(n + 1, &start, room, &i, room, &x));
  for (PetscInt j = 0; j < n; j++) {
    start[j] = count;
    for (PetscInt k = 0; k < m && column[j] >= 0; k++) {
      const PetscReal value = row[k] < 0 ? 0 : sign * f->lcp->M[(size_t)column[j] * size + (size_t)row[k]];

      if (value == 0) continue;
      i[count] = k;
      x[count++] = value;
    }
  }
  start[n] = count;
  PetscCall(WriteInt(f, group, "nzmax", 1, &count));
  PetscCall(WriteInt(f, group, "m", 1, &m));
  PetscCall(WriteInt(f, group, "n", 1, &n));
  PetscCall(WriteInt(f, group, "nz", 1, &columns));
  PetscCall(WriteInt(f, group, "p", n + 1, start));
  PetscCall(WriteInt(f, group, "i", count, i));
  PetscCall(WriteReal(f, group, "x", count, x));
  PetscCall(PetscFree3(start, i, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* a of the file's rows, 0 where there is none. */
static PetscErrorCode WriteRows(const File *f, const char group[], const char name[], const PetscReal a[])
{
  PetscReal *value;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(f->m + 1, &value));
  for (PetscInt i = 0; i < f->m; i++) value[i] = f->row[i] < 0 ? 0 : a[f->row[i]];
  PetscCall(WriteReal(f, group, name, f->m, value));
  PetscCall(PetscFree(value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* M = [-R, -V^T; V, W]: the equations of the free unknowns have the opposite sign in lcp. */
static PetscErrorCode WriteProblem(const File *f)
{
  const HycoLCP *lcp = f->lcp;
  PetscInt *free;
  PetscReal *s;

  PetscFunctionBegin;
  PetscCall(WriteInt(f, "fclib_local", "spacedim", 1, &f->dim));
  PetscCall(WriteMatrix(f, "fclib_local/W", f->m, f->row, f->m, f->row, 1));
  PetscCall(WriteRows(f, "fclib_local/vectors", "q", lcp->q));
  PetscCall(WriteReal(f, "fclib_local/vectors", "mu", lcp->blocks->n, f->mu));
  if (!lcp->p) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc2(lcp->p, &free, lcp->p, &s));
  for (PetscInt i = 0; i < lcp->p; i++) {
    free[i] = i;
    /* As the equations: FCLIB's 0 = R l + V^T r + s. */
    s[i] = -lcp->q[i];
  }
  PetscCall(WriteMatrix(f, "fclib_local/V", f->m, f->row, lcp->p, free, 1));
  PetscCall(WriteMatrix(f, "fclib_local/R", lcp->p, free, lcp->p, free, -1));
  PetscCall(WriteReal(f, "fclib_local/vectors", "s", lcp->p, s));
  PetscCall(PetscFree2(free, s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* z = (l, r) and its u. */
static PetscErrorCode WritePoint(const File *f, const char group[], const PetscReal z[])
{
  const HycoLCP *lcp = f->lcp;
  const PetscInt n = lcp->p + lcp->n;
  PetscReal *u;

  PetscFunctionBegin;
  HycoDuplicate(n, lcp->q, &u);
  for (PetscInt j = 0; j < n; j++) {
    /* u = q + W r + V l by columns, of which most are those of open contacts. */
    for (PetscInt i = 0; z[j] != 0 && i < n; i++) u[i] += lcp->M[(size_t)j * (size_t)n + (size_t)i] * z[j];
  }
  if (lcp->p) PetscCall(WriteReal(f, group, "l", lcp->p, z));
  PetscCall(WriteRows(f, group, "u", u));
  PetscCall(WriteRows(f, group, "r", z));
  PetscCall(PetscFree(u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The solution is that of this program, for others to compare with. The guess is where the path came from: without
   it a solver may find another of several solutions. */
static PetscErrorCode WriteAll(const File *f, const PetscReal z[], const PetscReal start[])
{
  const PetscInt one = 1;

  PetscFunctionBegin;
  PetscCall(WriteProblem(f));
  PetscCall(WritePoint(f, "solution", z));
  PetscCall(WriteInt(f, "guesses", "number_of_guesses", 1, &one));
  PetscCall(WritePoint(f, "guesses/1", start));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* fclib_local knows no contact without tangents: those without friction get tangents with W = 0, hence m = dim
   rows for each. The first error is returned, and the file is complete or absent. */
PetscErrorCode HycoLCPWriteFclib(const HycoLCP *lcp, PetscInt dim, const PetscReal z[], const PetscReal start[],
                                 const char path[])
{
  File f = {.lcp = lcp, .path = path, .dim = dim, .m = dim * lcp->blocks->n};
  PetscErrorCode ierr, failed = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(f.m + 1, &f.row, lcp->blocks->n + 1, &f.mu));
  ierr = ListRows(&f);
  if (!ierr) ierr = HycoH5Create(path, &f.h);
  if (!ierr) {
    ierr = WriteAll(&f, z, start);
    failed = HycoH5Close(&f.h, (PetscBool)!ierr);
  }
  PetscCall(PetscFree2(f.row, f.mu));
  PetscCall(ierr ? ierr : failed);
  PetscFunctionReturn(PETSC_SUCCESS);
}
