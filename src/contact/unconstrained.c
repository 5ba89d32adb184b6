/*
  Rigid motions that neither supports nor frictionless contact prevent. A motion that is tangential to a contact's
  surface everywhere meets no resistance: a disk that rotates about its centre, a body that slides along a plane. On a
  mesh, the facets' normals would resist because of the discretisation: the smooth surface is decisive
  (HycoSmoothNormals()), within the faceting error, so that all meshes of one geometry give the same result.
*/
#include <hycokinematics.h>
#include <hycovector.h>
#include <petscblaslapack.h>

/* The normals with which a contact may be tangential: the given ones, the slave's surface's, the master's. */
enum { GIVEN, SLAVE, MASTER, N_SENSES };
#define MOST_CONTACTS 3 /* contacts whose normals are chosen independently; more have a common choice */

/* Arrays are by contact of this rank; decisions are taken on sums over all ranks, so that all ranks follow the same
   branches. */
typedef struct {
  MPI_Comm comm;
  HycoFE fe, wide;       /* of this rank's contacts; with all facets around their neighbours */
  const PetscInt *index; /* of fe's nodes in wide; NULL: the same */
  HycoPairs *pairs;
  PetscInt k, m, all;                          /* numbers of motions, contacts, contacts of all ranks */
  PetscReal *d;                                /* m x k x 3: relative displacement of slave and master */
  PetscReal *normal[N_SENSES];                 /* m x 3; zero: not available */
  PetscReal *doubt[N_SENSES], *bend[N_SENSES]; /* m */
} Shapes;

/* A slave that faces nothing meets no resistance. Motions are orthonormal over all unknowns, so that d is small for
   large meshes; tolerances are scaled accordingly. */
static void FreeMotionRelative(Shapes *s, const HycoMotions *motions)
{
  for (PetscInt i = 0; i < s->m; i++) {
    for (PetscInt a = 0; a < s->k && !HycoPairsAlone(s->fe->scene, s->pairs, i); a++)
      HycoPairsJump(s->pairs, i, s->fe->dim, motions->motion + (size_t)a * (size_t)s->fe->n_dof,
                    s->d + ((size_t)i * (size_t)s->k + (size_t)a) * 3);
  }
}

/* How many contacts with i's slave come before it: those of other sides. */
static PetscInt LayerOf(const HycoPairs *p, PetscInt i)
{
  PetscInt k = i;

  while (k > 0 && p->slave[k - 1] == p->slave[i] && p->contact[k - 1] == p->contact[i]) k--;
  return i - k;
}

static PetscInt WideNode(const Shapes *s, PetscInt node)
{
  return s->index ? s->index[node] : node;
}

/* The normals of a contact's slaves in one layer: at a slave with several contacts that of one of them. side, work: of
   the nodes. */
