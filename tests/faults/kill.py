"""Training that is killed at seeded moments, and full disks: the same command continues, and the model is the same."""
import glob
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import time
import unittest

from common import HYCO, MPIRUN, PATIENCE, ROPE, SOURCE, Case, settled
from rows import Rows

TRAIN = ['train', '-scene', ROPE, '-grid', '12,12', '-model', 'm.h5']
PATHS = ['train', '-scene', os.path.join(SOURCE, 'examples', 'rod'), '-grid', '2,2,1', '-hyco_pod_tol', '1e-9', '-hyco_rid_layers', '1',
         '-hyco_rid_contact_extension', '1', '-model', 'm.h5']
BODIES = ['train', '-scene', os.path.join(SOURCE, 'examples', 'blocks'), '-hyco_model_type', 'bodies', '-scatter', '2', '-model', 'm.h5',
          '-hyco_bodies_samples', '10']
KILLS = {'hybrid': 5, 'hybrid with a history': 3}
ROWS = Rows('kill')


def children(pid, states='RSDTtIXxZ'):
    """The processes that `pid` started and that are in one of these states."""
    found = []
    for stat in glob.glob('/proc/[0-9]*/stat'):
        try:
            with open(stat, encoding='ascii', errors='replace') as f:
                text = f.read()
        except OSError:
            continue
        state, parent = text.rsplit(')', 1)[1].split()[:2]
        if int(parent) == pid and state in states:
            found.append(int(text.split()[0]))
    return found


def wait(run):
    """Waits for a launcher whose rank was killed. Open MPI's may miss the death of one that it has just started, and hang with dead ranks: it is
    then ended. Live ranks must end by themselves."""
    for _ in range(3 * PATIENCE):
        try:
            return run.wait(20)
        except subprocess.TimeoutExpired:
            if not children(run.pid, 'RSDTtI'):
                run.kill()
    raise AssertionError('ranks go on after one was killed')


