/* HycoFE: the scene on a mesh at one parameter value: nodes moved, supports, materials. */
#include <hycokinematics.h>
#include <hycomaterialimpl.h>
#include <string.h>
#include "assembly_map.h"

#define RUN 64 /* nodes at which a map is evaluated together */

/* NULL-safe. The tables belong to the DM, of which fe has a reference; those of HycoFECreateRead() to the caller. */
PetscErrorCode HycoFEDestroy(HycoFE *fe)
{
  PetscFunctionBegin;
  if (!*fe) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt e = 0; (*fe)->kept_stiffness && e < (*fe)->mesh->n_cells; e++)
    PetscCall(PetscFree((*fe)->kept_stiffness[e]));
  HycoFreeAll(&(*fe)->kept_stiffness, &(*fe)->kept_at, &(*fe)->on_surface);
  PetscCall(PetscFree((*fe)->surface));
  PetscCall(DMDestroy(&(*fe)->dm));
  PetscCall(HycoAssemblyMapDestroy(&(*fe)->places));
  PetscCall(HycoSpringsDestroy(&(*fe)->springs));
  for (PetscInt k = 0; k < (*fe)->n_loads; k++) {
    HycoFreeAll(&(*fe)->shares[k].node, &(*fe)->shares[k].share);
  }
  HycoFreeAll(&(*fe)->shares, &(*fe)->constant, &(*fe)->bbar, &(*fe)->temperature, &(*fe)->thermal, &(*fe)->pin,
              &(*fe)->released, &(*fe)->X, &(*fe)->room, &(*fe)->mirrored, &(*fe)->drawn_sign, &(*fe)->fixed,
              &(*fe)->oblique, &(*fe)->oblique_at, &(*fe)->u0, &(*fe)->kept, &(*fe)->lanes, &(*fe)->kept_mean,
              &(*fe)->weight, &(*fe)->weighed_at, &(*fe)->moved_at, &(*fe)->tangent, &(*fe)->tangent_start,
              &(*fe)->tangent_size, fe);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a mesh, which may be a part, has nodes of a group. */
static PetscBool HasNodes(HycoMesh m, const char group[])
{
  for (PetscInt g = 0; g < m->n_groups; g++) {
    if (strcmp(m->group_name[g], group) == 0) return (PetscBool)(m->group_start[g + 1] > m->group_start[g]);
  }
  return PETSC_TRUE;
}

/* Whether a change of some parameters changes the supports: a value, or, with moved nodes, one that depends on the
   position. */
PetscBool HycoSceneSupportsChange(HycoScene s, HycoMesh on, const PetscBool changed[], PetscBool moved)
{
  for (PetscInt k = 0; k < s->n_fixed; k++) {
    if (on && !HasNodes(on, s->fixed[k].group)) continue;
    for (PetscInt c = 0; c < 7; c++) {
      HycoExpr value = c < 3 ? s->fixed[k].value[c] : c < 6 ? s->fixed[k].direction[c - 3] : s->fixed[k].normal;

      if (HycoExprChanges(value, changed) || (moved && value && HycoExprInSpace(value))) return PETSC_TRUE;
    }
  }
  return PETSC_FALSE;
}

/* Finds the cells and supports that no parameter changes. A cell is constant if its law, its springs and the
   positions of its nodes and of its masters are. The supports are constant unless a value changes, or depends on a
   position that changes. */
