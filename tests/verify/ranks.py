"""Displacements and contact forces on 2 to 4 ranks against 1, relative to the largest, on each example's first mesh."""
import os
import unittest

from common import SOURCE
from verify import Verify

POINTS = {'pellet': '4.06,1', 'blocks': '0.05,0.06', 'rope': '0.07,0.17', 'plate': '0.5,0.5'}


class Ranks(Verify):
    name = 'ranks'

    def test_solutions(self):
        """Every example on 2 to 4 ranks."""
        for scene, mu in POINTS.items():
            args = (os.path.join(SOURCE, 'examples', scene), '-mu', mu)
            one = self.solve(*args)[1]
            worst = {name: 0 for name in ('nodes/displacement', 'lambda') if name in one}
            for ranks in (2, 3, 4):
                report, many = self.solve(*args, ranks=ranks)
                self.assertEqual(report['ranks'], ranks)
                for name in worst:
                    worst[name] = max(worst[name], abs(many[name] - one[name]).max() / abs(one[name]).max())
            for name, difference in worst.items():
                self.row(f'{scene}: {name.split("/")[-1]}, 2 to 4 ranks against 1', difference, 0, 1e-9)


if __name__ == '__main__':
    unittest.main()
