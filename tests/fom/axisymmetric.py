"""Axisymmetric scenes and plane stress: models, ranks, and refusals."""
import os
import sys
import unittest

import h5py
import numpy as np

from common import SOURCE, Case

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import Grid  # noqa: E402

SCENE = """
scene: {title: ring on a core, mesh: mesh.msh, formulation: axisymmetric, parameters: [push, gap]}
parameter: {push: {range: [50, 150]}, gap: {range: [0.001, 0.003]}}
body: {core: {young: 1e5, poisson: 0.3}, ring: {young: 1e5, poisson: 0.3}}
fixed: {middle: {y: 0}}
pressure: {outside: push*exp(-(y/2)^2)}
contact: {fit: {type: pair, slave: shaft, master: sleeve, tolerance: 1e-6, normal: {x: 1}, gap: gap}}
"""


class Revolution(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        grid = Grid()
        for body, r, faces in (('core', np.linspace(0, 2, 9), {'x1': 'shaft'}), ('ring', np.linspace(2, 3, 5), {'x0': 'sleeve', 'x1': 'outside'})):
            grid.box('quad4', [r, np.linspace(0, 4, 17)], lambda x: x, body, {**faces, 'y0': 'middle'})
        grid.write(cls.path('mesh.msh'))

    def test_models(self):
        """Every type of model, compared with full order at points that were not used for training."""
        scene = self.written(SCENE)
        for kind, bound, force in (('hybrid', 0.01, 0.03), ('projection', 0.01, 0.3), ('bodies', 1e-5, 1e-6)):
            with self.subTest(kind=kind):
                self.hyco('train', '-scene', scene, '-grid', '5,3', '-model', 'm.h5', '-hyco_model_type', kind, '-hyco_pod_tol', 1e-10,
                          *(('-hyco_rid_layers', 1) if kind == 'hybrid' else ()))
                found = self.hyco('compare', '-scene', scene, '-model', 'm.h5', '-grid', '3,4')
                self.assertLess(found['error_u']['max'], bound)
                self.assertLess(found['error_lambda']['max'], force)
        first = self.hyco('solve', '-scene', scene, '-mu', '120,0.002')
        self.solved(first)
        second = self.hyco('solve', '-scene', scene, '-mu', '120,0.002', ranks=3)
        for name in ('total_contact_force', 'u_norm2', 'strain_energy'):
            self.near(second[name], first[name], 1e-10, name)

    def test_axis(self):
        """Nodes on the axis are held without an entry of the scene; a body under an axial load is free only along the axis."""
        scene = self.written(SCENE)
        self.hyco('solve', '-scene', scene, '-mu', '120,0.002', '-output', 'out.xdmf')
        with h5py.File(self.path('out.h5')) as f:
            axis = f['mesh/xyz'][:, 0] == 0
            self.assertEqual(abs(f['nodes/displacement'][:][axis, 0]).max(), 0)
        run = self.run_raw('solve', '-scene', self.written(SCENE.replace('fixed: {middle: {y: 0}}', 'fixed: {sleeve: {y: 0}}')), '-mu', '120,0.002')
        self.assertEqual(run.returncode, 1)
        self.assertIn('body core from moving along (0, 1, 0)', run.stderr)
        self.assertNotIn('turning', run.stderr)

    def refused(self, text, said, *args):
        for ranks in (0, 2):
            run = self.run_raw('solve', '-scene', self.written(text), '-mu', '120,0.002', *args, ranks=ranks)
            self.assertEqual(run.returncode, 1, run.stdout)
            self.assertEqual(run.stderr.count('hyco: error'), 1, run.stderr)
            self.assertIn(said, run.stderr)

    def test_refused(self):
        """Unknown formulations, bodies across the axis or moved off it, and bbar where it locks are refused."""
        self.refused(SCENE.replace('axisymmetric', 'axial'), 'plane_strain, plane_stress or axisymmetric')
        self.refused(SCENE.replace('core: {', 'core: {map: {x: x - 0.1}, '), 'must be drawn at x >= 0')
        self.refused(SCENE.replace('core: {', 'core: {map: {x: x + 0.1}, '), 'nodes on the axis')
        self.refused(SCENE.replace('axisymmetric', 'plane_stress').replace('core: {', 'core: {element: bbar, '), 'volumetric locking')
        with open(self.path('mesh.msh'), encoding='ascii') as f:
            quads = f.read()
        grid = Grid()
        for body, r, faces in (('core', np.linspace(0, 2, 3), {'x1': 'shaft'}), ('ring', np.linspace(2, 3, 3), {'x0': 'sleeve', 'x1': 'outside'})):
            grid.box('tri3', [r, np.linspace(0, 4, 5)], lambda x: x, body, {**faces, 'y0': 'middle'})
        grid.write(self.path('mesh.msh'))  # their dilatation is not constant, but its mean locks too
        self.refused(SCENE.replace('core: {', 'core: {element: bbar, '), 'too stiff as a mean over the cell')
        with open(self.path('mesh.msh'), 'w', encoding='ascii') as f:
            f.write(quads)
        creeps = SCENE.replace('core: {', 'core: {law: norton, rate: 1e-9, exponent: 3, ') + 'history: {times: [0, 1]}\n'
        self.refused(creeps.replace('axisymmetric', 'plane_stress'), 'plane_stress is for linear laws')
        run = self.run_raw('solve', '-scene', os.path.join(SOURCE, 'examples', 'rope'), '-scene_formulation', 'plane_stress', '-mu', '0.07,0.17')
        self.assertEqual(run.returncode, 1)
        self.assertIn('this mesh has 1 dimension;', run.stderr)


if __name__ == '__main__':
    unittest.main()
