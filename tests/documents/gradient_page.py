"""docs/gradients.md, line by line."""
import importlib.util
import os
import sys
import tempfile
import unittest

import document
from common import SANITIZED, SOURCE

BUILD = os.path.dirname(os.environ['HYCO'])


class Page(unittest.TestCase):
    def test_page(self):
        """Its commands run, its program too where the library is shared, and what they print."""
        python = importlib.util.find_spec('numpy') and not SANITIZED and os.path.exists(os.path.join(BUILD, 'libhyco.so'))
        with tempfile.TemporaryDirectory(prefix='hyco-gradients-') as folder:
            os.mkdir(os.path.join(folder, 'bin'))
            os.symlink(sys.executable, os.path.join(folder, 'bin', 'python3'))
            path = ':'.join([os.path.join(folder, 'bin'), BUILD, os.environ['PATH']])
            if not python:
                self.skipTest('the page has a program in Python')
            environment = {'TREE': SOURCE, 'PATH': path, 'PYTHONPATH': os.path.join(BUILD, 'python')}
            self.assertGreaterEqual(document.run(os.path.join(SOURCE, 'docs', 'gradients.md'), folder, environment), 3)


if __name__ == '__main__':
    unittest.main()
