"""-hyco_pod_svd_type: the POD by each of SLEPc's types, on one rank and two, and the messages of less accurate ones."""
import unittest

import h5py
import numpy as np

from common import ROPE, Case

TYPES = ('trlanczos', 'cross', 'cyclic', 'lapack', 'randomized')


class Pod(Case):
    @classmethod
    def train(cls, *options, **how):
        return cls.run_raw('train', '-scene', ROPE, '-grid', '6,8', '-grid_type', 'centred', '-model', 'm.h5', '-hyco_snapshots', 'snapshots', *options, **how)

    def model(self, *options, **how):
        """The singular values of the modes and, if there is one, the places of the RID, of a training that goes well; what it printed."""
        run = self.train(*options, **how)
        self.assertEqual(run.returncode, 0, run.stderr)
        with h5py.File(self.path('m.h5')) as f:
            return f['problem/singular_values'][:, 0], f.get('mesh/cell_whole', np.zeros((0, 1)))[:, 0], run.stdout

    def refused(self, *options):
        run = self.train(*options)
        self.assertEqual(run.returncode, 1, run.stdout)
        lines = [line for line in run.stderr.splitlines() if 'error' in line.lower()]
        self.assertEqual(len(lines), 1, run.stderr)
        return lines[0]

    def test_types(self):
        """Each type gives the same singular values and cells, on 1 and 2 ranks."""
        sigma, cells, _ = self.model()
        for kind in ('tsqr', *TYPES):
            for ranks in (0, 2):
                with self.subTest(kind=kind, ranks=ranks):
                    found, of, _ = self.model('-hyco_pod_svd_type', kind, ranks=ranks)
                    self.assertEqual(len(found), len(sigma))
                    np.testing.assert_allclose(found, sigma, rtol=1e-6)
                    np.testing.assert_array_equal(of, cells)

    def test_accuracy(self):
        """A tolerance beyond the accuracy of the cross-product matrix; triplets that are too few."""
        line = self.refused('-hyco_pod_svd_type', 'cross', '-hyco_pod_tol', '1e-18')
        self.assertIn('-hyco_pod_svd_type cross', line)
        self.assertIn('tsqr', line)
        self.assertIn('-hyco_pod_tol', self.refused('-hyco_pod_svd_type', 'trlanczos', '-hyco_pod_svd_nsv', '2', '-hyco_pod_tol', '1e-10'))

    def test_options(self):
        """An unknown type is refused with the list of types."""
        line = self.refused('-hyco_pod_svd_type', 'gesvd')
        self.assertIn('-hyco_pod_svd_type is "gesvd"', line)
        for kind in ('tsqr', *TYPES):
            self.assertIn(kind, line)
        self.assertIn('-hyco_pod_svd_typ', self.refused('-hyco_pod_svd_typ', 'cross'))
        self.assertIn('-hyco_pod_svd_type', self.run_raw('train', '-help').stdout)
        for kind in ('tsqr', 'trlanczos'):
            out = self.model('-hyco_pod_svd_type', kind, '-hyco_pod_svd_view', '-hyco_pod_svd_monitor')[2]
            self.assertIn(f'type: {kind}', out)
            self.assertIn('Singular value approximations', out)


if __name__ == '__main__':
    unittest.main()
