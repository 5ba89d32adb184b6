/* The data of hybrid and projection-based models in the model file, and their description. */
#include <hycotable.h>
#include <petscviewer.h>

/* The result of the scan: absent, and then not written either, in models that were not scanned. */
static PetscErrorCode MoveScan(HycoROM m, HycoH5 h)
{
  HycoScan *scan = &((HycoGalerkinModel)m->model->data)->scan;
  PetscInt counts[2] = {scan->n, scan->n_singular};

  PetscFunctionBegin;
  if (HycoH5Reads(h) ? !HycoH5Has(h, "training/scan_counts") : !scan->n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoH5Ints(h, "training/scan_counts", 0, PETSC_MAX_INT, 2, counts));
  /* The same statements read and write: when writing, the values come back unchanged. */
  scan->n = counts[0];
  scan->n_singular = counts[1];
  PetscCall(HycoH5Reals(h, "training/scan_smallest", 1, &scan->smallest));
  PetscCall(HycoH5Reals(h, "training/scan_at", m->model->scene->n_parameters, scan->at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* G, scan and table are each optional; what is absent is not needed by the model or was not made. */
PetscErrorCode HycoGalerkinMove(HycoROM m, HycoH5 h)
{
  HycoGalerkinModel g = (HycoGalerkinModel)m->model->data;

  PetscFunctionBegin;
  if (HycoH5Reads(h) ? HycoH5Has(h, "problem/G") : g->G != NULL) {
    PetscCall(HycoH5Real(h, "problem/G", &m->model->l, m->model->n_fe, &g->G));
    /* The ridge of the regression of gamma on U[A], which `view` shows. */
    PetscCall(HycoH5Reals(h, "problem/ridge", 1, &g->ridge));
  }
  PetscCall(MoveScan(m, h));
  if (!HycoH5Reads(h) && g->table) PetscCall(HycoTableSave(m, h));
  if (HycoH5Reads(h) && HycoH5Has(h, "table")) PetscCall(HycoTableLoad(m, h));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A singular reduced stiffness inside the ranges is printed in capitals: predictions near it are meaningless. */
static PetscErrorCode ViewScan(HycoROM m, PetscViewer viewer)
{
  HycoGalerkinModel g = (HycoGalerkinModel)m->model->data;

  PetscFunctionBegin;
  if (!g->scan.n) {
    PetscCall(PetscViewerASCIIPrintf(viewer, "  not scanned for a singular reduced stiffness\n"));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscViewerASCIIPrintf(viewer, "  scanned at %d points: smallest singular value %.2e of the largest",
                                   (int)g->scan.n, (double)g->scan.smallest));
  for (PetscInt p = 0; p < m->model->scene->n_parameters; p++)
    PetscCall(PetscViewerASCIIPrintf(viewer, "%s %s = %.6g", p ? "," : " at", m->model->scene->parameter[p],
                                     (double)g->scan.at[p]));
  /* The scan only finds changes of sign between its points: a number, not the place. */
  if (g->scan.n_singular)
    PetscCall(PetscViewerASCIIPrintf(viewer, "; SINGULAR inside the ranges: the determinant has the other sign at %d",
                                     (int)g->scan.n_singular));
  PetscCall(PetscViewerASCIIPrintf(viewer, "\n"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A symmetric model is positive definite by construction, and needs no scan. */
PetscErrorCode HycoGalerkinView(HycoROM m, PetscViewer viewer)
{
  HycoGalerkinModel g = (HycoGalerkinModel)m->model->data;

  PetscFunctionBegin;
  if (m->model->numbers[0] > 0) /* otherwise not computed, because the matrix is too large */
    PetscCall(
        PetscViewerASCIIPrintf(viewer, "  condition of the reduced stiffness: %.2e\n", (double)m->model->numbers[0]));
  if (g->table) PetscCall(HycoTableView(m, viewer));
  if (!g->symmetric) PetscCall(ViewScan(m, viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}