static PetscErrorCode SlaveSenses(Shapes *s, PetscInt contact, PetscInt layer, PetscInt side[], PetscReal work[],
                                  PetscBool *more)
{
  const HycoPairs *p = s->pairs;
  const PetscInt n_nodes = s->wide->mesh->n_nodes;
  PetscReal *normal = work, *doubt = work + 3 * n_nodes, *bend = work + 4 * n_nodes;
  PetscInt g = 0;

  PetscFunctionBegin;
  *more = PETSC_FALSE;
  for (PetscInt i = 0; i < n_nodes; i++) side[i] = HYCO_ONE_SIDE;
  for (PetscInt i = 0; i < s->m; i++) {
    if (p->contact[i] != contact) continue;
    if (LayerOf(p, i) == layer) side[WideNode(s, p->slave[i])] = HycoSideOf(p->side[i]);
    *more = (PetscBool)(*more || LayerOf(p, i) > layer);
  }
  PetscCall(HycoMeshFindGroup(s->wide->mesh, "contact", s->fe->scene->contact[contact]->slave, &g));
  PetscCall(HycoSmoothNormals(s->wide, g, side, normal, doubt, bend));
  for (PetscInt i = 0; i < s->m; i++) {
    const PetscInt node = WideNode(s, p->slave[i]);

    if (p->contact[i] != contact || LayerOf(p, i) != layer) continue;
    for (PetscInt d = 0; d < 3; d++) s->normal[SLAVE][3 * i + d] = normal[3 * node + d];
    s->doubt[SLAVE][i] = doubt[node];
    s->bend[SLAVE][i] = bend[node];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The master's normals, reversed and interpolated at the master points of one contact's pairs. */
static PetscErrorCode MasterSenses(Shapes *s, PetscInt contact, PetscInt side[], PetscReal work[])
{
  const char *group = s->fe->scene->contact[contact]->master;
  const HycoPairs *p = s->pairs;
  const PetscInt n_nodes = s->wide->mesh->n_nodes;
  PetscReal *normal = work, *doubt = work + 3 * n_nodes, *bend = work + 4 * n_nodes;
  PetscInt g = 0;

  PetscFunctionBegin;
  /* An obstacle has no surface on its other side. */
  if (!group) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt i = 0; i < n_nodes; i++) side[i] = HYCO_ONE_SIDE;
  PetscCall(HycoMeshFindGroup(s->wide->mesh, "contact", group, &g));
  PetscCall(HycoSmoothNormals(s->wide, g, side, normal, doubt, bend));
  for (PetscInt i = 0; i < s->m; i++) {
    if (p->contact[i] != contact) continue;
    for (PetscInt j = p->master_start[i]; j < p->master_start[i + 1]; j++) {
      const PetscInt node = WideNode(s, p->master[j]);

      /* Several masters: the normal at their mean point is interpolated by the weights of the gap. */
      for (PetscInt d = 0; d < 3; d++) s->normal[MASTER][3 * i + d] -= p->weight[j] * normal[3 * node + d];
      /* The most doubtful of the nodes that enter. */
      s->doubt[MASTER][i] = PetscMax(s->doubt[MASTER][i], doubt[node]);
      s->bend[MASTER][i] = PetscMax(s->bend[MASTER][i], bend[node]);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Normals of the slave's and the master's surface at one contact's pairs; work: room for 5 reals a node. */
static PetscErrorCode SurfaceSenses(Shapes *s, PetscInt contact, PetscInt side[], PetscReal work[])
{
  PetscBool more = PETSC_TRUE;

  PetscFunctionBegin;
  for (PetscInt layer = 0; more; layer++) PetscCall(SlaveSenses(s, contact, layer, side, work, &more));
  PetscCall(MasterSenses(s, contact, side, work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The slave surface's error is also taken for given normals, which cannot be more exact than the mesh. A sense is one
   of three possible normals of a contact: given, of the slave's surface, of the master's. */
static PetscErrorCode FindSenses(Shapes *s)
{
  HycoScene scene = s->fe->scene;
  PetscReal *work, *gap;
  PetscInt *side;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(5 * s->wide->mesh->n_nodes, &work, s->m, &gap, s->wide->mesh->n_nodes, &side));
  PetscCall(HycoContactGeometry(s->fe, s->pairs, s->normal[GIVEN], gap));
  for (PetscInt c = 0; c < scene->n_contacts && s->fe->dim > 1; c++) PetscCall(SurfaceSenses(s, c, side, work));
  for (PetscInt i = 0; i < s->m; i++) {
    const PetscReal *n = s->normal[SLAVE] + 3 * i;
    const PetscBool given = (PetscBool)!HycoContactAverages(scene->contact[s->pairs->contact[i]]);

    s->doubt[GIVEN][i] = PetscMax(s->doubt[SLAVE][i], 1e-6);
    s->bend[GIVEN][i] = PetscMax(s->bend[SLAVE][i], s->bend[MASTER][i]);
    /* averaged from the facets: the slave's surface is more accurate */
    for (PetscInt d = 0; d < 3 && !given && n[0] * n[0] + n[1] * n[1] + n[2] * n[2] > 0; d++)
      s->normal[GIVEN][3 * i + d] = 0;
  }
  PetscCall(PetscFree3(work, gap, side));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same on all ranks, or an error on all. */
static PetscErrorCode FindAllSenses(Shapes *s)
{
  PetscFunctionBegin;
  HycoOnEach(s->comm, FindSenses(s));
  /* A normal along its surface resists nothing: it is named, not the motion that follows from it. */
  PetscCall(HycoContactCheckNormals(s->comm, s->fe, s->pairs, s->normal[GIVEN]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The displacement at contact i under the combination z. */
static void FreeMotionCombine(const Shapes *s, PetscInt i, const PetscReal z[], PetscReal d[3])
{
  for (PetscInt c = 0; c < 3; c++) {
    d[c] = 0;
    for (PetscInt a = 0; a < s->k; a++) d[c] += z[a] * s->d[((size_t)i * (size_t)s->k + (size_t)a) * 3 + (size_t)c];
  }
}

/* Whether contact i resists tangential motions as well. */
static PetscBool FreeMotionHasFriction(const Shapes *s, PetscInt i)
{
  return (PetscBool)(s->fe->scene->contact[s->pairs->contact[i]]->friction != NULL);
}

/* The eigenvectors of sum of (n.d / doubt)^2 against sum of |d|^2, in A (k x k), values ascending. Only the ratio
   matters: how far a motion is from tangential, in units of the normals' errors, against its size. */
static PetscErrorCode FreeMotionSpectrum(const Shapes *s, const PetscInt sense[], const PetscReal weight[],
                                         PetscReal A[], PetscReal M[], PetscReal values[])
{
  const PetscInt k = s->k;
  PetscBLASInt n, one = 1, lwork, info;
  PetscReal *work;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast(k, &n));
  lwork = 8 * n;
  PetscCall(PetscMalloc1(lwork, &work));
  PetscCall(PetscArrayzero(A, k * k));
  PetscCall(PetscArrayzero(M, k * k));
  for (PetscInt a = 0; a < k && HycoRank(s->comm) == 0; a++)
    M[a * k + a] = 1e-3 * (PetscReal)(s->all + 1) / HycoFEUnknowns(s->fe); /* bodies that move together have no
                                                                              relative displacement */
  for (PetscInt i = 0; i < s->m; i++) {
    const PetscInt t = sense[s->pairs->contact[i]];
    const PetscReal *d = s->d + (size_t)i * (size_t)k * 3;

    /* No master at these positions: the contact resists nothing. */
    if (HycoPairsAlone(s->fe->scene, s->pairs, i)) continue;
    for (PetscInt a = 0; a < k; a++) {
      for (PetscInt b = 0; b < k; b++) {
        const PetscReal both = FreeMotionHasFriction(s, i) ? HycoDot(d + 3 * a, d + 3 * b)
                                                           : HycoDot(s->normal[t] + 3 * i, d + 3 * a) *
                                                                 HycoDot(s->normal[t] + 3 * i, d + 3 * b);

        A[a * k + b] += weight[i] * both / (s->doubt[t][i] * s->doubt[t][i]);
        M[a * k + b] += HycoDot(d + 3 * a, d + 3 * b);
      }
    }
  }
  HycoAllreduce(A, k * k, MPIU_REAL, MPI_SUM, s->comm);
  HycoAllreduce(M, k * k, MPIU_REAL, MPI_SUM, s->comm);
  LAPACKsygv_(&one, "V", "U", &n, A, &n, M, &n, values, work, &lwork, &info);
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK sygv: %d", (int)info);
  PetscCall(PetscFree(work));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the combination z is tangential at every contact; raises the weights of the contacts where it is not. The
   mean over contacts may hide one that resists: each is tested alone, and a violated one counts 100 times more in
   the next round. */
static PetscErrorCode FreeMotionTangential(const Shapes *s, const PetscInt sense[], const PetscReal z[],
                                           PetscReal weight[], PetscBool *tangential)
{
  /* Motions have the length of all unknowns together. */
  const PetscReal noise = 1e-9 / PetscSqrtReal((PetscReal)HycoFEUnknowns(s->fe));
  PetscReal norm = 0;

  PetscFunctionBegin;
  *tangential = PETSC_TRUE;
  for (PetscInt a = 0; a < s->k; a++) norm += z[a] * z[a];
  for (PetscInt i = 0; i < s->m; i++) {
    const PetscInt t = sense[s->pairs->contact[i]];
    PetscReal d[3];

    FreeMotionCombine(s, i, z, d);
    /* Within twice the normal's error, or within what the surface bends between its nodes. */
    if ((FreeMotionHasFriction(s, i) ? HycoLength(d) : PetscAbsReal(HycoDot(s->normal[t] + 3 * i, d))) <=
        (FreeMotionHasFriction(s, i) ? 0 : PetscMax(2 * s->doubt[t][i], s->bend[t][i]) * PetscSqrtReal(HycoDot(d, d))) +
            noise * PetscSqrtReal(norm))
      continue;
    weight[i] *= 100;
    *tangential = PETSC_FALSE;
  }
  HycoAllreduce(tangential, 1, HYCO_MPI_BOOL, MPI_LAND, s->comm);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The combinations that are tangential for these normals: z (room k x k, rows of length 1), *n of them. The subspace
   is at first that of the mean; rounds with raised weights turn it away from contacts that resist. */
static PetscErrorCode FreeMotionNull(const Shapes *s, const PetscInt sense[], PetscReal z[], PetscInt *n)
{
  const PetscInt k = s->k;
  PetscReal *A, *M, *values, *weight;
  PetscBool all = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(PetscMalloc4(k * k, &A, k * k, &M, k, &values, s->m, &weight));
  for (PetscInt i = 0; i < s->m; i++) weight[i] = 1;
  for (PetscInt round = 0; round < 8 && !all; round++) {
    PetscCall(FreeMotionSpectrum(s, sense, weight, A, M, values));
    all = PETSC_TRUE;
    *n = 0;
    /* Ratios of at most 1: on the mean within the normals' errors. */
    for (PetscInt a = 0; a < k && values[a] <= 1; a++) {
      PetscBool good;
      PetscReal norm = 0;

      PetscCall(FreeMotionTangential(s, sense, A + a * k, weight, &good));
      all = (PetscBool)(all && good);
      /* Left out in this round; the raised weights turn the eigenvectors of the next. */
      if (!good) continue;
      for (PetscInt b = 0; b < k; b++) norm += A[a * k + b] * A[a * k + b];
      for (PetscInt b = 0; b < k; b++) z[*n * k + b] = A[a * k + b] / PetscSqrtReal(norm);
      (*n)++;
    }
  }
  PetscCall(PetscFree4(A, M, values, weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds to the orthonormal rows of `basis` the component of row z that is orthogonal to them. */
static void FreeMotionJoin(PetscInt k, const PetscReal z[], PetscReal basis[], PetscInt *n)
{
  PetscReal *v = basis + *n * k, norm = 0;

  /* The whole space is there. */
  if (*n == k) return;
  for (PetscInt a = 0; a < k; a++) v[a] = z[a];
  for (PetscInt b = 0; b < 2 * *n; b++) { /* twice, against round-off */
    const PetscReal *w = basis + b % *n * k;
    PetscReal dot = 0;

    for (PetscInt a = 0; a < k; a++) dot += v[a] * w[a];
    for (PetscInt a = 0; a < k; a++) v[a] -= dot * w[a];
  }
  for (PetscInt a = 0; a < k; a++) norm += v[a] * v[a];
  if (norm < 0.04) return; /* the same motion, within the faceting error */
  for (PetscInt a = 0; a < k; a++) v[a] /= PetscSqrtReal(norm);
  (*n)++;
}

/* Whether all slaves of the contact that face something have a normal in that sense. A surface without facets around
   its nodes has no normal there. Collective. */
static PetscErrorCode HasSense(const Shapes *s, PetscInt contact, PetscInt sense, PetscBool *has)
{
  PetscFunctionBegin;
  *has = PETSC_TRUE;
  for (PetscInt i = 0; i < s->m; i++) {
    const PetscReal *n = s->normal[sense] + 3 * i;

    if (s->pairs->contact[i] != contact || HycoPairsAlone(s->fe->scene, s->pairs, i)) continue;
    /* Vectors are zero where no facet gave a normal. */
    if (!(HycoDot(n, n) > 0)) *has = PETSC_FALSE;
  }
  HycoAllreduce(has, 1, HYCO_MPI_BOOL, MPI_LAND, s->comm);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The normals of choice number `code`; *possible: each contact has them. Collective. With up to three contacts a code
   has one digit (base 3) for each. 3^n combinations are tried, since each contact's better normal is not known. */
static PetscErrorCode FreeMotionSenses(const Shapes *s, PetscInt code, PetscInt sense[], PetscBool *possible)
{
  const PetscBool common = (PetscBool)(s->fe->scene->n_contacts > MOST_CONTACTS); /* as far as available */

  PetscFunctionBegin;
  *possible = PETSC_TRUE;
  for (PetscInt c = 0, rest = code; c < s->fe->scene->n_contacts; c++) {
    PetscBool has, given;

    /* With more contacts all combinations would be too many: one sense for all, where it exists. */
    sense[c] = common ? code : rest % N_SENSES;
    rest /= N_SENSES;
    PetscCall(HasSense(s, c, sense[c], &has));
    if (common && !has) {
      PetscCall(HasSense(s, c, GIVEN, &given));
      sense[c] = given ? GIVEN : SLAVE;
      PetscCall(HasSense(s, c, sense[c], &has));
    }
    *possible = (PetscBool)(*possible && has);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A motion is unconstrained if it is tangential for any choice of normals: an error of the normals must not make a
   motion resisted. alike: the largest space of a single choice, whose motions are free together. */
static PetscErrorCode FreeMotionSearch(const Shapes *s, PetscInt *n_unconstrained, PetscReal unconstrained[],
                                       PetscInt *n_alike, PetscReal alike[])
{
  const PetscInt n_contacts = s->fe->scene->n_contacts, k = s->k;
  PetscInt codes = 1, *sense;
  PetscReal *z;

  PetscFunctionBegin;
  for (PetscInt c = 0; c < PetscMin(n_contacts, n_contacts > MOST_CONTACTS ? 1 : n_contacts); c++) codes *= N_SENSES;
  PetscCall(PetscMalloc2(n_contacts, &sense, k * k, &z));
  for (PetscInt code = 0; code < codes; code++) {
    PetscBool possible;
    PetscInt n = 0, before = 0;

    PetscCall(FreeMotionSenses(s, code, sense, &possible));
    if (!possible) continue;
    PetscCall(FreeMotionNull(s, sense, z, &n));
    /* Kept apart from the union: motions of different choices need not be free together. */
    if (n > *n_alike) {
      *n_alike = 0;
      for (PetscInt a = 0; a < n; a++) FreeMotionJoin(k, z + a * k, alike, n_alike);
    }
    before = *n_unconstrained;
    for (PetscInt a = 0; a < n; a++) FreeMotionJoin(k, z + a * k, unconstrained, n_unconstrained);
    /* No further motion can be found. */
    if (before == k) break;
  }
  PetscCall(PetscFree2(sense, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Component of a combination's rigid motions: first the rotations of each part, then the translations. Columns of
   the elimination in FreeMotionReduce(). */
static PetscReal FreeMotionEntry(const HycoMotions *motions, const PetscReal z[], PetscInt dim, PetscInt column)
{
  const PetscInt k = motions->n, turns = dim == 1 ? 0 : dim == 2 ? 1 : 3;
  const PetscBool turn = (PetscBool)(column < k * turns);
  const PetscInt first = turn ? column / turns : (column - k * turns) / dim; /* the part, through one of its motions */
  const PetscInt at = turn ? dim + column % turns : (column - k * turns) % dim;
  PetscReal sum = 0;

  for (PetscInt a = 0; a < first; a++) {
    /* The columns of a part are taken through its first motion. */
    if (motions->rigid[a].part == motions->rigid[first].part) return 0; /* the column of that motion contains it */
  }
  for (PetscInt a = first; a < k; a++) {
    if (motions->rigid[a].part == motions->rigid[first].part) sum += z[a] * motions->rigid[a].rigid[at];
  }
  return sum;
}

/* Changes the basis of the combinations for their names: with as many pure translations as possible. Gaussian
   elimination, rotations first: what remains after them are translations. */
static void FreeMotionReduce(const HycoMotions *motions, PetscInt dim, PetscInt n, PetscReal z[])
{
  const PetscInt k = motions->n, columns = k * (dim == 1 ? 1 : dim == 2 ? 3 : 6), turns = columns - k * dim;
  PetscReal scale = 0;

  for (PetscInt c = 0; c < columns; c++) {
    for (PetscInt r = 0; r < n; r++) scale = PetscMax(scale, PetscAbsReal(FreeMotionEntry(motions, z + r * k, dim, c)));
  }
  for (PetscInt c = 0, done = 0; c < columns && done < n; c++) {
    PetscInt best = done;

    /* keep the first suitable one */
    while (best < n && PetscAbsReal(FreeMotionEntry(motions, z + best * k, dim, c)) < 1e-3 * scale) best++;
    if (best == n) continue;
    for (PetscInt a = 0; a < k; a++) {
      const PetscReal swap = z[done * k + a];

      z[done * k + a] = z[best * k + a];
      z[best * k + a] = swap;
    }
    for (PetscInt r = c < turns ? 0 : done + 1; r < n; r++) { /* the translation of a rotation gives the position of
                                                                 its axis */
      const PetscReal share =
          FreeMotionEntry(motions, z + r * k, dim, c) / FreeMotionEntry(motions, z + done * k, dim, c);

      for (PetscInt a = 0; a < k && r != done; a++) z[r * k + a] -= share * z[done * k + a];
    }
    done++;
  }
}

/* From the k rigid motions that supports leave, those that frictionless contact does not resist either: coefficients
   (rows of k, orthonormal before FreeMotionReduce()), freed by the caller. wide: a mesh with all facets around the
   nodes of fe's contacts. Collective. */
PetscErrorCode HycoFEFindUnconstrained(MPI_Comm comm, HycoFE fe, HycoFE wide, const PetscInt index[], HycoPairs *pairs,
                                       const HycoMotions *motions, PetscInt *n_unconstrained, PetscReal **unconstrained,
                                       PetscInt *n_alike, PetscReal **alike)
{
  Shapes s = {.comm = comm, .fe = fe, .wide = wide, .index = index, .pairs = pairs, .k = motions->n, .m = pairs->n};
  PetscErrorCode ierr;

  PetscFunctionBegin;
  s.all = s.m;
  HycoAllreduce(&s.all, 1, MPIU_INT, MPI_SUM, comm);
  *n_unconstrained = *n_alike = 0;
  PetscCall(PetscCalloc1((s.k + 1) * s.k, unconstrained));
  PetscCall(PetscCalloc1((s.k + 1) * s.k, alike));
  PetscCall(PetscCalloc1((size_t)s.m * (size_t)s.k * 3, &s.d));
  for (PetscInt t = 0; t < N_SENSES; t++)
    PetscCall(PetscCalloc3(3 * s.m, &s.normal[t], s.m, &s.doubt[t], s.m, &s.bend[t]));
  /* The relative displacement of slave and master by each motion, at each contact. */
  FreeMotionRelative(&s, motions);
  ierr = FindAllSenses(&s);
  if (!ierr) ierr = FreeMotionSearch(&s, n_unconstrained, *unconstrained, n_alike, *alike);
  if (!ierr) FreeMotionReduce(motions, fe->dim, *n_unconstrained, *unconstrained);
  for (PetscInt t = 0; t < N_SENSES; t++) PetscCall(PetscFree3(s.normal[t], s.doubt[t], s.bend[t]));
  PetscCall(PetscFree(s.d));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
