/*
  Radial return for laws of von Mises type (J. C. Simo, T. J. R. Hughes, Computational Inelasticity, 1998, chapter 3,
  for any creep and hardening): with the trial stress q_tr of a step without flow, H = 3 G (1D: H = E),

    q + H dp = q_tr,   dp = dp_creep(q) + dp_plastic,   0 <= dp_plastic complementary to Y(p + dp_plastic) - q >= 0

  by Newton's method with a bracket. The points are independent: a batch gives the same bits as each of its points
  alone.
*/
#include <hycoflow.h>

/* -- begin: in exported models too -- */
#define ITERATIONS 500  /* every eighth is a bisection: ten times more than any bracket needs */
#define BLOCK      32   /* points evaluated together */
#define CLOSE      1e-8 /* of the unknown, Newton's last step: the error is of the order of its square, eps */

/* The bracket [lo, hi] of a root, and the next iterate: `newton`, unless it leaves the bracket or a bisection is
   due. Returns whether the iteration has converged. */
typedef struct {
  PetscReal lo, hi;
  PetscInt iterations;
} Bracket;

/* Every eighth step is a bisection, so that no law, however stiff, can stall the iteration. */
static PetscBool FlowAdvance(Bracket *b, PetscReal newton, PetscReal *q)
{
  const PetscReal old = *q;
  const PetscBool inside = (PetscBool)(newton > b->lo && newton < b->hi);

  /* The end of a bracket is allowed here: a root at the yield stress or at q_tr is one. */
  if (newton >= b->lo && newton <= b->hi && PetscAbsReal(newton - old) <= CLOSE * old) {
    *q = newton;
    return PETSC_TRUE;
  }
  *q = inside && ++b->iterations % 8 ? newton : b->lo + (b->hi - b->lo) / 2;
  /* The midpoint equals an end when no number is left between them. */
  return (PetscBool)(*q == b->lo || *q == b->hi || b->iterations > ITERATIONS);
}

/* State of a point: its trial state, and the iteration for the equivalent stress under creep alone. */
typedef struct {
  HycoFlowPoint p;
  PetscReal H, trial, pressure, s[6]; /* trial: q_tr; s: the trial stress's deviator (1D: the stress) */
  PetscReal q, creep, slope;          /* creep strain of the step at q, and its derivative */
  Bracket b;
  PetscBool done;
} Radial;

/* The first iterate: q_tr, or, if creep there is too fast, a step towards the root of the tangent power law. Under
   strong creep q_tr is far from the root, and Newton's method from there takes many steps. */
static void StartCreep(const HycoFlowRule *rule, Radial *w)
{
  const PetscReal trial = w->trial;

  w->q = trial;
  w->creep = w->slope = 0;
  /* Without creep q_tr is final here; yielding, if the law yields, is applied by the end of the step. */
  w->done = PETSC_TRUE;
  if (!rule->creep || !(w->p.dt > 0) || !(trial > 0)) return;
  w->creep = (*rule->creep)(&w->p, trial, &w->slope);
  if (!(w->creep > 0)) return;
  w->done = PETSC_FALSE;
  /* The root lies between 0 and q_tr, since creep only relaxes: Newton's iterates are kept in this interval. */
  w->b.lo = 0;
  w->b.hi = trial;
  w->b.iterations = 0;
  if (w->H * w->creep > trial) {
    /* The law's exponent at q_tr, and the root of H creep = q_tr of a power law of that exponent; the last line is one
       more step, for q + H creep(q) = q_tr. */
    const PetscReal power = trial * w->slope / w->creep;
    const PetscReal guess = trial * PetscPowReal(trial / (w->H * w->creep), 1 / power);

    w->q = guess > 0 && guess < trial ? guess * (1 - guess / (guess + power * trial)) : trial / 2;
    w->creep = (*rule->creep)(&w->p, w->q, &w->slope);
  }
}

