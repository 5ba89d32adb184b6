"""Random scenes with friction: boxes in 2D and 3D, one above another on a floor, pressed, pushed back and forth, and partly held by contact
alone. Each must be solved or refused by name; then equilibrium is that of the report, and the cone, complementarity and the direction of slip
are computed again here from the fields, to 1e-8; the work of friction never falls.

    friction_random.py SEED COUNT     # so many scenes, from this seed on; without arguments a short run
"""
import csv
import os
import sys
import unittest

import h5py
import numpy as np

from common import SOURCE, Case, msh

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import Grid  # noqa: E402

CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
FLOATING = """
scene: {mesh: mesh.msh}
body: {low: {young: 1000, poisson: 0.3}, high: {young: 3000, poisson: 0.3}}
fixed: {base: {x: 0, z: 0}, sym: {y: 0}}
%s
traction: {press: {x: "s*(1 + 0.2*x)", z: "-3*min(t,1)*(1 - 0.3*x)"}}
contact: {c: {type: mortar, slave: under, master: top, friction: 0.3}}
history: {times: [0, 0.5, 1, 2, 3, 4], tables: {s: [[1, 0], [2, 0.6], [3, -0.6], [4, 0.6]]}}
output: {N: {force: z, contact: c}, T: {friction: x, contact: c}, W: {friction: work}}
"""


def boxes(path, dim, shapes, sizes, heights):
    """Boxes with nodes of their own, one above another: groups boxK, lowK, highK, and of the last `top`."""
    nodes, elements, names = [], [], {}
    for k, (shape, size) in enumerate(zip(shapes, sizes)):
        axes = [np.linspace(-s / 2, s / 2, n + 1) for s, n in zip(size[:-1], shape[:-1])]
        axes.append(heights[k] + np.linspace(0, size[-1], shape[-1] + 1))
        place = np.stack(np.meshgrid(*axes, indexing='ij'), -1).reshape(-1, dim)
        number = len(nodes) + 1 + np.arange(len(place)).reshape([n + 1 for n in shape])
        nodes += [tuple(x) + (0,) * (3 - dim) for x in place]
        for j, (group, d) in enumerate(((f'box{k}', dim), (f'low{k}', dim - 1), (f'high{k}', dim - 1))):
            names[3 * k + j + 1] = (d, group)
        corner = lambda at, cell: [int(at[tuple(c + r for c, r in zip(cell, o))]) for o in CORNERS[:2**len(cell)]]
        flat = {1: lambda at, cell: [int(at[cell[0]]), int(at[cell[0] + 1])]}.get(dim - 1, corner)
        for cell in np.ndindex(*shape):
            elements.append((3 if dim == 2 else 5, 3 * k + 1, corner(number, cell)))
        for j, face in ((1, number[..., 0]), (2, number[..., -1])):
            for cell in np.ndindex(*shape[:-1]):
                elements.append((1 if dim == 2 else 3, 3 * k + 1 + j, flat(face, cell)))
    msh(path, nodes, elements, names)


