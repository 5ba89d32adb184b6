"""Springs, forces on points and lines, gravity, rotation and the reactions to them, against closed forms: at full order, in models, over a history."""
import csv
import itertools
import os
import sys
import unittest

import numpy as np

from common import SOURCE, Case

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import GMSH, Grid  # noqa: E402

FACES = {f'{axis}{end}': f'{axis}{end}' for axis in 'xyz' for end in '01'}
KINDS = {'line2': 1, 'quad4': 2, 'tri3': 2, 'hex8': 3, 'tet4': 3}
COUNT = 'scene: {mesh: mesh.msh%s}\n'


def column(kind, height=2.0, n=4, points=(), lines=(), shift=0.0):
    """A bar of unit section along the last axis, body `block`; points and lines: {name: where(x)}."""
    dim = KINDS[kind]
    grid = Grid()
    axes = [np.linspace(0, 1, 3)] * (dim - 1) + [np.linspace(0, height, n + 1)]
    grid.box(kind, axes, lambda x: x + shift, 'block', {f: g for f, g in FACES.items() if f[0] in 'xyz'[:dim]})
    at = np.array(grid.nodes)
    for name, where in dict(points).items():
        for i in np.flatnonzero(where(at)):
            grid.elements.append((GMSH['point'], grid._tag(name, 0), [int(i) + 1]))
    for name, where in dict(lines).items():
        nodes = np.flatnonzero(where(at))
        nodes = nodes[np.lexsort(at[nodes].T)]
        for a, b in zip(nodes, nodes[1:]):
            grid.elements.append((GMSH['line2'], grid._tag(name, 1), [int(a) + 1, int(b) + 1]))
    return grid


