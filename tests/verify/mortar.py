"""Contact of type mortar: a uniform pressure between meshes that do not match, exact on both sides where node to surface
(patch.py) has an error that refinement does not lower; Hertz's pressures (hertz.py) on such meshes."""
import itertools
import unittest

import h5py
import numpy as np

import hertz  # the modules: unittest runs test classes that are imported by name
import patch
from grids import Grid, ball, second
from hertz import under
from patch import KINDS, exact, stack
from verify import Verify, read, read_step

# cells of the slave over those of the master: finer by 1.4 and 1.5, coarser by 0.7
RATIOS = {'quad4': ((7, 5), (3, 2), (7, 10)), 'tri3': ((7, 5), (3, 2), (7, 10)),
          'hex8': ((3, 2), (4, 3), (2, 3)), 'tet4': ((3, 2), (4, 3), (2, 3))}
SECOND = {'quad4': 'quad9', 'tri3': 'tri6', 'hex8': 'hex27', 'tet4': 'tet10'}
SCENE = """
scene: {mesh: mesh.msh}
body: {a: {young: 100, poisson: 0.3}, b: {young: 40, poisson: 0.2}}
fixed: {base: {%s}, top: {%s}%s}
contact: {seam: {type: %s, slave: %s, master: %s%s}}
"""
PRESS = 0.03
SHEAR = """
scene: {mesh: mesh.msh}
body: {a: {young: 100}, b: {young: 40}}
fixed: {base: {x: 0, y: 0%s}%s}
traction: {top: {%s: "-0.6*min(t,1)"%s}, "a_x0,b_x0": {%s: -%g*s}, "a_x1,b_x1": {%s: %g*s}}
contact: {seam: {type: %s, slave: b_low, master: a_top, friction: 0.3}}
history: {times: [0, 1, 2], tables: {s: [[0, 0], [1, 0], [2, 1]]}}
"""


def axes(n, top):
    return [np.linspace(0, 1, k + 1) for k in n[:-1]] + [top[0] + (top[1] - top[0]) * np.linspace(0, 1, n[-1] + 1)]


