"""Reduced paths in 3D, where the cells at a plane of symmetry are the RID: few cells that cut the bodies from side to side."""
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
        """The search tries the plane that most contacts meet first, and takes its model where that is good enough."""
        trained = self.hyco('train', *SCENE, '-model', 'm.h5', *POINTS, '-hyco_model_type', 'hybrid', '-validation_points', self.between(),
                            '-target_u', '5e-3', '-target_sigma', '2e-2', '-target_inelastic', '2e-2', '-target_max_added', '0', '-table', 'recipes.csv')
        self.assertEqual(trained['search']['attempts'], trained['search']['chosen'])
        self.assertEqual(trained['search']['hybrid'], 'all')
        self.assertLess(trained['rid_fraction'], 0.5)
        self.assertGreater(trained['scan']['smallest_singular_value'], 1e-9)
        self.assertEqual(trained['scan']['points_of_other_sign'], 0)
        compared = self.hyco('compare', *SCENE, '-model', 'm.h5', *BETWEEN)
        for kind, limit in (('u', 5e-3), ('sigma', 2e-2), ('inelastic', 2e-2)):
            self.assertLess(compared['worst_' + kind]['max'], limit, kind)

    def between(self):
        with open(self.path('between.csv'), 'w', encoding='utf-8') as f:
            f.write('gap,q2,creep\n0.045,40,1\n0.055,40,1\n')
        return 'between.csv'


if __name__ == '__main__':
    unittest.main()
