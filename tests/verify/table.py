"""The table of the verification: every test's rows, aligned and printed, and written to verify.csv; fails if a row is out
of its bound or a test's rows are missing. Its output is also stored in verify/new, for the end of ctest's output."""
import csv
import os
import sys

from verify import FOLDER, HEAD

TESTS = ('mms', 'rope', 'lame', 'hertz', 'energy', 'ranks', 'patch', 'hybrid')


def main():
    rows, problems = [], []
    others = sorted(f[:-4] for f in os.listdir(FOLDER) if f.endswith('.csv') and f[:-4] not in TESTS)
    for test in (*TESTS, *others):
        path = os.path.join(FOLDER, test + '.csv')
        found = []
        if os.path.exists(path):
            with open(path, encoding='utf-8', newline='') as f:
                found = [tuple(row) for row in csv.reader(f)][1:]
        if not found:
            problems.append(f'{test} left no rows: run it first (ctest -L verify)')
        problems += [f'{row[0]} {row[1]} is out of its bound' for row in found if row[-1] != 'ok']
        rows += found
    width = [max(len(row[c]) for row in (HEAD, *rows)) for c in range(len(HEAD))]
    lines = ['| ' + ' | '.join(cell.ljust(w) for cell, w in zip(row, width)) + ' |' for row in (HEAD, *rows)]
    lines.insert(1, '|' + '|'.join('-' * (w + 2) for w in width) + '|')
    text = '\n'.join(lines) + '\n'
    with open('verify.csv', 'w', encoding='utf-8', newline='') as f:
        csv.writer(f, lineterminator='\n').writerows((HEAD, *rows))
    with open(os.path.join(FOLDER, 'new'), 'w', encoding='utf-8') as f:
        f.write(text)
    print(text)
    sys.exit('\n'.join(problems) or 0)


if __name__ == '__main__':
    main()
