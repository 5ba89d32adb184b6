/*
  Mirrored bodies: a map with a negative Jacobian reverses the orientation of a body's cells and facets. Facets are
  oriented as in the mesh file, so that the normals of such a body change sign; volumes use |det J| and are not
  affected.
*/
#include <hycokinematics.h>

/* The sign of a cell's volume with its nodes at X: the sum over its quadrature points. */
static PetscInt MirrorSign(HycoMesh m, const HycoElement *el, PetscInt cell, const PetscReal X[])
{
  PetscReal volume = 0;

  /* In a simplex det J is constant: one point. */
  for (PetscInt q = 0; q < (el->nv == el->dim + 1 ? 1 : el->nq); q++)
    volume += HycoDeterminant(el, m->cells + cell * m->nv, X, q);
  return (volume > 0) - (volume < 0);
}

/* Signs of the cells as drawn, with which those of the moved cells are compared. A map may mirror a body: normals of
   its facets must then be turned. */
PetscErrorCode HycoMirrorCreate(HycoFE fe)
{
  const HycoElement *el = HycoElementGet(fe->mesh->type);

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(fe->scene->n_bodies, &fe->mirrored));
  PetscCall(PetscMalloc1(fe->mesh->n_cells, &fe->drawn_sign));
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++)
    fe->drawn_sign[e] = (signed char)MirrorSign(fe->mesh, el, e, fe->mesh->xyz);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For a body without cells in this mesh (a model's contact surface outside its RID): det dX/dx by central
   differences, summed over some of its nodes. */
static PetscErrorCode MapTurns(HycoFE fe, PetscInt body, PetscBool *turns)
{
  HycoMesh m = fe->mesh;
  /* The sign alone is wanted: an error of the difference does not matter. */
  const PetscReal step = 1e-5 * HycoMeshLength(m);
  PetscReal sum = 0;
  PetscInt n = 0;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < m->n_nodes && n < 16; i++) {
    PetscReal J[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

    if (m->node_body[i] != body) continue;
    n++;
    for (PetscInt c = 0; c < m->dim; c++) {
      for (PetscInt d = 0; d < m->dim && fe->scene->body[body].map[c]; d++) {
        PetscReal x[3], side[2];

        for (PetscInt s = 0; s < 2; s++) {
          PetscCall(PetscArraycpy(x, m->xyz + 3 * i, 3));
          x[d] += s ? step : -step;
          PetscCall(HycoExprEval(fe->scene->body[body].map[c], fe->mu, 1, x, &side[s]));
        }
        J[c][d] = (side[1] - side[0]) / (2 * step);
      }
    }
    sum += J[0][0] * (J[1][1] * J[2][2] - J[1][2] * J[2][1]) - J[0][1] * (J[1][0] * J[2][2] - J[1][2] * J[2][0]) +
           J[0][2] * (J[1][0] * J[2][1] - J[1][1] * J[2][0]);
  }
  *turns = (PetscBool)(sum < 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The sign from the cells of bodies with a map: turn[b] = +-1, or 0 without a cell; fails if they differ. */
static PetscErrorCode CellsTurn(HycoFE fe, PetscInt turn[], PetscInt first[])
{
  HycoMesh m = fe->mesh;
  const HycoElement *el = HycoElementGet(m->type);

  PetscFunctionBegin;
  for (PetscInt e = 0; e < m->n_cells; e++) {
    const PetscInt b = m->cell_body[e];
    HycoExpr *map = fe->scene->body[b].map;
    PetscInt sign;

    if (fe->moved_at[b] != fe->place) continue;
    /* The sign relative to the drawing: files may number cells in either orientation. */
    sign = map[0] || map[1] || map[2] ? fe->drawn_sign[e] * MirrorSign(m, el, e, fe->X) : 1;

    HycoCheck(sign, "cell %d is degenerate: its volume vanishes", (int)m->cell_id[e]);
    if (!turn[b]) first[b] = e;
    if (!turn[b]) turn[b] = sign;
    HycoCheck(sign == turn[b],
              "body %s: its map inverts cell %d and not cell %d; a map may mirror a whole body, but not fold it",
              fe->scene->body[b].name, (int)m->cell_id[sign < 0 ? e : first[b]],
              (int)m->cell_id[sign < 0 ? first[b] : e]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bodies that share nodes must have the same sign, because a facet may have nodes of both. Otherwise the outward side
   of such a facet would be undefined. */
static PetscErrorCode CheckPieces(HycoFE fe)
{
  HycoMesh m = fe->mesh;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < m->n_cells * m->nv; k++) {
    const PetscInt a = m->cell_body[k / m->nv], b = m->node_body[m->cells[k]];

    HycoCheck(
        fe->mirrored[a] == fe->mirrored[b],
        "the bodies %s and %s share node %d, and the map of one of them is a mirror image; mirror both or neither",
        fe->scene->body[a].name, fe->scene->body[b].name, (int)m->node_id[m->cells[k]]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Which bodies the map of the current mu mirrors. Called after nodes moved; an error names a cell of each sign. Not
   collective: bodies without cells here are decided by their maps. */
PetscErrorCode HycoMirrorFind(HycoFE fe)
{
  PetscInt *turn;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(2 * fe->scene->n_bodies, &turn));
  ierr = CellsTurn(fe, turn, turn + fe->scene->n_bodies);
  for (PetscInt b = 0; b < fe->scene->n_bodies && !ierr; b++) {
    HycoExpr *map = fe->scene->body[b].map;

    /* A body that has not moved keeps its sign. */
    if (fe->moved_at[b] != fe->place) continue;
    /* turn = 0: no cell here. */
    fe->mirrored[b] = (PetscBool)(turn[b] < 0);
    if (!turn[b] && (map[0] || map[1] || map[2])) ierr = MapTurns(fe, b, &fe->mirrored[b]);
  }
  PetscCall(PetscFree(turn));
  PetscCall(ierr);
  if (fe->joint) PetscCall(CheckPieces(fe));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A body's cells may all be mirrored on one rank and none on another, which no rank alone sees. Collective. */
PetscErrorCode HycoFEAgreeOnMirrors(MPI_Comm comm, HycoFE fe)
{
  const PetscInt n = fe->scene->n_bodies;
  PetscBool *seen; /* by body: has cells with the original orientation, with the reversed one */

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(2 * n, &seen));
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++)
    seen[2 * fe->mesh->cell_body[e] + fe->mirrored[fe->mesh->cell_body[e]]] = PETSC_TRUE;
  HycoAllreduce(seen, 2 * n, HYCO_MPI_BOOL, MPI_LOR, comm);
  for (PetscInt b = 0; b < n; b++) {
    HycoCheck(!seen[2 * b] || !seen[2 * b + 1],
              "body %s: its map inverts some cells and not others; a map may mirror a whole body, but not fold it",
              fe->scene->body[b].name);
    /* Also on ranks without a cell of the body, which may have its facets. */
    fe->mirrored[b] = seen[2 * b + 1];
  }
  PetscCall(PetscFree(seen));
  PetscFunctionReturn(PETSC_SUCCESS);
}