/* An iteration for q + H creep(q) = q_tr, on the logarithms of H creep and q_tr - q where creep dominates: a power
   law is nearly linear there. After the last iteration creep is updated along its tangent, and the slope along a
   power law: the remaining error is of second order in the step. */
static void IterateCreep(const HycoFlowRule *rule, Radial *w)
{
  const PetscReal old = w->q, rest = w->trial - old, excess = w->H * w->creep - rest;
  PetscReal newton = old - excess / (1 + w->H * w->slope);

  if (w->H * w->slope > 1 && rest > 0)
    newton = old - PetscLogReal(w->H * w->creep / rest) / (w->slope / w->creep + 1 / rest); /* NaN if creep overflows */
  /* The function rises in q: its sign says on which side of the root q is, whatever Newton's step does. */
  if (excess < 0)
    w->b.lo = old;
  else if (excess == 0) {
    w->done = PETSC_TRUE;
    return;
  } else
    w->b.hi = old;
  w->done = FlowAdvance(&w->b, newton, &w->q);
  /* Only after a step of Newton's: after a bisection the tangent at the old q says nothing about the new one. */
  if (w->done && w->q == newton) {
    const PetscReal power = old * w->slope / w->creep, change = (w->q - old) / old;

    w->creep += w->slope * (w->q - old);
    w->slope *= 1 + (power - 1) * change;
  } else
    w->creep = (*rule->creep)(&w->p, w->q, &w->slope);
}

/* Result of a step at a point. */
typedef struct {
  PetscReal q, creep, plastic; /* equivalent stress; equivalent strains of the step */
  PetscReal slope;             /* derivative of creep + plastic by q_tr */
} Flow;

/* Solves q = Y(plastic0 + (q_tr - q) / H - creep(q)) between the yield stress before the step and f->q, the solution
   for creep alone. Creep and yielding together: q is the only unknown, since plastic flow follows from the trial
   stress. */
static PetscReal SolveYield(const HycoFlowRule *rule, const Radial *w, PetscReal yield, Flow *f, PetscReal *slope,
                            PetscReal *hardening)
{
  Bracket b = {yield, f->q, 0};
  PetscReal q = yield;
  PetscBool done = PETSC_FALSE;

  for (;;) {
    PetscReal excess;

    if (rule->creep) f->creep = (*rule->creep)(&w->p, q, slope);
    f->plastic = PetscMax((w->trial - q) / w->H - f->creep, 0);
    excess = q - (*rule->yield)(&w->p, w->p.plastic0 + f->plastic, hardening);
    /* After the last iterate the flow is evaluated once more, so that strain and stress belong to the same q. */
    if (done || excess == 0) return q;
    if (excess > 0)
      b.hi = q;
    else
      b.lo = q;
    done = FlowAdvance(&b, q - excess / (1 + *hardening * (1 / w->H + *slope)), &q);
  }
}

/* The flow of a point after the solution for creep alone. Slope: derivative of the flow by q_tr, for the consistent
   tangent. */
static Flow FlowSolve(const HycoFlowRule *rule, const Radial *w)
{
  Flow f = {w->q, w->creep, 0, 0};
  PetscReal slope = w->slope, hardening = 0, yield = -1;

  /* No deviator has no direction of flow; negated, so that NaN ends here too and is reported by its stress. */
  if (!(w->trial > 0)) return f;
  if (rule->yield) yield = (*rule->yield)(&w->p, w->p.plastic0, &hardening);
  /* Plastic flow only where the stress under creep alone exceeds the yield stress; a negative one means that the law
     has none. */
  if (yield >= 0 && f.q > yield) {
    f.q = SolveYield(rule, w, yield, &f, &slope, &hardening);
    /* The derivative of the two equations for q and dp by q_tr, with q eliminated. */
    f.slope = 1 / (w->H + hardening / (1 + slope * hardening));
  } else
    f.slope = slope / (1 + w->H * slope);
  return f;
}

/* Trial stress without flow, deviator first: returns q_tr; s[n_strain]: the deviator, *pressure: the mean. Shear
   strains are engineering ones (twice the tensor's), hence G and the factor 2 in the sum. */
