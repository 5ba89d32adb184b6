/* What a prediction gives: results, files, the view of its model. */
#include <hycofields.h>
#include <hycoromimpl.h>
#include <petscviewer.h>
#include <string.h>

/* After a failed prediction too: m->solved is set at its end only. */
static PetscErrorCode CheckSolved(HycoROM m)
{
  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  PetscCheck(m->solved, PETSC_COMM_SELF, PETSC_ERR_ORDER, "call HycoROMPredict() before getting its results");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A path's is that of the selected time; a type may know it from its matrices, otherwise it is the cells' sum. */
PetscErrorCode HycoROMGetStrainEnergy(HycoROM m, PetscReal *energy)
{
  PetscReal *each;
  PetscBool known = PETSC_FALSE;

  PetscFunctionBegin;
  HycoCheckGiven(energy);
  PetscCall(CheckSolved(m));
  /* The energy of a path is that of the laws' elastic strains, summed when the state was there. */
  if (m->trace.n_listed) {
    *energy = m->trace.history.step[m->trace.shown].stored;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscTryTypeMethod(m, energy, energy, &known);
  if (known) PetscFunctionReturn(PETSC_SUCCESS);
  *energy = 0;
  PetscCall(PetscMalloc1(m->model->mesh->n_cells, &each));
  PetscCall(HycoFEEnergy(m->fe, m->U, each));
  for (PetscInt e = 0; e < m->model->mesh->n_cells; e++) *energy += each[e];
  /* Springs to the ground store energy too, as in full order's identity. */
  *energy += HycoSpringsEnergy(m->fe, m->U);
  PetscCall(PetscFree(each));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sums over the contacts that may have a force. */
static void SumForces(HycoROM m, HycoPrediction *p)
{
  const PetscInt n = m->spread ? m->model->pairs.n : m->m;

  p->n_active = p->n_rid_active = 0;
  p->total_contact_force = p->lambda_max = p->lambda_norm2 = p->covered_force = 0;
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt k = m->spread ? i : m->contact[i];

    p->total_contact_force += m->Lambda[k];
    if (m->model->in_rid[k]) p->covered_force += m->Lambda[k];
    p->lambda_max = PetscMax(p->lambda_max, m->Lambda[k]);
    p->lambda_norm2 += m->Lambda[k] * m->Lambda[k];
  }
  for (PetscInt i = 0; i < n; i++) {
    /* The threshold needs the largest force: a second loop. */
    const PetscInt k = m->spread ? i : m->contact[i], presses = m->Lambda[k] > HYCO_FORCE_ROUND_OFF * p->lambda_max;

    p->n_active += presses;
    if (m->model->in_rid[k]) p->n_rid_active += presses;
  }
  p->covered_force = p->total_contact_force > 0 ? p->covered_force / p->total_contact_force : 1;
  p->lambda_norm2 = PetscSqrtReal(p->lambda_norm2);
}

/* The norm and the ranges of the displacements of the RID's nodes. */
static PetscErrorCode MeasureDisplacements(HycoROM m, HycoPrediction *p)
{
  const PetscInt *node;
  PetscInt n;

  PetscFunctionBegin;
  p->u_norm2 = 0;
  for (PetscInt c = 0; c < 3; c++) p->u_min[c] = p->u_max[c] = 0;
  PetscCall(ISGetLocalSize(m->model->rid, &n));
  PetscCall(ISGetIndices(m->model->rid, &node));
  for (PetscInt k = 0; k < n; k++) {
    for (PetscInt c = 0; c < p->dim; c++) {
      const PetscReal u = m->U[node[k] * p->dim + c];

      /* The first node sets the range: 0 need not be in it. */
      p->u_min[c] = k ? PetscMin(p->u_min[c], u) : u;
      p->u_max[c] = k ? PetscMax(p->u_max[c], u) : u;
      p->u_norm2 += u * u;
    }
  }
  PetscCall(ISRestoreIndices(m->model->rid, &node));
  p->u_norm2 = PetscSqrtReal(p->u_norm2);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sliding, overlap and facing contacts of the prediction; dependent rows are counted only where surfaces are complete,
   since an RID cuts rows off, and on paths at each listed time. */
static PetscErrorCode MeasureContacts(HycoROM m, HycoPrediction *p)
{
  HycoContactFacts state;

  PetscFunctionBegin;
  PetscCall(HycoContactMeasure(m->fe, m->of_fe, m->U, m->Lambda, m->contact, m->model->facet, &state));
  p->n_facing = state.n_facing;
  p->overlap = state.overlap;
  p->sliding = state.sliding;
  p->n_dependent = -1;
  for (PetscInt k = 0; k < m->trace.n_listed; k++) {
    p->n_dependent = PetscMax(p->n_dependent, m->trace.history.step[k].n_dependent);
    p->sliding = PetscMax(p->sliding, m->trace.history.step[k].sliding); /* contacts may be open at the end */
  }
  if (m->model->traits.surfaces && p->reason > 0 && !m->trace.n_listed)
    PetscCall(HycoRowsCountDependent(&m->rows, m->fe->n_dof, m->U, m->Lambda, NULL, &p->n_dependent));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* If requested; else -1. */
static PetscErrorCode MeasureEquilibrium(HycoROM m, HycoPrediction *p)
{
  HycoEquilibrium e;

  PetscFunctionBegin;
  p->residual = p->contact_residual = -1;
  if (!m->wants_equilibrium || !m->trace.n_listed) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoROMGetEquilibrium(m, &e));
  p->residual = e.worst;
  p->contact_residual = e.worst_contact;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Completes the stresses of the RID's cells and the results that need them or the reconstruction. Computed when
   asked for, not in HycoROMPredict(): a program that wants forces alone does not pay for estimates and outputs. */
PetscErrorCode HycoROMGetPrediction(HycoROM m, HycoPrediction *out)
{
  const PetscReal begin = HycoNow(), cpu = HycoCPU();
  HycoPrediction *p;
  PetscBool first;

  PetscFunctionBegin;
  HycoCheckGiven(out);
  PetscCall(CheckSolved(m));
  first = (PetscBool)!m->measured;
  p = &m->prediction;
  p->dim = m->fe->dim;
  /* Sizes of the reduced problem: a report shows them beside full order's. */
  p->n_dof = m->n;
  PetscCall(PetscStrncpy(p->type, m->model->type, sizeof(p->type)));
  PetscCall(PetscStrncpy(p->title, m->model->traits.title, sizeof(p->title)));
  p->gives_forces = m->model->traits.forces;
  p->n_multipliers = m->n_L;
  p->n_contacts = m->m;
  p->n_all_contacts = m->model->pairs.n;
  p->n_modes = m->model->l;
  p->n_fe_dofs = m->model->n_fe;
  PetscCall(ISGetLocalSize(m->model->rid, &p->rid_nodes));
  p->rid_elements = m->model->mesh->n_cells;
  p->rid_fraction = (PetscReal)m->model->mesh->n_cells / m->model->whole_cells;
  p->condition = m->model->numbers[0];
  SumForces(m, p);
  HycoTraceSummary(m, p);
  PetscCall(MeasureDisplacements(m, p));
  PetscCall(MeasureContacts(m, p));
  PetscCall(HycoROMMeasureQuantities(m, p));
  /* Outputs are there: estimates of theirs may be evaluated. */
  m->measured = PETSC_TRUE;
  /* After the outputs, whose magnitudes bound their estimates from below. */
  PetscCall(HycoEstimatesEvaluate(m, p));
  PetscCall(MeasureEquilibrium(m, p));
  /* Outputs and estimates are a part of the prediction. */
  if (first) p->seconds.total += HycoNow() - begin;
  if (first) p->seconds.cpu += HycoCPU() - cpu;
  *out = *p;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of models of earlier versions, and without held-out solutions, it is not known. */
PetscErrorCode HycoROMGetTrainingCost(HycoROM m, PetscReal *cpu)
{
  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  HycoCheckGiven(cpu);
  *cpu = m->model->estimates.cpu;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stresses of a path are those of the state, stored at its listed times. */
PetscErrorCode HycoROMGetRID(HycoROM m, PetscInt *n_nodes, const PetscInt *node_ids[], const PetscReal *U[],
                             PetscInt *n_cells, const PetscInt *cell_ids[], const PetscReal *sigma[])
{
  PetscFunctionBegin;
  PetscCall(CheckSolved(m));
  if (n_nodes) *n_nodes = m->model->mesh->n_nodes;
  if (node_ids) *node_ids = m->model->mesh->node_id;
  if (U) PetscCall(HycoROMComplete(m));
  if (U) *U = m->U;
  if (n_cells) *n_cells = m->model->mesh->n_cells;
  if (cell_ids) *cell_ids = m->model->mesh->cell_id;
  /* Recomputing from U would need the inelastic strains of that time. */
  if (sigma && m->trace.n_listed)
    *sigma = m->trace.sigma + (size_t)m->trace.shown * (size_t)(m->model->mesh->n_cells * m->fe->n_sigma);
  else if (sigma) {
    PetscCall(HycoFEStress(m->fe, m->U, m->stress));
    *sigma = m->stress;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All contacts of the scene in its order, also those outside the RID; in_rid: 1 where the force is a multiplier, 0
   where it is reconstructed. */
PetscErrorCode HycoROMGetLambda(HycoROM m, PetscInt *n_contacts, const PetscReal *Lambda[], const PetscInt *node_ids[],
                                const PetscInt *in_rid[])
{
  PetscFunctionBegin;
  PetscCall(CheckSolved(m));
  if (n_contacts) *n_contacts = m->model->pairs.n;
  if (Lambda) *Lambda = m->Lambda;
  if (node_ids) *node_ids = m->slave_id;
  if (in_rid) *in_rid = m->model->in_rid;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* U = r(u0) + V gamma (30), with the full-order values if there are any. */
PetscErrorCode HycoROMGetWholeU(HycoROM m, PetscInt *n_nodes, const PetscReal *U[])
{
  PetscFunctionBegin;
  PetscCall(CheckSolved(m));
  PetscCall(HycoROMLoadWhole(m));
  if (!m->whole_current) {
    const PetscInt dim = m->fe->dim;

    /* The lifting r(u0) is that of mu, with the time of a path's selected step. */
    PetscCall(HycoFESetParameters(m->fe_whole, m->fe->mu));
    for (PetscInt k = 0; k < m->fe_whole->n_dof; k++) {
      PetscReal sum = m->fe_whole->u0[k];

      for (PetscInt j = 0; j < m->model->l; j++) sum += m->model->V_whole[k * m->model->l + j] * m->gamma[j];
      m->U_whole[k] = sum;
    }
    for (PetscInt k = 0; k < m->model->n_fe; k++)
      m->U_whole[m->model->mesh->node_whole[m->model->fe_dof[k] / dim] * dim + m->model->fe_dof[k] % dim] =
          m->U[m->model->fe_dof[k]];
    HycoFEComplete(m->fe_whole, m->U_whole);
    m->whole_current = PETSC_TRUE;
  }
  if (n_nodes) *n_nodes = m->model->whole->n_nodes;
  if (U) *U = m->U_whole;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The last prediction in the form for output. The caller frees `rid`. */
static PetscErrorCode PredictionFields(HycoROM m, HycoSolution *solution, PetscReal **rid)
{
  const PetscReal *U;

  PetscFunctionBegin;
  PetscCall(HycoROMGetWholeU(m, NULL, &U));
  PetscCall(PetscCalloc1(m->model->whole->n_cells, rid));
  /* A field that marks the RID in the output. */
  for (PetscInt e = 0; e < m->model->mesh->n_cells; e++) (*rid)[m->model->mesh->cell_whole[e]] = 1;
  *solution = (HycoSolution){.fe = m->fe_whole,
                             .surface = m->fe_whole,
                             .pairs = &m->whole_pairs,
                             .u = U,
                             .u_surface = U,
                             .lambda = m->Lambda,
                             .rid = *rid};
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMWrite(HycoROM m, const char path[])
{
  HycoSolution solution;
  PetscReal *rid;

  PetscFunctionBegin;
  HycoCheckGiven(path);
  PetscCall(CheckSolved(m));
  /* A series: the laws are replayed on the whole mesh. */
  if (m->model->scene->n_times) {
    PetscCall(HycoTraceWrite(m, path));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PredictionFields(m, &solution, &rid));
  HycoFinally(HycoSolutionWrite(path, &solution), PetscCall(PetscFree(rid)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Predicts a point and adds its fields to the file; the array of the RID's cells is freed on an error too. */
static PetscErrorCode WritePoint(HycoROM m, const PetscReal mu[], HycoFieldFile file)
{
  HycoSolution solution;
  PetscReal *rid;

  PetscFunctionBegin;
  PetscCall(HycoROMPredict(m, m->model->scene->n_parameters, mu));
  PetscCall(PredictionFields(m, &solution, &rid));
  HycoFinally(HycoSolutionAdd(file, &solution), PetscCall(PetscFree(rid)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every point is checked before the first is predicted: the file would be removed at the first wrong one, after
   all work before it. */
PetscErrorCode HycoROMWriteMany(HycoROM m, PetscInt n, PetscInt n_parameters, const PetscReal mu[], const char path[])
{
  HycoFieldFile file;
  PetscErrorCode ierr = 0;

  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  HycoCheckGiven(path);
  HycoCheck(!m->model->scene->n_times, "HycoROMWriteMany: the scene has a history; HycoROMWrite() writes a path");
  PetscCall(HycoROMCheckPoints(m, n, n_parameters, mu));
  PetscCall(HycoFieldFileCreate(PETSC_COMM_SELF, path, n, PETSC_TRUE, &file));
  for (PetscInt k = 0; k < n && !ierr; k++) ierr = WritePoint(m, mu + k * n_parameters, file);
  /* Destroyed without it, the file is removed: it is complete or absent. */
  if (!ierr && n) ierr = HycoFieldFileCommit(file);
  PetscCall(HycoFieldFileDestroy(&file));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What a user needs to judge a model without its scene: type, training, errors, provenance, and the scene as it
   was. */
PetscErrorCode HycoROMView(HycoROM m, PetscViewer viewer)
{
  PetscInt pod;

  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  if (!viewer) PetscCall(PetscViewerASCIIGetStdout(HycoComm(m), &viewer));
  pod = HycoROMCountPOD(m);
  PetscCall(PetscViewerASCIIPrintf(viewer, "%s model\n", m->model->traits.title));
  /* Models of bodies take no solutions: there is no training error. */
  if (m->model->numbers[1] < 0)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  trained without solutions, for the region of %d points\n",
                                     (int)m->model->n_points));
  else
    PetscCall(PetscViewerASCIIPrintf(viewer, "  trained on %d points; mean training errors: u %.2e, %sforces %.2e\n",
                                     (int)m->model->n_points, (double)m->model->numbers[1],
                                     m->model->traits.settings == HYCO_SETTINGS_RID ? "RID " : "",
                                     (double)m->model->numbers[2]));
  if (m->model->scene->n_times)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  paths: %d listed times from t = %g to %g%s\n",
                                     (int)m->model->scene->n_times, (double)m->model->scene->times[0],
                                     (double)m->model->scene->times[m->model->scene->n_times - 1],
                                     m->model->traits.stiffness ? ", solved step by step" : ""));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  displacement modes: %d (first singular value %.4g, last %.4g)\n",
                                   (int)pod, pod ? (double)m->model->sigma[0] : 0.,
                                   pod ? (double)m->model->sigma[pod - 1] : 0.));
  PetscTryTypeMethod(m, view, viewer);
  PetscCall(HycoEstimatesView(m, viewer));
  PetscCall(PetscViewerASCIIPrintf(viewer, "%s", m->model->provenance));
  PetscCall(HycoSceneView(m->model->scene, viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}
