/*
  Reads problems of FCLIB (files of the layout fclib_local) and solves each by block Gauss-Seidel and by hyco's semismooth
  Newton's method, from no forces and from the file's first guess. For each file a line of

      contacts  components  free  from-guess  from-zero  residual  sweeps  residual  solution  difference

  iterations of Newton's method and the larger residual of its two results; sweeps of Gauss-Seidel (-1: not used, as with free
  unknowns; or not converged in MOST) and its residual; that of the file's solution; the largest difference of a force of Gauss-Seidel and Newton
  (from the guess), relative to the largest force. A residual is that of the natural map of FCLIB,

      |r - P(r - u - (mu |u_t|, 0, 0))| / |q|,     P: the projection onto the cone |r_t| <= mu r_n,

  with forces in units of the displacements that they cause: divided by the mean flexibility.
*/
#include <hdf5.h>
#include <hyco.h>
#include <hycolcp.h>
#include <math.h>

#define TOL   1e-8
#define MOST  20000 /* sweeps */
#define CHECK 10    /* sweeps from one residual to the next */

typedef struct {
  PetscInt dim, n, m, p; /* components of a contact; contacts; rows of W; free unknowns */
  PetscReal *M, *q, *mu; /* of z = (l, r), column major: [-R, -V^T; V, W], (-s, q) */
  PetscReal *guess, *solution, scale, size;
} Problem;

/* -- the file -- */

/* A dataset; *n: its length. Its type in the file is converted. */
static void *Load(hid_t file, const char *group, const char *name, hid_t type, PetscInt *n)
{
  char path[128];
  hid_t set, space;
  void *data;

  snprintf(path, sizeof(path), "/%s/%s", group, name);
  set = H5Dopen2(file, path, H5P_DEFAULT);
  if (set < 0) {
    fprintf(stderr, "no dataset %s\n", path);
    exit(1);
  }
  space = H5Dget_space(set);
  *n = (PetscInt)H5Sget_simple_extent_npoints(space);
  data = calloc((size_t)*n + 1, H5Tget_size(type));
  if (H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) < 0) exit(1);
  H5Sclose(space);
  H5Dclose(set);
  return data;
}

static int Integer(hid_t file, const char *group, const char *name)
{
  PetscInt n;
  int *data = Load(file, group, name, H5T_NATIVE_INT, &n), value = data[0];

  free(data);
  return value;
}

static PetscReal *Reals(hid_t file, const char *group, const char *name, PetscInt n)
{
  PetscInt found;
  PetscReal *data = Load(file, group, name, H5T_NATIVE_DOUBLE, &found);

  if (found != n) {
    fprintf(stderr, "%s/%s has %d entries, and %d are expected\n", group, name, (int)found, (int)n);
    exit(1);
  }
  return data;
}

/* Adds a sparse matrix of the file, in any of its three forms, times `sign` to M from (row, column) on; `transposed`. */
static void AddMatrix(hid_t file, const char *group, Problem *f, PetscInt row, PetscInt column, PetscReal sign,
                      PetscBool transposed)
{
  const int nz = Integer(file, group, "nz"), lines = Integer(file, group, nz == -2 ? "m" : "n");
  const PetscInt size = f->p + f->m;
  PetscInt n_p, n_i, n_x, count;
  int *p = Load(file, group, "p", H5T_NATIVE_INT, &n_p), *i = Load(file, group, "i", H5T_NATIVE_INT, &n_i);
  PetscReal *x = Load(file, group, "x", H5T_NATIVE_DOUBLE, &n_x);

  count = nz >= 0 ? nz : p[lines];
  for (PetscInt k = 0, line = 0; k < count; k++) {
    PetscInt a = i[k], b;

    while (nz < 0 && k >= p[line + 1]) line++;
    b = nz >= 0 ? i[k] : line;
    if (nz >= 0) a = p[k];
    if (nz == -2) {
      const PetscInt swap = a;

      a = b;
      b = swap;
    }
    if (transposed)
      f->M[(column + a) * size + row + b] += sign * x[k];
    else
      f->M[(column + b) * size + row + a] += sign * x[k];
  }
  free(p);
  free(i);
  free(x);
}

/* z = (l, r) of a solution or guess. */
static PetscReal *Point(hid_t file, const char *group, const Problem *f)
{
  PetscReal *z = calloc((size_t)(f->p + f->m), sizeof(*z)), *r = Reals(file, group, "r", f->m);

  for (PetscInt i = 0; i < f->m; i++) z[f->p + i] = r[i];
  free(r);
  if (f->p) {
    r = Reals(file, group, "l", f->p);
    for (PetscInt i = 0; i < f->p; i++) z[i] = r[i];
    free(r);
  }
  return z;
}

