"""The same numbers on 1, 2, 3 and 4 ranks: full order, training (with the ranks apart and together), prediction."""
import unittest

import h5py
import numpy as np

from common import PELLET, ROPE, Case

SIZES = ('n_samples', 'n_modes', 'n_dual_modes', 'n_stress_modes', 'n_force_modes', 'n_fe_dofs', 'rid_nodes',
         'rid_a_nodes', 'rid_elements', 'rid_contacts')
ARRAYS = ('mesh/cell_id', 'mesh/node_id', 'problem/role', 'problem/in_rid', 'problem/fe_dof', 'problem/pairs/slave')
RANKS = (1, 2, 3, 4)


class Ranks(Case):
    def same_solve(self, scene, mu):
        one = self.hyco('solve', '-scene', scene, '-mu', mu)
        for ranks in RANKS:
            with self.subTest(ranks=ranks):
                r = self.hyco('solve', '-scene', scene, '-mu', mu, ranks=ranks)
                self.assertEqual(r['ranks'], ranks)
                self.near(r['total_contact_force'], one['total_contact_force'], 1e-10)
                self.near(r['strain_energy'], one['strain_energy'], 1e-10)
                self.assertEqual((r['n_dof'], r['n_active']), (one['n_dof'], one['n_active']))
                self.solved(r)

    def test_solve_rope(self):
        """Full order on the rope."""
        self.same_solve(ROPE, '0.07,0.17')

    def test_solve_pellet(self):
        """Full order on the pellet."""
        self.same_solve(PELLET, '4.06,1')

    def test_fields(self):
        """Fields on two ranks come out in the file's order, as on one."""
        for ranks in (1, 3):
            self.hyco('solve', '-scene', PELLET, '-mu', '4.06,1', '-output', f'f{ranks}.xdmf', ranks=ranks)
        with h5py.File(self.path('f1.h5')) as a, h5py.File(self.path('f3.h5')) as b:
            for name in ('mesh/xyz', 'mesh/cells', 'nodes/displacement', 'nodes/contact_force', 'cells/stress',
                         'contact/lambda', 'contact/gap', 'contact/node_id'):
                x, y = a[name][:], b[name][:]
                self.assertLess(abs(x - y).max(), 1e-8 * abs(x).max() + 1e-300, name)

    def same_training(self, scene, samples, mu, cases):
        reports, forces, arrays = [], [], []
        for ranks, groups in cases:
            model = f'{ranks}_{groups}.h5'
            extra = ['-hyco_groups', groups] if groups else []
            reports.append(self.hyco('train', '-scene', scene, *samples, '-model', model, *extra, ranks=ranks))
            forces.append(self.hyco('predict', '-model', model, '-mu', mu, ranks=ranks)['total_contact_force'])
            with h5py.File(self.path(model)) as f:
                arrays.append({name: f[name][:] for name in ARRAYS})
        for case, report, force, array in zip(cases, reports, forces, arrays):
            with self.subTest(ranks=case[0], groups=case[1]):
                for key in SIZES:
                    self.assertEqual(report[key], reports[0][key], key)
                self.near(force, forces[0], 1e-8)
                for name in ARRAYS:
                    self.assertTrue(np.array_equal(array[name], arrays[0][name]), name)

    def test_train_rope(self):
        """Training on the rope, by several groups of ranks."""
        self.same_training(ROPE, ('-grid', '6,8'), '0.07,0.17', [(1, 0), (2, 0), (3, 0), (4, 0), (2, 1), (4, 2)])

    def test_train_pellet(self):
        """Training on the pellet, by several groups of ranks."""
        self.same_training(PELLET, ('-values_radius', '4.03,4.05,4.08', '-values_load', '0.4,0.7,1'), '4.06,1',
                           [(1, 0), (2, 0), (3, 0), (4, 0), (2, 1), (4, 1)])

    def test_compare(self):
        """hyco compare on 1 and 3 ranks."""
        self.hyco('train', '-scene', ROPE, '-grid', '5,6', '-model', 'c.h5')
        a, b = (self.hyco('compare', '-scene', ROPE, '-model', 'c.h5', '-grid', '7,5', ranks=r) for r in (1, 3))
        for key in ('error_u', 'error_lambda', 'error_sigma'):
            self.near(b[key]['mean'], a[key]['mean'], 1e-6, key)
            self.near(b[key]['max'], a[key]['max'], 1e-6, key)


if __name__ == '__main__':
    unittest.main()
