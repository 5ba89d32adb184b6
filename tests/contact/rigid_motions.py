"""Rigid motions that neither supports nor frictionless contact prevent, the same on every mesh of one geometry; contact forces that
are not unique."""
import json
import os
import subprocess
import unittest

import h5py
import numpy as np

from common import PATIENCE, PELLET, SOURCE, Case, msh

BLOCKS = os.path.join(SOURCE, 'examples', 'blocks')
HALF = """
Geometry.AutoCoherence = 0;
DefineConstant[ n = {12}, m = {17}, r = {10}, c = {3}, d = {6}, p = {1} ];
h = 2*c/n; g = 2*c/m; coarse = r/4;
Point(1) = {0, r, 0, coarse}; Point(2) = {-c, r - Sqrt(r*r - c*c), 0, h}; Point(4) = {c, r - Sqrt(r*r - c*c), 0, h};
Point(5) = {r, r, 0, coarse}; Point(6) = {-r, r, 0, coarse};
Circle(1) = {6, 1, 2}; Circle(2) = {2, 1, 4}; Circle(3) = {4, 1, 5}; Line(4) = {5, 1}; Line(5) = {1, 6};
Curve Loop(1) = {1, 2, 3, 4, 5}; Plane Surface(1) = {1};
Point(11) = {-d, 0, 0, g}; Point(12) = {d, 0, 0, g}; Point(13) = {d, -d, 0, coarse}; Point(14) = {-d, -d, 0, coarse};
Line(11) = {12, 11}; Line(12) = {11, 14}; Line(13) = {14, 13}; Line(14) = {13, 12};
Curve Loop(2) = {11, 12, 13, 14}; Plane Surface(2) = {2};
Transfinite Curve {2} = n + 1 Using Progression p;
Physical Surface("disk", 1) = {1}; Physical Surface("plate", 2) = {2};
Physical Curve("arc", 11) = {2}; Physical Curve("top", 12) = {4, 5}; Physical Point("centre", 13) = {1};
Physical Curve("face", 14) = {11}; Physical Curve("base", 15) = {13}; Physical Point("corner", 16) = {5};
"""
SCENE = """
scene: {title: half-disk on a plate, mesh: half.msh, parameters: [load]}
parameter: {load: {range: [0, 100]}}
body: {disk: {young: 1e4, poisson: 0.3}, plate: {young: 1e4, poisson: 0.3}}
fixed: {%sbase: {x: 0, y: 0}}
pressure: {top: '%s'}
contact: {seat: {%s}}
"""
ARC = 'type: surface, slave: arc, master: face, tolerance: 0.6'
FACE = 'type: surface, slave: face, master: arc, tolerance: 0.6'
PLANE = 'type: obstacle, group: arc, normal: {y: -1}, gap: y'
CENTRE = 'centre: {x: 0}, '
BALL = """
DefineConstant[ h = {1}, r = {10}, c = {3.5}, g = {1.3} ];
z = r - Sqrt(r*r - c*c);
Point(1) = {0,0,r,4}; Point(2) = {0,0,0,h};
Point(3) = {c,0,z,h}; Point(4) = {0,c,z,h}; Point(5) = {-c,0,z,h}; Point(6) = {0,-c,z,h}; Point(7)={0,0,z,h};
Point(13) = {r,0,r,4}; Point(14) = {0,r,r,4}; Point(15) = {-r,0,r,4}; Point(16) = {0,-r,r,4};
Circle(1) = {3,7,4}; Circle(2) = {4,7,5}; Circle(3) = {5,7,6}; Circle(4) = {6,7,3};
Circle(11) = {13,1,14}; Circle(12) = {14,1,15}; Circle(13) = {15,1,16}; Circle(14) = {16,1,13};
Circle(21) = {2,1,3}; Circle(22) = {2,1,4}; Circle(23) = {2,1,5}; Circle(24) = {2,1,6};
Circle(31) = {3,1,13}; Circle(32) = {4,1,14}; Circle(33) = {5,1,15}; Circle(34) = {6,1,16};
Line(41) = {1,13}; Line(42) = {1,14}; Line(43) = {1,15}; Line(44) = {1,16};
For k In {0:3}
  j = (k+1)%4;
  Curve Loop(1+k) = {21+k, 1+k, -(21+j)}; Surface(1+k) = {1+k} In Sphere {1};
  Curve Loop(11+k) = {31+k, 11+k, -(31+j), -(1+k)}; Surface(11+k) = {11+k} In Sphere {1};
  Curve Loop(21+k) = {41+k, 11+k, -(41+j)}; Plane Surface(21+k) = {21+k};
EndFor
Surface Loop(1) = {1:4, 11:14, 21:24}; Volume(1) = {1};
Point(201) = {-5,-5,0,g}; Point(202) = {5,-5,0,g}; Point(203) = {5,5,0,g}; Point(204) = {-5,5,0,g};
Line(201) = {201,202}; Line(202) = {202,203}; Line(203) = {203,204}; Line(204) = {204,201};
Curve Loop(201) = {201:204}; Plane Surface(201) = {201};
o[] = Extrude {0,0,-3} { Surface{201}; Layers{2}; };
Physical Volume("ball", 1) = {1}; Physical Volume("plate", 2) = {o[1]};
Physical Surface("cap", 11) = {1:4}; Physical Surface("top", 12) = {21:24}; Physical Point("centre", 13) = {1};
Physical Surface("face", 14) = {201}; Physical Surface("base", 15) = {o[0]};
"""
BALL_SCENE = """
scene: {title: half-ball on a plate, mesh: ball.msh, parameters: [load]}
parameter: {load: {range: [0, 100]}}
body: {ball: {young: 1e4, poisson: 0.3}, plate: {young: 1e4, poisson: 0.3}}
fixed: {centre: {x: 0, y: 0}, base: {x: 0, y: 0, z: 0}}
pressure: {top: load}
contact: {seat: {type: surface, slave: cap, master: face, tolerance: 0.8}}
"""
#          n, m, ratio of neighbouring facets of the arc, half width of the plate
MESHES = ((8, 11, 1, 6), (12, 17, 1, 6), (13, 9, 1.15, 6), (31, 40, 1, 6))
TURNING = 'body disk from turning about (0, 0, 1) through ('


