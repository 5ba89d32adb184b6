"""Sets of points on several ranks: one table, as CSV or HDF5, the same on any number of ranks, and the speed-up of a second."""
import csv
import os
import unittest

import h5py
import numpy as np

from common import ROPE, Case


class Batch(Case):
    def rows(self, name):
        """A table as CSV, without its times."""
        with open(self.path(name), encoding='utf-8', newline='') as file:
            return [{key: value for key, value in row.items() if key != 'seconds'} for row in csv.DictReader(file)]

    def test_pieces(self):
        """Rows that several ranks hold and write, whatever pieces they took: the CSV of one rank, also where full order replaces some."""
        self.run_raw('train', '-scene', ROPE, '-grid', '3,4', '-grid_type', 'centred', '-hyco_validation', 12, '-hyco_model_type', 'hybrid', '-model', 'p.h5')  # misses the default target
        predict = ('predict', '-model', 'p.h5', '-scatter', 300)
        self.hyco(*predict, '-table', 'one.csv')
        estimates = sorted(float(row['estimated_error_u']) for row in self.rows('one.csv'))
        predict += ('-scene', ROPE, '-hyco_fallback', '-target_u', min(0.9, (estimates[270] + estimates[271]) / 2))
        self.hyco(*predict, '-table', 'one.csv')
        one = self.rows('one.csv')
        full = [k for k, row in enumerate(one) if row['full_order'] == '1']
        self.assertGreaterEqual(len(full), 10)  # those above the target (the largest estimates may be equal), and any in a regime that no held-out point had
        self.assertLess(len(full), 150)
        for ranks in (2, 3):
            with self.subTest(ranks=ranks):
                self.hyco(*predict, '-table', 'many.csv', ranks=ranks)
                for k, (here, there) in enumerate(zip(self.rows('many.csv'), one, strict=True)):
                    for name, value in there.items():
                        np.testing.assert_allclose(float(here[name]), float(value), rtol=1e-6, atol=1e-8, err_msg=f'{name} of row {k}')

    def test_table(self):
        """The table of a grid is the same on any number of ranks, and in HDF5; scattered points may begin after the first ones."""
        self.hyco('train', '-scene', ROPE, '-grid', '3,4', '-model', 'r.h5')
        predict = ('predict', '-model', 'r.h5', '-grid', '40,25')
        self.hyco(*predict, '-table', 't.csv')
        with open(self.path('t.csv'), encoding='utf-8', newline='') as file:
            rows = list(csv.DictReader(file))
        for ranks in (0, 2, 3):
            with self.subTest(ranks=ranks):
                report = self.hyco(*predict, '-table', 't.h5', ranks=ranks)  # over the last one
                self.assertEqual((report['n_points'], report['not_converged']), (1000, 0))
                self.near(report['points_per_second'] * report['seconds_total'], 1000, 1e-9)
                with h5py.File(self.path('t.h5')) as file:
                    self.assertEqual({name: column.shape for name, column in file.items()}, {name: (1000,) for name in rows[0]})
                    for name in rows[0]:
                        if name != 'seconds':
                            np.testing.assert_allclose(file[name][:], [float(row[name]) for row in rows], rtol=1e-6, atol=1e-12, err_msg=name)
        self.hyco('predict', '-model', 'r.h5', '-scatter', '9', '-table', 'all.csv')
        self.hyco('predict', '-model', 'r.h5', '-scatter', '5,4', '-table', 'later.csv')
        self.alike(self.rows('later.csv'), self.rows('all.csv')[4:])
        run = self.run_raw(*predict, '-table', 'r.h5')
        self.assertEqual(run.returncode, 1)
        self.assertTrue(os.path.exists(self.path('r.h5')))
        self.hyco(*predict, '-table', 't.csv')  # the model is one still


if __name__ == '__main__':
    unittest.main()
