/*
  Bodies that creep or yield. alpha, the coefficients of their modes, is one more part of z: q has - P^T alpha, and the
  values have terms of it. What the stresses at chosen points lack of elastic ones, s, gives alpha = T^T s. As in the
  library's model Newton's method solves this where the forces are linear in alpha, by their derivative at the contacts'
  solution for the last alpha, until the solution for its alpha has these forces.
*/
#include "laws.h"

/* Doubles of a Work, and their places. */
static size_t flow_doubles(const Model *m)
{
  const size_t l = (size_t)m->n_modes, n = (size_t)(m->n_motions + m->n_contacts), points = (size_t)m->n_points,
               ns = (size_t)m->n_strain, rows = (size_t)m->n_chosen * ns;

  return l * (l + 5) + 2 * l * n + 3 * n + rows * (l + 1 + ns) + points * (6 * ns + 3 + SLOTS);
}

static void place_flow(const Model *m, double **next, Work *o)
{
  const size_t l = (size_t)m->n_modes, n = (size_t)(m->n_motions + m->n_contacts), points = (size_t)m->n_points,
               ns = (size_t)m->n_strain, rows = (size_t)m->n_chosen * ns;

  o->alpha = take(next, l);
  o->alpha_at = take(next, l);
  o->lack = take(next, l);
  o->step = take(next, l);
  o->row_of_K = take(next, l);
  o->P = take(next, l * n);
  o->K = take(next, l * l);
  o->Z = take(next, l * n);
  o->q_elastic = take(next, n);
  o->z_at = take(next, n);
  o->aside = take(next, n);
  o->strain_at = take(next, rows);
  o->slope = take(next, rows * l);
  o->softer = take(next, rows * ns);
  o->strain = take(next, points * ns);
  o->elastic = take(next, points * ns);
  o->stress = take(next, points * ns);
  o->lost = take(next, points * ns);
  o->flowed = take(next, points * (ns + 2));
  o->size = take(next, points);
  o->constant = take(next, points * SLOTS);
}

/* The constants, the temperature and (EXPANSION) the thermal strain of all points at the variables. */
static void set_points(const Model *m, const Work *o, const double v[])
{
  const int n = m->n_points;

  for (const Flowing *b = m->flowing; b < m->flowing + m->n_flowing; b++) {
    const int *code = m->constant + SLOTS * (b - m->flowing);

    for (int i = b->first; i < b->first + b->n; i++) {
      double *value = o->constant + i;

      for (int j = 0; j < SLOTS; j++) {
        if (b->alike && i > b->first)
          value[j * n] = o->constant[j * n + b->first];
        else
          value[j * n] = code[j] < 0 ? 0 : value_of(m->code + code[j], v, m->point + 3 * i);
      }
      if (!b->alike || i == b->first) value[EXPANSION * n] *= value[TEMPERATURE * n] - value[REFERENCE * n];
    }
  }
}

/* C of Hooke's law. */
static double elastic_entry(int ns, double young, double poisson, int r, int c)
{
  const double shear = young / (2 * (1 + poisson)), lame = young * poisson / ((1 + poisson) * (1 - 2 * poisson));

  if (ns == 1) return young;
  return (r < 3 && c < 3 ? lame : 0) + (r != c ? 0 : r < 3 ? 2 * shear : shear);
}

/* The laws at points from .. to - 1, at o->strain: o->lost, o->size of its terms, their state at the end; softer: C -
   C_t. Returns 0 where a law has no solution. */