static PetscReal FlowTrial(PetscInt ns, PetscReal G, PetscReal bulk, const PetscReal elastic[], PetscReal s[],
                           PetscReal *pressure)
{
  const PetscReal trace = elastic[0] + elastic[1] + elastic[2];
  PetscReal sum = 0;

  *pressure = bulk * trace;
  /* In 2D there is an out-of-plane component as well: the first three are always the normal ones. */
  for (PetscInt c = 0; c < 3; c++) {
    s[c] = 2 * G * (elastic[c] - trace / 3);
    sum += s[c] * s[c];
  }
  for (PetscInt c = 3; c < ns; c++) {
    s[c] = G * elastic[c];
    sum += 2 * s[c] * s[c];
  }
  return PetscSqrtReal(1.5 * sum);
}

/* C - 6 G^2 r I_dev - 4 G^2 (slope - r) N N with r = dp / q_tr, N = 3/2 s / q. The consistent tangent: quadratic
   convergence of Newton's method needs the derivative of the algorithm, not that of the rate law. */
static void FlowTangent(PetscInt ns, PetscReal G, PetscReal bulk, PetscReal slope, PetscReal r, const PetscReal N[],
                        PetscReal C[])
{
  const PetscReal shear = G - 3 * G * G * r, normal = bulk - 2 * shear / 3, along = 4 * G * G * (slope - r);

  for (PetscInt a = 0; a < ns; a++) {
    for (PetscInt b = 0; b < ns; b++) C[a * ns + b] = -along * N[a] * N[b];
    C[a * ns + a] += a < 3 ? 2 * shear : shear;
  }
  for (PetscInt a = 0; a < 3; a++) {
    for (PetscInt b = 0; b < 3; b++) C[a * ns + b] += normal;
  }
}

/* A point's energies: elastic, dissipated, and the potential, which is elastic plus that of the flow at this stress.
   The dissipation is the trapezoidal rule of stress times inelastic strain; the potential exists if the rule's
   integrals do. */
static void FlowEnergies(const HycoFlowRule *rule, const HycoFlowPoint *p, HycoMaterialPoints *m, PetscInt i,
                         const Flow *f, PetscReal elastic)
{
  const PetscInt ns = m->n_strain, n_state = ns + 2;
  PetscReal sum = 0;

  m->stored[i] = elastic;
  /* The equivalent inelastic strain of the step, by which the size of steps is chosen. */
  if (m->increment) m->increment[i] = f->creep + f->plastic;
  for (PetscInt c = 0; m->dissipated && c < ns; c++)
    sum +=
        (m->stress0[i * ns + c] + m->stress[i * ns + c]) / 2 * (m->state[i * n_state + c] - m->state0[i * n_state + c]);
  if (m->dissipated) m->dissipated[i] = sum;
  if (!m->potential || (rule->creep && !rule->creep_integral)) return;
  m->potential[i] = elastic;
  if (f->creep > 0) m->potential[i] += f->q * f->creep - (*rule->creep_integral)(p, f->q);
  if (f->plastic > 0) m->potential[i] += (*rule->yield_integral)(p, f->plastic);
}

/* The trial state of point i. State: inelastic strain, accumulated creep, accumulated plastic strain. Constants 0
   and 1 are Young's modulus and Poisson's ratio; in 1D the stress alone counts. */
static void FlowBegin(const HycoMaterialPoints *m, PetscInt i, Radial *w)
{
  const PetscInt ns = m->n_strain;
  const PetscReal young = m->constant[0][i], poisson = m->constant[1][i], G = young / (2 * (1 + poisson));
  const PetscReal *strain = m->strain + i * ns, *state0 = m->state0 + i * (ns + 2);
  PetscReal elastic[6];

  /* As if nothing flowed in this step; what flows then lowers the stress along the trial deviator. */
  for (PetscInt c = 0; c < ns; c++) elastic[c] = strain[c] - state0[c];
  /* How much the equivalent stress falls per equivalent inelastic strain: the flow direction is that of the trial
     stress (radial return, Wilkins 1964). */
  w->H = ns == 1 ? young : 3 * G;
  if (ns == 1) {
    w->s[0] = young * elastic[0];
    w->trial = PetscAbsReal(w->s[0]);
    w->pressure = 0;
  } else
    w->trial = FlowTrial(ns, G, young / (3 * (1 - 2 * poisson)), elastic, w->s, &w->pressure);
}

