"""Scenes with a history: their path, on any number of ranks, by either kind of iteration, interrupted or not."""
import csv
import json
import os
import re
import signal
import subprocess
import time
import unittest
import sys
import xml.etree.ElementTree as ET

import h5py
import numpy as np

from common import HYCO, PATIENCE, PELLET, SOURCE, Case

sys.path.append(os.path.join(SOURCE, 'tests', 'verify'))
from grids import Grid  # noqa: E402

RING = os.path.join(SOURCE, 'examples', 'ring')


def arrays(path):
    """All numbers of a series by name."""
    out = {}
    with h5py.File(path) as f:
        f.visititems(lambda name, item: out.update({name: item[()]}) if isinstance(item, h5py.Dataset) and item.dtype.kind == 'f' else None)
    return out


class History(Case):
    def test_limited_steps(self):
        """A path whose steps only -hyco_step_inelastic keeps short says so, with the option to change; one with few steps says that they are long. check tells
        what enters the bodies."""
        changes = []
        for bound, limited in (('2e-6', True), ('1e-2', False)):
            run = self.run_raw('solve', '-scene', RING, '-mu', '0.01,1', '-history_times', '0,1', '-hyco_step_inelastic', bound, '-report', self.path('limited.json'))
            self.assertEqual(run.returncode, 0, run.stderr)
            self.assertEqual('-hyco_step_inelastic' in run.stdout, limited, run.stdout)
            with open(self.path('limited.json'), encoding='utf-8') as f:
                history = json.load(f)['history']
            self.assertEqual(2 * history['steps_limited'] > sum(history['substeps']), limited, history['steps_limited'])
            changes.append(history['time_error'])
            self.assertEqual('LONG TIME STEPS' in run.stdout, changes[-1] > 0.06, run.stdout)
        self.assertLess(changes[0], 0.06)
        self.assertGreater(changes[1], 0.06)
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 2, 9), np.linspace(0, 1, 5)], lambda x: x, 'block', {'y1': 'top'})
        self.written('scene: {mesh: mesh.msh}\nbody: {block: {law: norton, young: 1000, poisson: 0.3, rate: 1e-6, exponent: 2}}\n'
                     'fixed: {top: {x: 0.3*t, y: -0.1*t}}\nhistory: {times: [0, 1, 2, 3]}\n', grid)
        run = self.run_raw('solve', '-scene', 'scene.yaml', '-report', self.path('moved.json'))
        self.assertNotIn('LONG TIME STEPS', run.stdout)  # nothing but round-off strains a block that moves as a whole
        with open(self.path('moved.json'), encoding='utf-8') as f:
            history = json.load(f)['history']
        self.assertEqual((history['time_error'], max(history['energy_defect'])), (0, 0))
        found = self.hyco('check', '-scene', RING, '-body_core_young', '1e5*creep')
        self.assertIn('creep: scales the stiffness of body core', found['bodies_by_parameter'])
        self.assertIn('interference: leaves', found['bodies_by_parameter'])
        self.hyco('check', '-scene', RING, '-body_core_temperature', '300-t', '-body_core_expansion', '1e-9', '-body_core_reference_temperature', '300',
                  '-parameter_interference_range', '500,600')  # the time is that of the history, not a parameter's

    def test_steps_by_error(self):
        """A bar that is stretched and creeps, in one listed interval: its stress is the closed form's without a request for steps, also by a model, whose steps
        are those of training; with one step a listed interval both are far from it. Steps that need no change stay."""
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 1, 2), np.linspace(0, 4, 3)], lambda x: x, 'bar', {'x0': 'side', 'y0': 'low', 'y1': 'high'})
        self.written('scene: {mesh: mesh.msh, parameters: [c], formulation: axisymmetric}\nparameter: {c: {range: [0.5, 2]}}\n'
                     'body: {bar: {law: norton, young: 1e5, poisson: 0.3, rate: 1e-17*c, exponent: 5}}\n'
                     'fixed: {side: {x: 0}, low: {y: 0}, high: {y: 0.008}}\nhistory: {times: [0, 1000]}\noutput: {N: {reaction: y, group: high}}\n', grid)
        exact = lambda c: np.pi * 200 * (1 + 4 * 1e5 * 1e-17 * c * 200**4 * 1000)**-0.25
        force = lambda found: found['outputs']['N']
        found = self.hyco('solve', '-scene', 'scene.yaml', '-mu', '1.3')
        self.near(force(found), exact(1.3), 5e-3)
        self.assertLess(found['history']['time_error'], 0.03)
        self.assertGreater(found['history']['time_error'], 1e-3)
        one = self.hyco('solve', '-scene', 'scene.yaml', '-mu', '1.3', '-hyco_substeps', '1')
        self.assertGreater(force(one), 1.1 * exact(1.3))
        self.hyco('train', '-scene', 'scene.yaml', '-grid', '3', '-model', 'crept.h5')
        found = self.hyco('predict', '-model', 'crept.h5', '-mu', '1.3')
        self.near(force(found), exact(1.3), 5e-3)
        self.assertLess(found['history']['time_error'], 0.03)
        self.near(force(self.hyco('predict', '-model', 'crept.h5', '-mu', '1.3', '-hyco_substeps', '1')), force(one), 1e-6)
        few = self.hyco('solve', '-scene', 'scene.yaml', '-mu', '1', '-body_bar_rate', '1e-20')
        self.assertEqual(few['history']['substeps'], [1, 1])
        with open(self.path('load.yaml'), 'w', encoding='utf-8') as f:  # a load that goes, and returns reversed: rates are small at both ends of what follows
            f.write('scene: {mesh: mesh.msh, formulation: axisymmetric}\nbody: {bar: {law: norton, young: 1e5, poisson: 0.3, rate: 2e-16, exponent: 4}}\n'
                    'fixed: {side: {x: 0}, low: {y: 0}}\npressure: {high: 300*q}\n'
                    'history: {times: [0, 100, 150, 400, 1000], tables: {q: [[0, 0], [100, 1], [400, 1], [500, -0.5], [1000, -0.5]]}}\n')
        default, fine = (self.hyco('solve', '-scene', 'load.yaml', *more)['history'] for more in ((), ('-hyco_substeps', '200', '-hyco_step_inelastic', '1')))
        self.near(default['inelastic'][-1], fine['inelastic'][-1], 1e-2)
        unequal = [self.hyco('solve', '-scene', 'scene.yaml', '-mu', '1.3', '-history_times', '0,1,901,902,1000', *one)['history']['substeps']
                   for one in (('-hyco_substeps', '1'), ())]
        self.assertEqual(unequal[0], [1] * 5)
        self.assertGreater(unequal[1][2], 5)

    def test_gradient_of_default_steps(self):
        """With steps by their error, derivatives at each listed time are those of the path with these steps, and near central differences of paths whose steps
        change with the parameter, by the error in time."""
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 1, 2), np.linspace(0, 4, 3)], lambda x: x, 'bar', {'x0': 'side', 'y0': 'low', 'y1': 'high'})
        self.written('scene: {mesh: mesh.msh, parameters: [c], formulation: axisymmetric}\nparameter: {c: {range: [0.5, 2]}}\n'
                     'body: {bar: {law: norton, young: 1e5, poisson: 0.3, rate: 1e-17*c, exponent: 5}}\n'
                     'fixed: {side: {x: 0}, low: {y: 0}, high: {y: 0.008}}\nhistory: {times: [0, 10, 1000]}\noutput: {N: {reaction: y, group: high}}\n', grid)
        found = self.hyco('solve', '-scene', 'scene.yaml', '-mu', '1.3', '-gradient')
        low, high = (self.hyco('solve', '-scene', 'scene.yaml', '-mu', c)['history'] for c in ('1.29', '1.31'))
        for k in (1, 2):
            self.near(found['gradient_times']['N']['c'][k], (high['outputs']['N'][k] - low['outputs']['N'][k]) / 0.02, 2e-2, k)

    def ring(self, name, *args, **options):
        """The report and the series of the ring, on a coarse history."""
        report = self.hyco('solve', '-scene', RING, '-mu', '0.01,1', '-history_times', '0,1,3,8', '-body_ring_exponent', '4',
                           '-body_ring_rate', '1e-12', '-output', self.path(name + '.xdmf'), *args, **options)
        return report, arrays(self.path(name + '.h5'))

    def alike(self, a, b, relative):
        self.assertEqual(a.keys(), b.keys())
        for name in a:  # a gap is NaN where there is no contact
            np.testing.assert_array_equal(np.isnan(a[name]), np.isnan(b[name]), name)
        a, b = ({name: np.nan_to_num(value) for name, value in x.items()} for x in (a, b))
        for name, value in a.items():
            size = max(abs(v).max(initial=0) for n, v in a.items() if n.split('/')[-1] == name.split('/')[-1])
            self.assertLessEqual(abs(value - b[name]).max(initial=0), relative * max(size, 1e-3), name)

    def elastic(self, times='0,0.5,1', tables='0 0.2,1 1'):
        """The pellet, elastic, its loads times the table q."""
        with open(os.path.join(PELLET, 'scene.yaml'), encoding='utf-8') as f:
            text = f.read().replace('*load', '*load*q').replace('mesh: A.msh', f'mesh: {PELLET}/A.msh')
        with open(self.path('pellet.yaml'), 'w', encoding='utf-8') as f:
            f.write(text)
        return ['solve', '-scene', self.path('pellet.yaml'), '-history_times', times, '-history_tables_q', tables]

    def test_elastic_path(self):
        """Without inelastic laws each time's solution is that of a scene with its loads."""
        report = self.hyco(*self.elastic(), '-mu', '4.06,1')
        for q, force in zip((0.2, 0.6, 1), report['history']['total_contact_force']):
            alone = self.hyco('solve', '-scene', PELLET, '-mu', f'4.06,{q}')
            self.assertAlmostEqual(force, alone['total_contact_force'], delta=1e-9 * (1 + abs(force)))
        self.near(report['strain_energy'], alone['strain_energy'], 1e-9)
        self.assertEqual(report['history']['factors'], [1, 0, 0])
        self.assertLess(max(report['history']['energy_defect']), 1e-10)

    def test_ring(self):
        """Either iteration, any number of ranks: the same result; the tangent's converge quadratically, the other keeps its factor."""
        tangent, fields = self.ring('tangent', '-hyco_newton', 'tangent')
        self.assertGreaterEqual(tangent['history']['newton_order'], 1.8)
        self.assertLessEqual(max(tangent['history']['most_iterations']), 4)
        report, others = self.ring('elastic', '-hyco_newton', 'elastic', '-hyco_newton_rtol', '1e-12')
        self.alike(fields, others, 1e-8)
        self.assertEqual(sum(report['history']['factors']), 1)
        self.well(report, tangent)
        report, others_too = self.ring('modified', '-hyco_newton', 'modified', '-hyco_newton_rtol', '1e-12')
        self.alike(fields, others_too, 1e-8)
        self.well(report, tangent)
        self.assertLess(sum(report['history']['factors']), sum(tangent['history']['factors']) / 2)
        for kind, all_alone in (('tangent', fields), ('elastic', others)):
            for ranks in (2, 4):
                report, same = self.ring('ranks', '-hyco_newton', kind, '-hyco_newton_rtol', '1e-12', ranks=ranks)
                self.alike(all_alone, same, 1e-9)
                self.well(report, tangent)

    def well(self, report, reference):
        history = report['history']
        self.assertLess(max(history['kkt_max']), 1e-8)
        self.assertLess(max(history['energy_defect']), 1e-8)
        self.near(history['total_contact_force'][-1], reference['history']['total_contact_force'][-1], 1e-9)

    def test_names(self):
        """The time is t; a table or a parameter may be T, as temperatures are, and is not the time."""
        with open(os.path.join(RING, 'scene.yaml'), encoding='utf-8') as f:
            text = f.read().replace('ring.msh', os.path.join(RING, 'ring.msh'))
        text = text.replace('2e-6*creep', '2e-6*creep*heat').replace('times: [', 'tables: {heat: [[0, 1], [20, 2]]}\n  times: [')
        found = []
        for old, new in (('heat', 'heat'), ('heat', 'T'), ('creep', 'T')):
            scene = self.changed('names.yaml', re.sub(rf'\b{old}\b', new, text), [])
            found.append(self.hyco('solve', '-scene', scene, '-mu', '0.01,1', '-history_times', '0,1,3')['history']['total_contact_force'])
        self.assertEqual(found[1:], found[:1] * 2)
        scene = self.changed('names.yaml', text, [('heat', 't')])
        self.assertIn('t is already the name of the time', self.run_raw('solve', '-scene', scene, '-mu', '0.01,1').stderr)

    def test_rod_on_ranks(self):
        """The ramp in 3D, pellet A, to its top: 2 and 4 ranks against 1."""
        args = ['solve', '-scene', os.path.join(SOURCE, 'examples', 'rod', '3d.yaml'), '-mu', '0.05,40,1', '-hyco_newton_rtol', '1e-12',
                '-history_times', '0,1,3000,10001,10001.03333', '-hyco_step_inelastic', '1e-2', '-output', self.path('rod.xdmf')]
        found = []
        for ranks in (0, 2, 4):
            report = self.hyco(*args, ranks=ranks)
            self.assertGreater(report['n_active'], 100)
            found.append((report, arrays(self.path('rod.h5'))))
        for report, fields in found[1:]:
            self.alike(found[0][1], fields, 1e-9)
            self.near(report['total_contact_force'], found[0][0]['total_contact_force'], 1e-9)

    def test_series_and_table(self):
        """The series of fields of a path and its table have the report's numbers."""
        report, fields = self.ring('series', '-table', self.path('t.csv'), '-output_mises_max', 'sigma_xx')
        grids = ET.parse(self.path('series.xdmf')).getroot().findall('.//Grid[@CollectionType="Temporal"]/Grid')
        self.assertEqual([float(g.find('Time').get('Value')) for g in grids], [0, 1, 3, 8])
        names = {a.get('Name') for a in grids[-1].findall('Attribute')}
        self.assertLessEqual({'displacement', 'stress', 'mises', 'inelastic', 'contact_pressure', 'gap'}, names)
        for item in grids[-1].iter('DataItem'):
            file, place = item.text.split(':/')
            with h5py.File(self.path(file)) as f:
                self.assertEqual(list(f[place].shape), [int(n) for n in item.get('Dimensions').split()])
        with open(self.path('t.csv'), encoding='utf-8') as f:
            rows = list(csv.DictReader(f))
        self.assertEqual([float(r['t']) for r in rows], [0, 1, 3, 8])
        self.near(float(rows[-1]['mises']), report['history']['mises'][-1], 1e-6)  # an output of the same name has a column of its own
        self.near(float(rows[-1]['output.mises']), report['history']['outputs']['mises'][-1], 1e-6)
        self.assertAlmostEqual(float(rows[-1]['total_contact_force']), report['total_contact_force'], places=5)
        self.near(fields['step-0003/cells/inelastic'].max(), report['history']['inelastic'][-1], 1e-12)

    def test_resume(self):
        """A killed run continues from its last step, also on another number of ranks, and ends as if it had not been interrupted."""
        args = ['-scene', RING, '-mu', '0.01,1', '-history_times', ','.join(str(k / 20) for k in range(161)), '-hyco_newton', 'tangent']
        whole = self.hyco('solve', *args, '-output', self.path('whole.xdmf'))
        keep = ['-hyco_checkpoint', self.path('c.h5'), '-output', self.path('parts.xdmf')]
        run = subprocess.Popen([HYCO, 'solve', *args, *keep], stdout=subprocess.PIPE, text=True)
        for _ in range(30):
            run.stdout.readline()
        run.send_signal(signal.SIGKILL)
        self.assertEqual(run.wait(), -signal.SIGKILL, 'it had ended before')
        run.stdout.close()
        self.assertFalse(os.path.exists(self.path('parts.h5')))
        begin = time.time()
        rest = self.hyco('solve', *args, *keep, '-hyco_resume', ranks=2)
        self.assertLess(time.time() - begin, 100 * PATIENCE)
        for column in ('t', 'total_contact_force', 'inelastic', 'stored', 'dissipated', 'iterations'):
            a, b = np.array(whole['history'][column]), np.array(rest['history'][column])
            self.assertLessEqual(abs(a - b).max(), 1e-9 * abs(a).max() if column != 'iterations' else 2, column)
        self.alike(arrays(self.path('whole.h5')), arrays(self.path('parts.h5')), 1e-9)
        again = self.hyco('solve', *args, *keep, '-hyco_resume')
        self.assertEqual(again['history']['total_contact_force'], rest['history']['total_contact_force'])

    def test_resume_is_exact(self):
        """On as many ranks the rest is equal to 1e-12, and the steps are those of the whole path."""
        args = ['-scene', RING, '-mu', '0.01,1', '-history_times', '0,0.5,1,1.5,2,3,4', '-hyco_substeps', '8', '-output_most_max', 'mises']
        whole = self.hyco('solve', *args, '-hyco_checkpoint', self.path('whole.h5'))
        keep = ['-hyco_checkpoint', self.path('e.h5')]
        run = subprocess.Popen([HYCO, 'solve', *args, *keep], stdout=subprocess.PIPE, text=True)
        for _ in range(3):
            run.stdout.readline()
        run.send_signal(signal.SIGKILL)
        self.assertEqual(run.wait(), -signal.SIGKILL, 'it had ended before')
        run.stdout.close()
        rest = self.hyco('solve', *args, *keep, '-hyco_resume')
        with h5py.File(self.path('whole.h5'), 'r') as a, h5py.File(self.path('e.h5'), 'r') as b:
            self.assertGreater(len(a['taken']), 7 * 8 - 8)
            np.testing.assert_allclose(b['taken'][...], a['taken'][...], rtol=1e-12)
        for column in ('total_contact_force', 'inelastic', 'mises', 'stored', 'dissipated'):
            self.assertLessEqual(abs(np.array(whole['history'][column]) - rest['history'][column]).max(),
                                 1e-12 * max(abs(v) for v in whole['history'][column]), column)
        self.assertEqual(len(rest['history']['outputs']['most']), 7)
        np.testing.assert_allclose(rest['history']['outputs']['most'], whole['history']['outputs']['most'], rtol=1e-12)
        other = self.run_raw('solve', *args[:-2], '-output_least_min', 'mises', *keep, '-hyco_resume')
        self.assertEqual(other.returncode, 1)
        self.assertRegex(other.stderr, 'e.h5 belongs to another scene')

    def test_rod(self):
        """The power ramp on a slice: two to four iterations a step, quadratic; the gap closes, the ramp presses, the hold relaxes; at zero power it is open."""
        report = self.hyco('solve', '-scene', os.path.join(SOURCE, 'examples', 'rod'), '-mu', '0.05,40,1', '-hyco_newton', 'tangent')
        h = report['history']
        self.assertTrue(h['ended'])
        self.assertLessEqual(max(h['most_iterations']), 4)
        self.assertGreater(h['newton_order'], 1.8)
        self.assertLess(max(h['kkt_max']), 1e-8)
        self.assertLess(max(h['energy_defect']), 1e-8)
        force = dict(zip(h['t'], h['total_contact_force']))
        self.assertEqual(force[1000], 0)
        self.assertGreater(force[10001], 0)
        self.assertGreater(force[10001.03333], 5 * force[10001])
        self.assertLess(force[10025.03333], 0.95 * force[10001.03333])
        self.assertEqual(force[10025.53333], 0)

    def test_ends_early(self):
        """A limit load: the last accepted state is written, and the run fails."""
        self.write_bar()
        run = self.run_raw('solve', '-scene', self.path('bar.yaml'), '-output', self.path('bar.xdmf'), '-table', self.path('bar.csv'))
        self.assertEqual(run.returncode, 1, run.stderr)
        self.assertIn('the history ends at t = ', run.stderr)
        self.assertEqual(len(run.stderr.splitlines()), 1)
        with open(self.path('bar.csv'), encoding='utf-8') as f:
            last = [float(r['t']) for r in csv.DictReader(f)][-1]
        with h5py.File(self.path('bar.h5')) as f:
            self.assertAlmostEqual(f['t'][-1, 0], last, places=6)
        self.assertGreater(last, 0.9)
        self.assertLess(last, 1.0001)  # plane strain, free sides: 2/sqrt(3) of the yield stress, reached at t = 1

    def write_bar(self):
        from grids import Grid
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 1, 3), np.linspace(0, 1, 3)], lambda x: x, 'bar', {'x0': 'left', 'y0': 'foot', 'x1': 'pull'})
        grid.write(self.path('bar.msh'))
        with open(self.path('bar.yaml'), 'w', encoding='utf-8') as f:
            f.write('scene: {title: bar, mesh: bar.msh}\nbody: {bar: {law: j2, young: 1000, poisson: 0.3, yield: 1}}\n'
                    'fixed: {left: {x: 0}, foot: {y: 0}}\ntraction: {pull: {x: 2/sqrt(3)*t}}\nhistory: {times: [0, 0.5, 2]}\n')


if __name__ == '__main__':
    unittest.main()
