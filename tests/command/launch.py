"""How ranks are started: a launcher of another MPI is refused; no library of gmsh's is loaded."""
import os
import re
import subprocess
import tempfile
import unittest

from common import HYCO, PATIENCE, ROPE, SOURCE, Case, said

MODEL = os.path.join(SOURCE, 'tests', 'data', 'rope-hybrid-4-table.h5')
MU = ('-mu', '0.07,0.17')


class Launch(Case):
    def start(self, *args, **environment):
        return subprocess.run([HYCO, *args], cwd=self.folder, env={**os.environ, **environment}, capture_output=True, text=True, timeout=60 * PATIENCE)

    def test_another_mpi(self):
        """Each of its processes would be alone and write the same files."""
        for name, value in (('PMI_SIZE', '2'), ('PMIX_RANK', '1'), ('SLURM_STEP_NUM_TASKS', '4'), ('OMPI_COMM_WORLD_SIZE', '3')):
            with self.subTest(name=name):
                run = self.start('predict', '-model', MODEL, *MU, '-report', 'r.json', **{name: value})
                lines = said(run)
                self.assertEqual((run.returncode, len(lines)), (1, 1), run.stderr)
                self.assertIn(name, lines[0])
                self.assertEqual(os.listdir(self.folder), [])

    def test_one_rank(self):
        """A job of several ranks may start hyco on one: in a batch script of Slurm only SLURM_NTASKS gives the number."""
        for name, value in (('PMI_SIZE', '1'), ('SLURM_NTASKS', '8'), ('SLURM_STEP_NUM_TASKS', '1')):
            with self.subTest(name=name):
                self.assertEqual(self.start('view', '-model', MODEL, **{name: value}).returncode, 0)

    @unittest.skipUnless(hasattr(os, 'O_DIRECT'), 'needs pipes that keep what is written in one piece apart')
    def test_one_piece(self):
        """A line of stderr, however long, is written in one piece: of pieces, launchers lose some and ranks mix them up."""
        reading, writing = os.pipe2(os.O_DIRECT)
        run = subprocess.run([HYCO, 'view', '-model', 'a' * 200 + '.h5'], cwd=self.folder, stdout=subprocess.DEVNULL, stderr=writing, timeout=60 * PATIENCE)
        os.close(writing)
        line = os.read(reading, 65536).decode()
        os.close(reading)
        self.assertEqual(run.returncode, 1)
        self.assertTrue(line.startswith('hyco: error: ') and line.endswith('\n'), line)
        self.assertGreater(len(line), 200)

    COMMANDS = (('view', '-model', MODEL), ('predict', '-model', MODEL, *MU), ('solve', '-scene', ROPE, *MU))

    def noise(self, *before, command=COMMANDS[0], **environment):
        """What one rank says on stderr, numbers apart; a variable that is None is not set."""
        environment = {name: value for name, value in {**os.environ, 'HWLOC_HIDE_ERRORS': None, **environment}.items() if value is not None}
        run = subprocess.run([*before, HYCO, *command], cwd=self.folder, env=environment, capture_output=True, text=True, timeout=60 * PATIENCE)
        self.assertEqual(run.returncode, 0, run.stderr)
        return {re.sub(r'\d+', '0', line) for line in run.stderr.splitlines()}

    def kernels(self, command, **environment):
        """The kernels that OpenBLAS reports, one line for each choice."""
        return re.findall(r'(?m)^Core: (\S+)', self.start(*command, OPENBLAS_VERBOSE='2', **environment).stderr)

    def test_young_processor(self):
        """An OpenBLAS older than the processor uses its oldest kernels; solve and train then select those that the processor supports."""
        predict, solve = self.kernels(self.COMMANDS[1]), self.kernels(self.COMMANDS[2])
        if predict != ['Prescott']:
            self.assertEqual(solve, predict)
            self.skipTest(f'the kernels that OpenBLAS takes here are {predict}')
        with open('/proc/cpuinfo', encoding='utf-8') as file:
            flags = set(re.search(r'(?m)^flags\s*:(.*)', file.read()).group(1).split())
        best = 'SkylakeX' if {'avx512f', 'avx512dq', 'avx512bw', 'avx512vl', 'avx512cd'} <= flags else 'Haswell' if {'avx2', 'fma'} <= flags else None
        self.assertEqual(solve, ['Prescott', best] if best else ['Prescott'])
        self.assertEqual(self.kernels(self.COMMANDS[2], OPENBLAS_CORETYPE='Prescott'), ['Prescott'])

    def test_temporary_folder(self):
        """No folder for temporary files, or an unusable one: Open MPI 5 needs one, crashes without it, and creates a missing one."""
        usual = self.noise()
        gone, shut, file = (self.path(name) for name in ('gone', 'shut', 'file'))
        os.mkdir(shut, 0o500)
        with open(file, 'w', encoding='ascii'):
            pass
        for folder in (None, '', gone, os.path.join(gone, 'deep'), shut, file, 'x' * 5000):
            for command in self.COMMANDS if folder == file else self.COMMANDS[:1]:
                with self.subTest(folder=folder and folder[:80], command=command[0]):
                    self.assertLessEqual(self.noise(command=command, TMPDIR=folder), usual)
        self.assertFalse(os.path.exists(gone))

    def test_bare_machine(self):
        """Without a network, with little shared memory, without a folder for temporary files: one rank prints only its own output."""
        alone = ('unshare', '--map-root-user', '--mount', '--net')
        if subprocess.run([*alone, 'mount', '-t', 'tmpfs', 'tmpfs', '/dev/shm'], capture_output=True, check=False).returncode:
            self.skipTest('no right to unshare')
        usual = self.noise()
        for state in ('true', 'mount -t tmpfs -o size=64k tmpfs /dev/shm', 'mount -t tmpfs -o ro tmpfs /dev/shm',
                      'mount -t tmpfs -o nr_inodes=1 tmpfs "$TMPDIR"'):
            with self.subTest(state=state), tempfile.TemporaryDirectory() as folder:
                self.assertLessEqual(self.noise(*alone, 'sh', '-c', f'{state} && exec "$@"', 'sh', TMPDIR=folder), usual)

    def loaded(self, *args):
        """The libraries that a run has loaded."""
        run = self.start(*args, LD_DEBUG='files')
        self.assertEqual(run.returncode, 0)
        return {line.split('calling init:')[1].strip() for line in run.stderr.splitlines() if 'calling init:' in line}

    @unittest.skipIf(os.environ.get('HYCO_SANITIZE') == '1', 'sanitizers come first')
    def test_gmsh(self):
        """hyco reads meshes itself: libgmsh would bring OpenCASCADE and FLTK, a hundred libraries."""
        names = self.loaded('solve', '-scene', ROPE, *MU)
        self.assertTrue(names)
        self.assertEqual([name for name in names if re.search('libgmsh|libTKernel|libfltk', name)], [])

    @unittest.skipIf(os.environ.get('HYCO_SANITIZE') == '1', 'sanitizers come first')
    def test_one_blas(self):
        """PETSc's, and no second one."""
        names = {os.path.basename(name).split('.so')[0] for name in self.loaded('view', '-model', MODEL)}
        self.assertLessEqual(len(names & {'libopenblas', 'libmkl_rt', 'libflexiblas', 'libblis'}), 1)
        paths = {name for name in self.loaded('view', '-model', MODEL) if 'openblas' in os.path.basename(name)}
        self.assertLessEqual(len(paths), 1)


if __name__ == '__main__':
    unittest.main()
