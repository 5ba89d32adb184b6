/*
  Coulomb friction between condensed bodies. A contact with friction has a normal row and dim - 1 tangents, as at full
  order (fom/friction.c); W = sum_b B_b C_b B_b^T has as many. The steps are those of full order, by the same cone and
  solver: nothing but theta is interpolated. W does not change along a path, so that a step is a small dense problem.
*/
#include "bodies_path.h"
#include <hycosolverimpl.h>

#define SOLVED 1e-8 /* residual of the contacts */

struct _n_HycoBodiesFriction {
  HycoSlip slip;
  HycoBodiesSurface normal, all; /* without and with tangents */
  HycoRows rows;
  PetscInt *contact; /* by row: of the scene */
  HycoSystem system;
  HycoSolver solver;
  Mat W;                 /* NULL: not computed at these parameters yet */
  Vec g, L, other;       /* other: a start of the next step */
  PetscReal *before;     /* by row: forces of the accepted step before the last one */
  PetscReal *U, *U_old;  /* n_dof: of the surface, at the step and at the last accepted time */
  PetscReal *w, *forces; /* by row: of the last accepted step */
  PetscReal most;        /* largest displacement */
};

/* Room for the rows with tangents. */
static PetscErrorCode CreateRows(HycoBodiesFriction f)
{
  const HycoPairs *pairs = f->normal.pairs;
  const PetscInt dim = f->slip.dim, n = f->slip.row[f->slip.n];

  PetscFunctionBegin;
  /* Rows of a contact have the same masters, so that the width of its normal row bounds each. */
  f->rows.room = HycoPairsWidth(pairs) * dim * n + 1;
  PetscCall(PetscCalloc1(n + 1, &f->rows.start));
  PetscCall(PetscMalloc1(f->rows.room, &f->rows.dof));
  PetscCall(PetscMalloc1(f->rows.room, &f->rows.value));
  PetscCall(PetscCalloc1(n + 1, &f->rows.gap));
  PetscCall(PetscMalloc1(n + 1, &f->contact));
  for (PetscInt k = 0; k < pairs->n; k++) {
    /* Every row of a contact has its scene entry: the gap and the normal are found by it. */
    for (PetscInt r = f->slip.row[k]; r < f->slip.row[k + 1]; r++) f->contact[r] = pairs->contact[k];
  }
  f->all = (HycoBodiesSurface){f->normal.fe, f->normal.pairs, &f->rows, n, f->contact};
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The solver is always semismooth: the active set of other scenes has no cone. An error leaves a handle that
   HycoBodiesFrictionDestroy() frees. */
PetscErrorCode HycoBodiesFrictionCreate(HycoScene scene, const HycoBodiesSurface *surface, HycoBodiesFriction *friction)
{
  HycoBodiesFriction f;

  PetscFunctionBegin;
  PetscCall(PetscNew(friction));
  f = *friction;
  f->normal = *surface;
  PetscCall(HycoSlipCreate(PETSC_COMM_SELF, scene, surface->pairs, surface->fe->dim, &f->slip));
  /* Rows of normals and tangents, whose number fixes the sizes below. */
  PetscCall(CreateRows(f));
  PetscCall(PetscCalloc1(surface->fe->n_dof, &f->U));
  PetscCall(PetscCalloc1(surface->fe->n_dof, &f->U_old));
  PetscCall(PetscCalloc1(f->all.n + 1, &f->w));
  PetscCall(PetscCalloc1(f->all.n + 1, &f->forces));
  PetscCall(PetscCalloc1(f->all.n + 1, &f->before));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, f->all.n, &f->L));
  PetscCall(VecDuplicate(f->L, &f->g));
  PetscCall(VecDuplicate(f->L, &f->other));
  PetscCall(HycoSystemCreate(PETSC_COMM_SELF, &f->system));
  PetscCall(HycoSolverCreate(PETSC_COMM_SELF, &f->solver));
  PetscCall(HycoSolverSetType(f->solver, HYCO_SOLVER_SEMISMOOTH));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* In the opposite order of creation: the solver refers to the system, and the system to W and g. */
