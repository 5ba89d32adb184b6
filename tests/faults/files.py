"""Model and snapshot files: files in today's format, which must load in all later versions, damaged ones, those with links to others, and where
hyco writes."""
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

from common import HYCO, PATIENCE, PELLET, ROPE, SANITIZED, SOURCE, Case, settled
from rows import Rows

DATA = os.path.join(SOURCE, 'tests', 'data')
# total contact force, displacement 2-norm, active contacts at (0.07, 0.17), as predicted when the file was written
KEPT = {
    'rope-hybrid-3.h5': ('hybrid', 0.32557839822014933, 20),
    'rope-projection-3.h5': ('projection', 0.350993482, 19),
    'rope-hybrid-4.h5': ('hybrid', 0.32557839822027457, 20),
    'rope-projection-4.h5': ('projection', 0.35099348195512448, 19),
    'rope-bodies-4.h5': ('bodies', 0.3486818615477193, 5),
    'rope-hybrid-4-table.h5': ('hybrid', 0.3255783982202313, 20),
}
ROWS = Rows('files')
BODIES = ['train', '-scene', ROPE, '-grid', '2,3', '-grid_type', 'centred', '-hyco_model_type', 'bodies', '-model', 'b.h5']


class Files(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.hyco('train', '-scene', ROPE, '-grid', '4,4', '-grid_type', 'centred', '-model', 'good.h5')
        cls.hyco('train', '-scene', ROPE, '-grid', '4,4', '-model', 'held.h5', '-hyco_validation', 12, status=None)
        cls.hyco(*BODIES, status=None)

    def refused(self, name, text, command='predict', *more):
        """One line, status 1, in an address space of 2 GB (a size that a file declares must not be allocated)."""
        arguments = [command, '-model', name] + (['-mu', '0.07,0.17'] if command == 'predict' else []) + list(more)
        run = subprocess.run([HYCO, *settled(arguments)], cwd=self.folder, capture_output=True, text=True, timeout=60 * PATIENCE,
                             preexec_fn=None if SANITIZED else lambda: resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30)))
        self.assertEqual(run.returncode, 1, run.stderr)
        self.assertEqual(run.stderr.count('\n'), 1, run.stderr)
        self.assertRegex(run.stderr, text)
        self.assertNotIn('internal error', run.stderr)

    def test_kept_for_ever(self):
        """Files of older formats give the same numbers as before."""
        for name, (kind, force, active) in KEPT.items():
            report = self.hyco('predict', '-model', os.path.join(DATA, name), '-mu', '0.07,0.17', '-output', 'o.xdmf')
            self.assertEqual((report['model_type'], report['n_active']), (kind, active))
            self.near(report['total_contact_force'], force, 1e-9)
            self.solved(report)
        ROWS.add(f'{len(KEPT)} models of formats 3 and 4, hybrid, projection, bodies, kept in tests/data', 'give the same numbers as before')

    def test_same_bytes(self):
        """The same training twice: the same bytes."""
        self.hyco('train', '-scene', ROPE, '-grid', '4,4', '-grid_type', 'centred', '-model', 'again.h5')
        with open(self.path('good.h5'), 'rb') as a, open(self.path('again.h5'), 'rb') as b:
            self.assertEqual(a.read(), b.read())

    def edited(self, change, model='good.h5'):
        """A copy of the model without a seal, changed by h5py."""
        shutil.copy(self.path(model), self.path('bad.h5'))
        with h5py.File(self.path('bad.h5'), 'r+') as f:
            del f['sealed']
            change(f)
        return 'bad.h5'

    def test_unsealed_copy(self):
        """A model that was changed by hand, with the mark removed, is read as it is."""
        self.edited(lambda f: None)
        report = self.hyco('predict', '-model', 'bad.h5', '-mu', '0.07,0.17')
        self.near(report['total_contact_force'], 0.32557839822014933, 1e-9)

    def test_lost_end(self):
        """The seal overwritten by zeros, as a crash of the machine leaves the end of a file."""
        shutil.copy(self.path('good.h5'), self.path('bad.h5'))
        with open(self.path('bad.h5'), 'r+b') as f:
            f.seek(-24, os.SEEK_END)
            f.write(bytes(24))
        self.refused('bad.h5', 'is damaged: its end is missing; if it was a model, train it again')

    def test_huge(self):
        """Sizes larger than the file."""

        def put(name, shape, kind):
            def change(f):
                del f[name]
                f.create_dataset(name, shape=shape, dtype=kind)  # never written: takes no space
            return change

        sizes = (('problem/V', (1 << 40, 8), 'f8'), ('problem/V', (50, 1 << 40), 'f8'),
                 ('mesh/xyz', (1 << 28, 3), 'f8'), ('mesh/xyz', (1 << 31, 3), 'f8'),
                 ('mesh/node_id', (1 << 40, 1), 'i4'), ('problem/scene', (1 << 33, 1), 'i1'),
                 ('training/points', (1 << 30, 2), 'f8'), ('bodies/A', (1 << 20, 1 << 20), 'f8'),
                 ('bodies/start', (1 << 40, 1), 'i4'), ('bodies/body_0/flexibility', (1 << 20, 1 << 20), 'f8'),
                 ('bodies/body_0/displacements', (1 << 28, 98), 'f8'), ('bodies/dof', (1 << 40, 1), 'i4'))
        for name, shape, kind in sizes:
            with self.subTest(name=name, shape=shape):
                self.refused(self.edited(put(name, shape, kind), 'b.h5' if 'bodies' in name else 'good.h5'), f'{name} is damaged')
        ROWS.add(f'sizes that are larger than the file ({len(sizes)}), in 2 GB of address space', "refused by the dataset's name")

    def test_bodies_values(self):
        """Numbers of a model of bodies that no training writes."""

        def put(name, at, value):
            def change(f):
                f['bodies/' + name][at] = value
            return change

        values = (('A', (0, 0), np.nan), ('body_0/flexibility', (0, 7), np.inf), ('body_0/R', (0, 0), np.nan), ('body_0/displacements', (0, 0), -np.inf), ('dof', (0, 0), 10**6),
                  ('at', (0, 0), -1), ('cell', (0, 0), 10**6), ('head', (0, 0), 0), ('start', (1, 0), 10**6))
        for name, at, value in values:
            with self.subTest(name=name, at=at, value=value):
                self.refused(self.edited(put(name, at, value), 'b.h5'), f'bad.h5: (bodies/({name}|head) (is damaged|contains)|the sizes of bodies/ are damaged|bodies/\\S+ is )')
        ROWS.add(f'invalid numbers in a model of bodies ({len(values)})', "refused by the dataset's name")

    def test_former_type(self):
        """A model of a type that is gone: one line with the type that replaces it and what to do."""

        def change(f):
            del f['problem/type']
            f['problem/type'] = np.frombuffer(b'condensed', 'i1').reshape(-1, 1)
        self.refused(self.edited(change), 'bad.h5: .*condensed, which models of bodies replace: train the scene again')

    def test_elsewhere(self):
        """A model with links to other files, or with filters, which HDF5 would load as code."""
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

        for make, text in ((lambda f, s: f.__setitem__('problem/V', h5py.ExternalLink(self.path('other.h5'), 'problem/V')), 'has no problem/V'),
                           (lambda f, s: f.create_dataset('problem/V', s, 'f8', external=[(self.path('numbers'), 0, s[0] * s[1] * 8)]), 'problem/V is damaged'),
                           (virtual, 'problem/V is damaged'),
                           (lambda f, s: f.create_dataset('problem/V', s, 'f8', chunks=s, compression='gzip'), 'problem/V is damaged')):
            self.refused(self.edited(replace(make)), text)
        ROWS.add('links to other files, external or virtual storage, filters', 'refused')

    def test_values(self):
        """Values that no training writes, in a file that is sound otherwise."""

        def put(name, at, value):
            def change(f):
                f[name][at] = value
            return change

        values = (('problem/V', (3, 0), np.nan, 'not finite'), ('mesh/cells', (0, 0), 10**6, 'outside'),
                                      ('mesh/cells', (0, 0), -1, 'outside'), ('problem/pairs/slave', (0, 0), 99999, 'outside'),
                                      ('problem/sizes', (2, 0), 9, 'problem/sizes is damaged'),
                                      ('problem/fe_dof', (1, 0), 0, 'fe_dof is damaged'), ('format', (0, 0), 99, 'has model format 99'),
                                      ('kind', (0, 0), 88, 'is not a hyco model'), ('mesh/head', (0, 0), 77, 'outside'),
                                      ('mesh/group_start', (1, 0), 10**6, 'damaged'),
                                      ('training/estimates', (3, 0), np.nan, 'training/estimates contains a value that is not finite'),
                                      ('training/estimates', (2, 0), 0, 'training/estimates is damaged'),
                                      ('training/estimates', (0, 0), 1e300, 'training/estimates is damaged'),
                                      ('training/estimates', (0, 0), 0, 'training/estimates is damaged'),
                                      ('training/estimates', (1, 0), -1, 'training/estimates is damaged'),
                                      ('training/held_out', (1, 0), -2, 'training/held_out is damaged'),
                                      ('training/held_out', (0, 0), 0, 'training/held_out is damaged'),
                                      ('table/counts', (1, 0), 16, 'table/counts is damaged|table/parameters is'),
                                      ('table/counts', slice(None), 16, 'table/counts is damaged'),
                                      ('table/parameters', (0, 0), np.nan, 'table/parameters contains a value that is not finite'),
                                      ('table/parameters', (1, 0), 0.05, 'table/parameters is damaged'),
                                      ('table/stiffness', (1, 7), np.inf, 'table/stiffness contains a value that is not finite'))
        for name, at, value, text in values:
            with self.subTest(name=name, at=at, value=value):
                self.refused(self.edited(put(name, at, value), 'held.h5' if name.startswith('training') else 'good.h5'), text)
        ROWS.add(f'invalid numbers in a hybrid model ({len(values)}): NaN, out of range, other format', 'refused')
        for old, new, text in ((b'\t', b' ', "the model's scene text is damaged"), (b'body_', b'bo y_', 'is not an entry of a scene')):
            def rewrite(f, old=old, new=new):
                text = f['problem/scene'][:]
                f['problem/scene'][...] = np.frombuffer(text.tobytes().replace(old, new), text.dtype).reshape(text.shape)
            self.refused(self.edited(rewrite), text)

        def pair(f):
            text = f['problem/scene'][:]
            del f['problem/scene']
            f['problem/scene'] = np.hstack([text, text])

        self.refused(self.edited(pair), 'problem/scene is .*, and .* was expected: the file is damaged')
        self.refused(self.edited(put('problem/sizes', (0, 0), 101)), 'the whole mesh is damaged', 'predict', '-output', 'w.xdmf')
        shutil.copy(os.path.join(DATA, 'rope-projection-4.h5'), self.path('p.h5'))
        self.refused(self.edited(put('problem/sizes', (4, 0), 9), 'p.h5'), 'problem/dual is damaged')

    def test_other_scene(self):
        """A model of one scene is not compared on another."""
        self.refused('good.h5', 'was trained on another scene', 'compare', '-scene', PELLET, '-grid', '2,2')

    def damaged(self, path, tries, draw, train):
        """Flipped bits and cuts of one file of the snapshot folder, in turn: each is refused by its name."""
        with open(path, 'rb') as f:
            good = f.read()
        try:
            for k in range(tries):
                bad = bytearray(good)
                if k % 2:
                    bad = bad[:draw.randrange(len(bad))]
                else:
                    bad[draw.randrange(len(bad))] ^= 1 << draw.randrange(8)
                with open(path, 'wb') as f:
                    f.write(bad)
                run = self.run_raw(*train, timeout=60)
                self.assertEqual(run.returncode, 1)
                self.assertIn(os.path.basename(path), run.stderr)
                self.assertIn('remove it and run again', run.stderr)
        finally:
            with open(path, 'wb') as f:
                f.write(good)

    def test_snapshots(self):
        """Each byte of a snapshot counts."""
        rope = ['train', '-scene', ROPE, '-grid', '4,4', '-grid_type', 'centred', '-model', 'good.h5']
        self.damaged(sorted(glob.glob(self.path('good.h5.snapshots', '*.h5')))[2], 16, random.Random(6), rope)
        ROWS.add('a snapshot (16): one bit flipped, or cut', 'refused by its name')

    def test_snapshots_of_other_sizes(self):
        """Sound files whose sizes do not go together: the same line on one rank and on two."""
        point = {}
        for path in glob.glob(self.path('good.h5.snapshots', '*.h5')):
            with h5py.File(path) as f:
                point[path] = tuple(f['mu'][:].ravel())
        first, second = sorted(point, key=point.get)[:2]  # only the first is read for its sizes

        def change(path, name, rows):
            with h5py.File(path, 'r+') as f:
                values = f[name][:]
                del f['sealed'], f[name]
                if rows:
                    f[name] = values[:rows]

        for path in (first, second):
            for name, rows, text in (('U', 99, 'U has .* rows, and other snapshots have'), ('U', 0, 'has no U'), ('lambda', 0, 'has no lambda')):
                with open(path, 'rb') as f:
                    good = f.read()
                change(path, name, rows)
                for ranks in (0, 2):
                    with self.subTest(path=path, name=name, ranks=ranks):
                        run = self.run_raw('train', '-scene', ROPE, '-grid', '4,4', '-grid_type', 'centred', '-model', 'good.h5', ranks=ranks, timeout=60)
                        self.assertEqual(run.returncode, 1)
                        self.assertRegex(run.stderr, text)
                        self.assertEqual(run.stderr.count('hyco: error'), 1, run.stderr)
                        self.assertNotIn('MPI_ABORT', run.stderr)  # the other rank received the error, and was not left waiting
                with open(path, 'wb') as f:
                    f.write(good)
        ROWS.add('snapshots with inconsistent sizes (6), on 1 and 2 ranks', 'refused by their names')

    def test_snapshots_of_another(self):
        """Solutions of other materials in the folder."""
        run = self.run_raw('train', '-scene', ROPE, '-grid', '4,4', '-grid_type', 'centred', '-body_rope_young', '2*mu1+x', '-model', 'o.h5', '-hyco_snapshots', 'good.h5.snapshots')
        self.assertEqual(run.returncode, 1)
        self.assertIn('another scene', run.stderr)
        ROWS.add('snapshots of another scene in the folder; a model of another', 'refused')

    @unittest.skipUnless(shutil.which('strace'), 'there is no strace (scripts/setup test)')
    def test_writes_only_what_is_named(self):
        """Every file that a run opens for writing is one that the user named, or Open MPI's own in TMPDIR."""
        os.makedirs(self.path('home'), exist_ok=True)
        os.makedirs(self.path('tmp'), exist_ok=True)
        environment = dict(os.environ, HOME=self.path('home'), TMPDIR=self.path('tmp'))
        if SANITIZED:
            environment['ASAN_OPTIONS'] += ':detect_leaks=0'  # which needs ptrace, as strace does
        named = ('w.h5', 'w.xdmf', 'w_.h5', 'w.json', 'w.csv')
        for arguments in (['train', '-scene', ROPE, '-grid', '3,3', '-model', 'w.h5', '-report', 'w.json'],
                          ['predict', '-model', 'w.h5', '-mu', '0.1,0.1', '-output', 'w_.xdmf', '-report', 'w.json'],
                          ['solve', '-scene', PELLET, '-mu', '4.06,1', '-output', 'w_.xdmf'],
                          ['compare', '-scene', ROPE, '-model', 'w.h5', '-grid', '2,2', '-table', 'w.csv']):
            run = subprocess.run(['strace', '-f', '-qq', '-s', '300', '-e', 'trace=open,openat,creat,mkdir,mkdirat,rename,renameat,'
                                  'renameat2,link,symlink,execve', '-o', 'trace', HYCO, *settled(arguments)], cwd=self.folder,
                                 env=environment, capture_output=True, text=True, timeout=100 * PATIENCE)
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
                    if place.startswith((self.path('tmp'), '/dev/', '/proc/', '/sys/')):
                        continue
                    name = re.sub(r'(\.hyco-[0-9a-f]{8}-\d+-\d+\.(partial|candidate))+(\.(candidate|fold))?', '', os.path.relpath(place, self.folder))
                    self.assertTrue(name in named or name == 'w_.xdmf' or name.startswith('w.h5.snapshots'), line)
        self.assertEqual(os.listdir(self.path('home')), [])
        os.remove(self.path('trace'))
        ROWS.add('files written outside the paths that the user named, by strace of train, predict, solve, compare', "none, but for FLTK's (below)")


if __name__ == '__main__':
    unittest.main()
