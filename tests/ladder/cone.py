"""A contact law that a program registers (examples/ladder/cone.c): a threshold of friction on the roller's contacts, compared with the command
where it is 0."""
import os
import unittest

from common import SOURCE, Program

ROLLER = ['-scene', os.path.join(SOURCE, 'examples', 'roller'), '-mu', '1,0.6,12']


class Cone(Program):
    name = 'cone'
    out = r'last solve: (\w+), (.+), (\d+) iterations, largest residual (\S+)\nnormal forces (\S+), tangential (\S+), largest (\S+)'

    def step(self, threshold, ranks=0):
        """Sums of normal and tangential forces, and the largest of these."""
        reason, method, _, residual, *forces = self.solve(*ROLLER, '-threshold', threshold, ranks=ranks)
        self.assertEqual((reason, method), ('converged', 'semismooth dual'))
        self.assertLess(residual, 1e-12)
        return forces

    def test_threshold(self):
        """Without a threshold the forces are those of hyco solve; with one, tangential forces reach it, and are the same on 1 to
        3 ranks."""
        normal, tangential, _ = self.step(0)
        self.near(normal, self.hyco('solve', *ROLLER)['total_contact_force'], 1e-9)
        self.assertEqual(tangential, 0)
        slip = self.step(0.03)
        self.assertGreater(abs(slip[0] - normal), 1e-2)
        self.assertEqual(slip[2], 0.03)
        for ranks in (2, 3):
            for a, b in zip(self.step(0.03, ranks), slip):
                self.near(a, b, 1e-9)

    def test_refused(self):
        """A method for forces >= 0 refuses the system in one line."""
        self.refused(['hyco: error: active_set solves systems with contact forces >= 0 only', 'use -hyco_solver_type semismooth'],
                     *ROLLER, '-friction_hyco_solver_type', 'active_set')


if __name__ == '__main__':
    unittest.main()
