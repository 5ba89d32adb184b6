/* The training of models of bodies, with a history or without: its options, the model from what it found, reports. */
#include <hycobodiestraining.h>
#include <hycotrainers.h>
#include <string.h>

#define ENTRIES 15

/* Defaults are those that docs/options.md lists; of_history[] are refused where they could do nothing. */
static PetscErrorCode SetFromOptions(HycoReducer t)
{
  static const char *const laws[] = {"auto", "interpolation", "cubature", NULL};
  static const char *const of_history[] = {"-hyco_bodies_inelastic_tol", "-hyco_bodies_cells", "-hyco_bodies_laws",
                                           "-hyco_bodies_cubature_tol"};
  HycoBodiesTraining s;
  PetscBool set[4] = {PETSC_FALSE, PETSC_FALSE, PETSC_FALSE, PETSC_FALSE};

  PetscFunctionBegin;
  PetscCall(PetscNew(&s));
  t->training = s;
  s->pod_tol = 1e-10;
  s->samples = 60;
  s->inelastic_tol = 1e-10;
  s->cells = 2;
  s->cubature_tol = 1e-4;
  s->tol = 1e-5;
  s->most_samples = HYCO_BODIES_SAMPLES;
  PetscObjectOptionsBegin((PetscObject)t);
  PetscCall(HycoOptionsFor("bodies"));
  PetscCall(HycoOptionsReal("-hyco_bodies_pod_tol", "bodies: energy left out of the displacement modes of each body", 0,
                            1, &s->pod_tol, NULL));
  PetscCall(HycoOptionsInt(
      "-hyco_bodies_samples",
      "bodies: contact problems on the surfaces alone whose displacements give the modes; twice as many, up to four "
      "times, while a body has more modes than half of them, and up to twice while the modes miss 0.02 % at others",
      1, 100000, &s->samples, NULL));
  PetscCall(HycoOptionsReal("-hyco_bodies_tol",
                            "bodies: samples of bodies whose shape or ratio of moduli changes are added until the "
                            "relative error of their flexibility at held-out samples is no larger",
                            0, 1, &s->tol, NULL));
  PetscCall(HycoOptionsInt("-hyco_bodies_max_samples",
                           "bodies: largest number of these samples; if it is not given, more of them while they take "
                           "no more operations than a search may",
                           1, 100000, &s->most_samples, &s->limited));
  PetscCall(HycoOptionsFor("bodies, of a history"));
  PetscCall(HycoOptionsReal("-hyco_bodies_inelastic_tol",
                            "bodies, with a history: energy left out of the modes of the inelastic strain", 0, 1,
                            &s->inelastic_tol, &set[0]));
  PetscCall(HycoOptionsInt("-hyco_bodies_cells",
                           "bodies, with a history: number of points with laws for each mode of the inelastic strain",
                           1, 1000000, &s->cells, &set[1]));
  PetscCall(
      HycoOptionsWord("-hyco_bodies_laws",
                      "bodies, with a history: coefficients of the inelastic modes by interpolation at few points, "
                      "or by Galerkin's method with a cubature (auto: where a law yields)",
                      laws, &s->laws, &s->named));
  PetscCall(HycoOptionsReal("-hyco_bodies_cubature_tol",
                            "bodies, with a history: relative error of the cubature in training", 1e-12, 1,
                            &s->cubature_tol, &set[3]));
  PetscOptionsEnd();
  set[2] = s->named;
  for (int k = 0; k < 4; k++)
    HycoCheck(!set[k] || !t->scene || t->scene->n_times,
              "%s is for scenes with a history, and this scene has none; remove it", of_history[k]);
  /* The prototype answers for the type before a model exists (traits, ops): of a history they are those of paths. */
  if (t->scene && t->scene->n_times) PetscCall(HycoBodiesTakePath(t->prototype));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The data of a run; the options, in the same struct, stay. */
static PetscErrorCode BodiesTrainerReset(HycoReducer t)
{
  HycoBodiesTraining s = (HycoBodiesTraining)t->training;

  PetscFunctionBegin;
  PetscCall(HycoBodyPartsDestroy(&s->parts));
  PetscCall(MatDestroy(&s->strains.V));
  PetscCall(PetscFree(s->strains.sigma));
  PetscCall(HycoBodiesDestroy(&s->bodies));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Over paths the laws in few cells, unless an option names how. Which laws serve better shows only at held-out
   paths, so that a search tries both; "auto" would be one of them. */
static const char *const *BodiesTrainerVariants(HycoReducer t)
{
  static const char *const variants[] = {"interpolation", "cubature", NULL};

  return HycoBodiesFlow(t) && !HycoTrainingOfBodies(t)->named ? variants : NULL;
}

/* Interpolation unless cubature is named: the search tries variants in the order of their cost. */
static PetscErrorCode SetVariant(HycoReducer t, const char name[])
{
  PetscFunctionBegin;
  HycoTrainingOfBodies(t)->laws = strcmp(name, "cubature") == 0 ? HYCO_BODIES_CUBATURE : HYCO_BODIES_INTERPOLATION;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The unknowns of the model's mesh whose displacements are exact. */
static PetscErrorCode TakeExact(HycoROM m, HycoSubstructures b)
{
  HycoMesh mesh = m->model->mesh;
  const PetscInt cells = b->inelastic ? b->inelastic->nd : 0;
  PetscInt *sorted, *dof, n = 0, all = b->ns + b->ni + cells;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(all + 1, &sorted));
  PetscCall(PetscArraycpy(sorted, b->dof, b->ns));
  PetscCall(PetscArraycpy(sorted + b->ns, b->inner, b->ni));
  if (cells) PetscCall(PetscArraycpy(sorted + b->ns + b->ni, b->inelastic->dof, cells));
  /* A cell with laws may share nodes with the surfaces or with the cells of the outputs. */
  PetscCall(PetscSortRemoveDupsInt(&all, sorted));
  PetscCall(PetscMalloc1(mesh->n_nodes * mesh->dim + 1, &dof));
  for (PetscInt i = 0; i < mesh->n_nodes * mesh->dim; i++) {
    PetscInt at;

    PetscCall(PetscFindInt(mesh->node_whole[i / mesh->dim] * mesh->dim + i % mesh->dim, all, sorted, &at));
    if (at >= 0) dof[n++] = i;
  }
  PetscCall(HycoROMSetFE(m, HYCO_HYBRID_CONTACT, n, dof));
  HycoFreeAll(&dof, &sorted);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The model takes over what training has made: `bodies` moves, and the empty data of the new model go. Every
   contact is in A_lambda, since every force is exact or an unknown. */
static PetscErrorCode BodiesTrainerMove(HycoROM m, HycoReducer t)
{
  HycoBodiesTraining s = (HycoBodiesTraining)t->training;
  HycoSubstructures none = (HycoSubstructures)m->model->data;

  PetscFunctionBegin;
  PetscCall(HycoBodiesDestroy(&none));
  m->model->data = s->bodies;
  s->bodies = NULL;
  PetscCall(HycoFloatingDestroy(&m->model->floating)); /* their equilibrium is an equation of the model */
  for (PetscInt k = 0; k < m->model->pairs.n; k++) m->model->in_rid[k] = 1;
  PetscCall(TakeExact(m, (HycoSubstructures)m->model->data));
  /* Displacements in the cells with laws are exact: all of their nodes belong to A. */
  if (t->scene->n_times) PetscCall(HycoROMSetDomain(m, NULL));
  PetscCall(HycoReducerJudge(t, m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Mean error of the training displacements, in which a path that does not reach its end counts as wrong by its size:
   one of them does not make the others useless. -1: not known. */
static PetscErrorCode MeanError(HycoROM m, HycoReducer t, PetscReal *mean)
{
  PetscInt n;

  PetscFunctionBegin;
  *mean = m->model->numbers[1];
  if (!t->judged || *mean < 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoSamplesGet(t->columns, &n, NULL, NULL));
  *mean = 0;
  for (PetscInt k = 0; k < n; k++) *mean += (t->judged[k].solved ? t->judged[k].u : 1) / n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses a model of paths that is useless. */
static PetscErrorCode CheckPath(HycoROM m, HycoReducer t)
{
  char worst[HYCO_LINE] = "";
  const HycoBodiesInelastic in = ((HycoSubstructures)m->model->data)->inelastic;
  PetscReal mean;

  PetscFunctionBegin;
  PetscCall(MeanError(m, t, &mean));
  /* Negated, so that a NaN is refused too. */
  if (!(mean < HYCO_USELESS_ERROR)) HycoReducerNameWorst(t, worst);
  HycoCheckModel(
      mean < HYCO_USELESS_ERROR,
      "the model of bodies misses its own training displacements by %.0f %% on average (%d inelastic modes, "
      "%d points)%s: use more points (-hyco_bodies_cells), fewer modes (-hyco_bodies_inelastic_tol), or train "
      "a hybrid model",
      100 * (double)mean, (int)in->m, (int)in->n_points, worst);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0. The ops of paths before the data, because HycoReducerJudge() predicts with them. */
static PetscErrorCode BodiesTrainerBuild(HycoROM m, HycoReducer t)
{
  PetscFunctionBegin;
  if (t->scene->n_times) PetscCall(HycoBodiesTakePath(m));
  PetscCall(BodiesTrainerMove(m, t));
  if (t->scene->n_times) PetscCall(CheckPath(m, t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A path's model has no bound of forces: its errors are those at held-out paths. */
static PetscErrorCode ReportPath(HycoROM m, HycoTraining *r)
{
  HycoSubstructures b = (HycoSubstructures)m->model->data;

  PetscFunctionBegin;
  PetscCall(HycoTrainingAddFact(r, "n_bodies", (PetscReal)b->n));
  PetscCall(HycoTrainingAddFact(r, "n_surface_unknowns", (PetscReal)b->ns));
  PetscCall(HycoTrainingAddFact(r, "n_inelastic_modes", (PetscReal)b->inelastic->m));
  PetscCall(HycoTrainingAddFact(r, "inelastic_amplification", b->inelastic->amplification));
  snprintf(r->summary, sizeof(r->summary),
           "bodies: %d, with %d unknowns on the surfaces that may touch; %d vectors of loads; %d inelastic modes, laws "
           "at %d points, in %d of %d elements; %d displacement modes\n",
           (int)b->n, (int)b->ns, (int)b->r, (int)b->inelastic->m, (int)b->inelastic->n_points,
           (int)m->model->mesh->n_cells, (int)m->model->whole_cells, (int)r->n_modes);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Operations of an iteration: the laws at the model's points, the tangent, and its factor. */
static PetscReal PathCost(HycoReducer t)
{
  const HycoBodiesTraining s = HycoTrainingOfBodies(t);
  const PetscReal m = (PetscReal)s->strains.l, ns = (PetscReal)t->fom->fe->n_sigma,
                  points = s->n_laws ? (PetscReal)s->n_laws : (PetscReal)s->cells * m;

  return points * (2 * ns * ns * m + 2 * ns * m * m) + m * m * m;
}

/* The summary is a line for the user; the facts are the same numbers for scripts. */
static PetscErrorCode BodiesTrainerReport(HycoReducer t, HycoROM m, HycoTraining *r)
{
  HycoSubstructures b = (HycoSubstructures)m->model->data;
  const char *filled = "; displacements still need more modes than half of the samples, so that those away from the "
                       "contact are less accurate (-hyco_bodies_samples)";
  const HycoBodiesTraining s = HycoTrainingOfBodies(t);
  char bound[HYCO_LINE];

  PetscFunctionBegin;
  if (t->scene->n_times) {
    PetscCall(ReportPath(m, r));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoTrainingAddFact(r, "n_bodies", (PetscReal)b->n));
  PetscCall(HycoTrainingAddFact(r, "n_surface_unknowns", (PetscReal)b->ns));
  PetscCall(HycoTrainingAddFact(r, "n_body_samples", (PetscReal)HycoBodiesGrid(b, 0, NULL)));
  PetscCall(HycoTrainingAddFact(r, "n_body_factors", (PetscReal)HycoTrainingOfBodies(t)->n_factors));
  PetscCall(HycoTrainingAddFact(r, "force_bound", b->forces));
  if (b->n_theta)
    snprintf(bound, sizeof(bound),
             "%d samples of their shapes and stiffnesses, contact forces within %.2g %% (bound at "
             "held-out samples)%s%s",
             (int)HycoBodiesGrid(b, 0, NULL), 100 * (double)b->forces, s->ended[0] ? "; for less " : "", s->ended);
  else
    snprintf(bound, sizeof(bound), "nothing is interpolated, contact forces are exact");
  HycoFormat(r->summary,
             "%d bod%s with %d unknowns on the surfaces that may touch and %d exact ones inside; %s; %d independent "
             "load%s, %d "
             "displacement modes%s\n",
             (int)b->n, b->n == 1 ? "y" : "ies", (int)b->ns, (int)b->ni, bound, (int)b->r, b->r == 1 ? "" : "s",
             (int)r->n_modes, s->filled ? filled : "");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of a prediction, so that a search can compare types: W of the closed contacts and its factor, then the modes on
   the model's mesh. */
static PetscReal BodiesTrainerCost(HycoReducer t, const HycoAttempt *a)
{
  const PetscReal active = HYCO_ASSUMED_CLOSED * (PetscReal)t->sizes[2], row = ENTRIES * active;

  if (t->scene->n_times) return PathCost(t);
  return row * row + active * active * active / 3 + 2 * (PetscReal)a->n_modes * (PetscReal)a->rid_nodes * t->sizes[3];
}

/* Modes and build are functions of their own, because the modes are those of bodies and not of snapshots. */
PetscErrorCode HycoTrainerCreate_Bodies(HycoTrainerOps *ops)
{
  PetscFunctionBegin;
  *ops = (HycoTrainerOps){.setfromoptions = SetFromOptions,
                          .reset = BodiesTrainerReset,
                          .begin = HycoBodiesBegin,
                          .modes = HycoBodiesModes,
                          .build = BodiesTrainerBuild,
                          .report = BodiesTrainerReport,
                          .cost = BodiesTrainerCost,
                          .offers = HycoBodiesOffers,
                          .work = HycoBodiesOperations,
                          .variants = BodiesTrainerVariants,
                          .setvariant = SetVariant};
  PetscFunctionReturn(PETSC_SUCCESS);
}
