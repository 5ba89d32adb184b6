"""Iterative solves (-hyco_linear iterative): the iterations of conjugate gradients and of the active set do not grow with the mesh or the ranks,
and the solution is that with a factor. Counts, not seconds."""
import csv
import os
import re
import unittest

from common import PELLET, ROPE, SOURCE, Case

EXAMPLES = os.path.join(SOURCE, 'examples')
MOST, SETS = 40, 12  # iterations of a solve, sets: at every size
EVEN = 1.25  # peak memory of a rank over the mean


class Iterative(Case):
    def counts(self, report):
        """Iterations of conjugate gradients in all, and at most in one solve."""
        found = re.search(r'iterative: cg with gamg.*; (\d+) iterations in (\d+) solves, at most (\d+)', report['linear'])
        self.assertTrue(found, report['linear'])
        self.assertEqual(int(found[2]), report['active_set_iterations'])
        return int(found[1]), int(found[3])

    def held(self, scene, mu, *options, ranks=(0, 2), most=MOST):
        direct = self.hyco('solve', '-scene', scene, '-mu', mu, *options, '-hyco_linear', 'direct')
        for n in ranks:
            with self.subTest(scene=scene, options=options, ranks=n):
                r = self.hyco('solve', '-scene', scene, '-mu', mu, *options, '-hyco_linear', 'iterative', ranks=n)
                self.assertEqual(r['solver'], 'active_set projected')
                self.assertEqual(r['n_active'], direct['n_active'])
                self.near(r['total_contact_force'], direct['total_contact_force'], 1e-7)
                self.solved(r)
                self.assertLessEqual(self.counts(r)[1], most)
                self.assertLessEqual(r['active_set_iterations'], SETS)
                self.assertLessEqual(r['memory_mb_largest_rank'] * max(1, n), EVEN * r['memory_mb'])

    def test_pellet(self):
        """A, and A with each cell cut into eight."""
        self.held(PELLET, '4.06,1')
        self.held(PELLET, '4.06,1', '-scene_refine', '1', ranks=(2,))

    def test_unseen(self):
        """Scenes by which no setting was chosen: matching and other surfaces, 2D and 3D."""
        for name, mu in (('hertz', '0.06,1,10'), ('roller', '0,0.6,10'), ('roller3d', '0,0.5,10'), ('blocks', '0.05,0.05'), ('wavy', '0.0005,2')):
            self.held(os.path.join(EXAMPLES, name, 'scene.yaml'), mu, most=20)

    def test_overlap(self):
        """No loads: only the overlap as drawn acts."""
        self.held(PELLET, '4.06,0', '-contact_gap_gap', '-0.01', ranks=(0,))

    def test_ramp(self):
        """Several points on one K, each starting from the last one's contacts; a preconditioner that is not a multigrid."""
        table = self.path('ramp.csv')
        for options in ((), ('-hyco_primal_pc_type', 'icc')):
            rows = []
            for linear in ('direct', 'iterative'):
                self.hyco('solve', '-scene', PELLET, '-values_radius', '4.06', '-values_load', '0.4,0.7,1', '-hyco_linear', linear, '-table', table,
                          *(options if linear == 'iterative' else ()))
                with open(table, encoding='utf-8', newline='') as file:
                    rows.append(list(csv.DictReader(file)))
            for direct, iterative in zip(*rows):
                self.assertEqual(direct['n_active'], iterative['n_active'])
                self.near(float(iterative['total_contact_force']), float(direct['total_contact_force']), 1e-7)

    def test_travels(self):
        """Contacts that change from point to point: other gap coordinates, and multigrid with levels of other sizes."""
        self.hyco('solve', '-scene', os.path.join(EXAMPLES, 'roller3d'), '-values_place', '-4,4', '-values_press', '0.3', '-values_modulus', '10',
                  '-hyco_linear', 'iterative', '-hyco_solver_form', 'primal')

    def test_form(self):
        """By name; refused without iterations."""
        args = ('solve', '-scene', PELLET, '-mu', '4.06,1', '-hyco_solver_form', 'projected')
        self.assertEqual(self.hyco(*args, '-hyco_linear', 'iterative')['solver'], 'active_set projected')
        run = self.run_raw(*args)
        self.assertEqual(run.returncode, 1)
        self.assertIn('the form projected needs -hyco_linear iterative', run.stderr)
        primal = self.hyco('solve', '-scene', PELLET, '-mu', '4.06,1', '-hyco_solver_form', 'primal', '-hyco_linear', 'iterative')
        self.assertEqual(primal['solver'], 'active_set primal')
        rope = self.hyco('solve', '-scene', ROPE, '-mu', '0.07,0.17', '-hyco_linear', 'iterative')  # an obstacle under all of it
        self.assertEqual(rope['solver'], 'active_set primal, multilevel start')


if __name__ == '__main__':
    unittest.main()
