"""hyco as a part of another CMake project, as a static library: it configures, builds and runs."""
import os
import subprocess
import tempfile
import unittest

from common import PATIENCE

SOURCE = os.path.realpath(os.path.join(os.environ['HYCO_SOURCE'], 'CMakeLists.txt'))
PROJECT = """cmake_minimum_required(VERSION 3.20)
project(other LANGUAGES C)
add_subdirectory({source} hyco)
add_executable(other other.c)
target_link_libraries(other PRIVATE hyco)
"""
PROGRAM = """#include <hyco.h>
#include <stdio.h>
int main(int argc, char **argv)
{
  HycoROM model;
  const PetscReal mu[2] = {0.07, 0.17};
  if (HycoInitialize(&argc, &argv) || HycoROMLoad(argv[1], &model) || HycoROMPredict(model, 2, mu)) return 1;
  printf("%s\\n", HycoVersion());
  return HycoROMDestroy(&model) || HycoFinalize();
}
"""


class Subproject(unittest.TestCase):
    @unittest.skipIf(os.environ.get('HYCO_SANITIZE') == '1', 'its flags are those of the other project')
    def test_static(self):
        """A project in a folder with a blank builds and runs with the static library."""
        with tempfile.TemporaryDirectory(prefix='a b ') as folder:  # and a path with a blank
            for name, text in (('CMakeLists.txt', PROJECT.format(source='"' + os.path.dirname(SOURCE) + '"')), ('other.c', PROGRAM)):
                with open(os.path.join(folder, name), 'w', encoding='ascii') as file:
                    file.write(text)
            build = os.path.join(folder, 'build')
            for command in (['cmake', '-S', folder, '-B', build, '-DBUILD_SHARED_LIBS=OFF', '-DCMAKE_BUILD_TYPE=Debug', '-DCMAKE_C_FLAGS=-O0 -g0'],
                            ['cmake', '--build', build, '-j', '2', '--target', 'other'],
                            [os.path.join(build, 'other'), os.path.join(os.path.dirname(SOURCE), 'tests', 'data', 'rope-hybrid-4-table.h5')]):
                run = subprocess.run(command, capture_output=True, text=True, timeout=500 * PATIENCE, check=False)
                self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
            self.assertFalse([name for _, _, names in os.walk(build) for name in names if name.startswith('libhyco.so')])


if __name__ == '__main__':
    unittest.main()