class Loads(Case):
    def written(self, text, grid=None, folder='s'):
        os.makedirs(self.path(folder), exist_ok=True)
        if grid:
            grid.write(self.path(folder, 'mesh.msh'))
        with open(self.path(folder, 'scene.yaml'), 'w', encoding='utf-8') as f:
            f.write(text)
        return self.path(folder)

    def balanced(self, report):
        self.assertLess(report['balance'], 1e-9)
        self.assertLess(report['energy_defect'], 1e-9)
        self.assertTrue(report['converged'])

    def test_foundation(self):
        """A bar pressed on an elastic foundation: the foundation gives by p/k, the bar by p h/E besides."""
        E, k, p, h = 200, 30, 1.5, 2
        for kind, dim in KINDS.items():
            axis = 'xyz'[dim - 1]
            sides = ''.join(f'fixed: {{{", ".join(f"{c}0: {{{c}: 0}}" for c in "xyz"[:dim - 1])}}}\n') if dim > 1 else ''
            for spring, ranks in ((f'{axis}: {k}', 0), (f'normal: {k}', 2)):
                text = COUNT % '' + f'body: {{block: {{young: {E}}}}}\n{sides}pressure: {{{axis}1: {p}}}\nspring: {{{axis}0: {{{spring}}}}}\n'
                with self.subTest(kind=kind, spring=spring):
                    found = self.hyco('solve', '-scene', self.written(text, column(kind)), ranks=ranks)
                    self.balanced(found)
                    self.near(found['u_max'][-1], -p / k, 1e-9, 'foundation')
                    self.near(found['u_min'][-1], -p / k - p * h / E, 1e-9, 'top')
                    self.near(found['springs'][f'{axis}0']['force'][-1], p, 1e-9, 'reaction')
                    self.near(found['loads']['force'][-1], -p, 1e-9, 'load')
                    self.near(found['strain_energy'], p * p / k / 2 + p * p * h / E / 2, 1e-9, 'energy')

    def test_revolution(self):
        """The same of a cylinder of revolution, radius 1: forces of the full circle; a point is a circle."""
        E, k, p, h = 200, 30, 1.5, 2
        grid = column('quad4', points={'rim': lambda x: (x[:, 0] == 1) & (x[:, 1] == 2)})
        text = COUNT % ', formulation: axisymmetric' + f'body: {{block: {{young: {E}}}}}\npressure: {{y1: {p}}}\nspring: {{y0: {{y: {k}}}}}\n'
        found = self.hyco('solve', '-scene', self.written(text, grid))
        self.balanced(found)
        self.near(found['u_min'][1], -p / k - p * h / E, 1e-9)
        self.near(found['springs']['y0']['force'][1], np.pi * p, 1e-9)
        text = COUNT % ', formulation: axisymmetric' + f'body: {{block: {{young: {E}}}}}\nforce: {{rim: {{y: -7}}}}\nspring: {{y0: {{y: {k}}}}}\n'
        self.near(self.hyco('solve', '-scene', self.written(text))['springs']['y0']['force'][1], 7, 1e-9)

    def test_points_and_lines(self):
        """Forces and moments of supports by statics, on 1 and 3 ranks; springs at points beside them."""
        corner = {'corner': lambda x: (x[:, :2] == 1).all(axis=1) & (x[:, 2] == x[:, 2].max())}
        for kind, ranks in itertools.product(('hex8', 'tet4'), (0, 3)):
            edge = {'edge': lambda x: (x[:, 0] == 1) & (x[:, 1] == 0)}
            text = COUNT % '' + ('body: {block: {young: 200, poisson: 0.3}}\nfixed: {z0: {x: 0, y: 0, z: 0}}\nforce: {corner: {x: 3, z: -2}, '
                                 'edge: {y: 5*z}}\nspring: {corner: {y: 40}}\n')
            found = self.hyco('solve', '-scene', self.written(text, column(kind, points=corner, lines=edge)), ranks=ranks)
            with self.subTest(kind=kind, ranks=ranks):
                self.balanced(found)
                load = np.array([3, 10, -2])  # the integral of 5 z over the edge
                moment = np.cross([1, 1, 2], [3, 0, -2]) + [-5 * 8 / 3, 0, 10]
                pull = np.array(found['springs']['corner']['force'])
                np.testing.assert_allclose(found['loads']['force'], load, rtol=1e-9, atol=1e-9)
                np.testing.assert_allclose(found['loads']['moment'], moment, rtol=1e-9, atol=1e-9)
                np.testing.assert_allclose(np.array(found['supports']['z0']['force']) + pull, -load, rtol=1e-8, atol=1e-8)
                total = np.array(found['supports']['z0']['moment']) + found['springs']['corner']['moment']
                np.testing.assert_allclose(total, -moment, rtol=1e-7, atol=1e-7)
                self.near(np.hypot(pull[0], pull[2]), 0, 1e-12)
                self.assertLess(pull[1], 0)  # it is pushed along y

    def test_ranks(self):
        """Springs are the only supports of a body whose nodes have random numbers: forces, energy and the identity of energies are the same on
        1 to 4 ranks. In the second scene a side with springs is also displaced, so that the springs take part in the lifting."""
        for kind, refine in (('quad4', 0), ('tri3', 1), ('hex8', 0), ('tet4', 0)):
            axes = 'xyz'[:KINDS[kind]]
            grid = column(kind, n=6, points={'corner': lambda x: (x == x.max(axis=0)).all(axis=1)})
            place = np.random.default_rng(3).permutation(len(grid.nodes))
            grid.nodes = [grid.nodes[i] for i in place]
            number = np.argsort(place) + 1
            grid.elements = [(of, tag, [int(number[n - 1]) for n in nodes]) for of, tag, nodes in grid.elements]
            springs = ', '.join(f'{c}{end}: {{normal: {20 + i}, x: {3 + end}}}' for i, c in enumerate(axes) for end in (0, 1))
            for fixed in ('', f'fixed: {{x1: {{{axes[-1]}: 0.02}}, corner: {{x: 0.01}}}}\n'):
                text = (f'scene: {{mesh: mesh.msh, refine: {refine}}}\nbody: {{block: {{young: 200, poisson: 0.3}}}}\n{fixed}'
                        f'spring: {{{springs}, corner: {{x: 7, y: 2}}}}\npressure: {{{axes[-1]}1: 1.5*(1 + x)}}\n')
                scene = self.written(text, grid)
                alone = self.hyco('solve', '-scene', scene)
                for ranks in (0, 2, 3, 4):
                    with self.subTest(kind=kind, fixed=fixed, ranks=ranks):
                        found = self.hyco('solve', '-scene', scene, ranks=ranks) if ranks else alone
                        self.balanced(found)
                        self.near(found['strain_energy'], alone['strain_energy'], 1e-9)
                        size = np.abs(alone['loads']['force']).max()
                        for name, spring in alone['springs'].items():
                            for of, value in spring.items():
                                np.testing.assert_allclose(found['springs'][name][of], value, rtol=1e-9, atol=1e-9 * size)

    def test_point_in_1d(self):
        """A bar held by a spring at its middle, pulled at its end."""
        grid = column('line2', points={'middle': lambda x: x[:, 0] == 1, 'end': lambda x: x[:, 0] == 2})
        text = COUNT % '' + 'body: {block: {young: 200}}\nforce: {end: {x: 4}}\nspring: {middle: {x: 10}}\n'
        for ranks in (0, 2):
            found = self.hyco('solve', '-scene', self.written(text, grid), ranks=ranks)
            self.balanced(found)
            self.near(found['u_min'][0], 0.4, 1e-12)
            self.near(found['u_max'][0], 0.4 + 4 / 200, 1e-12)

    def test_gravity(self):
        """A standing column under its own weight: rho g h^2 / 2E at the top; the support carries the weight."""
        E, rho, g, h = 200, 0.7, 9.81, 2
        for kind, dim in KINDS.items():
            axis = 'xyz'[dim - 1]
            fixed = ', '.join(f'{c}0: {{{c}: 0}}' for c in 'xyz'[:dim])
            text = COUNT % '' + f'body: {{block: {{young: {E}, density: {rho}}}}}\nfixed: {{{fixed}}}\ngravity: {{{axis}: -{g}}}\n'
            found = self.hyco('solve', '-scene', self.written(text, column(kind)), ranks=2 * (dim > 1))
            with self.subTest(kind=kind):
                self.balanced(found)
                self.near(found['supports'][f'{axis}0']['force'][-1], rho * g * h, 1e-9)
                if kind not in ('tri3', 'tet4'):  # whose nodes share a cell's weight unevenly
                    self.near(found['u_min'][-1], -rho * g * h * h / 2 / E, 1e-9)

    def test_rotation(self):
        """A rod about its end; a disk about its axis; a block about an axis beside it."""
        E, rho, w, h = 200, 0.7, 3, 2
        text = COUNT % '' + f'body: {{block: {{young: {E}, density: {rho}}}}}\nfixed: {{x0: {{x: 0}}}}\nrotation: {{speed: {w}}}\n'
        found = self.hyco('solve', '-scene', self.written(text, column('line2')))
        self.balanced(found)
        self.near(found['u_max'][0], rho * w * w * h**3 / 3 / E, 1e-9)
        text = COUNT % ', formulation: axisymmetric' + f'body: {{block: {{young: {E}, density: {rho}}}}}\nfixed: {{y0: {{y: 0}}}}\nrotation: {{speed: {w}}}\n'
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 1, 41), [0, 0.025]], lambda x: x, 'block', {'y0': 'y0'})
        self.near(self.hyco('solve', '-scene', self.written(text, grid))['u_max'][0], rho * w * w / 4 / E, 1e-3)
        text = COUNT % '' + (f'body: {{block: {{young: {E}, poisson: 0.3, density: {rho}}}}}\nfixed: {{z0: {{x: 0, y: 0, z: 0}}}}\n'
                             f'rotation: {{speed: {w}, axis: {{z: 2}}, through: {{x: -3}}}}\n')
        for ranks in (0, 2):
            found = self.hyco('solve', '-scene', self.written(text, column('hex8')), ranks=ranks)
            self.balanced(found)
            np.testing.assert_allclose(found['supports']['z0']['force'], [-rho * h * w * w * 3.5, -rho * h * w * w * 0.5, 0], rtol=1e-9, atol=1e-9)

    CONTACT = """
scene: {mesh: mesh.msh, parameters: [bed, push]}
parameter: {bed: {range: [20, 60]}, push: {range: [0.1, 0.4]}}
body: {block: {young: 200, poisson: 0.3, density: 0.01}, seat: {young: 300, poisson: 0.3}}
gravity: {y: -10*push}
fixed: {side: {x: 0}}
spring: {base: {normal: bed*(1 + x), x: 5}, top: {y: 2}}
pressure: {top: push*(1 + x)}
contact: {joint: {type: pair, slave: under, master: over, tolerance: 1e-6}}
output: {wall: {reaction: x, group: side}, low: {min: u_y}}
"""

    @classmethod
    def pair(cls):
        grid = Grid()
        x = np.linspace(0, 1, 7)
        grid.box('quad4', [x, np.linspace(0, 1, 5)], lambda p: p, 'seat', {'y0': 'base', 'y1': 'over', 'x0': 'side'})
        grid.box('quad4', [x, np.linspace(1, 2, 5)], lambda p: p, 'block', {'y0': 'under', 'y1': 'top', 'x0': 'side'})
        return grid

    def test_models(self):
        """Contact on a foundation whose stiffness is a parameter: every type of model, and its reactions."""
        scene = self.written(self.CONTACT, self.pair())
        for kind, bound in (('hybrid', 0.02), ('projection', 0.01), ('bodies', 5e-3)):
            with self.subTest(kind=kind):
                self.hyco('train', '-scene', scene, '-grid', '5,4', '-grid_type', 'centred', '-model', 'm.h5', '-hyco_model_type', kind, '-hyco_pod_tol', 1e-11,
                          *(('-hyco_rid_layers', 1, '-hyco_rid_modes', 'displacement,stress,force,dual') if kind == 'hybrid' else ()))
                found = self.hyco('compare', '-scene', scene, '-model', 'm.h5', '-grid', '3,4')
                self.assertLess(found['error_u']['max'], bound)
                for ranks in (0, 2):
                    full = self.hyco('solve', '-scene', scene, '-mu', '33,0.27', ranks=ranks)
                    self.balanced(full)
                    self.near(full['outputs']['wall'], full['supports']['side']['force'][0], 1e-9)
                model = self.hyco('predict', '-model', 'm.h5', '-mu', '33,0.27')
                size = 0.27  # of the push; what the wall takes is little
                self.assertLess(abs(model['outputs']['wall'] - full['outputs']['wall']), 5 * bound * size)
                self.near(model['outputs']['low'], full['outputs']['low'], bound)
        self.hyco('predict', '-model', 'm.h5', '-grid', '2,2', '-table', 't.csv')
        with open(self.path('t.csv'), encoding='utf-8') as f:
            self.assertIn('wall', next(csv.reader(f)))

    def test_history(self):
        """A bar on a foundation, loaded in time, that yields at half the load; the model's path and its reaction."""
        text = """
scene: {mesh: mesh.msh, parameters: [bed]}
parameter: {bed: {range: [20, 60]}}
body: {block: {law: j2, young: 200, poisson: 0.3, yield: 1, hardening: 20, density: 0.1}}
fixed: {x0: {x: 0}}
spring: {y0: {y: bed, x: 30}}
gravity: {y: -t}
pressure: {y1: 1.5*t}
history: {times: [0, 0.5, 1]}
output: {wall: {reaction: x}, low: {min: u_y}}
"""
        scene = self.written(text, column('quad4'))
        for ranks in (0, 2):
            found = self.hyco('solve', '-scene', scene, '-mu', '40', ranks=ranks)
            self.assertLess(found['balance'], 1e-9)
            self.assertLess(max(found['history']['energy_defect']), 1e-8)
            self.assertGreater(found['history']['inelastic'][-1], 1e-4)
            self.near(found['springs']['y0']['force'][1], 1.5 + 0.2, 1e-9)
            self.near(found['u_max'][1], -1.7 / 40, 0.05)
            self.near(found['supports']['x0']['force'][0], -found['springs']['y0']['force'][0], 1e-8)
        for model_type in ('projection', 'cubature'):  # whose cells with springs are once in the sum
            self.hyco('train', '-scene', scene, '-grid', '4', '-model', 'm.h5', '-hyco_model_type', model_type, '-hyco_pod_tol', 1e-10)
            model = self.hyco('predict', '-model', 'm.h5', '-mu', '40')
            self.near(model['outputs']['low'], found['outputs']['low'], 0.01)
            self.assertLess(abs(model['outputs']['wall'] - found['outputs']['wall']), 0.02)

    def test_linear_history(self):
        """A linear bar on a foundation beside one that creeps, loaded in time: springs count once in the model's path."""
        text = """
scene: {mesh: mesh.msh, parameters: [bed]}
parameter: {bed: {range: [20, 60]}}
body: {seat: {young: 200, poisson: 0.3}, block: {law: norton, young: 200, poisson: 0.3, rate: 1e-2, exponent: 3}}
fixed: {side: {x: 0}}
spring: {base: {y: bed}, top: {y: 5}}
pressure: {top: 1.5*t}
history: {times: [0, 0.5, 1]}
contact: {joint: {type: pair, slave: under, master: over, tolerance: 1e-6}}
output: {low: {min: u_y}, wall: {reaction: x}}
"""
        scene = self.written(text, self.pair())
        full = self.hyco('solve', '-scene', scene, '-mu', '40')
        self.assertLess(full['balance'], 1e-9)
        self.assertLess(max(full['history']['energy_defect']), 1e-8)
        self.near(full['springs']['base']['force'][1] + full['springs']['top']['force'][1], 1.5, 1e-8)
        for kind in ('projection', 'hybrid'):
            self.hyco('train', '-scene', scene, '-grid', '4', '-model', 'linear.h5', '-hyco_model_type', kind, '-hyco_pod_tol', 1e-10,
                      *(('-hyco_rid_whole', 'true') if kind == 'hybrid' else ('-hyco_dual', 'snapshots')))
            model = self.hyco('predict', '-model', 'linear.h5', '-mu', '40')
            self.near(model['outputs']['low'], full['outputs']['low'], 0.005, kind)
            self.assertLess(abs(model['outputs']['wall'] - full['outputs']['wall']), 0.02)

    def test_refused(self):
        """Springs, forces and gravity on wrong groups or components are refused."""
        base = 'body: {block: {young: 200}}\nfixed: {x0: {x: 0, y: 0}}\n'
        grid = column('quad4', points={'corner': lambda x: (x[:, 0] == 1) & (x[:, 1] == 2)})
        for text, said in (('spring: {y0: {y: -1}}', "spring_y0_y is -1"), ('spring: {corner: {normal: 1}}', 'has no normal'),
                           ('spring: {block: {x: 1}}', 'a group of points or of dimension 1'), ('spring: {y0: {z: 1}}', 'no component z'),
                           ('spring: {y0: {stiff: 1}}', 'x, y, z, normal'), ('spring: {y9: {y: 1}}', 'no group "y9"'),
                           ('force: {y1: {y: 1}}', 'write traction: y1'), ('force: {nothing: {y: 1}}', 'no group "nothing"'),
                           ('gravity: {y: -1}', 'no body has one'), ('gravity: {z: -1}\nbody_block_density: 1', 'no component z'),
                           ('gravity: {down: 1}', 'gravity: {x: ...'), ('rotation: {axis: {z: 1}}\nbody_block_density: 1', 'rotation: {speed'),
                           ('rotation: {speed: 1, axis: {x: 1}}\nbody_block_density: 1', 'the axis is given in 3D only'),
                           ('gravity: {y: -1}\nbody_block_density: -1', 'a density must be 0 or more'), ('gravity: {y: -y}\nbody_block_density: 1', 'must be constant in space'),
                           ('spring: {y0: {y: 1 + t}}\nhistory: {times: [0, 1]}', 'the stiffness of a spring must be constant in time'),
                           ('output: {pull: {reaction: w}}', 'one of x, y and z'), ('output: {pull: {reaction: y, group: corner}}', 'no support fixes y on corner')):
            for ranks in (0, 2):
                run = self.run_raw('solve', '-scene', self.written(COUNT % '' + base + text + '\n', grid), ranks=ranks)
                with self.subTest(text=text, ranks=ranks):
                    self.assertEqual(run.returncode, 1, run.stdout)
                    self.assertEqual(run.stderr.count('hyco: error'), 1, run.stderr)
                    self.assertIn(said, run.stderr)


    def test_refined(self):
        """A group of facets between cells is refused when the mesh is refined, also if an output alone names it."""
        grid = column('quad4')
        middle = [i + 1 for i, x in enumerate(grid.nodes) if x[1] == 1]
        for a, b in zip(middle, middle[1:]):
            grid.elements.append((GMSH['line2'], grid._tag('middle', 1), [a, b]))
        base = 'body: {block: {young: 200}}\nfixed: {y0: {x: 0, y: 0}}\n'
        text = COUNT % '' + base + 'traction: {y1: {y: 1}}\noutput: {sink: {max: u_y, group: middle}}\n'
        for ranks in (0, 2):
            run = self.run_raw('solve', '-scene', self.written(text, grid), '-scene_refine', '1', ranks=ranks)
            with self.subTest(ranks=ranks):
                self.assertEqual(run.returncode, 1, run.stdout)
                self.assertIn('the group middle has lines in 3D or facets between two cells', run.stderr)

if __name__ == '__main__':
    unittest.main()
