"""The sphere of sphere.py on a finer mesh. Minutes: ctest -C Long -L verify."""
import unittest

from sphere import Spheres


class Long(Spheres):
    name = 'sphere_long'

    def test_force(self):
        self.judge(8, (40, 60, 80), 8)


if __name__ == '__main__':
    unittest.main()
