/* B and D: the rows of the potential contacts at the current parameters. */
#include "surface_normals.h"
#include <hycokinematics.h>
#include <hycovector.h>

#define SMOOTH 30 /* degrees between normals of one surface, at most */

/* The row B T of a node's unknowns for a normal. A force lambda n at the node has these components on the unknowns
   that remain after oblique supports. */
static void OfUnknowns(HycoFE fe, PetscInt node, const PetscReal normal[3], PetscReal along[3])
{
  for (PetscInt c = 0; c < 3; c++) along[c] = normal[c];
  for (PetscInt c = 0; c < fe->dim; c++) {
    const HycoOblique *oblique = HycoFEOblique(fe, node * fe->dim + c);

    for (PetscInt d = 0; oblique && d < fe->dim; d++) along[d] += oblique->a[d] * normal[c];
  }
}

/* Adds `scale` times the normal at a node to a row: entries for its free unknowns, a change of the gap for its fixed
   ones. */
static void AddToRow(HycoFE fe, PetscInt node, PetscReal scale, const PetscReal normal[3], PetscInt *n, PetscInt dof[],
                     PetscReal value[], PetscReal *gap)
{
  PetscReal along[3];

  OfUnknowns(fe, node, normal, along);
  for (PetscInt c = 0; c < fe->dim; c++) {
    const PetscReal entry = scale * along[c];
    const PetscInt i = node * fe->dim + c;

    if (fe->fixed[i]) {
      *gap -= entry * fe->u0[i];
    } else if (PetscAbsReal(entry) > 1e-14) {
      /* Normals have unit length: smaller components are round-off of their computation, and would widen rows and
         patterns. */
      dof[*n] = i;
      value[(*n)++] = entry;
    }
  }
}

/* Row r, of contact k along a direction: slave with the direction, masters with minus the weight times it; fixed
   unknowns move to D. */
static void AddRow(HycoFE fe, const HycoPairs *pairs, PetscInt k, const PetscReal along[3], PetscInt r, HycoRows *rows)
{
  PetscInt n = rows->start[r];

  if (!HycoPairsAlone(fe->scene, pairs, k))
    AddToRow(fe, pairs->slave[k], 1, along, &n, rows->dof, rows->value, &rows->gap[r]);
  for (PetscInt j = pairs->master_start[k]; j < pairs->master_start[k + 1]; j++)
    AddToRow(fe, pairs->master[j], -pairs->weight[j], along, &n, rows->dof, rows->value, &rows->gap[r]);
  rows->start[r + 1] = n;
}

/* Contacts with the same slave node must have different normals: the share of each in the force would not be unique
   with parallel ones. before: the previous contact with k's slave, -1: none. */
