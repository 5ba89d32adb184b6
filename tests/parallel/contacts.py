"""Contacts on the ranks of their slaves: B, D, forces, fields and tables on 2 to 4 ranks are those of one, for each type; errors give the same line."""
import os
import sys
import unittest

import numpy as np

import distributed
from common import SOURCE, Case

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import Grid  # noqa: E402

RANKS = (2, 3, 4)
HEAD = """
scene: {mesh: mesh.msh, parameters: [press]}
parameter: {press: {range: [0, 1]}}
body: {low: {young: 100, poisson: 0.3}, high: {young: 80, poisson: 0.2MAP}}
fixed: {base: {z: 0}, x0: {x: 0}, y0: {y: 0}, top: {z: -0.02*press}}
"""
SURFACE = HEAD + 'contact: {face: {type: surface, slave: under, master: over}}\n'
PAIR = HEAD + 'contact: {face: {type: pair, slave: under, master: over}}\n'


class Contacts(Case):
    same = distributed.Distributed.same

    def blocks(self, text, n=5, m=7, drawn=1.0, bend=lambda x: x):
        """A block of n x n x 2 cells, and one of m x m x 2 above it; the scene with these."""
        grid = Grid()
        sides = {face: face for face in ('x0', 'x1', 'y0', 'y1')}
        grid.box('hex8', [np.linspace(0, 1, n + 1)] * 2 + [np.linspace(0, 1, 3)], bend, 'low', {**sides, 'z0': 'base', 'z1': 'over'})
        grid.box('hex8', [np.linspace(0, 1, m + 1)] * 2 + [np.linspace(drawn, drawn + 1, 3)], bend, 'high', {**sides, 'z0': 'under', 'z1': 'top'})
        return self.written(text.replace('MAP', ''), grid)

    def test_obstacle(self):
        """Nodes that meet an obstacle whose gap and normal vary."""
        text = HEAD.replace('-0.02*press', '0') + 'contact: {wall: {group: over, normal: {x: 0.1*y, z: 1}, gap: -0.005*press + 0.01*x}}\n'
        self.assertGreater(self.same(self.blocks(text), 1)['n_active'], 5)

    def test_pair(self):
        """Matching nodes, as drawn in contact."""
        self.assertGreater(self.same(self.blocks(PAIR, 6, 6), 1)['n_active'], 20)

    def test_pair_apart(self):
        """Matching nodes of surfaces that do not touch as drawn: matched along the normals."""
        text = PAIR.replace('master: over', 'master: over, tolerance: 0.5, gap: 0.001*x')
        self.assertGreater(self.same(self.blocks(text, 6, 6, 1.4), 1)['n_active'], 20)

    def test_surface(self):
        """Surfaces that do not match, and bend; some slaves face nothing."""
        self.assertGreater(self.same(self.blocks(SURFACE, bend=lambda x: x + 0.1 * np.sin(3 * x[..., [1, 2, 0]])), 1)['n_active'], 20)
        self.same(self.blocks(SURFACE.replace('master: over', 'master: over, tolerance: 0.01'), bend=lambda x: np.where(x[..., 2:] > 1, x + [0.3, 0.2, 0], x)), 1)

    def test_moved(self):
        """A map slides one body over the other by far more than a facet."""
        text = SURFACE.replace('MAP', ", map: {x: 'x + 0.7*press', y: 'y - 0.3*press'}")
        found = self.same(self.blocks(text, 9, 8), 1)
        self.assertGreater(found['n_active'], 5)
        self.assertLess(found['n_facing'], found['n_contacts'])

    def test_smooth(self):
        """A body that can slide and turn, evenly loaded, regularised: normals of the smooth surface."""
        text = SURFACE.replace('base: {z: 0}, x0: {x: 0}, y0: {y: 0}, top: {z: -0.02*press}', 'base: {x: 0, y: 0, z: 0}') + 'pressure: {top: 0.5*press, "x0,x1,y0,y1": 0.1}\n'
        self.assertIn('high', self.same(self.blocks(text), 1, '-hyco_regularise', tolerance=1e-8)['regularised'])

    def test_rigid(self):
        """The slaves of a rigid tool, whose node is on one rank."""
        grid = Grid()
        grid.box('hex8', [np.linspace(0, 1, 8)] * 2 + [np.linspace(0, 1, 3)], lambda x: x, 'low', {'x0': 'x0', 'y0': 'y0', 'z0': 'base', 'z1': 'over'})
        grid.tool('hex8', [np.array([3, 3.2]), np.array([0, 0.2]), np.array([0, 0.2])])
        text = """
scene: {mesh: mesh.msh, parameters: [press]}
parameter: {press: {range: [0, 5]}}
body: {low: {young: 100, poisson: 0.3}, tool: {young: 1}}
fixed: {x0: {x: 0}, y0: {y: 0}, base: {z: 0}, tool: {x: 0, y: 0}}
force: {tip: {z: -press}}
contact: {punch: {type: rigid, slave: over, master: tip, gap: 0.1*(x^2 + y^2)}}
"""
        self.assertGreater(self.same(self.written(text, grid), 1)['n_active'], 3)

    def test_tied(self):
        """Contact on both sides of a tie: tied slaves follow their masters, to which they pass their part of the surface."""
        grid, line = Grid(), lambda a, b, n: np.linspace(a, b, n + 1)
        grid.box('hex8', [line(0, 0.5, 3), line(0, 1, 4), line(0, 1, 2)], lambda x: x, 'left', {'x1': 'seam', 'z0': 'base', 'z1': 'over'})
        grid.box('hex8', [line(0.5, 1, 4), line(0, 1, 6), line(0, 1, 3)], lambda x: x, 'right', {'x0': 'glued', 'z0': 'base', 'z1': 'over'})
        text = """
scene: {mesh: mesh.msh, parameters: [press]}
parameter: {press: {range: [0, 1]}}
body: {left: {young: 100, poisson: 0.3}, right: {young: 100, poisson: 0.3}}
fixed: {base: {x: 0, y: 0, z: 0}}
tie: {glue: {slave: glued, master: seam}}
contact: {wall: {group: over, normal: {z: 1}, gap: -0.01*press*(1 + x)}}
"""
        self.assertGreater(self.same(self.written(text, grid), 1)['n_active'], 20)

    def test_errors(self):
        """Errors that a rank alone finds, or that none finds alone: one line, the same on any number of ranks."""
        cases = {
            'faces nothing': (SURFACE.replace('master: over', 'master: base'), {}),
            'too far': (SURFACE, {'drawn': 1.3}),
            'two slaves of a node': (PAIR, {'n': 4, 'm': 6}),
            'overlap': (SURFACE.replace('MAP', ", map: {z: 'z - 0.3*press'}"), {}),
            'parallel': (SURFACE.replace('over}', 'over}, wall: {group: under, normal: {z: -1}, gap: 0}'), {}),
            'no normal': (SURFACE.replace('master: over', 'master: over, normal: {x: 0*x}'), {}),
            'penetrates': (SURFACE.replace('base: {z: 0}', 'base: {z: 0}, over: {x: 0, y: 0, z: 0}, under: {x: 0, y: 0, z: -0.01}'), {}),
            'shared': (SURFACE.replace('slave: under', 'slave: over'), {}),
        }
        for k, (name, (text, more)) in enumerate(cases.items()):
            scene, said = self.blocks(text, **more), []
            for ranks in (0, RANKS[k % len(RANKS)]):
                run = self.run_raw('solve', '-scene', scene, '-mu', 1, ranks=ranks)
                self.assertEqual(run.returncode, 1, name + run.stdout)
                said.append([line for line in run.stderr.splitlines() if 'error: ' in line])
            with self.subTest(name=name):
                self.assertEqual([len(lines) for lines in said], [1] * len(said), said)
                self.assertEqual(said[1], said[0])
                self.assertIn('contact', said[0][0])


if __name__ == '__main__':
    unittest.main()
