"""scripts/reproduce: a run on small grids writes the whole report, with the runs' numbers in its text."""
import csv
import json
import os
import re
import subprocess
import sys
import unittest

from common import HYCO, PATIENCE, SOURCE, Case

SCRIPT = os.path.join(SOURCE, 'scripts', 'reproduce')


def reproduce(*args, hyco=HYCO):
    return subprocess.run([sys.executable, SCRIPT, *args], env={**os.environ, 'HYCO': hyco}, capture_output=True, text=True,
                          timeout=280 * PATIENCE)


class Reproduce(Case):
    def test_help(self):
        """--help names the cases and options."""
        run = reproduce('--help')
        self.assertEqual(run.returncode, 0, run.stderr)
        for word in ('rope', 'pellet', 'all', '--output', '--docs', '--quick'):
            self.assertIn(word, run.stdout)

    def test_refusals(self):
        """Unknown cases, --quick on the documents, and a missing hyco are refused."""
        for args, hyco, line in ((('stick',), HYCO, "invalid choice: 'stick'"), (('--quick',), HYCO, 'another folder with --docs'),
                                 ((), '/nowhere/hyco', 'run scripts/build first')):
            run = reproduce(*args, hyco=hyco)
            self.assertNotEqual(run.returncode, 0)
            self.assertIn(line, run.stderr)

    def test_quick(self):
        """--quick writes tables, pictures and documents with the runs' numbers."""
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
        row = rows['its settings, all of A full order (`-hyco_hybrid all`)']
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

    def test_pellet(self):
        """Mesh A: the table has the errors that compare found over the steps with contact; the span of S1 and S2 bounds their
        model."""
        out, docs = self.path('pellet'), self.path('pellet-docs')
        run = reproduce('pellet', '--quick', '--output', out, '--docs', docs)
        self.assertEqual(run.returncode, 0, run.stderr)
        with open(os.path.join(docs, 'reproduction.md'), encoding='utf-8') as file:
            text = file.read()
        pictures = re.findall(r'\]\((reproduction/[^)]+\.png)\)', text)
        self.assertEqual(len(pictures), 5)
        for name in pictures:
            with open(os.path.join(docs, name), 'rb') as file:
                self.assertEqual(file.read(8), b'\x89PNG\r\n\x1a\n', name)
        with open(os.path.join(out, 'pellet-numbers.csv'), encoding='utf-8', newline='') as file:
            rows = {(row['trained on'], row['RID']): row for row in csv.DictReader(file)}
        with open(os.path.join(out, 'pellet-bounds.csv'), encoding='utf-8', newline='') as file:
            bounds = list(csv.reader(file))[1:]
        paper, fine = rows[('S1 + S2', 'paper')], rows[('9 radii', 'paper')]
        error = float(paper['displacement'])
        with open(os.path.join(out, 'pellet-S1+S2-1e-5-paper.csv'), encoding='ascii', newline='') as file:
            steps = [row for row in csv.DictReader(file) if float(row['load']) > 0.46]  # contact from step 12 on
        self.assertEqual(len(steps), 14)
        self.near(error / 100, max(float(row['error_u_rid']) for row in steps), 0.06)
        self.assertIn('14 steps with contact (from step 12 on)', text)
        # S1 and S2 span four dimensions; on mesh A by an independent computation S3 is about 6 % away in the 2-norm
        self.assertIn('they span 4 dimensions', text)
        self.assertEqual([row[0] for row in bounds], ['0.6', '0.8', '1'])
        self.near(float(bounds[-1][1]), 5.5, 0.2)
        self.assertGreater(float(bounds[-1][2]), 1)      # the paper's error is out of reach
        self.assertLess(float(bounds[-1][2]), error)  # and the bound is valid: the model is not below it
        self.assertLess(float(fine['displacement']), 0.1 * error)
        self.assertIn('; 0 of the elements that it finds are outside', text)

    def test_rod(self):
        """The power ramp: the page has the runs' numbers, the study's table every ramp, with the largest hoop stress of its path."""
        out, docs = self.path('rod'), self.path('docs')
        run = reproduce('rod', '--quick', '--output', out, '--docs', docs)
        self.assertEqual(run.returncode, 0, run.stderr)
        with open(os.path.join(docs, 'rod.md'), encoding='utf-8') as file:
            text = file.read()
        for name in re.findall(r'\]\((rod/[^)]+\.png)\)', text):
            self.assertGreater(os.path.getsize(os.path.join(docs, name)), 5000, name)
        with open(os.path.join(out, 'rod-slice-study.csv'), encoding='utf-8') as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(len(rows), 20)
        largest = max(float(row['path_hoop']) for row in rows)
        self.assertIn(f'{largest:.3g} |', text)
        self.assertTrue(all(float(row['path_hoop']) > float(row['hoop']) for row in rows))


if __name__ == '__main__':
    unittest.main()
