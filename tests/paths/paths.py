"""Reduced models of paths: scenes with a history, on a small ring that creeps or yields while its gap closes and opens."""
import csv
import os
import shutil
import subprocess
import sys
import unittest

import h5py
import numpy as np

from common import PATIENCE, SOURCE, Case, said

SCENE = """
scene:
  title: a gap that closes and opens while the ring flows
  mesh: ring.msh
  parameters: [gap, push]
parameter:
  gap: {range: [0.004, 0.008]}
  push: {range: [0.8, 1.2]}
body:
  core: {young: 1e5, poisson: 0.3}
  ring: {LAW, young: 1e5, poisson: 0.3}
fixed: {sym_x0: {x: 0}, sym_y0: {y: 0}}
pressure: {ring_outside: 20*push*q*(1 + 0.3*x/4.7)}
contact:
  fit: {type: pair, slave: core_outside, master: ring_inside, tolerance: 1e-3, normal: {x: x, y: y}, gap: gap}
"""
HISTORY = """
history:
  times: [0, 1, 3, 6, 10, 11, 12]
  tables: {q: [[0, 0], [1, 1], [10, 1], [11, -1], [12, 0.2]]}
hyco: {substeps: 1}  # errors of models are tested, not of time
"""
NORTON = 'law: norton, rate: 2e-10, exponent: 3'
J2 = 'law: j2, yield: 80, hardening: 2000'
KINDS = ('u', 'sigma', 'lambda', 'inelastic')
COLUMNS = ('total_contact_force', 'rid_inelastic', 'rid_mises', 'rid_u_norm2')
POINTS = [(0.005, 0.9), (0.0075, 1.15), (0.0041, 1.2)]


def arrays(path):
    """All numbers of a series by name."""
    out = {}
    with h5py.File(path) as f:
        f.visititems(lambda name, item: out.update({name: item[()]}) if isinstance(item, h5py.Dataset) and item.dtype.kind == 'f' else None)
    return out


