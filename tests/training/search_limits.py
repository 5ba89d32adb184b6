"""What a search leaves out, and what it says about it: types beside a model that is accurate by a margin, bodies that it cannot condense, RIDs known to be
too large, settings beyond its budget of operations; full-order solutions that it does not need."""
import csv
import os
import re
import unittest

from baselines import Ring
from common import PELLET, ROPE, SOURCE

BLOCKS, PLATE = (os.path.join(SOURCE, 'examples', name) for name in ('blocks', 'plate'))
STRIP = """scene:
  title: a strip with many contacts over a bump
  mesh: strip.msh
  parameters: [load, height]
parameter:
  load: {range: [0.5, 2]}
  height: {range: [0, 0.02]}
body:
  strip: {young: 100, poisson: 0.3}
fixed:
  left: {x: 0, y: 0}
  right: {x: 0, y: 0}
pressure: {top: load}
contact:
  ground: {type: obstacle, group: bottom, normal_y: -1, gap: "0.02 - height*exp(-(x-5)^2)"}
"""
GEO = """Point(1) = {0, 0, 0}; Point(2) = {10, 0, 0}; Point(3) = {10, 0.5, 0}; Point(4) = {0, 0.5, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1}; Curve Loop(1) = {1:4}; Plane Surface(1) = {1};
Transfinite Curve{1, 3} = 801; Transfinite Curve{2, 4} = 4; Transfinite Surface{1}; Recombine Surface{1};
Physical Surface("strip") = {1}; Physical Curve("bottom") = {1}; Physical Curve("right") = {2}; Physical Curve("top") = {3};
Physical Curve("left") = {4};
"""


