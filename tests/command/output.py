"""What the command writes is what docs/output.md lists: keys of reports, columns of tables, datasets; by the list of hyco help output."""
import csv
import json
import math
import os
import re
import shutil
import subprocess
import sys
import unittest

import h5py
import numpy as np

from common import HYCO, ROPE, SOURCE, Case

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import Grid  # noqa: E402

EXAMPLES = os.path.join(SOURCE, 'examples')
PAD = """
scene: {title: pad, mesh: mesh.msh, parameters: [mu], unit: {length: mm, force: N, stress: MPa}}
parameter: {mu: {range: [0.1, 0.5]}}
body: {pad: {law: norton, young: 1000, poisson: 0.3, rate: 1e-9, exponent: 2}}
fixed: {top: {x: "0.01*s", y: "-0.002*min(t,1)"}}
spring: {left: {x: 1}}
contact: {floor: {type: obstacle, group: base, normal: {y: -1}, gap: 0, friction: mu}}
history: {times: [0, 1, 2], tables: {s: [[0, 0], [1, 0], [2, 1]]}}
output:
  {pull: {friction: x, contact: floor}, low: {min: u_y}, peak: {max: mises}, heat: {friction: work}, turn: {moment: z, contact: floor}, touch: {area: closed, contact: floor}}
"""
RIGID = """
scene: {title: punch, mesh: mesh.msh, parameters: [load]}
parameter: {load: {range: [5, 30]}}
body: {block: {young: 1000, poisson: 0.3}, tool: {young: 1}}
fixed: {sym: {x: 0}, base: {y: 0}, tool: {x: 0}}
force: {tip: {y: -load}}
contact: {punch: {type: rigid, slave: top, master: tip, gap: x^2/20}}
output: {depth: {min: u_y, group: tip}, push: {force: y, contact: punch}}
"""
TRAINED = ['-scene', ROPE, '-output_most_max', 'u', '-grid', '4,4']
# Of the list, keys that these runs do not reach, for lack of the failure or the kind of model that they tell of.
ELSEWHERE = {'missed', 'options_from.SOURCE', 'unseen_feature', 'fallback', 'greedy.max_eta', 'n_supremizers', 'dual_misfit', 'cubature_error', 'n_inelastic_modes',
             'inelastic_amplification', 'equilibrium', 'search.variant', 'held_out.ERROR.end', 'ties[].slave_over_master', 'contacts[].slave_over_master', 'contacts[].n_between_nodes',
             'contacts[].stiffness_over_master_min', 'contacts[].stiffness_over_master_max', 'estimate.bodies_refused',
             'equilibrium.worst', 'equilibrium.t', 'equilibrium.worst_contact', 'equilibrium.residual', 'equilibrium.contact',
             'training_error_u', 'training_error_lambda_rid', 'condition', 'ties[].name', 'ties[].n_nodes', 'gradient_kinks[].output', 'gradient_kinks[].parameter',
             'gradient_kinks[].t', 'without_gradient', 'no_equilibrium'}


def listed():
    run = subprocess.run([HYCO, 'help', 'output'], capture_output=True, text=True, check=True)
    return [line.split('\t') for line in run.stdout.splitlines()]


def fits(value, node, path, found):
    """Whether a value is what the schema says, strictly: no key that it does not name. Adds the places to `found`."""
    found.add(path)
    kinds = node.get('type', [])
    kinds = kinds if isinstance(kinds, list) else [kinds]
    real = {'string': isinstance(value, str), 'boolean': isinstance(value, bool), 'integer': isinstance(value, int) and not isinstance(value, bool),
            'number': isinstance(value, (int, float)) and not isinstance(value, bool), 'array': isinstance(value, list), 'object': isinstance(value, dict), 'null': value is None}
    assert 'const' in node or any(real[kind] for kind in kinds), f'{path}: {value!r} is no {kinds}'
    assert value == node.get('const', value), (path, value)
    if isinstance(value, list):
        for one in value:
            fits(one, node['items'], path + '[]', found)
    for key, one in value.items() if isinstance(value, dict) else ():
        inner = node.get('properties', {}).get(key) or next((v for k, v in node.get('patternProperties', {}).items() if re.search(k, key)), None) or node.get('additionalProperties')
        assert inner, f'{path}.{key} is not listed'
        named = key in node.get('properties', {})
        fits(one, inner, f'{path}.{key if named else "NAME"}', found)


