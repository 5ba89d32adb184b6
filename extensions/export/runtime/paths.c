/*
  Paths in time; a prediction without a history is a step from rest. A step with friction is w = q + M z as in
  runtime.c, with rows for the tangents of a contact after that of its normal, whose w is the slip of the step: q has
  where the tangents were before. With Coulomb's projection P of the library, F(z) = z - P(z - rho w) = 0 is solved by
  Newton's method with a search along its steps.
*/

static size_t state_size(const Model *m)
{
  const size_t n = m->n_slip ? (size_t)m->n_contacts : 0, p = m->n_slip ? (size_t)m->n_motions : 0;

  return 4 + (size_t)m->n_parameters + p + 3 * n + (size_t)(m->n_slip + m->n_modes) +
         (size_t)m->n_points * (size_t)(m->n_strain + 2);
}

static State state_of(const Model *m, double *from)
{
  const size_t n = m->n_slip ? (size_t)m->n_contacts : 0, p = m->n_slip ? (size_t)m->n_motions : 0;
  State s;

  s.taken = take(&from, 1);
  s.t = take(&from, 1);
  s.t_before = take(&from, 1);
  s.dt = take(&from, 1);
  s.mu = take(&from, (size_t)m->n_parameters);
  s.z = take(&from, p + n);
  s.before = take(&from, n);
  s.place = take(&from, n);
  s.work = take(&from, (size_t)m->n_slip);
  s.alpha = take(&from, (size_t)m->n_modes);
  s.flowed = take(&from, (size_t)m->n_points * (size_t)(m->n_strain + 2));
  return s;
}

/* Doubles and ints of a Work, and their places. */
static size_t path_doubles(const Model *m)
{
  const size_t n = m->n_slip ? (size_t)(m->n_motions + m->n_contacts) : 0;

  return n * n + 7 * n + 9 * (size_t)m->n_slip + 2 * (size_t)m->n_parameters + 1 + (size_t)m->n_tables + state_size(m);
}

static size_t path_ints(const Model *m)
{
  return m->n_slip ? 2 * (size_t)(m->n_motions + m->n_contacts) : 0;
}

static void place_path(const Model *m, double **next, Work *o)
{
  const size_t n = m->n_slip ? (size_t)(m->n_motions + m->n_contacts) : 0;

  o->J = take(next, n * n);
  o->rho = take(next, n);
  o->from = take(next, n);
  o->from_next = take(next, n);
  o->aimed = take(next, n);
  o->trial = take(next, n);
  o->trial_w = take(next, n);
  o->rhs = take(next, n);
  o->D = take(next, 9 * (size_t)m->n_slip);
  o->v = take(next, 2 * (size_t)m->n_parameters + 1 + (size_t)m->n_tables);
  o->saved = take(next, state_size(m));
}

#if SLIPS || FLOWS
/* Lower and upper factor with exchanged rows; an unknown without a pivot is 0. */
static void factor_rows(size_t n, double J[], int pivot[])
{
  double most = 0;

  for (size_t i = 0; i < n * n; i++) most = fmax(most, fabs(J[i]));
  for (size_t k = 0; k < n; k++) {
    double *row = J + k * n;
    size_t best = k;

    for (size_t i = k + 1; i < n; i++) {
      if (fabs(J[i * n + k]) > fabs(J[best * n + k])) best = i;
    }
    pivot[k] = (int)best;
    for (size_t j = 0; best != k && j < n; j++) {
      const double kept = row[j];

      row[j] = J[best * n + j];
      J[best * n + j] = kept;
    }
    if (!(fabs(row[k]) > 1e-14 * most)) row[k] = HUGE_VAL;
    for (size_t i = k + 1; i < n; i++) {
      double *of = J + i * n;

      if (of[k] == 0) continue;
      of[k] /= row[k];
      add(n - k - 1, -of[k], row + k + 1, of + k + 1);
    }
  }
}

