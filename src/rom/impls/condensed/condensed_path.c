/* The condensed model of paths, online: a Galerkin model of the whole mesh with tabulated operators and laws in few
   cells (hycocondensedpath.h). */
#include <hycocondensed.h>
#include <hycocondensedpath.h>
#include <hycokinematics.h>
#include <petscblaslapack.h>
#include <petscviewer.h>

/* -- online: operations of the path -- */

/* kr -= R_e lost V_e, `lost` is the reduction of the stiffness of cell e. */
static PetscErrorCode Soften(HycoROM m, PetscInt e, const PetscReal lost[], PetscScalar kr[])
{
  HycoCondensedPath c = (HycoCondensedPath)m->work;
  const PetscInt n = m->model->mesh->nv * m->model->mesh->dim;
  const size_t size = (size_t)m->model->l;
  const PetscReal minus = -1, one = 1;
  PetscBLASInt l, columns;
  PetscReal *product; /* its transpose, l x n */

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(size * (size_t)n, &product));
  for (PetscInt i = 0; i < n; i++) {
    for (PetscInt j = 0; j < n; j++) {
      const PetscReal *v = m->model->V + (size_t)HycoCellUnknown(m->model->mesh, e, j) * size;

      for (size_t k = 0; k < size; k++) product[(size_t)i * size + k] += lost[i * n + j] * v[k];
    }
  }
  PetscCall(PetscBLASIntCast(m->model->l, &l));
  PetscCall(PetscBLASIntCast(n, &columns));
  BLASgemm_("N", "T", &l, &l, &columns, &minus, c->table->inelastic + (size_t)(e * n) * size, &l, product, &l, &one, kr,
            &l);
  PetscCall(PetscFree(product));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Kr: V^T K V minus the reduction of the stiffness by the tangents of the chosen cells. */
