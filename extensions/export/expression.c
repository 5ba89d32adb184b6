/* Expressions of a scene for the program: a parser of muParser's language, into reverse Polish notation. */
#include "export.h"
#include <ctype.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

typedef struct {
  HycoScene scene;
  const char *at;
  const PetscReal *x;
  HycoCode *code;
  PetscInt depth, stack; /* of brackets; numbers that are on the stack */
  PetscBool valid, uses, space;
} Parser;

static void ExpressionInvalid(Parser *p)
{
  p->valid = PETSC_FALSE;
}

/* An operation that takes some numbers from the stack and leaves one; up to PLACE with its number. */
static void ExpressionWrite(Parser *p, int op, PetscInt takes, PetscReal number)
{
  HycoCode *c = p->code;

  if (c->n + 2 > c->room) {
    c->room = 2 * c->room + 64;
    PetscCallVoid(PetscRealloc((size_t)c->room * sizeof(*c->text), &c->text));
  }
  c->text[c->n++] = op;
  if (op <= PLACE) c->text[c->n++] = number;
  p->stack += 1 - takes;
  if (p->stack >= DEPTH) ExpressionInvalid(p);
}

/* Whether the next word is this one, which is skipped. */
static PetscBool ExpressionAccept(Parser *p, const char word[])
{
  while (isspace((unsigned char)*p->at)) p->at++;
  if (strncmp(p->at, word, strlen(word))) return PETSC_FALSE;
  p->at += strlen(word);
  return PETSC_TRUE;
}

static void ExpressionExpect(Parser *p, const char word[])
{
  if (!ExpressionAccept(p, word)) ExpressionInvalid(p);
}

static void ExpressionTernary(Parser *p);

/* In the order of function_of[]. */
static const char *const functions[] = {"sin",  "cos",   "tan",   "asin",  "acos",  "atan",  "sinh", "cosh",
                                        "tanh", "asinh", "acosh", "atanh", "log2",  "log10", "log",  "ln",
                                        "exp",  "sqrt",  "abs",   "rint",  "floor", "ceil",  "sign"};
static const struct {
  const char *name;
  int op;
} several[] = {{"min", LEAST},
               {"max", GREATEST},
               {"sum", BINARY + PLUS},
               {"atan2", BINARY + ATAN2},
               {"hypot", BINARY + HYPOT},
               {"mod", BINARY + MODULO}};

static PetscBool ExpressionEquals(const char word[], const char name[], size_t n)
{
  return (PetscBool)(strlen(word) == n && !strncmp(word, name, n));
}

static void ExpressionCall(Parser *p, const char name[], size_t n)
{
  int op = -1, of = -1;

  for (int k = 0; k < (int)(sizeof(several) / sizeof(several[0])); k++)
    of = ExpressionEquals(several[k].name, name, n) ? several[k].op : of;
  for (int k = 0; k < (int)(sizeof(functions) / sizeof(functions[0])); k++)
    op = ExpressionEquals(functions[k], name, n) ? UNARY + k : op;
  ExpressionTernary(p);
  while (of >= 0 && p->valid && ExpressionAccept(p, ",")) {
    ExpressionTernary(p);
    ExpressionWrite(p, of, 2, 0);
  }
  if (op >= 0) ExpressionWrite(p, op, 1, 0);
  if (op < 0 && of < 0) ExpressionInvalid(p);
  ExpressionExpect(p, ")");
}

/* A constant of the scene: its text in its place. */
static void ExpressionConstant(Parser *p, const char text[])
{
  const char *after = p->at;

  p->at = text;
  ExpressionTernary(p);
  (void)ExpressionAccept(p, "");
  if (*p->at) ExpressionInvalid(p);
  p->at = after;
}

/* Parameters before constants before pi. Keys of constants are stored without regard to case. */
static void ExpressionName(Parser *p)
{
  const HycoScene s = p->scene;
  const char *name = p->at;
  size_t n = 0;

  while (isalnum((unsigned char)name[n]) || name[n] == '_') n++;
  p->at += n;
  if (ExpressionAccept(p, "(")) {
    ExpressionCall(p, name, n);
    return;
  }
  for (PetscInt k = 0; k < s->n_variables; k++) {
    if (!ExpressionEquals(s->parameter[k], name, n)) continue;
    ExpressionWrite(p, VARIABLE, 0, k);
    p->uses = PETSC_TRUE;
    return;
  }
  for (PetscInt k = 0; k < s->n_constants; k++) {
    const char *key = s->key[s->constant[k]] + strlen("constant_");

    if (strlen(key) != n || strncasecmp(key, name, n) != 0) continue;
    ExpressionConstant(p, s->value[s->constant[k]]);
    return;
  }
  if (ExpressionEquals("pi", name, n)) {
    ExpressionWrite(p, NUMBER, 0, PETSC_PI);
  } else if (n == 1 && name[0] >= 'x' && name[0] <= 'z') {
    p->space = PETSC_TRUE;
    ExpressionWrite(p, p->x ? NUMBER : PLACE, 0, p->x ? p->x[name[0] - 'x'] : name[0] - 'x');
  } else {
    ExpressionInvalid(p);
  }
}

