"""Reduced paths in 3D, where the cells at a plane of symmetry are the RID: few cells that cut the bodies from side to side."""
import csv
import os
import subprocess
import unittest

from common import PATIENCE, PELLET, SOURCE, Case

SCENE = ['-scene', os.path.join(SOURCE, 'examples', 'rod', '3d.yaml'), '-scene_mesh', 'small.msh', '-history_times',
         '0,1,4000,8000,10001,10001.03333,10025.03333,10025.53333']
POINTS = ['-values_gap', '0.04,0.05,0.06', '-values_q2', '40', '-values_creep', '1']
BETWEEN = ['-values_gap', '0.045', '-values_q2', '40', '-values_creep', '1']


class Plane(Case):
    newcomer = True

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        sizes = [w for name, n in (('m', 3), ('nr', 2), ('nc', 2), ('nzl', 2), ('nzh', 4)) for w in ('-setnumber', name, str(n))]
        subprocess.run(['gmsh', '-3', os.path.join(PELLET, 'pellet.geo'), *sizes, '-v', '1', '-o', cls.path('small.msh')], check=True,
                       timeout=60 * PATIENCE, stdout=subprocess.DEVNULL)

    def test_search(self):
        """The search first tries the plane with most contacts, and takes its model if that is accurate enough."""
        trained = self.hyco('train', *SCENE, '-model', 'm.h5', *POINTS, '-hyco_model_type', 'hybrid', '-validation_points', self.between(),
                            '-target_u', '5e-3', '-target_sigma', '2e-2', '-target_inelastic', '2e-2', '-target_max_added', '0', '-table', 'settings.csv')
        self.assertEqual(trained['search']['attempts'], trained['search']['chosen'])
        self.assertEqual(trained['search']['hybrid'], 'all')
        self.assertLess(trained['rid_fraction'], 0.5)
        self.assertGreater(trained['scan']['smallest_singular_value'], 1e-9)
        self.assertEqual(trained['scan']['points_of_other_sign'], 0)
        compared = self.hyco('compare', *SCENE, '-model', 'm.h5', *BETWEEN)
        for kind, limit in (('u', 5e-3), ('sigma', 2e-2), ('inelastic', 2e-2)):
            self.assertLess(compared['worst_' + kind]['max'], limit, kind)

    def test_greedy(self):
        """The greedy loop begins with that plane's cells and their full-order displacements, as with the options; the RID grows, and the indicator
        decreases."""
        scene = [*SCENE[:-1], '0,1,8000,10001.03333,10025.53333']
        start = ['-values_gap', '0.04,0.06', '-values_q2', '40', '-values_creep', '1', '-hyco_validation', '0', '-hyco_snapshots', 'store']
        greedy = self.hyco('train', *scene, '-greedy', '-training_grid', '2,2,2', *start, '-max_snapshots', 3, '-target', '1e-9', '-model', 'greedy.h5',
                           '-table', 'greedy.csv', status=3)
        with open(self.path('greedy.csv'), newline='', encoding='utf-8') as f:
            first, last = csv.DictReader(f)
        hand = self.hyco('train', *scene, *start, '-hyco_search', 'false', '-hyco_rid_groups', 'sym_x0', '-hyco_rid_modes', 'displacement', '-hyco_hybrid',
                         'all', '-hyco_pod_tol', '1e-13', '-model', 'hand.h5')
        self.assertEqual((int(first['rid_elements']), int(first['modes'])), (hand['rid_elements'], hand['n_modes']))
        self.assertEqual(int(last['rid_elements']), greedy['rid_elements'])
        self.assertGreater(greedy['rid_elements'], hand['rid_elements'])
        self.assertGreater(greedy['n_fe_dofs'], greedy['rid_elements'])
        self.assertEqual((first['infinite'], last['infinite']), ('0', '0'))
        self.assertLess(float(last['mean_eta_u']), float(first['mean_eta_u']))

    def between(self):
        with open(self.path('between.csv'), 'w', encoding='utf-8') as f:
            f.write('gap,q2,creep\n0.045,40,1\n0.055,40,1\n')
        return 'between.csv'


if __name__ == '__main__':
    unittest.main()
