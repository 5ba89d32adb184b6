"""Random scenes with fixed seeds: cells, sizes, materials, gaps, loads, units, kinds of contact, distorted meshes. Full order is
checked by its KKT residuals; the model with the whole mesh and all displacements full order must agree with full order at an
unseen point, to 1e-8; and so must the forces of a model of bodies. `battery.py 20260101 500` runs 500 from that seed, with a table
of its own; without arguments some dozens."""
import sys
import unittest

import numpy as np

from extreme import BODIES, Extreme, blocks, points

SEED, COUNT = 20180701, 32


class Battery(Extreme):
    name = 'battery'
    seed, count = SEED, COUNT

    def draw(self, seed):
        r = np.random.default_rng(seed)
        kind = r.choice(['quad4', 'tri3', 'hex8', 'tet4'])
        contact = r.choice(['pair', 'surface'])
        n = int(r.integers(2, 9 if kind in ('quad4', 'tri3') else 4))
        other = n if contact == 'pair' else int(r.integers(n, 2 * n))
        length, stress = 10.0**r.integers(-6, 4), 10.0**r.integers(-3, 12)
        press, gap = 10.0**r.uniform(-5, -1), r.choice([0, 1e-3, 0.3, 0.9])
        options = {'length': length, 'stress': stress, 'young': tuple(10.0**r.uniform(-2, 4, 2)),
                   'poisson': tuple(r.uniform(0, 0.45, 2)), 'contact': contact, 'crown': press * r.choice([0, 0.3, 1, 3]),
                   'press': (press / 2, press), 'gaps': (0, gap * press + press / 9), 'jitter': r, 'aspect': 10.0**r.uniform(-1, 1),
                   'element': r.choice([None, 'bbar']) if kind in ('quad4', 'hex8') else None}
        what = f"seed {seed}: {kind} {contact} {n} under {other}, " + ', '.join(
            f'{k} {v}' for k, v in options.items() if k != 'jitter')
        low, high = 0, options['gaps'][1]
        train = points((press / 2, press), (low, high), length)
        test = points(r.uniform(press / 2, press, 1).tolist(), r.uniform(low, high, 1).tolist(), length)
        return what, blocks(kind, (n, other), **options), train, test

    def test_battery(self):
        """Random scenes: KKT residuals at full order, errors of each type of model."""
        worst = {'full order: worst KKT residual': 0, 'hybrid, whole domain: error': 0,
                 'bodies: error of the forces': 0, 'projection, at a training point: error': 0}
        active, done = [], 0
        for seed in range(self.seed, self.seed + self.count):
            what, (grid, scene), train, test = self.draw(seed)
            folder = self.scene(grid, scene)
            with self.subTest(what=what):
                common = ('-hyco_pod_tol', '0', '-hyco_pod_noise', '1e-15')
                self.train(folder, *train, '-hyco_rid_whole', 'true', '-hyco_hybrid', 'all', *common)
                c = self.compare(folder, *test)
                found = [self.hyco('solve', '-scene', folder, '-mu', ','.join(test[1::2])), self.worst(c)]
                report = found[0]
                self.solved(report)
                active.append((report['n_active'] > 0) + (report['n_active'] == report['n_contacts']))
                found[0] = max(report['kkt'].values())
                self.train(folder, *train, *BODIES)
                found.append(self.compare(folder, *test)['error_lambda']['max'] or 0)
                if seed % 3 == 0:
                    self.train(folder, *train, '-hyco_model_type', 'projection', '-hyco_dual', 'snapshots', *common)
                    c = self.compare(folder, '-values_press', train[1].split(',')[1], '-values_gap', train[3].split(',')[0])
                    found.append(self.worst(c))
                for key, value in zip(worst, found):
                    worst[key] = max(worst[key], value)
                    self.assertLessEqual(value, 1e-8, key)
                done += 1
            self.tell(done, seed + 1 - self.seed, worst, active)

    def tell(self, done, tried, worst, active):
        """The table of the scenes so far, so that an interrupted run keeps its results."""
        self.begin()
        case = f'{done} random scenes from seed {self.seed}' + (f' right of {tried}' if done < tried else '')
        for key, value in worst.items():
            self.row(case, key, value, 1e-8)
        self.say(case, 'with no, some, all contacts active', ', '.join(str(active.count(k)) for k in range(3)))


if __name__ == '__main__':
    if len(sys.argv) > 2:
        Battery.seed, Battery.count = int(sys.argv[1]), int(sys.argv[2])
        Battery.name = f'battery_{Battery.seed}'
    unittest.main(argv=sys.argv[:1])
