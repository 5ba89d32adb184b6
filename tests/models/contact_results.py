"""Results of each contact in a prediction: resultant, moment, area and largest pressure, in reports, tables and outputs, compared with full order."""
import csv
import os
import unittest

import h5py
import numpy as np

from common import PELLET, SOURCE, Case, square, msh
from paths import NORTON, FlowingRing

BLOCKS = os.path.join(SOURCE, 'examples', 'blocks')
WHOLE = ('-hyco_rid_whole', 'true', '-hyco_hybrid', 'all')
CORNER = """
scene: {mesh: mesh.msh, parameters: [push, wedge]}
parameter: {push: {range: [0.5, 2]}, wedge: {range: [-0.002, 0.002]}}
body: {block: {young: 200, poisson: 0.3}}
spring: {right: {x: 3, y: 3}, high: {x: 3, y: 3}}
pressure: {right: push*(1 + y), high: 1 + x^2}
contact:
  wall: {group: left, gap: "max(wedge, 0)*abs(y)"}
  floor: {group: low, gap: "-min(wedge, 0)*abs(x)"}
output:
  lift: {force: y, contact: floor}
  both: {force: x}
  turn: {moment: z, contact: wall}
  peak: {max: contact_pressure, contact: floor}
  most: {max: contact_pressure}
  seal: {min: contact_pressure, contact: floor}
  touch: {area: closed, contact: floor}
"""
OUTPUTS = {'weight': ('force', 'y'), 'peak': ('max', 'contact_pressure')}


def flat(contacts):
    """The numbers of a report's contacts as a table has them."""
    values = {}
    for name, c in contacts.items():
        dim = len(c['force'])
        values[f'{name}.n_active'] = c['n_active']
        values.update({f'{name}.force_{a}': v for a, v in zip('xyz', c['force'])})
        values.update({f'{name}.moment_{a}': v for a, v in zip('xyz'[3 - len(c['moment']):] if dim > 1 else '', c['moment'])} if dim > 1 else {})
        values.update({f'{name}.area': c['area'], f'{name}.pressure_max': c['pressure_max'], f'{name}.pressure_min': c['pressure_min']})
    return values


