"""Maps that mirror bodies: outward normals are those of the moved cells, so that a scene and its mirror image have the same
forces."""
import os
import unittest

from common import PELLET, SOURCE, Case

EXAMPLES = os.path.join(SOURCE, 'examples')
BLOCKS = os.path.join(EXAMPLES, 'blocks')
PLATE = os.path.join(EXAMPLES, 'plate')
HERTZ = os.path.join(EXAMPLES, 'hertz')
TURNED = ('-body_block_map_x', ' -x', '-body_foundation_map_x', ' -x')
UPSIDE = ('-body_pellet_map_z', ' -z', '-body_cladding_map_z', ' -z')


class Orientation(Case):
    def force(self, *args, ranks=0):
        report = self.hyco(*args, ranks=ranks)
        self.solved(report)
        return report['total_contact_force']

    def test_normals_from_the_surface(self):
        """Averaged normals and measured gaps; pairs, and surfaces that do not match."""
        for scene in (('-scene', BLOCKS), ('-scene', BLOCKS, '-scene_mesh', os.path.join(BLOCKS, 'loose.msh'), '-contact_under_type',
                                           'surface')):
            drawn = self.force('solve', *scene, '-mu', '0.05,0.06')
            for ranks in (0, 2):
                self.near(self.force('solve', *scene, '-mu', '0.05,0.06', *TURNED, ranks=ranks), drawn, 1e-9)
        self.near(self.force('solve', '-scene', BLOCKS, '-mu', '0.05,0.06', *TURNED), 3115.574406, 1e-8)

    def test_swapped_axes(self):
        """x and y are exchanged: also a mirror image. The components of supports are exchanged too."""
        swapped = self.path('swapped.yaml')
        with open(os.path.join(BLOCKS, 'scene.yaml'), encoding='utf-8') as file:
            text = file.read().replace('blocks.msh', os.path.join(BLOCKS, 'blocks.msh'))
        for old, new in (('map: {y: "y + crown*(x/20)^2*(1 - y/16)"}', 'map: {x: "y + crown*(x/20)^2*(1 - y/16)", y: x}'),
                         ('foundation: {young: 1e5, poisson: 0.3}', 'foundation: {young: 1e5, poisson: 0.3, map: {x: y, y: x}}'),
                         ('block_sym: {x: 0}', 'block_sym: {y: 0}'), ('block_top: {y: -press}', 'block_top: {x: -press}'),
                         ('foundation_sym: {x: 0}', 'foundation_sym: {y: 0}'),
                         ('foundation_base: {y: 0}', 'foundation_base: {x: 0}')):
            self.assertIn(old, text)
            text = text.replace(old, new)
        with open(swapped, 'w', encoding='utf-8') as file:
            file.write(text)
        self.near(self.force('solve', '-scene', swapped, '-mu', '0.05,0.06'), 3115.574406, 1e-8)

    def test_pressures(self):
        """The pressure on a mirrored pellet at full order, on 1 and 2 ranks."""
        for ranks in (0, 2):
            self.near(self.force('solve', '-scene', PELLET, '-mu', '4.06,1', *UPSIDE, ranks=ranks), 1409.705324, 1e-8)

    def test_pressure_that_varies(self):
        """A pressure in x, y, z is integrated facet by facet."""
        for turned in ((), UPSIDE):
            self.near(self.force('solve', '-scene', PELLET, '-mu', '4.06,1', '-pressure_clad_outer_low', '250*load*(1 + 0*x)',
                                 *turned), 1409.705324, 1e-8)

    def test_reduced(self):
        """A model of the mirrored scene predicts what the model of the scene as drawn does."""
        for kind, mu in (('hybrid', '0.05,0.06'), ('projection', '0.05,0.06'), ('bodies', '0.05,0.06')):
            with self.subTest(kind=kind):
                found = []
                for turned in ((), TURNED):
                    model = self.path(f'{kind}{len(turned)}.h5')
                    self.hyco('train', '-scene', BLOCKS, '-model', model, '-values_crown', '0.02,0.05,0.08', '-values_press',
                              '0.02,0.05,0.08', '-hyco_model_type', kind, *turned)
                    report = self.hyco('predict', '-model', model, '-mu', mu)
                    self.assertGreater(report['total_contact_force'], 1000)
                    found.append(report['total_contact_force'])
                self.near(found[1], found[0], 1e-7)

    def test_pressures_reduced(self):
        """The pressure on a mirrored pellet in a reduced model."""
        found = []
        for turned in ((), UPSIDE):
            model = self.path(f'pellet{len(turned)}.h5')
            self.hyco('train', '-scene', PELLET, '-model', model, '-values_radius', '4.02,4.06,4.1', '-values_load', '0.5,1',
                      *turned)
            found.append(self.hyco('predict', '-model', model, '-mu', '4.05,1')['total_contact_force'])
        self.assertGreater(found[0], 1000)
        self.near(found[1], found[0], 1e-7)

    def test_hertz(self):
        """The contact of two mirrored cylinders."""
        drawn = self.force('solve', '-scene', HERTZ, '-mu', '0.06,1,10')
        turned = ('-body_upper_map_x', ' -x', '-body_lower_map_x', ' -x')
        self.near(self.force('solve', '-scene', HERTZ, '-mu', '0.06,1,10', *turned), drawn, 1e-9)

    def test_folded(self):
        """A map that turns a part of a body inside out is refused, and so is one that mirrors one of two bodies that share nodes."""
        for ranks in (0, 2):
            run = self.run_raw('solve', '-scene', BLOCKS, '-mu', '0.05,0.06', '-body_block_map_x', 'x < 10 ? x : 20 - x', ranks=ranks)
            self.assertNotEqual(run.returncode, 0)
            self.assertIn('body block', run.stderr)
            self.assertIn('inverts', run.stderr)
            run = self.run_raw('solve', '-scene', PLATE, '-mu', '1,0.5', '-body_ring_map_x', ' -x', ranks=ranks)
            self.assertNotEqual(run.returncode, 0)
            self.assertRegex(run.stderr, 'body|bodies')


if __name__ == '__main__':
    unittest.main()
