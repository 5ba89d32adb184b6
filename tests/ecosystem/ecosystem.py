"""Other programs: pyvista and meshio, installed from the Python package index into the test's own environment, read each output of hyco."""
import json
import os
import subprocess
import sys
import unittest

import numpy as np

from common import PATIENCE, SOURCE, Case

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import Grid  # noqa: E402

READ = r'''
import json, sys
import meshio
import numpy as np
import pyvista
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline

def largest(points):
    return float(np.linalg.norm(points['displacement']))

def one(name):
    g = pyvista.read(name + '.vtkhdf')
    m = meshio.read(name + '.xdmf')
    return {'vtkhdf': [largest(g.point_data), float(g.cell_data['mises'].max()), float(g.volume or g.area), g.n_cells, float(g.point_data['contact_pressure'].max())],
            'xdmf': [largest(m.point_data), float(m.cell_data['mises'][0].max()), float(pyvista.from_meshio(m).volume or pyvista.from_meshio(m).area),
                     len(m.cells[0].data), float(m.point_data['contact_pressure'].max())]}

def series(name):
    reader = pyvista.get_reader(name + '.vtkhdf').reader
    reader.UpdateInformation()
    times = reader.GetOutputInformation(0).Get(Pipeline.TIME_STEPS())
    steps = []
    for k in range(reader.GetNumberOfSteps()):
        reader.SetStep(k)
        reader.Update()
        steps.append(largest(pyvista.wrap(reader.GetOutput()).point_data))
    with meshio.xdmf.TimeSeriesReader(name + '.xdmf') as x:
        x.read_points_cells()
        read = [x.read_data(k) for k in range(x.num_steps)]
    last = pyvista.get_reader(name + '.xdmf')
    last.set_active_time_value(last.time_values[-1])
    return {'times': list(times), 'vtkhdf': steps, 'times_xdmf': [r[0] for r in read], 'xdmf': [largest(r[1]) for r in read], 'pyvista_xdmf': largest(last.read().point_data)}

print(json.dumps({'one': {n: one(n) for n in sys.argv[2:]}, 'series': series(sys.argv[1])}))
'''
MESHES = r"""
import meshio, numpy as np
points = [[i, j, 0.0] for j in (0.0, 1.0) for i in (0.0, 1.0, 2.0)]
quads = [[0, 1, 4, 3], [1, 2, 5, 4]]
meshio.Mesh(points, [('quad', quads)], cell_data={'material': [np.array([1, 2])]}, point_data={'foot': np.array([1, 1, 1, 0, 0, 0])}).write('m.vtu')
m = meshio.Mesh(np.array(points)[:, :2], [('quad', quads), ('line', [[0, 1]])], cell_data={'cell_tags': [np.array([-1, -2]), np.array([-3])]},
                point_data={'point_tags': np.zeros(6, int)})
m.cell_tags = {-1: ['soft', 'all'], -2: ['stiff', 'all'], -3: ['foot']}
m.point_tags = {}
m.write('m.med')
"""
MIXED = r"""
import json, meshio, numpy as np, pyvista
def of(g):
    size = np.asarray(g.compute_cell_sizes().cell_data['Volume'])
    return [{str(t): int(n) for t, n in zip(*np.unique(g.celltypes, return_counts=True))}, float(size.sum()), float(size.min())]
print(json.dumps({'vtkhdf': of(pyvista.read('m.vtkhdf')), 'xdmf': of(pyvista.from_meshio(meshio.read('m.xdmf')))}))
"""
ONE = {'pellet': '4.06,1', 'blocks': '0.05,0.05'}


