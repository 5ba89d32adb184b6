/*
  Training of bodies that deform inelastically. Elastic responses to loads and contact forces are exact, so that modes
  are needed for what the stresses lack of the elastic ones alone, s = sum of alpha_k s_k: the displacements K^-1 q_k of
  their nodal forces on the surfaces (P), in the cells of the points at which the laws are evaluated (A), and in the
  modes of fields. In these cells displacements are exact too: rows of K^-1 for surface forces (C) and loads (R).
*/
#include <hycoalgorithms.h>
#include <hycobodiestraining.h>
#include <hycoinelasticpoints.h>

#define COLUMNS_AT_ONCE 64 /* right-hand sides at once */

/* -- unsupported scenes -- */

/* Whether the stiffness, or a body that flows, changes in a way that the modes do not follow. */
static PetscErrorCode CheckChanges(HycoReducer t)
{
  const HycoBodyParts *parts = &HycoTrainingOfBodies(t)->parts;
  const HycoScene s = t->scene;
  HycoMesh m = t->fom->part;
  PetscBool *flows;

  PetscFunctionBegin;
  for (PetscInt p = s->n_parameters; p < s->n_variables; p++) {
    PetscBool changed[HYCO_MAX_PARAMETERS] = {PETSC_FALSE};
    HycoChanges c;

    /* Variables beyond the parameters: the time and the tables of the history. */
    changed[p] = PETSC_TRUE;
    c = HycoSceneChanges(s, changed);
    HycoCheckModel(!c.stiffness && !c.rows && !c.nodes,
                   "%s affects %s, and bodies of a model of bodies have one stiffness and one place along a path; use "
                   "-hyco_model_type hybrid",
                   s->parameter[p], c.stiffness ? "the stiffness" : "the contacts' directions");
  }
  PetscCall(PetscCalloc1(parts->n, &flows));
  for (PetscInt e = 0; e < m->n_cells; e++) {
    if (HycoInelasticFlows(t->fom->fe, e)) flows[parts->of[m->cells[e * m->nv]]] = PETSC_TRUE;
  }
  HycoAllreduce(flows, parts->n, HYCO_MPI_BOOL, MPI_LOR, HycoComm(t));
  for (PetscInt k = 0; k < parts->n; k++) {
    PetscInt shape[HYCO_MAX_PARAMETERS];

    /* One stiffness for all paths: P, A and C below are computed at one theta. */
    HycoCheckModel(!flows[k] || !HycoBodyPartsShapes(parts, k, shape),
                   "%s changes the shape or the ratio of moduli of body %s, which deforms inelastically; a model of "
                   "bodies does not support that: train a hybrid model",
                   s->parameter[shape[0]], parts->name[k]);
  }
  PetscCall(PetscFree(flows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Before the solutions of training are spent on the type: all of it follows from the scene and mesh. */
PetscErrorCode HycoBodiesCheckPath(HycoReducer t)
{
  const HycoScene s = t->scene;
  PetscBool oblique = PETSC_FALSE, rigid = PETSC_FALSE;

  PetscFunctionBegin;
  HycoCheckModel(t->sizes[3] > 1, "-hyco_model_type bodies with a history is for 2D and 3D; in 1D use hybrid");
  for (PetscInt k = 0; k < s->n_fixed; k++) oblique = (PetscBool)(oblique || s->fixed[k].normal);
  for (PetscInt k = 0; k < s->n_contacts; k++) rigid = (PetscBool)(rigid || s->contact[k]->rigid);
  HycoCheckModel(!s->n_ties && !oblique && !rigid,
                 "the scene has %s, which a model of bodies with a history does not support; train a hybrid model",
                 s->n_ties ? "ties"
                 : rigid   ? "a contact of type rigid"
                           : "a support along a direction");
  /* Last, because it evaluates expressions over the ranges. */
  PetscCall(CheckChanges(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- modes and points -- */

/* From the training solutions alone, before any factor of the bodies; called again after the training set has
   grown. */
PetscErrorCode HycoBodiesStrainModes(HycoReducer t, HycoSnapshots store)
{
  HycoBodiesTraining s = HycoTrainingOfBodies(t);

  PetscFunctionBegin;
  PetscCall(PetscNew(&s->bodies->inelastic));
  PetscCall(MatDestroy(&s->strains.V));
  PetscCall(PetscFree(s->strains.sigma));
  PetscCall(HycoPointsSample(t, store, s->inelastic_tol, &s->strains));
  s->bodies->inelastic->m = s->strains.l;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes these points those of the model, ascending, and their cells its cells; takes ownership. Every rank has the
   same points; all of a model's cells with laws are seeds, and t->seeds_cell makes them the model's mesh. */
static PetscErrorCode TakePoints(HycoReducer t, PetscInt count, PetscInt point[])
{
  HycoBodiesInelastic in = HycoTrainingOfBodies(t)->bodies->inelastic;
  const PetscInt nq = HycoElementGet(t->fom->part->type)->nq;
  const size_t size = (size_t)in->m * (size_t)(count * t->fom->fe->n_sigma) + 1;
  PetscInt *cell;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(count + 1, &cell)); /* a mesh needs a cell */
  for (PetscInt i = 0; i < count; i++) cell[i] = point[i] / nq;
  /* Without a point (laws that never flow in training) the mesh still needs a cell. */
  t->n_seeds_cell = PetscMax(count, 1);
  PetscCall(PetscSortRemoveDupsInt(&t->n_seeds_cell, cell));
  PetscCall(PetscFree(t->seeds_cell));
  t->seeds_cell = cell;
  /* The index of a point is cell in the whole mesh times points per cell, plus its number there. */
  in->point = point;
  in->n_points = HycoTrainingOfBodies(t)->n_laws = count;
  PetscCall(PetscCalloc1(size, &in->T));
  PetscCall(PetscCalloc1(size, &in->there));
  PetscCall(PetscCalloc1(count + 1, &in->weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The modes at the chosen points and their pseudo-inverse, so far of sqrt(w) s. Collective. */
static PetscErrorCode TakeThere(HycoReducer t, PetscReal inverse[], PetscReal *smallest)
{
  HycoBodiesTraining s = HycoTrainingOfBodies(t);
  HycoBodiesInelastic in = s->bodies->inelastic;

  PetscFunctionBegin;
  PetscCall(HycoPointsInverse(&s->strains, t->fom->fe->n_sigma, in->n_points, in->point, inverse, in->there, smallest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Interpolation: the modes' Q-DEIM points; T is the pseudo-inverse of the modes there. Collective. */
static PetscErrorCode BodyInelasticInterpolate(HycoReducer t)
{
  HycoBodiesTraining s = HycoTrainingOfBodies(t);
  HycoBodiesInelastic in = s->bodies->inelastic;
  PetscInt *point, count = 0;
  PetscReal smallest;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(s->cells * in->m + 1, &point));
  PetscCall(HycoPointsChoose(&s->strains, t->fom->fe->n_sigma, s->cells, &count, point));
  PetscCall(TakePoints(t, count, point));
  PetscCall(TakeThere(t, in->T, &smallest));
  /* An error of s at the points enters alpha with the norm of the pseudo-inverse at most. */
  in->amplification = 1 / smallest;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- what the modes displace -- */

/* The free unknowns of the chosen cells. */
typedef struct {
  PetscInt n, *dof, *body, *global; /* as in HycoBodiesInelastic; numbers in the distributed vectors */
} Unknowns;

/* Lists those of this rank's own nodes. */
static PetscErrorCode ListOwn(HycoReducer t, Unknowns *own)
{
  HycoMesh m = t->fom->part;
  const PetscInt n = m->nv * m->dim;
  PetscBool *taken;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(m->n_nodes * m->dim + 1, &taken));
  PetscCall(
      PetscMalloc3(t->n_seeds_cell * n, &own->dof, t->n_seeds_cell * n, &own->body, t->n_seeds_cell * n, &own->global));
  for (PetscInt e = 0; e < m->n_cells; e++) {
    PetscInt at;

    PetscCall(PetscFindInt(m->cell_whole ? m->cell_whole[e] : e, t->n_seeds_cell, t->seeds_cell, &at));
    for (PetscInt i = 0; i < n && at >= 0; i++) {
      const PetscInt k = HycoCellUnknown(m, e, i), node = k / m->dim, place = HycoMeshOwned(m, node);

      /* Each unknown once, by the owner of its node; cells at the border of a part are in several. */
      if (place < 0 || taken[k] || t->fom->fe->fixed[k]) continue;
      taken[k] = PETSC_TRUE;
      own->dof[own->n] = (m->node_whole ? m->node_whole[node] : node) * m->dim + k % m->dim;
      own->body[own->n] = HycoTrainingOfBodies(t)->parts.of[node];
      own->global[own->n++] = (m->first + place) * m->dim + k % m->dim;
    }
  }
  PetscCall(PetscFree(taken));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All of them, ascending, on every rank. Collective. Three gathers in the same order of ranks, then one sort:
   numbers, bodies and rows stay together. */
static PetscErrorCode ListAll(HycoReducer t, Unknowns *all)
{
  Unknowns own = {0};
  PetscInt *order, *packed[3];

  PetscFunctionBegin;
  HycoOnEach(HycoComm(t), ListOwn(t, &own));
  for (int k = 0; k < 3; k++)
    PetscCall(HycoConcatenateAll(HycoComm(t), own.n,
                                 k == 0   ? own.dof
                                 : k == 1 ? own.body
                                          : own.global,
                                 MPIU_INT, sizeof(PetscInt), &all->n, &packed[k]));
  PetscCall(PetscFree3(own.dof, own.body, own.global));
  PetscCall(PetscMalloc1(all->n + 1, &order));
  PetscCall(PetscMalloc1(all->n + 1, &all->body));
  PetscCall(PetscMalloc1(all->n + 1, &all->global));
  for (PetscInt i = 0; i < all->n; i++) order[i] = i;
  all->dof = packed[0];
  /* By number in the whole mesh: the order does not depend on the partition. */
  PetscCall(PetscSortIntWithArray(all->n, all->dof, order));
  for (PetscInt i = 0; i < all->n; i++) {
    all->body[i] = packed[1][order[i]];
    all->global[i] = packed[2][order[i]];
  }
  HycoFreeAll(&packed[1], &packed[2], &order);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Column k of a table with n columns: the values of x at the unknowns that this rank has. */
static PetscErrorCode TakeValues(const Unknowns *at, Vec x, PetscInt k, PetscInt n, PetscReal table[])
{
  const PetscScalar *a;
  PetscInt lo, hi;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(x, &lo, &hi));
  PetscCall(VecGetArrayRead(x, &a));
  for (PetscInt i = 0; i < at->n; i++) {
    /* The other rows stay 0, and the sum over ranks completes the table (FillCells()). */
    if (at->global[i] >= lo && at->global[i] < hi) table[(size_t)i * (size_t)n + (size_t)k] = a[at->global[i] - lo];
  }
  PetscCall(VecRestoreArrayRead(x, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x = K^-1 F; the surfaces' displacements u. Collective. F: inelastic forces of one mode. The rigid motions' work is
   not needed: such forces are self-equilibrated. */
static PetscErrorCode BodyInelasticDisplace(HycoSubstructures b, HycoBodiesFactor *factor, Vec F, PetscReal u[], Vec *x)
{
  PetscReal *work;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(b->p + 1, &work));
  PetscCall(HycoBodiesReduce(b, factor, 1, &F, u, work));
  PetscCall(VecDuplicate(F, x));
  PetscCall(HycoBodiesExtend(b, factor, 1, &F, NULL, x));
  PetscCall(PetscFree(work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* F = the nodal forces of mode k, 0 where fixed. Collective. */
static PetscErrorCode ForceOfMode(HycoReducer t, HycoFOM f, PetscInt k, Vec F)
{
  const PetscInt dim = f->part->dim;
  PetscReal *value, *force;
  PetscScalar *v;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(f->part->n_cells * HycoPointRows(t) + 1, &value));
  PetscCall(PetscCalloc1(f->fe->n_dof + 1, &force));
  PetscCall(HycoPointsMode(t, &HycoTrainingOfBodies(t)->strains, k, value));
  /* Includes ghost cells, so that the sums at owned nodes are complete. */
  HycoOnEach(HycoComm(t), HycoPointsForces(f->fe, value, force));
  PetscCall(VecGetArray(F, &v));
  for (PetscInt i = 0; i < f->fe->n_dof; i++) {
    const PetscInt own = HycoMeshOwned(f->part, i / dim);

    /* Fixed unknowns carry a reaction, no load. */
    if (own >= 0) v[own * dim + i % dim] = f->fe->fixed[i] ? 0 : force[i];
  }
  PetscCall(VecRestoreArray(F, &v));
  HycoFreeAll(&value, &force);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The responses to the modes: P and the fields; work[m x m]: of the modes on these, Q^T K^-1 Q. Collective. One solve
   for each mode; every later path combines these. */
static PetscErrorCode BodyInelasticRespond(HycoReducer t, HycoBodiesFactor *factor, PetscReal u[], PetscReal work[])
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  HycoBodiesInelastic in = b->inelastic;
  Vec F;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(in->m + 1, &factor->strain));
  if (!in->m) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(factor->fom->F, &F));
  for (PetscInt k = 0; k < in->m; k++) {
    PetscCall(ForceOfMode(t, factor->fom, k, F));
    PetscCall(BodyInelasticDisplace(b, factor, F, u, &factor->strain[k]));
    factor->n_strains++;
    for (PetscInt i = 0; i < b->ns; i++) in->P[(size_t)i * (size_t)in->m + (size_t)k] = u[i];
    /* Q^T K^-1 Q is symmetric: half of the products. */
    for (PetscInt i = 0; i <= k; i++) {
      PetscCall(VecDot(F, factor->strain[i], &work[i * in->m + k]));
      work[k * in->m + i] = work[i * in->m + k];
    }
  }
  PetscCall(VecDestroy(&F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of the cells' unknowns for forces on the surfaces, C: K is symmetric. Collective. N K^-1 e_j for each
   unknown j, by reciprocity: as many solves as unknowns in the cells, instead of one for each unknown of the
   surfaces. Each row is complete on every rank. */
static PetscErrorCode FillForces(HycoReducer t, HycoBodiesFactor *factor, const Unknowns *at)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  PetscReal *work;
  PetscScalar *v;
  PetscInt lo, hi;
  Vec e[COLUMNS_AT_ONCE];

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(COLUMNS_AT_ONCE * b->p + 1, &work));
  for (PetscInt j = 0; j < COLUMNS_AT_ONCE; j++) PetscCall(VecDuplicate(factor->fom->F, &e[j]));
  PetscCall(VecGetOwnershipRange(e[0], &lo, &hi));
  for (PetscInt first = 0; first < at->n; first += COLUMNS_AT_ONCE) {
    /* A block of unit loads per solve; the last block may be smaller. */
    const PetscInt many = PetscMin(COLUMNS_AT_ONCE, at->n - first);

    for (PetscInt j = 0; j < many; j++) {
      const PetscInt row = at->global[first + j];

      PetscCall(VecZeroEntries(e[j]));
      PetscCall(VecGetArray(e[j], &v));
      if (row >= lo && row < hi) v[row - lo] = 1;
      PetscCall(VecRestoreArray(e[j], &v));
    }
    /* Straight into the rows of C: they lie one after the other, by unknown. */
    PetscCall(HycoBodiesReduce(b, factor, many, e, b->inelastic->C + (size_t)first * (size_t)b->ns, work));
    /* The work of a unit force on the rigid motions is the displacement of its unknown in them. */
    PetscCall(PetscArraycpy(b->inelastic->Z + first * b->p, work, many * b->p));
    PetscCall(HycoReducerTell(t, "displacements of the cells with laws", first + many, at->n));
  }
  for (PetscInt j = 0; j < COLUMNS_AT_ONCE; j++) PetscCall(VecDestroy(&e[j]));
  PetscCall(PetscFree(work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same for loads, R. Collective. */
static PetscErrorCode FillLoads(HycoReducer t, HycoBodiesFactor *factor, const Unknowns *at, PetscReal u[])
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < b->r; k++) {
    Vec x;

    /* Full displacements, of which the cells' unknowns are taken: loads are few. */
    PetscCall(BodyInelasticDisplace(b, factor, factor->basis[k], u, &x));
    PetscCall(TakeValues(at, x, k, b->r, b->inelastic->R));
    PetscCall(VecDestroy(&x));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- laws at few points -- */

/* Whether a law yields, on any rank. Laws may fail on one rank alone. Collective. */
static PetscErrorCode BodyInelasticIsYielding(HycoReducer t, PetscBool *yields)
{
  PetscFunctionBegin;
  HycoOnEach(HycoComm(t), HycoFEYields(t->fom->fe, t->scene->times[0], yields));
  HycoAllreduce(yields, 1, HYCO_MPI_BOOL, MPI_LOR, HycoComm(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Columns of X become X M, with M m x l column major; x: their number, then l. Collective. MAXPY into new vectors,
   since X is needed until the last column. */
static PetscErrorCode BodyInelasticCombine(PetscInt m, PetscInt l, const PetscReal M[], Vec X[])
{
  Vec *Y;

  PetscFunctionBegin;
  PetscCall(VecDuplicateVecs(X[0], l, &Y));
  for (PetscInt j = 0; j < l; j++) PetscCall(VecMAXPY(Y[j], m, M + j * m, X));
  for (PetscInt k = 0; k < m; k++) {
    PetscCall(VecDestroy(&X[k]));
    /* The first l places have the new vectors, the others are gone. */
    if (k < l) X[k] = Y[k];
  }
  PetscCall(PetscFree(Y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes the modes' displacements that have energy, orthonormal in it: the inelastic forces of the paths are sums of
   sigma_k q_k, so that the eigenvectors of their displacements' Gram matrix are those of a POD of the displacements.
   work[m x m]: Q^T K^-1 Q. The modes of the forces stay. Collective. */
static PetscErrorCode BodyInelasticOrthogonalise(HycoReducer t, HycoBodiesFactor *factor, const PetscReal work[])
{
  HycoBodiesTraining s = HycoTrainingOfBodies(t);
  HycoSubstructures b = s->bodies;
  HycoBodiesInelastic in = b->inelastic;
  const PetscInt m = in->m;
  const PetscReal *scale = s->strains.sigma;
  PetscReal *gram, *M, *sigma, *P;
  PetscInt l;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(m * m, &gram, m, &sigma));
  for (PetscInt i = 0; i < m * m; i++) gram[i] = scale[i / m] * work[i] * scale[i % m];
  /* By the Gram matrix: m is some tens, and vectors of the mesh's length are not factored again. */
  PetscCall(HycoPODGram(m, gram, s->inelastic_tol, 0, &M, &l, sigma));
  for (PetscInt i = 0; i < m * l; i++) M[i] *= scale[i % m];
  PetscCall(BodyInelasticCombine(m, l, M, factor->strain));
  PetscCall(PetscCalloc1((size_t)b->ns * (size_t)l + 1, &P));
  for (PetscInt i = 0; i < b->ns; i++) {
    for (PetscInt d = 0; d < l * m; d++) P[i * l + d / m] += in->P[i * m + d % m] * M[d];
  }
  PetscCall(PetscFree(in->P));
  in->P = P;
  in->m = factor->n_strains = l;
  PetscCall(PetscFree(M));
  PetscCall(PetscFree2(gram, sigma));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The work of values sqrt(w) s in the cells of the part on m displacements (n_dof each): work, n_cells x m. */
static PetscErrorCode WorkOnModes(HycoFE fe, const PetscReal value[], PetscInt m, const PetscReal u[], PetscReal work[])
{
  const PetscInt n = fe->mesh->nv * fe->dim, size = HycoElementGet(fe->mesh->type)->nq * fe->n_sigma;
  PetscReal force[HYCO_MAX_CELL_DOFS];

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(work, fe->mesh->n_cells * m));
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++) {
    if (!HycoInelasticFlows(fe, e)) continue;
    PetscCall(PetscArrayzero(force, n));
    PetscCall(HycoPointsCellForce(fe, e, value + e * size, force));
    for (PetscInt k = 0; k < n; k++) {
      const PetscInt unknown = HycoCellUnknown(fe->mesh, e, k);

      /* Work on prescribed displacements is no equation of the model. */
      for (PetscInt d = 0; d < m && !fe->fixed[unknown] && force[k] != 0; d++)
        work[e * m + d] += force[k] * u[(size_t)d * (size_t)fe->n_dof + (size_t)unknown];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The work of the largest n_k modes of the stresses on the modes' displacements in each cell, a column for each pair,
   by the stresses' sizes: rows in the file's order. Collective. J of the empirical cubature: the sum over all cells
   is what the weights must reproduce. sigma_k scales each stress mode to its share in the training paths. */
static PetscErrorCode BodyInelasticContributions(HycoReducer t, HycoBodiesFactor *factor, PetscInt n_k, Mat *S)
{
  const HycoBasis *modes = &HycoTrainingOfBodies(t)->strains;
  HycoFE fe = t->fom->fe;
  const PetscInt m = factor->n_strains, n_cells = fe->mesh->n_cells;
  const HycoFileOrder *order;
  PetscReal *u, *value, *work, *rows;
  PetscScalar *s;
  PetscInt lds, n_rows;

  PetscFunctionBegin;
  PetscCall(HycoFOMGetRows(t->fom, &order));
  /* On one rank the file's order is the mesh's. */
  n_rows = order ? order->n[HYCO_ON_CELLS] : n_cells;
  PetscCall(MatCreateDense(HycoComm(t), n_rows, PETSC_DECIDE, t->sizes[1], m * n_k, NULL, S));
  PetscCall(PetscMalloc4((size_t)m * (size_t)fe->n_dof + 1, &u, n_cells * HycoPointRows(t) + 1, &value, n_cells * m + 1,
                         &work, n_rows * m + 1, &rows));
  for (PetscInt i = 0; i < m; i++)
    PetscCall(HycoFOMToLocal(factor->fom, factor->strain[i], u + (size_t)i * (size_t)fe->n_dof));
  PetscCall(MatDenseGetLDA(*S, &lds));
  PetscCall(MatDenseGetArray(*S, &s));
  for (PetscInt k = 0; k < n_k; k++) {
    PetscCall(HycoPointsMode(t, modes, k, value));
    /* The work of one stress mode on all displacement modes in a cell at once. */
    HycoOnEach(HycoComm(t), WorkOnModes(fe, value, m, u, work));
    PetscCall(HycoFOMToRows(t->fom, HYCO_ON_CELLS, MPIU_REAL, m, work, rows));
    /* Column of the pair (stress k, displacement i): all of a stress mode's pairs beside each other. */
    for (PetscInt i = 0; i < n_rows * m; i++)
      s[(size_t)(k * m + i % m) * (size_t)lds + (size_t)(i / m)] = modes->sigma[k] * rows[i];
  }
  PetscCall(MatDenseRestoreArray(*S, &s));
  PetscCall(HycoMatAssemble(*S));
  PetscCall(PetscFree4(u, value, work, rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All points of the cells with weights w (rank 0) as those of the model; weight[] ordered as they are. Single points
   would do for the training paths, but where an unseen plastic front decides, whole cells are much more accurate.
   Collective. */
static PetscErrorCode TakeWeighted(HycoReducer t, const PetscReal w[], PetscReal **weight)
{
  const PetscInt nq = HycoElementGet(t->fom->part->type)->nq;
  PetscInt *point, count = 0;

  PetscFunctionBegin;
  for (PetscInt e = 0; !t->rank && e < t->sizes[1]; e++) count += w[e] > 0 ? nq : 0;
  PetscCallMPI(MPI_Bcast(&count, 1, MPIU_INT, 0, HycoComm(t)));
  PetscCall(PetscMalloc1(count + 1, &point));
  PetscCall(PetscMalloc1(count + 1, weight));
  for (PetscInt i = 0, n = 0; !t->rank && i < t->sizes[1] * nq; i++) {
    if (!(w[i / nq] > 0)) continue;
    (*weight)[n] = w[i / nq];
    point[n++] = i;
  }
  /* Weights are on rank 0; all ranks list the same points, in the order of the whole mesh. */
  HycoBcast(point, count, MPIU_INT, HycoComm(t));
  HycoBcast(*weight, count, MPIU_REAL, HycoComm(t));
  PetscCall(TakePoints(t, count, point));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Galerkin's method on the modes' displacements A, orthonormal in energy, with a cubature: alpha = sum over points of
   weight w (B A)^T s. Collective. */
static PetscErrorCode BodyInelasticCubature(HycoReducer t, HycoBodiesFactor *factor, PetscReal **weight)
{
  HycoBodiesTraining s = HycoTrainingOfBodies(t);
  HycoBodiesInelastic in = s->bodies->inelastic;
  PetscReal *sigma, *w, error[2];
  PetscBool *elastic;
  PetscInt n_k = 0, n;
  Mat S, W;

  PetscFunctionBegin;
  /* Modes below the tolerance of the cubature would only add columns. */
  while (n_k < s->strains.l && s->strains.sigma[n_k] > s->cubature_tol * s->strains.sigma[0]) n_k++;
  PetscCall(BodyInelasticContributions(t, factor, n_k, &S));
  PetscCall(PetscCalloc1(in->m * n_k + 1, &sigma));
  PetscCall(HycoReducerPOD(t, S, s->cubature_tol * s->cubature_tol, 0, &W, &n, sigma));
  PetscCall(MatDestroy(&S));
  /* Which cells of the part are elastic. For HycoCubatureFind(), whose `near` cells are in no equation and get the
     weight 0 here. */
  PetscCall(PetscMalloc1(t->fom->part->n_cells + 1, &elastic));
  for (PetscInt e = 0; e < t->fom->part->n_cells; e++) elastic[e] = (PetscBool)!HycoInelasticFlows(t->fom->fe, e);
  PetscCall(PetscCalloc1(t->rank ? 1 : t->sizes[1], &w));
  PetscCall(HycoCubatureFind(t, elastic, 0, s->cubature_tol, W, n, sigma, w, error));
  PetscCall(MatDestroy(&W));
  HycoFreeAll(&elastic, &sigma);
  PetscCall(TakeWeighted(t, w, weight));
  PetscCall(PetscFree(w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The weight of point p, point q of the part's cell e, and with a cubature its rows of T, weight w B A. T_p =
   weight w B A: alpha = sum over points of T_p^T s_p. A fixed unknown is not listed, and its row of A is 0. */
static PetscErrorCode FillPoint(HycoReducer t, const Unknowns *at, const PetscReal weight[], PetscInt e, PetscInt q,
                                PetscInt p)
{
  HycoBodiesInelastic in = HycoTrainingOfBodies(t)->bodies->inelastic;
  HycoFE fe = t->fom->fe;
  HycoMesh part = fe->mesh;
  const PetscInt m = in->m, n = part->nv * part->dim, ns = fe->n_sigma;
  PetscReal B[6 * HYCO_MAX_CELL_DOFS];

  PetscFunctionBegin;
  /* B, the strains at the point by the cell's displacements, and its weight w. */
  PetscCall(HycoFEPointRows(fe, e, q, B, &in->weight[p]));
  for (PetscInt i = 0; i < n && weight; i++) {
    const PetscInt k = HycoCellUnknown(part, e, i), node = k / part->dim;
    PetscInt row;

    /* Unknowns of the cells are sorted by number; -1: fixed, with no displacement by any load. */
    PetscCall(PetscFindInt((part->node_whole ? part->node_whole[node] : node) * part->dim + k % part->dim, at->n,
                           at->dof, &row));
    for (PetscInt c = 0; c < ns && row >= 0; c++) {
      for (PetscInt d = 0; d < m; d++)
        in->T[(p * ns + c) * m + d] += weight[p] * in->weight[p] * B[c * n + i] * in->A[row * m + d];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A cell counts on the rank that owns its first node: on others its copy would be summed again. */
static PetscErrorCode FillOwnPoints(HycoReducer t, const Unknowns *at, const PetscReal weight[])
{
  HycoBodiesInelastic in = HycoTrainingOfBodies(t)->bodies->inelastic;
  HycoMesh part = t->fom->part;
  const PetscInt nq = HycoElementGet(part->type)->nq;

  PetscFunctionBegin;
  for (PetscInt e = 0; e < part->n_cells; e++) {
    for (PetscInt q = 0; q < nq && HycoMeshOwned(part, part->cells[e * part->nv]) >= 0; q++) {
      PetscInt p;

      PetscCall(PetscFindInt((part->cell_whole ? part->cell_whole[e] : e) * nq + q, in->n_points, in->point, &p));
      /* Points that were not chosen have no laws. */
      if (p >= 0) PetscCall(FillPoint(t, at, weight, e, q, p));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Weights and T of the points; T and the modes there are of s. weight: of the cubature, NULL: interpolation.
   Collective. */
static PetscErrorCode FillPoints(HycoReducer t, const Unknowns *at, const PetscReal weight[])
{
  HycoBodiesInelastic in = HycoTrainingOfBodies(t)->bodies->inelastic;
  const PetscInt size = t->fom->fe->n_sigma * in->m;

  PetscFunctionBegin;
  HycoOnEach(HycoComm(t), FillOwnPoints(t, at, weight));
  HycoAllreduce(in->weight, in->n_points, MPIU_REAL, MPI_SUM, HycoComm(t));
  if (weight) HycoAllreduce(in->T, in->n_points * size, MPIU_REAL, MPI_SUM, HycoComm(t));
  for (PetscInt i = 0; i < in->n_points * size && !weight; i++) {
    /* From sqrt(w) s, in which the modes are orthonormal, to s, which the laws give. */
    in->T[i] *= PetscSqrtReal(in->weight[i / size]);
    in->there[i] /= PetscSqrtReal(in->weight[i / size]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The points and their cells' rows for forces, loads and modes. weight: of the cubature, NULL: interpolation.
   Collective. nd unknowns of the cells with laws, the same list on all ranks, each row filled by the owner. */
static PetscErrorCode FillCells(HycoReducer t, HycoBodiesFactor *factor, const PetscReal weight[], PetscReal u[])
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  HycoBodiesInelastic in = b->inelastic;
  Unknowns at = {0};

  PetscFunctionBegin;
  PetscCall(ListAll(t, &at));
  in->nd = at.n;
  in->dof = at.dof;
  in->body = at.body;
  PetscCall(PetscCalloc1((size_t)at.n * (size_t)in->m + 1, &in->A));
  PetscCall(PetscCalloc1((size_t)at.n * (size_t)b->ns + 1, &in->C));
  PetscCall(PetscCalloc1((size_t)at.n * (size_t)b->r + 1, &in->R));
  PetscCall(PetscCalloc1(at.n * b->p + 1, &in->Z));
  for (PetscInt k = 0; k < in->m; k++) PetscCall(TakeValues(&at, factor->strain[k], k, in->m, in->A));
  PetscCall(FillForces(t, factor, &at));
  PetscCall(FillLoads(t, factor, &at, u));
  /* C is complete already, A and R have the rows of this rank. */
  HycoAllreduce(in->A, at.n * in->m, MPIU_REAL, MPI_SUM, HycoComm(t));
  HycoAllreduce(in->R, at.n * b->r, MPIU_REAL, MPI_SUM, HycoComm(t));
  PetscCall(FillPoints(t, &at, weight));
  PetscCall(PetscFree(at.global));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The laws at few points by the method that fits them. weight: of the cubature, NULL: interpolation. Collective. */
static PetscErrorCode ChoosePoints(HycoReducer t, HycoBodiesFactor *factor, const PetscReal work[], PetscReal **weight)
{
  HycoBodiesTraining s = HycoTrainingOfBodies(t);
  HycoBodiesInelastic in = s->bodies->inelastic;
  PetscBool yields = (PetscBool)(s->laws == HYCO_BODIES_CUBATURE);

  PetscFunctionBegin;
  *weight = NULL;
  if (s->laws == HYCO_BODIES_AUTO && in->m) PetscCall(BodyInelasticIsYielding(t, &yields));
  /* Creep is smooth in space, so that few points interpolate it; plastic fronts need Galerkin's method. */
  if (!yields || !in->m) {
    PetscCall(BodyInelasticInterpolate(t));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(BodyInelasticOrthogonalise(t, factor, work));
  PetscCall(BodyInelasticCubature(t, factor, weight));
  in->amplification = 1;
  in->weighted = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At `first`, the only place: CheckChanges() has refused what would change the stiffness or shape of a body that
   flows. */
PetscErrorCode HycoBodiesStrains(HycoReducer t, HycoBodiesFactor *factor)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  HycoBodiesInelastic in = b->inelastic;
  PetscReal theta[HYCO_MAX_PARAMETERS], *u, *work, *weight = NULL;

  PetscFunctionBegin;
  /* Points and weights are those of the positions at which the factors are. */
  PetscCall(HycoFOMSetParameters(t->fom, b->first));
  HycoBodiesPoint(t, 0, theta);
  PetscCall(HycoBodiesRefactor(t, factor, theta));
  PetscCall(PetscCalloc1((size_t)b->ns * (size_t)in->m + 1, &in->P));
  PetscCall(PetscMalloc2(b->ns + 1, &u, in->m * in->m + 1, &work));
  PetscCall(BodyInelasticRespond(t, factor, u, work));
  PetscCall(ChoosePoints(t, factor, work, &weight));
  /* After the points are chosen: only their cells need displacements. */
  PetscCall(FillCells(t, factor, weight, u));
  PetscCall(PetscFree(weight));
  PetscCall(PetscFree2(u, work));
  PetscFunctionReturn(PETSC_SUCCESS);
}
