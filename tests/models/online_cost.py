"""A prediction uses the RID only: with the same modes and RID, its cost does not grow with the mesh."""
import csv
import os
import statistics
import unittest

from common import ROPE, Case

FACTOR = 4  # of noise; the meshes differ by 50


class Flat(Case):
    def seconds(self, nodes, *options):
        """Median of some predictions, and the elements of the RID."""
        mesh, model, table = (self.path(f'{nodes}.{end}') for end in ('msh', 'h5', 'csv'))
        if not os.path.exists(model):
            self.rope_mesh(mesh, nodes)
            self.hyco('train', '-scene', ROPE, '-scene_mesh', mesh, '-grid', '4,5', '-hyco_pod_max_modes', '9', '-hyco_hybrid',
                      'all', '-model', model)
        self.hyco('predict', '-model', model, '-grid', '8,9', '-table', table, *options)
        with open(table, encoding='utf-8') as file:
            return statistics.median(float(row['seconds']) for row in csv.DictReader(file))

    def test_cost(self):
        """The time of a prediction hardly grows from 1e3 to 5e4 nodes."""
        own = [self.seconds(n, '-hyco_reconstruct', 'false') for n in (1000, 50000)]
        self.assertLess(own[1], FACTOR * own[0], 'the forces of the RID alone')
        whole = self.seconds(50000)
        self.assertGreater(whole, FACTOR * own[1], 'and the test can tell: the reconstruction asks for every contact')


if __name__ == '__main__':
    unittest.main()
