"""Results of a solution: each contact's resultant, moment, area and pressure; fields derived from the stress."""
import os
import unittest

import h5py
import numpy as np

from common import PELLET, SOURCE, Case

BLOCKS = os.path.join(SOURCE, 'examples', 'blocks')


class Results(Case):
    def solve(self, *args, ranks=0):
        report = self.hyco('solve', *args, '-output', 'out.xdmf', ranks=ranks)
        with h5py.File(self.path('out.h5')) as f:
            return report, {name: f[name][:] for name in ('mesh/xyz', 'nodes/contact_force', 'nodes/contact_pressure', 'cells/stress',
                                                          'cells/mises', 'cells/principal_stress', 'cells/body', 'contact/node_id', 'mesh/node_id')}

    def test_contacts(self):
        """Against the forces of the nodes: slaves push with the opposite of what masters get."""
        for args in (('-scene', PELLET, '-mu', '4.06,1'), ('-scene', BLOCKS, '-mu', '0.05,0.05')):
            for ranks in (0, 2):
                report, out = self.solve(*args, ranks=ranks)
                slave = np.isin(out['mesh/node_id'][:, 0], out['contact/node_id'][:, 0])
                force, x = out['nodes/contact_force'][slave], out['mesh/xyz'][slave]
                dim = len(report['u_max'])
                found = [np.array([c[name] for c in report['contacts'].values()]).sum(axis=0) for name in ('force', 'moment', 'n', 'n_active')]
                scale = np.linalg.norm(force, axis=1).sum()
                np.testing.assert_allclose(found[0], force.sum(axis=0)[:dim], atol=1e-10 * scale)
                moment = np.cross(x, force).sum(axis=0)
                np.testing.assert_allclose(found[1], moment[3 - len(found[1]):], atol=1e-10 * scale * abs(x).max())
                self.assertEqual(found[2], report['n_contacts'])
                self.assertEqual(found[3], report['n_active'])
                largest = max(c['pressure_max'] for c in report['contacts'].values())
                self.near(largest, out['nodes/contact_pressure'].max(), 1e-10, 'pressure')

    def test_stress(self):
        """Von Mises and principal stresses are those of numpy from the stress."""
        for args in (('-scene', PELLET, '-mu', '4.06,1'), ('-scene', BLOCKS, '-mu', '0.05,0.05')):
            out = self.solve(*args)[1]
            s = out['cells/stress'][:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)
            value = np.linalg.eigvalsh(s)[:, ::-1]
            np.testing.assert_allclose(out['cells/principal_stress'], value, atol=1e-9 * abs(value).max())
            deviator = value - value.mean(axis=1, keepdims=True)
            np.testing.assert_allclose(out['cells/mises'][:, 0], np.sqrt(1.5 * (deviator**2).sum(axis=1)), atol=1e-9 * abs(value).max())
            self.assertGreater(len(np.unique(out['cells/body'])), 1)


if __name__ == '__main__':
    unittest.main()
