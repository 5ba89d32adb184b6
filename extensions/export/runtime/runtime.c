/*
  Runtime of exported models, written into each of them as it is here: C99 with libc and libm. A model is
  w = q(mu) + M(mu) z for z = (x, L), the rigid motions that contact alone holds and the contact forces,

      w_x = q_x + A L = 0,   0 <= L  complementary to  w_L = q_L - A^T x + W L >= 0,

  and values of the displacements and stresses, affine in z, from which the outputs follow. q, A, W and the values are
  combinations of functions of the parameters.
*/
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

enum { OK, OUTSIDE, DIVERGED, NO_MEMORY };                            /* status */
enum { SUM, LARGEST, SMALLEST, CLOSED, PRESSURE, PRESSURE_SMALLEST }; /* kinds of output */
enum { COMPONENT, NORM, MISES, PRINCIPAL };                           /* what counts of an item; PRINCIPAL + k */

/* An output: a number for each of n items, combined as its kind says. The items are places with `width` values each, from
   value `first` on, or contacts, from `first` on in Model.contact. */
typedef struct Output {
  int kind, of, n, width, first, weight; /* weight: place of the first in Model.weight; -1: all are 1 */
} Output;

typedef struct {
  int n_parameters, n_functions, n_motions, n_contacts, n_stiffness, n_values, n_terms, n_outputs;
  double tolerance;          /* of the KKT residual */
  const double *lo, *hi;     /* ranges of the parameters */
  const double *offset;      /* n_motions + n_contacts + n_values rows of n_functions: w and the values for z = 0 */
  const int *stiffness;      /* functions by which the next two are multiplied, n_stiffness of each */
  const double *W, *A;       /* lower triangle of n_contacts rows; n_motions x n_contacts */
  const int *value, *factor; /* of n_terms: the value to which it adds, and its function */
  const double *term;        /* n_terms x (n_motions + n_contacts) */
  const Output *output;
  const int *contact;
  const double *weight;
} Model;

/* Arrays in the caller's memory. */
typedef struct {
  double *f, *q, *w, *z, *value; /* functions; n_motions + n_contacts; values */
  /* L: factor of W on the closed contacts, in rows of n_contacts; V = L^-1 A^T; S: factor of V^T V */
  double *W, *A, *L, *V, *S, *last, *y;
  int *closed, *at, n_closed; /* by contact: 0, open; 2, one of the next; the closed ones, rows of L */
} Work;

static size_t work_doubles(const Model *m)
{
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts;

  return (size_t)m->n_functions + (size_t)m->n_values + 4 * (p + n) + n * (n + 1) / 2 + n * n + 2 * p * n + p * p + n;
}

/* The ints follow the doubles, so that both are aligned. */
static size_t work_size(const Model *m)
{
  return work_doubles(m) * sizeof(double) + 2 * (size_t)m->n_contacts * sizeof(int);
}

static double *take(double **from, size_t n)
{
  double *taken = *from;

  *from += n;
  return taken;
}

/* The order of the arrays does not matter, but that doubles come first. */
static void place(const Model *m, void *memory, Work *o)
{
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts;
  double *next = memory;

  o->f = take(&next, (size_t)m->n_functions);
  o->value = take(&next, (size_t)m->n_values);
  o->q = take(&next, p + n);
  o->w = take(&next, p + n);
  o->z = take(&next, p + n);
  o->W = take(&next, n * (n + 1) / 2);
  o->A = take(&next, p * n);
  o->L = take(&next, n * n);
  o->V = take(&next, p * n);
  o->S = take(&next, p * p);
  o->last = take(&next, p + n);
  o->y = take(&next, n);
  o->closed = (int *)(void *)next;
  o->at = o->closed + n;
}

/* Four sums, which a compiler may add side by side. */
static double dot(size_t n, const double a[], const double b[])
{
  double s[4] = {0, 0, 0, 0};
  size_t i = 0;

  for (; i + 4 <= n; i += 4) {
    for (size_t k = 0; k < 4; k++) s[k] += a[i + k] * b[i + k];
  }
  for (; i < n; i++) s[0] += a[i] * b[i];
  return s[0] + s[1] + (s[2] + s[3]);
}

/* W between two contacts. */
static double entry(const double W[], size_t i, size_t j)
{
  return i > j ? W[i * (i + 1) / 2 + j] : W[j * (j + 1) / 2 + i];
}

