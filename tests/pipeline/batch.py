"""Sets of points on several ranks: one table, as CSV or HDF5, the same on any number of ranks, and the speed-up of a second."""
import csv
import os
import unittest

import h5py
import numpy as np

from common import ROPE, Case


class Batch(Case):
    def test_table(self):
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
                    for name in rows[0]:
                        if name != 'seconds':
                            np.testing.assert_allclose(file[name][:].ravel(), [float(row[name]) for row in rows], rtol=1e-6, atol=1e-12, err_msg=name)
        run = self.run_raw(*predict, '-table', 'r.h5')
        self.assertEqual(run.returncode, 1)
        self.assertTrue(os.path.exists(self.path('r.h5')))
        self.hyco(*predict, '-table', 't.csv')  # the model is one still


if __name__ == '__main__':
    unittest.main()
