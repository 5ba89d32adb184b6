"""Thermal strain eps = alpha (T - T0) in bodies whose temperature is given: free, held, and a ring with T = c r^2 in plane
strain (S. Timoshenko, J. N. Goodier, Theory of Elasticity, 3rd ed. 1970, chapter 13):

    s_r = alpha E / ((1 - nu) r^2) [(r^2 - a^2)/(b^2 - a^2) I(b) - I(r)],  I(r) = integral of T r from a to r
    s_t = alpha E / ((1 - nu) r^2) [(r^2 + a^2)/(b^2 - a^2) I(b) + I(r) - T r^2],  s_z = nu (s_r + s_t) - alpha E T

The energy identity of every solve holds with them (its work counts what heat does).
"""
import unittest

import numpy as np

from grids import Grid
from verify import Verify, order

SCENE = """
scene: {{title: heat, mesh: mesh.msh, parameters: [hot]}}
parameter: {{hot: {{range: [0, 1000]}}}}
body: {{block: {{young: {young}, poisson: 0.3, temperature: "{temperature}", reference_temperature: 293,
        expansion: "{expansion}", element: {element}}}}}
fixed: {{{fixed}}}
"""
KINDS = (('line2', 1, 'standard'), ('tri3', 2, 'standard'), ('quad4', 2, 'standard'), ('quad4', 2, 'bbar'),
         ('tet4', 3, 'standard'), ('hex8', 3, 'standard'), ('hex8', 3, 'bbar'))
E, NU, ALPHA = 2e5, 0.3, 1.1e-5


def skewed(x):
    """The unit cube with its inner nodes moved."""
    bump = 0.08 * np.prod(np.sin(np.pi * x), axis=1, keepdims=True)
    return x + bump * np.arange(1, x.shape[1] + 1)


class Heat(Verify):
    name = 'heat'

    def box(self, kind, dim, ends=('0',)):
        grid = Grid()
        faces = {f'{a}{e}': f'{a}{e}' for a in 'xyz'[:dim] for e in ends}
        grid.box(kind, [np.linspace(0, 1, 4)] * dim, skewed, 'block', faces)
        return grid

    def run_box(self, kind, dim, element, ends, mu='700', ranks=1, **entries):
        values = {'young': E, 'temperature': 'hot', 'expansion': ALPHA, **entries}
        fixed = ', '.join(f'{a}{e}: {{{a}: 0}}' for a in 'xyz'[:dim] for e in ends)
        scene = self.scene(SCENE.format(element=element, fixed=fixed, **values), self.box(kind, dim, ends))
        return self.solve(scene, '-mu', mu, ranks=ranks)

    def test_free(self):
        """No stress (2D: none in the plane, -E alpha dT across it), and the strain everywhere."""
        for kind, dim, element in KINDS:
            report, out = self.run_box(kind, dim, element, '0')
            hot = ALPHA * (700 - 293)
            stress = out['cells/stress']
            across = stress[:, 5] + E * hot if dim == 2 else 0  # xx, xy, xz, yy, yz, zz
            stress = stress.copy()
            if dim == 2:
                stress[:, 5] = across
            self.row(f'free, {kind} {element}: stress over E alpha dT', abs(stress).max() / (E * hot), 0, 1e-12)
            growth = hot * (1 + NU if dim == 2 else 1)
            self.row(f'free, {kind} {element}: displacement', report['u_max'][0], growth, 1e-9)

    def test_held(self):
        """All faces held: s = -E alpha dT / (1 - 2 nu), with constants that depend on the temperature too."""
        for kind, dim, element in KINDS:
            out = self.run_box(kind, dim, element, '01', young='2.2e5 - 50*temperature',
                               expansion='1e-5 + 2e-9*temperature')[1]
            exact = -(2.2e5 - 35000) * (1e-5 + 1.4e-6) * 407 / (1 if dim == 1 else 1 - 2 * NU)
            stress = out['cells/stress'][:, 0]
            self.row(f'held, {kind} {element}: stress', stress[np.argmax(abs(stress - exact))], exact, 1e-9)

    def test_ranks(self):
        """Thermal strain on 3 ranks: the fields of one."""
        one = self.run_box('hex8', 3, 'bbar', '0', temperature='hot*(1 + x*y)')[1]
        three = self.run_box('hex8', 3, 'bbar', '0', temperature='hot*(1 + x*y)', ranks=3)[1]
        for name in ('nodes/displacement', 'cells/stress'):
            size = abs(one[name]).max()
            self.row(f'{name} on 3 ranks', abs(one[name] - three[name]).max() / size, 0, 1e-11)

    def test_ring(self):
        """A quarter of the ring from 1 to 2, T = 100 r^2 over the reference."""
        a, b, c = 1, 2, 100
        sizes, off = (6, 12, 24), []
        for n in sizes:
            grid = Grid()
            angle = np.linspace(0, np.pi / 2, 2 * n + 1)
            grid.box('quad4', [np.linspace(a, b, n + 1), angle],
                     lambda x: x[:, :1] * np.column_stack([np.cos(x[:, 1]), np.sin(x[:, 1])]), 'block',
                     {'y0': 'y0', 'y1': 'x0'})
            scene = self.scene(SCENE.format(young=E, expansion=ALPHA, element='standard',
                                            temperature='293 + hot*(x*x + y*y)', fixed='y0: {y: 0}, x0: {x: 0}'), grid)
            out = self.solve(scene, '-mu', str(c))[1]
            centre = out['mesh/xyz'][out['mesh/cells']].mean(axis=1)
            r = np.hypot(centre[:, 0], centre[:, 1])
            cos, sin = centre[:, 0] / r, centre[:, 1] / r

            def integral(x):
                return c * (x**4 - a**4) / 4

            scale = ALPHA * E / ((1 - NU) * r**2)
            radial = scale * ((r**2 - a**2) / (b**2 - a**2) * integral(b) - integral(r))
            hoop = scale * ((r**2 + a**2) / (b**2 - a**2) * integral(b) + integral(r) - c * r**4)
            exact = np.column_stack([cos**2 * radial + sin**2 * hoop, cos * sin * (radial - hoop), 0 * r,
                                     sin**2 * radial + cos**2 * hoop, 0 * r, NU * (radial + hoop) - ALPHA * E * c * r**2])
            off.append(abs(out['cells/stress'] - exact).max() / abs(exact).max())
        self.row('ring: order of the stresses', order(1 / np.array(sizes), off), 2, 15)
        self.row('ring: largest stress error over the largest stress', off[-1], 0, 5e-3)


if __name__ == '__main__':
    unittest.main()
