"""Every type of model, trained on 1, 2, 3 and 4 ranks, predicts the same displacements, stresses and forces to 1e-9: each type and each scene
on each number of ranks; with HYCO_LONG each type of each scene on each of them."""
import os
import unittest

import h5py

from common import PELLET, ROPE, SOURCE, Case

BLOCKS = os.path.join(SOURCE, 'examples', 'blocks')
TYPES = ('hybrid', 'projection', 'bodies')
SCENES = ('pellet', 'rope', 'blocks')
FIELDS = ('nodes/displacement', 'cells/stress', 'contact/lambda')
# Two blocks whose meshes do not match; the lower one, the master, is the finer one: rows of mortars have more masters than a facet has nodes.
DRAWING = {3: """SetFactory("OpenCASCADE");
Box(1) = {0,0,0, 2,1,1}; Box(2) = {.1,0,1, 1.7,1,.5};
Physical Volume("low") = {1}; Physical Volume("high") = {2};
Physical Surface("base") = {5}; Physical Surface("low_top") = {6}; Physical Surface("under") = {11}; Physical Surface("top") = {12}; Physical Surface("end") = {8};
Transfinite Curve {1:12} = 4; Transfinite Curve {13:24} = 3; Transfinite Surface {:}; Recombine Surface {:}; Transfinite Volume {:};
""", 2: """SetFactory("OpenCASCADE");
Rectangle(1) = {0,0,0, 2,1}; Rectangle(2) = {.1,1,0, 1.7,.5};
Physical Surface("low") = {1}; Physical Surface("high") = {2};
Physical Curve("base") = {1}; Physical Curve("low_top") = {3}; Physical Curve("under") = {5}; Physical Curve("top") = {7}; Physical Curve("end") = {6};
Transfinite Curve {1:4} = 9; Transfinite Curve {5:8} = 4; Transfinite Surface {:}; Recombine Surface {:};
"""}
SCENE = """
scene: {mesh: %(mesh)s.msh, parameters: [press, push]}
parameter: {press: {range: [1, 2]}, push: {range: [-0.01, 0.01]}}
body: {low: {young: 1000, poisson: 0.3}, high: {young: 800, poisson: 0.3}}
fixed: {base: {x: 0, y: 0%(z)s}, end: {x: push, y: 0%(z)s}}
pressure: {top: press}
contact: {c: {type: %(type)s, slave: under, master: low_top}}
"""


class Models(Case):
    def fields(self, tag, scene, mu, words, ranks, snapshots):
        model = f'{tag}{ranks}.h5'
        self.hyco('train', '-scene', scene, *words, '-model', model, '-hyco_snapshots', f'{snapshots or tag}{ranks}.snapshots', ranks=ranks)
        self.hyco('predict', '-model', model, '-mu', mu, '-output', 'out.xdmf')
        with h5py.File(self.path('out.h5')) as f:
            return {name: f[name][:] for name in FIELDS}

    def same(self, tag, scene, mu, *words, snapshots=None, others=(2, 3, 4)):
        """snapshots: the solutions, each number of ranks its own, are shared with other types of that name."""
        one = self.fields(tag, scene, mu, words, 1, snapshots)
        for ranks in others:
            for name, values in self.fields(tag, scene, mu, words, ranks, snapshots).items():
                self.assertLessEqual(abs(values - one[name]).max(), 1e-9 * abs(one[name]).max(), f'{tag} {ranks} {name}')

    def types(self, tag, scene, mu, *points):
        for k, kind in enumerate(TYPES):
            others = (2, 3, 4) if 'HYCO_LONG' in os.environ else (2 + (k + SCENES.index(tag)) % 3,)
            with self.subTest(kind=kind):
                self.same(f'{tag}_{kind}', scene, mu, '-hyco_model_type', kind, *points, snapshots=tag, others=others)

    def test_pellet(self):
        """Every type of model on the pellet."""
        self.types('pellet', PELLET, '4.07,0.9', '-values_radius', '4.02,4.06,4.1', '-values_load', '0.4,1')

    def test_pellet_from_nothing(self):
        """Where gap and load vanish together (radius 4.1, load 0) the sampled forces are round-off, which must not affect the following samples."""
        self.same('zero', PELLET, '4.07,0.9', '-hyco_model_type', 'bodies', '-values_radius', '4.02,4.06,4.1', '-values_load',
                  '0,0.25,0.5,0.75,1', others=(2, 3) if 'HYCO_LONG' in os.environ else (3,))

    def test_rope(self):
        """Every type of model on the rope."""
        self.types('rope', ROPE, '0.07,0.17', '-grid', '4,4')

    def test_blocks(self):
        """Every type of model on the blocks."""
        self.types('blocks', BLOCKS, '0.055,0.06', '-grid', '3,3')

    def test_contacts(self):
        """Contacts of each dimension and order between meshes that do not match, with masters finer than slaves: models of bodies and hybrid ones."""
        long = 'HYCO_LONG' in os.environ
        for dim, order, kind in ((3, 1, 'mortar'), (3, 2, 'mortar'), (2, 1, 'mortar'), (2, 2, 'mortar'), (2, 1, 'surface'), (3, 1, 'surface')):
            if not long and (dim, order, kind) != (3, 1, 'mortar'):
                continue
            name = f'd{dim}o{order}{kind}'
            self.drawn(name, dim, DRAWING[dim], SCENE % {'mesh': name, 'type': kind, 'z': ', z: 0' if dim == 3 else ''}, '-order', str(order))
            for model in ('bodies', 'hybrid'):
                with self.subTest(scene=name, model=model):
                    self.same(f'{name}_{model}', self.path(name), '1.3,0.004', '-hyco_model_type', model, '-grid', '2,2', '-hyco_validation', '0',
                              snapshots=name, others=(2, 3) if long else (2,))


if __name__ == '__main__':
    unittest.main()
