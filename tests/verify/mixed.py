"""Meshes of several first-order cell types: quadrilaterals with triangles, hexahedra with prisms, pyramids and tetrahedra. Their
smaller cells are collapsed quad4 and hex8, with exactly the functions of their own type: patch tests hold to round-off, a mesh of
triangles or tetrahedra has the solution that it has as a mesh of its own type, and a refined mesh that of half the size."""
import unittest

import h5py
import numpy as np

from grids import Grid
from verify import Verify

CUTS = {'quad4 and tri3': (2, lambda c: 'halves' if (c[0] + c[1]) % 2 else 'whole'),
        'hex8 and prism6': (3, lambda c: 'halves' if (c[0] + c[1]) % 2 else 'whole'),
        'prism6': (3, lambda c: 'halves'),
        'hex8 and pyramid5': (3, lambda c: 'pyramid5' if max(c) < 2 else 'whole'),
        'all four': (3, lambda c: 'tet4' if max(c) < 2 else 'halves' if min(c[:2]) >= 2 else 'whole')}
E_A, NU_A, E_B, NU_B, PRESS, GAP = 100, 0.3, 40, 0.2, 0.05, 0.02
STACK = """
scene: {mesh: mesh.msh, parameters: [press, gap]}
parameter: {press: {range: [0, 0.2]}, gap: {range: [0, 0.1]}}
body: {a: {young: %g, poisson: %g}, b: {young: %g, poisson: %g}}
fixed: {a_%s0: {%s: 0}, b_%s1: {%s: -press}, a_x0: {x: 0}, b_x0: {x: 0}%s}
contact: {seam: {type: %s, slave: b_%s0, master: a_%s1, gap: gap}}
"""
CREEP = """
scene: {mesh: mesh.msh, parameters: [pull]}
parameter: {pull: {range: [1, 10]}}
body: {block: {law: norton, young: 1000, poisson: 0.3, rate: 1e-5, exponent: 3}}
fixed: {x0: {x: 0}, y0: {y: 0}%s}
traction: {x1: {x: pull}}
history: {times: [0, 1, 2, 4]}
"""
LOADED = """
scene: {mesh: mesh.msh, parameters: [load]}
parameter: {load: {range: [0, 2]}}
body: {block: {young: 100, poisson: 0.3}, other: {young: 1}}
fixed: {x0: {x: 0, y: 0%s}, far: {x: 0, y: 0%s}}
pressure: {x1: "load*(1 + y)"}
spring: {y1: {normal: 3}}
force: {block: {y: -1}}
"""


def sides(dim, name):
    return {f'{"xyz"[c]}{end}': f'{name}{"xyz"[c]}{end}' for c in range(dim) for end in (0, 1)}


def wobbled(dim, amount, lo=0, hi=1):
    """Moves the nodes inside a unit cube by up to `amount`."""
    def move(x):
        inside, y = ((x > lo + 1e-9) & (x < hi - 1e-9)).all(axis=1), x.copy()
        y[inside] += amount * (np.random.default_rng(1).random((int(inside.sum()), dim)) - 0.5)
        return y
    return move


