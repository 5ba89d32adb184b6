"""Common code of the tests of extremes: two stacked blocks of any cell type, a scene written from a dictionary, the models
of one scene, and rows of tables.

A row is written to extremes/TEST.csv under the folder where the test runs; table.py makes docs/limits/extremes.csv
from them."""
import csv
import json
import os
import sys

import h5py
import numpy as np

sys.path.insert(0, os.path.join(os.environ['HYCO_SOURCE'], 'tests', 'verify'))
from common import Case  # noqa: E402
from grids import Grid  # noqa: E402

FOLDER = 'extremes'
HEAD = ('case', 'what', 'found', 'bound', 'verdict')
DIM = {'line2': 1, 'tri3': 2, 'quad4': 2, 'tet4': 3, 'hex8': 3}
ERRORS = ('error_u', 'error_lambda')
BODIES = ('-hyco_model_type', 'bodies')


class Extreme(Case):
    """`name` is the test's table."""
    name = ''

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        os.makedirs(FOLDER, exist_ok=True)
        cls.table = os.path.abspath(os.path.join(FOLDER, cls.name + '.csv'))
        if cls.name not in Extreme.begun:
            Extreme.begun.add(cls.name)
            cls.begin()

    @classmethod
    def begin(cls):
        """An empty table."""
        with open(cls.table, 'w', encoding='utf-8', newline='') as f:
            csv.writer(f).writerow(HEAD)

    begun, written = set(), 0

    def say(self, case, what, found, bound='', verdict='ok'):
        with open(self.table, 'a', encoding='utf-8', newline='') as f:
            csv.writer(f).writerow((case, what, found, bound, verdict))

    def row(self, case, what, found, bound, least=False):
        """A number and its upper bound (least: its lower bound)."""
        holds = bool(found >= bound if least else found <= bound)  # false for a NaN
        self.say(case, what, f'{found:.2g}', f'{"at least" if least else "at most"} {bound:g}', 'ok' if holds else 'OUT')
        with self.subTest(case=case, what=what):
            self.assertTrue(holds, f'{case}, {what}: {found!r}, bound {bound!r}')

    def refused(self, case, *args, says):
        """One line that contains `says`, and an exit status that is not 0."""
        run = self.run_raw(*args)
        lines = [line for line in run.stderr.splitlines() if line and not line.startswith(('snapshots: ', 'points: '))]
        self.assertNotEqual(run.returncode, 0, f'{case}: not refused')
        self.assertEqual(len(lines), 1, run.stderr)
        self.assertIn(says, lines[0])
        self.say(case, 'refused', lines[0].removeprefix('hyco: '))

    def scene(self, grid, scene):
        """Writes the mesh and scene.yaml (JSON is YAML); the scene's folder."""
        type(self).written += 1
        grid.write(self.path('mesh.msh'))
        scene['scene']['mesh'] = 'mesh.msh'
        with open(self.path('scene.yaml'), 'w', encoding='utf-8') as f:
            json.dump(scene, f)
        return self.folder

    def fields(self, scene, *args):
        """The report of a solve, which must satisfy its KKT conditions, the displacements and the contact forces."""
        report = self.hyco('solve', '-scene', scene, '-output', self.path('out.xdmf'), *args)
        self.solved(report)
        with h5py.File(self.path('out.h5')) as f:
            lam = f['contact/lambda'][:, 0] if 'contact' in f else np.zeros(0)
            return report, f['nodes/displacement'][:], lam

    def train(self, scene, *args, model='m.h5', **options):
        """(Solutions are stored by scene.)"""
        return self.hyco('train', '-scene', scene, '-model', model, '-hyco_snapshots', self.path(f's{self.written}'),
                         *args, **options)

    def compare(self, scene, *args, model='m.h5'):
        """Relative errors against full order at the points, all of which must converge."""
        c = self.hyco('compare', '-scene', scene, '-model', model, *args)
        self.assertEqual(c['not_converged'], 0)
        self.assertLessEqual(c['kkt_max'], 1e-8)
        return c

    def worst(self, c):
        return max(c[e]['max'] or 0 for e in ERRORS if e in c)

    def models(self, case, scene, train, seen, unseen, bound=1e-8, bodies=None):
        """Full order by its KKT residuals and energies; the hybrid model with all displacements full order on the whole
        mesh, which must agree with full order; the projection onto the solutions and their forces, which must reproduce a
        training point; the model of bodies, whose forces are exact if all parameters are loads and gaps (bodies: its bound, if
        it differs)."""
        report = self.fields(scene, '-mu', ','.join(unseen[1::2]))[0]
        self.row(case, 'full order: worst KKT residual', max(report['kkt'].values()), 1e-8)
        common = (*train, '-hyco_pod_tol', '0', '-hyco_pod_noise', '1e-15')
        for name, options, points_ in (
                ('hybrid, whole domain', ('-hyco_rid_whole', 'true', '-hyco_hybrid', 'all'), unseen),
                ('projection, at a training point', ('-hyco_model_type', 'projection', '-hyco_dual', 'snapshots'), seen)):
            self.train(scene, *common, *options)
            self.row(case, f'{name}: error', self.worst(self.compare(scene, *points_)), bound)
        self.row(case, 'bodies: error of the forces', self.bodies(scene, train, unseen), bodies or bound)
        return report

    def bodies(self, scene, train, points_):
        """The largest error of the forces of a model of bodies at points."""
        self.train(scene, *train, *BODIES)
        return self.compare(scene, *points_)['error_lambda']['max'] or 0


