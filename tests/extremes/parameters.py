"""Parameters on the ends of their ranges, outside by one unit of round-off and by far, ranges of one point, six at once."""
import math
import unittest

from extreme import Extreme, blocks, points

PROJECTION = ('-hyco_model_type', 'projection', '-hyco_dual', 'snapshots', '-hyco_pod_tol', 0)
ALL = ('-hyco_rid_whole', 'true', '-hyco_hybrid', 'all')


class Parameters(Extreme):
    name = 'parameters'

    def test_ends(self):
        scene = self.scene(*blocks(crown=0.1))
        commands = [('full order', ('solve', '-scene', scene))]
        for model, more in (('hybrid', ALL), ('projection', PROJECTION)):
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

    def test_one_point(self):
        """Ranges of one point: by a grid, and by the greedy loop, which has no direction to go in it."""
        scene = self.scene(*blocks(crown=0.1, press=(0.06, 0.06)))
        for case, train in (('grid', ('-grid', '1,3', '-grid_type', 'closed')),
                            ('greedy', ('-greedy', '-training_grid', '1,5', '-max_snapshots', 4))):
            for model, more in (('hybrid', ALL), ('projection', PROJECTION)):
                if (case, model) == ('greedy', 'projection'):
                    continue
                self.train(scene, *train, *more)
                at = (0.01,) if model == 'projection' else (0, 0.01, 0.02)
                self.row(f'a range of one point, {case}', f'{model}: error', self.worst(self.compare(scene, *points((0.06,), at))),
                         1e-8)

    def test_six(self):
        grid, scene = blocks(crown=0.1)
        scene['scene']['parameters'] += ['soft', 'stiff', 'squash', 'crown']
        scene['parameter'].update({'soft': {'range': [40, 60]}, 'stiff': {'range': [100, 200]}, 'squash': {'range': [0, 0.4]},
                                   'crown': {'range': [0.05, 0.15]}})
        scene['body'] = {'a': {'young': 'stiff', 'poisson': 'squash'}, 'b': {'young': 'soft', 'poisson': 0.2}}
        scene['contact']['seam']['gap'] = 'gap + crown*x^2'
        scene = self.scene(grid, scene)
        values = {'press': '0.05,0.07', 'gap': '0.01', 'soft': '45,55', 'stiff': '120', 'squash': '0.1,0.3', 'crown': '0.1'}
        train = [a for k, v in values.items() for a in (f'-values_{k}', v)]
        seen = [a for k, v in values.items() for a in (f'-values_{k}', v.split(',')[0])]
        between = [a for k, v in zip(values, (0.06, 0.005, 50, 150, 0.2, 0.08)) for a in (f'-values_{k}', v)]
        self.train(scene, *train, *ALL)
        self.row('six parameters', 'hybrid, whole domain: error', self.worst(self.compare(scene, *between)), 1e-8)
        self.train(scene, *train, *PROJECTION)
        self.row('six parameters', 'projection, at a training point: error', self.worst(self.compare(scene, *seen)), 1e-8)


if __name__ == '__main__':
    unittest.main()
