/* Expressions of a scene, parsed by muParser. */
#include <hycosceneimpl.h>
#include <muParserDLL.h>
#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct _n_HycoExpr {
  char *key, *text;
  muParserHandle_t parser; /* NULL if the text is a number */
  double constant;         /* the value of that number */
  double x[3], mu[HYCO_MAX_PARAMETERS], temperature;
  PetscInt n_parameters;
  PetscBool in_space, in_heat, in_mu[HYCO_MAX_PARAMETERS];
};

/* A plain number has no parser. */
PetscErrorCode HycoExprDestroy(HycoExpr *expr)
{
  PetscFunctionBegin;
  if (!*expr) PetscFunctionReturn(PETSC_SUCCESS);
  if ((*expr)->parser) mupRelease((*expr)->parser);
  HycoFreeAll(&(*expr)->key, &(*expr)->text, expr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* muParser reports errors through a handler that is not called by default; this reads and clears its flag. */
static void ExprClearError(muParserHandle_t parser)
{
  (void)parser;
}

/* By text: equal expressions in other words count as different, which costs time but is never wrong. Both NULL are
   alike. */
PetscBool HycoExprAlike(HycoExpr a, HycoExpr b)
{
  return a && b ? (PetscBool)(strcmp(a->text, b->text) == 0) : (PetscBool)(!a && !b);
}

/* Only the two ends of a long expression are shown, so that a message has room for the reason. */
#define SHORT 260
/* Both ends of a long expression, for messages: the error is usually near one of them. */
static void ExprShorten(const char text[], char out[SHORT])
{
  const size_t n = strlen(text);

  if (n < SHORT)
    snprintf(out, SHORT, "%s", text);
  else
    snprintf(out, SHORT, "%.120s ... %s", text, text + n - 120);
}

/* muParser's own message says where it stopped; the entry says which of the many expressions it was. */
static PetscErrorCode ExprReportError(HycoExpr e)
{
  char text[SHORT];

  PetscFunctionBegin;
  ExprShorten(e->text, text);
  HycoFail("%s: \"%s\" is not an expression: %.300s", e->key, text, mupGetErrorMsg(e->parser));
}

/* Which variables an expression uses, found by the addresses that the parser was given: what does not depend on a
   parameter is computed once. An unknown name is refused here, with the known ones. */
static PetscErrorCode FindVariables(HycoExpr e, PetscInt n, const char *const names[])
{
  int n_used = mupGetExprVarNum(e->parser);

  PetscFunctionBegin;
  if (mupError(e->parser)) PetscCall(ExprReportError(e));
  for (int k = 0; k < n_used; k++) {
    const char *name = NULL;
    double *address = NULL;

    mupGetExprVar(e->parser, (unsigned)k, &name, &address);
    /* A variable is known by its address alone. */
    if (address >= e->x && address < e->x + 3) {
      e->in_space = PETSC_TRUE;
    } else if (address >= e->mu && address < e->mu + n) {
      e->in_mu[address - e->mu] = PETSC_TRUE;
    } else if (address == &e->temperature) {
      e->in_heat = PETSC_TRUE;
    } else {
      char list[HYCO_LINE] = "x, y, z", text[SHORT];

      for (PetscInt p = 0; p < n; p++) PetscCall(HycoListAdd(list, ", ", names[p]));
      ExprShorten(e->text, text);
      HycoFail("%s: \"%s\" uses %.100s, which is unknown; the known names are %s, pi", e->key, text, name, list);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* muParser takes minutes for many brackets inside each other. */
#define DEEPEST 100
/* Before the parser sees it, which would run for minutes. A text of a mistyped script may have thousands of
   brackets. */
static PetscErrorCode CheckNesting(HycoExpr e)
{
  PetscInt depth = 0, most = 0;
  char text[SHORT];

  PetscFunctionBegin;
  for (const char *c = e->text; *c; c++) {
    depth += (*c == '(') - (*c == ')');
    most = PetscMax(most, depth);
  }
  ExprShorten(e->text, text);
  HycoCheck(most <= DEEPEST, "%s: \"%s\" has %d brackets inside each other; at most %d are possible", e->key, text,
            (int)most, DEEPEST);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static double ExprModulo(double a, double b)
{
  return a - b * floor(a / b);
}

/* Functions that muParser lacks. A parameter may have the name of one. */
static void DefineFunctions(HycoExpr e, PetscInt n, const char *const names[])
{
  static const struct {
    const char *name;
    muFun1_t one;
    muFun2_t two;
  } functions[] = {{"floor", floor, NULL}, {"ceil", ceil, NULL}, {"mod", NULL, ExprModulo}, {"hypot", NULL, hypot}};

  for (size_t k = 0; k < sizeof(functions) / sizeof(functions[0]); k++) {
    PetscInt p = 0;

    while (p < n && strcmp(names[p], functions[k].name)) p++;
    if (p < n) continue;
    if (functions[k].one)
      mupDefineFun1(e->parser, functions[k].name, functions[k].one, 1);
    else
      mupDefineFun2(e->parser, functions[k].name, functions[k].two, 1);
  }
}

/* A plain number does not need a parser. Variables are defined before the text is set, and the text is evaluated once,
   since muParser reports some errors only then. */
static PetscErrorCode ExprParse(HycoExpr e, PetscInt n, const char *const names[])
{
  static const char *const axis[3] = {"x", "y", "z"};
  char *end;

  PetscFunctionBegin;
  e->n_parameters = n;
  /* "inf" and "nan" are numbers for strtod(), but have no digit. */
  e->constant = HycoNumber(e->text, &end);
  while (*end == ' ') end++;
  if (end != e->text && *end == '\0' && strpbrk(e->text, "0123456789")) PetscFunctionReturn(PETSC_SUCCESS);
  HycoCheck(e->text[strspn(e->text, " \t")] != '\0', "%s is empty; give a number or an expression", e->key);
  PetscCall(CheckNesting(e));
  e->parser = mupCreate(muBASETYPE_FLOAT);
  mupSetErrorHandler(e->parser, ExprClearError);
  mupDefineConst(e->parser, "pi", PETSC_PI); /* muParser's own _pi has 12 digits */
  DefineFunctions(e, n, names);
  for (int c = 0; c < 3; c++) mupDefineVar(e->parser, axis[c], &e->x[c]);
  mupDefineVar(e->parser, "temperature", &e->temperature);
  for (PetscInt p = 0; p < n; p++)
    mupDefineVar(e->parser, names[p], &e->mu[p]); /* a parameter may have the name
                                                     temperature */
  if (mupError(e->parser)) PetscCall(ExprReportError(e));
  mupSetExpr(e->parser, e->text);
  if (mupError(e->parser)) PetscCall(ExprReportError(e));
  PetscCall(FindVariables(e, n, names));
  (void)mupEval(e->parser);
  if (mupError(e->parser)) PetscCall(ExprReportError(e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* key is the entry, by which messages name the expression; both texts are copied. */
PetscErrorCode HycoExprCreate(const char key[], const char text[], PetscInt n, const char *const names[],
                              HycoExpr *expr)
{
  PetscFunctionBegin;
  PetscCall(PetscNew(expr));
  PetscCall(PetscStrallocpy(key, &(*expr)->key));
  PetscCall(PetscStrallocpy(text, &(*expr)->text));
  HycoOnError(ExprParse(*expr, n, names), PetscCall(HycoExprDestroy(expr)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For messages: the place, and those parameters that the expression uses. Only what can explain a value: other
   parameters would distract. */
PetscErrorCode HycoExprPlace(HycoExpr e, const PetscReal mu[], const PetscReal xyz[3], char place[HYCO_LINE])
{
  size_t length;

  PetscFunctionBegin;
  HycoFormat(place, "x = %g, y = %g, z = %g", (double)xyz[0], (double)xyz[1], (double)xyz[2]);
  for (int k = 0; e->parser && k < mupGetExprVarNum(e->parser); k++) {
    const char *name = NULL;
    double *address = NULL;

    mupGetExprVar(e->parser, (unsigned)k, &name, &address);
    if (address < e->mu || address >= e->mu + e->n_parameters) continue;
    length = strlen(place);
    snprintf(place + length, HYCO_LINE - length, ", %s = %.10g", name, (double)mu[address - e->mu]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Without a temperature, for entries in which it is no variable. */
PetscErrorCode HycoExprEval(HycoExpr e, const PetscReal mu[], PetscInt n, const PetscReal xyz[], PetscReal value[])
{
  PetscFunctionBegin;
  PetscCall(HycoExprEvalHot(e, mu, n, xyz, NULL, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* value[k] at xyz[3 k .. 3 k + 2] and temperature[k]; NULL: the expression must not use it. Not for several
   threads: the variables are fields of e. What does not vary in space is evaluated once. */
PetscErrorCode HycoExprEvalHot(HycoExpr e, const PetscReal mu[], PetscInt n, const PetscReal xyz[],
                               const PetscReal temperature[], PetscReal value[])
{
  PetscFunctionBegin;
  if (!e->parser) {
    for (PetscInt k = 0; k < n; k++) value[k] = e->constant;
  } else {
    for (PetscInt p = 0; p < e->n_parameters; p++) e->mu[p] = mu[p];
    for (PetscInt k = 0; k < n; k++) {
      /* Most entries are the same everywhere, and are evaluated at thousands of points. */
      if (e->in_space || e->in_heat || k == 0) {
        if (temperature) e->temperature = temperature[k];
        for (int c = 0; c < 3; c++) e->x[c] = xyz[3 * k + c];
        value[k] = mupEval(e->parser);
      } else {
        value[k] = value[0];
      }
    }
    if (mupError(e->parser)) PetscCall(ExprReportError(e));
  }
  for (PetscInt k = 0; k < n; k++) {
    if (PetscIsInfOrNanReal(value[k])) {
      char place[HYCO_LINE], text[SHORT];

      /* With the place and the parameters, since a division by zero may occur at one point of one sample alone. */
      PetscCall(HycoExprPlace(e, mu, xyz + 3 * k, place));
      ExprShorten(e->text, text);
      HycoFail("%s: \"%s\" is not finite at %s", e->key, text, place);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool HycoExprInSpace(HycoExpr e)
{
  return (PetscBool)(e && e->in_space);
}

PetscBool HycoExprInHeat(HycoExpr e)
{
  return (PetscBool)(e && e->in_heat);
}

/* Elsewhere there is no temperature at which to evaluate it. */
PetscErrorCode HycoExprRefuseHeat(HycoExpr e)
{
  char text[SHORT];

  PetscFunctionBegin;
  ExprShorten(e->text, text);
  HycoCheck(!e->in_heat, "%s: \"%s\" uses temperature, which is allowed only in a law's constants and in expansion",
            e->key, text);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* changed[]: for each variable. NULL, an entry that was not given, never changes. */
PetscBool HycoExprChanges(HycoExpr e, const PetscBool changed[])
{
  if (!e) return PETSC_FALSE;
  for (PetscInt p = 0; p < e->n_parameters; p++) {
    if (e->in_mu[p] && changed[p]) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

const char *HycoExprKey(HycoExpr e)
{
  return e->key;
}

/* As muParser permits, but without _ at the beginning, which its own constants have. */
PetscBool HycoIsVariableName(const char word[])
{
  static const char *const taken[] = {"x", "y", "z", "pi"};

  for (size_t k = 0; k < sizeof(taken) / sizeof(taken[0]); k++) {
    if (strcmp(word, taken[k]) == 0) return PETSC_FALSE;
  }
  if (!isalpha((unsigned char)word[0])) return PETSC_FALSE;
  for (; *word; word++) {
    if (!isalnum((unsigned char)*word) && *word != '_') return PETSC_FALSE;
  }
  return PETSC_TRUE;
}
