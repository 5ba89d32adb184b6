"""A contact discretisation that a program registers (examples/ladder/contact.c): a rigid disk pressed into a block, compared with the obstacle
with the same expressions for normal and gap; messages for unknown types and entries."""
import unittest

from common import Program, msh, square

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


class Contact(Program):
    name = 'contact'
    scene_text = SCENE
    out = r'(\w+): (\d+) of (\d+) contacts closed, contact force (\S+), energy (\S+), u_y from (\S+)'

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        msh(cls.path('block.msh'), *square(8))

    def disk(self, contact, ranks=0):
        """The numbers where the disk, as this contact, is pressed in by 0.06."""
        return self.solve(self.scene(contact), '0.06', ranks=ranks)[1:]

    def test_disk(self):
        """The disk's type gives the results of an obstacle of the same shape, on any number of ranks; a disk above the block has no contact
        forces."""
        expected = self.disk(OBSTACLE)
        self.assertGreater(expected[0], 2)
        self.assertLess(expected[0], expected[1])
        for ranks in (0, 2):
            for a, b in zip(self.disk(SPHERE, ranks), expected):
                self.near(a, b, 1e-9)
        self.assertEqual(self.disk(SPHERE.replace('radius: 0.8', 'radius: 0.7'))[0], 0)

    def test_refused(self):
        """Wrong entries of the registered contact: the message names the entry and the nearest known name."""
        for contact, *words in (
                (SPHERE.replace('type: sphere', 'type: spere'), 'contact disk', 'obstacle, pair, rigid, sphere or surface', 'did you mean sphere?'),
                (SPHERE + ', gap: 1', 'contact_disk_gap', 'centre_x'),
                (SPHERE.replace('radius:', 'raduis:'), 'contact_disk_raduis', 'did you mean radius?'),
                (SPHERE.split(', radius')[0], 'contact disk', 'radius'),
                (SPHERE.replace('high', 'hihg'), 'did you mean high?')):
            self.refused(words, self.scene(contact), '0.06')
        run = self.run_raw('solve', '-scene', self.path('scene.yaml'), '-mu', 0.06)  # the command has no such type
        self.assertNotEqual(run.returncode, 0)
        self.assertIn('obstacle, pair, rigid or surface', run.stderr)


if __name__ == '__main__':
    unittest.main()
