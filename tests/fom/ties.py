"""Tied surfaces: patch tests, rigid motions, the order of the error where meshes do not match; contact and supports on them; models; refusals."""
import os
import sys
import unittest

import h5py
import numpy as np

from common import SOURCE, Case

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import Grid  # noqa: E402

KINDS = {'quad4': 2, 'tri3': 2, 'hex8': 3, 'tet4': 3}
MODEL = """
scene: {mesh: mesh.msh, parameters: [push, stiff]}
parameter: {push: {range: [0.1, 0.4]}, stiff: {range: [150, 400]}}
body: {left: {young: 200, poisson: 0.3}, right: {young: stiff, poisson: 0.2, density: 1e-3}, seat: {young: 300, poisson: 0.3}}
fixed: {base: {y: 0}, west: {x: 0}}
spring: {east: {normal: 3, y: 2}}
pressure: {top: push*(1 + x), roof: push/2}
gravity: {y: -9.81}
tie: {glue: {slave: SLAVE, master: MASTER}}
contact: {joint: {type: surface, slave: under, master: over}}
output: {hold: {reaction: y, group: base}, wall: {reaction: x, group: west}, low: {min: u_y}}
"""


def pulled_evenly(case, scene, energy, dim, ranks, atol):
    """Solves a column (Young's modulus 200, its output `pull`) under a pressure of 1.5: reaction, energy and displacement are exact."""
    found = case.hyco('solve', '-scene', scene, '-output', 'out.xdmf', ranks=ranks)
    case.solved(found)
    case.assertLess(found['balance'], 1e-12)
    case.near(found['strain_energy'], energy, 1e-12)
    case.near(found['outputs']['pull'], 1.5, 1e-12)
    with h5py.File(case.path('out.h5')) as f:
        x, u = f['mesh/xyz'][()], f['nodes/displacement'][()]
    np.testing.assert_allclose(u[:, dim - 1], -1.5 / 200 * x[:, dim - 1], atol=atol)


