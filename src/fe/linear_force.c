/*
  Internal forces of the linear bodies as a matrix product, K u minus the forces of thermal strains: for repeated
  evaluations at one time, their integration points are not needed. K is stored in blocks of the nodes of linear cells.
*/
#include <hycoinelastic.h>
#include <hycokinematics.h>
#include <hycomaterialimpl.h>

struct _n_HycoLinearForce {
  HycoFE fe;                               /* borrowed */
  PetscInt n_cells, *cell;                 /* cells of linear bodies */
  PetscInt n_rows, *node, *start, *column; /* nodes whose rows are wanted; their neighbours in `column`, ascending */
  PetscInt *row;                           /* by node of fe's mesh: its index in `node`; -1: not wanted */
  PetscReal *K, *heat;                     /* dim x dim for each block, row major; dim for each row */
};

/* NULL-safe. */
PetscErrorCode HycoLinearForceDestroy(HycoLinearForce *force)
{
  HycoLinearForce f = *force;

  PetscFunctionBegin;
  if (!f) PetscFunctionReturn(PETSC_SUCCESS);
  HycoFreeAll(&f->cell, &f->node, &f->start, &f->column, &f->row, &f->K, &f->heat, force);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cells whose internal force is K u: they are summed by a product, not by their points. */
static PetscBool IsLinear(HycoFE fe, PetscInt cell)
{
  return fe->scene->body[fe->mesh->cell_body[cell]].law->linear;
}

/* The nodes of the linear cells around node i, ascending, in list; returns their number. Insertion keeps the list
   sorted; a node has at most some tens of neighbours. The columns of a row of blocks. */
static PetscInt LinearForceNeighbours(HycoFE fe, PetscInt n, const PetscInt around[], PetscInt list[])
{
  const PetscInt nv = fe->mesh->nv;
  PetscInt count = 0;

  for (PetscInt k = 0; k < n * nv; k++) {
    const PetscInt j = fe->mesh->cells[around[k / nv] * nv + k % nv];
    PetscInt at = count;

    if (!IsLinear(fe, around[k / nv])) continue;
    while (at > 0 && list[at - 1] > j) at--;
    if (at > 0 && list[at - 1] == j) continue;
    for (PetscInt p = count++; p > at; p--) list[p] = list[p - 1];
    list[at] = j;
  }
  return count;
}

/* Rows of the wanted nodes that have linear cells, in CSR by blocks of dim x dim. */
static PetscErrorCode ListRows(HycoLinearForce f, const PetscBool nodes[])
{
  HycoMesh m = f->fe->mesh;
  PetscInt *first, *around, most = 0, *list, room = 0;

  PetscFunctionBegin;
  PetscCall(HycoMeshNodeCells(m, &first, &around));
  for (PetscInt i = 0; i < m->n_nodes; i++) most = PetscMax(most, first[i + 1] - first[i]);
  PetscCall(PetscMalloc1(most * m->nv, &list));
  PetscCall(PetscMalloc1(m->n_nodes, &f->node));
  PetscCall(PetscMalloc1(m->n_nodes, &f->row));
  PetscCall(PetscMalloc1(m->n_nodes + 1, &f->start));
  f->start[0] = 0;
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    const PetscInt n =
        nodes && !nodes[i] ? 0 : LinearForceNeighbours(f->fe, first[i + 1] - first[i], around + first[i], list);
    const PetscInt at = f->start[f->n_rows];

    f->row[i] = -1;
    if (!n) continue;
    /* Grows by doubling: neighbours are not counted before. */
    if (at + n > room) {
      room = 2 * room + n + 1000;
      PetscCall(PetscRealloc((size_t)room * sizeof(PetscInt), &f->column));
    }
    PetscCall(PetscArraycpy(f->column + at, list, n));
    f->row[i] = f->n_rows;
    f->node[f->n_rows++] = i;
    f->start[f->n_rows] = at + n;
  }
  HycoFreeAll(&list, &first, &around);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For the rows of nodes[] (NULL: all nodes). Only linear bodies enter; others are integrated at each step. Internal
   forces of linear bodies as a product with a matrix: along a path it is the same at each step. */
PetscErrorCode HycoLinearForceCreate(HycoFE fe, const PetscBool nodes[], HycoLinearForce *force)
{
  HycoMesh m = fe->mesh;
  HycoLinearForce f;

  PetscFunctionBegin;
  PetscCall(PetscNew(force));
  f = *force;
  f->fe = fe;
  PetscCall(PetscMalloc1(m->n_cells, &f->cell));
  for (PetscInt e = 0; e < m->n_cells; e++) {
    PetscBool wanted = (PetscBool)!nodes;

    for (PetscInt a = 0; a < m->nv && !wanted; a++) wanted = nodes[m->cells[e * m->nv + a]];
    /* A cell enters if any of its nodes has a wanted row. */
    if (wanted && IsLinear(fe, e)) f->cell[f->n_cells++] = e;
  }
  PetscCall(ListRows(f, nodes));
  PetscCall(PetscMalloc1(f->start[f->n_rows] * fe->dim * fe->dim, &f->K));
  PetscCall(PetscMalloc1(f->n_rows * fe->dim, &f->heat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the element matrices to the blocks. Bodies alone, without springs and elimination: internal forces are those
   of all unknowns, as in HycoFEStep(). */
static PetscErrorCode SetStiffness(HycoLinearForce f)
{
  const PetscInt dim = f->fe->dim, nv = f->fe->mesh->nv, n = nv * dim;
  PetscReal Ke[HYCO_MAX_CELL_DOFS * HYCO_MAX_CELL_DOFS];

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(f->K, f->start[f->n_rows] * dim * dim));
  for (PetscInt k = 0; k < f->n_cells; k++) {
    const PetscInt *node = f->fe->mesh->cells + f->cell[k] * nv;

    PetscCall(HycoFEBodyStiffness(f->fe, f->cell[k], Ke));
    for (PetscInt a = 0; a < nv; a++) {
      const PetscInt row = f->row[node[a]];

      for (PetscInt b = 0; b < nv && row >= 0; b++) {
        PetscInt at = f->start[row];

        /* It is there: the column list has all nodes of all linear cells around the row's node. */
        while (f->column[at] != node[b]) at++;
        for (PetscInt c = 0; c < dim * dim; c++)
          f->K[at * dim * dim + c] += Ke[(a * dim + c / dim) * n + b * dim + c % dim];
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the forces of thermal strains. */
static PetscErrorCode SetHeat(HycoLinearForce f)
{
  HycoFE fe = f->fe;
  const PetscInt dim = fe->dim, nv = fe->mesh->nv;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(f->heat, f->n_rows * dim));
  for (PetscInt k = 0; k < f->n_cells; k++) {
    const PetscInt *node = fe->mesh->cells + f->cell[k] * nv;
    PetscReal push[HYCO_MAX_CELL_DOFS] = {0};

    if (!fe->scene->body[fe->mesh->cell_body[f->cell[k]]].expansion) continue;
    PetscCall(HycoCellHeat(fe, f->cell[k], push));
    for (PetscInt r = 0; r < nv * dim; r++) {
      /* Rows that nobody tests are not kept. */
      if (f->row[node[r / dim]] >= 0) f->heat[f->row[node[r / dim]] * dim + r % dim] += push[r];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* K: whether the stiffness changed since the last call; thermal forces follow the temperature of each time. */
PetscErrorCode HycoLinearForceSet(HycoLinearForce f, PetscBool K)
{
  PetscFunctionBegin;
  if (K) PetscCall(SetStiffness(f));
  PetscCall(SetHeat(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* f_int[n_dof] += K u - thermal forces, at the wanted rows. */
void HycoLinearForceAdd(HycoLinearForce f, const PetscReal u[], PetscReal f_int[])
{
  const PetscInt dim = f->fe->dim;

  for (PetscInt k = 0; k < f->n_rows; k++) {
    PetscReal sum[3] = {0, 0, 0};

    for (PetscInt j = f->start[k]; j < f->start[k + 1]; j++) {
      const PetscReal *block = f->K + j * dim * dim, *own = u + f->column[j] * dim;

      for (PetscInt c = 0; c < dim; c++) {
        /* Blocks by node: one index for dim^2 numbers. */
        for (PetscInt d = 0; d < dim; d++) sum[c] += block[c * dim + d] * own[d];
      }
    }
    for (PetscInt c = 0; c < dim; c++) f_int[f->node[k] * dim + c] += sum[c] - f->heat[k * dim + c];
  }
}
