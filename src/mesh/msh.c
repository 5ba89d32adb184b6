/*
  The mesh file's form, looked over before gmsh's library reads it: gmsh believes what a file says of itself, and ends
  in a crash, a hang or all of the memory where that is wrong. Formats 2.2 and 4.1, text and binary, the sections that
  hyco needs: their counts, tags, types and nodes. (gmsh 4.11 manual, chapter "Gmsh file formats".)
*/
#include "msh.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Nodes and dimension of gmsh's element types 1 to 31; 0: not one that a file of hyco's could hold. */
static const signed char type_nodes[32] = {0, 2,  3,  4,  4, 8,  6,  5,  3,  6,  9, 10, 27, 18, 14, 1,
                                           8, 20, 15, 13, 9, 10, 12, 15, 15, 21, 4, 5,  6,  20, 35, 56};
static const signed char type_dim[32] = {0, 1, 2, 2, 3, 3, 3, 3, 1, 2, 2, 3, 3, 3, 3, 0,
                                         2, 3, 3, 3, 2, 2, 2, 2, 2, 2, 1, 1, 1, 3, 3, 3};

typedef struct {
  const char *path;
  char *text, *at, *end; /* all of the file, a 0 behind it */
  int four, binary;
  size_t n_nodes;
  unsigned long long *node; /* their tags, ascending */
  PetscBool has_nodes, has_elements, failed;
} Msh;

/* What is read where the file has ended or holds no number is 0, and `failed` says so. */
static long long ReadInt(Msh *m, size_t bytes)
{
  long long value = 0;

  if (m->failed) return 0;
  if (m->binary) {
    if ((size_t)(m->end - m->at) < bytes) {
      m->failed = PETSC_TRUE;
    } else if (bytes == 4) {
      int word;

      memcpy(&word, m->at, 4);
      value = word;
    } else {
      memcpy(&value, m->at, 8);
    }
    m->at += m->failed ? 0 : bytes;
  } else {
    char *end;

    value = strtoll(m->at, &end, 10);
    m->failed = (PetscBool)(end == m->at);
    m->at = end;
  }
  return value;
}

static double ReadDouble(Msh *m)
{
  double value = 0;

  if (m->failed) return 0;
  if (m->binary) {
    if ((size_t)(m->end - m->at) < 8)
      m->failed = PETSC_TRUE;
    else
      memcpy(&value, m->at, 8);
    m->at += m->failed ? 0 : 8;
  } else {
    char *end;

    value = HycoNumber(m->at, &end);
    m->failed = (PetscBool)(end == m->at);
    m->at = end;
  }
  return value;
}

