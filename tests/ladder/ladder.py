"""The programs of examples/ladder: each runs, and prints the numbers that the command gives for the same problem."""
import csv
import glob
import os
import re
import subprocess
import unittest

from common import HYCO, MPIRUN, PATIENCE, PELLET, ROPE, SOURCE, Case

LADDER = os.path.join(SOURCE, 'examples', 'ladder')


class Ladder(Case):
    newcomer = True  # the programs train as a user does

    def step(self, name, *args, ranks=0):
        """What a program prints."""
        command = [*MPIRUN, str(ranks)] * bool(ranks) + [os.path.join(os.path.dirname(HYCO), 'ladder', name), *map(str, args)]
        run = subprocess.run(command, cwd=self.folder, capture_output=True, text=True, timeout=60 * PATIENCE, check=False)
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        return run.stdout

    def number(self, text, word):
        return float(re.search(word + r' ([-+.\de]+)', text)[1])

    def test_index(self):
        """The index names every program; each is a page, has a test here, and checks every call."""
        with open(os.path.join(LADDER, 'README.md'), encoding='utf-8') as file:
            index = file.read()
        tests = ''
        for path in glob.glob(os.path.join(SOURCE, 'tests', 'ladder', '*.py')):
            with open(path, encoding='utf-8') as file:
                tests += file.read()
        for path in glob.glob(os.path.join(LADDER, '*.c')):
            name = os.path.basename(path)
            self.assertIn(f'[{name}]({name})', index)
            self.assertIn(f"'{name[:-2]}'", tests, name)
            with open(path, encoding='utf-8') as file:
                text = file.read()
            self.assertLessEqual(text.count('\n'), 230 if name == 'model.c' else 150, name)  # a type of model has two tables of operations
            for line in re.sub(r'/\*.*?\*/', ' ', text, flags=re.S).splitlines():
                if re.match(r' {2,4}Hyco\w+\(', line):
                    self.fail(f'{name}: an unchecked call: {line}')

    def test_solve(self):
        """solve.c: the numbers of hyco solve."""
        report = self.hyco('solve', '-scene', ROPE, '-mu', '0.07,0.17')
        said = self.step('solve', '-scene', ROPE, '-mu', '0.07,0.17')
        self.assertIn(f'converged: {report["n_active"]} of {report["n_contacts"]} contacts closed', said)
        self.near(self.number(said, 'force'), report['total_contact_force'], 1e-9)
        self.near(self.number(said, 'forces:'), report['lambda_max'], 1e-9)

    def test_help(self):
        """A program's own -help lists the options of its objects, once."""
        said = self.step('solve', '-scene', ROPE, '-mu', '0.07,0.17', '-help')
        line = '-hyco_solver_rtol <real>: largest relative KKT residual that counts as solved [1e-8]'
        self.assertEqual(said.count(line), 1, said)

    def test_train(self):
        """train.c: the numbers of hyco train and predict."""
        said = self.step('train', '-scene', ROPE, '-model', 'c.h5', '-mu', '0.07,0.17')
        trained = self.hyco('train', '-scene', ROPE, '-grid', '6,6', '-model', 'm.h5', status=None)
        report = self.hyco('predict', '-model', 'm.h5', '-mu', '0.07,0.17')
        self.assertIn(f'{trained["n_samples"]} training solutions, {trained["n_modes"]} modes, RID of {trained["rid_elements"]} elements', said)
        self.near(self.number(said, 'converged: force'), report['total_contact_force'], 1e-9)
        # two digits; round-off depends on the kernels of the BLAS, which the command selects on a processor newer than the BLAS
        self.assertAlmostEqual(self.number(said, 'estimated error of u'), report['estimated_error_u'], delta=1e-12 + 0.06 * report['estimated_error_u'])

    def test_batch(self):
        """batch.c: the forces of single predictions."""
        model = os.path.join(SOURCE, 'tests', 'data', 'rope-hybrid-4.h5')
        said = self.step('batch', '-model', model, '-points', 5)
        rows = re.findall(r'^(\S+),(\S+): converged, force (\S+), largest (\S+)$', said, flags=re.M)
        self.assertEqual(len(rows), 5, said)
        with open(self.path('points.csv'), 'w', encoding='ascii') as file:
            file.write('mu1,mu2\n' + ''.join(f'{a},{b}\n' for a, b, *_ in rows))
        self.hyco('predict', '-model', model, '-points', 'points.csv', '-table', 'table.csv')
        with open(self.path('table.csv'), encoding='ascii') as file:
            for row, (*_, force, largest) in zip(csv.DictReader(file), rows):
                self.near(float(force), float(row['total_contact_force']), 1e-6)
                self.near(float(largest), float(row['lambda_max']), 1e-6)

    def test_sensitivity(self):
        """sensitivity.c: the derivatives are the differences of single predictions."""
        model = os.path.join(SOURCE, 'tests', 'data', 'rope-hybrid-4.h5')
        said = self.step('sensitivity', '-model', model, '-mu', '0.1,0.1')
        ranges = {'mu1': 0.2, 'mu2': 0.55}
        points = [(0.1, 0.1)]
        for k, width in enumerate(ranges.values()):
            points += [tuple(0.1 + sign * 1e-3 * width * (j == k) for j in range(2)) for sign in (-1, 1)]
        force = [self.hyco('predict', '-model', model, '-mu', f'{a!r},{b!r}')['total_contact_force'] for a, b in points]
        self.near(self.number(said, 'force'), force[0], 1e-9)
        for k, (name, width) in enumerate(ranges.items()):
            derivative = (force[2 + 2 * k] - force[1 + 2 * k]) / (2e-3 * width)
            self.assertGreater(abs(derivative), 1e-3)
            self.assertAlmostEqual(self.number(said, f'{name}: derivative'), derivative, delta=1e-6)
        self.assertEqual(len(re.findall(r'most at node \d+$', said, flags=re.M)), 2, said)

    def test_distributed(self):
        """distributed.c: each rank's share, and the numbers of one rank."""
        report = self.hyco('solve', '-scene', PELLET, '-mu', '4.06,1')
        said = self.step('distributed', '-scene', PELLET, '-mu', '4.06,1', ranks=2)
        owned = [(int(a), int(b)) for a, b in re.findall(r'rows (\d+) to (\d+)', said)]
        self.assertEqual(len(owned), 2, said)
        self.assertEqual(owned[1][0], owned[0][1] + 1)
        self.near(self.number(said, 'force'), report['total_contact_force'], 1e-8)
        self.near(self.number(said, 'gathered ones'), report['total_contact_force'], 1e-8)


if __name__ == '__main__':
    unittest.main()
