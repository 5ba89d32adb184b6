"""Models of bodies on paths: exact while nothing flows, creep and yielding at unseen paths, one model on any number of ranks, refused scenes; on a small
ring that creeps or yields while its gap closes and opens."""
import os
import unittest

import h5py
import numpy as np

from baselines import POINT, Ring
from paths import HISTORY, J2, KINDS, NORTON, POINTS, SCENE, arrays

BODIES = ['-hyco_model_type', 'bodies']
# A core that moves and softens, elastic; a ring that creeps
MOVED = [('core: {young: 1e5', 'core: {map: {x: x*(1 - push*1e-3), y: y*(1 - push*1e-3)}, young: 1e5*(1.5 - gap*60)')]
# A ring that grows uniformly while its gap stays
GROWN = [('ring: {', 'ring: {map: {x: x*(1 + push*1e-2), y: y*(1 + push*1e-2)}, '), ('core: {', 'core: {map: {x: x*(1 + push*1e-2), y: y*(1 + push*1e-2)}, ')]
HOT = 'core: {temperature: 500 + 100*q*x, reference_temperature: 293, expansion: 1e-6, '


class BodiesPath(Ring):
    def errors(self, model, *args, **options):
        report = self.compare(model, *args, **options)
        self.assertEqual(report['not_converged'], 0)
        self.assertLess(report['kkt_max'], 1e-9)
        return {kind: report['worst_' + kind]['max'] for kind in KINDS}

    @classmethod
    def altered(cls, name, law, history, *changes):
        scene = cls.scene(name, law, history)
        with open(scene, encoding='utf-8') as f:
            return cls.changed(scene, f.read(), changes)

    def test_no_flow(self):
        """A path that stays elastic has no inelastic mode; forces, stresses and displacements are those of full order."""
        for law in ('law: elastic', 'law: j2, yield: 1e9, hardening: 2000, element: standard', 'law: norton, rate: 1e-60, exponent: 3'):
            scene = self.scene('firm.yaml', law)
            trained = self.train('firm.h5', *BODIES, scene=scene, grid='2,2', store='firm-' + law[5:7])
            self.assertEqual(trained['n_inelastic_modes'], 0, law)
            errors = self.errors('firm.h5', scene=scene)
            self.assertLess(max(errors['lambda'], errors['sigma'], errors['u']), 1e-8, (law, errors))

    def test_unseen(self):
        """Creep at a path between training points: errors follow the modes; a cubature is as good as interpolation in all cells."""
        errors = []
        for tol in ('1e-4', '1e-8', '1e-12'):
            trained = self.train('unseen.h5', *BODIES, '-hyco_bodies_inelastic_tol', tol)
            errors.append(self.errors('unseen.h5'))
            self.assertLess(trained['n_inelastic_modes'], 32)
        for kind in KINDS:
            self.assertLess(errors[1][kind], 2e-3, kind)
            self.assertLess(errors[2][kind], 5e-4, kind)
            self.assertLess(errors[2][kind], errors[0][kind], kind)
        self.train('unseen.h5', *BODIES, '-hyco_bodies_laws', 'cubature')
        self.assertLess(max(self.errors('unseen.h5').values()), 1e-3)

    def test_yields(self):
        """Laws that yield: Galerkin's method on the inelastic modes, where interpolation ends with a message that names the options."""
        scene = self.scene('yields.yaml', J2)
        self.train('yields.h5', *BODIES, scene=scene, grid='4,4', store='yields')
        errors = self.errors('yields.h5', scene=scene)
        for kind, limit in (('u', 2e-3), ('sigma', 2e-2), ('lambda', 5e-2), ('inelastic', 1e-2)):
            self.assertLess(errors[kind], limit, kind)
        self.refused_in_one_line(['-hyco_bodies_cells', '-hyco_bodies_inelastic_tol'], 'train', '-scene', scene, '-model', self.path('no.h5'), '-grid', '4,4', '-grid_type',
                                 'centred', '-hyco_snapshots', self.path('yields'), *BODIES, '-hyco_bodies_laws', 'interpolation')
        self.assertFalse(os.path.exists(self.path('no.h5')))

    def test_moved(self):
        """An elastic body that grows uniformly and softens with the parameters needs no sample beside a ring that creeps."""
        scene = self.altered('moved.yaml', NORTON, HISTORY, *MOVED)
        self.train('moved.h5', *BODIES, scene=scene, store='moved')
        errors = self.errors('moved.h5', scene=scene)
        self.assertLess(max(errors.values()), 5e-3, errors)

    def test_grown(self):
        """A body that creeps and grows uniformly: forces of its stresses follow its size."""
        scene = self.altered('grown.yaml', NORTON, HISTORY, *GROWN)
        for laws in ('interpolation', 'cubature'):
            self.train('grown.h5', *BODIES, '-hyco_bodies_laws', laws, scene=scene, store='grown')
            errors = self.errors('grown.h5', scene=scene)
            self.assertLess(max(errors.values()), 5e-3, (laws, errors))

    def test_points(self):
        """Interpolation evaluates laws at no more than two points a mode; a model without points is refused in one line."""
        trained = self.train('points.h5', *BODIES, grid='2,2')
        with h5py.File(self.path('points.h5'), 'r+') as f:
            self.assertLessEqual(len(f['bodies/inelastic/point']), 2 * trained['n_inelastic_modes'])
            del f['bodies/inelastic/point']
            del f['sealed']
        self.refused_in_one_line(['points.h5', 'earlier version', 'train it again'], 'predict', '-model', self.path('points.h5'), '-mu', POINT)

    def test_heat(self):
        """Temperatures of elastic and of creeping bodies that change along the path, prescribed displacements and body forces are loads."""
        scene = self.altered('hot.yaml', NORTON, HISTORY, ('core: {', HOT), ('ring: {', HOT.replace('core', 'ring')), ('sym_y0: {y: 0}', 'sym_y0: {y: 1e-3*q*push}'),
                             ('\ncontact:', '\nforce: {ring: {x: -0.1*q*x}}\ncontact:'))
        for laws in ('interpolation', 'cubature'):
            self.train('hot.h5', *BODIES, '-hyco_bodies_laws', laws, scene=scene, store='hot')
            errors = self.errors('hot.h5', scene=scene)
            self.assertLess(max(errors.values()), 5e-3, (laws, errors))

    def test_order_of_questions(self):
        """A point's path is the same to the last bit whatever was predicted before it."""
        self.train('order.h5', *BODIES)
        self.same_in_any_order('order.h5', POINTS)

    def test_ranks(self):
        """One to three ranks train the same model, by interpolation and by cubature."""
        for settings in ([], ['-hyco_bodies_laws', 'cubature']):
            reports, histories = [], []
            for ranks in (0, 2, 3):
                reports.append(self.train(f'ranks{ranks}.h5', *BODIES, *settings, '-hyco_bodies_inelastic_tol', '1e-8', ranks=ranks))
                histories.append(self.predict(f'ranks{ranks}.h5')['history'])
            for k in (1, 2):
                self.same_models([reports[0], reports[k]], ('n_modes', 'n_inelastic_modes', 'rid_elements', 'n_surface_unknowns'), [histories[0], histories[k]])

    def test_outputs(self):
        """The series has the whole mesh's fields by replay, view describes the model; held-out paths judge it."""
        self.hyco('solve', '-scene', self.norton, '-mu', POINT, '-output', self.path('full.xdmf'))
        trained = self.train('series.h5', *BODIES, '-hyco_validation', '12', status=None)
        self.assertEqual((trained['held_out']['n'], trained['held_out']['not_converged']), (12, 0))
        self.assertLess(trained['held_out']['u']['largest'], 0.01)
        self.assertGreater(self.predict('series.h5', '-output', self.path('path.xdmf'))['estimated_error_u'], 0)
        full, reduced = arrays(self.path('full.h5')), arrays(self.path('path.h5'))
        self.assertEqual(full.keys(), reduced.keys())
        steps = [n for n in full if n.endswith('nodes/displacement')]
        size = max(abs(full[n]).max() for n in steps)
        self.assertLess(max(abs(full[n] - reduced[n]).max() for n in steps), 0.005 * size)
        view = self.run_raw('view', '-model', self.path('series.h5')).stdout
        for words in ('inelastic modes: ', 'laws at'):
            self.assertIn(words, view)

    def test_refused(self):
        """Unsupported scenes, and a damaged file, are refused in one line."""
        line = ['train', '-model', self.path('no.h5'), '-grid', '3,1', '-grid_type', 'centred', *BODIES, '-hyco_snapshots']
        ratio = self.altered('ratio.yaml', NORTON, HISTORY, ('LAW'.replace('LAW', NORTON) + ', young: 1e5', NORTON + ', young: 1e5*(1 + 0.1*push*x)'))
        turned = self.altered('turned.yaml', NORTON, HISTORY, (NORTON, 'map: {x: x*cos(gap) - y*sin(gap), y: x*sin(gap) + y*cos(gap)}, ' + NORTON))
        aging = self.altered('aging.yaml', NORTON, HISTORY, ('core: {young: 1e5', 'core: {young: 1e5*(1 + 0.01*t)'))
        free = self.altered('free.yaml', NORTON, HISTORY, ('sym_x0: {x: 0}, ', ''))
        flat = self.altered('flat.yaml', 'law: elastic', '', ('*q*', '*'))
        self.train('damaged.h5', *BODIES, grid='2,2')
        with h5py.File(self.path('damaged.h5'), 'r+') as f:
            rows = f['bodies/inelastic/T'][:-1]
            del f['bodies/inelastic/T']
            f['bodies/inelastic/T'] = rows
            del f['sealed']
        for args, words in (([*line, self.path('ratio'), '-scene', ratio], ['push', 'ring', 'hybrid']),
                            ([*line, self.path('turned'), '-scene', turned], ['ring', 'hybrid']),
                            ([*line, self.path('aging'), '-scene', aging], ['t affects', 'stiffness', 'hybrid']),
                            ([*line, self.path('free'), '-scene', free], ['no support keeps', 'hybrid']),
                            ([*line, self.path('flat'), '-scene', flat, '-hyco_bodies_laws', 'cubature'], ['-hyco_bodies_laws', 'history']),
                            (['predict', '-model', self.path('damaged.h5'), '-mu', POINT], ['damaged.h5', 'bodies/inelastic/T'])):
            self.refused_in_one_line(words, *args)
        self.assertFalse(os.path.exists(self.path('no.h5')))


if __name__ == '__main__':
    unittest.main()
