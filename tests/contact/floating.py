"""Floating bodies, and unconstrained bodies: K is singular, the contact problem of the former is not."""
import csv
import json
import os
import subprocess
import sys
import unittest

import h5py
import numpy as np

from common import PATIENCE, PELLET, SOURCE, Case

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import Grid  # noqa: E402

BLOCK = """
scene: {title: block on a foundation, mesh: %s, parameters: [crown, press]}
parameter: {crown: {range: [0, 0.08]}, press: {range: [-100, 400]}}
body:
  block: {young: 2e5, poisson: 0.3, map: {y: "y + crown*(x/20)^2*(1 - y/16)"}}
  foundation: {young: 1e5, poisson: 0.3}
fixed: {block_sym: {x: 0}, foundation_sym: {x: 0}, foundation_base: {y: 0}}
pressure: {block_top: press}
contact: {under: {%s}}
"""
PAIR = 'type: pair, slave: block_under, master: foundation_top, tolerance: 1e-3'
OBSTACLE = 'type: obstacle, group: foundation_sym, normal: {x: -1}, gap: 1'
WIDTH = 20


class Block(Case):
    """Its top has a load instead of a prescribed displacement: only the foundation supports it."""

    @classmethod
    def scene(cls, contact):
        mesh = os.path.join(SOURCE, 'examples', 'blocks', 'blocks.msh')
        path = cls.path('scene.yaml')
        with open(path, 'w', encoding='ascii') as file:
            file.write(BLOCK % (mesh, contact))
        return path

    def test_pressed(self):
        """The contact has the whole load, its vertical part exactly."""
        for ranks in (1, 2):
            for form in ('dual', 'primal'):
                with self.subTest(ranks=ranks, form=form):
                    r = self.hyco('solve', '-scene', self.scene(PAIR), '-mu', '0.04,100', '-output', 'b.xdmf',
                                  '-hyco_solver_form', form, ranks=ranks)
                    self.solved(r)
                    with h5py.File(self.path('b.h5')) as f:
                        force = f['nodes/contact_force'][:]
                    self.near(abs(force[force[:, 1] > 0, 1].sum()), WIDTH * 100, 1e-10)

    def test_all_closed(self):
        """Without a crown every pair closes: the sum of the forces is the load."""
        r = self.hyco('solve', '-scene', self.scene(PAIR), '-mu', '0,100')
        self.assertEqual(r['n_active'], r['n_contacts'])
        self.near(r['total_contact_force'], WIDTH * 100, 1e-10)

    def test_taken_away(self):
        """A load that lifts a floating body is refused, and no file is left; check names the corner of the ranges."""
        run = self.run_raw('solve', '-scene', self.scene(PAIR), '-mu', '0.04,-1', '-output', 'no.xdmf')
        self.assertEqual(run.returncode, 1)
        self.assertIn('a body is held by contact only, and this load lifts it off; no support keeps body block from moving '
                      'along (0, 1, 0)', run.stderr)
        self.assertFalse(os.path.exists(self.path('no.h5')))
        for ranks in (0, 2):  # check says so without a solve
            found = self.hyco('check', '-scene', self.scene(PAIR), ranks=ranks)
            self.assertEqual((found['n_lifted'], len([w for w in found['warnings'] if 'solve fails at 2 of the 5 points assembled, the first at crown = 0, '
                             'press = -100: no equilibrium: a body is held by contact only, and this load lifts it off; no support keeps body block' in w])), (2, 1))

    def test_other_types(self):
        """Every method solves for a body that contact alone holds: the active set's contacts, and forces to 1e-9; a type of TAO's names what lifts the body off."""
        args = ('solve', '-scene', self.scene(PAIR), '-hyco_solver_fallback', 'false')
        expected = self.hyco(*args, '-mu', '0.04,100')
        for tao in (None, 'gpcg', 'tron', 'bntr', 'bnls', 'blmvm', 'bqnkls', 'bncg', 'bqpip', 'ssils'):
            for kind in ('tao',) if tao else ('lemke', 'semismooth'):
                with self.subTest(kind=kind, tao=tao):
                    r = self.hyco(*args, '-mu', '0.04,100', '-hyco_solver_type', kind, *(('-hyco_tao_type', tao) if tao else ()))
                    self.assertIn(tao or kind, r['solver'])
                    self.assertEqual(r['n_active'], expected['n_active'])
                    self.near(r['total_contact_force'], expected['total_contact_force'], 1e-9)
        self.assertIn('lifts it off', self.run_raw(*args, '-mu', '0.04,-1', '-hyco_solver_type', 'tao').stderr)

    def test_held_by_nothing(self):
        """A body with neither support nor contact is named."""
        for ranks in (1, 2):
            run = self.run_raw('solve', '-scene', self.scene(OBSTACLE), '-mu', '0.04,100', ranks=ranks)
            self.assertNotEqual(run.returncode, 0)
            self.assertIn('no support and no contact keeps body block from moving along (0, 1, 0)', run.stderr)


