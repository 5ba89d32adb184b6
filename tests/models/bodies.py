"""Models of bodies as substructures: forces, surfaces and resultants are those of full order where contacts travel, bodies turn, grow, soften or
float; where a body's shape changes, they follow the number of its samples and stay within the bound; check says how parameters enter the bodies."""
import csv
import os
import shutil
import re
import resource
import subprocess
import sys
import unittest

import h5py
import numpy as np

import rigid_motions
import rigid
from common import HYCO, PATIENCE, SANITIZED, SOURCE, Case, square

MESH = os.path.join(SOURCE, 'examples', '{0}', '{0}.msh')
TYPE = ('-hyco_model_type', 'bodies')
ROLLER = os.path.join(SOURCE, 'examples', 'roller')
HERTZ = os.path.join(SOURCE, 'examples', 'hertz')
SET = """
import warnings
import hyco
with hyco.Model('v.h5') as model:
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter('always')
        g = model.gradient([[1.3, -0.5, 9], [1.03, 0.6, 11]], extrapolate=True)  # the first without contact
    print(g['push'].tolist(), list(g.lacking), len(told), 'press 0.6' in str(told[0].message))
    try:
        model.gradient([1.03, 0.6, 11])
    except hyco.NotConverged:
        print(True)
"""
TURNED = f"""
scene: {{title: a turned and enlarged cylinder on a block, mesh: {MESH.format('roller')}, parameters: [place, press, modulus, turn, size]}}
parameter: {{place: {{range: [-4, 4]}}, press: {{range: [0.2, 1]}}, modulus: {{range: [5, 20]}}, turn: {{range: [-15, 15]}}, size: {{range: [0.9, 1.1]}}}}
body:
  block: {{young: modulus, poisson: 0.4}}
  cylinder:
    young: 100
    poisson: 0.3
    map:
      x: "size*(x*cos(turn*pi/180) - (y - 10)*sin(turn*pi/180)) + place"
      y: "10*size + size*(x*sin(turn*pi/180) + (y - 10)*cos(turn*pi/180))"
fixed: {{block_base: {{x: 0, y: 0}}, cylinder_top: {{x: 0, y: -press}}}}
contact: {{under: {{type: surface, slave: cylinder_round, master: block_top}}}}
"""
FLOATING = f"""
scene: {{title: a block that a foundation alone holds, mesh: {MESH.format('blocks')}, parameters: [soft, press, tip]}}
parameter: {{soft: {{range: [1, 4]}}, press: {{range: [50, 400]}}, tip: {{range: [-0.5, 0.5]}}}}
body:
  block: {{young: 2e5, poisson: 0.3}}
  foundation: {{young: 1e5/soft, poisson: 0.3}}
fixed: {{block_sym: {{x: 0}}, foundation_sym: {{x: 0}}, foundation_base: {{y: 0}}}}
pressure: {{block_top: press*(1 + tip*x/20)}}
contact: {{under: {{type: surface, slave: block_under, master: foundation_top, tolerance: 0.3}}}}
"""
OBSTACLE = f"""
scene: {{title: a block on springs under a bump that moves, mesh: {MESH.format('roller')}, parameters: [at, depth, modulus]}}
parameter: {{at: {{range: [-6, 6]}}, depth: {{range: [0.05, 0.3]}}, modulus: {{range: [5, 20]}}}}
body:
  block: {{young: modulus, poisson: 0.3}}
  cylinder: {{young: 100, poisson: 0.3}}
fixed: {{block_base: {{x: 0}}, cylinder_top: {{x: 0, y: 1}}}}
spring: {{block_base: {{y: 2*modulus}}}}
contact: {{bump: {{type: obstacle, group: block_top, normal: {{y: 1}}, gap: 0.02*(x - at)^2 - depth}}}}
"""
STIFF = f"""
scene: {{title: a block on a foundation whose springs do not soften with it, mesh: {MESH.format('blocks')}, parameters: [soft, press]}}
parameter: {{soft: {{range: [0.5, 5]}}, press: {{range: [0.02, 0.06]}}}}
body:
  block: {{young: 2e5, poisson: 0.3, map: {{y: "y + 0.04*(x/20)^2*(1 - y/16)"}}}}
  foundation: {{young: 1e5*soft, poisson: 0.3}}
spring: {{foundation_base: {{y: 2e4}}}}
fixed: {{block_sym: {{x: 0}}, foundation_sym: {{x: 0}}, block_top: {{y: -press}}}}
contact: {{under: {{type: pair, slave: block_under, master: foundation_top, tolerance: 0.1}}}}
"""

SPRUNG = f"""
scene: {{title: a cylinder that a soft spring holds above a block, mesh: {MESH.format('roller')}, parameters: [place, press]}}
parameter: {{place: {{range: [-4, 4]}}, press: {{range: [0.2, 1]}}}}
body:
  block: {{young: 10, poisson: 0.4}}
  cylinder: {{young: 100, poisson: 0.3, map: {{x: x + place}}}}
fixed: {{block_base: {{x: 0, y: 0}}, cylinder_top: {{x: 0}}}}
spring: {{cylinder_top: {{y: 1e-4}}}}
pressure: {{cylinder_top: press}}
contact: {{under: {{type: surface, slave: cylinder_round, master: block_top}}}}
"""

