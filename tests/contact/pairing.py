"""Which nodes are paired: normals oppose each other, masters are in front; overlaps and masters that no longer face each other are
refused by name."""
import math
import unittest

from common import Case, msh
from roller import grid, mesh, scene

ARCS = """
scene: {mesh: arcs.msh, parameters: [press]}
parameter: {press: {range: [0, 1]}}
body: {low: {young: 10, poisson: 0.3%s}, high: {young: 20, poisson: 0.3}}
fixed: {base: {x: 0, y: 0}, top: {x: 0, y: -press}}
contact: {c: {type: %s, slave: over, master: under%s}}
"""


def arcs(path, angle=60, m=36, gap=0.0):
    """Two mirrored parts of discs of radius 10 that touch at the origin, nodes mirrored too."""
    nodes, elements = [], []
    for tag, sign in ((1, -1), (2, 1)):
        def point(i, j, k, sign=sign):
            t, r = math.radians(angle * (2 * i / m - 1)), 10 * (1 - 0.5 * j / 5)
            return r * math.sin(t), sign * (10 - r * math.cos(t) + gap), 0

        grid([m, 5], point, nodes, elements, tag, {(1, 0): 10 + tag, (1, 1): 20 + tag})
    msh(path, nodes, elements, {1: (2, 'low'), 2: (2, 'high'), 11: (1, 'under'), 21: (1, 'base'), 12: (1, 'over'), 22: (1, 'top')})