class Overhang(Case):
    """A block on a foundation twice as wide; the nodes of the foundation beside the block face nothing."""

    def test_half_faces(self):
        """The contact has the load by each form; on a side of the block it is pushed down a slope of one in one, and stays."""
        grid, axis = Grid(), np.linspace(0, 1, 7)
        grid.box('quad4', [2 * np.linspace(0, 1, 13), axis - 1], lambda x: x, 'base', {'y1': 'seat', 'y0': 'ground'})
        grid.box('quad4', [axis, axis], lambda x: x, 'block', {'y0': 'under', 'y1': 'top', 'x0': 'sym'})
        scene = ('scene: {mesh: mesh.msh, parameters: [load]}\nparameter: {load: {range: [0, 9]}}\nbody: {base: {young: 1000}, block: {young: 1000}}\n'
                 'fixed: {ground: {x: 0, y: 0}, sym: {x: 0}}\npressure: {top: load}\ncontact: {c: {type: surface, slave: seat, master: under, tolerance: 2}}\n')
        self.written(scene, grid)
        for more in ((), ('-hyco_solver_form', 'dual'), ('-hyco_solver_form', 'primal')):
            for ranks in (0, 2):
                found = self.hyco('solve', '-scene', 'scene.yaml', '-mu', 6, *more, ranks=ranks)
                self.solved(found)
                self.assertLess(found['n_facing'], found['n_contacts'])
                self.near(found['contacts']['c']['force'][1], -6, 1e-9)

    def test_unloaded(self):
        """A block without a load carries no force: it stays as drawn, or moves by what it overlaps; said in one line; no gradient, which would be that of nothing.
        So in a set and in a model. A row of a point without a solution has no numbers."""
        grid, axis = Grid(), np.linspace(0, 1, 7)
        grid.box('quad4', [2 * np.linspace(0, 1, 13), axis - 1], lambda x: x, 'base', {'y1': 'seat', 'y0': 'ground'})
        grid.box('quad4', [axis + 0.5, axis], lambda x: x, 'block', {'y0': 'under', 'y1': 'top'})
        self.written('scene: {mesh: mesh.msh, parameters: [load, soft]}\nparameter: {load: {range: [0, 9]}, soft: {range: [0.5, 2]}}\n'
                     'body: {base: {young: 1000*soft}, block: {young: 1000}}\nfixed: {ground: {x: 0, y: 0}, top: {x: 0}}\npressure: {top: load}\n'
                     'contact: {c: {type: surface, slave: under, master: seat, gap: "0.003*(x - 1) + GAP"}}\noutput: {rise: {max: u_y, group: block}}\n', grid)
        with open(self.path('scene.yaml'), encoding='ascii') as file:
            text = file.read()
        for gap, rise in ((0.01, 0), (-0.02, 0.0215)):
            self.written(text.replace('GAP', str(gap)))
            run = self.run_raw('solve', '-scene', 'scene.yaml', '-mu', '0,1', '-report', self.path('r.json'))
            self.assertEqual((run.returncode, run.stdout.count('no contact force keeps body block from moving along (0, 1, 0)')), (0, 1), run.stdout + run.stderr)
            with open(self.path('r.json'), encoding='utf-8') as file:
                report = json.load(file)
            self.assertEqual((report['total_contact_force'], report['n_active']), (0, 0))
            self.assertAlmostEqual(report['outputs']['rise'], rise, 12)
            run = self.run_raw('solve', '-scene', 'scene.yaml', '-mu', '0,1', '-gradient')
            self.assertEqual((run.returncode, run.stderr.count('\n')), (1, 1))
            self.assertIn('no load presses a body here', run.stderr)
            if gap > 0:  # two motions, as many contacts as forces that are told from none: no derivative, or the right one
                slope = [self.hyco('solve', '-scene', 'scene.yaml', '-mu', f'{load},1', '-gradient')['gradient']['rise']['load'] for load in (1e-8, 1e-3)]
                self.near(slope[0], slope[1], 1e-6)
        self.hyco('train', '-scene', 'scene.yaml', '-grid', '2,2', '-model', self.path('m.h5'), '-hyco_model_type', 'bodies')
        for command in (('solve', '-scene', 'scene.yaml'), ('predict', '-model', 'm.h5')):
            run = self.run_raw(*command, '-values_load', '0,6', '-values_soft', 1.5, '-table', self.path('t.csv'))
            self.assertEqual(run.returncode, 0, run.stderr)
            self.assertEqual(run.stdout.count('warning: at 1 of 2 points no contact force keeps a body'), command[0] == 'solve', run.stdout)
            rows = np.genfromtxt(self.path('t.csv'), delimiter=',', names=True)
            self.assertEqual(rows['total_contact_force'][0], 0)
            self.near(rows['total_contact_force'][1], 6, 1e-6)
            self.near(rows['rise'][0], 0.0215, 1e-9)
        run = self.run_raw('solve', '-scene', 'scene.yaml', '-values_load', '6,-6', '-parameter_load_range', '-9,9', '-values_soft', 1.5, '-table', self.path('t.csv'))
        self.assertEqual(run.returncode, 1)
        rows = np.genfromtxt(self.path('t.csv'), delimiter=',', names=True)
        self.assertEqual(rows['converged'].tolist(), [1, 0])
        for name in rows.dtype.names:
            self.assertEqual(bool(np.isnan(rows[name][1])), name not in ('load', 'soft', 'kkt_max', 'converged', 'iterations', 'seconds'), name)
        run = self.run_raw('predict', '-model', 'm.h5', '-mu', '-6,1', '-extrapolate')
        self.assertEqual(run.returncode, 1)
        self.assertIn('this load lifts it off; no support keeps body block from moving along (0, 1, 0)', run.stderr)
        # a fit that begins at the load 0 goes on from there
        full = self.hyco('solve', '-scene', 'scene.yaml', '-mu', '0.01,1')
        fit = self.hyco('fit', '-model', 'm.h5', '-target_rise', repr(full['outputs']['rise']), '-hold_soft', 1, '-mu_load', 0)
        self.near(fit['mu']['load'], 0.01, 1e-4)

    def test_tiny_loads(self):
        """A plug in a turned V groove under pressures on its sides that balance themselves and a load on top that is 1e-12 to 1e-3 of them, in all points of sets of
        models, without friction and with it along a path: a solution everywhere, and forces that balance the load; a position that no
        force determines is named and not compared."""
        grid, sides = Grid(), np.linspace(-1, 1, 9)
        turn = lambda x, y: 0.37 * np.stack([np.cos(0.3) * x - np.sin(0.3) * y, np.sin(0.3) * x + np.cos(0.3) * y], -1)
        grid.box('quad4', [sides, np.append(np.linspace(0, 1, 9), [1.3, 1.6])], lambda p: turn(p[:, 0] * np.minimum(6 + 10 * p[:, 1], 16), 6 + 10 * p[:, 1]), 'plug',
                 {'x0': ('left', 8), 'x1': ('right', 8), 'y1': 'top'})
        for side in (1, 89):  # the first nodes of the plug's sides; above the flanks
            grid._cells(('line2', ((0, 1),)), side + np.arange(8, 11), grid._tag('sides', 1))
        grid.box('quad4', [np.linspace(-1, 1, 25), np.linspace(0, 1, 4)], lambda p: turn(22 * p[:, 0], -8 + p[:, 1] * (8 + 22 * abs(p[:, 0]))), 'groove',
                 {'y1': 'wall', 'y0': 'base'})
        scene = """
scene: {mesh: mesh.msh, parameters: [press, squeeze, soft]}
parameter: {press: {range: [0, 50]}, squeeze: {range: [-40, 40]}, soft: {range: [0.5, 2]}}
body: {plug: {young: 2.1e5}, groove: {young: 1e5*soft, poisson: 0.33}}
fixed: {base: {x: 0, y: 0}}
pressure: {top: press*a, sides: squeeze*b}
contact: {l: {type: surface, slave: left, master: wall, tolerance: 1, friction: mu}, r: {type: surface, slave: right, master: wall, tolerance: 1, friction: mu}}
output: {rise: {mean: u_y, group: top}}
history: {times: [0, 1, 2, 3, 4, 5], tables: {a: [[0, 0], [1, 1], [3, 1], [4, 0], [5, 0.5]], b: [[0, 0], [2, 1], [3, -1], [5, 1]]}}
"""
        self.written(scene.replace('soft]', 'mu]').replace('soft: {range: [0.5, 2]}', 'mu: {range: [0, 0.4]}').replace('*soft', ''), grid)
        with open(self.path('smooth.yaml'), 'w', encoding='ascii') as file:
            file.write(scene[:scene.index('history')].replace(', friction: mu', '').replace('*a', '').replace('*b', ''))
        for name, number, more in (('smooth', 6, ('-values_press', '1e-11,1e-10,1e-9,1e-8,1e-7,1e-3', '-values_soft', '0.5,0.6,0.7,0.83,1,1.2,1.4,1.7,2')),
                                   ('scene', 8, ('-values_press', '1e-8,1e-7,1e-5,1e-4,1e-3,1', '-values_mu', '0,0.05,0.2,0.4'))):
            self.hyco('train', '-scene', f'{name}.yaml', '-scatter', number, '-model', self.path(f'{name}.h5'), '-hyco_model_type', 'bodies')
            run = self.run_raw('predict', '-model', f'{name}.h5', *more, '-values_squeeze', '-40,-21,-13.7,-3,0.1,7.3,17,40', '-table', self.path('t.csv'))
            self.assertEqual(run.returncode, 0, run.stderr)
            if name == 'smooth':
                rows = np.genfromtxt(self.path('t.csv'), delimiter=',', names=True)
                clear = rows['press'] > 5e-10
                np.testing.assert_allclose(rows['total_contact_force'][clear], 32 * 0.37 * np.sqrt(2) * rows['press'][clear], rtol=1e-3)
        # without a force, or with too few of them, displacements are arbitrary: they are not compared
        report = self.hyco('compare', '-scene', 'scene.yaml', '-model', 'scene.h5', '-values_press', '0,20', '-values_squeeze', -40, '-values_mu', 0)
        self.assertEqual(report['estimates']['position_arbitrary'], 1)
        self.assertLess(report['worst_u']['max'], 1e-6)
        self.assertLess(report['worst_output_rise']['max'], 1e-8)
        report = self.hyco('predict', '-model', 'scene.h5', '-mu', '0,-40,0')
        self.assertEqual((report['position_arbitrary'], report['estimated_error_u']), (True, None))

    def test_balanced(self):
        """Loads that are in equilibrium with themselves press no body, in all points of a set and in a model: no forces, no contact closed, the body stays. A ring
        between two plates under pressure inside; a block in a corner, pushed along one side of it only: its forces and the load agree."""
        grid = Grid()
        for name, y0, y1 in (('low', -1, 0), ('ring', 0, 1), ('high', 1.05, 2)):
            radius = np.linspace(2, 3, 6) if name == 'ring' else np.linspace(1.8, 3.3, 9)
            grid.box('quad4', [radius, np.linspace(y0, y1, 5)], lambda x: x, name, {side: f'{name}_{side}' for side in ('x0', 'y0', 'y1')})
        self.written("""
scene: {mesh: mesh.msh, formulation: axisymmetric, parameters: [down, p, soft]}
parameter: {down: {range: [0, 0.08]}, p: {range: [0, 3]}, soft: {range: [0, 4]}}
body: {low: {young: 2e5}, high: {young: 2e5}, ring: {young: "10^(soft + 1)", poisson: "0.3 + 0.049*soft", element: bbar}}
fixed: {low_y0: {x: 0, y: 0}, high_y1: {x: 0, y: -down}}
pressure: {ring_x0: p}
contact: {under: {type: mortar, slave: ring_y0, master: low_y1}, over: {type: surface, slave: ring_y1, master: high_y0, tolerance: 0.2}}
output: {force: {force: y, contact: over}, height: {mean: u_y, group: ring}}
""", grid)
        points = ('-values_down', '0,0.021,0.03,0.06', '-values_p', '0,0.7,3', '-values_soft', '0,1.3,4', '-table', self.path('t.csv'))
        self.hyco('train', '-scene', 'scene.yaml', '-grid', '3,2,4', '-model', self.path('m.h5'), '-hyco_model_type', 'bodies', status=None)
        heights = []
        for command in (('solve', '-scene', 'scene.yaml'), ('predict', '-model', 'm.h5')):
            self.assertEqual(self.run_raw(*command, *points).returncode, 0)
            rows = np.genfromtxt(self.path('t.csv'), delimiter=',', names=True)
            free = rows['down'] < 0.05
            self.assertEqual(rows['converged'].min(), 1)
            self.assertEqual((np.abs(rows['force'][free]).max(), rows['n_active'][free].max()), (0, 0))
            self.assertGreater(np.abs(rows['force'][~free & (rows['p'] == 0)]).min(), 1e-3)
            heights.append(rows['height'][free])
        np.testing.assert_allclose(*heights, rtol=0, atol=1e-6)

        grid = Grid()
        grid.box('quad4', [np.linspace(0, 3, 7), np.linspace(0, 2, 5)], lambda x: x, 'block', {'x0': 'left', 'y0': 'under', 'x1': 'right', 'y1': 'top'})
        grid.box('quad4', [np.linspace(-1, 4, 9), np.linspace(-1, 0, 3)], lambda x: x, 'floor', {'y1': 'seat', 'y0': 'ground'})
        grid.box('quad4', [np.linspace(-1, 0, 3), np.linspace(0, 2.5, 6)], lambda x: x, 'wall', {'x1': 'face', 'x0': 'back'})
        self.written("""
scene: {mesh: mesh.msh, parameters: [px, py, gap]}
parameter: {px: {range: [0, 20]}, py: {range: [0, 20]}, gap: {range: [-0.01, 0.02]}}
body: {block: {young: 1e5, map: {x: x + gap}}, floor: {young: 300}, wall: {young: 300}}
fixed: {ground: {x: 0, y: 0}, back: {x: 0, y: 0}}
pressure: {right: px, top: py}
contact: {side: {type: mortar, slave: left, master: face}, floor: {type: surface, slave: under, master: seat}}
output: {fx: {force: x, contact: side}, fy: {force: y, contact: floor}}
""", grid)
        self.hyco('train', '-scene', 'scene.yaml', '-grid', '3,3,3', '-model', self.path('m.h5'), '-hyco_model_type', 'bodies')
        points = ('-values_px', '0,7', '-values_py', '1,20', '-values_gap', '0.003,0.02', '-table', self.path('t.csv'))
        for command in (('solve', '-scene', 'scene.yaml'), ('predict', '-model', 'm.h5')):
            self.assertEqual(self.run_raw(*command, *points).returncode, 0)
            rows = np.genfromtxt(self.path('t.csv'), delimiter=',', names=True)
            np.testing.assert_allclose(rows['fx'], 2 * rows['px'], rtol=0, atol=1e-6)
            np.testing.assert_allclose(rows['fy'], 3 * rows['py'], rtol=0, atol=1e-6)
        for px in (0, 7):  # along the floor nothing holds it without px
            run = self.run_raw('predict', '-model', 'm.h5', '-mu', f'{px},20,0.003', '-report', self.path('r.json'))
            with open(self.path('r.json'), encoding='utf-8') as file:
                report = json.load(file)
            self.assertEqual((report['position_arbitrary'], report['estimated_error_u'] is None, 'position is arbitrary' in run.stdout), 3 * (px == 0,))

    def test_place(self):
        """Where contact forces are unique, but a body's place is not, it has no derivative: at full order and in a model the line names the body."""
        grid, axis = Grid(), np.linspace(0, 1, 3)
        wedge = lambda x: np.c_[(x[:, 0] - 0.5) * (1 + 0.5 * x[:, 1]), x[:, 1]]  # whose upper corners touch a groove: it may turn about the point that both push to
        grid.box('quad4', [axis, axis], wedge, 'block', {'x0': 'left', 'x1': 'right', 'y1': 'top'})
        self.written('scene: {mesh: mesh.msh, parameters: [px, py]}\nparameter: {px: {range: [0, 3]}, py: {range: [5, 20]}}\nbody: {block: {young: 1e5}}\n'
                     'traction: {top: {x: px, y: -py}}\ncontact: {l: {type: obstacle, group: left, normal: {x: -1, y: -0.5}, gap: 0.05*(1 - y)}, '
                     'r: {type: obstacle, group: right, normal: {x: 1, y: -0.5}, gap: 0.05*(1 - y)}}\noutput: {fx: {force: x, contact: l}}\n', grid)
        self.hyco('train', '-scene', 'scene.yaml', '-scatter', 4, '-model', self.path('m.h5'), '-hyco_model_type', 'bodies', status=None)
        for command in (('solve', '-scene', 'scene.yaml'), ('predict', '-model', 'm.h5')):
            self.assertEqual(self.run_raw(*command, '-mu', '2,9', '-gradient').returncode, 0)
            run = self.run_raw(*command, '-mu', '0,9', '-gradient')
            self.assertEqual(run.returncode, 1)
            self.assertRegex(run.stderr, '^hyco: error: no contact force keeps body block .*: its position is arbitrary here, and has no derivative')

    def test_barely_held(self):
        """A block on a seat that a wall holds by a billionth of the load: equilibrium gives the derivatives of the forces, also with the wall at a node without a
        flexibility of its own; without that force there is none."""
        grid, axis = Grid(), np.linspace(0, 1, 5)
        grid.box('quad4', [3.1 * axis, 2.3 * axis], lambda x: x, 'block', {'x0': 'left', 'x1': 'right', 'y0': 'low', 'y1': 'top'})
        grid.box('quad4', [np.linspace(-1.3, 4.3, 8), np.linspace(-0.5, 0, 3)], lambda x: x, 'seat', {'y0': 'base', 'y1': 'floor'})
        self.written('scene: {mesh: mesh.msh, parameters: [px, py]}\nparameter: {px: {range: [0, 3]}, py: {range: [5, 20]}}\nbody: {block: {young: 1e3, poisson: 0.3}, seat: {young: 2e3, poisson: 0.3}}\n'
                     'fixed: {base: {x: 0, y: 0}}\ntraction: {top: {y: -py}, right: {x: -px}}\ncontact: {l: {type: obstacle, group: left, normal: {x: -1}, gap: 0}, '
                     'f: {type: surface, slave: low, master: floor}}\noutput: {W: {force: x, contact: l}, N: {force: y, contact: f}}\n', grid)
        self.hyco('train', '-scene', 'scene.yaml', '-scatter', 4, '-model', 'barely.h5', '-hyco_model_type', 'bodies', status=None)
        for command in (('solve', '-scene', 'scene.yaml'), ('predict', '-model', 'barely.h5')):
            for px in ('1e-8', '1e-4', '1'):
                slope = self.hyco(*command, '-mu', f'{px},9', '-gradient')['gradient']
                for output, p, expected in (('W', 'px', 2.3), ('W', 'py', 0), ('N', 'px', 0), ('N', 'py', 3.1)):
                    self.assertAlmostEqual(slope[output][p], expected, 6, (command[0], px, output, p))
            self.assertRegex(self.run_raw(*command, '-mu', '0,9', '-gradient').stderr, '^hyco: error: no contact force keeps body block ')

    def test_travels(self):
        """A block that contact alone holds at places far apart: as a set each is the single solution, and `check` accepts the range."""
        grid, axis = Grid(), np.linspace(0, 1, 5)
        grid.box('quad4', [np.linspace(-6, 7, 53), axis - 1], lambda x: x, 'rail', {'y1': 'seat', 'y0': 'ground'})
        grid.box('quad4', [axis, axis], lambda x: x, 'block', {'y0': 'under', 'y1': 'top'})
        self.written('scene: {mesh: mesh.msh, parameters: [place, load]}\nparameter: {place: {range: [-5, 5]}, load: {range: [1, 9]}}\n'
                     'body: {rail: {young: 1000}, block: {young: 1000, map: {x: x + place}}}\nfixed: {ground: {x: 0, y: 0}, top: {x: 0}}\n'
                     'pressure: {top: load}\ncontact: {c: {type: surface, slave: seat, master: under, tolerance: 1}}\noutput: {sink: {mean: u_y, group: top}}\n', grid)
        self.hyco('check', '-scene', 'scene.yaml')
        single = [self.hyco('solve', '-scene', 'scene.yaml', '-mu', f'{place},6')['outputs']['sink'] for place in (-5, 4.7)]
        for ranks in (0, 2):
            for form in ('dual', 'primal'):
                self.hyco('solve', '-scene', 'scene.yaml', '-values_place', '-5,4.7', '-values_load', 6, '-table', 't.csv', '-hyco_solver_form', form, ranks=ranks)
                with open(self.path('t.csv'), encoding='ascii') as file:
                    rows = list(csv.DictReader(file))
                for row, sink in zip(rows, single):
                    self.near(float(row['total_contact_force']), 6, 1e-8)
                    self.near(float(row['sink']), sink, 1e-6)

    def test_free_in_a_gap(self):
        """A block pressed on a table between two walls that it does not touch: it stays where it is drawn, and the table has the load."""
        grid, axis = Grid(), np.linspace(0, 1, 5)
        grid.box('quad4', [axis, axis], lambda x: x, 'block', {'y0': 'under', 'y1': 'top', 'x0': 'left', 'x1': 'right'})
        scene = ('scene: {mesh: mesh.msh, parameters: [side]}\nparameter: {side: {range: [-9, 9]}}\nbody: {block: {young: 1000, poisson: 0}}\n'
                 'pressure: {top: 6}\ntraction: {top: {x: side}}\ncontact:\n  table: {type: obstacle, group: under, normal: {y: -1}, gap: 0}\n'
                 '  left: {type: obstacle, group: left, normal: {x: -1}, gap: 0.1}\n  right: {type: obstacle, group: right, normal: {x: 1}, gap: 0.1}\n'
                 'output: {u: {mean: u_x, group: block}, push: {force: x, contact: right}}\n')
        self.written(scene, grid)
        for side, push in ((0, 0), (1, -1)):
            found = self.hyco('solve', '-scene', 'scene.yaml', '-mu', side)
            self.solved(found)
            self.near(found['contacts']['table']['force'][1], 6, 1e-9)
            self.assertAlmostEqual(found['outputs']['push'], push, 8)
            self.assertLess(abs(found['outputs']['u'] - 0.1 * side), 0.01)
        run = self.run_raw('solve', '-scene', 'scene.yaml', '-mu', 0, '-hyco_solver_form', 'primal', '-hyco_solver_fallback', 'false')
        self.assertEqual((run.returncode, run.stderr.count('hyco: error')), (1, 1), run.stdout + run.stderr)
        self.assertIn('contact forces can balance this load', run.stderr)  # not: lifts it off


