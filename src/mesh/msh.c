/*
  The strict reader of gmsh's mesh files: formats 2.2 and 4.1, text and binary, in one pass. Every count is checked
  against the size of the file, and every tag, type and node against its valid range. (gmsh 4.11 manual, "Gmsh file
  formats".)
*/
#include "msh.h"
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Nodes and dimension of gmsh's element types 1 to 31; 0: a type that hyco does not know. */
static const signed char type_nodes[32] = {0, 2,  3,  4,  4, 8,  6,  5,  3,  6,  9, 10, 27, 18, 14, 1,
                                           8, 20, 15, 13, 9, 10, 12, 15, 15, 21, 4, 5,  6,  20, 35, 56};
/* By gmsh's number of a type; unsupported types have their numbers of nodes so that the messages name them, not the
   end of the file. */
static const signed char type_dim[32] = {0, 1, 2, 2, 3, 3, 3, 3, 1, 2, 2, 3, 3, 3, 3, 0,
                                         2, 3, 3, 3, 2, 2, 2, 2, 2, 2, 1, 1, 1, 3, 3, 3};

/* A name of $PhysicalNames. */
typedef struct {
  int dim, tag;
  char text[128];
} Name;

/* A group of an entity of $Entities (4.1). */
typedef struct {
  int dim, entity, group;
} Member;

typedef struct {
  const char *path;
  char *text, *at, *end; /* the whole file, followed by a byte 0 */
  int four, binary;
  PetscBool has_nodes, has_elements, failed;
  size_t n_names, n_members, room;
  Name *name;
  Member *member;
  HycoMsh *mesh;
} Msh;

/* Returns 0 and sets `failed` at the end of the file or if there is no number. `bytes` matters in binary files
   alone: 4 (int) or 8 (size_t). */
