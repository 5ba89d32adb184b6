/*
  The search for settings: which settings of the reduction give the cheapest online model whose errors at the held-out
  points are small enough. The snapshots are read and their bases made once; an attempt truncates the bases, builds the
  RID and the model on it and predicts the held-out points.

  Types with modes of their own (HycoROMTraits.own_modes) come first, judged by the held-out solutions before any
  training point is solved; over paths, whose inelastic modes need the training solutions, after that. If one of them is
  accurate enough, that ends the search, and its model is the one of the attempt.

  Only settings that no option fixes are varied. The settings of a kind are tried in the order of their cost, and the
  first that meet the targets end their kind; if they meet them with a margin, they end the search. So do attempts that
  need more operations than the solutions (search_work.c). Costs are counts of operations, not times, so that the choice
  is the same on any machine and number of ranks. What is left out is listed with its reason.

  If no settings meet the user's targets, solutions are added where the best model has the largest errors, and the
  search starts again. Next to an added solution the model is more accurate than elsewhere, so that its errors at those
  held-out points no longer show how accurate it is: fresh ones judge it. If it misses the targets there, the former
  held-out points become training points, and the search starts again with the fresh ones.
*/
#include <hycoreducerimpl.h>
#include <hycovector.h>
#include <stdio.h>
#include <string.h>

/* Size of the first RID beyond the contacts, in edges of their facets: two layers and a half, so that a third one is in
   on irregular meshes. */
#define EXTENSION     2.5
#define MANY_UNKNOWNS 600 /* largest RID for which "all" is tried automatically: its reduced matrix is dense */
/* Attempts without progress that end a kind: a larger RID does not help if the basis lacks solutions. */
#define STALLED_ATTEMPTS 3
/* Ratio of an attempt to the best below which it is progress: 5 % is within the choice of the training points. */
#define PROGRESS  0.95
#define NO_EFFECT 0.05 /* change of the ratio that counts as none, relative: as PROGRESS */
/* Ratio of an attempt of a type without settings that ends the search: ten times better than the targets. */
#define ENDING_MARGIN  0.1
#define LEAST          2   /* models that are tried whatever they cost */
#define HOPELESS_ERROR 50  /* multiple of the target: above it no attempt so far gives a useful model */
#define FEW_UNKNOWNS   300 /* a dense matrix of this size is cheap */
#define MAX_ATTEMPTS   64
#define ROUND          4 /* share of the training points that is added at a time, as a divisor */
/* Correlation above which a parameter explains the errors: by chance 20 points reach 0.3 in one of five cases. */
#define EXPLANATORY_CORRELATION 0.3
#define WHOLE                   -1

/* Sizes of RIDs and bases, the cheapest first; layers WHOLE: the whole mesh. */
typedef struct {
  PetscReal tol;
  PetscInt layers;
  PetscBool extended;
} Size;
static const Size sizes[] = {{1e-5, 0, PETSC_FALSE}, {1e-5, 1, PETSC_FALSE},     {1e-7, 1, PETSC_FALSE},
                             {1e-7, 1, PETSC_TRUE},  {1e-10, 1, PETSC_FALSE},    {1e-10, 1, PETSC_TRUE},
                             {1e-13, 1, PETSC_TRUE}, {1e-10, 2, PETSC_TRUE},     {1e-13, 2, PETSC_TRUE},
                             {1e-13, 3, PETSC_TRUE}, {1e-13, WHOLE, PETSC_FALSE}};
enum { N_SIZES = sizeof(sizes) / sizeof(sizes[0]), FIRST_USUAL = 3 };

/* For paths, with the cells at a plane of symmetry as the RID, all displacements of A full order. */
static const PetscReal plane_tol[] = {1e-9, 1e-12, 1e-14};
enum { N_PLANES = sizeof(plane_tol) / sizeof(plane_tol[0]) };

typedef struct {
  HycoReducer t;
  HycoSnapshots store;
  const char *const *types;  /* the registered ones */
  HycoReducerSettings given; /* as given by the options */
  PetscReal extension;       /* of the settings that extend the contact */
  const char *plane;         /* plane of symmetry; NULL: none */
  PetscBool targets;         /* given by the user */
  PetscInt first;            /* number of training points that were given */
  PetscBool near;            /* solutions were added near the held-out points */
  PetscReal target[HYCO_N_ERRORS], limit[HYCO_N_ERRORS];
  PetscInt n;
  HycoAttempt attempt[MAX_ATTEMPTS];
  HycoHeldOut *rows[MAX_ATTEMPTS]; /* for paths: results of each attempt that was judged at all held-out points; else
                                      NULL */
  PetscReal force;                 /* HycoHeldOutForce() of the held-out points */
  PetscInt *order;                 /* held-out points, those with the largest errors in the last attempts first */
  PetscReal least, *ratio;         /* least ratio so far; ratios of the best model at its held-out points */
  PetscReal spent, last, budget;   /* operations of all attempts, and of the last one; the largest number of them */
  PetscReal own;                   /* of `spent`, those of types with modes of their own, which add to the budget */
  PetscInt n_models;               /* attempts with these bases that gave a model of any use */
  PetscInt n_own;                  /* the last attempt of a type with modes of its own */
  PetscBool ended;                 /* by the budget */
  PetscBool reduced;               /* the bases are those of the columns */
  HycoROM kept;                    /* the model of the last attempt, if it can be taken as it is; else NULL */
  HycoTraining kept_report;
  HycoROM former; /* the best model so far, which missed the targets; NULL: none yet */
  HycoTraining former_report;
  Mat former_V; /* its modes, as the reducer has those of the last bases, */
  PetscInt former_l;
  HycoLeftOut left_out[HYCO_MAX_LEFT_OUT];
  PetscInt n_left_out;
  char remedy[HYCO_LINE]; /* of a type that gave no accurate model: HycoReducer's remedy */
} Search;

/* Notes what the search does not try; the first reason counts. Void, with PETSc's error codes dropped: notes for
   the report may be cut short, they must not end a search. */
static void LeaveOut(Search *s, const char what[], PetscBool possible, const char why[])
{
  HycoLeftOut *next = &s->left_out[s->n_left_out];

  for (PetscInt k = 0; k < s->n_left_out; k++) {
    if (strcmp(s->left_out[k].what, what) == 0) return;
  }
  /* A report has room for so many: the first ones are the likeliest. */
  if (s->n_left_out == HYCO_MAX_LEFT_OUT) return;
  (void)!PetscStrncpy(next->what, what, sizeof(next->what));
  (void)!PetscStrncpy(next->why, why, sizeof(next->why));
  next->possible = possible;
  s->n_left_out++;
}

/* The stress and force tolerances follow that of the displacement if they were equal to it. */
static PetscErrorCode SetSettings(HycoReducer t, const HycoReducerSettings *r)
{
  PetscFunctionBegin;
  /* The type first: the options of a new one are read, and its traits decide on the RID. */
  PetscCall(HycoReducerSetType(t, r->type));
  for (PetscInt k = HYCO_SEED_STRESS; k <= HYCO_SEED_FORCE; k++) {
    if (t->tol[k] == t->tol[HYCO_SEED_DISPLACEMENT]) t->tol[k] = r->pod_tol;
  }
  t->tol[HYCO_SEED_INELASTIC] = t->tol[HYCO_SEED_STRESS];
  t->tol[HYCO_SEED_SPRING] = t->tol[HYCO_SEED_FORCE];
  t->tol[HYCO_SEED_DISPLACEMENT] = r->pod_tol;
  t->extension = r->contact_extension;
  t->layers = r->layers;
  t->hybrid = r->hybrid;
  t->whole_rid = (PetscBool)(r->whole || t->prototype->model->traits.whole);
  t->plane = r->plane;
  t->ridge = r->ridge;
  if (r->variant) PetscCall((*t->trainer.setvariant)(t, r->variant));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Mean length of an edge of the slave surfaces' facets; 0 without any. Rank 0. The contact extension is a length;
   as a multiple of an edge it does not depend on the unit or the size of the scene. */
static PetscErrorCode SurfaceEdge(HycoReducer t, PetscReal *mean)
{
  const HycoMesh m = t->fom->surface;
  PetscReal sum = 0;
  PetscInt n = 0;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < t->scene->n_contacts; k++) {
    PetscInt g = 0;

    PetscCall(HycoMeshFindGroup(m, "contact", t->scene->contact[k]->slave, &g));
    for (PetscInt f = 0; f < m->n_facets; f++) {
      const PetscInt *node = m->facets + f * m->nf,
                     corners = HycoMeshIsQuadratic(m) ? HycoCellKinds[m->type].corners : HycoFacetCorners(m->nf, node);

      /* A facet of one node (1D) has no edge. */
      if (m->facet_group[f] != g || m->nf < 2) continue;
      for (PetscInt j = 0; j < corners; j++)
        sum += HycoDistance(m->xyz + 3 * node[j], m->xyz + 3 * node[(j + 1) % corners]);
      n += corners;
    }
  }
  *mean = n ? sum / n : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The quotient of an error and its target; 0 without a target. */
static PetscReal QuotientOf(const Search *s, PetscInt kind, PetscReal error)
{
  return s->target[kind] > 0 ? HycoAttemptsQuotient(s->target[kind], s->limit[kind], error) : 0;
}

/* The largest at a held-out point. */
static PetscReal SearchQuotient(const Search *s, const HycoHeldOut *row)
{
  PetscReal ratio = 0;

  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++)
    ratio = PetscMax(ratio, QuotientOf(s, j, HycoHeldOutError(row, (HycoErrorKind)j, s->force)));
  return ratio;
}

