/* Models of bodies that flow: private to the export. */
#ifndef HYCOEXPORTFLOW_H
#define HYCOEXPORTFLOW_H

#include "../../src/rom/impls/bodies/bodies_path.h"
#include "export.h"

/* An integration point of the model's mesh, or (output) of the cells of its outputs; B: n_strain x n, its strain by the
   displacements of its cell; the share of its stresses in their mean. */
typedef struct {
  PetscBool output;
  PetscInt cell, q;
  PetscReal *B, share;
} FlowPoint;
/* Chosen points, the others of their cells, those of outputs. */
typedef struct {
  HycoROM m;
  HycoBodiesPath path;
  HycoFE outputs; /* borrowed; NULL: no output has cells */
  PetscInt n_modes, n_points, n_settled;
  FlowPoint *point;
} * HycoFlows;
/* After a prediction; *flows NULL: all bodies are elastic. Fails with what cannot be exported. Adds points and laws to
   out. */
PetscErrorCode HycoFlowsCreate(HycoROM m, HycoExportModel *out, HycoFlows *flows);
PetscErrorCode HycoFlowsDestroy(HycoFlows *flows);
/* Component `row` of the points' strains at the last state. */
PetscReal HycoFlowsStrain(HycoFlows flows, PetscInt row);
/* What a value loses by the inelastic strains: of the mean stresses of a cell of outputs, in which component c has the
   coefficient by[c]; of quantity k of the scene. */
PetscErrorCode HycoFlowsLoseStress(HycoFlows flows, PetscInt value, PetscInt cell, const PetscReal by[6],
                                   HycoExportModel *out);
PetscErrorCode HycoFlowsLoseQuantity(HycoFlows flows, PetscInt value, PetscInt k, HycoExportModel *out);
#endif
