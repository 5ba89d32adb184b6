"""Structured meshes: boxes of any cell type, bent by a function, written as gmsh 2.2 files."""
import numpy as np

from common import msh

GMSH = {'point': 15, 'line2': 1, 'tri3': 2, 'quad4': 3, 'tet4': 4, 'hex8': 5}
KUHN = ((0, 1, 2, 6), (0, 5, 1, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 4, 5, 6), (0, 7, 4, 6))  # a cube along its diagonal
PARTS = {'line2': ('line2', ((0, 1),)), 'quad4': ('quad4', ((0, 1, 2, 3),)), 'tri3': ('tri3', ((0, 1, 2), (0, 2, 3))),
         'hex8': ('hex8', (tuple(range(8)),)), 'tet4': ('tet4', KUHN)}
FACETS = {'line2': ('point', ((0,),)), 'quad4': ('line2', ((0, 1),)), 'tri3': ('line2', ((0, 1),)),
          'hex8': ('quad4', ((0, 1, 2, 3),)), 'tet4': ('tri3', ((0, 1, 2), (0, 2, 3)))}


class Grid:
    """Boxes with nodes of their own; groups are known by name."""

    def __init__(self):
        self.nodes, self.elements, self.names = [], [], {}
        self.count = 0

    def _tag(self, name, dim):
        for tag, known in self.names.items():
            if known == (dim, name):
                return tag
        self.names[len(self.names) + 1] = (dim, name)
        return len(self.names)

    def box(self, kind, axes, bend, body, faces):
        """Cells of a kind over the product of the axes, nodes moved by bend (n x dim to n x dim); faces: {'x0': group},
        a face of the grid by axis and end; {'y1': (group, n)}: its first n cells each way."""
        dim, shape = len(axes), tuple(len(a) for a in axes)
        grid = np.stack(np.meshgrid(*axes, indexing='ij'), -1)
        place = np.zeros((int(np.prod(shape)), 3))
        place[:, :dim] = bend(grid.reshape(-1, dim))
        number = self.count + 1 + np.arange(len(place)).reshape(shape)
        self.count += len(place)
        self.nodes.extend(place.tolist())
        self._cells(PARTS[kind], number, self._tag(body, dim))
        for face, group in faces.items():
            at = np.take(number, 0 if face[1] == '0' else -1, axis='xyz'.index(face[0]))
            if isinstance(group, tuple):
                at, group = at[(slice(group[1] + 1),) * at.ndim], group[0]
            self._cells(FACETS[kind], at, self._tag(group, dim - 1))

    def _cells(self, parts, number, tag):
        """The grid's cells, each cut in parts; corners in gmsh's order."""
        kind, cuts = parts
        low, high = slice(None, -1), slice(1, None)
        if number.ndim == 0:
            corners = number.reshape(1, 1)
        elif number.ndim == 1:
            corners = np.stack([number[low], number[high]], -1)
        else:
            square = [(low, low), (high, low), (high, high), (low, high)]
            picks = square if number.ndim == 2 else [s + (z,) for z in (low, high) for s in square]
            corners = np.stack([number[p] for p in picks], -1).reshape(-1, len(picks))
        for cut in cuts:
            self.elements.extend((GMSH[kind], tag, c) for c in corners[:, cut].tolist())

    def write(self, path):
        msh(path, self.nodes, self.elements, self.names)


def graded(fine, zone, end, ratio):
    """0 to `end`: steps of `fine` up to `zone` (a multiple), then growing by at most the ratio, exactly to the end."""
    n = round(zone / fine)
    steps, x = [], zone
    while x < end:
        steps.append(fine * ratio**(len(steps) + 1))
        x += steps[-1]
    steps = np.array(steps) * (end - zone) / np.sum(steps)
    return np.concatenate([np.linspace(0, zone, n + 1), zone + np.cumsum(steps)[:-1], [end]])


def ball(grid):
    """[0, 1]^dim to the unit disc's quarter or ball's eighth, smooth inside; (0, .., 1) stays, the faces at 1 become
    round."""
    s = grid**2
    if grid.shape[1] == 2:
        return grid * np.sqrt(1 - s[:, ::-1] / 2)
    y, z = np.roll(s, -1, axis=1), np.roll(s, -2, axis=1)
    return grid * np.sqrt(1 - y / 2 - z / 2 + y * z / 3)
