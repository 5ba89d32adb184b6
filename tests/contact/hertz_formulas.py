"""examples/hertz compared with Hertz's formulas (K. L. Johnson, Contact Mechanics, 1985, section 4.2c), at the force of the
solution: a^2 = 4 F R/(pi E*), p = p0 sqrt(1 - x^2/a^2), p0 = 2 F/(pi a); tests/verify/hertz.py tests the orders."""
import os
import unittest

import h5py
import numpy as np

from common import SOURCE, Case

HERTZ = os.path.join(SOURCE, 'examples', 'hertz')


class Hertz(Case):
    def test_half_width_and_pressure(self):
        """Over the corners of the ranges: the half-width from the forces' second moment, F a^2/4, and the peak of the profile that
        fits the nodes' pressures. Bodies of 20 half-widths and straight triangles: percents."""
        for press, stiffness, radius in ((0.02, 0.5, 8), (0.02, 2, 12.5), (0.06, 1, 10), (0.1, 0.5, 12.5), (0.1, 2, 8)):
            with self.subTest(press=press, stiffness=stiffness, radius=radius):
                self.solved(self.hyco('solve', '-scene', HERTZ, '-mu', f'{press},{stiffness},{radius}', '-output', 'h.xdmf'))
                with h5py.File(self.path('h.h5')) as f:
                    force, pressure = f['nodes/contact_force'][:], f['nodes/contact_pressure'][:].ravel()
                    x, nodes = f['mesh/xyz'][:, 0], len(f['mesh/xyz'])
                self.assertTrue(1000 <= nodes <= 2000, nodes)
                slave = force[:, 1] > 0
                x, force, pressure = x[slave], force[slave, 1], pressure[slave]
                modulus, curvature = 1e4 / (1 - 0.3**2) / (1 + 1 / stiffness), 1 / radius + 1 / 10
                total = 2 * force.sum()
                a = np.sqrt(4 * total / curvature / np.pi / modulus)
                self.near(np.sqrt(4 * (force @ x**2) / force.sum()), a, 0.015, 'half-width')
                inside = x < 0.9 * a
                profile = np.sqrt(1 - (x[inside] / a)**2)
                self.near(pressure[inside] @ profile / (profile @ profile), 2 * total / np.pi / a, 0.03, 'peak pressure')


if __name__ == '__main__':
    unittest.main()