/* The largest quotient of the attempt's errors. */
static void SearchRate(const Search *s, HycoAttempt *a)
{
  a->ratio = 0;
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) {
    const PetscReal ratio = QuotientOf(s, j, a->held_out.largest[j]);

    if (!(ratio > a->ratio)) continue; /* NaN: not compared */
    a->ratio = ratio;
    a->worst = (HycoErrorKind)j;
  }
}

/* What seems accurate is also judged at the corners of the training, where errors may be larger than inside: as far as
   their solutions are there. */
static PetscErrorCode RateCorners(Search *s, HycoROM model, const HycoHeldOut rows[], HycoAttempt *a)
{
  HycoReducer t = s->t;
  HycoSamples corners;
  HycoHeldOut *all;
  PetscInt n;

  PetscFunctionBegin;
  if (a->ratio > 1 || t->late || t->validation || t->scene->n_times) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoReducerCorners(t, a->n_held, &corners));
  PetscCall(HycoSamplesGet(corners, &n, NULL, NULL));
  PetscCall(PetscCalloc1(a->n_held + n, &all));
  PetscCall(PetscArraycpy(all, rows, a->n_held));
  HycoFinally(HycoReducerJudgeCorners(t, corners, a->n_held, model, s->store, all, &a->held_out),
              PetscCall(HycoSamplesDestroy(&corners));
              PetscCall(PetscFree(all)));
  SearchRate(s, a);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The errors at the held-out points that were predicted, and their largest quotient. */
