"""Extreme RIDs: one point, growing to the whole mesh, away from the contact, cutting a body in two; a singular
stiffness."""
import unittest

from common import ROPE
from extreme import SEEN, TRAIN, UNSEEN, Extreme, blocks


class Rids(Extreme):
    name = 'rids'
    CONTACT = ('-hyco_hybrid', 'contact', '-hyco_pod_tol', '0', '-hyco_pod_noise', '1e-12')

    def test_one_point(self):
        """One mode, one DEIM point, far from the contact: the model would have no forces."""
        scene = self.scene(*blocks(crown=0.1, n=(8, 8)))
        one = (*TRAIN, '-hyco_pod_max_modes', 1, '-hyco_rid_modes', 'displacement')
        self.refused('one DEIM point, no contact in the RID', 'train', '-scene', scene, '-model', 'm.h5', *one,
                     says='the RID has no contact, and the training solutions have contact forces')
        t = self.train(scene, *one, '-hyco_reconstruct', 'false')
        c = self.compare(scene, *SEEN)
        self.assertEqual((t['n_modes'], t['rid_contacts']), (1, 0))
        self.row(f"the same, displacements alone, {t['rid_nodes']} nodes", 'hybrid: error of u', c['error_u']['max'], 0.1)
        t = self.train(scene, *one, '-hyco_rid_groups', 'b_y0,a_y1', '-hyco_rid_layers', 1)
        self.row(f"one mode, the contact's elements and a layer, {t['rid_nodes']} nodes", 'hybrid: error of u',
                 self.compare(scene, *SEEN)['error_u']['max'], 0.1)

    def test_layers(self):
        """More layers, up to the whole mesh, which gives full order."""
        scene = self.scene(*blocks(crown=0.1, n=(8, 8)))
        before = 0
        for layers in (1, 2, 4, 8, 100):
            t = self.train(scene, *TRAIN, '-hyco_hybrid', 'all', '-hyco_rid_layers', layers)
            self.assertGreaterEqual(t['rid_fraction'], before)
            before = t['rid_fraction']
            error = self.worst(self.compare(scene, *UNSEEN))
            self.row(f"{layers} layers, {100 * before:.0f} % of the mesh", 'hybrid: error between training points', error,
                     1e-8 if before == 1 else 0.5)
        self.assertEqual(before, 1)

    def test_cut(self):
        """The RID contains all of b and two ends of a, connected only by the modes. Exact at the training points, whose
        solutions are in the span of the modes."""
        scene = self.scene(*blocks(crown=0.1, n=(8, 8)))
        t = self.train(scene, *TRAIN, *self.CONTACT, '-hyco_rid_modes', 'displacement', '-hyco_rid_region',
                       'y > 0.99 || x < 0.3 || x > 0.7 ? 1 : -1')
        self.assertLess(t['rid_fraction'], 1)
        self.row(f"b, and a without its middle, {100 * t['rid_fraction']:.0f} %", 'hybrid: error at a training point',
                 self.worst(self.compare(scene, *SEEN)), 1e-6)

    def test_resonance(self):
        """A reduced stiffness whose determinant changes sign inside the ranges is refused, and kept on request."""
        train = ('train', '-scene', ROPE, '-grid', '10,12', '-model', 'r.h5', '-hyco_snapshots', self.path('rope'),
                 '-hyco_deim_type', 'qdeim', '-hyco_hybrid', 'all', '-hyco_scan', 51)
        self.refused('rope, singular inside the range', *train, says='the reduced stiffness is singular inside')
        self.hyco(*train, '-hyco_keep_singular', 'true')
        self.assertIn('SINGULAR inside the ranges', self.run_raw('view', '-model', 'r.h5').stdout)


if __name__ == '__main__':
    unittest.main()
