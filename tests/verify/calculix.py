"""The same deck in CalculiX (contact pair of TYPE=MORTAR) and hyco. Skipped without its program, ccx.

- Two blocks of hex8 whose meshes do not match, one pressed on the other by a displacement that grows along it. CalculiX's contact is slightly
  compliant, by 0.4 % of the pressures here; their distribution is compared too.
- A lap joint: two plates, clamped over a part of their overlap, whose end is moved to and fro. CalculiX's friction has a
  penalty, the stiffness STICK of contacts that stick (a tenth of it or ten times as much change the loop by 3 and 0.5 %), and its contacts follow
  the deformed bodies: under loads that are 100 times as large, its loop is 1.4 % larger.
"""
import os
import re
import shutil
import subprocess
import unittest

import numpy as np

from common import PATIENCE
from grids import Grid
from verify import Verify, read

SCENE = """
scene: {mesh: mesh.msh}
body: {a: {young: 100, poisson: 0.3}, b: {young: 40, poisson: 0.2}}
fixed: {base: {x: 0, y: 0, z: 0}, top: {x: 0, y: 0, z: -0.003 * (1 + x)}}
contact: {seam: {type: %s, slave: b_low, master: a_top}}
"""
LAP = """
scene: {mesh: mesh.msh}
body: {lower: {young: 2.1e5, poisson: 0.3}, upper: {young: 2.1e5, poisson: 0.3}}
fixed: {clamped: {x: 0, y: 0}, pulled: {x: "%g*shear", y: 0}, flat: {z: 0}}
pressure: {lower_back: "%g*bolt*(abs(x) < 8)", upper_back: "%g*bolt*(abs(x) < 8)"}
contact: {lap: {type: mortar, slave: upper_face, master: lower_face, friction: %g}}
history: {times: [%s], tables: {bolt: [[0, 0], [1, 1]], shear: [[1, 0], [2, 1], [4, -1], [6, 1]]}}
output: {pull: {reaction: x, group: pulled}}
"""
STROKE, PRESSURE, FRICTION, STICK = 0.0005, 1, 0.25, 1e6
STEEL = (2.1e5, 0.3)
MATERIAL = {'a': (100, 0.3), 'b': (40, 0.2)}


def blocks(slaves, masters):
    grid, along = Grid(), lambda n, lo, hi, k: [np.linspace(0, 1, n + 1)] * 2 + [np.linspace(lo, hi, k + 1)]
    grid.box('hex8', along(masters, 0, 1, 2), lambda x: x, 'a', {'z0': 'base', 'z1': 'a_top'})
    grid.box('hex8', along(slaves, 1, 2.5, 3), lambda x: x, 'b', {'z0': 'b_low', 'z1': 'top'})
    return grid


def elements_of(grid, group):
    return [nodes for _, tag, nodes in grid.elements if grid.names[tag][1] == group]


def nodes_of(grid, group):
    return sorted({v for nodes in elements_of(grid, group) for v in nodes})


FACES = ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))  # S1 to S6 of a hexahedron


def model(grid, material, slave, master, friction=()):
    """CalculiX's lines of nodes, bodies and their contact; and by the nodes of a face its element and number."""
    out, count, sides = ['*NODE, NSET=ALL'], 0, {}
    out += ['%d, %.12g, %.12g, %.12g' % (i + 1, *x) for i, x in enumerate(grid.nodes)]
    for body, values in material.items():
        out.append(f'*ELEMENT, TYPE=C3D8, ELSET=E{body}')
        for nodes in elements_of(grid, body):
            count += 1
            out.append(f'{count}, {", ".join(map(str, nodes))}')
            for k, face in enumerate(FACES):
                sides[frozenset(nodes[v] for v in face)] = (count, k + 1)
        out += [f'*MATERIAL, NAME=M{body}', '*ELASTIC', '%g, %g' % values, f'*SOLID SECTION, ELSET=E{body}, MATERIAL=M{body}']
    for name, group in (('SLAVE', slave), ('MASTER', master)):
        out += [f'*SURFACE, NAME={name}, TYPE=ELEMENT', *('%d, S%d' % sides[frozenset(f)] for f in elements_of(grid, group))]
    return [*out, '*SURFACE INTERACTION, NAME=SI', '*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD', *friction,
            '*CONTACT PAIR, INTERACTION=SI, TYPE=MORTAR', 'SLAVE, MASTER'], sides


def deck(grid):
    """CalculiX's input of the blocks."""
    out, _ = model(grid, MATERIAL, 'b_low', 'a_top')
    out += ['*BOUNDARY', *(f'{i}, 1, 3' for i in nodes_of(grid, 'base')), '*STEP', '*STATIC', '1., 1.', '*BOUNDARY']
    for i in nodes_of(grid, 'top'):
        out += [f'{i}, 1, 2, 0.', '%d, 3, 3, %.12g' % (i, -0.003 * (1 + grid.nodes[i - 1][0]))]
    return '\n'.join([*out, '*CONTACT FILE', 'CDIS, CSTR', '*END STEP', ''])