static long long ReadInt(Msh *m, size_t bytes)
{
  long long value = 0;

  if (m->failed) return 0;
  if (m->binary) {
    /* No read past the end, whatever the file declares. */
    if ((size_t)(m->end - m->at) < bytes) {
      m->failed = PETSC_TRUE;
    } else if (bytes == 4) {
      int word;

      /* Not a cast: numbers of a binary file lie at any address. */
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

/* A read past the end marks the file as failed and returns 0; the caller checks once per node. memcpy(): numbers in a
   binary file are not aligned. */
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

    /* Independent of the locale, unlike strtod(). */
    value = HycoNumber(m->at, &end);
    m->failed = (PetscBool)(end == m->at);
    m->at = end;
  }
  return value;
}

/* A count of items of at least `bytes` each; refused if the file is too short for them. */
static PetscErrorCode ReadCount(Msh *m, size_t bytes, const char what[], size_t *n)
{
  const long long value = ReadInt(m, 8);

  PetscFunctionBegin;
  /* Before any allocation. The division cannot overflow, whereas value * bytes could. */
  HycoCheck(!m->failed && value >= 0 && (unsigned long long)value <= (size_t)(m->end - m->at) / bytes,
            "the mesh %s is damaged: it declares %lld %s, more than the file contains", m->path, value, what);
  HycoCheck(value <= PETSC_MAX_INT / 8,
            "the mesh %s has %lld %s, more than the integers of this PETSc can count; use a PETSc with 64-bit indices",
            m->path, value, what);
  *n = (size_t)value;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A count in format 2.2: a line of text, in binary files too. */
static PetscErrorCode ReadCountLine(Msh *m, size_t bytes, const char what[], size_t *n)
{
  const int binary = m->binary;

  PetscFunctionBegin;
  m->binary = 0;
  HycoFinally(ReadCount(m, bytes, what, n), m->binary = binary);
  /* The binary data begin after the line's end, of which exactly one is skipped: their first byte may be a newline
     too. */
  if (binary && m->at < m->end && *m->at == '\r') m->at++;
  if (binary && m->at < m->end && *m->at == '\n') m->at++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- nodes -- */

/* Allocates tags and coordinates for n nodes; the count was checked against the file's size, so that a damaged
   file cannot ask for all memory. */
static PetscErrorCode MakeNodes(Msh *m, size_t n)
{
  PetscFunctionBegin;
  m->mesh->n_nodes = (PetscInt)n;
  PetscCall(PetscMalloc1(n, &m->mesh->tag));
  PetscCall(PetscMalloc1(3 * n, &m->mesh->xyz));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Tags must leave room for the sentinel PETSC_MAX_INT. */
static PetscErrorCode AddNode(Msh *m, size_t k, long long tag)
{
  PetscFunctionBegin;
  HycoCheck(!m->failed, "the mesh %s is damaged: it ends among its nodes", m->path);
  HycoCheck(tag > 0 && tag < PETSC_MAX_INT, "the mesh %s has a node of the tag %lld; tags run from 1 to %lld", m->path,
            tag, (long long)PETSC_MAX_INT - 1);
  m->mesh->tag[k] = (PetscInt)tag;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PETSc would accept NaN, and a solve with it would end without a result. */
static PetscErrorCode AddCoordinates(Msh *m, size_t k)
{
  PetscFunctionBegin;
  for (size_t c = 0; c < 3; c++) {
    const double x = ReadDouble(m);

    HycoCheck(m->failed || !PetscIsInfOrNanReal(x), "%s: node %lld has a coordinate that is not finite", m->path,
              (long long)m->mesh->tag[k]);
    m->mesh->xyz[3 * k + c] = x;
  }
  /* After the three: one check for a node. */
  HycoCheck(!m->failed, "the mesh %s is damaged: the coordinates of node %lld are not numbers", m->path,
            (long long)m->mesh->tag[k]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Format 2.2: 28 bytes a node in binary files, at least 8 characters in text, which bounds a declared number by the
   file's size. */
static PetscErrorCode ReadNodes2(Msh *m)
{
  size_t n;

  PetscFunctionBegin;
  PetscCall(ReadCountLine(m, m->binary ? 28 : 8, "nodes", &n));
  PetscCall(MakeNodes(m, n));
  for (size_t k = 0; k < n; k++) {
    PetscCall(AddNode(m, k, ReadInt(m, 4)));
    PetscCall(AddCoordinates(m, k));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks a block's dimension and number against gmsh's entities. */
static PetscErrorCode CheckEntity(Msh *m, long long dim, long long tag)
{
  PetscFunctionBegin;
  HycoCheck(!m->failed && dim >= 0 && dim <= 3 && tag > 0 && tag < PETSC_MAX_INT,
            "the mesh %s is damaged: there is no entity of dimension %lld and number %lld", m->path, dim, tag);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Blocks by entity: first all tags, then all coordinates, with parametric ones that are dropped. least and most are
   declared; they are compared with each node as a check of damaged files. */
static PetscErrorCode ReadNodes4(Msh *m)
{
  size_t blocks, n, all, done = 0;
  long long least, most;

  PetscFunctionBegin;
  PetscCall(ReadCount(m, 4, "blocks of nodes", &blocks));
  PetscCall(ReadCount(m, m->binary ? 32 : 8, "nodes", &all));
  least = ReadInt(m, 8);
  most = ReadInt(m, 8);
  PetscCall(MakeNodes(m, all));
  for (size_t b = 0; b < blocks; b++, done += n) {
    const long long dim = ReadInt(m, 4), tag = ReadInt(m, 4), parametric = ReadInt(m, 4);

    PetscCall(CheckEntity(m, dim, tag));
    PetscCall(ReadCount(m, m->binary ? 32 : 8, "nodes of a block", &n));
    HycoCheck(parametric == 0 || parametric == 1, "the mesh %s is damaged: a block of nodes", m->path);
    HycoCheck(done + n <= all, "the mesh %s is damaged: its blocks contain more nodes than it declares", m->path);
    for (size_t k = 0; k < n; k++) {
      const long long node = ReadInt(m, 8);

      PetscCall(AddNode(m, done + k, node));
      HycoCheck(node >= least && node <= most,
                "the mesh %s is damaged: node %lld lies outside its range of tags, %lld to %lld", m->path, node, least,
                most);
    }
    for (size_t k = 0; k < n; k++) {
      PetscCall(AddCoordinates(m, done + k));
      /* Parametric coordinates on the entity, one per dimension of it. */
      for (long long p = 0; parametric && p < dim; p++) (void)ReadDouble(m);
    }
  }
  HycoCheck(done == all, "the mesh %s is damaged: its blocks contain fewer nodes than it declares", m->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sorts the nodes by tag. By a permutation, since coordinates move with their tags. */
static PetscErrorCode SortNodes(HycoMsh *mesh)
{
  const PetscInt n = mesh->n_nodes;
  PetscInt *order, *tag;
  PetscReal *xyz;
  PetscBool sorted;

  PetscFunctionBegin;
  PetscCall(PetscSortedInt(n, mesh->tag, &sorted));
  /* gmsh writes them in order as a rule. */
  if (sorted) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(n, &order));
  for (PetscInt k = 0; k < n; k++) order[k] = k;
  PetscCall(PetscSortIntWithPermutation(n, mesh->tag, order));
  PetscCall(PetscMalloc1(n, &tag));
  PetscCall(PetscMalloc1(3 * n, &xyz));
  for (PetscInt k = 0; k < n; k++) {
    tag[k] = mesh->tag[order[k]];
    for (PetscInt c = 0; c < 3; c++) xyz[3 * k + c] = mesh->xyz[3 * order[k] + c];
  }
  HycoFreeAll(&order, &mesh->tag, &mesh->xyz);
  mesh->tag = tag;
  mesh->xyz = xyz;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nodes are sorted by tag: every later order follows from the tags, not from the file. */
static PetscErrorCode ReadNodes(Msh *m)
{
  PetscFunctionBegin;
  HycoCheck(!m->has_nodes, "the mesh %s has two sections $Nodes", m->path);
  m->has_nodes = PETSC_TRUE;
  if (m->four)
    PetscCall(ReadNodes4(m));
  else
    PetscCall(ReadNodes2(m));
  PetscCall(SortNodes(m->mesh));
  for (PetscInt k = 1; k < m->mesh->n_nodes; k++)
    HycoCheck(m->mesh->tag[k] != m->mesh->tag[k - 1], "%s: node %lld occurs twice", m->path,
              (long long)m->mesh->tag[k]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Index of a node, or -1. */
static PetscInt FindNode(const HycoMsh *mesh, long long tag)
{
  const PetscInt n = mesh->n_nodes;
  PetscInt at;

  if (!n || tag < mesh->tag[0] || tag > mesh->tag[n - 1]) return -1;
  /* Tags ascend and are distinct, so that this means no gaps: the usual file, whose search then costs nothing. */
  if (mesh->tag[n - 1] - mesh->tag[0] == n - 1) return (PetscInt)tag - mesh->tag[0]; /* the tags are consecutive */
  return PetscFindInt((PetscInt)tag, n, mesh->tag, &at) || at < 0 ? -1 : at;
}

/* -- elements, by group -- */

/* Index of a group, which is inserted if it is new. Groups are sorted by dimension and tag, so that their order
   does not depend on that of the file's sections. */
static PetscErrorCode FindGroup(HycoMsh *mesh, int dim, int tag, PetscInt *index)
{
  PetscInt k = 0;

  PetscFunctionBegin;
  while (k < mesh->n_groups && (mesh->group[k].dim < dim || (mesh->group[k].dim == dim && mesh->group[k].tag < tag)))
    k++;
  *index = k;
  if (k < mesh->n_groups && mesh->group[k].dim == dim && mesh->group[k].tag == tag) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscRealloc(((size_t)mesh->n_groups + 1) * sizeof(*mesh->group), &mesh->group));
  /* Insertion among tens of groups. Pointers to groups become invalid here, hence the callers keep indices. */
  memmove(mesh->group + k + 1, mesh->group + k, (size_t)(mesh->n_groups - k) * sizeof(*mesh->group));
  mesh->n_groups++;
  memset(&mesh->group[k], 0, sizeof(*mesh->group));
  mesh->group[k].dim = dim;
  mesh->group[k].tag = tag;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The group's name, set at the first use. */
static const char *GroupName(Msh *m, HycoMshGroup *g)
{
  if (!g->name[0]) snprintf(g->name, sizeof(g->name), "group_%d_%d", g->dim, g->tag);
  for (size_t k = 0; k < m->n_names; k++) {
    if (m->name[k].dim == g->dim && m->name[k].tag == g->tag && m->name[k].text[0])
      snprintf(g->name, sizeof(g->name), "%s", m->name[k].text);
  }
  return g->name;
}

#define TAKES                                                                                                          \
  "hyco supports line2, tri3, quad4, tet4, pyramid5, prism6 and hex8, and of second order tri6, quad8, quad9, tet10, " \
  "hex20 and hex27: mesh the bodies with these"

/* Names of types that are refused. */
static const char *TypeName(long long type)
{
  switch (type) {
  case 13:
  case 18:
    return "prisms of second order";
  case 14:
  case 19:
    return "pyramids of second order";
  default:
    return "not known here";
  }
}

/* Widens a group, or an element of nv nodes that is to be added, so that both have the same number. Shapes with fewer
   nodes repeat nodes; a group has one number of nodes for all of its elements. */
static PetscErrorCode MshMatch(Msh *m, HycoMshGroup *g, PetscInt nv, PetscInt node[])
{
  const HycoCellType has = HycoMshType(g->dim, g->nv), own = HycoMshType(g->dim, nv);
  const HycoCellType both = has < HYCO_N_CELL_TYPES && own < HYCO_N_CELL_TYPES
                                ? HycoShapesType((PetscInt)1 << has | (PetscInt)1 << own)
                                : HYCO_N_CELL_TYPES;

  PetscFunctionBegin;
  HycoCheck(both < HYCO_N_CELL_TYPES,
            "%s: group \"%s\" mixes elements of %d and %d nodes; only first-order cells may be of several types: mesh "
            "with gmsh -order 1, or recombine all surfaces, or none",
            m->path, GroupName(m, g), (int)g->nv, (int)nv);
  PetscCall(HycoMshWiden(g, HycoCellKinds[both].nv));
  HycoShapeWiden(own, g->nv, node);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Appends an element to a group. */
static PetscErrorCode AddElement(Msh *m, HycoMshGroup *g, long long tag, long long type, const PetscInt of[])
{
  PetscInt nv = type_nodes[type], node[64];

  PetscFunctionBegin;
  HycoCheck(type <= 7 || (type >= 8 && type <= 12) || (type >= 15 && type <= 17),
            "%s: group \"%s\" has elements of gmsh type %lld (%s); " TAKES, m->path, GroupName(m, g), type,
            TypeName(type));
  PetscCall(PetscArraycpy(node, of, nv));
  /* The true shape, before elements are widened; points have none and set the bit of HYCO_N_CELL_TYPES, which no
     body reads. */
  g->shapes |= (PetscInt)1 << HycoMshType(g->dim, nv);
  /* Either the group or the element gets wider, so that all rows of node[] have one length. */
  if (g->n && g->nv != nv) PetscCall(MshMatch(m, g, nv, node));
  if (!g->n) g->nv = nv;
  nv = g->nv;
  if (g->n == g->room) {
    HycoCheck(g->n < PETSC_MAX_INT / 16, "%s: group \"%s\" has too many elements", m->path, GroupName(m, g));
    g->room = PetscMax(64, 2 * g->room);
    PetscCall(PetscRealloc((size_t)g->room * sizeof(*g->id), &g->id));
    PetscCall(PetscRealloc((size_t)(g->room * nv) * sizeof(*g->node), &g->node));
  }
  g->id[g->n] = (PetscInt)tag;
  PetscCall(PetscArraycpy(g->node + g->n * nv, node, nv));
  g->n++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the tag and the nodes of one element of a known type; changes the type of one with repeated nodes. *of becomes
   the type of the smaller shape: meshers collapse hexahedra at the axis of a sweep. */
static PetscErrorCode ReadElement(Msh *m, size_t bytes, long long tag, long long *of, PetscInt node[])
{
  const long long type = *of;
  PetscBool repeated = PETSC_FALSE;

  PetscFunctionBegin;
  HycoCheck(!m->failed && tag > 0 && tag < PETSC_MAX_INT, "the mesh %s is damaged: it has an element of the tag %lld",
            m->path, tag);
  for (int v = 0; v < type_nodes[type]; v++) {
    const long long name = ReadInt(m, bytes);

    HycoCheck(!m->failed, "the mesh %s is damaged: it ends among its elements", m->path);
    node[v] = FindNode(m->mesh, name);
    HycoCheck(node[v] >= 0, "%s: element %lld refers to node %lld, which the file does not define", m->path, tag, name);
    for (int w = 0; w < v; w++) repeated = (PetscBool)(repeated || node[w] == node[v]);
  }
  if (repeated) {
    /* 0: no known collapse, which is an error. */
    *of = HycoMshReduce(type, node);
    HycoCheck(
        *of,
        "%s: element %lld has a node twice, and is no quad4 or hex8 that is collapsed to a triangle, tetrahedron, "
        "pyramid or prism; check the mesh",
        m->path, tag);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* gmsh numbers its types from 1; only those with a known number of nodes can even be skipped. */
static PetscErrorCode CheckType(Msh *m, long long type)
{
  PetscFunctionBegin;
  HycoCheck(!m->failed && type > 0 && type < 32, "the mesh %s has elements of gmsh type %lld (%s); " TAKES, m->path,
            type, TypeName(type));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the tags of an element in format 2.2: its group (0: none), its entity, possibly its partition. */
static PetscErrorCode ReadTags2(Msh *m, long long n, long long *group)
{
  PetscFunctionBegin;
  for (long long t = 0; t < n; t++) {
    const long long value = ReadInt(m, 4);

    HycoCheck(!m->failed && value >= 0 && value < PETSC_MAX_INT, "the mesh %s is damaged: an element's group is %lld",
              m->path, value);
    if (!t) *group = value;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Binary files have blocks of elements with one header, text has a header per line; both are read as blocks, of one
   element in text. `follow` is the number of elements in a block. */
static PetscErrorCode ReadElements2(Msh *m)
{
  size_t n;

  PetscFunctionBegin;
  PetscCall(ReadCountLine(m, 8, "elements", &n));
  for (size_t k = 0; k < n;) {
    long long tag = m->binary ? 0 : ReadInt(m, 4), type, follow, n_tags, group = 0;

    type = ReadInt(m, 4);
    follow = m->binary ? ReadInt(m, 4) : 1;
    n_tags = ReadInt(m, 4);
    PetscCall(CheckType(m, type));
    HycoCheck(!m->failed && n_tags >= 2 && n_tags <= 3,
              "the mesh %s has an element with %lld tags, and 2 are expected; if it is partitioned, save it without "
              "partitions",
              m->path, n_tags);
    HycoCheck(follow > 0 && (size_t)follow <= n - k, "the mesh %s is damaged: a block of %lld elements", m->path,
              follow);
    for (long long e = 0; e < follow; e++) {
      long long own = type;
      PetscInt node[64], at;

      /* In text the tag is the first number of the line, before the type. */
      if (m->binary) tag = ReadInt(m, 4);
      PetscCall(ReadTags2(m, n_tags, &group));
      PetscCall(ReadElement(m, 4, tag, &own, node));
      /* gmsh's group 0: the element belongs to no physical group. */
      if (!group) continue;
      PetscCall(FindGroup(m->mesh, type_dim[type], (int)group, &at));
      PetscCall(AddElement(m, &m->mesh->group[at], tag, own, node));
    }
    k += (size_t)follow;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the elements of a block to the groups of its entity. An entity may be in several groups: its elements are added
   to each. */
static PetscErrorCode ReadBlock4(Msh *m, long long dim, long long entity, long long type, size_t n, long long least,
                                 long long most)
{
  size_t first = 0, last;

  PetscFunctionBegin;
  /* Members are contiguous by entity, in the order of $Entities. */
  while (first < m->n_members && (m->member[first].dim != dim || m->member[first].entity != entity)) first++;
  for (last = first; last < m->n_members && m->member[last].dim == dim && m->member[last].entity == entity;) last++;
  for (size_t k = 0; k < n; k++) {
    const long long tag = ReadInt(m, 8);
    long long own = type;
    PetscInt node[64];

    PetscCall(ReadElement(m, 8, tag, &own, node));
    HycoCheck(tag >= least && tag <= most,
              "the mesh %s is damaged: element %lld lies outside its range of tags, %lld to %lld", m->path, tag, least,
              most);
    for (size_t g = first; g < last; g++) {
      PetscInt at;

      PetscCall(FindGroup(m->mesh, (int)dim, m->member[g].group, &at));
      PetscCall(AddElement(m, &m->mesh->group[at], tag, own, node));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Format 4.1: blocks of elements of one entity and type. The declared numbers are compared with what the blocks have,
   since a truncated file may end at a block. */
static PetscErrorCode ReadElements4(Msh *m)
{
  size_t blocks, n, all, done = 0;
  long long least, most;

  PetscFunctionBegin;
  PetscCall(ReadCount(m, 4, "blocks of elements", &blocks));
  PetscCall(ReadCount(m, 4, "elements", &all));
  least = ReadInt(m, 8);
  most = ReadInt(m, 8);
  /* Counted over blocks, to be compared with the declared number. */
  for (size_t b = 0; b < blocks; b++, done += n) {
    const long long dim = ReadInt(m, 4), entity = ReadInt(m, 4), type = ReadInt(m, 4);

    PetscCall(CheckEntity(m, dim, entity));
    PetscCall(CheckType(m, type));
    HycoCheck(dim == type_dim[type],
              "the mesh %s is damaged: elements of gmsh type %lld on an entity of dimension %lld", m->path, type, dim);
    PetscCall(ReadCount(m, 4, "elements of a block", &n));
    HycoCheck(done + n <= all, "the mesh %s is damaged: its blocks contain more elements than it declares", m->path);
    PetscCall(ReadBlock4(m, dim, entity, type, n, least, most));
  }
  HycoCheck(done == all, "the mesh %s is damaged: its blocks contain fewer elements than it declares", m->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Elements refer to nodes by tag, so that the nodes must come first. */
static PetscErrorCode ReadElements(Msh *m)
{
  PetscFunctionBegin;
  HycoCheck(m->has_nodes && !m->has_elements, "the mesh %s must have one section $Nodes and then one $Elements",
            m->path);
  m->has_elements = PETSC_TRUE;
  if (m->four)
    PetscCall(ReadElements4(m));
  else
    PetscCall(ReadElements2(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -- entities and names -- */

/* Reads a list of an entity: its groups, whose sign is an orientation, or its boundary. The boundary is read to be
   skipped. */
static PetscErrorCode ReadList(Msh *m, PetscBool groups, int dim, long long entity)
{
  size_t n;

  PetscFunctionBegin;
  PetscCall(ReadCount(m, m->binary ? 4 : 2, "groups of an entity", &n));
  for (size_t k = 0; k < n; k++) {
    const long long tag = ReadInt(m, 4);
    /* Physical tags of 4.1 are negative where the entity is reversed; facets are oriented by their cells later, so
       that the sign is dropped. */
    const Member member = {dim, (int)entity, (int)(tag < 0 ? -tag : tag)};
    PetscInt at;

    HycoCheck(!m->failed && tag > -PETSC_MAX_INT && tag < PETSC_MAX_INT && tag, "the mesh %s is damaged: its entities",
              m->path);
    if (!groups) continue;
    PetscCall(FindGroup(m->mesh, dim, member.group, &at));
    HycoGrow(m->n_members, m->room, m->member);
    m->member[m->n_members++] = member;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bounding boxes and boundaries are skipped; only the entity's groups count. A point has 3 coordinates, others a
   box of 6. */
static PetscErrorCode ReadEntities(Msh *m)
{
  size_t n[4];

  PetscFunctionBegin;
  /* Elements of 4.1 refer to entities, which give their groups: this section must be read first. */
  HycoCheck(m->four && !m->has_nodes, "the mesh %s is damaged: a section $Entities after its nodes", m->path);
  for (int d = 0; d < 4; d++) PetscCall(ReadCount(m, 4, "entities", &n[d]));
  for (int d = 0; d < 4; d++) {
    for (size_t k = 0; k < n[d]; k++) {
      const long long entity = ReadInt(m, 4);

      PetscCall(CheckEntity(m, d, entity));
      for (int c = 0; c < (d ? 6 : 3); c++) (void)ReadDouble(m);
      PetscCall(ReadList(m, PETSC_TRUE, d, entity));
      if (d) PetscCall(ReadList(m, PETSC_FALSE, d, entity));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The next line; NULL at the end of the file. m->at is afterwards behind it. */
static const char *NextLine(Msh *m)
{
  const char *line = m->at;
  char *end;

  if (m->at >= m->end) return NULL;
  end = memchr(m->at, '\n', (size_t)(m->end - m->at));
  m->at = end ? end + 1 : m->end;
  return line;
}

/* Reads the rest of a line as one name in quotes, of at most 126 bytes. */
static PetscBool ReadQuoted(const char *text, char name[128])
{
  const char *end;

  text += strspn(text, " \t");
  if (*text != '"') return PETSC_FALSE;
  end = text + 1 + strcspn(text + 1, "\"\n");
  if (*end != '"' || end - text > 127) return PETSC_FALSE;
  snprintf(name, 128, "%.*s", (int)(end - text - 1), text + 1);
  end += 1 + strspn(end + 1, " \t\r");
  return (PetscBool)(*end == '\n' || !*end);
}

/* One line each: dimension, tag, "name"; text in binary files too. Names are optional: groups without one are known by
   their number. */
static PetscErrorCode ReadNames(Msh *m)
{
  const char *line = NextLine(m);
  char *end;
  const long long n = line ? strtoll(line, &end, 10) : -1;

  PetscFunctionBegin;
  HycoCheck(n >= 0 && n <= m->end - m->at, "the mesh %s declares %lld names, more than the file contains", m->path, n);
  for (long long k = 0; k < n; k++) {
    long long dim, tag;
    Name name;

    line = NextLine(m);
    HycoCheck(line, "the mesh %s is damaged: it ends among its names", m->path);
    dim = strtoll(line, &end, 10);
    tag = strtoll(end, &end, 10);
    HycoCheck(dim >= 0 && dim <= 3 && tag > 0 && tag < PETSC_MAX_INT && ReadQuoted(end, name.text),
              "the mesh %s is damaged: a name of a group is \"%.*s\"; dimension (0 to 3), tag and a name in quotes "
              "are expected",
              m->path, (int)PetscMin(strcspn(line, "\r\n"), 40), line);
    name.dim = (int)dim;
    name.tag = (int)tag;
    /* Room grows by doubling, without a counter of its own. */
    if (!(m->n_names & (m->n_names + 1))) /* one below a power of 2: double the size */
      PetscCall(PetscRealloc((2 * m->n_names + 2) * sizeof(name), &m->name));
    m->name[m->n_names++] = name;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The format of a file that is not gmsh's, by its content, or else by its name; NULL: unknown. */
static const char *OtherFormat(const Msh *m)
{
  /* Extensions last: content is the better evidence, but most of these formats have no mark at their beginning. */
  static const char *const names[][2] = {
      {"inp", "Abaqus"},  {"unv", "I-DEAS (.unv)"}, {"med", "MED"},  {"vtu", "VTK"},     {"vtk", "VTK"},
      {"cgns", "CGNS"},   {"exo", "Exodus"},        {"e", "Exodus"}, {"bdf", "Nastran"}, {"nas", "Nastran"},
      {"fem", "Nastran"}, {"mesh", "Medit"},        {"xdmf", "XDMF"}};
  const char *dot = strrchr(m->path, '.'), *text = m->text + strspn(m->text, " \t\r\n");

  if (strncmp(text, "$NOD", 4) == 0) return "gmsh (format 1)";
  if (text[0] == '*' && (text[1] == '*' || isalpha((unsigned char)text[1]))) return "Abaqus";
  if (strncmp(text, "-1", 2) == 0 && strchr("\r\n", text[2])) return "I-DEAS (.unv)";
  if (strncmp(text, "<VTKFile", 8) == 0 || strncmp(text, "# vtk", 5) == 0) return "VTK";
  for (size_t k = 0; dot && k < sizeof(names) / sizeof(names[0]); k++) {
    if (strcasecmp(dot + 1, names[k][0]) == 0) return names[k][1];
  }
  return NULL;
}

/* Recognises formats that users have by mistake, and names the conversion. */
static PetscErrorCode RefuseOther(const Msh *m)
{
  const char *other = OtherFormat(m);

  PetscFunctionBegin;
  /* gmsh's own older format has another remedy than a foreign one. */
  HycoCheck(!other || strncmp(other, "gmsh", 4),
            "the mesh %s has gmsh's format 1; hyco reads 2.2 and 4.1: convert it by gmsh -save -format msh41 %s -o "
            "NEW.msh",
            m->path, m->path);
  HycoCheck(!other, "the mesh %s is a file of %s, not of gmsh; convert it by scripts/convert %s NEW.msh", m->path,
            other, m->path);
  HycoFail("%s is not a gmsh mesh: it does not begin with $MeshFormat", m->path);
}

/* gmsh 4.0, whose sections differ from those of 4.1, is refused like any other version. */
static PetscErrorCode ReadFormat(Msh *m)
{
  const char *line = NextLine(m);
  double version;
  char *end;
  long binary, size, one;

  /* Checks the version (2.2 or 4.1), the kind and the size of numbers; the integer 1 in binary files shows the
     byte order. */
  PetscFunctionBegin;
  line = line && strncmp(line, "$MeshFormat", 11) == 0 ? NextLine(m) : NULL;
  if (!line) PetscCall(RefuseOther(m));
  version = HycoNumber(line, &end);
  binary = strtol(end, &end, 10);
  size = strtol(end, &end, 10);
  m->four = version > 4.05 && version < 4.15;
  HycoCheck((m->four || (version > 2.15 && version < 2.25)) && (binary == 0 || binary == 1) && size == 8,
            "the mesh %s has gmsh's format %g (%ld, %ld); hyco reads 2.2 and 4.1, text (0) or binary (1), with numbers "
            "of 8 bytes: save it by gmsh -save -format msh41",
            m->path, version, binary, size);
  m->binary = (int)binary;
  one = m->binary ? (long)ReadInt(m, 4) : 1;
  HycoCheck(one == 1, "the mesh %s was written on a machine with another byte order; save it on this machine", m->path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Skips sections that are not needed ($Periodic, post-processing data) line by line. Entities must come before
   elements, as gmsh writes them: elements name their entity. */
static PetscErrorCode ReadSections(Msh *m)
{
  const char *line;

  PetscFunctionBegin;
  PetscCall(ReadFormat(m));
  while ((line = NextLine(m))) {
    if (strncmp(line, "$Nodes", 6) == 0)
      PetscCall(ReadNodes(m));
    else if (strncmp(line, "$Elements", 9) == 0)
      PetscCall(ReadElements(m));
    else if (strncmp(line, "$Entities", 9) == 0)
      PetscCall(ReadEntities(m));
    else if (strncmp(line, "$PhysicalNames", 14) == 0)
      PetscCall(ReadNames(m));
    else
      /* Partitioned files repeat nodes and cells for each part. Lines that are not of a section, as $End..., pass. */
      HycoCheck(strncmp(line, "$MeshFormat", 11) && strncmp(line, "$Parti", 6) && strncmp(line, "$Ghost", 6),
                "the mesh %s has a section %.*s that hyco does not support", m->path,
                (int)PetscMin(strcspn(line, "\r\n"), 40), line);
    HycoCheck(!m->failed, "the mesh %s is damaged", m->path);
  }
  HycoCheck(m->has_elements, "the mesh %s cannot be read: it has no $Nodes and $Elements, or it ends before them",
            m->path);
  HycoCheck(m->mesh->n_groups,
            "%s has no physical groups; name the bodies and surfaces in gmsh (Physical Volume, Physical Surface, ...)",
            m->path);
  for (PetscInt k = 0; k < m->mesh->n_groups; k++) (void)GroupName(m, &m->mesh->group[k]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The whole file in memory: the parsers then never meet the end of a buffer within a number. A zero after the last byte
   ends every number. */
static PetscErrorCode ReadAll(Msh *m)
{
  FILE *file = fopen(m->path, "rb");
  long size = 0;
  size_t got;

  PetscFunctionBegin;
  HycoCheckFile(
      file,
      "the mesh %s cannot be opened; scripts/meshes makes the meshes of the examples, and gmsh -2 or -3 makes "
      "one from a .geo file",
      m->path);
  if (fseek(file, 0, SEEK_END) == 0) size = ftell(file);
  rewind(file);
  /* A directory has a negative or a huge size; both end in the message below, not in an error of PETSc. */
  if (size < 0 || PetscMalloc1((size_t)size + 1, &m->text)) size = 0;
  got = size ? fread(m->text, 1, (size_t)size, file) : 0;
  fclose(file);
  HycoCheck(got && got == (size_t)size, "%s is not a gmsh mesh, or cannot be read", m->path);
  m->text[got] = '\0';
  m->at = HycoSkipMark(m->text);
  m->end = m->text + got;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fills the tables of a file; the caller destroys them also after an error. One process. */
PetscErrorCode HycoMshRead(const char path[], HycoMsh *mesh)
{
  Msh m = {.path = path, .mesh = mesh};
  PetscErrorCode ierr;

  PetscFunctionBegin;
  memset(mesh, 0, sizeof(*mesh));
  ierr = ReadAll(&m);
  if (!ierr) ierr = ReadSections(&m);
  HycoFreeAll(&m.text, &m.name, &m.member);
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Also of tables that a failed HycoMshRead() left incomplete: it has set them to 0 first. The parser's own data are
   freed by the reader. */
PetscErrorCode HycoMshDestroy(HycoMsh *mesh)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < mesh->n_groups; k++) {
    HycoFreeAll(&mesh->group[k].id, &mesh->group[k].node);
  }
  HycoFreeAll(&mesh->group, &mesh->tag, &mesh->xyz);
  PetscFunctionReturn(PETSC_SUCCESS);
}
