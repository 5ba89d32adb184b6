"""Ties on cells of second order: patch tests, bending, matching meshes, curved interfaces, contact, histories and models across a tie."""
import os
import sys
import unittest

import h5py
import numpy as np

from common import SOURCE, Case
from ties import pulled_evenly

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import LINEAR, Grid, second  # noqa: E402

KINDS = {'tri6': 2, 'quad8': 2, 'quad9': 2, 'tet10': 3, 'hex20': 3, 'hex27': 3}
RANKS = ('quad8', 'tet10')  # solved on several ranks too, in 2D and in 3D
E, NU = 200, 0.3
GLUE = 'tie: {glue: {slave: SLAVE, master: MASTER}}\n'
MODEL = """
scene: {mesh: mesh.msh, parameters: [push, stiff]}
parameter: {push: {range: [0.1, 0.4]}, stiff: {range: [150, 400]}}
body: {left: {young: 200, poisson: 0.3}, right: {young: stiff, poisson: 0.2, density: 1e-3}, seat: {young: 300, poisson: 0.3}}
fixed: {base: {LAST: 0}, wall: {x: 0}SIDE}
spring: {east: {normal: 3, LAST: 2}}
pressure: {top: push*(1 + x^2), roof: push/2}
gravity: {LAST: -9.81}
tie: {glue: {slave: seam, master: edge}}
contact: {joint: {type: pair, slave: under, master: over}}
output: {hold: {reaction: LAST, group: base}, low: {min: u_LAST}, most: {max: contact_pressure}}
"""


def polar(nodes):
    return [(r * np.cos(t), r * np.sin(t), *z) for r, t, *z in nodes]


