"""A ring that creeps, plane strain, a = 4.1, b = 4.7, E = 1e5, nu = 0.3, Norton n = 1, rate A = 2e-6: with n = 1 the
deviator obeys Maxwell's law, dilatation is elastic, and pressures are sums of two exponentials, by hand from the
correspondence principle (R. M. Christensen, Theory of Viscoelasticity, 2nd ed. 1982, section 2.1).

Shrunk on a solid elastic core with interference 0.01: p = 21.8253172 exp(-0.146510938 t) + 10.2066022 exp(-0.225014142 t).
Pressed from outside by 50 over a gap of 0.02 it closes at t = 1.63214460, and then, s = t - 1.63214460,
p = 50 - 34.2891470 exp(-0.146510938 s) - 15.7108530 exp(-0.225014142 s).
"""
import math
import os
import subprocess
import unittest

import numpy as np

from common import PELLET
from grids import Grid
from verify import Verify, order

SCENE = """
scene: {{title: ring on a core, mesh: mesh.msh}}
body:
  core: {{young: 1e5, poisson: 0.3}}
  ring: {{law: norton, young: 1e5, poisson: 0.3, rate: 2e-6, exponent: 1}}
fixed: {{x0: {{x: 0}}, y0: {{y: 0}}}}
pressure: {{outside: {outside}}}
contact: {{fit: {{type: pair, slave: shaft, master: sleeve, tolerance: 1e-6, normal: {{x: x, y: y}}, gap: {gap}}}}}
history: {{times: [{times}]}}
"""
PELLET_SCENE = """
scene: {{title: the same in 3D, mesh: {mesh}}}
body:
  pellet: {{young: 1e5, poisson: 0.3}}
  cladding: {{law: norton, young: 1e5, poisson: 0.3, rate: 2e-6, exponent: 1}}
fixed: {{sym_x0: {{x: 0}}, sym_y0: {{y: 0}}, pellet: {{z: 0}}, cladding: {{z: 0}}}}
pressure: {{clad_outer_high: {outside}, clad_outer_low: {outside}}}
contact:
  gap: {{type: pair, slave: contact_pellet, master: contact_clad, tolerance: 1e-3, normal: {{x: x, y: y}}, gap: {gap}}}
history: {{times: [{times}]}}
"""
CLOSES = 1.63214460
LENGTH = 4.1 * math.pi / 2  # of the contact, on the quarter


def relaxing(t):
    return 21.8253172 * np.exp(-0.146510938 * t) + 10.2066022 * np.exp(-0.225014142 * t)


def closing(t):
    s = np.maximum(t - CLOSES, 0)
    return np.where(t < CLOSES, 0, 50 - 34.2891470 * np.exp(-0.146510938 * s) - 15.7108530 * np.exp(-0.225014142 * s))


def equal(steps, end):
    return ', '.join(f'{t:.12g}' for t in np.linspace(0, end, steps + 1))


def polar(x):
    return x[:, :1] * np.column_stack([np.cos(x[:, 1]), np.sin(x[:, 1])])


