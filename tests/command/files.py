"""Files: a model needs nothing else, a training resumes, nothing is left half-written."""
import glob
import os
import shutil
import subprocess
import sys
import unittest

import h5py
import numpy as np

from common import ROPE, SOURCE, Case

KEYS = ('n_samples', 'n_modes', 'n_dual_modes', 'n_fe_dofs', 'rid_nodes', 'rid_elements', 'rid_a_nodes', 'rid_contacts',
        'condition', 'training_error_u', 'training_error_lambda_rid')


class Files(Case):
    def train(self, model='m.h5', scene=ROPE, grid='4,5', **options):
        return self.hyco('train', '-scene', scene, '-grid', grid, '-model', model, **options)

    def snapshots(self, model='m.h5'):
        return sorted(glob.glob(self.path(model + '.snapshots', '*')))

    def tearDown(self):
        left = [f for f in glob.glob(self.path('**'), recursive=True) if 'partial' in f]
        self.assertEqual(left, [])
        for name in os.listdir(self.folder):
            path = self.path(name)
            shutil.rmtree(path) if os.path.isdir(path) else os.remove(path)

    def test_marks(self):
        """The byte order mark with which spreadsheets and editors begin a file: of points, of a scene, of a mesh, of a deck."""
        mark = '\ufeff'
        shutil.copytree(ROPE, self.path('scene'))
        for name in ('rope.msh', 'scene.yaml'):
            with open(self.path('scene', name), 'r+', encoding='utf-8') as f:
                text = f.read()
                f.seek(0)
                f.write(mark + text)
        for name, text in (('points.csv', 'mu1,mu2\n0.07,0.17\n'),
                           ('deck.inp', '*NODE\n1,0,0\n2,1,0\n3,0,1\n*ELEMENT, TYPE=CPE3, ELSET=part\n1,1,2,3\n')):
            with open(self.path(name), 'w', encoding='utf-8') as f:
                f.write(mark + text)
        self.assertEqual(self.hyco('solve', '-scene', 'scene', '-points', 'points.csv')['not_converged'], 0)
        subprocess.run([sys.executable, os.path.join(SOURCE, 'scripts', 'convert'), 'deck.inp', 'deck.msh'], cwd=self.folder, check=True, capture_output=True)

    def test_model_alone(self):
        """predict from a copy of the model, with scene and mesh gone and from another folder."""
        shutil.copytree(ROPE, self.path('scene'))
        self.train(scene=self.path('scene'))
        here = self.hyco('predict', '-model', 'm.h5', '-mu', '0.07,0.17')
        os.makedirs(self.path('away'))
        shutil.move(self.path('m.h5'), self.path('away', 'x.h5'))
        shutil.rmtree(self.path('scene'))
        shutil.rmtree(self.path('m.h5.snapshots'))
        there = self.hyco('predict', '-model', 'x.h5', '-mu', '0.07,0.17', '-output', 'o.xdmf', cwd=self.path('away'))
        for key in ('total_contact_force', 'n_active', 'rid_u_norm2', 'rid_strain_energy'):
            self.assertEqual(here[key], there[key])
        with h5py.File(self.path('away', 'o.h5')) as f:
            self.assertEqual(f['nodes/displacement'].shape[0], 100)
        view = self.run_raw('view', '-model', 'x.h5', cwd=self.path('away'))
        self.assertEqual((view.returncode, view.stderr), (0, ''))
        self.assertIn('elastic rope', view.stdout)

    def test_resume(self):
        """Some snapshots and the model deleted: the same command solves the missing ones alone, to the same model."""
        first = self.train()
        names = self.snapshots()
        self.assertEqual(len(names), 20)
        for name in names[::3] + [self.path('m.h5')]:
            os.remove(name)
        before = {name: os.stat(name).st_mtime_ns for name in self.snapshots()}
        again = self.train()
        self.assertEqual(self.snapshots(), names)
        for name, time in before.items():
            self.assertEqual(os.stat(name).st_mtime_ns, time, 'a snapshot that was there was written again')
        for key in KEYS[:8]:
            self.assertEqual(first[key], again[key], key)
        for key in KEYS[8:]:
            self.near(again[key], first[key], 1e-6, key)

    def test_damaged_snapshot(self):
        """A snapshot cut by a full disk is refused by name, or solved again."""
        first = self.train()
        names = self.snapshots()
        with open(names[3], 'r+b') as f:
            f.truncate(100)
        run = self.run_raw('train', '-scene', ROPE, '-grid', '4,5', '-model', 'm.h5')
        if run.returncode:
            self.assertIn(os.path.basename(names[3]), run.stderr)
            os.remove(names[3])
        again = self.train()
        self.near(again['training_error_u'], first['training_error_u'], 1e-6)

    def test_other_format(self):
        """A model of an unknown format is refused by its number, before anything else is read."""
        self.train()
        with h5py.File(self.path('m.h5'), 'r+') as f:
            f['format'][...] = 1
            del f['sealed']  # the seal is invalid after the first change
        run = self.run_raw('predict', '-model', 'm.h5', '-mu', '0.07,0.17')
        self.assertNotEqual(run.returncode, 0)
        self.assertIn('m.h5 has model format 1, and this hyco', run.stderr)
        self.assertIn('reads formats 2 to 7; train it again', run.stderr)

    def test_more_samples(self):
        """A larger set in the same folder keeps the samples it has in common; another scene in it is refused."""
        for mu1 in ('0.1,0.2', '0.1,0.2,0.15'):
            self.hyco('train', '-scene', ROPE, '-values_mu1', mu1, '-values_mu2', '0.1,0.3', '-model', 'm.h5')
        self.assertEqual(len(self.snapshots()), 6)
        run = self.run_raw('train', '-scene', ROPE, '-values_mu1', '0.1', '-values_mu2', '0.3', '-model', 'm.h5',
                           '-force_rope_x', '-2')
        self.assertNotEqual(run.returncode, 0)
        self.assertIn('is a snapshot of another scene or mesh; remove the folder', run.stderr)

    def test_solver_options(self):
        """Options of the inner solvers also apply to the snapshots of a training, as -help says."""
        run = self.run_raw('train', '-scene', ROPE, '-grid', '2,2', '-model', 'm.h5', '-hyco_solver_type', 'tao',
                           '-hyco_solver_form', 'dual', '-hyco_tao_type', 'bntr')
        self.assertEqual(run.returncode, 0, run.stderr)

    def test_points_and_tables(self):
        """-points, and predict over a set: the table has the numbers of single predictions."""
        self.train()
        with open(self.path('p.csv'), 'w', encoding='ascii') as f:
            f.write('mu2,mu1\n0.17,0.07\n0.4,0.2\n')
        run = self.run_raw('predict', '-model', 'm.h5', '-points', 'p.csv', '-table', 't.csv')
        self.assertEqual(run.returncode, 0, run.stderr)
        table = np.genfromtxt(self.path('t.csv'), delimiter=',', names=True)
        self.assertEqual(list(table['mu1']), [0.07, 0.2])
        one = self.hyco('predict', '-model', 'm.h5', '-mu', '0.2,0.4')
        self.near(table['total_contact_force'][1], one['total_contact_force'], 1e-6)

    def test_xdmf(self):
        """The XDMF is XML whose every item is in the HDF5 file with the declared shape."""
        import xml.etree.ElementTree as xml
        self.hyco('solve', '-scene', ROPE, '-mu', '0.07,0.17', '-output', 's.xdmf')
        items = [i for i in xml.parse(self.path('s.xdmf')).iter('DataItem') if i.get('Format') == 'HDF']
        self.assertGreater(len(items), 4)
        for item in items:
            name, place = item.text.strip().split(':')
            with h5py.File(self.path(name)) as f:
                count = np.prod([int(n) for n in item.get('Dimensions').split()])
                self.assertEqual(f[place].size, count, place)


if __name__ == '__main__':
    unittest.main()
