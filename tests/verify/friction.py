"""Coulomb friction against closed forms.

- Pad: pressed on a plane and drawn along it: T = mu N; the work of friction is mu N times the slip.
- Incline: a block that a horizontal force F pushes up a plane of the angle a against its weight G: F/G = (tan a + mu)/(1 - mu tan a).
- Cattaneo: two elastic half planes with a curved gap, pressed together by P, then loaded along the surface by Q (C. Cattaneo, Rend. Accad.
  Lincei 27 (1938); K. L. Johnson, Contact Mechanics, 1985, section 7.2): they stick in |x| < c = a sqrt(1 - Q/(mu P)), and
  q = mu p0 (sqrt(1 - x^2/a^2) - (c/a) sqrt(1 - x^2/c^2)), exact for equal materials. When Q falls from its largest value Q* (R. D. Mindlin,
  H. Deresiewicz, J. Appl. Mech. 20 (1953)), they slip back outside c' = a sqrt(1 - (Q* - Q)/(2 mu P)).
- Spheres: the same of two equal spheres, nu = 0: c = a (1 - Q/(mu P))^(1/3), and q with p0 = 3 P/(2 pi a^2). A loop between Q* and -Q* takes, with
  s = Q*/(mu P), the work 9 (mu P)^2/(10 a) (4/G) {1 - (1 - s)^(5/3) - (5 s/6) [1 + (1 - s)^(2/3)]} (Mindlin, Deresiewicz 1953).
  The shift of the spheres is 3 mu P/(16 a) (4/G) [1 - (1 - Q/(mu P))^(2/3)].
- Spence: a flat rigid punch on an elastic half plane sticks in |x| < c with mu/beta = K(c/a)/K'(c/a), beta Dundurs' constant (D. A. Spence,
  J. Elasticity 5 (1975) 297-319).
- GRECO: a plate, 40 x 40 mm, E = 130 GPa, nu = 0.2, in plane strain, held along x at one side, pressed on a plane with mu = 1 by 50 MPa and towards the
  held side by 150 MPa (code_aster, V6.04.128, SSNV128; the mean of the codes' results has an uncertainty of 5 %): u_x = 28.6 um at the loaded
  corner, then 27.2, 22.8, 19.8 and 15.0 um at places which the summary used here does not give: to its digits, nodes of a mesh of 32 cells.
- NAFEMS: an axisymmetric steel punch with a fillet on an aluminium cylinder under 100 MPa (A. Konter, Advanced Finite Element Contact Benchmarks,
  2006, number 2): mean of two codes on a coarse mesh, whose axial displacement under the punch is -0.13073 mm, -0.12858 mm with mu = 0.1. Twice as
  fine as here, u is 0.4 % larger.

Without friction, each of these numbers is another one: test_without.
"""
import subprocess
import unittest

import numpy as np

from grids import Grid, graded
from verify import Verify, read_step

