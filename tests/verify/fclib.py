"""Problems of contacts with friction as files of FCLIB (-hyco_write_fclib): read by a program that knows the published layout alone, and solved
there by block Gauss-Seidel and by semismooth Newton's method, each to 1e-8 of FCLIB's natural map, as is the stored solution. Also with contacts
without friction, with a body that friction holds (free unknowns), in 2D and on several ranks; and refusals.
"""
import os
import subprocess
import unittest

import h5py
import numpy as np

from common import HYCO, PATIENCE
from grids import Grid
from verify import Verify

PROGRAM = os.path.join(os.path.dirname(HYCO), 'tests', 'test_fclib')
NAMES = ('contacts', 'components', 'free', 'from_guess', 'from_zero', 'newton', 'sweeps', 'gauss_seidel', 'stored', 'difference')
PAD = """
scene: {title: pad that slips in part, mesh: mesh.msh}
body: {pad: {young: 1000, poisson: 0.3}}
fixed: {top: {x: "0.001*s", y: "-0.002*min(t, 1)*(1 + 0.4*x)"}}
contact: {floor: {type: obstacle, group: base, normal: {y: -1}, gap: "0.0004*x", friction: 0.3}}
history: {times: [0, 1, 1.5, 2, 3], tables: {s: [[1, 0], [2, 1], [3, -1]]}}
"""
CUBES = """
scene: {title: blocks that slip in part, mesh: mesh.msh}
body: {low: {young: 1000, poisson: 0.3}, high: {young: 700, poisson: 0.2}}
fixed: {base: {x: 0, y: 0, z: 0}, top: {x: "0.0006*s*(1 + 0.5*y)", y: "0.0004*s", z: "-0.001*min(t, 1)*(1 + 0.3*x)"}}
contact: {joint: {type: surface, slave: face, master: back, gap: "0.0005*(x - 0.5)^2", friction: "0.2 + 0.1*y"}}
history: {times: [0, 1, 1.5, 2, 3], tables: {s: [[1, 0], [2, 1], [3, -1]]}}
"""
SLOPE = """
scene: {title: block that friction holds, mesh: mesh.msh}
body: {pad: {young: 1000, poisson: 0.3}}
force: {pad: {x: "0.02*min(t, 2)", y: -0.2}}
contact: {floor: {type: obstacle, group: base, normal: {y: -1}, gap: 0, friction: 0.3}}
history: {times: [0, 1, 2, 3]}
"""


