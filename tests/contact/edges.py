"""Slave groups that go round an edge: the whole skin of a body is, as a slave, the part of it that faces the master; a block in a corner has a contact on each side."""
import os
import sys
import unittest

import numpy as np

from common import SOURCE, Case

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import Grid, second  # noqa: E402

COLUMNS = """
scene: {mesh: mesh.msh%s}
body: {low: {young: 1000}, up: {young: 700}}
fixed: {low_y0: {%s}, hold: {%s}}
pressure: {up_y1: 1}
contact: {c: {type: %s, slave: skin, master: low_y1, tolerance: 0.05%s}}
output: {along: {force: x, contact: c}, peak: {max: contact_pressure, contact: c}, touch: {area: closed, contact: c}, low: {min: sigma_yy, group: up}, high: {max: sigma_yy, group: up}}
"""


class Edges(Case):
    def columns(self, kind, n, m, skin=True):
        """A column on another, of n and m cells along them; with `skin` the whole boundary of the upper one, else its underside, is the group skin."""
        dim = 3 if kind in ('hex8', 'tet4') else 2
        grid, names = Grid(), [f'{a}{e}' for a in 'xyz'[:dim] for e in '01']
        for body, cells, y in (('low', m, 0), ('up', n, 1)):
            axes = [np.linspace(0, 1, cells + 1)] * dim
            faces = {name: f'{body}_{name}' for name in names}
            start = len(grid.elements)
            grid.box(kind, axes, lambda x, y=y: x + np.eye(dim)[1] * y, body, faces)
            tags = {grid._tag(f'{body}_{name}', dim - 1) for name in (names if skin else ['y0'])}
            if body == 'up':
                grid.elements += [(t, grid._tag('skin', dim - 1), e) for t, tag, e in grid.elements[start:] if tag in tags]
                hold = [f'up_{a}0' for a in 'xyz'[:dim] if a != 'y']
        grid.write(self.path('mesh.msh'))
        return dim, hold

    def test_patch(self):
        """A uniform pressure on a column of Poisson's ratio 0 whose whole boundary is the slave: uniform stress and contact pressure, the area of the underside, no force along x."""
        for kind, type_, n, m, ranks, more in (('quad4', 'mortar', 3, 4, 0, ''), ('quad4', 'mortar', 3, 4, 3, ''), ('tri3', 'mortar', 4, 3, 0, ''), ('quad4', 'surface', 3, 3, 2, ''),
                                               ('hex8', 'mortar', 3, 2, 2, ''), ('tet4', 'pair', 2, 2, 0, ''), ('quad4', 'pair', 3, 3, 0, ', normal: {y: -1}')):
            dim, hold = self.columns(kind, n, m)
            fixed = ', '.join(f'{a}: 0' for a in 'xyz'[:dim])
            text = COLUMNS % ('', fixed, 'x: 0', type_, more)
            text = text.replace('hold: {x: 0}', ', '.join(f'{h}: {{{h[3]}: 0}}' for h in hold))
            with self.subTest(kind=kind, type=type_, ranks=ranks):
                found = self.hyco('solve', '-scene', self.written(text), ranks=ranks)
                self.solved(found)
                self.assertEqual(found['n_contacts'], (n + 1)**(dim - 1))
                for name, value in {'along': 0, 'peak': 1, 'touch': 1, 'low': -1, 'high': -1}.items():
                    self.assertAlmostEqual(found['outputs'][name], value, delta=1e-9, msg=name)

    def test_overhang(self):
        """A slave twice as wide as its master, plain or with the rest of its body: a block of Poisson's ratio 0 under a uniform pressure has a uniform contact pressure, on an area of its own; also with cells of second order, in 3D, of a pair, on ranks."""
        for kind, type_, skin, ranks in (('quad4', 'surface', False, 0), ('quad4', 'surface', True, 0), ('quad4', 'mortar', False, 2), ('quad8', 'mortar', False, 0), ('quad8', 'mortar', True, 3), ('hex8', 'surface', False, 2), ('tet4', 'mortar', False, 0), ('quad4', 'pair', True, 0)):
            dim, grid = 3 if kind in ('hex8', 'tet4') else 2, Grid()
            half = 2 if dim == 3 else 3
            for body, cells, y in (('base', 2 * half, -1), ('block', half, 0)):
                axis, wide = np.linspace(0, 1, half + 1), np.linspace(0, cells / half, cells + 1)
                start = len(grid.elements)
                grid.box({'quad8': 'quad4'}.get(kind, kind), [wide, axis, *[axis] * (dim - 2)], lambda x, y=y: x + np.eye(dim)[1] * y, body, {f'{a}{e}': f'{body}_{a}{e}' for a in 'xyz'[:dim] for e in '01'})
                if body == 'base':
                    tags = {grid._tag(f'base_{a}{e}', dim - 1) for a in 'xyz'[:dim] for e in '01' if skin or f'{a}{e}' == 'y1'}
                    grid.elements += [(t, grid._tag('slave', dim - 1), e) for t, tag, e in grid.elements[start:] if tag in tags]
            mesh = grid if kind != 'quad8' else second(grid, kind)
            text = ('scene: {mesh: mesh.msh}\nbody: {base: {young: 1000}, block: {young: 700}}\nfixed: {base: {%s}, block_x0: {x: 0}%s}\npressure: {block_y1: 1}\n'
                    'contact: {c: {type: %s, slave: slave, master: block_y0, tolerance: 0.05}}\n'
                    'output: {peak: {max: contact_pressure, contact: c}, touch: {area: closed, contact: c}, f: {force: y, contact: c}, low: {min: sigma_yy, group: block}}\n'
                    % (', '.join(f'{a}: 0' for a in 'xyz'[:dim]), ', block_z0: {z: 0}' if dim == 3 else '', type_))
            with self.subTest(kind=kind, type=type_, skin=skin, ranks=ranks):
                found = self.hyco('solve', '-scene', self.written(text, mesh), ranks=ranks)
                for name, value in {'peak': 1, 'touch': 1, 'f': -1, 'low': -1}.items():  # the force over the area is the largest pressure
                    self.assertAlmostEqual(found['outputs'][name], value, delta=1e-9, msg=name)

    def test_normal(self):
        """A given normal that points into the slave's body, or along its surface, is refused by contact and group by check, solve and train, on each rank count, for every type; as an obstacle's too."""
        self.columns('quad4', 3, 3)
        text = COLUMNS % (', parameters: [load]', 'x: 0, y: 0', 'x: 0', '%s', ', normal: {%s}') + 'parameter: {load: {range: [1, 2]}}\n'
        text = text.replace('hold: {x: 0}', 'up_x0: {x: 0}').replace('up_y1: 1', 'up_y1: load')
        at = ('-mu', 1)
        for type_, normal, command, ranks in (('mortar', 'y: 1', 'solve', 0), ('surface', 'x: 1', 'solve', 2), ('pair', 'y: 1, x: 0.1', 'check', 0), ('pair', 'y: 1', 'train', 0), ('obstacle', 'y: 1', 'solve', 2),
                                              ('obstacle', 'y: load', 'check', 0)):
            scene = text % (type_, normal)
            if type_ == 'obstacle':
                scene = scene.replace('slave: skin, master: low_y1, tolerance: 0.05', 'group: up_y0, gap: 0')
            more = {'solve': at, 'check': (), 'train': ('-grid', 2, '-model', 'm.h5')}[command]
            run = self.run_raw(command, '-scene', self.written(scene), *more, ranks=ranks)
            with self.subTest(type=type_, normal=normal, command=command, ranks=ranks):
                self.assertEqual((run.returncode, run.stderr.count('hyco: error')), (1, 1), run.stdout + run.stderr)
                for word in ('contact c', 'normal', 'up_y0' if type_ == 'obstacle' else 'skin'):
                    self.assertIn(word, run.stderr)

    def test_corner(self):
        """A block whose skin is the slave in a corner of floor and wall, which are one master: uniform stresses and both pressures, each with its area; a model of bodies repeats them, and where the block is drawn away from the corner and moved into it."""
        grid, sides = Grid(), ['x0', 'x1', 'y0', 'y1']
        for body, x, y in (('floor', 0, -1), ('wall', -1, 0), ('block', 0, 0)):
            start = len(grid.elements)
            grid.box('quad4', [np.linspace(0, 1, 4)] * 2, lambda at, x=x, y=y: at + (x, y), body, {s: f'{body}_{s}' for s in sides})
            own = {'floor': ['y1'], 'wall': ['x1'], 'block': sides}[body]
            tags = {grid._tag(f'{body}_{s}', 1) for s in own}
            grid.elements += [(t, grid._tag('skin' if body == 'block' else 'corner', 1), e) for t, tag, e in grid.elements[start:] if tag in tags]
        grid.write(self.path('mesh.msh'))
        for type_, ranks, away in (('surface', 2, 0), ('mortar', 0, 0), ('pair', 0, 0), ('surface', 0, 0.5), ('mortar', 3, 0.5)):
            text = ('scene: {mesh: mesh.msh, parameters: [load, away]}\nparameter: {load: {range: [1, 3]}, away: {range: [0.5, 0.51]}}\nbody: {floor: {young: 1000}, wall: {young: 1000}, block: {young: 1000%s}}\n'
                    'fixed: {floor_y0: {x: 0, y: 0}, wall_x0: {x: 0, y: 0}}\npressure: {block_y1: 1, block_x1: load}\ncontact: {c: {type: %s, slave: skin, master: corner}}\n'
                    'output: {fx: {force: x, contact: c}, fy: {force: y, contact: c}, touch: {area: closed, contact: c}, peak: {max: contact_pressure, contact: c}, low: {min: sigma_xx, group: block}, high: {max: sigma_xx, group: block}}\n'
                    % (', map: {x: "x + away - 0.5", y: "y + away - 0.5"}' if away else '', type_))
            with self.subTest(type=type_, ranks=ranks, away=away):
                scene = self.written(text)
                found = [self.hyco('solve', '-scene', scene, '-mu', '2,0.5', ranks=ranks)['outputs']]
                if not ranks and type_ != 'pair':
                    model = self.path(f'{type_}{away}.h5')
                    self.hyco('train', '-scene', scene, '-grid', '2,3', '-model', model, '-hyco_model_type', 'bodies')
                    found.append(self.hyco('predict', '-model', model, '-mu', '2,0.5')['outputs'])
                for outputs in found:
                    for key, value in {'fx': 2, 'fy': 1, 'touch': 2, 'peak': 2, 'low': -2, 'high': -2}.items():
                        self.assertAlmostEqual(outputs[key], value, delta=1e-9, msg=key)


if __name__ == '__main__':
    unittest.main()
