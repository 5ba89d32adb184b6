/*
  The projection-based model (44), online: modes for the displacements, nonnegative vectors for the contact forces, on
  the whole mesh (Balajewicz, Amsallem, Farhat, Int. J. Numer. Meth. Engng 106 (2016) 644-663; the paper's 6.3):

    V^T K V gamma + (V_lambda^T B V)^T Lambda_r = V^T F,
    0 <= Lambda_r  complementary to  V_lambda^T (D - B V gamma) >= 0

  Its stiffness is the hybrid model's with every node in A and no full-order unknown; this file adds the forces. Only
  V_lambda^T of the gaps is constrained: single contacts may penetrate.
*/
#include <hycoprojection.h>
#include <hycoromtypes.h>
#include <petscviewer.h>

/* Of the largest terms of a row of B V: that of the snapshots over a mode's singular value, which -hyco_pod_tol keeps
   above 1e-7 of the first. */
#define GAP_OF_MODE 1e-8

const char *const HycoDuals[] = {"fe", "nnmf", "snapshots", NULL};

/* Sets entries of V_lambda^T B V that are round-off to 0: where modes do not change the gaps, they would give random
   forces. */
static void DropRoundoff(HycoROM m, const PetscReal largest[], PetscScalar b[])
{
  const HycoProjectionModel p = (HycoProjectionModel)m->model->data;

  for (PetscInt i = 0; i < p->l_lambda; i++) {
    /* The size of the terms: a force vector's sum times the largest displacement of a mode. */
    PetscReal sum = 0;

    for (PetscInt c = 0; c < m->m; c++)
      sum += p->V_lambda[(size_t)i * (size_t)m->model->pairs.n + (size_t)m->contact[c]];
    for (PetscInt j = 0; j < m->model->l; j++) {
      if (PetscAbsScalar(b[j * p->l_lambda + i]) <= GAP_OF_MODE * sum * largest[j]) b[j * p->l_lambda + i] = 0;
    }
  }
}

