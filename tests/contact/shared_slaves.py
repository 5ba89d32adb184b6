"""Nodes that are slaves of two or three contacts: a block in a corner, in a V-groove; each contact has its own force there, at full order and in models."""
import os
import sys
import unittest

import h5py
import numpy as np

from common import SOURCE, Case

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import Grid  # noqa: E402

MODEL = """
scene: {mesh: mesh.msh, parameters: [push, wedge]}
parameter: {push: {range: [0.5, 2]}, wedge: {range: [-0.002, 0.002]}}
body: {block: {young: 200, poisson: 0.3}}
spring: {x1: {x: 3, y: 3}, y1: {x: 3, y: 3}}
pressure: {x1: push*(1 + x), y1: 1 + x^2}
contact:
  left: {group: x0, gap: "max(wedge, 0)*abs(x)"}
  right: {group: y0, gap: "-min(wedge, 0)*abs(y)"}
"""

PARTS = """
scene: {mesh: mesh.msh, parameters: [press]}
parameter: {press: {range: [0.03, 0.06]}}
body: {block: {young: 200, poisson: 0.3}}
fixed: {y1: {y: -press, x: 0}}
contact: {%s}
output: {least: {min: contact_pressure, contact: a, group: left}, most: {max: contact_pressure, contact: a, group: left}, part: {force: y, contact: a, group: left}, all: {force: y}}
"""


