/*
  Training of the condensed model. After the snapshots and the modes: at every combination of values of the parameters
  that reach K or B, one more factorisation gives G = B K^-1 B^T and H = V^T K^-1 B^T (kept beside the snapshots). The
  rest follows from the snapshots without a solve: their gaps D - B U = g + G L, and V^T U = a - H L.
*/
#include <hycocondensed.h>
#include <hycoh5.h>
#include <hycotrainerimpl.h>
#include <string.h>
#include <unistd.h>

/* m^2 numbers a point, and m^3 operations an active set: beyond this it is no model for many predictions. */
#define MOST_CONTACTS 4000
#define MOST_NUMBERS  1e9 /* of G at all nodes: 8 GB */

/* The values of parameter p among the samples, ascending, each once. */
static PetscErrorCode FindValues(HycoCondensed c, PetscInt p, PetscInt n_s, const PetscReal mu[])
{
  PetscInt n = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n_s, &c->x[p]));
  for (PetscInt k = 0; k < n_s; k++) c->x[p][k] = mu[k * c->dim + p];
  PetscCall(PetscSortReal(n_s, c->x[p]));
  for (PetscInt k = 0; k < n_s; k++) {
    if (!n || c->x[p][k] > c->x[p][n - 1]) c->x[p][n++] = c->x[p][k];
  }
  c->n[p] = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The number of a point on the whole grid. */
static PetscInt NodeOf(HycoCondensed c, const PetscReal mu[])
{
  PetscInt node = 0;

  for (PetscInt p = 0; p < c->dim; p++) {
    PetscInt k = 0;

    while (c->x[p][k] != mu[p]) k++;
    node = node * c->n[p] + k;
  }
  return node;
}

