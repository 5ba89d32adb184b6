from spack.package import *


class Hyco(CMakePackage):
    """Reduced and full-order models of parametrised unilateral contact: hybrid hyper-reduction on PETSc and SLEPc."""

    # a checkout of the sources: spack dev-build, or spack develop --path .
    license("BSD-2-Clause")
    version("0.1.0")

    variant("shared", default=True, description="A shared library")

    depends_on("c", type="build")
    depends_on("cmake@3.20:", type="build")
    depends_on("pkgconfig", type="build")
    depends_on("mpi")
    depends_on("petsc@3.18: +mpi+hdf5+mumps+double~complex")
    depends_on("slepc@3.18:")
    depends_on("hdf5+mpi")
    depends_on("metis")
    depends_on("mumps+mpi")
    depends_on("muparser")
    depends_on("qhull")
    depends_on("cjson")
    depends_on("gmsh", type="run")

    def cmake_args(self):
        return [self.define_from_variant("BUILD_SHARED_LIBS", "shared"), self.define("HYCO_TESTS", False),
                self.define("MPI_C_COMPILER", self.spec["mpi"].mpicc)]