class FlowingRing(Case):
    """The mesh and the scenes, and no test."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        subprocess.run(['gmsh', '-2', os.path.join(SOURCE, 'examples', 'ring', 'ring.geo'), '-setnumber', 'n', '2', '-v', '1', '-o', cls.path('ring.msh')],
                       check=True, timeout=60 * PATIENCE, stdout=subprocess.DEVNULL)
        cls.norton = cls.scene('norton.yaml', NORTON)

    @classmethod
    def scene(cls, name, law, history=HISTORY):
        with open(cls.path(name), 'w', encoding='utf-8') as f:
            f.write(SCENE.replace('LAW', law) + history)
        return cls.path(name)

    def refused_in_one_line(self, words, *args):
        run = self.run_raw(*args)
        self.assertEqual(run.returncode, 1, run.stdout)
        self.assertEqual(len(said(run)), 1, run.stderr)
        for word in words:
            self.assertIn(word, said(run)[0])

    def table(self, model, *args):
        self.hyco('predict', '-model', self.path(model), '-table', self.path('rows.csv'), *args)
        with open(self.path('rows.csv'), encoding='utf-8') as f:
            return list(csv.DictReader(f))

    def same_in_any_order(self, model, points):
        """The rows of points predicted one after the other, and backwards: the same to the last bit. Returns the last ones."""
        tables = []
        for k, order in enumerate((points, points[::-1])):
            with open(self.path(f'order{k}.csv'), 'w', encoding='utf-8') as f:
                f.write('gap,push\n' + '\n'.join(f'{a},{b}' for a, b in order) + '\n')
            rows = self.table(model, '-points', self.path(f'order{k}.csv'))
            tables.append({(r['gap'], r['push']): [v for c, v in r.items() if c != 'seconds'] for r in rows})
        self.assertEqual(tables[0], tables[1])
        return rows

    def same_models(self, reports, names, histories):
        """What two trainings report and what their models predict, to 1e-6."""
        for name in names:
            self.assertEqual(reports[0][name], reports[1][name], name)
        for column in COLUMNS:
            a, b = (np.array(h[column]) for h in histories)
            self.assertLess(abs(a - b).max(), 1e-6 * abs(a).max(), column)


class Paths(FlowingRing):
    @classmethod
    def train(cls, scene, model, *args, **options):
        return cls.hyco('train', '-scene', scene, '-model', cls.path(model), *args, **options)

    def compare(self, scene, model, point, *args):
        return self.hyco('compare', '-scene', scene, '-model', self.path(model), '-mu', point, *args)

    def test_whole_is_full_order(self):
        """Every unknown of the whole mesh: the full order's path at any parameter value, with the gap closing and opening."""
        for name, law in (('whole-norton', NORTON), ('whole-j2', J2)):
            scene = self.scene(name + '.yaml', law)
            self.train(scene, name + '.h5', '-grid', '1,1', '-hyco_rid_whole', '-hyco_hybrid', 'all')
            full = self.hyco('solve', '-scene', scene, '-mu', '0.0052,0.93')['history']
            self.assertEqual(full['n_active'][0], 0)
            self.assertGreater(max(full['n_active']), 4)
            self.assertEqual(full['n_active'][-1], 0)
            self.assertGreater(full['inelastic'][-1], 1e-4)
            report = self.compare(scene, name + '.h5', '0.0052,0.93')
            for kind in KINDS:
                self.assertLess(report['worst_' + kind]['max'], 1e-8, kind)
            reduced = self.hyco('predict', '-model', self.path(name + '.h5'), '-mu', '0.0052,0.93')['history']  # steps of its own
            self.assertEqual(reduced['substeps'], full['substeps'])
            for column, other in (('t', 't'), ('total_contact_force', 'total_contact_force'), ('rid_inelastic', 'inelastic'), ('rid_mises', 'mises')):
                a, b = np.array(reduced[column]), np.array(full[other])
                self.assertLess(abs(a - b).max(), 1e-8 * abs(b).max(), column)

    def test_basis_of_a_path(self):
        """Where the modes span a path and its steps end on the listed times, the model on the whole mesh has it to 1e-8; on an RID nearly."""
        history = HISTORY.replace('[0, 1, 3, 6, 10, 11, 12]', '[0, 0.5, 1, 3, 6, 10, 10.25, 10.5, 10.75, 11, 12]')
        scene = self.scene('span.yaml', NORTON, history)
        point = ['-values_gap', '0.006', '-values_push', '1', '-hyco_pod_tol', '0', '-hyco_pod_noise', '1e-13', '-hyco_step_inelastic', '1',
                 '-hyco_newton_rtol', '1e-12', '-hyco_keep_singular']
        self.train(scene, 'span.h5', *point, '-hyco_rid_whole')
        report = self.compare(scene, 'span.h5', '0.006,1', '-hyco_step_inelastic', '1', '-hyco_newton_rtol', '1e-12')
        for kind in KINDS:
            self.assertLess(report['worst_' + kind]['max'], 1e-8, kind)

    def test_unseen(self):
        """Unseen points on an RID: small errors at the worst time and at the end, and the reports have both."""
        trained = self.train(self.norton, 'unseen.h5', '-grid', '3,3', '-hyco_pod_tol', '1e-10', '-hyco_rid_layers', '1')
        self.assertLess(trained['rid_fraction'], 1)
        self.assertEqual(trained['n_samples'], 9)
        self.assertGreater(trained['scan']['points'], 9)
        report = self.hyco('compare', '-scene', self.norton, '-model', self.path('unseen.h5'), '-values_gap', '0.0055,0.0072', '-values_push', '0.91,1.07',
                           '-table', self.path('unseen.csv'))
        for kind, limit in zip(KINDS, (5e-3, 2e-2, 5e-2, 2e-2)):
            self.assertLess(report['worst_' + kind]['max'], limit, kind)
            self.assertLessEqual(report['end_' + kind]['max'], report['worst_' + kind]['max'])
        with open(self.path('unseen.csv'), encoding='utf-8') as f:
            self.assertEqual([int(r['times_reached']) for r in csv.DictReader(f)], [7] * 4)
        for columns in ((), ('--columns', 'end_u,worst_inelastic')):
            subprocess.run([sys.executable, os.path.join(SOURCE, 'scripts', 'plot'), 'errors', self.path('unseen.csv'), *columns, '-o', self.path('unseen.png')],
                           check=True, capture_output=True, timeout=60 * PATIENCE)
            self.assertGreater(os.path.getsize(self.path('unseen.png')), 10000)
        view = self.run_raw('view', '-model', self.path('unseen.h5')).stdout
        self.assertIn('7 listed times', view)

    def test_projection(self):
        """The projection-based model has paths too: on the whole mesh, with nonnegative force vectors."""
        for dual, limit in (('nnmf', 0.15), ('snapshots', 0.15)):
            self.train(self.norton, 'projection.h5', '-grid', '3,3', '-grid_type', 'centred', '-hyco_model_type', 'projection', '-hyco_dual', dual, '-hyco_pod_tol', '1e-8',
                       '-hyco_snapshots', self.path('projection'))
            report = self.compare(self.norton, 'projection.h5', '0.0055,0.91')
            for kind, bound in zip(KINDS, (0.03, 0.03, limit, 0.03)):
                self.assertLess(report['worst_' + kind]['max'], bound, (dual, kind))

    def test_newton(self):
        """A tangent for each iteration, one that is kept, the elastic stiffness: the same result, and far fewer factors."""
        self.train(self.norton, 'newton.h5', '-grid', '3,3', '-hyco_pod_tol', '1e-10', '-hyco_rid_layers', '1')
        found = {kind: self.hyco('predict', '-model', self.path('newton.h5'), '-mu', '0.0055,0.91', '-hyco_newton', kind)['history']
                 for kind in ('tangent', 'elastic', 'modified', 'auto')}
        for kind, other in found.items():
            for column in ('total_contact_force', 'rid_inelastic', 'rid_mises', 'rid_u_norm2'):
                a, b = np.array(found['tangent'][column]), np.array(other[column])
                self.assertLess(abs(a - b).max(), 1e-7 * abs(a).max(), (kind, column))
        self.assertEqual(found['auto']['iterations'], found['modified']['iterations'])
        self.assertLess(sum(found['modified']['factors']), sum(found['tangent']['factors']) / 2)

    def test_outputs(self):
        """The outputs named in a scene are those of the replayed laws: at the listed times, at the end, their extremes in a set of points."""
        scene = self.scene('outputs.yaml', NORTON,
                           HISTORY + 'output:\n  hoop: {max: sigma_tt, group: ring}\n  out: {mean: u, group: ring_outside}\n  low: {min: sigma_tt, group: ring}\n')
        solved = self.hyco('solve', '-scene', scene, '-mu', '0.0052,0.93')
        full = {name: np.array(values) for name, values in solved['history']['outputs'].items()}
        self.assertEqual({name: values[-1] for name, values in full.items()}, solved['outputs'])
        for name, settings, limit in (('all.h5', ['-grid', '1,1', '-hyco_rid_whole', '-hyco_hybrid', 'all'], 1e-7),
                                      ('some.h5', ['-grid', '3,3', '-hyco_pod_tol', '1e-10', '-hyco_rid_layers', '1'], 1e-2)):
            self.train(scene, name, *settings)
            predicted = self.hyco('predict', '-model', self.path(name), '-mu', '0.0052,0.93')
            reduced = {output: np.array(values) for output, values in predicted['history']['outputs'].items()}
            row, = self.table(name, '-values_gap', '0.0052', '-values_push', '0.93')
            self.assertEqual(reduced.keys(), full.keys())
            for key, values in full.items():
                self.assertLess(abs(reduced[key] - values).max(), limit * abs(values).max(), (name, key))
                self.assertEqual(reduced[key][-1], predicted['outputs'][key])
                self.assertAlmostEqual(float(row[key]), reduced[key][-1], delta=1e-6 * abs(values).max())
                extreme = min if key == 'low' else max
                self.assertAlmostEqual(float(row['path_' + key]), extreme(reduced[key]), delta=1e-6 * abs(values).max())

    def test_order_of_questions(self):
        """A point's path is the same to the last bit whatever was predicted before it."""
        self.train(self.norton, 'order.h5', '-grid', '2,2', '-hyco_pod_tol', '1e-9', '-hyco_rid_layers', 1)
        rows = self.same_in_any_order('order.h5', [*POINTS, (0.006, 0.8)])
        alone = self.hyco('predict', '-model', self.path('order.h5'), '-mu', '0.0041,1.2')
        last = next(r for r in rows if float(r['gap']) == 0.0041)
        self.near(max(alone['history']['rid_inelastic']), float(last['largest_rid_inelastic']), 1e-7)
        self.near(max(alone['history']['total_contact_force']), float(last['largest_contact_force']), 1e-7)

    def test_ranks(self):
        """One and two ranks train the same model."""
        reports, histories = [], []
        for ranks in (0, 2):
            reports.append(self.train(self.norton, f'ranks{ranks}.h5', '-grid', '2,2', '-hyco_pod_tol', '1e-9', '-hyco_rid_layers', 1, ranks=ranks))
            histories.append(self.hyco('predict', '-model', self.path(f'ranks{ranks}.h5'), '-mu', '0.0063,1.11')['history'])
        self.same_models(reports, ('n_modes', 'rid_elements', 'rid_contacts', 'n_fe_dofs'), histories)
        one, two = (self.hyco('compare', '-scene', self.norton, '-model', self.path('ranks0.h5'), '-mu', '0.0063,1.11', ranks=ranks) for ranks in (0, 2))
        for kind in KINDS:
            self.near(two['worst_' + kind]['max'], one['worst_' + kind]['max'], 1e-4)

    def test_steps_between_listed_times(self):
        """Full order's steps between listed times are kept, at most five of an interval, and join the modes; a store of older versions has none."""
        arguments = ['-grid', '2,2', '-grid_type', 'centred', '-hyco_pod_tol', '1e-10', '-hyco_model_type', 'projection', '-hyco_snapshots']
        self.train(self.norton, 'between.h5', *arguments, self.path('steps'))
        os.mkdir(self.path('without'))
        for name in os.listdir(self.path('steps')):
            shutil.copy(os.path.join(self.path('steps'), name), self.path('without'))
            with h5py.File(os.path.join(self.path('without'), name), 'r+') as f:
                between = [key for key in f if key.startswith('between')]
                taken = f['taken'][:, 0]
                slots = {(k, int(5 * (t - a) / (b - a))) for k, (a, b) in enumerate(zip((0, 1, 3, 6, 10, 11), (1, 3, 6, 10, 11, 12))) for t in taken if a < t < b}
                self.assertEqual(len(between), len(slots))
                self.assertGreater(len(between), 0)
                for key in [*between, 'sealed']:
                    del f[key]
        self.train(self.norton, 'listed.h5', *arguments, self.path('without'))
        for kind in ('u', 'sigma'):
            kept, listed = (self.compare(self.norton, model, '0.0055,0.91')['worst_' + kind]['max'] for model in ('between.h5', 'listed.h5'))
            self.assertLess(kept, 0.5 * listed, kind)

    def test_damaged(self):
        """A path file that lacks a time, or is cut short, is named in one line."""
        args = ['train', '-scene', self.norton, '-model', self.path('damaged.h5'), '-grid', '1,1', '-hyco_rid_whole', '-hyco_snapshots', self.path('damaged')]
        self.hyco(*args)
        file = self.path('damaged', os.listdir(self.path('damaged'))[0])
        with h5py.File(file, 'a') as f:
            del f['step-0003']
            if 'sealed' in f:
                del f['sealed']
        self.fails(args, os.path.basename(file))
        with open(file, 'r+b') as f:
            f.truncate(os.path.getsize(file) // 2)
        self.fails(args, os.path.basename(file))

    def fails(self, args, word):
        run = self.run_raw(*args)
        self.assertEqual(run.returncode, 1, run.stdout)
        self.assertEqual(len(said(run)), 1, run.stderr)
        self.assertIn(word, said(run)[0])

    def test_replay(self):
        """The series has the state of the whole mesh: full order's where the model is exact, nearly that from an RID."""
        self.hyco('solve', '-scene', self.norton, '-mu', '0.0052,0.93', '-output', self.path('full.xdmf'))
        full = arrays(self.path('full.h5'))
        for name, settings, limit in (('exact', ['-grid', '1,1', '-hyco_rid_whole', '-hyco_hybrid', 'all'], 1e-7),
                                      ('near', ['-grid', '3,3', '-hyco_pod_tol', '1e-10', '-hyco_rid_layers', '1'], 3e-2)):
            self.train(self.norton, name + '.h5', *settings)
            self.hyco('predict', '-model', self.path(name + '.h5'), '-mu', '0.0052,0.93', '-output', self.path(name + '-path.xdmf'))
            reduced = arrays(self.path(name + '-path.h5'))
            self.assertEqual(full.keys(), reduced.keys())
            for field in ('nodes/displacement', 'cells/stress', 'cells/inelastic', 'nodes/contact_force'):
                steps = [n for n in full if n.endswith(field)]
                self.assertEqual(len(steps), 7)
                size = max(abs(full[n]).max() for n in steps)
                self.assertLess(max(abs(full[n] - reduced[n]).max() for n in steps), limit * size, (name, field))

    def test_without_flow(self):
        """A path without flow: at each time the answer of an elastic model with the same solutions, the load its parameter."""
        loads = [0.3, 0.55, 0.8, 1]
        path = self.scene('still.yaml', 'law: elastic', 'history:\n  times: [0, 1, 2, 3]\n  tables: {q: [' +
                          ', '.join(f'[{t}, {q}]' for t, q in enumerate(loads)) + ']}\n')
        elastic = self.scene('elastic.yaml', 'law: elastic', '')
        with open(elastic, encoding='utf-8') as f:
            text = f.read().replace('[gap, push]', '[gap, push, q]').replace('  push: {range', '  q: {range: [0, 1]}\n  push: {range')
        with open(elastic, 'w', encoding='utf-8') as f:
            f.write(text)
        with open(self.path('loads.csv'), 'w', encoding='utf-8') as f:
            f.write('gap,push,q\n' + '\n'.join(f'0.004,1,{q}' for q in loads) + '\n')
        settings = ['-hyco_pod_tol', '1e-9', '-hyco_rid_layers', '1', '-hyco_rid_groups', 'core_outside', '-hyco_keep_singular']
        of_path = self.train(path, 'still.h5', '-values_gap', '0.004', '-values_push', '1', *settings)
        alone = self.train(elastic, 'elastic.h5', '-points', self.path('loads.csv'), *settings)
        for name in ('n_modes', 'rid_elements', 'rid_contacts', 'n_fe_dofs'):
            self.assertEqual(of_path[name], alone[name], name)
        history = self.hyco('predict', '-model', self.path('still.h5'), '-mu', '0.0046,1.1')['history']
        self.assertGreater(history['total_contact_force'][-1], 0)
        for k, q in enumerate(loads):
            answer = self.hyco('predict', '-model', self.path('elastic.h5'), '-mu', f'0.0046,1.1,{q}')
            self.assertLess(abs(history['total_contact_force'][k] - answer['total_contact_force']), 1e-7 * history['total_contact_force'][-1])
            self.near(history['rid_u_norm2'][k], answer['rid_u_norm2'], 1e-8)

    def test_resume(self):
        """Paths that are in the store are not solved again."""
        self.train(self.norton, 'first.h5', '-grid', '2,1', '-hyco_rid_whole', '-hyco_snapshots', self.path('store'))
        before = {n: os.stat(self.path('store', n)).st_mtime_ns for n in os.listdir(self.path('store'))}
        self.train(self.norton, 'second.h5', '-grid', '2,1', '-hyco_rid_whole', '-hyco_snapshots', self.path('store'), '-hyco_pod_tol', '1e-5')
        self.assertEqual(before, {n: os.stat(self.path('store', n)).st_mtime_ns for n in os.listdir(self.path('store'))})
        with h5py.File(self.path('store', min(before))) as f:
            self.assertEqual(sum(n.startswith('step-') for n in f), 7)
            self.assertGreaterEqual(len(f['taken']), 7)

    def test_refused(self):
        """What is not there is said in one line; a history that is not the model's is named."""
        self.train(self.norton, 'refused.h5', '-grid', '1,1', '-hyco_rid_whole')
        model = self.path('refused.h5')
        store = model + '.snapshots'
        for args, words in (
                (['compare', '-scene', self.norton, '-model', model, '-mu', '0.006,1', '-history_times', '0,1,12'], ['history_times', '0,1,12']),
                (['compare', '-scene', self.norton, '-model', model, '-mu', '0.006,1', '-history_tables_q', '0 0,1 2,12 2'], ['history_tables_q']),
                (['train', '-scene', self.norton, '-model', self.path('no.h5'), '-grid', '1,1', '-hyco_snapshots', store, '-history_times', '0,1,12'],
                 ['refused.h5.snapshots/', 'history_times is 0,1,12 in the scene']),
                (['train', '-scene', self.norton, '-model', self.path('no.h5'), '-grid', '1,1', '-hyco_snapshots', store, '-body_ring_young', '1'],
                 ['is a snapshot of another scene, history or mesh', store]),
                (['predict', '-scene', self.norton, '-model', model, '-mu', '0.006,1', '-hyco_fallback'], ['-hyco_fallback', 'history']),
                (['train', '-scene', self.norton, '-model', self.path('no.h5'), '-grid', '2,2', '-hyco_checkpoint', self.path('c.h5')], ['-hyco_checkpoint'])):
            self.refused_in_one_line(words, *args)
        self.assertFalse(os.path.exists(self.path('no.h5')))


if __name__ == '__main__':
    unittest.main()
