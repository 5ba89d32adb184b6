"""Under valgrind's memcheck, every type of model is trained and predicts, with and without a history: nothing reads memory that was not set or does not
belong to it, and nothing is lost. The runs have one rank: messages of Open MPI's own threads depend on the machine."""
import subprocess
import unittest

from common import HYCO, PATIENCE, SOURCE, settled, square
from paths import NORTON, FlowingRing

BLOCK = """
scene:
  title: a block under a rigid wave
  mesh: mesh.msh
  parameters: [push, STIFF]
parameter:
  push: {range: [0.01, 0.03]}
  STIFF: {range: [1, 3]}
body:
  block: {young: YOUNG, poisson: 0.3}
fixed:
  low: {x: 0, y: 0}
contact:
  wave: {type: obstacle, group: high, normal: {y: 1}, gap: 0.02*WAVES*x*x - push}
output:
  lift: {mean: u_y, group: high}
"""
HISTORY = """
history:
  times: [0, 1, 2]
  tables: {q: [[0, 0], [1, 1], [2, 0.2]]}
"""
KINDS = ('hybrid', 'projection', 'bodies', 'cubature', 'regression')
MEMCHECK = ('valgrind', '-q', '--leak-check=full', '--show-leak-kinds=definite', '--errors-for-leak-kinds=definite', '--num-callers=50',
            '--error-exitcode=99', f'--suppressions={SOURCE}/tests/valgrind.supp')


class Memory(FlowingRing):
    def checked(self, *args, status=(0,)):
        args = [str(a) for a in settled(args)]
        run = subprocess.run([*MEMCHECK, f'--log-file={self.path("found")}', HYCO, *args], cwd=self.folder, capture_output=True, text=True,
                             timeout=600 * PATIENCE, check=False)
        with open(self.path('found'), encoding='utf-8') as f:
            found = f.read()
        self.assertIn(run.returncode, status, f'{args}\n{run.stderr[-2000:]}\n{found[:8000]}')

    def model(self, name, scene, kind, point, *settings):
        self.checked('train', '-scene', scene, '-hyco_model_type', kind, '-hyco_snapshots', name + '.store', '-model', 'm.h5', *settings, status=(0, 3))
        self.checked('predict', '-model', 'm.h5', '-grid', '2,1', '-table', 't.csv')
        self.checked('predict', '-model', 'm.h5', '-mu', point, '-output', 'o.xdmf', '-report', 'r.json')

    def block(self, stiff):
        """The scene of a block of 4 x 4 cells. stiff: the second parameter changes the stiffness; otherwise only gaps change."""
        name, young = ('modulus', '100*modulus') if stiff else ('waves', '100')
        return self.written(BLOCK.replace('STIFF', name).replace('YOUNG', young).replace('WAVES', '1' if stiff else 'waves'), square(4)) + '/scene.yaml'

    def test_gaps(self):
        """The model of bodies of a scene whose parameters change gaps only, judged at held-out solutions."""
        self.model('gaps', self.block(False), 'bodies', '0.021,1.7', '-values_push', '0.015,0.03', '-values_waves', '1,3', '-hyco_validation', 2)

    def test_types(self):
        """Every type of model of a block: trained, predicts."""
        for kind in KINDS:
            self.model('types', self.block(True), kind, '0.021,1.7', '-values_push', '0.015,0.03', '-values_modulus', '1,2,3', '-hyco_validation', 2)

    def test_paths(self):
        """Every type of model of a path: trained, predicts."""
        for kind in KINDS:
            more = {'hybrid': ['-hyco_rid_layers', 1, '-hyco_keep_singular'], 'projection': ['-hyco_keep_singular']}.get(kind, [])
            self.model('paths', self.scene('ring.yaml', NORTON, HISTORY), kind, '0.0055,0.91', '-hyco_pod_tol', '1e-8', *more,
                       '-values_gap', '0.005,0.007', '-values_push', '0.8,1.2')


if __name__ == '__main__':
    unittest.main()
