"""Models of bodies on paths: exact while nothing flows, creep and yielding at unseen paths, one model on any number of ranks, refused scenes; on a small
ring that creeps or yields while its gap closes and opens."""
import os
import subprocess
import unittest

import h5py
import numpy as np

from baselines import POINT, Ring
from common import PATIENCE
from paths import HISTORY, J2, KINDS, NORTON, POINTS, SCENE, arrays

BODIES = ['-hyco_model_type', 'bodies']
# A core that moves and softens, elastic; a ring that creeps
MOVED = [('core: {young: 1e5', 'core: {map: {x: x*(1 - push*1e-3), y: y*(1 - push*1e-3)}, young: 1e5*(1.5 - gap*60)')]
# A ring that grows uniformly while its gap stays
GROWN = [('ring: {', 'ring: {map: {x: x*(1 + push*1e-2), y: y*(1 + push*1e-2)}, '), ('core: {', 'core: {map: {x: x*(1 + push*1e-2), y: y*(1 + push*1e-2)}, ')]
HOT = 'core: {temperature: 500 + 100*q*x, reference_temperature: 293, expansion: 1e-6, '


# A cap that contact alone holds, in height and in turns, on a base
CAP_MESH = """
Point(1) = {-1, -1, 0}; Point(2) = {1, -1, 0}; Point(3) = {1, 0, 0}; Point(4) = {-1, 0, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1}; Curve Loop(1) = {1, 2, 3, 4}; Plane Surface(1) = {1};
Point(5) = {-0.5, 0, 0}; Point(6) = {0.5, 0, 0}; Point(7) = {0.5, 0.5, 0}; Point(8) = {-0.5, 0.5, 0};
Line(5) = {5, 6}; Line(6) = {6, 7}; Line(7) = {7, 8}; Line(8) = {8, 5}; Curve Loop(2) = {5, 6, 7, 8}; Plane Surface(2) = {2};
Transfinite Curve{1:4} = 9; Transfinite Curve{5:8} = 5; Transfinite Surface{1:2}; Recombine Surface{1:2};
Physical Surface("base") = {1}; Physical Surface("cap") = {2};
Physical Curve("bottom") = {1}; Physical Curve("base_top") = {3}; Physical Curve("cap_bottom") = {5}; Physical Curve("cap_top") = {7};
"""
CAP = """
scene: {title: a cap that contact alone holds, mesh: cap.msh, parameters: [gap, push]}
parameter: {gap: {range: [0.0004, 0.0012]}, push: {range: [0.8, 1.2]}}
body: {base: {LAW, young: 1e5, poisson: 0.3}, cap: {CAP young: 1e5, poisson: 0.3}}
fixed: {bottom: {x: 0, y: 0}, cap_top: {x: 0}}
pressure: {cap_top: 100*push*q*(1 + 0.3*x)}
contact: {rest: {type: surface, slave: cap_bottom, master: base_top, tolerance: 0.1, gap: gap*x*x}}
history: {times: [0, 1, 3, 6, 10, 11, 12], tables: {q: [[0, 0.1], [1, 1], [10, 1], [11, 0.1], [12, 0.6]]}}
hyco: {substeps: 1}
"""


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
        """Laws that yield: Galerkin's method on the inelastic modes in whole cells, and interpolation of the laws at single points."""
        scene = self.scene('yields.yaml', J2)
        self.train('yields.h5', *BODIES, scene=scene, grid='4,4', store='yields')
        errors = self.errors('yields.h5', scene=scene)
        for kind, limit in (('u', 2e-3), ('sigma', 2e-2), ('lambda', 5e-2), ('inelastic', 1e-2)):
            self.assertLess(errors[kind], limit, kind)
        self.train('single.h5', *BODIES, '-hyco_bodies_laws', 'interpolation', scene=scene, grid='4,4', store='yields')
        errors = self.errors('single.h5', scene=scene)
        for kind, limit in (('u', 5e-3), ('sigma', 5e-2), ('lambda', 0.1), ('inelastic', 2e-2)):
            self.assertLess(errors[kind], limit, (kind, errors))

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

    def test_floating(self):
        """A body that contact alone holds beside one that creeps, and as one that creeps: its motions follow from equilibrium; without flow forces
        and displacements are those of full order."""
        with open(self.path('cap.geo'), 'w', encoding='utf-8') as f:
            f.write(CAP_MESH)
        subprocess.run(['gmsh', '-2', self.path('cap.geo'), '-v', '1', '-format', 'msh41', '-o', self.path('cap.msh')], check=True, timeout=60 * PATIENCE)
        for law, cap, modes, limit in (('law: elastic', '', 0, 1e-8), (NORTON, '', 5, 1e-3), (NORTON, NORTON + ',', 5, 1e-3)):
            scene = self.path('cap.yaml')
            with open(scene, 'w', encoding='utf-8') as f:
                f.write(CAP.replace('LAW', law).replace('CAP', cap))
            trained = self.train('cap.h5', *BODIES, scene=scene, store='cap' + str(limit) + cap[5:7])
            self.assertGreaterEqual(trained['n_inelastic_modes'], modes)
            errors = self.errors('cap.h5', '0.00055,0.91', scene=scene)
            self.assertLess(max(errors.values()), limit, (law, cap, errors))

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
                            ([*line, self.path('flat'), '-scene', flat, '-hyco_bodies_laws', 'cubature'], ['-hyco_bodies_laws', 'history']),
                            (['predict', '-model', self.path('damaged.h5'), '-mu', POINT], ['damaged.h5', 'bodies/inelastic/T'])):
            self.refused_in_one_line(words, *args)
        self.assertFalse(os.path.exists(self.path('no.h5')))


if __name__ == '__main__':
    unittest.main()
