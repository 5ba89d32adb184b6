/*
  The cells in which a model of bodies has displacements, and so stresses, without modes: a row of H, a and g for each
  unknown. First those that the scene's outputs need, output by output, then those with the largest stresses at the
  sampled contact problems, as many as there is room for.
*/
#include <hycobodiestraining.h>
#include <hycofields.h>
#include <hycomaterialimpl.h>
#include <hycoquantities.h>

#define MOST_INNER   2400 /* unknowns: a row and a solve each */
#define MOST_NUMBERS 6e6  /* of their rows in the file */
/* Score of a cell as a share of the highest, down to which cells get rows of their own: cells with the largest stress
   have more. */
#define LEAST_SCORE 0.1

/* A cell's score is the largest share of its body's stress over all samples: the cells of large stress are those whose
   outputs matter, and get exact displacements first. */
PetscErrorCode HycoBodiesAddScores(HycoReducer t, HycoBodiesFactor *factor, const PetscReal u[])
{
  HycoFE fe = factor->fom->fe;
  HycoMesh m = fe->mesh;
  const HycoBodyParts *parts = &HycoTrainingOfBodies(t)->parts;
  PetscReal *all, *sigma, *mises, *most;

  PetscFunctionBegin;
  PetscCall(PetscMalloc4(fe->n_dof, &all, m->n_cells * fe->n_sigma, &sigma, m->n_cells, &mises, parts->n, &most));
  for (PetscInt i = 0; i < fe->n_dof; i++) {
    /* u lacks the prescribed displacements, without which stresses at supports would be those of a torn mesh. */
    all[i] = fe->fixed[i] ? fe->u0[i] : u[i];
    factor->moved[i] = PetscMax(factor->moved[i], PetscAbsReal(u[i]));
  }
  HycoFEComplete(fe, all);
  HycoOnEach(HycoComm(t), HycoFEStress(fe, all, sigma));
  for (PetscInt e = 0; e < m->n_cells; e++) mises[e] = HycoMises(fe->dim, sigma + e * fe->n_sigma);
  PetscCall(PetscArrayzero(most, parts->n));
  for (PetscInt e = 0; e < m->n_cells; e++) {
    PetscReal *own = &most[parts->of[m->cells[e * m->nv]]];

    for (PetscInt k = 0; k < m->nv * fe->dim; k++) { /* of other prescribed displacements at other points */
      const PetscInt i = m->cells[e * m->nv + k / fe->dim] * fe->dim + k % fe->dim;

      if (fe->fixed[i] && fe->u0[i] != 0) mises[e] = 0;
    }
    *own = PetscMax(*own, mises[e]);
  }
  HycoAllreduce(most, parts->n, MPIU_REAL, MPI_MAX, HycoComm(t));
  for (PetscInt e = 0; e < m->n_cells; e++) {
    const PetscReal own = most[parts->of[m->cells[e * m->nv]]];

    /* Relative to the body's largest: a stiff body would otherwise take all the room. */
    if (own > 0) factor->score[e] = PetscMax(factor->score[e], mises[e] / own);
  }
  PetscCall(PetscFree4(all, sigma, mises, most));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* inner[n_dof]: the free unknowns of the cells in[] that are not on the surfaces; *fits: there is room for their rows.
   Collective. */
static PetscErrorCode MarkInner(HycoReducer t, HycoBodiesFactor *factor, const PetscBool in[], PetscBool inner[],
                                PetscBool *fits)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  HycoFE fe = factor->fom->fe;
  HycoMesh m = fe->mesh;
  PetscReal *n, rows = 0, numbers = 0;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(b->n, &n));
  PetscCall(PetscArrayzero(inner, fe->n_dof));
  for (PetscInt k = 0; k < m->n_cells * m->nv * fe->dim; k++) {
    const PetscInt i = m->cells[k / fe->dim] * fe->dim + k % fe->dim;

    /* Unknowns of the surfaces have displacements of their own, fixed ones are prescribed. */
    if (!in[k / (m->nv * fe->dim)] || inner[i] || fe->fixed[i] || factor->known[i]) continue;
    inner[i] = PETSC_TRUE;
    /* Marked in all parts, counted by the owner alone. */
    if (HycoMeshOwned(m, i / fe->dim) >= 0) n[HycoTrainingOfBodies(t)->parts.of[i / fe->dim]]++;
  }
  HycoAllreduce(n, b->n, MPIU_REAL, MPI_SUM, HycoComm(t));
  for (PetscInt k = 0; k < b->n; k++) {
    rows += n[k];
    /* As many cells as with the usual samples: more of them shall not cost stresses. */
    numbers += n[k] * b->body[k].n * PetscMin(b->body[k].n_samples, HYCO_BODIES_SAMPLES);
  }
  *fits = (PetscBool)(rows <= MOST_INNER && numbers <= MOST_NUMBERS);
  PetscCall(PetscFree(n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Joins more[] to in[], if there is room. Collective. in[] stays as it is if the unknowns inside would exceed their
   number. */
static PetscErrorCode BodyCellsJoin(HycoReducer t, HycoBodiesFactor *factor, PetscBool in[], PetscBool more[],
                                    PetscBool inner[], PetscBool *fits)
{
  const PetscInt n = factor->fom->part->n_cells;

  PetscFunctionBegin;
  for (PetscInt e = 0; e < n; e++) more[e] = (PetscBool)(more[e] || in[e]);
  PetscCall(MarkInner(t, factor, more, inner, fits));
  if (*fits) PetscCall(PetscArraycpy(in, more, n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The cells of this rank's part. Collective. Outputs are in their order in the scene: one that does not fit is
   left out, the next may fit. Stress levels stop at the first that does not, since the lower ones contain it. */
static PetscErrorCode BodyCellsChoose(HycoReducer t, HycoBodiesFactor *factor, PetscBool in[], PetscBool inner[])
{
  HycoMesh m = factor->fom->part;
  PetscBool *more, fits = PETSC_TRUE;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_cells + 1, &more));
  for (PetscInt k = 0; k < t->scene->n_quantities; k++) {
    HycoOnEach(HycoComm(t), HycoQuantityMarkCells(t->scene, m, k, more));
    PetscCall(BodyCellsJoin(t, factor, in, more, inner, &fits));
  }
  fits = PETSC_TRUE;
  /* By levels and not cell by cell: the same choice on any number of ranks. */
  for (PetscReal least = 0.9; fits && least > LEAST_SCORE; least -= 0.1) {
    for (PetscInt e = 0; e < m->n_cells; e++) more[e] = (PetscBool)(factor->score[e] > least);
    PetscCall(BodyCellsJoin(t, factor, in, more, inner, &fits));
  }
  PetscCall(PetscFree(more));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* t->seeds_cell: the cells of all ranks, ascending, at least one; in[]: those of this rank's part. Collective. */
static PetscErrorCode ShareCells(HycoReducer t, HycoMesh m, PetscBool in[])
{
  PetscInt *own, n = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_cells + 1, &own));
  for (PetscInt e = 0; e < m->n_cells; e++) {
    if (in[e]) own[n++] = m->cell_whole ? m->cell_whole[e] : e;
  }
  PetscCall(PetscFree(t->seeds_cell));
  PetscCall(HycoConcatenateAll(HycoComm(t), n, own, MPIU_INT, sizeof(PetscInt), &t->n_seeds_cell, &t->seeds_cell));
  /* A mesh needs a cell. HycoConcatenateAll() allocates one entry more. */
  if (!t->n_seeds_cell) t->seeds_cell[t->n_seeds_cell++] = 0;
  PetscCall(PetscSortRemoveDupsInt(&t->n_seeds_cell, t->seeds_cell));
  for (PetscInt e = 0; e < m->n_cells; e++) {
    PetscInt at;

    PetscCall(PetscFindInt(m->cell_whole ? m->cell_whole[e] : e, t->n_seeds_cell, t->seeds_cell, &at));
    in[e] = (PetscBool)(at >= 0);
  }
  PetscCall(PetscFree(own));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* b->inner by body, and factor->row, from the marked unknowns. Collective. Ascending by number in the whole mesh
   within each body, whatever the partition: the order is that of the file. */
static PetscErrorCode BodyCellsList(HycoReducer t, HycoBodiesFactor *factor, const PetscBool inner[])
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  HycoMesh m = factor->fom->part;
  PetscInt *own, *all, *dof, *at, n = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(3 * m->n_owned * b->dim + 1, &own));
  for (PetscInt i = 0; i < m->n_nodes * b->dim; i++) {
    const PetscInt node = i / b->dim, place = HycoMeshOwned(m, node);

    if (!inner[i] || place < 0) continue;
    own[n++] = (m->node_whole ? m->node_whole[node] : node) * b->dim + i % b->dim;
    own[n++] = HycoTrainingOfBodies(t)->parts.of[node];
    /* Three numbers for each: in the whole mesh, body, in the distributed vectors. */
    own[n++] = (m->first + place) * b->dim + i % b->dim;
  }
  PetscCall(HycoConcatenateAll(HycoComm(t), n, own, MPIU_INT, sizeof(PetscInt), &n, &all));
  n /= 3;
  HycoFreeAll(&b->inner_start, &b->inner, &factor->row);
  PetscCall(PetscMalloc2(n + 1, &dof, n + 1, &at));
  PetscCall(PetscMalloc1(n + 1, &b->inner));
  PetscCall(PetscMalloc1(n + 1, &factor->row));
  PetscCall(PetscCalloc1(b->n + 1, &b->inner_start));
  for (PetscInt k = 0; k < n; k++) {
    dof[k] = all[3 * k];
    at[k] = k;
  }
  PetscCall(PetscSortIntWithArray(n, dof, at));
  b->ni = 0;
  for (PetscInt k = 0; k < b->n; k++) {
    for (PetscInt i = 0; i < n; i++) {
      if (all[3 * at[i] + 1] != k) continue;
      b->inner[b->ni] = dof[i];
      factor->row[b->ni++] = all[3 * at[i] + 2];
    }
    b->inner_start[k + 1] = b->ni;
    b->body[k].m = b->inner_start[k + 1] - b->inner_start[k];
  }
  PetscCall(PetscFree2(dof, at));
  HycoFreeAll(&own, &all);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* known[]: the unknowns of the surfaces in this rank's part; bare[]: those that the model's mesh has with its contacts.
   The others, of masters that no slave meets, have modes outside the chosen cells. */
static PetscErrorCode MarkSurfaces(HycoReducer t, HycoBodiesFactor *factor)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  HycoMesh m = factor->fom->part;
  PetscInt *sorted, *place;

  PetscFunctionBegin;
  HycoDuplicate(b->ns + 1, b->dof, &sorted);
  PetscCall(PetscMalloc1(b->ns + 1, &place));
  /* Sorted by number, so that each unknown of the part is found by bisection. */
  for (PetscInt k = 0; k < b->ns; k++) place[k] = k;
  PetscCall(PetscSortIntWithArray(b->ns, sorted, place));
  for (PetscInt i = 0; i < m->n_nodes * b->dim; i++) {
    /* Unknowns are known by their number in the whole mesh, which does not depend on the partition. */
    const PetscInt node = m->node_whole ? m->node_whole[i / b->dim] : i / b->dim;
    PetscInt at;

    PetscCall(PetscFindInt(node * b->dim + i % b->dim, b->ns, sorted, &at));
    factor->known[i] = (PetscBool)(at >= 0);
    factor->bare[i] = (PetscBool)(at >= 0 && factor->in_mesh[place[at]]);
  }
  HycoFreeAll(&place, &sorted);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* bare[]: also the unknowns of the surfaces in the cells in[], which the model's mesh has. A surface node in a
   chosen cell is in the model's mesh through that cell, whether or not a slave meets it. */
static void MarkBare(HycoBodiesFactor *factor, const PetscBool in[])
{
  HycoMesh m = factor->fom->part;
  const PetscInt dim = factor->fom->fe->dim, n = m->nv * dim;

  for (PetscInt k = 0; k < m->n_cells * n; k++) {
    const PetscInt i = m->cells[k / dim] * dim + k % dim;

    if (in[k / n] && factor->known[i]) factor->bare[i] = PETSC_TRUE;
  }
}

/* Leaves a node to the modes, of which a model has one at least: that which moves most. It is exact too, because its
   modes are all of its displacements. *released: there is one. Collective. Otherwise a small mesh could have all nodes
   exact, and a model without any mode is none. */
static PetscErrorCode BodyCellsRelease(HycoReducer t, HycoBodiesFactor *factor, PetscBool inner[], PetscBool *released)
{
  HycoMesh m = factor->fom->part;
  const PetscInt dim = factor->fom->fe->dim;
  PetscReal most = 0;
  PetscInt node = PETSC_MAX_INT;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < m->n_nodes * dim; i++) most = PetscMax(most, inner[i] ? factor->moved[i] : 0);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPIU_REAL, MPI_MAX, HycoComm(t)));
  for (PetscInt i = 0; i < m->n_nodes * dim && most > 0; i++) {
    if (inner[i] && factor->moved[i] >= most * (1 - 1e-6))
      /* Ties within 1e-6 go to the smallest number: displacements on other numbers of ranks differ by round-off. */
      node = PetscMin(node, m->node_whole ? m->node_whole[i / dim] : i / dim);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &node, 1, MPIU_INT, MPI_MIN, HycoComm(t)));
  for (PetscInt i = 0; i < m->n_nodes * dim; i++)
    inner[i] = (PetscBool)(inner[i] && (m->node_whole ? m->node_whole[i / dim] : i / dim) != node);
  *released = (PetscBool)(node < PETSC_MAX_INT);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* MarkInner() runs again after ShareCells(): cells of other ranks may share nodes with this part. `released`
   false: nothing moves, and the surfaces' unknowns get modes instead. */
