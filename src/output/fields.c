/* What is written of a solution, and how rows of a mesh and its fields come into a file. */
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

/* missing: what rows get that no process has a value of. */
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

PetscErrorCode HycoFieldsWriteCells(HycoH5 h, const char name[], const HycoFileOrder *order, HycoMesh m, PetscInt cols)
{
  PetscInt *cells = m->cells;

  PetscFunctionBegin;
  if (order) {
    PetscCall(PetscMalloc1(m->n_cells * m->nv, &cells));
    for (PetscInt k = 0; k < m->n_cells * m->nv; k++) cells[k] = m->node_whole[m->cells[k]];
  }
  PetscCall(HycoFieldWrite(h, order, m->n_cells, name, HYCO_ON_CELLS, MPIU_INT, m->nv, cols, cells));
  if (order) PetscCall(PetscFree(cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFieldsWriteMesh(HycoH5 h, const char folder[], const HycoFileOrder *order, HycoMesh m,
                                   const PetscReal X[])
{
  char name[4][HYCO_LINE];
  static const char *const of[4] = {"xyz", "cells", "node_id", "cell_id"};

  PetscFunctionBegin;
  for (int k = 0; k < 4; k++) PetscCall(PetscSNPrintf(name[k], HYCO_LINE, "%s/%s", folder, of[k]));
  PetscCall(HycoFieldWrite(h, order, m->n_nodes, name[0], HYCO_ON_NODES, MPIU_REAL, 3, 3, X));
  PetscCall(HycoFieldsWriteCells(h, name[1], order, m, m->nv));
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

/* On the process of the contacts. */
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
    /* of a node in several contacts the largest and the smallest */
    if (f->area[k] > 0) f->pressure[s] = PetscMax(f->pressure[s], lambda[k] / f->area[k]);
    if (HycoPairsAlone(fe->scene, pairs, k)) f->gap[k] = NAN;
    if (!(f->gap_node[s] <= f->gap[k])) f->gap_node[s] = f->gap[k];
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

static PetscErrorCode WriteContacts(HycoH5 h, const HycoContactTable *contact)
{
  PetscFunctionBegin;
  if (!contact->n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HycoH5WriteInt(h, "contact/node_id", contact->n, 1, contact->node_id));
  PetscCall(HycoH5WriteReal(h, "contact/lambda", contact->n, 1, contact->lambda));
  PetscCall(HycoH5WriteReal(h, "contact/gap", contact->n, 1, contact->gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One solution; the contact table is rank 0's. */
static PetscErrorCode WriteAll(HycoFieldFile file, const HycoFileOrder *order, HycoFE fe, PetscInt n,
                               const HycoField field[], const HycoContactTable *contact)
{
  PetscFunctionBegin;
  PetscCall(HycoFieldFileOpen(file, order, fe->mesh, fe->scene, fe->X, fe->mu));
  if (!file->vtk) HycoOnRoot(file->comm, WriteContacts(file->h, contact));
  for (PetscInt k = 0; k < n; k++) PetscCall(HycoFieldFileAdd(file, &field[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Write(const char path[], const HycoFileOrder *order, HycoFE fe, PetscInt n,
                            const HycoField field[], const HycoContactTable *contact)
{
  HycoFieldFile file;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(HycoFieldFileCreate(order ? order->comm : PETSC_COMM_SELF, path, 0, &file));
  ierr = WriteAll(file, order, fe, n, field, contact);
  if (!ierr) ierr = HycoFieldFileCommit(file);
  PetscCall(HycoFieldFileDestroy(&file));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoSolutionWrite(const char path[], const HycoFileOrder *order, HycoFE fe, const PetscReal u[],
                                 HycoFE surface, HycoPairs *pairs, const PetscReal u_surface[],
                                 const PetscReal lambda[], const PetscReal *rid)
{
  HycoMesh m = fe->mesh;
  PetscReal *u3, *sigma, *tensor, *mises, *principal, *body;
  HycoContactFields f;
  PetscErrorCode ierr; /* a place where nothing can be written is the caller's to mend: nothing is kept for it */

  PetscFunctionBegin;
  PetscCall(PetscCalloc6(3 * m->n_nodes, &u3, m->n_cells * fe->n_sigma, &sigma, 6 * m->n_cells, &tensor, m->n_cells,
                         &mises, 3 * m->n_cells, &principal, m->n_cells, &body));
  for (PetscInt k = 0; k < fe->n_dof; k++) u3[3 * (k / fe->dim) + k % fe->dim] = u[k];
  PetscCall(HycoFEStress(fe, u, sigma));
  HycoTensor6(m->n_cells, fe->n_sigma, sigma, tensor);
  PetscCall(HycoStressInvariants(m->n_cells, fe->dim, sigma, mises, principal));
  for (PetscInt e = 0; e < m->n_cells; e++) body[e] = m->cell_body[e];
  ierr = HycoContactFieldsCreate(order ? order->comm : PETSC_COMM_SELF, surface, pairs, u_surface, lambda, &f);
  if (!ierr) {
    const HycoContactTable table = {pairs->n, f.slave_id, lambda, f.gap};
    const HycoField field[9] = {{"displacement", HYCO_ON_NODES, 3, u3, 0},
                                {"stress", HYCO_ON_CELLS, 6, tensor, 0},
                                {"mises", HYCO_ON_CELLS, 1, mises, 0},
                                {"principal_stress", HYCO_ON_CELLS, 3, principal, 0},
                                {"body", HYCO_ON_CELLS, 1, body, 0},
                                {"contact_force", HYCO_ON_SURFACE, 3, f.force, 0},
                                {"contact_pressure", HYCO_ON_SURFACE, 1, f.pressure, 0},
                                {"gap", HYCO_ON_SURFACE, 1, f.gap_node, NAN},
                                {"rid", HYCO_ON_CELLS, 1, rid, 0}};

    ierr = Write(path, order, fe, rid ? 9 : 8, field, &table);
  }
  PetscCall(PetscFree6(u3, sigma, tensor, mises, principal, body));
  PetscCall(HycoContactFieldsDestroy(&f));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
