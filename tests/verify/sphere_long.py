"""The sphere of sphere.py on a finer mesh. Minutes: ctest -C Long -L verify."""
import unittest

from sphere import Spheres


class Long(Spheres):
    name = 'sphere_long'

    def test_force(self):
        """A mesh for each range of w: a contact of fewer cells is known less well than the fits differ."""
        for at in ((40,), (60, 80)):
            self.judge('3D, 8 cells in the contact', self.forces(8, at, 8, True), at)


if __name__ == '__main__':
    unittest.main()
