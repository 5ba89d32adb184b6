"""Interaction on the terminal: Ctrl-C during a training, which continues with the same command; -quiet."""
import os
import signal
import subprocess
import time
import unittest

from common import HYCO, PATIENCE, PELLET, ROPE, Case, settled

TRAIN = ('train', '-scene', PELLET, '-grid', '3,4', '-model', 'm.h5')


class Interrupt(Case):
    def stored(self):
        folder = self.path('m.h5.snapshots')
        return {name: os.stat(os.path.join(folder, name)).st_mtime_ns for name in os.listdir(folder) if name.endswith('.h5')} if os.path.isdir(folder) else {}

    def test_interrupt(self):
        """Ctrl-C, and the signal of a batch system: one line, a status of its own; nothing that was solved is solved again."""
        seen = 0
        for number in (signal.SIGINT, signal.SIGTERM):
            run = subprocess.Popen([HYCO, *settled(TRAIN)], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            begin = time.monotonic()
            while len(self.stored()) <= seen and run.poll() is None and time.monotonic() - begin < 20 * PATIENCE:
                time.sleep(0.005)
            run.send_signal(number)
            _, said = run.communicate(timeout=20 * PATIENCE)
            self.assertEqual(run.returncode, 128 + number, said)
            lines = [line for line in said.splitlines() if line.startswith('hyco: ')]
            self.assertEqual(len(lines), 1, said)
            self.assertIn('solutions are stored in m.h5.snapshots', lines[0])
            self.assertFalse(os.path.exists(self.path('m.h5')))
            before = self.stored()
            self.assertGreater(len(before), seen)
            seen = len(before)
        self.hyco(*TRAIN)
        after = self.stored()
        self.assertEqual(len(after), 12)
        self.assertEqual({name: after[name] for name in before}, before)

    def test_quiet(self):
        """No text and no progress; errors, the report and the table as always."""
        for args in (('train', '-scene', ROPE, '-grid', '3,3', '-model', 'r.h5'), ('solve', '-scene', ROPE, '-mu', '0.07,0.17'),
                     ('predict', '-model', 'r.h5', '-mu', '0.07,0.17')):
            run = self.run_raw(*args, '-quiet', '-report', 'r.json')
            self.assertEqual((run.returncode, run.stdout, run.stderr), (0, '', ''), args)
            self.assertTrue(os.path.exists(self.path('r.json')))
            os.remove(self.path('r.json'))
        run = self.run_raw('solve', '-scene', ROPE, '-mu', '7,0.17', '-quiet')
        self.assertEqual((run.returncode, run.stdout, run.stderr.count('hyco: error')), (1, '', 1))


if __name__ == '__main__':
    unittest.main()