class Mortar(patch.Held):
    name = 'mortar'
    measure = patch.Patch.measure

    def test_patch(self):
        """First order, both sides, given gap: pressure and stress uniform on all meshes."""
        for kind, (slaves, masters) in ((k, r) for k in KINDS for r in RATIOS[k]):
            with self.subTest(kind=kind, slaves=slaves, masters=masters):
                flat = KINDS[kind] == 2
                stack(self, kind, [masters, 4] if flat else [masters, masters, 3], [slaves, 6] if flat else [slaves, slaves, 4], 'mortar')
                m = self.measure(kind, 0.05, 0.02)
                name, p = f'{kind} {slaves} slave cells on {masters}', m['p']
                worst = abs(m['pressure'] / p - 1)
                self.held(f'{name}, pressure', m['pressure'][worst.argmax()], p, worst.max(), 1e-12)
                self.held(f'{name}, stress', p * (1 + m['wrong'].max()), p, m['wrong'].max(), 1e-12)
                balance = max(abs(m['total'] / p - 1), abs(m['reaction'] / m['total'] - 1), m['force'], m['moment'])
                self.held(f'{name}, total force, reaction, forces, moments', balance, 0, balance, 1e-12)

    def second_order(self, kind, slaves, masters, contact='mortar'):
        """The largest error of the axial stress of a stack of second order over the pressure, and the report."""
        dim = KINDS[kind]
        grid = Grid()
        up, mid = 'xyz'[dim - 1], ('x0', 'y0')[:dim - 1]
        grid.box(kind, axes([masters] * (dim - 1) + [2], (0, 1)), lambda x: x, 'a',
                 {f'{up}0': 'base', f'{up}1': 'a_top', **{k: f'a_{k}' for k in mid}})
        grid.box(kind, axes([slaves] * (dim - 1) + [3], (1, 2.5)), lambda x: x, 'b',
                 {f'{up}0': 'b_low', f'{up}1': 'top', **{k: f'b_{k}' for k in mid}})
        sides = ''.join(f', {b}_{k}: {{{k[0]}: 0}}' for b in 'ab' for k in mid)
        folder = self.written(SCENE % (f'{up}: 0', f'{up}: -{PRESS}', sides, contact, 'b_low', 'a_top', ''), second(grid, SECOND[kind]))
        r = self.hyco('solve', '-scene', folder, '-output', self.path('s.xdmf'))
        self.solved(r)
        p = exact(dim, PRESS, 0)
        return abs(read(self.path('s.h5'))['cells/stress'][:, 3 if dim == 2 else 5] / p + 1).max(), r['total_contact_force'] / p

    def test_second_order(self):
        """Lines of three nodes, facets of nine, and of six with the middles alone as slaves."""
        for kind, (slaves, masters) in itertools.product(SECOND, ((3, 2), (2, 3))):
            with self.subTest(kind=kind, slaves=slaves):
                wrong, total = self.second_order(kind, slaves, masters)
                name = f'{SECOND[kind]} {slaves} slave cells on {masters}'
                self.held(f'{name}, stress', wrong, 0, wrong, 1e-12)
                self.held(f'{name}, total force', total, 1, abs(total - 1), 1e-11)

    def turned(self, kind, angle, contact, more=''):
        """The stress error of block b, master, which stands turned by `angle` on the larger and coarser held block a, slave."""
        dim = KINDS[kind]
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        grid = Grid()
        grid.box(kind, [4 * a - 1.5 if k < dim - 1 else a - 1 for k, a in enumerate(axes([7] * (dim - 1) + [1], (0, 1)))], lambda x: x, 'a',
                 {f'{"xyz"[dim - 1]}0': 'base', f'{"xyz"[dim - 1]}1': 'a_top'})

        def bend(x):
            return x if dim == 2 else np.hstack([(x[:, :2] - 0.5) @ turn.T + 0.5, x[:, 2:]])

        grid.box(kind, axes([5] * (dim - 1) + [3], (0, 1)), bend, 'b', {f'{"xyz"[dim - 1]}0': 'b_low', f'{"xyz"[dim - 1]}1': 'top'})
        text = SCENE % ('x: 0, y: 0' + ', z: 0' * (dim == 3), f'{"xyz"[dim - 1]}: -{PRESS}', '', contact, 'a_top', 'b_low',
                        ', tolerance: 0.01' + more)
        text = text.replace('fixed: {base:', 'fixed: {a:')
        folder = self.written(text, grid)
        r = self.hyco('solve', '-scene', folder, '-output', self.path('s.xdmf'), '-hyco_regularise', 'true')
        self.solved(r)
        out = read(self.path('s.h5'))
        middle = out['mesh/xyz'][out['mesh/cells']].mean(axis=1)[:, dim - 1] > 0
        p = PRESS * 40 / (1 - 0.2**2 if dim == 2 else 1)
        return abs(out['cells/stress'][middle][:, 3 if dim == 2 else 5] / p + 1).max()

    def test_borders(self):
        """A master that covers the slave's facets in part, turned about the normal in 3D: uniform where node to surface is not."""
        for kind in KINDS:
            for angle in (0, 0.4) if KINDS[kind] == 3 else (0,):
                with self.subTest(kind=kind, angle=angle):
                    wrong = self.turned(kind, angle, 'mortar')
                    self.assertGreater(self.turned(kind, angle, 'surface'), 0.01)
                    self.held(f'{kind} on a larger slave, turned by {angle}, stress', wrong, 0, wrong, 1e-12)

    def test_axisymmetric(self):
        """Rings, inner and outer radius 1 and 2 or from the axis: the pressure of a uniform axial stress, weighted by 2 pi r."""
        for kind, inner, (slaves, masters) in itertools.product(('quad4', 'tri3', 'quad9'), (0, 1), ((7, 5), (3, 2), (7, 10))):
            with self.subTest(kind=kind, inner=inner, slaves=slaves):
                grid = Grid()
                flat = {'quad9': 'quad4'}.get(kind, kind)
                grid.box(flat, axes([masters, 4], (0, 1)), lambda x: x + [inner, 0], 'a', {'y0': 'base', 'y1': 'a_top'})
                grid.box(flat, axes([slaves, 4], (1, 2.5)), lambda x: x + [inner, 0], 'b', {'y0': 'b_low', 'y1': 'top'})
                text = SCENE.replace('mesh.msh}', 'mesh.msh, formulation: axisymmetric}').replace('poisson: 0.3', 'poisson: 0')
                text = text.replace('poisson: 0.2', 'poisson: 0')
                folder = self.written(text % ('y: 0', f'y: -{PRESS}', '', 'mortar', 'b_low', 'a_top', ''),
                                      grid if kind == flat else second(grid, kind))
                r = self.hyco('solve', '-scene', folder, '-output', self.path('s.xdmf'))
                self.solved(r)
                p = PRESS / (1 / 100 + 1.5 / 40)
                out = read(self.path('s.h5'))
                away = out['at'][:, 0] > 0
                wrong = max(abs(out['cells/stress'][:, 3] / p + 1).max(), abs(out['pressure'][away] / p - 1).max())
                name = f'axisymmetric {kind} from radius {inner}, {slaves} slave cells on {masters}'
                self.held(f'{name}, stress and pressure', wrong, 0, wrong, 1e-12)
                force = np.pi * ((inner + 1)**2 - inner**2) * p
                self.held(f'{name}, force', r['total_contact_force'], force, abs(r['total_contact_force'] / force - 1), 1e-11)


