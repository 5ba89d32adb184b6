/*
  Interpolation coefficients in parameter space, the alpha of (42), from the points only. If the points form a grid:
  multilinear (with one parameter: linear between neighbours). Otherwise: linear on the simplices of their Delaunay
  triangulation, by Qhull (Barber, Dobkin, Huhdanpaa, ACM Trans. Math. Softw. 22 (1996) 469-483). Each parameter is
  scaled to the points' range first, because a triangulation depends on the units.
*/
#include <hycoalgorithms.h>
#include <libqhull_r/qhull_ra.h>
#include <petscblaslapack.h>
#include <stdlib.h>
#include <string.h>

struct _n_HycoInterpolant {
  PetscInt dim, n;        /* numbers of parameters, of different points */
  PetscInt n_given, *own; /* own[k]: the given point that is the k-th different one */
  PetscReal *lo, *width;  /* range of the points, by parameter */
  PetscReal *x;           /* n x dim, scaled */
  /* for a grid: axis p has count[p] ascending values; at[]: the point of each node, the last axis fastest; else NULL */
  PetscInt *count, *at;
  PetscReal **axis;
  /* simplices: dim + 1 points each, and the inverse of the edge vectors from the first point (column major) */
  PetscInt n_simplices, *simplex;
  PetscReal *inverse;
};

/* Of the unit cube, the volume of a simplex in scaled parameters: 4500 eps, a determinant of numbers up to 1. */
#define FLAT_SIMPLEX 1e-12

