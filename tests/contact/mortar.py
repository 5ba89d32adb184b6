"""Contacts of type mortar on moved surfaces: ranks, models, messages. What they are for, pressures: tests/verify/mortar.py."""
import os
import sys
import unittest

import h5py
import numpy as np

import roller
from common import SOURCE, Case, msh

sys.path.append(os.path.join(SOURCE, 'tests', 'verify'))
from grids import Grid, second  # noqa: E402

RANGES = {'lo': -4, 'hi': 4}
POINTS = ('1.3,0.5,20', '-3.7,1.5,60')


class Mortar(Case):
    def fields(self, *args, **options):
        """Displacements and contact forces of a run, which must succeed."""
        report = self.hyco(*args, '-output', self.path('out.xdmf'), **options)
        self.solved(report)
        with h5py.File(self.path('out.h5')) as f:
            return f['nodes/displacement'][:], f['contact/lambda'][:, 0], report

    def refused(self, *args, texts=()):
        run = self.run_raw(*args)
        self.assertNotEqual(run.returncode, 0)
        self.assertEqual(len(run.stderr.splitlines()), 1, run.stderr)
        for text in texts:
            self.assertIn(text, run.stderr)

    def test_moved_on_ranks(self):
        """A map moves the master under the slave: masters are found again, many to a row, the same on 1 to 4 ranks and for a mesh that
        is drawn in place; and other than by node to surface."""
        for dim, n, m in ((2, 64, 36), (3, 16, 10)):
            with self.subTest(dim=dim):
                roller.mesh(self.path('moved.msh'), dim, n=n, m=m)
                roller.mesh(self.path('drawn.msh'), dim, at=1.3, n=n, m=m)
                scene = self.path('scene.yaml')
                roller.scene(scene, 'drawn.msh', dim, moved=False, kind='mortar')
                u, forces, _ = self.fields('solve', '-scene', scene, '-mu', POINTS[0])
                for ranks in (1, 2, 4):
                    roller.scene(scene, 'moved.msh', dim, kind='mortar', **RANGES)
                    moved, found, _ = self.fields('solve', '-scene', scene, '-mu', POINTS[0], ranks=ranks)
                    self.assertLess(abs(moved - u).max(), 1e-9 * abs(u).max())
                    self.assertLess(abs(found - forces).max(), 1e-9 * forces.max())
                roller.scene(scene, 'moved.msh', dim, kind='surface', **RANGES)
                found = self.fields('solve', '-scene', scene, '-mu', POINTS[0])[1]
                self.assertGreater(abs(found - forces).max(), 1e-3 * forces.max())

    def test_models(self):
        """A model of bodies has the forces of full order; hybrid models on a part of the mesh, whose contacts' masters are in it, and projection-based ones
        have them at training points; regression takes them; other types refuse by name."""
        roller.mesh(self.path('moved.msh'), 2)
        scene, model = self.path('scene.yaml'), self.path('bodies.h5')
        roller.scene(scene, 'moved.msh', kind='mortar', **RANGES)
        self.hyco('train', '-scene', scene, '-model', model, '-grid', '2,2,2', '-hyco_model_type', 'bodies', '-hyco_bodies_pod_tol', '1e-12')
        for mu in POINTS:
            u, forces, _ = self.fields('solve', '-scene', scene, '-mu', mu)
            found_u, found, _ = self.fields('predict', '-model', model, '-mu', mu)
            self.assertLess(abs(found - forces).max(), 1e-10 * forces.max())
            self.assertLess(abs(found_u - u).max(), 1e-4 * abs(u).max())  # away from contacts modes up to -hyco_bodies_pod_tol
        points = ('-values_place', '-4,1.3,4', '-values_press', '0.3,1', '-values_modulus', '5,20')
        for kind, more, bound in (('hybrid', ('-hyco_rid_layers', 1), 1e-9), ('projection', ('-hyco_dual', 'snapshots'), 1e-6), ('regression', (), 0.1)):
            model = self.path(f'{kind}.h5')
            report = self.hyco('train', '-scene', scene, '-model', model, *points, '-hyco_model_type', kind, '-hyco_pod_tol', '1e-18', *more)
            if kind == 'hybrid':
                self.assertLess(report['rid_fraction'], 0.9)
            for mu in ('1.3,0.3,20', '4,1,5'):
                u, forces, _ = self.fields('solve', '-scene', scene, '-mu', mu)
                found_u, found, _ = self.fields('predict', '-model', model, '-mu', mu)
                self.assertLess(abs(found_u - u).max(), bound * abs(u).max(), kind)
                if kind == 'hybrid':
                    self.assertLess(abs(found - forces).max(), bound * forces.max())
        for kind in ('cubature',):
            self.refused('train', '-scene', scene, '-model', self.path('other.h5'), '-grid', '2,2,2', '-hyco_model_type', kind,
                         texts=('contact under has type mortar', f'a model of type {kind} does not take them', 'type: surface'))

    def test_wider_rows(self):
        """A block of two cells turns on a rail of eight: with the turn its rows meet more masters than as drawn, and models have room for them."""
        nodes, elements = [], []
        roller.grid([8, 1], lambda i, j, k: (i, j, 0), nodes, elements, 1, {(1, 0): 11, (1, 1): 12})
        roller.grid([2, 1], lambda i, j, k: (1 + i, 1 + j, 0), nodes, elements, 2, {(1, 0): 13, (1, 1): 14})
        msh(self.path('rail.msh'), nodes, elements, {1: (2, 'rail'), 2: (2, 'block'), 11: (1, 'base'), 12: (1, 'upper'), 13: (1, 'under'), 14: (1, 'top')})
        scene = self.written("""
scene: {mesh: rail.msh, parameters: [t]}
parameter: {t: {range: [-0.01, 0.01]}}
body: {rail: {young: 1000, poisson: 0.3}, block: {young: 2000, poisson: 0.3, map: {x: "2 + (x-2)*cos(t) - (y-1)*sin(t)", y: "1 + (x-2)*sin(t) + (y-1)*cos(t)"}}}
fixed: {base: {x: 0, y: 0}, top: {x: 0, y: -0.02}}
contact: {c: {type: mortar, slave: under, master: upper}}
""")
        u, forces, _ = self.fields('solve', '-scene', scene, '-mu', '0.01')
        for kind, *more in (('hybrid',), ('projection', '-hyco_dual', 'snapshots')):
            self.hyco('train', '-scene', scene, '-model', self.path('m.h5'), '-grid', '7', '-hyco_model_type', kind, '-hyco_validation', '0',
                      '-hyco_pod_tol', '1e-18', *more)
            found_u, found, _ = self.fields('predict', '-model', self.path('m.h5'), '-mu', '0.01')
            self.assertLess(abs(found - forces).max(), 1e-6 * forces.max(), kind)
            self.assertLess(abs(found_u - u).max(), 1e-6 * abs(u).max(), kind)

    def test_dual_seeds(self):
        """A model whose contacts, of many masters each, are seeds of the reduced domain, with as many points as solutions; on one rank and two."""
        roller.mesh(self.path('moved.msh'), 3, n=16, m=10)
        scene, found = self.path('scene.yaml'), []
        roller.scene(scene, 'moved.msh', 3, kind='mortar', **RANGES)
        for ranks in (1, 2):
            report = self.hyco('train', '-scene', scene, '-model', self.path(f'm{ranks}.h5'), '-values_place', '-4,-2,0,2,4', '-values_press', '1,2',
                               '-values_modulus', '5', '-hyco_model_type', 'hybrid', '-hyco_rid_modes', 'displacement,dual', '-hyco_rid_dual_tol', '1e-9',
                               '-hyco_rid_layers', '1', '-hyco_validation', '0', '-hyco_scan', '0', ranks=ranks)
            found.append(report['rid_fraction'])
        self.assertLess(found[0], 0.9)
        self.assertEqual(*found)

    def test_check(self):
        """check names the contacts without a node opposite, and the type for these; a mortar has no such line."""
        roller.mesh(self.path('moved.msh'), 2)
        for kind, there in (('surface', True), ('mortar', False)):
            roller.scene(self.path('scene.yaml'), 'moved.msh', kind=kind)
            run = self.run_raw('check', '-scene', self.path('scene.yaml'))
            self.assertEqual(run.returncode, 0, run.stderr)
            self.assertEqual('type: mortar gives better pressures' in run.stdout, there, run.stdout)

    def test_nothing_opposite(self):
        """Slave nodes that face nothing within the tolerance are an error, which names one; with a stated tolerance they have no contact."""
        roller.mesh(self.path('drawn.msh'), 2)
        scene = self.path('scene.yaml')
        roller.scene(scene, 'drawn.msh', moved=False, kind='mortar')
        with open(scene, encoding='ascii') as f:
            text = f.read()
        with open(scene, 'w', encoding='ascii') as f:
            f.write(text.replace(', tolerance: 30', ''))
        self.refused('solve', '-scene', scene, '-mu', POINTS[0], texts=('of the 37 nodes of round face no part of upper within', 'tolerance'))
        with open(scene, 'w', encoding='ascii') as f:
            f.write(text.replace('tolerance: 30', 'tolerance: 1'))
        self.assertLess(self.hyco('solve', '-scene', scene, '-mu', POINTS[0])['n_facing'], 37)
        with open(scene, 'w', encoding='ascii') as f:
            f.write(text.replace('slave: round', 'slave: upper').replace('master: upper', 'master: base'))
        self.refused('solve', '-scene', scene, '-mu', POINTS[0], texts=('upper', 'base'))

    def test_fine_slave(self):
        """A slave of second order more than twice as fine as the master is warned of, and not one exactly twice as fine, nor one of first order; to exchange the two is advised unless it makes the stiffer side the slave."""
        for kind, slave, young, warned, exchange in (('quad8', 4, 100, False, False), ('quad8', 5, 100, True, True), ('tri6', 5, 100, True, True), ('quad4', 5, 100, False, False), ('quad8', 5, 50, True, False)):
            grid = Grid()
            for body, n, y in (('low', 2, -1), ('up', slave, 0)):
                grid.box({'quad8': 'quad4', 'tri6': 'tri3'}.get(kind, kind), [np.linspace(0, 1, n + 1), np.linspace(0, 1, 3)], lambda x, y=y: x + (0, y), body, {'y0': f'{body}_low', 'y1': f'{body}_high'})
            mesh = grid if kind == 'quad4' else second(grid, kind)
            scene = self.written('scene: {mesh: mesh.msh}\nbody: {low: {young: 100}, up: {young: %g}}\nfixed: {low_low: {x: 0, y: 0}, up_high: {x: 0}}\npressure: {up_high: 1}\n'
                                 'contact: {c: {type: mortar, slave: up_low, master: low_high}}\n' % young, mesh)
            lines = [line for line in self.hyco('check', '-scene', scene)['warnings'] if 'up_low' in line]
            with self.subTest(kind=kind, slave=slave, young=young):
                self.assertEqual((len(lines), any('low_high' in line for line in lines), any('exchange' in line for line in lines)), (int(warned), warned, exchange), lines)


if __name__ == '__main__':
    unittest.main()
