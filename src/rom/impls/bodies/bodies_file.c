/* The part of the model of bodies in the model file. */
#include <hycobodies.h>

/* Sizes, by body. Lengths of all other datasets follow from these, which is why they are read and checked first. */
static PetscErrorCode MoveSizes(HycoH5 h, HycoROM m, HycoSubstructures b)
{
  PetscInt head[5] = {b->n, b->p, b->r, b->n_turns, b->n_theta};

  PetscFunctionBegin;
  PetscCall(HycoH5Ints(h, "bodies/head", 0, PETSC_MAX_INT, 5, head));
  b->n = head[0];
  b->p = head[1];
  b->r = head[2];
  b->n_turns = head[3];
  b->n_theta = head[4];
  b->dim = m->model->mesh->dim;
  b->l = m->model->l;
  b->n_variables = m->model->scene->n_variables;
  /* Checked before the loops over theta: a damaged file must not index beyond the tensors' fixed arrays. */
  HycoCheck(b->n > 0 && b->n_theta <= HYCO_TENSOR_MAX_DIM, "%s: bodies/head is damaged", m->model->path);
  PetscCall(HycoH5Starts(h, "bodies/start", b->n, &b->start));
  PetscCall(HycoH5Starts(h, "bodies/inner_start", b->n, &b->inner_start));
  PetscCall(HycoH5Starts(h, "bodies/mode_start", b->n, &b->mode_start));
  PetscCall(HycoH5Starts(h, "bodies/turn_start", b->n, &b->turn_start));
  b->ns = b->start[b->n];
  b->ni = b->inner_start[b->n];
  HycoCheck(b->mode_start[b->n] == b->l && b->turn_start[b->n] == b->n_turns, "%s: the sizes of bodies/ are damaged",
            m->model->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* theta, its values, and which bodies they change. */
static PetscErrorCode MoveTheta(HycoH5 h, HycoROM m, HycoSubstructures b)
{
  PetscInt nodes = 0, *axes, n;

  PetscFunctionBegin;
  PetscCall(HycoH5Reals(h, "bodies/bound", 1, &b->bound));
  PetscCall(HycoH5Reals(h, "bodies/forces", 1, &b->forces));
  PetscCall(HycoH5Reals(h, "bodies/left", 1, &b->left));
  /* One code for both directions: written from, or read into, the same fields. */
  if (HycoH5Reads(h)) PetscCall(PetscCalloc1(b->n, &b->body));
  PetscCall(HycoH5Int(h, "bodies/theta", 0, m->model->scene->n_parameters - 1, &b->n_theta, 1, &b->theta));
  PetscCall(HycoH5Int(h, "bodies/logarithm", 0, HYCO_BODIES_VARIABLES - 1, &b->n_theta, 1, &b->variable));
  PetscCall(HycoH5Int(h, "bodies/n_nodes", 1, PETSC_MAX_INT / 64, &b->n_theta, 1, &b->n_nodes));
  for (PetscInt p = 0; p < b->n_theta; p++) nodes += b->n_nodes[p];
  PetscCall(HycoH5Real(h, "bodies/node", &nodes, 1, &b->node));
  /* Which bodies have an axis is not stored as tensors but as flags, from which their sizes follow. */
  n = b->n * b->n_theta;
  PetscCall(PetscCalloc1(n + 1, &axes));
  for (PetscInt i = 0; i < n && !HycoH5Reads(h); i++) axes[i] = b->body[i / b->n_theta].tensor.n[i % b->n_theta] > 1;
  PetscCall(HycoH5Ints(h, "bodies/axes", 0, 1, n, axes));
  for (PetscInt i = 0; i < n && HycoH5Reads(h); i++)
    b->body[i / b->n_theta].tensor.n[i % b->n_theta] = axes[i] ? b->n_nodes[i % b->n_theta] : 1;
  PetscCall(PetscFree(axes));
  for (PetscInt p = 0, k = 0; p < b->n_theta; k += b->n_nodes[p++]) {
    for (PetscInt i = 1; i < b->n_nodes[p]; i++)
      HycoCheck(b->node[k + i] > b->node[k + i - 1], "%s: bodies/node is damaged", m->model->path);
  }
  HycoBodiesSetTensors(b);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where and how stiff the bodies are, and their loads. */
static PetscErrorCode MoveProbe(HycoH5 h, HycoROM m, HycoSubstructures b)
{
  PetscFunctionBegin;
  PetscCall(HycoMeshMove(h, "bodies/mesh", m->model->scene->n_bodies, &b->probe));
  /* Ties are not stored with the probe's mesh: they are those of the model's. */
  if (HycoH5Reads(h)) PetscCall(HycoMeshSetTies(b->probe, m->model->mesh->ties));
  if (HycoH5Reads(h)) PetscCall(HycoMeshCreateDM(m->model->scene, b->probe));
  PetscCall(HycoH5Int(h, "bodies/cell", 0, b->probe->n_cells - 1, &b->n, 1, &b->cell));
  PetscCall(HycoH5Real(h, "bodies/first", &b->n_variables, 1, &b->first));
  PetscCall(HycoH5Int(h, "bodies/at", 0, b->probe->n_nodes * b->dim - 1, &b->r, 1, &b->at));
  PetscCall(HycoH5Int(h, "bodies/at_body", 0, b->n - 1, &b->r, 1, &b->at_body));
  PetscCall(HycoH5Real(h, "bodies/A", &b->r, b->r, &b->A));
  PetscCall(HycoH5Int(h, "bodies/dof", 0, m->model->whole_nodes * b->dim - 1, &b->ns, 1, &b->dof));
  PetscCall(HycoH5Int(h, "bodies/inner", 0, m->model->whole_nodes * b->dim - 1, &b->ni, 1, &b->inner));
  PetscCall(HycoH5Real(h, "bodies/G", &b->n_turns, 9, &b->G));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One path of a dataset at a time: `path` is overwritten by the next call. */
static const char *BodiesFileEntry(PetscInt k, const char name[], char path[64])
{
  (void)snprintf(path, 64, "bodies/body_%d/%s", (int)k, name);
  return path;
}

/* A part of a dataset's name after the first. */
static const char *AtPart(PetscInt k, const char name[], const char part[], char path[64])
{
  (void)snprintf(path, 64, "bodies/body_%d/%s_%s", (int)k, name, part);
  return path;
}

/* The entries of a term that a file has, by columns: of a symmetric matrix the lower triangle. */
static PetscInt BodiesFileEntries(const HycoFlexibility *C, PetscBool symmetric)
{
  return symmetric ? C->n * (C->n + 1) / 2 : C->rows * C->n;
}
#define EACH_ENTRY(C, symmetric, k, i, u)                                                                              \
  for (PetscInt u = 0, k = 0; u < (C)->n; u++)                                                                         \
    for (PetscInt i = (symmetric) ? u : 0; i < (C)->rows; i++, k++)

/* Terms [first, last), a row each. */
static PetscErrorCode ReadTerms(HycoH5 h, const char model[], const char path[], PetscBool symmetric,
                                HycoFlexibility *C, PetscInt first, PetscInt last)
{
  const PetscInt length = BodiesFileEntries(C, symmetric);
  PetscReal *row;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(length + 1, &row));
  for (PetscInt t = first; t < last; t++) {
    PetscCall(HycoH5ReadRows(h, path, t - first, 1, length, row));
    for (PetscInt k = 0; k < length; k++)
      HycoCheck(!PetscIsInfOrNanReal(row[k]), "%s: %s contains a value that is not finite: the file is damaged", model,
                path);
    EACH_ENTRY(C, symmetric, k, i, u)
    {
      HycoFlexibilitySetEntry(C, t, u, i, row[k]);
      /* Both triangles in memory: predictions read whole columns. */
      if (symmetric) HycoFlexibilitySetEntry(C, t, i, u, row[k]);
    }
  }
  PetscCall(PetscFree(row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Terms in double precision. */
static PetscErrorCode WriteTerms(HycoH5 h, const char path[], PetscBool symmetric, const HycoFlexibility *C)
{
  const size_t length = (size_t)BodiesFileEntries(C, symmetric);
  PetscReal *wide;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(length * (size_t)C->n_wide + 1, &wide));
  for (PetscInt t = 0; t < C->n_wide; t++) EACH_ENTRY(C, symmetric, k, i, u)
  wide[(size_t)t * length + (size_t)k] = HycoFlexibilityEntry(C, t, u, i);
  PetscCall(HycoH5WriteReal(h, path, C->n_wide, (PetscInt)length, wide));
  PetscCall(PetscFree(wide));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Terms in single precision apart, as float in the file too: most of a model's size is theirs, and a double would
   not make them more accurate. */
static PetscErrorCode WriteShortTerms(HycoH5 h, const char path[], PetscBool symmetric, const HycoFlexibility *C)
{
  const size_t length = (size_t)BodiesFileEntries(C, symmetric);
  const PetscInt terms = C->n_terms - C->n_wide;
  float *narrow;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(length * (size_t)terms + 1, &narrow));
  for (PetscInt t = 0; t < terms; t++) EACH_ENTRY(C, symmetric, k, i, u)
  narrow[(size_t)t * length + (size_t)k] = (float)HycoFlexibilityEntry(C, C->n_wide + t, u, i);
  if (terms) PetscCall(HycoH5WriteSingle(h, path, terms, (PetscInt)length, narrow));
  PetscCall(PetscFree(narrow));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A matrix of body k from its samples, one after the other and each by columns. */
static PetscErrorCode TakeSamples(const HycoSubstructure *s, PetscInt rows, PetscInt n, const PetscReal data[],
                                  HycoFlexibility *C)
{
  const PetscReal **sample;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(s->n_samples, &sample));
  for (PetscInt k = 0; k < s->n_samples; k++) sample[k] = data + (size_t)k * (size_t)rows * (size_t)n;
  PetscCall(HycoFlexibilityCreate(&s->tensor, rows, n, sample, NULL, 0, 0, C));
  PetscCall(PetscFree(sample));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* C, H or a of body k, whose sizes are there. */
static PetscErrorCode MoveFlexibility(HycoH5 h, const char model[], const HycoSubstructure *s, PetscInt k,
                                      const char name[], PetscBool symmetric, HycoFlexibility *C)
{
  PetscInt head[2] = {C->n_terms, C->n_wide};
  char path[64];

  PetscFunctionBegin;
  PetscCall(HycoH5Ints(h, AtPart(k, name, "head", path), 1, s->n_samples, 2, head));
  C->n_terms = head[0];
  /* A damaged number would be a length of an array below. */
  C->n_wide = PetscMin(head[1], head[0]);
  PetscCall(HycoH5Int(h, AtPart(k, name, "terms", path), 0, s->n_samples - 1, &C->n_terms, 1, &C->term));
  if (!HycoH5Reads(h)) {
    PetscCall(WriteTerms(h, BodiesFileEntry(k, name, path), symmetric, C));
    PetscCall(WriteShortTerms(h, AtPart(k, name, "single", path), symmetric, C));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoFlexibilityTakePolynomials(C, &s->tensor));
  PetscCall(HycoFlexibilityAllocate(C));
  /* A body without a surface that may touch, or without modes: the datasets have no rows. */
  if (!C->n || !C->rows) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ReadTerms(h, model, BodiesFileEntry(k, name, path), symmetric, C, 0, C->n_wide));
  PetscCall(ReadTerms(h, model, AtPart(k, name, "single", path), symmetric, C, C->n_wide, C->n_terms));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* C as its samples, as in files of earlier versions. */
static PetscErrorCode LoadSamples(HycoH5 h, const char path[], HycoSubstructure *s)
{
  PetscInt rows = s->n_samples * s->n;
  PetscReal *file = NULL;

  PetscFunctionBegin;
  PetscCall(HycoH5Real(h, path, &rows, s->n, &file));
  PetscCall(TakeSamples(s, s->n, s->n, file, &s->C));
  PetscCall(PetscFree(file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* H as its samples, a column each of their rows, or, in the oldest files, its transpose. */
static PetscErrorCode LoadResponses(HycoH5 h, HycoSubstructure *s, PetscInt k, PetscInt rows)
{
  const size_t size = (size_t)s->n_samples * (size_t)s->n * (size_t)rows;
  PetscInt old = s->n_samples * rows, columns = s->n_samples * s->n;
  PetscReal *file = NULL, *swapped;
  char path[64];

  PetscFunctionBegin;
  if (!HycoH5Has(h, BodiesFileEntry(k, "H", path))) {
    PetscCall(HycoH5Real(h, BodiesFileEntry(k, "responses", path), &columns, rows, &file));
    PetscCall(TakeSamples(s, rows, s->n, file, &s->H));
    PetscCall(PetscFree(file));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoH5Real(h, path, &old, s->n, &file));
  PetscCall(PetscMalloc1(size + 1, &swapped));
  for (PetscInt i = 0; i < old; i++) {
    for (PetscInt j = 0; j < s->n; j++)
      swapped[((size_t)(i / rows) * (size_t)s->n + (size_t)j) * (size_t)rows + (size_t)(i % rows)] =
          file[(size_t)i * (size_t)s->n + (size_t)j];
  }
  PetscCall(TakeSamples(s, rows, s->n, swapped, &s->H));
  HycoFreeAll(&swapped, &file);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* a of files of earlier versions: the loads and the motions apart, samples by rows. */
static PetscErrorCode LoadResponsesToLoads(HycoH5 h, HycoSubstructures b, PetscInt k, PetscInt rows)
{
  HycoSubstructure *s = &b->body[k];
  const PetscInt n = b->r + b->p;
  PetscInt all = s->n_samples * rows;
  PetscReal *a = NULL, *g = NULL, *data;
  char path[64];

  PetscFunctionBegin;
  PetscCall(HycoH5Real(h, BodiesFileEntry(k, "a", path), &all, b->r, &a));
  PetscCall(HycoH5Real(h, BodiesFileEntry(k, "g", path), &all, b->p, &g));
  PetscCall(PetscMalloc1((size_t)all * (size_t)n + 1, &data));
  for (PetscInt i = 0; i < all; i++) {
    PetscReal *row = data + (size_t)(i / rows) * (size_t)(n * rows) + i % rows;

    for (PetscInt d = 0; d < n; d++) row[d * rows] = d < b->r ? a[i * b->r + d] : g[i * b->p + d - b->r];
  }
  PetscCall(TakeSamples(s, rows, n, data, &s->a));
  HycoFreeAll(&a, &g, &data);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* C, H and a of body k. */
static PetscErrorCode MoveMatrices(HycoH5 h, const char model[], HycoSubstructures b, PetscInt k)
{
  HycoSubstructure *s = &b->body[k];
  const PetscInt rows = (b->turn_start[k + 1] - b->turn_start[k]) * s->l + s->m;
  char path[64];

  PetscFunctionBegin;
  s->C.rows = s->C.n = s->H.n = s->n;
  s->H.rows = s->a.rows = rows;
  s->a.n = b->r + b->p;
  if (HycoH5Reads(h) && HycoH5Has(h, BodiesFileEntry(k, "C", path)))
    PetscCall(LoadSamples(h, path, s));
  else
    PetscCall(MoveFlexibility(h, model, s, k, "flexibility", PETSC_TRUE, &s->C));
  if (HycoH5Reads(h) && HycoH5Has(h, BodiesFileEntry(k, "a", path))) {
    PetscCall(LoadResponses(h, s, k, rows));
    PetscCall(LoadResponsesToLoads(h, b, k, rows));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MoveFlexibility(h, model, s, k, "displacements", PETSC_FALSE, &s->H));
  PetscCall(MoveFlexibility(h, model, s, k, "displacements_of_loads", PETSC_FALSE, &s->a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The blocks of body k. */
static PetscErrorCode MoveBody(HycoH5 h, const char model[], HycoSubstructures b, PetscInt k)
{
  HycoSubstructure *s = &b->body[k];
  PetscInt rows, columns;
  char path[64];

  PetscFunctionBegin;
  s->n = b->start[k + 1] - b->start[k];
  s->l = b->mode_start[k + 1] - b->mode_start[k];
  s->m = b->inner_start[k + 1] - b->inner_start[k];
  rows = s->n_samples * s->n;
  columns = s->n_samples * b->p;
  PetscCall(HycoH5Real(h, BodiesFileEntry(k, "R", path), &rows, b->r, &s->R));
  PetscCall(HycoH5Real(h, BodiesFileEntry(k, "Z", path), &rows, b->p, &s->Z));
  PetscCall(HycoH5Real(h, BodiesFileEntry(k, "work", path), &columns, b->r, &s->work));
  /* r is the model's number of loads, which MoveSizes() has read. */
  PetscCall(HycoH5Real(h, BodiesFileEntry(k, "gram", path), &b->r, b->r, &s->gram));
  PetscCall(MoveMatrices(h, model, b, k));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The table of the rigid motions, if there is one. */
static PetscErrorCode MoveMotions(HycoROM model, HycoH5 h, HycoSubstructures b)
{
  HycoBodiesMotions *m = &b->motions;
  PetscInt nodes = 0, all = 1;

  PetscFunctionBegin;
  if (HycoH5Reads(h) ? !HycoH5Has(h, "bodies/motions/table") : !m->table.rows) PetscFunctionReturn(PETSC_SUCCESS);
  m->table.rows = 6 * (b->p + b->n * b->r);
  PetscCall(HycoH5Int(h, "bodies/motions/n_nodes", 1, PETSC_MAX_INT / 64, &b->n_theta, 1, &m->n_nodes));
  for (PetscInt p = 0; p < b->n_theta; p++) {
    nodes += m->n_nodes[p];
    all *= m->n_nodes[p];
  }
  PetscCall(HycoH5Int(h, "bodies/motions/body", 0, b->n - 1, &b->p, 1, &m->body));
  PetscCall(HycoH5Real(h, "bodies/motions/node", &nodes, 1, &m->node));
  PetscCall(HycoH5Real(h, "bodies/motions/frame", &b->n, 4, &m->frame));
  PetscCall(HycoH5Real(h, "bodies/motions/table", &all, m->table.rows, &m->table.data));
  HycoBodiesSetMotions(b);
  for (PetscInt p = 0; p < b->n_theta; p++) {
    for (PetscInt i = 1; i < m->n_nodes[p]; i++)
      HycoCheck(m->table.tensor.x[p][i] > m->table.tensor.x[p][i - 1], "%s: bodies/motions/node is damaged",
                model->model->path);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What is inelastic. Written and read by one function; in->fields has the responses of all bodies, samples and turns,
   one below the other. */
static PetscErrorCode MoveInelastic(HycoROM m, HycoH5 h)
{
  HycoSubstructures b = (HycoSubstructures)m->model->data;
  HycoBodiesInelastic in;
  const PetscInt nq = HycoElementGet(m->model->mesh->type)->nq;
  PetscInt head[4], columns, rows = 0;

  PetscFunctionBegin;
  if (HycoH5Reads(h)) PetscCall(PetscNew(&b->inelastic));
  in = b->inelastic;
  HycoCheck(!HycoH5Reads(h) || HycoH5Has(h, "bodies/inelastic/point"),
            "%s has laws in whole cells, as models of bodies of an earlier version; train it again", m->model->path);
  head[0] = in->m;
  head[1] = in->nd;
  head[2] = in->n_points;
  head[3] = in->weighted;
  PetscCall(HycoH5Ints(h, "bodies/inelastic/head", 0, PETSC_MAX_INT, 4, head));
  in->weighted = (PetscBool)head[3];
  in->m = head[0];
  in->nd = head[1];
  in->n_points = head[2];
  /* After the bodies: the modes of each give the rows of `fields`. */
  columns = in->n_points * HycoStrainSize(b->dim);
  for (PetscInt k = 0; k < b->n; k++)
    rows += b->body[k].n_samples * (b->turn_start[k + 1] - b->turn_start[k]) * b->body[k].l;
  PetscCall(HycoH5Reals(h, "bodies/inelastic/amplification", 1, &in->amplification));
  PetscCall(HycoH5Int(h, "bodies/inelastic/point", 0, m->model->whole_cells * nq - 1, &in->n_points, 1, &in->point));
  PetscCall(HycoH5Real(h, "bodies/inelastic/weight", &in->n_points, 1, &in->weight));
  PetscCall(HycoH5Real(h, "bodies/inelastic/T", &columns, in->m, &in->T));
  PetscCall(HycoH5Real(h, "bodies/inelastic/there", &columns, in->m, &in->there));
  PetscCall(HycoH5Real(h, "bodies/inelastic/P", &b->ns, in->m, &in->P));
  PetscCall(HycoH5Real(h, "bodies/inelastic/fields", &rows, in->m, &in->fields));
  PetscCall(HycoH5Int(h, "bodies/inelastic/dof", 0, m->model->whole_nodes * b->dim - 1, &in->nd, 1, &in->dof));
  PetscCall(HycoH5Int(h, "bodies/inelastic/body", 0, b->n - 1, &in->nd, 1, &in->body));
  PetscCall(HycoH5Real(h, "bodies/inelastic/C", &in->nd, b->ns, &in->C));
  PetscCall(HycoH5Real(h, "bodies/inelastic/R", &in->nd, b->r, &in->R));
  PetscCall(HycoH5Real(h, "bodies/inelastic/A", &in->nd, in->m, &in->A));
  if (b->p) PetscCall(HycoH5Real(h, "bodies/inelastic/Z", &in->nd, b->p, &in->Z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A file whose scene has a history makes this a model of paths. Sizes before theta before the probe before blocks: each
   part's lengths come from the one before. Reading fills structures that are empty, writing leaves them unchanged. */
PetscErrorCode HycoBodiesFile(HycoROM m, HycoH5 h)
{
  HycoSubstructures b = (HycoSubstructures)m->model->data;

  PetscFunctionBegin;
  if (m->model->scene->n_times && HycoH5Reads(h)) PetscCall(HycoBodiesTakePath(m));
  PetscCall(MoveSizes(h, m, b));
  PetscCall(MoveTheta(h, m, b));
  PetscCall(MoveProbe(h, m, b));
  for (PetscInt k = 0; k < b->n; k++) PetscCall(MoveBody(h, m->model->path, b, k));
  PetscCall(MoveMotions(m, h, b));
  if (m->model->scene->n_times) PetscCall(MoveInelastic(m, h));
  PetscFunctionReturn(PETSC_SUCCESS);
}
