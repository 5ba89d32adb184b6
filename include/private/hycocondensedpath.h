/*
  The condensed model of a scene with a history. While K stays, displacements are linear in the loads F, the inelastic
  strains and the contact forces,

      U = K^-1 (F + sum over cells e of q_e - B^T L),      q_e = integral over e of B^T C eps_in

  exactly, and inelastic strains along paths fill few modes, q = sum of beta_j Q_j. So U lies in the span V of the
  answers K^-1 F, K^-1 Q_j and K^-1 B^T, and the equations tested by V, with V^T K V, are these ones: G = B K^-1 B^T is
  B V (V^T K V)^-1 V^T B^T. beta is what the laws say in few cells, chosen by Q-DEIM on the modes, in the sense of least
  squares; what loads inside the bodies, heat and supports give to F comes from the same cells in the same way. It
  begins as HycoGalerkin, whose path solves it.
*/
#ifndef HYCOCONDENSEDPATH_H
#define HYCOCONDENSEDPATH_H

#include <hycogalerkin.h>
#include <hycoinelasticmodes.h>

/* The tabulated operators. Columns: the unknowns of the n chosen cells, one cell after the other. */
typedef struct {
  PetscInt n_inelastic, n_loads; /* numbers of modes */
  PetscReal amplification;       /* 2-norm of the inverse on the chosen cells: amplifies what the modes do not
                                    represent */
  PetscReal *K;                  /* V^T K V, l x l */
  PetscReal *inelastic, *loads;  /* l x (n nv dim) column major: map the cells' inelastic forces and loads to those
                                    tested by V */
} HycoCondensedTable;

typedef struct {
  struct _n_HycoGalerkinModel galerkin;
  HycoCondensedTable table;
} * HycoCondensedPathModel;

typedef struct _n_HycoCondensedPath {
  struct _n_HycoGalerkin galerkin;
  const HycoCondensedTable *table;
  PetscReal *Ke, *heat; /* by cell: elastic stiffness (nv dim square); force of its thermal strains (nv dim) */
  PetscReal *weight;    /* by cell: 2-norm of its columns of the inelastic forces */
} * HycoCondensedPath;

/* Its training, stored in the reducer's data beside that of the condensed model without a history. */
typedef struct {
  PetscReal tol;            /* of the inelastic modes */
  PetscInt cells;           /* chosen for each mode; 0: all cells */
  HycoCondensedTable table; /* ordered as t->seeds_cell, ascending; every rank */
} HycoCondensingPath;

/* Turns a model of type condensed into one of paths: its ops, traits and data; training: a prototype. */
PetscErrorCode HycoCondensedTakePath(HycoROM model);
PetscErrorCode HycoCondensedTableFree(HycoCondensedTable *table);

/* Implementations of the training ops (condense_path.c). */
PetscErrorCode HycoCondensedPathBegin(HycoReducer reducer);
PetscErrorCode HycoCondensedPathModes(HycoReducer reducer, HycoSnapshots store);

#endif
