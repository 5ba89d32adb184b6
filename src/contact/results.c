/* Results of each contact of the scene: its resultant and moment on the slave's side, area, largest pressure. */
#include <hycocontactimpl.h>
#include <hycokinematics.h>
#include <string.h>

/* Sums of all ranks' values by node of the surface. By the sum over ranks, because a node's contact belongs to the
   rank that owns it. */
static PetscErrorCode SumByNode(PetscSF sf, HycoMesh m, PetscReal value[])
{
  PetscReal *owned;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(m->n_owned, &owned));
  PetscCall(PetscSFReduceBegin(sf, MPIU_REAL, value, owned, MPI_SUM));
  PetscCall(PetscSFReduceEnd(sf, MPIU_REAL, value, owned, MPI_SUM));
  PetscCall(HycoSFBcast(sf, MPIU_REAL, 1, owned, value));
  PetscCall(PetscFree(owned));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The pressures of one contact of the scene at nodes without area: with the middles of their facets, which may be
   slaves of other ranks. size, force: of the contact's nodes. */
static void AddMiddles(HycoFE fe, const HycoPairs *pairs, PetscInt c, const PetscReal size[], const PetscReal force[],
                       PetscReal pressure[])
{
  HycoMesh m = fe->mesh;

  for (PetscInt k = 0; k < pairs->n; k++) {
    const PetscInt slave = pairs->slave[k];
    PetscReal all[2] = {size[slave], force[slave]};

    /* p = (sum of lambda) / (sum of areas) of the node and its facets' middles. */
    if (pairs->contact[k] != c || !HycoNodeHasNoArea(fe, slave)) continue;
    /* Few nodes are on the axis: the search over all facets needs no table. */
    for (PetscInt f = 0; f < m->n_facets; f++) {
      const PetscInt *node = m->facets + f * m->nf;

      if (node[0] != slave && node[1] != slave) continue;
      if (strcmp(m->group_name[m->facet_group[f]], fe->scene->contact[c]->slave)) continue;
      all[0] += size[node[2]];
      all[1] += force[node[2]];
    }
    pressure[k] = all[0] > 0 ? all[1] / all[0] : 0;
  }
}

/* p = lambda / area (Pa). On the axis of a second-order axisymmetric mesh a node's area vanishes, and the facets'
   middles give the pressure. Collective. */
PetscErrorCode HycoContactPressures(MPI_Comm comm, HycoFE fe, const HycoPairs *pairs, const PetscReal area[],
                                    const PetscReal lambda[], PetscReal pressure[])
{
  HycoMesh m = fe->mesh;
  PetscReal *size, *force;
  PetscSF sf = NULL;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < pairs->n; k++) pressure[k] = area[k] > 0 ? lambda[k] / area[k] : 0;
  /* Elsewhere every node that carries a force has an area. */
  if (fe->formulation != HYCO_AXISYMMETRIC || !HycoMeshIsQuadratic(m)) PetscFunctionReturn(PETSC_SUCCESS);
  if (HycoSize(comm) > 1) PetscCall(HycoMeshNodeSF(comm, m, m->n_nodes, m->node_global, &sf));
  PetscCall(PetscMalloc2(m->n_nodes, &size, m->n_nodes, &force));
  for (PetscInt c = 0; c < fe->scene->n_contacts; c++) {
    PetscCall(PetscArrayzero(size, m->n_nodes));
    PetscCall(PetscArrayzero(force, m->n_nodes));
    for (PetscInt k = 0; k < pairs->n; k++) {
      /* One contact after the other: a node may be the slave of several. */
      if (pairs->contact[k] != c) continue;
      size[pairs->slave[k]] = area[k];
      force[pairs->slave[k]] = lambda[k];
    }
    /* A facet's nodes may be owned by other ranks, which have their contacts. */
    if (sf) PetscCall(SumByNode(sf, m, size));
    if (sf) PetscCall(SumByNode(sf, m, force));
    AddMiddles(fe, pairs, c, size, force, pressure);
  }
  PetscCall(PetscFree2(size, force));
  PetscCall(PetscSFDestroy(&sf));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the contribution of potential contact k; shear: the tangential force on the slave. */
