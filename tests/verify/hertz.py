"""Hertz's contact (K. L. Johnson, Contact Mechanics, 1985, section 4.2, a and c), judged at the total force that the
solution itself carries, so that the load's place and the body's size matter only through terms of order (a/R)^2:

    cylinders, F per length:  a^2 = 4 F R/(pi E*),   p0 = 2 F/(pi a),      p = p0 sqrt(1 - x^2/a^2)
    spheres:                  a^3 = 3 F R/(4 E*),    p0 = 3 F/(2 pi a^2),  p = p0 sqrt(1 - r^2/a^2)
    1/R = 1/R1 + 1/R2,  1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2 (a rigid plane: 0)

A body pressed by its mirror image's plane (prescribed displacement there): a quarter of a disc, an eighth of a ball.
The peak is the pressure of the node in the middle, its force over the length or area it stands for; the half-width
follows from the second moment of the nodal forces, which for Hertz's profile is F a^2/4 (cylinders) and 2 F a^2/5
(spheres); the last active node tells it to a cell. The body's radius is 100 half-widths. The displacements are such
that the cylinders' half-width is near a whole number of cells on every mesh: elsewhere errors change sign from mesh to
mesh and show no order.
"""
import unittest

import numpy as np

from grids import Grid, ball, graded
from verify import Verify, order, read

CYLINDER = """
scene: {{title: cylinder on a rigid plane, mesh: mesh.msh}}
body: {{cylinder: {{young: 1, poisson: 0.3}}}}
fixed: {{side: {{x: 0}}, top: {{y: -{press}}}}}
contact: {{plane: {{type: obstacle, group: under, normal: {{y: -1}}, gap: y + 1}}}}
"""
CYLINDERS = """
scene: {{title: cylinder on cylinder, mesh: mesh.msh}}
body: {{upper: {{young: 1, poisson: 0.3}}, lower: {{young: 2, poisson: 0.2}}}}
fixed: {{side: {{x: 0}}, top: {{y: -{press}}}, base: {{y: 0}}}}
contact:
  line: {{type: pair, slave: upper_contact, master: lower_contact, tolerance: {tolerance}, normal: {{y: -1}},
         gap: 1 - sqrt(1 - x^2) + {radius} - sqrt({radius}^2 - x^2)}}
"""
SPHERE = """
scene: {{title: sphere on a rigid plane, mesh: mesh.msh}}
body: {{sphere: {{young: 1, poisson: 0.3}}}}
fixed: {{side_x: {{x: 0}}, side_y: {{y: 0}}, top: {{z: -{press}}}}}
contact: {{plane: {{type: obstacle, group: under, normal: {{z: -1}}, gap: z + 1}}}}
"""


def axes(width, n, radius, growth):
    """The grid of a disc or ball, along the surface and towards it: n cells in a half-width as far as 1.5 of them, then
    growing, to `growth` times in n cells: each mesh halves the one before everywhere. Near the contact ball() makes
    cells sqrt(2) narrower along the surface."""
    fine, zone, ratio = width / n, 1.5 * width, growth**(1 / n)
    along = graded(fine * np.sqrt(2) / radius, zone * np.sqrt(2) / radius, 1, ratio)
    return along, 1 - graded(fine / radius, zone / radius, 1, ratio)[::-1]


def under(x):
    """The unit disc or ball with its contact point down, at (0, -1)."""
    out = ball(x)
    out[:, -1] *= -1
    return out


