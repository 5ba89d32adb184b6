/*
  hyco export: the predictions of a model as one file of C99. The model's problem is probed through the operations that
  gradients use: w = q + M z, and the values from which the outputs follow, are affine in z, and functions of the
  parameters are found for their coefficients (functions.c). The runtime that the file has is also compiled here: before
  anything is written, its predictions are compared with the model's. Of surfaces that move past each other z has the
  forces at the places of the surfaces instead (travel.c): the search, which is no function of the parameters, is the
  program's own. Of bodies that flow z ends with the coefficients of their modes, and the values begin with the strains
  of their points (flow.c).
*/
#include "flow.h"
#include "travel.h"
#include <hycoextensions.h>
#include <hycoflow.h>
#include <hycoquantities.h>
#include <math.h>
#include <string.h>
#include <time.h>

#define FLOWS 1
#define SLIPS 1
#include "runtime/runtime.c"
#include <hycocoulomb.h>
#include "runtime/paths.c"
#include "runtime/flow.c"

/* Of the largest value of a fitted function, at points that were not fitted: 1/50 of OUTPUTS_AGREE, since a program
   sums up to fifty functions. */
#define FIT_TOLERANCE 2e-11
#define CHECKED       64 /* points at which the runtime is compared with the model */
/* Of an output's largest value, program against model: the sum of FIT_TOLERANCE over some fifty functions
   (tests/models/export.py). */
#define OUTPUTS_AGREE 1e-9
/* Of an output's largest value, program against model, of bodies that flow: ten times OUTPUTS_AGREE, because a path
   adds up what Newton's method leaves in its steps. */
#define FLOWS_AGREE   1e-8
#define PLACES        6 /* at which expressions in space are functions of the parameters */
#define MOST          6000000
#define MOST_ITEMS    3000
#define PATHS_CHECKED 8 /* or so many paths */
/* Of what the same force moves in its block: the round-off of a solve with a factor; such a tangent is held. */
#define HELD_ROW 1e-12
/* Of the largest coefficient of a load: the round-off of a sum of thousands of terms. */
#define COEFFICIENT_ROUND_OFF 1e-12
/* Points for the functions, of which a third checks them; EACH more for each sample whose weight is a function. */
#define SAMPLES 120
#define SEVERAL 20 /* samples: with more, products are tried of known functions alone */
#define EACH    8
/* Of the largest value of a function: below it the fit is repeated with functions chosen from all at once at more
   points; larger errors have another cause (tests/models/export.py). */
#define REPAIRABLE 1e-3
#define MORE       3 /* times as many points then */

/* A value: of an output, of a contact's force along an axis, of a stress in a cell, of a displacement, of a travel. */
typedef struct {
  enum { QUANTITY, FORCE, CELL, NODE, TRAVEL, COEFFICIENT, AREA, STRAIN } from;
  /* group: the output to which it belongs; from n_outputs on those of a travel; -1: of contacts */
  PetscInt index, axis, group;
  PetscReal coefficient[6]; /* of a cell's stresses */
  PetscInt turned;          /* 1 + the body whose axes the values of a cell or node are in; 0: those of space */
} Row;

typedef struct {
  HycoROM m;
  HycoScene s;
  HycoTravel travel;          /* NULL: no surface moves */
  HycoFlows flows;            /* NULL: no body flows */
  PetscInt p, n, k, *contact; /* motions and contacts of the model's problem; the contacts with a row, or all places; */
  PetscInt *first;            /* with friction rows instead; by contact of the model: its first one; NULL: its number */
  PetscInt l;                 /* modes of bodies that flow */
  PetscReal *z, unit[3];      /* p + n + l; their sizes */
  PetscReal *w;
  PetscInt n_rows, ny, n_groups, *group;
  HycoAtoms atoms;
  Row *row;
  PetscReal *area;     /* by contact of the model; where none travels, values: */
  PetscInt travel_row; /* the first row of the travel's values */
  PetscInt n_weights;  /* of the samples of bodies: expressions */
  char **weight;
  HycoExportFit base, response;
  HycoExportModel out;
  double *state; /* of a path of the program */
} Export;

/* -- probing -- */

/* The displacement that the row names, in the axes of its body. */
static PetscReal ExportComponent(const Export *e, const Row *r, const PetscReal u[])
{
  const PetscInt dim = e->m->model->mesh->dim, node = r->index / dim;
  const PetscReal *Q = r->turned ? e->travel->bodies->pose[r->turned - 1].Q : NULL;
  PetscReal sum = 0;

  if (!Q) return u[r->index];
  for (PetscInt c = 0; c < dim; c++) sum += Q[3 * c + r->index % dim] * u[node * dim + c];
  return sum;
}

/* The same of stresses (xx, yy, zz, xy, yz, xz). */
static PetscReal ExportStress(const Export *e, const Row *r, PetscInt n, const PetscReal sigma[])
{
  static const PetscInt at[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}};
  const PetscReal *Q = r->turned ? e->travel->bodies->pose[r->turned - 1].Q : NULL;
  PetscReal sum = 0;

  for (PetscInt k = 0; k < n; k++) {
    const PetscInt i = at[k][0], j = at[k][1];
    PetscReal own = Q ? 0 : sigma[k];

    for (PetscInt c = 0; c < n && Q; c++) { /* Q^T sigma Q */
      const PetscInt a = at[c][0], b = at[c][1];

      own += sigma[c] * (Q[3 * a + i] * Q[3 * b + j] + (a == b ? 0 : Q[3 * b + i] * Q[3 * a + j]));
    }
    sum += r->coefficient[k] * own;
  }
  return sum;
}

