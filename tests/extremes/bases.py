"""Extreme bases: tolerances from 1 to 1e-16, snapshots that repeat, vanish or are nearly dependent, more modes than the RID
can support. (Singular values down to 1e-12 of the first: tests/unit/pod.c.)"""
import unittest

from extreme import BODIES, SEEN, TRAIN, UNSEEN, Extreme, blocks, points

PROJECTION = ('-hyco_model_type', 'projection', '-hyco_dual', 'snapshots')
AWAY = ('-hyco_rid_modes', 'displacement', '-hyco_pod_max_modes', 1, '-hyco_rid_region', 'y > 1.5 ? 1 : -1')
WHOLE = ('-hyco_rid_whole', 'true', '-hyco_hybrid', 'contact')
ALL = ('-hyco_pod_tol', '0', '-hyco_pod_noise', '1e-15')


class Bases(Extreme):
    name = 'bases'

    def both(self, case, scene, train, test, hybrid, projection, *options):
        """Errors of the two models (the hybrid one's modes on the whole mesh, its contacts full order), and their bounds."""
        for model, more, bound in (('hybrid', WHOLE, hybrid), ('projection', PROJECTION, projection)):
            t = self.train(scene, *train, *more, *options)
            self.row(case, f"{model}: error with {t['n_modes']} modes", self.worst(self.compare(scene, *test)), bound)

    def forces(self, case, scene, train, test, *options, bound=1e-9):
        """The forces of a model of bodies, which do not depend on a basis."""
        self.train(scene, *train, *BODIES, *options)
        self.row(case, 'bodies: error of the forces', self.compare(scene, *test)['error_lambda']['max'] or 0, bound)

    def test_tolerance(self):
        """POD tolerances from 1 to 1e-16: no modes are refused, many are accurate."""
        scene = self.scene(*blocks(crown=0.1, n=(6, 6)))
        for tol in ('0.5', '1e-16'):
            self.forces(f'POD tolerance {tol}, between training points', scene, TRAIN, UNSEEN, '-hyco_pod_tol', tol)
        self.refused('POD tolerance 1', 'train', '-scene', scene, '-model', 'm.h5', *TRAIN, '-hyco_pod_tol', 1,
                     says='leaves no mode')
        for tol, bound in (('0.5', 1), ('1e-2', 1), ('1e-4', 0.3), ('1e-8', 1e-2), ('1e-12', 1e-7), ('1e-16', 1e-7)):
            self.both(f'POD tolerance {tol}, at a training point', scene, TRAIN, SEEN, bound, bound, '-hyco_pod_tol', tol)

    def test_repeated(self):
        """Solutions repeated exactly, and with relative changes of 1e-9 and 1e-13: each is reproduced."""
        scene = self.scene(*blocks(crown=0.1, n=(6, 6)))
        for case, values in (('twice', (0.06, 0.06, 0.05)), ('apart by 1e-9', (0.06, 0.06 * (1 + 1e-9), 0.05)),
                             ('apart by 1e-13', (0.06, 0.06 * (1 + 1e-13), 0.05))):
            self.both(f'a solution {case}', scene, points(values, (0.02,)), SEEN, 1e-7, 1e-7, *ALL)
        scene = self.scene(*blocks(crown=0.1, n=(6, 6), gaps=(0.02, 0.02)))
        for case, values in (('twice', (0.06, 0.06, 0.05)), ('apart by 1e-9', (0.06, 0.06 * (1 + 1e-9), 0.05)),
                             ('apart by 1e-13', (0.06, 0.06 * (1 + 1e-13), 0.05))):
            self.forces(f'a solution {case}', scene, points(values, (0.02,)), points((0.055, 0.08), (0.02,)))

    def test_rank_one(self):
        """No gap, so that every solution is a multiple of one (the paper's S1): one mode, exact for any press; and zeros."""
        scene = self.scene(*blocks(press=(0, 0.1), gaps=(0, 0.2)))
        for case, train in (('no gap: solutions of rank one', (0.02, 0.04, 0.08)), ('a zero solution among them', (0, 0.04)),
                            ('one solution', (0.04,))):
            self.both(case, scene, points(train, (0,)), points((0.05,), (0,)), 1e-9, 1e-9)
        for model, more in (('hybrid', WHOLE), ('projection', PROJECTION)):
            self.refused(f'{model}, zero solutions alone', 'train', '-scene', scene, '-model', 'm.h5',
                         *points((0,), (0, 0.2)), *more, says='zero displacement')
        scene = self.scene(*blocks(press=(0, 0.1), gaps=(0, 0)))
        for case, train in (('no gap: solutions of rank one', (0.02, 0.04, 0.08)), ('a zero solution among them', (0, 0.04))):
            self.forces(case, scene, points(train, (0,)), points((0.05,), (0,)))

    def test_no_force(self):
        """No training solution has contact forces: exact where there is no contact; where there is, the hybrid model with
        full-order contact displacements still keeps the gaps closed, and a model without forces reports that it does not
        converge."""
        scene = self.scene(*blocks(press=(0, 0.1), gaps=(0, 0.2)))
        train = points((0.02, 0.04), (0.1, 0.2))
        self.both('no force in any solution, none tested', scene, train, points((0.05,), (0.12,)), 1e-9, 1e-9)
        self.row('no force in any solution, contact tested', 'bodies: error of the forces',
                 self.bodies(scene, train, points((0.05,), (0.02,))), 1e-9)
        self.train(scene, *train, '-hyco_rid_whole', 'true', '-hyco_hybrid', 'all')
        self.row('no force in any solution, contact tested', 'hybrid, all displacements full order: error',
                 self.worst(self.compare(scene, *points((0.05,), (0.02,)))), 1e-9)
        touches = ('predict', '-model', 'm.h5', '-mu', '0.05,0.02')
        for name, more in (('projection', PROJECTION), ('hybrid, no contact in the RID', AWAY)):
            self.train(scene, *train, *more)
            self.hyco('predict', '-model', 'm.h5', '-mu', '0.05,0.12')
            self.refused(f'no force in any solution, contact tested, {name}', *touches, says='has no contact forces, and bodies')
            self.refused(f'the same, {name}, compared', 'compare', '-scene', scene, '-model', 'm.h5',
                         *points((0.05,), (0.02, 0.12)), says='1 of the 2 predictions did not converge')
            p = self.hyco(*touches, '-hyco_fallback', '-scene', scene)
            self.assertTrue(p['full_order'])

    def test_too_many(self):
        """Modes of 40 solutions on an RID of few nodes: training either refuses the model, or it is accurate."""
        scene = self.scene(*blocks(crown=0.1, n=(6, 6)))
        train = points((0.04, 0.045, 0.05, 0.055, 0.06, 0.065, 0.07, 0.08), (0, 0.005, 0.01, 0.015, 0.02))
        self.refused('40 solutions, 4 cells in the RID', 'train', '-scene', scene, '-model', 'm.h5', *train, '-hyco_pod_tol', 0,
                     '-hyco_rid_modes', 'dual', says='misses its own training displacements')
        t = self.train(scene, *train, *WHOLE, *ALL)
        self.assertLess(t['n_modes'], 40)
        self.row(f"40 solutions, whole mesh: {t['n_modes']} modes above the noise", 'hybrid: error between them',
                 self.worst(self.compare(scene, *UNSEEN)), 1e-2)


if __name__ == '__main__':
    unittest.main()
