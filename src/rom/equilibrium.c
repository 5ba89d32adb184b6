/*
  The residual of the full-order equations along a predicted path, without solving them. The laws are replayed on the
  whole mesh; at each listed time the norm of the residual of equilibrium r = f_int - F + B^T L is sqrt(r . K^-1 r) with
  the elastic stiffness K at the path's first time, whose factor is kept while no parameter changes it. For elastic
  bodies and exact contact forces, it is the energy norm of the displacement's error. The residual of the contact
  conditions 0 <= L complementary to g = D - B u >= 0 is min(g, c L), where c scales L to a length of the size of the
  displacements at the contacts.
*/
#include <hycolinear.h>
#include <hycopath.h>
#include <hycoromimpl.h>

struct _n_HycoBalance {
  PetscBool factored;
  PetscReal mu[HYCO_MAX_PARAMETERS]; /* the variables at which K was assembled */
  Mat K;
  KSP ksp;
  Vec r, x;
  HycoRows rows;            /* of B over dofs of the whole mesh */
  PetscReal *load, *energy; /* n_dof; n_cells */
  PetscReal *gap, *size,
      *approach; /* of the last path: n_listed x n_contacts; by listed time |u| and |B u|, or |u| of the slaves */
  PetscReal *residual, *contact; /* by listed time */
  char why[HYCO_LINE];
  HycoEquilibrium last;
};

