/* HycoCone: the class of contact laws by projection, its registry, and the forces that are only nonnegative. */
#include <hycoconeimpl.h>
#include <hycoregistry.h>

static HycoRegistry cones = {.sorted = PETSC_TRUE};

HycoDefineRegister(HycoConeRegister, cones, PetscErrorCode (*create)(HycoCone))

/* Size 1 until it is set. */
PetscErrorCode HycoConeCreate(MPI_Comm comm, HycoCone *cone)
{
  PetscFunctionBegin;
  HycoCheckGiven(cone);
  PetscCall(HycoPackageCheck());
  PetscCall(PetscHeaderCreate(*cone, HYCO_CONE_CLASSID, "HycoCone", "Admissible contact forces", "Hyco", comm,
                              HycoConeDestroy, HycoConeView));
  (*cone)->size = 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* NULL-safe; one reference, as of any PETSc object. */
PetscErrorCode HycoConeDestroy(HycoCone *cone)
{
  PetscFunctionBegin;
  HycoDestroyBegin(cone, HYCO_CONE_CLASSID);
  if ((*cone)->ops->destroy) PetscCall((*(*cone)->ops->destroy)(*cone));
  PetscCall(PetscHeaderDestroy(cone));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Before the type, whose constructor may depend on it. The first component of a block is along the normal. */
PetscErrorCode HycoConeSetSize(HycoCone cone, PetscInt size)
{
  PetscFunctionBegin;
  HycoCheckHandle(cone, HYCO_CONE_CLASSID);
  PetscCheck(!((PetscObject)cone)->type_name, PETSC_COMM_SELF, PETSC_ERR_ORDER,
             "call HycoConeSetSize() before HycoConeSetType()");
  HycoCheck(size >= 1 && size <= HYCO_MAX_BLOCK, "a block of %d components; it must have 1 to %d", (int)size,
            HYCO_MAX_BLOCK);
  cone->size = size;
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoConeGetSize, (HycoCone cone, PetscInt *size), cone, HYCO_CONE_CLASSID, HycoCheckGiven(size);
                 *size = cone->size)

/* Once for each cone: data and size of blocks that were made with it would no longer fit. */
PetscErrorCode HycoConeSetType(HycoCone cone, HycoConeType type)
{
  PetscErrorCode (*create)(HycoCone);

  PetscFunctionBegin;
  HycoCheckHandle(cone, HYCO_CONE_CLASSID);
  HycoCheckGiven(type);
  PetscCheck(!((PetscObject)cone)->type_name, PETSC_COMM_SELF, PETSC_ERR_ORDER,
             "the cone has the type %s already; create another one", ((PetscObject)cone)->type_name);
  PetscCall(HycoRegistryFind(&cones, type, &create));
  if (!create) {
    char list[HYCO_LINE];

    PetscCall(HycoRegistryList(&cones, type, list));
    HycoFail("the cone \"%s\" is unknown; it must be %s", type, list);
  }
  PetscCall(PetscObjectChangeTypeName((PetscObject)cone, type));
  PetscCall((*create)(cone));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoConeGetType, (HycoCone cone, HycoConeType *type), cone, HYCO_CONE_CLASSID, HycoCheckGiven(type);
                 *type = ((PetscObject)cone)->type_name)

/* n_data: reals of each block, such as a coefficient of friction. For constructors of types. */
PetscErrorCode HycoConeSetOps(HycoCone cone, const struct _HycoConeOps *ops, PetscInt n_data)
{
  PetscFunctionBegin;
  HycoCheckHandle(cone, HYCO_CONE_CLASSID);
  HycoCheckGiven(ops);
  PetscCheck(ops->project && ops->derivative, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONGSTATE,
             "the cone %s must set project and derivative", ((PetscObject)cone)->type_name);
  PetscCheck(n_data >= 0, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE, "%d data of a block; it must be 0 or more",
             (int)n_data);
  *cone->ops = *ops;
  cone->n_data = n_data;
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineMethod(HycoConeSetData, (HycoCone cone, void *data), cone, HYCO_CONE_CLASSID, cone->data = data)
HycoDefineMethod(HycoConeGetData, (HycoCone cone, void *data), cone, HYCO_CONE_CLASSID, HycoCheckGiven(data);
                 *(void **)data = cone->data)

/* Collective on the viewer. */
PetscErrorCode HycoConeView(HycoCone cone, PetscViewer viewer)
{
  PetscFunctionBegin;
  HycoViewBegin(cone, HYCO_CONE_CLASSID, viewer);
  PetscCall(
      PetscViewerASCIIPrintf(viewer, "blocks of %d components and %d data\n", (int)cone->size, (int)cone->n_data));
  PetscCall(PetscViewerASCIIPopTab(viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

HycoDefineViewFromOptions(HycoCone, HYCO_CONE_CLASSID)

/* -- each component is nonnegative -- */

/* The nearest point of the orthant. */
static PetscErrorCode ConeProject(HycoCone cone, const PetscReal data[], const PetscReal y[], PetscReal z[])
{
  PetscFunctionBegin;
  (void)data;
  for (PetscInt i = 0; i < cone->size; i++) z[i] = y[i] < 0 ? 0 : y[i]; /* keeps NaN */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At 0 the derivative of the open side: the contact counts as open. */
static PetscErrorCode ConeDerivative(HycoCone cone, const PetscReal data[], const PetscReal y[], PetscReal J[])
{
  PetscFunctionBegin;
  (void)data;
  PetscCall(PetscArrayzero(J, cone->size * cone->size));
  for (PetscInt i = 0; i < cone->size; i++) J[i * cone->size + i] = y[i] > 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The flag lets blocks that are all of this kind be treated as none, by the active set and TAO. */
PetscErrorCode HycoConeCreate_Nonnegative(HycoCone cone)
{
  const struct _HycoConeOps ops = {.project = ConeProject, .derivative = ConeDerivative};

  PetscFunctionBegin;
  PetscCall(HycoConeSetOps(cone, &ops, 0));
  cone->nonnegative = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}