class Units(Case):
    """A column under its weight: rho g h^2 / (2 E) is the displacement of its top."""

    def test_displacements(self):
        """Displacements of a body under its weight do not depend on the units."""
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 1, 3), np.linspace(0, 4, 9)], lambda x: x, 'column', {'y0': 'base', 'y1': 'top'})
        self.written('scene: {mesh: mesh.msh, parameters: [rho]}\nparameter: {rho: {range: [0, 1e12]}}\nbody: {column: {young: 100, poisson: 0, density: rho}}\n'
                     'fixed: {base: {x: 0, y: 0}}\ngravity: {y: -10}\noutput: {u: {mean: u_y, group: top}}\n', grid)
        for rho, says in ((1, ''), (100, 'warning: displacements of 2.0e+01 times the extent of the mesh')):
            run = self.run_raw('solve', '-scene', 'scene.yaml', '-mu', rho)
            self.assertEqual(run.returncode, 0, run.stderr)
            self.assertIn(says, run.stdout)
            self.assertEqual(run.stdout.count('warning'), int(bool(says)))
            self.near(self.hyco('solve', '-scene', 'scene.yaml', '-mu', rho)['outputs']['u'], -rho * 10 * 4**2 / 2 / 100, 1e-9)
        run = self.run_raw('solve', '-scene', 'scene.yaml', '-mu', 1e9)  # 2e8 times
        self.assertEqual((run.returncode, run.stderr.count('hyco: error')), (1, 1), run.stderr)
        self.assertIn("(2.0e+08 times the mesh's extent)", run.stderr)


