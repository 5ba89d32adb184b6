"""Meshes of several cell types: models, histories, ties, springs, ranks, files in and out, pictures, refusals."""
import importlib.machinery
import importlib.util
import os
import subprocess
import sys
import unittest
import xml.etree.ElementTree as ET

import h5py
import numpy as np

from common import SOURCE, Case, msh

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import Grid  # noqa: E402

loader = importlib.machinery.SourceFileLoader('plot', os.path.join(SOURCE, 'scripts', 'plot'))
plot = importlib.util.module_from_spec(importlib.util.spec_from_loader('plot', loader))
loader.exec_module(plot)

CROWN = """
scene: {mesh: MESH, parameters: [press, gap]}
parameter: {press: {range: [0, 0.2]}, gap: {range: [0, 0.1]}}
body: {a: {young: 100, poisson: 0.3}, b: {young: 40, poisson: 0.2, map: {UP: 'UP + gap*ROUND*(2.5 - UP)/1.5'}}}
fixed: {a_UP0: {UP: 0}, b_UP1: {UP: -press}, a_x0: {x: 0}, b_x0: {x: 0}MORE}
contact: {seam: {type: surface, slave: b_UP0, master: a_UP1}}
output: {hold: {reaction: UP, group: a_UP0}, high: {max: mises}}
"""
CREEP = """
scene: {mesh: MESH, parameters: [push, creep]}
parameter: {push: {range: [8, 12]}, creep: {range: [0.5, 2]}}
body: {a: {law: norton, young: 1e4, poisson: 0.3, rate: 1e-7*creep, exponent: 3}}
fixed: {y0: {y: 0}, y1: {x: 0.001*q}}
pressure: {bore: push*q}
contact: {stop: {group: bore, gap: "0.0012 + 0.0008*x"}}
history: {times: [0, 1, 3], tables: {q: [[0, 0], [1, -1], [3, -1]]}}
"""
odd = lambda c: 'halves' if (c[0] + c[1]) % 2 else 'whole'
four = lambda c: 'tet4' if max(c) < 2 else 'halves' if min(c[:2]) >= 2 else 'whole'
whole = lambda c: 'whole'


