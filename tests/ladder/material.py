"""A law that a program registers (examples/ladder/material.c): cubic elasticity compared with closed forms, and with `elastic` for
equal constants; messages for unknown laws and constants."""
import unittest

from common import Program, msh, square

SCENE = """
scene: {title: a square pressed on a floor, mesh: square.msh, parameters: [load]}
parameter: {load: {range: [0, 10]}}
body: {block: {%s}}
fixed: {%s}
%s
contact: {floor: {type: obstacle, group: low, normal: {y: -1}, gap: 0}}
"""
CUBIC = 'law: cubic, c11: 100 + load, c12: 30, c44: %s'
PRESS = 'pressure: {high: load}'


class Material(Program):
    name = 'material'
    scene_text = SCENE
    out = r'(\w+): contact force (\S+), energy (\S+), u_x in \[(\S+), (\S+)\], u_y in \[(\S+), (\S+)\]'

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        n = 4
        # cells of different shapes
        msh(cls.path('square.msh'), *square(n, move=lambda i, j: (i, j + 0.3 * (0 < i < n and 0 < j < n) * (-1) ** (i + j))))

    def body(self, body, fixed='left: {x: 0}', load=PRESS):
        return self.scene(body, fixed, load)

    def numbers(self, scene, load, ranks=0):
        reason, *numbers = self.solve(scene, load, ranks=ranks)
        self.assertEqual(reason, 'converged')
        return numbers

    def test_pressed(self):
        """Free sides: sigma_yy = -p = c11 e_yy + c12 e_xx, 0 = c11 e_xx + c12 e_yy, plane strain; and the same with bbar, on 2 ranks."""
        p = 5.0
        c11, c12 = 100 + p, 30.0
        eyy = -p / (c11 - c12 * c12 / c11)
        exx = -c12 / c11 * eyy
        for element in ('', ', element: bbar'):
            for ranks in (0, 2):
                force, energy, lo_x, hi_x, lo_y, hi_y = self.numbers(self.body(CUBIC % 7 + element), str(p), ranks=ranks)
                self.near(force, p, 1e-9)
                self.near(energy, -p * eyy / 2, 1e-9)
                self.near(hi_x, exx, 1e-9)
                self.near(lo_y, eyy, 1e-9)
                self.assertLess(abs(lo_x) + abs(hi_y), 1e-9)

    def test_sheared(self):
        """u = (gamma y, 0) on the sides: the energy density is c44 gamma^2 / 2, for any c11 and c12."""
        fixed = 'left: {x: 0.01*y, y: 0}, right: {x: 0.01*y, y: 0}, low: {x: 0, y: 0}, high: {x: 0.01, y: 0}'
        scene = self.body(CUBIC % 7, fixed, '').replace('scene.yaml', 'shear.yaml')
        with open(self.path('scene.yaml'), encoding='ascii') as file:
            text = file.read()
        with open(scene, 'w', encoding='ascii') as file:
            file.write(text.split('contact:')[0])
        self.near(self.numbers(scene, '1')[1], 7 * 0.01**2 / 2, 1e-9)

    def test_elastic(self):
        """With c11 = lambda + 2 mu, c12 = lambda, c44 = mu a general tangent gives what `elastic` gives: standard and bbar."""
        young, poisson = 200.0, 0.3
        lam, mu = young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))
        fixed = 'left: {x: 0, y: 0}'  # stresses vary
        for element in ('', ', element: bbar'):
            cubic = self.numbers(self.body(f'law: cubic, c11: {lam + 2 * mu!r}, c12: {lam!r}, c44: {mu!r}{element}', fixed), '3')
            elastic = self.numbers(self.body(f'law: elastic, young: {young}, poisson: {poisson}{element}', fixed), '3')
            for a, b in zip(cubic, elastic):
                self.assertLess(abs(a - b), 1e-9 * max(map(abs, elastic)))

    def test_refused(self):
        """Wrong entries of the registered law: the message names the entry and the nearest known name."""
        for body, *words in (
                ('law: cubc, c11: 1', 'block', 'cubc', 'cubic, elastic', 'did you mean cubic?'),
                ('law: cubic, c11: 1, c12: 0.1, young: 3', 'body_block_young', 'c11, c12, c44'),
                ('law: cubic, c11: 1, c12: 0.1, c34: 3', 'body_block_c34', 'did you mean c44?'),
                ('law: cubic, c11: 1, c12: 0.1', 'block', 'c44', 'shear stiffness'),
                ('law: cubic, c11: 1, c12: 2, c44: 1', 'block', 'c12 must be less than c11', 'x = '),
                ('law: cubic, c11: -x, c12: -2, c44: 1', 'body_block_c11', 'must be positive'),
                ('law: cubic, c11: 1, c12: -0.9999999999999999999, c44: 1', 'block', 'symmetric and positive definite')):
            self.refused(words, self.body(body), '1')
        run = self.run_raw('solve', '-scene', self.body(CUBIC % 1), '-mu', 1)  # the command has no such law
        self.assertNotEqual(run.returncode, 0)
        self.assertIn('it must be elastic', run.stderr)


if __name__ == '__main__':
    unittest.main()
