"""A rigid body in space, on cells of second order: as the obstacle moved by as much; forces of models that push; what check says; what is refused."""
import os
import sys
import unittest

import h5py
import numpy as np

from common import SOURCE, Case, msh

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import LINEAR, Grid, second  # noqa: E402

SCENE = """
scene: {mesh: mesh.msh, parameters: [load, radius]}
parameter: {load: {range: [0, 30]}, radius: {range: [8, 12]}}
body: {block: {young: 1000, poisson: 0.3}, tool: {young: 1}}
fixed: {west: {x: 0}, south: {y: 0}, base: {z: 0}, tool: {x: 0, y: 0}}
force: {tip: {z: -load}}
spring: {tip: {z: 1e-3}}
contact: {punch: {type: rigid, slave: top, master: tip, gap: (x^2+y^2)/(2*radius)}}
output: {depth: {min: u_z, group: tip}, push: {force: z, contact: punch}, turn: {moment: y, contact: punch}}
"""


class RigidSpace(Case):
    @classmethod
    def mesh(cls, kind):
        """A quarter of a block under the plane z = 0, and a cell beside it whose first node is the group tip."""
        grid, axis = Grid(), 4 * np.linspace(0, 1, 5)**1.5
        grid.box(LINEAR[kind], [axis, axis, np.array([-4, -1.5, 0])], lambda x: x, 'block', {'x0': 'west', 'y0': 'south', 'z0': 'base', 'z1': 'top'})
        grid.tool(LINEAR[kind], [np.array([6., 7.]), np.array([0., 1.]), np.array([0., 1.])])
        msh(cls.path('mesh.msh'), *second(grid, kind))

    @classmethod
    def scene(cls, name='scene.yaml', *changes):
        return cls.changed(name, SCENE, changes)

    def test_moved_obstacle(self):
        """With and without a spring on the body; check counts its motion as no mistake, and says which cells were read."""
        free = self.scene('free.yaml', ('spring: {tip: {z: 1e-3}}\n', ''))
        given = self.scene('given.yaml', ('type: rigid, slave: top, master: tip, gap: (x^2+y^2)/(2*radius)', 'group: top, normal: {z: 1}, gap: (x^2+y^2)/(2*radius) - depth'),
                           ('tool: {x: 0, y: 0}', 'tool: {x: 0, y: 0, z: 0}'), ('[load, radius]', '[depth, radius]'), ('depth: {min: u_z, group: tip}, ', ''),
                           ('force: {tip: {z: -load}}\nspring: {tip: {z: 1e-3}}\n', ''), ('load: {range: [0, 30]}', 'depth: {range: [0, 1]}'))
        for kind in ('tet10', 'hex20'):
            self.mesh(kind)
            found = [self.hyco('solve', '-scene', free, '-mu', '20,10', ranks=ranks) for ranks in (0, 2)]
            moved = self.hyco('solve', '-scene', given, '-mu', f'{-found[0]["outputs"]["depth"]:.17g},10')
            with self.subTest(kind=kind):
                for report in found:
                    self.solved(report)
                    self.assertLess(report['balance'], 1e-9)
                    np.testing.assert_allclose(report['contacts']['punch']['force'], [0, 0, -20], atol=1e-9)
                    for name in ('strain_energy', 'lambda_max', 'n_active', 'total_contact_force'):
                        self.near(report[name], moved[name], 1e-8, name)
                    self.near(report['outputs']['turn'], moved['outputs']['turn'], 1e-7, 'moment')
                checked = self.hyco('check', '-scene', free)
                self.assertEqual((checked['n_warnings'], len(checked['free_motions'])), (0, 1))
                self.assertEqual((checked['cell_type'], checked['hex20_as_hex27']), ('hex27', True) if kind == 'hex20' else ('tet10', False))
                self.assertEqual('hex20' in self.run_raw('check', '-scene', free).stdout, kind == 'hex20')

    def test_models(self):
        """At unseen points, without a load too: no force pulls, their sum is the load, and the body's depth is full order's."""
        for kind, types in (('tet10', ('hybrid', 'bodies')), ('hex20', ('hybrid', 'cubature'))):
            self.mesh(kind)
            scene = self.scene()
            for of in types:
                self.hyco('train', '-scene', scene, '-grid', '4,3', '-model', 'm.h5', '-hyco_model_type', of, '-hyco_pod_tol', 1e-12, '-hyco_snapshots', kind,
                          *(('-hyco_rid_layers', 1) if of == 'hybrid' else ()))
                for load, radius in ((0, 9), (3, 11.3), (26, 8.7)):
                    full = self.hyco('solve', '-scene', scene, '-mu', f'{load},{radius}')['outputs']
                    model = self.hyco('predict', '-model', 'm.h5', '-mu', f'{load},{radius}', '-output', 'fields.xdmf')['outputs']
                    with h5py.File(self.path('fields.h5')) as f:
                        force = f['contact/lambda'][:, 0]
                    with self.subTest(kind=kind, type=of, load=load):
                        self.assertGreaterEqual(force.min(), 0)
                        for name, size in (('depth', 0.1), ('push', 30), ('turn', 30)):
                            self.assertLess(abs(model[name] - full[name]), 5e-3 * size, name)

    def test_refused(self):
        """A rotation cannot be asked for: neither as an entry of the contact nor as a component or a moment of the node."""
        self.mesh('tet10')
        for old, new, said in (('type: rigid,', 'type: rigid, rotation: 1,', 'rotation'), ('tool: {x: 0, y: 0}', 'tool: {x: 0, y: 0, rz: 0}', 'rz'),
                               ('tip: {z: -load}', 'tip: {z: -load, moment: 1}', 'moment')):
            run = self.run_raw('solve', '-scene', self.scene('bad.yaml', (old, new)), '-mu', '20,10')
            with self.subTest(new=new):
                self.assertEqual(run.returncode, 1, run.stdout)
                self.assertEqual(run.stderr.count('\n'), 1, run.stderr)
                self.assertIn(said, run.stderr)


if __name__ == '__main__':
    unittest.main()
