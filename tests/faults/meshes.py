"""Broken meshes and scenes, made here from a sound one: one line, status 1, soon, on one rank and on two or three."""
import os
import subprocess
import unittest
from concurrent.futures import ThreadPoolExecutor

from common import Case, msh
from rows import Rows

# two squares of 2 x 2 cells, one over the other; groups by tag
NAMES = {1: (2, 'low'), 2: (2, 'up'), 3: (1, 'floor'), 4: (1, 'top'), 5: (1, 'under'), 6: (1, 'over')}
ROWS = Rows('meshes')
MPI_NOISE = ('mpiexec', '-----', 'Primary job', 'a non-zero exit code', 'the job to be', 'Process name', 'Exit code')
SCENE = '''scene:
  mesh: two.msh
  parameters: [load]
parameter: {load: {range: [0.001, 0.1]}}
body:
  low: {young: 1, poisson: 0.3}
  up: {young: 2, poisson: 0.3}
fixed:
  floor: {x: 0, y: 0}
  top: {x: 0, y: -load}
contact:
  c: {type: pair, slave: over, master: under}
'''


def sound():
    """Nodes and elements of the two squares; the gap is 0."""
    nodes, elements = [], []
    for body in range(2):
        first = len(nodes) + 1
        nodes += [(i / 2, body + j / 2, 0.0) for j in range(3) for i in range(3)]
        at = lambda i, j, first=first: first + 3 * j + i
        elements += [(3, body + 1, [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]) for j in range(2) for i in range(2)]
        for tag, j in (((3, 0), (5, 2)) if body == 0 else ((6, 0), (4, 2))):
            elements += [(1, tag, [at(i, j), at(i + 1, j)]) for i in range(2)]
    return nodes, elements


def moved(nodes, k, x):
    return nodes[:k] + [x] + nodes[k + 1:]


