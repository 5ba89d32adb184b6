"""Pellet and cladding (section 7), mesh A: nine radii without 4.06 by 25 steps, judged at 4.06 over all steps."""
import os
import unittest

from common import PELLET, Case

RADII = '4.02,4.03,4.04,4.05,4.055,4.07,4.08,4.09,4.10'
STEPS = ','.join('%.2f' % (k / 25) for k in range(1, 26))
MESH = os.environ.get('PELLET_MESH', 'A')
EXTRA = ('-scene_mesh', os.path.join(PELLET, MESH + '.msh'))


class Pellet(Case):
    timeout = 250
    limits = {'error_u_rid': 0.003, 'error_sigma_11': 0.005}
    rid_fraction = 0.5
    force = 1409.70532353

    def test_prediction(self):
        """The errors at the unseen radius are below their limits, and the force is that of full order."""
        t = self.hyco('train', '-scene', PELLET, '-values_radius', RADII, '-values_load', STEPS, '-model', 'm.h5',
                      *EXTRA, timeout=self.timeout)
        self.assertEqual(t['n_samples'], 225)
        self.assertLess(t['rid_fraction'], self.rid_fraction)
        c = self.hyco('compare', '-scene', PELLET, '-model', 'm.h5', '-values_radius', '4.06', '-values_load', STEPS,
                      *EXTRA, timeout=self.timeout)
        for name, limit in self.limits.items():
            self.assertGreater(c[name]['max'], 0)
            self.assertLess(c[name]['max'], limit, name)
        self.assertEqual(c['not_converged'], 0)
        self.assertLess(c['kkt_max'], 1e-8)
        self.covered(c['covered_force']['min'])
        p = self.hyco('predict', '-model', 'm.h5', '-mu', '4.06,1')
        self.solved(p)
        self.near(p['total_contact_force'], self.force, 0.05)
        self.covered(p['covered_force'])

    def covered(self, share):
        self.assertTrue(0.1 < share < 1 + 1e-12, f'share of the force in the RID: {share}')


if __name__ == '__main__':
    unittest.main()
