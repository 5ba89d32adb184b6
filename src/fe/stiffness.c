/*
  K: the element loop over the laws' tangents C: the sum of w B^T C B over a cell's points, or for isotropic tangents
  products of gradients that need no B. The element bbar uses the mean dilatation of the cell (T. J. R. Hughes, Int. J.
  Numer. Meth. Engng 15 (1980) 1413-1418); isotropic:

    sigma : eps = 2 mu (eps : eps - tr(eps)^2 / 3) + (lambda + 2 mu / 3) mean(tr eps)^2
*/
#include <hycokinematics.h>
#include "assembly_map.h"

/* P[r][s] += p[r] s[s] in the upper blocks of dim x dim. */
static void AddProducts(PetscInt nv, PetscInt dim, const PetscReal p[], const PetscReal s[], PetscReal P[])
{
  const PetscInt n = nv * dim;

  for (PetscInt r = 0; r < n; r++) {
    /* From the diagonal block on: the lower blocks follow by symmetry. */
    for (PetscInt t = r / dim * dim; t < n; t++) P[r * n + t] += p[r] * s[t];
  }
}

/* Ke += lambda P_cd + mu (P_dc + tr P) in each upper block, P = sum of w grad_a grad_b over points of one material.
   Products are summed over points of equal moduli first: with constant moduli the 4th-order contraction is done once
   per cell. */
static void AddMaterial(PetscInt nv, PetscInt dim, const PetscReal lame[2], const PetscReal P[], PetscReal Ke[])
{
  const PetscInt n = nv * dim;

  for (PetscInt a = 0; a < nv; a++) {
    /* Upper blocks: the element matrix is symmetric. */
    for (PetscInt b = a; b < nv; b++) {
      const PetscReal *p = P + a * dim * n + b * dim;
      PetscReal *block = Ke + a * dim * n + b * dim, trace = 0;

      for (PetscInt c = 0; c < dim; c++) trace += lame[1] * p[c * n + c];
      for (PetscInt c = 0; c < dim; c++) {
        for (PetscInt d = 0; d < dim && dim > 1; d++)
          block[c * n + d] += lame[0] * p[c * n + d] + lame[1] * p[d * n + c];
        block[c * n + c] += trace;
      }
    }
  }
}

/* The bulk part of bbar: bulk times the products of the mean gradients, in the upper blocks. Only the volumetric
   part changes: AddIsotropic() uses -2 mu / 3 in place of lambda, and the rest of the bulk modulus comes here. */