class Kill(Case):
    def setUp(self):
        for name in os.listdir(self.folder):
            path = self.path(name)
            shutil.rmtree(path) if os.path.isdir(path) else os.remove(path)

    def command(self, ranks, train):
        return ([*MPIRUN, str(ranks)] if ranks > 1 else []) + [HYCO, *settled(train)]

    def content(self, name='m.h5'):
        with open(self.path(name), 'rb') as f:
            return f.read()

    def interrupt(self, command, ranks, seconds, draw):
        """Kills one rank after `seconds`; returns its output, and whether it had ended by itself."""
        log = self.path('log')
        with open(log, 'wb') as out:
            run = subprocess.Popen(command, cwd=self.folder, stdout=out, stderr=out)
            try:
                run.wait(seconds)
            except subprocess.TimeoutExpired:
                victims = children(run.pid) if ranks > 1 else [run.pid]
                victim = draw.choice(victims) if victims else run.pid
                try:
                    os.kill(victim, signal.SIGKILL)
                except ProcessLookupError:
                    pass
            status = wait(run)
        with open(log, encoding='utf-8', errors='replace') as f:
            said = f.read()
        os.remove(log)
        return said, status == 0

    def check_kills(self, ranks, kind='hybrid', train=TRAIN):
        command, kills = self.command(ranks, train), KILLS[kind]
        begin = time.monotonic()
        subprocess.run(command, cwd=self.folder, check=True, capture_output=True, timeout=100 * PATIENCE)
        whole = time.monotonic() - begin
        right = self.content()
        names = {os.path.basename(f) for f in glob.glob(self.path('m.h5.snapshots', '*.h5'))}
        draw = random.Random(6 + ranks)
        interrupted = k = 0
        while k < kills or (interrupted < kills // 2 and k < 5 * kills):  # the machine may have had less to do than in the first run
            self.setUp()
            begin = time.monotonic()
            said, ended = self.interrupt(command, ranks, whole * (0.15 + 0.75 * (k % kills + draw.random()) / kills), draw)
            interrupted += not ended
            whole = time.monotonic() - begin if ended else whole
            k += 1
            complete = glob.glob(self.path('m.h5.snapshots', '*.h5'))
            told = max((int(n) for n in re.findall(r'(?:snapshots|held-out solutions): (\d+) of', said)), default=0)
            self.assertGreaterEqual(len(complete), told, 'a solution that was told is lost')
            times = {f: os.stat(f).st_mtime_ns for f in complete}
            subprocess.run(command, cwd=self.folder, check=True, capture_output=True, timeout=100 * PATIENCE)
            for name, stamp in times.items():
                self.assertEqual(os.stat(name).st_mtime_ns, stamp, 'a complete solution was solved again')
            self.assertEqual({os.path.basename(f) for f in glob.glob(self.path('m.h5.snapshots', '*.h5'))}, names)
            self.assertEqual([f for f in glob.glob(self.path('**'), recursive=True) if 'partial' in f or 'candidate' in f], [])
            self.assertEqual(self.content(), right, f'the model differs after kill {k} on {ranks} ranks')
        self.assertGreaterEqual(interrupted, kills // 2, 'the kills came too late to say anything')
        ROWS.add(f'`kill -9` of a rank during `train`, {kind} model, {ranks} rank{"s" if ranks > 1 else ""}: {kills} seeded moments',
                 f'{len(names)} files of solutions; {interrupted} runs were killed; the same command continues, solves only what '
                 'was incomplete, and writes the same model, byte for byte')

    def test_one_rank(self):
        """Kills on one process: the next run continues to the same model."""
        self.check_kills(1)

    def test_two_ranks(self):
        """A solution does not depend on how many others are missing: a single one is solved by as many ranks."""
        self.check_kills(2)
        right = self.content()
        os.remove(glob.glob(self.path('m.h5.snapshots', '*.h5'))[0])
        subprocess.run(self.command(2, TRAIN), cwd=self.folder, check=True, capture_output=True, timeout=100 * PATIENCE)
        self.assertEqual(self.content(), right)

    def test_paths(self):
        """A path in progress is solved again, those before it are not."""
        self.check_kills(1, 'hybrid with a history', PATHS)

    def pieces(self):
        folder = self.path('m.h5.snapshots')
        return [f for f in (os.listdir(folder) if os.path.isdir(folder) else ()) if f.startswith('bodies-') and f.endswith('.h5')]

    def watch(self, ranks=1, most=10**9):
        """Runs a training of bodies; kills one rank when so many pieces are finished. Returns their largest number."""
        seen = 0
        with open(self.path('log'), 'wb') as out:
            run = subprocess.Popen(self.command(ranks, BODIES), cwd=self.folder, stdout=out, stderr=out)
            while run.poll() is None and seen < most:
                seen = max(seen, len(self.pieces()))
                time.sleep(0.002)
            if run.poll() is None:
                os.kill(children(run.pid)[-1] if ranks > 1 else run.pid, signal.SIGKILL)
            status = wait(run)
        self.assertEqual(status != 0, seen >= most, f'{seen} pieces, and {most} asked for')
        return seen

    def resumed(self, ranks, most):
        """The model after the same command once more, which finds what was finished: it makes so few factors."""
        report = self.hyco(*BODIES, ranks=ranks)
        self.assertLessEqual(report['n_body_factors'], most)
        self.assertEqual(self.pieces(), [])
        return self.content()

    def test_bodies(self):
        """Samples, displacements and coefficients of bodies that a killed training has finished are not computed again; those of another scene are
        refused; none remain beside the model."""
        n = self.watch()
        right, forces = self.content(), self.hyco('predict', '-model', 'm.h5', '-mu', '0.05,0.06')['total_contact_force']
        os.remove(self.path('m.h5'))
        for kill in (n // 3, n - 1):
            self.watch(1, kill)
        os.mkdir(self.path('other'))
        shutil.copy(self.path('m.h5.snapshots', self.pieces()[0]), self.path('other'))
        scene = BODIES[2]
        with open(os.path.join(scene, 'scene.yaml'), encoding='ascii') as f:
            other = self.changed('other.yaml', f.read(), [('mesh: blocks.msh', f'mesh: {scene}/blocks.msh'), ('poisson: 0.3', 'poisson: 0.31')])
        refused = self.run_raw(*BODIES[:2], other, *BODIES[3:], '-hyco_snapshots', 'other')
        self.assertEqual((refused.returncode, refused.stderr.count('hyco: error')), (1, 1), refused.stderr)
        self.assertIn('another scene or mesh; remove the folder', refused.stderr)
        self.assertEqual(self.resumed(1, 2), right)
        self.watch(2, n - 1)  # the factors of two ranks differ by round-off from run to run
        self.resumed(2, 2)
        self.near(self.hyco('predict', '-model', 'm.h5', '-mu', '0.05,0.06')['total_contact_force'], forces, 1e-9)
        ROWS.add('`kill -9` of a rank during `train`, model of bodies: twice on 1 rank, once on 2',
                 'the same command continues after the finished samples, displacements and coefficients; on one rank the same model, byte for byte')

    def limited(self, kilobytes, train=TRAIN, ranks=1, alone=0):
        """A run in which, once it solves, no file can grow beyond a size, which emulates a full disk. `alone`: that rank only, or all."""
        run = subprocess.Popen(self.command(ranks, train), cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        before = len(glob.glob(self.path('m.h5.snapshots', '*.h5')))
        while run.poll() is None and len(glob.glob(self.path('m.h5.snapshots', '*.h5'))) == before:
            time.sleep(0.001)
        for process in children(run.pid)[-alone:] if ranks > 1 else [run.pid]:
            resource.prlimit(process, resource.RLIMIT_FSIZE, (kilobytes * 1024, kilobytes * 1024))
        _, said = run.communicate(timeout=100 * PATIENCE)
        return run.returncode, said

    def refused(self, run, text):
        status, stderr = run
        self.assertEqual(status, 1, stderr)
        said = [line for line in stderr.splitlines() if line.startswith('hyco: error')]
        self.assertEqual(len(said), 1, stderr)
        self.assertNotIn('MPI_ABORT', stderr)
        self.assertIn(text, said[0])
        self.assertEqual([f for f in glob.glob(self.path('**'), recursive=True) if 'partial' in f or 'candidate' in f], [])

    def test_full_disk(self):
        """The disk is full while a snapshot is written, and while the model is: the previous model is untouched; the next run continues."""
        subprocess.run([HYCO, *settled(TRAIN)], cwd=self.folder, check=True, capture_output=True, timeout=100 * PATIENCE)
        right = self.content()
        for name in glob.glob(self.path('m.h5.snapshots', '*.h5'))[::2]:
            os.remove(name)
        self.refused(self.limited(32), 'm.h5 could not be written completely (File too large); check the free space')
        self.assertEqual(self.content(), right, 'the previous model was touched')
        shutil.rmtree(self.path('m.h5.snapshots'))
        self.refused(self.limited(4), '.h5 could not be written completely (File too large); check the free space')
        self.assertEqual(self.content(), right, 'the previous model was touched')
        subprocess.run([HYCO, *settled(TRAIN)], cwd=self.folder, check=True, capture_output=True, timeout=100 * PATIENCE)
        self.assertEqual(self.content(), right)
        ROWS.add('disk full while a snapshot or the model is written', 'one line; the old model is untouched, no file is half-written; the next run continues')

    def full(self, kilobytes, *args):
        """A run in which no file can grow beyond a size once it reads its options: from a pipe, which waits until the limit is set."""
        run = subprocess.Popen([HYCO, *settled(args), '-options_file', 'pipe'], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                               text=True)
        while run.poll() is None:
            try:
                pipe = os.open(self.path('pipe'), os.O_WRONLY | os.O_NONBLOCK)
            except OSError:  # nobody reads
                time.sleep(0.005)
                continue
            resource.prlimit(run.pid, resource.RLIMIT_FSIZE, (int(kilobytes * 1024),) * 2)
            os.write(pipe, b'# no options\n')
            os.close(pipe)
            time.sleep(0.02)
        return run.returncode, run.communicate(timeout=60 * PATIENCE)[1]

    def test_full_disk_outputs(self):
        """The disk is full while the fields, the report or the table is written: an older file is unchanged, or there is none."""
        os.mkfifo(self.path('pipe'))
        self.hyco('train', '-scene', ROPE, '-grid', '3,3', '-model', 'm.h5')
        point, many = ['-mu', '0.07,0.17'], ['-grid', '10,10']
        solve, predict = ['solve', '-scene', ROPE], ['predict', '-model', 'm.h5']
        # the .xdmf has 1.8 kB and its .h5 more than 6, the report 1.2 kB, the table of 100 points 11 kB
        tries = [(size, command + point + ['-output', 'o.xdmf'], 'o.xdmf') for command in (solve, predict) for size in (0, 0.5, 4)]
        tries += [(size, command + point + ['-report', 'o.json'], 'o.json') for command in (solve, predict) for size in (0, 0.5)]
        tries += [(size, command + many + ['-table', 'o.csv'], 'o.csv') for command in (solve, predict) for size in (0, 5)]
        for old in (False, True):
            for size, args, name in tries:
                with self.subTest(args=' '.join(args), size=size, old=old):
                    before = {}
                    if old:
                        subprocess.run([HYCO, *settled(args)], cwd=self.folder, check=True, capture_output=True, timeout=60 * PATIENCE)
                        before = {f: self.content(f) for f in os.listdir(self.folder) if f.startswith('o.')}
                        self.assertTrue(before)
                    self.refused(self.full(size, *args), 'o.h5 ' if size == 4 else f'{name} ')
                    self.assertEqual({f: self.content(f) for f in os.listdir(self.folder) if f.startswith('o.')}, before)
        ROWS.add(f'disk full while -output, -report or -table is written ({2 * len(tries)}), with an older file there and without',
                 'one line; the older file is untouched, no file is half-written')

    def test_folders_in_the_way(self):
        """Folders that have the names of outputs or of their .h5, on 1 and 2 ranks."""
        for name in ('a.xdmf', 'b.h5', 'c.json', 'd.csv'):
            os.mkdir(self.path(name))
        self.hyco('train', '-scene', ROPE, '-grid', '3,3', '-model', 'm.h5')
        point, many = ['-mu', '0.07,0.17'], ['-grid', '2,2']
        tries = [command + rest for command in (['solve', '-scene', ROPE], ['predict', '-model', 'm.h5'])
                 for rest in (point + ['-output', 'a.xdmf'], point + ['-output', 'b.xdmf'], point + ['-report', 'c.json'], many + ['-table', 'd.csv'])]
        for args in tries:
            for ranks in (0, 2):
                with self.subTest(args=' '.join(args), ranks=ranks):
                    run = self.run_raw(*args, ranks=ranks, timeout=60)
                    self.assertEqual(run.returncode, 1)
                    self.assertIn(f'{args[-1]} ', run.stderr)
                    self.assertEqual(run.stderr.count('hyco: error'), 1, run.stderr)
                    self.assertNotIn('MPI_ABORT', run.stderr)  # the other rank received the error, and was not left waiting
                    self.assertEqual({f for f in os.listdir(self.folder) if f[1] == '.' and f[0] != 'm'}, {'a.xdmf', 'b.h5', 'c.json', 'd.csv'})
        ROWS.add(f'a folder at the path of an output or of its .h5 ({len(tries)}), on 1 and 2 ranks', 'one line, no file is half-written')

    def test_unwritable(self):
        """A path that leads through a file (root may write in any folder): refused before any work."""
        with open(self.path('file'), 'w', encoding='ascii') as f:
            f.write('x')
        os.mkdir(self.path('folder.h5'))
        for arguments, text in ((['-model', 'file/m.h5'], 'file/m.h5 cannot be written'),
                                (['-model', 'folder.h5'], 'folder.h5'),
                                (['-hyco_snapshots', 'file'], 'the snapshot folder file cannot be created'),
                                (['-hyco_snapshots', 'file/s'], 'the snapshot folder file/s cannot be created'),
                                (['-report', 'file/r.json'], 'file/r.json cannot be written')):
            for ranks in (0, 2):
                run = self.run_raw(*TRAIN, *arguments, ranks=ranks, timeout=60)
                self.assertNotEqual(run.returncode, 0)
                self.assertIn(text, run.stderr)
                self.assertEqual(run.stderr.count('hyco: error'), 1, run.stderr)
                self.assertNotIn('MPI_ABORT', run.stderr)
                self.assertEqual([f for f in glob.glob(self.path('**'), recursive=True) if 'partial' in f or 'candidate' in f], [])
        ROWS.add('a path through a file, a folder at the path of the model, on 1 and 2 ranks', 'one line')

    def test_vanishing(self):
        """The snapshot folder is removed while training runs: one line, no model."""
        arguments = [a if a != '12,12' else '40,40' for a in TRAIN]
        run = subprocess.Popen([HYCO, *settled(arguments)], cwd=self.folder, stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)
        while run.poll() is None and len(glob.glob(self.path('m.h5.snapshots', '*.h5'))) < 5:
            time.sleep(0.01)
        os.rename(self.path('m.h5.snapshots'), self.path('gone'))
        _, said = run.communicate(timeout=60 * PATIENCE)
        self.assertEqual(run.returncode, 1, said)
        self.assertEqual(said.count('hyco: error'), 1, said)
        self.assertIn('m.h5.snapshots/', said)
        self.assertFalse(os.path.exists(self.path('m.h5')))
        ROWS.add('a snapshot folder that disappears', 'one line, no model')


if __name__ == '__main__':
    unittest.main()
