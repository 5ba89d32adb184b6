/* The entries of a history as text, stored in the files computed with it, so that a message can name a difference. */
#include <hycosceneimpl.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

enum { LONG = 60 }; /* characters of a value that a message shows */

static PetscBool OfHistory(const char key[])
{
  return (PetscBool)(strncasecmp(key, "history_", 8) == 0);
}

/* A line for each entry: "key value". Ends of lines inside a value become blanks, so that lines stay entries. */
PetscErrorCode HycoSceneWriteHistory(HycoScene s, char **text)
{
  size_t room = 1;
  char *end;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n_entries; k++) {
    if (OfHistory(s->key[k])) room += strlen(s->key[k]) + strlen(s->value[k]) + 2;
  }
  /* A blank and an end of line for each entry are the 2 of the sum, the final zero its first 1. */
  PetscCall(PetscCalloc1(room, text));
  end = *text;
  for (PetscInt k = 0; k < s->n_entries; k++) {
    if (!OfHistory(s->key[k])) continue;
    end += sprintf(end, "%s ", s->key[k]);
    for (const char *c = s->value[k]; *c; c++) *end++ = *c == '\n' ? ' ' : *c;
    *end++ = '\n';
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The value in the line of `text` that begins with the key, and its length; NULL: there is no such line. *length
   is then that of the word "missing", which the message prints. */
static const char *FindValue(const char text[], const char key[], int n_key, int *length)
{
  for (const char *line = text; *line; line += *line == '\n') {
    const int n = (int)strcspn(line, "\n");

    *length = n - n_key - 1;
    if (*length >= 0 && line[n_key] == ' ' && strncasecmp(line, key, (size_t)n_key) == 0) return line + n_key + 1;
    line += n;
  }
  *length = (int)strlen("missing");
  return NULL;
}

/* Start of the part of two long values that a message shows: the entry of the list in which they first differ. */
static int FirstDifference(const char a[], int n_a, const char b[], int n_b)
{
  int same = 0, from = 0;

  if (PetscMax(n_a, n_b) <= LONG) return 0;
  for (; same < PetscMin(n_a, n_b) && a[same] == b[same]; same++) from = a[same] == ',' ? same + 1 : from;
  return from;
}

/* Compares the line at `line` of one of two texts in both; what[]: the difference, or empty. The precision limits
   both parts: an array of thousands of times must not fill the message. */
static void CompareLine(const char line[], const char made[], const char here[], char what[HYCO_LINE])
{
  const int n_key = (int)strcspn(line, " \n");
  int n_was, n_is, from = 0;
  const char *was = FindValue(made, line, n_key, &n_was), *is = FindValue(here, line, n_key, &n_is);

  what[0] = '\0';
  if (was && is && n_was == n_is && strncmp(was, is, (size_t)n_was) == 0) return;
  /* Long values are shown from where they begin to differ: their beginnings, which agree, would hide the difference. */
  if (was && is) from = FirstDifference(was, n_was, is, n_is);
  snprintf(what, HYCO_LINE, "%.*s is %s%.*s in the scene and %s%.*s in the file", n_key, line, from ? "...," : "",
           PetscMin(n_is - from, LONG), is ? is + from : "missing", from ? "...," : "", PetscMin(n_was - from, LONG),
           was ? was + from : "missing");
}

/* Reduced paths and stored solutions have one row for each listed time: with another history they would be read at
   wrong times without any error. The first entry that differs is named, from either side. */
PetscErrorCode HycoSceneCompareHistory(HycoScene scene, const char made[], const char path[])
{
  char *here, what[HYCO_LINE] = "";

  PetscFunctionBegin;
  PetscCall(HycoSceneWriteHistory(scene, &here));
  /* Both texts' lines, to find entries that only one has. */
  for (int j = 0; j < 2; j++) {
    for (const char *line = j ? made : here; *line && !what[0]; line += strcspn(line, "\n") + 1)
      CompareLine(line, made, here, what);
  }
  PetscCall(PetscFree(here));
  HycoCheck(!what[0], "%s was made with another history: %s; give that history, or make the file anew", path, what);
  PetscFunctionReturn(PETSC_SUCCESS);
}
