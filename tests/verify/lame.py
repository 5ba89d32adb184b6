"""Lame's thick cylinders, shrunk one on the other with interference delta at the common radius c (inner bore a, outer
radius b), plane strain: uniform pressure

    delta = p c [ ((b^2 + c^2)/(b^2 - c^2) + n2)/E2' + ((c^2 + a^2)/(c^2 - a^2) - n1)/E1' ],
    E' = E/(1 - nu^2),  n = nu/(1 - nu)

and the stresses sigma_r, sigma_t = A (1 -+ q^2/r^2), sigma_z = nu (sigma_r + sigma_t), with q = a,
A = -p c^2/(c^2 - a^2) in the inner cylinder, q = b, A = p c^2/(b^2 - c^2) in the outer
(Timoshenko and Goodier, Theory of Elasticity, 3rd ed. 1970, chapter 4, stress symmetrical about an axis; a = 0 for a
solid cylinder.) The interference is a negative gap. The pressure is each node's force over its length or area.
"""
import os
import unittest

import numpy as np

from common import PELLET
from grids import Grid
from verify import Verify, order

SCENE = """
scene: {title: shrink fit, mesh: mesh.msh}
body: {inner: {young: 2e5, poisson: 0.25}, outer: {young: 1e5, poisson: 0.35}}
fixed: {x0: {x: 0}, y0: {y: 0}}
contact: {fit: {type: pair, slave: shaft, master: sleeve, tolerance: 1e-6, normal: {x: x, y: y}, gap: -1e-3}}
"""
# the pellet's mesh and groups without its pressures, and no displacement along the axis
PLANE_PELLET = """
scene: {{title: "pellet with interference, plane strain", mesh: {mesh}}}
body: {{pellet: {{young: 1e5, poisson: 0.3}}, cladding: {{young: 1e5, poisson: 0.3}}}}
fixed: {{sym_x0: {{x: 0}}, sym_y0: {{y: 0}}, pellet: {{z: 0}}, cladding: {{z: 0}}}}
contact:
  gap: {{type: pair, slave: contact_pellet, master: contact_clad, tolerance: 1e-3, normal: {{x: x, y: y}}, gap: -0.01}}
"""


def pressure(a, c, b, inner, outer, delta):
    """p of cylinders (Young's modulus, Poisson's ratio)."""
    def compliance(young, poisson, ratio, sign):
        return (ratio + sign * poisson / (1 - poisson)) * (1 - poisson**2) / young

    hoop = compliance(*outer, (b**2 + c**2) / (b**2 - c**2), 1) + compliance(*inner, (c**2 + a**2) / (c**2 - a**2), -1)
    return delta / (c * hoop)


def worst(pressures, exact):
    """The nodal pressure that is farthest from it."""
    return max(pressures, key=lambda p: abs(p - exact))


def stress(x, p):
    """(xx, xy, xz, yy, yz, zz) of the rings a = 1, c = 2, b = 3 at the points x (n x 3)."""
    r = np.hypot(x[:, 0], x[:, 1])
    cos, sin, inside = x[:, 0] / r, x[:, 1] / r, r < 2
    mean, rim, poisson = (np.where(inside, a, b) for a, b in ((-p * 4 / 3, p * 4 / 5), (1, 3), (0.25, 0.35)))
    radial, hoop = mean * (1 - rim**2 / r**2), mean * (1 + rim**2 / r**2)
    return np.column_stack([cos**2 * radial + sin**2 * hoop, cos * sin * (radial - hoop), 0 * r,
                            sin**2 * radial + cos**2 * hoop, 0 * r, poisson * (radial + hoop)])


def polar(x):
    return x[:, :1] * np.column_stack([np.cos(x[:, 1]), np.sin(x[:, 1])])


class Lame(Verify):
    name = 'lame'

    def test_rings(self):
        """A quarter of two rings, 1 to 2 and 2 to 3, quadrilaterals."""
        exact = pressure(1, 2, 3, (2e5, 0.25), (1e5, 0.35), 1e-3)
        sizes, found, off = (8, 16, 32), [], []
        for n in sizes:
            grid = Grid()
            angle = np.linspace(0, np.pi / 2, 2 * n + 1)
            for body, low, faces in (('inner', 1, {'x1': 'shaft'}), ('outer', 2, {'x0': 'sleeve'})):
                grid.box('quad4', [np.linspace(low, low + 1, n + 1), angle], polar, body,
                         {**faces, 'y0': 'y0', 'y1': 'x0'})
            out = self.solve(self.scene(SCENE, grid))[1]
            found.append(worst(out['pressure'], exact))
            centre = out['mesh/xyz'][out['mesh/cells']].mean(axis=1)
            off.append(abs(out['cells/stress'] - stress(centre, exact)).max() / exact)
        self.row('rings: order of the pressure', order(1 / np.array(sizes), abs(np.array(found) - exact)), 2, 5)
        self.row('rings: pressure at its worst node', found[-1], exact, 0.1)
        self.row('rings: order of the stresses', order(1 / np.array(sizes), off), 2, 10)
        self.row('rings: largest stress error over the pressure', off[-1], 0, 2e-3)

    def test_pellet(self):
        """The pellet's meshes A, B, C at radius 4.1 with an interference of 0.01 mm."""
        exact = pressure(0, 4.1, 4.7, (1e5, 0.3), (1e5, 0.3), 0.01)
        sizes, found = {'A': 4, 'B': 8, 'C': 12}, []  # elements per 45 degrees
        for mesh in sizes:
            path = self.path('scene.yaml')
            with open(path, 'w', encoding='utf-8') as f:
                f.write(PLANE_PELLET.format(mesh=os.path.join(PELLET, mesh + '.msh')))
            found.append(worst(self.solve(self.folder, timeout=200)[1]['pressure'], exact))
            self.row(f'pellet {mesh}: pressure at its worst node', found[-1], exact, 0.3 if mesh == 'A' else 0.1)
        size = 1 / np.array(list(sizes.values()))
        self.row('pellet A, B, C: order of the pressure', order(size, abs(np.array(found) - exact)), 2, 5)


if __name__ == '__main__':
    unittest.main()
