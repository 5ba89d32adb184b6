/* Training of the model of bodies: what the type refuses, the unknowns of the contacts' surfaces, and the order of the
   steps. */
#include <hycobodiestraining.h>

#define MOST_NODES    3000 /* of the surfaces of a body, by their unknowns: C_b is dense */
#define MANY_UNKNOWNS 1500 /* of a body: masters that no slave meets are left out */
#define RINGS         2    /* of facets around those that slaves met at some points of the ranges */
#define SEARCHED      200  /* such points */
#define LEAST         3    /* values of each of the parameters theta */
#define BENDS         4    /* parts of a parameter's range over which nodes move along lines or not */
/* Squared distance of nodes from lines as a share of the best variable's, from which another is taken: ten times
   straighter; the radius of a crown needs 5 samples instead of 17. */
#define STRAIGHTER 0.1

/* -- before the solves -- */

/* Why bodies would need too many samples; "": they do not. */
static PetscErrorCode RefuseShapes(HycoScene scene, const HycoBodyParts *parts, char why[HYCO_LINE])
{
  /* Parameters are visited one by one and together: only together can they fail so. */
  const PetscInt fail = HycoBodyPartsFail(parts);
  PetscInt shape[HYCO_MAX_PARAMETERS];
  char list[HYCO_LINE] = "", bodies[HYCO_LINE] = "";
  const PetscInt n = HycoBodyPartsShapes(parts, -1, shape);

  PetscFunctionBegin;
  why[0] = '\0';
  if (fail >= 0)
    HycoFormat(why,
               "body %s: its parameters together change it by more than a rigid motion, a uniform scaling and a factor "
               "of its stiffness, though none does alone, which a model of bodies does not support; train a hybrid "
               "model",
               parts->name[fail]);
  if (fail >= 0 || n <= HYCO_MOST_THETA) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt p = 0; p < n; p++) PetscCall(HycoListAdd(list, ", ", scene->parameter[shape[p]]));
  for (PetscInt k = 0; k < parts->n; k++) {
    PetscInt own[HYCO_MAX_PARAMETERS];

    /* The message names bodies and parameters: either may be changed. */
    if (HycoBodyPartsShapes(parts, k, own)) PetscCall(HycoListAdd(bodies, ", ", parts->name[k]));
  }
  HycoFormat(why,
             "body %s: %d parameters change shapes or ratios of moduli (%s), and a model of bodies samples at most "
             "%d; train a hybrid model",
             bodies, (int)n, list, HYCO_MOST_THETA);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same of the unknowns of their surfaces: body k has those from start[k]. */
