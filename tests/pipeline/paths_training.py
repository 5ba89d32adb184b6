"""Training over paths: greedy choice of paths by the replayed residual, target-driven training, and what is said where a model misses its paths."""
import re
import unittest

from common import said
from rivals import Ring


class Missed(Ring):
    def test_worst_named(self):
        """A model that misses its own paths: the line says which do not reach their end, how far they come, and which of the others is worst."""
        run = self.run_raw('train', '-scene', self.norton, '-model', self.path('no.h5'), '-grid', '3,3', '-hyco_snapshots', self.path('store'),
                           '-hyco_pod_tol', '1e-14')
        self.assertEqual(run.returncode, 1)
        line, = said(run)
        missing, of = map(int, re.search(r'(\d+) of (\d+) paths do not reach their end', line).groups())
        self.assertEqual(of, 9)
        ends = re.findall(r'gap = ([\d.]+), push = ([\d.]+) \(t = ([\d.]+)\)', line)
        self.assertEqual(len(ends), missing)
        for gap, push, t in ends:
            self.assertTrue(0.004 <= float(gap) <= 0.008 and 0.8 <= float(push) <= 1.2 and 0 < float(t) < 12, line)
        self.assertRegex(line, r'the worst of the others, by \d+ %( or more)?, at gap = [\d.]+, push = [\d.]+')
        self.assertIn('-hyco_model_type cubature', line)

    def test_worst_cubature(self):
        """Every path ends: the worst alone."""
        run = self.run_raw('train', '-scene', self.norton, '-model', self.path('no.h5'), '-grid', '3,3', '-hyco_snapshots', self.path('store'),
                           '-hyco_pod_tol', '1e-13', '-hyco_model_type', 'cubature', '-hyco_cubature_tol', '0.5')
        self.assertEqual(run.returncode, 1)
        line, = said(run)
        self.assertNotIn('reach their end', line)
        self.assertRegex(line, r'; the worst, by \d+ %, at gap = [\d.]+, push = [\d.]+')


if __name__ == '__main__':
    unittest.main()
