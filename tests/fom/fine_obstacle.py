"""The rope on meshes of 1e2 to 1e5 nodes: the active set starts from coarser problems, and needs few iterations."""
import csv
import unittest

import h5py
import numpy as np

from common import ROPE, SANITIZED, Case

SIZES = [100, 1000, 10000, 100000]
POINTS = ['0.05,-0.05', '0.07,0.17', '0.1,0.5', '0.15,0.2', '0.25,0.05']
# A contact zone has two edges in each half; each is wrong by a node or two on the last level, not by a share of n.
MOST = 6


class RopeLarge(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        for n in SIZES:
            cls.rope_mesh(f'{n}.msh', n)

    def rope(self, n, mu, *more, **options):
        report = self.hyco('solve', '-scene', ROPE, '-scene_mesh', self.path(f'{n}.msh'), '-mu', mu, *more, **options)
        self.assertEqual(report['n_dof'], n - 2)
        self.solved(report)
        return report

    def fields(self, name):
        with h5py.File(self.path(name)) as f:
            order = np.argsort(f['mesh/xyz'][:, 0])
            place = np.argsort(order)
            node = {int(i): k for k, i in enumerate(f['mesh/node_id'][:, 0])}
            force = np.zeros(len(order))
            force[[place[node[int(i)]] for i in f['contact/node_id'][:, 0]]] = f['contact/lambda'][:, 0]
            return f['mesh/xyz'][:, 0][order], f['nodes/displacement'][:, 0][order], force

    def test_iterations(self):
        """The iterations of the active set do not grow with the mesh."""
        for n in SIZES:
            for mu in POINTS:
                with self.subTest(nodes=n, mu=mu):
                    r = self.rope(n, mu)
                    self.assertIn('multilevel', r['solver'])
                    self.assertLessEqual(r['active_set_iterations'], MOST)
                    self.assertGreater(r['n_active'], 0)

    def test_cold(self):
        """Without the start: more than a hundred iterations, and the same solution."""
        for mu in POINTS[1:3]:
            with self.subTest(mu=mu):
                self.rope(1000, mu, '-output', 'start.xdmf')
                cold = self.rope(1000, mu, '-hyco_solver_multilevel', 'false', '-output', 'cold.xdmf')
                self.assertNotIn('multilevel', cold['solver'])
                self.assertGreater(cold['active_set_iterations'], 50)
                _, u, force = self.fields('start.h5')
                _, u_cold, force_cold = self.fields('cold.h5')
                self.assertTrue(np.array_equal(force > 0, force_cold > 0))
                self.assertLess(abs(u - u_cold).max(), 1e-12)
                # forces are differences of u times a stiffness of 150 and more
                self.assertLess(abs(force - force_cold).max(), 1e-9 * force.max())

    def test_balance(self):
        """The contact forces and both ends carry the inner nodes' weight, 1 - h; the tension at an end is nu u' there."""
        for n in SIZES:
            with self.subTest(nodes=n):
                self.rope(n, '0.07,0.17', '-output', 'rope.xdmf')
                x, u, force = self.fields('rope.h5')
                ends = 0.07 * (u[0] - u[1]) / (x[1] - x[0]) + 0.15 * (u[-1] - u[-2]) / (x[-1] - x[-2])
                self.near(force.sum() + ends, 1 - 1 / (n - 1), 1e-9 if n < 1e5 else 1e-7, 'vertical forces')
                depth = 0.2 * (np.sin(np.pi * x) - np.sin(3 * np.pi * x)) + 0.5 - 0.17 * (x - 0.5)
                self.assertLess((-u - depth)[1:-1].max(), 1e-12)
                self.assertGreaterEqual(force.min(), 0)

    def test_convergence(self):
        """The zone's edges are known to a node: the active part of the rope and the total force converge with h."""
        r = [self.rope(n, '0.07,0.17') for n in SIZES]
        for k in range(3):
            fraction = [a['n_active'] / n for a, n in zip(r, SIZES)]
            self.assertLess(abs(fraction[k] - fraction[3]), 4 / SIZES[k])
            self.near(r[k]['total_contact_force'], r[3]['total_contact_force'], 10 / SIZES[k], SIZES[k])

    def test_steps(self):
        """One solver over a set of points, near ones and distant ones: a few iterations from the last set, then a new
        start."""
        for n in (1000, 10000):
            run = self.run_raw('solve', '-scene', ROPE, '-scene_mesh', self.path(f'{n}.msh'), '-values_mu1',
                               '0.05,0.0501,0.06,0.25,0.07', '-values_mu2', '0,0.01,0.5', '-table', 'steps.csv')
            self.assertEqual(run.returncode, 0, run.stderr)
            with open(self.path('steps.csv'), encoding='utf-8') as f:
                rows = list(csv.DictReader(f))
            self.assertEqual(len(rows), 15)
            for row in rows:
                with self.subTest(nodes=n, mu=(row['mu1'], row['mu2'])):
                    self.assertLessEqual(int(row['iterations']), 4 + MOST)
                    self.assertLess(float(row['kkt_max']), 1e-8)
                    if n > 1000:
                        continue
                    alone = self.rope(n, row['mu1'] + ',' + row['mu2'])
                    self.assertEqual(alone['n_active'], int(row['n_active']))

    def test_ranks(self):
        """The large rope on 2 ranks: the fields of one."""
        for n in SIZES[1:3]:
            with self.subTest(nodes=n):
                one = self.rope(n, '0.07,0.17', '-output', 'one.xdmf')
                two = self.rope(n, '0.07,0.17', '-output', 'two.xdmf', ranks=2)
                self.assertLessEqual(two['active_set_iterations'], MOST)
                self.assertEqual(one['n_active'], two['n_active'])
                for name in ('total_contact_force', 'strain_energy', 'u_norm2'):
                    self.near(two[name], one[name], 1e-9, name)
                _, u, force = self.fields('one.h5')
                _, u_two, force_two = self.fields('two.h5')
                self.assertLess(abs(u - u_two).max(), 1e-9 * abs(u).max())
                self.assertTrue(np.array_equal(force > 0, force_two > 0))

    @unittest.skipIf(SANITIZED, 'the sanitizers keep what is freed')
    def test_memory(self):
        """Linear in the mesh: from 1e4 to 1e5 nodes less than 2 kB a node."""
        small, large = (self.rope(n, '0.07,0.17')['memory_mb'] for n in SIZES[2:])
        self.assertLess((large - small) * 2**20 / (SIZES[3] - SIZES[2]), 2000)


if __name__ == '__main__':
    unittest.main()
