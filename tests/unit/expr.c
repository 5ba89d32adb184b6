/* Expressions of a scene: values, pi, dependence on variables, and refusals. */
#include "check.h"
#include <hycosceneimpl.h>
#include <math.h>

static const char *const names[] = {"a", "radius"};
static const PetscReal mu[] = {3, 4.05}, at[] = {0.25, -2, 7};

/* One value at `at`. */
static PetscErrorCode Value(const char text[], PetscReal *value)
{
  HycoExpr e = NULL;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoExprCreate("key", text, 2, names, &e));
  ierr = HycoExprEval(e, mu, 1, at, value);
  PetscCall(HycoExprDestroy(&e));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Closed forms, computed by the C library. */
static PetscErrorCode TestValues(void)
{
  const struct {
    const char *text;
    double value;
  } cases[] = {
      {"3.5", 3.5},
      {" -1e-3 ", -1e-3},
      {"2+3*4^2", 50},
      {"-2^2", -4},
      {"x", 0.25},
      {"x*y+z", 6.5},
      {"x*radius/4.1", 0.25 * 4.05 / 4.1},
      {"a > 2 ? 1 : -1", 1},
      {"x <= 0.5 ? a : 0.15", 3},
      {"sqrt(a^2+16)", 5},
      {"exp(1)", 2.718281828459045},
      {"abs(y)", 2},
      {"floor(y/3) + ceil(x)", 0},
      {"mod(y, 1.5)", 1},
      {"hypot(a, 4)", 5},
  };
  PetscReal value;

  PetscFunctionBegin;
  for (size_t k = 0; k < sizeof(cases) / sizeof(cases[0]); k++) {
    PetscCall(Value(cases[k].text, &value));
    CHECK(fabs(value - cases[k].value) <= 1e-15 * (1 + fabs(cases[k].value)), "\"%s\": expected %.17g, found %.17g",
          cases[k].text, cases[k].value, value);
  }
  PetscCall(Value("pi", &value));
  CHECK_NEAR(value, 3.14159265358979323846, 1e-15);
  PetscCall(Value("sin(pi/6)", &value));
  CHECK_NEAR(value, 0.5, 1e-15);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Many points at once, and the queries that decide what is assembled again. */
static PetscErrorCode TestDependence(void)
{
  const PetscReal xyz[6] = {1, 2, 3, 4, 5, 6};
  const PetscBool first[2] = {PETSC_TRUE, PETSC_FALSE}, second[2] = {PETSC_FALSE, PETSC_TRUE};
  PetscReal value[2];
  HycoExpr e;

  PetscFunctionBegin;
  PetscCall(HycoExprCreate("key", "x + 10*z + a", 2, names, &e));
  PetscCall(HycoExprEval(e, mu, 2, xyz, value));
  CHECK_NEAR(value[0], 34, 0);
  CHECK_NEAR(value[1], 67, 0);
  CHECK(HycoExprInSpace(e), "x + 10*z + a depends on the place");
  CHECK(HycoExprChanges(e, first) && !HycoExprChanges(e, second), "it depends on a and not on radius");
  PetscCall(HycoExprDestroy(&e));
  CHECK(!e, "Destroy must clear the handle");
  PetscCall(HycoExprDestroy(&e));
  PetscCall(HycoExprCreate("key", "2*radius", 2, names, &e));
  PetscCall(HycoExprEval(e, mu, 2, xyz, value));
  CHECK_NEAR(value[1], 8.1, 1e-15);
  CHECK(!HycoExprInSpace(e) && HycoExprChanges(e, second), "2*radius depends on radius alone");
  PetscCall(HycoExprDestroy(&e));
  CHECK(!HycoExprInSpace(NULL) && !HycoExprChanges(NULL, first), "no expression depends on nothing");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Expressions that cannot be parsed, or are not finite, are refused. */
static PetscErrorCode TestRefusals(void)
{
  PetscReal value;

  PetscFunctionBegin;
  CHECK_FAILS(Value("2*(x+1", &value), "key: \"2*(x+1\" is not an expression");
  CHECK_FAILS(Value("2 3", &value), "is not an expression");
  CHECK_FAILS(Value("x +", &value), "is not an expression");
  CHECK_FAILS(Value("", &value), "key is empty");
  CHECK_FAILS(Value("x + foo", &value), "uses foo, which is unknown; the known names are x, y, z, a, radius, pi");
  CHECK_FAILS(Value("1/0", &value), "is not finite");
  CHECK_FAILS(Value("1/(x-0.25)", &value), "is not finite at x = 0.25, y = -2");
  CHECK_FAILS(Value("sqrt(y)", &value), "is not finite");
  CHECK_FAILS(Value("nan", &value), "key");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Test(void)
{
  PetscFunctionBegin;
  PetscCall(TestValues());
  PetscCall(TestDependence());
  PetscCall(TestRefusals());
  PetscFunctionReturn(PETSC_SUCCESS);
}

TEST_MAIN