class Carried(Case):
    @classmethod
    def corner(cls, name='corner.yaml', outputs=''):
        msh(cls.path('mesh.msh'), *square(6))
        with open(cls.path(name), 'w', encoding='ascii') as f:
            f.write((CORNER if not outputs else CORNER[:CORNER.index('output:')]) + outputs)
        return cls.path(name)

    def agree(self, found, full, relative):
        """Forces and moments by the largest component of their own contact."""
        self.assertEqual(list(found), list(full))
        for name, c in full.items():
            self.assertEqual(found[name]['n'], c['n'])
            for what in ('force', 'moment'):
                if what in c:
                    np.testing.assert_allclose(found[name][what], c[what], atol=relative * np.abs(c[what]).max(), err_msg=what)
            self.near(found[name]['pressure_max'], c['pressure_max'], relative, 'pressure')
            self.assertLessEqual(abs(found[name]['pressure_min'] - c['pressure_min']), relative * c['pressure_max'])

    def table(self, *args, ranks=0, name='t.csv'):
        self.hyco(*args, '-table', name, ranks=ranks)
        if name.endswith('.h5'):
            with h5py.File(self.path(name)) as f:
                return {column: f[column][:] for column in f}
        with open(self.path(name), encoding='utf-8') as f:
            rows = list(csv.DictReader(f))
        return {column: np.array([float(row[column]) for row in rows]) for column in rows[0]}

    def test_no_gap(self):
        """Where all contacts close without a gap, the residual is no share of displacements that are round-off: models of bodies are full order's."""
        self.hyco('train', '-scene', self.corner(), '-grid', '3,3', '-model', 'b.h5', '-hyco_model_type', 'bodies')
        found, full = (self.hyco(*args, '-mu', '1,0') for args in (('predict', '-model', 'b.h5'), ('solve', '-scene', self.corner())))
        self.agree(found['contacts'], full['contacts'], 1e-9)

    def test_whole(self):
        """All displacements full order on the whole mesh: agrees with full order where the map moves nodes and turns normals, in 2D and 3D."""
        for scene, train, mu in ((BLOCKS, ('-grid', '2,2'), '0.043,0.067'), (self.corner(), ('-grid', '2,2'), '1.3,0.0007')):
            self.hyco('train', '-scene', scene, *train, '-model', 'w.h5', *WHOLE)
            full = self.hyco('solve', '-scene', scene, '-mu', mu)
            found = self.hyco('predict', '-model', 'w.h5', '-mu', mu)
            self.agree(found['contacts'], full['contacts'], 1e-8)
            for name, c in full['contacts'].items():
                self.assertEqual(found['contacts'][name]['n_active'], c['n_active'])
                self.near(found['contacts'][name]['area'], c['area'], 1e-12, 'area')
            for name, value in full.get('outputs', {}).items():
                self.near(found['outputs'][name], value, 1e-8, name)
        c = full['contacts']
        self.assertGreater(min(c['floor']['n_active'], c['wall']['n_active']), 1)
        found = full['outputs']
        self.assertEqual((found['lift'], found['turn'], found['peak']), (c['floor']['force'][1], c['wall']['moment'][0], c['floor']['pressure_max']))
        self.assertEqual(found['most'], max(v['pressure_max'] for v in c.values()))
        self.near(found['both'], c['floor']['force'][0] + c['wall']['force'][0], 1e-12)

    def test_types(self):
        """Types that reproduce the training's forces at its points reproduce their resultants; others within their accuracy."""
        scene = self.corner()
        full = self.hyco('solve', '-scene', scene, '-mu', '1.25,0.002')['contacts']
        for kind, more, bound in (('projection', ('-hyco_dual', 'snapshots'), 1e-7), ('regression', (), 1e-7), ('cubature', (), 0.03),
                                  ('hybrid', ('-hyco_rid_layers', 1), 0.03)):
            with self.subTest(kind=kind):
                self.hyco('train', '-scene', scene, '-grid', '3,3', '-grid_type', 'closed', '-model', 'k.h5', '-hyco_model_type', kind, '-hyco_pod_tol', 1e-12,
                          '-hyco_snapshots', 'kinds', *more)
                self.agree(self.hyco('predict', '-model', 'k.h5', '-mu', '1.25,0.002')['contacts'], full, bound)
        self.hyco('train', '-scene', PELLET, '-values_radius', '4.04,4.08', '-values_load', '0.8', '-model', 'p.h5', '-hyco_model_type', 'projection',
                  '-hyco_dual', 'snapshots', '-hyco_pod_tol', 0)
        full = self.hyco('solve', '-scene', PELLET, '-mu', '4.08,0.8')
        self.agree(self.hyco('predict', '-model', 'p.h5', '-mu', '4.08,0.8')['contacts'], full['contacts'], 1e-7)

    def test_unseen(self):
        """A model on an RID: resultants at unseen points are off by less than its forces are at held-out ones."""
        trained = self.hyco('train', '-scene', BLOCKS, '-grid', '5,5', '-grid_type', 'closed', '-model', 'u.h5', '-hyco_validation', 20, '-hyco_rid_contact_extension', 1)
        self.assertLess(trained['rid_fraction'], 1)
        found, full = (self.table(*args, '-grid', '4,4') for args in (('predict', '-model', 'u.h5'), ('solve', '-scene', BLOCKS)))
        worst = trained['held_out']['lambda']['largest']
        error = np.abs(found['under.force_y'] / full['under.force_y'] - 1).max()
        self.assertLess(error, worst)
        self.assertLess(worst, 0.05)
        np.testing.assert_allclose(found['under.moment_z'], full['under.moment_z'], rtol=2 * worst)
        np.testing.assert_allclose(found['under.pressure_max'], full['under.pressure_max'], rtol=0.05)

    def test_table(self):
        """The columns of sets of points are the reports' numbers, on one rank and two, as CSV and HDF5; with the fallback those of full order."""
        scene = self.corner()
        self.hyco('train', '-scene', scene, '-grid', '3,3', '-model', 't.h5', '-hyco_rid_layers', 1)
        for args in (('predict', '-model', 't.h5'), ('solve', '-scene', scene), ('predict', '-model', 't.h5', '-scene', scene, '-hyco_fallback', '-target_lambda', '1e-9')):
            one, two, h5 = (self.table(*args, '-grid', '2,2', ranks=ranks, name=name) for ranks, name in ((0, 't.csv'), (2, 't.csv'), (2, 'table.h5')))
            report = flat(self.hyco(*args, '-mu', f'{one["push"][1]},{one["wedge"][1]}')['contacts'])
            self.assertEqual([c for c in one if '.' in c], list(report))
            for name, value in report.items():
                np.testing.assert_allclose(two[name], one[name], rtol=1e-7, atol=1e-12, err_msg=name)
                np.testing.assert_allclose(h5[name], one[name], rtol=1e-7, atol=1e-12, err_msg=name)
                np.testing.assert_allclose(one[name][1], value, rtol=1e-6, atol=1e-12, err_msg=name)
            for name, column in (('lift', 'floor.force_y'), ('turn', 'wall.moment_z'), ('peak', 'floor.pressure_max'), ('seal', 'floor.pressure_min'), ('touch', 'floor.area')):
                np.testing.assert_array_equal(one[name], one[column])

    def test_seal(self):
        """The smallest pressure of a contact and its closed area are those of its nodes, at full order on 1 to 3 ranks, and by a model of bodies, with estimates:
        closed all over, and where a part is open."""
        scene = ['-scene', BLOCKS, *'-output_seal_min contact_pressure -output_seal_contact under -output_touch_area closed'.split()]
        self.hyco('train', *scene, '-hyco_validation', '10', '-model', 'seal.h5', '-hyco_model_type', 'bodies', '-grid', '3,3')
        for mu, closed in (('0.02,0.08', True), ('0.05,0.05', False)):
            runs = [self.hyco('solve', *scene, '-mu', mu, '-output', 'fields.xdmf', ranks=ranks) for ranks in (0, 3)] + [self.hyco('predict', '-model', 'seal.h5', '-mu', mu)]
            with h5py.File(self.path('fields.h5')) as f:
                slave = np.isfinite(f['nodes/contact'][:, 0])
                least = f['nodes/contact_pressure'][:, 0][slave].min()
            for found in runs:
                c, out = found['contacts']['under'], found['outputs']
                self.assertEqual((out['seal'], out['touch']), (c['pressure_min'], c['area']))
                self.assertEqual((out['seal'] > 0, c['n_active'] == c['n']), (closed, closed))
                self.assertLessEqual(abs(out['seal'] - least), 1e-8 * c['pressure_max'])
                self.near(out['touch'], runs[0]['outputs']['touch'], 1e-9)
            if closed:
                self.near(runs[0]['outputs']['touch'], 20, 1e-5)  # the length of the underside, which is curved
            self.assertIsNotNone(runs[-1]['estimated_error_outputs']['seal'])

    def test_not_reconstructed(self):
        """Without the forces outside the RID there is no resultant: no contacts in the report, nan in the table, null as an output."""
        outputs = '\n'.join(f'-output_{name}_{key} {value}' for name, (key, value) in OUTPUTS.items()).split()
        self.hyco('train', '-scene', BLOCKS, *outputs, '-grid', '3,3', '-model', 'n.h5', '-hyco_rid_contact_extension', 1)
        full, part = (self.hyco('predict', '-model', 'n.h5', '-mu', '0.05,0.05', *more) for more in ((), ('-hyco_reconstruct', 'false')))
        self.assertGreater(full['outputs']['weight'], 0)
        self.assertNotIn('contacts', part)
        self.assertEqual(part['outputs'], {'weight': None, 'peak': None})
        table = self.table('predict', '-model', 'n.h5', '-grid', '2,2', '-hyco_reconstruct', 'false')
        self.assertTrue(np.isnan(table['under.force_y']).all())

    def test_refused(self):
        """Outputs with a wrong contact, group or quantity: the message lists the valid ones."""
        for outputs, said in (('{a: {force: y, contact: roof}}', 'the contacts of the scene are: '), ('{a: {force: y, contact: floor, group: high}}', 'no node of the group high'),
                              ('{a: {max: mises, contact: wall}}', 'give a group instead'), ('{a: {force: z}}', 'no force along z'), ('{a: {moment: x}}', 'use z'),
                              ('{a: {mean: contact_pressure}}', 'min: contact_pressure'), ('{a: {area: open}}', 'closed'), ('{a: {force: up}}', 'one of x, y and z'), ('{a: {contact: wall}}', 'has no field')):
            for ranks in (0,) if outputs[4:7] != 'for' else (0, 2):
                run = self.run_raw('solve', '-scene', self.corner('bad.yaml', f'output: {outputs}\n'), '-mu', '1,0', ranks=ranks)
                with self.subTest(outputs=outputs, ranks=ranks):
                    self.assertEqual(run.returncode, 1, run.stdout)
                    self.assertEqual(run.stderr.count('hyco: error'), 1, run.stderr)
                    self.assertIn(said, run.stderr)