/* The areas of the contacts at the model's parameters. */
static PetscErrorCode FindAreas(Export *e)
{
  PetscReal *normal, *gap;
  HycoFE fe;

  PetscFunctionBegin;
  PetscCall(HycoROMBringContacts(e->m, &fe));
  PetscCall(PetscMalloc2(3 * e->m->pairs.n, &normal, e->m->pairs.n, &gap));
  PetscCall(HycoContactGeometry(fe, &e->m->pairs, normal, gap));
  PetscCall(HycoContactAreas(fe, &e->m->pairs, normal, e->area));
  PetscCall(PetscFree2(normal, gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The size of entry i of z, of which there are p + k + l. */
static PetscReal UnitOf(const Export *e, PetscInt i)
{
  return e->unit[i < e->p ? 0 : i < e->p + e->k ? 1 : 2];
}

/* y = (w, values) at mu for z: motions, the contacts of e->contact, alpha, in units of e->unit; NULL: 0. */
static PetscErrorCode ExportProbe(Export *e, const PetscReal mu[], const PetscReal z[], PetscReal y[])
{
  HycoROM m = e->m;
  HycoPrediction prediction = {0};
  const HycoContactResult *result;
  const PetscReal *u, *sigma;
  PetscReal size;
  PetscInt n_sigma;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(e->z, e->p + e->n + e->l));
  for (PetscInt i = 0; z && i < e->p + e->k + e->l; i++) {
    const PetscInt at = i < e->p ? i : i < e->p + e->k ? e->p + e->contact[i - e->p] : e->n - e->k + i;

    /* Contacts without a row stay 0. */
    e->z[at] = z[i] * UnitOf(e, i);
  }
  /* Order: the residual sets the parameters, expand the fields of z, from which the outputs follow. */
  if (e->travel)
    PetscCall(HycoTravelResidual(e->travel, mu, e->z, e->w));
  else
    PetscUseTypeMethod(m, residual, mu, e->z, e->w, &size);
  PetscUseTypeMethod(m, expand);
  PetscCall(HycoROMMeasureQuantities(m, &prediction));
  PetscCall(HycoROMSumContacts(m, m->Lambda, &result));
  if (!e->travel) PetscCall(FindAreas(e));
  HycoROMGetOutputFields(m, &u, &sigma);
  n_sigma = HycoStrainSize(m->model->mesh->dim);
  for (PetscInt i = 0; i < e->p; i++) y[i] = e->w[i];
  for (PetscInt i = 0; i < e->k; i++) y[e->p + i] = e->w[e->p + e->contact[i]];
  for (PetscInt i = 0; i < e->n_rows; i++) {
    const Row *r = &e->row[i];
    PetscReal *value = &y[e->p + e->k + i];

    *value = r->from == QUANTITY ? prediction.quantity[r->index]
             : r->from == FORCE  ? result[r->index].force[r->axis]
             : r->from == NODE   ? ExportComponent(e, r, u)
             : r->from == TRAVEL ? HycoTravelValue(e->travel, r->index)
                                 : 0;
    if (r->from == AREA) *value = e->area[r->index];
    if (r->from == STRAIN) *value = HycoFlowsStrain(e->flows, r->index);
    if (r->from == COEFFICIENT)
      PetscCall(HycoExprEval(e->s->contact[m->pairs.contact[r->index]]->friction, mu, 1,
                             m->fe->X + 3 * m->pairs.slave[r->index], value));
    if (r->from == CELL) *value = ExportStress(e, r, n_sigma, sigma + r->index * n_sigma);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the outputs -- */

#define ADD_ROW(e, ...)    HYCO_APPEND((e)->n_rows, (e)->row, __VA_ARGS__)
#define ADD_CONTACT(e, k)  HYCO_APPEND((e)->out.n_contact, (e)->out.m.contact, (int)(k))
#define ADD_WEIGHT(e, one) HYCO_APPEND((e)->out.n_weights, (e)->out.m.weight, one)

/* Copies the names. */
static PetscErrorCode AddOutput(HycoExportModel *m, Output output, const char name[], const char unit[])
{
  PetscFunctionBegin;
  HYCO_ADD(m->m.n_outputs, m->m.output, output);
  HYCO_ADD(m->m.n_outputs, m->name, NULL);
  HYCO_ADD(m->m.n_outputs, m->unit, NULL);
  PetscCall(PetscStrallocpy(name, &m->name[m->m.n_outputs]));
  PetscCall(PetscStrallocpy(unit, &m->unit[m->m.n_outputs++]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One number of the fields u, sigma as the scene's outputs are measured. */
static PetscErrorCode MeasureOne(HycoFE fe, HycoQuantity q, HycoQuantityKind kind, PetscInt field, const PetscReal u[],
                                 const PetscReal sigma[], PetscReal *value)
{
  const HycoScene s = fe->scene;
  HycoQuantity *const all = s->quantity;
  const PetscInt n = s->n_quantities;

  PetscFunctionBegin;
  /* q is a copy. The scene has this one output during the call: the same code as for predictions measures it. */
  q.kind = kind;
  q.field = field;
  s->quantity = &q;
  s->n_quantities = 1;
  HycoFinally(HycoQuantitiesMeasure(PETSC_COMM_SELF, fe, NULL, u, sigma, NULL, NULL, value), s->quantity = all;
              s->n_quantities = n);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Only for names that are in the list. */
static PetscInt FieldOf(const char name[])
{
  PetscInt k = 0;

  while (strcmp(HycoQuantityFields[k], name)) k++;
  return k;
}

/* The items of an output of kind max, min or mean: its nodes or cells, found by fields that are 1 in one of them. */
static PetscErrorCode AddItems(Export *e, PetscInt quantity, Output *o)
{
  const HycoQuantity *q = &e->s->quantity[quantity];
  const char *field = HycoQuantityFields[q->field];
  const PetscBool cells = (PetscBool)(field[0] != 'u');
  const HycoFE fe = HycoROMGetOutputCells(e->m);
  const PetscInt each = cells ? fe->n_sigma : fe->dim, n = cells ? fe->mesh->n_cells : fe->mesh->n_nodes;
  const PetscInt one = FieldOf(cells ? "sigma_xx" : "u_x");
  PetscReal *u, *sigma, in, weight, c[6];

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(fe->n_dof, &u, fe->mesh->n_cells * fe->n_sigma, &sigma));
  for (PetscInt i = 0; i < n; i++) {
    PetscReal *const at = (cells ? sigma : u) + i * each;
    Row row = {.from = cells ? CELL : NODE, .index = cells ? i : i * each};

    /* Invariants do not depend on the axes: in those of a turning body fewer functions of the parameters suffice. */
    if (e->travel && o->of != COMPONENT)
      row.turned = 1 + HycoTravelBody(e->travel, cells ? fe->mesh->cell_body[i] : fe->mesh->node_body[i]);
    at[0] = 1;
    /* 0 outside of the output's group, 1 in it; the mean of the same field is the item's weight. */
    PetscCall(MeasureOne(fe, *q, HYCO_QUANTITY_MAX, one, u, sigma, &in));
    PetscCall(MeasureOne(fe, *q, HYCO_QUANTITY_MEAN, one, u, sigma, &weight));
    at[0] = 0;
    if (in <= 0) continue;
    HycoCheck(
        o->n < MOST_ITEMS,
        "the output %s is over more than %d nodes or cells, which is too much for a program of its own; give it a "
        "smaller group",
        q->name, MOST_ITEMS);
    o->n++;
    if (q->kind == HYCO_QUANTITY_MEAN) ADD_WEIGHT(e, weight);
    o->width = o->of == COMPONENT ? 1 : each;
    for (PetscInt d = 0; d < (o->of == COMPONENT ? 1 : each); d++) {
      for (PetscInt j = 0; j < 6; j++) row.coefficient[j] = j == d;
      if (!cells) row.index = i * each + (o->of == COMPONENT ? q->field - one : d);
      for (PetscInt j = 0; cells && o->of == COMPONENT && j < each; j++) {
        at[j] = 1;
        PetscCall(MeasureOne(fe, *q, HYCO_QUANTITY_MEAN, q->field, u, sigma, &c[j]));
        at[j] = 0;
        /* A component along a direction is linear in those of the stress: its coefficients by unit stresses. */
        row.coefficient[j] = c[j] / weight;
      }
      ADD_ROW(e, row);
    }
  }
  PetscCall(PetscFree2(u, sigma));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The contacts of an output; -1: one that is always open, which counts as a pressure of 0. */
static PetscErrorCode AddContacts(Export *e, const HycoQuantity *q, Output *o)
{
  const HycoPairs *pairs = &e->m->model->pairs;
  PetscBool *of;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(pairs->n, &of));
  PetscCall(HycoPairsOfQuantity(e->s, e->m->model->mesh, pairs, q, of));
  o->first = e->out.n_contact;
  for (PetscInt k = 0; k < pairs->n; k++) {
    PetscInt at = e->travel ? k : 0;

    while (!e->travel && at < e->k && e->contact[at] != (e->first ? e->first[k] : k)) at++;
    if (!of[k] || (at == e->k && o->kind != PRESSURE_SMALLEST)) continue;
    ADD_CONTACT(e, at < e->k ? at : -1);
    o->n++;
  }
  PetscCall(PetscFree(of));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of moved surfaces: the sum of the contacts' forces on their slaves, q is of, or their moment. */
static PetscErrorCode AddForces(Export *e, const HycoQuantity *q, Output *o)
{
  const PetscBool none = (PetscBool)(e->m->fe->formulation == HYCO_AXISYMMETRIC && !q->field); /* the sum of a ring */

  PetscFunctionBegin;
  *o = (Output){.kind = RESULTANT, .of = (int)q->field + (q->kind == HYCO_QUANTITY_MOMENT ? 3 : 0), .width = -1};
  PetscCall(AddContacts(e, q, o));
  o->weight = e->out.n_weights;
  for (PetscInt k = 0; k < o->n + e->out.m.surfaces.n_nodes; k++) ADD_WEIGHT(e, k < o->n && !none ? -1 : 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of moved surfaces: a reaction that follows from the balance of bodies is the value of the loads, against which the
   contacts push those of[]. */
static PetscErrorCode AddPush(Export *e, const PetscBool of[], PetscInt axis, Output *o)
{
  const HycoPairs *pairs = &e->m->model->pairs;
  const PetscInt *body = e->m->model->mesh->node_body;

  PetscFunctionBegin;
  *o = (Output){
      .kind = RESULTANT, .of = (int)axis, .width = o->first, .first = e->out.n_contact, .weight = e->out.n_weights};
  o->n = pairs->n;
  for (PetscInt k = 0; k < pairs->n; k++) {
    ADD_CONTACT(e, k);
    ADD_WEIGHT(e, of[body[pairs->slave[k]]]);
  }
  for (PetscInt i = 0; i < e->out.m.surfaces.n_nodes; i++) ADD_WEIGHT(e, of[e->out.m.surfaces.body[i]]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The work of friction: of the blocks of its contacts. */
static PetscErrorCode AddWork(Export *e, const HycoQuantity *q, Output *o)
{
  const HycoPairs *pairs = &e->m->model->pairs;
  PetscBool *of;

  PetscFunctionBegin;
  *o = (Output){.kind = WORK, .width = 1, .first = e->out.n_contact, .weight = -1};
  PetscCall(PetscMalloc1(pairs->n, &of));
  PetscCall(HycoPairsOfQuantity(e->s, e->m->model->mesh, pairs, q, of));
  for (PetscInt b = 0, k = 0; b < e->out.m.n_slip; b++) {
    while (e->first[k] != e->contact[e->out.m.row[b]]) k++;
    if (!of[k]) continue;
    ADD_CONTACT(e, b);
    o->n++;
  }
  PetscCall(PetscFree(of));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AddQuantity(Export *e, PetscInt k)
{
  const HycoQuantity *q = &e->s->quantity[k];
  const HycoQuantityKind kind = q->kind;
  const PetscBool of_field = (PetscBool)(kind < HYCO_QUANTITY_REACTION);
  const char *field = HycoQuantityFields[of_field ? q->field : 0];
  const PetscBool linear = (PetscBool)(of_field && (!strncmp(field, "u_", 2) || !strncmp(field, "sigma_", 6)));
  Output o = {.kind = SUM, .of = COMPONENT, .width = 1, .weight = -1};

  PetscFunctionBegin;
  o.first = e->n_rows;
  /* Extremes and nonlinear means need each item; a linear mean is one affine value. */
  if (kind < HYCO_QUANTITY_MEAN || (kind == HYCO_QUANTITY_MEAN && !linear)) {
    if (!linear) o.of = !strcmp(field, "u") ? NORM : !strcmp(field, "mises") ? MISES : PRINCIPAL + field[10] - '1';
    o.kind = kind == HYCO_QUANTITY_MAX ? LARGEST : kind == HYCO_QUANTITY_MIN ? SMALLEST : SUM;
    if (o.kind == SUM) o.weight = e->out.n_weights;
    PetscCall(AddItems(e, k, &o));
    for (PetscInt i = o.first; i < e->n_rows; i++) e->row[i].group = e->out.m.n_outputs;
  } else if (kind == HYCO_QUANTITY_FRICTION && q->field == HYCO_FRICTION_WORK) {
    PetscCall(AddWork(e, q, &o));
  } else if (kind >= HYCO_QUANTITY_AREA) {
    o.kind = kind == HYCO_QUANTITY_AREA ? CLOSED : kind == HYCO_QUANTITY_PRESSURE ? PRESSURE : PRESSURE_SMALLEST;
    PetscCall(AddContacts(e, q, &o));
  } else if (e->travel && (kind == HYCO_QUANTITY_FORCE || kind == HYCO_QUANTITY_MOMENT)) {
    PetscCall(AddForces(e, q, &o));
  } else {
    const PetscBool *pushed = e->travel ? HycoROMGetPushed(e->m, k) : NULL;

    o.n = 1;
    ADD_ROW(e, (Row){.from = QUANTITY, .index = k, .group = e->out.m.n_outputs});
    if (pushed) PetscCall(AddPush(e, pushed, q->field, &o));
  }
  PetscCall(AddOutput(&e->out, o, q->name, q->unit));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The outputs of the scene, then CONTACT.force_x, ..., CONTACT.area, CONTACT.pressure_max of each contact. */
static PetscErrorCode FindOutputs(Export *e)
{
  const HycoScene s = e->s;
  HycoQuantity q = {0};
  char name[HYCO_LINE], unit[HYCO_LINE];

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(e->m->pairs.n + 1, &e->area));
  for (PetscInt i = 0; i < e->out.m.n_points * e->out.m.n_strain; i++)
    ADD_ROW(e, (Row){.from = STRAIN, .index = i, .group = -2});
  e->out.m.areas = (int)e->n_rows;
  for (PetscInt i = 0, k = 0; i < e->k && !e->travel; i++) {
    while (k + 1 < e->m->pairs.n && (e->first ? e->first[k + 1] : k + 1) <= e->contact[i]) k++;
    ADD_ROW(e, (Row){.from = AREA, .index = k, .group = -1});
  }
  for (PetscInt k = 0; k < s->n_quantities; k++) PetscCall(AddQuantity(e, k));
  for (PetscInt c = 0; c < s->n_contacts; c++) {
    for (PetscInt a = 0; a < e->m->model->mesh->dim; a++) {
      Output o = {.kind = SUM, .of = COMPONENT, .n = 1, .width = 1, .first = e->n_rows, .weight = -1};

      q = (HycoQuantity){
          .kind = HYCO_QUANTITY_FORCE, .field = a, .contact = (char *)s->contact[c]->name}; /* borrowed */
      if (e->travel)
        PetscCall(AddForces(e, &q, &o));
      else
        ADD_ROW(e, (Row){.from = FORCE, .index = c, .axis = a, .group = e->out.m.n_outputs});
      HycoFormat(name, "%s.force_%c", s->contact[c]->name, "xyz"[a]);
      HycoQuantityUnit(s, &q, unit);
      PetscCall(AddOutput(&e->out, o, name, unit));
    }
    for (PetscInt a = 0; a < 2; a++) {
      Output o = {.kind = a ? PRESSURE : CLOSED, .weight = -1};

      q.kind = a ? HYCO_QUANTITY_PRESSURE : HYCO_QUANTITY_AREA;
      PetscCall(AddContacts(e, &q, &o));
      HycoFormat(name, "%s.%s", s->contact[c]->name, a ? "pressure_max" : "area");
      HycoQuantityUnit(s, &q, unit);
      PetscCall(AddOutput(&e->out, o, name, unit));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the problem -- */

/* The rows of contacts with friction, and their blocks: those that a force along the normal moves, moves[] by row,
   without tangents that nothing moves. */
static PetscErrorCode FindBlocks(Export *e, const PetscReal moves[])
{
  const HycoPairs *pairs = &e->m->model->pairs;
  HycoExportModel *o = &e->out;
  PetscInt at = 0;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(pairs->n + 1, &e->first));
  PetscCall(PetscCalloc1(pairs->n + 1, &o->m.row));
  PetscCall(PetscMalloc1(pairs->n + 1, &o->m.coefficient));
  PetscCall(PetscMalloc1(e->n + 1, &o->m.normal));
  for (PetscInt k = 0; k < pairs->n; k++) {
    const PetscBool has_friction = (PetscBool)(e->s->contact[pairs->contact[k]]->friction != NULL);
    const PetscInt rows = has_friction ? e->m->model->mesh->dim : 1;
    PetscReal most = 0;

    e->first[k] = at;
    for (PetscInt r = at; r < at + rows && moves[at] > 0; r++) most = PetscMax(most, moves[r]);
    for (PetscInt r = at; r < at + rows && moves[at] > 0; r++) {
      if (r > at && moves[r] <= HELD_ROW * most) continue;
      o->m.normal[e->k] = r == at;
      e->contact[e->k++] = r;
    }
    if (moves[at] > 0)
      o->m.coefficient[o->m.n_slip++] = has_friction ? (int)k : -1; /* a row's number once there are rows */
    if (moves[at] > 0) o->m.row[o->m.n_slip] = (int)e->k;
    at += rows;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of a path: the largest forces of the listed times, as the last one may be without loads; displacements of their
   size. */
static void ScalePath(Export *e, const PetscReal flexibility[])
{
  PetscReal most = 0, flexible = 0;

  for (PetscInt i = 0; i < e->m->trace.n_listed * e->m->model->pairs.n; i++)
    most = PetscMax(most, e->m->trace.Lambda[i]);
  for (PetscInt i = 0; i < e->n; i++) flexible = PetscMax(flexible, flexibility[i]);
  e->unit[1] = most > 0 ? most : 1;
  e->unit[0] = flexible > 0 ? e->unit[1] * flexible : 1;
}

/* The contacts with a row of B, and the sizes of z. */
static PetscErrorCode FindProblem(Export *e, const PetscReal mu[])
{
  HycoROM m = e->m;
  PetscReal *M, *flexibility, *moves, size;
  PetscInt *all;
  size_t n;

  PetscFunctionBegin;
  PetscUseTypeMethod(m, unknowns, &e->p, &e->n, NULL);
  if (e->travel) e->n = e->travel->bodies->bodies->ns;
  n = (size_t)(e->p + e->n);
  PetscCall(PetscCalloc3(e->p + e->n + e->l + 1, &e->z, n + 1, &e->w, e->n + 1, &e->contact));
  if (e->travel)
    HycoTravelUnknowns(e->travel, e->z);
  else
    PetscUseTypeMethod(m, unknowns, &e->p, &e->n, e->z);
  /* Sizes of motions and forces at the solution, by which probing stays above round-off. */
  e->unit[0] = e->unit[1] = 0;
  for (PetscInt i = 0; i < e->p + e->n; i++) e->unit[i >= e->p] = PetscMax(e->unit[i >= e->p], PetscAbsReal(e->z[i]));
  for (PetscInt i = 0; i < 3; i++) e->unit[i] = e->unit[i] > 0 ? e->unit[i] : 1;
  for (PetscInt i = 0; e->travel && i < e->n; i++) e->contact[e->k++] = i;
  if (e->travel) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc4(n * n + 1, &M, e->n + 1, &all, e->n + 1, &flexibility, e->n + 1, &moves));
  PetscUseTypeMethod(m, residual, mu, e->z, e->w, &size);
  for (PetscInt i = 0; i < e->n; i++) all[i] = i;
  PetscUseTypeMethod(m, jacobian, e->n, all, M);
  for (PetscInt i = 0; i < e->n; i++) {
    flexibility[i] = moves[i] = M[(size_t)(e->p + i) * (n + 1)];
    /* Where a body is pinned it has no flexibility of its own, but moves. */
    for (size_t j = 0; j < (size_t)e->p; j++)
      moves[i] = PetscMax(moves[i], PetscAbsReal(M[j * n + (size_t)(e->p + i)]));
  }
  /* A contact that nothing moves never touches: its slave faces nothing. */
  for (PetscInt i = 0; i < e->n && !HycoSceneHasFriction(e->s); i++) {
    if (moves[i] > 0) e->contact[e->k++] = i;
  }
  if (HycoSceneHasFriction(e->s)) PetscCall(FindBlocks(e, moves));
  if (e->s->n_times) ScalePath(e, flexibility);
  PetscCall(PetscFree4(M, all, flexibility, moves));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- functions of the parameters -- */

/* Some forces and motions without regularity; all forces press. */
static void ExportIrregular(PetscInt n, PetscInt which, PetscReal z[])
{
  const PetscReal step = which ? 0.75487766624669276 : 0.61803398874989485;

  for (PetscInt i = 0; i < n; i++) z[i] = 0.1 + (i + 1) * step - floor((i + 1) * step);
}

/* n points over the ranges, the last variables of a path (time, tables) each for itself. The caller frees mu. */
static PetscErrorCode ExportScatter(const Export *e, PetscInt n, PetscReal **mu)
{
  const PetscInt n_par = e->s->n_parameters, n_var = e->s->n_variables;
  HycoSamples samples;
  const PetscReal *at;

  PetscFunctionBegin;
  PetscCall(HycoSamplesCreate(e->s, &samples));
  PetscCall(HycoSamplesAddScattered(samples, n));
  PetscCall(HycoSamplesGet(samples, NULL, NULL, &at));
  PetscCall(PetscMalloc1(n * n_var, mu));
  for (PetscInt k = 0; k < n * n_var; k++) {
    const PetscInt i = k / n_var, p = k % n_var;
    const PetscReal share = (PetscReal)(i + 1) * PetscSqrtReal((PetscReal)(2 + 3 * p));

    (*mu)[k] = p < n_par ? at[i * n_par + p] : HycoVariableAt(e->s, p, share - PetscFloorReal(share));
  }
  PetscCall(HycoSamplesDestroy(&samples));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Samples for a fit: y at z = 0, and what two z add; fixed: a parameter that stays in the middle of its range; -1:
   none. */
typedef struct {
  PetscInt n;
  PetscReal *mu, *y, *added; /* n x ny; n x 2 ny */
} Samples;

static PetscErrorCode ExportSample(Export *e, PetscInt n, PetscInt fixed, Samples *o)
{
  const PetscInt n_par = e->s->n_variables;
  PetscReal *z;
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  o->n = n;
  PetscCall(ExportScatter(e, n, &o->mu));
  for (PetscInt i = 0; fixed >= 0 && i < n; i++) o->mu[i * n_par + fixed] = (e->s->lo[fixed] + e->s->hi[fixed]) / 2;
  PetscCall(PetscMalloc1((size_t)n * (size_t)e->ny + 1, &o->y));
  PetscCall(PetscMalloc1(2 * (size_t)n * (size_t)e->ny + 1, &o->added));
  PetscCall(PetscMalloc1(e->p + e->k + e->l + 1, &z));
  for (PetscInt i = 0; i < n && !ierr; i++) {
    PetscReal *y = o->y + (size_t)i * (size_t)e->ny, *added = o->added + 2 * (size_t)i * (size_t)e->ny;

    ierr = ExportProbe(e, o->mu + i * n_par, NULL, y);
    for (PetscInt j = 0; j < 2 && !ierr; j++) {
      ExportIrregular(e->p + e->k + e->l, j, z);
      ierr = ExportProbe(e, o->mu + i * n_par, z, added + j * e->ny);
      /* y is affine in z: the difference is M z, and T z of the values. */
      for (PetscInt r = 0; r < e->ny; r++) added[j * e->ny + r] -= y[r];
      /* The flexibility of places is in blocks, times values. */
      if (e->travel) ierr = PetscArrayzero(added + j * e->ny + e->p, e->k);
    }
  }
  PetscCall(PetscFree(z));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The scale of each group: its largest value in the samples, without forces or by them. */
static void ExportScale(const Export *e, const Samples *o, PetscReal scale[])
{
  for (PetscInt g = 0; g < e->n_groups; g++) scale[g] = 0;
  for (PetscInt i = 0; i < o->n; i++) {
    const PetscReal *y = o->y + (size_t)i * (size_t)e->ny, *added = o->added + 2 * (size_t)i * (size_t)e->ny;

    for (PetscInt r = 0; r < e->ny; r++)
      scale[e->group[r]] = PetscMax(scale[e->group[r]], PetscMax(PetscAbsReal(y[r]), PetscAbsReal(added[r])));
  }
}

/* Adds the functions and coefficients of some rows to fit, whose coefficients are those of all n_rows; the functions of
   other rows have the coefficient 0. */
static PetscErrorCode ExportJoin(const HycoExportFit *part, PetscInt n, const PetscInt row[], PetscInt n_rows,
                                 HycoExportFit *fit)
{
  const size_t all = (size_t)n_rows;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < part->n; k++) {
    PetscInt at = 0;

    while (at < fit->n && memcmp(&fit->function[at], &part->function[k], sizeof(*part->function)) != 0) at++;
    if (at == fit->n) {
      HYCO_ADD(at, fit->function, part->function[k]);
      HYCO_ADD(at, fit->size, part->size[k]);
      PetscCall(PetscRealloc((size_t)++fit->n * all * sizeof(PetscReal), &fit->coefficient));
      PetscCall(PetscArrayzero(fit->coefficient + (size_t)at * all, all));
    }
    for (PetscInt r = 0; r < n; r++)
      fit->coefficient[(size_t)at * all + (size_t)row[r]] = part->coefficient[(size_t)k * (size_t)n + (size_t)r];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The functions of `from` that some rows have, of the group's response, or of the flexibility of the body to whose
   places they belong: the rows without forces have products of them. */
static PetscErrorCode FindSeeds(Export *e, PetscInt first, const HycoExportFit *from, PetscInt *n, HycoFunction seed[])
{
  const PetscInt from_rows = from == &e->response ? 2 * e->ny : e->ny, g = e->group[first],
                 places = e->n_groups - (e->travel ? e->travel->bodies->bodies->n : 0);

  PetscFunctionBegin;
  *n = 0;
  for (PetscInt k = 0; k < from->n; k++) {
    PetscBool has = PETSC_FALSE;

    for (PetscInt r = 0; r < e->ny && !has; r++) {
      const PetscInt at = r - e->p - e->k - e->travel_row;
      const PetscBool of = (PetscBool)(g < places ? e->group[r] == g
                                                  : at >= 0 && e->travel->value[at].from == FLEXIBLE &&
                                                        e->travel->value[at].index == g - places);

      has = (PetscBool)(of && from->coefficient[(size_t)k * (size_t)from_rows + (size_t)r] != 0);
    }
    if (has) seed[(*n)++] = from->function[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Functions of the first level that suffices for data's rows, up to the last one; else the nearest ones. */
static PetscErrorCode FitRows(Export *e, PetscInt last, const HycoFitData *data, HycoExportFit *fit)
{
  const HycoExportFit *from =
      e->group[data->row[0]] < e->n_groups - (e->travel ? e->travel->bodies->bodies->n : 0) ? &e->response : fit;
  HycoFunction *seed;
  PetscInt n_seeds = 0;
  HycoExportFit part = {.worst = PETSC_MAX_REAL}, trial = {0}, kept; /* the best so far; the last one */

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(PetscMax(from->n, 1), &seed));
  if (e->n_weights > SEVERAL) last = PetscMin(last, 1);
  if (e->travel && fit == &e->base) PetscCall(FindSeeds(e, data->row[0], from, &n_seeds, seed));
  for (PetscInt together = 0; together < 2; together++) {
    for (PetscInt level = n_seeds ? -1 - e->atoms.n : 0; level <= last && part.worst > FIT_TOLERANCE; level++) {
      PetscCall(HycoFitFunctions(&e->atoms, level, (PetscBool)together, n_seeds, seed, FIT_TOLERANCE, data, &trial));
      if (trial.worst > part.worst) continue;
      kept = part;
      part = trial;
      trial = kept;
    }
  }
  PetscCall(HycoExportFitFree(&trial));
  PetscCall(PetscFree(seed));
  PetscCall(ExportJoin(&part, data->n_rows, data->row, data->stride, fit));
  if (part.worst > fit->worst || !fit->worst) {
    fit->worst = part.worst;
    fit->worst_row = part.worst_row;
  }
  PetscCall(HycoExportFitFree(&part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of all rows at once, or where surfaces move of each group, whose values have few functions of the many. */
static PetscErrorCode ExportFit(Export *e, PetscInt last, HycoFitData data, HycoExportFit *fit)
{
  PetscInt *row;

  PetscFunctionBegin;
  PetscCall(HycoExportFitFree(fit));
  PetscCall(PetscMalloc1(data.stride + 1, &row));
  data.row = row;
  for (PetscInt g = 0; g < (e->travel ? e->n_groups : 1) && fit->worst <= FIT_TOLERANCE; g++) {
    data.n_rows = 0;
    for (PetscInt r = 0; r < data.stride; r++) {
      if (!e->travel || data.group[r] == g) row[data.n_rows++] = r;
    }
    if (data.n_rows && (!e->travel || data.scale[g] > 0)) PetscCall(FitRows(e, last, &data, fit));
  }
  PetscCall(PetscFree(row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Both fits; that of the response needs products only where bodies turn. times: as many points. */
static PetscErrorCode FitBoth(Export *e, PetscInt fixed, PetscInt times)
{
  Samples o;
  PetscReal *scale, *value;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(e->n_groups, &scale));
  PetscCall(ExportSample(e, times * PetscMax(SAMPLES, EACH * e->n_weights), fixed, &o));
  PetscCall(PetscMalloc1((size_t)o.n * (size_t)e->atoms.n + 1, &value));
  PetscCall(HycoAtomsTabulate(e->s, &e->atoms, o.n, o.mu, value));
  ExportScale(e, &o, scale);
  PetscCall(ExportFit(e, e->travel ? HYCO_FIT_LEVELS - 2 : 1,
                      (HycoFitData){o.n, e->atoms.n, 2 * e->ny, 0, value, o.added, NULL, e->group, scale},
                      &e->response));
  /* If the response has no functions the export is refused anyway: the costly levels are left out. */
  PetscCall(ExportFit(e, e->response.worst > FIT_TOLERANCE ? 0 : HYCO_FIT_LEVELS - 1,
                      (HycoFitData){o.n, e->atoms.n, e->ny, 0, value, o.y, NULL, e->group, scale}, &e->base));
  HycoFreeAll(&o.y, &o.added, &o.mu, &scale, &value);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The line of a refusal: what has no such functions, and the parameters without which it would. */
static PetscErrorCode ExportRefuse(Export *e)
{
  const PetscBool response = (PetscBool)(e->response.worst > FIT_TOLERANCE);
  const PetscInt row = (response ? e->response.worst_row : e->base.worst_row) % e->ny, at = row - e->p - e->k;
  char of[HYCO_LINE], list[HYCO_LINE] = "";

  PetscFunctionBegin;
  if (at < 0)
    HycoFormat(of, "%s", row < e->p ? "the loads on bodies that contact alone holds" : "the gaps");
  else if (e->row[at].from == TRAVEL)
    HycoFormat(of, "the stiffness or the turn of a body");
  else if (e->row[at].group < 0)
    HycoFormat(of,
               e->row[at].from == STRAIN ? "the strain of a body that flows" : "an area or a coefficient of friction");
  else
    HycoFormat(of, "the output %s", e->out.name[e->row[at].group]);
  for (PetscInt p = 0; p < e->s->n_parameters && !e->travel; p++) { /* there it takes long */
    /* With parameter p fixed: if the fits are exact then, p is what has no such functions. */
    PetscCall(FitBoth(e, p, 1));
    if (e->base.worst <= FIT_TOLERANCE && e->response.worst <= FIT_TOLERANCE)
      PetscCall(HycoListAdd(list, " and ", e->s->parameter[p]));
  }
  if (response && at < 0)
    HycoFail(
        "export: the directions of contacts or the stiffness change with %s otherwise than by factors of moduli and "
        "samples of bodies; contacts that turn with a stated normal or a shape cannot be exported",
        list[0] ? list : "several parameters");
  HycoFail("export: %s change%s with %s otherwise than by sums of products of the scene's expressions and weights of "
           "samples, as stresses in a body do whose shape changes",
           of, row == e->p + e->k || at >= 0 ? "s" : "", list[0] ? list : "several parameters");
}

/* -- the arrays -- */

/* An atom in the program, which has its expression then. */
static PetscErrorCode ExportAtom(Export *e, HycoAtom *a, int *place)
{
  Model *o = &e->out.m;
  HycoCode *code = &e->out.code;

  PetscFunctionBegin;
  if (!a->place) {
    HYCO_ADD(o->n_atoms, o->atom, (int)code->n);
    a->place = ++o->n_atoms;
    PetscCall(PetscRealloc((size_t)(code->n + a->n) * sizeof(*code->text), &code->text));
    PetscCall(PetscArraycpy(code->text + code->n, e->atoms.code.text + a->code, a->n));
    code->n += a->n;
  }
  *place = (int)a->place - 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The functions of both fits, each once; place[n]: where those of a fit are. */
static PetscErrorCode ExportMerge(Export *e, const HycoExportFit *fit, PetscInt place[])
{
  Model *o = &e->out.m;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < fit->n; k++) {
    HycoFunction f = fit->function[k];
    PetscInt at = 0;

    for (PetscInt j = 0; j < 4; j++) {
      if (f.of[j] >= 0) PetscCall(ExportAtom(e, &e->atoms.atom[f.of[j]], &f.of[j]));
    }
    while (at < o->n_functions && memcmp(o->function + 4 * at, f.of, sizeof(f.of)) != 0) at++;
    if (at == o->n_functions) {
      PetscCall(PetscRealloc(4 * (size_t)(at + 1) * sizeof(*o->function), &o->function));
      memcpy(o->function + 4 * o->n_functions++, f.of, sizeof(f.of));
    }
    place[k] = at;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two steps X = X (2 - M X) of a pseudo-inverse X, which has lost the digits of M's condition: functions of different
   outputs may depend nearly on each other. */
static PetscErrorCode RefineInverse(size_t n, const PetscReal M[], PetscReal X[])
{
  PetscReal *MX, *old;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(n * n, &MX, n * n, &old));
  for (PetscInt step = 0; step < 2; step++) {
    PetscCall(PetscArraycpy(old, X, n * n));
    for (size_t k = 0; k < n * n; k++) {
      MX[k] = k / n == k % n ? 2 : 0;
      for (size_t j = 0; j < n; j++) MX[k] -= M[k / n * n + j] * old[j * n + k % n];
    }
    for (size_t k = 0; k < n * n; k++) {
      X[k] = 0;
      for (size_t j = 0; j < n; j++) X[k] += old[k / n * n + j] * MX[j * n + k % n];
    }
  }
  PetscCall(PetscFree2(MX, old));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points at which the functions of the response are independent (n x n_par), and the inverse of their values there. */
static PetscErrorCode ChoosePoints(Export *e, PetscReal point[], PetscReal inverse[])
{
  const PetscInt n = e->response.n, N = 4 * n + 16, n_par = e->s->n_variables;
  PetscReal *mu, *value, *chosen, *scale;
  PetscInt *pivot;

  PetscFunctionBegin;
  PetscCall(ExportScatter(e, N, &mu));
  PetscCall(PetscMalloc4(n * N, &value, n * n, &chosen, n, &scale, N, &pivot));
  PetscCall(PetscArrayzero(scale, n));
  for (PetscInt i = 0; i < N; i++) {
    PetscCall(HycoFunctionsEvaluate(e->s, &e->atoms, n, e->response.function, mu + i * n_par, value + i * n));
    for (PetscInt k = 0; k < n; k++) scale[k] = PetscMax(scale[k], PetscAbsReal(value[i * n + k]));
  }
  for (PetscInt i = 0; i < N * n; i++) value[i] /= scale[i % n];
  /* The points are the columns; the first n pivots are well conditioned. */
  PetscCall(HycoPivotColumns(n, N, value, n, pivot));
  for (PetscInt i = 0; i < n; i++) {
    PetscCall(PetscArraycpy(point + i * n_par, mu + pivot[i] * n_par, n_par));
    PetscCall(HycoFunctionsEvaluate(e->s, &e->atoms, n, e->response.function, point + i * n_par, chosen + i * n));
    for (PetscInt k = 0; k < n; k++) chosen[i * n + k] /= scale[k];
  }
  PetscCall(HycoPseudoInverse(n, n, chosen, 1e-12, inverse)); /* inverse[k * n + i]: of function k at point i */
  PetscCall(RefineInverse((size_t)n, chosen, inverse));
  for (PetscInt k = 0; k < n * n; k++) inverse[k] /= scale[k / n];
  PetscCall(PetscFree4(value, chosen, scale, pivot));
  PetscCall(PetscFree(mu));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds M at a point of the response, share[n] of it for each function, to W and A. */
static PetscErrorCode AddMatrix(Export *e, const PetscReal mu[], const PetscReal share[], PetscReal *M)
{
  HycoExportModel *o = &e->out;
  const size_t p = (size_t)e->p, k = (size_t)e->k, n = p + k, size = k * (k + 1) / 2;
  PetscReal largest;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(e->z, e->p + e->n + e->l));
  if (e->travel) {
    PetscCall(HycoTravelMotions(e->travel, mu, M)); /* k x p */
  } else {
    /* z = 0; sets the parameters for the jacobian. */
    PetscUseTypeMethod(e->m, residual, mu, e->z, e->w, &largest);
    PetscUseTypeMethod(e->m, jacobian, e->k, e->contact, M);
  }
  for (PetscInt f = 0; f < e->response.n; f++) {
    for (size_t i = 0; i < k; i++) {
      for (size_t j = 0; j < p && e->travel; j++) o->m.A[((size_t)f * p + j) * k + i] += share[f] * M[i * p + j];
      if (e->travel) continue;
      for (size_t j = 0; j <= i; j++)
        o->m.W[(size_t)f * size + i * (i + 1) / 2 + j] += share[f] * M[(p + i) * n + p + j];
      for (size_t j = 0; j < p; j++) o->m.A[((size_t)f * p + j) * k + i] += share[f] * M[(p + i) * n + j];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same of the values, by units of all z, one after the other, and P. T: functions x rows x (p + k + l). */
static PetscErrorCode AddValues(Export *e, const PetscReal mu[], const PetscReal share[], PetscReal T[])
{
  const PetscInt n = e->p + e->k, all = n + e->l;
  PetscReal *z, *y, *y0;

  PetscFunctionBegin;
  PetscCall(PetscCalloc3(all + 1, &z, e->ny, &y, e->ny, &y0));
  /* Results count friction where there is a normal force alone. */
  for (PetscInt c = 0; e->first && c < e->k; c++) z[e->p + c] = e->out.m.normal[c];
  PetscCall(ExportProbe(e, mu, z, y0));
  /* n probes at each point of the response: the values need no Jacobian of their own. */
  for (PetscInt c = 0; c < all && e->n_rows; c++) {
    z[c] += 1;
    PetscCall(ExportProbe(e, mu, z, y));
    z[c] -= 1;
    for (PetscInt r = 0; r < e->n_rows; r++) {
      const PetscReal change = (y[n + r] - y0[n + r]) / UnitOf(e, c);

      for (PetscInt f = 0; f < e->response.n; f++)
        T[((size_t)f * (size_t)e->n_rows + (size_t)r) * (size_t)all + (size_t)c] += share[f] * change;
    }
    for (PetscInt i = 0; c >= n && i < e->response.n * e->k; i++)
      e->out.m.P[(i / e->k * e->l + c - n) * e->k + i % e->k] +=
          share[i / e->k] * (y0[e->p + i % e->k] - y[e->p + i % e->k]) / UnitOf(e, c);
  }
  PetscCall(PetscFree3(z, y, y0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Coefficients of gaps and of values without forces that are round-off beside the others of their group are 0, so
   that nothing presses where there are no loads. */
static PetscErrorCode DropRounding(Export *e)
{
  PetscReal *most;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(e->n_groups, &most));
  for (PetscInt pass = 0; pass < 2; pass++) {
    for (PetscInt i = 0; i < e->ny * e->base.n; i++) {
      const PetscReal size = PetscAbsReal(e->base.coefficient[i]) * e->base.size[i / e->ny];
      PetscReal *of = &most[e->group[i % e->ny]];

      if (!pass) *of = PetscMax(*of, size);
      if (pass && size <= COEFFICIENT_ROUND_OFF * *of) e->base.coefficient[i] = 0;
    }
  }
  PetscCall(PetscFree(most));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of T that are more than round-off beside the others of their value, as terms: T is sparse in (value,
   function). By unknown, as most have no force and are passed over. */
static PetscErrorCode KeepTerms(Export *e, const PetscInt place[], const PetscReal T[])
{
  Model *o = &e->out.m;
  const size_t n = (size_t)(e->p + e->k + e->l);
  const PetscInt n_f = e->response.n;
  PetscReal *size;
  size_t *from = NULL;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n_f + 1, &size));
  for (PetscInt r = 0; r < e->n_rows; r++) {
    PetscReal most = 0;

    for (PetscInt f = 0; f < n_f; f++) {
      size[f] = 0;
      for (size_t c = 0; c < n; c++)
        size[f] = PetscMax(size[f], e->response.size[f] * UnitOf(e, (PetscInt)c) *
                                        PetscAbsReal(T[((size_t)f * (size_t)e->n_rows + (size_t)r) * n + c]));
      most = PetscMax(most, size[f]);
    }
    for (PetscInt f = 0; f < n_f; f++) {
      if (size[f] <= 1e-13 * most) continue;
      HYCO_ADD(o->n_terms, o->value, (int)r);
      HYCO_ADD(o->n_terms, o->factor, (int)place[f]);
      HYCO_ADD(o->n_terms, from, ((size_t)f * (size_t)e->n_rows + (size_t)r) * n);
      o->n_terms++;
    }
  }
  PetscCall(PetscMalloc1((size_t)o->n_terms * n + 1, &o->term));
  for (size_t i = 0; i < n * (size_t)o->n_terms; i++)
    o->term[i] = T[from[i % (size_t)o->n_terms] + i / (size_t)o->n_terms];
  HycoFreeAll(&from, &size);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The tables of a history, and the times at which steps of predictions end. */
static PetscErrorCode TakeTables(const HycoROM m, const HycoScene s, Model *o)
{
  const HycoPath path = s->n_times ? ((HycoBodiesPath)m->work)->path : NULL;
  PetscInt n = 0;

  PetscFunctionBegin;
  o->n_tables = (int)s->n_tables;
  PetscCall(PetscCalloc1(s->n_tables + 1, &o->table));
  for (PetscInt k = 0; k < s->n_tables; k++) {
    for (PetscInt i = 0; i < s->table[k].n; i++) {
      HYCO_ADD(n, o->table_t, s->table[k].t[i]);
      HYCO_ADD(n, o->table_value, s->table[k].value[i]);
      n++;
    }
    o->table[k + 1] = (int)n;
  }
  if (!path || path->substeps || !(path->time_tol > 0)) PetscFunctionReturn(PETSC_SUCCESS);
  o->n_stops = (int)m->model->n_stops;
  HycoDuplicate(m->model->n_stops, m->model->stops, &o->stop);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All arrays of the program from the functions. */
static PetscErrorCode ExportFill(Export *e)
{
  HycoExportModel *o = &e->out;
  const size_t k = (size_t)e->k, n = (size_t)(e->p + e->k), all = n + (size_t)e->l, f = (size_t)e->response.n;
  /* As a real: the product may exceed PetscInt. It bounds the file's size and the memory below. */
  const PetscReal square = e->travel ? 0 : (PetscReal)k * (PetscReal)k / 2;
  const PetscReal numbers = (PetscReal)f * (square + (PetscReal)e->n_rows * (PetscReal)all) + 1 +
                            (e->travel ? HycoTravelNumbers(e->travel) : 0);
  const size_t triangle = e->travel ? 0 : k * (k + 1) / 2, matrix = e->travel ? k * (size_t)e->p : n * n;
  PetscInt *place;
  PetscReal *point, *inverse, *T, *M, *share;

  PetscFunctionBegin;
  HycoCheck(
      numbers <= MOST,
      "export: the program would have %.2g numbers, at most %.2g are written; use fewer contacts or smaller groups "
      "of outputs",
      (double)numbers, (double)MOST);
  PetscCall(PetscMalloc1(e->base.n + e->response.n + 1, &place));
  PetscCall(DropRounding(e));
  PetscCall(ExportMerge(e, &e->base, place));
  PetscCall(ExportMerge(e, &e->response, place + e->base.n));
  PetscCall(PetscCalloc1((size_t)e->ny * (size_t)o->m.n_functions + 1, &o->m.offset));
  for (PetscInt r = 0; r < e->ny; r++) {
    for (PetscInt j = 0; j < e->base.n; j++)
      o->m.offset[(size_t)r * (size_t)o->m.n_functions + (size_t)place[j]] =
          e->base.coefficient[(size_t)j * (size_t)e->ny + (size_t)r];
  }
  o->m.n_parameters = (int)e->s->n_parameters;
  o->m.code = o->code.text;
  PetscCall(TakeTables(e->m, e->s, &o->m));
  o->m.n_motions = e->p;
  o->m.n_places = e->k;
  o->m.n_contacts = e->travel ? e->m->model->pairs.n : e->k;
  if (e->travel) PetscCall(HycoTravelBlocks(e->travel, e->travel_row, o));
  o->m.n_values = e->n_rows;
  o->m.n_stiffness = e->response.n;
  PetscCall(PetscMalloc1(e->response.n + 1, &o->m.stiffness));
  for (PetscInt i = 0; i < e->response.n; i++) o->m.stiffness[i] = (int)place[e->base.n + i];
  PetscCall(PetscCalloc1(f * triangle + 1, &o->m.W));
  PetscCall(PetscCalloc1(f * (size_t)e->p * k + 1, &o->m.A));
  PetscCall(PetscCalloc1(f * (size_t)e->l * k + 1, &o->m.P));
  PetscCall(PetscCalloc5(f * (size_t)e->s->n_variables + 1, &point, f * f + 1, &inverse,
                         f * (size_t)e->n_rows * all + 1, &T, matrix + 1, &M, f + 1, &share));
  PetscCall(ChoosePoints(e, point, inverse));
  for (PetscInt i = 0; i < e->response.n; i++) {
    for (PetscInt j = 0; j < e->response.n; j++) share[j] = inverse[(size_t)j * f + (size_t)i];
    PetscCall(AddMatrix(e, point + i * e->s->n_variables, share, M));
    PetscCall(AddValues(e, point + i * e->s->n_variables, share, T));
  }
  PetscCall(KeepTerms(e, place + e->base.n, T));
  PetscCall(PetscFree5(point, inverse, T, M, share));
  PetscCall(PetscFree(place));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- comparison with the model -- */

/* The model's results in the order of the outputs, as above. *solved: its problem is; *loose: contact leaves a motion
   free. */
static PetscErrorCode RunModel(Export *e, const PetscReal mu[], PetscInt j, PetscReal out[], PetscBool *solved,
                               PetscBool *loose)
{
  const HycoContactResult *result;
  HycoPrediction prediction;
  HycoHistory history = {0};
  const PetscReal *quantity = prediction.quantity;
  PetscInt at = 0, n;

  PetscFunctionBegin;
  if (!j) PetscCall(HycoROMPredict(e->m, e->s->n_parameters, mu));
  PetscCall(HycoROMGetPrediction(e->m, &prediction));
  *solved = (PetscBool)(prediction.reason > 0);
  *loose = prediction.loose;
  if (e->s->n_times) PetscCall(HycoROMGetHistory(e->m, &history));
  if (e->s->n_times) *solved = (PetscBool)(*solved || j + 1 < history.n);
  if (e->s->n_times && !*solved) PetscFunctionReturn(PETSC_SUCCESS);
  if (e->s->n_times) PetscCall(HycoROMSetStep(e->m, j));
  if (e->s->n_times) quantity = history.step[j].quantity;
  for (PetscInt k = 0; k < e->s->n_quantities; k++) out[at++] = quantity[k];
  PetscCall(HycoROMGetContacts(e->m, &n, &result));
  for (PetscInt c = 0; c < n; c++) {
    for (PetscInt a = 0; a < e->m->model->mesh->dim; a++) out[at++] = result[c].force[a];
    out[at++] = result[c].area;
    out[at++] = result[c].pressure;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of the scene's outputs, then of each contact's force, area and pressure. */
static HycoDimension DimensionOf(const Export *e, PetscInt k)
{
  const PetscInt dim = e->m->model->mesh->dim, at = (k - e->s->n_quantities) % (dim + 2);

  if (k < e->s->n_quantities) return HycoQuantityDimension(&e->s->quantity[k]);
  return at < dim ? HYCO_DIMENSION_FORCE : at == dim ? HYCO_DIMENSION_AREA : HYCO_DIMENSION_STRESS;
}

/* The size that errors of output k are relative to: the largest of its dimension, as one that vanishes by symmetry is
   round-off. */
static PetscReal ScaleOf(const Export *e, const PetscReal most[], PetscInt k)
{
  const HycoDimension dimension = DimensionOf(e, k);
  PetscReal scale = most[k];

  for (PetscInt j = 0; j < e->out.m.n_outputs; j++) {
    if (DimensionOf(e, j) == dimension) scale = PetscMax(scale, most[j]);
    if (DimensionOf(e, j) == HYCO_DIMENSION_FORCE && dimension == HYCO_DIMENSION_WORK)
      scale = PetscMax(scale, most[j] * HycoMeshLength(e->m->fe->mesh));
  }
  return scale;
}

/* Sets e->out.difference: of an output relative to its largest value, at points over the ranges, of paths at their
   listed times; fails if it is no round-off. And e->out.seconds, the processor time of the program. */
static PetscErrorCode ExportCompare(Export *e, const Model *model, void *memory)
{
  const PetscInt n = e->out.m.n_outputs, times = PetscMax(e->s->n_times, 1);
  double kkt;
  int its;
  HycoSamples samples;
  const PetscReal *mu;
  PetscReal *mine, *theirs, *most, *worst;
  PetscBool solved = PETSC_TRUE, theirs_solved = PETSC_TRUE, loose = PETSC_FALSE;
  PetscInt points;
  clock_t begin;
  Work o;

  PetscFunctionBegin;
  /* Once for all points: the runtime needs no state between predictions. */
  place(model, memory, &o);
  PetscCall(HycoSamplesCreate(e->s, &samples));
  PetscCall(HycoSamplesAddScattered(samples, e->s->n_times ? PATHS_CHECKED : CHECKED));
  PetscCall(HycoSamplesGet(samples, &points, NULL, &mu));
  PetscCall(PetscCalloc4(n + 1, &mine, n + 1, &theirs, n + 1, &most, n + 1, &worst));
  for (PetscInt i = 0; i < points * times; i++) {
    const PetscReal *at = mu + i / times * e->s->n_parameters;

    if (i % times && !solved) continue; /* a path that has ended */
    PetscCall(RunModel(e, at, i % times, theirs, &theirs_solved, &loose));
    begin = clock();
    if (i % times == 0) PetscCall(PetscArrayzero(e->state, state_size(model)));
    solved = (PetscBool)(advance(model, &o, at, e->s->n_times ? e->s->times[i % times] : 0, e->state, mine, &kkt,
                                 &its) == OK);
    e->out.seconds += (PetscReal)(clock() - begin) / CLOCKS_PER_SEC;
    e->out.checked++;
    HycoCheck(
        solved || !theirs_solved || !loose,
        "export: at a point of the ranges contact leaves a motion of a body free, and a program does not find the "
        "least one; choose ranges in which contact or friction holds all bodies");
    HycoCheck(
        solved == theirs_solved,
        "export: at a point the program's problem has %s solution, unlike the model's; the forces may not be unique",
        solved ? "a" : "no");
    for (PetscInt k = 0; k < n && solved; k++) {
      most[k] = PetscMax(most[k], PetscAbsReal(theirs[k]));
      worst[k] = PetscMax(worst[k], PetscAbsReal(mine[k] - theirs[k]));
    }
  }
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal scale = ScaleOf(e, most, k);

    HycoCheck(worst[k] <= (e->flows ? FLOWS_AGREE : OUTPUTS_AGREE) * scale,
              "export: the output %s of the program differs from the model's by %.1e of the largest value; the forces "
              "may not be unique%s",
              e->out.name[k], (double)(worst[k] / scale),
              e->flows ? ", or the choice of time steps hangs on the last digits" : "");
    if (scale > 0) e->out.difference = PetscMax(e->out.difference, worst[k] / scale);
  }
  PetscCall(PetscFree4(mine, theirs, most, worst));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the exporter -- */

/* The ranges of the variables that a path has beside its parameters: the time, and values of tables. */
static void SetRanges(HycoScene s)
{
  for (PetscInt p = s->n_parameters; p < s->n_variables; p++) {
    const HycoTimeTable *table = p > s->n_parameters ? &s->table[p - s->n_parameters - 1] : NULL;

    s->lo[p] = table ? table->value[0] : s->times[0];
    s->hi[p] = table ? table->value[0] : s->times[s->n_times - 1];
    for (PetscInt k = 0; table && k < table->n; k++) {
      s->lo[p] = PetscMin(s->lo[p], table->value[k]);
      s->hi[p] = PetscMax(s->hi[p], table->value[k]);
    }
  }
}

/* What the stresses lose: of the values that are elastic ones. The unit of alpha: strains of it are of the size of
   those of loads and forces; a support that moves a body as a whole gives none alone. */
static PetscErrorCode ScaleAlpha(Export *e)
{
  PetscReal *mu, *z, *y, *more, size[2] = {0, 0};

  PetscFunctionBegin;
  for (PetscInt i = 0; i < e->n_rows; i++) {
    const Row *r = &e->row[i];

    if (r->from == CELL) PetscCall(HycoFlowsLoseStress(e->flows, i, r->index, r->coefficient, &e->out));
    if (r->from == QUANTITY) PetscCall(HycoFlowsLoseQuantity(e->flows, i, r->index, &e->out));
  }
  PetscCall(ExportScatter(e, 1, &mu));
  PetscCall(PetscCalloc3(e->p + e->k + e->l, &z, e->ny, &y, e->ny, &more));
  PetscCall(ExportProbe(e, mu, z, y));
  for (PetscInt part = 0; part < 2; part++) { /* forces, then alpha */
    for (PetscInt i = e->p; i < e->p + e->k + e->l; i++) z[i] = (i >= e->p + e->k) == part;
    PetscCall(ExportProbe(e, mu, z, more));
    for (PetscInt i = e->p + e->k; i < e->ny; i++) {
      if (e->row[i - e->p - e->k].from != STRAIN) continue;
      size[part] = PetscMax(size[part], PetscAbsReal(more[i] - y[i]));
      size[0] = PetscMax(size[0], PetscAbsReal(y[i]));
    }
  }
  if (size[0] > 0 && size[1] > 0) e->unit[2] = size[0] / size[1];
  PetscCall(PetscFree3(z, y, more));
  PetscCall(PetscFree(mu));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A prediction in the middle of the ranges comes first: the operations need a model that is set up. */
static PetscErrorCode ExportPrepare(Export *e)
{
  const HycoROM m = e->m;
  PetscReal mu[HYCO_MAX_PARAMETERS], x[3 * PLACES];
  PetscInt places; /* the group of the first body's places */

  PetscFunctionBegin;
  HycoCheck(!strcmp(m->model->type, "bodies"),
            "a model of type %s cannot be exported; train one with -hyco_model_type bodies, which says where a scene "
            "prevents it",
            m->model->type);
  SetRanges(e->s);
  for (PetscInt p = 0; p < e->s->n_parameters; p++) mu[p] = (e->s->lo[p] + e->s->hi[p]) / 2;
  PetscCall(HycoROMPredict(m, e->s->n_parameters, mu));
  if (e->s->n_times) HycoSceneSetTime(e->s, mu, e->s->times[e->s->n_times - 1], mu);
  PetscCall(HycoTravelCreate(m, &e->out, &e->travel));
  e->l = e->s->n_times ? ((HycoSubstructures)m->model->data)->inelastic->m : 0;
  PetscCall(FindProblem(e, mu));
  e->out.m.tolerance = e->s->n_times ? HYCO_RESIDUAL : m->solver->rtol;
  if (e->s->n_times)
    e->out.m.least = ((HycoBodiesPath)m->work)->path->smallest * (e->s->times[e->s->n_times - 1] - e->s->times[0]);
  PetscCall(HycoROMMeasureQuantities(m, &(HycoPrediction){0}));
  PetscCall(HycoFlowsCreate(m, &e->out, &e->flows));
  e->out.m.newton_rtol = PetscMin(e->out.m.newton_rtol, HYCO_TIGHT_NEWTON);
  PetscCall(FindOutputs(e));
  e->travel_row = e->n_rows;
  for (PetscInt b = 0; b < e->out.m.n_slip; b++) {
    const PetscInt k = e->out.m.coefficient[b];

    if (k < 0) continue;
    e->out.m.coefficient[b] = (int)e->n_rows;
    ADD_ROW(e, (Row){.from = COEFFICIENT, .index = k, .group = -1});
  }
  for (PetscInt i = 0; e->travel && i < e->travel->n_values; i++) {
    const TravelValue *v = &e->travel->value[i];

    /* All entries of a turn are of one size. */
    ADD_ROW(e, (Row){.from = TRAVEL, .index = i, .group = e->out.m.n_outputs + i - (v->from == TURN ? v->part : 0)});
  }
  for (PetscInt i = 0; i < PLACES; i++) /* nodes without regularity */
    PetscCall(PetscArraycpy(x + 3 * i, m->fe->X + 3 * ((i * 7919 + 13) % m->fe->mesh->n_nodes), 3));
  PetscCall(HycoAtomsFind(e->s, (PetscBool)(e->travel != NULL), PLACES, x, &e->atoms));
  PetscCall(HycoExportWeights(m, &e->n_weights, &e->weight));
  for (PetscInt i = 0; i < e->n_weights; i++) PetscCall(HycoAtomsAddWeight(e->s, e->weight[i], &e->atoms));
  e->ny = e->p + e->k + e->n_rows;
  places = 2 + e->out.m.n_outputs + (e->travel ? e->travel->n_values : 0);
  e->n_groups = places + (e->travel ? e->travel->bodies->bodies->n : 2); /* areas, coefficients of friction; strains */
  PetscCall(PetscMalloc1(2 * e->ny + 1, &e->group));
  for (PetscInt r = 0; r < 2 * e->ny; r++) {
    const PetscInt at = r % e->ny;

    if (at >= e->p + e->k)
      e->group[r] = e->row[at - e->p - e->k].group < 0 ? places - 1 - e->row[at - e->p - e->k].group
                                                       : 2 + e->row[at - e->p - e->k].group;
    else if (at >= e->p && e->travel)
      e->group[r] = places + HycoBodiesAt(e->travel->bodies->bodies, at - e->p);
    else
      e->group[r] = at >= e->p;
  }
  if (e->l) PetscCall(ScaleAlpha(e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nothing is written before the comparison has passed. */
static PetscErrorCode ExportBuild(Export *e)
{
  char *memory;

  PetscFunctionBegin;
  PetscCall(ExportPrepare(e));
  PetscCall(FitBoth(e, -1, 1));
  /* A choice one by one misses functions that are nearly sums of others, as a small angle beside its sine. */
  if (PetscMax(e->base.worst, e->response.worst) > FIT_TOLERANCE &&
      PetscMax(e->base.worst, e->response.worst) < REPAIRABLE)
    PetscCall(FitBoth(e, -1, MORE));
  if (e->base.worst > FIT_TOLERANCE || e->response.worst > FIT_TOLERANCE) PetscCall(ExportRefuse(e));
  PetscCall(ExportFill(e));
  e->out.n_states = (PetscInt)state_size(&e->out.m);
  PetscCall(PetscMalloc1(e->out.n_states, &e->state));
  PetscCall(PetscMalloc1(work_size(&e->out.m) + 1, &memory));
  e->m->trace.rtol = HYCO_TIGHT_NEWTON;
  HycoFinally(ExportCompare(e, &e->out.m, memory), PetscCall(PetscFree(memory)); e->m->trace.rtol = 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The arrays are freed after an error, too; *description is the caller's. */
static PetscErrorCode ExportC(HycoROM m, const char path[], char **description)
{
  Export e = {.m = m, .s = m->model->scene};
  const size_t n = strlen(path);
  PetscErrorCode ierr;
  void *point;

  PetscFunctionBegin;
  HycoCheck(n > 2 && n < PETSC_MAX_PATH_LEN && !strcmp(path + n - 2, ".c"), "-c %s: the file's name must end in .c",
            path);
  PetscCall(HycoExportCheckFiles(path));
  point = HycoPointBegin(); /* C has a decimal point in any locale */
  ierr = ExportBuild(&e);
  if (!ierr) ierr = HycoExportWrite(&e.out, e.s, m->model->path, path, description);
  HycoPointEnd(point);
  PetscCall(HycoExportFitFree(&e.base));
  PetscCall(HycoExportFitFree(&e.response));
  PetscCall(HycoTravelDestroy(&e.travel));
  PetscCall(HycoFlowsDestroy(&e.flows));
  if (e.z) PetscCall(PetscFree3(e.z, e.w, e.contact));
  for (PetscInt i = 0; i < e.n_weights; i++) PetscCall(PetscFree(e.weight[i]));
  HycoFreeAll(&e.first, &e.state, &e.weight, &e.group, &e.atoms.atom, &e.atoms.code.text, &e.row, &e.area);
  PetscCall(HycoExportModelFree(&e.out, e.s));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineExtension(export, HycoExporterRegister("c", ExportC))
