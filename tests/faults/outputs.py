"""Outputs: devices and pipes are kept, links are followed, and no input is overwritten, whatever its name."""
import json
import os
import shutil
import stat
import subprocess
import threading
import unittest

from common import HYCO, PATIENCE, ROPE, Case

POINT = ('-mu', '0.07,0.17')


class Outputs(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.hyco('train', '-scene', ROPE, '-grid', '3,3', '-model', 'model.h5')
        shutil.copytree(ROPE, cls.path('rope'))

    def setUp(self):
        self.before = self.content()

    def content(self):
        found = {}
        for folder, _, names in os.walk(self.folder):
            for name in names:
                path = os.path.join(folder, name)
                if stat.S_ISREG(os.lstat(path).st_mode):
                    with open(path, 'rb') as f:
                        found[path] = f.read()
        return found

    def node(self, name, minor):
        """A character device of its own: 3 is null, 7 is full."""
        try:
            os.mknod(self.path(name), 0o666 | stat.S_IFCHR, os.makedev(1, minor))
            with open(self.path(name), 'wb', buffering=0) as f:
                try:
                    f.write(b'x')
                except OSError as error:
                    if minor == 3:
                        raise error
        except OSError:
            self.skipTest('no device can be made here')
        self.addCleanup(os.remove, self.path(name))
        return name

    def predict(self, *options, **more):
        return self.run_raw('predict', '-model', 'model.h5', *POINT, *options, **more)

    def refused(self, run, *words):
        self.assertEqual(run.returncode, 1, run.stdout)
        said = [line for line in run.stderr.splitlines() if line.startswith('hyco: error')]
        self.assertEqual(len(said), 1, run.stderr)
        for word in words:
            self.assertIn(word, said[0])
        self.assertEqual(self.content(), self.before)

    def test_device(self):
        """A report and a table may be written to a device, which stays one."""
        device = self.node('null', 3)
        for command in (('predict', '-model', 'model.h5'), ('solve', '-scene', ROPE)):
            for ranks in (0, 2):
                run = self.run_raw(*command, *POINT, '-report', device, ranks=ranks)
                self.assertEqual(run.returncode, 0, run.stderr)
                run = self.run_raw(*command, '-grid', '2,2', '-report', device, '-table', device, ranks=ranks)
                self.assertEqual(run.returncode, 0, run.stderr)
        self.assertTrue(stat.S_ISCHR(os.stat(self.path(device)).st_mode), 'the device is a file now')
        self.assertEqual(self.content(), self.before)
        self.refused(self.run_raw('train', '-scene', ROPE, '-grid', '2,2', '-model', device), 'null is a device or a pipe', 'HDF5')
        os.rename(self.path(device), self.path('o.h5'))
        self.addCleanup(os.rename, self.path('o.h5'), self.path(device))
        self.refused(self.predict('-output', 'o.xdmf'), 'o.h5 is not a file')

    def test_full_device(self):
        """A full device: the system's own words, and the device stays one."""
        device = self.node('full', 7)
        self.refused(self.predict('-report', device), 'full could not be written completely (No space left on device)')
        self.assertTrue(stat.S_ISCHR(os.stat(self.path(device)).st_mode))

    def test_pipe(self):
        """A report may be written to a named pipe."""
        os.mkfifo(self.path('pipe'))
        self.addCleanup(os.remove, self.path('pipe'))
        said = []

        def read():
            with open(self.path('pipe'), encoding='utf-8') as f:
                said.append(f.read())

        reader = threading.Thread(target=read)
        reader.start()
        run = self.predict('-report', 'pipe')
        reader.join(60)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertEqual(json.loads(said[0])['command'], 'predict')
        self.assertTrue(stat.S_ISFIFO(os.stat(self.path('pipe')).st_mode))

    def test_standard_output(self):
        """To a pipe, and to a file, where earlier text is kept."""
        run = self.predict('-report', '/dev/stdout')
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertIn('"command":', run.stdout)
        with open(self.path('out'), 'w', encoding='utf-8') as out:
            self.addCleanup(os.remove, self.path('out'))
            subprocess.run([HYCO, 'predict', '-model', 'model.h5', *POINT, '-report', '/dev/stdout'], cwd=self.folder, stdout=out,
                           check=True, timeout=100 * PATIENCE)
        with open(self.path('out'), encoding='utf-8') as out:
            text = out.read()
        self.assertIn('KKT residuals', text)
        self.assertIn('"command":', text)

    def test_links(self):
        """The target of a link is written, whether it exists or not; the link is kept."""
        os.mkdir(self.path('there'))
        self.addCleanup(shutil.rmtree, self.path('there'))
        os.symlink('there/r.json', self.path('link.json'))
        self.addCleanup(os.remove, self.path('link.json'))
        os.symlink('there/m.h5', self.path('link.h5'))
        self.addCleanup(os.remove, self.path('link.h5'))
        for _ in range(2):
            self.assertEqual(self.predict('-report', 'link.json').returncode, 0)
            run = self.run_raw('train', '-scene', ROPE, '-grid', '2,2', '-model', 'link.h5', '-hyco_snapshots', 'there/s')
            self.assertEqual(run.returncode, 0, run.stderr)
            self.assertTrue(os.path.islink(self.path('link.json')) and os.path.islink(self.path('link.h5')))
            self.assertEqual(sorted(os.listdir(self.path('there'))), ['m.h5', 'r.json', 's'])

    def test_inputs(self):
        """An output that is an input, by another spelling, a link, a hard link, another way to its folder."""
        os.link(self.path('model.h5'), self.path('hard.h5'))
        os.symlink('model.h5', self.path('soft.h5'))
        os.symlink('.', self.path('here'))
        for name in ('hard.h5', 'soft.h5', 'here'):
            self.addCleanup(os.remove, self.path(name))
        self.before = self.content()
        one = 'are the same file'
        for name in ('./model.h5', self.path('model.h5'), 'hard.h5', 'soft.h5', 'here/model.h5', 'rope/../model.h5'):
            self.refused(self.predict('-report', name), '-report', one)
        self.refused(self.run_raw('predict', '-model', 'model.h5', '-grid', '2,2', '-table', 'here/model.h5'), '-table', one)
        scene = ('-scene', 'rope')
        for command in (('solve', *scene, *POINT), ('train', *scene, '-grid', '2,2', '-model', 'new.h5'),
                        ('compare', *scene, '-model', 'model.h5', *POINT),
                        ('predict', *scene, '-model', 'model.h5', '-hyco_fallback', *POINT)):
            self.refused(self.run_raw(*command, '-report', 'rope/scene.yaml', ranks=2), '-scene', 'rope/scene.yaml')
            self.refused(self.run_raw(*command, '-report', 'here/rope/rope.msh'), 'the mesh', one)
        with open(self.path('points.csv'), 'w', encoding='ascii') as f:
            f.write('mu1,mu2\n0.07,0.17\n')
        with open(self.path('options'), 'w', encoding='ascii') as f:
            f.write('-hyco_solver_rtol 1e-8\n')
        for name in ('points.csv', 'options'):
            self.addCleanup(os.remove, self.path(name))
        self.before = self.content()
        self.refused(self.run_raw('solve', *scene, '-points', 'points.csv', '-table', './points.csv'), '-points', one)
        self.refused(self.predict('-options_file', 'options', '-report', './options'), '-options_file', one)

    def test_each_other(self):
        """Two outputs with one file are refused, whatever the spelling of its path."""
        for options, words in ((('-output', 'o.xdmf', '-report', 'o.h5'), ('the .h5 file of -output', 'o.h5')),
                               (('-output', 'o.xdmf', '-report', './o.xdmf'), ('-output', 'are the same file'))):
            self.refused(self.predict(*options), *words)
        train = ('train', '-scene', ROPE, '-grid', '2,2', '-model', 'new.h5')
        self.refused(self.run_raw(*train, '-report', 'rope/../new.h5'), '-model', 'are the same file')
        self.refused(self.run_raw(*train, '-report', 'new.h5.snapshots'), 'the snapshot folder')
        self.refused(self.run_raw('solve', '-scene', ROPE, '-grid', '2,2', '-table', 't', '-report', './t'), 'are the same file')

    def test_models_stay(self):
        """A report or a table does not overwrite a model or a solution."""
        solution = next(n for n in os.listdir(self.path('model.h5.snapshots')))
        for name in ('model.h5', f'model.h5.snapshots/{solution}'):
            self.refused(self.run_raw('solve', '-scene', ROPE, *POINT, '-report', name), 'is a model or a snapshot')


if __name__ == '__main__':
    unittest.main()
