"""The ring of ring.py on the finest of the pellet's meshes, all z held: a shrink fit that relaxes on the whole of it, and a gap
that closes by creep in fine steps. Minutes: ctest -C Long -L verify."""
import os
import unittest

from common import PELLET
from ring import Paths, relaxing


class Long(Paths):
    name = 'ring_long'

    def test_shrink_fit(self):
        """The shrink fit on mesh C."""
        t, p, _ = self.pellet_path(os.path.join(PELLET, 'C.msh'), 20, 0, -0.01, 1)
        for k in (0, 10, 20):
            self.row(f'pellet C, z held: p at t = {t[k]:g}', p[k], relaxing(t[k]), 0.2)

    def test_closing(self):
        """The gap that closes on mesh C."""
        path = self.pellet_path(self.two_layers('C'), 960, 50, 0.02, 12)
        self.judge_closing('pellet C, z held, closing', path, (8, 12))


if __name__ == '__main__':
    unittest.main()