static void solve_rows(size_t n, const double J[], const int pivot[], double x[])
{
  for (size_t k = 0; k < n; k++) {
    const double kept = x[k];

    x[k] = x[pivot[k]];
    x[pivot[k]] = kept;
  }
  for (size_t k = 0; k < n; k++) x[k] -= dot(k, J + k * n, x);
  for (size_t k = n; k-- > 0;) x[k] = (x[k] - dot(n - k - 1, J + k * n + k + 1, x + k + 1)) / J[k * n + k];
}
#endif

#if SLIPS
/* w = q + M z. */
static void slack(const Model *m, Work *o, const double z[], double w[])
{
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts;

  memcpy(w, o->q, (p + n) * sizeof(double));
  for (size_t i = 0; i < p; i++) {
    w[i] += dot(n, o->A + i * n, z + p);
    add(n, -z[i], o->A + i * n, w + p);
  }
  for (size_t j = 0; j < n; j++) {
    if (z[p + j] != 0) add(n, z[p + j], column(m, o, j), w + p);
  }
}

/* The coefficient of friction of a block, and no threshold. */
static void law(const Model *m, const Work *o, int k, double data[2])
{
  data[0] = m->coefficient[k] < 0 ? 0 : o->value[m->coefficient[k]];
  data[1] = 0;
}

/* By block, 1 over a typical flexibility, alike for both tangents; by motion, 1 over its work of a unit force. */
static void set_scales(const Model *m, Work *o)
{
  const int p = m->n_motions, n = m->n_contacts;
  double most = 0;

  make_columns(m, o, 1);
  for (int i = 0; i < p; i++) {
    o->rho[i] = 0;
    for (int j = 0; j < n; j++) o->rho[i] = fmax(o->rho[i], fabs(o->A[(size_t)i * (size_t)n + (size_t)j]));
  }
  for (int i = 0; i < n; i++) most = fmax(most, o->rho[p + i] = column(m, o, (size_t)i)[i]);
  for (int k = 0; k < m->n_slip; k++) {
    const int first = m->row[k], size = m->row[k + 1] - first;

    if (size == 3) o->rho[p + first + 1] = o->rho[p + first + 2] = (o->rho[p + first + 1] + o->rho[p + first + 2]) / 2;
  }
  for (int i = 0; i < p + n; i++) o->rho[i] = o->rho[i] > 0 ? 1 / o->rho[i] : most > 0 ? 1 / most : 1;
}

/* |F| at z with w, and y = z - rho w; *size: of the forces, or those that would close the gaps. */
static double measure(const Model *m, Work *o, const double z[], const double w[], double *size)
{
  const int p = m->n_motions, n = m->n_contacts;
  double sum = 0, most = 0, least = 0, data[2], z_of[3];

  for (int i = 0; i < p + n; i++) {
    o->from_next[i] = z[i] - o->rho[i] * w[i];
    if (i >= p) most = fmax(most, fabs(z[i]));
    least = fmax(least, fabs(o->rho[i] * o->q[i]));
    if (i < p) sum += o->rho[i] * w[i] * o->rho[i] * w[i];
  }
  for (int k = 0; k < m->n_slip; k++) {
    const int first = p + m->row[k], rows = m->row[k + 1] - m->row[k];

    law(m, o, k, data);
    HycoCoulombProject(rows, data, o->from_next + first, z_of);
    for (int i = 0; i < rows; i++) sum += (z[first + i] - z_of[i]) * (z[first + i] - z_of[i]);
  }
  least = 1e-4 * fmax(least, o->largest);
  *size = most > 0 ? fmax(most, least) : 1e4 * least;
  return sqrt(sum);
}

/* The unknowns on the pieces of P at y (stick: all contacts stick): rows of DP, o->D by block, that are not 0; `aimed`
   is z with 0 in the others. Returns their number. */
