"""The same deck in CalculiX (contact pair of TYPE=MORTAR) and hyco: two blocks of hex8 whose meshes do not match, one pressed on the
other by a displacement that grows along it. CalculiX's contact is slightly compliant, by 0.4 % of the pressures here; their distribution is
compared too. Skipped without its program, ccx."""
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


def deck(grid):
    """CalculiX's input; the faces S1 and S2 of a hexahedron have its first and last four nodes."""
    out, count, sides = ['*NODE, NSET=ALL'], 0, {}
    out += ['%d, %.12g, %.12g, %.12g' % (i + 1, *x) for i, x in enumerate(grid.nodes)]
    for body, facets, face in (('a', 'a_top', 2), ('b', 'b_low', 1)):
        known = [set(f) for f in elements_of(grid, facets)]
        out.append(f'*ELEMENT, TYPE=C3D8, ELSET=E{body}')
        for nodes in elements_of(grid, body):
            count += 1
            out.append(f'{count}, {", ".join(map(str, nodes))}')
            if set(nodes[4:] if face == 2 else nodes[:4]) in known:
                sides.setdefault(facets, []).append(f'{count}, S{face}')
        out += [f'*MATERIAL, NAME=M{body}', '*ELASTIC', '%g, %g' % MATERIAL[body], f'*SOLID SECTION, ELSET=E{body}, MATERIAL=M{body}']
    for name, facets in (('SLAVE', 'b_low'), ('MASTER', 'a_top')):
        out += [f'*SURFACE, NAME={name}, TYPE=ELEMENT', *sides[facets]]
    out += ['*SURFACE INTERACTION, NAME=SI', '*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD',
            '*CONTACT PAIR, INTERACTION=SI, TYPE=MORTAR', 'SLAVE, MASTER', '*BOUNDARY', *(f'{i}, 1, 3' for i in nodes_of(grid, 'base')),
            '*STEP', '*STATIC', '1., 1.', '*BOUNDARY']
    for i in nodes_of(grid, 'top'):
        out += [f'{i}, 1, 2, 0.', '%d, 3, 3, %.12g' % (i, -0.003 * (1 + grid.nodes[i - 1][0]))]
    return '\n'.join([*out, '*CONTACT FILE', 'CDIS, CSTR', '*END STEP', ''])


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

    def test_mortar(self):
        for slaves, masters in ((4, 3), (3, 4)):
            with self.subTest(slaves=slaves, masters=masters):
                grid = blocks(slaves, masters)
                with open(self.path('deck.inp'), 'w', encoding='ascii') as file:
                    file.write(deck(grid))
                subprocess.run(['ccx', '-i', 'deck'], cwd=self.folder, check=True, capture_output=True, timeout=60 * PATIENCE,
                               env={**os.environ, 'OMP_NUM_THREADS': '1'})
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
