"""A rigid body under a given force: agrees with the obstacle displaced by its motion, and with Hertz; in models, over time; refusals."""
import os
import sys
import unittest

import numpy as np

from common import SOURCE, Case

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import Grid  # noqa: E402

SCENE = """
scene: {mesh: mesh.msh, parameters: [load, radius]}
parameter: {load: {range: [5, 30]}, radius: {range: [8, 12]}}
body: {block: {LAW}, tool: {young: 1}}
fixed: {sym: {x: 0}, base: {y: 0}, tool: {x: 0}}
force: {tip: {y: FORCE}}
contact: {punch: {type: rigid, slave: top, master: tip, gap: x^2/(2*radius)}}
output: {depth: {min: u_y, group: tip}, push: {force: y, contact: punch}}
"""
ELASTIC, NORTON = 'young: 1000, poisson: 0.3', 'law: norton, young: 1000, poisson: 0.3, rate: 1e-5, exponent: 2'
MODULUS = 1000 / 0.91


class Rigid(Case):
    @classmethod
    def mesh(cls, size=4., n=16, grading=1.5, kind='quad4'):
        """A block under the line y = 0, and a cell beside it whose first node is the group tip."""
        grid, axis = Grid(), size * np.linspace(0, 1, n + 1)**grading
        grid.box(kind, [axis, -axis[::-1]], lambda x: x, 'block', {'x0': 'sym', 'y0': 'base', 'y1': 'top'})
        grid.tool(kind, [np.array([1.5, 1.6]) * size, np.array([0, 0.1]) * size])
        grid.write(cls.path('mesh.msh'))

    @classmethod
    def scene(cls, name='scene.yaml', law=ELASTIC, force='-load', more='', **changes):
        return cls.changed(name, SCENE.replace('LAW', law).replace('FORCE', force) + more, changes.values())

    def test_moved_obstacle(self):
        """The contact has the load, and the solution is that under the obstacle displaced by the body's motion, on any number of ranks."""
        self.mesh()
        scene = self.scene()
        given = self.scene('given.yaml', obstacle=('type: rigid, slave: top, master: tip, gap: x^2/(2*radius)', 'group: top, gap: x^2/(2*radius) - depth'),
                           held=('tool: {x: 0}', 'tool: {x: 0, y: 0}'), named=('[load, radius]', '[depth, radius]'), output=('depth: {min: u_y, group: tip}, ', ''), loads=('force: {tip: {y: -load}}', ''),
                           ranges=('load: {range: [5, 30]}', 'depth: {range: [0, 1]}'))
        reports = [self.hyco('solve', '-scene', scene, '-mu', '20,10', *more, ranks=ranks) for ranks, more in ((0, ()), (2, ()), (3, ()), (0, ('-hyco_linear', 'iterative')))]
        for found in reports:
            self.solved(found)
            self.near(found['contacts']['punch']['force'][1], -20, 1e-9)
            self.near(found['outputs']['depth'], reports[0]['outputs']['depth'], 1e-8)
            self.assertLess(found['balance'], 1e-9)
        moved = self.hyco('solve', '-scene', given, '-mu', f'{-reports[0]["outputs"]["depth"]:.17g},10')
        for name in ('strain_energy', 'lambda_max', 'n_active', 'total_contact_force'):
            self.near(reports[0][name], moved[name], 1e-9, name)
        slides = self.hyco('solve', '-scene', self.scene(along=('tool: {x: 0}', 'tool: {normal: 0, direction: {x: 1, y: 1}}')), '-mu', '20,10')
        self.near(slides['outputs']['depth'], reports[0]['outputs']['depth'], 1e-8)  # down a slope without friction, as deep

    def test_hertz(self):
        """A cylinder's half-width and pressure under a line load, a sphere's radius, pressure and depth under a force."""
        self.mesh(n=32)
        punch = self.hyco('solve', '-scene', self.scene(), '-mu', '20,10')['contacts']['punch']
        width = np.sqrt(4 * 40 * 10 / np.pi / MODULUS)  # both halves carry 40
        self.near(punch['pressure_max'], 2 * 40 / np.pi / width, 0.02)
        self.near(punch['area'], width, 0.12)  # by whole nodes, which lie 0.1 apart there
        self.mesh(size=16., n=40, grading=2.2)
        found = self.hyco('solve', '-scene', self.scene(round=('mesh: mesh.msh', 'mesh: mesh.msh, formulation: axisymmetric')), '-mu', '30,10')
        radius = (3 * 30 * 10 / 4 / MODULUS)**(1 / 3)
        self.near(found['contacts']['punch']['force'][1], -30, 1e-9)
        self.near(found['contacts']['punch']['pressure_max'], 1.5 * 30 / np.pi / radius**2, 0.03)
        self.near(-found['outputs']['depth'], radius**2 / 10, 0.05)  # of a half space; the block is 16 by 16

    def test_models(self):
        """The body's whole surface is in the RID, and its motion is an unknown of the model: load and depth at unseen points."""
        self.mesh()
        scene = self.scene(mixed=('poisson: 0.3', 'poisson: 0.3 + 0.01*(radius - 10)'))
        for kind, more, bound in (('hybrid', ('-hyco_rid_layers', 1), 1e-3), ('cubature', (), 1e-3), ('projection', (), 0.02), ('regression', (), 0.02)):
            with self.subTest(kind=kind):
                trained = self.hyco('train', '-scene', scene, '-grid', '5,4', '-model', 'm.h5', '-hyco_model_type', kind, '-hyco_pod_tol', 1e-12,
                                    '-hyco_snapshots', 'kinds', *more, ranks=2 if kind == 'hybrid' else 0)
                found = self.hyco('compare', '-scene', scene, '-model', 'm.h5', '-grid', '3,3')
                self.assertLess(found['error_u']['max'], bound)
                if kind in ('hybrid', 'cubature'):
                    self.assertLess(found['error_lambda']['max'], 10 * bound)
                    self.assertLess(trained['rid_fraction'], 0.8)
                full, model = (self.hyco(*args, '-mu', '17,9.3')['outputs'] for args in (('solve', '-scene', scene), ('predict', '-model', 'm.h5')))
                self.near(model['depth'], full['depth'], bound)
                if kind != 'projection':  # whose force vectors need not balance
                    self.near(model['push'], -17, 0.05 if kind == 'regression' else 1e-6)

    def test_triangles(self):
        """Cells that touch the surface only in a node are in the RID too."""
        self.mesh(n=10, kind='tri3')
        scene = self.scene()
        trained = self.hyco('train', '-scene', scene, '-grid', '3,3', '-model', 't.h5', '-hyco_rid_layers', 1)
        self.assertLess(trained['rid_fraction'], 0.6)
        full, model = (self.hyco(*args, '-mu', '17,9.3')['outputs'] for args in (('solve', '-scene', scene), ('predict', '-model', 't.h5')))
        for name, value in full.items():
            self.near(model[name], value, 1e-3, name)

    def test_history(self):
        """The body sinks into a block that creeps; its load stays. A model of the path."""
        self.mesh(n=8)
        scene = self.scene('creep.yaml', NORTON, '-load*q', 'history: {times: [0, 1, 2, 4], tables: {q: [[0, 0.1], [1, 1]]}}\n')
        full = self.hyco('solve', '-scene', scene, '-mu', '20,10')['history']['outputs']
        self.near(full['push'][0], -2, 1e-8)
        for push in full['push'][1:]:
            self.near(push, -20, 1e-8)
        self.assertLess(full['depth'][3], 1.05 * full['depth'][1])  # both are negative
        self.hyco('train', '-scene', scene, '-model', 'creep.h5', '-grid', '3,3', '-hyco_pod_tol', 1e-12, '-hyco_rid_layers', 1)
        model = self.hyco('predict', '-model', 'creep.h5', '-mu', '20,10')['history']['outputs']
        np.testing.assert_allclose(model['push'], full['push'], rtol=1e-6)
        np.testing.assert_allclose(model['depth'], full['depth'], rtol=2e-2)

    def test_pulled_away(self):
        """A load that lifts it off: no equilibrium, by either form, in tables, trainings and histories."""
        self.mesh()
        signs = {'both': ('load: {range: [5, 30]}', 'load: {range: [-30, 30]}')}
        scene, what = self.scene(**signs), 'no support keeps body tool from moving along (0, 1, 0)'
        creep = self.scene('creep.yaml', NORTON, '-load*q', 'history: {times: [0, 1, 2], tables: {q: [[0, 0.1], [1, 1], [2, -1]]}}\n', **signs)
        for name, point, more, ranks, says in ((scene, '-20,10', (), 0, 'nothing was written'), (scene, '-20,10', (), 2, 'nothing was written'),
                                               (scene, '-20,10', ('-hyco_solver_form', 'primal'), 0, 'nothing was written'), (creep, '-20,10', (), 0, 'at the first time'),
                                               (creep, '20,10', (), 0, 'the history ends at t = 1.5')):  # q is 0 there
            run = self.run_raw('solve', '-scene', name, '-mu', point, *more, ranks=ranks)
            with self.subTest(scene=os.path.basename(name), point=point, more=more, ranks=ranks):
                self.assertEqual((run.returncode, run.stderr.count('hyco: error')), (1, 1), run.stdout + run.stderr)
                self.assertIn(what, run.stderr)
                self.assertIn(says, run.stderr)
        run = self.run_raw('solve', '-scene', scene, '-values_load', '-20,10,20', '-values_radius', 10, '-table', 'lifted.csv')
        self.assertEqual(run.returncode, 1)
        with open(self.path('lifted.csv'), encoding='ascii') as f:
            head, *rows = (line.strip().split(',') for line in f)
        self.assertEqual([row[head.index('converged')] for row in rows], ['0', '1', '1'])
        left = self.hyco('train', '-scene', scene, '-values_load', '-20,10,20', '-values_radius', '9,10', '-model', 'lifted.h5', '-hyco_model_type', 'bodies')
        self.assertEqual((left['n_samples'], left['n_left_out']), (4, 2))
        self.assertTrue('load = -20, radius = 9' in left['no_equilibrium'] and what in left['no_equilibrium'], left['no_equilibrium'])
        still = self.hyco('solve', '-scene', scene, '-mu', '0,10')  # nothing holds it, and nothing moves it
        self.solved(still)
        self.assertEqual(still['outputs']['depth'], 0)

    def test_refused(self):
        """Rigid bodies with a wrong master, without a gap, or free to move otherwise are refused."""
        for changes, said in (({'many': ('slave: top, master: tip', 'slave: top, master: sym')}, 'is the one node'),
                              ({'own': ('slave: top, master: tip', 'slave: tool, master: tip, normal: {y: 1}')}, 'has the node that the rigid body moves with'),
                              ({'no_gap': (', gap: x^2/(2*radius)', '')}, 'has no gap'), ({'loose': (', tool: {x: 0}', '')}, 'keeps body tool from')):
            self.mesh(n=4)
            for ranks in (0, 2) if 'loose' in changes or 'many' in changes else (0,):
                run = self.run_raw('solve', '-scene', self.scene('bad.yaml', **changes), '-mu', '20,10', ranks=ranks)
                with self.subTest(changes=changes, ranks=ranks):
                    self.assertEqual(run.returncode, 1, run.stdout + run.stderr)
                    self.assertEqual(run.stderr.count('hyco: error'), 1, run.stderr)
                    self.assertIn(said, run.stderr)


if __name__ == '__main__':
    unittest.main()