PetscErrorCode HycoBodiesChooseCells(HycoReducer t, HycoBodiesFactor *factor)
{
  HycoFE fe = factor->fom->fe;
  PetscBool *in, *inner, fits, left, released = PETSC_TRUE;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(factor->fom->part->n_cells + 1, &in));
  PetscCall(PetscMalloc1(fe->n_dof + 1, &inner));
  /* Known unknowns first: the cells are chosen among those that still need something. */
  PetscCall(MarkSurfaces(t, factor));
  PetscCall(BodyCellsChoose(t, factor, in, inner));
  PetscCall(ShareCells(t, factor->fom->part, in));
  PetscCall(MarkInner(t, factor, in, inner, &fits));
  MarkBare(factor, in);
  /* Whether an unknown is left to the modes. Collective. */
  left = PETSC_FALSE;
  for (PetscInt i = 0; i < fe->n_dof; i++) left = (PetscBool)(left || !(fe->fixed[i] || factor->bare[i] || inner[i]));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &left, 1, HYCO_MPI_BOOL, MPI_LOR, HycoComm(t)));
  if (!fits) PetscCall(PetscArrayzero(inner, fe->n_dof)); /* of the cell that stands for none */
  /* If something is left outside the cells, modes are needed anyway, and surfaces keep theirs. */
  if (fits && !left) PetscCall(BodyCellsRelease(t, factor, inner, &released));
  if (!released) PetscCall(PetscArrayzero(factor->known, fe->n_dof));
  if (!released) PetscCall(PetscArrayzero(factor->bare, fe->n_dof));
  /* In ascending numbers on every rank: the rows of H are in this order. */
  PetscCall(BodyCellsList(t, factor, inner));
  for (PetscInt i = 0; i < fe->n_dof; i++) factor->bare[i] = (PetscBool)(factor->bare[i] || inner[i]);
  HycoFreeAll(&inner, &in);
  PetscFunctionReturn(PETSC_SUCCESS);
}
