/* A contact discretisation of your own: a rigid sphere (2D: a disk) by its signed distance, which a scene names by
   `type: sphere` and whose centre and radius it gives.

     build/ladder/contact SCENE [MU1 MU2 ...]
*/
#include <hyco.h>
#include <stdlib.h>

/* From the sphere's centre to point i, and its length; the radius. */
static PetscErrorCode FromCentre(HycoContact contact, const HycoContactPoints *p, PetscInt i, PetscReal r[3],
                                 PetscReal *length, PetscReal *radius)
{
  static const char *const names[] = {"centre_x", "centre_y", "centre_z"};
  const PetscReal *x = p->slave + 3 * i;

  PetscFunctionBegin;
  for (PetscInt c = 0; c < 3; c++) {
    PetscCall(HycoContactEvaluate(contact, names[c], p->mu, 1, x, &r[c]));
    r[c] = x[c] - r[c];
  }
  *length = PetscSqrtReal(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
  PetscCall(HycoContactEvaluate(contact, "radius", p->mu, 1, x, radius));
  PetscFunctionReturn(0);
}

/* The normal, out of the body and into the sphere. */
static PetscErrorCode Normal(HycoContact contact, const HycoContactPoints *p, PetscReal normal[])
{
  PetscFunctionBegin;
  for (PetscInt i = 0; i < p->n; i++) {
    PetscReal r[3], length, radius;

    PetscCall(FromCentre(contact, p, i, r, &length, &radius));
    for (PetscInt c = 0; c < 3; c++) normal[3 * i + c] = -r[c] / length;
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode Gap(HycoContact contact, const HycoContactPoints *p, const PetscReal normal[], PetscReal gap[])
{
  PetscFunctionBegin;
  (void)normal;
  for (PetscInt i = 0; i < p->n; i++) {
    PetscReal r[3], length, radius;

    PetscCall(FromCentre(contact, p, i, r, &length, &radius));
    gap[i] = length - radius;
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode CreateSphere(HycoContact contact)
{
  static const struct _HycoContactOps ops = {.normal = Normal, .gap = Gap};

  PetscFunctionBegin;
  PetscCall(HycoContactDeclare(contact, "group", "the nodes that may meet it", HYCO_ENTRY_GROUP, PETSC_TRUE));
  PetscCall(HycoContactDeclare(contact, "centre_x", "the centre", HYCO_ENTRY_EXPRESSION, PETSC_TRUE));
  PetscCall(HycoContactDeclare(contact, "centre_y", "the centre", HYCO_ENTRY_EXPRESSION, PETSC_TRUE));
  PetscCall(HycoContactDeclare(contact, "centre_z", "the centre", HYCO_ENTRY_EXPRESSION, PETSC_TRUE));
  PetscCall(HycoContactDeclare(contact, "radius", "the radius", HYCO_ENTRY_EXPRESSION, PETSC_TRUE));
  PetscCall(HycoContactSetOps(contact, &ops));
  PetscFunctionReturn(0);
}

static PetscErrorCode Run(const char *path, PetscInt n, const PetscReal mu[])
{
  HycoScene scene;
  HycoFOM fom;
  HycoSummary s;

  PetscFunctionBegin;
  PetscCall(HycoContactRegister("sphere", CreateSphere)); /* before loading a scene that names it */
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, path, &scene));
  PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, scene, &fom));
  PetscCall(HycoFOMSolve(fom, n, mu));
  PetscCall(HycoFOMGetSummary(fom, &s));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "%s: %d of %d contacts closed, contact force %.10g, energy %.10g, u_y from %.10g\n",
                        HycoReasonName(s.reason), (int)s.n_active, (int)s.n_contacts, (double)s.total_contact_force,
                        (double)s.strain_energy, (double)s.u_min[1]));
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscReal mu[8];
  PetscInt n = 0;

  PetscCall(HycoInitialize(&argc, &argv));
  PetscCheck(argc > 1, PETSC_COMM_WORLD, PETSC_ERR_USER, "usage: contact SCENE [MU1 MU2 ...]");
  while (n < 8 && n + 2 < argc && argv[n + 2][0] != '-') {
    mu[n] = atof(argv[n + 2]);
    n++;
  }
  PetscCall(Run(argv[1], n, mu));
  return (int)HycoFinalize();
}
