/* A type of reduced model of your own: the training solutions' mean, weighted by the inverse squared distance to the
   parameters. Means of nonnegative forces are nonnegative; nothing makes them complementary to the gaps, which the
   residuals say. It is trained, saved, loaded, predicted and compared by the calls that any other type has.

     build/ladder/model SCENE MODEL.h5 MU1 [MU2 ...] [-hyco_... options]
*/
#include <hyco.h>
#include <hycoromtype.h>
#include <hycotrainer.h>
#include <stdlib.h>

typedef struct {
  PetscInt n, n_par;                         /* training points, parameters */
  PetscReal *mu, *Lambda, *gamma;            /* n_par, n_contacts, n_modes numbers per point */
  PetscReal *weight, *forces, *coefficients; /* work */
} Nearest;

static PetscErrorCode Copy(PetscInt n, const PetscReal from[], PetscReal **to)
{
  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, to));
  PetscCall(PetscArraycpy(*to, from, n));
  PetscFunctionReturn(0);
}

static PetscErrorCode Parameters(HycoROM model, PetscInt *n, const PetscReal *lo[], const PetscReal *hi[])
{
  HycoScene scene;

  PetscFunctionBegin;
  PetscCall(HycoROMGetScene(model, &scene));
  PetscCall(HycoSceneGetParameters(scene, n, NULL, lo, hi));
  PetscFunctionReturn(0);
}

static PetscErrorCode Build(HycoROM model, HycoReducer reducer)
{
  Nearest *d;
  const PetscReal *mu, *Lambda, *gamma;
  PetscInt l, m;

  PetscFunctionBegin;
  PetscCall(HycoROMGetData(model, &d));
  PetscCall(HycoROMGetDimensions(model, &l, &m));
  PetscCall(Parameters(model, &d->n_par, NULL, NULL));
  PetscCall(HycoReducerGetSolutions(reducer, &d->n, &mu, &Lambda, &gamma));
  PetscCall(Copy(d->n * d->n_par, mu, &d->mu));
  PetscCall(Copy(d->n * m, Lambda, &d->Lambda));
  PetscCall(Copy(d->n * l, gamma, &d->gamma));
  PetscFunctionReturn(0);
}

static PetscErrorCode SetUp(HycoROM model)
{
  Nearest *d;
  PetscInt l, m;

  PetscFunctionBegin;
  PetscCall(HycoROMGetData(model, &d));
  PetscCall(HycoROMGetDimensions(model, &l, &m));
  PetscCall(PetscMalloc3(d->n, &d->weight, m, &d->forces, l, &d->coefficients));
  PetscCall(HycoROMSetUpDefault(model));
  PetscFunctionReturn(0);
}

static PetscErrorCode Reset(HycoROM model)
{
  Nearest *d;

  PetscFunctionBegin;
  PetscCall(HycoROMGetData(model, &d));
  PetscCall(PetscFree3(d->weight, d->forces, d->coefficients));
  PetscFunctionReturn(0);
}

