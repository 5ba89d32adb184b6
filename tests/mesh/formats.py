"""The same mesh in gmsh's formats 2.2 and 4.1, ASCII and binary: the same solution."""
import os
import subprocess
import unittest

from common import PATIENCE, PELLET, ROPE, Case


class Formats(Case):
    def same(self, scene, mesh, mu):
        expected = self.hyco('solve', '-scene', scene, '-mu', mu)
        for version in ('msh22', 'msh41'):
            for binary in (False, True):
                with self.subTest(version=version, binary=binary):
                    out = self.path(f'{version}{binary}.msh')
                    subprocess.run(['gmsh', mesh, '-save', '-format', version, '-o', out, '-v', '1'] +
                                   (['-bin'] if binary else []), check=True, timeout=60 * PATIENCE)
                    with open(out, 'rb') as f:
                        head = f.read(60).split(b'\n')[1].split()
                    self.assertEqual((head[0][:3], head[1]), ({'msh22': b'2.2', 'msh41': b'4.1'}[version],
                                                              b'1' if binary else b'0'))
                    r = self.hyco('solve', '-scene', scene, '-mu', mu, '-scene_mesh', out)
                    self.near(r['total_contact_force'], expected['total_contact_force'], 1e-9)
                    self.near(r['strain_energy'], expected['strain_energy'], 1e-9)
                    self.assertEqual((r['n_dof'], r['n_active']), (expected['n_dof'], expected['n_active']))

    def test_sides_in_several_groups(self):
        """A unit square whose top lies in two groups that push, 0.1 and 0.05: sigma_yy = -0.15, sigma_xx = -0.05 with
        E = 1, nu = 0; format 2.2 holds the top's lines twice."""
        with open(self.path('square.geo'), 'w', encoding='ascii') as f:
            f.write('SetFactory("OpenCASCADE"); Rectangle(1) = {0, 0, 0, 1, 1}; MeshSize {:} = 0.3;\n'
                    'Physical Surface("block", 1) = {1}; Physical Curve("skin", 2) = {1:4};\n'
                    'Physical Curve("top", 3) = {3}; Physical Curve("low", 4) = {1};\n'
                    'Physical Curve("left", 5) = {4};\n')
        with open(self.path('scene.yaml'), 'w', encoding='ascii') as f:
            f.write('scene: {title: square, mesh: square.msh}\nbody: {block: {young: 1}}\n'
                    'fixed: {low: {y: 0}, left: {x: 0}}\npressure: {top: 0.1, skin: 0.05}\n')
        for version in ('msh22', 'msh41'):
            with self.subTest(version=version):
                subprocess.run(['gmsh', '-2', self.path('square.geo'), '-format', version, '-v', '1', '-o',
                                self.path('square.msh')], check=True, timeout=60 * PATIENCE)
                r = self.hyco('solve', '-scene', self.folder)
                self.near(r['u_min'][0], -0.05, 1e-12)
                self.near(r['u_min'][1], -0.15, 1e-12)

    def test_rope(self):
        """The rope's mesh in each format."""
        self.same(ROPE, os.path.join(ROPE, 'rope.msh'), '0.07,0.17')

    def test_pellet(self):
        """The pellet's mesh in each format."""
        self.same(PELLET, os.path.join(PELLET, 'A.msh'), '4.06,1')


if __name__ == '__main__':
    unittest.main()
