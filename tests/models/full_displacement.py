"""Displacements and stresses of models of bodies by one full-order solve with the predicted forces (-hyco_full_displacement)."""
import unittest

import h5py
import numpy as np

from common import PELLET, ROPE, Case

TYPE = ('-hyco_model_type', 'bodies')
DOWN = """
Point(1) = {0, 0, 0}; Point(2) = {6, 0, 0}; Point(3) = {6, 2, 0}; Point(4) = {0, 2, 0};
Point(5) = {1, 2.3, 0}; Point(6) = {4, 2.3, 0}; Point(7) = {4, 4, 0}; Point(8) = {1, 4, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1}; Line(5) = {5, 6}; Line(6) = {6, 7}; Line(7) = {7, 8}; Line(8) = {8, 5};
Curve Loop(1) = {1:4}; Curve Loop(2) = {5:8}; Plane Surface(1) = {1}; Plane Surface(2) = {2};
Transfinite Curve {1, 3} = 13; Transfinite Curve {2, 4, 6, 8} = 5; Transfinite Curve {5, 7} = 10;
Transfinite Surface {1, 2}; Recombine Surface {1, 2};
Physical Surface("lower") = {1}; Physical Surface("upper") = {2}; Physical Curve("base") = {1}; Physical Curve("floor") = {3};
Physical Curve("under") = {5}; Physical Curve("top") = {7}; Physical Curve("side") = {8};
"""
FLOATING = """
scene: {title: a block comes down, mesh: down.msh, parameters: [load]}
parameter: {load: {range: [0.5, 2]}}
body: {lower: {young: 1000, poisson: 0.3}, upper: {young: 2000, poisson: 0.3}}
fixed: {base: {x: 0, y: 0}, side: {x: 0}}
pressure: {top: load*(1 + x/20)}
contact: {c: {type: surface, slave: under, master: floor, tolerance: 1}}
output: {top: {mean: u_y, group: top}}
"""


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

    def test_floating(self):
        """A block that contact alone holds, on one rank and on two: it comes down onto the other, which the forces alone do not say."""
        self.drawn('down', 2, DOWN, FLOATING)
        scene = self.path('down')
        self.hyco('train', '-scene', scene, *TYPE, '-grid', 3, '-model', self.path('d.h5'))
        full = self.hyco('solve', '-scene', scene, '-mu', 0.7)
        for ranks in (0, 2):
            r = self.hyco('predict', '-model', self.path('d.h5'), '-mu', 0.7, '-scene', scene, '-hyco_full_displacement', ranks=ranks)
            self.near(r['outputs']['top'], full['outputs']['top'], 1e-9)
            self.near(r['u_norm2'], full['u_norm2'], 1e-9)
            self.assertLess(r['kkt']['complementarity'], 1e-9)

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
