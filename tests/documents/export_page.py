"""docs/export.md, line by line."""
import os
import tempfile
import unittest

import document
from common import SOURCE

BUILD = os.path.dirname(os.environ['HYCO'])


class Page(unittest.TestCase):
    def test_page(self):
        """Its commands run, its program has the results of predict, and what they print."""
        with tempfile.TemporaryDirectory(prefix='hyco-export-') as folder:
            environment = {'TREE': SOURCE, 'HYCO': os.environ['HYCO'], 'PATH': ':'.join([BUILD, os.environ['PATH']])}
            self.assertEqual(document.run(os.path.join(SOURCE, 'docs', 'export.md'), folder, environment), 3)


if __name__ == '__main__':
    unittest.main()
