/*
  The contact problem of bodies as substructures. At mu: where each body is and how stiff (from one of its cells), the
  loads (from the cells at r unknowns), the surfaces' displacements without contact, the gaps they leave. The
  complementarity problem is that of the contacts that these displacements close; those that its solution closes
  beside them join it. With bodies that contact alone holds it has all contacts from the beginning.
*/
#include <hycobodies.h>
#include <hycotao.h>

#define ROUNDS 60    /* of joining contacts */
#define CLOSED 1e-13 /* share of the largest gap: smaller penetrations are round-off */

PetscErrorCode HycoBodiesCreate(HycoSubstructures *bodies)
{
  PetscFunctionBegin;
  PetscCall(PetscNew(bodies));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesReset(HycoSubstructures b)
{
  PetscFunctionBegin;
  if (!b) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoFEDestroy(&b->fe));
  PetscCall(HycoTaoDestroy(&b->tao));
  for (PetscInt k = 0; b->body && k < b->n; k++) PetscCall(PetscFree(b->body[k].w));
  HycoFreeAll(&b->X0, &b->E0, &b->E_at, &b->pose, &b->kappa, &b->c, &b->free, &b->u, &b->f, &b->x, &b->loc,
              &b->row_start, &b->row_at, &b->row, &b->w, &b->active, &b->Z, &b->work);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesBorrow(HycoSubstructures bodies, HycoSubstructures copy)
{
  PetscFunctionBegin;
  *copy = *bodies;
  HycoDuplicate(bodies->n, bodies->body, &copy->body);
  for (PetscInt k = 0; k < copy->n; k++) copy->body[k].w = NULL;
  copy->fe = NULL;
  copy->tao = NULL;
  copy->X0 = copy->E0 = copy->kappa = copy->c = copy->free = copy->u = copy->f = copy->x = copy->Z = copy->work = NULL;
  copy->row = copy->w = NULL;
  copy->E_at = copy->loc = copy->row_start = copy->row_at = NULL;
  copy->pose = NULL;
  copy->active = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesDestroy(HycoSubstructures *bodies)
{
  HycoSubstructures b = *bodies;

  PetscFunctionBegin;
  if (!b) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoBodiesReset(b));
  PetscCall(HycoMeshDestroy(&b->probe));
  for (PetscInt k = 0; b->body && k < b->n; k++) {
    HycoSubstructure *s = &b->body[k];

    HycoFreeAll(&s->C, &s->R, &s->Z, &s->work, &s->H, &s->a, &s->g, &s->gram, &s->w);
  }
  HycoFreeAll(&b->first, &b->theta, &b->logarithm, &b->n_nodes, &b->node, &b->body, &b->start, &b->dof, &b->inner_start,
              &b->inner, &b->cell, &b->at, &b->at_body, &b->A, &b->mode_start, &b->turn_start, &b->G);
  PetscCall(PetscFree(*bodies));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- theta -- */

void HycoBodiesSetTensors(HycoSubstructures b)
{
  for (PetscInt k = 0; k < b->n; k++) {
    HycoTensor *t = &b->body[k].tensor;
    const PetscReal *node = b->node;

    t->dim = b->n_theta;
    for (PetscInt p = 0; p < b->n_theta; p++) {
      t->x[p] = node;
      t->degree[p] = t->n[p] - 1;
      node += b->n_nodes[p];
    }
    b->body[k].n_samples = HycoTensorSize(t);
  }
}

void HycoBodiesReference(HycoSubstructures b, const PetscReal mu[], PetscReal reference[])
{
  for (PetscInt p = 0; p < b->n_parameters; p++) reference[p] = b->first[p];
  for (PetscInt p = 0; p < b->n_theta; p++) reference[b->theta[p]] = mu[b->theta[p]];
}

PetscErrorCode HycoBodiesWeights(HycoSubstructures b, const PetscReal mu[])
{
  PetscReal at[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  for (PetscInt p = 0; p < b->n_theta; p++) at[p] = b->logarithm[p] ? PetscLogReal(mu[b->theta[p]]) : mu[b->theta[p]];
  for (PetscInt k = 0; k < b->n; k++) {
    if (!b->body[k].w) PetscCall(PetscMalloc1(b->body[k].n_samples, &b->body[k].w));
    PetscCall(HycoTensorWeights(&b->body[k].tensor, at, -1, -1, b->body[k].w));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* sum = the sum of the samples of n numbers each, times their weights. */
static void Blend(const HycoSubstructure *s, PetscInt n, const PetscReal data[], PetscReal sum[])
{
  for (PetscInt i = 0; i < n; i++) sum[i] = s->w[0] * data[i];
  for (PetscInt j = 1; j < s->n_samples; j++) {
    data += n;
    for (PetscInt i = 0; i < n; i++) sum[i] += s->w[j] * data[i];
  }
}

/* -- set-up -- */

/* The places of the mesh's unknowns. */
static PetscErrorCode FindPlaces(HycoSubstructures b, HycoMesh m)
{
  const PetscInt n = b->ns + b->ni;
  PetscInt *sorted, *place;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(n, &sorted, n, &place));
  for (PetscInt k = 0; k < n; k++) {
    place[k] = k;
    sorted[k] = k < b->ns ? b->dof[k] : b->inner[k - b->ns];
  }
  PetscCall(PetscSortIntWithArray(n, sorted, place));
  b->n_loc = m->n_nodes * b->dim;
  PetscCall(PetscMalloc1(b->n_loc, &b->loc));
  for (PetscInt i = 0; i < b->n_loc; i++) {
    const PetscInt node = m->node_whole ? m->node_whole[i / b->dim] : i / b->dim;
    PetscInt at;

    PetscCall(PetscFindInt(node * b->dim + i % b->dim, n, sorted, &at));
    b->loc[i] = at < 0 ? -1 : place[at];
  }
  PetscCall(PetscFree2(sorted, place));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The nodes and moduli of the bodies' cells where their axes are those of the scene. */
static PetscErrorCode TakeReference(HycoSubstructures b, const PetscReal mu[])
{
  HycoMesh m = b->probe;

  PetscFunctionBegin;
  PetscCall(HycoFESetParameters(b->fe, mu));
  for (PetscInt k = 0; k < b->n; k++) {
    const PetscInt e = b->cell[k], size = b->fe->tangent_size[m->cell_body[e]];
    const PetscReal *tangent = b->fe->tangent + b->fe->tangent_start[e];

    for (PetscInt v = 0; v < m->nv; v++)
      PetscCall(PetscArraycpy(b->X0 + 3 * (k * m->nv + v), b->fe->X + 3 * m->cells[e * m->nv + v], 3));
    b->E_at[k] = 0;
    for (PetscInt i = 1; i < size; i++) {
      if (PetscAbsReal(tangent[i]) > PetscAbsReal(tangent[b->E_at[k]])) b->E_at[k] = i;
    }
    b->E0[k] = tangent[b->E_at[k]];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesSetUp(HycoSubstructures b, HycoScene scene, const HycoBodiesSurface *s)
{
  const PetscInt m = s->pairs->n, entries = HycoPairsWidth(s->pairs) * b->dim * m;

  PetscFunctionBegin;
  PetscCall(HycoBodiesReset(b));
  PetscCall(HycoFECreate(scene, b->probe, &b->fe));
  PetscCall(PetscMalloc1(3 * b->probe->nv * b->n, &b->X0));
  PetscCall(PetscMalloc1(b->n, &b->E0));
  PetscCall(PetscMalloc1(b->n, &b->E_at));
  PetscCall(TakeReference(b, b->first));
  PetscCall(FindPlaces(b, s->fe->mesh));
  PetscCall(PetscMalloc1(b->n, &b->pose));
  PetscCall(PetscMalloc1(b->n, &b->kappa));
  PetscCall(PetscCalloc1(b->r + 1, &b->c));
  PetscCall(PetscCalloc1(b->p + 1, &b->x));
  PetscCall(PetscCalloc1(b->ns * b->p + 1, &b->Z));
  PetscCall(PetscCalloc1(b->p * b->r + 1, &b->work));
  PetscCall(PetscCalloc1(b->ns + 1, &b->free));
  PetscCall(PetscCalloc1(b->ns + b->ni + 1, &b->u));
  PetscCall(PetscCalloc1(b->ns + 1, &b->f));
  PetscCall(PetscMalloc1(m + 1, &b->row_start));
  PetscCall(PetscMalloc1(entries * b->dim + 1, &b->row_at));
  PetscCall(PetscMalloc1(entries * b->dim + 1, &b->row));
  PetscCall(PetscMalloc1(2 * m + 1, &b->w));
  PetscCall(PetscMalloc1(m + 1, &b->active));
  PetscCall(HycoTaoCreate(PETSC_COMM_SELF, NULL, &b->tao));
  PetscCall(HycoTaoSetType(b->tao, HYCO_TAO_ACTIVE_SET, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the bodies at mu -- */

/* Where they are, and how stiff. */
static PetscErrorCode Place(HycoSubstructures b, const PetscReal mu[])
{
  HycoMesh m = b->probe;
  PetscReal x[3 * HYCO_CELL_NODES], reference[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  HycoBodiesReference(b, mu, reference);
  if (b->n_theta) PetscCall(TakeReference(b, reference));
  PetscCall(HycoFESetParameters(b->fe, mu));
  for (PetscInt k = 0; k < b->n; k++) {
    const PetscInt e = b->cell[k];
    const PetscReal *tangent = b->fe->tangent + b->fe->tangent_start[e];

    for (PetscInt v = 0; v < m->nv; v++) PetscCall(PetscArraycpy(x + 3 * v, b->fe->X + 3 * m->cells[e * m->nv + v], 3));
    HycoPoseFit(b->dim, m->nv, b->X0 + 3 * k * m->nv, x, &b->pose[k]);
    b->kappa[k] = tangent[b->E_at[k]] / b->E0[k] * PetscPowReal(b->pose[k].s, (PetscReal)HycoPosePower(b->fe));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The coefficients of the loads, and the displacements that they cause without contact. */
static PetscErrorCode Load(HycoSubstructures b)
{
  const PetscScalar *F;
  PetscReal *value;
  Vec all;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(b->free, b->ns));
  if (!b->r) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(b->r, &value));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, b->fe->n_dof, &all));
  PetscCall(HycoFEAssembleForce(b->fe, all));
  PetscCall(VecGetArrayRead(all, &F));
  for (PetscInt k = 0; k < b->r; k++) {
    const PetscInt node = b->at[k] / b->dim;
    PetscReal force[3], turned[3];

    for (PetscInt c = 0; c < b->dim; c++) force[c] = b->fe->fixed[node * b->dim + c] ? 0 : F[node * b->dim + c];
    HycoPoseTurn(b->pose[b->at_body[k]].Q, b->dim, PETSC_TRUE, force, turned);
    value[k] = turned[b->at[k] % b->dim];
  }
  PetscCall(VecRestoreArrayRead(all, &F));
  PetscCall(VecDestroy(&all));
  for (PetscInt k = 0; k < b->r; k++) {
    b->c[k] = 0;
    for (PetscInt j = 0; j < b->r; j++) b->c[k] += b->A[k * b->r + j] * value[j];
  }
  PetscCall(PetscFree(value));
  for (PetscInt k = 0; k < b->n; k++) {
    const HycoSubstructure *own = &b->body[k];
    PetscReal *u = b->free + b->start[k];

    for (PetscInt i = 0; i < own->n_samples * own->n; i++) {
      const PetscReal weight = own->w[i / own->n] / b->kappa[k];

      for (PetscInt j = 0; j < b->r; j++)
        u[i % own->n] += weight * own->R[(size_t)i * (size_t)b->r + (size_t)j] * b->c[j];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rigid motions at mu, and the work of the loads on them. */
static PetscErrorCode BlendMotions(HycoSubstructures b)
{
  PetscReal *work;

  PetscFunctionBegin;
  if (!b->p) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(b->p * b->r + 1, &work));
  PetscCall(PetscArrayzero(b->work, b->p * b->r));
  for (PetscInt k = 0; k < b->n; k++) {
    Blend(&b->body[k], b->body[k].n * b->p, b->body[k].Z, b->Z + b->start[k] * b->p);
    Blend(&b->body[k], b->p * b->r, b->body[k].work, work);
    for (PetscInt i = 0; i < b->p * b->r; i++) b->work[i] += work[i];
  }
  PetscCall(PetscFree(work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The body of a place. */
static PetscInt BodyOf(HycoSubstructures b, PetscInt place)
{
  const PetscInt *start = place < b->ns ? b->start : b->inner_start;
  PetscInt k = 0;

  if (place >= b->ns) place -= b->ns;
  while (place >= start[k + 1]) k++;
  return k;
}

/* Adds an entry to the row that begins at `start`. */
static void AddEntry(HycoSubstructures b, PetscInt start, PetscInt *end, PetscInt place, PetscReal value)
{
  for (PetscInt j = start; j < *end; j++) {
    if (b->row_at[j] != place) continue;
    b->row[j] += value;
    return;
  }
  b->row_at[*end] = place;
  b->row[(*end)++] = value;
}

/* The rows of B on the bodies' unknowns, in their axes, and the gaps that the displacements without contact leave. */
static PetscErrorCode TurnRows(HycoSubstructures b, const HycoBodiesSurface *s)
{
  const HycoRows *rows = s->rows;
  const PetscInt dim = b->dim;
  PetscInt n = 0;

  PetscFunctionBegin;
  b->row_start[0] = 0;
  for (PetscInt k = 0; k < s->pairs->n; k++) {
    for (PetscInt e = rows->start[k]; e < rows->start[k + 1]; e++) {
      const PetscInt place = b->loc[rows->dof[e]], node = rows->dof[e] / dim, c = rows->dof[e] % dim;
      PetscInt body;

      HycoCheck(place >= 0 && place < b->ns,
                "contact %s: node %d is not among the surfaces on which the model of bodies was trained",
                s->fe->scene->contact[s->pairs->contact[k]]->name, (int)s->fe->mesh->node_id[node]);
      body = BodyOf(b, place);
      for (PetscInt d = 0; d < dim; d++) {
        const PetscReal value = b->pose[body].Q[3 * c + d] * rows->value[e];

        if (value != 0 && b->loc[node * dim + d] >= 0) AddEntry(b, b->row_start[k], &n, b->loc[node * dim + d], value);
      }
    }
    b->row_start[k + 1] = n;
    b->w[k] = rows->gap[k];
    for (PetscInt j = b->row_start[k]; j < n; j++) b->w[k] -= b->row[j] * b->free[b->row_at[j]];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the complementarity problem of some contacts -- */

/* The contacts in the problem, and the places that their rows touch, ascending. */
typedef struct {
  PetscInt n, *contact, n_place, *place, *at; /* at: by place of all: its number among these */
  PetscReal *M, *q, *z, *y;
  PetscInt *first; /* by body: the first of its places; n + 1 */
  PetscReal **C;   /* by body: its flexibility between these places */
} Problem;

static PetscErrorCode FindTouched(HycoSubstructures b, Problem *p)
{
  PetscFunctionBegin;
  PetscCall(PetscMalloc1(b->ns + 1, &p->at));
  PetscCall(PetscMalloc1(b->ns + 1, &p->place));
  for (PetscInt i = 0; i < b->ns; i++) p->at[i] = -1;
  for (PetscInt k = 0; k < p->n; k++) {
    for (PetscInt j = b->row_start[p->contact[k]]; j < b->row_start[p->contact[k] + 1]; j++) p->at[b->row_at[j]] = 0;
  }
  for (PetscInt i = 0; i < b->ns; i++) {
    if (p->at[i] < 0) continue;
    p->at[i] = p->n_place;
    p->place[p->n_place++] = i;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The flexibilities between the places that are touched. */
static PetscErrorCode Gather(HycoSubstructures b, Problem *p)
{
  PetscFunctionBegin;
  PetscCall(PetscMalloc2(b->n + 1, &p->first, b->n, &p->C));
  p->first[0] = 0;
  for (PetscInt k = 0, i = 0; k < b->n; k++) {
    const HycoSubstructure *own = &b->body[k];
    const PetscInt lo = b->start[k];

    while (i < p->n_place && p->place[i] < b->start[k + 1]) i++;
    p->first[k + 1] = i;
    PetscCall(PetscCalloc1(PetscSqr(i - p->first[k]) + 1, &p->C[k]));
    for (PetscInt s = 0; s < own->n_samples; s++) {
      const PetscReal weight = own->w[s] / b->kappa[k], *C = own->C + (size_t)s * (size_t)PetscSqr(own->n);
      PetscReal *to = p->C[k];

      for (PetscInt j = p->first[k]; j < i; j++) {
        const PetscReal *column = C + (size_t)(p->place[j] - lo) * (size_t)own->n;

        for (PetscInt d = p->first[k]; d < i; d++) *to++ += weight * column[p->place[d] - lo];
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y = C row^T / kappa on the places that are touched. */
static void Respond(HycoSubstructures b, const Problem *p, PetscInt contact)
{
  PetscCallVoid(PetscArrayzero(p->y, p->n_place));
  for (PetscInt j = b->row_start[contact]; j < b->row_start[contact + 1]; j++) {
    const PetscInt at = p->at[b->row_at[j]], body = BodyOf(b, b->row_at[j]), lo = p->first[body];
    const PetscInt n = p->first[body + 1] - lo;
    const PetscReal *column = p->C[body] + (size_t)(at - lo) * (size_t)n, value = b->row[j];

    for (PetscInt i = 0; i < n; i++) p->y[lo + i] += value * column[i];
  }
}

/* M = [0 A; -A^T W] and q = (-work, w) of the contacts in the problem. */
static PetscErrorCode Fill(HycoSubstructures b, Problem *p)
{
  const size_t n = (size_t)(b->p + p->n);

  PetscFunctionBegin;
  PetscCall(FindTouched(b, p));
  PetscCall(Gather(b, p));
  PetscCall(PetscCalloc1(n * n + 1, &p->M));
  PetscCall(PetscCalloc3(n + 1, &p->q, n + 1, &p->z, p->n_place + 1, &p->y));
  for (PetscInt i = 0; i < b->p; i++) {
    for (PetscInt j = 0; j < b->r; j++) p->q[i] -= b->work[i * b->r + j] * b->c[j];
  }
  for (PetscInt k = 0; k < p->n; k++) {
    const PetscInt contact = p->contact[k];
    const size_t column = (size_t)(b->p + k);

    p->q[column] = b->w[contact];
    Respond(b, p, contact);
    for (PetscInt j = k; j < p->n; j++) {
      PetscReal sum = 0;

      for (PetscInt e = b->row_start[p->contact[j]]; e < b->row_start[p->contact[j] + 1]; e++)
        sum += b->row[e] * p->y[p->at[b->row_at[e]]];
      p->M[column * n + (size_t)(b->p + j)] = p->M[(size_t)(b->p + j) * n + column] = sum;
    }
    for (PetscInt i = 0; i < b->p; i++) {
      PetscReal sum = 0;

      for (PetscInt e = b->row_start[contact]; e < b->row_start[contact + 1]; e++)
        sum += b->row[e] * b->Z[b->row_at[e] * b->p + i];
      p->M[column * n + (size_t)i] = sum;
      p->M[(size_t)i * n + column] = -sum;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* By the active set from all closed; if that fails, by Lemke's method. */
static PetscErrorCode SolveProblem(HycoSubstructures b, Problem *p, PetscReal Lambda[], PetscBool *solved)
{
  HycoLCP lcp = {.n = p->n, .p = b->p, .symmetric = PETSC_TRUE};
  PetscInt its = 0;

  PetscFunctionBegin;
  PetscCall(Fill(b, p));
  lcp.M = p->M;
  lcp.q = p->q;
  for (PetscInt k = 0; k < p->n; k++) b->active[k] = PETSC_TRUE;
  PetscCall(HycoTaoSolveLCP(b->tao, &lcp, b->active, p->z, &its, solved));
  if (!*solved && !b->p) {
    PetscCall(HycoTaoSetType(b->tao, HYCO_TAO_LEMKE, 0));
    PetscCall(HycoTaoSolveLCP(b->tao, &lcp, b->active, p->z, &its, solved));
    PetscCall(HycoTaoSetType(b->tao, HYCO_TAO_ACTIVE_SET, 0));
  }
  b->its += its;
  for (PetscInt i = 0; i < b->p; i++) b->x[i] = p->z[i];
  for (PetscInt k = 0; k < p->n; k++) /* negative by round-off; the residuals are recomputed */
    Lambda[p->contact[k]] = b->p && !b->active[k] ? 0 : PetscMax(p->z[b->p + k], 0);
  for (PetscInt k = 0; k < b->n; k++) PetscCall(PetscFree(p->C[k]));
  PetscCall(PetscFree2(p->first, p->C));
  HycoFreeAll(&p->M, &p->at, &p->place);
  PetscCall(PetscFree3(p->q, p->z, p->y));
  p->n_place = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* u = free - C f / kappa + Z x */
static void Displace(HycoSubstructures b, const HycoBodiesSurface *s, const PetscReal Lambda[])
{
  PetscCallVoid(PetscArrayzero(b->f, b->ns));
  for (PetscInt k = 0; k < s->pairs->n; k++) {
    for (PetscInt j = b->row_start[k]; Lambda[k] > 0 && j < b->row_start[k + 1]; j++)
      b->f[b->row_at[j]] += b->row[j] * Lambda[k];
  }
  PetscCallVoid(PetscArraycpy(b->u, b->free, b->ns));
  for (PetscInt k = 0; k < b->n; k++) {
    const HycoSubstructure *own = &b->body[k];
    PetscReal *u = b->u + b->start[k];

    for (PetscInt j = 0; j < own->n; j++) {
      const PetscReal force = b->f[b->start[k] + j] / b->kappa[k];

      for (PetscInt q = 0; force != 0 && q < own->n_samples; q++) {
        const PetscReal *column = own->C + ((size_t)q * (size_t)own->n + (size_t)j) * (size_t)own->n;
        const PetscReal share = own->w[q] * force;

        for (PetscInt i = 0; i < own->n; i++) u[i] -= column[i] * share;
      }
    }
  }
  for (PetscInt i = 0; i < b->ns; i++) {
    for (PetscInt j = 0; j < b->p; j++) b->u[i] += b->Z[i * b->p + j] * b->x[j];
  }
}

/* Adds the contacts outside the problem that penetrate in the present displacements; *more: there are some. */
static void Join(HycoSubstructures b, const HycoBodiesSurface *s, PetscReal size, PetscBool in[], Problem *p,
                 PetscBool *more)
{
  *more = PETSC_FALSE;
  for (PetscInt k = 0; k < s->pairs->n; k++) {
    PetscReal gap = s->rows->gap[k];

    if (in[k] || b->row_start[k] == b->row_start[k + 1]) continue;
    for (PetscInt j = b->row_start[k]; j < b->row_start[k + 1]; j++) gap -= b->row[j] * b->u[b->row_at[j]];
    if (gap >= -CLOSED * size) continue;
    in[k] = *more = PETSC_TRUE;
    p->contact[p->n++] = k;
  }
}

/* Rounds of the problem, from the contacts that the displacements without contact close. */
static PetscErrorCode SolveRounds(HycoSubstructures b, const HycoBodiesSurface *s, Problem *p, PetscBool in[],
                                  PetscReal Lambda[], PetscBool *solved)
{
  PetscReal size = 0;
  PetscBool more = PETSC_TRUE;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->pairs->n; k++) {
    if (b->row_start[k] == b->row_start[k + 1]) continue;
    size = PetscMax(size, PetscAbsReal(b->w[k]));
  }
  for (PetscInt k = 0; k < s->pairs->n; k++) {
    in[k] = (PetscBool)(b->row_start[k] < b->row_start[k + 1] && (b->p || b->w[k] < -CLOSED * size));
    if (in[k]) p->contact[p->n++] = k;
  }
  *solved = PETSC_TRUE;
  PetscCall(PetscArrayzero(b->x, b->p));
  for (PetscInt round = 0; more && *solved && round < ROUNDS; round++) {
    if (p->n) PetscCall(SolveProblem(b, p, Lambda, solved));
    Displace(b, s, Lambda);
    Join(b, s, size, in, p, &more);
  }
  *solved = (PetscBool)(*solved && !more);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesSolve(HycoSubstructures b, const HycoBodiesSurface *s, const PetscReal mu[],
                               PetscReal Lambda[], PetscBool *solved)
{
  Problem p = {0};
  PetscBool *in;

  PetscFunctionBegin;
  b->its = 0;
  PetscCall(HycoBodiesWeights(b, mu));
  PetscCall(Place(b, mu));
  PetscCall(Load(b));
  PetscCall(BlendMotions(b));
  PetscCall(TurnRows(b, s));
  PetscCall(PetscArrayzero(Lambda, s->pairs->n));
  PetscCall(PetscMalloc2(s->pairs->n + 1, &in, s->pairs->n + 1, &p.contact));
  PetscCall(SolveRounds(b, s, &p, in, Lambda, solved));
  b->n_problem = p.n;
  PetscCall(PetscFree2(in, p.contact));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal HycoBodiesBound(HycoSubstructures b, PetscReal *norm)
{
  PetscReal loads = 0, square = 0;

  for (PetscInt k = 0; k < b->n; k++) {
    const PetscReal *gram = b->body[k].gram;

    for (PetscInt i = b->start[k]; i < b->start[k + 1]; i++) {
      PetscReal elastic = b->free[i] - b->u[i]; /* C f / kappa */

      for (PetscInt j = 0; j < b->p; j++) elastic += b->Z[i * b->p + j] * b->x[j];
      square += b->f[i] * elastic;
    }
    for (PetscInt i = 0; i < b->r * b->r; i++) loads += b->c[i / b->r] * gram[i] * b->c[i % b->r] / b->kappa[k];
  }
  *norm = PetscSqrtReal(PetscMax(square, 0));
  return *norm > 0 ? b->bound + PetscSqrtReal(PetscMax(loads, 0)) / *norm : 0;
}

/* -- displacements -- */

void HycoBodiesMove(HycoSubstructures b, const HycoBodiesSurface *s, PetscReal U[])
{
  const PetscInt dim = b->dim;

  for (PetscInt i = 0; i < s->fe->mesh->n_nodes; i++) {
    PetscReal own[3] = {0, 0, 0}, turned[3];
    PetscInt place = -1;

    for (PetscInt c = 0; c < dim; c++) {
      if (b->loc[i * dim + c] < 0) continue;
      place = b->loc[i * dim + c];
      own[c] = b->u[place];
    }
    if (place < 0) continue;
    HycoPoseTurn(b->pose[BodyOf(b, place)].Q, dim, PETSC_FALSE, own, turned);
    for (PetscInt c = 0; c < dim; c++) {
      if (b->loc[i * dim + c] >= 0) U[i * dim + c] = s->fe->u0[i * dim + c] + turned[c];
    }
  }
}

/* The forces of a body that are not zero, and their places in it. */
typedef struct {
  PetscInt n, *at;
  PetscReal *value;
} Forces;

/* to += share times the rows of n displacements of a body, at one of its samples. */
static void AddRows(HycoSubstructures b, PetscInt k, const Forces *f, PetscReal share, PetscInt n, size_t row,
                    PetscReal to[])
{
  const HycoSubstructure *own = &b->body[k];
  const PetscReal *H = own->H + row * (size_t)own->n, *a = own->a + row * (size_t)b->r,
                  *g = own->g + row * (size_t)b->p;

  for (PetscInt i = 0; i < n; i++, H += own->n, a += b->r, g += b->p) {
    PetscReal elastic = 0, rigid = 0;

    for (PetscInt d = 0; d < b->r; d++) elastic += a[d] * b->c[d];
    for (PetscInt d = 0; d < f->n; d++) elastic -= H[f->at[d]] * f->value[d];
    for (PetscInt d = 0; d < b->p; d++) rigid += g[d] * b->x[d];
    to[i] += share * (elastic / b->kappa[k] + rigid);
  }
}

/* Of body k, whose forces have room in f. */
static void ExpandBody(HycoSubstructures b, PetscInt k, Forces *f, PetscReal gamma[])
{
  const HycoSubstructure *own = &b->body[k];
  const PetscInt turns = b->turn_start[k + 1] - b->turn_start[k];

  f->n = 0;
  for (PetscInt i = 0; i < own->n; i++) {
    if (b->f[b->start[k] + i] == 0) continue;
    f->at[f->n] = i;
    f->value[f->n++] = b->f[b->start[k] + i];
  }
  for (PetscInt s = 0; s < own->n_samples; s++) {
    const size_t row = (size_t)s * (size_t)(turns * own->l + own->m);

    for (PetscInt j = 0; j < turns; j++) {
      PetscReal share = 0;

      for (PetscInt d = 0; d < 9; d++) share += b->G[9 * (b->turn_start[k] + j) + d] * b->pose[k].Q[d];
      AddRows(b, k, f, share * own->w[s], own->l, row + (size_t)(j * own->l), gamma + b->mode_start[k]);
    }
    AddRows(b, k, f, own->w[s], own->m, row + (size_t)(turns * own->l), b->u + b->ns + b->inner_start[k]);
  }
}

PetscErrorCode HycoBodiesExpand(HycoSubstructures b, PetscReal gamma[])
{
  Forces f;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(gamma, b->l));
  PetscCall(PetscArrayzero(b->u + b->ns, b->ni));
  PetscCall(PetscMalloc2(b->ns + 1, &f.at, b->ns + 1, &f.value));
  for (PetscInt k = 0; k < b->n; k++) ExpandBody(b, k, &f, gamma);
  PetscCall(PetscFree2(f.at, f.value));
  PetscFunctionReturn(PETSC_SUCCESS);
}