class Hertz(Verify):
    name = 'hertz'

    def judge(self, title, cells, runs, lowest, bound=0.5):
        """runs: (computed a, exact a, last active node, computed p0, exact p0) of each mesh; cells: in a half-width;
        lowest: order."""
        a, a_exact, last, p, p_exact = np.array(runs).T
        size = 1 / np.array(cells)
        self.row(f'{title}: half-width, order', order(size, abs(a / a_exact - 1)), lowest, 0, least=True)
        self.row(f'{title}: half-width', a[-1], a_exact[-1], bound)
        self.row(f'{title}: last active node, to a cell', last[-1], a_exact[-1], 100 * size[-1])
        self.row(f'{title}: peak pressure, order', order(size, abs(p / p_exact - 1)), lowest, 0, least=True)
        self.row(f'{title}: peak pressure', p[-1], p_exact[-1], bound)

    def measure(self, out, part, stiffness, radius):
        """From the forces on `part` of the contact (a half, a quarter): what judge() takes."""
        plane = out['dim'] == 2
        r = np.linalg.norm(out['at'][:, :out['dim'] - 1], axis=1)
        force = np.sum(out['lambda']) / part
        moment = np.sum(out['lambda'] * r**2) / np.sum(out['lambda'])
        quotient = force * radius / stiffness
        exact = np.sqrt(4 * quotient / np.pi) if plane else np.cbrt(3 * quotient / 4)
        a = np.sqrt(moment * (4 if plane else 5 / 2))
        p0 = 2 * force / np.pi / exact if plane else 3 * force / 2 / np.pi / exact**2
        peak = out['pressure'][np.argmin(r)]
        print(f'hertz: {len(out["mesh/xyz"])} nodes, {len(r)} contacts, a {a:.6g} exact {exact:.6g}, '
              f'p0 {peak:.6g} exact {p0:.6g}, largest {out["pressure"].max():.6g}')
        return a, exact, r[out['lambda'] > 0].max(), peak, p0

    def test_cylinder(self):
        """A quarter of a cylinder of radius 1 on a rigid plane."""
        cells, runs, width = (4, 8, 16), [], 0.01
        for n in cells:
            grid = Grid()
            grid.box('quad4', axes(width, n, 1, 4), under, 'cylinder',
                     {'x0': 'side', 'y0': 'top', 'y1': ('under', 3 * n // 2)})
            out = self.solve(self.scene(CYLINDER.format(press=2.741e-4), grid))[1]
            runs.append(self.measure(out, 1 / 2, 1 / (1 - 0.3**2), 1))
        self.judge('cylinder on plane', cells, runs, 1.5)

    def test_cylinders(self):
        """Radii 1 and 2, moduli 1 and 2: pairs at equal x, vertical normal."""
        cells, runs, width, radius = (4, 8, 16), [], 0.01, 2
        for n in cells:
            grid = Grid()
            grid.box('quad4', axes(width, n, 1, 4), lambda x: under(x) + [0, 1], 'upper',
                     {'x0': 'side', 'y0': 'top', 'y1': ('upper_contact', 3 * n // 2)})
            grid.box('quad4', axes(width, n, radius, 4), lambda x: radius * (ball(x) - [0, 1]), 'lower',
                     {'x0': 'side', 'y0': 'base', 'y1': ('lower_contact', 3 * n // 2)})
            scene = CYLINDERS.format(press=4.291e-4, radius=radius, tolerance=3 * width**2)
            out = self.solve(self.scene(scene, grid))[1]
            runs.append(self.measure(out, 1 / 2, 1 / ((1 - 0.3**2) / 1 + (1 - 0.2**2) / 2), 1 / (1 + 1 / radius)))
        self.judge('cylinder on cylinder', cells, runs, 1.5)

    def test_surface(self):
        """The cylinders on meshes that do not match (node to surface), full order and reduced: trained on four loads, asked
        at another. Node to surface scatters the nodes' pressures about the true ones by a share that does not fall with the
        mesh (see patch.py): the peak is that of Hertz's profile p^2 = p0^2 (1 - x^2/a^2) fitted to them."""
        n, width, radius, press = 16, 0.01, 2, 4.291e-4
        grid = Grid()
        grid.box('quad4', axes(width, n, 1, 4), lambda x: under(x) + [0, 1], 'upper',
                 {'x0': 'side', 'y0': 'top', 'y1': ('upper_contact', 3 * n // 2)})
        m = 11
        grid.box('quad4', axes(width, m, radius, 4), lambda x: radius * (ball(x) - [0, 1]), 'lower',
                 {'x0': 'side', 'y0': 'base', 'y1': ('lower_contact', 3 * m // 2 + 2)})
        scene = CYLINDERS.format(press='press', radius=radius, tolerance=3 * width**2)
        scene = scene.replace('type: pair', 'type: surface').replace(
            'mesh: mesh.msh}', 'mesh: mesh.msh, parameters: [press]}\nparameter: {press: {range: [2e-4, 6e-4]}}')
        scene = self.scene(scene, grid)
        out = self.solve(scene, '-mu', press)[1]
        stiffness, curvature = 1 / ((1 - 0.3**2) / 1 + (1 - 0.2**2) / 2), 1 / (1 + 1 / radius)
        self.judge_surface('not matching', out, stiffness, curvature)
        model = self.path('hertz.h5')
        self.hyco('train', '-scene', scene, '-model', model, '-values_press', '2e-4,3e-4,3.6e-4,4e-4,4.6e-4,5e-4,6e-4',
                  '-hyco_pod_tol', '1e-12', '-hyco_hybrid', 'contact', '-hyco_rid_contact_extension', width, '-hyco_rid_layers',
                  '1')
        report = self.hyco('predict', '-model', model, '-mu', press, '-output', self.path('reduced.xdmf'))
        self.solved(report)
        reduced = read(self.path('reduced.h5'))
        self.judge_surface('not matching, reduced', reduced, stiffness, curvature)
        self.row('not matching, reduced: forces apart from full order', np.linalg.norm(reduced['lambda'] - out['lambda']) /
                 np.linalg.norm(out['lambda']), 0, 0.02)

    def judge_surface(self, title, out, stiffness, curvature):
        a, exact, _, _, peak = self.measure(out, 1 / 2, stiffness, curvature)
        x = abs(out['at'][:, 0])
        inside = x < 0.9 * exact
        profile = 1 - (x[inside] / exact)**2
        fitted = np.sqrt(out['pressure'][inside]**2 @ profile / (profile @ profile))
        self.row(f'{title}: half-width', a, exact, 0.5)
        self.row(f'{title}: peak of the fitted profile', fitted, peak, 2)
        scatter = abs(out['pressure'][inside] - peak * np.sqrt(profile)).max() / peak
        self.row(f'{title}: largest scatter of a pressure over the peak', scatter, 0, 0.1)

    def test_sphere(self):
        """An eighth of a ball of radius 1 on a rigid plane. The edge, a circle, crosses cells at arbitrary positions: errors
        change sign from mesh to mesh, hence the low bound on the orders."""
        cells, runs, width = (2, 4, 8), [], 0.01
        for n in cells:
            along, towards = axes(width, n, 1, 20)
            grid = Grid()
            grid.box('hex8', [along, along, towards], under, 'sphere',
                     {'x0': 'side_x', 'y0': 'side_y', 'z0': 'top', 'z1': ('under', 3 * n // 2)})
            out = self.solve(self.scene(SPHERE.format(press=1e-4), grid))[1]
            runs.append(self.measure(out, 1 / 4, 1 / (1 - 0.3**2), 1))
        self.judge('sphere on plane', cells, runs, 1)


if __name__ == '__main__':
    unittest.main()
