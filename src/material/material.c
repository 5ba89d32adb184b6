/* HycoMaterial: the class of material laws, its registry, and tangents at integration points. */
#include <hycomaterialimpl.h>
#include <hycoregistry.h>

static PetscErrorCode AddOwn(void);
static HycoRegistry laws = {.add_own = AddOwn, .sorted = PETSC_TRUE};

static PetscErrorCode AddOwn(void)
{
  PetscFunctionBegin;
  PetscCall(HycoRegistryAdd(&laws, HYCO_MATERIAL_ELASTIC, HycoMaterialCreate_Elastic));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMaterialRegister(const char name[], PetscErrorCode (*create)(HycoMaterial))
{
  PetscFunctionBegin;
  PetscCall(HycoRegistryAdd(&laws, name, create));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMaterialCreate(MPI_Comm comm, HycoMaterial *material)
{
  PetscFunctionBegin;
  PetscCall(HycoInitializePackage());
  PetscCall(PetscHeaderCreate(*material, HYCO_MATERIAL_CLASSID, "HycoMaterial", "Material law", "Hyco", comm,
                              HycoMaterialDestroy, HycoMaterialView));
  (*material)->linear = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMaterialDestroy(HycoMaterial *material)
{
  PetscFunctionBegin;
  if (!material || !*material) PetscFunctionReturn(PETSC_SUCCESS);
  HycoCheckHandle(*material, HYCO_MATERIAL_CLASSID);
  HycoDereference(material);
  if ((*material)->ops->destroy) PetscCall((*(*material)->ops->destroy)(*material));
  PetscCall(HycoDeclaredDestroy(&(*material)->constants));
  PetscCall(PetscHeaderDestroy(material));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMaterialSetType(HycoMaterial material, HycoMaterialType type)
{
  PetscErrorCode (*create)(HycoMaterial);

  PetscFunctionBegin;
  HycoCheckHandle(material, HYCO_MATERIAL_CLASSID);
  PetscCall(HycoRegistryFind(&laws, type, &create));
  if (!create) {
    char list[HYCO_LINE];

    PetscCall(HycoRegistryList(&laws, type, list));
    HycoFail("body %s: the law \"%s\" is not registered; it must be %s",
             ((PetscObject)material)->name ? ((PetscObject)material)->name : "(none)", type, list);
  }
  PetscCall(PetscObjectChangeTypeName((PetscObject)material, type));
  PetscCall((*create)(material));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMaterialGetType(HycoMaterial material, HycoMaterialType *type)
{
  PetscFunctionBegin;
  HycoCheckHandle(material, HYCO_MATERIAL_CLASSID);
  *type = ((PetscObject)material)->type_name;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMaterialView(HycoMaterial material, PetscViewer viewer)
{
  PetscBool ascii;

  PetscFunctionBegin;
  HycoCheckHandle(material, HYCO_MATERIAL_CLASSID);
  PetscCall(HycoViewBegin((PetscObject)material, &viewer, &ascii));
  if (!ascii) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoDeclaredView(&material->constants, viewer));
  PetscCall(PetscViewerASCIIPrintf(viewer, "%s, %d state variables\n", material->linear ? "linear" : "nonlinear",
                                   (int)material->n_state));
  PetscCall(PetscViewerASCIIPopTab(viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMaterialDeclare(HycoMaterial material, const char name[], const char title[], PetscReal initial,
                                   PetscReal lo, PetscReal hi)
{
  HycoEntry *entry;

  PetscFunctionBegin;
  HycoCheckHandle(material, HYCO_MATERIAL_CLASSID);
  PetscCall(HycoDeclaredAdd(&material->constants, name, title, HYCO_ENTRY_EXPRESSION,
                            (PetscBool)(initial >= HYCO_REQUIRED), &entry));
  entry->value = initial;
  entry->lo = lo;
  entry->hi = hi;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMaterialSetOps(HycoMaterial material, const struct _HycoMaterialOps *ops)
{
  PetscFunctionBegin;
  HycoCheckHandle(material, HYCO_MATERIAL_CLASSID);
  PetscCheck(ops->update || ops->isotropic, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONGSTATE,
             "the law %s sets neither update nor isotropic", ((PetscObject)material)->type_name);
  *material->ops = *ops;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMaterialSetStateSize(HycoMaterial material, PetscInt n_state)
{
  PetscFunctionBegin;
  HycoCheckHandle(material, HYCO_MATERIAL_CLASSID);
  material->n_state = n_state;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMaterialSetLinear(HycoMaterial material, PetscBool linear)
{
  PetscFunctionBegin;
  HycoCheckHandle(material, HYCO_MATERIAL_CLASSID);
  material->linear = linear;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMaterialSetData(HycoMaterial material, void *data)
{
  PetscFunctionBegin;
  HycoCheckHandle(material, HYCO_MATERIAL_CLASSID);
  material->data = data;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMaterialGetData(HycoMaterial material, void *data)
{
  PetscFunctionBegin;
  HycoCheckHandle(material, HYCO_MATERIAL_CLASSID);
  *(void **)data = material->data;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMaterialSetUp(HycoMaterial material, PetscInt dim)
{
  PetscFunctionBegin;
  if (material->ops->setup) PetscCall((*material->ops->setup)(material, dim));
  HycoCheck(material->linear && !material->n_state,
            "body %s: its law %s is not linear; the library solves scenes of linear laws",
            ((PetscObject)material)->name, ((PetscObject)material)->type_name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool HycoMaterialChanges(HycoMaterial material, const PetscBool changed[])
{
  PetscBool constant[HYCO_MAX_DECLARED], any = PETSC_FALSE;

  for (PetscInt j = 0; j < material->constants.n; j++) {
    constant[j] = HycoExprChanges(material->constants.entry[j].expr, changed);
    any = (PetscBool)(any || constant[j]);
  }
  return any && material->ops->depends ? (*material->ops->depends)(material, constant) : any;
}

PetscInt HycoMaterialTangentSize(HycoMaterial material, PetscInt dim)
{
  return material->ops->isotropic ? 2 : HycoStrainSize(dim) * HycoStrainSize(dim);
}

void HycoTangentApply(PetscBool isotropic, PetscInt dim, const PetscReal tangent[], const PetscReal strain[],
                      PetscReal stress[])
{
  const PetscInt n = HycoStrainSize(dim);

  if (isotropic && dim == 1) {
    stress[0] = tangent[1] * strain[0];
  } else if (isotropic) {
    const PetscReal volume = tangent[0] * (strain[0] + strain[1] + strain[2]);

    for (PetscInt c = 0; c < n; c++) stress[c] = c < 3 ? volume + 2 * tangent[1] * strain[c] : tangent[1] * strain[c];
  } else {
    for (PetscInt r = 0; r < n; r++) {
      stress[r] = 0;
      for (PetscInt c = 0; c < n; c++) stress[r] += tangent[r * n + c] * strain[c];
    }
  }
}

PetscErrorCode HycoMaterialUpdate(HycoMaterial material, HycoMaterialPoints *p)
{
  const PetscInt ns = p->n_strain;
  PetscReal *lame;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  HycoCheckHandle(material, HYCO_MATERIAL_CLASSID);
  p->dt_factor = 1;
  p->failed = -1;
  if (!material->ops->isotropic) {
    PetscCall((*material->ops->update)(material, p));
    for (PetscInt i = 0; material->linear && p->stress && i < p->n; i++)
      HycoTangentApply(PETSC_FALSE, p->dim, p->tangent + i * ns * ns, p->strain + i * ns, p->stress + i * ns);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc1(2 * p->n, &lame));
  ierr = (*material->ops->isotropic)(material, p, lame);
  for (PetscInt i = 0; i < p->n && !ierr; i++) {
    if (p->stress) HycoTangentApply(PETSC_TRUE, p->dim, lame + 2 * i, p->strain + i * ns, p->stress + i * ns);
    for (PetscInt c = 0; p->tangent && c < ns; c++) { /* its columns: stresses of unit strains */
      PetscReal unit[6] = {0, 0, 0, 0, 0, 0}, column[6];

      unit[c] = 1;
      HycoTangentApply(PETSC_TRUE, p->dim, lame + 2 * i, unit, column);
      for (PetscInt r = 0; r < ns; r++) p->tangent[(i * ns + r) * ns + c] = column[r];
    }
  }
  PetscCall(PetscFree(lame));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fails where a constant leaves its interval. */
static PetscErrorCode CheckConstant(const HycoEntry *e, const PetscReal mu[], PetscInt n, const PetscReal x[],
                                    const PetscReal value[])
{
  PetscFunctionBegin;
  for (PetscInt i = 0; i < n; i++) {
    char place[HYCO_LINE];

    if (value[i] > e->lo && value[i] < e->hi) continue;
    PetscCall(HycoExprPlace(e->expr, mu, x + 3 * i, place));
    if (e->lo == 0 && e->hi >= PETSC_INFINITY)
      HycoFail("%s is %g at %s; %s must be positive", HycoExprKey(e->expr), (double)value[i], place, e->title);
    HycoFail("%s is %g at %s; %s must lie between %g and %g", HycoExprKey(e->expr), (double)value[i], place, e->title,
             (double)e->lo, (double)e->hi);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the part of a tangent that strains in the mesh's dimensions see (2D: without zz) is symmetric and positive
   definite, by Cholesky. */
static PetscBool IsDefinite(PetscInt dim, const PetscReal C[])
{
  static const PetscInt seen[3][6] = {{0}, {0, 1, 3}, {0, 1, 2, 3, 4, 5}};
  const PetscInt n = HycoStrainSize(dim), m = dim * (dim + 1) / 2;
  PetscReal L[6][6];

  for (PetscInt r = 0; r < m; r++) {
    for (PetscInt c = 0; c <= r; c++) {
      const PetscInt i = seen[dim - 1][r], j = seen[dim - 1][c];
      PetscReal sum = C[i * n + j];

      if (!(PetscAbsReal(sum - C[j * n + i]) <= 1e-12 * (PetscAbsReal(C[i * n + i]) + PetscAbsReal(C[j * n + j]))))
        return PETSC_FALSE;
      for (PetscInt k = 0; k < c; k++) sum -= L[r][k] * L[c][k];
      if (r == c && !(sum > 1e-14 * C[i * n + i] && sum < PETSC_INFINITY)) return PETSC_FALSE;
      L[r][c] = r == c ? PetscSqrtReal(sum) : sum / L[c][c];
    }
  }
  return PETSC_TRUE;
}

PetscErrorCode HycoMaterialTangents(HycoMaterial material, PetscInt dim, const PetscReal mu[], PetscInt n,
                                    const PetscReal x[], PetscReal work[], PetscReal tangent[])
{
  const HycoDeclared *d = &material->constants;
  const PetscReal *constant[HYCO_MAX_DECLARED];
  HycoMaterialPoints p = {.n = n, .dim = dim, .n_strain = HycoStrainSize(dim), .constant = constant, .failed = -1};

  PetscFunctionBegin;
  for (PetscInt j = 0; j < d->n; j++) {
    PetscReal *value = work + j * n;

    constant[j] = value;
    for (PetscInt i = 0; i < n; i++) value[i] = d->entry[j].value;
    if (!d->entry[j].expr) continue;
    PetscCall(HycoExprEval(d->entry[j].expr, mu, n, x, value));
    PetscCall(CheckConstant(&d->entry[j], mu, n, x, value));
  }
  p.tangent = tangent;
  if (material->ops->isotropic)
    PetscCall((*material->ops->isotropic)(material, &p, tangent));
  else
    PetscCall(HycoMaterialUpdate(material, &p));
  for (PetscInt i = 0; i < n && p.failed < 0 && !material->ops->isotropic; i++) {
    if (IsDefinite(dim, tangent + i * p.n_strain * p.n_strain)) continue;
    p.failed = i;
    p.why = "the tangent is not symmetric and positive definite";
  }
  HycoCheck(p.failed < 0, "body %s, law %s: %s at x = %g, y = %g, z = %g", ((PetscObject)material)->name,
            ((PetscObject)material)->type_name, p.why ? p.why : "no answer", (double)x[3 * p.failed],
            (double)x[3 * p.failed + 1], (double)x[3 * p.failed + 2]);
  PetscFunctionReturn(PETSC_SUCCESS);
}
