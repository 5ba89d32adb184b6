"""Full order on the two examples, by every method and form. Numbers: an independent computation of the paper's sections 6, 7."""
import csv
import os
import unittest

import h5py
import numpy as np

from common import PELLET, ROPE, Case

METHODS = [('active_set', 'dual'), ('active_set', 'primal'), ('tao', 'dual'), ('tao', 'primal'), ('lemke', 'dual'),
           ('active_set', 'auto')]


class Rope(Case):
    def test_methods(self):
        """The rope by every method and form."""
        for kind, form in METHODS:
            with self.subTest(type=kind, form=form):
                r = self.hyco('solve', '-scene', ROPE, '-mu', '0.07,0.17', '-hyco_solver_type', kind,
                              '-hyco_solver_form', form)
                self.assertEqual((r['n_dof'], r['n_contacts'], r['n_active']), (98, 98, 17))
                self.near(r['total_contact_force'], 0.3502256293, 1e-8 if kind == 'tao' else 1e-9)
                self.solved(r)

    def test_equilibrium(self):
        """The obstacle and the ends carry the weight: K u + B^T L = F, computed from the written fields."""
        self.hyco('solve', '-scene', ROPE, '-mu', '0.07,0.17', '-output', 'rope.xdmf')
        with h5py.File(self.path('rope.h5')) as f:
            x = f['mesh/xyz'][:, 0]
            u = f['nodes/displacement'][:, 0]
            force = f['contact/lambda'][:, 0]
            gap = f['contact/gap'][:, 0]
            node = {int(i): k for k, i in enumerate(f['mesh/node_id'][:, 0])}
            slave = [node[int(i)] for i in f['contact/node_id'][:, 0]]
        order = np.argsort(x)
        position = {int(i): k for k, i in enumerate(order)}
        x, u = x[order], u[order]
        h = np.diff(x)
        self.assertTrue(np.allclose(h, 1 / 99, rtol=1e-12))  # 100 nodes
        half = np.clip((0.5 - x[:-1]) / h, 0, 1)             # the element that straddles 0.5 takes the exact average
        nu = half * 0.07 + (1 - half) * 0.15
        tension = nu * np.diff(u) / h
        weight = -1 / 99
        contact = np.zeros(100)
        contact[[position[s] for s in slave]] = force
        # a node inside: -(t_right - t_left) = weight + contact (upward)
        residual = -(tension[1:] - tension[:-1]) - weight - contact[1:-1]
        self.assertLess(abs(residual).max(), 5e-11)  # of weights 1e-2; strains are differences of u over h
        depth = 0.2 * (np.sin(np.pi * x) - np.sin(3 * np.pi * x)) + 0.5 - 0.17 * (x - 0.5)
        self.assertLess(max(-u - depth), 1e-12)
        self.assertGreaterEqual(force.min(), 0)
        self.assertEqual(np.count_nonzero(contact > 0), 17)
        at = np.array([position[s] for s in slave])
        self.assertLess(abs(gap - (depth[at] + u[at])).max(), 1e-12)
        self.assertLess(abs(gap * force).max(), 1e-14)

    def test_named_values(self):
        """-mu_NAME sets a parameter by its name."""
        r = self.hyco('solve', '-scene', ROPE, '-mu_mu2', '0.17', '-mu_mu1', '0.07')
        self.near(r['total_contact_force'], 0.3502256293, 1e-9)

    def test_override(self):
        """An entry of the command line takes precedence over the scene's: a rope of twice the stiffness under twice the
        weight."""
        twice = self.hyco('solve', '-scene', ROPE, '-mu', '0.07,0.17', '-force_rope_x', '-2', '-body_rope_young',
                          'x <= 0.5 ? 2*mu1 : 0.3')
        self.near(twice['total_contact_force'], 2 * 0.3502256293, 1e-8)
        self.assertEqual(twice['n_active'], 17)


