/* The mesh file's form. */
#ifndef MSH_H
#define MSH_H

#include <hycoimpl.h>

/* Fails unless the file is a gmsh mesh of format 2.2 or 4.1 whose counts, tags, types and nodes agree. One process. */
PetscErrorCode HycoMshCheck(const char path[]);

#endif
