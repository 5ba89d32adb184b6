"""Scenes with friction: every type of contact, bodies that friction alone holds, creep, several ranks, interrupted runs, mu = 0, refusals.
Closed forms are in tests/verify/friction.py, random scenes in friction_random.py."""
import csv
import json
import os
import shutil
import signal
import subprocess
import sys
import unittest

import h5py
import numpy as np

from common import HYCO, PATIENCE, SOURCE, Case

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import Grid  # noqa: E402

PAD = """
scene: {mesh: mesh.msh}
body: {pad: {LAW}}
fixed: {top: {x: "0.01*s", y: "-0.004*min(t, 1)"}}
contact: {floor: {group: base, normal: {y: -1}, gap: "0.0005*x", friction: "MU"}}
history: {times: [0, 1, 2, 3], tables: {s: [[0, 0], [1, 0], [2, 1], [3, -1]]}}
output: {T: {friction: x, contact: floor}, N: {force: y}, W: {friction: work}}
"""
ELASTIC = 'young: 1000, poisson: 0.3'
NORTON = 'law: norton, young: 1000, poisson: 0.3, rate: 1e-3, exponent: 2'
TWO = """
scene: {mesh: mesh.msh}
body: {low: {young: 1000, poisson: 0.3}, high: {young: 500, poisson: 0.2}}
fixed: {base: {x: 0, y: 0, z: 0}, top: {x: "0.02*max(t - 1, 0)", y: "0.01*max(t - 1, 0)", z: "-0.01*min(t, 1)"}}
contact: {joint: {CONTACT, friction: "0.1 + 0.1*x"}}
history: {times: [0, 1, 2]}
output: {T: {friction: x, contact: joint}, Y: {friction: y, contact: joint}, N: {force: z, contact: joint}}
"""
SLOPE = """
scene: {mesh: mesh.msh}
body: {block: {young: 1e4, poisson: 0.3}}
force: {block: {x: 0, y: "-t"}}
contact: {plane: {group: base, normal: {x: "sin(0.3)", y: "-cos(0.3)"}, gap: 0, friction: "MU"}}
history: {times: [0, 1, 2]}
output: {N: {force: y, contact: plane}, T: {friction: x, contact: plane}}
"""
SPRUNG = """
scene: {mesh: mesh.msh, parameters: [k]}
parameter: {k: {range: [0, 10]}}
body: {block: {young: 7e4, poisson: 0.33}}
pressure: {top: 10*bolt}
traction: {end: {x: 2*mill, y: mill}}
spring: {end: {x: k, y: k}}
contact: {floor: {type: obstacle, group: base, normal: {z: -1}, gap: 0, friction: 0.3}}
history: {times: [0, 0.5, 1, 1.5, 2], tables: {bolt: [[0, 0], [1, 1]], mill: [[1, 0], [2, 1]]}}
output: {N: {force: z, contact: floor}, T: {friction: x, contact: floor}, move: {mean: u_x, group: end}}
"""
WIDENS = """
scene: {mesh: mesh.msh, parameters: [p]}
parameter: {p: {range: [5, 10]}}
body: {block: {young: 1000, poisson: 0.3}}
pressure: {top: p*t}
contact: {floor: {type: obstacle, group: base, normal: {y: -1}, gap: 0, friction: 0.1}}
history: {times: [0, 1, 2]}
output: {move: {mean: u_x, group: top}, N: {force: y, contact: floor}}
"""
UNLOADED = """
scene: {mesh: mesh.msh}
body: {block: {young: 1e4, poisson: 0.3}}
traction: {top: {x: "h", y: "-v"}}
contact: {plane: {group: base, normal: {y: -1}, gap: "GAP", friction: 0.5}}
history: {times: [0, 1, 2, 3, 4, 5], tables: {v: [[0, 0], [1, 2], [2, 2], [3, 1], [4, 0], [5, 2]], h: [[1, 0], [2, 0.2], [3, -0.1], [4, 0]]}}
output: {N: {force: y, contact: plane}, T: {friction: x, contact: plane}}
"""
RELEASED = """
scene: {mesh: mesh.msh}
body: {block: {young: 1000, poisson: 0.3}, lid: {young: 2000, poisson: 0.3}}
fixed: {top: {x: "0.2*max(min(t - 1, 1), 0)", y: "-0.01*p"}}
contact: {floor: {group: base, normal: {y: -1}, gap: 0, friction: 0.2}, cover: {type: surface, slave: back, master: under, friction: 0.4}}
history: {times: [0, 1, 2, 3], tables: {p: [[0, 0], [1, 1], [2, 1], [3, 0]]}}
output: {along: {mean: u_x, group: block}, up: {mean: u_y, group: block}}
"""
RIDER = """
scene: {mesh: mesh.msh, parameters: [mu]}
parameter: {mu: {range: [0, 0.5]}}
body: {block: {young: 1000, poisson: 0.3}, lid: {young: 2000, poisson: 0.3}}
fixed: {base: {x: "0.2*max(min(t - 1, 1), 0)", y: 0}}
pressure: {top: "10*min(t, 1)"}
contact: {cover: {type: surface, slave: back, master: under, friction: mu}}
history: {times: [0, 1, 2, 3]}
output: {along: {mean: u_x, group: lid}}
"""
RING = """
scene: {mesh: mesh.msh, formulation: axisymmetric}
body: {ring: {young: 1000, poisson: 0.3}}
fixed: {end: {y: "0.05*max(t - 1, 0)"}}
contact: {bore: {group: outside, normal: {x: 1}, gap: "-0.01*min(t, 1)", friction: 0.25}}
history: {times: [0, 1, 2]}
output: {T: {friction: y, contact: bore}, R: {reaction: y, group: end}}
"""
SHRUNK = """
scene: {mesh: mesh.msh, formulation: axisymmetric, parameters: [outer]}
parameter: {outer: {range: [14, 20]}}
body: {shaft: {young: 1e5, poisson: 0.3}, ring: {young: 1e5, poisson: 0.3, map: {x: "10 + (x - 10)*(outer - 10)/6"}}}
fixed: {base: {y: 0}}
contact: {fit: {type: pair, slave: bore, master: side, friction: MU, normal: {x: -1}, gap: "-0.0125*t"}}
history: {times: [0, 1]}
output: {N: {max: contact_pressure, contact: fit}}
"""
TURNS = """
scene: {mesh: mesh.msh, parameters: [s]}
parameter: {s: {range: [0, 0.04]}}
body: {block: {young: 1000, poisson: 0.3}}
fixed: {end: {x: "0.1*max(t - 1, 0)"}}
pressure: {top: "10*min(t, 1)"}
traction: {top: {y: "s*max(t - 1, 0)"}}
contact: {floor: {type: obstacle, group: base, normal: {z: -1}, gap: 0, friction: 0.3}}
history: {times: [0, 1, 2]}
output: {move: {mean: u_y, group: top}}
"""
RIGID = """
scene: {mesh: mesh.msh}
body: {block: {young: 1000, poisson: 0.3}, tool: {young: 1}}
fixed: {base: {x: 0, y: 0}, tool: {x: "0.1*max(t - 1, 0)"}}
force: {tip: {y: "-10*min(t, 1)"}}
contact: {punch: {type: rigid, slave: top, master: tip, gap: 0.01*x^2, friction: 0.3}}
history: {times: [0, 1, 2]}
output: {T: {friction: x, contact: punch}, N: {force: y, contact: punch}}
"""


