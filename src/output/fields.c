/* HDF5 for the numbers, XDMF for ParaView. */
#include <hycofields.h>
#include <hycofile.h>
#include <hycoh5.h>
#include <hycomaterialimpl.h>
#include <petscblaslapack.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

static const char *const topology[HYCO_N_CELL_TYPES] = {"Polyline",        "Triangle",       "Quadrilateral",
                                                        "Tetrahedron",     "Hexahedron",     "Triangle_6",
                                                        "Quadrilateral_8", "Quadrilateral_9"};

const char *HycoFieldsTopology(HycoCellType type)
{
  return topology[type];
}

/* All of a mesh's nodes or cells. */
static PetscInt Count(const HycoFileOrder *order, HycoMesh m, HycoPlace place)
{
  return order ? order->all[place] : place == HYCO_ON_CELLS ? m->n_cells : m->n_nodes;
}

/* missing: what rows get that no process has a value of. */
static PetscErrorCode WriteRows(HycoH5 h, const HycoFileOrder *order, PetscInt n, const char name[], HycoPlace place,
                                MPI_Datatype type, PetscInt components, PetscInt cols, const void *value,
                                PetscReal missing)
{
  const PetscInt all = order ? order->all[place] : n, own = order ? order->n[place] : n,
                 first = order ? order->first[place] : 0, lines = components / cols;
  const size_t size = type == MPIU_INT ? sizeof(PetscInt) : sizeof(PetscReal);
  char *rows = NULL;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  if (order) {
    PetscCall(PetscCalloc1((size_t)(own * components) * size, &rows));
    for (PetscInt k = 0; missing != 0 && k < own * components; k++) ((PetscReal *)(void *)rows)[k] = missing;
    PetscCall(HycoFileOrderSend(order, place, type, components, value, rows));
    value = rows;
  }
  ierr = HycoH5WriteRows(h, name, type, all * lines, cols, first * lines, own * lines, value);
  PetscCall(PetscFree(rows));
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
                                   const PetscReal X[])
{
  PetscInt *cells = m->cells;
  char name[4][HYCO_LINE];
  static const char *const of[4] = {"xyz", "cells", "node_id", "cell_id"};

  PetscFunctionBegin;
  for (int k = 0; k < 4; k++) PetscCall(PetscSNPrintf(name[k], HYCO_LINE, "%s/%s", folder, of[k]));
  PetscCall(HycoFieldWrite(h, order, m->n_nodes, name[0], HYCO_ON_NODES, MPIU_REAL, 3, 3, X));
  if (order) {
    PetscCall(PetscMalloc1(m->n_cells * m->nv, &cells));
    for (PetscInt k = 0; k < m->n_cells * m->nv; k++) cells[k] = m->node_whole[m->cells[k]];
  }
  PetscCall(HycoFieldWrite(h, order, m->n_cells, name[1], HYCO_ON_CELLS, MPIU_INT, m->nv, m->nv, cells));
  if (order) PetscCall(PetscFree(cells));
  PetscCall(HycoFieldWrite(h, order, m->n_nodes, name[2], HYCO_ON_NODES, MPIU_INT, 1, 1, m->node_id));
  PetscCall(HycoFieldWrite(h, order, m->n_cells, name[3], HYCO_ON_CELLS, MPIU_INT, 1, 1, m->cell_id));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFieldsWriteHead(HycoH5 h, HycoMesh m, HycoScene scene, const PetscReal mu[],
                                   const HycoContactTable *contact)
{
  const PetscInt head[2] = {(PetscInt)m->type, m->dim};

  PetscFunctionBegin;
  PetscCall(HycoH5WriteText(h, "title", scene->title));
  PetscCall(HycoH5WriteInt(h, "mesh/head", 2, 1, head)); /* cell type (line2, tri3, quad4, tet4, hex8), dimension */
  for (PetscInt p = 0; p < scene->n_parameters; p++) {
    char name[HYCO_LINE];

    PetscCall(PetscSNPrintf(name, sizeof(name), "mu/%s", scene->parameter[p]));
    PetscCall(HycoH5WriteReal(h, name, 1, 1, &mu[p]));
  }
  if (contact && contact->n) {
    PetscCall(HycoH5WriteInt(h, "contact/node_id", contact->n, 1, contact->node_id));
    PetscCall(HycoH5WriteReal(h, "contact/lambda", contact->n, 1, contact->lambda));
    PetscCall(HycoH5WriteReal(h, "contact/gap", contact->n, 1, contact->gap));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const char *FieldFolder(const HycoField *field)
{
  return field->place == HYCO_ON_CELLS ? "cells" : "nodes";
}

static PetscErrorCode WriteNumbers(MPI_Comm comm, HycoH5 h, const HycoFileOrder *order, HycoMesh m, const PetscReal X[],
                                   HycoScene scene, const PetscReal mu[], PetscInt n, const HycoField field[],
                                   const HycoContactTable *contact)
{
  PetscFunctionBegin;
  HycoOnRoot(comm, HycoFieldsWriteHead(h, m, scene, mu, contact));
  PetscCall(HycoFieldsWriteMesh(h, "mesh", order, m, X));
  for (PetscInt k = 0; k < n; k++) {
    char name[HYCO_LINE];

    PetscCall(PetscSNPrintf(name, sizeof(name), "%s/%s", FieldFolder(&field[k]), field[k].name));
    PetscCall(HycoFieldWriteData(h, order, Count(NULL, m, field[k].place), name, &field[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The file of numbers. */
static PetscErrorCode WriteH5(MPI_Comm comm, const char path[], const HycoFileOrder *order, HycoMesh m,
                              const PetscReal X[], HycoScene scene, const PetscReal mu[], PetscInt n,
                              const HycoField field[], const HycoContactTable *contact)
{
  HycoH5 h;
  PetscErrorCode ierr, failed;

  PetscFunctionBegin;
  PetscCall(HycoH5CreateShared(comm, path, &h));
  ierr = WriteNumbers(comm, h, order, m, X, scene, mu, n, field, contact);
  failed = HycoH5Close(&h, (PetscBool)!ierr);
  PetscCall(ierr ? ierr : failed);
  PetscFunctionReturn(PETSC_SUCCESS);
}

void HycoFieldsEscape(const char name[], char out[6 * PETSC_MAX_PATH_LEN])
{
  static const char special[] = "&<>\"'";
  static const char *const entity[] = {"&amp;", "&lt;", "&gt;", "&quot;", "&apos;"};

  for (; *name; name++) {
    const char *at = strchr(special, *name);

    if (at)
      out += sprintf(out, "%s", entity[at - special]);
    else
      *out++ = *name;
  }
  *out = '\0';
}

static void WriteXDMF(FILE *out, const char file[], const HycoFileOrder *order, HycoMesh m, PetscInt n,
                      const HycoField field[])
{
  const long n_nodes = (long)Count(order, m, HYCO_ON_NODES), n_cells = (long)Count(order, m, HYCO_ON_CELLS);
  char h5[6 * PETSC_MAX_PATH_LEN];

  HycoFieldsEscape(file, h5);
  fprintf(out, "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\">\n <Domain>\n  <Grid Name=\"mesh\">\n");
  fprintf(out, "   <Topology TopologyType=\"%s\" NumberOfElements=\"%ld\"%s>\n", topology[m->type], n_cells,
          m->type == HYCO_LINE2 ? " NodesPerElement=\"2\"" : "");
  fprintf(out,
          "    <DataItem Format=\"HDF\" NumberType=\"Int\" Precision=\"%d\" Dimensions=\"%ld "
          "%ld\">%s:/mesh/cells</DataItem>\n   </Topology>\n",
          (int)sizeof(PetscInt), n_cells, (long)m->nv, h5);
  fprintf(out,
          "   <Geometry GeometryType=\"XYZ\">\n    <DataItem Format=\"HDF\" Precision=\"8\" Dimensions=\"%ld "
          "3\">%s:/mesh/xyz</DataItem>\n   </Geometry>\n",
          n_nodes, h5);
  for (PetscInt k = 0; k < n; k++) {
    const char *kind = field[k].components == 1 ? "Scalar" : field[k].components == 3 ? "Vector" : "Tensor6";

    fprintf(out, "   <Attribute Name=\"%s\" AttributeType=\"%s\" Center=\"%s\">\n", field[k].name, kind,
            field[k].place == HYCO_ON_CELLS ? "Cell" : "Node");
    fprintf(
        out,
        "    <DataItem Format=\"HDF\" Precision=\"8\" Dimensions=\"%ld %ld\">%s:/%s/%s</DataItem>\n   </Attribute>\n",
        field[k].place == HYCO_ON_CELLS ? n_cells : n_nodes, (long)field[k].components, h5, FieldFolder(&field[k]),
        field[k].name);
  }
  fprintf(out, "  </Grid>\n </Domain>\n</Xdmf>\n");
}

/* The numbers must not take the place of a model or a snapshot, or of what is no file. */
static PetscErrorCode CheckPlace(const char h5[], const char path[])
{
  struct stat info;
  PetscBool precious;

  PetscFunctionBegin;
  if (stat(h5, &info) != 0) PetscFunctionReturn(PETSC_SUCCESS);
  HycoCheck(S_ISREG(info.st_mode),
            "%s is no file (a folder, a device, a pipe), and the numbers of %s would go there; give the output another "
            "name",
            h5, path);
  PetscCall(HycoH5IsPrecious(h5, &precious));
  HycoCheck(!precious,
            "%s is a model or a snapshot, and the numbers of %s would go there; give the output another name", h5,
            path);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoFieldsCheckPath(const char path[])
{
  const size_t n = strlen(path);
  char h5[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  HycoCheck(n > 5 && n < PETSC_MAX_PATH_LEN - 16 && strcmp(path + n - 5, ".xdmf") == 0,
            "the output is named %s; give a name that ends in .xdmf (the numbers go to the .h5 beside it)", path);
  snprintf(h5, sizeof(h5), "%.*s.h5", (int)n - 5, path);
  PetscCall(CheckPlace(h5, path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The text, which has its place when the numbers have theirs. On one process. */
static PetscErrorCode BeginText(const char path[], const char h5[], const HycoFileOrder *order, HycoMesh m, PetscInt n,
                                const HycoField field[], HycoFile *out)
{
  const char *slash = strrchr(h5, '/');

  PetscFunctionBegin;
  PetscCall(HycoFieldsCheckPath(path));
  PetscCall(HycoFileCreate(path, HYCO_FILE_TEXT, out));
  WriteXDMF(HycoFileStream(*out), slash ? slash + 1 : h5, order, m, n, field);
  PetscCall(HycoFileFlush(*out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode BeginTextOnRoot(MPI_Comm comm, const char path[], const char h5[], const HycoFileOrder *order,
                                      HycoMesh m, PetscInt n, const HycoField field[], HycoFile *out)
{
  PetscFunctionBegin;
  HycoOnRoot(comm, BeginText(path, h5, order, m, n, field, out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode EndText(MPI_Comm comm, HycoFile *out)
{
  PetscFunctionBegin;
  HycoOnRoot(comm, HycoFileClose(out, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes `path` and the .h5 beside it, both through temporary names. X: moved nodes (n_nodes x 3). The .h5 also holds
   node_id, cell_id, the parameters and the contact table (rank 0's). */
static PetscErrorCode Write(const char path[], const HycoFileOrder *order, HycoMesh m, const PetscReal X[],
                            HycoScene scene, const PetscReal mu[], PetscInt n, const HycoField field[],
                            const HycoContactTable *contact)
{
  const MPI_Comm comm = order ? order->comm : PETSC_COMM_SELF;
  char h5[PETSC_MAX_PATH_LEN];
  HycoFile out = NULL;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  snprintf(h5, sizeof(h5), "%.*s.h5", (int)strlen(path) - 5, path);
  ierr = BeginTextOnRoot(comm, path, h5, order, m, n, field, &out);
  /* the numbers first: without them the .xdmf would point at none, or at those of another run */
  if (!ierr) ierr = WriteH5(comm, h5, order, m, X, scene, mu, n, field, contact);
  if (!ierr) {
    ierr = EndText(comm, &out);
    if (ierr) (void)remove(h5);
  } else if (out)
    PetscCall(HycoFileClose(&out, PETSC_FALSE));
  PetscCall(ierr);
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

    ierr = Write(path, order, m, fe->X, fe->scene, fe->mu, rid ? 9 : 8, field, &table);
  }
  PetscCall(PetscFree6(u3, sigma, tensor, mises, principal, body));
  PetscCall(HycoContactFieldsDestroy(&f));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