static PetscErrorCode AddMean(HycoFE fe, const HycoElement *el, PetscInt cell, PetscReal bulk, PetscReal Ke[])
{
  const PetscInt n = el->nv * fe->dim;
  PetscReal mean[HYCO_CELL_NODES][3];

  PetscFunctionBegin;
  PetscCall(HycoMeanGradients(fe, el, cell, mean));
  for (PetscInt r = 0; r < n; r++) {
    for (PetscInt t = r / fe->dim * fe->dim; t < n; t++)
      Ke[r * n + t] += bulk * mean[r / fe->dim][r % fe->dim] * mean[t / fe->dim][t % fe->dim];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The upper blocks where the tangents are isotropic. */
static PetscErrorCode AddIsotropic(HycoFE fe, const HycoElement *el, PetscInt cell, PetscReal Ke[])
{
  const PetscInt dim = fe->dim, n = el->nv * dim;
  const PetscBool bbar = fe->bbar[fe->mesh->cell_body[cell]];
  const PetscReal *lame = fe->tangent + fe->tangent_start[cell];
  PetscReal P[HYCO_MAX_CELL_DOFS * HYCO_MAX_CELL_DOFS], bulk = 0;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(P, n * n));
  for (PetscInt q = 0; q < el->nq; q++, lame += 2) {
    const PetscReal own[2] = {bbar ? -2 * lame[1] / 3 : lame[0], lame[1]};
    PetscReal g[HYCO_CELL_NODES][3], w, p[HYCO_MAX_CELL_DOFS], s[HYCO_MAX_CELL_DOFS];

    PetscCall(HycoGradients(fe, el, cell, q, g, &w));
    for (PetscInt r = 0; r < n; r++) {
      s[r] = g[r / dim][r % dim];
      p[r] = w * s[r];
    }
    /* lambda + 2 mu / 3 of each point, over the volume. */
    bulk += w * (lame[0] - own[0]);
    AddProducts(el->nv, dim, p, s, P);
    /* lame[2], lame[3]: the next point's moduli. */
    if (q + 1 < el->nq && lame[0] == lame[2] && lame[1] == lame[3]) continue; /* the next point has the same material */
    AddMaterial(el->nv, dim, own, P, Ke);
    PetscCall(PetscArrayzero(P, n * n));
  }
  if (bbar) PetscCall(AddMean(fe, el, cell, bulk, Ke));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Strain components of unit displacements at a point, B (n_sigma x n); mean: gradients for the dilatation. The mean
   part replaces the dilatation by the cell's mean, a third in each normal component. */
static void StrainRows(HycoFE fe, const HycoElement *el, PetscReal g[HYCO_CELL_NODES][3],
                       PetscReal mean[HYCO_CELL_NODES][3], PetscReal B[])
{
  static const PetscInt shear[3][3] = {{-1, 3, 5}, {3, -1, 4}, {5, 4, -1}}; /* component of h_cd + h_dc */
  const PetscInt dim = fe->dim, n = el->nv * dim;

  for (PetscInt k = 0; k < fe->n_sigma * n; k++) B[k] = 0;
  for (PetscInt r = 0; r < n; r++) {
    const PetscInt a = r / dim, c = r % dim;

    B[c * n + r] = g[a][c];
    for (PetscInt d = 0; d < dim; d++) {
      if (d != c) B[shear[c][d] * n + r] = g[a][d];
    }
    if (fe->formulation == HYCO_AXISYMMETRIC && c == 0) B[2 * n + r] = g[a][2];
    for (PetscInt k = 0; mean && k < 3; k++) B[k * n + r] += (mean[a][c] - HycoDilatation(fe, g, a, c)) / 3;
  }
}

/* The upper blocks of the sum of w B^T C B. C B is formed row by row, so that only one row is stored; zeros of B are
   skipped. */
static PetscErrorCode AddGeneral(HycoFE fe, const HycoElement *el, PetscInt cell, PetscReal Ke[])
{
  const PetscInt ns = fe->n_sigma, n = el->nv * fe->dim;
  /* The same replacement of the dilatation as in forces and stresses. */
  const PetscBool bbar = fe->bbar[fe->mesh->cell_body[cell]];
  PetscReal mean[HYCO_CELL_NODES][3];

  PetscFunctionBegin;
  if (bbar) PetscCall(HycoMeanGradients(fe, el, cell, mean));
  for (PetscInt q = 0; q < el->nq; q++) {
    const PetscReal *C = fe->tangent + fe->tangent_start[cell] + q * ns * ns;
    PetscReal g[HYCO_CELL_NODES][3], w, B[6 * HYCO_MAX_CELL_DOFS], CB[HYCO_MAX_CELL_DOFS];

    PetscCall(HycoGradients(fe, el, cell, q, g, &w));
    StrainRows(fe, el, g, bbar ? mean : NULL, B);
    for (PetscInt k = 0; k < ns; k++) {
      for (PetscInt t = 0; t < n; t++) CB[t] = 0;
      for (PetscInt l = 0; l < ns; l++) {
        const PetscReal c = w * C[k * ns + l];

        for (PetscInt t = 0; t < n; t++) CB[t] += c * B[l * n + t];
      }
      for (PetscInt r = 0; r < n; r++) {
        const PetscReal b = B[k * n + r];

        for (PetscInt t = r / fe->dim * fe->dim; t < n && b != 0; t++) Ke[r * n + t] += b * CB[t];
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The body's element matrix, n x n (n = nv x dim), without springs and elimination: upper blocks are computed, then
   mirrored. */
PetscErrorCode HycoFEBodyStiffness(HycoFE fe, PetscInt cell, PetscReal Ke[])
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);
  const PetscInt dim = fe->dim, n = el->nv * dim;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(Ke, n * n));
  if (HycoFEIsIsotropic(fe, cell))
    PetscCall(AddIsotropic(fe, el, cell, Ke));
  else
    PetscCall(AddGeneral(fe, el, cell, Ke));
  for (PetscInt r = 0; r < n; r++) {
    for (PetscInt t = 0; t < r / dim * dim; t++) Ke[r * n + t] = Ke[t * n + r];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One buffer in fe, which grows to the largest cell: cells with tied nodes have rows for their masters. Borrowed
   until the next call. */
PetscErrorCode HycoFEElementRoom(HycoFE fe, PetscInt cell, PetscReal **Ke)
{
  const size_t n = (size_t)(HycoMeshCellSize(fe->mesh, cell) * fe->dim);

  PetscFunctionBegin;
  if (n * n > fe->n_room) {
    PetscCall(PetscRealloc(n * n * sizeof(PetscReal), &fe->room));
    fe->n_room = n * n;
  }
  *Ke = fe->room;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds up the rows and columns of the repeated nodes of a collapsed cell. */
static void SumRepeated(HycoMesh m, PetscInt cell, PetscReal Ke[])
{
  const PetscInt *node = m->cells + cell * m->nv, n = m->nv * m->dim;
  PetscInt own[HYCO_CELL_NODES], row[HYCO_MAX_CELL_DOFS];
  const PetscInt size = HycoMeshOwnNodes(m, cell, own) * m->dim;
  PetscReal sum[HYCO_MAX_CELL_DOFS * HYCO_MAX_CELL_DOFS];

  if (size == n) return;
  for (PetscInt r = 0, at = 0; r < n; r++) {
    /* Repeated nodes of a collapsed cell are next to each other. */
    at += r && r % m->dim == 0 && node[r / m->dim] != node[r / m->dim - 1];
    row[r] = at * m->dim + r % m->dim;
  }
  for (PetscInt k = 0; k < size * size; k++) sum[k] = 0;
  for (PetscInt k = 0; k < n * n; k++) sum[row[k / n] * size + row[k % n]] += Ke[k];
  for (PetscInt k = 0; k < size * size; k++) Ke[k] = sum[k];
}

/* From the body's matrix: adds the springs (counted: those that this process counts), eliminates unknowns. The order
   matters: springs refer to all nv places of the cell, ties and supports to its distinct nodes. */
static void OfUnknowns(HycoFE fe, PetscInt cell, PetscBool counted, PetscReal Ke[])
{
  HycoSpringsAddStiffness(fe, cell, counted, Ke);
  SumRepeated(fe->mesh, cell, Ke);
  HycoTiedStiffness(fe, cell, Ke);
  HycoObliqueStiffness(fe, cell, Ke);
}

/* The element matrix of the cell's generalised unknowns (T^T K T); fixed unknowns are not yet removed. */
PetscErrorCode HycoFEElementStiffness(HycoFE fe, PetscInt cell, PetscReal Ke[])
{
  PetscFunctionBegin;
  PetscCall(HycoFEBodyStiffness(fe, cell, Ke));
  OfUnknowns(fe, cell, PETSC_FALSE, Ke);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Such that the sum over all ranks counts each cell and each spring once, for energies and products of the whole
   mesh. */
PetscErrorCode HycoFECountedStiffness(HycoFE fe, PetscInt cell, PetscReal Ke[])
{
  const PetscInt n = fe->mesh->nv * fe->dim;

  PetscFunctionBegin;
  if (HycoMeshOwned(fe->mesh, fe->mesh->cells[cell * fe->mesh->nv]) >= 0)
    PetscCall(HycoFEBodyStiffness(fe, cell, Ke));
  else
    PetscCall(PetscArrayzero(Ke, n * n));
  OfUnknowns(fe, cell, PETSC_TRUE, Ke);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Number in the distributed vectors. */
static PetscInt StiffnessGlobal(HycoMesh m, PetscInt node)
{
  return m->node_global ? m->node_global[node] : node;
}

/* Counts the distinct neighbours of each owned node, in this rank's columns and in the others. seen[] marks
   neighbours by the current node, in place of a sort. */
static PetscErrorCode CountNeighbours(HycoMesh m, PetscInt n_owned, PetscInt first, PetscInt on[], PetscInt off[])
{
  PetscInt *start, *around, *seen, node[HYCO_MAX_CELL_NODES];

  PetscFunctionBegin;
  PetscCall(HycoMeshNodeCells(m, &start, &around));
  PetscCall(PetscMalloc1(m->n_nodes, &seen));
  for (PetscInt i = 0; i < m->n_nodes; i++) seen[i] = -1;
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    const PetscInt row = StiffnessGlobal(m, i) - first;

    /* Rows of other ranks are counted there. */
    if (row < 0 || row >= n_owned) continue;
    on[row] = 1; /* the diagonal, also for a node without cells */
    seen[i] = i;
    for (PetscInt k = start[i]; k < start[i + 1]; k++) {
      const PetscInt n = HycoMeshCellNodes(m, around[k], node);

      for (PetscInt v = 0; v < n; v++) {
        const PetscInt j = node[v], col = StiffnessGlobal(m, j) - first;

        if (seen[j] == i) continue;
        seen[j] = i;
        if (col >= 0 && col < n_owned)
          on[row]++;
        else
          off[row]++;
      }
    }
  }
  HycoFreeAll(&seen, &start, &around);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An AIJ matrix with the pattern of node blocks and exact preallocation from the cells around owned nodes, which are
   all local: no communication of entries. n_owned nodes of this rank, the first of which is `first`. Collective. */
PetscErrorCode HycoFECreateMatrix(HycoFE fe, MPI_Comm comm, PetscInt n_owned, PetscInt first, Mat *A)
{
  PetscInt *on, *off;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(n_owned, &on, n_owned, &off));
  PetscCall(CountNeighbours(fe->mesh, n_owned, first, on, off));
  PetscCall(MatCreate(comm, A));
  PetscCall(MatSetSizes(*A, n_owned * fe->dim, n_owned * fe->dim, PETSC_DETERMINE, PETSC_DETERMINE));
  /* For preconditioners (rigid motions) and block preallocation; fixed unknowns keep their rows. */
  PetscCall(MatSetBlockSize(*A, fe->dim));
  PetscCall(MatSetType(*A, MATAIJ));
  PetscCall(MatXAIJSetPreallocation(*A, fe->dim, on, off, NULL, NULL));
  PetscCall(MatSetOption(*A, MAT_IGNORE_OFF_PROC_ENTRIES, PETSC_TRUE)); /* each rank has all cells of its rows */
  PetscCall(MatSetOption(*A, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatSetOption(*A, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
  PetscCall(PetscFree2(on, off));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds an element matrix, fixed unknowns reduced to their own diagonal. Negative indices are ignored by
   MatSetValues(): rows and columns of fixed unknowns. */
static PetscErrorCode AddElement(HycoFE fe, PetscInt cell, const PetscReal Ae[], Mat A)
{
  HycoMesh m = fe->mesh;
  PetscInt index[HYCO_MAX_CELL_UNKNOWNS], node[HYCO_MAX_CELL_NODES];
  const PetscInt n_nodes = HycoMeshCellNodes(m, cell, node), n = n_nodes * m->dim;

  PetscFunctionBegin;
  for (PetscInt v = 0; v < n_nodes; v++) {
    const PetscInt i = node[v];

    for (PetscInt c = 0; c < m->dim; c++) {
      const PetscInt row = StiffnessGlobal(m, i) * m->dim + c, k = v * m->dim + c;

      index[k] = row;
      if (fe->fixed[i * m->dim + c]) {
        PetscCall(MatSetValue(A, row, row, Ae[k * n + k], ADD_VALUES));
        /* Only after its diagonal is added. */
        index[k] = -1;
      }
    }
  }
  PetscCall(MatSetValues(A, n, index, n, index, Ae, ADD_VALUES));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Direct addition where the map exists (sequential, second assembly on); else MatSetValues(). */
static PetscErrorCode AddStiffness(HycoFE fe, Mat K)
{
  PetscReal *Ke;
  PetscBool done;

  PetscFunctionBegin;
  PetscCall(HycoAssemblyMapAssemble(fe, K, &done));
  if (done) PetscFunctionReturn(PETSC_SUCCESS);
  /* The pattern of the first assembly stays. */
  PetscCall(MatZeroEntries(K));
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++) {
    PetscCall(HycoFEElementRoom(fe, e, &Ke));
    PetscCall(HycoFEElementStiffness(fe, e, Ke));
    PetscCall(AddElement(fe, e, Ke, K));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The end of an assembly is collective: a rank with an error takes part in it, so that the others do not wait. K
   (N/m), of the current mu and tangents. Collective. */
PetscErrorCode HycoFEAssembleStiffness(HycoFE fe, Mat K)
{
  PetscFunctionBegin;
  HycoFinally(AddStiffness(fe, K), PetscCall(HycoMatAssemble(K)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the rank's cells to M of the norm ||u||^2 = integral of u^2 + length^2 |grad u|^2, in generalised unknowns. */
static PetscErrorCode AddH1(HycoFE fe, PetscReal length, Mat M)
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);
  const PetscInt dim = fe->dim, n = el->nv * dim;
  PetscReal *Me;

  PetscFunctionBegin;
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++) {
    PetscCall(HycoFEElementRoom(fe, e, &Me));
    PetscCall(PetscArrayzero(Me, n * n));
    for (PetscInt q = 0; q < el->nq; q++) {
      PetscReal g[HYCO_CELL_NODES][3], w;

      PetscCall(HycoGradients(fe, el, e, q, g, &w));
      for (PetscInt a = 0; a < el->nv; a++) {
        for (PetscInt b = 0; b < el->nv; b++) {
          const PetscReal plane = g[a][0] * g[b][0] + g[a][1] * g[b][1], third = g[a][2] * g[b][2];

          for (PetscInt c = 0; c < dim; c++) {
            /* The hoop term belongs to the radial component alone. */
            const PetscReal slopes = plane + (fe->formulation != HYCO_AXISYMMETRIC || c == 0 ? third : 0);

            Me[(a * dim + c) * n + b * dim + c] += w * (el->N[q][a] * el->N[q][b] + length * length * slopes);
          }
        }
      }
    }
    SumRepeated(fe->mesh, e, Me);
    HycoTiedStiffness(fe, e, Me);
    HycoObliqueStiffness(fe, e, Me);
    PetscCall(AddElement(fe, e, Me, M));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* M of that norm, for errors of fields. Collective, also where the cells of a rank fail. */
PetscErrorCode HycoFEAssembleH1(HycoFE fe, PetscReal length, Mat M)
{
  PetscFunctionBegin;
  PetscCall(MatSetOption(M, MAT_IGNORE_ZERO_ENTRIES, PETSC_TRUE)); /* the components are not coupled */
  PetscCall(MatZeroEntries(M));
  HycoFinally(AddH1(fe, length, M), PetscCall(HycoMatAssemble(M)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
