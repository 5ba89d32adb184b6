"""Reactions of models that follow from balance: with the contact forces and the loads of their bodies they sum to zero, as those of full order do; of
types other than bodies, if contact acts only between the bodies."""
import os
import subprocess
import sys
import unittest

import numpy as np

from common import SOURCE, Case

sys.path.insert(0, os.path.join(SOURCE, 'tests', 'verify'))
from grids import GMSH, Grid  # noqa: E402

# A seat on a foot that is tied to it, and a block pressed onto it; loads of every kind. The stiffness changes, so that a model of bodies interpolates
# its flexibility.
SCENE = """
scene: {mesh: mesh.msh, parameters: [press, load]MORE}
parameter: {press: {range: [0.02, 0.06]}, load: {range: [1, 3]}}
body: {foot: {young: 300, poisson: 0.3}, seat: {young: 300, poisson: 0.3, density: 0.5}, block: {young: 100*(1 + load), poisson: 0.3, density: 0.2}}
gravity: {UP: -load}
fixed: {base: {ACROSS, UP: 0}, top: {ACROSS, UP: -press}}
tie: {glue: {slave: below, master: bed}}
force: {corner: {UP: 0.3*load}, seat: {UP: -0.7*load*UP}}
traction: {side: {UP: load*(1 + UP)}}
pressure: {side: load}
contact: {joint: {type: TYPE, slave: under, master: over, gap: GAP}}
output: {hold: {reaction: UP, group: base}, push: {reaction: UP, group: top}, both: {reaction: UP}, carry: {force: UP, contact: joint}}
"""
# cells, entry of the scene, up, supports across, contact, gap, the area of a section, the loaded area per height
SPACES = {'plane': ('quad4', '', 'y', 'x: 0', 'pair', '0.04*x^2', 1, 1),
          'ring': ('quad4', ', formulation: axisymmetric', 'y', 'x: 0', 'surface', '0.04*(x - 1)^2', 3 * np.pi, 4 * np.pi),
          'space': ('hex8', '', 'z', 'x: 0, y: 0', 'surface', '0.04*x^2', 0.5, 0.5)}


