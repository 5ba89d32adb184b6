/* Forces of thermal and inelastic strains, cell by cell (inelastic_forces.c). */
#ifndef HYCOINELASTICFORCES_H
#define HYCOINELASTICFORCES_H

#include <hycoinelastic.h>
#include <hycomaterialimpl.h>

/* Whether a cell's body may deform inelastically. */
static inline PetscBool HycoInelasticFlows(HycoFE fe, PetscInt cell)
{
  return (PetscBool)!fe->scene->body[fe->mesh->cell_body[cell]].law->linear;
}
/* The unknown of fe's mesh that is unknown i of cell e. */
static inline PetscInt HycoCellUnknown(HycoMesh m, PetscInt e, PetscInt i)
{
  return m->cells[e * m->nv + i / m->dim] * m->dim + i % m->dim;
}
/* The force of a cell's thermal strains, with fe's elastic tangents (heat: nv x dim). */
PetscErrorCode HycoInelasticCellHeat(HycoFE fe, PetscInt cell, PetscReal heat[]);
/* The inelastic force of a cell in a state at u (q: nv x dim), 0 where it is round-off; Ke, heat: of the cell; the
   largest sum of magnitudes of the terms it is the difference of (NULL: not wanted). */
PetscErrorCode HycoInelasticCellForce(HycoFE fe, PetscInt cell, const PetscReal Ke[], const PetscReal heat[],
                                      const PetscReal u[], HycoFEState state, PetscReal q[], PetscReal *summands);

#endif
