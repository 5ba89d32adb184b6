"""Two scenes written from the documents alone. In space: cells of second order, a rigid body with a load, supports in oblique planes, springs on several
groups, gravity, three contacts, named constants, outputs of contacts. Of revolution over time: heat, creep, a tie under a contact, outputs of each time."""
import csv
import os
import subprocess
import sys
import unittest

import h5py
import numpy as np

from common import PATIENCE, SOURCE, Case

PLATE = """// One eighth of a round plate, pressed by a round punch, on a ring, in a recess. mm, N, MPa. The punch is a rigid body: one cell beside the plate.
height = 8; s = 6;
Point(1) = {0, 0, 0, 4};
Point(2) = {8, 0, 0, 4};
Point(3) = {24, 0, 0, s};
Point(4) = {30, 0, 0, s};
c = Cos(Pi/4);
Point(12) = {8*c, 8*c, 0, 4};
Point(13) = {24*c, 24*c, 0, s};
Point(14) = {30*c, 30*c, 0, s};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4};
Line(11) = {1, 12}; Line(12) = {12, 13}; Line(13) = {13, 14};
Circle(21) = {2, 1, 12}; Circle(22) = {3, 1, 13}; Circle(23) = {4, 1, 14};
Curve Loop(1) = {1, 21, -11}; Plane Surface(1) = {1};
Curve Loop(2) = {2, 22, -12, -21}; Plane Surface(2) = {2};
Curve Loop(3) = {3, 23, -13, -22}; Plane Surface(3) = {3};
a[] = Extrude {0, 0, height} { Surface{1}; };
b[] = Extrude {0, 0, height} { Surface{2}; };
d[] = Extrude {0, 0, height} { Surface{3}; };
// a[0] top, a[1] volume, a[2..] sides in the order of the loop
Point(101) = {50, 0, 0, 4}; Point(102) = {54, 0, 0, 4}; Point(103) = {54, 4, 0, 4}; Point(104) = {50, 4, 0, 4};
Line(101) = {101, 102}; Line(102) = {102, 103}; Line(103) = {103, 104}; Line(104) = {104, 101};
Curve Loop(101) = {101, 102, 103, 104}; Plane Surface(101) = {101};
t[] = Extrude {0, 0, 4} { Surface{101}; };
Physical Volume("plate") = {a[1], b[1], d[1]};
Physical Volume("punch") = {t[1]};
Physical Surface("middle") = {a[0]};
Physical Surface("under") = {1, 2};
Physical Surface("foot") = {3};
Physical Surface("rim") = {d[3]};
Physical Surface("flat") = {a[2], b[2], d[2]};
Physical Surface("slope") = {a[4], b[4], d[4]};
Physical Point("tip") = {101};
"""
PLATE_SCENE = """scene:
  title: a round plate under a rigid punch, on a ring
  mesh: plate.msh
  parameters: [load, radius, bed]
  unit: {length: mm, force: N, stress: MPa}
parameter:
  load: {range: [0, 4000], unit: N}         # on the whole plate
  radius: {range: [40, 80], unit: mm}       # of the punch
  bed: {range: [0.5, 5], unit: N/mm^3}      # stiffness under the plate
constant: {alu: 70000, heavy: 2.7e-9, share: load/8, snug: 2e-3}
body:
  plate: {young: alu, poisson: 0.33, density: heavy}
  punch: {young: alu, poisson: 0.33}
fixed:
  flat: {y: 0}
  slope: {normal: 0, direction: {x: 1, y: -1}}
  punch: {x: 0, y: 0}
spring:
  "under,foot": {normal: bed}
  tip: {z: 20}
gravity: {z: -9810}
force:
  tip: {z: -share}
contact:
  press: {type: rigid, slave: middle, master: tip, gap: (x^2 + y^2)/(2*radius)}
  ring: {group: foot, normal: {z: -1}, gap: 0}
  recess: {group: rim, normal: {x: x, y: y}, gap: snug}
output:
  push: {force: z, contact: press}
  lift: {force: z, contact: ring}
  wall: {force: x, contact: recess}
  turn: {moment: y, contact: ring}
  peak: {max: contact_pressure, contact: press}
  hot: {max: mises, group: plate}
  sink: {min: u_z, group: tip}
  hold: {reaction: x, group: slope}
"""
FUEL = """// A pellet in a tube whose upper part is welded on, with other cells: x is the radius, y the axis. mm.
Point(1) = {0, 0, 0}; Point(2) = {4, 0, 0}; Point(3) = {4, 10, 0}; Point(4) = {0, 10, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4}; Plane Surface(1) = {1};
Transfinite Curve {1, 3} = 7; Transfinite Curve {2, 4} = 13;
Point(11) = {4.02, 0, 0}; Point(12) = {4.6, 0, 0}; Point(13) = {4.6, 6, 0}; Point(14) = {4.02, 6, 0};
Line(11) = {11, 12}; Line(12) = {12, 13}; Line(13) = {13, 14}; Line(14) = {14, 11};
Curve Loop(11) = {11, 12, 13, 14}; Plane Surface(11) = {11};
Transfinite Curve {11, 13} = 3; Transfinite Curve {12, 14} = 17;
Point(21) = {4.02, 6, 0}; Point(22) = {4.6, 6, 0}; Point(23) = {4.6, 10, 0}; Point(24) = {4.02, 10, 0};
Line(21) = {21, 22}; Line(22) = {22, 23}; Line(23) = {23, 24}; Line(24) = {24, 21};
Curve Loop(21) = {21, 22, 23, 24}; Plane Surface(21) = {21};
Transfinite Curve {21, 23} = 4; Transfinite Curve {22, 24} = 9;
Transfinite Surface {1, 11, 21}; Recombine Surface {1, 11, 21};
Physical Surface("pellet") = {1};
Physical Surface("tube") = {11};
Physical Surface("cap") = {21};
Physical Curve("side") = {2};
Physical Curve("bottom") = {1};
Physical Curve("tube_bottom") = {11};
Physical Curve("bore") = {14, 24};
Physical Curve("weld") = {13};
Physical Curve("weld_cap") = {21};
Physical Curve("outside") = {12, 22};
"""
FUEL_SCENE = """scene:
  title: a pellet that swells in a tube which creeps, in two parts
  mesh: fuel.msh
  formulation: axisymmetric
  parameters: [heat, rate]
parameter:
  heat: {range: [500, 900], unit: K}
  rate: {range: [0.5, 2]}
constant: {zirconium: 8e4, outer: 15}
body:
  pellet: {young: 1.8e5, poisson: 0.3, temperature: 300 + heat*q, reference_temperature: 300, expansion: 1e-5}
  tube: {young: zirconium, poisson: 0.33, law: {type: norton, rate: 2e-12*rate, exponent: 3.5}}
  cap: {young: zirconium, poisson: 0.33, law: {type: norton, rate: 2e-12*rate, exponent: 3.5}}
fixed:
  "bottom,tube_bottom": {y: 0}
tie:
  weld: {slave: weld_cap, master: weld}
pressure: {outside: outer}
contact:
  clad: {type: surface, slave: bore, master: side}
history:
  times: [0, 1, 10, 100, 1000, 1001]
  tables: {q: [[0, 0], [1, 1], [1000, 1], [1001, 0]]}
output:
  hoop: {max: sigma_tt, group: "tube"}
  peak: {max: contact_pressure, contact: clad}
  push: {force: y, contact: clad}
  hold: {reaction: y, group: tube_bottom}
  grow: {max: u_x, group: outside}
  creep: {max: mises, group: cap}
"""