class Paths(Verify):
    """What ring_long.py shares."""

    def mesh(self, n, core=0):
        """A quarter, n cells through the ring; the core has a bore of a hundredth of its radius, which changes 1e-5 of p."""
        grid = Grid()
        angle = np.linspace(0, np.pi / 2, 4 * n + 1)
        grid.box('quad4', [np.linspace(4.1, 4.7, n + 1), angle], polar, 'ring',
                 {'x0': 'sleeve', 'x1': 'outside', 'y0': 'y0', 'y1': 'x0'})
        angle = np.linspace(0, np.pi / 2, (core or 4 * n) + 1)
        grid.box('quad4', [np.geomspace(0.041, 4.1, 4 * n + 1), angle], polar, 'core',
                 {'x1': 'shaft', 'y0': 'y0', 'y1': 'x0'})
        return grid

    def solved_path(self, scene, area, *args, **options):
        """Times and mean pressures: the nodes' radial forces, over the area of the contact."""
        h = self.hyco('solve', '-scene', scene, '-hyco_substeps', '1', *args, **options)['history']
        self.assertTrue(h['ended'])
        self.assertLess(max(h['kkt_max']), 1e-8)
        self.assertLess(max(h['energy_defect']), 1e-8)
        return np.array(h['t']), np.array(h['total_contact_force']) / area, h

    def path_of(self, n, steps, outside, gap, end, *args):
        scene = self.scene(SCENE.format(outside=outside, gap=gap, times=equal(steps, end)), self.mesh(n))
        return self.solved_path(scene, LENGTH, *args)

    def pellet_path(self, mesh, steps, outside, gap, end):
        """In 3D, on a mesh of the pellet with all z held, where every layer of cells bears the same."""
        with open(self.path('scene.yaml'), 'w', encoding='utf-8') as f:
            f.write(PELLET_SCENE.format(mesh=mesh, outside=outside, gap=gap, times=equal(steps, end)))
        return self.solved_path(self.folder, LENGTH * 6.75, timeout=1500)

    def two_layers(self, mesh):
        """The pellet's mesh of this name with two layers of cells."""
        path = self.path(mesh + '.msh')
        m, nc = {'A': (4, 2), 'B': (8, 4), 'C': (12, 6)}[mesh]
        subprocess.run(['gmsh', '-3', os.path.join(PELLET, 'pellet.geo'), '-format', 'msh41', '-o', path, '-v', '1', *(
            str(w) for name, n in (('m', m), ('nr', m), ('nc', nc), ('nzl', 1), ('nzh', 1)) for w in ('-setnumber', name, n))], check=True)
        return path

    def judge_order(self, title, paths):
        """Paths of k, 2 k and 4 k steps: the slope of their differences at the times of the first."""
        k = len(paths[0]) - 1
        on = [p[::(len(p) - 1) // k] for p in paths]
        first = [abs(a - b).max() for a, b in zip(on, on[1:])]
        self.row(f'{title}: order in time', math.log2(first[0] / first[1]), 1, 5)

    def judge_closing(self, title, path, at, off=0.5, bound=0.2):
        t, p, h = path
        before = t < (1 - 0.02 * off) * CLOSES
        self.row(f'{title}: largest force before', max(np.array(h['lambda_max'])[before]), 0, 0)
        k = int(np.argmax(p > 0))
        begin = t[k] - p[k] * (t[k + 1] - t[k]) / (p[k + 1] - p[k])
        self.row(f'{title}: time', begin, CLOSES, off)
        for time in at:
            k = int(round(time / t[1]))
            self.row(f'{title}: p at t = {time:g}', p[k], float(closing(t[k])), bound)
        return begin


class Ring(Paths):
    name = 'ring'

    def test_shrink_fit(self):
        """A shrink fit that relaxes: pressure in time, order in the time step."""
        self.judge_order('shrink fit', [self.path_of(4, k, 0, -0.01, 8, '-hyco_step_inelastic', 1)[1] for k in (40, 80, 160)])
        t, p, _ = self.path_of(8, 640, 0, -0.01, 8)
        self.row('shrink fit: p at t = 0', p[0], relaxing(0), 0.1)
        for k in (80, 160, 320, 640):
            self.row(f'shrink fit: p at t = {t[k]:g}', p[k], relaxing(t[k]), 0.2)

    def test_closing(self):
        """A gap that closes by creep."""
        self.judge_closing('closing', self.path_of(8, 1280, 50, 0.02, 6), (3, 4, 6))

    def test_pellet(self):
        """The same in 3D; finer steps, and the whole of mesh C: ring_long.py."""
        for mesh, steps, end, bound in (('A', 100, 2, 0.4), ('B', 10, 0.25, 0.2)):
            t, p, _ = self.pellet_path(os.path.join(PELLET, mesh + '.msh'), steps, 0, -0.01, end)
            for k in (0, steps // 2, steps):
                self.row(f'pellet {mesh}, z held: p at t = {t[k]:g}', p[k], relaxing(t[k]), bound)

    def test_pellet_closing(self):
        """The gap of the pellet's meshes, all z held, closes by creep."""
        begin = [self.judge_closing(f'pellet {mesh}, z held, closing', self.pellet_path(self.two_layers(mesh), steps, 50, 0.02, end), at,
                                    off, bound)
                 for mesh, steps, end, at, off, bound in (('A', 80, 2, (), 2, 0), ('B', 80, 2, (), 0.5, 0), ('C', 240, 12, (12,), 0.5, 0.3))]
        self.row('pellet A, B, C, z held: order of the time of closing', order(1 / np.array([2, 4, 6]), abs(np.array(begin) - CLOSES)), 2, 20)
        self.judge_order('pellet A, z held, closing', [self.pellet_path(self.path('A.msh'), k, 50, 0.02, 8)[1] for k in (20, 40, 80)])

    def test_surfaces_that_do_not_match(self):
        """The core has 13 cells where the ring has 16; the pressure is the mean."""
        scene = self.scene(SCENE.replace('type: pair', 'type: surface').replace('1e-6', '0.05')
                           .format(outside=0, gap=-0.01, times=', '.join(f'{k / 40:g}' for k in range(81))), self.mesh(4, 13))
        h = self.hyco('solve', '-scene', scene)['history']
        for k in (0, 40, 80):
            self.row(f'surfaces that do not match: p at t = {k / 40:g}', h['total_contact_force'][k] / LENGTH, relaxing(k / 40), 0.5)


if __name__ == '__main__':
    unittest.main()
