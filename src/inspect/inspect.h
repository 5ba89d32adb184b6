/* Parts of an inspection: private to inspect/. */
#ifndef HYCO_INSPECT_H
#define HYCO_INSPECT_H
#include <hycobodiestraining.h>
#include <hycofomimpl.h>
#include <hycoinspect.h>

/* -- bodies.c, groups.c: the mesh, on rank 0 -- */

/* Finds the most stretched cell of each body at fe's nodes. */
void HycoInspectCells(HycoInspection *in, HycoFE fe);
/* Cells, types and parts of the bodies. */
PetscErrorCode HycoInspectBodies(HycoInspection *in);
PetscErrorCode HycoInspectGroups(HycoInspection *in);

/* -- contacts.c, on rank 0 -- */

PetscErrorCode HycoInspectContactsBegin(HycoInspection *in);
/* Measures the gaps at fe's parameters; *first: also compares facets of slave and master. */
PetscErrorCode HycoInspectGaps(HycoInspection *in, HycoFE fe, PetscBool first);
PetscErrorCode HycoInspectTies(HycoInspection *in);

/* -- variables.c, on rank 0 -- */

PetscErrorCode HycoInspectVariables(HycoInspection *in);

/* -- cost.c -- */

/* For the assembled system, which took `assembly` seconds: the factor's memory by MUMPS's analysis of the stiffness
   with the contacts, seconds from its count of operations. Collective. */
PetscErrorCode HycoInspectCost(HycoFOM fom, PetscReal assembly, HycoInspection *in, PetscReal speed[2]);

/* -- body_cost.c -- */

/* speed: those of HycoInspectCost(). Collective. */
PetscErrorCode HycoInspectBodyCost(HycoFOM fom, const HycoBodyParts *parts, const PetscReal mu[],
                                   const PetscReal speed[2], HycoInspection *in);

#endif