class Scenes(Case):
    newcomer = True

    def plot(self, *args):
        run = subprocess.run([sys.executable, os.path.join(SOURCE, 'scripts', 'plot'), 'solution', *args, '-o', 'picture.png'], cwd=self.folder, capture_output=True,
                             text=True, timeout=60 * PATIENCE, check=False)
        return run.stderr

    def test_plate(self):
        """The plate in 3D: checked, solved, trained and predicted."""
        self.drawn('plate', 3, PLATE, PLATE_SCENE, '-order', '2')
        self.assertEqual(self.hyco('check', '-scene', 'plate')['n_warnings'], 0)
        point = ['-mu', '2000,60,2']
        full = self.hyco('solve', '-scene', 'plate', *point, '-output', 'full.xdmf')
        self.solved(full)
        self.assertLess(full['balance'], 1e-10)
        force = {name: np.array(c['force']) for name, c in full['contacts'].items()}
        self.assertTrue(all(c['n_active'] for c in full['contacts'].values()))
        # on the punch: its eighth of the load, its spring, the plate; on the plate: this, its weight, the springs under it, the ring
        self.near(force['press'][2], full['springs']['tip']['force'][2] - 250, 1e-9, 'what the punch presses with')
        weight = 9810 * 2.7e-9 * np.pi * 30**2 * 8 / 8
        held = force['ring'][2] + full['springs']['under']['force'][2] + full['springs']['foot']['force'][2]
        self.near(held, weight - force['press'][2], 1e-5, 'what holds the plate')
        # the planes of symmetry and the recess hold it along x and y, without friction
        slope, flat = (np.array(full['supports'][name]['force']) for name in ('slope', 'flat'))
        self.near(slope[0], -slope[1], 1e-9, 'the oblique plane')
        self.near(slope[0], -force['recess'][0], 1e-9, 'along x')
        self.near(flat[1] + slope[1], -force['recess'][1], 1e-9, 'along y')
        outputs = dict(zip(('push', 'lift', 'wall', 'hold'), (force['press'][2], force['ring'][2], force['recess'][0], slope[0])))
        for name, value in outputs.items():
            self.near(full['outputs'][name], value, 1e-9, name)
        self.assertEqual((self.plot('full.h5', '--surface', '3'), 'contact surfaces: 3' in self.plot('full.h5', '--surface', '4')), ('', True))
        self.assertNotIn('missed', self.hyco('train', '-scene', 'plate', '-grid', '3,3,3', '-grid_type', 'closed', '-hyco_model_type', 'bodies', '-model', 'plate.h5'))
        self.hyco('predict', '-model', 'plate.h5', '-values_load', '0,2000', '-values_radius', '60', '-values_bed', '2', '-table', 'study.csv', '-output', 'study.xdmf')
        with open(self.path('study.csv'), encoding='ascii') as f:
            rest, low = csv.DictReader(f)
        self.assertEqual(float(rest['press.force_z']), 0)
        self.near(float(rest['ring.force_z']), weight, 0.01, 'the weight alone')
        for name, value in full['outputs'].items():
            self.near(float(low[name]), value, 2e-2, name)
        with h5py.File(self.path('study.h5')) as f:
            self.assertTrue(all(f[step]['nodes/contact_pressure'][:].min() >= 0 for step in f if step.startswith('step-')))

    def test_fuel(self):
        """Fuel with a history: checked, solved, trained and predicted."""
        self.drawn('fuel', 2, FUEL, FUEL_SCENE)
        self.assertEqual(self.hyco('check', '-scene', 'fuel')['n_warnings'], 0)
        full = self.hyco('solve', '-scene', 'fuel', '-mu', '700,1', '-output', 'full.xdmf')
        path = full['history']
        self.assertTrue(path['ended'])
        self.assertEqual(path['n_active'], [0, 25, 25, 25, 25, 0])
        self.assertLess(max(path['energy_defect']), 1e-8)
        with h5py.File(self.path('full.h5')) as f:  # both parts of the tube are alike: so is the pressure, across the weld too
            at = f['step-0003/nodes']
            pressure = at['contact_pressure'][:][np.isfinite(at['gap'][:])]
        self.assertEqual(len(pressure), 25)
        np.testing.assert_allclose(pressure, pressure.mean(), rtol=0.02)
        # what relaxes: the pressure times the radius over the wall, as in a closed ring
        hoop = np.array(path['outputs']['peak'][1:5]) * 4.02 / 0.58 - 15 * 4.6 / 0.58
        np.testing.assert_allclose(path['outputs']['hoop'][1:5], hoop, atol=0.12 * max(hoop))
        self.assertNotIn('missed', self.hyco('train', '-scene', 'fuel', '-grid', '3,3', '-model', 'fuel.h5'))
        model = self.hyco('predict', '-model', 'fuel.h5', '-mu', '700,1')['history']
        for name in ('peak', 'grow', 'creep'):
            values = path['outputs'][name]
            np.testing.assert_allclose(model['outputs'][name], values, rtol=0, atol=1e-2 * np.abs(values).max(), err_msg=name)
        np.testing.assert_allclose(model['total_contact_force'], path['total_contact_force'], rtol=0, atol=1e-2 * max(path['total_contact_force']))
        errors = self.hyco('compare', '-scene', 'fuel', '-model', 'fuel.h5', '-grid', '2,1')
        self.assertLess(errors['worst_u']['max'], 5e-3)
        self.assertLess(errors['worst_lambda']['max'], 3e-2)


