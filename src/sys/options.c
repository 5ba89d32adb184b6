/* The table of options, and look-ups whose complaints are one clear line. */
#include <hycoimpl.h>
#include <ctype.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

static const HycoOption option_table[] = {
    {"hyco_solver_type", "<active_set|tao|lemke>", "active_set",
     "method for every contact problem (a model's takes active_set where a TAO type needs symmetry)"},
    {"hyco_tao_type", "<gpcg|tron|...|ssils|...>", "gpcg; ssils if nonsymmetric",
     "with the type tao: its solver; docs/solvers.md says which for what (-hyco_tao_... sets its own options)"},
    {"hyco_solver_form", "<auto|dual|primal|dual_free>", "auto",
     "full order: pose it in the forces (few contacts; _free: no matrix) or in the gaps (as many as unknowns)"},
    {"hyco_linear", "<auto|direct|iterative>", "auto",
     "solve with the stiffness by a factor (MUMPS), or by conjugate gradients with multigrid"},
    {"hyco_memory", "<GB>", "0", "what a factor may take before iterations do (0: most of what is free)"},
    {"hyco_solver_rtol", "<real>", "1e-8", "largest relative KKT residual that counts as solved"},
    {"hyco_solver_max_its", "<int>", "0", "iterations of the active set or TAO (0: from the number of contacts; 2000)"},
    {"hyco_solver_fallback", "<bool>", "true", "what is not solved is tried again: tao, then active_set, then lemke"},
    {"hyco_regularise", "<bool>", "false",
     "full order: rigid motions that neither supports nor contact hold are taken out, not refused"},
    {"hyco_regularise_tol", "<real>", "1e-2", "of such a motion: the share of the loads on it that may be unbalanced"},
    {"hyco_solver_warm_start", "<bool>", "true", "full order: start from the last solution's active contacts"},
    {"hyco_solver_multilevel", "<bool>", "true", "full order, every unknown a contact: start from coarser problems"},
    {"hyco_mesh_write", "<file.h5>", "",
     "writes the mesh, refined as the scene says, in the HDF5 format of PETSc's DMPlex"},
    {"hyco_partition", "<metis|ptscotch>", "metis", "cuts the mesh for the ranks; PT-Scotch also where METIS fails"},
    {"hyco_groups", "<int>", "0", "groups of ranks that solve snapshots side by side (0: from the mesh's size)"},
    {"hyco_snapshots", "<folder>", "MODEL.snapshots", "where full-order solutions are stored"},
    {"hyco_model_type", "<hybrid|projection|condensed>", "hybrid",
     "hybrid hyper-reduced (38) on an RID; projection-based (44) on the whole mesh; condensed on the contact forces"},
    {"hyco_dual", "<fe|nnmf|snapshots>", "fe; nnmf if projection",
     "forces: of the finite elements (hybrid); factorised dual snapshots, or they themselves (projection)"},
    {"hyco_nnmf_vectors", "<int>", "0", "vectors of the nonnegative factorisation (0: as many as displacement modes)"},
    {"hyco_nnmf_max_its", "<int>", "100", "alternations of the nonnegative factorisation"},
    {"hyco_condensed_tol", "<real>", "1e-7",
     "condensed, no points given: add values until the forces' error, one value left out, is no larger"},
    {"hyco_condensed_pod_tol", "<real>", "1e-14",
     "condensed: energy that its displacement modes may leave out, unless -hyco_pod_tol is smaller"},
    {"hyco_condensed_max_values", "<int>", "24", "condensed, no points given: at most so many values per parameter"},
    {"hyco_pod_tol", "<real>", "1e-7", "energy left out of the displacement basis, the epsilon of (18)"},
    {"hyco_pod_noise", "<real>", "1e-11", "singular values below this share of the first are noise"},
    {"hyco_pod_max_modes", "<int>", "0", "at most so many displacement modes (0: no limit)"},
    {"hyco_rid_modes", "<list>", "displacement,stress,force",
     "bases whose DEIM points seed the RID: displacement, stress, force, dual"},
    {"hyco_rid_dual_tol", "<real>", "1e-1", "epsilon of (18) for the dual basis"},
    {"hyco_rid_stress_tol", "<real>", "hyco_pod_tol", "epsilon of (18) for the stress basis"},
    {"hyco_rid_force_tol", "<real>", "hyco_pod_tol", "epsilon of (18) for the basis of generalised forces"},
    {"hyco_deim_type", "<deim|qdeim>", "deim",
     "how a basis chooses the points that seed the RID: greedily, or by pivoted QR"},
    {"hyco_rid_layers", "<int>", "0", "layers of elements added around the RID"},
    {"hyco_rid_contact_extension", "<length>", "0",
     "contact nodes this close to the RID's join it with their elements"},
    {"hyco_rid_groups", "<list>", "none", "mesh groups whose elements join the RID (region of interest)"},
    {"hyco_rid_region", "<expression>", "none", "elements with a node where this is positive join the RID"},
    {"hyco_rid_whole", "<bool>", "false", "take the whole mesh as the RID"},
    {"hyco_hybrid", "<auto|rank|contact|all>", "auto",
     "displacements kept full order: fewest for full row rank, all contact ones, all"},
    {"hyco_hybrid_trials", "<int>", "0",
     "candidate sets judged by their training error when hybrid is rank (0: from the size)"},
    {"hyco_hybrid_ridge", "<real>", "-1",
     "of the interface's regression when hybrid is all (-1: by the training error; 0: plain least squares)"},
    {"hyco_scan", "<int>", "0",
     "points per parameter that look for a singular reduced stiffness (0: up to some hundred in all)"},
    {"hyco_keep_singular", "<bool>", "false", "keep a model whose reduced stiffness is singular inside the ranges"},
    {"hyco_validation", "<int>", "-1",
     "held-out solutions beside the training points, by which the model is judged (-1: from their number; 0: none)"},
    {"hyco_search", "<bool>", "true",
     "search model_type, pod_tol, rid_layers, rid_contact_extension and hybrid by held-out errors, unless given"},
    {"hyco_greedy_indicator", "<local|penetration>", "local",
     "what train -greedy judges by: distance from a full-order problem on the RID (43), or penetration (45)"},
    {"hyco_greedy_keep", "<bool>", "false", "train -greedy keeps each iteration's model beside the snapshots"},
    {"hyco_fallback", "<bool>", "false",
     "predict solves full order on -scene where the reduced solve fails or its estimated error is above a -target_..."},
    {"hyco_full_displacement", "<bool>", "false",
     "predict, condensed: displacements and stresses by one full solve on -scene with the predicted forces"},
    {"hyco_reconstruct", "<bool>", "true", "reconstruct the contact forces outside the RID by (41)"},
    {"hyco_reconstruct_solver", "<auto|nnls|tao>", "auto",
     "of (41): Lawson and Hanson's active set, or TAO's bnls; auto: TAO where the active set stops short"},
};