static PetscErrorCode FindConstant(HycoFE fe)
{
  HycoMesh m = fe->mesh;
  HycoScene s = fe->scene;
  /* Every parameter is assumed to change: what is constant then is so for all of them. */
  PetscBool every[HYCO_MAX_PARAMETERS], *moves, any = PETSC_FALSE;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < HYCO_MAX_PARAMETERS; p++) every[p] = PETSC_TRUE;
  PetscCall(PetscCalloc1(s->n_bodies, &moves));
  for (PetscInt b = 0; b < s->n_bodies; b++) {
    for (PetscInt c = 0; c < 3; c++) moves[b] = (PetscBool)(moves[b] || HycoExprChanges(s->body[b].map[c], every));
    any = (PetscBool)(any || moves[b]);
  }
  for (PetscInt e = 0; e < m->n_cells; e++) {
    const HycoMaterial law = s->body[m->cell_body[e]].law;

    /* An inelastic law's tangents change from step to step without any parameter. */
    fe->constant[e] = (PetscBool)(law->linear && !HycoMaterialChanges(law, every));
    for (PetscInt a = 0; a < m->nv; a++) {
      if (moves[m->node_body[m->cells[e * m->nv + a]]]) fe->constant[e] = PETSC_FALSE;
    }
    for (PetscInt k = m->ties ? m->follow_start[e] : 0; m->ties && k < m->follow_start[e + 1]; k++) {
      if (moves[m->node_body[m->follow[k]]]) fe->constant[e] = PETSC_FALSE;
    }
  }
  /* Before constant cells are counted. */
  HycoSpringsMarkVarying(fe, every);
  for (PetscInt e = 0; e < m->n_cells; e++) fe->n_constant += fe->constant[e];
  fe->fixed_constant = (PetscBool)!HycoSceneSupportsChange(s, NULL, every, any);
  PetscCall(PetscFree(moves));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Chooses the element of each body. Inelastic flow preserves volume, which makes first-order cells too stiff
   (locking): bbar is used for such bodies unless the scene gives another element, and simplices are refused unless
   the scene allows them. */