class TiesQuadratic(Case):
    def fields(self, *names):
        with h5py.File(self.path('out.h5')) as f:
            return [f[name][()] for name in names]

    def column(self, kind, low, high):
        """Two unit boxes, one on the other; low, high: their cells each way, or the places of their sides."""
        dim, grid = KINDS[kind], Grid()
        last, sides = 'xyz'[dim - 1], {f'{a}0': f'{a}0' for a in 'xyz'[:dim - 1]}
        low, high = (np.linspace(0, 1, n + 1) if isinstance(n, int) else np.array(n) for n in (low, high))
        grid.box(LINEAR[kind], [low] * dim, lambda x: x, 'low', {**sides, f'{last}0': 'base', f'{last}1': 'over'})
        grid.box(LINEAR[kind], [high] * (dim - 1) + [1 + high], lambda x: x, 'high', {**sides, f'{last}0': 'under', f'{last}1': 'top'})
        return second(grid, kind)

    def pulled(self, kind, low, high, method=''):
        """Uniaxial stress 1.5 in a column, and its strain energy."""
        dim = KINDS[kind]
        last = 'xyz'[dim - 1]
        planes = ', '.join(f'{a}0: {{{a}: 0}}' for a in 'xyz'[:dim - 1])
        text = (f'scene: {{mesh: mesh.msh{", formulation: plane_stress" if dim == 2 else ""}}}\nbody: {{low: {{young: {E}, poisson: {NU}}}, high: {{young: {E}, poisson: {NU}}}}}\n'
                f'fixed: {{{planes}, base: {{{last}: 0}}}}\npressure: {{top: 1.5}}\ntie: {{glue: {{slave: under, master: over{method}}}}}\n'
                f'output: {{pull: {{reaction: {last}, group: base}}}}\n')
        return self.written(text, self.column(kind, low, high)), 1.5**2 * 2 / 2 / E

    def test_patch(self):
        """Uniform stress is transmitted where the slave's mesh is the master's or divides it, evenly or not."""
        for kind, dim in KINDS.items():
            for low, high, ranks in ((2, 2, 2), (1, 3, 0), (2, 4 if kind == 'tet10' else (0, 0.3, 0.5, 0.6, 1), 3)):
                scene, energy = self.pulled(kind, low, high)
                with self.subTest(kind=kind, low=low, high=high):
                    pulled_evenly(self, scene, energy, dim, ranks if kind in RANKS else 0, 1e-13)

    def beam(self, kind, low, high, k=0.01, length=3, method=''):
        """A beam in pure bending that is cut across; low, high: cells in its height on both sides of the cut. Its strain energy."""
        dim, grid = KINDS[kind], Grid()
        low, high = (np.arange(n + 1) / n - 0.5 for n in (low, high))
        grid.box(LINEAR[kind], [np.linspace(0, length / 2, len(low))] + [low] * (dim - 1), lambda x: x, 'low', {'x0': 'left', 'x1': 'over'})
        grid.box(LINEAR[kind], [np.linspace(length / 2, length, len(high))] + [high] * (dim - 1), lambda x: x, 'high', {'x0': 'under', 'x1': 'right'})
        for name, at in (('axis', (0, 0, 0)), ('out', (0, 0, 0.5)))[:dim - 1]:
            grid.elements.append((15, grid._tag(name, 0), [grid.nodes.index(list(map(float, at))) + 1]))
        plane, held = (', formulation: plane_stress', 'axis: {y: 0}') if dim == 2 else ('', f'axis: {{y: 0, z: 0}}, out: {{y: "{k * NU / 8}"}}')
        text = (f'scene: {{mesh: mesh.msh{plane}}}\nbody: {{low: {{young: {E}, poisson: {NU}}}, high: {{young: {E}, poisson: {NU}}}}}\n'
                f'fixed: {{left: {{x: 0}}, {held}}}\ntraction: {{right: {{x: {E * k}*y}}}}\ntie: {{glue: {{slave: under, master: over{method}}}}}\n')
        return self.written(text, second(grid, kind)), E * k * k * length / 24

    def test_tolerance(self):
        """The default is a tenth of the shortest edge between corners: bodies that are 0.09 of it apart are tied, at 0.11 the distance is named."""
        for kind, dim in KINDS.items():
            last = 'xyz'[dim - 1]
            for apart in (0.09, 0.11):
                grid, cut = Grid(), np.linspace(0, 1, 3)
                grid.box(LINEAR[kind], [cut] * dim, lambda x: x, 'low', {f'{last}0': 'base', f'{last}1': 'over'})
                grid.box(LINEAR[kind], [cut] * (dim - 1) + [1 + 0.5 * apart + cut], lambda x: x, 'high', {f'{last}0': 'under', f'{last}1': 'top'})
                text = f'scene: {{mesh: mesh.msh}}\nbody: {{low: {{young: {E}}}, high: {{young: {E}}}}}\nfixed: {{base: {{x: 0, y: 0{", z: 0" if dim == 3 else ""}}}}}\npressure: {{top: 1}}\n'
                run = self.run_raw('solve', '-scene', self.written(text + GLUE.replace('SLAVE', 'under').replace('MASTER', 'over'), second(grid, kind)))
                with self.subTest(kind=kind, apart=apart):
                    self.assertEqual(run.returncode, int(apart > 0.1), run.stderr)
                    self.assertEqual('0.055 away' in run.stderr, apart > 0.1, run.stderr)

    def test_coarse(self):
        """check names a tie to nearest points whose slave is coarser, by the ratio of the facets."""
        for kind, low, high, method, warned in (('quad8', 4, 2, ', method: collocation', 1), ('quad8', 2, 4, ', method: collocation', 0),
                                                ('tet10', 2, 1, ', method: collocation', 1), ('tet10', 2, 1, '', 0), ('hex27', 2, 2, '', 0)):
            scene, _ = self.pulled(kind, low, high, method)
            for ranks in (0, 2):
                found = self.hyco('check', '-scene', scene, ranks=ranks)
                with self.subTest(kind=kind, low=low, high=high, ranks=ranks):
                    self.near(found['ties'][0]['slave_over_master'], low / high, 1e-12)
                    self.assertEqual(sum('glue' in w and 'under' in w for w in found['warnings']), warned, found['warnings'])

    def test_bending(self):
        """Pure bending, whose displacement is quadratic: exact across every cut in 2D and with facets of nine nodes; of six and eight, and of nearest
        points, where the slave divides the master; the error of others is that of the forces, of nearest points 100 times as large."""
        for kind, dim in KINDS.items():
            for low, high, ranks, method in ((2, 2, 3, ''), (2, 4, 2, ', method: collocation'), (2, 4, 0, ''), (4, 6, 2, ', method: collocation'), (4, 6, 0, '')):
                scene, energy = self.beam(kind, low, high, method=method)
                with self.subTest(kind=kind, low=low, high=high, method=method):
                    found = self.hyco('solve', '-scene', scene, '-output', 'out.xdmf', ranks=ranks if kind in RANKS else 0)
                    self.solved(found)
                    self.assertLess(found['balance'], 1e-11)
                    exactly = high != 6 or (not method and kind not in ('tet10', 'hex20'))
                    self.near(found['strain_energy'], energy, 1e-11 if exactly else 1e-3 if method else 1e-5)
                    if high == 6 and method:
                        self.assertGreater(abs(found['strain_energy'] / energy - 1), 1e-4)
                    x, u = self.fields('mesh/xyz', 'nodes/displacement')
                    across = x[:, 2] if dim == 3 else 0
                    exact = 0.01 * np.stack([x[:, 0] * x[:, 1], -(x[:, 0]**2 + NU * (x[:, 1]**2 - across**2)) / 2, -NU * x[:, 1] * across], -1)
                    np.testing.assert_allclose(u[:, :dim], exact[:, :dim], atol=1e-12 if exactly else 1e-4)

    def test_mean(self):
        """Uniform stress is transmitted between meshes of any ratio."""
        for kind, dim in KINDS.items():
            for low, high, ranks in ((2, 3, 2), (3, 2, 0), (2, (0, 0.3, 0.5, 0.6, 1), 3)):
                scene, energy = self.pulled(kind, low, high)
                with self.subTest(kind=kind, low=low, high=high):
                    pulled_evenly(self, scene, energy, dim, ranks if kind in RANKS else 0, 1e-13)

    def test_not_matching(self):
        """Nearest points, meshes of any ratio: resultants are exact, the energy's error is small and falls with the facets, as of first order."""
        for kind in KINDS:
            errors = []
            for k in (1, 2):
                scene, energy = self.pulled(kind, 2 * k, 3 * k, method=', method: collocation')
                found = self.hyco('solve', '-scene', scene)
                self.solved(found)
                self.near(found['outputs']['pull'], 1.5, 1e-12)
                errors.append(found['strain_energy'] / energy - 1)
            with self.subTest(kind=kind):
                self.assertLess(errors[0], 3e-3)
                self.assertLess(errors[1], 0.6 * errors[0])

    def rings(self, kind, *parts):
        """A quarter of rings, one on the other between the radii 1 and 3: their cells across and around. Under pressure in the bore; its strain energy."""
        dim, grid, radii = KINDS[kind], Grid(), np.linspace(1, 3, len(parts) + 1)
        for k, (across, around) in enumerate(parts):
            inner, outer = ('bore' if k == 0 else 'in'), ('rim' if k + 1 == len(parts) else 'out')
            axes = [np.linspace(radii[k], radii[k + 1], across + 1), np.linspace(0, np.pi / 2, around + 1), np.linspace(0, 0.5, 2)]
            grid.box(LINEAR[kind], axes[:dim], lambda x: x, 'ab'[k], {'x0': inner, 'x1': outer, 'y0': 'y0', 'y1': 'x0', **({'z0': 'ends', 'z1': 'ends'} if dim == 3 else {})})
        nodes, elements, names = second(grid, kind)
        bodies = ', '.join(f'{"ab"[k]}: {{young: {E}, poisson: {NU}}}' for k in range(len(parts)))
        text = (f'scene: {{mesh: mesh.msh}}\nbody: {{{bodies}}}\npressure: {{bore: 1}}\nfixed: {{x0: {{x: 0}}, y0: {{y: 0}}{", ends: {z: 0}" if dim == 3 else ""}}}\n'
                + (GLUE.replace('SLAVE', 'in').replace('MASTER', 'out') if len(parts) > 1 else ''))
        u_bore = (1 + NU) / E / (9 - 1) * (1 - 2 * NU + 9)
        return self.written(text, (polar(nodes), elements, names)), np.pi / 4 * u_bore * (0.5 if dim == 3 else 1)

    def test_rings(self):
        """Lame's cylinder of two rings: with the same mesh that of one ring; with a finer slave its error, which falls by 2^4 (here 2^3.6)."""
        for kind in KINDS:
            errors = {}
            for name, n, parts in (('one', 2, [(4, 4)]), ('same', 2, [(2, 4), (2, 4)]), ('finer', 2, [(2, 4), (2, 8)]), ('one', 4, [(8, 8)]), ('finer', 4, [(4, 8), (4, 16)]), ('other', 4, [(4, 8), (4, 12)])):
                scene, energy = self.rings(kind, *parts)
                found = self.hyco('solve', '-scene', scene, ranks=2 if name == 'same' and kind in RANKS else 0)
                self.solved(found)
                errors[name, n] = found['strain_energy'] / energy - 1
            with self.subTest(kind=kind):
                self.assertLess(abs(errors['same', 2] - errors['one', 2]), 1e-12)
                self.assertLess(abs(errors['other', 4] - errors['one', 4]), 5e-4)
                for n in (2, 4):
                    self.assertLess(abs(errors['finer', n] / errors['one', n] - 1), 0.02)
                self.assertGreater(errors['finer', 2] / errors['finer', 4], 12)

    def test_rigid(self):
        """Rings that their meshes cut differently: held at the bore, a turn moves both without strain, because tied nodes are moved onto the facets."""
        for kind, dim in KINDS.items():
            self.rings(kind, (2, 3), (2, 4))
            text = (f'scene: {{mesh: mesh.msh}}\nbody: {{a: {{young: {E}}}, b: {{young: {E}}}}}\nfixed: {{bore: {{x: 0.1 - 0.02*y, y: 0.02*x{", z: 0.3" if dim == 3 else ""}}}}}\n'
                    + GLUE.replace('SLAVE', 'in').replace('MASTER', 'out'))
            with open(self.path('scene.yaml'), 'w', encoding='utf-8') as f:
                f.write(text)
            found = self.hyco('solve', '-scene', self.folder, '-output', 'out.xdmf', ranks=0 if kind not in RANKS else 2 if dim == 2 else 3)
            with self.subTest(kind=kind):
                self.assertLess(found['strain_energy'], 1e-23)
                x, u = self.fields('mesh/xyz', 'nodes/displacement')
                rim = np.hypot(x[:, 0], x[:, 1]) > 2.9
                self.assertGreater(rim.sum(), 8)
                np.testing.assert_allclose(u[rim, :2], np.stack([0.1 - 0.02 * x[rim, 1], 0.02 * x[rim, 0]], -1), atol=1e-12)

    def blocks(self, kind, n, m, seat=()):
        """Two boxes side by side, n cells (left) and m cells (right) on their common side; with the lines of a mesh below them."""
        dim, grid = KINDS[kind], Grid()
        last, sides = 'xyz'[dim - 1], {'y0': 'side'} if dim == 3 else {}
        depth = {1: lambda k: [], 2: lambda k: [np.linspace(0, 1, k + 1)]}[dim - 1]
        if seat:
            grid.box(LINEAR[kind], [np.linspace(0, 2, 5), *depth(seat), np.linspace(0, 1, 3)], lambda x: x, 'seat', {**sides, f'{last}0': 'base', f'{last}1': 'over', 'x0': 'wall'})
        for body, start, k, faces in (('left', 0, n, {'x0': 'wall', 'x1': 'seam', f'{last}1': 'top'}), ('right', 1, m, {'x0': 'edge', 'x1': 'east', f'{last}1': 'roof'})):
            grid.box(LINEAR[kind], [start + np.linspace(0, 1, 3), *depth(seat or k), 1 + np.linspace(0, 1, k + 1)], lambda x: x, body, {**sides, **faces, f'{last}0': 'under'})
        return second(grid, kind)

    def test_contact(self):
        """An obstacle under two tied boxes: a uniform pressure is transmitted exactly; the masters have the tied nodes' forces and areas, by weights of both signs."""
        for kind, dim in KINDS.items():
            last = 'xyz'[dim - 1]
            text = (f'scene: {{mesh: mesh.msh{", formulation: plane_stress" if dim == 2 else ""}}}\nbody: {{left: {{young: {E}, poisson: {NU}}}, right: {{young: {E}, poisson: {NU}}}}}\n'
                    f'fixed: {{wall: {{x: 0}}{", side: {y: 0}" if dim == 3 else ""}}}\npressure: {{"top,roof": 1.5}}\ntie: {{glue: {{slave: seam, master: edge}}}}\n'
                    f'contact: {{stop: {{group: under, normal: {{{last}: -1}}, gap: 0}}}}\n')
            for n, m, ranks in ((2, 2, 0), (4, 2, 2), (3, 2, 3)):
                if kind == 'tet10' and n != m:
                    continue
                with self.subTest(kind=kind, n=n, m=m):
                    found = self.hyco('solve', '-scene', self.written(text, self.blocks(kind, n, m)), '-output', 'out.xdmf', ranks=ranks if kind in RANKS else 0)
                    self.solved(found)
                    self.assertLess(found['balance'], 1e-10)
                    self.near(found['total_contact_force'], 3, 1e-12)
                    self.near(found['contacts']['stop']['area'], 2, 1e-12)
                    self.near(found['strain_energy'], 1.5**2 * 2 / 2 / E, 1e-12)
                    pressure, gap = self.fields('nodes/contact_pressure', 'nodes/gap')
                    np.testing.assert_allclose(pressure[np.isfinite(gap[:, 0]), 0], 1.5, rtol=1e-9)

    def test_normals(self):
        """Measured normals across a tie do not depend on the sign of the weights: lifted boxes of sizes that make a sum of areas negative are 0.1 above the plane."""
        grid = Grid()
        grid.box('hex8', [np.linspace(-3, 1, 2), np.linspace(0, 1, 2), np.linspace(1, 2, 2)], lambda x: x, 'left', {'x1': 'seam', 'z0': 'under', 'z1': 'top'})
        grid.box('hex8', [np.linspace(1, 1.1, 2), np.array([0, 0.4, 0.7, 1]), np.linspace(1, 2, 2)], lambda x: x, 'right', {'x0': 'edge', 'z0': 'under', 'z1': 'top'})
        text = (f'scene: {{mesh: mesh.msh}}\nbody: {{left: {{young: {E}}}, right: {{young: {E}}}}}\nfixed: {{top: {{x: 0, y: 0, z: 0.1}}}}\n'
                'tie: {glue: {slave: seam, master: edge}}\ncontact: {stop: {group: under, gap: 0}}\n')
        found = self.hyco('solve', '-scene', self.written(text, second(grid, 'hex27')), '-output', 'out.xdmf')
        self.assertEqual(found['contacts']['stop']['n_active'], 0)
        gap = self.fields('nodes/gap')[0][:, 0]
        np.testing.assert_allclose(gap[np.isfinite(gap)], 0.1, rtol=1e-9)

    def test_models(self):
        """A pair across a tie, loads, springs and weight, on any number of ranks; models against full order: nearly, and exactly with all of the mesh."""
        for kind, n, m, types in (('tri6', 4, 2, ('hybrid', 'bodies')), ('quad9', 3, 2, ('projection', 'regression')), ('hex20', 3, 2, ('hybrid',)), ('tet10', 2, 1, ('bodies',))):
            last = 'xyz'[KINDS[kind] - 1]
            scene = self.written(MODEL.replace('LAST', last).replace('SIDE', ', side: {y: 0}' if last == 'z' else ''), self.blocks(kind, n, m, seat=2))
            full = [self.hyco('solve', '-scene', scene, '-mu', '0.27,310', *more, ranks=ranks) for ranks, more in ((0, ()), (3, ()), (2, ('-hyco_linear', 'iterative')))]
            for found in full:
                self.solved(found)
                self.assertLess(found['balance'], 1e-9)
                for name in ('strain_energy', 'total_contact_force', 'lambda_max'):
                    self.near(found[name], full[0][name], 1e-8, name)
            train = ('train', '-scene', scene, '-model', f'{kind}.h5', '-hyco_pod_tol', 1e-11)
            for of, bound in (*((of, 0.02) for of in types), ('whole', 1e-10)):
                with self.subTest(kind=kind, type=of):
                    if of == 'whole':
                        self.hyco(*train, '-grid', '2,2', '-hyco_hybrid', 'all', '-hyco_rid_whole', 'true')
                    else:
                        self.hyco(*train, '-grid', '3,3', '-hyco_model_type', of, ranks=2 if of == 'hybrid' else 0,
                                  *(('-hyco_rid_layers', 1, '-hyco_rid_modes', 'displacement,stress,force,dual') if of == 'hybrid' else ()))
                    found = self.hyco('compare', '-scene', scene, '-model', f'{kind}.h5', '-grid', '2,2', ranks=2)
                    for name in ('error_u', 'error_u_h1', 'error_sigma', *(('error_lambda',) if of != 'projection' else ())):
                        self.assertLess(found[name]['max'], bound, name)
                    # modes of a projection that do not change the gaps give no forces, which do not balance the reactions
                    model = self.hyco('predict', '-model', f'{kind}.h5', '-mu', '0.27,310', status=3 * (of == 'projection'))
                    for name in ('hold', 'low', *(('most',) if of != 'projection' else ())):
                        self.near(model['outputs'][name], full[0]['outputs'][name], bound, name)

    def test_moved(self):
        """Bodies whose radii are parameters: the tied nodes, the middles too, are placed on the moved facets. Lame's cylinder again."""
        for kind, ranks in (('tri6', 2), ('quad9', 0), ('hex27', 3)):
            energy = {}
            for name, parts in (('one', [(6, 6)]), ('tied', [(3, 6), (3, 12)])):
                scene, _ = self.rings(kind, *parts)
                with open(self.path('scene.yaml'), encoding='utf-8') as f:
                    text = f.read().replace('scene: {mesh: mesh.msh}', 'scene: {mesh: mesh.msh, parameters: [h]}\nparameter: {h: {range: [1, 2]}}')
                with open(self.path('scene.yaml'), 'w', encoding='utf-8') as f:
                    f.write(text + ''.join(f'body_{"ab"[k]}_map_x: h*x\nbody_{"ab"[k]}_map_y: h*y\n' for k in range(len(parts))))
                found = self.hyco('solve', '-scene', scene, '-mu', '1.5', ranks=ranks)
                self.solved(found)
                energy[name] = found['strain_energy']
            self.near(energy['tied'], energy['one'], 1e-4, kind)

    def test_refused(self):
        """Refinement, chains of ties, and contacts or supports on one side of a tie alone are refused."""
        text = 'scene: {mesh: mesh.msh}\nbody: {left: {young: 200}, right: {young: 200}}\nfixed: {wall: {x: 0, y: 0, z: 0}}\ntie: {glue: {slave: seam, master: edge}}\n'
        for kind, n, more, said in (('hex27', 2, 'scene_refine: 1', 'cannot refine a mesh with ties'), ('tet10', 2, 'tie_back_slave: edge\ntie_back_master: seam', 'is itself a slave of the tie'),
                                    ('tet10', 4, 'contact: {stop: {group: under, normal: {z: -1}, gap: 0}}', 'do not have this contact'),
                                    ('hex20', 3, 'fixed_seam_y: 0', 'are not fixed in the same way')):
            for ranks in (0, 2):
                run = self.run_raw('solve', '-scene', self.written(text + more + '\n', self.blocks(kind, n, 2)), ranks=ranks)
                with self.subTest(kind=kind, more=more, ranks=ranks):
                    self.assertEqual(run.returncode, 1, run.stdout)
                    self.assertEqual(run.stderr.count('hyco: error'), 1, run.stderr)
                    self.assertIn(said, run.stderr)


if __name__ == '__main__':
    unittest.main()
