"""Parameters at the ends of their ranges, outside by one unit of round-off and by far, ranges of one point, six parameters."""
import math
import unittest

from extreme import BODIES, Extreme, blocks, points

PROJECTION = ('-hyco_model_type', 'projection', '-hyco_dual', 'snapshots', '-hyco_pod_tol', 0)
ALL = ('-hyco_rid_whole', 'true', '-hyco_hybrid', 'all')


class Parameters(Extreme):
    name = 'parameters'

    def test_ends(self):
        """At the ends of the parameters' ranges: each model is accurate; beyond them it is refused."""
        scene = self.scene(*blocks(crown=0.1))
        commands = [('full order', ('solve', '-scene', scene))]
        for model, more in (('hybrid', ALL), ('projection', PROJECTION), ('bodies', BODIES)):
            self.train(scene, '-grid', '3,2', '-grid_type', 'closed', *more, model=model + '.h5')
            commands.append((model, ('predict', '-model', model + '.h5')))
        for name, command in commands:
            for at, out in ((0.04, 0), (0.08, 1)):
                end = self.hyco(*command, '-mu', f'{at!r},0.02')['total_contact_force']
                ulp = self.hyco(*command, '-mu', f'{math.nextafter(at, out)!r},0.02')['total_contact_force']
                self.row(f'press = {at:g} and one unit of round-off outside', f'{name}: forces apart by', abs(ulp / end - 1),
                         1e-9)
                for far in (at + (out - at) * 1e-9, 0.01 if out == 0 else 1e6, math.copysign(1e300, out - 0.5)):
                    self.refused(f'{name}, press = {far!r}', *command, '-mu', f'{far!r},0.02', says='outside its range')
            self.refused(f'{name}, press = nan', *command, '-mu', 'nan,0.02', says='nan')

    def test_extrapolate(self):
        """-extrapolate: the hybrid model on the whole mesh agrees with full order anywhere, the forces of bodies are exact where
        parameters are loads and gaps; far outside everything is closed, and the force is proportional to the press. The command fails on overflow."""
        scene = self.scene(*blocks(crown=0.1))
        found = {}
        for model, more in (('hybrid', ALL), ('bodies', BODIES), ('projection', PROJECTION)):
            self.train(scene, '-grid', '3,2', '-grid_type', 'closed', *more)
            for press in (0.08 * (1 + 1e-9), 0.12, 1e6, 1e8):
                p = self.hyco('predict', '-model', 'm.h5', '-extrapolate', '-mu', f'{press!r},0.02', status=None)  # 3: its modes end here
                self.assertEqual((p['extrapolated'], p['converged']), (True, True))
                found[model, press] = p['total_contact_force']
                if model == 'bodies':
                    self.row(f'press = {press:.10g}, up to 0.08, by -extrapolate', "bodies: force apart from the hybrid model's",
                             abs(found[model, press] / found['hybrid', press] - 1), 1e-9)
            self.row('press = 1e6, -extrapolate', f'{model}: force per press apart from that at 1e8',
                     abs(100 * found[model, 1e6] / found[model, 1e8] - 1), 1e-6)
            for press in ('1e300', '-1e300'):
                run = self.run_raw('predict', '-model', 'm.h5', '-extrapolate', '-mu', press + ',0.02')
                lines = run.stderr.splitlines()
                self.assertTrue(run.returncode == 0 or len(lines) == 1, run.stderr)
                self.assertNotIn('nan', run.stdout)
                self.say(f'press = {press}, -extrapolate', model, lines[-1].removeprefix('hyco: ') if run.returncode else 'solved')

    def test_one_point(self):
        """Ranges of one point: with a grid, and with the greedy loop, which has only that point."""
        scene = self.scene(*blocks(crown=0.1, press=(0.06, 0.06)))
        for case, train in (('grid', ('-grid', '1,3', '-grid_type', 'closed')),
                            ('greedy', ('-greedy', '-training_grid', '1,5', '-max_snapshots', 4))):
            for model, more in (('hybrid', ALL), ('projection', PROJECTION), ('bodies', BODIES)):
                if case == 'greedy' and model != 'hybrid':
                    continue
                self.train(scene, *train, *more)
                at = (0, 0.01, 0.02) if model == 'hybrid' else (0.01,)
                self.row(f'a range of one point, {case}', f'{model}: error', self.worst(self.compare(scene, *points((0.06,), at))),
                         1e-8)

    def six(self, scene):
        scene['scene']['parameters'] += ['soft', 'stiff', 'squash', 'crown']
        scene['parameter'].update({'soft': {'range': [40, 60]}, 'stiff': {'range': [100, 200]}, 'squash': {'range': [0, 0.4]},
                                   'crown': {'range': [0.05, 0.15]}})
        scene['body'] = {'a': {'young': 'stiff', 'poisson': 'squash'}, 'b': {'young': 'soft', 'poisson': 0.2}}
        scene['contact']['seam']['gap'] = 'gap + crown*x^2'

    def test_six(self):
        """Six parameters: models trained on a grid, at seen and unseen points."""
        grid, scene = blocks(crown=0.1)
        self.six(scene)
        scene = self.scene(grid, scene)
        values = {'press': '0.05,0.07', 'gap': '0.01', 'soft': '45,55', 'stiff': '120', 'squash': '0.1,0.3', 'crown': '0.1'}
        train = [a for k, v in values.items() for a in (f'-values_{k}', v)]
        seen = [a for k, v in values.items() for a in (f'-values_{k}', v.split(',')[0])]
        between = [a for k, v in zip(values, (0.06, 0.005, 50, 150, 0.2, 0.08)) for a in (f'-values_{k}', v)]
        self.train(scene, *train, *ALL)
        self.row('six parameters', 'hybrid, whole domain: error', self.worst(self.compare(scene, *between)), 1e-8)
        self.train(scene, *train, *PROJECTION)
        self.row('six parameters', 'projection, at a training point: error', self.worst(self.compare(scene, *seen)), 1e-8)
        self.row('six parameters', 'bodies: error of the forces', self.bodies(scene, train, between), 1e-4)

    def test_six_greedy(self):
        """Six parameters: a model of greedily chosen points."""
        grid, scene = blocks(crown=0.1, n=(2, 2))
        self.six(scene)
        scene = self.scene(grid, scene)
        t = self.train(scene, '-greedy', '-training_grid', '3,2,2,2,2,2', '-max_snapshots', 66, *ALL)
        self.assertGreaterEqual(t['n_samples'], 64)
        at = [a for k, v in (('press', 0.06), ('gap', 0.005), ('soft', 50), ('stiff', 150), ('squash', 0.2), ('crown', 0.08))
              for a in (f'-values_{k}', v)]
        self.row(f"six parameters, greedy: {t['n_samples']} solutions", 'hybrid, whole domain: error',
                 self.worst(self.compare(scene, *at)), 1e-8)


if __name__ == '__main__':
    unittest.main()