class DiscOverStop(Case):
    """A clamped disc over a stop that it may not reach: tests/drawn/discstop."""
    newcomer = True

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.drawn = os.path.join(SOURCE, 'tests', 'drawn', 'discstop')
        with open(os.path.join(cls.drawn, 'scene.yaml'), encoding='utf-8') as f:
            cls.text = f.read()
        cls.write(cls.text)
        cls.mesh('-2', 'discstop.msh')

    @classmethod
    def write(cls, text):
        with open(cls.path('scene.yaml'), 'w', encoding='utf-8') as f:
            f.write(text)

    @classmethod
    def mesh(cls, dim, name):
        subprocess.run(['gmsh', dim, os.path.join(cls.drawn, 'discstop.geo'), '-format', 'msh41', '-v', '1', '-o', cls.path(name)], check=True)

    def test_check(self):
        """check refuses the outputs that solve refuses, and a mesh without the bodies' cells."""
        for entry, words in (('{reaction: z, group: rim}', 'no reaction along z'), ('{reaction: x, group: rim}', 'sums to zero; use y'),
                             ('{reaction: y, group: disc_mid}', 'no support fixes y on disc_mid')):
            self.write(self.text.replace('{reaction: y, group: rim}', entry))
            for command in (('check',), ('solve', '-mu', '1,0.02')):
                run = self.run_raw(*command, '-scene', 'scene.yaml')
                self.assertEqual(run.returncode, 1, (entry, command))
                self.assertIn(words, run.stderr)
        self.write(self.text)
        self.mesh('-1', 'lines.msh')
        run = self.run_raw('check', '-scene', 'scene.yaml', '-scene_mesh', 'lines.msh')
        self.assertEqual(run.returncode, 1)
        self.assertRegex(run.stderr, 'disc.* has no cells|mesh with gmsh -2')

    def test_grid(self):
        """The default grid of training has the ends of the ranges, with one value the middle; that of the other commands has cell centres."""
        self.write(self.text)
        self.hyco('train', '-scene', 'scene.yaml', '-grid', '1,3', '-hyco_validation', 0, '-hyco_model_type', 'regression', '-model', 'g.h5')
        with h5py.File(self.path('g.h5')) as f:
            np.testing.assert_allclose(f['training/points'][:], [[1.75, 0.01], [1.75, 0.025], [1.75, 0.04]], rtol=1e-12)
        # Three points are few for a regression, whose forces need not balance (status 3).
        self.hyco('predict', '-model', 'g.h5', '-grid', '1,2', '-table', 'p.csv', status=None)
        with open(self.path('p.csv'), encoding='utf-8') as f:
            rows = list(csv.DictReader(f))
        np.testing.assert_allclose([float(r['clearance']) for r in rows], [0.0175, 0.0325], rtol=1e-7)

    def test_judged(self):
        """Errors of the size of round-off: the quotients of errors and estimates agree with the share that is bounded. The largest errors are also those
        of corners among the training points."""
        self.write(self.text)
        trained = self.run_raw('train', '-scene', 'scene.yaml', '-grid', '8,6', '-hyco_model_type', 'bodies', '-hyco_bodies_pod_tol', '1e-18', '-model', 'm.h5')
        self.assertEqual(trained.returncode, 0, trained.stderr)
        self.assertIn('largest, also at corners of the training, u', trained.stdout)
        report = self.hyco('compare', '-scene', 'scene.yaml', '-model', 'm.h5', '-scatter', 60)
        for kind in ('u', 'sigma', 'lambda'):
            found = report['estimates'][kind]
            self.assertLess(report['error_' + kind]['max'], 1e-9)
            self.assertEqual(found['bounded'] == 1, found['worst_error_over_estimate'] <= 1)
            if found['median_ratio'] is None:  # without round-off there are no errors
                self.assertEqual(found['bounded'], 1)
            elif found['bounded'] == 1:
                self.assertGreaterEqual(found['median_ratio'], 1)


if __name__ == '__main__':
    unittest.main()
