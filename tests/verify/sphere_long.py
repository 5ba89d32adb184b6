"""The sphere of sphere.py on a finer mesh. Minutes: ctest -C Long -L verify."""
import unittest

from sphere import Spheres


class Long(Spheres):
    name = 'sphere_long'

    def test_force(self):
        """Steps as the section's; a mesh for each range of w: a contact of fewer cells, or in longer steps, is known less well than the fits differ."""
        for at, judged in (((20, 40), (40,)), ((20, 40, 60, 80), (60, 80))):
            self.judge('3D, 8 cells in the contact', self.forces(8, at, 8, True)[-len(judged):], judged)


if __name__ == '__main__':
    unittest.main()
