"""hyco's types of Tao in a program without a contact system (examples/ladder/obstacle.c): the exact solution, TAO's own types, 1 and 2 ranks."""
import re
import unittest

from common import Program


class Obstacle(Program):
    name = 'obstacle'
    out = r'CONVERGED_\w+: (\d+) iterations, energy (\S+), residual (\S+), error (\S+)'

    def step(self, *args, ranks=0):
        its, energy, residual, error = self.solve(*args, ranks=ranks)
        self.assertLess(residual, 1e-9, args)  # recomputed by the program from A, b and the bounds
        return int(its), energy, error

    def test_second_order(self):
        """The error of five points is O(h^2), apart from the place of the free boundary: 16 of it with h a quarter; at least 4 here."""
        errors = [self.step('-n', n)[2] for n in (31, 127)]
        self.assertLess(errors[0], 1e-2)
        self.assertLess(errors[1], errors[0] / 4)

    def test_against_tao(self):
        """TAO's Newton types, Lemke's method and the active set find one solution; with a ceiling too, and on two ranks."""
        for bounds in ([], ['-ceiling', '0.9']):
            _, energy, _ = self.step(*bounds)
            for kind in ('hyco_active_set', 'hyco_lemke', 'tron', 'bnls'):
                for ranks in (0, 2):
                    if bounds and kind == 'hyco_lemke':
                        continue
                    with self.subTest(kind, bounds=bounds, ranks=ranks):
                        self.assertLess(abs(self.step('-tao_type', kind, *bounds, ranks=ranks)[1] - energy), 1e-10 * energy)

    def test_iterations(self):
        """A few sets, the same on two ranks; the linear solver is the user's choice."""
        its, energy, _ = self.step('-n', 63)
        self.assertLessEqual(its, 12)
        for args in (['-tao_pc_type', 'cholesky'], ['-tao_ksp_type', 'cg', '-tao_pc_type', 'jacobi', '-tao_ksp_rtol', '1e-13']):
            found = self.step('-n', 63, *args, ranks=2)
            self.assertEqual(found[0], its)
            self.assertLess(abs(found[1] - energy), 1e-10 * energy)

    def test_monitor(self):
        """TAO's monitor shows the energy and the projected gradient of each set."""
        run = self.run_program('-tao_monitor')
        self.assertEqual(run.returncode, 0, run.stderr)
        energies = [float(e) for e in re.findall(r'Function value: (\S+),', run.stdout)]
        its, energy, _, _ = re.search(self.out, run.stdout).groups()
        self.assertEqual(len(energies), int(its) + 1)
        self.assertAlmostEqual(energies[-1], float(energy), delta=1e-5)

    def test_refused(self):
        """Lemke's method takes lower bounds only; the message names the type that takes others."""
        self.refused(['hyco_lemke', 'hyco_active_set'], '-tao_type', 'hyco_lemke', '-ceiling', '0.9')


if __name__ == '__main__':
    unittest.main()
