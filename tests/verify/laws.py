"""The inelastic laws at a point, compared with closed forms: relaxation, creep under a constant stress, loading,
reversed loading; in 1D and in 3D under uniaxial stress. laws.c makes the rows with their formulas. `test_points
cost` prints the cost of a point."""
import os
import subprocess
import unittest

from common import HYCO, PATIENCE
from verify import Verify

PROGRAM = os.path.join(os.path.dirname(HYCO), 'tests', 'test_points')


class Laws(Verify):
    name = 'laws'

    def test_points(self):
        """Every law at a point against its closed form."""
        run = subprocess.run([PROGRAM], capture_output=True, text=True, timeout=100 * PATIENCE, check=False)
        self.assertEqual(run.returncode, 0, run.stderr)
        rows = [line.split('\t') for line in run.stdout.splitlines()]
        self.assertGreater(len(rows), 30)
        for quantity, *numbers in rows:
            self.row(quantity, *map(float, numbers))

    def test_cost(self):
        """Printed, not checked: a busy machine is slower."""
        run = subprocess.run([PROGRAM, 'cost'], capture_output=True, text=True, timeout=100 * PATIENCE, check=False)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertIn('us a point', run.stdout)
        print(run.stdout)


if __name__ == '__main__':
    unittest.main()
