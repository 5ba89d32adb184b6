"""Runs the hyco command in a temporary folder and reads its output."""
import json
import os
import re
import shutil
import subprocess
import tempfile
import unittest

HYCO = os.environ['HYCO']
SOURCE = os.environ['HYCO_SOURCE']
MPIEXEC = os.environ.get('MPIEXEC', 'mpiexec')
MPIRUN = [MPIEXEC, *os.environ.get('MPIEXEC_FLAGS', '--oversubscribe').split(), '-n']  # and the number of ranks
ROPE = os.path.join(SOURCE, 'examples', 'rope')
PELLET = os.path.join(SOURCE, 'examples', 'pellet')
SANITIZED = os.environ.get('HYCO_SANITIZE') == '1'
PATIENCE = int(os.environ.get('HYCO_PATIENCE', '15'))  # factor of a run's limit of time: tests/CMakeLists.txt


def library_path(*folders):
    """Library path for programs that a test builds: these folders, and those of the .pc files of a PETSc of one's own."""
    own = [os.path.dirname(p.rstrip('/')) for p in os.environ.get('PKG_CONFIG_PATH', '').split(':') if p]
    return ':'.join([*folders, *own, *filter(None, [os.environ.get('LD_LIBRARY_PATH')])])


def said(run):
    """The lines of hyco or PETSc on stderr, without progress; launchers add lines of their own, which differ between versions."""
    return [line for line in run.stderr.splitlines() if line.startswith('hyco: ') or 'PETSC ERROR' in line]


def alike(a, b, relative=1e-6, floor=1e-12):
    """Whether two runs have the same result: equal but for round-off. Numbers, also in texts, differ by less than `relative` of their size, or by
    `floor`: residuals and errors that are round-off themselves have no digit in common. Lists and dictionaries by entry."""
    if isinstance(a, dict):
        return isinstance(b, dict) and a.keys() == b.keys() and all(alike(a[k], b[k], relative, floor) for k in a)
    if isinstance(a, (list, tuple)):
        return isinstance(b, (list, tuple)) and len(a) == len(b) and all(alike(x, y, relative, floor) for x, y in zip(a, b))
    try:
        x, y = float(a), float(b)
    except (TypeError, ValueError):
        return a == b
    return x == y or (x != x and y != y) or abs(x - y) <= relative * max(abs(x), abs(y)) + floor


def settled(args):
    """The arguments; for a training without search and without held-out solutions: the settings are the test's, those of the paper for its
    scenes, or the defaults."""
    args = [str(a) for a in args]
    if not args or args[0] != 'train':
        return args
    args = [os.path.join(b, 'paper.yaml') if a == '-scene' and b in (ROPE, PELLET) else b for a, b in zip(('', *args), args)]
    return ['train', '-hyco_search', 'false', '-hyco_validation', '0', *args[1:]]


class Case(unittest.TestCase):
    """A test with its own folder for all files that hyco writes."""
    newcomer = False  # True: train searches its settings and judges its model, as it does for a user

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix='hyco-test-')

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder, ignore_errors=True)

    @classmethod
    def path(cls, *names):
        return os.path.join(cls.folder, *names)

    @classmethod
    def written(cls, text, mesh=None):
        """The folder, with the scene and its mesh.msh (a Grid, or the arguments of msh() after the path)."""
        if hasattr(mesh, 'write'):
            mesh.write(cls.path('mesh.msh'))
        elif mesh:
            msh(cls.path('mesh.msh'), *mesh)
        with open(cls.path('scene.yaml'), 'w', encoding='utf-8') as f:
            f.write(text)
        return cls.folder

    @classmethod
    def changed(cls, name, text, changes):
        """The path of a file with the text, in which each (old, new) of the changes is replaced; every old one must be there."""
        for old, new in changes:
            assert old in text, old
            text = text.replace(old, new)
        with open(cls.path(name), 'w', encoding='utf-8') as f:
            f.write(text)
        return cls.path(name)

    @classmethod
    def run_raw(cls, *args, ranks=0, cwd=None, timeout=100):
        """The finished process; ranks 0: without mpiexec."""
        if not cls.newcomer:
            args = settled(args)
        command = [HYCO, *(str(a) for a in args)]
        if ranks:
            command = [*MPIRUN, str(ranks), *command]
        run = subprocess.run(command, cwd=cwd or cls.folder, timeout=timeout * PATIENCE, capture_output=True, text=True)
        if SANITIZED and ': runtime error: ' in run.stderr:
            raise AssertionError(run.stderr)
        return run

    @classmethod
    def hyco(cls, *args, status=0, **options):
        """The JSON report of a run that must end with `status`: 0, or 3 if it writes a model that misses its targets; None: either."""
        report = cls.path('report.json')
        if os.path.exists(report):
            os.remove(report)
        run = cls.run_raw(*args, '-report', report, **options)
        if run.returncode != status and not (status is None and run.returncode in (0, 3)):
            raise AssertionError(f'hyco {" ".join(str(a) for a in args)} ended with {run.returncode}:\n{run.stderr}')
        with open(report, encoding='utf-8') as file:
            return json.load(file)

    @classmethod
    def rope_mesh(cls, name, nodes):
        """The rope's mesh of so many nodes, in the test's folder."""
        subprocess.run(['gmsh', '-1', os.path.join(ROPE, 'rope.geo'), '-setnumber', 'n', str(nodes), '-format', 'msh41', '-bin', '1',
                        '-v', '1', '-o', cls.path(name)], check=True, timeout=60 * PATIENCE, stdout=subprocess.DEVNULL)

    @classmethod
    def drawn(cls, name, dim, geo, scene, *more):
        """The folder `name` with a scene and the mesh NAME.msh that gmsh makes of its drawing."""
        os.makedirs(cls.path(name), exist_ok=True)
        for file, text in ((name + '.geo', geo), ('scene.yaml', scene)):
            with open(cls.path(name, file), 'w', encoding='ascii') as f:
                f.write(text)
        subprocess.run(['gmsh', f'-{dim}', f'{name}.geo', *more, '-format', 'msh41', '-v', '1', '-o', f'{name}.msh'], cwd=cls.path(name), check=True,
                       timeout=60 * PATIENCE, stdout=subprocess.DEVNULL)

    def near(self, found, expected, relative, what=''):
        self.assertLessEqual(abs(found - expected), relative * abs(expected), f'{what}: {found!r} for {expected!r}')

    def alike(self, found, expected, what=''):
        self.assertTrue(alike(found, expected), f'{what}: {found} for {expected}')

    def solved(self, report, tolerance=1e-8, energy=1e-8):
        """Checks the Karush-Kuhn-Tucker residuals that the run recomputed; for full order also the energy identity."""
        self.assertTrue(report['converged'])
        for name, value in report['kkt'].items():
            self.assertLess(value, tolerance, f'KKT residual {name}')
        if report['command'] == 'solve':
            # rounding of u affects the energies as it does the residual
            self.assertLess(report['energy_defect'], max(energy, report['rounding']), 'energy identity')


