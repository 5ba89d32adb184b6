"""The Python package: scenes, full order, training and predictions equal the command's; errors are exceptions with hyco's line, and the process goes on."""
import csv
import os
import subprocess
import sys
import unittest

import numpy as np

from common import HYCO, MPIRUN, PATIENCE, PELLET, SOURCE, Case, said

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import Grid  # noqa: E402

MODEL = os.path.join(SOURCE, 'tests', 'data', 'rope-hybrid-4-table.h5')
PACKAGE = os.path.join(os.path.dirname(HYCO), 'python')
BLOCK = """scene: {title: block, mesh: block.msh, parameters: [press, modulus]}
parameter: {press: {range: [0.02, 0.05]}, modulus: {range: [500, 2000]}}
body: {block: {young: modulus, poisson: 0.3}}
fixed: {left: {x: 0}, foot: {y: 0}}
contact: {punch: {type: obstacle, group: top, normal: {y: 1}, gap: "0.02*(x - 0.3)^2 - press"}}
output: {lift: {force: y, contact: punch}, wide: {max: u_x}}
"""
BAR = """scene: {title: bar, mesh: block.msh, parameters: [pull]}
parameter: {pull: {range: [0.5, 1]}}
body: {block: {law: j2, young: 1000, poisson: 0.3, yield: 1, hardening: 10}}
fixed: {left: {x: 0}, foot: {y: 0}}
traction: {right: {x: 1.3*pull*t}}
history: {times: [0, 0.5, 1]}
output: {long: {mean: u_x, group: right}, work: {mean: u_y, group: top, path: absolute}}
"""
RANKS = r"""
import sys
import hyco, numpy as np
with hyco.Scene(sys.argv[1]) as scene:
    s = scene.solve([0.03, 900])
    points = np.stack(np.meshgrid(np.linspace(0.02, 0.05, 5), np.linspace(500, 2000, 3), indexing='ij'), -1)
    with scene.train(sys.argv[2], grid=[3, 3]) as model:
        p = model.predict(points, contact_forces=True, displacement=True)
        one = model.predict([0.03, 900])
    try:
        scene.solve([9, 900])
    except hyco.Error as error:
        sys.stdout.write(f'refused {hyco.rank()} {error}\n')
        sys.stdout.flush()
    again = scene.solve([0.03, 900])
same = again.outputs == s.outputs and p.outputs['lift'].shape == (5, 3)
sums = [s.outputs['lift'], s.balance < 1e-9, p.outputs['lift'].sum(), p.contact_forces.sum(), np.abs(p.displacement).sum(), one.outputs['lift'], float(same)]
sys.stdout.write('sums ' + ' '.join(repr(float(x)) for x in sums) + '\n')
sys.stdout.flush()
mine = hyco.Model(sys.argv[2]).predict(np.full((4 + hyco.rank(), 2), [0.03 + 0.01 * hyco.rank(), 900]))
alone = [hyco.Model(sys.argv[2]).predict(x).outputs['lift'] for x in mine.mu]
np.testing.assert_allclose(mine.outputs['lift'], alone, rtol=1e-9)
try:
    hyco.Model(sys.argv[2]).predict([[0.03, 900], [0.03 + 9 * hyco.rank(), 900]])
    sys.stdout.write('own accepted\n')
except ValueError as error:
    sys.stdout.write('own points[1]\n' if 'points[1]' in str(error) else str(error))
sys.stdout.flush()
for n in range(2 if sys.argv[3:] else 0):
    try:
        with hyco.Scene(sys.argv[1]) as scene:
            scene.solve([0.03, 900])
            if hyco.rank() == 0 or not n:
                raise RuntimeError('one process alone' if n else 'all')
            scene.solve([0.03, 900])  # waits for the other
    except RuntimeError as error:
        if 'alone' in str(error):
            raise
"""