static int evaluate_laws(const Model *m, Work *o, int from, int to, double *softer)
{
  const int ns = m->n_strain;

  for (const Flowing *b = m->flowing; b < m->flowing + m->n_flowing; b++) {
    const double *constant[TEMPERATURE];
    const size_t at = (size_t)b->first, first = at * (size_t)ns;
    HycoMaterialPoints p = {.n = b->n,
                            .dim = ns == 1   ? 1
                                   : ns == 4 ? 2
                                             : 3,
                            .n_strain = ns,
                            .constant = constant,
                            .dt = *o->s.taken > 0 ? o->t - *o->s.t : 0,
                            .strain = o->elastic + first,
                            .temperature = o->constant + TEMPERATURE * m->n_points + b->first,
                            .state0 = o->s.flowed + at * (size_t)(ns + 2),
                            .state = o->flowed + at * (size_t)(ns + 2),
                            .stress = o->stress + first,
                            .tangent = softer ? softer + first * (size_t)ns : NULL,
                            .failed = -1};

    if (b->first < from || b->first >= to) continue;
    for (int j = 0; j < TEMPERATURE; j++) constant[j] = o->constant + j * m->n_points + b->first;
    for (int i = 0; i < b->n * ns; i++)
      o->elastic[first + (size_t)i] =
          o->strain[first + (size_t)i] - (i % ns < 3 ? o->constant[EXPANSION * m->n_points + b->first + i / ns] : 0);
    HycoFlowUpdate(rule_of[b->rule], &p);
    if (p.failed >= 0) return 0;
    for (int i = 0; i < b->n; i++) {
      const double young = constant[0][i], poisson = constant[1][i], *e = p.strain + i * ns,
                   *stress = p.stress + i * ns;
      double *s = o->lost + first + i * ns, most = 0, terms = 0;

      for (int r = 0; r < ns; r++) {
        s[r] = 0;
        for (int c = 0; c < ns; c++) s[r] += elastic_entry(ns, young, poisson, r, c) * e[c];
        terms = fmax(terms, fmax(fabs(s[r]), fabs(stress[r])));
        s[r] -= stress[r];
        most = fmax(most, fabs(s[r]));
      }
      /* Round-off of points that are elastic. */
      for (int r = 0; r < ns && most <= 256 * DBL_EPSILON * terms; r++) s[r] = 0;
      o->size[b->first + i] = terms;
      for (int r = 0; r < ns && softer; r++) {
        double *C = p.tangent + i * ns * ns;

        for (int c = 0; c <= r; c++)
          C[r * ns + c] = C[c * ns + r] = elastic_entry(ns, young, poisson, r, c) - (C[r * ns + c] + C[c * ns + r]) / 2;
      }
    }
  }
  return 1;
}

/* The derivative of the forces by alpha, Z, at the solution of the contacts; with friction on the pieces of its law
   there. */
static void derive_forces(const Model *m, Work *o)
{
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts;

  memset(o->Z, 0, (size_t)m->n_modes * n * sizeof(double));
  SLIP(take_pieces(m, o), (void)0);
  for (int j = 0; j < m->n_modes; j++) {
    const double *P = o->P + (size_t)j * n;
    double *Z = o->Z + (size_t)j * n;

    if (SLIP(derive_pieces(m, o, P, Z), 0)) continue;
    for (int i = 0; i < o->n_closed; i++) o->y[i] = P[o->at[i]];
    memset(o->aside, 0, p * sizeof(double));
    solve_factored(m, o, o->y, o->aside);
    for (int i = 0; i < o->n_closed; i++) Z[o->at[i]] = o->y[i];
  }
}

/* The linear map of the strains at the chosen points: strain_at + slope (alpha - alpha_at). Their terms are the first
   ones. */
