"""Named constants, and entries that name several groups."""
import os
import unittest

from common import SOURCE, Case

BLOCKS = os.path.join(SOURCE, 'examples', 'blocks')


class Constants(Case):
    def setUp(self):
        with open(os.path.join(BLOCKS, 'scene.yaml'), encoding='utf-8') as f:
            self.text = f.read().replace('mesh: blocks.msh', f'mesh: {BLOCKS}/blocks.msh')

    def named(self):
        text = self.text.replace('young: 2e5', 'young: 2*soft').replace('young: 1e5', 'young: soft').replace('{y: -press}', '{y: -down}')
        text = text.replace('  block_sym: {x: 0}\n', '').replace('foundation_sym: {x: 0}', '"block_sym,foundation_sym": {x: 0}')
        self.assertNotIn('1e5', text)
        return text + 'constant: {soft: 1e2*thousand, thousand: 10^3, down: press*one, one: "x < 1e9 ? 1 : 2"}\n'

    def test_same(self):
        """The same numbers to the last digit, through a model file too."""
        found = []
        for text in (self.text, self.named()):
            scene = self.written(text)
            report = self.hyco('solve', '-scene', scene, '-mu', '0.05,0.05')
            self.solved(report)
            self.hyco('train', '-scene', scene, '-grid', '3,3', '-model', f'm{len(found)}.h5')
            found.append((report['strain_energy'], self.hyco('predict', '-model', f'm{len(found)}.h5', '-mu', '0.04,0.06')['total_contact_force']))
        self.assertEqual(found[0], found[1])
        changed = self.hyco('solve', '-scene', self.written(self.named()), '-mu', '0.05,0.05', '-constant_thousand', 2000)
        self.near(changed['strain_energy'], 2 * found[0][0], 1e-9, 'energy')

    def test_refused(self):
        """Circular constants, and those with the name of a parameter or a variable, are refused."""
        for old, new, text in (('thousand: 10^3', 'thousand: soft', 'must not be circular'), ('one: "x < 1e9 ? 1 : 2"', 'press: 1', 'name of a parameter'),
                               ('one: "x < 1e9 ? 1 : 2"', 'one: y*nothing', 'nothing, which is unknown'), ('thousand: 10^3', 'x: 3', 'cannot name a constant'),
                               ('constant: {', 'output: {x: {max: mises}}\nconstant: {', 'none of x, y, z, pi'),
                               ('foundation_base: {y: 0}', 'foundation_base: {y: 0}\n  "foundation_base,block_top": {y: 0}', 'remove one of them')):
            with self.subTest(new=new):
                self.assertIn(old, self.named())
                run = self.run_raw('solve', '-scene', self.written(self.named().replace(old, new)), '-mu', '0.05,0.05')
                self.assertEqual(run.returncode, 1, run.stdout)
                self.assertEqual(run.stderr.count('hyco: error'), 1, run.stderr)
                self.assertIn(text, run.stderr)


if __name__ == '__main__':
    unittest.main()
