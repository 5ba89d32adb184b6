"""The table of the faults: the rows written by the tests, printed and written to faults.csv; fails if the rows of a test are missing. With
--write-doc it is written into docs/limits/faults.csv:

  (cd build/tests && /usr/bin/python3 ../../tests/faults/table.py --write-doc)

The results of scripts/fuzz in build-fuzz/runs/ are included, and those of scripts/sanitize in build-sanitize/summary."""
import csv
import glob
import os
import sys
import tarfile

SOURCE = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..')
TESTS = ('kill.py', 'damage.c', 'files.py', 'meshes.py', 'faults.py', 'api.c')
HEAD = ('fault', 'what happens', 'test')


def rows():
    found, problems = [], []
    for test in TESTS:
        path = os.path.join('faults', os.path.splitext(test)[0] + '.csv')
        mine = []
        if os.path.exists(path):
            with open(path, encoding='utf-8', newline='') as f:
                mine = [row + [test] for row in csv.reader(f)]
        if not mine:
            problems.append(f'{test} left no rows: run it first (ctest -L faults)')
        found += mine
    for path in sorted(glob.glob(os.path.join(SOURCE, 'build-fuzz', 'runs', '*'))):
        name = os.path.basename(path)
        with open(path, encoding='ascii') as f:
            runs, seconds = f.read().split()
        crashes = os.listdir(os.path.join(SOURCE, 'build-fuzz', 'found', name))
        kept = os.listdir(os.path.join(SOURCE, 'tests', 'fuzz', 'corpus', name))
        with tarfile.open(os.path.join(SOURCE, 'tests', 'fuzz', 'learned.tar.gz')) as f:
            learned = sum(m.isfile() and m.name.startswith(f'corpus/{name}/') for m in f)
        found.append([f'fuzzing: {name}, {seconds} s, {runs} inputs',
                      f'{len(crashes)} crashes, leaks or hangs; {len(kept)} inputs are kept for every test run, which generates thousands from them; '
                      f'{learned} for the next fuzzing run', 'scripts/fuzz'])
    path = os.path.join(SOURCE, 'build-sanitize', 'summary')
    if os.path.exists(path):
        with open(path, encoding='ascii') as f:
            tests, verdict = f.read().strip().split(',')
        found.append([f'all tests under AddressSanitizer, UndefinedBehaviorSanitizer, LeakSanitizer: {tests}', verdict,
                      'scripts/sanitize'])
    return found, problems


def write(path, found):
    with open(path, 'w', encoding='utf-8', newline='') as f:
        csv.writer(f, lineterminator='\n').writerows([HEAD, *found])


def main():
    found, problems = rows()
    write('faults.csv', found)
    print('\n'.join(' | '.join(row) for row in found))
    if problems:
        sys.exit('\n'.join(problems))
    if '--write-doc' in sys.argv:
        write(os.path.join(SOURCE, 'docs', 'limits', 'faults.csv'), found)


if __name__ == '__main__':
    main()
