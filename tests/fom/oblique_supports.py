"""Supports along any direction: results do not depend on the scene's orientation; a sector of a ring agrees with the ring; models; reactions."""
import os
import sys
import unittest

import h5py
import numpy as np

from common import SOURCE, Case

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import Grid  # noqa: E402

KINDS = {'quad4': 2, 'tri3': 2, 'hex8': 3, 'tet4': 3}
MODEL = """
scene: {mesh: mesh.msh, parameters: [push, press]}
parameter: {push: {range: [0.1, 0.4]}, press: {range: [0, 0.02]}}
body: {block: {young: 200, poisson: 0.3}, seat: {young: 300, poisson: 0.3}}
fixed: {base: {normal: press, direction: {x: -S, y: C}}, wall: {normal: 0, direction: {x: C, y: S}}}
spring: {top: {normal: 2}}
pressure: {top: push*(1 + C*x + S*y)}
contact: {joint: {type: pair, slave: under, master: over, tolerance: 1e-6}}
output: {hold: {reaction: y, group: base}, low: {min: u_y}}
"""


def turning(dim, degrees):
    """Rows: the images of the axes."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.eye(dim)
    turn[:2, :2] = [[c, s], [-s, c]]
    if dim == 3:  # about z, then about x
        turn = turn @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]])
    return turn


class Oblique(Case):
    def box(self, kind, turn, heights=(0, 2), names=('block',)):
        dim, grid = KINDS[kind], Grid()
        for lo, name in zip(heights, names):
            axes = [np.linspace(0, 1, 4)] * (dim - 1) + [np.linspace(lo, lo + heights[1] - heights[0], 4)]
            grid.box(kind, axes, lambda x: x @ turn, name, {f'{a}{e}': f'{a}{e}' for a in 'xyz'[:dim] for e in '01'})
        return grid

    def test_turned(self):
        """A column on a moved base between two planes: uniaxial stress, however it is turned; nodes in two and three planes."""
        E, p, h, moved = 200, 1.5, 2, 0.03
        for kind, ranks in (('quad4', 0), ('tri3', 3), ('hex8', 2), ('tet4', 0)):
            dim, last = KINDS[kind], 'xyz'[KINDS[kind] - 1]
            for degrees in (0, 25, 90):
                turn = turning(dim, degrees)
                planes = ', '.join(f'{a}0: {{normal: {moved if a == last else 0}, direction: {{{", ".join(f"{b}: {v!r}" for b, v in zip("xyz", row.tolist()))}}}}}'
                                   for a, row in zip('xyz', turn))
                plane = ', formulation: plane_stress' if dim == 2 else ''
                text = f'scene: {{mesh: mesh.msh{plane}}}\nbody: {{block: {{young: {E}, poisson: 0.3}}}}\nfixed: {{{planes}}}\npressure: {{{last}1: {p}}}\n'
                with self.subTest(kind=kind, degrees=degrees):
                    found = self.hyco('solve', '-scene', self.written(text, self.box(kind, turn)), '-output', 'out.xdmf', ranks=ranks)
                    self.solved(found)
                    self.assertLess(found['balance'], 1e-9)
                    self.near(found['strain_energy'], p * p * h / 2 / E, 1e-9)
                    np.testing.assert_allclose(found['supports'][f'{last}0']['force'], p * turn[-1], atol=1e-9)
                    with h5py.File(self.path('out.h5')) as f:
                        x, u = (f[name][:, :dim] @ turn.T for name in ('mesh/xyz', 'nodes/displacement'))
                    np.testing.assert_allclose(u[:, -1], moved - p / E * x[:, -1], atol=1e-9)
                    np.testing.assert_allclose(u[:, 0], 0.3 * p / E * x[:, 0], atol=1e-9)

    def test_sector(self):
        """Thirty degrees of a ring under pressure between planes of symmetry: a third of the quarter, to round-off."""
        energy = {}
        for degrees, n in ((90, 12), (30, 4)):
            grid = Grid()
            grid.box('quad4', [np.linspace(1, 2, 7), np.linspace(0, np.radians(degrees), n + 1)],
                     lambda x: np.stack([x[:, 0] * np.cos(x[:, 1]), x[:, 0] * np.sin(x[:, 1])], -1), 'ring', {'x0': 'bore', 'y0': 'y0', 'y1': 'y1'})
            a = np.radians(degrees)
            text = ('scene: {mesh: mesh.msh}\nbody: {ring: {young: 200, poisson: 0.3}}\npressure: {bore: 1 + x^2 + y^2}\n'
                    f'fixed: {{y0: {{y: 0}}, y1: {{normal: 0, direction: {{x: {float(-np.sin(a))!r}, y: {float(np.cos(a))!r}}}}}}}\n')
            for ranks in (0, 2):
                found = self.hyco('solve', '-scene', self.written(text, grid), ranks=ranks)
                self.solved(found)
                self.assertLess(found['balance'], 1e-9)
                energy[degrees] = found['strain_energy']
        self.near(3 * energy[30], energy[90], 1e-9)

    def test_models(self):
        """Contact between turned blocks on oblique planes: every type of model against full order, and that against the scene that is not turned."""
        full = {}
        for degrees in (0, 35):
            turn = turning(2, degrees)
            grid = Grid()
            x = np.linspace(0, 1, 6)
            grid.box('quad4', [x, np.linspace(0, 1, 5)], lambda p, t=turn: p @ t, 'seat', {'y0': 'base', 'y1': 'over', 'x0': 'wall'})
            grid.box('quad4', [x, np.linspace(1, 2, 5)], lambda p, t=turn: p @ t, 'block', {'y0': 'under', 'y1': 'top', 'x0': 'wall'})
            text = MODEL.replace('C*x', f'{float(turn[0, 0])!r}*x').replace('S*y', f'{float(turn[0, 1])!r}*y').replace('-S', repr(-float(turn[0, 1])))
            text = text.replace('y: C', f'y: {float(turn[1, 1])!r}').replace('x: C', f'x: {float(turn[0, 0])!r}').replace('y: S', f'y: {float(turn[0, 1])!r}')
            scene = self.written(text, grid)
            full[degrees] = [self.hyco('solve', '-scene', scene, '-mu', '0.27,0.011', ranks=ranks) for ranks in (0, 2)]
        for a, b in zip(full[0], full[35]):
            for report in (a, b):
                self.solved(report)
                self.assertLess(report['balance'], 1e-9)
            self.near(b['strain_energy'], a['strain_energy'], 1e-8)
            self.near(b['total_contact_force'], a['total_contact_force'], 1e-8)
            self.near(b['lambda_max'], a['lambda_max'], 1e-8)
        for kind, bound in (('hybrid', 0.02), ('projection', 0.01), ('bodies', 5e-3), ('cubature', 0.01)):
            with self.subTest(kind=kind):
                self.hyco('train', '-scene', scene, '-grid', '4,4', '-model', 'm.h5', '-hyco_model_type', kind, '-hyco_pod_tol', 1e-11,
                          *(('-hyco_rid_layers', 1, '-hyco_rid_modes', 'displacement,stress,force,dual') if kind == 'hybrid' else ()))
                for ranks in (0, 2):
                    found = self.hyco('compare', '-scene', scene, '-model', 'm.h5', '-grid', '3,3', ranks=ranks)
                    self.assertLess(found['error_u']['max'], bound)
                model = self.hyco('predict', '-model', 'm.h5', '-mu', '0.27,0.011', '-output', 'model.xdmf')
                for name, value in full[35][0]['outputs'].items():
                    self.near(model['outputs'][name], value, 5 * bound, name)
                with h5py.File(self.path('model.h5')) as f:
                    x, u = (f[name][:, :2] @ turn.T for name in ('mesh/xyz', 'nodes/displacement'))
                np.testing.assert_allclose(u[abs(x[:, 0]) < 1e-9, 0], 0, atol=1e-12)
                np.testing.assert_allclose(u[abs(x[:, 1]) < 1e-9, 1], 0.011, rtol=1e-9)

    def test_refused(self):
        """Directions of supports that vanish, vary or conflict are refused."""
        grid = self.box('quad4', np.eye(2))
        base = 'scene: {mesh: mesh.msh, parameters: [a]}\nparameter: {a: {range: [0, 1]}}\nbody: {block: {young: 200}}\n'
        for text, said in (('fixed: {y0: {normal: 0}}', 'has no direction'), ('fixed: {y0: {direction: {x: 1}}}', 'a direction without a support'),
                           ('fixed: {y0: {normal: 0, direction: {x: a}}}', 'the direction of a support must be constant'), ('fixed: {y0: {normal: 0, direction: {z: 1}}}', 'no component z'),
                           ('fixed: {y0: {x: 0, y: 0}, x0: {normal: 1, direction: {x: 1, y: 1}}}', 'fixed twice along'),
                           ('fixed: {y0: {normal: 0, direction: {y: 1}}, x0: {normal: 0, direction: {x: 0.001, y: 1}}}', 'nearly parallel to that of another support'),
                           ('fixed: {y0: {normal: 0, direction: {x: 0}}}', 'has length zero'),
                           ('fixed: {y0: {normal: 0, direction: {x: 1, y: x}}}\nbody_block_map_x: x + a', 'depends on the position'),
                           ('fixed: {y0: {normal: 0, direction: {x: 1}}}\nhistory: {times: [0, 1]}', 'scenes without a history')):
            for ranks in (0, 2):
                run = self.run_raw('solve', '-scene', self.written(base + text + '\n', grid), '-mu', '0.5', ranks=ranks)
                with self.subTest(text=text, ranks=ranks):
                    self.assertEqual(run.returncode, 1, run.stdout)
                    self.assertEqual(run.stderr.count('hyco: error'), 1, run.stderr)
                    self.assertIn(said, run.stderr)


if __name__ == '__main__':
    unittest.main()
