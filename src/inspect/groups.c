/* Groups of the mesh: those that no entry of the scene names, those without nodes, those that are nearly the same. */
#include "inspect.h"
#include <string.h>
#include <strings.h>

/* Of the nodes of the larger of two groups, the common ones: 19 of 20 nodes are one group twice, less is two groups. */
#define ALIKE 0.95

/* The number of common nodes of the groups g and h; both are ascending. One pass through both lists. */
static PetscInt GroupsCommon(HycoMesh m, PetscInt g, PetscInt h)
{
  PetscInt n = 0, j = m->group_start[h];

  for (PetscInt i = m->group_start[g]; i < m->group_start[g + 1]; i++) {
    while (j < m->group_start[h + 1] && m->group_node[j] < m->group_node[i]) j++;
    n += j < m->group_start[h + 1] && m->group_node[j] == m->group_node[i];
  }
  return n;
}

/* Pairs of groups that a user may have confused: the same nodes under two names, or two names that differ in letter
   case alone, which options do not distinguish. Nodes are compared within one dimension: a body's group has the nodes
   of its surfaces too. */
static PetscErrorCode FindAlike(HycoInspection *in, HycoMesh m)
{
  PetscFunctionBegin;
  for (PetscInt g = 0; g < m->n_groups; g++) {
    for (PetscInt h = 0; h < g; h++) {
      HycoAlikeGroups a = {.name = {m->group_name[h], m->group_name[g]}};

      a.n[0] = m->group_start[h + 1] - m->group_start[h];
      a.n[1] = m->group_start[g + 1] - m->group_start[g];
      a.letters = (PetscBool)(strcasecmp(a.name[0], a.name[1]) == 0);
      if (m->group_dim[g] == m->group_dim[h] && a.n[1] && PetscMin(a.n[0], a.n[1]) >= ALIKE * PetscMax(a.n[0], a.n[1]))
        a.common = GroupsCommon(m, g, h);
      a.nodes = (PetscBool)(a.common && a.common >= ALIKE * PetscMax(a.n[0], a.n[1]));
      if (!a.letters && !a.nodes) continue;
      PetscCall(PetscRealloc((size_t)(in->n_alike + 1) * sizeof(a), &in->alike));
      in->alike[in->n_alike++] = a;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets used[] for the group `name`; fails if there is none. A HycoGroupVisitor. */
static PetscErrorCode GroupUse(const char key[], const char name[], void *context)
{
  HycoInspection *in = (HycoInspection *)context;
  PetscInt g = 0;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(in->whole->part, key, name, &g));
  in->used[g] = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks the groups of the scene's entries and of the region of interest. Options of the hyco: section may name groups
   too. */
static PetscErrorCode MarkUsed(HycoInspection *in)
{
  char *region[64];
  PetscInt n = 64;

  PetscFunctionBegin;
  PetscCall(HycoSceneVisitGroups(in->whole->scene, GroupUse, in));
  PetscCall(PetscOptionsGetStringArray(in->whole->scene->options, NULL, "-hyco_rid_groups", region, &n, NULL));
  for (PetscInt k = 0; k < n && n < 64; k++) {
    PetscCall(GroupUse("hyco_rid_groups", region[k], in));
    PetscCall(PetscFree(region[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Names are those of the mesh, which in->whole keeps. */
PetscErrorCode HycoInspectGroups(HycoInspection *in)
{
  HycoMesh m = in->whole->part;

  PetscFunctionBegin;
  in->n_groups = m->n_groups;
  PetscCall(PetscCalloc3(m->n_groups, &in->group, m->n_groups, &in->used, m->n_groups, &in->empty));
  for (PetscInt g = 0; g < m->n_groups; g++) {
    in->group[g] = m->group_name[g];
    in->empty[g] = (PetscBool)(m->group_start[g] == m->group_start[g + 1]);
  }
  PetscCall(FindAlike(in, m));
  PetscCall(MarkUsed(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}
