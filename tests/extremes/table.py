"""The tables of the numerical extremes: every test's rows, printed and written to extremes.md; fails when a row is out of
its bound or a test left none. With --write-doc they go into docs/limits/extremes.md:

    (cd build/tests && /usr/bin/python3 ../../tests/extremes/table.py --write-doc)

Those want some hundreds of random scenes too: battery.py SEED COUNT and equilibrium.py SEED COUNT in the same folder, as docs/limits.md says.
"""
import csv
import glob
import os
import sys

FOLDER = 'extremes'
TABLES = {
    'contrast': 'Stiffness contrast between bodies',
    'locking': "Poisson's ratio near 0.5",
    'units': 'Units: nanometres to kilometres, Pa to TPa',
    'shapes': 'Shapes of elements',
    'gaps': 'Gaps, interference, contact that just begins, all or none',
    'bases': 'Bases',
    'rids': 'RIDs',
    'parameters': 'Parameters',
    'paths': 'Paths of bodies that flow',
    'battery': 'Random scenes',
    'equilibrium': 'Equilibrium of floating bodies',
}
HEAD = '''# Numerical extremes: every case

Written by `tests/extremes/table.py --write-doc` after `ctest -L extremes`. A case gives a value *found* within its *bound*, or is *refused*: one line and an exit
status that is not 0. [limits.md](../limits.md) has the conclusions.

'''


def read(name):
    path = os.path.join(FOLDER, name + '.csv')
    if not os.path.exists(path):
        return []
    with open(path, encoding='utf-8', newline='') as f:
        return [[cell.replace('|', '/') for cell in row] for row in csv.reader(f)][1:]


def tables(write):
    text, problems = [], []
    for name, title in TABLES.items():
        rows = read(name)
        more = sorted(glob.glob(os.path.join(FOLDER, name + '_[0-9]*.csv')))
        for path in more:
            rows += read(os.path.basename(path).removesuffix('.csv'))
        if write and name in ('battery', 'equilibrium') and not more:
            problems.append(f'run some hundreds of random scenes first: {name}.py SEED COUNT')
        if not rows:
            problems.append(f'{name} left no rows: run it first (ctest -L extremes)')
        problems += [f'{name}: {row[0]}, {row[1]} is out of its bound' for row in rows if row[-1] == 'OUT']
        text += [f'## {title}', '', '| case | what | found | bound |', '|---|---|---|---|']
        text += ['| ' + ' | '.join([*row[:3], 'limit' if row[4] == 'limit' else row[3]]) + ' |' for row in rows] + ['']
    return '\n'.join(text), problems


def main():
    text, problems = tables('--write-doc' in sys.argv)
    with open('extremes.md', 'w', encoding='utf-8') as f:
        f.write(text)
    print(text)
    if problems:
        sys.exit('\n'.join(problems))
    if '--write-doc' in sys.argv:
        page = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'docs', 'limits', 'extremes.md')
        with open(page, 'w', encoding='utf-8') as f:
            f.write(HEAD + text)


if __name__ == '__main__':
    main()
