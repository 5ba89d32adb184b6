/* The hybrid hyper-reduced model (38)-(41): the reduced system with the finite-element multipliers of the RID's
   contacts. */
#include <hycohybrid.h>
#include <hycoromtypes.h>
#include <hycocontactstate.h>
#include <petscviewer.h>

/* Into the model's data: the solver of (41) is the user's choice, not a part of the file. */
static PetscErrorCode SetFromOptions(HycoROM m)
{
  HycoHybridModel h = (HycoHybridModel)m->model->data;

  PetscFunctionBegin;
  PetscObjectOptionsBegin((PetscObject)m);
  PetscCall(HycoOptionsFor(""));
  PetscCall(HycoOptionsWord(
      "-hyco_reconstruct_solver",
      "solver of (41): the active set of Lawson and Hanson, or TAO's bnls; auto: TAO if the active set stops early",
      HycoReconstructSolvers, &h->reconstruct_solver, NULL));
  PetscOptionsEnd();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The reconstruction is that of the mesh and the pairs of this set-up, and is made anew with the next one. */
static PetscErrorCode HybridReset(HycoROM m)
{
  PetscFunctionBegin;
  PetscCall(HycoReconstructionDestroy(&((HycoHybridWork)m->work)->reconstruction));
  PetscCall(HycoGalerkinReset(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Prints the RID, its full-order displacements, and the data of the reconstruction. Numbers of other modes are those of
   training; they seed the RID and are not part of the model. */
static PetscErrorCode HybridView(HycoROM m, PetscViewer viewer)
{
  static const char *const words[] = {"auto", "rank: the fewest that give full row rank",
                                      "contact: all on the contact surfaces of the RID",
                                      "all of A, interface by ridge regression on the modes"};
  const HycoHybridModel h = (HycoHybridModel)m->model->data;
  PetscInt nodes, a, in = 0;

  PetscFunctionBegin;
  PetscCall(ISGetLocalSize(m->model->rid, &nodes));
  PetscCall(ISGetLocalSize(m->model->inside, &a));
  for (PetscInt k = 0; k < m->model->pairs.n; k++) in += m->model->in_rid[k];
  PetscCall(PetscViewerASCIIPrintf(viewer, "  other modes that seeded the RID: %d dual, %d stress, %d force\n",
                                   (int)m->model->counts[0], (int)m->model->counts[1], (int)m->model->counts[2]));
  PetscCall(PetscViewerASCIIPrintf(viewer,
                                   "  RID: %d of %d elements (%.1f %%), %d of %d nodes, %d in A; %d of %d contacts\n",
                                   (int)m->model->mesh->n_cells, (int)m->model->whole_cells,
                                   100. * (double)m->model->mesh->n_cells / (double)m->model->whole_cells, (int)nodes,
                                   (int)m->model->whole_nodes, (int)a, (int)in, (int)m->model->pairs.n));
  if (m->model->pairs.n)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  full-order displacements: %d (%s)\n", (int)m->model->n_fe,
                                     words[m->model->hybrid]));
  /* G: the regression of gamma on the unknowns of A. */
  if (m->model->hybrid == HYCO_HYBRID_ALL && h->galerkin.G)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  ridge: %.0e of the first squared singular value\n",
                                     (double)h->galerkin.ridge));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  dual snapshots for the reconstruction: %d\n", (int)h->n_dual));
  PetscCall(HycoGalerkinView(m, viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes to the model file, or reads from it. Writes or reads, by the file's direction. -1: the number of snapshots is
   taken from the file. */
static PetscErrorCode HybridMove(HycoROM m, HycoH5 file)
{
  HycoHybridModel h = (HycoHybridModel)m->model->data;

  PetscFunctionBegin;
  PetscCall(HycoGalerkinMove(m, file));
  if (HycoH5Reads(file)) h->n_dual = -1;
  /* With friction a row for each normal and tangent. */
  PetscCall(HycoH5Real(file, "reconstruction/S_lambda", &h->n_dual,
                       HycoContactStateCountRows(m->model->scene, &m->model->pairs, m->model->mesh->dim),
                       &h->S_lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The type's own data last: the common part of the Galerkin models refers to it. */
static PetscErrorCode HybridDestroy(HycoROM m)
{
  HycoHybridModel h = (HycoHybridModel)m->model->data;

  PetscFunctionBegin;
  PetscCall(HycoGalerkinDestroy(&h->galerkin));
  HycoFreeAll(&h->S_lambda, &m->model->data);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* .reconstruct makes it a type whose forces outside A_lambda follow from (41). Galerkin's functions do the rest: the
   type adds the RID's reconstruction to them. */
PetscErrorCode HycoROMCreate_Hybrid(HycoROM m)
{
  static const HycoROMTraits traits = {.title = "hybrid hyper-reduced",
                                       .work = sizeof(*(HycoHybridWork)NULL),
                                       .settings = HYCO_SETTINGS_RID,
                                       .stiffness = PETSC_TRUE,
                                       .constrains = PETSC_TRUE,
                                       .resultants = PETSC_TRUE,
                                       .history = PETSC_TRUE,
                                       .friction = PETSC_TRUE,
                                       .integrals = PETSC_TRUE};
  static const HycoROMOps ops = {.options = SetFromOptions,
                                 .setup = HycoGalerkinSetUp,
                                 .reset = HybridReset,
                                 .solve = HycoGalerkinSolve,
                                 .unknowns = HycoGalerkinUnknowns,
                                 .residual = HycoGalerkinResidual,
                                 .jacobian = HycoGalerkinJacobian,
                                 .expand = HycoGalerkinUnpack,
                                 .reconstruct = HycoHybridReconstruct,
                                 .energy = HycoGalerkinEnergy,
                                 .condition = HycoGalerkinCondition,
                                 .local = HycoGalerkinLocal,
                                 .view = HybridView,
                                 .save = HybridMove,
                                 .load = HybridMove,
                                 .destroy = HybridDestroy};
  HycoHybridModel h;

  PetscFunctionBegin;
  PetscCall(PetscNew(&h));
  PetscCall(HycoROMSetOps(m, &ops, &traits, h));
  PetscFunctionReturn(PETSC_SUCCESS);
}