static int find_unknowns(const Model *m, Work *o, const double z[], int stick)
{
  const int p = m->n_motions;
  double data[2];
  int count = 0;

  memcpy(o->aimed, z, (size_t)(p + m->n_contacts) * sizeof(double));
  for (int i = 0; i < p; i++) o->unknown[count++] = i;
  for (int k = 0; k < m->n_slip; k++) {
    const int first = m->row[k], rows = m->row[k + 1] - first;
    double *D = o->D + 9 * k;

    law(m, o, k, data);
    if (!stick) HycoCoulombDerivative(rows, data, o->from + p + first, D);
    for (int i = 0; i < rows; i++) {
      double size = 0;

      for (int j = 0; j < rows; j++) {
        if (stick) D[rows * i + j] = i == j;
        size += fabs(D[rows * i + j]);
      }
      if (size > 0)
        o->unknown[count++] = p + first + i;
      else
        o->aimed[p + first + i] = 0;
    }
  }
  return count;
}

/* The block of a row. */
static int block_of(const Model *m, int row)
{
  int k = 0;

  while (m->row[k + 1] <= row) k++;
  return k;
}

/* The matrix of the unknowns on the pieces of P at y, factored; returns their number, and `aimed` as
   find_unknowns(). */
static size_t factor_pieces(const Model *m, Work *o, const double z[], int stick)
{
  const int p = m->n_motions;
  const size_t n = (size_t)m->n_contacts, count = (size_t)find_unknowns(m, o, z, stick);

  for (size_t a = 0; a < count; a++) {
    const int r = o->unknown[a] - p, k = r < 0 ? 0 : block_of(m, r), rows = m->row[k + 1] - m->row[k];
    double *J = o->J + a * count;

    for (size_t b = 0; b < count; b++) {
      const int s = o->unknown[b] - p;

      J[b] = r >= 0 ? a == b : s < 0 ? 0 : o->rho[p + r] * o->A[(size_t)(p + r) * n + (size_t)s];
    }
    for (int j = 0; j < rows && r >= 0; j++) { /* z - DP (z - rho w) = 0; of a motion w = 0 */
      const int of = m->row[k] + j;
      const double d = o->D[9 * k + rows * (r - m->row[k]) + j], rho = o->rho[p + of], *W = column(m, o, (size_t)of);

      for (size_t b = 0; b < count && d != 0; b++) {
        const int s = o->unknown[b] - p;

        J[b] += d * rho * (s < 0 ? -o->A[(size_t)(s + p) * n + (size_t)of] : W[s]) - (s == of ? d : 0);
      }
    }
  }
  factor_rows(count, o->J, o->pivot);
  return count;
}

/* In o->aimed the solution on the pieces of P at y, from z, by the residual there, which takes round-off away. */
static void aim(const Model *m, Work *o, const double z[], int stick)
{
  const int p = m->n_motions;
  const size_t count = factor_pieces(m, o, z, stick);

  slack(m, o, o->aimed, o->trial_w);
  for (size_t a = 0; a < count; a++) {
    const int i = o->unknown[a], r = i - p, k = r < 0 ? 0 : block_of(m, r), rows = m->row[k + 1] - m->row[k];

    o->rhs[a] = r < 0 ? -o->rho[i] * o->trial_w[i] : -o->aimed[i];
    for (int j = 0; j < rows && r >= 0; j++) {
      const int of = p + m->row[k] + j;

      o->rhs[a] += o->D[9 * k + rows * (r - m->row[k]) + j] * (o->aimed[of] - o->rho[of] * o->trial_w[of]);
    }
  }
  solve_rows(count, o->J, o->pivot, o->rhs);
  for (size_t a = 0; a < count; a++) o->aimed[o->unknown[a]] += o->rhs[a];
}

