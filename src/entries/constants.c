/* Named constants of a scene, which may be expressions and are substituted in other expressions: constant: {stiff:
   2e5, soft: stiff/10}. */
#include <hycosceneimpl.h>
#include <ctype.h>
#include <string.h>

#define SECTION "constant_"
#define LONGEST 16384 /* characters of an expression after substitution */

static const char *ConstantsName(HycoScene s, PetscInt c)
{
  return s->key[s->constant[c]] + strlen(SECTION);
}

/* A constant must not hide a variable that some expression uses under the same name. Letter case is ignored, since
   options have none. */
static PetscErrorCode CheckName(HycoScene s, const char key[], const char name[])
{
  PetscFunctionBegin;
  HycoCheck(HycoIsVariableName(name) && strcmp(name, "temperature"),
            "%s: \"%s\" cannot name a constant; use letters, digits and _, and none of x, y, z, pi, temperature", key,
            name);
  for (PetscInt p = 0; p < s->n_variables; p++)
    HycoCheck(strcasecmp(s->parameter[p], name),
              "%s: %s is already the name of a parameter, of t or of a table; rename it", key, name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Appends `text` with its constants substituted, in brackets. depth: nesting of constants, to detect cycles. A chain of
   constants that refers to no one twice is at most n_constants deep. out[] is one buffer for the whole recursion. */
static PetscErrorCode ConstantsExpand(HycoScene s, const char key[], const char text[], PetscInt depth,
                                      char out[LONGEST])
{
  size_t at = strlen(out);

  PetscFunctionBegin;
  while (*text) {
    size_t n = 1;
    PetscInt c = s->n_constants;

    if (isalpha((unsigned char)*text) || *text == '_') {
      while (isalnum((unsigned char)text[n]) || text[n] == '_') n++;
      for (c = 0; c < s->n_constants; c++) {
        if (strlen(ConstantsName(s, c)) == n && strncasecmp(ConstantsName(s, c), text, n) == 0) break;
      }
    } else if (isdigit((unsigned char)*text) || *text == '.') { /* the e5 of 1e5 is not a name */
      while (isalnum((unsigned char)text[n]) || text[n] == '.') n++;
    }
    /* Two brackets and the zero at the end. */
    HycoCheck(at + n + 3 < LONGEST, "%s: with its constants inserted, the expression is longer than %d characters", key,
              LONGEST);
    if (c < s->n_constants) {
      HycoCheck(depth < s->n_constants,
                "%s: the constant %s refers to itself; definitions of constants must not be circular", key,
                ConstantsName(s, c));
      strcpy(out + at, "(");
      PetscCall(ConstantsExpand(s, key, s->value[s->constant[c]], depth + 1, out));
      at = strlen(out);
      out[at++] = ')';
    } else {
      memcpy(out + at, text, n);
      at += n;
    }
    out[at] = '\0';
    text += n;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Substituted as text, in brackets, because muParser's own constants are numbers and could not depend on
   parameters. */
PetscErrorCode HycoSceneExpression(HycoScene s, const char key[], const char text[], HycoExpr *expr)
{
  const char *const *names = (const char *const *)s->parameter;
  char *whole;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  if (!s->n_constants) {
    PetscCall(HycoExprCreate(key, text, s->n_variables, names, expr));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscCalloc1(LONGEST, &whole));
  ierr = ConstantsExpand(s, key, text, 0, whole);
  if (!ierr) ierr = HycoExprCreate(key, whole, s->n_variables, names, expr);
  PetscCall(PetscFree(whole));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All are listed before one is expanded: they may refer to each other in any order. Before any other expression of the
   scene is read. */
PetscErrorCode HycoSceneReadConstants(HycoScene s)
{
  HycoExpr tried = NULL;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(s->n_entries, &s->constant));
  for (PetscInt k = 0; k < s->n_entries; k++) {
    if (strncasecmp(s->key[k], SECTION, strlen(SECTION))) continue;
    PetscCall(CheckName(s, s->key[k], s->key[k] + strlen(SECTION)));
    s->constant[s->n_constants++] = k;
  }
  for (PetscInt c = 0; c < s->n_constants; c++) { /* unused constants are checked too */
    PetscCall(HycoSceneExpression(s, s->key[s->constant[c]], s->value[s->constant[c]], &tried));
    PetscCall(HycoExprDestroy(&tried));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
