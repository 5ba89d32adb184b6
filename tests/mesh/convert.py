"""scripts/convert: Abaqus .inp, .unv, and through meshio if installed, as scenes' meshes with their groups."""
import importlib.util
import os
import subprocess
import sys
import unittest

from common import PATIENCE, SOURCE, Case

CONVERT = os.path.join(SOURCE, 'scripts', 'convert')


def block(x, y):
    """A 2 x 1 block's nodes and cells at (x, y), in Abaqus's format."""
    nodes = '\n'.join(f'{1 + i + 3 * j}, {x + i}., {y + j}.' for j in range(2) for i in range(3))
    return f'*Node\n{nodes}\n*Element, type=CPE4\n1, 1, 2, 5, 4\n2, 2, 3, 6, 5\n'


FLAT = f"""*Heading
** a comment, with commas
{block(0, 0)}*Elset, elset=all, generate
1, 2, 1
*Elset, elset=first
1,
*Nset, nset=foot, generate
1, 3, 1
*Nset, nset=corner
4
*Nset, nset=two
corner, 1
*Nset, nset=some
1, 3
*Surface, type=ELEMENT, name=top
all, S3
*Surface, type=ELEMENT, name="outer skin"
all,
*Material, name=steel
*Elastic
2e5, 0.3
"""
PARTS = f"""*Part, name=slab
{block(0, 0)}*Elset, elset=all, generate
 1, 2, 1
*Nset, nset=left
 1, 4
*Surface, type=ELEMENT, name=over
all, S3
*Surface, type=ELEMENT, name=under
all, S1
*End Part
*Assembly, name=Assembly
*Instance, name=low, part=slab
*End Instance
*Instance, name=high, part=slab
 0., 1.
*End Instance
*Nset, nset=foot, instance=low
 1, 2, 3
*Elset, elset=both, instance=low
 all,
*Elset, elset=both, instance=high
 all,
*End Assembly
"""
SCENE = """
scene: {mesh: m.msh, parameters: [p]}
parameter: {p: {range: [0.1, 2]}}
body: {low.ALL: {young: 100}, high.ALL: {young: 100}}
fixed: {FOOT: {y: 0}, LEFT: {x: 0}}
pressure: {high.OVER: p}
contact: {gap: {type: pair, slave: high.UNDER, master: low.OVER}}
"""
UNV = """    -1
  2411
""" + ''.join(f'{k:10d}         1         1        11\n   {x:.16E}   {y:.16E}   {z:.16E}\n'.replace('E', 'D')
              for k, (x, y, z) in enumerate([(i, j, k) for k in (0, 1) for j in (0, 1) for i in (0, 1)], 1)) + """    -1
    -1
  2412
         1       115         1         1         7         8
         1         2         4         3         5         6         8         7
         2        44         1         1         7         4
         1         2         4         3
         3        11         1         1         7         2
         0         0         0
         1         2
    -1
    -1
  2467
         1         0         0         0         0         0         0         1
the cube
         8         1         0         0
         2         0         0         0         0         0         0         1
floor
         8         2         0         0
         3         0         0         0         0         0         0         3
roof
         7         5         0         0         7         6         0         0
         7         7         0         0
         4         0         0         0         0         0         0         4
right
         7         2         0         0         7         4         0         0
         7         6         0         0         7         8         0         0
    -1
"""