LEAF = ("""scene:
  title: a leaf over a bump at any place
  mesh: leaf.msh
  parameters: [load, place]
parameter:
  load: {range: [0.5, 2]}
  place: {range: [2, 9]}
body:
  leaf: {young: 100, poisson: 0.3}
fixed:
  left: {x: 0, y: 0}
pressure: {top: 0.001*load}
contact:
  bump: {type: obstacle, group: bottom, normal_y: -1, gap: "0.01 + 0.05*(x - place)^2"}
""", """Point(1) = {0, 0, 0}; Point(2) = {10, 0, 0}; Point(3) = {10, 0.4, 0}; Point(4) = {0, 0.4, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1}; Curve Loop(1) = {1:4}; Plane Surface(1) = {1};
Transfinite Curve{1, 3} = 101; Transfinite Curve{2, 4} = 4; Transfinite Surface{1}; Recombine Surface{1};
Physical Surface("leaf") = {1}; Physical Curve("bottom") = {1}; Physical Curve("top") = {3}; Physical Curve("left") = {4};
""")
PAD = ("""scene:
  title: a pad that slides on the middle of a wide plate
  mesh: pad.msh
  parameters: [place, press]
parameter:
  place: {range: [-2, 2]}
  press: {range: [0.01, 0.05]}
body:
  plate: {young: 1000, poisson: 0.3}
  pad: {young: 100, poisson: 0.3, map: {x: x + place, z: "z + 0.01*(x^2 + y^2)"}}
fixed:
  base: {x: 0, y: 0, z: 0}
  press: {x: 0, y: 0, z: -press}
contact:
  under: {type: surface, slave: sole, master: top}
""", """SetFactory("OpenCASCADE"); Box(1) = {-12, -12, -1, 24, 24, 1}; Box(2) = {-1, -1, 0, 2, 2, 1};
Transfinite Curve{:} = 25; Transfinite Curve{1, 3, 5, 7} = 2; Transfinite Curve{13:24} = 4; Transfinite Surface{:}; Recombine Surface{:};
Transfinite Volume{:};
Physical Volume("plate") = {1}; Physical Volume("pad") = {2}; Physical Surface("base") = {5}; Physical Surface("top") = {6};
Physical Surface("sole") = {11}; Physical Surface("press") = {12};
""")
SHORT = ("""scene:
  title: a short block on a long foundation
  mesh: short.msh
  parameters: [press]
parameter:
  press: {range: [0.01, 0.05]}
body:
  below: {young: 100, poisson: 0.3}
  above: {young: 100, poisson: 0.3}
fixed:
  base: {x: 0, y: 0}
  press: {x: 0, y: -press}
contact:
  under: {type: surface, slave: sole, master: top, tolerance: 0.01}
""", """Point(1) = {-10, -4, 0}; Point(2) = {10, -4, 0}; Point(3) = {10, 0, 0}; Point(4) = {-10, 0, 0};
Point(5) = {-1, 0, 0}; Point(6) = {1, 0, 0}; Point(7) = {1, 1, 0}; Point(8) = {-1, 1, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1}; Line(5) = {5, 6}; Line(6) = {6, 7}; Line(7) = {7, 8}; Line(8) = {8, 5};
Curve Loop(1) = {1:4}; Curve Loop(2) = {5:8}; Plane Surface(1) = {1}; Plane Surface(2) = {2};
Transfinite Curve{1, 3} = 41; Transfinite Curve{2, 4} = 9; Transfinite Curve{5:8} = 5; Transfinite Surface{:}; Recombine Surface{:};
Physical Surface("below") = {1}; Physical Surface("above") = {2}; Physical Curve("base") = {1}; Physical Curve("top") = {3};
Physical Curve("sole") = {5}; Physical Curve("press") = {7};
""")

RECTANGLE = """Macro Quad
p = newp; Point(p) = {x0, y0, 0}; Point(p + 1) = {x1, y0, 0}; Point(p + 2) = {x1, y1, 0}; Point(p + 3) = {x0, y1, 0};
l = newl; Line(l) = {p, p + 1}; Line(l + 1) = {p + 1, p + 2}; Line(l + 2) = {p + 2, p + 3}; Line(l + 3) = {p + 3, p};
c = newll; Curve Loop(c) = {l : l + 3}; s = news; Plane Surface(s) = {c};
Transfinite Curve{l, l + 2} = nx + 1; Transfinite Curve{l + 1, l + 3} = ny + 1; Transfinite Surface{s}; Recombine Surface{s};
Return
"""
# a foot that a bed alone holds in its height; a blunt wedge that two slopes hold in all three motions
FOOT = ("""scene: {title: a foot of changing height, mesh: foot.msh, parameters: [height, lean, load]}
parameter: {height: {range: [12, 20]}, lean: {range: [0, 2]}, load: {range: [20, 200]}}
body:
  foot: {young: 2.1e5, poisson: 0.3, map: {x: "x*(1 + 0.1*y/16) + lean*y/16", y: "y*height/16 + 0.05*(x/10)^2*(1 - y/16)"}}
  bed: {young: 3e4, poisson: 0.25}
fixed: {top: {x: 0}, base: {x: 0, y: 0}}
traction: {top: {y: "-load*(1 + 0.2*x/10)"}}
contact: {sole: {type: mortar, slave: under, master: bed_top}}
output: {push: {force: y, contact: sole}, tilt: {moment: z, contact: sole}, side: {reaction: x, group: top}}
""", RECTANGLE + """x0 = -10; x1 = 10; y0 = 0; y1 = 16; nx = 12; ny = 6; Call Quad;
Physical Surface("foot") = {s}; Physical Curve("under") = {l}; Physical Curve("top") = {l + 2};
x0 = -16; x1 = 16; y0 = -8; y1 = 0; nx = 18; ny = 4; Call Quad;
Physical Surface("bed") = {s}; Physical Curve("base") = {l}; Physical Curve("bed_top") = {l + 2};
""")
WEDGE = ("""scene: {title: a wedge on two slopes, mesh: wedge.msh, parameters: [angle, width]}
parameter: {angle: {range: [5, 20]}, width: {range: [0.9, 1.1]}}
body:
  wedge: {young: 2e5, poisson: 0.3, map: {x: "x*width", y: "y + (1 - y/8)*(abs(x)*width - 9)*tan(angle*pi/180)"}}
  left: {young: 7e4, poisson: 0.3, map: {y: "y + (1 + y/6)*(-x - 9)*tan(angle*pi/180)"}}
  right: {young: 7e4, poisson: 0.3, map: {y: "y + (1 + y/6)*(x - 9)*tan(angle*pi/180)"}}
fixed: {left_base: {x: 0, y: 0}, right_base: {x: 0, y: 0}}
traction: {wedge_top: {y: "-90*(1 + 0.3*x/12)"}}
contact: {l: {type: surface, slave: wedge_base, master: left_top}, r: {type: surface, slave: wedge_base, master: right_top}}
output: {up_l: {force: y, contact: l}, up_r: {force: y, contact: r}, tilt_l: {moment: z, contact: l}, tilt_r: {moment: z, contact: r}}
""", RECTANGLE + ''.join(f'x0 = {x}; x1 = {X}; y0 = {y}; y1 = {Y}; nx = {n}; ny = 4; Call Quad;\nPhysical Surface("{b}") = {{s}}; '
                         f'Physical Curve("{b}_base") = {{l}}; Physical Curve("{b}_top") = {{l + 2}};\n'
                         for b, x, X, y, Y, n in (('wedge', -12, 12, 0, 8, 18), ('left', -14, -4, -6, 0, 9), ('right', 4, 14, -6, 0, 8))))