def row_of(path):
    """The numbers of the one row of a table."""
    with open(path, encoding='utf-8') as f:
        row, = csv.DictReader(f)
    return {name: float(value) for name, value in row.items()}


class Output(Case):
    newcomer = True

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        grid = Grid()
        grid.box('quad4', [np.linspace(0, 2, 9), np.linspace(0, 1, 5)], lambda x: x, 'pad', {'y0': 'base', 'y1': 'top', 'x0': 'left'})
        grid.write(cls.path('mesh.msh'))
        pad = cls.changed('pad.yaml', PAD, ())
        for name in ('block', 'tool'):
            os.makedirs(cls.path(name), exist_ok=True)
        grid = Grid()
        axis = 4 * np.linspace(0, 1, 9)**1.5
        grid.box('quad4', [axis, -axis[::-1]], lambda x: x, 'block', {'x0': 'sym', 'y0': 'base', 'y1': 'top'})
        grid.tool('quad4', [np.array([6., 6.4]), np.array([0., 0.4])])
        grid.write(cls.path('block', 'mesh.msh'))
        punch = cls.changed('block/scene.yaml', RIGID, ())
        blocks = os.path.join(EXAMPLES, 'blocks')
        runs = [('check', ['check', '-scene', ROPE, '-check_solve']), ('check', ['check', '-scene', os.path.join(EXAMPLES, 'rod')]), ('check', ['check', '-scene', blocks]),
                ('solve', ['solve', '-scene', ROPE, '-mu', '0.07,0.17', '-output', 'rope.xdmf']), ('solve', ['solve', '-scene', punch, '-mu', '20', '-gradient', '-output', 'punch.xdmf', '-table', 'solve-one.csv']),
                ('solve', ['solve', '-scene', pad, '-mu', '0.3', '-output', 'pad.xdmf', '-table', 'solve-path.csv', '-gradient']),
                ('solve', ['solve', '-scene', pad, '-values_mu', '0.3', '-table', 'solve-paths.csv', '-gradient']),
                ('solve', ['solve', '-scene', blocks, '-contact_under_type', 'mortar', '-mu', '0.05,0.05', '-output', 'blocks.xdmf']),
                ('solve', ['solve', '-scene', blocks, '-grid', '2,2', '-table', 'solve-set.h5', '-output', 'set.xdmf']),
                ('train', ['train', *TRAINED, '-target_u', '0.1', '-model', 'model.h5', '-table', 'train-search.csv']),
                ('train', ['train', '-scene', ROPE, '-greedy', '-training_grid', '4,4', '-max_snapshots', '8', '-hyco_model_type', 'hybrid', '-model', 'greedy.h5', '-table', 'train-greedy.csv']),
                ('predict', ['predict', '-model', 'model.h5', '-mu', '0.07,0.17', '-gradient', '-output', 'rope-p.xdmf', '-table', 'predict-one.csv']), ('predict', ['predict', '-model', 'greedy.h5', '-mu', '0.07,0.17', '-output', 'rid.xdmf']),
                ('predict', ['predict', '-model', 'model.h5', '-grid', '3,3', '-gradient', '-table', 'predict-set.h5']),
                ('fit', ['fit', '-model', 'model.h5', '-target_most', '0.4', *TRAINED[:4]]),
                ('compare', ['compare', *TRAINED[:4], '-model', 'model.h5', '-grid', '2,2', '-table', 'compare.csv'])]
        cls.reports = [(command, cls.hyco(*args, status=None)) for command, args in runs]
        cls.list = listed()

    def columns(self, of):
        """The columns of a kind of table, as expressions for the names in them."""
        names = {'PARAMETER': 'mu|mu1|mu2|crown|press|load', 'OUTPUT': 'pull|low|peak|heat|turn|touch|most|depth|push', 'CONTACT': 'floor|ground|under|punch', 'ERROR': r'\w+'}
        return [''.join(f'({names[word]})' if word in names else re.escape(word) for word in re.split('(PARAMETER|OUTPUT|CONTACT|ERROR)', row[2]))
                for row in self.list if row[0] == 'table' and (row[1] in ('all', *of) or set(of) & set(row[1].split()) and ' of ' not in row[1] and '-' not in row[1])]

    def test_reports(self):
        """Every key of a report is in the schema, with its type; every key of the list occurs, but those of failures and other models."""
        with open(os.path.join(SOURCE, 'docs', 'report.schema.json'), encoding='utf-8') as f:
            schema = json.load(f)
        found = set()
        for command, report in self.reports:
            self.assertFalse(set(schema['required']) - set(report))
            fits(report, schema['$defs'][command], command, found)
        known = set()
        for place in found:
            known.add(place.split('.', 1)[-1])
        for place, of, name, *_ in self.list:
            if place != 'report' or name in ELSEWHERE:
                continue
            parts = '.'.join('NAME' + p[len(p.rstrip('[]')):] if p.rstrip('[]').isupper() else p for p in name.split('.'))
            self.assertIn(parts, known, f'{name} of {of} is listed and not written')

    def test_units(self):
        """Units of outputs follow from those of the scene, in reports and beside the printed numbers."""
        units = {'pull': 'N', 'low': 'mm', 'peak': 'MPa', 'heat': 'N mm', 'turn': 'N mm', 'touch': ''}
        self.assertEqual(next(report['output_units'] for _, report in self.reports if 'pull' in report.get('outputs', ())), units)
        run = self.run_raw('solve', '-scene', self.path('pad.yaml'), '-mu', '0.3')
        self.assertRegex(run.stdout, ', '.join(f'{name} [^ ]+{" " * bool(unit)}{unit}' for name, unit in sorted(units.items())) + '\n')
        run = self.run_raw('solve', '-scene', self.path('pad.yaml'), '-mu', '0.3', '-scene_unit_force', 'N/mm')
        self.assertRegex(run.stdout, r'turn [^ ]+ \(N/mm\) mm')

    def test_gain(self):
        """One figure of gain: CPU of a set at full order over CPU of it predicted, from the sums of compare's table, and in train; the break-even follows from both."""
        trained = next(r for c, r in self.reports if c == 'train' and 'greedy' not in r)
        compared = next(r for c, r in self.reports if c == 'compare')
        for report in (trained, compared):
            gain = report['gain']
            self.near(gain['times'], gain['cpu_full_order'] / gain['cpu_predicted'], 1e-12)
            saved = gain['cpu_full_order'] - gain['cpu_predicted']
            self.assertEqual(gain.get('break_even'), math.ceil(gain['cpu_training'] / saved) if saved > 0 else None)
        self.assertEqual(compared['gain']['cpu_training'], trained['gain']['cpu_training'])
        with open(self.path('compare.csv'), newline='', encoding='ascii') as f:
            rows = list(csv.DictReader(f))
        for name in ('cpu_full_order', 'cpu_predicted'):
            self.near(sum(float(r[name]) for r in rows) / len(rows), compared['gain'][name], 1e-6)

    def test_tables(self):
        """Columns of tables, as .csv and as datasets of one dimension, are in the list."""
        for name, of in (('solve-path.csv', ('path', 'path of solve')), ('solve-set.h5', ('solve',)), ('solve-one.csv', ('solve',)), ('solve-paths.csv', ('solve',)),
                         ('predict-set.h5', ('predict',)), ('predict-one.csv', ('predict',)), ('train-search.csv', ('train',)),
                         ('train-greedy.csv', ('train -greedy',)), ('compare.csv', ('compare',))):
            if name.endswith('.h5'):
                with h5py.File(self.path(name)) as f:
                    columns = list(f)
                    self.assertEqual({data.ndim for data in f.values()}, {1}, name)
                    self.assertEqual(len({len(data) for data in f.values()}), 1, name)
            else:
                with open(self.path(name), encoding='utf-8') as f:
                    columns = next(csv.reader(f))
            patterns = self.columns(of if 'path' not in of else (*of, 'solve'))
            for column in columns:
                self.assertTrue(any(re.fullmatch(p, column) for p in patterns), f'{name}: {column} is not listed')
            if name in ('solve-path.csv', 'train-search.csv', 'train-greedy.csv'):
                own = [row[2] for row in self.list if row[0] == 'table' and row[1] in of and row[2].islower()]
                self.assertFalse(set(own) - set(columns), name)

    def test_case_of_names(self):
        """An output T keeps its name beside the time t; one with the name of a column has a prefix."""
        self.hyco('solve', '-scene', self.path('pad.yaml'), '-mu', '0.3', '-output_T_max', 'u', '-output_mises_max', 'mises', '-table', 'names.csv')
        with open(self.path('names.csv'), newline='', encoding='ascii') as f:
            names = next(csv.reader(f))
        self.assertLessEqual({'t', 'T', 'mises', 'output.mises'}, set(names))
        self.assertEqual(len(names), len(set(names)))

    def test_fields(self):
        """Datasets of field files are in the list; units are those of the scene."""
        listed_sets = {row[2] for row in self.list if row[0] == 'fields'}
        written = set()
        for name in ('rope', 'punch', 'pad', 'blocks', 'set', 'rope-p', 'rid'):
            with h5py.File(self.path(name + '.h5')) as f:
                sets = []
                f.visititems(lambda path, data: sets.append(path) if isinstance(data, h5py.Dataset) else None)
            for path in sets:
                path = re.sub(r'^step-\d+/xyz$', 'mesh/xyz', re.sub('^step-[0-9]+/(?=nodes|cells)', '', path))
                path = re.sub('^mu/.*', 'mu/NAME', re.sub('inelastic_[xyz]+$', 'inelastic_COMPONENT', path))
                if path not in listed_sets and path.startswith('cells/'):
                    self.assertEqual(name, 'pad', path)
                    path = 'cells/VARIABLE'
                self.assertIn(path, listed_sets, name)
                written.add(path)
        self.assertEqual(listed_sets - written, {'mesh/topology'})  # of cells of several types
        with h5py.File(self.path('pad.h5')) as f:
            units = {name: data.attrs['unit'] for name, data in f['step-0001/nodes'].items() if 'unit' in data.attrs}
            self.assertEqual({row[2].split('/')[1]: {'length': b'mm', 'force': b'N', 'stress': b'MPa'}[row[4]] for row in self.list
                              if row[2].startswith('nodes/') and row[4] != '-'}, units)

    def test_rows(self):
        """The row of a single point and of a path have the numbers of their reports; those of a path beside its largest ones."""
        reports = {command: [report for name, report in self.reports if name == command] for command in ('solve', 'predict')}
        for name, report in (('solve-one.csv', reports['solve'][1]), ('solve-paths.csv', reports['solve'][2]), ('predict-one.csv', reports['predict'][0])):
            row = row_of(self.path(name))
            self.assertEqual(row['converged'], 1)
            self.near(row['total_contact_force'], report['total_contact_force'], 1e-6, name)
            for key, value in report['outputs'].items():
                self.near(row[key], value, 1e-6, key)
                for p, slope in report.get('gradient', {}).get(key, {}).items():
                    self.near(row[f'd_{key}_d_{p}'], slope, 1e-6, key)
        path = reports['solve'][2]['history']
        self.near(row_of(self.path('solve-paths.csv'))['largest_mises'], max(path['mises']), 1e-6)
        for key, values in path['outputs'].items():
            self.near(row_of(self.path('solve-paths.csv'))['path_' + key], (min if key == 'low' else max)(values), 1e-6, key)

    def test_page(self):
        """docs/output.md and the schema are what scripts/output-page writes."""
        for name in ('output.md', 'report.schema.json'):
            shutil.copy(os.path.join(SOURCE, 'docs', name), self.folder)
        subprocess.run([sys.executable, os.path.join(SOURCE, 'scripts', 'output-page'), HYCO, self.folder], check=True)
        for name in ('output.md', 'report.schema.json'):
            with open(self.path(name), encoding='utf-8') as new, open(os.path.join(SOURCE, 'docs', name), encoding='utf-8') as old:
                self.assertEqual(new.read(), old.read(), name)


if __name__ == '__main__':
    unittest.main()
