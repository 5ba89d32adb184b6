/*
  Training of bodies that deform inelastically. Elastic responses to loads and contact forces are exact, so that modes
  are needed for the nodal forces of inelastic strains alone, q = sum of alpha_k q_k: their displacements
  K^-1 q_k on the surfaces (P), in the cells in which the laws are evaluated (A), and in the modes of fields. In these
  cells, chosen by Q-DEIM on the q_k, displacements are exact too: rows of K^-1 for surface forces (C) and loads (R).
*/
#include <hycoalgorithms.h>
#include <hycobodiestraining.h>
#include <hycoinelasticmodes.h>

#define MANY  64  /* right-hand sides at once */
#define LARGE 0.3 /* displacements under which laws are asked whether they yield, as a share of the mesh's length */

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

    HycoCheckModel(!flows[k] || !HycoBodyPartsShapes(parts, k, shape),
                   "%s changes the shape or the ratio of moduli of body %s, which deforms inelastically; a model of "
                   "bodies does not support that: train a hybrid model",
                   s->parameter[shape[0]], parts->name[k]);
  }
  PetscCall(PetscFree(flows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesCheckPath(HycoReducer t)
{
  const HycoScene s = t->scene;
  PetscBool oblique = PETSC_FALSE, rigid = PETSC_FALSE;
  HycoMotions motions;
  char name[HYCO_LINE] = "";
  PetscInt free;

  PetscFunctionBegin;
  HycoCheckModel(t->sizes[3] > 1, "-hyco_model_type bodies with a history is for 2D and 3D; in 1D use hybrid");
  for (PetscInt k = 0; k < s->n_fixed; k++) oblique = (PetscBool)(oblique || s->fixed[k].normal);
  for (PetscInt k = 0; k < s->n_contacts; k++) rigid = (PetscBool)(rigid || s->contact[k]->rigid);
  HycoCheckModel(!s->n_ties && !oblique && !rigid,
                 "the scene has %s, which a model of bodies with a history does not support; train a hybrid model",
                 s->n_ties ? "ties"
                 : rigid   ? "a contact of type rigid"
                           : "a support along a direction");
  PetscCall(HycoFEFreeMotions(HycoComm(t), t->fom->fe, &motions));
  free = motions.n;
  if (free) PetscCall(PetscStrncpy(name, motions.name[0], sizeof(name)));
  PetscCall(HycoMotionsDestroy(&motions));
  HycoCheckModel(
      !free,
      "no support keeps %s, only contact does, which a model of bodies with a history does not support; train "
      "a hybrid model",
      name);
  PetscCall(CheckChanges(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- modes and cells -- */

PetscErrorCode HycoBodiesStrainModes(HycoReducer t, HycoSnapshots store)
{
  HycoBodiesTraining s = HycoTrainingOfBodies(t);

  PetscFunctionBegin;
  PetscCall(PetscNew(&s->bodies->inelastic));
  PetscCall(MatDestroy(&s->strains.V));
  PetscCall(PetscFree(s->strains.sigma));
  PetscCall(HycoInelasticSample(t, store, s->inelastic_tol, &s->strains));
  s->bodies->inelastic->m = s->strains.l;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes `count` cells those of the model, ascending; takes ownership. */
static PetscErrorCode TakeCells(HycoReducer t, PetscInt count, PetscInt cell[])
{
  HycoBodiesInelastic in = HycoTrainingOfBodies(t)->bodies->inelastic;
  const PetscInt n = t->fom->part->nv * t->sizes[3];

  PetscFunctionBegin;
  if (!count) cell[count++] = 0; /* a mesh needs a cell */
  PetscCall(PetscSortRemoveDupsInt(&count, cell));
  PetscCall(PetscFree(t->seeds_cell));
  t->seeds_cell = cell;
  t->n_seeds_cell = in->n_cells = count;
  PetscCall(PetscCalloc1((size_t)in->m * (size_t)(count * n) + 1, &in->T));
  PetscCall(PetscCalloc1((size_t)in->m * (size_t)(count * n) + 1, &in->there));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The modes in the chosen cells, and their pseudo-inverse. Collective. */
static PetscErrorCode TakeThere(HycoReducer t, PetscReal inverse[], PetscReal *smallest)
{
  HycoBodiesTraining s = HycoTrainingOfBodies(t);
  HycoBodiesInelastic in = s->bodies->inelastic;
  const PetscInt columns = t->n_seeds_cell * t->fom->part->nv * t->sizes[3];
  PetscReal *there;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1((size_t)in->m * (size_t)columns + 1, &there));
  PetscCall(HycoInelasticInverse(t, &s->strains, inverse, there, smallest));
  for (PetscInt i = 0; i < columns * in->m; i++) in->there[i] = there[i % in->m * columns + i / in->m];
  PetscCall(PetscFree(there));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Interpolation: the cells of the modes' Q-DEIM points; T is the pseudo-inverse of the modes there. Collective. */
static PetscErrorCode Interpolate(HycoReducer t)
{
  HycoBodiesTraining s = HycoTrainingOfBodies(t);
  HycoBodiesInelastic in = s->bodies->inelastic;
  PetscInt *cell, count = 0;
  PetscReal smallest;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(s->cells * in->m + 1, &cell));
  PetscCall(HycoInelasticChoose(&s->strains, t->fom->part->nv * t->sizes[3], s->cells, &count, cell));
  PetscCall(TakeCells(t, count, cell));
  PetscCall(TakeThere(t, in->T, &smallest));
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

/* All of them, ascending, on every rank. Collective. */
static PetscErrorCode ListAll(HycoReducer t, Unknowns *all)
{
  Unknowns own = {0};
  PetscMPIInt size, n, *count, *start;
  PetscInt *order, *packed[3];

  PetscFunctionBegin;
  HycoOnEach(HycoComm(t), ListOwn(t, &own));
  PetscCallMPI(MPI_Comm_size(HycoComm(t), &size));
  PetscCall(PetscMalloc2(size, &count, size + 1, &start));
  PetscCall(PetscMPIIntCast(own.n, &n));
  PetscCallMPI(MPI_Allgather(&n, 1, MPI_INT, count, 1, MPI_INT, HycoComm(t)));
  start[0] = 0;
  for (PetscMPIInt r = 0; r < size; r++) start[r + 1] = start[r] + count[r];
  all->n = start[size];
  for (int k = 0; k < 3; k++) {
    const PetscInt *from = k == 0 ? own.dof : k == 1 ? own.body : own.global;

    PetscCall(PetscMalloc1(all->n + 1, &packed[k]));
    PetscCallMPI(MPI_Allgatherv(from, n, MPIU_INT, packed[k], count, start, MPIU_INT, HycoComm(t)));
  }
  PetscCall(PetscFree2(count, start));
  PetscCall(PetscFree3(own.dof, own.body, own.global));
  PetscCall(PetscMalloc1(all->n + 1, &order));
  PetscCall(PetscMalloc1(all->n + 1, &all->body));
  PetscCall(PetscMalloc1(all->n + 1, &all->global));
  for (PetscInt i = 0; i < all->n; i++) order[i] = i;
  all->dof = packed[0];
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
    if (at->global[i] >= lo && at->global[i] < hi) table[(size_t)i * (size_t)n + (size_t)k] = a[at->global[i] - lo];
  }
  PetscCall(VecRestoreArrayRead(x, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x = K^-1 F; the surfaces' displacements u. Collective. */
static PetscErrorCode Displace(HycoSubstructures b, HycoBodiesFactor *factor, Vec F, PetscReal u[], Vec *x)
{
  PetscReal *work;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(b->p + b->ns + 1, &work));
  PetscCall(HycoBodiesReduce(b, factor, 1, &F, u, work));
  PetscCall(PetscArrayzero(work, b->p + b->ns));
  PetscCall(VecDuplicate(F, x));
  PetscCall(HycoDirectExpandMany(factor->direct, 1, &F, work, x));
  PetscCall(PetscFree(work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The responses to the modes: P and the fields; work[m x m]: of the modes on these, Q^T K^-1 Q. Collective. */
static PetscErrorCode Respond(HycoReducer t, HycoBodiesFactor *factor, PetscReal u[], PetscReal work[])
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  HycoBodiesInelastic in = b->inelastic;
  HycoFOM f = factor->fom;
  const PetscScalar *column;
  PetscScalar *v;
  PetscInt lda;
  Mat A;
  Vec F;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(in->m + 1, &factor->strain));
  if (!in->m) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoInelasticColumns(t, in->m, &A));
  PetscCall(HycoInelasticPut(t, &HycoTrainingOfBodies(t)->strains, A));
  PetscCall(MatDenseGetLDA(A, &lda));
  PetscCall(VecDuplicate(f->F, &F));
  for (PetscInt k = 0; k < in->m; k++) {
    PetscCall(MatDenseGetArrayRead(A, &column));
    PetscCall(VecGetArray(F, &v));
    for (PetscInt i = 0; i < f->fe->n_dof; i++) {
      const PetscInt own = HycoMeshOwned(f->part, i / b->dim), row = own * b->dim + i % b->dim;

      if (own >= 0) v[row] = f->fe->fixed[i] ? 0 : column[(size_t)k * (size_t)lda + (size_t)row];
    }
    PetscCall(VecRestoreArray(F, &v));
    PetscCall(MatDenseRestoreArrayRead(A, &column));
    PetscCall(Displace(b, factor, F, u, &factor->strain[k]));
    factor->n_strains++;
    for (PetscInt i = 0; i < b->ns; i++) in->P[(size_t)i * (size_t)in->m + (size_t)k] = u[i];
    for (PetscInt i = 0; i <= k; i++) {
      PetscCall(VecDot(F, factor->strain[i], &work[i * in->m + k]));
      work[k * in->m + i] = work[i * in->m + k];
    }
  }
  PetscCall(VecDestroy(&F));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of the cells' unknowns for forces on the surfaces, C: K is symmetric. Collective. */
static PetscErrorCode FillForces(HycoReducer t, HycoBodiesFactor *factor, const Unknowns *at)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  PetscReal *work;
  PetscScalar *v;
  PetscInt lo, hi;
  Vec e[MANY];

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(MANY * b->p + 1, &work));
  for (PetscInt j = 0; j < MANY; j++) PetscCall(VecDuplicate(factor->fom->F, &e[j]));
  PetscCall(VecGetOwnershipRange(e[0], &lo, &hi));
  for (PetscInt first = 0; first < at->n; first += MANY) {
    const PetscInt many = PetscMin(MANY, at->n - first);

    for (PetscInt j = 0; j < many; j++) {
      const PetscInt row = at->global[first + j];

      PetscCall(VecZeroEntries(e[j]));
      PetscCall(VecGetArray(e[j], &v));
      if (row >= lo && row < hi) v[row - lo] = 1;
      PetscCall(VecRestoreArray(e[j], &v));
    }
    PetscCall(HycoBodiesReduce(b, factor, many, e, b->inelastic->C + (size_t)first * (size_t)b->ns, work));
    PetscCall(HycoReducerTell(t, "displacements of the cells with laws", first + many, at->n));
  }
  for (PetscInt j = 0; j < MANY; j++) PetscCall(VecDestroy(&e[j]));
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

    PetscCall(Displace(b, factor, factor->basis[k], u, &x));
    PetscCall(TakeValues(at, x, k, b->r, b->inelastic->R));
    PetscCall(VecDestroy(&x));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- laws in few cells -- */

/* Whether a law deforms inelastically at once, as in yielding: under large strains in no time. Collective. */
static PetscErrorCode Yields(HycoReducer t, PetscBool *yields)
{
  HycoFE fe = t->fom->fe;
  const PetscReal size = LARGE * HycoMeshLength(t->fom->part), now = t->scene->times[0];
  HycoFEStepReport report;
  HycoFEState begin, end;
  PetscReal *u, *f;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(fe->n_dof, &u, fe->n_dof, &f));
  for (PetscInt i = 0; i < fe->n_dof; i++) u[i] = size * PetscSinReal(1.7 * i * i + i);
  PetscCall(PetscArrayzero(f, fe->n_dof));
  PetscCall(HycoFEStateCreate(fe, &begin));
  PetscCall(HycoFEStateCreate(fe, &end));
  ierr = HycoFEStepBodies(fe, HYCO_BODIES_FLOWING, u, now, now, begin, end, f, PETSC_FALSE, &report);
  PetscCall(HycoFEStateDestroy(&begin));
  PetscCall(HycoFEStateDestroy(&end));
  PetscCall(PetscFree2(u, f));
  PetscCall(ierr);
  *yields = (PetscBool)(report.failed || report.increment > 0);
  HycoAllreduce(yields, 1, HYCO_MPI_BOOL, MPI_LOR, HycoComm(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Columns of X become X M, with M m x l column major; x: their number, then l. Collective. */
static PetscErrorCode Combine(PetscInt m, PetscInt l, const PetscReal M[], Vec X[])
{
  Vec *Y;

  PetscFunctionBegin;
  PetscCall(VecDuplicateVecs(X[0], l, &Y));
  for (PetscInt j = 0; j < l; j++) PetscCall(VecMAXPY(Y[j], m, M + j * m, X));
  for (PetscInt k = 0; k < m; k++) {
    PetscCall(VecDestroy(&X[k]));
    if (k < l) X[k] = Y[k];
  }
  PetscCall(PetscFree(Y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes the modes' displacements that have energy, orthonormal in it: the inelastic forces of the paths are sums of
   sigma_k q_k, so that the eigenvectors of their displacements' Gram matrix are those of a POD of the displacements.
   work[m x m]: Q^T K^-1 Q. The modes of the forces stay. Collective. */
static PetscErrorCode Orthogonalise(HycoReducer t, HycoBodiesFactor *factor, const PetscReal work[])
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
  PetscCall(HycoPODGram(m, gram, s->inelastic_tol, 0, &M, &l, sigma));
  for (PetscInt i = 0; i < m * l; i++) M[i] *= scale[i % m];
  PetscCall(Combine(m, l, M, factor->strain));
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

/* The work of the largest n_k modes of the forces on the modes' displacements in each cell, a column for each pair, by
   the forces' sizes: rows in the file's order. Collective. */
static PetscErrorCode Contributions(HycoReducer t, HycoBodiesFactor *factor, PetscInt n_k, Mat *S)
{
  const HycoBasis *modes = &HycoTrainingOfBodies(t)->strains;
  HycoMesh part = t->fom->part;
  const PetscInt m = factor->n_strains, n = part->nv * part->dim;
  const HycoFileOrder *order;
  const PetscScalar *V;
  PetscReal *u, *q, *value, *rows;
  PetscScalar *s;
  PetscInt ldv, lds, n_rows;

  PetscFunctionBegin;
  PetscCall(HycoFOMGetRows(t->fom, &order));
  n_rows = order ? order->n[HYCO_ON_CELLS] : part->n_cells;
  PetscCall(MatCreateDense(HycoComm(t), n_rows, PETSC_DECIDE, t->sizes[1], m * n_k, NULL, S));
  PetscCall(PetscMalloc4((size_t)m * (size_t)(part->n_nodes * part->dim), &u, part->n_cells * n, &q, part->n_cells * m,
                         &value, n_rows * m + 1, &rows));
  for (PetscInt i = 0; i < m; i++)
    PetscCall(HycoFOMToLocal(factor->fom, factor->strain[i], u + (size_t)i * (size_t)(part->n_nodes * part->dim)));
  PetscCall(MatDenseGetLDA(modes->V, &ldv));
  PetscCall(MatDenseGetLDA(*S, &lds));
  PetscCall(MatDenseGetArray(*S, &s));
  for (PetscInt k = 0; k < n_k; k++) {
    PetscCall(MatDenseGetArrayRead(modes->V, &V));
    PetscCall(HycoFOMFromRows(t->fom, HYCO_ON_CELLS, n, V + (size_t)k * (size_t)ldv, q));
    PetscCall(MatDenseRestoreArrayRead(modes->V, &V));
    PetscCall(PetscArrayzero(value, part->n_cells * m));
    for (PetscInt e = 0; e < part->n_cells * n; e++) {
      const PetscInt unknown = HycoCellUnknown(part, e / n, e % n);

      for (PetscInt i = 0; i < m && !t->fom->fe->fixed[unknown] && q[e] != 0; i++)
        value[e / n * m + i] += q[e] * u[(size_t)i * (size_t)(part->n_nodes * part->dim) + (size_t)unknown];
    }
    PetscCall(HycoFOMToRows(t->fom, HYCO_ON_CELLS, MPIU_REAL, m, value, rows));
    for (PetscInt e = 0; e < n_rows * m; e++)
      s[(size_t)(k * m + e % m) * (size_t)lds + (size_t)(e / m)] = modes->sigma[k] * rows[e];
  }
  PetscCall(MatDenseRestoreArray(*S, &s));
  PetscCall(MatAssemblyBegin(*S, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*S, MAT_FINAL_ASSEMBLY));
  PetscCall(PetscFree4(u, q, value, rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The cells with weights w (rank 0), as those of the model; weight[] ordered as they are. Collective. */
static PetscErrorCode TakeWeighted(HycoReducer t, const PetscReal w[], PetscReal **weight)
{
  PetscInt *cell, count = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(t->sizes[1] + 1, &cell));
  PetscCall(PetscMalloc1(t->sizes[1] + 1, weight));
  for (PetscInt e = 0; !t->rank && e < t->sizes[1]; e++) {
    if (!(w[e] > 0)) continue;
    (*weight)[count] = w[e];
    cell[count++] = e;
  }
  PetscCallMPI(MPI_Bcast(&count, 1, MPIU_INT, 0, HycoComm(t)));
  HycoBcast(cell, count, MPIU_INT, HycoComm(t));
  HycoBcast(*weight, count, MPIU_REAL, HycoComm(t));
  PetscCall(TakeCells(t, count, cell));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Which cells of the part are elastic. */
static PetscErrorCode MarkElastic(HycoReducer t, PetscBool **elastic)
{
  PetscFunctionBegin;
  PetscCall(PetscMalloc1(t->fom->part->n_cells + 1, elastic));
  for (PetscInt e = 0; e < t->fom->part->n_cells; e++) (*elastic)[e] = (PetscBool)!HycoInelasticFlows(t->fom->fe, e);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Galerkin's method on the modes' displacements A, orthonormal in energy, with a cubature: alpha = sum of w_e A_e^T q_e.
   weight: of the cells. Collective. */
static PetscErrorCode Cubature(HycoReducer t, HycoBodiesFactor *factor, PetscReal **weight)
{
  HycoBodiesTraining s = HycoTrainingOfBodies(t);
  HycoBodiesInelastic in = s->bodies->inelastic;
  PetscReal *sigma, *w, error[2];
  PetscBool *elastic;
  PetscInt n_k = 0, n;
  Mat S, W;

  PetscFunctionBegin;
  while (n_k < s->strains.l && s->strains.sigma[n_k] > s->cubature_tol * s->strains.sigma[0]) n_k++;
  PetscCall(Contributions(t, factor, n_k, &S));
  PetscCall(PetscCalloc1(in->m * n_k + 1, &sigma));
  PetscCall(HycoReducerPOD(t, S, s->cubature_tol * s->cubature_tol, 0, &W, &n, sigma));
  PetscCall(MatDestroy(&S));
  PetscCall(MarkElastic(t, &elastic));
  PetscCall(PetscCalloc1(t->rank ? 1 : t->sizes[1], &w));
  PetscCall(HycoCubatureFind(t, elastic, 0, s->cubature_tol, W, n, sigma, w, error));
  PetscCall(MatDestroy(&W));
  PetscCall(PetscFree(elastic));
  PetscCall(PetscFree(sigma));
  PetscCall(TakeWeighted(t, w, weight));
  PetscCall(PetscFree(w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* T = w_e A_e, from the rows A of the cells. Collective. */
static PetscErrorCode FillGalerkin(HycoReducer t, const Unknowns *at, const PetscReal weight[])
{
  HycoBodiesInelastic in = HycoTrainingOfBodies(t)->bodies->inelastic;
  HycoMesh part = t->fom->part;
  const PetscInt m = in->m, n = part->nv * part->dim;

  PetscFunctionBegin;
  for (PetscInt e = 0; e < part->n_cells; e++) {
    PetscInt cell = -1;

    if (HycoMeshOwned(part, part->cells[e * part->nv]) >= 0)
      PetscCall(PetscFindInt(part->cell_whole ? part->cell_whole[e] : e, t->n_seeds_cell, t->seeds_cell, &cell));
    for (PetscInt i = 0; i < n && cell >= 0; i++) {
      const PetscInt k = HycoCellUnknown(part, e, i), node = k / part->dim;
      PetscReal *T = in->T + (size_t)(cell * n + i) * (size_t)m;
      PetscInt row;

      PetscCall(PetscFindInt((part->node_whole ? part->node_whole[node] : node) * part->dim + k % part->dim, at->n,
                             at->dof, &row));
      for (PetscInt d = 0; d < m && row >= 0; d++) T[d] = weight[cell] * in->A[row * m + d];
    }
  }
  HycoAllreduce(in->T, m * in->n_cells * n, MPIU_REAL, MPI_SUM, HycoComm(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The cells and their rows for forces, loads and modes. weight: of the cells, NULL: interpolation. Collective. */
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
  for (PetscInt k = 0; k < in->m; k++) PetscCall(TakeValues(&at, factor->strain[k], k, in->m, in->A));
  PetscCall(FillForces(t, factor, &at));
  PetscCall(FillLoads(t, factor, &at, u));
  HycoAllreduce(in->A, at.n * in->m, MPIU_REAL, MPI_SUM, HycoComm(t));
  HycoAllreduce(in->R, at.n * b->r, MPIU_REAL, MPI_SUM, HycoComm(t));
  if (weight) PetscCall(FillGalerkin(t, &at, weight));
  PetscCall(PetscFree(at.global));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The laws in few cells by the method that fits them. weight: of the cells, NULL: interpolation. Collective. */
static PetscErrorCode ChooseCells(HycoReducer t, HycoBodiesFactor *factor, const PetscReal work[], PetscReal **weight)
{
  HycoBodiesTraining s = HycoTrainingOfBodies(t);
  HycoBodiesInelastic in = s->bodies->inelastic;
  PetscBool yields = (PetscBool)(s->laws == HYCO_BODIES_CUBATURE);

  PetscFunctionBegin;
  *weight = NULL;
  if (s->laws == HYCO_BODIES_AUTO && in->m) PetscCall(Yields(t, &yields));
  if (!yields || !in->m) {
    PetscCall(Interpolate(t));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(Orthogonalise(t, factor, work));
  PetscCall(Cubature(t, factor, weight));
  in->amplification = 1;
  in->weighted = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesStrains(HycoReducer t, HycoBodiesFactor *factor)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  HycoBodiesInelastic in = b->inelastic;
  PetscReal theta[HYCO_MAX_PARAMETERS], *u, *work, *weight = NULL;

  PetscFunctionBegin;
  PetscCall(HycoFOMSetParameters(t->fom, b->first));
  HycoBodiesPoint(t, 0, theta);
  PetscCall(HycoBodiesRefactor(t, factor, theta));
  PetscCall(PetscCalloc1((size_t)b->ns * (size_t)in->m + 1, &in->P));
  PetscCall(PetscMalloc2(b->ns + 1, &u, in->m * in->m + 1, &work));
  PetscCall(Respond(t, factor, u, work));
  PetscCall(ChooseCells(t, factor, work, &weight));
  PetscCall(FillCells(t, factor, weight, u));
  PetscCall(PetscFree(weight));
  PetscCall(PetscFree2(u, work));
  PetscFunctionReturn(PETSC_SUCCESS);
}