def blocks(kind='quad4', n=(4, 4), length=1, stress=1, young=(100, 40), poisson=(0.3, 0.2), contact='pair', gap='gap',
           press=(0.04, 0.08), gaps=(0, 0.02), crown=0, aspect=1, jitter=None, element=None):
    """Block a, [0, 1]^dim, under b, 1.5 high, pressed down by `press`, everything times length and stress; the gap
    grows by crown (x / width)^2; n: cells across in a and b; aspect: width over height. jitter: moves inner nodes."""
    dim = DIM[kind]
    up, wide = 'xyz'[dim - 1], length * aspect
    grid = Grid()
    for body, low, high, across in (('a', 0, 1, n[0]), ('b', 1, 2.5, n[1])):
        axes = [np.linspace(0, 1, across + 1)] * (dim - 1) + [np.linspace(low, high, max(2, across - 1) + 1)]

        def bend(x, body=body, low=low, high=high):
            x = x.copy()
            inner = ((x[:, :dim - 1] > 1e-9) & (x[:, :dim - 1] < 1 - 1e-9)).all(axis=1)
            inner &= (x[:, -1] > low + 1e-9) & (x[:, -1] < high - 1e-9)
            if jitter is not None:
                x[inner] += jitter.uniform(-0.15, 0.15, (inner.sum(), dim)) / across
            return x * np.array([wide] * (dim - 1) + [length])

        grid.box(kind, axes, bend, body, {f'{"xyz"[d]}{e}': f'{body}_{"xyz"[d]}{e}' for d in range(dim) for e in '01'})
    shift = {c: 0 for c in 'xyz'[:dim - 1]}
    gap += f' + {float(crown * length)!r}*(' + ' + '.join(f'({c}/{float(wide)!r})^2' for c in shift) + ')' if crown else ''
    scene = {
        'scene': {'parameters': ['press', 'gap']},
        'parameter': {'press': {'range': [press[0] * length, press[1] * length]},
                      'gap': {'range': [gaps[0] * length, gaps[1] * length]}},
        'body': {b: {'young': young[k] * stress, 'poisson': poisson[k], **({'element': element} if element else {})}
                 for k, b in enumerate('ab')},
        'fixed': {f'a_{up}0': {up: 0}, f'b_{up}1': {up: '-press'},
                  **{f'{b}_{c}0': {c: 0} for b in 'ab' for c in shift}},
        'contact': {'seam': {'type': contact, 'slave': f'b_{up}0', 'master': f'a_{up}1', 'gap': gap,
                             'tolerance': 0.2 * length, 'normal': {**shift, up: -1}}}}
    return grid, scene


def points(press, gap, length=1):
    return ('-values_press', ','.join(repr(float(v * length)) for v in press), '-values_gap',  # (NumPy 2's repr is no number)
            ','.join(repr(float(v * length)) for v in gap))


TRAIN, SEEN, UNSEEN = points((0.04, 0.06, 0.08), (0, 0.02)), points((0.06,), (0.02,)), points((0.05,), (0.01,))
