/*
  Reactions of a prediction that follow from balance: minus the sum of the loads and of the contact forces on bodies
  that only the supports of a quantity's group hold along its axis. Loads and normals are exact, so that the error is
  that of the contact forces. A type that computes these itself has smaller errors there than in its displacements; of
  other types the reactions from displacements are closer than the sums of contact forces, so that balance serves only
  where contact does not act on the bodies, or acts between them.
*/
#include <hycoquantities.h>
#include <hycoromimpl.h>

#define KEPT 3 /* points whose loads are kept */

/* At a point. */
typedef struct {
  PetscInt used;                            /* counts requests; 0: nothing is there */
  PetscReal *load, mu[HYCO_MAX_PARAMETERS]; /* n_dof: on the nodes */
} Loads;

struct _n_HycoResultants {
  PetscBool *balanced, *loaded;          /* n_quantities x n_bodies; by body: of a quantity */
  PetscBool pushed[HYCO_MAX_QUANTITIES]; /* contact acts on these bodies from outside */
  HycoMesh mesh;                         /* the cells with the loads of these bodies */
  HycoFE fe;
  Loads at[KEPT];
  PetscInt uses;
  const PetscReal *load; /* of `at`, at the parameters in hand */
};

PetscErrorCode HycoResultantsDestroy(HycoResultants *resultants)
{
  PetscFunctionBegin;
  if (!*resultants) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoFEDestroy(&(*resultants)->fe));
  PetscCall(HycoMeshDestroy(&(*resultants)->mesh));
  for (PetscInt k = 0; k < KEPT; k++) PetscCall(PetscFree((*resultants)->at[k].load));
  HycoFreeAll(&(*resultants)->balanced, &(*resultants)->loaded, resultants);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks the bodies with nodes of a contact's group. */
static PetscErrorCode MarkBodies(HycoROM m, const char group[], PetscBool body[])
{
  HycoMesh mesh = m->model->mesh;
  PetscInt g = 0;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(mesh, "contact", group, &g));
  for (PetscInt k = mesh->group_start[g]; k < mesh->group_start[g + 1]; k++)
    body[mesh->node_body[mesh->group_node[k]]] = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets pushed[]: a contact has bodies of a quantity on one side only. */
static PetscErrorCode FindPushed(HycoROM m, HycoResultants r)
{
  const HycoScene scene = m->model->scene;
  PetscBool *body;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(scene->n_bodies, &body));
  for (PetscInt c = 0; c < scene->n_contacts; c++) {
    const HycoContact contact = scene->contact[c];

    PetscCall(PetscArrayzero(body, scene->n_bodies));
    PetscCall(MarkBodies(m, contact->slave, body));
    if (contact->master) PetscCall(MarkBodies(m, contact->master, body));
    for (PetscInt q = 0; q < scene->n_quantities; q++) {
      PetscBool in = PETSC_FALSE, out = (PetscBool)!contact->master;

      for (PetscInt b = 0; b < scene->n_bodies; b++) {
        in = (PetscBool)(in || (body[b] && r->balanced[q * scene->n_bodies + b]));
        out = (PetscBool)(out || (body[b] && !r->balanced[q * scene->n_bodies + b]));
      }
      /* A contact between two bodies of the quantity exerts forces that cancel. */
      r->pushed[q] = (PetscBool)(r->pushed[q] || (in && out));
    }
  }
  PetscCall(PetscFree(body));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes ownership first. `pushed` decides online, since it depends on the type whether its contact forces may
   serve. */
PetscErrorCode HycoResultantsCreate(HycoROM m, PetscBool balanced[], HycoMesh loaded, HycoResultants *resultants)
{
  HycoResultants r;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscNew(resultants));
  r = *resultants;
  r->balanced = balanced;
  r->mesh = loaded;
  PetscCall(PetscCalloc1(m->model->scene->n_bodies + 1, &r->loaded));
  for (PetscInt k = 0; k < m->model->scene->n_quantities * m->model->scene->n_bodies; k++) {
    if (balanced[k]) r->loaded[k % m->model->scene->n_bodies] = PETSC_TRUE;
  }
  ierr = HycoFECreate(m->model->scene, loaded->dm, &r->fe);
  /* Forces of thermal strains do no work on a translation: their sum over a body is 0, but for radii. */
  if (!ierr) r->fe->without_cells = (PetscBool)(m->model->scene->formulation != HYCO_AXISYMMETRIC);
  if (!ierr) ierr = FindPushed(m, r);
  if (ierr) PetscCall(HycoResultantsDestroy(resultants));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* In training, on the whole mesh. A reaction from the balance of forces has the accuracy of the contact forces,
   one from the internal forces that of the modes. */
