"""A cylinder on a block, drawn in place or moved there by a map: meshes and scenes of the tests of moved contact."""
import math

from common import msh

KINDS = {2: (3, 1), 3: (5, 3)}  # gmsh types of a cell and a facet
SCENE = """
scene: {mesh: %(mesh)s, parameters: [place, press, modulus]}
parameter:
  place: {range: [%(lo)g, %(hi)g]}
  press: {range: [0, 2]}
  modulus: {range: [1, 100]}
body:
  block: {young: modulus, poisson: 0.4}
  cylinder: {young: 100, poisson: 0.3%(map)s}
fixed:
  base: {x: 0, y: 0%(z)s}
  top: {x: %(push)s, y: -press%(z)s}
contact: {under: {type: %(type)s, slave: %(slave)s, master: %(master)s%(more)s}}
"""


def grid(shape, point, nodes, elements, tag, sides):
    """A structured body: point(i, j, k) of each node; sides {(axis, end): group}."""
    dim, base = len(shape), len(nodes)
    steps = [n + 1 for n in shape] + [1] * (3 - dim)
    number = lambda at: base + 1 + at[0] + steps[0] * (at[1] + steps[1] * at[2])
    for k in range(steps[2]):
        for j in range(steps[1]):
            for i in range(steps[0]):
                nodes.append(point(i, j, k))
    ring = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    corners = ring if dim == 2 else ring + [(a, b, 1) for a, b, _ in ring]
    for k in range(shape[2] if dim == 3 else 1):
        for j in range(shape[1]):
            for i in range(shape[0]):
                elements.append((KINDS[dim][0], tag, [number((i + a, j + b, k + c)) for a, b, c in corners]))
    for (axis, end), group in sides.items():
        rest = [a for a in range(dim) if a != axis]
        of = [(0,), (1,)] if dim == 2 else [(0, 0), (1, 0), (1, 1), (0, 1)]
        for v in range(shape[rest[1]] if dim == 3 else 1):
            for u in range(shape[rest[0]]):
                facet = []
                for step in of:
                    at = [0, 0, 0]
                    at[axis] = end * shape[axis]
                    for a, start, d in zip(rest, (u, v), step, strict=False):
                        at[a] = start + d
                    facet.append(number(at))
                elements.append((KINDS[dim][1], group, facet))


def mesh(path, dim=2, at=0.0, n=64, m=36, half=16.0, radius=10.0, angle=60.0, lift=0.0, wide=4, bonded=False):
    """The block [-half, half] x [-8, 0] (x [0, wide] in 3D) of n elements along its top, under the part of a cylinder
    within `angle` degrees of its lowest line, m elements along its round, over x = at and `lift` above the block. bonded: the cylinder's inner half is a body `core` of its own."""
    nodes, elements = [], []
    deep = max(n // 8, 3)
    grid([n, deep] + [wide] * (dim - 2), lambda i, j, k: (-half + 2 * half * i / n, -8 + 8 * (1 - (1 - j / deep)**1.5), k),
         nodes, elements, 1, {(1, 0): 11, (1, 1): 12})

    def round_(i, j, k):
        t, r = math.radians(angle * (2 * i / m - 1)), radius * (1 - 0.5 * j / 6)
        return (at + r * math.sin(t), lift + radius - r * math.cos(t), 0.5 + 0.75 * k if dim == 3 else 0)

    begin = len(elements)
    grid([m, 6] + [wide] * (dim - 2), round_, nodes, elements, 2, {(1, 0): 13, (1, 1): 14})
    for at, (kind, tag, of) in enumerate(elements[begin:]):
        if bonded and tag == 2 and at // m % 6 >= 3:
            elements[begin + at] = (kind, 3, of)
    msh(path, nodes, elements, {1: (dim, 'block'), 2: (dim, 'cylinder'), **({3: (dim, 'core')} if bonded else {}), 11: (dim - 1, 'base'), 12: (dim - 1, 'upper'),
                                13: (dim - 1, 'round'), 14: (dim - 1, 'top')})


def scene(path, mesh_name, dim=2, moved=True, lo=-8, hi=8, swap=False, more='', push='0', kind='surface', extra=''):
    """moved: by a map; else the mesh is drawn in place, and any distance is within its tolerance."""
    entries = {'mesh': mesh_name, 'lo': lo, 'hi': hi, 'map': ', map: {x: x + place%s}' % extra if moved else '',
               'z': ', z: 0' if dim == 3 else '', 'push': push, 'type': kind, 'slave': 'upper' if swap else 'round',
               'master': 'round' if swap else 'upper', 'more': more if moved else ', tolerance: 30' + more}
    with open(path, 'w', encoding='ascii') as file:
        file.write(SCENE % entries)
