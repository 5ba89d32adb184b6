"""Model and snapshot files: today's that must load for ever, damaged ones, those that point elsewhere, and where hyco writes."""
import glob
import os
import random
import re
import resource
import shutil
import subprocess
import unittest

import h5py
import numpy as np

from common import HYCO, PELLET, ROPE, SOURCE, Case

DATA = os.path.join(SOURCE, 'tests', 'data')
# total contact force, displacement 2-norm, active contacts at (0.07, 0.17), as predicted when the file was written
KEPT = {
    'rope-hybrid-3.h5': ('hybrid', 0.32557839822014933, 20),
    'rope-projection-3.h5': ('projection', 0.350993482, 19),
}


class Files(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.hyco('train', '-scene', ROPE, '-grid', '4,4', '-model', 'good.h5')

    def refused(self, name, text, command='predict', *more):
        """One line, status 1, in an address space of 2 GB (a size that a file claims must not be asked for)."""
        arguments = [command, '-model', name] + (['-mu', '0.07,0.17'] if command == 'predict' else []) + list(more)
        run = subprocess.run([HYCO, *arguments], cwd=self.folder, capture_output=True, text=True, timeout=60,
                             preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30)))
        self.assertEqual(run.returncode, 1, run.stderr)
        self.assertEqual(run.stderr.count('\n'), 1, run.stderr)
        self.assertRegex(run.stderr, text)
        self.assertNotIn('internal error', run.stderr)

    def test_kept_for_ever(self):
        """Files of older formats give the numbers that they gave."""
        for name, (kind, force, active) in KEPT.items():
            report = self.hyco('predict', '-model', os.path.join(DATA, name), '-mu', '0.07,0.17', '-output', 'o.xdmf')
            self.assertEqual((report['model_type'], report['n_active']), (kind, active))
            self.near(report['total_contact_force'], force, 1e-9)
            self.solved(report)

    def test_same_bytes(self):
        """The same training twice: the same bytes."""
        self.hyco('train', '-scene', ROPE, '-grid', '4,4', '-model', 'again.h5')
        with open(self.path('good.h5'), 'rb') as a, open(self.path('again.h5'), 'rb') as b:
            self.assertEqual(a.read(), b.read())

    def edited(self, change):
        """A copy of the model without a seal, changed by h5py."""
        shutil.copy(self.path('good.h5'), self.path('bad.h5'))
        with h5py.File(self.path('bad.h5'), 'r+') as f:
            del f['sealed']
            change(f)
        return 'bad.h5'

    def test_unsealed_copy(self):
        """Whoever changes a model by hand takes the mark out: then it is read as it is."""
        self.edited(lambda f: None)
        report = self.hyco('predict', '-model', 'bad.h5', '-mu', '0.07,0.17')
        self.near(report['total_contact_force'], 0.32557839822014933, 1e-9)

    def test_lost_end(self):
        """The seal overwritten by zeros, as a crash of the machine leaves the end of a file."""
        shutil.copy(self.path('good.h5'), self.path('bad.h5'))
        with open(self.path('bad.h5'), 'r+b') as f:
            f.seek(-24, os.SEEK_END)
            f.write(bytes(24))
        self.refused('bad.h5', 'is damaged: its end is missing')

    def test_huge(self):
        """Sizes that the file cannot hold."""

        def put(name, shape, kind):
            def change(f):
                del f[name]
                f.create_dataset(name, shape=shape, dtype=kind)  # never written: takes no room
            return change

        for name, shape, kind in (('problem/V', (1 << 40, 8), 'f8'), ('problem/V', (50, 1 << 40), 'f8'),
                                  ('mesh/xyz', (1 << 28, 3), 'f8'), ('mesh/xyz', (1 << 31, 3), 'f8'),
                                  ('mesh/node_id', (1 << 40, 1), 'i4'), ('problem/scene', (1 << 33, 1), 'i1'),
                                  ('training/points', (1 << 30, 2), 'f8')):
            with self.subTest(name=name, shape=shape):
                self.refused(self.edited(put(name, shape, kind)), f'{name} is damaged')

    def test_elsewhere(self):
        """A model that sends its reader to other files, or through filters, which HDF5 would load as code."""
        with open(self.path('numbers'), 'wb') as f:
            f.write(np.zeros(1000).tobytes())
        shutil.copy(self.path('good.h5'), self.path('other.h5'))

        def replace(make):
            def change(f):
                shape = f['problem/V'].shape
                del f['problem/V']
                make(f, shape)
            return change

        def virtual(f, shape):
            layout = h5py.VirtualLayout(shape=shape, dtype='f8')
            layout[...] = h5py.VirtualSource(self.path('other.h5'), 'problem/V', shape=shape)
            f.create_virtual_dataset('problem/V', layout)

        for make, text in ((lambda f, s: f.__setitem__('problem/V', h5py.ExternalLink(self.path('other.h5'), 'problem/V')), 'holds no problem/V'),
                           (lambda f, s: f.create_dataset('problem/V', s, 'f8', external=[(self.path('numbers'), 0, s[0] * s[1] * 8)]), 'problem/V is damaged'),
                           (virtual, 'problem/V is damaged'),
                           (lambda f, s: f.create_dataset('problem/V', s, 'f8', chunks=s, compression='gzip'), 'problem/V is damaged')):
            self.refused(self.edited(replace(make)), text)

    def test_values(self):
        """Values that no training writes, in a file that is sound otherwise."""

        def put(name, at, value):
            def change(f):
                f[name][at] = value
            return change

        for name, at, value, text in (('problem/V', (3, 0), np.nan, 'not finite'), ('mesh/cells', (0, 0), 10**6, 'outside'),
                                      ('mesh/cells', (0, 0), -1, 'outside'), ('problem/pairs/slave', (0, 0), 99999, 'outside'),
                                      ('problem/sizes', (2, 0), 9, 'problem/sizes is damaged'),
                                      ('problem/fe_dof', (1, 0), 0, 'fe_dof is damaged'), ('format', (0, 0), 99, 'has model format 99'),
                                      ('kind', (0, 0), 88, 'is no hyco model'), ('mesh/head', (0, 0), 77, 'outside'),
                                      ('mesh/group_start', (1, 0), 10**6, 'damaged')):
            with self.subTest(name=name):
                self.refused(self.edited(put(name, at, value)), text)

    def test_other_scene(self):
        self.refused('good.h5', 'was trained on another scene', 'compare', '-scene', PELLET, '-grid', '2,2')

    def test_snapshots(self):
        """Each byte of a snapshot counts: flipped bits and cuts are refused by name, or no part of what is read."""
        names = sorted(glob.glob(self.path('good.h5.snapshots', '*.h5')))
        with open(names[2], 'rb') as f:
            good = f.read()
        draw = random.Random(6)
        try:
            for k in range(24):
                bad = bytearray(good)
                if k % 2:
                    bad = bad[:draw.randrange(len(bad))]
                else:
                    bad[draw.randrange(len(bad))] ^= 1 << draw.randrange(8)
                with open(names[2], 'wb') as f:
                    f.write(bad)
                run = self.run_raw('train', '-scene', ROPE, '-grid', '4,4', '-model', 'good.h5', timeout=60)
                self.assertEqual(run.returncode, 1)
                self.assertIn(os.path.basename(names[2]), run.stderr)
                self.assertIn('remove it and run again', run.stderr)
        finally:
            with open(names[2], 'wb') as f:
                f.write(good)

    def test_writes_only_what_is_named(self):
        """Every file that a run opens for writing is one that the user named, or Open MPI's own in TMPDIR."""
        os.makedirs(self.path('home'), exist_ok=True)
        os.makedirs(self.path('tmp'), exist_ok=True)
        environment = dict(os.environ, HOME=self.path('home'), TMPDIR=self.path('tmp'))
        named = ('w.h5', 'w.xdmf', 'w_.h5', 'w.json', 'w.csv')
        for arguments in (['train', '-scene', ROPE, '-grid', '3,3', '-model', 'w.h5', '-report', 'w.json'],
                          ['predict', '-model', 'w.h5', '-mu', '0.1,0.1', '-output', 'w_.xdmf', '-report', 'w.json'],
                          ['solve', '-scene', PELLET, '-mu', '4.06,1', '-output', 'w_.xdmf'],
                          ['compare', '-scene', ROPE, '-model', 'w.h5', '-grid', '2,2', '-table', 'w.csv']):
            run = subprocess.run(['strace', '-f', '-qq', '-s', '300', '-e', 'trace=open,openat,creat,mkdir,mkdirat,rename,renameat,'
                                  'renameat2,link,symlink,execve', '-o', 'trace', HYCO, *arguments], cwd=self.folder,
                                 env=environment, capture_output=True, text=True, timeout=100)
            self.assertEqual(run.returncode, 0, run.stderr)
            with open(self.path('trace'), encoding='utf-8', errors='replace') as f:
                lines = f.read().splitlines()
            self.assertGreater(len(lines), 100)
            ours = {lines[0].split()[0]}
            for line in lines:
                if line.split()[0] not in ours or '= -1' in line:  # Open MPI's daemon is another process
                    continue
                if 'execve(' in line:
                    self.assertIn('/hyco"', line, 'a program is run')
                if not re.search(r'O_WRONLY|O_RDWR|O_CREAT|^\d+ +(creat|mkdir|rename|link|symlink)', line):
                    continue
                for path in re.findall(r'"([^"]*)"', line):
                    place = os.path.normpath(os.path.join(self.folder, path))
                    # /etc/fltk: preferences that the toolkit inside gmsh's library writes for root (docs/limits.md)
                    if place.startswith((self.path('tmp'), '/dev/', '/proc/', '/sys/', '/etc/fltk/')):
                        continue
                    name = os.path.relpath(place, self.folder).replace('.partial', '')
                    self.assertTrue(name in named or name == 'w_.xdmf' or name.startswith('w.h5.snapshots'), line)
        self.assertEqual(os.listdir(self.path('home')), [])
        os.remove(self.path('trace'))


if __name__ == '__main__':
    unittest.main()