/* Duplicates would make the triangulation degenerate; the first of equal points counts. */
static PetscErrorCode KeepDifferent(HycoInterpolant it, const PetscReal points[])
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < it->n_given; k++) {
    PetscBool twin = PETSC_FALSE;

    for (PetscInt j = 0; j < it->n && !twin; j++)
      PetscCall(PetscArraycmp(points + it->own[j] * it->dim, points + k * it->dim, it->dim, &twin));
    if (!twin) it->own[it->n++] = k;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* To [0, 1]; a parameter with one value keeps the width 1. Simplices of parameters of different units would be
   arbitrarily flat otherwise. */
static PetscErrorCode InterpolateScale(HycoInterpolant it, const PetscReal points[])
{
  PetscFunctionBegin;
  PetscCall(PetscMalloc1(it->n * it->dim, &it->x));
  for (PetscInt p = 0; p < it->dim; p++) {
    PetscReal hi = PETSC_MIN_REAL;

    it->lo[p] = PETSC_MAX_REAL;
    for (PetscInt k = 0; k < it->n; k++) {
      it->lo[p] = PetscMin(it->lo[p], points[it->own[k] * it->dim + p]);
      hi = PetscMax(hi, points[it->own[k] * it->dim + p]);
    }
    it->width[p] = hi > it->lo[p] ? hi - it->lo[p] : 1;
    for (PetscInt k = 0; k < it->n; k++)
      it->x[k * it->dim + p] = (points[it->own[k] * it->dim + p] - it->lo[p]) / it->width[p];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Position of x on an axis: value[i] <= x <= value[i + 1] and the weight of i + 1; outside, that of the end. */
static PetscInt AxisPosition(PetscInt n, const PetscReal value[], PetscReal x, PetscReal *t)
{
  PetscInt i = 0;

  while (i < n - 2 && x > value[i + 1]) i++;
  *t = n < 2 ? 0 : PetscMin(1, PetscMax(0, (x - value[i]) / (value[i + 1] - value[i])));
  return i;
}

/* Finds axes and nodes if every combination of the points' values is a point. it->at stays NULL where the points are no
   grid. */
static PetscErrorCode FindGrid(HycoInterpolant it)
{
  PetscReal nodes = 1;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(it->dim, &it->axis, it->dim, &it->count));
  for (PetscInt p = 0; p < it->dim; p++) {
    PetscReal *value;
    PetscInt m = 0;

    PetscCall(PetscMalloc1(it->n, &value));
    for (PetscInt k = 0; k < it->n; k++) value[k] = it->x[k * it->dim + p];
    PetscCall(PetscSortReal(it->n, value));
    for (PetscInt k = 0; k < it->n; k++) {
      if (!k || value[k] > value[m - 1]) value[m++] = value[k];
    }
    it->axis[p] = value;
    it->count[p] = m;
    nodes *= m;
  }
  if (nodes != it->n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(it->n, &it->at));
  for (PetscInt k = 0; k < it->n; k++) { /* n different points on n nodes: one for each */
    PetscInt node = 0;

    for (PetscInt p = 0; p < it->dim; p++) {
      PetscReal t;
      const PetscInt i = AxisPosition(it->count[p], it->axis[p], it->x[k * it->dim + p], &t);

      /* The value is a node of the axis, so that t is 0 or 1. */
      node = node * it->count[p] + i + (t > 0.5);
    }
    it->at[node] = k;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds a simplex with the inverse of its edge vectors, unless it is degenerate. */
static PetscErrorCode AddSimplex(HycoInterpolant it, const PetscInt vertex[])
{
  const PetscInt dim = it->dim;
  PetscReal *edge = it->inverse + (size_t)it->n_simplices * (size_t)(dim * dim), volume = 1;
  PetscScalar work[64];
  PetscBLASInt n, room = 64, pivot[8], info;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(dim, &n));
  for (PetscInt j = 0; j < dim; j++) {
    for (PetscInt p = 0; p < dim; p++) edge[j * dim + p] = it->x[vertex[j + 1] * dim + p] - it->x[vertex[0] * dim + p];
  }
  LAPACKgetrf_(&n, &n, edge, &n, pivot, &info);
  for (PetscInt p = 0; p < dim; p++) volume *= edge[p * dim + p];
  /* Triangulated points on a common circle (Qt) may give flat simplices; they cover nothing. */
  if (info || PetscAbsReal(volume) < FLAT_SIMPLEX) PetscFunctionReturn(PETSC_SUCCESS);
  LAPACKgetri_(&n, edge, &n, pivot, work, &room, &info);
  if (info) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscArraycpy(it->simplex + it->n_simplices * (dim + 1), vertex, dim + 1));
  it->n_simplices++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The lower hull's facets, in Qhull's order, which depends only on the points. */
static PetscErrorCode TakeSimplices(HycoInterpolant it, qhT *qh)
{
  facetT *facet;
  vertexT *v, **vp;
  PetscInt n = 0;

  PetscFunctionBegin;
  FORALLfacets n++;
  PetscCall(PetscMalloc2(n * (it->dim + 1), &it->simplex, n * it->dim * it->dim, &it->inverse));
  FORALLfacets
  {
    /* At most 8 parameters, hence 9 corners of a simplex. */
    PetscInt vertex[9], m = 0;

    if (facet->upperdelaunay) continue;
    FOREACHsetelement_(vertexT, facet->vertices, v)
    {
      const int id = qh_pointid(qh, v->point);

      if (m <= it->dim && id >= 0 && id < it->n) vertex[m++] = id;
    }
    /* Sorted, so that barycentric weights are summed in the same order on every machine. */
    PetscCall(PetscSortInt(m, vertex));
    if (m == it->dim + 1) PetscCall(AddSimplex(it, vertex));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Exact points are on a lower hull in one more dimension; Qhull's messages go into memory, since the library does
   not print. */
static PetscErrorCode InterpolateTriangulate(HycoInterpolant it)
{
  static char options[] = "qhull d Qbb Qc Qz Q12 Qt"; /* Delaunay, with points on a common circle triangulated */
  qhT qh;
  char *said = NULL;
  size_t length = 0;
  FILE *ear;
  int left, total, failed;

  PetscFunctionBegin;
  HycoCheck(it->dim <= 8, "points that form no grid are interpolated for up to 8 parameters; here are %d",
            (int)it->dim);
  HycoCheck(it->n > it->dim, "%d points cannot be interpolated over %d parameters; at least %d are needed", (int)it->n,
            (int)it->dim, (int)it->dim + 1);
  ear = open_memstream(&said, &length); /* Qhull's error message */
  HycoCheck(ear, "there is no memory for the triangulation of %d points", (int)it->n);
  qh_zero(&qh, ear);
  failed = qh_new_qhull(&qh, (int)it->dim, (int)it->n, it->x, False, options, NULL, ear);
  if (!failed) PetscCall(TakeSimplices(it, &qh));
  qh_freeqhull(&qh, !qh_ALL);
  qh_memfreeshort(&qh, &left, &total);
  fclose(ear);
  free(said);
  HycoCheck(it->n_simplices > 0,
            "the %d points lie on one line or plane of the %d parameters: nothing between them can be interpolated; "
            "start from the corners of the ranges",
            (int)it->n, (int)it->dim);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* n points (n x dim); duplicates are allowed. The caller destroys it also after an error. */
PetscErrorCode HycoInterpolantCreate(PetscInt dim, PetscInt n, const PetscReal points[], HycoInterpolant *interpolant)
{
  HycoInterpolant it;

  PetscFunctionBegin;
  HycoCheck(dim >= 1 && n >= 1, "%d points in %d parameters cannot be interpolated", (int)n, (int)dim);
  PetscCall(PetscNew(&it));
  *interpolant = it;
  it->dim = dim;
  it->n_given = n;
  PetscCall(PetscMalloc3(n, &it->own, dim, &it->lo, dim, &it->width));
  PetscCall(KeepDifferent(it, points));
  PetscCall(InterpolateScale(it, points));
  PetscCall(FindGrid(it));
  if (!it->at) PetscCall(InterpolateTriangulate(it));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Also after an error of the creation, as its arrays start as NULL. */
PetscErrorCode HycoInterpolantDestroy(HycoInterpolant *interpolant)
{
  HycoInterpolant it;

  PetscFunctionBegin;
  if (!interpolant || !*interpolant) PetscFunctionReturn(PETSC_SUCCESS);
  it = *interpolant;
  for (PetscInt p = 0; it->axis && p < it->dim; p++) PetscCall(PetscFree(it->axis[p]));
  PetscCall(PetscFree2(it->axis, it->count));
  PetscCall(PetscFree2(it->simplex, it->inverse));
  PetscCall(PetscFree3(it->own, it->lo, it->width));
  HycoFreeAll(&it->x, &it->at, interpolant);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Weights of the corners of the box around x. Parameters at a node of their axis do not double the number of corners.
   Multilinear: exact at the nodes, continuous between. */
static void GridWeights(HycoInterpolant it, const PetscReal x[], PetscReal weight[])
{
  PetscInt place[HYCO_INTERPOLANT_MAX_DIM];
  PetscReal t[HYCO_INTERPOLANT_MAX_DIM];
  PetscInt free[HYCO_INTERPOLANT_MAX_DIM], n_free = 0;

  for (PetscInt p = 0; p < it->dim; p++) {
    place[p] = AxisPosition(it->count[p], it->axis[p], x[p], &t[p]);
    /* The upper node of an interval is the lower one of the next, also at the end of the axis. */
    if (t[p] == 1) {
      place[p]++;
      t[p] = 0;
    }
    if (t[p] > 0) free[n_free++] = p;
  }
  for (PetscInt corner = 0; corner < ((PetscInt)1 << n_free); corner++) {
    PetscReal w = 1;
    PetscInt node = 0, f = 0;

    for (PetscInt p = 0; p < it->dim; p++) {
      PetscInt up = 0;

      if (f < n_free && free[f] == p) {
        up = (corner >> f++) & 1;
        w *= up ? t[p] : 1 - t[p];
      }
      node = node * it->count[p] + place[p] + up;
    }
    weight[it->own[it->at[node]]] += w;
  }
}

/* Barycentric coordinates in the first simplex that contains x; outside all, in the one with the least negative
   coordinates, clipped to its faces. A linear search: models have some hundred simplices. Piecewise linear on the
   Delaunay triangulation. */
static void SimplexWeights(HycoInterpolant it, const PetscReal x[], PetscReal weight[])
{
  const PetscInt dim = it->dim;
  PetscReal best[9], highest = -PETSC_MAX_REAL, sum = 0;
  PetscInt at = 0;

  for (PetscInt s = 0; s < it->n_simplices && highest < -FLAT_SIMPLEX; s++) {
    const PetscInt *vertex = it->simplex + s * (dim + 1);
    const PetscReal *inverse = it->inverse + (size_t)s * (size_t)(dim * dim);
    PetscReal b[9] = {1}, lowest;

    for (PetscInt i = 0; i < dim; i++) {
      b[i + 1] = 0;
      for (PetscInt p = 0; p < dim; p++) b[i + 1] += inverse[p * dim + i] * (x[p] - it->x[vertex[0] * dim + p]);
      b[0] -= b[i + 1];
    }
    lowest = b[0];
    for (PetscInt i = 1; i <= dim; i++) lowest = PetscMin(lowest, b[i]);
    if (lowest <= highest) continue;
    highest = lowest;
    at = s;
    for (PetscInt i = 0; i <= dim; i++) best[i] = b[i];
  }
  /* Outside, the clipped coordinates are scaled to the sum 1 again: a point of a face. */
  for (PetscInt i = 0; i <= dim; i++) sum += best[i] = PetscMax(best[i], 0);
  for (PetscInt i = 0; i <= dim; i++) weight[it->own[it->simplex[at * (dim + 1) + i]]] = best[i] / sum;
}

/* weight[n]: the alpha of (42), which add up to 1; zero at most points. Outside the points' range the nearest value
   is taken. */
PetscErrorCode HycoInterpolantGetWeights(HycoInterpolant it, const PetscReal point[], PetscReal weight[])
{
  PetscReal x[HYCO_INTERPOLANT_MAX_DIM];

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(weight, it->n_given));
  for (PetscInt p = 0; p < it->dim; p++) x[p] = (point[p] - it->lo[p]) / it->width[p];
  if (it->at)
    GridWeights(it, x, weight);
  else
    SimplexWeights(it, x, weight);
  PetscFunctionReturn(PETSC_SUCCESS);
}