class Mixed(Verify):
    name = 'mixed'

    def test_contact_patch(self):
        """Two blocks pressed on one another: uniform stress and pressure, by closed form."""
        for title, (dim, cut) in CUTS.items():
            n, up, grid = [4, 3] if dim == 2 else [3, 3, 2], 'xyz'[dim - 1], Grid()
            for body, lo, hi in (('a', 0, 1), ('b', 1, 2.5)):
                axes = [*(np.linspace(0, 1, k + 1) for k in n[:-1]), np.linspace(lo, hi, n[-1] + 1)]
                grid.mixed(axes, wobbled(dim, 0.1), body, sides(dim, body + '_'), cut)
            stiff = (E_A / (1 - NU_A**2), E_B / (1 - NU_B**2)) if dim == 2 else (E_A, E_B)
            p = (PRESS - GAP) / (1 / stiff[0] + 1.5 / stiff[1])
            for contact, ranks in (('pair', 0), ('surface', 0), ('surface', 3)):
                more = ', a_y0: {y: 0}, b_y0: {y: 0}' * (dim == 3)
                folder = self.scene(STACK % (E_A, NU_A, E_B, NU_B, up, up, up, up, more, contact, up, up), grid)
                _, out = self.solve(folder, '-mu', f'{PRESS},{GAP}', ranks=ranks)
                stress = out['cells/stress'][:, 3 if dim == 2 else 5]
                self.row(f'{title}, {contact}, {ranks} ranks: stress', stress[abs(stress + p).argmax()], -p, 1e-9)
                self.row(f'{title}, {contact}, {ranks} ranks: pressure', out['pressure'][abs(out['pressure'] - p).argmax()], p, 1e-9)

    def test_refined(self):
        """A mesh refined by DMPlex is the mesh of half the size."""
        for title in ('quad4 and tri3', 'hex8 and prism6'):
            dim, cut = CUTS[title]
            text = ('scene: {mesh: mesh.msh, parameters: [load]}\nparameter: {load: {range: [0, 2]}}\nbody: {block: {young: 100, poisson: 0.3}}\n'
                    'fixed: {x0: {x: 0, y: 0%s}}\npressure: {y1: "load*(1 + x^2)"}\n' % (', z: 0' * (dim == 3)))
            grids = [Grid(), Grid()]
            for k, grid in enumerate(grids):
                grid.mixed([np.linspace(0, 1, 3 * (k + 1) + 1)] * dim, lambda x: x, 'block', sides(dim, ''), lambda c, k=k: cut([i // (k + 1) for i in c]))
            fine, expected = self.solve(self.scene(text, grids[1]), '-mu', '1')
            folder, alone = self.scene(text, grids[0]), None
            for ranks in (0, 3):
                report, out = self.solve(folder, '-mu', '1', '-scene_refine', '1', ranks=ranks)
                self.assertEqual((report['n_dof'], len(out['mesh/cells'])), (fine['n_dof'], len(expected['mesh/cells'])))
                self.row(f'{title}, refined, {ranks} ranks: energy', report['strain_energy'], fine['strain_energy'], 1e-10)
                alone = alone or out
                for name in ('mesh/xyz', 'mesh/cells', 'nodes/displacement', 'cells/stress'):
                    self.assertLess(abs(out[name] - alone[name]).max(), 1e-9, (title, ranks, name))

    def test_alone(self):
        """Triangles and tetrahedra in a mesh that has a quadrilateral or a hexahedron elsewhere, and without it."""
        for dim, kind, wide in ((2, 'tri3', 'quad4'), (3, 'tet4', 'hex8')):
            found = []
            for other in (kind, wide):
                grid = Grid()
                grid.box(kind, [np.linspace(0, 1, 4)] * dim, wobbled(dim, 0.1), 'block', sides(dim, ''))
                grid.box(other, [np.linspace(3, 4, 2)] * dim, lambda x: x, 'other', {'x0': 'far'})
                more = ', z: 0' * (dim == 3)
                _, out = self.solve(self.scene(LOADED % (more, more), grid), '-mu', '1')
                found.append(out['nodes/displacement'])
            self.assertGreater(out['mesh/cells'].shape[1], dim + 1)  # the second is a mesh of the wider type
            apart = abs(found[1] - found[0]).max() / abs(found[0]).max()
            self.row(f'{kind} as a collapsed {wide}: displacements differ by', apart, 0, 1e-10)

    def test_creep(self):
        """Uniform creep under a constant stress s: the strain along it is s/E + rate s^3 t in 3D; in 2D the same as on quadrilaterals."""
        for title, (dim, cut) in CUTS.items():
            found = []
            for rule in (cut, lambda c: 'whole'):
                grid = Grid()
                grid.mixed([np.linspace(0, 1, 4)] * dim, wobbled(dim, 0.1), 'block', sides(dim, ''), rule)
                folder = self.scene(CREEP % (', z0: {z: 0}' * (dim == 3)), grid)
                report = self.hyco('solve', '-scene', folder, '-mu', '5', '-output', self.path('creep.xdmf'))
                self.assertLess(max(report['history']['energy_defect']), 1e-8)
                with h5py.File(self.path('creep.h5')) as f:
                    last = sorted(k for k in f if k.startswith('step-'))[-1]
                    found.append(f[last]['nodes/displacement'][:, 0].max())
            self.row(f'{title}: creep, against one type', found[0], found[1], 1e-7)
            if dim == 3:
                self.row(f'{title}: creep', found[0], 5 / 1000 + 1e-5 * 5**3 * 4, 1e-5)


if __name__ == '__main__':
    unittest.main()