PetscErrorCode HycoResultantsFind(HycoROM m, HycoResultants *resultants)
{
  PetscBool *balanced, *needed;
  PetscInt *keep, n = 0;
  HycoMesh loaded;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(m->model->scene->n_quantities * m->model->scene->n_bodies, &balanced));
  PetscCall(PetscMalloc2(m->model->whole->n_cells, &needed, m->model->whole->n_cells, &keep));
  /* Which outputs' groups hold all supports of their bodies along the axis: only their reactions follow from
     balance. */
  PetscCall(HycoQuantitiesBalance(PETSC_COMM_SELF, m->model->scene, m->model->whole, balanced));
  PetscCall(HycoQuantitiesMarkLoads(m->model->scene, m->model->whole, balanced, needed));
  for (PetscInt e = 0; e < m->model->whole->n_cells; e++) {
    if (needed[e]) keep[n++] = e;
  }
  /* The cells with loads alone: the balance needs no others online. */
  PetscCall(HycoSubmesh(m->model->scene, m->model->whole, n, keep, 0, NULL, 0, NULL, &loaded));
  PetscCall(PetscFree2(needed, keep));
  PetscCall(HycoResultantsCreate(m, balanced, loaded, resultants));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The bodies from whose balance quantity q follows; NULL: it does not. */
static const PetscBool *ResultantsBodies(HycoROM m, HycoResultants r, PetscInt q)
{
  const PetscBool *of = r->balanced + q * m->model->scene->n_bodies;

  if (r->pushed[q] && !(m->model->traits.resultants && HycoROMHasAllForces(m))) return NULL;
  for (PetscInt b = 0; b < m->model->scene->n_bodies; b++) {
    if (of[b]) return of;
  }
  return NULL;
}

/* Those on which contact acts from outside. */
const PetscBool *HycoResultantsPushed(HycoROM m, HycoResultants r, PetscInt q)
{
  return r && m->model->scene->quantity[q].kind == HYCO_QUANTITY_REACTION && r->pushed[q] ? ResultantsBodies(m, r, q)
                                                                                          : NULL;
}

PetscBool HycoResultantsFollow(HycoROM m, HycoResultants r, PetscInt q)
{
  return (PetscBool)(r && m->model->scene->quantity[q].kind == HYCO_QUANTITY_REACTION && ResultantsBodies(m, r, q));
}