static void take_map(const Model *m, Work *o)
{
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts, l = (size_t)m->n_modes, terms = (size_t)m->n_terms;
  const int rows = m->n_chosen * m->n_strain;
  size_t some = 0;

  while (some < terms && m->value[some] < rows) some++;
  derive_forces(m, o);
  memcpy(o->z_at, o->z, (p + n) * sizeof(double));
  memcpy(o->alpha_at, o->alpha, l * sizeof(double));
  memcpy(o->strain_at, o->value, (size_t)rows * sizeof(double));
  memset(o->slope, 0, (size_t)rows * l * sizeof(double));
  for (size_t j = 0; j <= l; j++) { /* the last one: strain_at */
    const double *L = j < l ? o->Z + j * n : o->z + p;

    memset(o->sum, 0, some * sizeof(double));
    for (size_t i = 0; i < n; i++) {
      if (L[i] != 0) add(some, L[i], m->term + (p + i) * terms, o->sum);
    }
    for (size_t k = 0; k < l; k++) {
      if (j == l || k == j) add(some, j < l ? 1 : o->alpha[k], m->term + (p + n + k) * terms, o->sum);
    }
    for (size_t t = 0; t < some; t++) {
      double *to = j < l ? o->slope + (size_t)m->value[t] * l + j : o->strain_at + m->value[t];

      *to += o->f[m->factor[t]] * o->sum[t];
    }
  }
}

/* Whether the contacts' forces are those of the map. */
static int agrees(const Model *m, const Work *o)
{
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts;
  double most = 0, apart = 0;

  for (size_t i = 0; i < n; i++) {
    double mapped = o->z_at[p + i];

    for (size_t j = 0; j < (size_t)m->n_modes; j++) mapped += o->Z[j * n + i] * (o->alpha[j] - o->alpha_at[j]);
    most = fmax(most, fabs(o->z[p + i]));
    apart = fmax(apart, fabs(o->z[p + i] - mapped));
  }
  return apart <= 1e-10 * most;
}

/* o->lack = T^T s - alpha at alpha, its norm, and its tolerance; 0: a law has no solution. */
static int find_lack(const Model *m, Work *o, double *softer, double *norm)
{
  const size_t l = (size_t)m->n_modes, ns = (size_t)m->n_strain;
  double sum[3] = {0, 0, 0}, terms = 0;

  for (size_t j = 0; j < l; j++) {
    o->lack[j] = o->alpha[j] - o->alpha_at[j];
    sum[0] += o->alpha[j] * o->alpha[j];
  }
  for (size_t i = 0; i < (size_t)m->n_chosen * ns; i++)
    o->strain[i] = o->strain_at[i] + dot(l, o->slope + i * l, o->lack);
  if (!evaluate_laws(m, o, 0, m->n_chosen, softer)) return 0;
  memset(o->lack, 0, l * sizeof(double));
  for (size_t i = 0; i < (size_t)m->n_chosen * ns; i++) {
    const double *T = m->T + i * l;

    add(l, o->lost[i], T, o->lack);
    terms += o->size[i / ns] * o->size[i / ns] * dot(l, T, T);
  }
  for (size_t j = 0; j < l; j++) {
    sum[1] += o->lack[j] * o->lack[j];
    o->lack[j] -= o->alpha[j];
    sum[2] += o->lack[j] * o->lack[j];
  }
  *norm = sqrt(sum[2]);
  o->most_lack = fmax(m->newton_rtol * sqrt(fmax(sum[0], sum[1])), 16 * DBL_EPSILON * sqrt(terms));
  return 1;
}

/* Factors K = 1 - T^T (C - C_t) slope. */
static void take_tangent(const Model *m, Work *o)
{
  const size_t l = (size_t)m->n_modes, ns = (size_t)m->n_strain;

  for (size_t i = 0; i < l * l; i++) o->K[i] = i % (l + 1) == 0;
  for (size_t i = 0; i < (size_t)m->n_chosen * ns; i++) {
    memset(o->row_of_K, 0, l * sizeof(double));
    for (size_t c = 0; c < ns; c++) {
      if (o->softer[i * ns + c] != 0) add(l, o->softer[i * ns + c], o->slope + (i / ns * ns + c) * l, o->row_of_K);
    }
    for (size_t k = 0; k < l; k++) {
      if (m->T[i * l + k] != 0) add(l, -m->T[i * l + k], o->row_of_K, o->K + k * l);
    }
  }
  factor_rows(l, o->K, o->pivot_of_K);
}

