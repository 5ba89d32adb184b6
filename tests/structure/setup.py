"""scripts/setup without the right to install: it lists the missing packages and the command that installs them, and continues if only tests or
pictures need them. Debian's tools are replaced by stand-ins."""
import os
import subprocess
import tempfile
import unittest

from common import PATIENCE

SETUP = os.path.join(os.environ['HYCO_SOURCE'], 'scripts', 'setup')
TOOLS = {
    'id': 'echo 1000',
    'sudo': 'exit 1',
    'apt-get': 'echo "apt-get $*" >>"$CALLED"',
    'apt-cache': 'exit 1',
    'update-alternatives': 'exit 1',
    'dpkg-architecture': 'echo none',
    'dpkg-query': 'for p; do :; done; case " $MISSING " in *" $p "*) echo "unknown ok not-installed" ;; *) echo "install ok installed" ;; esac',
}


class Setup(unittest.TestCase):
    def run_setup(self, missing, *args, **other):
        """Status, what it said, whether apt-get was called; other: stand-ins in place of those above."""
        with tempfile.TemporaryDirectory() as folder:
            for name, text in {**TOOLS, **other}.items():
                path = os.path.join(folder, name)
                with open(path, 'w', encoding='ascii') as file:
                    file.write(f'#!/bin/sh\n{text}\n')
                os.chmod(path, 0o755)
            called = os.path.join(folder, 'called')
            run = subprocess.run(['sh', SETUP, *args], capture_output=True, text=True, timeout=60 * PATIENCE, check=False, stdin=subprocess.DEVNULL,
                                 env={**os.environ, 'PATH': folder + ':' + os.environ['PATH'], 'MISSING': missing, 'CALLED': called})
            return run.returncode, run.stdout + run.stderr, os.path.exists(called)

    def test_missing(self):
        """Missing packages are listed with the command; those for tests alone are no error."""
        for missing, status in (('', 0), ('python3-matplotlib', 0), ('strace', 0), ('libpetsc-real-dev', 1), ('openmpi-bin strace', 1)):
            with self.subTest(missing=missing):
                code, text, called = self.run_setup(missing)
                self.assertEqual((code, called), (status, False), text)
                for name in missing.split():
                    self.assertRegex(text, rf'apt-get install --no-install-recommends.* {name}\b')

    def test_peers(self):
        """Other programs are installed where the release has them; one that it does not have is no error."""
        policy = 'case "$2" in calculix-ccx) echo "  Candidate: (none)" ;; *) echo "  Candidate: 1.0" ;; esac'
        code, text, _ = self.run_setup('calculix-ccx python3-scipy', **{'apt-cache': policy})
        self.assertEqual(code, 0, text)
        self.assertRegex(text, r'apt-get install --no-install-recommends.* python3-scipy\b')
        self.assertNotIn('calculix-ccx', text)

    def test_groups(self):
        """A group of packages alone is checked; an unknown one is refused."""
        self.assertEqual(self.run_setup('strace python3-matplotlib', 'run', 'build'), (0, '', False))
        code, text, _ = self.run_setup('', 'tests')
        self.assertEqual(code, 2)
        self.assertIn('"tests" is neither --blas nor a group', text)


if __name__ == '__main__':
    unittest.main()