def draw(seed, path):
    """The scene of a seed, its mesh written to `path`; and the coefficients by contact's slave group."""
    rng = np.random.default_rng(seed)
    dim, n = (2, rng.integers(1, 4)) if rng.random() < 0.65 else (3, rng.integers(1, 3))
    most = 7 if dim == 2 else 4
    shapes = [[int(rng.integers(2, most)) for _ in range(dim - 1)] + [int(rng.integers(1, 4))] for _ in range(n)]
    sizes = [[1.] * (dim - 1) + [float(rng.uniform(0.3, 0.8))] for _ in range(n)]
    for k in range(1, n):  # each box within the one below
        sizes[k][:-1] = [s * float(rng.uniform(0.6, 0.98)) for s in sizes[k - 1][:-1]]
    heights = np.concatenate([[0], np.cumsum([s[-1] for s in sizes])])
    boxes(path, dim, shapes, sizes, heights)
    up, along = ('y', 'x') if dim == 2 else ('z', 'x')
    mu = {f'low{k}': float(rng.choice([0.1, 0.3, 0.6, 1.0, 1.4]) * rng.uniform(0.8, 1.2)) for k in range(n)}
    gap = f'{rng.uniform(0, 0.003):.3g}*(x - {rng.uniform(-0.4, 0.4):.3g})^2'
    text = ['scene: {title: random, mesh: mesh.msh}', 'body:']
    text += [f'  box{k}: {{young: {10**rng.uniform(2.5, 4):.4g}, poisson: {rng.uniform(0, 0.42):.3g}}}' for k in range(n)]
    text.append('force: {' + ', '.join(f'box{k}: {{{up}: "-0.01*t"}}' for k in range(n)) + '}')
    text += ['contact:', f'  c0: {{type: obstacle, group: low0, normal: {{{up}: -1}}, gap: "{gap}", friction: "{mu["low0"]:.17g}"}}']
    for k in range(1, n):
        text.append(f'  c{k}: {{type: surface, slave: low{k}, master: high{k - 1}, friction: "{mu[f"low{k}"]:.17g}"}}')
    times = list(range(int(rng.integers(3, 7))))
    table = lambda first, size: '[' + ', '.join(f'[{t}, {0 if t < first else rng.normal() * size:.6g}]' for t in times) + ']'
    top = f'high{n - 1}'
    text.append('history:')
    text.append(f'  times: {times}')
    text.append(f'  tables: {{s: {table(1, 1)}, r: {table(1, 1)}, v: {table(1, 0.5)}}}')
    if rng.random() < 0.5:  # displacements of the top
        more = '' if dim == 2 else ', y: "0.004*r"'
        text.append(f'fixed: {{{top}: {{{along}: "0.004*s"{more}, {up}: "-0.006*min(t,1) - 0.001*v"}}}}')
    else:  # forces on the top: contact alone holds the bodies
        more = '' if dim == 2 else ', y: "0.5*r"'
        text.append(f'traction: {{{top}: {{{along}: "0.5*s"{more}, {up}: "-2*min(t,1) - 0.3*v"}}}}')
    return '\n'.join(text) + '\n', mu, dim


