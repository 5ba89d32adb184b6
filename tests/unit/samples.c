/* Sets of parameter points, the scene's ranges and its text, names of options. */
#include "check.h"
#include <hycomaterialimpl.h>
#include <unistd.h>

static char *const keys[] = {"scene_parameters", "parameter_a_range", "parameter_b_range", "body_rope_young",
                             "scene_mesh"};
static char *const values[] = {"a,b", "0,1", "-1,3", "a + 2*b", "none.msh"};

/* Points of each kind of grid. */
static PetscErrorCode TestGrids(HycoScene scene)
{
  const PetscInt counts[2] = {2, 4}, lists[2] = {1, 2}, one[2] = {1, 1};
  const PetscReal a[1] = {0.5}, b[2] = {2, -1}, outside[2] = {0.5, 3.01};
  const PetscReal *const product[2] = {a, b};
  /* cell centres lo + (k + 1/2) (hi - lo) / n, the last parameter fastest */
  const PetscReal centred[8][2] = {{0.25, -0.5}, {0.25, 0.5}, {0.25, 1.5}, {0.25, 2.5},
                                   {0.75, -0.5}, {0.75, 0.5}, {0.75, 1.5}, {0.75, 2.5}};
  /* Halton's halves, quarters of a and thirds of b; the corners; b = -1 where a has digits of 1 + BETWEEN, tested below
   */
  const PetscReal scattered[8][2] = {{0.5, 1. / 3},  {0, -1}, {0, 1. / 3}, {1, 3},
                                     {0.25, 5. / 3}, {1, -1}, {-1, -1},    {0, 3}};
  HycoSamples samples;
  PetscInt n, p;
  const PetscReal *mu;

  PetscFunctionBegin;
  PetscCall(HycoSamplesCreate(scene, &samples));
  PetscCall(HycoSamplesAddGrid(samples, counts, PETSC_FALSE));
  PetscCall(HycoSamplesAddGrid(samples, counts, PETSC_TRUE));
  PetscCall(HycoSamplesAddProduct(samples, lists, product));
  PetscCall(HycoSamplesGet(samples, &n, &p, &mu));
  CHECK(n == 18 && p == 2, "expected 18 points of 2 values, found %d of %d", (int)n, (int)p);
  for (int k = 0; k < 16; k++) CHECK_NEAR(mu[k], centred[k / 2][k % 2], 1e-15);
  CHECK_NEAR(mu[16], 0, 0); /* closed: from corner to corner */
  CHECK_NEAR(mu[17], -1, 0);
  CHECK_NEAR(mu[30], 1, 0);
  CHECK_NEAR(mu[31], 3, 0);
  CHECK_NEAR(mu[32], 0.5, 0);
  CHECK_NEAR(mu[33], 2, 0);
  CHECK_NEAR(mu[35], -1, 0);
  PetscCall(HycoSamplesAddScattered(samples, 8));
  PetscCall(HycoSamplesGet(samples, &n, NULL, &mu));
  CHECK(n == 26, "expected 26 points, found %d", (int)n);
  CHECK(mu[48] > 0 && mu[48] < 1, "a = %g on the face b = -1", (double)mu[48]);
  for (int k = 0; k < 16; k++) {
    if (k != 12) CHECK_NEAR(mu[36 + k], scattered[k / 2][k % 2], 1e-15);
  }
  CHECK_FAILS(HycoSamplesAddScattered(samples, 0), "0 scattered points; 1 to 100 million are expected");
  CHECK_FAILS(HycoSamplesAddPoint(samples, outside), "b = 3.01 lies outside its range [-1");
  CHECK_FAILS(HycoSamplesAddGrid(samples, one, PETSC_TRUE), "the grid has 1 points for a; at least 2 are needed");
  PetscCall(HycoSamplesDestroy(&samples));
  CHECK(!samples, "Destroy must clear the handle");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode FromFile(HycoScene scene, const char text[], PetscInt *n, PetscReal first[2])
{
  char path[128];
  FILE *out;
  HycoSamples samples;
  PetscInt p;
  const PetscReal *mu;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  snprintf(path, sizeof(path), "/tmp/hyco_points_%ld.csv", (long)getpid());
  out = fopen(path, "w");
  fputs(text, out);
  fclose(out);
  PetscCall(HycoSamplesCreate(scene, &samples));
  ierr = HycoSamplesAddFile(samples, path);
  unlink(path);
  if (!ierr) {
    PetscCall(HycoSamplesGet(samples, n, &p, &mu));
    PetscCall(PetscArraycpy(first, mu, 2));
  }
  PetscCall(HycoSamplesDestroy(&samples));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points of a CSV file, columns in any order; wrong files are refused. */
static PetscErrorCode TestFile(HycoScene scene)
{
  PetscInt n;
  PetscReal first[2];

  PetscFunctionBegin;
  PetscCall(FromFile(scene, "b,a\n2.5,0.25\r\n1,1\n", &n, first)); /* columns in any order */
  CHECK(n == 2, "expected 2 points, found %d", (int)n);
  CHECK_NEAR(first[0], 0.25, 0);
  CHECK_NEAR(first[1], 2.5, 0);
  CHECK_FAILS(FromFile(scene, "a,c\n1,1\n", &n, first), "\"c\" is not a parameter");
  CHECK_FAILS(FromFile(scene, "a\n1\n", &n, first), "names 1 of the scene's 2 parameters");
  CHECK_FAILS(FromFile(scene, "a,a\n1,1\n", &n, first), "occurs twice");
  CHECK_FAILS(FromFile(scene, "a,b\n1,1\n1;2\n", &n, first), "line 3: 2 numbers");
  CHECK_FAILS(FromFile(scene, "", &n, first), ".csv contains no point");
  CHECK_FAILS(FromFile(scene, "a,b\n\n", &n, first), ".csv contains no point");
  CHECK_FAILS(FromFile(scene, "a,b\n1,9\n", &n, first), "b = 9");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The text stored in a model gives the same scene again; the fields of the scene have the written values. */
static PetscErrorCode TestScene(HycoScene scene)
{
  HycoScene again;
  char *text, *twice;
  PetscInt n;
  const char *const *names;
  const PetscReal *lo, *hi, at[3] = {0, 0, 0}, mu[2] = {1, 2};
  PetscReal young;

  PetscFunctionBegin;
  PetscCall(HycoSceneGetParameters(scene, &n, &names, &lo, &hi));
  CHECK(n == 2 && !strcmp(names[0], "a") && !strcmp(names[1], "b"), "expected the parameters a, b");
  CHECK_NEAR(lo[1], -1, 0);
  CHECK_NEAR(hi[1], 3, 0);
  PetscCall(HycoSceneToText(scene, &text));
  PetscCall(HycoSceneFromText(PETSC_COMM_SELF, text, &again));
  PetscCall(HycoSceneToText(again, &twice));
  CHECK(strcmp(text, twice) == 0, "the text changed from\n%s\nto\n%s", text, twice);
  PetscCall(HycoExprEval(HycoDeclaredFind(&again->body[0].law->constants, "young")->expr, mu, 1, at, &young));
  CHECK_NEAR(young, 5, 0);
  PetscCall(PetscFree(text));
  PetscCall(PetscFree(twice));
  PetscCall(HycoSceneDestroy(&again));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* 3 x 2 points, repeated, with one more between: each is kept at its first place. */
static PetscErrorCode TestTwins(HycoScene scene)
{
  const PetscInt counts[2] = {3, 2};
  const PetscReal extra[2] = {0.5, 2.75};
  HycoSamples samples;
  PetscInt n, dropped;
  const PetscReal *mu;

  PetscFunctionBegin;
  PetscCall(HycoSamplesCreate(scene, &samples));
  PetscCall(HycoSamplesAddGrid(samples, counts, PETSC_TRUE));
  PetscCall(HycoSamplesAddPoint(samples, extra));
  PetscCall(HycoSamplesAddGrid(samples, counts, PETSC_TRUE));
  PetscCall(HycoSamplesAddPoint(samples, extra));
  PetscCall(HycoSamplesDropTwins(samples, &dropped));
  PetscCall(HycoSamplesGet(samples, &n, NULL, &mu));
  CHECK(n == 7 && dropped == 7, "expected 7 of 14 points, found %d, %d dropped", (int)n, (int)dropped);
  for (PetscInt k = 0; k < 6; k++) {
    CHECK_NEAR(mu[2 * k], 0.5 * (PetscReal)(k / 2), 0);
    CHECK_NEAR(mu[2 * k + 1], k % 2 ? 3 : -1, 0);
  }
  CHECK_NEAR(mu[13], 2.75, 0);
  PetscCall(HycoSamplesDropTwins(samples, NULL));
  PetscCall(HycoSamplesGet(samples, &n, NULL, &mu));
  CHECK(n == 7, "nothing is left to drop, %d points are", (int)n);
  PetscCall(HycoSamplesDestroy(&samples));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The number of coordinates at an end of the ranges. */
static int Ends(const PetscReal mu[2])
{
  return (mu[0] == 0 || mu[0] == 1) + (mu[1] == -1 || mu[1] == 3);
}

/* Unseen points: within the region of the set (cell centres of the ranges cover these), none of them in it, evenly
   distributed (each quarter of the box has its share). Of 40, a quarter lies on faces, 10 / 4 on average on each, and
   all 4 corners are there; more points continue the sequence and have the corners again. */
static PetscErrorCode TestUnseen(HycoScene scene)
{
  const PetscInt counts[2] = {3, 4};
  HycoSamples samples, unseen, more, rest;
  PetscInt n, m, quarter[4] = {0}, ends[3] = {0}, face[4] = {0}, same = 0;
  const PetscReal *mu, *nu;

  PetscFunctionBegin;
  PetscCall(HycoSamplesCreate(scene, &samples));
  PetscCall(HycoSamplesAddGrid(samples, counts, PETSC_FALSE));
  PetscCall(HycoSamplesOutsideTraining(samples, 0, 40, 3, NULL, &unseen));
  PetscCall(HycoSamplesGet(unseen, &n, NULL, &mu));
  CHECK(n == 40, "expected 40 unseen points, found %d", (int)n);
  for (PetscInt k = 0; k < n; k++) {
    const PetscReal a = mu[2 * k], b = mu[2 * k + 1];

    CHECK(a >= 0 && a <= 1 && b >= -1 && b <= 3, "point %d lies outside", (int)k);
    quarter[2 * (a > 0.5) + (b > 1)]++;
    ends[Ends(mu + 2 * k)]++;
    if (Ends(mu + 2 * k) == 1) face[a == 0 ? 0 : a == 1 ? 1 : b == -1 ? 2 : 3]++;
  }
  for (int q = 0; q < 4; q++) CHECK(quarter[q] >= 8 && quarter[q] <= 12, "quarter %d has %d of 40", q, (int)quarter[q]);
  for (int q = 0; q < 4; q++) CHECK(face[q] == 2 || face[q] == 3, "face %d has %d of 10", q, (int)face[q]);
  CHECK(ends[0] == 26 && ends[1] == 10 && ends[2] == 4, "expected 26 inside, 10 on faces, 4 corners, found %d, %d, %d",
        (int)ends[0], (int)ends[1], (int)ends[2]);
  PetscCall(HycoSamplesOutsideTraining(samples, 24, 16, 3, NULL, &more));
  PetscCall(HycoSamplesGet(more, &m, NULL, &nu));
  CHECK(m == 16, "expected 16 more, found %d", (int)m);
  for (PetscInt k = 0; k < m; k++)
    same += nu[2 * k] == mu[48 + 2 * k] && nu[2 * k + 1] == mu[49 + 2 * k] && Ends(nu + 2 * k) < 2;
  CHECK(same == 12, "expected 12 points that continue the sequence beside 4 corners, found %d", (int)same);
  PetscCall(HycoSamplesExcept(unseen, more, &rest));
  PetscCall(HycoSamplesGet(rest, &n, NULL, NULL));
  CHECK(n == 24, "expected 24 that are not among the 16, found %d", (int)n);
  PetscCall(HycoSamplesDestroy(&rest));
  PetscCall(HycoSamplesDestroy(&more));
  PetscCall(HycoSamplesDestroy(&unseen));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Training at three corners: the fourth is the only corner of the 12 unseen points; 3 are on faces, none of them a
   training point, though those are on the faces too. */
static PetscErrorCode TestSeenCorners(HycoScene scene)
{
  const PetscReal corner[3][2] = {{0, -1}, {1, 3}, {1, -1}};
  HycoSamples samples, unseen, rest;
  PetscInt n, ends[3] = {0};
  const PetscReal *mu;

  PetscFunctionBegin;
  PetscCall(HycoSamplesCreate(scene, &samples));
  for (int k = 0; k < 3; k++) PetscCall(HycoSamplesAddPoint(samples, corner[k]));
  PetscCall(HycoSamplesOutsideTraining(samples, 0, 12, 1, NULL, &unseen));
  PetscCall(HycoSamplesExcept(unseen, samples, &rest));
  PetscCall(HycoSamplesGet(rest, &n, NULL, &mu));
  CHECK(n == 12, "expected 12 unseen points, found %d", (int)n);
  for (PetscInt k = 0; k < n; k++) {
    ends[Ends(mu + 2 * k)]++;
    if (Ends(mu + 2 * k) == 2) CHECK(mu[2 * k] == 0 && mu[2 * k + 1] == 3, "point %d is a corner of training", (int)k);
  }
  CHECK(ends[0] == 8 && ends[1] == 3 && ends[2] == 1, "expected 8 inside, 3 on faces, 1 corner, found %d, %d, %d",
        (int)ends[0], (int)ends[1], (int)ends[2]);
  PetscCall(HycoSamplesDestroy(&rest));
  PetscCall(HycoSamplesDestroy(&unseen));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Three points on each value of the expensive parameter a; a group at an end of a has both ends of b. */
static PetscErrorCode TestGroups(HycoScene scene)
{
  const PetscInt counts[2] = {3, 4};
  const PetscBool slow[2] = {PETSC_TRUE, PETSC_FALSE};
  HycoSamples samples, unseen;
  PetscInt n, corners = 0;
  const PetscReal *mu;

  PetscFunctionBegin;
  PetscCall(HycoSamplesCreate(scene, &samples));
  PetscCall(HycoSamplesAddGrid(samples, counts, PETSC_FALSE));
  PetscCall(HycoSamplesOutsideTraining(samples, 0, 48, 3, slow, &unseen));
  PetscCall(HycoSamplesDropTwins(unseen, NULL));
  PetscCall(HycoSamplesGet(unseen, &n, NULL, &mu));
  CHECK(n == 48, "expected 48 unseen points, found %d", (int)n);
  for (PetscInt k = 0; k < n; k++) {
    CHECK_NEAR(mu[2 * k], mu[2 * (k - k % 3)], 0);
    corners += Ends(mu + 2 * k) == 2;
  }
  CHECK(corners == 4, "expected the 4 corners, found %d", (int)corners);
  CHECK(mu[0] != mu[6] && mu[1] != mu[3], "values that nothing shares are shared");
  PetscCall(HycoSamplesDestroy(&unseen));
  PetscCall(HycoSamplesDestroy(&samples));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points outside their ranges are refused unless extrapolation is allowed. */
static PetscErrorCode TestExtrapolate(HycoScene scene)
{
  const PetscReal outside[2] = {0.5, 3.01};
  PetscReal nan[2] = {0.5, 0};

  PetscFunctionBegin;
  nan[1] = strtod("nan", NULL);
  CHECK_FAILS(HycoSceneCheckParameters(scene, 2, outside), "lies outside its range");
  PetscCall(HycoSceneSetExtrapolate(scene, PETSC_TRUE));
  PetscCall(HycoSceneCheckParameters(scene, 2, outside));
  CHECK_FAILS(HycoSceneCheckParameters(scene, 2, nan), "b is not a finite number");
  PetscCall(HycoSceneSetExtrapolate(scene, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The known name that is nearest to a misspelled one. */
static PetscErrorCode TestNearest(void)
{
  const char *const names[] = {"young", "poisson", "map_x"};

  PetscFunctionBegin;
  CHECK(HycoNearest("yung", 3, names) == names[0], "yung is nearest to young");
  CHECK(HycoNearest("Poison", 3, names) == names[1], "Poison is nearest to poisson");
  CHECK(!HycoNearest("gravity", 3, names), "gravity is near to none");
  CHECK(HycoOptionFind("hyco_pod_tol") && !HycoOptionFind("hyco_pod_tl"), "the table of options is wrong");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  HycoScene scene;

  PetscFunctionBegin;
  PetscCall(HycoSceneFromEntries(PETSC_COMM_SELF, 5, keys, values, "/", &scene));
  PetscCall(TestGrids(scene));
  PetscCall(TestFile(scene));
  PetscCall(TestScene(scene));
  PetscCall(TestTwins(scene));
  PetscCall(TestUnseen(scene));
  PetscCall(TestSeenCorners(scene));
  PetscCall(TestGroups(scene));
  PetscCall(TestExtrapolate(scene));
  PetscCall(TestNearest());
  PetscCall(HycoSceneDestroy(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