/* Also half made: every part is created on the first measurement, in this order. */
PetscErrorCode HycoBalanceDestroy(HycoBalance *balance)
{
  HycoBalance b = *balance;

  PetscFunctionBegin;
  if (!b) PetscFunctionReturn(PETSC_SUCCESS);
  HycoDestroyAll(&b->ksp, &b->K, &b->r, &b->x);
  PetscCall(HycoRowsDestroy(&b->rows));
  HycoFreeAll(&b->load, &b->energy, &b->gap, &b->size, &b->approach, &b->residual, &b->contact, balance);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Everything that a measurement of a whole-mesh path needs; kept in the model, because each held-out path is
   measured. */
static PetscErrorCode EquilibriumCreate(HycoROM m, HycoBalance b)
{
  const HycoFE fe = m->fe_whole;
  /* One more than the listed times: a path that ends early has its end as the last row. */
  const PetscInt n_times = m->model->scene->n_times + 1; /* one more: the end of a path that ends early */

  PetscFunctionBegin;
  PetscCall(HycoFECreateMatrix(fe, PETSC_COMM_SELF, fe->mesh->n_nodes, 0, &b->K));
  PetscCall(MatCreateVecs(b->K, &b->x, &b->r));
  PetscCall(PetscMalloc1(fe->n_dof, &b->load));
  PetscCall(PetscMalloc1(fe->mesh->n_cells, &b->energy));
  PetscCall(PetscMalloc1((size_t)n_times * (size_t)m->model->pairs.n + 1, &b->gap));
  PetscCall(PetscMalloc1(n_times, &b->size));
  PetscCall(PetscMalloc1(n_times, &b->approach));
  PetscCall(PetscMalloc1(n_times, &b->residual));
  PetscCall(PetscMalloc1(n_times, &b->contact));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Floating bodies: adds springs to the ground, the H1 norm matrix scaled to the bodies' stiffness. Without them K is
   singular, and its inverse, by which residuals are measured, does not exist. */
static PetscErrorCode HoldFloating(HycoFE fe, Mat K)
{
  HycoMotions motions;
  Mat M;
  PetscScalar of_K, of_M;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(HycoFEFreeMotions(PETSC_COMM_SELF, fe, &motions));
  n = motions.n;
  PetscCall(HycoMotionsDestroy(&motions));
  if (!n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoFECreateMatrix(fe, PETSC_COMM_SELF, fe->mesh->n_nodes, 0, &M));
  PetscCall(HycoFEAssembleH1(fe, HycoMeshLength(fe->mesh), M));
  PetscCall(MatGetTrace(K, &of_K));
  PetscCall(MatGetTrace(M, &of_M));
  /* By the quotient of the traces: the norm keeps its unit, and no body is much softer or stiffer than another. */
  PetscCall(MatAXPY(K, of_K / of_M, M, DIFFERENT_NONZERO_PATTERN));
  PetscCall(MatDestroy(&M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Factors K at fe's parameters, unless the present factor is valid. */
static PetscErrorCode EquilibriumFactor(HycoROM m, HycoBalance b)
{
  const HycoFE fe = m->fe_whole;
  PetscBool changed[HYCO_MAX_PARAMETERS] = {PETSC_FALSE};
  HycoChanges reached;

  PetscFunctionBegin;
  /* Time and tables are variables too: a stiffness that follows the temperature needs a factor at each listed time. */
  for (PetscInt p = 0; p < m->model->scene->n_variables; p++) changed[p] = (PetscBool)(b->mu[p] != fe->mu[p]);
  reached = HycoSceneChanges(m->model->scene, changed);
  if (b->factored && !reached.nodes && !reached.stiffness) PetscFunctionReturn(PETSC_SUCCESS);
  /* Until the new factor is complete: an error in between must not leave the old one with the new mu. */
  b->factored = PETSC_FALSE;
  PetscCall(KSPDestroy(&b->ksp));
  PetscCall(HycoFEAssembleStiffness(fe, b->K));
  /* A body that only contact supports would make K singular. */
  PetscCall(HoldFloating(fe, b->K));
  HycoLogged(HYCO_EVENT_FACTOR, HycoDefiniteSolver(b->K, "the elastic stiffness of the whole mesh", &b->ksp));
  PetscCall(PetscArraycpy(b->mu, fe->mu, m->model->scene->n_variables));
  b->factored = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Subtracts the tangential forces of friction on the slaves, and adds those on the masters. */
static void AddFriction(HycoROM m, PetscReal f[])
{
  const HycoPairs *pairs = &m->whole_pairs;
  const PetscInt dim = m->fe_whole->dim, *master;
  const PetscReal *weight;
  PetscInt n;

  for (PetscInt k = 0; k < pairs->n; k++) {
    /* The master's share has the weights of the normal force: forces and moments of the two sides are opposite as those
       of full order. */
    HycoPairsMasters(pairs, k, &n, &master, &weight);
    for (PetscInt c = 0; c < dim; c++) {
      const PetscReal force = pairs->shear->force[3 * k + c];

      f[pairs->slave[k] * dim + c] -= force;
      for (PetscInt j = 0; j < n; j++) f[master[j] * dim + c] += weight[j] * force;
    }
  }
}

/* Adds B^T L to f, and stores the gaps and the displacements at the contacts, for listed time j. Of surfaces that stay
   closed B u is round-off, and their size is that of the slaves' displacements. */
static void AddContact(HycoROM m, HycoBalance b, PetscInt j, PetscReal f[])
{
  const HycoRows *B = &b->rows;
  const PetscInt n = m->model->pairs.n, dim = m->fe_whole->dim;
  const PetscReal *L = m->trace.Lambda + (size_t)j * (size_t)n;

  b->approach[j] = 0;
  for (PetscInt k = 0; k < n; k++) {
    PetscReal bu = 0, slave = 0;

    for (PetscInt i = B->start[k]; i < B->start[k + 1]; i++) {
      /* U_whole is the displacement of time j: EquilibriumTimeLoop() has set it before this call. */
      bu += B->value[i] * m->U_whole[B->dof[i]];
      f[B->dof[i]] += B->value[i] * L[k];
    }
    b->gap[(size_t)j * (size_t)n + (size_t)k] = B->gap[k] - bu;
    for (PetscInt c = 0; c < dim; c++) slave += PetscSqr(m->U_whole[m->whole_pairs.slave[k] * dim + c]);
    b->approach[j] += PetscMax(bu * bu, slave);
  }
  b->approach[j] = PetscSqrtReal(b->approach[j]);
}

/* |r| at listed time j of the replay, and |u|, both in the energy norm. */
static PetscErrorCode MeasureTime(HycoROM m, HycoBalance b, HycoReplay *replay, PetscInt j)
{
  const HycoFE fe = m->fe_whole;
  PetscReal sum = 0;
  PetscScalar *r, square;

  PetscFunctionBegin;
  PetscCall(HycoContactRows(fe, &m->whole_pairs, &b->rows));
  PetscCall(HycoFELoads(fe, b->load));
  HycoFEGeneralise(fe, b->load);
  PetscCall(VecGetArray(b->r, &r));
  for (PetscInt k = 0; k < fe->n_dof; k++) r[k] = replay->march.f_int[k] - b->load[k];
  AddContact(m, b, j, r);
  HycoTraceShow(m, j);
  if (m->whole_pairs.shear) AddFriction(m, r);
  /* Reactions balance whatever is left at supports. */
  for (PetscInt k = 0; k < fe->n_dof; k++) r[k] = fe->fixed[k] ? 0 : r[k];
  PetscCall(VecRestoreArray(b->r, &r));
  PetscCall(KSPSolve(b->ksp, b->r, b->x));
  PetscCall(VecDot(b->r, b->x, &square));
  b->residual[j] = PetscSqrtReal(PetscMax(square, 0));
  PetscCall(HycoFEEnergy(fe, m->U_whole, b->energy));
  for (PetscInt e = 0; e < fe->mesh->n_cells; e++) sum += b->energy[e];
  /* The strain energy of elastic laws is |u|^2 / 2 in the norm of K: the same norm as the residual's. */
  b->size[j] = PetscSqrtReal(2 * PetscMax(sum + HycoSpringsEnergy(fe, m->U_whole), 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replays the laws from the first time to the last; ends where a law has no solution. */
static PetscErrorCode EquilibriumTimeLoop(HycoROM m, HycoBalance b, HycoReplay *replay)
{
  const HycoTrace *trace = &m->trace;

  PetscFunctionBegin;
  PetscCall(EquilibriumFactor(m, b));
  for (PetscInt k = 0, j = 0; k < trace->n && j < trace->n_listed; k++) {
    HycoFEStepReport report;

    PetscCall(HycoReplayMove(replay, k));
    /* All accepted steps are replayed, not only listed times: the state of the laws depends on each step's size. */
    HycoTraceWholeU(m, k, m->U_whole);
    PetscCall(HycoReplayTry(replay, k, m->U_whole, &report));
    if (report.failed)
      HycoFormat(b->why, "the laws cannot be integrated on the whole mesh at t = %.10g: %s", (double)trace->t[k],
                 report.why);
    if (report.failed) PetscFunctionReturn(PETSC_SUCCESS);
    /* at[] has the steps that end at a listed time, in order. */
    if (trace->at[j] == k) PetscCall(MeasureTime(m, b, replay, j++));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of values >= 0; 0 for none. */
static PetscReal EquilibriumLargest(PetscInt n, const PetscReal value[])
{
  PetscReal most = 0;

  for (PetscInt j = 0; j < n; j++) most = PetscMax(most, value[j]);
  return most;
}

/* |min(g, c L)| at listed time j. */
static PetscReal ContactResidual(HycoROM m, const HycoBalance b, PetscInt j, PetscReal c)
{
  const PetscInt n = m->model->pairs.n;
  PetscReal sum = 0;

  for (PetscInt k = 0; k < n; k++) {
    const size_t at = (size_t)j * (size_t)n + (size_t)k;
    /* The natural map: 0 exactly where one is 0 and the other not negative. c turns forces into lengths, so that the
       minimum compares like with like. */
    const PetscReal both = PetscMin(b->gap[at], c * m->trace.Lambda[at]);

    sum += both * both;
  }
  return PetscSqrtReal(sum);
}

/* Sets the results from all times, relative to the path's largest values. Relative to the largest of the path, as
   held-out errors are: early steps with small loads would dominate otherwise. */
static void EquilibriumSummarise(HycoROM m, HycoBalance b, HycoEquilibrium *e)
{
  const PetscInt n = m->trace.n_listed;
  const PetscReal size = EquilibriumLargest(n, b->size), approach = EquilibriumLargest(n, b->approach),
                  force = EquilibriumLargest(n * m->model->pairs.n, m->trace.Lambda);

  *e = (HycoEquilibrium){.n = n, .residual = b->residual, .contact = b->contact};
  for (PetscInt j = 0; j < n; j++) {
    b->contact[j] = HycoRelative(ContactResidual(m, b, j, force > 0 ? approach / force : 0), approach);
    b->residual[j] = HycoRelative(b->residual[j], size);
    if (b->residual[j] > e->worst) e->at = j;
    e->worst = PetscMax(e->worst, b->residual[j]);
    e->worst_contact = PetscMax(e->worst_contact, b->contact[j]);
  }
}

/* Replays the laws along the last predicted path and measures the residual of equilibrium at each listed time; a law
   that has no solution there gives an infinite residual with the reason, not an error. */
static PetscErrorCode EquilibriumMeasure(HycoROM m, HycoBalance b, HycoEquilibrium *e)
{
  HycoReplay replay = {0};
  PetscErrorCode ierr;

  PetscFunctionBegin;
  b->why[0] = '\0';
  if (!b->K) PetscCall(EquilibriumCreate(m, b));
  m->whole_current = PETSC_FALSE; /* the replay overwrites U_whole */
  ierr = HycoReplayBegin(m, m->fe_whole, &replay);
  if (!ierr) ierr = EquilibriumTimeLoop(m, b, &replay);
  /* Before the error is raised: the replay holds states in the FE, which the next prediction uses. */
  PetscCall(HycoReplayEnd(&replay));
  PetscCall(ierr);
  if (b->why[0])
    *e = (HycoEquilibrium){.worst = PETSC_INFINITY, .worst_contact = PETSC_INFINITY, .why = b->why};
  else
    EquilibriumSummarise(m, b, e);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After an error the data are destroyed: a factor or matrices may be half made. The result is kept until the next
   prediction. */
PetscErrorCode HycoROMGetEquilibrium(HycoROM m, HycoEquilibrium *e)
{
  PetscErrorCode ierr;

  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  HycoCheckGiven(e);
  PetscCheck(m->solved, PETSC_COMM_SELF, PETSC_ERR_ORDER, "call HycoROMPredict() before HycoROMGetEquilibrium()");
  HycoCheck(m->model->scene->n_times, "HycoROMGetEquilibrium: the model's scene has no history");
  PetscCall(HycoROMLoadWhole(m));
  if (!m->balance) PetscCall(PetscNew(&m->balance));
  ierr = m->balanced ? PETSC_SUCCESS : EquilibriumMeasure(m, m->balance, &m->balance->last);
  m->balanced = (PetscBool)!ierr;
  if (ierr) PetscCall(HycoBalanceDestroy(&m->balance));
  PetscCall(ierr);
  *e = m->balance->last;
  PetscFunctionReturn(PETSC_SUCCESS);
}
