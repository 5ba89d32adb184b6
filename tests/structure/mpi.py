"""CMake refuses an MPI that is not PETSc's: here a wrapper whose mpi.h declares another implementation."""
import os
import subprocess
import tempfile
import unittest

from common import PATIENCE

SOURCE = os.path.dirname(os.path.realpath(os.path.join(os.environ['HYCO_SOURCE'], 'CMakeLists.txt')))
WRAPPER = """#!/bin/sh
case ${{1:-}} in
  --showme:compile | -showme:compile) echo "-I{folder}" $(mpicc --showme:compile) ;;
  --showme:incdirs | -showme:incdirs) echo "{folder}" $(mpicc --showme:incdirs) ;;
  *) exec mpicc "$@" ;;
esac
"""
# compiles and links, and declares that it is not Open MPI
OTHER = """#include_next <mpi.h>
#undef OMPI_MAJOR_VERSION
#define MPICH_NUMVERSION 40000000
"""


class OtherMPI(unittest.TestCase):
    def test_refused(self):
        """CMake refuses the other MPI and names its compiler wrapper."""
        with tempfile.TemporaryDirectory(prefix='hyco-mpi-') as folder:
            wrapper = os.path.join(folder, 'mpicc')
            for path, text in ((wrapper, WRAPPER.format(folder=folder)), (os.path.join(folder, 'mpi.h'), OTHER)):
                with open(path, 'w', encoding='ascii') as file:
                    file.write(text)
            os.chmod(wrapper, 0o755)
            run = subprocess.run(['cmake', '-S', SOURCE, '-B', os.path.join(folder, 'build'), f'-DMPI_C_COMPILER={wrapper}', '-DHYCO_TESTS=OFF'],
                                 capture_output=True, text=True, timeout=100 * PATIENCE, check=False)
            self.assertNotEqual(run.returncode, 0, run.stdout)
            text = ' '.join(run.stderr.split())
            self.assertIn(wrapper, text)
            self.assertIn('another one than PETSc', text)


if __name__ == '__main__':
    unittest.main()
