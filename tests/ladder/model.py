"""A type of reduced model that a program registers (examples/ladder/model.c): trained, saved, loaded, predicted and compared by the
library's own functions, on any number of ranks; the command, which does not have it, reports this."""
import unittest

from common import ROPE, Program


class Model(Program):
    name = 'model'
    out = (r'nearest solutions: contact force (\S+), complementarity (\S+), adhesion (\S+); errors: u (\S+), sigma (\S+), lambda (\S+); '
           r'estimated: u (\S+)')

    def nearest(self, *mu, ranks=0):
        return self.solve(ROPE, self.path('nearest.h5'), *mu, ranks=ranks)

    def test_model(self):
        """The registered type of model is trained, saved, loaded and predicts."""
        first = self.nearest(0.07, 0.17)
        force, complementarity, adhesion, u, sigma, forces, estimated = first
        self.assertGreater(force, 0)
        self.assertEqual(adhesion, 0)
        self.assertGreater(complementarity, 0)  # and the residuals show it
        for error in (u, sigma, forces):
            self.assertGreater(error, 1e-6)
            self.assertLess(error, 1)
        self.assertGreater(estimated, 0)  # calibrated by held-out solutions as any other
        for a, b in zip(first, self.nearest(0.07, 0.17, ranks=3)):
            self.near(b, a, 1e-6)
        at = self.nearest(0.25, 0.5)  # the corners of the ranges are training points
        self.assertLess(at[5], 1e-6)  # for the forces; the displacement lacks what the modes leave out
        self.assertLess(at[3], u)

    def test_refused(self):
        """The command refuses a model of a type that only the program registers."""
        self.nearest(0.07, 0.17)
        run = self.run_raw('predict', '-model', self.path('nearest.h5'), '-mu', '0.07,0.17')
        self.assertNotEqual(run.returncode, 0)
        for word in ('nearest.h5', '"nearest"', 'HycoROMRegister'):
            self.assertIn(word, run.stderr)


if __name__ == '__main__':
    unittest.main()