/* Sets point i at the end of the step. Stress, state and tangent from the equivalent stress, radially along the
   trial deviator. */
static void FlowFinish(const HycoFlowRule *rule, HycoMaterialPoints *m, PetscInt i, const Radial *w)
{
  const PetscInt ns = m->n_strain;
  const PetscReal young = m->constant[0][i], poisson = m->constant[1][i], *strain = m->strain + i * ns;
  const PetscReal *state0 = m->state0 + i * (ns + 2);
  const Flow f = FlowSolve(rule, w);
  /* 3/2 s/q_tr is the flow direction of von Mises; in 1D the sign of the stress. Without a trial stress there is no
     direction, and nothing flows. */
  const PetscReal dp = f.creep + f.plastic, unit = w->trial > 0 ? (ns == 1 ? 1.0 : 1.5) / w->trial : 0;
  const PetscReal left = w->trial > 0 ? f.q / w->trial : 0;
  PetscReal *state = m->state + i * (ns + 2), *stress = m->stress + i * ns, N[6], energy = 0;

  for (PetscInt c = 0; c < ns; c++) {
    N[c] = unit * w->s[c];
    /* Shear strains of the state are engineering ones, like the strains: twice the tensor's. */
    state[c] = state0[c] + (c < 3 ? dp : 2 * dp) * N[c];
    stress[c] = left * w->s[c] + (c < 3 ? w->pressure : 0);
    energy += stress[c] * (strain[c] - state[c]) / 2;
  }
  state[ns] = state0[ns] + f.creep;
  state[ns + 1] = state0[ns + 1] + f.plastic;
  if (m->tangent && ns == 1) m->tangent[i] = young - young * young * f.slope;
  /* At rest dp / q_tr has the limit of the slope, so that the tangent is continuous there. */
  else if (m->tangent)
    FlowTangent(ns, young / (2 * (1 + poisson)), young / (3 * (1 - 2 * poisson)), f.slope,
                w->trial > 0 ? dp / w->trial : f.slope, N, m->tangent + i * ns * ns);
  if (m->stored) FlowEnergies(rule, &w->p, m, i, &f, energy);
}

/* The data of point i. */
static void FlowPointLocal(const HycoFlowRule *rule, const HycoMaterialPoints *m, PetscInt i, HycoFlowPoint *p)
{
  const PetscReal *accumulated = m->state0 + i * (m->n_strain + 2) + m->n_strain;

  for (PetscInt j = 0; j < rule->n_constants; j++) p->c[j] = m->constant[2 + j][i];
  p->dt = m->dt;
  p->temperature = m->temperature ? m->temperature[i] : 0;
  p->creep0 = accumulated[0];
  p->plastic0 = accumulated[1];
}

/* Evaluates the law at n points from `first`: the iterations of different points are interleaved, so that the
   processor does not wait for one logarithm after the other. The first failure of the batch is reported, with its
   reason. */
