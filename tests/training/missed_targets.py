"""A run that writes a model which misses its targets reports this in one line, and ends with status 3."""
import json
import unittest

from common import ROPE, Case

GREEDY = ('train', '-scene', ROPE, '-greedy', '-training_grid', '4,4', '-model', 'm.h5')


class Missed(Case):
    def greedy(self, *options, ranks=0):
        run = self.run_raw(*GREEDY, *options, '-report', 'r.json', ranks=ranks)
        with open(self.path('r.json'), encoding='utf-8') as file:
            return run, json.load(file)

    def test_greedy_missed(self):
        """The loop ends before its target: by its limits, or with no point left, on one rank and on two."""
        for options, words in ((('-target', '1e-9', '-max_snapshots', 5), '-max_snapshots is reached'),
                               (('-target', '1e-9', '-max_seconds', '1e-9'), '-max_seconds have passed'),
                               (('-target', '1e-30'), 'every point of -training_grid is solved')):
            for ranks in (0, 2):
                with self.subTest(options=options, ranks=ranks):
                    run, report = self.greedy(*options, ranks=ranks)
                    self.assertEqual(run.returncode, 3, run.stderr)
                    lines = [line for line in run.stderr.splitlines() if line.startswith('hyco: ')]
                    self.assertEqual(len(lines), 1, run.stderr)
                    self.assertTrue(lines[0].startswith('hyco: missed: '), run.stderr)
                    self.assertIn(words, lines[0])
                    self.assertEqual(report['missed'], [lines[0][len('hyco: missed: '):]])
                    self.hyco('predict', '-model', 'm.h5', '-mu', '0.07,0.17')

    def test_greedy_limits_asked(self):
        """Without -target, reaching a limit is a success."""
        for options, stop in ((('-max_snapshots', 5), 'snapshots'), (('-max_seconds', '1e-9'), 'seconds'), (('-target', 1e9), 'target')):
            with self.subTest(options=options):
                run, report = self.greedy(*options)
                self.assertEqual((run.returncode, report['greedy']['stop']), (0, stop), run.stderr)
                self.assertNotIn('hyco: missed', run.stderr)
                self.assertNotIn('missed', report)

    def test_help(self):
        """hyco -help states the exit status."""
        self.assertIn('Exit status: 0 success; 1 an error, in one line; 3 ', self.run_raw('-help').stdout)


if __name__ == '__main__':
    unittest.main()
