/* HDF5 for the numbers, XDMF for ParaView. */
#include <hycofields.h>
#include <hycofile.h>
#include <hycoh5.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

static const char *const topology[HYCO_N_CELL_TYPES] = {"Polyline", "Triangle", "Quadrilateral", "Tetrahedron",
                                                        "Hexahedron"};

const char *HycoFieldsTopology(HycoCellType type)
{
  return topology[type];
}

static PetscErrorCode WriteNumbers(HycoH5 h, HycoMesh m, const PetscReal X[], HycoScene scene, const PetscReal mu[],
                                   PetscInt n, const HycoField field[], const HycoContactTable *contact)
{
  const PetscInt head[2] = {(PetscInt)m->type, m->dim};

  PetscFunctionBegin;
  PetscCall(HycoH5WriteText(h, "title", scene->title));
  PetscCall(HycoH5WriteInt(h, "mesh/head", 2, 1, head)); /* cell type (line2, tri3, quad4, tet4, hex8), dimension */
  PetscCall(HycoH5WriteReal(h, "mesh/xyz", m->n_nodes, 3, X));
  PetscCall(HycoH5WriteInt(h, "mesh/cells", m->n_cells, m->nv, m->cells));
  PetscCall(HycoH5WriteInt(h, "mesh/node_id", m->n_nodes, 1, m->node_id));
  PetscCall(HycoH5WriteInt(h, "mesh/cell_id", m->n_cells, 1, m->cell_id));
  for (PetscInt p = 0; p < scene->n_parameters; p++) {
    char name[HYCO_LINE];

    PetscCall(PetscSNPrintf(name, sizeof(name), "mu/%s", scene->parameter[p]));
    PetscCall(HycoH5WriteReal(h, name, 1, 1, &mu[p]));
  }
  for (PetscInt k = 0; k < n; k++) {
    char name[HYCO_LINE];

    PetscCall(PetscSNPrintf(name, sizeof(name), "%s/%s", field[k].on_cells ? "cells" : "nodes", field[k].name));
    PetscCall(
        HycoH5WriteReal(h, name, field[k].on_cells ? m->n_cells : m->n_nodes, field[k].components, field[k].data));
  }
  if (contact && contact->n) {
    PetscCall(HycoH5WriteInt(h, "contact/node_id", contact->n, 1, contact->node_id));
    PetscCall(HycoH5WriteReal(h, "contact/lambda", contact->n, 1, contact->lambda));
    PetscCall(HycoH5WriteReal(h, "contact/gap", contact->n, 1, contact->gap));
  }
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

static void WriteXDMF(FILE *out, const char file[], HycoMesh m, PetscInt n, const HycoField field[])
{
  char h5[6 * PETSC_MAX_PATH_LEN];

  HycoFieldsEscape(file, h5);
  fprintf(out, "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\">\n <Domain>\n  <Grid Name=\"mesh\">\n");
  fprintf(out, "   <Topology TopologyType=\"%s\" NumberOfElements=\"%ld\"%s>\n", topology[m->type], (long)m->n_cells,
          m->type == HYCO_LINE2 ? " NodesPerElement=\"2\"" : "");
  fprintf(out,
          "    <DataItem Format=\"HDF\" NumberType=\"Int\" Precision=\"%d\" Dimensions=\"%ld "
          "%ld\">%s:/mesh/cells</DataItem>\n   </Topology>\n",
          (int)sizeof(PetscInt), (long)m->n_cells, (long)m->nv, h5);
  fprintf(out,
          "   <Geometry GeometryType=\"XYZ\">\n    <DataItem Format=\"HDF\" Precision=\"8\" Dimensions=\"%ld "
          "3\">%s:/mesh/xyz</DataItem>\n   </Geometry>\n",
          (long)m->n_nodes, h5);
  for (PetscInt k = 0; k < n; k++) {
    const char *kind = field[k].components == 1 ? "Scalar" : field[k].components == 3 ? "Vector" : "Tensor6";

    fprintf(out, "   <Attribute Name=\"%s\" AttributeType=\"%s\" Center=\"%s\">\n", field[k].name, kind,
            field[k].on_cells ? "Cell" : "Node");
    fprintf(
        out,
        "    <DataItem Format=\"HDF\" Precision=\"8\" Dimensions=\"%ld %ld\">%s:/%s/%s</DataItem>\n   </Attribute>\n",
        (long)(field[k].on_cells ? m->n_cells : m->n_nodes), (long)field[k].components, h5,
        field[k].on_cells ? "cells" : "nodes", field[k].name);
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

PetscErrorCode HycoFieldsWrite(const char path[], HycoMesh m, const PetscReal X[], HycoScene scene,
                               const PetscReal mu[], PetscInt n, const HycoField field[],
                               const HycoContactTable *contact)
{
  char h5[PETSC_MAX_PATH_LEN];
  const char *slash;
  HycoH5 h;
  HycoFile out;
  PetscErrorCode ierr, failed;

  PetscFunctionBegin;
  PetscCall(HycoFieldsCheckPath(path));
  snprintf(h5, sizeof(h5), "%.*s.h5", (int)strlen(path) - 5, path);
  PetscCall(HycoFileCreate(path, HYCO_FILE_TEXT, &out));
  slash = strrchr(h5, '/');
  WriteXDMF(HycoFileStream(out), slash ? slash + 1 : h5, m, n, field);
  ierr = HycoFileFlush(out);
  if (!ierr) ierr = HycoH5Create(h5, &h);
  if (!ierr) { /* the numbers first: without them the .xdmf would point at none, or at those of another run */
    failed = WriteNumbers(h, m, X, scene, mu, n, field, contact);
    ierr = HycoH5Close(&h, (PetscBool)!failed);
    if (failed) ierr = failed;
  }
  failed = HycoFileClose(&out, (PetscBool)!ierr);
  if (failed && !ierr) (void)remove(h5);
  PetscCall(ierr ? ierr : failed);
  PetscFunctionReturn(PETSC_SUCCESS);
}

void HycoTensor6(PetscInt n_cells, PetscInt ns, const PetscReal sigma[], PetscReal tensor[])
{
  static const PetscInt place[6] = {0, 3, 5, 1, 4, 2};

  for (PetscInt e = 0; e < n_cells; e++) {
    for (PetscInt k = 0; k < 6; k++) tensor[6 * e + place[k]] = k < ns ? sigma[e * ns + k] : 0;
  }
}

PetscErrorCode HycoSolutionWrite(const char path[], HycoFE fe, HycoPairs *pairs, const PetscReal u[],
                                 const PetscReal lambda[], const PetscReal *rid)
{
  HycoMesh m = fe->mesh;
  PetscReal *u3, *sigma, *tensor, *force, *pressure, *gap, *normal, *area, *gap_node;
  PetscInt *slave_id, n = 5;
  HycoContactTable table;
  PetscErrorCode ierr; /* a place where nothing can be written is the caller's to mend: nothing is kept for it */

  PetscFunctionBegin;
  PetscCall(PetscCalloc5(3 * m->n_nodes, &u3, m->n_cells * fe->n_sigma, &sigma, 6 * m->n_cells, &tensor, 3 * m->n_nodes,
                         &force, m->n_nodes, &pressure));
  PetscCall(
      PetscCalloc5(pairs->n, &gap, 3 * pairs->n, &normal, pairs->n, &area, pairs->n, &slave_id, m->n_nodes, &gap_node));
  for (PetscInt k = 0; k < fe->n_dof; k++) u3[3 * (k / fe->dim) + k % fe->dim] = u[k];
  PetscCall(HycoFEStress(fe, u, sigma));
  HycoTensor6(m->n_cells, fe->n_sigma, sigma, tensor);
  PetscCall(HycoContactGeometry(fe, pairs, normal, gap));
  PetscCall(HycoContactAreas(fe, pairs, area));
  for (PetscInt k = 0; k < pairs->n; k++) {
    const PetscInt s = HycoPairsSlave(pairs, k), *master;
    const PetscReal *weight;
    PetscInt masters;

    HycoPairsMasters(pairs, k, &masters, &master, &weight);
    slave_id[k] = m->node_id[s];
    for (PetscInt c = 0; c < fe->dim && !HycoPairsAlone(fe->scene, pairs, k); c++) {
      force[3 * s + c] -= lambda[k] * normal[3 * k + c];
      gap[k] -= normal[3 * k + c] * u[s * fe->dim + c];
      for (PetscInt j = 0; j < masters; j++) {
        force[3 * master[j] + c] += weight[j] * lambda[k] * normal[3 * k + c];
        gap[k] += weight[j] * normal[3 * k + c] * u[master[j] * fe->dim + c];
      }
    }
    pressure[s] = area[k] > 0 ? lambda[k] / area[k] : 0;
    gap_node[s] = gap[k];
  }
  table.n = pairs->n;
  table.node_id = slave_id;
  table.lambda = lambda;
  table.gap = gap;
  {
    const HycoField field[6] = {
        {"displacement", PETSC_FALSE, 3, u3},     {"stress", PETSC_TRUE, 6, tensor},
        {"contact_force", PETSC_FALSE, 3, force}, {"contact_pressure", PETSC_FALSE, 1, pressure},
        {"gap", PETSC_FALSE, 1, gap_node},        {"rid", PETSC_TRUE, 1, rid}};

    if (rid) n = 6;
    ierr = HycoFieldsWrite(path, m, fe->X, fe->scene, fe->mu, n, field, &table);
  }
  PetscCall(PetscFree5(u3, sigma, tensor, force, pressure));
  PetscCall(PetscFree5(gap, normal, area, slave_id, gap_node));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
