/*
  Step 3b: several predictions that live on one model.

      build/ladder/sensitivity -model rope.h5 -mu 0.1,0.1

  HycoROMClone() makes another handle on a model, whose data exist once; each handle has its own last prediction. Here
  one handle stays at mu, and two others visit its neighbours, for the derivatives of the total contact force and the
  place where a change of each parameter moves the contact force most.
*/
#include <hyco.h>

#define STEP 1e-3 /* of a parameter's range */

static PetscErrorCode Force(HycoROM model, PetscInt n, const PetscReal mu[], PetscReal *total)
{
  HycoPrediction p;

  PetscFunctionBeginUser;
  PetscCall(HycoROMPredict(model, n, mu));
  PetscCall(HycoROMGetPrediction(model, &p));
  *total = p.total_contact_force;
  PetscFunctionReturn(0);
}

/* The contact whose force differs most between two handles' predictions. */
static PetscErrorCode MostMoved(HycoROM a, HycoROM b, PetscInt *node)
{
  PetscInt m, at = 0;
  const PetscInt *ids;
  const PetscReal *La, *Lb;

  PetscFunctionBeginUser;
  PetscCall(HycoROMGetLambda(a, &m, &La, &ids, NULL));
  PetscCall(HycoROMGetLambda(b, NULL, &Lb, NULL, NULL));
  for (PetscInt k = 1; k < m; k++) {
    if (PetscAbsReal(La[k] - Lb[k]) > PetscAbsReal(La[at] - Lb[at])) at = k;
  }
  *node = m ? ids[at] : -1;
  PetscFunctionReturn(0);
}

static PetscErrorCode Run(void)
{
  HycoROM here, below, above;
  HycoScene scene;
  PetscInt n, n_given = 32, node = -1;
  const PetscReal *lo, *hi;
  const char *const *name;
  PetscReal mu[32], force = 0, less = 0, more = 0;
  char file[PETSC_MAX_PATH_LEN] = "rope.h5";
  PetscBool given;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetString(NULL, NULL, "-model", file, sizeof(file), NULL));
  PetscCall(HycoROMLoad(file, &here));
  PetscCall(HycoROMClone(here, &below));
  PetscCall(HycoROMClone(here, &above));
  PetscCall(HycoROMGetScene(here, &scene));
  PetscCall(HycoSceneGetParameters(scene, &n, &name, &lo, &hi));
  PetscCall(PetscOptionsGetRealArray(NULL, NULL, "-mu", mu, &n_given, &given));
  for (PetscInt p = 0; p < n && !given; p++) mu[p] = (lo[p] + hi[p]) / 2;
  PetscCall(Force(here, n, mu, &force));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "force %.10g\n", (double)force));
  for (PetscInt p = 0; p < n; p++) {
    const PetscReal at = mu[p], h = STEP * (hi[p] - lo[p]);

    mu[p] = at - h;
    PetscCall(Force(below, n, mu, &less));
    mu[p] = at + h;
    PetscCall(Force(above, n, mu, &more));
    mu[p] = at;
    PetscCall(MostMoved(here, above, &node));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s: derivative %.10g, most at node %d\n", name[p],
                          (double)((more - less) / (2 * h)), (int)node));
  }
  PetscCall(HycoROMDestroy(&above));
  PetscCall(HycoROMDestroy(&below));
  PetscCall(HycoROMDestroy(&here));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscCall(HycoInitialize(&argc, &argv));
  PetscCall(Run());
  return (int)HycoFinalize();
}
