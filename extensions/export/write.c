/* The file of a model's program: declarations in FILE.h; the runtime, the arrays, the functions of the parameters in
   FILE.c. */
#include "export.h"
#include <hycofile.h>
#include <ctype.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* By extension.cmake: what the library and a program share, and the parts of both files that are alike but for the
   prefix. */
extern const char HycoExport_runtime[], HycoExport_header_h[], HycoExport_predict_h[], HycoExport_step_h[],
    HycoExport_flow[], HycoExport_calls_c[], HycoExport_predict_c[], HycoExport_step_c[];

#define ADD(...) PetscCall(HycoTextAdd(__VA_ARGS__))

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

/* -- names -- */

/* The text of an entry, or "". Borrowed. */
const char *HycoExportEntry(HycoScene s, const char key[])
{
  for (PetscInt k = 0; k < s->n_entries; k++) {
    if (!strcmp(s->key[k], key)) return s->value[k];
  }
  return "";
}

/* "parameter_NAME_unit", or "". */
static const char *UnitOf(HycoScene s, const char parameter[])
{
  char key[HYCO_LINE];

  HycoFormat(key, "parameter_%s_unit", parameter);
  return HycoExportEntry(s, key);
}

/* The beginning of all names: that of the model's file, as an identifier. */
static void PrefixOf(const char path[], char prefix[64])
{
  const char *name = strrchr(path, '/');
  size_t n = 0;

  name = name ? name + 1 : path;
  if (!isalpha((unsigned char)name[0])) prefix[n++] = 'm';
  for (; *name && *name != '.' && n < 40; name++) prefix[n++] = isalnum((unsigned char)*name) ? *name : '_';
  prefix[n] = '\0';
}

