"""Long and flat elements, gaps down to round-off, overlapping surfaces, contact that just begins, all contacts or none."""
import unittest

from extreme import BODIES, DIM, SEEN, TRAIN, UNSEEN, Extreme, blocks, points
from materials import uniaxial

MATERIAL = (100, 40), (0.3, 0.2)


class Shapes(Extreme):
    name = 'shapes'

    def test_aspect(self):
        """Elements 1e4 times as wide as high, or as high as wide: the pressure's closed form."""
        for kind in ('quad4', 'tri3', 'hex8', 'tet4'):
            for aspect in (1e-4, 1e-2, 1e2, 1e4) if kind == 'quad4' else (1e-4, 1e4):
                case = f'{kind}, elements {aspect:g} times as wide as high'
                scene = self.scene(*blocks(kind, (4, 4), aspect=aspect))
                r = self.fields(scene, '-mu', '0.05,0.01')[0]
                p = uniaxial(kind, 0.05, 0.01, *MATERIAL) * aspect**(DIM[kind] - 1)
                self.row(case, 'flat: force against the closed form', abs(r['total_contact_force'] / p - 1), 1e-6)
                scene = self.scene(*blocks(kind, (4, 4), aspect=aspect, crown=0.1))
                self.models(case, scene, TRAIN, SEEN, UNSEEN, 1e-6)