def plates(n):
    """One layer of cells, 2 thick: n of them along the overlap |x| < 20 on the lower plate, 5/4 n on the upper one."""
    grid = Grid()
    ends = lambda m: np.concatenate([np.linspace(-20, -8, round(0.3 * m) + 1)[:-1], np.linspace(-8, 8, m - 2 * round(0.3 * m) + 1),
                                     np.linspace(8, 20, round(0.3 * m) + 1)[1:]])
    free, height, layer = np.linspace(20, 60, n // 4 + 1)[1:], np.linspace(0, 4, n // 8 + 1), np.array([0, 2])
    grid.box('hex8', [np.concatenate([-free[::-1], ends(n)]), height - 4, layer], lambda x: x, 'lower',
             {'x0': 'clamped', 'y0': 'lower_back', 'y1': 'lower_face', 'z0': 'flat', 'z1': 'flat'})
    grid.box('hex8', [np.concatenate([ends(5 * n // 4), free]), height, layer], lambda x: x, 'upper',
             {'x1': 'pulled', 'y1': 'upper_back', 'y0': 'upper_face', 'z0': 'flat', 'z1': 'flat'})
    grid.elements = [e for e in grid.elements if not grid.names[e[1]][1].endswith('_face') or abs(middle(grid, e[2])) < 20]
    return grid


def middle(grid, nodes):
    """x of the middle of a cell."""
    return np.mean([grid.nodes[i - 1][0] for i in nodes])


def lap_deck(grid):
    """CalculiX's input of the lap joint: the bolt, then three strokes, in steps of time as the scene's."""
    out, sides = model(grid, {'lower': STEEL, 'upper': STEEL}, 'upper_face', 'lower_face', ('*FRICTION', f'{FRICTION}, {STICK}'))
    out += ['*NSET, NSET=PULLED', *(f'{i},' for i in nodes_of(grid, 'pulled')), '*BOUNDARY', *(f'{i}, 1, 2' for i in nodes_of(grid, 'clamped')),
            'PULLED, 2, 2', *(f'{i}, 3, 3' for i in nodes_of(grid, 'flat'))]
    washers = [f for back in ('lower_back', 'upper_back') for f in elements_of(grid, back) if abs(middle(grid, f)) < 8]
    for step, (end, increment) in enumerate(((0, 0.25), (1, 0.25), (-1, 0.125), (1, 0.125))):
        out += ['*STEP, INC=100', '*STATIC', f'{increment}, 1., 1e-6, {increment}']
        if step == 0:
            out += ['*DLOAD', *('%d, P%d, %g' % (*sides[frozenset(f)], PRESSURE) for f in washers)]
        out += ['*BOUNDARY', f'PULLED, 1, 1, {end * STROKE}', '*NODE PRINT, NSET=PULLED, TOTALS=ONLY', 'RF', '*END STEP']
    return '\n'.join([*out, ''])


def pressures(path):
    """By node, from the contact results of an frd file: lines of a node and numbers of twelve characters."""
    found, names, inside = {}, [], False
    with open(path, encoding='ascii') as file:
        for line in file:
            if line.startswith(' -4'):
                inside, names = 'CONTACT' in line, []
            elif inside and line.startswith(' -5'):
                names.append(line.split()[1])
            elif inside and line.startswith(' -1'):
                found[int(line[3:13])] = float(re.findall('.{12}', line[13:])[names.index('CPRESS')])
    return found


@unittest.skipUnless(shutil.which('ccx'), 'CalculiX (ccx) is not installed')
class Calculix(Verify):
    name = 'calculix'

    def ccx(self, text):
        with open(self.path('deck.inp'), 'w', encoding='ascii') as file:
            file.write(text)
        subprocess.run(['ccx', '-i', 'deck'], cwd=self.folder, check=True, capture_output=True, timeout=60 * PATIENCE,
                       env={**os.environ, 'OMP_NUM_THREADS': '1'})

    def test_lap_joint(self):
        """The force at the ends of the strokes, and the area of a loop, by the trapezoidal rule in the same steps of time."""
        grid, times = plates(16), [0, 0.25, 0.5, 0.75, *np.arange(1, 6.01, 0.25)]
        scene = self.scene(LAP % (STROKE, PRESSURE, PRESSURE, FRICTION, ', '.join(map(str, times))), grid)
        ours = np.array(self.hyco('solve', '-scene', scene)['history']['outputs']['pull'])[1:]
        self.ccx(lap_deck(grid))
        with open(self.path('deck.dat'), encoding='ascii') as file:
            lines = [line.split() for line in file]
        theirs = np.array([float(lines[i + 2][0]) for i, line in enumerate(lines) if line[:2] == ['total', 'force']])
        self.assertEqual(len(theirs), len(ours))
        at = STROKE * np.interp(times[1:], [0, 1, 2, 4, 6], [0, 0, 1, -1, 1])
        area = lambda pull: sum((pull[k] + pull[k + 1]) / 2 * (at[k + 1] - at[k]) for k in range(7, 23))
        for name, k in (('first', 7), ('second', 15), ('third', 23)):
            self.row(f'lap joint: force at the end of the {name} stroke', ours[k], theirs[k], 0.5)
        self.row('lap joint: area of a loop', area(ours), area(theirs), 3)  # without friction it would be 0

    def test_mortar(self):
        for slaves, masters in ((4, 3), (3, 4)):
            with self.subTest(slaves=slaves, masters=masters):
                grid = blocks(slaves, masters)
                self.ccx(deck(grid))
                found = pressures(self.path('deck.frd'))
                slave = nodes_of(grid, 'b_low')
                theirs = np.array([found[i] for i in slave])
                name, apart = f'{slaves} slave cells on {masters}', {}
                for contact in ('mortar', 'surface'):
                    out = self.solve(self.scene(SCENE % contact, grid))[1]
                    ours = out['pressure'][[np.linalg.norm(out['at'] - grid.nodes[i - 1], axis=1).argmin() for i in slave]]
                    apart[contact] = abs(ours - theirs).max() / theirs.max()
                    if contact == 'mortar':
                        shape = abs(ours / ours.mean() - theirs / theirs.mean()).max()
                self.row(f'{name}, largest difference of a pressure over the largest', apart['mortar'], 0, 0.006)
                self.row(f'{name}, of the pressures over their means', shape, 0, 0.001)
                self.assertGreater(apart['surface'], 0.02)


if __name__ == '__main__':
    unittest.main()
