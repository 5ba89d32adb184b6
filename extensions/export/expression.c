/* Expressions of a scene in C: a parser of muParser's language that evaluates and translates in one pass. */
#include "export.h"
#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* The first pass only measures; the room doubles, so that a text of n bytes is copied O(1) times per byte. */
PetscErrorCode HycoTextAdd(HycoText *t, const char format[], ...)
{
  va_list list;
  int n;

  PetscFunctionBegin;
  va_start(list, format);
  n = vsnprintf(NULL, 0, format, list);
  va_end(list);
  if (t->n + (size_t)n + 1 > t->room) {
    t->room = 2 * t->room + (size_t)n + 64;
    PetscCall(PetscRealloc(t->room, &t->text));
  }
  va_start(list, format);
  t->n += (size_t)vsnprintf(t->text + t->n, t->room - t->n, format, list);
  va_end(list);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Added at the end first, which makes the room; then the tail moves over it. */
PetscErrorCode HycoTextInsert(HycoText *t, size_t at, const char words[])
{
  const size_t n = strlen(words);

  PetscFunctionBegin;
  PetscCall(HycoTextAdd(t, "%s", words));
  memmove(t->text + at + n, t->text + at, t->n - n - at);
  memcpy(t->text + at, words, n);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the parser: sub-expressions are written in brackets, so that C's precedence does not matter -- */

typedef struct {
  HycoScene scene;
  const char *at;
  const PetscReal *x, *mu;
  HycoText *c;
  PetscInt depth;
  PetscBool valid, uses, space;
} Parser;

static void Write(Parser *p, const char words[])
{
  if (p->c) PetscCallVoid(HycoTextAdd(p->c, "%s", words));
}

static size_t Here(const Parser *p)
{
  return p->c ? p->c->n : 0;
}

/* Operators are known after their left operand is written: what precedes it is inserted. */
static void WriteBefore(Parser *p, size_t at, const char words[])
{
  if (p->c) PetscCallVoid(HycoTextInsert(p->c, at, words));
}

static void WriteNumber(Parser *p, PetscReal value)
{
  char text[64];

  snprintf(text, sizeof(text), "%.17g", (double)value);
  /* A double constant in C: an integer one would divide as integers do. */
  if (!strpbrk(text, ".e")) strcat(text, ".0");
  Write(p, value < 0 ? "(" : "");
  Write(p, text);
  Write(p, value < 0 ? ")" : "");
}

/* Whether the next word is this one, which is skipped. */
static PetscBool Take(Parser *p, const char word[])
{
  while (isspace((unsigned char)*p->at)) p->at++;
  if (strncmp(p->at, word, strlen(word))) return PETSC_FALSE;
  p->at += strlen(word);
  return PETSC_TRUE;
}

static PetscReal Ternary(Parser *p);

static PetscReal Invalid(Parser *p)
{
  p->valid = PETSC_FALSE;
  return 0;
}

typedef struct {
  const char *name, *c;
  double (*f)(double);
} Function;
static const Function functions[] = {
    {"sin", "sin", sin},    {"cos", "cos", cos},       {"tan", "tan", tan},       {"asin", "asin", asin},
    {"acos", "acos", acos}, {"atan", "atan", atan},    {"sinh", "sinh", sinh},    {"cosh", "cosh", cosh},
    {"tanh", "tanh", tanh}, {"asinh", "asinh", asinh}, {"acosh", "acosh", acosh}, {"atanh", "atanh", atanh},
    {"log2", "log2", log2}, {"log10", "log10", log10}, {"log", "log", log},       {"ln", "log", log},
    {"exp", "exp", exp},    {"sqrt", "sqrt", sqrt},    {"abs", "fabs", fabs},     {"rint", "rint", rint}};

/* min, max, sum of several arguments. */
static PetscReal Several(Parser *p, const char before[], const char between[], size_t begin)
{
  PetscReal value = Ternary(p);

  while (p->valid && Take(p, ",")) {
    PetscReal next;

    WriteBefore(p, begin, before);
    Write(p, between);
    next = Ternary(p);
    Write(p, ")");
    /* By the text: "(" of a sum, fm[i]n or fm[a]x. */
    value = before[0] == '(' ? value + next : before[2] == 'i' ? PetscMin(value, next) : PetscMax(value, next);
  }
  if (!Take(p, ")")) return Invalid(p);
  return value;
}

static PetscReal Call(Parser *p, const char name[], size_t n)
{
  const size_t begin = Here(p);
  PetscReal value;

  if (n == 3 && !strncmp(name, "min", 3)) return Several(p, "fmin(", ", ", begin);
  if (n == 3 && !strncmp(name, "max", 3)) return Several(p, "fmax(", ", ", begin);
  if (n == 3 && !strncmp(name, "sum", 3)) return Several(p, "(", " + ", begin);
  for (size_t k = 0; k < sizeof(functions) / sizeof(functions[0]); k++) {
    if (strlen(functions[k].name) != n || strncmp(functions[k].name, name, n)) continue;
    Write(p, functions[k].c);
    Write(p, "(");
    value = functions[k].f(Ternary(p));
    Write(p, ")");
    return Take(p, ")") ? value : Invalid(p);
  }
  return Invalid(p);
}

/* A constant of the scene: its text in its place. */
static PetscReal Constant(Parser *p, const char text[])
{
  const char *after = p->at;
  PetscReal value;

  /* A constant that refers to itself would not end. */
  if (++p->depth > 100) return Invalid(p);
  p->at = text;
  value = Ternary(p);
  if (!Take(p, "") || *p->at) return Invalid(p);
  p->depth--;
  p->at = after;
  return value;
}

/* Parameters before constants before pi. Keys of constants are stored without regard to case. */
static PetscReal Name(Parser *p)
{
  const HycoScene s = p->scene;
  const char *name = p->at;
  size_t n = 0;
  char text[32];

  while (isalnum((unsigned char)name[n]) || name[n] == '_') n++;
  p->at += n;
  if (Take(p, "(")) return Call(p, name, n);
  for (PetscInt k = 0; k < s->n_variables; k++) {
    if (strlen(s->parameter[k]) != n || strncmp(s->parameter[k], name, n)) continue;
    snprintf(text, sizeof(text), "mu[%d]", (int)k);
    Write(p, text);
    p->uses = PETSC_TRUE;
    return p->mu[k];
  }
  for (PetscInt k = 0; k < s->n_constants; k++) {
    const char *key = s->key[s->constant[k]] + strlen("constant_");

    if (strlen(key) == n && !strncasecmp(key, name, n)) return Constant(p, s->value[s->constant[k]]);
  }
  if (n == 2 && !strncmp(name, "pi", 2)) {
    WriteNumber(p, PETSC_PI);
    return PETSC_PI;
  }
  if (n != 1 || name[0] < 'x' || name[0] > 'z') return Invalid(p);
  p->space = PETSC_TRUE;
  if (!p->x) {
    snprintf(text, sizeof(text), "x[%d]", name[0] - 'x');
    Write(p, text);
    return 0;
  }
  WriteNumber(p, p->x[name[0] - 'x']);
  return p->x[name[0] - 'x'];
}

static PetscReal Primary(Parser *p)
{
  PetscReal value;
  char *end;

  if (Take(p, "(")) {
    if (++p->depth > 100) return Invalid(p);
    value = Ternary(p);
    p->depth--;
    return Take(p, ")") ? value : Invalid(p);
  }
  if (isalpha((unsigned char)*p->at) || *p->at == '_') return Name(p);
  if (!isdigit((unsigned char)*p->at) && *p->at != '.') return Invalid(p);
  value = strtod(p->at, &end);
  if (end == p->at) return Invalid(p);
  p->at = end;
  WriteNumber(p, value);
  return value;
}

/* a ^ b, from the right; a sign before it is of the power, one after ^ of the exponent. */
static PetscReal Signed(Parser *p, PetscBool exponent)
{
  const size_t begin = Here(p);
  PetscReal value;

  if (Take(p, "-")) {
    Write(p, "(-");
    value = -Signed(p, exponent);
    Write(p, ")");
    return value;
  }
  if (Take(p, "+")) return Signed(p, exponent);
  value = Primary(p);
  /* Powers associate from the right: the exponent is read by this function again. */
  if (!p->valid || !Take(p, "^")) return value;
  WriteBefore(p, begin, "pow(");
  Write(p, ", ");
  value = pow(value, Signed(p, PETSC_TRUE));
  Write(p, ")");
  return value;
}

static PetscReal Apply(const char op[], PetscReal a, PetscReal b)
{
  switch (op[0]) {
  case '*':
    return a * b;
  case '/':
    return a / b;
  case '+':
    return a + b;
  case '-':
    return a - b;
  case '<':
    return op[1] ? a <= b : a < b;
  case '>':
    return op[1] ? a >= b : a > b;
  case '!':
    return a != b;
  case '=':
    return a == b;
  case '&':
    return a != 0 && b != 0;
  default:
    return a != 0 || b != 0;
  }
}

/* Operators from the left, by precedence; longer names first. */
static const char *const operators[][7] = {{"||"}, {"&&"}, {"<=", ">=", "!=", "==", "<", ">"}, {"+", "-"}, {"*", "/"}};
#define TIGHTEST 4

static PetscReal Binary(Parser *p, int level)
{
  const size_t begin = Here(p);
  PetscReal value = level == TIGHTEST ? Signed(p, PETSC_FALSE) : Binary(p, level + 1);

  for (int k = 0; p->valid && operators[level][k]; k++) {
    const char *op = operators[level][k];

    if (!Take(p, op)) continue;
    /* Comparisons are int in C, and 0 or 1 of a real in muParser. */
    WriteBefore(p, begin, level < 3 ? "(double)(" : "(");
    Write(p, " ");
    Write(p, op);
    Write(p, " ");
    value = Apply(op, value, level == TIGHTEST ? Signed(p, PETSC_FALSE) : Binary(p, level + 1));
    Write(p, ")");
    /* Further operators of this level follow from the left, beginning with the longest name. */
    k = -1;
  }
  return value;
}

static PetscReal Ternary(Parser *p)
{
  const size_t begin = Here(p);
  PetscReal value = Binary(p, 0), yes, no;

  if (!p->valid || !Take(p, "?")) return value;
  WriteBefore(p, begin, "(");
  Write(p, " != 0 ? ");
  yes = Ternary(p);
  if (!Take(p, ":")) return Invalid(p);
  Write(p, " : ");
  no = Ternary(p);
  Write(p, ")");
  return value != 0 ? yes : no;
}

/* c NULL evaluates only. On invalid text the value is 0 and c has a part of a text, which callers drop. */
PetscErrorCode HycoTranslate(HycoScene scene, const char text[], const PetscReal x[3], const PetscReal mu[],
                             PetscReal *value, HycoText *c, PetscBool *valid, PetscBool *uses, PetscBool *space)
{
  Parser p = {.scene = scene, .at = text, .x = x, .mu = mu, .c = c, .valid = PETSC_TRUE};

  PetscFunctionBegin;
  *value = Ternary(&p);
  (void)Take(&p, "");
  *valid = (PetscBool)(p.valid && !*p.at);
  if (uses) *uses = p.uses;
  if (space) *space = p.space;
  PetscFunctionReturn(PETSC_SUCCESS);
}
