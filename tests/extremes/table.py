"""The numerical extremes: every test's rows, printed and written to extremes.csv; fails when a row is out of its bound or a test left
none. With --write-doc they go into docs/limits/extremes.csv, and a line for each test into docs/limits.md:

    (cd build/tests && /usr/bin/python3 ../../tests/extremes/table.py --write-doc)

Those want some hundreds of random scenes too: battery.py SEED COUNT and equilibrium.py SEED COUNT in the same folder, as docs/limits.md says.
"""
import csv
import glob
import os
import sys

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..')
sys.path.insert(0, os.path.join(ROOT, 'scripts', 'tradeoff'))
from page import write_section  # noqa: E402

FOLDER = 'extremes'
HEAD = ('test', 'case', 'what', 'found', 'bound')
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
def read(name):
    path = os.path.join(FOLDER, name + '.csv')
    if not os.path.exists(path):
        return []
    with open(path, encoding='utf-8', newline='') as f:
        return list(csv.reader(f))[1:]


def tables(write):
    """All rows, each after the title of its test, and what is wrong with them."""
    table, problems = [], []
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
        table += [[title, *row[:4]] for row in rows]
    return table, problems


def share(row):
    """Share of the bound that a row uses; 0 for one without a bound."""
    side, _, bound = row[4].rpartition(' ')
    if side not in ('at least', 'at most') or not float(bound):
        return 0
    return float(row[3]) / float(bound) if side == 'at most' else float(bound) / float(row[3])


def summary(table):
    lines = ['| extreme | rows | refused | nearest to its bound | found | bound |', '|' + '---|' * 6]
    for title in TABLES.values():
        rows = [row for row in table if row[0] == title]
        worst = max(rows, key=share)
        refused = sum(row[2] == 'refused' for row in rows)
        lines.append(f'| {title} | {len(rows)} | {refused} | ' + (f'{worst[1]}: {worst[2]} | {worst[3]} | {worst[4]} |' if share(worst) else ' | | |'))
    return lines


def write(path, table):
    with open(path, 'w', encoding='utf-8', newline='') as f:
        csv.writer(f, lineterminator='\n').writerows([HEAD, *table])


def main():
    table, problems = tables('--write-doc' in sys.argv)
    write('extremes.csv', table)
    print('\n'.join(' | '.join(row) for row in table))
    if problems:
        sys.exit('\n'.join(problems))
    if '--write-doc' in sys.argv:
        write(os.path.join(ROOT, 'docs', 'limits', 'extremes.csv'), table)
        write_section(os.path.join(ROOT, 'docs', 'limits.md'), 'extremes', summary(table))


if __name__ == '__main__':
    main()