class SearchLimits(Ring):
    newcomer = True

    def search(self, scene, name, *args, **options):
        """The report, and the table's rows."""
        report = self.hyco('train', '-scene', scene, '-model', self.path(name + '.h5'), '-table', self.path(name + '.csv'), *args, **options)
        with open(self.path(name + '.csv'), newline='', encoding='utf-8') as f:
            return report, list(csv.DictReader(f))

    def test_margin(self):
        """A model of bodies a thousand times more accurate than the targets: no other type is tried, and the report says why; no training point is
        solved. With all settings tried they are, and the model of bodies is still chosen, or one with fewer operations."""
        report, rows = self.search(BLOCKS, 'blocks', '-grid', '5,5')
        self.assertEqual([r['model_type'] for r in rows], ['bodies'])
        self.assertEqual(set(report['search']['not_tried']), {'hybrid'})
        for why in report['search']['not_tried'].values():
            self.assertIn('settings 1 are accurate enough, without training solutions', why)
        self.assertEqual((sum(report['solved_by_group']), report['n_samples']), (6 + 2, 0))  # held-out points, the corners of the training among them
        report, rows = self.search(BLOCKS, 'every', '-grid', '5,5', '-hyco_search_exhaustive')
        self.assertEqual({r['model_type'] for r in rows}, {'bodies', 'hybrid'})
        self.assertEqual(sum(report['solved_by_group']), 25 + 25)
        self.assertLess(report['held_out']['lambda']['largest'], 1e-2)

    def test_not_recognised(self):
        """A body with too many parameters of its shape, and a scene without contact: not tried, with the body or the reason; the search goes on. Options of a
        type that the search may choose are accepted, those of others refused."""
        with open(os.path.join(BLOCKS, 'scene.yaml'), encoding='ascii') as f:
            text = f.read().replace('mesh: blocks.msh', 'mesh: ' + os.path.join(BLOCKS, 'blocks.msh'))
        scene = self.changed('many.yaml', text, (('map: {y:', 'map: {x: "x*(1 + (a*y + b*y^2 + c*y^3)/500)", y:'), ('parameters: [', 'parameters: [a, b, c, '),
                                                 ('parameter:\n', 'parameter:\n' + ''.join(f'  {p}: {{range: [0, 0.01]}}\n' for p in 'abc'))))
        report, rows = self.search(scene, 'many', '-scatter', 12, '-hyco_validation', 10, '-hyco_bodies_samples', 60, status=None)
        self.assertNotIn('bodies', [r['model_type'] for r in rows])
        self.assertRegex(report['search']['not_tried']['bodies'], 'body block: 4 parameters .*a, b, c, crown')
        report, _ = self.search(PLATE, 'plate', '-grid', '3,3')
        self.assertIn('no contact', report['search']['not_tried']['bodies'])
        run = self.run_raw('train', '-scene', BLOCKS, '-grid', '3,3', '-model', self.path('no.h5'), '-hyco_regression_kernel', 'linear')
        self.assertEqual(run.returncode, 1)
        self.assertIn('-hyco_regression_kernel', run.stderr)

    def test_too_large(self):
        """All of A full order: an RID that an earlier attempt has shown to be too large is not built again."""
        report, rows = self.search(PELLET, 'pellet', '-grid', '2,2', '-hyco_search_budget', 100, '-hyco_model_type', 'hybrid', '-target_sigma', 1e-9, '-target_max_added', 0, '-hyco_rid_layers',
                                   4, status=3)
        self.assertEqual([r['failure'] for r in rows if 'too many' in r['failure']], [])
        self.assertIn('more than 600', report['search']['not_tried']['hybrid all'])

    def test_budget(self):
        """Without a budget two models, on one rank and on two; a line names what would let the search go on."""
        args = ('-grid', '3,3', '-hyco_model_type', 'hybrid', '-target_u', 1e-15, '-target_max_added', 0)
        for ranks in (0, 2):
            report, rows = self.search(ROPE, 'few', *args, '-hyco_search_budget', 0, status=3, ranks=ranks)
            self.assertEqual([r['failure'] for r in rows], ['', ''])
            self.assertIn('-hyco_search_budget', report['search']['not_tried']['further settings'])
            self.assertIn('-hyco_search_exhaustive', report['missed'][0])
        report, rows = self.search(ROPE, 'usual', *args, status=3)
        self.assertGreater(len(rows), 4)
        self.assertGreater(report['search']['operations'], 0)
        few, _ = self.search(ROPE, 'small', *args, '-hyco_search_budget', 1e-9, status=3)
        enough = re.search(r'-hyco_search_budget (\S+) lets it go on', few['search']['not_tried']['further settings'])[1]
        _, more = self.search(ROPE, 'enough', *args, '-hyco_search_budget', enough, status=3)
        self.assertGreater(len(more), few['search']['attempts'])

    def test_many_contacts(self):
        """801 contacts, gaps and loads as parameters: one factor. A model of bodies is tried and chosen; its forces are those of full order."""
        self.drawn('strip', 2, GEO, STRIP)
        report, rows = self.search('strip', 'many', '-grid', '3,3')
        self.assertEqual((rows[0]['model_type'], report['model_type']), ('bodies', 'bodies'))
        self.assertLess(report['held_out']['lambda']['largest'], 1e-6)

    def test_paths(self):
        """Paths: models of bodies are tried first, their laws by interpolation before a cubature, which costs more. A dearer model is chosen; a line
        names the faster one, with targets that it meets."""
        train = ('train', '-scene', self.norton, '-grid', '2,2', '-hyco_snapshots', self.path('store'), '-table', self.path('paths.csv'), '-model', self.path('p.h5'))
        run = self.run_raw(*train)
        with open(self.path('paths.csv'), newline='', encoding='utf-8') as f:
            rows = list(csv.DictReader(f))
        self.assertEqual((rows[0]['model_type'], rows[0]['variant'], rows[0]['failure']), ('bodies', 'interpolation', ''))
        self.assertLess(float(rows[0]['operations']), 0.9 * float(rows[1]['operations']))
        targets = re.search(r'^faster: settings 1 take .*; to have them: (.*)$', run.stdout, re.M)[1].split()
        self.hyco(*train, *targets)
        with open(self.path('paths.csv'), newline='', encoding='utf-8') as f:
            self.assertEqual([(r['variant'], r['meets']) for r in csv.DictReader(f)], [('interpolation', '1')])


if __name__ == '__main__':
    unittest.main()
