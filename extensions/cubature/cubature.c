/*
  The cubature model: the modes are also the test functions over all of the bodies, but integrals over the bodies are
  sums over few cells,

    V^T f_int = sum of w_e V_e^T f_e over chosen cells e,   w_e > 0

  so that the reduced stiffness stays symmetric and, as a sum of the cells' with positive weights, semidefinite. Contact
  is that of the hybrid model (-hyco_dual fe): a finite-element multiplier for each contact, and full-order
  displacements of the contacts' nodes (39)-(40), whose equations are those of the cells around them, each of which has
  w = 1. With all cells of weight 1 it is the hybrid model with the whole mesh as its RID. Or contact is that of the
  projection-based model, nonnegative force vectors (44): with all cells of weight 1 it is then that model. Loads on
  surfaces are those of the whole mesh.
*/
#include "cubature.h"
#include <hycoextensions.h>
#include <hycoromtype.h>
#include <petscviewer.h>

/* Finite-element multipliers by default, as in the hybrid model; the object lives as long as the reducer, for all of
   its runs. */
static PetscErrorCode SetFromOptions(HycoReducer t)
{
  HycoCubatureTraining c;

  PetscFunctionBegin;
  PetscCall(PetscNew(&c));
  t->training = c;
  c->tol = 1e-4;
  c->forces.dual = HYCO_DUAL_FE;
  PetscCall(HycoForceBasisSetFromOptions(t));
  PetscObjectOptionsBegin((PetscObject)t);
  PetscCall(HycoOptionsFor("cubature"));
  PetscCall(HycoOptionsReal("-hyco_cubature_tol",
                            "relative error of the chosen cells in the internal forces of training (0: all cells)", 0,
                            1, &c->tol, NULL));
  PetscOptionsEnd();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The data of a run, not the options. */
static PetscErrorCode ResetTraining(HycoReducer t)
{
  HycoCubatureTraining c = (HycoCubatureTraining)t->training;

  PetscFunctionBegin;
  HycoFreeAll(&c->weight, &c->near, &c->full);
  c->n = c->n_full = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All checks before the first solution is computed, which may take hours. */
static PetscErrorCode CubatureBegin(HycoReducer t)
{
  const PetscBool vectors = (PetscBool)(((HycoCubatureTraining)t->training)->forces.dual != HYCO_DUAL_FE);

  PetscFunctionBegin;
  HycoCheck(vectors || t->hybrid != HYCO_HYBRID_ALL,
            "-hyco_hybrid all is for -hyco_model_type hybrid; for a cubature use contact (all displacements of the "
            "contacts' nodes) or rank (one for each contact)");
  HycoCheck(t->sizes[3] > 1, "-hyco_model_type cubature is for 2D and 3D; in 1D use hybrid or projection");
  HycoCheck(!t->scene->n_ties,
            "-hyco_model_type cubature is for scenes without ties; use bodies, hybrid, projection or regression");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The modes of the force basis, then the cells. Collective. */
static PetscErrorCode CubatureModes(HycoReducer t, HycoSnapshots store)
{
  HycoCubatureTraining c = (HycoCubatureTraining)t->training;
  PetscReal *sigma;
  PetscInt n = 0;
  Mat W;

  PetscFunctionBegin;
  PetscCall(HycoProjectionModes(t, store));
  PetscCall(HycoCubatureFindContacts(t));
  if (c->tol == 0) {
    PetscCall(HycoCubatureChooseAll(t));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoCubatureSample(t, store, c->tol * c->tol, &W, &n, &sigma));
  if (n)
    PetscCall(HycoCubatureChoose(t, W, n, sigma));
  else /* contacts on all nodes */
    PetscCall(HycoCubatureChooseAll(t));
  PetscCall(MatDestroy(&W));
  PetscCall(PetscFree(sigma));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With finite-element multipliers the functions of force vectors are not used. */
static void TakeContact(HycoROM m)
{
  HycoProjectionModel p = (HycoProjectionModel)m->model->data;

  if (p->dual != HYCO_DUAL_FE) return;
  p->galerkin.contact = p->galerkin.gap = p->galerkin.expand = NULL;
  m->model->traits.constrains = PETSC_TRUE;
}

/* Every node is in A, and every contact belongs to the model; sets the cells' weights. */
static PetscErrorCode CubatureBuild(HycoROM m, HycoReducer t)
{
  const HycoCubatureTraining c = (HycoCubatureTraining)t->training;
  HycoCubatureModel r = (HycoCubatureModel)m->model->data;

  PetscFunctionBegin;
  PetscCall(HycoROMSetDomain(m, NULL));
  for (PetscInt k = 0; k < m->model->pairs.n; k++) m->model->in_rid[k] = 1;
  PetscCall(PetscMalloc1(m->model->mesh->n_cells, &r->weight));
  for (PetscInt e = 0; e < m->model->mesh->n_cells; e++) {
    PetscInt at = -1;

    /* The mesh of the model has exactly the chosen cells, in an order of its own; t->seeds_cell is ascending. */
    PetscCall(PetscFindInt(m->model->mesh->cell_whole[e], c->n, t->seeds_cell, &at));
    PetscCheck(at >= 0, PETSC_COMM_SELF, PETSC_ERR_PLIB, "a cell of the model has no weight");
    r->weight[e] = c->weight[at];
  }
  PetscCall(PetscArraycpy(r->error, c->error, 2));
  PetscCall(HycoProjectionMakeBasis(m, t));
  TakeContact(m);
  PetscCall(HycoCubatureSetFullOrder(m, t));
  PetscCall(HycoProjectionJudge(m, t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define WORDS 96

/* "33 contacts with 128 full-order displacements", or "8 force vectors for 33 contacts" */
static void DescribeContact(HycoROM m, char text[WORDS])
{
  const HycoProjectionModel p = (HycoProjectionModel)m->model->data;

  if (p->dual == HYCO_DUAL_FE)
    (void)snprintf(text, WORDS, "%d contacts with %d full-order displacements", (int)m->model->pairs.n,
                   (int)m->model->n_fe);
  else
    (void)snprintf(text, WORDS, "%d force vectors for %d contacts", (int)p->l_lambda, (int)m->model->pairs.n);
}

/* On the rank that has the model. */
static PetscErrorCode CubatureReport(HycoReducer t, HycoROM m, HycoTraining *r)
{
  const HycoCubatureModel c = (HycoCubatureModel)m->model->data;
  char contact[WORDS];

  PetscFunctionBegin;
  PetscCall(HycoProjectionReport(t, m, r));
  PetscCall(HycoTrainingAddFact(r, "cubature_error", c->error[0]));
  DescribeContact(m, contact);
  snprintf(r->summary, sizeof(r->summary),
           "%d snapshots; %d displacement modes; %s; cubature on %d of %d elements (%.1f %%), with an error of %.1e in "
           "the internal forces of training\n",
           (int)r->n_samples, (int)r->n_modes, contact, (int)m->model->mesh->n_cells, (int)m->model->whole_cells,
           100 * (double)r->rid_fraction, (double)c->error[0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Weights are borrowed by fe. Facets of loads and contacts belong to no chosen cell in general, and are all
   integrated. */
static PetscErrorCode SetUp(HycoROM m)
{
  PetscFunctionBegin;
  PetscCall(HycoProjectionSetUp(m));
  m->fe->cell_weight = ((HycoCubatureModel)m->model->data)->weight;
  m->fe->all_facets = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The range of the weights shows whether few cells stand for many: a cell may represent thousands. */
static PetscErrorCode CubatureView(HycoROM m, PetscViewer viewer)
{
  const HycoCubatureModel c = (HycoCubatureModel)m->model->data;
  PetscReal least = PETSC_MAX_REAL, most = 0;
  char contact[WORDS];

  PetscFunctionBegin;
  for (PetscInt e = 0; e < m->model->mesh->n_cells; e++) {
    least = PetscMin(least, c->weight[e]);
    most = PetscMax(most, c->weight[e]);
  }
  PetscCall(PetscViewerASCIIPrintf(viewer,
                                   "  cubature: %d of %d elements (%.1f %%), weights from %.3g to %.3g; error of the "
                                   "internal forces of training: %.1e; %d contacts\n",
                                   (int)m->model->mesh->n_cells, (int)m->model->whole_cells,
                                   100. * (double)m->model->mesh->n_cells / (double)m->model->whole_cells,
                                   (double)least, (double)most, (double)c->error[0], (int)m->model->pairs.n));
  DescribeContact(m, contact);
  PetscCall(PetscViewerASCIIPrintf(viewer, "  %s\n", contact));
  PetscCall(c->projection.dual == HYCO_DUAL_FE ? HycoGalerkinView(m, viewer) : HycoProjectionViewForces(m, viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes to the model file, or reads from it. */
static PetscErrorCode CubatureMove(HycoROM m, HycoH5 h)
{
  HycoCubatureModel c = (HycoCubatureModel)m->model->data;

  PetscFunctionBegin;
  PetscCall(HycoProjectionMove(m, h));
  TakeContact(m);
  PetscCall(HycoH5Real(h, "cubature/weight", &m->model->mesh->n_cells, 1, &c->weight));
  PetscCall(HycoH5Reals(h, "cubature/error", 2, c->error));
  for (PetscInt e = 0; e < m->model->mesh->n_cells; e++)
    HycoCheck(c->weight[e] > 0, "%s: cubature/weight is damaged", m->model->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CubatureDestroy(HycoROM m)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(((HycoCubatureModel)m->model->data)->weight));
  PetscCall(HycoProjectionDestroy(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With a stiffness and a history, like the hybrid model; cells: its mesh is not a connected part. */
static PetscErrorCode CubatureCreate(HycoROM m)
{
  static const HycoROMTraits traits = {.title = "cubature",
                                       .work = sizeof(struct _n_HycoGalerkin),
                                       .settings = HYCO_SETTINGS_MODES,
                                       .stiffness = PETSC_TRUE,
                                       .force_basis = PETSC_TRUE,
                                       .history = PETSC_TRUE,
                                       .cells = PETSC_TRUE};
  static const HycoROMOps ops = {.setup = SetUp,
                                 .reset = HycoGalerkinReset,
                                 .solve = HycoGalerkinSolve,
                                 .energy = HycoGalerkinEnergy,
                                 .condition = HycoGalerkinCondition,
                                 .view = CubatureView,
                                 .save = CubatureMove,
                                 .load = CubatureMove,
                                 .destroy = CubatureDestroy};
  HycoCubatureModel c;

  PetscFunctionBegin;
  PetscCall(PetscNew(&c));
  HycoProjectionInit(&c->projection);
  PetscCall(HycoROMSetOps(m, &ops, &traits, c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finish and cost are those of all Galerkin models. */
static PetscErrorCode CreateTrainer(HycoTrainerOps *ops)
{
  PetscFunctionBegin;
  *ops = (HycoTrainerOps){.setfromoptions = SetFromOptions,
                          .reset = ResetTraining,
                          .begin = CubatureBegin,
                          .modes = CubatureModes,
                          .build = CubatureBuild,
                          .finish = HycoGalerkinFinish,
                          .report = CubatureReport,
                          .cost = HycoGalerkinCost};
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CubatureRegister(void)
{
  PetscFunctionBegin;
  PetscCall(HycoROMRegister(HYCO_ROM_CUBATURE, CubatureCreate));
  PetscCall(HycoTrainerRegister(HYCO_ROM_CUBATURE, CreateTrainer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineExtension(cubature, CubatureRegister())
