/*
  The contact problem of bodies as substructures. At mu: where each body is and how stiff (from one of its cells), the
  loads (from the cells at r unknowns), the surfaces' displacements without contact, the gaps they leave. The
  complementarity problem is that of the contacts that these displacements close; those that its solution closes
  beside them join it. With bodies that contact alone holds it begins with some of all contacts.
*/
#include <hycoalgorithms.h>
#include <hycobodies.h>
#include <petscblaslapack.h>
#include <string.h>

/* Of the deepest penetration without forces: contacts that are deeper are in the first problem; half, as the others
   join in a round or two. */
#define FIRST_DEPTH 0.5
/* Of the differences of depth, where all contacts are closed without forces: the nearest tenth is in the first problem
   (391 contacts, of which 9 to 87 closed, were all). */
#define NEAREST_DEPTH 0.1
/* Of the depth: 4.5e6 eps; smaller differences of depth do not choose the first problem. */
#define FLAT_DEPTH 1e-9

/* `weight`, `share` and `blend` hold one array per body, and `bodies` has their number; the zeros afterwards make a
   second call, and HycoBodiesSetUp() on the same work, safe. */
PetscErrorCode HycoBodiesReset(HycoBodiesWork o)
{
  PetscFunctionBegin;
  PetscCall(HycoBodiesResetRowCache(o));
  PetscCall(HycoFEDestroy(&o->fe));
  PetscCall(HycoBodiesDestroySystem(o));
  PetscCall(HycoSolverDestroy(&o->own));
  PetscCall(HycoBodiesResetPerturbed(o));
  for (PetscInt k = 0; o->R && k < o->bodies->n; k++)
    HycoFreeAll(&o->weight[k], &o->share[k], &o->share_H[k], &o->share_a[k], &o->blend[k], &o->R[k]);
  for (PetscInt k = 0; o->response && k < o->n_contacts * o->bodies->n; k++) PetscCall(PetscFree(o->response[k]));
  HycoFreeAll(&o->kept.weights, &o->weight, &o->share, &o->share_H, &o->share_a, &o->R, &o->blend, &o->blended,
              &o->response, &o->responded, &o->mu, &o->reference, &o->X0, &o->E0, &o->E_at, &o->pose, &o->kappa, &o->c,
              &o->elastic, &o->free, &o->u, &o->f, &o->x, &o->loc, &o->placed, &o->placed_in, &o->row_start, &o->row_at,
              &o->row, &o->gap, &o->active, &o->Z, &o->work);
  PetscCall(PetscMemzero(o, sizeof(*o)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Arrays that training or a file has not filled yet are NULL, so that an error in the middle of either frees what
   is there. */
PetscErrorCode HycoBodiesDestroy(HycoSubstructures *bodies)
{
  HycoSubstructures b = *bodies;

  PetscFunctionBegin;
  if (!b) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoMeshDestroy(&b->probe));
  for (PetscInt k = 0; b->body && k < b->n; k++) {
    HycoSubstructure *s = &b->body[k];

    PetscCall(HycoFlexibilityDestroy(&s->C));
    PetscCall(HycoFlexibilityDestroy(&s->H));
    PetscCall(HycoFlexibilityDestroy(&s->a));
    HycoFreeAll(&s->R, &s->Z, &s->work, &s->gram);
  }
  HycoFreeAll(&b->first, &b->theta, &b->variable, &b->n_nodes, &b->node, &b->body, &b->start, &b->dof, &b->inner_start,
              &b->inner, &b->cell, &b->at, &b->at_body, &b->A, &b->mode_start, &b->turn_start, &b->G,
              &b->motions.n_nodes, &b->motions.body, &b->motions.node, &b->motions.frame, &b->motions.table.data);
  if (b->inelastic) {
    HycoBodiesInelastic s = b->inelastic;

    HycoFreeAll(&s->point, &s->weight, &s->T, &s->there, &s->P, &s->fields, &s->dof, &s->body, &s->C, &s->R, &s->A,
                &s->Z, &b->inelastic);
  }
  PetscCall(PetscFree(*bodies));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- theta -- */

/* A body has one node along an axis of theta that does not change it, so that its tensor is smaller than the grid
   of all values. The values x are those of `node`, borrowed by all bodies. */
void HycoBodiesSetTensors(HycoSubstructures b)
{
  for (PetscInt k = 0; k < b->n; k++) {
    HycoTensor *t = &b->body[k].tensor;
    const PetscReal *node = b->node;

    t->dim = b->n_theta;
    for (PetscInt p = 0; p < b->n_theta; p++) {
      t->x[p] = node;
      /* Interpolation through all nodes; where one node serves, the degree is 0. */
      t->degree[p] = t->n[p] - 1;
      node += b->n_nodes[p];
    }
    b->body[k].n_samples = HycoTensorSize(t);
  }
}

/* Parameters outside theta stay at `first`: they move, scale or stiffen the body as a whole, which pose and kappa
   represent, and would otherwise be applied twice. */
void HycoBodiesReference(HycoSubstructures b, PetscInt k, const PetscReal mu[], PetscReal reference[])
{
  for (PetscInt p = 0; p < b->n_variables; p++) reference[p] = b->first[p];
  for (PetscInt p = 0; p < b->n_theta; p++) {
    if (HycoBodiesAxis(b, k, p)) reference[b->theta[p]] = mu[b->theta[p]];
  }
}

/* The nodes of a logarithmic axis are stored as logarithms (SetGrid() in training). */
PetscErrorCode HycoBodiesWeights(HycoSubstructures b, PetscInt k, const PetscReal mu[], PetscReal weight[])
{
  PetscReal at[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  for (PetscInt p = 0; p < b->n_theta; p++) at[p] = HycoBodiesVariable(b->variable[p], mu[b->theta[p]]);
  PetscCall(HycoTensorWeights(&b->body[k].tensor, at, weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The Lebesgue function of the interpolation at the present weights: outside the nodes it grows as the error of a
   polynomial may. */
PetscReal HycoBodiesStretch(HycoBodiesWork o)
{
  PetscReal most = 0;

  for (PetscInt k = 0; k < o->bodies->n; k++) {
    PetscReal sum = 0;

    for (PetscInt s = 0; s < o->bodies->body[k].n_samples; s++) sum += PetscAbsReal(o->weight[k][s]);
    most = PetscMax(most, sum);
  }
  return most;
}

/* sum = the sum of the n_samples of n numbers each, times their weights. */
PetscErrorCode HycoBodiesBlend(PetscInt n_samples, const PetscReal weight[], PetscInt n, const PetscReal data[],
                               PetscReal sum[])
{
  const PetscReal one = 1, zero = 0;
  const PetscBLASInt each = 1;
  PetscBLASInt rows, columns;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(n, &rows));
  PetscCall(PetscBLASIntCast(n_samples, &columns));
  if (rows) BLASgemv_("N", &rows, &columns, &one, data, &rows, weight, &each, &zero, sum, &each);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- set-up -- */

/* The places of the mesh's unknowns. loc[]: an unknown of the mesh to its place among the surfaces' unknowns, then
   among those inside; -1: only the modes know it. */
static PetscErrorCode FindPlaces(HycoBodiesWork o, HycoMesh m)
{
  const HycoSubstructures b = o->bodies;
  const PetscInt n = b->ns + b->ni;
  PetscInt *sorted, *place;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(n, &sorted, n, &place));
  for (PetscInt k = 0; k < n; k++) {
    place[k] = k;
    sorted[k] = k < b->ns ? b->dof[k] : b->inner[k - b->ns];
  }
  /* dof and inner ascend within each body, not over all of them: sort, and keep where each was. */
  PetscCall(PetscSortIntWithArray(n, sorted, place));
  o->n_loc = m->n_nodes * b->dim;
  PetscCall(PetscMalloc1(o->n_loc, &o->loc));
  for (PetscInt i = 0; i < o->n_loc; i++) {
    const PetscInt node = m->node_whole ? m->node_whole[i / b->dim] : i / b->dim;
    PetscInt at;

    PetscCall(PetscFindInt(node * b->dim + i % b->dim, n, sorted, &at));
    o->loc[i] = at < 0 ? -1 : place[at];
  }
  PetscCall(PetscFree2(sorted, place));
  PetscCall(PetscMalloc1(m->n_nodes + 1, &o->placed));
  PetscCall(PetscMalloc1(m->n_nodes + 1, &o->placed_in));
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    PetscInt last = -1;

    for (PetscInt c = 0; c < b->dim; c++) last = PetscMax(last, o->loc[i * b->dim + c]);
    /* A node inside: its displacement is that of the modes. */
    if (last < 0) continue;
    o->placed[o->n_placed] = i;
    o->placed_in[o->n_placed++] = HycoBodiesAt(b, last);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The nodes and modulus of a body's cell at mu, where its axes are those of the scene. */
static PetscErrorCode TakeReference(HycoBodiesWork o, PetscInt k, const PetscReal mu[])
{
  HycoMesh m = o->bodies->probe;
  const PetscInt e = o->bodies->cell[k], size = o->fe->tangent_size[m->cell_body[e]];
  const PetscReal *tangent;

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(o->reference + k * o->bodies->n_variables, mu, o->bodies->n_variables));
  PetscCall(HycoFESetParameters(o->fe, mu));
  tangent = o->fe->tangent + o->fe->tangent_start[e];
  for (PetscInt v = 0; v < m->nv; v++)
    PetscCall(PetscArraycpy(o->X0 + 3 * (k * m->nv + v), o->fe->X + 3 * m->cells[e * m->nv + v], 3));
  /* The largest entry of the tangents gives kappa as a quotient: no small denominator, and the same entry at every
     mu. */
  o->E_at[k] = 0;
  for (PetscInt i = 1; i < size; i++) {
    if (PetscAbsReal(tangent[i]) > PetscAbsReal(tangent[o->E_at[k]])) o->E_at[k] = i;
  }
  o->E0[k] = tangent[o->E_at[k]];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Room for the entries of the rows in the bodies' axes. */
static PetscErrorCode GrowRows(HycoBodiesWork o, PetscInt room)
{
  PetscFunctionBegin;
  if (room <= o->row_room) PetscFunctionReturn(PETSC_SUCCESS);
  o->row_room = room;
  PetscCall(PetscRealloc((size_t)room * sizeof(*o->row_at), &o->row_at));
  PetscCall(PetscRealloc((size_t)room * sizeof(*o->row), &o->row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The probe is the small mesh of cells at which loads, stiffness and pose of each body are sampled at new
   parameters. */
PetscErrorCode HycoBodiesSetUp(HycoBodiesWork o, HycoSubstructures b, HycoScene scene, const HycoBodiesSurface *s,
                               HycoSolver solver)
{
  const PetscInt m = s->n;

  PetscFunctionBegin;
  o->bodies = b;
  if (!solver) PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &o->own));
  o->solver = solver ? solver : o->own;
  PetscCall(PetscCalloc1(b->n, &o->weight));
  PetscCall(PetscCalloc1(b->n, &o->share));
  PetscCall(PetscCalloc1(b->n, &o->share_H));
  PetscCall(PetscCalloc1(b->n, &o->share_a));
  PetscCall(PetscCalloc1(b->n, &o->blend));
  PetscCall(PetscCalloc1(b->n, &o->R));
  o->n_contacts = m;
  PetscCall(PetscCalloc1(m * b->n + 1, &o->response));
  PetscCall(PetscCalloc1(m + 1, &o->responded));
  PetscCall(PetscCalloc1(b->ns + 1, &o->blended));
  PetscCall(PetscCalloc1(b->n, &o->kept.weights));
  for (PetscInt k = 0; k < b->n; k++) {
    PetscCall(PetscCalloc1(b->body[k].n_samples, &o->weight[k]));
    PetscCall(PetscCalloc1(b->body[k].C.n_terms + 1, &o->share[k]));
    PetscCall(PetscCalloc1(b->body[k].H.n_terms + 1, &o->share_H[k]));
    PetscCall(PetscCalloc1(b->body[k].a.n_terms + 1, &o->share_a[k]));
    PetscCall(PetscMalloc1(b->body[k].n * b->r + 1, &o->R[k]));
  }
  PetscCall(HycoFECreate(scene, b->probe->dm, &o->fe));
  PetscCall(HycoFEKeepStiffness(o->fe)); /* of a few cells */
  /* Of a history too, thermal strains are loads here: the laws' s = C (e - e_th) - sigma leaves them out. */
  o->fe->heat_is_load = PETSC_TRUE;
  PetscCall(PetscCalloc1(b->n_variables + 1, &o->mu));
  PetscCall(PetscCalloc1(b->n * b->n_variables + 1, &o->reference));
  PetscCall(PetscMalloc1(3 * b->probe->nv * b->n, &o->X0));
  PetscCall(PetscMalloc1(b->n, &o->E0));
  PetscCall(PetscMalloc1(b->n, &o->E_at));
  for (PetscInt k = 0; k < b->n; k++) PetscCall(TakeReference(o, k, b->first));
  PetscCall(FindPlaces(o, s->fe->mesh));
  PetscCall(PetscMalloc1(b->n, &o->pose));
  PetscCall(PetscMalloc1(b->n, &o->kappa));
  PetscCall(PetscCalloc1(b->r + 1, &o->c));
  PetscCall(PetscCalloc1(b->p + 1, &o->x));
  PetscCall(PetscCalloc1(b->ns * b->p + 1, &o->Z));
  PetscCall(PetscCalloc1(b->p * b->r + 1, &o->work));
  PetscCall(PetscCalloc1(b->ns + 1, &o->elastic));
  PetscCall(PetscCalloc1(b->ns + 1, &o->free));
  PetscCall(PetscCalloc1(b->ns + b->ni + 1, &o->u));
  PetscCall(PetscCalloc1(b->ns + 1, &o->f));
  PetscCall(PetscMalloc1(m + 1, &o->row_start));
  PetscCall(GrowRows(o, HycoPairsWidth(s->pairs) * b->dim * m * b->dim + 1));
  PetscCall(PetscMalloc1(m + 1, &o->gap));
  PetscCall(PetscMalloc1(m + 1, &o->active));
  PetscCall(HycoBodiesCreateSystem(o));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the bodies at mu -- */

/* Where they are, and how stiff. */
static PetscErrorCode BodiesPlace(HycoBodiesWork o, const PetscReal mu[])
{
  const HycoSubstructures b = o->bodies;
  HycoMesh m = b->probe;
  PetscReal x[3 * HYCO_CELL_NODES], reference[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  for (PetscInt k = 0; k < b->n; k++) {
    PetscBool same;

    HycoBodiesReference(b, k, mu, reference);
    /* Only a body with samples has another shape at this mu, and only if a parameter of its shape changes. */
    PetscCall(PetscArraycmp(reference, o->reference + k * b->n_variables, b->n_variables, &same));
    if (!same) PetscCall(TakeReference(o, k, reference));
  }
  PetscCall(HycoFESetParameters(o->fe, mu));
  for (PetscInt k = 0; k < b->n; k++) {
    const PetscInt e = b->cell[k];
    const PetscReal *tangent = o->fe->tangent + o->fe->tangent_start[e];

    for (PetscInt v = 0; v < m->nv; v++) PetscCall(PetscArraycpy(x + 3 * v, o->fe->X + 3 * m->cells[e * m->nv + v], 3));
    HycoPoseFit(b->dim, m->nv, o->X0 + 3 * k * m->nv, x, &o->pose[k]);
    /* Stiffness scales as the moduli times s^p with p = 1 in 3D and axisymmetric, 0 in 2D, -1 in 1D. */
    o->kappa[k] = tangent[o->E_at[k]] / o->E0[k] * PetscPowReal(o->pose[k].s, (PetscReal)HycoPosePower(o->fe));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The coefficients of the loads. Loads are combinations of those of training; their coefficients follow from as many
   entries of the force vector (DEIM; Chaturantabut and Sorensen 2010), in the body's own axes. */
static PetscErrorCode FindLoads(HycoBodiesWork o)
{
  const HycoSubstructures b = o->bodies;
  const PetscScalar *F;
  PetscReal *value;
  Vec all;

  PetscFunctionBegin;
  if (!b->r) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(b->r, &value));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, o->fe->n_dof, &all));
  /* A few cells, most often where they were. */
  if (o->fe->thermal) PetscCall(HycoFEKeepGradients(o->fe));
  PetscCall(HycoFEAssembleForce(o->fe, all));
  PetscCall(VecGetArrayRead(all, &F));
  for (PetscInt k = 0; k < b->r; k++) {
    const PetscInt node = b->at[k] / b->dim;
    PetscReal force[3], turned[3] = {0, 0, 0};

    /* K has no rows for fixed unknowns, and training set them to zero before the turn, so that the DEIM points see
       the same vectors. */
    for (PetscInt c = 0; c < b->dim; c++) force[c] = o->fe->fixed[node * b->dim + c] ? 0 : F[node * b->dim + c];
    HycoPoseTurn(o->pose[b->at_body[k]].Q, b->dim, PETSC_TRUE, force, turned);
    value[k] = turned[b->at[k] % b->dim];
  }
  PetscCall(VecRestoreArrayRead(all, &F));
  PetscCall(VecDestroy(&all));
  for (PetscInt k = 0; k < b->r; k++) {
    o->c[k] = 0;
    for (PetscInt j = 0; j < b->r; j++) o->c[k] += b->A[k * b->r + j] * value[j];
  }
  PetscCall(PetscFree(value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The displacements that they cause without contact. */
static PetscErrorCode BodiesSolveLoad(HycoBodiesWork o)
{
  const HycoSubstructures b = o->bodies;

  PetscFunctionBegin;
  PetscCall(FindLoads(o));
  PetscCall(PetscArrayzero(o->elastic, b->ns));
  for (PetscInt k = 0; k < b->n && b->r; k++) {
    PetscReal *u = o->elastic + b->start[k];
    const PetscReal *R = o->R[k];

    for (PetscInt i = 0; i < b->body[k].n; i++, R += b->r) {
      for (PetscInt j = 0; j < b->r; j++) u[i] += R[j] * o->c[j];
      u[i] /= o->kappa[k];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rigid motions at mu, and the work of the loads on them. */
static PetscErrorCode BlendMotions(HycoBodiesWork o)
{
  const HycoSubstructures b = o->bodies;
  PetscReal *work;

  PetscFunctionBegin;
  if (!b->p) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(b->p * b->r + 1, &work));
  PetscCall(PetscArrayzero(o->work, b->p * b->r));
  for (PetscInt k = 0; k < b->n; k++) {
    const HycoSubstructure *own = &b->body[k];

    PetscCall(HycoBodiesBlend(own->n_samples, o->weight[k], own->n * b->p, own->Z, o->Z + b->start[k] * b->p));
    PetscCall(HycoBodiesBlend(own->n_samples, o->weight[k], b->p * b->r, own->work, work));
    /* A motion may move several bodies, as tied ones do: the works add up. */
    for (PetscInt i = 0; i < b->p * b->r; i++) o->work[i] += work[i];
  }
  PetscCall(PetscFree(work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Places are those of surfaces first, body after body, then those of the points inside. */
PetscInt HycoBodiesAt(HycoSubstructures b, PetscInt place)
{
  const PetscInt *start = place < b->ns ? b->start : b->inner_start;
  PetscInt k = 0;

  if (place >= b->ns) place -= b->ns;
  while (place >= start[k + 1]) k++;
  return k;
}

/* Adds an entry to the row that begins at `start`. A row has a few dozen entries: a linear search costs less than a
   map. */
static void AddEntry(HycoBodiesWork o, PetscInt start, PetscInt *end, PetscInt place, PetscReal value)
{
  for (PetscInt j = start; j < *end; j++) {
    if (o->row_at[j] != place) continue;
    o->row[j] += value;
    return;
  }
  o->row_at[*end] = place;
  o->row[(*end)++] = value;
}

/* The rows of B on the bodies' unknowns, in their axes, and the gaps that the displacements without contact leave.
   Contact rows are in the axes of space, flexibilities in those of the body: B is turned by the pose, not C, which is
   dense. */
static PetscErrorCode TurnRows(HycoBodiesWork o, const HycoBodiesSurface *s)
{
  const HycoSubstructures b = o->bodies;
  const HycoRows *rows = s->rows;
  const PetscInt dim = b->dim;
  PetscInt n = 0;

  PetscFunctionBegin;
  PetscCall(GrowRows(o, rows->start[s->n] * dim + 1)); /* mortars may meet more masters than before */
  o->row_start[0] = 0;
  o->lacks = PETSC_FALSE;
  for (PetscInt k = 0; k < s->n; k++) {
    for (PetscInt e = rows->start[k]; e < rows->start[k + 1]; e++) {
      const PetscInt place = o->loc[rows->dof[e]], node = rows->dof[e] / dim, c = rows->dof[e] % dim;
      PetscInt body;

      /* Training leaves out masters that no slave met; a prediction that meets one has no flexibility there and
         must not go on. */
      if (place < 0 || place >= b->ns) {
        o->lacks = PETSC_TRUE;
        continue;
      }
      body = HycoBodiesAt(b, place);
      for (PetscInt d = 0; d < dim; d++) {
        const PetscReal value = o->pose[body].Q[3 * c + d] * rows->value[e];

        /* A fixed component has no place: its displacement is prescribed and in the gap. value == 0 keeps rows of
           unturned bodies as sparse as in B. */
        if (value != 0 && o->loc[node * dim + d] >= 0) AddEntry(o, o->row_start[k], &n, o->loc[node * dim + d], value);
      }
    }
    o->row_start[k + 1] = n;
    o->gap[k] = rows->gap[k];
    for (PetscInt j = o->row_start[k]; j < n; j++) o->gap[k] -= o->row[j] * o->free[o->row_at[j]];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- flexibilities -- */

/* The weights of the samples at mu, and what depends on them alone; columns with other ones are forgotten. alone: only
   the weights. */
static PetscErrorCode TakeWeights(HycoBodiesWork o, const PetscReal mu[], PetscBool alone)
{
  const HycoSubstructures b = o->bodies;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < b->n; k++) {
    const PetscInt n = b->body[k].n_samples;
    PetscReal *weight;
    PetscBool same;

    PetscCall(PetscMalloc1(n, &weight));
    PetscCall(HycoBodiesWeights(b, k, mu, weight));
    PetscCall(PetscArraycmp(weight, o->weight[k], n, &same));
    /* Columns blended at other weights are stale; a study along a load keeps all of them. */
    if (!same) PetscCall(PetscArrayzero(o->blended + b->start[k], b->body[k].n));
    o->kept.weights[k] += !same;
    PetscCall(PetscFree(o->weight[k]));
    o->weight[k] = weight;
    /* The first prediction has no weights of 0 all over. */
    if (same || alone) continue;
    HycoFlexibilityShares(&b->body[k].C, n, weight, o->share[k]);
    HycoFlexibilityShares(&b->body[k].H, n, weight, o->share_H[k]);
    HycoFlexibilityShares(&b->body[k].a, n, weight, o->share_a[k]);
    PetscCall(HycoBodiesBlend(n, weight, b->body[k].n * b->r, b->body[k].R, o->R[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* u += Z x. */
static void MoveRigidly(HycoBodiesWork o)
{
  const HycoSubstructures b = o->bodies;

  for (PetscInt i = 0; i < b->ns; i++) {
    for (PetscInt j = 0; j < b->p; j++) o->u[i] += o->Z[i * b->p + j] * o->x[j];
  }
}

/* The forces are those on the surfaces' unknowns, which need not be those of contacts. */
PetscErrorCode HycoBodiesRespond(HycoBodiesWork o, const PetscReal f[])
{
  PetscFunctionBegin;
  PetscCall(PetscArraycpy(o->f, f, o->bodies->ns));
  PetscCall(PetscArraycpy(o->u, o->free, o->bodies->ns));
  PetscCall(HycoBodiesAddCompliance(o, o->f, o->u));
  MoveRigidly(o);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* u = free - C f / kappa + Z x. Exact for any forces: the approximation of the model is in C and in the samples' blend
   only. */
static PetscErrorCode BodiesSolveDisplace(HycoBodiesWork o, const HycoBodiesSurface *s, const PetscReal Lambda[])
{
  const HycoSubstructures b = o->bodies;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(o->f, b->ns));
  for (PetscInt k = 0; k < s->n; k++) {
    for (PetscInt j = o->row_start[k]; Lambda[k] != 0 && j < o->row_start[k + 1]; j++)
      o->f[o->row_at[j]] += o->row[j] * Lambda[k];
  }
  PetscCall(HycoBodiesBend(o, Lambda));
  for (PetscInt i = 0; i < b->ns; i++) o->u[i] = o->free[i] + o->bent[i];
  MoveRigidly(o);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* least[]: by contact of the scene, the depth without contact from which contacts are in the first problem: half of the
   deepest one, which is about that of those that stay closed on a rounded surface. Where all are closed, as under a
   body that a soft spring holds, the depth is that of the body's motion, and the shape of the surfaces is what is left:
   those nearest to the deepest one. */
static PetscErrorCode FirstDepth(HycoBodiesWork o, const HycoBodiesSurface *s, PetscReal size, PetscReal least[])
{
  const PetscInt n = s->fe->scene->n_contacts;
  PetscReal *deepest, *shallowest;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(n, &deepest));
  PetscCall(PetscMalloc1(n, &shallowest));
  for (PetscInt c = 0; c < n; c++) shallowest[c] = PETSC_MAX_REAL;
  for (PetscInt k = 0; k < s->n; k++) {
    const PetscInt c = s->contact[k];

    /* No master, no depth. */
    if (o->row_start[k] == o->row_start[k + 1]) continue;
    deepest[c] = PetscMax(deepest[c], -o->gap[k]);
    shallowest[c] = PetscMin(shallowest[c], -o->gap[k]);
  }
  for (PetscInt c = 0; c < n; c++) {
    const PetscReal spread = deepest[c] - shallowest[c];

    least[c] = FIRST_DEPTH * deepest[c];
    if (spread > FLAT_DEPTH * deepest[c] && shallowest[c] > least[c]) least[c] = deepest[c] - NEAREST_DEPTH * spread;
    /* Penetration of round-off size must not choose the first contacts. */
    least[c] = PetscMax(least[c], HYCO_NO_PENETRATION * size);
  }
  HycoFreeAll(&shallowest, &deepest);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* o->active: the deepest contacts, from which the others join. */
static PetscErrorCode ChooseFirst(HycoBodiesWork o, const HycoBodiesSurface *s)
{
  PetscReal *least, size = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n; k++) {
    if (o->row_start[k] < o->row_start[k + 1]) size = PetscMax(size, PetscAbsReal(o->gap[k]));
  }
  PetscCall(PetscMalloc1(s->fe->scene->n_contacts, &least));
  PetscCall(FirstDepth(o, s, size, least));
  for (PetscInt k = 0; k < s->n; k++)
    o->active[k] = (PetscBool)(o->row_start[k] < o->row_start[k + 1] && -o->gap[k] > least[s->contact[k]]);
  PetscCall(PetscFree(least));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What changes from the parameters of the last call to mu. */
static HycoChanges BodiesSolveListChanges(HycoBodiesWork o, const PetscReal mu[], PetscBool *forces)
{
  const HycoScene scene = o->fe->scene;
  PetscBool changed[HYCO_MAX_PARAMETERS] = {PETSC_FALSE};

  for (PetscInt p = 0; p < scene->n_variables; p++) changed[p] = (PetscBool)(!o->prepared || mu[p] != o->mu[p]);
  *forces = (PetscBool)(!o->prepared || HycoSceneForcesChange(scene, changed));
  return HycoSceneChanges(scene, changed);
}

/* The order matters: weights before BodiesSolveLoad() and BlendMotions(), the pose and kappa before both, all
   displacements without contact before TurnRows(), which subtracts them from the gaps. Only what the changed parameters
   enter. alone: the data of the bodies and the rows, without displacements. */
static PetscErrorCode BodiesSolveUpdate(HycoBodiesWork o, const HycoBodiesSurface *s, const PetscReal mu[],
                                        PetscBool alone)
{
  PetscBool forces;
  const HycoChanges c = BodiesSolveListChanges(o, mu, &forces);
  const PetscBool first = (PetscBool)!o->prepared;

  PetscFunctionBegin;
  /* Until all of it is there: an error leaves nothing that the next point could take over. */
  o->prepared = o->is_bent = PETSC_FALSE;
  if (first || c.nodes || c.stiffness) {
    PetscCall(TakeWeights(o, mu, alone));
    PetscCall(BodiesPlace(o, mu));
    PetscCall(BlendMotions(o));
    PetscCall(HycoBodiesMoveMotions(o, s, mu));
  } else
    PetscCall(HycoFESetParameters(o->fe, mu));
  if (forces) PetscCall(alone ? FindLoads(o) : BodiesSolveLoad(o));
  if (s) PetscCall(TurnRows(o, s));
  PetscCall(PetscArraycpy(o->mu, mu, o->fe->scene->n_variables));
  o->prepared = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesBring(HycoBodiesWork o, const HycoBodiesSurface *s, const PetscReal mu[])
{
  PetscFunctionBegin;
  PetscCall(BodiesSolveUpdate(o, s, mu, PETSC_TRUE));
  HycoCheck(!o->lacks, "beside this point, %s", HycoReasonName(HYCO_DIVERGED_SURFACE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesPrepare(HycoBodiesWork o, const HycoBodiesSurface *s, const PetscReal mu[])
{
  PetscFunctionBegin;
  PetscCall(BodiesSolveUpdate(o, s, mu, PETSC_FALSE));
  PetscCall(PetscArrayzero(o->responded, s->n));
  o->is_bent = PETSC_FALSE;
  PetscCall(HycoBodiesKeepRows(o, s->n));
  PetscCall(HycoBodiesStrain(o, s, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Starts again from `elastic`, so that repeated calls with other alpha do not accumulate. P is stored with the
   surfaces' unknowns as rows: the "transposed" of BLAS. */
PetscErrorCode HycoBodiesStrain(HycoBodiesWork o, const HycoBodiesSurface *s, const PetscReal alpha[])
{
  const HycoSubstructures b = o->bodies;
  const PetscInt m = alpha ? b->inelastic->m : 0;

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(o->free, o->elastic, b->ns));
  for (PetscInt k = 0; k < b->n && m; k++) {
    const PetscBLASInt rows = (PetscBLASInt)b->body[k].n, modes = (PetscBLASInt)m, each = 1;
    const PetscReal factor = 1 / o->kappa[k], one = 1, *P = b->inelastic->P + (size_t)b->start[k] * (size_t)m;

    /* A body without surfaces has no part in the gaps. */
    if (rows) BLASgemv_("T", &modes, &rows, &factor, P, &modes, alpha, &each, &one, o->free + b->start[k], &each);
  }
  /* The gaps without contact forces: negative ones are where contact must close. */
  for (PetscInt k = 0; k < s->n; k++) {
    o->gap[k] = s->rows->gap[k];
    for (PetscInt j = o->row_start[k]; j < o->row_start[k + 1]; j++) o->gap[k] -= o->row[j] * o->free[o->row_at[j]];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Columns of contacts with a force are kept first: HycoBodiesRowCacheDisplace() passes over those that are not, which
   would lose their displacement. */
void HycoBodiesDisplacementsOfForces(HycoBodiesWork o, const HycoBodiesSurface *s, const PetscReal Lambda[])
{
  PetscInt *closed, n = 0;

  PetscCallVoid(PetscMalloc1(s->n + 1, &closed));
  for (PetscInt k = 0; k < s->n; k++) {
    if (Lambda[k] != 0) closed[n++] = k;
  }
  PetscCallVoid(HycoBodiesKeep(o, n, closed));
  PetscCallVoid(PetscFree(closed));
  PetscCallVoid(BodiesSolveDisplace(o, s, Lambda));
}

/* Needs HycoBodiesPrepare(), and HycoBodiesStrain() for inelastic strains. Rank-local: models live on one process.
   Without the contacts that alone hold a body there is no depth to begin with. */
PetscErrorCode HycoBodiesContact(HycoBodiesWork o, const HycoBodiesSurface *s, PetscReal Lambda[], PetscBool *solved)
{
  const char *method;

  PetscFunctionBegin;
  PetscCall(HycoBodiesUpdateSystem(o));
  PetscCall(HycoSolverSetSystem(o->solver, o->system));
  if (!o->bodies->p) PetscCall(ChooseFirst(o, s));
  PetscCall(HycoSolverSetWorkingSet(o->solver, o->bodies->p ? NULL : o->active));
  PetscCall(HycoSolverSolve(o->solver, o->motion, o->L));
  PetscCall(HycoSolverGetReason(o->solver, &o->reason));
  PetscCall(HycoSolverGetIterations(o->solver, &o->its));
  PetscCall(HycoSolverGetMethod(o->solver, &method));
  PetscCall(PetscStrncpy(o->method, method, sizeof(o->method)));
  PetscCall(HycoVecRead(o->L, s->n, Lambda));
  if (o->motion) PetscCall(HycoVecRead(o->motion, o->bodies->p, o->x));
  PetscCall(BodiesSolveDisplace(o, s, Lambda));
  *solved = (PetscBool)(o->reason > 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The problem without a path: poses, rows and loads at mu, then contact. */
PetscErrorCode HycoBodiesSolve(HycoBodiesWork o, const HycoBodiesSurface *s, const PetscReal mu[], PetscReal Lambda[],
                               PetscBool *solved)
{
  PetscFunctionBegin;
  PetscCall(HycoBodiesPrepare(o, s, mu));
  PetscCall(HycoBodiesContact(o, s, Lambda, solved));
  if (o->lacks) {
    o->reason = HYCO_DIVERGED_SURFACE;
    *solved = PETSC_FALSE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* beyond: relative to the loads' sums, without the round-off of loads (of a basis of length 1) and forces that balance
   themselves. */
PetscReal HycoBodiesImbalance(HycoBodiesWork o, PetscBool beyond)
{
  const HycoSubstructures b = o->bodies;
  PetscReal *load, *size, all = 0, most;

  if (!b->p) return beyond ? 0 : -1;
  PetscCallAbort(PETSC_COMM_SELF, PetscCalloc2(b->p, &load, b->p, &size));
  for (PetscInt k = 0; k < b->p * b->r; k++) {
    load[k / b->r] += o->work[k] * o->c[k % b->r];
    size[k / b->r] += PetscAbsReal(o->work[k] * o->c[k % b->r]);
  }
  for (PetscInt i = 0; beyond && i < b->p; i++) {
    load[i] = HycoBodiesLoadWork(o, i);
    size[i] = PetscAbsReal(load[i]);
  }
  for (PetscInt j = 0; j < b->r; j++) all += PetscAbsReal(o->c[j]);
  for (PetscInt k = 0; k < b->ns; k++) all += PetscAbsReal(o->f[k]);
  most = HycoROMImbalance(b->p, b->ns, o->Z, NULL, o->f, load, size, beyond ? HYCO_LOADS_ROUND_OFF * all : 0);
  PetscCallAbort(PETSC_COMM_SELF, PetscFree2(load, size));
  return most;
}

/* Whether the contacts with a force leave a rigid motion free, which is named. By the least eigenvalue of G^T G over
   them, G = B Z, relative to the motions' squared lengths over all contacts. */
PetscErrorCode HycoBodiesFreeMotion(HycoBodiesWork o, const HycoBodiesSurface *s, const PetscReal Lambda[],
                                    PetscBool *loose, char name[HYCO_LINE])
{
  const PetscInt p = o->bodies->p;
  PetscReal *gram, *all, *g, *value, *work, least = 0;
  PetscBLASInt n, lwork, info;

  PetscFunctionBegin;
  *loose = PETSC_FALSE;
  name[0] = '\0';
  if (!p) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscBLASIntCast(p, &n));
  lwork = 8 * n;
  PetscCall(PetscCalloc5(p * p, &gram, p, &all, p, &g, p, &value, 8 * p, &work));
  for (PetscInt k = 0; k < s->n; k++) least = PetscMax(least, HYCO_FORCE_ROUND_OFF * Lambda[k]);
  for (PetscInt k = 0; k < s->n; k++) {
    HycoBodiesMotionRow(o, k, g);
    for (PetscInt i = 0; i < p; i++) all[i] += g[i] * g[i];
    for (PetscInt i = 0; i < p * p && Lambda[k] > least; i++) gram[i] += g[i / p] * g[i % p];
  }
  for (PetscInt i = 0; i < p; i++) all[i] = all[i] > 0 ? 1 / PetscSqrtReal(all[i]) : 1;
  for (PetscInt i = 0; i < p * p; i++) gram[i] *= all[i / p] * all[i % p];
  LAPACKsyev_("V", "U", &n, gram, &n, value, work, &lwork, &info);
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK syev: %d", (int)info);
  /* Squares: a share of 1e-7 of the motion, as at full order. */
  *loose = (PetscBool)(value[0] <= HYCO_FREE_MOTION);
  for (PetscInt i = 0; i < p; i++) g[i] = gram[i] * all[i];
  if (*loose) PetscCall(HycoBodiesNameMotion(o, s, Lambda, g, name));
  PetscCall(PetscFree5(gram, all, g, value, work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* By nonnegative least squares, as at full order: the rest is a motion that closes no contact. */
PetscErrorCode HycoBodiesLiftOff(HycoBodiesWork o, const HycoBodiesSurface *s, const PetscReal L[],
                                 char name[HYCO_LINE], PetscBool *lift_off)
{
  const PetscInt p = o->bodies->p;
  const PetscReal one = 1;
  const PetscBLASInt rows = (PetscBLASInt)p, columns = (PetscBLASInt)s->n, each = 1;
  PetscReal *A, *f, *force, *gram, most = 0;
  PetscBool regular, exists;

  PetscFunctionBegin;
  *lift_off = PETSC_FALSE;
  if (!p || o->lacks) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc4(p * s->n + 1, &A, p, &f, s->n + 1, &force, p * p, &gram));
  for (PetscInt i = 0; i < p; i++) f[i] = HycoBodiesLoadWork(o, i);
  for (PetscInt k = 0; k < s->n; k++) HycoBodiesMotionRow(o, k, A + k * p);
  /* In coordinates in which the motions of the surfaces are orthonormal, as at full order. */
  for (PetscInt i = 0; i < o->bodies->ns * p * p; i++) {
    const PetscReal *z = o->Z + i / (p * p) * p;

    gram[i % (p * p)] += z[i / p % p] * z[i % p];
  }
  PetscCall(HycoCholesky("U", p, gram, NULL, &regular));
  if (regular) BLAStrsm_("L", "U", "T", "N", &rows, &columns, &one, gram, &rows, A, &rows);
  if (regular) BLAStrsm_("L", "U", "T", "N", &rows, &each, &one, gram, &rows, f, &rows);
  PetscCall(HycoNormalsBalance(p, s->n, A, f, HycoBodiesLoadRounding(o), force, &exists));
  *lift_off = (PetscBool)!exists;
  for (PetscInt k = 0; k < p * s->n; k++) f[k % p] -= A[k] * force[k / p];
  if (regular) BLAStrsm_("L", "U", "N", "N", &rows, &each, &one, gram, &rows, f, &rows);
  for (PetscInt i = 0; i < p; i++) most = PetscMax(most, PetscAbsReal(f[i]));
  for (PetscInt i = 0; i < p && most > 0; i++) f[i] /= most;
  if (*lift_off) PetscCall(HycoBodiesNameMotion(o, s, L, f, name));
  PetscCall(PetscFree4(A, f, force, gram));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* |L~|_W^2 = sum of f.(C f / kappa), from the displacements by the forces. `gram` holds the errors of R in the
   norm of C^-1: that is the term |B (R~ - R) c|_{W^-1} of the bound, kappa scaling C and R alike. */
PetscReal HycoBodiesBound(HycoBodiesWork o, PetscReal *norm)
{
  const HycoSubstructures b = o->bodies;
  PetscReal loads = 0, square = 0;

  for (PetscInt k = 0; k < b->n; k++) {
    const PetscReal *gram = b->body[k].gram;

    for (PetscInt i = b->start[k]; i < b->start[k + 1]; i++) {
      PetscReal elastic = o->free[i] - o->u[i]; /* C f / kappa */

      /* Rigid motions store no energy: without them the product with f would be the work of the loads too. */
      for (PetscInt j = 0; j < b->p; j++) elastic += o->Z[i * b->p + j] * o->x[j];
      square += o->f[i] * elastic;
    }
    for (PetscInt i = 0; i < b->r * b->r; i++) loads += o->c[i / b->r] * gram[i] * o->c[i % b->r] / o->kappa[k];
  }
  *norm = PetscSqrtReal(PetscMax(square, 0));
  /* Relative to the forces; without contact there is nothing to bound. */
  return *norm > 0 ? b->bound + PetscSqrtReal(PetscMax(loads, 0)) / *norm : 0;
}

/* -- displacements -- */

/* Most bodies stay in the axes of the scene. */
static PetscBool BodiesTurn(const HycoPose *pose)
{
  for (PetscInt i = 0; i < 9; i++) {
    if (pose->Q[i] != (i % 4 == 0)) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* Turns vectors by node, not components: a node may have fixed components, whose displacement in the body's axes
   counts as 0 and which are not written. */
void HycoBodiesMove(HycoBodiesWork o, const HycoBodiesSurface *s, PetscReal U[])
{
  const PetscInt dim = o->bodies->dim;
  PetscBool turns = PETSC_TRUE;
  PetscInt body = -1;

  for (PetscInt k = 0; k < o->n_placed; k++) {
    const PetscInt i = o->placed[k] * dim, *loc = o->loc + i;
    PetscReal own[3] = {0, 0, 0}, turned[3];

    for (PetscInt c = 0; c < dim; c++) own[c] = loc[c] < 0 ? 0 : o->u[loc[c]];
    if (o->placed_in[k] != body) turns = BodiesTurn(&o->pose[body = o->placed_in[k]]);
    if (turns)
      HycoPoseTurn(o->pose[body].Q, dim, PETSC_FALSE, own, turned);
    else
      PetscCallVoid(PetscArraycpy(turned, own, 3));
    for (PetscInt c = 0; c < dim; c++) {
      /* u0 has the prescribed values; the place's value comes on top in the scene's axes. */
      if (loc[c] >= 0) U[i + c] = s->fe->u0[i + c] + turned[c];
    }
  }
}

/* row += a x - H f with these shares of the terms; a has the columns of g, too. */
PetscErrorCode HycoBodiesAddRows(HycoBodiesWork o, PetscInt k, const PetscReal share_a[], const PetscReal share_H[],
                                 const PetscReal x[], const PetscReal f[], PetscReal row[])
{
  const HycoSubstructure *own = &o->bodies->body[k];
  PetscReal *minus;

  PetscFunctionBegin;
  PetscCall(HycoFlexibilityMultiply(&own->a, share_a, x, row));
  PetscCall(PetscMalloc1(own->n + 1, &minus));
  for (PetscInt i = 0; i < own->n; i++) minus[i] = -f[i];
  PetscCall(HycoFlexibilityMultiply(&own->H, share_H, minus, row));
  PetscCall(PetscFree(minus));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* row = (a c - H f) / kappa + g x for all rows of body k, at the weights of its samples. */
PetscErrorCode HycoBodiesRows(HycoBodiesWork o, PetscInt k, PetscInt n, PetscReal row[])
{
  const HycoSubstructures b = o->bodies;
  const PetscInt n_own = b->body[k].n;
  PetscReal *x, *f;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(row, n));
  PetscCall(PetscMalloc2(b->r + b->p + 1, &x, n_own + 1, &f));
  for (PetscInt d = 0; d < b->r; d++) x[d] = o->c[d] / o->kappa[k];
  PetscCall(PetscArraycpy(x + b->r, o->x, b->p));
  for (PetscInt i = 0; i < n_own; i++) f[i] = o->f[b->start[k] + i] / o->kappa[k];
  PetscCall(HycoBodiesAddRows(o, k, o->share_a[k], o->share_H[k], x, f, row));
  PetscCall(PetscFree2(x, f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The modes of body k in its turns, and its unknowns inside. The modes were trained in several turns of the body, whose
   shares add up to its present one. */
static PetscErrorCode ExpandBody(HycoBodiesWork o, PetscInt k, PetscReal gamma[])
{
  const HycoSubstructures b = o->bodies;
  const HycoSubstructure *own = &b->body[k];
  const PetscInt turns = b->turn_start[k + 1] - b->turn_start[k], n = turns * own->l + own->m;
  PetscReal *row;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n + 1, &row));
  PetscCall(HycoBodiesRows(o, k, n, row));
  for (PetscInt j = 0; j < turns; j++) {
    PetscReal share = 0;

    /* Q = sum of q_j G_j with the orthonormal G_j of training: q_j is their inner product with Q. */
    for (PetscInt d = 0; d < 9; d++) share += b->G[9 * (b->turn_start[k] + j) + d] * o->pose[k].Q[d];
    HycoBodiesAdd(own->l, share, row + j * own->l, gamma + b->mode_start[k]);
  }
  PetscCall(PetscArraycpy(o->u + b->ns + b->inner_start[k], row + turns * own->l, own->m));
  PetscCall(PetscFree(row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After the forces are known: H, a and g are exact for any f, c and x, so that only the modes' span is an
   approximation. */
PetscErrorCode HycoBodiesExpand(HycoBodiesWork o, PetscReal gamma[])
{
  const HycoSubstructures b = o->bodies;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(gamma, b->l));
  PetscCall(PetscArrayzero(o->u + b->ns, b->ni));
  for (PetscInt k = 0; k < b->n; k++) PetscCall(ExpandBody(o, k, gamma));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* gamma += share times F alpha, l rows of m. */
static void AddProduct(PetscInt l, PetscInt m, const PetscReal F[], const PetscReal alpha[], PetscReal share,
                       PetscReal gamma[])
{
  for (PetscInt i = 0; i < l; i++, F += m) {
    for (PetscInt k = 0; k < m; k++) gamma[i] += share * F[k] * alpha[k];
  }
}

/* The rows of `fields` run over bodies, samples, turns and modes, in this order. */
void HycoBodiesAddStrainsOf(HycoBodiesWork o, PetscInt body, const PetscReal alpha[], PetscReal gamma[])
{
  const HycoSubstructures b = o->bodies;
  const HycoSubstructure *own = &b->body[body];
  const PetscInt m = b->inelastic->m, turns = b->turn_start[body + 1] - b->turn_start[body];
  const PetscReal *F = b->inelastic->fields;

  for (PetscInt k = 0; k < body; k++)
    F += (size_t)(b->body[k].n_samples * (b->turn_start[k + 1] - b->turn_start[k]) * b->body[k].l) * (size_t)m;
  for (PetscInt j = 0; j < own->n_samples * turns; j++, F += (size_t)own->l * (size_t)m) {
    PetscReal share = 0;

    /* Fields are stored for a basis of turns G, since a vector field turns linearly with Q. */
    for (PetscInt d = 0; d < 9; d++) share += b->G[9 * (b->turn_start[body] + j % turns) + d] * o->pose[body].Q[d];
    AddProduct(own->l, m, F, alpha, share * o->weight[body][j / turns] / o->kappa[body], gamma + b->mode_start[body]);
  }
}

/* After HycoBodiesExpand(), which overwrites gamma. */
void HycoBodiesAddStrains(HycoBodiesWork o, const PetscReal alpha[], PetscReal gamma[])
{
  for (PetscInt k = 0; k < o->bodies->n; k++) HycoBodiesAddStrainsOf(o, k, alpha, gamma);
}
