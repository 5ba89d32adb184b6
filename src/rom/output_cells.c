/*
  The scene's quantities of a prediction: displacements and stresses of the cells that they need, inside the RID or not,
  from the modes there, U = r(u0) + V gamma (30); for a path the laws are replayed there, once for all listed times.
*/
#include <hycofields.h>
#include <hycogradient.h>
#include <hycoinelastic.h>
#include <hycomaterialimpl.h>
#include <hycopath.h>
#include <hycoquantities.h>
#include <hycoromimpl.h>
#include <math.h>

#define KEPT 4096 /* cells */

struct _n_HycoOutputCells {
  HycoMesh mesh; /* with these cells */
  HycoFE fe;
  PetscReal *V, *u, *sigma; /* n_dof x l; n_dof; n_cells x n_sigma */
  PetscReal *means;         /* of HycoFEStressMatrixKept() */
  PetscBool *stressed;      /* by cell: sigma is needed there, elsewhere it is 0 */
  PetscInt *fe_at;          /* by full-order displacement: its index in u; -1: none */
  PetscBool *discontinuous; /* by node of the model's mesh: its displacement is exact, and a cell whose stress is needed
                                has modes at others; NULL: not a type with exact displacements beside modes */
  PetscBool *without;       /* n_quantities: means that are not measured here, but known by their slopes; NULL: none */
  PetscReal *slope;         /* n_quantities x (l + n_fe): of these, by gamma and by full-order displacements */
  PetscReal *held,
      *u0;           /* by prescribed displacements of all cells, n_quantities x n_dof there; these at the prediction */
  PetscReal *listed; /* of a path where bodies flow: sigma at the listed times */
  HycoFEPoints points; /* of derivatives of such a path: the points of cells that flow, and are stressed; NULL: none */
  PetscInt n_flow, *flow;      /* these cells */
  PetscReal *flowing, *slopes; /* their stresses, n_flow x n_sigma, and by parameter these derivatives */
  PetscReal *along, *beside;   /* n_dof: of displacements */
  PetscInt parameter;          /* and how far, and along which, the state is moved */
  PetscReal step;
  PetscReal *reaction;       /* n_dof, of supports; NULL: no quantity needs them */
  PetscInt *surface_node;    /* by node: its number on fe_surface; -1: in no contact. Allocated with reaction */
  HycoFE fe_surface;         /* on the model's mesh without its cells; NULL until needed */
  HycoResultants resultants; /* of the reactions that follow from balance; NULL: there are no reactions */
};

PetscErrorCode HycoOutputCellsDestroy(HycoOutputCells *cells)
{
  PetscFunctionBegin;
  if (!*cells) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoFEDestroy(&(*cells)->fe));
  PetscCall(HycoFEDestroy(&(*cells)->fe_surface));
  PetscCall(HycoResultantsDestroy(&(*cells)->resultants));
  PetscCall(HycoFEPointsDestroy(&(*cells)->points));
  HycoFreeAll(&(*cells)->listed, &(*cells)->flow, &(*cells)->flowing, &(*cells)->slopes, &(*cells)->along,
              &(*cells)->beside);
  PetscCall(HycoMeshDestroy(&(*cells)->mesh));
  HycoFreeAll(&(*cells)->V, &(*cells)->u, &(*cells)->sigma, &(*cells)->means, &(*cells)->stressed, &(*cells)->fe_at,
              &(*cells)->discontinuous, &(*cells)->without, &(*cells)->slope, &(*cells)->held, &(*cells)->u0,
              &(*cells)->reaction, &(*cells)->surface_node, cells);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The numbers of the cells that are needed. */
