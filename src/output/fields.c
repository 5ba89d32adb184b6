/* The fields of a solution, and their conversion to rows of a file. */
#include <hycofields.h>
#include <hycoh5.h>
#include <hycomaterialimpl.h>
#include <petscblaslapack.h>

PetscErrorCode HycoFieldRows(const HycoFileOrder *order, PetscInt n, HycoPlace place, MPI_Datatype type,
                             PetscInt components, const void *value, PetscReal missing, void **rows)
{
  const PetscInt count = (order ? order->n[place] : n) * components;
  const size_t size = type == MPIU_INT ? sizeof(PetscInt) : sizeof(PetscReal);
  PetscReal *reals;

  PetscFunctionBegin;
  *rows = (void *)value;
  if (!order) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscCalloc1((size_t)count * size, (char **)rows));
  reals = (PetscReal *)*rows;
  for (PetscInt k = 0; missing != 0 && k < count; k++) reals[k] = missing;
  PetscCall(HycoFileOrderSend(order, place, type, components, value, *rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* missing: value of rows for which no process has a value. */
static PetscErrorCode WriteRows(HycoH5 h, const HycoFileOrder *order, PetscInt n, const char name[], HycoPlace place,
                                MPI_Datatype type, PetscInt components, PetscInt cols, const void *value,
                                PetscReal missing)
{
  const PetscInt all = order ? order->all[place] : n, own = order ? order->n[place] : n,
                 first = order ? order->first[place] : 0, lines = components / PetscAbsInt(cols);
  void *rows = NULL;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoFieldRows(order, n, place, type, components, value, missing, &rows));
  ierr = HycoH5WriteRows(h, name, type, all * lines, cols, first * lines, own * lines, rows);
  if (order) PetscCall(PetscFree(rows));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFieldWrite(HycoH5 h, const HycoFileOrder *order, PetscInt n, const char name[], HycoPlace place,
                              MPI_Datatype type, PetscInt components, PetscInt cols, const void *value)
{
  PetscFunctionBegin;
  PetscCall(WriteRows(h, order, n, name, place, type, components, cols, value, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFieldWriteData(HycoH5 h, const HycoFileOrder *order, PetscInt n, const char name[],
                                  const HycoField *field)
{
  PetscFunctionBegin;
  PetscCall(WriteRows(h, order, n, name, field->place, MPIU_REAL, field->components, field->components, field->data,
                      field->missing));
  PetscFunctionReturn(PETSC_SUCCESS);
}

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

void HycoTensor6(PetscInt n_cells, PetscInt ns, const PetscReal sigma[], PetscReal tensor[])
{
  static const PetscInt place[6] = {0, 3, 5, 1, 4, 2};

  for (PetscInt e = 0; e < n_cells; e++) {
    for (PetscInt k = 0; k < 6; k++) tensor[6 * e + place[k]] = k < ns ? sigma[e * ns + k] : 0;
  }
}

PetscErrorCode HycoStressInvariants(PetscInt n_cells, PetscInt dim, const PetscReal sigma[], PetscReal mises[],
                                    PetscReal principal[])
{
  PetscBLASInt three = 3, lwork = 32, info;

  PetscFunctionBegin;
  for (PetscInt e = 0; e < n_cells; e++) {
    PetscReal s[6], value[3];
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

      if (m->facet_group[j / corners] != g) continue;
      sum[2 * node[v]] += pressure[node[corners + v]] + pressure[node[corners + (v + corners - 1) % corners]];
      sum[2 * node[v] + 1] += 2;
    }
    for (PetscInt i = 0; i < m->n_nodes; i++) {
      if (sum[2 * i + 1] > 0) pressure[i] = PetscMax(pressure[i], sum[2 * i] / sum[2 * i + 1]);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On the process that has the contacts. */
static PetscErrorCode FillContacts(HycoFE fe, HycoPairs *pairs, const PetscReal u[], const PetscReal lambda[],
                                   HycoContactFields *f)
{
  PetscFunctionBegin;
  for (PetscInt i = 0; i < fe->mesh->n_nodes; i++) f->gap_node[i] = NAN;
  PetscCall(HycoContactGeometry(fe, pairs, f->normal, f->gap));
  PetscCall(HycoContactAreas(fe, pairs, f->area));
  for (PetscInt k = 0; k < pairs->n; k++) {
    const PetscInt s = HycoPairsSlave(pairs, k), *master;
    const PetscReal *weight;
    PetscInt masters;

    HycoPairsMasters(pairs, k, &masters, &master, &weight);
    f->slave_id[k] = fe->mesh->node_id[s];
    for (PetscInt c = 0; c < fe->dim && !HycoPairsAlone(fe->scene, pairs, k); c++) {
      const PetscReal n = f->normal[3 * k + c];

      f->force[3 * s + c] -= lambda[k] * n;
      f->gap[k] -= n * u[s * fe->dim + c];
      for (PetscInt j = 0; j < masters; j++) {
        f->force[3 * master[j] + c] += weight[j] * lambda[k] * n;
        f->gap[k] += weight[j] * n * u[master[j] * fe->dim + c];
      }
    }
    /* for a node in several contacts the largest and the smallest */
    f->pressure[s] = PetscMax(f->pressure[s], HycoContactPressure(fe, pairs, k, f->area, lambda));
    if (HycoPairsAlone(fe->scene, pairs, k)) f->gap[k] = NAN;
    if (!(f->gap_node[s] <= f->gap[k])) f->gap_node[s] = f->gap[k];
  }
  if (fe->mesh->type == HYCO_TET10) {
    PetscReal *sum;

    PetscCall(PetscMalloc1(2 * fe->mesh->n_nodes, &sum));
    PetscCall(FillCorners(fe, sum, f->pressure));
    PetscCall(PetscFree(sum));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoContactFieldsCreate(MPI_Comm comm, HycoFE surface, HycoPairs *pairs, const PetscReal u[],
                                       const PetscReal lambda[], HycoContactFields *f)
{
  const PetscInt n = surface ? surface->mesh->n_nodes : 0;

  PetscFunctionBegin;
  PetscCall(PetscCalloc3(3 * n, &f->force, n, &f->pressure, n, &f->gap_node));
  PetscCall(PetscCalloc4(pairs->n, &f->gap, 3 * pairs->n, &f->normal, pairs->n, &f->area, pairs->n, &f->slave_id));
  HycoOnRoot(comm, FillContacts(surface, pairs, u, lambda, f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoContactFieldsDestroy(HycoContactFields *f)
{
  PetscFunctionBegin;
  PetscCall(PetscFree3(f->force, f->pressure, f->gap_node));
  PetscCall(PetscFree4(f->gap, f->normal, f->area, f->slave_id));
  PetscFunctionReturn(PETSC_SUCCESS);
}

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
  const HycoField field[] = {{"displacement", HYCO_ON_NODES, 3, u3, 0},
                             {"stress", HYCO_ON_CELLS, 6, tensor, 0},
                             {"mises", HYCO_ON_CELLS, 1, mises, 0},
                             {"principal_stress", HYCO_ON_CELLS, 3, principal, 0},
                             {"body", HYCO_ON_CELLS, 1, body, 0},
                             {"nodal_stress", HYCO_ON_NODES, 6, nodal, 0},
                             {"nodal_mises", HYCO_ON_NODES, 1, nodal_mises, 0}};

  for (size_t k = 0; !ierr && k < sizeof(field) / sizeof(field[0]); k++) ierr = HycoFieldFileAdd(file, &field[k]);
  PetscCall(PetscFree5(sigma, tensor, mises, principal, body));
  PetscCall(PetscFree3(u3, nodal, nodal_mises));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The table of the contacts by slave node. On one process. */
static PetscErrorCode WriteContacts(HycoH5 h, PetscInt n, const PetscInt node_id[], const PetscReal lambda[],
                                    const PetscReal gap[])
{
  PetscFunctionBegin;
  if (!n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoH5WriteInt(h, "contact/node_id", n, 1, node_id));
  PetscCall(HycoH5WriteReal(h, "contact/lambda", n, 1, lambda));
  PetscCall(HycoH5WriteReal(h, "contact/gap", n, 1, gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AddContactFields(HycoFieldFile file, const HycoSolution *s, const HycoContactFields *f)
{
  const HycoField field[3] = {{"contact_force", HYCO_ON_SURFACE, 3, f->force, 0},
                              {"contact_pressure", HYCO_ON_SURFACE, 1, f->pressure, 0},
                              {"gap", HYCO_ON_SURFACE, 1, f->gap_node, NAN}};

  PetscFunctionBegin;
  if (!file->vtk && !file->most)
    HycoOnRoot(file->comm, WriteContacts(file->h, s->pairs->n, f->slave_id, s->lambda, f->gap));
  for (PetscInt k = 0; k < 3; k++) PetscCall(HycoFieldFileAdd(file, &field[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AddContacts(HycoFieldFile file, const HycoSolution *s)
{
  HycoContactFields f;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  ierr = HycoContactFieldsCreate(file->comm, s->surface, s->pairs, s->u_surface, s->lambda, &f);
  if (!ierr) ierr = AddContactFields(file, s, &f);
  PetscCall(HycoContactFieldsDestroy(&f));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AddFields(HycoFieldFile file, const HycoSolution *s)
{
  const HycoField rid = {"rid", HYCO_ON_CELLS, 1, s->rid, 0};

  PetscFunctionBegin;
  PetscCall(AddBodies(file, s->fe, s->u));
  PetscCall(AddContacts(file, s));
  if (s->rid) PetscCall(HycoFieldFileAdd(file, &rid));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Write(HycoFieldFile file, const HycoSolution *s)
{
  PetscFunctionBegin;
  PetscCall(HycoFieldFileOpen(file, s->order, s->fe->mesh, s->fe->scene, s->fe->X, s->fe->mu));
  PetscCall(AddFields(file, s));
  PetscCall(HycoFieldFileCommit(file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolutionWrite(const char path[], const HycoSolution *s)
{
  HycoFieldFile file;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoFieldFileCreate(s->order ? s->order->comm : PETSC_COMM_SELF, path, 0, PETSC_FALSE, &file));
  ierr = Write(file, s);
  PetscCall(HycoFieldFileDestroy(&file));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolutionAdd(HycoFieldFile file, const HycoSolution *s)
{
  PetscFunctionBegin;
  if (!file->h) PetscCall(HycoFieldFileOpen(file, s->order, s->fe->mesh, s->fe->scene, s->fe->X, s->fe->mu));
  PetscCall(HycoFieldFileBeginPoint(file, s->fe->X, s->fe->mu));
  PetscCall(AddFields(file, s));
  PetscCall(HycoFieldFileEndTime(file));
  PetscFunctionReturn(PETSC_SUCCESS);
}
