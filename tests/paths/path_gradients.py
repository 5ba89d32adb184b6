"""Gradients of paths (creep, yielding, friction), at full order and of models of bodies and hybrid ones: outputs at each listed time and the extremes over
them against central differences of paths in the same steps; one-sided and flagged at kinks; the path stays; a fit to outputs of a path."""
import csv
import json
import math
import os
import sys
import unittest

import h5py

from common import SOURCE, Case

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import Grid  # noqa: E402

SCENE = """
scene: {title: a block that is pressed on a stop while it flows, mesh: mesh.msh, parameters: [push, stop, LAST]}
parameter: {push: {range: [40, 80]}, stop: {range: [1e-4, 4e-4]}, LAST: {range: RANGE}}
body: {block: {LAW, young: 1e5, poisson: 0.3}}
fixed: {left: {x: 0}, low: {y: 0}}
pressure: {right: -push*qTRAP}
contact: {wall: {type: obstacle, group: high, normal: {y: 1}, gap: -stop*(0.2 + x)FRICTION}}
output:
  end: {max: u_x, group: right}
  held: {force: y, contact: wall}
  least: {min: sigma_xx, group: block}
  mean: {mean: mises, group: block}
history: {times: [0, 1, 4, 8], tables: {q: [[0, 0.2], [1, 1], [4, 1.1], [8, 0.6]]}}
"""
REST = """
scene: {title: a block that friction holds and lets go, mesh: mesh.msh, parameters: [push, pull, rough]}
parameter: {push: {range: [40, 80]}, pull: {range: [5, 10]}, rough: {range: [0.3, 0.5]}}
body: {block: {young: 1e5, poisson: 0.3}}
pressure: {low: push*qTRAP}
traction: {right: {x: pull*s}}
contact: {wall: {type: obstacle, group: high, normal: {y: 1}, gap: 0, friction: rough}}
output:
  lost: {friction: work}
  held: {friction: x, contact: wall}
  peak: {max: mises, group: block}
  end: {mean: u_x, group: right}
history: {times: [0, 1, 2, 3], tables: {q: [[0, 0], [1, 1], [2, 0], [3, 1]], s: [[0, 0], [1, 1], [2, 0], [3, -1]]}}
"""
BAR = """
scene: {title: a bar that is pulled to a stop, mesh: mesh.msh, parameters: [p]}
parameter: {p: {range: [0.25, 1]}}
body: {bar: {young: 1, poisson: 0}}
fixed: {left: {x: 0}}
force: {right: {x: p*q}}
contact: {stop: {type: obstacle, group: right, normal: {x: 1}, gap: 0.5}}
output: {push: {force: x, contact: stop}, end: {max: u_x}}
history: {times: [0, 1, 2], tables: {q: [[0, 0.5], [1, 1], [2, 0.9]]}}
"""
CREEP = (('LAST', 'rate'), ('RANGE', '[5e-10, 2e-9]'), ('LAW', 'law: norton, rate: rate, exponent: 3'), ('FRICTION', ''))
YIELD = (('LAST', 'limit'), ('RANGE', '[35, 45]'), ('LAW', 'law: j2, yield: limit, hardening: 5000'), ('FRICTION', ''))
PLAIN = (('LAST', 'ratio'), ('RANGE', '[0.2, 0.4]'), ('LAW', 'law: elastic'), ('poisson: 0.3', 'poisson: ratio'), ('FRICTION', ''))
RUB = (('LAST', 'rough'), ('RANGE', '[0.1, 0.5]'), ('LAW', 'law: elastic'), ('FRICTION', ', friction: rough'))
WARM = (('LAST', 'warm'), ('RANGE', '[850, 950]'), ('LAW', 'law: limback_andersson, temperature: warm + 10*q + 20*x, expansion: 1e-6, reference_temperature: 800'),
        ('FRICTION', ', friction: 0.3'))
FLOAT = (('LAST', 'pace'), ('RANGE', '[5e-9, 2e-8]'), ('LAW', 'law: strain_hardening, rate: pace, exponent: 3, time_exponent: 0.6'), ('body: {', 'body: {plate: {young: 1e5, poisson: 0.3}, '),
         ('low: {y: 0}', 'low: {y: 0}, plate_left: {x: 0}'), ('right: -push*q', 'plate_top: push*q*(1 + 0.2*x)'),
         ('type: obstacle, group: high, normal: {y: 1}, gap: -stop*(0.2 + x)FRICTION', 'type: pair, slave: plate_low, master: high, tolerance: 1e-6, gap: stop*x*x'))
