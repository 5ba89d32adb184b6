/* What hybrid and projection-based models have in the model file, and what they say of it. */
#include <hycotable.h>
#include <petscviewer.h>

PetscErrorCode HycoGalerkinSave(HycoROM m, HycoH5 h)
{
  HycoGalerkin g = (HycoGalerkin)m->data;

  PetscFunctionBegin;
  if (g->G) {
    PetscCall(HycoH5WriteReal(h, "problem/G", m->l, m->n_fe, g->G));
    PetscCall(HycoH5WriteReal(h, "problem/ridge", 1, 1, &g->ridge));
  }
  if (g->scan.n) {
    const PetscInt counts[2] = {g->scan.n, g->scan.n_singular};

    PetscCall(HycoH5WriteInt(h, "training/scan_counts", 2, 1, counts));
    PetscCall(HycoH5WriteReal(h, "training/scan_smallest", 1, 1, &g->scan.smallest));
    PetscCall(HycoH5WriteReal(h, "training/scan_at", m->scene->n_parameters, 1, g->scan.at));
  }
  if (g->table) PetscCall(HycoTableSave(m, h));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LoadScan(HycoH5 h, HycoROM m)
{
  HycoScan *scan = &((HycoGalerkin)m->data)->scan;
  PetscInt one = 1, two = 2, *counts;

  PetscFunctionBegin;
  if (!HycoH5Has(h, "training/scan_counts")) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoH5LoadInt(h, "training/scan_counts", 0, PETSC_MAX_INT, &two, &one, &counts));
  scan->n = counts[0];
  scan->n_singular = counts[1];
  PetscCall(PetscFree(counts));
  PetscCall(HycoH5ReadReal(h, "training/scan_smallest", 1, 1, &scan->smallest));
  PetscCall(HycoH5ReadReal(h, "training/scan_at", m->scene->n_parameters, 1, scan->at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoGalerkinLoad(HycoROM m, HycoH5 h)
{
  HycoGalerkin g = (HycoGalerkin)m->data;

  PetscFunctionBegin;
  if (HycoH5Has(h, "problem/G")) {
    PetscCall(HycoH5LoadReal(h, "problem/G", &m->l, &m->n_fe, &g->G));
    PetscCall(HycoH5ReadReal(h, "problem/ridge", 1, 1, &g->ridge));
  }
  PetscCall(LoadScan(h, m));
  if (HycoH5Has(h, "table")) PetscCall(HycoTableLoad(m, h));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ViewScan(HycoROM m, PetscViewer viewer)
{
  HycoGalerkin g = (HycoGalerkin)m->data;

  PetscFunctionBegin;
  if (!g->scan.n) {
    PetscCall(PetscViewerASCIIPrintf(viewer, "  not scanned for a singular reduced stiffness\n"));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscViewerASCIIPrintf(viewer, "  scanned at %d points: smallest singular value %.2e of the largest",
                                   (int)g->scan.n, (double)g->scan.smallest));
  for (PetscInt p = 0; p < m->scene->n_parameters; p++)
    PetscCall(
        PetscViewerASCIIPrintf(viewer, "%s %s = %.6g", p ? "," : " at", m->scene->parameter[p], (double)g->scan.at[p]));
  if (g->scan.n_singular)
    PetscCall(PetscViewerASCIIPrintf(viewer, "; SINGULAR inside the ranges: the determinant has the other sign at %d",
                                     (int)g->scan.n_singular));
  PetscCall(PetscViewerASCIIPrintf(viewer, "\n"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoGalerkinView(HycoROM m, PetscViewer viewer)
{
  HycoGalerkin g = (HycoGalerkin)m->data;

  PetscFunctionBegin;
  if (m->numbers[0] > 0) /* else too large to be known */
    PetscCall(PetscViewerASCIIPrintf(viewer, "  condition of the reduced stiffness: %.2e\n", (double)m->numbers[0]));
  if (g->table) PetscCall(HycoTableView(m, viewer));
  if (!g->symmetric) PetscCall(ViewScan(m, viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}