@unittest.skipIf(os.environ.get('HYCO_SANITIZE') == '1', 'the interpreter would need the sanitizers')
class Python(Case):
    newcomer = True

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 1, 9), np.linspace(0, 1, 5)], lambda x: x, 'block', {'x0': 'left', 'y0': 'foot', 'y1': 'top', 'x1': 'right'})
        grid.write(cls.path('block.msh'))
        for name, text in (('block', BLOCK), ('bar', BAR)):
            with open(cls.path(name + '.yaml'), 'w', encoding='ascii') as file:
                file.write(text)
        sys.path.insert(0, PACKAGE)
        os.chdir(cls.folder)
        import hyco  # pylint: disable=import-outside-toplevel
        cls.hyco_py = hyco

    def test_layouts(self):
        """The layouts that the library gives cover its structs: no member is left out, none overlaps another."""
        from hyco import _library as c  # pylint: disable=import-outside-toplevel
        c.begin()
        for name in ('HycoSummary', 'HycoStep', 'HycoHistory', 'HycoReaction', 'HycoContactResult', 'HycoPrediction', 'HycoGradient'):
            size, members = c.layout(name)
            at = 0
            for member, (kind, offset, _) in members.items():
                self.assertLess(offset - at, min(8, kind.base.alignment) if offset > at else 1, f'{name}: something before {member}')
                self.assertGreaterEqual(offset, at, f'{name}: {member}')
                at = offset + kind.itemsize
            self.assertLess(size - at, 8, f'{name}: something after {member}')

    def test_full_order(self):
        """Solutions have the numbers of the command's report; arrays have their shapes and balance."""
        report = self.hyco('solve', '-scene', 'block.yaml', '-mu', '0.03,900')
        with self.hyco_py.Scene('block.yaml') as scene:
            self.assertEqual(scene.parameters, {'press': (0.02, 0.05), 'modulus': (500.0, 2000.0)})
            self.assertEqual((scene.outputs, scene.contacts, len(scene.times)), (['lift', 'wide'], ['punch'], 0))
            s = scene.solve([0.03, 900])
            by_name = scene.solve({'modulus': 900, 'press': 0.03})
            scene.write('solution.xdmf')
        self.assertTrue(s.converged and os.path.exists('solution.h5'))
        self.near(s.total_contact_force, report['total_contact_force'], 1e-12)
        for name in scene.outputs:
            self.near(s.outputs[name], report['outputs'][name], 1e-12)
            self.assertEqual(by_name.outputs[name], s.outputs[name])
        self.assertEqual(s.summary['n_active'], report['n_active'])
        self.assertEqual((s.displacement.shape, s.contact_forces.shape, s.stress.shape), ((45, 2), (9,), (32, 4)))
        self.near(s.contact_forces.sum(), s.total_contact_force, 1e-12)
        self.near(s.contacts[0]['force'][1], -s.total_contact_force, 1e-12)
        self.assertEqual(s.contacts[0]['name'], 'punch')
        self.assertIn('foot', [r['group'] for r in s.reactions])
        self.assertLess(s.balance, 1e-9)
        self.assertEqual(s.displacement.shape[0] - np.count_nonzero(s.displacement[:, 1]), 9)  # the foot

    def test_model(self):
        """A training like that of the command; predictions one by one, in batches, by name: the same numbers, those of hyco predict."""
        with self.hyco_py.Scene('block.yaml', hyco_pod_tol=1e-10) as scene:
            model = scene.train('block.h5', grid=[4, 3])
            full = scene.solve([0.031, 1100])
        self.assertGreaterEqual(model.training['held_out.n'], 1)
        report = self.hyco('predict', '-model', 'block.h5', '-mu', '0.031,1100')
        p = model.predict([0.031, 1100], contact_forces=True)
        self.assertEqual(p.shape, ())
        for name in model.outputs:
            self.near(p.outputs[name], report['outputs'][name], 1e-12)
            self.near(p.outputs[name], full.outputs[name], 0.03)
            self.near(p.estimates[name], report['estimated_error_outputs'][name], 1e-9)
        self.near(model.contact_results()[0]['force'][1], report['contacts']['punch']['force'][1], 1e-12)
        self.assertEqual(model.whole_displacement().shape, (45, 2))
        points = np.array([[0.031, 1100], [0.02, 500], [0.05, 2000], [0.031, 700]])
        many = model.predict(points, contact_forces=True, displacement=True)
        self.assertEqual(many.contact_forces.shape, (4, 9))
        self.assertEqual(many.displacement.shape[::2], (4, 2))
        self.near(many.outputs['lift'][0], p.outputs['lift'], 1e-12)
        np.testing.assert_allclose(many.contact_forces[0], p.contact_forces, rtol=1e-12, atol=1e-12)
        square = model.predict(points.reshape(2, 2, 2))
        np.testing.assert_array_equal(square.outputs['lift'], many.outputs['lift'].reshape(2, 2))
        named = model.predict({'modulus': points[:, 1], 'press': points[:, 0]})
        np.testing.assert_array_equal(named.outputs['wide'], many.outputs['wide'])
        self.assertEqual(list(many.table())[:4], ['press', 'modulus', 'lift', 'wide'])
        self.assertTrue(all(len(column) == 4 for column in many.table().values()))
        self.hyco('predict', '-model', 'block.h5', '-values_press', '0.02,0.05', '-values_modulus', '700', '-table', 'block.csv')
        with open('block.csv', encoding='utf-8') as file:
            for row in csv.DictReader(file):
                self.near(model.predict([float(row['press']), float(row['modulus'])]).outputs['lift'], float(row['lift']), 1e-6)
        self.assertEqual(model.predict(np.zeros((0, 2))).outputs['lift'].shape, (0,))
        model.close()
        model.close()
        with self.assertRaisesRegex(self.hyco_py.Error, 'closed'):
            model.predict([0.03, 900])

    def test_gradients(self):
        """Gradients of full order and of a model: the command's numbers as arrays, for one point and for many; the last solution stays."""
        point = ('-mu', '0.031,1100', '-gradient')
        with self.hyco_py.Scene('block.yaml', hyco_model_type='bodies', hyco_validation=0) as scene:
            g = scene.gradient([0.031, 1100])
            report = self.hyco('solve', '-scene', 'block.yaml', *point)
            model = scene.train('slopes.h5', scatter=3)
        self.assertEqual((g.value.shape, g.kink.shape, g.kink.any(), g.undecided), ((2, 2), (2, 2), False, 0))
        for k, output in enumerate(g.outputs):
            self.near(g.outputs[output], report['outputs'][output], 1e-12)
            for j, name in enumerate(scene.parameters):
                self.near(g.value[k, j], report['gradient'][output][name], 1e-9)
                self.assertEqual(g[output][j], g.value[k, j])
        with model:
            report = self.hyco('predict', '-model', 'slopes.h5', *point)
            many = model.gradient([[[0.031, 1100]], [[0.045, 600]]])
            one = model.gradient({'modulus': 1100, 'press': 0.031})
            self.assertEqual((many.value.shape, many.kink.shape, many.undecided.shape, many['lift'].shape), ((2, 1, 2, 2), (2, 1, 2, 2), (2, 1), (2, 1, 2)))
            np.testing.assert_allclose(many.value[0, 0], one.value, rtol=1e-9)
            for output, by in report['gradient'].items():
                np.testing.assert_allclose(one[output], list(by.values()), rtol=1e-9)
            with self.assertRaisesRegex(self.hyco_py.Error, 'knob.*press, modulus'):
                model.predict({'modulus': 1100, 'press': 0.031, 'knob': 1})
            h = [0.03e-4, 1500e-4]
            for j in range(2):
                shift = np.eye(2)[j] * h
                lo, hi = (model.predict(np.array([0.031, 1100]) + s * shift).outputs['lift'] for s in (-1, 1))
                self.near(one['lift'][j], (hi - lo) / (2 * h[j]), 1e-6)

    def test_fit(self):
        """Model.fit() finds what hyco fit finds; wrong targets are one line."""
        with self.hyco_py.Scene('block.yaml', hyco_model_type='bodies', hyco_validation=0) as scene:
            model = scene.train('fitted.h5', scatter=3)
        with model:
            true = [0.034, 900]
            targets = model.predict(true).outputs
            found = model.fit(targets, starts=2, samples=16)
            report = self.hyco('fit', '-model', 'fitted.h5', '-starts', '2', '-fit_starts', '16',
                               *(word for name, value in targets.items() for word in (f'-target_{name}', repr(value))))
            self.assertEqual((found.converged, found.starts, found.at_least), (report['converged'], report['starts'], report['starts_at_least']))
            self.assertLess(found.misfit, 1e-6)
            for name, value in report['mu'].items():
                self.near(found.parameters[name], value, 1e-6)
            np.testing.assert_allclose(model.predict(found.mu).outputs[list(targets)[0]], list(targets.values())[0], rtol=1e-6)
            names = list(model.parameters)
            held = model.fit({'lift': targets['lift']}, samples=16, hold={names[0]: 0.031})
            self.assertEqual(held.mu[0], 0.031)
            self.near(model.predict(held.mu).outputs['lift'], targets['lift'], 1e-6)
            again = model.fit(targets, start=[0.03, 1000], kind='blmvm')
            self.assertEqual(again.starts, 1)
            self.assertLess(again.misfit, 1e-5)
            for bad in (lambda: model.fit({'nothing': 1}), lambda: model.fit({}), lambda: model.fit({'lift': float('nan')}), lambda: model.fit(targets, kind='newton'),
                        lambda: model.fit(targets, hold={'none': 1}), lambda: model.fit(targets, hold={names[0]: 1e9}), lambda: model.fit(targets, starts=0),
                        lambda: model.fit(targets, samples=1.5), lambda: model.fit({'lift': 'heavy'}), lambda: model.fit({'lift': 1j}), lambda: model.fit(targets, start='abc')):
                with self.assertRaises(self.hyco_py.Error) as error:
                    bad()
                self.assertIsInstance(error.exception, ValueError)
                self.assertEqual(len(str(error.exception).splitlines()), 1)

    def test_paths(self):
        """The listed times of a history, at full order."""
        report = self.hyco('solve', '-scene', 'bar.yaml', '-mu', '0.9', '-table', 'bar.csv')
        with self.hyco_py.Scene('bar.yaml') as scene:
            self.assertEqual(list(scene.times), [0, 0.5, 1])
            s = scene.solve([0.9])
        with open('bar.csv', encoding='utf-8') as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(len(s.history), len(rows))
        for mine, row in zip(s.history, rows):
            self.assertAlmostEqual(mine['t'], float(row['t']), places=12)
            self.assertAlmostEqual(mine['long'], float(row['long']), places=9)
        self.assertGreater(s.history['inelastic'][-1], 1e-4)
        self.near(s.outputs['long'], report['outputs']['long'], 1e-9)
        with self.hyco_py.Scene('bar.yaml', hyco_validation=4) as scene, scene.train('bar.h5', grid=[4]) as model:
            p = model.predict([0.9])
            h = model.history()
            self.assertEqual(list(h['t']), [0, 0.5, 1])
            self.near(h['long'][-1], s.outputs['long'], 0.02)
            self.near(p.outputs['long'], h['long'][-1], 1e-12)
            self.near(model.predict([[0.7], [0.9]]).outputs['long'][1], p.outputs['long'], 1e-9)
            g = model.gradient([[0.7], [0.9]])
            self.assertEqual((g.value.shape, g.times.shape, g.path.shape), ((2, 2, 1), (2, 3, 2, 1), (2, 2, 1)))
            self.assertLess(h['work'][-1], -1e-3)  # the output, not HycoStep's member; the largest size over the path, not the largest value
            np.testing.assert_allclose([p.path['long'], p.path['work']], [h['long'][-1], h['work'][-1]], rtol=1e-9)
            self.assertEqual(model.predict([[0.7], [0.9]]).table()['path_work'][1], p.path['work'])
            np.testing.assert_array_equal(g.times[:, -1], g.value)
            np.testing.assert_allclose(g.path, g.value, rtol=1e-9)  # it is longest at the end
            report = self.hyco('predict', '-model', 'bar.h5', '-mu', '0.9', '-gradient')
            np.testing.assert_allclose(g.times[1, :, 0, 0], report['gradient_times']['long']['pull'], rtol=1e-9)

    def test_threads(self):
        """Threads on one Model or Scene each get their own answers, and their own last prediction; one that has none sees the last of all."""
        import threading  # pylint: disable=import-outside-toplevel
        model, n = self.hyco_py.Model(MODEL), 60
        points = np.linspace([0.06, 0.0], [0.24, 0.45], 3)
        expected, wrong, turn = model.predict(points).total_contact_force, [], threading.Barrier(3)

        def predict(k):
            for _ in range(n):
                if abs(model.predict(points[k]).total_contact_force - expected[k]) > 1e-9 * expected[k]:
                    wrong.append(k)
            turn.wait(60 * PATIENCE)
            if abs(model.whole_displacement() - alone[k]).max() > 0:
                wrong.append(f'displacement of {k}')

        def solve(k):
            for _ in range(3):
                s = scene.solve([0.02 + 0.01 * k, 900])
                if list(s.mu) != [0.02 + 0.01 * k, 900] or abs(s.total_contact_force / loads[k] - 1) > 1e-6:
                    wrong.append(f'solution {k}')

        alone = []
        for point in points:
            model.predict(point)
            alone.append(model.whole_displacement())
        with self.hyco_py.Scene('block.yaml') as scene:
            loads = [scene.solve([0.02 + 0.01 * k, 900]).total_contact_force for k in range(3)]
            for work in (predict, solve):
                workers = [threading.Thread(target=work, args=(k,)) for k in range(3)]
                for worker in workers:
                    worker.start()
                for worker in workers:
                    worker.join()
        self.assertEqual(wrong, [])
        other = self.hyco_py.Model(MODEL)
        worker = threading.Thread(target=other.predict, args=(points[1],))
        worker.start()
        worker.join()
        np.testing.assert_array_equal(other.whole_displacement(), alone[1])
        self.assertEqual(model.predict([0.3, 0.2], extrapolate=True, check=False).shape, ())
        with self.assertRaises(self.hyco_py.Error):
            model.predict([0.3, 0.2])

    def test_kinds_of_errors(self):
        """An Error is also a ValueError or a FileNotFoundError where it means that; of many points it names the wrong one by its number."""
        hyco = self.hyco_py
        with hyco.Model(MODEL) as model, hyco.Scene('block.yaml') as scene:
            for do, kind, words in ((lambda: model.predict([7, 0.17]), ValueError, ['mu1']),
                                    (lambda: model.predict([[0.07, 0.17], [0.1, 0.2], [7, 0.17]]), ValueError, ['points[2]', 'mu1']),
                                    (lambda: model.gradient([[0.07, 0.17], [7, 0.17]]), ValueError, ['points[1]']),
                                    (lambda: model.predict([0.1]), ValueError, ['mu1']), (lambda: model.predict('abc'), ValueError, ['abc']),
                                    (lambda: model.predict([0.07, 0.17 + 1j]), ValueError, ['real']), (lambda: model.predict({'mu1': 'abc', 'mu2': 1}), ValueError, ['abc']),
                                    (lambda: model.predict([[0.1], [0.1, 0.2]]), ValueError, ['0.2']),
                                    (lambda: scene.train('x.h5', grid=[2.5, 3]), ValueError, ['whole']), (lambda: scene.train('x.h5', scatter=0), ValueError, ['0']), (lambda: scene.solve({'press': 1}), ValueError, ['modulus']),
                                    (lambda: scene.train('x.h5', points=[[0.03, 900], [0.03, 9]]), ValueError, ['points[1]', 'modulus']),
                                    (lambda: scene.train('x.h5', grid=[3, 3], validation=[[0.03, 9]]), ValueError, ['validation[0]', 'modulus']),
                                    (lambda: hyco.Scene('block.yaml', hyco_pod_tool=1), ValueError, ['hyco_pod_tol']),
                                    (lambda: hyco.Scene('block.yaml', hyco_pod_tol=9).train('x.h5', grid=[2, 2]), ValueError, ['hyco_pod_tol']),
                                    (lambda: hyco.Scene('block.yaml', scene_mesh='none.msh').solve([0.03, 900]), FileNotFoundError, ['none.msh']),
                                    (lambda: hyco.Scene('none'), FileNotFoundError, ['none']), (lambda: hyco.Model('none.h5'), FileNotFoundError, ['none.h5']),
                                    (lambda: hyco.Model('block.msh'), ValueError, ['block.msh'])):
                with self.assertRaises(kind) as caught:
                    do()
                self.assertIsInstance(caught.exception, hyco.Error)
                for word in words:
                    self.assertIn(word, str(caught.exception))

    def test_shown_and_pickled(self):
        """Objects say what they are; a model is pickled with its contents, results and exceptions as they are."""
        import pickle  # pylint: disable=import-outside-toplevel
        hyco, name = self.hyco_py, 'pickled.h5'
        with open(MODEL, 'rb') as file, open(name, 'wb') as copy:
            copy.write(file.read())
        with hyco.Scene('block.yaml') as scene, hyco.Model(name) as model:
            solution, one, many = scene.solve([0.03, 900]), model.predict([0.07, 0.17]), model.predict([[0.07, 0.17], [0.1, 0.2]])
            for thing, words in ((scene, ['Scene', 'block.yaml', 'press', 'lift']), (model, ['Model', name, model.type, 'mu1']),
                                 (solution, ['Solution', 'press 0.03', 'lift', 'converged']), (one, ['Prediction', 'mu1 0.07', 'converged']),
                                 (many, ['2 points']), (scene.gradient([0.03, 900]), ['Gradient', 'lift'])):
                for word in words:
                    self.assertIn(word, repr(thing))
            model.predict([0.07, 0.17])
            displacement, text = model.whole_displacement(), pickle.dumps(model)
            there = pickle.loads(text)
            os.remove(name)
            elsewhere = pickle.loads(text)
            for other in (there, elsewhere):
                self.assertEqual(other.predict([0.07, 0.17]).total_contact_force, one.total_contact_force)
            np.testing.assert_array_equal(elsewhere.whole_displacement(), displacement)
            self.assertEqual(pickle.loads(pickle.dumps(many)).data.tobytes(), many.data.tobytes())
            np.testing.assert_array_equal(pickle.loads(pickle.dumps(solution)).displacement, solution.displacement)
            with self.assertRaises(OSError):
                pickle.dumps(model)
        error = pickle.loads(pickle.dumps(hyco.NotConverged('line', one)))
        self.assertEqual((str(error), error.result.total_contact_force), ('line', one.total_contact_force))

    def test_errors(self):
        """Each error is an exception with the command's line, nothing is printed, and the same objects work afterwards."""
        program = f"""
import sys
sys.path.insert(0, {PACKAGE!r})
import hyco
def line(do):
    try:
        do()
    except hyco.Error as error:
        print(str(error))
        return
    raise SystemExit('nothing was refused')
scene = hyco.Scene('block.yaml')
before = scene.solve([0.03, 900]).outputs
model = hyco.Model({MODEL!r})
line(lambda: scene.solve([0.3, 900]))
line(lambda: hyco.Scene('nowhere'))
line(lambda: hyco.Model('block.msh'))
line(lambda: hyco.Model('none.h5'))
line(lambda: model.predict([[0.07, 0.17], [7, 0.17]]))
line(lambda: hyco.Scene('block.yaml', hyco_pod_tool=1))
line(lambda: hyco.Scene('block.yaml', bodyy_block_young=1))
line(lambda: scene.solve([0.03]))
line(lambda: scene.solve({{'press': 0.03}}))
line(lambda: scene.train('m.h5', grid=[3]))
line(lambda: scene.train('m.h5', grid=[3, 3], scatter=4))
line(lambda: hyco.Scene('block.yaml', hyco_model_type='hybrit').train('m.h5', grid=[3, 3]))
line(lambda: hyco.Scene('block.yaml', body_block_poisson='0.3*nonsense'))
assert scene.solve([0.03, 900]).outputs == before
print(model.predict([0.07, 0.17]).total_contact_force)
"""
        run = subprocess.run([sys.executable, '-c', program], cwd=self.folder, capture_output=True, text=True, timeout=100 * PATIENCE, check=False)
        self.assertEqual((run.returncode, run.stderr), (0, ''), run.stdout)
        lines = run.stdout.splitlines()
        self.assertEqual(len(lines), 14, run.stdout)
        for line, words in zip(lines, (('press', '0.3', '0.05'), ('nowhere',), ('block.msh',), ('none.h5',), ('mu1', '7'), ('hyco_pod_tool', 'hyco_pod_tol'), ('bodyy_', 'body_'),
                                       ('(1,)', 'press', 'modulus'), ('modulus',), ('1 numbers', '2'), ('one of',), ('hybrit',), ('nonsense',))):
            for word in words:
                self.assertIn(word, line)
        for line, args in ((lines[0], ('solve', '-scene', 'block.yaml', '-mu', '0.3,900')), (lines[3], ('predict', '-model', 'none.h5', '-mu', '0.07,0.17'))):
            self.assertIn(line, ' '.join(said(self.run_raw(*args))))
        self.assertGreater(float(lines[-1]), 0)

    def test_null(self):
        """Every function of the headers with NULL for all arguments, for all but the handle, and for each alone beside valid ones: never a crash.
        Calls out of order neither."""
        import ctypes  # pylint: disable=import-outside-toplevel
        import glob  # pylint: disable=import-outside-toplevel
        import re  # pylint: disable=import-outside-toplevel
        import signal  # pylint: disable=import-outside-toplevel
        from hyco import _library as c  # pylint: disable=import-outside-toplevel
        scene, model = self.hyco_py.Scene('block.yaml'), self.hyco_py.Model(MODEL)
        scene.solve([0.03, 900])
        made = {'HycoScene': scene._open, 'HycoFOM': scene._last, 'HycoROM': model._open}  # pylint: disable=protected-access
        for kind, first in [('Samples', (made['HycoScene'],)), ('Reducer', (c.World.comm, made['HycoScene']))] + [
                (kind, (c.World.comm,)) for kind in ('System', 'Solver', 'Material', 'Contact', 'Cone')]:
            made['Hyco' + kind] = ctypes.c_void_p()
            c.call(f'Hyco{kind}Create', *first, ctypes.byref(made['Hyco' + kind]))
        reals, whole = (ctypes.c_double * 8192)(0.03, 900), (c.integer()[0] * 64)(*[1] * 64)
        lists = {'PetscReal': (ctypes.c_void_p * 64)(*[ctypes.addressof(reals)] * 64), 'char': (ctypes.c_char_p * 64)(*[b'a'] * 64)}
        arrays = {'PetscReal': reals, 'PetscInt': whole, 'char': ctypes.create_string_buffer(b'nothing.xdmf')}
        function = ctypes.CFUNCTYPE(ctypes.c_int)(lambda: 0)

        def valid(argument):
            """What C's declaration takes: a handle, a number, an array with values, or memory for results."""
            kind, depth = argument.replace('const ', '').split()[0], argument.count('*') + argument.count('[')
            if kind == 'MPI_Comm':
                return c.World.comm
            if '(' in argument:
                return function
            if argument.startswith('const ') and depth and kind in made:
                return (ctypes.c_void_p * 64)(*[made[kind].value] * 64)
            if argument.startswith('const ') and depth:
                read = lists if 'const ' in argument[6:] else arrays
                return read[kind] if depth == 1 + (read is lists) and kind in read else ctypes.create_string_buffer(1 << 16)
            return ctypes.create_string_buffer(1 << 16) if depth else made.get(kind, ctypes.c_double(0.03) if kind == 'PetscReal' else ctypes.c_longlong(2 if kind == 'PetscInt' else 0))

        def survive(*calls):
            """In a process of its own."""
            child = os.fork()
            if not child:
                os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
                os.dup2(1, 2)
                signal.alarm(100 * PATIENCE)
                c.lib.HycoKeepErrors(1)
                for name, values in calls:
                    getattr(c.lib, name)(*values)
                os._exit(0)
            return os.WIFEXITED(os.waitpid(child, 0)[1])

        crashed, tried, null = [], 0, ctypes.c_void_p()
        for path in glob.glob(os.path.join(SOURCE, 'include', 'hyco*.h')):
            with open(path, encoding='utf-8') as file:
                text = re.sub(r'/\*.*?\*/', '', file.read(), flags=re.S)
            for name, arguments in re.findall(r'\n(?!static|typedef|extern|#)(?:const )?\w+ \*?(Hyco\w+)\(((?:[^;{()]|\(\*\w*\)\([^()]*\))*)\)[^;{]*;', text):
                arguments = re.sub(r'\w+ \(\*(\w+)\)\([^()]*\)', r'(\1)', ' '.join(arguments.split())).split(', ')
                addresses = [k for k, argument in enumerate(arguments) if re.search(r'[*\[(]|^Hyco', argument)]
                if name.endswith('_Private') or not hasattr(c.lib, name) or not addresses or arguments[-1] == '...':
                    continue
                tried += 1
                given = [valid(argument) for argument in arguments]
                sets = [addresses, [k for k in addresses if arguments[k].split()[0] not in made or '*' in arguments[k]], *([k] for k in addresses)]
                calls = [(name, [null if k in without else value for k, value in enumerate(given)]) for without in sets]
                crashed += [] if survive(*calls) else [name]
        self.assertEqual(crashed, [])
        self.assertGreater(tried, 280)
        fom, name, two = made['HycoFOM'], b'q.xdmf', c.count(2)
        orders = [[('HycoFOMWriteBegin', (fom, name, two)), ('HycoFOMWriteEnd', (fom,))],
                  [('HycoFOMWriteBegin', (fom, name, two)), ('HycoFOMWriteAdd', (fom,)), ('HycoFOMWriteBegin', (fom, name, two))],
                  [('HycoFOMWriteBegin', (fom, name, c.count(0)))], [('HycoROMWriteMany', (made['HycoROM'], c.count(0), two, reals, name))],
                  [('HycoFOMSolveForces', (fom, two, reals, None))], [('HycoROMSetSolution', (model._open, reals, reals, reals))],  # pylint: disable=protected-access
                  [('HycoMaterialUpdate', (made['HycoMaterial'], ctypes.create_string_buffer(4096)))],
                  [('HycoSamplesAddProduct', (made['HycoSamples'], whole, (ctypes.c_void_p * 2)()))],
                  [('HycoSamplesOutsideTraining', (made['HycoSamples'], c.count(-4), c.count(-4), c.count(1), None, ctypes.byref(null)))]]
        for calls in orders:
            self.assertTrue(survive(*calls), calls)
            for call in calls[:-1]:
                c.call(*call[:1], *call[1])
            with self.assertRaises(self.hyco_py.Error):
                c.call(calls[-1][0], *calls[-1][1])
            if len(calls) > 1:
                c.lib.HycoKeepErrors(1)
                c.lib.HycoFOMWriteEnd(fom)
                c.lib.HycoKeepErrors(0)

    def test_views_and_options(self):
        """Views go to standard output without a viewer, and where an option of the caller's name says, with the object's prefix; options that a program
        sets after it has loaded a scene count."""
        import ctypes  # pylint: disable=import-outside-toplevel
        from hyco import _library as c  # pylint: disable=import-outside-toplevel
        hyco, seen = self.hyco_py, self.path('seen.txt')
        with hyco.Scene('block.yaml') as scene, hyco.Model(MODEL) as model:
            scene.solve([0.03, 900])
            reducer, solver = ctypes.c_void_p(), ctypes.c_void_p()
            c.call('HycoReducerCreate', c.World.comm, scene._open, ctypes.byref(reducer))  # pylint: disable=protected-access
            c.call('HycoFOMGetSolver', scene._last, ctypes.byref(solver))  # pylint: disable=protected-access
            for kind, handle in (('Scene', scene._open), ('ROM', model._open), ('FOM', scene._last), ('Solver', solver), ('Reducer', reducer)):  # pylint: disable=protected-access
                for prefix in (b'', b'mine_'):
                    c.call('PetscObjectSetOptionsPrefix', handle, prefix)
                    option = b'-' + prefix + b'my_view'
                    c.call('PetscOptionsSetValue', None, option, b'ascii:seen.txt')
                    c.call(f'Hyco{kind}ViewFromOptions', handle, None, b'-my_view')
                    c.call('PetscOptionsClearValue', None, option)
                    self.assertGreater(os.path.getsize(seen), 20, (kind, prefix))
                    os.remove(seen)
                c.call('PetscObjectSetOptionsPrefix', handle, None)
            c.call('HycoReducerSetFromOptions', reducer)
            for name, value in (('ModelType', b'hybrid'), ('PODTolerance', ctypes.c_double(1e-4)), ('RIDLayers', c.count(2))):
                c.call('HycoReducerSet' + name, reducer, value)
            c.call('HycoReducerSetFromOptions', reducer)
            samples, report = ctypes.c_void_p(), np.zeros(1, c.struct('HycoTraining'))
            c.call('HycoSamplesCreate', scene._open, ctypes.byref(samples))  # pylint: disable=protected-access
            c.call('HycoSamplesAddTrainingGrid', samples, c.address(np.array([3, 2], c.integer()[1])))
            c.call('HycoReducerSetValidationCount', reducer, c.count(0))
            c.call('HycoReducerRun', reducer, samples, b'set.h5', c.address(report))
            self.assertEqual(hyco.Model('set.h5').type, 'hybrid')
            for handle, kind in ((samples, 'Samples'), (reducer, 'Reducer')):
                c.call(f'Hyco{kind}Destroy', ctypes.byref(handle))
            with self.assertRaises(ValueError):
                hyco.Scene('block.yaml', hyco_mumps_icntl_99=1)
        with hyco.Scene('block.yaml') as scene:
            c.call('PetscOptionsSetValue', None, b'-hyco_solver_max_its', b'1')
            for name, value in ((b'-hyco_solver_fallback', b'0'), (b'-hyco_solver_warm_start', b'0')):
                c.call('PetscOptionsSetValue', None, name, value)
            self.assertFalse(scene.solve([0.05, 900], check=False).converged)
            for name in (b'-hyco_solver_max_its', b'-hyco_solver_fallback', b'-hyco_solver_warm_start'):
                c.call('PetscOptionsClearValue', None, name)
        with hyco.Scene('block.yaml', hyco_mumps_icntl_14=90) as scene:
            self.assertTrue(scene.solve([0.05, 900]).converged)

    def test_not_converged(self):
        """A solve that does not converge is an exception with the result, or with check=False a result that says so."""
        hyco = self.hyco_py
        with hyco.Scene('block.yaml', hyco_solver_max_its=1, hyco_solver_fallback=False, hyco_solver_warm_start=False) as scene:
            with self.assertRaisesRegex(hyco.NotConverged, 'press 0.05, modulus 900: not converged') as caught:
                scene.solve([0.05, 900])
            s = scene.solve([0.05, 900], check=False)
            self.assertEqual((caught.exception.result.converged, s.converged), (False, False))
            self.assertIn('not converged', s.reason)
        with hyco.Model(MODEL) as model:
            p = model.predict([[0.07, 0.17], [0.1, 0.2]])
            self.assertEqual((list(p.converged), list(p.reason)), ([True, True], ['converged', 'converged']))

    def test_interrupted(self):
        """An exception in the progress function, Ctrl-C among them, ends a training; later calls work."""
        def stop(done, n):
            raise KeyboardInterrupt
        with self.hyco_py.Scene(PELLET) as scene:
            with self.assertRaises(KeyboardInterrupt):
                scene.train('stopped.h5', grid=[3, 2], progress=stop)
            self.assertFalse(os.path.exists('stopped.h5'))
            self.assertTrue(scene.solve([4.06, 0.5]).converged)

    def test_ctrl_c(self):
        """Ctrl-C during a training, a batch and a path is a KeyboardInterrupt between two solves; a handler that returns lets the call go on;
        solutions are kept, and the same objects work afterwards."""
        import signal  # pylint: disable=import-outside-toplevel
        hyco, pid, seen = self.hyco_py, os.getpid(), []

        def asked(do, handler=signal.default_int_handler):
            """The signal comes before the library's first solve of the call."""
            from hyco import _library as c  # pylint: disable=import-outside-toplevel
            before, begin = signal.signal(signal.SIGINT, handler), c.lib.HycoInterruptBegin

            def sent(ask):
                begin(ask)
                if not seen:
                    os.kill(pid, signal.SIGINT)
                    seen.append(1)
            c.lib.HycoInterruptBegin = sent
            try:
                seen.clear()
                return do()
            finally:
                c.lib.HycoInterruptBegin = begin
                signal.signal(signal.SIGINT, before)

        points, told = [[0.07, 0.17]] * 50, []
        with hyco.Model(MODEL) as model, hyco.Scene('bar.yaml') as path, hyco.Scene('block.yaml', hyco_validation=0, hyco_model_type='hybrid') as scene:
            for do in (lambda: model.predict(points), lambda: model.predict(points[0]), lambda: path.solve([0.9])):
                with self.assertRaises(KeyboardInterrupt):
                    asked(do)
            self.assertEqual(asked(lambda: model.predict(points), lambda *_: told.append(1)).shape, (50,))
            self.assertEqual(told, [1])

            def later(done, n):
                if done == 2:
                    os.kill(pid, signal.SIGINT)
            before = signal.signal(signal.SIGINT, signal.default_int_handler)
            with self.assertRaises(KeyboardInterrupt):
                scene.train('cut.h5', grid=[3, 3], progress=later)
            signal.signal(signal.SIGINT, before)
            self.assertFalse(os.path.exists('cut.h5'))
            self.assertEqual(len([name for name in os.listdir('cut.h5.snapshots') if name.endswith('.h5')]), 2)
            self.assertEqual(scene.train('cut.h5', grid=[3, 3]).predict([[0.03, 900]]).shape, (1,))
            self.assertTrue(path.solve([0.9]).converged)

    def test_blas_threads(self):
        """BLAS, which NumPy may share, has one thread in a call and its own number after it; a variable that chooses the number counts."""
        program = self.path('threads.py')
        with open(program, 'w', encoding='ascii') as file:
            file.write("""import sys
import hyco
from hyco._library import lib
lib.openblas_set_num_threads(2)
if lib.openblas_get_num_threads() != 2:
    raise SystemExit('without threads')
seen = set()
with hyco.Scene('block.yaml') as scene:
    scene.train(sys.argv[1], grid=[2, 2], progress=lambda done, n: seen.add(lib.openblas_get_num_threads())).close()
print(seen, lib.openblas_get_num_threads())
""")
        chosen = {name: value for name, value in os.environ.items() if 'NUM_THREADS' not in name}
        for k, (more, want) in enumerate((({}, '{1} 2'), ({'OMP_NUM_THREADS': '2'}, '{2} 2'))):
            run = subprocess.run([sys.executable, program, f'threads{k}.h5'], cwd=self.folder, capture_output=True, text=True, timeout=100 * PATIENCE, check=False,
                                 env={**chosen, **more, 'PYTHONPATH': PACKAGE})
            if 'AttributeError' in run.stderr or 'without threads' in run.stderr:
                self.skipTest('the BLAS here is not OpenBLAS with threads')
            self.assertEqual((run.returncode, run.stdout.strip()), (0, want), run.stderr)

    def test_kernels(self):
        """An OpenBLAS older than the processor uses its oldest kernels, until hyco selects newer ones; those that the environment names stay."""
        program = """import ctypes
from hyco._library import begin, lib
lib.openblas_get_corename.restype = ctypes.c_char_p
print(lib.openblas_get_corename().decode())
begin()
print(lib.openblas_get_corename().decode())"""
        names = {}
        for chosen in ('', 'Prescott'):
            env = {name: value for name, value in os.environ.items() if name != 'OPENBLAS_CORETYPE'}
            run = subprocess.run([sys.executable, '-c', program], cwd=self.folder, capture_output=True, text=True, timeout=100 * PATIENCE, check=False,
                                 env={**env, **({'OPENBLAS_CORETYPE': chosen} if chosen else {}), 'PYTHONPATH': PACKAGE})
            if 'AttributeError' in run.stderr:
                self.skipTest('the BLAS here is not OpenBLAS')
            names[chosen] = run.stdout.split()
        with open('/proc/cpuinfo', encoding='utf-8') as file:
            new = 'avx2' in file.read()
        self.assertEqual(names['Prescott'], ['Prescott'] * 2)
        self.assertEqual(names[''][0] == 'Prescott' and new, names[''][0] != names[''][1], names)

    def ranks(self, n, *more, model):
        program = self.path('ranks.py')
        with open(program, 'w', encoding='ascii') as file:
            file.write(RANKS)
        return subprocess.run([*(MPIRUN + [str(n)] if n else []), sys.executable, program, 'block.yaml', model, *more], cwd=self.folder, capture_output=True,
                              text=True, timeout=100 * PATIENCE, check=False, env={**os.environ, 'PYTHONPATH': PACKAGE})

    def test_ranks(self):
        """Under mpiexec every process has the answers of one; errors are on all; points of a process's own are its own, with their errors; an exception
        that nothing catches on one ends all, in a with block too, and one that all catch lets them go on."""
        sums = {}
        for n in (0, 1, 2, 3):
            run = self.ranks(n, model=f'ranks{n}.h5')
            self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
            found = [[float(x) for x in line.split()[1:]] for line in run.stdout.splitlines() if line.startswith('sums')]
            self.assertEqual((len(found), run.stdout.count('refused')), (max(n, 1), max(n, 1)), run.stdout)
            self.assertEqual((run.stdout.count('own accepted'), run.stdout.count('own points[1]')), (1, max(n, 1) - 1), run.stdout)
            for row in found:
                np.testing.assert_allclose(row, found[0], rtol=0)
            sums[n] = found[0]
            np.testing.assert_allclose(sums[n], sums[0], rtol=1e-7 if n else 0, err_msg=f'{n} ranks')
        self.assertEqual(sums[0][-1], 1)
        run = self.ranks(2, 'alone', model='alone.h5')
        self.assertNotEqual(run.returncode, 0)
        self.assertIn('one process alone', run.stderr)

    def test_plain(self):
        """Only NumPy is imported beside Python's own modules; PETSc ends with the process, quietly."""
        program = f"""
import sys
sys.path.insert(0, {PACKAGE!r})
import hyco
model = hyco.Model({MODEL!r})
model.predict([0.07, 0.17])
print(sorted({{name.split('.')[0] for name in sys.modules}} & {{'mpi4py', 'petsc4py', 'scipy', 'h5py', 'pandas'}}))
"""
        run = subprocess.run([sys.executable, '-c', program], cwd=self.folder, capture_output=True, text=True, timeout=100 * PATIENCE, check=False)
        self.assertEqual((run.returncode, run.stdout, run.stderr), (0, '[]\n', ''))
        run = subprocess.run([sys.executable, '-c', 'import hyco'], capture_output=True, text=True, timeout=100 * PATIENCE, check=False,
                             env={**os.environ, 'PYTHONPATH': os.path.join(SOURCE, 'python')})
        self.assertNotEqual(run.returncode, 0)
        self.assertIn('build/python', run.stderr)


if __name__ == '__main__':
    unittest.main()