class Bodies(Case):
    @classmethod
    def write(cls, name, text):
        with open(cls.path(name), 'w', encoding='ascii') as f:
            f.write(text)
        return cls.path(name)

    def judge(self, scene, points, train=('-scatter', '2'), forces=1e-10, u=1e-4, options=(), model='m.h5', kkt=1e-12):
        """A model from these points is compared with full order at others; returns the report of the comparison."""
        shutil.rmtree(self.path(model + '.snapshots'), ignore_errors=True)
        self.hyco('train', '-scene', scene, *TYPE, *train, '-model', model, *options)
        c = self.hyco('compare', '-scene', scene, '-model', model, *points)
        self.assertEqual((c['not_converged'], c['undefined']), (0, 0))
        self.assertLess(c['error_lambda']['max'], forces)
        self.assertLess(c['error_u']['max'], u)
        self.assertLess(c['kkt_max'], kkt)
        return c

    def test_travels(self):
        """A cylinder that is moved along a block by three quarters of its width: two training points, which give only the first one's
        stiffness, and forces to round-off."""
        self.judge(ROLLER, ('-values_place', '-4.3,-0.7,3.1', '-values_press', '0.23,0.9', '-values_modulus', '6,17'))

    def test_surface(self):
        """Displacements of the contact's nodes are those of full order, closed contacts have no gap, and resultants balance."""
        self.hyco('train', '-scene', ROLLER, *TYPE, '-scatter', '2', '-model', 's.h5')
        point = '1.37,0.71,8.3'
        self.hyco('predict', '-model', 's.h5', '-mu', point, '-output', 'p.xdmf')
        self.hyco('solve', '-scene', ROLLER, '-mu', point, '-output', 'f.xdmf')
        with h5py.File(self.path('p.h5')) as p, h5py.File(self.path('f.h5')) as f:
            gap, force, u = (np.array([g['nodes/' + name][:] for g in (p, f)]) for name in ('gap', 'contact_force', 'displacement'))
        on = np.isfinite(gap[1]).ravel()
        self.assertGreater(on.sum(), 40)
        self.assertLess(np.abs(gap[0].ravel()[on] - gap[1].ravel()[on]).max(), 1e-12)
        self.assertLess(np.abs(u[0][on] - u[1][on]).max(), 1e-12 * np.abs(u[1]).max())
        self.assertLess(np.abs(force[0].sum(axis=0)).max(), 1e-12 * np.abs(force[0]).sum())  # both sides of the pair

    def test_older_file(self):
        """Files in which flexibilities and the fields' responses are samples, or these lie by mode and not by surface unknown, predict the same."""
        self.hyco('train', '-scene', HERTZ, *TYPE, '-scatter', '2', '-model', 'new.h5', '-hyco_bodies_tol', '1e-3')
        new = self.hyco('predict', '-model', 'new.h5', '-mu', '0.06,1.1,10.3')
        samples = []

        def take(body, name, nodes):
            """The samples of a matrix from its terms."""
            terms = np.vstack([body[name + part][:] for part in ('', '_single') if name + part in body])
            Q, R = np.linalg.qr(np.vander(nodes - nodes.mean(), increasing=True))
            matrix = (Q * np.sign(np.diag(R)))[:, body[name + '_terms'][:, 0]] @ terms
            for part in [part for part in body if part in (name, name + '_single', name + '_terms', name + '_head')]:
                del body[part]
            return matrix

        for oldest in (False, True):
            shutil.copy(self.path('new.h5'), self.path('old.h5'))
            with h5py.File(self.path('old.h5'), 'r+') as f:
                del f['sealed']
                for body in (g for name, g in f['bodies'].items() if name.startswith('body_')):
                    loads, n = body['gram'].shape[0], round((2 * body['flexibility'].shape[1]) ** 0.5 - 0.5)
                    count = body['R'].shape[0] // n
                    samples.append(count)
                    self.assertEqual(['flexibility_single' in body, 'displacements_single' in body], 2 * [count > 1])
                    C, H, a = (take(body, name, f['bodies/node'][:count, 0]) for name in ('flexibility', 'displacements', 'displacements_of_loads'))
                    H, a, at, whole = H.reshape(count, n, -1), a.reshape(count, loads, -1), np.triu_indices(n), np.zeros((count, n, n))
                    whole[:, at[0], at[1]] = whole[:, at[1], at[0]] = C
                    body['C'] = whole.reshape(-1, n)
                    body['H' if oldest else 'responses'] = H.transpose(0, 2, 1).reshape(-1, n) if oldest else H.reshape(count * n, -1)
                    body['a'] = a.transpose(0, 2, 1).reshape(-1, loads)
                    body['g'] = np.zeros((len(body['a']), 0))
            old = self.hyco('predict', '-model', 'old.h5', '-mu', '0.06,1.1,10.3')
            for name in ('rid_u_norm2', 'total_contact_force', 'rid_u_min', 'rid_u_max'):
                np.testing.assert_allclose(old[name], new[name], rtol=1e-11, atol=1e-15, err_msg=name)
        self.assertGreater(max(samples), 1)

    def test_unmet_masters(self):
        """A surface of which no slave meets the greater part: displacements there are right too, on the surface as inside."""
        self.drawn('short', 2, SHORT[1], SHORT[0])
        self.judge('short', ('-values_press', '0.017,0.042'), u=1e-6, model='short.h5')

    def test_all_cells(self):
        """An output that needs all cells: where all displacements are exact, stresses are, though samples touch few of the contacts."""
        self.drawn('leaf', 2, LEAF[1], LEAF[0] + 'output: {bend: {max: sigma_xx, group: leaf}}\n')
        c = self.judge('leaf', ('-scatter', '40'), options=('-hyco_bodies_samples', '20'), model='leaf.h5')
        self.assertLess(c['error_sigma']['max'], 1e-6)

    def test_reached(self):
        """A pad that reaches a small part of a wide surface: the unknowns of the others are left out, forces stay those of full order, also at the ends
        of the range; beyond it, where it meets others, a prediction does not converge, and full order takes its place."""
        self.drawn('pad', 3, PAD[1], PAD[0])
        report = self.hyco('train', '-scene', 'pad', *TYPE, '-grid', '3,2', '-model', 'pad.h5')
        self.assertLess(report['n_surface_unknowns'], 900)  # of 1875 + 48
        c = self.hyco('compare', '-scene', 'pad', '-model', 'pad.h5', '-scatter', '20')
        self.assertEqual(c['not_converged'], 0)
        self.assertLess(c['error_lambda']['max'], 1e-9)
        self.assertLess(c['error_u']['max'], 1e-3)
        at = ('-extrapolate', '-mu', '9,0.03')
        run = self.run_raw('predict', '-model', 'pad.h5', *at)
        self.assertNotEqual(run.returncode, 0)
        self.assertIn('was not trained', run.stderr)
        there = self.hyco('solve', '-scene', 'pad', '-mu', '9,0.03', '-parameter_place_range', '-2,9')['total_contact_force']
        p = self.hyco('predict', '-model', 'pad.h5', *at, '-hyco_fallback', '-scene', 'pad')
        self.assertTrue(p['full_order'])
        self.near(p['total_contact_force'], there, 1e-12)
        with open(self.path('far.csv'), 'w', encoding='utf-8') as f:
            f.write('place,press\n1,0.03\n9,0.03\n')
        run = self.run_raw('predict', '-model', 'pad.h5', '-points', 'far.csv', '-extrapolate', '-table', 'far_out.csv')
        self.assertEqual(run.returncode, 1, run.stderr)
        with open(self.path('far_out.csv'), encoding='utf-8') as f:
            self.assertEqual([row['converged'] for row in csv.DictReader(f)], ['1', '0'])

    def test_kept_rows(self):
        """Rows that stay from one prediction to the next, while loads and moduli change, and rows that do not: a batch is what single predictions are."""
        self.hyco('train', '-scene', self.write('kept.yaml', TURNED), *TYPE, '-scatter', '2', '-model', 'kept.h5')
        points = ['1,0.3,7,0,1', '1,0.8,7,0,1', '1,0.8,19,0,1', '-2,0.8,19,0,1', '1,0.8,19,0,1', '1,0.8,19,9,1', '1,0.8,19,9,1.07', '1,0.21,6,9,1.07']
        with open(self.path('kept.csv'), 'w', encoding='ascii') as f:
            f.write('\n'.join(['place,press,modulus,turn,size', *points]) + '\n')
        self.hyco('predict', '-model', 'kept.h5', '-points', 'kept.csv', '-table', 'batch.csv')
        rows = np.genfromtxt(self.path('batch.csv'), delimiter=',', names=True)
        for row, point in zip(rows, points):
            one = self.hyco('predict', '-model', 'kept.h5', '-mu', point)
            for name in ('total_contact_force', 'rid_u_norm2'):
                self.near(row[name], one[name], 1e-7, point)  # of eight digits in a table

    def test_outputs(self):
        """Outputs on surfaces, of the hottest cell, and of supports beside a spring are those of full order with any modes; so are stresses."""
        outputs = '''output:
  lean: {mean: u_x, group: block_top}
  sink: {min: u_y, group: block_top}
  hot: {max: mises}
  most: {max: sigma_xx, group: cylinder}
  grip: {reaction: x, group: block_base}
  tip: {reaction: y, group: block_base}
'''
        with open(os.path.join(ROLLER, 'scene.yaml'), encoding='ascii') as f:
            text = f.read().replace('mesh: roller.msh', 'mesh: ' + MESH.format('roller'))
        scene = self.write('outputs.yaml', text + outputs + 'spring: {block_top: {x: 0.3*modulus}}\n')
        c = self.judge(scene, ('-values_place', '-4.3,3.1', '-values_press', '0.9', '-values_modulus', '17'), u=0.1,
                       options=('-hyco_bodies_pod_tol', '1e-4'), model='o.h5')
        self.assertLess(c['error_sigma']['max'], 1e-9)
        for point in ('1.37,0.71,8.3', '-3.9,0.33,19'):
            p, s = (self.hyco(*run, '-mu', point) for run in (('predict', '-model', 'o.h5'), ('solve', '-scene', scene)))
            for name in ('lean', 'sink', 'hot', 'most', 'grip', 'tip'):
                self.assertLess(abs(p['outputs'][name] - s['outputs'][name]), 1e-9 * max(1e-3, abs(s['outputs'][name])), name)

    def test_estimates(self):
        """Estimated errors of displacements, stresses and forces bound those at 40 points: all of them where nothing is interpolated, without a held-out
        solution and with few samples of the modes; else 90 %, and no error is five times its estimate."""
        for scene, held, least in ((ROLLER, 0, 1), (self.write('floating.yaml', FLOATING), 0, 1), (self.write('stiff.yaml', STIFF), 20, 0.9)):
            self.hyco('train', '-scene', scene, *TYPE, '-scatter', '4', '-hyco_bodies_samples', '10', '-hyco_validation', held, '-model', 'e.h5')
            self.hyco('compare', '-scene', scene, '-model', 'e.h5', '-scatter', '40', '-table', 'e.csv')
            rows = np.genfromtxt(self.path('e.csv'), delimiter=',', names=True)
            for kind in ('u', 'sigma', 'lambda'):
                size = np.ones(len(rows)) if kind == 'u' else rows[kind + '_norm2']
                error, estimate = rows['error_' + kind] * np.minimum(1, size / (0.1 * size.max())), rows['estimated_error_' + kind]
                self.assertGreaterEqual(np.mean(error <= estimate), least, (scene, kind))
                self.assertTrue((error <= 5 * estimate).all(), (scene, kind))

    def test_turned(self):
        """A body that is turned and enlarged about a point, in any combination with the others."""
        scene = self.write('turned.yaml', TURNED)
        self.judge(scene, ('-values_place', '-2.3,3.1', '-values_press', '0.4,0.9', '-values_modulus', '7', '-values_turn', '-11,6.5', '-values_size',
                           '0.93,1.07'))

    def test_mirrored(self):
        """A map that mirrors a body at one end of its range, enlarged on the way: outer sides, normals and displacements are those of full order."""
        text = TURNED.replace('size*(x*cos(', '(size > 1 ? -1 : 1)*size*((x + 0.3)*cos(').replace('range: [-15, 15]', 'range: [0, 0]')
        scene = self.write('mirrored.yaml', text)
        self.judge(scene, ('-values_place', '-2.3,3.1', '-values_press', '0.4,0.9', '-values_modulus', '7', '-values_turn', '0', '-values_size', '0.93,1.07'),
                   model='mirrored.h5')

    def test_rigid(self):
        """A rigid punch under a given load, on an axisymmetric block whose rim it may reach: motion, forces and displacements are those of full order."""
        rigid.Rigid.mesh.__func__(type(self))
        text = rigid.SCENE.replace('LAW', rigid.ELASTIC).replace('FORCE', '-load').replace('mesh: mesh.msh', 'mesh: mesh.msh, formulation: axisymmetric')
        scene = self.write('rigid.yaml', text)
        self.judge(scene, ('-values_load', '7,29', '-values_radius', '8.3,11.9'), model='rigid.h5')
        p, s = (self.hyco(*run, '-mu', '17,9.3') for run in (('predict', '-model', 'rigid.h5'), ('solve', '-scene', scene)))
        self.near(p['outputs']['push'], -17, 1e-10)
        self.near(p['outputs']['depth'], s['outputs']['depth'], 1e-9)

    def test_floating(self):
        """A body that contact alone holds: its rigid motion is an unknown, and contact has its whole load."""
        scene = self.write('floating.yaml', FLOATING)
        self.judge(scene, ('-values_soft', '1.3,3.7', '-values_press', '77,333', '-values_tip', '-0.41,0.27'))
        r = self.hyco('predict', '-model', 'm.h5', '-mu', '2.2,123,0.3')
        s = self.hyco('solve', '-scene', scene, '-mu', '2.2,123,0.3')
        self.near(r['total_contact_force'], s['total_contact_force'], 1e-11)

    def test_many_floating(self):
        """A tilting block with 101 contacts, which alone hold it: the first problem has a quarter of them, the forces are those of full order."""
        scene = SHORT[0].replace('press: {x: 0, y: -press}', 'press: {x: 0}').replace('mesh: short', 'mesh: many').replace(
            'parameters: [press]', 'parameters: [press, tip]').replace('range: [0.01, 0.05]}', 'range: [1, 5]}\n  tip: {range: [-2, 2]}')
        self.drawn('many', 2, SHORT[1].replace('Curve{5:8} = 5', 'Curve{5, 7} = 101; Transfinite Curve{6, 8} = 5'),
                   scene + 'pressure: {press: press*(1 + tip*x)}\n')
        self.judge('many', ('-values_press', '1.7,4.2', '-values_tip', '-1.8,0.3,1.1'), u=1e-3, model='many.h5')

    def test_reshaped(self):
        """Bodies that contact alone holds, of which parameters change height, lean, angle and width: forces within the bound, those that balance
        the loads to round-off, also in a projection-based model, and derivatives as differences of predictions."""
        for name, (scene, geo), mu in (('foot', FOOT, (14.3, 1.3, 120)), ('wedge', WEDGE, (13.1, 1.07))):
            with self.subTest(name=name):
                self.drawn(name, 2, geo, scene)
                self.judge(name, ('-scatter', '8,4'), train=('-scatter', '4'), forces=1e-4, u=1e-2, options=('-hyco_bodies_samples', '30'))
                at = lambda point, *more: self.hyco('predict', '-model', 'm.h5', '-mu', ','.join(map(repr, point)), *more)
                p = at(mu, *(['-gradient'] if name == 'foot' else []))
                if name == 'foot':
                    half = 10*1.1
                    self.near(p['outputs']['push'], 2*half*mu[2]*(1 + 0.2*mu[1]/10), 1e-12)
                    self.hyco('train', '-scene', name, '-scatter', '6', '-hyco_model_type', 'projection', '-hyco_pod_tol', '1e-7', '-hyco_validation', '0',
                              '-hyco_snapshots', 'h.snapshots', '-model', 'h.h5')
                    h = self.hyco('predict', '-model', 'h.h5', '-mu', ','.join(map(repr, mu)))
                    self.near(h['outputs']['push'], p['outputs']['push'], 1e-9)
                    for balance in (p['balance'], self.hyco('solve', '-scene', name, '-mu', ','.join(map(repr, mu)))['balance']):
                        self.assertLess(balance, 1e-11)
                    self.assertLess(h['balance'], 1e-3)  # of the reaction `side`, from its displacements
                    # about the origin, of load*(1 + 0.02 x) over the top, -11 + lean to 11 + lean, and of the support there
                    self.near(p['outputs']['tilt'], mu[2]*(2*half*mu[1] + 0.02*(2*half*mu[1]**2 + 2*half**3/3)) + mu[0]*p['outputs']['side'], 1e-12)
                else:
                    self.near(p['outputs']['up_l'] + p['outputs']['up_r'], 90*24*mu[1], 1e-12)
                for i, parameter in enumerate(p['gradient']['push'] if name == 'foot' else ()):
                    step = 1e-4*mu[i]
                    b, a = (at([v + s*step*(i == k) for k, v in enumerate(mu)])['outputs'] for s in (1, -1))
                    for output in p['outputs']:
                        self.assertLess(abs(p['gradient'][output][parameter] - (b[output] - a[output])/(2*step)),
                                        1e-5*abs(p['outputs'][output])/abs(mu[i]))

    def test_reshaped_friction(self):
        """A foot that friction alone holds along its path, of which parameters change height and lean: it slips at its edges, the path is full order's."""
        scene = FOOT[0].replace('foot.msh', 'slips.msh').replace('mortar', 'pair, tolerance: 0.3, friction: 0.3').replace('top: {x: 0}, ', '').replace(
            ' + 0.05*(x/10)^2*(1 - y/16)', '').replace('-load*(1 + 0.2*x/10)"', '-load*t", x: "0.2*load*t^2"').replace(
            'side: {reaction: x, group: top}', 'shear: {friction: x, contact: sole}, lost: {friction: work}')
        self.drawn('slips', 2, FOOT[1].replace('x0 = -16; x1 = 16; y0 = -8; y1 = 0; nx = 18', 'x0 = -20; x1 = 20; y0 = -8; y1 = 0; nx = 24'),
                   scene + 'history: {times: [0, 0.5, 1]}\n')
        self.hyco('train', '-scene', 'slips', '-scatter', '3', '-hyco_model_type', 'bodies', '-hyco_validation', '3', '-model', 'slips.h5', status=None)
        for mu in ((13.1, 1.7, 60), (18.7, 0.2, 180)):
            at = '-mu', ','.join(map(repr, mu))
            full, model = (self.hyco(*command, *at)['outputs'] for command in (('solve', '-scene', 'slips'), ('predict', '-model', 'slips.h5')))
            self.assertGreater(full['lost'], 0)
            for name, value in full.items():
                self.near(model[name], value, 1e-3 if name == 'lost' else 1e-6, name)

    def test_obstacle(self):
        """One body under an obstacle that moves, on springs that soften with it."""
        scene = self.write('obstacle.yaml', OBSTACLE)
        self.judge(scene, ('-values_at', '-5.1,0.3,4.4', '-values_depth', '0.07,0.28', '-values_modulus', '6,17'))

    def test_sprung(self):
        """A body that only a soft spring holds: without contact all of its surface is closed, deeply, and the first problem is of the few nearest ones. Its
        displacement is the difference of large ones, whose rounding the residuals have and show. No share of the forces is in an RID, where there is none."""
        scene = self.write('sprung.yaml', SPRUNG)
        self.judge(scene, ('-values_place', '-2.3,3.1', '-values_press', '0.4,0.9'), forces=1e-8, model='sprung.h5', kkt=1e-10)
        found = self.hyco('predict', '-model', 'sprung.h5', '-mu', '1.3,0.5')
        self.assertLess(found['active_set_iterations'], 5)
        self.assertGreater(found['kkt']['penetration'] + found['kkt']['complementarity'], 0)
        self.assertNotIn('in the RID', self.run_raw('predict', '-model', 'sprung.h5', '-mu', '1.3,0.5').stdout)

    def test_shape(self):
        """A radius: more samples reduce the errors of the forces, which stay within the bound; points between the samples. Three are accurate,
        because its curvature is interpolated, in which the nodes move along lines."""
        with open(os.path.join(HERTZ, 'scene.yaml'), encoding='ascii') as f:
            ranges = {k: [float(v) for v in re.search(k + r': \{range: \[(.*?)\]', text)[1].split(',')]
                      for text in [f.read()] for k in ('press', 'stiffness', 'radius')}
        points = [w for k, share in (('press', (0.31, 0.87)), ('stiffness', (0.43,)), ('radius', (0.09, 0.37, 0.83)))
                  for w in ('-values_' + k, ','.join(f'{ranges[k][0] + s * (ranges[k][1] - ranges[k][0])!r}' for s in share))]
        errors, bounds = [], []
        for tol in ('0.1', '1e-6', '1e-9'):
            c = self.judge(HERTZ, points, forces=1e-2, u=1e-2, options=('-hyco_bodies_tol', tol))
            errors.append(c['error_lambda']['max'])
            found = re.search(r'contact forces within (\S+) \(bound at held-out samples of the bodies, (\d+) samples\)',
                              self.run_raw('view', '-model', 'm.h5').stdout)
            bounds.append(float(found[1]))
            self.assertLess(errors[-1], max(bounds[-1], 1e-10))
        self.assertLess(errors[0], 1e-4)
        self.assertLess(errors[1], errors[0] / 10)
        self.assertLess(errors[2], errors[1] / 10)
        self.assertLess(bounds[2], 1e-8)

    def test_no_stress(self):
        """At a small load the pellet is free and one component of the stress vanishes in all cells: its round-off is no error."""
        pellet = os.path.join(SOURCE, 'examples', 'pellet')
        self.hyco('train', '-scene', pellet, '-grid', '3,2', '-model', 'm.h5', *TYPE)
        errors = self.hyco('compare', '-scene', pellet, '-model', 'm.h5', '-values_radius', '4.06', '-values_load', '0.04,0.28,1')
        self.assertLess(errors['error_sigma_11']['max'], 1e-6)

    def test_ratio(self):
        """A modulus whose ratio to the stiffness of springs changes over a decade: samples over its logarithm."""
        scene = self.write('stiff.yaml', STIFF)
        self.assertIn('soft: changes the shape or the material of body foundation',
                      self.hyco('check', '-scene', scene)['bodies_by_parameter'])
        points = ('-values_soft', '0.61,1.7,4.4', '-values_press', '0.03,0.05')
        self.judge(scene, points, forces=1e-5)
        scaled = self.write('scaled.yaml', STIFF.replace('2e5,', '2e5*soft,'))  # the same parameter scales the other body
        self.judge(scaled, points, forces=1e-5)

    def test_factors(self):
        """A body is factored once for each sample of its own parameters: the other one once."""
        for scene in (HERTZ, self.write('stiff.yaml', STIFF)):
            t = self.hyco('train', '-scene', scene, *TYPE, '-scatter', '2', '-model', 'm.h5', '-hyco_bodies_tol', '1e-3')
            self.assertEqual(t['n_body_factors'], t['n_body_samples'] + 2 + 1)  # two are held out

    def test_check(self):
        """How each parameter enters each body, found by evaluation."""
        self.assertEqual(self.hyco('check', '-scene', ROLLER)['bodies_by_parameter'],
                         'place: moves body cylinder rigidly; press: changes loads or given displacements of body cylinder; '
                         'modulus: scales the stiffness of body block; no body needs a sample')
        said = self.hyco('check', '-scene', self.write('turned.yaml', TURNED))['bodies_by_parameter']
        self.assertIn('size: enlarges body cylinder uniformly', said)
        self.assertIn('turn: moves body cylinder rigidly', said)
        for held in ('y: -press', 'normal: -press, direction: {x: 1, y: 2}'):
            half = self.write('half.yaml', TURNED.replace('x: 0, y: -press', held) + 'spring: {cylinder_top: {x: 9}}\n')
            said = self.hyco('check', '-scene', half)['bodies_by_parameter']
            self.assertIn('turn: turns body cylinder without its support cylinder_top, which needs samples', said)
            self.assertNotIn('turn: changes the shape', said)
        said = self.hyco('check', '-scene', HERTZ)['bodies_by_parameter']
        self.assertIn('radius: changes the shape or the material of body upper, which needs samples', said)

    @unittest.skipIf(SANITIZED, 'a sanitizer changes times')
    def test_check_cost(self):
        """The CPU time of the whole default training is in the range that check announces before anything is solved, to a factor of 1.5, and that of a
        prediction within a factor of 3: of a scene that needs samples and of a larger one that needs none."""
        def cpu(*args):
            def total():
                used = resource.getrusage(resource.RUSAGE_CHILDREN)
                return used.ru_utime + used.ru_stime
            before = total()
            self.assertIn(subprocess.run([HYCO, *map(str, args)], cwd=self.folder, capture_output=True, check=False).returncode, (0, 3))
            return total() - before

        for scene, n in ((HERTZ, 1000), (ROLLER, 600)):
            said, other = (self.hyco('check', '-scene', scene)['estimate'] for _ in range(2))
            said = {name: min(said[name], other[name]) for name in ('seconds_bodies', 'seconds_bodies_most', 'seconds_prediction')}  # beside others
            training = cpu('train', '-scene', scene, '-grid', '2,2,2', '-model', 'cost.h5')
            first, all_ = (cpu('predict', '-model', 'cost.h5', '-scatter', k) for k in (1, n))
            with self.subTest(scene=scene, said=said, training=training, prediction=(all_ - first) / (n - 1)):
                self.assertGreater(training, said['seconds_bodies'] / 1.5)
                self.assertLess(training, said['seconds_bodies_most'] * 1.5)
                self.assertLess(said['seconds_bodies_most'], 10 * said['seconds_bodies'])
                self.assertLess(abs(np.log(said['seconds_prediction'] * (n - 1) / (all_ - first))), np.log(3))

    def test_solvers(self):
        """Every method that is asked for solves the contact problem of a prediction, with floating bodies too, and is named; tolerance and fallback act."""
        self.hyco('train', '-scene', ROLLER, *TYPE, '-scatter', '2', '-model', 'v.h5', '-output_push_force', 'y', '-output_push_contact', 'under')
        at = ('-model', 'v.h5', '-mu', '1.03,0.6,11')  # more than one iteration
        force = self.hyco('predict', *at)['total_contact_force']
        for name in ('lemke', 'semismooth', 'tao'):
            r = self.hyco('predict', *at, '-hyco_solver_type', name)
            self.assertIn(name, r['solver'])
            self.near(r['total_contact_force'], force, 1e-10)
        self.hyco('predict', *at, '-hyco_solver_max_its', '1')
        run = self.run_raw('predict', *at, '-hyco_solver_max_its', '1', '-hyco_solver_fallback', 'false')
        self.assertEqual(run.returncode, 1, run.stdout)
        self.assertIn('-extrapolate', self.run_raw('compare', '-scene', ROLLER, '-model', 'v.h5', '-mu', '5.2,0.5,9').stderr)
        self.assertLess(self.hyco('compare', '-scene', ROLLER, '-model', 'v.h5', '-mu', '5.2,0.5,9', '-extrapolate')['error_lambda']['max'], 1e-9)
        if not SANITIZED:  # the interpreter would need the sanitizers
            # of a set of gradients from Python, that point has nan and is named; alone it is the error
            run = subprocess.run([sys.executable, '-c', SET], cwd=self.folder, capture_output=True, text=True, timeout=60 * PATIENCE, check=False, env={
                **os.environ, 'PYTHONPATH': os.path.join(os.path.dirname(HYCO), 'python'), 'PETSC_OPTIONS': '-hyco_solver_max_its 1 -hyco_solver_fallback false'})
            self.assertEqual(run.stdout, '[[0.0, 0.0, 0.0], [nan, nan, nan]] [1] 1 True\nTrue\n', run.stderr)
        self.hyco('train', '-scene', self.write('floating.yaml', FLOATING), *TYPE, '-scatter', '2', '-model', 'w.h5')
        at = ('predict', '-model', 'w.h5', '-mu', '2.2,123,0.3', '-hyco_solver_fallback', 'false')
        expected = self.hyco(*at)
        for tao in (None, 'gpcg', 'tron', 'bntr', 'bnls', 'blmvm', 'bqnkls', 'ssils'):
            for kind in ('tao',) if tao else ('lemke', 'semismooth'):
                with self.subTest(kind=kind, tao=tao):
                    r = self.hyco(*at, '-hyco_solver_type', kind, *(('-hyco_tao_type', tao) if tao else ()))
                    self.assertIn(tao or kind, r['solver'])
                    self.assertEqual(r['n_active'], expected['n_active'])
                    self.near(r['total_contact_force'], expected['total_contact_force'], 1e-9)

    def test_unique(self):
        """A rigid tool with more closed slaves than its masters have unknowns: the forces are not unique, as full order says, but their sum is."""
        for tool in (True, False):
            with open(rigid_motions.Unique.columns(self, tool), encoding='ascii') as f:
                text = f.read().replace('mesh: columns.msh', 'mesh: columns.msh, parameters: [press]').replace('y: -0.01', 'y: -press')
            scene = self.write('unique.yaml', text + 'parameter: {press: {range: [0.005, 0.02]}}\n')
            self.hyco('train', '-scene', scene, *TYPE, '-scatter', '2', '-model', f'q{tool}.h5')
            p, s = (self.hyco(*run, '-mu', '0.013') for run in (('predict', '-model', f'q{tool}.h5'), ('solve', '-scene', scene)))
            self.assertEqual((p['forces_unique'], s['forces_unique']), (not tool, not tool))
            self.near(p['total_contact_force'], s['total_contact_force'], 1e-10)

    def test_ranks(self):
        """The same forces and the same output in the hottest cell from a training on one and more ranks: on two with samples, on three with a floating body."""
        for name, text, point, many in (('floating.yaml', FLOATING, '2.2,123,0.3', 3), ('stiff.yaml', STIFF, '1.9,0.041', 2)):
            scene = self.write(name, text + 'output: {hot: {max: mises}}\n')
            forces = []
            for ranks in (1, many):
                self.hyco('train', '-scene', scene, *TYPE, '-scatter', '2', '-model', 'r.h5', '-hyco_snapshots', 'snapshots', ranks=ranks)
                r = self.hyco('predict', '-model', 'r.h5', '-mu', point)
                forces.append((r['total_contact_force'], r['lambda_max'], r['outputs']['hot']))
            np.testing.assert_allclose(forces[1], forces[0], rtol=1e-9)

    def refused(self, scene, *words, options=()):
        run = self.run_raw('train', '-scene', scene, *TYPE, '-scatter', '2', '-model', 'no.h5', *options)
        self.assertEqual(run.returncode, 1)
        for word in words:
            self.assertIn(word, run.stderr)
        self.assertEqual(len([line for line in run.stderr.splitlines() if line.startswith('hyco: error')]), 1, run.stderr)
        self.assertFalse(os.path.exists(self.path('no.h5')))

    def test_refused(self):
        """What the model does not represent is named in one line: four parameters of the shape, bodies without contact, too
        little memory."""
        four = TURNED.replace('size*(x*cos(', 'size*(1 + place*y/99 + press*y/99 + modulus*y^2/999)*(x*cos(')
        self.refused(self.write('four.yaml', four), 'and a model of bodies samples at most 3')
        self.assertIn('at most 3', self.hyco('check', '-scene', self.path('four.yaml'))['bodies_by_parameter'])
        self.refused(ROLLER, 'GB to be made (the factor', '-hyco_memory', options=('-hyco_memory', '0.001', '-hyco_linear', 'direct'))
        alone = re.sub(r'contact: .*', '', TURNED)
        self.refused(self.write('alone.yaml', alone), 'the scene has no contact')


