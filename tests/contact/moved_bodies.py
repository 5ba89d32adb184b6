"""Contact where a map has moved the bodies: the same results as on a mesh drawn there, full order and reduced; nodes that face no master have no
contact; displacements that are not small are reported or refused."""
import os
import unittest

import h5py
import numpy as np

from common import Case
from roller import mesh, scene

POINT = '0.5,10'  # press, modulus


class Moved(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        mesh(cls.path('m.msh'))
        scene(cls.path('moved.yaml'), 'm.msh')
        mesh(cls.path('three.msh'), dim=3, n=20, m=12, half=10)
        scene(cls.path('three.yaml'), 'three.msh', dim=3)

    def solve(self, yaml, place, *more, **options):
        r = self.hyco('solve', '-scene', self.path(yaml), '-mu', f'{place},{POINT}', *more, **options)
        self.solved(r)
        return r

    def centre(self, name):
        """Where the contact presses, from the fields: the slave nodes' mean x, weighted by their vertical force."""
        with h5py.File(self.path(name)) as f:
            x, force = f['mesh/xyz'][:], f['nodes/contact_force'][:]
        down = np.maximum(force[:, 1], 0)
        return (x[:, 0] * down).sum() / down.sum()


class FullOrder(Moved):
    def test_place(self):
        """The force is that of the mesh drawn at the position, to the last digits; the pressure is under the cylinder."""
        for dim, places, options in ((2, (-4, 3.3, 8), {}), (3, (4, 1.7), {'n': 20, 'm': 12, 'half': 10})):
            for swap in (False, True):
                scene(self.path('s.yaml'), 'three.msh' if dim == 3 else 'm.msh', dim, swap=swap)
                for place in places:
                    with self.subTest(dim=dim, swap=swap, place=place):
                        mesh(self.path('drawn.msh'), dim, at=place, **options)
                        scene(self.path('drawn.yaml'), 'drawn.msh', dim, moved=False, swap=swap)
                        moved = self.solve('s.yaml', place, '-output', 'moved.xdmf')
                        drawn = self.solve('drawn.yaml', place, '-output', 'drawn.xdmf')
                        for name in ('total_contact_force', 'lambda_max', 'strain_energy', 'u_norm2'):
                            self.near(moved[name], drawn[name], 1e-9, name)
                        self.near(self.centre('moved.h5'), self.centre('drawn.h5'), 1e-8)
                        self.assertLess(abs(self.centre('moved.h5') - place), 0.5)

    def test_bonded(self):
        """A cylinder of two bodies that share nodes and have the same map is the cylinder of one body; with different maps they are refused,
        with both names."""
        mesh(self.path('bonded.msh'), bonded=True)
        scene(self.path('bonded.yaml'), 'bonded.msh')
        with open(self.path('bonded.yaml'), encoding='ascii') as file:
            whole = file.read()
        core = '  core: {young: 100, poisson: 0.3, map: {x: x + %s}}\nfixed:'
        with open(self.path('bonded.yaml'), 'w', encoding='ascii') as file:
            file.write(whole.replace('fixed:', core % 'place'))
        one, two = (self.solve(name, 3.3) for name in ('moved.yaml', 'bonded.yaml'))
        for name in ('total_contact_force', 'lambda_max', 'strain_energy', 'u_norm2'):
            self.near(two[name], one[name], 1e-10, name)
        with open(self.path('bonded.yaml'), 'w', encoding='ascii') as file:
            file.write(whole.replace('fixed:', core % '2*place'))
        run = self.run_raw('solve', '-scene', self.path('bonded.yaml'), '-mu', f'3.3,{POINT}')
        self.assertEqual(run.returncode, 1)
        for word in ('cylinder', 'core', 'different maps'):
            self.assertIn(word, run.stderr)

    def test_either_slave(self):
        """Whichever side is the slave, wherever the cylinder is: the same force."""
        scene(self.path('swap.yaml'), 'm.msh', swap=True)
        for place in (0, 4):
            self.near(self.solve('swap.yaml', place)['total_contact_force'], self.solve('moved.yaml', place)['total_contact_force'], 0.02)

    def test_constant_map(self):
        """A map without a parameter moves the contact too."""
        scene(self.path('by2.yaml'), 'm.msh', extra=' + 2 - place')
        self.near(self.solve('by2.yaml', 0)['total_contact_force'], self.solve('moved.yaml', 2)['total_contact_force'], 1e-12)

    def test_ranks(self):
        """Full order on moved bodies on 2 to 4 ranks: the numbers of one."""
        for yaml in ('moved.yaml', 'three.yaml'):
            alone = self.solve(yaml, 2.3)
            for ranks in (2, 3, 4):
                r = self.solve(yaml, 2.3, ranks=ranks)
                for name in ('total_contact_force', 'strain_energy', 'sliding', 'u_norm2'):
                    self.near(r[name], alone[name], 1e-9, f'{name} on {ranks} ranks')
                self.assertEqual((r['n_active'], r['n_facing']), (alone['n_active'], alone['n_facing']))

    def test_set_of_places(self):
        """Solved one after the other as a set, each equals the single solution: no data of the last position remain."""
        self.hyco('solve', '-scene', self.path('moved.yaml'), '-values_place', '-5,3.3,0.1', '-values_press', '0.5', '-values_modulus', '10',
                  '-table', 't.csv')
        with open(self.path('t.csv'), encoding='ascii') as file:
            rows = [line.split(',') for line in file.read().split()[1:]]
        for row in rows:
            self.near(float(row[3]), self.solve('moved.yaml', row[0])['total_contact_force'], 1e-7)

    def test_forms(self):
        """The primal form takes a pivot per contact: also where contacts come and go."""
        args = ('-values_place', '-8,8,3', '-values_press', '0.5', '-values_modulus', '10')
        forces = []
        for form in ('dual', 'primal'):
            self.hyco('solve', '-scene', self.path('moved.yaml'), *args, '-hyco_solver_form', form, '-table', 't.csv')
            with open(self.path('t.csv'), encoding='ascii') as file:
                forces.append([float(line.split(',')[3]) for line in file.read().split()[1:]])
        for a, b in zip(*forces, strict=True):
            self.near(a, b, 1e-7)

    def test_past_the_border(self):
        """Slave nodes beside the block have no contact; without any the scene is solved, and that is said."""
        scene(self.path('wide.yaml'), 'm.msh', lo=-60, hi=60)
        half = self.solve('wide.yaml', 12)
        self.assertLess(half['n_facing'], half['n_contacts'])
        self.assertGreater(half['total_contact_force'], 0)
        run = self.run_raw('solve', '-scene', 'wide.yaml', '-mu', f'50,{POINT}', '-report', 'r.json')
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertIn('NO CONTACT: no slave node faces a master', run.stdout)
        none = self.solve('wide.yaml', 50)
        self.assertEqual((none['n_facing'], none['n_active'], none['total_contact_force']), (0, 0, 0))

    def test_sliding(self):
        """Less than a facet at a press; a cylinder that is pushed along by two facets is not small sliding."""
        self.assertLess(self.solve('moved.yaml', 1)['sliding'], 0.5)
        self.assertNotIn('LARGE SLIDING', self.run_raw('solve', '-scene', 'moved.yaml', '-mu', f'1,{POINT}').stdout)
        scene(self.path('push.yaml'), 'm.msh', push='1.1')
        run = self.run_raw('solve', '-scene', 'push.yaml', '-mu', f'1,{POINT}', '-report', 'r.json')
        self.assertIn('LARGE SLIDING: a closed contact moves by 2.', run.stdout)

    def test_sliding_of_points(self):
        """Training, also from stored solutions, and comparison name the largest sliding of their points, if it is large."""
        scene(self.path('pushed.yaml'), 'm.msh', push='2.2*press')
        points = ('-values_place', 1, '-values_press', '0.3,0.5', '-values_modulus', 10)
        train = ('train', *points, '-model', 'p.h5', '-hyco_model_type', 'projection', '-hyco_dual', 'snapshots', '-hyco_validation', 0)
        for command, ranks in ((train, 2), (train, 0), (('compare', *points, '-model', 'p.h5'), 2)):
            run = self.run_raw(command[0], '-scene', 'pushed.yaml', *command[1:], ranks=ranks)
            self.assertEqual(run.returncode, 0, run.stderr)
            self.assertEqual(run.stdout.count('LARGE SLIDING: a closed contact moves by 2.'), 1, run.stdout)
        run = self.run_raw('compare', '-scene', 'pushed.yaml', '-model', 'p.h5', '-mu', '1,0.1,10')
        self.assertNotIn('LARGE SLIDING', run.stdout)

    def test_sliding_path(self):
        """A cylinder that is pushed along and then lifted: the path has slid, although no contact is closed at its end."""
        scene(self.path('lift.yaml'), 'm.msh', moved=False, push='1.1*q')
        with open(self.path('lift.yaml'), encoding='ascii') as file:
            text = file.read().replace('-press', '-press*(2*q - 1)')
        with open(self.path('lift.yaml'), 'w', encoding='ascii') as file:
            file.write(text + 'history: {times: [0, 1, 2], tables: {q: [[0, 0.5], [1, 1], [2, 0]]}}\n')
        run = self.run_raw('solve', '-scene', 'lift.yaml', '-mu', f'1,{POINT}', '-report', 'r.json', '-table', 't.csv')
        with open(self.path('t.csv'), encoding='ascii') as file:
            head, *rows = (line.strip().split(',') for line in file)
        slid = [float(row[head.index('sliding')]) for row in rows]
        self.assertEqual(float(rows[-1][head.index('n_active')]), 0)
        self.assertEqual(slid[-1], 0)
        self.assertGreater(max(slid), 2)
        self.assertIn('LARGE SLIDING: a closed contact moves by 2.', run.stdout)


class Reduced(Moved):
    TRAIN = ('-values_place', '-3,0.2,2.6', '-values_press', '0.3,0.9', '-values_modulus', '10')

    def test_exact(self):
        """All elements, all modes: the training solutions, whatever the contact meets there."""
        for yaml, train in (('moved.yaml', self.TRAIN), ('three.yaml', ('-values_place', '-2,1.3', '-values_press', '0.3,0.6', '-values_modulus', '10'))):
            with self.subTest(yaml=yaml):
                self.hyco('train', '-scene', yaml, *train, '-model', 'all.h5', '-hyco_rid_whole', 'true', '-hyco_pod_tol', '1e-18')
                c = self.hyco('compare', '-scene', yaml, '-model', 'all.h5', *train)
                for name in ('error_u', 'error_lambda', 'error_sigma'):
                    self.assertLess(c[name]['max'], 1e-8, name)

    def test_unseen_place(self):
        """An RID around the contact, trained a millimetre apart: between them the pressure is where the cylinder is."""
        places = ','.join(str(k - 4.5) for k in range(10))
        self.hyco('train', '-scene', 'moved.yaml', '-values_place', places, '-values_press', '0.3,0.5,0.7,0.9', '-values_modulus', '10',
                  '-model', 'm.h5', '-hyco_rid_contact_extension', '2', '-hyco_rid_layers', '2', '-hyco_pod_tol', '1e-10')
        for place in (-4, 0.1, 3.2, 4.9):
            p = self.hyco('predict', '-model', 'm.h5', '-mu', f'{place},0.6,10', '-output', 'predicted.xdmf')
            r = self.hyco('solve', '-scene', 'moved.yaml', '-mu', f'{place},0.6,10', '-output', 'solved.xdmf')
            self.near(p['total_contact_force'], r['total_contact_force'], 0.01, f'force at {place}')
            self.assertLess(abs(self.centre('predicted.h5') - self.centre('solved.h5')), 0.05)
            self.near(p['sliding'], r['sliding'], 0.2, 'sliding')
        c = self.hyco('compare', '-scene', 'moved.yaml', '-model', 'm.h5', '-values_place', '-4,0.1,3.2', '-values_press', '0.6', '-values_modulus', '10')
        self.assertLess(c['error_u']['max'], 0.005)
        self.assertLess(c['error_lambda']['max'], 0.06)
        # many at once are one by one
        self.hyco('predict', '-model', 'm.h5', '-values_place', '3.2,-4,0.1', '-values_press', '0.6,0.4', '-values_modulus', '10', '-table', 'p.csv')
        with open(self.path('p.csv'), encoding='ascii') as file:
            rows = [line.split(',') for line in file.read().split()[1:]]
        for row in rows:
            self.near(float(row[3]), self.hyco('predict', '-model', 'm.h5', '-mu', ','.join(row[:3]))['total_contact_force'], 1e-7)

    def test_types(self):
        """A projection-based model of these bodies reproduces its training solutions."""
        self.hyco('train', '-scene', 'moved.yaml', *self.TRAIN, '-model', 'p.h5', '-hyco_model_type', 'projection', '-hyco_dual', 'snapshots', '-hyco_pod_tol', '1e-18')
        c = self.hyco('compare', '-scene', 'moved.yaml', '-model', 'p.h5', *self.TRAIN)
        self.assertLess(c['error_u']['max'], 1e-6)

    def test_older_model(self):
        """A model from before the search loads, with its masters; damage to the data of the search is detected."""
        self.hyco('train', '-scene', 'moved.yaml', *self.TRAIN, '-model', 'old.h5', '-hyco_rid_whole', 'true')
        with h5py.File(self.path('old.h5'), 'r+') as f:
            self.assertEqual(f['format'][0, 0], 5)
            del f['problem/reach'], f['sealed']
            f['format'][...] = 4
        self.assertEqual(self.run_raw('view', '-model', 'old.h5').returncode, 0)
        self.hyco('train', '-scene', 'moved.yaml', *self.TRAIN, '-model', 'old.h5', '-hyco_rid_whole', 'true')
        with h5py.File(self.path('old.h5'), 'r+') as f:
            f['problem/reach'][...] = -1
            del f['sealed']
        self.assertIn('problem/reach is damaged', self.run_raw('view', '-model', 'old.h5').stderr)

    def test_greedy_on_ranks(self):
        """The greedy loop chooses the same solutions on one rank and on three."""
        chosen = []
        for ranks in (0, 3):
            self.hyco('train', '-scene', 'moved.yaml', '-greedy', '-training_grid', '4,2,2', '-max_snapshots', '10', '-model', f'g{ranks}.h5', '-hyco_pod_tol', '1e-12',
                      '-hyco_rid_contact_extension', '2', '-hyco_rid_layers', '2', ranks=ranks)
            chosen.append(self.hyco('predict', '-model', f'g{ranks}.h5', '-mu', '1.1,0.7,10')['total_contact_force'])
        self.near(chosen[1], chosen[0], 1e-8)


if __name__ == '__main__':
    unittest.main()