/* One quantity that does not follow makes the sums over supports necessary. */
PetscBool HycoResultantsSuffice(HycoROM m, HycoResultants r)
{
  for (PetscInt q = 0; q < m->model->scene->n_quantities; q++) {
    if (m->model->scene->quantity[q].kind == HYCO_QUANTITY_REACTION && !ResultantsBodies(m, r, q)) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* The loads on the bodies of[b] along an axis. */
static PetscReal ResultantsLoad(HycoResultants r, const PetscBool of[], PetscInt axis)
{
  PetscReal sum = 0;

  for (PetscInt i = 0; i < r->mesh->n_nodes; i++) sum += of[r->mesh->node_body[i]] ? r->load[i * r->fe->dim + axis] : 0;
  return sum;
}

/* Whether the loads at mu differ from those at another point. */
static PetscBool ResultantsDiffer(HycoResultants r, const PetscReal other[], const PetscReal mu[])
{
  const HycoScene s = r->fe->scene;
  PetscBool changed[HYCO_MAX_PARAMETERS] = {PETSC_FALSE}, heat = PETSC_FALSE, moved = PETSC_FALSE;
  HycoChanges c;

  for (PetscInt p = 0; p < s->n_variables; p++) changed[p] = (PetscBool)(mu[p] != other[p]);
  c = HycoSceneChanges(s, changed);
  for (PetscInt b = 0; b < s->n_bodies; b++)
    moved = (PetscBool)(moved || (r->loaded[b] && HycoBodyMoves(&s->body[b], changed)));
  if (r->fe->joint || r->mesh->ties) moved = c.nodes;
  /* Moduli act on the forces of heat alone. */
  for (PetscInt b = 0; b < s->n_bodies && !r->fe->without_cells; b++)
    heat =
        (PetscBool)(heat || (s->body[b].expansion && (c.stiffness || HycoExprChanges(s->body[b].temperature, changed) ||
                                                      HycoExprChanges(s->body[b].reference, changed) ||
                                                      HycoExprChanges(s->body[b].expansion, changed))));
  return (PetscBool)(moved || heat || HycoSceneLoadsChange(s, changed));
}

/* The loads at mu, unless they are there or no change affects them. In place of those that were asked for longest ago:
   a gradient asks for its point's and for those to both sides. */
static PetscErrorCode BringLoads(HycoResultants r, const PetscReal mu[])
{
  Loads *oldest = r->at;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < KEPT; k++) {
    Loads *one = &r->at[k];

    if (one->used && !ResultantsDiffer(r, one->mu, mu)) {
      one->used = ++r->uses;
      r->load = one->load;
      PetscFunctionReturn(PETSC_SUCCESS);
    }
    if (one->used < oldest->used) oldest = one;
  }
  /* After an error in between, the loads must not pass for those there. */
  oldest->used = 0;
  PetscCall(HycoFESetParameters(r->fe, mu));
  if (!oldest->load) PetscCall(PetscMalloc1(r->fe->n_dof + 1, &oldest->load));
  PetscCall(HycoFELoads(r->fe, oldest->load));
  PetscCall(PetscArraycpy(oldest->mu, mu, r->fe->scene->n_variables));
  oldest->used = ++r->uses;
  r->load = oldest->load;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Overwrites the outputs whose bodies are in balance: support = - contact - loads. The others keep what was
   measured from the internal forces. */
PetscErrorCode HycoResultantsSet(HycoROM m, HycoResultants r, const PetscReal mu[], const PetscReal Lambda[],
                                 PetscReal value[])
{
  PetscFunctionBegin;
  for (PetscInt q = 0; r && q < m->model->scene->n_quantities; q++) {
    const PetscInt axis = m->model->scene->quantity[q].field;
    const PetscBool *of = ResultantsBodies(m, r, q);
    PetscReal push = 0;

    if (!of) continue;
    PetscCall(BringLoads(r, mu));
    if (r->pushed[q]) PetscCall(HycoROMPushBodies(m, Lambda, of, axis, &push));
    /* 0 - x: no negative zero in reports. */
    value[q] = 0 - push - ResultantsLoad(r, of, axis);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of reactions that are measured: those that follow balance whatever the forces are. Magnitudes are of all axes, as a
   resultant may vanish by symmetry. */
PetscErrorCode HycoResultantsMiss(HycoROM m, HycoResultants r, PetscInt q, PetscReal value, PetscReal *miss,
                                  PetscReal *size)
{
  const PetscInt axis = m->model->scene->quantity[q].field;
  const PetscBool *of = r ? r->balanced + q * m->model->scene->n_bodies : NULL;
  PetscReal push, load;
  PetscBool any = PETSC_FALSE;

  PetscFunctionBegin;
  *miss = *size = 0;
  if (!r || m->model->scene->quantity[q].kind != HYCO_QUANTITY_REACTION || ResultantsBodies(m, r, q) ||
      !HycoROMHasAllForces(m))
    PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt b = 0; b < m->model->scene->n_bodies; b++) any = (PetscBool)(any || of[b]);
  if (!any) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(BringLoads(r, m->fe->mu));
  PetscCall(HycoROMPushBodies(m, m->Lambda, of, axis, &push));
  load = ResultantsLoad(r, of, axis);
  *miss = PetscAbsReal(value + push + load);
  *size = PetscAbsReal(value);
  for (PetscInt k = 0; k < m->model->pairs.n; k++) *size += PetscAbsReal(m->Lambda[k]);
  for (PetscInt i = 0; i < r->fe->n_dof; i++)
    *size += of[r->mesh->node_body[i / r->fe->dim]] ? PetscAbsReal(r->load[i]) : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}
