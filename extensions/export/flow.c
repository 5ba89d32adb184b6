/*
  Models whose bodies creep or yield. Strains of the points with laws are values of the program, linear in z, which then
  ends with alpha; stresses of outputs are elastic ones without what the laws' points lose.
*/
#include "flow.h"
#include <hycoflow.h>
#include <hycokinematics.h>
#include <hycoquantities.h>
#include <string.h>

#include "runtime/laws.h"

/* -- points -- */

static HycoFE FEOf(const HycoFlows f, const FlowPoint *p)
{
  return p->output ? f->outputs : f->m->fe;
}

static PetscErrorCode AddPoint(HycoFlows f, PetscBool output, PetscInt cell, PetscInt q)
{
  FlowPoint p = {output, cell, q, NULL, 0};
  const HycoFE fe = FEOf(f, &p);
  PetscReal volume = 0, weight;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(fe->n_sigma * fe->mesh->nv * fe->dim, &p.B));
  for (PetscInt i = 0; i < HycoElementGet(fe->mesh->type)->nq; i++) {
    PetscCall(HycoFEPointRows(fe, cell, i, p.B, &weight));
    volume += weight;
  }
  PetscCall(HycoFEPointRows(fe, cell, q, p.B, &weight));
  p.share = weight / volume;
  HYCO_APPEND(f->n_points, f->point, p);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks the cells of outputs whose stresses count, or whose forces act on supports. */
