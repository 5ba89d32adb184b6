"""Meshes of gmsh's format 2.2 with the whole boundary of a body as one more group."""
import collections

# by gmsh's type: corners of the cell's faces; corners of its edges, whose middle nodes follow the corners; whether faces and the cell have middle nodes
TRI, QUAD = ((0, 1), (1, 2), (2, 0)), ((0, 1), (1, 2), (2, 3), (3, 0))
TET, TET_EDGES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)), ((0, 1), (1, 2), (2, 0), (3, 0), (2, 3), (1, 3))
HEX = ((0, 3, 2, 1), (0, 1, 5, 4), (0, 4, 7, 3), (1, 2, 6, 5), (2, 3, 7, 6), (4, 5, 6, 7))
HEX_EDGES = ((0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7))
PRISM = ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))
PYRAMID = ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4))
CELLS = {2: (3, TRI, ()), 3: (4, QUAD, ()), 9: (3, TRI, TRI), 10: (4, QUAD, QUAD), 16: (4, QUAD, QUAD), 4: (4, TET, ()), 11: (4, TET, TET_EDGES), 5: (8, HEX, ()), 17: (8, HEX, HEX_EDGES),
         12: (8, HEX, HEX_EDGES), 6: (6, PRISM, ()), 7: (5, PYRAMID, ())}
FLAT = {2, 3, 9, 10, 16}
FACETS = {(2, 0): 1, (2, 1): 8, (3, 0): 2, (3, 1): 9, (4, 0): 3, (4, 1): 16, (4, 2): 10}  # gmsh's type by corners and order; 2: with a node in the middle


def cell_faces(kind, nodes):
    """The faces of a cell: gmsh's type and nodes of each."""
    corners, faces, edges = CELLS[kind]
    for f, face in enumerate(faces):
        ends = zip(face, face[1:] + face[:1]) if len(face) > 2 else [face]
        middles = [corners + next(i for i, e in enumerate(edges) if set(e) == set(end)) for end in ends] if edges else []
        if kind == 12:
            middles.append(20 + f)
        yield FACETS[len(face), 2 if kind == 12 else bool(edges)], tuple(nodes[v] for v in (*face, *middles))


def add_skins(path, groups):
    """Adds to the mesh the group skin_G for each group G: the boundary of the bodies (cells that share nodes) that have its facets."""
    with open(path, encoding='ascii') as file:
        lines = file.read().split('\n')
    names = {}
    at = lines.index('$PhysicalNames')
    for line in lines[at + 2:at + 2 + int(lines[at + 1])]:
        names[line.split(None, 2)[2].strip().strip('"')] = tuple(int(v) for v in line.split(None, 2)[:2])
    first = lines.index('$Elements')
    rows = [[int(v) for v in line.split()] for line in lines[first + 2:first + 2 + int(lines[first + 1])]]
    elements = [(row[1], row[3], tuple(row[3 + row[2]:])) for row in rows]
    dim = max(names.values())[0]
    cells = {nodes: kind for kind, _, nodes in elements if kind in CELLS and (kind not in FLAT) == (dim == 3)}
    root = {}

    def find(node):
        while root.setdefault(node, node) != node:
            root[node] = root[root[node]]
            node = root[node]
        return node

    faces = collections.Counter()
    for nodes, kind in cells.items():
        for node in nodes[1:]:
            root[find(node)] = find(nodes[0])
        faces.update(frozenset(face) for _, face in cell_faces(kind, nodes))
    new, tag, count = [], max(t for _, t in names.values()), len(rows)
    for group in dict.fromkeys(groups):
        tag += 1
        bodies = {find(n) for _, t, nodes in elements if t == names[group][1] for n in nodes if (dim - 1, t) == names[group]}
        new += [(of, tag, face) for nodes, kind in cells.items() if find(nodes[0]) in bodies for of, face in cell_faces(kind, nodes) if faces[frozenset(face)] == 1]
        lines[at + 1] = str(int(lines[at + 1]) + 1)
        lines.insert(at + 2, f'{dim - 1} {tag} "skin_{group}"')
        first += 1
    lines[first + 1] = str(count + len(new))
    number = max(row[0] for row in rows)
    lines[first + 2 + count:first + 2 + count] = [' '.join(map(str, (number + k + 1, kind, 2, t, t, *nodes))) for k, (kind, t, nodes) in enumerate(new)]
    with open(path, 'w', encoding='ascii') as file:
        file.write('\n'.join(lines))
