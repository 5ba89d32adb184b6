"""-hyco_pod_memory: the model is that of all snapshots at once, of points and of paths, and the memory is bounded."""
import os
import re
import unittest

import h5py
import numpy as np

from common import SOURCE, Case, said

BLOCKS = os.path.join(SOURCE, 'examples', 'blocks')
POINTS = ('-scene', BLOCKS, '-scene_refine', 1, '-grid', '12,12', '-hyco_pod_tol', '1e-10', '-hyco_pod_noise', 1e-6, '-hyco_rid_modes',
          'displacement,force')
NOISE = 1e-6
CHOSEN = ('mesh/node_id', 'mesh/cell_id', 'problem/role', 'problem/in_rid', 'problem/fe_dof', 'problem/pairs/slave')


class PodMemory(Case):
    def train(self, name, megabytes, *words, ranks=0, store='store'):
        """The model, and the most bytes that PETSc held, of all ranks together."""
        run = self.run_raw('train', *words, '-hyco_pod_memory', megabytes, '-hyco_snapshots', store, '-model', name, '-malloc_dump', '-memory_view',
                           ranks=ranks, timeout=200)
        self.assertEqual(run.returncode, 0, run.stderr)
        total, = re.findall(r'Maximum .* space PetscMalloc\(\)ed: *total *(\S+)', run.stdout)
        with h5py.File(self.path(name)) as file:
            found = {key: file[key][()] for key in CHOSEN}
            return found, file['problem/singular_values'][:].ravel(), file['whole/V'][:], float(total)

    def same(self, one, other):
        """Singular values to 1e-10 of the largest; each mode to an angle of what batches lose, a tenth of the noise, over its singular value; the same RID."""
        for key in CHOSEN:
            self.assertTrue(np.array_equal(one[0][key], other[0][key]), key)
        self.assertEqual(one[2].shape, other[2].shape)
        l = one[2].shape[1]
        self.assertLess(np.abs(one[1][:l] - other[1][:l]).max(), 1e-10 * one[1][0])
        self.assertLess(np.abs(other[2].T @ other[2] - np.eye(l)).max(), 1e-10)
        for k in range(l):
            self.assertLess(np.linalg.norm(one[2][:, k] - other[2][:, k]), 0.1 * NOISE * one[1][0] / one[1][k], f'mode {k}')

    def test_points(self):
        """144 solutions of 3318 unknowns with room for 56 columns at a time, on 1 and 2 ranks."""
        whole = self.train('whole.h5', 0, *POINTS)
        one = self.train('one.h5', 4.5, *POINTS)
        two = self.train('two.h5', 4.5, *POINTS, ranks=2)
        self.same(whole, one)
        self.same(whole, two)
        self.assertLess(one[3], 0.6 * whole[3])  # 8.4 of 15.3 MB
        self.assertLess(two[3], 0.9 * whole[3])  # 12.2: overlaps and tables of two ranks

    def test_paths(self):
        """Six paths of 16 listed times, one at a time: room for 20 columns of their stresses."""
        ring = ('-scene', os.path.join(SOURCE, 'examples', 'ring'), '-grid', '3,2', '-hyco_pod_tol', 1e-8, '-hyco_rid_layers', 2, '-hyco_pod_noise', NOISE)
        self.same(self.train('rings.h5', 0, *ring, store='paths'), self.train('streamed.h5', 0.5, *ring, store='paths'))

    def test_too_little(self):
        """A limit too small for one solution, or with a type that needs all columns, is refused."""
        for words in (('-hyco_pod_memory', 1), ('-hyco_pod_memory', 50, '-hyco_pod_svd_type', 'cross')):
            run = self.run_raw('train', *POINTS, *words, '-hyco_snapshots', 'store', '-model', 'no.h5', ranks=2)
            self.assertEqual(run.returncode, 1, run.stderr)
            line, = said(run)
            self.assertIn('-hyco_pod_memory', line)
            self.assertFalse(os.path.exists(self.path('no.h5')))


if __name__ == '__main__':
    unittest.main()
