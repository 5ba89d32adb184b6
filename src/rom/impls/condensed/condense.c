/*
  Training of the condensed model. After the snapshots, for every combination of values of the parameters that change K
  or B: a factorisation for G = B K^-1 B^T, and one for the responses K^-1 B^T P, from which the modes are made
  (condense_modes.c), and H = V^T K^-1 B^T. The rest follows from the snapshots without a solve: their gaps D - B U = g
  + G L, and V^T U = a - H L.
*/
#include <hycocondensed.h>

/* A point has m^2 numbers, and an active set costs m^3 operations: more contacts do not pay in many predictions. */
#define MOST_CONTACTS 4000
#define MOST_NUMBERS  1e9 /* entries of G at all nodes: 8 GB */
#define NO_LOAD                                                                                                        \
  1e-11 /* share of the contacts' displacements below which their part without forces is                               \
           round-off */

/* The values of parameter p among the samples, ascending, without repetition. */
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

/* Checks that the samples form a tensor grid: each combination of their values is a sample. */
static PetscErrorCode FindGrid(HycoReducer t, HycoCondensed c)
{
  const PetscReal *mu;
  PetscInt n_s, nodes = 1;
  PetscReal all = 1;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(t->samples, &n_s, NULL, &mu));
  for (PetscInt p = 0; p < c->dim; p++) {
    PetscCall(FindValues(c, p, n_s, mu));
    HycoCheckModel(c->n[p] > 1 || t->scene->hi[p] == t->scene->lo[p],
                   "the training points have one value of %s, and a condensed model needs at least two to interpolate "
                   "over its range",
                   t->scene->parameter[p]);
    all *= (PetscReal)c->n[p];
  }
  HycoFormat(t->remedy, "let a condensed model choose its points: -hyco_model_type condensed, and no points");
  HycoCheckModel(
      all <= (PetscReal)n_s,
      "the %d training points do not form a tensor grid, and a condensed model needs every combination of "
      "their values (%g points); give them by -grid or -values_NAME, or give no points with -hyco_model_type "
      "condensed, which then chooses them",
      (int)n_s, (double)all);
  for (PetscInt p = 0; p < c->dim; p++) nodes *= c->n[p];
  PetscCall(PetscMalloc1(nodes, &c->sample));
  for (PetscInt k = 0; k < nodes; k++) c->sample[k] = -1;
  for (PetscInt k = 0; k < n_s; k++) c->sample[NodeOf(c, mu + k * c->dim)] = k;
  for (PetscInt k = 0; k < nodes; k++)
    HycoCheckModel(
        c->sample[k] >= 0,
        "the %d training points do not form a tensor grid, and a condensed model needs every combination of "
        "their values; give them by -grid or -values_NAME, or give no points with -hyco_model_type condensed, "
        "which then chooses them",
        (int)n_s);
  t->remedy[0] = '\0';
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* F at mu, this rank's part. Collective. */
static PetscErrorCode Loads(HycoReducer t, const PetscReal mu[], PetscReal data[])
{
  HycoFOM f = t->fom;
  Vec F;

  PetscFunctionBegin;
  PetscCall(HycoFOMSetParameters(f, mu));
  PetscCall(VecCreateMPIWithArray(HycoComm(t), 1, f->part->n_owned * f->fe->dim, PETSC_DETERMINE, data, &F));
  HycoOnEach(HycoComm(t), HycoFEAssembleForce(f->fe, F));
  PetscCall(VecDestroy(&F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether F at a third value of p follows from two others by linear interpolation, with the other parameters at a
   share of their ranges. */
static PetscErrorCode AffineAt(HycoReducer t, PetscInt p, PetscReal share, PetscBool *affine)
{
  static const PetscReal at[3] = {0.06, 0.93, 0.47};
  const PetscInt n = t->fom->part->n_owned * t->fom->fe->dim;
  const PetscReal a = (at[1] - at[2]) / (at[1] - at[0]);
  HycoScene s = t->scene;
  PetscReal mu[HYCO_MAX_PARAMETERS], *v[3], most[2] = {0, 0}; /* most: error, and size */

  PetscFunctionBegin;
  for (PetscInt q = 0; q < s->n_parameters; q++) mu[q] = s->lo[q] + share * (s->hi[q] - s->lo[q]);
  for (PetscInt k = 0; k < 3; k++) {
    mu[p] = s->lo[p] + at[k] * (s->hi[p] - s->lo[p]);
    PetscCall(PetscMalloc1(n, &v[k]));
    PetscCall(Loads(t, mu, v[k]));
  }
  for (PetscInt i = 0; i < n; i++) {
    most[0] = PetscMax(most[0], PetscAbsReal(a * v[0][i] + (1 - a) * v[1][i] - v[2][i]));
    most[1] = PetscMax(most[1], PetscMax(PetscAbsReal(v[0][i]), PetscAbsReal(v[1][i])));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, most, 2, MPIU_REAL, MPI_MAX, HycoComm(t)));
  *affine = (PetscBool)(*affine && most[0] <= 1e-12 * most[1]);
  for (PetscInt k = 0; k < 3; k++) PetscCall(PetscFree(v[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the load at mu, at node s of the stiffness, is the sum of its training loads given by the weights.
   Collective. */
static PetscErrorCode CheckSum(HycoReducer t, HycoCondensed c, PetscInt s, const PetscReal mu[], PetscBool *exact)
{
  const PetscInt n = t->fom->part->n_owned * t->fom->fe->dim, nodes = HycoTensorSize(&c->field[HYCO_FIELD_GAP].tensor);
  PetscReal *weight, *rest, *F, at[HYCO_MAX_PARAMETERS], most[2] = {0, 0}; /* most: error, and size */

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(c->n_load, &weight, n, &rest, n, &F));
  PetscCall(HycoCondensedLoadWeights(c, mu, s, weight, exact));
  PetscCall(Loads(t, mu, rest));
  for (PetscInt i = 0; i < n; i++) most[1] = PetscMax(most[1], PetscAbsReal(rest[i]));
  for (PetscInt j = 0; *exact && j < nodes; j++) {
    if (c->node_stiff[j] != s) continue;
    HycoCondensedPoint(c, j, at);
    PetscCall(Loads(t, at, F));
    for (PetscInt i = 0; i < n; i++) {
      most[1] = PetscMax(most[1], PetscAbsReal(F[i]));
      rest[i] -= weight[c->node_load[j]] * F[i];
    }
  }
  for (PetscInt i = 0; i < n; i++) most[0] = PetscMax(most[0], PetscAbsReal(rest[i]));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, most, 2, MPIU_REAL, MPI_MAX, HycoComm(t)));
  *exact = (PetscBool)(*exact && most[0] <= 1e-11 * most[1]);
  PetscCall(PetscFree3(weight, rest, F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether loads are sums of training loads: checks the values at several points, and the assembled loads for the
   first and the last stiffness. Collective. */
static PetscErrorCode FindExactLoads(HycoReducer t, HycoCondensed c)
{
  static const PetscReal share[3] = {0.31, 0.77, 0.53};
  const PetscInt nodes = HycoTensorSize(&c->field[HYCO_FIELD_GAP].tensor);
  const HycoScene s = t->scene;
  PetscReal mu[HYCO_MAX_PARAMETERS], at[HYCO_MAX_PARAMETERS], *weight;
  PetscBool exact;

  PetscFunctionBegin;
  HycoCondensedPoint(c, 0, mu);
  PetscCall(HycoFOMSetParameters(t->fom, mu));
  PetscCall(HycoCondensedSurveyLoads(c, t->fom, &exact));
  if (!exact) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoCondensedPrepareLoads(c));
  PetscCall(PetscMalloc1(c->n_load, &weight));
  for (PetscInt k = 0; exact && k < 3; k++) {
    for (PetscInt p = 0; p < c->dim; p++) mu[p] = s->lo[p] + share[(k + p) % 3] * (s->hi[p] - s->lo[p]);
    for (PetscInt n = 0; exact && n < nodes / c->n_load; n++)
      PetscCall(HycoCondensedLoadWeights(c, mu, n, weight, &exact));
    for (PetscInt end = 0; exact && end < 2; end++) {
      HycoCondensedPoint(c, end ? nodes - 1 : 0, at);
      for (PetscInt p = 0; p < c->dim; p++) at[p] = c->stiff[p] ? at[p] : mu[p];
      PetscCall(CheckSum(t, c, c->node_stiff[end ? nodes - 1 : 0], at, &exact));
    }
  }
  PetscCall(PetscFree(weight));
  c->exact_loads = exact;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ResetSurfaces(HycoReducer t)
{
  HycoSurfaces *s = &Condensing(t)->surfaces;

  PetscFunctionBegin;
  PetscCall(HycoFEDestroy(&s->fe));
  PetscCall(HycoPairsDestroy(&s->pairs));
  PetscCall(HycoMeshDestroy(&s->mesh));
  PetscCall(HycoRowsDestroy(&s->rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ResetResponses(HycoResponses *x)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(x->Q));
  PetscCall(PetscFree(x->scale));
  PetscCall(PetscFree(x->C));
  PetscCall(PetscMemzero(x, sizeof(*x)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedSetFromOptions(HycoReducer t)
{
  HycoCondensing s;
  PetscBool set[2];

  PetscFunctionBegin;
  PetscCall(PetscNew(&s));
  t->training = s;
  s->tol = 1e-7;
  s->pod_tol = 1e-14;
  s->max_values = 24;
  s->path.tol = 1e-10;
  s->path.cells = 2;
  PetscObjectOptionsBegin((PetscObject)t);
  PetscCall(HycoOptionsFor("condensed"));
  PetscCall(HycoOptionsReal("-hyco_condensed_pod_tol",
                            "condensed: energy left out of the displacement modes, unless -hyco_pod_tol is smaller", 0,
                            1, &s->pod_tol, NULL));
  PetscCall(HycoOptionsFor("condensed where no points are given"));
  PetscCall(HycoOptionsReal(
      "-hyco_condensed_tol",
      "condensed, no points given: add values until the error of the forces, with one value left out, is no larger", 0,
      1, &s->tol, NULL));
  PetscCall(HycoOptionsInt("-hyco_condensed_max_values",
                           "condensed, no points given: largest number of values per parameter", 3, 1000,
                           &s->max_values, NULL));
  PetscCall(HycoOptionsFor("condensed, of a history"));
  PetscCall(HycoOptionsReal("-hyco_condensed_inelastic_tol",
                            "condensed, with a history: energy left out of the modes of the inelastic strain", 0, 1,
                            &s->path.tol, &set[0]));
  PetscCall(HycoOptionsInt(
      "-hyco_condensed_cells",
      "condensed, with a history: number of cells with laws for each mode of the inelastic strain (0: every cell)", 0,
      1000000, &s->path.cells, &set[1]));
  PetscOptionsEnd();
  HycoCheck(!(set[0] || set[1]) || !t->scene || t->scene->n_times,
            "%s is for scenes with a history, and this scene has none; remove it",
            set[0] ? "-hyco_condensed_inelastic_tol" : "-hyco_condensed_cells");
  if (t->scene && t->scene->n_times) PetscCall(HycoCondensedTakePath(t->prototype));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedResetTraining(HycoReducer t)
{
  PetscFunctionBegin;
  PetscCall(HycoCondensedTableFree(&Condensing(t)->path.table));
  PetscCall(ResetSurfaces(t));
  PetscCall(ResetResponses(&Condensing(t)->responses));
  PetscCall(HycoCondensedFree(&Condensing(t)->condensed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes the contacts' nodes and slave facets, and the place of the gaps in the condensed model in training. Rank 0. */
static PetscErrorCode TakeSurfaces(HycoReducer t, HycoCondensed c)
{
  HycoMesh surface = t->fom->surface;
  const PetscInt n = surface->n_nodes;
  HycoSurfaces *s = &Condensing(t)->surfaces;
  PetscBool *contact;
  PetscInt *extra, *index, *all, n_extra = 0;

  PetscFunctionBegin;
  PetscCall(ResetSurfaces(t));
  PetscCall(PetscCalloc1(n, &contact));
  PetscCall(PetscMalloc3(n, &extra, n, &index, t->scene->n_contacts, &all));
  HycoPairsMark(&t->fom->pairs, contact);
  for (PetscInt i = 0; i < n; i++) {
    if (contact[i]) extra[n_extra++] = i;
  }
  for (PetscInt k = 0; k < t->scene->n_contacts; k++)
    PetscCall(HycoMeshFindGroup(surface, "contact", t->scene->contact[k]->slave, &all[k]));
  PetscCall(HycoSubmesh(t->scene, surface, 0, NULL, n_extra, extra, t->scene->n_contacts, all, &s->mesh));
  PetscCall(HycoSubmeshNodes(s->mesh, surface, extra));
  for (PetscInt i = 0; i < s->mesh->n_nodes; i++) index[extra[i]] = i;
  PetscCall(HycoPairsRenumber(&t->fom->pairs, index, &s->pairs));
  PetscCall(HycoFECreate(t->scene, s->mesh->dm, &s->fe));
  PetscCall(HycoRowsCreate(&t->fom->pairs, surface->dim, &s->rows));
  c->given = (HycoGapSource){s->fe, &s->pairs, s->rows};
  PetscCall(PetscFree3(extra, index, all));
  PetscCall(PetscFree(contact));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where slaves slide from facet to facet, B is not smooth, and polynomials do not converge. Rank 0. */
static PetscErrorCode CheckFacets(HycoReducer t)
{
  PetscInt n;
  const PetscReal *mu;
  HycoMet met;

  PetscFunctionBegin;
  if (!t->fom->searches) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSamplesGet(t->samples, &n, NULL, &mu));
  PetscCall(HycoMetFind(t->scene, t->fom->surface, &t->fom->pairs, n, mu, NULL, &met));
  for (PetscInt r = 1; r < met.rows.n; r++) {
    const HycoPairs *p = &met.rows;

    HycoCheckModel(met.of[r] != met.of[r - 1],
                   "contact %s: node %d changes the facet of %s that it faces as the parameters move it, where the "
                   "interpolation of a condensed model would have kinks; train a hybrid model",
                   t->scene->contact[p->contact[r]]->name, (int)t->fom->surface->node_id[p->slave[r]],
                   t->scene->contact[p->contact[r]]->master);
  }
  PetscCall(HycoMetDestroy(&met));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedCheckSupports(HycoReducer t)
{
  HycoMotions motions;
  PetscInt free, rigid = 0;
  char name[HYCO_LINE];

  PetscFunctionBegin;
  while (rigid < t->scene->n_contacts && !t->scene->contact[rigid]->rigid) rigid++;
  PetscCall(HycoFEFreeMotions(HycoComm(t), t->fom->fe, &motions));
  free = motions.n;
  if (free) PetscCall(PetscStrncpy(name, motions.name[0], sizeof(name)));
  PetscCall(HycoMotionsDestroy(&motions));
  HycoCheckModel(!free,
                 "no support keeps %s, only contact does, so that K^-1 does not exist, which a condensed model needs; "
                 "train a hybrid model%s%s%s",
                 name, rigid < t->scene->n_contacts ? ", or give the master of the rigid body (" : "",
                 rigid < t->scene->n_contacts ? t->scene->contact[rigid]->master : "",
                 rigid < t->scene->n_contacts ? ") a soft spring" : "");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds what each parameter affects. Collective. */
static PetscErrorCode Inspect(HycoReducer t, HycoCondensed c)
{
  PetscBool reaches[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  HycoSceneReaches(t->scene, reaches);
  for (PetscInt p = 0; p < c->dim; p++) c->stiff[p] = reaches[p] && t->scene->hi[p] > t->scene->lo[p];
  PetscCall(HycoCondensedAllocate(c));
  c->exact_gap = 1;
  HycoOnRoot(HycoComm(t), TakeSurfaces(t, c));
  PetscCall(FindExactLoads(t, c));
  for (PetscInt p = 0; p < c->dim; p++) {
    PetscBool affine = (PetscBool)!c->stiff[p];

    for (PetscInt k = 0; affine && !c->exact_loads && k < 2; k++) PetscCall(AffineAt(t, p, k ? 0.71 : 0.38, &affine));
    c->affine[p] = affine;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedCheckContacts(HycoReducer t)
{
  const PetscInt m = t->sizes[2];
  HycoSolver solver;
  HycoLinear linear;

  PetscFunctionBegin;
  PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &solver));
  PetscCall(PetscObjectSetOptions((PetscObject)solver, t->scene->options));
  PetscCall(HycoSolverSetFromOptions(solver));
  linear = solver->linear;
  PetscCall(HycoSolverDestroy(&solver));
  HycoCheckModel(linear != HYCO_LINEAR_ITERATIVE,
                 "-hyco_linear iterative makes no factor of the stiffness, and a condensed model needs one; train a "
                 "hybrid model, or use -hyco_linear auto");
  HycoCheckModel(
      m > 0,
      "the scene has no contact, and the unknowns of a condensed model are contact forces; train a hybrid model");
  HycoCheckModel(m <= MOST_CONTACTS,
                 "the scene has %d contacts; a condensed model stores the square of their number at every training "
                 "point, and is limited to %d: train a hybrid model",
                 (int)m, MOST_CONTACTS);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoCondensedBegin(HycoReducer t)
{
  HycoCondensed c;
  const PetscInt m = t->sizes[2];

  PetscFunctionBegin;
  HycoCheck(!t->scan && !t->keep_singular, "-hyco_scan and -hyco_keep_singular have no effect on -hyco_model_type "
                                           "condensed, unless the scene has a history; remove them");
  PetscCall(HycoCondensedCheckContacts(t));
  PetscCall(HycoCondensedFree(&Condensing(t)->condensed));
  PetscCall(ResetResponses(&Condensing(t)->responses));
  PetscCall(HycoCondensedCreate(t->scene->n_parameters, m, 0, &c));
  Condensing(t)->condensed = c;
  c->scene = t->scene;
  HycoOnRoot(HycoComm(t), CheckFacets(t));
  PetscCall(HycoCondensedCheckSupports(t));
  PetscCall(FindGrid(t, c));
  PetscCall(Inspect(t, c));
  HycoCheckModel((PetscReal)c->field[HYCO_FIELD_G].rows * (PetscReal)HycoTensorSize(&c->field[HYCO_FIELD_G].tensor) <=
                     MOST_NUMBERS,
                 "the flexibility of %d contacts at %d training points has more than %g numbers; use fewer values of "
                 "the parameters that affect the stiffness, or train a hybrid model",
                 (int)m, (int)HycoTensorSize(&c->field[HYCO_FIELD_G].tensor), MOST_NUMBERS);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -B K^-1 F = -B U - G L of one snapshot (U at the contacts' nodes); set to 0 if it is a small difference. */
static PetscErrorCode FreeGap(HycoReducer t, const PetscReal mu[], const PetscReal U[], const PetscReal L[],
                              const PetscReal packed[], PetscReal g[])
{
  HycoFE fe = t->fom->fe_surface;
  HycoPairs *pairs = &t->fom->pairs;
  const PetscInt m = pairs->n, dim = fe->dim, entries = HycoPairsWidth(pairs) * dim * m;
  PetscInt *start, *dof;
  PetscReal *value, moved = 0, left = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(m + 1, &start, entries, &dof, entries, &value));
  PetscCall(HycoFESetParameters(fe, mu));
  PetscCall(HycoContactRows(fe, pairs, start, dof, value, g));
  for (PetscInt k = 0; k < m; k++) {
    g[k] = 0;
    for (PetscInt j = start[k]; j < start[k + 1]; j++)
      g[k] -= value[j] * U[t->contact_row[dof[j] / dim] * dim + dof[j] % dim];
    moved = PetscMax(moved, PetscAbsReal(g[k]));
  }
  for (PetscInt j = 0; j < m; j++) {
    g[j] -= packed[0] * L[j];
    for (PetscInt i = j + 1; i < m; i++) {
      g[i] -= packed[i - j] * L[j];
      g[j] -= packed[i - j] * L[i];
    }
    packed += m - j;
  }
  for (PetscInt k = 0; k < m; k++) left = PetscMax(left, PetscAbsReal(g[k]));
  if (left <= NO_LOAD * moved) PetscCall(PetscArrayzero(g, m));
  PetscCall(PetscFree3(start, dof, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* H = V^T K^-1 B^T at the nodes of the stiffness, for all modes: the coefficients of the responses, on the span of
   the patterns. */
static PetscErrorCode FromResponses(HycoReducer t, HycoCondensed c)
{
  const HycoResponses *x = &Condensing(t)->responses;
  const PetscInt n = HycoTensorSize(&c->field[HYCO_FIELD_H].tensor), m = c->m, l = c->l;
  HycoGridField *H = &c->field[HYCO_FIELD_H], *unloaded = &c->field[HYCO_FIELD_FREE];

  PetscFunctionBegin;
  PetscCall(PetscFree(H->data));
  PetscCall(PetscCalloc1((size_t)H->rows * (size_t)n, &H->data));
  for (PetscInt k = 0; l && k < n; k++) {
    for (PetscInt j = 0; j < x->q; j++) {
      const PetscReal *column = x->C + (size_t)(t->n_s + k * x->q + j) * (size_t)l, *Q = x->Q + (size_t)j * (size_t)m;

      for (PetscInt i = 0; i < l; i++) {
        PetscReal *h = H->data + (size_t)k * (size_t)H->rows + (size_t)i * (size_t)m;

        for (PetscInt a = 0; a < m; a++) h[a] += column[i] / x->scale[j] * Q[a];
      }
    }
  }
  for (PetscInt k = 0; l && k < HycoTensorSize(&unloaded->tensor); k++) { /* a = V^T U + H L */
    const PetscReal *h = H->data + (size_t)HycoCondensedNode(c, H, k) * (size_t)H->rows,
                    *L = c->Lambda + (size_t)k * (size_t)m;

    for (PetscInt i = 0; i < l; i++) {
      for (PetscInt a = 0; a < m; a++) unloaded->data[k * l + i] += h[i * m + a] * L[a];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fills g, V^T U and the training forces at the nodes of the whole grid. */
static PetscErrorCode FromSnapshots(HycoReducer t, HycoCondensed c)
{
  HycoGridField *gap = &c->field[HYCO_FIELD_GAP], *unloaded = &c->field[HYCO_FIELD_FREE];
  const HycoGridField *G = &c->field[HYCO_FIELD_G];
  const PetscInt n = HycoTensorSize(&gap->tensor), m = c->m, l = c->l;
  const size_t n_dof = (size_t)(t->n_contact_nodes * t->sizes[3]);
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
    const PetscInt s = c->sample[k], node = HycoCondensedNode(c, G, k);
    const PetscReal *L = t->Lambda + (size_t)s * (size_t)m;

    PetscCall(PetscArraycpy(c->Lambda + k * m, L, m));
    PetscCall(FreeGap(t, mu + s * c->dim, t->U_contact + (size_t)s * n_dof, L, G->data + (size_t)node * (size_t)G->rows,
                      gap->data + k * m));
    if (l) PetscCall(PetscArraycpy(unloaded->data + k * l, Condensing(t)->responses.C + (size_t)s * (size_t)l, l));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Chooses degrees by leaving values out, and degree 1 where the data are affine; errors of G and g, summed over the
   parameters. */
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

PetscErrorCode HycoCondensedFillFields(HycoReducer t, PetscBool modes)
{
  HycoCondensed c = Condensing(t)->condensed;

  PetscFunctionBegin;
  c->l = modes ? Condensing(t)->responses.r : 0;
  PetscCall(HycoCondensedAllocate(c));
  PetscCall(FromSnapshots(t, c));
  PetscCall(FromResponses(t, c));
  PetscCall(ChooseDegrees(c));
  PetscCall(HycoCondensedBound(c));
  PetscCall(HycoCondensedPrepare(c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
