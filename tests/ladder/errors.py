"""Errors of a user's program: one line, on one rank and on two; PETSc's trace with HYCO_TRACE=1."""
import os
import subprocess
import unittest

from common import HYCO, MPIRUN, PATIENCE, ROPE, Case

PROGRAM = os.path.join(os.path.dirname(HYCO), 'tests', 'test_one_line')
ERRORS = {'scene': 'the scene /no/such', 'model': '/no/such.h5', 'null': 'create it by HycoFOMCreate()', 'class': 'is not a HycoFOM', 'samples': '/no/such.csv',
          'order': 'call HycoFOMSolve() before', 'range': 'mu1 = 9 lies outside its range', 'count': 'the scene has 2: mu1, mu2', 'petsc': 'x'}


class Errors(Case):
    def run_program(self, what, ranks=0, **environment):
        command = [*MPIRUN, str(ranks)] * bool(ranks) + [PROGRAM, what, ROPE]
        return subprocess.run(command, cwd=self.folder, env={**os.environ, **environment}, capture_output=True, text=True, timeout=60 * PATIENCE)

    def test_one_line(self):
        """Each error of a program is one line."""
        for what, words in ERRORS.items():
            run = self.run_program(what)
            self.assertEqual(run.returncode, 1, what)
            self.assertEqual(run.stderr.count('\n'), 1, run.stderr)
            self.assertTrue(run.stderr.startswith('hyco: error: '), run.stderr)
            self.assertIn(words, run.stderr)
            self.assertEqual(run.stdout, '')

    def test_two_ranks(self):
        """An error common to all ranks is printed once; mpiexec adds messages of its own."""
        for what in ('scene', 'range'):
            run = self.run_program(what, ranks=2)
            self.assertNotEqual(run.returncode, 0)
            self.assertEqual(run.stderr.count('hyco: error: '), 1, run.stderr)
            self.assertIn(ERRORS[what], run.stderr)
            self.assertNotIn('PETSC ERROR', run.stderr)

    def test_trace(self):
        """HYCO_TRACE=1 prints PETSc's trace with the line of the error."""
        run = self.run_program('range', HYCO_TRACE='1')
        self.assertNotEqual(run.returncode, 0)
        self.assertIn('HycoFOMSolve() at ', run.stderr)
        self.assertIn(ERRORS['range'], run.stderr)
        done = subprocess.run([HYCO, 'solve', '-scene', ROPE, '-mu', '9,9'], env={**os.environ, 'HYCO_TRACE': '1'}, capture_output=True, text=True,
                              timeout=60 * PATIENCE)
        self.assertIn('PETSC ERROR: #', done.stderr)
        self.assertEqual([line for line in done.stderr.splitlines() if line.startswith('hyco: ')][0].count(ERRORS['range']), 1)

    def test_fine(self):
        """A program without an error ends with status 0."""
        self.assertEqual(self.run_program('nothing').returncode, 0)


if __name__ == '__main__':
    unittest.main()