/* The samples as a tensor grid: each combination of their values stands among them. */
static PetscErrorCode FindGrid(HycoTrainer t, HycoCondensed c)
{
  const PetscReal *mu;
  PetscInt n_s, nodes = 1;
  PetscReal all = 1;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, &n_s, NULL, &mu));
  for (PetscInt p = 0; p < c->dim; p++) {
    PetscCall(FindValues(c, p, n_s, mu));
    HycoCheck(
        c->n[p] > 1 || t->scene->hi[p] == t->scene->lo[p],
        "the training points have one value of %s, and nothing to interpolate over its range between: a condensed "
        "model needs at least two",
        t->scene->parameter[p]);
    all *= (PetscReal)c->n[p];
  }
  HycoCheck(all <= (PetscReal)n_s,
            "the %d training points are no tensor grid: a condensed model needs every combination of their values (%g "
            "points); give them by -grid or -values_NAME",
            (int)n_s, (double)all);
  for (PetscInt p = 0; p < c->dim; p++) nodes *= c->n[p];
  PetscCall(PetscMalloc1(nodes, &c->sample));
  for (PetscInt k = 0; k < nodes; k++) c->sample[k] = -1;
  for (PetscInt k = 0; k < n_s; k++) c->sample[NodeOf(c, mu + k * c->dim)] = k;
  for (PetscInt k = 0; k < nodes; k++)
    HycoCheck(c->sample[k] >= 0,
              "the %d training points are no tensor grid: a condensed model needs every combination "
              "of their values; give them by -grid or -values_NAME",
              (int)n_s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Which parameters reach K or B. Rank 0. */
static PetscErrorCode FindStiff(HycoTrainer t, HycoCondensed c)
{
  HycoScene s = t->scene;
  PetscReal mu[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  for (PetscInt p = 0; p < c->dim; p++) mu[p] = s->lo[p];
  PetscCall(HycoFESetParameters(t->fe, mu));
  for (PetscInt p = 0; p < c->dim; p++) {
    mu[p] = s->hi[p];
    PetscCall(HycoFESetParameters(t->fe, mu));
    c->stiff[p] = s->hi[p] > s->lo[p] && (t->fe->stiffness_changed || t->fe->contact_changed);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* F and D at mu, one after the other. Rank 0. */
static PetscErrorCode LoadsAndGaps(HycoTrainer t, const PetscReal mu[], PetscReal data[])
{
  const PetscInt m = t->pairs.n, n = t->fe->n_dof, entries = HycoPairsWidth(&t->pairs) * t->fe->dim * m;
  PetscInt *start, *dof;
  PetscReal *value;
  Vec F;

  PetscFunctionBegin;
  PetscCall(HycoFESetParameters(t->fe, mu));
  PetscCall(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, n, data, &F));
  PetscCall(HycoFEAssembleForce(t->fe, F));
  PetscCall(VecDestroy(&F));
  PetscCall(PetscMalloc3(m + 1, &start, entries, &dof, entries, &value));
  PetscCall(HycoContactRows(t->fe, &t->pairs, start, dof, value, data + n));
  PetscCall(PetscFree3(start, dof, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a third value of p gives what two others say of F and of D, the other parameters at a share of their ranges.
 */
static PetscErrorCode AffineAt(HycoTrainer t, PetscInt p, PetscReal share, PetscBool *affine)
{
  static const PetscReal at[3] = {0.06, 0.93, 0.47};
  const PetscInt n = t->fe->n_dof, sizes[2] = {n, t->pairs.n};
  const PetscReal a = (at[1] - at[2]) / (at[1] - at[0]);
  HycoScene s = t->scene;
  PetscReal mu[HYCO_MAX_PARAMETERS], *v[3];

  PetscFunctionBegin;
  for (PetscInt q = 0; q < s->n_parameters; q++) mu[q] = s->lo[q] + share * (s->hi[q] - s->lo[q]);
  for (PetscInt k = 0; k < 3; k++) {
    mu[p] = s->lo[p] + at[k] * (s->hi[p] - s->lo[p]);
    PetscCall(PetscMalloc1(n + t->pairs.n, &v[k]));
    PetscCall(LoadsAndGaps(t, mu, v[k]));
  }
  for (PetscInt part = 0, i = 0; part < 2; part++) {
    PetscReal lost = 0, size = 0;

    for (PetscInt end = i + sizes[part]; i < end; i++) {
      lost = PetscMax(lost, PetscAbsReal(a * v[0][i] + (1 - a) * v[1][i] - v[2][i]));
      size = PetscMax(size, PetscMax(PetscAbsReal(v[0][i]), PetscAbsReal(v[1][i])));
    }
    *affine = (PetscBool)(*affine && lost <= 1e-12 * size);
  }
  for (PetscInt k = 0; k < 3; k++) PetscCall(PetscFree(v[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Which parameters reach what; that the scene is one for this model. Rank 0. */
static PetscErrorCode Inspect(HycoTrainer t, HycoCondensed c)
{
  HycoMotions motions;
  PetscInt free;
  char name[HYCO_LINE];

  PetscFunctionBegin;
  PetscCall(FindStiff(t, c));
  for (PetscInt p = 0; p < c->dim; p++) {
    PetscBool affine = (PetscBool)!c->stiff[p];

    for (PetscInt k = 0; affine && k < 2; k++) PetscCall(AffineAt(t, p, k ? 0.71 : 0.38, &affine));
    c->affine[p] = affine;
  }
  PetscCall(HycoFEFreeMotions(t->fe, &motions));
  free = motions.n;
  if (free) PetscCall(PetscStrncpy(name, motions.name[0], sizeof(name)));
  PetscCall(HycoMotionsDestroy(&motions));
  HycoCheck(!free,
            "no support keeps %s: contact alone holds it, K^-1 does not exist and no condensed model with it; "
            "train a hybrid one",
            name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTrainerBeginCondensed(HycoTrainer t)
{
  HycoCondensed c;
  const PetscInt m = t->sizes[2];
  PetscInt linear = HYCO_LINEAR_AUTO;

  PetscFunctionBegin;
  PetscCall(HycoOptionsWord(t->scene->options, "hyco_linear", HycoLinearNames, &linear));
  HycoCheck(linear != HYCO_LINEAR_ITERATIVE,
            "-hyco_linear iterative makes no factor of the stiffness, and a condensed model needs one; train a hybrid "
            "model, or take -hyco_linear auto");
  HycoCheck(m > 0, "the scene has no contact, and a condensed model is one of contact forces; train a hybrid model");
  HycoCheck(m <= MOST_CONTACTS,
            "the scene has %d contacts: a condensed model stores the square of their number at every training point, "
            "and goes to %d; train a hybrid model",
            (int)m, MOST_CONTACTS);
  PetscCall(HycoCondensedDestroy(&t->condensed));
  PetscCall(HycoCondensedCreate(t->scene->n_parameters, m, 0, &c));
  t->condensed = c;
  PetscCall(FindGrid(t, c));
  HycoOnRoot(t->comm, Inspect(t, c));
  PetscCallMPI(MPI_Bcast(c->stiff, HYCO_MAX_PARAMETERS, MPIU_INT, 0, t->comm));
  PetscCallMPI(MPI_Bcast(c->affine, HYCO_MAX_PARAMETERS, MPIU_INT, 0, t->comm));
  PetscCall(HycoCondensedAllocate(c));
  HycoCheck((PetscReal)c->field[HYCO_FIELD_G].rows * (PetscReal)HycoTensorSize(&c->field[HYCO_FIELD_G].tensor) <=
                MOST_NUMBERS,
            "the flexibility of %d contacts at %d training points has more than %g numbers; take fewer values of the "
            "parameters that reach the stiffness, or train a hybrid model",
            (int)m, (int)HycoTensorSize(&c->field[HYCO_FIELD_G].tensor), MOST_NUMBERS);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The parameters of node k of G's grid (the first training value where G does not depend on one), and of the file. */
static void StiffPoint(HycoCondensed c, PetscInt k, PetscReal mu[], PetscReal key[])
{
  const HycoTensor *t = &c->field[HYCO_FIELD_G].tensor;

  for (PetscInt p = c->dim - 1; p >= 0; p--) {
    mu[p] = c->x[p][k % t->n[p]];
    key[p] = c->stiff[p] ? mu[p] : 0;
    k /= t->n[p];
  }
}

/* Where G (of the stiffness) and H (of the modes too) of node k are kept. */
static PetscErrorCode Paths(HycoTrainer t, HycoSnapshots store, PetscInt k, const PetscReal V[],
                            char G[PETSC_MAX_PATH_LEN], char H[PETSC_MAX_PATH_LEN])
{
  HycoCondensed c = t->condensed;
  PetscReal mu[HYCO_MAX_PARAMETERS], key[HYCO_MAX_PARAMETERS];
  unsigned long long hash;

  PetscFunctionBegin;
  StiffPoint(c, k, mu, key);
  hash = HycoHash(HYCO_HASH_START, key, (size_t)c->dim * sizeof(PetscReal));
  PetscCall(PetscSNPrintf(G, PETSC_MAX_PATH_LEN, "%s/flexibility-%016llx.h5", store->folder, hash));
  hash = HycoHash(hash, V, (size_t)(t->sizes[0] * t->sizes[3]) * (size_t)c->l * sizeof(PetscReal));
  PetscCall(PetscSNPrintf(H, PETSC_MAX_PATH_LEN, "%s/modes-%016llx.h5", store->folder, hash));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode WriteOne(HycoSnapshots store, const char path[], const char name[], PetscInt rows, PetscInt cols,
                               const PetscReal data[])
{
  char fingerprint[32];
  HycoH5 h;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  snprintf(fingerprint, sizeof(fingerprint), "%016llx", store->fingerprint);
  PetscCall(HycoH5Create(path, &h));
  ierr = HycoH5WriteText(h, "fingerprint", fingerprint);
  if (!ierr) ierr = HycoH5WriteReal(h, name, rows, cols, data);
  PetscCall(HycoH5Close(&h, (PetscBool)!ierr));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadOpen(HycoSnapshots store, HycoH5 h, const char path[], const char name[], PetscInt rows,
                               PetscInt cols, PetscReal data[])
{
  char mine[32], *text;
  PetscBool same;

  PetscFunctionBegin;
  snprintf(mine, sizeof(mine), "%016llx", store->fingerprint);
  PetscCall(HycoH5LoadText(h, "fingerprint", &text));
  same = (PetscBool)(strcmp(text, mine) == 0);
  PetscCall(PetscFree(text));
  HycoCheck(same, "%s is of another scene or mesh; remove the folder %s, or name another with -hyco_snapshots", path,
            store->folder);
  if (data) PetscCall(HycoH5ReadReal(h, name, rows, cols, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadOne(HycoSnapshots store, const char path[], const char name[], PetscInt rows, PetscInt cols,
                              PetscReal data[])
{
  HycoH5 h;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoH5OpenOr(path, "remove it and run again", &h));
  ierr = ReadOpen(store, h, path, name, rows, cols, data);
  PetscCall(HycoH5Close(&h, PETSC_FALSE));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* missing[]: the nodes of G's grid without both files. Rank 0. */
static PetscErrorCode FindMissing(HycoTrainer t, HycoSnapshots store, PetscInt *n_missing, PetscInt missing[])
{
  const PetscInt n = HycoTensorSize(&t->condensed->field[HYCO_FIELD_G].tensor);
  char G[PETSC_MAX_PATH_LEN], H[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  *n_missing = 0;
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(Paths(t, store, k, t->V_whole, G, H));
    if (access(G, F_OK) || (t->condensed->l && access(H, F_OK))) {
      missing[(*n_missing)++] = k;
      continue;
    }
    PetscCall(ReadOne(store, G, "G", 0, 0, NULL));
    if (t->condensed->l) PetscCall(ReadOne(store, H, "H", 0, 0, NULL));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode WriteBoth(HycoTrainer t, HycoSnapshots store, PetscInt k, const PetscReal V[],
                                const PetscReal G[], const PetscReal H[])
{
  char path[2][PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(Paths(t, store, k, V, path[0], path[1]));
  PetscCall(WriteOne(store, path[0], "G", t->condensed->field[HYCO_FIELD_G].rows, 1, G));
  if (t->condensed->l) PetscCall(WriteOne(store, path[1], "H", t->condensed->l, t->condensed->m, H));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Factors at one node of G's grid, and writes. G, H: room for them. */
static PetscErrorCode FactorOne(HycoTrainer t, HycoSnapshots store, MPI_Comm group, HycoFOM fom, PetscInt node,
                                const PetscReal V[], PetscReal G[], PetscReal H[])
{
  PetscReal mu[HYCO_MAX_PARAMETERS], key[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  StiffPoint(t->condensed, node, mu, key);
  PetscCall(HycoFOMFlexibility(fom, mu, t->condensed->l, V, G, H));
  HycoOnRoot(group, WriteBoth(t, store, node, V, G, H));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* This rank's group factors at its run of the missing nodes. V on every rank. */
static PetscErrorCode FactorGroup(HycoTrainer t, HycoSnapshots store, MPI_Comm group, PetscInt color, PetscInt groups,
                                  PetscInt n_missing, const PetscInt missing[], const PetscReal V[])
{
  HycoCondensed c = t->condensed;
  HycoFOM fom;
  PetscReal *G, *H;
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  PetscCall(HycoFOMCreate(group, t->scene, &fom));
  PetscCall(PetscMalloc2(c->field[HYCO_FIELD_G].rows, &G, c->l * c->m, &H));
  for (PetscInt k = color * n_missing / groups; !ierr && k < (color + 1) * n_missing / groups; k++)
    ierr = FactorOne(t, store, group, fom, missing[k], V, G, H);
  PetscCall(PetscFree2(G, H));
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* G and H at all nodes, from the files. Rank 0. */
static PetscErrorCode ReadFields(HycoTrainer t, HycoSnapshots store)
{
  HycoGridField *G = &t->condensed->field[HYCO_FIELD_G], *H = &t->condensed->field[HYCO_FIELD_H];
  const PetscInt n = HycoTensorSize(&G->tensor);
  char path[2][PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(PetscFree(G->data));
  PetscCall(PetscFree(H->data));
  PetscCall(PetscMalloc1((size_t)G->rows * (size_t)n, &G->data));
  PetscCall(PetscMalloc1((size_t)H->rows * (size_t)n, &H->data));
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(Paths(t, store, k, t->V_whole, path[0], path[1]));
    PetscCall(ReadOne(store, path[0], "G", G->rows, 1, G->data + (size_t)k * (size_t)G->rows));
    if (H->rows)
      PetscCall(ReadOne(store, path[1], "H", t->condensed->l, t->condensed->m, H->data + (size_t)k * (size_t)H->rows));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTrainerFlexibility(HycoTrainer t, HycoSnapshots store, PetscBool modes)
{
  HycoCondensed c = t->condensed;
  const PetscInt l = modes ? t->l : 0, N = t->sizes[0] * t->sizes[3] * l;
  PetscInt n_missing = 0, *missing, groups = 1, color;
  PetscMPIInt size;
  PetscReal *V;
  MPI_Comm group;

  PetscFunctionBegin;
  c->l = l;
  PetscCall(HycoCondensedAllocate(c));
  PetscCallMPI(MPI_Comm_size(t->comm, &size));
  PetscCall(PetscMalloc1(HycoTensorSize(&c->field[HYCO_FIELD_G].tensor), &missing));
  HycoOnRoot(t->comm, FindMissing(t, store, &n_missing, missing));
  PetscCallMPI(MPI_Bcast(&n_missing, 1, MPIU_INT, 0, t->comm));
  PetscCallMPI(MPI_Bcast(missing, (PetscMPIInt)n_missing, MPIU_INT, 0, t->comm));
  if (n_missing) {
    PetscCall(PetscMalloc1(N, &V));
    if (t->rank == 0) PetscCall(PetscArraycpy(V, t->V_whole, N)); /* l is t->l or 0 */
    PetscCallMPI(MPI_Bcast(V, (PetscMPIInt)N, MPIU_REAL, 0, t->comm));
    PetscCall(HycoSnapshotsChooseGroups(t->comm, t->scene, n_missing, &groups));
    color = (PetscInt)t->rank * groups / size;
    PetscCallMPI(MPI_Comm_split(t->comm, (PetscMPIInt)color, t->rank, &group));
    HycoOnEach(t->comm, FactorGroup(t, store, group, color, groups, n_missing, missing, V));
    PetscCallMPI(MPI_Comm_free(&group));
    PetscCall(PetscFree(V));
  }
  PetscCall(PetscFree(missing));
  HycoOnRoot(t->comm, ReadFields(t, store));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The node of a field's grid that node k of the whole grid lies on. */
static PetscInt Restrict(HycoCondensed c, const HycoGridField *f, PetscInt k)
{
  PetscInt index[HYCO_MAX_PARAMETERS], node = 0;

  for (PetscInt p = c->dim - 1; p >= 0; p--) {
    index[p] = k % c->n[p];
    k /= c->n[p];
  }
  for (PetscInt p = 0; p < c->dim; p++) node = node * f->tensor.n[p] + (f->tensor.n[p] > 1 ? index[p] : 0);
  return node;
}

/* g = D - B U - G L of one snapshot. */
static PetscErrorCode FreeGap(HycoTrainer t, const PetscReal mu[], const PetscReal U[], const PetscReal L[],
                              const PetscReal packed[], PetscReal g[])
{
  const PetscInt m = t->pairs.n, entries = HycoPairsWidth(&t->pairs) * t->fe->dim * m;
  PetscInt *start, *dof;
  PetscReal *value;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(m + 1, &start, entries, &dof, entries, &value));
  PetscCall(HycoFESetParameters(t->fe, mu));
  PetscCall(HycoContactRows(t->fe, &t->pairs, start, dof, value, g));
  for (PetscInt k = 0; k < m; k++) {
    for (PetscInt j = start[k]; j < start[k + 1]; j++) g[k] -= value[j] * U[dof[j]];
  }
  for (PetscInt j = 0; j < m; j++) {
    g[j] -= packed[0] * L[j];
    for (PetscInt i = j + 1; i < m; i++) {
      g[i] -= packed[i - j] * L[j];
      g[j] -= packed[i - j] * L[i];
    }
    packed += m - j;
  }
  PetscCall(PetscFree3(start, dof, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* g, a and the training forces at the nodes of the whole grid. */
static PetscErrorCode FromSnapshots(HycoTrainer t, HycoCondensed c)
{
  HycoGridField *gap = &c->field[HYCO_FIELD_GAP], *unloaded = &c->field[HYCO_FIELD_FREE];
  const HycoGridField *G = &c->field[HYCO_FIELD_G], *H = &c->field[HYCO_FIELD_H];
  const PetscInt n = HycoTensorSize(&gap->tensor), m = c->m, l = c->l;
  const size_t n_dof = (size_t)(t->sizes[0] * t->sizes[3]);
  const PetscReal *mu;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, NULL, NULL, &mu));
  PetscCall(PetscFree(gap->data));
  PetscCall(PetscFree(unloaded->data));
  PetscCall(PetscFree(c->Lambda));
  PetscCall(PetscMalloc1(m * n, &gap->data));
  PetscCall(PetscMalloc1(l * n, &unloaded->data));
  PetscCall(PetscMalloc1(m * n, &c->Lambda));
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt s = c->sample[k], node = Restrict(c, G, k);
    const PetscReal *L = t->Lambda + (size_t)s * (size_t)m, *h = H->data + (size_t)node * (size_t)H->rows;

    PetscCall(PetscArraycpy(c->Lambda + k * m, L, m));
    PetscCall(FreeGap(t, mu + s * c->dim, t->U + (size_t)s * n_dof, L, G->data + (size_t)node * (size_t)G->rows,
                      gap->data + k * m));
    for (PetscInt j = 0; j < l; j++) {
      unloaded->data[k * l + j] = t->VtU[s * t->l + j];
      for (PetscInt i = 0; i < m; i++) unloaded->data[k * l + j] += h[j * m + i] * L[i];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Degrees by leaving values out, one where the data are affine; errors of G and g, added up over the parameters. */
static PetscErrorCode ChooseDegrees(HycoCondensed c)
{
  PetscFunctionBegin;
  PetscCall(PetscArrayzero(c->errors, 3));
  for (PetscInt f = 0; f < HYCO_N_FIELDS; f++) {
    HycoGridField *field = &c->field[f];

    for (PetscInt p = 0; p < c->dim; p++) {
      PetscReal error = 0;

      if (c->affine[p])
        field->tensor.degree[p] = PetscMin(1, field->tensor.n[p] - 1);
      else
        PetscCall(HycoTensorChooseDegree(&field->tensor, p, field->rows, field->data, &error));
      if (f <= HYCO_FIELD_GAP) c->errors[f] += error;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The forces at node k of the whole grid (value number i of parameter p) without the nodes with that value. */
static PetscErrorCode LeaveOut(HycoCondensed c, PetscInt p, PetscInt i, PetscInt k, const PetscReal mu[],
                               PetscReal largest, PetscInt *last, PetscBool *definite, PetscReal L[], PetscReal *error)
{
  const PetscReal *own = c->Lambda + k * c->m;
  const PetscInt node = Restrict(c, &c->field[HYCO_FIELD_G], k);
  PetscReal lost = 0, size = 0;
  PetscInt its;
  HycoLCPStatus status = HYCO_LCP_RAY;

  PetscFunctionBegin;
  if (node != *last || c->stiff[p])
    PetscCall(HycoCondensedFlexibility(c, mu, c->stiff[p] ? p : -1, c->stiff[p] ? i : -1, definite));
  *last = node;
  PetscCall(HycoGridFieldEvaluate(&c->field[HYCO_FIELD_GAP], mu, p, i, c->g));
  for (PetscInt j = 0; j < c->m; j++) c->active[j] = (PetscBool)(own[j] > 0);
  if (*definite)
    PetscCall(
        HycoLCPActiveSet(c->m, c->M, c->g, c->set_factor, 50 + 4 * c->m, NULL, NULL, c->active, L, &its, &status));
  for (PetscInt j = 0; j < c->m; j++) {
    lost += (L[j] - own[j]) * (L[j] - own[j]);
    size += own[j] * own[j];
  }
  *error = status == HYCO_LCP_SOLVED ? PetscSqrtReal(lost) / PetscMax(PetscSqrtReal(size), 1e-2 * largest) : 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each value of each parameter that is not affine left out: the largest error of the forces there, added up over the
   parameters; relative to the point's own force, or a hundredth of the largest. */
static PetscErrorCode ForceError(HycoTrainer t, HycoCondensed c)
{
  const PetscInt n = HycoTensorSize(&c->field[HYCO_FIELD_GAP].tensor);
  const PetscReal *mu;
  PetscReal *L, largest = 0;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, NULL, NULL, &mu));
  PetscCall(HycoCondensedPrepare(c));
  PetscCall(PetscCalloc1(c->m, &L));
  for (PetscInt k = 0; k < n; k++) {
    PetscReal size = 0;

    for (PetscInt j = 0; j < c->m; j++) size += c->Lambda[k * c->m + j] * c->Lambda[k * c->m + j];
    largest = PetscMax(largest, PetscSqrtReal(size));
  }
  for (PetscInt p = 0, stride = n; p < c->dim; p++) {
    PetscReal worst = 0, error = 0;
    PetscInt last = -1;
    PetscBool definite = PETSC_FALSE;

    stride /= c->n[p];
    for (PetscInt k = 0; largest > 0 && !c->affine[p] && c->n[p] > 1 && k < n; k++) {
      PetscCall(
          LeaveOut(c, p, k / stride % c->n[p], k, mu + c->sample[k] * c->dim, largest, &last, &definite, L, &error));
      worst = PetscMax(worst, error);
    }
    c->by_parameter[p] = worst;
    c->errors[2] += worst;
  }
  PetscCall(PetscFree(L));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTrainerFillFields(HycoTrainer t)
{
  PetscFunctionBegin;
  PetscCall(FromSnapshots(t, t->condensed));
  PetscCall(ChooseDegrees(t->condensed));
  PetscCall(HycoCondensedBound(t->condensed));
  PetscCall(ForceError(t, t->condensed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoTrainerCondense(HycoTrainer t, HycoModel m)
{
  HycoCondensed c = t->condensed;

  PetscFunctionBegin;
  PetscCall(HycoTrainerFillFields(t));
  m->condensed = c;
  t->condensed = NULL;
  m->n_dual = 0; /* nothing is reconstructed */
  for (PetscInt k = 0; k < m->pairs.n; k++) m->in_rid[k] = 1;
  PetscCall(HycoModelSetFE(m, HYCO_HYBRID_CONTACT, 0, NULL));
  PetscCall(HycoTrainerJudge(t, m));
  PetscFunctionReturn(PETSC_SUCCESS);
}
