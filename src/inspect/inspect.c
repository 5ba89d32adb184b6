/* The inspection of a scene: assembles at points of its ranges, as a solve does, and measures. */
#include "inspect.h"
#include <hycobodiestraining.h>
#include <hycoquantities.h>
#include <string.h>

/* Up to this number of parameters all corners of the ranges are assembled, above it only the ends of each. */
#define MOST_CORNERS 4

/* The centre of the ranges, then their corners, or with many parameters the ends of each. The caller frees mu. Extremes
   of a map or a gap are at corners as a rule; 2^p of them are too many for many parameters. */
static PetscErrorCode ListPoints(HycoScene s, PetscInt *n, PetscReal **mu)
{
  const PetscInt p = s->n_parameters;

  PetscFunctionBegin;
  *n = p ? 1 + (p <= MOST_CORNERS ? 1 << p : 2 * p) : 1;
  PetscCall(PetscMalloc1(*n * p + 1, mu));
  for (PetscInt k = 0; k < *n; k++) {
    for (PetscInt j = 0; j < p; j++) {
      PetscReal *v = *mu + k * p + j;
      const PetscBool corner = (PetscBool)(k && (p <= MOST_CORNERS || (k - 1) / 2 == j));
      const PetscInt bit = p <= MOST_CORNERS ? j : 0;

      *v = (s->lo[j] + s->hi[j]) / 2;
      if (corner) *v = ((k - 1) >> bit) & 1 ? s->hi[j] : s->lo[j];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On rank 0, on the whole model, since shapes and gaps need whole surfaces. Where one rank runs, in->whole is the
   model just assembled. */
static PetscErrorCode InspectMeasure(HycoFOM fom, HycoInspection *in, const PetscReal mu[], PetscBool first)
{
  HycoFE fe = in->whole->fe;

  PetscFunctionBegin;
  if (in->whole != fom) PetscCall(HycoFOMAssemble(in->whole, mu));
  HycoInspectCells(in, fe);
  PetscCall(HycoInspectGaps(in, fe, first));
  /* The worst of the points. */
  in->n_without = PetscMax(in->n_without, fom->summary.n_still);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* "radius = 4.02, load = 0, t = 1: ", for the variables v; "" if there are none. */
static PetscErrorCode NamePoint(HycoScene s, const PetscReal v[], char place[HYCO_LINE])
{
  const PetscInt n = s->n_parameters + (s->n_times > 0); /* tables follow from the time */

  PetscFunctionBegin;
  place[0] = '\0';
  for (PetscInt p = 0; p < n; p++) {
    char value[HYCO_LINE];

    HycoFormat(value, "%s%s = %g", p ? "" : "at ", s->parameter[p], (double)v[p]);
    PetscCall(HycoListAdd(place, ", ", value));
  }
  if (n) PetscCall(HycoListAdd(place, "", ": "));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether forces or supports act at the assembled point; with a history also in between, if they change in time. Gaps
   are on rank 0 alone, and are looked at there. Collective. */
static PetscErrorCode FindLoads(HycoFOM f, HycoInspection *in, PetscBool first)
{
  const HycoScene s = f->scene;
  PetscBool changed[HYCO_MAX_PARAMETERS] = {PETSC_FALSE};
  PetscReal size;
  int any;

  PetscFunctionBegin;
  PetscCall(VecNorm(f->F, NORM_INFINITY, &size));
  any = size > 0 || f->fe->lifted || f->fe->temperature;
  for (PetscInt p = s->n_parameters; first && p < s->n_variables; p++) changed[p] = PETSC_TRUE;
  if (first && s->n_times)
    any = any || HycoSceneLoadsChange(s, changed) || HycoSceneSupportsChange(s, f->fe->mesh, changed, PETSC_FALSE);
  HycoAllreduce(&any, 1, MPI_INT, MPI_MAX, HycoComm(f));
  in->loaded = (PetscBool)(in->loaded || any);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Assembles K, F, B and D for the variables v as solve does; its errors are reported with the point. Collective. A
   failure must name the point: the user gave ranges, not values. */
static PetscErrorCode InspectAssemble(HycoFOM f, HycoInspection *in, const PetscReal v[], PetscBool first)
{
  char message[HYCO_LINE], place[HYCO_LINE];
  PetscErrorCode ierr;

  PetscFunctionBegin;
  HycoCatch(HycoFOMAssemble(f, v), ierr, message);
  PetscCall(NamePoint(f->scene, v, place));
  HycoCheck(!ierr, "%s%s", place, message);
  PetscCall(HycoFOMLiftOff(f, message));
  PetscCall(FindLoads(f, in, first));
  in->n_systems++;
  if (message[0] && !in->n_lifted++) PetscCall(PetscSNPrintf(in->lifted, sizeof(in->lifted), "%s%s", place, message));
  HycoOnRoot(HycoComm(f), InspectMeasure(f, in, v, first));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A point of the ranges: with a history at the end and at the begin. Collective. The end first: loads are complete
   there, and the first call also compares the facets. */
static PetscErrorCode InspectPoint(HycoFOM f, HycoInspection *in, const PetscReal mu[], PetscBool first)
{
  HycoScene s = f->scene;
  PetscReal v[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  if (!s->n_times) {
    /* Without a history the parameters are all variables. */
    PetscCall(InspectAssemble(f, in, mu, first));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  HycoSceneSetTime(s, mu, s->times[s->n_times - 1], v);
  PetscCall(InspectAssemble(f, in, v, first));
  HycoSceneSetTime(s, mu, s->times[0], v);
  PetscCall(InspectAssemble(f, in, v, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a motion is that of a rigid body, whose node moves (contact type rigid). Such a motion is free by design, and
   no reason for a warning. */
static PetscBool IsRigidBodys(HycoFOM f, const PetscReal motion[])
{
  HycoMesh m = f->part;
  PetscReal at = 0, most = 0;

  for (PetscInt i = 0; i < HycoFEUnknowns(f->fe); i++) most = PetscMax(most, PetscAbsReal(motion[i]));
  for (PetscInt k = 0; k < f->scene->n_contacts; k++) {
    const HycoContact contact = f->scene->contact[k];
    PetscInt g = 0;

    if (!contact->rigid) continue;
    /* A rigid body is one node in a group of its own, the master. */
    while (strcmp(m->group_name[g], contact->master)) g++; /* it is there: the contacts are set up */
    for (PetscInt c = 0; c < m->dim; c++)
      at = PetscMax(at, PetscAbsReal(motion[m->group_node[m->group_start[g]] * m->dim + c]));
  }
  return (PetscBool)(at > 1e-6 * most);
}

/* Evaluates the outputs of a body at rest: refuses groups and components that solve would refuse. contact is NULL:
   contact quantities are checked but have no value. All outputs are evaluated, though their values at rest say
   nothing. */
static PetscErrorCode CheckOutputs(HycoFOM whole)
{
  HycoFE fe = whole->fe;
  PetscReal *u, *sigma, *reaction, value[HYCO_MAX_QUANTITIES];

  PetscFunctionBegin;
  if (!fe->scene->n_quantities) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc3(fe->n_dof, &u, fe->mesh->n_cells * fe->n_sigma, &sigma, fe->n_dof, &reaction));
  HycoFinally(HycoQuantitiesMeasure(HycoComm(whole), fe, NULL, u, sigma, reaction, NULL, value),
              PetscCall(PetscFree3(u, sigma, reaction)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Motions that the supports leave free: contact prevents them, or -hyco_regularise removes them; others are an error of
   the assembly. in->loose counts those of deformable bodies. */
static PetscErrorCode FindMotions(HycoInspection *in)
{
  HycoFOM f = in->whole;
  HycoMotions free = {0, NULL, NULL, NULL, NULL};

  PetscFunctionBegin;
  PetscCall(PetscStrncpy(in->regularised, f->summary.regularised, sizeof(in->regularised)));
  if (in->regularised[0]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoFEFreeMotions(HycoComm(f), f->fe, &free));
  in->n_motions = free.n;
  PetscCall(PetscCalloc1(free.n, &in->motion));
  for (PetscInt k = 0; k < free.n; k++) {
    PetscCall(PetscStrallocpy(free.name[k], &in->motion[k]));
    in->loose += !IsRigidBodys(f, free.motion + k * HycoFEUnknowns(f->fe));
  }
  PetscCall(HycoMotionsDestroy(&free));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What needs no further assembly, on rank 0. After the centre was assembled, whose positions the lengths and
   motions refer to. */
static PetscErrorCode InspectDescribe(HycoInspection *in)
{
  HycoFOM f = in->whole;
  HycoScene s = f->scene;

  PetscFunctionBegin;
  in->dim = f->part->dim;
  in->length = HycoMeshLength(f->part);
  in->mesh = s->dm ? NULL : s->mesh_path;
  in->cell_type = HycoCellKinds[f->part->type].name;
  in->face_nodes = s->face_nodes;
  PetscCall(HycoInspectBodies(in));
  PetscCall(HycoInspectTies(in));
  PetscCall(HycoInspectVariables(in));
  PetscCall(HycoInspectGroups(in));
  PetscCall(FindMotions(in));
  PetscCall(CheckOutputs(f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* How the parameters enter the bodies, with changes from the point mu; of scenes with contact. With a history only what
   does not depend on time. Collective. */
static PetscErrorCode DescribeBodies(HycoFOM f, const PetscReal mu[], const PetscReal speed[2], HycoInspection *in)
{
  const HycoScene s = f->scene;
  HycoBodyParts parts;
  PetscReal v[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  if (!f->n_contacts || !s->n_parameters) PetscFunctionReturn(PETSC_SUCCESS);
  if (s->n_times) HycoSceneSetTime(s, mu, s->times[0], v); /* as in training */
  PetscCall(HycoBodyPartsFind(f, s->n_times ? v : mu, &parts));
  PetscCall(HycoBodyPartsDescribe(s, &parts, in->bodies));
  PetscCall(HycoInspectBodyCost(f, &parts, mu, speed, in));
  PetscCall(HycoBodyPartsDestroy(&parts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All points, the centre last, where the costs are measured. */
static PetscErrorCode InspectVisit(HycoFOM f, HycoInspection *in)
{
  const PetscInt p = f->scene->n_parameters;
  PetscReal *mu, begin, speed[2];

  PetscFunctionBegin;
  PetscCall(ListPoints(f->scene, &in->n_points, &mu));
  for (PetscInt k = 1; k < in->n_points; k++) PetscCall(InspectPoint(f, in, mu + k * p, (PetscBool)(k == 1)));
  begin = HycoNow();
  PetscCall(InspectPoint(f, in, mu, (PetscBool)(in->n_points == 1)));
  begin = HycoNow() - begin;
  /* The centre's assembly is timed, which is the last: the others have warmed up caches. */
  PetscCall(HycoInspectCost(f, begin, in, speed));
  HycoOnRoot(HycoComm(f), InspectDescribe(in));
  PetscCall(DescribeBodies(f, mu, speed, in));
  PetscCall(PetscFree(mu));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Room for what is found; names are those of the scene. The other ranks have no in->whole; what they allocate here
   stays empty. */
static PetscErrorCode InspectBegin(HycoFOM f, HycoInspection *in)
{
  HycoScene s = f->scene;

  PetscFunctionBegin;
  in->corners = (PetscBool)(s->n_parameters <= MOST_CORNERS);
  in->n_bodies = s->n_bodies;
  in->n_scene_contacts = s->n_contacts;
  in->n_ties = s->n_ties;
  in->n_variables = s->n_variables;
  PetscCall(PetscCalloc4(s->n_bodies, &in->body, s->n_contacts, &in->contact, s->n_ties, &in->tie, s->n_variables,
                         &in->variable));
  if (f->rank) PetscFunctionReturn(PETSC_SUCCESS);
  if (f->size > 1)
    PetscCall(HycoFOMCreate(PETSC_COMM_SELF, s, &in->whole));
  else
    in->whole = f;
  PetscCall(HycoInspectContactsBegin(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Several ranks assemble as they would in a solve; shapes and gaps are measured on rank 0, which has a model of its
   own. */
PetscErrorCode HycoInspect(HycoFOM f, HycoInspection *in)
{
  PetscErrorCode ierr;

  PetscFunctionBegin;
  HycoCheckHandle(f, HYCO_FOM_CLASSID);
  HycoCheckGiven(in);
  PetscCall(PetscMemzero(in, sizeof(*in)));
  HycoOnEach(HycoComm(f), InspectBegin(f, in));
  ierr = InspectVisit(f, in);
  /* HycoInspectionDestroy() releases in->whole in either case. */
  if (in->whole == f) PetscCall(PetscObjectReference((PetscObject)f));
  if (ierr) (void)!HycoInspectionDestroy(in);
  PetscCall(ierr);
  in->n_nodes = f->n_nodes;
  in->n_cells = f->n_cells;
  in->n_free = f->n_free;
  in->n_contacts = f->n_contacts;
  in->n_fixed = f->n_nodes * f->fe->dim - f->n_free;
  in->n_values =
      2. * (PetscReal)f->n_nodes * f->fe->dim + (PetscReal)f->n_cells * f->fe->n_sigma + (PetscReal)f->n_contacts;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Also of one that failed half-way. */
PetscErrorCode HycoInspectionDestroy(HycoInspection *in)
{
  PetscFunctionBegin;
  if (!in) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < in->n_motions; k++) PetscCall(PetscFree(in->motion[k]));
  HycoFreeAll(&in->motion, &in->alike);
  PetscCall(PetscFree3(in->group, in->used, in->empty));
  PetscCall(PetscFree2(in->type, in->cells));
  PetscCall(PetscFree4(in->body, in->contact, in->tie, in->variable));
  PetscCall(HycoFOMDestroy(&in->whole));
  PetscCall(PetscMemzero(in, sizeof(*in)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
