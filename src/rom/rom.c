/* HycoROM: creation, access, destruction. */
#include <hycofields.h>
#include <hycogradient.h>
#include <hycoromimpl.h>
#include <hycoromtypes.h>
#include <petscviewer.h>
#include <stdio.h>
#include <string.h>

/* A handle without a model. */
static PetscErrorCode CreateHandle(HycoROM *rom)
{
  PetscFunctionBegin;
  PetscCall(HycoPackageCheck());
  PetscCall(PetscHeaderCreate(*rom, HYCO_ROM_CLASSID, "HycoROM", "Reduced model", "Hyco", PETSC_COMM_SELF,
                              HycoROMDestroy, HycoROMView));
  (*rom)->reconstruct = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An empty model to be filled by a training or a file. The one reference is the handle's. */
PetscErrorCode HycoROMCreate(HycoROM *rom)
{
  PetscFunctionBegin;
  PetscCall(CreateHandle(rom));
  PetscCall(PetscNew(&(*rom)->model));
  (*rom)->model->references = 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The model is shared and counted; work, fields and solver are the clone's own, made at its first prediction. */
PetscErrorCode HycoROMClone(HycoROM m, HycoROM *clone)
{
  HycoROM c;

  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  HycoCheckGiven(clone);
  PetscCall(CreateHandle(&c));
  c->model = m->model;
  /* Counted without a lock: clones are for one thread or rank each, as PETSc's objects are. */
  c->model->references++;
  *c->ops = *m->ops;
  PetscCall(HycoOptionsInherit((PetscObject)c, (PetscObject)m));
  c->full_order = m->full_order;
  c->full_displacement = m->full_displacement;
  c->wants_equilibrium = m->wants_equilibrium;
  c->reconstruct = m->reconstruct;
  *clone = c;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Those of predict are declared for its help alone; -hyco_reconstruct concerns trainings too, whose judgement
   predicts. */
PetscErrorCode HycoROMSetFromOptions(HycoROM m)
{
  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  PetscObjectOptionsBegin((PetscObject)m);
  PetscCall(HycoOptionsFor("predict"));
  PetscCall(HycoOptionsBool(
      "-hyco_fallback",
      "predict solves full order on -scene if the reduced solve fails or an estimated error is above its -target_...",
      &m->full_order, NULL));
  PetscCall(HycoOptionsBool("-hyco_full_displacement",
                            "predict, bodies: compute displacements and stresses by one full-order solve on -scene "
                            "with the predicted forces",
                            &m->full_displacement, NULL));
  PetscCall(
      HycoOptionsBool("-hyco_residual",
                      "predict, paths: compute the residual of equilibrium on the whole mesh, by a replay of the laws",
                      &m->wants_equilibrium, NULL));
  PetscCall(HycoOptionsFor(""));
  PetscCall(HycoOptionsBool("-hyco_reconstruct", "reconstruct the contact forces outside the RID by (41)",
                            &m->reconstruct, NULL));
  PetscCall(HycoOptionsName("-hyco_rom_view", "describe a model when it is loaded"));
  PetscOptionsEnd();
  PetscTryTypeMethod(m, options);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Declares its options and those of all types. */
static PetscErrorCode DeclareAll(HycoROM m)
{
  const char *const *types;

  PetscFunctionBegin;
  PetscCall(HycoROMSetFromOptions(m));
  PetscCall(HycoROMTypeNames(&types));
  for (PetscInt k = 0; types[k]; k++) {
    HycoROM each;

    PetscCall(HycoROMCreate(&each));
    PetscCall(PetscObjectSetOptions((PetscObject)each, ((PetscObject)m)->options));
    PetscCall(HycoROMSetType(each, types[k]));
    HycoFinally(each->ops->options ? (*each->ops->options)(each) : PETSC_SUCCESS, PetscCall(HycoROMDestroy(&each)));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoROMDeclare(PetscOptions options)
{
  HycoROM m;

  PetscFunctionBegin;
  PetscCall(HycoROMCreate(&m));
  HycoDeclare(m, options, DeclareAll, HycoROMDestroy);
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoROMGetFallback, (HycoROM m, PetscBool *full_order, PetscBool *displacement), m, HYCO_ROM_CLASSID,
                 HycoCheckGiven(full_order);
                 HycoCheckGiven(displacement); *full_order = m->full_order; *displacement = m->full_displacement)

HycoDefineMethod(HycoROMWantsEquilibrium, (HycoROM m, PetscBool *wants), m, HYCO_ROM_CLASSID, HycoCheckGiven(wants);
                 *wants = m->wants_equilibrium)

/* The last handle frees the model. */
static PetscErrorCode DestroyModel(HycoROM rom)
{
  HycoModel m = rom->model;

  PetscFunctionBegin;
  if (--m->references) PetscFunctionReturn(PETSC_SUCCESS);
  /* The type first: its data may refer to mesh and scene. */
  PetscTryTypeMethod(rom, destroy);
  PetscCall(HycoFloatingDestroy(&m->floating));
  PetscCall(HycoPairsDestroy(&m->whole_pairs));
  PetscCall(HycoMeshDestroy(&m->whole));
  PetscCall(HycoPairsDestroy(&m->pairs));
  PetscCall(HycoMeshDestroy(&m->mesh));
  HycoDestroyAll(&m->scene, &m->rid, &m->inside);
  HycoFreeAll(&m->master_reach, &m->facet, &m->in_rid, &m->closed, &m->V, &m->V_whole, &m->sigma, &m->fe_dof,
              &m->points, &m->stops, &m->reach, &m->provenance, &m->search, &rom->model);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The type's destroy op is called for the last handle alone, before the ops go with the header. */
PetscErrorCode HycoROMDestroy(HycoROM *model)
{
  PetscFunctionBegin;
  HycoDestroyBegin(model, HYCO_ROM_CLASSID);
  PetscCall(HycoROMReset(*model));
  PetscCall(HycoBalanceDestroy(&(*model)->balance));
  PetscCall(HycoGradientDestroy(&(*model)->gradient));
  PetscCall(HycoROMFreeWhole(*model));
  PetscCall(DestroyModel(*model));
  PetscCall(PetscHeaderDestroy(model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoROMGetType, (HycoROM m, HycoROMType *type), m, HYCO_ROM_CLASSID, HycoCheckGiven(type);
                 *type = m->model->type)
HycoDefineMethod(HycoROMGivesForces, (HycoROM m, PetscBool *gives), m, HYCO_ROM_CLASSID, HycoCheckGiven(gives);
                 *gives = m->model->traits.forces)

PetscErrorCode HycoROMGetDimensions(HycoROM m, PetscInt *n_modes, PetscInt *n_contacts)
{
  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  if (n_modes) *n_modes = m->model->l;
  if (n_contacts) *n_contacts = m->model->pairs.n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The nodes in at least `least` sets; sets NULL: all. */
static PetscErrorCode CreateNodes(PetscInt n, const PetscInt sets[], PetscInt least, IS *nodes)
{
  PetscInt count = 0, *list;

  PetscFunctionBegin;
  PetscCall(ISDestroy(nodes));
  PetscCall(PetscMalloc1(n, &list));
  for (PetscInt i = 0; i < n; i++) {
    /* sets: 0 outside, 1 on the interface, 2 in A. */
    if (!sets || sets[i] >= least) list[count++] = i;
  }
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, count, list, PETSC_COPY_VALUES, nodes));
  PetscCall(PetscFree(list));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* sets[node]: 1 on the interface, 2 inside A, 0 elsewhere. As two IS, which is what reduced systems are made of.
   */
PetscErrorCode HycoROMSetDomain(HycoROM m, const PetscInt sets[])
{
  PetscFunctionBegin;
  PetscCall(CreateNodes(m->model->mesh->n_nodes, sets, 1, &m->model->rid));
  PetscCall(CreateNodes(m->model->mesh->n_nodes, sets, 2, &m->model->inside));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The inverse of HycoROMSetDomain(), for files. */
PetscErrorCode HycoROMGetDomain(HycoROM m, PetscInt sets[])
{
  const IS each[2] = {m->model->rid, m->model->inside};

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(sets, m->model->mesh->n_nodes));
  for (PetscInt s = 0; s < 2; s++) {
    const PetscInt *node;
    PetscInt n;

    PetscCall(ISGetLocalSize(each[s], &n));
    PetscCall(ISGetIndices(each[s], &node));
    /* A is a part of the RID: its nodes are counted twice. */
    for (PetscInt k = 0; k < n; k++) sets[node[k]]++;
    PetscCall(ISRestoreIndices(each[s], &node));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The number of unknowns changes: online data are made again. Ascending order is that of the file and of searches. */
PetscErrorCode HycoROMSetFE(HycoROM m, HycoHybrid hybrid, PetscInt n, const PetscInt dof[])
{
  PetscFunctionBegin;
  PetscCall(HycoROMReset(m));
  PetscCall(PetscFree(m->model->fe_dof));
  HycoDuplicate(n, dof, &m->model->fe_dof);
  PetscCall(PetscSortInt(n, m->model->fe_dof));
  m->model->n_fe = n;
  m->model->hybrid = hybrid;
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoROMGetScene, (HycoROM m, HycoScene *scene), m, HYCO_ROM_CLASSID, HycoCheckGiven(scene);
                 *scene = m->model->scene)

/* The history first, whose message says what differs; the fingerprint covers all else. */
PetscErrorCode HycoROMCheckScene(HycoROM m, HycoScene scene)
{
  unsigned long long hash;
  char text[32], *history;

  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  HycoCheckHandle(scene, HYCO_SCENE_CLASSID);
  PetscCall(HycoSceneFingerprint(scene, &hash));
  snprintf(text, sizeof(text), "%016llx", hash);
  PetscCall(HycoSceneWriteHistory(m->model->scene, &history));
  HycoFinally(HycoSceneCompareHistory(scene, history, m->model->path), PetscCall(PetscFree(history)));
  HycoCheck(strcmp(text, m->model->fingerprint) == 0,
            "%s was trained on another scene or mesh; give the scene, the mesh and the entries of its training",
            m->model->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoROMSetReconstruct, (HycoROM m, PetscBool reconstruct), m, HYCO_ROM_CLASSID,
                 m->reconstruct = reconstruct)
HycoDefineMethod(HycoROMSetPointMonitor, (HycoROM m, HycoPointMonitor monitor, void *ctx), m, HYCO_ROM_CLASSID,
                 m->point_monitor = monitor;
                 m->point_ctx = ctx)
HycoDefineMethod(HycoROMSetExtrapolate, (HycoROM m, PetscBool extrapolate), m, HYCO_ROM_CLASSID,
                 PetscCall(HycoSceneSetExtrapolate(m->model->scene, extrapolate)))

/* The solver exists after set-up only. */
PetscErrorCode HycoROMSetMonitor(HycoROM m, HycoMonitor monitor, void *ctx)
{
  PetscFunctionBegin;
  HycoCheckHandle(m, HYCO_ROM_CLASSID);
  PetscCall(HycoROMSetUp(m));
  PetscCall(HycoSolverSetMonitor(m->solver, monitor, ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Modes that were added to the POD's (supremizers, for instance) come last and have no singular value. */
PetscInt HycoROMCountPOD(HycoROM m)
{
  PetscInt l = m->model->l;

  while (l > 0 && !(m->model->sigma[l - 1] > 0)) l--;
  return l;
}

HycoDefineViewFromOptions(HycoROM, HYCO_ROM_CLASSID)
