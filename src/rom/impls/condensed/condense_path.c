/*
  Training of the condensed model of paths (hycocondensedpath.h). A replay of the training paths gives, at each listed
  time, the inelastic forces of all cells, the forces of heat, supports and body forces on each, and the loads of all
  nodes. POD gives modes of each; one factor of K gives the responses to those of inelastic forces and loads, and to
  each contact; an orthonormal basis of all responses is V. Q-DEIM on the modes of the cells' forces chooses the cells.
*/
#include <hycoalgorithms.h>
#include <hycocondensed.h>

static PetscErrorCode End(Mat A)
{
  PetscFunctionBegin;
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- unsupported scenes -- */

/* Refuses a load or support that is neither a sum over cells nor one over facets. */
static PetscErrorCode CheckLoads(HycoScene s)
{
  PetscBool oblique = PETSC_FALSE;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n_fixed; k++) oblique = (PetscBool)(oblique || s->fixed[k].normal);
  HycoCheckModel(!s->n_springs && !s->n_point_loads && !s->n_ties && !oblique,
                 "the scene has %s, which a condensed model of paths does not support; train a hybrid model",
                 s->n_springs       ? "springs"
                 : s->n_point_loads ? "forces on points"
                 : s->n_ties        ? "ties"
                                    : "a support along a direction");
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedPathBegin(HycoReducer t)
{
  const HycoScene s = t->scene;

  PetscFunctionBegin;
  HycoCheckModel(t->sizes[3] > 1,
                 "-hyco_model_type condensed with a history is for 2D and 3D; in 1D use hybrid or projection");
  PetscCall(HycoCondensedCheckContacts(t));
  PetscCall(HycoCondensedCheckSupports(t));
  PetscCall(CheckLoads(s));
  for (PetscInt p = 0; p < s->n_variables; p++) {
    PetscBool changed[HYCO_MAX_PARAMETERS] = {PETSC_FALSE};
    HycoChanges c;

    changed[p] = (PetscBool)(p >= s->n_parameters || s->hi[p] > s->lo[p]);
    c = HycoSceneChanges(s, changed);
    HycoCheckModel(!c.stiffness && !c.rows,
                   "%s affects %s, and a condensed model of paths has one stiffness and one set of contacts for all "
                   "paths; use -hyco_model_type hybrid or cubature",
                   s->parameter[p], c.stiffness ? "the stiffness" : "the contacts' directions");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- responses -- */

/* Sets B^T, a column for each contact. Rank 0. */
static PetscErrorCode PutContacts(HycoReducer t, Mat A, PetscInt first)
{
  HycoMesh surface = t->fom->surface;
  const PetscInt dim = surface->dim;
  HycoRows rows;

  PetscFunctionBegin;
  PetscCall(HycoRowsCreate(&t->fom->pairs, dim, &rows));
  PetscCall(HycoContactRows(t->fom->fe_surface, &t->fom->pairs, rows.start, rows.dof, rows.value, rows.gap));
  for (PetscInt k = 0; k < t->fom->pairs.n; k++) {
    for (PetscInt j = rows.start[k]; j < rows.start[k + 1]; j++) {
      const PetscInt node = rows.dof[j] / dim, global = surface->node_global ? surface->node_global[node] : node;

      PetscCall(MatSetValue(A, global * dim + rows.dof[j] % dim, first + k, rows.value[j], ADD_VALUES));
    }
  }
  PetscCall(HycoRowsDestroy(&rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces l, sigma, V and VtU: a basis of the responses. Collective. */
static PetscErrorCode TakeAnswers(HycoReducer t, HycoSnapshots store, Mat K, const HycoBasis modes[HYCO_N_SAMPLED])
{
  const PetscInt n[3] = {modes[HYCO_SAMPLED_INELASTIC].l, modes[HYCO_SAMPLED_LOADS].l, t->sizes[2]},
                 all = n[0] + n[1] + n[2];
  Mat R, X, S;

  PetscFunctionBegin;
  PetscCall(HycoInelasticColumns(t, all, &R));
  PetscCall(HycoInelasticPut(t, &modes[HYCO_SAMPLED_INELASTIC], HYCO_ON_CELLS, R, 0));
  PetscCall(HycoInelasticPut(t, &modes[HYCO_SAMPLED_LOADS], HYCO_ON_NODES, R, n[0]));
  HycoOnRoot(HycoComm(t), PutContacts(t, R, n[0] + n[1]));
  PetscCall(End(R));
  PetscCall(HycoSolveColumns(K, "the stiffness", R, &X));
  PetscCall(MatDestroy(&R));
  PetscCall(HycoReducerUnitRows(t, X, &S));
  PetscCall(MatDestroy(&X));
  PetscCall(End(S));
  HycoFreeAll(&t->sigma, &t->VtU);
  PetscCall(MatDestroy(&t->V));
  PetscCall(PetscCalloc1(PetscMax(all, t->n_s) + 1, &t->sigma));
  PetscCall(HycoReducerPOD(t, S, 0, 0, &t->V, &t->l, t->sigma));
  PetscCall(MatDestroy(&S));
  HycoCheckModel(t->l, "no load and no contact force moves the bodies, so that there are no modes; check the loads");
  PetscCall(HycoReducerGetDisplacements(t, store, &S));
  PetscCall(PetscMalloc1((size_t)t->l * (size_t)t->n_s, &t->VtU));
  PetscCall(HycoReducerMultiply(t, t->V, S, t->VtU));
  PetscCall(MatDestroy(&S));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- tables -- */

/* Chooses the model's cells, ascending: all, or those of the modes. Collective. */
static PetscErrorCode ChooseCells(HycoReducer t, const HycoBasis modes[HYCO_N_SAMPLED])
{
  const PetscInt n = t->fom->part->nv * t->sizes[3], each = Condensing(t)->path.cells;
  PetscInt *cell, count = 0, more;

  PetscFunctionBegin;
  PetscCall(
      PetscMalloc1(t->sizes[1] + each * modes[HYCO_SAMPLED_INELASTIC].l + modes[HYCO_SAMPLED_INSIDE].l + 1, &cell));
  for (PetscInt e = 0; e < t->sizes[1] && !each; e++) cell[count++] = e;
  PetscCall(HycoInelasticChoose(&modes[HYCO_SAMPLED_INELASTIC], n, each, &more, cell + count));
  count += more;
  PetscCall(HycoInelasticChoose(&modes[HYCO_SAMPLED_INSIDE], n, PetscMin(each, 1), &more, cell + count));
  count += more;
  if (!count) cell[count++] = 0; /* no inelastic cell and no load inside: a mesh needs a cell */
  PetscCall(PetscSortRemoveDupsInt(&count, cell));
  PetscCall(PetscFree(t->seeds_cell));
  t->seeds_cell = cell;
  t->n_seeds_cell = count;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The table without modes: the rows of V at the nodes of each cell. Collective. */
static PetscErrorCode TabulateAll(HycoReducer t, PetscReal **table)
{
  HycoMesh part = t->fom->part;
  const PetscInt dim = part->dim, n = part->nv * dim, l = t->l, columns = t->sizes[1] * n;
  const PetscScalar *v;
  PetscReal *node;
  PetscInt lda;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1((size_t)l * (size_t)columns + 1, table));
  PetscCall(PetscMalloc1(part->n_nodes * dim + 1, &node));
  PetscCall(MatDenseGetLDA(t->V, &lda));
  PetscCall(MatDenseGetArrayRead(t->V, &v));
  for (PetscInt j = 0; j < l; j++) {
    PetscCall(HycoFOMFromRows(t->fom, HYCO_ON_NODES, dim, v + (size_t)j * (size_t)lda, node));
    for (PetscInt k = 0; k < part->n_cells * n; k++) {
      const PetscInt cell = part->cell_whole ? part->cell_whole[k / n] : k / n;

      if (HycoMeshOwned(part, part->cells[k / n * part->nv]) < 0) continue;
      (*table)[(size_t)(cell * n + k % n) * (size_t)l + (size_t)j] = node[part->cells[k / dim] * dim + k % dim];
    }
  }
  PetscCall(MatDenseRestoreArrayRead(t->V, &v));
  PetscCall(PetscFree(node));
  HycoAllreduce(*table, l * columns, MPIU_REAL, MPI_SUM, HycoComm(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* V^T of the nodal sums of the modes of cells' forces, times the pseudo-inverse of the modes in the chosen cells: l
   x columns. `smallest`: the modes' smallest singular value there. Collective. */
static PetscErrorCode Tabulate(HycoReducer t, const HycoBasis *modes, Mat V, PetscReal **table, PetscReal *smallest)
{
  const PetscInt n = t->fom->part->nv * t->sizes[3], columns = t->n_seeds_cell * n, q = modes->l, l = t->l;
  PetscReal *there, *P, *product;
  Mat A;

  PetscFunctionBegin;
  *smallest = 1;
  if (!Condensing(t)->path.cells) {
    PetscCall(TabulateAll(t, table));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscCalloc1((size_t)l * (size_t)columns + 1, table));
  if (!q) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoInelasticColumns(t, q, &A));
  PetscCall(HycoInelasticPut(t, modes, HYCO_ON_CELLS, A, 0));
  PetscCall(End(A));
  PetscCall(PetscMalloc3(columns * q, &there, columns * q, &P, l * q, &product));
  PetscCall(HycoReducerMultiply(t, V, A, product));
  PetscCall(MatDestroy(&A));
  PetscCall(HycoInelasticInverse(t, modes, P, there, smallest));
  for (PetscInt i = 0; i < columns; i++) {
    for (PetscInt k = 0; k < q; k++) {
      for (PetscInt j = 0; j < l; j++) (*table)[(size_t)i * (size_t)l + (size_t)j] += product[k * l + j] * P[i * q + k];
    }
  }
  PetscCall(PetscFree3(there, P, product));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes V^T K V and the cells' tables. Collective. */
static PetscErrorCode FillTable(HycoReducer t, Mat K, const HycoBasis modes[HYCO_N_SAMPLED])
{
  HycoCondensedTable *c = &Condensing(t)->path.table;
  const HycoBasis V = {.V = t->V, .l = t->l};
  const PetscInt l = t->l;
  PetscReal smallest[2];
  Mat D, KD;

  PetscFunctionBegin;
  PetscCall(HycoCondensedTableFree(c));
  PetscCall(HycoInelasticColumns(t, l, &D));
  PetscCall(HycoInelasticPut(t, &V, HYCO_ON_NODES, D, 0));
  PetscCall(End(D));
  PetscCall(MatMatMult(K, D, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &KD));
  PetscCall(PetscMalloc1((size_t)l * (size_t)l, &c->K));
  PetscCall(HycoReducerMultiply(t, D, KD, c->K));
  PetscCall(MatDestroy(&KD));
  for (PetscInt j = 0; j < l; j++) {
    for (PetscInt i = 0; i < j; i++) c->K[i * l + j] = c->K[j * l + i] = (c->K[i * l + j] + c->K[j * l + i]) / 2;
  }
  PetscCall(Tabulate(t, &modes[HYCO_SAMPLED_INELASTIC], D, &c->inelastic, &smallest[0]));
  PetscCall(Tabulate(t, &modes[HYCO_SAMPLED_INSIDE], D, &c->loads, &smallest[1]));
  c->n_inelastic = modes[HYCO_SAMPLED_INELASTIC].l;
  c->n_loads = modes[HYCO_SAMPLED_INSIDE].l;
  c->amplification = 1 / smallest[0];
  PetscCall(MatDestroy(&D));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The whole training, with one factor. Collective. */
static PetscErrorCode Condense(HycoReducer t, HycoSnapshots store, const HycoBasis modes[HYCO_N_SAMPLED])
{
  HycoFOM f = t->fom;
  PetscReal mu[HYCO_MAX_PARAMETERS];
  Mat K;

  PetscFunctionBegin;
  PetscCall(HycoReducerColumn(t, 0, mu));
  PetscCall(HycoFOMSetParameters(f, mu));
  PetscCall(HycoFECreateMatrix(f->fe, HycoComm(t), f->part->n_owned, f->part->first, &K));
  HycoOnEach(HycoComm(t), HycoFEAssembleStiffness(f->fe, K));
  PetscCall(TakeAnswers(t, store, K, modes));
  PetscCall(ChooseCells(t, modes));
  PetscCall(FillTable(t, K, modes));
  PetscCall(MatDestroy(&K));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedPathModes(HycoReducer t, HycoSnapshots store)
{
  HycoBasis modes[HYCO_N_SAMPLED] = {{NULL}};
  PetscErrorCode ierr;

  PetscFunctionBegin;
  ierr = HycoInelasticSample(t, store, Condensing(t)->path.tol, HYCO_N_SAMPLED, modes);
  if (!ierr) ierr = Condense(t, store, modes);
  for (PetscInt k = 0; k < HYCO_N_SAMPLED; k++) {
    PetscCall(MatDestroy(&modes[k].V));
    PetscCall(PetscFree(modes[k].sigma));
  }
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