/* q, W and A at the functions' values. */
static void assemble(const Model *m, Work *o)
{
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts, d = (size_t)m->n_functions;
  const size_t size = n * (n + 1) / 2;

  for (size_t i = 0; i < p + n; i++) o->q[i] = dot(d, m->offset + i * d, o->f);
  memset(o->W, 0, size * sizeof(double));
  memset(o->A, 0, p * n * sizeof(double));
  for (size_t s = 0; s < (size_t)m->n_stiffness; s++) {
    const double factor = o->f[m->stiffness[s]];

    for (size_t i = 0; i < size; i++) o->W[i] += factor * m->W[s * size + i];
    for (size_t i = 0; i < p * n; i++) o->A[i] += factor * m->A[s * p * n + i];
  }
}

/* Lower factor, row by row, of the matrix in the lower triangle of a: n rows of the length `row_length`, of which the first
   `done` are factored. A row that depends on the former ones has an infinite pivot, so that its unknown is 0. Returns the
   number of such rows. */
static int factorise(size_t n, size_t row_length, size_t done, double a[])
{
  int dependent = 0;

  for (size_t i = done; i < n; i++) {
    double *row = a + i * row_length, pivot = row[i];

    for (size_t j = 0; j < i; j++) row[j] = (row[j] - dot(j, row, a + j * row_length)) / a[j * row_length + j];
    row[i] = pivot - dot(i, row, row);
    if (row[i] > 1e-13 * pivot) {
      row[i] = sqrt(row[i]);
    } else {
      row[i] = HUGE_VAL;
      dependent++;
    }
  }
  return dependent;
}

/* x = L^-1 x; an infinite pivot gives 0. */
static void forward(size_t n, size_t row_length, const double a[], double x[])
{
  for (size_t i = 0; i < n; i++) x[i] = (x[i] - dot(i, a + i * row_length, x)) / a[i * row_length + i];
}

/* x = L^-T x. */
static void backward(size_t n, size_t row_length, const double a[], double x[])
{
  for (size_t i = n; i-- > 0;) {
    x[i] /= a[i * row_length + i];
    for (size_t j = 0; j < i; j++) x[j] -= a[i * row_length + j] * x[i];
  }
}

/* The closed contacts in `at`, those of the last set first and in their order: the rows of the factor stay up to the first
   that has left. Returns how many. */
static size_t arrange(const Model *m, Work *o)
{
  size_t same = (size_t)o->n_closed;
  int k = 0;

  for (int i = 0; i < o->n_closed; i++) {
    if (o->closed[o->at[i]])
      o->at[k++] = o->at[i];
    else if (same > (size_t)i)
      same = (size_t)i;
  }
  for (int i = 0; i < m->n_contacts; i++) {
    if (o->closed[i] == 1) o->at[k++] = i;
    if (o->closed[i]) o->closed[i] = 2;
  }
  o->n_closed = k;
  return same;
}

/* z with the closed contacts at gap 0 and the others without force; epsilon, delta: of epsilon (x - last) added to w_x, and
   delta (L - last) to w_L. Returns 0 if the closed contacts do not hold the bodies. */
static int solve_set(const Model *m, Work *o, double epsilon, double delta)
{
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts;
  const size_t same = arrange(m, o), k = (size_t)o->n_closed;
  double *x = o->z, *L = o->z + p;
  int loose;

  for (size_t i = 0; i < n; i++) L[i] = 0;
  for (size_t i = 0; i < k; i++) {
    const size_t a = (size_t)o->at[i];

    for (size_t j = 0; j <= i && i >= same; j++) o->L[i * n + j] = entry(o->W, a, (size_t)o->at[j]);
    if (i >= same) o->L[i * n + i] += delta;
    for (size_t j = 0; j < p; j++) o->V[j * k + i] = o->A[j * n + a];
    o->y[i] = delta * o->last[p + a] - o->q[p + a];
  }
  factorise(k, n, same, o->L);
  forward(k, n, o->L, o->y);
  for (size_t i = 0; i < p; i++) {
    forward(k, n, o->L, o->V + i * k);
    for (size_t j = 0; j <= i; j++) o->S[i * p + j] = dot(k, o->V + i * k, o->V + j * k);
    o->S[i * p + i] += epsilon;
    x[i] = -o->q[i] - dot(k, o->V + i * k, o->y) + epsilon * o->last[i];
  }
  loose = factorise(p, p, 0, o->S);
  if (loose) return 0;
  forward(p, p, o->S, x);
  backward(p, p, o->S, x);
  for (size_t i = 0; i < k; i++) {
    for (size_t j = 0; j < p; j++) o->y[i] += o->V[j * k + i] * x[j];
  }
  backward(k, n, o->L, o->y);
  for (size_t i = 0; i < k; i++) L[o->at[i]] = o->y[i];
  return 1;
}

