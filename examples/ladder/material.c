/* A material law of your own: cubic elasticity, which a scene names by `law: cubic` and whose constants it gives.

     build/ladder/material SCENE [MU1 MU2 ...]
*/
#include <hyco.h>
#include <stdlib.h>

/* C is c11 on the diagonal of the normal strains, c12 beside it, c44 for each shear angle, at every point. */
static PetscErrorCode Update(HycoMaterial law, HycoMaterialPoints *p)
{
  const PetscReal *c11 = p->constant[0], *c12 = p->constant[1], *c44 = p->constant[2];
  const PetscInt n = p->n_strain;

  PetscFunctionBegin;
  (void)law;
  for (PetscInt i = 0; i < p->n; i++) {
    PetscReal *C = p->tangent + i * n * n;

    PetscCall(PetscArrayzero(C, n * n));
    for (PetscInt r = 0; r < n; r++) {
      for (PetscInt c = 0; c < 3 && r < 3; c++) C[r * n + c] = r == c ? c11[i] : c12[i];
      if (r >= 3) C[r * n + r] = c44[i];
    }
    if (c12[i] >= c11[i]) {
      p->failed = i;
      p->why = "c12 must be less than c11";
    }
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode SetUp(HycoMaterial law, PetscInt dim)
{
  PetscFunctionBegin;
  PetscCheck(dim > 1, PetscObjectComm((PetscObject)law), PETSC_ERR_SUP, "cubic is a law for 2D (plane strain) and 3D");
  PetscFunctionReturn(0);
}

static PetscErrorCode CreateCubic(HycoMaterial law)
{
  static const struct _HycoMaterialOps ops = {.setup = SetUp, .update = Update};

  PetscFunctionBegin;
  PetscCall(HycoMaterialDeclare(law, "c11", "stiffness along an axis", HYCO_REQUIRED, 0, PETSC_INFINITY));
  PetscCall(
      HycoMaterialDeclare(law, "c12", "stiffness across an axis", HYCO_REQUIRED, -PETSC_INFINITY, PETSC_INFINITY));
  PetscCall(HycoMaterialDeclare(law, "c44", "shear stiffness", HYCO_REQUIRED, 0, PETSC_INFINITY));
  PetscCall(HycoMaterialSetOps(law, &ops));
  PetscFunctionReturn(0);
}

static PetscErrorCode Run(const char *path, PetscInt n, const PetscReal mu[])
{
  HycoScene scene;
  HycoFOM fom;
  HycoSummary s;

  PetscFunctionBegin;
  PetscCall(HycoMaterialRegister("cubic", CreateCubic)); /* before loading a scene that names it */
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, path, &scene));
  PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, scene, &fom));
  PetscCall(HycoFOMSolve(fom, n, mu));
  PetscCall(HycoFOMGetSummary(fom, &s));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "%s: contact force %.10g, energy %.10g, u_x in [%.10g, %.10g], u_y in [%.10g, %.10g]\n",
                        HycoReasonName(s.reason), (double)s.total_contact_force, (double)s.strain_energy,
                        (double)s.u_min[0], (double)s.u_max[0], (double)s.u_min[1], (double)s.u_max[1]));
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscReal mu[8];
  PetscInt n = 0;

  PetscCall(HycoInitialize(&argc, &argv));
  PetscCheck(argc > 1, PETSC_COMM_WORLD, PETSC_ERR_USER, "usage: material SCENE [MU1 MU2 ...]");
  while (n < 8 && n + 2 < argc && argv[n + 2][0] != '-') {
    mu[n] = atof(argv[n + 2]);
    n++;
  }
  PetscCall(Run(argv[1], n, mu));
  return (int)HycoFinalize();
}
