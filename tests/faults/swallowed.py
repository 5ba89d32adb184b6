"""A fault while the estimates are calibrated, or while a search tries settings, ends the training: no model is written without what was requested."""
import glob
import os
import resource
import shutil
import subprocess
import time
import unittest

from common import HYCO, PATIENCE, ROPE, Case, settled


class Swallowed(Case):
    def full_after(self, ready, *args):
        """The run whose disk is full once ready() is true."""
        shutil.rmtree(self.path('m.h5.snapshots'), ignore_errors=True)
        if os.path.exists(self.path('m.h5')):
            os.remove(self.path('m.h5'))
        run = subprocess.Popen([HYCO, *settled(args)], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        while run.poll() is None and not ready():
            time.sleep(0.0005)
        resource.prlimit(run.pid, resource.RLIMIT_FSIZE, (4096, 4096))
        _, said = run.communicate(timeout=100 * PATIENCE)
        self.assertEqual(run.returncode, 1, said)
        errors = [line for line in said.splitlines() if line.startswith('hyco: error')]
        self.assertEqual(len(errors), 1, said)
        self.assertIn('m.h5 could not be written completely (File too large)', errors[0])
        self.assertFalse(os.path.exists(self.path('m.h5')))
        self.assertEqual(glob.glob(self.path('*.hyco-*')), [])

    def test_calibration(self):
        """All solutions are there; the model is built and its estimates calibrated before it is written, once."""
        def ready():
            return len(glob.glob(self.path('m.h5.snapshots', '*.h5'))) == 14 * 14 + 100

        self.full_after(ready, 'train', '-scene', ROPE, '-grid', '14,14', '-hyco_validation', 100, '-model', 'm.h5')

    def test_search(self):
        """All solutions are there, and no attempt has ended."""
        def ready():
            return len(glob.glob(self.path('m.h5.snapshots', '*.h5'))) == 48 + 30

        self.full_after(ready, 'train', '-scene', ROPE, '-grid', '4,12', '-target_u', '1e-9', '-hyco_search', 'true', '-hyco_validation', 30, '-model', 'm.h5')


if __name__ == '__main__':
    unittest.main()
