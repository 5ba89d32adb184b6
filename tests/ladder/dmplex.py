"""A mesh that a program hands over as a DMPlex (examples/ladder/dmplex.c): the numbers of the same mesh as a file, on any
number of ranks, refined and not; and what is refused."""
import os
import re
import subprocess
import unittest

from common import HYCO, MPIRUN, PATIENCE, Case, msh

PROGRAM = os.path.join(os.path.dirname(HYCO), 'ladder', 'dmplex')
SCENE = """
scene: {title: a box pressed on a floor%s}
body: {block: {young: 100, poisson: 0.3}}
force: {block: {x: 1 + y}}
fixed: {left: {%s}}
pressure: {high: 1 + x}
contact: {floor: {type: obstacle, group: low, normal: {%s: -1}, gap: 0.001*x}}
"""
OUT = re.compile(r'(\w+): (\d+) unknowns, contact force (\S+), energy (\S+)')


def square(n):
    nodes = [(i / n, j / n, 0) for j in range(n + 1) for i in range(n + 1)]
    at = lambda i, j: j * (n + 1) + i + 1
    cells = [(3, 1, (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1))) for j in range(n) for i in range(n)]
    sides = [(1, 2, (at(i, 0), at(i + 1, 0))) for i in range(n)] + [(1, 3, (at(i, n), at(i + 1, n))) for i in range(n)]
    return nodes, cells + sides + [(1, 4, (at(0, j), at(0, j + 1))) for j in range(n)], {
        1: (2, 'block'), 2: (1, 'low'), 3: (1, 'high'), 4: (1, 'left')}


class DMPlex(Case):
    def scene(self, mesh='', fixed='x: 0, y: 0', axis='y'):
        path = self.path('scene.yaml')
        with open(path, 'w', encoding='ascii') as file:
            file.write(SCENE % (mesh, fixed, axis))
        return path

    def run_program(self, scene, *args, ranks=0):
        command = [*(MPIRUN + [str(ranks)] if ranks else []), PROGRAM, scene, *args]
        return subprocess.run(command, capture_output=True, text=True, timeout=60 * PATIENCE)

    def solve(self, *args, **options):
        run = self.run_program(*args, **options)
        self.assertEqual(run.returncode, 0, run.stderr)
        found = OUT.search(run.stdout)
        self.assertTrue(found, run.stdout)
        self.assertIn('CONVERGED', found[1].upper())
        return int(found[2]), float(found[3]), float(found[4])

    def test_as_a_file(self):
        msh(self.path('square.msh'), *square(8))
        expected = self.hyco('solve', '-scene', self.scene(', mesh: square.msh'))
        scene = self.scene()
        for ranks in (0, 2, 3):
            for shape in (('-dm_plex_box_faces', '8,8'), ('-dm_plex_box_faces', '8,8', '-dm_distribute', '0'),
                          ('-dm_plex_box_faces', '8,8', '-dm_distribute_overlap', '1'),
                          ('-dm_plex_box_faces', '4,4', '-scene_refine', '1')):
                with self.subTest(ranks=ranks, shape=shape):
                    unknowns, force, energy = self.solve(scene, '-dm_plex_dim', '2', '-dm_plex_simplex', '0', *shape, ranks=ranks)
                    self.assertEqual(unknowns, expected['n_dof'])
                    self.near(force, expected['total_contact_force'], 1e-9)
                    self.near(energy, expected['strain_energy'], 1e-9)

    def test_hexahedra(self):
        """The same on one rank and on three. (PETSc makes simplices by libraries that it may not have.)"""
        scene = self.scene(fixed='x: 0, y: 0, z: 0', axis='z')
        args = (scene, '-dm_plex_dim', '3', '-dm_plex_simplex', '0', '-dm_plex_box_faces', '4,4,4')
        alone, three = self.solve(*args), self.solve(*args, ranks=3)
        self.assertEqual(alone[0], three[0])
        self.near(three[1], alone[1], 1e-9)
        self.near(three[2], alone[2], 1e-9)

    def test_refused(self):
        for ranks in (0, 2):
            run = self.run_program(self.scene(), '-dm_plex_dim', '2', '-dm_plex_simplex', '0', '-dm_plex_box_faces', '4,4',
                                   '-fixed_lift_x', '0', ranks=ranks)
            self.assertNotEqual(run.returncode, 0)
            self.assertIn('no group "lift"', run.stderr)


if __name__ == '__main__':
    unittest.main()
