"""A design study as a pandas table: a point per row in, outputs with their estimated errors beside them out.

    python3 examples/python/study.py pellet.h5 study.csv
"""
import itertools
import sys

import hyco
import numpy as np
import pandas as pd

MODEL, FILE = sys.argv[1:]

with hyco.Model(MODEL) as model:
    values = [np.linspace(lo, hi, 25) for lo, hi in model.parameters.values()]
    points = pd.DataFrame(itertools.product(*values), columns=list(model.parameters))
    table = pd.DataFrame(model.predict(points).table())
table.to_csv(FILE, index=False)
last = list(points)[-1]
print(table.groupby(last)[[*model.outputs, 'total_contact_force']].max().iloc[[0, 12, 24]].round(3).to_string())
print(f'{len(table)} points; largest estimated errors: ' + ', '.join(f'{name} {table[name + "_estimate"].max():.2g}' for name in model.outputs))
