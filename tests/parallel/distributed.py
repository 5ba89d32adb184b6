"""Nothing of the mesh's size on one rank: floating bodies, surfaces that do not match or that a map moves, on 1 to 4 ranks; memory."""
import os
import re
import unittest

import h5py
import numpy as np

from common import PELLET, SOURCE, Case, msh

EXAMPLES = os.path.join(SOURCE, 'examples')
RANKS = (2, 3, 4)
STACK = """
scene: {title: stack, mesh: stack.msh, parameters: [press]}
parameter: {press: {range: [0, 1]}}
body: {low: {young: 100, poisson: 0.3}, middle: {young: 80, poisson: 0.2}, high: {young: 120, poisson: 0.3}}
fixed: {low_foot: {x: 0, y: 0}, high_head: {x: 0, y: -0.01*press}, high_side: {x: 0}, middle_side: {x: 0}}
contact:
  first: {type: surface, slave: middle_foot, master: low_head, tolerance: 0.01}
  second: {type: pair, slave: high_foot, master: middle_head, tolerance: 0.01}
"""


def datasets(path):
    """All numbers of a file, by name."""
    found = {}
    with h5py.File(path) as file:
        file.visititems(lambda name, item: found.update({name: item[:]}) if isinstance(item, h5py.Dataset) else None)
    return found