/* A name in itself would not end, like brackets without an end. */
static void ExpressionPrimary(Parser *p)
{
  PetscReal value;
  char *end;

  if (++p->depth > 100) ExpressionInvalid(p);
  if (!p->valid) return;
  if (ExpressionAccept(p, "(")) {
    ExpressionTernary(p);
    ExpressionExpect(p, ")");
  } else if (isalpha((unsigned char)*p->at) || *p->at == '_') {
    ExpressionName(p);
  } else {
    value = strtod(p->at, &end);
    if (end == p->at || !(isdigit((unsigned char)*p->at) || *p->at == '.')) ExpressionInvalid(p);
    p->at = end;
    ExpressionWrite(p, NUMBER, 0, value);
  }
  p->depth--;
}

/* a ^ b, from the right; a sign before it is of the power, one after ^ of the exponent. */
static void ExpressionSigned(Parser *p)
{
  if (ExpressionAccept(p, "-")) {
    ExpressionSigned(p);
    ExpressionWrite(p, NEGATE, 1, 0);
  } else if (ExpressionAccept(p, "+")) {
    ExpressionSigned(p);
  } else {
    ExpressionPrimary(p);
    /* Powers associate from the right: the exponent is read by this function again. */
    if (!p->valid || !ExpressionAccept(p, "^")) return;
    ExpressionSigned(p);
    ExpressionWrite(p, POWER, 2, 0);
  }
}

/* Operators from the left, by precedence; longer names first. */
static const struct {
  const char *name;
  int op;
} operators[][7] = {{{"||", OR}},
                    {{"&&", AND}},
                    {{"<=", LE}, {">=", GE}, {"!=", NE}, {"==", EQ}, {"<", LT}, {">", GT}},
                    {{"+", PLUS}, {"-", MINUS}},
                    {{"*", TIMES}, {"/", OVER}}};
#define TIGHTEST 4

static void ExpressionOperand(Parser *p, int level)
{
  if (level > TIGHTEST)
    ExpressionSigned(p);
  else {
    ExpressionOperand(p, level + 1);
    for (int k = 0; p->valid && operators[level][k].name; k++) {
      if (!ExpressionAccept(p, operators[level][k].name)) continue;
      ExpressionOperand(p, level + 1);
      ExpressionWrite(p, BINARY + operators[level][k].op, 2, 0);
      k = -1; /* further operators of this level follow, beginning with the longest name */
    }
  }
}

static void ExpressionTernary(Parser *p)
{
  ExpressionOperand(p, 0);
  if (!p->valid || !ExpressionAccept(p, "?")) return;
  ExpressionTernary(p);
  ExpressionExpect(p, ":");
  ExpressionTernary(p);
  ExpressionWrite(p, SELECT, 3, 0);
}

/* What invalid text has added stays, and is not used. */
PetscErrorCode HycoParse(HycoScene scene, const char text[], const PetscReal x[3], const PetscReal minus[3],
                         HycoCode *code, PetscInt *at, PetscBool *uses, PetscBool *space)
{
  Parser p = {.scene = scene, .code = code, .valid = PETSC_TRUE};

  PetscFunctionBegin;
  *at = code->n;
  for (PetscInt k = 0; k < (minus ? 2 : 1); k++) {
    p.at = text;
    p.x = k ? minus : x;
    ExpressionTernary(&p);
    (void)ExpressionAccept(&p, "");
    if (*p.at) ExpressionInvalid(&p);
  }
  if (minus) ExpressionWrite(&p, BINARY + MINUS, 2, 0);
  ExpressionWrite(&p, END, 0, 0);
  if (!p.valid) *at = -1;
  if (uses) *uses = p.uses;
  if (space) *space = p.space;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A parameter of that name comes first. */
PetscErrorCode HycoExportHeat(HycoScene s, const char key[], const char text[], char **hot)
{
  static const char word[] = "temperature";
  const char *heat = NULL;
  HycoText t = {0};

  PetscFunctionBegin;
  for (PetscInt b = 0; b < s->n_bodies; b++) {
    const size_t n = strlen(s->body[b].name);

    if (!strncmp(key, "body_", 5) && !strncmp(key + 5, s->body[b].name, n) && key[5 + n] == '_' &&
        s->body[b].temperature)
      heat = HycoExportEntry(s, HycoExprKey(s->body[b].temperature));
  }
  for (PetscInt k = 0; k < s->n_variables; k++) heat = strcmp(s->parameter[k], word) ? heat : NULL;
  PetscCall(HycoTextAdd(&t, " "));
  while (*text) {
    size_t n = 0;

    while (isalnum((unsigned char)text[n]) || text[n] == '_') n++;
    if (heat && n == strlen(word) && !strncmp(text, word, n))
      PetscCall(HycoTextAdd(&t, "(%s)", heat));
    else
      PetscCall(HycoTextAdd(&t, "%.*s", (int)PetscMax(n, 1), text));
    text += PetscMax(n, 1);
  }
  *hot = t.text;
  PetscFunctionReturn(PETSC_SUCCESS);
}
