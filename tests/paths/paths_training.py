"""Training over paths: greedy choice of paths by the replayed residual, target-driven training, and what is said where a model misses its paths."""
import csv
import os
import re
import signal
import subprocess
import time
import unittest

from common import HYCO, said, settled
from paths import KINDS, NORTON, SCENE
from baselines import Ring

GREEDY = ('-greedy', '-training_grid', '5,5', '-hyco_pod_tol', '1e-10', '-hyco_rid_layers', 1)
UNSEEN = ('-values_gap', '0.0043,0.0055,0.0077', '-values_push', '0.83,0.97,1.17')  # of no grid here
# Loaded, unloaded; what `back` says loads again, in another direction than before.
TURN = (SCENE.replace('LAW', NORTON).replace('[gap, push]', '[gap, push, back]').replace('  push: {range', '  back: {range: [0, 1.5]}\n  push: {range')
        .replace('20*push*q*(1 + 0.3*x/4.7)', '20*push*(q*(1 + 0.3*x/4.7) + back*w*(1 - x/3))')) + """
history:
  times: [0, 1, 3, 5, 6]
  tables: {q: [[0, 0], [1, 1], [3, 0.3], [6, 0.3]], w: [[0, 0], [3, 0], [5, 1], [6, 0]]}
"""


class Missed(Ring):
    def test_worst_named(self):
        """A model that misses its own paths: the line names those that do not reach their end, the times they reach, and the worst of the others."""
        run = self.run_raw('train', '-scene', self.norton, '-model', self.path('no.h5'), '-grid', '3,3', '-hyco_snapshots', self.path('store'),
                           '-hyco_pod_tol', '1e-13', '-hyco_hybrid', 'rank', '-hyco_rid_modes', 'displacement,stress')
        self.assertEqual(run.returncode, 1)
        line, = said(run)
        missing, of = map(int, re.search(r'(\d+) of (\d+) paths do not reach their end', line).groups())
        self.assertEqual(of, 9)
        ends = re.findall(r'gap = ([\d.]+), push = ([\d.]+) \(t = ([\d.]+)\)', line)
        self.assertEqual(len(ends), min(missing, 3))
        for gap, push, t in ends:
            self.assertTrue(0.004 <= float(gap) <= 0.008 and 0.8 <= float(push) <= 1.2 and 0 < float(t) < 12, line)
        self.assertRegex(line, r'the worst of the others, by \d+ %( or more)?, at gap = [\d.]+, push = [\d.]+')
        self.assertIn('-hyco_model_type cubature', line)

    def test_worst_cubature(self):
        """Every path ends: the worst alone."""
        run = self.run_raw('train', '-scene', self.norton, '-model', self.path('no.h5'), '-grid', '3,3', '-hyco_snapshots', self.path('store'),
                           '-hyco_pod_tol', '1e-13', '-hyco_model_type', 'cubature', '-hyco_cubature_tol', '0.9')
        self.assertEqual(run.returncode, 1)
        line, = said(run)
        self.assertNotIn('reach their end', line)
        self.assertRegex(line, r'; the worst, by \d+ %( or more)?, at gap = [\d.]+, push = [\d.]+')


