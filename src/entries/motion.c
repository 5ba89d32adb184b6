/* Gravity and rotation: accelerations of the whole scene, which act on bodies with a density. */
#include <hycosceneimpl.h>
#include <string.h>

/* The expression of an entry. */
static HycoExpr *MotionEntryFind(HycoScene s, const char key[])
{
  HycoMotion *m = &s->motion;
  static const char *const vectors[] = {"gravity_", "rotation_axis_", "rotation_through_"};
  HycoExpr *const at[] = {m->gravity, m->axis, m->through};

  if (strcasecmp(key, "rotation_speed") == 0) return &m->speed;
  for (PetscInt k = 0; k < 3; k++) {
    const size_t n = strlen(vectors[k]);

    for (PetscInt c = 0; c < 3; c++) {
      /* | 32: lower case in ASCII. */
      if (strncasecmp(key, vectors[k], n) == 0 && (key[n] | 32) == "xyz"[c] && !key[n + 1]) return &at[k][c];
    }
  }
  return NULL;
}

/* Accelerations are integrated over cells with one value: a field of them would not be a rigid motion. Also of a later
   override: the former expression is replaced. */
PetscErrorCode HycoSceneReadMotion(HycoScene s, PetscInt entry)
{
  const char *key = s->key[entry];
  HycoExpr *expr = MotionEntryFind(s, key);

  PetscFunctionBegin;
  HycoCheck(expr,
            "the scene's entry %s is unknown; the entries are gravity: {x: ..., y: ..., z: ...} and rotation: {speed: "
            "..., axis: {x: ..., y: ..., z: ...}, through: {x: ..., y: ..., z: ...}}",
            key);
  PetscCall(HycoExprDestroy(expr)); /* the same entry in other letter case */
  PetscCall(HycoSceneExpression(s, key, s->value[entry], expr));
  PetscCall(HycoExprRefuseHeat(*expr));
  HycoCheck(!HycoExprInSpace(*expr), "%s depends on x, y or z; it must be constant in space", key);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All expressions in order; NULL: not given in the scene. */
#define N_EXPR 10
static HycoExpr *MotionAt(HycoScene s, PetscInt k)
{
  HycoMotion *m = &s->motion;

  return k < 3 ? &m->gravity[k] : k == 3 ? &m->speed : k < 7 ? &m->axis[k - 4] : &m->through[k - 7];
}

/* changed NULL: whether there is any; else whether the changed variables affect it. A body without density has none. By
   the entries, not by values: a speed of 0 at these parameters is still a load. */
PetscBool HycoSceneHasInertia(HycoScene s, const HycoBody *body, const PetscBool changed[])
{
  const HycoMotion *m = &s->motion;
  PetscBool changes = PETSC_FALSE;

  if (!body->density || !(m->gravity[0] || m->gravity[1] || m->gravity[2] || m->speed)) return PETSC_FALSE;
  if (!changed) return PETSC_TRUE;
  for (PetscInt k = 0; k < N_EXPR; k++) changes = (PetscBool)(changes || HycoExprChanges(*MotionAt(s, k), changed));
  return (PetscBool)(changes || HycoExprChanges(body->density, changed));
}

/* An acceleration without a density would silently do nothing. */
PetscErrorCode HycoSceneCheckMotion(HycoScene s)
{
  const char *given = NULL, *place = NULL;
  PetscBool density = PETSC_FALSE;

  PetscFunctionBegin;
  for (PetscInt b = 0; b < s->n_bodies; b++) density = (PetscBool)(density || s->body[b].density);
  for (PetscInt k = 0; k < N_EXPR; k++) {
    if (*MotionAt(s, k)) given = HycoExprKey(*MotionAt(s, k));
    if (*MotionAt(s, k) && k > 3) place = HycoExprKey(*MotionAt(s, k));
  }
  HycoCheck(!given || density, "%s needs a density, and no body has one; write body: NAME: {density: ...}", given);
  HycoCheck(!place || s->motion.speed,
            "%s is given without a speed; write rotation: {speed: ...} too (radians per unit of time)", place);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSceneDestroyMotion(HycoScene s)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < N_EXPR; k++) PetscCall(HycoExprDestroy(MotionAt(s, k)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
