"""Units from nanometres to kilometres and from Pa to TPa: no absolute tolerance decides. Factors that are powers of four
(of two twice, so that their square roots are exact too) leave every bit of full order; powers of ten leave 1e-10."""
import unittest

import h5py
import numpy as np

from extreme import BODIES, DIM, Extreme, blocks, points
from grids import Grid

TWO, TEN = ((2**-30, 1), (2**10, 1), (1, 2**40), (2**-30, 2**40)), ((1e-9, 1), (1e3, 1), (1, 1e12), (1e-9, 1e12))


def string(length, stress, n=60):
    """A rope over an obstacle: u and gap are lengths, the weight per length a stress over a length."""
    grid = Grid()
    grid.box('line2', [np.linspace(0, 1, n + 1)], lambda x: x * length, 'rope', {'x0': 'ends', 'x1': 'ends'})
    scene = {'scene': {'parameters': ['press', 'gap']},
             'parameter': {'press': {'range': [0.4 * stress / length, 2 * stress / length]},
                           'gap': {'range': [0.02 * length, 0.1 * length]}},
             'body': {'rope': {'young': stress}}, 'force': {'rope': {'x': '-press'}}, 'fixed': {'ends': {'x': 0}},
             'contact': {'ground': {'type': 'obstacle', 'group': 'rope', 'normal': {'x': -1},
                                    'gap': f'gap*(1 + x/{length!r})'}}}
    return grid, scene


class Units(Extreme):
    name = 'units'

    def answers(self, kind, length, stress):
        """u over the length and forces over stress times area: of full order, of a hybrid model on an RID, of a
        projection and of a model of bodies at an unseen point."""
        if kind == 'line2':
            scene, press = self.scene(*string(length, stress)), stress / length
            train = ('-values_press', ','.join(repr(v * press) for v in (0.5, 1, 1.5, 2)), '-values_gap',
                     ','.join(repr(v * length) for v in (0.02, 0.06, 0.1)))
            mu, more = f'{1.2 * press!r},{0.05 * length!r}', ('-hyco_rid_modes', 'displacement,dual', '-hyco_rid_layers', 1)
        else:
            scene = self.scene(*blocks(kind, (6, 6), length, stress, crown=0.1))
            train = points((0.04, 0.05, 0.06, 0.07, 0.08), (0, 0.01, 0.02), length)
            mu, more = f'{0.055 * length!r},{0.012 * length!r}', ('-hyco_rid_layers', 1)
        force = stress * length**(DIM[kind] - 1)
        _, u, lam = self.fields(scene, '-mu', mu)
        out = {'full order': (u / length, lam / force)}
        for model, options in (('hybrid', more), ('projection', ('-hyco_model_type', 'projection', '-hyco_dual', 'snapshots')),
                               ('bodies', BODIES)):
            t = self.train(scene, *train, *options)
            self.hyco('predict', '-model', 'm.h5', '-mu', mu, '-output', self.path('p.xdmf'))
            with h5py.File(self.path('p.h5')) as f:
                out[model] = f['nodes/displacement'][:] / length, f['nodes/contact_force'][:] / force
            out[model + ' sizes'] = [t[k] for k in ('n_modes', 'rid_nodes', 'rid_contacts', 'n_fe_dofs')]
        return out

    def test_scales(self):
        """Scaled lengths and stresses: results scale to the bit, or to round-off."""
        for kind in ('line2', 'quad4', 'hex8'):
            base = self.answers(kind, 1, 1)
            for factors, bound in ((TWO, 0), (TEN, 1e-10)):
                for length, stress in factors if kind == 'quad4' else factors[::3]:
                    case = f'{kind}, lengths x {length:.3g}, stresses x {stress:.3g}'
                    out = self.answers(kind, length, stress)
                    for model in ('full order', 'hybrid', 'projection', 'bodies'):
                        if model != 'full order':
                            self.assertEqual(out[model + ' sizes'], base[model + ' sizes'], case)
                        apart = max(abs(a - b).max() / abs(b).max() for a, b in zip(out[model], base[model]))
                        self.row(case, f'{model}: u and forces, scaled back, differ by', apart,
                                 bound if model == 'full order' else max(bound, 1e-10))


if __name__ == '__main__':
    unittest.main()
