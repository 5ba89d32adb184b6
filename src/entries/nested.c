/*
  Nested lists in a scene's YAML, which PETSc cannot read: [[0, 1], [10, 2.5]] becomes [ 0 1 , 10 2.5 ], a list of the
  scalars "0 1" and "10 2.5". All characters keep their positions, so that messages have the right line numbers.
*/
#include <hycoentries.h>
#include <string.h>

/* The position after a quoted scalar. */
static char *SkipQuoted(char *c)
{
  const char quote = *c++;

  while (*c && *c != quote) c += quote == '"' && *c == '\\' && c[1] ? 2 : 1;
  return *c ? c + 1 : c;
}

/* Whether a scalar, a list or a mapping may begin here: after a separator and blanks. Elsewhere brackets and
   quotes are part of a plain scalar. */
static PetscBool NestedPrefixLength(const char text[], const char *c)
{
  while (c > text && (c[-1] == ' ' || c[-1] == '\t')) c--;
  return (PetscBool)(c == text || strchr(":,[{-\n", c[-1]));
}

/* "- [0, 1]": an item of a block list that is itself a list. */
static PetscBool IsItem(const char line[])
{
  line += strspn(line, " \t");
  return (PetscBool)(line[0] == '-' && strchr(" \t", line[1]) && line[1 + strspn(line + 1, " \t")] == '[');
}

/* Changes the text in place; true if it changed anything. Comments and quoted texts stay as they are. PETSc's YAML
   reader knows lists of scalars only; [[0, 1], [2, 3]] becomes [0 1, 2 3], which HycoSceneReadHistory() understands. */
PetscBool HycoEntriesFlatten(char text[])
{
  PetscInt depth = 0; /* of open brackets */
  PetscBool nested = PETSC_FALSE;
  const char *line = text;

  for (char *c = text; *c;) {
    if (*c == '\n') line = c + 1;
    if (*c == '#' && (c == text || strchr(" \t\n", c[-1]))) {
      c += strcspn(c, "\n");
    } else if ((*c == '"' || *c == '\'') && NestedPrefixLength(text, c)) {
      c = SkipQuoted(c);
    } else if (*c == '[' && (depth || NestedPrefixLength(text, c))) {
      /* treated as if the list around it had brackets */
      if (!depth && IsItem(line)) depth = 1;
      if (++depth == 2) {
        *c = ' ';
        nested = PETSC_TRUE;
      }
      c++;
    } else if (*c == ']' && depth) {
      if (--depth == 1) *c = ' ';
      if (depth == 1 && IsItem(line)) depth = 0;
      c++;
    } else {
      if (*c == ',' && depth == 2) *c = ' ';
      c++;
    }
  }
  return nested;
}