static PetscErrorCode RefuseUnknowns(const HycoBodyParts *parts, PetscInt dim, const PetscInt start[],
                                     char why[HYCO_LINE])
{
  PetscFunctionBegin;
  why[0] = '\0';
  for (PetscInt k = 0; k < parts->n && !why[0]; k++) {
    if (start[k + 1] - start[k] > MOST_NODES * dim)
      HycoFormat(why,
                 "body %s has %d unknowns on the surfaces that may touch; a model of bodies stores the square of "
                 "their number, and is limited to %d: train a hybrid model",
                 parts->name[k], (int)(start[k + 1] - start[k]), (int)(MOST_NODES * dim));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the scene has what the model does not represent. What follows from options and the mesh; parameters and
   paths are checked once the bodies are known. */
static PetscErrorCode CheckScene(HycoReducer t)
{
  PetscBool regularise = PETSC_FALSE;

  PetscFunctionBegin;
  HycoCheckModel(!t->scan && !t->keep_singular, "-hyco_scan and -hyco_keep_singular have no effect on "
                                                "-hyco_model_type bodies; remove them");
  /* Without contact there is nothing to condense to; hyper-reduction alone serves. */
  HycoCheckModel(t->sizes[2] > 0, "the scene has no contact, and a model of bodies represents the surfaces that touch; "
                                  "train a hybrid model");
  PetscCall(PetscOptionsGetBool(t->scene->options, NULL, "-hyco_regularise", &regularise, NULL));
  HycoCheckModel(!regularise, "-hyco_regularise is not supported by a model of bodies; train a hybrid model");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Before any solution, so that a search refuses the type at no cost; called again in each attempt. */
PetscErrorCode HycoBodiesBegin(HycoReducer t)
{
  PetscReal mu[HYCO_MAX_PARAMETERS];
  char why[HYCO_LINE];

  PetscFunctionBegin;
  PetscCall(CheckScene(t));
  if (HycoTrainingOfBodies(t)->parts.n) PetscFunctionReturn(PETSC_SUCCESS); /* they do not depend on the solutions */
  /* The first training point is the reference of all poses and factors. */
  PetscCall(HycoReducerColumn(t, 0, mu));
  PetscCall(HycoBodyPartsFind(t->fom, mu, &HycoTrainingOfBodies(t)->parts));
  PetscCall(RefuseShapes(t->scene, &HycoTrainingOfBodies(t)->parts, why));
  HycoCheckModel(!why[0], "%s", why);
  if (t->scene->n_times) PetscCall(HycoBodiesCheckPath(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define SAMPLES 5  /* assumed nodes along each axis of theta */
#define SOLVES  12 /* assumed solves for each load, mode and sample of the fields */
#define STRAINS 40 /* assumed modes of the inelastic forces, each with unknowns of its cells of the model */

/* In floating-point operations, for the search's budget: only the order of magnitude counts. The flexibilities
   cost n^3 / 3 of their unknowns. */
PetscReal HycoBodiesOperations(HycoReducer t)
{
  HycoBodiesTraining s = HycoTrainingOfBodies(t);
  PetscInt shape[HYCO_MAX_PARAMETERS];
  const PetscInt n = HycoBodyPartsShapes(&s->parts, -1, shape);
  const PetscReal unknowns = 2 * (PetscReal)t->sizes[2] * t->sizes[3], /* slaves and about as many masters */
      samples = PetscMin(PetscPowRealInt(SAMPLES, n), (PetscReal)s->most_samples),
                  strains = t->scene->n_times ? STRAINS * (PetscReal)(s->cells * t->fom->part->nv * t->sizes[3]) : 0;

  return samples * (HycoReducerFactorWork(t) + unknowns * unknowns * unknowns / 3) +
         (SOLVES * (PetscReal)s->samples + strains) * HycoReducerSolveWork(t);
}

/* Whether the search may try the type without being told to. Whether bodies are recognised is found later, at the
   samples. */
PetscBool HycoBodiesOffers(HycoReducer t, PetscBool targets, size_t length, char why[])
{
  (void)targets;
  if (t->pod_memory > 0)
    snprintf(why, length,
             "its columns are not read in batches, and -hyco_pod_memory is given; name the type to train it");
  return (PetscBool)!why[0];
}

/* -- the surfaces' unknowns -- */

/* of[i]: the body of each node of the surfaces, on rank 0. Collective. The surfaces are on rank 0, their nodes'
   bodies on the owners: a star forest from owned nodes to the surface's fetches them. */
static PetscErrorCode BodiesOfSurface(HycoFOM f, const HycoBodyParts *parts, PetscInt **of)
{
  const PetscInt n = f->surface ? f->surface->n_nodes : 0;
  PetscInt *own, *global;
  PetscSF sf;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n + 1, of));
  PetscCall(PetscMalloc2(f->part->n_owned + f->part->n_nodes, &own, n + 1, &global));
  /* On one rank the surface's numbers are the mesh's. */
  for (PetscInt i = 0; i < n; i++) global[i] = f->surface->node_global ? f->surface->node_global[i] : i;
  for (PetscInt i = 0; i < f->part->n_nodes; i++) {
    if (HycoMeshOwned(f->part, i) >= 0) own[HycoMeshOwned(f->part, i)] = parts->of[i];
  }
  PetscCall(HycoMeshNodeSF(HycoComm(f), f->part, n, global, &sf));
  PetscCall(HycoSFBcast(sf, MPIU_INT, 1, own, *of));
  PetscCall(PetscSFDestroy(&sf));
  PetscCall(PetscFree2(own, global));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* near[i]: also the nodes of the facets of a group that have a node in near[]. */
static PetscErrorCode AddRing(HycoMesh m, PetscInt group, PetscBool near[])
{
  PetscBool *on;

  PetscFunctionBegin;
  /* near[] grows while facets are visited; one ring is the facets around the nodes before. */
  HycoDuplicate(m->n_nodes + 1, near, &on);
  for (PetscInt f = 0; f < m->n_facets; f++) {
    const PetscInt *node = m->facets + f * m->nf;
    PetscBool meets = PETSC_FALSE;

    if (m->facet_group[f] != group) continue;
    for (PetscInt a = 0; a < m->nf; a++) meets = (PetscBool)(meets || on[node[a]]);
    for (PetscInt a = 0; a < m->nf && meets; a++) near[node[a]] = PETSC_TRUE;
  }
  PetscCall(PetscFree(on));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes from in[] the masters of moved surfaces that no slave meets over the ranges: a part slides on a small part of a
   large one. A prediction that meets another one is refused. Rank 0. */
static PetscErrorCode LeaveOut(HycoFOM f, PetscBool in[])
{
  const HycoScene scene = f->scene;
  HycoMesh m = f->surface;
  HycoSamples points;
  HycoMet met;
  PetscBool *near;
  const PetscReal *mu;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoSamplesCreate(scene, &points));
  PetscCall(HycoSamplesAddScattered(points, SEARCHED));
  PetscCall(HycoSamplesGet(points, &n, NULL, &mu));
  PetscCall(HycoMetFind(scene, m, &f->pairs, n, mu, NULL, &met));
  PetscCall(PetscCalloc1(m->n_nodes + 1, &near));
  HycoPairsMark(&met.rows, near);
  for (PetscInt k = 0; k < scene->n_contacts; k++) {
    PetscInt g = 0;

    /* Masters that stay with their slaves are all met. */
    if (!HycoPairsFollows(&f->pairs, k)) continue;
    PetscCall(HycoMeshFindGroup(m, "contact", scene->contact[k]->slave, &g));
    for (PetscInt j = m->group_start[g]; j < m->group_start[g + 1]; j++) near[m->group_node[j]] = PETSC_TRUE;
    PetscCall(HycoMeshFindGroup(m, "contact", scene->contact[k]->master, &g));
    /* A margin: the points searched are a sample of the ranges. */
    for (PetscInt ring = 0; ring < RINGS; ring++) PetscCall(AddRing(m, g, near));
  }
  for (PetscInt i = 0; i < m->n_nodes; i++) in[i] = (PetscBool)(in[i] && near[i]);
  PetscCall(PetscFree(near));
  PetscCall(HycoMetDestroy(&met));
  PetscCall(HycoSamplesDestroy(&points));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lists the free unknowns of the surfaces by body, with their numbers in the distributed vectors. Rank 0. */
static PetscErrorCode CondenseBodiesList(HycoFOM f, const PetscInt of[], const PetscBool in[], HycoSubstructures b,
                                         PetscInt global[])
{
  HycoMesh m = f->surface;

  PetscFunctionBegin;
  b->ns = 0;
  for (PetscInt k = 0; k < b->n; k++) {
    for (PetscInt i = 0; i < m->n_nodes * b->dim; i++) {
      const PetscInt node = i / b->dim;

      /* Fixed unknowns do not move and carry a reaction that is no contact's. */
      if (!in[node] || of[node] != k || f->fe_surface->fixed[i]) continue;
      b->dof[b->ns] = (m->node_whole ? m->node_whole[node] : node) * b->dim + i % b->dim;
      global[b->ns++] = (m->node_global ? m->node_global[node] : node) * b->dim + i % b->dim;
    }
    /* Body after body: the blocks of C are contiguous. */
    b->start[k + 1] = b->ns;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same for the nodes of the surfaces that may touch. Rank 0. Leaving out costs SEARCHED searches, and saves
   the square of the unknowns: only for bodies with more than `many`. */
static PetscErrorCode ListReached(HycoFOM f, const PetscInt of[], PetscInt many, HycoSubstructures b, PetscInt global[])
{
  PetscInt most = 0;
  PetscBool *in;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(f->surface->n_nodes + 1, &in));
  PetscCall(HycoPairsMarkSurfaces(f->scene, f->surface, &f->pairs, in));
  PetscCall(CondenseBodiesList(f, of, in, b, global));
  for (PetscInt k = 0; k < b->n; k++) most = PetscMax(most, b->start[k + 1] - b->start[k]);
  /* A body's flexibility is dense: nodes that no slave ever meets are left out where that pays. */
  if (most > many && f->searches && f->scene->n_parameters) {
    PetscCall(LeaveOut(f, in));
    PetscCall(CondenseBodiesList(f, of, in, b, global));
  }
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The unknowns of the bodies' surfaces, on every rank; global: their numbers in the distributed vectors, rank 0. The
   caller frees it. Collective. */
static PetscErrorCode FindUnknowns(HycoFOM f, const HycoBodyParts *parts, PetscInt many, HycoSubstructures b,
                                   PetscInt **global)
{
  const PetscInt n = f->surface ? f->surface->n_nodes * b->dim : 0;
  PetscInt *of;

  PetscFunctionBegin;
  PetscCall(BodiesOfSurface(f, parts, &of));
  PetscCall(PetscCalloc1(b->n + 1, &b->start));
  PetscCall(PetscMalloc1(n + 1, &b->dof));
  PetscCall(PetscMalloc1(n + 1, global));
  HycoOnRoot(HycoComm(f), ListReached(f, of, many, b, *global));
  HycoBcast(b->start, b->n + 1, MPIU_INT, HycoComm(f));
  b->ns = b->start[b->n];
  PetscCall(PetscFree(of));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Masters that no slave meets are looked for only where they decide. */
PetscErrorCode HycoBodyPartsRefuse(HycoFOM f, const HycoBodyParts *parts, char why[HYCO_LINE])
{
  HycoSubstructures b;
  PetscInt *global;

  PetscFunctionBegin;
  PetscCall(RefuseShapes(f->scene, parts, why));
  if (why[0]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscNew(&b));
  b->n = parts->n;
  b->dim = f->part->dim;
  PetscCall(FindUnknowns(f, parts, MOST_NODES * b->dim, b, &global));
  PetscCall(RefuseUnknowns(parts, b->dim, b->start, why));
  HycoFreeAll(&b->start, &b->dof, &global, &b);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The unknowns on every rank, and N, whose rows select them. Collective. */
static PetscErrorCode CondenseBodiesSelect(HycoReducer t, HycoSubstructures b, Mat *N)
{
  HycoFOM f = t->fom;
  const HycoBodyParts *parts = &HycoTrainingOfBodies(t)->parts;
  PetscInt *global;
  char why[HYCO_LINE];

  PetscFunctionBegin;
  PetscCall(FindUnknowns(f, parts, MANY_UNKNOWNS, b, &global));
  /* Other ranks have allocated by their own surface, of which they have none. */
  if (f->rank) PetscCall(PetscFree(b->dof));
  if (f->rank) PetscCall(PetscMalloc1(b->ns + 1, &b->dof));
  HycoBcast(b->dof, b->ns, MPIU_INT, HycoComm(f));
  /* The same on every rank, after the broadcast. */
  PetscCall(RefuseUnknowns(parts, b->dim, b->start, why));
  HycoCheckModel(!why[0], "%s", why);
  /* Columns as K's rows; one entry in each row, set by rank 0, which has the list. */
  PetscCall(MatCreateAIJ(HycoComm(f), PETSC_DECIDE, f->part->n_owned * b->dim, b->ns, f->n_nodes * b->dim, 1, NULL, 1,
                         NULL, N));
  for (PetscInt k = 0; k < b->ns && f->rank == 0; k++) PetscCall(MatSetValue(*N, k, global[k], 1, INSERT_VALUES));
  PetscCall(HycoMatAssemble(*N));
  PetscCall(PetscFree(global));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the model -- */

/* The nodes at mu with parameter p at a share of its range: X (3 a node of the part). Collective. */
static PetscErrorCode NodesAt(HycoReducer t, const PetscReal first[], PetscInt p, PetscReal value, PetscReal X[])
{
  HycoFOM f = t->fom;
  PetscReal mu[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(mu, first, t->scene->n_variables));
  mu[p] = value;
  HycoOnEach(HycoComm(f), HycoFESetParameters(f->fe, mu));
  PetscCall(PetscArraycpy(X, f->fe->X, 3 * f->part->n_nodes));
  /* The caller moves on: K and F of this position are never assembled. */
  f->fe->ready = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* distance[]: by variable, how far the nodes of the bodies whose shape parameter p changes are from straight lines over
   its range, squared. Collective. */
static PetscErrorCode CondenseBodiesCurvature(HycoReducer t, const PetscReal mu[], PetscInt p, PetscReal distance[])
{
  const HycoBodyParts *parts = &HycoTrainingOfBodies(t)->parts;
  const PetscReal lo = t->scene->lo[p], hi = t->scene->hi[p];
  const PetscInt n = t->fom->part->n_nodes;
  PetscReal *X, *from, *to;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(3 * n + 1, &X, 3 * n + 1, &from, 3 * n + 1, &to));
  /* A straight line between the two ends; in between the share is that of the variable. */
  PetscCall(NodesAt(t, mu, p, lo, from));
  PetscCall(NodesAt(t, mu, p, hi, to));
  PetscCall(PetscArrayzero(distance, HYCO_BODIES_VARIABLES));
  for (PetscInt k = 1; k < BENDS; k++) {
    const PetscReal value = lo + (hi - lo) * k / BENDS;

    PetscCall(NodesAt(t, mu, p, value, X));
    for (PetscInt g = 0; g < HYCO_BODIES_VARIABLES; g++) {
      const PetscReal first = HycoBodiesVariable(g, lo);
      const PetscReal share = (HycoBodiesVariable(g, value) - first) / (HycoBodiesVariable(g, hi) - first);

      for (PetscInt i = 0; i < 3 * n; i++) {
        const PetscInt body = parts->of[i / 3];

        if (HycoMeshOwned(t->fom->part, i / 3) < 0) continue;
        /* Bodies that only move or turn are exact whatever is interpolated. */
        if (!(parts->enters[body * parts->n_parameters + p] & HYCO_ENTERS_SHAPE)) continue;
        distance[g] += PetscSqr(X[i] - from[i] - share * (to[i] - from[i]));
      }
    }
  }
  PetscCall(PetscFree3(X, from, to));
  HycoAllreduce(distance, HYCO_BODIES_VARIABLES, MPIU_REAL, MPI_SUM, HycoComm(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What of parameter p is interpolated: the logarithm of one that moves nothing and varies much; of one that moves nodes
   that in which they move nearly along straight lines, because the stiffness is smooth in the places of the nodes.
   Collective. */
static PetscErrorCode ChooseVariable(HycoReducer t, const PetscReal mu[], PetscInt p, PetscInt *variable)
{
  const HycoScene s = t->scene;
  PetscBool changed[HYCO_MAX_PARAMETERS] = {PETSC_FALSE};
  PetscReal distance[HYCO_BODIES_VARIABLES];

  PetscFunctionBegin;
  *variable = HYCO_BODIES_PLAIN;
  /* Logarithm and reciprocal need positive values. */
  if (s->lo[p] <= 0 || s->hi[p] <= s->lo[p]) PetscFunctionReturn(PETSC_SUCCESS);
  changed[p] = PETSC_TRUE;
  if (!HycoSceneChanges(s, changed).nodes) {
    /* Below a factor of two a logarithm is nearly linear. */
    if (s->hi[p] > 2 * s->lo[p]) *variable = HYCO_BODIES_LOGARITHM;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(CondenseBodiesCurvature(t, mu, p, distance));
  for (PetscInt g = 0; g < HYCO_BODIES_VARIABLES; g++) {
    /* Clearly straighter only: a tie stays with the parameter itself. */
    if (distance[g] < STRAIGHTER * distance[*variable]) *variable = g;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The parameters theta, and which bodies each changes, with values enough to begin with. Collective. theta: parameters
   that change a body's shape or its ratio of moduli; all others are exact without any sample. */
static PetscErrorCode TakeTheta(HycoReducer t, HycoSubstructures b)
{
  const HycoBodyParts *parts = &HycoTrainingOfBodies(t)->parts;
  PetscInt shape[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  b->n_theta = HycoBodyPartsShapes(parts, -1, shape);
  HycoDuplicate(HYCO_MAX_PARAMETERS, shape, &b->theta);
  PetscCall(PetscCalloc1(b->n_theta + 1, &b->variable));
  PetscCall(PetscCalloc1(b->n_theta + 1, &b->n_nodes));
  for (PetscInt p = 0; p < b->n_theta; p++) PetscCall(ChooseVariable(t, b->first, shape[p], &b->variable[p]));
  PetscCall(PetscCalloc1(b->n, &b->body));
  for (PetscInt k = 0; k < b->n; k++) {
    for (PetscInt p = 0; p < b->n_theta; p++) {
      b->n_nodes[p] = LEAST;
      /* LEAST values along an axis that changes the shape, to begin with. */
      b->body[k].tensor.n[p] = parts->enters[k * parts->n_parameters + shape[p]] & HYCO_ENTERS_SHAPE ? LEAST : 1;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Friction: a history of elastic bodies. */
static PetscErrorCode TakeNoStrains(HycoReducer t)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  HycoBodiesInelastic in;

  PetscFunctionBegin;
  PetscCall(PetscNew(&b->inelastic));
  in = b->inelastic;
  /* Nothing is amplified: no modes of strains. */
  in->amplification = 1;
  PetscCall(PetscCalloc1(1, &in->T));
  PetscCall(PetscCalloc1(1, &in->there));
  PetscCall(PetscCalloc1(1, &in->P));
  PetscCall(PetscCalloc1(1, &in->dof));
  PetscCall(PetscCalloc1(1, &in->body));
  PetscCall(PetscCalloc1(1, &in->C));
  PetscCall(PetscCalloc1(1, &in->R));
  PetscCall(PetscCalloc1(1, &in->A));
  PetscCall(PetscCalloc1(1, &in->Z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each step needs those before: the surfaces, the factors' blocks, the loads' basis (R), samples, inelastic
   responses, modes. factor->fom has its own K: t->fom's fe serves the points meanwhile. */
static PetscErrorCode CondenseAllBodies(HycoReducer t, HycoSnapshots store, HycoBodiesFactor *factor)
{
  HycoSubstructures b = HycoTrainingOfBodies(t)->bodies;
  Mat N;

  PetscFunctionBegin;
  PetscCall(HycoFOMAssemble(factor->fom, b->first));
  factor->fom->fe->heat_is_load = PETSC_TRUE;
  PetscCheck(factor->fom->part->n_nodes == t->fom->part->n_nodes && factor->fom->part->first == t->fom->part->first,
             PETSC_COMM_SELF, PETSC_ERR_PLIB, "two meshes of one scene differ");
  /* Supports of the surfaces' mesh are known at parameters only. */
  PetscCall(HycoFOMSetParameters(t->fom, b->first));
  PetscCall(CondenseBodiesSelect(t, b, &N));
  for (PetscInt k = 0; k < b->n; k++) b->body[k].n = b->start[k + 1] - b->start[k];
  PetscCall(HycoBodiesSplit(t, N, factor));
  PetscCall(MatDestroy(&N));
  PetscCall(HycoBodiesLoads(t, factor));
  PetscCall(HycoBodiesBeginKeys(t, factor));
  PetscCall(HycoBodiesSample(t, factor));
  PetscCall(HycoBodiesTakeMotions(t, factor));
  if (HycoBodiesFlow(t)) PetscCall(HycoBodiesStrains(t, factor));
  PetscCall(HycoBodiesFields(t, store, factor));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A new HycoFOM, whose K is factored body by body; released with all factors before an error returns, because a
   search goes on. */
static PetscErrorCode MakeModes(HycoReducer t, HycoSnapshots store)
{
  HycoBodiesFactor factor = {0};
  PetscReal mu[HYCO_MAX_PARAMETERS];
  HycoSubstructures b;

  PetscFunctionBegin;
  PetscCall(HycoBodiesDestroy(&HycoTrainingOfBodies(t)->bodies));
  PetscCall(PetscNew(&b));
  HycoTrainingOfBodies(t)->bodies = b;
  HycoTrainingOfBodies(t)->n_factors = 0;
  b->dim = t->sizes[3];
  b->n = HycoTrainingOfBodies(t)->parts.n;
  b->n_variables = t->scene->n_variables;
  PetscCall(HycoReducerColumn(t, 0, mu));
  PetscCall(PetscMalloc1(b->n_variables + 1, &b->first));
  PetscCall(PetscArraycpy(b->first, mu, b->n_variables));
  /* Before anything is condensed: the grid follows from the parameters that change shapes. */
  PetscCall(TakeTheta(t, b));
  /* Laws that flow: their modes come from the replayed training paths. */
  if (HycoBodiesFlow(t))
    PetscCall(HycoBodiesStrainModes(t, store));
  else if (t->scene->n_times)
    PetscCall(TakeNoStrains(t));
  PetscCall(HycoFOMCreate(HycoComm(t), t->scene, &factor.fom));
  HycoFinally(CondenseAllBodies(t, store, &factor), PetscCall(HycoBodiesReleaseFactor(&factor)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoBodiesModes(HycoReducer t, HycoSnapshots store)
{
  PetscFunctionBegin;
  HycoLogged(HYCO_EVENT_BODIES, MakeModes(t, store));
  PetscFunctionReturn(PETSC_SUCCESS);
}
