"""Errors of the outputs that a scene names: those of training against solve and predict, and the estimates of predictions against the true errors."""
import csv
import os
import random
import statistics
import unittest

import h5py
import numpy as np

from common import SOURCE, Case

BLOCKS = """
output:
  u: {max: mises}
  lift: {mean: u_y, group: foundation_top}
  push: {reaction: y, group: block_top}
  side: {reaction: x, group: block_sym}
  load: {force: y, contact: under}
  drop: {mean: u_y, group: block_top}
"""
RING = 'output: {hoop: {max: sigma_tt, group: ring}, hold: {reaction: x, group: sym_x0}, fit: {force: y, contact: fit}}\n'
ROPE = 'output: {deep: {min: u_x}, mean: {mean: u_x}, lift: {force: x, contact: ground}}\n'
HYBRID = ('-hyco_model_type', 'hybrid', '-hyco_search', 'false')


class Outputs(Case):
    newcomer = True

    @classmethod
    def scene(cls, name, outputs, changes=(), file=None):
        """An example with these outputs, in the test's folder."""
        with open(os.path.join(SOURCE, 'examples', name, 'scene.yaml'), encoding='utf-8') as f:
            text = f.read() + outputs
        return cls.changed(file or f'{name}.yaml', text, [(f'mesh: {name}.msh', f'mesh: {SOURCE}/examples/{name}/{name}.msh'), *changes])

    def table(self, name):
        with open(self.path(name), encoding='utf-8') as f:
            return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(f)]

    def points(self, name, ranges, n, seed):
        """A file of n random points, uniform in the ranges."""
        draw = random.Random(seed)
        with open(self.path(name), 'w', encoding='ascii') as f:
            f.write(','.join(ranges) + '\n' + ''.join(','.join(f'{draw.uniform(*r):.8g}' for r in ranges.values()) + '\n' for _ in range(n)))
        return name

    def bounds(self, scene, model, ranges, outputs, loose=()):
        """The estimates at 40 unseen points bound the errors at nine of ten, and are in the median not many times as large, except `loose` ones. The
        error of an output has a sign: a bound of 95 % of normally distributed errors is 2.9 times their median, and 3.5 times with the margin of a
        fifth; the largest of 20 ratios, each to a formula fitted without it, is several times that."""
        self.points('unseen.csv', ranges, 40, 7)
        self.hyco('predict', '-model', model, '-points', 'unseen.csv', '-table', 'p.csv')
        self.hyco('compare', '-scene', scene, '-model', model, '-points', 'unseen.csv', '-table', 'c.csv')
        predicted, compared = self.table('p.csv'), self.table('c.csv')
        for name in (*outputs, *loose):
            pairs = [(p[f'estimated_error_output_{name}'], c[f'error_output_{name}']) for p, c in zip(predicted, compared)]
            self.assertGreaterEqual(sum(e >= true for e, true in pairs) / len(pairs), 0.9, name)
            if name in loose:
                continue
            ratio = statistics.median(e / true for e, true in pairs if true > 0)
            self.assertTrue(1 <= ratio <= 20, (name, ratio))

    def test_bounds_the_error(self):
        """On blocks in 2D and on the rope."""
        scene = self.scene('blocks', BLOCKS)
        self.hyco('train', '-scene', scene, '-grid', '5,5', '-grid_type', 'closed', '-model', 'blocks.h5', *HYBRID)
        self.bounds(scene, 'blocks.h5', {'crown': (0.02, 0.08), 'press': (0.02, 0.08)}, ('u', 'lift', 'side'),
                    ('push', 'load'))  # at few points 30 times as wrong as at most: where a contact outside the RID opens or closes
        scene = self.scene('rope', ROPE)
        self.hyco('train', '-scene', scene, '-grid', '10,12', '-model', 'rope.h5', *HYBRID, '-hyco_pod_tol', '1e-7', '-hyco_rid_layers', 0, '-hyco_hybrid', 'all',
                  status=None)
        self.bounds(scene, 'rope.h5', {'mu1': (0.05, 0.25), 'mu2': (-0.05, 0.5)}, ('deep', 'mean', 'lift'))

    def test_follows_the_field(self):
        """A model of bodies whose shape is sampled, six held-out points: where the largest held-out error would be several times too small, the estimates of
        outputs grow with the field that decides them and its estimated error."""
        outputs = 'output: {peak: {max: contact_pressure, contact: under}, most: {max: mises, group: block}, turn: {moment: z, contact: under}}\n'
        scene = self.scene('blocks', outputs, file='follow.yaml')
        self.hyco('train', '-scene', scene, '-grid', '3,3', '-hyco_model_type', 'bodies', '-model', 'follow.h5')
        self.points('follow.csv', {'crown': (0.02, 0.08), 'press': (0.02, 0.08)}, 60, 1)
        self.hyco('predict', '-model', 'follow.h5', '-points', 'follow.csv', '-table', 'p.csv')
        self.hyco('compare', '-scene', scene, '-model', 'follow.h5', '-points', 'follow.csv', '-table', 'c.csv')
        for name in ('peak', 'most', 'turn'):
            worst = max(c[f'error_output_{name}'] / p[f'estimated_error_output_{name}'] for p, c in zip(self.table('p.csv'), self.table('c.csv')))
            self.assertLess(worst, 1, name)

    def test_training(self):
        """The errors that training reports are those of predict against solve at the held-out points, from 1 and 3 ranks; and the text and tables
        of a prediction have the report's estimates."""
        scene = self.scene('blocks', BLOCKS)
        self.points('held.csv', {'crown': (0.02, 0.08), 'press': (0.02, 0.08)}, 12, 3)
        train = ('train', '-scene', scene, '-grid', '4,4', '-validation_points', 'held.csv', *HYBRID)
        held = [self.hyco(*train, '-model', f'{ranks}.h5', ranks=ranks, status=None)['held_out']['outputs'] for ranks in (0, 3)]
        self.hyco('solve', '-scene', scene, '-points', 'held.csv', '-table', 's.csv')
        self.hyco('predict', '-model', '0.h5', '-points', 'held.csv', '-table', 'p.csv')
        solved, predicted = self.table('s.csv'), self.table('p.csv')
        for name, found in held[0].items():
            values = [row[name] for row in solved]
            size = max(abs(v) for v in values)
            errors = sorted(abs(p[name] - v) for p, v in zip(predicted, values))
            for what, expected in (('magnitude', size), ('median', errors[len(errors) // 2]), ('largest', errors[-1])):
                self.assertAlmostEqual(found[what], expected, delta=2e-7 * size, msg=(name, what))  # of a table's digits
                self.assertAlmostEqual(held[1][name][what], found[what], delta=1e-9 * size, msg=(name, what))
            self.assertTrue(found['estimated'])
        one = self.hyco('predict', '-model', '0.h5', '-mu', ','.join(str(predicted[0][k]) for k in ('crown', 'press')))['estimated_error_outputs']
        for name, value in one.items():
            self.near(predicted[0][f'estimated_error_output_{name}'], value, 1e-5, name)
        said = self.run_raw('predict', '-model', '0.h5', '-mu', '0.05,0.05').stdout
        self.assertRegex(said, r'estimated errors of the outputs: drop \S+, lift \S+, load \S+, push \S+, side \S+, u \S+\n')
        self.assertIn('output lift: median', self.run_raw('view', '-model', '0.h5').stdout)

    def test_prescribed(self):
        """The mean displacement of nodes with a prescribed displacement has errors of round-off; the estimate is 1e-10 of its largest value, or a
        quarter more."""
        scene = self.scene('blocks', BLOCKS)
        drop = self.hyco('train', '-scene', scene, '-grid', '4,4', '-model', 'drop.h5', *HYBRID, status=None)['held_out']['outputs']['drop']
        self.assertLess(drop['largest'], 1e-14)
        estimate = self.hyco('predict', '-model', 'drop.h5', '-mu', '0.05,0.05')['estimated_error_outputs']['drop']
        self.assertTrue(0.99e-10 * drop['magnitude'] <= estimate <= 1.26e-10 * drop['magnitude'], estimate)

    def test_path(self):
        """Of a path the error at its worst listed time; reactions too, from snapshots that were solved with the output."""
        scene = self.scene('ring', RING)
        self.points('held.csv', {'interference': (0.005, 0.02), 'creep': (0.5, 2)}, 10, 5)
        train = ('train', '-grid', '3,3', '-validation_points', 'held.csv', '-model', 'ring.h5', *HYBRID, '-hyco_pod_tol', 1e-5)
        held = self.hyco(*train, '-scene', scene, ranks=2, status=None)['held_out']['outputs']
        self.hyco('compare', '-scene', scene, '-model', 'ring.h5', '-points', 'held.csv', '-table', 'c.csv')
        compared = self.table('c.csv')
        for name, found in held.items():
            errors = sorted(row[f'worst_output_{name}'] for row in compared)
            self.near(found['median'], errors[5], 1e-5, name)
            self.near(found['largest'], errors[-1], 1e-5, name)
            self.assertTrue(all(row[f'end_output_{name}'] <= row[f'worst_output_{name}'] for row in compared))
        p = self.hyco('predict', '-model', 'ring.h5', '-mu', '0.01,1')
        self.assertTrue(all(p['estimated_error_outputs'][name] > 0 for name in held))
        self.hyco(*train, '-scene', self.scene('ring', '', file='plain.yaml'), '-hyco_snapshots', 'plain', status=None)
        run = self.run_raw(*train, '-scene', scene, '-hyco_snapshots', 'plain')
        self.assertIn('output hold: its error is not known', run.stdout)
        self.assertNotIn('output hoop: its error is not known', run.stdout)
        p = self.hyco('predict', '-model', 'ring.h5', '-mu', '0.01,1')['estimated_error_outputs']
        self.assertIsNone(p['hold'])
        self.assertGreater(p['hoop'], 0)

    def test_none(self):
        """No estimate: with few held-out points, for an output that is zero at all of them, for a value that the model does not compute, in older files."""
        # the block is lifted: no contact force at any point
        scene = self.scene('blocks', BLOCKS, [('y: -press', 'y: 0.1 + press')])
        train = ('train', '-scene', scene, '-grid', '3,3', '-model', 'none.h5', *HYBRID)
        predict = ('predict', '-model', 'none.h5', '-mu', '0.05,0.05')
        self.assertIn('output load: errors median 0, largest 0; values up to 0; no estimate', self.run_raw(*train).stdout)
        p = self.hyco(*predict)['estimated_error_outputs']
        self.assertIsNone(p['load'])
        self.assertGreater(p['u'], 0)
        scene = self.scene('blocks', BLOCKS)
        held = self.hyco(*train, '-hyco_snapshots', 'pressed', '-hyco_validation', 9, status=None)['held_out']['outputs']
        self.assertGreater(held['load']['largest'], 0)
        self.assertEqual(set(self.hyco(*predict)['estimated_error_outputs'].values()), {None})
        self.hyco(*train, '-hyco_snapshots', 'pressed', status=None)
        p = self.hyco(*predict)['estimated_error_outputs']
        self.assertNotIn(None, p.values())
        self.assertEqual(set(self.hyco(*predict, '-hyco_reconstruct', 'false')['estimated_error_outputs'].values()), {None})
        self.hyco('predict', '-model', 'none.h5', '-grid', '2,2', '-hyco_reconstruct', 'false', '-table', 'n.csv')
        self.assertTrue(np.isnan([row['estimated_error_output_load'] for row in self.table('n.csv')]).all())
        with h5py.File(self.path('none.h5'), 'a') as f:
            del f['training/outputs'], f['sealed']  # the seal is invalid after the first change
        older = self.hyco(*predict)
        self.assertEqual(set(older['estimated_error_outputs'].values()), {None})
        self.assertGreater(older['estimated_error_u'], 0)
        with h5py.File(self.path('none.h5'), 'a') as f:
            f['training/outputs'] = np.ones((2, 10))
        run = self.run_raw(*predict)
        self.assertEqual((run.returncode, run.stderr.count('\n')), (1, 1), run.stderr)
        self.assertIn('training/outputs', run.stderr)

    def test_fallback(self):
        """Points solved at full order keep the estimate that the model had. Outputs of the model that the scene does not have, or has with another
        definition, are not known; compare leaves them out."""
        scene = self.scene('blocks', BLOCKS)
        self.hyco('train', '-scene', scene, '-grid', '4,4', '-model', 'fall.h5', *HYBRID, status=None)
        args = ('predict', '-model', 'fall.h5', '-grid', '3,2', '-table')
        self.hyco(*args, 'p.csv')
        self.hyco(*args, 'f.csv', '-scene', scene, '-hyco_fallback', '-target_u', 1e-9)
        for p, f in zip(self.table('p.csv'), self.table('f.csv')):
            self.assertEqual(f['full_order'], 1)
            self.near(f['estimated_error_output_lift'], p['estimated_error_output_lift'], 1e-6)
        mu = ('-scene', scene, '-mu', '0.05,0.05', '-output_drop_group', 'foundation_top', '-output_another_max', 'u')
        solved = self.hyco('solve', *mu)['outputs']
        full = self.hyco('predict', '-model', 'fall.h5', *mu, '-hyco_fallback', '-target_u', 1e-9)['outputs']
        for name, value in full.items():  # from another start: the last digits may differ
            if name != 'drop':
                self.near(value, solved[name], 1e-10, name)
        self.assertIsNone(full['drop'])
        found = self.hyco('compare', '-model', 'fall.h5', *mu)
        self.assertEqual({name for name in found if name.startswith('error_output_')}, {f'error_output_{name}' for name in full if name != 'drop'})
        model = self.hyco('predict', '-model', 'fall.h5', '-mu', '0.05,0.05')['outputs']
        self.assertAlmostEqual(found['error_output_load']['max'], abs(model['load'] - solved['load']), delta=1e-9 * abs(solved['load']))


if __name__ == '__main__':
    unittest.main()