/* A text within quotes, or (comment) in a comment. */
static PetscErrorCode AddWords(HycoText *t, const char words[], PetscBool comment)
{
  PetscFunctionBegin;
  for (; *words; words++) {
    const char c = *words;

    if (!comment && (c == '"' || c == '\\')) ADD(t, "\\");
    /* Bytes of UTF-8 pass; in a comment nothing may end it. */
    ADD(t, "%c", isprint((unsigned char)c) && !(comment && (c == '*' || c == '/')) ? c : c < 0 ? c : ' ');
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A text with MODEL replaced by the prefix. */
static PetscErrorCode AddNamed(HycoText *t, const char text[], const char prefix[])
{
  PetscFunctionBegin;
  for (const char *next; (next = strstr(text, "MODEL")); text = next + strlen("MODEL"))
    ADD(t, "%.*s%s", (int)(next - text), text, prefix);
  ADD(t, "%s", text);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode WriteHeader(const HycoExportModel *m, HycoScene s, const char prefix[], HycoText *t)
{
  PetscFunctionBegin;
  ADD(t, "/* Predictions of a model of hyco %s: ", HycoVersion());
  PetscCall(AddWords(t, s->title, PETSC_TRUE));
  ADD(t, ".\n\n   Parameters:\n");
  for (PetscInt p = 0; p < s->n_parameters; p++)
    ADD(t, "     %d %s %s, %.10g to %.10g\n", (int)p, s->parameter[p], UnitOf(s, s->parameter[p]), (double)s->lo[p],
        (double)s->hi[p]);
  ADD(t, "   Outputs:\n");
  for (PetscInt k = 0; k < m->m.n_outputs; k++) ADD(t, "     %d %s %s\n", (int)k, m->name[k], m->unit[k]);
  ADD(t, "*/\n#ifndef HYCO_%s_H\n#define HYCO_%s_H\n\n#include <stddef.h>\n\n", prefix, prefix);
  ADD(t, "#if defined(__cplusplus)\nextern \"C\" {\n#endif\n\n");
  ADD(t, "enum { %s_N_PARAMETERS = %d, %s_N_OUTPUTS = %d };\n", prefix, (int)s->n_parameters, prefix,
      (int)m->m.n_outputs);
  if (s->n_times)
    ADD(t, "enum { %s_N_TIMES = %d, %s_N_STATES = %d };\n", prefix, (int)s->n_times, prefix, (int)m->n_states);
  ADD(t, "\n");
  PetscCall(AddNamed(t, HycoExport_header_h, prefix));
  PetscCall(AddNamed(t, s->n_times ? HycoExport_step_h : HycoExport_predict_h, prefix));
  ADD(t, "\n#if defined(__cplusplus)\n}\n#endif\n#endif\n");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the program -- */

/* An array: type and member of the model, or a name seen from outside if this begins with a '_'; n items of `width`
   numbers each, 0: they are numbers; own: the address of its pointer. */
typedef struct {
  const char *type, *name;
  size_t n, width;
  const void *data;
  void *own;
} Array;

#define MOST_ARRAYS 56
#define OWN(array)  (array), &(array)

static int ProgramList(HycoExportModel *e, HycoScene s, Array list[MOST_ARRAYS])
{
  Model *m = &e->m;
  Surfaces *f = &m->surfaces;
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_places, of = (size_t)m->n_stiffness, slip = (size_t)m->n_slip,
               terms = (size_t)m->n_terms, points = (size_t)(f->nq * f->nf), nodes = (size_t)f->n_nodes,
               dofs = nodes * (size_t)f->dim, tables = (size_t)m->n_tables,
               rows = tables ? (size_t)m->table[tables] : 0, modes = (size_t)m->n_modes, flowing = (size_t)m->n_flowing;
  const Array all[] = {
      {"double", "_lo", (size_t)s->n_parameters, 0, s->lo, NULL},
      {"double", "_hi", (size_t)s->n_parameters, 0, s->hi, NULL},
      {"double", "_time", (size_t)s->n_times, 0, s->times, NULL},
      {"double", "code", (size_t)e->code.n, 0, OWN(m->code)},
      {"int", "atom", (size_t)m->n_atoms, 0, OWN(m->atom)},
      {"int", "function", 4 * (size_t)m->n_functions, 0, OWN(m->function)},
      {"double", "offset", (p + n + (size_t)m->n_values) * (size_t)m->n_functions, 0, OWN(m->offset)},
      {"int", "stiffness", of, 0, OWN(m->stiffness)},
      {"double", "W", nodes ? 0 : of * n * (n + 1) / 2, 0, OWN(m->W)},
      {"double", "A", of * p * n, 0, OWN(m->A)},
      {"int", "value", terms, 0, OWN(m->value)},
      {"int", "factor", terms, 0, OWN(m->factor)},
      {"double", "term", terms * (p + n + modes), 0, OWN(m->term)},
      {"int", "contact", (size_t)e->n_contact, 0, OWN(m->contact)},
      {"double", "weight", (size_t)e->n_weights, 0, OWN(m->weight)},
      {"Output", "output", (size_t)m->n_outputs, 6, OWN(m->output)},
      {"Block", "block", (size_t)m->n_blocks, 4, OWN(m->block)},
      {"double", "flexibility", (size_t)e->n_flexible, 0, OWN(m->flexibility)},
      {"int", "row", slip ? slip + 1 : 0, 0, OWN(m->row)},
      {"int", "coefficient", slip, 0, OWN(m->coefficient)},
      {"int", "normal", slip ? (size_t)m->n_contacts : 0, 0, OWN(m->normal)},
      {"int", "table", tables ? tables + 1 : 0, 0, OWN(m->table)},
      {"double", "table_t", rows, 0, OWN(m->table_t)},
      {"double", "table_value", rows, 0, OWN(m->table_value)},
      {"double", "stop", (size_t)m->n_stops, 0, OWN(m->stop)},
      {"Flowing", "flowing", flowing, 4, OWN(m->flowing)},
      {"int", "constant", flowing * SLOTS, 0, OWN(m->constant)},
      {"double", "point", 3 * (size_t)m->n_points, 0, OWN(m->point)},
      {"double", "P", of * modes * n, 0, OWN(m->P)},
      {"double", "T", (size_t)(m->n_chosen * m->n_strain) * modes, 0, OWN(m->T)},
      {"int", "lost_value", (size_t)m->n_lost, 0, OWN(m->lost_value)},
      {"int", "lost_at", (size_t)m->n_lost, 0, OWN(m->lost_at)},
      {"double", "lost_share", (size_t)m->n_lost, 0, OWN(m->lost_share)},
      {"double", "surfaces.w", (size_t)f->nq, 0, OWN(f->w)},
      {"double", "surfaces.N", points, 0, OWN(f->N)},
      {"double", "surfaces.dN", 2 * points, 0, OWN(f->dN)},
      {"Surface", "surfaces.surface", (size_t)e->n_surfaces, 6, OWN(f->surface)},
      {"Facing", "surfaces.search", (size_t)f->n_searches, 5, OWN(f->search)},
      {"double", "surfaces.reach", (size_t)f->n_searches, 0, OWN(f->reach)},
      {"PetscInt", "surfaces.facet", (size_t)(e->n_facets * f->nf), 0, OWN(f->facet)},
      {"PetscInt", "surfaces.border", 2 * (size_t)e->n_border, 0, OWN(f->border)},
      {"PetscInt", "surfaces.slave", nodes ? (size_t)m->n_contacts : 0, 0, OWN(f->slave)},
      {"PetscBool", "surfaces.at_border", (size_t)e->n_surfaces * nodes, 0, OWN(f->at_border)},
      {"int", "surfaces.place", dofs, 0, OWN(f->place)},
      {"int", "surfaces.given", dofs, 0, OWN(f->given)},
      {"int", "surfaces.pose", nodes, 0, OWN(f->pose)},
      {"int", "surfaces.body", nodes, 0, OWN(f->body)},
      {"int", "surfaces.map", nodes ? 3 * (size_t)s->n_bodies : 0, 0, OWN(f->map)},
      {"double", "surfaces.drawn", 3 * nodes, 0, OWN(f->drawn)},
  };
  const int n_arrays = (int)(sizeof(all) / sizeof(all[0]));

  for (int k = 0; k < n_arrays; k++) list[k] = all[k];
  return n_arrays;
}

PetscErrorCode HycoExportModelFree(HycoExportModel *e, HycoScene s)
{
  Array list[MOST_ARRAYS];
  int n;

  PetscFunctionBegin;
  e->m.code = e->code.text; /* after an error too */
  n = ProgramList(e, s, list);
  for (PetscInt k = 0; k < e->m.n_outputs; k++) HycoFreeAll(&e->name[k], &e->unit[k]);
  HycoFreeAll(&e->name, &e->unit);
  for (int k = 0; k < n; k++) {
    if (list[k].own) PetscCall(PetscFree(*(void **)list[k].own));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reals are exact when they are read again. Empty arrays are left out, as C99 has no initialiser of none. */
static PetscErrorCode WriteArray(HycoText *t, const Array *a, const char prefix[])
{
  const PetscBool real = (PetscBool)!strcmp(a->type, "double"), own = (PetscBool)(a->own != NULL);
  const PetscBool whole =
      (PetscBool)(!strcmp(a->type, "PetscInt") || !strcmp(a->type, "Surface") || !strcmp(a->type, "Facing"));
  const size_t each = real ? 6 : 20, width = PetscMax(a->width, 1);
  const char *name = strchr(a->name, '.') ? strchr(a->name, '.') + 1 : a->name;

  PetscFunctionBegin;
  if (!a->n) PetscFunctionReturn(PETSC_SUCCESS);
  ADD(t, "%sconst %s %s%s[] = {", own ? "static " : "", a->type, own ? "model_" : prefix, name);
  for (size_t i = 0; i < a->n * width; i++) {
    ADD(t, "%s%s%s", i ? "," : "", i % each ? " " : "\n  ", a->width && i % width == 0 ? "{" : "");
    if (real)
      ADD(t, "%.17g", ((const double *)a->data)[i]);
    else
      ADD(t, "%d", whole ? (int)((const PetscInt *)a->data)[i] : ((const int *)a->data)[i]);
    if (a->width && i % width == width - 1) ADD(t, "}");
  }
  ADD(t, "};\n");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* parameter: units are those of the scene's parameters. */
static PetscErrorCode WriteNames(HycoText *t, HycoScene parameter, const char prefix[], const char of[], PetscInt n,
                                 char *const name[], char *const unit[])
{
  PetscFunctionBegin;
  for (PetscInt pass = 0; pass < 2; pass++) {
    ADD(t, "const char *const %s_%s_%s[%d] = {", prefix, of, pass ? "unit" : "name", (int)n);
    for (PetscInt k = 0; k < n; k++) {
      ADD(t, "%s\"", k ? ", " : "");
      PetscCall(AddWords(t, !pass ? name[k] : parameter ? UnitOf(parameter, name[k]) : unit[k], PETSC_FALSE));
      ADD(t, "\"");
    }
    ADD(t, "};\n");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define SIZE(name)                                                                                                     \
  {                                                                                                                    \
#name, (int)m->name                                                                                                \
  }

static PetscErrorCode WriteProgram(HycoExportModel *e, HycoScene s, const char prefix[], const char header[],
                                   HycoText *t)
{
  const Model *m = &e->m;
  Array list[MOST_ARRAYS];
  const int n = ProgramList(e, s, list);
  const struct {
    const char *name;
    int value;
  } size[] = {SIZE(n_parameters),     SIZE(n_atoms),     SIZE(n_functions), SIZE(n_motions),
              SIZE(n_places),         SIZE(n_stiffness), SIZE(n_values),    SIZE(n_terms),
              SIZE(n_outputs),        SIZE(n_contacts),  SIZE(n_blocks),    SIZE(areas),
              SIZE(n_slip),           SIZE(n_stops),     SIZE(n_tables),    SIZE(n_modes),
              SIZE(n_points),         SIZE(n_settled),   SIZE(n_chosen),    SIZE(n_strain),
              SIZE(n_flowing),        SIZE(n_lost),      SIZE(newton_most), SIZE(surfaces.dim),
              SIZE(surfaces.n_nodes), SIZE(surfaces.nf), SIZE(surfaces.nq), SIZE(surfaces.n_searches),
              SIZE(surfaces.n_facets)};

  PetscFunctionBegin;
  ADD(t,
      "/* Written by hyco export; %s declares what it offers. C99, with libc and libm alone. */\n#include \"%s\"\n\n",
      header, header);
  ADD(t, "#define FLOWS %d\n#define SLIPS %d\n\n%s%s\n/* -- the model -- */\n\n", m->n_modes > 0, m->n_slip > 0,
      HycoExport_runtime, m->n_modes ? HycoExport_flow : "");
  PetscCall(WriteNames(t, s, prefix, "parameter", s->n_parameters, s->parameter, NULL));
  PetscCall(WriteNames(t, NULL, prefix, "output", m->n_outputs, e->name, e->unit));
  for (int k = 0; k < n; k++) PetscCall(WriteArray(t, &list[k], prefix));
  ADD(t, "\nstatic const Model model = {\n");
  for (size_t k = 0; k < sizeof(size) / sizeof(size[0]); k++) ADD(t, "  .%s = %d,\n", size[k].name, size[k].value);
  for (int k = 0; k < n; k++) {
    if (list[k].n && list[k].own)
      ADD(t, "  .%s = model_%s,\n", list[k].name,
          strchr(list[k].name, '.') ? strchr(list[k].name, '.') + 1 : list[k].name);
  }
  ADD(t, "  .newton_rtol = %.17g,\n  .most_increment = %.17g,\n  .least = %.17g,\n", m->newton_rtol, m->most_increment,
      m->least);
  ADD(t, "  .surfaces.around = %.17g,\n  .surfaces.touches = %.17g,\n  .tolerance = %.17g};\n\n", m->surfaces.around,
      m->surfaces.touches, m->tolerance);
  PetscCall(AddNamed(t, HycoExport_calls_c, prefix));
  PetscCall(AddNamed(t, s->n_times ? HycoExport_step_c : HycoExport_predict_c, prefix));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the files -- */

static PetscErrorCode ProgramDescribe(const HycoExportModel *m, HycoScene s, const char path[], const char header[],
                                      const char prefix[], size_t bytes, HycoText *t)
{
  PetscFunctionBegin;
  ADD(t, "%s, %s: %s_%s(), %.3g MB; %d %s, %d motions that contact holds, %d functions of the parameters\n", path,
      header, prefix, s->n_times ? "step" : "predict", (double)bytes / 1e6, (int)m->m.n_contacts,
      m->m.n_slip ? "rows of contacts" : "contacts", (int)m->m.n_motions, (int)m->m.n_functions);
  for (PetscInt p = 0; p < s->n_parameters; p++)
    ADD(t, "%s%s%s%s, %.6g to %.6g", p ? "; " : "parameters: ", s->parameter[p],
        UnitOf(s, s->parameter[p])[0] ? " " : "", UnitOf(s, s->parameter[p]), (double)s->lo[p], (double)s->hi[p]);
  for (PetscInt k = 0; k < m->m.n_outputs; k++)
    ADD(t, "%s%s%s%s", k ? ", " : "\noutputs: ", m->name[k], m->unit[k][0] ? " " : "", m->unit[k]);
  ADD(t, "\nat %d points: largest difference from the model %.1e of an output's largest value; %.3g ms a %s\n",
      (int)m->checked, (double)m->difference, 1e3 * (double)m->seconds / (double)m->checked,
      s->n_times ? "step" : "prediction");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* By a temporary file: an existing program stays complete if the disk is full. */
static PetscErrorCode ProgramInsert(const char path[], const HycoText *t)
{
  HycoFile file;

  PetscFunctionBegin;
  PetscCall(HycoFileCreate(path, HYCO_FILE_TEXT, &file));
  (void)!fwrite(t->text, 1, t->n, HycoFileStream(file)); /* Close reports a failure */
  PetscCall(HycoFileClose(&file, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define HEADER  "/* Predictions of a model of hyco" /* beginnings of the two files */
#define PROGRAM "/* Written by hyco export"

/* Fails if a file is there that begins otherwise. */
static PetscErrorCode CheckOwn(const char path[], const char begins[])
{
  char line[sizeof(HEADER) + sizeof(PROGRAM)] = "";
  FILE *file = fopen(path, "r");

  PetscFunctionBegin;
  if (!file) PetscFunctionReturn(PETSC_SUCCESS);
  line[fread(line, 1, sizeof(line) - 1, file)] = '\0';
  (void)fclose(file);
  HycoCheck(!line[0] || !strncmp(line, begins, strlen(begins)),
            "-c: %s exists, and hyco export has not written it; remove it, or give another name", path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoExportCheckFiles(const char path[])
{
  char beside[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(PetscStrncpy(beside, path, sizeof(beside)));
  beside[strlen(path) - 1] = 'h';
  PetscCall(CheckOwn(path, PROGRAM));
  PetscCall(CheckOwn(beside, HEADER));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoExportWrite(HycoExportModel *m, HycoScene s, const char name[], const char path[],
                               char **description)
{
  HycoText header = {0}, program = {0}, words = {0};
  char beside[PETSC_MAX_PATH_LEN], prefix[64];
  const char *file;
  const size_t n = strlen(path);
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(PetscStrncpy(beside, path, sizeof(beside)));
  /* ExportC() has checked that the path ends in .c. */
  beside[n - 1] = 'h';
  file = strrchr(beside, '/') ? strrchr(beside, '/') + 1 : beside;
  PrefixOf(name, prefix);
  ierr = WriteHeader(m, s, prefix, &header);
  if (!ierr) ierr = WriteProgram(m, s, prefix, file, &program);
  if (!ierr) ierr = ProgramInsert(beside, &header);
  if (!ierr) ierr = ProgramInsert(path, &program);
  if (!ierr) ierr = ProgramDescribe(m, s, path, beside, prefix, program.n, &words);
  HycoFreeAll(&header.text, &program.text);
  *description = words.text;
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
