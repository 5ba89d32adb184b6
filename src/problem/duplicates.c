/*
  Finds repeated keys in a YAML file, of which PETSc takes the last without a message. The file has already been read as
  YAML, so that the text is well formed: block and flow mappings, scalars (quoted, plain, block), lists, comments.
*/
#include "entries.h"
#include <stdlib.h>
#include <string.h>

#define DEEPEST 64

/* An open mapping or list, or a key whose value may be a mapping. */
typedef struct {
  PetscInt column; /* of a key in block style; -1: a brace or bracket */
  size_t path;     /* length of the path before it */
} Level;

typedef struct {
  const char *text, *at, *line_start;
  PetscInt line, depth, flow;
  Level level[DEEPEST];
  char path[HYCO_LINE], token[HYCO_LINE];
  PetscInt n, room;
  char **key;
  PetscInt *line_of;
} Scan;

static PetscErrorCode Push(Scan *s, PetscInt column)
{
  PetscFunctionBegin;
  HycoCheck(s->depth < DEEPEST, "the entries are nested deeper than %d levels, in line %d", DEEPEST, (int)s->line);
  s->level[s->depth].column = column;
  s->level[s->depth++].path = strlen(s->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void Pop(Scan *s)
{
  s->depth--;
  s->path[s->depth ? s->level[s->depth - 1].path : 0] = '\0';
}

static void Advance(Scan *s)
{
  if (*s->at == '\n') {
    s->line++;
    s->line_start = s->at + 1;
  }
  s->at++;
}

static void SkipLine(Scan *s)
{
  while (*s->at && *s->at != '\n') s->at++;
}

/* Reads the scalar at s->at into s->token (truncated to its size); s->at moves to its end. */
static void ReadScalar(Scan *s)
{
  const char quote = *s->at == '"' || *s->at == '\'' ? *s->at : '\0';
  size_t n = 0;

  if (quote) Advance(s);
  while (*s->at) {
    if (quote == '"' && *s->at == '\\' && s->at[1])
      Advance(s);
    else if (quote && *s->at == quote) {
      Advance(s);
      if (quote == '"' || *s->at != '\'') break;
    } else if (!quote &&
               (*s->at == '\n' || (*s->at == ':' && strchr(" \t\r\n", s->at[1])) ||
                (*s->at == '#' && s->at > s->text && strchr(" \t", s->at[-1])) || (s->flow && strchr(",[]{}", *s->at))))
      break;
    if (n + 1 < sizeof(s->token)) s->token[n++] = *s->at;
    Advance(s);
  }
  while (!quote && n && strchr(" \t\r", s->token[n - 1])) n--;
  s->token[n] = '\0';
}

/* Enters a key at `column`: its path becomes s->path. */
static PetscErrorCode TakeKey(Scan *s, PetscInt column, PetscInt line, const char file[])
{
  size_t length;
  int end;

  PetscFunctionBegin;
  if (s->flow) {
    while (s->depth && s->level[s->depth - 1].column >= 0) Pop(s); /* leaves the previous key of the same braces */
  } else {
    while (s->depth && s->level[s->depth - 1].column >= column) Pop(s);
  }
  length = strlen(s->path);
  end = snprintf(s->path + length, sizeof(s->path) - length, "%s%s", length ? "_" : "", s->token);
  /* a truncated scalar fills the token */
  HycoCheck(end >= 0 && length + (size_t)end + 1 < sizeof(s->path),
            "%s: the key in line %d is longer than %d characters", file, (int)line, HYCO_LINE - 2);
  for (PetscInt k = 0; k < s->n; k++)
    HycoCheck(strcasecmp(s->key[k], s->path), "%s: %s occurs twice, in line %d and in line %d; remove one of them",
              file, s->path, (int)s->line_of[k], (int)line);
  if (s->n == s->room) {
    s->room = 2 * s->room + 64;
    PetscCall(PetscRealloc((size_t)s->room * sizeof(*s->key), &s->key));
    PetscCall(PetscRealloc((size_t)s->room * sizeof(*s->line_of), &s->line_of));
  }
  PetscCall(PetscStrallocpy(s->path, &s->key[s->n]));
  s->line_of[s->n++] = line;
  PetscCall(Push(s, s->flow ? 0 : column));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Skips the lines of a block scalar: those indented deeper than the key at `column`. */
static void SkipBlock(Scan *s, PetscInt column)
{
  SkipLine(s);
  while (*s->at == '\n') {
    const char *next = s->at + 1;
    const size_t indent = strspn(next, " ");

    if (next[indent] && next[indent] != '\n' && next[indent] != '\r' && (PetscInt)indent <= column) return;
    Advance(s);
    SkipLine(s);
  }
}

/* A scalar: a key if a colon follows, else a value. */
static PetscErrorCode TakeScalar(Scan *s, const char file[])
{
  const PetscInt column = (PetscInt)(s->at - s->line_start), line = s->line;

  PetscFunctionBegin;
  ReadScalar(s);
  while (*s->at == ' ' || *s->at == '\t') s->at++;
  if (*s->at != ':') PetscFunctionReturn(PETSC_SUCCESS);
  s->at++;
  PetscCall(TakeKey(s, column, line, file));
  while (*s->at == ' ' || *s->at == '\t') s->at++;
  if (!s->flow && (*s->at == '|' || *s->at == '>')) SkipBlock(s, column);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An opening or closing brace or bracket. */
static PetscErrorCode TakeBrace(Scan *s)
{
  PetscFunctionBegin;
  if (*s->at == '{' || *s->at == '[') {
    s->flow++;
    PetscCall(Push(s, -1));
  } else {
    while (s->depth && s->level[s->depth - 1].column >= 0) Pop(s);
    if (s->depth) Pop(s);
    s->flow = PetscMax(0, s->flow - 1);
  }
  s->at++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ScanAll(Scan *s, const char file[])
{
  PetscFunctionBegin;
  while (*s->at) {
    const PetscBool first = (PetscBool)(s->at == s->line_start);

    if (strchr(" \t\r\n,", *s->at))
      Advance(s);
    else if (*s->at == '#' || (first && (*s->at == '%' || strncmp(s->at, "---", 3) == 0)))
      SkipLine(s);
    else if (strchr("{}[]", *s->at))
      PetscCall(TakeBrace(s));
    else if (*s->at == '-' && strchr(" \t\r\n", s->at[1])) {
      const PetscInt column = (PetscInt)(s->at - s->line_start);
      size_t length;

      while (s->depth && s->level[s->depth - 1].column > column) Pop(s);
      length = strlen(s->path);
      snprintf(s->path + length, sizeof(s->path) - length, "#%d", (int)s->line); /* each item has its own keys */
      PetscCall(Push(s, column + 1));
      s->at++;
    } else if (strchr("&*!", *s->at))
      while (*s->at && !strchr(" \t\r\n,{}[]", *s->at)) s->at++;
    else
      PetscCall(TakeScalar(s, file));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoEntriesCheckTwice(const char text[], const char file[])
{
  Scan s = {0};
  PetscErrorCode ierr;

  PetscFunctionBegin;
  s.text = s.at = s.line_start = text;
  s.line = 1;
  ierr = ScanAll(&s, file);
  for (PetscInt k = 0; k < s.n; k++) PetscCall(PetscFree(s.key[k]));
  PetscCall(PetscFree(s.key));
  PetscCall(PetscFree(s.line_of));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
