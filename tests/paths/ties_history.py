"""Ties in scenes with a history: a ring of two tied halves that creeps, compared with the ring of one mesh; its models."""
import os
import sys
import unittest

import numpy as np

from common import SOURCE, Case, msh

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import LINEAR, Grid, second  # noqa: E402

SCENE = """
scene: {mesh: MESH, parameters: [push, creep]}
parameter: {push: {range: [8, 12]}, creep: {range: [0.5, 2]}}
body: {BODIES}
fixed: {y0: {y: 0}, y1: {x: 0.001*q}}
pressure: {bore: push*q}
contact: {stop: {group: bore, gap: "GAP"}}
history: {times: [0, 1, 3, 6, 7], tables: {q: [[0, 0], [1, 1], [6, 1], [7, -1]]}}
hyco: {substeps: 1}
output: {hold: {reaction: y, group: y0}, wall: {reaction: x, group: y1}, least: {min: u_y}, carried: {force: y}, peak: {max: contact_pressure}}
"""
NORTON, ELASTIC = '{law: norton, young: 1e4, poisson: 0.3, rate: 1e-7*creep, exponent: 3}', '{young: 1e4, poisson: 0.3}'
COLUMNS = ('total_contact_force', 'n_active', 'inelastic', 'mises', 'stored', 'dissipated')


