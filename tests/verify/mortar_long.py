"""Spheres in contact by mortars on an axisymmetric mesh: half a minute (the cylinders of mortar.py are in the usual tests)."""
import unittest

from mortar import Hertz


class Long(Hertz):
    name = 'mortar_spheres'

    def test_spheres(self):
        """The meshes of the cylinders, turned about the axis."""
        self.compare('axisymmetric spheres', 'quad4', ((11, 16), (22, 16), (24, 16)), 1.5e-4, 1, ', formulation: axisymmetric')


if __name__ == '__main__':
    unittest.main()