class OfPaths(FlowingRing):
    def test_path(self):
        """At each listed time, as outputs, and at the last in report and table: full order's by a model on the whole mesh."""
        text = 'output: {weight: {force: y, contact: fit}, peak: {max: contact_pressure}}\n'
        scene = self.scene('carried.yaml', NORTON, 'hyco: {substeps: 1}\nhistory: {times: [0, 1, 3, 6], tables: {q: [[0, 0], [1, 1]]}}\n' + text)
        self.hyco('train', '-scene', scene, '-model', 'c.h5', '-grid', '1,1', *WHOLE)
        full, found = (self.hyco(*args, '-mu', '0.0052,0.93') for args in (('solve', '-scene', scene), ('predict', '-model', 'c.h5')))
        for name, values in full['history']['outputs'].items():
            self.assertGreater(np.abs(values).max(), 0)
            np.testing.assert_allclose(found['history']['outputs'][name], values, atol=1e-7 * np.abs(values).max())
        np.testing.assert_allclose(found['contacts']['fit']['force'], full['contacts']['fit']['force'], rtol=1e-7)
        self.assertEqual(full['history']['outputs']['weight'][-1], full['contacts']['fit']['force'][1])
        self.hyco('predict', '-model', 'c.h5', '-values_gap', '0.0052', '-values_push', '0.93', '-table', 'c.csv')
        with open(self.path('c.csv'), encoding='utf-8') as f:
            row = next(csv.DictReader(f))
        self.near(float(row['fit.force_y']), found['contacts']['fit']['force'][1], 1e-6)
        self.near(float(row['path_peak']), max(found['history']['outputs']['peak']), 1e-6)


if __name__ == '__main__':
    unittest.main()
