"""Prandtl's punch: a smooth flat die of half-width 1 pressed into a half plane, perfectly plastic, von Mises, plane strain:
the mean pressure levels off at (2 + pi) k = (2 + pi) Y / sqrt(3) = 2.968500 Y (R. Hill, The Mathematical Theory of Plasticity,
1950, chapter 9). Standard quadrilaterals, which cannot flow without a change of volume, climb past it without limit; bbar,
the default where a law flows, levels off (J. C. Nagtegaal, D. M. Parks, J. R. Rice, Comput. Methods Appl. Mech. Engrg. 4 (1974)
153-177). The die is an obstacle that comes down; its force counts half of the element beside it too.
"""
import csv
import unittest

import numpy as np

from grids import Grid, graded
from verify import Verify

SCENE = """
scene: {title: punch, mesh: mesh.msh}
body: {block: {young: 1e5, poisson: 0.3, %slaw: {type: j2, yield: 100}}}
fixed: {x0: {x: 0}, x1: {x: 0}, y0: {x: 0, y: 0}}
contact: {tool: {type: obstacle, group: punch, normal: {y: 1}, gap: "-0.03*t"}}
history: {times: [0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1]}
hyco: {step_inelastic: 0.05}
"""
LIMIT = 100 * (2 + np.pi) / np.sqrt(3)


class Punch(Verify):
    name = 'punch'

    def pressures(self, fine, element):
        """The mean pressure at 0.8 and at 1 of the way; the block is 5 wide and 4 deep, finest at the die's edge."""
        inside = 1 - graded(fine, fine, 1, 1.25)[::-1]
        grid = Grid()
        grid.box('quad4', [np.concatenate([inside, 1 + graded(fine, fine, 4, 1.25)[1:]]),
                           -graded(2 * fine, 4 * fine, 4, 1.25)[::-1]], lambda x: x, 'block',
                 {'x0': 'x0', 'x1': 'x1', 'y0': 'y0', 'y1': ('punch', len(inside) - 1)})
        self.hyco('solve', '-scene', self.scene(SCENE % element, grid), '-table', self.path('t.csv'), timeout=200)
        with open(self.path('t.csv'), encoding='utf-8', newline='') as f:
            return [float(row['total_contact_force']) for row in csv.DictReader(f)][-2:]

    def test_limit(self):
        """The mean pressure is the limit, and does not grow any more."""
        for fine, bound in ((0.05, 3), (0.025, 2)):
            before, last = self.pressures(fine, '')
            self.row(f'mean pressure, bbar, elements of {fine} at the edge', last, LIMIT, bound)
            self.row(f'what the last fifth of the way adds, over the pressure, {fine}', (last - before) / LIMIT, 0, 1e-3)

    def test_standard(self):
        """Not a requirement: shows what the default prevents."""
        before, last = self.pressures(0.05, 'element: standard, ')
        self.row('mean pressure, standard element, over the limit', last / LIMIT, 1.1, 0, least=True)
        self.row('what the last fifth of the way adds', (last - before) / LIMIT, 0.01, 0, least=True)


if __name__ == '__main__':
    unittest.main()
