/*
  The gradient of a prediction. A type's problem is w = q + M z, z = (x, L); with the set of closed contacts M z' + q' =
  0 there, with q' the change of w at fixed z. A type with the op `perturbed` has q' and the derivatives of its fields
  from those of its data, at the closed contacts alone; of others q' is a difference of w, and the fields are those of a
  moved state. An output's derivative is its difference along mu + h and z + h z' together. Outputs are measured on the
  cells that decide them.
*/
#include <hycogradient.h>
#include <hycolcp.h>
#include <hycomaterialimpl.h>
#include <hycoromimpl.h>

typedef struct {
  HycoROM m;
  PetscReal mu[HYCO_MAX_PARAMETERS];
  PetscInt p, n, k, *contact; /* unknowns x, forces; those that are closed or undecided */
  PetscInt n_contacts;        /* of `near` */
  const PetscInt *row;        /* with friction the row of a contact's normal among the forces; NULL: there is none */
  PetscBool friction, past;   /* past: a step depends on those before */
  PetscBool passing;          /* a step whose outputs are not listed */
  PetscInt *list;             /* n: the contacts of the problem, once the problem is that of some */
  PetscBool near, held;       /* held: supports hold nodes of the contacts */
  PetscInt parameter;         /* in hand */
  /* it changes the contacts' rows or gaps; enters the outputs' cells beside displacements, and those of
     means known by their slopes; moves supports of these */
  PetscBool rows, enters, means, moved_means;
  PetscBool disturbed;  /* all cells of the outputs were moved to points beside mu */
  PetscReal *z, *moved; /* p + n */
  PetscReal *dz;        /* p + n: along the parameter in hand */
  PetscReal *w[5];      /* p + n: at the three points, and at closer ones */
  PetscInt at[5];       /* the number of each among what the type keeps of points beside mu */
  PetscReal *q, *v;     /* p + k */
  PetscReal size;
  PetscBool regular;  /* the forces of the closed contacts are unique */
  PetscBool focused;  /* the outputs' cells are few */
  PetscBool contacts; /* outputs read contacts alone, and the forces are those of z */
  PetscBool forces;   /* of a type with `perturbed`: outputs need no displacements */
  HycoTangent tangent;
  PetscReal *output; /* 6 x n_outputs: at the three points, at closer ones */
  /* the prediction */
  HycoPrediction prediction;
  PetscReal remainder, *gamma, *U, *Lambda;
  PetscBool *modes, *dofs;     /* what outputs depend on of gamma and U */
  PetscReal *dgamma, *dU, *u0; /* along the parameter in hand; prescribed displacements at mu */
  PetscBool whole_current;
} Work;

/* The state of z at mu (NULL: the data are there), as a prediction would leave it. In the order of a
   prediction: the floating bodies' balance changes forces that the reconstruction has set. */
