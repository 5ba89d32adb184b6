/*
  Runtime of exported models, written into each of them as it is here: C99 with libc and libm. A model is
  w = q(mu) + M(mu) z for z = (x, L), the rigid motions that contact alone holds and the contact forces,

      w_x = q_x + A L = 0,   0 <= L  complementary to  w_L = q_L - A^T x + W L >= 0,

  and values of the displacements and stresses, affine in z, from which the outputs follow. q, A, W and the values are
  combinations of functions of the parameters. Where surfaces move past each other they are those of forces at places of
  the surfaces, of which the contacts' rows B make those of the contacts: L acts by B^T L, W is the sum over the bodies
  of B_b C_b B_b^T.
*/
#include "expression.h"
#include "model.h"
#include "surfaces.c"
#include <float.h>

/* Arrays in the caller's memory. */
typedef struct {
  double *atom, *f, *q, *w, *z, *value; /* expressions and functions; n_motions + n_contacts; values */
  /* W: columns, as far as they are made. L: factor of W on the closed contacts, in rows of n_contacts; V = L^-1 A^T; S:
     of V^T V */
  double *W, *A, *L, *V, *S, *last, *y;
  double pin; /* of A^T (q_x + A L), which is 0, in w_L: a body's pins have no flexibility of their own */
  double *at_places, *push, *sum; /* n_motions + n_places: w for z = 0, z; n_terms */
  int *closed, *at, *list, *made,
      n_closed;          /* by contact: 0, open; 2, one of the next; the closed ones, rows of L; of W's columns */
  Met *met;              /* by contact; of moved surfaces, like */
  int *touched, *before; /* places of moved surfaces that rows have; by place: how many of these precede it */
  Room room;
  /* p + n: scales; y = z - rho w at the step's begin, and where it is measured; where Newton's step ends; trials; the
     right side */
  double *rho, *from, *from_next, *aimed, *trial, *trial_w, *rhs;
  /* by block; of unknowns; variables, then parameters on the way; a state; a force */
  double *D, *J, *v, *saved, largest;
  int *unknown, *pivot;
  double t; /* the step's end */
  State s;  /* its begin, and then its end */
  /* Bodies that flow: see flow.c. P as A; by mode; with `softer`, of the chosen points; by point; q without alpha */
  double *P, *alpha, *alpha_at, *lack, *step, *K, *row_of_K, *Z, *slope, *strain_at, *z_at, *q_elastic, *aside;
  double *softer, *strain, *elastic, *stress, *lost, *flowed, *size, *constant;
  double most_lack, increment; /* tolerance of lack; the largest of the inelastic strains */
  int *pivot_of_K, has_tangent, easy;
  size_t n_unknown;
} Work;

/* What programs of bodies that flow do, and others; of contacts with friction. */
#if FLOWS
#define FLOW(does, else_does) does
static size_t flow_doubles(const Model *m);
static void place_flow(const Model *m, double **next, Work *o);
static void set_points(const Model *m, const Work *o, const double v[]);
static double solve_flow(const Model *m, Work *o, int *iterations);
static int settle(const Model *m, Work *o);
#else
#define FLOW(does, else_does) else_does
#endif
#if SLIPS
#define SLIP(does, else_does) (m->n_slip ? (does) : (else_does))
#else
#define SLIP(does, else_does) else_does
#endif

static size_t path_doubles(const Model *m);
static size_t path_ints(const Model *m);
static void place_path(const Model *m, double **next, Work *o);
#if SLIPS
static double solve_slip(const Model *m, Work *o, int again, int *iterations);
#endif
static void accept(const Model *m, Work *o);

/* The largest members come first, so that all are aligned. */
static size_t work_size(const Model *m)
{
  const Surfaces *s = &m->surfaces;
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts, places = (size_t)m->n_places,
               nodes = (size_t)s->n_nodes, facets = (size_t)s->n_facets;
  const size_t doubles = (size_t)(m->n_atoms + m->n_functions + m->n_values + m->n_terms) + 4 * (p + n) +
                         2 * (p + places) + 2 * n * n + 2 * p * n + p * p + n + 7 * nodes + 3 * facets +
                         path_doubles(m) + FLOW(flow_doubles(m), 0);
  const size_t moved =
      nodes ? n * sizeof(Met) + facets * sizeof(HycoPoint) + (size_t)HycoPatchesBoxes(s->n_facets) * sizeof(HycoBox)
            : 0;

  return doubles * sizeof(double) + moved + (4 * n + 2 * places + 1 + path_ints(m) + (size_t)m->n_modes) * sizeof(int);
}