/* Newton's method from o->z. Returns 0 if it does not converge. */
static int iterate(const Model *m, Work *o, int *iterations)
{
  const size_t n = (size_t)(m->n_motions + m->n_contacts);
  double norm, size;

  slack(m, o, o->z, o->w);
  norm = measure(m, o, o->z, o->w, &size);
  for (int i = 0; i < 100 && norm > 1e-14 * size; i++) {
    const double before = norm, least = norm <= 1e-12 * size ? 1 : 1. / 65536;

    ++*iterations;
    memcpy(o->from, o->from_next, n * sizeof(double));
    aim(m, o, o->z, 0);
    for (double t = 1; t >= least; t /= 2) {
      for (size_t k = 0; k < n; k++) o->trial[k] = o->z[k] + t * (o->aimed[k] - o->z[k]);
      slack(m, o, o->trial, o->trial_w);
      norm = measure(m, o, o->trial, o->trial_w, &size);
      if (norm < (1 - (least < 1 ? 1e-4 * t : 0.5)) * before) break;
      norm = HUGE_VAL;
    }
    if (!(norm < before)) { /* z stays */
      norm = measure(m, o, o->z, o->w, &size);
      break;
    }
    memcpy(o->z, o->trial, n * sizeof(double));
    memcpy(o->w, o->trial_w, n * sizeof(double));
  }
  return norm <= 1e-10 * size;
}

/* The nearest forces that the law admits; without loads all are round-off, and none. */
static void admit(const Model *m, Work *o)
{
  const int p = m->n_motions;
  double data[2], z_of[3], most = 0, least = o->largest;

  for (int i = p; i < p + m->n_contacts; i++) {
    most = fmax(most, fabs(o->z[i]));
    least = fmax(least, fabs(o->rho[i] * o->q[i]));
  }
  if (most <= 1e-14 * least) memset(o->z + p, 0, (size_t)m->n_contacts * sizeof(double));
  for (int k = 0; k < m->n_slip; k++) {
    double *z = o->z + p + m->row[k];

    law(m, o, k, data);
    HycoCoulombProject(m->row[k + 1] - m->row[k], data, z, z_of);
    memcpy(z, z_of, (size_t)(m->row[k + 1] - m->row[k]) * sizeof(double));
  }
}

/* The largest residual of the law, recomputed, relative. */
static double law_residual(const Model *m, Work *o)
{
  const int p = m->n_motions, n = m->n_contacts;
  double force = 0, gap = 0, most = 0, data[2], y[3], z_of[3];

  slack(m, o, o->z, o->w);
  for (int i = p; i < p + n; i++) {
    force = fmax(force, fabs(o->z[i]));
    gap = fmax(gap, fmax(fabs(o->q[i]), fabs(o->w[i] - o->q[i])));
  }
  if (!(force > 0)) force = 1;
  for (int k = 0; k < m->n_slip; k++) {
    const int first = p + m->row[k], rows = m->row[k + 1] - m->row[k];

    law(m, o, k, data);
    for (int i = 0; i < rows; i++) y[i] = o->z[first + i] - (gap > 0 ? force / gap : 1) * o->w[first + i];
    HycoCoulombProject(rows, data, y, z_of);
    for (int i = 0; i < rows; i++) most = fmax(most, fabs(z_of[i] - o->z[first + i]) / force);
  }
  return fmax(most, unbalanced(m, o));
}

/* The motions that close the gaps of contacts with a force, in the sense of least squares. */
static void close_gaps(const Model *m, Work *o)
{
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts;

  memset(o->z, 0, p * sizeof(double));
  slack(m, o, o->z, o->w);
  for (int k = 0; k < m->n_slip; k++) {
    for (int i = m->row[k]; i < m->row[k + 1]; i++)
      o->trial[i] = o->z[p + (size_t)m->row[k]] > 0 ? o->w[p + (size_t)i] : 0;
  }
  for (size_t i = 0; i < p; i++) {
    o->z[i] = dot(n, o->A + i * n, o->trial);
    for (size_t j = 0; j <= i; j++) {
      o->S[i * p + j] = 0;
      for (int k = 0; k < m->n_slip; k++) {
        for (int r = m->row[k]; r < m->row[k + 1] && o->z[p + (size_t)m->row[k]] > 0; r++)
          o->S[i * p + j] += o->A[i * n + (size_t)r] * o->A[j * n + (size_t)r];
      }
    }
  }
  factorise(p, p, 0, o->S);
  forward(p, p, o->S, o->z);
  backward(p, p, o->S, o->z);
}