static PetscErrorCode CheckCorner(HycoFE fe, const HycoPairs *pairs, PetscInt k, const PetscInt before[],
                                  const PetscReal normal[])
{
  const PetscInt slave = pairs->slave[k];
  PetscReal base[3][3], rest[3] = {0, 0, 0}, size = 0;
  PetscInt n = 0;

  PetscFunctionBegin;
  /* Three directions fill the space: CheckSlaves() in find_contacts.c has refused more contacts than free
     displacements. */
  for (PetscInt j = k; j >= 0 && n < 3; j = before[j], n++) { /* k's own last: Gram-Schmidt in reverse order */
    OfUnknowns(fe, slave, normal + 3 * j, base[n]);
    for (PetscInt c = 0; c < 3; c++) base[n][c] = c < fe->dim && !fe->fixed[slave * fe->dim + c] ? base[n][c] : 0;
  }
  for (PetscInt a = n - 1; a >= 0; a--) {
    PetscCall(PetscArraycpy(rest, base[a], 3));
    size = HycoLength(rest);
    for (PetscInt b = a + 1; b < n; b++) {
      const PetscReal along = HycoDot(base[a], base[b]);

      for (PetscInt c = 0; c < 3; c++) rest[c] -= along * base[b][c];
    }
    PetscCall(PetscArraycpy(base[a], rest, 3));
    HycoNormalise(base[a]);
  }
  HycoCheck(!size || HycoLength(rest) > 1e-3 * size,
            "node %d is a slave of the contacts %s and %s, whose normals there are parallel, so that the forces would "
            "not be unique; remove it from one contact",
            (int)fe->mesh->node_id[slave], fe->scene->contact[pairs->contact[before[k]]]->name,
            fe->scene->contact[pairs->contact[k]]->name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether contacts k and j of one slave are parts of one smooth surface: normals averaged over each part differ there
   by the angle between facets, and the rows, although independent, would leave the force to either contact. Normals
   that the scene gives for both are taken as they are. */
static PetscBool AreSmooth(HycoFE fe, const HycoPairs *pairs, PetscInt k, PetscInt j, const PetscReal normal[])
{
  const HycoContact *of = fe->scene->contact;

  return (PetscBool)((HycoContactAverages(of[pairs->contact[k]]) || HycoContactAverages(of[pairs->contact[j]])) &&
                     HycoDot(normal + 3 * k, normal + 3 * j) > PetscCosReal(SMOOTH * PETSC_PI / 180));
}

/* Names the first two contacts that share nodes of a smooth surface, and counts these. */
static PetscErrorCode CheckSmooth(HycoFE fe, const HycoPairs *pairs, const PetscInt before[], const PetscReal normal[])
{
  PetscInt a = -1, b = -1, n = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < pairs->n; k++) {
    for (PetscInt j = before[k]; j >= 0; j = before[j]) {
      if (pairs->contact[j] == pairs->contact[k] || !AreSmooth(fe, pairs, k, j, normal)) continue;
      /* The first pair of contacts is named, and only its nodes are counted. */
      a = n ? a : pairs->contact[j];
      b = n ? b : pairs->contact[k];
      n += pairs->contact[j] == a && pairs->contact[k] == b;
    }
  }
  HycoCheck(
      !n,
      "%d node%s of the contacts %s and %s, whose normals there differ by less than %d degrees, so that one of the "
      "two would carry the whole force; make one contact of both surfaces (outputs may name a group of it), or, where "
      "the surface has a corner, give both contacts a normal",
      (int)n, n == 1 ? " is a slave" : "s are slaves", fe->scene->contact[a]->name, fe->scene->contact[b]->name,
      SMOOTH);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Contacts with the same slave are chained from the last to the first. The chain allows any number of contacts at a
   node, and no search for them. */
static PetscErrorCode CheckCorners(HycoFE fe, const HycoPairs *pairs, const PetscReal normal[])
{
  PetscInt *last, *before;
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(fe->mesh->n_nodes, &last, pairs->n, &before));
  for (PetscInt i = 0; i < fe->mesh->n_nodes; i++) last[i] = -1;
  for (PetscInt k = 0; k < pairs->n; k++) {
    before[k] = -1;
    /* A slave without a master at these positions has no normal to compare. */
    if (HycoPairsAlone(fe->scene, pairs, k)) continue;
    before[k] = last[pairs->slave[k]];
    last[pairs->slave[k]] = k;
  }
  ierr = CheckSmooth(fe, pairs, before, normal);
  for (PetscInt k = 0; k < pairs->n && !ierr; k++) {
    /* The sides of one contact, which differ by more than 40 degrees, may act on the same free unknown. */
    if (before[k] >= 0 && pairs->contact[before[k]] != pairs->contact[k])
      ierr = CheckCorner(fe, pairs, k, before, normal);
  }
  PetscCall(PetscFree2(last, before));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoRowsDestroy(HycoRows *rows)
{
  PetscFunctionBegin;
  HycoFreeAll(&rows->start, &rows->dof, &rows->value, &rows->gap);
  rows->n = rows->room = 0;
  rows->filled = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Room for n rows, up to `each` for a contact, with the masters of now: after the search of masters alone they are
   known. One more than needed: arrays of no rows are not NULL. It only grows, since positions repeat along a study. */
static PetscErrorCode ContactRowReserve(HycoFE fe, const HycoPairs *pairs, PetscInt n, PetscInt each, HycoRows *rows)
{
  const PetscInt entries = (pairs->n + pairs->master_start[pairs->n]) * fe->dim * each + 1;

  PetscFunctionBegin;
  if (n != rows->n || !rows->start) {
    PetscCall(PetscRealloc((size_t)(n + 1) * sizeof(*rows->start), &rows->start));
    PetscCall(PetscRealloc((size_t)(n + 1) * sizeof(*rows->gap), &rows->gap));
    rows->n = n;
  }
  if (entries > rows->room) {
    PetscCall(PetscRealloc((size_t)entries * sizeof(*rows->dof), &rows->dof));
    PetscCall(PetscRealloc((size_t)entries * sizeof(*rows->value), &rows->value));
    rows->room = entries;
  }
  rows->start[0] = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The row of contact k's normal. An empty one has no unknown: its gap is a statement about prescribed displacements. */
static PetscErrorCode AddNormal(HycoFE fe, const HycoPairs *pairs, PetscInt k, const PetscReal normal[3],
                                PetscReal drawn, PetscInt r, HycoRows *rows)
{
  PetscFunctionBegin;
  rows->gap[r] = drawn;
  AddRow(fe, pairs, k, normal, r, rows);
  if (rows->start[r + 1] == rows->start[r] && !HycoPairsAlone(fe->scene, pairs, k))
    PetscCall(HycoContactCheckStill(fe, pairs, k, drawn, &rows->gap[r]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Not collective. */
PetscErrorCode HycoContactRows(HycoFE fe, HycoPairs *pairs, HycoRows *rows)
{
  PetscReal *normal, *drawn;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(3 * pairs->n, &normal, pairs->n, &drawn));
  ierr = HycoContactGeometry(fe, pairs, normal, drawn);
  /* With the normals of these parameters: they turn with the bodies. */
  if (!ierr) ierr = CheckCorners(fe, pairs, normal);
  if (!ierr) ierr = ContactRowReserve(fe, pairs, pairs->n, 1, rows);
  for (PetscInt k = 0; k < pairs->n && !ierr; k++) ierr = AddNormal(fe, pairs, k, normal + 3 * k, drawn[k], k, rows);
  PetscCall(PetscFree2(normal, drawn));
  PetscCall(ierr);
  rows->filled = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Unit vectors orthogonal to the normal: one in 2D; two in 3D, the first orthogonal to the axis that is farthest from
   the normal. */
static void ContactRowTangents(PetscInt dim, const PetscReal n[3], PetscReal t[6])
{
  PetscReal axis[3] = {0, 0, 0};
  PetscInt least = 0;

  for (PetscInt c = 0; c < 6; c++) t[c] = 0;
  if (dim == 2) {
    t[0] = -n[1];
    t[1] = n[0];
    return;
  }
  /* With a margin: two components that are equal but for round-off must give the same axis on all ranks and at all
     steps. */
  for (PetscInt c = 1; c < 3; c++) least = PetscAbsReal(n[c]) < PetscAbsReal(n[least]) - 1e-6 ? c : least;
  axis[least] = 1;
  for (PetscInt c = 0; c < 3; c++) t[c] = axis[(c + 1) % 3] * n[(c + 2) % 3] - axis[(c + 2) % 3] * n[(c + 1) % 3];
  HycoNormalise(t);
  for (PetscInt c = 0; c < 3; c++) t[3 + c] = n[(c + 1) % 3] * t[(c + 2) % 3] - n[(c + 2) % 3] * t[(c + 1) % 3];
}

/* The first row of a contact is that of HycoContactRows(), which has refused parallel normals at one slave before.
   The gap of a tangent is the displacement along it in u. */
PetscErrorCode HycoContactTangentRows(HycoFE fe, HycoPairs *pairs, const PetscInt row[], const PetscReal u[],
                                      PetscReal tangent[], HycoRows *rows)
{
  PetscReal *normal, *drawn;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(3 * pairs->n, &normal, pairs->n, &drawn));
  ierr = HycoContactGeometry(fe, pairs, normal, drawn);
  if (!ierr) ierr = ContactRowReserve(fe, pairs, row[pairs->n], fe->dim, rows);
  for (PetscInt k = 0; k < pairs->n && !ierr; k++) {
    PetscReal jump[3];

    /* Any orthonormal pair: the law is isotropic in the plane. */
    ContactRowTangents(fe->dim, normal + 3 * k, tangent + 6 * k);
    HycoPairsJump(pairs, k, fe->dim, u, jump);
    ierr = AddNormal(fe, pairs, k, normal + 3 * k, drawn[k], row[k], rows);
    for (PetscInt r = row[k] + 1; r < row[k + 1]; r++) {
      const PetscReal *along = tangent + 6 * k + 3 * (r - row[k] - 1);

      rows->gap[r] = HycoPairsAlone(fe->scene, pairs, k) ? 0 : HycoDot(jump, along);
      AddRow(fe, pairs, k, along, r, rows);
    }
  }
  PetscCall(PetscFree2(normal, drawn));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
