/*
  The loads of the bodies. In the axes of the bodies, the loads at any parameters are combinations of a few vectors:
  loads at sampled points give an orthonormal basis, and further points show that it is complete. Their coefficients
  follow from as many unknowns as there are vectors, by DEIM, so that a prediction evaluates the loads only in the
  cells around these, whatever the loads are: pressures, body forces, prescribed displacements, temperatures.
*/
#include <hycoalgorithms.h>
#include <hycobodiestraining.h>

#define MOST_VECTORS 60 /* of the basis */
/* Of the largest load, what the basis leaves of one: 4500 eps, projections onto 60 vectors. */
#define INDEPENDENT_LOAD 1e-12
/* Of the largest load, what the basis leaves at further points: a tenth of the residual of 1e-8. */
#define COMPLETE 1e-9
/* Of the largest load, the same where it changes with the shape of bodies: a hundredth of SMALL_ERROR, as bodies are
   sampled too. */
#define COMPLETE_SAMPLED 1e-6
#define POINTS(p, q)     (12 + 8 * (p) + 24 * (q))
#define MORE             8 /* further points */

/* F at mu in the bodies' axes, 0 where fixed. Collective. In the body's axes a load that moves with the body does not
   change, and needs one vector only. */
static PetscErrorCode TurnedLoad(HycoReducer t, HycoFOM f, const PetscReal X0[], const PetscReal mu[], HycoPose pose[],
                                 Vec F)
{
  const HycoBodyParts *parts = &HycoTrainingOfBodies(t)->parts;
  const PetscInt dim = f->fe->dim;
  PetscScalar *v;

  PetscFunctionBegin;
  HycoOnEach(HycoComm(f), HycoFESetParameters(f->fe, mu));
  if (f->size > 1) PetscCall(HycoFEAgreeOnMirrors(HycoComm(f), f->fe));
  PetscCall(HycoBodyPoses(f, parts->n, parts->of, X0, pose));
  HycoOnEach(HycoComm(f), HycoFEAssembleForce(f->fe, F));
  PetscCall(VecGetArray(F, &v));
  for (PetscInt i = 0; i < f->part->n_nodes; i++) {
    const PetscInt own = HycoMeshOwned(f->part, i);
    PetscReal turned[3];

    if (own < 0) continue;
    for (PetscInt c = 0; c < dim; c++) v[own * dim + c] = f->fe->fixed[i * dim + c] ? 0 : v[own * dim + c];
    /* Fixed components are zero before and after the turn, as Load() has them online. */
    HycoPoseTurn(pose[parts->of[i]].Q, dim, PETSC_TRUE, v + own * dim, turned);
    for (PetscInt c = 0; c < dim; c++) v[own * dim + c] = f->fe->fixed[i * dim + c] ? 0 : turned[c];
  }
  PetscCall(VecRestoreArray(F, &v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes out of v its part in the basis; the length of the rest. */
static PetscErrorCode TakeOut(const HycoBodiesFactor *factor, Vec v, PetscReal *rest)
{
  PetscFunctionBegin;
  /* Gram-Schmidt twice: once leaves parts of the basis in a nearly dependent load. */
  for (PetscInt k = 0; k < 2 * factor->n_basis; k++) {
    Vec q = factor->basis[k % factor->n_basis];
    PetscScalar dot;

    PetscCall(VecDot(v, q, &dot));
    PetscCall(VecAXPY(v, -dot, q));
  }
  PetscCall(VecNorm(v, NORM_2, rest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the directions of a body's turn that are not in the span of G: rows of 9, orthonormal. */
static PetscErrorCode AddTurn(PetscInt dim, const HycoPose *pose, PetscInt *n, PetscReal G[])
{
  PetscReal *own = G + 9 * *n, size = 0;

  PetscFunctionBegin;
  /* The turns span all matrices already. */
  if (*n == dim * dim) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt d = 0; d < 9; d++) own[d] = d / 3 < dim && d % 3 < dim ? pose->Q[d] : 0;
  for (PetscInt j = 0; j < 2 * *n; j++) {
    const PetscReal *other = G + 9 * (j % *n);
    PetscReal dot = 0;

    for (PetscInt d = 0; d < 9; d++) dot += own[d] * other[d];
    for (PetscInt d = 0; d < 9; d++) own[d] -= dot * other[d];
  }
  for (PetscInt d = 0; d < 9; d++) size += own[d] * own[d];
  /* size is a square: turns that differ by less than 1e-8 are one. */
  if (!(size > 1e-16)) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt d = 0; d < 9; d++) own[d] /= PetscSqrtReal(size);
  (*n)++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* State of the survey of the points. */
typedef struct {
  PetscReal *X0, *G, size; /* size: of the largest load */
  PetscInt *turns;         /* by body: number of its G, 9 of 9 reals */
  HycoPose *pose;
} Survey;

/* Laws and their forces are not turned. */
static PetscErrorCode CheckTurns(HycoReducer t, const HycoPose pose[])
{
  HycoMesh m = t->fom->part;
  PetscBool *flows;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(HycoTrainingOfBodies(t)->parts.n, &flows));
  for (PetscInt e = 0; e < m->n_cells; e++) {
    if (HycoInelasticFlows(t->fom->fe, e)) flows[HycoTrainingOfBodies(t)->parts.of[m->cells[e * m->nv]]] = PETSC_TRUE;
  }
  /* A body may lie on several ranks, with its flowing cells on one of them. */
  HycoAllreduce(flows, HycoTrainingOfBodies(t)->parts.n, HYCO_MPI_BOOL, MPI_LOR, HycoComm(t));
  for (PetscInt k = 0; k < HycoTrainingOfBodies(t)->parts.n; k++) {
    PetscReal turned = 0;

    /* Distance of Q from the identity. */
    for (PetscInt d = 0; d < 9; d++) turned = PetscMax(turned, PetscAbsReal(pose[k].Q[d] - (d % 4 == 0)));
    HycoCheckModel(!flows[k] || turned < 1e-9,
                   "body %s deforms inelastically, and its map turns it, which a model of bodies does not support; "
                   "train a hybrid model",
                   HycoTrainingOfBodies(t)->parts.name[k]);
  }
  PetscCall(PetscFree(flows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the load at mu to the basis, if it is not in its span; check: refuses it then. Collective. Also collects
   the turns of each body. With `check` nothing is added: loads at further points must lie in the span, up to what
   sampling of shapes allows. */
static PetscErrorCode AddPoint(HycoReducer t, HycoBodiesFactor *factor, Survey *s, const PetscReal mu[],
                               PetscBool check)
{
  const PetscInt n = HycoTrainingOfBodies(t)->parts.n;
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  PetscReal norm, rest, reference[HYCO_MAX_PARAMETERS];
  Vec F;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n && b->n_theta; k++) {
    HycoBodiesReference(b, k, mu, reference);
    HycoOnEach(HycoComm(t), HycoFESetParameters(factor->fom->fe, reference));
    for (PetscInt i = 0; i < 3 * factor->fom->part->n_nodes; i++) {
      /* Each body is compared with itself at the same shape, not with `first`. */
      if (HycoTrainingOfBodies(t)->parts.of[i / 3] == k) s->X0[i] = factor->fom->fe->X[i];
    }
  }
  PetscCall(VecDuplicate(factor->fom->F, &F));
  PetscCall(TurnedLoad(t, factor->fom, s->X0, mu, s->pose, F));
  if (t->scene->n_times) PetscCall(CheckTurns(t, s->pose));
  for (PetscInt k = 0; k < n; k++) PetscCall(AddTurn(factor->fom->fe->dim, &s->pose[k], &s->turns[k], s->G + 81 * k));
  PetscCall(VecNorm(F, NORM_2, &norm));
  s->size = PetscMax(s->size, norm);
  PetscCall(TakeOut(factor, F, &rest));
  if (!check && rest > INDEPENDENT_LOAD * s->size && rest > 1e-11 * norm && factor->n_basis < MOST_VECTORS) {
    PetscCall(VecScale(F, 1 / rest));
    PetscCall(TakeOut(factor, F, &rest));
    PetscCall(VecScale(F, 1 / rest));
    /* F is destroyed below in any case. */
    PetscCall(PetscObjectReference((PetscObject)F));
    factor->basis[factor->n_basis++] = F;
  }
  PetscCall(VecDestroy(&F));
  HycoCheckModel(!check || rest <= (b->n_theta ? COMPLETE_SAMPLED : COMPLETE) * s->size,
                 "a load changes its distribution on a body in too many ways as the parameters vary (%.1e of it is in "
                 "none of %d vectors), which a model of bodies does not support; train a hybrid model",
                 (double)(rest / s->size), (int)factor->n_basis);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The loads at parameters mu; of a history at its listed times and between them. Collective. Between listed times
   too, at an irrational share: tables of a history may have values there that no listed time shows. */
static PetscErrorCode AddPath(HycoReducer t, HycoBodiesFactor *factor, Survey *s, const PetscReal mu[], PetscBool check)
{
  const HycoScene scene = t->scene;
  const PetscInt n = scene->n_times ? 2 * scene->n_times - 1 : 1;
  PetscReal all[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  for (PetscInt j = 0; j < n; j++) {
    const PetscReal now = scene->n_times ? scene->times[j / 2] : 0, next = j % 2 ? scene->times[j / 2 + 1] : now;

    /* Loads follow tables and time as well as parameters. */
    HycoSceneSetTime(scene, mu, now + 0.618 * (next - now), all);
    PetscCall(AddPoint(t, factor, s, all, check));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The last MORE points check, the others build. Without parameters there is nothing to check: `first` is every
   point. */
static PetscErrorCode SurveyPoints(HycoReducer t, HycoBodiesFactor *factor, Survey *s)
{
  const PetscInt p = t->scene->n_parameters;
  HycoSamples points;
  const PetscReal *mu;
  PetscInt n;
  PetscErrorCode ierr = PETSC_SUCCESS;

  PetscFunctionBegin;
  PetscCall(AddPath(t, factor, s, HycoTrainingOfBodies(t)->bodies->first, PETSC_FALSE));
  if (!p) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSamplesCreate(t->scene, &points));
  PetscCall(HycoSamplesAddScattered(points, POINTS(p, HycoTrainingOfBodies(t)->bodies->n_theta) + MORE));
  PetscCall(HycoSamplesGet(points, &n, NULL, &mu));
  /* An error is kept until the points are destroyed: a search goes on after it. */
  for (PetscInt k = 0; k < n && !ierr; k++) ierr = AddPath(t, factor, s, mu + k * p, (PetscBool)(k >= n - MORE));
  PetscCall(HycoSamplesDestroy(&points));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Puts the turns of all bodies one after the other. G: 9 numbers a turn, up to 9 turns a body, as a rotation has. */
static PetscErrorCode TakeTurns(HycoSubstructures b, const Survey *s)
{
  PetscFunctionBegin;
  PetscCall(PetscCalloc1(b->n + 1, &b->turn_start));
  for (PetscInt k = 0; k < b->n; k++) b->turn_start[k + 1] = b->turn_start[k] + s->turns[k];
  b->n_turns = b->turn_start[b->n];
  PetscCall(PetscMalloc1(9 * b->n_turns, &b->G));
  for (PetscInt k = 0; k < b->n; k++)
    PetscCall(PetscArraycpy(b->G + 9 * b->turn_start[k], s->G + 81 * k, 9 * s->turns[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- DEIM -- */

/* Collective: every rank gets the value of the one that has it. */
static PetscErrorCode ValueAt(Vec v, PetscInt i, PetscReal *value)
{
  PetscInt lo, hi;
  const PetscScalar *a;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(v, &lo, &hi));
  PetscCall(VecGetArrayRead(v, &a));
  /* 0 on the others, so that the sum is the value. */
  *value = i >= lo && i < hi ? a[i - lo] : 0;
  PetscCall(VecRestoreArrayRead(v, &a));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, value, 1, MPIU_REAL, MPI_SUM, PetscObjectComm((PetscObject)v)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The inverse of the k x k block of D (row major, r columns), row major. */
static PetscErrorCode LoadBasisInvert(PetscInt k, PetscInt r, const PetscReal D[], PetscReal P[])
{
  PetscReal *block;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(k * k + 1, &block));
  for (PetscInt i = 0; i < k * k; i++) block[i] = D[i % k * r + i / k]; /* column major */
  /* A pseudo-inverse: nearly dependent rows must not blow up the coefficients. */
  PetscCall(HycoPseudoInverse(k, k, block, 1e-14, P));
  PetscCall(PetscArraycpy(block, P, k * k));
  for (PetscInt i = 0; i < k * k; i++) P[i] = block[i % k * k + i / k];
  PetscCall(PetscFree(block));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The unknowns where the basis is evaluated, and the inverse of its values there. Collective. DEIM with the
   vectors distributed: only k x k values are on every rank. VecMax() takes the smallest index of equal values. */
static PetscErrorCode FindPoints(HycoSubstructures b, const HycoBodiesFactor *factor, PetscInt point[])
{
  const PetscInt r = b->r;
  PetscReal *D, *P, *c, *at, most;
  Vec rest, size;

  PetscFunctionBegin;
  PetscCall(PetscCalloc4(r * r + 1, &D, r * r + 1, &P, r + 1, &c, r + 1, &at));
  HycoVecDuplicate(factor->fom->F, &rest, &size);
  for (PetscInt k = 0; k < r; k++) {
    /* The interpolation through the points so far; the matrix grows by a row and a column. */
    if (k) PetscCall(LoadBasisInvert(k, r, D, P));
    for (PetscInt i = 0; i < k; i++) PetscCall(ValueAt(factor->basis[k], point[i], &at[i]));
    PetscCall(VecCopy(factor->basis[k], rest));
    for (PetscInt i = 0; i < k; i++) {
      c[i] = 0;
      for (PetscInt j = 0; j < k; j++) c[i] += P[i * k + j] * at[j];
      /* What the former vectors do not interpolate: the next point is where it is largest. */
      PetscCall(VecAXPY(rest, -c[i], factor->basis[i]));
    }
    PetscCall(VecCopy(rest, size));
    PetscCall(VecAbs(size));
    PetscCall(VecMax(size, &point[k], &most));
    for (PetscInt i = 0; i <= k; i++) {
      PetscCall(ValueAt(factor->basis[k], point[i], &D[i * r + k]));
      PetscCall(ValueAt(factor->basis[i], point[k], &D[k * r + i]));
    }
  }
  PetscCall(PetscMalloc1(r * r + 1, &b->A));
  /* Once more with all points: A turns values of F into coefficients. */
  if (r) PetscCall(LoadBasisInvert(r, r, D, b->A));
  HycoDestroyAll(&rest, &size);
  PetscCall(PetscFree4(D, P, c, at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* node[k]: the number of point k's node in the whole mesh; b->at_body[k]: its body. Collective. */
static PetscErrorCode NamePoints(HycoReducer t, HycoFOM f, const PetscInt point[], PetscInt node[])
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(b->r + 1, &b->at_body));
  for (PetscInt k = 0; k < b->r; k++) {
    /* -1 on ranks that do not own the node; the maximum is the owner's. */
    node[k] = b->at_body[k] = -1;
    for (PetscInt i = 0; i < f->part->n_nodes; i++) {
      if (HycoMeshOwned(f->part, i) < 0 || HycoMeshOwned(f->part, i) + f->part->first != point[k] / b->dim) continue;
      node[k] = f->part->node_whole ? f->part->node_whole[i] : i;
      b->at_body[k] = HycoTrainingOfBodies(t)->parts.of[i];
    }
  }
  HycoAllreduce(node, b->r, MPIU_INT, MPI_MAX, HycoComm(t));
  HycoAllreduce(b->at_body, b->r, MPIU_INT, MPI_MAX, HycoComm(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* cell[b]: the number in the whole mesh of the largest cell of each body. Collective. The largest, since a pose
   from few nodes close together loses digits. Equal ones within 1e-10: the smallest number, on any partition. */
static PetscErrorCode LargestCells(HycoReducer t, const PetscReal first[], PetscInt cell[])
{
  HycoMesh m = t->fom->part;
  const HycoBodyParts *parts = &HycoTrainingOfBodies(t)->parts;
  PetscReal *volume, *most;

  PetscFunctionBegin;
  /* At the reference: a cell that is largest elsewhere serves as well, but every run must choose the same. */
  PetscCall(HycoFOMSetParameters(t->fom, first));
  PetscCall(PetscMalloc1(m->n_cells + 1, &volume));
  PetscCall(PetscCalloc1(parts->n, &most));
  HycoOnEach(HycoComm(t), HycoFEVolumes(t->fom->fe, volume));
  for (PetscInt e = 0; e < m->n_cells; e++) {
    const PetscInt b = parts->of[m->cells[e * m->nv]];

    most[b] = PetscMax(most[b], volume[e]);
  }
  HycoAllreduce(most, parts->n, MPIU_REAL, MPI_MAX, HycoComm(t));
  for (PetscInt b = 0; b < parts->n; b++) cell[b] = PETSC_MAX_INT;
  for (PetscInt e = 0; e < m->n_cells; e++) {
    const PetscInt b = parts->of[m->cells[e * m->nv]];

    if (volume[e] >= most[b] * (1 - 1e-10)) cell[b] = PetscMin(cell[b], m->cell_whole ? m->cell_whole[e] : e);
  }
  HycoAllreduce(cell, parts->n, MPIU_INT, MPI_MIN, HycoComm(t));
  HycoFreeAll(&volume, &most);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The places of the points and cells in the mesh that rank 0 has gathered. */
static PetscErrorCode TakeProbe(HycoSubstructures b, const PetscInt point[], const PetscInt node[],
                                const PetscInt cell[])
{
  HycoMesh m = b->probe;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(b->r + 1, &b->at));
  PetscCall(PetscCalloc1(b->n, &b->cell));
  for (PetscInt k = 0; k < b->r; k++) {
    for (PetscInt i = 0; i < m->n_nodes; i++) {
      /* The probe is small: no search structure is worth its lines. */
      if (m->node_whole[i] == node[k]) b->at[k] = i * b->dim + point[k] % b->dim;
    }
  }
  for (PetscInt k = 0; k < b->n; k++) {
    for (PetscInt e = 0; e < m->n_cells; e++) {
      if (m->cell_whole[e] == cell[k]) b->cell[k] = e;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gathers the cells around the points and the bodies' largest. Collective. The cells around each DEIM point (F of an
   unknown sums over them), with facets for pressures, and one cell of each body for its pose and modulus. The model
   carries this small mesh: loads and poses at new parameters follow from its nodes alone. */
static PetscErrorCode GatherProbe(HycoReducer t, HycoBodiesFactor *factor, const PetscInt point[])
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  HycoMesh m = t->fom->part;
  PetscInt *node, *cell;
  PetscBool *needed;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(b->r + 1, &node, b->n, &cell, m->n_cells + 1, &needed));
  PetscCall(NamePoints(t, factor->fom, point, node));
  PetscCall(LargestCells(t, b->first, cell));
  for (PetscInt e = 0; e < m->n_cells; e++) {
    PetscInt of[HYCO_MAX_CELL_NODES];
    const PetscInt n = HycoMeshCellNodes(m, e, of);

    needed[e] = (PetscBool)(cell[HycoTrainingOfBodies(t)->parts.of[of[0]]] == (m->cell_whole ? m->cell_whole[e] : e));
    /* Every cell around a point contributes to the nodal force there. */
    for (PetscInt v = 0; v < n * b->r && !needed[e]; v++)
      needed[e] = (PetscBool)((m->node_whole ? m->node_whole[of[v / b->r]] : of[v / b->r]) == node[v % b->r]);
  }
  PetscCall(HycoReducerGatherMesh(t, needed, &b->probe));
  if (b->probe) PetscCall(PetscFree(b->probe->node_global)); /* its vectors are its own */
  HycoOnRoot(HycoComm(t), TakeProbe(b, point, node, cell));
  PetscCall(PetscFree3(node, cell, needed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Before the samples: each record needs R for the whole basis. */
PetscErrorCode HycoBodiesLoads(HycoReducer t, HycoBodiesFactor *factor)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  HycoFOM f = factor->fom;
  Survey s = {0};
  PetscInt point[MOST_VECTORS];
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(MOST_VECTORS, &factor->basis));
  HycoDuplicate(3 * f->part->n_nodes, f->fe->X, &s.X0);
  PetscCall(PetscMalloc1(b->n, &s.pose));
  PetscCall(PetscCalloc2(81 * b->n, &s.G, b->n, &s.turns));
  ierr = SurveyPoints(t, factor, &s);
  if (!ierr) ierr = TakeTurns(b, &s);
  PetscCall(PetscFree2(s.G, s.turns));
  HycoFreeAll(&s.pose, &s.X0);
  /* The survey has moved the nodes. */
  f->fe->ready = PETSC_FALSE;
  PetscCall(ierr);
  b->r = factor->n_basis;
  PetscCall(FindPoints(b, factor, point));
  /* On rank 0: a prediction evaluates loads at these points alone. */
  PetscCall(GatherProbe(t, factor, point));
  PetscFunctionReturn(PETSC_SUCCESS);
}
