"""The discrete problem of examples/pellet as arrays, for other solvers: the moved mesh, fixed components, consistent
nodal forces, pairs of nodes with their normal and gap. It does not use hyco's code, so that the comparison is
independent."""
import subprocess

import numpy as np

YOUNG, POISSON = 1e5, 0.3
DRAWN_RADIUS = 4.1
PRESSURES = {"pellet_top": 5.0, "clad_outer_high": 50.0, "clad_outer_low": 250.0}
FIXED = {"sym_x0": 0, "sym_y0": 1, "sym_z0": 2}
QUAD, HEX = 3, 5  # gmsh's numbers of the cell types


def read_mesh(path, copy):
    """Nodes (n x 3) and {group: cells, nodes from 0}; copy: path of the mesh that gmsh writes as text of version 2.2."""
    subprocess.run(["gmsh", path, "-save", "-format", "msh22", "-o", copy, "-v", "1"], check=True, stdout=subprocess.DEVNULL)
    with open(copy, encoding="ascii") as file:
        lines = file.read().splitlines()

    def section(name):
        at = lines.index("$" + name)
        return lines[at + 2:at + 2 + int(lines[at + 1])]

    names = {int(words[1]): words[2].strip('"') for words in map(str.split, section("PhysicalNames"))}
    nodes = [line.split() for line in section("Nodes")]
    index = {words[0]: i for i, words in enumerate(nodes)}
    groups = {}
    for words in map(str.split, section("Elements")):
        if int(words[1]) in (QUAD, HEX):
            groups.setdefault(names[int(words[3])], []).append([index[w] for w in words[3 + int(words[2]):]])
    return np.array([words[1:] for words in nodes], float), {name: np.array(cells) for name, cells in groups.items()}


def pressure_forces(xyz, quads, inside, pressure):
    """Nodal forces (n x 3) of a pressure on bilinear facets, 2 x 2 Gauss points; inside: a point behind all of them."""
    force = np.zeros_like(xyz)
    corner = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    x = xyz[quads]
    for point in corner / np.sqrt(3):
        shape = (1 + corner[:, 0] * point[0]) * (1 + corner[:, 1] * point[1]) / 4
        du = corner[:, 0] * (1 + corner[:, 1] * point[1]) / 4
        dv = corner[:, 1] * (1 + corner[:, 0] * point[0]) / 4
        area = np.cross(np.einsum("i,eix->ex", du, x), np.einsum("i,eix->ex", dv, x))
        outward = np.sign(np.einsum("ex,ex->e", area, np.einsum("i,eix->ex", shape, x) - inside))
        for i in range(4):
            np.add.at(force, quads[:, i], -pressure * shape[i] * area * outward[:, None])
    return force


def pairs(xyz, slave, master):
    """Nodes of the two surfaces that coincide as drawn."""
    slave, master = np.unique(slave), np.unique(master)
    order = [np.lexsort(np.round(xyz[nodes], 6).T) for nodes in (slave, master)]
    slave, master = slave[order[0]], master[order[1]]
    if len(slave) != len(master) or abs(xyz[slave] - xyz[master]).max() > 1e-3:
        raise SystemExit("the contact surfaces of the mesh do not match")
    return slave, master


def problem(mesh, radius, load, copy, pressures=None):
    """Everything as a dictionary of arrays; the pellet's cells come first."""
    drawn, groups = read_mesh(mesh, copy)
    slave, master = pairs(drawn, groups["contact_pellet"], groups["contact_clad"])
    xyz = drawn.copy()
    xyz[np.unique(groups["pellet"]), :2] *= radius / DRAWN_RADIUS
    force = sum(pressure_forces(xyz, groups[name], np.zeros(3), p * load) for name, p in (pressures or PRESSURES).items())
    normal = drawn[master] * [1, 1, 0]
    fixed = [(node, axis) for name, axis in FIXED.items() for node in np.unique(groups[name])]
    return {"xyz": xyz, "hexes": np.concatenate([groups["pellet"], groups["cladding"]]),
            "n_pellet": np.array(len(groups["pellet"])), "force": force, "slave": slave,
            "master": master, "normal": normal / np.linalg.norm(normal, axis=1)[:, None],
            "gap": np.array(DRAWN_RADIUS - radius), "fixed": np.array(fixed), "young": np.array(YOUNG),
            "poisson": np.array(POISSON)}
