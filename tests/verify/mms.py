"""Manufactured solution of elasticity on each cell type: u_i = sin(k_i.x + p_i) with Young's modulus E = 1 + x/2, on
distorted meshes of [0, 1]^dim. The body force is -div sigma(u), the side x = 1 carries the traction sigma(u).e_x, the
other sides the displacement u. Linear cells converge with order 2 in L2 and 1 in the H1 seminorm (Strang and Fix, An
Analysis of the Finite Element Method, 1973, chapter 3). Norms by a quadrature of its own, exact to degree 5 and more.
"""
import itertools
import unittest

import numpy as np

from grids import Grid
from verify import Verify, order

K = 1.2 * np.array([[2, 1, 0.5], [-1, 2, 1], [1, -1.5, 2]])
P = np.array([0.3, 0.7, 1.1])
POISSON = 0.3
LAMBDA, MU = POISSON / (1 + POISSON) / (1 - 2 * POISSON), 1 / 2 / (1 + POISSON)  # of E = 1
SIZES = {'line2': (16, 32, 64), 'tri3': (10, 20, 40), 'quad4': (10, 20, 40), 'tet4': (4, 8, 16), 'hex8': (4, 8, 16)}


def phase(i, dim):
    return '(' + '+'.join(f'({K[i, c]:.17g})*{"xyz"[c]}' for c in range(dim)) + f'+{P[i]:.17g})'


def stress(j, dim):
    """sigma_xj / E as an expression; in 1D u'."""
    cos = [f'cos{phase(i, dim)}' for i in range(dim)]
    if dim == 1:
        return f'{K[0, 0]:.17g}*{cos[0]}'
    terms = [f'{MU * K[j, 0]:.17g}*{cos[j]}', f'{MU * K[0, j]:.17g}*{cos[0]}']
    if j == 0:
        terms += [f'{LAMBDA * K[i, i]:.17g}*{cos[i]}' for i in range(dim)]
    return '(' + '+'.join(f'({t})' for t in terms) + ')'


def force(j, dim):
    """-div sigma: E times what a constant E = 1 gives, less dE/dx sigma_xj / E."""
    if dim == 1:
        terms = [f'{K[0, 0]**2:.17g}*sin{phase(0, 1)}']
    else:
        terms = [f'{(LAMBDA + MU) * K[i, i] * K[i, j]:.17g}*sin{phase(i, dim)}' for i in range(dim)]
        terms.append(f'{MU * np.dot(K[j, :dim], K[j, :dim]):.17g}*sin{phase(j, dim)}')
    return f'(1+x/2)*({"+".join(f"({t})" for t in terms)})-0.5*{stress(j, dim)}'


def scene(dim):
    def components(text):
        return '{' + ', '.join(f'{"xyz"[c]}: "{text(c)}"' for c in range(dim)) + '}'

    poisson = '' if dim == 1 else f', poisson: {POISSON}'
    return (f'scene: {{title: manufactured, mesh: mesh.msh}}\nbody: {{block: {{young: 1 + x/2{poisson}}}}}\n'
            f'force:\n  block: {components(lambda c: force(c, dim))}\n'
            f'fixed:\n  skin: {components(lambda c: "sin" + phase(c, dim))}\n'
            f'traction:\n  pulled: {components(lambda c: "(1+x/2)*" + stress(c, dim))}\n')


def distorted(kind, n, root='skin'):
    """Every inner node moved by up to 0.15 h in each direction; the sides stay plane, that at x = 0 is the group `root`."""
    dim = {'line2': 1, 'tri3': 2, 'quad4': 2}.get(kind, 3)
    random = np.random.default_rng(n)

    def bend(x):
        inner = np.all((x > 1e-9) & (x < 1 - 1e-9), axis=1)
        return x + inner[:, None] * random.uniform(-0.15, 0.15, x.shape) / n

    grid = Grid()
    faces = {f'{"xyz"[c]}{end}': 'skin' for c in range(dim) for end in (0, 1)}
    grid.box(kind, [np.linspace(0, 1, n + 1)] * dim, bend, 'block', {**faces, 'x0': root, 'x1': 'pulled'})
    return dim, grid


def quadrature(kind, dim):
    """Points and weights of the reference cell: Gauss products, on simplices through a collapsed cube."""
    g, w = np.polynomial.legendre.leggauss(4)
    points = np.array(list(itertools.product(*[g] * dim)))
    weights = np.array([np.prod(p) for p in itertools.product(*[w] * dim)])
    if kind not in ('tri3', 'tet4'):
        return points, weights
    t = (points + 1) / 2
    out, left, scale = np.empty_like(t), np.ones(len(t)), np.ones(len(t))
    for c in range(dim):
        out[:, c] = left * t[:, c]
        scale *= left
        left = left * (1 - t[:, c])
    return out, weights / 2**dim * scale


