"""What a prediction says of its own error: against the truth at points it has not seen, outside the ranges, and what follows."""
import csv
import statistics
import unittest

from common import PELLET, ROPE, Case

FINE = ('-hyco_pod_tol', '1e-11', '-hyco_deim_type', 'qdeim', '-hyco_rid_layers', 1, '-hyco_hybrid', 'all')
ERRORS = (('estimated_error_u', 'error_u'), ('estimated_error_lambda', 'error_lambda'))


class Trust(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        for name, recipe in (('rough.h5', ()), ('fine.h5', FINE)):
            t = cls.hyco('train', '-scene', ROPE, '-grid', '10,12', '-model', name, *recipe)
            assert t['held_out_predictions'] == 120, 'each training solution is held out once'

    def table(self, name):
        with open(self.path(name), encoding='utf-8') as f:
            return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(f)]

    def test_bounds_the_error(self):
        """Calibrated to bound 95 % of what was held out, with a margin: 85 % of 500 unseen points at least, not by more than 30 in the median."""
        for model in ('rough.h5', 'fine.h5'):
            self.hyco('predict', '-model', model, '-grid', '25,20', '-table', 'p.csv')
            self.hyco('compare', '-scene', ROPE, '-model', model, '-grid', '25,20', '-table', 'c.csv')
            for estimate, error in ERRORS:
                pairs = [(p[estimate], c[error]) for p, c in zip(self.table('p.csv'), self.table('c.csv'))]
                self.assertEqual(len(pairs), 500)
                bounded = sum(e >= true for e, true in pairs) / len(pairs)
                self.assertGreaterEqual(bounded, 0.85, (model, error))
                ratio = statistics.median(e / true for e, true in pairs)
                self.assertTrue(1 <= ratio <= 30, (model, error, ratio))

    def test_tells_models_apart(self):
        """The fine model is some hundred times better, and says so."""
        rough, fine = (self.hyco('predict', '-model', m, '-mu', '0.12,0.2') for m in ('rough.h5', 'fine.h5'))
        for estimate, _ in ERRORS:
            self.assertGreater(rough[estimate], 10 * fine[estimate])

    def test_outside(self):
        """Refused; with -extrapolate the estimate grows with the distance, and the report says how far it is."""
        run = self.run_raw('predict', '-model', 'fine.h5', '-mu', '0.26,0.2')
        self.assertEqual(run.returncode, 1)
        self.assertIn('mu1 = 0.26 lies outside its range [0.05, 0.25]', run.stderr)
        inside = self.hyco('predict', '-model', 'fine.h5', '-mu', '0.25,0.2', '-extrapolate')
        self.assertFalse(inside['extrapolated'])
        before = inside
        for mu1 in (0.27, 0.30, 0.40):
            p = self.hyco('predict', '-model', 'fine.h5', '-mu', f'{mu1},0.2', '-extrapolate')
            self.assertTrue(p['extrapolated'])
            self.near(p['beyond'], (mu1 - 0.25) / 0.2, 1e-9, 'share of the range')
            for estimate, _ in ERRORS:
                self.assertGreater(p[estimate], 1.5 * before[estimate])
            before = p
        self.assertGreater(before['estimated_error_u'], 100 * inside['estimated_error_u'])
        said = self.run_raw('predict', '-model', 'rough.h5', '-mu', '0.9,0.2', '-extrapolate').stdout
        self.assertRegex(said, r'estimated errors: u \d{3,} %, contact forces \d{3,} %\n')
        self.assertIn('outside the training points by 325 % of a range', said)

    def test_fallback(self):
        """The points whose estimate is above the target are solved full order, exactly as hyco solve does; the others not."""
        args = ('-grid', '4,4', '-table')
        self.hyco('predict', '-model', 'rough.h5', *args, 'p.csv')
        self.hyco('solve', '-scene', ROPE, *args, 's.csv')
        estimates = sorted(p['estimated_error_lambda'] for p in self.table('p.csv'))
        target = (estimates[7] + estimates[8]) / 2
        self.assertLess(estimates[7], estimates[8])
        for ranks in (0, 2):
            self.hyco('predict', '-model', 'rough.h5', *args, 'f.csv', '-scene', ROPE, '-hyco_fallback', '-target_lambda',
                      f'{target:.12g}', ranks=ranks)
            full = 0
            for p, s, f in zip(self.table('p.csv'), self.table('s.csv'), self.table('f.csv')):
                self.assertEqual(f['full_order'], p['estimated_error_lambda'] > target)
                self.near(f['total_contact_force'], (s if f['full_order'] else p)['total_contact_force'], 1e-6)
                full += f['full_order']
            self.assertEqual(full, 8)
        one = self.hyco('predict', '-model', 'rough.h5', '-mu', '0.12,0.2', '-scene', ROPE, '-hyco_fallback', '-target_u', 1e-6)
        true = self.hyco('solve', '-scene', ROPE, '-mu', '0.12,0.2')
        self.assertTrue(one['full_order'])
        self.assertEqual([one[k] for k in ('n_dof', 'n_contacts', 'n_active', 'n_modes')], [98, 98, true['n_active'], 0])
        self.assertNotIn('rid_nodes', one)
        self.near(one['u_norm2'], true['u_norm2'], 1e-9, 'u')
        kept = self.hyco('predict', '-model', 'rough.h5', '-mu', '0.12,0.2', '-scene', ROPE, '-hyco_fallback', '-target_u', 1)
        self.assertFalse(kept['full_order'])

    def test_no_calibration(self):
        """Without folds, and for a projection-based model: no estimate, and it says so; a target then means full order."""
        for name, args in (('n.h5', ('-hyco_trust_folds', 0)), ('p.h5', ('-hyco_model_type', 'projection'))):
            t = self.hyco('train', '-scene', ROPE, '-grid', '4,4', '-model', name, '-hyco_snapshots', 's', *args)
            self.assertEqual(t['held_out_predictions'], 0)
            p = self.hyco('predict', '-model', name, '-mu', '0.12,0.2')
            self.assertIsNone(p['estimated_error_u'])
            self.assertIsNone(p['estimated_error_lambda'])
            said = self.run_raw('predict', '-model', name, '-mu', '0.12,0.2').stdout
            self.assertIn('estimated errors: u none, contact forces none', said)
            p = self.hyco('predict', '-model', name, '-mu', '0.12,0.2', '-scene', ROPE, '-hyco_fallback', '-target_u', 0.1)
            self.assertTrue(p['full_order'])

    def test_unseen(self):
        """Inside the scene's ranges but outside what training has seen: said, and the estimate of forces that training never saw
        is none, which asks for full order."""
        self.hyco('train', '-scene', PELLET, '-values_radius', '4.02,4.03,4.04', '-values_load', '0.1,0.2,0.3,0.4', '-model', 'few.h5')
        near = self.hyco('predict', '-model', 'few.h5', '-mu', '4.035,0.3')
        self.assertFalse(near['extrapolated'])
        p = self.hyco('predict', '-model', 'few.h5', '-mu', '4.1,1')
        self.assertTrue(p['extrapolated'])
        self.near(p['beyond'], (4.1 - 4.045) / 0.08, 1e-6)
        self.assertGreater(p['estimated_error_u'], near['estimated_error_u'])
        self.assertIsNone(p['estimated_error_lambda'])
        p = self.hyco('predict', '-model', 'few.h5', '-mu', '4.1,1', '-hyco_fallback', '-scene', PELLET, '-target_lambda', 0.01)
        self.assertTrue(p['full_order'])

    def test_complaints(self):
        for args, words in ((('-target_u', 0.1), 'give -hyco_fallback too'), (('-hyco_fallback',), 'give its -scene'),
                            (('-hyco_fallback', '-scene', ROPE, '-target_u', 0), 'a relative error above 0 and at most 1'),
                            (('-hyco_fallback', '-scene', ROPE, '-target_lambda', 2), 'a relative error above 0 and at most 1'),
                            (('-hyco_fallback', '-scene', ROPE, '-body_rope_young', 1, '-target_u', 0.1), 'another scene')):
            run = self.run_raw('predict', '-model', 'fine.h5', '-mu', '0.1,0.2', *args)
            self.assertEqual(run.returncode, 1, args)
            self.assertEqual(run.stderr.count('\n'), 1, run.stderr)
            self.assertIn(words, run.stderr)


if __name__ == '__main__':
    unittest.main()
