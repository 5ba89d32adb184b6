"""Two runs at once that write the same files or share a folder of solutions: both end well, as each would alone; files left by killed runs are
removed."""
import glob
import os
import shutil
import signal
import subprocess
import time
import unittest

from common import HYCO, PATIENCE, ROPE, Case, settled

TRAIN = ('train', '-scene', ROPE, '-grid', '6,6')
TARGETS = ('train', '-scene', ROPE, '-grid', '8,8', '-target_u', '0.3', '-hyco_model_type', 'hybrid', '-hyco_search', 'true', '-hyco_validation', '10')
GREEDY = ('train', '-scene', ROPE, '-greedy', '-training_grid', '6,6', '-max_snapshots', 8, '-hyco_greedy_keep')


class AtOnce(Case):
    def setUp(self):
        for name in os.listdir(self.folder):
            path = self.path(name)
            shutil.rmtree(path) if os.path.isdir(path) else os.remove(path)

    def start(self, *args):
        return subprocess.Popen([HYCO, *settled(args)], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def content(self, name):
        with open(self.path(name), 'rb') as f:
            return f.read()

    def left(self):
        return glob.glob(self.path('**', '*.hyco-*'), recursive=True)

    def both(self, first, second):
        runs = [self.start(*first), self.start(*second)]
        for run in runs:
            _, said = run.communicate(timeout=100 * PATIENCE)
            self.assertEqual(run.returncode, 0, said)
        self.assertEqual(self.left(), [])

    def test_one_model(self):
        """The same training twice at once, with one model and one folder: the model of one, byte for byte."""
        self.hyco(*TRAIN, '-model', 'alone.h5')
        alone = self.content('alone.h5')
        for _ in range(4):
            self.both((*TRAIN, '-model', 'm.h5'), (*TRAIN, '-model', 'm.h5'))
            self.assertEqual(self.content('m.h5'), alone)
            shutil.rmtree(self.path('m.h5.snapshots'))
            os.remove(self.path('m.h5'))

    def test_one_folder(self):
        """Two sets of settings, searches and greedy trainings on the same solutions."""
        for train, one, two in ((TRAIN, ('-hyco_pod_tol', '1e-5'), ('-hyco_pod_tol', '1e-9')),
                                (GREEDY, ('-hyco_hybrid', 'all', '-hyco_pod_tol', '1e-12'), ('-hyco_hybrid', 'all', '-hyco_pod_tol', '1e-8'))):
            self.setUp()
            share = ('-hyco_snapshots', 'shared')
            self.hyco(*train, *one, *share, '-model', 'one.h5')
            shutil.rmtree(self.path('shared'))
            self.hyco(*train, *two, *share, '-model', 'two.h5')
            shutil.rmtree(self.path('shared'))
            alone = self.content('one.h5'), self.content('two.h5')
            self.both((*train, *one, *share, '-model', 'a.h5'), (*train, *two, *share, '-model', 'b.h5'))
            self.assertEqual((self.content('a.h5'), self.content('b.h5')), alone)

    def test_search(self):
        """Two searches for settings at once that share their solutions."""
        self.both((*TARGETS, '-model', 'm.h5'), (*TARGETS, '-model', 'm.h5'))

    def test_one_report(self):
        """Two predictions at once into the same report and output."""
        self.hyco(*TRAIN, '-model', 'm.h5')
        predict = ('predict', '-model', 'm.h5', '-mu', '0.07,0.17', '-report', 'r.json', '-output', 'o.xdmf')
        for _ in range(3):
            self.both(predict, predict)

    def test_killed(self):
        """A killed run's temporary files are removed by the next one; those of a live run are kept."""
        name = self.path('m.h5.hyco-00000000-1-0.candidate')  # of another machine, new: it may be in use
        with open(name, 'w', encoding='ascii') as f:
            f.write('x')
        run = self.start(*TRAIN, '-model', 'm.h5')
        for _ in range(4000):
            if len(self.left()) > 1 or run.poll() is not None:
                break
            time.sleep(0.001)
        run.send_signal(signal.SIGKILL)
        run.communicate()
        self.hyco(*TRAIN, '-model', 'm.h5')
        self.assertEqual(self.left(), [name])
        os.utime(name, (1, 1))
        self.hyco(*TRAIN, '-model', 'm.h5')
        self.assertEqual(self.left(), [])


if __name__ == '__main__':
    unittest.main()