static PetscErrorCode MarkCells(HycoFlows f, PetscBool marked[])
{
  const HycoFE fe = f->outputs;
  const HycoScene s = f->m->model->scene;

  PetscFunctionBegin;
  PetscCall(HycoQuantitiesMarkStressed(s, fe->mesh, marked));
  for (PetscInt k = 0; k < s->n_quantities; k++) {
    if (s->quantity[k].kind != HYCO_QUANTITY_REACTION || HycoROMFollowsFromBalance(f->m, k)) continue;
    for (PetscInt i = 0; i < fe->mesh->n_cells * fe->mesh->nv * fe->dim; i++) {
      const PetscInt e = i / (fe->mesh->nv * fe->dim);

      if (HycoFESupports(fe, HycoCellUnknown(fe->mesh, e, i % (fe->mesh->nv * fe->dim)))) marked[e] = PETSC_TRUE;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode FindPoints(HycoFlows f, HycoExportModel *out)
{
  const HycoBodiesInelastic in = f->path->bodies.bodies->inelastic;
  const HycoMesh mesh = f->m->fe->mesh;
  const PetscInt nq = HycoElementGet(mesh->type)->nq, cells = f->outputs ? f->outputs->mesh->n_cells : 0;
  PetscBool *chosen, *marked;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(mesh->n_cells * nq, &chosen, cells, &marked));
  HycoDuplicate(in->n_points * f->m->fe->n_sigma * f->n_modes, f->path->T, &out->m.T);
  out->m.n_chosen = (int)in->n_points;
  for (PetscInt i = 0; i < in->n_points; i++) {
    const PetscInt at = f->path->point[i];

    chosen[at] = PETSC_TRUE;
    PetscCall(AddPoint(f, PETSC_FALSE, at / nq, at % nq));
  }
  for (PetscInt at = 0; at < mesh->n_cells * nq; at++) {
    if (HycoInelasticFlows(f->m->fe, at / nq) && !chosen[at]) PetscCall(AddPoint(f, PETSC_FALSE, at / nq, at % nq));
  }
  f->n_settled = f->n_points;
  if (f->outputs) PetscCall(MarkCells(f, marked));
  for (PetscInt at = 0; at < cells * nq; at++) {
    if (marked[at / nq] && HycoInelasticFlows(f->outputs, at / nq))
      PetscCall(AddPoint(f, PETSC_TRUE, at / nq, at % nq));
  }
  PetscCall(PetscFree2(chosen, marked));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- laws -- */

/* *at: the place of an expression of a body, or of a number without one. */
static PetscErrorCode AddCode(HycoScene s, HycoExpr expr, PetscReal value, HycoExportModel *out, int *at, int *alike)
{
  const char *key = expr ? HycoExprKey(expr) : "";
  PetscInt place;
  PetscBool space;
  char number[HYCO_LINE], *text;

  PetscFunctionBegin;
  HycoFormat(number, "%.17g", (double)value);
  PetscCall(HycoExportHeat(s, key, expr ? HycoExportEntry(s, key) : number, &text));
  PetscCall(HycoParse(s, text, NULL, NULL, &out->code, &place, NULL, &space));
  PetscCall(PetscFree(text));
  HycoCheck(place >= 0, "hyco export: %s has names that a program cannot have", key);
  *at = (int)place;
  *alike = *alike && !space;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The points from `first` on that have its body and kind. */
static PetscErrorCode AddFlowing(HycoFlows f, PetscInt first, PetscInt n, HycoExportModel *out)
{
  const HycoScene s = f->m->model->scene;
  const HycoBody *b = &s->body[FEOf(f, &f->point[first])->mesh->cell_body[f->point[first].cell]];
  const HycoDeclared *c = &b->law->constants;
  const int n_rules = (int)(sizeof(rule_of) / sizeof(rule_of[0]));
  Flowing one = {0, (int)first, (int)n, 1};
  int code[SLOTS];

  PetscFunctionBegin;
  while (one.rule < n_rules && b->law->data != (const void *)rule_of[one.rule]) one.rule++;
  HycoCheck(one.rule < n_rules, "hyco export: the law %s of body %s is not one of the library's own",
            ((PetscObject)b->law)->type_name, b->name);
  for (PetscInt j = 0; j < SLOTS; j++) code[j] = -1;
  for (PetscInt j = 0; j < c->n; j++)
    PetscCall(AddCode(s, c->entry[j].expr, c->entry[j].value, out, &code[j], &one.alike));
  if (b->temperature) PetscCall(AddCode(s, b->temperature, 0, out, &code[TEMPERATURE], &one.alike));
  if (b->expansion) PetscCall(AddCode(s, b->expansion, 0, out, &code[EXPANSION], &one.alike));
  if (b->reference) PetscCall(AddCode(s, b->reference, 0, out, &code[REFERENCE], &one.alike));
  for (PetscInt j = 0; j < SLOTS; j++) HYCO_ADD(SLOTS * out->m.n_flowing + j, out->m.constant, code[j]);
  HYCO_APPEND(out->m.n_flowing, out->m.flowing, one);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AddLaws(HycoFlows f, HycoExportModel *out)
{
  PetscFunctionBegin;
  for (PetscInt i = 0, n = 0; i < f->n_points; i += n, n = 0) {
    const FlowPoint *p = &f->point[i];

    while (i + n < f->n_points && p[n].output == p->output && (i + n < out->m.n_chosen) == (i < out->m.n_chosen) &&
           FEOf(f, p)->mesh->cell_body[p[n].cell] == FEOf(f, p)->mesh->cell_body[p->cell])
      n++;
    PetscCall(AddFlowing(f, i, n, out));
  }
  PetscCall(PetscMalloc1(3 * f->n_points + 1, &out->m.point));
  for (PetscInt i = 0; i < f->n_points; i++) {
    const HycoFE fe = FEOf(f, &f->point[i]);

    HycoPointPlace(fe, HycoElementGet(fe->mesh->type), f->point[i].cell, f->point[i].q, out->m.point + 3 * i);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the interface -- */

PetscErrorCode HycoFlowsCreate(HycoROM m, HycoExportModel *out, HycoFlows *flows)
{
  const HycoScene s = m->model->scene;
  PetscBool changed[HYCO_MAX_PARAMETERS];
  HycoBodiesPath path = (HycoBodiesPath)m->work;
  HycoFlows f;

  PetscFunctionBegin;
  if (!s->n_times || !path->bodies.bodies->inelastic->m) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt p = 0; p < s->n_variables; p++) changed[p] = PETSC_TRUE;
  for (PetscInt b = 0; b < s->n_bodies; b++)
    HycoCheck(s->body[b].law->linear || !HycoBodyMoves(&s->body[b], changed),
              "hyco export: body %s creeps or yields, and a parameter moves it or changes its shape", s->body[b].name);
  PetscCall(PetscNew(flows));
  f = *flows;
  f->m = m;
  f->path = path;
  f->outputs = HycoROMGetOutputCells(m);
  f->n_modes = path->bodies.bodies->inelastic->m;
  PetscCall(FindPoints(f, out));
  PetscCall(AddLaws(f, out));
  out->m.n_modes = (int)f->n_modes;
  out->m.n_points = (int)f->n_points;
  out->m.n_settled = (int)f->n_settled;
  out->m.n_strain = (int)m->fe->n_sigma;
  out->m.newton_most = path->path->max_its ? (int)path->path->max_its : 30;
  out->m.newton_rtol = path->path->rtol;
  out->m.most_increment = path->path->bound;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFlowsDestroy(HycoFlows *flows)
{
  PetscFunctionBegin;
  if (!*flows) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt i = 0; i < (*flows)->n_points; i++) PetscCall(PetscFree((*flows)->point[i].B));
  HycoFreeAll(&(*flows)->point, flows);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal HycoFlowsStrain(HycoFlows f, PetscInt row)
{
  const PetscInt ns = f->m->fe->n_sigma;
  const FlowPoint *p = &f->point[row / ns];
  const HycoMesh mesh = FEOf(f, p)->mesh;
  const PetscInt n = mesh->nv * mesh->dim;
  const PetscReal *u = f->path->u, *sigma;
  PetscReal sum = 0;

  if (p->output) HycoROMGetOutputFields(f->m, &u, &sigma);
  for (PetscInt i = 0; i < n; i++) sum += p->B[row % ns * n + i] * u[HycoCellUnknown(mesh, p->cell, i)];
  return sum;
}

static PetscErrorCode AddErrorNorm(HycoFlows f, PetscInt value, PetscInt i, PetscInt c, PetscReal share,
                                   HycoExportModel *out)
{
  Model *o = &out->m;

  PetscFunctionBegin;
  if (share == 0) PetscFunctionReturn(PETSC_SUCCESS);
  HYCO_ADD(o->n_lost, o->lost_value, (int)value);
  HYCO_ADD(o->n_lost, o->lost_at, (int)(i * f->m->fe->n_sigma + c));
  HYCO_APPEND(o->n_lost, o->lost_share, share);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFlowsLoseStress(HycoFlows f, PetscInt value, PetscInt cell, const PetscReal by[6],
                                   HycoExportModel *out)
{
  PetscFunctionBegin;
  for (PetscInt i = f->n_settled; i < f->n_points; i++) {
    for (PetscInt c = 0; c < f->m->fe->n_sigma && f->point[i].cell == cell; c++)
      PetscCall(AddErrorNorm(f, value, i, c, f->point[i].share * by[c], out));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A mean stress, or a reaction: linear in the stresses of cells and in the forces at the nodes. */
PetscErrorCode HycoFlowsLoseQuantity(HycoFlows f, PetscInt value, PetscInt k, HycoExportModel *out)
{
  const HycoFE fe = f->outputs;
  const HycoScene s = f->m->model->scene;
  const HycoQuantityKind kind = s->quantity[k].kind;
  const PetscBool reacts = (PetscBool)(kind == HYCO_QUANTITY_REACTION);
  PetscReal *u, *sigma, *push, *all;

  PetscFunctionBegin;
  if (kind > HYCO_QUANTITY_REACTION || (reacts && HycoROMFollowsFromBalance(f->m, k)))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(
      PetscCalloc4(fe->n_dof, &u, fe->mesh->n_cells * fe->n_sigma, &sigma, fe->n_dof, &push, s->n_quantities, &all));
  for (PetscInt i = f->n_settled; i < f->n_points; i++) {
    const FlowPoint *p = &f->point[i];
    const PetscInt n = fe->mesh->nv * fe->dim;
    PetscReal weight = 0, *B;

    PetscCall(PetscMalloc1(fe->n_sigma * n, &B));
    PetscCall(HycoFEPointRows(fe, p->cell, p->q, B, &weight));
    for (PetscInt c = 0; c < fe->n_sigma; c++) {
      PetscCall(PetscArrayzero(push, fe->n_dof));
      for (PetscInt d = 0; d < n; d++) push[HycoCellUnknown(fe->mesh, p->cell, d)] += weight * B[c * n + d];
      HycoFEPassTied(fe, push);
      for (PetscInt d = 0; d < fe->n_dof; d++) push[d] = HycoFESupports(fe, d) ? push[d] : 0;
      sigma[p->cell * fe->n_sigma + c] = p->share;
      PetscCall(HycoQuantitiesMeasure(PETSC_COMM_SELF, fe, NULL, u, sigma, push, NULL, all));
      PetscCall(AddErrorNorm(f, value, i, c, all[k], out));
      sigma[p->cell * fe->n_sigma + c] = 0;
    }
    PetscCall(PetscFree(B));
  }
  PetscCall(PetscFree4(u, sigma, push, all));
  PetscFunctionReturn(PETSC_SUCCESS);
}
