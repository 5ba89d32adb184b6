"""scripts/bench-tradeoff and bench-growth on small cases: their tables have every setting, their pictures are written, documents
without such a section are not changed."""
import csv
import os
import subprocess
import sys
import unittest

from common import PATIENCE, SOURCE, Case

sys.path.insert(0, os.path.join(SOURCE, 'scripts', 'tradeoff'))
import page
import paths
import report


class Tradeoff(Case):
    def bench(self, name, *arguments):
        run = subprocess.run([sys.executable, os.path.join(SOURCE, 'scripts', 'bench-' + name), *arguments, '--output', self.folder],
                             cwd=SOURCE, capture_output=True, text=True, timeout=200 * PATIENCE)
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        return run.stdout

    def rows(self, name):
        with open(self.path(name + '.csv'), encoding='utf-8', newline='') as file:
            rows = list(csv.DictReader(file))
        with open(self.path(name + '.png'), 'rb') as file:
            self.assertEqual(file.read(8), b'\x89PNG\r\n\x1a\n')
        return rows

    def test_rope(self):
        """The table of the rope has a row for each setting."""
        words = self.bench('tradeoff', 'rope', '--quick', '--repeat', '1')
        rows = self.rows('rope-100')
        self.assertEqual([r['type'] for r in rows], ['hybrid', 'hybrid', 'projection', 'bodies', 'full', 'full'])
        for row in rows[:4]:
            self.assertEqual(row['status'], 'ok', row['label'])
            self.assertGreater(float(row['offline_s']), 0)
            self.assertGreater(float(row['single_s']), 0)
        self.assertLess(float(rows[1]['u_mean']), float(rows[0]['u_mean']))
        self.assertLess(float(rows[3]['lambda_max']), 1e-4)  # bodies: forces as full order's
        self.assertRegex(words, r"\| all contact forces \| [\d.-]+, [\d.-]+, [\d.]+ \|")  # bodies: accurate

    def test_rod(self):
        """One setting, one unseen path: the errors are those of a model that was judged, the times those of both full orders."""
        words = self.bench('tradeoff', 'rod', '--mesh', 'slice', '--quick')
        hybrid, newton, elastic = self.rows('rod-slice')
        self.assertEqual([hybrid['status'], hybrid['type'], newton['type'], elastic['type']], ['ok', 'hybrid', 'full', 'full'])
        for kind in paths.KINDS:
            self.assertTrue(0 < float(hybrid[kind + '_max']) < 0.05, hybrid)
        self.assertLess(float(hybrid['path_s']), float(newton['path_s']))
        self.assertIn('|  | 4: hybrid | ', words)
        self.assertTrue(words.endswith(self.bench('tradeoff', 'rod', '--mesh', 'slice', '--redraw')), 'the same page from the table')

    def test_growth(self):
        """The table of growing meshes has a row for each mesh."""
        self.bench('growth', '--rope', '50,100', '--pellet', '', '--rod', '1')
        rows = self.rows('growth')
        self.assertEqual([(r['unknowns'], r['status']) for r in rows], [('48', 'ok'), ('98', 'ok')])

    def test_choice(self):
        """The cheapest that is accurate enough, and what nothing beats, of rows that are easy to see through."""
        rows = [{'id': k, 'status': 'ok', 'batch_s': seconds, 'u_mean': error}
                for k, (seconds, error) in enumerate([(3, 0.001), (1, 0.2), (2, 0.05), (2.5, 0.06)])]
        rows.append({'id': 9, 'status': 'refused', 'label': 'no model'})
        self.assertEqual([r['id'] for r in report.pareto(rows, 'u_mean')], [1, 2, 0])
        self.assertEqual(report.cheapest(rows, 'u_mean', 0.06)['id'], 2)
        self.assertIsNone(report.cheapest(rows, 'u_mean', 1e-4))

    def test_page(self):
        """A section of a page is replaced between its marks, and a missing one is an error."""
        path = self.path('page.md')
        text = 'before\n<!-- a: written by b -->\nold\n<!-- end a -->\nafter\n'
        with open(path, 'w', encoding='utf-8') as file:
            file.write(text)
        with self.assertRaises(SystemExit):
            page.write_section(path, 'c', ['new'])
        page.write_section(path, 'a', ['new'])
        with open(path, encoding='utf-8') as file:
            self.assertEqual(file.read(), text.replace('old\n', '\nnew\n\n'))


if __name__ == '__main__':
    unittest.main()