class HalfDisk(Case):
    """Its flat side up, pressed by a pressure: free to turn about its centre, whatever the mesh."""

    @classmethod
    def mesh(cls, n, m, ratio, width):
        with open(cls.path('half.geo'), 'w', encoding='ascii') as file:
            file.write(HALF)
        subprocess.run(['gmsh', '-2', cls.path('half.geo'), '-setnumber', 'n', str(n), '-setnumber', 'm', str(m), '-setnumber',
                        'p', str(ratio), '-setnumber', 'd', str(width), '-format', 'msh41', '-o', cls.path('half.msh'), '-v', '0'],
                       check=True, timeout=60 * PATIENCE)

    def scene(self, contact=ARC, fixed=CENTRE, load='load'):
        with open(self.path('scene.yaml'), 'w', encoding='ascii') as file:
            file.write(SCENE % (fixed, load, contact))
        return self.path('scene.yaml')

    def refused(self, *args, ranks=0):
        run = self.run_raw(*args, '-output', 'no.xdmf', ranks=ranks)
        self.assertNotEqual(run.returncode, 0, run.stdout)
        self.assertFalse(os.path.exists(self.path('no.h5')))
        return next(line for line in run.stderr.splitlines() if 'error: ' in line)

    def test_named_on_every_mesh(self):
        """Slave and master may change places, and the normal may be the plate's."""
        for n, m, ratio, width in MESHES:
            for contact in (ARC, PLANE, FACE):
                with self.subTest(n=n, ratio=ratio, contact=contact):
                    self.mesh(n, m, ratio, 2.7 if contact == FACE else width)
                    said = self.refused('solve', '-scene', self.scene(contact), '-mu', 10)
                    self.assertIn(TURNING, said)
                    self.assertNotIn('nor body', said)
                    at = [float(v) for v in said.split('through (')[1].split(')')[0].split(',')]
                    self.assertLess(np.abs(np.array(at) - (0, 10, 0)).max(), 0.01)

    def test_free_to_slide_too(self):
        """Without supports, sliding is named beside turning, on every mesh."""
        for n, m, ratio, width in MESHES:
            self.mesh(n, m, ratio, width)
            said = self.refused('solve', '-scene', self.scene(fixed=''), '-mu', 10)
            self.assertIn(TURNING, said)
            self.assertIn('nor body disk from moving along (1, 0, 0)', said)

    def test_regularised(self):
        """Vertical equilibrium, zero mean rotation, the same result on all ranks; meshes agree within the resolution of the contact."""
        deep = []
        for n, m, ratio, width in MESHES:
            self.mesh(n, m, ratio, width)
            for fixed in (CENTRE, ''):
                norms = []
                for ranks in (0, 2, 3) if n == 12 else (0,):
                    r = self.hyco('solve', '-scene', self.scene(fixed=fixed), '-mu', 10, '-hyco_regularise', '-output', 'h.xdmf',
                                  ranks=ranks)
                    self.solved(r)
                    self.assertIn(TURNING, r['regularised'])
                    norms.append(r['u_norm2'])
                    with h5py.File(self.path('h.h5')) as f:
                        force, x, u = f['nodes/contact_force'][:], f['mesh/xyz'][:], f['nodes/displacement'][:]
                    self.near(abs(force[force[:, 1] > 0, 1].sum()), 10 * 20, 1e-4, 'the load')
                    disk = np.hypot(x[:, 0], x[:, 1] - 10) < 10.001
                    disk &= x[:, 1] > 1e-9
                    turn = u[disk, 1] * x[disk, 0] - u[disk, 0] * (x[disk, 1] - 10)
                    if fixed:
                        self.assertLess(abs(turn.sum()), 0.02 * abs(turn).sum(), 'mean rotation')
                for norm in norms[1:]:
                    self.near(norm, norms[0], 1e-9, 'ranks')
                deep.append(r['u_min'][1])
        for value in deep[1:]:
            self.near(value, deep[0], 0.1)

    def test_accelerated(self):
        """A load that turns the disk has no equilibrium; one with a moment below the tolerance has."""
        self.mesh(12, 17, 1, 6)
        for ranks in (0, 2):
            said = self.refused('solve', '-scene', self.scene(load='load*(1 + 0.1*x)'), '-mu', 10, '-hyco_regularise', ranks=ranks)
            self.assertIn(TURNING, said)
            self.assertIn('hyco_regularise_tol', said)
        slight = self.scene(load='load*(1 + 0.001*x)')
        self.hyco('solve', '-scene', slight, '-mu', 10, '-hyco_regularise')
        self.refused('solve', '-scene', slight, '-mu', 10, '-hyco_regularise', '-hyco_regularise_tol', 1e-4)

    def test_in_the_scene(self):
        """regularise: true in the scene is the option, and the report names the motion."""
        self.mesh(12, 17, 1, 6)
        scene = self.scene()
        with open(scene, 'a', encoding='ascii') as file:
            file.write('hyco: {regularise: true}\n')
        one = self.hyco('solve', '-scene', scene, '-mu', 10)
        self.assertIn(TURNING, one['regularised'])
        run = self.run_raw('solve', '-scene', scene, '-values_load', '5,10', '-table', 't.csv')
        self.assertEqual(run.returncode, 0, run.stderr)
        with open(self.path('t.csv'), encoding='ascii') as file:
            last = file.read().splitlines()[-1].split(',')
        self.near(float(last[1]), one['total_contact_force'], 1e-7)
        run = self.run_raw('train', '-scene', scene, '-values_load', '5,10,20', '-model', 'm.h5')
        self.assertNotEqual(run.returncode, 0)
        self.assertIn('fix a component', run.stderr)

    def test_held_by_a_support(self):
        """A second support prevents the rotation: nothing is left to regularise, and the option changes nothing."""
        self.mesh(12, 17, 1, 6)
        scene = self.scene(fixed=CENTRE + 'corner: {y: 0}, ')
        plain = self.hyco('solve', '-scene', scene, '-mu', 10)
        self.assertEqual(plain['regularised'], '')
        self.near(self.hyco('solve', '-scene', scene, '-mu', 10, '-hyco_regularise')['u_norm2'], plain['u_norm2'], 1e-12)