static PetscErrorCode Stiffness(HycoROM m)
{
  HycoCondensedPath c = (HycoCondensedPath)m->work;
  HycoMesh mesh = m->model->mesh;
  const PetscInt l = m->model->l, n = mesh->nv * mesh->dim;
  const PetscBool first = (PetscBool)!c->Ke;
  PetscReal Kt[HYCO_MAX_CELL_DOFS * HYCO_MAX_CELL_DOFS];
  PetscScalar *kr;

  PetscFunctionBegin;
  if (first) PetscCall(PetscMalloc1((size_t)mesh->n_cells * (size_t)(n * n) + 1, &c->Ke));
  PetscCall(HycoReducedPrepare(m));
  PetscCall(MatDenseGetArrayWrite(c->galerkin.Kr, &kr));
  PetscCall(PetscArraycpy(kr, c->table->K, (size_t)l * (size_t)l));
  for (PetscInt e = 0; e < mesh->n_cells; e++) {
    PetscReal *Ke = c->Ke + (size_t)e * (size_t)(n * n);

    if (first) PetscCall(HycoFEBodyStiffness(m->fe, e, Ke)); /* the tangents are elastic */
    if (first || !HycoInelasticFlows(m->fe, e)) continue;
    PetscCall(HycoFEBodyStiffness(m->fe, e, Kt));
    for (PetscInt i = 0; i < n * n; i++) Kt[i] = Ke[i] - Kt[i];
    PetscCall(Soften(m, e, Kt, kr));
  }
  PetscCall(MatDenseRestoreArrayWrite(c->galerkin.Kr, &kr));
  PetscCall(MatAssemblyBegin(c->galerkin.Kr, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(c->galerkin.Kr, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* f -= R_e force. */
static void Subtract(HycoROM m, PetscInt e, const PetscReal R[], const PetscReal force[], PetscReal f[])
{
  const size_t l = (size_t)m->model->l, n = (size_t)(m->model->mesh->nv * m->model->mesh->dim);

  for (size_t i = 0; i < n; i++) {
    const PetscReal *column = R + ((size_t)e * n + i) * l;

    for (size_t j = 0; j < l && force[i] != 0; j++) f[j] -= column[j] * force[i];
  }
}

/* Fr has surface loads, and the body forces of the chosen cells as if there were no others. */
static PetscErrorCode AddLoads(HycoROM m)
{
  HycoCondensedPath c = (HycoCondensedPath)m->work;
  HycoMesh mesh = m->model->mesh;
  const PetscInt l = m->model->l, n = mesh->nv * mesh->dim;
  PetscScalar *f;

  PetscFunctionBegin;
  if (!c->heat) PetscCall(PetscMalloc1(mesh->n_cells * n + 1, &c->heat));
  PetscCall(HycoFEElasticTangent(m->fe)); /* thermal forces use these */
  PetscCall(VecGetArray(c->galerkin.Fr, &f));
  for (PetscInt e = 0; e < mesh->n_cells; e++) {
    PetscReal load[HYCO_MAX_CELL_DOFS], body[HYCO_MAX_CELL_DOFS] = {0};

    PetscCall(HycoInelasticCellLoad(m->fe, e, load, c->heat + e * n));
    PetscCall(HycoFEBodyForce(m->fe, e, body));
    for (PetscInt i = 0; i < n; i++) {
      const PetscReal *v = m->model->V + (size_t)HycoCellUnknown(mesh, e, i) * (size_t)l;

      load[i] -= body[i];
      for (PetscInt j = 0; j < l && body[i] != 0; j++) f[j] -= v[j] * body[i];
    }
    Subtract(m, e, c->table->loads, load, f);
  }
  PetscCall(VecRestoreArray(c->galerkin.Fr, &f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* f_int = V^T K V x - sum of R_e q_e */
static PetscErrorCode Forces(HycoROM m, HycoFEState state, Vec f_int, PetscReal *summands)
{
  HycoCondensedPath c = (HycoCondensedPath)m->work;
  const PetscInt n = m->model->mesh->nv * m->model->mesh->dim;
  const PetscReal one = 1, zero = 0;
  const PetscScalar *x;
  PetscScalar *f;
  PetscBLASInt l, inc = 1;

  PetscFunctionBegin;
  *summands = 0;
  PetscCall(PetscBLASIntCast(m->model->l, &l));
  PetscCall(VecGetArrayRead(c->galerkin.x, &x));
  PetscCall(VecGetArray(f_int, &f));
  BLASgemv_("N", &l, &l, &one, c->table->K, &l, x, &inc, &zero, f, &inc);
  for (PetscInt e = 0; e < m->model->mesh->n_cells; e++) {
    PetscReal q[HYCO_MAX_CELL_DOFS], size;

    if (!HycoInelasticFlows(m->fe, e)) continue;
    PetscCall(
        HycoInelasticCellForce(m->fe, e, c->Ke + (size_t)e * (size_t)(n * n), c->heat + e * n, m->U, state, q, &size));
    Subtract(m, e, c->table->inelastic, q, f);
    *summands += PetscSqr(c->weight[e] * size);
  }
  *summands = PetscSqrtReal(*summands);
  PetscCall(VecRestoreArray(f_int, &f));
  PetscCall(VecRestoreArrayRead(c->galerkin.x, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SetUp(HycoROM m)
{
  HycoCondensedPath c = (HycoCondensedPath)m->work;
  const size_t size = (size_t)m->model->l * (size_t)(m->model->mesh->nv * m->model->mesh->dim);

  PetscFunctionBegin;
  c->table = &((HycoCondensedPathModel)m->model->data)->table;
  PetscCall(HycoGalerkinSetUp(m));
  m->fe->all_facets = PETSC_TRUE;
  PetscCall(PetscCalloc1(m->model->mesh->n_cells + 1, &c->weight));
  for (PetscInt e = 0; e < m->model->mesh->n_cells; e++) {
    for (size_t k = 0; k < size; k++) c->weight[e] += PetscSqr(c->table->inelastic[(size_t)e * size + k]);
    c->weight[e] = PetscSqrtReal(c->weight[e]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Reset(HycoROM m)
{
  HycoCondensedPath c = (HycoCondensedPath)m->work;

  PetscFunctionBegin;
  PetscCall(HycoGalerkinReset(m));
  HycoFreeAll(&c->Ke, &c->heat, &c->weight);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- creation, report, file -- */

/* The chosen cells' columns in the order of the model's mesh. */
static PetscErrorCode TakeColumns(HycoROM m, HycoReducer t, const PetscReal from[], PetscReal **to)
{
  const size_t size = (size_t)m->model->l * (size_t)(m->model->mesh->nv * m->model->mesh->dim);

  PetscFunctionBegin;
  PetscCall(PetscMalloc1((size_t)m->model->mesh->n_cells * size + 1, to));
  for (PetscInt e = 0; e < m->model->mesh->n_cells; e++) {
    PetscInt at = -1;

    PetscCall(PetscFindInt(m->model->mesh->cell_whole[e], t->n_seeds_cell, t->seeds_cell, &at));
    PetscCheck(at >= 0, PETSC_COMM_SELF, PETSC_ERR_PLIB, "a cell of the model is not among the chosen cells");
    PetscCall(PetscArraycpy(*to + (size_t)e * size, from + (size_t)at * size, size));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every node is in A, and every contact belongs to the model. */
static PetscErrorCode Build(HycoROM m, HycoReducer t)
{
  const HycoCondensedTable *from = &Condensing(t)->path.table;
  HycoCondensedTable *to = &((HycoCondensedPathModel)m->model->data)->table;
  char worst[HYCO_LINE] = "";

  PetscFunctionBegin;
  PetscCall(HycoROMSetDomain(m, NULL));
  for (PetscInt k = 0; k < m->model->pairs.n; k++) m->model->in_rid[k] = 1;
  *to = *from;
  HycoDuplicate((size_t)m->model->l * (size_t)m->model->l, from->K, &to->K);
  PetscCall(TakeColumns(m, t, from->inelastic, &to->inelastic));
  PetscCall(TakeColumns(m, t, from->loads, &to->loads));
  PetscCall(HycoROMSetFE(m, HYCO_HYBRID_CONTACT, 0, NULL));
  PetscCall(HycoReducerJudge(t, m));
  if (!(m->model->numbers[1] < 0.5)) HycoReducerNameWorst(t, worst);
  HycoCheckModel(m->model->numbers[1] < 0.5,
                 "the condensed model misses its own training displacements by %.0f %% on average (%d inelastic modes, "
                 "%d cells)%s: use more cells (-hyco_condensed_cells; 0: all), fewer modes "
                 "(-hyco_condensed_inelastic_tol), or train a cubature model",
                 100 * (double)m->model->numbers[1], (int)to->n_inelastic, (int)m->model->mesh->n_cells, worst);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Report(HycoReducer t, HycoROM m, HycoTraining *r)
{
  const HycoCondensedTable *c = &((HycoCondensedPathModel)m->model->data)->table;

  PetscFunctionBegin;
  (void)t;
  PetscCall(HycoTrainingAddFact(r, "n_inelastic_modes", (PetscReal)c->n_inelastic));
  PetscCall(HycoTrainingAddFact(r, "n_load_modes", (PetscReal)c->n_loads));
  PetscCall(HycoTrainingAddFact(r, "inelastic_amplification", c->amplification));
  snprintf(r->summary, sizeof(r->summary),
           "condensed: %d snapshots; %d displacement modes for %d contacts, %d inelastic modes and the loads; laws in "
           "%d of %d elements (%.1f %%)\n",
           (int)r->n_samples, (int)r->n_modes, (int)m->model->pairs.n, (int)c->n_inelastic,
           (int)m->model->mesh->n_cells, (int)m->model->whole_cells, 100 * (double)r->rid_fraction);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode View(HycoROM m, PetscViewer viewer)
{
  const HycoCondensedTable *c = &((HycoCondensedPathModel)m->model->data)->table;

  PetscFunctionBegin;
  PetscCall(PetscViewerASCIIPrintf(viewer,
                                   "  contacts: %d; inelastic modes: %d, loads inside the bodies: %d\n  laws in %d of "
                                   "%d elements (%.1f %%); an error of the modes is amplified up to %.3g times\n",
                                   (int)m->model->pairs.n, (int)c->n_inelastic, (int)c->n_loads,
                                   (int)m->model->mesh->n_cells, (int)m->model->whole_cells,
                                   100. * (double)m->model->mesh->n_cells / (double)m->model->whole_cells,
                                   (double)c->amplification));
  PetscCall(HycoGalerkinView(m, viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes to the model file, or reads from it. */
static PetscErrorCode Move(HycoROM m, HycoH5 h)
{
  HycoCondensedTable *c = &((HycoCondensedPathModel)m->model->data)->table;
  PetscInt modes[2] = {c->n_inelastic, c->n_loads},
           columns = m->model->mesh->n_cells * m->model->mesh->nv * m->model->mesh->dim;

  PetscFunctionBegin;
  PetscCall(HycoGalerkinMove(m, h));
  PetscCall(HycoH5Ints(h, "condensed/path_modes", 0, PETSC_MAX_INT, 2, modes));
  c->n_inelastic = modes[0];
  c->n_loads = modes[1];
  PetscCall(HycoH5Reals(h, "condensed/amplification", 1, &c->amplification));
  PetscCall(HycoH5Real(h, "condensed/K", &m->model->l, m->model->l, &c->K));
  PetscCall(HycoH5Real(h, "condensed/inelastic", &columns, m->model->l, &c->inelastic));
  PetscCall(HycoH5Real(h, "condensed/loads", &columns, m->model->l, &c->loads));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedTableFree(HycoCondensedTable *c)
{
  PetscFunctionBegin;
  HycoFreeAll(&c->K, &c->inelastic, &c->loads);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Destroy(HycoROM m)
{
  HycoCondensedPathModel c = (HycoCondensedPathModel)m->model->data;

  PetscFunctionBegin;
  PetscCall(HycoGalerkinDestroy(&c->galerkin));
  PetscCall(HycoCondensedTableFree(&c->table));
  PetscCall(PetscFree(m->model->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedTakePath(HycoROM m)
{
  static const HycoROMTraits traits = {.title = "condensed",
                                       .work = sizeof(struct _n_HycoCondensedPath),
                                       .settings = HYCO_SETTINGS_NONE,
                                       .stiffness = PETSC_TRUE,
                                       .constrains = PETSC_TRUE,
                                       .history = PETSC_TRUE,
                                       .resultants = PETSC_TRUE,
                                       .cells = PETSC_TRUE};
  static const HycoROMOps ops = {.setfromoptions = HycoCondensedSetFromOptions,
                                 .resettraining = HycoCondensedResetTraining,
                                 .begin = HycoCondensedPathBegin,
                                 .modes = HycoCondensedPathModes,
                                 .build = Build,
                                 .finish = HycoGalerkinFinish,
                                 .report = Report,
                                 .cost = HycoGalerkinCost,
                                 .offers = HycoCondensedOffers,
                                 .work = HycoCondensedWork,
                                 .setup = SetUp,
                                 .reset = Reset,
                                 .solve = HycoGalerkinSolve,
                                 .condition = HycoGalerkinCondition,
                                 .view = View,
                                 .save = Move,
                                 .load = Move,
                                 .destroy = Destroy};
  HycoCondensed none = (HycoCondensed)m->model->data;
  HycoCondensedPathModel c;

  PetscFunctionBegin;
  PetscCall(HycoCondensedFree(&none));
  PetscCall(PetscNew(&c));
  c->galerkin.stiffness = Stiffness;
  c->galerkin.add_loads = AddLoads;
  c->galerkin.forces = Forces;
  PetscCall(HycoROMSetOps(m, &ops, &traits, c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
