/*
  Checks a scene's YAML before PETSc reads it, by libyaml's events, which have lines: the syntax; lists and mappings
  that PETSc cannot read; and repeated keys, of which PETSc takes the last without a message.
*/
#include <hycoentries.h>
#include <stdlib.h>
#include <string.h>
#include <yaml.h>

#define DEEPEST 64

/* The line of a position in the text, from 1. libyaml gives none for bytes that are not UTF-8. */
static int LineAt(const char text[], size_t at)
{
  int line = 1;

  for (size_t k = 0; k < at && text[k]; k++) line += text[k] == '\n';
  return line;
}

/* What is wrong, after the parser has stopped. Also where the open bracket or quote began, which is often the real
   mistake. */
static void YamlDescribe(const yaml_parser_t *p, const char text[], char problem[HYCO_LINE])
{
  const PetscBool bytes = (PetscBool)(p->error == YAML_READER_ERROR);
  const int line = bytes ? LineAt(text, p->problem_offset) : (int)p->problem_mark.line + 1;

  snprintf(problem, HYCO_LINE, "line %d: %s", line, p->problem ? p->problem : "there is no memory");
  if (p->context && (int)p->context_mark.line + 1 != line)
    snprintf(problem + strlen(problem), HYCO_LINE - strlen(problem), " (%s in line %d)", p->context,
             (int)p->context_mark.line + 1);
}

/* What an event does not allow; depth: of open lists and mappings. */
static void YamlRefuse(const yaml_event_t *event, int depth, int documents, char problem[HYCO_LINE])
{
  const int line = (int)event->start_mark.line + 1;

  if (depth > DEEPEST)
    snprintf(problem, HYCO_LINE, "line %d: brackets and entries are nested deeper than %d levels", line, DEEPEST);
  else if (documents > 1)
    snprintf(problem, HYCO_LINE, "line %d: a second document begins; remove this line", line);
}

static PetscBool YamlBegin(yaml_parser_t *parser, const char text[])
{
  if (!yaml_parser_initialize(parser)) return PETSC_FALSE;
  yaml_parser_set_input_string(parser, (const unsigned char *)text, strlen(text));
  return PETSC_TRUE;
}

/* Event by event, so that deep nesting, for which libyaml takes minutes, is found first. */
static void CheckEvents(yaml_parser_t *parser, const char text[], char problem[HYCO_LINE])
{
  yaml_event_t event;
  int depth = 0, documents = 0;
  PetscBool more = PETSC_TRUE;

  while (more && !problem[0]) {
    if (!yaml_parser_parse(parser, &event)) {
      YamlDescribe(parser, text, problem);
      return;
    }
    more = (PetscBool)(event.type != YAML_STREAM_END_EVENT);
    documents += event.type == YAML_DOCUMENT_START_EVENT;
    depth += event.type == YAML_MAPPING_START_EVENT || event.type == YAML_SEQUENCE_START_EVENT;
    depth -= event.type == YAML_MAPPING_END_EVENT || event.type == YAML_SEQUENCE_END_EVENT;
    YamlRefuse(&event, depth, documents, problem);
    yaml_event_delete(&event);
  }
}

/* Twice, because events know no aliases: the second pass builds the document, after the first has bounded its depth.
   problem[] is one line, with the number of the line in the file. */
PetscBool HycoYAMLHasProblem(const char text[], char problem[HYCO_LINE])
{
  yaml_parser_t parser;
  yaml_document_t document;

  if (!text || !problem) return PETSC_TRUE;
  problem[0] = '\0';
  if (YamlBegin(&parser, text)) {
    CheckEvents(&parser, text, problem);
    yaml_parser_delete(&parser);
  }
  if (!problem[0] && YamlBegin(&parser, text)) { /* aliases that are not defined */
    if (yaml_parser_load(&parser, &document))
      yaml_document_delete(&document);
    else
      YamlDescribe(&parser, text, problem);
    yaml_parser_delete(&parser);
  }
  return (PetscBool)(problem[0] != '\0');
}

/* An open list or mapping. */
typedef struct {
  PetscBool list, key; /* key: a mapping whose next scalar is a key */
  PetscInt n, line;    /* items, or keys and values; where it begins */
  size_t path;         /* length of the path before its keys */
} Level;

typedef struct {
  const char *file;
  PetscInt depth, line; /* of open levels; of the event */
  Level level[DEEPEST + 1];
  char path[HYCO_LINE]; /* of the last key: "body_pellet_young" */
  PetscInt n, room;
  char **key;
  PetscInt *line_of;
} Scan;

/* A key: its path becomes s->path. The path is compared, not the key: "young" of two bodies is no repetition. Without
   letter case, as in PETSc's database. In PETSc's form, a_b_c, in which two ways of nesting may give the same entry. */
