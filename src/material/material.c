/* HycoMaterial: the class of material laws, its registry, and tangents at integration points. */
#include <hycomaterialimpl.h>
#include <hycoregistry.h>

/* Sorted by name: extensions register in any order, and messages list all laws. */
static HycoRegistry laws = {.sorted = PETSC_TRUE};

HycoDefineRegister(HycoMaterialRegister, laws, PetscErrorCode (*create)(HycoMaterial))

/* Linear until a law says otherwise. */
PetscErrorCode HycoMaterialCreate(MPI_Comm comm, HycoMaterial *material)
{
  PetscFunctionBegin;
  HycoCheckGiven(material);
  PetscCall(HycoPackageCheck());
  PetscCall(PetscHeaderCreate(*material, HYCO_MATERIAL_CLASSID, "HycoMaterial", "Material law", "Hyco", comm,
                              HycoMaterialDestroy, HycoMaterialView));
  (*material)->linear = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The law's destroy comes first, while its data and constants still exist. */
PetscErrorCode HycoMaterialDestroy(HycoMaterial *material)
{
  PetscFunctionBegin;
  HycoDestroyBegin(material, HYCO_MATERIAL_CLASSID);
  if ((*material)->ops->destroy) PetscCall((*(*material)->ops->destroy)(*material));
  PetscCall(HycoMaterialSetStateSize(*material, 0));
  PetscCall(HycoDeclaredDestroy(&(*material)->constants));
  PetscCall(PetscHeaderDestroy(material));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The type's constructor declares its constants, which the scene then reads. */
PetscErrorCode HycoMaterialSetType(HycoMaterial material, HycoMaterialType type)
{
  PetscErrorCode (*create)(HycoMaterial);

  PetscFunctionBegin;
  HycoCheckHandle(material, HYCO_MATERIAL_CLASSID);
  HycoCheckGiven(type);
  PetscCall(HycoRegistryFind(&laws, type, &create));
  if (!create) {
    char list[HYCO_LINE];

    PetscCall(HycoRegistryList(&laws, type, list));
    HycoFail("body %s: the law \"%s\" is unknown; it must be %s",
             ((PetscObject)material)->name ? ((PetscObject)material)->name : "(none)", type, list);
  }
  /* Before the constructor, whose checks name the law. */
  PetscCall(PetscObjectChangeTypeName((PetscObject)material, type));
  PetscCall((*create)(material));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The registered name. For reports and models only: no code decides by it, properties of a law are traits. */
PetscErrorCode HycoMaterialGetType(HycoMaterial material, HycoMaterialType *type)
{
  PetscFunctionBegin;
  HycoCheckHandle(material, HYCO_MATERIAL_CLASSID);
  HycoCheckGiven(type);
  *type = ((PetscObject)material)->type_name;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMaterialView(HycoMaterial material, PetscViewer viewer)
{
  PetscFunctionBegin;
  HycoViewBegin(material, HYCO_MATERIAL_CLASSID, viewer);
  PetscCall(HycoDeclaredView(&material->constants, viewer));
  PetscCall(PetscViewerASCIIPrintf(viewer, "%s, %d state variables\n", material->linear ? "linear" : "nonlinear",
                                   (int)material->n_state));
  PetscCall(PetscViewerASCIIPopTab(viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* initial: the default (HYCO_REQUIRED: none); values must lie inside (lo, hi), ends excluded. Constants may depend
   on the temperature. */
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
  entry->heat = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A required text, such as the name of a library; it is no expression and has no value at points. */
PetscErrorCode HycoMaterialDeclareText(HycoMaterial material, const char name[], const char title[])
{
  HycoEntry *entry;

  PetscFunctionBegin;
  HycoCheckHandle(material, HYCO_MATERIAL_CLASSID);
  PetscCall(HycoDeclaredAdd(&material->constants, name, title, HYCO_ENTRY_GROUP, PETSC_TRUE, &entry));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Borrowed from the scene's entry; NULL before the scene is read. */
PetscErrorCode HycoMaterialGetText(HycoMaterial material, const char name[], const char **text)
{
  const HycoEntry *entry;

  PetscFunctionBegin;
  HycoCheckHandle(material, HYCO_MATERIAL_CLASSID);
  HycoCheckGiven(name);
  HycoCheckGiven(text);
  entry = HycoDeclaredFind(&material->constants, name);
  *text = entry ? entry->text : NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* update for laws with a history or any tangent, isotropic for those whose elastic part is Lame's: at least one is
   needed to have a stiffness. */
PetscErrorCode HycoMaterialSetOps(HycoMaterial material, const struct _HycoMaterialOps *ops)
{
  PetscFunctionBegin;
  HycoCheckHandle(material, HYCO_MATERIAL_CLASSID);
  HycoCheckGiven(ops);
  PetscCheck(ops->update || ops->isotropic, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONGSTATE,
             "the law %s sets neither update nor isotropic", ((PetscObject)material)->type_name);
  *material->ops = *ops;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* States without names: a law that nobody reads variable by variable needs their number alone. The states of a
   point are consecutive reals, 0 at the first time. */
PetscErrorCode HycoMaterialSetStateSize(HycoMaterial material, PetscInt n_state)
{
  PetscFunctionBegin;
  HycoCheckHandle(material, HYCO_MATERIAL_CLASSID);
  PetscCall(HycoMaterialSetStateNames(material, n_state, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* names (n_state) are copied; NULL: unnamed variables. */
PetscErrorCode HycoMaterialSetStateNames(HycoMaterial material, PetscInt n_state, const char *const names[])
{
  PetscFunctionBegin;
  HycoCheckHandle(material, HYCO_MATERIAL_CLASSID);
  for (PetscInt k = 0; material->state_name && k < material->n_state; k++)
    PetscCall(PetscFree(material->state_name[k]));
  PetscCall(PetscFree(material->state_name));
  /* Also without names: the number is what the history's storage depends on. */
  material->n_state = n_state;
  if (!n_state || !names) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc1(n_state, &material->state_name));
  for (PetscInt k = 0; k < n_state; k++) PetscCall(PetscStrallocpy(names[k], &material->state_name[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The scene then demands a temperature for each body of this law, even if no constant depends on it. */
PetscErrorCode HycoMaterialSetHeat(HycoMaterial material, PetscBool heat)
{
  PetscFunctionBegin;
  HycoCheckHandle(material, HYCO_MATERIAL_CLASSID);
  material->heat = heat;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A linear law is evaluated by its tangents alone, and needs no history. */
PetscErrorCode HycoMaterialSetLinear(HycoMaterial material, PetscBool linear)
{
  PetscFunctionBegin;
  HycoCheckHandle(material, HYCO_MATERIAL_CLASSID);
  material->linear = linear;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The law keeps what is behind the pointer, and frees it in its destroy operation: the class never looks at it. */
PetscErrorCode HycoMaterialSetData(HycoMaterial material, void *data)
{
  PetscFunctionBegin;
  HycoCheckHandle(material, HYCO_MATERIAL_CLASSID);
  material->data = data;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of the law's own operations: the type of what is behind the pointer is known to them alone. */
PetscErrorCode HycoMaterialGetData(HycoMaterial material, void *data)
{
  PetscFunctionBegin;
  HycoCheckHandle(material, HYCO_MATERIAL_CLASSID);
  HycoCheckGiven(data);
  *(void **)data = material->data;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks that the scene suits the law: inelastic laws need a history, and no plane stress. */
PetscErrorCode HycoMaterialSetUp(HycoMaterial material, PetscInt dim, HycoFormulation formulation,
                                 PetscBool has_history)
{
  PetscFunctionBegin;
  material->formulation = formulation;
  /* First, since it is the law's setup that decides the number of state variables checked below. */
  if (material->ops->setup) PetscCall((*material->ops->setup)(material, dim));
  HycoCheck(has_history || (material->linear && !material->n_state),
            "body %s: its law %s is history-dependent; give the scene a history: {times: [...]}",
            ((PetscObject)material)->name, ((PetscObject)material)->type_name);
  /* Plane stress is reached by eliminating the thickness strain from a constant tangent, which an inelastic law has
     not. */
  HycoCheck(material->linear || formulation != HYCO_PLANE_STRESS,
            "body %s: its law %s is inelastic, and plane_stress is for linear laws; use scene_formulation plane_strain "
            "or a 3D mesh",
            ((PetscObject)material)->name, ((PetscObject)material)->type_name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the elastic response depends on changed parameters, directly or by the temperature; a law may say that
   some constants do not matter for it. */
PetscBool HycoMaterialChanges(HycoMaterial material, const PetscBool changed[])
{
  PetscBool constant[HYCO_MAX_DECLARED], any = PETSC_FALSE;

  for (PetscInt j = 0; j < material->constants.n; j++) {
    const HycoExpr expr = material->constants.entry[j].expr;

    /* Only a constant that is given as a function of the temperature sees that the temperature changes. */
    constant[j] = (PetscBool)(HycoExprChanges(expr, changed) ||
                              (HycoExprInHeat(expr) && HycoExprChanges(material->temperature, changed)));
    any = (PetscBool)(any || constant[j]);
  }
  return any && material->ops->depends ? (*material->ops->depends)(material, constant) : any;
}

/* Whether constants differ from point to point of a body. A temperature is a field too, hence the second test.
   Without either, one evaluation of the constants serves all points of a body. */
PetscBool HycoMaterialInSpace(HycoMaterial material)
{
  for (PetscInt j = 0; j < material->constants.n; j++) {
    const HycoExpr expr = material->constants.entry[j].expr;

    if (HycoExprInSpace(expr) || HycoExprInHeat(expr)) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* Whether the law consists only of Lame's constants. */
static PetscBool IsLame(HycoMaterial material)
{
  return (PetscBool)(material->linear && material->ops->isotropic);
}

/* von Mises stress (Pa) of a stress with HycoStrainSize(dim) components; in 1D its magnitude. */
PetscReal HycoMises(PetscInt dim, const PetscReal s[])
{
  PetscReal mean, sum = 0;

  if (dim == 1) return PetscAbsReal(s[0]);
  mean = (s[0] + s[1] + s[2]) / 3;
  for (PetscInt c = 0; c < 3; c++) sum += (s[c] - mean) * (s[c] - mean);
  for (PetscInt c = 3; c < (dim == 2 ? 4 : 6); c++) sum += 2 * s[c] * s[c];
  return PetscSqrtReal(1.5 * sum);
}

/* Two reals (Lame) where the kernels for isotropic tangents apply; plane stress changes the tangent's form, thus
   needs all. */
PetscInt HycoMaterialTangentSize(HycoMaterial material, PetscInt dim)
{
  return IsLame(material) && material->formulation == HYCO_PLANE_STRAIN ? 2 : HycoStrainSize(dim) * HycoStrainSize(dim);
}

/* stress = C strain; engineering shear strains. */
void HycoTangentApply(PetscBool isotropic, PetscInt dim, const PetscReal tangent[], const PetscReal strain[],
                      PetscReal stress[])
{
  const PetscInt n = HycoStrainSize(dim);

  /* tangent: Lame's lambda and mu. A bar has the modulus alone, which is kept in the place of mu. */
  if (isotropic && dim == 1) {
    stress[0] = tangent[1] * strain[0];
  } else if (isotropic) {
    const PetscReal volume = tangent[0] * (strain[0] + strain[1] + strain[2]);

    for (PetscInt c = 0; c < 3; c++) stress[c] = volume + 2 * tangent[1] * strain[c];
    for (PetscInt c = 3; c < n; c++) stress[c] = tangent[1] * strain[c];
  } else {
    for (PetscInt r = 0; r < n; r++) {
      stress[r] = 0;
      for (PetscInt c = 0; c < n; c++) stress[r] += tangent[r * n + c] * strain[c];
    }
  }
}

/* The tangent of a point from its Lame constants: the columns are stresses of unit strains. The input may be where
   the output goes, hence the copy. */
static void ExpandLame(PetscInt dim, const PetscReal lame[2], PetscReal tangent[])
{
  const PetscInt ns = HycoStrainSize(dim);
  const PetscReal own[2] = {lame[0], lame[1]};

  for (PetscInt c = 0; c < ns; c++) {
    PetscReal unit[6] = {0, 0, 0, 0, 0, 0}, column[6];

    /* Column c by the same formula as the stresses, so that both forms agree to the last bit. */
    unit[c] = 1;
    HycoTangentApply(PETSC_TRUE, dim, own, unit, column);
    for (PetscInt r = 0; r < ns; r++) tangent[r * ns + c] = column[r];
  }
}

/* Evaluates p->n points; a linear law by its tangents. p->failed: the first point without a solution, -1: none. */
PetscErrorCode HycoMaterialUpdate(HycoMaterial material, HycoMaterialPoints *p)
{
  PetscInt ns;
  PetscReal *lame;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  HycoCheckHandle(material, HYCO_MATERIAL_CLASSID);
  HycoCheckGiven(p);
  PetscCheck(IsLame(material) || material->ops->update, PETSC_COMM_SELF, PETSC_ERR_ORDER,
             "call HycoMaterialSetType() before HycoMaterialUpdate()");
  ns = p->n_strain;
  p->dt_factor = 1;
  p->failed = -1;
  if (!IsLame(material)) {
    /* A linear law of its own sets tangents, and the class multiplies: p->tangent is then never NULL. */
    PetscCall((*material->ops->update)(material, p));
    for (PetscInt i = 0; material->linear && p->stress && i < p->n; i++)
      HycoTangentApply(PETSC_FALSE, p->dim, p->tangent + i * ns * ns, p->strain + i * ns, p->stress + i * ns);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc1(2 * p->n, &lame));
  ierr = (*material->ops->isotropic)(material, p, lame);
  for (PetscInt i = 0; i < p->n && !ierr; i++) {
    if (p->stress) HycoTangentApply(PETSC_TRUE, p->dim, lame + 2 * i, p->strain + i * ns, p->stress + i * ns);
    if (p->tangent) ExpandLame(p->dim, lame + 2 * i, p->tangent + i * ns * ns);
  }
  PetscCall(PetscFree(lame));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fails if a constant is outside its interval. */
static PetscErrorCode CheckConstant(const HycoEntry *e, const PetscReal mu[], PetscInt n, const PetscReal x[],
                                    const PetscReal value[])
{
  PetscFunctionBegin;
  for (PetscInt i = 0; i < n; i++) {
    char place[HYCO_LINE];

    if (value[i] > e->lo && value[i] < e->hi) continue;
    PetscCall(HycoExprPlace(e->expr, mu, x + 3 * i, place));
    /* A one-sided interval is said in words: "between 0 and infinity" helps nobody. */
    if (e->hi >= PETSC_INFINITY && (e->lo == 0 || e->lo == HYCO_NOT_NEGATIVE))
      HycoFail("%s is %g at %s; %s must %s", HycoExprKey(e->expr), (double)value[i], place, e->title,
               e->lo == 0 ? "be positive" : "not be negative");
    HycoFail("%s is %.10g at %s; %s must lie between %g and %g", HycoExprKey(e->expr), (double)value[i], place,
             e->title, (double)e->lo, (double)e->hi);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the part of a tangent for strains in the mesh's dimensions (2D: without zz) is symmetric and positive
   definite, by Cholesky. */
static PetscBool IsDefinite(PetscInt dim, const PetscReal C[])
{
  static const PetscInt seen[3][6] = {{0}, {0, 1, 3}, {0, 1, 2, 3, 4, 5}};
  const PetscInt n = HycoStrainSize(dim), m = dim * (dim + 1) / 2;
  PetscReal L[6][6];

  /* By hand: the matrix is at most 6 x 6, and the symmetry test needs the same loop. The test runs at each point. */
  for (PetscInt r = 0; r < m; r++) {
    for (PetscInt c = 0; c <= r; c++) {
      const PetscInt i = seen[dim - 1][r], j = seen[dim - 1][c];
      PetscReal sum = C[i * n + j];

      /* Relative to the diagonal, so that units do not matter. */
      if (!(PetscAbsReal(sum - C[j * n + i]) <= 1e-12 * (PetscAbsReal(C[i * n + i]) + PetscAbsReal(C[j * n + j]))))
        return PETSC_FALSE;
      for (PetscInt k = 0; k < c; k++) sum -= L[r][k] * L[c][k];
      if (r == c && !(sum > 1e-14 * C[i * n + i] && sum < PETSC_INFINITY)) return PETSC_FALSE;
      L[r][c] = r == c ? PetscSqrtReal(sum) : sum / L[c][c];
    }
  }
  return PETSC_TRUE;
}

/* constant[j]: values of the j-th constant at n points, in work (HYCO_MAX_DECLARED x n). Checks their intervals. */
PetscErrorCode HycoMaterialConstants(HycoMaterial material, const PetscReal mu[], PetscInt n, const PetscReal x[],
                                     const PetscReal temperature[], PetscReal work[], const PetscReal *constant[])
{
  const HycoDeclared *d = &material->constants;

  PetscFunctionBegin;
  for (PetscInt j = 0; j < d->n; j++) {
    PetscReal *value = work + j * n;

    constant[j] = value;
    /* The default first: an entry that the scene does not give has no expression. */
    for (PetscInt i = 0; i < n; i++) value[i] = d->entry[j].value;
    if (!d->entry[j].expr) continue;
    PetscCall(HycoExprEvalHot(d->entry[j].expr, mu, n, x, temperature, value));
    PetscCall(CheckConstant(&d->entry[j], mu, n, x, value));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The tangents of a law that is not linear: its instantaneous response at rest, without strain, state and time. The
   elastic response of an inelastic law, for supports, K and models that are linear. */
static PetscErrorCode ResidualTangents(HycoMaterial material, HycoMaterialPoints *p)
{
  const PetscInt n = p->n * (3 * p->n_strain + 2 * material->n_state);
  PetscReal *zero;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(n, &zero));
  /* Inputs are all zero and may share one array; outputs must not overlap them. */
  p->strain0 = p->strain = p->stress0 = zero;
  p->stress = zero + 2 * p->n * p->n_strain;
  p->state0 = zero + 3 * p->n * p->n_strain;
  p->state = zero + p->n * (3 * p->n_strain + material->n_state);
  HycoFinally(HycoMaterialUpdate(material, p), PetscCall(PetscFree(zero)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Expands Lame's constants (n x 2) to tangents in place, in an order in which none is overwritten before it is read. */
static void ExpandAll(PetscInt dim, PetscInt n, PetscReal tangent[])
{
  const PetscInt size = HycoStrainSize(dim) * HycoStrainSize(dim);

  for (PetscInt k = 0; k < n; k++) {
    const PetscInt i = size < 2 ? k : n - 1 - k;

    ExpandLame(dim, tangent + 2 * i, tangent + i * size);
  }
}

/* Plane stress from tangents (n x 4 x 4): sigma_zz = 0 gives eps_zz, and its row and column become 0. sigma_zz = 0:
   static condensation of one component. */
static void ReleaseThickness(PetscInt n, PetscReal tangent[])
{
  for (PetscInt i = 0; i < n; i++) {
    PetscReal *C = tangent + 16 * i, row[4], column[4];

    for (PetscInt k = 0; k < 4; k++) {
      row[k] = C[2 * 4 + k];
      column[k] = C[4 * k + 2] / C[2 * 4 + 2];
    }
    for (PetscInt k = 0; k < 16; k++) C[k] = k / 4 == 2 || k % 4 == 2 ? 0 : C[k] - column[k / 4] * row[k % 4];
  }
}

/* Elastic tangents at n points (x: n x 3, temperature: n or NULL): n x HycoMaterialTangentSize() reals. An
   indefinite or unsymmetric one is an error, because K is factored by Cholesky. */
PetscErrorCode HycoMaterialTangents(HycoMaterial material, PetscInt dim, const PetscReal mu[], PetscInt n,
                                    const PetscReal x[], const PetscReal temperature[], PetscReal work[],
                                    PetscReal tangent[])
{
  const PetscReal *constant[HYCO_MAX_DECLARED];
  HycoMaterialPoints p = {.n = n, .dim = dim, .n_strain = HycoStrainSize(dim), .constant = constant, .failed = -1};

  PetscFunctionBegin;
  PetscCall(HycoMaterialConstants(material, mu, n, x, temperature, work, constant));
  p.tangent = tangent;
  p.temperature0 = p.temperature = temperature;
  /* Isotropic laws give two constants a point, from which the integration is much cheaper than from a matrix. */
  if (material->ops->isotropic)
    PetscCall((*material->ops->isotropic)(material, &p, tangent));
  else if (material->linear)
    PetscCall(HycoMaterialUpdate(material, &p));
  else
    PetscCall(ResidualTangents(material, &p));
  if (material->ops->isotropic && HycoMaterialTangentSize(material, dim) != 2) ExpandAll(dim, n, tangent);
  for (PetscInt i = 0; i < n && p.failed < 0 && !material->ops->isotropic; i++) {
    /* Isotropic ones are definite by the intervals of their constants, checked above. */
    if (IsDefinite(dim, tangent + i * p.n_strain * p.n_strain)) continue;
    p.failed = i;
    p.why = "the tangent is not symmetric and positive definite";
  }
  HycoCheck(p.failed < 0, "body %s, law %s: %s at x = %g, y = %g, z = %g", ((PetscObject)material)->name,
            ((PetscObject)material)->type_name, p.why ? p.why : "no answer", (double)x[3 * p.failed],
            (double)x[3 * p.failed + 1], (double)x[3 * p.failed + 2]);
  /* Last: the check is of the law in 3D, before the thickness strain is eliminated. */
  if (material->formulation == HYCO_PLANE_STRESS) ReleaseThickness(n, tangent);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* lambda and mu; in 1D lambda is 0 and mu Young's modulus. */
PetscErrorCode HycoElasticLame(HycoMaterial material, HycoMaterialPoints *p, PetscReal lame[])
{
  const PetscReal *young = p->constant[0], *poisson = p->constant[1];

  PetscFunctionBegin;
  (void)material;
  for (PetscInt i = 0; i < p->n; i++) {
    lame[2 * i] = p->dim == 1 ? 0 : young[i] * poisson[i] / ((1 + poisson[i]) * (1 - 2 * poisson[i]));
    lame[2 * i + 1] = p->dim == 1 ? young[i] : young[i] / (2 * (1 + poisson[i]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Poisson's ratio lies between -1 and 0.5, ends excluded. */
PetscErrorCode HycoElasticDeclare(HycoMaterial material)
{
  PetscFunctionBegin;
  PetscCall(HycoMaterialDeclare(material, "young", "Young's modulus", HYCO_REQUIRED, 0, PETSC_INFINITY));
  PetscCall(HycoMaterialDeclare(material, "poisson", "Poisson's ratio", 0, -1, 0.5));
  PetscFunctionReturn(PETSC_SUCCESS);
}