static double *take(double **from, size_t n)
{
  double *taken = *from;

  *from += n;
  return taken;
}

/* The order of the arrays matters by their alignment alone. */
static void place(const Model *m, void *memory, Work *o)
{
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts, places = (size_t)m->n_places;
  const Surfaces *s = &m->surfaces;
  double *next = memory;

  o->atom = take(&next, (size_t)m->n_atoms);
  o->f = take(&next, (size_t)m->n_functions);
  o->value = take(&next, (size_t)m->n_values);
  o->q = take(&next, p + n);
  o->w = take(&next, p + n);
  o->z = take(&next, p + n);
  o->W = take(&next, n * n);
  o->A = take(&next, p * n);
  o->L = take(&next, n * n);
  o->V = take(&next, p * n);
  o->S = take(&next, p * p);
  o->last = take(&next, p + n);
  o->y = take(&next, n);
  o->at_places = take(&next, p + places);
  o->push = take(&next, p + places);
  o->sum = take(&next, (size_t)m->n_terms);
  o->room.X = take(&next, 3 * (size_t)s->n_nodes);
  o->room.outward = take(&next, 3 * (size_t)s->n_nodes);
  o->room.area = take(&next, (size_t)s->n_nodes);
  o->room.normal = take(&next, 3 * (size_t)s->n_facets);
  place_path(m, &next, o);
  FLOW(place_flow(m, &next, o), (void)0);
  o->met = (Met *)(void *)next;
  if (s->n_nodes) {
    o->room.item = (HycoPoint *)(void *)(o->met + n);
    o->room.box = (HycoBox *)(void *)(o->room.item + s->n_facets);
    next = (double *)(void *)(o->room.box + HycoPatchesBoxes(s->n_facets));
  }
  o->closed = (int *)(void *)next;
  o->at = o->closed + n;
  o->list = o->at + n;
  o->made = o->list + n;
  o->touched = o->made + n;
  o->before = o->touched + places;
  o->unknown = o->before + places + 1;
  o->pivot = o->unknown + path_ints(m) / 2;
  o->pivot_of_K = o->unknown + path_ints(m);
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

/* to += factor from. */
static void add(size_t n, double factor, const double *restrict from, double *restrict to)
{
  const size_t whole = n - n % 4;

  for (size_t i = 0; i < whole; i += 4) {
    for (size_t k = 0; k < 4; k++) to[i + k] += factor * from[i + k];
  }
  for (size_t i = whole; i < n; i++) to[i] += factor * from[i];
}

/* W of contact a by those at places: y = the sum of C_b B_b^T over the bodies, then B y. */
static void fill_moved(const Model *m, const Work *o, const Met *a, double y[], double w[])
{
  memset(y, 0, (size_t)m->n_places * sizeof(double));
  for (int e = 0; e < a->n; e++) {
    for (const Block *b = m->block; b < m->block + m->n_blocks; b++) {
      const int row = a->place[e] - b->first;
      const double factor = a->value[e] * o->value[b->value], *C = m->flexibility + b->at;

      if (row < 0 || row >= b->n) continue;
      C += (size_t)row * (size_t)b->n;
      if (2 * (o->before[b->first + b->n] - o->before[b->first]) > b->n) { /* all, side by side, cost less */
        add((size_t)b->n, factor, C, y + b->first);
        continue;
      }
      for (int t = o->before[b->first]; t < o->before[b->first + b->n]; t++)
        y[o->touched[t]] += factor * C[o->touched[t] - b->first];
    }
  }
  for (int i = 0; i < m->n_contacts; i++) {
    w[i] = 0;
    for (int e = 0; e < o->met[i].n; e++) w[i] += o->met[i].value[e] * y[o->met[i].place[e]];
  }
}

/* W with all contacts of those that are closed, or of all. Where rows are fixed the triangles are read in the order of
   memory. */
static void make_columns(const Model *m, Work *o, int all)
{
  const size_t n = (size_t)m->n_contacts, size = n * (n + 1) / 2;
  int k = 0, done = 0;

  for (int i = 0; i < m->n_contacts; i++) {
    if (o->made[i] || !(all || o->closed[i])) continue;
    o->made[i] = 1;
    o->list[k++] = i;
    if (m->surfaces.n_nodes) fill_moved(m, o, &o->met[i], o->push + m->n_motions, o->W + (size_t)i * n);
  }
  for (size_t i = 0; i < n && k && !m->surfaces.n_nodes; i++) {
    const int is = done < k && (size_t)o->list[done] == i;

    done += is;
    if (!done) continue;
    memset(o->y, 0, (i + 1) * sizeof(double));
    for (size_t s = 0; s < (size_t)m->n_stiffness; s++)
      add(i + 1, o->f[m->stiffness[s]], m->W + s * size + i * (i + 1) / 2, o->y);
    for (int j = 0; j < done; j++) o->W[(size_t)o->list[j] * n + i] = o->y[o->list[j]];
    if (is) memcpy(o->W + i * n, o->y, i * sizeof(double));
  }
}

/* W of contact a with all, which is made. */
static const double *column(const Model *m, const Work *o, size_t a)
{
  return o->W + a * (size_t)m->n_contacts;
}

/* The places that contacts touch. */
static void find_touched(const Model *m, Work *o)
{
  int n = 0;

  memset(o->before, 0, (size_t)(m->n_places + 1) * sizeof(int));
  for (int k = 0; k < m->n_contacts; k++) {
    for (int e = 0; e < o->met[k].n; e++) o->before[o->met[k].place[e]] = 1;
  }
  for (int i = 0; i <= m->n_places; i++) {
    const int is = o->before[i];

    o->before[i] = n;
    if (is) o->touched[n++] = i;
  }
}

/* The functions, and the nodes of moved surfaces, at the variables. */
static void set_variables(const Model *m, Work *o, const double v[])
{
  const Surfaces *s = &m->surfaces;

  for (int k = 0; k < m->n_atoms; k++) o->atom[k] = value_of(m->code + m->atom[k], v, NULL);
  for (int k = 0; k < m->n_functions; k++) o->f[k] = product(m->function + 4 * k, o->atom);
  for (PetscInt i = 0; i < 3 * s->n_nodes; i++) {
    const int map = s->map[3 * s->body[i / 3] + i % 3];

    o->room.X[i] = map < 0 ? s->drawn[i] : value_of(m->code + map, v, s->drawn + i - i % 3);
  }
}

/* The values for z = 0, and q and A of the contacts at the functions' values; 0: the model does not know a node. */
static int assemble(const Model *m, Work *o)
{
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts, places = (size_t)m->n_places,
               d = (size_t)m->n_functions;
  const Surfaces *s = m->surfaces.n_nodes ? &m->surfaces : NULL;
  double *q = s ? o->at_places : o->q;

  for (size_t i = 0; i < p + places; i++) q[i] = dot(d, m->offset + i * d, o->f);
  for (size_t i = 0; i < (size_t)m->n_values; i++) o->value[i] = dot(d, m->offset + (p + places + i) * d, o->f);
  memset(o->made, 0, n * sizeof(int));
  memset(o->A, 0, p * n * sizeof(double));
  for (PetscInt k = 0; s && k < s->n_searches; k++) {
    if (!meet(s, &s->search[k], &o->room, o->value, o->met)) return 0;
  }
  if (s) find_touched(m, o);
  for (size_t i = 0; i < p && s; i++) o->q[i] = q[i];
  for (size_t i = 0; i < n && s; i++) {
    const Met *a = &o->met[i];

    o->q[p + i] = a->n ? a->gap : 0;
    for (int e = 0; e < a->n; e++) o->q[p + i] += a->value[e] * q[p + (size_t)a->place[e]];
  }
  if (m->n_modes) memset(o->P, 0, (size_t)m->n_modes * n * sizeof(double));
  for (size_t k = 0; k < (size_t)m->n_stiffness; k++) {
    const size_t all = (size_t)m->n_modes * n; /* surfaces of bodies that flow do not move */

    if (all) add(all, o->f[m->stiffness[k]], m->P + k * all, o->P);
    for (size_t j = 0; j < p; j++) {
      const double factor = o->f[m->stiffness[k]], *A = m->A + (k * p + j) * places;

      if (!s) add(n, factor, A, o->A + j * n);
      for (size_t i = 0; i < n && s; i++) {
        for (int e = 0; e < o->met[i].n; e++) o->A[j * n + i] += factor * o->met[i].value[e] * A[o->met[i].place[e]];
      }
    }
  }
  return 1;
}

/* Entry n of four rows minus their products with the first n entries of another one; two sums of each. */
static void subtract(size_t n, size_t row_length, const double b[], double rows[])
{
  double *r0 = rows, *r1 = r0 + row_length, *r2 = r1 + row_length, *r3 = r2 + row_length;
  double s[8] = {0, 0, 0, 0, 0, 0, 0, 0};
  size_t i = 0;

  for (; i + 2 <= n; i += 2) {
    for (size_t k = 0; k < 2; k++) {
      s[k] += r0[i + k] * b[i + k];
      s[2 + k] += r1[i + k] * b[i + k];
      s[4 + k] += r2[i + k] * b[i + k];
      s[6 + k] += r3[i + k] * b[i + k];
    }
  }
  for (; i < n; i++) {
    s[0] += r0[i] * b[i];
    s[2] += r1[i] * b[i];
    s[4] += r2[i] * b[i];
    s[6] += r3[i] * b[i];
  }
  r0[n] -= s[0] + s[1];
  r1[n] -= s[2] + s[3];
  r2[n] -= s[4] + s[5];
  r3[n] -= s[6] + s[7];
}

/* Lower factor, row by row, of the matrix in the lower triangle of a: n rows of the length `row_length`, of which the
   first `done` are factored. A row that depends on the former ones has an infinite pivot, so that its unknown is 0.
   Returns the number of such rows. */
static int factorise(size_t n, size_t row_length, size_t done, double a[])
{
  int dependent = 0;

  for (size_t first = done; first < n; first += 4) {
    const size_t end = first + 4 < n ? first + 4 : n;

    /* Four rows at a time, which read the former ones once. */
    for (size_t j = 0; j < first; j++) {
      const double *former = a + j * row_length;

      if (end == first + 4)
        subtract(j, row_length, former, a + first * row_length);
      else
        for (size_t i = first; i < end; i++) a[i * row_length + j] -= dot(j, a + i * row_length, former);
      for (size_t i = first; i < end; i++) a[i * row_length + j] /= former[j];
    }
    for (size_t i = first; i < end; i++) {
      double *row = a + i * row_length, pivot = row[i];

      for (size_t j = first; j < i; j++) row[j] = (row[j] - dot(j, row, a + j * row_length)) / a[j * row_length + j];
      row[i] = pivot - dot(i, row, row);
      if (row[i] > 1e-13 * pivot) {
        row[i] = sqrt(row[i]);
      } else {
        row[i] = HUGE_VAL;
        dependent++;
      }
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

/* The closed contacts in `at`, those of the last set first and in their order: the rows of the factor stay up to the
   first that has left. Returns how many. */
static size_t arrange(const Model *m, Work *o)
{
  size_t same = (size_t)o->n_closed;
  int k = 0;

  make_columns(m, o, 0);
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

/* A factor by which the two terms of w_L are of one size. */
static double pin_of(const Model *m, Work *o)
{
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts;
  double flexible = 0, moves = 0;

  for (size_t i = 0; i < (size_t)o->n_closed && p; i++) {
    const size_t a = (size_t)o->at[i];

    flexible = fmax(flexible, column(m, o, a)[a]);
    for (size_t c = 0; c < p; c++) moves = fmax(moves, o->A[c * n + a] * o->A[c * n + a]);
  }
  return flexible > 0 && moves > 0 ? flexible / moves : 1;
}

/* y and x of L L^T y - V' x = y, V'^T y = -x, by the factors L and S, and V = L^-1 V'. */
static void solve_factored(const Model *m, const Work *o, double y[], double x[])
{
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts, k = (size_t)o->n_closed;

  forward(k, n, o->L, y);
  for (size_t i = 0; i < p; i++) x[i] -= dot(k, o->V + i * k, y);
  forward(p, p, o->S, x);
  backward(p, p, o->S, x);
  for (size_t j = 0; j < p; j++) add(k, x[j], o->V + j * k, y);
  backward(k, n, o->L, y);
}

/* z with the closed contacts at gap 0 and the others without force; epsilon, delta: of epsilon (x - last) added to w_x,
   and delta (L - last) to w_L. Returns 0 if the closed contacts do not hold the bodies. */
static int solve_set(const Model *m, Work *o, double epsilon, double delta)
{
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts;
  const size_t same = arrange(m, o), k = (size_t)o->n_closed;
  double *x = o->z, *L = o->z + p;
  int loose;

  for (size_t i = 0; i < n; i++) L[i] = 0;
  if (same == 0) o->pin = pin_of(m, o);
  for (size_t i = 0; i < k; i++) {
    const size_t a = (size_t)o->at[i];
    const double *W = column(m, o, a);

    for (size_t j = 0; j <= i && i >= same; j++) o->L[i * n + j] = W[o->at[j]];
    if (i >= same) o->L[i * n + i] += delta;
    o->y[i] = delta * o->last[p + a] - o->q[p + a];
    for (size_t c = 0; c < p; c++) {
      const double *A = o->A + c * n;

      for (size_t j = 0; j <= i && i >= same; j++) o->L[i * n + j] += o->pin * A[a] * A[o->at[j]];
      o->V[c * k + i] = A[a];
      o->y[i] -= o->pin * A[a] * o->q[c];
    }
  }
  factorise(k, n, same, o->L);
  for (size_t i = 0; i < p; i++) {
    forward(k, n, o->L, o->V + i * k);
    for (size_t j = 0; j <= i; j++) o->S[i * p + j] = dot(k, o->V + i * k, o->V + j * k);
    o->S[i * p + i] += epsilon;
    x[i] = epsilon * o->last[i] - o->q[i];
  }
  loose = factorise(p, p, 0, o->S);
  if (loose) return 0;
  solve_factored(m, o, o->y, x);
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
  memset(o->w + p, 0, n * sizeof(double));
  for (size_t j = 0; j < p; j++) add(n, -x[j], o->A + j * n, o->w + p);
  for (size_t j = 0; j < (size_t)o->n_closed; j++) add(n, L[o->at[j]], column(m, o, (size_t)o->at[j]), o->w + p);
  for (size_t i = 0; i < n; i++) {
    *gap = fmax(*gap, fmax(fabs(o->w[p + i]), fabs(o->q[p + i])));
    *force = fmax(*force, fabs(L[i]));
    o->w[p + i] += o->q[p + i];
  }
}

/* Rows of tangents have no force in a problem without friction. */
static int is_normal(const Model *m, size_t i)
{
  return !m->normal || m->normal[i];
}

/* Closes contacts that penetrate, and opens those under tension; one: only the last of them. Returns their number. */
static int change(const Model *m, Work *o, double gap, double force, int one)
{
  const size_t p = (size_t)m->n_motions;
  int n = 0;

  for (size_t i = (size_t)m->n_contacts; i-- > 0;) {
    /* Beyond round-off of the largest force, of the largest gap. */
    if (!is_normal(m, i) || (o->closed[i] ? o->z[p + i] >= -1e-14 * force : o->w[p + i] >= -1e-14 * gap)) continue;
    if (!one || !n) o->closed[i] = !o->closed[i];
    n++;
  }
  return n;
}

/* The active set method, from the present set; after a number of iterations it changes one contact at a time (Murty's
   rule), which ends. Returns 0 if it does not, or if the contacts do not hold the bodies. */
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

/* The contacts that are closed at first: those at least half as deep as the deepest without forces, since on rounded
   surfaces the others open again; with motions all, as an open set would let the bodies go. */
static void start(const Model *m, Work *o)
{
  double least = 0;

  for (int i = 0; i < m->n_contacts; i++) least = is_normal(m, (size_t)i) ? fmin(least, o->q[m->n_motions + i]) : least;
  for (int i = 0; i < m->n_contacts; i++)
    o->closed[i] = is_normal(m, (size_t)i) &&
                   (m->n_motions > 0 ? !m->surfaces.n_nodes || o->met[i].n : o->q[i] < 0 && o->q[i] <= least / 2);
  o->n_closed = 0;
  for (int i = 0; i < m->n_motions + m->n_contacts; i++) o->last[i] = 0;
}

/* What is left of the balance of motions, relative to its terms. */
static double unbalanced(const Model *m, const Work *o)
{
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts;
  double most = 0;

  for (size_t i = 0; i < p; i++) {
    double size = fabs(o->q[i]);

    for (size_t j = 0; j < n; j++) size += fabs(o->A[i * n + j] * o->z[p + j]);
    if (size > 0) most = fmax(most, fabs(o->w[i]) / size);
  }
  return most;
}

/* The largest KKT residual of z, recomputed from q, A and W, relative as in the library. */
static double kkt_residual(const Model *m, Work *o)
{
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts;
  double gap, force, most;
  int dropped = 0;

  residual(m, o, &gap, &force);
  for (size_t i = 0; i < n; i++) { /* forces that move no gap by more than round-off are 0, as without loads */
    double moves = o->z[p + i] == 0 ? 0 : column(m, o, i)[i];

    for (size_t c = 0; c < p; c++) moves += o->pin * o->A[c * n + i] * o->A[c * n + i];
    if (o->z[p + i] == 0 || (o->closed[i] && o->z[p + i] * moves > 1e-15 * gap)) continue;
    o->z[p + i] = 0;
    dropped = 1;
  }
  if (dropped) residual(m, o, &gap, &force);
  most = unbalanced(m, o);
  for (size_t i = p; i < p + n && gap > 0; i++) {
    if (!is_normal(m, i - p)) continue;
    most = fmax(most, -o->w[i] / gap);
    if (force > 0) most = fmax(most, fabs(o->w[i] / gap * (o->z[i] / force)));
  }
  return most;
}

/* Where sets of the search let bodies go, or contacts depend on each other: the same with a small stiffness towards the
   last motions and forces, which vanishes as these converge. Returns the KKT residual. */
static double search_held(const Model *m, Work *o, int *iterations)
{
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts;
  double epsilon = 0, delta = 0, kkt = HUGE_VAL;

  make_columns(m, o, 1);
  for (size_t i = 0; i < n; i++) delta = fmax(delta, 1e-8 * column(m, o, i)[i]);
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

/* The contacts without friction. Returns the KKT residual. */
static double solve(const Model *m, Work *o, int *iterations)
{
  double kkt;

  start(m, o);
  kkt = search(m, o, 0, 0, iterations) ? kkt_residual(m, o) : HUGE_VAL;
  return kkt > m->tolerance ? search_held(m, o, iterations) : kkt;
}

/* -- outputs -- */

/* Adds the terms to the values, each linear in z. */
static void evaluate(const Model *m, Work *o)
{
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_terms;
  double *push = o->push + p;

  memcpy(o->push, o->z, p * sizeof(double));
  if (m->surfaces.n_nodes)
    memset(push, 0, (size_t)m->n_places * sizeof(double));
  else
    memcpy(push, o->z + p, (size_t)m->n_places * sizeof(double));
  for (int k = 0; k < m->n_contacts && m->surfaces.n_nodes; k++) {
    for (int e = 0; e < o->met[k].n; e++) push[o->met[k].place[e]] += o->z[p + (size_t)k] * o->met[k].value[e];
  }
  memset(o->sum, 0, n * sizeof(double));
  /* Most places have no force. */
  for (size_t j = 0; j < p + (size_t)m->n_places; j++) {
    if (o->push[j] != 0) add(n, o->push[j], m->term + j * n, o->sum);
  }
  for (size_t j = 0; j < (size_t)m->n_modes; j++)
    add(n, o->alpha[j], m->term + (p + (size_t)m->n_places + j) * n, o->sum);
  for (size_t i = 0; i < n; i++) o->value[m->value[i]] += o->f[m->factor[i]] * o->sum[i];
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

/* The part of a contact in a resultant, or in a moment: of its force at the slave. */
static double resultant(const Model *m, const Work *o, const Output *q, int i)
{
  const int k = m->contact[q->first + i], a = q->of % 3, b = (q->of + 1) % 3, c = (q->of + 2) % 3;
  const Met *met = &o->met[k];
  const double *weight = m->weight + q->weight, *x = o->room.X + 3 * m->surfaces.slave[k];
  double share = weight[i];

  for (int j = 0; j < met->n_masters; j++) share -= met->weight[j] * weight[q->n + met->master[j]];
  share *= o->z[m->n_motions + k];
  return q->of < 3 ? share * met->normal[a] : share * (x[b] * met->normal[c] - x[c] * met->normal[b]);
}

/* least: forces below it are none, as in the library. An output over no item is 0. */
static double output(const Model *m, const Work *o, const Output *q, double least)
{
  double sum = q->kind == LARGEST ? -HUGE_VAL : q->kind == SMALLEST || q->kind == PRESSURE_SMALLEST ? HUGE_VAL : 0;

  if (q->kind == RESULTANT && q->width >= 0) sum = o->value[q->width];
  for (int i = 0; i < q->n; i++) {
    const double weight = q->weight < 0 ? 1 : m->weight[q->weight + i];

    if (q->kind == WORK) {
      sum += o->s.work[m->contact[q->first + i]];
    } else if (q->kind == RESULTANT) {
      if (o->z[m->n_motions + m->contact[q->first + i]] > least) sum += resultant(m, o, q, i);
    } else if (q->kind >= CLOSED) {
      const int k = m->contact[q->first + i];
      const double force = k < 0 ? 0 : o->z[m->n_motions + k];
      const double area = k < 0 ? 0 : m->surfaces.n_nodes ? o->met[k].area : o->value[m->areas + k];
      const double pressure = force > least && area > 0 ? force / area : 0;

      if (q->kind == CLOSED) sum += force > least ? area : 0;
      if (q->kind == PRESSURE) sum = fmax(sum, pressure);
      if (q->kind == PRESSURE_SMALLEST) sum = fmin(sum, pressure);
    } else {
      const double v = item(q->of, q->width, o->value + q->first + i * q->width);

      sum = q->kind == LARGEST ? fmax(sum, v) : q->kind == SMALLEST ? fmin(sum, v) : sum + weight * v;
    }
  }
  return sum == HUGE_VAL ? 0 : sum;
}

/* The step of the state o->s to the variables v, which have the time o->t. Residuals say whether it is solved. */
static int predict(const Model *m, Work *o, const double v[], double out[], double *kkt, int *iterations)
{
  double least = 0;

  *kkt = HUGE_VAL;
  for (int i = 0; i < m->n_outputs; i++) out[i] = NAN;
  set_variables(m, o, v);
  if (!assemble(m, o)) return DIVERGED;
  /* fmax() passes over what is not a number: a residual of such gaps would be 0. */
  for (int i = 0; i < m->n_motions + m->n_contacts; i++) {
    if (!isfinite(o->q[i])) return DIVERGED;
  }
  FLOW(set_points(m, o, v), (void)0);
  *kkt = FLOW(solve_flow(m, o, iterations), SLIP(solve_slip(m, o, 0, iterations), solve(m, o, iterations)));
  evaluate(m, o);
  if (!FLOW(settle(m, o), 1)) *kkt = HUGE_VAL;
  if (*kkt <= m->tolerance) accept(m, o);
  /* 1e-10 of the largest force. */
  for (int i = 0; i < m->n_contacts; i++)
    least = is_normal(m, (size_t)i) ? fmax(least, 1e-10 * o->z[m->n_motions + i]) : least;
  for (int i = 0; i < m->n_outputs; i++) {
    out[i] = output(m, o, &m->output[i], least);
    if (!isfinite(out[i])) *kkt = HUGE_VAL;
  }
  return *kkt <= m->tolerance ? OK : DIVERGED;
}
