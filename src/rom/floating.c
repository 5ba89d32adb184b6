/*
  Equilibrium of the bodies that contact alone holds. Their rigid motions z are in the null space of K, so that at full
  order the contact forces do the work of the loads on each, z^T B^T Lambda = z^T F. A reduced model tests equilibrium
  in its RID or with its modes, and reconstructs forces (41), which misses this by its error. The forces nearest to its
  own in the sense of the relative entropy sum Lambda' log(Lambda' / Lambda) - Lambda' + Lambda with the works of the
  loads are Lambda'_k = Lambda_k exp(sum_j c_j (B z_j)_k): they stay positive, and those that are zero stay zero. c
  minimises the convex dual function sum_k Lambda'_k - sum_j c_j z_j^T F, by Newton's method with a line search.
*/
#include <hycoalgorithms.h>
#include <hycoquantities.h>
#include <hycoromimpl.h>

struct _n_HycoFloating {
  PetscInt n; /* rigid motions */
  HycoRigid *rigid;
  PetscInt n_bodies, *of; /* n x n_bodies: whether a motion moves a body */
  PetscInt moves;         /* the motions depend on the parameters: `rigid` has those of the training */
  HycoMesh mesh;          /* the cells with the loads of these bodies; NULL: there are none */
};

/* NULL-safe: models without floating bodies have none. */
PetscErrorCode HycoFloatingDestroy(HycoFloating *floating)
{
  HycoFloating f = *floating;

  PetscFunctionBegin;
  if (!f) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoMeshDestroy(&f->mesh));
  HycoFreeAll(&f->rigid, &f->of, floating);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* f->mesh is set first, so that HycoFloatingDestroy() frees it after an error. Takes over `loaded`; rigid[] and of[]
   are copied. */
PetscErrorCode HycoFloatingCreate(PetscInt n, const HycoRigid rigid[], PetscInt n_bodies, const PetscInt of[],
                                  PetscBool moves, HycoMesh loaded, HycoFloating *floating)
{
  HycoFloating f;

  PetscFunctionBegin;
  PetscCall(PetscNew(floating));
  f = *floating;
  f->mesh = loaded;
  f->moves = moves;
  f->n = n;
  f->n_bodies = n_bodies;
  HycoDuplicate(n, rigid, &f->rigid);
  HycoDuplicate(n * n_bodies, of, &f->of);
  PetscFunctionReturn(PETSC_SUCCESS);
}

enum { NUMBERS = 3 + 1 + 6 }; /* of a motion in the file: centre, size, coefficients */

/* The number of motions follows from the dataset's rows (-1: not known yet). The mesh may be absent: a floating body
   without loads. One function reads and writes, so that the order of the datasets cannot differ. */
