"""The default tolerance of a contact's search: a tenth of the slave's shortest facet edge, whichever edge that is."""
import unittest

from common import Case, msh

SCENE = """
scene: {title: two wedges, mesh: wedges.msh}
body: {lower: {young: 100, poisson: 0.3}, upper: {young: 100, poisson: 0.3}}
fixed: {base: {x: 0, y: 0, z: 0}, lid: {x: 0, y: 0, z: -0.1}}
contact: {between: {type: pair, slave: foot, master: head}}
"""
SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
WEDGE = [(0, 0), (1, 0), (1, 0.2), (0, 1)]  # its edges: 1, 0.2, 1.28, 1


class Tolerance(Case):
    def wedges(self, apart, turn):
        """Two hexahedra whose trapezoidal faces are `apart`; the slave's facet begins with its node number `turn`."""
        nodes = [(x, y, -1) for x, y in SQUARE] + [(x, y, 0) for x, y in WEDGE]
        nodes += [(x, y, apart) for x, y in WEDGE] + [(x, y, 1) for x, y in SQUARE]
        face = [9, 10, 11, 12]
        elements = [(5, 1, range(1, 9)), (5, 2, range(9, 17)), (3, 3, (1, 2, 3, 4)), (3, 4, (5, 6, 7, 8)),
                    (3, 5, face[turn:] + face[:turn]), (3, 6, (13, 14, 15, 16))]
        msh(self.path('wedges.msh'), nodes, elements, {1: (3, 'lower'), 2: (3, 'upper'), 3: (2, 'base'), 4: (2, 'head'),
                                                       5: (2, 'foot'), 6: (2, 'lid')})
        with open(self.path('scene.yaml'), 'w', encoding='ascii') as file:
            file.write(SCENE)
        return self.path('scene.yaml')

    def test_every_edge_counts(self):
        """The shortest edge of a facet counts, whichever of its edges it is."""
        for turn in range(4):
            with self.subTest(turn=turn):
                self.assertEqual(self.hyco('solve', '-scene', self.wedges(0.019, turn))['n_contacts'], 4)
                run = self.run_raw('solve', '-scene', self.wedges(0.021, turn))
                self.assertNotEqual(run.returncode, 0)
                self.assertIn('within 0.02', run.stderr)


if __name__ == '__main__':
    unittest.main()