/* From the forces before (again: the present ones) or, where their residual is smaller, those extrapolated. Bodies that
   contact alone holds begin with no forces if no load acts on them. */
static int from_forces(const Model *m, Work *o, int again, int *iterations)
{
  const State *s = &o->s;
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts;
  const double ratio = *s->taken > 1 && p == 0 && !again ? (o->t - *s->t) / (*s->t - *s->t_before) : 0;
  double given, size;

  if (!again) memcpy(o->z, s->z, (p + n) * sizeof(double));
  o->largest = 0;
  for (size_t i = p; i < p + n; i++) o->largest = fmax(o->largest, fabs(o->z[i]));
  if (p && o->largest > 0) close_gaps(m, o);
  slack(m, o, o->z, o->w);
  given = measure(m, o, o->z, o->w, &size);
  if (p && !(o->largest > 0)) return given <= 1e-10 * size;
  if (ratio > 0) {
    for (size_t i = 0; i < n; i++) o->trial[i] = s->z[i] + ratio * (s->z[i] - s->before[i]);
    slack(m, o, o->trial, o->w);
    if (measure(m, o, o->trial, o->w, &size) < given) memcpy(o->z, o->trial, n * sizeof(double));
  }
  return iterate(m, o, iterations);
}

/* A step with friction: from the forces of the last one; from the solution without friction; from that in which all
   contacts stick, and its admissible forces. Returns the residual. */
static double solve_slip(const Model *m, Work *o, int again, int *iterations)
{
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts;

  set_scales(m, o);
  for (int k = 0; k < m->n_slip; k++) {
    for (int i = m->row[k] + 1; i < m->row[k + 1]; i++) o->q[p + (size_t)i] += o->s.place[i];
  }
  if (!from_forces(m, o, again, iterations) &&
      !(solve(m, o, iterations) <= m->tolerance && iterate(m, o, iterations))) {
    memset(o->z, 0, (p + n) * sizeof(double));
    aim(m, o, o->z, 1);
    memcpy(o->z, o->aimed, (p + n) * sizeof(double));
    if (!iterate(m, o, iterations)) {
      admit(m, o);
      if (p) close_gaps(m, o);
      (void)iterate(m, o, iterations);
    }
  }
  admit(m, o);
  return law_residual(m, o);
}

#if FLOWS
/* The pieces of the law at z, and what changes of q by -dq change there: dz. */
static void take_pieces(const Model *m, Work *o)
{
  double size;

  slack(m, o, o->z, o->w);
  (void)measure(m, o, o->z, o->w, &size);
  memcpy(o->from, o->from_next, (size_t)(m->n_motions + m->n_contacts) * sizeof(double));
  o->n_unknown = factor_pieces(m, o, o->z, 0);
}

static int derive_pieces(const Model *m, Work *o, const double dq[], double dz[])
{
  const int p = m->n_motions;

  for (size_t a = 0; a < o->n_unknown; a++) {
    const int r = o->unknown[a] - p, k = r < 0 ? 0 : block_of(m, r), rows = m->row[k + 1] - m->row[k];

    o->rhs[a] = 0;
    for (int i = m->row[k]; i < m->row[k + 1] && r >= 0; i++)
      o->rhs[a] += o->D[9 * k + rows * (r - m->row[k]) + i - m->row[k]] * o->rho[p + i] * dq[i];
  }
  solve_rows(o->n_unknown, o->J, o->pivot, o->rhs);
  for (size_t a = 0; a < o->n_unknown; a++) {
    if (o->unknown[a] >= p) dz[o->unknown[a] - p] = o->rhs[a];
  }
  return 1;
}
#endif
#endif

