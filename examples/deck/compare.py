"""Compares a full-order solution with another program's displacements: a CSV file with the nodes' coordinates and displacements, x, y, [z,] u_x, u_y
[, u_z], in any order.

    python3 examples/deck/compare.py SCENE FILE.csv"""
import sys

import h5py
import hyco
import numpy as np

SCENE, FILE = sys.argv[1:]
table = np.loadtxt(FILE, delimiter=',', skiprows=1)
dim = table.shape[1] // 2
with hyco.Scene(SCENE) as scene:
    mu = [(lo + hi) / 2 for lo, hi in scene.parameters.values()]
    solution = scene.solve(mu)
    scene.write('compared.xdmf')
with h5py.File('compared.h5') as file:
    nodes = file['mesh/xyz'][:, :dim]
size = np.abs(table[:, dim:]).max()
gap = np.linalg.norm(nodes[:, np.newaxis] - table[:, :dim], axis=2)
nearest = gap.argmin(1)
same = gap.min(1) < 1e-4 * np.ptp(nodes)
print(f'{same.sum()} of {len(nodes)} nodes have a partner')
error = np.abs(solution.displacement[same] - table[nearest[same], dim:]).max()
print(f'largest difference of a displacement: {error:.3g}, {100 * error / size:.2f} % of the largest displacement')
for contact in solution.contacts:
    print(f'contact {contact["name"]}: force {np.round(contact["force"][:dim], 4)}, largest pressure {contact["pressure"]:.5g}')
