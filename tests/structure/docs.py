"""The documents: links are valid, named files exist, the theory has each equation, the glossary each required term, the README is short."""
import csv
import glob
import os
import re
import subprocess
import sys
import tempfile
import unittest

from common import PATIENCE

SOURCE = os.path.dirname(os.path.realpath(os.path.join(os.environ['HYCO_SOURCE'], 'CMakeLists.txt')))
PAGES = [os.path.join(SOURCE, 'README.md'), *sorted(glob.glob(os.path.join(SOURCE, 'docs', '**', '*.md'), recursive=True))]


def text(*path):
    with open(os.path.join(SOURCE, *path), encoding='utf-8') as f:
        return f.read()


def anchors(page):
    """GitHub's anchors of a page's headings."""
    return {re.sub(r'[^\w\- ]', '', line.lstrip('#').strip().lower()).replace(' ', '-')
            for line in page.splitlines() if line.startswith('#')}


class Docs(unittest.TestCase):
    def test_links(self):
        """Links of the documents lead to files and headings that exist."""
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
        for page in ('theory.md', 'glossary.md', 'models.md', 'faq.md', 'tutorial.md', 'petsc.md'):
            for name in re.findall(r'`((?:src|scripts|examples|include|tests)/[\w./-]+)`', text('docs', page)):
                self.assertTrue(os.path.exists(os.path.join(SOURCE, name)), f'{page}: {name}')

    def test_theory(self):
        """Equations (1) to (45), each in a line that ends with its number."""
        stated = [int(n) for n in re.findall(r'\((\d+)\)$', text('docs', 'theory.md'), flags=re.M)]
        self.assertEqual(stated, sorted(stated))
        self.assertEqual(sorted(set(stated)), list(range(1, 46)))

    def test_glossary(self):
        """The glossary has each required term."""
        page = text('docs', 'glossary.md')
        for word in ('POD', 'DEIM', 'Q-DEIM', 'NNMF', 'NNLS', 'RID', 'KKT', 'LCP', 'SPD', 'slave, master', 'held-out', 'conformal', 'snapshot'):
            self.assertRegex(page, rf'(?m)^\| \*\*{re.escape(word)}')

    def test_options(self):
        """Options that the new pages name are options."""
        known = ''.join(text(name) for name in glob.glob(os.path.join(SOURCE, 'src', '*', '**', '*.c'), recursive=True) +
                        glob.glob(os.path.join(SOURCE, 'extensions', '*', '*.c')))
        for page in ('theory.md', 'glossary.md', 'models.md', 'faq.md', 'tutorial.md'):
            body = re.sub(r'(?ms)^```sh status 1$.*?^```$', '', text('docs', page))  # what must fail may say anything
            for name in re.findall(r'(?<=[ `(])-(hyco_\w+|check_\w+|validation\w*)', body):
                self.assertTrue(re.search(rf'"-?{name}"', known) or name.startswith('hyco_mumps_'), f'{page}: -{name}')

    def test_index_of_tests(self):
        """docs/tests.csv is what scripts/tests-index writes; every test has a sentence of its own or of its file."""
        made = subprocess.run([sys.executable, os.path.join(SOURCE, 'scripts', 'tests-index'), '-'], capture_output=True,
                              text=True, check=True, timeout=50 * PATIENCE).stdout
        self.assertEqual(text('docs', 'tests.csv'), made, 'run scripts/tests-index')
        for row in csv.DictReader(made.splitlines()):
            self.assertGreater(len(row['checks']), 8, row)

    def test_calls(self):
        """docs/architecture.md: each call of PETSc, TAO and SLEPc is in the file that the page names."""
        table = text('docs', 'architecture.md').split('## Where PETSc')[1].split('##')[0]
        rows = [row.split('|')[2:4] for row in table.splitlines() if '`src/' in row]
        self.assertGreaterEqual(len(rows), 9)
        for files, calls in rows:
            sources = ''.join(text(name) for name in re.findall(r'`(src/[^`]*)`', files))
            for call in re.findall(r'`(\w+\()\)`', calls):
                self.assertIn(call, sources, files)

    def test_diagrams(self):
        """docs/architecture.md: each function of the diagrams of a training and of a step in time is in the file beside it."""
        diagrams = text('docs', 'architecture.md').split('## A training')[1].split('## Folders')[0]
        found = re.findall(r'^ {4,}(\w+)\(\) +(\w+\.c)', diagrams, re.M)
        self.assertGreater(len(found), 25)
        for function, file in found:
            path, *_ = glob.glob(os.path.join(SOURCE, 'src', '**', file), recursive=True) or [None]
            self.assertTrue(path and re.search(rf'\b{function}\(', text(path)), (function, file))
        for file in re.findall(r'\b\w+\.c\b', diagrams):
            self.assertTrue(glob.glob(os.path.join(SOURCE, 'src', '**', file), recursive=True), file)

    def test_readme(self):
        """The README is short."""
        self.assertLessEqual(text('README.md').count('\n'), 90)

    def test_words(self):
        """All documents together have at most 42,000 words, not counting what separates the cells of tables, nor pages made from the sources."""
        others = [os.path.join(SOURCE, name) for name in ('CHANGELOG.md', 'CONTRIBUTING.md', 'extensions/README.md', 'examples/ladder/README.md')]
        words = {path: sum(bool(re.search(r'\w', word)) for word in text(path).split()) for path in [*PAGES, *others]
                 if os.sep + 'api' + os.sep not in path and not path.endswith('tolerances.md')}
        self.assertLessEqual(sum(words.values()), 42000, words)

    def test_tolerances(self):
        """docs/decisions/tolerances.md is what scripts/tolerances makes; each #define with a fraction is on it with a reason, tests and scripts that it
        names exist, and no quantity has two tolerances of one value."""
        made = subprocess.run([sys.executable, os.path.join(SOURCE, 'scripts', 'tolerances'), '-'], capture_output=True, text=True, check=True).stdout
        self.assertEqual(text('docs', 'decisions', 'tolerances.md'), made, 'run scripts/tolerances')
        rows = [[cell.strip() for cell in re.split(r'(?<!\\)\|', row)[1:-1]] for row in made.splitlines() if row.startswith('| `')]
        for row in rows:
            self.assertTrue(row[-2] and len(row[-1].split()) > 1, row)
            for name in re.findall(r'(?:tests|scripts)/[\w./-]*\w', row[-1]):
                self.assertTrue(os.path.exists(os.path.join(SOURCE, name)), row)
        sources = ''.join(re.sub(r'\\\n', ' ', text(name)) for folder in ('src', 'extensions', 'include')
                          for name in glob.glob(os.path.join(SOURCE, folder, '**', '*.[ch]'), recursive=True))
        defined = re.findall(r'^#define +(\w+) +\(?-?[\d.]+(?:\.\d*|e-\d+)', sources, re.M)
        self.assertGreater(len(defined), 200)
        self.assertLessEqual(set(defined), {row[0].strip('`') for row in rows})
        same = [(row[1], row[3]) for row in rows if len(row) == 5]
        self.assertEqual(len(same), len(set(same)), sorted(row for row in set(same) if same.count(row) > 1))

    def test_api(self):
        """docs/api is what scripts/api-pages makes of the headers, and has every function that they declare with a comment."""
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([os.path.join(SOURCE, 'scripts', 'api-pages'), folder], check=True)
            pages = os.listdir(folder)
            self.assertEqual(sorted(pages), sorted(os.listdir(os.path.join(SOURCE, 'docs', 'api'))))
            for name in pages:
                with open(os.path.join(folder, name), encoding='utf-8') as f:
                    made = f.read()
                self.assertEqual(made, text(f'docs/api/{name}'), f'{name}: run scripts/api-pages')
                header = text(f'include/{name[:-3]}.h')
                for function in re.findall(r'^PetscErrorCode (Hyco\w+)\(', header, re.M):
                    self.assertIn(f' {function}(', made)


if __name__ == '__main__':
    unittest.main()
