"""Uncertain radius and load: quantiles of an output, the share of each parameter in its variance (Sobol's indices by OpenTURNS), and how
much the model's own error matters: the mean of its estimates.

    python3 examples/python/uncertainty.py pellet.h5 squeeze
"""
import sys

import hyco
import numpy as np
import openturns as ot

MODEL, OUTPUT = sys.argv[1:]

with hyco.Model(MODEL) as model:
    lo, hi = np.transpose(list(model.parameters.values()))
    uncertain = ot.ComposedDistribution([ot.TruncatedNormal((a + b) / 2, (b - a) / 6, a, b) for a, b in zip(lo, hi)])

    ot.RandomGenerator.SetSeed(1)
    answers = model.predict(np.array(uncertain.getSample(1000)))
    value, estimate = answers.outputs[OUTPUT], answers.estimates[OUTPUT]
    points = ot.SobolIndicesExperiment(uncertain, 500).generate()
    sobol = ot.SaltelliSensitivityAlgorithm(points, ot.Sample(model.predict(np.array(points)).outputs[OUTPUT][:, np.newaxis]), 500)
    first, total = sobol.getFirstOrderIndices(), sobol.getTotalOrderIndices()
print(f'{OUTPUT}: median {np.median(value):.5g}, 5 % to 95 % from {np.quantile(value, 0.05):.5g} to {np.quantile(value, 0.95):.5g}, '
      f'standard deviation {value.std():.3g}, mean estimated error {estimate.mean():.2g}')
for k, name in enumerate(model.parameters):
    print(f'{name}: first-order index {first[k]:.3f}, total {total[k]:.3f}')
