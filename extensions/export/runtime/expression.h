/* Expressions of a scene in reverse Polish notation, each until its END, and the functions of the parameters made of
   them. */
#ifndef HYCO_EXPRESSION
#define HYCO_EXPRESSION
#include <math.h>

/* The first three are followed by a number: a value; which variable, or component of the place. */
enum { NUMBER, VARIABLE, PLACE, END, NEGATE, SELECT, LEAST, GREATEST, POWER };
enum {
  TIMES,
  OVER,
  PLUS,
  MINUS,
  LE,
  GE,
  NE,
  EQ,
  LT,
  GT,
  AND,
  OR,
  ATAN2,
  HYPOT,
  MODULO,
  BINARY = 16,
  UNARY = 32,
  DEPTH = 64
}; /* BINARY + TIMES, ... */

static inline double sign_of(double a)
{
  return (a > 0) - (a < 0);
}

static double (*const function_of[])(double) = {sin,  cos,   tan,   asin,  acos,  atan,  sinh,   cosh,
                                                tanh, asinh, acosh, atanh, log2,  log10, log,    log,
                                                exp,  sqrt,  fabs,  rint,  floor, ceil,  sign_of};

static inline double apply(int op, double a, double b)
{
  switch (op) {
  case LEAST:
    return a < b ? a : b;
  case GREATEST:
    return a < b ? b : a;
  case POWER:
    return pow(a, b);
  case BINARY + TIMES:
    return a * b;
  case BINARY + OVER:
    return a / b;
  case BINARY + PLUS:
    return a + b;
  case BINARY + MINUS:
    return a - b;
  case BINARY + LE:
    return a <= b;
  case BINARY + GE:
    return a >= b;
  case BINARY + NE:
    return a != b;
  case BINARY + EQ:
    return a == b;
  case BINARY + LT:
    return a < b;
  case BINARY + GT:
    return a > b;
  case BINARY + AND:
    return a != 0 && b != 0;
  case BINARY + ATAN2:
    return atan2(a, b);
  case BINARY + HYPOT:
    return hypot(a, b);
  case BINARY + MODULO:
    return a - b * floor(a / b);
  default:
    return a != 0 || b != 0;
  }
}

/* The value for variables v at the place x. */
static inline double value_of(const double *code, const double v[], const double x[])
{
  double s[DEPTH];
  int n = 0;

  for (; (int)*code != END; code++) {
    const int op = (int)*code;

    if (op <= PLACE) {
      ++code;
      s[n++] = op == NUMBER ? *code : op == VARIABLE ? v[(int)*code] : x[(int)*code];
    } else if (op == NEGATE) {
      s[n - 1] = -s[n - 1];
    } else if (op == SELECT) {
      n -= 2;
      s[n - 1] = s[n - 1] != 0 ? s[n] : s[n + 1];
    } else if (op >= UNARY) {
      s[n - 1] = function_of[op - UNARY](s[n - 1]);
    } else {
      n--;
      s[n - 1] = apply(op, s[n - 1], s[n]);
    }
  }
  return s[0];
}

/* The product of the expressions f[0], f[1], f[2] over f[3], by their values; each -1: 1. */
static inline double product(const int f[4], const double value[])
{
  return (f[0] < 0 ? 1 : value[f[0]]) * (f[1] < 0 ? 1 : value[f[1]]) * (f[2] < 0 ? 1 : value[f[2]]) /
         (f[3] < 0 ? 1 : value[f[3]]);
}

#endif
