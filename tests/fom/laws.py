"""Bodies with laws in scenes: a law of a shared library with MFront's interface compared with the same law of hyco,
refusals and their messages, elements chosen by the law, ranks, heat in a history compared with the linear scene."""
import os
import sys
import unittest

import h5py
import numpy as np

from common import HYCO, SOURCE, Case

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import Grid  # noqa: E402

LIBRARIES = os.path.join(os.path.dirname(HYCO), 'tests')
SCENE = """
scene: {{title: laws, mesh: mesh.msh}}
body: {{block: {{{body}}}}}
fixed: {{x0: {{x: 0}}, y0: {{y: 0}}{more}}}
traction: {{x1: {{x: "90*q*(1 + y)"}}, y1: {{x: "30*q"}}}}
{history}
"""
HISTORY = 'history: {times: [0, 1, 3, 10], tables: {q: [[0, 0], [1, 1], [3, 1], [10, -1]]}}'
NORTON = 'young: 1e5, poisson: 0.3, law: {type: norton, rate: 2e-6, exponent: 1}'
MFRONT = (f'law: {{type: mfront, library: {LIBRARIES}/behaviours.so, behaviour: Maxwell, YoungModulus: 1e5, '
          'PoissonRatio: 0.3, A: 2e-6}')
BOTH = 'young: 1e5, poisson: 0.3, law: {type: norton, rate: 1e-12, exponent: 4, yield: 120, hardening: 2000}'