class Random(Case):
    seed, count = 1, 6

    def law(self, path, mu, dim, where):
        """The law of each contact at each listed time: a slave with one contact, an area and no substep."""
        with h5py.File(path) as f:
            number = len(f['t'])
            xyz, before = f['mesh/xyz'][:], 0
            steps = [f[f'step-{k:04d}/nodes'] for k in range(number)]
            slaves = np.isfinite(steps[0]['gap'][:, 0])
            level = np.round(xyz[slaves, dim - 1], 9)
            coefficient = np.array(list(mu.values()))[np.searchsorted(np.unique(level), level)]
            size = max(abs(s['displacement'][:]).max() for s in steps) or 1
            for k, s in enumerate(steps):
                p, gap = s['contact_pressure'][slaves, 0], s['gap'][slaves, 0]
                t, slip = s['contact_traction'][slaves], s['contact_slip'][slaves]
                large = max(p.max(initial=0), 1e-300)
                length, moved = np.linalg.norm(t, axis=1), slip - before
                self.assertGreaterEqual(gap.min(), -1e-8 * size, where)
                self.assertLessEqual((p * abs(gap)).max() / large, 1e-8 * size, where)
                self.assertLessEqual((length - coefficient * p).max(), 1e-8 * large, where)
                sticks = length < coefficient * p - 1e-7 * large
                self.assertLessEqual(np.linalg.norm(moved[sticks], axis=1).max(initial=0), 1e-8 * size, where)
                power = -(t * moved).sum(axis=1)
                self.assertGreaterEqual(power.min(), -1e-8 * size * large, where)
                self.assertLessEqual(abs(power - length * np.linalg.norm(moved, axis=1)).max(), 1e-8 * size * large, where)
                before = slip

    def one(self, seed):
        """True: solved; False: refused by name."""
        text, mu, dim = draw(seed, self.path('mesh.msh'))
        with open(self.path('scene.yaml'), 'w', encoding='ascii') as file:
            file.write(text)
        run = self.run_raw('solve', '-scene', self.path('scene.yaml'), '-table', self.path('t.csv'), '-output', self.path('out.xdmf'))
        where = f'seed {seed}: {run.stderr[-300:]}'
        if run.returncode:
            self.assertEqual(run.returncode, 1, where)
            print(f'seed {seed}: {run.stderr.strip()[:160]}')
            self.assertRegex(run.stderr, 'hyco: error: .*(no support|held by contact|ends at t|no solution|penetrates)', where)
            return False
        with open(self.path('t.csv'), encoding='ascii', newline='') as file:
            rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]
        for row, last in zip(rows, rows[:1] + rows):
            self.assertLess(row['kkt_max'], 1e-8, where)
            self.assertLess(row['energy_defect'], 1e-8, where)
            self.assertGreaterEqual(row['friction_work'], last['friction_work'], where)
        if all(row['substeps'] == 1 for row in rows):
            self.law(self.path('out.h5'), mu, dim, where)
        return True

    def test_hard(self):
        """Boxes near the limit of friction, which statics places after t = 1 (N and T of the highest box): not refused before, and then with the motion
        that friction does not hold."""
        for seed, limit in ((3056, 1.36), (1026, 1.82)):
            with self.subTest(seed=seed):
                self.one(seed)
                run = self.run_raw('solve', '-scene', self.path('scene.yaml'))
                self.assertRegex(run.stderr, 'with this friction balance the load; no support keeps body .* from moving along')
                with open(self.path('t.csv'), encoding='ascii', newline='') as file:
                    self.assertGreater(max(float(row['t']) for row in csv.DictReader(file)), limit)

    def test_floating(self):
        """A box that friction holds beside a plane of symmetry, where tangents of a mortar hardly yield: a step along a ray is the last one, extrapolated,
        and the others take no more iterations than these; the softer the springs, the nearer to it."""
        grid = Grid()
        grid.box('hex8', [np.linspace(-2, 2, 7), np.linspace(0, 2, 4), np.linspace(-1, 0, 3)], lambda x: x, 'low', {'z0': 'base', 'z1': 'top', 'y0': 'sym'})
        grid.box('hex8', [np.linspace(-1.5, 1.5, 6), np.linspace(0, 1.5, 3), np.linspace(0, 1, 3)], lambda x: x, 'high',
                 {'z0': 'under', 'z1': 'press', 'y0': 'sym'})
        grid.write(self.path('mesh.msh'))
        rows = []
        for stiffness in (0, 1e-2, 1e-9):
            spring = f'spring: {{press: {{x: {stiffness}, z: {stiffness}}}}}' if stiffness else ''
            with open(self.path('scene.yaml'), 'w', encoding='ascii') as file:
                file.write(FLOATING % spring)
            history = self.hyco('solve', '-scene', self.path('scene.yaml'))['history']
            if not spring:
                self.assertLessEqual(history['active_set_iterations'][2], 3)
                self.assertLess(sum(history['active_set_iterations']), 120)
            rows.append(np.array([history['outputs'][name] for name in ('N', 'T')]))
        for k, limit in ((1, 1e-2), (2, 1e-8)):
            np.testing.assert_allclose(rows[0], rows[k], rtol=limit, atol=limit / 10)
        self.assertGreater(history['outputs']['W'][-1], 1e-5)

    def test_scenes(self):
        """Solved or refused by name; the law, computed again; more than half of them are solved, and some slip."""
        solved = 0
        for seed in range(self.seed, self.seed + self.count):
            with self.subTest(seed=seed):
                solved += self.one(seed)
        print(f'{solved} of {self.count} solved')
        self.assertGreater(2 * solved, self.count)


if __name__ == '__main__':
    if len(sys.argv) == 3:
        Random.seed, Random.count = int(sys.argv[1]), int(sys.argv[2])
        sys.argv = sys.argv[:1]
    unittest.main()