DRAWN = """
scene: {mesh: mesh.msh, parameters: [cut]}
parameter: {cut: {range: [1, 8]}}
body: {block: {young: 1000, poisson: 0.3}}
pressure: {top: "10*min(t, 1)"}
traction: {end: {x: "cut*max(t - 1, 0)"}}
contact: {floor: {type: obstacle, group: base, normal: {y: -1}, gap: 0, friction: 0.3}}
history: {times: [0, 0.5, 1, 1.5, 2]}
output: {T: {friction: x, contact: floor}}
"""


class Friction(Case):
    def pad(self, name='scene.yaml', law=ELASTIC, mu='0.3', more='', **changes):
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 2, 13), np.linspace(0, 1, 7)], lambda x: x, 'pad', {'y0': 'base', 'y1': 'top'})
        grid.write(self.path('mesh.msh'))
        return self.changed(name, PAD.replace('LAW', law).replace('MU', mu) + more, changes.values())

    def rows(self, scene, *args, **options):
        """The columns of the listed times and the outputs, a dictionary for each; residuals, energies and reactions are checked."""
        report = self.hyco('solve', '-scene', scene, *args, **options)
        history = report['history']
        columns = {**{k: v for k, v in history.items() if isinstance(v, list)}, **history['outputs']}
        rows = [dict(zip(columns, values)) for values in zip(*columns.values())]
        self.assertLess(max(row['kkt_max'] for row in rows), 1e-8)
        self.assertLess(max(row['energy_defect'] for row in rows), 1e-8)
        self.assertLess(report['balance'], 1e-8)
        return rows

    def test_types(self):
        """In 3D, pairs and surfaces that do not match: at every node the traction is mu p against the motion; the coefficient changes in space."""
        for contact, n in (('type: pair, slave: face, master: back', 5), ('type: surface, slave: face, master: back', 4)):
            grid = Grid()
            flat = [np.linspace(0, 1, 5)] * 2
            grid.box('hex8', [*flat, np.linspace(0, 0.5, 3)], lambda x: x, 'low', {'z0': 'base', 'z1': 'back'})
            grid.box('hex8', [np.linspace(0, 1, n)] * 2 + [np.linspace(0.5, 1, 3)], lambda x: x, 'high', {'z0': 'face', 'z1': 'top'})
            grid.write(self.path('mesh.msh'))
            rows = self.rows(self.changed('scene.yaml', TWO.replace('CONTACT', contact), ()), '-output', self.path('out.xdmf'))
            self.assertEqual(rows[2]['n_slipping'], rows[2]['n_active'])
            self.assertLess(rows[2]['T'], -0.09 * abs(rows[2]['N']))
            self.assertLess(rows[2]['Y'], -0.04 * abs(rows[2]['N']))
            with h5py.File(self.path('out.h5')) as file:
                step, x = file['step-0002/nodes'], file['mesh/xyz'][:, 0]
                p, t = step['contact_pressure'][:, 0], step['contact_traction'][:]
            self.assertLess(abs(np.linalg.norm(t, axis=1) - (0.1 + 0.1 * x) * p).max(), 1e-9 * p.max())

    def test_rigid(self):
        """A rigid body that a force presses on a block and that is drawn along it: T = mu N, and the force of its support balances it."""
        grid = Grid()
        grid.box('quad4', [np.linspace(-1, 1, 9), np.linspace(-1, 0, 5)], lambda x: x, 'block', {'y0': 'base', 'y1': 'top'})
        grid.tool('quad4', [np.array([1.5, 1.6]), np.array([0, 0.1])])
        grid.write(self.path('mesh.msh'))
        last = self.rows(self.changed('scene.yaml', RIGID, ()))[2]
        self.near(last['N'], -10, 1e-9)
        self.near(last['T'], 3, 1e-9)

    def test_held(self):
        """A block on a slope, which friction alone holds: it sticks if mu is above the slope, and is refused by name if it is not."""
        turn = np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]])
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 2, 9), np.linspace(0, 1, 5)], lambda x: x @ turn, 'block', {'y0': 'base'})
        grid.write(self.path('mesh.msh'))
        rows = self.rows(self.changed('scene.yaml', SLOPE.replace('MU', '0.5'), ()))
        self.near(rows[2]['N'], 4, 1e-8)
        run = self.run_raw('solve', '-scene', self.changed('scene.yaml', SLOPE.replace('MU', '0.25'), ()))
        self.assertEqual(run.returncode, 1)
        self.assertIn('with this friction', run.stderr)
        self.assertIn('body block from moving along (0.96, 0.3, 0)', run.stderr)  # the slope

    def test_soft_springs(self):
        """A block on springs down to 1e-13 of its stiffness, pressed and drawn: the path ends where it does without them."""
        grid = Grid()
        grid.box('hex8', [np.linspace(0, 30, 2), np.linspace(0, 20, 2), np.linspace(0, 10, 2)], lambda x: x, 'block', {'z0': 'base', 'z1': 'top', 'x1': 'end'})
        self.written(SPRUNG, grid)
        free = self.hyco('solve', '-scene', 'scene.yaml', '-mu', '0')['outputs']
        for k in ('1e-8', '1e-6', '1e-5', '1e-4', '1e-2'):
            found = self.hyco('solve', '-scene', 'scene.yaml', '-mu', k)
            self.assertTrue(found['converged'])
            self.assertLess(max(found['history']['kkt_max']), 1e-10, k)
            for name, value in free.items():
                self.near(found['outputs'][name], value, 1e-4, name)

    def test_slides_away(self):
        """A block that is drawn away beyond cut = 6: training leaves these points out, held-out ones too, and says point, time, body and direction, on any
        number of ranks; a second run finds them in the folder; more than half are refused. What full order spends before it gives up is bounded."""
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 2, 5), np.linspace(0, 1, 3)], lambda x: x, 'block', {'y0': 'base', 'y1': 'top', 'x1': 'end'})
        self.written(DRAWN, grid)
        with open(self.path('held.csv'), 'w', encoding='ascii') as f:
            f.write('cut\n' + ''.join(f'{1.4 + 0.3 * k}\n' for k in range(12)) + '7.5\n')
        train = ('train', '-scene', 'scene.yaml', '-hyco_model_type', 'bodies', '-hyco_validation', '12', '-validation_points', 'held.csv', '-model')
        for ranks in (0, 2, 0):
            if ranks:
                shutil.rmtree(self.path('m.h5.snapshots'))
            found = self.hyco(*train, 'm.h5', '-grid', '5', '-hyco_groups', max(1, ranks), ranks=ranks)
            self.assertEqual((found['n_samples'], found['n_left_out'], found['held_out']['n']), (3, 3, 12))
            for part in ('cut = 6.25', 't = 1.96', 'block', '(1, 0, 0)'):
                self.assertIn(part, found['no_equilibrium'])
            self.assertLess(found['held_out']['lambda']['largest'], 1e-9)
        self.assertEqual(sum(found['solved_by_group']), 0)
        run = self.run_raw(*train, 'n.h5', '-values_cut', '5,7,8', '-hyco_snapshots', 'half')
        self.assertEqual((run.returncode, run.stderr.count('hyco: error')), (1, 1))
        self.assertIn('2 of 3', run.stderr)
        for args in (('solve', '-scene', 'scene.yaml'), ('predict', '-model', 'm.h5', '-extrapolate')):
            run = self.run_raw(*args, '-mu', '8')
            self.assertIn('t = 1.75: no equilibrium', run.stderr)
        self.run_raw('solve', '-scene', 'scene.yaml', '-mu', '8', '-table', 'end.csv')
        with open(self.path('end.csv'), encoding='utf-8') as f:
            end = list(csv.DictReader(f))[-1]
        self.assertLess(int(end['iterations']), 40)
        self.assertLess(int(end['active_set_iterations']), 1000)
        # Sets: a point that reaches no listed time has a row of NaN, and compare takes the times that both reach.
        self.run_raw('solve', '-scene', 'scene.yaml', '-values_cut', '5,7', '-history_times', '2,2.1', '-pressure_top', '10', '-table', 'set.csv')
        self.run_raw('compare', '-scene', 'scene.yaml', '-model', 'm.h5', '-values_cut', '5,8', '-extrapolate', '-table', 'both.csv')
        with open(self.path('set.csv'), encoding='utf-8') as f:
            self.assertEqual([(row['converged'], row['T'] == 'nan') for row in csv.DictReader(f)], [('1', False), ('0', True)])
        with open(self.path('both.csv'), encoding='utf-8') as f:
            self.assertEqual([(row['converged'], float(row['worst_lambda']) < 1e-9) for row in csv.DictReader(f)], [('1', True), ('0', True)])

    def test_arbitrary(self):
        """A block all of whose contacts slip as it widens: body, direction and times of the motion that none holds, alike from full order and a model;
        displacements are not compared: NaN in tables, null in reports."""
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 1, 2)] * 2, lambda x: x, 'block', {'y0': 'base', 'y1': 'top'})
        self.written(WIDENS, grid)
        lines = []
        for args in (('solve', '-scene', 'scene.yaml'), ('predict', '-model', 'wide.h5'), ('compare', '-scene', 'scene.yaml', '-model', 'wide.h5')):
            if args[0] == 'predict':
                report = self.hyco('train', '-scene', 'scene.yaml', '-grid', '3', '-model', 'wide.h5', '-hyco_validation', '12')
                self.assertIsNone(report['held_out']['u']['largest'])
                self.assertIsNone(report['held_out']['outputs']['move']['largest'])
                self.assertLess(report['held_out']['outputs']['N']['largest'], 1e-8)
            run = self.run_raw(*args, '-mu', '7', '-report', self.path('wide.json'), '-table', self.path('wide.csv'))
            self.assertEqual(run.returncode, 0, run.stderr)
            lines.append([line for line in run.stdout.splitlines() if 'body block from moving along (1, 0, 0) (t = 1 to 2)' in line])
            with open(self.path('wide.json'), encoding='utf-8') as f:
                report = json.load(f)
            if args[0] == 'compare':
                self.assertEqual((report['worst_u']['not_compared'], report['worst_u']['max'], report['worst_output_move']['max']), (1, None, None))
                self.assertLess(report['worst_lambda']['max'], 1e-8)
                with open(self.path('wide.csv'), encoding='utf-8') as f:
                    row = next(csv.DictReader(f))
                self.assertEqual((row['worst_u'], row['worst_output_move']), ('nan', 'nan'))
            else:
                self.assertEqual((report['position_arbitrary'], report['loose']), (True, 'body block from moving along (1, 0, 0) (t = 1 to 2)'))
        self.assertEqual([len(line) for line in lines], [1, 1, 1])
        self.assertEqual(lines[0], lines[1])

    def test_arbitrary_without_friction(self):
        """The same without friction, on a path and without one; on a ring, which a turn about its axis leaves in contact, an axis through one point."""
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 1, 2)] * 2, lambda x: x, 'block', {'y0': 'base', 'y1': 'top', 'x0': 'left', 'x1': 'right'})
        for times in ('[0, 1, 2]', ''):
            text = WIDENS.replace('p*t', 'p*(1 + t)').replace(', friction: 0.1}', '}, l: {group: left, gap: 0.5}, r: {group: right, gap: 0.5}')
            self.written(text if times else text.replace('*(1 + t)', '').replace('history: {times: [0, 1, 2]}\n', ''), grid)
            name = 'body block from moving along (1, 0, 0)' + (' (t = 0 to 2)' if times else '')
            self.assertEqual(self.hyco('solve', '-scene', 'scene.yaml', '-mu', '7')['loose'], name)
        self.hyco('train', '-scene', 'scene.yaml', '-grid', '3', '-model', 'free.h5', '-hyco_model_type', 'bodies')
        self.assertEqual(self.hyco('predict', '-model', 'free.h5', '-mu', '7')['loose'], name)
        grid = Grid()  # a half disk on a floor of blocks tilted about its middle: it may turn about (1, 0, 2)
        bent = lambda x: np.stack([1 + 0.5 * x[:, 0] * np.cos(np.pi * x[:, 1]), 0.5 * x[:, 0] * np.sin(np.pi * x[:, 1])], -1)
        grid.box('quad4', [np.linspace(1, 2, 3), np.linspace(0.2, 0.8, 7)], bent, 'arc', {'x1': 'out', 'x0': 'in', 'y0': 'right', 'y1': 'left'})
        self.written('scene: {mesh: mesh.msh, parameters: [p]}\nparameter: {p: {range: [5, 10]}}\nbody: {arc: {young: 1000}}\npressure: {in: p}\n'
                     'contact: {round: {type: obstacle, group: out, normal: {x: x - 1, y: y}, gap: 0}, r: {group: right, gap: 0.1}, l: {group: left, gap: 0.1}}\n', grid)
        found = []
        for args in (('solve', '-scene', 'scene.yaml'), ('predict', '-model', 'arc.h5')):
            if args[0] == 'predict':
                self.hyco('train', '-scene', 'scene.yaml', '-grid', '3', '-model', 'arc.h5', '-hyco_model_type', 'bodies')
            found.append(self.hyco(*args, '-mu', '7')['loose'])
        self.assertIn('body arc from turning about (0, 0, 1) through (1, 0, 0)', found[0])
        self.assertEqual(*found)

    def test_unloaded(self):
        """The block that friction holds, with its load taken away and applied again: no forces at the time without a load. So a block that a lid
        has drawn along and leaves: it stays there, and a line says that nothing holds it. A block
        pressed on a carrier without friction goes with it, as with some, also in a model, and the line says so; a load on this motion is refused."""
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 2, 9), np.linspace(0, 1, 5)], lambda x: x, 'block', {'y0': 'base', 'y1': 'top'})
        grid.write(self.path('mesh.msh'))
        for gap in ('0', '0.001*(x - 1)^2'):
            rows = self.rows(self.changed('scene.yaml', UNLOADED.replace('GAP', gap), ()))
            for row, normal, tangential in zip(rows, (0, 4, 4, 2, 0, 4), (0, 0, -0.4, 0.2, 0, 0)):
                self.assertLess(abs(row['N'] - normal), 1e-8)
                self.assertLess(abs(row['T'] - tangential), 1e-8)

        grid = Grid()
        grid.box('quad4', [np.linspace(0, 2, 9), np.linspace(0, 1, 5)], lambda x: x, 'block', {'y0': 'base', 'y1': 'back'})
        grid.box('quad4', [np.linspace(0, 2, 7), np.linspace(1, 1.5, 4)], lambda x: x, 'lid', {'y0': 'under', 'y1': 'top'})
        grid.write(self.path('mesh.msh'))
        scene = self.changed('scene.yaml', RELEASED, ())
        rows = self.rows(scene)
        self.assertEqual(rows[3]['total_contact_force'], 0)
        self.assertGreater(rows[2]['along'], 0.15)  # the lid has drawn it along
        self.assertLess(abs(rows[3]['along'] - rows[2]['along']), 0.01)  # where it stays
        self.assertLess(abs(rows[3]['up']), 1e-12)
        self.assertIn('no contact force keeps body block', self.run_raw('solve', '-scene', scene).stdout)
        scene = self.changed('scene.yaml', RIDER, ())
        some, none = (self.rows(scene, '-mu', mu) for mu in ('0.4', '0'))
        for a, b in zip(some, none):
            self.assertLess(abs(a['along'] - b['along']), 1e-3)
        self.assertGreater(none[2]['along'], 0.19)
        self.assertIn('no contact force keeps body lid from moving along (1, 0, 0)', self.run_raw('solve', '-scene', scene, '-mu', '0').stdout)
        self.hyco('train', '-scene', scene, '-grid', '2', '-model', self.path('rider.h5'), '-hyco_model_type', 'bodies', '-hyco_validation', '0')
        model = self.hyco('predict', '-model', self.path('rider.h5'), '-mu', '0')['history']['outputs']['along']
        for a, b in zip(model, none):
            self.assertLess(abs(a - b['along']), 1e-9)
        pull = ('[mu]', '[mu, h]'), ('0.5]}', '0.5]}, h: {range: [0, 1]}'), ('[0, 0.5]', '[0.4, 0.5]'), ('contact:', 'traction: {top: {x: "h*max(t - 1, 0)"}}\ncontact:')
        self.hyco('train', '-scene', self.changed('scene.yaml', RIDER, pull), '-grid', '2,1', '-model', self.path('rider.h5'), '-hyco_model_type', 'bodies', '-hyco_validation', '0')
        run = self.run_raw('predict', '-model', self.path('rider.h5'), '-mu', '0.4,9', '-extrapolate')
        self.assertIn('no support keeps body lid from moving along (1, 0, 0)', run.stderr)
        run = self.run_raw('solve', '-scene', self.changed('scene.yaml', RIDER, (('output:', 'force: {lid: {x: "max(t - 1, 0)"}}\noutput:'),)), '-mu', '0')
        self.assertEqual(run.returncode, 1)
        self.assertIn('no support keeps body lid from', run.stderr)

    def test_ring(self):
        """A ring in a bore that is too small, pushed along it: the resultant is mu times the radial force, and balances the support's."""
        grid = Grid()
        grid.box('quad4', [np.linspace(1, 2, 7), np.linspace(0, 1, 7)], lambda x: x, 'ring', {'x1': 'outside', 'y0': 'end'})
        grid.write(self.path('mesh.msh'))
        last = self.rows(self.changed('scene.yaml', RING, ()))[2]
        self.near(last['T'], -0.25 * last['total_contact_force'], 1e-9)
        self.near(last['R'], -last['T'], 1e-8)

    def test_shrunk(self):
        """A ring of any thickness shrunk on a shaft, which contact alone holds: round-off of its normals along the shaft moves it nowhere."""
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 10, 6), np.linspace(0, 40, 9)], lambda x: x, 'shaft', {'x1': 'side', 'y0': 'base'})
        grid.box('quad4', [np.linspace(10, 16, 4), np.linspace(10, 30, 5)], lambda x: x, 'ring', {'x0': 'bore'})
        grid.write(self.path('mesh.msh'))
        scene = self.changed('scene.yaml', SHRUNK.replace('MU', '0.2'), ())
        run = self.run_raw('solve', '-scene', scene, '-grid', '25', '-table', self.path('ring.csv'))
        self.assertEqual(run.returncode, 0, run.stderr)
        with open(self.path('ring.csv'), encoding='utf-8') as f:
            found = [(float(row['outer']), float(row['N'])) for row in csv.DictReader(f)]
        self.assertEqual(len(found), 25)
        for outer, pressure in found:  # Lame, but for the ends
            self.near(pressure, 1e5 * 0.0125 / 20 * (1 - (10 / outer)**2), 0.5)

    def test_turns(self):
        """A block in 3D drawn along a floor: friction turns with a motion across the slip and holds the block there, as s/(mu p) of the slip,
        at full order and in a model; nothing is called arbitrary."""
        grid = Grid()
        grid.box('hex8', [np.linspace(0, 2, 3), np.linspace(0, 1, 3), np.linspace(0, 1, 2)], lambda x: x, 'block', {'z0': 'base', 'z1': 'top', 'x1': 'end'})
        self.written(TURNS, grid)
        self.hyco('train', '-scene', 'scene.yaml', '-grid', '3', '-model', 'turns.h5', '-hyco_model_type', 'bodies', '-hyco_validation', '0')
        for args in (('solve', '-scene', 'scene.yaml'), ('predict', '-model', 'turns.h5')):
            for s in (0.01, 0.04):
                report = self.hyco(*args, '-mu', str(s))
                self.assertFalse(report['position_arbitrary'])
                self.near(report['history']['outputs']['move'][2], 0.1 * s / 3, 0.2)
        # The surfaces stay closed, and B u is round-off.
        self.assertLess(self.hyco('predict', '-model', 'turns.h5', '-mu', '0.04', '-hyco_residual')['equilibrium']['worst_contact'], 1e-8)

    def test_creep(self):
        """Bodies that creep: Newton's method outside, the law of contact inside."""
        last = self.rows(self.pad(law=NORTON))[3]
        self.near(last['T'], 0.3 * last['N'], 1e-8)
        self.assertGreater(last['inelastic'], 1e-5)
        self.assertGreater(last['W'], 0)

    def test_ranks(self):
        """The same on one to four ranks, with the fields."""
        scene = self.pad()
        first = self.rows(scene, '-output', self.path('one.xdmf'))
        for ranks in (2, 3, 4):
            rows = self.rows(scene, '-output', self.path('more.xdmf'), ranks=ranks)
            for name in ('T', 'N', 'W', 'friction_work', 'n_slipping', 'total_contact_force'):
                for one, more in zip(first, rows):
                    self.assertLessEqual(abs(one[name] - more[name]), 1e-9 * max(abs(r[name]) for r in first), name)
            with h5py.File(self.path('one.h5')) as one, h5py.File(self.path('more.h5')) as more:
                for name in ('contact_traction', 'contact_slip', 'contact_state', 'contact_force'):
                    for k in range(4):
                        a, b = (f[f'step-{k:04d}/nodes/{name}'][:] for f in (one, more))
                        self.assertLessEqual(abs(a - b).max(), 1e-9 * max(abs(a).max(), 1e-12), name)

    def test_resume(self):
        """A killed run continues with the state of its contacts, also on another number of ranks."""
        scene, steps = self.pad(), ['-hyco_substeps', '4']
        whole = self.rows(scene, *steps)
        keep = ['-hyco_checkpoint', self.path('c.h5')]
        process = subprocess.Popen([HYCO, 'solve', '-scene', scene, *steps, *keep], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        for line in process.stdout:
            if line.startswith('t 2 '):
                process.send_signal(signal.SIGKILL)
                break
        process.communicate(timeout=100 * PATIENCE)
        shutil.copy(self.path('c.h5'), self.path('kept.h5'))
        for ranks in (0, 2):
            shutil.copy(self.path('kept.h5'), self.path('c.h5'))
            rest = self.rows(scene, *steps, *keep, '-hyco_resume', ranks=ranks)
            for name in ('T', 'W', 'friction_work', 'contact_work', 'n_slipping'):
                self.near(rest[3][name], whole[3][name], 1e-9, name)

    def test_without(self):
        """mu = 0 takes the steps of the scene without friction, bit for bit; a coefficient that falls to 0 keeps the work done before."""
        fields = {}
        plain = ('gap: "0.0005*x", friction: "0"', 'gap: "0.0005*x"'), ('T: {friction: x, contact: floor}, ', ''), (', W: {friction: work}', '')
        for name, changes in (('zero', {}), ('plain', dict(zip('abc', plain)))):
            self.rows(self.pad(name + '.yaml', mu='0', **changes), '-output', self.path(name + '.xdmf'))
            with h5py.File(self.path(name + '.h5')) as file:
                fields[name] = [file[f'step-{k:04d}/nodes/{f}'][:] for k in range(4) for f in ('displacement', 'contact_force', 'gap')]
        for a, b in zip(fields['zero'], fields['plain']):
            np.testing.assert_array_equal(a, b)
        rows = self.rows(self.pad(mu='0.3*max(0, 2.5 - t)'))
        self.assertEqual(rows[3]['T'], 0)
        self.assertGreater(rows[2]['W'], 0)
        self.assertEqual(rows[3]['W'], rows[2]['W'])

    def test_refused(self):
        """One line each: no history, a negative coefficient, methods that do not know friction, a wrong output."""
        times = 'history: {times: [0, 1, 2, 3], tables: {s: [[0, 0], [1, 0], [2, 1], [3, -1]]}}\n'
        for words, scene, args in (
                (('contact_floor_friction', 'history'), self.pad('a.yaml', a=(times, ''), b=('"0.01*s"', '0'), c=('-0.004*min(t, 1)', '-0.004')), ['solve']),
                (('contact_floor_friction is -0.1', '0 or more'), self.pad('b.yaml', mu='x - 0.1'), ['solve']),
                (('use -hyco_solver_type semismooth',), self.pad('d.yaml'), ['solve', '-hyco_solver_type', 'lemke']),
                (('output_T_friction',), self.pad('e.yaml', a=('T: {friction: x,', 'T: {friction: w,')), ['solve'])):
            run = self.run_raw(*args, '-scene', scene)
            self.assertEqual(run.returncode, 1, run.stderr)
            self.assertEqual(len(run.stderr.strip().splitlines()), 1, run.stderr)
            for word in words:
                self.assertIn(word, run.stderr)


if __name__ == '__main__':
    unittest.main()