class Laws(Case):
    def scene(self, body, kind='quad4', dim=2, history=HISTORY, n=3):
        grid = Grid()
        grid.box(kind, [np.linspace(0, 1, n)] * dim, lambda x: x + 0.05 * np.sin(3 * x[:, ::-1]) * x * (1 - x), 'block',
                 {f'{a}{e}': f'{a}{e}' for a in 'xyz'[:dim] for e in '01'})
        grid.write(self.path('mesh.msh'))
        with open(self.path('scene.yaml'), 'w', encoding='utf-8') as f:
            f.write(SCENE.format(body=body, more=', z0: {z: 0}' if dim == 3 else '', history=history))
        return self.folder

    def fields(self, *scene, ranks=1, options=(), **entries):
        """The last step's displacement and stress."""
        report = self.hyco('solve', '-scene', self.scene(*scene, **entries), '-output', self.path('o.xdmf'), *options,
                           ranks=ranks)
        with h5py.File(self.path('o.h5')) as f:
            steps = sorted(name for name in f if name.startswith('step-'))
            last = f[steps[-1]] if steps else f
            return report, last['nodes/displacement'][:], last['cells/stress'][:]

    def same(self, one, other, relative):
        for a, b in zip(one, other):
            self.assertLessEqual(abs(a - b).max(), relative * abs(a).max())

    def refused(self, *words, options=(), **entries):
        run = self.run_raw('solve', '-scene', self.scene(**entries), *options)
        self.assertEqual(run.returncode, 1, run.stdout)
        lines = [line for line in run.stderr.splitlines() if line.strip()]
        self.assertEqual(len(lines), 1, run.stderr)
        for word in words:
            self.assertIn(word, lines[0])

    def test_shared_library(self):
        """Its shear carries sqrt(2) and its components stand in another order: sheared blocks in 2D and 3D."""
        steps = ('-hyco_step_inelastic', '1', '-hyco_substeps', '3')  # equal ones
        for kind, dim in (('quad4', 2), ('hex8', 3)):
            own, theirs = (self.fields(body, kind, dim, options=steps) for body in (NORTON, MFRONT))
            self.same(own[1:], theirs[1:], 1e-9)
            for energy in ('strain_energy', 'energy_defect'):
                self.assertAlmostEqual(own[0][energy], theirs[0][energy], delta=1e-8 * own[0]['strain_energy'])

    def test_library_in_scene_folder(self):
        """A name without a slash is found in the scene's folder; a file that is missing, not a library, or crashes, gives
        one line."""
        for name in ('behaviours.so', 'crash.so'):
            link = self.path(name)
            if not os.path.exists(link):
                os.symlink(os.path.join(LIBRARIES, name), link)
        self.assertEqual(self.run_raw('solve', '-scene', self.scene(MFRONT), '-body_block_law_library',
                                      'behaviours.so').returncode, 0)
        for name, words in (('missing.so', ('missing.so', 'cannot be loaded')), ('crash.so', ('crashes', 'crash.so')),
                            ('scene.yaml', ('scene.yaml', 'cannot be loaded'))):
            self.refused(*words, body=MFRONT, options=('-body_block_law_library', name))

    def test_behaviours(self):
        """Shared libraries without the behaviour, of another version or hypothesis are refused."""
        for name, word in (('Nothing', 'Nothing_mfront_interface'), ('Old', 'version 0'), ('Other', 'Cyrano')):
            self.refused('block', word, body=MFRONT, options=('-body_block_law_behaviour', name))
        self.refused('the rate is negative', body=MFRONT, options=('-body_block_law_A', '-1'))
        self.refused('body block has no A', body=MFRONT.replace(', A: 2e-6', ''))
        self.refused('body_block_law_B', 'A', body=MFRONT, options=('-body_block_law_B', '1'))

    def test_refused(self):
        """Laws without a history, with wrong constants, or without a temperature are refused."""
        self.refused('block', 'norton', 'history', body=NORTON, history='', options=('-traction_x1_x', '1',
                                                                                      '-traction_y1_x', '1'))
        self.refused('body_block_law_rate', 'negative', body=NORTON, options=('-body_block_law_rate', '1e-6*(1 - t)'))
        self.refused('body_block_law_exponent', 'between 1', body=NORTON, options=('-body_block_law_exponent', '0.5'))
        self.refused('body_block_temperature', 'kelvin', body=NORTON + ', temperature: "300 - 100*t"')
        self.refused('body block', 'temperature', 'limback_andersson', body='young: 1e5, law: limback_andersson')
        self.refused('reference_temperature', body=NORTON + ', expansion: 1e-5')
        self.refused('temperature', 'pressure_y1', body=NORTON, options=('-pressure_y1', 'temperature'))
        self.refused('tri3', 'element: standard', body=NORTON, kind='tri3')
        self.refused('no_such', 'norton', 'j2', body=NORTON.replace('norton', 'no_such'))

    def test_elements(self):
        """bbar for inelastic laws by default; standard if the scene says so; then simplices too."""
        chosen, bbar, standard = (self.fields(BOTH + element) for element in ('', ', element: bbar', ', element: standard'))
        self.same(chosen[1:], bbar[1:], 0)
        self.assertGreater(abs(chosen[1] - standard[1]).max(), 1e-4 * abs(chosen[1]).max())
        self.fields(BOTH + ', element: standard', kind='tri3')

    def test_ranks(self):
        """Bodies with laws on 3 ranks: the fields of one."""
        one = self.fields(BOTH, 'hex8', 3, n=4)
        self.same(one[1:], self.fields(BOTH, 'hex8', 3, n=4, ranks=3)[1:], 1e-9)

    def test_reduced(self):
        """A linear scene with heat trains as others do: a model of bodies has the forces of full order."""
        blocks = ('-scene', os.path.join(SOURCE, 'examples', 'blocks'), '-body_block_temperature', '293+3000*press*(1+x/20)',
                  '-body_block_reference_temperature', '293', '-body_block_expansion', '1.2e-5')
        self.hyco('train', *blocks, '-grid', '3,3', '-hyco_model_type', 'bodies', '-model', self.path('m.h5'), status=None)
        report = self.hyco('compare', *blocks, '-model', self.path('m.h5'), '-grid', '3,3')
        for error, bound in (('error_u', 1e-5), ('error_sigma', 1e-4), ('error_lambda', 1e-8)):
            self.assertLess(report[error]['max'], bound, error)

    def test_heat_in_time(self):
        """An elastic body that warms up in a history ends where the scene without a history is."""
        body = ('young: "1e5 - 50*temperature", poisson: 0.3, temperature: "{}*(1 + x*y)", reference_temperature: 293, '
                'expansion: 1e-5')
        times = 'history: {times: [0, 1, 10], tables: {q: [[0, 0], [10, 1]]}}'
        path = self.fields(body.format('(293 + 30*t)'), history=times)
        at_once = self.fields(body.format('593'), history='', options=('-traction_x1_x', '90*(1 + y)', '-traction_y1_x',
                                                                       '30'))
        self.same(path[1:], at_once[1:], 1e-10)


if __name__ == '__main__':
    unittest.main()
