"""docs/python.md and the programs of examples/python."""
import importlib.util
import os
import sys
import tempfile
import unittest

import document
from common import HYCO, SOURCE

PACKAGE = os.path.join(os.path.dirname(HYCO), 'python')


@unittest.skipIf(os.environ.get('HYCO_SANITIZE') == '1', 'the interpreter would need the sanitizers')
class Page(unittest.TestCase):
    def test_page(self):
        """Every command and file of the page; what it prints. Examples whose package is not installed are left out, and named."""
        missing = [name for name in ('scipy', 'openturns', 'pandas') if not importlib.util.find_spec(name)]
        program = {'scipy': 'fit.py', 'openturns': 'uncertainty.py', 'pandas': 'study.py'}
        with tempfile.TemporaryDirectory(prefix='hyco-python-') as folder:
            os.mkdir(os.path.join(folder, 'bin'))
            os.symlink(sys.executable, os.path.join(folder, 'bin', 'python3'))  # the interpreter of the tests
            path = os.path.join(folder, 'bin') + ':' + os.environ['PATH']
            ran = document.run(os.path.join(SOURCE, 'docs', 'python.md'), folder, {'TREE': SOURCE, 'PYTHONPATH': PACKAGE, 'PATH': path},
                               lambda line: any(program[name] in line for name in missing))
        self.assertEqual(ran, 3)
        if missing:
            self.skipTest(f'{sys.executable} has no {", ".join(missing)} (scripts/setup test): {", ".join(program[name] for name in missing)} did not run')


if __name__ == '__main__':
    unittest.main()
