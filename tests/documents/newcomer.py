"""A new scene, written from docs/tutorial.md and docs/scenes.md only: plane stress, named constants, gravity, an oblique support, springs on a
list of groups, a point load, a surface contact under a mapped body beside an obstacle of a single node, outputs, units; meshed, checked, solved,
trained, predicted, compared."""
import unittest

import h5py

from common import Case

GEO = """// A shelf with a slanted end against a wall, over a post, with a stop under its tip. mm.
Point(1) = {0, 0, 0};
Point(2) = {60, 0, 0};
Point(3) = {60, 10, 0};
Point(4) = {10, 10, 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
Transfinite Curve {1, 3} = 31;
Transfinite Curve {2, 4} = 6;
Transfinite Surface {1};

Point(11) = {20, -15, 0};
Point(12) = {30, -15, 0};
Point(13) = {30, 0, 0};
Point(14) = {20, 0, 0};
Line(11) = {11, 12};
Line(12) = {12, 13};
Line(13) = {13, 14};
Line(14) = {14, 11};
Curve Loop(11) = {11, 12, 13, 14};
Plane Surface(11) = {11};
Transfinite Curve {11, 13} = 5;
Transfinite Curve {12, 14} = 6;
Transfinite Surface {11};
Recombine Surface {1, 11};

Physical Surface("shelf") = {1};
Physical Surface("post") = {11};
Physical Curve("wall") = {4};
Physical Curve("under") = {1};
Physical Curve("tip") = {2};
Physical Curve("top") = {3};
Physical Curve("post_top") = {13};
Physical Curve("post_foot") = {11};
Physical Curve("post_left") = {14};
Physical Curve("post_right") = {12};
Physical Point("hook") = {3};
Physical Point("corner") = {2};
"""
SCENE = """scene:
  title: shelf against a slanted wall, over a post and a stop
  mesh: shelf.msh
  formulation: plane_stress
  parameters: [load, clearance, thickness]
  unit: {length: mm, force: N, stress: MPa}
parameter:
  load: {range: [1, 5], unit: N}                # hung on the tip
  clearance: {range: [0.02, 0.2], unit: mm}     # between the tip and the stop
  thickness: {range: [9, 11], unit: mm}         # of the shelf
constant: {wood: 900, steel: 200*wood, heavy: 7e-10}
body:
  shelf: {young: wood, poisson: 0.3, density: heavy, map: {y: y*thickness/10}}
  post: {young: steel, poisson: 0.3, density: 11*heavy}
fixed:
  wall: {normal: 0, direction: {x: 1, y: -1}}
  post_foot: {x: 0, y: 0}
spring:
  tip: {x: 2}                                   # a rubber strip that holds the shelf along
  "post_left,post_right": {x: 0.5}
gravity: {y: -9810}
force:
  hook: {y: -load}
pressure: {top: 0.002}
contact:
  rest: {type: surface, slave: under, master: post_top, tolerance: 1}
  stop: {group: corner, normal: {y: -1}, gap: clearance}
output:
  sag: {min: u_y, group: tip}
  peak: {max: mises, group: shelf}
  foot: {reaction: y, group: post_foot}
"""
LOAD, THICKNESS = 3, 10.5


class Newcomer(Case):
    newcomer = True

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.drawn('shelf', 2, GEO, SCENE)

    def test_all(self):
        """The shelf: checked, solved, trained and predicted."""
        check = self.hyco('check', '-scene', 'shelf')
        self.assertEqual(check['n_warnings'], 0)
        point = ['-mu', f'{LOAD},0.1,{THICKNESS}']
        full = self.hyco('solve', '-scene', 'shelf', *point, '-output', 'full.vtkhdf')
        self.solved(full)
        # the supports carry the weight and the loads: per unit thickness, 9810 mm/s^2
        weight = 9810 * 7e-10 * (550 * THICKNESS / 10 + 11 * 150) + LOAD + 0.002 * 50
        up = full['supports']['post_foot']['force'][1] + full['supports']['wall']['force'][1] + full['contacts']['stop']['force'][1]
        self.near(up, weight, 1e-10, 'vertical forces')
        # the frictionless wall pushes along (1, -1); only springs hold the shelf along x
        wall = full['supports']['wall']['force']
        self.near(wall[0], -wall[1], 1e-10, 'the oblique support')
        self.near(full['springs']['tip']['force'][0], -wall[0], 1e-10, 'the spring at the tip')
        self.assertEqual([c['n_active'] > 0 for c in full['contacts'].values()], [True, True])
        post = full['supports']['post_foot']['force'][1] - 9810 * 7e-10 * 11 * 150
        self.near(full['contacts']['rest']['force'][1], post, 1e-10, 'what the post bears')
        self.near(full['outputs']['foot'], full['supports']['post_foot']['force'][1], 1e-10, 'a reaction as an output')
        with h5py.File(self.path('full.vtkhdf')) as f:
            self.near(f['VTKHDF/PointData/displacement'][:, 1].min(), full['u_min'][1], 1e-12, 'the lowest point')
            self.assertEqual(f['VTKHDF/CellData/mises'].attrs['unit'], b'MPa')
        trained = self.hyco('train', '-scene', 'shelf', '-hyco_model_type', 'bodies', '-grid', '8,4,3', '-grid_type', 'chebyshev', '-model', 'shelf.h5')
        self.assertNotIn('missed', trained)
        low = self.hyco('predict', '-model', 'shelf.h5', *point)
        for name in ('total_contact_force', 'lambda_max'):
            self.near(low[name], full[name], 1e-2, name)
        for name in ('sag', 'peak', 'foot'):
            self.near(low['outputs'][name], full['outputs'][name], 2e-2, name)
        errors = self.hyco('compare', '-scene', 'shelf', '-model', 'shelf.h5', '-grid', '3,3,2')
        self.assertLess(errors['error_u']['max'], 2e-3)
        self.assertLess(errors['error_lambda']['max'], 1e-2)


if __name__ == '__main__':
    unittest.main()
