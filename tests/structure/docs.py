"""The documents: links are valid, named files exist, the theory has each equation, the glossary each required term, the README is short."""
import glob
import os
import re
import unittest

SOURCE = os.path.dirname(os.path.realpath(os.path.join(os.environ['HYCO_SOURCE'], 'CMakeLists.txt')))
PAGES = [os.path.join(SOURCE, 'README.md'), *sorted(glob.glob(os.path.join(SOURCE, 'docs', '*.md')))]


def text(*path):
    with open(os.path.join(SOURCE, *path), encoding='utf-8') as f:
        return f.read()


def anchors(page):
    """GitHub's anchors of a page's headings."""
    return {re.sub(r'[^\w\- ]', '', line.lstrip('#').strip().lower()).replace(' ', '-')
            for line in page.splitlines() if line.startswith('#')}


class Docs(unittest.TestCase):
    def test_links(self):
        for path in PAGES:
            for target in re.findall(r'\]\(([^)\s]+)\)', text(path)):
                if target.startswith(('http:', 'https:', 'mailto:')):
                    continue
                name, _, anchor = target.partition('#')
                file = os.path.normpath(os.path.join(os.path.dirname(path), name)) if name else path
                self.assertTrue(os.path.exists(file), f'{path}: {target}')
                if anchor and file.endswith('.md'):
                    self.assertIn(anchor, anchors(text(file)), f'{path}: {target}')

    def test_files(self):
        """Every source or script that a page names exists."""
        for page in ('theory.md', 'glossary.md', 'models.md', 'faq.md', 'tutorial.md'):
            for name in re.findall(r'`((?:src|scripts|examples|include|tests)/[\w./-]+)`', text('docs', page)):
                self.assertTrue(os.path.exists(os.path.join(SOURCE, name)), f'{page}: {name}')

    def test_theory(self):
        """Equations (1) to (45), each in a line that ends with its number."""
        stated = [int(n) for n in re.findall(r'\((\d+)\)$', text('docs', 'theory.md'), flags=re.M)]
        self.assertEqual(stated, sorted(stated))
        self.assertEqual(sorted(set(stated)), list(range(1, 46)))

    def test_glossary(self):
        page = text('docs', 'glossary.md')
        for word in ('POD', 'DEIM', 'Q-DEIM', 'NNMF', 'NNLS', 'RID', 'KKT', 'LCP', 'SPD', 'slave, master', 'held-out', 'conformal', 'snapshot'):
            self.assertRegex(page, rf'(?m)^\| \*\*{re.escape(word)}')

    def test_options(self):
        """Options that the new pages name are options."""
        known = ''.join(text(name) for name in glob.glob(os.path.join(SOURCE, 'src', '*', '**', '*.c'), recursive=True))
        for page in ('theory.md', 'glossary.md', 'models.md', 'faq.md', 'tutorial.md'):
            body = re.sub(r'(?ms)^```sh status 1$.*?^```$', '', text('docs', page))  # what must fail may say anything
            for name in re.findall(r'(?<=[ `(])-(hyco_\w+|check_\w+|validation\w*)', body):
                self.assertTrue(re.search(rf'"-?{name}"', known) or name.startswith('hyco_mumps_'), f'{page}: -{name}')

    def test_readme(self):
        self.assertLessEqual(text('README.md').count('\n'), 90)


if __name__ == '__main__':
    unittest.main()
