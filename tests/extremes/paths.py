"""Reduced models of paths in extreme cases: two blocks, one of which deforms inelastically, at limit loads, with steep laws and long steps, with
contact that opens and closes again, outside the region of training, in other units. The result must be right, or its estimate large, or the model
refused."""
import os
import unittest

import numpy as np

from extreme import Extreme, blocks

KINDS = ('u', 'sigma', 'lambda', 'inelastic')
WHOLE = ('-hyco_rid_whole', 'true', '-hyco_hybrid', 'all')
SMALL = ('-hyco_pod_tol', '1e-10', '-hyco_rid_layers', 1, '-hyco_hybrid', 'all')
J2 = {'type': 'j2', 'yield': 0.3, 'hardening': 2}
PERFECT = {'type': 'j2', 'yield': 0.3}
LIMIT = 2 / 3**0.5 * 0.3  # of the mean stress in plane strain
TRAIN = ('-values_press', '0.04,0.06,0.08', '-values_gap', '0,0.01')


def flowing(law, times, q, load=None, length=1, stress=1, time=1, **options):
    """The stacked blocks of quad4; the lower one deforms inelastically. q: the table that moves the upper one's top, or (load: mean stress by
    `press`) of the tension across the lower one; everything times length, stress and time."""
    grid, scene = blocks(n=(4, 4), length=length, stress=stress, young=(100, 400), poisson=(0.3, 0.3), **options)
    own = {'yield': stress, 'hardening': stress, 'rate': 1 / time / stress**law.get('exponent', 0)}
    scene['body']['a']['law'] = {k: v * own.get(k, 1) if isinstance(v, (int, float)) else v for k, v in law.items()}
    scene['history'] = {'times': [t * time for t in times], 'tables': {'q': [[t * time, v] for t, v in q]}}
    if load is None:
        scene['fixed']['b_y1'] = {'y': '-press*q'}
    else:
        scene['fixed']['b_y1'] = {'y': 0}
        scene['pressure'] = {'a_x1': f'-press*q*{load * stress / length!r}'}
    return grid, scene


