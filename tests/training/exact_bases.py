"""Properties that make the reduced model exact: the whole mesh as RID with a basis that contains the solution."""
import unittest

from common import PELLET, ROPE, Case

WHOLE = ('-hyco_rid_whole', 'true')


class Exact(Case):
    def same(self, scene, model, *point, tolerance=1e-9):
        c = self.hyco('compare', '-scene', scene, '-model', model, *point)
        for name in ('error_u', 'error_u_rid', 'error_sigma', 'error_sigma_11', 'error_lambda_rid', 'error_lambda'):
            self.assertLess(c[name]['max'], tolerance, name)
        self.assertEqual((c['not_converged'], c['undefined']), (0, 0))
        self.assertAlmostEqual(c['covered_force']['min'], 1, places=9)

    def test_rope_all(self):
        """All displacements full order on the whole mesh: full order, at unseen parameters."""
        t = self.hyco('train', '-scene', ROPE, '-grid', '3,3', '-model', 'r.h5', '-hyco_hybrid', 'all', *WHOLE)
        self.assertEqual((t['rid_nodes'], t['n_fe_dofs'], t['rid_fraction']), (100, 98, 1))
        self.same(ROPE, 'r.h5', '-grid', '4,5')

    def test_pellet_all(self):
        """The pellet with the whole mesh as RID and all contact unknowns: the full order."""
        t = self.hyco('train', '-scene', PELLET, '-values_radius', '4.02,4.10', '-values_load', '0.5,1', '-model',
                      'p.h5', '-hyco_hybrid', 'all', *WHOLE)
        self.assertEqual(t['rid_fraction'], 1)
        self.same(PELLET, 'p.h5', '-values_radius', '4.06', '-values_load', '0.3,1')

    def test_pellet_contact(self):
        """Contact displacements full order, all modes kept: exact at a training point."""
        self.hyco('train', '-scene', PELLET, '-values_radius', '4.02,4.06,4.10', '-values_load', '0.5,1', '-model',
                  'q.h5', '-hyco_hybrid', 'contact', '-hyco_pod_tol', '0', '-hyco_pod_noise', '1e-14', *WHOLE)
        self.same(PELLET, 'q.h5', '-values_radius', '4.06', '-values_load', '1', tolerance=1e-7)
        c = self.hyco('compare', '-scene', PELLET, '-model', 'q.h5', '-values_radius', '4.06', '-values_load', '0.8')
        self.assertGreater(c['error_u']['max'], 1e-9)  # and not elsewhere: the test can distinguish


if __name__ == '__main__':
    unittest.main()