static PetscErrorCode SearchSummarise(Search *s, const HycoHeldOutEarlyStop *race, const HycoHeldOut rows[],
                                      HycoAttempt *a)
{
  HycoHeldOut *some;
  PetscReal force = s->force;

  PetscFunctionBegin;
  /* Of a race only the first points of its order were predicted. */
  PetscCall(PetscMalloc1(race->n, &some));
  for (PetscInt k = 0; k < race->n; k++) some[k] = race->n == a->n_held ? rows[k] : rows[race->order[k]];
  if (race->n == a->n_held || !(force > 0)) force = HycoHeldOutForce(race->n, some);
  PetscCall(HycoHeldOutSummarise(race->n, some, force, &a->held_out));
  PetscCall(PetscFree(some));
  /* The size of forces is the full-order solutions': known once all points were compared. */
  if (race->n == a->n_held && !a->held_out.not_converged) s->force = force;
  SearchRate(s, a);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reorders the points: the next attempt begins with those where this one had the largest errors; for a dropped one,
   with the one at which it was dropped. */
static PetscErrorCode SearchReorder(Search *s, const HycoHeldOutEarlyStop *race, const HycoHeldOut rows[], PetscInt n)
{
  PetscReal *key;
  PetscInt *order = s->order, last = race->n - 1;

  PetscFunctionBegin;
  if (race->n < n) {
    const PetscInt point = order[last];

    /* The point that dropped this attempt probably drops the next: it comes first. */
    PetscCall(PetscArraymove(order + 1, order, last));
    order[0] = point;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc1(n, &key));
  for (PetscInt k = 0; k < n; k++) {
    key[k] = -SearchQuotient(s, &rows[k]);
    order[k] = k;
  }
  PetscCall(PetscSortRealWithArrayInt(n, key, order));
  PetscCall(PetscFree(key));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Judges the model at the held-out points; for paths only until it is clear that the settings will not be chosen,
   unless `all` is set. Results of paths are kept (s->rows) if all points were predicted: the chosen attempt is
   then not judged again. */
static PetscErrorCode SearchJudge(Search *s, HycoROM model, PetscBool all, HycoAttempt *a)
{
  HycoReducer t = s->t;
  const PetscInt n = a->n_held;
  PetscInt beaten;
  HycoHeldOut *rows;
  HycoHeldOutEarlyStop race = {.order = s->order,
                               .target = s->target,
                               .limit = s->limit,
                               .force = s->force,
                               .all = (PetscBool)(all || t->exhaustive)};

  PetscFunctionBegin;
  a->ratio = PETSC_INFINITY;
  /* Of the attempts before this one, which is the last in the list. */
  race.most = HycoAttemptsLimit(s->n - 1, s->attempt, a->cost, &beaten);
  PetscCall(PetscCalloc1(n, &rows));
  s->rows[s->n - 1] = rows;
  PetscCall(HycoReducerPredictHeldOut(t, t->held, model, s->store, t->scene->n_times ? &race : NULL, rows));
  if (!t->scene->n_times) race.n = n;
  PetscCall(SearchSummarise(s, &race, rows, a));
  PetscCall(RateCorners(s, model, rows, a));
  if (race.lost) {
    a->dropped_at = s->order[race.n - 1];
    a->beaten_by = a->held_out.not_converged ? 0 : beaten;
  }
  for (PetscInt k = 0; k < race.n && a->ratio <= s->least && !a->beaten_by; k++) {
    const PetscInt point = race.n < n ? s->order[k] : k;

    s->ratio[point] = SearchQuotient(s, &rows[point]);
  }
  if (!a->beaten_by) s->least = PetscMin(s->least, a->ratio);
  if (t->scene->n_times) PetscCall(SearchReorder(s, &race, rows, n));
  if (race.n < n || !t->scene->n_times) PetscCall(PetscFree(s->rows[s->n - 1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes the bases for the current settings, and the type's own modes. After the bases, because a type may derive
   its modes from them (supremizers, orthogonalised modes). */
static PetscErrorCode TakeModes(HycoReducer t, HycoSnapshots store)
{
  PetscFunctionBegin;
  PetscCall(HycoReducerTakeBases(t));
  if (t->trainer.begin) PetscCall((*t->trainer.begin)(t));
  if (t->trainer.modes) HycoStaged(HYCO_STAGE_FULL_ORDER, (*t->trainer.modes)(t, store));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The number of settings that meet the targets at no more than this cost, so that others of this cost are not chosen;
   0: none. */
static PetscInt MetFor(const Search *s, PetscReal cost)
{
  for (PetscInt k = 0; k < s->n - 1; k++) {
    const HycoAttempt *a = &s->attempt[k];

    if (!a->failure[0] && !a->beaten_by && a->ratio <= 1 && a->cost <= cost) return a->number;
  }
  return 0;
}

/* The bases of the columns' solutions, unless they are there. */
static PetscErrorCode SearchReduce(Search *s)
{
  PetscFunctionBegin;
  if (s->reduced) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoReducerResetBases(s->t));
  PetscCall(HycoReducerReduce(s->t, s->store, PETSC_TRUE));
  s->reduced = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The sizes and the cost of an attempt's model. Sizes of the built model, on which its cost depends; seconds are
   measured later, if it is judged. */
static void TakeSizes(HycoReducer t, const HycoTraining *report, HycoAttempt *a)
{
  a->n_modes = report->n_modes;
  a->n_fe_dofs = report->n_fe_dofs;
  a->rid_nodes = report->rid_nodes;
  a->rid_elements = report->rid_elements;
  a->rid_contacts = report->rid_contacts;
  a->rid_fraction = report->rid_fraction;
  a->cost = t->trainer.cost ? (*t->trainer.cost)(t, a) : 0;
}

/* Makes bases, RID and model for the current settings, and judges the model unless its cost excludes it. Without
   training solutions the model is the final one: it is kept, as it takes as long to make as the search. */
static PetscErrorCode BuildAndJudge(Search *s, PetscBool all, HycoAttempt *a)
{
  HycoReducer t = s->t;
  const PetscBool final = (PetscBool)(t->columns != t->samples);
  HycoTraining report = {0};
  HycoROM model;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(SearchReduce(s));
  PetscCall(TakeModes(t, s->store));
  PetscCall(HycoReducerBuild(t, final, &model, &report));
  TakeSizes(t, &report, a);
  /* Rank 0 has chosen the ridge while it built the model; the chosen attempt is built again with the same. */
  PetscCallMPI(MPI_Bcast(&t->ridge, 1, MPIU_REAL, 0, HycoComm(t)));
  a->settings.ridge = t->ridge;
  a->beaten_by = all || t->exhaustive ? 0 : MetFor(s, a->cost);
  ierr = a->beaten_by ? PETSC_SUCCESS : SearchJudge(s, model, all, a); /* a model may refuse to predict */
  if (final && !ierr) {
    s->kept = model;
    s->kept_report = report;
  } else
    (void)!HycoROMDestroy(&model);
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether an attempt gave a model of any use. */
static PetscBool IsUseful(const HycoAttempt *a)
{
  return (PetscBool)(!a->failure[0] && (a->beaten_by || !(a->held_out.largest[HYCO_ERROR_U] >= HYCO_USELESS_ERROR)));
}

/* Whether a type with modes of its own has given one, with which a search may end that finds no other. */
static PetscBool SearchHasModel(const Search *s)
{
  for (PetscInt k = 0; k < s->n_own; k++) {
    if (IsUseful(&s->attempt[k])) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* Whether the budget has room for an attempt like the last one. By the last attempt's work: later ones of a kind
   are larger, so that this errs to the side of one more attempt. */
static PetscBool SearchIsAffordable(Search *s, const HycoReducerSettings *settings)
{
  const PetscReal given = s->t->search_budget;
  PetscReal enough;
  char why[HYCO_LINE];

  /* The first attempts are always made: without any there is no model. */
  if (s->spent + s->last <= s->budget) return PETSC_TRUE;
  if (s->n_models < LEAST && !(SearchHasModel(s) && s->n - s->n_own >= LEAST)) return PETSC_TRUE;
  /* Twice what was spent, so that a search that takes it goes on. */
  enough = given * 2 * (s->spent - s->own + s->last) / (s->budget - s->own);
  if (given > 0)
    snprintf(why, sizeof(why),
             "%d settings took %.1e of the %.1e operations that the search may take; -hyco_search_budget %g lets it go "
             "on, -hyco_search_exhaustive tries all",
             (int)s->n, (double)s->spent, (double)s->budget, (double)(enough < 1 ? enough : PetscCeilReal(enough)));
  else
    snprintf(
        why, sizeof(why),
        "-hyco_search_budget 0 allows %d settings; a larger one, or -hyco_search_exhaustive, lets the search go on",
        LEAST);
  LeaveOut(s, settings->rid ? "further settings" : settings->type, PETSC_TRUE, why);
  s->ended = PETSC_TRUE;
  return PETSC_FALSE;
}

/* Operations of n predictions at training or held-out points: the cost of an attempt is that at a new stiffness. */
static PetscErrorCode SearchPredictions(HycoReducer t, HycoSamples points, PetscReal n, const HycoAttempt *a,
                                        PetscReal *work)
{
  const PetscReal unknowns = (PetscReal)a->n_modes + (PetscReal)a->n_fe_dofs;
  PetscInt n_points, stiffnesses;
  PetscReal share = 1;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(points, &n_points, NULL, NULL));
  PetscCall(HycoReducerCountStiffnesses(t, points, PETSC_TRUE, &stiffnesses));
  /* Points in order: a factor serves successive points of one stiffness. */
  if (!t->scene->n_times) share = (PetscReal)stiffnesses / (PetscReal)PetscMax(n_points, 1);
  *work = n * HycoReducerSolvesOf(t) * (share * a->cost + 2 * unknowns * unknowns);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the operations of an attempt: the type's own, predictions at training and held-out points, and their comparison
   on the whole mesh. */
static PetscErrorCode SearchCount(Search *s, HycoAttempt *a)
{
  HycoReducer t = s->t;
  /* Modes times coefficients for each comparison on the whole mesh, and the stresses of its cells. */
  const PetscReal whole = 2 * (PetscReal)t->sizes[0] * t->sizes[3] * a->n_modes + 100 * (PetscReal)t->sizes[1];
  const PetscReal held = a->held_out.n + (HYCO_UNSOLVED_WORK - 1) * (PetscReal)a->held_out.not_converged,
                  repeats = t->scene->n_times ? 1 : HYCO_HELD_REPEATS;
  PetscInt numbers[2] = {t->n_judged, t->n_unknowns};
  PetscReal judging, testing;

  PetscFunctionBegin;
  /* Counted on rank 0, where models are built and judged. */
  PetscCallMPI(MPI_Bcast(numbers, 2, MPIU_INT, 0, HycoComm(t)));
  a->n_unknowns = numbers[1];
  PetscCall(SearchPredictions(t, t->samples, numbers[0], a, &judging));
  PetscCall(SearchPredictions(t, t->held, repeats * held, a, &testing));
  s->last = judging + testing + whole * ((PetscReal)t->n_s + held * (PetscReal)HycoSnapshotsSteps(t->scene));
  if (t->trainer.work && !a->failure[0]) s->last += (*t->trainer.work)(t);
  s->spent += s->last;
  /* Only models that are good for something count as attempts made. */
  s->n_models += IsUseful(a);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Builds a model with these settings and judges it, at all held-out points or as far as necessary; an error becomes
   a failed attempt. Collective. Errors of other kinds than "no model" (HYCO_ERR_NO_MODEL) end the search:
   HycoCatchNoModel() raises them again. */
static PetscErrorCode SearchMake(Search *s, const HycoReducerSettings *settings, PetscBool all, HycoAttempt *a)
{
  HycoReducer t = s->t;
  PetscErrorCode ierr;
  char message[HYCO_LINE], what[HYCO_LINE];

  PetscFunctionBegin;
  HycoReducerSettingsDescribe(settings, sizeof(what), what);
  HycoFormat(t->doing, "settings %d, %s", (int)a->number, what);
  /* With `hybrid all` in a search a large RID is refused before its dense matrix is filled. */
  t->most_full_order =
      t->pinned[HYCO_CHOICE_HYBRID] || settings->hybrid != HYCO_HYBRID_ALL || settings->plane ? 0 : MANY_UNKNOWNS;
  PetscCall(SetSettings(t, settings));
  t->n_judged = t->n_unknowns = 0;
  t->remedy[0] = '\0';
  PetscCall(HycoCatchBegin());
  t->trying = PETSC_TRUE;
  ierr = BuildAndJudge(s, all, a);
  t->trying = PETSC_FALSE;
  /* Messages of later steps must not name these settings. */
  t->doing[0] = '\0';
  PetscCall(HycoCatchEnd(ierr, message));
  t->most_full_order = 0;
  /* An error of another kind (memory, a damaged file) is not a property of the settings. */
  PetscCall(HycoCatchNoModel(ierr, message));
  if (message[0]) a->ratio = PETSC_INFINITY;
  if (!(a->ratio <= 1) && t->remedy[0]) PetscCall(PetscStrncpy(s->remedy, t->remedy, sizeof(s->remedy)));
  PetscCall(PetscStrncpy(a->failure, message, sizeof(a->failure)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The next attempt; none if the budget is used up. Collective. The order of events is that of the monitor:
   attempt, counts, report. `all`: a dropped attempt is judged to its end, whatever is spent. */
static PetscErrorCode SearchTry(Search *s, const HycoReducerSettings *settings, PetscBool all)
{
  HycoReducer t = s->t;
  HycoAttempt *a = &s->attempt[s->n];

  PetscFunctionBegin;
  if (s->n == MAX_ATTEMPTS || (!all && !SearchIsAffordable(s, settings))) {
    s->ended = PETSC_TRUE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  /* Only the last attempt's model is kept: it may be as large as all training data. */
  PetscCall(HycoROMDestroy(&s->kept));
  PetscCall(PetscMemzero(a, sizeof(*a)));
  a->number = ++s->n;
  a->settings = *settings;
  a->dropped_at = -1;
  PetscCall(HycoSamplesGet(t->held, &a->n_held, NULL, NULL));
  PetscCall(SearchMake(s, settings, all, a));
  PetscCall(SearchCount(s, a));
  if (t->attempt) HycoOnRoot(HycoComm(t), t->attempt(a, t->attempt_ctx));
  if (t->phase) HycoOnRoot(HycoComm(t), t->phase("settings tried", s->n, 0, t->phase_ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The settings of a size where no option fixes them. */
static HycoReducerSettings SettingsFor(const Search *s, const Size *size)
{
  const PetscBool *pinned = s->t->pinned;
  HycoReducerSettings r = s->given;

  if (!pinned[HYCO_CHOICE_TOLERANCE]) r.pod_tol = size->tol;
  if (!pinned[HYCO_CHOICE_LAYERS]) r.layers = PetscMax(size->layers, 0);
  if (!pinned[HYCO_CHOICE_EXTENSION]) r.contact_extension = size->extended ? s->extension : 0;
  if (!pinned[HYCO_CHOICE_WHOLE]) r.whole = (PetscBool)(size->layers == WHOLE);
  return r;
}

/* Bitwise equality of the numbers suffices: settings are taken from lists, not computed. */
static PetscBool SearchIsSame(const HycoReducerSettings *a, const HycoReducerSettings *b)
{
  return (PetscBool)(strcmp(a->type, b->type) == 0 && a->pod_tol == b->pod_tol && a->layers == b->layers &&
                     a->whole == b->whole && a->contact_extension == b->contact_extension && a->hybrid == b->hybrid &&
                     a->plane == b->plane);
}

/* Whether the whole mesh as RID gives a useful model: not if every unknown would be full order, unless there are
   few. */
static PetscBool WholeIsSmall(HycoReducer t, HycoHybrid hybrid)
{
  const PetscBool all = (PetscBool)(hybrid == HYCO_HYBRID_ALL || 2 * t->sizes[2] > t->sizes[0]);

  return (PetscBool)(!all || t->sizes[0] * t->sizes[3] <= FEW_UNKNOWNS);
}

/* Whether an RID at least as large as one with too many unknowns would keep all of them full order. */
static PetscBool IsTooLarge(Search *s, const HycoReducerSettings *r)
{
  char why[HYCO_LINE];

  if (r->hybrid != HYCO_HYBRID_ALL || s->t->pinned[HYCO_CHOICE_HYBRID] || s->t->exhaustive) return PETSC_FALSE;
  for (PetscInt k = 0; k < s->n; k++) {
    const HycoAttempt *a = &s->attempt[k];
    const HycoReducerSettings *b = &a->settings;

    /* Larger in every setting that adds cells or modes: then the RID contains the other one. */
    if (strcmp(b->type, r->type) || a->n_unknowns <= MANY_UNKNOWNS || b->plane || r->pod_tol > b->pod_tol ||
        r->layers < b->layers || r->contact_extension < b->contact_extension || (b->whole && !r->whole))
      continue;
    snprintf(why, sizeof(why), "its RID has %d unknowns, and with more than %d the dense matrix is too expensive",
             (int)a->n_unknowns, MANY_UNKNOWNS);
    LeaveOut(s, "hybrid all", PETSC_TRUE, why);
    return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* Whether the last of the attempts from `first` on has the errors of the one before it. */
static PetscBool HasNoEffect(const Search *s, PetscInt first)
{
  const HycoAttempt *a = &s->attempt[s->n - 1], *b = a - 1;

  if (s->n < first + 2 || !(a->ratio < PETSC_INFINITY) || !(b->ratio < PETSC_INFINITY)) return PETSC_FALSE;
  return (PetscBool)(a->dropped_at == b->dropped_at && PetscAbsReal(a->ratio - b->ratio) <= NO_EFFECT * b->ratio);
}

/* The number of attempts in a row, up to the last one, without progress. With large errors, and for paths, whose
   dropped attempts do not show it, only those without an effect count, and those of no use if a model stands. */
static PetscInt CountFailedAttempts(const Search *s, PetscInt first, PetscReal least, PetscInt stale)
{
  const PetscBool slow = (PetscBool)(least <= HOPELESS_ERROR && !s->t->scene->n_times);

  if (s->t->scene->n_times && !IsUseful(&s->attempt[s->n - 1]) && SearchHasModel(s)) return stale + 1;
  if (s->attempt[s->n - 1].ratio < PROGRESS * least) return 0;
  return slow || HasNoEffect(s, first) ? stale + 1 : 0;
}

/* The settings of a kind for a size. For types without an RID its settings are the given ones, so that sizes which
   differ in them alone are found to be the same. */
static HycoReducerSettings KindFor(const Search *s, const HycoROM type, HycoHybrid hybrid, const Size *size)
{
  HycoReducerSettings r = SettingsFor(s, size);

  r.type = type->model->type;
  r.rid = (PetscBool)(type->model->traits.settings == HYCO_SETTINGS_RID);
  r.pod = (PetscBool)!HycoReducerOwnModes(s->t, type);
  /* What the user has fixed is never searched. */
  r.hybrid = s->t->pinned[HYCO_CHOICE_HYBRID] ? s->given.hybrid : hybrid;
  if (r.rid) return r;
  r.layers = s->given.layers;
  r.contact_extension = s->given.contact_extension;
  r.whole = s->given.whole;
  return r;
}

/* Tries the sizes in order until one meets the targets, or costs more than settings that do, without those that do not
   differ in the settings that the type reads. */
static PetscErrorCode TrySizes(Search *s, const HycoROM type, HycoHybrid hybrid, PetscBool *met)
{
  const PetscInt first = s->n, most = s->t->exhaustive ? N_SIZES : STALLED_ATTEMPTS;
  PetscReal least = PETSC_INFINITY;
  PetscInt stale = 0;

  PetscFunctionBegin;
  *met = PETSC_FALSE;
  /* Without the user's targets the smallest sizes are not worth an attempt. */
  for (PetscInt k = s->targets ? 0 : FIRST_USUAL; k < N_SIZES && stale < most && !*met; k++) {
    const HycoReducerSettings r = KindFor(s, type, hybrid, &sizes[k]);
    PetscBool done = PETSC_FALSE;

    for (PetscInt j = first; j < s->n; j++) done = (PetscBool)(done || SearchIsSame(&r, &s->attempt[j].settings));
    if (done || (r.whole && !s->given.whole && !WholeIsSmall(s->t, hybrid)) || IsTooLarge(s, &r)) continue;
    PetscCall(SearchTry(s, &r, PETSC_FALSE));
    if (s->ended) break;
    stale = CountFailedAttempts(s, first, least, stale);
    if (!s->attempt[s->n - 1].beaten_by || s->attempt[s->n - 1].dropped_at >= 0)
      least = PetscMin(least, s->attempt[s->n - 1].ratio);
    else
      *met = PETSC_TRUE;
    *met = (PetscBool)(*met || least <= 1);
    if (stale == most && k + 1 < N_SIZES)
      LeaveOut(s, r.rid ? "larger RIDs and more modes" : "more modes", PETSC_TRUE, "they did not lower the errors");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Counts the contacts whose slave is in a group of supports. */
static PetscErrorCode CountContacts(HycoReducer t, const char group[], PetscInt *n)
{
  const HycoMesh m = t->fom->surface;
  const HycoPairs *pairs = &t->fom->pairs;
  PetscBool *in;
  PetscInt g = 0;

  PetscFunctionBegin;
  *n = 0;
  PetscCall(HycoMeshFindGroup(m, "fixed", group, &g));
  PetscCall(PetscCalloc1(m->n_nodes, &in));
  for (PetscInt k = m->group_start[g]; k < m->group_start[g + 1]; k++) in[m->group_node[k]] = PETSC_TRUE;
  /* Contacts on the plane: the plane with most of them cuts the contact zone. */
  for (PetscInt k = 0; k < pairs->n; k++) *n += in[HycoPairsSlave(pairs, k)];
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The support that is most probably a plane of symmetry across the contacts: it fixes one component at 0, and most
   of the contacts have nodes on it; the first among equals; -1: none. Rank 0. A support whose value depends on
   space, a parameter or time is no plane of symmetry. */
static PetscErrorCode FindPlane(HycoReducer t, PetscInt *plane)
{
  const HycoScene s = t->scene;
  PetscBool every[HYCO_MAX_PARAMETERS];
  PetscInt most = 2;

  PetscFunctionBegin;
  *plane = -1;
  for (PetscInt p = 0; p < HYCO_MAX_PARAMETERS; p++) every[p] = PETSC_TRUE;
  for (PetscInt k = 0; k < s->n_fixed; k++) {
    /* The value does not depend on space here, so that any point serves. */
    const PetscReal origin[3] = {0, 0, 0};
    PetscInt held = 0, n;
    PetscReal value = 0;

    for (PetscInt c = 0; c < 3; c++) {
      const HycoExpr e = s->fixed[k].value[c];

      if (!e) continue;
      held++;
      if (HycoExprInSpace(e) || HycoExprChanges(e, every)) value = 1;
      if (value == 0) PetscCall(HycoExprEval(e, t->fom->fe_surface->mu, 1, origin, &value));
    }
    if (held != 1 || value != 0) continue;
    PetscCall(CountContacts(t, s->fixed[k].group, &n));
    if (n <= most) continue;
    most = n;
    *plane = k;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Only for paths in 3D. */
PetscErrorCode HycoReducerFindPlane(HycoReducer t, const char **group)
{
  PetscInt plane = -1;

  PetscFunctionBegin;
  if (t->scene->n_times && t->sizes[3] == 3) HycoOnRoot(HycoComm(t), FindPlane(t, &plane));
  PetscCallMPI(MPI_Bcast(&plane, 1, MPIU_INT, 0, HycoComm(t)));
  *group = plane < 0 ? NULL : t->scene->fixed[plane].group;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For paths, the equations in a small RID hardly determine modes that no load affects there, unless the RID cuts the
   bodies from side to side. The cells at a plane of symmetry do, and all nodes of the plane are inside. */
static PetscErrorCode TryPlanes(Search *s, const HycoROM type, PetscBool *met)
{
  const PetscBool *pinned = s->t->pinned;

  PetscFunctionBegin;
  *met = PETSC_FALSE;
  if (!s->plane || s->given.whole || (pinned[HYCO_CHOICE_HYBRID] && s->given.hybrid != HYCO_HYBRID_ALL))
    PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < N_PLANES && !*met; k++) {
    const Size size = {plane_tol[k], 0, PETSC_FALSE};
    HycoReducerSettings r = SettingsFor(s, &size);

    r.type = type->model->type;
    r.rid = r.pod = PETSC_TRUE;
    r.hybrid = HYCO_HYBRID_ALL;
    r.plane = s->plane;
    /* The further attempts only differ in the tolerance. */
    if (k && pinned[HYCO_CHOICE_TOLERANCE]) break;
    PetscCall(SearchTry(s, &r, PETSC_FALSE));
    if (s->ended) break;
    *met = (PetscBool)(s->attempt[s->n - 1].ratio <= 1);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Tries all of A full order, if "auto" keeps the contacts' displacements and is not accurate enough. In the order of
   cost, so that the dearer ones are not tried if a cheaper one is enough. */
static PetscErrorCode TryHybrids(Search *s, const HycoROM type)
{
  PetscBool met = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(TryPlanes(s, type, &met));
  if (met || s->ended) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(TrySizes(s, type, HYCO_HYBRID_AUTO, &met));
  if (!met && !s->ended && !s->t->pinned[HYCO_CHOICE_HYBRID] && s->t->sizes[2])
    PetscCall(TrySizes(s, type, HYCO_HYBRID_ALL, &met));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One attempt for each variant of a type whose online cost hardly depends on the modes, until one meets the targets. */
static PetscErrorCode TryOne(Search *s, const HycoROM type)
{
  static const char *const one[] = {NULL, NULL};
  const Size size = {1e-12, 1, PETSC_FALSE};
  const char *const *variant;
  HycoReducerSettings r = SettingsFor(s, &size);
  PetscBool met = PETSC_FALSE;

  PetscFunctionBegin;
  r.type = type->model->type;
  r.rid = PETSC_FALSE;
  r.pod = (PetscBool)!HycoReducerOwnModes(s->t, type);
  if (s->t->scene->n_times) r.layers = s->given.layers; /* its mesh consists of the cells of its modes */
  /* Variants are the type's own: it must be set before they are asked for. */
  PetscCall(HycoReducerSetType(s->t, r.type));
  variant = HycoReducerVariants(s->t);
  if (!variant) variant = one;
  do {
    r.variant = *variant++;
    PetscCall(SearchTry(s, &r, PETSC_FALSE));
    met = (PetscBool)(s->attempt[s->n - 1].ratio <= 1 && !s->t->exhaustive);
    /* Ordered by cost: the first that meets the targets is the cheapest. */
  } while (*variant && !met && !s->ended);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether these settings end the search: by their errors, with a margin unless their type has modes of its own, which
   is cheaper than others and may save the training solutions. */
static PetscBool SearchEndsWith(const Search *s, const HycoAttempt *best)
{
  return (PetscBool)(best && best->ratio <= (best->number <= s->n_own ? 1 : ENDING_MARGIN) && !s->t->exhaustive);
}

/* Lets a type refuse the scene's contacts, one with modes of its own the scene: why. Collective. begin() needs the
   type's options: the type is set, and a refusal is caught with its message. */
static PetscErrorCode SearchRefuse(HycoReducer t, const HycoROM type, char why[HYCO_LINE])
{
  HycoTrainerOps trainer;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoTrainerFind(type->model->type, &trainer));
  HycoCatch(HycoReducerCheckContacts(t, type), ierr, why);
  PetscCall(HycoCatchNoModel(ierr, why));
  /* A refusal by the contacts needs no further check. */
  if (why[0] || !type->model->traits.own_modes || !trainer.begin) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoReducerSetType(t, type->model->type));
  HycoCatch((*trainer.begin)(t), ierr, why);
  PetscCall(HycoCatchNoModel(ierr, why));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a type offers a model of the scene, within the operations that the search may take; otherwise why may be
   set. Collective. */
static PetscErrorCode SearchIsOffered(Search *s, const HycoROM type, PetscBool *offered, PetscBool *possible,
                                      char why[HYCO_LINE])
{
  HycoReducer t = s->t;
  PetscReal work = 0, most = s->budget;
  HycoTrainerOps trainer;

  PetscFunctionBegin;
  PetscCall(HycoTrainerFind(type->model->type, &trainer));
  PetscCall(SearchRefuse(t, type, why));
  *possible = (PetscBool)!why[0];
  /* Refused: the reason goes into the report. */
  if (why[0]) PetscFunctionReturn(PETSC_SUCCESS);
  *offered = (*trainer.offers)(t, s->targets, HYCO_LINE, why);
  /* In operations, as the budget: seconds would make the choice depend on the machine. */
  if (*offered && trainer.work) work = (*trainer.work)(t);
  if (t->late) most *= 2; /* for it may save the training solutions */
  if (work > most && most <= 0)
    HycoFormat(why, "its training would take %.1e operations, and -hyco_search_budget 0 allows none", (double)work);
  else if (work > most)
    HycoFormat(why,
               "its training would take %.1e operations, and the search may take %.1e; -hyco_search_budget %.2g allows "
               "it",
               (double)work, (double)most, (double)(t->search_budget * work / most) * 1.1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a type is tried; otherwise, if the user should know, it is noted with the reason. HycoAttemptsChoose()
   on the attempts so far: whether they end the search is asked before a type is set up. */
static PetscErrorCode SearchIsApplicable(Search *s, const HycoROM type, PetscBool *wanted)
{
  HycoReducer t = s->t;
  const HycoAttempt *best = HycoAttemptsChoose(s->n, s->attempt);
  char why[HYCO_LINE] = "";
  PetscBool possible = PETSC_TRUE;
  HycoTrainerOps trainer;

  PetscFunctionBegin;
  *wanted = (PetscBool)(strcmp(type->model->type, s->given.type) == 0);
  /* The user's type is the only one. */
  if (t->pinned[HYCO_CHOICE_TYPE]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoTrainerFind(type->model->type, &trainer));
  *wanted = (PetscBool)(trainer.offers != NULL);
  if (*wanted && !type->model->traits.history && t->scene->n_times) {
    *wanted = possible = PETSC_FALSE;
    if (type->model->traits.own_modes) HycoFormat(why, "it does not support scenes with a history");
  }
  /* A search that has ended does not set up a type that learns by itself. */
  if (*wanted && !(HycoReducerOwnModes(t, type) && SearchEndsWith(s, best)))
    PetscCall(SearchIsOffered(s, type, wanted, &possible, why));
  if (*wanted && SearchEndsWith(s, best))
    snprintf(why, sizeof(why),
             t->late                    ? "settings %d are accurate enough, without training solutions"
             : best->number <= s->n_own ? "settings %d are accurate enough"
                                        : "settings %d are accurate by a margin",
             (int)best->number);
  if (why[0]) LeaveOut(s, type->model->type, possible, why);
  *wanted = (PetscBool)(*wanted && !why[0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* `own`: the types with modes of their own, or the others. */
static PetscErrorCode TryType(Search *s, const char name[], PetscBool own)
{
  const PetscReal budget = s->budget, spent = s->spent;
  HycoROM type;
  PetscBool met, wanted;

  PetscFunctionBegin;
  PetscCall(HycoROMCreate(&type));
  PetscCall(HycoROMSetType(type, name));
  wanted = PETSC_FALSE;
  if (HycoReducerOwnModes(s->t, type) == own) PetscCall(SearchIsApplicable(s, type, &wanted));
  if (wanted && type->model->traits.settings == HYCO_SETTINGS_NONE) PetscCall(TryOne(s, type));
  if (wanted && type->model->traits.settings == HYCO_SETTINGS_RID) PetscCall(TryHybrids(s, type));
  if (wanted && type->model->traits.settings == HYCO_SETTINGS_MODES)
    PetscCall(TrySizes(s, type, HYCO_HYBRID_AUTO, &met));
  if (wanted && type->model->traits.own_modes) {
    s->n_own = s->n;
    /* The other types, which may be the accurate ones, keep theirs, also in later rounds. */
    s->own += s->spent - spent;
    s->budget = budget + s->spent - spent;
    s->n_models = 0;
    s->ended = PETSC_FALSE;
  }
  PetscCall(HycoROMDestroy(&type));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Tries the types with modes of their own, or the others, in the order of their names. */
static PetscErrorCode TryAll(Search *s, PetscBool own)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; s->types[k] && !s->ended; k++) PetscCall(TryType(s, s->types[k], own));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The solutions of the bases: those at the training points, which are solved now if they were not; for types with modes
   of their own those at the held-out points, if there are enough and training points are not solved. Every later
   HycoReducerReduce() uses these; the caller notes that earlier bases are stale. */
static PetscErrorCode TakeColumns(HycoReducer t, HycoSnapshots store, PetscBool own)
{
  PetscInt n = 0;

  PetscFunctionBegin;
  if (t->held) PetscCall(HycoSamplesGet(t->held, &n, NULL, NULL));
  if (t->late && own && n >= HYCO_FEW_HELD) {
    PetscCall(HycoReducerSetColumns(t, t->held));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  /* The first type that learns from solutions pays for them. */
  if (t->late) PetscCall(HycoReducerSolve(t, store, t->samples));
  t->late = PETSC_FALSE;
  PetscCall(HycoReducerSetColumns(t, t->samples));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The attempt chosen so far; a dropped one that may be chosen now is judged first. */
static PetscErrorCode SearchChoose(Search *s, HycoAttempt **chosen)
{
  HycoAttempt *again;

  PetscFunctionBegin;
  while (s->n < MAX_ATTEMPTS && (again = HycoAttemptsReopen(s->n, s->attempt))) {
    const HycoReducerSettings settings = again->settings;

    /* Before the attempt, which gets a number of its own: a loop must not find this one again. */
    again->reopened = PETSC_TRUE;
    PetscCall(SearchTry(s, &settings, PETSC_TRUE));
  }
  *chosen = HycoAttemptsChoose(s->n, s->attempt);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether all settings are fixed, or there are no held-out points. */
static PetscBool SearchIsSettled(HycoReducer t)
{
  PetscBool open = PETSC_FALSE;

  for (PetscInt k = 0; k < HYCO_CHOICE_WHOLE; k++) open = (PetscBool)(open || !t->pinned[k]);
  if (t->pinned[HYCO_CHOICE_TYPE] && t->prototype->model->traits.settings == HYCO_SETTINGS_NONE)
    open = (PetscBool)(HycoReducerVariants(t) != NULL);
  return (PetscBool)(!t->search || !t->held || !open);
}

/* Correlation of the held-out points' errors with their distance from the nearest training value of parameter p. */
static PetscReal SearchCorrelation(const Search *s, PetscInt n, const PetscReal held[], PetscInt n_train,
                                   const PetscReal train[], PetscInt p)
{
  const PetscInt n_par = s->t->scene->n_parameters;
  PetscReal mean[2] = {0, 0}, square[2] = {0, 0}, both = 0;

  for (PetscInt pass = 0; pass < 2; pass++) {
    for (PetscInt k = 0; k < n; k++) {
      PetscReal x = PETSC_MAX_REAL;
      /* Errors scatter over decades: their logarithm, cut where points did not converge. */
      const PetscReal y = PetscLogReal(PetscMin(PetscMax(s->ratio[k], 1e-6), 1e6));

      for (PetscInt i = 0; i < n_train; i++) x = PetscMin(x, PetscAbsReal(train[i * n_par + p] - held[k * n_par + p]));
      if (!pass) {
        mean[0] += x / n;
        mean[1] += y / n;
      } else {
        square[0] += (x - mean[0]) * (x - mean[0]);
        square[1] += (y - mean[1]) * (y - mean[1]);
        both += (x - mean[0]) * (y - mean[1]);
      }
    }
  }
  return square[0] > 0 && square[1] > 0 ? both / PetscSqrtReal(square[0] * square[1]) : 0;
}

/* The parameter whose training values are too far apart (-1: none in particular). */
static PetscErrorCode FindExplanatoryParameter(Search *s, HycoSamples samples, PetscInt *by)
{
  PetscInt n, n_train;
  const PetscReal *held, *train;
  PetscReal largest = EXPLANATORY_CORRELATION;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(s->t->held, &n, NULL, &held));
  PetscCall(HycoSamplesGet(samples, &n_train, NULL, &train));
  *by = -1;
  for (PetscInt p = 0; p < s->t->scene->n_parameters; p++) {
    const PetscReal c = SearchCorrelation(s, n, held, n_train, train, p);

    /* Errors that grow with the distance from the training values of one parameter name that parameter. */
    if (c > largest) {
      largest = c;
      *by = p;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds unseen points, each near one of the held-out points with the largest errors, which stay unseen; and finds the
   parameter whose training values are too far apart. */
static PetscErrorCode AddPoints(Search *s, HycoSamples samples, PetscInt n_add, PetscInt *added, PetscInt *by)
{
  HycoReducer t = s->t;
  const PetscInt n_par = t->scene->n_parameters, among = 8 * n_add;
  PetscInt n, m, *order;
  const PetscReal *held, *mu;
  PetscReal *key;
  PetscBool *used;
  HycoSamples drawn, unseen;

  PetscFunctionBegin;
  *added = 0;
  PetscCall(HycoSamplesGet(t->held, &n, NULL, &held));
  PetscCall(FindExplanatoryParameter(s, samples, by));
  /* Eight times as many candidates as points: each added one can be near a bad held-out point without being it. */
  PetscCall(HycoSamplesOutsideTraining(samples, t->drawn, among, 1, NULL, &drawn));
  t->drawn += among;
  PetscCall(HycoSamplesExcept(drawn, t->held, &unseen));
  PetscCall(HycoSamplesDestroy(&drawn));
  PetscCall(HycoSamplesGet(unseen, &m, NULL, &mu));
  PetscCall(PetscMalloc2(n, &key, n, &order));
  PetscCall(PetscCalloc1(m, &used));
  for (PetscInt k = 0; k < n; k++) {
    key[k] = -s->ratio[k];
    order[k] = k;
  }
  PetscCall(PetscSortRealWithArrayInt(n, key, order));
  for (PetscInt k = 0; k < PetscMin(n, n_add); k++) {
    PetscReal least = PETSC_MAX_REAL;
    PetscInt at = -1;

    for (PetscInt j = 0; j < m; j++) {
      const PetscReal d = HycoEstimatesDistance(t->scene, held + order[k] * n_par, mu + j * n_par);

      if (used[j] || d >= least) continue;
      least = d;
      at = j;
    }
    if (at < 0) break;
    used[at] = PETSC_TRUE;
    PetscCall(HycoSamplesAddPoint(samples, mu + at * n_par));
    ++*added;
  }
  PetscCall(PetscFree2(key, order));
  PetscCall(PetscFree(used));
  PetscCall(HycoSamplesDestroy(&unseen));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Frees the data of attempts. Also frees rows of attempts that were never chosen; ratio and order belong to the
   held-out points of these. */
static void SearchReset(Search *s)
{
  for (PetscInt k = 0; k < s->n; k++) (void)!PetscFree(s->rows[k]);
  (void)!PetscFree2(s->ratio, s->order);
  s->n = s->n_own = 0;
  s->force = 0;
}

/* Whether the options set a type with modes of its own: further solutions do not change its models. */
static PetscBool IsOwn(HycoReducer t)
{
  return (PetscBool)(t->pinned[HYCO_CHOICE_TYPE] && HycoReducerOwnModes(t, t->prototype));
}

/* The ratios and the order of the held-out points before the first attempt that is judged at them. Again when
   held-out points are added: the arrays have their number. */
static PetscErrorCode BeginHeld(Search *s)
{
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(s->t->held, &n, NULL, NULL));
  PetscCall(PetscFree2(s->ratio, s->order));
  PetscCall(PetscMalloc2(n, &s->ratio, n, &s->order));
  for (PetscInt k = 0; k < n; k++) {
    s->ratio[k] = 1; /* until an attempt gives another value */
    s->order[k] = k;
  }
  /* The scale of forces: known after the first attempt at these points. */
  s->force = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Tries all settings that are not fixed. */
static PetscErrorCode SearchAttempts(Search *s)
{
  PetscFunctionBegin;
  SearchReset(s);
  PetscCall(BeginHeld(s));
  s->least = PETSC_INFINITY;
  s->n_models = s->n_left_out = 0;
  s->ended = PETSC_FALSE;
  s->remedy[0] = '\0';
  PetscCall(HycoReducerSearchBudget(s->t, &s->budget));
  s->budget += s->own; /* which counts in what is spent */
  PetscCall(TakeColumns(s->t, s->store, PETSC_TRUE));
  PetscCall(TryAll(s, PETSC_TRUE));
  if (!SearchEndsWith(s, HycoAttemptsChoose(s->n, s->attempt)) && !IsOwn(s->t)) {
    const HycoSamples before = s->t->columns;
    const PetscBool few = s->t->few;

    PetscCall(HycoReducerHoldOutMore(s->t, s->store));
    if (few) PetscCall(BeginHeld(s));
    PetscCall(TakeColumns(s->t, s->store, PETSC_FALSE));
    /* Bases of held-out points are not those of the training points. */
    s->reduced = (PetscBool)(s->reduced && s->t->columns == before);
    PetscCall(SearchReduce(s));
  }
  PetscCall(TryAll(s, PETSC_FALSE));
  if (s->t->phase) HycoOnRoot(HycoComm(s->t), s->t->phase("settings tried", s->n, s->n, s->t->phase_ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Begins *grown with the first training points, unless it has begun. The caller owns it. A copy: the given set is
   the caller's, who may use it again. */
static PetscErrorCode BeginGrown(Search *s, HycoSamples *grown)
{
  PetscFunctionBegin;
  if (*grown) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSamplesCreate(s->t->scene, grown));
  PetscCall(HycoSamplesAddSet(*grown, s->t->samples));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Trains on these points from now on; solves those that are not solved. Bases are of the former set, hence not
   reduced. */
static PetscErrorCode TrainOn(Search *s, HycoSamples grown)
{
  HycoReducer t = s->t;

  PetscFunctionBegin;
  t->samples = grown;
  s->reduced = PETSC_FALSE;
  PetscCall(HycoReducerSetColumns(t, grown));
  PetscCall(HycoReducerSolve(t, s->store, grown));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What would help next if the errors are too large, beside more points. */
static PetscErrorCode SearchAdvise(Search *s, HycoTraining *report)
{
  HycoReducer t = s->t;
  PetscInt by;
  static const char other[] = "try -hyco_model_type cubature (docs/models.md)";
  char values[HYCO_LINE / 4] = "", *next = report->next;
  PetscBool cubature = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(FindExplanatoryParameter(s, t->samples, &by));
  /* More values of one parameter cost fewer solutions than more of all. Modes of a type's own do not follow them. */
  if (by >= 0 && report->chosen.settings.pod)
    snprintf(values, sizeof(values), "give more values of %s, whose training values are too far apart",
             t->scene->parameter[by]);
  next[0] = '\0';
  for (PetscInt k = 0; k < s->n_left_out && !next[0]; k++) {
    /* Only a type that was left out can be tried; other notes are of settings. */
    for (PetscInt j = 0; s->types[j]; j++) {
      if (s->left_out[k].possible && strcmp(s->left_out[k].what, s->types[j]) == 0)
        snprintf(next, sizeof(report->next), "try -hyco_model_type %s, which the search left out (%s)", s->types[j],
                 s->left_out[k].why);
    }
  }
  if (s->remedy[0]) snprintf(next, sizeof(report->next), "%s", s->remedy);
  if (!next[0] && s->ended)
    snprintf(next, sizeof(report->next), "let the search go on (-hyco_search_budget, -hyco_search_exhaustive)");
  if (values[0] && strlen(next) + strlen(values) + 5 < sizeof(report->next)) {
    if (next[0]) strcat(next, "; or ");
    strcat(next, values);
  }
  if (report->chosen.settings.rid) PetscCall(HycoReducerTakesCubature(t, &cubature));
  if (cubature && strlen(next) + strlen(other) + 5 < sizeof(report->next)) {
    if (next[0]) strcat(next, "; or ");
    strcat(next, other);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Puts into the report what the search has done. After BuildChosen(), whose report is overwritten by what belongs
   to the search. */
static PetscErrorCode SearchWriteReport(Search *s, const HycoAttempt *best, HycoTraining *report)
{
  PetscFunctionBegin;
  report->chosen = *best;
  report->chosen.of = s->n;
  report->search_operations = s->spent;
  PetscCall(HycoReducerSolutionsWork(s->t, &report->solution_operations));
  report->n_left_out = s->n_left_out;
  PetscCall(PetscArraycpy(report->left_out, s->left_out, s->n_left_out));
  PetscCall(SearchAdvise(s, report));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The model with the settings that are set: that of the attempt, if it was kept. */
static PetscErrorCode BuildChosen(Search *s, const HycoAttempt *best, HycoROM *model, HycoTraining *built)
{
  PetscFunctionBegin;
  /* The pointer moves: s->kept must not be destroyed with the search. */
  if (s->kept && best->number == s->n) {
    *model = s->kept;
    *built = s->kept_report;
    s->kept = NULL;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SearchReduce(s));
  PetscCall(TakeModes(s->t, s->store));
  PetscCall(HycoReducerBuild(s->t, PETSC_TRUE, model, built));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Builds the model with the best settings; if the scan of the ranges or its own training solutions refuse it, the
   next one. */
static PetscErrorCode BuildBest(Search *s, HycoROM *model, HycoTraining *report)
{
  HycoReducer t = s->t;
  HycoAttempt *best = NULL;
  PetscErrorCode ierr;
  char message[HYCO_LINE] = "";

  PetscFunctionBegin;
  for (;;) {
    HycoTraining built = {0};

    PetscCall(SearchChoose(s, &best));
    if (!best) break;
    PetscCall(SetSettings(t, &best->settings));
    HycoCatch(BuildChosen(s, best, model, &built), ierr, message);
    PetscCall(HycoCatchNoModel(ierr, message));
    if (message[0]) {
      PetscCall(PetscStrncpy(best->failure, message, sizeof(best->failure)));
      continue;
    }
    built.n_added = report->n_added;
    built.n_former = report->n_former;
    built.n_fresh = report->n_fresh;
    *report = built;
    PetscCall(SearchWriteReport(s, best, report));
    /* The reducer owns them now, and calibrates with them. */
    t->judged_held = s->rows[best->number - 1];
    s->rows[best->number - 1] = NULL;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt k = s->n - 1; k > 0 && !best; k--) { /* one that is not refused for its cost */
    if (s->attempt[k].settings.hybrid != HYCO_HYBRID_ALL) best = &s->attempt[k];
  }
  if (!s->n)
    HycoFail("no type of model was tried%s%s%s%s; give -hyco_model_type", s->n_left_out ? "; " : "",
             s->n_left_out ? s->left_out[0].what : "", s->n_left_out ? ": " : "",
             s->n_left_out ? s->left_out[0].why : "");
  HycoFail("none of %d settings gave a model; the error of one of them: %s", (int)s->n,
           (best ? best : &s->attempt[0])->failure);
}

/* Exchanges the modes of the last bases with those of the former model. */
static void SwapModes(Search *s)
{
  const Mat V = s->t->V;
  const PetscInt l = s->t->l;

  s->t->V = s->former_V;
  s->t->l = s->former_l;
  s->former_V = V;
  s->former_l = l;
}

/* The former model becomes this one, with its report and a copy of its modes; or none. */
static PetscErrorCode SetFormer(Search *s, HycoROM model, const HycoTraining *report)
{
  PetscFunctionBegin;
  PetscCall(HycoROMDestroy(&s->former));
  PetscCall(MatDestroy(&s->former_V));
  s->former = model;
  if (!model) PetscFunctionReturn(PETSC_SUCCESS);
  s->former_report = *report;
  s->former_l = s->t->l;
  if (s->t->V) PetscCall(MatDuplicate(s->t->V, MAT_COPY_VALUES, &s->former_V));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* *worst: the largest quotient of an error and its target at the held-out points. */
static PetscErrorCode WorstQuotient(Search *s, HycoROM model, PetscReal *worst)
{
  HycoHeldOut *rows;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoSamplesGet(s->t->held, &n, NULL, NULL));
  PetscCall(PetscMalloc1(n + 1, &rows));
  HycoOnError(HycoReducerPredictHeldOut(s->t, s->t->held, model, s->store, NULL, rows), PetscCall(PetscFree(rows)));
  s->force = HycoHeldOutForce(n, rows);
  *worst = 0;
  for (PetscInt k = 0; k < n; k++) *worst = PetscMax(*worst, SearchQuotient(s, &rows[k]));
  PetscCall(PetscFree(rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of the model (NULL: none) and the former one the better at the present held-out points, which becomes *model with its
   report. */
static PetscErrorCode TakeBetter(Search *s, HycoROM *model, HycoTraining *report)
{
  HycoReducer t = s->t;
  PetscReal former, now = PETSC_MAX_REAL;

  PetscFunctionBegin;
  if (!s->former) PetscFunctionReturn(PETSC_SUCCESS);
  SwapModes(s);
  HycoOnError(WorstQuotient(s, s->former, &former), SwapModes(s));
  SwapModes(s);
  if (*model) PetscCall(WorstQuotient(s, *model, &now));
  if (former < now) {
    const PetscInt n_fresh = report->n_fresh;

    PetscCall(HycoROMDestroy(model));
    *model = s->former;
    *report = s->former_report;
    report->n_fresh = n_fresh;
    report->n_left_out = s->n_left_out;
    PetscCall(PetscArraycpy(report->left_out, s->left_out, s->n_left_out));
    s->former = NULL;
    SwapModes(s);
    PetscCall(SetSettings(t, &report->chosen.settings));
    PetscCall(PetscFree(t->judged_held)); /* of the other */
  }
  PetscCall(SetFormer(s, NULL, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Builds the best model before solutions are added: what follows may fail, or give none that is better. */
static PetscErrorCode KeepBest(Search *s, const HycoTraining *report)
{
  HycoROM model = NULL;
  HycoTraining built = *report;
  PetscErrorCode ierr;
  char message[HYCO_LINE] = "";

  PetscFunctionBegin;
  HycoCatch(BuildBest(s, &model, &built), ierr, message);
  if (ierr && ierr != HYCO_ERR_NO_MODEL && ierr != PETSC_ERR_USER) SETERRQ(PETSC_COMM_SELF, ierr, "%s", message);
  if (ierr) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(TakeBetter(s, &model, &built));
  PetscCall(SetFormer(s, model, &built));
  PetscCall(PetscFree(s->t->judged_held));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether an error ends the search although it has a model: not of a solve at a point that was added, or of an
   attempt. */
static PetscErrorCode SearchSurvive(Search *s, PetscErrorCode ierr, const char message[], PetscBool has)
{
  char line[HYCO_LINE];

  PetscFunctionBegin;
  if (!ierr) PetscFunctionReturn(PETSC_SUCCESS);
  if (!has || (ierr != HYCO_ERR_NO_MODEL && ierr != PETSC_ERR_USER)) SETERRQ(PETSC_COMM_SELF, ierr, "%s", message);
  HycoFormat(line, "they end with: %s", message);
  LeaveOut(s, "further solutions", PETSC_FALSE, line);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Attempts, and solutions added until the targets are met or the budget is used up: in *grown, with the first ones
   (NULL: none was added; the caller owns it). The list of attempts begins anew with each round; what they have
   spent adds up, and the budget grows with the solutions. */
static PetscErrorCode SearchRounds(Search *s, HycoSamples *grown, HycoTraining *report)
{
  HycoReducer t = s->t;
  const PetscInt budget = t->budget < 0 ? s->first : t->budget;
  PetscInt by = -1, n;

  PetscFunctionBegin;
  for (;;) {
    const PetscInt left = budget - (report->n_added - report->n_former),
                   n_add = PetscMin(PetscMax(2, s->first / ROUND), left);

    PetscCall(SearchAttempts(s));
    /* Points are added only for targets: the default limits end with what the user's points give. */
    if (!s->targets || s->least <= 1 || n_add < 1 || !t->scene->n_parameters || IsOwn(t)) break;
    PetscCall(KeepBest(s, report));
    PetscCall(BeginGrown(s, grown));
    PetscCall(AddPoints(s, *grown, n_add, &n, &by));
    /* Every candidate is a training point already. */
    if (!n) break;
    report->n_added += n;
    /* Held-out points have neighbours now: they judge more kindly than a user's points. */
    s->near = PETSC_TRUE;
    if (t->added) HycoOnRoot(HycoComm(t), t->added(n, by, PETSC_FALSE, t->attempt_ctx));
    PetscCall(TrainOn(s, *grown));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Judges the model at fresh held-out points. met: at these and at the former ones it meets the targets. */
static PetscErrorCode JudgeFresh(Search *s, HycoROM model, HycoSamples *former, HycoTraining *report, PetscBool *met)
{
  HycoReducer t = s->t;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoReducerHoldOutFresh(t, s->store, former, &report->n_fresh));
  s->near = PETSC_FALSE;
  PetscCall(PetscFree(t->judged_held));
  PetscCall(HycoSamplesGet(t->held, &n, NULL, NULL));
  PetscCall(PetscMalloc1(n, &t->judged_held));
  PetscCall(HycoReducerPredictHeldOut(t, t->held, model, s->store, NULL, t->judged_held));
  /* Of the new set. */
  s->force = HycoHeldOutForce(n, t->judged_held);
  /* Points near added solutions count too: they are a part of the region. */
  *met = (PetscBool)(s->least <= 1);
  for (PetscInt k = 0; k < n; k++) *met = (PetscBool)(*met && SearchQuotient(s, &t->judged_held[k]) <= 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Builds the best model. If solutions were added near its held-out points, and it misses the targets at fresh ones, or
   missed them at the former, these become training points: *again. */
static PetscErrorCode SearchConclude(Search *s, HycoROM *model, HycoSamples *grown, HycoTraining *report,
                                     PetscBool *again)
{
  HycoReducer t = s->t;
  HycoSamples former;
  HycoTraining best;
  PetscBool met = PETSC_FALSE;
  PetscInt n;

  PetscFunctionBegin;
  *again = PETSC_FALSE;
  PetscCall(BuildBest(s, model, report));
  if (!s->near) PetscCall(TakeBetter(s, model, report));
  if (!s->near) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(JudgeFresh(s, *model, &former, report, &met));
  if (met) PetscCall(SetFormer(s, NULL, NULL));
  if (!met) {
    *again = PETSC_TRUE;
    best = *report;
    PetscCall(TakeBetter(s, model, &best));
    PetscCall(SetFormer(s, *model, &best));
    *model = NULL;
    /* Estimates must not be fitted to points that become training points. */
    PetscCall(PetscFree(t->judged_held));
    PetscCall(HycoSamplesGet(former, &n, NULL, NULL));
    report->n_added += n;
    report->n_former += n;
    if (t->added) HycoOnRoot(HycoComm(t), t->added(n, -1, PETSC_TRUE, t->attempt_ctx));
    PetscCall(HycoSamplesAddSet(*grown, former));
    PetscCall(TrainOn(s, *grown));
  }
  PetscCall(HycoSamplesDestroy(&former));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SearchRound(Search *s, HycoROM *model, HycoSamples *grown, HycoTraining *report, PetscBool *again)
{
  PetscFunctionBegin;
  PetscCall(SearchRounds(s, grown, report));
  PetscCall(SearchConclude(s, model, grown, report, again));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* SearchRounds() tries settings and adds solutions until the targets are met; SearchConclude() builds the best and
   judges it at fresh points. */
static PetscErrorCode SearchAndConclude(Search *s, HycoROM *model, HycoSamples *grown, HycoTraining *report)
{
  HycoReducer t = s->t;
  PetscReal edge = 0;
  PetscBool again = PETSC_TRUE;
  PetscErrorCode ierr;
  char message[HYCO_LINE] = "";

  PetscFunctionBegin;
  /* Before any attempt changes them. */
  HycoReducerGetSettings(t, &s->given);
  HycoOnRoot(HycoComm(t), SurfaceEdge(t, &edge));
  PetscCallMPI(MPI_Bcast(&edge, 1, MPIU_REAL, 0, HycoComm(t)));
  s->extension = EXTENSION * edge;
  PetscCall(HycoReducerFindPlane(t, &s->plane));
  for (PetscInt j = 0; j < HYCO_N_ERRORS; j++) s->targets = (PetscBool)(s->targets || t->target[j] > 0);
  PetscCall(HycoReducerGetTargets(t, s->target, s->limit));
  PetscCall(HycoSamplesGet(t->samples, &s->first, NULL, NULL));
  while (again) {
    HycoCatch(SearchRound(s, model, grown, report, &again), ierr, message);
    PetscCall(SearchSurvive(s, ierr, message, (PetscBool)(s->former != NULL)));
    if (!ierr) continue;
    PetscCall(TakeBetter(s, model, report));
    again = PETSC_FALSE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Destroys what the search has allocated also after an error; model and grown set are the caller's. */
PetscErrorCode HycoReducerLearn(HycoReducer t, HycoSnapshots store, HycoROM *model, HycoSamples *grown,
                                HycoTraining *report)
{
  Search *s;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  *grown = NULL;
  t->plane = NULL;
  /* Nothing to search: one build with the settings as they are. */
  if (SearchIsSettled(t)) {
    PetscCall(TakeColumns(t, store, HycoReducerOwnModes(t, t->prototype)));
    PetscCall(HycoReducerReduce(t, store, PETSC_FALSE));
    PetscCall(TakeModes(t, store));
    PetscCall(HycoReducerBuild(t, PETSC_TRUE, model, report));
    HycoReducerGetSettings(t, &report->chosen.settings);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscNew(&s));
  s->t = t;
  s->store = store;
  PetscCall(HycoTrainerNames(&s->types));
  ierr = SearchAndConclude(s, model, grown, report);
  SearchReset(s);
  /* After an error a model of an earlier attempt may be left. */
  (void)!HycoROMDestroy(&s->kept);
  (void)!SetFormer(s, NULL, NULL);
  PetscCall(PetscFree(s));
  t->ridge = -1;
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
