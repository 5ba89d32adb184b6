"""Gradients at full order: against central differences of solutions for obstacles and pairs in 2D and 3D, through loads, moduli, gaps, moved bodies,
shapes and heat, with bodies that contact alone holds; the same on several ranks; one-sided and flagged at kinks; refused where there is none."""
import csv
import os
import sys
import unittest

import h5py

from common import SOURCE, Case

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import Grid  # noqa: E402

MESH = os.path.join(SOURCE, 'examples', '{0}', '{0}.msh')
ROLLER = f"""
scene: {{title: a cylinder that is moved and pressed on a block, mesh: {MESH.format('roller')}, parameters: [place, press, modulus, load, entry]}}
parameter: {{place: {{range: [-5, 5]}}, press: {{range: [0.2, 1]}}, modulus: {{range: [5, 20]}}, load: {{range: [0, 1]}}, entry: {{range: [0, 0.2]}}}}
body:
  block: {{young: modulus, poisson: 0.4, density: 1}}
  cylinder: {{young: 100, poisson: 0.3, map: {{x: x + place, y: y + entry}}}}
fixed: {{block_base: {{x: 0, y: 0}}, cylinder_top: {{x: 0, y: -press}}}}
gravity: {{x: 0, y: -0.01*load}}
contact: {{under: {{type: surface, slave: cylinder_round, master: block_top}}}}
output:
  lift: {{force: y, contact: under}}
  turn: {{moment: z, contact: under}}
  base: {{reaction: y, group: block_base}}
  peak: {{max: mises, group: block}}
  sink: {{mean: u_y, group: block}}
"""
PELLET = f"""
scene: {{title: a pellet in its cladding, mesh: {os.path.join(SOURCE, 'examples', 'pellet', 'A.msh')}, parameters: [radius, load, stiff, extra, heat]}}
parameter: {{radius: {{range: [4.02, 4.1]}}, load: {{range: [0, 1]}}, stiff: {{range: [0.5, 2]}}, extra: {{range: [-0.005, 0.005]}}, heat: {{range: [300, 600]}}}}
body:
  pellet: {{young: 1e5*stiff, poisson: 0.3, temperature: heat + 20*z, expansion: 1e-5, reference_temperature: 300,
            map: {{x: x*radius/4.1, y: y*radius/4.1}}}}
  cladding: {{young: 1e5, poisson: 0.3}}
fixed: {{sym_x0: {{x: 0}}, sym_y0: {{y: 0}}, sym_z0: {{z: 0}}}}
pressure: {{pellet_top: 5*load, clad_outer_high: 50*load, clad_outer_low: 250*load}}
contact: {{gap: {{type: pair, slave: contact_pellet, master: contact_clad, tolerance: 1e-3, normal: {{x: x, y: y}}, gap: 4.1 - radius + extra}}}}
output:
  squeeze: {{force: x, contact: gap}}
  hoop: {{max: sigma_tt, group: contact_clad}}
  held: {{reaction: x, group: sym_x0}}
"""
BUMP = f"""
scene: {{title: a block on springs under a bump, mesh: {MESH.format('roller')}, parameters: [at, depth, modulus]}}
parameter: {{at: {{range: [-6, 6]}}, depth: {{range: [0.05, 0.3]}}, modulus: {{range: [5, 20]}}}}
body: {{block: {{young: modulus, poisson: 0.3}}, cylinder: {{young: 100, poisson: 0.3}}}}
fixed: {{block_base: {{x: 0}}, cylinder_top: {{x: 0, y: 1}}}}
spring: {{block_base: {{y: 2*modulus}}}}
contact: {{bump: {{type: obstacle, group: block_top, normal: {{y: 1}}, gap: 0.02*(x - at)^2 - depth}}}}
output: {{push: {{force: y, contact: bump}}, low: {{min: u_y, group: block}}}}
"""
FLOATING = f"""
scene: {{title: a block that a foundation alone holds, mesh: {MESH.format('blocks')}, parameters: [soft, press, tip]}}
parameter: {{soft: {{range: [1, 4]}}, press: {{range: [50, 400]}}, tip: {{range: [-0.5, 0.5]}}}}
body: {{block: {{young: 2e5, poisson: 0.3}}, foundation: {{young: 1e5/soft, poisson: 0.3}}}}
fixed: {{block_sym: {{x: 0}}, foundation_sym: {{x: 0}}, foundation_base: {{y: 0}}}}
pressure: {{block_top: press*(1 + tip*x/20)}}
contact: {{under: {{type: surface, slave: block_under, master: foundation_top, tolerance: 0.3}}}}
output: {{lift: {{force: y, contact: under}}, sink: {{mean: u_y, group: block}}, peak: {{max: mises}}}}
"""
# a bar of length and modulus 1 that is pulled by p towards an obstacle at the distance 0.5: the force is max(p - 0.5, 0)
BAR = """
scene: {title: bar, mesh: mesh.msh, parameters: [p, g]}
parameter: {p: {range: [0.25, %s]}, g: {range: [0.25, 1]}}
body: {bar: {young: 1, poisson: 0}}
fixed: {left: {x: 0}}
force: {right: {x: p}}
contact: {stop: {type: obstacle, group: right, normal: {x: 1}, gap: g}}
%s
"""
OUTPUT = 'output: {push: {force: x, contact: stop}, end: {max: u_x}}'
SHIFTS = ((-2, 1 / 12), (-1, -8 / 12), (1, 8 / 12), (2, -1 / 12))
STEP = 1e-4


