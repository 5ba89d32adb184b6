"""hyco check: counts, warnings, refusals and estimates, on several ranks as on one; hyco view of a missing mesh or group."""
import csv
import os
import shutil
import unittest

from common import SANITIZED, SOURCE, Case, msh

EXAMPLES = os.path.join(SOURCE, 'examples')

SCENE = '''scene: {mesh: two.msh, parameters: [press, idle]}
parameter:
  press: {range: [0.01, 0.05]}
  idle: {range: [0, 1]}
body:
  upper: {young: 100, poisson: 0.3}
  lower: {young: 100, poisson: 0.3, map: {y: y*lower}}
fixed:
  base: {x: 0, y: 0}
  top: {x: 0, y: -press}
contact:
  under: {type: surface, slave: under, master: over, gap: 0.02}
'''


def two(path, upper=2, lower=4, height=1.0, twice=False):
    """Two unit squares, one on the other, of so many cells along x: quad4, a row each; twice: the upper in two parts."""
    nodes, cells = [], []

    def block(n, y, tag, bottom, top, halves=1):
        for half in range(halves):
            first = len(nodes)
            k = n // halves
            for j in (0, 1):
                nodes.extend((half / halves + i / n, y + j * height, 0.0) for i in range(k + 1))
            for i in range(k):
                a, b = first + i + 1, first + k + 1 + i + 1
                cells.append((3, tag, [a, a + 1, b + 1, b]))
                cells.append((1, bottom, [a, a + 1]))
                cells.append((1, top, [b, b + 1]))

    block(upper, height, 1, 3, 4, 2 if twice else 1)
    block(lower, 0.0, 2, 5, 6)
    msh(path, nodes, cells, {1: (2, 'upper'), 2: (2, 'lower'), 3: (1, 'under'), 4: (1, 'top'), 5: (1, 'base'), 6: (1, 'over')})