class Facing(Case):
    def scene(self, kind, more='', low=''):
        with open(self.path('arcs.yaml'), 'w', encoding='ascii') as file:
            file.write(ARCS % (low, kind, more))

    def force(self, *more):
        r = self.hyco('solve', '-scene', 'arcs.yaml', '-mu', '0.3', *more)
        self.solved(r)
        return r

    def refused(self, *texts, yaml='arcs.yaml', mu='0.3', more=()):
        run = self.run_raw('solve', '-scene', yaml, '-mu', mu, *more)
        self.assertEqual(run.returncode, 1, run.stdout)
        self.assertEqual(len(run.stderr.splitlines()), 1, run.stderr)
        for text in texts:
            self.assertIn(text, run.stderr)

    def test_mirrored_pair(self):
        """Nodes pair along the normal, with and without a tolerance; the force is that of the surface contact."""
        for angle in (20, 60, 90):
            arcs(self.path('arcs.msh'), angle)
            self.scene('surface', ', tolerance: 25')
            surface = self.force()['total_contact_force']
            for more in ('', ', tolerance: 25'):
                with self.subTest(angle=angle, more=more):
                    self.scene('pair', more)
                    self.near(self.force()['total_contact_force'], surface, 0.01)

    def test_tolerance(self):
        """A tolerance, however large, pairs nothing that does not face the master; if it is too small, the message gives the right one."""
        arcs(self.path('arcs.msh'), 90)
        self.scene('surface', ', tolerance: 25')
        right = self.force()
        self.assertLess(right['n_facing'], right['n_contacts'])
        self.scene('surface')
        self.refused('have no point of under within', 'contact_c_tolerance')
        self.scene('surface', ', tolerance: 6')  # those farther away face nothing
        self.near(self.force()['total_contact_force'], right['total_contact_force'], 1e-12)
        self.scene('surface', ', tolerance: 1000')
        self.near(self.force()['total_contact_force'], right['total_contact_force'], 1e-12)
        self.scene('surface', ', tolerance: 1.5')  # fewer nodes face it than lie on half of the arc
        fewer = self.force()
        self.assertTrue(0 < fewer['n_facing'] < right['n_facing'], fewer['n_facing'])
        self.near(fewer['total_contact_force'], right['total_contact_force'], 1e-12)
        found = self.hyco('check', '-scene', 'arcs.yaml')
        self.assertEqual(found['contacts'][0]['n_facing_max'], fewer['n_facing'])
        self.assertIn(f"{right['n_contacts'] - fewer['n_facing']} face nothing within the tolerance of 1.5", self.run_raw('check', '-scene', 'arcs.yaml').stdout)
        arcs(self.path('arcs.msh'), 20, gap=2)  # 4 apart: one line with the tolerance and the distance
        self.refused('no node of over is within contact_c_tolerance 1.5 of under', 'is 4 away')
        self.scene('pair')
        self.refused('have no node of under within', 'use matching meshes, or type: surface')
        self.scene('pair', ', tolerance: 6')
        self.assertEqual(self.force()['n_active'], 0)

    def test_wrong_side(self):
        """A surface that faces away has no contact."""
        arcs(self.path('arcs.msh'), 20)
        self.scene('surface', ', tolerance: 25')
        self.refused('no node of over faces base within 25', more=('-contact_c_master', 'base'))

    def test_overlap(self):
        """An overlap of more than half of a facet is named, with the entry that allows it; smaller ones are reported."""
        arcs(self.path('arcs.msh'), 20, gap=-0.03)
        self.scene('surface', ', tolerance: 25')
        self.near(self.force()['overlap'], 0.06, 1e-3)
        self.near(self.hyco('predict', '-model', self.train(), '-mu', '0.3')['overlap'], 0.06, 1e-3)
        arcs(self.path('arcs.msh'), 20, gap=-0.4)
        self.refused('before any load node', 'deep in under (its master point is 0.8 away)', 'half of its facet', 'contact_c_overlap 0.80')
        self.assertGreater(self.force('-contact_c_overlap', '0.808')['total_contact_force'], 1)
        self.refused('0.3 is allowed;', more=('-contact_c_overlap', '0.3'))
        self.refused('it must be a length, 0 or more', more=('-contact_c_overlap', 'deep'))

    def train(self):
        self.hyco('train', '-scene', 'arcs.yaml', '-values_press', '0.1,0.2,0.3,0.4', '-model', 'a.h5', '-hyco_rid_whole', 'true')
        return 'a.h5'

    def test_slot(self):
        """Two groups of one body: the arms of a slotted plate touch, the free end first; at full order and in a model of bodies."""
        wide, gap, height = 24, 0.05, (0, 2, 4, 4.05, 6.05, 8.05)
        node = [[1 + i + (wide + 1) * j for i in range(wide + 1)] for j in range(6)]
        elements = [(3, 1, (node[j][i], node[j][i + 1], node[j + 1][i + 1], node[j + 1][i])) for j in range(5) for i in range(wide) if j != 2 or i < 2]
        elements += [(1, tag, (node[j][i], node[j][i + 1])) for tag, j, first in ((2, 0, 0), (3, 5, 0), (4, 2, 2), (5, 3, 2)) for i in range(first, wide)]
        msh(self.path('slot.msh'), [(i, y, 0) for y in height for i in range(wide + 1)], elements, {1: (2, 'plate'), 2: (1, 'base'), 3: (1, 'top'), 4: (1, 'low'), 5: (1, 'high')})
        with open(self.path('slot.yaml'), 'w', encoding='ascii') as file:
            file.write('scene: {mesh: slot.msh, parameters: [press]}\nparameter: {press: {range: [1, 20]}}\nbody: {plate: {young: 2e4, poisson: 0.3}}\n'
                       'fixed: {base: {x: 0, y: 0}}\npressure: {top: press}\ncontact: {slot: {type: surface, slave: high, master: low, tolerance: 0.1}}\n'
                       'output: {tip: {min: u_y, group: high}, shut: {area: closed, contact: slot}}\n')
        full = self.hyco('solve', '-scene', 'slot.yaml', '-mu', '10')
        self.solved(full)
        self.near(full['supports']['base']['force'][1], 10 * wide, 1e-8)
        self.assertLess(-1.2 * gap, full['outputs']['tip'])  # without contact far more
        self.assertTrue(0 < full['outputs']['shut'] < wide - 2)
        self.hyco('train', '-scene', 'slot.yaml', '-values_press', '1,20', '-hyco_model_type', 'bodies', '-model', 's.h5')
        found = self.hyco('predict', '-model', 's.h5', '-mu', '10')
        self.near(found['total_contact_force'], full['total_contact_force'], 1e-9)

    def test_pair_is_moved(self):
        """A pair keeps its nodes: scaled together they still face each other, shifted by a facet they do not."""
        arcs(self.path('arcs.msh'), 20)
        self.scene('pair', low=', map: {x: 1.01*x}')
        self.assertGreater(self.force()['total_contact_force'], 0)
        self.scene('pair', low=', map: {x: x + press}')
        self.refused('a map moves node', 'apart along the surface', 'use type: surface')
        mesh(self.path('m.msh'))
        scene(self.path('moved.yaml'), 'm.msh', kind='pair')
        self.refused('have no node of upper', 'type: surface', yaml='moved.yaml', mu='1,0.5,10')


if __name__ == '__main__':
    unittest.main()
