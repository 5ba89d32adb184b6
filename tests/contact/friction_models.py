"""Models of bodies with friction: the path of full order where nothing is interpolated, to the interpolation's error elsewhere; fields, outputs,
several ranks, batches, refusals; the lap joint of the examples. Hybrid models with friction on the RID."""
import json
import os
import sys
import unittest

import h5py
import numpy as np

from common import SOURCE, Case

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import Grid  # noqa: E402

# A pad on a floor, pressed and pushed to and fro: loads, coefficient, stiffness and gap change, none of which needs a sample
PAD = """
scene: {mesh: mesh.msh, parameters: [m, press, soft, tilt]}
parameter: {m: {range: [0.1, 0.5]}, press: {range: [0.5, 1.5]}, soft: {range: [0.5, 2]}, tilt: {range: [0, 1]}}
body: {pad: {LAW}}
fixed: {top: {x: "0.01*s", y: "-0.004*press*min(t, 1)"}}
contact: {floor: {group: base, normal: {y: -1}, gap: "0.0005*tilt*x", friction: "m*(1 + 0.2*x)"}}
history: {times: [0, 1, 1.5, 2, 2.4, 3], tables: {s: [[0, 0], [1, 0], [2, 1], [3, -1]]}}
output: {T: {friction: x, contact: floor}, N: {force: y}, W: {friction: work}, R: {reaction: x, group: top}}
"""
ELASTIC = 'young: 1000*soft, poisson: 0.3'
NORTON = 'law: norton, young: 1000, poisson: 0.3, rate: 1e-3*soft, exponent: 2'
J2 = 'law: j2, young: 1000, poisson: 0.3, yield: 3*soft, hardening: 100'
# Two blocks; the ratio of one's moduli changes, so that its flexibility is interpolated; in 2D and 3D
TWO = """
scene: {mesh: mesh.msh, parameters: [m, hard]}
parameter: {m: {range: [0.1, 0.3]}, hard: {range: [0, 3]}}
body: {low: {young: 1000*(1 + hard*x), poisson: 0.3}, high: {young: 500, poisson: 0.2}}
fixed: {base: {HELD}, top: {x: "0.02*s", MORE LAST: "-0.01*min(t, 1)"}}
contact: {joint: {type: TYPE, slave: face, master: back, friction: m}}
history: {times: [0, 1, 1.5, 2, 3], tables: {s: [[0, 0], [1, 0], [2, 1], [3, 0]]}}
output: {T: {friction: x, contact: joint}, W: {friction: work}}
"""
# A block that friction alone holds on a plane, pressed and pushed to and fro until most of it slips, and unloaded
HELD = """
scene: {mesh: mesh.msh, parameters: [m, press, push]}
parameter: {m: {range: [0.3, 0.6]}, press: {range: [1, 2]}, push: {range: [0.1, 0.25]}}
body: {block: {LAW}}
traction: {top: {x: "push*press*h", y: "-press*v"}}
contact: {plane: {group: base, normal: {y: -1}, gap: "0.0001*(x - 1)^2", friction: m}}
history: {times: [0, 1, 2, 3, 4, 5], tables: {v: [[0, 0], [1, 1], [3, 1], [4, 0.5], [5, 1]], h: [[1, 0], [2, 1], [3, -1], [4, 0]]}}
output: {T: {friction: x, contact: plane}, W: {friction: work}}
"""
BODIES = ['-hyco_model_type', 'bodies']
COLUMNS = ('total_contact_force', 'friction_work', 'n_slipping', 'n_active', 'sliding')

# A block in a corner of two obstacles, pressed from both other sides
CORNER = """scene: {mesh: mesh.msh, parameters: [m, px, py]}
parameter: {m: {range: [0, 0.5]}, px: {range: [1, 2]}, py: {range: [1, 2]}}
history: {times: [0, 1], tables: {a: [[0, 0], [1, 1]]}}
body: {block: {young: 1000, poisson: 0.3}}
pressure: {x1: px*a, y1: py*a}
contact:
  floor: {group: y0, normal: {y: -1}, gap: 0, friction: m}
  side: {group: x0, normal: {x: -1}, gap: 0, friction: m}
"""

LISTED = '\nhistory:', '\nhyco: {substeps: 1}\nhistory:'  # steps are the listed times: errors of models are tested, not of time