/* find_lack() with the tangent that is kept, or a new one if there is none, or if it did not reduce what was lacking
   before; always: in any case. */
static int find_lack_or_renew(const Model *m, Work *o, int always, double *norm)
{
  const double before = *norm;

  if (o->has_tangent && !always) {
    if (!find_lack(m, o, NULL, norm)) return 0;
    if (*norm <= 0.2 * before || *norm <= o->most_lack) return 1;
  }
  if (!find_lack(m, o, o->softer, norm)) return 0;
  if (*norm > o->most_lack) take_tangent(m, o);
  o->has_tangent = 1;
  return 1;
}

/* Newton's method on the map. Returns its steps; -1: it does not converge. */
static int find_alpha(const Model *m, Work *o, int always)
{
  const size_t l = (size_t)m->n_modes;
  double norm = HUGE_VAL, before;

  o->has_tangent = 0; /* another map */
  for (int i = 0; i <= m->newton_most; i++) {
    int found;

    before = norm;
    found = find_lack_or_renew(m, o, always, &norm);
    for (int half = 0; half < 6 && always && i && !(found && norm <= before); half++) {
      for (size_t j = 0; j < l; j++) o->alpha[j] -= (o->step[j] /= 2);
      norm = before;
      found = find_lack_or_renew(m, o, always, &norm);
    }
    if (!found || !isfinite(norm)) return -1;
    if (norm <= o->most_lack) return i;
    memcpy(o->step, o->lack, l * sizeof(double));
    solve_rows(l, o->K, o->pivot_of_K, o->step);
    add(l, 1, o->step, o->alpha);
  }
  return -1;
}

/* A step with the tangent that is kept, or (always) one in each iteration. Returns the residual. */
static double search_alpha(const Model *m, Work *o, int always, int *iterations)
{
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_contacts;

  memcpy(o->alpha, o->s.alpha, (size_t)m->n_modes * sizeof(double));
  for (int round = 0; round < 30; round++) {
    double kkt;
    int steps;

    memcpy(o->q, o->q_elastic, (p + n) * sizeof(double));
    for (size_t j = 0; j < (size_t)m->n_modes; j++) add(n, -o->alpha[j], o->P + j * n, o->q + p);
    kkt = SLIP(solve_slip(m, o, round > 0, iterations), solve(m, o, iterations));
    if (!(kkt <= m->tolerance) || (round && agrees(m, o))) return kkt;
    take_map(m, o);
    steps = find_alpha(m, o, always);
    if (steps < 0) break;
    if (!steps) return kkt;
    *iterations += steps;
  }
  return HUGE_VAL;
}

static double solve_flow(const Model *m, Work *o, int *iterations)
{
  double kkt;

  memcpy(o->q_elastic, o->q, (size_t)(m->n_motions + m->n_contacts) * sizeof(double));
  kkt = search_alpha(m, o, 0, iterations);
  o->easy = kkt <= m->tolerance;
  return o->easy ? kkt : search_alpha(m, o, 1, iterations);
}

/* The laws at all points, and what the values lack by them. Returns 0 where a law has no solution, or a point deforms
   too much in the step. */
static int settle(const Model *m, Work *o)
{
  const size_t ns = (size_t)m->n_strain;

  memcpy(o->strain, o->value, (size_t)m->n_points * ns * sizeof(double));
  o->increment = 0;
  if (!evaluate_laws(m, o, 0, m->n_points, NULL)) return 0;
  for (size_t i = 0; i < (size_t)m->n_settled; i++) {
    const double *end = o->flowed + i * (ns + 2) + ns, *begin = o->s.flowed + i * (ns + 2) + ns;

    o->increment = fmax(o->increment, end[0] - begin[0] + (end[1] - begin[1]));
  }
  for (int k = 0; k < m->n_lost; k++) o->value[m->lost_value[k]] -= m->lost_share[k] * o->lost[m->lost_at[k]];
  return *o->s.taken == 0 || o->increment <= m->most_increment;
}
