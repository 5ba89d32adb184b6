"""Random scenes with floating bodies, slaves that face nothing, walls, supports and rigid bodies: full order has a solution if and only
if the load is in the cone of the contacts. Whether it is follows here from the scene's own data alone: with z the rigid motions of the
bodies that the supports leave free, w(z) the work of the resultants of the loads and n.(z(slave) - z(master)) the rows of the contacts,
are there forces L >= 0 with w(z) = sum of L_i times row i for every z? `equilibrium.py 20261101 500` runs 500 scenes from that seed,
with a table of its own; without arguments some dozens. Loads at the boundary of the cone (to 1e-4) may be solved or refused."""
import itertools
import json
import sys
import unittest

import numpy as np

from extreme import Extreme
from grids import FACETS, Grid

SEED, COUNT, MARGIN = 20261101, 36, 1e-4
KIND = {2: 'quad4', 3: 'hex8'}


def nnls(A, b):
    """|A x - b|, the least for x >= 0 (C. L. Lawson, R. J. Hanson, Solving least squares problems, 1974, chapter 23)."""
    x, inside = np.zeros(A.shape[1]), np.zeros(A.shape[1], bool)
    for _ in range(20 * sum(A.shape)):
        slope = A.T @ (b - A @ x)
        slope[inside] = -1
        if inside.all() or slope.max() < 1e-13 * np.linalg.norm(b):
            break
        inside[slope.argmax()] = True
        while inside.any():
            s = np.zeros_like(x)
            s[inside] = np.linalg.lstsq(A[:, inside], b, rcond=None)[0]
            bad = inside & (s <= 0)
            if not bad.any():
                x = s
                break
            t = (x[bad] / np.maximum(x[bad] - s[bad], 1e-300)).min()
            x = x + t * (s - x)
            inside &= x > 1e-14 * max(x.max(), 1e-300)
            x[~inside] = 0
    return np.linalg.norm(A @ x - b)


class Box:
    """A box on its axes: cells across, corners, and its place in the vector of all rigid motions."""

    def __init__(self, name, low, high, cells, first):
        self.name, self.low, self.high, self.cells, self.first = name, np.array(low), np.array(high), cells, first
        self.dim = len(low)
        self.axes = [np.linspace(*ends) for ends in zip(low, high, [n + 1 for n in cells])]
        self.centre, self.size = (self.low + self.high) / 2, max(self.high - self.low)

    def face(self, axis, end, inner=False):
        """The nodes of a face; inner: of its inner facets."""
        across = [a[1:-1] if inner else a for a in self.axes]
        across[axis] = [(self.low, self.high)[end][axis]]
        return np.array(list(itertools.product(*across)))

    def area(self, axis):
        return np.prod(np.delete(self.high - self.low, axis))

    def motions(self, x, total):
        """z(x), dim x total: translations, and rotations about the centre over the size."""
        out, d = np.zeros((self.dim, total)), (x - self.centre) / self.size
        out[:, self.first:self.first + self.dim] = np.eye(self.dim)
        turns = np.array([[-d[1], d[0]]]).T if self.dim == 2 else np.cross(np.eye(3), d).T
        out[:, self.first + self.dim:self.first + self.dim + turns.shape[1]] = turns
        return out


class Drawn:
    """A scene, and beside it the rows of supports and contacts and the work of the loads on all rigid motions."""

    def __init__(self, r):
        self.r, self.dim = r, int(r.choice([2, 2, 3]))
        self.up, self.per = self.dim - 1, 3 if self.dim == 2 else 6
        self.length, self.stress = 10.0**r.integers(-3, 4), 10.0**r.integers(-2, 7)
        self.tool = bool(r.random() < 0.25)
        self.turn = np.eye(self.dim) if self.tool or r.random() < 0.5 else np.linalg.qr(r.normal(size=(self.dim, self.dim)))[0]
        if np.linalg.det(self.turn) < 0:
            self.turn[:, 0] *= -1
        self.n_floating = int(r.integers(1, 3))
        self.total = self.per * self.n_floating + self.tool
        self.grid, self.held, self.rows, self.work = Grid(), [], [], np.zeros(self.total)
        self.text = {'scene': {'parameters': ['share']}, 'parameter': {'share': {'range': [0, 2]}}, 'body': {}, 'fixed': {}, 'contact': {},
                     'traction': {}}

    def vector(self, v):
        """Components in the scene's axes."""
        return {c: float(x) for c, x in zip('xyz', self.turn @ v)}

    def place(self, box, faces):
        """The box's cells in the mesh; faces: (axis, end, inner, group) each."""
        shape = tuple(len(a) for a in box.axes)
        number = self.grid.count + 1 + np.arange(int(np.prod(shape))).reshape(shape)
        self.grid.box(KIND[self.dim], box.axes, lambda x: self.length * x @ self.turn.T, box.name, {})
        for axis, end, inner, group in faces:
            cut = [slice(1, -1) if inner else slice(None)] * self.dim
            cut[axis] = -end
            self.grid._cells(FACETS[KIND[self.dim]], number[tuple(cut)], self.grid._tag(group, self.dim - 1))
        self.text['body'][box.name] = {'young': float(self.stress * 10.0**self.r.uniform(-2, 1)), 'poisson': float(self.r.uniform(0, 0.4))}

    def row(self, normal, x, slave, master=None):
        """The row of a contact at x for all motions; slave, master: boxes, None: nothing that floats."""
        z = np.zeros((self.dim, self.total))
        z += slave.motions(x, self.total) if slave else 0
        z -= master.motions(x, self.total) if master else 0
        self.rows.append(normal @ z)

    def load(self, box, axis, end, t):
        """A uniform traction on a whole face."""
        group, centre = f'{box.name}_{"xyz"[axis]}{end}', box.centre.copy()
        centre[axis] = (box.low, box.high)[end][axis]
        self.text['traction'][group] = {c: f'{float(v * self.stress)!r}*share' for c, v in self.vector(t).items()}
        self.work += box.area(axis) * t @ box.motions(centre, self.total)
        return axis, end, False, group