class Mixed(Case):
    @classmethod
    def stacked(cls, dim, cut_a, cut_b, n_a, n_b):
        """Two blocks, the upper one with a crown that grows with gap."""
        grid = Grid()
        for body, cut, n, lo, hi in (('a', cut_a, n_a, 0, 1), ('b', cut_b, n_b, 1, 2.5)):
            axes = [*(np.linspace(0, 1, k + 1) for k in n[:-1]), np.linspace(lo, hi, n[-1] + 1)]
            grid.mixed(axes, lambda x: x, body, {f'{"xyz"[c]}{e}': f'{body}_{"xyz"[c]}{e}' for c in range(dim) for e in (0, 1)}, cut)
        grid.write(cls.path(f'stack{dim}.msh'))
        text = CROWN.replace('MESH', f'stack{dim}.msh').replace('UP', 'xyz'[dim - 1]).replace('ROUND', 'x^2' if dim == 2 else '(x^2 + y^2)')
        with open(cls.path(f'stack{dim}.yaml'), 'w', encoding='ascii') as f:
            f.write(text.replace('MORE', ', a_y0: {y: 0}, b_y0: {y: 0}' * (dim == 3)))
        return cls.path(f'stack{dim}.yaml')

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.scenes = {2: cls.stacked(2, odd, lambda c: odd((c[0] + 1, c[1])), [4, 4], [5, 5]), 3: cls.stacked(3, four, odd, [4, 4, 2], [3, 3, 3])}

    def errors(self, scene, model, *points):
        c = self.hyco('compare', '-scene', scene, '-model', model, *points)
        self.assertEqual((c['not_converged'], c['undefined']), (0, 0))
        return {k: c[f'error_{k}']['max'] for k in ('u', 'sigma', 'lambda_rid')}

    def test_ranks(self):
        """The same numbers on any number of ranks, from the .msh and from an .h5 that was written from it."""
        for dim, scene in self.scenes.items():
            one = None
            for ranks, more in ((0, ('-hyco_mesh_write', f'm{dim}.h5')), (2, ()), (3, ()), (0, ('-scene_mesh', f'm{dim}.h5')), (3, ('-scene_mesh', f'm{dim}.h5'))):
                with self.subTest(dim=dim, ranks=ranks, more=more):
                    r = self.hyco('solve', '-scene', scene, '-mu', '0.05,0.09', '-output', 'r.xdmf', *[self.path(a) if '.h5' in a else a for a in more], ranks=ranks)
                    self.solved(r)
                    with h5py.File(self.path('r.h5')) as f:
                        found = [f[k][:] for k in ('nodes/displacement', 'contact/lambda', 'cells/stress', 'nodes/nodal_stress', 'mesh/cells', 'mesh/topology')]
                    if one is None:
                        one = found, r['outputs']
                        self.assertTrue(0 < r['n_active'] < r['n_contacts'])
                    for a, b in zip(found, one[0]):
                        self.assertLess(abs(a - b).max(), 1e-9 * abs(b).max() + 1e-300)
                    for name, value in one[1].items():
                        self.near(r['outputs'][name], value, 1e-9, name)

    def test_property_1(self):
        """The whole mesh as RID: the model gives the full-order solution."""
        for dim, scene in self.scenes.items():
            self.hyco('train', '-scene', scene, '-values_press', '0.05,0.1', '-values_gap', '0.03,0.07', '-model', f'p{dim}.h5', '-hyco_rid_whole', 'true',
                      '-hyco_hybrid', 'all', '-hyco_pod_tol', 0, '-hyco_pod_noise', '1e-14')
            e = self.errors(scene, f'p{dim}.h5', '-values_press', '0.03,0.07', '-values_gap', '0.04,0.08')
            self.assertLess(max(e.values()), 1e-9, (dim, e))

    def test_models(self):
        """Models on a part of the mesh with cells of both types: accurate at unseen points, on any number of ranks the same; predictions show
        the cells by type."""
        scene, grid = self.scenes[2], ('-values_press', '0.02,0.04,0.06,0.08,0.1', '-values_gap', '0.03,0.05,0.07,0.09')
        sizes = []
        for ranks in (0, 3):
            t = self.hyco('train', '-scene', scene, *grid, '-model', f'm{ranks}.h5', '-hyco_hybrid', 'contact', '-hyco_pod_tol', '1e-9', '-hyco_rid_layers', 1,
                          '-hyco_snapshots', f's{ranks}.snapshots', ranks=ranks)
            e = self.errors(scene, f'm{ranks}.h5', '-values_press', '0.03,0.07', '-values_gap', '0.04,0.08')
            self.assertLess(e['u'], 5e-3)
            self.assertLess(e['lambda_rid'], 5e-2)
            with h5py.File(self.path(f'm{ranks}.h5')) as f:
                cells = f['mesh/cells'][:]
                sizes.append((t['n_rid_cells'] if 'n_rid_cells' in t else len(cells), cells.tolist()))
                self.assertTrue(0 < (cells[:, 2] == cells[:, 3]).sum() < len(cells) < len(f['whole/cells']))
        self.assertEqual(sizes[0], sizes[1])
        for kind in ('projection', 'bodies'):
            self.hyco('train', '-scene', scene, *grid, '-model', 'k.h5', '-hyco_model_type', kind, '-hyco_snapshots', 's0.snapshots', '-hyco_pod_tol', '1e-9', status=None)
            self.assertLess(self.errors(scene, 'k.h5', '-values_press', '0.03,0.07', '-values_gap', '0.04,0.08')['u'], 2e-2, kind)
        self.hyco('predict', '-model', 'm0.h5', '-mu', '0.05,0.05', '-output', 'p.xdmf')
        self.shapes('p', {4: 42, 5: 20})

    def shapes(self, name, expected):
        """Checks the numbers of cells by XDMF's type in the file, and that the .xdmf names them."""
        size = {4: 3, 5: 4, 6: 4, 7: 5, 8: 6, 9: 8}
        with h5py.File(self.path(name + '.h5')) as f:
            items, cells = f['mesh/topology'][:], f['mesh/cells'][:]
        at, found = 0, {}
        for cell in cells:
            n = size[items[at]]
            found[int(items[at])] = found.get(int(items[at]), 0) + 1
            self.assertEqual(list(dict.fromkeys(cell.tolist())), items[at + 1:at + 1 + n].tolist())
            at += 1 + n
        self.assertEqual((at, found), (len(items), expected))
        topology = ET.parse(self.path(name + '.xdmf')).getroot().find('.//Topology')
        self.assertEqual((topology.get('TopologyType'), topology.get('NumberOfElements')), ('Mixed', str(len(cells))))
        self.assertEqual(topology.find('DataItem').get('Dimensions'), str(len(items)))

    def test_outputs(self):
        """.xdmf and .vtkhdf with the cells' own types; a picture; the cells by type in hyco check."""
        for dim, types, vtk in ((2, {4: 42, 5: 20}, {5: 3, 9: 4}), (3, None, {10: 4, 12: 8, 13: 6, 14: 5})):
            for ranks in (0, 2):
                for ending in ('xdmf', 'vtkhdf'):
                    self.hyco('solve', '-scene', self.scenes[dim], '-mu', '0.05,0', '-output', f'o.{ending}', ranks=ranks)
                report = self.hyco('check', '-scene', self.scenes[dim], ranks=ranks)
                names = {'tri3': 4, 'quad4': 5, 'tet4': 6, 'pyramid5': 7, 'prism6': 8, 'hex8': 9}
                self.shapes('o', types or {names[k]: n for k, n in report['cell_types'].items()})
                self.assertEqual(len(report['cell_types']), len(vtk))
                with h5py.File(self.path('o.vtkhdf')) as v, h5py.File(self.path('o.h5')) as f:
                    v, cells = v['VTKHDF'], f['mesh/cells'][:]
                    start, items = v['Offsets'][:], v['Connectivity'][:]
                    self.assertEqual([vtk[t] for t in v['Types'][:]], np.diff(start).tolist())
                    self.assertEqual(v['NumberOfConnectivityIds'][0], len(items))
                    for k, cell in enumerate(cells):
                        self.assertEqual(items[start[k]:start[k + 1]].tolist(), list(dict.fromkeys(cell.tolist())))
            run = subprocess.run([os.path.join(SOURCE, 'scripts', 'plot'), 'solution', self.path('o.xdmf'), '-o', self.path('o.png')], capture_output=True, text=True)
            self.assertEqual(run.returncode, 0, run.stderr)
        mesh = plot.Solution(self.path('o.xdmf')).mesh
        x = mesh.xyz[mesh.skin()[0]]
        area = np.linalg.norm(np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1]), axis=1).sum() / 2
        self.near(area, 6 + 8, 1e-12, 'the skin that is drawn: that of the two blocks')

    def test_history(self):
        """A ring that creeps against stops: as on quadrilaterals within the discretisation; the model of the whole ring is full order."""
        found = []
        for name, cut in (('both', odd), ('quads', whole)):
            grid = Grid()
            grid.mixed([np.linspace(1, 2, 5), np.linspace(0, np.pi / 2, 11)], lambda x: np.stack([x[:, 0] * np.cos(x[:, 1]), x[:, 0] * np.sin(x[:, 1])], -1), 'a',
                       {'x0': 'bore', 'y0': 'y0', 'y1': 'y1'}, cut)
            grid.write(self.path(name + '.msh'))
            with open(self.path(name + '.yaml'), 'w', encoding='ascii') as f:
                f.write(CREEP.replace('MESH', name + '.msh'))
            for ranks in (0, 3):
                r = self.hyco('solve', '-scene', self.path(name + '.yaml'), '-mu', '10,1.2', ranks=ranks)
                self.assertLess(max(r['history']['energy_defect']), 1e-8)
                found.append(r['history'])
        self.assertGreater(max(found[0]['n_active']), 0)
        for name in ('total_contact_force', 'stored', 'dissipated'):
            self.near(found[1][name][-1], found[0][name][-1], 1e-7, name)
            self.near(found[0][name][-1], found[2][name][-1], 0.05, name)
        scene = self.path('both.yaml')
        for kind, limit, settings in (('hybrid', 1e-6, ('-grid', '1,1', '-hyco_rid_whole', '-hyco_hybrid', 'all')), ('bodies', 5e-2, ('-grid', '3,3'))):
            self.hyco('train', '-scene', scene, '-model', f'{kind}.h5', '-hyco_model_type', kind, *settings)
            c = self.hyco('compare', '-scene', scene, '-model', f'{kind}.h5', '-mu', '9,1.5')
            self.assertLess(c['worst_u']['max'], limit, kind)

    def test_ties(self):
        """A tied column with both types at the tie is in uniaxial stress; springs act on triangles and quadrilaterals."""
        for dim, cut in ((2, odd), (3, odd), (3, four)):
            grid, up = Grid(), 'xyz'[dim - 1]
            for body, lo, n in (('a', 0, 4), ('b', 1, 4)):
                axes = [*(np.linspace(0, 1, n + 1),) * (dim - 1), np.linspace(lo, lo + 1, 3)]
                grid.mixed(axes, lambda x: x, body, {f'{"xyz"[c]}{e}': f'{body}_{"xyz"[c]}{e}' for c in range(dim) for e in (0, 1)}, cut)
            grid.write(self.path('tied.msh'))
            with open(self.path('tied.yaml'), 'w', encoding='ascii') as f:
                f.write('scene: {mesh: tied.msh, parameters: [p]}\nparameter: {p: {range: [0, 2]}}\nbody: {a: {young: 10}, b: {young: 20}}\n'
                        'fixed: {a_x0: {x: 0}, b_x0: {x: 0}%s}\nspring: {a_%s0: {normal: 5}}\npressure: {b_%s1: p}\ntie: {glue: {slave: b_%s0, master: a_%s1}}\n'
                        % (', a_y0: {y: 0}, b_y0: {y: 0}' * (dim == 3), up, up, up, up))
            for ranks in (0, 3):
                self.solved(self.hyco('solve', '-scene', 'tied.yaml', '-mu', '1', '-output', 't.xdmf', ranks=ranks))
                with h5py.File(self.path('t.h5')) as f:
                    x, u = f['mesh/xyz'][:, dim - 1], f['nodes/displacement'][:, dim - 1]
                for height, exact in ((0, -1 / 5), (2, -1 / 5 - 1 / 10 - 1 / 20)):
                    self.assertLess(abs(u[x == height] - exact).max(), 1e-12, (dim, ranks, height))

    def test_gmsh(self):
        """A drawing that gmsh recombines in part, and the same extruded (4.1 files, a group in blocks by type): the support has the load."""
        plate = ('Point(1) = {0,0,0,0.3}; Point(2) = {2,0,0,0.3}; Point(3) = {1.7,1,0,0.15}; Point(4) = {0,1,0,0.3}; Line(1) = {1,2}; Line(2) = {2,3}; Line(3) = {3,4};'
                 'Line(4) = {4,1}; Curve Loop(1) = {1,2,3,4}; Plane Surface(1) = {1}; Recombine Surface {1}; Mesh.RecombinationAlgorithm = 0;\n')
        flat = 'Physical Surface("block") = {1}; Physical Curve("foot") = {1}; Physical Curve("top") = {3};\n'
        deep = 'e[] = Extrude {0,0,1} {Surface{1}; Layers{2}; Recombine;}; Physical Volume("block") = {e[1]}; Physical Surface("foot") = {e[2]}; Physical Surface("top") = {e[4]};\n'
        for dim, groups, types in ((2, flat, {'tri3', 'quad4'}), (3, deep, {'prism6', 'hex8'})):
            self.drawn(f'drawn{dim}', dim, plate + groups, f'scene: {{mesh: drawn{dim}.msh}}\nbody: {{block: {{young: 100, poisson: 0.3}}}}\n'
                       f'fixed: {{foot: {{x: 0, y: 0{", z: 0" * (dim == 3)}}}}}\npressure: {{top: 2}}\noutput: {{hold: {{reaction: y, group: foot}}}}\n')
            for ranks in (0, 3):
                self.assertEqual(set(self.hyco('check', '-scene', f'drawn{dim}', ranks=ranks)['cell_types']), types)
                report = self.hyco('solve', '-scene', f'drawn{dim}', ranks=ranks)
                self.solved(report)
                self.near(report['outputs']['hold'], 2 * 1.7, 1e-10)

    def test_refused(self):
        """Tetrahedra at a hexahedron's face; pyramids that would be refined; more cells than the machine has memory for: one line with the remedy on each number of ranks."""
        cube = [(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
        msh(self.path('bad.msh'), [*cube, (0.5, 0.5, 2)], [(5, 1, range(1, 9)), (4, 1, (5, 6, 7, 9)), (4, 1, (5, 7, 8, 9))], {1: (3, 'block')})
        with open(self.path('bad.yaml'), 'w', encoding='ascii') as f:
            f.write('scene: {mesh: bad.msh}\nbody: {block: {young: 1}}\n')
        deep = os.path.join(SOURCE, 'examples', 'roller3d')
        for ranks in (0, 3):
            for args, said in ((('bad.yaml',), 'share three of the four nodes of a face'), ((self.scenes[3], '-scene_refine', '1'), 'the mesh has pyramids'),
                               ((deep, '-scene_refine', '12'), 'refine less')):
                run = self.run_raw('check', '-scene', *args, ranks=ranks)
                self.assertEqual((run.returncode, run.stderr.count('hyco: error')), (1, 1), run.stderr)
                self.assertIn(said, run.stderr)

    def test_repeated_nodes(self):
        """Quadrilaterals and hexahedra with repeated nodes, as some programs write triangles and prisms, are those."""
        def moved(nodes, elements):
            return nodes, [(wide[k], tag, repeat[k](c)) if k in wide else (k, tag, c) for k, tag, c in elements]
        wide, repeat = {2: 3, 6: 5}, {2: lambda c: (c[0], c[0], c[1], c[2]), 6: lambda c: (*c[:3], c[2], *c[3:], c[5])}
        for dim in (2, 3):
            grid, energies = Grid(), []
            grid.mixed([np.linspace(0, 1, 4)] * dim, lambda x: x, 'block', {'x0': 'x0', 'x1': 'x1'}, odd)
            for nodes, elements in ((grid.nodes, grid.elements), moved(grid.nodes, grid.elements)):
                msh(self.path('n.msh'), nodes, elements, grid.names)
                with open(self.path('n.yaml'), 'w', encoding='ascii') as f:
                    f.write('scene: {mesh: n.msh, parameters: [p]}\nparameter: {p: {range: [0, 2]}}\nbody: {block: {young: 1, poisson: 0.3}}\n'
                            'fixed: {x0: {x: 0, y: 0%s}}\npressure: {x1: p*y}\n' % (', z: 0' * (dim == 3)))
                energies.append(self.hyco('solve', '-scene', 'n.yaml', '-mu', '1')['strain_energy'])
            self.near(energies[1], energies[0], 1e-12)


if __name__ == '__main__':
    unittest.main()
