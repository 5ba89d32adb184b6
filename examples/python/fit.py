"""Which radius and load give the measured force between pellet and cladding, and the measured hoop stress? scipy.optimize on a reduced model and its gradients; the
answer is then checked by one full-order solve.

    python3 examples/python/fit.py examples/pellet pellet.h5
"""
import os
import sys

import hyco
import numpy as np
from scipy.optimize import least_squares

SCENE, MODEL = sys.argv[1:]
OUTPUTS = {'output_hoop_max': 'sigma_tt', 'output_hoop_group': 'contact_clad', 'output_squeeze_force': 'x', 'output_squeeze_contact': 'gap'}

with hyco.Scene(SCENE, **OUTPUTS) as scene:
    if not os.path.exists(MODEL):
        scene.train(MODEL, grid=[9, 5])
    measured = scene.solve([4.0637, 0.62]).outputs  # stands for a measurement
    with hyco.Model(MODEL) as model:
        lo, hi = np.transpose(list(model.parameters.values()))

        def misfit(share):
            p = model.predict(lo + share * (hi - lo))
            return [p.outputs[name] / measured[name] - 1 for name in measured]

        def slopes(share):
            g = model.gradient(lo + share * (hi - lo))
            return [g[name] * (hi - lo) / measured[name] for name in measured]

        found = least_squares(misfit, x0=[0.9, 0.9], jac=slopes, bounds=(0, 1))
        mu = lo + found.x * (hi - lo)
    full = scene.solve(mu).outputs
print('found: ' + ', '.join(f'{name} {value:.4f}' for name, value in zip(scene.parameters, mu)) + f' after {found.nfev} evaluations')
for name, value in measured.items():
    print(f'{name}: measured {value:.6g}, full order at the answer {full[name]:.6g}')
