"""The rope over its obstacle (examples/rope) against its exact solution at mu = (0.07, 0.17).

nu u'' = 1 - p with p >= 0 where the rope lies on the obstacle, u = -d(x), else u'' = 1/nu; u and u' are continuous at
the edges of contact (no point force where the obstacle is smooth: Kinderlehrer and Stampacchia, An Introduction to
Variational Inequalities, 1980), nu u' at x = 1/2. With one interval of contact [a, b] and [c, e] in each half the
pieces are parabolas:
    [0, a]   through u(0) = 0, meeting -d at a with its slope:  d(a) - a d'(a) - a^2/(2 nu) = 0
    [b, c]   leaving -d at b with its slope, bent anew at 1/2, meeting -d at c with its slope: two equations for b, c
    [e, 1]   as the first, from the other end
Linear elements converge with order 2 in u; the edges, known to a node, with order 1.
"""
import os
import unittest

import numpy as np

from common import ROPE
from grids import Grid
from verify import Verify, order

LEFT, RIGHT, SLOPE = 0.07, 0.15, 0.17
NODES = (101, 201, 401, 801, 1601, 3201)  # odd: a node at x = 1/2, where nu jumps


def d(x):
    return 0.2 * (np.sin(np.pi * x) - np.sin(3 * np.pi * x)) + 0.5 - SLOPE * (x - 0.5)


def d1(x):
    return 0.2 * np.pi * (np.cos(np.pi * x) - 3 * np.cos(3 * np.pi * x)) - SLOPE


def d2(x):
    return 0.2 * np.pi**2 * (9 * np.sin(3 * np.pi * x) - np.sin(np.pi * x))


def bisect(f, low, high):
    sign = f(low)
    assert sign * f(high) < 0
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if sign * f(middle) > 0 else (low, middle)
    return (low + high) / 2


def newton(f, x):
    """Roots of f: R^n -> R^n, the Jacobian by central differences."""
    for _ in range(50):
        step = 1e-6
        jacobian = np.array([(f(x + step * e) - f(x - step * e)) / (2 * step) for e in np.eye(len(x))]).T
        change = np.linalg.solve(jacobian, f(x))
        x = x - change
        if abs(change).max() < 1e-15:
            break
    assert abs(f(x)).max() < 1e-13
    return x


def middle(b):
    """Value and slope right of 1/2 of the parabola that leaves the obstacle at b."""
    s = 0.5 - b
    return -d(b) - d1(b) * s + s**2 / (2 * LEFT), (-d1(b) + s / LEFT) * LEFT / RIGHT


def meets(edges):
    b, c = edges
    value, slope = middle(b)
    s = c - 0.5
    return np.array([value + slope * s + s**2 / (2 * RIGHT) + d(c), slope + s / RIGHT + d1(c)])


class Exact:
    """The solution; edges a, b, c, e."""

    def __init__(self):
        a = bisect(lambda x: d(x) - x * d1(x) - x**2 / (2 * LEFT), 0.1, 0.25)
        y = bisect(lambda s: d(1 - s) + s * d1(1 - s) - s**2 / (2 * RIGHT), 0.1, 0.25)
        b, c = newton(meets, np.array([0.3, 0.75]))
        self.edges = np.array([a, b, c, 1 - y])
        assert np.all(np.diff([0, *self.edges, 1]) > 0)
        x = np.linspace(0, 1, 20001)
        inside = self.inside(x)
        assert np.all(self.pressure(x[inside]) > 0) and np.all(self.u(x) >= -d(x) - 1e-13)

    def inside(self, x):
        a, b, c, e = self.edges
        return (x >= a) & (x <= b) | (x >= c) & (x <= e)

    def pressure(self, x):
        return 1 + np.where(x < 0.5, LEFT, RIGHT) * d2(x)

    def u(self, x):
        a, b, c, e = self.edges
        value, slope = middle(b)
        y = 1 - x
        first = x**2 / (2 * LEFT) + x * (-d1(a) - a / LEFT)
        last = y**2 / (2 * RIGHT) + y * (d1(e) - (1 - e) / RIGHT)
        before = -d(b) - d1(b) * (x - b) + (x - b)**2 / (2 * LEFT)
        after = value + slope * (x - 0.5) + (x - 0.5)**2 / (2 * RIGHT)
        return np.select([x < a, x <= b, x < 0.5, x < c, x <= e], [first, -d(x), before, after, -d(x)], last)

    def force(self):
        """The integral of p over the contact: of 1 + nu d'', exactly."""
        a, b, c, e = self.edges
        return b - a + LEFT * (d1(b) - d1(a)) + e - c + RIGHT * (d1(e) - d1(c))


def edges(x, force):
    """First and last node with a force in each half."""
    on = np.sort(x[force > 0])
    left, right = on[on < 0.5], on[on > 0.5]
    return np.array([left[0], left[-1], right[0], right[-1]])


def l2(x, u, exact):
    """The L2 norm of the error of the piecewise linear u, by five Gauss points a cell."""
    at = np.argsort(x)
    x, u = x[at], u[at]
    total = 0
    for g, w in zip(*np.polynomial.legendre.leggauss(5)):
        s = (1 + g) / 2
        point = (1 - s) * x[:-1] + s * x[1:]
        total += np.sum(w / 2 * np.diff(x) * ((1 - s) * u[:-1] + s * u[1:] - exact.u(point))**2)
    return np.sqrt(total)


class Rope(Verify):
    name = 'rope'

    def test_convergence(self):
        """Displacement, force and contact zone converge to the exact ones."""
        exact, found = Exact(), []
        for n in NODES:
            grid = Grid()
            grid.box('line2', [np.linspace(0, 1, n)], lambda x: x, 'rope', {'x0': 'ends', 'x1': 'ends'})
            path = self.path('rope.msh')
            grid.write(path)
            report, out = self.solve(ROPE, '-scene_mesh', path, '-mu', f'{LEFT},{SLOPE}')
            x, u = out['mesh/xyz'][:, 0], out['nodes/displacement'][:, 0]
            off = abs(edges(out['at'][:, 0], out['lambda']) - exact.edges).max()
            found.append((1 / (n - 1), abs(u - exact.u(x)).max(), l2(x, u, exact), off))
            print('rope h {:.3e} max {:.3e} L2 {:.3e} edge {:.3e}'.format(*found[-1]), report['total_contact_force'])
        h, largest, mean, off = np.array(found).T
        self.row('order of u in L2', order(h, mean), 2, 5)
        self.row('order of u at the nodes', order(h, largest), 2, 15)
        self.row('order of the contact edges', order(h, off), 1, 15)
        self.row('largest edge error over h', np.max(off / h), 0, 1)
        self.row(f'contact force, {NODES[-1]} nodes', report['total_contact_force'], exact.force(), 0.01)


if __name__ == '__main__':
    unittest.main()
