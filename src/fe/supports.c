/*
  Rigid motions that the supports leave to a connected part of the mesh: the null space of K. If contact prevents them,
  K is singular, but the contact problem is not.
*/
#include <hycofe.h>
#include <petscblaslapack.h>
#include <string.h>

/* The representative node of the part connected to i; part leads to it. Path halving keeps the trees flat. */
static PetscInt SupportsRoot(PetscInt part[], PetscInt i)
{
  while (part[i] != i) {
    part[i] = part[part[i]];
    i = part[i];
  }
  return i;
}

/* Each process identifies a piece of a part by its smallest node in the whole mesh: finds the smallest of the part.
   piece: of each node; label: of each piece. Minimum over the ranks at shared nodes, repeated until nothing changes:
   as many rounds as the longest chain of ranks through one part. */
static PetscErrorCode JoinPieces(MPI_Comm comm, HycoMesh m, const PetscInt piece[], PetscInt label[])
{
  PetscInt *node, *own;
  PetscBool change = PETSC_TRUE;
  PetscSF sf;

  PetscFunctionBegin;
  PetscCall(HycoMeshNodeSF(comm, m, m->n_nodes, m->node_global, &sf));
  PetscCall(PetscMalloc2(m->n_nodes, &node, m->n_owned, &own));
  while (change) {
    change = PETSC_FALSE;
    for (PetscInt i = 0; i < m->n_nodes; i++) node[i] = label[piece[i]];
    /* Neutral for the minimum. */
    for (PetscInt i = 0; i < m->n_owned; i++) own[i] = PETSC_MAX_INT;
    PetscCall(PetscSFReduceBegin(sf, MPIU_INT, node, own, MPI_MIN));
    PetscCall(PetscSFReduceEnd(sf, MPIU_INT, node, own, MPI_MIN));
    PetscCall(HycoSFBcast(sf, MPIU_INT, 1, own, node));
    for (PetscInt i = 0; i < m->n_nodes; i++) {
      change = (PetscBool)(change || node[i] < label[piece[i]]);
      label[piece[i]] = PetscMin(label[piece[i]], node[i]);
    }
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &change, 1, HYCO_MPI_BOOL, MPI_LOR, comm));
  }
  PetscCall(PetscFree2(node, own));
  PetscCall(PetscSFDestroy(&sf));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* part[i]: number of the connected part that node i is in, in the order of the parts' first nodes. Collective. */
static PetscErrorCode FindParts(MPI_Comm comm, HycoMesh m, PetscInt part[], PetscInt *n_parts)
{
  PetscInt *label, *number, n = 0;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < m->n_nodes; i++) part[i] = i;
  for (PetscInt k = 0; k < m->n_cells * m->nv; k++) {
    const PetscInt a = SupportsRoot(part, m->cells[k]), b = SupportsRoot(part, m->cells[k - k % m->nv]);

    /* The smaller root wins: a representative precedes all nodes of its part, on which the numbering below relies. */
    part[PetscMax(a, b)] = PetscMin(a, b);
  }
  for (PetscInt k = 0; k < m->n_tied; k++) {
    for (PetscInt j = m->tied_start[k]; j < m->tied_start[k + 1]; j++) {
      const PetscInt a = SupportsRoot(part, m->tied[k]), b = SupportsRoot(part, m->tied_master[j]);

      part[PetscMax(a, b)] = PetscMin(a, b);
    }
  }
  for (PetscInt i = 0; i < m->n_nodes; i++) part[i] = SupportsRoot(part, i);
  PetscCall(PetscMalloc2(m->n_nodes, &label, m->n_nodes, &number));
  for (PetscInt i = 0; i < m->n_nodes; i++) { /* representatives come first */
    if (part[i] == i) label[n] = m->node_global ? m->node_whole[i] : i;
    /* In place: part[part[i]] is a number already, since the representative comes first. */
    part[i] = part[i] == i ? n++ : part[part[i]];
  }
  *n_parts = n;
  if (HycoSize(comm) > 1) {
    PetscCall(JoinPieces(comm, m, part, label));
    /* Labels that JoinPieces() has made equal get one number, in the order of the mesh file. */
    PetscCall(HycoRankInts(comm, n, label, number, n_parts));
    for (PetscInt i = 0; i < m->n_nodes; i++) part[i] = number[part[i]];
  }
  PetscCall(PetscFree2(label, number));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A sum in twice the working precision: after rounding it is the same in any order, and so is the basis of a null
   space that syev chooses by round-off. */
