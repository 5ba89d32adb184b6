"""Progress: in a file a line every -progress seconds of every long phase, with counts where available; nothing with -quiet."""
import os
import re
import unittest

from common import PELLET, ROPE, SOURCE, Case

BLOCKS = os.path.join(SOURCE, 'examples', 'blocks')
# What a long step is called: the words of the events and stages, whichever a timer happens to meet.
with open(os.path.join(SOURCE, 'src', 'sys', 'log.c')) as log:
    WORDS = re.findall(r'"([^"]+)"', re.search(r'event_words.*?;', log.read(), re.S).group(0)) + ['full order', 'reduction', 'online']
DOING = re.compile(r'^after \d+ s: (%s)' % '|'.join(re.escape(word) for word in WORDS))


class Progress(Case):
    def lines(self, *args, **options):
        run = self.run_raw(*args, **options)
        self.assertEqual(run.returncode, 0, run.stderr)
        return [line for line in run.stderr.splitlines() if re.match(r'after |\w[\w -]*: \d', line)]

    def test_long_step(self):
        """A solve of one point has nothing to count: its steps are named."""
        args = ['solve', '-scene', PELLET, '-mu', '4.06,1', '-scene_refine', '1']
        for ranks in (0, 2):
            lines = self.lines(*args, '-progress', '0.05', ranks=ranks)
            self.assertGreater(len(lines), 2)
            self.assertTrue(all(DOING.match(line) for line in lines), lines)
        self.assertEqual(self.lines(*args), [])
        self.assertEqual(self.lines(*args, '-progress', '0.05', '-quiet'), [])

    def test_sets(self):
        """solve on a grid counts points and estimates the rest."""
        lines = self.lines('solve', '-scene', ROPE, '-grid', '40,40', '-table', 't.csv', '-progress', '0.05')
        counted = [line for line in lines if re.match(r'points: \d+ of 1600, \d+ s left', line)]
        self.assertGreater(len(counted), 2, lines)

    def test_training(self):
        """train counts its snapshots."""
        lines = self.lines('train', '-scene', ROPE, '-grid', '8,8', '-model', 'm.h5', '-progress', '0.02')
        self.assertTrue(any(line.startswith('snapshots: ') for line in lines), lines)
        self.assertTrue(os.path.exists(self.path('m.h5')))

    def test_search(self):
        """The search for settings reports its trials."""
        type(self).newcomer = True
        try:
            run = self.run_raw('train', '-scene', ROPE, '-grid', '3,3', '-hyco_model_type', 'projection', '-model', 's.h5', '-progress', '0.02')
        finally:
            type(self).newcomer = False
        self.assertIn(run.returncode, (0, 3), run.stderr)
        lines = run.stderr.splitlines()
        self.assertTrue(any(line.startswith('settings tried: ') for line in lines), lines)

    def test_bodies(self):
        """Models of bodies solve held-out points, which are called so, and the problems of their modes, which are counted."""
        type(self).newcomer = True
        try:
            run = self.run_raw('train', '-scene', BLOCKS, '-grid', '3,3', '-model', 'b.h5', '-hyco_bodies_samples', 800, '-progress', '0.01')
        finally:
            type(self).newcomer = False
        self.assertEqual(run.returncode, 0, run.stderr)
        for words in (r'(?m)^held-out solutions: \d of 6', r'samples of bodies: \d+ of 8\d\d'):
            self.assertRegex(run.stderr, words)
        self.assertNotIn('snapshots: ', run.stderr)

    def test_types(self):
        """The choice of full-order displacements, and of the cells of a cubature, show a count: they may take most of the time."""
        for scene, grid, settings, words in ((ROPE, '6,6', ('-hyco_hybrid', 'rank', '-hyco_hybrid_trials', 200), r'choices of full-order displacements: \d+ of 200'),
                                             (BLOCKS, '4,4', ('-hyco_model_type', 'cubature'), r'(cells of the cubature|internal forces of training points): \d+ of \d+')):
            lines = self.lines('train', '-scene', scene, '-grid', grid, *settings, '-hyco_search', 'false', '-model', 'm.h5', '-progress', '0.01')
            self.assertTrue(any(re.match(words, line) for line in lines), lines)

    def test_wrong(self):
        """-progress 0 is refused."""
        run = self.run_raw('solve', '-scene', ROPE, '-mu', '0.1,0.1', '-progress', '0')
        self.assertNotEqual(run.returncode, 0)
        self.assertIn('-progress', run.stderr)


if __name__ == '__main__':
    unittest.main()