class Distributed(Case):
    def same(self, scene, mu, *more, tolerance=1e-9, numbers=RANKS):
        """Report and fields on several ranks are those of one."""
        one = self.hyco('solve', '-scene', scene, '-mu', mu, '-output', 'one.xdmf', *more)
        right = datasets(self.path('one.h5'))
        for ranks in numbers:
            with self.subTest(scene=scene, ranks=ranks):
                r = self.hyco('solve', '-scene', scene, '-mu', mu, '-output', 'many.xdmf', *more, ranks=ranks)
                self.solved(r)
                for key in ('n_dof', 'n_contacts', 'n_active', 'regularised'):
                    self.assertEqual(r[key], one[key], key)
                for key in ('total_contact_force', 'strain_energy', 'u_norm2'):
                    self.near(r[key], one[key], tolerance, key)
                found = datasets(self.path('many.h5'))
                self.assertEqual(sorted(found), sorted(right))
                for name, value in right.items():
                    if value.dtype.kind == 'f':  # a closed gap is round-off of the displacement
                        size = np.abs(right['nodes/displacement'] if 'gap' in name else np.nan_to_num(value)).max()
                        np.testing.assert_array_equal(np.isnan(found[name]), np.isnan(value), name)
                        self.assertLessEqual(np.nan_to_num(np.abs(found[name] - value)).max(), tolerance * size, name)
                    else:
                        self.assertTrue(np.array_equal(found[name], value), name)
        return one

    def stack(self, lift=0.0):
        """Three blocks on one another; only contact supports the middle one; its foot and the surface below do not match. lift: of its foot's
        left half, as drawn."""
        nodes, elements, names = [], [], {}
        for body, (name, n) in enumerate((('low', 7), ('middle', 10), ('high', 10))):
            first, wide = len(nodes) + 1, n + 1
            nodes += [(i / n, body + j / n + lift * (body == 1 and j == 0 and 2 * i < n), 0) for j in range(wide) for i in range(wide)]
            at = lambda i, j, first=first, wide=wide: first + i + wide * j
            elements += [(3, 1 + body, (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1))) for j in range(n) for i in range(n)]
            elements += [(1, 11 + body, (at(i, 0), at(i + 1, 0))) for i in range(n)]
            elements += [(1, 21 + body, (at(i, n), at(i + 1, n))) for i in range(n)]
            elements += [(1, 31 + body, (at(0, j), at(0, j + 1))) for j in range(n)]
            names.update({1 + body: (2, name), 11 + body: (1, name + '_foot'), 21 + body: (1, name + '_head'), 31 + body: (1, name + '_side')})
        msh(self.path('stack.msh'), nodes, elements, names)
        with open(self.path('stack.yaml'), 'w', encoding='ascii') as file:
            file.write(STACK)
        return self.path('stack.yaml')

    def test_floating(self):
        """Floating bodies: equal results, memory divided."""
        r = self.same(self.stack(), 1)
        self.assertGreater(r['n_active'], 0)

    def test_refined(self):
        """Contacts are found after the distribution."""
        self.same(self.stack(), 1, '-scene_refine', 1)

    def test_without_nodes(self):
        """A rank that owns no node, here of two: all nodes of its pyramids and tetrahedra are the other's. Fields in both formats."""
        nodes = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1), (2, 1, 0), (2, 0, 0), (1.5, 0.5, 0.5), (2, 0, 1),
                 (2, 1, 1)]
        pyramids = ((2, 10, 9, 3, 11), (2, 3, 7, 6, 11), (10, 12, 13, 9, 11), (9, 13, 7, 3, 11))
        tetrahedra = ((2, 12, 10, 11), (2, 6, 12, 11), (6, 13, 12, 11), (6, 7, 13, 11))
        elements = [(5, 1, (1, 2, 3, 4, 5, 6, 7, 8)), *((7, 1, c) for c in pyramids), *((4, 1, c) for c in tetrahedra), (3, 2, (1, 2, 6, 5)),
                    (2, 2, (2, 10, 12)), (2, 2, (2, 12, 6))]
        msh(self.path('few.msh'), nodes, elements, {1: (3, 'b'), 2: (2, 'base')})
        scene = self.written('scene: {mesh: few.msh, parameters: [q]}\nparameter: {q: {range: [0, 2]}}\nbody: {b: {young: 1000, poisson: 0.3}}\n'
                             'fixed: {base: {x: 0, y: 0, z: 0}}\nforce: {b: {y: q}}')
        self.same(scene, 1, numbers=(2,))
        self.hyco('solve', '-scene', scene, '-mu', 1, '-output', 'few.vtkhdf', ranks=2)

    def test_without_cells(self):
        """Two cells in contact on four ranks, two of which have none: the fields of the refined scene; a training, its prediction."""
        corners = lambda y: [(0, y, 0), (1, y, 0), (1, y + 1, 0), (0, y + 1, 0)]
        msh(self.path('two.msh'), corners(0) + corners(1), [(3, 1, (1, 2, 3, 4)), (3, 2, (5, 6, 7, 8)), (1, 3, (1, 2)), (1, 4, (3, 4)), (1, 5, (5, 6)),
                                                            (1, 6, (7, 8))],
            {1: (2, 'a'), 2: (2, 'b'), 3: (1, 'foot'), 4: (1, 'seat'), 5: (1, 'sole'), 6: (1, 'head')})
        scene = self.written('scene: {mesh: two.msh, parameters: [E, q]}\nparameter: {E: {range: [1, 3]}, q: {range: [0, 0.1]}}\nbody: {a: {young: E}, b: '
                             '{young: 2, poisson: 0.3}}\nfixed: {foot: {x: 0, y: 0}, head: {x: 0, y: -q}}\ncontact: {c: {type: mortar, slave: sole, '
                             'master: seat}}\noutput: {peak: {max: mises}}')
        self.same(scene, '2,0.1', '-scene_refine', 1, numbers=(4,))
        found = []
        for ranks in (0, 4):
            self.hyco('train', '-scene', scene, '-grid', '3,2', '-model', f'{ranks}.h5', '-hyco_model_type', 'hybrid', '-hyco_rid_layers', 1, ranks=ranks)
            found.append(self.hyco('predict', '-model', f'{ranks}.h5', '-mu', '2,0.1', ranks=ranks))
        self.near(found[1]['total_contact_force'], found[0]['total_contact_force'], 1e-9)
        self.near(found[1]['outputs']['peak'], found[0]['outputs']['peak'], 1e-9)

    def test_search(self):
        """Each rank searches for the masters of the slaves that it owns, as drawn and once more where a map has them, on a part of the master; the
        partition follows the bodies' volume, so that shares of a small contact differ."""
        for scene, mu, searches in (('roller3d', '1.3,0.5,12', 2), ('hertz', '0.05,1,10', 2), ('blocks', '0.05,0.05', 1)):
            with self.subTest(scene=scene):
                run = self.run_raw('solve', '-scene', os.path.join(EXAMPLES, scene, 'scene.yaml'), '-mu', mu, '-scene_refine', 1, '-hyco_fom_view', ranks=4)
                self.assertEqual(run.returncode, 0, run.stderr)
                contacts = int(re.search(r'(\d+) contacts', run.stdout)[1])
                most, total, patches, whole = map(int, re.search(r'at most (\d+) of (\d+) searches for a master, on (\d+) of (\d+) patches', run.stdout).groups())
                self.assertEqual(total, searches * contacts)
                self.assertLess(most, 0.7 * total)
                self.assertLess(patches, 0.9 * whole)

    def test_missed(self):
        """Slave nodes beyond the stated tolerance have no master, which other ranks have searched for: the same nodes on any number of ranks (the
        lifted half has 5, and the middles of the 5 edges at them, of 21), and the same forces on the others."""
        found = []
        for ranks in (0, 2, 3, 4):
            report = self.hyco('solve', '-scene', self.stack(0.05), '-mu', 1, '-scene_refine', 1, ranks=ranks)
            found.append((report['n_contacts'], report['n_active']))
            if ranks:
                self.near(report['total_contact_force'], force, 1e-9)
            force = report['total_contact_force']
        self.assertEqual(found[1:], found[:1] * 3)

    def test_moved(self):
        """Moved bodies in 2D: equal results, memory divided."""
        self.same(os.path.join(EXAMPLES, 'roller', 'scene.yaml'), '2.3,0.6,12')

    def test_not_matching_3d(self):
        """Surfaces in 3D that do not match: equal results, memory divided."""
        self.same(os.path.join(EXAMPLES, 'roller3d', 'scene.yaml'), '1.3,0.5,12')

    def test_whole_boundary(self):
        """Contact at every node, the rope: equal results, memory divided."""
        self.same(os.path.join(EXAMPLES, 'rope', 'scene.yaml'), '0.07,0.17')

    def test_free(self):
        """An unconstrained motion has the same name on all ranks."""
        with open(os.path.join(PELLET, 'scene.yaml'), encoding='utf-8') as file:
            text = file.read().replace('mesh: A.msh', 'mesh: ' + os.path.join(PELLET, 'A.msh'))
        text = text.replace('  sym_x0: {x: 0}\n', '  clad_outer_high: {x: 0, y: 0}\n').replace('  sym_y0: {y: 0}\n', '')
        with open(self.path('free.yaml'), 'w', encoding='utf-8') as file:
            file.write(text)
        said = []
        for ranks in (0, 2, 4):
            run = self.run_raw('solve', '-scene', self.path('free.yaml'), '-mu', '4.06,1', ranks=ranks)
            self.assertNotEqual(run.returncode, 0)
            said.append(next(line for line in run.stderr.splitlines() if 'error: ' in line))
        self.assertIn('body pellet from turning about (0, 0, 1) through (0, 0, ', said[0])
        self.assertEqual(said[1:], said[:1] * 2)

    def test_folded(self):
        """A map that mirrors a part of a body is refused, however the mesh is partitioned."""
        scene = self.stack()
        with open(scene, encoding='ascii') as file:
            text = file.read().replace('low: {young: 100, poisson: 0.3}', "low: {young: 100, poisson: 0.3, map: {x: '(x - 0.5)^2'}}")
        with open(scene, 'w', encoding='ascii') as file:
            file.write(text)
        for ranks in (0, 2, 4):
            run = self.run_raw('solve', '-scene', scene, '-mu', 1, ranks=ranks)
            self.assertNotEqual(run.returncode, 0)
            self.assertIn('body low: its map inverts', run.stderr)

    def test_snapshots(self):
        """The solutions that four ranks write together are those of one."""
        train = ('train', '-scene', os.path.join(EXAMPLES, 'roller', 'scene.yaml'), '-values_place', '-1,1', '-values_press', '0.5',
                 '-values_modulus', '10,15', '-hyco_groups', 1)
        for name, ranks in (('one', 0), ('four', 4)):
            self.run_raw(*train, '-model', name + '.h5', ranks=ranks, timeout=200)
        names = [sorted(f for f in os.listdir(self.path(n + '.h5.snapshots')) if f.endswith('.h5')) for n in ('one', 'four')]
        self.assertEqual(names[0], names[1])
        self.assertGreaterEqual(len(names[0]), 4)
        for name in names[0]:
            one, four = (datasets(self.path(n + '.h5.snapshots', name)) for n in ('one', 'four'))
            self.assertEqual(sorted(one), sorted(four))
            for key, value in one.items():
                self.assertLessEqual(np.abs(four[key] - value).max(), 1e-9 * np.abs(value).max(), key)

    def test_memory(self):
        """PETSc's peak memory: on no rank of four much more than on the others (with the whole mesh on rank 0, 1.14 of the mean; 1.10 with some
        versions of the libraries), and
        together not much more than on one."""
        most = {}
        for ranks in (1, 4):
            run = self.run_raw('solve', '-scene', os.path.join(PELLET, 'scene.yaml'), '-scene_refine', 1, '-mu', '4.06,1', '-output',
                               'memory.xdmf', '-malloc_dump', '-memory_view', ranks=ranks, timeout=200)
            self.assertEqual(run.returncode, 0, run.stderr)
            found = re.search(r'Maximum .* space PetscMalloc\(\)ed: *total *(\S+) *max *(\S+) *min', run.stdout)
            most[ranks] = [float(v) for v in found.groups()]
        self.assertLess(most[4][1], 1.12 * most[4][0] / 4)
        self.assertLess(most[4][0], 1.4 * most[1][0])


if __name__ == '__main__':
    unittest.main()
