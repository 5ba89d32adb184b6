"""Paths in time with -hyco_linear iterative: what the contact systems leave follows Newton's residual, so the paths are those of the factor in about as many
iterations. Counts, not seconds."""
import os
import unittest

import h5py

from common import PELLET, SOURCE, Case

RING = os.path.join(SOURCE, 'examples', 'ring')
ROD = os.path.join(SOURCE, 'examples', 'rod', 'scene.yaml')
NEWTON = 1e-8  # what two paths to Newton's tolerance, 1e-10 a step, may differ by


class IterativeHistory(Case):
    def agree(self, direct, other):
        """The same path, in about as many iterations of Newton's method, with few solves in each."""
        for name in ('total_contact_force', 'u_norm2', 'mises', 'inelastic'):
            size = max(map(abs, direct[name]))
            for here, there in zip(other[name], direct[name], strict=True):
                self.assertAlmostEqual(here, there, delta=NEWTON * size, msg=name)
        self.assertEqual(other['n_active'], direct['n_active'])
        self.assertEqual(sum(other['cuts']), sum(direct['cuts']))
        self.assertLessEqual(max(other['residual']), 1e-10)
        self.assertLessEqual(sum(other['iterations']), 2 * sum(direct['iterations']))
        self.assertLessEqual(sum(other['active_set_iterations']), 4 * sum(other['iterations']))
        self.assertEqual(max(direct['most_linear_iterations']), 0)
        self.assertGreater(min(other['linear_iterations']), 0)
        self.assertLessEqual(sum(other['linear_iterations']), 120 * sum(other['iterations']))

    def paths(self, *scene, runs=((0, ()),)):
        """The histories of the factor and of each run of ranks and options."""
        direct = self.hyco('solve', *scene, '-hyco_linear', 'direct')['history']
        for ranks, options in runs:
            with self.subTest(scene=scene, ranks=ranks, options=options):
                report = self.hyco('solve', *scene, '-hyco_linear', 'iterative', *options, ranks=ranks)
                self.assertEqual(report['solver'], 'active_set projected')
                self.agree(direct, report['history'])
        return direct, report['history']

    def test_relaxation(self):
        """No loads: the contact forces fall to a twentieth, and K U stays. Failed where solves stopped at their own tolerance."""
        self.paths('-scene', RING, '-mu', '0.01,1', runs=((0, ()), (2, ()), (0, ('-hyco_primal_pc_type', 'icc'))))

    def test_kept(self):
        """One multigrid for all steps where the elastic stiffness is kept; the elastic path, in 3D, takes one iteration a step."""
        creep = ('-scene', RING, '-mu', '0.01,1', '-history_times', '0,1,3,8', '-body_ring_exponent', '4', '-body_ring_rate', '1e-12')
        _, history = self.paths(*creep, '-hyco_newton', 'elastic')
        self.assertEqual(sum(history['factors']), 1)
        _, history = self.paths('-scene', PELLET, '-mu', '4.06,1', '-history_times', '0,0.5,1', '-pressure_clad_outer_low', '250*load*t')
        self.assertEqual(history['factors'], [1, 0, 0])

    def test_yields(self):
        """Creep, yield, heat; the gap closes and opens again."""
        direct, _ = self.paths('-scene', ROD, '-mu', '0.05,40,1', runs=((0, ()), (0, ('-hyco_newton', 'modified'))))
        self.assertIn(0, direct['n_active'])
        self.assertGreater(max(direct['n_active']), 0)

    def test_checkpoint(self):
        """The counts are resumed; a checkpoint from before there were any has zeros."""
        args = ('solve', '-scene', RING, '-mu', '0.01,1', '-history_times', '0,1,3', '-hyco_linear', 'iterative', '-hyco_checkpoint', 'c.h5')
        history = self.hyco(*args)['history']
        names = ('iterations', 'linear_iterations', 'most_linear_iterations')
        again = self.hyco(*args, '-hyco_resume')['history']
        self.assertEqual([again[name] for name in names], [history[name] for name in names])
        with h5py.File(self.path('c.h5'), 'a') as file:
            steps = file['steps'][:, :-7]  # without those counts, three numbers of friction, the sliding, and the dependent contacts
            del file['steps'], file['sealed']
            file['steps'] = steps
        old = self.hyco(*args, '-hyco_resume')['history']
        self.assertEqual([old[name] for name in names], [history['iterations'], [0] * 3, [0] * 3])


if __name__ == '__main__':
    unittest.main()
