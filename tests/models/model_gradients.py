"""Gradients of predictions: against central differences of predictions for models of bodies (which move, float, or change their shape), hybrid and
projection-based models; for bodies they are those of full order; the prediction stays; types without gradients say so."""
import csv
import os
import unittest

import gradients
from common import PELLET, SOURCE

HERTZ = ('-scene', os.path.join(SOURCE, 'examples', 'hertz'), '-output_push_force', 'y', '-output_push_contact', 'line', '-output_peak_max', 'mises',
         '-output_peak_group', 'lower', '-output_sink_mean', 'u_y', '-output_hard_mean', 'mises', '-output_hard_group', 'lower', '-output_most_mean', 'principal_1',
         '-output_away_mean', 'u', '-output_away_group', 'lower')
RANGES = {'place': (-5, 5), 'press': (0.2, 1), 'modulus': (5, 20), 'load': (0, 1), 'entry': (0, 0.2)}


class ModelGradients(gradients.Gradients):
    def model(self, kind, scene, *args, ranks=0):
        self.hyco('train', *scene, '-hyco_model_type', kind, '-model', kind + '.h5', *args, ranks=ranks, status=None)
        return ('predict', '-model', kind + '.h5')

    def test_surface(self):
        """Bodies that slide along each other: the model's gradient is that of full order, and a prediction is not changed by it."""
        scene = self.scene(gradients.ROLLER)
        predict = self.model('bodies', ('-scene', scene), '-scatter', '3')
        mu = [1.03, 0.6, 11.0, 0.4, 0.03]
        report = self.agrees(predict, mu, RANGES)
        point = ('-mu', ','.join(map(repr, mu)))
        full = self.hyco('solve', '-scene', scene, *point, '-gradient')
        for output, by in full['gradient'].items():
            if output in ('peak', 'sink'):  # of modes
                continue
            for p, value in by.items():
                most = max(abs(by[q]) * (RANGES[q][1] - RANGES[q][0]) for q in by) / (RANGES[p][1] - RANGES[p][0])
                self.assertLess(abs(report['gradient'][output][p] - value), 1e-6 * max(abs(value), 1e-2 * most), (output, p))
        plain = self.hyco(*predict, *point)
        for key in ('outputs', 'contacts', 'estimated_error_outputs', 'kkt', 'rid_strain_energy'):
            self.alike(report[key], plain[key], key)

    def slope(self, command, place):
        """The derivative of the force, and whether it is said to be one of a kink."""
        report = self.hyco(*command, '-mu', f'{place!r},0.6,11,0.4,0.03', '-gradient')
        return report['gradient']['lift']['place'], bool(report['gradient_kinks'])

    def test_beside_a_kink(self):
        """At a distance from a change of masters that is a part of the difference's step the derivative is that of its own side; of models and at full order."""
        scene = self.scene(gradients.ROLLER)
        predict = self.model('bodies', ('-scene', scene), '-scatter', '3')
        low = high = 1.07
        at = {low: self.slope(predict, low)[0]}
        while abs(at[high] - at[low]) < 0.05:  # between changes of masters the derivative changes smoothly, by 0.01 in each of these steps
            low, high = high, high + 0.005
            at[high] = self.slope(predict, high)[0]
            self.assertLess(high, 2)
        while high - low > 1e-8:
            middle = (low + high) / 2
            at[middle] = self.slope(predict, middle)[0]
            low, high = (middle, high) if abs(at[middle] - at[low]) < abs(at[middle] - at[high]) else (low, middle)
        step = 3e-5 * (RANGES['place'][1] - RANGES['place'][0])
        before, after = (self.slope(predict, low + side * 3 * step)[0] for side in (-1, 1))
        self.assertGreater(abs(before - after), 0.05)
        for share in (-0.6, -0.22, 0.22, 0.6):
            for command in (predict, ('solve', '-scene', scene)):
                value, kink = self.slope(command, low + share * step)
                self.assertFalse(kink, share)
                self.assertLess(abs(value - (before if share < 0 else after)), 0.1 * abs(before - after), (share, command))

    def test_vanishing(self):
        """Derivatives that vanish are 0, not round-off: a force in balance with a load, a displacement that the obstacle gives."""
        for scene, mu, output, parameter in ((gradients.FLOATING, '2.1,230,0.2', 'lift', 'soft'), (gradients.BUMP, '1.3,0.21,12', 'low', 'modulus')):
            predict = self.model('bodies', ('-scene', self.scene(scene)), '-scatter', '2')
            by = self.hyco(*predict, '-mu', mu, '-gradient')['gradient'][output]
            self.assertEqual([name for name, value in by.items() if value == 0], [parameter])
            by = self.hyco('solve', '-scene', self.path('scene.yaml'), '-mu', mu, '-gradient')['gradient'][output]
            self.assertEqual([name for name, value in by.items() if value == 0], [parameter])

    def test_floating(self):
        """A body that contact alone holds."""
        predict = self.model('bodies', ('-scene', self.scene(gradients.FLOATING)), '-scatter', '3')
        self.agrees(predict, [2.1, 230.0, 0.2], {'soft': (1, 4), 'press': (50, 400), 'tip': (-0.5, 0.5)})

    def test_shape(self):
        """A body whose shape and ratio of moduli change, between the samples of its flexibility; means of stresses and of lengths."""
        predict = self.model('bodies', HERTZ, '-scatter', '3')
        self.agrees(predict, [0.061, 0.9, 9.7], {'press': (0.02, 0.1), 'stiffness': (0.5, 2), 'radius': (8, 12.5)})

    def test_pairs(self):
        """Hybrid and projection-based models in 3D, with forces that are reconstructed outside the RID."""
        scene = ('-scene', PELLET, '-output_squeeze_force', 'x', '-output_squeeze_contact', 'gap', '-output_peak_max', 'mises', '-output_hoop_max', 'sigma_tt',
                 '-output_hoop_group', 'contact_clad')
        for kind in ('hybrid', 'projection'):
            self.agrees(self.model(kind, scene, '-grid', '4,3', '-hyco_snapshots', 'solutions'), [4.061, 0.7], {'radius': (4.02, 4.1), 'load': (0, 1)})

    test_obstacle = test_without_contact = test_ranks = None

    def test_kink(self):
        """The bar's model: where its load closes the gap, as at full order."""
        self.bar()
        predict = self.model('bodies', ('-scene', self.folder), '-scatter', '2')
        for p, push, kinks in ((0.5, 1, 4), (0.51, 1, 0), (0.49, 0, 0)):
            r = self.hyco(*predict, '-mu', f'{p},0.5', '-gradient')
            self.assertEqual((len(r['gradient_kinks']), r['gradient_undecided']), (kinks, int(p == 0.5)))
            self.assertAlmostEqual(abs(r['gradient']['push']['p']), push, 8)

    def test_table(self):
        """A set's table on one rank and on two."""
        predict = self.model('bodies', ('-scene', self.scene(gradients.BUMP)), '-scatter', '2')
        tables = []
        for ranks in (0, 2):
            self.hyco(*predict, '-scatter', '7', '-gradient', '-table', f't{ranks}.csv', ranks=ranks)
            with open(self.path(f't{ranks}.csv'), encoding='ascii') as f:
                tables.append([{k: v for k, v in row.items() if k != 'seconds'} for row in csv.DictReader(f)])
        self.assertEqual(len(tables[0]), 7)
        self.assertIn('d_push_d_at', tables[0][0])
        for one, two in zip(*tables):
            self.assertEqual(one.keys(), two.keys())
            for key, value in one.items():  # derivatives that vanish are round-off
                self.assertTrue(value == two[key] or abs(float(value) - float(two[key])) <= 1e-12 * max(1, abs(float(value))), key)

    def test_refused(self):
        """A type without gradients, and a prediction that full order may replace."""
        predict = self.model('regression', ('-scene', self.scene(gradients.BUMP)), '-scatter', '6')
        bodies = self.model('bodies', ('-scene', self.scene(gradients.BUMP)), '-scatter', '2')
        for words, args in ((('regression', 'bodies'), predict), (('-gradient', '-hyco_fallback'), (*bodies, '-hyco_fallback', '-scene', self.path('scene.yaml')))):
            run = self.run_raw(*args, '-mu', '1.3,0.21,12', '-gradient', '-report', 'none.json')
            self.assertEqual((run.returncode, len(run.stderr.strip().splitlines())), (1, 1), run.stderr)
            for word in words:
                self.assertIn(word, run.stderr)
            self.assertFalse(os.path.exists(self.path('none.json')))


if __name__ == '__main__':
    unittest.main()