EDGE = (('gap: -stop*(0.2 + x)', 'gap: stop*(10 + x)'), *YIELD)
TRAP = ' + 0*sqrt(abs(push - 61.004) - 1e-7)'  # where a difference of whole paths has its point
STEPS = ('-hyco_substeps', '4', '-hyco_step_inelastic', '1e3', '-hyco_newton_rtol', '1e-13')
RANGES = {'push': (40, 80), 'stop': (1e-4, 4e-4), 'rate': (5e-10, 2e-9), 'limit': (35, 45), 'rough': (0.1, 0.5), 'ratio': (0.2, 0.4), 'warm': (850, 950), 'pace': (5e-9, 2e-8),
          'pull': (5, 10)}
WIDTH = 1.6e-4  # of the central differences, as a share of the range


class PathGradients(Case):
    def write(self, laws, text=SCENE, trap=''):
        for a, b in laws:
            text = text.replace(a, b)
        grid = Grid()
        grid.box('quad4', [[0, 0.3, 0.6, 1], [0, 0.5, 1]], lambda x: x, 'block', {'x0': 'left', 'x1': 'right', 'y0': 'low', 'y1': 'high'})
        if laws == FLOAT:
            grid.box('quad4', [[0, 0.3, 0.6, 1], [1, 1.4]], lambda x: x, 'plate', {'x0': 'plate_left', 'y0': 'plate_low', 'y1': 'plate_top'})
        return self.written(text.replace('TRAP', trap), grid)

    def differ(self, found, low, high, scale, what):
        """A derivative times its range is the central difference of the values."""
        self.assertLess(abs(found - (high - low) / WIDTH), 1e-6 * scale, what)

    def test_full_order(self):
        """Elastic bodies without and with friction, also where one is let go between steps, creep without and with friction, and yielding,
        by their steps: no path beside has a value; at each listed time. The path itself is that without gradients."""
        point = {'push': 61.0, 'stop': 2.3e-4}
        for laws, point, along in ((PLAIN, {**point, 'ratio': 0.31}, ('stop', 'ratio')), (RUB, {**point, 'rough': 0.23}, ('push', 'rough')),
                                   (None, {'push': 61.0, 'pull': 9.7, 'rough': 0.31}, ('pull', 'rough')),
                                   (YIELD, {**point, 'limit': 39.0}, ('limit',)), (CREEP, {**point, 'rate': 1.1e-9}, ('push', 'rate')), (WARM, {**point, 'warm': 897.0}, ('warm',))):
            scene = self.write(laws or (), SCENE if laws else REST, TRAP)
            solve = lambda at, *args, scene=scene: self.hyco('solve', '-scene', scene, *STEPS, '-mu', ','.join(map(repr, at.values())), *args)
            report = solve(point, '-gradient')
            self.assertEqual(report['gradient_kinks'], [])
            for p in along:
                width = RANGES[p][1] - RANGES[p][0]
                low, high = (solve({**point, p: point[p] + sign * WIDTH / 2 * width})['history']['outputs'] for sign in (-1, 1))
                for output, values in report['history']['outputs'].items():
                    extreme, times = min if output == 'least' else max, report['gradient_times'][output][p]
                    scale = max(max(map(abs, times)) * width, 1e-3 * max(map(abs, values)))
                    for k, value in enumerate(times):
                        self.differ(value * width, low[output][k], high[output][k], scale, (p, output, k))
                    self.assertEqual(report['gradient'][output][p], times[-1])
                    self.differ(report['gradient_path'][output][p] * width, extreme(low[output]), extreme(high[output]), scale, (p, output))
            plain = solve(point)
            for key in ('outputs', 'contacts', 'supports'):
                self.assertEqual(report.get(key), plain.get(key), key)

    def test_kink(self):
        """A gap that closes exactly at a listed time: there, and of the extreme, derivatives are one-sided and flagged, towards larger loads; not elsewhere. The same where a
        model's body is just about to yield at a listed time."""
        grid = Grid()
        grid.box('line2', [[0, 0.5, 1]], lambda x: x, 'bar', {'x0': 'left', 'x1': 'right'})
        r = self.hyco('solve', '-scene', self.written(BAR, grid), '-mu', '0.5', '-gradient')
        # the largest push, with its sign, is 0 at all times, one of which has a kink
        self.assertEqual(sorted((k['output'], k.get('t')) for k in r['gradient_kinks']), [('end', 1), ('path_end', None), ('path_push', None), ('push', 1)])
        for output, expected in (('push', [0, 1, 0]), ('end', [0.5, 0, 0.9])):
            for value, exact in zip(r['gradient_times'][output]['p'], expected):
                self.assertAlmostEqual(abs(value), exact, 7, output)
        self.hyco('train', '-scene', self.write(EDGE), *STEPS, '-hyco_model_type', 'bodies', '-scatter', '6', '-model', 'edge.h5', status=None)
        for limit, expected in ((45 * math.sqrt(0.79), [1]), (45.1 * math.sqrt(0.79), [])):  # von Mises stress of a pull in plane strain: sqrt(1 - 0.3 + 0.09)
            r = self.hyco('predict', '-model', 'edge.h5', *STEPS, '-mu', f'45,2e-4,{limit!r}', '-gradient')
            self.assertEqual([k['t'] for k in r['gradient_kinks'] if (k['output'], k['parameter'], k.get('t')) == ('end', 'push', 1)], expected)

    def test_failing(self):
        """A point beside which a path has no value: its derivatives are nan, those of the others of the set stand, and one line says so after the table and
        the report are written; such a point alone is an error, and nothing is written."""
        grid = Grid()
        grid.box('line2', [[0, 0.5, 1]], lambda x: x, 'bar', {'x0': 'left', 'x1': 'right'})
        scene = self.written(BAR.replace('x: p*q', 'x: p*q + 0*sqrt(abs(p - 0.500075) - 1e-7)'), grid)
        self.hyco('train', '-scene', scene, '-hyco_model_type', 'hybrid', '-scatter', '4', '-model', 'bar.h5', status=None)
        still = self.written(BAR.split('history')[0].replace('x: p*q', 'x: p + 0*sqrt(abs(p - 0.5000225) - 1e-7)'), grid)
        for command, ranks, last in ((('solve', '-scene', still), 2, 1), (('predict', '-model', 'bar.h5'), 0, 0.9), (('predict', '-model', 'bar.h5'), 2, 0.9)):
            run = self.run_raw(*command, '-values_p', '0.4,0.5,0.7', '-gradient', '-table', 'rows.csv', '-report', 'rows.json', ranks=ranks)
            self.assertEqual((run.returncode, run.stderr.count('hyco: error')), (1, 1), run.stderr)
            self.assertIn('1 of the 3 points have no gradient', run.stderr)
            self.assertIn('is not finite', run.stderr)
            with open(self.path('rows.csv'), encoding='ascii') as f:
                rows = list(csv.DictReader(f))
            self.assertEqual([row['converged'] for row in rows], ['1', '1', '1'])
            for row, p, slope in zip(rows, (0.4, 0.5, 0.7), (0, None, last)):
                self.near(float(row['p']), p, 1e-12)
                if slope is None:
                    self.assertTrue(math.isnan(float(row['d_push_d_p'])) and math.isnan(float(row['gradient_kinks'])))
                else:
                    self.assertAlmostEqual(abs(float(row['d_push_d_p'])), slope, 7)
            with open(self.path('rows.json'), encoding='utf-8') as f:
                report = json.load(f)
            self.assertEqual((report['n_points'], report['not_converged'], report['without_gradient']), (3, 0, 1))
            for at in (('-mu', '0.5'), ('-values_p', '0.5')):
                run = self.run_raw(*command, *at, '-gradient', '-report', 'none.json', ranks=ranks)
                self.assertEqual((run.returncode, run.stderr.count('hyco: error')), (1, 1), run.stderr)
                self.assertFalse(os.path.exists(self.path('none.json')))

    def test_models(self):
        """Models of bodies (elastic without and with friction, which also lets go between; yielding; creep alone, with friction, under a body that floats) and hybrid ones, at the end and of the
        extremes, those of bodies where no path beside has a value; a prediction stays; outputs of a path determine its parameters."""
        for kind, laws, name, mu in (('bodies', PLAIN, 'ratio', 0.31), ('hybrid', CREEP, 'rate', 1.1e-9), ('bodies', RUB, 'rough', 0.23), ('bodies', YIELD, 'limit', 39.0),
                                     ('bodies', (), 'rest', 0.31), ('bodies', WARM, 'warm', 897.0), ('bodies', FLOAT, 'pace', 1.1e-8), ('bodies', CREEP, 'rate', 1.1e-9)):
            model = f'{kind}_{name}.h5'
            self.hyco('train', '-scene', self.write(laws, SCENE if laws else REST, TRAP if kind == 'bodies' else ''), *STEPS, '-hyco_model_type', kind, '-scatter', '6', '-model', model, status=None)
            point = {'push': 61.0, 'stop': 2.3e-4, name: mu} if laws else {'push': 61.0, 'pull': 9.7, 'rough': mu}
            at = ('predict', '-model', model, *STEPS, '-mu', ','.join(map(repr, point.values())))
            report = self.hyco(*at, '-gradient')
            self.assertEqual(report['gradient_kinks'], [])
            if laws == PLAIN:  # whose cells follow a ratio that changes their flexibility
                full = self.hyco('solve', '-scene', 'scene.yaml', *STEPS, '-mu', at[-1])
                for output, values in full['history']['outputs'].items():
                    for value, expected in zip(report['history']['outputs'][output], values):
                        self.near(value, expected, 1e-3, output)
            if kind == 'hybrid':  # whose derivatives are differences: a fit ends at their round-off
                r = self.hyco('fit', '-model', model, *STEPS, '-target_end', repr(report['outputs']['end']), '-mu', '55,2.3e-4,1.1e-9', '-hold_stop', '2.3e-4', '-hold_rate', '1.1e-9')
                self.assertTrue(r['converged'])
                self.near(r['mu']['push'], 61, 1e-6)
                self.assertLess(r['evaluations'], 15)
            widths = {p: RANGES[p][1] - RANGES[p][0] for p in point}
            with open(self.path('points.csv'), 'w', encoding='ascii') as f:
                f.write(','.join(point) + '\n')
                for p, width in widths.items():
                    for sign in (-1, 1):
                        f.write(','.join(repr(value + sign * WIDTH / 2 * width * (n == p)) for n, value in point.items()) + '\n')
            self.hyco('predict', '-model', model, *STEPS, '-points', 'points.csv', '-table', 'rows.h5')
            with h5py.File(self.path('rows.h5')) as f:  # all digits
                rows = {key: f[key][:] for output in report['outputs'] for key in (output, 'path_' + output)}
            for k, (p, width) in enumerate(widths.items()):
                for output, values in report['history']['outputs'].items():
                    for key, column in (('gradient', output), ('gradient_path', 'path_' + output)):
                        found = report[key][output][p] * width
                        self.differ(found, *rows[column][2 * k:2 * k + 2], max(abs(found), 1e-2 * max(map(abs, values))), (kind, p, column))
        plain = self.hyco(*at)
        for key in ('outputs', 'contacts', 'kkt', 'rid_strain_energy'):
            self.alike(report[key], plain[key], key)
        self.assertEqual(report['history']['outputs'], plain['history']['outputs'])
        held, mean = (plain['history']['outputs'][name] for name in ('held', 'mean'))
        near = ','.join(repr(value + 0.05 * (RANGES[p][1] - RANGES[p][0])) for p, value in point.items())
        r = self.hyco('fit', '-model', model, *STEPS, '-target_end', repr(plain['outputs']['end']), '-target_held', repr(held[-1]),
                      '-target_mean', repr(mean[-1]), '-mu', near, '-target_path_held', repr(max(held)), '-target_path_mean', repr(max(mean)))
        self.assertTrue(r['converged'])
        self.assertLess(r['misfit_model'], 1e-6)
        for name, value in point.items():
            self.near(r['mu'][name], value, 1e-3, name)


if __name__ == '__main__':
    unittest.main()