typedef struct {
  PetscReal high, low;
} Sum;

/* Error-free addition (two-sum) of the high part; the error goes to the low part. */
static void SupportsAdd(Sum *s, PetscReal value)
{
  const PetscReal sum = s->high + value, part = sum - s->high;

  s->low += (s->high - (sum - part)) + (value - part);
  s->high = sum;
}

/* An MPI operation; it is commutative up to round-off of the low part alone. */
static void AddSums(void *in, void *inout, PetscMPIInt *n, MPI_Datatype *type)
{
  const Sum *from = (const Sum *)in;
  Sum *to = (Sum *)inout;

  (void)type;
  for (PetscMPIInt k = 0; k < *n; k++) {
    SupportsAdd(&to[k], from[k].high);
    SupportsAdd(&to[k], from[k].low);
  }
}

/* The sums over all processes, in `high`, identical on each. Collective. */
static PetscErrorCode SupportsTotal(MPI_Comm comm, PetscInt n, Sum sum[])
{
  MPI_Datatype type;
  MPI_Op op;
  PetscMPIInt count;

  PetscFunctionBegin;
  PetscCall(PetscMPIIntCast(n, &count));
  PetscCallMPI(MPI_Type_contiguous(2, MPIU_REAL, &type));
  PetscCallMPI(MPI_Type_commit(&type));
  PetscCallMPI(MPI_Op_create(AddSums, 1, &op));
  /* Reduce and broadcast, not Allreduce, whose order of sums may differ between ranks. */
  PetscCallMPI(MPI_Reduce(HycoRank(comm) ? (void *)sum : MPI_IN_PLACE, sum, count, type, op, 0, comm));
  PetscCallMPI(MPI_Bcast(sum, count, type, 0, comm));
  PetscCallMPI(MPI_Op_free(&op));
  PetscCallMPI(MPI_Type_free(&type));
  for (PetscInt k = 0; k < n; k++) sum[k].high += sum[k].low;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rigid motions of one part at its fixed unknowns: the Gram matrix of those rows, relative to a centre and a
   length. */
typedef struct {
  PetscInt body;
  PetscReal centre[3], size, gram[6][6];
} Part;

/* Row of component c of the rigid motions (dim translations, then rotations) at x. x is relative to the part's
   centre and size, so that all entries are of order 1 and a tolerance has no unit. */
PetscInt HycoRigidRow(PetscInt dim, const PetscReal x[3], PetscInt c, PetscReal row[6])
{
  const PetscInt n = dim == 1 ? 1 : dim == 2 ? 3 : 6;

  for (PetscInt j = 0; j < 6; j++) row[j] = j == c;
  /* A turn about z: (-y, x). */
  if (dim == 2) row[2] = c == 0 ? -x[1] : x[0];
  if (dim == 3) { /* omega x X */
    const PetscInt d = (c + 1) % 3, e = (c + 2) % 3;

    row[3 + c] = 0;
    row[3 + d] = x[e];
    row[3 + e] = -x[d];
  }
  return n;
}

/* The value of component c of a motion at x (m), from its six coefficients. */
PetscReal HycoRigidAt(const HycoRigid *r, PetscInt dim, const PetscReal x[3], PetscInt c)
{
  PetscReal at[3], row[6], sum = 0;
  PetscInt n;

  for (PetscInt d = 0; d < 3; d++) at[d] = (x[d] - r->centre[d]) / r->size;
  n = HycoRigidRow(dim, at, c, row);
  for (PetscInt j = 0; j < n; j++) sum += row[j] * r->rigid[j];
  return sum;
}

/* "body pellet from moving along (0, 0, 1)", or from turning about an axis through a point; a motion whose axis is
   twenty lengths away is named as a translation. `others`: bodies that move with it. */
static void SupportsName(HycoFE fe, const HycoRigid *r, const char others[], char name[HYCO_LINE])
{
  const PetscReal *w = fe->dim == 3 ? r->rigid + 3 : NULL;
  PetscReal t[3] = {0, 0, 0}, omega[3] = {0, 0, fe->dim == 2 ? r->rigid[2] : 0}, at[3], move = 0, turn = 0, size = 0,
            d[3];
  PetscReal first, along = 0;

  for (PetscInt c = 0; c < 3; c++) {
    if (c < fe->dim) t[c] = r->rigid[c];
    if (w) omega[c] = w[c];
    move += t[c] * t[c];
    turn += omega[c] * omega[c];
  }
  /* The point of the axis nearest to the centre is omega x t / |omega|^2. Named is that nearest to the origin, on which
     full order and models agree, whose motions have other centres. */
  for (PetscInt c = 0; c < 3; c++) {
    const PetscInt e = (c + 1) % 3, f = (c + 2) % 3;

    d[c] = move > 400 * turn ? t[c] : omega[c];
    size += d[c] * d[c];
    /* x = centre + size times the point: motions are relative to both. */
    at[c] = turn > 0 ? r->centre[c] + r->size * (omega[e] * t[f] - omega[f] * t[e]) / turn : 0;
    along += at[c] * omega[c];
  }
  for (PetscInt c = 0; c < 3; c++) {
    if (turn > 0) at[c] -= along * omega[c] / turn;
    if (PetscAbsReal(at[c]) < 1e-6 * r->size) at[c] = 0; /* round-off */
  }
  for (PetscInt c = 0; c < 3; c++) {
    d[c] /= PetscSqrtReal(size);
    if (PetscAbsReal(d[c]) < 1e-8) d[c] = 0; /* round-off */
  }
  first = d[0] != 0 ? d[0] : d[1] != 0 ? d[1] : d[2];
  for (PetscInt c = 0; c < 3 && first < 0; c++) d[c] = d[c] == 0 ? 0 : -d[c]; /* the sign of an axis is arbitrary */
  if (move > 400 * turn)
    HycoFormat(name, "body %s%s from moving along (%.2g, %.2g, %.2g)", fe->scene->body[r->body].name, others,
               (double)d[0], (double)d[1], (double)d[2]);
  else
    HycoFormat(name, "body %s%s from turning about (%.2g, %.2g, %.2g) through (%.4g, %.4g, %.4g)",
               fe->scene->body[r->body].name, others, (double)d[0], (double)d[1], (double)d[2], (double)at[0],
               (double)at[1], (double)at[2]);
}

/* The combination's motion of the part to which motion k belongs; its share of the whole. Motions of one part are
   contiguous, but a combination may mix several of them. */
static PetscReal OfPart(const HycoMotions *motions, const PetscReal coefficient[], PetscInt k, HycoRigid *r)
{
  PetscReal share = 0;

  *r = motions->rigid[k];
  for (PetscInt i = 0; i < 6; i++) r->rigid[i] = 0;
  for (PetscInt j = 0; j < motions->n; j++) {
    if (motions->rigid[j].part != r->part) continue;
    share += coefficient[j] * coefficient[j];
    for (PetscInt i = 0; i < 6; i++) r->rigid[i] += coefficient[j] * motions->rigid[j].rigid[i];
  }
  return share;
}

/* Names a combination of motions by its largest part, with the bodies that move more than 1e-2 of the whole; for
   messages. */
void HycoMotionsName(HycoFE fe, const HycoMotions *motions, const PetscReal coefficient[], char name[HYCO_LINE])
{
  HycoRigid best, r;
  PetscReal most = -1;
  char others[HYCO_LINE / 4] = "";

  for (PetscInt k = 0; k < motions->n; k++) {
    const PetscReal share = OfPart(motions, coefficient, k, &r);

    /* Of equal shares the first, whatever round-off does. */
    if (share > most * (1 + 1e-8)) best = r;
    most = PetscMax(most, share);
  }
  for (PetscInt k = 0; k < motions->n; k++) {
    const PetscBool first = (PetscBool)(!k || motions->rigid[k].part != motions->rigid[k - 1].part);

    if (!first || motions->rigid[k].part == best.part || OfPart(motions, coefficient, k, &r) < 1e-4) continue;
    if (strlen(others) + strlen(fe->scene->body[r.body].name) + 8 > sizeof(others)) continue;
    strcat(others, others[0] ? ", " : " (with ");
    strcat(others, fe->scene->body[r.body].name);
  }
  if (others[0]) strcat(others, ")");
  SupportsName(fe, &best, others, name);
}

/* The product of two motions, over all unknowns. Collective. */
static PetscErrorCode SupportsProduct(MPI_Comm comm, HycoFE fe, const PetscReal a[], const PetscReal b[],
                                      PetscReal *dot)
{
  PetscFunctionBegin;
  *dot = 0;
  for (PetscInt i = 0; i < fe->n_dof; i++) {
    if (HycoMeshOwned(fe->mesh, i / fe->dim) >= 0) *dot += a[i] * b[i];
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, dot, 1, MPIU_REAL, MPI_SUM, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds a motion: its values on the part's nodes, orthonormalised against the part's motions from `first`. */
static PetscErrorCode AddMotion(MPI_Comm comm, HycoFE fe, const PetscInt part[], PetscInt which, const Part *p,
                                const PetscReal v[], PetscInt first, HycoMotions *motions)
{
  const PetscInt n = fe->n_dof, k = motions->n, n_rigid = fe->dim == 1 ? 1 : fe->dim == 2 ? 3 : 6;
  PetscReal *u, norm, dot;
  HycoRigid *own;

  PetscFunctionBegin;
  /* At most 6 for each part: growing by one is cheap. */
  PetscCall(PetscRealloc(((size_t)(k + 1) * (size_t)n + 1) * sizeof(PetscReal), &motions->motion));
  PetscCall(PetscRealloc((size_t)(k + 1) * sizeof(*motions->name), &motions->name));
  PetscCall(PetscRealloc((size_t)(k + 1) * sizeof(*motions->rigid), &motions->rigid));
  own = &motions->rigid[k];
  own->part = which;
  own->body = p->body;
  own->size = p->size;
  PetscCall(PetscArraycpy(own->centre, p->centre, 3));
  PetscCall(PetscArrayzero(own->rigid, 6));
  for (PetscInt j = 0; j < n_rigid; j++) own->rigid[j] = v[j];
  u = motions->motion + (size_t)k * (size_t)n;
  PetscCall(PetscArrayzero(u, n));
  for (PetscInt i = 0; i < n; i++) {
    PetscReal x[3], row[6];

    if (part[i / fe->dim] != which) continue;
    for (PetscInt c = 0; c < 3; c++) x[c] = (fe->X[3 * (i / fe->dim) + c] - p->centre[c]) / p->size;
    HycoRigidRow(fe->dim, x, i % fe->dim, row);
    /* Fixed unknowns are left out: they are zero within round-off, since the motion satisfies the supports. */
    for (PetscInt j = 0; j < n_rigid && !fe->fixed[i]; j++) u[i] += row[j] * v[j];
  }
  for (PetscInt j = first; j < k; j++) {
    const PetscReal *w = motions->motion + (size_t)j * (size_t)n;

    /* Eigenvectors are orthogonal in the coefficients, not over the nodes. */
    PetscCall(SupportsProduct(comm, fe, u, w, &dot));
    for (PetscInt i = 0; i < n; i++) u[i] -= dot * w[i];
    for (PetscInt i = 0; i < 6; i++) own->rigid[i] -= dot * motions->rigid[j].rigid[i];
  }
  PetscCall(SupportsProduct(comm, fe, u, u, &norm));
  for (PetscInt i = 0; i < n; i++) u[i] /= PetscSqrtReal(norm);
  for (PetscInt i = 0; i < 6; i++) own->rigid[i] /= PetscSqrtReal(norm);
  SupportsName(fe, own, "", motions->name[k]);
  motions->n++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Eigenvectors of the Gram matrix with eigenvalue 0: motions that no support resists. The matrix holds squares,
   hence 1e-13 corresponds to 3e-7 in a motion. */
static PetscErrorCode PartMotions(MPI_Comm comm, HycoFE fe, const PetscInt part[], PetscInt which, Part *p,
                                  HycoMotions *motions)
{
  PetscBLASInt n = fe->dim == 1 ? 1 : fe->dim == 2 ? 3 : 6, lwork = 64, info, ld = 6;
  PetscReal values[6], work[64];
  const PetscInt first = motions->n;

  PetscFunctionBegin;
  /* Eigenvalues ascend; gram[j] becomes the j-th eigenvector (columns in LAPACK's order). */
  LAPACKsyev_("V", "U", &n, &p->gram[0][0], &ld, values, work, &lwork, &info);
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK syev: %d", (int)info);
  for (PetscInt j = 0; j < n && values[j] <= 1e-13 * PetscMax(values[n - 1], 1); j++)
    PetscCall(AddMotion(comm, fe, part, which, p, p->gram[j], first, motions));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets body (of its last node), centre and size of each part. Centre: mean of the nodes; size: largest distance of a
   coordinate. Of owned nodes, and the maximum also sees ghosts. */
static PetscErrorCode PlaceParts(MPI_Comm comm, HycoFE fe, const PetscInt part[], PetscInt n_parts, Part parts[])
{
  HycoMesh m = fe->mesh;
  const PetscInt n_bodies = fe->scene->n_bodies;
  PetscInt64 *last;
  PetscReal *size;
  Sum *sum; /* by part: number of nodes, sums of coordinates */

  PetscFunctionBegin;
  PetscCall(PetscCalloc3(n_parts, &last, n_parts, &size, 4 * n_parts, &sum));
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    const PetscInt64 node = m->node_global ? m->node_whole[i] : i;

    if (HycoMeshOwned(m, i) < 0) continue;
    /* The node's place first, then the body: one maximum gives the body of the last node. */
    last[part[i]] = PetscMax(last[part[i]], node * n_bodies + m->node_body[i]);
    SupportsAdd(&sum[4 * part[i]], 1);
    for (PetscInt c = 0; c < 3; c++) SupportsAdd(&sum[4 * part[i] + 1 + c], fe->X[3 * i + c]);
  }
  HycoAllreduce(last, n_parts, MPIU_INT64, MPI_MAX, comm);
  PetscCall(SupportsTotal(comm, 4 * n_parts, sum));
  for (PetscInt p = 0; p < n_parts; p++) {
    if (!(sum[4 * p].high > 0)) continue; /* of a part of the mesh */
    parts[p].body = (PetscInt)(last[p] % n_bodies);
    for (PetscInt c = 0; c < 3; c++) parts[p].centre[c] = sum[4 * p + 1 + c].high / sum[4 * p].high;
  }
  for (PetscInt i = 0; i < m->n_nodes; i++) {
    for (PetscInt c = 0; c < 3; c++)
      size[part[i]] = PetscMax(size[part[i]], PetscAbsReal(fe->X[3 * i + c] - parts[part[i]].centre[c]));
  }
  HycoAllreduce(size, n_parts, MPIU_REAL, MPI_MAX, comm);
  for (PetscInt p = 0; p < n_parts; p++) parts[p].size = size[p];
  PetscCall(PetscFree3(last, size, sum));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Springs hold a part as supports do, however small their stiffness is. Scaled by its largest entry: a soft spring
   still makes K regular. */
typedef struct {
  const PetscInt *part;
  const Part *parts;
  Sum *sum;
} SpringGram;

/* Adds a spring's energy on the part's rigid motions to its Gram matrix, with K scaled to 1: only which motions it
   holds matters here, not how stiff it is. Sums have twice the precision, so that their order does not matter. */
static PetscErrorCode AddSpring(HycoFE fe, PetscInt spring, PetscInt n, const PetscInt node[], const PetscReal K[],
                                void *ctx)
{
  const SpringGram *g = (const SpringGram *)ctx;
  const PetscInt size = n * fe->dim, which = g->part[node[0]];
  const Part *p = &g->parts[which];
  PetscReal row[3 * HYCO_FACET_NODES][6], most = 0;
  PetscInt n_rigid = 0;

  PetscFunctionBegin;
  (void)spring;
  for (PetscInt r = 0; r < size; r++) {
    PetscReal x[3];

    for (PetscInt c = 0; c < 3; c++) x[c] = (fe->X[3 * node[r / fe->dim] + c] - p->centre[c]) / p->size;
    n_rigid = HycoRigidRow(fe->dim, x, r % fe->dim, row[r]);
    /* The largest diagonal entry: K over it is free of units. */
    most = PetscMax(most, K[r * size + r]);
  }
  for (PetscInt k = 0; k < size * size && most > 0; k++) {
    for (PetscInt a = 0; a < n_rigid * n_rigid; a++)
      SupportsAdd(&g->sum[36 * which + a / n_rigid * 6 + a % n_rigid],
                  K[k] / most * row[k / size][a / n_rigid] * row[k % size][a % n_rigid]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sums the Gram matrix of each part. A row per supported unknown: rigid motions that it resists. An oblique support
   resists n.u, thus the motion minus that of the expressed components. */
static PetscErrorCode MeasureParts(MPI_Comm comm, HycoFE fe, PetscBool springs, const PetscInt part[], PetscInt n_parts,
                                   Part parts[])
{
  SpringGram ctx;
  Sum *sum;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(36 * n_parts, &sum));
  for (PetscInt k = 0; k < fe->n_dof; k++) {
    const PetscInt i = k / fe->dim;
    const Part *p = &parts[part[i]];
    const HycoOblique *oblique;
    PetscReal x[3], row[6];
    PetscInt n;

    /* Ties hold nothing: slave and masters are one part. */
    if (!HycoFESupports(fe, k) || HycoMeshOwned(fe->mesh, i) < 0) continue;
    for (PetscInt c = 0; c < 3; c++) x[c] = (fe->X[3 * i + c] - p->centre[c]) / p->size;
    n = HycoRigidRow(fe->dim, x, k % fe->dim, row);
    oblique = HycoFEOblique(fe, k);
    for (PetscInt d = 0; oblique && d < fe->dim; d++) {
      PetscReal other[6];

      HycoRigidRow(fe->dim, x, d, other);
      for (PetscInt a = 0; a < n; a++) row[a] -= oblique->a[d] * other[a];
    }
    for (PetscInt a = 0; a < n * n; a++) SupportsAdd(&sum[36 * part[i] + a / n * 6 + a % n], row[a / n] * row[a % n]);
  }
  ctx = (SpringGram){part, parts, sum};
  if (springs) PetscCall(HycoSpringsVisit(fe, AddSpring, &ctx));
  PetscCall(SupportsTotal(comm, 36 * n_parts, sum));
  for (PetscInt k = 0; k < 36 * n_parts; k++) parts[k / 36].gram[k % 36 / 6][k % 6] = sum[k].high;
  for (PetscInt p = 0; p < n_parts && fe->formulation == HYCO_AXISYMMETRIC; p++) /* a motion along the axis is the
                                                                                    only rigid one */
    parts[p].gram[0][0] += 1, parts[p].gram[2][2] += 1;
  PetscCall(PetscFree(sum));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Those of n_parts parts, part[] by node. */
static PetscErrorCode MotionsOfParts(MPI_Comm comm, HycoFE fe, PetscBool springs, PetscInt n_parts,
                                     const PetscInt part[], HycoMotions *motions)
{
  Part *parts;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(n_parts, &parts));
  PetscCall(PlaceParts(comm, fe, part, n_parts, parts));
  PetscCall(MeasureParts(comm, fe, springs, part, n_parts, parts));
  for (PetscInt p = 0; p < n_parts; p++) {
    if (parts[p].size > 0) PetscCall(PartMotions(comm, fe, part, p, &parts[p], motions));
  }
  PetscCall(PetscFree(parts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rigid motions that supports, and `springs`, leave, orthonormal over all unknowns, part by part in the order of the
   mesh file: identical on any number of ranks. Values at local unknowns; the caller destroys them. Collective. */
static PetscErrorCode FindMotions(MPI_Comm comm, HycoFE fe, PetscBool springs, HycoMotions *motions)
{
  PetscInt n_parts;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(motions, sizeof(*motions)));
  PetscCall(PetscMalloc1(fe->mesh->n_nodes, &motions->part));
  /* Connected parts of the mesh: each may move by itself. */
  PetscCall(FindParts(comm, fe->mesh, motions->part, &n_parts));
  PetscCall(MotionsOfParts(comm, fe, springs, n_parts, motions->part, motions));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFEMotionsOfParts(HycoFE fe, PetscInt n_parts, const PetscInt part[], HycoMotions *motions)
{
  PetscFunctionBegin;
  PetscCall(PetscMemzero(motions, sizeof(*motions)));
  HycoDuplicate(fe->mesh->n_nodes, part, &motions->part);
  PetscCall(MotionsOfParts(PETSC_COMM_SELF, fe, PETSC_TRUE, n_parts, motions->part, motions));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFEFreeMotions(MPI_Comm comm, HycoFE fe, HycoMotions *motions)
{
  PetscFunctionBegin;
  PetscCall(FindMotions(comm, fe, PETSC_TRUE, motions));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFEUnsupportedMotions(MPI_Comm comm, HycoFE fe, HycoMotions *motions)
{
  PetscFunctionBegin;
  PetscCall(FindMotions(comm, fe, PETSC_FALSE, motions));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMotionsDestroy(HycoMotions *motions)
{
  PetscFunctionBegin;
  HycoFreeAll(&motions->motion, &motions->name, &motions->rigid, &motions->part);
  motions->n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}
