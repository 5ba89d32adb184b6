"""The baselines of the hybrid model for paths: cubature and regression, on a small ring that creeps while its gap closes and opens."""
import os
import unittest

import h5py
import numpy as np

from common import ROPE
from paths import COLUMNS, KINDS, POINTS, FlowingRing, arrays

CUBATURE = ['-hyco_model_type', 'cubature']
REGRESSION = ['-hyco_model_type', 'regression']
POINT = '0.0055,0.91'  # no training point of the grids here


class Ring(FlowingRing):
    def train(self, model, *args, scene=None, grid='3,3', store='store', **options):
        return self.hyco('train', '-scene', scene or self.norton, '-model', self.path(model), '-grid', grid, '-grid_type', 'centred', '-hyco_snapshots', self.path(store), *args,
                         **options)

    def compare(self, model, point=POINT, *args, scene=None, **options):
        return self.hyco('compare', '-scene', scene or self.norton, '-model', self.path(model), '-mu', point, *args, **options)

    def predict(self, model, *args):
        return self.hyco('predict', '-model', self.path(model), '-mu', POINT, *args)


class Baselines(Ring):
    def test_all_cells(self):
        """Every cell once, to round-off: the hybrid model on the whole mesh; with force vectors the projection-based one."""
        for dual, other in (('fe', ['-hyco_rid_whole', '-hyco_hybrid', 'contact']), ('nnmf', ['-hyco_model_type', 'projection'])):
            self.train('other.h5', *other, '-hyco_pod_tol', '1e-8')
            trained = self.train('all.h5', *CUBATURE, '-hyco_cubature_tol', '0', '-hyco_dual', dual, '-hyco_pod_tol', '1e-8')
            self.assertEqual((trained['model_type'], trained['rid_fraction'], trained['cubature_error']), ('cubature', 1, 0))
            one, all_of_them = (self.predict(name)['history'] for name in ('other.h5', 'all.h5'))
            for column in COLUMNS:
                a, b = np.array(one[column]), np.array(all_of_them[column])
                self.assertLess(abs(a - b).max(), 1e-9 * abs(a).max(), (dual, column))

    def test_unseen(self):
        """Few cells: their training error is the requested one; the errors at an unseen point are nearly those with all cells."""
        for dual in ('fe', 'nnmf'):
            settings = [*CUBATURE, '-hyco_dual', dual, '-hyco_pod_tol', '1e-8']
            self.train('all.h5', *settings, '-hyco_cubature_tol', '0')
            base = self.compare('all.h5')
            self.assertLess(base['worst_lambda']['max'], 0.01 if dual == 'fe' else 0.15)
            shares = []
            for tol, factor in (('1e-3', 4), ('1e-5', 1.2)):
                trained = self.train('some.h5', *settings, '-hyco_cubature_tol', tol)
                shares.append(trained['rid_fraction'])
                self.assertLessEqual(trained['cubature_error'], 3 * float(tol))
                report = self.compare('some.h5')
                for kind in KINDS:
                    self.assertLess(report['worst_' + kind]['max'], factor * base['worst_' + kind]['max'] + 30 * float(tol), (dual, tol, kind))
            self.assertLess(shares[0], shares[1])
            self.assertLess(shares[1], 0.9)
            with h5py.File(self.path('some.h5')) as f:
                weight = f['cubature/weight'][:]
            self.assertGreater(weight.min(), 0)
            self.assertGreater(len(weight), trained['n_modes'] / 3)  # points enough for the modes
            self.assertGreater(len(set(weight.ravel())), 5)

    def test_one_displacement_a_contact(self):
        """One full-order displacement for each contact: fewer unknowns and cells, forces nearly as good."""
        trained = {}
        for hybrid in ('contact', 'rank'):
            trained[hybrid] = self.train('few.h5', *CUBATURE, '-hyco_hybrid', hybrid, '-hyco_pod_tol', '1e-8')
            report = self.compare('few.h5')
            for kind, limit in zip(KINDS, (0.01, 0.01, 0.01, 0.005)):
                self.assertLess(report['worst_' + kind]['max'], limit, (hybrid, kind))
        self.assertEqual(trained['rank']['n_fe_dofs'], trained['rank']['rid_contacts'])
        self.assertLess(trained['rank']['n_fe_dofs'], trained['contact']['n_fe_dofs'] / 3)
        self.assertLess(trained['rank']['rid_elements'], trained['contact']['rid_elements'])

    def test_without_history(self):
        """Scenes without a history: body forces, pressure and contact integrated over few cells."""
        scene = self.scene('elastic.yaml', 'law: elastic', '')
        with open(scene, encoding='utf-8') as f:
            text = f.read().replace('*q*', '*') + 'force: {core: {x: -2*push*x}}\n'
        with open(scene, 'w', encoding='utf-8') as f:
            f.write(text + 'hyco: {rid_groups: core_outside}\n')  # not for a cubature
        errors = {}
        for name, settings in (('whole.h5', [*CUBATURE, '-hyco_cubature_tol', '0']), ('cells.h5', [*CUBATURE, '-hyco_cubature_tol', '1e-6']),
                               ('regression.h5', REGRESSION)):
            trained = self.train(name, *settings, '-hyco_pod_tol', '1e-9', scene=scene, store='elastic')
            report = self.compare(name, scene=scene)
            errors[name] = {kind: report['error_' + kind]['max'] for kind in ('u', 'lambda')}
            if name == 'cells.h5':
                self.assertLess(trained['rid_fraction'], 0.9)
        for kind in ('u', 'lambda'):
            self.assertLess(errors['cells.h5'][kind], 1.2 * errors['whole.h5'][kind] + 1e-4)
        self.assertLess(errors['regression.h5']['u'], 0.02)

    def test_regression(self):
        """Training values at training points; near them elsewhere, and the residuals show that bodies may penetrate."""
        for kernel in ('cubic', 'thin_plate', 'linear'):
            self.train('regression.h5', *REGRESSION, '-hyco_regression_kernel', kernel, '-hyco_pod_tol', '1e-12', '-hyco_rid_layers', '1')
            report = self.compare('regression.h5', '0.006,1')
            for kind, limit in zip(KINDS, (1e-5, 1e-9, 1e-9, 1e-9)):
                self.assertLess(report['worst_' + kind]['max'], limit, (kernel, kind))
            report = self.compare('regression.h5')
            for kind, limit in zip(KINDS, (0.1, 0.1, 0.5, 0.2)):
                self.assertLess(report['worst_' + kind]['max'], limit, (kernel, kind))
            self.assertGreater(report['kkt_max'], 1e-6)
        history = self.predict('regression.h5')['history']
        self.assertTrue(history['ended'])
        self.assertGreaterEqual(min(history['lambda_max']), 0)
        self.assertEqual(len(history['t']), 7)

    def test_one_value(self):
        """A parameter with one training value: the regression is constant along it."""
        self.train('flat.h5', *REGRESSION, grid='3,1')
        report = self.compare('flat.h5', '0.006,1')
        self.assertLess(report['worst_lambda']['max'], 1e-9)

    def test_order_of_questions(self):
        """A point's path is the same to the last bit whatever was predicted before it."""
        for settings in (CUBATURE, REGRESSION):
            self.train('order.h5', *settings, '-hyco_pod_tol', '1e-8')
            self.same_in_any_order('order.h5', POINTS)

    def test_ranks(self):
        """One and two ranks train the same model."""
        for settings in (CUBATURE, [*CUBATURE, '-hyco_dual', 'nnmf'], REGRESSION):
            reports, histories = [], []
            for ranks in (0, 2):
                reports.append(self.train(f'ranks{ranks}.h5', *settings, '-hyco_pod_tol', '1e-8', ranks=ranks))
                histories.append(self.predict(f'ranks{ranks}.h5')['history'])
            self.same_models(reports, ('n_modes', 'rid_elements', 'rid_contacts'), histories)

    def test_outputs(self):
        """The series has the whole mesh's fields by replay, view describes the model."""
        self.hyco('solve', '-scene', self.norton, '-mu', POINT, '-output', self.path('full.xdmf'))
        full = arrays(self.path('full.h5'))
        for settings, word in ((CUBATURE, 'cubature: '), (REGRESSION, 'regression: ')):
            self.train('series.h5', *settings, '-hyco_pod_tol', '1e-8')
            self.predict('series.h5', '-output', self.path('path.xdmf'))
            reduced = arrays(self.path('path.h5'))
            self.assertEqual(full.keys(), reduced.keys())
            steps = [n for n in full if n.endswith('nodes/displacement')]
            size = max(abs(full[n]).max() for n in steps)
            self.assertLess(max(abs(full[n] - reduced[n]).max() for n in steps), 0.1 * size, word)
            self.assertIn(word, self.run_raw('view', '-model', self.path('series.h5')).stdout)

    def test_refused(self):
        """Unsupported features are refused in one line."""
        train = ['train', '-scene', self.norton, '-model', self.path('no.h5'), '-grid', '2,2']
        self.train('damaged.h5', *CUBATURE, grid='2,2')
        self.train('short.h5', *REGRESSION, grid='2,2')
        with h5py.File(self.path('short.h5'), 'r+') as f:
            for name in ('gamma', 'Lambda', 'sigma', 'inelastic'):
                rows = f['regression'][name][:-1]
                del f['regression'][name]
                f['regression'][name] = rows
            del f['sealed']
        flat = self.scene('flat.yaml', 'law: elastic', '')
        with open(flat, encoding='utf-8') as f:
            text = f.read().replace('*q*', '*')
        with open(flat, 'w', encoding='utf-8') as f:
            f.write(text)
        with h5py.File(self.path('damaged.h5'), 'r+') as f:
            f['cubature/weight'][0] = -1
            del f['sealed']
        for args, words in ((['train', '-scene', ROPE, '-model', self.path('no.h5'), '-grid', '3,3', *CUBATURE], ['cubature', 'in 1D']),
                            ([*train, *CUBATURE, '-hyco_cubature_tol', '1', '-hyco_snapshots', self.path('store')], ['-hyco_cubature_tol', 'misses']),
                            ([*train, '-hyco_cubature_tol', '1e-3'], ['-hyco_cubature_tol', 'cubature', 'hybrid']),
                            ([*train, *CUBATURE, '-hyco_hybrid', 'all'], ['-hyco_hybrid', 'contact', 'rank']),
                            (['train', '-scene', self.norton.replace('norton', 'flat'), '-model', self.path('no.h5'), '-greedy', '-training_grid', '3,3', *CUBATURE],
                             ['-greedy', 'cubature']),
                            ([*train, *REGRESSION, '-hyco_dual', 'nnmf'], ['-hyco_dual', 'projection']),
                            (['predict', '-model', self.path('damaged.h5'), '-mu', POINT], ['damaged.h5', 'cubature/weight']),
                            (['predict', '-model', self.path('short.h5'), '-mu', POINT], ['short.h5', 'regression/gamma'])):
            self.refused_in_one_line(words, *args)
        self.assertFalse(os.path.exists(self.path('no.h5')))


class Judged(Ring):
    """Held-out errors and estimates, as for any other model."""
    newcomer = True

    def test_held_out(self):
        """The held-out errors of baselines are below their limits, at the corners of the ranges too."""
        for settings, kind, limit in ((CUBATURE, 'u', 0.01), ([*CUBATURE, '-hyco_dual', 'nnmf'], 'u', 0.1), (REGRESSION, 'lambda', 0.3)):
            trained = self.train('judged.h5', *settings, '-grid_type', 'closed', '-hyco_pod_tol', '1e-8', '-hyco_validation', '12', '-hyco_search', 'false',
                                 store='closed', status=None)  # with the corners, at which held-out points lie too
            self.assertEqual((trained['held_out']['n'], trained['held_out']['not_converged']), (12, 0))
            self.assertLess(trained['held_out'][kind]['largest'], limit)
            self.assertGreater(self.predict('judged.h5')['estimated_error_u'], 0)


if __name__ == '__main__':
    unittest.main()
