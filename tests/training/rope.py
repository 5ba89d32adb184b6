"""The reduced rope of section 6: the paper's sizes, errors not larger than those of an independent computation with the same RID."""
import csv
import unittest

import h5py
import numpy as np

from common import ROPE, Case


class Reduced(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.training = cls.hyco('train', '-scene', ROPE, '-grid', '10,12', '-grid_type', 'centred', '-model', 'rope.h5')

    def test_sizes(self):
        """The paper: 9 modes; RID of 28 nodes, 14 of them in A; one dual mode."""
        t = self.training
        self.assertEqual([t[k] for k in ('n_samples', 'n_modes', 'n_dual_modes', 'rid_nodes', 'rid_a_nodes',
                                         'rid_contacts')], [120, 9, 1, 28, 14, 14])

    def test_basis(self):
        """V on the whole mesh is orthonormal; the model's rows of it are those of its nodes."""
        with h5py.File(self.path('rope.h5')) as f:
            V = f['whole/V'][:]
            rows = f['mesh/node_whole'][:, 0]
            self.assertLess(abs(V.T @ V - np.eye(9)).max(), 1e-12)
            self.assertEqual(abs(V[rows] - f['problem/V'][:]).max(), 0)
            s = f['problem/singular_values'][:, 0]
            self.assertTrue((np.diff(s) < 0).all() and len(s) == 9)

    def test_energy(self):
        """(18): 9 modes are the fewest that leave 1e-7, recomputed by numpy from the stored snapshots."""
        import glob
        U = []
        for name in sorted(glob.glob(self.path('rope.h5.snapshots', '*.h5'))):
            with h5py.File(name) as f:
                U.append(f['U'][:].ravel())
        s2 = np.linalg.svd(np.array(U).T, compute_uv=False)**2
        left = 1 - np.cumsum(s2) / s2.sum()
        self.assertEqual(len(U), 120)
        self.assertEqual(int(np.argmax(left <= 1e-7)) + 1, 9)

    def test_errors(self):
        """100 x 120 points: u as the best of an independent computation, forces as its best row by hybrid all."""
        c = self.hyco('compare', '-scene', ROPE, '-model', 'rope.h5', '-grid', '100,120', '-table', 'table.csv')
        for name, mean, worst in (('error_u', 0.97e-2, 4.1e-2), ('error_lambda_rid', 0.31, 2.28),
                                  ('error_lambda', 0.44, 1.30)):
            self.assertGreater(c[name]['mean'], 0)
            self.assertLessEqual(c[name]['mean'], mean, name)
            self.assertLessEqual(c[name]['max'], worst, name)
        self.assertEqual((c['n_points'], c['not_converged']), (12000, 0))
        self.assertLess(c['kkt_max'], 1e-8)
        table = np.genfromtxt(self.path('table.csv'), delimiter=',', names=True)
        self.assertEqual(len(table), 12000)
        self.assertAlmostEqual(table['mu1'][0], 0.05 + 0.2 / 200, places=12)  # cell centres
        self.near(table['error_u'].mean(), c['error_u']['mean'], 1e-6)

    def test_predict_is_compare(self):
        """predict and compare at one point give the same force and error."""
        p = self.hyco('predict', '-model', 'rope.h5', '-mu', '0.07,0.17', '-output', 'p.xdmf')
        self.solved(p)
        self.hyco('solve', '-scene', ROPE, '-mu', '0.07,0.17', '-output', 's.xdmf')
        c = self.hyco('compare', '-scene', ROPE, '-model', 'rope.h5', '-values_mu1', '0.07', '-values_mu2', '0.17')
        with h5py.File(self.path('p.h5')) as p5, h5py.File(self.path('s.h5')) as s5:
            for name, key in (('nodes/displacement', 'error_u'), ('contact/lambda', 'error_lambda')):
                a, b = p5[name][:], s5[name][:]
                self.near(np.linalg.norm(a - b) / np.linalg.norm(b), c[key]['max'], 1e-9, key)

    def test_counts(self):
        """n_contacts and n_active count the whole surface, as at full order; rid_ those of the RID only, whose forces remain
        without the reconstruction."""
        full = self.hyco('solve', '-scene', ROPE, '-mu', '0.07,0.17')
        p = self.hyco('predict', '-model', 'rope.h5', '-mu', '0.07,0.17')
        alone = self.hyco('predict', '-model', 'rope.h5', '-mu', '0.07,0.17', '-hyco_reconstruct', 'false')
        self.assertEqual((p['n_contacts'], p['rid_contacts']), (full['n_contacts'], self.training['rid_contacts']))
        self.assertEqual(alone['n_active'], p['rid_active'])
        self.assertTrue(0 < p['rid_active'] < p['n_active'] < p['n_contacts'])

    def test_one_point(self):
        """compare -mu is a set of one."""
        one = self.hyco('compare', '-scene', ROPE, '-model', 'rope.h5', '-mu', '0.07,0.17')
        named = self.hyco('compare', '-scene', ROPE, '-model', 'rope.h5', '-mu_mu2', '0.17', '-mu_mu1', '0.07')
        listed = self.hyco('compare', '-scene', ROPE, '-model', 'rope.h5', '-values_mu1', '0.07', '-values_mu2', '0.17')
        self.assertEqual([r['n_points'] for r in (one, named, listed)], [1, 1, 1])
        self.alike(one['error_u'], listed['error_u'])
        self.alike(named['error_u'], listed['error_u'])
        self.assertGreater(one['error_u']['max'], 0)

    def test_one_training_point(self):
        """A training with one point is judged at points of the ranges."""
        report = self.hyco('train', '-scene', ROPE, '-grid', '1,1', '-hyco_validation', 3, '-model', 'one.h5', status=None)
        self.assertEqual((report['n_samples'], report['held_out']['n']), (1, 3))

    def test_some_fail(self):
        """A set with points that do not converge: the table has all, the last line gives their number, and the status is not 0."""
        for command, where, its in (('predict', ('-model', 'rope.h5'), 5), ('solve', ('-scene', ROPE), 1)):
            run = self.run_raw(command, *where, '-grid', '8,8', '-table', 'some.csv', '-hyco_solver_max_its', its,
                               '-hyco_solver_fallback', 'false')
            self.assertEqual(run.returncode, 1)
            with open(self.path('some.csv'), encoding='utf-8') as f:
                rows = list(csv.DictReader(f))
            failed = sum(row['converged'] == '0' for row in rows)
            self.assertTrue(len(rows) == 64 and 0 < failed < 64, failed)
            self.assertEqual(run.stderr, f'hyco: error: {failed} of the 64 points did not converge; the column converged of some.csv '
                                         'says which\n')
            self.assertIn(f'{failed} not converged', run.stdout.splitlines()[-1])

    def test_rank(self):
        """-hyco_hybrid rank: 14 contacts and 9 modes leave 5 full-order displacements, as in the paper."""
        t = self.hyco('train', '-scene', ROPE, '-grid', '10,12', '-grid_type', 'centred', '-model', 'rank.h5', '-hyco_snapshots',
                      'rope.h5.snapshots', '-hyco_hybrid', 'rank', '-hyco_hybrid_trials', 300)
        self.assertEqual((t['n_fe_dofs'], t['rid_nodes'], t['n_modes']), (5, 28, 9))
        c = self.hyco('compare', '-scene', ROPE, '-model', 'rank.h5', '-grid', '10,12')
        self.assertLess(c['error_u']['mean'], 0.12)  # worse than the first five of A: not judged by error
        self.assertLess(c['kkt_max'], 1e-8)


if __name__ == '__main__':
    unittest.main()