class Hertz(Verify):
    def rms(self, out, part, plane):
        """The root mean square of the pressures' errors over the peak, within 0.9 half-widths: at the edge any mesh has that of a cell."""
        stiffness, curvature = 1 / ((1 - 0.3**2) / 1 + (1 - 0.2**2) / 2), 1 + 1 / 2
        r = np.linalg.norm(out['at'][:, :out['dim'] - 1], axis=1)
        force = np.sum(out['lambda']) / part
        a = np.sqrt(4 * force / stiffness / curvature / np.pi) if plane else np.cbrt(3 * force / stiffness / curvature / 4)
        p0 = 2 * force / np.pi / a if plane else 3 * force / 2 / np.pi / a**2
        inside = r < 0.9 * a
        return np.sqrt(np.mean((out['pressure'][inside] / p0 - np.sqrt(1 - (r[inside] / a)**2))**2))

    def pressed(self, kind, n, m, contact, press, formulation):
        """The solution of radii 1 on 2, n and m cells in a half-width, gaps and normals as measured."""
        width, radius, growth, grid, dim = 0.01, 2, 20 if kind == 'hex8' else 4, Grid(), KINDS[kind]
        lift = np.eye(dim)[-1]
        sides = {'x0': 'side', 'y0': 'side_y'} if dim == 3 else {'x0': 'side'}
        up = 'xyz'[dim - 1]
        for name, cells, size, bend, far, more in (('upper', n, 1, lambda x: under(x) + lift, 'top', 0),
                                                   ('lower', m, radius, lambda x: radius * (ball(x) - lift), 'base', 2)):
            along, towards = hertz.axes(width, cells, size, growth)
            axes_of = [along] * (dim - 1) + [towards] if dim == 3 else (along, towards)
            grid.box(kind, axes_of, bend, name, {**sides, f'{up}0': far, f'{up}1': (f'{name}_contact', 3 * cells // 2 + more)})
        scene = hertz.CYLINDERS.format(press=press, radius=radius, tolerance=3 * width**2).replace('type: pair', f'type: {contact}')
        scene = scene[:scene.index(', normal: {y: -1}')] + '}\n'
        scene = scene.replace('mesh: mesh.msh', f'mesh: mesh.msh{formulation}')
        if dim == 3:
            scene = scene.replace('side: {x: 0}', 'side: {x: 0}, side_y: {y: 0}').replace('top: {y:', 'top: {z:').replace('base: {y:', 'base: {z:')
        return self.solve(self.scene(scene, grid))[1]

    def compare(self, title, kind, ratios, press, part, formulation=''):
        """Mortar within the bound, and not worse than meshes that match, of the coarser side; node to surface outside it."""
        plane, least = title == 'cylinders', min(min(r) for r in ratios)
        matching = self.rms(self.pressed(kind, least, least, 'surface', press, formulation), part, plane)
        for n, m in ratios:
            wrong = self.rms(self.pressed(kind, n, m, 'mortar', press, formulation), part, plane)
            self.row(f'{title}, {n} cells on {m} in a half-width, rms of the pressure over the peak', wrong, 0, BOUND[title])
            self.assertLess(wrong, max(1.1 * matching, 1e-3))
            wrong = self.rms(self.pressed(kind, n, m, 'surface', press, formulation), part, plane)
            self.assertGreater(wrong, 2 * BOUND[title])


class MortarHertz(Hertz):
    name = 'mortar_hertz'

    def test_cylinders(self):
        """Ratios 0.7, 1.4 and 3:2 of the slave's cells to the master's."""
        self.compare('cylinders', 'quad4', ((11, 16), (22, 16), (24, 16)), 4.291e-4, 1 / 2)

    def test_balls(self):
        """An eighth of each ball, on coarse meshes: the error is theirs."""
        self.compare('spheres', 'hex8', ((6, 4), (4, 6)), 1.5e-4, 1 / 4)


class MortarFriction(Verify):
    name = 'mortar_friction'

    def sheared(self, kind, slaves, masters, contact, slips):
        """Poisson's ratio 0, a pressure of 0.6 and the shear stress q on all sides: uniform stress. The nodes' pressures and tractions."""
        dim, q, grid = KINDS[kind], 0.6 * 0.3 if slips else 0.12, Grid()
        up = 'xyz'[dim - 1]
        for name, n, span, groups in (('a', masters, (0, 1), ('base', 'a_top')), ('b', slaves, (1, 2.5), ('b_low', 'top'))):
            grid.box(kind, axes([n] * (dim - 1) + [3], span), lambda x: x, name,
                     {f'{up}0': groups[0], f'{up}1': groups[1], 'x0': f'{name}_x0', 'x1': f'{name}_x1'})
        drawn, pulled = (', top: {x: 0.2*s}', '') if slips else ('', f', x: {q}*s')
        text = SHEAR % (', z: 0' * (dim == 3), drawn, up, pulled, up, q, up, q, contact)
        report = self.hyco('solve', '-scene', self.scene(text, grid), '-output', self.path('s.xdmf'))
        self.assertLess(max(report['history']['kkt_max']), 1e-8)
        step = read_step(self.path('s.h5'), 2)
        slave = step['nodes/contact_pressure'][:, 0] > 0
        self.assertEqual(slave.sum(), (slaves + 1)**(dim - 1))
        return step['nodes/contact_pressure'][slave, 0], step['nodes/contact_traction'][slave], q

    def test_uniform(self):
        """A block that sticks, pressed and sheared; and one that is drawn until it slips: uniform tractions, mu times the pressure where it slips."""
        for kind, (slaves, masters), slips in itertools.product(('quad4', 'hex8'), ((3, 2), (2, 3)), (False, True)):
            with self.subTest(kind=kind, slaves=slaves, slips=slips):
                pressure, traction, q = self.sheared(kind, slaves, masters, 'mortar', slips)
                name = f'{kind} {slaves} slave cells on {masters}, {"slip" if slips else "stick"}'
                worst = max(abs(pressure / 0.6 - 1).max(), np.linalg.norm(traction + [q, 0, 0], axis=1).max() / q)
                self.row(f'{name}, pressure and traction', worst, 0, 1e-8)
        pressure, traction, q = self.sheared('quad4', 2, 3, 'surface', False)
        self.assertGreater(abs(traction[:, 0] / q + 1).max(), 0.01)


BOUND = {'cylinders': 0.005, 'axisymmetric spheres': 0.008, 'spheres': 0.02}

if __name__ == '__main__':
    unittest.main()
