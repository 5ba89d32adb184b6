/* K: the element loop of linear elasticity (plane strain in 2D), and the matrices it fills. */
#include "kinematics.h"

PetscErrorCode HycoFEElementStiffness(HycoFE fe, PetscInt cell, PetscReal Ke[])
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);
  const PetscInt dim = fe->dim, n = el->nv * dim;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(Ke, n * n));
  for (PetscInt q = 0; q < el->nq; q++) {
    const PetscReal *lame = fe->lame + 2 * (cell * el->nq + q);
    PetscReal g[8][3], w;

    PetscCall(HycoGradients(fe, el, cell, q, g, &w));
    for (PetscInt a = 0; a < el->nv; a++) {
      for (PetscInt b = 0; b < el->nv; b++) {
        const PetscReal dot = w * lame[1] * (g[a][0] * g[b][0] + g[a][1] * g[b][1] + g[a][2] * g[b][2]);
        PetscReal *block = Ke + a * dim * n + b * dim;

        if (dim == 1) {
          block[0] += dot;
          continue;
        }
        for (PetscInt c = 0; c < dim; c++) {
          for (PetscInt d = 0; d < dim; d++)
            block[c * n + d] += w * (lame[0] * g[a][c] * g[b][d] + lame[1] * g[a][d] * g[b][c]);
          block[c * n + c] += dot;
        }
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscInt Global(HycoMesh m, PetscInt node)
{
  return m->node_global ? m->node_global[node] : node;
}

/* Distinct neighbours of each owned node, on this rank's columns and off them. */
static PetscErrorCode CountNeighbours(HycoMesh m, PetscInt n_owned, PetscInt first, PetscInt on[], PetscInt off[])
{
  PetscInt *start, *around, *seen;

  PetscFunctionBegin;
  PetscCall(HycoMeshNodeCells(m, &start, &around));
  PetscCall(PetscMalloc1(m->n_nodes, &seen));
  for (PetscInt i = 0; i < m->n_nodes; i++) seen[i] = -1;
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    const PetscInt row = Global(m, i) - first;

    if (row < 0 || row >= n_owned) continue;
    on[row] = 1; /* its own diagonal, even of a node without cells */
    seen[i] = i;
    for (PetscInt k = start[i]; k < start[i + 1]; k++) {
      for (PetscInt v = 0; v < m->nv; v++) {
        const PetscInt j = m->cells[around[k] * m->nv + v], col = Global(m, j) - first;

        if (seen[j] == i) continue;
        seen[j] = i;
        if (col >= 0 && col < n_owned)
          on[row]++;
        else
          off[row]++;
      }
    }
  }
  PetscCall(PetscFree(seen));
  PetscCall(PetscFree(start));
  PetscCall(PetscFree(around));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFECreateMatrix(HycoFE fe, MPI_Comm comm, PetscInt n_owned, PetscInt first, Mat *A)
{
  PetscInt *on, *off;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(n_owned, &on, n_owned, &off));
  PetscCall(CountNeighbours(fe->mesh, n_owned, first, on, off));
  PetscCall(MatCreate(comm, A));
  PetscCall(MatSetSizes(*A, n_owned * fe->dim, n_owned * fe->dim, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetBlockSize(*A, fe->dim));
  PetscCall(MatSetType(*A, MATAIJ));
  PetscCall(MatXAIJSetPreallocation(*A, fe->dim, on, off, NULL, NULL));
  PetscCall(MatSetOption(*A, MAT_IGNORE_OFF_PROC_ENTRIES, PETSC_TRUE)); /* each rank has all cells of its rows */
  PetscCall(MatSetOption(*A, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatSetOption(*A, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
  PetscCall(PetscFree2(on, off));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds an element matrix, fixed unknowns reduced to their own diagonal. */
static PetscErrorCode AddElement(HycoFE fe, PetscInt cell, const PetscReal Ae[], Mat A)
{
  HycoMesh m = fe->mesh;
  const PetscInt n = m->nv * m->dim;
  PetscInt index[HYCO_MAX_CELL_DOFS];

  PetscFunctionBegin;
  for (PetscInt v = 0; v < m->nv; v++) {
    const PetscInt i = m->cells[cell * m->nv + v];

    for (PetscInt c = 0; c < m->dim; c++) {
      const PetscInt row = Global(m, i) * m->dim + c, k = v * m->dim + c;

      index[k] = row;
      if (fe->fixed[i * m->dim + c]) {
        PetscCall(MatSetValue(A, row, row, Ae[k * n + k], ADD_VALUES));
        index[k] = -1;
      }
    }
  }
  PetscCall(MatSetValues(A, n, index, n, index, Ae, ADD_VALUES));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nodes without cells (contact nodes outside an RID) keep a zero on the diagonal so that the matrix is square. */
static PetscErrorCode Finish(Mat A)
{
  PetscFunctionBegin;
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AddStiffness(HycoFE fe, Mat K)
{
  PetscReal Ke[HYCO_MAX_CELL_DOFS * HYCO_MAX_CELL_DOFS];

  PetscFunctionBegin;
  PetscCall(MatZeroEntries(K));
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++) {
    PetscCall(HycoFEElementStiffness(fe, e, Ke));
    PetscCall(AddElement(fe, e, Ke, K));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The end of an assembly is collective: a rank that found an error takes part in it, or the others would wait. */
PetscErrorCode HycoFEAssembleStiffness(HycoFE fe, Mat K)
{
  PetscErrorCode ierr;

  PetscFunctionBegin;
  ierr = AddStiffness(fe, K);
  PetscCall(Finish(K));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFEAssembleH1(HycoFE fe, Mat M)
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);
  const PetscInt dim = fe->dim, n = el->nv * dim;
  PetscReal Me[HYCO_MAX_CELL_DOFS * HYCO_MAX_CELL_DOFS];

  PetscFunctionBegin;
  PetscCall(MatSetOption(M, MAT_IGNORE_ZERO_ENTRIES, PETSC_TRUE)); /* components do not couple */
  PetscCall(MatZeroEntries(M));
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++) {
    PetscCall(PetscArrayzero(Me, n * n));
    for (PetscInt q = 0; q < el->nq; q++) {
      PetscReal g[8][3], w;

      PetscCall(HycoGradients(fe, el, e, q, g, &w));
      for (PetscInt a = 0; a < el->nv; a++) {
        for (PetscInt b = 0; b < el->nv; b++) {
          const PetscReal value =
              w * (el->N[q][a] * el->N[q][b] + g[a][0] * g[b][0] + g[a][1] * g[b][1] + g[a][2] * g[b][2]);

          for (PetscInt c = 0; c < dim; c++) Me[(a * dim + c) * n + b * dim + c] += value;
        }
      }
    }
    PetscCall(AddElement(fe, e, Me, M));
  }
  PetscCall(Finish(M));
  PetscFunctionReturn(PETSC_SUCCESS);
}
