"""Thick cylinders under inner pressure, plane strain, quarter, quadrilaterals.

Elastic, perfectly plastic (a = 100, b = 200, E = 210000, nu = 0.3, Y = 240, von Mises): the outer surface's displacement at
p = 100, 140, 180, 190, in the limit of small steps, by integration of the one-dimensional problem; the textbook's formula of
Hill, for Tresca's flow and an incompressible solid, is 2 % off.

Steady creep, rate A s^n (R. W. Bailey 1935; J. T. Boyle, J. Spence, Stress Analysis for Creep, 1983, chapter 4):
D = (b/a)^(2/n) - 1, f = (b/r)^(2/n): s_r = p (1 - f)/D, s_t = p (1 + (2 - n) f/n)/D,
du/dt = (sqrt(3)/2) A (sqrt(3) p/(n D))^n b^2/r.

Maxwell's solid, code_aster's SSNA104: a = 1, b = 2, E = 1, nu = 0.3, rate (3/2) s, p = 1e-3: at b and t = 0.9
u = 2.14498e-3, s_zz = 2.7912e-4, s_t = 6.6667e-4.
"""
import math
import unittest

import numpy as np

from grids import Grid
from ring import polar
from verify import Verify, order, read_step

SCENE = """
scene: {{title: thick cylinder, mesh: mesh.msh}}
body: {{tube: {{{law}}}}}
fixed: {{x0: {{x: 0}}, y0: {{y: 0}}}}
pressure: {{inside: {pressure}}}
history: {{times: [{times}], tables: {{p: [{table}]}}}}
"""


class Cylinder(Verify):
    name = 'cylinder'

    def tube(self, a, b, n):
        grid = Grid()
        grid.box('quad4', [np.geomspace(a, b, n + 1), np.linspace(0, np.pi / 2, 2 * n + 1)], polar, 'tube',
                 {'x0': 'inside', 'x1': 'outside', 'y0': 'y0', 'y1': 'x0'})
        return grid

    def path_of(self, mesh, law, times, table, *args):
        scene = self.scene(SCENE.format(law=law, pressure='p', times=', '.join(f'{t:.12g}' for t in times), table=table), mesh)
        report = self.hyco('solve', '-scene', scene, '-output', self.path('out.xdmf'), *args)
        h = report['history']
        self.assertTrue(h['ended'])
        self.assertLess(max(h['kkt_max']), 1e-8)
        self.assertLess(max(h['energy_defect']), 1e-8)
        return h, [read_step(self.path('out.h5'), k) for k in range(len(times))]

    def outside(self, out, b):
        """The mean radial displacement of the outer surface."""
        x = out['mesh/xyz']
        on = abs(np.hypot(x[:, 0], x[:, 1]) - b) < 1e-6 * b
        return float(np.mean(np.einsum('ij,ij->i', out['nodes/displacement'][on, :2], x[on, :2]) / b))

    def test_perfectly_plastic(self):
        """Perfectly plastic: displacement at given pressures."""
        exact = {100: .0577778, 140: .087287, 180: .154016, 190: .205348}
        h, out = self.path_of(self.tube(100, 200, 48), 'law: j2, young: 210000, poisson: 0.3, yield: 240',
                              [0, *exact], '[0, 0], [200, 200]', '-hyco_substeps', '20', '-hyco_newton', 'tangent')
        for k, (p, u) in enumerate(exact.items()):
            self.row(f'perfectly plastic, p = {p}: displacement of the outer surface', self.outside(out[k + 1], 200), u, 0.1)
        self.row('perfectly plastic: order of Newton\'s method', h['newton_order'], 2, 20, least=True)
        self.assertLessEqual(max(h['most_iterations']), 8)

    def test_steady_creep(self):
        """Steady creep by Norton's law: rate of the displacement, stresses."""
        a, b, p, rate = 1, 2, 1e-3, 1.0
        for n, A in ((3, 1e6), (5, 1e12)):
            D = (b / a)**(2 / n) - 1
            exact = math.sqrt(3) / 2 * A * (math.sqrt(3) * p / (n * D))**n * b
            end = 60 * p / exact * 10
            found, sizes = [], (8, 16, 32)
            for m in sizes:
                _, out = self.path_of(self.tube(a, b, m), f'law: norton, young: 1, poisson: 0.3, rate: {A:g}, exponent: {n}',
                                      [0, 0.999 * end, end], f'[0, {p}]', '-hyco_step_inelastic', '1e-2')
                found.append((self.outside(out[2], b) - self.outside(out[1], b)) / (0.001 * end))
            self.row(f'steady creep, n = {n}: rate of the outer surface', found[-1], exact, 0.1)
            self.row(f'steady creep, n = {n}: order', order(1 / np.array(sizes), abs(np.array(found) - exact)), 2, 10)

    def test_maxwell(self):
        """A Maxwell material: displacement and stresses in time."""
        _, out = self.path_of(self.tube(1, 2, 32), 'law: norton, young: 1, poisson: 0.3, rate: 1, exponent: 1',
                              [0, 0.9], '[0, 1e-3]', '-hyco_substeps', '200')
        self.row('SSNA104: displacement of the outer surface', self.outside(out[1], 2), 2.14498e-3, 0.1)
        centre = out[1]['mesh/xyz'][out[1]['mesh/cells']].mean(axis=1)
        r = np.hypot(centre[:, 0], centre[:, 1])
        radii = np.unique(np.round(r, 9))[-2:]  # the two outer layers, by which the surface's value is extrapolated
        mean = [[float(np.mean(v[abs(r - q) < 1e-6])) for q in radii] for v in (out[1]['cells/stress'][:, 5], self.hoop(out[1], centre))]
        share = (2 - radii[0]) / (radii[1] - radii[0])
        for what, v, exact in (('s_zz', mean[0], 2.7912e-4), ('s_t', mean[1], 6.6667e-4)):
            self.row(f'SSNA104: {what} of the outer surface', v[0] + share * (v[1] - v[0]), exact, 0.1)

    def hoop(self, out, centre):
        s = out['cells/stress']
        angle = np.arctan2(centre[:, 1], centre[:, 0])
        cos, sin = np.cos(angle), np.sin(angle)
        return sin**2 * s[:, 0] - 2 * sin * cos * s[:, 1] + cos**2 * s[:, 3]


if __name__ == '__main__':
    unittest.main()