class Gradients(Case):
    def scene(self, text):
        return self.changed('scene.yaml', text, [])

    def differences(self, args, report, ranges):
        """{output: {parameter: fourth-order central difference of solutions}} around the report's point."""
        names = list(report['mu'])
        points = []
        for name in names:
            width = ranges[name][1] - ranges[name][0]
            points += [[report['mu'][n] + (shift * STEP * width if n == name else 0) for n in names] for shift, _ in SHIFTS]
        with open(self.path('points.csv'), 'w', encoding='ascii') as f:
            f.write(','.join(names) + '\n' + ''.join(','.join(map(repr, p)) + '\n' for p in points))
        self.hyco(*args, '-points', 'points.csv', '-table', 'shifts.h5')
        with h5py.File(self.path('shifts.h5')) as f:
            rows = {name: f[name][:] for name in ('n_active', *report['outputs'])}
        self.assertEqual(set(rows['n_active']), {report['n_active']}, 'the closed contacts change within the differences')
        found = {}
        for output in report['outputs']:
            found[output] = {}
            for k, name in enumerate(names):
                width = ranges[name][1] - ranges[name][0]
                found[output][name] = sum(w * rows[output][4 * k + j] for j, (_, w) in enumerate(SHIFTS)) / (STEP * width)
        return found

    def agrees(self, args, mu, ranges, tolerance=1e-6):
        """The gradient at mu is that of the differences; an output's derivatives are compared by the change over a parameter's range."""
        report = self.hyco(*args, '-mu', ','.join(map(repr, mu)), '-gradient')
        self.assertEqual((report['gradient_kinks'], report['gradient_undecided']), ([], 0))
        expected = self.differences(args, report, ranges)
        for output, by in expected.items():
            most = max(abs(value) * (ranges[p][1] - ranges[p][0]) for p, value in by.items())
            self.assertGreater(most, 0)
            for p, value in by.items():
                floor = 1e-3 * most / (ranges[p][1] - ranges[p][0])
                self.assertLess(abs(report['gradient'][output][p] - value), tolerance * max(abs(value), floor), f'd({output})/d({p}): {value}')
        return report

    def test_surface(self):
        """2D, bodies that slide along each other: place, prescribed displacement, modulus, body force, entry."""
        self.agrees(('solve', '-scene', self.scene(ROLLER)), [1.03, 0.6, 11.0, 0.4, 0.03],
                    {'place': (-5, 5), 'press': (0.2, 1), 'modulus': (5, 20), 'load': (0, 1), 'entry': (0, 0.2)})

    def test_pairs(self):
        """3D, pairs of nodes: radius, pressures, modulus, gap, temperature."""
        self.agrees(('solve', '-scene', self.scene(PELLET)), [4.061, 0.7, 1.2, 0.001, 420.0],
                    {'radius': (4.02, 4.1), 'load': (0, 1), 'stiff': (0.5, 2), 'extra': (-0.005, 0.005), 'heat': (300, 600)})

    def test_obstacle(self):
        """An obstacle that moves, springs that stiffen."""
        self.agrees(('solve', '-scene', self.scene(BUMP)), [1.3, 0.21, 12.0], {'at': (-6, 6), 'depth': (0.05, 0.3), 'modulus': (5, 20)})

    def test_floating(self):
        """A body that contact alone holds: its rigid motion follows the closed contacts."""
        self.agrees(('solve', '-scene', self.scene(FLOATING)), [2.1, 230.0, 0.2], {'soft': (1, 4), 'press': (50, 400), 'tip': (-0.5, 0.5)})

    def test_without_contact(self):
        """A linear scene, and moduli of two bodies."""
        plate = ('solve', '-scene', os.path.join(SOURCE, 'examples', 'plate'), '-output_peak_max', 'mises', '-output_wide_mean', 'u_x')
        self.agrees(plate, [1.7, 0.4], {'stiffness': (0.2, 5), 'share': (0, 1)})

    def test_ranks(self):
        """The same on 1, 2 and 3 ranks, also where surfaces are divided, and the solution is unchanged by the gradient."""
        for text, mu in ((ROLLER, '1.03,0.6,11,0.4,0.03'), (PELLET, '4.061,0.7,1.2,0.001,420')):
            args = ('solve', '-scene', self.scene(text), '-mu', mu)
            plain = self.hyco(*args)
            one = self.hyco(*args, '-gradient')
            for key in ('outputs', 'contacts', 'supports', 'strain_energy'):
                self.assertEqual(one[key], plain[key])
            for ranks in (2, 3):
                other = self.hyco(*args, '-gradient', ranks=ranks)
                for output, by in one['gradient'].items():
                    most = max(map(abs, by.values()))
                    for p, value in by.items():
                        self.assertLess(abs(other['gradient'][output][p] - value), 1e-9 * most + 1e-6 * abs(value) * (p == 'place'), (output, p, ranks))

    def bar(self, top=1, output=OUTPUT):
        grid = Grid()
        grid.box('line2', [[0, 0.5, 1]], lambda x: x, 'bar', {'x0': 'left', 'x1': 'right'})
        return self.written(BAR % (top, output), grid)

    def test_kink(self):
        """At the load that closes the gap the derivative is that towards larger loads, and flagged; at the upper end of the range that towards
        smaller ones. Beside the kink nothing is flagged."""
        for p, top, push, end in ((0.5, 1, (1, -1), (0, 0)), (0.5, 0.5, (0, -1), (1, 0)), (0.51, 1, (1, -1), (0, 1)), (0.49, 1, (0, 0), (1, 0))):
            r = self.hyco('solve', '-scene', self.bar(top), '-mu', f'{p},0.5', '-gradient')
            kink = p == 0.5
            self.assertEqual(r['gradient_undecided'], int(kink))
            self.assertEqual(len(r['gradient_kinks']), 4 * kink, r['gradient_kinks'])
            found = [abs(r['gradient']['push'][x]) for x in 'pg'] + [r['gradient']['end'][x] for x in 'pg']
            for value, expected in zip(found, (abs(push[0]), 0 if kink or p < 0.5 else 1, end[0], end[1] if not kink else 0)):
                self.assertAlmostEqual(value, expected, 8, (p, top, r['gradient']))

    def test_table(self):
        """A set's table has a column for each derivative and the number of kinks."""
        self.hyco('solve', '-scene', self.bar(), '-values_p', '0.4,0.5,0.7', '-values_g', '0.5', '-gradient', '-table', 't.csv')
        with open(self.path('t.csv'), encoding='ascii') as f:
            rows = list(csv.DictReader(f))
        self.assertEqual([float(r['gradient_kinks']) for r in rows], [0, 4, 0])
        for row, expected in zip(rows, (0, 1, 1)):
            self.assertAlmostEqual(abs(float(row['d_push_d_p'])), expected, 8)

    def test_refused(self):
        """Each refusal is one line that names what is missing."""
        for words, args in ((('output',), ('-scene', self.bar(output=''))), (('factor', '-hyco_linear direct'), ('-scene', self.bar(), '-hyco_linear', 'iterative'))):
            self.bar(output='' if 'output' in words else OUTPUT)
            run = self.run_raw('solve', *args, '-mu', '0.7,0.5', '-gradient', '-report', 'none.json')
            self.assertEqual(run.returncode, 1, run.stderr)
            self.assertEqual(len(run.stderr.strip().splitlines()), 1, run.stderr)
            for word in words:
                self.assertIn(word, run.stderr)
            self.assertFalse(os.path.exists(self.path('none.json')))


if __name__ == '__main__':
    unittest.main()