/* A count of things that take at least `bytes` each: more than the file has room for is refused. */
static PetscErrorCode ReadCount(Msh *m, size_t bytes, const char what[], size_t *n)
{
  const long long value = ReadInt(m, 8);

  PetscFunctionBegin;
  HycoCheck(!m->failed && value >= 0 && (unsigned long long)value <= (size_t)(m->end - m->at) / bytes,
            "the mesh %s is damaged: it speaks of %lld %s, which it has no room for", m->path, value, what);
  *n = (size_t)value;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A count of format 2.2, a line of text in binary files too. */
static PetscErrorCode ReadCountLine(Msh *m, size_t bytes, const char what[], size_t *n)
{
  const int binary = m->binary;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  m->binary = 0;
  ierr = ReadCount(m, bytes, what, n);
  m->binary = binary;
  PetscCall(ierr);
  if (binary && m->at < m->end && *m->at == '\r') m->at++;
  if (binary && m->at < m->end && *m->at == '\n') m->at++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AddNode(Msh *m, size_t k, long long tag)
{
  PetscFunctionBegin;
  HycoCheck(!m->failed, "the mesh %s is damaged: it ends among its nodes", m->path);
  HycoCheck(tag > 0 && tag < PETSC_MAX_INT, "the mesh %s has a node of the tag %lld; tags run from 1 to %lld", m->path,
            tag, (long long)PETSC_MAX_INT - 1);
  m->node[k] = (unsigned long long)tag;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckCoordinates(Msh *m, long long tag)
{
  PetscFunctionBegin;
  for (int c = 0; c < 3; c++) {
    const double x = ReadDouble(m);

    HycoCheck(m->failed || !PetscIsInfOrNanReal(x), "%s: node %lld has a coordinate that is not finite", m->path, tag);
  }
  HycoCheck(!m->failed, "the mesh %s is damaged: the coordinates of node %lld are no numbers", m->path, tag);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckNodes2(Msh *m)
{
  PetscFunctionBegin;
  PetscCall(ReadCountLine(m, m->binary ? 28 : 8, "nodes", &m->n_nodes));
  PetscCall(PetscMalloc1(m->n_nodes, &m->node));
  for (size_t k = 0; k < m->n_nodes; k++) {
    PetscCall(AddNode(m, k, ReadInt(m, 4)));
    PetscCall(CheckCoordinates(m, (long long)m->node[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A block's dimension and number, as far as gmsh's own entities go. */
static PetscErrorCode CheckEntity(Msh *m, long long dim, long long tag)
{
  PetscFunctionBegin;
  HycoCheck(!m->failed && dim >= 0 && dim <= 3 && tag > 0 && tag < PETSC_MAX_INT,
            "the mesh %s is damaged: there is no entity of dimension %lld and number %lld", m->path, dim, tag);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckNodes4(Msh *m)
{
  size_t blocks, n, done = 0;
  long long least, most;

  PetscFunctionBegin;
  PetscCall(ReadCount(m, 4, "blocks of nodes", &blocks));
  PetscCall(ReadCount(m, m->binary ? 32 : 8, "nodes", &m->n_nodes));
  least = ReadInt(m, 8);
  most = ReadInt(m, 8);
  PetscCall(PetscMalloc1(m->n_nodes, &m->node));
  for (size_t b = 0; b < blocks; b++, done += n) {
    const long long dim = ReadInt(m, 4), tag = ReadInt(m, 4), parametric = ReadInt(m, 4);

    PetscCall(CheckEntity(m, dim, tag));
    PetscCall(ReadCount(m, m->binary ? 32 : 8, "nodes of a block", &n));
    HycoCheck(parametric == 0 || parametric == 1, "the mesh %s is damaged: a block of nodes", m->path);
    HycoCheck(done + n <= m->n_nodes, "the mesh %s is damaged: its blocks hold more nodes than it counts", m->path);
    for (size_t k = 0; k < n; k++) {
      PetscCall(AddNode(m, done + k, ReadInt(m, 8)));
      HycoCheck((long long)m->node[done + k] >= least && (long long)m->node[done + k] <= most,
                "the mesh %s is damaged: node %lld lies outside its tags, %lld to %lld", m->path,
                (long long)m->node[done + k], least, most);
    }
    for (size_t k = 0; k < n; k++) {
      PetscCall(CheckCoordinates(m, (long long)m->node[done + k]));
      for (long long p = 0; parametric && p < dim; p++) (void)ReadDouble(m);
    }
  }
  HycoCheck(done == m->n_nodes, "the mesh %s is damaged: its blocks hold fewer nodes than it counts", m->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static int CompareTags(const void *a, const void *b)
{
  const unsigned long long ta = *(const unsigned long long *)a, tb = *(const unsigned long long *)b;

  return (ta > tb) - (ta < tb);
}

static PetscErrorCode CheckNodes(Msh *m)
{
  PetscFunctionBegin;
  HycoCheck(!m->has_nodes, "the mesh %s has two sections $Nodes", m->path);
  m->has_nodes = PETSC_TRUE;
  if (m->four)
    PetscCall(CheckNodes4(m));
  else
    PetscCall(CheckNodes2(m));
  if (m->n_nodes) qsort(m->node, m->n_nodes, sizeof(*m->node), CompareTags);
  for (size_t k = 1; k < m->n_nodes; k++)
    HycoCheck(m->node[k] != m->node[k - 1], "%s: node %lld stands twice", m->path, (long long)m->node[k]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The nodes of one element of a type that is known. */
static PetscErrorCode CheckElement(Msh *m, size_t bytes, long long tag, long long type)
{
  PetscFunctionBegin;
  HycoCheck(!m->failed && tag > 0 && tag < PETSC_MAX_INT, "the mesh %s is damaged: it has an element of the tag %lld",
            m->path, tag);
  for (int v = 0; v < type_nodes[type]; v++) {
    const unsigned long long node = (unsigned long long)ReadInt(m, bytes);

    HycoCheck(!m->failed, "the mesh %s is damaged: it ends among its elements", m->path);
    HycoCheck(m->n_nodes && bsearch(&node, m->node, m->n_nodes, sizeof(node), CompareTags),
              "%s: element %lld names node %lld, which the file does not define", m->path, tag, (long long)node);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckType(Msh *m, long long type)
{
  PetscFunctionBegin;
  HycoCheck(!m->failed && type > 0 && type < 32,
            "the mesh %s has elements of gmsh type %lld; hyco takes line2, tri3, quad4, tet4 and hex8 (first order)",
            m->path, type);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckTags2(Msh *m, long long n)
{
  PetscFunctionBegin;
  HycoCheck(!m->failed && n >= 2 && n <= 3,
            "the mesh %s has an element with %lld tags; 2 are expected (is it cut for "
            "several processes? save the whole)",
            m->path, n);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckTagValues2(Msh *m, long long n)
{
  PetscFunctionBegin;
  for (long long t = 0; t < n; t++) {
    const long long value = ReadInt(m, 4);

    HycoCheck(!m->failed && value >= 0 && value < PETSC_MAX_INT, "the mesh %s is damaged: an element's group is %lld",
              m->path, value);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckElements2(Msh *m)
{
  size_t n;

  PetscFunctionBegin;
  PetscCall(ReadCountLine(m, 8, "elements", &n));
  for (size_t k = 0; k < n;) {
    long long tag = m->binary ? 0 : ReadInt(m, 4), type, follow, n_tags;

    type = ReadInt(m, 4);
    follow = m->binary ? ReadInt(m, 4) : 1;
    n_tags = ReadInt(m, 4);
    PetscCall(CheckType(m, type));
    PetscCall(CheckTags2(m, n_tags));
    HycoCheck(follow > 0 && (size_t)follow <= n - k, "the mesh %s is damaged: a block of %lld elements", m->path,
              follow);
    for (long long e = 0; e < follow; e++) {
      if (m->binary) tag = ReadInt(m, 4);
      PetscCall(CheckTagValues2(m, n_tags));
      PetscCall(CheckElement(m, 4, tag, type));
    }
    k += (size_t)follow;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckElements4(Msh *m)
{
  size_t blocks, n, all, done = 0;
  long long least, most;

  PetscFunctionBegin;
  PetscCall(ReadCount(m, 4, "blocks of elements", &blocks));
  PetscCall(ReadCount(m, 4, "elements", &all));
  least = ReadInt(m, 8);
  most = ReadInt(m, 8);
  for (size_t b = 0; b < blocks; b++, done += n) {
    const long long dim = ReadInt(m, 4), entity = ReadInt(m, 4), type = ReadInt(m, 4);

    PetscCall(CheckEntity(m, dim, entity));
    PetscCall(CheckType(m, type));
    HycoCheck(dim == type_dim[type],
              "the mesh %s is damaged: elements of gmsh type %lld on an entity of dimension %lld", m->path, type, dim);
    PetscCall(ReadCount(m, 4, "elements of a block", &n));
    HycoCheck(done + n <= all, "the mesh %s is damaged: its blocks hold more elements than it counts", m->path);
    for (size_t k = 0; k < n; k++) {
      const long long tag = ReadInt(m, 8);

      PetscCall(CheckElement(m, 8, tag, type));
      HycoCheck(tag >= least && tag <= most, "the mesh %s is damaged: element %lld lies outside its tags, %lld to %lld",
                m->path, tag, least, most);
    }
  }
  HycoCheck(done == all, "the mesh %s is damaged: its blocks hold fewer elements than it counts", m->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckElements(Msh *m)
{
  PetscFunctionBegin;
  HycoCheck(m->has_nodes && !m->has_elements, "the mesh %s must have one section $Nodes and then one $Elements",
            m->path);
  m->has_elements = PETSC_TRUE;
  if (m->four)
    PetscCall(CheckElements4(m));
  else
    PetscCall(CheckElements2(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A list of an entity: its groups, or what bounds it. */
static PetscErrorCode SkipList(Msh *m)
{
  size_t n;

  PetscFunctionBegin;
  PetscCall(ReadCount(m, m->binary ? 4 : 2, "groups of an entity", &n));
  for (size_t k = 0; k < n; k++) {
    const long long tag = ReadInt(m, 4);

    HycoCheck(!m->failed && tag > -PETSC_MAX_INT && tag < PETSC_MAX_INT && tag, "the mesh %s is damaged: its entities",
              m->path);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckEntities(Msh *m)
{
  size_t n[4];

  PetscFunctionBegin;
  HycoCheck(m->four && !m->has_nodes, "the mesh %s is damaged: a section $Entities after its nodes", m->path);
  for (int d = 0; d < 4; d++) PetscCall(ReadCount(m, 4, "entities", &n[d]));
  for (int d = 0; d < 4; d++) {
    for (size_t k = 0; k < n[d]; k++) {
      PetscCall(CheckEntity(m, d, ReadInt(m, 4)));
      for (int c = 0; c < (d ? 6 : 3); c++) (void)ReadDouble(m);
      PetscCall(SkipList(m));
      if (d) PetscCall(SkipList(m));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The next line; NULL at the end of the file. */
static const char *NextLine(Msh *m)
{
  const char *line = m->at;
  char *end;

  if (m->at >= m->end) return NULL;
  end = memchr(m->at, '\n', (size_t)(m->end - m->at));
  m->at = end ? end + 1 : m->end;
  return line;
}

/* Whether the rest of a line is one name in quotes that gmsh has room for. */
static PetscBool IsQuoted(const char *text)
{
  const char *end;

  text += strspn(text, " \t");
  if (*text != '"') return PETSC_FALSE;
  end = text + 1 + strcspn(text + 1, "\"\n");
  if (*end != '"' || end - text > 127) return PETSC_FALSE;
  end += 1 + strspn(end + 1, " \t\r");
  return (PetscBool)(*end == '\n' || !*end);
}

/* A line each: dimension, tag, "name"; text in binary files too. */
static PetscErrorCode CheckNames(Msh *m)
{
  const char *line = NextLine(m);
  char *end;
  const long long n = line ? strtoll(line, &end, 10) : -1;

  PetscFunctionBegin;
  HycoCheck(n >= 0 && n <= m->end - m->at, "the mesh %s speaks of %lld names, which it has no room for", m->path, n);
  for (long long k = 0; k < n; k++) {
    long long dim, tag;

    line = NextLine(m);
    HycoCheck(line, "the mesh %s is damaged: it ends among its names", m->path);
    dim = strtoll(line, &end, 10);
    tag = strtoll(end, &end, 10);
    HycoCheck(dim >= 0 && dim <= 3 && tag > 0 && tag < PETSC_MAX_INT && IsQuoted(end),
              "the mesh %s is damaged: a name of a group is \"%.*s\"; dimension (0 to 3), tag and a name in quotes "
              "are expected",
              m->path, (int)PetscMin(strcspn(line, "\r\n"), 40), line);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckFormat(Msh *m)
{
  const char *line = NextLine(m);
  double version;
  char *end;
  long binary, size, one;

  PetscFunctionBegin;
  line = line && strncmp(line, "$MeshFormat", 11) == 0 ? NextLine(m) : NULL;
  HycoCheck(line, "%s is no gmsh mesh: it does not begin with $MeshFormat", m->path);
  version = HycoNumber(line, &end);
  binary = strtol(end, &end, 10);
  size = strtol(end, &end, 10);
  m->four = version > 4.05 && version < 4.15;
  HycoCheck((m->four || (version > 2.15 && version < 2.25)) && (binary == 0 || binary == 1) && size == 8,
            "the mesh %s has gmsh's format %g (%ld, %ld); hyco takes 2.2 and 4.1, text (0) or binary (1), numbers of 8 "
            "bytes: save it by gmsh -save -format msh41",
            m->path, version, binary, size);
  m->binary = (int)binary;
  one = m->binary ? (long)ReadInt(m, 4) : 1;
  HycoCheck(one == 1, "the mesh %s was written on a machine of another byte order", m->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckSections(Msh *m)
{
  const char *line;

  PetscFunctionBegin;
  PetscCall(CheckFormat(m));
  while ((line = NextLine(m))) {
    if (strncmp(line, "$Nodes", 6) == 0)
      PetscCall(CheckNodes(m));
    else if (strncmp(line, "$Elements", 9) == 0)
      PetscCall(CheckElements(m));
    else if (strncmp(line, "$Entities", 9) == 0)
      PetscCall(CheckEntities(m));
    else if (strncmp(line, "$PhysicalNames", 14) == 0)
      PetscCall(CheckNames(m));
    else
      HycoCheck(strncmp(line, "$MeshFormat", 11) && strncmp(line, "$Parti", 6) && strncmp(line, "$Ghost", 6),
                "the mesh %s has a section %.*s that hyco does not take", m->path,
                (int)PetscMin(strcspn(line, "\r\n"), 40), line);
    HycoCheck(!m->failed, "the mesh %s is damaged", m->path);
  }
  HycoCheck(m->has_elements, "the mesh %s cannot be read: it has no $Nodes and $Elements, or ends before them",
            m->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadAll(Msh *m)
{
  FILE *file = fopen(m->path, "rb");
  long size = 0;
  size_t got;

  PetscFunctionBegin;
  HycoCheck(file, "the mesh %s cannot be opened; scripts/meshes makes the examples' meshes, gmsh -3 a .geo's", m->path);
  if (fseek(file, 0, SEEK_END) == 0) size = ftell(file);
  rewind(file);
  if (size < 0 || PetscMalloc1((size_t)size + 1, &m->text)) size = 0;
  got = size ? fread(m->text, 1, (size_t)size, file) : 0;
  fclose(file);
  HycoCheck(got && got == (size_t)size, "%s is no gmsh mesh, or cannot be read", m->path);
  m->text[got] = '\0';
  m->at = m->text;
  m->end = m->text + got;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoMshCheck(const char path[])
{
  Msh m = {.path = path};
  PetscErrorCode ierr;

  PetscFunctionBegin;
  ierr = ReadAll(&m);
  if (!ierr) ierr = CheckSections(&m);
  PetscCall(PetscFree(m.text));
  PetscCall(PetscFree(m.node));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