static PetscErrorCode Mean(const Nearest *d, PetscInt rows, const PetscReal value[], PetscReal mean[])
{
  PetscFunctionBegin;
  PetscCall(PetscArrayzero(mean, rows));
  for (PetscInt k = 0; k < d->n; k++) {
    for (PetscInt i = 0; i < rows; i++) mean[i] += d->weight[k] * value[k * rows + i];
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode Solve(HycoROM model, const PetscReal mu[])
{
  Nearest *d;
  const PetscReal *lo, *hi;
  PetscReal sum = 0;
  PetscInt l, m, n;

  PetscFunctionBegin;
  PetscCall(HycoROMGetData(model, &d));
  PetscCall(HycoROMGetDimensions(model, &l, &m));
  PetscCall(Parameters(model, &n, &lo, &hi));
  for (PetscInt k = 0; k < d->n; k++) {
    PetscReal far = 1e-12; /* reproduces training points */

    for (PetscInt p = 0; p < n; p++) far += PetscSqr((mu[p] - d->mu[k * n + p]) / (hi[p] > lo[p] ? hi[p] - lo[p] : 1));
    d->weight[k] = 1 / far;
    sum += d->weight[k];
  }
  for (PetscInt k = 0; k < d->n; k++) d->weight[k] /= sum;
  PetscCall(Mean(d, m, d->Lambda, d->forces));
  PetscCall(Mean(d, l, d->gamma, d->coefficients));
  PetscCall(HycoROMSetSolution(model, mu, d->coefficients, d->forces));
  PetscFunctionReturn(0);
}

static PetscErrorCode Save(HycoROM model, HycoH5 file)
{
  Nearest *d;
  PetscInt l, m;

  PetscFunctionBegin;
  PetscCall(HycoROMGetData(model, &d));
  PetscCall(HycoROMGetDimensions(model, &l, &m));
  PetscCall(HycoH5WriteReal(file, "nearest/mu", d->n, d->n_par, d->mu));
  PetscCall(HycoH5WriteReal(file, "nearest/Lambda", d->n, m, d->Lambda));
  PetscCall(HycoH5WriteReal(file, "nearest/gamma", d->n, l, d->gamma));
  PetscFunctionReturn(0);
}

static PetscErrorCode Load(HycoROM model, HycoH5 file)
{
  Nearest *d;
  PetscInt l, m;

  PetscFunctionBegin;
  PetscCall(HycoROMGetData(model, &d));
  PetscCall(HycoROMGetDimensions(model, &l, &m));
  PetscCall(Parameters(model, &d->n_par, NULL, NULL));
  d->n = -1; /* all of them */
  PetscCall(HycoH5LoadReal(file, "nearest/mu", &d->n, &d->n_par, &d->mu));
  PetscCall(HycoH5LoadReal(file, "nearest/Lambda", &d->n, &m, &d->Lambda));
  PetscCall(HycoH5LoadReal(file, "nearest/gamma", &d->n, &l, &d->gamma));
  PetscFunctionReturn(0);
}

static PetscErrorCode Destroy(HycoROM model)
{
  Nearest *d;

  PetscFunctionBegin;
  PetscCall(HycoROMGetData(model, &d));
  PetscCall(PetscFree(d->mu));
  PetscCall(PetscFree(d->Lambda));
  PetscCall(PetscFree(d->gamma));
  PetscCall(PetscFree(d));
  PetscFunctionReturn(0);
}

static PetscErrorCode TrainNearest(HycoTrainerOps *ops)
{
  PetscFunctionBegin;
  ops->build = Build;
  PetscFunctionReturn(0);
}

static PetscErrorCode CreateNearest(HycoROM model)
{
  static const HycoROMTraits traits = {.title = "nearest solutions", .whole = PETSC_TRUE};
  static const HycoROMOps ops = {
      .setup = SetUp, .reset = Reset, .solve = Solve, .save = Save, .load = Load, .destroy = Destroy};
  Nearest *d;

  PetscFunctionBegin;
  PetscCall(PetscNew(&d));
  PetscCall(HycoROMSetOps(model, &ops, &traits, d));
  PetscFunctionReturn(0);
}

static PetscErrorCode Run(const char *folder, const char *file, PetscInt n, const PetscReal mu[])
{
  HycoScene scene;
  HycoSamples samples;
  HycoReducer reducer;
  HycoROM model;
  HycoFOM fom;
  HycoPrediction p;
  HycoErrors e;
  PetscInt grid[32];

  PetscFunctionBegin;
  PetscCall(HycoROMRegister("nearest", CreateNearest)); /* before a reducer or a file uses it */
  PetscCall(HycoTrainerRegister("nearest", TrainNearest));
  PetscCall(PetscOptionsSetValue(NULL, "-hyco_model_type", "nearest"));
  PetscCall(HycoSceneLoad(PETSC_COMM_WORLD, folder, &scene));
  PetscCall(HycoSamplesCreate(scene, &samples));
  for (PetscInt k = 0; k < n; k++) grid[k] = 6;
  PetscCall(HycoSamplesAddGrid(samples, grid, PETSC_TRUE));
  PetscCall(HycoReducerCreate(PETSC_COMM_WORLD, scene, &reducer));
  PetscCall(HycoReducerSetFromOptions(reducer));
  PetscCall(HycoReducerRun(reducer, samples, file, NULL));
  PetscCall(HycoROMLoad(file, &model));
  PetscCall(HycoROMPredict(model, n, mu));
  PetscCall(HycoROMGetPrediction(model, &p));
  PetscCall(HycoFOMCreate(PETSC_COMM_WORLD, scene, &fom));
  PetscCall(HycoFOMSolve(fom, n, mu));
  PetscCall(HycoROMCompare(model, fom, &e));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "%s: contact force %.8g, complementarity %.3g, adhesion %.3g; errors: u %.4g, sigma %.4g, "
                        "lambda %.4g; estimated: u %.4g\n",
                        p.title, (double)p.total_contact_force, (double)p.kkt.complementarity, (double)p.kkt.adhesion,
                        (double)e.u, (double)e.sigma, (double)e.lambda, (double)p.estimated_error_u));
  PetscCall(HycoFOMDestroy(&fom));
  PetscCall(HycoROMDestroy(&model));
  PetscCall(HycoReducerDestroy(&reducer));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscReal mu[32];
  PetscInt n = 0;

  for (int k = 3; k < argc && n < 32 && argv[k][0] != '-'; k++) mu[n++] = atof(argv[k]);
  PetscCall(HycoInitialize(&argc, &argv));
  PetscCheck(n, PETSC_COMM_WORLD, PETSC_ERR_USER, "give a scene, a model file and the parameters");
  PetscCall(Run(argv[1], argv[2], n, mu));
  return (int)HycoFinalize();
}