class Ties(Case):
    def column(self, kind, n, m, bend=lambda x: x):
        """Two unit boxes, one on the other, n and m cells each way."""
        dim, grid = KINDS[kind], Grid()
        last, sides = 'xyz'[dim - 1], {f'{a}0': f'{a}0' for a in 'xyz'[:dim - 1]}
        grid.box(kind, [np.linspace(0, 1, n + 1)] * dim, bend, 'low', {**sides, f'{last}0': 'base', f'{last}1': 'over'})
        grid.box(kind, [np.linspace(0, 1, m + 1)] * (dim - 1) + [np.linspace(1, 2, m + 1)], bend, 'high', {**sides, f'{last}0': 'under', f'{last}1': 'top'})
        return grid

    def pulled(self, kind, n, m, p=1.5, E=200, method=''):
        """The scene of uniaxial stress in a column, and its strain energy."""
        dim = KINDS[kind]
        last = 'xyz'[dim - 1]
        planes = ', '.join(f'{a}0: {{{a}: 0}}' for a in 'xyz'[:dim - 1])
        plane = ', formulation: plane_stress' if dim == 2 else ''
        text = (f'scene: {{mesh: mesh.msh{plane}}}\nbody: {{low: {{young: {E}, poisson: 0.3}}, high: {{young: {E}, poisson: 0.3}}}}\n'
                f'fixed: {{{planes}, base: {{{last}: 0}}}}\npressure: {{top: {p}}}\ntie: {{glue: {{slave: under, master: over{method}}}}}\n'
                f'output: {{pull: {{reaction: {last}, group: base}}}}\n')
        return self.written(text, self.column(kind, n, m)), p * p * 2 / 2 / E

    def test_patch(self):
        """Uniform stress is transmitted where the slave's mesh is the master's or divides it; supports and slaves share nodes."""
        for kind, n, m, ranks in (('quad4', 3, 3, 0), ('tri3', 2, 4, 3), ('hex8', 2, 4, 2), ('tet4', 2, 2, 0), ('tet4', 1, 3, 2)):
            scene, energy = self.pulled(kind, n, m)
            with self.subTest(kind=kind, n=n, m=m):
                pulled_evenly(self, scene, energy, KINDS[kind], ranks, 1e-14)

    def test_mean(self):
        """Uniform stress is transmitted between meshes of any ratio; tied nodes on planes of symmetry follow their nearest points."""
        for kind, n, m, ranks in (('quad4', 5, 7, 2), ('quad4', 10, 7, 0), ('tri3', 3, 2, 3), ('hex8', 2, 3, 2), ('hex8', 4, 3, 0), ('tet4', 3, 4, 3), ('tet4', 3, 2, 0)):
            scene, energy = self.pulled(kind, n, m)
            with self.subTest(kind=kind, n=n, m=m):
                pulled_evenly(self, scene, energy, KINDS[kind], ranks, 1e-13)

    def test_corners(self):
        """A triangle all of whose nodes are on two planes of symmetry leaves its forces to the facets beside it."""
        scene, energy = self.pulled('tet4', 3, 2)
        grid = Grid()
        for name, n, z, low, high in (('low', 3, 0, 'base', 'over'), ('high', 2, 1, 'under', 'top')):
            grid.box('tet4', [np.linspace(0, 1, n + 1)] * 2 + [z + np.linspace(0, 1, n + 1)], lambda x: x, name,
                     {'x1': 'x0', 'y0': 'y0', 'z0': low, 'z1': high})
        with open(self.path('scene.yaml'), encoding='utf-8') as f:
            text = f.read()
        pulled = self.hyco('solve', '-scene', self.written(text, grid))
        self.solved(pulled)
        self.near(pulled['strain_energy'], energy, 1e-12)
        self.near(pulled['outputs']['pull'], 1.5, 1e-12)

    def test_not_matching(self):
        """Nearest points, meshes of any ratio: resultants are exact, the energy's error is small and decreases with the facets."""
        for kind, ranks in (('quad4', 2), ('hex8', 0)):
            errors = []
            for k in (1, 2):
                scene, energy = self.pulled(kind, 3 * k, 4 * k, method=', method: collocation')
                found = self.hyco('solve', '-scene', scene, ranks=ranks)
                self.solved(found)
                self.near(found['outputs']['pull'], 1.5, 1e-12)
                errors.append(found['strain_energy'] / energy - 1)
            self.assertLess(errors[0], 2e-3)
            self.assertLess(errors[1], 0.6 * errors[0])

    def test_rigid(self):
        """Bodies on a curved surface that their meshes cut differently: held at one, a turn moves both without strain."""
        grid, arc = Grid(), lambda x: np.stack([x[:, 0] * np.cos(x[:, 1]), x[:, 0] * np.sin(x[:, 1])], -1)
        grid.box('quad4', [np.linspace(1, 2, 4), np.linspace(0, 1, 4)], arc, 'inner', {'x0': 'bore', 'x1': 'out'})
        grid.box('quad4', [np.linspace(2, 3, 4), np.linspace(0, 1, 6)], arc, 'outer', {'x0': 'in', 'x1': 'rim'})
        text = ('scene: {mesh: mesh.msh}\nbody: {inner: {young: 200}, outer: {young: 200}}\nfixed: {bore: {x: 0.1 - 0.02*y, y: 0.02*x}}\n'
                'tie: {glue: {slave: in, master: out, tolerance: 0.1}}\n')
        for ranks in (0, 2):
            found = self.hyco('solve', '-scene', self.written(text, grid), '-output', 'out.xdmf', ranks=ranks)
            self.assertLess(found['strain_energy'], 1e-25)
            with h5py.File(self.path('out.h5')) as f:
                x, u = f['mesh/xyz'][()], f['nodes/displacement'][()]
            rest = np.arange(len(x)) < 16  # the inner body's; of the outer one those that are not tied
            rest |= np.hypot(x[:, 0], x[:, 1]) > 2.1
            self.assertEqual(np.sum(rest), 34)
            np.testing.assert_allclose(u[rest, :2], np.stack([0.1 - 0.02 * x[:, 1], 0.02 * x[:, 0]], -1)[rest], atol=1e-13)

    def blocks(self, n=(3, 4), bend=lambda x: x):
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 2, 9), np.linspace(0, 1, 4)], bend, 'seat', {'y0': 'base', 'y1': 'over', 'x0': 'west'})
        grid.box('quad4', [np.linspace(0, 1, 7), np.linspace(1, 2, n[0] + 1)], bend, 'left', {'y0': 'under', 'y1': 'top', 'x0': 'west', 'x1': 'seam'})
        grid.box('quad4', [np.linspace(1, 2, 6), np.linspace(1, 2, n[1] + 1)], bend, 'right', {'y0': 'under', 'y1': 'roof', 'x0': 'edge', 'x1': 'east'})
        return grid

    def test_models(self):
        """Contact, loads, springs and weight across a tie, on one and two ranks, iteratively; every type of model against full order."""
        scene = self.written(MODEL.replace('SLAVE', 'seam').replace('MASTER', 'edge, method: collocation'), self.blocks())
        full = [self.hyco('solve', '-scene', scene, '-mu', '0.27,310', *more, ranks=ranks)
                for ranks, more in ((0, ()), (2, ()), (3, ()), (2, ('-hyco_linear', 'iterative')))]
        for found in full:
            self.solved(found)
            self.assertLess(found['balance'], 1e-9)
            for name in ('strain_energy', 'total_contact_force', 'lambda_max'):
                self.near(found[name], full[0][name], 1e-8, name)
        for kind, bound in (('hybrid', 0.01), ('projection', 0.01), ('bodies', 1e-3), ('regression', 0.02)):
            with self.subTest(kind=kind):
                self.hyco('train', '-scene', scene, '-grid', '4,4', '-grid_type', 'centred', '-model', 'm.h5', '-hyco_model_type', kind, '-hyco_pod_tol', 1e-11,
                          *(('-hyco_rid_layers', 1, '-hyco_rid_modes', 'displacement,stress,force,dual') if kind == 'hybrid' else ()))
                found = [self.hyco('compare', '-scene', scene, '-model', 'm.h5', '-grid', '3,3', ranks=ranks) for ranks in (0, 2)]
                for report in found:
                    self.assertLess(report['error_u']['max'], bound)
                    self.assertLess(report['error_u_h1']['max'], 5 * bound)
                self.assertLess(abs(found[1]['error_u']['max'] - found[0]['error_u']['max']), 1e-4 * found[0]['error_u']['max'] + 1e-12)
                # reactions of the projection-based model do not balance its contact forces
                model = self.hyco('predict', '-model', 'm.h5', '-mu', '0.27,310', '-output', 'model.xdmf', status=3 * (kind == 'projection'))
                for name, value in full[0]['outputs'].items():
                    self.near(model['outputs'][name], value, 10 * bound, name)
                with h5py.File(self.path('model.h5')) as f:
                    x, u = f['mesh/xyz'][()], f['nodes/displacement'][()]
                seam = [np.argsort(x[part, 1]) + start for part, start in ((slice(36, 64), 36), (slice(64, None), 64))]
                seam = [k[np.isclose(x[k, 0], 1)] for k in seam]  # the left body's and the right's, from below
                for c in (0, 1):
                    np.testing.assert_allclose(u[seam[0], c], np.interp(x[seam[0], 1], x[seam[1], 1], u[seam[1], c]), atol=1e-12)

    def test_moved(self):
        """A map that moves both bodies in the same way keeps the tie; one that separates them is refused."""
        grid = self.column('quad4', 3, 4)
        for maps, height in (('low: {map: {y: h*y}}, high: {map: {y: h*y}}', 2.4), ('low: {map: {y: h*y}}, high: {map: {y: y + h - 1}}', 2.2)):
            text = ('scene: {mesh: mesh.msh, parameters: [h], formulation: plane_stress}\nparameter: {h: {range: [1, 2]}}\nbody_low_young: 200\n'
                    f'body_high_young: 200\nbody: {{{maps}}}\nfixed: {{x0: {{x: 0}}, base: {{y: 0}}}}\ntie: {{glue: {{slave: under, master: over}}}}\npressure: {{top: 1}}\n')
            found = self.hyco('solve', '-scene', self.written(text, grid), '-mu', '1.2')
            self.near(found['strain_energy'], height / 2 / 200, 2e-3)
        run = self.run_raw('solve', '-scene', self.written(text.replace('h - 1', '2*h - 2'), grid), '-mu', '1.2', ranks=2)
        self.assertEqual(run.returncode, 1)
        self.assertIn('maps move node', run.stderr)
        self.assertEqual(run.stderr.count('hyco: error'), 1, run.stderr)

    def test_oblique(self):
        """A tie that ends at an oblique plane of symmetry: a ring's sector of two layers, whose slave divides the master."""
        energy = {}
        for degrees, n in ((90, 6), (30, 2)):
            a = np.radians(degrees)
            grid, arc = Grid(), lambda x: np.stack([x[:, 0] * np.cos(x[:, 1]), x[:, 0] * np.sin(x[:, 1])], -1)
            grid.box('quad4', [np.linspace(1, 2, 4), np.linspace(0, a, n + 1)], arc, 'inner', {'x0': 'bore', 'x1': 'out', 'y0': 'y0', 'y1': 'y1'})
            grid.box('quad4', [np.linspace(2, 3, 4), np.linspace(0, a, 2 * n + 1)], arc, 'outer', {'x0': 'in', 'y0': 'y0', 'y1': 'y1'})
            text = ('scene: {mesh: mesh.msh}\nbody: {inner: {young: 200, poisson: 0.3}, outer: {young: 100, poisson: 0.3}}\npressure: {bore: 1}\n'
                    f'fixed: {{y0: {{y: 0}}, y1: {{normal: 0, direction: {{x: {-np.sin(a):.17g}, y: {np.cos(a):.17g}}}}}}}\n'
                    'tie: {glue: {slave: in, master: out, tolerance: 0.1}}\n')
            for ranks in (0, 2):
                found = self.hyco('solve', '-scene', self.written(text, grid), ranks=ranks)
                self.solved(found)
                self.assertLess(found['balance'], 1e-9)
                energy[degrees] = found['strain_energy']
        self.near(3 * energy[30], energy[90], 1e-9)

    def test_refused(self):
        """Ties with wrong groups, bodies or distances are refused."""
        base = ('scene: {mesh: mesh.msh}\nbody: {low: {young: 200}, high: {young: 200}}\nfixed: {base: {x: 0, y: 0}}\n')
        tie = 'tie: {glue: {slave: under, master: over}}\n'
        for text, said in (('tie: {glue: {slave: under}}', 'tie glue has no master'), ('tie: {glue: {slave: under, master: under}}', 'are the same group'),
                           ('tie: {glue: {slave: under, master: nowhere}}', 'no group "nowhere"'), ('tie: {glue: {slave: under, mastre: over}}', 'a tie has: slave, master'),
                           ('tie: {glue: {slave: under, master: low}}', 'must be a group of dimension 1'), ('tie: {glue: {slave: top, master: over}}', '5 of the 5 nodes of top have no point'),
                           ('tie: {glue: {slave: under, master: over, tolerance: wide}}', 'must be a length'),
                           ('tie: {glue: {slave: under, master: over, method: morta}}', 'must be mortar or collocation'),
                           (tie + 'fixed_under_x: 0', 'are not fixed in the same way'), (tie + 'fixed_under_normal: 0\nfixed_under_direction_x: 1', 'are not fixed in the same way'),
                           (tie + 'contact: {c: {group: under, normal: {x: 1}, gap: 1}}', 'do not have this contact'),
                           (tie + 'contact: {c: {type: surface, slave: over, master: under}}', 'exchange slave and master of the tie'),
                           (tie + 'scene_refine: 1', 'cannot refine a mesh with ties'),
                           (tie + 'tie_back_slave: over\ntie_back_master: under', 'is itself a slave of the tie')):
            for ranks in (0, 2):
                run = self.run_raw('solve', '-scene', self.written(base + text + '\n', self.column('quad4', 3, 4)), ranks=ranks)
                with self.subTest(text=text, ranks=ranks):
                    self.assertEqual(run.returncode, 1, run.stdout)
                    self.assertEqual(run.stderr.count('hyco: error'), 1, run.stderr)
                    self.assertIn(said, run.stderr)
        run = self.run_raw('train', '-scene', self.written(MODEL.replace('SLAVE', 'seam').replace('MASTER', 'edge'), self.blocks()), '-grid', '2,2',
                           '-model', 'm.h5', '-hyco_model_type', 'cubature')
        self.assertIn('cubature is for scenes without ties', run.stderr)


if __name__ == '__main__':
    unittest.main()
