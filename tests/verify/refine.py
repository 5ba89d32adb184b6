"""-scene_refine: a mesh refined by DMPlex is the mesh of half the size where the geometry is straight, on any number of
ranks; and on distorted meshes the manufactured solution converges with order 2 in L2 and 1 in the H1 seminorm."""
import unittest

import numpy as np

from grids import Grid
from mms import distorted, errors, scene
from verify import Verify, order

SIZES = {'line2': (16, 3), 'tri3': (8, 3), 'quad4': (8, 3), 'tet4': (3, 4), 'hex8': (4, 3)}  # cells a side, levels


def straight(kind, n):
    dim = {'line2': 1, 'tri3': 2, 'quad4': 2}.get(kind, 3)
    grid = Grid()
    faces = {f'{"xyz"[c]}{end}': 'skin' for c in range(dim) for end in (0, 1)}
    grid.box(kind, [np.linspace(0, 1, n + 1)] * dim, lambda x: x, 'block', {**faces, 'x1': 'pulled'})
    return dim, grid


class Refine(Verify):
    name = 'refine'

    def test_half_the_size(self):
        """Tetrahedra are cut by another diagonal than the grid's: left out."""
        for kind in ('line2', 'tri3', 'quad4', 'hex8'):
            dim, coarse = straight(kind, 4)
            fine, expected = self.solve(self.scene(scene(dim), straight(kind, 8)[1]))
            folder = self.scene(scene(dim), coarse)
            for ranks in (1, 3):
                report, out = self.solve(folder, '-scene_refine', '1', ranks=ranks)
                self.assertEqual(report['n_dof'], fine['n_dof'])
                self.near(report['strain_energy'], fine['strain_energy'], 1e-12)
                for x, u in zip(out['mesh/xyz'], out['nodes/displacement']):
                    at = np.argmin(np.sum((expected['mesh/xyz'] - x)**2, axis=1))
                    self.assertLess(abs(u - expected['nodes/displacement'][at]).max(), 1e-12)
                if ranks == 1:
                    alone = out
                for name in ('mesh/xyz', 'mesh/cells', 'nodes/displacement', 'cells/stress'):
                    self.assertLess(abs(out[name] - alone[name]).max(), 1e-9, (kind, ranks, name))

    def test_orders(self):
        """From the last level but one: tetrahedra take other shapes in the first ones, as the diagonals fall."""
        for kind, (n, levels) in SIZES.items():
            dim, grid = distorted(kind, n)
            folder = self.scene(scene(dim), grid)
            found = [errors(kind, dim, self.solve(folder, '-scene_refine', str(k))[1]) for k in range(levels - 2, levels)]
            l2, h1 = np.array(found).T
            self.row(f'{kind} order in L2, refined', order([1, 0.5], l2), 2, 8)
            self.row(f'{kind} order in H1, refined', order([1, 0.5], h1), 1, 5)

    def test_refusals(self):
        """Values of -scene_refine that are no number from 0 to 12 are refused."""
        dim, grid = straight('quad4', 2)
        folder = self.scene(scene(dim), grid)
        for value in ('-1', 'a', '99'):
            run = self.run_raw('solve', '-scene', folder, '-scene_refine', value)
            self.assertEqual(run.returncode, 1)
            self.assertIn('scene_refine', run.stderr)


if __name__ == '__main__':
    unittest.main()