static void Read(const char *path, Problem *f)
{
  hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
  PetscReal *part;
  PetscInt flexible = 0;

  if (file < 0) exit(1);
  f->dim = Integer(file, "fclib_local", "spacedim");
  f->m = Integer(file, "fclib_local/W", "m");
  f->n = f->m / f->dim;
  f->p = H5Lexists(file, "/fclib_local/V", H5P_DEFAULT) > 0 ? Integer(file, "fclib_local/V", "n") : 0;
  f->M = calloc((size_t)(f->p + f->m) * (size_t)(f->p + f->m), sizeof(PetscReal));
  f->q = calloc((size_t)(f->p + f->m), sizeof(PetscReal));
  AddMatrix(file, "fclib_local/W", f, f->p, f->p, 1, PETSC_FALSE);
  part = Reals(file, "fclib_local/vectors", "q", f->m);
  for (PetscInt i = 0; i < f->m; i++) {
    const PetscReal w = f->M[(f->p + i) * (f->p + f->m + 1)];

    f->q[f->p + i] = part[i];
    f->size += part[i] * part[i];
    f->scale += w;
    flexible += w > 0;
  }
  free(part);
  f->size = sqrt(f->size);
  f->scale /= (PetscReal)flexible;
  f->mu = Reals(file, "fclib_local/vectors", "mu", f->n);
  if (f->p) {
    AddMatrix(file, "fclib_local/V", f, f->p, 0, 1, PETSC_FALSE);
    AddMatrix(file, "fclib_local/V", f, 0, f->p, -1, PETSC_TRUE);
    AddMatrix(file, "fclib_local/R", f, 0, 0, -1, PETSC_FALSE);
    part = Reals(file, "fclib_local/vectors", "s", f->p);
    for (PetscInt i = 0; i < f->p; i++) f->q[i] = -part[i];
    free(part);
  }
  f->guess = Point(file, "guesses/1", f);
  f->solution = Point(file, "solution", f);
  if (Integer(file, "guesses", "number_of_guesses") != 1) exit(1);
  H5Fclose(file);
}

static void Free(Problem *f)
{
  free(f->M);
  free(f->q);
  free(f->mu);
  free(f->guess);
  free(f->solution);
}

/* -- FCLIB's natural map -- */

/* u = q + M z */
static void Velocity(const Problem *f, const PetscReal z[], PetscReal u[])
{
  const PetscInt size = f->p + f->m;

  for (PetscInt i = 0; i < size; i++) u[i] = f->q[i];
  for (PetscInt j = 0; j < size; j++) {
    for (PetscInt i = 0; z[j] != 0 && i < size; i++) u[i] += f->M[j * size + i] * z[j];
  }
}

static PetscReal Tangent(PetscInt dim, const PetscReal a[])
{
  return dim > 2 ? hypot(a[1], a[2]) : fabs(a[1]);
}

/* The nearest point of the second-order cone. */
static void ToCone(PetscInt dim, PetscReal mu, PetscReal a[])
{
  const PetscReal t = Tangent(dim, a), n = a[0];
  PetscReal at;

  if (t <= mu * n) return;
  at = (n + mu * t) / (1 + mu * mu);
  for (PetscInt i = 0; i < dim; i++) a[i] = at <= 0 ? 0 : i ? mu * at * a[i] / t : at;
}

static PetscReal Residual(const Problem *f, const PetscReal z[])
{
  PetscReal *u = calloc((size_t)(f->p + f->m), sizeof(*u)), sum = 0, balance = 0, loads = 0;

  Velocity(f, z, u);
  for (PetscInt k = 0; k < f->n; k++) {
    const PetscReal *v = u + f->p + k * f->dim, *r = z + f->p + k * f->dim;
    PetscReal a[3] = {0};

    for (PetscInt i = 0; i < f->dim; i++) a[i] = f->scale * r[i] - v[i];
    a[0] -= f->mu[k] * Tangent(f->dim, v);
    ToCone(f->dim, f->mu[k], a);
    for (PetscInt i = 0; i < f->dim; i++) sum += pow(f->scale * r[i] - a[i], 2);
  }
  for (PetscInt i = 0; i < f->p; i++) { /* of the free unknowns, relative to their loads */
    balance += u[i] * u[i];
    loads += f->q[i] * f->q[i];
  }
  free(u);
  return sqrt(sum) / f->size + (f->p ? sqrt(balance / loads) : 0);
}

/* -- the two methods -- */