class Greedy(Ring):
    """-greedy over paths: HycoROMGetEquilibrium() is the indicator."""

    def greedy(self, model, *args, **options):
        return self.hyco('train', '-scene', self.norton, '-model', self.path(model), *GREEDY, '-table', self.path(model + '.csv'), *args, **options)

    def rows(self, model):
        """The table without its seconds."""
        with open(self.path(model + '.csv'), newline='', encoding='ascii') as f:
            return [row[:-1] for row in csv.reader(f)]

    def worst(self, model):
        report = self.hyco('compare', '-scene', self.norton, '-model', self.path(model), *UNSEEN)
        self.assertEqual(report['not_converged'], 0)
        return {kind: report['worst_' + kind]['max'] for kind in KINDS}

    def test_chosen(self):
        """The indicator decreases; at 9 other points the errors are not larger than those of a grid with as many paths; it is the residual that
        predict gives for the chosen point."""
        trained = self.greedy('chosen.h5', '-max_snapshots', 6, '-target', '1e-9', '-hyco_greedy_keep', status=3)
        self.assertEqual((trained['greedy']['stop'], trained['n_samples'], trained['greedy']['iterations']), ('snapshots', 6, 2))
        rows = self.rows('chosen.h5')
        at = {name: k for k, name in enumerate(rows[0])}
        most = [float(r[at['max_eta']]) for r in rows[1:]]
        self.assertLess(most[-1], 0.2 * most[0])
        self.assertEqual(len({(r[at['gap']], r[at['push']]) for r in rows[1:]}), 3)
        first = self.hyco('predict', '-model', self.path('chosen.h5.snapshots', 'greedy-000.h5'), '-mu', f"{rows[1][at['gap']]},{rows[1][at['push']]}",
                          '-hyco_residual')['equilibrium']
        self.near(first['worst'], float(rows[1][at['eta_u']]), 1e-6)
        found = self.worst('chosen.h5')
        self.train('grid.h5', *GREEDY[3:], grid='3,2')
        for kind, error in self.worst('grid.h5').items():
            self.assertLess(found[kind], error, kind)

    def test_ranks_and_kill(self):
        """Two ranks choose like one; a run that was killed ends with the table of one that was not, and solves nothing twice."""
        settings = ('-max_snapshots', 6, '-target', '1e-9')
        self.greedy('one.h5', *settings, status=3)
        self.greedy('two.h5', *settings, status=3, ranks=2)
        self.assertEqual([r[:7] for r in self.rows('one.h5')], [r[:7] for r in self.rows('two.h5')])
        command = settled(('train', '-scene', self.norton, '-model', self.path('killed.h5'), *GREEDY, *settings, '-table', self.path('killed.h5.csv')))
        with subprocess.Popen([HYCO, *command], cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as run:
            for _ in range(6000):
                if os.path.exists(self.path('killed.h5.csv')) and len(self.rows('killed.h5')) > 1:
                    break
                time.sleep(0.002)
            run.send_signal(signal.SIGKILL)
            run.wait(60)
        self.assertFalse(os.path.exists(self.path('killed.h5')), 'it was not killed in time')
        folder = self.path('killed.h5.snapshots')
        stored = {n: os.stat(os.path.join(folder, n)).st_mtime_ns for n in os.listdir(folder) if re.fullmatch(r'[0-9a-f]{16}\.h5', n)}
        self.assertGreaterEqual(len(stored), 4)
        self.hyco(*command, status=3)
        self.alike(self.rows('killed.h5'), self.rows('one.h5'))
        for name, when in stored.items():
            self.assertEqual(os.stat(os.path.join(folder, name)).st_mtime_ns, when, 'solved again')
        self.assertFalse([n for n in os.listdir(folder) if n.startswith('greedy') and n.endswith('.h5')])

    def test_infinite(self):
        """Paths that the model does not bring to their end come first, the farthest from those that are solved; the report counts them."""
        run = self.run_raw('train', '-scene', self.norton, '-model', self.path('inf.h5'), '-greedy', '-training_grid', '4,4', '-max_snapshots', 5,
                           '-hyco_pod_tol', '1e-8', '-table', self.path('inf.h5.csv'))
        self.assertIn(run.returncode, (0, 1, 3))
        rows = self.rows('inf.h5')
        at = {name: k for k, name in enumerate(rows[0])}
        self.assertEqual((rows[1][at['eta']], rows[1][at['max_eta']]), ('inf', 'inf'))
        self.assertGreater(int(rows[1][at['infinite']]), 0)
        self.assertGreater(abs(float(rows[1][at['gap']]) - 0.004), 1e-3)

    def test_refused(self):
        """-greedy with an indicator or a type of model that paths do not have is refused."""
        for args, words in (((*GREEDY, '-hyco_greedy_indicator', 'local'), ('-hyco_greedy_indicator residual', 'history')),
                            ((*GREEDY[:3], '-hyco_model_type', 'cubature'), ('-greedy', 'cubature')),
                            ((*GREEDY, '-max_snapshots', 3), ('-max_snapshots is 3', '4 corners'))):
            run = self.run_raw('train', '-scene', self.norton, '-model', self.path('no.h5'), *args)
            self.assertEqual(run.returncode, 1, run.stdout)
            line, = said(run)
            for word in words:
                self.assertIn(word, line)
        self.assertFalse(os.path.exists(self.path('no.h5')))


class Residual(Ring):
    """predict -hyco_residual: the residual of the full-order equations along a path."""

    def test_turn(self):
        """A path that turns where no training path has turned converges with large errors: the residual shows this, and is close to the errors
        within training."""
        with open(self.path('turn.yaml'), 'w', encoding='utf-8') as f:
            f.write(TURN + 'hyco: {substeps: 1}\n')
        scene = self.path('turn.yaml')
        self.hyco('train', '-scene', scene, '-model', self.path('turn.h5'), '-values_gap', '0.004,0.006,0.008', '-values_push', '0.8,1,1.2',
                  '-values_back', 0, '-hyco_pod_tol', '1e-10', '-hyco_rid_layers', 1, '-hyco_hybrid', 'all')
        residual, error = {}, {}
        for back in (0, 1):
            predicted = self.hyco('predict', '-model', self.path('turn.h5'), '-mu', f'0.0052,0.93,{back}', '-hyco_residual')
            self.assertTrue(predicted['converged'])
            compared = self.hyco('compare', '-scene', scene, '-model', self.path('turn.h5'), '-mu', f'0.0052,0.93,{back}')
            residual[back], error[back] = predicted['equilibrium'], compared['worst_u']['max']
        self.assertLess(error[0], 1e-4)
        self.assertLess(residual[0]['worst'], 10 * error[0])
        self.assertGreater(residual[0]['worst'], error[0] / 10)
        self.assertGreater(error[1], 0.03)
        self.assertGreater(residual[1]['worst'], error[1])
        self.assertEqual((residual[1]['t'], len(residual[1]['residual'])), (5, 5))
        self.assertLess(max(residual[1]['residual'][:3]), 0.01 * residual[1]['worst'])  # before it turns

    def test_exact(self):
        """All unknowns of the whole mesh: the residual of the full order, 0; in a table of points and on two ranks the same as alone."""
        self.train('exact.h5', '-hyco_rid_whole', '-hyco_hybrid', 'all', grid='1,1', store='exact')
        found = self.predict('exact.h5', '-hyco_residual')['equilibrium']
        self.assertLess(max(found['worst'], found['worst_contact']), 1e-8)
        self.train('near.h5', '-hyco_pod_tol', '1e-9', '-hyco_rid_layers', 1)
        alone = self.predict('near.h5', '-hyco_residual')['equilibrium']
        self.hyco('predict', '-model', self.path('near.h5'), '-values_gap', '0.005,0.0055,0.006', '-values_push', '0.91,1.1', '-hyco_residual', '-table',
                  self.path('near.csv'), ranks=2)
        with open(self.path('near.csv'), encoding='utf-8') as f:
            row, = [r for r in csv.DictReader(f) if (float(r['gap']), float(r['push'])) == (0.0055, 0.91)]
        self.near(float(row['equilibrium_residual']), alone['worst'], 1e-6)
        self.assertAlmostEqual(float(row['contact_residual']), alone['worst_contact'], delta=1e-6 * alone['worst'])

    def test_types(self):
        """Every type of model has it. It is an energy norm: its size is that of the stress errors, not of the displacement's."""
        for kind in ('projection', 'cubature', 'regression'):
            self.train(kind + '.h5', '-hyco_model_type', kind, '-hyco_pod_tol', '1e-8')
            residual = self.predict(kind + '.h5', '-hyco_residual')['equilibrium']['worst']
            compared = self.compare(kind + '.h5')
            self.assertLess(compared['worst_u']['max'] / 10, residual, kind)
            self.assertLess(residual, 10 * max(compared['worst_' + error]['max'] for error in KINDS), kind)


class Targets(Ring):
    """-target_... over paths: the judged errors are those of the worst listed time."""
    newcomer = True
    settings = ('-hyco_model_type', 'hybrid', '-hyco_pod_tol', '1e-10', '-hyco_rid_layers', 1, '-hyco_hybrid', 'contact',
                '-hyco_rid_whole', 'false')  # the contact extension is open

    def test_added(self):
        """Paths are added until the targets hold at held-out paths, fresh ones among them that no path was added near to; compare finds no larger
        errors at the user's own."""
        with open(self.path('held.csv'), 'w', encoding='utf-8') as f:
            f.write('gap,push\n0.0045,0.85\n0.0052,1.05\n0.0061,0.95\n0.0072,1.15\n')
        targets = {'u': 2e-4, 'inelastic': 1e-3}
        run = [a for kind, target in targets.items() for a in ('-target_' + kind, target)]
        trained = self.train('targets.h5', *self.settings, *run, '-validation_points', 'held.csv', '-target_max_added', 8, grid='2,2')
        self.assertGreater(trained['search']['added'], 0)
        self.assertGreaterEqual(trained['n_samples'], 4 + trained['search']['added'])
        found = self.hyco('compare', '-scene', self.norton, '-model', self.path('targets.h5'), '-points', 'held.csv')
        for kind, target in targets.items():
            held = trained['held_out'][kind]
            self.assertLessEqual(held['largest'], target)
            self.assertLessEqual(held['end'], held['largest'])
            self.assertLessEqual(found['worst_' + kind]['max'], held['largest'] * 1.001, kind)

    def test_missed(self):
        """No path may be added: the best model is written, one line says what is missed, status 3."""
        trained = self.train('missed.h5', *self.settings, '-target_u', '1e-9', '-target_inelastic', '1e-9', '-target_max_added', 0, '-hyco_validation', 3,
                             grid='2,2', status=3)
        self.assertIn('the target is', trained['missed'][0])
        self.assertIn('-hyco_model_type cubature', trained['missed'][0])
        self.hyco('predict', '-model', self.path('missed.h5'), '-mu', '0.0055,0.91')


if __name__ == '__main__':
    unittest.main()
