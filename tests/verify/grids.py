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

    def tool(self, kind, axes):
        """A box of the body tool; its first node is the group tip."""
        first = self.count + 1
        self.box(kind, axes, lambda x: x, 'tool', {})
        self.elements.append((15, self._tag('tip', 0), (first,)))

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


EDGES = {1: ((0, 1),), 2: ((0, 1), (1, 2), (2, 0)), 3: ((0, 1), (1, 2), (2, 3), (3, 0)), 4: ((0, 1), (1, 2), (2, 0), (3, 0), (2, 3), (1, 3)),
         5: ((0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7))}          # in gmsh's order
FACES = ((0, 3, 2, 1), (0, 1, 5, 4), (0, 4, 7, 3), (1, 2, 6, 5), (2, 3, 7, 6), (4, 5, 6, 7))
LINEAR = {'tri6': 'tri3', 'quad8': 'quad4', 'quad9': 'quad4', 'tet10': 'tet4', 'hex20': 'hex8', 'hex27': 'hex8'}


def second(grid, kind, place=lambda x: x):
    """A grid of LINEAR[kind] as one of second order, for msh(); place: where the mean of an edge's (a face's, a cell's) corners is put."""
    nodes, middles, elements = list(grid.nodes), {}, []
    full = kind in ('quad9', 'hex27')
    gmsh = {15: 15, 1: 8, 2: 9, 3: 10 if full else 16, 4: 11, 5: 12 if full else 17}

    def middle(corners):
        key = tuple(sorted(corners))
        if key not in middles:
            nodes.append(tuple(place(np.mean([grid.nodes[c - 1] for c in corners], axis=0))))
            middles[key] = len(nodes)
        return middles[key]

    for of, tag, c in grid.elements:
        inner = {3: (range(4),), 5: (*FACES, range(8))}.get(of, ()) if full else ()
        parts = (*EDGES.get(of, ()), *inner)
        elements.append((gmsh[of], tag, [*c, *(middle([c[k] for k in part]) for part in parts)]))
    return nodes, elements, grid.names
