"""-output FILE.vtkhdf: VTK's HDF5 layout, with the numbers of the .h5 beside an .xdmf; names and units of fields."""
import os
import unittest
import xml.etree.ElementTree as ET

import h5py
import numpy as np

from common import SOURCE, Case

PELLET = ['-scene', os.path.join(SOURCE, 'examples', 'pellet'), '-mu', '4.06,1']
BLOCKS = ['-scene', os.path.join(SOURCE, 'examples', 'blocks'), '-mu', '0.05,0.05']
RING = ['-scene', os.path.join(SOURCE, 'examples', 'ring'), '-mu', '0.01,1', '-history_times', '0,1,2']
UNITS = ['-scene_unit_length', 'mm', '-scene_unit_force', 'N', '-scene_unit_stress', 'MPa']
VTK_FROM_XDMF = [0, 3, 5, 1, 4, 2]  # xx, yy, zz, xy, yz, xz from xx, xy, xz, yy, yz, zz


class VTKHDF(Case):
    made = {}

    def both(self, args, name, ranks=0):
        """A scene's numbers in both formats, its times in the .h5, its report."""
        report = self.made.get(name)
        if not report:
            self.hyco('solve', *args, '-output', name + '.vtkhdf', ranks=ranks)
            report = self.made[name] = self.hyco('solve', *args, '-output', name + '.xdmf', ranks=ranks)
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
                    np.testing.assert_allclose(found, expected, atol=1e-9 * max(np.nanmax(abs(expected)), 1e-3), err_msg=f'{name} at {k}')

    def test_solution(self):
        """The file of a solution has the mesh, fields and parameters of the .h5, on 1 and 2 ranks."""
        for ranks in (0, 2):
            h, v, steps, report = self.both([*PELLET, *UNITS], f's{ranks}', ranks=ranks)
            self.mesh(h, v, 12)
            self.fields(h, v, steps)
            self.assertEqual([v['FieldData'][k][0] for k in ('radius', 'load')], [4.06, 1])
            self.assertNotIn('Steps', v)
            self.near(np.linalg.norm(v['PointData/displacement'][:]), report['u_norm2'], 1e-10, 'u')

    def test_attributes(self):
        """Fields have their units and components as attributes."""
        h, v = self.both([*PELLET, *UNITS], 's2', ranks=2)[:2]
        for file, nodes, cells in ((h, 'nodes', 'cells'), (v, 'PointData', 'CellData')):
            self.assertEqual(dict(file[nodes]['displacement'].attrs), {'unit': b'mm', 'components': b'x y z'})
            self.assertEqual(dict(file[nodes]['gap'].attrs), {'unit': b'mm'})
            self.assertEqual(file[nodes]['contact_force'].attrs['unit'], b'N')
            self.assertEqual(file[nodes]['contact_pressure'].attrs['unit'], b'MPa')
            self.assertEqual(dict(file[cells]['principal_stress'].attrs), {'unit': b'MPa', 'components': b'1 2 3'})
            self.assertEqual(dict(file[cells]['body'].attrs), {})
        self.assertEqual(h['cells/stress'].attrs['components'], b'xx xy xz yy yz zz')
        self.assertEqual(v['CellData/stress'].attrs['components'], b'xx yy zz xy yz xz')

    def test_history(self):
        """The file of a path has its steps, times and fields."""
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
        whole = self.both(RING, 'h0')[1]
        keep = [*RING, '-hyco_checkpoint', 'c.h5', '-output', 'parts.vtkhdf']
        self.hyco('solve', *keep)
        os.remove(self.path('parts.vtkhdf'))
        self.hyco('solve', *keep, '-hyco_resume')
        with h5py.File(self.path('parts.vtkhdf')) as parts:
            for name in ('PointData/displacement', 'CellData/stress', 'Steps/Values'):
                np.testing.assert_allclose(parts['VTKHDF'][name][:], whole[name][:], atol=1e-9 * abs(whole[name][:]).max(), err_msg=name)


    def test_nodal_stress(self):
        """The mean by volume of the cells around a node, of the first of its bodies; in parallel the same."""
        for args, name in (([*PELLET, *UNITS], 's'), (BLOCKS, 'b')):
            for ranks in (0, 2):
                h = self.both(args, f'{name}{ranks}', ranks=ranks)[0]
                xyz, cells, stress, body = (h[k][:] for k in ('mesh/xyz', 'mesh/cells', 'cells/stress', 'cells/body'))
                volume = np.array([measure(xyz[c]) for c in cells])
                first = np.full(len(xyz), np.inf)
                np.minimum.at(first, cells, np.broadcast_to(body, cells.shape))
                weight, total = np.zeros(len(xyz)), np.zeros((len(xyz), 6))
                for c in range(cells.shape[1]):
                    mine = first[cells[:, c]] == body[:, 0]
                    np.add.at(weight, cells[mine, c], volume[mine])
                    np.add.at(total, cells[mine, c], volume[mine, None] * stress[mine])
                expected = total / weight[:, None]
                # volumes of curved hexahedra by their corners are not the quadrature's: what differs is of higher order
                np.testing.assert_allclose(h['nodes/nodal_stress'][:], expected, atol=2e-2 * abs(expected).max())
                s = h['nodes/nodal_stress'][:][:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)
                d = s - np.trace(s, axis1=1, axis2=2)[:, None, None] / 3 * np.eye(3)
                np.testing.assert_allclose(h['nodes/nodal_mises'][:, 0], np.sqrt(1.5 * (d**2).sum(axis=(1, 2))), atol=1e-9 * abs(s).max())

    def points(self, h, v, n):
        """Each point of a set as one solution of its own."""
        nodes, cells = len(h['mesh/xyz']), len(h['mesh/cells'])
        self.assertEqual([v['Steps'].attrs['NSteps'], len(h['t'])], [n, n])
        np.testing.assert_array_equal(v['Steps/PointOffsets'][:], np.arange(n) * nodes)
        np.testing.assert_array_equal(v['Steps/FieldDataOffsets/radius'][:], np.arange(n))
        for name in h['mu']:
            np.testing.assert_array_equal(v['FieldData'][name][:], h['mu'][name][:, 0])
        for k in range(n):
            np.testing.assert_array_equal(v['Points'][k * nodes:(k + 1) * nodes], h[f'step-{k:04d}/xyz'][:])
        self.fields(h, v, [h[f'step-{k:04d}'] for k in range(n)])
        self.assertEqual(len(v['CellData/mises']), n * cells)

    def test_set(self):
        """A set of points of full order and of a model is a series; the parameters move the mesh."""
        grid = ['-values_radius', '4.02,4.06,4.1', '-values_load', '1']
        for ranks in (0, 2):
            for ending in ('.xdmf', '.vtkhdf'):
                self.hyco('solve', *PELLET[:2], *grid, '-output', 'set' + ending, '-table', 'set.csv', ranks=ranks)
            self.hyco('solve', *PELLET, '-output', 'one.xdmf')
            with h5py.File(self.path('set.h5')) as h, h5py.File(self.path('set.vtkhdf')) as v, h5py.File(self.path('one.h5')) as one:
                self.points(h, v['VTKHDF'], 3)
                for name in ('nodes/displacement', 'cells/stress', 'nodes/contact_pressure'):
                    expected = one[name][:]
                    np.testing.assert_allclose(h['step-0001/' + name][:], expected, atol=1e-7 * abs(expected).max(), err_msg=name)
                np.testing.assert_allclose(h['step-0001/xyz'][:], one['mesh/xyz'][:], atol=1e-14)
                self.assertEqual(h['mu/radius'][:, 0].tolist(), [4.02, 4.06, 4.1])
        grids = ET.parse(self.path('set.xdmf')).getroot().findall('.//Grid[@CollectionType="Temporal"]/Grid')
        self.assertEqual([g.find('Geometry/DataItem').text for g in grids], [f'set.h5:/step-{k:04d}/xyz' for k in range(3)])
        self.hyco('train', *PELLET[:2], '-values_radius', '4.02,4.1', '-values_load', '0.5,1', '-hyco_model_type', 'hybrid', '-hyco_search', 'false', '-model', 'm.h5', status=None)
        for ending in ('.xdmf', '.vtkhdf'):
            self.hyco('predict', '-model', 'm.h5', *grid, '-output', 'low' + ending, '-table', 'low.csv')
        self.hyco('predict', '-model', 'm.h5', *PELLET[2:], '-output', 'one.xdmf')
        with h5py.File(self.path('low.h5')) as h, h5py.File(self.path('low.vtkhdf')) as v, h5py.File(self.path('one.h5')) as one:
            self.points(h, v['VTKHDF'], 3)
            for name in ('nodes/displacement', 'cells/stress', 'cells/rid'):
                np.testing.assert_array_equal(h['step-0001/' + name][:], one[name][:])


def measure(x):
    """Area of a triangle or quadrilateral, volume of a hexahedron of plane faces."""
    if len(x) < 8:
        return abs(np.cross(x[2, :2] - x[0, :2], x[-1, :2] - x[1, :2])) / 2
    tets = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))
    return sum(abs(np.linalg.det(x[list(t[1:])] - x[t[0]])) for t in tets) / 6


if __name__ == '__main__':
    unittest.main()
