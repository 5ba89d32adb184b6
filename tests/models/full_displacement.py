"""Displacements and stresses of models of bodies by one full-order solve with the predicted forces (-hyco_full_displacement)."""
import unittest

import h5py
import numpy as np

from common import PELLET, ROPE, Case

TYPE = ('-hyco_model_type', 'bodies')


class Displacements(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.hyco('train', '-scene', PELLET, *TYPE, '-grid', '4,2', '-hyco_validation', 8, '-model', 'p.h5')
        cls.hyco('train', '-scene', ROPE, *TYPE, '-grid', '4,4', '-hyco_validation', 10, '-model', 'r.h5')

    def fields(self, name):
        with h5py.File(self.path(name)) as f:
            return {k: f[k][:] for k in ('nodes/displacement', 'cells/stress', 'contact/lambda')}

    def test_full_displacement(self):
        """The error is that caused by the forces' error, at unseen points; the file and the report have the values on
        the whole mesh."""
        for scene, model, points in ((PELLET, 'p.h5', ('4.06,0.93', '4.087,0.71')), (ROPE, 'r.h5', ('0.071,0.17', '0.2,0.4'))):
            for mu in points:
                r = self.hyco('predict', '-model', model, '-mu', mu, '-scene', scene, '-hyco_full_displacement', '-output',
                              'out.xdmf')
                full = self.hyco('solve', '-scene', scene, '-mu', mu, '-output', 's.xdmf')
                self.assertTrue(r['full_displacement'] and not r['full_order'])
                predicted, true = self.fields('out.h5'), self.fields('s.h5')
                error = {k: np.linalg.norm(predicted[k] - true[k]) / np.linalg.norm(true[k]) for k in true}
                self.assertGreater(error['contact/lambda'], 0)
                self.assertLess(error['contact/lambda'], 1e-3 if scene == ROPE else 1e-6)
                for k in ('nodes/displacement', 'cells/stress'):
                    self.assertLessEqual(error[k], error['contact/lambda'] + 1e-12, (mu, k))
                forces = max(error['contact/lambda'], 1e-12)  # else round-off
                self.near(r['u_norm2'], full['u_norm2'], forces)
                self.near(r['strain_energy'], full['strain_energy'], 2 * forces)
                self.assertLess(r['kkt']['stationarity'], 1e-10)
                self.assertLess(r['kkt']['penetration'], forces)

    def test_ranks_and_iterations(self):
        """On two ranks, and with conjugate gradients instead of a factor, the same displacement."""
        args = ('predict', '-model', 'p.h5', '-mu', '4.06,0.93', '-scene', PELLET, '-hyco_full_displacement')
        one = self.hyco(*args)
        self.near(self.hyco(*args, ranks=2)['u_norm2'], one['u_norm2'], 1e-11)
        iterative = self.hyco(*args, '-hyco_linear', 'iterative')
        self.near(iterative['u_norm2'], one['u_norm2'], 1e-7)

    def test_with_fallback(self):
        """With the fallback, full order where a target is missed, the full solve with the forces elsewhere."""
        args = ('predict', '-model', 'p.h5', '-mu', '4.06,0.93', '-scene', PELLET, '-hyco_full_displacement', '-hyco_fallback',
                '-target_lambda')
        for target, full in ((1e-3, False), (1e-12, True)):
            r = self.hyco(*args, target)
            self.assertEqual((r['full_order'], r['full_displacement']), (full, not full))
        estimate = self.hyco('predict', '-model', 'p.h5', '-mu', '4.06,0.93')['estimated_error_u']
        for target, full in ((2 * estimate, False), (0.5 * estimate, True)):
            r = self.hyco(*args[:7], '-hyco_fallback', '-target_u', f'{target:.6g}')
            self.assertEqual((r['full_order'], r['full_displacement']), (full, False))

    def test_refused(self):
        """One line: without a scene, with another scene, of a set, of another type of model."""
        self.hyco('train', '-scene', ROPE, '-grid', '4,4', '-model', 'h.h5')
        self.hyco('train', '-scene', ROPE, '-grid', '4,4', '-hyco_model_type', 'projection', '-model', 'j.h5', '-hyco_snapshots',
                  'h.h5.snapshots')
        point = ('-mu', '0.1,0.2')
        for model, args, words in (('r.h5', point, 'give its -scene too'),
                                   ('r.h5', (*point, '-scene', PELLET), 'another scene'),
                                   ('r.h5', ('-grid', '2,2', '-scene', ROPE), 'needs a single point'),
                                   ('h.h5', (*point, '-scene', ROPE), 'this model is hybrid'),
                                   ('j.h5', (*point, '-scene', ROPE), 'this model is projection')):
            run = self.run_raw('predict', '-model', model, '-hyco_full_displacement', *args)
            self.assertEqual(run.returncode, 1, args)
            self.assertEqual(run.stderr.count('\n'), 1, run.stderr)
            self.assertIn(words, run.stderr)


if __name__ == '__main__':
    unittest.main()
