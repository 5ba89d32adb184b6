"""CalculiX on the arrays of a problem: its input file, and the contact in its output. Hexahedra C3D8 (full integration),
nodal forces, and a gap element GAPUNI between the two nodes of a pair with the given normal and gap."""
import numpy as np

STIFFNESS = 1e7  # N/mm of a closed gap: stiff compared with the bodies; with more the overlap would be below the digits that are printed
YIELD = 1e12  # never reached: CalculiX iterates on gap elements only if another part is nonlinear (or the geometry)


def write(path, p, creep=None):
    """Writes the input file path.inp for ccx -i path. CalculiX reads at most 20 characters of a number: 12 digits fit.
    creep: rate and exponent of the cladding's Norton law, and the end of time, in steps; else everything is elastic."""
    with open(path + ".inp", "w", encoding="ascii") as file:
        file.write("*NODE, NSET=ALL\n")
        for i, x in enumerate(p["xyz"]):
            file.write("%d, %.12g, %.12g, %.12g\n" % (i + 1, *x))
        for name, cells in (("PELLET", range(p["n_pellet"])), ("CLADDING", range(p["n_pellet"], len(p["hexes"])))):
            file.write(f"*ELEMENT, TYPE=C3D8, ELSET={name}\n")
            for i in cells:
                file.write(f"{i + 1}, {', '.join(map(str, p['hexes'][i] + 1))}\n")
            file.write(f"*MATERIAL, NAME={name}\n*ELASTIC\n{p['young']:.12g}, {p['poisson']:.12g}\n")
            if not creep:
                file.write(f"*PLASTIC\n{YIELD:.12g}, 0.\n{2 * YIELD:.12g}, 1.\n")
            elif name == "CLADDING":
                file.write(f"*CREEP, LAW=NORTON\n{creep['rate']:.12g}, {creep['exponent']:.12g}, 0.\n")
            file.write(f"*SOLID SECTION, ELSET={name}, MATERIAL={name}\n")
        for i, (slave, master, n) in enumerate(zip(p["slave"], p["master"], p["normal"])):
            # the stretch of a gap element is gap + n.(u_second - u_first)
            file.write(f"*ELEMENT, TYPE=GAPUNI, ELSET=G{i}\n{len(p['hexes']) + 1 + i}, {slave + 1}, {master + 1}\n"
                       f"*GAP, ELSET=G{i}\n{p['gap']:.12g}, {n[0]:.12g}, {n[1]:.12g}, {n[2]:.12g}, , {STIFFNESS:.12g}\n")
        file.write("*BOUNDARY\n")
        for node, axis in p["fixed"]:
            file.write(f"{node + 1}, {axis + 1}, {axis + 1}\n")
        file.write(f"*STEP\n*STATIC\n{'1e-9, 1e-9' if creep else '1., 1.'}\n*CLOAD\n")
        for node, axis in np.argwhere(p["force"]):
            file.write(f"{node + 1}, {axis + 1}, {p['force'][node, axis]:.12g}\n")
        file.write("*NODE PRINT, NSET=ALL\nU\n*END STEP\n")
        if creep:
            file.write(f"*STEP, INC={creep['steps'] + 1}\n*VISCO, DIRECT, CETOL=1.\n"
                       f"{creep['end'] / creep['steps']:.12g}, {creep['end']:.12g}\n"
                       f"*NODE PRINT, NSET=ALL, FREQUENCY={creep['every']}\nU\n*END STEP\n")


def displacements(path, n):
    """n x 3 at each printed time, from path.dat."""
    found = []
    with open(path + ".dat", encoding="ascii") as file:
        for line in file:
            words = line.split()
            if words[:1] == ["displacements"]:
                found.append(np.full((n, 3), np.nan))
            elif len(words) == 4 and words[0].isdigit():
                found[-1][int(words[0]) - 1] = [float(w) for w in words[1:]]
    if not found or np.isnan(found).any():
        raise ValueError("CalculiX printed no displacement of some nodes")
    return found


def contact(p, u):
    """Total contact force and active pairs from the overlap of the pairs times the stiffness."""
    overlap = np.einsum("ix,ix->i", p["normal"], u[p["slave"]] - u[p["master"]]) - p["gap"]
    force = STIFFNESS * np.maximum(overlap, 0)
    return float(force.sum()), int((force > 1e-6 * force.max()).sum())
