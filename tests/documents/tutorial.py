"""docs/tutorial.md, docs/scenes.md, docs/bodies.md and docs/faq.md, line by line: their files are written, their commands run, the output is compared."""
import glob
import importlib.util
import os
import subprocess
import sys
import tempfile
import unittest

import document
from common import PATIENCE, SANITIZED, SOURCE, library_path

BUILD = os.path.dirname(os.environ['HYCO'])
DOCS = os.path.join(SOURCE, 'docs')


def drawable():
    """Whether the packages for scripts/plot are installed."""
    return all(importlib.util.find_spec(name) for name in ('matplotlib', 'h5py', 'numpy'))


class Documents(unittest.TestCase):
    def run_page(self, name, commands, **environment):
        with tempfile.TemporaryDirectory(prefix='hyco-document-') as folder:
            environment.update(TREE=SOURCE, PATH=BUILD + ':' + os.environ['PATH'])
            skip = (lambda line: False) if drawable() else (lambda line: 'scripts/plot' in line)
            self.assertGreaterEqual(document.run(os.path.join(DOCS, name), folder, environment, skip), commands)

    def test_tutorial(self):
        """The tutorial with an installed hyco."""
        with tempfile.TemporaryDirectory(prefix='hyco-installed-') as prefix:
            subprocess.run(['cmake', '--install', BUILD, '--prefix', prefix], check=True, timeout=100 * PATIENCE, stdout=subprocess.DEVNULL)
            library, = glob.glob(os.path.join(prefix, '**', 'libhyco.so'), recursive=True) or [None]
            if SANITIZED or not library:
                self.skipTest('the C program of the tutorial would want the flags of the library')
            paths = [os.path.join(os.path.dirname(library), 'pkgconfig'), os.environ.get('PKG_CONFIG_PATH', '')]
            self.run_page('tutorial.md', 12, PKG_CONFIG_PATH=':'.join(p for p in paths if p), LD_LIBRARY_PATH=library_path(os.path.dirname(library)))

    def test_faq(self):
        """The questions and answers."""
        self.run_page('faq.md', 8)

    def test_bodies(self):
        """The model of bodies by hand: its flexibility, forces and error at held-out samples are those that hyco prints."""
        self.run_page('bodies.md', 2)

    def test_scenes(self):
        """The complete scene with which the page on scenes begins."""
        self.run_page('scenes.md', 2)

    def test_gallery(self):
        """scripts/gallery writes the page of the examples, and draws one; the page has a picture of each that has a scene."""
        if not drawable():
            self.skipTest('python3-matplotlib, python3-h5py or python3-numpy is missing')
        with tempfile.TemporaryDirectory(prefix='hyco-gallery-') as folder:
            subprocess.run([os.path.join(SOURCE, 'scripts', 'gallery'), 'rope', '--hyco', os.environ['HYCO'], '--output', folder], check=True, timeout=50 * PATIENCE)
            self.assertTrue(os.path.exists(os.path.join(folder, 'gallery', 'rope.png')))
            with open(os.path.join(folder, 'gallery.md'), encoding='utf-8') as made, open(os.path.join(DOCS, 'gallery.md'), encoding='utf-8') as page:
                text = made.read()
                self.assertEqual(text, page.read())
        for name in os.listdir(os.path.join(SOURCE, 'examples')):
            if os.path.exists(os.path.join(SOURCE, 'examples', name, 'scene.yaml')):
                self.assertIn(f'gallery/{name}.png', text)

    def test_pictures(self):
        """They are small, and the tutorial shows each."""
        with open(os.path.join(DOCS, 'tutorial.md'), encoding='utf-8') as f:
            text = f.read()
        pictures = glob.glob(os.path.join(DOCS, 'tutorial', '*.png'))
        self.assertGreaterEqual(len(pictures), 3)
        for picture in pictures:
            self.assertLess(os.path.getsize(picture), 100000, picture)
            self.assertIn('tutorial/' + os.path.basename(picture), text)

    def test_compare(self):
        """The comparison itself: words and numbers count, times do not."""
        document.compare('force 3.10, u 1e-9\n...\nseconds: 0.1 set-up', 'x\nforce 3.12, u 7e-12\ny\nseconds: 0.7 set-up\n')
        for wrong in ('force 3.20, u 1e-9', 'energy 3.10 for 1e-9', 'force 3.10', 'y\nforce 3.10, u 1e-9'):
            with self.assertRaises(AssertionError):
                document.compare(wrong, 'force 3.10, u 1e-9\ny')


if __name__ == '__main__':
    sys.exit(unittest.main())