PetscErrorCode HycoGetOptionTable(PetscInt *n, const HycoOption *table[])
{
  PetscFunctionBegin;
  if (n) *n = (PetscInt)(sizeof(option_table) / sizeof(option_table[0]));
  if (table) *table = option_table;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool HycoOptionKnown(const char name[])
{
  for (size_t k = 0; k < sizeof(option_table) / sizeof(option_table[0]); k++) {
    if (strcasecmp(option_table[k].name, name) == 0) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* Levenshtein distance of two words of fewer than 128 letters, letter case ignored. */
static PetscInt EditDistance(const char *a, const char *b)
{
  PetscInt row[129];
  PetscInt m = (PetscInt)strlen(a), n = (PetscInt)strlen(b);

  if (m > 127 || n > 127) return PETSC_MAX_INT;
  for (PetscInt j = 0; j <= n; j++) row[j] = j;
  for (PetscInt i = 1; i <= m; i++) {
    PetscInt diagonal = row[0];

    row[0] = i;
    for (PetscInt j = 1; j <= n; j++) {
      PetscInt cost = diagonal + (tolower((unsigned char)a[i - 1]) != tolower((unsigned char)b[j - 1]));

      diagonal = row[j];
      row[j] = PetscMin(cost, 1 + PetscMin(row[j], row[j - 1]));
    }
  }
  return row[n];
}

const char *HycoNearest(const char *word, PetscInt n, const char *const names[])
{
  const char *nearest = NULL;
  PetscInt best = PetscMax(2, (PetscInt)strlen(word) / 3) + 1;

  for (PetscInt k = 0; k < n; k++) {
    PetscInt distance = EditDistance(word, names[k]);

    if (distance < best) {
      best = distance;
      nearest = names[k];
    }
  }
  return nearest;
}

static PetscErrorCode GetText(PetscOptions options, const char name[], char text[HYCO_LINE], PetscBool *set)
{
  char dashed[HYCO_LINE];
  const char *value = NULL;

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(dashed, sizeof(dashed), "-%s", name));
  PetscCall(PetscOptionsFindPair(options, NULL, dashed, &value, set));
  HycoCheck(!*set || !value || strlen(value) < HYCO_LINE, "-%s is longer than %d characters", name, HYCO_LINE - 1);
  if (*set) PetscCall(PetscStrncpy(text, value ? value : "", HYCO_LINE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoOptionsReal(PetscOptions options, const char name[], PetscReal lo, PetscReal hi, PetscReal *value)
{
  char text[HYCO_LINE], *end;
  PetscBool set;
  double number;

  PetscFunctionBegin;
  PetscCall(GetText(options, name, text, &set));
  if (!set) PetscFunctionReturn(PETSC_SUCCESS);
  number = HycoNumber(text, &end);
  if (end == text || *end != '\0' || !(number >= lo && number <= hi)) {
    HycoFail("-%s is \"%s\"; it must be a number from %g to %g", name, text, (double)lo, (double)hi);
  }
  *value = number;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoOptionsInt(PetscOptions options, const char name[], PetscInt lo, PetscInt hi, PetscInt *value)
{
  char text[HYCO_LINE], *end;
  PetscBool set;
  long number;

  PetscFunctionBegin;
  PetscCall(GetText(options, name, text, &set));
  if (!set) PetscFunctionReturn(PETSC_SUCCESS);
  errno = 0;
  number = strtol(text, &end, 10);
  if (end == text || *end != '\0' || errno || number < lo || number > hi) {
    if (hi == PETSC_MAX_INT) HycoFail("-%s is \"%s\"; it must be a whole number, at least %d", name, text, (int)lo);
    HycoFail("-%s is \"%s\"; it must be a whole number from %d to %d", name, text, (int)lo, (int)hi);
  }
  *value = (PetscInt)number;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoOptionsBool(PetscOptions options, const char name[], PetscBool *value)
{
  static const char *const words[] = {"false", "no", "off", "0", "true", "yes", "on", "1", NULL};
  char text[HYCO_LINE];
  PetscBool set;

  PetscFunctionBegin;
  PetscCall(GetText(options, name, text, &set));
  if (!set) PetscFunctionReturn(PETSC_SUCCESS);
  if (!text[0])
    *value = PETSC_TRUE;
  else {
    PetscInt index = -1;

    PetscCall(HycoOptionsWord(options, name, words, &index));
    *value = (PetscBool)(index >= 4);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HycoOptionsWord(PetscOptions options, const char name[], const char *const words[], PetscInt *index)
{
  char text[HYCO_LINE], list[HYCO_LINE] = "";
  PetscBool set;

  PetscFunctionBegin;
  PetscCall(GetText(options, name, text, &set));
  if (!set) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; words[k]; k++) {
    if (strcasecmp(text, words[k]) == 0) {
      *index = k;
      PetscFunctionReturn(PETSC_SUCCESS);
    }
    PetscCall(HycoListAdd(list, ", ", words[k]));
  }
  HycoFail("-%s is \"%s\"; it must be one of: %s", name, text, list);
}
