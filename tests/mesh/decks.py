"""scripts/convert --scene: decks of Abaqus and CalculiX become scenes that are solved as they are; CalculiX (ccx) solves the same decks."""
import os
import re
import shutil
import subprocess
import sys
import unittest

import numpy as np

import document
from common import HYCO, PATIENCE, SOURCE, Case

PACKAGE = os.path.join(os.path.dirname(HYCO), 'python')
sys.path.insert(0, PACKAGE)
CONVERT = os.path.join(SOURCE, 'scripts', 'convert')
CCX = shutil.which('ccx')
STEEL = '*MATERIAL, NAME=STEEL\n*ELASTIC\n210000., 0.3\n'
HARD = '*SURFACE INTERACTION, NAME=SI\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n5.e7\n'
PRINT = '*NODE PRINT, NSET=NALL\nU\n*NODE PRINT, NSET=%s, TOTALS=ONLY\nRF\n'  # displacements; the force of the support below


class Box:
    """A block of cells with numbers from `first` on: nodes, cells, sides X0 ... as sets of nodes and surfaces of NAME."""

    def __init__(self, name, kind, low, high, cells, first=1):
        self.name, self.kind, self.cells = name, kind, cells
        dim = len(cells)
        axes = [np.linspace(a, b, n + 1) for a, b, n in zip(low, high, cells)]
        grid = np.stack(np.meshgrid(*axes, indexing='ij'), -1).reshape(-1, dim)
        self.x = np.zeros((len(grid), 3))
        self.x[:, :dim] = grid
        self.number = first + np.arange(len(grid)).reshape([n + 1 for n in cells])
        corners = [(0, 0), (1, 0), (1, 1), (0, 1)] if dim == 2 else [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
        self.elements = {first + k: [int(self.number[tuple(c + r for c, r in zip(cell, corner))]) for corner in corners]
                         for k, cell in enumerate(np.ndindex(*cells))}
        self.sides = {}
        faces = {2: {'Y0': 1, 'X1': 2, 'Y1': 3, 'X0': 4}, 3: {'Z0': 1, 'Z1': 2, 'Y0': 3, 'X1': 4, 'Y1': 5, 'X0': 6}}[dim]
        for side, face in faces.items():
            axis, end = 'XYZ'.index(side[0]), int(side[1])
            nodes = np.take(self.number, -end, axis=axis).ravel()
            of = [first + k for k, cell in enumerate(np.ndindex(*cells)) if cell[axis] == end * (cells[axis] - 1)]
            self.sides[side] = (nodes, of, face)

    def second(self):
        """The same of cells with a node on each edge (C3D20, CPS8)."""
        edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
        place, first = {n: x for n, x in zip(self.number.ravel().tolist(), self.x)}, int(self.number.min())
        middle = {}
        for corners in self.elements.values():
            for a, b in edges[:4] if len(corners) == 4 else edges:
                key = frozenset((corners[a], corners[b]))
                if key not in middle:
                    middle[key] = first + len(place)
                    place[middle[key]] = (place[corners[a]] + place[corners[b]]) / 2
        self.elements = {e: c + [middle[frozenset((c[a], c[b]))] for a, b in (edges[:4] if len(c) == 4 else edges)] for e, c in self.elements.items()}
        self.number, self.x = np.array(list(place)), np.array(list(place.values()))
        for side, (_, of, face) in list(self.sides.items()):
            axis = 'XYZ'.index(side[0])
            end = self.x[:, axis].max() if side[1] == '1' else self.x[:, axis].min()
            self.sides[side] = (self.number[np.abs(self.x[:, axis] - end) < 1e-9], of, face)
        return self

    def mesh(self, part=False):
        """Nodes, cells, sets and surfaces, without the name of the block within a part."""
        at = '' if part else self.name + '_'
        ids = self.number.ravel()
        out = [f'*NODE, NSET={at}N'] + [f'{n}, {x:.12g}, {y:.12g}, {z:.12g}' for n, (x, y, z) in zip(ids, self.x)]
        out += [f'*ELEMENT, TYPE={self.kind}, ELSET={"Set-all" if part else self.name}'] + [f'{e}, ' + ',\n'.join(', '.join(map(str, c[k:k + 10])) for k in range(0, len(c), 10)) for e, c in self.elements.items()]
        for side, (nodes, of, face) in self.sides.items():
            rows = [', '.join(map(str, chunk)) for chunk in np.array_split(nodes, max(1, len(nodes) // 8))]
            out += [f'*NSET, NSET={at}{side}', *rows, f'*ELSET, ELSET=_{at}{side}', *map(str, of), f'*SURFACE, NAME={at}S{side}, TYPE=ELEMENT', f'_{at}{side}, S{face}']
        return '\n'.join(out) + '\n'


def deck(boxes, model, steps, materials=STEEL, sections=None):
    """A flat deck: blocks of steel unless other sections are given."""
    text = '*HEADING\nequivalent of a CalculiX test\n' + ''.join(b.mesh() for b in boxes)
    text += '*NSET, NSET=NALL\n' + ''.join(f'{b.name}_N\n' for b in boxes) + materials
    text += sections or ''.join(f'*SOLID SECTION, ELSET={b.name}, MATERIAL=STEEL\n' + ('1.\n' if len(b.cells) == 2 else '') for b in boxes)
    step_print = PRINT % ('A_Y0' if len(boxes[0].cells) == 2 else 'A_Z0')
    return text + model + ''.join(f'*STEP{more}\n{step}{step_print}*END STEP\n' for more, step in steps)


def pair(slave, master, kind='SURFACE TO SURFACE'):
    return HARD + f'*CONTACT PAIR, INTERACTION=SI, TYPE={kind}\n{slave}, {master}\n'


CAE = """*Heading
** Job name: press
*Part, name=Low
{low}*Solid Section, elset=Set-all, material=Steel
,
*End Part
*Part, name=High
{high}*Solid Section, elset=Set-all, material=Steel
,
*End Part
*Assembly, name=Assembly
*Instance, name=Block-1, part=Low
*End Instance
*Instance, name=Punch-1, part=High
{place}*End Instance
*Node
1, 0.25, 0.25, 3.
*Nset, nset=RP
1,
*Nset, nset=Left, instance=Block-1
X0,
*Nset, nset=Left, instance=Punch-1
X0,
*Nset, nset=Front, instance=Block-1
Y0,
*Nset, nset=Front, instance=Punch-1
Y0,
*Elset, elset=_Down_S1, internal, instance=Punch-1
_Z0,
*Surface, type=ELEMENT, name=Down
_Down_S1, S1
*Elset, elset=_Up_S2, internal, instance=Block-1
_Z1,
*Surface, type=ELEMENT, name=Up
_Up_S2, S2
*Coupling, constraint name=C1, ref node=RP, surface=Punch-1.SZ1
*Kinematic
*End Assembly
*Material, name=Steel
*Elastic
210000., 0.3
*Surface Interaction, name=IntProp-1
1.,
*Friction, slip tolerance=0.005
 0.2,
*Surface Behavior, pressure-overclosure=HARD
*Boundary
Left, XSYMM
Front, YSYMM
Block-1.Z0, 3, 3
*Contact Pair, interaction=IntProp-1, type=SURFACE TO SURFACE
Down, Up
*Step, name=Step-1, nlgeom=YES
*Static
0.1, 1., 1e-05, 1.
*Boundary
RP, 1, 2
RP, 3, 3, -0.002
RP, 4, 6
*Output, field, variable=PRESELECT
*End Step
"""
SYMMETRY = '*BOUNDARY\nA_X0, 1, 1\nB_X0, 1, 1\nA_Y0, 2, 2\nB_Y0, 2, 2\n'


def flat_decks():
    """Each name: the deck, tolerance of displacements relative to the largest one."""
    a, b = Box('A', 'C3D8', (0, 0, 0), (1, 1, 1), (4, 4, 4)), Box('B', 'C3D8', (0, 0, 1), (1, 1, 2), (4, 4, 4), 1001)
    hold = SYMMETRY + 'A_Z0, 3, 3\n'
    decks = {}
    decks['press'] = deck([a, b], pair('B_SZ0', 'A_SZ1') + hold, [('', '*STATIC\n1., 1.\n*DSLOAD\nB_SZ1, P, 300.\n')])
    push = Box('B', 'C3D8', (0, 0, 1), (0.5, 0.5, 2), (3, 3, 4), 1001)
    decks['punch'] = deck([a, push], pair('B_SZ0', 'A_SZ1') + hold, [('', '*STATIC\n1., 1.\n*BOUNDARY\nB_Z1, 3, 3, -0.002\n')])
    decks['glued'] = deck([a, Box('B', 'C3D8', (0, 0, 1), (1, 1, 2), (4, 4, 3), 1001)], '*TIE, NAME=GLUE, POSITION TOLERANCE=0.01\nB_SZ0, A_SZ1\n' + hold,
                          [('', '*STATIC\n*CLOAD\nB_X1, 1, 20.\n')])
    flat = [Box('A', 'CPE4', (0, 0), (2, 1), (16, 8)), Box('B', 'CPE4', (0, 1), (1, 2), (8, 8), 1001)]
    hold2 = '*BOUNDARY\nA_X0, 1, 1\nB_X0, 1, 1\nA_Y0, 2, 2\n'
    decks['strain'] = deck(flat, pair('B_SY0', 'A_SY1') + hold2, [('', '*STATIC\n1., 1.\n*DLOAD\n_B_Y1, P3, 200.\n')])
    ring = [Box('A', 'CAX4', (1, 0), (2, 1), (8, 8)), Box('B', 'CAX4', (2.001, 0), (3, 1), (8, 8), 1001)]
    decks['shrink'] = deck(ring, pair('A_SX1', 'B_SX0') + '*BOUNDARY\nA_Y0, 2, 2\nB_Y0, 2, 2\n', [('', '*STATIC\n1., 1.\n*DSLOAD\nA_SX0, P, 400.\n')])
    bar = Box('A', 'C3D8', (0, 0, 0), (1, 1, 4), (2, 2, 8))
    hold3 = '*BOUNDARY\nA_X0, 1, 1\nA_Y0, 2, 2\nA_Z0, 3, 3\n'
    warm = STEEL + '*EXPANSION\n1.2E-5\n*DENSITY\n7.8E-9\n'
    stop = Box('B', 'C3D8', (0, 0, 4.002), (1, 1, 5), (2, 2, 2), 1001)
    decks['warm'] = deck([bar, stop], pair('A_SZ1', 'B_SZ0') + '*INITIAL CONDITIONS, TYPE=TEMPERATURE\nNALL, 293.\n' + SYMMETRY + 'A_Z0, 3, 3\nB_Z1, 3, 3\n',
                         [('', '*STATIC\n1., 1.\n*TEMPERATURE\nNALL, 393.\n')], warm)
    decks['hangs'] = deck([bar], hold3, [('', '*STATIC\n*DLOAD\nA, GRAV, 9810., 0., 0., -1.\n')], warm)
    decks['spins'] = deck([bar], hold3, [('', '*STATIC\n*DLOAD\nA, CENTRIF, 1.E6, 0., 0., 0., 1., 0., 0.\n')], warm)
    decks['yields'] = deck([bar], hold3, [('', '*STATIC\n0.1, 1.\n*BOUNDARY\nA_Z1, 3, 3, 0.02\n'), ('', '*STATIC\n0.1, 1.\n' + hold3.replace('RY', 'RY, OP=NEW') + 'A_Z1, 3, 3, 0.01\n')],
                           STEEL + '*PLASTIC\n300., 0.\n500., 0.2\n')
    decks['creeps'] = deck([bar], hold3, [('', '*STATIC\n5., 5.\n*DSLOAD\nA_SZ1, P, -100.\n'), ('', '*VISCO, CETOL=1.E-5\n0.1, 10.\n')],
                           STEEL + '*CREEP, LAW=NORTON\n1.E-10, 3., 0.\n')
    bent = Box('A', 'C3D20', (0, 0, 0), (1, 1, 4), (2, 2, 4)).second()
    decks['bends'] = deck([bent], '*BOUNDARY\nA_Z0, 1, 3\n', [('', '*STATIC\n*DSLOAD\nA_SX1, P, 3.\n*CLOAD\nA_Z1, 2, 0.5\n')])
    sheet = Box('A', 'CPS8', (0, 0), (4, 1), (8, 2)).second()
    decks['sheet'] = deck([sheet], '*BOUNDARY\nA_X0, 1, 1\nA_Y0, 2, 2\n', [('', '*STATIC\n*DSLOAD\nA_SY1, P, 3.\n*CLOAD\nA_X1, 1, 2.\n')],
                          sections='*SOLID SECTION, ELSET=A, MATERIAL=STEEL\n0.5\n')
    decks['hot'] = deck([Box('A', 'C3D8', (0, 0, 0), (1, 1, 4), (2, 2, 8))], '*INITIAL CONDITIONS, TYPE=TEMPERATURE\nNALL, 300.\n' + hold3 + 'A_Z1, 3, 3\n',
                        [('', '*STATIC\n*TEMPERATURE\nNALL, 500.\n')], '*MATERIAL, NAME=STEEL\n*ELASTIC\n2.1E5, 0.3, 300.\n1.7E5, 0.32, 600.\n*EXPANSION, ZERO=300.\n1.1E-5, 300.\n1.4E-5, 700.\n')
    return decks


class Decks(Case):
    def convert(self, name, text, status=0, *options, **more):
        """The lines about what is not converted, and the folder of the scene."""
        with open(self.path(f'{name}.inp'), 'w', encoding='ascii') as file:
            file.write(text)
        run = subprocess.run(['/usr/bin/python3', CONVERT, f'{name}.inp', '--scene', name, *options], cwd=self.folder, capture_output=True, text=True, timeout=100 * PATIENCE,
                             check=False, **more)
        self.assertEqual(run.returncode, status, run.stdout + run.stderr)
        if status:
            return run.stderr, None
        return run.stdout.split('in it', 1)[1].splitlines()[1:], self.path(name)

    def solve(self, folder, mu=()):
        import hyco  # pylint: disable=import-outside-toplevel
        with hyco.Scene(folder) as scene:
            return scene.solve(mu)

    def ccx(self, name):
        """The displacements that CalculiX prints, of the last time, in the order of the nodes' numbers; the force of the support below."""
        run = subprocess.run([CCX, name], cwd=self.folder, capture_output=True, text=True, timeout=100 * PATIENCE, check=False, env={**os.environ, 'OMP_NUM_THREADS': '1'})
        self.assertIn('Job finished', run.stdout, run.stdout[-2000:])
        with open(self.path(f'{name}.dat'), encoding='ascii') as file:
            last = re.split(r'\n displacements[^\n]*\n', file.read())[-1]
        u, force = re.split(r'\n total force[^\n]*\n', last)
        rows = sorted((line.split() for line in u.splitlines() if line.strip()), key=lambda r: int(r[0]))
        return np.array([[float(w) for w in row[1:]] for row in rows]), np.array([float(w) for w in force.split()])

    @unittest.skipUnless(CCX, 'no ccx (Debian package calculix-ccx): the decks are not compared with CalculiX')
    def test_calculix(self):
        """Thirteen decks: displacements of every node within 0.5 % of the largest; what differs by more has its reason beside it."""
        wide = {'punch': 0.02}  # the edge of a punch between nodes: CalculiX's own node-to-surface contact differs from its surface-to-surface by 0.6 %
        for name, text in flat_decks().items():
            with self.subTest(deck=name):
                left, folder = self.convert(name, text)
                self.assertEqual(left, [])  # nothing is left out
                s, (u, force) = self.solve(folder), self.ccx(name)
                dim = s.displacement.shape[1]
                self.assertEqual(len(s.displacement), len(u))
                error = np.abs(s.displacement - u[:, :dim]).max() / np.abs(u).max()
                mine = sum(np.array(r['force'])[:dim] for r in s.reactions if r['group'] == ('A_Y0' if dim == 2 else 'A_Z0'))
                mine *= 0.5 if name == 'sheet' else 1  # its thickness
                scale = max(np.abs(force[dim - 1]), np.abs(s.contact_forces).max(initial=0), 1e-9)
                print(f'{name}: displacements {100 * error:.3f} %, force {mine[dim - 1]:.6g} and {force[dim - 1]:.6g}')
                self.assertLess(error, wide.get(name, 0.005))
                if name not in ('hangs', 'spins'):  # CalculiX's reactions lack the loads at the held nodes themselves, 1/16 of the weight
                    self.assertLess(abs(mine[dim - 1] - force[dim - 1]) / scale, 0.01)

    def same_as_flat(self, text, **more):
        """Solves a deck in the manner of CAE and the same blocks in a flat deck: one solution. What is not converted."""
        left, folder = self.convert('cae', text, 0, '--frictionless', **more)
        a, b = Box('A', 'C3D8', (0, 0, 0), (1, 1, 1), (4, 4, 4)), Box('B', 'C3D8', (0, 0, 1), (0.5, 0.5, 2), (3, 3, 4), 1001)
        _, flat = self.convert('flat', deck([a, b], pair('B_SZ0', 'A_SZ1') + SYMMETRY + 'A_Z0, 3, 3\n', [('', '*STATIC\n1., 1.\n*BOUNDARY\nB_Z1, 1, 2\nB_Z1, 3, 3, -0.002\n')]))
        s, expected = self.solve(folder), self.solve(flat)
        np.testing.assert_allclose(s.displacement, expected.displacement, atol=1e-9 * 0.002)
        self.near(s.total_contact_force, expected.total_contact_force, 1e-9)
        shutil.rmtree(folder)
        shutil.rmtree(flat)
        return left

    def test_cae(self):
        """Parts with Set-all, an instance that is moved and turned, sets and surfaces of the assembly, a coupled reference point, an included file; friction left
        out by --frictionless and NLGEOM are listed once with their lines."""
        low = Box('A', 'C3D8R', (0, 0, 0), (1, 1, 1), (4, 4, 4))
        tall = Box('B', 'C3D8R', (0, 0, 0), (0.5, 0.5, 1), (3, 3, 4))
        turned = Box('B', 'C3D8R', (0, 0, 0), (0.5, 0.5, 1), (3, 3, 4))
        turned.x = turned.x[:, [2, 1, 0]] * [-1, 1, 1]  # about y by -90 degrees: z becomes -x, x becomes z
        for part, place in ((tall, '0., 0., 1.\n'), (turned, '0., 0., 1.\n0., 0., 1., 0., 1., 1., 90.\n')):
            left = self.same_as_flat(CAE.format(low=low.mesh(True), high=part.mesh(True), place=place))
            for words in ('*ELEMENT, TYPE=C3D8R', '*STEP, NLGEOM', '*FRICTION'):
                self.assertEqual(len([line for line in left if words in line and 'line ' in line]), 1, left)
            self.assertEqual(len(left), 3, left)
        with open(self.path('high.txt'), 'w', encoding='ascii') as file:
            file.write(tall.mesh(True))
        self.same_as_flat(CAE.format(low=low.mesh(True), high='*Include, input=high.txt\n', place='0., 0., 1.\n'))

    def test_draft(self):
        """The draft itself: with --frictionless the coefficient stands beside its contact, entries that are not converted are comments with their lines, as printed."""
        low, high = Box('A', 'C3D8R', (0, 0, 0), (1, 1, 1), (4, 4, 4)), Box('B', 'C3D8R', (0, 0, 0), (0.5, 0.5, 1), (3, 3, 4))
        text = CAE.format(low=low.mesh(True), high=high.mesh(True), place='0., 0., 1.\n').replace('*Step', '*Equation\n2\nBLOCK-1.1, 1, 1., BLOCK-1.2, 1, -1.\n*Spring, elset=none\n*Step')
        left, folder = self.convert('draft', text, 0, '--frictionless')
        with open(os.path.join(folder, 'scene.yaml'), encoding='utf-8') as file:
            draft = file.read()
        for line in left:
            self.assertIn('#   ' + line.strip(), draft)
            number, word = re.match(r' *line (\d+): \*(\w+)', line).groups()
            with open(self.path('draft.inp'), encoding='ascii') as file:
                self.assertTrue(file.read().splitlines()[int(number) - 1].upper().startswith('*' + word), line)
        self.assertEqual({re.search(r'\*(\w+)', line)[1] for line in left}, {'ELEMENT', 'STEP', 'FRICTION', 'EQUATION', 'SPRING'})
        self.assertRegex(draft, r'(?m)^  down_up: \{type: mortar, slave: DOWN, master: UP.*# friction: 0.2')
        error, _ = self.convert('draft', text, status=1)
        self.assertIn('scene.yaml is there already', error)
        checked = self.run_raw('check', '-scene', folder)
        self.assertEqual(checked.returncode, 0, checked.stdout + checked.stderr)
        _, folder = self.convert('dots', text.replace('Down', 'Block-1.Down'), 0, '--frictionless')
        self.hyco('check', '-scene', folder)
        with open(os.path.join(folder, 'scene.yaml'), encoding='utf-8') as file:
            self.assertIn('block_1_down_up_peak: {', file.read())

    def test_friction(self):
        """*FRICTION of the interaction of a contact pair is friction of this contact, and the draft has a history: a block that is pressed and drawn slips with T = mu N.
        Frictions that depend on something, or change in a step, are listed."""
        a, b = Box('A', 'C3D8', (0, 0, 0), (1, 1, 1), (2, 2, 2)), Box('B', 'C3D8', (0.25, 0, 1), (0.75, 1, 2), (2, 2, 2), 1001)
        rows = '*SURFACE INTERACTION, NAME=SMOOTH\n*SURFACE INTERACTION, NAME=ROUGH\n*FRICTION\n0.2, 1e5\n*CONTACT PAIR, INTERACTION=ROUGH\nB_SZ0, A_SZ1\n'
        steps = [('', '*STATIC\n1., 1.\n*BOUNDARY\nB_Z1, 1, 2\nB_Z1, 3, 3, -0.002\n'), ('', '*STATIC\n1., 1.\n*BOUNDARY\nB_Z1, 1, 1, 0.05\n')]
        hold = '*BOUNDARY\nA_Z0, 1, 3\n'
        left, folder = self.convert('rubs', deck([a, b], rows + hold, steps))
        self.assertEqual(left, [])
        with open(os.path.join(folder, 'scene.yaml'), encoding='utf-8') as file:
            draft = file.read()
        self.assertRegex(draft, r'(?m)^  b_sz0_a_sz1: \{type: surface, .*, friction: 0.2\}$')
        self.assertIn('--frictionless', draft)
        found = self.hyco('solve', '-scene', folder)
        force = found['contacts']['b_sz0_a_sz1']['force']
        self.assertGreater(force[2], 1)
        self.near(-force[0], 0.2 * force[2], 1e-6, 'T = mu N')
        self.assertEqual(found['solver'], 'semismooth')
        _, folder = self.convert('one', deck([a, b], rows + hold, steps[:1]))
        self.assertGreater(self.hyco('solve', '-scene', folder)['contacts']['b_sz0_a_sz1']['force'][2], 1)  # one step: a history all the same
        left, folder = self.convert('smooth', deck([a, b], rows.replace('INTERACTION=ROUGH', 'INTERACTION=SMOOTH') + hold, steps[:1]))
        with open(os.path.join(folder, 'scene.yaml'), encoding='utf-8') as file:
            self.assertNotRegex(file.read(), 'friction|history')
        for given in ('*FRICTION, ROUGH\n', '*FRICTION\n0.2, , 10.\n0.3, , 20.\n', '*FRICTION, TAUMAX=5.\n0.2\n'):
            shutil.rmtree(self.path('rubs'))
            left, _ = self.convert('rubs', deck([a, b], rows.replace('*FRICTION\n0.2, 1e5\n', given) + hold, steps))
            self.assertEqual(len([line for line in left if '*FRICTION' in line]), 1, given)

    def test_second_order(self):
        """Contact pairs of cells of second order become mortars, which are solved: a uniform pressure between meshes that do not match."""
        a, b = Box('A', 'C3D20', (0, 0, 0), (1, 1, 1), (2, 2, 1)).second(), Box('B', 'C3D20', (0, 0, 1), (1, 1, 2), (3, 3, 1), 1001).second()
        text = deck([a, b], pair('B_SZ0', 'A_SZ1') + SYMMETRY + 'A_Z0, 3, 3\n', [('', '*STATIC\n1., 1.\n*DSLOAD\nB_SZ1, P, 300.\n')])
        _, folder = self.convert('second', text)
        with open(os.path.join(folder, 'scene.yaml'), encoding='utf-8') as file:
            self.assertIn('type: mortar', file.read())
        s = self.solve(folder)
        self.near(s.total_contact_force, 300, 1e-10)
        top = s.displacement[:, 2].min()
        np.testing.assert_allclose(s.displacement[np.isclose(s.displacement[:, 2], top, rtol=1e-9), 2], -300 / 210000 * 2, rtol=1e-9)

    def test_loads(self):
        """Forces and pressures on single nodes and cells keep their values; several steps with amplitudes are a history; tied contact, clearance, shells, rigid
        facets, general contact and a dynamic step are what the draft says of them."""
        a, b = Box('A', 'C3D8', (0, 0, 0), (1, 1, 1), (2, 2, 2)), Box('B', 'C3D8', (0, 0, 1), (1, 1, 2), (2, 2, 2), 1001)
        top, cells = b.sides['Z1'][0], b.sides['Z1'][1]
        hold = SYMMETRY + 'A_Z0, 3, 3\n'
        _, folder = self.convert('single', deck([a, b], '*CONTACT PAIR, INTERACTION=SI\nB_SZ0, A_SZ1\n*SURFACE INTERACTION, NAME=SI\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=TIED\n' + hold,
                                                [('', f'*STATIC\n*CLOAD\n{top[0]}, 3, -1.\n{top[1]}, 3, -2.\n{top[2]}, 3, -2.\n*DLOAD\n{cells[0]}, P2, 4.\n{cells[1]}, P2, 8.\n')]))
        s = self.solve(folder)
        self.near(sum(np.array(r['force']) for r in s.reactions if r['group'] == 'A_Z0')[2], 5 + 0.25 * (4 + 8), 1e-9)
        with open(os.path.join(folder, 'scene.yaml'), encoding='utf-8') as file:
            self.assertRegex(file.read(), r'(?m)^tie:\n  B_SZ0_A_SZ1: \{slave: B_SZ0, master: A_SZ1\}')
        two = deck([a, b], '*AMPLITUDE, NAME=UP\n0., 0., 0.5, 1., 1., 0.25\n' + pair('B_SZ0', 'A_SZ1') + '*CLEARANCE, MASTER=A_SZ1, SLAVE=B_SZ0, VALUE=0.001\n' + hold,
                   [('', '*STATIC\n1., 2.\n*BOUNDARY\nB_Z1, 3, 3, -0.002\n'), ('', '*STATIC\n1., 1.\n*DSLOAD, AMPLITUDE=UP\nB_SX1, P, 40.\n'), ('', '*DYNAMIC\n1., 1.\n*DSLOAD\nB_SX1, P, 1000.\n')])
        left, folder = self.convert('steps', two)
        self.assertEqual(len(left), 1, left)
        self.assertIn('*DYNAMIC', left[0])
        with open(os.path.join(folder, 'scene.yaml'), encoding='utf-8') as file:
            draft = file.read()
        self.assertIn('times: [0, 2, 3]', draft)
        self.assertIn('[[0, 0], [2, 0], [2.5, 1], [3, 0.25]]', draft)
        self.assertIn('gap: 0.001', draft)
        h = self.solve(folder).history
        self.near(h['total_contact_force'][1], 210000 * 0.001 / 2, 1e-6)
        soft = {'LINEAR\n5.e7': 0, 'LINEAR\n5.e4': 1, 'EXPONENTIAL\n1e-3, 5.': 1, 'HARD, NO SEPARATION': 1}
        for law, count in soft.items():
            shutil.rmtree(self.path('soft'), ignore_errors=True)
            left, _ = self.convert('soft', deck([a, b], pair('B_SZ0', 'A_SZ1').replace('LINEAR\n5.e7', law) + hold, [('', '*STATIC\n')], STEEL.replace('0.3', '0.495')))
            self.assertEqual([('*SURFACE BEHAVIOR' in line) for line in left], count * [True], law)
            with open(self.path('soft', 'scene.yaml'), encoding='utf-8') as file:
                self.assertEqual(file.read().count('element: bbar'), 2)
        odd = '*NODE\n9001, 0., 0., 2.\n9002, 1., 0., 2.\n9003, 1., 1., 2.\n9004, 0., 1., 2.\n*ELEMENT, TYPE=S4R, ELSET=SKIN\n9001, 9001, 9002, 9003, 9004\n*ELEMENT, TYPE=R3D4, ELSET=TOOL\n9002, 9001, 9002, 9003, 9004\n' \
              '*SURFACE, NAME=RIGID, TYPE=ELEMENT\nTOOL, SPOS\n*CONTACT PAIR, INTERACTION=SI\nB_SZ1, RIGID\n*CONTACT\n*CONTACT INCLUSIONS, ALL EXTERIOR\n'
        left, folder = self.convert('odd', deck([a, b], pair('B_SZ0', 'A_SZ1') + odd + hold, [('', '*STATIC\n*DSLOAD\nB_SZ1, P, 30.\n')]))
        for words in ('TYPE=S4R', 'TYPE=R3D4', 'surface without solids', 'name the pairs'):
            self.assertEqual(len([line for line in left if words in line]), 1, left)
        self.near(self.solve(folder).total_contact_force, 30, 1e-9)

    def test_renewed(self):
        """A later *BOUNDARY of the same nodes replaces the earlier one, though it has another value; *DLOAD on shells is left out, not an unknown group; a slave of nodes
        that is drawn a tenth of an edge away is within the tolerance."""
        a, b = Box('A', 'C3D8', (0, 0, 0), (1, 1, 1), (2, 2, 2)), Box('B', 'C3D8', (0, 0, 1.05), (1, 1, 2), (2, 2, 2), 1001)
        shell = '*ELEMENT, TYPE=S4, ELSET=SKIN\n9001, 1, 2, 5, 4\n*SHELL SECTION, ELSET=SKIN, MATERIAL=STEEL\n0.1\n'
        contact = HARD + '*SURFACE, NAME=POINTS, TYPE=NODE\nB_Z0\n*CONTACT PAIR, INTERACTION=SI, TYPE=NODE TO SURFACE\nPOINTS, A_SZ1\n'
        left, folder = self.convert('renewed', deck([a, b], shell + contact + SYMMETRY + 'A_Z0, 3, 3\nB_Z1, 3, 3\n',
                                                    [('', '*STATIC\n1., 1.\n*DLOAD\nSKIN, P, 1.\n9001, P1, 1.\n'), ('', '*STATIC\n1., 1.\n*BOUNDARY\nB_Z1, 3, 3, -0.06\n')]))
        self.assertTrue(any('*DLOAD on elements that are no solids' in line for line in left), left)
        solution = self.solve(folder)
        self.near(solution.displacement[:, 2].min(), -0.06, 1e-9)
        self.assertGreater(solution.contact_forces.sum(), 0)

    def test_steps(self):
        """Each load and support over time, by hand from Abaqus's rules: OP=NEW and MOD, values that are given again or not, within a step twice, of a part of a set; amplitudes in
        step and total time that begin with a jump or go on; *STATIC, *VISCO and AMPLITUDE=STEP steps of several periods; creep in *VISCO alone. What a scene has not is listed."""
        body = Box('A', 'C3D8', (0, 0, 0), (9, 1, 1), (9, 1, 1))
        model = ''.join(f'*SURFACE, NAME=F{k}\n{k}, S2\n' for k in range(1, 9)) + '*NSET, NSET=PULLED\n1, 2\n*INITIAL CONDITIONS, TYPE=TEMPERATURE\nA_N, 20.\n'
        model += ''.join(f'*AMPLITUDE, NAME={name}\n{rows}\n' for name, rows in (('LATE', '0., 0.5, 2., 2., 6., 3.'), ('LONG, TIME=TOTAL TIME', '0., 0., 10., 1.'), ('REAL, VALUE=ABSOLUTE', '0., 0., 1., 7.'),
                                                                            ('EVEN, DEFINITION=EQUALLY SPACED, FIXED INTERVAL=0.5', '0., 1., 0.'), ('FOURIER, DEFINITION=PERIODIC', '1, 1., 0., 0.\n0., 1.')))
        hold = 'A_Z0, 3, 3\nA_X0, 1, 1\n'
        first = '*STATIC\n0.1, 1.\n*BOUNDARY\nA_X1, 1, 1, 0.1\n*DSLOAD\nF1, P, 10.\nF2, P, 10.\nF3, P, 10.\nF6, P, 10.\n' \
                '*DSLOAD, AMPLITUDE=LONG\nF4, P, 8.\n*DSLOAD, AMPLITUDE=REAL\nF7, P, 99.\n*DSLOAD, AMPLITUDE=EVEN\nF8, TRVEC, 4., 0., 0., -2.\n' \
                '*DLOAD\n8, P1, 4.\nA, BX, 2.\n*CLOAD\nPULLED, 3, -1.\n*CLOAD\nPULLED, 3, -2.\n*TEMPERATURE\nA_N, 100.\n'
        second = '*STATIC\n0.1, 4.\n*BOUNDARY, OP=NEW, FIXED\nA_X1, 1, 1\n*BOUNDARY, OP=NEW\n' + hold + \
                 '*DSLOAD, OP=NEW\nF1, P, 20.\nF6, P, 10.\nF7, P, 1.\n*DSLOAD, OP=NEW, AMPLITUDE=LATE\nF3, P, 10.\n*DSLOAD, OP=NEW, AMPLITUDE=LONG\nF4, P, 8.\n'
        third = '*VISCO, CETOL=1.\n0.1, 10.\n*BOUNDARY\nA_X1, 1, 1, 0.3\n*DSLOAD\nF5, P, 6.\n*CLOAD\n2, 3, -5.\n*TEMPERATURE, OP=NEW\n'
        fourth = '*STATIC\n0.1, 5.\n*BOUNDARY\nA_X0, 1, 1, 9.\nA_X0, 1, 1, 0.\nA_Y1, 2, 2\n*DSLOAD\nF6, P, 30.\n*DSLOAD, AMPLITUDE=FOURIER\nF2, P, 3.\n*CLOAD, OP=NEW\n'
        left, folder = self.convert('courses', deck([body], model + '*BOUNDARY\nA_Y0, 2, 2\n' + hold, [('', first), ('', second), ('', third), (', AMPLITUDE=STEP', fourth)],
                                                    STEEL + '*EXPANSION\n1E-5\n*CREEP, LAW=NORTON\n1E-20, 3., 0.\n'))
        self.assertEqual([re.search(r'(\*.*?):', line)[1] for line in left], ['*AMPLITUDE, DEFINITION=PERIODIC', '*BOUNDARY, OP=NEW', '*BOUNDARY twice in a step, with several values',
                                                                               '*BOUNDARY of what was free in the steps before'])
        with open(os.path.join(folder, 'scene.yaml'), encoding='utf-8') as file:
            draft = file.read()
        tables = {name: np.array(re.findall(r'\[([^\[\], ]+), ([^\[\], ]+)\]', rows), float).T for name, rows in re.findall(r'(?m)^    (\w+): (\[\[.*)$', draft)}
        self.assertIn('times: [0, 1, 5, 15, 20]', draft)
        after = 1e-4  # a jump takes a millionth of a step
        times = [0, 0.5, 1, 1 + after, 3, 5, 5 + after, 10, 15, 15 + after, 20]
        expected = {'A_X0: x': 11 * [0], 'A_Z0: z': 11 * [0], 'A_Y0: y': 11 * [0], 'A_Y1: y': 11 * [0],
                    'A_X1: x': [0, 0.05, 0.1, 0.1, 0.1, 0.1, 0.1, 0.2, 0.3, 0.3, 0.3],  # displacements are ramps in every step
                    'F1': [0, 5, 10, 10, 15, 20, 20, 20, 20, 20, 20],
                    'F2': [0, 5, 10, 10, 5, 0, 0, 0, 0, 3, 3],
                    'F3': [0, 5, 10, 5, 20, 25, 25, 25, 25, 25, 25],
                    'F4': [0, 0.4, 0.8, 0.8, 2.4, 4, 4, 8, 8, 8, 8],
                    'F5': [0, 0, 0, 0, 0, 0, 6, 6, 6, 6, 6],
                    'F6': [0, 5, 10, 10, 10, 10, 10, 10, 10, 30, 30],
                    'F7': [0, 3.5, 7, 7, 4, 1, 1, 1, 1, 1, 1],
                    'F8: z': 2 * np.array([0, -2, 0, 0, 0, 0, 0, 0, 0, 0, 0]),
                    'PRESSURE_\\d+_4': [0, 2, 4, 4, 4, 4, 4, 4, 4, 4, 4],
                    'A: x': [0, 1, 2, 2, 2, 2, 2, 2, 2, 2, 2],
                    'PULLED_points_1: z': [0, -1.5, -3, -3, -3, -3, -3, -3, -3, 0, 0],
                    'CLOAD_\\d+_3_-5_points: z': [0, -1.5, -3, -3, -3, -3, -5, -5, -5, 0, 0],
                    'A: temperature': [20, 60, 100, 100, 100, 100, 20, 20, 20, 20, 20],
                    'A: rate': 1e-20 * np.array([0, 0, 0, 0, 0, 0, 1, 1, 1, 0, 0])}
        for what, values in expected.items():
            name, _, axis = what.partition(': ')
            text = re.search(rf'(?m)^  {name}: .*?\b{axis}: ' r'"?([^",}\n]+)' if axis else rf'(?m)^  {name}: ' r'"?([^"\n]+)', draft)
            self.assertTrue(text, what)
            factor, _, table = text[1].rpartition('*') if text[1][-1].isdigit() and '*' in text[1] else ('', '', text[1])
            found = float(factor or 1) * np.interp(times, *tables[table]) if table in tables else np.full(11, float(text[1]))
            np.testing.assert_allclose(found, values, atol=2 * after * np.abs(values).max(), err_msg=what)
        self.hyco('check', '-scene', folder)
        rest = re.findall(r'(?m)^  (\S+): ', draft.split('\nfixed:')[1].split('\nhistory:')[0])
        self.assertEqual(len(rest), 4 + 1 + 3 + 1 + 8, rest)  # nothing else

    def test_reference(self):
        """A reference point that presses, then draws, then returns moves its nodes so, in a history; bodies of which one alone is heavy; a single step ends within its amplitude."""
        low, high = Box('A', 'C3D8', (0, 0, 0), (1, 1, 1), (1, 1, 1)), Box('B', 'C3D8', (0, 0, 0), (0.5, 0.5, 1), (1, 1, 1))
        more = '*Step\n*Static\n1., 1.\n*Boundary\nRP, 2, 2, 0.01\n*End Step\n*Step\n*Static\n1., 2.\n*Boundary, op=NEW\nLeft, XSYMM\nFront, YSYMM\nBlock-1.Z0, 3, 3\nRP, 1, 6\n*End Step\n'
        text = CAE.format(low=low.mesh(True), high=high.mesh(True), place='0., 0., 1.\n').replace(', nlgeom=YES', '')
        left, folder = self.convert('moves', text.replace('Left, XSYMM\nFront', 'Left, XSYMM\nBlock-1.Y0') + more.replace('Front', 'Block-1.Y0'), 0, '--frictionless')
        self.assertEqual(len(left), 1, left)
        with open(os.path.join(folder, 'scene.yaml'), encoding='utf-8') as file:
            draft = file.read()
        self.assertRegex(draft, r'(?m)^  rigid_\d+: \{x: 0, y: "0.01\*ramp1", z: "-0.002\*ramp2"\}')
        self.assertIn('ramp1: [[0, 0], [1, 0], [2, 1], [4, 0]]\n    ramp2: [[0, 0], [1, 1], [2, 1], [4, 0]]', draft)
        low, high = Box('A', 'C3D8', (0, 0, 0), (1, 1, 1), (1, 1, 1)), Box('B', 'C3D8', (0, 0, 2), (1, 1, 3), (1, 1, 1), 1001)
        heavy = STEEL + '*DENSITY\n2.\n'
        for loads, words in (('B, GRAV, 10., 0., 0., -1.\n', 'force:\n  B: {z: -10}'), ('A, GRAV, 10., 0., 0., -1.\nB, GRAV, 10., 0., 0., -1.\n', 'gravity:\n  z: -5'),
                             ('A, CENTRIF, 8., 0., 0., 0., 0., 0., 1.\nB, CENTRIF, 8., 0., 0., 0., 0., 0., 1.\n', 'speed: 2\n')):
            left, folder = self.convert('weight', deck([low, high], '*AMPLITUDE, NAME=UP\n0., 0., 1., 1., 3., 0.\n*BOUNDARY\nA_Z0, 1, 3\nB_Z0, 1, 3\n', [('', '*STATIC\n1., 2.\n*DLOAD, AMPLITUDE=UP\n' + loads)], heavy))
            self.assertEqual(left, [])
            with open(os.path.join(folder, 'scene.yaml'), encoding='utf-8') as file:
                self.assertIn(words, file.read())
            shutil.rmtree(folder)

    def force(self, name, text, *options):
        """What is not converted, the draft, and the force of the contacts."""
        shutil.rmtree(self.path(name), ignore_errors=True)
        left, folder = self.convert(name, text, 0, *options)
        with open(os.path.join(folder, 'scene.yaml'), encoding='utf-8') as file:
            return left, file.read(), self.solve(folder).total_contact_force

    def test_unknown(self):
        """Nothing is silent: a keyword that the reader does not know, and each parameter and value of those that it reads which its table has not, are listed with file and line;
        of the table's keywords each has a reader; what makes nodes and elements is refused."""
        a, b = Box('A', 'C3D8', (0, 0, 0), (1, 1, 1), (1, 1, 1)), Box('B', 'C3D8', (0, 0, 1), (1, 1, 2), (1, 1, 1), 1001)
        good = deck([a, b], pair('B_SZ0', 'A_SZ1') + SYMMETRY + 'A_Z0, 3, 3\n', [('', '*STATIC\n*DSLOAD\nB_SZ1, P, 30.\n')])
        self.assertEqual(self.convert('known', good)[0], [])
        with open(self.path('more.inc'), 'w', encoding='ascii') as file:
            file.write('** two lines\n*QUIVER, STRENGTH=3\n1., 2.\n')
        left, draft, _ = self.force('blanks', good.replace('*SOLID SECTION', '*SOLIDSECTION').replace('SURFACE TO SURFACE', 'SURFACETO SURFACE').replace('*SURFACE INTERACTION', '*surfaceinteraction'))
        self.assertEqual(left, [])  # CalculiX ignores blanks
        self.assertIn('type: mortar', draft)
        odd = {'*ELEMENT, TYPE=C3D8H': ('TYPE=C3D8,', 'TYPE=C3D8H,'), '*STEP, TWO LINES=2': ('*STEP', '*STEP, INC=3,\nTWO LINES=2'), '*SURFACE of a side SPOS': ('*STEP', '*SURFACE, NAME=ODD\n1, SPOS\n*STEP'), '*QUIVER': ('*STEP', '*INCLUDE, INPUT=more.inc\n*STEP'), '*STEP, WOBBLE=2': ('*STEP', '*STEP, WOBBLE=2'), '*STATIC, RIKS': ('*STATIC', '*STATIC, RIKS'),
               '*DSLOAD, ORIENTATION=TURNED': ('*DSLOAD', '*DSLOAD, ORIENTATION=TURNED'), '*BOUNDARY, PHANTOM=EDGE': ('*BOUNDARY', '*BOUNDARY, PHANTOM=EDGE'),
               '*CONTACT PAIR, SMOOTH=0.2': ('SURFACE TO SURFACE', 'SURFACE TO SURFACE, SMOOTH=0.2'), '*ELASTIC, MODULI=LONG TERM': ('*ELASTIC', '*ELASTIC, MODULI=LONG TERM'),
               '*SOLID SECTION, STIFFENED': ('*SOLID SECTION,', '*SOLID SECTION, STIFFENED,'), '*NSET of NOWHERE': ('*STEP', '*NSET, NSET=SOME\nNOWHERE, 3\n*STEP'),
               '*ELSET, EXCEPT=A': ('*ELSET,', '*ELSET, EXCEPT=A,'), '*DENSITY that depends': ('*ELASTIC', '*DENSITY\n7.8, 20.\n7.6, 300.\n*ELASTIC'),
               '*RESTART, READ': ('*STEP', '*RESTART, READ\n*STEP'), '*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=TABULAR': ('=LINEAR', '=TABULAR'), '*MPC': ('*STEP', '*MPC\nPLANE, 1, 2, 3\n*STEP')}
        for words, (old, new) in odd.items():
            shutil.rmtree(self.path('odd'), ignore_errors=True)
            left, _ = self.convert('odd', good.replace(old, new, 1))
            self.assertEqual(len(left), 1, left)
            self.assertRegex(left[0], ('more.inc, line 2: ' if words == '*QUIVER' else r'^ *line \d+: ') + re.escape(words))
            if words != '*QUIVER' and ' of ' not in words:
                line = good.replace(old, new, 1).splitlines()[int(re.search(r'line (\d+)', left[0])[1]) - 1]
                self.assertTrue(line.startswith(words.split(',')[0].split(' that')[0]), line)
        for new, words in (('*NGEN, NSET=A_N\n1, 3, 1\n', 'line 3: *NGEN'), ('*NODE, SYSTEM=C\n99, 1., 0., 0.\n', 'line 3: *NODE, SYSTEM=C'), ('*SURFACE, NAME=S, COMBINE=DIFFERENCE\nA, B\n', 'line 3: *SURFACE, COMBINE')):
            self.assertIn(words, self.convert('made', good.replace('*NODE', new + '*NODE', 1), 1)[0])
        sys.path.insert(0, os.path.dirname(CONVERT))
        import deck as reader, keywords  # pylint: disable=import-outside-toplevel,import-error
        lost = [word for word in keywords.READ if not hasattr(reader.Draft, 'on_' + re.sub(r'\W', '_', word).lower())]
        self.assertEqual(lost, ['KINEMATIC', 'RESTART'])  # the first is read with *COUPLING, of the second no parameter changes the mechanics

    def test_included(self):
        """Data lines in an *INCLUDE, or INPUT=, belong to the keyword before it: supports and forces as cgx writes them; names in quotes with blanks and commas; a file of a file."""
        a = Box('A', 'CPS4', (0, 0), (1, 1), (1, 1))
        text = deck([a], '*BOUNDARY\n*INCLUDE, INPUT=base.bou\n', [('', '*STATIC\n*CLOAD\n*INCLUDE, INPUT=top.cld\n')]).replace('*NSET, NSET=NALL\n', '*NSET, NSET="the top, in all"\n*INCLUDE, INPUT=top.nam\n*NSET, NSET=NALL\n')
        nodes, _, rest = text.partition('*ELEMENT')
        for name, rows in (('base.bou', '** of a mesher\n1, 1, 2\n*INCLUDE, INPUT=more.bou\n'), ('more.bou', '3, 2\n'), ('top.nam', '2, 4\n'), ('top.cld', '"the top, in all", 2, -5.\n'), ('nodes.txt', nodes.partition('NSET=A_N\n')[2])):
            with open(self.path(name), 'w', encoding='ascii') as file:
                file.write(rows)
        left, folder = self.convert('cgx', '*HEADING\n*NODE, NSET=A_N, INPUT=nodes.txt\n*ELEMENT' + rest.replace('0.3\n', '0.\n'))
        self.assertEqual(left, [])
        s = self.solve(folder)
        np.testing.assert_allclose(sorted(s.displacement[:, 1]), [-10 / 210000, -10 / 210000, 0, 0], atol=1e-18)

    def test_moved(self):
        """*CONTACT PAIR, ADJUST moves slave nodes onto the master: those nearer than the distance, those that overlap, or those of a set, also the middle ones; others stay. In the second
        order too: the compression of the bodies as they then are."""
        hold = SYMMETRY + 'A_Z0, 3, 3\n'
        for kind, gap, given, height in (('C3D8', 0.05, '0.1', 2.05), ('C3D8', -0.02, '0.', 1.98), ('C3D20', 0.05, 'B_Z0', 2.05), ('C3D8', 0.05, '0.04', 0), ('C3D8', 0.05, 'B_Z1', 0)):
            a, b = Box('A', kind, (0, 0, 0), (1, 1, 1), (1, 1, 1)), Box('B', kind, (0, 0, 1 + gap), (1, 1, 2 + gap), (2, 2, 1), 1001)
            if kind == 'C3D20':
                a.second(), b.second()
            given = f'ADJUST={given}'
            text = deck([a, b], HARD + f'*CONTACT PAIR, INTERACTION=SI, {given}\nB_SZ0, A_SZ1\n' + hold, [('', '*STATIC\n*BOUNDARY\nB_Z1, 3, 3, -0.04\n')], STEEL.replace('0.3', '0.'))
            left, draft, force = self.force('adjusted', text)
            self.assertEqual(left, [])
            self.assertRegex(draft, r'line \d+: \*CONTACT PAIR, ADJUST: ' + (r'(\d+) of \1 ' if height else '0 of'))
            self.near(force, 210000 * 0.04 / height if height else 0, 1e-9, given)

    def test_skins(self):
        """Surfaces of a set of elements without sides, as slave and as master, in a contact and in a tie, become the facets that face the other one, past a hole whose wall looks the same way and a
        corner of the other body; so do sides that go round an edge. Surfaces to each other are mortars, nodes to a surface not."""
        low, top = Box('A', 'CPE4', (0, 0), (4, 1), (8, 2)), Box('B', 'CPE4', (0, 1), (2, 3), (6, 6), 1001)
        top.elements = {e: c for e, c in top.elements.items() if e not in (1001 + 14, 1001 + 15, 1001 + 20, 1001 + 21)}  # a hole
        more = '*SURFACE, NAME=SKIN, TYPE=ELEMENT\nB,\n*SURFACE, NAME=HULL, TYPE=ELEMENT\nA\n*SURFACE, NAME=ROUND, TYPE=ELEMENT\n' + ''.join(f'_B_{side}, S{top.sides[side][2]}\n' for side in top.sides)
        steps = [('', '*STATIC\n*BOUNDARY\nB_Y1, 1, 1\nB_Y1, 2, 2, -0.01\n')]

        def text(slave, master, kind):
            return deck([low, top], more + pair(slave, master, kind) + '*BOUNDARY\nA_Y0, 1, 2\n', steps)

        for kind, word in (('NODE TO SURFACE', 'surface'), ('SURFACE TO SURFACE', 'mortar')):
            _, draft, expected = self.force('sides', text('B_SY0', 'A_SY1', kind))
            self.assertGreater(expected, 100)
            for slave, master in (('SKIN', 'A_SY1'), ('B_SY0', 'HULL'), ('SKIN', 'HULL'), ('ROUND', 'HULL')):
                _, draft, force = self.force('sides', text(slave, master, kind))
                self.assertIn(f'type: {word}, slave: {slave}, master: {master}', draft)
                self.near(force, expected, 1e-9, (slave, master, kind))
        a, b = Box('A', 'C3D8', (0, 0, 0), (1, 1, 1), (2, 2, 2)), Box('B', 'C3D8', (0, 0, 1), (1, 1, 2), (3, 3, 2), 1001)
        glued = '*SURFACE, NAME=SKIN, TYPE=ELEMENT\nB,\n*TIE, NAME=GLUE\nSKIN, A_SZ1\n*BOUNDARY\nA_Z0, 1, 3\n'
        left, folder = self.convert('stuck', deck([a, b], glued, [('', '*STATIC\n*DSLOAD\nSKIN, P, 7.\nB_SZ1, P, 3.\n')]))  # a pressure on the whole skin stays there
        self.assertEqual(left, [])
        self.near(sum(np.array(r['force']) for r in self.solve(folder).reactions if r['group'] == 'A_Z0')[2], 3, 1e-9)

    def test_laws(self):
        """Of several *PLASTIC, RATE= tables that of the lowest rate is taken, in any order, and the others are listed; the penalty of a tied interaction gets the note of LINEAR."""
        a, b = Box('A', 'C3D8', (0, 0, 0), (1, 1, 1), (1, 1, 1)), Box('B', 'C3D8', (0, 0, 1), (1, 1, 2), (1, 1, 1), 1001)
        slow, fast = '*PLASTIC, RATE=0.\n5., 0.\n6., 0.1\n', '*PLASTIC, RATE=1.\n15., 0.\n16., 0.1\n'
        for k, (materials, count) in enumerate(((STEEL + slow + fast, 1), (STEEL + fast + slow, 1), (STEEL + slow, 0))):
            left, folder = self.convert(f'rate{k}', deck([a, b], SYMMETRY, [('', '*STATIC\n')], materials))
            self.assertEqual([('*PLASTIC, RATE=1' in line) for line in left], count * [True])
            with open(os.path.join(folder, 'scene.yaml'), encoding='utf-8') as file:
                self.assertIn('yield: 5, hardening: 10', file.read())
        flat = Box('A', 'CPS4', (0, 0), (1, 1), (1, 1))
        left, folder = self.convert('flat yield', deck([flat], '*BOUNDARY\nA_Y0, 1, 2\n', [('', '*STATIC\n*CLOAD\nA_Y1, 2, 3.\n')], STEEL + slow))
        self.assertEqual(['in plane stress' in line for line in left], [True])  # the bodies are elastic there
        self.solve(folder)
        self.convert('exchanged', deck([a, b], '*TIE, NAME=T\nB_SZ0, A_SZ1\n*BOUNDARY\nA_Z0, 1, 3\nB_X0, 1, 1\n', [('', '*STATIC\n*DSLOAD\nB_SZ1, P, 3.\n')]))
        left, _ = self.convert('apart', deck([a, Box('B', 'C3D8', (0, 0, 1.01), (1, 1, 2), (1, 1, 1), 1001)], '*TIE, NAME=T, ADJUST=NO\nB_SZ0, A_SZ1\n*BOUNDARY\nA_Z0, 1, 3\n', [('', '*STATIC\n')]))
        self.assertEqual(['ADJUST=NO' in line for line in left], [True])
        self.solve(self.path('exchanged'))  # a tied node with a support of its own would be refused
        held = '*BOUNDARY\nA_Y0, 2, 2\n1, 1, 1\n*ELEMENT, TYPE=SPRING1, ELSET=K\n91, 2\n92, 4\n*SPRING, ELSET=K\n2\n7.\n'
        left, folder = self.convert('sprung', deck([flat], held, [('', '*STATIC\n*CLOAD\nA_Y1, 2, 50.\n')], STEEL.replace('210000', '100')))
        self.assertEqual(left, [])
        self.near(self.solve(folder).displacement[:, 1].max(), 100 / (100 + 2 * 7), 1e-9)  # cell and springs side by side
        part = '*PART, NAME=P\n*NODE\n1, 0, 0\n2, 1, 0\n3, 1, 1\n4, 0, 1\n*ELEMENT, TYPE=CPS4, ELSET=E\n1, 1, 2, 3, 4\n*SOLID SECTION, ELSET=E, MATERIAL=STEEL\n1.\n*END PART\n'
        whole = ('*ASSEMBLY, NAME=A\n*INSTANCE, NAME=I-1, PART=P\n*END INSTANCE\n*NSET, NSET=LOW, INSTANCE=I-1\n1, 2\n*NSET, NSET=UP, INSTANCE=I-1\n3, 4\n'
                 '*SPRING, ELSET=K\n2\n\n7.\n*ELEMENT, TYPE=SPRING1, ELSET=K\n91, I-1.3\n92, I-1.4\n*END ASSEMBLY\n')
        steel = '*MATERIAL, NAME=STEEL\n*ELASTIC\n100., 0.\n'
        left, folder = self.convert('sprung part', part + whole + steel + '*BOUNDARY\nLOW, 1, 2\n*STEP\n*STATIC\n*CLOAD\nUP, 2, 50.\n*END STEP\n')
        self.assertEqual(left, [])
        self.near(self.solve(folder).displacement[:, 1].max(), 100 / (100 + 2 * 7), 1e-9)
        with open(self.path('shell.inp'), 'w', encoding='ascii') as file:
            file.write((part + whole + steel).replace('CPS4', 'S4'))
        for deck_name, reader in (('shell.inp', '-'), ('sprung part.inp', 'closed')):  # no solids; a reader that has gone
            out, into = os.pipe()
            os.close(out)
            run = subprocess.run([sys.executable, os.path.join(SOURCE, 'scripts', 'convert'), self.path(deck_name), '--scene', self.path(reader)], stdout=into,
                                 stderr=subprocess.PIPE, text=True, check=False)
            os.close(into)
            self.assertNotIn('Traceback', run.stderr)
            self.assertEqual((run.returncode, 'S4' in run.stderr, os.path.exists(os.path.join(self.path(reader), 'scene.yaml'))),
                             (1, True, False) if reader == '-' else (0, False, True), run.stderr)
        for slope, soft in (('5.e7', False), ('5.e4', True)):
            left, folder = self.convert('tied' + slope, deck([a, b], pair('B_SZ0', 'A_SZ1').replace('LINEAR\n5.e7', 'TIED\n' + slope) + SYMMETRY, [('', '*STATIC\n')]))
            with open(os.path.join(folder, 'scene.yaml'), encoding='utf-8') as file:
                self.assertRegex(file.read(), r'#   line \d+: \*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=TIED: ' + ('' if soft else 'taken as a penalty'))
            self.assertEqual(len(left), soft)

    def test_planes(self):
        """Plane cells in the planes xz and yz are turned into xy, with their supports and loads: a bar under its weight and a force."""
        expected = None
        for axes in ((0, 1), (0, 2), (1, 2)):
            a = Box('A', 'CPS4', (0, 0), (1, 2), (1, 2))
            x = np.zeros_like(a.x)
            x[:, axes] = a.x[:, :2]
            a.x, (c, d) = x, (axes[0] + 1, axes[1] + 1)
            way = ', '.join('-1.' if k == d else '0.' for k in (1, 2, 3))
            text = deck([a], f'*BOUNDARY\nA_Y0, {d}, {d}\n1, {c}, {c}\n', [('', f'*STATIC\n*CLOAD\nA_Y1, {d}, -1.\n*DLOAD\nA, GRAV, 3., {way}\n')], STEEL + '*DENSITY\n2.\n')
            left, folder = self.convert('plane' + str(d + c), text)
            self.assertEqual(left, [])
            u = self.solve(folder).displacement
            expected = u if expected is None else expected
            np.testing.assert_allclose(u, expected, atol=1e-14 * np.abs(u).max())
        self.near(u[:, 1].min(), -(2 * 2 + 3 * 2 * 2 ** 2 / 2) / 210000, 0.02)

    def test_page(self):
        """docs/convert.md: the commands of the worked deck, and what they print."""
        tools = self.path('page', 'tools')
        os.makedirs(tools)
        os.symlink(sys.executable, os.path.join(tools, 'python3'))
        path = os.pathsep.join([tools, os.path.dirname(HYCO), os.environ['PATH']])
        ran = document.run(os.path.join(SOURCE, 'docs', 'convert.md'), self.path('page'), {'TREE': SOURCE, 'PATH': path, 'PYTHONPATH': PACKAGE})
        self.assertEqual(ran, 4)

    def test_refused(self):
        """A deck without sections, a section without elements, a surface that is not there."""
        a = Box('A', 'C3D8', (0, 0, 0), (1, 1, 1), (1, 1, 1))
        good = deck([a], '*BOUNDARY\nA_Z0, 1, 3\n', [('', '*STATIC\n*DSLOAD\nA_SZ1, P, 1.\n')])
        for old, new, words in (('*SOLID SECTION, ELSET=A', '*ORIENTATION, NAME=A', 'SOLID SECTION'), ('ELSET=A, MATERIAL', 'ELSET=ZZ, MATERIAL', 'ZZ'),
                                ('A_SZ1, P, 1.', 'A_SZ1, P, 1.x', "line 60: .*'1.X'"), ('A_SZ1, P, 1.', 'NOWHERE, P, 1.', 'NOWHERE'), ('*DSLOAD', '*DSLOAD, AMPLITUDE=NEVER', 'NEVER'), ('A_Z0, 1, 3', 'NOTHING, 1, 3', 'NOTHING')):
            self.assertIn(old, good)
            error, _ = self.convert('refused', good.replace(old, new), status=1)
            self.assertRegex(error, words)
            self.assertEqual(len(error.splitlines()), 1)
            self.assertFalse(os.path.exists(self.path('refused', 'scene.yaml')))


if __name__ == '__main__':
    unittest.main()