static void UpdateBlock(const HycoFlowRule *rule, HycoMaterialPoints *m, PetscInt first, PetscInt n)
{
  const PetscInt ns = m->n_strain;
  Radial work[BLOCK];
  PetscInt left = 0, active[BLOCK];

  for (PetscInt k = 0; k < n; k++) {
    const PetscInt i = first + k;
    Radial *w = &work[k];
    const char *why = NULL;

    FlowPointLocal(rule, m, i, &w->p);
    if (rule->prepare) (*rule->prepare)(&w->p, &why);
    if (why && m->failed < 0) {
      m->failed = i;
      m->why = why;
    }
    FlowBegin(m, i, w);
  }
  for (PetscInt k = 0; k < n; k++) {
    /* The points that iterate are kept in a dense list: those that are done cost nothing. */
    StartCreep(rule, &work[k]);
    if (!work[k].done) active[left++] = k;
  }
  while (left) {
    PetscInt still = 0;

    for (PetscInt k = 0; k < left; k++) {
      IterateCreep(rule, &work[active[k]]);
      if (!work[active[k]].done) active[still++] = active[k];
    }
    left = still;
  }
  for (PetscInt k = 0; k < n; k++) {
    FlowFinish(rule, m, first + k, &work[k]);
    /* Any component of a stress that is not finite has made all of them so: the first is enough. The comparison also
       fails for NaN. */
    if (m->failed >= 0 || PetscAbsReal(m->stress[(first + k) * ns]) < PETSC_INFINITY) continue;
    m->failed = first + k;
    m->why = "the stress is not finite";
  }
}

/* Blocks bound the stack, and keep the interleaved points in cache. */
void HycoFlowUpdate(const HycoFlowRule *rule, HycoMaterialPoints *m)
{
  for (PetscInt i = 0; i < m->n; i += BLOCK) UpdateBlock(rule, m, i, PetscMin(BLOCK, m->n - i));
}
/* -- end: in exported models too -- */

