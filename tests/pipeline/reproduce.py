"""scripts/reproduce: a run on small grids writes the whole report, and its words carry the runs' numbers."""
import csv
import json
import os
import re
import subprocess
import sys
import unittest

from common import HYCO, SOURCE, Case

SCRIPT = os.path.join(SOURCE, 'scripts', 'reproduce')


def reproduce(*args, hyco=HYCO):
    return subprocess.run([sys.executable, SCRIPT, *args], env={**os.environ, 'HYCO': hyco}, capture_output=True, text=True,
                          timeout=280)


class Reproduce(Case):
    def test_help(self):
        run = reproduce('--help')
        self.assertEqual(run.returncode, 0, run.stderr)
        for word in ('rope', '--output', '--docs', '--quick'):
            self.assertIn(word, run.stdout)

    def test_refusals(self):
        for args, hyco, line in ((('rod',), HYCO, "invalid choice: 'rod'"), (('--quick',), HYCO, 'another folder with --docs'),
                                 ((), '/nowhere/hyco', 'run scripts/build first')):
            run = reproduce(*args, hyco=hyco)
            self.assertNotEqual(run.returncode, 0)
            self.assertIn(line, run.stderr)

    def test_quick(self):
        out, docs = self.path('out'), self.path('docs')
        run = reproduce('rope', '--quick', '--output', out, '--docs', docs)
        self.assertEqual(run.returncode, 0, run.stderr)
        with open(os.path.join(docs, 'reproduction.md'), encoding='utf-8') as file:
            text = file.read()
        pictures = re.findall(r'\]\((reproduction/[^)]+\.png)\)', text)
        self.assertEqual(len(pictures), 12)
        for name in pictures:
            with open(os.path.join(docs, name), 'rb') as file:
                self.assertEqual(file.read(8), b'\x89PNG\r\n\x1a\n', name)
        self.assertEqual(sorted(os.listdir(os.path.join(docs, 'reproduction'))),
                         sorted(os.path.basename(name) for name in pictures))
        with open(os.path.join(out, 'numbers.csv'), encoding='utf-8', newline='') as file:
            rows = {row['model']: row for row in csv.DictReader(file)}
        with open(os.path.join(out, 'all-compare.json'), encoding='utf-8') as file:
            error = json.load(file)['error_u']
        row = rows['its recipe, all of A full order (`-hyco_hybrid all`)']
        self.assertEqual((row['snapshots'], row['modes'], row['RID nodes']), ('120', '9', '28'))  # the paper's sizes
        mean, largest = (float(v) / 100 for v in row['displacement'].split(' / '))
        self.near(mean, error['mean'], 0.06)
        self.near(largest, error['max'], 0.06)
        self.assertIn(' | '.join(row.values()), text)
        with open(os.path.join(out, 'histories.csv'), encoding='utf-8', newline='') as file:
            histories = list(csv.DictReader(file))
        self.assertEqual({h['run'] for h in histories}, {'greedy-paper', 'greedy-fine', 'greedy-pb', 'pb-on-paper', 'hr-on-pb'})
        for h in histories:
            self.assertGreater(float(h['u']), 0, h)


if __name__ == '__main__':
    unittest.main()
