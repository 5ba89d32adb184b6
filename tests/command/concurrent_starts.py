"""Runs without mpiexec side by side: each ends well, whatever the others do and whatever the state of the folder for temporary files."""
import concurrent.futures
import os
import subprocess
import unittest

from common import HYCO, PATIENCE, ROPE, Case

ASK = ('predict', '-model', 'm.h5', '-mu', '0.07,0.17')


class SideBySide(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.run_raw('train', '-scene', ROPE, '-grid', '4,4', '-model', 'm.h5')

    def ask(self, **environment):
        """A prediction under a changed environment (None: unset)."""
        env = {**os.environ, **environment}
        return subprocess.run([HYCO, *ASK], cwd=self.folder, env={k: v for k, v in env.items() if v is not None}, timeout=100 * PATIENCE,
                              capture_output=True, text=True, check=False)

    def answer(self, run):
        """The lines of the output, without its seconds."""
        self.assertEqual((run.returncode, run.stderr), (0, ''))
        return run.stdout.splitlines()[:-1]

    def test_eight_at_once(self):
        """Sixty runs, eight at a time, have the same answer."""
        expected = self.answer(self.ask())
        with concurrent.futures.ThreadPoolExecutor(8) as pool:
            runs = list(pool.map(lambda _: self.ask(), range(60)))
        for run in runs:
            self.assertEqual(self.answer(run), expected)

    def test_folder_for_temporary_files(self):
        """Missing, a file, unset: nothing is created there, or printed. Runs used to conflict over Open MPI's folder for all runs of
        a user."""
        with open(self.path('file'), 'w', encoding='ascii') as f:
            f.write('x')
        for place in (self.path('none'), self.path('file'), None):
            with self.subTest(TMPDIR=place):
                self.answer(self.ask(TMPDIR=place))
                self.assertFalse(os.path.exists(self.path('none')))

    def test_launched(self):
        """Ranks of mpiexec keep Open MPI's folder: they share memory through it."""
        run = self.run_raw('train', '-scene', ROPE, '-grid', '4,4', '-model', 'two.h5', ranks=2)
        self.assertEqual(run.returncode, 0, run.stderr)


if __name__ == '__main__':
    unittest.main()
