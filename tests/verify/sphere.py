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

    def judge(self, n, at, substeps):
        """n cells in the last contact's radius; at: the quotients w, judged."""
        force, h = self.forces(n, at, '-hyco_substeps', substeps)
        self.assertTrue(h['ended'])
        for w, f in zip(at, force):
            for name, fit in (('Kogut, Etsion', kogut_etsion), ('Jackson, Green', jackson_green)):
                self.row(f'{n} cells in the contact, w = {w}: force, {name}', f, fit(w), 5)

    def forces(self, n, at, *args):
        along, towards = axes(radius(at[-1]), n, 1, 20)
        grid = Grid()
        grid.box('hex8', [along, along, towards], under, 'sphere',
                 {'x0': 'side_x', 'y0': 'side_y', 'z0': 'top', 'z1': ('under', 3 * n // 2)})
        h = self.hyco('solve', '-scene', self.scene(SCENE % ', '.join(map(str, at)), grid), *args, timeout=900)['history']
        self.assertLess(max(h['kkt_max']), 1e-8)
        self.assertLess(max(h['energy_defect']), 1e-8)
        return 4 * np.array(h['total_contact_force'][1:]) / F_C, h


class Sphere(Spheres):
    name = 'sphere'

    def test_force(self):
        """Coarse: with this few cells the force at a smaller w is that of a contact to half a cell. The finer one: sphere_long.py."""
        self.judge(4, (80,), 20)


if __name__ == '__main__':
    unittest.main()