PAD = """
scene: {title: pad, mesh: mesh.msh}
body: {pad: {young: 1000, poisson: 0.3}}
fixed: {top: {x: "0.01*s", y: "-0.002*min(t,1)"}}
contact: {floor: {type: obstacle, group: base, normal: {y: -1}, gap: 0, friction: "%s"}}
history: {times: [0, 1, 2, 3, 4], tables: {s: [[0, 0], [1, 0], [3, 1], [4, 0]]}}
output: {T: {friction: x, contact: floor}, W: {friction: work}, N: {force: y, contact: floor}}
"""
INCLINE = """
scene: {title: incline, mesh: mesh.msh}
constant: {a: 0.3, g: 50}
body: {block: {young: 1e5, poisson: 0.3}}
force: {block: {y: -g}}
fixed: {left: {x: "0.01*t"}}
contact: {plane: {type: obstacle, group: base, normal: {x: "sin(a)", y: "-cos(a)"}, gap: 0, friction: "%s"}}
history: {times: [0, 0.5, 1]}
output: {F: {reaction: x, group: left}}
"""
CATTANEO = """
scene: {title: Cattaneo, mesh: mesh.msh}
body: {low: {young: 1000, poisson: 0.3}, high: {young: 1000, poisson: 0.3}}
fixed: {bottom: {x: 0, y: 0}, top: {x: "s", y: "-w*min(t, 1)"}}
constant: {w: 0.0255, R: 100}
contact: {joint: {type: pair, slave: upper, master: lower, gap: "x^2/(2*R)", friction: "%s"}}
history: {times: [0, 1, 2, 3], tables: {s: [[0, 0], [1, 0], [2, %g], [3, %g]]}}
output: {P: {force: y, contact: joint}, Q: {friction: x, contact: joint}}
"""
SPHERES = """
scene: {title: spheres under a tangential load, mesh: mesh.msh}
body: {low: {young: 1000, poisson: 0}, high: {young: 1000, poisson: 0}}
fixed: {side: {y: 0}, bottom: {x: 0, y: 0, z: 0}, top: {x: "s", z: "-w*min(t, 1)"}}
constant: {w: 0.0118, R: 100}
contact: {joint: {type: pair, slave: upper, master: lower, gap: "(x^2 + y^2)/(2*R)", friction: 0.4}}
history: {times: [0, 1, 1.5, 2, 3, 4], tables: {s: [[0, 0], [1, 0], [2, 0.0032], [3, -0.0032], [4, 0.0032]]}}
output: {P: {force: z, contact: joint}, Q: {friction: x, contact: joint}}
"""
SPENCE = """
scene: {title: Spence, mesh: mesh.msh}
body: {block: {young: 1000, poisson: 0.3}}
fixed: {axis: {x: 0}, bottom: {x: 0, y: 0}}
contact: {punch: {type: obstacle, group: punch, normal: {y: 1}, gap: "-0.001*t", friction: "%.12g"}}
history: {times: [0, 1]}
"""

GRECO = """
scene: {title: GRECO plate, mesh: mesh.msh}
body: {plate: {young: 1.3e11, poisson: 0.2}}
fixed: {far: {x: 0}}
pressure: {near: 15e7*t, top: 5e7*t}
contact: {plane: {type: obstacle, group: base, normal: {y: -1}, gap: 0, friction: 1}}
history: {times: [0, 1]}
"""
NAFEMS = """
scene: {title: punch with a fillet, mesh: mesh.msh, formulation: axisymmetric}
body: {base: {young: 7e4, poisson: 0.3}, punch: {young: 2.1e5, poisson: 0.3}}
fixed: {bottom: {x: 0, y: 0}, axis: {x: 0}}
pressure: {top: 100*t}
contact: {joint: {type: surface, slave: foot, master: face, tolerance: 20, friction: %g}}
history: {times: [0, 0.25, 0.5, 0.75, 1]}
output: {u: {min: u_y, group: middle}}
"""
PUNCH = """
Point(1) = {0, -200, 0, 12}; Point(2) = {100, -200, 0, 12}; Point(3) = {100, 0, 0, 8}; Point(4) = {50, 0, 0, 1}; Point(5) = {40, 0, 0, 0.5};
Point(6) = {0, 0, 0, 2}; Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 5}; Line(5) = {5, 6}; Line(6) = {6, 1};
Point(11) = {0, 0, 0, 2}; Point(12) = {40, 0, 0, 0.5}; Point(13) = {40, 10, 0, 1}; Point(14) = {50, 10, 0, 2}; Point(15) = {50, 100, 0, 8};
Point(16) = {0, 100, 0, 8}; Line(11) = {11, 12}; Circle(12) = {12, 13, 14}; Line(13) = {14, 15}; Line(14) = {15, 16}; Line(15) = {16, 11};
Curve Loop(1) = {1:6}; Plane Surface(1) = {1}; Curve Loop(2) = {11:15}; Plane Surface(2) = {2};
Physical Surface("base", 1) = {1}; Physical Surface("punch", 2) = {2}; Physical Curve("bottom", 3) = {1}; Physical Curve("axis", 4) = {6, 15};
Physical Curve("face", 5) = {3:5}; Physical Curve("foot", 6) = {11, 12}; Physical Curve("top", 7) = {14}; Physical Point("middle", 8) = {6};
"""