class Regimes(Case):
    """Trainings as a user's: held-out points, search."""
    newcomer = True
    LID = """
scene: {mesh: mesh.msh, parameters: [p, q]}
parameter: {p: {range: [0, 1]}, q: {range: [0, 1]}}
body: {block: {young: 1000, poisson: 0.3}}
fixed: {low: {x: 0, y: 0}}
pressure: {left: "%s"}
contact: {lid: {type: obstacle, group: high, normal: {y: 1}, gap: "abs(p-0.45)+abs(q-0.55)-0.2"}}
"""

    def test_rare_contact(self):
        """Contact at a twelfth of the ranges: bodies need no held-out point with contact, and are exact there; without points of the user's some are drawn."""
        scene = self.written(self.LID % '0', square(2))
        with open(self.path('none.csv'), 'w', encoding='ascii') as f:
            f.write('p,q\n0.02,0.1\n0.98,0.9\n0.1,0.9\n0.9,0.1\n0.03,0.52\n0.97,0.57\n')
        full = self.hyco('solve', '-scene', scene, '-mu', '0.45,0.56')
        for words in ((*TYPE, '-validation_points', self.path('none.csv')), ()):
            r = self.hyco('train', '-scene', scene, '-grid', '5,5', '-model', 'rare.h5', *words)
            self.assertEqual(r['model_type'], 'bodies')
            self.assertEqual(r['held_out']['lambda']['largest'] > 0, not words)  # round-off, where there are forces
            p = self.hyco('predict', '-model', 'rare.h5', '-mu', '0.45,0.56')
            self.near(p['total_contact_force'], full['total_contact_force'], 1e-10)

    def test_new_contacts(self):
        """A hybrid model whose training has no contact: where a prediction has, it is an unseen regime, without estimates."""
        scene = self.written(self.LID % '1 + p', square(2))
        self.hyco('train', '-scene', scene, '-grid', '2,2', '-hyco_model_type', 'hybrid', '-model', 'new.h5')
        p = self.hyco('predict', '-model', 'new.h5', '-mu', '0.45,0.56')
        self.assertGreater(p['unseen'], 3)
        self.assertIn('no training solution closes', p['unseen_feature'])
        self.assertEqual((p['estimated_error_u'], p['estimated_error_sigma'], p['estimated_error_lambda']), (None, None, None))
        self.assertIsNotNone(self.hyco('predict', '-model', 'new.h5', '-mu', '0.02,0.1')['estimated_error_u'])

    def test_samples_go_on(self):
        """Samples of a shape are added beyond 60 while they are cheap, until the bound is small, and corners have the forces of full order; what a
        limit of the user's leaves is said with the option."""
        scene = self.written("""
scene: {mesh: mesh.msh, parameters: [a, b]}
parameter: {a: {range: [0.3, 1.5]}, b: {range: [-0.4, 0.4]}}
body: {block: {young: 1000, poisson: 0.3, map: {x: "x*(1 + b*y)", y: "a*y*(1 + b*x)"}}}
fixed: {low: {x: 0, y: 0}}
contact: {lid: {type: obstacle, group: high, normal: {y: 1}, gap: "-0.02"}}
""", square(3))
        r = self.hyco('train', '-scene', scene, '-scatter', '5', *TYPE, '-model', 'on.h5')
        self.assertGreater(r['n_body_samples'], 60)
        for mu in ('0.3,-0.4', '1.5,0.4', '0.3,0.4'):
            p, full = self.hyco('predict', '-model', 'on.h5', '-mu', mu), self.hyco('solve', '-scene', scene, '-mu', mu)
            self.near(p['total_contact_force'], full['total_contact_force'], 1e-3)
        run = self.run_raw('train', '-scene', scene, '-scatter', '5', *TYPE, '-model', 'off.h5', '-hyco_bodies_max_samples', '20')
        self.assertIn('-hyco_bodies_max_samples', run.stdout)


if __name__ == '__main__':
    unittest.main()