static PetscErrorCode ROMGradientMove(Work *o, const PetscReal mu[], const PetscReal z[])
{
  HycoROM m = o->m;
  const PetscReal imbalance = m->imbalance, corrected = m->corrected;
  PetscReal size;

  PetscFunctionBegin;
  PetscUseTypeMethod(m, residual, mu, z, NULL, &size);
  PetscUseTypeMethod(m, expand);
  if (m->ops->reconstruct && m->reconstruct) PetscCall((*m->ops->reconstruct)(m));
  PetscCall(HycoFloatingBalance(m));
  /* Those of the prediction. */
  m->imbalance = imbalance;
  m->corrected = corrected;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The outputs there. Those of contacts need their rows and forces, and no displacement. */
static PetscErrorCode MoveAndMeasure(Work *o, const PetscReal mu[], const PetscReal z[], PetscReal output[])
{
  HycoPrediction p = {0};

  PetscFunctionBegin;
  if (o->contacts) {
    if (mu) PetscCall(HycoROMBringRows(o->m, mu));
    PetscCall(PetscArraycpy(o->m->Lambda, z + o->p, o->n));
  } else
    PetscCall(ROMGradientMove(o, mu, z));
  PetscCall(HycoROMMeasureQuantities(o->m, &p));
  PetscCall(PetscArraycpy(output, p.quantity, o->m->model->scene->n_quantities));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets what outputs read, moved along the derivatives, and measures them; u0: the prescribed displacements at mu. */
static PetscErrorCode MeasureState(Work *o, const PetscReal mu[], const PetscReal u0[], PetscReal step,
                                   PetscReal output[])
{
  HycoROM m = o->m;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < o->n_contacts; k++) {
    const PetscInt at = o->p + (o->row ? o->row[k] : k);

    m->Lambda[o->rows || o->row ? k : o->list[k]] = o->z[at] + step * o->dz[at];
  }
  for (PetscInt j = 0; j < m->model->l && !o->forces; j++) m->gamma[j] = o->gamma[j] + step * o->dgamma[j];
  for (PetscInt j = 0; j < m->model->n_fe && !o->forces; j++) {
    const PetscInt i = m->model->fe_dof[j];

    m->U[i] = o->U[i] + u0[i] - o->u0[i] + step * o->dU[i];
  }
  /* All cells, where a parameter moves those of a mean, or changes their laws. */
  if (o->means) PetscCall(HycoROMUnfocusOutputs(m));
  HycoFinally(HycoROMMeasureAt(m, o->enters || o->means ? mu : o->mu, output),
              PetscCall(o->means ? HycoROMUnfocusOutputs(m) : PETSC_SUCCESS));
  if (o->focused && !o->means)
    PetscCall(HycoROMChangeMeans(m, o->moved_means ? mu : NULL, o->output, step, o->dgamma, o->dU, output));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With the friction there. */
static PetscErrorCode MeasureMoved(Work *o, const PetscReal mu[], const PetscReal u0[], PetscReal step,
                                   PetscReal output[])
{
  const HycoShear shear = o->m->trace.seen;

  PetscFunctionBegin;
  if (o->friction) PetscCall((*o->m->ops->show)(o->m, o->parameter, o->rows, step, o->dz));
  HycoROMOutputsMove(o->m, o->parameter, step);
  HycoFinally(MeasureState(o, mu, u0, step, output), o->friction ? HycoTraceShowOther(o->m, &shear) : (void)0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where the model has the contacts beside. */
static PetscErrorCode MeasureWithRows(Work *o, const PetscReal mu[], PetscReal step, PetscReal output[])
{
  PetscFunctionBegin;
  PetscCall(HycoROMBringRows(o->m, mu));
  PetscCall(MeasureMoved(o, mu, o->m->fe->u0, step, output));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same with what of the contacts and prescribed displacements the parameter changes on one side, where most often
   it is. */
static PetscErrorCode MeasureNear(Work *o, const PetscReal mu[], PetscReal step, PetscReal output[])
{
  PetscBool there;
  PetscInt side = 0;

  PetscFunctionBegin;
  if (!o->rows && !o->enters && !o->means && !o->moved_means) {
    PetscCall(MeasureMoved(o, o->mu, o->u0, step, output));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscArraycmp(o->m->near[1].fe->mu, mu, o->m->model->scene->n_variables, &there));
  if (there) side = 1;
  if (!o->rows) {
    HycoNear *near = &o->m->near[side];

    near->rows.filled = PETSC_FALSE; /* its fe moves without them */
    PetscCall(HycoFESetParameters(near->fe, mu));
    PetscCall(MeasureMoved(o, mu, near->fe->u0, step, output));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  HycoROMExchange(o->m, side);
  HycoFinally(MeasureWithRows(o, mu, step, output), HycoROMExchange(o->m, side));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The outputs at mu of the state moved by step times its change. */
static PetscErrorCode ROMGradientMeasure(void *context, const PetscReal mu[], PetscReal step, PetscReal output[])
{
  Work *o = (Work *)context;

  PetscFunctionBegin;
  if (o->near) {
    PetscCall(MeasureNear(o, mu, step, output));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt i = 0; i < o->p + o->n; i++) o->moved[i] = o->z[i] + step * o->dz[i];
  PetscCall(MoveAndMeasure(o, mu, o->moved, output));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The derivative's matrix, of the closed and the undecided contacts. */
static PetscErrorCode ROMGradientClose(Work *o)
{
  PetscReal *M, *L, *w, most = 0;
  const size_t n = (size_t)(o->p + o->k);

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n * n + 1, &M));
  PetscCall(PetscMalloc2(o->k, &L, o->k, &w));
  PetscCall((*o->m->ops->jacobian)(o->m, o->k, o->contact, M));
  for (PetscInt j = 0; j < o->k; j++) {
    /* Of a contact: its force and its gap at mu. Both nearly 0 is undecided, and gets the state that the derivative
       itself chooses. */
    L[j] = o->z[o->p + o->contact[j]];
    w[j] = o->w[0][o->p + o->contact[j]];
    most = PetscMax(most, L[j]);
  }
  /* Of bodies, whose unknowns are rigid motions, M is 0 there. */
  PetscCall(HycoTangentCreate(o->p, PETSC_FALSE, o->k, M, L, w, o->size, &o->tangent, &o->regular));
  PetscCall(PetscFree2(L, w));
  PetscCall(PetscFree(M));
  /* A singular matrix means forces that can be redistributed: a derivative of one of many distributions would be
     arbitrary. Of a path there are the differences. */
  if (o->m->model->scene->n_times) PetscFunctionReturn(PETSC_SUCCESS);
  HycoCheck(o->regular || most > 0, HYCO_TANGENT_UNPRESSED);
  /* Where forces hold a body only by round-off the matrix may be regular. */
  HycoCheck(!o->prediction.loose, HYCO_GRADIENT_LOOSE, o->m->loose);
  HycoCheck(o->regular,
            "the forces of the model's closed contacts are not unique here, or round-off, and have no derivative");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The problem, of the contacts that are closed or undecided alone; of all where outputs see open ones: the least
   pressure, and that of nodes without area. */
static PetscErrorCode ROMGradientFocus(Work *o)
{
  HycoROM m = o->m;
  const HycoScene scene = m->model->scene;
  const PetscBool all =
      (PetscBool)(o->row || HycoSceneHasOutputs(scene, HYCO_QUANTITY_PRESSURE_MIN, HYCO_QUANTITY_PRESSURE_MIN) ||
                  (scene->formulation == HYCO_AXISYMMETRIC && HycoMeshIsQuadratic(m->model->mesh)));

  PetscFunctionBegin;
  HycoDuplicate(m->fe->n_dof, m->fe->u0, &o->u0);
  PetscCall(PetscCalloc1(m->model->l + 1, &o->dgamma));
  PetscCall(PetscCalloc1(m->model->l + 1, &o->modes));
  PetscCall(PetscCalloc1(m->model->mesh->n_nodes * m->model->mesh->dim + 1, &o->dofs));
  if (!o->passing || HycoROMOutputsFlow(m)) HycoROMOutputsRead(m, o->modes, o->dofs);
  PetscCall(PetscCalloc1(m->fe->n_dof + 1, &o->dU));
  PetscCall(PetscMalloc1(o->n + 1, &o->list));
  for (PetscInt i = 0; i < o->n; i++) o->list[i] = i;
  for (PetscInt i = 0; i < o->k && !all; i++) {
    const PetscInt from = o->contact[i];

    /* Ascending: what is overwritten has been read. */
    o->list[i] = from;
    o->z[o->p + i] = o->z[o->p + from];
    o->w[0][o->p + i] = o->w[0][o->p + from];
    o->contact[i] = i;
  }
  if (!all) o->n = o->k;
  if (!o->row) o->n_contacts = o->n;
  PetscCall(HycoROMMakeNear(m, o->n_contacts, o->list));
  o->near = PETSC_TRUE;
  o->forces = (PetscBool)(!HycoROMOutputsFlow(m) && (o->passing || o->contacts || HycoROMOutputsAreForces(m)));
  o->held = HycoRowsAreHeld(m->fe, &m->near[0].pairs);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Keeps the prediction: differences move the model's state, and ROMGradientRestore() puts it back. */
static PetscErrorCode ROMGradientCreate(Work *o)
{
  HycoROM m = o->m;
  const PetscInt n_dof = m->model->mesh->n_nodes * m->model->mesh->dim;
  PetscReal largest;

  PetscFunctionBegin;
  PetscCall(PetscArraycpy(o->mu, m->fe->mu, m->model->scene->n_variables));
  /* By value: a copy of the struct is all that differences overwrite. */
  o->prediction = m->prediction;
  o->remainder = m->remainder;
  o->whole_current = m->whole_current;
  HycoDuplicate(m->model->l, m->gamma, &o->gamma);
  HycoDuplicate(n_dof, m->U, &o->U);
  HycoDuplicate(m->model->pairs.n, m->Lambda, &o->Lambda);
  PetscUseTypeMethod(m, unknowns, &o->p, &o->n, NULL);
  o->n_contacts = m->model->pairs.n;
  o->contacts =
      (PetscBool)(m->model->traits.surfaces && !m->model->floating && !HycoSceneHasFieldOutputs(m->model->scene));
  PetscCall(PetscMalloc3(o->p + o->n + 1, &o->z, o->p + o->n + 1, &o->moved, o->p + o->n + 1, &o->dz));
  /* Open contacts do not change. */
  PetscCall(PetscArrayzero(o->dz, o->p + o->n));
  for (PetscInt j = 0; j < 5; j++) PetscCall(PetscMalloc1(o->p + o->n + 1, &o->w[j]));
  for (PetscInt j = 0; j < 5; j++) o->at[j] = j;
  PetscCall(PetscMalloc3(o->n + 1, &o->contact, o->p + o->n + 1, &o->q, o->p + o->n + 1, &o->v));
  PetscCall(PetscCalloc1(6 * m->model->scene->n_quantities + 1, &o->output));
  PetscUseTypeMethod(m, unknowns, &o->p, &o->n, o->z);
  if (o->past)
    PetscUseTypeMethod(m, step_residual, &o->row, o->w[0], &largest);
  else
    PetscCall((*m->ops->residual)(m, NULL, o->z, o->w[0], &largest));
  o->size = largest;
  for (PetscInt i = 0; i < o->n; i++) {
    /* Closed or undecided contacts; open ones do not change at first order. */
    if (o->row || HycoTangentMayClose(o->z[o->p + i], o->w[0][o->p + i], o->size)) o->contact[o->k++] = i;
  }
  /* The tangent is factored once, for all parameters. */
  o->regular = PETSC_TRUE;
  if (!o->row) PetscCall(ROMGradientClose(o));
  if (!o->regular) PetscFunctionReturn(PETSC_SUCCESS);
  if (o->passing) {
    PetscCall(ROMGradientFocus(o));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (m->measured)
    PetscCall(PetscArraycpy(o->output, m->prediction.quantity, m->model->scene->n_quantities));
  else
    PetscCall(MoveAndMeasure(o, NULL, o->z, o->output));
  /* Extremes are measured where they are now: a maximum's place does not move in a derivative, by the envelope
     theorem. */
  o->focused = HycoROMPathIsFocused(m);
  if (!o->focused) PetscCall(HycoROMFocusOutputs(m, o->output, &o->focused));
  /* Of a type without `perturbed` the values of fewer terms, whose round-off is that of the differences. */
  if (o->focused && !m->ops->perturbed) PetscCall(MoveAndMeasure(o, NULL, o->z, o->output));
  if (m->ops->perturbed) PetscCall(ROMGradientFocus(o));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Also after an error in ROMGradientCreate(): arrays that do not exist yet are NULL. */
static PetscErrorCode ROMGradientDestroy(Work *o)
{
  PetscFunctionBegin;
  PetscCall(HycoTangentDestroy(&o->tangent));
  PetscCall(PetscFree3(o->z, o->moved, o->dz));
  for (PetscInt j = 0; j < 5; j++) PetscCall(PetscFree(o->w[j]));
  PetscCall(PetscFree3(o->contact, o->q, o->v));
  HycoFreeAll(&o->output, &o->gamma, &o->U, &o->Lambda, &o->list, &o->modes, &o->dofs, &o->dgamma, &o->dU, &o->u0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the gap of a closed contact has different slopes to the two sides: its master changes. closer: the gaps
   nearer to mu are known too; otherwise it may be curvature. */
static PetscBool MasterChanges(const Work *o, const HycoDifference *d, PetscBool closer)
{
  PetscReal most = 0, slope = 0;

  for (PetscInt i = 0; i < o->n; i++) most = PetscMax(most, o->z[o->p + i]);
  /* The slope of the gaps along the parameter is the scale for a jump: a contact that barely moves has slopes of
     round-off. */
  for (PetscInt j = 0; j < o->k; j++) {
    const PetscInt at = o->p + o->contact[j];

    if (o->z[at] > HYCO_UNDECIDED * most)
      slope = PetscMax(slope, PetscAbsReal((o->w[1][at] - o->w[0][at]) / d->step[1]));
  }
  for (PetscInt j = 0; j < o->k; j++) {
    const PetscInt at = o->p + o->contact[j];
    const PetscReal v[3] = {o->w[0][at], o->w[1][at], o->w[2][at]}, near[3] = {o->w[0][at], o->w[3][at], o->w[4][at]};
    PetscReal jump;

    /* A contact without force has no part in the solution, whatever its gap does. */
    if (PetscAbsReal(o->z[at]) <= HYCO_UNDECIDED * most) continue;
    jump = HycoDifferenceJump(d, o->size, slope, v);
    if (closer ? HycoDifferenceKinks(d, jump, near) : jump > 0) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* w at point j of the difference, and at its closer ones. */
static PetscErrorCode ROMGradientPerturbedResidual(Work *o, const HycoDifference *d, PetscInt point, PetscInt j)
{
  HycoROM m = o->m;
  PetscReal at[HYCO_MAX_PARAMETERS], size;

  PetscFunctionBegin;
  HycoDifferencePoint(d, m->model->scene, o->mu, point, at);
  if (o->near && !o->rows)
    PetscCall((*m->ops->perturbed)(m, at, o->n, o->list, PETSC_FALSE, o->z, o->at[j], o->w[j]));
  else if (o->near) {
    HycoROMExchange(m, point - 1);
    HycoFinally((*m->ops->perturbed)(m, at, o->n, o->list, PETSC_TRUE, o->z, o->at[j], o->w[j]),
                HycoROMExchange(m, point - 1));
  } else
    PetscCall((*m->ops->residual)(m, at, o->z, o->w[j], &size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same, with the gaps nearer to mu only where they are needed: d becomes closer, so that its points are on this
   side of a change of masters farther away. */
static PetscErrorCode FindTurns(Work *o, HycoDifference *d, PetscBool *turns)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < HYCO_GRADIENT_CLOSER; k++) {
    HycoDifference near = *d;

    *turns = MasterChanges(o, d, PETSC_FALSE);
    if (!*turns) break;
    /* A jump of the slope stays when the step shrinks, curvature does not. */
    HycoDifferenceShrink(&near);
    for (PetscInt j = 1; j < 3; j++) PetscCall(ROMGradientPerturbedResidual(o, &near, j, 2 + j));
    *turns = MasterChanges(o, d, PETSC_TRUE);
    for (PetscInt j = 1; j < 3; j++) {
      PetscReal *w = o->w[j];
      const PetscInt number = o->at[j];

      o->w[j] = o->w[2 + j];
      o->w[2 + j] = w;
      o->at[j] = o->at[2 + j];
      o->at[2 + j] = number;
    }
    *d = near;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* dz along a parameter. By the implicit function theorem: z moves so that the residual stays 0. The residual's change
   along mu is a difference of three evaluations, exact up to second order. */
static PetscErrorCode ROMGradientDifferentiate(Work *o, HycoDifference *d, PetscBool *kink)
{
  PetscBool turns;

  PetscFunctionBegin;
  for (PetscInt j = 1; j < 3; j++) PetscCall(ROMGradientPerturbedResidual(o, d, j, j));
  PetscCall(FindTurns(o, d, &turns));
  /* A one-sided difference: across the change of masters the central one is of neither side. */
  if (turns) HycoDifferenceTakeSide(d);
  for (PetscInt i = 0; i < o->p + o->k; i++) {
    const PetscInt row = i < o->p ? i : o->p + o->contact[i - o->p];

    o->q[i] = 0;
    for (PetscInt j = 0; j < 3; j++) o->q[i] += d->weight[j] * o->w[j][row];
  }
  if (o->row) {
    /* Of other masters, or states on the border, there are the differences. */
    PetscCall((*o->m->ops->sensitivity)(o->m, d->parameter, d->weight, o->at, o->q, o->dz, &o->regular));
    *kink = turns;
    o->regular = (PetscBool)(o->regular && !turns);
    if (!o->regular) PetscFunctionReturn(PETSC_SUCCESS);
  } else {
    PetscCall(HycoTangentSolve(o->tangent, o->q, d->sign, o->v, kink));
    *kink = (PetscBool)(*kink || turns);
    for (PetscInt i = 0; i < o->p + o->k; i++) o->dz[i < o->p ? i : o->p + o->contact[i - o->p]] = o->v[i];
  }
  /* Displacements, unless outputs need forces alone. */
  if (o->near && !o->forces)
    PetscCall(
        (*o->m->ops->slope)(o->m, o->n, o->list, d->weight + 1, o->at + 1, o->dz, o->modes, o->dofs, o->dgamma, o->dU));
  if (o->past) PetscCall(HycoROMOutputsSensitivity(o->m, o->mu, d, o->dgamma, o->dU, &o->regular));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What a parameter changes: sets rows, enters, means. *nodes: it moves nodes. */
static void TakeChanges(Work *o, PetscInt p, PetscBool *nodes)
{
  const HycoScene s = o->m->model->scene;
  PetscBool changed[HYCO_MAX_PARAMETERS] = {PETSC_FALSE};
  HycoChanges c;

  o->parameter = p;
  changed[p] = PETSC_TRUE;
  c = HycoSceneChanges(s, changed);
  *nodes = c.nodes;
  o->rows = (PetscBool)(c.rows || c.gaps || (o->held && HycoSceneSupportsChange(s, NULL, changed, c.nodes)));
  o->enters = o->means = o->moved_means = PETSC_FALSE;
  if (o->focused && o->near) HycoROMParametersEnter(o->m, changed, &o->enters, &o->means, &o->moved_means);
  o->disturbed = (PetscBool)(o->disturbed || o->means || o->moved_means);
}

/* All columns. First those of parameters that the outputs' cells do not have; last those that move nodes: the way back
   from one's points is a part of the way to the next one's. */
static PetscErrorCode ROMGradientColumns(Work *o, HycoGradientStore *store, HycoGradient *gradient)
{
  HycoROM m = o->m;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < 3 * gradient->n_parameters && o->regular; k++) {
    const PetscInt p = k % gradient->n_parameters;
    HycoDifference d;
    PetscBool kink, nodes;

    TakeChanges(o, p, &nodes);
    if ((nodes ? 2 : o->enters || o->means) != k / gradient->n_parameters) continue;
    HycoDifferenceSet(m->model->scene, o->mu, p, HYCO_GRADIENT_STEP, &d);
    PetscCall(ROMGradientDifferentiate(o, &d, &kink));
    if (!o->regular || o->passing) continue;
    PetscCall(HycoGradientColumn(gradient, store, m->model->scene, o->mu, &d, kink, ROMGradientMeasure, o, o->output));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The model's data and state are again those of the prediction. U after HycoROMComplete(), which would overwrite
   it with the modes' values. */
static PetscErrorCode ROMGradientRestore(Work *o)
{
  HycoROM m = o->m;

  PetscFunctionBegin;
  if (o->focused && !HycoROMPathIsFocused(m)) PetscCall(HycoROMUnfocusOutputs(m));
  if (!o->near) PetscCall(ROMGradientMove(o, o->mu, o->z));
  m->prediction = o->prediction;
  /* Also what getters of the prediction read: the gradient must not be visible in them. */
  m->remainder = o->remainder;
  m->whole_current = o->whole_current;
  PetscCall(PetscArraycpy(m->gamma, o->gamma, m->model->l));
  PetscCall(HycoROMComplete(m));
  PetscCall(PetscArraycpy(m->U, o->U, m->model->mesh->n_nodes * m->model->mesh->dim));
  PetscCall(PetscArraycpy(m->Lambda, o->Lambda, m->model->pairs.n));
  /* Also the fields of the outputs' cells, where all of them were measured beside mu. */
  if (o->disturbed) PetscCall(HycoROMMeasureAt(m, o->mu, o->output));
  m->solved = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refusals before any work: friction and histories have derivatives of the path, not of a point. */
static PetscErrorCode ROMGradientCheck(HycoROM m)
{
  PetscFunctionBegin;
  PetscCall(HycoGradientCheckScene(m->model->scene));
  HycoCheck(m->ops->residual || m->trace.history.n_taken,
            "a model of type %s has no gradients; train one with -hyco_model_type bodies, hybrid or projection",
            m->model->type);
  PetscCheck(m->solved, PETSC_COMM_SELF, PETSC_ERR_ORDER, "call HycoROMPredict() before HycoROMGetGradient()");
  HycoCheck(m->prediction.reason > 0, "there is no gradient: %s",
            m->prediction.why[0] ? m->prediction.why : HycoReasonName(m->prediction.reason));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMStateGradient(HycoROM m, HycoGradientStore *store, HycoGradient *gradient, PetscBool *regular)
{
  Work o = {.m = m, .passing = (PetscBool)!store, .friction = HycoSceneHasFriction(m->model->scene)};
  PetscErrorCode ierr;

  PetscFunctionBegin;
  o.past = (PetscBool)(m->model->scene->n_times && (o.friction || HycoSceneFlows(m->model->scene)));
  PetscCall(HycoROMComplete(m));
  ierr = ROMGradientCreate(&o);
  if (!ierr && o.regular) {
    if (o.tangent) gradient->n_undecided = HycoTangentUndecided(o.tangent);
    ierr = ROMGradientColumns(&o, store, gradient);
    if (!ierr) ierr = ROMGradientRestore(&o);
  }
  *regular = o.regular;
  /* Before the error is raised, so that a program that catches it leaks nothing. */
  PetscCall(ROMGradientDestroy(&o));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After an error the model has no current solution: its state may be that of a difference. */
PetscErrorCode HycoROMGetGradient(HycoROM m, HycoGradient *gradient)
{
  PetscBool regular;

  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  HycoCheckGiven(gradient);
  PetscCall(ROMGradientCheck(m));
  if (m->model->scene->n_times) {
    PetscCall(HycoROMPathGradient(m, gradient));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoGradientCreate(m->model->scene, &m->gradient, gradient));
  HycoOnError(HycoROMStateGradient(m, &m->gradient, gradient, &regular), m->solved = m->ready = PETSC_FALSE);
  PetscFunctionReturn(PETSC_SUCCESS);
}
