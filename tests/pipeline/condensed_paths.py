"""The condensed model of paths: exact flexibility, modes of the inelastic strain, laws in few cells; on a small ring that creeps."""
import os
import unittest

import h5py

from paths import HISTORY, J2, KINDS, NORTON, POINTS, arrays
from baselines import POINT, Ring

CONDENSED = ['-hyco_model_type', 'condensed']
EVERY = [*CONDENSED, '-hyco_condensed_cells', '0', '-hyco_condensed_inelastic_tol', '0']
FEW = [*CONDENSED, '-hyco_condensed_cells', '1', '-hyco_condensed_inelastic_tol', '0']
LISTED = HISTORY.replace('[0, 1, 3, 6, 10, 11, 12]', '[0, 1, 1.5, 2, 3, 4, 6, 8, 10, 10.25, 10.5, 10.75, 11, 11.25, 11.5, 12]')
STEPS = ['-hyco_step_inelastic', '1']  # each from one listed time to the next
HOT = 'core: {temperature: 500 + 100*q*x, reference_temperature: 293, expansion: 1e-6, '


class CondensedPaths(Ring):
    def errors(self, model, *args, **options):
        report = self.compare(model, *args, **options)
        return {kind: report['worst_' + kind]['max'] for kind in KINDS}

    @classmethod
    def altered(cls, name, law, history, *changes):
        scene = cls.scene(name, law, history)
        with open(scene, encoding='utf-8') as f:
            return cls.changed(scene, f.read(), changes)

    def test_training_point(self):
        """Every cell and every mode: the full order's path at a training point, with the gap closing and opening. For creep alone also with few
        cells."""
        hot = [('core: {', HOT), ('sym_y0: {y: 0}', 'sym_y0: {y: 1e-3*q*push}'), ('\ncontact:', '\nforce: {ring: {x: -0.1*q*x}}\ncontact:')]
        for name, law, changes, each in (('norton', NORTON, [], (EVERY, FEW)), ('hot', NORTON, hot, (EVERY, FEW)), ('j2', J2, [], (EVERY,))):
            scene = self.altered(name + '-listed.yaml', law, LISTED, *changes)
            for settings in each:
                trained = self.train('every.h5', *settings, *STEPS, scene=scene, grid='2,1', store=name)
                self.assertEqual(trained['rid_fraction'] == 1, settings is EVERY)
                errors = self.errors('every.h5', '0.007,1', *STEPS, scene=scene)
                self.assertLess(max(errors.values()), 1e-6, (name, settings, errors))

    def test_no_flow(self):
        """A path without inelastic flow: the full order's forces, and those of the condensed model without a history under the same load."""
        flat = self.altered('flat.yaml', 'law: elastic', '', ('*q*', '*'))
        self.train('flat.h5', *CONDENSED, scene=flat, grid='3,3', store='flat')
        elastic = self.hyco('predict', '-model', self.path('flat.h5'), '-mu', POINT)
        for law in ('law: elastic', 'law: j2, yield: 1e9, hardening: 2000, element: standard'):
            scene = self.scene('firm.yaml', law)
            trained = self.train('firm.h5', *CONDENSED, scene=scene, grid='2,2', store=law[5:7])
            self.assertEqual(trained['n_inelastic_modes'], 0)
            history = self.predict('firm.h5')['history']
            self.near(history['total_contact_force'][1], elastic['total_contact_force'], 1e-8)
            self.near(history['lambda_max'][1], elastic['lambda_max'], 1e-8)
            errors = self.errors('firm.h5', scene=scene)
            self.assertLess(max(errors.values()), 1e-7, errors)

    def test_unseen(self):
        """Between training points: few cells are nearly as good as all, and more modes better than few."""
        errors = []
        for tol, cells in (('1e-4', '1'), ('1e-10', '2'), ('1e-10', '0')):
            trained = self.train('unseen.h5', *CONDENSED, '-hyco_condensed_inelastic_tol', tol, '-hyco_condensed_cells', cells)
            errors.append(self.errors('unseen.h5'))
            if cells == '1':
                self.assertLess(trained['rid_elements'], 8)
        for kind in KINDS:
            self.assertLess(errors[1][kind], 0.005)
            self.assertLess(errors[1][kind], errors[0][kind])
            self.assertLess(errors[2][kind], errors[1][kind] + 1e-6)

    def test_order_of_questions(self):
        """A point's path is the same to the last bit whatever was predicted before it."""
        self.train('order.h5', *CONDENSED)
        self.same_in_any_order('order.h5', POINTS)

    def test_ranks(self):
        """One and two ranks train the same model."""
        for settings in (CONDENSED, EVERY):
            reports, histories = [], []
            for ranks in (0, 2):
                reports.append(self.train(f'ranks{ranks}.h5', *settings, '-hyco_condensed_inelastic_tol', '1e-8', ranks=ranks))
                histories.append(self.predict(f'ranks{ranks}.h5')['history'])
            self.same_models(reports, ('n_modes', 'n_inelastic_modes', 'rid_elements', 'rid_contacts'), histories)

    def test_outputs(self):
        """The series has the whole mesh's fields by replay, view describes the model; held-out paths judge it."""
        self.hyco('solve', '-scene', self.norton, '-mu', POINT, '-output', self.path('full.xdmf'))
        trained = self.train('series.h5', *CONDENSED, '-hyco_validation', '12', status=None)
        self.assertEqual((trained['held_out']['n'], trained['held_out']['not_converged']), (12, 0))
        self.assertLess(trained['held_out']['u']['largest'], 0.01)
        self.assertGreater(self.predict('series.h5', '-output', self.path('path.xdmf'))['estimated_error_u'], 0)
        full, reduced = arrays(self.path('full.h5')), arrays(self.path('path.h5'))
        self.assertEqual(full.keys(), reduced.keys())
        steps = [n for n in full if n.endswith('nodes/displacement')]
        size = max(abs(full[n]).max() for n in steps)
        self.assertLess(max(abs(full[n] - reduced[n]).max() for n in steps), 0.01 * size)
        view = self.run_raw('view', '-model', self.path('series.h5')).stdout
        for words in ('condensed model', 'inelastic modes: ', 'laws in'):
            self.assertIn(words, view)

    def test_refused(self):
        """Unsupported features are refused in one line."""
        line = ['train', '-model', self.path('no.h5'), '-grid', '3,1', '-grid_type', 'centred', *CONDENSED, '-hyco_snapshots']
        yields = self.scene('yields.yaml', J2)
        stiff = self.altered('stiff.yaml', NORTON, HISTORY, ('core: {young: 1e5', 'core: {young: 1e5*push'))
        aging = self.altered('aging.yaml', NORTON, HISTORY, ('core: {young: 1e5', 'core: {young: 1e5*(1 + 0.01*t)'))
        springs = self.altered('springs.yaml', NORTON, HISTORY, ('\ncontact:', '\nspring: {core_outside: {x: 1}}\ncontact:'))
        free = self.altered('free.yaml', NORTON, HISTORY, ('sym_x0: {x: 0}, ', ''))
        flat = self.altered('flat.yaml', 'law: elastic', '', ('*q*', '*'))
        self.train('damaged.h5', *CONDENSED, grid='2,2')
        with h5py.File(self.path('damaged.h5'), 'r+') as f:
            rows = f['condensed/inelastic'][:-1]
            del f['condensed/inelastic']
            f['condensed/inelastic'] = rows
            del f['sealed']
        for args, words in (([*line, self.path('stiff'), '-scene', stiff], ['push', 'stiffness', 'cubature']),
                            ([*line, self.path('aging'), '-scene', aging], ['t affects', 'stiffness']),
                            ([*line, self.path('springs'), '-scene', springs], ['springs', 'hybrid']),
                            ([*line, self.path('free'), '-scene', free], ['no support keeps', 'hybrid']),
                            ([*line, self.path('yields'), '-scene', yields, '-hyco_condensed_inelastic_tol', '1e-8', '-hyco_condensed_cells', '1'], ['-hyco_condensed_cells']),
                            ([*line, self.path('flat'), '-scene', flat, '-hyco_condensed_cells', '0'], ['-hyco_condensed_cells', 'history']),
                            ([*line, self.path('flat'), '-scene', flat, '-hyco_keep_singular'], ['-hyco_keep_singular', 'history']),
                            ([*line, self.path('x'), '-scene', self.norton, '-hyco_dual', 'nnmf'], ['-hyco_dual', 'projection']),
                            (['predict', '-model', self.path('damaged.h5'), '-mu', POINT], ['damaged.h5', 'condensed/inelastic'])):
            self.refused_in_one_line(words, *args)
        self.assertFalse(os.path.exists(self.path('no.h5')))


if __name__ == '__main__':
    unittest.main()
