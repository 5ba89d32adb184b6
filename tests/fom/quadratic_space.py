"""Cells of second order in 3D: bending, the order of the error, contact with compressive forces, output, models, refusals."""
import os
import sys
import unittest

import h5py
import numpy as np

from common import SOURCE, Case

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import LINEAR, Grid, second  # noqa: E402
from hertz import SPHERE, axes, under  # noqa: E402

KINDS = ('tet10', 'hex20', 'hex27')
E, NU = 200, 0.3
MODEL = """
scene: {mesh: mesh.msh, parameters: [push, stiff]}
parameter: {push: {range: [0.1, 0.4]}, stiff: {range: [150, 400]}}
body: {block: {young: stiff, poisson: 0.2}, seat: {young: 300, poisson: 0.3}}
fixed: {base: {z: 0}, wall: {x: 0}, side: {y: 0}}
spring: {top: {normal: 2}}
pressure: {top: push*(1 + x^2 + y)}
contact: {joint: {type: pair, slave: under, master: over}}
output: {hold: {reaction: z, group: base}, low: {min: u_z}}
"""


class Solids(Case):
    def fields(self, *names):
        with h5py.File(self.path('out.h5')) as f:
            return [f[name][()] for name in names]

    def test_bending(self):
        """Pure bending: u = k (x y, -(x^2 + nu (y^2 - z^2)) / 2, -nu y z) to round-off; the output's cells in VTK's order."""
        k, length = 0.01, 3
        for kind, ranks in (('tet10', 2), ('hex20', 0), ('hex27', 3)):
            grid = Grid()
            grid.box(LINEAR[kind], [np.linspace(0, length, 4), np.linspace(-0.5, 0.5, 3), np.linspace(-0.5, 0.5, 3)], lambda x: x, 'beam', {'x0': 'left', 'x1': 'right'})
            for name, at in (('axis', (0, 0, 0)), ('out', (0, 0, 0.5))):
                grid.elements.append((15, grid._tag(name, 0), [grid.nodes.index(list(map(float, at))) + 1]))
            text = (f'scene: {{mesh: mesh.msh}}\nbody: {{beam: {{young: {E}, poisson: {NU}}}}}\nfixed: {{left: {{x: 0}}, axis: {{y: 0, z: 0}}, out: {{y: "{k * NU / 8}"}}}}\n'
                    f'traction: {{right: {{x: {E * k}*y}}}}\n')
            with self.subTest(kind=kind):
                found = self.hyco('solve', '-scene', self.written(text, second(grid, kind)), '-output', 'out.xdmf', ranks=ranks)
                self.solved(found)
                self.assertLess(found['balance'], 1e-12)
                self.near(found['strain_energy'], E * k * k * length / 24, 1e-12)
                x, u, cells = self.fields('mesh/xyz', 'nodes/displacement', 'mesh/cells')
                np.testing.assert_allclose(u, k * np.stack([x[:, 0] * x[:, 1], -(x[:, 0]**2 + NU * (x[:, 1]**2 - x[:, 2]**2)) / 2, -NU * x[:, 1] * x[:, 2]], -1), atol=1e-12)
                with open(self.path('out.xdmf'), encoding='utf-8') as f:
                    self.assertIn({'tet10': 'Tetrahedron_10', 'hex20': 'Hexahedron_20', 'hex27': 'Hexahedron_27'}[kind], f.read())
                for place, corners in enumerate(VTK[LINEAR[kind]][:cells.shape[1]]):  # each node is where VTK expects it between the corners
                    np.testing.assert_allclose(x[cells[:, place]], np.mean(x[cells][:, corners], axis=1), atol=1e-14)

    def tube(self, kind, n, around=None):
        """A quarter of a tube (or as far as the angles say) of inner radius 1 and outer radius 3 in two rings that meet at radius 2, n cells across each."""
        grid, along = Grid(), np.linspace(0, 0.5, 2)
        around = np.linspace(0, np.pi / 2, 2 * n + 1) if around is None else around
        grid.box(LINEAR[kind], [np.linspace(1, 2, n + 1), around, along], lambda x: x, 'inner', {'x0': 'bore', 'x1': 'shaft', 'y0': 'y0', 'y1': 'x0', 'z0': 'ends', 'z1': 'ends'})
        grid.box(LINEAR[kind], [np.linspace(2, 3, n + 1), around, along], lambda x: x, 'outer', {'x0': 'sleeve', 'x1': 'rim', 'y0': 'y0', 'y1': 'x0', 'z0': 'ends', 'z1': 'ends'})
        nodes, elements, names = second(grid, kind)
        return [(r * np.cos(t), r * np.sin(t), z) for r, t, z in nodes], elements, names

    def test_order(self):
        """Two rings under inner pressure p, of one material: Lame's tube, whose radial stress they meet with. The energy's error falls by 2^4, the pressure's by 2^2."""
        mean = 1 / 8  # p a^2 / (c^2 - a^2)
        energy = np.pi / 4 * 0.5 * (1 + NU) / E * mean * (1 - 2 * NU + 9)
        pressure = mean * (9 / 4 - 1)
        text = (f'scene: {{mesh: mesh.msh}}\nbody: {{inner: {{young: {E}, poisson: {NU}}}, outer: {{young: {E}, poisson: {NU}}}}}\npressure: {{bore: 1}}\n'
                'fixed: {x0: {x: 0}, y0: {y: 0}, ends: {z: 0}}\ncontact: {fit: {type: pair, slave: shaft, master: sleeve}}\n')
        for kind in KINDS:
            errors, worst = [], []
            for n in (2, 4):
                found = self.hyco('solve', '-scene', self.written(text, self.tube(kind, n)), '-output', 'out.xdmf')
                self.solved(found)
                errors.append(abs(found['strain_energy'] / energy - 1))
                at, gap = self.fields('nodes/contact_pressure', 'nodes/gap')
                worst.append(np.max(np.abs(at[np.isfinite(gap[:, 0]), 0] / pressure - 1)))
                self.assertEqual(found['contacts']['fit']['n_active'], found['contacts']['fit']['n'])
            with self.subTest(kind=kind):
                self.assertLess(errors[1], 1e-4)
                self.assertGreater(errors[0] / errors[1], 12, errors)
                self.assertLess(worst[1], 0.01)
                self.assertGreater(worst[0] / worst[1], 3, worst)

    def test_turning(self):
        """A ring that turns in another, on an irregular mesh: the motion is found by the curved faces' own normals, and removed on request."""
        angle = np.linspace(0, 2 * np.pi, 13)
        text = (f'scene: {{mesh: mesh.msh}}\nbody: {{inner: {{young: {E}, poisson: {NU}}}, outer: {{young: {E}, poisson: {NU}}}}}\npressure: {{bore: 1}}\n'
                'fixed: {rim: {x: 0, y: 0}, ends: {z: 0}}\ncontact: {fit: {type: pair, slave: shaft, master: sleeve}}\n')
        for kind in ('tet10', 'hex27'):
            scene = self.written(text, self.tube(kind, 1, angle + 0.1 * np.sin(angle)))
            with self.subTest(kind=kind):
                run = self.run_raw('solve', '-scene', scene)
                self.assertEqual(run.returncode, 1, run.stdout)
                self.assertIn('body inner from turning about (0, 0, 1)', run.stderr)
                self.solved(self.hyco('solve', '-scene', scene, '-hyco_regularise'))

    def test_hertz(self):
        """A ball on a rigid plane, two cells in the half-width: Hertz's half-width, by the second moment of the forces, and his pressure at half of it."""
        stiff = 1 / (1 - 0.3**2)
        for kind, half, bound in (('tet10', 0.005, 0.05), ('hex27', 0.015, 0.05)):
            grid = Grid()
            along, towards = axes(0.01, 2, 1, 20)
            grid.box(LINEAR[kind], [along, along, towards], lambda x: x, 'sphere', {'x0': 'side_x', 'y0': 'side_y', 'z0': 'top', 'z1': ('under', 3)})
            nodes, elements, names = second(grid, kind)
            found = self.hyco('solve', '-scene', self.written(SPHERE.format(press=1e-4), (under(np.array(nodes)).tolist(), elements, names)), '-output', 'out.xdmf')
            self.solved(found)
            x, tag, slave, force, pressure = self.fields('mesh/xyz', 'mesh/node_id', 'contact/node_id', 'contact/lambda', 'nodes/contact_pressure')
            r = np.hypot(*x[np.searchsorted(tag[:, 0], slave[:, 0]), :2].T)
            force, pressure = force[:, 0], pressure[np.searchsorted(tag[:, 0], slave[:, 0]), 0]
            exact = np.cbrt(3 * 4 * np.sum(force) / 4 / stiff)
            profile = 3 * 4 * np.sum(force) / 2 / np.pi / exact**2 * np.sqrt(np.maximum(1 - (r / exact)**2, 0))
            with self.subTest(kind=kind):
                self.assertGreaterEqual(np.min(force), 0)
                self.near(np.sqrt(5 / 2 * np.sum(force * r**2) / np.sum(force)), exact, half)
                self.assertLess(np.max(np.abs(pressure - profile)[r < 0.6 * exact]), bound * np.max(profile))

    def test_loads(self):
        """What acts on a unit cube, warm and turning, with springs below: resultants are those of the closed forms, the springs' forces in balance with them."""
        text = (f'scene: {{mesh: mesh.msh}}\nbody: {{cube: {{young: {E}, poisson: {NU}, density: 2, expansion: 1e-3, temperature: 30+z, reference_temperature: 20}}}}\n'
                'gravity: {z: -10}\nrotation: {speed: 3, axis: {z: 1}}\nforce: {edge: {x: "1+y^2"}}\ntraction: {top: {y: x*y}}\n'
                'spring: {base: {normal: 7, x: 1, y: 2}}\nfixed: {foot: {x: 0, y: 0}}\n')
        for kind in KINDS:
            grid = Grid()
            x = np.linspace(0, 1, 3)
            grid.box(LINEAR[kind], [x, x, x], lambda p: p, 'cube', {'z0': 'base', 'z1': 'top'})
            edge = [i + 1 for i, p in enumerate(grid.nodes) if p[0] == p[2] == 1]
            edge.sort(key=lambda i: grid.nodes[i - 1][1])
            grid.elements += [(1, grid._tag('edge', 1), list(ends)) for ends in zip(edge, edge[1:])] + [(15, grid._tag('foot', 0), [1])]
            found = self.hyco('solve', '-scene', self.written(text, second(grid, kind)))
            with self.subTest(kind=kind):
                self.solved(found)
                self.assertLess(found['balance'], 1e-12)
                np.testing.assert_allclose(found['loads']['force'], [2 * 9 / 2 + 4 / 3, 2 * 9 / 2 + 1 / 4, -20], rtol=1e-12)

    def blocks(self, kind, n=2):
        grid = Grid()
        x = np.linspace(0, 1, n + 1)
        grid.box(LINEAR[kind], [x, x, np.linspace(0, 1, n)], lambda p: p, 'seat', {'z0': 'base', 'z1': 'over', 'x0': 'wall', 'y0': 'side'})
        grid.box(LINEAR[kind], [x, x, np.linspace(1, 2, n)], lambda p: p, 'block', {'z0': 'under', 'z1': 'top', 'x0': 'wall', 'y0': 'side'})
        return second(grid, kind)

    def test_contact(self):
        """A contact transmits a uniform pressure exactly, pairs and obstacles, on one rank and two; hex20 are read as hex27 for it, for tet10 the
        sides' middles have the forces."""
        for kind in KINDS:
            for contact, body in (('{type: pair, slave: under, master: over}', ''), ('{group: under, normal: {z: -1}, gap: 0}', 'over: {z: 0}')):
                text = (f'scene: {{mesh: mesh.msh}}\nbody: {{block: {{young: {E}, poisson: {NU}}}, seat: {{young: {E}, poisson: {NU}}}}}\n'
                        f'fixed: {{base: {{z: 0}}, wall: {{x: 0}}, side: {{y: 0}}, {body}}}\npressure: {{top: 1.5}}\ncontact: {{joint: {contact}}}\n')
                for ranks in (0, 2):
                    with self.subTest(kind=kind, contact=contact, ranks=ranks):
                        found = self.hyco('solve', '-scene', self.written(text, self.blocks(kind)), '-output', 'out.xdmf', ranks=ranks)
                        self.solved(found)
                        self.near(found['total_contact_force'], 1.5, 1e-12)
                        self.near(found['contacts']['joint']['area'], 1, 1e-12)
                        self.near(found['contacts']['joint']['pressure_max'], 1.5, 1e-10)
                        self.assertEqual(found['contacts']['joint']['n'], {'tet10': 16, 'hex20': 25, 'hex27': 25}[kind])
                        x, pressure, gap = self.fields('mesh/xyz', 'nodes/contact_pressure', 'nodes/gap')
                        self.assertEqual(np.sum(np.isfinite(gap[:, 0])), found['contacts']['joint']['n'])
                        on = (pressure[:, 0] > 0)
                        self.assertEqual(np.sum(on), 25)  # the field has no holes at the corners
                        np.testing.assert_allclose(pressure[on, 0], 1.5, rtol=1e-10)

    def test_models(self):
        """Every type of model against full order, on one rank and more; the whole mesh with all displacements full order is full order."""
        for kind, types in (('tet10', ('hybrid', 'bodies')), ('hex20', ('projection',)), ('hex27', ('hybrid', 'regression'))):
            scene = self.written(MODEL, self.blocks(kind))
            full = [self.hyco('solve', '-scene', scene, '-mu', '0.27,310', ranks=ranks) for ranks in (0, 3)]
            self.near(full[1]['strain_energy'], full[0]['strain_energy'], 1e-10)
            for of in types:
                with self.subTest(kind=kind, type=of):
                    self.hyco('train', '-scene', scene, '-grid', '3,3', '-grid_type', 'centred', '-model', f'{kind}.h5', '-hyco_model_type', of, '-hyco_pod_tol', 1e-11,
                              *(('-hyco_rid_layers', 1, '-hyco_rid_modes', 'displacement,stress,force,dual') if of == 'hybrid' else ()))
                    found = self.hyco('compare', '-scene', scene, '-model', f'{kind}.h5', '-grid', '1,2', ranks=2)
                    self.assertLess(found['error_u']['max'], 0.02)
                    self.assertLess(found['error_u_h1']['max'], 0.05)
                    if of == 'projection':  # its modes do not change the gaps: zero forces, not random ones
                        self.assertLess(found['error_lambda']['max'], 1 + 1e-9)
                        many = self.hyco('compare', '-scene', scene, '-model', f'{kind}.h5', '-scatter', 20)
                        self.assertLess(many['error_lambda']['max'], 1 + 1e-9)
                    # modes of a projection that do not change the gaps give no forces, which do not balance the reactions
                    model = self.hyco('predict', '-model', f'{kind}.h5', '-mu', '0.27,310', status=3 * (of == 'projection'))
                    for name, value in full[0]['outputs'].items():
                        self.near(model['outputs'][name], value, 0.05, name)
            with self.subTest(kind=kind, type='whole'):
                self.hyco('train', '-scene', scene, '-grid', '2,2', '-model', f'{kind}-whole.h5', '-hyco_hybrid', 'all', '-hyco_rid_whole', 'true')
                found = self.hyco('compare', '-scene', scene, '-model', f'{kind}-whole.h5', '-grid', '1,2')
                for name in ('error_u', 'error_u_rid', 'error_sigma', 'error_sigma_11', 'error_lambda_rid', 'error_lambda'):
                    self.assertLess(found[name]['max'], 1e-8, name)

    def test_extension(self):
        """The RID is extended along the contact by cells with a face there, whichever of its nodes have contact forces."""
        for kind in ('tet10', 'hex27'):
            scene = self.written(MODEL, self.blocks(kind))
            found = [self.hyco('train', '-scene', scene, '-grid', '2,2', '-model', f'{kind}-far.h5', '-hyco_pod_tol', 1e-2, '-hyco_rid_modes', 'displacement,dual',
                               '-hyco_rid_contact_extension', extension, status=None)['rid_contacts'] for extension in (0, 2)]
            with self.subTest(kind=kind):
                self.assertLess(found[0], found[1])

    def test_refused(self):
        """In 3D: surfaces that do not match, refinement and bbar are refused."""
        text = 'scene: {mesh: mesh.msh}\nbody: {block: {young: 200}, seat: {young: 200}}\nfixed: {base: {x: 0, y: 0, z: 0}, wall: {x: 0}}\n'
        for more, said in (('contact: {c: {type: surface, slave: under, master: over}}', 'needs first-order cells'),
                           ('scene_refine: 1', 'needs first-order cells'), ('body_seat_element: bbar', 'is for quad4 and hex8')):
            for ranks in (0, 2):
                run = self.run_raw('solve', '-scene', self.written(text + more + '\n', self.blocks('tet10')), ranks=ranks)
                with self.subTest(more=more, ranks=ranks):
                    self.assertEqual(run.returncode, 1, run.stdout)
                    self.assertEqual(run.stderr.count('hyco: error'), 1, run.stderr)
                    self.assertIn(said, run.stderr)

    def test_folded(self):
        """The middle of an edge that is drawn past the next one turns its cell inside out: one line with the cell's tag."""
        for kind in KINDS:
            grid = Grid()
            grid.box(LINEAR[kind], [np.linspace(0, 1, 2)] * 3, lambda p: p, 'block', {'z0': 'base'})
            nodes, elements, names = second(grid, kind)
            nodes = [(1.4, 0.9, 0) if tuple(p) == (0.5, 0, 0) else p for p in nodes]
            run = self.run_raw('check', '-scene', self.written('scene: {mesh: mesh.msh}\nbody: {block: {young: 200}}\nfixed: {base: {x: 0, y: 0, z: 0}}\n', (nodes, elements, names)))
            with self.subTest(kind=kind):
                self.assertEqual(run.returncode, 1, run.stdout)
                self.assertEqual(run.stderr.count('hyco: error'), 1, run.stderr)
                self.assertIn('is inverted', run.stderr)


# The corners between which VTK has each node of a cell (vtk.org, vtkQuadraticTetra, vtkTriQuadraticHexahedron).
VTK = {'tet4': [*([k] for k in range(4)), [0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]],
       'hex8': [*([k] for k in range(8)), [0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7],
                [0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 1, 2, 3], [4, 5, 6, 7], list(range(8))]}

if __name__ == '__main__':
    unittest.main()
