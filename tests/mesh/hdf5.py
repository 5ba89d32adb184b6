"""Meshes in PETSc's HDF5 format: what -hyco_mesh_write leaves on any number of ranks is read on any other, with groups
and tags, and gives the same solution; what is no such file is refused."""
import os
import unittest

import h5py
import numpy as np

from common import PELLET, Case

BLOCKS = os.path.join(os.path.dirname(PELLET), 'blocks')


class MeshHDF5(Case):
    def fields(self, *args, **options):
        report = self.hyco('solve', *args, '-output', self.path('out.xdmf'), **options)
        self.solved(report)
        with h5py.File(self.path('out.h5'), 'r') as file:
            return report, {name: file[name][...] for name in
                            ('mesh/node_id', 'mesh/cell_id', 'mesh/xyz', 'nodes/displacement', 'contact/node_id', 'contact/lambda')}

    def same(self, scene, mu, *args):
        expected, fields = self.fields('-scene', scene, '-mu', mu, *args)
        for written in (1, 3):
            path = self.path(f'mesh{written}.h5')
            self.hyco('solve', '-scene', scene, '-mu', mu, *args, '-hyco_mesh_write', path, ranks=written)
            for ranks in (1, 2):
                with self.subTest(scene=scene, written=written, read=ranks):
                    report, found = self.fields('-scene', scene, '-mu', mu, '-scene_mesh', path, ranks=ranks)
                    self.near(report['strain_energy'], expected['strain_energy'], 1e-9)
                    for name, value in fields.items():
                        self.assertEqual(found[name].shape, value.shape)
                        np.testing.assert_allclose(found[name], value, rtol=0, atol=1e-9 * np.nanmax(abs(value)), err_msg=name)

    def test_as_read(self):
        """The mesh as it is read."""
        self.same(PELLET, '4.06,1', '-scene_mesh', os.path.join(PELLET, 'A.msh'))

    def test_refined(self):
        """The refined mesh."""
        self.same(BLOCKS, '0.05,0.06', '-scene_refine', '1')

    def test_refused(self):
        """Files that are missing or are no HDF5 are refused, on 1 and 2 ranks."""
        with open(self.path('text.h5'), 'w', encoding='ascii') as file:
            file.write('no mesh')
        for name in ('text.h5', 'missing.h5'):
            for ranks in (1, 2):
                run = self.run_raw('solve', '-scene', BLOCKS, '-mu', '0.05,0.06', '-scene_mesh', name, ranks=ranks)
                self.assertEqual(run.returncode, 1)
                self.assertIn(name, run.stderr)


if __name__ == '__main__':
    unittest.main()
