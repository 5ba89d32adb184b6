/*
  Rigid motions that the supports leave to a connected part of the mesh: the kernel of K. Contact may hold them: then
  K is singular and the problem is not.
*/
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

/* "body pellet moving along (0, 0, 1)", from coefficients of translations and rotations. */
static void Name(HycoFE fe, const Part *p, PetscInt n, const PetscReal v[], char name[HYCO_LINE])
{
  const char *body = fe->scene->body[p->body].name;
  PetscReal move = 0, turn = 0, d[3] = {0, 0, 1}, size = 0;

  for (PetscInt j = 0; j < n; j++) *(j < fe->dim ? &move : &turn) += v[j] * v[j];
  for (PetscInt c = 0; c < 3; c++) {
    if (move >= turn) d[c] = c < fe->dim ? v[c] : 0;
    if (move < turn && fe->dim == 3) d[c] = v[3 + c];
    size += d[c] * d[c];
  }
  for (PetscInt c = 0; c < 3; c++) {
    d[c] /= PetscSqrtReal(size);
    if (PetscAbsReal(d[c]) < 1e-8) d[c] = 0; /* round-off */
  }
  HycoFormat(name, "body %s from %s (%.2g, %.2g, %.2g)", body, move >= turn ? "moving along" : "turning about",
             (double)d[0], (double)d[1], (double)d[2]);
}

/* Adds a motion: its values on the part's nodes, made orthonormal to the part's motions from `first`. */
static PetscErrorCode AddMotion(HycoFE fe, const PetscInt part[], PetscInt which, const Part *p, const PetscReal v[],
                                PetscInt first, HycoMotions *motions)
{
  const PetscInt n = fe->n_dof, k = motions->n;
  PetscReal *u, norm = 0;

  PetscFunctionBegin;
  PetscCall(PetscRealloc((size_t)(k + 1) * (size_t)n * sizeof(PetscReal), &motions->motion));
  PetscCall(PetscRealloc((size_t)(k + 1) * sizeof(*motions->name), &motions->name));
  u = motions->motion + (size_t)k * (size_t)n;
  PetscCall(PetscArrayzero(u, n));
  for (PetscInt i = 0; i < n; i++) {
    PetscReal x[3], row[6];
    PetscInt n_rigid;

    if (part[i / fe->dim] != which) continue;
    for (PetscInt c = 0; c < 3; c++) x[c] = (fe->X[3 * (i / fe->dim) + c] - p->centre[c]) / p->size;
    n_rigid = RigidRow(fe->dim, x, i % fe->dim, row);
    for (PetscInt j = 0; j < n_rigid && !fe->fixed[i]; j++) u[i] += row[j] * v[j];
  }
  for (PetscInt j = first; j < k; j++) {
    const PetscReal *w = motions->motion + (size_t)j * (size_t)n;
    PetscReal dot = 0;

    for (PetscInt i = 0; i < n; i++) dot += u[i] * w[i];
    for (PetscInt i = 0; i < n; i++) u[i] -= dot * w[i];
  }
  for (PetscInt i = 0; i < n; i++) norm += u[i] * u[i];
  for (PetscInt i = 0; i < n; i++) u[i] /= PetscSqrtReal(norm);
  Name(fe, p, fe->dim == 1 ? 1 : fe->dim == 2 ? 3 : 6, v, motions->name[k]);
  motions->n++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PartMotions(HycoFE fe, const PetscInt part[], PetscInt which, Part *p, HycoMotions *motions)
{
  PetscBLASInt n = fe->dim == 1 ? 1 : fe->dim == 2 ? 3 : 6, lwork = 64, info, ld = 6;
  PetscReal values[6], work[64];
  const PetscInt first = motions->n;

  PetscFunctionBegin;
  LAPACKsyev_("V", "U", &n, &p->gram[0][0], &ld, values, work, &lwork, &info);
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK syev: %d", (int)info);
  for (PetscInt j = 0; j < n && values[j] <= 1e-16 * PetscMax(values[n - 1], 1); j++)
    PetscCall(AddMotion(fe, part, which, p, p->gram[j], first, motions));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Centre, size and Gram matrix of each part. */
static PetscErrorCode MeasureParts(HycoFE fe, const PetscInt part[], PetscInt n_parts, Part parts[])
{
  HycoMesh m = fe->mesh;

  PetscFunctionBegin;
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
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFEFreeMotions(HycoFE fe, HycoMotions *motions)
{
  HycoMesh m = fe->mesh;
  PetscInt *part, n_parts;
  Part *parts;

  PetscFunctionBegin;
  motions->n = 0;
  motions->motion = NULL;
  motions->name = NULL;
  PetscCall(PetscMalloc1(m->n_nodes, &part));
  PetscCall(FindParts(m, part, &n_parts));
  PetscCall(PetscCalloc1(n_parts, &parts));
  PetscCall(MeasureParts(fe, part, n_parts, parts));
  for (PetscInt p = 0; p < n_parts; p++) PetscCall(PartMotions(fe, part, p, &parts[p], motions));
  PetscCall(PetscFree(part));
  PetscCall(PetscFree(parts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMotionsDestroy(HycoMotions *motions)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(motions->motion));
  PetscCall(PetscFree(motions->name));
  motions->n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gram matrix of B N, N the motions. */
static PetscErrorCode GramOfRows(HycoFE fe, const HycoMotions *motions, PetscInt m, const PetscInt start[],
                                 const PetscInt dof[], const PetscReal value[], PetscReal gram[])
{
  const PetscInt n = motions->n;
  PetscReal *row;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &row));
  for (PetscInt i = 0; i < m; i++) {
    for (PetscInt a = 0; a < n; a++) {
      row[a] = 0;
      for (PetscInt j = start[i]; j < start[i + 1]; j++)
        row[a] += value[j] * motions->motion[(size_t)a * (size_t)fe->n_dof + (size_t)dof[j]];
    }
    for (PetscInt a = 0; a < n; a++) {
      for (PetscInt b = 0; b < n; b++) gram[a * n + b] += row[a] * row[b];
    }
  }
  PetscCall(PetscFree(row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFECheckHeld(HycoFE fe, const HycoMotions *motions, PetscInt m, const PetscInt start[],
                               const PetscInt dof[], const PetscReal value[])
{
  PetscBLASInt n, lwork, info;
  PetscInt worst = 0;
  PetscReal *gram, *values, *work, least;

  PetscFunctionBegin;
  if (!motions->n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscBLASIntCast(motions->n, &n));
  lwork = 8 * n;
  PetscCall(PetscCalloc1(n * n, &gram));
  PetscCall(PetscMalloc2(n, &values, lwork, &work));
  PetscCall(GramOfRows(fe, motions, m, start, dof, value, gram));
  LAPACKsyev_("V", "U", &n, gram, &n, values, work, &lwork, &info);
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK syev: %d", (int)info);
  for (PetscInt j = 0; j < n; j++) worst = PetscAbsReal(gram[j]) > PetscAbsReal(gram[worst]) ? j : worst;
  least = values[0];
  PetscCall(PetscFree(gram));
  PetscCall(PetscFree2(values, work));
  if (least <= 1e-12 * (m + 1) / fe->n_dof) {
    HycoFail("no support%s keeps %s; fix a component on one of its groups", m ? " and no contact" : "",
             motions->name[worst]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