def pad(n):
    grid = Grid()
    grid.box('quad4', [np.linspace(0, 2, n + 1), np.linspace(0, 1, max(n // 4, 2) + 1)], lambda x: x, 'pad', {'y0': 'base', 'y1': 'top'})
    return grid


def cubes(n):
    grid, rough = Grid(), max(n - 1, 2)
    grid.box('hex8', [np.linspace(0, 1, rough + 1)] * 2 + [np.linspace(0, 0.5, 4)], lambda x: x, 'low', {'z0': 'base', 'z1': 'back'})
    grid.box('hex8', [np.linspace(0, 1, n + 1)] * 2 + [np.linspace(0.5, 1, 4)], lambda x: x, 'high', {'z0': 'face', 'z1': 'top'})
    return grid


class Fclib(Verify):
    name = 'fclib'

    def problem(self, text, grid, *args, **options):
        """The numbers of the program for the problem that the scene writes."""
        file = self.path('problem.h5')
        self.hyco('solve', '-scene', self.scene(text, grid), '-hyco_write_fclib', file, *args, **options)
        run = subprocess.run([PROGRAM, file], capture_output=True, text=True, timeout=600 * PATIENCE, check=False)
        self.assertEqual(run.returncode, 0, run.stderr)
        return dict(zip(NAMES, (float(x) for x in run.stdout.split())))

    def judge(self, title, found):
        self.row(f'{title}: the stored solution', found['stored'], 0, 1e-8)
        if not found['free']:  # with free unknowns one start of Newton's method need not end at a solution
            self.row(f'{title}: semismooth Newton', found['newton'], 0, 1e-8)
            self.assertGreater(found['sweeps'], 0)
            self.row(f'{title}: Gauss-Seidel', found['gauss_seidel'], 0, 1e-8)
            self.row(f'{title}: forces of Gauss-Seidel', found['difference'], 0, 1e-5)

    def test_plane(self):
        """2D; the guess is the solution of the step before, and the file that of the named time, on one rank and on three."""
        found = self.problem(PAD, pad(16))
        self.assertEqual([found[name] for name in NAMES[:3]], [17, 2, 0])
        self.judge('pad', found)
        with h5py.File(self.path('problem.h5')) as f:
            guess, last, q = f['guesses/1/r'][:], f['solution/r'][:], f['fclib_local/vectors/q'][:]
            self.assertTrue((f['fclib_local/vectors/mu'][:] == 0.3).all())
            self.assertEqual((f['fclib_local/spacedim'][()], f['fclib_local/W/nz'][()]), (2, -1))
        slips = abs(abs(last[1::2]) - 0.3 * last[::2]) < 1e-9 * last.max()
        self.assertTrue(0 < (slips & (last[::2] > 0)).sum() < (last[::2] > 0).sum())
        for ranks in (1, 3):
            self.judge(f'pad, an earlier time, {ranks} ranks', self.problem(PAD, pad(16), '-hyco_write_fclib_time', '2', ranks=ranks))
            with h5py.File(self.path('problem.h5')) as f:
                order = np.argsort(f['solution/r'][::2]), np.argsort(guess[::2])
                self.assertLess(abs(f['solution/r'][::2][order[0]] - guess[::2][order[1]]).max(), 1e-9 * guess.max())
                self.assertGreater(abs(f['fclib_local/vectors/q'][:] - q).max(), 0)

    def test_space(self):
        """3D, between bodies, with a coefficient that changes in space."""
        found = self.problem(CUBES, cubes(4))
        self.assertEqual([found[name] for name in NAMES[:3]], [25, 3, 0])
        self.judge('blocks', found)

    def test_mixed(self):
        """Contacts without friction have tangents without flexibility and the coefficient 0."""
        grid = cubes(3)
        text = CUBES.replace('contact: {', 'contact: {roof: {type: obstacle, group: top, normal: {z: 1}, gap: 0.1}, wall: {type: obstacle, group: side, '
                             'normal: {x: 1}, gap: -0.0001}, ')
        grid.box('hex8', [np.linspace(2, 2.4, 3), np.linspace(0, 1, 3), np.linspace(0, 0.5, 3)], lambda x: x, 'stop', {'x1': 'side', 'x0': 'held'})
        found = self.problem(text.replace('high: {young: 700', 'stop: {young: 500}, high: {young: 700').replace('fixed: {', 'fixed: {held: {x: 0, y: 0, z: 0}, '), grid)
        self.judge('some without friction', found)
        with h5py.File(self.path('problem.h5')) as f:
            mu, r = f['fclib_local/vectors/mu'][:], f['solution/r'][:].reshape(-1, 3)
        self.assertTrue((mu == 0).any() and (mu > 0.19).any() and (r[mu == 0, 0] > 0).any())
        self.assertFalse(r[mu == 0, 1:].any())

    def test_floating(self):
        """A body that friction holds: its rigid motions are the free unknowns l, with V and R."""
        found = self.problem(SLOPE, pad(8))
        self.assertEqual(found['free'], 3)
        self.judge('held by friction', found)

    def test_refusals(self):
        """One line each: no friction, or none above 0; a time that is not listed; no file; a model in its place."""
        plain, none = PAD.replace(', friction: 0.3', ''), PAD.replace('friction: 0.3', 'friction: "0.3*max(2 - t, 0)"')
        out = '-hyco_write_fclib', self.path('out.h5')
        for word, text, args in (('this scene has none', plain, out), ('no coefficient of friction', none, out),
                                 ('not one of', PAD, (*out, '-hyco_write_fclib_time', '2.5')), ('needs a file', PAD, ('-hyco_write_fclib_time', '2'))):
            run = self.run_raw('solve', '-scene', self.scene(text, pad(4)), *args)
            self.assertNotEqual(run.returncode, 0)
            self.assertIn(word, run.stderr)
            self.assertFalse(os.path.exists(self.path('out.h5')))


if __name__ == '__main__':
    unittest.main()
