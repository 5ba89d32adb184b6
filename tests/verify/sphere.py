"""An elastic, perfectly plastic sphere (von Mises) pressed on a rigid plane: the force F at the interference w, both over
their values at first yield,

    w_c = (pi C Y/(2 E'))^2 R,   F_c = 4/3 (R/E')^2 (pi C Y/2)^3,   C = 1.295 exp(0.736 nu),   E' = E/(1 - nu^2),

against two fits of axisymmetric finite elements (w, F: the quotients):

    L. Kogut, I. Etsion, J. Appl. Mech. 69 (2002) 657-662:   F = 1.40 w^1.263 from w = 6 to 110
    R. L. Jackson, I. Green, J. Tribol. 127 (2005) 343-354:  F = exp(-w^(5/12)/4) w^(3/2) + 4 H/(C Y) (1 - exp(-w^(5/9)/25)) w,
        H = 2.84 Y (1 - exp(-0.82 (a/R)^-0.7)),  a/R = pi C Y/(2 E') sqrt(w (w/1.9)^B),  B = 0.14 exp(23 Y/E')

which differ by up to 4.8 % from each other (the first writes C Y as K H, H = 2.8 Y, K = 0.454 + 0.41 nu: the same to 0.05 %).
An eighth of a ball, hexahedra with bbar; its middle plane comes down by w.
"""
import unittest

import numpy as np

from grids import Grid
from hertz import axes, under
from verify import Verify

E, NU, Y = 1.0, 0.3, 1e-3
STIFF = E / (1 - NU**2)
C = 1.295 * np.exp(0.736 * NU)
W_C = (np.pi * C * Y / (2 * STIFF))**2
F_C = 4 / 3 / STIFF**2 * (np.pi * C * Y / 2)**3
SECTION = f"""
scene: {{title: sphere on a rigid plane, mesh: mesh.msh, formulation: axisymmetric}}
body: {{sphere: {{young: {E}, poisson: {NU}, law: {{type: j2, yield: {Y}}}}}}}
fixed: {{top: {{y: "-{W_C:.12g}*t"}}}}
contact: {{plane: {{type: obstacle, group: under, normal: {{y: -1}}, gap: y + 1}}}}
history: {{times: [0, %s]}}
hyco: {{step_inelastic: 0.01}}
"""
SCENE = f"""
scene: {{title: sphere on a rigid plane, mesh: mesh.msh}}
body: {{sphere: {{young: {E}, poisson: {NU}, law: {{type: j2, yield: {Y}}}}}}}
fixed: {{side_x: {{x: 0}}, side_y: {{y: 0}}, top: {{z: "-{W_C:.12g}*t"}}}}
contact: {{plane: {{type: obstacle, group: under, normal: {{z: -1}}, gap: z + 1}}}}
history: {{times: [0, %s]}}
hyco: {{step_inelastic: 0.01}}
"""


def kogut_etsion(w):
    return 1.40 * w**1.263


def radius(w):
    return np.pi * C * Y / (2 * STIFF) * np.sqrt(w * (w / 1.9)**(0.14 * np.exp(23 * Y / STIFF)))


def jackson_green(w):
    hard = 2.84 * (1 - np.exp(-0.82 * radius(w)**-0.7))
    return np.exp(-w**(5 / 12) / 4) * w**1.5 + 4 * hard / C * (1 - np.exp(-w**(5 / 9) / 25)) * w


class Spheres(Verify):
    """What sphere_long.py shares."""

    def judge(self, title, force, at):
        for w, f in zip(at, force):
            for name, fit in (('Kogut, Etsion', kogut_etsion), ('Jackson, Green', jackson_green)):
                self.row(f'{title}, w = {w}: force, {name}', f, fit(w), 5)

    def forces(self, n, at, substeps, solid):
        """The quotients F at the quotients w; n cells in the last contact's radius; of the section, or of an eighth in 3D."""
        along, towards = axes(radius(at[-1]), n, 1, 20)
        grid, part = Grid(), 3 * n // 2
        if solid:
            grid.box('hex8', [along, along, towards], under, 'sphere', {'x0': 'side_x', 'y0': 'side_y', 'z0': 'top', 'z1': ('under', part)})
        else:
            grid.box('quad4', [along, towards], under, 'sphere', {'y0': 'top', 'y1': ('under', part)})
        scene = self.scene((SCENE if solid else SECTION) % ', '.join(map(str, at)), grid)
        h = self.hyco('solve', '-scene', scene, '-hyco_substeps', substeps, timeout=900)['history']
        self.assertTrue(h['ended'])
        self.assertLess(max(h['kkt_max']), 1e-8)
        self.assertLess(max(h['energy_defect']), 1e-8)
        return (4 if solid else 1) * np.array(h['total_contact_force'][1:]) / F_C


class Sphere(Spheres):
    name = 'sphere'

    def test_section(self):
        """The axisymmetric section of the sphere."""
        at = (20, 40, 60, 80)
        self.judge('axisymmetric', self.forces(24, at, 8, False), at)

    def test_solid(self):
        """In 3D, and coarse: with few cells in the contact its radius, and with it the force, is known to half a cell. Finer: sphere_long.py."""
        self.judge('3D, 4 cells in the contact', self.forces(4, (80,), 20, True), (80,))


if __name__ == '__main__':
    unittest.main()
