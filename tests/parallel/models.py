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


if __name__ == '__main__':
    unittest.main()
