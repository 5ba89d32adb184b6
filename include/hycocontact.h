/* HycoContact: one contact of the scene. Its entries name its type. A type is a discretisation: it determines the
   masters of the slave nodes, their normals and gaps. */
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
#define HYCO_CONTACT_MORTAR   "mortar"   /* the same on the mean over the slave's facets, by dual functions */
#define HYCO_CONTACT_RIGID    "rigid"    /* an obstacle that moves as one node does */

/* Resultants of a contact of the scene. */
typedef struct {
  const char *name;      /* the scene's. Borrowed */
  PetscInt n, n_active;  /* contacts, those with L_i > 0 */
  PetscReal force[3];    /* on the slave's side: the sum of -L_i n_i, and friction; on the master's side the opposite */
  PetscReal moment[3];   /* of these about the origin; 2D: only the last component; 0 in an axisymmetric scene */
  PetscReal area;        /* sum of the nodal areas of the contacts with L_i > 0 (2D: length; 1D: 0) */
  PetscReal pressure;    /* largest L_i divided by the area of its node; 0 if the group is not a surface */
  PetscReal friction[3]; /* the tangential part of `force` */
  PetscReal friction_work; /* dissipated since the start of the history, >= 0 */
  PetscReal pressure_min;  /* the smallest, 0 where a contact is open */
} HycoContactResult;

/* n potential contacts of one HycoContact, at the positions of the bodies for mu. */
typedef struct {
  PetscInt n;
  const PetscReal *mu;     /* the scene's parameters */
  const PetscReal *slave;  /* n x 3: the slave nodes */
  const PetscReal *master; /* n x 3: their master points; without a master the slave nodes themselves */
} HycoContactPoints;

/* The mesh at a parameter value and its contacts: used by the library, and by types that have masters. */
struct _n_HycoFE;
struct _n_HycoPairs;

typedef struct _HycoContactOps *HycoContactOps;
struct _HycoContactOps {
  /* Sets the slave nodes and their masters on the mesh as drawn. NULL: the nodes of `group` that have a free
     displacement, without masters. */
  PetscErrorCode (*setup)(HycoContact, struct _n_HycoFE *fe, PetscInt index, struct _n_HycoPairs *pairs);
  /* Appends to `found` the contacts first .. last - 1 of `pairs`, on surfaces that a map moves, with their masters at
     most the reach of their search away. NULL: masters do not change. */
  PetscErrorCode (*find)(HycoContact, struct _n_HycoFE *fe, const struct _n_HycoPairs *pairs, PetscInt first,
                         PetscInt last, struct _n_HycoPairs *found);
  /* Computes unit normals (n x 3), outward from the slave side. NULL: from the entries normal_x, ... at the master
     points, or from the slave surface. */
  PetscErrorCode (*normal)(HycoContact, const HycoContactPoints *points, PetscReal normal[]);
  /* Computes the gaps along these normals. NULL: from the entry gap at the master points, or the distance along the
     normal. */
  PetscErrorCode (*gap)(HycoContact, const HycoContactPoints *points, const PetscReal normal[], PetscReal gap[]);
  /* Fails if the contacts first .. last - 1 are not valid at the positions of fe's nodes. */
  PetscErrorCode (*verify)(HycoContact, struct _n_HycoFE *fe, const struct _n_HycoPairs *pairs, PetscInt first,
                           PetscInt last, const PetscReal normal[]);
  PetscErrorCode (*view)(HycoContact, PetscViewer);
  PetscErrorCode (*destroy)(HycoContact);
};

/* Adds a type that scenes can then name. create() declares its entries and sets its operations. Not collective. */
PetscErrorCode HycoContactRegister(const char name[], PetscErrorCode (*create)(HycoContact));

/* Creates a contact without a type. The caller owns it. Collective. */
PetscErrorCode HycoContactCreate(MPI_Comm comm, HycoContact *contact);
PetscErrorCode HycoContactDestroy(HycoContact *contact);
/* Sets the type. Fails for an unknown type, with the list of the registered ones. */
PetscErrorCode HycoContactSetType(HycoContact contact, HycoContactType type);
PetscErrorCode HycoContactGetType(HycoContact contact, HycoContactType *type);
PetscErrorCode HycoContactView(HycoContact contact, PetscViewer viewer);

/* In create(): declares an entry of the scene; messages describe it by `title`. The library reads `group` or `slave`
   (one of them is required), `master`, `normal_x`, `normal_y`, `normal_z` and `gap` as documented for scenes. */
PetscErrorCode HycoContactDeclare(HycoContact contact, const char name[], const char title[], HycoEntryKind kind,
                                  PetscBool required);
/* Declares normal_x, normal_y and normal_z. */
PetscErrorCode HycoContactDeclareNormal(HycoContact contact);
PetscErrorCode HycoContactSetOps(HycoContact contact, const struct _HycoContactOps *ops);
PetscErrorCode HycoContactSetData(HycoContact contact, void *data);
PetscErrorCode HycoContactGetData(HycoContact contact, void *data);
/* Evaluates a declared expression at n points x (n x 3) and mu. Fails if the scene does not give it. */
PetscErrorCode HycoContactEvaluate(HycoContact contact, const char name[], const PetscReal mu[], PetscInt n,
                                   const PetscReal x[], PetscReal value[]);
/* Gets a declared length; -1 if the scene does not give it. */
PetscErrorCode HycoContactGetLength(HycoContact contact, const char name[], PetscReal *length);

#if defined(__cplusplus)
}
#endif
#endif
