/* Compares a prediction with a full-order solution on the distributed mesh: each rank compares its rows of the whole
   mesh. */
#ifndef HYCOCOMPARISON_H
#define HYCOCOMPARISON_H

#include <hycofomimpl.h>
#include <hycoromimpl.h>

/* U, sigma, and for a history the inelastic strain. */
#define HYCO_COMPARED 3

typedef struct {
  HycoFOM f; /* borrowed: the mesh, at the parameters */
  PetscInt n_fields;
  PetscInt n[HYCO_COMPARED], first[HYCO_COMPARED];      /* this rank's nodes and cells in the file's order */
  PetscInt width[HYCO_COMPARED];                        /* values of each node or cell */
  PetscReal *value[HYCO_COMPARED], *rid[HYCO_COMPARED]; /* a solution in these rows, and on the mesh of this rank's
                                                           model */
  PetscSF sf[HYCO_COMPARED];                            /* from these rows to that mesh */
  PetscInt l, n_fe, *fe_dof;  /* the model's modes, and its full-order unknowns by their numbers in the whole mesh */
  PetscReal *coefficient, *U; /* gamma and the full-order unknowns; the predicted displacement in the rows */
} HycoComparison;

/* For a model that rank 0 has and others may have (NULL: not on this rank). Collective, as all below. */
PetscErrorCode HycoComparisonCreate(HycoFOM mesh, HycoROM model, HycoComparison *comparison);
PetscErrorCode HycoComparisonDestroy(HycoComparison *comparison);
/* Sends value[] to rid[]. */
PetscErrorCode HycoComparisonBring(HycoComparison *comparison);
/* Computes U of the last prediction of rank `of`; V: the modes' rows of this rank, column major. */
PetscErrorCode HycoComparisonPredict(HycoComparison *comparison, HycoROM model, PetscMPIInt of, const PetscReal V[],
                                     PetscInt lda);
/* Squared 2-norms of the error of U, and of the solution's displacement. */
PetscErrorCode HycoComparisonSquares(const HycoComparison *comparison, PetscReal square[2]);

/* Norms on the whole mesh (norms.c). */
typedef struct _n_HycoNorms *HycoNorms;
PetscErrorCode HycoNormsCreate(HycoFOM mesh, HycoNorms *norms);
/* NULL-safe. */
PetscErrorCode HycoNormsDestroy(HycoNorms *norms);
/* H1 norm of u - minus (this rank's rows of nodes in the file's order; minus may be NULL). Collective. */
PetscErrorCode HycoNormH1(HycoNorms norms, const PetscReal u[], const PetscReal minus[], PetscReal *norm);
/* Norm in the dual of H1 of B^T (L - minus), of all contacts or those of the RID, B as at the last prediction; minus
   may be NULL. Model and forces: rank 0's. Collective. */
PetscErrorCode HycoNormDual(HycoNorms norms, HycoROM model, PetscBool rid_only, const PetscReal L[],
                            const PetscReal minus[], PetscReal *norm);

#endif
