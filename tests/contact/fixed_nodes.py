"""Contacts between fixed displacements: without effect and reported, or impossible and refused by name; round-off is neither."""
import os
import unittest

from common import Case, msh

COLUMN = """
scene: {title: columns, mesh: still.msh, parameters: [press]}
parameter: {press: {range: [0, 1]}}
body: {lower: {young: 100, poisson: 0.3}, upper: {young: 100, poisson: 0.3}}
fixed: {%s}
contact: {between: {%s}}
"""
PAIR = 'type: pair, slave: upper_foot, master: lower_head, tolerance: 0.1'
FLOOR = "type: obstacle, group: upper_foot, normal: {y: -1}, gap: '%s'"
SUM = 0.1 + 0.2  # 5.6e-17 above 0.3


class Still(Case):
    """Two columns of a square each; the lower one's head and the upper one's foot meet at y = 0.3."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        nodes = [(0, 0, 0), (1, 0, 0), (1, SUM, 0), (0, SUM, 0), (0, 0.3, 0), (1, 0.3, 0), (1, 1, 0), (0, 1, 0)]
        elements = [(3, 1, (1, 2, 3, 4)), (3, 2, (5, 6, 7, 8)), (1, 3, (1, 2)), (1, 4, (3, 4)), (1, 5, (5, 6)), (1, 6, (7, 8))]
        names = {1: (2, 'lower'), 2: (2, 'upper'), 3: (1, 'lower_foot'), 4: (1, 'lower_head'), 5: (1, 'upper_foot'),
                 6: (1, 'upper_head')}
        msh(cls.path('still.msh'), nodes, elements, names)

    def scene(self, fixed, contact):
        path = self.path('scene.yaml')
        with open(path, 'w', encoding='ascii') as file:
            file.write(COLUMN % (fixed, contact))
        return path

    def solve(self, *args, ranks=0):
        report = self.path('still.json')
        run = self.run_raw('solve', *args, '-report', report, ranks=ranks)
        self.assertEqual(run.returncode, 0, run.stderr)
        return run.stdout

    def test_pair(self):
        """Both sides fixed: round-off of the drawn coordinates is not penetration; a prescribed overlap is, and is named."""
        for ranks in (0, 2):
            held = 'lower_foot: {x: 0, y: 0}, lower_head: {x: 0, y: 0}, upper_foot: {x: 0, y: %s}, upper_head: {x: 0}'
            scene = self.scene(held % 0, PAIR)
            out = self.solve('-scene', scene, '-mu', 1, ranks=ranks)
            self.assertIn('2 contacts lie between fixed displacements', out)
            self.assertEqual(self.hyco('solve', '-scene', scene, '-mu', 1, ranks=ranks)['n_without_effect'], 2)
            run = self.run_raw('solve', '-scene', self.scene(held % -0.01, PAIR), '-mu', 1, ranks=ranks)
            self.assertNotEqual(run.returncode, 0)
            for word in ('between', 'node 5', '0.01'):
                self.assertIn(word, run.stderr)

    def test_no_overlap_allowed(self):
        """With overlap: 0 an overlap of round-off (the drawn one) is allowed as well, and one of 1e-6 is refused."""
        for ranks in (0, 2):
            held = 'lower_foot: {x: 0, y: 0}, upper_foot: {x: 0}, upper_head: {x: 0, y: -0.01*press}'
            scene = self.scene(held, PAIR + ', overlap: 0')
            self.assertEqual(self.hyco('solve', '-scene', scene, '-mu', 1, ranks=ranks)['n_active'], 2)
            run = self.run_raw('solve', '-scene', scene, '-mu', 1, '-body_upper_map_y', 'y-1e-6', ranks=ranks)
            self.assertEqual(run.returncode, 1)
            self.assertIn('contact_between_overlap', run.stderr)

    def test_origin(self):
        """A fixed node at the origin whose gap is round-off of the scene's numbers."""
        for gap, status in (("x/10 + 0.3 - (0.1 + 0.2)", 0), ('x/10 - 1e-6', 1)):
            floor = f"type: obstacle, group: lower_foot, normal: {{y: -1}}, gap: '{gap}'"
            scene = self.scene('lower_foot: {x: 0, y: 0}, lower_head: {x: 0}, upper_foot: {x: 0, y: 0}', floor)
            self.assertEqual(self.run_raw('solve', '-scene', scene, '-mu', 1).returncode, status, gap)

    def test_obstacle(self):
        """An obstacle's completely fixed nodes are not contacts; they must not penetrate it."""
        held = 'lower_foot: {x: 0, y: 0}, upper_foot: {x: 0, y: -0.02*press}, upper_head: {x: 0}'
        for ranks in (0, 2):
            for gap, ok in (('0.03', True), ('0.02*press', True), ('0.02*press*(1 - 1e-15)', True), ('0.01', False)):
                with self.subTest(gap=gap, ranks=ranks):
                    scene = self.scene(held, FLOOR % gap)
                    if ok:
                        r = self.hyco('solve', '-scene', scene, '-mu', 1, ranks=ranks)
                        self.assertEqual((r['n_contacts'], r['n_without_effect']), (0, 2))
                        self.assertIn('without effect', self.solve('-scene', scene, '-mu', 1, ranks=ranks))
                        continue
                    run = self.run_raw('solve', '-scene', scene, '-mu', 1, '-output', 'no.xdmf', ranks=ranks)
                    self.assertNotEqual(run.returncode, 0)
                    for word in ('between', 'node 5', '0.01'):
                        self.assertIn(word, run.stderr)
                    self.assertFalse(os.path.exists(self.path('no.h5')))

    def test_two_contacts(self):
        """A fixed node that is a slave of a pair is checked against its obstacle too."""
        held = 'lower_foot: {x: 0, y: 0}, upper_foot: {x: 0, y: -0.01}, upper_head: {x: 0}'
        for gap, ok in (('0.02', True), ('0.005', False)):
            scene = self.scene(held, PAIR + ', overlap: 1}, floor: {' + FLOOR % gap)
            for ranks in (0, 2):
                run = self.run_raw('solve', '-scene', scene, '-mu', 1, ranks=ranks)
                self.assertEqual(run.returncode == 0, ok, run.stderr)
                if not ok:
                    self.assertIn('floor', run.stderr)

    def test_parameter(self):
        """Possible at one value and not at another."""
        held = 'lower_foot: {x: 0, y: 0}, upper_foot: {x: 0, y: -0.02*press}, upper_head: {x: 0}'
        scene = self.scene(held, FLOOR % '0.01')
        self.hyco('solve', '-scene', scene, '-mu', 0.5)
        self.assertNotEqual(self.run_raw('solve', '-scene', scene, '-values_press', '0.4,0.6').returncode, 0)

    def test_train(self):
        """An impossible contact between fixed displacements ends a training; the message names its node."""
        held = 'lower_foot: {x: 0, y: 0}, upper_foot: {x: 0, y: -0.02*press}, upper_head: {x: 0}'
        scene = self.scene(held, FLOOR % '0.01')
        run = self.run_raw('train', '-scene', scene, '-values_press', '0.4,0.6', '-model', 'm.h5')
        self.assertNotEqual(run.returncode, 0)
        self.assertIn('node 5', run.stderr)
        self.assertFalse(os.path.exists(self.path('m.h5')))

    def test_free_contacts_are_not_counted(self):
        """Contacts with a free side are not counted among those without effect."""
        held = 'lower_foot: {x: 0, y: 0}, upper_head: {x: 0, y: -0.02*press}'
        r = self.hyco('solve', '-scene', self.scene(held, PAIR), '-mu', 1)
        self.assertEqual((r['n_without_effect'], r['n_active']), (0, 2))


if __name__ == '__main__':
    unittest.main()