static PetscErrorCode FlowUpdate(HycoMaterial material, HycoMaterialPoints *m)
{
  PetscFunctionBegin;
  HycoFlowUpdate((const HycoFlowRule *)material->data, m);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- derivatives of a step -- */

/* Step of the differences of a rule's functions as a share of their data: the cube root of eps, 6e-6, where the errors
   of truncation and round-off of a central difference are alike. */
#define DIFFERENCE_STEP 3e-6
/* Stress in place of 0, at which a rule's logarithm exists: any that no power of it underflows. */
#define AT_REST 1e-150
/* Of the yield stress: ten times the error of the flow's unknown; nearer to it, yielding is undecided and a derivative
   is one-sided. */
#define YIELD_BORDER 1e-8

/* How far a direction of change goes for DIFFERENCE_STEP of the data, from what it has gone so far. */
static void FlowStepLength(PetscReal value, PetscReal change, PetscReal *reach)
{
  const PetscReal own = value != 0 ? PetscAbsReal(value) : 1;

  if (change != 0) *reach = PetscMin(*reach, DIFFERENCE_STEP * own / PetscAbsReal(change));
}

/* The derivatives of the creep strain at the stress q, and of the yield stress at the plastic strain x, by the data
   alone. */
static void ByData(const HycoFlowRule *rule, const HycoFlowPoint *p, const HycoMaterialDerivative *d, PetscInt i,
                   PetscReal creep0, PetscReal q, PetscReal x, PetscReal *creep, PetscReal *yield)
{
  HycoFlowPoint change = {.temperature = d->constant && d->temperature ? d->temperature[i] : 0,
                          .creep0 = rule->hardens ? creep0 : 0};
  PetscReal reach = PETSC_MAX_REAL, value[2][2] = {{0, 0}, {0, 0}}, slope;

  *creep = *yield = 0;
  if (!d->constant && !rule->hardens) return;
  for (PetscInt j = 0; j < rule->n_constants && d->constant; j++) {
    change.c[j] = d->constant[2 + j][i];
    FlowStepLength(p->c[j], change.c[j], &reach);
  }
  FlowStepLength(p->temperature, change.temperature, &reach);
  FlowStepLength(p->creep0, change.creep0, &reach);
  if (reach == PETSC_MAX_REAL) return;
  for (int side = 0; side < 2; side++) {
    const PetscReal step = side ? reach : -reach;
    HycoFlowPoint at = *p;
    const char *why = NULL;

    for (PetscInt j = 0; j < rule->n_constants; j++) at.c[j] += step * change.c[j];
    at.temperature += step * change.temperature;
    at.creep0 += step * change.creep0;
    if (rule->prepare) (*rule->prepare)(&at, &why);
    if (rule->creep && p->dt > 0 && q > 0) value[side][0] = (*rule->creep)(&at, q, &slope);
    if (rule->yield) value[side][1] = (*rule->yield)(&at, x, &slope);
  }
  *creep = (value[1][0] - value[0][0]) / (2 * reach);
  *yield = (value[1][1] - value[0][1]) / (2 * reach);
}

/* A point's solved step: with the flow's equations at it. */
typedef struct {
  Radial w;
  PetscReal creep, plastic, q, slope, yield, hardening, G, bulk; /* slope: of creep by q; yield < 0: none */
  PetscBool yields;                                              /* the equations are those of yielding */
} Solved;

/* As the step has decided: on the border, where the plastic strain is round-off, by the solution for creep alone
   again. */
static PetscBool FlowIsYielding(const HycoFlowRule *rule, Solved *s)
{
  PetscReal before, hardening;
  Radial w = s->w;

  if (!rule->yield || !(w.trial > 0)) return PETSC_FALSE;
  before = (*rule->yield)(&w.p, w.p.plastic0, &hardening);
  if (before < 0 || s->plastic > 0 || s->q < (1 - YIELD_BORDER) * before)
    return (PetscBool)(before >= 0 && s->plastic > 0);
  StartCreep(rule, &w);
  while (!w.done) IterateCreep(rule, &w);
  return (PetscBool)(w.q > before);
}

static void TakeSolved(const HycoFlowRule *rule, const HycoMaterialPoints *m, PetscInt i, Solved *s)
{
  const PetscInt ns = m->n_strain;
  const PetscReal young = m->constant[0][i], poisson = m->constant[1][i], *state0 = m->state0 + i * (ns + 2),
                  *state = m->state + i * (ns + 2);
  const char *why = NULL;

  FlowPointLocal(rule, m, i, &s->w.p);
  if (rule->prepare) (*rule->prepare)(&s->w.p, &why);
  FlowBegin(m, i, &s->w);
  s->G = young / (2 * (1 + poisson));
  s->bulk = young / (3 * (1 - 2 * poisson));
  s->creep = state[ns] - state0[ns];
  s->plastic = state[ns + 1] - state0[ns + 1];
  s->q = s->w.trial - s->w.H * (s->creep + s->plastic);
  s->slope = s->hardening = 0;
  s->yield = -1;
  /* At rest: whether creep begins in proportion to the stress. */
  if (rule->creep && s->w.p.dt > 0) (void)(*rule->creep)(&s->w.p, s->w.trial > 0 ? s->q : AT_REST, &s->slope);
  if (rule->yield) s->yield = (*rule->yield)(&s->w.p, state[ns + 1], &s->hardening);
  s->yields = FlowIsYielding(rule, s);
}

/* Shear and bulk modulus, Young's modulus and the factor H of flow, with their changes along a direction. */
typedef struct {
  PetscReal young, dyoung, G, dG, bulk, dbulk, H, dH;
} Moduli;

static void FlowModuli(const HycoMaterialPoints *m, PetscInt i, const Solved *s, const HycoMaterialDerivative *d,
                       Moduli *E)
{
  const PetscReal poisson = m->constant[1][i], dpoisson = d->constant ? d->constant[1][i] : 0;

  E->young = m->constant[0][i];
  E->dyoung = d->constant ? d->constant[0][i] : 0;
  E->G = s->G;
  E->bulk = s->bulk;
  E->dG = s->G * (E->dyoung / E->young - dpoisson / (1 + poisson));
  E->dbulk = s->bulk * (E->dyoung / E->young + 2 * dpoisson / (1 - 2 * poisson));
  E->H = s->w.H;
  E->dH = m->n_strain == 1 ? E->dyoung : 3 * E->dG;
}

/* d (C e) = C de + dC e, of a strain e and its change: its deviator, to which the part of the traces is added. */
static PetscReal FlowStressChange(const Moduli *E, PetscInt ns, PetscInt c, const PetscReal e[], const PetscReal de[],
                                  PetscReal *deviator)
{
  const PetscReal stiff = ns == 1 ? E->young : (c < 3 ? 2 : 1) * E->G,
                  more = ns == 1 ? E->dyoung : (c < 3 ? 2 : 1) * E->dG;
  const PetscReal mean = ns > 1 && c < 3 ? 1.0 / 3 : 0;
  PetscReal trace = 0, dtrace = 0;

  for (PetscInt k = 0; k < 3 && ns > 1; k++) {
    trace += e[k];
    dtrace += de[k];
  }
  *deviator = stiff * (de[c] - mean * dtrace) + more * (e[c] - mean * trace);
  return *deviator + (mean > 0 ? E->bulk * dtrace + E->dbulk * trace : 0);
}

/* The rates of flow along d, and how far its two sides are apart; trial: the change of the trial stress. */
static void FlowRates(const HycoFlowRule *rule, const HycoMaterialPoints *m, PetscInt i, const Solved *s,
                      const Moduli *E, PetscReal trial, HycoMaterialDerivative *d, PetscReal *creep, PetscReal *plastic)
{
  const PetscInt ns = m->n_strain;
  const PetscReal *dstate0 = d->state0 + i * (ns + 2), H = E->H, flows = (s->creep + s->plastic) * E->dH;
  PetscReal by_creep, by_yield, dq;

  *plastic = 0;
  ByData(rule, &s->w.p, d, i, dstate0[ns], s->q, m->state[i * (ns + 2) + ns + 1], &by_creep, &by_yield);
  if (s->yields) {
    dq = s->hardening * (dstate0[ns + 1] + (trial - flows) / H - by_creep) + by_yield;
    dq /= 1 + s->hardening * (1 / H + s->slope);
    *creep = s->slope * dq + by_creep;
    *plastic = (trial - flows - dq) / H - *creep;
  } else {
    dq = (trial - H * by_creep - flows) / (1 + H * s->slope);
    *creep = s->slope * dq + by_creep;
  }
  d->rate = PetscMax(d->rate, PetscMax(PetscAbsReal(trial), PetscAbsReal(dq)));
  /* On the yield surface the point stays there, or its derivatives differ between the two sides. */
  if (s->yields && H * s->plastic <= YIELD_BORDER * s->yield)
    d->apart = PetscMax(d->apart, H * PetscAbsReal(*plastic));
  else if (!s->yields && s->yield >= 0 && s->q >= (1 - YIELD_BORDER) * s->yield)
    d->apart = PetscMax(d->apart, PetscAbsReal(dq - s->hardening * dstate0[ns + 1] - by_yield));
}

/* Along direction d: the derivatives of q + H (creep + plastic) = q_tr, and of q = Y where plastic strain flows. */
static void FlowDerivative(const HycoFlowRule *rule, const HycoMaterialPoints *m, PetscInt i, const Solved *s,
                           HycoMaterialDerivative *d)
{
  const PetscInt ns = m->n_strain, at = i * ns, at_state = i * (ns + 2);
  const PetscReal *strain = m->strain + at, *dstrain = d->strain + at, *state0 = m->state0 + at_state,
                  *dstate0 = d->state0 + at_state, dp = s->creep + s->plastic, *stress_s = s->w.s;
  PetscReal *state = d->state + at_state, *stress = d->stress + at, *lost = d->lost + at;
  PetscReal dev[6], e[6], de[6], trial = 0, creep, plastic, unit;
  Moduli E;

  FlowModuli(m, i, s, d, &E);
  for (PetscInt c = 0; c < ns; c++) {
    e[c] = strain[c] - state0[c];
    de[c] = dstrain[c] - dstate0[c];
  }
  for (PetscInt c = 0; c < ns; c++) {
    /* The deviator's change; in 1D the stress's. lost: were the strain elastic. */
    (void)FlowStressChange(&E, ns, c, e, de, &dev[c]);
    lost[c] = FlowStressChange(&E, ns, c, strain, dstrain, &unit);
    trial += (c < 3 ? 1 : 2) * stress_s[c] * dev[c];
    /* Without a trial stress nothing flows, and q has no direction. */
    if (!(s->w.trial > 0) && s->slope > 0) d->apart = PetscMax(d->apart, PetscAbsReal(dev[c]));
  }
  unit = s->w.trial > 0 ? (ns == 1 ? 1.0 : 1.5) / s->w.trial : 0;
  trial = s->w.trial > 0 ? (ns == 1 ? 1 : 1.5) * trial / s->w.trial : 0;
  FlowRates(rule, m, i, s, &E, trial, d, &creep, &plastic);
  for (PetscInt c = 0; c < ns; c++) {
    /* d (dp N) = d dp N + dp dN, N = 3/2 s / q_tr; in 1D N is a sign. */
    const PetscReal N = unit * stress_s[c], twice = c < 3 ? 1 : 2;

    state[c] = dstate0[c] + twice * ((creep + plastic) * N);
    if (ns > 1 && s->w.trial > 0) state[c] += twice * (dp * unit) * (dev[c] - stress_s[c] * trial / s->w.trial);
  }
  state[ns] = dstate0[ns] + creep;
  state[ns + 1] = dstate0[ns + 1] + plastic;
  for (PetscInt c = 0; c < ns; c++) {
    /* C and its change times the inelastic strain. */
    const PetscReal inelastic = FlowStressChange(&E, ns, c, m->state + at_state, state, &unit);

    stress[c] = lost[c] - inelastic;
    lost[c] = inelastic;
  }
}

/* A HycoMaterialDerivatives. */
static PetscErrorCode FlowDerivatives(HycoMaterial material, const HycoMaterialPoints *m, PetscBool fresh, void *solved,
                                      HycoMaterialDerivative *d)
{
  const HycoFlowRule *rule = (const HycoFlowRule *)material->data;
  Solved *s = (Solved *)solved;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < m->n; i++) {
    if (fresh) TakeSolved(rule, m, i, &s[i]);
    FlowDerivative(rule, m, i, &s[i], d);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* State names are those of the outputs. */
static PetscErrorCode SetUp(HycoMaterial material, PetscInt dim)
{
  static const char *const component[] = {"xx", "yy", "zz", "xy", "yz", "xz"};
  const PetscInt ns = HycoStrainSize(dim);
  char text[6][32];
  const char *name[8];

  PetscFunctionBegin;
  for (PetscInt c = 0; c < ns; c++) {
    PetscCall(PetscSNPrintf(text[c], sizeof(text[c]), "inelastic_%s", component[c]));
    name[c] = text[c];
  }
  /* After the tensor, as FlowBegin() and the update read them. */
  name[ns] = "creep_strain";
  name[ns + 1] = "plastic_strain";
  PetscCall(HycoMaterialSetStateNames(material, ns + 2, name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The elastic part depends on young and poisson. */
static PetscBool FlowDepends(HycoMaterial material, const PetscBool changed[])
{
  (void)material;
  return (PetscBool)(changed[0] || changed[1]);
}

/* rule: static data of the law, kept by reference. */
PetscErrorCode HycoFlowEnd(HycoMaterial material, const HycoFlowRule *rule)
{
  static const struct _HycoMaterialOps ops = {
      .setup = SetUp, .update = FlowUpdate, .isotropic = HycoElasticLame, .depends = FlowDepends};

  PetscFunctionBegin;
  PetscCall(HycoMaterialSetLinear(material, PETSC_FALSE));
  material->data = (void *)(uintptr_t)rule;
  material->slopes = FlowDerivatives;
  material->solved_size = sizeof(Solved);
  PetscCall(HycoMaterialSetOps(material, &ops));
  PetscFunctionReturn(PETSC_SUCCESS);
}