class Balance(Case):
    @classmethod
    def scene(cls, space, changes=()):
        kind, more, up, across, contact, gap, _, _ = SPACES[space]
        first = 1 if space == 'ring' else 0
        x = [np.linspace(first, first + 1, 7)] + [np.linspace(0, 0.5, 3)] * (up == 'z')
        grid = Grid()
        grid.box(kind, [*x, np.linspace(-0.5, 0, 3)], lambda p: p, 'foot', {up + '0': 'base', up + '1': 'bed'})
        grid.box(kind, [*x, np.linspace(0, 1, 5)], lambda p: p, 'seat', {up + '0': 'below', up + '1': 'over', 'x1': 'side'})
        corner = len(grid.nodes)  # the last node of the seat
        grid.box(kind, [*x, np.linspace(1, 2, 5)], lambda p: p, 'block', {up + '0': 'under', up + '1': 'top'})
        grid.elements.append((GMSH['point'], grid._tag('corner', 0), [corner]))
        os.makedirs(cls.path(space), exist_ok=True)
        grid.write(cls.path(space, 'mesh.msh'))
        text = SCENE
        for old, new in (('MORE', more), ('UP', up), ('ACROSS', across), ('TYPE', contact), ('GAP', gap)):
            text = text.replace(old, new)
        cls.changed(os.path.join(space, 'scene.yaml'), text, changes)
        return cls.path(space)

    @staticmethod
    def loads(space, load):
        """On the seat with its foot, and on the block."""
        section, side = SPACES[space][-2:]
        return load * (-0.5 * section - 0.35 * section + 0.3 + 1.5 * side), -0.2 * load * section

    def sums(self, outputs, space, load, follows=('hold', 'push', 'both')):
        """These reactions are those of statics, the others are not."""
        seat, block = self.loads(space, load)
        for name, expected in (('hold', outputs['carry'] - seat), ('push', -outputs['carry'] - block), ('both', -seat - block)):
            wrong = abs(outputs[name] - expected)
            self.assertTrue(wrong < 1e-9 * load if name in follows else wrong > 1e-7 * load, (name, outputs[name], expected))

    def test_models(self):
        """At unseen points, in the plane, around an axis and in space; the error is that of the contact force."""
        for space, kind in (('plane', 'hybrid'), ('plane', 'bodies'), ('ring', 'hybrid'), ('ring', 'bodies'), ('space', 'hybrid'), ('space', 'bodies')):
            scene = self.scene(space)
            self.hyco('train', '-scene', scene, '-grid', '3,3', '-grid_type', 'centred', '-model', 'm.h5', '-hyco_model_type', kind, '-hyco_snapshots', space,
                      *(('-hyco_pod_tol', 1e-4, '-hyco_rid_layers', 1) if kind == 'hybrid' else ()))
            for press, load in ((0.033, 1.7), (0.055, 2.6)):
                with self.subTest(space=space, kind=kind, press=press):
                    at = ('-mu', f'{press},{load}')
                    full, model = self.hyco('solve', '-scene', scene, *at)['outputs'], self.hyco('predict', '-model', 'm.h5', *at)['outputs']
                    self.assertGreater(full['carry'], 0.5 * load)
                    self.sums(full, space, load)
                    self.sums(model, space, load, ('hold', 'push', 'both'))
                    for name in ('hold', 'push', 'both'):
                        wrong = 0 if name == 'both' else abs(model['carry'] - full['carry'])
                        self.assertLess(abs(model[name] - full[name]), wrong + 1e-8 * load, name)

    def test_supports(self):
        """Reactions that a projection-based model measures are compared with its loads and contact forces: these are a quarter too large, and the prediction
        says so."""
        scene = self.scene('plane')
        self.hyco('train', '-scene', scene, '-grid', '3,3', '-model', 'p.h5', '-hyco_model_type', 'projection', '-hyco_snapshots', 'plane', status=None)
        found, full = self.hyco('predict', '-model', 'p.h5', '-mu', '0.033,1.7', status=3), self.hyco('solve', '-scene', scene, '-mu', '0.033,1.7')
        at, (seat, block) = found['outputs'], self.loads('plane', 1.7)
        self.assertGreater(at['carry'], 1.1 * full['outputs']['carry'])
        self.near(at['hold'], full['outputs']['hold'], 1e-2)
        miss = max(abs(at['hold'] - at['carry'] + seat), abs(at['push'] + at['carry'] + block))  # of forces of some 10 in all
        self.assertTrue(miss / 20 < found['balance'] < miss / 5, (found['balance'], miss))

    def test_path(self):
        """At each listed time of a path."""
        same = [('seat: {young: 300, poisson: 0.3, density: 0.5}', 'seat: {law: norton, young: 300, poisson: 0.3, rate: 1e-3, exponent: 2, density: 0.5}'),
                ('-press}', '-press*t}'), ('gravity: {y: -load}', 'gravity: {y: -load*t}\nhistory: {times: [0, 0.5, 1]}')]
        # a model of bodies of paths needs one stiffness, and has no ties
        plain = [('100*(1 + load)', '200'), ('corner: {y: 0.3*load}, ', ''), ('tie: {glue: {slave: below, master: bed}}\n', ''),
                 ('fixed: {', 'fixed: {below: {x: 0, y: 0}, '), ('group: base', 'group: below')]
        for kind, more, point in (('hybrid', [], 0.3), ('bodies', plain, 0)):
            scene = self.scene('plane', [*same, *more])
            self.hyco('train', '-scene', scene, '-grid', '2,2', '-model', f'{kind}.h5', '-hyco_model_type', kind, '-hyco_snapshots', kind,
                      *(('-hyco_pod_tol', 1e-4) if kind == 'hybrid' else ()))
            found = self.hyco('predict', '-model', f'{kind}.h5', '-mu', '0.05,1.7')['history']
            for k, t in enumerate(found['t']):
                at = {name: values[k] for name, values in found['outputs'].items()}
                less = {'hold': 0.5 * (1 - t) + point - 0.3, 'push': 0.2 * (1 - t)}  # of the weight and the point's force
                for name, share in {**less, 'both': sum(less.values())}.items():
                    at[name] += 1.7 * share
                with self.subTest(kind=kind, t=t):
                    self.sums(at, 'plane', 1.7, ('hold', 'push', 'both'))
            self.assertGreater(found['outputs']['carry'][-1], 1)

    def test_training(self):
        """The held-out errors of reactions are those of the contact force, on one rank and on three."""
        scene = self.scene('plane')
        for ranks in (0, 3):
            held = self.hyco('train', '-scene', scene, '-grid', '3,3', '-model', f'{ranks}.h5', '-hyco_pod_tol', 1e-4, '-hyco_rid_layers', 2,
                             '-hyco_validation', 8, '-hyco_snapshots', 'held', ranks=ranks, status=None)['held_out']['outputs']
            for what in ('median', 'largest'):
                self.assertGreater(held['carry'][what], 1e-6)
                for name in ('hold', 'push'):
                    self.near(held[name][what], held['carry'][what], 1e-6, name)
                self.assertLess(held['both'][what], 1e-8)

    def test_other_forces(self):
        """Where a spring or another support also holds the bodies, the reaction of one group does not follow; nor without all contact forces."""
        for k, (change, follows) in enumerate(((('tie:', 'spring: {side: {y: 20}}\ntie:'), ('push',)),
                                (('fixed: {', 'fixed: {corner: {y: 0}, '), ('push', 'both')),
                                (('fixed: {', 'fixed: {corner: {normal: 0, direction: {x: 0, y: 1}}, '), ('push', 'both')),
                                (('fixed: {', 'fixed: {corner: {normal: 0, direction: {x: 1, y: 0}}, '), ('push', 'both', 'hold')))):
            with self.subTest(change=change[1]):
                scene = self.scene('plane', [change])
                self.hyco('train', '-scene', scene, '-grid', '3,3', '-grid_type', 'centred', '-model', f'{k}.h5', '-hyco_model_type', 'bodies')
                at = ('-mu', '0.033,1.7')
                full, model = self.hyco('solve', '-scene', scene, *at)['outputs'], self.hyco('predict', '-model', f'{k}.h5', *at)['outputs']
                for name in ('hold', 'push', 'both'):
                    self.assertLess(abs(model[name] - full[name]), 1e-2 * 1.7, name)
                self.sums(model, 'plane', 1.7, follows)
        self.hyco('train', '-scene', scene, '-grid', '3,3', '-model', 'part.h5', '-hyco_model_type', 'hybrid', '-hyco_snapshots', f'{k}.h5.snapshots')
        part = self.hyco('predict', '-model', 'part.h5', *at, '-hyco_reconstruct', 'false')
        self.assertIsNone(part['balance'])  # supports carry whatever is left
        part = part['outputs']
        self.assertIsNone(part['carry'])
        self.near(part['both'], full['both'], 1e-9)

    def test_floating(self):
        """A key between two bodies that hold it by contact alone, with a shaft and a hub that move: the contact forces on it carry its load, and sum to
        zero along the free direction, whatever the errors of the model are; without the forces outside the RID nothing is balanced."""
        drawn = os.path.join(SOURCE, 'tests', 'drawn', 'keyway')
        os.makedirs(self.path('key'), exist_ok=True)
        with open(os.path.join(drawn, 'scene.yaml'), encoding='utf-8') as f, open(self.path('key/scene.yaml'), 'w', encoding='utf-8') as g:
            g.write(f.read() + ''.join(f'  {name}_x: {{force: x, contact: {name}}}\n' for name in ('shaft_r', 'shaft_l', 'hub_r', 'hub_l')))
        subprocess.run(['gmsh', '-2', os.path.join(drawn, 'keyway.geo'), '-format', 'msh41', '-v', '1', '-o', self.path('key/keyway.msh')], check=True)
        for ranks in (0, 2):  # without a load and a shift nothing determines the position of the key
            run = self.run_raw('solve', '-scene', 'key', '-mu', '0,0.01,0.01,0', '-parameter_shift_range', '0,0.2', ranks=ranks)
            self.assertEqual(run.returncode, 0, run.stderr)
            self.assertIn('warning: no contact force keeps body key from', run.stdout)
            self.assertEqual(self.hyco('solve', '-scene', 'key', '-mu', '0.1,0.004,0.004,700', ranks=ranks)['loose'], '')
        for kind, settings, ranks in (('hybrid', ('-hyco_pod_tol', 1e-4, '-hyco_rid_layers', 1), 0),
                                      ('hybrid', ('-hyco_pod_tol', 1e-4, '-hyco_rid_layers', 1), 2), ('regression', (), 0)):
            self.hyco('train', '-scene', 'key', '-grid', '2,2,1,3', '-model', 'key.h5', '-hyco_model_type', kind, '-hyco_validation', 0,
                      '-hyco_snapshots', 'key.snapshots', *settings, ranks=ranks)
            for mu in ('0.1,0.004,0.004,700', '0.19,0.001,0.009,1400', '0.07,0.009,0.002,100'):
                with self.subTest(kind=kind, ranks=ranks, mu=mu):
                    # a regression's displacements do not follow the forces: reactions measured from them miss the balance, and it says so
                    at = self.hyco('predict', '-model', 'key.h5', '-mu', mu, status=3 if kind == 'regression' else 0)
                    found, force = at['outputs'], at['total_contact_force']
                    self.assertGreater(force, 10)
                    self.near(found['floor_y'] + found['ceiling_y'], float(mu.split(',')[3]), 1e-9)
                    self.assertLess(abs(sum(found[name + '_x'] for name in ('shaft_r', 'shaft_l', 'hub_r', 'hub_l'))), 1e-9 * force)
                    (self.assertGreater if kind == 'regression' else self.assertLess)(at['balance'], 1e-9)


if __name__ == '__main__':
    unittest.main()
