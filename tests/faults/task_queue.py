"""Groups of ranks in a training: none waits while points are left, and all groups receive the error of a point that fails at once."""
import glob
import os
import signal
import subprocess
import time
import unittest

from common import HYCO, MPIRUN, PATIENCE, PELLET, SOURCE, Case, settled
from kill import children

RADII = '4.02,4.03,4.04,4.05,4.07,4.08,4.09,4.1'
POINTS = ('-values_radius', RADII, '-values_load', '0.2,0.4,0.6,0.8,1')
N = 40


def text(*names):
    with open(os.path.join(*names), encoding='utf-8') as f:
        return f.read()


def rank_of(pid):
    with open(f'/proc/{pid}/environ', encoding='utf-8', errors='replace') as f:
        words = dict(w.partition('=')[::2] for w in f.read().split('\0'))
    return int(words.get('OMPI_COMM_WORLD_RANK', words.get('PMI_RANK', -1)))


class Queue(Case):
    def scene(self, name, *old_new):
        content = text(name)
        for old, new in old_new:
            self.assertIn(old, content)
            content = content.replace(old, new)
        path = self.path(f'{self.id()}.yaml')
        with open(path, 'w', encoding='utf-8') as f:
            f.write(content)
        return path

    def solutions(self, model):
        return glob.glob(self.path(model + '.snapshots', '*.h5'))

    def wait(self, model, n, run, seconds=20):
        """Waits until there are n solutions, as long as the run continues."""
        deadline = time.monotonic() + seconds * PATIENCE
        while len(self.solutions(model)) < n and run.poll() is None and time.monotonic() < deadline:
            time.sleep(0.001)

    def check_held_up(self, held):
        """Rank `held` stops within some point for as long as the other has work."""
        model = f'held{held}.h5'
        command = [*MPIRUN, '2', HYCO, *settled(['train', '-scene', PELLET, *POINTS, '-hyco_groups', 2, '-model', model])]
        with subprocess.Popen(command, cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as run:
            self.wait(model, 1, run)
            victim, = (pid for pid in children(run.pid) if rank_of(pid) == held)
            os.kill(victim, signal.SIGSTOP)
            self.wait(model, N - 1, run, 2)
            found = len(self.solutions(model))
            os.kill(victim, signal.SIGCONT)
            _, said = run.communicate(timeout=60 * PATIENCE)
        self.assertEqual(run.returncode, 0, said)
        self.assertGreaterEqual(found, N - 1)  # all but what it is in
        self.assertEqual(len(self.solutions(model)), N)

    def test_held_up(self):
        """A group that is held up does not stop the other one."""
        self.check_held_up(1)

    def test_held_up_counter(self):
        """The rank with the queue's counters, which then does not answer."""
        self.check_held_up(0)

    def fails(self, scene, *points, word):
        run = self.run_raw('train', '-scene', scene, *points, '-hyco_groups', 2, '-model', 'm.h5', ranks=2)
        self.assertEqual(run.returncode, 1, run.stderr)
        line, = (line for line in run.stderr.splitlines() if line.startswith('hyco: '))
        self.assertIn(word, line)
        self.assertNotIn('MPI_ABORT', run.stderr)
        self.assertEqual(glob.glob(self.path('m.h5*', '*partial*')), [])
        return len(self.solutions('m.h5'))

    def test_failing_point(self):
        """The second radius has no valid stiffness: its group fails at its first point, and the other, with all of 4.02 to solve, ends."""
        scene = self.scene(os.path.join(PELLET, 'paper.yaml'), ('mesh: A.msh', f'mesh: {PELLET}/A.msh'),
                           ('young: 1e5\n    poisson: 0.3\n    map', 'young: 1e5*(radius - 4.03)/(radius - 4.03)\n    poisson: 0.3\n    map'))
        self.assertLess(self.fails(scene, *POINTS, word='young'), N // 4)

    def test_failing_path(self):
        """The other group is in a long path, which it does not finish."""
        rod = os.path.join(SOURCE, 'examples', 'rod')
        scene = self.scene(os.path.join(rod, 'scene.yaml'), ('../ring', os.path.join(rod, '..', 'ring')),
                           ('young: 74700', 'young: 74700*(creep - 2)/(creep - 2)'))
        self.assertEqual(self.fails(scene, '-values_gap', '0.05', '-values_q2', '40', '-values_creep', '0.5,2', word='young'), 0)


if __name__ == '__main__':
    unittest.main()