class Ecosystem(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        subprocess.run([sys.executable, '-m', 'venv', cls.path('venv')], check=True, timeout=100 * PATIENCE)
        cls.python = cls.path('venv', 'bin', 'python')
        subprocess.run([cls.python, '-m', 'pip', 'install', '-q', 'pyvista', 'meshio', 'h5py'], check=True, timeout=300 * PATIENCE)

    def test_all(self):
        """pyvista and meshio read .xdmf and .vtkhdf of full order, with the extremes of the report."""
        reports = {}
        for name, mu in ONE.items():
            for ending in ('.xdmf', '.vtkhdf'):
                reports[name] = self.hyco('solve', '-scene', os.path.join(SOURCE, 'examples', name), '-mu', mu, '-output', name + ending)
        for ending in ('.xdmf', '.vtkhdf'):
            path = self.hyco('solve', '-scene', os.path.join(SOURCE, 'examples', 'ring'), '-mu', '0.01,1', '-output', 'ring' + ending)
        run = subprocess.run([self.python, '-c', READ, 'ring', *ONE], cwd=self.folder, capture_output=True, text=True, timeout=100 * PATIENCE)
        self.assertEqual(run.returncode, 0, run.stderr)
        found = json.loads(run.stdout.splitlines()[-1])
        for name, report in reports.items():
            pressure = max(c['pressure_max'] for c in report['contacts'].values())
            for ending, (u, mises, volume, n_cells, largest) in found['one'][name].items():
                self.near(u, report['u_norm2'], 1e-9, f'{name}{ending}: displacement')
                self.near(largest, pressure, 1e-9, f'{name}{ending}: pressure')
                self.near(mises, found['one'][name]['xdmf'][1], 1e-12, f'{name}{ending}: stress')
                self.near(volume, found['one'][name]['xdmf'][2], 1e-9, f'{name}{ending}: volume')
                self.assertEqual(n_cells, found['one'][name]['xdmf'][3])
        ring = found['series']
        self.assertEqual(ring['times'], path['history']['t'])
        self.assertEqual(ring['times_xdmf'], ring['times'])
        for a, b in zip(ring['vtkhdf'], ring['xdmf']):
            self.near(a, b, 1e-9, 'displacement of a time')
        self.near(ring['vtkhdf'][-1], path['u_norm2'], 1e-9, 'displacement at the end')
        self.near(ring['pyvista_xdmf'], ring['vtkhdf'][-1], 1e-9, 'displacement at the end, XDMF by pyvista')


    def test_mixed(self):
        """A block of hexahedra, prisms, pyramids and tetrahedra: each program reads every cell with its own type, and the block's volume."""
        grid = Grid()
        grid.mixed([np.linspace(0, 1, 5), np.linspace(0, 1, 5), np.linspace(0, 2, 3)], lambda x: x, 'block', {'z0': 'foot', 'z1': 'top'},
                   lambda c: 'tet4' if max(c) < 2 else 'halves' if min(c[:2]) >= 2 else 'whole')
        grid.write(self.path('m.msh'))
        with open(self.path('m.yaml'), 'w', encoding='ascii') as f:
            f.write('scene: {mesh: m.msh, parameters: [p]}\nparameter: {p: {range: [1, 2]}}\nbody: {block: {young: 1}}\nfixed: {foot: {x: 0, y: 0, z: 0}}\npressure: {top: p}\n')
        for ending in ('xdmf', 'vtkhdf'):
            self.hyco('solve', '-scene', 'm.yaml', '-mu', '1', '-output', f'm.{ending}', ranks=2)
        run = subprocess.run([self.python, '-c', MIXED], cwd=self.folder, capture_output=True, text=True, timeout=100 * PATIENCE)
        self.assertEqual(run.returncode, 0, run.stderr)
        for name, (counts, volume, least) in json.loads(run.stdout.splitlines()[-1]).items():
            self.assertEqual(counts, {'10': 32, '12': 16, '13': 16, '14': 8}, name)
            self.near(volume, 2, 1e-12, name)
            self.assertGreater(least, 0, name)

    def convert(self, name, *args):
        """The report of scripts/convert on a mesh written by meshio: {group: (count, kind)}."""
        run = subprocess.run([self.python, os.path.join(SOURCE, 'scripts', 'convert'), name, 'm.msh', *args], cwd=self.folder,
                             capture_output=True, text=True, timeout=100 * PATIENCE)
        self.assertEqual(run.returncode, 0, run.stderr)
        rows = [line.split() for line in run.stdout.splitlines()[1:]]
        return {row[0][:-1]: (int(row[1]), row[2]) for row in rows}

    def test_convert(self):
        """scripts/convert turns meshio's .vtu, .med and others into meshes with groups."""
        subprocess.run([self.python, '-c', MESHES], cwd=self.folder, check=True, timeout=100 * PATIENCE)
        self.assertEqual(self.convert('m.vtu', '--groups', 'material,foot'), {'material_1': (1, 'quad4'), 'material_2': (1, 'quad4'), 'foot_1': (2, 'line2')})
        self.assertEqual(self.convert('m.med'), {'soft': (1, 'quad4'), 'stiff': (1, 'quad4'), 'foot': (1, 'line2'), 'all': (2, 'quad4')})
        with open(self.path('scene.yaml'), 'w', encoding='ascii') as f:
            f.write('scene: {mesh: m.msh, parameters: [p]}\nparameter: {p: {range: [1, 2]}}\nbody: {soft: {young: 1}, stiff: {young: 9}}\n'
                    'fixed: {foot: {x: 0, y: 0}}\nforce: {soft: {y: p}}\n')
        self.solved(self.hyco('solve', '-scene', 'scene.yaml', '-mu', '1'))


if __name__ == '__main__':
    unittest.main()
