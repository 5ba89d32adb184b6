"""Quantities that the online phase does not compute anew: the reduced stiffness from the model's table, the solution
without contact from those at the ends of the load ranges. Results must not depend on it."""
import csv
import os
import shutil
import unittest

import h5py

from common import PELLET, SOURCE, Case

BLOCKS = os.path.join(SOURCE, 'examples', 'blocks')
COLUMNS = ('total_contact_force', 'lambda_max', 'rid_u_norm2')


class Table(Case):
    def counts(self, model):
        with h5py.File(self.path(model), 'r') as f:
            return [int(n) for n in f['table/counts'][:].ravel()] if 'table' in f else None

    def points(self, model, *arguments):
        self.hyco('predict', '-model', model, *arguments, '-table', 't.csv')
        with open(self.path('t.csv'), encoding='utf-8') as f:
            return list(csv.DictReader(f))

    def assembled(self, model, *arguments):
        """The predictions of the same model without its table."""
        shutil.copy(self.path(model), self.path('bare.h5'))
        with h5py.File(self.path('bare.h5'), 'a') as f:
            del f['table'], f['sealed']
        return self.points('bare.h5', *arguments)

    def agree(self, model, *arguments, tolerance=1e-8):
        for ours, theirs in zip(self.points(model, *arguments), self.assembled(model, *arguments), strict=True):
            self.assertEqual(ours['n_active'], theirs['n_active'])
            for name in COLUMNS:
                self.near(float(ours[name]), float(theirs[name]), tolerance, name)

    def test_pellet(self):
        """The pellet's radius stretches it in two directions: K is quadratic in it, and three values determine it."""
        self.hyco('train', '-scene', PELLET, '-values_radius', '4.02,4.06,4.10', '-values_load', '0.4,0.7,1', '-model', 'p.h5')
        self.assertEqual(self.counts('p.h5'), [3, 1])
        self.assertIn('tabulated at 3 values of radius\n', self.run_raw('view', '-model', 'p.h5').stdout)
        self.agree('p.h5', '-values_radius', '4.03,4.047,4.087', '-values_load', '0.3,0.6,0.95')

    def modulus(self, expression, model):
        """The pellet of radius 4.06, the cladding's modulus by the parameter that is called radius."""
        self.hyco('train', '-scene', PELLET, '-body_cladding_young', expression, '-body_pellet_map_x', 'x*4.06/4.1',
                  '-body_pellet_map_y', 'y*4.06/4.1', '-contact_gap_gap', '0.04', '-values_radius', '4.02,4.06,4.10',
                  '-values_load', '0.5,1', '-model', model)

    def test_modulus(self):
        """A modulus enters linearly: two values."""
        self.modulus('1e6*(radius - 4)', 'm.h5')
        self.assertEqual(self.counts('m.h5'), [2, 1])
        self.agree('m.h5', '-values_radius', '4.03,4.09', '-values_load', '0.8')

    def test_none(self):
        """A modulus far from a polynomial of low degree has no table; the model assembles."""
        self.modulus('1e5/(0.02 + (25*(radius - 4.06))^2)', 'n.h5')
        self.assertIsNone(self.counts('n.h5'))
        self.assertEqual(self.points('n.h5', '-values_radius', '4.05', '-values_load', '0.8')[0]['converged'], '1')

    def test_damaged(self):
        """A table of another matrix, and values that do not ascend, are refused."""
        self.hyco('train', '-scene', PELLET, '-values_radius', '4.02,4.10', '-values_load', '0.5,1', '-model', 'd.h5')
        for name, what in (('table/stiffness', 'entries, the matrix'), ('table/parameters', 'is damaged')):
            shutil.copy(self.path('d.h5'), self.path('e.h5'))
            with h5py.File(self.path('e.h5'), 'a') as f:
                values = f[name][:]
                del f['sealed'], f[name]
                f[name] = values[:, 1:] if 'stiffness' in name else values[::-1].copy()
            run = self.run_raw('predict', '-model', 'e.h5', '-mu', '4.05,1')
            self.assertNotEqual(run.returncode, 0)
            self.assertIn(what, run.stderr)

    def loads(self, model, *scene):
        """The whole mesh, all full order: more unknowns than a dense matrix takes, and full order is the truth."""
        self.hyco('train', '-scene', PELLET, *scene, '-values_radius', '4.02,4.10', '-values_load', '0.5,1', '-model', model,
                  '-hyco_hybrid', 'all', '-hyco_rid_whole', 'true')
        c = self.hyco('compare', '-scene', PELLET, *scene, '-model', model, '-values_radius', '4.05,4.08', '-values_load',
                      '0.3,0.55,0.9')
        for name in ('error_u', 'error_sigma', 'error_lambda'):
            self.assertLess(c[name]['max'], 1e-9, name)
        self.assertEqual(c['not_converged'], 0)

    def test_affine_load(self):
        """A load that is affine in the parameters is read from its table."""
        self.loads('l1.h5')

    def test_other_load(self):
        """A pressure that is not an affine function of the load."""
        self.loads('l2.h5', '-pressure_clad_outer_low', '250*load^2', '-pressure_pellet_top', '5*sin(load)')

    def test_load_from_nowhere(self):
        """A load that is affine between the middle and the ends of its range, and nowhere else."""
        self.loads('l3.h5', '-pressure_clad_outer_low', '250*load + 100*load*(load - 0.5)*(load - 1)')


if __name__ == '__main__':
    unittest.main()
