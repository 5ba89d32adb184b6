/*
  The bodies that contact alone holds: the rigid motions that no support or spring prevents, and the cells with these
  bodies' loads, from which a model balances its contact forces with the loads (rom/floating.c).
*/
#include <hycoquantities.h>
#include <hycoreducerimpl.h>

/* A mesh of the marked cells of all ranks, on rank 0. Without contact surfaces, which the balance has no use for. */
PetscErrorCode HycoReducerGatherMesh(HycoReducer t, const PetscBool needed[], HycoMesh *mesh)
{
  HycoMesh part = t->fom->part;
  PetscBool *group;
  PetscInt *keep, n = 0;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  if (t->fom->size > 1) {
    PetscCall(PetscCalloc1(part->n_groups, &group));
    ierr = HycoMeshGather(t->scene, part, group, needed, mesh);
    PetscCall(PetscFree(group));
  } else {
    PetscCall(PetscMalloc1(part->n_cells, &keep));
    for (PetscInt e = 0; e < part->n_cells; e++) {
      if (needed[e]) keep[n++] = e;
    }
    /* On one rank nothing moves, and the part is the whole mesh. */
    ierr = HycoSubmesh(t->scene, part, n, keep, 0, NULL, 0, NULL, mesh);
    PetscCall(PetscFree(keep));
  }
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* first[b], last[b]: of the connected parts that a body's nodes are in. Collective. */
static PetscErrorCode PartsOfBodies(HycoReducer t, const HycoMotions *motions, PetscInt first[], PetscInt last[])
{
  HycoMesh part = t->fom->part;
  const PetscInt n = t->scene->n_bodies;

  PetscFunctionBegin;
  /* Neutral values of minimum and maximum, for bodies with no node on this rank. */
  for (PetscInt b = 0; b < n; b++) first[b] = PETSC_MAX_INT, last[b] = -1;
  for (PetscInt i = 0; i < part->n_nodes; i++) {
    const PetscInt b = part->node_body[i];

    first[b] = PetscMin(first[b], motions->part[i]);
    last[b] = PetscMax(last[b], motions->part[i]);
  }
  HycoAllreduce(first, n, MPIU_INT, MPI_MIN, HycoComm(t));
  HycoAllreduce(last, n, MPIU_INT, MPI_MAX, HycoComm(t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Orthonormal coefficients Q (n x 6) of the span of these motions. Modified Gram-Schmidt; twice, as once loses
   orthogonality for nearly parallel motions. */
static void FreeBodiesSpan(PetscInt n, const HycoRigid rigid[], PetscReal Q[][6])
{
  for (PetscInt k = 0; k < n; k++) {
    PetscReal size = 0;

    for (PetscInt i = 0; i < 6; i++) Q[k][i] = rigid[k].rigid[i];
    for (PetscInt j = 0; j < 2 * k; j++) { /* twice, against round-off */
      PetscReal dot = 0;

      for (PetscInt i = 0; i < 6; i++) dot += Q[k][i] * Q[j % k][i];
      for (PetscInt i = 0; i < 6; i++) Q[k][i] -= dot * Q[j % k][i];
    }
    for (PetscInt i = 0; i < 6; i++) size += Q[k][i] * Q[k][i];
    for (PetscInt i = 0; i < 6 && size > 0; i++) Q[k][i] /= PetscSqrtReal(size);
  }
}

/* Whether the span of Q contains v. */
static PetscBool FreeBodiesContains(PetscInt n, PetscReal Q[][6], const PetscReal v[6])
{
  PetscReal in = 0, all = 0;

  for (PetscInt i = 0; i < 6; i++) all += v[i] * v[i];
  for (PetscInt k = 0; k < n; k++) {
    PetscReal dot = 0;

    for (PetscInt i = 0; i < 6; i++) dot += Q[k][i] * v[i];
    in += dot * dot;
  }
  /* The part of v outside the span, by Pythagoras: Q is orthonormal. */
  return (PetscBool)(all - in <= 1e-8 * all);
}

/* Whether these motions of a part are free at all positions of its nodes. Where a map moves the nodes, a turn stays
   one that the supports allow only if its centre is arbitrary: all translations perpendicular to its axis are free. */
static PetscBool LeastSlipFree(HycoScene scene, PetscInt dim, PetscInt n, const HycoRigid rigid[])
{
  PetscBool changed[HYCO_MAX_PARAMETERS], stay = PETSC_TRUE;
  PetscReal Q[6][6];

  for (PetscInt p = 0; p < HYCO_MAX_PARAMETERS; p++) changed[p] = PETSC_TRUE;
  /* In 1D there is no turn. */
  if (dim == 1 || !HycoSceneChanges(scene, changed).nodes) return PETSC_TRUE;
  FreeBodiesSpan(n, rigid, Q);
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal *w = rigid[k].rigid + dim;
    const PetscReal axis[3] = {dim == 3 ? w[0] : 0, dim == 3 ? w[1] : 0, dim == 3 ? w[2] : w[0]};
    const PetscReal turn = axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2];

    for (PetscInt d = 0; d < dim && turn > 1e-16; d++) {
      PetscReal v[6] = {0};

      /* The projection of direction d to the plane perpendicular to the axis. */
      for (PetscInt c = 0; c < dim; c++) v[c] = (c == d) - axis[c] * axis[d] / turn;
      stay = (PetscBool)(stay && FreeBodiesContains(n, Q, v));
    }
  }
  return stay;
}

/* Keeps the motions of parts whose bodies are in no other part. of: n x n_bodies. *moves: parameters change them. */
static void KeepMotions(HycoReducer t, HycoMotions *motions, const PetscInt first[], const PetscInt last[],
                        PetscInt of[], PetscBool *moves)
{
  const PetscInt n_bodies = t->scene->n_bodies;
  PetscInt kept = 0, n;

  *moves = PETSC_FALSE;
  for (PetscInt k = 0; k < motions->n; k += n) {
    const PetscInt part = motions->rigid[k].part;
    PetscBool whole = PETSC_TRUE;

    for (n = 1; k + n < motions->n && motions->rigid[k + n].part == part;) n++;
    /* A body in two parts would have the motion in one of them alone, which no row of bodies can say. */
    for (PetscInt b = 0; b < n_bodies; b++)
      whole = (PetscBool)(whole && (first[b] == last[b] || first[b] > part || last[b] < part));
    if (!whole) continue;
    *moves = (PetscBool)(*moves || !LeastSlipFree(t->scene, t->sizes[3], n, motions->rigid + k));
    /* In place: kept never overtakes k. */
    for (PetscInt j = 0; j < n; j++, kept++) {
      motions->rigid[kept] = motions->rigid[k + j];
      for (PetscInt b = 0; b < n_bodies; b++) of[kept * n_bodies + b] = first[b] == part;
    }
  }
  motions->n = kept;
}

/* Marks the cells of these bodies around supports and springs, and one more of each body: from them predictions find
   the motions again, where the nodes are then. */
static PetscErrorCode MarkSupports(HycoReducer t, const PetscBool moved[], PetscBool needed[])
{
  const HycoScene s = t->scene;
  HycoMesh part = t->fom->part;
  PetscBool *node, *one;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(part->n_nodes, &node));
  HycoDuplicate(s->n_bodies, moved, &one);
  for (PetscInt k = 0; k < s->n_fixed + s->n_springs; k++) {
    const PetscBool fixed = (PetscBool)(k < s->n_fixed);
    PetscInt g = 0;

    PetscCall(HycoMeshFindGroup(part, fixed ? "fixed" : "spring",
                                fixed ? s->fixed[k].group : s->spring[k - s->n_fixed].group, &g));
    for (PetscInt j = part->group_start[g]; j < part->group_start[g + 1]; j++) node[part->group_node[j]] = PETSC_TRUE;
  }
  for (PetscInt k = 0; k < part->n_cells * part->nv; k++) {
    const PetscInt e = k / part->nv, body = part->cell_body[e];

    if (!moved[body] || !(node[part->cells[k]] || one[body])) continue;
    needed[e] = PETSC_TRUE;
    one[body] = PETSC_FALSE;
  }
  HycoFreeAll(&node, &one);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With the motions found. needed[] is filled on each rank for its own cells; the mesh of them is on rank 0 only. */
static PetscErrorCode FreeBodiesCells(HycoReducer t, HycoMotions *motions, HycoROM m)
{
  HycoMesh part = t->fom->part, loaded = NULL;
  const PetscInt n = t->scene->n_bodies;
  PetscInt *first, *last, *of;
  PetscBool *moved, *needed, moves = PETSC_FALSE;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscCalloc4(n, &first, n, &last, motions->n * n, &of, n, &moved));
  PetscCall(PetscMalloc1(part->n_cells, &needed));
  ierr = PartsOfBodies(t, motions, first, last);
  if (!ierr) KeepMotions(t, motions, first, last, of, &moves);
  for (PetscInt k = 0; k < motions->n * n; k++) moved[k % n] = (PetscBool)(moved[k % n] || of[k]);
  if (!ierr && motions->n) {
    /* Only cells with loads on bodies that move: the balance needs no others. */
    HycoOnEach(HycoComm(t), HycoMarkLoads(t->scene, part, moved, needed));
    if (moves) HycoOnEach(HycoComm(t), MarkSupports(t, moved, needed));
    PetscCall(HycoReducerGatherMesh(t, needed, &loaded));
  }
  if (loaded && !loaded->n_cells) PetscCall(HycoMeshDestroy(&loaded));
  if (m && motions->n) ierr = HycoFloatingCreate(motions->n, motions->rigid, n, of, moves, loaded, &m->model->floating);
  PetscCall(PetscFree4(first, last, of, moved));
  PetscCall(PetscFree(needed));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rigid motions at the present parameters that supports leave free, and the bodies that they move: their balance
   corrects reconstructed forces online. */
PetscErrorCode HycoReducerFindFloating(HycoReducer t, HycoROM m)
{
  HycoMotions motions;
  PetscErrorCode ierr = PETSC_SUCCESS;

  PetscFunctionBegin;
  PetscCall(HycoFEFreeMotions(HycoComm(t), t->fom->fe, &motions));
  if (motions.n) ierr = FreeBodiesCells(t, &motions, m);
  PetscCall(HycoMotionsDestroy(&motions));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
