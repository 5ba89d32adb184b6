/* The problem of the bodies' contacts for gradients: x the rigid motions, L the contact forces; w is the loads' work on
   the motions that contact does not do, with the opposite sign, and the gaps of the displacements under z. */
#include <hycobodies.h>

/* z NULL: the caller wants the sizes alone. */
PetscErrorCode HycoBodiesUnknowns(HycoROM m, PetscInt *p, PetscInt *n, PetscReal z[])
{
  HycoBodiesWork o = (HycoBodiesWork)m->work;

  PetscFunctionBegin;
  *p = o->bodies->p;
  *n = m->model->pairs.n;
  if (!z) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscArraycpy(z, o->x, *p));
  PetscCall(PetscArraycpy(z + *p, m->Lambda, *n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The gaps, and the largest term of one. */
void HycoBodiesGaps(HycoROM m, PetscReal w[], PetscReal *size)
{
  HycoBodiesWork o = (HycoBodiesWork)m->work;

  *size = 0;
  for (PetscInt k = 0; k < m->model->pairs.n; k++) {
    PetscReal bu = 0;

    for (PetscInt j = o->row_start[k]; j < o->row_start[k + 1]; j++) bu += o->row[j] * o->u[o->row_at[j]];
    w[k] = m->rows.gap[k] - bu;
    /* An empty row has no gap: its slave has no master here. */
    if (o->row_start[k] < o->row_start[k + 1])
      *size = PetscMax(*size, PetscMax(PetscAbsReal(bu), PetscAbsReal(m->rows.gap[k])));
  }
}

/* The loads' work against that of the forces. */
void HycoBodiesWorkOnMotions(HycoBodiesWork o, PetscReal w[])
{
  const HycoSubstructures b = o->bodies;

  for (PetscInt i = 0; i < b->p; i++) {
    w[i] = -HycoBodiesLoadWork(o, i);
    for (PetscInt k = 0; k < b->ns; k++) w[i] += o->Z[k * b->p + i] * o->f[k];
  }
}

/* Moves the model to mu and to the forces z, also where no solution is there: finite differences of w by mu. w
   NULL: only the state, for HycoROMOps.expand. In models of bodies that flow their alpha follows in z. */
PetscErrorCode HycoBodiesResidual(HycoROM m, const PetscReal mu[], const PetscReal z[], PetscReal w[], PetscReal *size)
{
  HycoBodiesWork o = (HycoBodiesWork)m->work;
  const HycoSubstructures b = o->bodies;
  const HycoBodiesSurface s = HycoBodiesSurfaceOf(m);

  PetscFunctionBegin;
  if (mu) PetscCall(HycoROMBringRows(m, mu));
  if (mu) PetscCall(HycoBodiesPrepare(o, &s, mu));
  if (mu && b->inelastic && b->inelastic->m) PetscCall(HycoBodiesStrain(o, &s, z + b->p + s.n));
  HycoCheck(!o->lacks, "beside this point, %s", HycoReasonName(HYCO_DIVERGED_SURFACE));
  PetscCall(PetscArraycpy(o->x, z, b->p));
  PetscCall(PetscArraycpy(m->Lambda, z + b->p, m->model->pairs.n));
  /* Displacements follow from forces and motions without a solve, because the flexibility is explicit. */
  HycoBodiesDisplacementsOfForces(o, &s, m->Lambda);
  if (!w) PetscFunctionReturn(PETSC_SUCCESS);
  /* First the motions, then the contacts: the order of the unknowns z. */
  HycoBodiesWorkOnMotions(o, w);
  HycoBodiesGaps(m, w + b->p, size);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At the parameters of the last HycoBodiesResidual(), and only for the k contacts of the active set. */
PetscErrorCode HycoBodiesJacobian(HycoROM m, PetscInt k, const PetscInt contact[], PetscReal M[])
{
  PetscFunctionBegin;
  PetscCall(HycoBodiesMatrix((HycoBodiesWork)m->work, k, contact, M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- derivatives beside a prediction -- */

/* The change of the bodies' data to points beside the prediction's. All that follows from them is differentiated by the
   rules of sums and products: u = (R c - C f) / kappa + Z x is linear in each. */
struct _n_HycoBodiesPerturbed {
  HycoBodiesWork at; /* the data at the last such point */
  PetscInt n_weights, size;
  PetscReal *change[5]; /* by point; 0: sums of them. c, 1 for each body's kappa, 9 for its turn, its weights,
                           Z x, f */
  PetscReal *du;        /* surfaces, then inside */
};

/* The parts of a change. */
typedef struct {
  const PetscReal *c, *kappa, *turn, *weight, *z, *f;
} Parts;

static Parts PartsOf(const HycoBodiesWork o, const PetscReal change[])
{
  const HycoSubstructures b = o->bodies;
  const PetscReal *kappa = change + b->r, *turn = kappa + b->n, *weight = turn + 9 * b->n,
                  *z = weight + o->beside->n_weights;

  return (Parts){change, kappa, turn, weight, z, z + b->ns};
}

/* NULL-safe. */
PetscErrorCode HycoBodiesResetPerturbed(HycoBodiesWork o)
{
  HycoBodiesPerturbed s = o->beside;

  PetscFunctionBegin;
  if (!s) PetscFunctionReturn(PETSC_SUCCESS);
  if (s->at) PetscCall(HycoBodiesReset(s->at));
  for (PetscInt k = 0; k < 5; k++) PetscCall(PetscFree(s->change[k]));
  HycoFreeAll(&s->at, &s->du, &o->beside);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At the first gradient of a model. */
static PetscErrorCode MakePerturbed(HycoROM m, HycoBodiesSurface s)
{
  HycoBodiesWork o = (HycoBodiesWork)m->work;
  const HycoSubstructures b = o->bodies;
  HycoBodiesPerturbed made;

  PetscFunctionBegin;
  if (o->beside) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscNew(&o->beside));
  made = o->beside;
  PetscCall(PetscNew(&made->at));
  for (PetscInt k = 0; k < b->n; k++) made->n_weights += b->body[k].n_samples;
  made->size = b->r + 10 * b->n + made->n_weights + 2 * b->ns;
  for (PetscInt k = 0; k < 5; k++) PetscCall(PetscCalloc1(made->size, &made->change[k]));
  PetscCall(PetscMalloc1(b->ns + b->ni + 1, &made->du));
  /* Room for any number of contacts: gradients differ in theirs. */
  s.n = PetscMax(s.n, m->model->pairs.n);
  PetscCall(HycoBodiesSetUp(made->at, b, m->model->scene, &s, m->solver));
  made->at->fe->keeps_sides = PETSC_TRUE; /* beside a prediction no body turns inside out */
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscBool AnyOf(PetscInt n, const PetscReal v[])
{
  for (PetscInt i = 0; i < n; i++) {
    if (v[i] != 0) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* y += factor times A x, n rows of m. */
static void AddRowProducts(PetscInt n, PetscInt m, const PetscReal A[], const PetscReal x[], PetscReal factor,
                           PetscReal y[])
{
  for (PetscInt i = 0; i < n; i++, A += m) {
    for (PetscInt j = 0; j < m; j++) y[i] += factor * A[j] * x[j];
  }
}

/* The part of a change that the weights of body k have: du += (R' c - C' f) / kappa. */
static PetscErrorCode AddWeighted(HycoBodiesWork o, PetscInt k, const PetscReal weight[], PetscReal du[])
{
  const HycoSubstructures b = o->bodies;
  const HycoSubstructure *own = &b->body[k];
  const PetscInt n = own->n;
  PetscReal *blend, *share, *f;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(n * b->r + 1, &blend, own->C.n_terms + 1, &share, n + 1, &f));
  PetscCall(HycoBodiesBlend(own->n_samples, weight, n * b->r, own->R, blend));
  AddRowProducts(n, b->r, blend, o->c, 1 / o->kappa[k], du);
  HycoFlexibilityShares(&own->C, own->n_samples, weight, share);
  for (PetscInt i = 0; i < n; i++) f[i] = -o->f[b->start[k] + i] / o->kappa[k];
  PetscCall(HycoFlexibilityMultiply(&own->C, share, f, du));
  PetscCall(PetscFree3(blend, share, f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* du[ns]: of the surfaces, at the same x. */
static PetscErrorCode AddDisplacements(HycoBodiesWork o, const Parts *change, PetscReal du[])
{
  const HycoSubstructures b = o->bodies;
  const PetscBool loads = AnyOf(b->r, change->c);
  const PetscReal *weight = change->weight;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < b->n; weight += b->body[k++].n_samples) {
    const PetscInt n = b->body[k].n;
    PetscReal *u = du + b->start[k];

    if (loads) AddRowProducts(n, b->r, o->R[k], change->c, 1 / o->kappa[k], u);
    for (PetscInt i = 0; i < n && change->kappa[k] != 0; i++) {
      PetscReal elastic = o->u[b->start[k] + i];

      for (PetscInt j = 0; j < b->p; j++) elastic -= o->Z[(b->start[k] + i) * b->p + j] * o->x[j];
      u[i] -= elastic * change->kappa[k] / o->kappa[k];
    }
    if (AnyOf(b->body[k].n_samples, weight)) PetscCall(AddWeighted(o, k, weight, u));
  }
  for (PetscInt i = 0; i < b->ns; i++) du[i] += change->z[i];
  PetscCall(HycoBodiesAddCompliance(o, change->f, du));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The change of the data to those of `at`, where the rows are of n contacts. */
static void TakeChange(HycoBodiesWork o, PetscInt n, const PetscInt contact[], PetscBool rows, const PetscReal L[],
                       PetscReal change[])
{
  const HycoSubstructures b = o->bodies;
  const HycoBodiesWork at = o->beside->at;
  PetscReal *to = change;

  for (PetscInt j = 0; j < b->r; j++) *to++ = at->c[j] - o->c[j];
  for (PetscInt k = 0; k < b->n; k++) *to++ = at->kappa[k] - o->kappa[k];
  for (PetscInt k = 0; k < 9 * b->n; k++) *to++ = at->pose[k / 9].Q[k % 9] - o->pose[k / 9].Q[k % 9];
  for (PetscInt k = 0; k < b->n; k++) {
    for (PetscInt j = 0; j < b->body[k].n_samples; j++) *to++ = at->weight[k][j] - o->weight[k][j];
  }
  for (PetscInt i = 0; i < b->ns; i++) {
    *to = 0;
    for (PetscInt j = 0; j < b->p; j++) *to += (at->Z[i * b->p + j] - o->Z[i * b->p + j]) * o->x[j];
    to++;
  }
  for (PetscInt i = 0; i < b->ns; i++) to[i] = 0;
  for (PetscInt k = 0; k < n && rows; k++) {
    if (L[k] == 0) continue;
    for (PetscInt e = at->row_start[k]; e < at->row_start[k + 1]; e++) to[at->row_at[e]] += at->row[e] * L[k];
    for (PetscInt e = o->row_start[contact[k]]; e < o->row_start[contact[k] + 1]; e++)
      to[o->row_at[e]] -= o->row[e] * L[k];
  }
  /* Entries that cancel but for round-off: columns of C are long. */
  for (PetscInt i = 0; i < b->ns; i++) {
    if (PetscAbsReal(to[i]) <= 8 * PETSC_MACHINE_EPSILON * PetscAbsReal(o->f[i])) to[i] = 0;
  }
}

/* In place of HycoBodiesResidual() at mu: w of the change of the data, to the first order. s: at mu, if its rows
   change; gap: by row of o, where they do not. */
PetscErrorCode HycoBodiesNearSurface(HycoROM m, const HycoBodiesSurface *s, const PetscReal gaps[],
                                     const PetscReal mu[], PetscInt n, const PetscInt contact[], PetscBool rows,
                                     const PetscReal z[], PetscInt point, PetscReal w[])
{
  HycoBodiesWork o = (HycoBodiesWork)m->work, at;
  const HycoSubstructures b = o->bodies;
  PetscReal *du;
  Parts change;

  PetscFunctionBegin;
  PetscCall(MakePerturbed(m, *s));
  at = o->beside->at;
  du = o->beside->du;
  PetscCall(HycoBodiesBring(at, rows ? s : NULL, mu));
  /* Without other rows the nodes are where they were. */
  if (!rows) PetscCall(PetscArraycpy(at->Z, o->Z, b->ns * b->p));
  TakeChange(o, n, contact, rows, z + b->p, o->beside->change[point]);
  change = PartsOf(o, o->beside->change[point]);
  PetscCall(PetscArrayzero(du, b->ns));
  PetscCall(AddDisplacements(o, &change, du));
  for (PetscInt i = 0; i < b->p; i++) {
    w[i] = 0;
    for (PetscInt j = 0; j < b->r; j++) w[i] -= at->work[i * b->r + j] * o->c[j] + o->work[i * b->r + j] * change.c[j];
    for (PetscInt k = 0; k < b->ns; k++) w[i] += at->Z[k * b->p + i] * o->f[k] + o->Z[k * b->p + i] * change.f[k];
  }
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt lo = o->row_start[contact[k]], hi = o->row_start[contact[k] + 1];
    PetscReal gap = rows ? at->gap[k] : gaps[contact[k]];

    for (PetscInt e = at->row_start[k]; rows && e < at->row_start[k + 1]; e++) gap -= at->row[e] * o->u[at->row_at[e]];
    for (PetscInt e = lo; e < hi; e++) gap -= o->row[e] * (du[o->row_at[e]] + (rows ? 0 : o->u[o->row_at[e]]));
    w[b->p + k] = gap;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesNear(HycoROM m, const PetscReal mu[], PetscInt n, const PetscInt contact[], PetscBool rows,
                              const PetscReal z[], PetscInt point, PetscReal w[])
{
  HycoBodiesSurface s;

  PetscFunctionBegin;
  if (rows) PetscCall(HycoROMBringRows(m, mu));
  s = HycoBodiesSurfaceOf(m);
  PetscCall(HycoBodiesNearSurface(m, &s, m->rows.gap, mu, n, contact, rows, z, point, w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The derivatives of the fields of body k: of the modes in its turns, and of its unknowns inside. */
static PetscErrorCode ExpandDerivative(HycoBodiesWork o, PetscInt k, const Parts *change, const PetscReal weight[],
                                       const PetscReal dx[], PetscReal dgamma[], PetscReal inside[])
{
  const HycoSubstructures b = o->bodies;
  const HycoSubstructure *own = &b->body[k];
  const PetscInt turns = b->turn_start[k + 1] - b->turn_start[k], n = turns * own->l + own->m;
  const PetscBool weighted = AnyOf(own->n_samples, weight), turned = AnyOf(9, change->turn + 9 * k);
  const PetscReal kappa = o->kappa[k], rate = change->kappa[k] / kappa;
  PetscReal *row, *base, *x, *f, *share;

  PetscFunctionBegin;
  PetscCall(PetscCalloc5(n + 1, &row, n + 1, &base, b->r + b->p + 1, &x, own->n + 1, &f,
                         own->a.n_terms + own->H.n_terms + 1, &share));
  for (PetscInt j = 0; j < b->r; j++) x[j] = (change->c[j] - rate * o->c[j]) / kappa;
  PetscCall(PetscArraycpy(x + b->r, dx, b->p));
  for (PetscInt i = 0; i < own->n; i++) {
    const PetscInt at = b->start[k] + i;

    f[i] = (change->f[at] - rate * o->f[at]) / kappa;
  }
  PetscCall(HycoBodiesAddRows(o, k, o->share_a[k], o->share_H[k], x, f, row));
  if (weighted) {
    for (PetscInt j = 0; j < b->r; j++) x[j] = o->c[j] / kappa;
    PetscCall(PetscArraycpy(x + b->r, o->x, b->p));
    for (PetscInt i = 0; i < own->n; i++) f[i] = o->f[b->start[k] + i] / kappa;
    HycoFlexibilityShares(&own->a, own->n_samples, weight, share);
    HycoFlexibilityShares(&own->H, own->n_samples, weight, share + own->a.n_terms);
    PetscCall(HycoBodiesAddRows(o, k, share, share + own->a.n_terms, x, f, row));
  }
  if (turned) PetscCall(HycoBodiesRows(o, k, n, base));
  for (PetscInt j = 0; j < turns; j++) {
    PetscReal of = 0, slope = 0;

    for (PetscInt d = 0; d < 9; d++) {
      of += b->G[9 * (b->turn_start[k] + j) + d] * o->pose[k].Q[d];
      slope += b->G[9 * (b->turn_start[k] + j) + d] * change->turn[9 * k + d];
    }
    HycoBodiesAdd(own->l, of, row + j * own->l, dgamma + b->mode_start[k]);
    if (turned) HycoBodiesAdd(own->l, slope, base + j * own->l, dgamma + b->mode_start[k]);
  }
  PetscCall(PetscArraycpy(inside + b->inner_start[k], row + turns * own->l, own->m));
  PetscCall(PetscFree5(row, base, x, f, share));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The derivatives of what inelastic strains add to the fields: the bodies that have some do not turn. */
static void AddStrainDerivatives(HycoBodiesWork o, const Parts *change, PetscReal dgamma[])
{
  PetscReal *dalpha;

  PetscCallVoid(PetscMalloc1(o->bodies->inelastic->m + 1, &dalpha));
  for (PetscInt k = 0; k < o->bodies->n; k++) {
    for (PetscInt i = 0; i < o->bodies->inelastic->m; i++)
      dalpha[i] = o->dalpha[i] - change->kappa[k] / o->kappa[k] * o->alpha[i];
    HycoBodiesAddStrainsOf(o, k, dalpha, dgamma);
  }
  PetscCallVoid(PetscFree(dalpha));
}

/* As HycoBodiesMove(): U' = Q u' + Q' u at the nodes with a place, where dofs are wanted; prescribed displacements are
   the caller's. */
static void MoveDerivative(HycoBodiesWork o, const Parts *change, const PetscReal du[], const PetscBool dofs[],
                           PetscReal dU[])
{
  const PetscInt dim = o->bodies->dim;
  PetscInt last = -1;
  PetscBool turns = PETSC_FALSE;

  for (PetscInt k = 0; k < o->n_placed; k++) {
    const PetscInt i = o->placed[k] * dim, *loc = o->loc + i, body = o->placed_in[k];
    const PetscReal *Q = o->pose[body].Q, *turn = change->turn + 9 * body;
    PetscBool any = PETSC_FALSE;

    for (PetscInt c = 0; c < dim; c++) any = (PetscBool)(any || dofs[i + c]);
    if (!any) continue;
    /* Nodes of a body follow each other. */
    if (body != last) turns = AnyOf(9, turn);
    last = body;
    for (PetscInt c = 0; c < dim; c++) {
      PetscReal sum = 0;

      for (PetscInt d = 0; d < dim && loc[c] >= 0; d++) {
        if (loc[d] < 0) continue;
        sum += Q[3 * c + d] * du[loc[d]];
        if (turns) sum += turn[3 * c + d] * o->u[loc[d]];
      }
      if (loc[c] >= 0) dU[i + c] = sum;
    }
  }
}

/* wanted[]: by body, whether a mode is, or a displacement. */
static void FindWanted(HycoBodiesWork o, const PetscBool modes[], const PetscBool dofs[], PetscBool wanted[])
{
  const HycoSubstructures b = o->bodies;

  for (PetscInt k = 0; k < b->n; k++) {
    wanted[k] = PETSC_FALSE;
    for (PetscInt j = b->mode_start[k]; j < b->mode_start[k + 1]; j++) wanted[k] = (PetscBool)(wanted[k] || modes[j]);
  }
  for (PetscInt i = 0; i < o->n_placed; i++) {
    for (PetscInt c = 0; c < b->dim; c++) {
      if (dofs[o->placed[i] * b->dim + c]) wanted[o->placed_in[i]] = PETSC_TRUE;
    }
  }
}

/* The change of the data, the weighted sum of those at two points, with that of the forces. */
static Parts SumChanges(HycoBodiesWork o, PetscInt n, const PetscInt contact[], const PetscReal weight[2],
                        const PetscInt point[2], const PetscReal dz[])
{
  const HycoBodiesPerturbed s = o->beside;
  PetscReal *sum = s->change[0], *f = sum + s->size - o->bodies->ns;

  for (PetscInt i = 0; i < s->size; i++)
    sum[i] = weight[0] * s->change[point[0]][i] + weight[1] * s->change[point[1]][i];
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal force = dz[o->bodies->p + k];

    for (PetscInt e = o->row_start[contact[k]]; e < o->row_start[contact[k] + 1] && force != 0; e++)
      f[o->row_at[e]] += o->row[e] * force;
  }
  return PartsOf(o, sum);
}

PetscErrorCode HycoBodiesCellsDerivatives(HycoBodiesWork o, PetscInt n, const PetscInt contact[],
                                          const PetscReal weight[2], const PetscInt point[2], const PetscReal dz[],
                                          const PetscReal dalpha[], const PetscReal u[], PetscReal du[])
{
  const HycoSubstructures b = o->bodies;
  const HycoBodiesInelastic in = b->inelastic;
  const Parts change = SumChanges(o, n, contact, weight, point, dz);

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(du, in->nd));
  if (AnyOf(b->r, change.c)) AddRowProducts(in->nd, b->r, in->R, change.c, 1, du);
  AddRowProducts(in->nd, b->ns, in->C, change.f, -1, du);
  AddRowProducts(in->nd, in->m, in->A, dalpha, 1, du);
  for (PetscInt i = 0; i < in->nd; i++) {
    const PetscReal *Z = in->Z + i * b->p, kappa = o->kappa[in->body[i]];
    PetscReal elastic = u[i], moved = 0;

    for (PetscInt j = 0; j < b->p; j++) {
      elastic -= Z[j] * o->x[j];
      moved += Z[j] * dz[j];
    }
    du[i] = (du[i] - change.kappa[in->body[i]] * elastic) / kappa + moved;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesDerivatives(HycoROM m, PetscInt n, const PetscInt contact[], const PetscReal weight[2],
                                     const PetscInt point[2], const PetscReal dz[], const PetscBool modes[],
                                     const PetscBool dofs[], PetscReal dgamma[], PetscReal dU[])
{
  HycoBodiesWork o = (HycoBodiesWork)m->work;
  const HycoSubstructures b = o->bodies;
  const HycoBodiesPerturbed s = o->beside;
  const Parts change = SumChanges(o, n, contact, weight, point, dz);
  const PetscReal *of = change.weight;
  PetscReal *du = s->du;
  PetscBool *wanted;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(du, b->ns + b->ni));
  PetscCall(AddDisplacements(o, &change, du));
  AddRowProducts(b->ns, b->p, o->Z, dz, 1, du);
  for (PetscInt k = 0; k < b->n && o->dalpha; k++)
    AddRowProducts(b->body[k].n, b->inelastic->m, b->inelastic->P + b->start[k] * b->inelastic->m, o->dalpha,
                   1 / o->kappa[k], du + b->start[k]);
  PetscCall(PetscArrayzero(dgamma, b->l));
  PetscCall(PetscMalloc1(b->n, &wanted));
  FindWanted(o, modes, dofs, wanted);
  for (PetscInt k = 0; k < b->n; of += b->body[k++].n_samples) {
    if (wanted[k]) PetscCall(ExpandDerivative(o, k, &change, of, dz, dgamma, du + b->ns));
  }
  PetscCall(PetscFree(wanted));
  if (o->dalpha) AddStrainDerivatives(o, &change, dgamma);
  MoveDerivative(o, &change, du, dofs, dU);
  PetscFunctionReturn(PETSC_SUCCESS);
}