static PetscErrorCode TakeKey(Scan *s, const char word[])
{
  const size_t length = strlen(s->path);
  const int end = snprintf(s->path + length, sizeof(s->path) - length, "%s%s", length ? "_" : "", word);

  PetscFunctionBegin;
  HycoCheck(end >= 0 && length + (size_t)end + 1 < sizeof(s->path),
            "%s: the key in line %d is longer than %d characters", s->file, (int)s->line, HYCO_LINE - 2);
  for (PetscInt k = 0; k < s->n; k++)
    HycoCheck(strcasecmp(s->key[k], s->path), "%s: %s occurs twice, in line %d and in line %d; remove one of them",
              s->file, s->path, (int)s->line_of[k], (int)s->line);
  if (s->n == s->room) {
    s->room = 2 * s->room + 64;
    PetscCall(PetscRealloc((size_t)s->room * sizeof(*s->key), &s->key));
    PetscCall(PetscRealloc((size_t)s->room * sizeof(*s->line_of), &s->line_of));
  }
  PetscCall(PetscStrallocpy(s->path, &s->key[s->n]));
  s->line_of[s->n++] = s->line;
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define NOT_FOR_HYCO "%s is not valid YAML for hyco: line %d: "

/* A value: a list, a mapping, or (scalar) neither; block: a list without brackets. */
static PetscErrorCode TakeValue(Scan *s, PetscBool scalar, PetscBool list, PetscBool block)
{
  Level *of = s->depth ? &s->level[s->depth - 1] : NULL;
  const PetscBool inner = (PetscBool)(list && of && of->list),
                  nested = (PetscBool)(!scalar && s->depth > 1 && of->list && s->level[s->depth - 2].list);

  PetscFunctionBegin;
  HycoCheck(of || !(scalar || list), NOT_FOR_HYCO "a text or a list; write entries, NAME: VALUE", s->file,
            (int)s->line);
  HycoCheck(!of || !of->key, NOT_FOR_HYCO "a key is a list, a mapping or an alias; write NAME: VALUE", s->file,
            (int)s->line);
  HycoCheck(!nested && !(inner && block),
            NOT_FOR_HYCO "a list of lists has only numbers or texts, in brackets: [[0, 1], [10, 2.5]]", s->file,
            (int)s->line);
  if (of) {
    of->n++;
    of->key = (PetscBool)!of->list;
  }
  if (of && of->list) /* each item has its own keys */
    snprintf(s->path + of->path, sizeof(s->path) - of->path, "#%d", (int)of->n);
  if (!scalar) s->level[s->depth++] = (Level){list, (PetscBool)!list, 0, s->line, strlen(s->path)};
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The last list or mapping ends. The path's end is cut at the next key. */
static PetscErrorCode TakeEnd(Scan *s)
{
  const Level *ended = &s->level[--s->depth];

  PetscFunctionBegin;
  HycoCheck(ended->list || ended->n == 2 || !s->depth || !s->level[s->depth - 1].list,
            NOT_FOR_HYCO "an item of a list has %d entries, and one is possible; write a mapping instead of the list",
            s->file, (int)ended->line, (int)ended->n / 2);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A scalar in a mapping is a key or a value in turn; libyaml's events do not tell which. of->key tells whether the next
   scalar is a key. */
static PetscErrorCode TakeEvent(Scan *s, const yaml_event_t *event)
{
  Level *of = s->depth ? &s->level[s->depth - 1] : NULL;
  const PetscBool scalar = (PetscBool)(event->type == YAML_SCALAR_EVENT);

  PetscFunctionBegin;
  s->line = (PetscInt)event->start_mark.line + 1;
  if (event->type == YAML_MAPPING_END_EVENT || event->type == YAML_SEQUENCE_END_EVENT)
    PetscCall(TakeEnd(s));
  else if (event->type == YAML_SEQUENCE_START_EVENT)
    PetscCall(TakeValue(s, PETSC_FALSE, PETSC_TRUE,
                        (PetscBool)(event->data.sequence_start.style == YAML_BLOCK_SEQUENCE_STYLE)));
  else if (event->type == YAML_MAPPING_START_EVENT)
    PetscCall(TakeValue(s, PETSC_FALSE, PETSC_FALSE, PETSC_FALSE));
  else if (scalar && of && of->key) {
    s->path[of->path] = '\0'; /* leaves the previous key */
    of->key = PETSC_FALSE;
    of->n++;
    PetscCall(TakeKey(s, (const char *)event->data.scalar.value));
  } else if (scalar || event->type == YAML_ALIAS_EVENT)
    PetscCall(TakeValue(s, PETSC_TRUE, PETSC_FALSE, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The text has no problem of syntax. An error of the scan ends it; the event is freed before. */
static PetscErrorCode ScanAll(Scan *s, yaml_parser_t *parser)
{
  PetscBool more = PETSC_TRUE;
  yaml_event_t event;

  PetscFunctionBegin;
  while (more && yaml_parser_parse(parser, &event)) {
    more = (PetscBool)(event.type != YAML_STREAM_END_EVENT);
    HycoFinally(TakeEvent(s, &event), yaml_event_delete(&event));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Before PETSc reads the text: what it would accept silently is refused with a line number. */
PetscErrorCode HycoEntriesCheck(const char text[], const char file[])
{
  Scan s = {.file = file};
  char problem[HYCO_LINE];
  yaml_parser_t parser;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  HycoCheck(!HycoYAMLHasProblem(text, problem), "%s is not valid YAML for hyco: %s", file, problem);
  PetscCheck(YamlBegin(&parser, text), PETSC_COMM_SELF, PETSC_ERR_MEM, "libyaml has no memory");
  ierr = ScanAll(&s, &parser);
  yaml_parser_delete(&parser);
  for (PetscInt k = 0; k < s.n; k++) PetscCall(PetscFree(s.key[k]));
  HycoFreeAll(&s.key, &s.line_of);
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