def msh(path, nodes, elements, names, binary=False):
    """Writes a gmsh 2.2 file: nodes [(x, y, z)], elements [(gmsh type, group, [nodes from 1])], names {group: (dim, name)}."""
    assert not binary
    with open(path, 'w', encoding='ascii') as f:
        f.write('$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n%d\n' % len(names))
        for tag, (dim, name) in names.items():
            f.write(f'{dim} {tag} "{name}"\n')
        f.write('$EndPhysicalNames\n$Nodes\n%d\n' % len(nodes))
        for i, x in enumerate(nodes):
            f.write('%d %.17g %.17g %.17g\n' % (i + 1, *x))
        f.write('$EndNodes\n$Elements\n%d\n' % len(elements))
        for i, (kind, tag, nodes_of) in enumerate(elements):
            f.write(f'{i + 1} {kind} 2 {tag} {tag} {" ".join(str(n) for n in nodes_of)}\n')
        f.write('$EndElements\n')


def square(n, title='block', move=lambda i, j: (i, j)):
    """The unit square of n x n cells, their nodes moved by `move` in units of a cell, for msh(): body and sides low, high, left, right."""
    nodes = [(*(c / n for c in move(i, j)), 0) for j in range(n + 1) for i in range(n + 1)]
    at = lambda i, j: j * (n + 1) + i + 1
    elements = [(3, 1, (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1))) for j in range(n) for i in range(n)]
    for k in range(n):
        elements += [(1, 2, (at(k, 0), at(k + 1, 0))), (1, 3, (at(k, n), at(k + 1, n)))]
        elements += [(1, 4, (at(0, k), at(0, k + 1))), (1, 5, (at(n, k), at(n, k + 1)))]
    return nodes, elements, {1: (2, title), 2: (1, 'low'), 3: (1, 'high'), 4: (1, 'left'), 5: (1, 'right')}


class Program(Case):
    """A program of examples/ladder: its name, the scene with placeholders, its output."""
    name = scene_text = out = ''

    def scene(self, *parts):
        """The path of scene.yaml with these parts in its placeholders."""
        path = self.path('scene.yaml')
        with open(path, 'w', encoding='ascii') as file:
            file.write(self.scene_text % parts)
        return path

    def run_program(self, *args, name=None, ranks=0):
        """The finished process; ranks 0: without mpiexec."""
        command = [*MPIRUN, str(ranks)] * bool(ranks) + [os.path.join(os.path.dirname(HYCO), 'ladder', name or self.name), *map(str, args)]
        return subprocess.run(command, cwd=self.folder, capture_output=True, text=True, timeout=100 * PATIENCE, check=False)

    def solve(self, *args, **options):
        """The numbers of `out` in the program's output."""
        run = self.run_program(*args, **options)
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        found = re.search(self.out, run.stdout)
        self.assertTrue(found, run.stdout)
        return [float(x) if re.fullmatch(r'[-+.\de]+', x) else x for x in found.groups()]

    def refused(self, words, *args, **options):
        """A run that fails, with these words in its message."""
        run = self.run_program(*args, **options)
        self.assertNotEqual(run.returncode, 0)
        for word in words:
            self.assertIn(word, run.stdout + run.stderr)
