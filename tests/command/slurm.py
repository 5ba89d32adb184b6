"""scripts/hyco.sbatch: in a plain shell and under a Slurm emulated by two scripts; interrupted, it continues where it was."""
import glob
import json
import os
import shlex
import signal
import subprocess
import time
import unittest

from common import MPIRUN, PATIENCE, PELLET, ROPE, SOURCE, Case, settled

SCRIPT = os.path.join(SOURCE, 'scripts', 'hyco.sbatch')
LONG = ('-scene', PELLET, '-values_radius', '4.02,4.03,4.04,4.05,4.07,4.08,4.09,4.1', '-values_load', '0.2,0.4,0.6,0.8,1')
N_LONG = 40
# srun without Slurm: records its arguments, drops its options, runs the rest on as many ranks
SRUN = f'''#!/bin/sh
echo "$*" >>"$NOTES/srun"
while :; do
  case $1 in
    --ntasks=*) n=${{1#--ntasks=}}; shift ;;
    --*) shift ;;
    *) break ;;
  esac
done
unset $(env | cut -d= -f1 | grep ^SLURM_) # Open MPI would ask Slurm
exec {shlex.join(MPIRUN)} "$n" "$@"
'''
SCONTROL = '#!/bin/sh\necho "$*" >>"$NOTES/scontrol"\n'


class Slurm(Case):
    def setUp(self):
        self.bin, self.notes = self.path(self.id(), 'bin'), self.path(self.id(), 'notes')
        for folder in (self.bin, self.notes):
            os.makedirs(folder)
        self.tool('srun', SRUN)
        self.tool('scontrol', SCONTROL)
        self.model = self.path(self.id(), 'm.h5')

    def tool(self, name, text):
        path = os.path.join(self.bin, name)
        with open(path, 'w', encoding='ascii') as file:
            file.write(text)
        os.chmod(path, 0o755)
        return path

    def noted(self, name):
        path = os.path.join(self.notes, name)
        if not os.path.exists(path):
            return ''
        with open(path, encoding='ascii') as file:
            return file.read()

    def solutions(self):
        return glob.glob(self.model + '.snapshots/*.h5')

    def start(self, *args, **environment):
        clean = {k: v for k, v in os.environ.items() if not k.startswith('SLURM_')}
        clean.update(environment, NOTES=self.notes, PATH=self.bin + ':' + os.environ['PATH'], HYCO_GROUPS='2')
        # pylint: disable=consider-using-with
        return subprocess.Popen(['bash', SCRIPT, *settled(['train', *args])[1:], '-model', self.model], env=clean, cwd=self.folder,
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def finish(self, process, status=0):
        out, _ = process.communicate(timeout=60 * PATIENCE)
        self.assertEqual(process.returncode, status, out)
        return out

    def interrupt(self, process):
        """As Slurm does before the time is over, once a few solutions are there."""
        deadline = time.monotonic() + 50 * PATIENCE
        while len(self.solutions()) < 3 and process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.01)
        process.send_signal(signal.SIGUSR1)

    def test_rope(self):
        """In a plain shell: trained, with the report and all solutions."""
        out = self.finish(self.start('-scene', ROPE, '-grid', '5,6', '-report', self.path('r.json')))
        self.assertIn('2 ranks, 0 solutions so far', out)
        self.assertEqual(len(self.solutions()), 30)
        with open(self.path('r.json'), encoding='utf-8') as file:
            self.assertEqual(json.load(file)['n_samples'], 30)

    def test_goes_on(self):
        """An interrupted training continues with its solutions."""
        first = self.start(*LONG)
        self.interrupt(first)
        self.assertIn('the same command continues', self.finish(first, 75))
        self.assertFalse(os.path.exists(self.model))
        before = {path: os.stat(path).st_mtime_ns for path in self.solutions()}
        self.assertGreater(len(before), 0)
        self.assertIn(f'{len(before)} solutions so far', self.finish(self.start(*LONG)))
        self.assertTrue(os.path.exists(self.model))
        self.assertEqual(len(self.solutions()), N_LONG)
        self.assertEqual({path: os.stat(path).st_mtime_ns for path in before}, before, 'solved again')

    def test_queue(self):
        """Under Slurm an interrupted job is requeued."""
        job = {'SLURM_JOB_ID': '17', 'SLURM_NTASKS': '2'}
        first = self.start(*LONG, **job)
        self.interrupt(first)
        self.finish(first)
        self.assertEqual(self.noted('scontrol'), 'requeue 17\n')
        self.assertIn('--ntasks=2', self.noted('srun'))
        self.assertIn('train -hyco_groups 2', self.noted('srun'))
        self.finish(self.start(*LONG, **job))
        self.assertEqual(self.noted('scontrol'), 'requeue 17\n')
        self.assertTrue(os.path.exists(self.model))

    def test_queue_ends(self):
        """Not queued again: after a failure, after a run that added nothing, after too many runs."""
        job = {'SLURM_JOB_ID': '17', 'SLURM_NTASKS': '2'}
        self.assertIn('nowhere', self.finish(self.start('-scene', 'nowhere', **job), 1))
        stuck = self.tool('stuck', '#!/bin/sh\n: >"$NOTES/up"\nexec sleep 60\n')
        process = self.start('-scene', ROPE, **job, HYCO=stuck)
        while not os.path.exists(os.path.join(self.notes, 'up')) and process.poll() is None:
            time.sleep(0.01)
        process.send_signal(signal.SIGUSR1)
        self.assertIn('no solution was added', self.finish(process, 1))
        process = self.start(*LONG, **job, SLURM_RESTART_COUNT='3', HYCO_RUNS='3')
        self.interrupt(process)
        self.assertIn('3 runs were not enough', self.finish(process, 1))
        self.assertEqual(self.noted('scontrol'), '')

    def test_model_missing(self):
        """Without -model the script stops and names it."""
        run = subprocess.run(['bash', SCRIPT, '-scene', ROPE], capture_output=True, text=True, timeout=20 * PATIENCE)
        self.assertEqual(run.returncode, 2)
        self.assertIn('-model', run.stderr)


if __name__ == '__main__':
    unittest.main()