def beside(a, b):
    """Whether no node of one axis is close to an end of the other: within a tenth of a facet a slave past the border still has a master."""
    near = min(np.abs(ends[[0, -1]][:, None] - nodes).min() for ends, nodes in ((a, b), (b, a)))
    return near > 0.12 * max(a[1] - a[0], b[1] - b[0])


def stack(d, below, k):
    """A floating box on the one below it, beside which it may reach: contact between them, walls or supports, loads."""
    r, up, side = d.r, d.up, range(d.dim - 1)
    while True:
        wide, cells = r.uniform(0.5, 2, d.dim), [int(r.integers(3, 6)) for _ in range(d.dim)]
        low = np.array([r.uniform(below.low[a] - 0.8 * wide[a], below.high[a] - 0.2 * wide[a]) for a in side] + [below.high[up]])
        box = Box(f'block{k}', low, low + wide, cells, d.per * k)
        if all(beside(below.axes[a], box.axes[a]) for a in side):
            break
    faces, floats = [(up, 0, False, f'{box.name}_under')], below.name != 'base'
    slave, master = (box, below) if r.random() < 0.5 else (below, box)
    names = [f'{b.name}_{"under" if b is box else "seat"}' for b in (slave, master)]
    d.text['contact'][f'under{k}'] = {'type': 'surface', 'slave': names[0], 'master': names[1], 'tolerance': 10 * d.length,
                                      'gap': float(r.choice([0, 0.01, 0.1]) * d.length)}
    normal = np.eye(d.dim)[up] * (-1 if slave is box else 1)
    for x in slave.face(up, 0 if slave is box else 1):
        if all(master.low[a] <= x[a] <= master.high[a] for a in side):
            d.row(normal, x, slave if slave is box or floats else None, master if master is box or floats else None)
    for a in side:
        hold = r.choice(['walls', 'walls', 'wall', 'support', 'support'])
        for end in {'walls': (0, 1), 'wall': (int(r.integers(2)),), 'support': (0,)}[hold]:
            group = f'{box.name}_{"xyz"[a]}{end}_inner'
            faces.append((a, end, True, group))
            n = np.eye(d.dim)[a] * (2 * end - 1)
            if hold == 'support':
                d.text['fixed'][group] = {'normal': 0, 'direction': d.vector(n)}
                d.held += [n @ box.motions(x, d.total) for x in box.face(a, end, True)]
                continue
            d.text['contact'][group] = {'type': 'obstacle', 'group': group, 'normal': d.vector(n), 'gap': float(r.choice([0, 0.02, 0.3]) * d.length)}
            for x in box.face(a, end, True):
                d.row(n, x, box)
    push = 10.0**r.uniform(-3, 3) if k else 1
    t = np.array([r.choice([0, 1]) * r.uniform(-0.4, 0.4) for a in side] + [r.choice([-1, -1, -1, 0.3])]) * r.uniform(0.5, 1.5)
    faces.append(d.load(box, up, 1, push * t))
    if r.random() < 0.4:
        faces.append(d.load(box, 0, 1, push * r.uniform(-0.3, 0.3, d.dim)))
    return box, faces


def tool(d, box):
    """A rigid body over the box, with a force along the height."""
    r, up, n = d.r, d.up, d.dim
    d.grid.tool(KIND[n], [d.length * (20 + np.array([0, 1]))] * n)
    d.text['body']['tool'] = {'young': d.stress}
    d.text['fixed']['tool'] = {c: 0 for c in 'xyz'[:n - 1]}
    force = r.choice([-1, -1, 0.5]) * r.uniform(0.2, 1)
    d.text['contact']['punch'] = {'type': 'rigid', 'slave': f'{box.name}_seat', 'master': 'tip', 'normal': d.vector(np.eye(n)[up]),
                                  'gap': float(r.choice([0, 0.05]) * d.length)}
    d.text['force'] = {'tip': {'xyz'[up]: f'{float(force * d.stress * d.length**(n - 1))!r}*share'}}
    d.work[-1] += force
    for x in box.face(up, 1):
        d.row(np.eye(n)[up], x, box)
        d.rows[-1][-1] -= 1


