"""Outputs that a scene names: numbers of each solution, full order and predicted, in reports and tables."""
import csv
import os
import sys
import unittest

import h5py
import numpy as np

from common import PELLET, SOURCE, Case

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import GMSH, Grid  # noqa: E402

BLOCKS = os.path.join(SOURCE, 'examples', 'blocks')
OUTPUTS = """
output:
  peak: {max: mises}
  deepest: {min: u_y, group: block}
  seat: {mean: sigma_yy, group: foundation_base}
  pull: {max: principal_1, group: block_under}
  lift: {mean: u_y, group: foundation_top}
"""


class Quantities(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        with open(os.path.join(BLOCKS, 'scene.yaml'), encoding='utf-8') as f:
            cls.text = f.read().replace('mesh: blocks.msh', f'mesh: {BLOCKS}/blocks.msh')
        cls.scene = cls.written(OUTPUTS, 'named')

    @classmethod
    def written(cls, outputs, folder):
        os.makedirs(cls.path(folder), exist_ok=True)
        with open(cls.path(folder, 'scene.yaml'), 'w', encoding='utf-8') as f:
            f.write(cls.text + outputs)
        return cls.path(folder)

    def test_solve(self):
        """Against the fields, on one rank and on three."""
        for ranks in (0, 3):
            found = self.hyco('solve', '-scene', self.scene, '-mu', '0.05,0.05', '-output', 'out.xdmf', ranks=ranks)['outputs']
            with h5py.File(self.path('out.h5')) as f:
                body, mises, stress = f['cells/body'][:, 0], f['cells/mises'][:, 0], f['cells/stress'][:]
                u, x, cells = f['nodes/displacement'][:], f['mesh/xyz'][:], f['mesh/cells'][:]
            self.near(found['peak'], mises.max(), 1e-12, 'peak')
            self.near(found['deepest'], u[cells[body == 0]].reshape(-1, 3)[:, 1].min(), 1e-12, 'deepest')
            base = x[:, 1] == x[:, 1].min()
            width, height = x[base, 0].max() - x[base, 0].min(), 0
            for cell, s in zip(cells, stress):
                on = base[cell]
                if on.sum() == 2:
                    height += abs(np.diff(x[cell[on], 0])[0]) * s[3]
            self.near(found['seat'], height / width, 1e-10, 'seat')
            # the foundation's top: the trapezoidal rule is exact
            top = np.unique(cells[body == 1])
            top = top[(x[top, 1] == x[top, 1].max()) & (x[top, 0] <= x[cells[body == 0]][..., 0].max() + 1e-6)]  # as far as the group
            top = top[np.argsort(x[top, 0])]
            self.near(found['lift'], np.trapz(u[top, 1], x[top, 0]) / np.ptp(x[top, 0]), 1e-10, 'lift')

    def test_predict(self):
        """In the RID and outside it; the same in tables, from 1 and 2 ranks."""
        for kind in ('hybrid', 'bodies'):
            self.hyco('train', '-scene', self.scene, '-grid', '5,5', '-model', f'{kind}.h5', '-hyco_model_type', kind, '-hyco_pod_tol', 1e-11)
            for mu in ('0.045,0.055', '0.07,0.03'):
                full = self.hyco('solve', '-scene', self.scene, '-mu', mu)['outputs']
                model = self.hyco('predict', '-model', f'{kind}.h5', '-mu', mu)['outputs']
                self.assertEqual(list(full), list(model))
                for name in full:
                    self.near(model[name], full[name], 0.03, f'{kind} {name} at {mu}')
        for command in (('predict', '-model', 'hybrid.h5'), ('solve', '-scene', self.scene)):
            rows = []
            for ranks in (0, 2):
                self.hyco(*command, '-grid', '2,2', '-table', 't.csv', ranks=ranks)
                with open(self.path('t.csv'), encoding='utf-8') as f:
                    rows.append([[float(row[name]) for name in ('crown', 'press', *full)] for row in csv.DictReader(f)])
            np.testing.assert_allclose(rows[0], rows[1], rtol=1e-7)
            one = self.hyco(command[0], *command[1:], '-mu', ','.join(str(v) for v in rows[0][3][:2]))['outputs']
            np.testing.assert_allclose(rows[0][3][2:], list(one.values()), rtol=1e-6)

    def test_polar(self):
        """About the pellet's axis; other outputs of the scene do not invalidate snapshots."""
        args = ('-scene', PELLET, '-mu', '4.06,1', '-output_hoop_max', 'sigma_tt', '-output_hoop_group', 'cladding', '-output_r_min', 'sigma_rr',
                '-output', 'out.xdmf')
        found = self.hyco('solve', *args)['outputs']
        with h5py.File(self.path('out.h5')) as f:
            stress, body = f['cells/stress'][:], f['cells/body'][:, 0]
            centre = f['mesh/xyz'][:][f['mesh/cells'][:]].mean(axis=1)
        c, s = centre[:, :2].T / np.hypot(*centre[:, :2].T)
        hoop = s**2 * stress[:, 0] + c**2 * stress[:, 3] - 2 * c * s * stress[:, 1]
        radial = c**2 * stress[:, 0] + s**2 * stress[:, 3] + 2 * c * s * stress[:, 1]
        self.assertTrue(any(abs(found['hoop'] - hoop[body == b].max()) < 1e-3 * abs(found['hoop']) for b in np.unique(body)), found)
        self.near(found['r'], radial.min(), 1e-3, 'radial')  # the centre of the moved cell is not that of the drawn one
        self.hyco('train', '-scene', self.written('', 'plain'), '-grid', '3,3', '-model', 'again.h5')
        folder = self.path('again.h5.snapshots')
        before = {name: os.stat(os.path.join(folder, name)).st_mtime_ns for name in os.listdir(folder)}
        self.assertEqual(len([name for name in before if name.endswith('.h5')]), 9)
        self.hyco('train', '-scene', self.scene, '-grid', '3,3', '-model', 'again.h5', '-hyco_pod_tol', 1e-9)
        self.assertEqual({name: os.stat(os.path.join(folder, name)).st_mtime_ns for name in os.listdir(folder)}, before)

    def test_polar_centroids(self):
        """A uniform stress sigma_xx = 1: the radial stress of a cell is that at its centroid (x, y), x^2/(x^2 + y^2), for every shape; of a cell
        around the axis it is the mean over the directions, 1/2."""
        centroid = {GMSH['pyramid5']: (3 / 16,) * 4 + (1 / 4,), GMSH['hex8']: (1 / 8,) * 8, GMSH['prism6']: (1 / 6,) * 6}
        for kind, low, n in (('whole', 1, 2), ('halves', 1, 2), ('pyramid5', 1, 2), ('whole', -2, 1)):
            grid = Grid()
            grid.mixed([np.linspace(low, 2, n + 1), np.linspace(low, 2, n + 1), np.linspace(0, 1, n + 1)], lambda x: x, 'cube',
                       {'x0': 'x0', 'x1': 'x1', 'y0': 'y0', 'z0': 'z0'}, lambda place, kind=kind: kind)
            os.makedirs(self.path('cube'), exist_ok=True)
            grid.write(self.path('cube', 'mesh.msh'))
            with open(self.path('cube', 'scene.yaml'), 'w', encoding='utf-8') as f:
                f.write('scene: {mesh: mesh.msh}\nbody: {cube: {young: 200, poisson: 0.3}}\nfixed: {x0: {x: 0}, y0: {y: 0}, z0: {z: 0}}\n'
                        'pressure: {x1: -1}\noutput: {most: {max: sigma_rr}, least: {min: sigma_rr}, hoop: {max: sigma_tt}}\n')
            place = np.array(grid.nodes)
            x, y = np.transpose([np.array(centroid[of]) @ place[np.array(nodes) - 1, :2] for of, _, nodes in grid.elements if of in centroid])
            radial = np.full(1, 0.5) if low < 0 else x**2 / (x**2 + y**2)
            found = self.hyco('solve', '-scene', self.path('cube'))['outputs']
            with self.subTest(kind=kind, low=low):
                self.near(found['most'], radial.max(), 1e-9)
                self.near(found['least'], radial.min(), 1e-9)
                self.near(found['hoop'], 1 - radial.min(), 1e-9)

    def test_refused(self):
        """Outputs with an unknown quantity, component or group: the message lists the valid ones."""
        for outputs, said in (('output: {peak: {max: mises, min: u}}\n', 'one of max, min, mean'), ('output: {peak: {max: stress}}\n', 'must be one of'),
                              ('output: {peak: {max: u_z}}\n', 'no u_z'), ('output: {peak: {group: block}}\n', 'has no field'),
                              ('output: {peak: {max: u, group: blok}}\n', 'blok'), ('output: {press: {max: u}}\n', 'name of a parameter'), ('output: {peak: {largest: u}}\n', 'max, min, mean, reaction, force, moment, friction, area, group, contact')):
            for ranks in (0, 2):
                run = self.run_raw('solve', '-scene', self.written(outputs, 'bad'), '-mu', '0.05,0.05', ranks=ranks)
                self.assertEqual(run.returncode, 1, run.stdout)
                self.assertEqual(run.stderr.count('hyco: error'), 1, run.stderr)
                self.assertIn(said, run.stderr)


if __name__ == '__main__':
    unittest.main()
