"""Groups of ranks in a training: what the report and -hyco_groups_monitor say of their points, of the bytes that each rank writes, and of a point
that fails."""
import glob
import os
import re
import unittest

import h5py

from common import PELLET, Case

POINTS = ('-values_radius', '4.02,4.03,4.05,4.07', '-values_load', '0.3,0.6,1')
N = 12


class Groups(Case):
    def solutions(self, model):
        return glob.glob(self.path(model + '.snapshots', '*.h5'))

    def data(self, path):
        """The bytes of the datasets of a file."""
        sizes = []
        with h5py.File(path) as file:
            file.visititems(lambda _, found: sizes.append(found.size * found.dtype.itemsize) if isinstance(found, h5py.Dataset) else None)
        return sum(sizes)

    def events(self, out):
        """The monitored events in their order: group, what."""
        found = re.findall(r'^  event (\d+): group (\d+) (.*)$', out, re.M)
        self.assertEqual(sorted(int(n) for n, _, _ in found), list(range(1, len(found) + 1)))
        return [(int(group), what) for _, group, what in sorted(found, key=lambda e: int(e[0]))]

    def test_balance(self):
        """The ranks of a group write equal shares, all together what the files contain; less than one point for each other group is unsolved
        when the first one ends."""
        for ranks, groups in ((1, 1), (3, 3), (4, 2)):
            model = f'{ranks}.h5'
            r = self.hyco('train', '-scene', PELLET, *POINTS, '-hyco_groups', groups, '-model', model, ranks=ranks)
            self.assertEqual((len(r['solved_by_group']), sum(r['solved_by_group'])), (groups, N))
            self.assertLess(r['unsolved_when_idle'], groups)
            written = [round(1e6 * mb) for mb in r['written_mb_by_rank']]
            self.assertEqual(len(written), ranks)
            self.assertEqual(sum(written), sum(self.data(path) for path in self.solutions(model)))
            each = ranks // groups
            for k, solved in enumerate(r['solved_by_group']):
                mine = written[k * each:(k + 1) * each]
                self.near(sum(mine), sum(written) * solved / N, 1e-9)
                self.assertLess(max(mine), 1.25 * sum(mine) / each)

    def test_monitor(self):
        """-hyco_groups_monitor prints the points of each group, as the report counts them."""
        run = self.run_raw('train', '-scene', PELLET, *POINTS, '-hyco_groups', 2, '-hyco_groups_monitor', '-model', 'm.h5', ranks=2)
        self.assertEqual(run.returncode, 0, run.stderr)
        found = self.events(run.stdout)
        begun = [what for _, what in found if what.startswith('begins ')]
        self.assertEqual((len(begun), len(set(begun))), (N, N))
        self.assertIn('begins radius = 4.05, load = 0.6', begun)
        self.assertEqual(sorted(e for e in found if not e[1].startswith('begins ')), [(0, 'ends'), (1, 'ends')])

    def test_failure(self):
        """No point is begun after a failure; those that were begun are stored, except the one that fails."""
        with open(os.path.join(PELLET, 'paper.yaml'), encoding='utf-8') as file:
            scene = self.changed('fails.yaml', file.read(), (('mesh: A.msh', f'mesh: {PELLET}/A.msh'),
                                                             ('young: 1e5\n    poisson: 0.3\n    map', 'young: 1e5*(radius - 4.05)/(radius - 4.05)\n    poisson: 0.3\n    map')))
        run = self.run_raw('train', '-scene', scene, *POINTS, '-hyco_groups', 2, '-hyco_groups_monitor', '-model', 'f.h5', ranks=2)
        self.assertEqual(run.returncode, 1, run.stderr)
        found = [what for _, what in self.events(run.stdout)]
        at = found.index('fails')
        self.assertEqual(found[at + 1:], ['ends'])
        self.assertLess(at, N)
        self.assertEqual(len(self.solutions('f.h5')), at - 1)


if __name__ == '__main__':
    unittest.main()
