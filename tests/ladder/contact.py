"""A contact discretisation that a program registers (examples/ladder/contact.c): a rigid disk pressed into a block, against the obstacle
whose normal and gap are the same expressions; what a scene says of types and entries that are not there."""
import os
import re
import subprocess
import unittest

from common import HYCO, MPIRUN, PATIENCE, Case, msh

PROGRAM = os.path.join(os.path.dirname(HYCO), 'ladder', 'contact')
SCENE = """
scene: {title: a disk on a block, mesh: block.msh, parameters: [depth]}
parameter: {depth: {range: [0, 0.1]}}
body: {block: {young: 100, poisson: 0.3}}
fixed: {low: {x: 0, y: 0}}
contact: {disk: {%s}}
"""
# of centre (0.45, 1.8 - depth) and radius 0.8
SPHERE = 'type: sphere, group: high, centre: {x: 0.45, y: 1.8 - depth, z: 0}, radius: 0.8'
LENGTH = 'sqrt((x - 0.45)^2 + (y - 1.8 + depth)^2)'
OBSTACLE = f'type: obstacle, group: high, normal: {{x: 0.45 - x, y: 1.8 - depth - y}}, gap: "{LENGTH} - 0.8"'
OUT = re.compile(r'(\w+): (\d+) of (\d+) contacts closed, contact force (\S+), energy (\S+), u_y from (\S+)')


class Contact(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        n = 8
        nodes = [(i / n, j / n, 0) for j in range(n + 1) for i in range(n + 1)]
        at = lambda i, j: j * (n + 1) + i + 1
        elements = [(3, 1, (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1))) for j in range(n) for i in range(n)]
        for i in range(n):
            elements += [(1, 2, (at(i, 0), at(i + 1, 0))), (1, 3, (at(i, n), at(i + 1, n)))]
        msh(cls.path('block.msh'), nodes, elements, {1: (2, 'block'), 2: (1, 'low'), 3: (1, 'high')})

    def run_program(self, contact, *args, ranks=0):
        path = self.path('scene.yaml')
        with open(path, 'w', encoding='ascii') as file:
            file.write(SCENE % contact)
        command = [*(MPIRUN + [str(ranks)] if ranks else []), PROGRAM, path, *args]
        return subprocess.run(command, capture_output=True, text=True, timeout=60 * PATIENCE)

    def solve(self, *args, **options):
        run = self.run_program(*args, **options)
        self.assertEqual(run.returncode, 0, run.stderr)
        found = OUT.search(run.stdout)
        self.assertTrue(found, run.stdout)
        return [float(x) for x in found.groups()[1:]]

    def test_disk(self):
        """The disk's own type gives what an obstacle of the same shape gives, on any number of ranks; a disk that floats above presses nothing."""
        expected = self.solve(OBSTACLE, '0.06')
        self.assertGreater(expected[0], 2)
        self.assertLess(expected[0], expected[1])
        for ranks in (0, 2):
            for a, b in zip(self.solve(SPHERE, '0.06', ranks=ranks), expected):
                self.near(a, b, 1e-9)
        self.assertEqual(self.solve(SPHERE.replace('radius: 0.8', 'radius: 0.7'), '0.06')[0], 0)

    def refused(self, contact, *words):
        run = self.run_program(contact, '0.06')
        self.assertNotEqual(run.returncode, 0)
        for word in words:
            self.assertIn(word, run.stderr)

    def test_refused(self):
        self.refused(SPHERE.replace('type: sphere', 'type: spere'), 'contact disk', 'obstacle, pair, sphere or surface', 'did you mean sphere?')
        self.refused(SPHERE + ', gap: 1', 'contact_disk_gap', 'centre_x')
        self.refused(SPHERE.replace('radius:', 'raduis:'), 'contact_disk_raduis', 'did you mean radius?')
        self.refused(SPHERE.split(', radius')[0], 'contact disk', 'radius')
        self.refused(SPHERE.replace('high', 'hihg'), 'did you mean high?')
        run = self.run_raw('solve', '-scene', self.path('scene.yaml'), '-mu', 0.06)  # the command has no such type
        self.assertNotEqual(run.returncode, 0)
        self.assertIn('must be obstacle, pair or surface', run.stderr)


if __name__ == '__main__':
    unittest.main()
