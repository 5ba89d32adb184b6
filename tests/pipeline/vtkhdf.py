"""-output FILE.vtkhdf: VTK's layout of HDF5, with the numbers of the .h5 beside an .xdmf; what fields are called and measured in."""
import os
import unittest
import xml.etree.ElementTree as ET

import h5py
import numpy as np

from common import SOURCE, Case

PELLET = ['-scene', os.path.join(SOURCE, 'examples', 'pellet'), '-mu', '4.06,1']
RING = ['-scene', os.path.join(SOURCE, 'examples', 'ring'), '-mu', '0.01,1', '-history_times', '0,1,2,3']
UNITS = ['-scene_unit_length', 'mm', '-scene_unit_force', 'N', '-scene_unit_stress', 'MPa']
VTK_FROM_XDMF = [0, 3, 5, 1, 4, 2]  # xx, yy, zz, xy, yz, xz from xx, xy, xz, yy, yz, zz


class VTKHDF(Case):
    def both(self, args, name, ranks=0):
        """The fields in both formats: {name: rows}, of a path the last time's; the .vtkhdf; the report."""
        report = self.hyco('solve', *args, '-output', name + '.xdmf', ranks=ranks)
        self.hyco('solve', *args, '-output', name + '.vtkhdf', ranks=ranks)
        h, v = h5py.File(self.path(name + '.h5')), h5py.File(self.path(name + '.vtkhdf'))
        self.addCleanup(h.close)
        self.addCleanup(v.close)
        steps = sorted(key for key in h if key.startswith('step-'))
        return h, v['VTKHDF'], [h[key] for key in steps] or [h], report

    def mesh(self, h, v, vtk_type):
        self.assertEqual(v.attrs['Type'], b'UnstructuredGrid')
        self.assertEqual(list(v.attrs['Version']), [2, 0])
        cells = h['mesh/cells'][:]
        self.assertEqual([v[k][:].tolist() for k in ('NumberOfPoints', 'NumberOfCells', 'NumberOfConnectivityIds')],
                         [[len(h['mesh/xyz'])], [len(cells)], [cells.size]])
        np.testing.assert_array_equal(v['Points'][:], h['mesh/xyz'][:])
        np.testing.assert_array_equal(v['Connectivity'][:], cells.ravel())
        np.testing.assert_array_equal(v['Offsets'][:], np.arange(len(cells) + 1) * cells.shape[1])
        self.assertEqual(v['Types'].dtype, np.uint8)
        self.assertTrue((v['Types'][:] == vtk_type).all())
        np.testing.assert_array_equal(v['PointData/node_id'][:], h['mesh/node_id'][:, 0])
        np.testing.assert_array_equal(v['CellData/cell_id'][:], h['mesh/cell_id'][:, 0])

    def fields(self, h, v, steps):
        for ours, theirs in (('nodes', 'PointData'), ('cells', 'CellData')):
            self.assertEqual(set(steps[-1][ours]) | {'node_id' if ours == 'nodes' else 'cell_id'}, set(v[theirs]))
            for name, n in ((name, len(h['mesh/xyz' if ours == 'nodes' else 'mesh/cells'])) for name in steps[-1][ours]):
                for k, step in enumerate(steps):
                    expected = step[ours][name][:]
                    expected = expected[:, VTK_FROM_XDMF] if expected.shape[1] == 6 else expected[:, 0] if expected.shape[1] == 1 else expected
                    found = v[theirs][name][k * n:(k + 1) * n]
                    np.testing.assert_allclose(found, expected, atol=1e-9 * np.nanmax(abs(expected)), err_msg=f'{name} at {k}')

    def test_solution(self):
        for ranks in (0, 2):
            h, v, steps, report = self.both([*PELLET, *UNITS], f's{ranks}', ranks=ranks)
            self.mesh(h, v, 12)
            self.fields(h, v, steps)
            self.assertEqual([v['FieldData'][k][0] for k in ('radius', 'load')], [4.06, 1])
            self.assertNotIn('Steps', v)
            self.near(np.linalg.norm(v['PointData/displacement'][:]), report['u_norm2'], 1e-10, 'u')

    def test_attributes(self):
        self.hyco('solve', *PELLET, *UNITS, '-output', 'u.xdmf')
        self.hyco('solve', *PELLET, *UNITS, '-output', 'u.vtkhdf')
        with h5py.File(self.path('u.h5')) as h, h5py.File(self.path('u.vtkhdf')) as v:
            for file, nodes, cells in ((h, 'nodes', 'cells'), (v['VTKHDF'], 'PointData', 'CellData')):
                self.assertEqual(dict(file[nodes]['displacement'].attrs), {'unit': b'mm', 'components': b'x y z'})
                self.assertEqual(dict(file[nodes]['gap'].attrs), {'unit': b'mm'})
                self.assertEqual(file[nodes]['contact_force'].attrs['unit'], b'N')
                self.assertEqual(file[nodes]['contact_pressure'].attrs['unit'], b'MPa')
                self.assertEqual(dict(file[cells]['principal_stress'].attrs), {'unit': b'MPa', 'components': b'1 2 3'})
                self.assertEqual(dict(file[cells]['body'].attrs), {})
            self.assertEqual(h['cells/stress'].attrs['components'], b'xx xy xz yy yz zz')
            self.assertEqual(v['VTKHDF/CellData/stress'].attrs['components'], b'xx yy zz xy yz xz')

    def test_history(self):
        for ranks in (0, 2):
            h, v, steps, _ = self.both(RING, f'h{ranks}', ranks=ranks)
            self.mesh(h, v, 9)
            self.fields(h, v, steps)
            at = v['Steps']
            self.assertEqual(at.attrs['NSteps'], len(steps))
            np.testing.assert_array_equal(at['Values'][:], h['t'][:, 0])
            for name in ('PartOffsets', 'PointOffsets', 'CellOffsets', 'ConnectivityIdOffsets', 'PointDataOffsets/node_id', 'CellDataOffsets/cell_id'):
                self.assertEqual(at[name][:].tolist(), [0] * len(steps), name)
            self.assertEqual(at['NumberOfParts'][:].tolist(), [1] * len(steps))
            np.testing.assert_array_equal(at['PointDataOffsets/displacement'][:], np.arange(len(steps)) * len(h['mesh/xyz']))
            np.testing.assert_array_equal(at['CellDataOffsets/stress'][:], np.arange(len(steps)) * len(h['mesh/cells']))
            self.assertEqual(set(at['PointDataOffsets']), set(v['PointData']))
            self.assertEqual(set(at['CellDataOffsets']), set(v['CellData']))
        grids = ET.parse(self.path('h0.xdmf')).getroot().findall('.//Grid[@CollectionType="Temporal"]/Grid')
        self.assertEqual({g.get('GridType') for g in grids}, {'Uniform'})  # meshio's reader of series wants it

    def test_resumed(self):
        """A path that goes on from its checkpoint leaves the same file."""
        whole = self.both(RING, 'whole')[1]
        keep = [*RING, '-hyco_checkpoint', 'c.h5', '-output', 'parts.vtkhdf']
        self.hyco('solve', *keep)
        os.remove(self.path('parts.vtkhdf'))
        self.hyco('solve', *keep, '-hyco_resume')
        with h5py.File(self.path('parts.vtkhdf')) as parts:
            for name in ('PointData/displacement', 'CellData/stress', 'Steps/Values'):
                np.testing.assert_allclose(parts['VTKHDF'][name][:], whole[name][:], atol=1e-9 * abs(whole[name][:]).max(), err_msg=name)


if __name__ == '__main__':
    unittest.main()