PetscErrorCode HycoBodiesFrictionDestroy(HycoBodiesFriction *friction)
{
  HycoBodiesFriction f = *friction;

  PetscFunctionBegin;
  if (!f) PetscFunctionReturn(PETSC_SUCCESS);
  HycoDestroyAll(&f->solver, &f->system, &f->W, &f->g, &f->L, &f->other);
  PetscCall(HycoSlipDestroy(&f->slip));
  PetscCall(HycoRowsDestroy(&f->rows));
  HycoFreeAll(&f->contact, &f->U, &f->U_old, &f->w, &f->forces, &f->before, friction);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The surface with a row for each normal and tangent. Borrowed; the normal rows alone are those of the model. */
const HycoBodiesSurface *HycoBodiesFrictionSurface(HycoBodiesFriction f)
{
  return &f->all;
}

/* U_old = 0 is the unloaded state, from which the first step measures slip. W depends on the parameters through the
   bodies' weights and poses, but not on time. */
PetscErrorCode HycoBodiesFrictionBegin(HycoBodiesFriction f)
{
  PetscFunctionBegin;
  PetscCall(HycoSlipBegin(&f->slip));
  PetscCall(PetscArrayzero(f->U_old, f->normal.fe->n_dof));
  PetscCall(PetscArrayzero(f->forces, f->all.n));
  PetscCall(VecSet(f->L, 0));
  PetscCall(MatDestroy(&f->W)); /* of other parameters */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* W of all rows, from the columns that are kept while the rows are the same. */
static PetscErrorCode Flexibility(HycoBodiesFriction f, HycoBodiesWork o)
{
  const PetscInt n = f->all.n;
  PetscInt *row;
  PetscScalar *W;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n + 1, &row));
  /* All rows, also of open contacts: the path keeps W for all of its steps. */
  for (PetscInt k = 0; k < n; k++) row[k] = k;
  /* Without this the first step of a path would find that its rows are new and keep nothing. */
  if (!o->kept.same) PetscCall(HycoBodiesKeepRows(o, n)); /* those of now */
  PetscCall(HycoBodiesKeep(o, n, row));
  /* HycoBodiesKeep() gives up where the columns exceed the memory that is allowed. */
  HycoCheck(o->kept.same,
            "the flexibility of %d contacts with friction needs more memory than a model of bodies takes; "
            "use a coarser mesh there, or hyco solve",
            (int)f->slip.n);
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, n, n, NULL, &f->W));
  PetscCall(MatDenseGetArray(f->W, &W));
  for (PetscInt k = 0; k < n; k++) HycoBodiesKeptRow(o, k, n, row, W + (size_t)k * (size_t)n);
  for (PetscInt k = 0; k < n; k++) { /* symmetric to the last digit */
    for (PetscInt j = 0; j < k; j++) W[(size_t)k * (size_t)n + (size_t)j] = W[(size_t)j * (size_t)n + (size_t)k];
  }
  PetscCall(MatDenseRestoreArray(f->W, &W));
  PetscCall(PetscFree(row));
  PetscCall(HycoSystemSetFlexibility(f->system, f->W, f->g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Room for mortars, which may meet more masters than before. */
static PetscErrorCode GrowRows(HycoBodiesFriction f)
{
  const PetscInt room = HycoPairsWidth(f->normal.pairs) * f->slip.dim * f->all.n + 1;

  PetscFunctionBegin;
  if (room <= f->rows.room) PetscFunctionReturn(PETSC_SUCCESS);
  f->rows.room = room;
  PetscCall(PetscRealloc((size_t)room * sizeof(*f->rows.dof), &f->rows.dof));
  PetscCall(PetscRealloc((size_t)room * sizeof(*f->rows.value), &f->rows.value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Called for each step, as gaps and coefficients of friction change in time. */
PetscErrorCode HycoBodiesFrictionPrepare(HycoBodiesFriction f, HycoBodiesWork o, const PetscReal mu[])
{
  const HycoBodiesSurface *s = &f->normal;

  PetscFunctionBegin;
  PetscCall(HycoSlipCoefficients(&f->slip, s->fe, s->pairs));
  PetscCall(HycoPairsMove(s->fe, s->pairs));
  PetscCall(GrowRows(f));
  /* Tangents' gaps are B_t U_old, so that D - B U is the slip of the step. */
  PetscCall(HycoContactTangentRows(s->fe, s->pairs, f->slip.row, f->U_old, f->slip.tangent, f->rows.start, f->rows.dof,
                                   f->rows.value, f->rows.gap));
  PetscCall(HycoBodiesPrepare(o, &f->all, mu));
  /* W is constant along a path; gaps and coefficients change with every step. */
  if (!f->W) PetscCall(Flexibility(f, o));
  PetscCall(HycoVecWrite(f->g, f->all.n, o->gap));
  /* After the coefficients: the cones' data are copied with the blocks. */
  PetscCall(HycoSystemSetBlocks(f->system, 2, f->slip.cone, f->slip.n, f->slip.of, f->slip.data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* w = D - B U of the displacements found, and the residuals of the natural map at it. */
static PetscErrorCode Measure(HycoBodiesFriction f, const PetscReal L[], HycoKKT *kkt)
{
  PetscReal size = 0, force = 0;
  HycoNaturalMap map;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < f->all.n; k++) {
    PetscReal bu = 0, terms = 0;

    for (PetscInt e = f->rows.start[k]; e < f->rows.start[k + 1]; e++) {
      bu += f->rows.value[e] * f->U[f->rows.dof[e]];
      terms += PetscAbsReal(f->rows.value[e] * f->U[f->rows.dof[e]]);
    }
    f->w[k] = f->rows.gap[k] - bu;
    if (f->rows.start[k] < f->rows.start[k + 1]) size = PetscMax(size, PetscMax(PetscAbsReal(f->rows.gap[k]), terms));
    force = PetscMax(force, PetscAbsReal(L[k]));
  }
  f->most = 0;
  for (PetscInt i = 0; i < f->normal.fe->n_dof; i++) f->most = PetscMax(f->most, PetscAbsReal(f->U[i]));
  *kkt = (HycoKKT){0};
  if (!(force > 0)) force = 1;
  /* rho = force / gap makes both arguments of the projection equally large in the units of forces. */
  PetscCall(HycoBlocksNaturalMap(f->system->blocks, size > 0 ? force / size : 1, L, f->w, &map));
  kkt->penetration = map.missing / force;
  kkt->adhesion = map.outside / force;
  kkt->complementarity = map.map / force;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The start is the accepted forces of the last step, not those of an attempt: a halved step must give what it
   would have given at once. Displacements follow from the forces by the bodies' flexibilities, and the residuals
   from both, not from the solver's word. */
PetscErrorCode HycoBodiesFrictionSolve(HycoBodiesFriction f, HycoBodiesWork o, PetscReal t, HycoKKT *kkt, PetscInt *its,
                                       PetscBool *solved)
{
  const HycoFE fe = f->normal.fe;
  PetscScalar *L;
  HycoReason reason;
  PetscBool extrapolated;

  PetscFunctionBegin;
  PetscCall(VecGetArray(f->other, &L));
  extrapolated = HycoSlipExtrapolate(&f->slip, t, f->all.n, f->forces, f->before, L);
  PetscCall(VecRestoreArray(f->other, &L));
  PetscCall(VecGetArray(f->L, &L));
  PetscCall(PetscArraycpy(L, f->forces, f->all.n)); /* a step that was refused leaves no trace */
  PetscCall(VecRestoreArray(f->L, &L));
  PetscCall(HycoSolverSetSystem(f->solver, f->system));
  PetscCall(HycoSolverSetOtherStart(f->solver, extrapolated ? f->other : NULL));
  PetscCall(HycoSolverSolve(f->solver, NULL, f->L));
  PetscCall(HycoSolverGetReason(f->solver, &reason));
  /* What follows is done for forces that did not converge too: their residuals are reported. */
  PetscCall(HycoSolverGetIterations(f->solver, its));
  PetscCall(VecGetArray(f->L, &L));
  HycoBodiesGiven(o, &f->all, L);
  PetscCall(PetscArraycpy(f->U, fe->u0, fe->n_dof));
  HycoBodiesMove(o, &f->all, f->U);
  HycoFEComplete(fe, f->U);
  PetscCall(Measure(f, L, kkt));
  PetscCall(VecRestoreArray(f->L, &L));
  *solved = (PetscBool)(reason > 0 && HycoKKTMax(kkt) <= SOLVED);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Slip, forces and displacements change here only, so that a halved step repeats from the same state. */
PetscErrorCode HycoBodiesFrictionAccept(HycoBodiesFriction f, PetscReal t)
{
  const PetscScalar *L;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(f->L, &L));
  HycoSlipAdd(&f->slip, L, f->w, f->most);
  /* The last two accepted forces, in this order: the next step extrapolates from them. */
  PetscCall(PetscArraycpy(f->before, f->forces, f->all.n));
  PetscCall(PetscArraycpy(f->forces, L, f->all.n));
  HycoSlipTake(&f->slip, t);
  PetscCall(VecRestoreArrayRead(f->L, &L));
  PetscCall(PetscArraycpy(f->U_old, f->U, f->normal.fe->n_dof));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Back to the accepted forces after a refused step; displacements of the bodies are made from them. */
void HycoBodiesFrictionRestore(HycoBodiesFriction f, HycoBodiesWork o)
{
  PetscScalar *L;

  PetscCallVoid(VecGetArray(f->L, &L));
  PetscCallVoid(PetscArraycpy(L, f->forces, f->all.n));
  HycoBodiesGiven(o, &f->all, L);
  PetscCallVoid(VecRestoreArray(f->L, &L));
}

/* The first row of each contact is its normal one. */
void HycoBodiesFrictionNormal(HycoBodiesFriction f, PetscReal Lambda[])
{
  const PetscScalar *L;

  PetscCallVoid(VecGetArrayRead(f->L, &L));
  for (PetscInt k = 0; k < f->slip.n; k++) Lambda[k] = L[f->slip.row[k]];
  PetscCallVoid(VecRestoreArrayRead(f->L, &L));
}

/* Borrowed, for outputs and fields: slip, states and work since the path began. */
const HycoSlip *HycoBodiesFrictionSlip(HycoBodiesFriction f)
{
  return &f->slip;
}

/* sign < 0: the determinant of the last Newton matrix is negative, so that the solution is one of several. */
PetscBool HycoBodiesFrictionDisproven(HycoBodiesFriction f)
{
  return (PetscBool)(f->solver->sign < 0);
}
