"""Scenes with solutions in closed form: confined columns (u_x = 0 at the sides) are in uniaxial strain, sigma_yy = M
du/dy with M = lambda + 2 mu, on any mesh; linear cells are exact at the nodes."""
import unittest

import h5py
import numpy as np

from common import Case, msh

KUHN = [(0, 1, 3, 7), (0, 1, 5, 7), (0, 2, 3, 7), (0, 2, 6, 7), (0, 4, 5, 7), (0, 4, 6, 7)]


def modulus(young, poisson=0.3):
    return young * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson))


def column(kind, y0, y1, n, nodes, elements, first):
    """Adds [0, 2] x [y0, y1] (x [0, 1] in 3D) of n cells a side; groups first: body, +1 bottom, +2 top, +3 sides x, z."""
    dim = 3 if kind == 'tet4' else 2
    base, side = len(nodes) + 1, n + 1

    def node(i, j, k=0):
        return base + i + side * (j + side * k)

    nodes.extend((2 * i / n, y0 + (y1 - y0) * j / n, k / n if dim == 3 else 0)
                 for k in range(side if dim == 3 else 1) for j in range(side) for i in range(side))
    if dim == 2:
        for a in range(n):
            for group, ends in ((1, (node(a, 0), node(a + 1, 0))), (2, (node(a + 1, n), node(a, n))),
                                (3, (node(0, a), node(0, a + 1))), (3, (node(n, a), node(n, a + 1)))):
                elements.append((1, first + group, ends))
            for b in range(n):
                q = [node(a, b), node(a + 1, b), node(a + 1, b + 1), node(a, b + 1)]
                elements += [(3, first, q)] if kind == 'quad4' else [(2, first, q[:3]), (2, first, [q[0], q[2], q[3]])]
        return
    for a in range(n):
        for b in range(n):
            for c in range(n):
                corner = [node(a + (v & 1), b + (v >> 1 & 1), c + (v >> 2)) for v in range(8)]
                for tet in KUHN:
                    elements.append((4, first, [corner[v] for v in tet]))
                    for skip in range(4):
                        face = [corner[v] for k, v in enumerate(tet) if k != skip]
                        xyz = [nodes[v - 1] for v in face]
                        for axis, value, group in ((1, y0, 1), (1, y1, 2), (0, 0, 3), (0, 2, 3), (2, 0, 4), (2, 1, 4)):
                            if all(abs(x[axis] - value) < 1e-12 for x in xyz):
                                elements.append((2, first + group, face))


BLOCK = """
scene: {title: block, mesh: block.msh, parameters: [pull, gap]}
parameter: {pull: {range: [0, 10]}, gap: {range: [0.001, 0.1]}}
body: {block: {young: 100, poisson: 0.3}}
fixed: {foot: {y: 0}, wall: {x: 0}%s}
pressure: {head: -pull}
"""
CONTACT = "contact: {roof: {type: obstacle, group: head, normal: {y: 1}, gap: '%s'}}\n"


