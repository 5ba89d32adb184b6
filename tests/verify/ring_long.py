"""The ring of ring.py on the finest of the pellet's meshes, all z held: a shrink fit that relaxes, and a gap that closes by creep.
Minutes: ctest -C Long -L verify."""
import unittest

import numpy as np

from ring import CLOSES, Paths, relaxing
from verify import order


class Long(Paths):
    name = 'ring_long'

    def test_shrink_fit(self):
        t, p, _ = self.pellet_path('C', 80, 0, -0.01, 2)
        for k in (0, 20, 40, 80):
            self.row(f'pellet C, z held: p at t = {t[k]:g}', p[k], relaxing(t[k]), 0.2)

    def test_closing(self):
        """The order in the mesh is that of the time of closing, over the cells through the cladding."""
        begin = [self.judge_closing(f'pellet {mesh}, z held, closing', self.pellet_path(mesh, steps, 50, 0.02, 4), (4,), off, bound)
                 for mesh, steps, off, bound in (('A', 200, 2, 2), ('B', 200, 0.5, 0.7), ('C', 200, 0.5, 0.2))]
        self.row('pellet A, B, C, z held: order of the time of closing', order(1 / np.array([2, 4, 6]), abs(np.array(begin) - CLOSES)), 2, 20)


if __name__ == '__main__':
    unittest.main()