class Pellet(Case):
    """The pellet without its z-symmetry condition, on a table instead; its cladding keeps the condition."""

    def test_table(self):
        """The pellet on a table, held by contact alone."""
        geo, mesh = self.path('table.geo'), self.path('table.msh')
        with open(os.path.join(PELLET, 'pellet.geo'), encoding='ascii') as file:
            text = file.read()
        with open(geo, 'w', encoding='ascii') as file:
            file.write(text + '\nPhysical Surface("pellet_z0", 31) = {1,2,3};\nPhysical Surface("clad_z0", 32) = {4,5};\n')
        settings = [w for pair in (('m', 4), ('nr', 4), ('nc', 2), ('nzl', 6), ('nzh', 14)) for w in
                    ('-setnumber', pair[0], str(pair[1]))]
        subprocess.run(['gmsh', '-3', geo, *settings, '-format', 'msh41', '-o', mesh, '-v', '1'], check=True, timeout=60 * PATIENCE)
        with open(os.path.join(PELLET, 'scene.yaml'), encoding='ascii') as file:
            scene = file.read().replace('mesh: A.msh', f'mesh: {mesh}').replace('sym_z0: {z: 0}', 'clad_z0: {z: 0}')
        scene = scene.replace('contact:\n', 'contact:\n  table: {type: obstacle, group: pellet_z0, normal: {z: -1}, gap: 0}\n')
        # a node is the slave of one contact: the pellet's lower edge is the table's, so the cladding is the pair's
        scene = scene.replace('slave: contact_pellet', 'slave: contact_clad', 1).replace('master: contact_clad', 'master: contact_pellet', 1)
        scene = scene.replace('normal: {x: x, y: y}', 'normal: {x: -x, y: -y}')
        path = self.path('table.yaml')
        with open(path, 'w', encoding='ascii') as file:
            file.write(scene)
        supported = self.hyco('solve', '-scene', PELLET, '-mu', '4.06,1')
        for ranks in (1, 2):
            r = self.hyco('solve', '-scene', path, '-mu', '4.06,1', '-output', 't.xdmf', ranks=ranks)
            self.solved(r)
            self.assertIn('held by contact', r['solver'])
            with h5py.File(self.path('t.h5')) as f:
                force, x = f['nodes/contact_force'][:], f['mesh/xyz'][:]
            table = np.isclose(x[:, 2], 0) & (force[:, 2] > 0)
            self.near(force[table, 2].sum(), 64.316, 1e-5)  # the weight of the pressures, computed independently
            gap = r['total_contact_force'] - force[table, 2].sum()
            self.near(gap, supported['total_contact_force'], 0.05)  # the table may open where the plane would pull


if __name__ == '__main__':
    unittest.main()