static PetscErrorCode OutputCellsList(PetscInt n_cells, const PetscBool needed[], PetscInt *n, PetscInt keep[])
{
  PetscFunctionBegin;
  *n = 0;
  for (PetscInt e = 0; e < n_cells; e++) {
    if (needed[e]) keep[(*n)++] = e;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets mesh and V from the whole mesh. */
static PetscErrorCode OutputCellsExtract(HycoROM m, HycoOutputCells p)
{
  const PetscInt width = m->model->whole->dim * m->model->l;
  PetscBool *needed;
  PetscInt *keep, n;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(m->model->whole->n_cells, &needed, m->model->whole->n_cells, &keep));
  /* Only cells that some output reads, and those around their nodes: the other modes are not copied. */
  PetscCall(HycoQuantitiesMarkCells(m->model->scene, m->model->whole, needed));
  PetscCall(OutputCellsList(m->model->whole->n_cells, needed, &n, keep));
  PetscCall(HycoSubmesh(m->model->scene, m->model->whole, n, keep, 0, NULL, 0, NULL, &p->mesh));
  PetscCall(PetscFree2(needed, keep));
  PetscCall(PetscMalloc1(p->mesh->n_nodes * width, &p->V));
  for (PetscInt i = 0; i < p->mesh->n_nodes; i++)
    PetscCall(PetscArraycpy(p->V + i * width, m->model->V_whole + p->mesh->node_whole[i] * width, width));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Created when contact acts on a support. */
static PetscErrorCode MakeSurface(HycoROM m, HycoOutputCells p)
{
  PetscFunctionBegin;
  if (p->fe_surface) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoFECreateSurface(m->model->scene, m->model->mesh->dm, &p->fe_surface));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Allocates reactions, and finds the nodes where contact forces may be part of them. */
static PetscErrorCode PrepareReactions(HycoROM m, HycoOutputCells p)
{
  PetscBool *in;
  PetscInt *place;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  if (!HycoSceneHasReactions(m->model->scene)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(p->fe->n_dof, &p->reaction));
  PetscCall(PetscMalloc1(p->mesh->n_nodes, &p->surface_node));
  PetscCall(PetscCalloc1(m->model->mesh->n_nodes, &in));
  PetscCall(PetscMalloc1(m->model->whole_nodes, &place));
  for (PetscInt i = 0; i < m->model->whole_nodes; i++) place[i] = -1;
  ierr = HycoPairsMarkSurfaces(m->model->scene, m->model->mesh, &m->pairs, in);
  /* By number in the whole mesh, the only one that the two meshes share. */
  for (PetscInt i = 0; i < m->model->mesh->n_nodes; i++) place[m->model->mesh->node_whole[i]] = in[i] ? i : -1;
  for (PetscInt i = 0; i < p->mesh->n_nodes; i++) p->surface_node[i] = place[p->mesh->node_whole[i]];
  HycoFreeAll(&place, &in);
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Subtracts contact forces on fixed unknowns from the reactions there. */
static PetscErrorCode TakeContact(HycoROM m, HycoOutputCells p, const PetscReal Lambda[])
{
  const PetscInt dim = p->fe->dim;
  PetscBool any = PETSC_FALSE;
  HycoContactFields c;
  PetscReal *force, *u;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < p->fe->n_dof; k++)
    any = (PetscBool)(any || (HycoFESupports(p->fe, k) && p->surface_node[k / dim] >= 0));
  /* No support on a slave or master surface: nothing to subtract. */
  if (!any) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MakeSurface(m, p));
  PetscCall(HycoFESetParameters(p->fe_surface, p->fe->mu));
  PetscCall(PetscCalloc2(p->fe_surface->n_dof, &u, p->fe->n_dof, &force)); /* forces do not depend on u */
  ierr = HycoContactFieldsCreate(PETSC_COMM_SELF, p->fe_surface, &m->pairs, u, Lambda, &c);
  for (PetscInt k = 0; !ierr && k < p->fe->n_dof; k++) {
    if (p->surface_node[k / dim] >= 0) force[k] = c.force[3 * p->surface_node[k / dim] + k % dim];
  }
  /* Forces of tied and oblique nodes in the unknowns that the supports hold. */
  HycoFEGeneralise(p->fe, force);
  /* The support's force is what holds the body beside the contact force on the same node. */
  for (PetscInt k = 0; k < p->fe->n_dof; k++) p->reaction[k] -= HycoFESupports(p->fe, k) ? force[k] : 0;
  PetscCall(PetscFree2(u, force));
  PetscCall(HycoContactFieldsDestroy(&c));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* f_int: NULL: for a prediction without a history. */
static PetscErrorCode OutputCellsReact(HycoROM m, HycoOutputCells p, const PetscReal f_int[], const PetscReal Lambda[])
{
  PetscFunctionBegin;
  if (!p->reaction) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoFEReactions(p->fe, p->u, f_int, p->reaction));
  PetscCall(TakeContact(m, p, Lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Those of a prediction, unless all that the quantities need follow from balance. */
static PetscErrorCode ReactPredicted(HycoROM m, HycoOutputCells p, const PetscReal f_int[], const PetscReal Lambda[])
{
  PetscFunctionBegin;
  if (!p->reaction) PetscFunctionReturn(PETSC_SUCCESS);
  /* They replace the sums over the supports' nodes, which need not be computed then. */
  if (HycoResultantsSuffice(m, p->resultants))
    PetscCall(PetscArrayzero(p->reaction, p->fe->n_dof));
  else
    PetscCall(OutputCellsReact(m, p, f_int, Lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* p->torn. place[]: by node of the whole mesh, its number in these cells; -1: none. Contact forces beside such cells,
   of a contact that training has not seen, move one side of the cell alone. */
static PetscErrorCode FindDiscontinuous(HycoROM m, HycoOutputCells p, const PetscInt place[])
{
  const PetscInt dim = p->fe->dim;
  PetscBool *modes, *discontinuous;

  PetscFunctionBegin;
  if (!m->model->traits.uniform) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(p->fe->n_dof, &modes));
  PetscCall(PetscCalloc1(p->mesh->n_nodes, &discontinuous));
  PetscCall(PetscCalloc1(m->model->mesh->n_nodes, &p->discontinuous));
  for (PetscInt i = 0; i < p->fe->n_dof; i++) modes[i] = (PetscBool)!p->fe->fixed[i];
  for (PetscInt k = 0; k < m->model->n_fe; k++) {
    if (p->fe_at[k] >= 0) modes[p->fe_at[k]] = PETSC_FALSE;
  }
  for (PetscInt e = 0; e < p->mesh->n_cells; e++) {
    const PetscInt *node = p->mesh->cells + e * p->mesh->nv;
    PetscBool any = PETSC_FALSE;

    for (PetscInt j = 0; j < p->mesh->nv * dim; j++) any = (PetscBool)(any || modes[node[j / dim] * dim + j % dim]);
    for (PetscInt v = 0; any && p->stressed[e] && v < p->mesh->nv; v++) discontinuous[node[v]] = PETSC_TRUE;
  }
  for (PetscInt i = 0; i < m->model->mesh->n_nodes; i++) {
    const PetscInt at = place[m->model->mesh->node_whole[i]];

    p->discontinuous[i] = (PetscBool)(at >= 0 && discontinuous[at]);
  }
  HycoFreeAll(&discontinuous, &modes);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Once mesh and V are set. Full-order displacements replace the modes' at the unknowns that these cells share with
   the model's mesh. */
static PetscErrorCode OutputCellsFill(HycoROM m, HycoOutputCells p)
{
  const PetscInt dim = m->model->mesh->dim;
  PetscInt *place;

  PetscFunctionBegin;
  PetscCall(HycoFECreate(m->model->scene, p->mesh->dm, &p->fe));
  PetscCall(PetscMalloc1(p->fe->n_dof, &p->u));
  PetscCall(PetscMalloc1(p->mesh->n_cells * p->fe->n_sigma, &p->sigma));
  PetscCall(PetscMalloc1(p->mesh->n_cells, &p->stressed));
  PetscCall(HycoQuantitiesMarkStressed(m->model->scene, p->mesh, p->stressed));
  PetscCall(PetscMalloc1(m->model->n_fe, &p->fe_at));
  PetscCall(PetscMalloc1(m->model->whole_nodes, &place));
  /* From whole-mesh nodes to those of these cells: both meshes number their own. */
  for (PetscInt i = 0; i < m->model->whole_nodes; i++) place[i] = -1;
  for (PetscInt i = 0; i < p->mesh->n_nodes; i++) place[p->mesh->node_whole[i]] = i;
  for (PetscInt k = 0; k < m->model->n_fe; k++) {
    const PetscInt i = place[m->model->mesh->node_whole[m->model->fe_dof[k] / dim]];

    p->fe_at[k] = i < 0 ? -1 : i * dim + m->model->fe_dof[k] % dim;
  }
  PetscCall(FindDiscontinuous(m, p, place));
  PetscCall(PetscFree(place));
  PetscCall(PrepareReactions(m, p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets p->u from these coefficients and full-order displacements. */
static void OutputCellsDisplace(HycoROM m, HycoOutputCells p, const PetscReal gamma[], const PetscReal U_fe[])
{
  for (PetscInt k = 0; k < p->fe->n_dof; k++) {
    p->u[k] = p->fe->u0[k];
    for (PetscInt j = 0; j < m->model->l; j++) p->u[k] += p->V[k * m->model->l + j] * gamma[j];
  }
  for (PetscInt k = 0; k < m->model->n_fe; k++) {
    if (p->fe_at[k] >= 0) p->u[p->fe_at[k]] = U_fe[k];
  }
  HycoFEComplete(p->fe, p->u);
}

/* The quantities for forces Lambda (of all contacts) and, where needed, p's fields (p: else NULL). */
static PetscErrorCode OutputCellsMeasure(HycoROM m, HycoOutputCells p, const PetscReal Lambda[], PetscReal value[])
{
  const HycoContactResult *contact = NULL;

  PetscFunctionBegin;
  if (HycoSceneHasContactOutputs(m->model->scene)) PetscCall(HycoROMSumContacts(m, Lambda, &contact));
  PetscCall(HycoQuantitiesMeasure(PETSC_COMM_SELF, p ? p->fe : m->fe, p ? p->without : NULL, p ? p->u : NULL,
                                  p ? p->sigma : NULL, p ? p->reaction : NULL, contact, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Forces of all contacts at a listed time of the path, whose friction they have. */
static const PetscReal *ForcesAt(HycoROM m, PetscInt listed)
{
  HycoTraceShow(m, listed);
  return m->trace.Lambda + (size_t)listed * (size_t)m->model->pairs.n;
}

/* Those of a prediction: reactions that follow from balance are set from the loads and the contact forces. */
static PetscErrorCode MeasurePredicted(HycoROM m, HycoOutputCells p, const PetscReal Lambda[], PetscReal value[])
{
  PetscFunctionBegin;
  PetscCall(OutputCellsMeasure(m, p, Lambda, value));
  if (p) PetscCall(HycoResultantsSet(m, p->resultants, p->fe->mu, Lambda, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replays the laws from the first time to the last, and evaluates the quantities at the listed ones. */
static PetscErrorCode OutputCellsTimeLoop(HycoOutputCells p, HycoReplay *r)
{
  HycoROM m = r->m;
  HycoTrace *trace = &m->trace;

  PetscFunctionBegin;
  if (!p->listed)
    PetscCall(PetscMalloc1((size_t)(m->model->scene->n_times + 1) * (size_t)(p->mesh->n_cells * p->fe->n_sigma) + 1,
                           &p->listed));
  for (PetscInt k = 0, j = 0; k < trace->n; k++) {
    PetscCall(HycoReplayMove(r, k));
    if (p->mesh->n_cells <= KEPT) PetscCall(HycoFEKeepGradients(p->fe));
    OutputCellsDisplace(m, p, trace->gamma + (size_t)k * (size_t)m->model->l,
                        trace->U_fe + (size_t)k * (size_t)m->model->n_fe);
    /* Every accepted step, because states depend on those before; outputs at the listed ones only. */
    PetscCall(HycoReplayStep(r, k, p->u));
    if (j == trace->n_listed || trace->at[j] != k) continue;
    PetscCall(HycoFEStateFields(p->fe, r->march.state, p->sigma, NULL, NULL, NULL));
    PetscCall(PetscArraycpy(p->listed + (size_t)j * (size_t)(p->mesh->n_cells * p->fe->n_sigma), p->sigma,
                            p->mesh->n_cells * p->fe->n_sigma));
    PetscCall(ReactPredicted(m, p, r->march.f_int, ForcesAt(m, j)));
    PetscCall(MeasurePredicted(m, p, ForcesAt(m, j), trace->step[j].quantity));
    j++;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the results from the listed times: the selected one, and the largest (for `min` the smallest). */
static void CollectPath(HycoROM m, HycoPrediction *out)
{
  const HycoTrace *trace = &m->trace;

  PetscCallVoid(PetscArraycpy(out->quantity, trace->step[trace->shown].quantity, m->model->scene->n_quantities));
  HycoPathExtremes(m->model->scene, trace->n_listed, trace->step, out->path_quantity);
}

/* Sets p->u and p->sigma for a prediction without a history, on the cells at mu. */
static PetscErrorCode OutputCellsReplay(HycoROM m, HycoOutputCells p, const PetscReal mu[])
{
  PetscReal *U_fe;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(m->model->n_fe, &U_fe));
  for (PetscInt k = 0; k < m->model->n_fe; k++) U_fe[k] = m->U[m->model->fe_dof[k]];
  PetscCall(HycoFESetParameters(p->fe, mu));
  OutputCellsDisplace(m, p, m->gamma, U_fe);
  PetscCall(PetscFree(U_fe));
  /* Gradients are kept while no parameter moves the nodes; where stresses vary within cells, of each point of few
     cells. */
  if (p->fe->thermal && p->mesh->n_cells <= KEPT) PetscCall(HycoFEKeepGradients(p->fe));
  PetscCall(HycoFEStressMatrixKept(p->fe, p->stressed, p->u, &p->means, p->sigma));
  for (PetscInt i = 0; i < p->n_flow * p->fe->n_sigma; i++)
    p->sigma[p->flow[i / p->fe->n_sigma] * p->fe->n_sigma + i % p->fe->n_sigma] =
        p->flowing[i] + p->step * p->slopes[p->parameter * p->n_flow * p->fe->n_sigma + i];
  PetscCall(ReactPredicted(m, p, NULL, m->Lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Created when fields are needed. */
static PetscErrorCode OutputCellsMake(HycoROM m)
{
  PetscErrorCode ierr;

  PetscFunctionBegin;
  if (m->output_cells || !HycoSceneHasFieldOutputs(m->model->scene)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoROMLoadWhole(m));
  PetscCall(PetscNew(&m->output_cells));
  ierr = OutputCellsExtract(m, m->output_cells);
  if (!ierr) ierr = OutputCellsFill(m, m->output_cells);
  /* After the cells: resultants need the modes' forces there. */
  if (!ierr && HycoSceneHasReactions(m->model->scene)) ierr = HycoResultantsFind(m, &m->output_cells->resultants);
  if (ierr) PetscCall(HycoOutputCellsDestroy(&m->output_cells));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Ownership is taken before anything can fail, as the header says; `balanced` and `loaded` by
   HycoResultantsCreate(), also after an error of OutputCellsFill(). */
PetscErrorCode HycoROMSetOutputCells(HycoROM m, HycoMesh mesh, PetscReal V[], PetscBool balanced[], HycoMesh loaded)
{
  PetscErrorCode ierr, taken = PETSC_SUCCESS;

  PetscFunctionBegin;
  ierr = HycoROMSetUp(m); /* which otherwise destroys the cells */
  PetscCall(HycoOutputCellsDestroy(&m->output_cells));
  PetscCall(PetscNew(&m->output_cells));
  m->output_cells->mesh = mesh;
  m->output_cells->V = V;
  if (!ierr) ierr = OutputCellsFill(m, m->output_cells);
  if (balanced) taken = HycoResultantsCreate(m, balanced, loaded, &m->output_cells->resultants);
  if (ierr || taken) PetscCall(HycoOutputCellsDestroy(&m->output_cells));
  PetscCall(ierr);
  PetscCall(taken);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Evaluates the quantities at all listed times, in the trace's steps. */
static PetscErrorCode MeasureTimes(HycoROM m)
{
  HycoReplay r = {0};
  PetscErrorCode ierr;

  PetscFunctionBegin;
  /* Without fields no replay is needed: the forces of each listed time are in the trace. */
  if (!m->output_cells) { /* only results of contacts */
    for (PetscInt j = 0; j < m->trace.n_listed; j++)
      PetscCall(MeasurePredicted(m, NULL, ForcesAt(m, j), m->trace.step[j].quantity));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  ierr = HycoReplayBegin(m, m->output_cells->fe, &r);
  if (!ierr) ierr = OutputCellsTimeLoop(m->output_cells, &r);
  PetscCall(HycoReplayEnd(&r));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* In a copy of the history's steps: the path's own have no outputs. NULL until they are evaluated, so that a
   failure is tried again. */
PetscErrorCode HycoROMMeasurePath(HycoROM m)
{
  HycoTrace *trace = &m->trace;

  PetscFunctionBegin;
  if (!m->model->scene->n_quantities || !trace->n_listed || trace->step) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(OutputCellsMake(m));
  PetscCall(PetscMalloc1(trace->n_listed, &trace->step));
  PetscCall(PetscArraycpy(trace->step, trace->history.step, trace->n_listed));
  HycoOnError(MeasureTimes(m), PetscCall(PetscFree(trace->step)));
  trace->history.step = trace->step;
  HycoPathExtremes(m->model->scene, trace->n_listed, trace->step, trace->history.path_quantity);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On request, as most predictions of a search need none. Of a path first each listed time, then the one that is
   shown. */
PetscErrorCode HycoROMMeasureQuantities(HycoROM m, HycoPrediction *out)
{
  PetscFunctionBegin;
  if (!m->model->scene->n_quantities) PetscFunctionReturn(PETSC_SUCCESS);
  if (m->trace.n_listed) {
    PetscCall(HycoROMMeasurePath(m));
    CollectPath(m, out);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(HycoROMMeasureAt(m, m->fe->mu, out->quantity));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Contacts are where they are: a parameter that does not move them may enter the cells alone. */
PetscErrorCode HycoROMMeasureAt(HycoROM m, const PetscReal mu[], PetscReal value[])
{
  PetscFunctionBegin;
  PetscCall(OutputCellsMake(m));
  if (m->output_cells) PetscCall(OutputCellsReplay(m, m->output_cells, mu));
  PetscCall(MeasurePredicted(m, m->output_cells, m->Lambda, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMShareDiscontinuous(HycoROM m, PetscReal *share)
{
  PetscReal sum = 0, discontinuous = 0;

  PetscFunctionBegin;
  *share = 0;
  if (!m->output_cells || !m->output_cells->discontinuous) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < m->model->pairs.n; k++) {
    const PetscReal force = PetscMax(m->Lambda[k], 0);
    PetscBool any = PETSC_FALSE;

    if (force == 0) continue;
    for (PetscInt j = m->rows.start[k]; j < m->rows.start[k + 1]; j++)
      any = (PetscBool)(any || m->output_cells->discontinuous[m->rows.dof[j] / m->fe->dim]);
    sum += force;
    discontinuous += any ? force : 0;
  }
  if (sum > 0) *share = discontinuous / sum;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- few cells, near a prediction -- */

/* Whether a mesh has a cell of the whole mesh; *at, ascending from call to call: where. */
static PetscBool OutputCellsFind(HycoMesh mesh, PetscInt cell, PetscInt *at)
{
  while (*at < mesh->n_cells && mesh->cell_whole[*at] < cell) ++*at;
  return (PetscBool)(*at < mesh->n_cells && mesh->cell_whole[*at] == cell);
}

/* m->few with these cells of `all`; kept as long as it has the needed ones. A cell that is there for a displacement is
   one of those of an extreme stress too: it has its own stress, and not 0. */
static PetscErrorCode MakeFew(HycoROM m, HycoOutputCells all, PetscInt n, const PetscInt keep[])
{
  const PetscInt width = m->model->mesh->dim * m->model->l;
  PetscBool has = (PetscBool)(m->few != NULL);
  PetscInt *node;
  HycoOutputCells p;

  PetscFunctionBegin;
  /* Nearby points decide by the same cells: the small mesh is made once for a whole gradient. */
  for (PetscInt k = 0, at = 0; k < n && has; k++)
    has = OutputCellsFind(m->few->mesh, all->mesh->cell_whole[keep[k]], &at);
  if (has) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoOutputCellsDestroy(&m->few));
  PetscCall(PetscNew(&m->few));
  p = m->few;
  PetscCall(HycoSubmesh(m->model->scene, all->mesh, n, keep, 0, NULL, 0, NULL, &p->mesh));
  PetscCall(PetscMalloc1(p->mesh->n_nodes * width, &p->V));
  PetscCall(PetscMalloc1(p->mesh->n_nodes, &node));
  /* Rows of V in the order of the new mesh's nodes. */
  PetscCall(HycoSubmeshNodes(p->mesh, all->mesh, node));
  for (PetscInt i = 0; i < p->mesh->n_nodes; i++)
    PetscCall(PetscArraycpy(p->V + i * width, all->V + node[i] * width, width));
  PetscCall(PetscFree(node));
  PetscCall(OutputCellsFill(m, p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a law, an expansion or a temperature of a body changes. */
static PetscBool StressChanges(const HycoBody *b, const PetscBool changed[])
{
  return (PetscBool)(HycoMaterialChanges(b->law, changed) || HycoExprChanges(b->temperature, changed) ||
                     HycoExprChanges(b->reference, changed) || HycoExprChanges(b->expansion, changed));
}

/* Of the quantities that are measured in p (slopes: of the others). Reactions have loads, and the supports' springs. */
static PetscBool OutputCellsEnters(HycoROM m, HycoOutputCells p, PetscBool slopes, const PetscBool changed[])
{
  const HycoScene s = m->model->scene;
  const HycoOutputCells cells = slopes ? m->few : p;
  const HycoChanges c = HycoSceneChanges(s, changed);
  PetscBool any = PETSC_FALSE, stress = PETSC_FALSE, reaction = PETSC_FALSE;
  PetscInt last = -1;

  for (PetscInt q = 0; q < s->n_quantities; q++) {
    if (p->without[q] != slopes || s->quantity[q].kind >= HYCO_QUANTITY_FORCE) continue;
    any = PETSC_TRUE;
    stress = (PetscBool)(stress || HycoQuantityOfStress(&s->quantity[q]));
    reaction = (PetscBool)(reaction || s->quantity[q].kind == HYCO_QUANTITY_REACTION);
  }
  if (!any) return PETSC_FALSE;
  if (reaction && HycoSceneForcesChange(s, changed)) return PETSC_TRUE;
  if ((!slopes && HycoSceneSupportsChange(s, cells->mesh, changed, c.nodes)) ||
      ((p->fe->joint || p->mesh->ties) && c.nodes))
    return PETSC_TRUE;
  for (PetscInt e = 0; e < cells->mesh->n_cells; e++) {
    const PetscInt b = cells->mesh->cell_body[e];

    /* Cells of a body follow each other. */
    if (b == last) continue;
    last = b;
    if (HycoBodyMoves(&s->body[b], changed) || (stress && StressChanges(&s->body[b], changed))) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

PetscBool HycoROMOutputsAreForces(HycoROM m)
{
  const HycoScene s = m->model->scene;

  for (PetscInt q = 0; q < s->n_quantities; q++) {
    if (s->quantity[q].kind < HYCO_QUANTITY_REACTION) return PETSC_FALSE;
  }
  return (PetscBool)(!m->output_cells || HycoResultantsSuffice(m, m->output_cells->resultants));
}

void HycoROMParametersEnter(HycoROM m, const PetscBool changed[], PetscBool *measured, PetscBool *slopes,
                            PetscBool *held)
{
  const HycoScene s = m->model->scene;
  HycoOutputCells p = m->output_cells;

  *held = PETSC_FALSE;
  for (PetscInt q = 0; p && q < s->n_quantities; q++)
    *held = (PetscBool)(*held || (p->without[q] && HycoSceneSupportsChange(s, m->few->mesh, changed,
                                                                           HycoSceneChanges(s, changed).nodes)));

  *measured = (PetscBool)(p && OutputCellsEnters(m, p, PETSC_FALSE, changed));
  *slopes = (PetscBool)(p && OutputCellsEnters(m, p, PETSC_TRUE, changed));
}

/* Other coefficients are 0 times what cells have of their modes. */
void HycoROMOutputsRead(HycoROM m, PetscBool modes[], PetscBool dofs[])
{
  const PetscInt l = m->model->l, n = l + m->model->n_fe;
  HycoOutputCells p = m->output_cells;

  for (PetscInt k = 0; p && k < p->fe->n_dof * l; k++) modes[k % l] = (PetscBool)(modes[k % l] || p->V[k] != 0);
  for (PetscInt i = 0; p && i < m->model->n_fe; i++) dofs[m->model->fe_dof[i]] = (PetscBool)(p->fe_at[i] >= 0);
  for (PetscInt q = 0; p && q < m->model->scene->n_quantities; q++) {
    for (PetscInt j = 0; p->without[q] && j < n; j++) {
      PetscBool *of = j < l ? &modes[j] : &dofs[m->model->fe_dof[j - l]];

      if (p->slope[q * n + j] != 0) *of = PETSC_TRUE;
    }
  }
}

/* Beside U and gamma no other displacement is in a mean: u is 0 + V gamma, or U. */
PetscErrorCode HycoROMChangeMeans(HycoROM m, const PetscReal mu[], const PetscReal from[], PetscReal step,
                                  const PetscReal dgamma[], const PetscReal dU[], PetscReal value[])
{
  const PetscInt l = m->model->l, n = l + m->model->n_fe;
  HycoOutputCells p = m->output_cells;
  HycoFE all = m->few->fe;

  PetscFunctionBegin;
  if (mu) PetscCall(HycoFESetParameters(all, mu));
  for (PetscInt q = 0; q < m->model->scene->n_quantities; q++) {
    const PetscReal *of = p->slope + q * n, *held = p->held + q * all->n_dof;

    if (!p->without[q]) continue;
    value[q] = from[q];
    for (PetscInt j = 0; j < l; j++) value[q] += step * of[j] * dgamma[j];
    for (PetscInt i = 0; i < m->model->n_fe; i++) value[q] += step * of[l + i] * dU[m->model->fe_dof[i]];
    for (PetscInt k = 0; k < all->n_dof && mu; k++) value[q] += held[k] * (all->u0[k] - p->u0[k]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of quantity q, in the cells of `all`. */
static PetscErrorCode FindDerivative(HycoROM m, HycoOutputCells all, PetscInt q, PetscReal slope[], PetscReal by[])
{
  const PetscInt l = m->model->l;

  PetscFunctionBegin;
  PetscCall(HycoQuantityMeanDerivative(all->fe, q, all->u, all->sigma, by));
  PetscCall(PetscArrayzero(slope, l + m->model->n_fe));
  for (PetscInt i = 0; i < m->model->n_fe; i++) {
    if (all->fe_at[i] < 0 || all->fe->fixed[all->fe_at[i]]) continue;
    slope[l + i] = by[all->fe_at[i]];
    by[all->fe_at[i]] = 0;
  }
  for (PetscInt k = 0; k < all->fe->n_dof; k++) {
    for (PetscInt j = 0; j < l && by[k] != 0; j++) slope[j] += by[k] * all->V[k * l + j];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Exchanges the two sets of cells; what balances the bodies belongs to neither, and moves along. */
PetscErrorCode HycoROMUnfocusOutputs(HycoROM m)
{
  const HycoOutputCells all = m->output_cells;
  HycoResultants resultants = all->resultants;

  PetscFunctionBegin;
  m->output_cells = m->few;
  m->few = all;
  all->resultants = NULL;
  m->output_cells->resultants = resultants;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Which quantities are known by their slopes: means. Tied and oblique unknowns follow from others, to which the slopes
   of their own would have to be added. */
static void ChooseDerivatives(HycoROM m, HycoOutputCells p, PetscBool without[])
{
  const HycoScene s = m->model->scene;
  const PetscBool plain = (PetscBool)(!p->fe->n_oblique && !p->mesh->ties && !m->model->mesh->ties);

  for (PetscInt q = 0; q < s->n_quantities; q++)
    without[q] = (PetscBool)(plain && m->ops->perturbed && s->quantity[q].kind == HYCO_QUANTITY_MEAN);
}

/* The cells that decide the quantities in p, into m->few. */
static PetscErrorCode FindFew(HycoROM m, HycoOutputCells p, const PetscReal value[], const PetscBool without[])
{
  PetscInt *keep, n;
  PetscBool *needed;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(p->mesh->n_cells, &needed, p->mesh->n_cells, &keep));
  ierr = HycoQuantitiesMarkDecisive(p->fe, p->u, p->sigma, value, without, HycoResultantsSuffice(m, p->resultants),
                                    needed);
  if (!ierr) ierr = OutputCellsList(p->mesh->n_cells, needed, &n, keep);
  /* A mesh has a cell. */
  if (!ierr && !n) keep[n++] = 0;
  if (!ierr) ierr = MakeFew(m, p, n, keep);
  if (ierr) PetscCall(HycoOutputCellsDestroy(&m->few));
  /* Before the error: MakeFew() may have failed after the marks. */
  PetscCall(PetscFree2(needed, keep));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes the cells that decide the outputs at this prediction the ones that are measured, until
   HycoROMUnfocusOutputs(): gradients measure twice for each parameter. */
PetscErrorCode HycoROMFocusOutputs(HycoROM m, const PetscReal value[], PetscBool *focused)
{
  const PetscInt n = m->model->scene->n_quantities, width = m->model->l + m->model->n_fe;
  HycoOutputCells p = m->output_cells;
  PetscBool without[HYCO_MAX_QUANTITIES];

  PetscFunctionBegin;
  *focused = PETSC_FALSE;
  if (!p) PetscFunctionReturn(PETSC_SUCCESS);
  ChooseDerivatives(m, p, without);
  PetscCall(FindFew(m, p, value, without));
  if (!m->few->without) {
    PetscCall(PetscMalloc1(n, &m->few->without));
    PetscCall(PetscMalloc1(n * width + 1, &m->few->slope));
    PetscCall(PetscMalloc1(n * p->fe->n_dof + 1, &m->few->held));
    PetscCall(PetscMalloc1(p->fe->n_dof + 1, &m->few->u0));
  }
  PetscCall(PetscArraycpy(m->few->u0, p->fe->u0, p->fe->n_dof));
  PetscCall(PetscArraycpy(m->few->without, without, n));
  for (PetscInt q = 0; q < n; q++) {
    if (without[q]) PetscCall(FindDerivative(m, p, q, m->few->slope + q * width, m->few->held + q * p->fe->n_dof));
  }
  *focused = PETSC_TRUE;
  PetscCall(HycoROMUnfocusOutputs(m)); /* an exchange, its own inverse */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- derivatives of a path where bodies flow -- */

/* The cells that decide quantities at some listed time, into m->few. */
static PetscErrorCode FindFewOfPath(HycoROM m, HycoOutputCells p)
{
  const HycoTrace *trace = &m->trace;
  const size_t size = (size_t)(p->mesh->n_cells * p->fe->n_sigma), l = (size_t)m->model->l,
               n_fe = (size_t)m->model->n_fe;
  const PetscBool without[HYCO_MAX_QUANTITIES] = {PETSC_FALSE};
  PetscInt *keep, n;
  PetscBool *needed, *at;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(p->mesh->n_cells, &at, p->mesh->n_cells, &needed, p->mesh->n_cells, &keep));
  PetscCall(PetscArrayzero(needed, p->mesh->n_cells));
  for (PetscInt j = 0; j < trace->n_listed; j++) {
    PetscReal mu[HYCO_MAX_PARAMETERS];

    HycoSceneSetTime(m->model->scene, m->fe->mu, trace->t[trace->at[j]], mu);
    PetscCall(HycoFESetParameters(p->fe, mu));
    OutputCellsDisplace(m, p, trace->gamma + (size_t)trace->at[j] * l, trace->U_fe + (size_t)trace->at[j] * n_fe);
    PetscCall(HycoQuantitiesMarkDecisive(p->fe, p->u, p->listed + (size_t)j * size, trace->step[j].quantity, without,
                                         HycoResultantsSuffice(m, p->resultants), at));
    for (PetscInt e = 0; e < p->mesh->n_cells; e++) needed[e] = (PetscBool)(needed[e] || at[e]);
  }
  PetscCall(OutputCellsList(p->mesh->n_cells, needed, &n, keep));
  if (!n) keep[n++] = 0; /* a mesh has a cell */
  PetscCall(MakeFew(m, p, n, keep));
  PetscCall(PetscFree3(at, needed, keep));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The points of cells whose stresses are those of laws with a past. */
static PetscErrorCode FindPoints(HycoROM m, HycoOutputCells p)
{
  const PetscInt nq = HycoElementGet(p->mesh->type)->nq, n_parameters = m->model->scene->n_parameters,
                 ns = p->fe->n_sigma;
  PetscInt *point;

  PetscFunctionBegin;
  if (p->points) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(p->mesh->n_cells, &p->flow));
  PetscCall(PetscMalloc1(p->mesh->n_cells * nq, &point));
  for (PetscInt e = 0; e < p->mesh->n_cells; e++) {
    if (!p->stressed[e] || m->model->scene->body[p->mesh->cell_body[e]].law->linear) continue;
    for (PetscInt q = 0; q < nq; q++) point[p->n_flow * nq + q] = e * nq + q;
    p->stressed[e] = PETSC_FALSE; /* not by its displacements */
    p->flow[p->n_flow++] = e;
  }
  PetscCall(HycoFEPointsCreate(p->fe, p->n_flow * nq, point, n_parameters, &p->points));
  PetscCall(PetscFree(point));
  PetscCall(PetscMalloc1(p->n_flow * ns + 1, &p->flowing));
  PetscCall(PetscCalloc1(n_parameters * p->n_flow * ns + 1, &p->slopes));
  PetscCall(PetscMalloc1(p->fe->n_dof, &p->along));
  PetscCall(PetscMalloc1(p->fe->n_dof, &p->beside));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMFocusPath(HycoROM m, PetscBool *focused)
{
  HycoOutputCells p = m->output_cells;

  PetscFunctionBegin;
  *focused = PETSC_FALSE;
  if (!p) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(FindFewOfPath(m, p));
  if (!m->few->without) PetscCall(PetscCalloc1(m->model->scene->n_quantities + 1, &m->few->without));
  PetscCall(FindPoints(m, m->few));
  *focused = PETSC_TRUE;
  PetscCall(HycoROMUnfocusOutputs(m)); /* an exchange, its own inverse */
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool HycoROMPathIsFocused(HycoROM m)
{
  return (PetscBool)(m->output_cells && m->output_cells->points);
}

PetscBool HycoROMOutputsFlow(HycoROM m)
{
  return (PetscBool)(m->output_cells && m->output_cells->n_flow);
}

/* Reactions of laws with a past only by balance. */
PetscBool HycoROMOutputsFollow(HycoROM m)
{
  return (PetscBool)(!m->output_cells || !m->output_cells->reaction ||
                     HycoResultantsSuffice(m, m->output_cells->resultants));
}

/* The means over cells of stresses at the points, or of their derivatives. */
static void TakeMeans(HycoOutputCells p, const PetscReal stress[], PetscReal mean[])
{
  const PetscInt nq = HycoElementGet(p->mesh->type)->nq, ns = p->fe->n_sigma;
  const PetscReal *weight = HycoFEPointsWeights(p->points);

  for (PetscInt i = 0; i < p->n_flow; i++) {
    PetscReal volume = 0;

    for (PetscInt c = 0; c < ns; c++) mean[i * ns + c] = 0;
    for (PetscInt q = i * nq; q < (i + 1) * nq; q++) {
      volume += weight[q];
      for (PetscInt c = 0; c < ns; c++) mean[i * ns + c] += weight[q] * stress[q * ns + c];
    }
    for (PetscInt c = 0; c < ns; c++) mean[i * ns + c] /= volume;
  }
}

PetscErrorCode HycoROMOutputsStep(HycoROM m, PetscInt k)
{
  const HycoTrace *trace = &m->trace;
  HycoOutputCells p = m->output_cells;
  PetscReal mu[HYCO_MAX_PARAMETERS];

  PetscFunctionBegin;
  if (!HycoROMOutputsFlow(m)) PetscFunctionReturn(PETSC_SUCCESS);
  HycoSceneSetTime(m->model->scene, m->fe->mu, trace->t[k], mu);
  PetscCall(HycoFESetParameters(p->fe, mu));
  PetscCall(HycoFEKeepGradients(p->fe));
  if (k)
    PetscCall(HycoFEPointsAccept(p->points));
  else
    PetscCall(HycoFEPointsBegin(p->points));
  OutputCellsDisplace(m, p, trace->gamma + (size_t)k * (size_t)m->model->l,
                      trace->U_fe + (size_t)k * (size_t)m->model->n_fe);
  PetscCall(PetscArraycpy(p->along, p->u, p->fe->n_dof));
  PetscCall(HycoFEPointsStep(p->points, p->u, trace->t[PetscMax(k - 1, 0)], trace->t[k], NULL, NULL));
  TakeMeans(p, HycoFEPointsStress(p->points), p->flowing);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The data of the laws at the points of a difference; u: the displacements of the step. */
static PetscErrorCode AcceptPerturbed(HycoROM m, HycoOutputCells p, const PetscReal mu[], const HycoDifference *d,
                                      const PetscReal u[])
{
  PetscBool changed[HYCO_MAX_PARAMETERS] = {PETSC_FALSE}, enters, strains;

  PetscFunctionBegin;
  changed[d->parameter] = PETSC_TRUE;
  enters = HycoFEPointsChange(p->points, changed, &strains);
  for (PetscInt j = 1; j < 3; j++) {
    PetscReal at[HYCO_MAX_PARAMETERS];

    HycoDifferencePoint(d, m->model->scene, mu, j, at);
    if (strains) PetscCall(HycoFESetParameters(p->fe, mu));
    for (PetscInt i = 0; i < p->fe->n_dof && strains; i++) p->beside[i] = u[i] - p->fe->u0[i];
    if (enters) PetscCall(HycoFESetParameters(p->fe, at));
    for (PetscInt i = 0; i < p->fe->n_dof && strains; i++) p->beside[i] += p->fe->u0[i];
    PetscCall(HycoFEPointsPerturbed(p->points, j, enters, strains ? p->beside : NULL));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMOutputsSensitivity(HycoROM m, const PetscReal mu[], const HycoDifference *d,
                                         const PetscReal dgamma[], const PetscReal dU[], PetscBool *smooth)
{
  static const PetscInt point[] = {0, 1, 2};
  const PetscInt l = m->model->l;
  HycoOutputCells p = m->output_cells;
  PetscReal *stress;

  PetscFunctionBegin;
  *smooth = PETSC_TRUE;
  if (!HycoROMOutputsFlow(m)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AcceptPerturbed(m, p, mu, d, p->along));
  PetscCall(HycoFESetParameters(p->fe, mu));
  PetscCall(HycoFEKeepGradients(p->fe));
  for (PetscInt k = 0; k < p->fe->n_dof; k++) {
    p->beside[k] = 0;
    for (PetscInt j = 0; j < l; j++) p->beside[k] += p->V[k * l + j] * dgamma[j];
  }
  for (PetscInt k = 0; k < m->model->n_fe; k++) {
    if (p->fe_at[k] >= 0) p->beside[p->fe_at[k]] = dU[m->model->fe_dof[k]];
  }
  PetscCall(PetscMalloc1(p->n_flow * HycoElementGet(p->mesh->type)->nq * p->fe->n_sigma, &stress));
  PetscCall(HycoFEPointsDerivatives(p->points, d->parameter, d->weight, point, p->beside, NULL, stress, smooth));
  TakeMeans(p, stress, p->slopes + d->parameter * p->n_flow * p->fe->n_sigma);
  PetscCall(PetscFree(stress));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void HycoROMOutputsMove(HycoROM m, PetscInt parameter, PetscReal step)
{
  if (!HycoROMOutputsFlow(m)) return;
  m->output_cells->parameter = parameter;
  m->output_cells->step = step;
}

/* NULL: no output reads a cell, as where all are of contacts. */
HycoFE HycoROMGetOutputCells(HycoROM m)
{
  return m->output_cells ? m->output_cells->fe : NULL;
}

const PetscBool *HycoROMGetPushed(HycoROM m, PetscInt q)
{
  return m->output_cells ? HycoResultantsPushed(m, m->output_cells->resultants, q) : NULL;
}

PetscErrorCode HycoROMGetMiss(HycoROM m, PetscInt q, PetscReal value, PetscReal *miss, PetscReal *size)
{
  return HycoResultantsMiss(m, m->output_cells ? m->output_cells->resultants : NULL, q, value, miss, size);
}

PetscBool HycoROMFollowsFromBalance(HycoROM m, PetscInt q)
{
  return (PetscBool)(m->output_cells && HycoResultantsFollow(m, m->output_cells->resultants, q));
}

void HycoROMGetOutputFields(HycoROM m, const PetscReal *u[], const PetscReal *sigma[])
{
  *u = m->output_cells ? m->output_cells->u : NULL;
  *sigma = m->output_cells ? m->output_cells->sigma : NULL;
}

/* Outputs of given fields by the same code as those of predictions: errors and calibration compare like with like.
   */
PetscErrorCode HycoROMMeasureSolution(HycoROM m, const PetscReal mu[], const PetscReal u[], const PetscReal sigma[],
                                      const PetscReal reaction[], const PetscReal Lambda[], PetscReal value[])
{
  HycoOutputCells p = m->output_cells;

  PetscFunctionBegin;
  if (p) {
    PetscCall(HycoFESetParameters(p->fe, mu));
    PetscCall(PetscArraycpy(p->u, u, p->fe->n_dof));
    PetscCall(PetscArraycpy(p->sigma, sigma, p->mesh->n_cells * p->fe->n_sigma));
    if (!m->trace.n_listed) PetscCall(OutputCellsReact(m, p, NULL, Lambda));
    /* Reactions of a path need the internal forces, which a stored solution does not give: NaN marks them as
       unknown. */
    for (PetscInt k = 0; m->trace.n_listed && p->reaction && k < p->fe->n_dof; k++)
      p->reaction[k] = reaction ? reaction[k] : NAN;
  }
  PetscCall(OutputCellsMeasure(m, p, Lambda, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}
