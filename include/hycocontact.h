/* HycoContact: one contact of the scene. Its entries name its type; a type is a discretisation: which slave nodes have
   which masters, their normals and gaps. */
#ifndef HYCOCONTACT_H
#define HYCOCONTACT_H

#include <hycoscene.h>

#if defined(__cplusplus)
extern "C" {
#endif

typedef struct _p_HycoContact *HycoContact;
typedef const char *HycoContactType;
#define HYCO_CONTACT_OBSTACLE "obstacle" /* n . u <= gap on the nodes of a group */
#define HYCO_CONTACT_PAIR     "pair"     /* n . (u_slave - u_master) <= gap on pairs of nodes */
#define HYCO_CONTACT_SURFACE  "surface"  /* the same at a slave node's projection on the master's facets */

/* What a contact of the scene carries. */
typedef struct {
  const char *name;     /* the scene's. Borrowed */
  PetscInt n, n_active; /* contacts, those with L_i > 0 */
  PetscReal force[3];   /* on the slave's side: the sum of -L_i n_i; on the master's the opposite */
  PetscReal moment[3];  /* of these about the origin; 2D: the last component alone, and 0 in an axisymmetric scene */
  PetscReal area;       /* that the contacts with L_i > 0 stand for (2D: length; 1D: 0) */
  PetscReal pressure; /* the largest of L_i over the area that contact i stands for; 0 where the group is no surface */
} HycoContactResult;

/* n potential contacts of one HycoContact, where the bodies are at mu. */
typedef struct {
  PetscInt n;
  const PetscReal *mu;     /* the scene's parameters */
  const PetscReal *slave;  /* n x 3: the slave nodes */
  const PetscReal *master; /* n x 3: their master points; the slave nodes themselves where there is none */
} HycoContactPoints;

/* The mesh at a parameter value and its contacts: for the library, and for types that have masters. */
struct _n_HycoFE;
struct _n_HycoPairs;

typedef struct _HycoContactOps *HycoContactOps;
struct _HycoContactOps {
  /* The slave nodes, and their masters on the mesh as drawn; NULL: the nodes of `group` that are not wholly fixed,
     without masters. */
  PetscErrorCode (*setup)(HycoContact, struct _n_HycoFE *fe, PetscInt index, struct _n_HycoPairs *pairs);
  /* The masters of slave nodes on surfaces that a map moves, at most `reach` away, in CSR from start[0], which is set;
     NULL: they stay what they are. */
  PetscErrorCode (*find)(HycoContact, struct _n_HycoFE *fe, PetscReal reach, PetscInt n, const PetscInt slave[],
                         PetscInt start[], PetscInt master[], PetscReal weight[]);
  /* Unit normals (n x 3), outward from the slave side; NULL: the entries normal_x, ... at the master points, or the
     slave surface's. */
  PetscErrorCode (*normal)(HycoContact, const HycoContactPoints *points, PetscReal normal[]);
  /* Gaps at these normals; NULL: the entry gap at the master points, or the distance along the normal. */
  PetscErrorCode (*gap)(HycoContact, const HycoContactPoints *points, const PetscReal normal[], PetscReal gap[]);
  /* Fails where the contacts first .. last - 1 cannot stand at fe's nodes. */
  PetscErrorCode (*verify)(HycoContact, struct _n_HycoFE *fe, const struct _n_HycoPairs *pairs, PetscInt first,
                           PetscInt last, const PetscReal normal[]);
  PetscErrorCode (*view)(HycoContact, PetscViewer);
  PetscErrorCode (*destroy)(HycoContact);
};

/* Adds a type, which scenes then name: create() declares its entries and sets its operations. Not collective. */
PetscErrorCode HycoContactRegister(const char name[], PetscErrorCode (*create)(HycoContact));

/* A contact without type. The caller owns it. Collective. */
PetscErrorCode HycoContactCreate(MPI_Comm comm, HycoContact *contact);
PetscErrorCode HycoContactDestroy(HycoContact *contact);
/* Fails with the list of those that are registered. */
PetscErrorCode HycoContactSetType(HycoContact contact, HycoContactType type);
PetscErrorCode HycoContactGetType(HycoContact contact, HycoContactType *type);
PetscErrorCode HycoContactView(HycoContact contact, PetscViewer viewer);

/* In create(): an entry of the scene; `title` says in messages what it is. The library reads `group` or `slave` (one of
   them is required), `master`, `normal_x`, `normal_y`, `normal_z` and `gap` as the scene's documentation says. */
PetscErrorCode HycoContactDeclare(HycoContact contact, const char name[], const char title[], HycoEntryKind kind,
                                  PetscBool required);
/* The same for normal_x, normal_y and normal_z. */
PetscErrorCode HycoContactDeclareNormal(HycoContact contact);
PetscErrorCode HycoContactSetOps(HycoContact contact, const struct _HycoContactOps *ops);
PetscErrorCode HycoContactSetData(HycoContact contact, void *data);
PetscErrorCode HycoContactGetData(HycoContact contact, void *data);
/* The value of a declared expression at n points x (n x 3) and mu; fails where the scene gives none. */
PetscErrorCode HycoContactEvaluate(HycoContact contact, const char name[], const PetscReal mu[], PetscInt n,
                                   const PetscReal x[], PetscReal value[]);
/* A length; -1 where the scene gives none. */
PetscErrorCode HycoContactGetLength(HycoContact contact, const char name[], PetscReal *length);

#if defined(__cplusplus)
}
#endif
#endif