/* V_lambda^T B V and its transpose. */
static PetscErrorCode FillContact(HycoROM m)
{
  HycoProjectionModel p = (HycoProjectionModel)m->model->data;
  HycoGalerkin g = (HycoGalerkin)m->work;
  const PetscInt l = m->model->l, n = p->l_lambda;
  const HycoRows *rows = &g->own_rows;
  PetscReal *BV, *size, *largest; /* for each contact: B V, the sums of absolute terms in it, and the largest of
                                     these sums */
  PetscScalar *b, *bt;

  PetscFunctionBegin;
  PetscCall(PetscCalloc3(l, &BV, l, &size, l, &largest));
  PetscCall(MatZeroEntries(g->Br));
  PetscCall(MatDenseGetArray(g->Br, &b));
  PetscCall(MatDenseGetArray(g->Btr, &bt));
  for (PetscInt c = 0; c < m->m; c++) {
    const PetscInt k = m->contact[c];

    PetscCall(PetscArrayzero(BV, l));
    PetscCall(PetscArrayzero(size, l));
    for (PetscInt t = rows->start[c]; t < rows->start[c + 1]; t++) {
      for (PetscInt j = 0; j < l; j++) {
        const PetscReal term = rows->value[t] * m->model->V[(size_t)rows->dof[t] * (size_t)l + (size_t)j];

        BV[j] += term;
        size[j] += PetscAbsReal(term);
      }
    }
    for (PetscInt j = 0; j < l; j++) {
      largest[j] = PetscMax(largest[j], size[j]);
      for (PetscInt i = 0; i < n; i++)
        b[j * n + i] += p->V_lambda[(size_t)i * (size_t)m->model->pairs.n + (size_t)k] * BV[j];
    }
  }
  DropRoundoff(m, largest, b);
  for (PetscInt j = 0; j < l; j++) {
    /* The transpose after round-off was dropped: both must have the same zeros. */
    for (PetscInt i = 0; i < n; i++) bt[i * l + j] = b[j * n + i];
  }
  PetscCall(MatDenseRestoreArray(g->Btr, &bt));
  PetscCall(MatDenseRestoreArray(g->Br, &b));
  PetscCall(PetscFree3(BV, size, largest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* If no mode changes the gap of a row, the gap is set open: no force can satisfy or violate it. */
static PetscErrorCode OpenUnmoved(HycoROM m, PetscScalar d[])
{
  HycoGalerkin g = (HycoGalerkin)m->work;
  const PetscInt n = ((HycoProjectionModel)m->model->data)->l_lambda;
  const PetscScalar *b;
  PetscReal largest = 0;

  PetscFunctionBegin;
  /* Any positive gap would do; one of the size of the others keeps the residuals' scale. */
  for (PetscInt i = 0; i < n; i++) largest = PetscMax(largest, PetscAbsScalar(d[i]));
  PetscCall(MatDenseGetArrayRead(g->Br, &b));
  for (PetscInt i = 0; i < n; i++) {
    PetscInt j = 0;

    while (j < m->model->l && b[j * n + i] == 0) j++;
    if (j == m->model->l) d[i] = largest > 0 ? largest : 1;
  }
  PetscCall(MatDenseRestoreArrayRead(g->Br, &b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* V_lambda^T D */
static PetscErrorCode FillGap(HycoROM m)
{
  HycoProjectionModel p = (HycoProjectionModel)m->model->data;
  HycoGalerkin g = (HycoGalerkin)m->work;
  PetscScalar *d;

  PetscFunctionBegin;
  PetscCall(VecGetArray(g->Dr, &d));
  for (PetscInt i = 0; i < p->l_lambda; i++) {
    const PetscReal *v = p->V_lambda + (size_t)i * (size_t)m->model->pairs.n;

    d[i] = 0;
    for (PetscInt c = 0; c < m->m; c++) d[i] += v[m->contact[c]] * g->own_rows.gap[c];
  }
  /* After the product: it may overwrite d. */
  PetscCall(OpenUnmoved(m, d));
  PetscCall(VecRestoreArray(g->Dr, &d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lambda = V_lambda Lambda_r. Adds, since HycoGalerkinUnpack() has cleared Lambda. */
static PetscErrorCode ProjectionExpand(HycoROM m)
{
  HycoProjectionModel p = (HycoProjectionModel)m->model->data;
  HycoGalerkin g = (HycoGalerkin)m->work;
  const PetscScalar *L;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(g->L, &L));
  for (PetscInt i = 0; i < p->l_lambda; i++) {
    const PetscReal *v = p->V_lambda + (size_t)i * (size_t)m->model->pairs.n;

    for (PetscInt c = 0; c < m->m; c++) m->Lambda[m->contact[c]] += L[i] * v[m->contact[c]];
  }
  PetscCall(VecRestoreArrayRead(g->L, &L));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The energy that the vectors leave out is that of the training; online forces outside their cone cannot be
   represented at all. */
PetscErrorCode HycoProjectionViewForces(HycoROM m, PetscViewer viewer)
{
  HycoProjectionModel p = (HycoProjectionModel)m->model->data;

  PetscFunctionBegin;
  if (m->model->counts[1])
    PetscCall(PetscViewerASCIIPrintf(viewer, "  supremizers of the dual snapshots among the modes: %d\n",
                                     (int)m->model->counts[1]));
  PetscCall(PetscViewerASCIIPrintf(
      viewer, "  force vectors: %d (%s); energy of the training forces that they leave out: %.2e\n", (int)p->l_lambda,
      p->dual == HYCO_DUAL_NNMF ? "nonnegative factorisation of the dual snapshots" : "the dual snapshots",
      (double)p->dual_misfit));
  PetscCall(HycoGalerkinView(m, viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ProjectionView(HycoROM m, PetscViewer viewer)
{
  PetscFunctionBegin;
  PetscCall(PetscViewerASCIIPrintf(viewer, "  on the whole mesh: %d elements, %d nodes, %d contacts\n",
                                   (int)m->model->whole_cells, (int)m->model->whole_nodes, (int)m->model->pairs.n));
  PetscCall(HycoProjectionViewForces(m, viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* n_L first: HycoGalerkinSetUp() allocates by it. */
PetscErrorCode HycoProjectionSetUp(HycoROM m)
{
  PetscFunctionBegin;
  m->n_L = ((HycoProjectionModel)m->model->data)->l_lambda;
  PetscCall(HycoGalerkinSetUp(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes to the model file, or reads from it. */
PetscErrorCode HycoProjectionMove(HycoROM m, HycoH5 h)
{
  HycoProjectionModel p = (HycoProjectionModel)m->model->data;
  PetscInt word = p->dual;

  PetscFunctionBegin;
  PetscCall(HycoGalerkinMove(m, h));
  if (HycoH5Reads(h)) {
    PetscCall(HycoROMLoadWord(m, h, "problem/dual", HycoDuals, &word));
    p->dual = (HycoDual)word;
    /* Not known before the dataset is read. */
    p->l_lambda = -1;
    /* Full-order unknowns exist only beside multipliers. */
    HycoCheck((p->dual == HYCO_DUAL_FE || m->model->n_fe == 0) && m->model->counts[1] <= m->model->l,
              "%s: problem/dual is damaged", m->model->path);
  } else
    PetscCall(HycoH5WriteText(h, "problem/dual", HycoDuals[p->dual]));
  PetscCall(HycoH5Real(h, "problem/V_lambda", &p->l_lambda, m->model->pairs.n, &p->V_lambda));
  PetscCall(HycoH5Reals(h, "training/dual_misfit", 1, &p->dual_misfit));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Files of cubature models may have fe; a projection-based one has more forces than modes with it. */
static PetscErrorCode ProjectionLoad(HycoROM m, HycoH5 h)
{
  PetscFunctionBegin;
  PetscCall(HycoProjectionMove(m, h));
  HycoCheck(((HycoProjectionModel)m->model->data)->dual != HYCO_DUAL_FE, "%s: problem/dual is damaged", m->model->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Types with force vectors of their own, such as the cubature, destroy them through this too. */
PetscErrorCode HycoProjectionDestroy(HycoROM m)
{
  HycoProjectionModel p = (HycoProjectionModel)m->model->data;

  PetscFunctionBegin;
  PetscCall(HycoGalerkinDestroy(&p->galerkin));
  HycoFreeAll(&p->V_lambda, &m->model->data);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Shared with the type cubature, which sets it up with its own traits. */
void HycoProjectionInit(HycoProjectionModel p)
{
  p->galerkin.contact = FillContact;
  p->galerkin.gap = FillGap;
  p->galerkin.expand = ProjectionExpand;
  p->galerkin.symmetric = PETSC_TRUE;
}

/* (44). whole: every cell is in the RID; force_basis: unknowns are coefficients of force vectors, not forces of
   contacts. */
PetscErrorCode HycoROMCreate_Projection(HycoROM m)
{
  static const HycoROMTraits traits = {.title = "projection-based",
                                       .work = sizeof(struct _n_HycoGalerkin),
                                       .settings = HYCO_SETTINGS_MODES,
                                       .whole = PETSC_TRUE,
                                       .stiffness = PETSC_TRUE,
                                       .force_basis = PETSC_TRUE,
                                       .history = PETSC_TRUE,
                                       .integrals = PETSC_TRUE};
  static const HycoROMOps ops = {.setup = HycoProjectionSetUp,
                                 .reset = HycoGalerkinReset,
                                 .solve = HycoGalerkinSolve,
                                 .unknowns = HycoGalerkinUnknowns,
                                 .residual = HycoGalerkinResidual,
                                 .jacobian = HycoGalerkinJacobian,
                                 .expand = HycoGalerkinUnpack,
                                 .energy = HycoGalerkinEnergy,
                                 .condition = HycoGalerkinCondition,
                                 .local = HycoGalerkinLocal,
                                 .view = ProjectionView,
                                 .save = HycoProjectionMove,
                                 .load = ProjectionLoad,
                                 .destroy = HycoProjectionDestroy};
  HycoProjectionModel p;

  PetscFunctionBegin;
  PetscCall(PetscNew(&p));
  HycoProjectionInit(p);
  PetscCall(HycoROMSetOps(m, &ops, &traits, p));
  PetscFunctionReturn(PETSC_SUCCESS);
}
