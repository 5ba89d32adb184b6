"""The energy identity 2 W = work - sum(lambda D): Clapeyron's theorem (Timoshenko and Goodier, Theory of Elasticity,
3rd ed. 1970, chapter 8) with contact, where lambda (D - B U) = 0 makes the contact forces' work the sum of lambda D.
The work counts loads and supports that move. It holds to round-off on every mesh; on a column in uniaxial strain each
term has its closed form.
"""
import os
import subprocess
import unittest

import numpy as np

from common import HYCO, PATIENCE, PELLET, SOURCE
from grids import Grid
from verify import Verify

PROGRAM = os.path.join(os.path.dirname(HYCO), 'tests', 'test_energy')
STEPS = [k / 25 for k in range(1, 26)]
COLUMN = """
scene: {title: column, mesh: mesh.msh}
body: {column: {young: 100, poisson: 0.3}}
fixed: {foot: {y: 0.02}, left: {x: 0}, right: {x: 0}}
pressure: {head: -5}
contact: {roof: {type: obstacle, group: head, normal: {y: 1}, gap: 0.01}}
"""


def ramp(scene, points, *options):
    """Rows of (active contacts, W, external work, gap work, defect)."""
    command = [PROGRAM, scene, *(','.join(map(str, p)) for p in points), *options]
    run = subprocess.run(command, capture_output=True, text=True, timeout=100 * PATIENCE, check=False)
    if run.returncode:
        raise AssertionError(f'{" ".join(command)} ended with {run.returncode}:\n{run.stderr}')
    return np.array([[float(v) for v in line.split()] for line in run.stdout.splitlines()])


class Energy(Verify):
    name = 'energy'

    def ramp(self, title, radius, *options):
        table = ramp(PELLET, [(radius, load) for load in STEPS], *options)
        self.assertEqual(len(table), 25)
        self.assertGreater(table[-1, 0], 0)
        self.row(f'{title}, radius {radius}, 25 steps: largest defect', table[:, 4].max(), 0, 1e-10)

    def test_pellet(self):
        """The energy identity of the pellet, for several radii and meshes."""
        for radius in (4.02, 4.06, 4.1):
            self.ramp('pellet A', radius)
        self.ramp('pellet B', 4.06, '-scene_mesh', os.path.join(PELLET, 'B.msh'))

    def test_supports_that_move(self):
        """Prescribed displacements everywhere: on contact nodes and off them, with loads, on several ranks."""
        pellet = ('-fixed_sym_z0_z', '0.01', '-fixed_pellet_top_z', '-0.05', '-fixed_sym_x0_x', '0.003')
        for scene, mu, moved, ranks in (('pellet', '4.06,1', pellet, 1), ('pellet', '4.06,1', pellet, 3),
                                        ('blocks', '0.05,0.06', ('-fixed_block_sym_x', '0.01'), 1),
                                        ('rope', '0.07,0.17', ('-fixed_ends_x', '-0.02'), 1),
                                        ('plate', '0.5,0.5', ('-fixed_sym_x0_x', '0.01*y'), 1)):
            path = os.path.join(SOURCE, 'examples', scene)
            report, _ = self.solve(path, '-mu', mu, *moved, ranks=ranks)
            self.assertEqual(report['n_active'] > 0, scene != 'plate')
            self.row(f'{scene}, supports moved, ranks: {ranks}: defect', report['energy_defect'], 0, 1e-10)

    def test_column(self):
        """[0, 2] x [0, 1], foot lifted by s, head pulled by p against a roof at g: strain (g - s), modulus M."""
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 2, 5), np.linspace(0, 1, 4)], lambda x: x, 'column',
                 {'x0': 'left', 'x1': 'right', 'y0': 'foot', 'y1': 'head'})
        report, _ = self.solve(self.scene(COLUMN, grid))
        s, g, p, width, modulus = 0.02, 0.01, 5, 2, 100 * 0.7 / 1.3 / 0.4
        self.row('column: strain energy', report['strain_energy'], width * modulus * (g - s)**2 / 2, 1e-8)
        self.row('column: external work', report['external_work'], width * (p * g + modulus * (s - g) * s), 1e-8)
        self.row('column: gap work', report['gap_work'], width * (p + modulus * (s - g)) * g, 1e-8)


if __name__ == '__main__':
    unittest.main()
