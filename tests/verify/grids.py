"""Structured meshes: boxes of any cell type, bent by a function, written as gmsh 2.2 files."""
import numpy as np

from common import msh

GMSH = {'point': 15, 'line2': 1, 'tri3': 2, 'quad4': 3, 'tet4': 4, 'hex8': 5, 'prism6': 6, 'pyramid5': 7}
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

    def mixed(self, axes, bend, body, faces, cut):
        """A box whose cell at the place (i, j) or (i, j, k) is cut as cut(place) says: 'whole' (quad4, hex8), 'halves' (tri3; prism6,
        along z), 'pyramid5' (three, whose apex is the corner at an odd place of each axis, so that neighbours that are cut so too fit)
        or 'tet4' (the same, each pyramid with its base on the boundary in two)."""
        dim, shape = len(axes), tuple(len(a) for a in axes)
        place = np.zeros((int(np.prod(shape)), 3))
        place[:, :dim] = bend(np.stack(np.meshgrid(*axes, indexing='ij'), -1).reshape(-1, dim))
        number = self.count + 1 + np.arange(len(place)).reshape(shape)
        self.count += len(place)
        self.nodes.extend(place.tolist())
        at = dict(zip(number.ravel().tolist(), np.ndindex(shape)))
        outer = {f'{"xyz"[c]}{end}': (c, end * (shape[c] - 1)) for c in range(dim) for end in (0, 1)}
        bounds = lambda nodes: [face for face, (c, end) in outer.items() if all(at[n][c] == end for n in nodes)]
        tag, found = self._tag(body, dim), {}
        for cell in np.ndindex(*(n - 1 for n in shape)):
            corner = [int(number[tuple(cell[c] + r[c] for c in range(dim))]) for r in CORNERS[:2**dim]]
            for kind, c in pieces(cell, corner, cut(cell), bounds):
                self.elements.append((GMSH[kind], tag, c))
                for face in SIDES[kind]:
                    nodes = [c[v] for v in face]
                    found.setdefault(frozenset(nodes), []).append(nodes)
        for nodes in (alike[0] for alike in found.values() if len(alike) == 1):
            for face in bounds(nodes):
                if face in faces:
                    self.elements.append((len(nodes) - 1, self._tag(faces[face], dim - 1), nodes))

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


CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
SIDES = {'tri3': ((0, 1), (1, 2), (2, 0)), 'quad4': ((0, 1), (1, 2), (2, 3), (3, 0)), 'tet4': ((0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3)),
         'pyramid5': ((0, 1, 2, 3), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
         'prism6': ((0, 1, 2), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
         'hex8': ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))}


def pieces(cell, corner, cut, bounds):
    """The cells, a kind and its nodes each, that a cell with these corners is cut into: Grid.mixed."""
    flat = len(corner) == 4
    if cut == 'whole':
        return [('quad4' if flat else 'hex8', corner)]
    if cut == 'halves':
        parts = ((0, 1, 2), (0, 2, 3)) if flat else ((0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7))
        return [('tri3' if flat else 'prism6', [corner[v] for v in p]) for p in parts]
    apex, out = CORNERS.index(tuple(1 - p % 2 for p in cell)), []
    for base in SIDES['hex8']:
        if apex in base:
            continue
        side, up, far = (np.subtract(CORNERS[v], CORNERS[base[0]]) for v in (base[1], base[3], apex))
        nodes = [corner[v] for v in (base if np.cross(side, up) @ far > 0 else base[::-1])]
        if cut == 'tet4' and bounds(nodes):
            nodes = nodes[nodes.index(min(nodes)):] + nodes[:nodes.index(min(nodes))]  # the same diagonal on opposite faces
            out += [('tet4', [*(nodes[v] for v in half), corner[apex]]) for half in ((0, 1, 2), (0, 2, 3))]
        else:
            out.append(('pyramid5', [*nodes, corner[apex]]))
    return out


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