/* The force of a contact alone, with the displacement b without it: projected steps, for which 1 / bound is short enough. */
static void Local(const Problem *f, PetscInt k, const PetscReal b[], PetscReal r[])
{
  const PetscInt first = f->p + k * f->dim, size = f->p + f->m;
  PetscReal W[9], bound = 0;

  for (PetscInt j = 0; j < f->dim; j++) {
    PetscReal sum = 0;

    for (PetscInt i = 0; i < f->dim; i++) sum += fabs(W[j * f->dim + i] = f->M[(first + j) * size + first + i]);
    bound = fmax(bound, sum);
  }
  for (PetscInt s = 0; s < 200; s++) {
    PetscReal y[3] = {0}, change = 0, most = 0, radius, t;

    for (PetscInt i = 0; i < f->dim; i++) {
      PetscReal u = b[i];

      for (PetscInt j = 0; j < f->dim; j++) u += W[j * f->dim + i] * r[j];
      y[i] = r[i] - u / bound;
    }
    y[0] = fmax(y[0], 0);
    radius = f->mu[k] * y[0];
    t = Tangent(f->dim, y);
    for (PetscInt i = 0; i < f->dim; i++) {
      const PetscReal next = i && t > radius ? y[i] * radius / t : y[i];

      change = fmax(change, fabs(next - r[i]));
      most = fmax(most, fabs(next));
      r[i] = next;
    }
    if (change <= 1e-13 * most) return;
  }
}

/* From no forces; returns the sweeps, -1 if there are too many. */
static int GaussSeidel(const Problem *f, PetscReal z[], PetscReal *residual)
{
  const PetscInt size = f->m;
  PetscReal *u = calloc((size_t)size, sizeof(*u));
  int found = -1;

  for (int s = 1; s <= MOST && found < 0; s++) {
    if (s % 100 == 1) Velocity(f, z, u); /* round-off does not add up */
    for (PetscInt k = 0; k < f->n; k++) {
      const PetscInt first = k * f->dim;
      PetscReal b[3] = {0}, r[3] = {0};

      for (PetscInt i = 0; i < f->dim; i++) r[i] = z[first + i];
      for (PetscInt i = 0; i < f->dim; i++) {
        b[i] = u[first + i];
        for (PetscInt j = 0; j < f->dim; j++) b[i] -= f->M[(first + j) * size + first + i] * r[j];
      }
      Local(f, k, b, r);
      for (PetscInt j = 0; j < f->dim; j++) {
        const PetscReal change = r[j] - z[first + j], *column = f->M + (first + j) * size;

        for (PetscInt i = 0; change != 0 && i < size; i++) u[i] += column[i] * change;
        z[first + j] = r[j];
      }
    }
    if (s % CHECK == 0 || s < CHECK) *residual = Residual(f, z);
    if ((s % CHECK == 0 || s < CHECK) && *residual <= TOL) found = s;
  }
  free(u);
  return found;
}

/* From z. */
static PetscErrorCode Newton(const Problem *f, PetscReal z[], PetscInt *its)
{
  HycoCone cone;
  HycoBlocks *blocks;
  HycoLCP lcp = {.n = f->m, .p = f->p, .M = f->M, .q = f->q, .symmetric = PETSC_TRUE};
  HycoLCPStatus status;
  PetscInt *of;
  PetscReal *data;

  PetscFunctionBegin;
  PetscCall(HycoConeCreate(PETSC_COMM_SELF, &cone));
  PetscCall(HycoConeSetSize(cone, f->dim));
  PetscCall(HycoConeSetType(cone, HYCO_CONE_COULOMB));
  PetscCall(PetscCalloc2(f->n, &of, 2 * f->n, &data));
  for (PetscInt k = 0; k < f->n; k++) data[2 * k] = f->mu[k];
  PetscCall(HycoBlocksCreate(1, &cone, f->n, of, data, &blocks));
  lcp.blocks = blocks;
  PetscCall(HycoLCPSemismooth(&lcp, z, its, &status));
  PetscCall(HycoBlocksDestroy(&blocks));
  PetscCall(HycoConeDestroy(&cone));
  PetscCall(PetscFree2(of, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Solve(const char *path)
{
  Problem f = {0};
  PetscInt its[2], size;
  PetscReal *z[3], most = 0, difference = 0, residual[3] = {0, 0, 0};
  int sweeps = -1;

  PetscFunctionBegin;
  Read(path, &f);
  size = f.p + f.m;
  for (PetscInt k = 0; k < 3; k++) z[k] = calloc((size_t)size, sizeof(PetscReal));
  PetscCall(PetscArraycpy(z[0], f.guess, size));
  for (PetscInt k = 0; k < 2; k++) {
    PetscCall(Newton(&f, z[k], &its[k]));
    residual[k] = Residual(&f, z[k]);
  }
  if (!f.p) sweeps = GaussSeidel(&f, z[2], &residual[2]);
  for (PetscInt i = 0; i < size; i++) {
    most = fmax(most, fabs(z[0][i]));
    difference = fmax(difference, fabs(z[2][i] - z[0][i]));
  }
  printf("%d %d %d %d %d %.2e %d %.2e %.2e %.2e\n", (int)f.n, (int)f.dim, (int)f.p, (int)its[0], (int)its[1],
         fmax(residual[0], residual[1]), sweeps, residual[2], Residual(&f, f.solution), difference / most);
  for (PetscInt k = 0; k < 3; k++) free(z[k]);
  Free(&f);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscCall(HycoInitialize(&argc, &argv));
  for (int k = 1; k < argc; k++) PetscCall(Solve(argv[k]));
  return (int)HycoFinalize();
}