# (what, change of (nodes, elements, names) -> the same, expected text); nodes count from 0 here, from 1 in elements
MESHES = [
    ('a node is missing', lambda n, e, g: (n[:-1], e, g), 'names node 18, which the file does not define'),
    ('node 0', lambda n, e, g: (n, [(3, 1, [0, 2, 5, 4])] + e[1:], g), 'names node 0, which the file does not define'),
    ('NaN', lambda n, e, g: (moved(n, 4, (float('nan'), 0, 0)), e, g), 'node 5 has a coordinate that is not finite'),
    ('infinite', lambda n, e, g: (moved(n, 4, (0, float('inf'), 0)), e, g), 'node 5 has a coordinate that is not finite'),
    ('inverted cell', lambda n, e, g: (moved(n, 4, (-1.0, -1.0, 0)), e, g), 'cell'),
    ('degenerate cell', lambda n, e, g: (n, [(3, 1, [1, 1, 1, 1])] + e[1:], g), ''),
    ('all nodes in one place', lambda n, e, g: ([(0, 0, 0)] * len(n), e, g), ''),
    ('flat cells', lambda n, e, g: ([(x, 0.0, 0) for x, y, z in n], e, g), ''),
    ('out of the plane', lambda n, e, g: (moved(n, 4, (0.5, 0.5, 1)), e, g), 'z coordinates run from 0 to 1'),
    ('huge coordinates', lambda n, e, g: (moved(n, 4, (1e308, -1e308, 0)), e, g), ''),
    ('one cell in two groups', lambda n, e, g: (n, e + [(3, 2, e[0][2])], g), 'have the same nodes: is one cell in two bodies?'),
    ('an empty group', lambda n, e, g: (n, [x for x in e if x[1] != 6], g), 'over'),
    ('a body without cells', lambda n, e, g: (n, [x for x in e if x[1] != 2], g), 'body "up" has no cells'),
    ('mixed cells', lambda n, e, g: (n, e + [(2, 1, [1, 2, 4])], g), 'mixes'),
    ('second order', lambda n, e, g: (n, [(10, 1, [1, 3, 9, 7, 2, 6, 8, 4, 5])] + e, g), 'gmsh type 10'),
    ('an unknown type', lambda n, e, g: (n, [(77, 1, [1, 2, 3])] + e, g), 'gmsh type 77'),
    ('a facet of no cell', lambda n, e, g: (n, e + [(1, 5, [1, 9])], g), 'bounds no cell of a body'),
    ('unpaired surfaces', lambda n, e, g: ([(x, y + 5 if k > 8 else y, z) for k, (x, y, z) in enumerate(n)], e, g), 'have no node of under within'),
    ('names twice', lambda n, e, g: (n, e, {**g, 7: (2, 'low')}), None),
    ('no elements', lambda n, e, g: (n, [], g), ''),
    ('no nodes', lambda n, e, g: ([], [], g), ''),
    ('no names', lambda n, e, g: (n, e, {}), 'body "low" has no cells'),
]
TEXTS = [
    ('a count too large', lambda t: t.replace('$Nodes\n18', '$Nodes\n4000000000'), 'speaks of 4000000000 nodes, which it has no room for'),
    ('a negative count', lambda t: t.replace('$Elements\n16', '$Elements\n-1'), 'speaks of -1 elements'),
    ('a count too small', lambda t: t.replace('$Nodes\n18', '$Nodes\n17'), 'names node 18, which the file does not define'),
    ('a node twice', lambda t: t.replace('\n18 1 2', '\n17 1 2'), 'node 17 stands twice'),
    ('a name of dimension 21', lambda t: t.replace('2 1 "low"', '21 1 "low"'), 'a name of a group is "21 1 "low""'),
    ('a name without its quotes', lambda t: t.replace('2 1 "low"', '2 1 "low'), 'a name of a group is'),
    ('letters', lambda t: t.replace('\n5 0.5', '\n5 a.5'), 'is damaged'),
    ('another version', lambda t: t.replace('2.2 0 8', '3 0 8'), "has gmsh's format 3 (0, 8); hyco takes 2.2 and 4.1"),
    ('binary that is text', lambda t: t.replace('2.2 0 8', '2.2 1 8'), ''),
    ('a .geo', lambda t: 'SystemCall "touch ran";\n' + t, 'is no gmsh mesh'),
    ('a .geo behind a mark', lambda t: t.split('$PhysicalNames')[0] + 'SystemCall "touch ran";\n', 'cannot be read'),
    ('cut', lambda t: t[:len(t) // 2], ''),
    ('nothing', lambda t: '', 'is no gmsh mesh'),
]
# replacements in the scene, and what is expected
SCENES = [
    (('young: 1,', 'young: 2*(load,'), 'is no expression'),
    (('young: 1,', 'young: 1/(load-load),'), 'is not finite'),
    (('young: 1,', 'young: sqrt(-1),'), 'is not finite'),
    (('young: 1,', 'young: laod,'), 'names laod, which is unknown; known are x, y, z, load, pi'),
    (('young: 1,', 'young: -1,'), "Young's modulus must be positive"),
    (('young: 1,', 'young: 0,'), "Young's modulus must be positive"),
    (('young: 1,', 'young: "",'), 'is empty; give a number or an expression'),
    (('young: 1, ', ''), 'body low has no young'),
    (('poisson: 0.3', 'poisson: 0.5'), "Poisson's ratio must lie between -1 and 0.5"),
    (('poisson: 0.3', 'poisson: -1'), "Poisson's ratio must lie between -1 and 0.5"),
    (('poisson: 0.3', 'poisson: x/0'), 'is not finite'),
    (('{x: 0, y: 0}', '{x: 0, y: 0, z: 0}'), 'there is no component z'),
    (('{x: 0, y: 0}', '{x: 0, y: 0, w: 0}'), 'a fixed group has: x, y, z'),
    (('floor:', 'flor:'), 'did you mean floor?'),
    (('slave: over', 'slave: oven'), 'did you mean over?'),
    (('slave: over', 'slave: under'), 'the two surfaces must be apart'),
    (('type: pair', 'type: glue'), 'it must be obstacle, pair or surface'),
    (('range: [0.001, 0.1]', 'range: [1, 0]'), 'its range is missing or wrong'),
    (('range: [0.001, 0.1]', 'range: [a, 1]'), 'its range is missing or wrong'),
    (('range: [0.001, 0.1]', 'range: [1]'), 'its range is missing or wrong'),
    (('range: [0.001, 0.1]', 'range: [0, .inf]'), 'its range is missing or wrong'),
    (('parameters: [load]', 'parameters: [x]'), 'cannot name a parameter'),
    (('parameters: [load]', 'parameters: [load, load]'), 'stands twice'),
    (('body:\n', 'bodies:\n'), 'is unknown; an entry stands under scene, parameter, body'),
    (('body:\n', 'log_view: here\nbody:\n'), '"log_view" is unknown'),
    (('young: 1,', '"young ": 1,'), 'unknown'),
    (('scene:\n', 'scene: {\n'), 'is not YAML that hyco reads'),
    (('  floor: {x: 0, y: 0}\n  top: {x: 0, y: -load}\n', '  top: {x: 0, y: -load}\n'), 'keeps body low from'),
    (('  top: {x: 0, y: -load}', '  top: {y: -load}'), 'keeps body up from moving along (1, 0, 0)'),
    (('mesh: two.msh', 'mesh: none.msh'), 'none.msh cannot be opened'),
]


# errors in the cells, facets or contacts of one rank alone, while the others have none: on 2 and 3 ranks
ONE_RANK = [
    (('body:\n', 'force:\n  up: {y: sqrt(x-0.9)}\nbody:\n'), 'is not finite'),
    (('body:\n', 'force:\n  low: {x: 1/(load-load)}\nbody:\n'), 'is not finite'),
    (('body:\n', 'pressure:\n  over: sqrt(x-0.9)\nbody:\n'), 'is not finite'),
    (('body:\n', 'pressure:\n  over: 1/(load-load)\nbody:\n'), 'is not finite'),
    (('body:\n', 'traction:\n  over: {x: sqrt(x-0.9)}\nbody:\n'), 'is not finite'),
    (('young: 1,', 'young: sqrt(0.8-x),'), 'is not finite'),
    (('young: 2,', 'young: sqrt(0.3-x),'), 'is not finite'),
    (('young: 2,', 'young: 0.8-x,'), "Young's modulus must be positive"),
    (('poisson: 0.3', 'poisson: x'), "Poisson's ratio must lie between -1 and 0.5"),
    (('{x: 0, y: -load}', '{x: 0, y: sqrt(0.9-x)}'), 'is not finite'),
    (('master: under}', 'master: under, gap: sqrt(0.9-x)}'), 'is not finite'),
    (('master: under}', 'master: under, normal: {x: 0, y: "x < 0.6 ? -1 : 0"}}'), 'has no length'),
]


class Meshes(Case):
    def setUp(self):
        self.nodes, self.elements = sound()
        msh(self.path('two.msh'), self.nodes, self.elements, NAMES)
        self.write('scene.yaml', SCENE)
        self.count = 0

    def write(self, name, text):
        with open(self.path(name), 'w', encoding='ascii', newline='') as f:
            f.write(text)

    def run_ranks(self, ranks, mesh):
        return self.run_raw('solve', '-scene', 'scene.yaml', '-mu', '0.05', '-report', 'r.json', '-output', 'o.xdmf',
                            *(['-scene_mesh', mesh] if mesh else []), ranks=ranks, timeout=30)

    def one_line(self, run, text):
        said = [line for line in run.stderr.splitlines() if line.strip() and not any(n in line for n in MPI_NOISE)]
        self.assertEqual(run.returncode, 1, run.stderr)
        self.assertEqual(len(said), 1, run.stderr)
        self.assertTrue(said[0].startswith('hyco: error: '), said[0])
        self.assertNotIn('internal error', said[0])
        self.assertIn(text, said[0])

    def refused(self, text, mesh=None):
        """Alone; every other one on two ranks, then three, too: what is found on one rank goes one way to the others."""
        self.count += 1
        for ranks in (0, 2 + self.count // 2 % 2) if self.count % 2 else (0,):
            self.one_line(self.run_ranks(ranks, mesh), text)
        self.assertEqual({f for f in os.listdir(self.folder) if f in ('r.json', 'o.xdmf', 'o.h5') or 'partial' in f}, set(), 'a file is left')

    def test_meshes(self):
        for what, change, text in MESHES:
            with self.subTest(what=what):
                msh(self.path('bad.msh'), *change(self.nodes, self.elements, NAMES))
                if text is None:
                    self.assertEqual(self.run_ranks(0, 'bad.msh').returncode, 0)
                    os.remove(self.path('r.json'))
                    os.remove(self.path('o.xdmf'))
                    os.remove(self.path('o.h5'))
                else:
                    self.refused(text, 'bad.msh')
        ROWS.add(f'broken meshes ({len(MESHES)})', 'one line, status 1, no file left; every other one on 2 or 3 ranks too')

    def test_texts(self):
        with open(self.path('two.msh'), encoding='ascii') as f:
            good = f.read()
        for what, change, text in TEXTS:
            with self.subTest(what=what):
                self.assertNotEqual(change(good), good)
                self.write('bad.msh', change(good))
                self.refused(text, 'bad.msh')
        ROWS.add(f'broken mesh files ({len(TEXTS)})', 'one line, status 1, no file left; every other one on 2 or 3 ranks too')

    def test_scenes(self):
        for (old, new), text in SCENES:
            with self.subTest(new=new):
                self.assertIn(old, SCENE)
                self.write('scene.yaml', SCENE.replace(old, new, 1))
                self.refused(text)
        ROWS.add(f'broken scenes ({len(SCENES)})', 'one line, status 1, no file left; every other one on 2 or 3 ranks too')

    def test_one_rank_only(self):
        with ThreadPoolExecutor(4) as pool:  # starting ranks is mostly waiting
            runs = []
            for k, ((old, new), text) in enumerate(ONE_RANK):
                self.write(f'one{k}.yaml', SCENE.replace(old, new, 1))
                for ranks in (2, 3):
                    runs.append((new, ranks, text, pool.submit(self.run_raw, 'solve', '-scene', f'one{k}.yaml', '-mu', '0.05',
                                                               ranks=ranks, timeout=60)))
            for new, ranks, text, run in runs:
                with self.subTest(new=new, ranks=ranks):
                    self.one_line(run.result(), text)
        ROWS.add(f'errors in the cells, facets or contacts of one rank alone ({len(ONE_RANK)}), on 2 and 3 ranks', 'one line, status 1, no rank left waiting')

    def test_same_in_every_format(self):
        """2.2 and 4.1, text and binary, lines that end as on Windows, a scene that does: the same answer."""
        expected = self.hyco('solve', '-scene', 'scene.yaml', '-mu', '0.05')
        self.solved(expected)
        for kind in ('msh22', 'msh41'):
            for binary in ([], ['-bin']):
                subprocess.run(['gmsh', '-save', '-format', kind, *binary, self.path('two.msh'), '-o', self.path('b.msh'), '-v', '1'],
                               check=True, timeout=30)
                forms = ['b.msh']
                if not binary:
                    with open(self.path('b.msh'), encoding='ascii', newline='') as f:
                        self.write('crlf.msh', f.read().replace('\n', '\r\n'))
                    forms.append('crlf.msh')
                for form in forms:
                    with self.subTest(kind=kind, binary=binary, form=form):
                        report = self.hyco('solve', '-scene', 'scene.yaml', '-mu', '0.05', '-scene_mesh', form)
                        self.near(report['total_contact_force'], expected['total_contact_force'], 1e-12)
        self.write('scene.yaml', SCENE.replace('\n', '\r\n'))
        report = self.hyco('solve', '-scene', 'scene.yaml', '-mu', '0.05')
        self.near(report['total_contact_force'], expected['total_contact_force'], 1e-12)

    def test_duplicate_nodes(self):
        """Two cells of a body that meet in two nodes at one place are two pieces: held by nothing, and said so."""
        nodes = self.nodes + [self.nodes[k] for k in (6, 7, 8)]  # the upper cells of the lower body, nodes 4 to 6 of its own
        twin = {4: 19, 5: 20, 6: 21}
        nodes[18:21] = [self.nodes[k - 1] for k in (4, 5, 6)]
        elements = [(kind, tag, [twin.get(k, k) for k in of] if index in (2, 3) else of)
                    for index, (kind, tag, of) in enumerate(self.elements)]
        msh(self.path('bad.msh'), nodes, elements, NAMES)
        self.refused('keeps body low from', 'bad.msh')


if __name__ == '__main__':
    unittest.main()
