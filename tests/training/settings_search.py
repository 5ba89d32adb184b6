"""train without any option of the method: it searches its settings, judges its model at points that were not used for training, and
reports when the model is not accurate enough."""
import csv
import os
import re
import unittest

import h5py
from common import ROPE, SOURCE, Case

BLOCKS, HERTZ, PLATE = (os.path.join(SOURCE, 'examples', n) for n in ('blocks', 'hertz', 'plate'))


class SettingsSearch(Case):
    newcomer = True

    def judged(self, scene, model, grid, u, force):
        """Errors at unseen points, means: the default limits are 0.5 % and 3 %."""
        c = self.hyco('compare', '-scene', scene, '-model', model, '-grid', grid)
        self.assertEqual(c['not_converged'], 0)
        self.assertLessEqual(c['error_u']['mean'], u)
        if force:
            self.assertLessEqual(c['error_lambda']['mean'], force)

    def test_hertz(self):
        """Surfaces that do not match and move, three parameters: a model of bodies. By name, a hybrid one is chosen from several settings."""
        t = self.hyco('train', '-scene', HERTZ, '-grid', '9,4,3', '-model', 'b.h5', timeout=300)
        self.assertEqual((t['model_type'], t['search']['attempts']), ('bodies', 1))
        self.judged(HERTZ, 'b.h5', '2,3,2', 1e-4, 1e-4)
        t = self.hyco('train', '-scene', HERTZ, '-grid', '9,4,3', '-model', 'h.h5', '-table', 'h.csv', '-hyco_model_type', 'hybrid', timeout=300)
        self.assertEqual(t['model_type'], 'hybrid')
        self.assertEqual(t['held_out']['n'], 30)
        self.assertLess(t['held_out']['lambda']['largest'], 0.03)
        self.assertLess(t['held_out']['u']['largest'], 0.005)
        with open(self.path('h.csv'), encoding='utf-8') as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(len(rows), t['search']['attempts'])
        self.judged(HERTZ, 'h.h5', '2,3,2', 0.005, 0.03)

    def test_every_type(self):
        """All settings: of surfaces that move past each other bodies and hybrid give models; the choice is the accurate model with
        the fewest operations."""
        t = self.hyco('train', '-scene', HERTZ, '-grid', '4,3,2', '-model', 'e.h5', '-table', 'e.csv', '-hyco_search_exhaustive', timeout=300)
        with open(self.path('e.csv'), encoding='utf-8') as file:
            rows = list(csv.DictReader(file))
        by_type = {r['model_type']: r for r in reversed(rows)}
        self.assertEqual(set(by_type), {'bodies', 'hybrid'})
        self.assertEqual((by_type['bodies']['failure'], by_type['bodies']['meets']), ('', '1'))
        least = min((float(r['operations']), r['model_type']) for r in rows if r['meets'] == '1')
        self.assertEqual(t['model_type'], least[1])

    def test_rope_and_blocks(self):
        """Settings found on the rope and the blocks are accurate at unseen points."""
        for scene, grid, unseen in ((ROPE, '10,12', '15,15'), (BLOCKS, '5,5', '6,6')):
            with self.subTest(scene=scene):
                name = os.path.basename(scene) + '.h5'
                t = self.hyco('train', '-scene', scene, '-grid', grid, '-model', name)
                self.assertGreater(t['search']['chosen'], 0)
                self.judged(scene, name, unseen, 0.005, 0.03)

    def test_no_contact(self):
        """Settings found on a scene without contact are accurate at unseen points."""
        t = self.hyco('train', '-scene', PLATE, '-grid', '5,4', '-model', 'plate.h5')
        self.assertLess(t['held_out']['u']['largest'], 0.005)
        self.judged(PLATE, 'plate.h5', '6,5', 0.005, 0)

    def test_held_out(self):
        """The errors that train prints are those that compare finds at the same points, and those in the model's file."""
        run = self.run_raw('train', '-scene', ROPE, '-grid', '4,4', '-grid_type', 'centred', '-model', 'j.h5', '-report', 'j.json', '-hyco_model_type', 'hybrid')
        said = re.search(r'errors at (\d+) held-out points: median u ([\d.e-]+) %, .*largest u ([\d.e-]+) %', run.stdout)
        self.assertTrue(said, run.stdout)
        points = []
        for file in os.listdir(self.path('j.h5.snapshots')):
            if file.endswith('.h5'):
                with h5py.File(self.path('j.h5.snapshots', file)) as f:
                    points.append(next(tuple(f[k][()].ravel()) for k in ('mu', 'parameters') if k in f))
        with h5py.File(self.path('j.h5')) as f:
            trained = [tuple(row) for row in f['training/points'][()]]
            held = f['training/held_out'][()].ravel()
        unseen = [p for p in points if not any(max(abs(a - b) for a, b in zip(p, q)) < 1e-12 for q in trained)]
        self.assertEqual((len(unseen), int(said[1]), int(held[0])), (20, 20, 20))
        with open(self.path('unseen.csv'), 'w', encoding='ascii') as f:
            f.write('mu1,mu2\n' + ''.join(f'{a!r},{b!r}\n' for a, b in ((float(x), float(y)) for x, y in unseen)))
        c = self.hyco('compare', '-scene', ROPE, '-model', 'j.h5', '-points', 'unseen.csv')
        self.near(held[4], c['error_u']['max'], 1e-6)
        self.near(float(said[3]) / 100, c['error_u']['max'], 0.1)

    def test_below_the_bar(self):
        """Three solutions are not sufficient: the model is written, with one line for each limit that it misses, status 3."""
        t = self.hyco('train', '-scene', ROPE, '-grid', '2,2', '-model', 'bad.h5', '-hyco_model_type', 'hybrid', '-hyco_rid_whole', 'false', status=3)
        self.assertTrue(all('held-out points' in line for line in t['missed']), t)
        self.assertTrue(os.path.exists(self.path('bad.h5')))

    def test_greedy(self):
        """Without options: 25 chosen solutions of the rope give forces within 1 % on average at unseen points."""
        self.hyco('train', '-scene', ROPE, '-greedy', '-training_grid', '12,12', '-max_snapshots', 30, '-model', 'g.h5', timeout=300, status=None)
        c = self.hyco('compare', '-scene', ROPE, '-model', 'g.h5', '-grid', '15,15')
        self.assertLess(c['error_u']['mean'], 5e-4)
        self.assertLess(c['error_lambda']['mean'], 1e-2)

    def test_same_on_ranks(self):
        """The settings, and the errors at the held-out points, on one rank and on two."""
        found = [self.hyco('train', '-scene', ROPE, '-grid', '4,4', '-model', f'{ranks}.h5', '-hyco_model_type', 'hybrid', ranks=ranks,
                           status=None) for ranks in (0, 2)]
        self.assertEqual(found[0]['search'], found[1]['search'])
        for kind in ('u', 'sigma', 'lambda'):
            self.near(found[1]['held_out'][kind]['largest'], found[0]['held_out'][kind]['largest'], 1e-6)


if __name__ == '__main__':
    unittest.main()
