"""Meshes of gmsh's format 2.2 with the whole boundary of a body as one more group."""
import collections

# by gmsh's type of a cell: the type of a face, its corners, then the middle nodes of its edges
EDGE3, EDGE2 = 8, 1
FACES = {2: (EDGE2, ((0, 1), (1, 2), (2, 0))), 3: (EDGE2, ((0, 1), (1, 2), (2, 3), (3, 0))),
         9: (EDGE3, ((0, 1, 3), (1, 2, 4), (2, 0, 5))), 10: (EDGE3, ((0, 1, 4), (1, 2, 5), (2, 3, 6), (3, 0, 7))),
         4: (2, ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))),
         5: (3, ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)))}


def add_skins(path, groups):
    """Adds to the mesh the group skin_G for each group G: the boundary of the bodies (cells that share nodes) that have its facets."""
    with open(path, encoding='ascii') as file:
        lines = file.read().split('\n')
    names = {}
    at = lines.index('$PhysicalNames')
    for line in lines[at + 2:at + 2 + int(lines[at + 1])]:
        names[line.split(None, 2)[2].strip('"')] = tuple(int(v) for v in line.split(None, 2)[:2])
    first = lines.index('$Elements')
    rows = [[int(v) for v in line.split()] for line in lines[first + 2:first + 2 + int(lines[first + 1])]]
    elements = [(row[1], row[3], tuple(row[3 + row[2]:])) for row in rows]
    dim = max(names.values())[0]
    cells = {nodes: kind for kind, _, nodes in elements if kind in FACES and (kind in (4, 5)) == (dim == 3)}
    root = {}

    def find(node):
        while root.setdefault(node, node) != node:
            node = root[node]
        return node

    faces = collections.Counter()
    for nodes, kind in cells.items():
        for node in nodes[1:]:
            root[find(node)] = find(nodes[0])
        faces.update(frozenset(nodes[v] for v in face) for face in FACES[kind][1])
    new, tag = [], max(t for _, t in names.values())
    for group in groups:
        tag += 1
        bodies = {find(n) for _, t, nodes in elements if t == names[group][1] for n in nodes if (dim - 1, t) == names[group]}
        new += [(FACES[kind][0], tag, [nodes[v] for v in face]) for nodes, kind in cells.items() if find(nodes[0]) in bodies
                for face in FACES[kind][1] if faces[frozenset(nodes[v] for v in face)] == 1]
        lines[at + 1] = str(int(lines[at + 1]) + 1)
        lines.insert(at + 2, f'{dim - 1} {tag} "skin_{group}"')
        first += 1
    count = int(lines[first + 1])
    lines[first + 1] = str(count + len(new))
    lines[first + 2 + count:first + 2 + count] = [' '.join(map(str, (count + k + 1, kind, 2, t, t, *nodes))) for k, (kind, t, nodes) in enumerate(new)]
    with open(path, 'w', encoding='ascii') as file:
        file.write('\n'.join(lines))
