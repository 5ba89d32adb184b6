"""The choices of a reduction on the rope, each recomputed by numpy: points, domain, scan, norms."""
import os
import unittest

import h5py
import numpy as np

from common import PELLET, ROPE, Case

SNAPSHOTS = ('-hyco_snapshots', 'snapshots')


def young(mu1, a, b):
    """The stiffness of cells from a to b: mu1 in the left half, 0.15 in the right, the average in the one across."""
    left = np.clip((0.5 - a) / (b - a), 0, 1)
    return left * mu1 + (1 - left) * 0.15


def matrix(x, cells, value, mass=False):
    """The rope's stiffness, or with mass the matrix of H1, without supports."""
    A = np.zeros((len(x), len(x)))
    for (i, j), v in zip(cells, value):
        h = abs(x[j] - x[i])
        A[np.ix_([i, j], [i, j])] += v / h * np.array([[1, -1], [-1, 1]])
        if mass:
            A[np.ix_([i, j], [i, j])] += h / 6 * np.array([[2, 1], [1, 2]])
    return A


def whole_rope(f):
    return f['whole/xyz'][:, 0], f['whole/cells'][:]


class Choices(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.train('base.h5')

    @classmethod
    def train(cls, model, *options):
        return cls.hyco('train', '-scene', ROPE, '-grid', '10,12', '-grid_type', 'centred', '-model', model, *SNAPSHOTS, *options)

    def cells(self, model):
        with h5py.File(self.path(model)) as f:
            return set(f['mesh/cell_whole'][:, 0])

    def rid(self, *options):
        self.train('r.h5', '-hyco_keep_singular', *options)
        return self.cells('r.h5')

    def test_twins(self):
        """Repeated points are used once in training, and a message says so; a prediction keeps its rows."""
        values = ('-values_mu1', '0.05,0.1,0.15,0.2,0.25', '-values_mu2', '0.1,0.2,0.3')
        once = self.hyco('train', '-scene', ROPE, *values, '-model', 'once.h5')
        with open(self.path('twins.csv'), 'w', encoding='ascii') as f:
            f.write('mu1,mu2\n' + ''.join(f'{a},{b}\n' * (2 if a == 0.1 else 1) for a in (0.05, 0.1, 0.15, 0.2, 0.25)
                                          for b in (0.1, 0.2, 0.3)))
        twice = self.hyco('train', '-scene', ROPE, '-points', 'twins.csv', '-model', 'twice.h5')
        self.assertEqual((once['n_samples'], twice['n_samples']), (15, 15))
        with h5py.File(self.path('once.h5')) as a, h5py.File(self.path('twice.h5')) as b:
            self.alike(a['problem/singular_values'][:].ravel().tolist(), b['problem/singular_values'][:].ravel().tolist())
        said = self.run_raw('train', '-scene', ROPE, '-points', 'twins.csv', '-model', 'twice.h5').stdout
        self.assertIn('3 of the 18 training points are duplicates; each of the 15 different points is used once', said)
        p = self.hyco('predict', '-model', 'once.h5', '-points', 'twins.csv', '-table', 'p.csv')
        self.assertEqual(p['n_points'], 18)

    def test_layers(self):
        """A layer: the cells that share a node with the RID."""
        with h5py.File(self.path('base.h5')) as f:
            _, cells = whole_rope(f)
        expected = self.cells('base.h5')
        for n in (1, 2):
            nodes = {i for e in expected for i in cells[e]}
            expected = {e for e in range(99) if set(cells[e]) & nodes}
            self.assertEqual(self.rid('-hyco_rid_layers', n), expected)

    def test_region(self):
        """A region: the cells with a node where the expression is positive; a group: the cells at its nodes."""
        with h5py.File(self.path('base.h5')) as f:
            x, cells = whole_rope(f)
        base = self.cells('base.h5')
        near = {e for e in range(99) if (0.04 - abs(x[cells[e]] - 0.12) > 0).any()}
        self.assertTrue(near - base)
        self.assertEqual(self.rid('-hyco_rid_region', '0.04 - abs(x - 0.12)'), base | near)
        ends = {e for e in range(99) if np.isin(x[cells[e]], (0, 1)).any()}
        self.assertEqual(len(ends - base), 2)
        self.assertEqual(self.rid('-hyco_rid_groups', 'ends'), base | ends)

    def test_extension(self):
        """Contact nodes closer than the distance to a contact node of the RID join it with their cells."""
        with h5py.File(self.path('base.h5')) as f:
            x, cells = whole_rope(f)
            contact = set(f['mesh/node_whole'][:, 0][f['problem/pairs/slave'][:, 0]])
        base = self.cells('base.h5')
        inside = contact & {i for e in base for i in cells[e]}
        d = 2.5 / 99
        near = {i for i in contact if min(abs(x[i] - x[j]) for j in inside) < d}
        expected = base | {e for e in range(99) if set(cells[e]) & (near - inside)}
        self.assertGreater(len(expected), len(base) + 4)
        self.assertEqual(self.rid('-hyco_rid_contact_extension', d), expected)

    def test_points(self):
        """-hyco_deim_type qdeim: the RID is made of the supports of the pivots of QR with column pivoting of V^T."""
        found = self.rid('-hyco_deim_type', 'qdeim', '-hyco_rid_modes', 'displacement')
        with h5py.File(self.path('r.h5')) as f:
            _, cells = whole_rope(f)
            R = f['whole/V'][:]
        covered = set()
        for _ in range(R.shape[1]):
            length = (R**2).sum(1)
            k = int(np.argmax(length))
            covered |= {i for e in range(99) if k in cells[e] for i in cells[e]}
            R = R - np.outer(R @ R[k], R[k]) / length[k]
        self.assertEqual(found, {e for e in range(99) if set(cells[e]) <= covered})
        self.assertNotEqual(found, self.rid('-hyco_rid_modes', 'displacement'))  # DEIM's are others

    def scanned(self, model, mu1):
        """Determinant's sign and smallest singular value over the largest of Vbar[A]^T K[A, A u I] Vbar[A u I]."""
        with h5py.File(self.path(model)) as f:
            x, cells = f['mesh/xyz'][:, 0], f['mesh/cells'][:]
            role, fe, V = f['problem/role'][:, 0], f['problem/fe_dof'][:, 0], f['problem/V'][:].copy()
            G = f['problem/G'][:] if 'G' in f['problem'] else None
        E = np.zeros((len(x), len(fe)))
        E[fe, range(len(fe))] = 1
        if G is None:
            V[fe] = 0
            W = np.hstack([V, E])
        else:  # every unknown of A is full order, the interface follows
            V[fe] = 0
            W = E + V @ G
        A = (role == 2) & (x > 0) & (x < 1)
        T = E if G is not None else W
        K = T[A].T @ matrix(x, cells, young(mu1, x[cells].min(1), x[cells].max(1)))[A] @ W
        s = np.linalg.svd(K, compute_uv=False)
        return np.linalg.slogdet(K)[0], s[-1] / s[0]

    def check_scan(self, *options):
        """What the scan reports is what numpy finds at its points; only a model that is regular on them is written."""
        options = (*options, '-hyco_scan', 51)
        run = self.run_raw('train', '-scene', ROPE, '-grid', '10,12', '-grid_type', 'centred', *SNAPSHOTS, *options, '-model', 'h.h5')
        t = self.train('kept.h5', *options, '-hyco_keep_singular')
        mu1 = np.linspace(0.05, 0.25, 51)
        sign, ratio = np.array([self.scanned('kept.h5', v) for v in mu1]).T
        others = int(min((sign > 0).sum(), (sign < 0).sum()))
        self.assertEqual((t['scan']['points'], t['scan']['points_of_other_sign']), (51, others))
        self.near(t['scan']['smallest_singular_value'], ratio.min(), 0.02)
        self.near(ratio[np.argmin(abs(mu1 - t['scan']['at'][0]))], ratio.min(), 0.02)
        view = self.run_raw('view', '-model', 'kept.h5').stdout
        self.assertIn('scanned at 51 points', view)
        self.assertEqual('SINGULAR' in view, others > 0)
        self.assertEqual(run.returncode != 0, others > 0, run.stderr)
        self.assertEqual('its determinant changes sign' in run.stderr, others > 0)
        self.assertEqual(os.path.exists(self.path('h.h5')), others == 0)
        self.assertEqual([n for n in os.listdir(self.folder) if 'candidate' in n], [])
        if not others:
            os.remove(self.path('h.h5'))
        return t, others

    def test_scan(self):
        """The scan for full-order unknowns, for each kind of hybrid."""
        for hybrid in ('all', 'rank'):
            self.assertEqual(self.check_scan('-hyco_hybrid', hybrid, '-hyco_hybrid_trials', 20)[1], 0)

    def test_resonance(self):
        """A model that is accurate at all its training points and useless between them: the scan refuses it."""
        t, others = self.check_scan('-hyco_deim_type', 'qdeim', '-hyco_hybrid', 'all')
        self.assertGreater(others, 0)
        self.assertLess(t['training_error_u'], 0.02)
        c = self.hyco('compare', '-scene', ROPE, '-model', 'kept.h5', '-grid', '25,30')
        self.assertGreater(c['error_u']['max'], 1)

    def test_all(self):
        """hybrid all: gamma = G U[A] by least squares on V[A] with -hyco_hybrid_ridge 0; with the ridge the training errors
        are not larger."""
        least = self.train('least.h5', '-hyco_hybrid', 'all', '-hyco_hybrid_ridge', 0, '-hyco_keep_singular')
        with h5py.File(self.path('least.h5')) as f:
            V, G = f['problem/V'][:][f['problem/fe_dof'][:, 0]], f['problem/G'][:]
        self.assertLess(abs(G - np.linalg.pinv(V)).max(), 1e-10 * abs(G).max())
        ridge = self.train('ridge.h5', '-hyco_hybrid', 'all')
        self.assertLess(ridge['training_error_u'], least['training_error_u'])

    def test_contact(self):
        """hybrid contact on the pellet: all displacements of the contact nodes of A; rank uses fewer, of full row rank."""
        options = ('-values_radius', '4.02,4.10', '-values_load', '0.5,1', '-hyco_snapshots', 'pellet')
        t = self.hyco('train', '-scene', PELLET, *options, '-model', 'c.h5', '-hyco_hybrid', 'contact')
        with h5py.File(self.path('c.h5')) as f:
            role, fe = f['problem/role'][:, 0], f['problem/fe_dof'][:, 0]
            pairs = np.concatenate([f['problem/pairs/slave'][:, 0], f['problem/pairs/master'][:, 0]])
        expected = {3 * i + c for i in pairs if role[i] == 2 for c in range(3)}
        self.assertLessEqual(set(fe), expected)
        self.assertTrue({d // 3 for d in expected} == {d // 3 for d in fe})
        self.assertEqual(t['n_fe_dofs'], len(fe))
        self.assertGreater(len(fe), t['rid_contacts'])

    def test_reconstruction(self):
        """(41) by Lawson and Hanson and by TAO: the same forces outside the RID, which are most of the total."""
        force = {}
        for solver in ('auto', 'nnls', 'tao'):
            self.hyco('predict', '-model', 'base.h5', '-mu', '0.07,0.17', '-output', 'f.xdmf',
                      '-hyco_reconstruct_solver', solver)
            with h5py.File(self.path('f.h5')) as f:
                force[solver] = f['contact/lambda'][:].ravel()
        with h5py.File(self.path('base.h5')) as f:
            outside = f['problem/in_rid'][:, 0] == 0
        self.assertGreater(force['nnls'][outside].sum(), 0.3 * force['nnls'].sum())
        self.assertEqual(abs(force['auto'] - force['nnls']).max(), 0)
        self.assertGreater(abs(force['tao'] - force['nnls']).max(), 0)  # another method indeed
        self.assertLess(abs(force['tao'] - force['nnls']).max(), 1e-6 * force['nnls'].max())

    def test_norms(self):
        """The errors of compare from the fields of solve and predict, in the norms of 2, H1 and its dual."""
        point = ('-mu', '0.07,0.17')
        self.hyco('predict', '-model', 'base.h5', *point, '-output', 'p.xdmf')
        self.hyco('solve', '-scene', ROPE, *point, '-output', 's.xdmf')
        c = self.hyco('compare', '-scene', ROPE, '-model', 'base.h5', '-values_mu1', 0.07, '-values_mu2', 0.17,
                      '-table', 'c.csv')
        with h5py.File(self.path('base.h5')) as f:
            x, cells = whole_rope(f)
            slave = f['mesh/node_whole'][:, 0][f['problem/pairs/slave'][:, 0]]
            inside = f['problem/in_rid'][:, 0] == 1
        H = matrix(x, cells, np.ones(99), mass=True)
        free = (x > 0) & (x < 1)

        def dual(force):
            r = np.zeros(100)
            r[slave] = -force
            return np.sqrt(r[free] @ np.linalg.solve(H[np.ix_(free, free)], r[free]))

        with h5py.File(self.path('p.h5')) as p, h5py.File(self.path('s.h5')) as s:
            u, v = (f['nodes/displacement'][:].reshape(100, -1)[:, 0] for f in (p, s))
            a, b = p['contact/lambda'][:].ravel(), s['contact/lambda'][:].ravel()
        norm, h1 = np.linalg.norm, lambda e: np.sqrt(e @ H @ e)
        expected = {'error_u': norm(u - v) / norm(v), 'error_u_h1': h1(u - v) / h1(v),
                    'error_lambda': norm(a - b) / norm(b), 'error_lambda_dual': dual(a - b) / dual(b),
                    'error_lambda_rid': norm((a - b)[inside]) / norm(b[inside]),
                    'error_lambda_rid_dual': dual((a - b) * inside) / dual(b * inside)}
        table = np.genfromtxt(self.path('c.csv'), delimiter=',', names=True)
        for name, value in expected.items():
            self.near(c[name]['max'], value, 1e-7, name)
            self.near(float(table[name]), value, 1e-7, name)

    def test_undefined(self):
        """Where full order has no force and the model has some, the error is undefined, and is counted under its name."""
        c = self.hyco('compare', '-scene', ROPE, '-model', 'base.h5', '-grid', '20,24')
        names = [n for n in c if n.startswith('error_')]
        self.assertEqual(len(names), 9)
        self.assertEqual(sum(c[n]['undefined'] for n in names), c['undefined'])
        self.assertEqual([c[n]['undefined'] for n in ('error_u', 'error_u_h1', 'error_sigma', 'error_lambda')], [0] * 4)

    def test_vanishing(self):
        """Where forces nearly vanish, the report divides their error by a tenth of the set's largest, the table by themselves."""
        self.hyco('train', '-scene', PELLET, '-values_radius', '4.02,4.10', '-values_load', '0.5,1', '-hyco_model_type', 'projection',
                  '-hyco_search', 'false', '-hyco_validation', 0, '-model', 'v.h5')
        c = self.hyco('compare', '-scene', PELLET, '-model', 'v.h5', '-values_radius', '4.03,4.08', '-values_load', '0.25,0.3,1', '-table', 'v.csv')
        table = np.genfromtxt(self.path('v.csv'), delimiter=',', names=True)
        for error, size in (('error_lambda', 'lambda_norm2'), ('error_sigma', 'sigma_norm2')):
            guarded = table[error] * table[size] / np.maximum(table[size], 0.1 * table[size].max())
            self.near(c[error]['max'], guarded.max(), 1e-6, error)
        self.assertLess(c['error_lambda']['max'], 0.99 * table['error_lambda'].max())


if __name__ == '__main__':
    unittest.main()
