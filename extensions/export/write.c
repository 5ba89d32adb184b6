/* The file of a model's program: declarations in FILE.h; the runtime, the arrays, the functions of the parameters in
   FILE.c. */
#include "export.h"
#include <hycofile.h>
#include <ctype.h>
#include <stdio.h>
#include <string.h>

extern const char HycoExportRuntime[]; /* what the library and a program share, by extension.cmake */

#define ADD(...) PetscCall(HycoTextAdd(__VA_ARGS__))

/* -- the arrays grow -- */

/* Room for one more block of `size` bytes behind n others; the room is a power of 2. */
static PetscErrorCode Grow(PetscInt n, size_t size, void *array)
{
  PetscFunctionBegin;
  if ((n & (n - 1)) == 0) PetscCall(PetscRealloc((size_t)PetscMax(1, 2 * n) * size, (void **)array));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies the names. */
PetscErrorCode HycoExportAddOutput(HycoExportModel *m, const Output *output, const char name[], const char unit[])
{
  PetscFunctionBegin;
  PetscCall(Grow(m->m.n_outputs, sizeof(*m->m.output), &m->m.output));
  PetscCall(Grow(m->m.n_outputs, sizeof(*m->name), &m->name));
  PetscCall(Grow(m->m.n_outputs, sizeof(*m->unit), &m->unit));
  m->m.output[m->m.n_outputs] = *output;
  PetscCall(PetscStrallocpy(name, &m->name[m->m.n_outputs]));
  PetscCall(PetscStrallocpy(unit, &m->unit[m->m.n_outputs++]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoExportAddContact(HycoExportModel *m, PetscInt contact)
{
  PetscFunctionBegin;
  PetscCall(Grow(m->n_contact, sizeof(*m->m.contact), &m->m.contact));
  m->m.contact[m->n_contact++] = (int)contact;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoExportAddWeight(HycoExportModel *m, PetscReal weight)
{
  PetscFunctionBegin;
  PetscCall(Grow(m->n_weights, sizeof(*m->m.weight), &m->m.weight));
  m->m.weight[m->n_weights++] = weight;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* T is sparse in (value, function): only rows above round-off are written. */
PetscErrorCode HycoExportAddTerm(HycoExportModel *m, PetscInt value, PetscInt function, PetscInt n,
                                 const PetscReal term[])
{
  PetscFunctionBegin;
  PetscCall(Grow(m->m.n_terms, sizeof(*m->m.value), &m->m.value));
  PetscCall(Grow(m->m.n_terms, sizeof(*m->m.factor), &m->m.factor));
  PetscCall(Grow(m->m.n_terms, (size_t)PetscMax(1, n) * sizeof(*m->m.term), &m->m.term));
  m->m.value[m->m.n_terms] = (int)value;
  m->m.factor[m->m.n_terms] = (int)function;
  PetscCall(PetscArraycpy(m->m.term + (size_t)m->m.n_terms * (size_t)n, term, n));
  m->m.n_terms++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Not the atoms, which are borrowed. */
PetscErrorCode HycoExportModelFree(HycoExportModel *m)
{
  Surfaces *s = &m->surfaces;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < m->m.n_outputs; k++) HycoFreeAll(&m->name[k], &m->unit[k]);
  for (PetscInt k = 0; k < m->m.n_blocks; k++) HycoFreeAll(&m->m.block[k].C);
  HycoFreeAll(&m->function, &m->m.offset, &m->m.W, &m->m.A, &m->m.term, &m->m.weight, &m->m.stiffness, &m->m.value,
              &m->m.factor, &m->m.contact, &m->m.output, &m->m.row, &m->m.coefficient, &m->m.normal, &m->name, &m->unit,
              &m->m.block, &m->body, &m->drawn, &s->w, &s->N, &s->dN, &s->surface, &s->search, &s->facet, &s->border,
              &s->node, &s->at_border, &s->place, &s->given, &s->pose);
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

/* -- the header -- */

static const char declarations[] =
    "/* Names and units; ranges of the parameters, in which the model was trained. */\n"
    "extern const char *const @_parameter_name[@_N_PARAMETERS], *const @_parameter_unit[@_N_PARAMETERS];\n"
    "extern const char *const @_output_name[@_N_OUTPUTS], *const @_output_unit[@_N_OUTPUTS];\n"
    "extern const double @_lo[@_N_PARAMETERS], @_hi[@_N_PARAMETERS];\n\n"
    "typedef struct {\n"
    "  double output[@_N_OUTPUTS];\n"
    "  double kkt;     /* the largest residual of the contact problem, recomputed, relative */\n"
    "  int iterations; /* of the active set */\n"
    "} @_result;\n\n"
    "/* @_OK; @_OUTSIDE: parameters outside the ranges, results are those of the equations there, untested;\n"
    "   @_DIVERGED: no solution was found, results are of no use; @_NO_MEMORY: no results. */\n"
    "enum { @_OK, @_OUTSIDE, @_DIVERGED, @_NO_MEMORY };\n\n";

static const char predicted[] =
    "/* Results at mu. work: @_work_size() bytes, aligned as malloc() does, for this call alone; NULL: allocated\n"
    "   for the call. Several threads may call it at the same time, each with its own work and result. */\n"
    "int @_predict(const double mu[@_N_PARAMETERS], @_result *result, void *work);\n"
    "size_t @_work_size(void);\n";

static const char stepped[] =
    "/* The listed times of the history. */\n"
    "extern const double @_time[@_N_TIMES];\n\n"
    "/* What a step leaves for the next: forces and slips of the contacts. A copy is a point to go back to. */\n"
    "typedef struct {\n"
    "  double value[@_N_STATES];\n"
    "} @_state;\n\n"
    "/* At rest, before the first step, in which all loads act at once. */\n"
    "void @_start(@_state *state);\n"
    "/* Advances the state to time t, after that of the step before, and gives the results there; tables are those of "
    "the\n"
    "   history. mu may differ from step to step: between them it is on a straight line. A step is halved where it has "
    "no\n"
    "   solution; if none is found the state stays. work: @_work_size() bytes, aligned as malloc() does, for this\n"
    "   call alone; NULL: allocated for the call. Several threads may call it at the same time, each with its own "
    "state,\n"
    "   work and result. */\n"
    "int @_step(const double mu[@_N_PARAMETERS], double t, @_state *state, @_result *result, void *work);\n"
    "size_t @_work_size(void);\n";

static const char functions[] =
    "size_t @_work_size(void)\n{\n  return work_size(&model);\n}\n\n"
    "static int is_outside(const double mu[])\n{\n"
    "  int outside = 0;\n\n"
    "  for (int p = 0; p < @_N_PARAMETERS; p++) outside = outside || !(mu[p] >= @_lo[p] && mu[p] <= @_hi[p]);\n"
    "  return outside;\n}\n\n";

static const char predict_function[] =
    "int @_predict(const double mu[@_N_PARAMETERS], @_result *result, void *work)\n{\n"
    "  void *memory = work ? work : malloc(work_size(&model));\n"
    "  int status;\n"
    "  Work o;\n\n"
    "  if (!memory) return @_NO_MEMORY;\n"
    "  place(&model, memory, &o);\n"
    "  functions(mu, o.f);\n"
    "  positions(mu, o.room.X);\n"
    "  status = predict(&model, &o, result->output, &result->kkt, &result->iterations);\n"
    "  if (!work) free(memory);\n"
    "  return status == OK && is_outside(mu) ? OUTSIDE : status;\n}\n";

static const char step_functions[] =
    "static int functions_at(void *context, const double v[], double f[])\n{\n"
    "  (void)context;\n"
    "  functions(v, f);\n"
    "  return 0;\n}\n\n"
    "void @_start(@_state *state)\n{\n  memset(state, 0, sizeof(*state));\n}\n\n"
    "int @_step(const double mu[@_N_PARAMETERS], double t, @_state *state, @_result *result, void *work)\n{\n"
    "  void *memory = work ? work : malloc(work_size(&model));\n"
    "  int status;\n"
    "  Work o;\n\n"
    "  if (!memory) return @_NO_MEMORY;\n"
    "  place(&model, memory, &o);\n"
    "  status = advance(&model, &o, functions_at, NULL, mu, t, state->value, result->output, &result->kkt,\n"
    "                   &result->iterations);\n"
    "  if (!work) free(memory);\n"
    "  return status == OK && is_outside(mu) ? OUTSIDE : status;\n}\n";

/* A text with @ replaced by the prefix. */
static PetscErrorCode AddNamed(HycoText *t, const char text[], const char prefix[])
{
  PetscFunctionBegin;
  for (; *text; text++) {
    if (*text == '@')
      ADD(t, "%s", prefix);
    else
      ADD(t, "%c", *text);
  }
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
  PetscCall(AddNamed(t, declarations, prefix));
  PetscCall(AddNamed(t, s->n_times ? stepped : predicted, prefix));
  ADD(t, "\n#if defined(__cplusplus)\n}\n#endif\n#endif\n");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the program -- */

/* An array of the program; width: of its items, structs of as many numbers; 0: they are numbers. */
typedef struct {
  const char *type, *name;
  size_t n;
  const void *data;
  size_t width;
} Array;

/* Reals are exact when they are read again. Empty arrays are left out, as C99 has no initialiser of none. */
static PetscErrorCode WriteArrays(HycoText *t, size_t n_arrays, const Array arrays[])
{
  PetscFunctionBegin;
  for (const Array *a = arrays; a < arrays + n_arrays; a++) {
    const PetscBool real = (PetscBool)!strcmp(a->type, "double");
    const PetscBool whole = (PetscBool)(!strcmp(a->type, "PetscInt") || !strcmp(a->type, "Surface"));
    const size_t each = real ? 6 : 20, width = PetscMax(a->width, 1);

    if (!a->n) continue;
    ADD(t, "static const %s %s[] = {", a->type, a->name);
    for (size_t i = 0; i < a->n * width; i++) {
      ADD(t, "%s%s%s", i ? "," : "", i % each ? " " : "\n  ", a->width && i % width == 0 ? "{" : "");
      if (real)
        ADD(t, "%.17g", ((const double *)a->data)[i]);
      else
        ADD(t, "%d", whole ? (int)((const PetscInt *)a->data)[i] : ((const int *)a->data)[i]);
      if (a->width && i % width == width - 1) ADD(t, "}");
    }
    ADD(t, "};\n");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define WRITE(t, ...)                                                                                                  \
  do {                                                                                                                 \
    const Array arrays[] = {__VA_ARGS__};                                                                              \
                                                                                                                       \
    PetscCall(WriteArrays(t, sizeof(arrays) / sizeof(arrays[0]), arrays));                                             \
  } while (0)

/* Seen from outside. */
static PetscErrorCode WriteReals(HycoText *t, const char prefix[], const char name[], PetscInt n, const PetscReal v[])
{
  PetscFunctionBegin;
  ADD(t, "const double %s_%s[%d] = {", prefix, name, (int)n);
  for (PetscInt i = 0; i < n; i++) ADD(t, "%s%.17g", i ? ", " : "", (double)v[i]);
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

/* The blocks of the flexibility, and the surfaces on which masters are searched for. */
static PetscErrorCode WriteSurfaces(const HycoExportModel *m, HycoText *t)
{
  const Surfaces *s = &m->surfaces;
  const size_t points = (size_t)(s->nq * s->nf), nodes = (size_t)s->n_nodes, unknowns = nodes * (size_t)s->dim;
  size_t facets = 0;
  char name[HYCO_LINE];

  PetscFunctionBegin;
  for (PetscInt k = 0; k < m->n_surfaces; k++) facets += (size_t)s->surface[k].n;
  for (int k = 0; k < m->m.n_blocks; k++) {
    HycoFormat(name, "block_%d", k);
    WRITE(t, {"double", name, (size_t)m->m.block[k].n * (size_t)m->m.block[k].n, m->m.block[k].C, 0});
  }
  ADD(t, "static const Block blocks[] = {");
  for (int k = 0; k < m->m.n_blocks; k++)
    ADD(t, "%s{%d, %d, %d, block_%d}", k ? ", " : "", m->m.block[k].first, m->m.block[k].n, m->m.block[k].value, k);
  ADD(t, "};\nstatic const Facing searches[] = {");
  for (PetscInt k = 0; k < s->n_searches; k++) {
    const Facing *h = &s->search[k];

    ADD(t, "%s{%d, %d, %d, %d, %.17g}", k ? ", " : "", (int)h->slave, (int)h->master, (int)h->first, (int)h->n,
        h->reach);
  }
  ADD(t, "};\n");
  WRITE(t, {"Surface", "surface", (size_t)m->n_surfaces, s->surface, 6},
        {"double", "point_weight", (size_t)s->nq, s->w, 0}, {"double", "point_function", points, s->N, 0},
        {"double", "point_slope", 2 * points, s->dN, 0}, {"double", "drawn", 3 * nodes, m->drawn, 0},
        {"PetscInt", "facet", facets * (size_t)s->nf, s->facet, 0},
        {"PetscInt", "border", 2 * (size_t)m->n_border, s->border, 0},
        {"PetscInt", "slave", (size_t)m->m.n_contacts, s->node, 0}, {"int", "place_of", unknowns, s->place, 0},
        {"int", "given", unknowns, s->given, 0}, {"int", "pose", nodes, s->pose, 0},
        {"PetscInt", "body", nodes, m->body, 0},
        {"PetscBool", "at_border", (size_t)m->n_surfaces * nodes, s->at_border, 0});
  ADD(t,
      "static const Surfaces surfaces = {%d, %d, %d, %d, %d, %d, %.17g, point_weight, point_function, "
      "point_slope,\n"
      "                                  surface, searches, facet, %s, slave, at_border, place_of, given, pose};\n",
      (int)s->dim, (int)s->n_nodes, (int)s->nf, (int)s->nq, (int)s->n_searches, (int)s->n_facets, s->around,
      m->n_border ? "border" : "NULL");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The nodes of the surfaces at mu, by the maps of their bodies. */
static PetscErrorCode WritePositions(const HycoExportModel *m, HycoScene s, HycoText *t)
{
  PetscBool valid;
  PetscReal value;

  PetscFunctionBegin;
  ADD(t, "static void positions(const double mu[], double X[])\n{\n  (void)mu;\n");
  if (!m->surfaces.n_nodes) ADD(t, "  (void)X;\n");
  if (m->surfaces.n_nodes) {
    ADD(t,
        "  memcpy(X, drawn, sizeof(drawn));\n  for (int i = 0; i < %d; i++) {\n    const double *x = drawn + 3 * "
        "i;\n\n",
        (int)m->surfaces.n_nodes);
    ADD(t, "    (void)x;\n");
  }
  for (PetscInt b = 0; b < s->n_bodies && m->surfaces.n_nodes; b++) {
    for (PetscInt c = 0; c < 3; c++) {
      if (!s->body[b].map[c]) continue;
      ADD(t, "    if (body[i] == %d) X[3 * i + %d] = ", (int)b, (int)c);
      PetscCall(HycoTranslate(s, HycoExportEntry(s, HycoExprKey(s->body[b].map[c])), NULL, s->lo, &value, t, &valid,
                              NULL, NULL));
      ADD(t, ";\n");
    }
  }
  ADD(t, "%s}\n\n", m->surfaces.n_nodes ? "  }\n" : "");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The tables of a history. */
static PetscErrorCode WriteTables(HycoScene s, HycoText *t)
{
  char time[HYCO_LINE], value[HYCO_LINE];

  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n_tables; k++) {
    const size_t n = (size_t)s->table[k].n;

    HycoFormat(time, "table_t_%d", (int)k);
    HycoFormat(value, "table_value_%d", (int)k);
    WRITE(t, {"double", time, n, s->table[k].t, 0}, {"double", value, n, s->table[k].value, 0});
  }
  for (PetscInt k = 0; k < s->n_tables; k++)
    ADD(t, "%s{%d, table_t_%d, table_value_%d}", k ? ", " : "static const HycoTimeTable tables[] = {",
        (int)s->table[k].n, (int)k, (int)k);
  ADD(t, "%s", s->n_tables ? "};\n" : "");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ", .member = name", if the array has entries. */
static PetscErrorCode AddMembers(HycoText *t, size_t n_arrays, const Array arrays[])
{
  PetscFunctionBegin;
  for (const Array *a = arrays; a < arrays + n_arrays; a++) {
    if (a->n) ADD(t, ",\n  .%s = %s", a->name + strlen("model_"), a->name);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode WriteModel(const HycoExportModel *e, HycoScene s, const char prefix[], HycoText *t)
{
  const Model *m = &e->m;
  const size_t p = (size_t)m->n_motions, n = (size_t)m->n_places, f = (size_t)m->n_stiffness,
               blocks = (size_t)m->n_slip;
  const size_t terms = (size_t)m->n_terms;
  const Array arrays[] = {
      {"double", "model_offset", (p + n + (size_t)m->n_values) * (size_t)m->n_functions, m->offset, 0},
      {"int", "model_stiffness", f, m->stiffness, 0},
      {"double", "model_W", m->n_blocks ? 0 : f * n * (n + 1) / 2, m->W, 0},
      {"double", "model_A", f * p * n, m->A, 0},
      {"int", "model_value", terms, m->value, 0},
      {"int", "model_factor", terms, m->factor, 0},
      {"double", "model_term", terms * (p + n), m->term, 0},
      {"int", "model_contact", (size_t)e->n_contact, m->contact, 0},
      {"double", "model_weight", (size_t)e->n_weights, m->weight, 0},
      {"Output", "model_output", (size_t)m->n_outputs, m->output, 6},
      {"int", "model_row", blocks ? blocks + 1 : 0, m->row, 0},
      {"int", "model_coefficient", blocks, m->coefficient, 0},
      {"int", "model_normal", blocks ? (size_t)m->n_contacts : 0, m->normal, 0}};
  const size_t n_arrays = sizeof(arrays) / sizeof(arrays[0]);

  PetscFunctionBegin;
  PetscCall(WriteReals(t, prefix, "lo", s->n_parameters, s->lo));
  PetscCall(WriteReals(t, prefix, "hi", s->n_parameters, s->hi));
  if (s->n_times) PetscCall(WriteReals(t, prefix, "time", s->n_times, s->times));
  PetscCall(WriteNames(t, s, prefix, "parameter", s->n_parameters, s->parameter, NULL));
  PetscCall(WriteNames(t, NULL, prefix, "output", m->n_outputs, e->name, e->unit));
  PetscCall(WriteArrays(t, n_arrays, arrays));
  if (m->surfaces) PetscCall(WriteSurfaces(e, t));
  PetscCall(WriteTables(s, t));
  ADD(t, "\nstatic const Model model = {%d, %d, %d, %d, %d, %d, %d, %d, %d, %d, %d, %.17g", m->n_parameters,
      m->n_functions, m->n_motions, m->n_places, m->n_stiffness, m->n_values, m->n_terms, m->n_outputs, m->n_contacts,
      m->n_blocks, m->areas, m->tolerance);
  PetscCall(AddMembers(t, n_arrays, arrays));
  ADD(t, "%s,\n  .n_slip = %d, .n_tables = %d%s};\n\n",
      m->surfaces ? ",\n  .block = blocks, .surfaces = &surfaces" : "", m->n_slip, m->n_tables,
      s->n_tables ? ", .table = tables" : "");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The functions of the parameters: each expression once. */
static PetscErrorCode WriteFunctions(const HycoExportModel *m, HycoScene s, HycoText *t)
{
  PetscBool *used;
  PetscReal value;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(m->n_atoms + 1, &used));
  for (PetscInt k = 0; k < m->m.n_functions; k++) {
    const PetscInt of[4] = {m->function[k].a, m->function[k].b, m->function[k].c, m->function[k].d};

    for (PetscInt j = 0; j < 4; j++) {
      if (of[j] >= 0) used[of[j]] = PETSC_TRUE;
    }
  }
  ADD(t, "static void functions(const double mu[], double f[])\n{\n");
  for (PetscInt k = 0; k < m->n_atoms; k++) {
    if (!used[k]) continue;
    ADD(t, "  const double e%d = ", (int)k);
    /* Values do not matter here; the text was valid when the atom was found. */
    PetscCall(HycoAtomTranslate(s, &m->atom[k], s->lo, &value, t));
    ADD(t, "; /* ");
    PetscCall(AddWords(t, m->atom[k].key, PETSC_TRUE));
    ADD(t, " */\n");
  }
  /* A model whose functions are constant would be compiled with a warning otherwise. */
  ADD(t, "\n  (void)mu;\n");
  for (PetscInt k = 0; k < m->m.n_functions; k++) {
    const HycoFunction *f = &m->function[k];

    ADD(t, "  f[%d] = ", (int)k);
    if (f->a < 0) ADD(t, "1.0");
    if (f->a >= 0) ADD(t, "e%d", (int)f->a);
    if (f->b >= 0) ADD(t, " * e%d", (int)f->b);
    if (f->d >= 0) ADD(t, " * e%d", (int)f->d);
    if (f->c >= 0) ADD(t, " / e%d", (int)f->c);
    ADD(t, ";\n");
  }
  ADD(t, "}\n\n");
  PetscCall(PetscFree(used));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode WriteProgram(const HycoExportModel *m, HycoScene s, const char prefix[], const char header[],
                                   HycoText *t)
{
  PetscFunctionBegin;
  ADD(t,
      "/* Written by hyco export; %s declares what it offers. C99, with libc and libm alone. */\n#include \"%s\"\n\n",
      header, header);
  if (s->n_times) ADD(t, "#define PATHS\n");
  ADD(t, "%s\n/* -- the model -- */\n\n", HycoExportRuntime);
  PetscCall(WriteModel(m, s, prefix, t));
  PetscCall(WriteFunctions(m, s, t));
  if (!s->n_times) PetscCall(WritePositions(m, s, t));
  PetscCall(AddNamed(t, functions, prefix));
  PetscCall(AddNamed(t, s->n_times ? step_functions : predict_function, prefix));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- the files -- */

static PetscErrorCode Describe(const HycoExportModel *m, HycoScene s, const char path[], const char header[],
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
static PetscErrorCode Put(const char path[], const HycoText *t)
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

PetscErrorCode HycoExportWrite(const HycoExportModel *m, HycoScene s, const char name[], const char path[],
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
  if (!ierr) ierr = Put(beside, &header);
  if (!ierr) ierr = Put(path, &program);
  if (!ierr) ierr = Describe(m, s, path, beside, prefix, program.n, &words);
  HycoFreeAll(&header.text, &program.text);
  *description = words.text;
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