class FrictionModels(Case):
    def pad(self, name='scene.yaml', law=ELASTIC, *changes, cells=6):
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 2, 2 * cells + 1), np.linspace(0, 1, cells + 1)], lambda x: x, 'pad', {'y0': 'base', 'y1': 'top'})
        grid.write(self.path('mesh.msh'))
        return self.changed(name, PAD.replace('LAW', law), changes)

    def two(self, dim, kind, *changes):
        last = 'yz'[dim - 2]
        grid = Grid()
        flat = lambda n: [np.linspace(0, 1, n)] * (dim - 1)
        cell = 'quad4' if dim == 2 else 'hex8'
        grid.box(cell, [*flat(5), np.linspace(-0.5, 0, 3)], lambda x: x, 'low', {last + '0': 'base', last + '1': 'back'})
        grid.box(cell, [*flat(4), np.linspace(0, 0.5, 3)], lambda x: x, 'high', {last + '0': 'face', last + '1': 'top'})
        grid.write(self.path('mesh.msh'))
        held = 'x: 0, y: 0' + ', z: 0' * (dim - 2)
        text = TWO.replace('LAST', last).replace('HELD', held).replace('MORE', 'y: 0,' * (dim - 2)).replace('TYPE', kind)
        return self.changed('scene.yaml', text, changes)

    def train(self, scene, *args, grid='2,1,1,1', **options):
        return self.hyco('train', '-scene', scene, '-model', self.path('m.h5'), '-grid', grid, '-hyco_validation', '2', *args, **options)

    def columns(self, command, point, *args, **options):
        history = self.hyco(command, '-mu', point, *args, **options)['history']
        return {name: np.array(history['outputs'].get(name, history.get(name))) for name in (*COLUMNS, *history['outputs'])}

    def alike(self, scene, point, limit, **options):
        """The listed times of full order and model at an unseen point; friction matters there."""
        full = self.columns('solve', point, '-scene', scene)
        found = self.columns('predict', point, '-model', self.path('m.h5'), **options)
        self.assertGreater(abs(full['T']).max(), 0.1 * full['total_contact_force'].max())
        self.assertGreater(full['n_slipping'].max(), 0)
        self.assertGreater(full['W'][-1], 0)
        for name in full:
            self.assertLessEqual(abs(found[name] - full[name]).max(), limit * abs(full[name]).max(), name)

    def slopes(self, ranges, point):
        """The gradient of the outputs' ends and extremes at a point is that of central differences of predictions, where friction dissipates."""
        width, model = 2e-5, self.path('m.h5')
        report = self.hyco('predict', '-model', model, '-mu', ','.join(map(str, point)), '-gradient')
        steps = [sign * width / 2 * (hi - lo) * np.eye(len(point))[k] for k, (lo, hi) in enumerate(ranges.values()) for sign in (-1, 1)]
        np.savetxt(self.path('beside.csv'), np.array(point) + steps, fmt='%.17g', delimiter=',', header=','.join(ranges), comments='')
        self.hyco('predict', '-model', model, '-points', self.path('beside.csv'), '-table', self.path('beside.h5'))
        self.assertGreater(abs(report['outputs']['W']), 0)
        with h5py.File(self.path('beside.h5')) as rows:
            for output, values in report['history']['outputs'].items():
                for key, column in (('gradient', output), ('gradient_path', 'path_' + output)):
                    for k, (p, (lo, hi)) in enumerate(ranges.items()):
                        low, high = rows[column][2 * k:2 * k + 2]
                        found = report[key][output][p] * (hi - lo)
                        self.assertLess(abs(found - (high - low) / width), 1e-6 * max(abs(found), 1e-2 * max(map(abs, values))), (column, p))

    def test_exact(self):
        """Loads, coefficient, modulus and gap change: the path of full order at unseen points, and its derivatives; the type is found by default;
        estimates, batches."""
        scene = self.pad()
        report = self.train(scene)
        self.assertEqual(report['model_type'], 'bodies')
        for point in ('0.17,1.3,0.7,0.4', '0.44,0.6,1.9,0.9'):
            self.alike(scene, point, 1e-8)
        self.slopes({'m': (0.1, 0.5), 'press': (0.5, 1.5), 'soft': (0.5, 2), 'tilt': (0, 1)}, (0.17, 1.3, 0.7, 0.4))
        self.alike(scene, '0.3,1,1,0.5', 1e-8, ranks=2)
        compared = self.hyco('compare', '-scene', scene, '-model', self.path('m.h5'), '-mu', '0.17,1.3,0.7,0.4')
        for kind in ('lambda', 'sigma'):
            self.assertLess(compared['worst_' + kind]['max'], 1e-8, kind)
        self.assertLess(compared['worst_u']['max'], 1e-3)
        points = np.array([[0.17, 1.3, 0.7, 0.4], [0.44, 0.6, 1.9, 0.9], [0.17, 1.3, 0.7, 0.4]])
        np.savetxt(self.path('points.csv'), points, delimiter=',', header='m,press,soft,tilt', comments='')
        self.hyco('predict', '-model', self.path('m.h5'), '-points', self.path('points.csv'), '-table', self.path('batch.csv'))
        batch = np.genfromtxt(self.path('batch.csv'), delimiter=',', names=True)
        for name in batch.dtype.names:
            if 'seconds' not in name:
                np.testing.assert_equal(batch[name][0], batch[name][2], name)

    def test_fields(self):
        """Traction, slip, state and forces at the contacts' nodes are those of full order; equilibrium and balance on the whole mesh include friction."""
        scene, point = self.pad(), ['-mu', '0.17,1.3,0.7,0.4']
        self.train(scene)
        self.hyco('solve', '-scene', scene, *point, '-output', self.path('full.xdmf'))
        report = self.hyco('predict', '-model', self.path('m.h5'), *point, '-output', self.path('found.xdmf'), '-hyco_residual')
        self.assertLess(report['equilibrium']['worst'], 1e-3)
        with h5py.File(self.path('full.h5')) as full, h5py.File(self.path('found.h5')) as found:
            for name in ('contact_traction', 'contact_slip', 'contact_state', 'contact_force', 'contact_pressure'):
                most = max(abs(full[f'step-{k:04d}/nodes/{name}'][:]).max() for k in range(6))
                self.assertGreater(most, 0)
                for k in range(6):
                    a, b = (f[f'step-{k:04d}/nodes/{name}'][:] for f in (full, found))
                    self.assertLessEqual(abs(a - b).max(), 1e-8 * most, (name, k))

    def test_interpolated(self):
        """A body whose moduli change their ratio: forces, slip and work to the error of its interpolated flexibility; surfaces and mortar, 2D and 3D."""
        for dim, kind in ((2, 'surface'), (2, 'mortar'), (3, 'surface')):
            scene = self.two(dim, kind)
            self.train(scene, '-hyco_snapshots', self.path(f'{kind}{dim}'), grid='2,2', ranks=2 if kind == 'mortar' else 0)
            self.alike(scene, '0.22,1.7', 1e-4)
        self.slopes({'m': (0.1, 0.3), 'hard': (0, 3)}, (0.22, 1.7))

    def test_border(self):
        """With the least friction at which all of the pad sticks its derivatives are those towards more friction, and flagged."""
        scene = self.pad('stick.yaml', ELASTIC, ('[0.1, 0.5]', '[0, 3]'), ('[0, 1, 1.5, 2, 2.4, 3]', '[0, 1]'), ('[1, 0]', '[1, 0.3]'), cells=3)
        self.train(scene, *BODIES)
        at = ['predict', '-model', self.path('m.h5'), '-mu']
        stuck = self.hyco(*at, '2.7,1,1,0', '-output', self.path('stuck.xdmf'), '-gradient')
        self.assertEqual((stuck['history']['n_slipping'], stuck['gradient']['T']['m'], stuck['gradient_kinks']), ([0, 0], 0, []))
        with h5py.File(self.path('stuck.h5')) as f:
            x, traction, pressure = (f[name][:] for name in ('mesh/xyz', 'step-0001/nodes/contact_traction', 'step-0001/nodes/contact_pressure'))
        press = pressure.ravel() > 0
        least = (abs(traction[press, 0]) / (1 + 0.2 * x[press, 0]) / pressure.ravel()[press]).max()
        for share, side in ((1, False), (0.999, True)):
            report = self.hyco(*at, f'{float(share * least)!r},1,1,0', '-gradient')
            self.assertEqual(bool(report['gradient']['T']['m']), side)
            self.assertEqual({'output': 'T', 'parameter': 'm'} in report['gradient_kinks'], not side)

    def test_unique(self):
        """Nodes of a slave that are moved by supports and more than their masters' unknowns can tell apart: at the times when they press, the nodal forces are
        not unique, in full order and in the model, whose estimate of them is then none, and training does not judge them; resultants differ by less than 3 %.
        So are the forces at a corner node that two contacts hold, while it sticks at both."""
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 1, 4), np.linspace(-0.5, 0, 3)], lambda x: x, 'low', {'y0': 'base', 'y1': 'back'})
        grid.box('quad4', [np.linspace(0.05, 0.95, 9), np.linspace(0, 0.5, 3)], lambda x: x, 'high', {'y0': 'face', 'y1': 'top'})
        grid.write(self.path('mesh.msh'))
        text = TWO.replace('HELD', 'x: 0, y: 0').replace('LAST', 'y').replace('MORE', '').replace('TYPE', 'surface').replace('*min(t, 1)', '*p + 0.001*(1 - p)')
        text = text.replace('top: {', 'face: {').replace('s: [[0, 0]', 'p: [[0, 0], [1, 1], [2, 1], [3, 0]], s: [[0, 0]')
        scene = self.changed('scene.yaml', text, ())
        run = self.run_raw('train', '-scene', scene, '-model', self.path('m.h5'), '-grid', '2,2', '-hyco_validation', '2')
        self.assertEqual(run.returncode, 3, run.stderr)
        self.assertNotIn('contact forces', run.stderr)
        point = '0.22,1.7'
        solved = self.hyco('solve', '-scene', scene, '-mu', point, '-table', self.path('solved.csv'))
        run = self.run_raw('predict', '-model', self.path('m.h5'), '-mu', point, '-table', self.path('found.csv'), '-report', self.path('found.json'))
        with open(self.path('found.json'), encoding='utf-8') as f:
            found = json.load(f)
        self.assertIn('not unique at t = 1, 1.5, 2', run.stdout)
        for report, table in ((solved, 'solved.csv'), (found, 'found.csv')):
            self.assertFalse(report['forces_unique'])
            self.assertEqual(report['history']['forces_unique'], [1, 0, 0, 0, 1])
            rows = np.genfromtxt(self.path(table), delimiter=',', names=True)
            self.assertEqual(rows['forces_unique'].tolist(), [1, 0, 0, 0, 1])
        self.assertIsNone(found['estimated_error_lambda'])
        for name in ('total_contact_force', 'friction_work'):
            most = max(solved['history'][name])
            self.assertLess(max(abs(a - b) for a, b in zip(found['history'][name], solved['history'][name])), 0.03 * most, name)
        self.hyco('predict', '-model', self.path('m.h5'), '-grid', '1,2', '-table', self.path('batch.csv'))
        batch = np.genfromtxt(self.path('batch.csv'), delimiter=',', names=True)
        self.assertEqual(batch['forces_unique'].tolist(), [0, 0])
        self.assertTrue(np.isnan(batch['estimated_error_lambda']).all())
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 1, 5)] * 2, lambda x: x, 'block', {f'{a}{e}': f'{a}{e}' for a in 'xy' for e in '01'})
        grid.write(self.path('mesh.msh'))
        corner = self.changed('corner.yaml', CORNER, ())
        for mu, unique in ((0.5, [1, 0]), (0, [1, 1])):
            found = self.hyco('solve', '-scene', corner, '-mu', f'{mu},2,1')
            self.assertEqual(found['history']['forces_unique'], unique)
        self.hyco('train', '-scene', corner, '-model', self.path('c.h5'), '-values_m', '0.5', '-values_px', '1,2', '-values_py', '1,2', '-hyco_model_type', 'bodies')
        self.assertFalse(self.hyco('predict', '-model', self.path('c.h5'), '-mu', '0.5,2,1')['forces_unique'])

    def compared(self, scene, point, limit):
        """The errors of a path in the time steps of full order."""
        report = self.hyco('compare', '-scene', scene, '-model', self.path('m.h5'), '-mu', point)
        self.assertEqual(report['not_converged'], 0)
        self.assertLess(report['kkt_max'], 1e-8)
        errors = {kind: report['worst_' + kind]['max'] for kind in ('u', 'sigma', 'lambda')}
        self.assertLess(max(errors.values()), limit, errors)

    def test_inelastic(self):
        """Bodies that creep and that yield, in 2D and 3D: contact forces, slip and work are those of full order to the error of the inelastic modes,
        in as many steps."""
        for law, laws in ((NORTON, 'interpolation'), (J2, 'cubature')):
            scene = self.pad('flows.yaml', law, ('[0.1, 0.5]', '[0.3, 0.4]'), ('[0.5, 2]', '[0.9, 1.1]'), ('[0, 1]}', '[0.4, 0.6]}'), LISTED, cells=3)
            trained = self.train(scene, '-hyco_snapshots', self.path(laws), '-hyco_bodies_laws', laws, '-target_u', '0.02', '-target_lambda', '0.03', *BODIES, grid='2,3,1,1')
            self.assertGreater(trained['n_inelastic_modes'], 3)
            self.alike(scene, '0.37,1.2,1,0.5', 0.05)
            self.compared(scene, '0.37,1.2,1,0.5', 0.02)
            steps, found = (self.hyco(*command, '-mu', '0.37,1.2,1,0.5')['history'] for command in (('solve', '-scene', scene), ('predict', '-model', self.path('m.h5'))))
            self.assertEqual([steps[k] for k in ('substeps', 'cuts')], [found[k] for k in ('substeps', 'cuts')])
        scene = self.two(3, 'surface', ('young: 1000*(1 + hard*x)', 'law: norton, young: 1000, rate: 1e-4*(1 + hard), exponent: 2'),
                         ('times: [0, 1, 1.5, 2, 3]', 'times: [0, 1, 2]'), LISTED)
        self.train(scene, '-hyco_snapshots', self.path('flows3'), *BODIES, grid='2,1')
        self.alike(scene, '0.22,1.5', 0.02)

    def test_held(self):
        """A body that friction alone holds: elastic, its path is that of full order; creeping, to the error of the modes."""
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 2, 9), np.linspace(0, 1, 5)], lambda x: x, 'block', {'y0': 'base', 'y1': 'top'})
        grid.write(self.path('mesh.msh'))
        for law, limit in (('young: 1000, poisson: 0.3', 1e-8), ('law: norton, young: 1000, poisson: 0.3, rate: 1e-4, exponent: 2', 2e-3)):
            scene = self.changed('held.yaml', HELD.replace('LAW', law), ())
            self.train(scene, '-hyco_snapshots', self.path('held-' + law[:3]), *BODIES, grid='2,2,1')
            self.alike(scene, '0.4,1.3,0.22', limit)
            if limit < 1e-6:
                self.slopes({'m': (0.3, 0.6), 'press': (1, 2), 'push': (0.1, 0.25)}, (0.4, 1.3, 0.22))

    def hybrid(self, scene, n, *args):
        """A hybrid model from n scattered paths."""
        report = self.hyco('train', '-scene', scene, '-model', self.path('m.h5'), '-scatter', str(n), '-hyco_validation', '0', '-hyco_model_type', 'hybrid', *args)
        self.assertEqual(report['model_type'], 'hybrid')
        return report

    def test_hybrid(self):
        """A hybrid model whose RID lacks contacts that press: an unseen path's forces, slip and work, with the state of each contact as at full order; reconstructed
        forces stay in the cone; batches. Without friction the shear force is 0, which is a fifth of the normal force here."""
        scene, point = self.pad(cells=8), '0.17,1.3,0.7,0.4'
        few = [f'-hyco_rid_{name}_tol' for name in ('stress', 'force', 'dual')]
        report = self.hybrid(scene, 16, '-hyco_snapshots', self.path('few'), '-hyco_hybrid', 'all', '-hyco_pod_tol', '1e-8', '-hyco_rid_contact_extension', '0', '-hyco_rid_layers', '0', *[word for name in few for word in (name, '0.3')])
        self.assertLess(report['rid_contacts'], 17)
        self.alike(scene, point, 0.015)
        self.hyco('solve', '-scene', scene, '-mu', point, '-output', self.path('full.xdmf'))
        self.hyco('predict', '-model', self.path('m.h5'), '-mu', point, '-output', self.path('found.xdmf'))
        with h5py.File(self.path('full.h5')) as full, h5py.File(self.path('found.h5')) as found:
            x = found['mesh/xyz'][:, 0]
            most = abs(full['step-0005/nodes/contact_slip'][:]).max()
            for k in range(1, 6):
                state, traction, pressure, slip = (found[f'step-{k:04d}/nodes/contact_{name}'][:] for name in ('state', 'traction', 'pressure', 'slip'))
                np.testing.assert_array_equal(state, full[f'step-{k:04d}/nodes/contact_state'][:])
                self.assertLess((abs(traction[:, 0]) - 0.17 * (1 + 0.2 * x) * pressure.ravel()).max(), 1e-8 * pressure.max())
                self.assertLess(abs(slip - full[f'step-{k:04d}/nodes/contact_slip'][:]).max(), 0.01 * most)
        np.savetxt(self.path('points.csv'), [[0.17, 1.3, 0.7, 0.4], [0.44, 0.6, 1.9, 0.9], [0.17, 1.3, 0.7, 0.4]], delimiter=',', header='m,press,soft,tilt', comments='')
        self.hyco('predict', '-model', self.path('m.h5'), '-points', self.path('points.csv'), '-table', self.path('batch.csv'), ranks=2)
        batch = np.genfromtxt(self.path('batch.csv'), delimiter=',', names=True)
        for name in batch.dtype.names:
            if 'seconds' not in name:
                np.testing.assert_equal(batch[name][0], batch[name][2], name)

    def test_hybrid_kinds(self):
        """The fewest full-order displacements for the rows with tangents; all of the mesh, which is full order; 3D; a body that friction alone holds;
        creep with a stiffness that changes in time, which the default search leaves to this type."""
        scene = self.pad(cells=3)
        store = ['-hyco_snapshots', self.path('hp')]
        self.hybrid(scene, 12, *store, '-hyco_hybrid', 'rank', '-hyco_pod_tol', '1e-10')
        self.alike(scene, '0.17,1.3,0.7,0.4', 0.05)
        self.hybrid(scene, 2, *store, '-hyco_hybrid', 'all', '-hyco_rid_whole', 'true')
        self.alike(scene, '0.17,1.3,0.7,0.4', 1e-8)
        scene = self.two(3, 'surface')
        self.hybrid(scene, 6, '-hyco_snapshots', self.path('h3'))
        self.alike(scene, '0.22,1.7', 0.01)
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 2, 13), np.linspace(0, 1, 7)], lambda x: x, 'block', {'y0': 'base', 'y1': 'top'})
        grid.write(self.path('mesh.msh'))
        scene = self.changed('held.yaml', HELD.replace('LAW', 'young: 1000, poisson: 0.3'), ())
        report = self.hybrid(scene, 12, '-hyco_snapshots', self.path('hh'), '-hyco_pod_tol', '1e-10', '-hyco_rid_layers', '1')
        self.assertLess(report['rid_contacts'], 13)
        self.alike(scene, '0.4,1.3,0.22', 0.02)
        heats = NORTON.replace('young: 1000', 'young: 1000*(1 + 0.1*t)')
        scene = self.pad('flows.yaml', heats, ('[0.1, 0.5]', '[0.3, 0.4]'), ('[0.5, 2]', '[0.9, 1.1]'), ('[0, 1]}', '[0.4, 0.6]}'), cells=3)
        report = self.hyco('train', '-scene', scene, '-model', self.path('m.h5'), '-scatter', '6', '-hyco_snapshots', self.path('hc'),
                           '-hyco_search', 'true', '-hyco_validation', '2')
        self.assertEqual(report['model_type'], 'hybrid')
        self.alike(scene, '0.37,1.2,1,0.5', 0.02)

    def test_refused(self):
        """Other types in one line that names the contact; no type drops the friction."""
        for kind in ('projection', 'cubature'):
            run = self.run_raw('train', '-scene', self.pad(), '-model', self.path('none.h5'), '-grid', '2,1,1,1', '-hyco_model_type', kind)
            self.assertEqual(run.returncode, 1, run.stderr)
            self.assertEqual(len(run.stderr.strip().splitlines()), 1, run.stderr)
            for word in ('floor', 'friction', kind, 'bodies or hybrid'):
                self.assertIn(word, run.stderr)
            self.assertFalse(os.path.exists(self.path('none.h5')))

    def test_lap_joint(self):
        """The example: hysteresis loop and dissipated work at an unseen point."""
        scene = os.path.join(SOURCE, 'examples', 'lapjoint', 'scene.yaml')
        self.train(scene, '-hyco_snapshots', self.path('lap'), grid='2,1,1')
        point = '1300,0.17,0.06'
        full = self.columns('solve', point, '-scene', scene)
        found = self.columns('predict', point, '-model', self.path('m.h5'))
        self.assertGreater(full['friction_work'][-1], 1)
        for name, limit in (('pull', 1e-6), ('shear_force', 1e-6), ('friction_work', 1e-6), ('n_slipping', 0)):
            self.assertLessEqual(abs(found[name] - full[name]).max(), limit * abs(full[name]).max(), name)


if __name__ == '__main__':
    unittest.main()
