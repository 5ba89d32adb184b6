/*
  Reactions of the last solution: the forces of supports on the unknowns that they fix,

    R = f_int - F + B^T L  there,

  with f_int = K u, for a path that of its last step; the forces of springs; the resultants of loads and of obstacles.
  On each body they balance in each direction, except the radial one of an axisymmetric scene, and in their moments.
*/
#include <hycofields.h>
#include <hycopath.h>
#include <hycoquantities.h>

/* -B^T L at all unknowns of the part, fixed ones too, from the contacts of all ranks. Collective. All components at
   fixed unknowns too, which B does not have: therefore from the contacts' normals, not from B^T. */
static PetscErrorCode ContactForces(HycoFOM f, PetscReal force[])
{
  const PetscInt dim = f->fe->dim;
  HycoContactFields c;
  Vec all, at;
  PetscScalar *v;

  PetscFunctionBegin;
  HycoOnError(HycoContactFieldsCreate(HycoComm(f), f->fe_surface, &f->pairs, f->u_surface, f->lambda, &c),
              PetscCall(HycoContactFieldsDestroy(&c)));
  PetscCall(VecDuplicate(f->U, &all));
  PetscCall(VecSet(all, 0));
  /* U_surface serves as a work vector; f->u_surface keeps the solution. */
  at = f->to_surface ? f->U_surface : all;
  PetscCall(VecGetArray(at, &v));
  for (PetscInt k = 0; k < f->fe_surface->n_dof; k++) v[k] = c.force[3 * (k / dim) + k % dim];
  PetscCall(VecRestoreArray(at, &v));
  PetscCall(HycoContactFieldsDestroy(&c));
  if (f->to_surface) {
    PetscCall(VecScatterBegin(f->to_surface, at, all, ADD_VALUES, SCATTER_REVERSE));
    PetscCall(VecScatterEnd(f->to_surface, at, all, ADD_VALUES, SCATTER_REVERSE));
  }
  PetscCall(HycoFOMToLocal(f, all, force));
  PetscCall(VecDestroy(&all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* contact: room for n_dof reals. Collective. R = f_int - F - (-B^T L), at supported unknowns in generalised form. */
static PetscErrorCode ReactionsCompute(HycoFOM f, PetscReal contact[], PetscReal r[])
{
  const PetscScalar *u;
  PetscReal *f_int = NULL, *along;

  PetscFunctionBegin;
  if (f->path && !f->path->beside) {
    PetscCall(PetscMalloc1(f->fe->n_dof, &f_int));
    PetscCall(HycoFOMToLocal(f, f->path->f_old, f_int));
  }
  PetscCall(VecGetArrayRead(f->U_local, &u));
  HycoOnEach(HycoComm(f), HycoFEReactions(f->fe, u, f_int, r));
  PetscCall(VecRestoreArrayRead(f->U_local, &u));
  PetscCall(PetscFree(f_int));
  PetscCall(PetscArrayzero(contact, f->fe->n_dof));
  if (!f->n_contacts) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ContactForces(f, contact));
  HycoDuplicate(f->fe->n_dof, contact, &along);
  HycoFEGeneralise(f->fe, along);
  /* contact is -B^T L, the force on the bodies: what they press on the support is its opposite. */
  for (PetscInt k = 0; k < f->fe->n_dof; k++) r[k] -= HycoFESupports(f->fe, k) ? along[k] : 0;
  PetscCall(PetscFree(along));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* r[n_dof] of this rank's part (N), complete at owned nodes. Collective. Outputs and reports need them by unknown;
   HycoFOMGetReactions() sums them by support. */
PetscErrorCode HycoFOMReactions(HycoFOM f, PetscReal r[])
{
  PetscReal *contact;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(f->fe->n_dof, &contact));
  PetscCall(ReactionsCompute(f, contact, r));
  PetscCall(PetscFree(contact));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds a nodal force to a resultant; an axisymmetric scene has no radial component, and no moment. */
static void AddTo(HycoFE fe, PetscInt dof, PetscReal value, HycoReaction *to)
{
  const PetscInt c = dof % fe->dim, d = (c + 1) % 3, e = (c + 2) % 3;
  const PetscReal *x = fe->X + 3 * (dof / fe->dim);

  if (fe->formulation == HYCO_AXISYMMETRIC) {
    /* Radial forces on a ring balance themselves. */
    if (c) to->force[c] += value;
    return;
  }
  to->force[c] += value;
  to->moment[d] += x[e] * value;
  to->moment[e] -= x[d] * value;
}

/* The support of each unknown: the first in the scene's order; -1: none. A node in several supports is listed with
   the first, so that each force counts once. */
static PetscErrorCode FindSupports(HycoFOM f, PetscInt support[])
{
  HycoMesh m = f->part;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < f->fe->n_dof; k++) support[k] = -1;
  /* From the last to the first, so that the first one stays. */
  for (PetscInt s = f->scene->n_fixed - 1; s >= 0; s--) {
    PetscInt g = 0;

    PetscCall(HycoMeshFindGroup(m, "fixed", f->scene->fixed[s].group, &g));
    for (PetscInt j = m->group_start[g]; j < m->group_start[g + 1]; j++) {
      for (PetscInt c = 0; c < m->dim; c++) {
        if (f->scene->fixed[s].value[c]) support[m->group_node[j] * m->dim + c] = s;
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of all forces or moments: the size by which the balance of a body with smaller ones is judged; 100 times the residual
   of 1e-8. */
#define SMALL_BALANCE 1e-6

/* Everything on a body, or on bodies that share nodes or are tied: the magnitudes too, those of moments about the
   centre. */
typedef struct {
  HycoReaction all;
  PetscReal size, turns;
} OnBody;

/* Results of Sums(): supports first, then springs, the loads, the obstacles; of the bodies part[b]. */
typedef struct {
  HycoReaction *result;
  const PetscReal *u;
  PetscReal centre[3];
  PetscInt *part;
  OnBody *body;
} Sums;

/* Adds a nodal force to a resultant and to those of its body. */
static void AddBoth(Sums *s, HycoFE fe, PetscInt dof, PetscReal value, HycoReaction *to)
{
  OnBody *body = &s->body[s->part[fe->mesh->node_body[dof / fe->dim]]];
  PetscReal arm = 0;

  AddTo(fe, dof, value, to);
  AddTo(fe, dof, value, &body->all);
  for (PetscInt c = 0; c < 3; c++) arm = PetscMax(arm, PetscAbsReal(fe->X[3 * (dof / fe->dim) + c] - s->centre[c]));
  body->size += PetscAbsReal(value);
  body->turns += arm * PetscAbsReal(value);
}

/* -K u of the springs that this process counts. */
static PetscErrorCode AddSpring(HycoFE fe, PetscInt spring, PetscInt n, const PetscInt node[], const PetscReal K[],
                                void *ctx)
{
  Sums *s = (Sums *)ctx;
  const PetscInt size = n * fe->dim;

  PetscFunctionBegin;
  for (PetscInt r = 0; r < size; r++) {
    PetscReal force = 0;

    for (PetscInt t = 0; t < size; t++) force -= K[r * size + t] * s->u[node[t / fe->dim] * fe->dim + t % fe->dim];
    AddBoth(s, fe, node[r / fe->dim] * fe->dim + r % fe->dim, force, &s->result[fe->scene->n_fixed + spring]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* rho of min |force - sum of rho_k n_k| over the components that no plain support fixes, by Gaussian elimination: n
   vectors, n <= 3. */
static void ReactionsResolve(PetscInt n, const HycoOblique *const o[], const PetscBool plain[3],
                             const PetscReal force[3], PetscReal rho[3])
{
  PetscReal A[3][4];

  for (PetscInt a = 0; a < n; a++) {
    for (PetscInt b = 0; b <= n; b++) {
      A[a][b] = 0;
      /* A component with a support of its own takes any force along it: only the others determine rho. */
      for (PetscInt d = 0; d < 3; d++) A[a][b] += plain[d] ? 0 : o[a]->n[d] * (b < n ? o[b]->n[d] : force[d]);
    }
  }
  for (PetscInt a = 0; a < n; a++) { /* positive definite: no pivoting */
    for (PetscInt r = a + 1; r < n; r++) {
      for (PetscInt b = n; b >= a; b--) A[r][b] -= A[r][a] / A[a][a] * A[a][b];
    }
  }
  for (PetscInt a = n - 1; a >= 0; a--) {
    for (PetscInt b = a + 1; b < n; b++) A[a][n] -= A[a][b] * rho[b];
    rho[a] = A[a][n] / A[a][a];
  }
}

/* The force of each support on a node: r is that of the unknowns, support[] the support of each. In an oblique
   support the unknowns' force is along the eliminated component; the force along n follows by least squares, the
   rest belongs to plain supports. */
static void AddSupports(Sums *s, HycoFE fe, PetscInt node, const PetscReal r[], const PetscInt support[])
{
  const HycoOblique *o[3];
  PetscBool plain[3] = {PETSC_FALSE};
  PetscReal force[3] = {0, 0, 0}, rho[3];
  PetscInt n = 0;

  for (PetscInt c = 0; c < fe->dim; c++) {
    const PetscInt dof = node * fe->dim + c;
    const HycoOblique *oblique = HycoFEOblique(fe, dof);

    force[c] += r[dof];
    plain[c] = (PetscBool)(fe->fixed[dof] && !oblique);
    /* T^-T: the other components of the support's force. */
    for (PetscInt d = 0; oblique && d < fe->dim; d++) force[d] -= oblique->a[d] * r[dof];
    if (oblique) o[n++] = oblique;
  }
  if (n) ReactionsResolve(n, o, plain, force, rho);
  for (PetscInt k = 0; k < n; k++) {
    for (PetscInt d = 0; d < fe->dim; d++) {
      AddBoth(s, fe, node * fe->dim + d, rho[k] * o[k]->n[d], &s->result[o[k]->support]);
      force[d] -= rho[k] * o[k]->n[d];
    }
  }
  for (PetscInt c = 0; c < fe->dim; c++) {
    if (plain[c] && support[node * fe->dim + c] >= 0)
      AddBoth(s, fe, node * fe->dim + c, force[c], &s->result[support[node * fe->dim + c]]);
  }
}

/* Sums over the nodes that this process owns; work: 3 x n_dof reals. Collective. The loads of fixed unknowns count
   as well: they go directly into the supports. */
static PetscErrorCode AddUp(HycoFOM f, PetscReal *work, PetscInt support[], Sums *s)
{
  const PetscInt n = f->fe->n_dof, dim = f->fe->dim;
  PetscReal *contact = work, *r = work + n, *load = work + 2 * n;
  HycoReaction *loads = s->result + f->scene->n_fixed + f->scene->n_springs;

  PetscFunctionBegin;
  /* Nodal contact forces and what the supports must add for equilibrium. */
  PetscCall(ReactionsCompute(f, contact, r));
  HycoOnEach(HycoComm(f), HycoFELoads(f->fe, load));
  PetscCall(FindSupports(f, support));
  for (PetscInt i = 0; i < f->part->n_nodes; i++) {
    if (HycoMeshOwned(f->part, i) < 0) continue;
    AddSupports(s, f->fe, i, r, support);
    for (PetscInt k = i * dim; k < (i + 1) * dim; k++) {
      AddBoth(s, f->fe, k, load[k], &loads[0]);
      AddBoth(s, f->fe, k, contact[k], &loads[1]);
    }
  }
  PetscCall(HycoSpringsVisit(f->fe, AddSpring, s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest component of what is left on a body of the forces, and of the moments about the centre, each over the sum
   of its magnitudes. Moments of tied bodies depend on how their nodes are tied. */
static PetscReal ReactionsRemainingGap(const HycoFOM f, const Sums *s, PetscInt b, PetscReal force, PetscReal moment)
{
  const OnBody *on = &s->body[b];
  const PetscReal size = PetscMax(on->size, SMALL_BALANCE * force), turns = PetscMax(on->turns, SMALL_BALANCE * moment);
  const PetscReal *F = on->all.force;
  PetscReal most = 0;

  for (PetscInt c = 0; c < 3 && size > 0; c++) {
    const PetscInt d = (c + 1) % 3, e = (c + 2) % 3;
    const PetscReal turn = on->all.moment[c] - (s->centre[d] * F[e] - s->centre[e] * F[d]);

    most = PetscMax(most, PetscAbsReal(F[c]) / size);
    if (f->fe->formulation != HYCO_AXISYMMETRIC && (f->fe->dim == 3 || (f->fe->dim == 2 && c == 2)) && turns > 0 &&
        !f->part->ties)
      most = PetscMax(most, PetscAbsReal(turn) / turns);
  }
  return most;
}

/* Sums over the ranks, and the imbalance of the bodies. Collective. */
static PetscErrorCode ReactionsBalance(HycoFOM f, PetscInt n, Sums *s, PetscReal *balance)
{
  const PetscInt n_bodies = f->scene->n_bodies;
  PetscReal force = 0, moment = 0, size;
  PetscInt at = 0;
  PetscReal *sum;
  Vec terms;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(6 * n + 8 * n_bodies, &sum));
  for (PetscInt pass = 0; pass < 2; pass++) {
    at = 0;
    for (PetscInt k = 0; k < n + n_bodies; k++) {
      HycoReaction *r = k < n ? &s->result[k] : &s->body[k - n].all;

      for (PetscInt c = 0; c < 3; c++, at += 2) {
        if (pass)
          r->force[c] = sum[at], r->moment[c] = sum[at + 1];
        else
          sum[at] = r->force[c], sum[at + 1] = r->moment[c];
      }
    }
    for (PetscInt b = 0; b < n_bodies; b++, at += 2) {
      OnBody *on = &s->body[b];

      if (pass)
        on->size = sum[at], on->turns = sum[at + 1];
      else
        sum[at] = on->size, sum[at + 1] = on->turns;
    }
    /* All in one reduction. */
    if (!pass) HycoAllreduce(sum, at, MPIU_REAL, MPI_SUM, HycoComm(f));
  }
  PetscCall(PetscFree(sum));
  for (PetscInt b = 0; b < n_bodies; b++) {
    force += s->body[b].size;
    moment += s->body[b].turns;
  }
  PetscCall(VecDuplicate(f->U, &terms));
  PetscCall(MatGetDiagonal(f->K, terms));
  PetscCall(VecPointwiseMult(terms, terms, f->U));
  PetscCall(VecNorm(terms, NORM_1, &size));
  PetscCall(VecDestroy(&terms));
  *balance = 0;
  /* Without any force all of them are round-off of the displacements. */
  for (PetscInt b = 0; b < n_bodies && force > HYCO_NOTHING * size; b++)
    *balance = PetscMax(*balance, ReactionsRemainingGap(f, s, b, force, moment));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The middle of the nodes' extents. Collective. */
static PetscErrorCode FindCentre(HycoFOM f, PetscReal centre[3])
{
  PetscReal end[6];

  PetscFunctionBegin;
  for (PetscInt c = 0; c < 6; c++) end[c] = PETSC_MIN_REAL;
  for (PetscInt i = 0; i < 3 * f->part->n_nodes; i++) {
    end[i % 3] = PetscMax(end[i % 3], f->fe->X[i]);
    end[3 + i % 3] = PetscMax(end[3 + i % 3], -f->fe->X[i]);
  }
  HycoAllreduce(end, 6, MPIU_REAL, MPI_MAX, HycoComm(f));
  for (PetscInt c = 0; c < 3; c++) centre[c] = (end[c] - end[3 + c]) / 2;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Resultants (N) and moments about the origin of each support and spring, of the loads and of the obstacles, and their
   balance, in f->reaction (borrowed). Collective. Group names are borrowed from the scene. */
PetscErrorCode HycoFOMGetReactions(HycoFOM f, PetscInt *n, const HycoReaction *result[], PetscReal *balance)
{
  HycoScene scene;
  PetscInt all, n_dof, *support;
  PetscReal *work;
  Sums s = {0};

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  HycoCheckGiven(n);
  HycoCheckGiven(result);
  HycoCheckGiven(balance);
  PetscCheck(f->solved, PETSC_COMM_SELF, PETSC_ERR_ORDER, "call HycoFOMSolve() before HycoFOMGetReactions()");
  scene = f->scene;
  n_dof = f->fe->n_dof;
  all = scene->n_fixed + scene->n_springs + 2;
  /* Kept: the result borrows it until the next call. */
  if (!f->reaction) PetscCall(PetscMalloc1(all, &f->reaction));
  PetscCall(PetscArrayzero(f->reaction, all));
  PetscCall(PetscMalloc2(3 * n_dof, &work, n_dof, &support));
  s.result = f->reaction;
  s.u = f->u;
  PetscCall(PetscMalloc1(scene->n_bodies, &s.part));
  PetscCall(PetscCalloc1(scene->n_bodies, &s.body));
  PetscCall(HycoJoinBodies(HycoComm(f), scene, f->part, s.part));
  PetscCall(FindCentre(f, s.centre));
  PetscCall(AddUp(f, work, support, &s));
  PetscCall(PetscFree2(work, support));
  PetscCall(ReactionsBalance(f, all, &s, balance));
  HycoFreeAll(&s.part, &s.body);
  for (PetscInt k = 0; k < all; k++) {
    HycoReaction *r = &f->reaction[k];

    r->kind = k < scene->n_fixed ? HYCO_REACTION_SUPPORT
              : k < all - 2      ? HYCO_REACTION_SPRING
              : k < all - 1      ? HYCO_REACTION_LOADS
                                 : HYCO_REACTION_CONTACT;
    r->group = r->kind == HYCO_REACTION_SUPPORT  ? scene->fixed[k].group
               : r->kind == HYCO_REACTION_SPRING ? scene->spring[k - scene->n_fixed].group
                                                 : "";
  }
  *n = all;
  *result = f->reaction;
  PetscFunctionReturn(PETSC_SUCCESS);
}
