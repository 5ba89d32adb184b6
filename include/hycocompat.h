/*
  Differences between library versions. The code is written for the newest supported version; this file adds what older
  ones lack or name otherwise. The parts for HDF5 and gmsh apply if their headers are included before.
*/
#ifndef HYCOCOMPAT_H
#define HYCOCOMPAT_H

#include <petscsys.h>

/* Since 3.22 a type of Tao sets the defaults of its tolerances and limits itself. */
#if PETSC_VERSION_LT(3, 22, 0)
#define TaoParametersInitialize(tao) ((void)(tao), PETSC_SUCCESS)
#endif

#if PETSC_VERSION_LT(3, 21, 0)
#define TaoMonitorCancel TaoCancelMonitors
#define HYCO_EDGE_WEIGHTS_ARGUMENT
#else /* edges of a PetscPartitioner can have weights */
#define HYCO_EDGE_WEIGHTS_ARGUMENT PetscSection edge_weights __attribute__((unused)),
#endif
#if PETSC_VERSION_LT(3, 19, 0)
#define PETSC_SUCCESS ((PetscErrorCode)0)
#endif

/* The MPI type of PetscBool. */
#if PETSC_VERSION_LT(3, 24, 0)
#define HYCO_MPI_BOOL MPIU_BOOL
#else
#define HYCO_MPI_BOOL MPI_C_BOOL
#endif

/* Argument types of a PetscContainer's destructor and context. */
#if PETSC_VERSION_LT(3, 23, 0)
typedef void *HycoContained;
#define HycoContainedContext(contained) (contained)
#define PetscContainerSetCtxDestroy     PetscContainerSetUserDestroy
#else
typedef void **HycoContained;
#define HycoContainedContext(contained) (*(contained))
#endif

/* Argument types of PetscErrorMessage(). */
#if PETSC_VERSION_LT(3, 25, 0)
typedef char *HycoErrorText;
#else
typedef const char *HycoErrorText;
#endif

#endif

#if defined(H5_VERS_MAJOR) && !defined(HYCOCOMPAT_HDF5)
#define HYCOCOMPAT_HDF5
#if H5_VERSION_GE(1, 12, 0)
typedef H5O_info2_t HycoH5Info;
#define HycoH5Visit(file, op, ctx) H5Ovisit3(file, H5_INDEX_NAME, H5_ITER_NATIVE, op, ctx, H5O_INFO_BASIC)
#else
typedef H5O_info_t HycoH5Info;
#define HycoH5Visit(file, op, ctx) H5Ovisit2(file, H5_INDEX_NAME, H5_ITER_NATIVE, op, ctx, H5O_INFO_BASIC)
#endif
#endif

#if defined(GMSH_API_VERSION_MAJOR) && !defined(HYCOCOMPAT_GMSH)
#define HYCOCOMPAT_GMSH
#if GMSH_API_VERSION_MAJOR * 100 + GMSH_API_VERSION_MINOR >= 409 /* one more argument */
#define HycoGmshInitialize(initialize, ierr) initialize(0, NULL, 0, 0, ierr)
#else
#define HycoGmshInitialize(initialize, ierr) initialize(0, NULL, 0, ierr)
#endif
#endif