class Scenes(Case):
    def block(self, kind, n=4, contact=CONTACT % 'gap'):
        nodes, elements = [], []
        column(kind, 0, 1, n, nodes, elements, 1)
        dim = 3 if kind == 'tet4' else 2
        names = {1: (dim, 'block'), 2: (dim - 1, 'foot'), 3: (dim - 1, 'head'), 4: (dim - 1, 'wall')}
        if dim == 3:
            names[5] = (2, 'front')
        msh(self.path('block.msh'), nodes, elements, names)
        with open(self.path('scene.yaml'), 'w', encoding='utf-8') as f:
            f.write(BLOCK % (', front: {z: 0}' if dim == 3 else '') + contact)

    def test_block_on_obstacle(self):
        """Pulled up by p over the width 2 against a roof at g: the roof takes 2 (p - M g), the rest is strain."""
        for kind in ('quad4', 'tri3', 'tet4'):
            with self.subTest(kind=kind):
                self.block(kind)
                r = self.hyco('solve', '-scene', self.folder, '-mu', '5,0.01')
                self.near(r['total_contact_force'], 2 * (5 - modulus(100) * 0.01), 1e-10)
                self.near(r['u_max'][1], 0.01, 1e-12)
                self.near(r['strain_energy'], modulus(100) * 0.01**2 / 2 * 2, 1e-10)
                self.assertEqual(r['n_active'], r['n_contacts'])
                self.solved(r)
                r = self.hyco('solve', '-scene', self.folder, '-mu', '1,0.01')  # below M g = 1.346: no contact
                self.assertEqual((r['n_active'], r['total_contact_force']), (0, 0))
                self.near(r['u_max'][1], 1 / modulus(100), 1e-10)

    def test_curved_obstacle(self):
        """A bumpy roof: contact on a part; every method finds the same solution."""
        self.block('quad4', 12, CONTACT % 'gap + 0.02*(x - 0.7)^2')
        forces = []
        for kind in ('active_set', 'lemke', 'tao'):
            r = self.hyco('solve', '-scene', self.folder, '-mu', '2.5,0.01', '-hyco_solver_type', kind)
            self.solved(r)
            self.assertTrue(0 < r['n_active'] < r['n_contacts'])
            forces.append(r['total_contact_force'])
        self.near(forces[1], forces[0], 1e-9)
        self.near(forces[2], forces[0], 1e-6)
        self.near(self.balance(r), 2 * 2.5, 1e-6)

    def test_obstacle_on_whole_body(self):
        """Every node has an obstacle, those of the foot one that they cannot move to: gap coordinates, as in the dual
        form. Elasticity couples with both signs: no start from coarser problems, and none that changes anything."""
        self.block('quad4', 12, CONTACT.replace('group: head', 'group: block') % 'gap*(1 + 2*y*sin(4*x)^2)')
        dual = self.hyco('solve', '-scene', self.folder, '-mu', '4,0.01', '-hyco_solver_form', 'dual')
        self.assertEqual(dual['n_contacts'], 13 * 13 - 2)  # the foot's ends are wholly fixed
        self.assertTrue(10 < dual['n_active'] < 13 * 12)
        for more in ([], ['-hyco_solver_multilevel', 'false']):
            for ranks in (1, 2):
                with self.subTest(more=more, ranks=ranks):
                    r = self.hyco('solve', '-scene', self.folder, '-mu', '4,0.01', *more, ranks=ranks)
                    self.solved(r)
                    self.assertEqual(r['solver'], 'active_set primal')
                    self.assertEqual(r['active_set_iterations'], dual['active_set_iterations'])
                    self.assertEqual(r['n_active'], dual['n_active'])
                    for name in ('total_contact_force', 'strain_energy', 'lambda_norm2'):
                        self.near(r[name], dual[name], 1e-10, name)

    def balance(self, report):
        """Contact force plus the foot's reaction from the cell stresses: the whole pull (equilibrium)."""
        self.hyco('solve', '-scene', self.folder, '-mu', '2.5,0.01', '-output', 'b.xdmf')
        with h5py.File(self.path('b.h5')) as f:
            x, u, cells = f['mesh/xyz'][:], f['nodes/displacement'][:], f['mesh/cells'][:]
        lame, shear = 100 * 0.3 / (1.3 * 0.4), 100 / 2.6
        total = 0
        for nodes in cells:  # nodal forces at the foot by the weak form: integral of sigma : grad(y-field), 2 x 2 Gauss
            p, v = x[nodes, :2], u[nodes, :2]
            w = (p[:, 1] < 1e-12).astype(float)
            if not w.any():
                continue
            for s in (-3**-0.5, 3**-0.5):
                for t in (-3**-0.5, 3**-0.5):
                    dn = np.array([[-(1 - t), -(1 - s)], [1 - t, -(1 + s)], [1 + t, 1 + s], [-(1 + t), 1 - s]]) / 4
                    jac = p.T @ dn
                    g = dn @ np.linalg.inv(jac)
                    e = v.T @ g
                    e = (e + e.T) / 2
                    sigma = lame * np.trace(e) * np.eye(2) + 2 * shear * e
                    total -= np.linalg.det(jac) * (sigma @ (w @ g))[1]
        return report['total_contact_force'] + total

    def test_two_bodies(self):
        """A (height 1, M_A) is fixed below, B (height 2, M_B) hangs above it with the weight f: closing the gap g
        takes q = (2 f / M_B - g) / (1 / M_A + 2 / M_B) per unit of width."""
        for kind in ('quad4', 'tri3', 'tet4'):
            with self.subTest(kind=kind):
                nodes, elements = [], []
                column(kind, 0, 1, 4, nodes, elements, 1)
                column(kind, 1, 3, 4, nodes, elements, 11)
                dim = 3 if kind == 'tet4' else 2
                names = {1: (dim, 'a'), 2: (dim - 1, 'foot'), 3: (dim - 1, 'a_top'), 4: (dim - 1, 'a_wall'),
                         11: (dim, 'b'), 12: (dim - 1, 'b_low'), 13: (dim - 1, 'head'), 14: (dim - 1, 'b_wall')}
                fixed = 'foot: {y: 0}, head: {y: 0}, a_wall: {x: 0}, b_wall: {x: 0}'
                if dim == 3:
                    names.update({5: (2, 'a_front'), 15: (2, 'b_front')})
                    fixed += ', a_front: {z: 0}, b_front: {z: 0}'
                msh(self.path('two.msh'), nodes, elements, names)
                with open(self.path('two.yaml'), 'w', encoding='utf-8') as f:
                    f.write('scene: {mesh: two.msh, parameters: [f]}\nparameter: {f: {range: [0, 10]}}\n'
                            'body: {a: {young: 100, poisson: 0.3}, b: {young: 40, poisson: 0.2}}\n'
                            'force: {b: {y: -f}}\nfixed: {%s}\n'
                            'contact: {seam: {type: pair, slave: b_low, master: a_top, tolerance: 1e-6,'
                            ' normal: {y: -1}, gap: 0.03}}\n' % fixed)
                r = self.hyco('solve', '-scene', self.path('two.yaml'), '-mu', '4')
                m_a, m_b = modulus(100), modulus(40, 0.2)
                self.near(r['total_contact_force'], 2 * (8 / m_b - 0.03) / (1 / m_a + 2 / m_b), 1e-9)
                self.assertEqual(r['n_active'], r['n_contacts'])
                self.solved(r)
                # without a normal in the scene the facets' own is taken
                own = self.hyco('solve', '-scene', self.path('two.yaml'), '-mu', '4', '-contact_seam_normal_y', '-2')
                self.near(own['total_contact_force'], r['total_contact_force'], 1e-12)

    def test_no_contact(self):
        """Without contact the solution is linear in the pull: one mode predicts all."""
        self.block('quad4', 6, '')
        t = self.hyco('train', '-scene', self.folder, '-values_pull', '1,5', '-values_gap', '0.05', '-model', 'n.h5',
                      '-hyco_rid_modes', 'displacement,stress', '-hyco_rid_layers', 1)
        self.assertEqual((t['n_modes'], t['rid_contacts']), (1, 0))
        c = self.hyco('compare', '-scene', self.folder, '-model', 'n.h5', '-values_pull', '0.3,7', '-values_gap', '0.01')
        for name in ('error_u', 'error_u_rid', 'error_sigma'):
            self.assertLess(c[name]['max'], 1e-9, name)
        p = self.hyco('predict', '-model', 'n.h5', '-mu', '7,0.01')
        self.assertEqual((p['n_contacts'], p['total_contact_force'], p['covered_force']), (0, 0, 1))

    def test_free_body_is_told(self):
        """Without the foot's support K is singular: solved by equilibrium, or refused in one line."""
        self.block('quad4')
        with open(self.path('scene.yaml'), encoding='utf-8') as f:
            text = f.read().replace('foot: {y: 0}, ', '')
        with open(self.path('free.yaml'), 'w', encoding='utf-8') as f:
            f.write(text)
        run = self.run_raw('solve', '-scene', self.path('free.yaml'), '-mu', '5,0.01')
        if run.returncode:
            self.assertEqual((len(run.stderr.strip().splitlines()), run.stdout), (1, ''), run.stderr)
        else:
            self.assertIn('total contact force 10,', run.stdout)  # the pull times the width


if __name__ == '__main__':
    unittest.main()
