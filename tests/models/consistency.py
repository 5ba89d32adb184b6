"""Predictions agree with themselves: displacements that follow the contact forces wherever a contact closes, and what is said where they do not."""
import csv
import os
import unittest

from common import SOURCE, Case, square

ROLLER = os.path.join(SOURCE, 'examples', 'roller')

# A cantilever of quad8 cells over a round bump that stands anywhere below it: one or two of its 241 nodes touch, each in a small part of the range
ARM = """
Point(1) = {0, 0, 0}; Point(2) = {24, 0, 0}; Point(3) = {24, 2, 0}; Point(4) = {0, 2, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};
Curve Loop(1) = {1:4}; Plane Surface(1) = {1};
Transfinite Curve {1, 3} = 121; Transfinite Curve {2, 4} = 4; Transfinite Surface {1}; Recombine Surface {1};
Mesh.SecondOrderIncomplete = 1;
Physical Surface("arm") = {1}; Physical Curve("root") = {4}; Physical Curve("under") = {1}; Physical Curve("tip") = {2};
"""
SCENE = """
scene: {title: arm over a bump, mesh: arm.msh, parameters: [place, thick]}
parameter: {place: {range: [11, 22]}, thick: {range: [1.6, 2.4]}}
body: {arm: {young: 2500, poisson: 0.35, map: {y: y*thick/2}}}
fixed: {root: {x: 0, y: 0}}
contact: {ride: {type: obstacle, group: under, normal: {y: -1}, gap: "(x-place)^2/36 - 0.3"}}
output: {push: {force: y, contact: ride}, tip: {mean: u_y, group: tip}}
"""


# A rail in two parts, of which one is a group of its own too, under a shoe that travels
PARTS = """
Point(1) = {0, 0, 0}; Point(2) = {4, 0, 0}; Point(3) = {12, 0, 0}; Point(4) = {12, 4, 0}; Point(5) = {4, 4, 0}; Point(6) = {0, 4, 0};
Line(1) = {1, 2}; Line(2) = {2, 5}; Line(3) = {5, 6}; Line(4) = {6, 1}; Line(5) = {2, 3}; Line(6) = {3, 4}; Line(7) = {4, 5};
Curve Loop(1) = {1, 2, 3, 4}; Plane Surface(1) = {1}; Curve Loop(2) = {5, 6, 7, -2}; Plane Surface(2) = {2};
Transfinite Curve {1, 3} = 9; Transfinite Curve {5, 7} = 17; Transfinite Curve {2, 4, 6} = 9;
Point(11) = {-1, 10, 0}; Point(12) = {1, 10, 0}; Point(13) = {1, 12, 0}; Point(14) = {-1, 12, 0};
Line(11) = {11, 12}; Line(12) = {12, 13}; Line(13) = {13, 14}; Line(14) = {14, 11}; Curve Loop(3) = {11, 12, 13, 14}; Plane Surface(3) = {3};
Transfinite Curve {11, 12, 13, 14} = 6; Transfinite Surface {1:3}; Recombine Surface {1:3};
Physical Surface("root") = {1}; Physical Surface("rail") = {1, 2}; Physical Surface("shoe") = {3};
Physical Curve("base") = {4}; Physical Curve("rail_top") = {3, 7}; Physical Curve("shoe_under") = {11}; Physical Curve("shoe_top") = {13};
"""
RAIL = """
scene: {title: rail, mesh: rail.msh, parameters: [place, load]}
parameter: {place: {range: [5, 10]}, load: {range: [0.1, 0.3]}}
body: {rail: {young: 1000, poisson: 0.3}, shoe: {young: 1000, poisson: 0.3, map: {x: x + place, y: "y - 6 + x^2/20"}}}
fixed: {base: {x: 0, y: 0}, shoe_top: {x: 0, y: -load}}
contact: {run: {type: surface, slave: shoe_under, master: rail_top}}
output: {root: {mean: mises, group: root}, rail: {mean: mises, group: rail}}
"""


class Parts(Case):
    def test_group_of_a_part(self):
        """A group of some cells of a body, of which an output is the mean stress: models have it, from training on one rank and on two."""
        self.drawn('rail', 2, PARTS, RAIL)
        full = self.hyco('solve', '-scene', self.path('rail'), '-mu', '7,0.2')['outputs']
        self.assertGreater(abs(full['root'] - full['rail']), 0.01 * full['rail'])
        for ranks in (0, 2):
            self.hyco('train', '-scene', self.path('rail'), '-grid', '3,3', '-hyco_model_type', 'bodies', '-hyco_snapshots', self.path('parts'),
                      '-model', self.path('rail.h5'), ranks=ranks)
            found = self.hyco('predict', '-model', self.path('rail.h5'), '-mu', '7,0.2')['outputs']
            self.near(found['root'], full['root'], 1e-9)


class Follows(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.drawn('arm', 2, ARM, SCENE, '-order', '2')
        cls.train('arm.h5')

    @classmethod
    def train(cls, model, *more):
        cls.hyco('train', '-scene', cls.path('arm'), '-grid', '5,3', '-hyco_model_type', 'bodies', '-hyco_snapshots', cls.path('s'),
                 '-model', cls.path(model), *more)

    def rows(self, name):
        with open(self.path(name), encoding='utf-8') as f:
            return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(f)]

    def test_every_contact(self):
        """Wherever the bump stands, the displacement meets the gap at the closed nodes, and the tip is where full order has it. A model whose
        modes know only forces of sampled points has points here that miss the gap altogether."""
        self.hyco('predict', '-model', self.path('arm.h5'), '-scatter', 500, '-table', self.path('p.csv'))
        worst = max(row['inconsistency'] for row in self.rows('p.csv'))
        self.assertLess(worst, 5e-3)  # three values of the thickness: the flexibility's interpolation; else 1 where a node is missed
        c = self.hyco('compare', '-scene', self.path('arm'), '-model', self.path('arm.h5'), '-scatter', 60)
        self.assertLess(c['error_u']['max'], 2e-2)


