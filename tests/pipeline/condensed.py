"""Condensed models: forces at unseen parameter values to the accuracy of the interpolation, and its estimate compared with the errors."""
import glob
import os
import re
import unittest

import h5py
import numpy as np

from common import PELLET, ROPE, SOURCE, Case
from projection import rope

BLOCKS = os.path.join(SOURCE, 'examples', 'blocks')
PLATE = os.path.join(SOURCE, 'examples', 'plate')
TYPE = ('-hyco_model_type', 'condensed')
LOADS = ('-values_load', '0.2,0.4,0.6,0.8,1')


def full(packed, m):
    """The symmetric matrix from the columns of its lower triangle."""
    G = np.zeros((m, m))
    G.T[np.triu_indices(m)] = packed
    return G + np.tril(G, -1).T


class Condensed(Case):
    def train(self, *words, scene=PELLET, **options):
        return self.hyco('train', '-scene', scene, *TYPE, *words, **options)

    def refused(self, line, *words):
        run = self.run_raw(*words)
        self.assertNotEqual(run.returncode, 0)
        self.assertIn(line, run.stderr)

    def test_pellet(self):
        """Three and four radii of mesh A; between them the forces agree with full order to 1e-6, and the displacement to the accuracy of
        its modes. The estimate, from one radius less, is not less than the error."""
        last = 1
        for radii in ('4.02,4.06,4.1', '4.02,4.045,4.075,4.1'):
            t = self.train('-values_radius', radii, *LOADS, '-model', 'p.h5', '-hyco_snapshots', 'p')
            self.assertEqual((t['model_type'], t['n_flexibilities']), ('condensed', radii.count(',') + 1))
            c = self.hyco('compare', '-scene', PELLET, '-model', 'p.h5', '-values_radius', '4.031,4.055,4.09', '-values_load',
                          '0.5,0.7,0.9,1')
            self.assertEqual((c['not_converged'], c['undefined']), (0, 0))
            self.assertLess(c['kkt_max'], 1e-12)
            estimate, error = t['left_out_flexibility_gap_forces'][2], c['error_lambda']['max']
            self.assertLess(error, 1e-6)
            self.assertLess(error, estimate)
            self.assertLess(estimate, 0.1 * last)
            self.assertLess(c['error_u']['max'], 0.06 if last == 1 else 0.01)  # the modes need more radii than the forces
            last = estimate
        p = self.hyco('predict', '-model', 'p.h5', '-mu', '4.06,1', '-output', 'out.xdmf')
        self.solved(p)
        self.assertEqual((p['interpolation_error'], p['covered_force']), (p['estimated_error_lambda'], 1))
        self.assertLess(p['interpolation_error'], estimate)  # of all values, and at this point
        self.train('-values_radius', '4.04,4.05,4.06', '-values_load', '0.4,1', '-model', 'narrow.h5', '-hyco_snapshots', 'p')
        inside, outside = (self.hyco('predict', '-model', 'narrow.h5', '-mu', mu, status=status)['interpolation_error']
                           for mu, status in (('4.055,1', 0), ('4.1,1', 3)))  # there the modes follow the forces no more
        run = self.run_raw('predict', '-model', 'narrow.h5', '-mu', '4.1,1', cwd=self.folder)
        self.assertRegex(run.stderr, 'hyco: missed: the displacements do not follow the contact forces')
        run = self.run_raw('predict', '-model', 'narrow.h5', '-values_radius', '4.05,4.1', '-values_load', '1', cwd=self.folder)
        self.assertEqual(run.returncode, 3)
        self.assertRegex(run.stderr, r'at 1 of 2 points \(column inconsistency\)')
        full = self.hyco('predict', '-model', 'narrow.h5', '-mu', '4.1,1', '-hyco_fallback', '-scene', PELLET)
        self.assertIn('do not follow the contact forces', full['fallback'])
        product = [abs((r - 4.04) * (r - 4.05) * (r - 4.06)) for r in (4.1, 4.055)]
        inside, outside = inside - 1e-10, outside - 1e-10  # the floor of every estimate
        self.near(outside / inside, product[0] / product[1], 2e-2)  # as the polynomial's remainder grows
        self.near(p['total_contact_force'], 1409.70532353, 1e-7)  # full order
        self.assertTrue(os.path.exists(self.path('out.xdmf')))
        view = self.run_raw('view', '-model', 'p.h5').stdout
        self.assertIn('condensed model', view)
        self.assertIn('load: 5 values; degree 0 of the flexibility, 1 of the gap (affine: exact)', view)

    def test_closed_form(self):
        """The rope's flexibility at each training value, by numpy from K in closed form; between them, forces within the estimate; the
        gap is affine in mu2, for which two values are enough."""
        t = self.train('-grid', '14,2', '-grid_type', 'chebyshev', '-model', 'r.h5', scene=ROPE)
        self.assertEqual(t['n_flexibilities'], 14)
        with h5py.File(self.path('r.h5')) as f:
            place = np.argsort(f['whole/xyz'][:, 0][f['mesh/node_whole'][:, 0][f['problem/pairs/slave'][:, 0]]])
            values, packed = f['condensed/values_0'][:, 0], f['condensed/G'][:]
        self.assertLess(abs(values - (0.15 - 0.1 * np.cos(np.pi * (2 * np.arange(14) + 1) / 28))).max(), 1e-15)
        for mu1, column in zip(values, packed):
            K = rope(mu1, 0)[0][1:-1, 1:-1]
            G = full(column, 98)[np.ix_(place, place)]
            self.assertLess(abs(G - np.linalg.inv(K)).max(), 1e-11 * abs(G).max())
        c = self.hyco('compare', '-scene', ROPE, '-model', 'r.h5', '-grid', '9,7')
        self.assertEqual((c['not_converged'], c['undefined']), (0, 0))
        self.assertLess(c['error_lambda']['max'], t['left_out_flexibility_gap_forces'][2])
        self.assertLess(c['error_lambda']['max'], 2e-4)

    def test_affine(self):
        """For a parameter in which everything is affine two values are exact: the blocks' press at a trained crown."""
        self.train('-values_crown', '0.02,0.05,0.08', '-values_press', '0.02,0.08', '-model', 'b.h5', scene=BLOCKS)
        c = self.hyco('compare', '-scene', BLOCKS, '-model', 'b.h5', '-values_crown', '0.05,0.08', '-values_press',
                      '0.03,0.045,0.06')
        self.assertLess(c['error_lambda']['max'], 1e-10)

    def test_chosen(self):
        """No points given: values are added until the estimate is small, and the error is below it; or the limit is reported."""
        t = self.train('-model', 'c.h5')
        estimate = t['left_out_flexibility_gap_forces'][2]
        self.assertTrue(0 < estimate <= 1e-7, estimate)
        c = self.hyco('compare', '-scene', PELLET, '-model', 'c.h5', '-values_radius', '4.031,4.07', '-values_load', '0.7,1')
        self.assertLess(c['error_lambda']['max'], 1e-7)
        run = self.run_raw('train', '-scene', PELLET, *TYPE, '-model', 'd.h5', '-hyco_condensed_max_values', 3)
        self.assertEqual(run.returncode, 3, run.stderr)  # written, but it misses
        said = re.search(r"-hyco_condensed_tol was not reached: the error of the forces, with one value left out, is (\S+), and 1.0e-07 was "
                         r'requested; raise -hyco_condensed_max_values, which is 3,', run.stderr)
        self.assertIn(f'forces {said[1]};', run.stdout)  # the estimate that is reported
        self.assertGreater(float(said[1]), 1e-7)
        self.refused('give the training points', 'train', '-scene', PELLET, '-model', 'h.h5')

    def test_decades(self):
        """The foundation's modulus over two decades: eight values of its logarithm give forces to 1e-3, where eight of the modulus give some tens
        of per cent (the flexibility has poles near the range's lower end)."""
        found = {}
        for young, span, at in (('crown', '1e4,1e6', '2e4,6e4,3e5,7e5'), ('10^crown', '4,6', '4.301,4.778,5.477,5.845')):
            words = ('-scene', BLOCKS, '-body_block_map_y', 'y + 0.05*(x/20)^2*(1 - y/16)', '-body_foundation_young', young, '-parameter_crown_range', span)
            self.hyco('train', *words, *TYPE, '-grid', '8,3', '-grid_type', 'chebyshev', '-hyco_validation', 0, '-model', 'd.h5', '-hyco_snapshots', young[:2])
            c = self.hyco('compare', *words, '-model', 'd.h5', '-values_crown', at, '-values_press', '0.03,0.07')
            found[young] = c['error_lambda']['max']
        self.assertLess(found['10^crown'], 1e-3)
        self.assertGreater(found['crown'], 0.1)

    def test_affine(self):
        """Where loads alone depend on three parameters, the chosen points have three values of each, not five: 27 solutions."""
        three = ('-scene_parameters', 'crown,press,push', '-parameter_push_range', '0,1', '-body_block_map_y', 'y + 0.05*(x/20)^2*(1 - y/16)',
                 '-fixed_block_top_y', '0 - press - 0.1*crown - 0.01*push')
        t = self.train(*three, '-model', 'a.h5', '-hyco_validation', 0, scene=BLOCKS)
        self.assertEqual((t['n_samples'], t['n_flexibilities']), (27, 1))

    def test_ranks_and_resume(self):
        """Two ranks make the same model; after a kill only what is missing is solved and factored again."""
        words = ('-values_radius', '4.02,4.06,4.1', '-values_load', '0.4,1')
        self.train(*words, '-model', 'one.h5', '-hyco_snapshots', 'one')
        self.train(*words, '-model', 'two.h5', '-hyco_snapshots', 'two', ranks=2)
        forces = []
        for model in ('one.h5', 'two.h5'):
            p = self.hyco('predict', '-model', model, '-mu', '4.07,0.9')
            forces.append((p['total_contact_force'], p['rid_u_norm2']))
        self.near(forces[0][0], forces[1][0], 1e-11)
        self.near(forces[0][1], forces[1][1], 1e-9)
        files = sorted(glob.glob(self.path('one', '*.h5')))
        kinds = [[f for f in files if os.path.basename(f).startswith(kind)] for kind in ('flexibility-', 'responses-')]
        self.assertEqual([len(k) for k in kinds], [3, 3])
        os.remove(kinds[0][1])
        before = {f: os.stat(f).st_mtime_ns for f in files if os.path.exists(f)}
        self.train(*words, '-model', 'one.h5', '-hyco_snapshots', 'one')
        changed = [f for f in files if os.stat(f).st_mtime_ns != before.get(f)]
        self.assertIn(kinds[0][1], changed)
        self.assertEqual(len(changed), 1, changed)
        p = self.hyco('predict', '-model', 'one.h5', '-mu', '4.07,0.9')
        self.near(p['total_contact_force'], forces[0][0], 1e-12)

    def test_order(self):
        """The active set starts at the last solution if that is near; the result is the same to the bit."""
        self.train('-values_radius', '4.02,4.06,4.1', '-values_load', '0.4,1', '-model', 'o.h5', '-hyco_snapshots', 'o')
        tables = []
        for loads in ('0.5,0.6,0.7,0.8,0.9', '0.9,0.6,0.8,0.5,0.7'):
            self.hyco('predict', '-model', 'o.h5', '-values_radius', '4.07', '-values_load', loads, '-table', 't.csv')
            with open(self.path('t.csv'), encoding='utf-8') as f:
                tables.append(sorted(line.split(',')[:4] for line in f))
        self.assertEqual(*tables)

    def test_refused(self):
        """Scenes and options that condensed models do not support are refused."""
        with open(self.path('points.csv'), 'w', encoding='utf-8') as f:
            f.write('radius,load\n4.02,0.5\n4.05,1\n4.1,0.5\n')
        train = ('train', *TYPE, '-model', 'no.h5', '-scene')
        self.refused('do not form a tensor grid', *train, PELLET, '-points', 'points.csv')
        self.refused('have one value of radius', *train, PELLET, '-grid', '1,3')
        self.refused('a condensed model needs one', *train, ROPE, '-grid', '2,2', '-hyco_linear', 'iterative')
        self.refused('the scene has no contact', *train, PLATE, '-grid', '2,2')
        self.refused('-greedy does not make', *train, ROPE, '-greedy', '-training_grid', '3,3')
        with open(os.path.join(BLOCKS, 'scene.yaml'), encoding='utf-8') as f, \
                open(self.path('held.yaml'), 'w', encoding='utf-8') as out:  # the top is pushed, not moved
            text = f.read().replace('blocks.msh', os.path.join(BLOCKS, 'blocks.msh'))
            out.write(re.sub(r'block_top: {y: -press}.*', '', text) + 'pressure: {block_top: 1e4*press}\n')
        self.refused('only contact does', *train, 'held.yaml', '-grid', '2,2')

    def test_damaged(self):
        """Entries that are not numbers, sizes that do not match, values out of order."""
        self.train('-grid', '3,2', '-model', 'good.h5', scene=ROPE)

        def nan(f):
            f['condensed/G'][1, 7] = np.nan

        def size(f):
            data = f['condensed/G'][:, :-1]
            del f['condensed/G']
            f['condensed/G'] = data

        def order(f):
            f['condensed/values_0'][:, 0] = f['condensed/values_0'][:, 0][::-1]

        def degree(f):
            f['condensed/degree_G'][0] = 3

        for damage in (nan, size, order, degree):
            with open(self.path('good.h5'), 'rb') as good, open(self.path('bad.h5'), 'wb') as bad:
                bad.write(good.read())
            with h5py.File(self.path('bad.h5'), 'r+') as f:
                damage(f)
                del f['sealed']  # the seal is invalid after the first change
            run = self.run_raw('predict', '-model', 'bad.h5', '-mu', '0.07,0.17')
            self.assertEqual(run.returncode, 1, damage.__name__)
            self.assertIn('condensed/', run.stderr, damage.__name__)

    def test_not_definite(self):
        """A flexibility that is not definite between its nodes is refused, not solved."""
        self.train('-values_mu1', '0.05,0.15,0.25', '-values_mu2', '0,0.5', '-model', 'n.h5', scene=ROPE)
        with h5py.File(self.path('n.h5'), 'r+') as f:
            f['condensed/G'][1] *= -1
            f['condensed/bounds'][:] = 0
            del f['sealed']
        self.refused('is not positive definite', 'predict', '-model', 'n.h5', '-mu', '0.15,0.2')


if __name__ == '__main__':
    unittest.main()