/* The step's end is the next one's begin. */
static void accept(const Model *m, Work *o)
{
  const State *s = &o->s;
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts;
  double most = 0;

  *s->t_before = *s->t;
  *s->t = o->t;
  ++*s->taken;
  memcpy(s->mu, o->v, (size_t)m->n_parameters * sizeof(double));
  if (m->n_modes) memcpy(s->alpha, o->alpha, (size_t)m->n_modes * sizeof(double));
  if (m->n_points) memcpy(s->flowed, o->flowed, (size_t)(m->n_points * (m->n_strain + 2)) * sizeof(double));
  if (!m->n_slip) return;
  memcpy(s->before, s->z + p, n * sizeof(double));
  memcpy(s->z, o->z, (p + n) * sizeof(double));
  for (size_t i = p; i < p + n; i++) most = fmax(most, fmax(fabs(o->q[i]), fabs(o->w[i] - o->q[i])));
  for (int k = 0; k < m->n_slip; k++) {
    const double *r = o->z + p + m->row[k];
    double work = 0;

    for (int i = m->row[k] + 1; i < m->row[k + 1]; i++) {
      s->place[i] -= o->w[p + (size_t)i];
      if (r[0] > 0) work -= o->z[p + (size_t)i] * o->w[p + (size_t)i];
    }
    /* Slips of round-off do none. */
    if (fabs(work) > 1e-12 * HycoTangential(m->row[k + 1] - m->row[k], r) * most) s->work[k] += work;
  }
}

/* One step to t. */
static int try_step(const Model *m, Work *o, const double mu[], double t, double out[], double *kkt, int *iterations)
{
  memcpy(o->v, mu, (size_t)m->n_parameters * sizeof(double));
  o->v[m->n_parameters] = t;
  for (int k = 0; k < m->n_tables; k++) {
    const int first = m->table[k];

    o->v[m->n_parameters + 1 + k] =
        HycoTableValue(&(HycoTimeTable){m->table[k + 1] - first, m->table_t + first, m->table_value + first}, t);
  }
  o->t = t;
  return predict(m, o, o->v, out, kkt, iterations);
}

/* From the state's time to t, where the parameters are mu; until there they go on a straight line. Steps end at the
   rows of tables; they are halved where they have no solution, and grow, as in the library. The state is as before if
   there is none. */
static int advance(const Model *m, Work *o, const double mu[], double t, double state[], double out[], double *kkt,
                   int *iterations)
{
  double *mu_of = o->v + m->n_parameters + 1 + m->n_tables;
  const State before = state_of(m, o->saved);
  double now, dt;
  int status = DIVERGED;

  o->s = state_of(m, state);
  *kkt = HUGE_VAL;
  *iterations = 0;
  for (int i = 0; i < m->n_outputs; i++) out[i] = NAN;
  memcpy(o->saved, state, state_size(m) * sizeof(double));
  now = *before.t;
  dt = *before.dt > 0 ? *before.dt : HUGE_VAL;
  /* At first all loads act at once, from rest. */
  if (*before.taken == 0) status = try_step(m, o, mu, t, out, kkt, iterations);
  while (*before.taken > 0 && now < t) {
    double stop = t, n, h, to;

    for (int i = 0; i < (m->n_tables ? m->table[m->n_tables] : 0); i++) {
      if (m->table_t[i] > now) stop = fmin(stop, m->table_t[i]);
    }
    for (int i = 0; i < m->n_stops; i++) {
      if (m->stop[i] > now) stop = fmin(stop, m->stop[i]);
    }
    n = ceil((stop - now) / dt - 1e-9);
    h = n > 1 ? (stop - now) / n : stop - now;
    to = n > 1 ? now + h : stop;
    for (int i = 0; i < m->n_parameters; i++)
      mu_of[i] = to < t ? before.mu[i] + (mu[i] - before.mu[i]) * ((to - *before.t) / (t - *before.t)) : mu[i];
    status = try_step(m, o, mu_of, to, out, kkt, iterations);
    if (status != OK && h / 2 < m->least) break;
    if (status != OK) dt = h / 2;
    if (status != OK) continue;
    now = to;
    if (!m->n_modes || (o->easy && 1.5 * o->increment <= m->most_increment)) dt = fmax(dt, 1.5 * h);
  }
  if (status == OK && *before.taken > 0) *o->s.dt = dt;
  if (status != OK) memcpy(state, o->saved, state_size(m) * sizeof(double));
  return status;
}
