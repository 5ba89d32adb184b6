"""scripts/bench-full-order, bench-history and bench-solvers: the CSV, the picture, the problem passed to other solvers, and the behaviour when
a command fails or takes too long."""
import csv
import importlib.machinery
import importlib.util
import math
import os
import subprocess
import sys
import time
import unittest

from common import PATIENCE, PELLET, SOURCE, Case

SCRIPT = os.path.join(SOURCE, 'scripts', 'bench-full-order')
FORCE = 1409.70532353  # as pellet.py has it


HISTORY = os.path.join(SOURCE, 'scripts', 'bench-history')


def load(script=SCRIPT):
    loader = importlib.machinery.SourceFileLoader('bench', script)
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader('bench', loader))
    loader.exec_module(module)
    return module


class Bench(Case):
    def test_mesh_a(self):
        """scripts/bench-full-order on mesh A: its rows, picture and document."""
        run = subprocess.run([sys.executable, SCRIPT, '--meshes', 'A', '--others', 'A', '--repeat', '1',
                              '--timeout', str(60 * PATIENCE), '--output', self.folder], cwd=SOURCE, capture_output=True, text=True, timeout=180 * PATIENCE)
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        with open(self.path('full-order.csv'), encoding='utf-8', newline='') as file:
            rows = {(r['solver'], int(r['ranks']), int(r['steps'])): r for r in csv.DictReader(file)}
        self.assertEqual(list(rows), [('hyco', 1, 25), ('hyco', 2, 25), ('hyco', 1, 1), ('hyco iterative', 1, 1),
                                      ('hyco factor per iteration', 1, 1), ('GetFEM', 1, 1), ('CalculiX', 1, 1)])
        for (solver, _, steps), row in rows.items():
            with self.subTest(solver=solver, steps=steps):
                if row['status'] == 'not installed':
                    self.assertIn(solver, ('GetFEM', 'CalculiX'))
                    continue
                self.assertEqual((row['status'], row['unknowns'], row['n_active']), ('ok', '4952', '45'))
                self.near(float(row['total_force']), FORCE, 1e-3 if solver == 'CalculiX' else 1e-6, solver)
                self.assertGreater(float(row['wall_s']), 0)
                self.assertGreater(float(row['memory_mb']), 10)
        with open(self.path('full-order.png'), 'rb') as file:
            self.assertEqual(file.read(8), b'\x89PNG\r\n\x1a\n')
        self.assertIn('mesh A: hyco factor per iteration takes', run.stdout)

    def test_solvers(self):
        """scripts/bench-solvers on a sparse and a redundant system: a row each, which every method for symmetric systems solves."""
        run = subprocess.run([sys.executable, os.path.join(SOURCE, 'scripts', 'bench-solvers'), '--only', 'blocks,dependent rows'],
                             capture_output=True, text=True, timeout=180 * PATIENCE)
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        rows = [line.strip('|').split(' | ') for line in run.stdout.splitlines() if line.startswith('|')]
        self.assertEqual([row[0].split(':')[0].strip() for row in rows[2:5]], ['blocks', 'dependent rows', 'solved'])
        for row in rows[2:4]:
            for method, cell in zip(rows[0][2:7], row[2:7]):  # the first-order and semismooth types are not promised on every machine
                self.assertLess(float(cell.split(', ')[2]), 1e-8, (row[0], method))
        self.assertEqual(rows[4][2], '2 of 2')

    def test_problem(self):
        """Sums of the loads for other solvers: pressure times the projected area of the cladding, or the top's polygon."""
        p = load().pellet.problem(os.path.join(PELLET, 'A.msh'), 4.06, 1.0, self.path('text.msh'))
        for axis in (0, 1):
            self.near(p['force'][:, axis].sum(), -(250 * 2 + 50 * 4.75) * 4.7, 1e-9, 'sum of the pressures on the cladding')
        top = 8 * 4.06**2 / 2 * math.sin(math.pi / 16)  # eight triangles a quarter
        self.near(p['force'][:, 2].sum(), -5 * top, 1e-9, 'sum of the pressure on the top')
        self.near(float(p['gap']), 0.04, 1e-12)
        self.assertEqual(len(p['slave']), 189)
        distance = p['normal'] * (p['xyz'][p['master']] - p['xyz'][p['slave']])
        self.assertLess(abs(distance.sum(axis=1) - 0.04).max(), 1e-6)

    def test_calculix_input(self):
        """CalculiX truncates a number after 20 characters, and thereby an exponent."""
        bench = load()
        bench.calculix.write(self.path('input'), bench.pellet.problem(os.path.join(PELLET, 'A.msh'), 4.06, 1.0,
                                                                      self.path('text.msh')))
        with open(self.path('input.inp'), encoding='ascii') as file:
            fields = [f.strip() for line in file if not line.startswith('*') for f in line.split(',')]
        self.assertGreater(len(fields), 10000)
        self.assertLessEqual(max(map(len, fields)), 20)

    def test_history(self):
        """The rod on mesh A, and CalculiX's input for the cladding's creep."""
        run = subprocess.run([sys.executable, HISTORY, '--rod', 'A', '--newton', 'elastic', '--bound', '1e-3', '--creep', 'none',
                              '--output', self.folder], cwd=SOURCE, capture_output=True, text=True, timeout=100 * PATIENCE)
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        with open(self.path('history.csv'), encoding='utf-8', newline='') as file:
            row, = csv.DictReader(file)
        self.assertEqual((row['case'], row['solver'], row['unknowns'], row['factors']), ('rod', 'hyco elastic', '4952', '1'))
        self.near(float(row['force']), 2168, 2e-3)
        bench = load(HISTORY)
        problem = bench.pellet.problem(os.path.join(PELLET, 'A.msh'), bench.RADIUS, 1.0, self.path('text.msh'), bench.PRESSURES)
        bench.calculix.write(self.path('creep'), problem, bench.CREEP)
        with open(self.path('creep.inp'), encoding='ascii') as file:
            lines = file.read().splitlines()
        self.assertEqual(lines[lines.index('*CREEP, LAW=NORTON') + 1], '2e-11, 3, 0.')
        self.assertEqual(lines.count('*STEP') + lines.count('*STEP, INC=61'), 2)

    def test_failures(self):
        """Runs that take too long or fail are rows of the table, with the reason."""
        bench = load()
        bench.timed.folder = self.folder
        begin = time.monotonic()
        *_, failure = bench.timed(['sleep', '300'], 0.3)
        self.assertEqual(failure, 'timed out after 0.3 s')
        self.assertLess(time.monotonic() - begin, 15 * PATIENCE)
        *_, failure = bench.timed(['sh', '-c', 'echo no factor; exit 3'], 10)
        self.assertEqual(failure, 'ended with 3: no factor')
        self.assertIn('ended with', bench.run_hyco('nowhere.msh', 1, 1, [], 60)['status'])
        row = bench.median_row({'solver': 'x'}, [{'status': 'ended with 3: no factor'}])
        self.assertEqual((row['status'], row['runs']), ('ended with 3: no factor', 1))
        times = [{'wall_s': w, 'cpu_s': w, 'memory_mb': 1, 'status': 'ok'} for w in (3, 1, 2)]
        row = bench.median_row({'solver': 'x'}, times)
        self.assertEqual((row['wall_s'], row['wall_min'], row['wall_max']), (2, 1, 3))


if __name__ == '__main__':
    unittest.main()