/* w of z; *gap, *force: the largest gap (or its change), the largest force. */
static void residual(const Model *m, Work *o, double *gap, double *force)
{
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts;
  const double *x = o->z, *L = o->z + p;

  *gap = *force = 0;
  for (size_t i = 0; i < p; i++) o->w[i] = o->q[i] + dot(n, o->A + i * n, L);
  for (size_t i = 0; i < n; i++) {
    double change = 0;

    for (size_t j = 0; j < p; j++) change -= o->A[j * n + i] * x[j];
    for (size_t j = 0; j < (size_t)o->n_closed; j++) {
      const size_t a = (size_t)o->at[j];

      change += entry(o->W, i, a) * L[a];
    }
    o->w[p + i] = o->q[p + i] + change;
    *gap = fmax(*gap, fmax(fabs(change), fabs(o->q[p + i])));
    *force = fmax(*force, fabs(L[i]));
  }
}

/* Closes contacts that penetrate, and opens those under tension; one: only the last of them. Returns their number. */
static int change(const Model *m, Work *o, double gap, double force, int one)
{
  const size_t p = (size_t)m->n_motions;
  int n = 0;

  for (size_t i = (size_t)m->n_contacts; i-- > 0;) {
    /* Beyond round-off of the largest force, of the largest gap. */
    if (o->closed[i] ? o->z[p + i] >= -1e-14 * force : o->w[p + i] >= -1e-14 * gap) continue;
    if (!one || !n) o->closed[i] = !o->closed[i];
    n++;
  }
  return n;
}

/* The active set method, from the present set; after a number of iterations it changes one contact at a time (Murty's rule),
   which ends. Returns 0 if it does not, or if the contacts do not hold the bodies. */
static int search(const Model *m, Work *o, double epsilon, double delta, int *iterations)
{
  double gap, force;

  for (int i = 0; i < 100 + 20 * m->n_contacts; i++) {
    ++*iterations;
    if (!solve_set(m, o, epsilon, delta)) return 0;
    residual(m, o, &gap, &force);
    if (!change(m, o, gap, force, i >= 40)) return 1;
  }
  return 0;
}

/* The contacts that are closed at first: those at least half as deep as the deepest without forces, since on rounded surfaces
   the others open again; with motions all, as an open set would let the bodies go. */
static void start(const Model *m, Work *o)
{
  double least = 0;

  for (int i = 0; i < m->n_contacts; i++) least = fmin(least, o->q[m->n_motions + i]);
  for (int i = 0; i < m->n_contacts; i++)
    o->closed[i] = m->n_motions > 0 || (o->q[m->n_motions + i] < 0 && o->q[m->n_motions + i] <= least / 2);
  o->n_closed = 0;
  for (int i = 0; i < m->n_motions + m->n_contacts; i++) o->last[i] = 0;
}

/* The largest KKT residual of z, recomputed from q, A and W, relative as in the library. */
static double kkt_residual(const Model *m, Work *o)
{
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts;
  double gap, force, most = 0;
  int dropped = 0;

  residual(m, o, &gap, &force);
  for (size_t i = 0; i < n; i++) { /* forces that move no gap by more than round-off are 0, as without loads */
    if (o->z[p + i] == 0 || (o->closed[i] && o->z[p + i] * entry(o->W, i, i) > 1e-15 * gap)) continue;
    o->z[p + i] = 0;
    dropped = 1;
  }
  if (dropped) residual(m, o, &gap, &force);
  for (size_t i = 0; i < p; i++) {
    double size = fabs(o->q[i]);

    for (size_t j = 0; j < n; j++) size += fabs(o->A[i * n + j] * o->z[p + j]);
    if (size > 0) most = fmax(most, fabs(o->w[i]) / size);
  }
  for (size_t i = p; i < p + n && gap > 0; i++) {
    most = fmax(most, -o->w[i] / gap);
    if (force > 0) most = fmax(most, fabs(o->w[i] / gap * (o->z[i] / force)));
  }
  return most;
}

/* Where sets of the search let bodies go, or contacts depend on each other: the same with a small stiffness towards the last
   motions and forces, which vanishes as these converge. Returns the KKT residual. */
static double search_held(const Model *m, Work *o, int *iterations)
{
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts;
  double epsilon = 0, delta = 0, kkt = HUGE_VAL;

  for (size_t i = 0; i < n; i++) delta = fmax(delta, 1e-8 * entry(o->W, i, i));
  for (size_t i = 0; i < p * n; i++) epsilon = fmax(epsilon, 1e-2 * o->A[i] * o->A[i] * (1e-8 / delta));
  start(m, o);
  for (int i = 0; i < 40 && kkt > 1e-13; i++) {
    /* The residual of the original problem, which says that it is not solved. */
    if (!search(m, o, epsilon, delta, iterations)) return kkt_residual(m, o);
    kkt = kkt_residual(m, o);
    memcpy(o->last, o->z, (p + n) * sizeof(double));
  }
  return kkt;
}

/* -- outputs -- */

