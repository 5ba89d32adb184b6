"""CalculiX on the arrays of a problem: its input file, and what its output says of the contact. Hexahedra C3D8 (full
integration), nodal forces, and a gap element GAPUNI between the two nodes of a pair with the given normal and gap."""
import numpy as np

STIFFNESS = 1e7  # N/mm of a closed gap: stiff beside the bodies; more would drown the overlap in the digits that are printed
YIELD = 1e12  # never reached: CalculiX iterates on gap elements only where something else is nonlinear (or the geometry)


def write(path, p):
    """The input file path.inp for ccx -i path. CalculiX reads no more than 20 characters of a number: 12 digits fit."""
    with open(path + ".inp", "w", encoding="ascii") as file:
        file.write("*NODE, NSET=ALL\n")
        for i, x in enumerate(p["xyz"]):
            file.write("%d, %.12g, %.12g, %.12g\n" % (i + 1, *x))
        file.write("*ELEMENT, TYPE=C3D8, ELSET=SOLID\n")
        for i, cell in enumerate(p["hexes"] + 1):
            file.write(f"{i + 1}, {', '.join(map(str, cell))}\n")
        file.write(f"*MATERIAL, NAME=BODY\n*ELASTIC\n{p['young']:.12g}, {p['poisson']:.12g}\n"
                   f"*PLASTIC\n{YIELD:.12g}, 0.\n{2 * YIELD:.12g}, 1.\n"
                   "*SOLID SECTION, ELSET=SOLID, MATERIAL=BODY\n")
        for i, (slave, master, n) in enumerate(zip(p["slave"], p["master"], p["normal"])):
            # the stretch of a gap element is gap + n.(u_second - u_first)
            file.write(f"*ELEMENT, TYPE=GAPUNI, ELSET=G{i}\n{len(p['hexes']) + 1 + i}, {slave + 1}, {master + 1}\n"
                       f"*GAP, ELSET=G{i}\n{p['gap']:.12g}, {n[0]:.12g}, {n[1]:.12g}, {n[2]:.12g}, , {STIFFNESS:.12g}\n")
        file.write("*BOUNDARY\n")
        for node, axis in p["fixed"]:
            file.write(f"{node + 1}, {axis + 1}, {axis + 1}\n")
        file.write("*STEP\n*STATIC\n1., 1.\n*CLOAD\n")
        for node, axis in np.argwhere(p["force"]):
            file.write(f"{node + 1}, {axis + 1}, {p['force'][node, axis]:.12g}\n")
        file.write("*NODE PRINT, NSET=ALL\nU\n*END STEP\n")


def displacements(path, n):
    """n x 3 from path.dat."""
    u = np.full((n, 3), np.nan)
    with open(path + ".dat", encoding="ascii") as file:
        for line in file:
            words = line.split()
            if len(words) == 4 and words[0].isdigit():
                u[int(words[0]) - 1] = [float(w) for w in words[1:]]
    if np.isnan(u).any():
        raise ValueError("CalculiX printed no displacement of some nodes")
    return u


def contact(p, u):
    """Total contact force and active pairs from the overlap of the pairs, which the stiffness turns into force."""
    overlap = np.einsum("ix,ix->i", p["normal"], u[p["slave"]] - u[p["master"]]) - p["gap"]
    force = STIFFNESS * np.maximum(overlap, 0)
    return float(force.sum()), int((force > 1e-6 * force.max()).sum())
