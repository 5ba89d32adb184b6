"""A law that a program registers (examples/ladder/material.c): cubic elasticity against closed forms, and against `elastic` with equal
constants; what a scene says of laws and their constants that are not there."""
import os
import re
import subprocess
import unittest

from common import HYCO, MPIRUN, PATIENCE, Case, msh

PROGRAM = os.path.join(os.path.dirname(HYCO), 'ladder', 'material')
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
OUT = re.compile(r'(\w+): contact force (\S+), energy (\S+), u_x in \[(\S+), (\S+)\], u_y in \[(\S+), (\S+)\]')


class Material(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        n = 4
        # cells of different shapes
        nodes = [(i / n, (j + 0.3 * (0 < i < n and 0 < j < n) * (-1) ** (i + j)) / n, 0) for j in range(n + 1) for i in range(n + 1)]
        at = lambda i, j: j * (n + 1) + i + 1
        cells = [(3, 1, (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1))) for j in range(n) for i in range(n)]
        sides = [(1, 2, (at(i, 0), at(i + 1, 0))) for i in range(n)] + [(1, 3, (at(i, n), at(i + 1, n))) for i in range(n)]
        sides += [(1, 4, (at(0, j), at(0, j + 1))) for j in range(n)] + [(1, 5, (at(n, j), at(n, j + 1))) for j in range(n)]
        msh(cls.path('square.msh'), nodes, cells + sides, {1: (2, 'block'), 2: (1, 'low'), 3: (1, 'high'), 4: (1, 'left'), 5: (1, 'right')})

    def scene(self, body, fixed='left: {x: 0}', load=PRESS):
        path = self.path('scene.yaml')
        with open(path, 'w', encoding='ascii') as file:
            file.write(SCENE % (body, fixed, load))
        return path

    def run_program(self, scene, *args, ranks=0):
        command = [*(MPIRUN + [str(ranks)] if ranks else []), PROGRAM, scene, *args]
        return subprocess.run(command, capture_output=True, text=True, timeout=60 * PATIENCE)

    def solve(self, *args, **options):
        run = self.run_program(*args, **options)
        self.assertEqual(run.returncode, 0, run.stderr)
        found = OUT.search(run.stdout)
        self.assertTrue(found, run.stdout)
        self.assertIn('CONVERGED', found[1].upper())
        return [float(x) for x in found.groups()[1:]]

    def test_pressed(self):
        """Free sides: sigma_yy = -p = c11 e_yy + c12 e_xx, 0 = c11 e_xx + c12 e_yy, plane strain; and the same with bbar, on 2 ranks."""
        p = 5.0
        c11, c12 = 100 + p, 30.0
        eyy = -p / (c11 - c12 * c12 / c11)
        exx = -c12 / c11 * eyy
        for element in ('', ', element: bbar'):
            for ranks in (0, 2):
                force, energy, lo_x, hi_x, lo_y, hi_y = self.solve(self.scene(CUBIC % 7 + element), str(p), ranks=ranks)
                self.near(force, p, 1e-9)
                self.near(energy, -p * eyy / 2, 1e-9)
                self.near(hi_x, exx, 1e-9)
                self.near(lo_y, eyy, 1e-9)
                self.assertLess(abs(lo_x) + abs(hi_y), 1e-9)

    def test_sheared(self):
        """u = (gamma y, 0) on the sides: the energy density is c44 gamma^2 / 2, whatever c11 and c12 are."""
        fixed = 'left: {x: 0.01*y, y: 0}, right: {x: 0.01*y, y: 0}, low: {x: 0, y: 0}, high: {x: 0.01, y: 0}'
        scene = self.scene(CUBIC % 7, fixed, '').replace('scene.yaml', 'shear.yaml')
        with open(self.path('scene.yaml'), encoding='ascii') as file:
            text = file.read()
        with open(scene, 'w', encoding='ascii') as file:
            file.write(text.split('contact:')[0])
        self.near(self.solve(scene, '1')[1], 7 * 0.01**2 / 2, 1e-9)

    def test_elastic(self):
        """With c11 = lambda + 2 mu, c12 = lambda, c44 = mu a general tangent gives what `elastic` gives: standard and bbar."""
        young, poisson = 200.0, 0.3
        lam, mu = young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))
        fixed = 'left: {x: 0, y: 0}'  # stresses vary
        for element in ('', ', element: bbar'):
            cubic = self.solve(self.scene(f'law: cubic, c11: {lam + 2 * mu!r}, c12: {lam!r}, c44: {mu!r}{element}', fixed), '3')
            elastic = self.solve(self.scene(f'law: elastic, young: {young}, poisson: {poisson}{element}', fixed), '3')
            for a, b in zip(cubic, elastic):
                self.assertLess(abs(a - b), 1e-9 * max(map(abs, elastic)))

    def refused(self, body, *words):
        run = self.run_program(self.scene(body), '1')
        self.assertNotEqual(run.returncode, 0)
        for word in words:
            self.assertIn(word, run.stderr)

    def test_refused(self):
        self.refused('law: cubc, c11: 1', 'block', 'cubc', 'cubic, elastic', 'did you mean cubic?')
        self.refused('law: cubic, c11: 1, c12: 0.1, young: 3', 'body_block_young', 'c11, c12, c44')
        self.refused('law: cubic, c11: 1, c12: 0.1, c34: 3', 'body_block_c34', 'did you mean c44?')
        self.refused('law: cubic, c11: 1, c12: 0.1', 'block', 'c44', 'shear stiffness')
        self.refused('law: cubic, c11: 1, c12: 2, c44: 1', 'block', 'c12 must be less than c11', 'x = ')
        self.refused('law: cubic, c11: -x, c12: -2, c44: 1', 'body_block_c11', 'must be positive')
        self.refused('law: cubic, c11: 1, c12: -0.9999999999999999999, c44: 1', 'block', 'symmetric and positive definite')
        run = self.run_raw('solve', '-scene', self.scene(CUBIC % 1), '-mu', 1)  # the command has no such law
        self.assertNotEqual(run.returncode, 0)
        self.assertIn('it must be elastic', run.stderr)


if __name__ == '__main__':
    unittest.main()