class Convert(Case):
    def convert(self, name, text, *args, status=0):
        """The script's output for a file with this text: groups {name: (count, kind)}, or its one line of error."""
        with open(self.path(name), 'w', encoding='utf-8') as f:
            f.write(text)
        run = subprocess.run([sys.executable, CONVERT, self.path(name), self.path('m.msh'), *args], capture_output=True, text=True, timeout=20 * PATIENCE)
        self.assertEqual(run.returncode, status, run.stdout + run.stderr)
        if status:
            self.assertEqual(run.stderr.count('\n'), 1, run.stderr)
            self.assertIn('convert: error: ', run.stderr)
            return run.stderr
        rows = [line.split() for line in run.stdout.splitlines()[1:]]
        return {' '.join(row[:-2])[:-1]: (int(row[-2]), row[-1]) for row in rows}

    def checked(self, scene):
        with open(self.path('scene.yaml'), 'w', encoding='ascii') as f:
            f.write(scene)
        return self.hyco('check', '-scene', 'scene.yaml')

    def pushed(self, kind, volume, pushes):
        """A cell with the sides SIDE1, SIDE2, ...: a pressure on each has its resultant, gravity on a density that of the volume."""
        for k, push in enumerate(pushes, 1):
            with open(self.path('scene.yaml'), 'w', encoding='ascii') as f:
                f.write(f'scene: {{mesh: m.msh}}\nbody: {{BODY: {{young: 100, density: 3}}}}\nfixed: {{FOOT: {{x: 0, y: 0, z: 0}}}}\ngravity: {{x: 2}}\npressure: {{SIDE{k}: 1}}\n')
            report = self.hyco('solve', '-scene', 'scene.yaml')
            with self.subTest(kind=kind, side=k):
                for c in range(3):
                    self.assertAlmostEqual(report['loads']['force'][c], push[c] + (6 * volume if c == 0 else 0), places=12)

    def test_flat(self):
        """An Abaqus .inp in 2D: its sets as groups."""
        self.assertEqual(self.convert('flat.inp', FLAT),
                         {'ALL': (2, 'quad4'), 'FIRST': (1, 'quad4'), 'FOOT': (2, 'line2'), 'TOP': (2, 'line2'), 'OUTER_SKIN': (6, 'line2'),
                          'CORNER': (1, 'point1'), 'TWO': (1, 'line2'), 'SOME': (2, 'point1')})
        self.checked('scene: {mesh: m.msh, parameters: [p]}\nparameter: {p: {range: [0.1, 1]}}\nbody: {ALL: {young: 100, poisson: 0.3}}\n'
                     'fixed: {FOOT: {y: 0}, CORNER: {x: 0}}\npressure: {TOP: p}\n')

    def test_parts(self):
        """Two slabs in contact, of parts and instances, under a pressure: stress -p, the top sinks by p 2 / 100."""
        groups = self.convert('parts.inp', PARTS)
        self.assertEqual({k: groups[k] for k in ('ALL', 'LOW.ALL', 'HIGH.ALL', 'BOTH', 'FOOT', 'LEFT', 'LOW.OVER', 'HIGH.UNDER')},
                         {'ALL': (4, 'quad4'), 'LOW.ALL': (2, 'quad4'), 'HIGH.ALL': (2, 'quad4'), 'BOTH': (4, 'quad4'), 'FOOT': (2, 'line2'),
                          'LEFT': (2, 'line2'), 'LOW.OVER': (2, 'line2'), 'HIGH.UNDER': (2, 'line2')})
        with open(self.path('scene.yaml'), 'w', encoding='ascii') as f:
            f.write(SCENE.replace('low.', 'LOW.').replace('high.', 'HIGH.'))
        report = self.hyco('solve', '-scene', 'scene.yaml', '-mu', '1')
        self.solved(report)
        self.near(report['total_contact_force'], 2, 1e-10, 'the pressure over the length')
        self.near(report['u_min'][1], -0.02, 1e-10, 'the top')

    def test_unv(self):
        """A .unv in 3D, scaled: its groups, and the volume of the scene."""
        self.assertEqual(self.convert('cube.unv', UNV, '--scale', '10'),
                         {'the_cube': (1, 'hex8'), 'floor': (1, 'quad4'), 'right': (1, 'quad4'), 'roof': (3, 'point1')})
        report = self.checked('scene: {mesh: m.msh, parameters: [p]}\nparameter: {p: {range: [1, 2]}}\nbody: {the_cube: {young: 7}}\n'
                              'fixed: {floor: {x: 0, y: 0, z: 0}}\npressure: {right: p}\n')
        self.assertEqual(report['command'], 'check')
        with open(self.path('m.msh'), encoding='ascii') as f:
            self.assertIn('\n10 10 10\n', f.read())
        empty = '         9         0         0         0         0         0         0         0\nnothing\n\n'
        self.assertEqual(self.convert('empty.unv', UNV.replace('  2467\n', '  2467\n' + empty)), self.convert('cube.unv', UNV))

    def test_second_order(self):
        """A cube of one C3D20 or C3D27 and a tetrahedron of one C3D10, in Abaqus's order: pressure on each side S1, S2, ... has the resultant of that side, gravity that of the volume."""
        cube = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
        tet = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
        ring = [(0, 1), (1, 2), (2, 3), (3, 0)]
        edges, sides = [*ring, *((a + 4, b + 4) for a, b in ring), *((k, k + 4) for k in range(4))], ((0, 0, 1), (0, 0, -1), (0, 1, 0), (-1, 0, 0), (0, -1, 0), (1, 0, 0))
        middles = [range(8), range(4), range(4, 8), *((a, b, a + 4, b + 4) for a, b in ring)]  # of the cell and of S1, S2, ...
        for kind, corners, edges, volume, pushes in (
                ('C3D20R', cube, edges, 1, sides), ('C3D27', cube, edges + middles, 1, sides),
                ('C3D10', tet, [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)], 1 / 6, ((0, 0, .5), (0, .5, 0), (-.5, -.5, -.5), (.5, 0, 0)))):
            places = [*corners, *(tuple(sum(c) / len(c) for c in zip(*(corners[i] for i in of))) for of in edges)]
            numbers = [str(k + 1) for k in range(len(places))]
            text = '*Node\n' + ''.join(f'{k}, {x}, {y}, {z}\n' for k, (x, y, z) in enumerate(places, 1))
            text += f'*Element, type={kind}, elset=body\n1, {", ".join(numbers[:9])},\n{", ".join(numbers[9:])}\n'
            text += ''.join(f'*Surface, type=ELEMENT, name=side{k}\n1, S{k}\n' for k in range(1, len(pushes) + 1)) + '*Nset, nset=foot\n1, 2, 3\n'
            groups = self.convert('second.inp', text)
            self.assertEqual(groups['BODY'], (1, {'C3D20R': 'hex20', 'C3D27': 'hex27', 'C3D10': 'tet10'}[kind]))
            self.pushed(kind, volume, pushes)

    def test_gmsh_second_order(self):
        """What gmsh writes as .inp in order 2: lines of T3D3 with the node in the middle at the end, triangles of CPS6. Trusses of Abaqus have it between the ends."""
        nodes = '*NODE\n1,0,0\n2,1,0\n3,0,1\n4,.5,0\n5,.5,.5\n6,0,.5\n'
        for line in ('1, 2, 4', '1, 4, 2'):
            groups = self.convert('t3.inp', f'{nodes}*ELEMENT, TYPE=T3D3, ELSET=L\n1, {line}\n*ELEMENT, TYPE=CPS6, ELSET=S\n2, 1, 2, 3, 4, 5, 6\n')
            self.assertEqual(groups, {'S': (1, 'tri6'), 'L': (1, 'line3')})
            self.checked('scene: {mesh: m.msh}\nbody: {S: {young: 100}}\nfixed: {L: {x: 0, y: 0}}\n')

    def test_several_types(self):
        """A prism and a pyramid in Abaqus's order: pressure on each side S1, S2, ... has the resultant of that side, gravity that of the volume; quadrilaterals
        and triangles in one set."""
        prism, pyramid = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)], [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (.5, .5, 1)]
        for kind, places, volume, pushes in (('C3D6', prism, 1 / 2, ((0, 0, .5), (0, 0, -.5), (0, 1, 0), (-1, -1, 0), (1, 0, 0))),
                                             ('C3D5', pyramid, 1 / 3, ((0, 0, 1), (0, .5, -.25), (-.5, 0, -.25), (0, -.5, -.25), (.5, 0, -.25)))):
            text = '*Node\n' + ''.join(f'{k}, {x}, {y}, {z}\n' for k, (x, y, z) in enumerate(places, 1))
            text += f'*Element, type={kind}, elset=body\n1, {", ".join(str(k + 1) for k in range(len(places)))}\n'
            text += ''.join(f'*Surface, type=ELEMENT, name=side{k}\n1, S{k}\n' for k in range(1, 6)) + '*Nset, nset=foot\n1, 2, 3\n'
            self.assertEqual(self.convert('one.inp', text)['BODY'], (1, {'C3D6': 'prism6', 'C3D5': 'pyramid5'}[kind]))
            self.pushed(kind, volume, pushes)
        self.convert('flat.inp', FLAT.replace('2, 2, 3, 6, 5', '*Element, type=CPE3\n2, 2, 3, 6\n3, 2, 6, 5').replace('1, 2, 1\n', '1, 3, 1\n'))
        report = self.checked('scene: {mesh: m.msh}\nbody: {ALL: {young: 100}}\nfixed: {FOOT: {x: 0, y: 0}}\n')
        self.assertEqual(report['cell_types'], {'tri3': 2, 'quad4': 1})

    def test_refused(self):
        """Elements and files that cannot be converted are named."""
        for name, text, words in (('a.inp', FLAT.replace('CPE4', 'C3D15'), 'elements of type C3D15'), ('g.inp', FLAT.replace('CPE4', 'CPE8R'), 'element 1 of type CPE8R has 4 nodes; 8 are expected'), ('b.inp', '*Heading\n', 'has no cells'),
                                  ('c.inp', FLAT.replace('1, 1, 2, 5, 4', '1, 1, 2, 5, 44'), 'is not as such a file should be'),
                                  ('d.inp', PARTS.replace(' 0., 1.', ' 0., 1.\n 0,0,0,0,0,1'), 'two points and an angle'),
                                  ('e.unv', UNV.replace('115', '116'), 'FE descriptor 116'), ('s.unv', UNV.replace('115', '118'), 'gmsh '),
                                  ('n.inp', FLAT.replace('*Element', '*Ngen, nset=more\n1, 3, 1\n*Element'), 'line 10: *NGEN')):
            self.assertIn(words, self.convert(name, text, status=1))
        self.assertIn('has groups of its own', self.convert('f.inp', FLAT, '--groups', 'x', status=1))
        self.assertFalse(os.path.exists(self.path('m.msh.partial')))

    @unittest.skipIf(importlib.util.find_spec('meshio'), 'meshio is here: tests/ecosystem reads by it')
    def test_without_meshio(self):
        """Without meshio the message says how to install it."""
        self.assertIn('pip install meshio', self.convert('a.vtu', '<VTKFile/>', status=1))


if __name__ == '__main__':
    unittest.main()
