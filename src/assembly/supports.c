/* Rigid motions: a connected part of the mesh whose supports leave one free makes K singular. */
#include <hycofe.h>
#include <petscblaslapack.h>

/* The node that stands for all that i is connected to; part leads to it. */
static PetscInt Root(PetscInt part[], PetscInt i)
{
  while (part[i] != i) {
    part[i] = part[part[i]];
    i = part[i];
  }
  return i;
}

/* part[i]: number of the connected part that node i is in. */
static PetscErrorCode FindParts(HycoMesh m, PetscInt part[], PetscInt *n_parts)
{
  PetscFunctionBegin;
  for (PetscInt i = 0; i < m->n_nodes; i++) part[i] = i;
  for (PetscInt k = 0; k < m->n_cells * m->nv; k++) {
    const PetscInt a = Root(part, m->cells[k]), b = Root(part, m->cells[k - k % m->nv]);

    part[PetscMax(a, b)] = PetscMin(a, b);
  }
  for (PetscInt i = 0; i < m->n_nodes; i++) part[i] = Root(part, i);
  *n_parts = 0;
  for (PetscInt i = 0; i < m->n_nodes; i++)
    part[i] = part[i] == i ? (*n_parts)++ : part[part[i]]; /* roots come first */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the rigid motions of one part do at its fixed unknowns: the Gram matrix of those rows, about a centre and in a
 * length. */
typedef struct {
  PetscInt nodes, body;
  PetscReal centre[3], size, gram[6][6];
} Part;

/* Row of component c of the rigid motions (dim translations, then rotations) at x. */
static PetscInt RigidRow(PetscInt dim, const PetscReal x[3], PetscInt c, PetscReal row[6])
{
  const PetscInt n = dim == 1 ? 1 : dim == 2 ? 3 : 6;

  for (PetscInt j = 0; j < 6; j++) row[j] = j == c;
  if (dim == 2) row[2] = c == 0 ? -x[1] : x[0];
  if (dim == 3) { /* omega x X */
    const PetscInt d = (c + 1) % 3, e = (c + 2) % 3;

    row[3 + c] = 0;
    row[3 + d] = x[e];
    row[3 + e] = -x[d];
  }
  return n;
}

static PetscErrorCode Complain(HycoFE fe, const Part *p, PetscInt n, const PetscReal v[])
{
  const char *name = fe->scene->body[p->body].name;
  PetscReal move = 0, turn = 0;

  PetscFunctionBegin;
  for (PetscInt j = 0; j < n; j++) {
    if (j < fe->dim)
      move += v[j] * v[j];
    else
      turn += v[j] * v[j];
  }
  if (move >= turn) {
    HycoFail(
        "body %s is held by no support against moving along (%.2g, %.2g, %.2g)%s; fix a component on one of its groups",
        name, (double)v[0], n > 1 ? (double)v[1] : 0., n > 3 ? (double)v[2] : 0.,
        fe->scene->n_contacts ? ": contact alone holds nothing before it closes" : "");
  }
  HycoFail(
      "body %s is held by no support against turning about (%.2g, %.2g, %.2g)%s; fix a component on one of its groups",
      name, n > 3 ? (double)v[3] : 0., n > 3 ? (double)v[4] : 0., n > 3 ? (double)v[5] : 1.,
      fe->scene->n_contacts ? ": contact alone holds nothing before it closes" : "");
}

static PetscErrorCode CheckPart(HycoFE fe, Part *p)
{
  PetscBLASInt n = fe->dim == 1 ? 1 : fe->dim == 2 ? 3 : 6, lwork = 64, info, ld = 6;
  PetscReal values[6], work[64];

  PetscFunctionBegin;
  LAPACKsyev_("V", "U", &n, &p->gram[0][0], &ld, values, work, &lwork, &info);
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK syev: %d", (int)info);
  if (values[0] <= 1e-16 * PetscMax(values[n - 1], 1)) PetscCall(Complain(fe, p, n, p->gram[0]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFECheckSupports(HycoFE fe)
{
  HycoMesh m = fe->mesh;
  PetscInt *part, n_parts;
  Part *parts;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->n_nodes, &part));
  PetscCall(FindParts(m, part, &n_parts));
  PetscCall(PetscCalloc1(n_parts, &parts));
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    parts[part[i]].nodes++;
    parts[part[i]].body = m->node_body[i];
    for (PetscInt c = 0; c < 3; c++) parts[part[i]].centre[c] += fe->X[3 * i + c];
  }
  for (PetscInt p = 0; p < n_parts; p++) {
    for (PetscInt c = 0; c < 3; c++) parts[p].centre[c] /= parts[p].nodes;
  }
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    for (PetscInt c = 0; c < 3; c++)
      parts[part[i]].size = PetscMax(parts[part[i]].size, PetscAbsReal(fe->X[3 * i + c] - parts[part[i]].centre[c]));
  }
  for (PetscInt k = 0; k < fe->n_dof; k++) {
    Part *p = &parts[part[k / fe->dim]];
    PetscReal x[3], row[6];
    PetscInt n;

    if (!fe->fixed[k]) continue;
    for (PetscInt c = 0; c < 3; c++) x[c] = (fe->X[3 * (k / fe->dim) + c] - p->centre[c]) / p->size;
    n = RigidRow(fe->dim, x, k % fe->dim, row);
    for (PetscInt a = 0; a < n; a++) {
      for (PetscInt b = 0; b < n; b++) p->gram[a][b] += row[a] * row[b];
    }
  }
  for (PetscInt p = 0; p < n_parts; p++) PetscCall(CheckPart(fe, &parts[p]));
  PetscCall(PetscFree(part));
  PetscCall(PetscFree(parts));
  PetscFunctionReturn(PETSC_SUCCESS);
}