CORNER = np.array([(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)])


def shapes(kind, dim, points):
    """N (q x nv) and its derivatives (q x nv x dim)."""
    if kind in ('tri3', 'tet4'):
        grads = np.vstack([-np.ones(dim), np.eye(dim)])
        return np.column_stack([1 - points.sum(axis=1), points]), np.repeat(grads[None], len(points), axis=0)
    corner = CORNER[:2**dim, :dim]
    factor = (1 + points[:, None, :] * corner) / 2
    grads = np.empty((len(points), 2**dim, dim))
    for c in range(dim):
        grads[:, :, c] = corner[:, c] / 2 * np.prod(np.delete(factor, c, axis=2), axis=2)
    return factor.prod(axis=2), grads


def errors(kind, dim, out):
    """L2 norm and H1 seminorm of the error."""
    cells = out['mesh/cells']
    x, u = out['mesh/xyz'][cells][:, :, :dim], out['nodes/displacement'][cells][:, :, :dim]
    points, weights = quadrature(kind, dim)
    N, dN = shapes(kind, dim, points)
    l2 = h1 = volume = 0.0
    for q, weight in enumerate(weights):
        jacobian = np.einsum('eac,ad->ecd', x, dN[q])
        w = weight * abs(np.linalg.det(jacobian))
        gradient = np.einsum('eic,ecd->eid', np.einsum('eai,ac->eic', u, dN[q]), np.linalg.inv(jacobian))
        s = np.einsum('eac,a->ec', x, N[q]) @ K[:dim, :dim].T + P[:dim]
        l2 += np.sum(w[:, None] * (np.einsum('eai,a->ei', u, N[q]) - np.sin(s))**2)
        h1 += np.sum(w[:, None, None] * (gradient - np.cos(s)[:, :, None] * K[:dim, :dim])**2)
        volume += np.sum(w)
    assert abs(volume - 1) < 1e-12
    return np.sqrt(l2), np.sqrt(h1)


def moments(kind, dim, out, function):
    """Each cell's volume; the integral of a function of x over all."""
    cells, (points, weights) = out['mesh/cells'], quadrature(kind, dim)
    x = out['mesh/xyz'][cells][:, :, :dim]
    N, dN = shapes(kind, dim, points)
    volume, integral = np.zeros(len(cells)), 0.0
    for q, weight in enumerate(weights):
        w = weight * abs(np.linalg.det(np.einsum('eac,ad->ecd', x, dN[q])))
        volume += w
        integral += w @ function(np.einsum('eac,a->ec', x, N[q])[:, 0])
    return volume, integral


class Manufactured(Verify):
    name = 'mms'

    def test_orders(self):
        """Orders of the error in L2 and H1 on each type of cell."""
        for kind, sizes in SIZES.items():
            found = []
            for n in sizes:
                dim, grid = distorted(kind, n)
                found.append(errors(kind, dim, self.solve(self.scene(scene(dim), grid))[1]))
            l2, h1 = np.array(found).T
            print(f'mms {kind}: n {sizes}, L2 {l2}, H1 {h1}')
            self.row(f'{kind} order in L2', order(1 / np.array(sizes), l2), 2, 5)
            self.row(f'{kind} order in H1', order(1 / np.array(sizes), h1), 1, 5)

    def test_body_force(self):
        """Virtual work on v = (x, 0, 0): with x = 0 fixed and no other load, the sum of sigma_xx over the volume is that of f x,
        exactly, whatever the cells. Weights that are not the shape functions', as equal shares of the nodes, still converge with
        order 2 above; here they do not. f = x where that is integrated exactly, 1 on distorted hexahedra."""
        for kind, f in (('line2', 'x'), ('tri3', 'x'), ('quad4', 'x'), ('tet4', 'x'), ('hex8', '1')):
            dim, grid = distorted(kind, 3, 'root')
            poisson = '' if dim == 1 else f', poisson: {POISSON}'
            held = ', '.join(f'{c}: 0' for c in 'xyz'[:dim])
            out = self.solve(self.scene(f'scene: {{title: body force, mesh: mesh.msh}}\nbody: {{block: {{young: 1{poisson}}}}}\n'
                                        f"force: {{block: {{x: '{f}'}}}}\nfixed: {{root: {{{held}}}}}\n", grid))[1]
            volume, work = moments(kind, dim, out, lambda x, constant=f == '1': x if constant else x * x)
            self.row(f'{kind} body force on v = x', volume @ out['cells/stress'][:, 0], work, 1e-9)


if __name__ == '__main__':
    unittest.main()
