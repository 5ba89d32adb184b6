"""Common code of the verification tests: one line and one row of a table for each quantity, and the fitted order.

A row is written to verify/TEST.csv under the folder where the test runs; table.py prints them all after the last
test."""
import csv
import os

import h5py
import numpy as np

from common import Case

FOLDER = 'verify'
HEAD = ('test', 'quantity', 'computed', 'exact', 'error', 'bound', 'verdict')


def order(size, error):
    """The slope of log(error) over log(size), fitted to all meshes."""
    return float(np.polyfit(np.log(size), np.log(error), 1)[0])


class Verify(Case):
    """`name` is the test's in the table."""
    name = ''

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        os.makedirs(FOLDER, exist_ok=True)
        cls.table = os.path.join(FOLDER, cls.name + '.csv')
        with open(cls.table, 'w', encoding='utf-8', newline='') as f:
            csv.writer(f).writerow(HEAD)

    def row(self, quantity, computed, exact, bound, least=False):
        """A number compared with its closed form: error in per cent of it, absolute if it is 0; least: one-sided,
        more is allowed."""
        difference = max(exact - computed, 0) if least else abs(computed - exact)
        unit = '%' if exact else ''
        error = 100 * difference / abs(exact) if exact else difference
        holds = bool(error <= bound)  # false for a NaN
        row = (self.name, quantity, f'{computed:.6g}', ('at least ' if least else '') + f'{exact:.6g}',
               f'{error:.2g}{unit}', f'{bound:g}{unit}', 'ok' if holds else 'OUT')
        print('VERIFY {} {}: computed {} exact {} error {} bound {}'.format(*row), flush=True)
        with open(self.table, 'a', encoding='utf-8', newline='') as f:
            csv.writer(f).writerow(row)
        with self.subTest(quantity=quantity):
            self.assertTrue(holds, f'{quantity}: {computed!r} for {exact!r}, out by {error:.3g}{unit}')

    def scene(self, text, mesh):
        """Writes scene.yaml beside the mesh that it names mesh.msh."""
        mesh.write(self.path('mesh.msh'))
        with open(self.path('scene.yaml'), 'w', encoding='utf-8') as f:
            f.write(text)
        return self.folder

    def solve(self, scene, *args, **options):
        """The report and the fields as arrays. The solution must satisfy the KKT conditions and the energy identity; by
        the written gaps, contacts with a force are closed and no node penetrates."""
        report = self.hyco('solve', '-scene', scene, '-output', self.path('out.xdmf'), *args, **options)
        self.solved(report)
        out = read(self.path('out.h5'))
        if 'lambda' in out:
            small = 1e-9 * abs(out['nodes/displacement']).max()
            self.assertLessEqual(abs(out['gap'][out['lambda'] > 0]).max(initial=0), small)
            self.assertGreaterEqual(np.nanmin(out['gap'], initial=0), -small)  # NaN where a slave faces no master
        return report, out


def read(path):
    """The arrays of an output, and for each contact the place of its (slave) node and its pressure there."""
    with h5py.File(path) as f:
        out = {name: f[name][:] for name in ('mesh/xyz', 'mesh/cells', 'nodes/displacement',
                                             'nodes/contact_pressure', 'cells/stress')}
        out['dim'] = int(f['mesh/head'][1, 0])
        if 'contact' in f:
            out['lambda'], out['gap'] = f['contact/lambda'][:, 0], f['contact/gap'][:, 0]
            index = {int(i): k for k, i in enumerate(f['mesh/node_id'][:, 0])}
            slave = [index[int(i)] for i in f['contact/node_id'][:, 0]]
            out['at'] = out['mesh/xyz'][slave]
            out['pressure'] = out['nodes/contact_pressure'][slave, 0]
    return out


def read_step(path, step):
    """The arrays of one time of a series."""
    with h5py.File(path) as f:
        fields = f[f'step-{step:04d}']
        out = {f'{kind}/{name}': fields[kind][name][:] for kind in fields for name in fields[kind]}
        out['mesh/xyz'], out['mesh/cells'] = f['mesh/xyz'][:], f['mesh/cells'][:]
        return out