class HalfBall(Case):
    """In 3D, tetrahedra of no pattern: three rotations about one point."""

    def test_named_and_regularised(self):
        """A half ball in 3D: its three rotations are named, and regularised."""
        with open(self.path('ball.geo'), 'w', encoding='ascii') as file:
            file.write(BALL)
        with open(self.path('scene.yaml'), 'w', encoding='ascii') as file:
            file.write(BALL_SCENE)
        for h in (1, 0.7):
            subprocess.run(['gmsh', '-3', self.path('ball.geo'), '-setnumber', 'h', str(h), '-format', 'msh41', '-o',
                            self.path('ball.msh'), '-v', '0'], check=True, timeout=60 * PATIENCE)
            run = self.run_raw('solve', '-scene', self.path('scene.yaml'), '-mu', 10)
            self.assertNotEqual(run.returncode, 0)
            for axis in ('(1, 0, 0)', '(0, 1, 0)', '(0, 0, 1)'):
                self.assertIn('body ball from turning about ' + axis, run.stderr)
            self.assertEqual(run.stderr.count('body ball from'), 3)
            norms = []
            for ranks in (0, 2):
                r = self.hyco('solve', '-scene', self.path('scene.yaml'), '-mu', 10, '-hyco_regularise', ranks=ranks)
                self.solved(r)
                norms.append(r['u_norm2'])
            self.near(norms[1], norms[0], 1e-9, 'ranks')