class Gaps(Extreme):
    name = 'gaps'

    def force(self, case, mu, press, gap, bound=1e-9, scene=None, **options):
        """The total force compared with the closed form, with all contacts closed."""
        scene = scene or self.scene(*blocks(press=(0, 0.1), gaps=(-0.05, 0.05), **options))
        r = self.fields(scene, '-mu', mu)[0]
        exact = uniaxial('quad4', press, gap, *MATERIAL)
        self.row(case, 'full order: force against the closed form', abs(r['total_contact_force'] / exact - 1), bound)
        self.assertEqual(r['n_active'], r['n_contacts'], case)

    def test_tiny(self):
        """The gap small compared with a press of 0.05, and both as small as round-off of the size."""
        for gap in (0, 1e-15, 1e-12, 1e-6):
            self.force(f'gap {gap:g}, press 0.05', f'0.05,{gap!r}', 0.05, gap)
        for size in (1e-15, 1e-12, 1e-300):
            self.force(f'gap {size:g}, press {2 * size:g}', f'{2 * size!r},{size!r}', 2 * size, size)
        r = self.fields(self.folder, '-mu', '1e-15,2e-15')[0]
        self.say('gap 2e-15, press 1e-15', 'full order: active contacts', r['n_active'])
        self.assertEqual((r['n_active'], r['total_contact_force']), (0, 0))

    def test_interference(self):
        """Surfaces that overlap: by a negative gap, and as drawn, the gap measured."""
        self.force('gap -0.02, no press', '0,-0.02', 0, -0.02)
        grid, scene = blocks(press=(0, 0.1), gaps=(-0.05, 0.05))
        del scene['contact']['seam']['gap']
        scene['body']['b']['map'] = {'y': 'y + gap*(2.5 - y)/1.5'}
        scene = self.scene(grid, scene)
        r = self.fields(scene, '-mu', '0,-0.02')[0]
        e_a, e_b = 100 / 0.91, 40 / 0.96
        self.row('overlap 0.02 drawn, measured', 'full order: force against the closed form',
                 abs(r['total_contact_force'] / (0.02 / (1 / e_a + 1.52 / e_b)) - 1), 1e-9)
        for name, text in (('gap', None), ('drawn', 'map')):
            grid, scene = blocks(press=(0, 0.1), gaps=(-0.05, 0.05), crown=0.1)
            if text:
                del scene['contact']['seam']['gap']
                scene['body']['b']['map'] = {'y': 'y + (gap + 0.1*x^2)*(2.5 - y)/1.5'}
            scene = self.scene(grid, scene)
            self.models(f'overlap by {name}, in part', scene, points((0, 0.01), (-0.04, -0.02)), points((0.01,), (-0.02,)),
                       points((0.005,), (-0.03,)), bodies=1e-5 if text else None)  # a map changes the shape

    def test_grazing(self):
        """Press equal to the gap: closed without force; larger by one unit of round-off; by a thousandth."""
        scene = self.scene(*blocks(press=(0, 0.1), gaps=(0, 0.05)))
        full = uniaxial('quad4', 0.05, 0, *MATERIAL)
        for gap, press in ((0.05, 0.05), (0.05, 0.05000000000000001), (0.05, 0.05005)):
            r = self.fields(scene, '-mu', f'{press!r},{gap!r}')[0]
            exact = uniaxial('quad4', press, gap, *MATERIAL)
            self.row(f'press = gap + {press - gap:.2g}', 'full order: error of the force over that of the press alone',
                     abs(r['total_contact_force'] - exact) / full, 1e-13)
        self.models('press = gap, trained around', scene, points((0.04, 0.06), (0.03, 0.05)), points((0.06,), (0.05,)),
                   points((0.05,), (0.04,)))
        p = self.hyco('predict', '-model', 'm.h5', '-mu', '0.05,0.05')
        self.row('press = gap', 'projection: force over that of the press alone', p['total_contact_force'] / full, 1e-6)

    def test_active(self):
        """All, none and one of the contacts active, at every training and test point."""
        for kind in ('quad4', 'hex8'):
            for case, crown, gaps, active in (('all', 0, (0, 0.01), 'n'), ('none', 0, (0.09, 0.1), 0), ('one', 40, (0, 0.01), 1)):
                scene = self.scene(*blocks(kind, (4, 4), gaps=gaps, crown=crown))
                middle = sum(gaps) / 2
                r = self.models(f'{kind}, {case} active', scene, points((0.04, 0.06, 0.08), gaps), points((0.06,), gaps[1:]),
                               points((0.05,), (middle,)))
                self.assertEqual(r['n_active'], r['n_contacts'] if active == 'n' else active)

    def test_zero(self):
        """No load: zero, at full order and by models trained elsewhere; a training with only zeros is refused, but by models of bodies,
        which need no solution of it."""
        scene = self.scene(*blocks(press=(0, 0.1), gaps=(0, 0.05)))
        r, u, lam = self.fields(scene, '-mu', '0,0')
        self.say('no load', 'full order: largest displacement, force', f'{abs(u).max():g}, {abs(lam).max():g}')
        self.assertEqual((abs(u).max(), abs(lam).max()), (0, 0))
        for model, options in (('hybrid', ()), ('projection', ('-hyco_model_type', 'projection', '-hyco_dual', 'snapshots')),
                               ('bodies', BODIES)):
            self.train(scene, *points((0.02, 0.06, 0.1), (0, 0.02)), *options)
            p = self.hyco('predict', '-model', 'm.h5', '-mu', '0,0')
            self.say('no load', f'{model}: total force', f"{p['total_contact_force']:g}")
            self.assertEqual((p['converged'], p['total_contact_force']), (True, 0))
            alone = 'train', '-scene', scene, '-model', 'z.h5', '-values_press', 0, '-values_gap', 0, *options
            if model != 'bodies':
                self.refused(f'{model}, trained on no load alone', *alone, says='zero')
                continue
            self.hyco(*alone)
            force = self.hyco('predict', '-model', 'z.h5', '-mu', '0.06,0.01')['total_contact_force']
            self.row(f'{model}, trained on no load alone', 'total force', abs(force / uniaxial('quad4', 0.06, 0.01, *MATERIAL) - 1), 1e-10)

    def test_fixed(self):
        """Slaves that are fixed too: in one component, in all; with masters fixed, with and without penetration."""
        for case, fixed, ok in (('slaves fixed across', {'b_y0': {'x': 0}}, True),
                                ('slaves pushed into the masters', {'b_y0': {'x': 0, 'y': -0.02}}, True),
                                ('slaves and masters fixed, apart', {'b_y0': {'x': 0, 'y': 0}, 'a_y1': {'x': 0, 'y': 0}}, True),
                                ('slaves and masters fixed, overlapping', {'b_y0': {'x': 0, 'y': -0.1}, 'a_y1': {'x': 0, 'y': 0}},
                                 False)):
            grid, scene = blocks()
            scene['fixed'].update(fixed)
            scene = self.scene(grid, scene)
            if ok:
                self.models(case, scene, TRAIN, SEEN, UNSEEN)
            else:
                self.refused(case, 'solve', '-scene', scene, '-mu', '0.05,0.01', says='penetrates by')


if __name__ == '__main__':
    unittest.main()