class Check(Case):
    def scene(self, name='scene', text=SCENE.replace(', map: {y: y*lower}', ''), **mesh):
        os.makedirs(self.path(name), exist_ok=True)
        two(self.path(name, 'two.msh'), **mesh)
        with open(self.path(name, 'scene.yaml'), 'w', encoding='utf-8') as f:
            f.write(text)
        return name

    def warned(self, report, *words):
        """One warning has all these words."""
        self.assertTrue(any(all(w in line for w in words) for line in report['warnings']), (words, report['warnings']))

    def test_examples(self):
        """The examples cause no warnings (plate's stiffness varies over more than a decade); sizes are those that solve reports."""
        for name, point in (('rope', '0.07,0.17'), ('blocks', '0.05,0.06'), ('hertz', '0.05,1,10'), ('plate', '1,0.5'),
                            ('roller', '0,0.5,10'), ('pellet', '4.06,1')):
            with self.subTest(name):
                found = self.hyco('check', '-scene', os.path.join(EXAMPLES, name))
                self.assertEqual([line for line in found['warnings'] if name != 'plate' or 'stiffness' not in line], [])
                self.assertEqual(found['n_warnings'], int(name == 'plate'))
                solved = self.hyco('solve', '-scene', os.path.join(EXAMPLES, name), '-mu', point)
                for key in ('n_dof', 'n_contacts'):
                    self.assertEqual(found[key], solved[key], key)

    def test_pellet(self):
        """Gaps as in the scene, 4.1 - radius; what the parameters affect; the same on three ranks."""
        found = self.hyco('check', '-scene', os.path.join(EXAMPLES, 'pellet'))
        gap, = found['contacts']
        self.assertEqual((gap['n'], gap['n_facing_min'], gap['n_facing_max']), (189, 189, 189))
        self.assertEqual(gap['gap_min'], 0)
        self.near(gap['gap_max'], 0.08, 1e-12)
        self.assertEqual(found['parameters'], {'radius': ['maps', 'stiffness', 'contact rows', 'gaps'], 'load': ['loads']})
        self.assertEqual([(b['name'], b['n_cells'], b['n_parts']) for b in found['bodies']], [('cladding', 320, 1), ('pellet', 960, 1)])
        apart = self.hyco('check', '-scene', os.path.join(EXAMPLES, 'pellet'), ranks=3)
        for key in found:
            if key not in ('estimate', 'ranks', 'memory_mb', 'memory_mb_largest_rank', 'bodies', 'contacts'):
                self.assertEqual(apart[key], found[key], key)
        for ours, theirs in zip(apart['contacts'] + apart['bodies'], found['contacts'] + found['bodies']):
            for key, value in theirs.items():
                if isinstance(value, float):
                    self.near(ours[key], value, 1e-9, key)
                else:
                    self.assertEqual(ours[key], value, key)

    def test_crack(self):
        """Nodes on other nodes inside a body, whose cells hang together elsewhere, are named; none where a contact's surfaces touch."""
        nodes = [(i, j, 0) for j in range(3) for i in range(5)] + [(2, 1, 0), (2, 2, 0)]
        doubled = {8: 16, 13: 17}
        cells = [[1 + i + a + 5 * (j + b) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))] for j in range(2) for i in range(4)]
        for crack in (False, True):
            elements = [(3, 1, [doubled.get(v, v) if crack and at % 4 > 1 else v for v in cell]) for at, cell in enumerate(cells)]
            elements += [(1, 2, [1, 6]), (1, 2, [6, 11]), (1, 3, [5, 10]), (1, 3, [10, 15])]
            msh(self.path('crack.msh'), nodes if crack else nodes[:15], elements, {1: (2, 'b'), 2: (1, 'left'), 3: (1, 'right')})
            scene = self.written('scene: {mesh: crack.msh, parameters: [load]}\nparameter: {load: {range: [1, 2]}}\n'
                                 'body: {b: {young: 100, poisson: 0.3}}\nfixed: {left: {x: 0, y: 0}}\npressure: {right: load}\n')
            found = self.hyco('check', '-scene', scene)
            self.assertEqual([(b['n_parts'], b['n_doubled']) for b in found['bodies']], [(1, 2 * crack)])
            self.assertEqual(found['n_warnings'], int(crack), found['warnings'])
        self.warned(found, 'body b', '16 on 8')

    def test_costs(self):
        """The points of a training are counted: with those held out, and the stiffnesses among them. A solve measures."""
        pellet = os.path.join(EXAMPLES, 'pellet')
        found = self.hyco('check', '-scene', pellet, '-values_radius', '4.02,4.06', '-values_load', '0.2,0.5,1')['estimate']
        self.assertEqual((found['n_training'], found['n_stiffness'], found['measured']), (6 + 20, 2 + 20, False))
        solved = self.hyco('check', '-scene', pellet, '-check_solve')
        self.assertTrue(solved['estimate']['measured'])
        self.near(solved['total_contact_force'], self.hyco('solve', '-scene', pellet, '-mu', '4.06,0.5')['total_contact_force'], 1e-9)
        if not SANITIZED:  # its memory is another
            memory = self.hyco('solve', '-scene', pellet, '-mu', '4.06,1')['memory_mb']
            self.assertLess(abs(solved['estimate']['solve_mb'] - memory), 0.5 * memory)

    def test_suspicious(self):
        """A coarse slave, an unused parameter and group, equal groups, a body in two parts, long cells, a gap that is too wide, one of the wrong sign."""
        found = self.hyco('check', '-scene', self.scene())
        self.near(found['contacts'][0]['slave_over_master'], 2, 1e-12)
        self.warned(found, 'under', 'slave')
        self.warned(found, 'idle', 'nothing')
        self.assertEqual(found['n_warnings'], 2, found['warnings'])
        fine = self.hyco('check', '-scene', self.scene(upper=4, lower=2))
        self.assertEqual(fine['n_warnings'], 1, fine['warnings'])
        self.warned(self.hyco('check', '-scene', self.scene(upper=4, twice=True)), 'upper', '2 parts')
        flat = self.hyco('check', '-scene', self.scene(height=1e-3))
        self.near(next(b['stretch'] for b in flat['bodies'] if b['name'] == 'upper'), 500, 1e-9)
        self.warned(flat, 'upper', '500')
        wide = self.hyco('check', '-scene', self.scene(upper=4), '-contact_under_gap', '0.5')
        self.warned(wide, 'under', '0.5')
        # 0.02 of the wrong sign is 1.4 % of a body; 0.01 may be an interference, and 0.02 at one end alone an obstacle's shape
        for gap, buried in (('-0.02', 'under (by 1.4 %)'), ('-0.01', ''), ('-0.02*x', '')):
            at = ('-scene', self.path('scene'), '-contact_under_gap', gap)
            self.assertEqual(any('sign' in line and 'under' in line for line in self.hyco('check', *at)['warnings']), bool(buried), gap)
            self.assertEqual(self.hyco('solve', *at, '-mu', '0.02,0')['buried'], buried)
            if buried:
                for ranks in (0, 2):
                    self.assertIn('is the sign of the gap right', self.run_raw('solve', *at, '-mu', '0.02,0', ranks=ranks).stdout)
        self.scene(upper=4)
        with open(self.path('scene', 'two.msh'), encoding='ascii') as f:
            lines = f.read().split('\n')
        at = next(k for k, line in enumerate(lines) if line == '$Elements')
        more = [line.split() for line in lines[at + 2:] if line.split()[1:2] == ['1'] and line.split()[3] == '6']
        count = int(lines[at + 1])
        lines[at + 1] = str(count + len(more))
        lines[at + 2 + count:at + 2 + count] = [f'{count + 1 + k} 1 2 7 7 {" ".join(e[5:])}' for k, e in enumerate(more)]
        text = '\n'.join(lines).replace('$PhysicalNames\n6\n', '$PhysicalNames\n7\n1 7 "Over"\n')
        with open(self.path('scene', 'two.msh'), 'w', encoding='ascii') as f:
            f.write(text)
        found = self.hyco('check', '-scene', 'scene')
        self.assertEqual(found['unused_groups'], ['Over'])
        self.warned(found, 'over', 'Over', 'upper and lower case')
        self.warned(found, 'over', 'Over', 'same nodes')
        self.warned(found, 'Over', 'no entry')

    def test_order(self):
        """The slave is the softer side, at all points, and of equally stiff ones the finer; a contact declared both ways; nothing that loads the bodies."""
        stiff = ('-body_upper_young', '100 + 300*press/0.01')  # 4 to 16 times as stiff as the lower one
        found = self.hyco('check', '-scene', self.scene(upper=4), *stiff)
        self.warned(found, 'contact under', 'stiff', 'over')
        self.near(found['contacts'][0]['stiffness_over_master_min'], 4, 1e-9)
        self.near(found['contacts'][0]['stiffness_over_master_max'], 16, 1e-9)
        other = self.hyco('check', '-scene', 'scene', *stiff, '-contact_under_slave', 'over', '-contact_under_master', 'under')
        self.assertEqual(other['n_warnings'], 1, other['warnings'])  # idle
        coarse = self.hyco('check', '-scene', self.scene(), '-body_upper_young', '20')
        self.assertFalse(any('slave' in line for line in coarse['warnings']), coarse['warnings'])
        two = ('-contact_again_type', 'surface', '-contact_again_slave', 'over', '-contact_again_master', 'under', '-contact_again_gap', '0.02')
        self.warned(self.hyco('check', '-scene', 'scene', *two), 'under', 'again', 'both ways')
        self.warned(self.hyco('check', '-scene', 'scene', '-fixed_top_y', '0*press'), 'load')

    def test_wide(self):
        """A stiffness over more than a decade: a warning, and training's own points follow its logarithm; not of a length, or of a load."""
        text = SCENE.replace(', map: {y: y*lower}', '').replace('idle: {range: [0, 1]}', 'idle: {range: [1, 1e5]}').replace('young: 100', 'young: idle', 1)
        found = self.hyco('check', '-scene', self.scene(text=text, upper=4))
        self.assertEqual(found['wide_ranges'], ['idle'])
        self.warned(found, 'idle', 'logarithm')
        self.hyco('solve', '-scene', 'scene', '-scatter', '40', '-table', 'wide.csv')
        with open(self.path('wide.csv'), newline='', encoding='ascii') as f:
            values = sorted(float(row['idle']) for row in csv.DictReader(f))
        self.assertTrue(100 < values[len(values) // 2] < 1000, values)
        self.assertEqual((values[0], values[-1]), (1, 1e5))

    def test_large_surface(self):
        """A body with more nodes on its surface than a model of bodies takes: check says so in the words in which training refuses."""
        n = 3100
        nodes = [(i / 10, y, 0) for y in (0, 0.1) for i in range(n + 1)]
        cells = [(3, 1, (i, i + 1, n + 2 + i, n + 1 + i)) for i in range(1, n + 1)]
        edges = [(1, tag, (first + i, first + i + 1)) for tag, first in ((2, 1), (3, n + 2)) for i in range(n)]
        msh(self.path('long.msh'), nodes, cells + edges, {1: (2, 'strip'), 2: (1, 'under'), 3: (1, 'top')})
        with open(self.path('long.yaml'), 'w', encoding='ascii') as f:
            f.write('scene: {mesh: long.msh, parameters: [press]}\nparameter: {press: {range: [1e-3, 1e-2]}}\nbody: {strip: {young: 100}}\n'
                    'fixed: {top: {x: 0, y: -press}}\ncontact: {floor: {group: under, gap: 0}}\n')
        said = self.hyco('check', '-scene', 'long.yaml')['estimate']['bodies_refused']
        run = self.run_raw('train', '-scene', 'long.yaml', '-values_press', '1e-3,1e-2', '-hyco_model_type', 'bodies', '-model', 'long.h5')
        self.assertEqual(run.returncode, 1)
        self.assertIn(said, run.stderr)

    def test_facing(self):
        """If a map moves a body away, no slave node faces the master: at all points, or at some."""
        text = SCENE.replace('{young: 100, poisson: 0.3}', '{young: 100, poisson: 0.3, map: {x: x + 8*idle}}').replace(
            ', map: {y: y*lower}', '').replace(', gap: 0.02', '')
        found = self.hyco('check', '-scene', self.scene(text=text, upper=4))
        self.assertEqual((found['contacts'][0]['n_facing_min'], found['contacts'][0]['n_facing_max']), (0, 5))
        self.assertEqual(found['warnings'], [])
        found = self.hyco('check', '-scene', self.scene(text=text.replace('[0, 1]', '[0.5, 1]'), upper=4))
        self.warned(found, 'under', 'never faces')

    def test_floating(self):
        """Motions that only contact prevents are listed, and unconstrained ones are solve's error."""
        blocks = os.path.join(EXAMPLES, 'hertz')
        free = self.path('floating.yaml')
        with open(os.path.join(blocks, 'scene.yaml'), encoding='utf-8') as f:
            text = f.read()
        text = text.replace('mesh: hertz.msh', f'mesh: {blocks}/hertz.msh').replace('  upper_top: {y: -press}', '#')
        text = text.replace('\nfixed:', '\npressure: {upper_top: press}\nfixed:')
        with open(free, 'w', encoding='utf-8') as f:
            f.write(text)
        found = self.hyco('check', '-scene', free)
        self.assertEqual(len(found['free_motions']), 1)
        self.assertIn('upper', found['free_motions'][0])
        self.assertIn('(0, 1, 0)', found['free_motions'][0])
        self.warned(found, 'only by contact')
        self.warned(found, 'so can reduced models')
        with open(free, 'w', encoding='utf-8') as f:
            f.write(text.replace('  upper_sym: {x: 0}', '#'))
        for ranks in (0, 2):
            runs = [self.run_raw(command, '-scene', free, *more, ranks=ranks) for command, *more in (('check',), ('solve', '-mu', '0.05,1,10'))]
            for run in runs:
                self.assertEqual(run.returncode, 1, run.stdout)
                self.assertEqual(run.stderr.count('hyco: error'), 1, run.stderr)
                self.assertIn('body upper', run.stderr)
            self.assertIn('press = ', runs[0].stderr)
        found = self.hyco('check', '-scene', free, '-hyco_regularise', '-pressure_upper_top', '0')
        self.assertIn('body upper', found['regularised'])

    def test_refused(self):
        """Refusals of solve: on every number of ranks, with the point."""
        scene = self.scene(text=SCENE.replace('y*lower', 'y - 30*press*x*y'))
        for ranks in (0, 2):
            run = self.run_raw('check', '-scene', scene, '-report', 'none.json', ranks=ranks)
            self.assertEqual(run.returncode, 1, run.stdout)
            self.assertEqual(run.stderr.count('hyco: error'), 1, run.stderr)
            self.assertIn('press = 0.05', run.stderr)
            self.assertFalse(os.path.exists(self.path('none.json')))
        self.assertEqual(self.run_raw('check', '-scene', self.scene(), '-fixed_nowhere_x', '0').returncode, 1)
        run = self.run_raw('check', '-scene', self.scene(), '-hyco_rid_groups', 'nowhere')
        self.assertEqual(run.returncode, 1, run.stdout)
        run = self.run_raw('check', '-scene', self.scene(), '-mu', '1,2')
        self.assertIn('-mu', run.stderr)

    def test_history(self):
        """A history: what its time and tables affect, gaps at its ends, no training; a parameter of a law that does not affect the
        stiffness."""
        ring = os.path.join(EXAMPLES, 'ring')
        for ranks in (0, 2):
            found = self.hyco('check', '-scene', ring, ranks=ranks)
            self.assertEqual(found['parameters'], {'interference': ['gaps'], 'creep': ['laws'], 't': []})
            self.assertEqual(found['n_times'], 16)
            self.assertNotIn('n_training', found['estimate'])
            self.assertEqual(found['unused_groups'], ['ring_outside'])
        self.assertEqual(self.hyco('check', '-scene', ring, '-output_out_mean', 'u_x', '-output_out_group', 'ring_outside')['unused_groups'], [])
        self.assertEqual(self.hyco('check', '-scene', os.path.join(EXAMPLES, 'lapjoint'))['parameters']['mu'], ['friction'])
        self.near(found['contacts'][0]['gap_min'], -0.02, 1e-12)
        found = self.hyco('check', '-scene', ring, '-history_times', '0,1,2', '-history_tables_q', '0 0,2 1', '-contact_fit_gap',
                          '0.1*q - interference', '-check_solve')
        self.assertEqual(found['parameters']['q'], ['gaps'])
        self.near(found['contacts'][0]['gap_max'], 0.095, 1e-12)
        self.assertTrue(found['estimate']['measured'])
        run = self.run_raw('check', '-scene', ring, '-history_times', '0,1,2', '-history_tables_q', '0 0,2 1', '-body_core_young', '1 - q')
        self.assertEqual(run.returncode, 1, run.stdout)
        self.assertIn('t = 2', run.stderr)

    def test_view(self):
        """hyco view of a scene whose mesh or group is missing fails, and names it."""
        self.assertEqual(self.run_raw('view', '-scene', self.scene()).returncode, 0)
        for option, word in (('-scene_mesh', 'nowhere.msh'), ('-fixed_nowhere_x', 'nowhere'), ('-contact_under_slave', 'elsewhere'),
                             ('-body_third_young', 'third')):
            for ranks in (0, 2):
                run = self.run_raw('view', '-scene', 'scene', option, '1' if option.endswith(('_x', '_young')) else word, ranks=ranks)
                self.assertEqual(run.returncode, 1, run.stdout)
                self.assertEqual(run.stderr.count('hyco: error'), 1, run.stderr)
                self.assertIn(word, run.stderr)
        shutil.rmtree(self.path('scene'))


if __name__ == '__main__':
    unittest.main()
