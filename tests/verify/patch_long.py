"""The fewest full-order displacements of a hybrid model on crowned blocks (patch.py): the choice takes a minute."""
import unittest

from patch import Models


class Long(Models):
    name = 'rank'

    def test_rank(self):
        """The fewest full-order displacements, each contact's own also where masters are shared: u is held. (Forces on
        surfaces want -hyco_hybrid contact, with node pairs as here.)"""
        t, e = self.model('quad4', 24, 31, hybrid='rank')
        self.assertLess(t['n_fe_dofs'], t['rid_contacts'])
        self.held(f"rank quad4 31 on 24, {self.check_sets()}, u", e['u'], 0, e['u'], 2e-3)


if __name__ == '__main__':
    unittest.main()
