"""A complementarity method that a program registers (examples/ladder/method.c) against TAO's and hyco's on the same string, and the
closed form: a string of unit tension under the load 8 touches a table 1/2 below its ends between a = 1/sqrt(8) and 1 - a, and presses
on it with 8 (1 - 2 a); the beads at the edges of the contact carry at most their own share, 8 h each, of what differs."""
import math
import os
import re
import subprocess
import unittest

from common import HYCO, PATIENCE, Case

PROGRAM = os.path.join(os.path.dirname(HYCO), 'ladder', 'method')
OUT = re.compile(r'(.+): (\d+) iterations, contact force (\S+), largest residual (\S+)')


class Method(Case):
    def run_method(self, *args):
        run = subprocess.run([PROGRAM, *args], capture_output=True, text=True, timeout=20 * PATIENCE)
        self.assertEqual(run.returncode, 0, run.stderr)
        return run.stdout

    def solve(self, *args):
        method, _, force, residual = OUT.search(self.run_method(*args)).groups()
        self.assertLess(float(residual), 1e-8, method)
        return method, float(force)

    def test_against_the_others(self):
        n = 12
        method, force = self.solve('-n', str(n))
        self.assertEqual(method, 'tao projected primal')
        self.assertLess(abs(force - 8 * (1 - 1 / math.sqrt(2))), 2 * 8 / (n + 1))
        for name, args in (('tao tron primal', ['-hyco_tao_type', 'tron']), ('active_set primal', ['-hyco_solver_type', 'active_set']),
                           ('tao projected dual', ['-hyco_solver_form', 'dual'])):
            with self.subTest(name):
                other, its_force = self.solve('-n', str(n), *args)
                self.assertTrue(other.startswith(name), other)
                self.assertLess(abs(its_force - force), 1e-9)

    def test_tao_shows_it(self):
        """TAO's monitor, view and reason are the same for TAO's types, hyco's and the program's."""
        watch = ['-hyco_tao_monitor', '-hyco_tao_view', '-hyco_tao_converged_reason']
        for name, args in (('projected', []), ('gpcg', ['-hyco_tao_type', 'gpcg']),
                           ('hyco_active_set', ['-hyco_solver_type', 'active_set']),
                           ('hyco_lemke', ['-hyco_solver_type', 'lemke'])):
            with self.subTest(name):
                out = self.run_method(*watch, *args)
                self.assertRegex(out, rf'type: {name}\b')
                self.assertIn('solve converged', out)
                if name != 'hyco_lemke':  # it has pivots, no iterates
                    self.assertRegex(out, r'Residual: ')

    def test_what_the_program_does_not_register(self):
        run = subprocess.run([PROGRAM, '-hyco_tao_type', 'projectd'], capture_output=True, text=True, timeout=20 * PATIENCE)
        self.assertNotEqual(run.returncode, 0)
        self.assertIn('projectd', run.stderr + run.stdout)


if __name__ == '__main__':
    unittest.main()
