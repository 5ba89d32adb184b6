"""The search for settings over paths drops settings at the first held-out path that excludes their choice: the result is that of a search that
judges all settings at all of them."""
import csv
import unittest

from baselines import Ring


SETTINGS = ('model_type', 'variant', 'pod_tol', 'rid_layers', 'rid_contact_extension', 'hybrid', 'rid_whole')


class SearchPaths(Ring):
    newcomer = True

    def search(self, name, *args, **options):
        """The report, and the table's rows."""
        report = self.hyco('train', '-scene', self.norton, '-model', self.path(name + '.h5'), '-hyco_snapshots', self.path('store'), '-table',
                           self.path(name + '.csv'), *args, **options)
        with open(self.path(name + '.csv'), newline='', encoding='utf-8') as f:
            return report, list(csv.DictReader(f))

    def test_bodies_first(self):
        """Models of bodies come first; accurate enough at held-out paths, they end the search, and the other types are named with the reason."""
        found, rows = self.search('first', '-grid', '3,3', '-hyco_validation', '10')
        self.assertEqual([r['model_type'] for r in rows], ['bodies'])
        self.assertIn('hybrid', found['search']['not_tried'])
        self.assertLess(found['held_out']['u']['largest'], 0.01)

    def estimated(self, found):
        """Estimates at training points, where errors are small: errors peak between such points, so that an error of twice the largest held-out one
        stays within five estimates."""
        self.hyco('predict', '-model', self.path('raced.h5'), '-grid', '3,3', '-table', self.path('estimates.csv'))
        with open(self.path('estimates.csv'), newline='', encoding='utf-8') as f:
            rows = list(csv.DictReader(f))
        for kind in ('u', 'sigma', 'lambda'):
            largest = found['held_out'][kind]['largest']
            least = min(float(row['estimated_error_' + kind]) for row in rows)
            self.assertGreaterEqual(5 * least, 2 * largest * (1 - 1e-6), kind)

    def test_same_choice(self):
        """Same settings, same errors, fewer paths; on two ranks the same settings are dropped at the same paths."""
        grid = ('-grid', '3,3')
        found, rows = self.search('raced', *grid)
        every, full = self.search('every', *grid, '-hyco_search_exhaustive')
        same = {key: value for key, value in found['search'].items() if every['search'][key] == value}
        self.assertEqual(set(found['search']) - set(same) - {'attempts', 'chosen', 'operations', 'not_tried'}, set())
        self.assertGreater(len(rows), 5)
        full = [next(r for r in full if all(r[key] == row[key] for key in SETTINGS)) for row in rows]
        self.assertEqual({r['held_out_points'] for r in full}, {'20'})
        dropped = [k for k, r in enumerate(rows) if r['held_out_points'] != '20']
        self.assertGreaterEqual(len(dropped), 2)
        self.assertNotIn(found['search']['chosen'] - 1, dropped)
        for kind in ('u', 'sigma', 'lambda', 'inelastic'):
            for size in ('median', 'largest', 'end'):
                self.near(found['held_out'][kind][size], every['held_out'][kind][size], 1e-9, kind)
            for row, whole in zip(rows, full):  # at some of the paths: a lower bound
                self.assertLessEqual(float(row['error_' + kind]), float(whole['error_' + kind]) * (1 + 1e-9) + 1e-12)
        self.estimated(found)
        report, two = self.search('two', *grid, ranks=2)
        self.assertEqual(report['search']['chosen'], found['search']['chosen'])
        # of modes near round-off, models on other numbers of ranks differ
        firm = [[(r['held_out_points'], r['pod_tol'], r['hybrid']) for r in table if float(r['pod_tol']) > 1e-12] for table in (two, rows)]
        self.assertGreater(len(firm[1]), 3)
        self.assertEqual(*firm)

    def test_reason(self):
        """A line per attempt; for a dropped one where it was dropped, and which one is better. In a file, progress names the settings."""
        run = self.run_raw('train', '-scene', self.norton, '-model', self.path('said.h5'), '-grid', '3,3', '-hyco_snapshots', self.path('store'),
                           '-progress', '0.01')
        self.assertEqual(run.returncode, 0, run.stderr)
        lines = [line for line in run.stdout.splitlines() if 'dropped at held-out path' in line]
        self.assertTrue(lines, run.stdout)
        for line in lines:
            self.assertRegex(line, r'dropped at held-out path \d+ of 20: settings \d+ are better')
        self.assertRegex(run.stderr, r'(?m)^settings \d+, hybrid, pod_tol \S+, .*: held-out paths: \d+ of 20')


if __name__ == '__main__':
    unittest.main()