class Corners(Case):
    def block(self, kind, angle, n=4):
        """The unit square or cube, turned about its corner."""
        dim = 3 if kind in ('hex8', 'tet4') else 2
        c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
        turn = np.eye(dim)
        turn[:2, :2] = [[c, s], [-s, c]]
        grid = Grid()
        grid.box(kind, [np.linspace(0, 1, n + 1)] * dim, lambda x: x @ turn, 'block', {f'{a}{e}': f'{a}{e}' for a in 'xyz'[:dim] for e in '01'})
        grid.write(self.path('mesh.msh'))

    def test_uniform(self):
        """Pressed on the other faces: the contacts have these pressures, the corner node its share of each face."""
        n = 4
        for kind, angle, ranks in (('quad4', 0, 0), ('quad4', 45, 3), ('tri3', 30, 0), ('hex8', 0, 2), ('hex8', 45, 0)):
            faces = 'xyz' if kind == 'hex8' else 'xy'
            self.block(kind, angle, n)
            load = {a: 1.5 + k for k, a in enumerate(faces)}
            text = ('scene: {mesh: mesh.msh}\nbody: {block: {young: 200, poisson: 0.3}}\npressure: {%s}\ncontact: {%s}\n'
                    % (', '.join(f'{a}1: {p}' for a, p in load.items()), ', '.join(f'{a}: {{group: {a}0, gap: 0}}' for a in faces)))
            with self.subTest(kind=kind, angle=angle):
                found = self.hyco('solve', '-scene', self.written(text), '-output', 'out.xdmf', ranks=ranks)
                self.solved(found)
                self.assertTrue(found['forces_unique'])
                for a, p in load.items():
                    self.near(np.linalg.norm(found['contacts'][a]['force']), p, 1e-8, a)
                with h5py.File(self.path('out.h5')) as f:
                    forces = f['contact/lambda'][:, 0][f['contact/node_id'][:, 0] == 1]
                share = sorted(p / n**(len(faces) - 1) / 2**(len(faces) - 1) for p in load.values())
                np.testing.assert_allclose(sorted(forces), share, rtol=1e-7)

    def test_models(self):
        """In a V-groove whose sides open in turn: forces of both contacts at the node, compared with full order at other points."""
        self.block('quad4', 45, 6)
        scene = self.written(MODEL)
        bounds = {'hybrid': 0.05, 'bodies': 1e-4, 'projection': 0.05}
        for kind, bound in bounds.items():
            for more in (('contact', 'all') if kind == 'hybrid' else (None,)):
                with self.subTest(kind=kind, hybrid=more):
                    self.hyco('train', '-scene', scene, '-grid', '5,5', '-model', 'm.h5', '-hyco_model_type', kind, '-hyco_pod_tol', 1e-11,
                              *(('-hyco_hybrid', more, '-hyco_rid_layers', 1) if more else ()), *(('-hyco_dual', 'snapshots') if kind == 'projection' else ()))
                    found = self.hyco('compare', '-scene', scene, '-model', 'm.h5', '-grid', '4,4')
                    self.assertLess(found['error_u']['max'], min(bound, 0.05))
                    if kind == 'projection':  # its forces, of all training points, are smeared between them
                        continue
                    self.assertLess(found['error_lambda']['max'], bound)
                    self.hyco('solve', '-scene', scene, '-mu', '1.3,0', '-output', 'full.xdmf')
                    self.hyco('predict', '-model', 'm.h5', '-mu', '1.3,0', '-output', 'model.xdmf')
                    with h5py.File(self.path('full.h5')) as a, h5py.File(self.path('model.h5')) as b:
                        at = a['contact/node_id'][:, 0] == 1
                        self.assertEqual(at.sum(), 2)
                        full, model = a['contact/lambda'][:, 0], b['contact/lambda'][:, 0]
                        self.assertGreater(full[at].min(), 0.01 * full.max())
                        np.testing.assert_allclose(model[at], full[at], atol=bound * full.max())

    def crowned(self, n=8):
        """The unit square with a curved underside, y0, of two parts, left and right, which share the node in the middle."""
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 1, n + 1)] * 2, lambda x: x + np.stack([0 * x[:, 0], 0.1 * (x[:, 0] - 0.5)**2 * (1 - x[:, 1])], -1), 'block',
                 {'y0': 'y0', 'y1': 'y1'})
        for nodes in [e[2] for e in grid.elements if grid.names[e[1]][1] == 'y0']:
            grid.elements.append((1, grid._tag('left' if grid.nodes[nodes[0] - 1][0] < 0.499 else 'right', 1), nodes))
        grid.write(self.path('mesh.msh'))

    def test_part(self):
        """Outputs of the part of a contact at a group's nodes are those of its nodes in the fields, at full order on 1 and 3 ranks and in models."""
        self.crowned()
        scene = self.written(PARTS % 'a: {group: y0, gap: y}')
        runs = [self.hyco('solve', '-scene', scene, '-mu', 0.053, '-output', 'out.xdmf', ranks=ranks) for ranks in (0, 3)]
        with h5py.File(self.path('out.h5')) as f:
            force, tag, pressure = (f[name][:, 0] for name in ('contact/lambda', 'contact/node_id', 'nodes/contact_pressure'))
        pressure = pressure[9 * np.arange(5)]  # of the nodes of left
        for kind, *more in (('bodies',), ('hybrid', '-hyco_rid_whole', 'true', '-hyco_hybrid', 'all')):
            self.hyco('train', '-scene', scene, '-grid', 4, '-model', 'm.h5', '-hyco_model_type', kind, *more)
            runs.append(self.hyco('predict', '-model', 'm.h5', '-mu', 0.053))
        for out in (run['outputs'] for run in runs):
            self.near(out['least'], pressure.min(), 1e-6)
            self.near(out['most'], pressure.max(), 1e-6)
            self.near(out['part'], out['all'] / 2 + force[tag == 37][0] / 2, 1e-3)  # the middle's as a whole
        self.assertGreater(runs[0]['outputs']['least'], 0)
        for name, said in (('left', ''), ('y1', 'no node of the group y1 is a slave of the contact a')):
            run = self.run_raw('check', '-scene', scene, '-output_part_group', name, ranks=2)
            self.assertEqual(run.returncode, 1 if said else 0, run.stderr)
            self.assertIn(said, run.stderr)

    def test_divided(self):
        """Two contacts that divide a smooth surface are refused, with what to do: one of them would carry a shared node's force over its part of the area."""
        self.crowned()
        scene = self.written(PARTS % 'a: {group: left, gap: y}, b: {group: right, gap: y}')
        for command, ranks in (('solve', 0), ('solve', 3), ('check', 0)):
            run = self.run_raw(command, '-scene', scene, *(('-mu', 0.053) if command == 'solve' else ()), ranks=ranks)
            self.assertEqual((run.returncode, run.stderr.count('hyco: error')), (1, 1), run.stderr)
            self.assertIn('1 node is a slave of the contacts a and b, whose normals there differ by less than 30 degrees', run.stderr)
            self.assertIn('outputs may name a group of it', run.stderr)

    def test_refused(self):
        """Contacts whose normals are parallel, and more than a node has free displacements."""
        self.block('quad4', 0)
        base = 'scene: {mesh: mesh.msh}\nbody: {block: {young: 200}}\npressure: {x1: 1, y1: 1}\n'
        for text, said in (('contact: {a: {group: x0, gap: 0}, b: {group: y0, gap: 0, normal: {x: -1, y: -0.2}}}', '1 node is a slave of the contacts a and b'),
                           ('contact: {a: {group: x0, gap: 0, normal: {x: -1, y: -0.2}}, b: {group: y0, gap: 0, normal: {x: -1, y: -0.2001}}}', 'whose normals there are parallel'),
                           ('fixed: {y0: {y: 0}}\ncontact: {a: {group: x0, gap: 0}, b: {group: y0, gap: 0}}', 'a slave of 2 contacts, among them a and b, and has 1 free')):
            for ranks in (0, 2):
                run = self.run_raw('solve', '-scene', self.written(base + text + '\n'), ranks=ranks)
                self.assertEqual(run.returncode, 1, run.stdout)
                self.assertEqual(run.stderr.count('hyco: error'), 1, run.stderr)
                self.assertIn(said, run.stderr)


if __name__ == '__main__':
    unittest.main()