class Paths(Extreme):
    name = 'paths'

    def errors(self, scene, *args):
        """The largest errors of paths, all of which must reach their end."""
        report = self.hyco('compare', '-scene', scene, '-model', 'm.h5', *args)
        self.assertEqual(report['not_converged'], 0)
        return {kind: report['worst_' + kind]['max'] or 0 for kind in KINDS}

    def both(self, case, scene, train, mu, *steps, over=None, rid=True):
        """The model of all unknowns on the whole mesh, which must agree with full order; and (rid) one on an RID, whose estimates at an unseen
        point must not be far below its errors there, unless training refuses it. over: a point without a solution."""
        self.train(scene, *train, *WHOLE, *steps)
        self.row(case, 'hybrid, whole domain: worst error on the path', max(self.errors(scene, '-mu', mu, *steps).values()), 1e-7)
        if over:
            self.refused(case + ', and 1 % over it: hybrid, whole domain', 'predict', '-model', 'm.h5', '-mu', over, says='the history ends at t = ')
        if not rid:
            return
        run = self.run_raw('train', '-scene', scene, '-model', 'm.h5', '-hyco_snapshots', self.path(f's{self.written}'), *train, *SMALL, *steps,
                           '-hyco_validation', 10)
        if run.returncode == 1:
            self.say(case, 'hybrid, RID: refused', run.stderr.splitlines()[-1].removeprefix('hyco: '))
            return
        self.assertIn(run.returncode, (0, 3))
        p = self.hyco('predict', '-model', 'm.h5', '-mu', mu, *steps)
        found = self.errors(scene, '-mu', mu, *steps)
        for kind in ('u', 'sigma', 'lambda'):
            estimate = p[f'estimated_error_{kind}']
            if estimate:
                self.row(case, f'hybrid, RID: error of {kind} {found[kind]:.1g}, over its estimate', found[kind] / estimate, 4)

    def test_limit_load(self):
        """Perfect plasticity up to 0.5 % below the limit load; above it neither full order nor a model has a solution, and both report this."""
        scene = self.scene(*flowing(PERFECT, (0, 1, 2, 3), [[0, 0], [2, 1], [3, 0.5]], load=LIMIT / 0.04, press=(0.02, 0.045), gaps=(0, 0)))
        train = ('-values_press', '0.03,0.036,0.0396', '-values_gap', '0')
        self.both('perfect plasticity, 0.5 % below the limit load', scene, train, '0.0398,0', over='0.0405,0')
        self.refused('perfect plasticity, trained over the limit load', 'train', '-scene', scene, '-model', 'no.h5', '-values_press',
                     '0.03,0.0405', '-values_gap', '0', says='0.0405')

    def test_steep(self):
        """Norton with n = 12, and steps a hundred times as long as the usual bound allows."""
        law = {'type': 'norton', 'rate': 1.0, 'exponent': 12}
        times, q = (0, 0.01, 0.1, 1, 10, 11), [[0, 0], [0.01, 1], [10, 1], [11, 0.3]]
        scene = self.scene(*flowing(law, times, q, crown=0.1))
        self.both('Norton, n = 12', scene, TRAIN, '0.05,0.004')
        self.both('Norton, n = 12, steps 100 times too long', scene, TRAIN, '0.05,0.004', '-hyco_step_inelastic', '0.1', rid=False)

    def test_reloading(self):
        """Loaded, unloaded until the blocks separate, and loaded again further: contact opens and closes again."""
        q = [[0, 0], [1, 1], [2, -0.2], [3, 1.3], [4, 0.2]]
        scene = self.scene(*flowing(J2, (0, 0.5, 1, 1.5, 2, 2.5, 3, 4), q, crown=0.1))
        self.both('J2, unloaded and loaded again', scene, TRAIN, '0.05,0.004', rid=False)
        active = self.hyco('solve', '-scene', scene, '-mu', '0.05,0.004')['history']['n_active']
        self.assertGreater(active[2], 0)
        self.assertEqual(active[4], 0)
        self.assertGreater(active[6], 0)
        self.say('the same', 'contacts closed at the listed times', ' '.join(map(str, active)))

    def test_never_flowed(self):
        """Trained below the yield stress: exact there; where bodies yield, the prediction reports that this is outside the region of training."""
        scene = self.scene(*flowing({'type': 'j2', 'yield': 1.2, 'hardening': 2}, (0, 1, 2), [[0, 0], [1, 1], [2, 0.3]], press=(0.01, 0.1)))
        train = ('-values_press', '0.01,0.02,0.03', '-values_gap', '0,0.002', '-hyco_pod_tol', '1e-10', '-hyco_rid_layers', 1)
        self.train(scene, *train)
        self.row('training that never flowed', 'hybrid: worst error where nothing flows', max(self.errors(scene, '-mu', '0.025,0.001').values()), 0.02)
        far = self.hyco('predict', '-model', 'm.h5', '-mu', '0.09,0.001')
        self.assertGreater(far['history']['rid_inelastic'][-1], 0)
        self.assertTrue(far['extrapolated'])
        self.say('training that never flowed, where bodies flow', 'hybrid: extrapolated', f"by {far['beyond']:.2g} of the ranges")

    def test_six_parameters(self):
        """Paths with six parameters, four of them in the law."""
        grid, scene = flowing(J2, (0, 0.5, 1, 2), [[0, 0], [1, 1], [2, 0.3]], crown=0.1)
        more = {'young': [80, 120], 'poisson': [0.25, 0.35], 'yield': [0.25, 0.35], 'hardening': [1, 3]}
        scene['scene']['parameters'] += ['e', 'n', 'f', 'h']
        scene['parameter'].update({p: {'range': r} for p, r in zip('enfh', more.values())})
        scene['body']['a'].update(young='e', poisson='n')
        scene['body']['a']['law'].update({'yield': 'f', 'hardening': 'h'})
        scene = self.scene(grid, scene)
        draw = np.random.default_rng(6)
        low, high = np.array([[0.04, 0.08], [0, 0.01], *more.values()]).T
        with open(self.path('points.csv'), 'w', encoding='utf-8') as f:
            f.write('press,gap,e,n,f,h\n')
            for x in draw.random((13, 6)):
                f.write(','.join(repr(float(v)) for v in low + x * (high - low)) + '\n')
        mu = ','.join(repr(float(v)) for v in low + np.array([0.4, 0.6, 0.55, 0.45, 0.35, 0.6]) * (high - low))
        self.both('six parameters, 13 paths', scene, ('-points', self.path('points.csv')), mu, rid=False)

    def test_units(self):
        """The same path in nanometres and TPa, in kilometres, and in other units of time."""
        law = {'type': 'norton', 'rate': 1.0, 'exponent': 3, 'yield': 2, 'hardening': 3}
        times, q = (0, 0.01, 0.1, 1, 2), [[0, 0], [0.01, 1], [1, 1], [2, 0.3]]
        base = None
        for length, stress, time in ((1, 1, 1), (1e-9, 1e12, 1e-6), (1e3, 1e-6, 3600)):
            scene = self.scene(*flowing(law, times, q, length=length, stress=stress, time=time, crown=0.1))
            values = [','.join(repr(v * length) for v in x) for x in ((0.04, 0.06, 0.08), (0.0, 0.01))]
            t = self.train(scene, '-values_press', values[0], '-values_gap', values[1], '-hyco_pod_tol', '1e-9', '-hyco_rid_layers', 1)
            sizes = [t[k] for k in ('n_modes', 'rid_elements', 'rid_contacts', 'n_fe_dofs')]
            h = self.hyco('predict', '-model', 'm.h5', '-mu', f'{0.05 * length!r},{0.004 * length!r}')['history']
            found = np.array([np.array(h[c]) / by for c, by in (('rid_mises', stress), ('rid_inelastic', 1), ('total_contact_force', stress * length))])
            base = base or (sizes, found)
            self.assertEqual(sizes, base[0])
            case = f'lengths x {length:.3g}, stresses x {stress:.3g}, times x {time:.3g}'
            self.row(case, 'hybrid: stress, inelastic strain and forces, scaled back, differ by',
                     float((abs(found - base[1]).max(axis=1) / abs(base[1]).max(axis=1)).max()), 1e-6)


if __name__ == '__main__':
    unittest.main()