/* A value is its offset's functions plus the terms, each linear in z. */
static void evaluate(const Model *m, Work *o)
{
  const size_t first = (size_t)m->n_motions + (size_t)m->n_contacts, d = (size_t)m->n_functions;

  for (size_t i = 0; i < (size_t)m->n_values; i++) o->value[i] = dot(d, m->offset + (first + i) * d, o->f);
  for (size_t i = 0; i < (size_t)m->n_terms; i++)
    o->value[m->value[i]] += o->f[m->factor[i]] * dot(first, m->term + i * first, o->z);
}

/* The principal stresses, the largest first, by Jacobi's rotations: xx, yy, zz, xy, yz, xz. */
static void principal(const double s[6], double out[3])
{
  double a[3][3] = {{s[0], s[3], s[5]}, {s[3], s[1], s[4]}, {s[5], s[4], s[2]}};

  for (int sweep = 0; sweep < 30; sweep++) {
    const double shear = fabs(a[0][1]) + fabs(a[0][2]) + fabs(a[1][2]);

    if (shear <= 1e-17 * (fabs(a[0][0]) + fabs(a[1][1]) + fabs(a[2][2]))) break;
    for (int i = 0; i < 2; i++) {
      for (int j = i + 1; j < 3; j++) {
        const int k = 3 - i - j;
        const double g = (a[j][j] - a[i][i]) / 2, r = hypot(g, a[i][j]);
        const double t = a[i][j] == 0 ? 0 : a[i][j] / (g + (g < 0 ? -r : r));
        const double c = 1 / sqrt(t * t + 1), ik = a[i][k], jk = a[j][k];

        a[i][i] -= t * a[i][j];
        a[j][j] += t * a[i][j];
        a[i][j] = a[j][i] = 0;
        a[i][k] = a[k][i] = c * (ik - t * jk);
        a[j][k] = a[k][j] = c * (t * ik + jk);
      }
    }
  }
  out[0] = fmax(a[0][0], fmax(a[1][1], a[2][2]));
  out[2] = fmin(a[0][0], fmin(a[1][1], a[2][2]));
  out[1] = a[0][0] + a[1][1] + a[2][2] - out[0] - out[2];
}

static double item(int of, int width, const double value[])
{
  double s[6] = {0}, out[3];

  if (of == COMPONENT) return value[0];
  if (of == NORM) return sqrt(dot((size_t)width, value, value));
  memcpy(s, value, (size_t)width * sizeof(double));
  if (of == MISES)
    return sqrt(((s[0] - s[1]) * (s[0] - s[1]) + (s[1] - s[2]) * (s[1] - s[2]) + (s[2] - s[0]) * (s[2] - s[0])) / 2 +
                3 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
  principal(s, out);
  return out[of - PRINCIPAL];
}

/* least: forces below it are none, as in the library. An output over no item is 0. */
static double output(const Model *m, const Work *o, const Output *q, double least)
{
  double sum = q->kind == LARGEST ? -HUGE_VAL : q->kind == SMALLEST || q->kind == PRESSURE_SMALLEST ? HUGE_VAL : 0;

  for (int i = 0; i < q->n; i++) {
    const double weight = q->weight < 0 ? 1 : m->weight[q->weight + i];

    if (q->kind >= CLOSED) {
      const double force = o->z[m->n_motions + m->contact[q->first + i]], pressure = force > least ? weight * force : 0;

      if (q->kind == CLOSED) sum += force > least ? weight : 0;
      if (q->kind == PRESSURE) sum = fmax(sum, pressure);
      if (q->kind == PRESSURE_SMALLEST) sum = fmin(sum, pressure);
    } else {
      const double v = item(q->of, q->width, o->value + q->first + i * q->width);

      sum = q->kind == LARGEST ? fmax(sum, v) : q->kind == SMALLEST ? fmin(sum, v) : sum + weight * v;
    }
  }
  return sum == HUGE_VAL ? 0 : sum;
}

/* The prediction for the functions' values in o->f. Residuals say whether it is solved. */
static int predict(const Model *m, Work *o, double out[], double *kkt, int *iterations)
{
  double least = 0;

  *iterations = 0;
  assemble(m, o);
  start(m, o);
  *kkt = search(m, o, 0, 0, iterations) ? kkt_residual(m, o) : HUGE_VAL;
  if (*kkt > m->tolerance) *kkt = search_held(m, o, iterations);
  /* 1e-10 of the largest force. */
  for (int i = 0; i < m->n_contacts; i++) least = fmax(least, 1e-10 * o->z[m->n_motions + i]);
  evaluate(m, o);
  for (int i = 0; i < m->n_outputs; i++) out[i] = output(m, o, &m->output[i], least);
  return *kkt <= m->tolerance ? OK : DIVERGED;
}