class Pellet(Case):
    def test_methods(self):
        """The pellet by every method and form."""
        for kind, form in [m for m in METHODS if m != ('tao', 'primal')]:
            with self.subTest(type=kind, form=form):
                r = self.hyco('solve', '-scene', PELLET, '-mu', '4.06,1', '-hyco_solver_type', kind,
                              '-hyco_solver_form', form)
                self.assertEqual((r['n_contacts'], r['n_active']), (189, 45))
                self.near(r['total_contact_force'], 1409.70532353, 1e-8)
                self.solved(r)

    def test_fields(self):
        """Newton's third law and the supports, from the written fields; the gap is 4.1 - radius less n.(u_p - u_c)."""
        self.hyco('solve', '-scene', PELLET, '-mu', '4.06,1', '-output', 'a.xdmf')
        with h5py.File(self.path('a.h5')) as f:
            x, u = f['mesh/xyz'][:], f['nodes/displacement'][:]
            force = f['nodes/contact_force'][:]
            total = f['contact/lambda'][:].sum()
            gap, active = f['contact/gap'][:, 0], f['contact/lambda'][:, 0] > 0
        self.near(total, 1409.70532353, 1e-8)
        self.assertLess(abs(force.sum(axis=0)).max(), 1e-9 * total)
        for c in range(3):
            self.assertEqual(abs(u[abs(x[:, c]) < 1e-12, c]).max(), 0)
        self.assertLess(abs(gap[active]).max(), 1e-12)
        self.assertGreater(gap[~active].min(), 0)

    def test_set(self):
        """A set of points: a line each, the same numbers as one at a time, whatever was solved before."""
        r = self.hyco('solve', '-scene', PELLET, '-values_radius', '4.06,4.08', '-values_load', '0.4,1', '-table', 'set.csv')
        self.assertEqual((r['n_points'], r['not_converged']), (4, 0))
        with open(self.path('set.csv'), encoding='ascii') as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(len(rows), 4)
        for row in rows:
            one = self.hyco('solve', '-scene', PELLET, '-mu', f'{row["radius"]},{row["load"]}')
            self.assertEqual((int(row['n_active']), int(row['converged'])), (one['n_active'], 1))
            self.near(float(row['total_contact_force']), one['total_contact_force'], 2e-7)
            self.near(float(row['strain_energy']), one['strain_energy'], 2e-7)

    @unittest.skipUnless(os.environ.get('HYCO_PTSCOTCH', '1') == '1', 'this PETSc was built without PT-Scotch')
    def test_partition(self):
        """The pellet partitioned by PT-Scotch on 2 to 4 ranks."""
        for ranks in (2, 3, 4):
            r = self.hyco('solve', '-scene', PELLET, '-mu', '4.06,1', '-hyco_partition', 'ptscotch', ranks=ranks)
            self.near(r['total_contact_force'], 1409.70532353, 1e-9)
            self.solved(r)

    def test_linear(self):
        """Without a factor: on request, or because it would not fit; the report says which."""
        for ranks, options in ((0, ('-hyco_linear', 'iterative')), (2, ('-hyco_memory', '0.001')),
                               (0, ('-hyco_linear', 'iterative', '-hyco_primal_pc_type', 'icc'))):
            with self.subTest(options=options):
                r = self.hyco('solve', '-scene', PELLET, '-mu', '4.06,1', *options, ranks=ranks)
                self.assertEqual((r['n_contacts'], r['n_active']), (189, 45))
                self.near(r['total_contact_force'], 1409.70532353, 1e-7)
                self.solved(r)
                self.assertRegex(r['linear'], 'iterative: cg with (gamg|icc)')
        self.assertRegex(self.hyco('solve', '-scene', PELLET, '-mu', '4.06,1')['linear'], '^direct: mumps, 0.* GB')
        run = self.run_raw('solve', '-scene', PELLET, '-mu', '4.06,1', '-hyco_linear', 'iterative', '-hyco_solver_form', 'dual')
        self.assertEqual(run.returncode, 1)
        self.assertIn('-hyco_linear iterative works with the forms primal', run.stderr)

    def test_no_contact_at_no_load(self):
        """No load: no contact, no force, no energy."""
        r = self.hyco('solve', '-scene', PELLET, '-mu', '4.06,0')
        self.assertEqual((r['n_active'], r['total_contact_force'], r['strain_energy']), (0, 0, 0))

    def test_linear_without_gap(self):
        """At radius 4.1 the gap is zero and the problem positively homogeneous: everything grows with the load."""
        half, full = (self.hyco('solve', '-scene', PELLET, '-mu', f'4.1,{load}') for load in (0.5, 1))
        self.assertEqual(half['n_active'], full['n_active'])
        self.near(2 * half['total_contact_force'], full['total_contact_force'], 1e-10)
        self.near(4 * half['strain_energy'], full['strain_energy'], 1e-10)


if __name__ == '__main__':
    unittest.main()
