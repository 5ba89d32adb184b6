"""hyco fit: parameters whose outputs at full order are given are found again, by both types, on several ranks; targets that cannot be reached end at the ends
of the ranges; what is refused."""
import os
import unittest

from common import SOURCE, Case

ROLLER = ('-scene', os.path.join(SOURCE, 'examples', 'roller'), '-output_lift_force', 'y', '-output_lift_contact', 'under', '-output_peak_max', 'mises',
          '-output_peak_group', 'block', '-output_turn_moment', 'z', '-output_turn_contact', 'under')
TRUE = {'place': 1.7, 'press': 0.63, 'modulus': 11.3}


class Fit(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.hyco('train', *ROLLER, '-hyco_model_type', 'bodies', '-scatter', '3', '-model', 'm.h5')
        cls.outputs = cls.hyco('solve', *ROLLER, '-mu', ','.join(map(str, TRUE.values())))['outputs']
        cls.targets = [word for name, value in cls.outputs.items() for word in (f'-target_{name}', repr(value))]

    def test_found(self):
        """Three outputs of a full-order solution determine the three parameters, which the training has not seen; the check solves at the answer."""
        found = []
        for args, ranks in (((), 0), ((), 2), (('-fit_type', 'blmvm'), 0), (('-mu', '0.5,0.5,9'), 0)):
            r = self.hyco('fit', '-model', 'm.h5', *self.targets, *ROLLER, *args, ranks=ranks)
            self.assertTrue(r['converged'])
            self.assertEqual(r['at_ends'], [])
            for name, value in TRUE.items():
                self.near(r['mu'][name], value, 1e-3, name)  # the model's stresses have errors of modes
            self.assertLess(r['misfit_model'], 1e-6)
            self.assertLess(r['misfit_full_order'], 1e-4)
            again = self.hyco('solve', *ROLLER, '-mu', ','.join(repr(v) for v in r['mu'].values()))
            for name, of in r['targets'].items():
                self.assertEqual(of['target'], self.outputs[name])
                self.near(of['full_order'], again['outputs'][name], 1e-9)
            found.append(r)
        for name in TRUE:
            self.near(found[1]['mu'][name], found[0]['mu'][name], 1e-9, name)

    def test_ends(self):
        """A force that is out of reach: the answer is at the ends of the ranges, is a minimum, and its misfit is reported."""
        r = self.hyco('fit', '-model', 'm.h5', '-target_lift', '-100')
        self.assertTrue(r['converged'])
        self.assertLessEqual({'press', 'modulus'}, set(r['at_ends']))
        self.assertEqual((r['mu']['press'], r['mu']['modulus']), (1, 20))
        self.near(r['misfit_model'], 1 + r['targets']['lift']['model'] / 100, 1e-6)
        self.assertNotIn('misfit_full_order', r)
        text = self.run_raw('fit', '-model', 'm.h5', '-target_lift', '-100').stdout
        self.assertIn('the targets are not met', text)
        self.assertIn('NOT UNIQUE: 3 parameters are free', text)
        self.assertEqual(r['free'], 3)
        self.assertEqual(r['determined'], 2)  # those that are pressed against their ends

    def test_held(self):
        """A held parameter keeps its value, and the others meet the targets that are left, from searched starts and from a given one, by both types."""
        two = self.targets[:2]
        for args in ((), ('-mu_press', '0.5', '-mu_modulus', '9'), ('-fit_type', 'blmvm', '-mu', '2.5,0.5,9')):  # a held one needs no -mu_NAME
            r = self.hyco('fit', '-model', 'm.h5', *two, '-hold_place', '2.5', *args)
            self.assertTrue(r['converged'])
            self.assertEqual((r['mu']['place'], r['held'], r['free'], r['determined']), (2.5, ['place'], 2, 1))
            self.near(r['targets']['lift']['model'], self.outputs['lift'], 1e-6)
        r = self.hyco('fit', '-model', 'm.h5', *self.targets, '-hold_place', '5', '-hold_press', '0.63', status=None)
        self.assertEqual((r['mu']['place'], r['mu']['press'], r['held']), (5, 0.63, ['place', 'press']))
        self.assertNotIn('place', r['at_ends'])  # it is held there
        self.assertGreater(r['misfit_model'], 1e-3)  # the moment is that of another place

    def test_starts(self):
        """A moment that two places have: with several starts the least misfit is the answer, at most that of one start, and counts say how many reached it."""
        one = self.hyco('fit', '-model', 'm.h5', *self.targets, '-fit_starts', '8')
        self.assertEqual((one['starts'], one['starts_at_least']), (1, 1))
        r = self.hyco('fit', '-model', 'm.h5', *self.targets, '-fit_starts', '4', '-starts', '5')  # at least as many predictions as starts
        self.assertEqual((r['starts'], r['free'], r['determined']), (5, 3, 3))
        self.assertTrue(1 <= r['starts_at_least'] <= 5)
        self.assertLessEqual(r['misfit_model'], max(one['misfit_model'], 1e-9))
        self.assertGreater(r['evaluations'], one['evaluations'])
        self.assertIn(f"{r['starts_at_least']} of 5 starts", self.run_raw('fit', '-model', 'm.h5', *self.targets, '-fit_starts', '4', '-starts', '5').stdout)

    def test_kinks(self):
        """Minima of different depth, the deepest at a kink: with more starts the misfit never rises, and the counts are of starts that ended at it."""
        args = ('fit', '-model', 'm.h5', '-target_peak', '0', '-hold_press', '0.63', '-hold_modulus', '11')
        found = [self.hyco(*args, '-starts', str(n), status=None) for n in (1, 4, 16)]
        for few, more in zip(found, found[1:]):
            self.assertLessEqual(more['misfit_model'], few['misfit_model'] * (1 + 1e-4))
            self.assertLessEqual(more['starts_at_least'], more['starts'] - 1)  # others end at shallower minima

    def test_refused(self):
        """One line that names what is wrong, and no report."""
        for words, args in ((('target_foo', 'lift'), ('-target_foo', '1')), (('-target_', 'lift', 'peak'), ()), (('target_lift', 'number'), ('-target_lift', 'x')),
                            (('place', 'range'), ('-target_lift', '5', '-mu', '9,0.5,9')), (('output', 'turn'), (*self.targets, *ROLLER[:-4])),
                            (('hold_foo', 'place'), ('-target_lift', '5', '-hold_foo', '1')), (('place', '9', 'range'), ('-target_lift', '5', '-hold_place', '9')),
                            (('hold_place', 'same'), ('-target_lift', '5', '-hold_place', '1', '-mu', '2,0.5,9')),
                            (('all 3', 'predict'), ('-target_lift', '5', '-hold_place', '1', '-hold_press', '0.5', '-hold_modulus', '9'))):
            run = self.run_raw('fit', '-model', 'm.h5', *args, '-report', 'none.json')
            self.assertEqual((run.returncode, len(run.stderr.strip().splitlines())), (1, 1), run.stderr)
            for word in words:
                self.assertIn(word, run.stderr)
            self.assertFalse(os.path.exists(self.path('none.json')))


if __name__ == '__main__':
    unittest.main()