PetscErrorCode HycoFloatingMove(HycoH5 h, HycoROM m)
{
  const PetscBool reads = HycoH5Reads(h);
  HycoFloating f = m->model->floating;
  PetscReal *number = NULL;

  PetscFunctionBegin;
  if (reads ? !HycoH5Has(h, "floating/motions") : !f) PetscFunctionReturn(PETSC_SUCCESS);
  if (reads) PetscCall(PetscNew(&m->model->floating));
  f = m->model->floating;
  if (reads) f->n = -1;
  if (!reads) PetscCall(PetscMalloc1(NUMBERS * f->n, &number));
  for (PetscInt k = 0; !reads && k < f->n; k++) {
    PetscCall(PetscArraycpy(number + NUMBERS * k, f->rigid[k].centre, 3));
    number[NUMBERS * k + 3] = f->rigid[k].size;
    PetscCall(PetscArraycpy(number + NUMBERS * k + 4, f->rigid[k].rigid, 6));
  }
  PetscCall(HycoH5Real(h, "floating/motions", &f->n, NUMBERS, &number));
  if (reads) PetscCall(PetscCalloc1(f->n, &f->rigid));
  for (PetscInt k = 0; reads && k < f->n; k++) {
    PetscCall(PetscArraycpy(f->rigid[k].centre, number + NUMBERS * k, 3));
    f->rigid[k].size = number[NUMBERS * k + 3];
    PetscCall(PetscArraycpy(f->rigid[k].rigid, number + NUMBERS * k + 4, 6));
  }
  PetscCall(PetscFree(number));
  /* of[] is a table, motions x bodies. */
  f->n_bodies = m->model->scene->n_bodies;
  PetscCall(HycoH5Int(h, "floating/bodies", 0, 1, &f->n, f->n_bodies, &f->of));
  if (reads ? HycoH5Has(h, "floating/moves") == PETSC_TRUE : f->moves != 0)
    PetscCall(HycoH5Ints(h, "floating/moves", 0, 1, 1, &f->moves));
  if (reads ? !HycoH5Has(h, "floating/mesh/head") : !f->mesh) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoMeshMove(h, "floating/mesh", f->n_bodies, &f->mesh));
  /* Ties belong to the scene's mesh and are not stored twice. */
  if (reads) PetscCall(HycoMeshSetTies(f->mesh, m->model->mesh->ties));
  if (reads) PetscCall(HycoMeshCreateDM(m->model->scene, f->mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Component c of motion j at node i of fe's mesh, in the unknowns there: zero where one is fixed. */
static PetscReal ROMFloatingEntry(HycoROM m, HycoFE fe, PetscInt j, PetscInt i, PetscInt c)
{
  const HycoFloating f = m->model->floating;

  if (fe->fixed[i * fe->dim + c] || !f->of[j * f->n_bodies + fe->mesh->node_body[i]]) return 0;
  return HycoRigidAt(f->moves ? &m->rigid[j] : &f->rigid[j], fe->dim, fe->X + 3 * i, c);
}

/* The first motion that moves a body, which is that of its connected part; -1: none does. */
static PetscInt PartOf(HycoFloating f, PetscInt body)
{
  for (PetscInt j = 0; j < f->n; j++) {
    if (f->of[j * f->n_bodies + body]) return j;
  }
  return -1;
}

/* The motions at fe_floating's parameters; *found: there are as many of each part as in training. */
static PetscErrorCode MoveMotions(HycoROM m, HycoFloating f, PetscBool *found)
{
  HycoMesh mesh = f->mesh;
  PetscInt *part, n = 0;
  HycoMotions motions;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  *found = PETSC_TRUE;
  if (!f->moves) PetscFunctionReturn(PETSC_SUCCESS);
  if (!m->rigid) PetscCall(PetscMalloc1(f->n, &m->rigid));
  PetscCall(PetscMalloc1(mesh->n_nodes, &part));
  for (PetscInt i = 0; i < mesh->n_nodes; i++) {
    part[i] = PartOf(f, mesh->node_body[i]);
    if (part[i] < 0) part[i] = f->n; /* nodes of other bodies, whose motions are none of these */
  }
  ierr = HycoFEMotionsOfParts(m->fe_floating, f->n + 1, part, &motions);
  PetscCall(PetscFree(part));
  PetscCall(ierr);
  for (PetscInt k = 0; k < motions.n; k++) {
    const PetscInt of = motions.rigid[k].part;

    if (of == f->n) continue;
    for (PetscInt b = 0; b < f->n_bodies && *found; b++)
      *found = (PetscBool)(n < f->n && (PartOf(f, b) == of) == (f->of[n * f->n_bodies + b] != 0));
    if (*found) m->rigid[n++] = motions.rigid[k];
  }
  *found = (PetscBool)(*found && n == f->n);
  PetscCall(HycoMotionsDestroy(&motions));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* work[n]: of the loads at mu, size[n]: of its terms. The balance holds at every mu, and so does the work of the loads
   along a rigid motion, without any elastic solve. *found: the motions are there. */
static PetscErrorCode LoadWork(HycoROM m, HycoFloating f, const PetscReal mu[], PetscReal work[], PetscReal size[],
                               PetscBool *found)
{
  PetscReal *load;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(work, f->n));
  PetscCall(PetscArrayzero(size, f->n));
  *found = PETSC_TRUE;
  if (!f->mesh) PetscFunctionReturn(PETSC_SUCCESS);
  if (!m->fe_floating) PetscCall(HycoFECreate(m->model->scene, f->mesh->dm, &m->fe_floating));
  PetscCall(HycoFESetParameters(m->fe_floating, mu));
  PetscCall(MoveMotions(m, f, found));
  if (!*found) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(m->fe_floating->n_dof, &load));
  ierr = HycoFELoads(m->fe_floating, load);
  if (!ierr) HycoFEGeneralise(m->fe_floating, load);
  for (PetscInt k = 0; !ierr && k < m->fe_floating->n_dof; k++) {
    /* The mesh has all cells with loads of these bodies, so that its nodal loads are complete. */
    for (PetscInt j = 0; load[k] != 0 && j < f->n; j++) {
      const PetscReal term =
          load[k] * ROMFloatingEntry(m, m->fe_floating, j, k / m->fe_floating->dim, k % m->fe_floating->dim);

      work[j] += term;
      size[j] += PetscAbsReal(term);
    }
  }
  PetscCall(PetscFree(load));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The contacts with a force, and their works per force on the motions. */
typedef struct {
  PetscInt n, p, *contact; /* p motions */
  PetscReal *work;         /* n x p */
  const PetscReal *force, *load;
} Dual;

/* The part of friction in the work of contact k on motion j, for a normal force of 1. */
static PetscReal FrictionWork(HycoROM m, HycoFE fe, PetscInt j, PetscInt k)
{
  const PetscInt *master;
  const PetscReal *weight;
  PetscReal work = 0;
  PetscInt n;

  HycoPairsMasters(&m->pairs, k, &n, &master, &weight);
  for (PetscInt c = 0; c < fe->dim; c++) {
    const PetscReal force = m->pairs.shear->force[3 * k + c] / m->Lambda[k];

    work -= force * ROMFloatingEntry(m, fe, j, m->pairs.slave[k], c);
    for (PetscInt i = 0; i < n; i++) work += force * weight[i] * ROMFloatingEntry(m, fe, j, master[i], c);
  }
  return work;
}

/* The work of each pressing contact's row of B, or of its force with friction, on the floating bodies' rigid motions,
   a column per contact. */
static PetscErrorCode FillDual(HycoROM m, HycoFE fe, Dual *d)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < m->model->pairs.n; k++) {
    PetscReal *work = d->work + d->n * d->p;

    /* Zero forces stay zero in the relative entropy; a slave without master has no partner to balance with. */
    if (!(m->Lambda[k] > 0) || HycoPairsAlone(m->model->scene, &m->pairs, k)) continue;
    PetscCall(PetscArrayzero(work, d->p));
    for (PetscInt e = m->rows.start[k]; e < m->rows.start[k + 1]; e++) {
      for (PetscInt j = 0; j < d->p; j++)
        work[j] += m->rows.value[e] * ROMFloatingEntry(m, fe, j, m->rows.dof[e] / fe->dim, m->rows.dof[e] % fe->dim);
    }
    for (PetscInt j = 0; m->pairs.shear && j < d->p; j++) work[j] += FrictionWork(m, fe, j, k);
    d->contact[d->n++] = k;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The dual function at c, its gradient and its Hessian (p x p) there; the size of the terms of the gradient. */
static PetscReal ROMFloatingEvaluate(const Dual *d, const PetscReal c[], PetscReal gradient[], PetscReal hessian[],
                                     PetscReal *size)
{
  const PetscInt p = d->p;
  PetscReal value = 0;

  /* The gradient is a difference of loads and forces' work: its round-off is that of these terms. */
  *size = 0;
  for (PetscInt i = 0; i < p; i++) {
    gradient[i] = -d->load[i];
    value -= c[i] * d->load[i];
    *size = PetscMax(*size, PetscAbsReal(d->load[i]));
    for (PetscInt j = 0; j < p; j++) hessian[i * p + j] = 0;
  }
  for (PetscInt k = 0; k < d->n; k++) {
    const PetscReal *w = d->work + k * p;
    /* The forces are those of the prediction times exp(c.w): positive whatever c is, so that no contact gets a tensile
       force by the balance. */
    PetscReal power = 0, force;

    for (PetscInt i = 0; i < p; i++) power += c[i] * w[i];
    force = d->force[d->contact[k]] * PetscExpReal(power);
    value += force;
    for (PetscInt i = 0; i < p; i++) {
      gradient[i] += force * w[i];
      *size = PetscMax(*size, PetscAbsReal(force * w[i]));
      for (PetscInt j = 0; j < p; j++) hessian[i * p + j] += force * w[i] * w[j];
    }
  }
  return value;
}

#define ITERATIONS 30
#define MET        1e-12 /* of the largest work: 4500 eps, sums over all contacts */

/* Minimises the dual function from c = 0. *met: the works agree. Newton's method with Armijo's line search (Nocedal
   and Wright, Numerical Optimization, algorithm 3.1): the dual of an entropy is convex and smooth, and has no
   constraint. */
static PetscErrorCode ROMFloatingMinimise(const Dual *d, PetscReal c[], PetscBool *met)
{
  const PetscInt p = d->p;
  PetscReal *gradient, *hessian, *inverse, *step, *trial, size, value;

  PetscFunctionBegin;
  *met = PETSC_FALSE;
  PetscCall(PetscArrayzero(c, p));
  PetscCall(PetscMalloc5(p, &gradient, p * p, &hessian, p * p, &inverse, p, &step, p, &trial));
  value = ROMFloatingEvaluate(d, c, gradient, hessian, &size);
  for (PetscInt its = 0; its < ITERATIONS; its++) {
    PetscReal most = 0, slope = 0, t = 1, next;

    for (PetscInt i = 0; i < p; i++) most = PetscMax(most, PetscAbsReal(gradient[i]));
    *met = (PetscBool)(most <= MET * size);
    if (*met) break;
    /* Singular where contacts do not act on a motion: the step has no part in it. */
    PetscCall(HycoPseudoInverse(p, p, hessian, HYCO_RANK, inverse));
    for (PetscInt i = 0; i < p; i++) {
      step[i] = 0;
      for (PetscInt j = 0; j < p; j++) step[i] -= inverse[j * p + i] * gradient[j];
      slope += gradient[i] * step[i];
    }
    do {
      /* Armijo's condition; below, t is halved already, hence 2 t. exp() may overflow to infinity, which `!(<=)`
         refuses. */
      for (PetscInt i = 0; i < p; i++) trial[i] = c[i] + t * step[i];
      next = ROMFloatingEvaluate(d, trial, gradient, hessian, &size);
      t /= 2;
    } while (!(next <= value + 1e-4 * 2 * t * slope + 1e-14 * PetscAbsReal(value)) && t > 1e-6);
    if (!(t > 1e-6)) break;
    PetscCall(PetscArraycpy(c, trial, p));
    value = next;
  }
  PetscCall(PetscFree5(gradient, hessian, inverse, step, trial));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Without a load, terms may be round-off of the forces, where none acts along the motion: it has no balance to miss. */
PetscReal HycoROMImbalance(PetscInt p, PetscInt n, const PetscReal work[], const PetscInt at[], const PetscReal force[],
                           const PetscReal load[], const PetscReal size[], PetscReal rounding)
{
  PetscReal most = 0, all = 0;

  for (PetscInt k = 0; k < n; k++) all += PetscAbsReal(force[at ? at[k] : k]);
  for (PetscInt j = 0; j < p; j++) {
    PetscReal sum = -load[j], terms = size[j], reach = 0;

    for (PetscInt k = 0; k < n; k++) {
      const PetscReal term = force[at ? at[k] : k] * work[k * p + j];

      sum += term;
      terms += PetscAbsReal(term);
      reach = PetscMax(reach, PetscAbsReal(work[k * p + j]));
    }
    sum = PetscMax(PetscAbsReal(sum) - rounding * reach, 0);
    if (terms > HYCO_LOADS_ROUND_OFF * reach * all) most = PetscMax(most, sum / terms);
  }
  return most;
}

/* Forces are multiplied by positive factors, so that open contacts stay open and none pulls. */
PetscErrorCode HycoFloatingBalance(HycoROM m)
{
  HycoFloating f = m->model->floating;
  Dual d = {0};
  HycoFE fe;
  PetscReal *load, *size, *c;
  PetscBool met = PETSC_FALSE, found;

  PetscFunctionBegin;
  if (!f || !HycoROMHasAllForces(m)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoROMBringContacts(m, &fe));
  PetscCall(PetscMalloc5(f->n, &load, f->n, &size, f->n, &c, m->model->pairs.n, &d.contact,
                         (size_t)m->model->pairs.n * (size_t)f->n, &d.work));
  d.p = f->n;
  d.force = m->Lambda;
  d.load = load;
  PetscCall(LoadWork(m, f, m->fe->mu, load, size, &found));
  if (found) PetscCall(FillDual(m, fe, &d));
  if (found)
    m->corrected = PetscMax(m->corrected, HycoROMImbalance(f->n, d.n, d.work, d.contact, m->Lambda, load, size, 0));
  if (d.n) PetscCall(ROMFloatingMinimise(&d, c, &met));
  /* Only if all works agree: forces in between would be neither the model's nor in balance. */
  for (PetscInt k = 0; met && k < d.n; k++) {
    PetscReal power = 0;

    for (PetscInt j = 0; j < d.p; j++) power += c[j] * d.work[k * d.p + j];
    m->Lambda[d.contact[k]] *= PetscExpReal(power);
  }
  if (found)
    m->imbalance = PetscMax(m->imbalance, HycoROMImbalance(f->n, d.n, d.work, d.contact, m->Lambda, load, size, 0));
  PetscCall(PetscFree5(load, size, c, d.contact, d.work));
  PetscFunctionReturn(PETSC_SUCCESS);
}
