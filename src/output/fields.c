/* The fields of a solution, and their conversion to rows of a file. */
#include <hycofields.h>
#include <hycoh5.h>
#include <hycomaterialimpl.h>
#include <petscblaslapack.h>

/* Without an order the values are already rows, and *rows points to them: the caller frees *rows only if it
   differs from value. */
PetscErrorCode HycoFieldRows(const HycoFileOrder *order, PetscInt n, HycoPlace place, MPI_Datatype type,
                             PetscInt components, const void *value, void **rows)
{
  const PetscInt count = (order ? order->n[place] : n) * components;
  const size_t size = type == MPIU_INT ? sizeof(PetscInt) : sizeof(PetscReal);

  PetscFunctionBegin;
  *rows = (void *)value;
  if (!order) PetscFunctionReturn(PETSC_SUCCESS);
  /* Zero where no rank has a value: a node that no body uses still has a row. */
  PetscCall(PetscCalloc1((size_t)count * size, (char **)rows));
  PetscCall(HycoFileOrderSend(order, place, type, components, value, *rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each rank sends its values to the ranks that own these rows of the file, so that files are in the order of the
   mesh file on any number of ranks, and then writes one contiguous block. order = NULL: one process, whose order
   is that of the file already. */
PetscErrorCode HycoFieldWrite(HycoH5 h, const HycoFileOrder *order, PetscInt n, const char name[], HycoPlace place,
                              MPI_Datatype type, PetscInt components, PetscInt cols, const void *value)
{
  /* components of one node or cell are `lines` lines of cols numbers. */
  const PetscInt all = order ? order->all[place] : n, own = order ? order->n[place] : n,
                 first = order ? order->first[place] : 0, lines = components / PetscAbsInt(cols);
  void *rows = NULL;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoFieldRows(order, n, place, type, components, value, &rows));
  ierr = HycoH5WriteRows(h, name, type, all * lines, cols, first * lines, own * lines, rows);
  if (order) PetscCall(PetscFree(rows));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFieldWriteData(HycoH5 h, const HycoFileOrder *order, PetscInt n, const char name[],
                                  const HycoField *field)
{
  PetscFunctionBegin;
  PetscCall(
      HycoFieldWrite(h, order, n, name, field->place, MPIU_REAL, field->components, field->components, field->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Tags are written beside the rows: they are how users and other programs find a node of the mesh file again. */
PetscErrorCode HycoFieldsWriteMesh(HycoH5 h, const char folder[], const HycoFileOrder *order, HycoMesh m,
                                   const PetscReal X[], PetscBool vtk)
{
  char name[4][HYCO_LINE];
  static const char *const of[4] = {"xyz", "cells", "node_id", "cell_id"};

  PetscFunctionBegin;
  for (int k = 0; k < 4; k++) PetscCall(PetscSNPrintf(name[k], HYCO_LINE, "%s/%s", folder, of[k]));
  PetscCall(HycoFieldWrite(h, order, m->n_nodes, name[0], HYCO_ON_NODES, MPIU_REAL, 3, 3, X));
  PetscCall(HycoFieldsWriteCells(h, name[1], order, m, vtk));
  PetscCall(HycoFieldWrite(h, order, m->n_nodes, name[2], HYCO_ON_NODES, MPIU_INT, 1, 1, m->node_id));
  PetscCall(HycoFieldWrite(h, order, m->n_cells, name[3], HYCO_ON_CELLS, MPIU_INT, 1, 1, m->cell_id));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From xx, yy, zz, xy, yz, xz to the file's rows xx, xy, xz, yy, yz, zz; in 2D the shear in z is 0. */
void HycoTensor6(PetscInt n_cells, PetscInt ns, const PetscReal sigma[], PetscReal tensor[])
{
  static const PetscInt place[6] = {0, 3, 5, 1, 4, 2};

  for (PetscInt e = 0; e < n_cells; e++) {
    for (PetscInt k = 0; k < 6; k++) tensor[6 * e + place[k]] = k < ns ? sigma[e * ns + k] : 0;
  }
}

/* principal: descending, where LAPACK's order is ascending. */
PetscErrorCode HycoStressInvariants(PetscInt n_cells, PetscInt dim, const PetscReal sigma[], PetscReal mises[],
                                    PetscReal principal[])
{
  PetscBLASInt three = 3, lwork = 32, info;

  PetscFunctionBegin;
  for (PetscInt e = 0; e < n_cells; e++) {
    PetscReal s[6], value[3];
    /* LAPACK overwrites the matrix and only reads its upper triangle; both are filled anew for each cell. */
    PetscScalar work[32];

    HycoTensor6(1, HycoStrainSize(dim), sigma + e * HycoStrainSize(dim), s);
    PetscScalar matrix[9] = {s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5]};
    mises[e] = HycoMises(dim, sigma + e * HycoStrainSize(dim));
    LAPACKsyev_("N", "U", &three, matrix, &three, value, work, &lwork, &info);
    PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK syev: %d", (int)info);
    for (PetscInt k = 0; k < 3; k++) principal[3 * e + k] = value[2 - k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Corners of six-node faces have no contacts: they get the mean of the neighbouring middle nodes, so that a plot of
   the pressure has no holes. sum: room for 2 reals a node. */
static PetscErrorCode FillCorners(HycoFE fe, PetscReal sum[], PetscReal pressure[])
{
  HycoMesh m = fe->mesh;
  const PetscInt corners = HycoCellKinds[m->type].corners;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < fe->scene->n_contacts; k++) {
    PetscInt g = 0;

    PetscCall(HycoMeshFindGroup(m, "contact", fe->scene->contact[k]->slave, &g));
    PetscCall(PetscArrayzero(sum, 2 * m->n_nodes));
    for (PetscInt j = 0; j < m->n_facets * corners; j++) {
      const PetscInt *node = m->facets + j / corners * m->nf, v = j % corners;

      /* Neighbouring middle nodes of corner v in this facet are number v and, cyclically, the one before. */
      if (m->facet_group[j / corners] != g) continue;
      sum[2 * node[v]] += pressure[node[corners + v]] + pressure[node[corners + (v + corners - 1) % corners]];
      sum[2 * node[v] + 1] += 2;
    }
    for (PetscInt i = 0; i < m->n_nodes; i++) {
      /* Of several contacts the largest, as for the other nodes. */
      if (sum[2 * i + 1] > 0) pressure[i] = PetscMax(pressure[i], sum[2 * i] / sum[2 * i + 1]);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of this process's contacts. force: on both bodies, on the slave +shear - lambda n, on its masters by their
   weights the opposite, so that the sum is 0. gap: the current one, (g - n u_slave + n u_master). */
static PetscErrorCode FillContacts(HycoFE fe, HycoPairs *pairs, const PetscReal u[], const PetscReal lambda[],
                                   HycoContactFields *f)
{
  PetscFunctionBegin;
  for (PetscInt i = 0; i < fe->mesh->n_nodes; i++) f->gap_node[i] = f->which[i] = NAN;
  PetscCall(HycoContactGeometry(fe, pairs, f->normal, f->gap));
  PetscCall(HycoContactAreas(fe, pairs, f->normal, f->area));
  for (PetscInt k = 0; k < pairs->n; k++) {
    const PetscInt s = HycoPairsSlave(pairs, k), *master;
    const PetscReal *weight;
    PetscInt masters;

    HycoPairsMasters(pairs, k, &masters, &master, &weight);
    f->slave_id[k] = fe->mesh->node_id[s];
    for (PetscInt c = 0; c < fe->dim && !HycoPairsAlone(fe->scene, pairs, k); c++) {
      const PetscReal n = f->normal[3 * k + c], shear = pairs->shear ? pairs->shear->force[3 * k + c] : 0;

      f->force[3 * s + c] += shear - lambda[k] * n;
      f->gap[k] -= n * u[s * fe->dim + c];
      for (PetscInt j = 0; j < masters; j++) {
        f->force[3 * master[j] + c] -= weight[j] * (shear - lambda[k] * n);
        f->gap[k] += weight[j] * n * u[master[j] * fe->dim + c];
      }
    }
    if (HycoPairsAlone(fe->scene, pairs, k)) f->gap[k] = NAN;
    if (!islessequal(f->gap_node[s], f->gap[k])) /* for a node in several contacts the smallest */
      f->gap_node[s] = f->gap[k];
    /* Not a number compares false, and is replaced. */
    if (!islessequal(f->which[s], pairs->contact[k])) f->which[s] = pairs->contact[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What friction adds at the slaves of this process's contacts; for a node in several contacts sums, and the state that
   is nearest to slip. */
static PetscErrorCode FillFriction(HycoFE fe, const HycoPairs *pairs, HycoContactFields *f)
{
  const HycoShear *shear = pairs->shear;
  const PetscInt n = fe->mesh->n_nodes;

  PetscFunctionBegin;
  PetscCall(PetscCalloc3(3 * n, &f->traction, 3 * n, &f->slip, n, &f->state));
  for (PetscInt k = 0; k < pairs->n; k++) {
    const PetscInt s = HycoPairsSlave(pairs, k);

    f->state[s] = PetscMax(f->state[s], shear->state[k]);
    for (PetscInt c = 0; c < 3; c++) {
      f->slip[3 * s + c] += shear->slip[3 * k + c];
      /* A slave of no area, such as a corner of a six-node face, has a force but no traction. */
      if (f->area[k] > 0) f->traction[3 * s + c] += shear->force[3 * k + c] / f->area[k];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On the surfaces that this rank has; pairs, lambda: its contacts. Collective, since areas of nodes are summed
   over the ranks. */
PetscErrorCode HycoContactFieldsCreate(MPI_Comm comm, HycoFE surface, HycoPairs *pairs, const PetscReal u[],
                                       const PetscReal lambda[], HycoContactFields *f)
{
  const PetscInt n = surface->mesh->n_nodes;

  PetscFunctionBegin;
  f->has_friction = (PetscBool)(pairs->shear != NULL);
  f->traction = f->slip = f->state = NULL;
  /* Zero at nodes without contact; gap and contact's number are then set to not a number. */
  PetscCall(PetscCalloc4(3 * n, &f->force, n, &f->pressure, n, &f->gap_node, n, &f->which));
  PetscCall(PetscCalloc4(pairs->n, &f->gap, 3 * pairs->n, &f->normal, pairs->n, &f->area, pairs->n, &f->slave_id));
  PetscCall(PetscMalloc1(pairs->n, &f->pressure_of));
  HycoOnEach(comm, FillContacts(surface, pairs, u, lambda, f));
  /* Areas and pressures of shared slaves need the facets of other ranks as well. */
  PetscCall(HycoContactPressures(comm, surface, pairs, f->area, lambda, f->pressure_of));
  for (PetscInt k = 0; k < pairs->n; k++) { /* for a node in several contacts the largest */
    const PetscInt s = HycoPairsSlave(pairs, k);

    f->pressure[s] = PetscMax(f->pressure[s], f->pressure_of[k]);
  }
  if (pairs->shear) PetscCall(FillFriction(surface, pairs, f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Combines values, `width` at each node of a surface, over the ranks, from `start` on, at the nodes of each rank's
   part: one component at a time, as PETSc's star forests add up no vectors. to_owner: from the surface's nodes to
   the owners of the part's; to_part: from there to all copies in parts. */
static PetscErrorCode FieldsCombine(PetscSF to_owner, PetscSF to_part, HycoMesh part, PetscInt n, PetscInt width,
                                    MPI_Op op, PetscReal start, const PetscReal value[], PetscReal at_part[])
{
  PetscReal *owned, *one, *mine;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(part->n_owned, &owned, n, &one, part->n_nodes, &mine));
  for (PetscInt c = 0; c < width; c++) {
    for (PetscInt i = 0; i < n; i++) one[i] = value[i * width + c];
    /* The neutral element of op, for nodes that no surface has. */
    for (PetscInt i = 0; i < part->n_owned; i++) owned[i] = start;
    PetscCall(PetscSFReduceBegin(to_owner, MPIU_REAL, one, owned, op));
    PetscCall(PetscSFReduceEnd(to_owner, MPIU_REAL, one, owned, op));
    PetscCall(HycoSFBcast(to_part, MPIU_REAL, 1, owned, mine));
    for (PetscInt i = 0; i < part->n_nodes; i++) at_part[i * width + c] = mine[i];
  }
  PetscCall(PetscFree3(owned, one, mine));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The smallest values, not a number where there is none: it cannot be compared. MPI_MIN of a number and not a
   number is undefined, hence the replacement by the largest number. */
static PetscErrorCode CombineLeast(PetscSF to_owner, PetscSF to_part, HycoMesh part, PetscInt n, PetscReal value[],
                                   PetscReal at_part[])
{
  PetscFunctionBegin;
  for (PetscInt i = 0; i < n; i++) {
    /* In place: the caller's array is replaced by the part's right afterwards. */
    if (!(PetscAbsReal(value[i]) < PETSC_MAX_REAL)) value[i] = PETSC_MAX_REAL;
  }
  PetscCall(FieldsCombine(to_owner, to_part, part, n, 1, MPI_MIN, PETSC_MAX_REAL, value, at_part));
  for (PetscInt i = 0; i < part->n_nodes; i++) {
    if (at_part[i] >= PETSC_MAX_REAL) at_part[i] = NAN;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same for what friction adds. Replaces the fields of f, which are at the surface's nodes before and at the
   part's after. */
static PetscErrorCode FrictionToPart(PetscSF to_owner, PetscSF to_part, HycoMesh part, PetscInt n, HycoContactFields *f)
{
  PetscReal *traction, *slip, *state;

  PetscFunctionBegin;
  PetscCall(PetscMalloc3(3 * part->n_nodes, &traction, 3 * part->n_nodes, &slip, part->n_nodes, &state));
  PetscCall(FieldsCombine(to_owner, to_part, part, n, 3, MPI_SUM, 0, f->traction, traction));
  PetscCall(FieldsCombine(to_owner, to_part, part, n, 3, MPI_SUM, 0, f->slip, slip));
  PetscCall(FieldsCombine(to_owner, to_part, part, n, 1, MPI_MAX, 0, f->state, state));
  PetscCall(PetscFree3(f->traction, f->slip, f->state));
  f->traction = traction;
  f->slip = slip;
  f->state = state;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From the nodes of each rank's surface to those of its part: a node may be in contacts of several ranks. */
static PetscErrorCode ToPart(MPI_Comm comm, HycoMesh part, HycoMesh surface, HycoContactFields *f)
{
  PetscReal *force, *pressure, *gap, *which;
  PetscSF to_owner, to_part;

  PetscFunctionBegin;
  PetscCall(
      PetscMalloc4(3 * part->n_nodes, &force, part->n_nodes, &pressure, part->n_nodes, &gap, part->n_nodes, &which));
  PetscCall(HycoMeshNodeSF(comm, part, surface->n_nodes, surface->node_global, &to_owner));
  PetscCall(HycoMeshNodeSF(comm, part, part->n_nodes, part->node_global, &to_part));
  /* Forces add up: each contact's is counted on one rank only. Pressures and gaps do not: largest and smallest. */
  PetscCall(FieldsCombine(to_owner, to_part, part, surface->n_nodes, 3, MPI_SUM, 0, f->force, force));
  PetscCall(FieldsCombine(to_owner, to_part, part, surface->n_nodes, 1, MPI_MAX, 0, f->pressure, pressure));
  PetscCall(CombineLeast(to_owner, to_part, part, surface->n_nodes, f->gap_node, gap));
  PetscCall(CombineLeast(to_owner, to_part, part, surface->n_nodes, f->which, which));
  if (f->has_friction) PetscCall(FrictionToPart(to_owner, to_part, part, surface->n_nodes, f));
  HycoDestroyAll(&to_owner, &to_part);
  PetscCall(PetscFree4(f->force, f->pressure, f->gap_node, f->which));
  f->force = force;
  f->pressure = pressure;
  f->gap_node = gap;
  f->which = which;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On one rank surface and part have the same nodes: only corners are left to fill. */
PetscErrorCode HycoContactFieldsToPart(MPI_Comm comm, HycoFE fe, HycoMesh surface, HycoContactFields *f)
{
  PetscReal *sum;

  PetscFunctionBegin;
  if (fe->mesh->node_global) PetscCall(ToPart(comm, fe->mesh, surface, f));
  if (fe->mesh->type != HYCO_TET10) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(2 * fe->mesh->n_nodes, &sum));
  PetscCall(FillCorners(fe, sum, f->pressure));
  PetscCall(PetscFree(sum));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The grouping is that of the allocations: PetscFreeN() must get the pointers of one PetscMallocN(). */
PetscErrorCode HycoContactFieldsDestroy(HycoContactFields *f)
{
  PetscFunctionBegin;
  PetscCall(PetscFree4(f->force, f->pressure, f->gap_node, f->which));
  PetscCall(PetscFree3(f->traction, f->slip, f->state));
  PetscCall(PetscFree4(f->gap, f->normal, f->area, f->slave_id));
  PetscCall(PetscFree(f->pressure_of));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* By volume, of the cells of one body: at an interface the stress jumps, and the body of least number counts.
   sigma: n_cells x ns. */
PetscErrorCode HycoNodalStress(HycoFE fe, const PetscReal sigma[], PetscReal tensor[], PetscReal mises[])
{
  HycoMesh m = fe->mesh;
  const PetscInt ns = fe->n_sigma;
  PetscReal *volume, *weight, *mean, *principal;
  PetscInt *body;

  PetscFunctionBegin;
  PetscCall(PetscMalloc2(m->n_cells, &volume, m->n_nodes, &body));
  PetscCall(PetscCalloc3(m->n_nodes, &weight, m->n_nodes * ns, &mean, 3 * m->n_nodes, &principal));
  PetscCall(HycoFEVolumes(fe, volume));
  for (PetscInt i = 0; i < m->n_nodes; i++) body[i] = PETSC_MAX_INT;
  for (PetscInt k = 0; k < m->n_cells * m->nv; k++)
    body[m->cells[k]] = PetscMin(body[m->cells[k]], m->cell_body[k / m->nv]);
  for (PetscInt k = 0; k < m->n_cells * m->nv; k++) {
    const PetscInt i = m->cells[k], e = k / m->nv;

    if (m->cell_body[e] != body[i] || (k % m->nv && i == m->cells[k - 1])) continue; /* or a repeated node */
    weight[i] += volume[e];
    for (PetscInt c = 0; c < ns; c++) mean[i * ns + c] += volume[e] * sigma[e * ns + c];
  }
  for (PetscInt k = 0; k < m->n_nodes * ns; k++) mean[k] = weight[k / ns] > 0 ? mean[k] / weight[k / ns] : 0;
  HycoTensor6(m->n_nodes, ns, mean, tensor);
  /* Of the mean tensor: a mean of invariants would not be that of any stress. */
  PetscCall(HycoStressInvariants(m->n_nodes, fe->dim, mean, mises, principal));
  PetscCall(PetscFree2(volume, body));
  PetscCall(PetscFree3(weight, mean, principal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the fields of the bodies. */
static PetscErrorCode AddBodies(HycoFieldFile file, HycoFE fe, const PetscReal u[])
{
  HycoMesh m = fe->mesh;
  PetscReal *u3, *sigma, *tensor, *mises, *principal, *body, *nodal, *nodal_mises;
  PetscErrorCode ierr = 0; /* if the path cannot be written, the caller handles the error and no file is left */

  PetscFunctionBegin;
  PetscCall(PetscCalloc5(m->n_cells * fe->n_sigma, &sigma, 6 * m->n_cells, &tensor, m->n_cells, &mises, 3 * m->n_cells,
                         &principal, m->n_cells, &body));
  PetscCall(PetscCalloc3(3 * m->n_nodes, &u3, 6 * m->n_nodes, &nodal, m->n_nodes, &nodal_mises));
  for (PetscInt k = 0; k < fe->n_dof; k++) u3[3 * (k / fe->dim) + k % fe->dim] = u[k];
  PetscCall(HycoFEStress(fe, u, sigma));
  HycoTensor6(m->n_cells, fe->n_sigma, sigma, tensor);
  PetscCall(HycoStressInvariants(m->n_cells, fe->dim, sigma, mises, principal));
  PetscCall(HycoNodalStress(fe, sigma, nodal, nodal_mises));
  for (PetscInt e = 0; e < m->n_cells; e++) body[e] = m->cell_body[e];
  /* In 2D the third component is 0: viewers expect vectors of three. */
  const HycoField field[] = {{"displacement", HYCO_ON_NODES, 3, u3},
                             {"stress", HYCO_ON_CELLS, 6, tensor},
                             {"mises", HYCO_ON_CELLS, 1, mises},
                             {"principal_stress", HYCO_ON_CELLS, 3, principal},
                             {"body", HYCO_ON_CELLS, 1, body},
                             {"nodal_stress", HYCO_ON_NODES, 6, nodal},
                             {"nodal_mises", HYCO_ON_NODES, 1, nodal_mises}};

  for (size_t k = 0; !ierr && k < sizeof(field) / sizeof(field[0]); k++) ierr = HycoFieldFileAdd(file, &field[k]);
  PetscCall(PetscFree5(sigma, tensor, mises, principal, body));
  PetscCall(PetscFree3(u3, nodal, nodal_mises));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each rank has its contacts in any order; pairs->number gives their place in the file. */
PetscErrorCode HycoContactsWrite(MPI_Comm comm, HycoH5 h, const char name[], const HycoPairs *pairs, PetscInt n,
                                 MPI_Datatype type, const void *value)
{
  const size_t size = type == MPIU_INT ? sizeof(PetscInt) : sizeof(PetscReal);
  PetscLayout rows;
  PetscSF sf;
  char *row;

  PetscFunctionBegin;
  /* An empty dataset is created without rows. */
  if (!pairs->number || !n) { /* one process has all */
    HycoOnRoot(comm, type == MPIU_INT ? HycoH5WriteInt(h, name, n, 1, value) : HycoH5WriteReal(h, name, n, 1, value));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscLayoutCreateFromSizes(comm, PETSC_DECIDE, n, 1, &rows));
  PetscCall(PetscSFCreate(comm, &sf));
  PetscCall(PetscSFSetGraphLayout(sf, rows, pairs->n, NULL, PETSC_OWN_POINTER, pairs->number));
  PetscCall(PetscCalloc1((size_t)(rows->rend - rows->rstart) * size, &row));
  PetscCall(HycoSFSend(sf, type, 1, value, row));
  PetscCall(PetscSFDestroy(&sf));
  HycoFinally(HycoH5WriteRows(h, name, type, n, 1, rows->rstart, rows->rend - rows->rstart, row),
              PetscCall(PetscFree(row));
              PetscCall(PetscLayoutDestroy(&rows)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The table of the contacts by slave node, in their order. Collective. */
static PetscErrorCode WriteContacts(HycoFieldFile file, const HycoSolution *s, const HycoContactFields *f)
{
  const char *const name[3] = {"contact/node_id", "contact/lambda", "contact/gap"};
  const void *const value[3] = {f->slave_id, s->lambda, f->gap};
  PetscInt n = s->pairs->n;

  PetscFunctionBegin;
  HycoAllreduce(&n, 1, MPIU_INT, MPI_SUM, file->comm);
  for (PetscInt k = 0; k < 3 && n; k++)
    PetscCall(HycoContactsWrite(file->comm, file->h, name[k], s->pairs, n, k ? MPIU_REAL : MPIU_INT, value[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* f: at the part's nodes. */
static PetscErrorCode AddContactFields(HycoFieldFile file, const HycoSolution *s, const HycoContactFields *f)
{
  const HycoField field[4] = {{"contact_force", HYCO_ON_NODES, 3, f->force},
                              {"contact_pressure", HYCO_ON_NODES, 1, f->pressure},
                              {"gap", HYCO_ON_NODES, 1, f->gap_node},
                              {"contact", HYCO_ON_NODES, 1, f->which}};

  PetscFunctionBegin;
  /* VTKHDF has no place for a table, and a series would need one for each time. */
  if (!file->vtk && !file->most) PetscCall(WriteContacts(file, s, f));
  for (PetscInt k = 0; k < 4; k++) PetscCall(HycoFieldFileAdd(file, &field[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fields of contacts live on surfaces, and are moved to the part's nodes before they are written. */
static PetscErrorCode AddContacts(HycoFieldFile file, const HycoSolution *s)
{
  HycoContactFields f;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  ierr = HycoContactFieldsCreate(file->comm, s->surface, s->pairs, s->u_surface, s->lambda, &f);
  /* The fields are destroyed after an error as well: each step frees nothing by itself. */
  if (!ierr) ierr = HycoContactFieldsToPart(file->comm, s->fe, s->surface->mesh, &f);
  if (!ierr) ierr = AddContactFields(file, s, &f);
  PetscCall(HycoContactFieldsDestroy(&f));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The field rid exists for models alone; all others are the same for full order and models, so that files of both
   can be subtracted. */
static PetscErrorCode AddFields(HycoFieldFile file, const HycoSolution *s)
{
  const HycoField rid = {"rid", HYCO_ON_CELLS, 1, s->rid};

  PetscFunctionBegin;
  PetscCall(AddBodies(file, s->fe, s->u));
  PetscCall(AddContacts(file, s));
  if (s->rid) PetscCall(HycoFieldFileAdd(file, &rid));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode FieldsWrite(HycoFieldFile file, const HycoSolution *s)
{
  PetscFunctionBegin;
  PetscCall(HycoFieldFileOpen(file, s->order, s->fe->mesh, s->fe->scene, s->fe->X, s->fe->mu));
  PetscCall(AddFields(file, s));
  PetscCall(HycoFieldFileCommit(file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The file is destroyed also after an error, which removes what was written so far: complete or absent. */
PetscErrorCode HycoSolutionWrite(const char path[], const HycoSolution *s)
{
  HycoFieldFile file;

  PetscFunctionBegin;
  PetscCall(HycoFieldFileCreate(s->order ? s->order->comm : PETSC_COMM_SELF, path, 0, PETSC_FALSE, &file));
  HycoFinally(FieldsWrite(file, s), PetscCall(HycoFieldFileDestroy(&file)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first one opens the file, with the mesh, which all share. */
PetscErrorCode HycoSolutionAdd(HycoFieldFile file, const HycoSolution *s)
{
  PetscFunctionBegin;
  if (!file->h) PetscCall(HycoFieldFileOpen(file, s->order, s->fe->mesh, s->fe->scene, s->fe->X, s->fe->mu));
  PetscCall(HycoFieldFileBeginPoint(file, s->fe->X, s->fe->mu));
  PetscCall(AddFields(file, s));
  PetscCall(HycoFieldFileEndTime(file));
  PetscFunctionReturn(PETSC_SUCCESS);
}