static PetscErrorCode ChooseElements(HycoScene scene, HycoMesh mesh, PetscBool bbar[])
{
  /* Cells whose dilatation is neither constant (simplices) nor of second order. */
  const PetscBool has_mean = (PetscBool)(mesh->type == HYCO_QUAD4 || mesh->type == HYCO_HEX8);

  PetscFunctionBegin;
  HycoCheck(mesh->dim == 2 || scene->formulation == HYCO_PLANE_STRAIN,
            "scene_formulation is for 2D scenes, and this mesh has %d dimension%s; remove it", (int)mesh->dim,
            mesh->dim == 1 ? "" : "s");
  for (PetscInt b = 0; b < scene->n_bodies; b++) {
    const HycoBody *body = &scene->body[b];
    const PetscBool flows = (PetscBool)!body->law->linear;

    HycoCheck(!body->bbar || has_mean,
              "body_%s_element is bbar, which is for quad4 and hex8; in this mesh's cells (%s) the dilatation %s",
              body->name, HycoCellKinds[mesh->type].name,
              HycoMeshIsQuadratic(mesh)                 ? "is free enough"
              : scene->formulation == HYCO_AXISYMMETRIC ? "would be too stiff as a mean over the cell, too"
                                                        : "is constant already");
    HycoCheck(!body->bbar || scene->formulation != HYCO_PLANE_STRESS,
              "body_%s_element is bbar, against volumetric locking, which does not occur under plane_stress; remove it",
              body->name);
    HycoCheck(!flows || body->element || has_mean || HycoMeshIsQuadratic(mesh) || mesh->dim == 1,
              "body %s has an inelastic law (%s), which preserves volume, and tri3 or tet4 cells are then much too "
              "stiff; use quad4 or hex8 cells, or write element: standard to use these cells all the same",
              body->name, ((PetscObject)body->law)->type_name);
    bbar[b] = body->element ? body->bbar : (PetscBool)(flows && has_mean);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes a reference to the DM of the tables; the scene must outlive fe. */
static PetscErrorCode FECreate(HycoScene scene, DM dm, HycoMesh mesh, HycoFE *fe)
{
  PetscBool *bbar;
  PetscErrorCode ierr;
  HycoFE f;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(scene->n_bodies, &bbar));
  ierr = ChooseElements(scene, mesh, bbar);
  for (PetscInt b = 0; b < scene->n_bodies && !ierr; b++)
    /* Laws belong to the scene, and are set up by each fe on it: the same dimension and formulation each time. */
    ierr = HycoMaterialSetUp(scene->body[b].law, mesh->dim, scene->formulation, (PetscBool)(scene->n_times > 0));
  if (ierr) PetscCall(PetscFree(bbar));
  PetscCall(ierr);
  PetscCall(PetscNew(&f));
  f->bbar = bbar;
  f->scene = scene;
  PetscCall(PetscObjectReference((PetscObject)dm));
  f->dm = dm;
  f->mesh = mesh;
  f->dim = mesh->dim;
  f->formulation = scene->formulation;
  f->n_dof = mesh->n_nodes * mesh->dim;
  f->n_sigma = HycoStrainSize(mesh->dim);
  PetscCall(PetscMalloc1(3 * mesh->n_nodes, &f->X));
  PetscCall(PetscCalloc1(scene->n_bodies + 1, &f->moved_at));
  for (PetscInt k = 0; k < mesh->n_cells * mesh->nv; k++)
    f->joint = (PetscBool)(f->joint || mesh->node_body[mesh->cells[k]] != mesh->cell_body[k / mesh->nv]);
  PetscCall(PetscCalloc1(f->n_dof, &f->fixed));
  PetscCall(PetscCalloc1(f->n_dof, &f->u0));
  /* The order: FindConstant() needs the springs, which need the tables alone. */
  PetscCall(HycoTangentsCreate(f));
  PetscCall(HycoHeatCreate(f));
  PetscCall(PetscCalloc1(mesh->n_cells, &f->constant));
  f->n_loads = scene->n_loads;
  PetscCall(PetscCalloc1(f->n_loads, &f->shares));
  PetscCall(HycoSpringsCreate(f));
  PetscCall(FindConstant(f));
  PetscCall(HycoMirrorCreate(f));
  *fe = f;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The tables of the DM are made once and kept with it. No parameter is set yet: HycoFESetParameters() follows. */
PetscErrorCode HycoFECreate(HycoScene scene, DM dm, HycoFE *fe)
{
  HycoMesh mesh;

  PetscFunctionBegin;
  PetscCall(HycoMeshOf(dm, scene, &mesh));
  PetscCall(FECreate(scene, dm, mesh, fe));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Without a DM for the search of ties, whose weights the DM's cones need. */
PetscErrorCode HycoFECreateRead(HycoScene scene, HycoMesh mesh, HycoFE *fe)
{
  PetscFunctionBegin;
  PetscCall(FECreate(scene, NULL, mesh, fe));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A copy of the tables' struct with no cells; its arrays are those of the DM's tables, so that only the struct is
   freed. */
PetscErrorCode HycoFECreateSurface(HycoScene scene, DM dm, HycoFE *fe)
{
  struct _n_HycoMesh *surface;
  HycoMesh mesh;

  PetscFunctionBegin;
  PetscCall(HycoMeshOf(dm, scene, &mesh));
  PetscCall(PetscNew(&surface));
  *surface = *mesh;
  /* Surfaces are moved and loaded without integrating a cell. */
  surface->n_cells = 0;
  HycoOnError(FECreate(scene, dm, surface, fe), PetscCall(PetscFree(surface)));
  (*fe)->surface = surface;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A number for each placement of nodes, by which kept gradients are recognised as old: unique in the process, not only
   in fe. */
static PetscInt NewPlace(void)
{
  static PetscInt places = 0;

  return ++places;
}

PetscErrorCode HycoFESetDrawn(HycoFE fe)
{
  PetscFunctionBegin;
  PetscCall(PetscArraycpy(fe->X, fe->mesh->xyz, 3 * fe->mesh->n_nodes));
  fe->place = NewPlace();
  for (PetscInt b = 0; b < fe->scene->n_bodies; b++) fe->moved_at[b] = fe->place;
  fe->drawn = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool HycoBodyMoves(const HycoBody *body, const PetscBool changed[])
{
  return (PetscBool)(HycoExprChanges(body->map[0], changed) || HycoExprChanges(body->map[1], changed) ||
                     HycoExprChanges(body->map[2], changed));
}

/* Whether the map of body b moves a node; at first all, by which HycoMirrorFind() sees how cells turn. */
static PetscBool FEIsTaken(HycoFE fe, PetscBool first, PetscInt b, PetscInt node)
{
  return (PetscBool)(fe->mesh->node_body[node] == b && (first || !fe->on_surface || fe->on_surface[node]));
}

/* X = map(x, mu) of the bodies whose maps change. Maps act on the drawing, not on the last position: the result does
   not depend on what was solved before. first: all bodies; so it is with ties, which place nodes of one by those of
   another. */
static PetscErrorCode MoveNodes(HycoFE fe, PetscBool first, const PetscBool changed[])
{
  HycoMesh m = fe->mesh;

  PetscFunctionBegin;
  if (first || fe->joint || m->ties)
    PetscCall(HycoFESetDrawn(fe));
  else {
    fe->place = NewPlace();
    fe->drawn = 0;
    for (PetscInt b = 0; b < fe->scene->n_bodies; b++) {
      if (HycoBodyMoves(&fe->scene->body[b], changed)) fe->moved_at[b] = fe->place;
    }
    for (PetscInt i = 0; i < m->n_nodes; i++) {
      if (fe->moved_at[m->node_body[i]] == fe->place) PetscCall(PetscArraycpy(fe->X + 3 * i, m->xyz + 3 * i, 3));
    }
  }
  for (PetscInt b = 0; b < fe->scene->n_bodies; b++) {
    for (PetscInt c = 0; c < 3; c++) {
      HycoExpr map = fe->scene->body[b].map[c];

      if (!map || fe->moved_at[b] != fe->place) continue;
      HycoCheck(m->dim > c, "%s: the mesh has %d space dimension%s and no component %c; remove the entry",
                HycoExprKey(map), (int)m->dim, m->dim == 1 ? "" : "s", "xyz"[c]);
      for (PetscInt i = 0, n; i < m->n_nodes; i += PetscMax(n, 1)) {
        PetscReal value[RUN];

        /* Nodes of a body follow each other. A component without a map keeps its drawn coordinate
           (HycoFESetDrawn()). */
        for (n = 0; n < RUN && i + n < m->n_nodes && FEIsTaken(fe, first, b, i + n);) n++;
        if (n) PetscCall(HycoExprEval(map, fe->mu, n, m->xyz + 3 * i, value));
        for (PetscInt k = 0; k < n; k++) fe->X[3 * (i + k) + c] = value[k];
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* In an axisymmetric scene: whether the mesh file has the node on the axis, where its radial displacement is 0. */
PetscBool HycoNodeIsOnAxis(HycoFE fe, PetscInt node)
{
  return (PetscBool)(fe->formulation == HYCO_AXISYMMETRIC &&
                     PetscAbsReal(fe->mesh->xyz[3 * node]) <= 1e-9 * HycoMeshLength(fe->mesh));
}

/* Nodes of second order on the axis: the integral of their function over the surface vanishes with the radius, so
   that they carry no contact. */
PetscBool HycoNodeHasNoArea(HycoFE fe, PetscInt node)
{
  return (PetscBool)(HycoMeshIsQuadratic(fe->mesh) && HycoNodeIsOnAxis(fe, node));
}

/* In an axisymmetric scene: checks that no node crosses the axis, and that those on it stay there. */
static PetscErrorCode CheckAxis(HycoFE fe)
{
  /* Length (m) below which a radius counts as zero. */
  const PetscReal zero = fe->formulation == HYCO_AXISYMMETRIC ? 1e-9 * HycoMeshLength(fe->mesh) : 0;

  PetscFunctionBegin;
  for (PetscInt i = 0; fe->formulation == HYCO_AXISYMMETRIC && i < fe->mesh->n_nodes; i++) {
    const PetscReal r = fe->X[3 * i];

    HycoCheck(r >= -zero, "node %d lies at x = %g; an axisymmetric scene must be drawn at x >= 0",
              (int)fe->mesh->node_id[i], (double)r);
    /* Nodes on the axis have no radial unknown: which nodes these are must not depend on a parameter. */
    HycoCheck((r <= zero) == HycoNodeIsOnAxis(fe, i),
              "the map of body %s moves node %d from x = %g to x = %g; in an axisymmetric scene nodes on the axis x = "
              "0 must stay there, and other nodes must stay off it",
              fe->scene->body[fe->mesh->node_body[i]].name, (int)fe->mesh->node_id[i], (double)fe->mesh->xyz[3 * i],
              (double)r);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets supports along a direction, after all others, in the order of the scene. The order matters: each direction is
   expressed by the displacements that earlier supports leave free. */
static PetscErrorCode SetOblique(HycoFE fe)
{
  HycoMesh m = fe->mesh;

  PetscFunctionBegin;
  HycoObliqueClear(fe);
  for (PetscInt k = 0; k < fe->scene->n_fixed; k++) {
    const HycoFixed *fixed = &fe->scene->fixed[k];
    const PetscBool turns = (PetscBool)(HycoExprInSpace(fixed->direction[0]) || HycoExprInSpace(fixed->direction[1]) ||
                                        HycoExprInSpace(fixed->direction[2]));
    PetscInt g = 0;

    if (!fixed->normal) continue;
    PetscCall(HycoMeshFindGroup(m, "fixed", fixed->group, &g));
    for (PetscInt j = m->group_start[g]; j < m->group_start[g + 1]; j++) {
      const PetscInt i = m->group_node[j];
      const HycoBody *body = &fe->scene->body[m->node_body[i]];
      PetscReal n[3] = {0, 0, 0}, value, size = 0;

      for (PetscInt c = 0; c < 3; c++) {
        if (c < m->dim && fixed->direction[c])
          PetscCall(HycoExprEval(fixed->direction[c], fe->mu, 1, fe->X + 3 * i, &n[c]));
        /* Of the components that the mesh has: an entry for z in 2D was refused with the mesh. */
        size += n[c] * n[c];
      }
      if (HycoMeshTied(m, i) >= 0) {
        PetscCall(HycoTiedCheckOblique(fe, fixed, g, i));
        continue;
      }
      HycoCheck(size > 0, "%s: its direction has length zero at node %d", HycoExprKey(fixed->normal),
                (int)m->node_id[i]);
      HycoCheck(
          !turns || !(body->map[0] || body->map[1] || body->map[2]),
          "%s: its direction depends on the position, and the map of body %s moves node %d; give a constant direction",
          HycoExprKey(fixed->normal), body->name, (int)m->node_id[i]);
      PetscCall(HycoExprEval(fixed->normal, fe->mu, 1, fe->X + 3 * i, &value));
      PetscCall(HycoObliqueAdd(fe, k, i, n, value, HycoExprKey(fixed->normal)));
      /* Without prescribed values the loop over cells for K u0 is left out. */
      fe->lifted = (PetscBool)(fe->lifted || value != 0);
    }
  }
  PetscCall(HycoObliqueIndex(fe));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fixed components and their values, evaluated at the moved nodes. u0: prescribed value at fixed unknowns, 0
   elsewhere. Axis first, then components, oblique directions, ties and pins, which each assume the former. */
static PetscErrorCode SetSupports(HycoFE fe)
{
  HycoMesh m = fe->mesh;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(fe->fixed, fe->n_dof));
  PetscCall(PetscArrayzero(fe->u0, fe->n_dof));
  fe->lifted = PETSC_FALSE;
  for (PetscInt i = 0; i < m->n_nodes; i++) fe->fixed[i * m->dim] = HycoNodeIsOnAxis(fe, i);
  for (PetscInt k = 0; k < fe->scene->n_fixed; k++) {
    HycoFixed *fixed = &fe->scene->fixed[k];
    PetscReal value = 0;
    PetscInt g = 0;

    PetscCall(HycoMeshFindGroup(m, "fixed", fixed->group, &g));
    for (PetscInt c = 0; c < m->dim; c++) {
      for (PetscInt j = m->group_start[g]; fixed->value[c] && j < m->group_start[g + 1]; j++) {
        const PetscInt i = m->group_node[j], dof = i * m->dim + c;
        /* 0 where nothing was set: compared only where the component is fixed already. */
        const PetscReal former = fe->u0[dof];

        if (j == m->group_start[g] || HycoExprInSpace(fixed->value[c]))
          PetscCall(HycoExprEval(fixed->value[c], fe->mu, 1, fe->X + 3 * i, &value));
        HycoCheck(!fe->fixed[dof] ||
                      PetscAbsReal(value - former) <= 1e-12 * (PetscAbsReal(value) + PetscAbsReal(former)),
                  "node %d is fixed twice in %c, to %g and to %g (by %s); remove it from one support",
                  (int)m->node_id[i], "xyz"[c], (double)former, (double)value, HycoExprKey(fixed->value[c]));
        fe->fixed[dof] = PETSC_TRUE;
        fe->u0[dof] = value;
        /* Homogeneous supports need no lifting. */
        fe->lifted = (PetscBool)(fe->lifted || value != 0);
      }
    }
  }
  PetscCall(SetOblique(fe));
  PetscCall(HycoTiedFix(fe));
  for (PetscInt k = 0; k < fe->n_pins; k++) fe->fixed[fe->pin[k]] = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Pins: additional fixed unknowns by node tag and component, which make K regular for a floating body. Nodes of
   other ranks are not in this mesh and are skipped. */
PetscErrorCode HycoFESetPins(HycoFE fe, PetscInt n, const PetscInt tag[], const PetscInt component[])
{
  HycoMesh m = fe->mesh;

  PetscFunctionBegin;
  /* A pin is never on a supported unknown, so that its release frees no support. */
  for (PetscInt k = 0; k < fe->n_pins; k++) fe->fixed[fe->pin[k]] = PETSC_FALSE;
  if (n != fe->n_pins) {
    PetscCall(PetscFree(fe->pin));
    PetscCall(PetscMalloc1(n, &fe->pin));
  }
  fe->n_pins = 0;
  for (PetscInt k = 0; k < n; k++) {
    for (PetscInt i = 0; i < m->n_nodes; i++) {
      if (m->node_id[i] == tag[k]) fe->pin[fe->n_pins++] = i * m->dim + component[k];
    }
  }
  for (PetscInt k = 0; k < fe->n_pins; k++) fe->fixed[fe->pin[k]] = PETSC_TRUE;
  PetscCall(HycoAssemblyMapDestroy(&fe->places)); /* its constant sum depends on the fixed unknowns */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What a change of some parameters requires: nodes, K, rows of B, gaps D. Moved nodes change all of them; a
   contact's entry gap changes D alone. */
HycoChanges HycoSceneChanges(HycoScene s, const PetscBool changed[])
{
  HycoChanges c = {PETSC_FALSE, PETSC_FALSE, PETSC_FALSE, PETSC_FALSE};

  for (PetscInt b = 0; b < s->n_bodies; b++) c.nodes = (PetscBool)(c.nodes || HycoBodyMoves(&s->body[b], changed));
  /* Everything is integrated over, or evaluated at, the moved nodes. */
  c.stiffness = c.rows = c.gaps = c.nodes;
  for (PetscInt b = 0; b < s->n_bodies; b++)
    c.stiffness = (PetscBool)(c.stiffness || HycoMaterialChanges(s->body[b].law, changed));
  for (PetscInt k = 0; k < 4 * s->n_springs; k++)
    c.stiffness = (PetscBool)(c.stiffness || HycoExprChanges(s->spring[k / 4].stiffness[k % 4], changed));
  for (PetscInt k = 0; k < s->n_contacts; k++) {
    c.rows = (PetscBool)(c.rows || HycoDeclaredChanges(&s->contact[k]->entries, "gap", changed));
    c.gaps = (PetscBool)(c.gaps || HycoDeclaredChanges(&s->contact[k]->entries, NULL, changed));
  }
  return c;
}

static PetscBool AnyChanges(HycoExpr const e[3], const PetscBool changed[])
{
  return (PetscBool)(HycoExprChanges(e[0], changed) || HycoExprChanges(e[1], changed) ||
                     HycoExprChanges(e[2], changed));
}

/* Asked by hyco check, and by resultants, which are computed again only then. */
PetscBool HycoSceneLoadsChange(HycoScene s, const PetscBool changed[])
{
  PetscBool any = PETSC_FALSE;

  for (PetscInt k = 0; k < s->n_loads; k++)
    any = (PetscBool)(any || HycoExprChanges(s->load[k].pressure, changed) || AnyChanges(s->load[k].traction, changed));
  for (PetscInt k = 0; k < s->n_point_loads; k++) any = (PetscBool)(any || AnyChanges(s->point_load[k].force, changed));
  for (PetscInt b = 0; b < s->n_bodies; b++)
    any = (PetscBool)(any || AnyChanges(s->body[b].force, changed) || HycoSceneHasInertia(s, &s->body[b], changed));
  return any;
}

/* K enters F where displacements are prescribed and where bodies are hot. */
PetscBool HycoSceneForcesChange(HycoScene s, const PetscBool changed[])
{
  const HycoChanges c = HycoSceneChanges(s, changed);
  PetscBool any = (PetscBool)(c.nodes || c.stiffness || HycoSceneSupportsChange(s, NULL, changed, c.nodes));

  for (PetscInt b = 0; b < s->n_bodies; b++)
    any = (PetscBool)(any || HycoExprChanges(s->body[b].temperature, changed) ||
                      HycoExprChanges(s->body[b].reference, changed) || HycoExprChanges(s->body[b].expansion, changed));
  return (PetscBool)(any || HycoSceneLoadsChange(s, changed));
}

/* By parameter: whether K or B depends on it; others act on F and D only, so that a factor of K stays valid. By which
   points are ordered, grouped and interpolated. */
void HycoSceneReaches(HycoScene scene, PetscBool reaches[])
{
  for (PetscInt p = 0; p < scene->n_parameters; p++) {
    PetscBool changed[HYCO_MAX_PARAMETERS] = {PETSC_FALSE};
    HycoChanges c;

    changed[p] = PETSC_TRUE;
    c = HycoSceneChanges(scene, changed);
    reaches[p] = (PetscBool)(c.stiffness || c.rows);
  }
}

/* Moves fe to mu and updates only what depends on the changed values; the flags stiffness_changed, contact_changed
   and gap_changed tell the caller what to assemble. After an error fe is not ready, and the next call updates
   everything. Not collective. */
PetscErrorCode HycoFESetParameters(HycoFE fe, const PetscReal mu[])
{
  static PetscInt drawn = 0;
  PetscBool changed[HYCO_MAX_PARAMETERS] = {PETSC_FALSE}, first = (PetscBool)!fe->ready;
  HycoChanges c;
  PetscBool supports;

  PetscFunctionBegin;
  for (PetscInt p = 0; p < fe->scene->n_variables; p++) {
    /* Exact comparison: a change within round-off is a change. Variables include the time of a history. */
    changed[p] = (PetscBool)(!fe->ready || mu[p] != fe->mu[p]);
    fe->mu[p] = mu[p];
  }
  c = HycoSceneChanges(fe->scene, changed);
  supports = (PetscBool)(first || (!fe->fixed_constant && HycoSceneSupportsChange(fe->scene, NULL, changed, c.nodes)));
  fe->stiffness_changed = (PetscBool)(first || c.stiffness);
  fe->contact_changed = (PetscBool)(first || c.rows);
  /* Supports that change move D by B u0. */
  fe->gap_changed = (PetscBool)(first || c.gaps || supports);
  fe->supports_only = (PetscBool)(!first && !c.gaps && supports);
  fe->stiffened += fe->stiffness_changed;
  fe->ready = PETSC_FALSE; /* until everything is updated */
  if (first || c.nodes) {
    PetscCall(MoveNodes(fe, first, changed));
    PetscCall(HycoTiedPlace(fe));
    PetscCall(CheckAxis(fe));
    if (first || !fe->keeps_sides) PetscCall(HycoMirrorFind(fe));
    for (PetscInt k = 0; k < fe->n_loads; k++) fe->shares[k].ready = PETSC_FALSE;
  }
  if (first || c.rows || c.gaps) fe->drawn = ++drawn;
  /* After the nodes: values and directions may depend on the position. */
  if (supports) PetscCall(SetSupports(fe));
  if (!fe->without_cells) {
    if (fe->temperature) PetscCall(HycoFESetHeat(fe, (PetscBool)(first || c.nodes), changed));
    if (fe->stiffness_changed) PetscCall(HycoFESetTangents(fe, first, c.nodes, changed));
    if (fe->stiffness_changed) PetscCall(HycoSpringsSet(fe));
  }
  fe->ready = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Also nodes at which expressions of supports are evaluated. */
PetscErrorCode HycoFEUseSurfaces(HycoFE fe)
{
  const HycoMesh m = fe->mesh;

  PetscFunctionBegin;
  fe->without_cells = fe->keeps_sides = PETSC_TRUE;
  /* Ties and cells of several bodies place nodes by others. */
  if (fe->joint || m->ties) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc1(m->n_nodes + 1, &fe->on_surface));
  for (PetscInt k = 0; k < m->n_facets * m->nf; k++) fe->on_surface[m->facets[k]] = PETSC_TRUE;
  for (PetscInt k = 0; k < fe->scene->n_fixed; k++) {
    PetscInt g = 0;

    PetscCall(HycoMeshFindGroup(m, "fixed", fe->scene->fixed[k].group, &g));
    for (PetscInt j = m->group_start[g]; j < m->group_start[g + 1]; j++) fe->on_surface[m->group_node[j]] = PETSC_TRUE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
