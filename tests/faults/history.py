"""Invalid histories, and features that do not support histories: one line each, on any number of ranks."""
import glob
import os
import unittest

from common import PELLET, ROPE, SOURCE, Case

RING = os.path.join(SOURCE, 'examples', 'ring')


class Faults(Case):
    def fails(self, *args, words=(), ranks=0):
        run = self.run_raw(*args, ranks=ranks)
        self.assertNotEqual(run.returncode, 0)
        lines = [line for line in run.stderr.splitlines() if line.startswith('hyco: ')]
        self.assertEqual(len(lines), 1, run.stderr)
        for word in words:
            self.assertIn(word, lines[0])

    def ring(self, *args, words=(), ranks=0):
        self.fails('solve', '-scene', RING, '-mu', '0.01,1', *args, words=words, ranks=ranks)

    def test_times(self):
        """history: times that go back, repeat, or are no numbers are refused."""
        self.ring('-history_times', '0', words=['history_times', 'two'])
        self.ring('-history_times', '0,2,1', words=['history_times', 'back in time'], ranks=2)
        self.ring('-history_times', '0,1,1', words=['history_times', '1 follows 1'])
        self.ring('-history_times', '0,one', words=['history_times', 'one'])
        self.ring('-history_when', '0,1', words=['history_when', 'times'])

    def test_tables(self):
        """history: tables must have rows of two numbers, ascending in time, and other names than parameters."""
        self.ring('-history_tables_q', '0 1,2 2,1 3', words=['history_tables_q', 'back in time'])
        self.ring('-history_tables_q', '0,1', words=['history_tables_q', 'rows of two'])
        self.ring('-history_tables_q', '0 1 2', words=['history_tables_q', 'rows of two'])
        self.ring('-history_tables_t', '0 1', words=['history_tables_t', 'time'])
        self.ring('-history_tables_creep', '0 1', words=['history_tables_creep', 'parameter'])
        self.ring('-history_tables_x', '0 1', words=['history_tables_x', 'x, y, z'])
        self.fails('solve', '-scene', ROPE, '-mu', '0.07,0.17', '-history_tables_q', '0 1', words=['history_tables_q', 'times'])

    def test_lists_of_lists(self):
        """history: nested YAML lists of a wrong depth or length are refused."""
        for name, table, word in (('deep', '[[0, [1]]]', 'YAML'), ('odd', '[[0, 1], [2]]', 'rows of two')):
            with open(os.path.join(RING, 'scene.yaml'), encoding='utf-8') as f:
                text = f.read().replace('mesh: ring.msh', f'mesh: {RING}/ring.msh')
            path = self.path(name + '.yaml')
            with open(path, 'w', encoding='utf-8') as f:
                f.write(text.replace('history:', f'history:\n  tables: {{q: {table}}}'))
            self.fails('solve', '-scene', path, '-mu', '0.01,1', words=[word])

    def test_what_must_not_change(self):
        """Maps, normals and rates that depend on time or are negative are refused."""
        self.ring('-body_ring_map_x', 'x*(1+t)', words=['body_ring_map_x', 'time'])
        self.ring('-contact_fit_normal_x', 'x+t', words=['fit', 'normal'])
        self.ring('-body_ring_rate', '-1', words=['rate'])

    def test_values_in_time(self):
        """Errors during the path are reported with the time."""
        self.ring('-body_ring_young', '1e5-4e4*t', words=['body_ring_young', 't = '], ranks=2)

    def test_law_without_history(self):
        """A law with a state needs a history; the message names body, law and entry."""
        with open(os.path.join(RING, 'scene.yaml'), encoding='utf-8') as f:
            text = f.read().replace('mesh: ring.msh', f'mesh: {RING}/ring.msh')
        path = self.path('none.yaml')
        with open(path, 'w', encoding='utf-8') as f:
            f.write(text[:text.index('history:')])
        self.fails('solve', '-scene', path, '-mu', '0.01,1', words=['ring', 'norton', 'history'])

    def test_no_reduced_models(self):
        """Types without models of such scenes, and commands that take no set of paths; refused before anything is solved."""
        model = self.path('m.h5')
        for kind in ('bodies', 'cubature'):
            self.fails('train', '-scene', RING, '-greedy', '-training_grid', '2,2', '-model', model, '-hyco_model_type', kind,
                       words=['-greedy', kind, 'grid'])
        self.fails('solve', '-scene', RING, '-grid', '2,2', '-hyco_checkpoint', 'c.h5', words=['hyco_checkpoint'])
        self.assertFalse(os.path.exists(model))
        self.assertEqual(glob.glob(os.path.join(model + '.snapshots', '*')), [])

    def test_options(self):
        """-hyco_newton without a history or with an unknown value, and -hyco_resume without a checkpoint are refused."""
        self.fails('solve', '-scene', PELLET, '-mu', '4.06,1', '-hyco_newton', 'tangent', words=['hyco_newton'])
        self.ring('-hyco_newton', 'secant', words=['hyco_newton', 'secant'])
        self.ring('-hyco_resume', words=['hyco_checkpoint'])
        with open(self.path('not.h5'), 'w', encoding='utf-8') as f:
            f.write('not a checkpoint')
        self.ring('-hyco_resume', '-hyco_checkpoint', self.path('not.h5'), words=['not.h5'])

    def test_checkpoint_of_another_point(self):
        """A checkpoint of another point is not resumed."""
        keep = ['-hyco_checkpoint', self.path('c.h5'), '-history_times', '0,1']
        self.hyco('solve', '-scene', RING, '-mu', '0.01,1', *keep)
        self.fails('solve', '-scene', RING, '-mu', '0.011,1', *keep, '-hyco_resume', words=['c.h5', 'another'], ranks=2)


if __name__ == '__main__':
    unittest.main()
