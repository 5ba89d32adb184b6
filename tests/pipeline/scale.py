"""scripts/bench-scale on mesh A and a wavy block: its counts on 1 and 2 ranks, and the model fitted to them."""
import csv
import os
import subprocess
import sys
import unittest

from common import PATIENCE, SOURCE, Case


class Scale(Case):
    def test_counts(self):
        run = subprocess.run([sys.executable, os.path.join(SOURCE, 'scripts', 'bench-scale'), '--refine', '0', '--ranks', '1,2', '--wavy', '8', '--timeout',
                              str(60 * PATIENCE), '--output', self.folder], cwd=SOURCE, capture_output=True, text=True, timeout=120 * PATIENCE)
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        with open(self.path('scale.csv'), encoding='utf-8', newline='') as file:
            one, two, wavy = csv.DictReader(file)
        for row in (one, two):
            self.assertEqual((row['unknowns'], row['contacts']), ('4952', '189'))
            self.assertLessEqual(int(row['most']), 40)
            self.assertLessEqual(int(row['sets']), 12)
            self.assertLessEqual(float(row['mb_ratio']), 1.25)
        self.assertEqual((one['neighbours'], two['neighbours']), ('0', '1'))
        self.assertLessEqual(int(two['iterations']), 1.3 * int(one['iterations']))
        self.assertLess(float(two['kb_largest']), 1e-3 * 8 * 20 * int(two['ghosts']))  # what the other rank needs, some twenty times: no gathering
        self.assertEqual((wavy['contacts'], wavy['ranks']), ('1089', '1'))
        self.assertLessEqual(int(wavy['most']), 20)
        self.assertLessEqual(int(wavy['sets']), 12)
        self.assertIn('Model, fitted', run.stdout)


if __name__ == '__main__':
    unittest.main()
