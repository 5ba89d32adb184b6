"""A complementarity method that a program registers (examples/ladder/method.c) compared with TAO's and hyco's on the same scene."""
import os
import re
import unittest

from common import SOURCE, Program

BLOCKS = os.path.join(SOURCE, 'examples', 'blocks')
PROJECTED = ['-hyco_solver_type', 'tao', '-hyco_tao_type', 'projected']


class Method(Program):
    name = 'method'
    out = r'(.+) by (.+): (\d+) iterations, force (\S+), largest residual (\S+)'

    def step(self, *args, ranks=0):
        reason, method, _, force, residual = self.solve('-scene', BLOCKS, '-mu', '0.05,0.06', *args, ranks=ranks)
        self.assertLess(residual, 1e-8, method)
        return reason, method, force

    def test_against_the_others(self):
        """The registered method gives the forces of the default one, on 1 and 2 ranks."""
        _, _, force = self.step()
        for ranks in (0, 2):
            reason, method, its_force = self.step(*PROJECTED, ranks=ranks)
            self.assertEqual((reason, method), ('converged', 'tao projected dual'))
            self.assertLess(abs(its_force - force), 1e-9 * force)

    def test_falling_back(self):
        """A registered method that does not converge is followed by the active set."""
        reason, method, _ = self.step(*PROJECTED, '-hyco_tao_max_it', '1')
        self.assertEqual((reason, method), ('converged by the fallback solver', 'tao projected dual, then active_set'))

    def test_tao_shows_it(self):
        """TAO's monitor, view and reason are the same for TAO's types, hyco's and the program's; on two ranks they are printed once."""
        watch = ['-hyco_tao_monitor', '-hyco_tao_view', '-hyco_tao_converged_reason']
        for name, args in (('projected', PROJECTED), ('gpcg', ['-hyco_solver_type', 'tao', '-hyco_tao_type', 'gpcg']),
                           ('hyco_active_set', []), ('hyco_lemke', ['-hyco_solver_type', 'lemke'])):
            with self.subTest(name):
                run = self.run_program('-scene', BLOCKS, '-mu', '0.05,0.06', *watch, *args, ranks=2 if name == 'hyco_active_set' else 0)
                self.assertEqual(run.returncode, 0, run.stderr)
                out = run.stdout + run.stderr
                self.assertEqual(len(re.findall(rf'Tao Object:[^\n]*\n +type: {name}\b', out)), 1, out)
                self.assertEqual(out.count('solve converged'), 1, out)
                if name != 'hyco_lemke':  # it has pivots, no iterates
                    self.assertRegex(out, r'Residual: ')

    def test_what_the_program_does_not_register(self):
        """An unknown type of Tao is named."""
        self.refused(['projectd'], '-scene', BLOCKS, '-mu', '0.05,0.06', '-hyco_solver_type', 'tao', '-hyco_tao_type', 'projectd')


if __name__ == '__main__':
    unittest.main()