class Held(Case):
    """Motions that contact does prevent by its shape are not affected."""

    def test_crowned_block(self):
        """A whole block on a crown of 5 m radius rocks on it and is held: only sliding is free, until a node is fixed."""
        with open(os.path.join(BLOCKS, 'scene.yaml'), encoding='utf-8') as file:
            text = file.read().replace('blocks.msh', os.path.join(BLOCKS, 'blocks.msh'))
        self.assertIn('block_top: {y: -press}', text)
        text = text.replace('  block_top: {y: -press}', '').replace('contact:', 'pressure: {block_top: 1000*press}\ncontact:', 1)
        with open(self.path('pressed.yaml'), 'w', encoding='utf-8') as file:
            file.write(text)
        r = self.hyco('solve', '-scene', self.path('pressed.yaml'), '-mu', '0.05,0.06')
        self.solved(r)
        self.assertEqual(r['regularised'], '')
        self.near(r['total_contact_force'], 20 * 60, 1e-3)

    def test_pellet_turning(self):
        """The pellet without its symmetry in x and y, normals given: free to turn about its axis, and reported so."""
        with open(os.path.join(PELLET, 'scene.yaml'), encoding='utf-8') as file:
            text = file.read().replace('mesh: A.msh', 'mesh: ' + os.path.join(PELLET, 'A.msh'))
        text = text.replace('  sym_x0: {x: 0}\n', '  clad_outer_high: {x: 0, y: 0}\n').replace('  sym_y0: {y: 0}\n', '')
        with open(self.path('pellet.yaml'), 'w', encoding='utf-8') as file:
            file.write(text)
        run = self.run_raw('solve', '-scene', self.path('pellet.yaml'), '-mu', '4.06,1')
        self.assertNotEqual(run.returncode, 0)
        self.assertIn('body pellet from turning about (0, 0, 1) through (0, 0, ', run.stderr)


class Unique(Case):
    """A rigid tool with more nodes than the face that it presses."""

    def columns(self, tool):
        """A column of 2 x 2 cells under a row of 8 cells; with `tool` the row's foot is fixed and comes down."""
        nodes = [(i / 2, j / 2, 0) for j in range(3) for i in range(3)] + [(i / 8, 1 + j / 8, 0) for j in range(2) for i in range(9)]
        elements = [(3, 1, (1 + i + 3 * j, 2 + i + 3 * j, 5 + i + 3 * j, 4 + i + 3 * j)) for j in range(2) for i in range(2)]
        elements += [(3, 2, (10 + i, 11 + i, 20 + i, 19 + i)) for i in range(8)]
        elements += [(1, 3, (1 + i, 2 + i)) for i in range(2)] + [(1, 4, (7 + i, 8 + i)) for i in range(2)]
        elements += [(1, 5, (10 + i, 11 + i)) for i in range(8)] + [(1, 6, (19 + i, 20 + i)) for i in range(8)]
        msh(self.path('columns.msh'), nodes, elements, {1: (2, 'lower'), 2: (2, 'upper'), 3: (1, 'base'), 4: (1, 'head'),
                                                        5: (1, 'foot'), 6: (1, 'lid')})
        with open(self.path('scene.yaml'), 'w', encoding='ascii') as file:
            file.write('scene: {title: tool, mesh: columns.msh}\nbody: {lower: {young: 100}, upper: {young: 100}}\n'
                       'fixed: {base: {x: 0, y: 0}, %s: {x: 0, y: -0.01}}\n'
                       'contact: {between: {type: surface, slave: foot, master: head, tolerance: 0.01}}\n' % ('foot' if tool else 'lid'))
        return self.path('scene.yaml')

    def test_tool(self):
        """Nine slaves on three masters: six depend. The displacement is that of a head that is moved itself."""
        for ranks in (0, 2):
            scene = self.columns(True)
            report = self.path('tool.json')
            run = self.run_raw('solve', '-scene', scene, '-report', report, ranks=ranks)
            self.assertEqual(run.returncode, 0, run.stderr)
            self.assertIn('not unique', run.stdout)
            with open(report, encoding='utf-8') as file:
                r = json.load(file)
            self.assertEqual((r['forces_unique'], r['n_dependent']), (False, 6))
            # plane strain, Poisson's ratio 0: a column of height 1 and modulus 100, pressed by 0.01
            self.near(r['total_contact_force'], 1, 1e-9)

    def test_elastic(self):
        """Forces of elastic columns are reported as unique."""
        run = self.hyco('solve', '-scene', self.columns(False))
        self.assertEqual((run['forces_unique'], run['n_dependent']), (True, 0))


if __name__ == '__main__':
    unittest.main()
