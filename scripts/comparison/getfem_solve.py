#!/usr/bin/python3
"""GetFEM on the arrays of a file: getfem_solve.py PROBLEM.npz RESULT.json. One variable, a basic contact brick with the
given normals and gaps (the symmetric augmented Lagrangian), MUMPS."""
import json
import sys
import time

import getfem as gf
import numpy as np

FROM_GMSH = [0, 1, 3, 2, 4, 5, 7, 6]


def space(xyz, hexes):
    """First-order displacements, and node_of_dof for their components, because GetFEM chooses its own numbering."""
    mesh = gf.Mesh("empty", 3)
    mesh.add_convex(gf.GeoTrans("GT_QK(3,1)"), xyz[hexes[:, FROM_GMSH]].transpose(2, 1, 0))
    field = gf.MeshFem(mesh, 3)
    field.set_fem(gf.Fem("FEM_QK(3,1)"))
    places = field.basic_dof_nodes()[:, ::3].T
    order = [np.lexsort(np.round(p, 7).T) for p in (xyz, places)]
    if len(places) != len(xyz) or abs(xyz[order[0]] - places[order[1]]).max() > 1e-7:
        raise SystemExit("GetFEM merged or moved nodes")
    first = np.empty(len(xyz), int)
    first[order[0]] = 3 * order[1]
    return mesh, field, first


def sparse(entries, rows, columns):
    """entries: (row, column, value)"""
    matrix = gf.Spmat("empty", rows, columns)
    for row, column, value in entries:
        matrix[int(row), int(column)] = float(value)
    return matrix


def contact_matrix(p, first, n):
    """B of rows n.(u_slave - u_master)."""
    sides = (p["slave"], 1), (p["master"], -1)
    return sparse(((row, first[node] + axis, sign * p["normal"][row, axis]) for nodes, sign in sides
                   for row, node in enumerate(nodes) for axis in range(3)), len(p["slave"]), n)


def build(p, mesh, field, force, fixed, matrix):
    """GetFEM's model. Fixed components by a penalty a million times Young's modulus."""
    young, poisson, contacts = float(p["young"]), float(p["poisson"]), len(p["slave"])
    model = gf.Model("real")
    model.add_fem_variable("u", field)
    model.add_initialized_data("lambda", young * poisson / (1 + poisson) / (1 - 2 * poisson))
    model.add_initialized_data("mu", young / 2 / (1 + poisson))
    points = gf.MeshIm(mesh, gf.Integ("IM_GAUSS_PARALLELEPIPED(3,3)"))
    model.add_isotropic_linearized_elasticity_brick(points, "u", "lambda", "mu")
    model.add_explicit_rhs("u", force)
    model.add_constraint_with_penalization("u", 1e6 * young, fixed, np.zeros(fixed.size()[0]))
    model.add_variable("pressure", contacts)
    model.add_initialized_data("r", young)
    model.add_initialized_data("gap", np.full(contacts, float(p["gap"])))
    model.add_initialized_data("alpha", np.ones(contacts))
    model.add_basic_contact_brick("u", "pressure", "r", matrix, "gap", "alpha", 2)
    return model


def main():
    p = dict(np.load(sys.argv[1]))
    mesh, field, first = space(p["xyz"], p["hexes"])
    n = field.nbdof()
    force = np.zeros(n)
    for axis in range(3):
        force[first + axis] = p["force"][:, axis]
    columns = np.unique(first[p["fixed"][:, 0]] + p["fixed"][:, 1])
    fixed = sparse(((row, column, 1) for row, column in enumerate(columns)), len(columns), n)
    matrix = contact_matrix(p, first, n)
    begin, cpu = time.monotonic(), time.process_time()
    model = build(p, mesh, field, force, fixed, matrix)
    # full Newton steps: the default damping needs twice as many
    answer = model.solve("lsolver", "mumps", "max_iter", 60, "max_res", 1e-8, "lsearch", "simplest", "alpha max ratio", 1e10,
                         "alpha min", 1.0, "alpha mult", 0.6)
    contact = -model.variable("pressure")
    with open(sys.argv[2], "w", encoding="utf-8") as file:
        json.dump({"seconds": time.monotonic() - begin, "cpu_seconds": time.process_time() - cpu,
                   "iterations": int(answer[0]), "converged": bool(answer[1]), "total_contact_force": float(contact.sum()),
                   "n_active": int((contact > 1e-6 * contact.max()).sum())}, file)


if __name__ == "__main__":
    main()