def draw(seed):
    """A random scene, what it is, and whether it has an equilibrium: 'yes', 'no', or 'either' at the boundary. Scenes with a motion that
    no contact resists in either sense are drawn again: those are refused by name, whatever the load. A third have none."""
    for attempt in itertools.count():
        r = np.random.default_rng((seed, attempt))
        d = Drawn(r)
        below = Box('base', [0] * d.dim, r.uniform(1, 2.5, d.dim), [int(r.integers(3, 7)) for _ in range(d.dim)], None)
        faces = [(d.up, 0, False, 'ground'), (d.up, 1, False, 'base_seat')]
        d.text['fixed']['ground'] = {c: 0 for c in 'xyz'[:d.dim]}
        for k in range(d.n_floating):
            box, more = stack(d, below, k)
            d.place(below, faces)
            below, faces = box, more
            if k + 1 < d.n_floating or d.tool:
                faces.append((d.up, 1, False, f'{box.name}_seat'))
        d.place(below, faces)
        if d.tool:
            tool(d, below)
        verdict = decide(d)
        if verdict == 'either' or verdict == ('no' if seed % 3 == 0 else 'yes'):
            what = f'seed {seed}: {d.dim}D, {d.n_floating} floating, {", ".join(d.text["contact"])}{", turned" if (d.turn != np.eye(d.dim)).any() else ""}'
            return what, d, verdict


def decide(d):
    """Whether there is an equilibrium; '': a motion is not resisted."""
    held = np.array(d.held).reshape(-1, d.total)
    _, values, vectors = np.linalg.svd(np.vstack([held, np.zeros((d.total, d.total))]))
    Z = vectors[values < 1e-9].T
    if not Z.shape[1] or not d.rows:
        return ''
    A, f = (np.array(d.rows) @ Z).T, d.work @ Z
    A = A[:, np.linalg.norm(A, axis=0) > 1e-9]
    if not A.size or np.linalg.matrix_rank(A, tol=1e-2) < Z.shape[1] or not np.linalg.norm(f) > 0:
        return ''
    A, f = A / np.linalg.norm(A, axis=0), f / np.linalg.norm(f)
    if nnls(A, f) > MARGIN:
        return 'no'
    around = (f + sign * MARGIN * e for e in np.eye(len(f)) for sign in (-1, 1))
    return 'yes' if all(nnls(A, g) < 1e-9 for g in around) else 'either'


class Equilibrium(Extreme):
    name = 'equilibrium'
    seed, count = SEED, COUNT

    def test_equilibrium(self):
        """Random scenes with floating bodies are solved if an equilibrium exists, and refused otherwise."""
        found = {(verdict, end): 0 for verdict in ('yes', 'no', 'either') for end in ('solved', 'refused')}
        for seed in range(self.seed, self.seed + self.count):
            what, d, verdict = draw(seed)
            folder = self.scene(d.grid, d.text)
            form = ('auto', 'auto', 'dual', 'primal')[seed % 4]
            with self.subTest(what=what, form=form, equilibrium=verdict):
                run = self.run_raw('solve', '-scene', folder, '-mu', 1, '-hyco_solver_form', form, '-report', self.path('report.json'),
                                   ranks=2 if seed % 25 == 0 else 0)
                found[verdict, 'refused' if run.returncode else 'solved'] += 1
                self.assertEqual(run.returncode != 0, verdict == 'no' or (verdict == 'either' and run.returncode != 0), run.stdout + run.stderr)
                if run.returncode:
                    self.assertEqual(run.stderr.count('hyco: error'), 1, run.stderr)
                    self.assertIn('this load lifts it off; no support keeps body', run.stderr)
                else:
                    with open(self.path('report.json'), encoding='utf-8') as f:
                        report = json.load(f)
                    self.solved(report)
                    self.assertLess(report['balance'], 1e-6)
        self.tell(found)

    def tell(self, found):
        self.begin()
        case = f'{self.count} random scenes with floating bodies from seed {self.seed}'
        self.row(case, 'with an equilibrium, refused', found['yes', 'refused'], 0)
        self.row(case, 'without, solved', found['no', 'solved'], 0)
        self.say(case, 'with, without an equilibrium, at the boundary of the contacts\' cone',
                 ', '.join(str(found[v, 'solved'] + found[v, 'refused']) for v in ('yes', 'no', 'either')))


if __name__ == '__main__':
    if len(sys.argv) > 2:
        Equilibrium.seed, Equilibrium.count = int(sys.argv[1]), int(sys.argv[2])
        Equilibrium.name = f'equilibrium_{Equilibrium.seed}'
    unittest.main(argv=sys.argv[:1])
