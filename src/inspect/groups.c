/* Groups of the mesh: those that no entry of the scene names, those without nodes, those that are nearly the same. */
#include "inspect.h"
#include <string.h>
#include <strings.h>

/* Groups with this share of common nodes are alike. */
#define ALIKE 0.95

/* The number of common nodes of the groups g and h; both are ascending. */
static PetscInt Common(HycoMesh m, PetscInt g, PetscInt h)
{
  PetscInt n = 0, j = m->group_start[h];

  for (PetscInt i = m->group_start[g]; i < m->group_start[g + 1]; i++) {
    while (j < m->group_start[h + 1] && m->group_node[j] < m->group_node[i]) j++;
    n += j < m->group_start[h + 1] && m->group_node[j] == m->group_node[i];
  }
  return n;
}

/* Pairs of groups that a user may have confused: the same nodes under two names, or two names that differ in letter case
   alone, which options do not distinguish. */
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
        a.common = Common(m, g, h);
      a.nodes = (PetscBool)(a.common && a.common >= ALIKE * PetscMax(a.n[0], a.n[1]));
      if (!a.letters && !a.nodes) continue;
      PetscCall(PetscRealloc((size_t)(in->n_alike + 1) * sizeof(a), &in->alike));
      in->alike[in->n_alike++] = a;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets used[g] for the group `name`; fails if there is none. */
static PetscErrorCode Use(HycoMesh m, const char key[], const char name[], PetscBool used[])
{
  PetscInt g = 0;

  PetscFunctionBegin;
  PetscCall(HycoMeshFindGroup(m, key, name, &g));
  used[g] = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks the groups used in the scene: bodies, supports, loads, contacts with the entries of their types, outputs, the
   region of interest. */
static PetscErrorCode MarkUsed(HycoScene s, HycoMesh m, PetscBool used[])
{
  char *region[64];
  PetscInt n = 64;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->n_bodies; k++) PetscCall(Use(m, "body", s->body[k].name, used));
  for (PetscInt k = 0; k < s->n_fixed; k++) PetscCall(Use(m, "fixed", s->fixed[k].group, used));
  for (PetscInt k = 0; k < s->n_loads; k++) PetscCall(Use(m, "load", s->load[k].group, used));
  for (PetscInt k = 0; k < s->n_point_loads; k++) PetscCall(Use(m, "force", s->point_load[k].group, used));
  for (PetscInt k = 0; k < s->n_springs; k++) PetscCall(Use(m, "spring", s->spring[k].group, used));
  for (PetscInt k = 0; k < 2 * s->n_ties; k++)
    PetscCall(Use(m, "tie", k % 2 ? s->tie[k / 2].master : s->tie[k / 2].slave, used));
  for (PetscInt k = 0; k < s->n_contacts; k++) {
    for (PetscInt j = 0; j < s->contact[k]->entries.n; j++) {
      const HycoEntry *entry = &s->contact[k]->entries.entry[j];

      if (entry->kind == HYCO_ENTRY_GROUP && entry->text) PetscCall(Use(m, "contact", entry->text, used));
    }
  }
  for (PetscInt k = 0; k < s->n_quantities; k++) {
    if (s->quantity[k].group) PetscCall(Use(m, "output", s->quantity[k].group, used));
  }
  PetscCall(PetscOptionsGetStringArray(s->options, NULL, "-hyco_rid_groups", region, &n, NULL));
  for (PetscInt k = 0; k < n && n < 64; k++) {
    PetscCall(Use(m, "hyco_rid_groups", region[k], used));
    PetscCall(PetscFree(region[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

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
  PetscCall(MarkUsed(in->whole->scene, m, in->used));
  PetscFunctionReturn(PETSC_SUCCESS);
}