class Regime(Case):
    newcomer = True

    def test_new_contacts(self):
        """A hybrid model of a roller that was trained at one end of its way and is asked at the other, where contacts close that no training
        solution closes: it says so, multiplies the estimates, and the fallback solves full order. Where it was trained it says nothing."""
        train = self.run_raw('train', '-scene', ROLLER, '-values_place', '-5,-4,-3,-2', '-values_press', '0.3,0.6', '-values_modulus', '8,16', '-model', 'm.h5',
                             '-hyco_model_type', 'hybrid', '-hyco_search', 'false', '-hyco_hybrid', 'contact', '-hyco_rid_layers', 1, cwd=self.folder)
        self.assertIn(train.returncode, (0, 3), train.stderr)
        here, there = (self.run_raw('predict', '-model', 'm.h5', '-mu', mu, cwd=self.folder) for mu in ('-3.4,0.5,10', '4,0.5,10'))
        self.assertNotIn('UNSEEN', here.stdout)
        self.assertIn('UNSEEN REGIME', there.stdout)

    def test_beside_modes(self):
        """A model of bodies of the roller on a mesh too fine for all cells to be exact, asked far outside: the forces are right, but the largest
        stress is that of cells between exact nodes and those of modes. It has no estimate there, and `predict` says so; inside it has one."""
        with open(os.path.join(ROLLER, 'scene.yaml'), encoding='utf-8') as f:
            text = f.read().replace('range: [-5, 5]', 'range: [-5, -2]').replace('roller.msh', os.path.join(ROLLER, 'roller.msh'))
        scene = self.path('far.yaml')
        with open(scene, 'w', encoding='utf-8') as f:
            f.write(text + 'output: {peak: {max: mises, group: block}, push: {force: y, contact: under}}\n')
        self.hyco('train', '-scene', scene, '-scene_refine', 1, '-grid', '3,2,2', '-hyco_model_type', 'bodies', '-model', self.path('far.h5'))
        here, there = (self.hyco('predict', '-model', self.path('far.h5'), '-extrapolate', '-mu', mu) for mu in ('-3.4,0.5,10', '4,0.5,10'))
        full = self.hyco('solve', '-scene', scene, '-scene_refine', 1, '-parameter_place_range', '-5,5', '-mu', '4,0.5,10')
        self.assertIsNotNone(here['estimated_error_outputs']['peak'])
        self.assertNotIn('unseen_feature', here)
        self.assertIsNone(there['estimated_error_outputs']['peak'])
        self.assertIn('beside cells', there['unseen_feature'])
        self.assertLess(abs(there['outputs']['push'] - full['outputs']['push']), there['estimated_error_outputs']['push'])


    def test_rigid_motion(self):
        """A block that its support moves against a wall, or short of it, where its stress is round-off: errors of stress stay errors, at the
        held-out points and in the ratios that compare prints."""
        scene = self.written('scene: {title: push, mesh: mesh.msh, parameters: [push]}\nparameter: {push: {range: [-0.02, 0.06]}}\n'
                             'body: {block: {young: 1000, poisson: 0.3}}\nfixed: {low: {x: 0, y: push}}\n'
                             'contact: {wall: {type: obstacle, group: high, normal: {y: 1}, gap: 0.011}}\n', square(4))
        train = self.hyco('train', '-scene', scene, '-grid', 9, '-hyco_model_type', 'hybrid', '-model', self.path('w.h5'), status=None)
        self.assertLess(train['held_out']['sigma']['largest'], 1)
        compare = self.hyco('compare', '-scene', scene, '-model', self.path('w.h5'), '-scatter', 40)
        self.assertLess(compare['estimates']['sigma']['worst_error_over_estimate'], 5)

    def test_soft_spring(self):
        """A block that its load presses on a round floor, held otherwise by a spring of 1e-7 of its stiffness. Displacements without contact are
        rigid motions of ten million times the deformation: rounding them is no penetration."""
        scene = self.written('scene: {title: soft, mesh: mesh.msh, parameters: [press, crown]}\nparameter: {press: {range: [1, 3]}, crown: {range: [0.001, 0.004]}}\n'
                             'body: {block: {young: 1000, poisson: 0.3}}\nfixed: {left: {x: 0}}\nspring: {high: {y: 1e-4}}\ntraction: {high: {y: -press*(1+x)}}\n'
                             'contact: {floor: {type: obstacle, group: low, normal: {y: -1}, gap: crown*(x-0.4)^2}}\n', square(8))
        train = self.hyco('train', '-scene', scene, '-grid', '3,3', '-model', self.path('s.h5'))
        self.assertEqual(train['model_type'], 'bodies')
        compare = self.hyco('compare', '-scene', scene, '-model', self.path('s.h5'), '-scatter', 100)
        self.assertEqual(compare['not_converged'], 0)
        for error in ('u', 'sigma', 'lambda'):
            self.assertLess(compare['error_' + error]['max'], 1e-6, error)


if __name__ == '__main__':
    unittest.main()