class TiesHistory(Case):
    @classmethod
    def ring(cls, name, *parts, kind='quad4'):
        """A quarter of a ring, in parts of so many cells around each."""
        grid = Grid()
        ends = np.linspace(0, np.pi / 2, len(parts) + 1)
        for k, (n, layers) in enumerate(parts):
            sides = {'y0': 'y0' if k == 0 else 'cut', 'y1': 'y1' if k + 1 == len(parts) else 'end', 'x0': 'bore'}
            grid.box(LINEAR.get(kind, kind), [np.linspace(1, 2, layers + 1), np.linspace(ends[k], ends[k + 1], n + 1)], lambda x: x, 'ab'[k], sides)
        nodes, *cells = second(grid, kind) if kind in LINEAR else (grid.nodes, grid.elements, grid.names)
        msh(cls.path(name + '.msh'), [(r * np.cos(t), r * np.sin(t), z) for r, t, z in nodes], *cells)

    @classmethod
    def scene(cls, name, bodies, tie='', gap='0.0003 + 0.0005*x'):
        text = SCENE.replace('MESH', name.split('-')[0] + '.msh').replace('BODIES', bodies).replace('GAP', gap)
        with open(cls.path(name + '.yaml'), 'w', encoding='ascii') as f:
            f.write(text + tie)
        return cls.path(name + '.yaml')

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.ring('one', (6, 3))
        cls.ring('two', (3, 3), (3, 3))
        cls.ring('loose', (3, 3), (4, 4))
        cls.tied = cls.scene('two', f'a: {NORTON}, b: {NORTON}', 'tie: {glue: {slave: end, master: cut}}\n')

    def histories(self, scene, *more, ranks=0):
        found = self.hyco('solve', '-scene', scene, '-mu', '10,1.2', *more, ranks=ranks)
        self.assertLess(max(found['history']['energy_defect']), 1e-8)
        self.assertLess(found['balance'], 1e-8)
        return found['history']

    def alike(self, found, expected, relative):
        for name in COLUMNS:
            np.testing.assert_allclose(found[name], expected[name], rtol=0, atol=relative * np.abs(expected[name]).max() + 1e-300, err_msg=name)
        for name, values in expected['outputs'].items():
            np.testing.assert_allclose(found['outputs'][name], values, rtol=0, atol=relative * np.abs(values).max(), err_msg=name)

    def test_one_mesh(self):
        """Halves whose meshes match are one ring, whichever is the slave, on any number of ranks, by any Newton's method."""
        one = self.histories(self.scene('one', f'a: {NORTON}'))
        self.assertGreater(one['inelastic'][-1], 1e-5)
        self.assertGreater(max(one['n_active']), 0)
        for args, ranks in (((), 0), ((), 2), ((), 3), (('-hyco_newton', 'elastic'), 0), (('-tie_glue_slave', 'cut', '-tie_glue_master', 'end'), 2)):
            self.alike(self.histories(self.tied, *args, ranks=ranks), one, 1e-7)

    def test_others(self):
        """A half that does not flow, tied either way; meshes that do not match, nearly."""
        bodies, back = f'a: {NORTON}, b: {ELASTIC}', ('-tie_glue_slave', 'cut', '-tie_glue_master', 'end')
        scene = self.scene('two-mixed', bodies, 'tie: {glue: {slave: end, master: cut}}\n')
        self.alike(self.histories(scene, *back), self.histories(scene), 1e-7)
        loose = self.histories(self.scene('loose', f'a: {NORTON}, b: {NORTON}', 'tie: {glue: {slave: cut, master: end}}\n'))
        matched = self.histories(self.tied)
        for name in ('stored', 'dissipated'):
            np.testing.assert_allclose(loose[name], matched[name], atol=0.1 * max(matched[name]), err_msg=name)

    def test_quadratic(self):
        """Cells of second order: halves that match are one ring; where the slave divides the master, nearly. A model of the whole mesh is exact."""
        gap = '0.00001 + 0.0001*x'
        for kind in ('tri6', 'quad8'):
            self.ring(f'{kind}one', (4, 2), kind=kind)
            self.ring(f'{kind}two', (2, 2), (2, 2), kind=kind)
            self.ring(f'{kind}finer', (2, 2), (2, 4), kind=kind)
            one = self.histories(self.scene(f'{kind}one', f'a: {NORTON}', gap=gap))
            self.assertGreater(max(one['n_active']), 0)
            tie = 'tie: {glue: {slave: cut, master: end}}\n'
            scene = self.scene(f'{kind}two', f'a: {NORTON}, b: {NORTON}', tie, gap)
            with self.subTest(kind=kind):
                for args, ranks in (((), 0), ((), 2), (('-tie_glue_slave', 'end', '-tie_glue_master', 'cut'), 3)):
                    self.alike(self.histories(scene, *args, ranks=ranks), one, 1e-7)
                scene = self.scene(f'{kind}finer', f'a: {NORTON}, b: {NORTON}', tie, gap)
                finer = self.histories(scene)
                for name in ('stored', 'dissipated'):
                    np.testing.assert_allclose(finer[name], one[name], atol=0.01 * max(one[name]), err_msg=name)
                self.hyco('train', '-scene', scene, '-model', f'{kind}.h5', '-grid', '1,1', '-hyco_rid_whole', '-hyco_hybrid', 'all')
                found = self.hyco('predict', '-model', f'{kind}.h5', '-mu', '10,1.2', '-hyco_residual')
                self.assertLess(found['equilibrium']['worst'], 1e-7)
                for name, values in finer['outputs'].items():
                    np.testing.assert_allclose(found['history']['outputs'][name], values, atol=1e-7 * np.abs(values).max(), err_msg=name)

    def test_models(self):
        """Of the whole mesh exact; on an RID, by projection and by regression nearly; their fields and residual by replay."""
        bodies = f'a: {NORTON}, b: {ELASTIC}'
        scene = self.scene('loose-models', bodies, 'tie: {glue: {slave: cut, master: end}}\n')
        full = self.histories(scene)
        train = ('train', '-scene', scene, '-model', 'm.h5', '-hyco_snapshots', 'kinds')
        self.hyco(*train, '-grid', '1,1', '-hyco_rid_whole', '-hyco_hybrid', 'all')
        found = self.hyco('predict', '-model', 'm.h5', '-mu', '10,1.2', '-hyco_residual')
        self.assertLess(found['equilibrium']['worst'], 1e-7)
        for name, values in full['outputs'].items():
            np.testing.assert_allclose(found['history']['outputs'][name], values, atol=1e-7 * np.abs(values).max(), err_msg=name)
        for kind, more, bound in (('hybrid', ('-hyco_rid_layers', 1), 0.02), ('projection', (), 0.03), ('regression', (), 0.05)):
            with self.subTest(kind=kind):
                self.hyco(*train, '-grid', '3,3', '-hyco_model_type', kind, '-hyco_pod_tol', 1e-10, *more, ranks=2 if kind == 'hybrid' else 0)
                report = self.hyco('compare', '-scene', scene, '-model', 'm.h5', '-mu', '10,1.2')
                self.assertLess(report['worst_u']['max'], bound)
                self.assertLess(report['worst_inelastic']['max'], 3 * bound)
                self.hyco('predict', '-model', 'm.h5', '-mu', '10,1.2', '-output', 'fields.xdmf')
        run = self.run_raw(*train, '-grid', '3,3', '-hyco_model_type', 'cubature')
        self.assertEqual(run.returncode, 1)
        self.assertIn('ties', run.stderr)


if __name__ == '__main__':
    unittest.main()
