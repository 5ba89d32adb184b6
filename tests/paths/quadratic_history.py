"""Histories on cells of second order: isochoric flow, a gap that closes and opens on a creeping ring, its reduced models."""
import os
import sys
import unittest

import numpy as np

from common import SOURCE, Case, msh

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import LINEAR, Grid, second  # noqa: E402

PLASTIC = """
scene: {mesh: mesh.msh}
body: {tube: {law: j2, young: 210000, poisson: 0.3, yield: 240}}
fixed: {x0: {x: 0}, y0: {y: 0}ENDS}
pressure: {bore: p}
history: {times: [0, 100, 140, 180], tables: {p: [[0, 0], [200, 200]]}}
output: {rim: {max: u, group: rim}}
"""
GAP = """
scene: {mesh: mesh.msh, parameters: [gap, push]}
parameter: {gap: {range: [0.004, 0.008]}, push: {range: [0.8, 1.2]}}
body: {core: {young: 1e5, poisson: 0.3}, ring: {law: norton, rate: 2e-10, exponent: 3, young: 1e5, poisson: 0.3}}
fixed: {x0: {x: 0}, y0: {y: 0}ENDS}
pressure: {rim: 20*push*q*(1 + 0.3*x/5)}
contact: {fit: {type: pair, slave: shaft, master: sleeve, normal: {x: x, y: y}, gap: gap}}
history: {times: [0, 1, 3, 10, 11], tables: {q: [[0, 0], [1, 1], [10, 1], [11, -2]]}}
"""
KINDS = ('u', 'sigma', 'lambda', 'inelastic')


class Histories(Case):
    def rings(self, kind, text, rings, n, height):
        """Writes a quarter of rings (name, inner and outer radius, groups there), n cells across each; of solids one layer, held along the axis."""
        grid, solid = Grid(), LINEAR[kind] in ('tet4', 'hex8')
        for name, inner, outer, faces in rings:
            axes = [np.geomspace(inner, outer, n + 1), np.linspace(0, np.pi / 2, 2 * n + 1), np.linspace(0, height, 2)]
            grid.box(LINEAR[kind], axes[:2 + solid], lambda x: x, name, {**dict(zip(('x0', 'x1'), faces)), 'y0': 'y0', 'y1': 'x0', **({'z0': 'ends', 'z1': 'ends'} if solid else {})})
        nodes, elements, names = second(grid, kind)
        msh(self.path('mesh.msh'), [(r * np.cos(t), r * np.sin(t), z) for r, t, z in nodes], elements, names)
        with open(self.path('scene.yaml'), 'w', encoding='utf-8') as f:
            f.write(text.replace('ENDS', ', ends: {z: 0}' if solid else ''))
        return self.folder

    def test_plastic(self):
        """A thick tube, perfectly plastic (tests/verify/cylinder.py has its integral): three cells across it, and nothing locks."""
        exact = np.array((.0577778, .087287, .154016))
        for kind, bound in (('tri6', 0.04), ('quad8', 0.004), ('quad9', 0.004), ('tet10', 0.04), ('hex20', 0.004), ('hex27', 0.004)):
            with self.subTest(kind=kind):
                scene = self.rings(kind, PLASTIC, [('tube', 100, 200, ('bore', 'rim'))], 3, 20)
                h = self.hyco('solve', '-scene', scene, '-hyco_substeps', 4, '-hyco_newton', 'tangent')['history']
                self.assertTrue(h['ended'])
                self.assertLess(max(h['kkt_max']), 1e-8)
                self.assertLess(max(h['energy_defect']), 1e-8)
                np.testing.assert_allclose(h['outputs']['rim'][1:], exact, rtol=bound)

    def test_gap(self):
        """A gap that closes and opens while the ring creeps: on two ranks as on one; every unknown of the whole mesh is full order; an RID is near it."""
        rings = [('core', 2, 4, ('bore', 'shaft')), ('ring', 4, 5, ('sleeve', 'rim'))]
        for kind, types in (('quad8', ('hybrid', 'cubature')), ('tet10', ('hybrid', 'bodies')), ('hex20', ())):
            scene = self.rings(kind, GAP, rings, 1, 1)
            full = [self.hyco('solve', '-scene', scene, '-mu', '0.0052,0.93', ranks=ranks)['history'] for ranks in (0, 2)]
            self.assertGreater(max(full[0]['n_active']), 4)
            self.assertEqual(full[0]['n_active'][0], 0)
            self.assertLess(full[0]['n_active'][-1], max(full[0]['n_active']) / 2)
            for name in ('total_contact_force', 'inelastic', 'mises'):
                a, b = (np.array(h[name]) for h in full)
                self.assertLess(abs(a - b).max(), 1e-8 * abs(a).max(), name)
            with self.subTest(kind=kind, type='whole'):
                self.hyco('train', '-scene', scene, '-grid', '1,1', '-model', f'{kind}-whole.h5', '-hyco_rid_whole', '-hyco_hybrid', 'all')
                report = self.hyco('compare', '-scene', scene, '-model', f'{kind}-whole.h5', '-mu', '0.0052,0.93')
                for name in KINDS:
                    self.assertLess(report['worst_' + name]['max'], 1e-8, name)
            for of in types:
                with self.subTest(kind=kind, type=of):
                    self.hyco('train', '-scene', scene, '-grid', '2,2', '-model', f'{kind}.h5', '-hyco_model_type', of, '-hyco_pod_tol', 1e-10,
                              *(('-hyco_rid_layers', 1) if of == 'hybrid' else ()))
                    report = self.hyco('compare', '-scene', scene, '-model', f'{kind}.h5', '-mu', '0.006,1', ranks=2)
                    for name, limit in zip(KINDS, (0.01, 0.03, 0.05, 0.03)):
                        self.assertLess(report['worst_' + name]['max'], limit, name)


if __name__ == '__main__':
    unittest.main()
