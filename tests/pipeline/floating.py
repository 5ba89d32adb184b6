"""Floating bodies, and unconstrained bodies: K is singular, the contact problem of the former is not."""
import os
import subprocess
import unittest

import h5py
import numpy as np

from common import PATIENCE, PELLET, SOURCE, Case

BLOCK = """
scene: {title: block on a foundation, mesh: %s, parameters: [crown, press]}
parameter: {crown: {range: [0, 0.08]}, press: {range: [-100, 400]}}
body:
  block: {young: 2e5, poisson: 0.3, map: {y: "y + crown*(x/20)^2*(1 - y/16)"}}
  foundation: {young: 1e5, poisson: 0.3}
fixed: {block_sym: {x: 0}, foundation_sym: {x: 0}, foundation_base: {y: 0}}
pressure: {block_top: press}
contact: {under: {%s}}
"""
PAIR = 'type: pair, slave: block_under, master: foundation_top, tolerance: 1e-3'
OBSTACLE = 'type: obstacle, group: foundation_sym, normal: {x: -1}, gap: 1'
WIDTH = 20


class Block(Case):
    """Its top has a load instead of a prescribed displacement: only the foundation supports it."""

    @classmethod
    def scene(cls, contact):
        mesh = os.path.join(SOURCE, 'examples', 'blocks', 'blocks.msh')
        path = cls.path('scene.yaml')
        with open(path, 'w', encoding='ascii') as file:
            file.write(BLOCK % (mesh, contact))
        return path

    def test_pressed(self):
        """The contact has the whole load, its vertical part exactly."""
        for ranks in (1, 2):
            for form in ('dual', 'primal'):
                with self.subTest(ranks=ranks, form=form):
                    r = self.hyco('solve', '-scene', self.scene(PAIR), '-mu', '0.04,100', '-output', 'b.xdmf',
                                  '-hyco_solver_form', form, ranks=ranks)
                    self.solved(r)
                    with h5py.File(self.path('b.h5')) as f:
                        force = f['nodes/contact_force'][:]
                    self.near(abs(force[force[:, 1] > 0, 1].sum()), WIDTH * 100, 1e-10)

    def test_all_closed(self):
        """Without a crown every pair closes: the sum of the forces is the load."""
        r = self.hyco('solve', '-scene', self.scene(PAIR), '-mu', '0,100')
        self.assertEqual(r['n_active'], r['n_contacts'])
        self.near(r['total_contact_force'], WIDTH * 100, 1e-10)

    def test_taken_away(self):
        run = self.run_raw('solve', '-scene', self.scene(PAIR), '-mu', '0.04,-1', '-output', 'no.xdmf')
        self.assertEqual(run.returncode, 1)
        self.assertIn('a body is held by contact only, and this load lifts it off; no support keeps body block from moving '
                      'along (0, 1, 0)', run.stderr)
        self.assertFalse(os.path.exists(self.path('no.h5')))

    def test_other_types(self):
        run = self.run_raw('solve', '-scene', self.scene(PAIR), '-mu', '0.04,100', '-hyco_solver_type', 'lemke')
        self.assertEqual(run.returncode, 1)
        self.assertIn('use -hyco_solver_type active_set', run.stderr)

    def test_held_by_nothing(self):
        for ranks in (1, 2):
            run = self.run_raw('solve', '-scene', self.scene(OBSTACLE), '-mu', '0.04,100', ranks=ranks)
            self.assertNotEqual(run.returncode, 0)
            self.assertIn('no support and no contact keeps body block from moving along (0, 1, 0)', run.stderr)


class Pellet(Case):
    """The pellet without its z-symmetry condition, on a table instead; its cladding keeps the condition."""

    def test_table(self):
        geo, mesh = self.path('table.geo'), self.path('table.msh')
        with open(os.path.join(PELLET, 'pellet.geo'), encoding='ascii') as file:
            text = file.read()
        with open(geo, 'w', encoding='ascii') as file:
            file.write(text + '\nPhysical Surface("pellet_z0", 31) = {1,2,3};\nPhysical Surface("clad_z0", 32) = {4,5};\n')
        settings = [w for pair in (('m', 4), ('nr', 4), ('nc', 2), ('nzl', 6), ('nzh', 14)) for w in
                    ('-setnumber', pair[0], str(pair[1]))]
        subprocess.run(['gmsh', '-3', geo, *settings, '-format', 'msh41', '-o', mesh, '-v', '1'], check=True, timeout=60 * PATIENCE)
        with open(os.path.join(PELLET, 'scene.yaml'), encoding='ascii') as file:
            scene = file.read().replace('mesh: A.msh', f'mesh: {mesh}').replace('sym_z0: {z: 0}', 'clad_z0: {z: 0}')
        scene = scene.replace('contact:\n', 'contact:\n  table: {type: obstacle, group: pellet_z0, normal: {z: -1}, gap: 0}\n')
        # a node is the slave of one contact: the pellet's lower edge is the table's, so the cladding is the pair's
        scene = scene.replace('slave: contact_pellet', 'slave: contact_clad', 1).replace('master: contact_clad', 'master: contact_pellet', 1)
        scene = scene.replace('normal: {x: x, y: y}', 'normal: {x: -x, y: -y}')
        path = self.path('table.yaml')
        with open(path, 'w', encoding='ascii') as file:
            file.write(scene)
        supported = self.hyco('solve', '-scene', PELLET, '-mu', '4.06,1')
        for ranks in (1, 2):
            r = self.hyco('solve', '-scene', path, '-mu', '4.06,1', '-output', 't.xdmf', ranks=ranks)
            self.solved(r)
            self.assertIn('held by contact', r['solver'])
            with h5py.File(self.path('t.h5')) as f:
                force, x = f['nodes/contact_force'][:], f['mesh/xyz'][:]
            table = np.isclose(x[:, 2], 0) & (force[:, 2] > 0)
            self.near(force[table, 2].sum(), 64.316, 1e-5)  # the weight of the pressures, computed independently
            gap = r['total_contact_force'] - force[table, 2].sum()
            self.near(gap, supported['total_contact_force'], 0.05)  # the table may open where the plane would pull


if __name__ == '__main__':
    unittest.main()
