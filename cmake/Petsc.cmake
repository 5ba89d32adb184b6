# Finds MPI, BLAS and HDF5. A process must use the same MPI and BLAS as PETSc.

# Stops if the MPI that CMake found is not the MPI of PETSc: petscsys.h compares them.
function(hyco_check_mpi)
  include(CheckCSourceCompiles)
  set(CMAKE_REQUIRED_LIBRARIES PkgConfig::PETSC MPI::MPI_C)
  set(CMAKE_REQUIRED_QUIET ON)
  check_c_source_compiles("#include <petscsys.h>
int main(int argc, char **argv) { return PetscInitialize(&argc, &argv, 0, 0); }" HYCO_MPI_IS_PETSCS)
  if(NOT HYCO_MPI_IS_PETSCS)
    unset(HYCO_MPI_IS_PETSCS CACHE) # checked again in the next run, with another MPI
    message(FATAL_ERROR "A program with PETSc ${PETSC_VERSION} (${PETSC_PREFIX}) and the MPI of ${MPI_C_COMPILER} does not compile or "
            "link: is that MPI another one than PETSc's? Take PETSc's own: -DMPI_C_COMPILER=/path/to/its/mpicc "
            "(CMakeFiles/CMakeError.log or CMakeConfigureLog.yaml in the build folder has the compiler's words.)")
  endif()
endfunction()

# Finds the BLAS and LAPACK that PETSc was linked with, by the names in its pkg-config file: two BLAS in one process would
# define the same symbols.
function(hyco_find_blas out)
  foreach(name ${PETSC_STATIC_LIBRARIES})
    if(name MATCHES "^(lib)?(f2c|ref|sci|s|c)?(lapack|blas|lapacke|openblas.*|flexiblas|blis.*|mkl_.*|atlas|acml|essl|nvpl_.*)$")
      find_library(HYCO_BLAS_${name} NAMES ${name} HINTS ${PETSC_STATIC_LIBRARY_DIRS} REQUIRED)
      list(APPEND found ${HYCO_BLAS_${name}})
    endif()
  endforeach()
  if(NOT found) # the pkg-config file contains none
    find_package(LAPACK REQUIRED)
    set(found ${LAPACK_LIBRARIES})
  endif()
  message(STATUS "BLAS and LAPACK, as PETSc's: ${found}")
  set(${out} ${found} PARENT_SCOPE)
endfunction()

# Finds HDF5 by its compiler wrapper, or by its pkg-config file, since the wrapper does not accept paths with a blank. The dependencies of
# a shared HDF5 are left out.
function(hyco_find_hdf5 out includes)
  set(HDF5_PREFER_PARALLEL ON) # the HDF5 of PETSc
  find_package(HDF5 QUIET COMPONENTS C)
  if(NOT HDF5_FOUND)
    pkg_search_module(HYCO_HDF5_PC REQUIRED hdf5-openmpi hdf5-mpich hdf5-mpi hdf5)
    find_library(HYCO_HDF5_LIBRARY NAMES ${HYCO_HDF5_PC_LIBRARIES} HINTS ${HYCO_HDF5_PC_LIBRARY_DIRS} REQUIRED)
    set(HDF5_C_LIBRARIES ${HYCO_HDF5_LIBRARY})
    set(HDF5_INCLUDE_DIRS ${HYCO_HDF5_PC_INCLUDE_DIRS})
  endif()
  set(found ${HDF5_C_LIBRARIES})
  list(FILTER found INCLUDE REGEX "libhdf5[^/]*\\.(so|dylib)$")
  if(NOT found)
    set(found ${HDF5_C_LIBRARIES})
  endif()
  message(STATUS "HDF5: ${found}")
  set(${out} ${found} PARENT_SCOPE)
  set(${includes} ${HDF5_INCLUDE_DIRS} PARENT_SCOPE)
endfunction()