class Friction(Verify):
    name = 'friction'

    def history(self, scene, *args):
        """The columns of the listed times and the outputs, a dictionary for each."""
        history = self.hyco('solve', '-scene', scene, '-output', self.path('out.xdmf'), *args, timeout=200)['history']
        columns = {**{k: v for k, v in history.items() if isinstance(v, list)}, **history.get('outputs', {})}
        rows = [dict(zip(columns, values)) for values in zip(*columns.values())]
        for row in rows:
            self.assertLess(row['kkt_max'], 1e-8)
            self.assertLess(row['energy_defect'], 1e-9)
            self.assertGreaterEqual(row['friction_work'], 0)
        return rows

    def pad(self, mu):
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 2, 17), np.linspace(0, 1, 9)], lambda x: x, 'pad', {'y0': 'base', 'y1': 'top'})
        return self.history(self.scene(PAD % mu, grid))

    def test_pad(self):
        """T = mu N in both directions, the state of all contacts, the work of a slip without stick."""
        rows = self.pad(0.3)
        self.row('pad: T / (mu N)', -rows[3]['T'] / (0.3 * rows[3]['N']), 1, 1e-9)
        self.row('pad: T / (mu N), back', rows[4]['T'] / (0.3 * rows[4]['N']), 1, 1e-9)
        self.row('pad: contacts that slip', rows[3]['n_slipping'] / rows[3]['n_active'], 1, 0)
        self.row('pad: work of friction over T times the slip', (rows[3]['W'] - rows[2]['W']) / (0.3 * rows[3]['N'] * 0.005), 1, 0.1)

    def incline(self, mu):
        turn = np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]])
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 2, 9), np.linspace(0, 1, 5)], lambda x: x @ turn, 'block', {'y0': 'base', 'x0': 'left'})
        return self.history(self.scene(INCLINE % mu, grid))[2]['F'] / (50 * 2)

    def test_incline(self):
        """No support holds the block against turning or sinking: contact does."""
        exact = lambda mu: (np.tan(0.3) + mu) / (1 - mu * np.tan(0.3))
        for mu in (0.2, 0.6):
            self.row(f'incline, mu = {mu}: F/G', self.incline(mu), exact(mu), 1e-6)

    def test_greco(self):
        """The plate slips where it is loaded, and its corner lifts off."""
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 0.04, 33)] * 2, lambda x: x, 'plate', {'x0': 'near', 'x1': 'far', 'y0': 'base', 'y1': 'top'})
        self.history(self.scene(GRECO, grid))
        step = read_step(self.path('out.h5'), 1)
        x, u, state = step['mesh/xyz'], 1e6 * step['nodes/displacement'][:, 0], step['nodes/contact_state'][:, 0]
        self.assertEqual({0, 1, 2}, set(state[x[:, 1] == 0]))
        for cell, known in ((0, 28.6), (1, 27.2), (4, 22.8), (6, 19.8), (9, 15.0)):
            at = np.flatnonzero((x[:, 1] == 0) & (abs(x[:, 0] - cell * 0.04 / 32) < 1e-9))
            self.row(f'GRECO plate: u_x of node {cell} of the edge, um', u[at[0]], known, 5)

    def test_nafems(self):
        """The punch without and with friction."""
        with open(self.path('punch.geo'), 'w', encoding='utf-8') as f:
            f.write(PUNCH)
        subprocess.run(['gmsh', '-2', 'punch.geo', '-format', 'msh41', '-o', 'mesh.msh'], cwd=self.folder, check=True, capture_output=True)
        u = {}
        for mu in (0, 0.1):
            with open(self.path('scene.yaml'), 'w', encoding='utf-8') as f:
                f.write(NAFEMS % mu)
            u[mu] = self.history(self.folder)[-1]['u']
        self.row('NAFEMS punch: u_y, mm', u[0], -0.13073, 3)
        self.row('NAFEMS punch: u_y with friction, mm', u[0.1], -0.12858, 3)
        self.row('NAFEMS punch: what friction changes, mm', u[0.1] - u[0], 0.00215, 5)

    def cattaneo(self, mu, cells, slips):
        """Rows of the history, the contact's places, and its fields at the listed times; `cells` in the half-width."""
        half = graded(1 / cells, 1.25, 60, 1.25)
        wide, deep = np.concatenate([-half[:0:-1], half]), graded(1 / cells, 0.25, 60, 1.3)
        grid = Grid()
        grid.box('quad4', [wide, -deep[::-1]], lambda x: x, 'low', {'y0': 'bottom', 'y1': 'lower'})
        grid.box('quad4', [wide, deep], lambda x: x, 'high', {'y0': 'upper', 'y1': 'top'})
        rows = self.history(self.scene(CATTANEO % (mu, *slips), grid))
        steps = [read_step(self.path('out.h5'), k) for k in range(4)]
        return rows, steps

    def compare(self, what, mu, step, row, cells, exact, stick):
        """Tractions in mu p0, and the edge of the zone `stick` in elements; a and p0 follow from P."""
        slave = (step['nodes/contact_pressure'][:, 0] > 0) & (step['mesh/xyz'][:, 1] >= 0)
        P, R, E = row['P'], 100, 1000 / (1 - 0.09) / 2
        a = np.sqrt(4 * P * R / (np.pi * E))
        x, q = step['mesh/xyz'][slave, 0], -step['nodes/contact_traction'][slave, 0]
        inside = abs(x) < a
        error = q[inside] - exact(x[inside], a, abs(row['Q']) / (mu * P), mu * 2 * P / (np.pi * a))
        self.row(f'{what}: rms error of the traction over mu p0', np.sqrt(np.mean(error**2)) / (mu * 2 * P / (np.pi * a)), 0, 0.01)
        still = abs(x[step['nodes/contact_state'][slave, 0] == 1]).max(initial=0)
        self.row(f'{what}: error of the stick zone in elements', abs(still - stick(a)) * cells, 0, 1)

    def test_cattaneo(self):
        """Loading, and unloading from there."""
        mu, cells = 0.4, 40
        rows, steps = self.cattaneo(mu, cells, (0.0105, 0.0045))
        root = lambda x, c: np.sqrt(np.maximum(c**2 - x**2, 0))
        s = abs(rows[2]['Q']) / (mu * rows[2]['P'])
        self.assertTrue(0.3 < s < 0.9, s)
        self.compare('Cattaneo', mu, steps[2], rows[2], cells, lambda x, a, s, q: q * (root(x, a) - root(x, a * np.sqrt(1 - s))) / a,
                     lambda a: a * np.sqrt(1 - s))
        back = s - abs(rows[3]['Q']) / (mu * rows[3]['P'])
        self.assertTrue(0.2 < back < 1.5, back)
        self.compare('Cattaneo, unloading', mu, steps[3], rows[3], cells, lambda x, a, now, q: q * (
            -root(x, a) + 2 * root(x, a * np.sqrt(1 - (s - now) / 2)) - root(x, a * np.sqrt(1 - s))) / a,
                     lambda a: a * np.sqrt(1 - back / 2))

    def test_spheres(self):
        """Half of two equal spheres, nu = 0, loaded to Q, to -Q and back: the zone of stick, the traction, and the work of the loop."""
        mu, cells = 0.4, 6
        half = graded(1 / cells, 1.34, 12, 1.6)
        wide, deep = np.concatenate([-half[:0:-1], half]), graded(1 / cells, 0.34, 12, 1.6)
        grid = Grid()
        grid.box('hex8', [wide, half, -deep[::-1]], lambda x: x, 'low', {'z0': 'bottom', 'z1': 'lower', 'y0': 'side'})
        grid.box('hex8', [wide, half, deep], lambda x: x, 'high', {'z0': 'upper', 'z1': 'top', 'y0': 'side'})
        rows = self.history(self.scene(SPHERES, grid))
        step = read_step(self.path('out.h5'), 3)
        P, Q = 2 * abs(rows[3]['P']), 2 * abs(rows[3]['Q'])
        a = (3 * P * 100 / (4 * 500))**(1 / 3)
        s, p0 = Q / (mu * P), 3 * P / (2 * np.pi * a**2)
        self.assertTrue(0.3 < s < 0.9, s)
        c = a * (1 - s)**(1 / 3)
        at = (step['nodes/contact_pressure'][:, 0] > 0) & (step['mesh/xyz'][:, 2] >= 0)
        r, q = np.hypot(*step['mesh/xyz'][at, :2].T), -step['nodes/contact_traction'][at, 0]
        root = lambda r, c: np.sqrt(np.maximum(c**2 - r**2, 0))
        inside = r < a
        error = q[inside] - mu * p0 * (root(r, a) - root(r, c))[inside] / a
        self.row('spheres: rms error of the traction over mu p0', np.sqrt(np.mean(error**2)) / (mu * p0), 0, 0.05)
        self.row('spheres: error of the stick zone in elements', abs(r[step['nodes/contact_state'][at, 0] == 1].max(initial=0) - c) * cells, 0, 1)
        self.row('spheres: tangential force after half a loop over that before', rows[4]['Q'] / rows[3]['Q'], -1, 1)
        exact = 9 * (mu * P)**2 / (10 * a) * (2 * 2 / 500) * (1 - (1 - s)**(5 / 3) - 5 * s / 6 * (1 + (1 - s)**(2 / 3)))
        self.row('spheres: work of friction in a loop', 2 * (rows[5]['friction_work'] - rows[3]['friction_work']), exact, 10)
        shift = lambda row: 3 * mu * P / (16 * a) * 2 * 2 / 500 * (1 - (1 - 2 * abs(row['Q']) / (mu * P))**(2 / 3))
        blocks = (0.0016 - shift(rows[2])) / rows[2]['Q']  # the blocks are finite, and as stiff under any load
        self.row('spheres: shift at Q, with the stiffness of the blocks from the shift at half of it', shift(rows[3]) + blocks * rows[3]['Q'], 0.0032, 1)

    def spence(self, mu, cells):
        """The outermost node that sticks, over the half-width."""
        inner = 1 - graded(1 / (4 * cells), 0.25, 1, 1.15)[::-1]
        outer = 1 + graded(1 / (4 * cells), 0.25, 99, 1.25)[1:]
        grid = Grid()
        grid.box('quad4', [np.concatenate([inner, outer]), -graded(1 / (2 * cells), 0.25, 100, 1.2)[::-1]], lambda x: x, 'block',
                 {'x0': 'axis', 'y0': 'bottom', 'y1': ('punch', len(inner) - 1)})
        self.history(self.scene(SPENCE % mu, grid))
        step = read_step(self.path('out.h5'), 1)
        return step['mesh/xyz'][step['nodes/contact_state'][:, 0] == 1, 0].max(initial=0), np.diff(inner).max()

    def test_spence(self):
        """The zone's edge within an element."""
        beta = (1 - 2 * 0.3) / (2 * (1 - 0.3))
        for share, stick in ((0.6, 0.287), (1.0, 0.707)):
            found, element = self.spence(share * beta, 40)
            self.row(f'Spence, mu/beta = {share}: error of the stick zone in elements', abs(found - stick) / element, 0, 1)

    def test_without(self):
        """mu = 0 is not what the tests above expect."""
        rows = self.pad(0)
        self.assertEqual(rows[3]['T'], 0)
        self.assertEqual(rows[3]['W'], 0)
        self.near(self.incline(0), np.tan(0.3), 1e-6)
        rows, _ = self.cattaneo(0, 5, (0.0105, 0.0045))
        self.assertEqual(rows[2]['Q'], 0)
        self.assertEqual(self.spence(0, 10)[0], 0)


if __name__ == '__main__':
    unittest.main()