static void ResultsAdd(HycoFE fe, const PetscReal x[3], const PetscReal normal[3], PetscReal area, PetscReal lambda,
                       const PetscReal shear[3], PetscReal pressure, HycoContactResult *r)
{
  const PetscBool around = (PetscBool)(fe->formulation == HYCO_AXISYMMETRIC);
  PetscReal push[3];

  r->n_active++;
  r->area += area;
  r->pressure = PetscMax(r->pressure, pressure);
  /* The force on the slave's body: lambda >= 0 pushes it against the normal. */
  for (PetscInt d = 0; d < 3; d++) push[d] = d < fe->dim ? shear[d] - lambda * normal[d] : 0;
  if (around) push[0] = 0; /* the radial force is zero in the sum over the circle */
  for (PetscInt d = 0; d < 3; d++) r->friction[d] += around && d == 0 ? 0 : shear[d];
  for (PetscInt d = 0; d < 3; d++) {
    const PetscInt e = (d + 1) % 3, g = (d + 2) % 3;

    r->force[d] += push[d];
    if (!around) r->moment[d] += x[e] * push[g] - x[g] * push[e];
  }
}

/* The nodes of a group are sorted. of[k]: whether contact k counts in an output of a part of a surface, or of one
   contact. */
PetscErrorCode HycoPairsOfQuantity(HycoScene scene, HycoMesh m, const HycoPairs *pairs, const HycoQuantity *q,
                                   PetscBool of[])
{
  PetscInt g = -1;

  PetscFunctionBegin;
  if (q->group) PetscCall(HycoMeshFindGroup(m, "output", q->group, &g));
  for (PetscInt k = 0; k < pairs->n; k++) {
    PetscInt at = 0;

    if (g >= 0)
      PetscCall(PetscFindInt(pairs->slave[k], m->group_start[g + 1] - m->group_start[g],
                             m->group_node + m->group_start[g], &at));
    of[k] = (PetscBool)(at >= 0 && (!q->contact || !strcmp(q->contact, scene->contact[pairs->contact[k]]->name)));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A group that no slave node is in would have results of 0. */
PetscErrorCode HycoPairsCheckQuantities(MPI_Comm comm, HycoScene scene, HycoMesh m, const HycoPairs *pairs)
{
  PetscFunctionBegin;
  for (PetscInt q = 0; q < scene->n_quantities; q++) {
    const HycoQuantity *quantity = &scene->quantity[q];
    PetscBool *of;
    PetscInt n = 0;

    if (!HycoQuantityOfPart(quantity)) continue;
    PetscCall(PetscMalloc1(pairs->n, &of));
    PetscCall(HycoPairsOfQuantity(scene, m, pairs, quantity, of));
    for (PetscInt k = 0; k < pairs->n; k++) n += of[k];
    PetscCall(PetscFree(of));
    /* The part may lie on another rank. */
    HycoAllreduce(&n, 1, MPIU_INT, MPI_SUM, comm);
    HycoCheck(n, "the output %s: no node of the group %s is a slave of %s%s; give a part of a slave surface",
              quantity->name, quantity->group, quantity->contact ? "the contact " : "a contact",
              quantity->contact ? quantity->contact : "");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sums of this rank's contacts only; scene->n_contacts results, then those of outputs of parts. */
PetscErrorCode HycoContactResults(HycoFE fe, const HycoPairs *pairs, const PetscReal normal[], const PetscReal area[],
                                  const PetscReal lambda[], const PetscReal pressure[], PetscReal least,
                                  HycoContactResult result[])
{
  const HycoScene scene = fe->scene;
  PetscBool *of;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(pairs->n, &of));
  for (PetscInt c = 0; c < HycoSceneResults(scene); c++) {
    const HycoQuantity *q = c < scene->n_contacts ? NULL : &scene->quantity[c - scene->n_contacts];
    HycoContactResult *r = &result[c];

    /* The largest number as the minimum of none. */
    *r = (HycoContactResult){.name = q ? q->name : scene->contact[c]->name, .pressure_min = PETSC_MAX_REAL};
    if (q && !HycoQuantityOfPart(q)) continue;
    if (q) PetscCall(HycoPairsOfQuantity(scene, fe->mesh, pairs, q, of));
    for (PetscInt k = 0; k < pairs->n; k++) {
      const PetscReal none[3] = {0, 0, 0}, *shear = pairs->shear ? pairs->shear->force + 3 * k : none;

      if (q ? !of[k] : pairs->contact[k] != c) continue;
      r->n++;
      if (pairs->shear) r->friction_work += pairs->shear->work[k];
      /* An open contact counts as 0, so that a seal that opens anywhere shows it. A node without area has no force of
         its own, and the pressure of the middles beside it. */
      r->pressure_min = PetscMin(r->pressure_min, lambda[k] > least || !(area[k] > 0) ? pressure[k] : 0);
      /* Forces of round-off are no contact: areas would jump by nodes that barely touch. */
      if (lambda[k] > least)
        ResultsAdd(fe, fe->X + 3 * pairs->slave[k], normal + 3 * k, area[k], lambda[k], shear, pressure[k], r);
    }
  }
  PetscCall(PetscFree(of));
  PetscFunctionReturn(PETSC_SUCCESS);
}
