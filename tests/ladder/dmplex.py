"""A mesh that a program passes as a DMPlex (examples/ladder/dmplex.c): the numbers of the same mesh as a file, on any number of
ranks, refined and not; and refusals."""
import unittest

from common import Program, msh, square

SCENE = """
scene: {title: a box pressed on a floor%s}
body: {block: {young: 100, poisson: 0.3}}
force: {block: {x: 1 + y}}
fixed: {left: {%s}}
pressure: {high: 1 + x}
contact: {floor: {type: obstacle, group: low, normal: {%s: -1}, gap: 0.001*x}}
"""


class DMPlex(Program):
    name = 'dmplex'
    scene_text = SCENE
    out = r'(\w+): (\d+) unknowns, contact force (\S+), energy (\S+)'

    def box(self, mesh='', fixed='x: 0, y: 0', axis='y'):
        return self.scene(mesh, fixed, axis)

    def numbers(self, *args, ranks=0):
        reason, *numbers = self.solve(*args, ranks=ranks)
        self.assertEqual(reason, 'converged')
        return numbers

    def test_as_a_file(self):
        """A program's DMPlex, distributed or not, gives the numbers of the file on 1 to 3 ranks."""
        msh(self.path('square.msh'), *square(8))
        expected = self.hyco('solve', '-scene', self.box(', mesh: square.msh'))
        scene = self.box()
        for ranks in (0, 2, 3):
            for shape in (('-dm_plex_box_faces', '8,8'), ('-dm_plex_box_faces', '8,8', '-dm_distribute', '0'),
                          ('-dm_plex_box_faces', '8,8', '-dm_distribute_overlap', '1'),
                          ('-dm_plex_box_faces', '4,4', '-scene_refine', '1')):
                with self.subTest(ranks=ranks, shape=shape):
                    unknowns, force, energy = self.numbers(scene, '-dm_plex_dim', '2', '-dm_plex_simplex', '0', *shape, ranks=ranks)
                    self.assertEqual(unknowns, expected['n_dof'])
                    self.near(force, expected['total_contact_force'], 1e-9)
                    self.near(energy, expected['strain_energy'], 1e-9)

    def test_hexahedra(self):
        """The same on one rank and on three. (PETSc makes simplices by libraries that it may not have.)"""
        scene = self.box(fixed='x: 0, y: 0, z: 0', axis='z')
        args = (scene, '-dm_plex_dim', '3', '-dm_plex_simplex', '0', '-dm_plex_box_faces', '4,4,4')
        alone, three = self.numbers(*args), self.numbers(*args, ranks=3)
        self.assertEqual(alone[0], three[0])
        self.near(three[1], alone[1], 1e-9)
        self.near(three[2], alone[2], 1e-9)

    def test_refused(self):
        """A group that the DMPlex does not have is named."""
        for ranks in (0, 2):
            self.refused(['no group "lift"'], self.box(), '-dm_plex_dim', '2', '-dm_plex_simplex', '0', '-dm_plex_box_faces', '4,4',
                         '-fixed_lift_x', '0', ranks=ranks)


if __name__ == '__main__':
    unittest.main()
