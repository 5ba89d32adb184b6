"""Section 7: the runs, and the quantities computed from the solutions by numpy. Other files make pictures and text from these."""
import csv
import glob
import os

import h5py
import numpy as np
from runs import RunError

STEPS = 25
LOADS = ",".join(f"{k / STEPS:.2f}" for k in range(1, STEPS + 1))
RADIUS = 4.06                                     # S3
RADII = {"S1 + S2": (4.02, 4.10), "5 radii": (4.02, 4.04, 4.05, 4.07, 4.10),
         "9 radii": (4.02, 4.03, 4.04, 4.05, 4.055, 4.07, 4.08, 4.09, 4.10)}
VARIANTS = {"paper": (), "no extension": ("-hyco_rid_contact_extension", 0), "no layer": ("-hyco_rid_layers", 0),
            "2 layers": ("-hyco_rid_layers", 2)}
PAPER, FINE = ("S1 + S2", "1e-5", "paper"), ("9 radii", "1e-10", "paper")
PARTS = ("paper", "no extension", "no layer")
MODELS = [*[(*PAPER[:2], v) for v in PARTS], ("5 radii", "1e-5", "paper"), ("5 radii", "1e-7", "paper"),
          *[("5 radii", "1e-10", v) for v in PARTS], ("9 radii", "1e-7", "paper"),
          *[("9 radii", "1e-10", v) for v in VARIANTS]]
SHOWN = (0.6, 0.8, 1.0)  # the loads at which S3's fields are written
SPAN_FLOOR = 1e-9  # singular values below this share of the first count as zero


class Size:
    """Mesh C and every model, or mesh A and the models for the pictures."""

    def __init__(self, quick):
        self.mesh = "A" if quick else "C"
        self.models = [PAPER, (*PAPER[:2], "no extension"), FINE] if quick else MODELS
        self.scene = ("-scene", os.path.join("examples", "pellet", "paper.yaml"), "-scene_mesh",
                      os.path.join("examples", "pellet", f"{self.mesh}.msh"))


def name_of(model):
    return "pellet-" + "-".join(model).replace(" ", "")


def store(runs, size):
    return runs.path(f"pellet-{size.mesh}.snapshots")


def train(runs, size, model, ranks=1):
    """The report, or, for a model that hyco refuses to write, the reason."""
    radii, tol, variant = model
    path = runs.path(f"{name_of(model)}.h5")
    if os.path.exists(path):
        os.remove(path)
    values = ",".join(f"{r:g}" for r in RADII[radii])
    try:
        return runs.hyco(f"{name_of(model)}-train", "train", *size.scene, "-values_radius", values, "-values_load", LOADS,
                         "-hyco_snapshots", store(runs, size), "-model", path, "-hyco_pod_tol", tol,
                         *VARIANTS[variant], ranks=ranks)
    except RunError as error:
        return {"refused": error.reason}


def compare(runs, size, model):
    """S3 compared with full order over all steps: the report and its table by columns."""
    table = runs.path(f"{name_of(model)}.csv")
    report = runs.hyco(f"{name_of(model)}-compare", "compare", *size.scene, "-model", runs.path(f"{name_of(model)}.h5"),
                       "-values_radius", RADIUS, "-values_load", LOADS, "-table", table)
    return report, read_csv(table)


def read_csv(path):
    with open(path, newline="", encoding="ascii") as file:
        rows = list(csv.reader(file))
    return {key: np.array([float(row[k]) for row in rows[1:]]) for k, key in enumerate(rows[0])}


def judged(runs, size, model, trained=None):
    trained = trained or train(runs, size, model)
    if "refused" in trained:
        return {"train": trained}
    report, table = compare(runs, size, model)
    return {"train": trained, "compare": report, "table": table}


def full_order(runs, size):
    """The ramp of S3: forces and times by step."""
    runs.hyco("pellet-S3-ramp", "solve", *size.scene, "-values_radius", RADIUS, "-values_load", LOADS, "-table",
              runs.path("pellet-S3-ramp.csv"))
    return read_csv(runs.path("pellet-S3-ramp.csv"))


def field_name(load):
    return f"pellet-S3-{100 * load:.0f}"


def fields(runs, size, load):
    runs.hyco(field_name(load), "solve", *size.scene, "-mu", f"{RADIUS},{load}", "-output", runs.path(f"{field_name(load)}.xdmf"))


def predicted(runs, model):
    """The fields of a prediction of S3 at full load."""
    name = f"{name_of(model)}-S3"
    return runs.hyco(name, "predict", "-model", runs.path(f"{name_of(model)}.h5"), "-mu", f"{RADIUS},1", "-output",
                     runs.path(f"{name}.xdmf"))


# ------------------------------------------------------------------------------------------------ errors

def worst(entry, contact):
    """Over the steps with contact: the largest errors, times, steps that did not converge."""
    table = entry["table"]
    steps = contact & (table["converged"] > 0.5)
    found = {key: largest(table[key][steps]) for key in ("error_u_rid", "error_sigma_11", "error_lambda_rid", "error_u")}
    found["failed"] = int((contact & (table["converged"] < 0.5)).sum())
    found["failed_without"] = int((~contact & (table["converged"] < 0.5)).sum())
    gain = entry["compare"]["gain"]
    found["speedup"], found["ms"], found["full_ms"] = gain["times"], 1e3 * gain["cpu_predicted"], 1e3 * gain["cpu_full_order"]
    return found


def shares(runs, model, loads=SHOWN):
    """Share of the full-order contact force of S3 in a model's RID."""
    found = []
    with h5py.File(runs.path(f"{name_of(model)}.h5"), "r") as h:
        slave, own = h["problem/pairs/slave"][:].ravel(), h["problem/in_rid"][:].ravel() > 0
        node_id = h["whole/node_id"][:].ravel()[h["mesh/node_whole"][:].ravel()[slave[own]]]
    for load in loads:
        with h5py.File(runs.path(f"{field_name(load)}.h5"), "r") as h:
            force = h["contact/lambda"][:].ravel()
            found.append(force[np.isin(h["contact/node_id"][:].ravel(), node_id)].sum() / force.sum())
    return found


def largest(values):
    """The largest of the defined errors; None if no step has one (x/0 is written as a very large number)."""
    values = values[np.isfinite(values) & (values < 1e300)]
    return values.max() if len(values) else None


# ------------------------------------------------------------------------------------------------ span of the snapshots

def snapshots(runs, size, radii, field):
    """Solutions as columns, radius by radius, each in the order of the loads."""
    found = []
    for path in glob.glob(os.path.join(store(runs, size), "*.h5")):
        with h5py.File(path, "r") as h:
            mu = h["mu"][:].ravel()
            if any(abs(mu[0] - r) < 1e-9 for r in radii):
                found.append((mu[0], mu[1], h[field][:].ravel()))
    assert len(found) == STEPS * len(radii), f"{len(found)} solutions in {store(runs, size)}"
    return np.array([values for _, _, values in sorted(found, key=lambda f: f[:2])]).T


def basis(S):
    """Left singular vectors and singular values of a tall matrix."""
    Q, R = np.linalg.qr(S)
    W, s, _ = np.linalg.svd(R)
    return Q @ W, s


def kept(s, tol):
    """(18): the smallest number of modes that leave at most tol of the energy."""
    left = np.append(np.cumsum((s**2)[::-1])[::-1][1:], 0)
    return int(np.argmax(left <= tol * (s**2).sum())) + 1


def deim(V):
    """The interpolation points of a basis; among equal residuals the first."""
    index = []
    for k in range(V.shape[1]):
        r = V[:, k].copy()
        if k:
            r -= V[:, :k] @ np.linalg.solve(V[np.ix_(index, range(k))], V[index, k])
        index.append(int(np.argmax(abs(r) >= abs(r).max() * (1 - 1e-10))))
    return np.array(index)


def least_maximum(A, b, its=300):
    """A lower bound of min over c of max |b - A c|, and the maximum at the best c found (Lawson's weights): for any weights
    with sum 1, the minimum of the weighted mean square is at most the square of the least maximum."""
    weight, low, high = np.full(len(b), 1 / len(b)), 0.0, np.inf
    for _ in range(its):
        root = np.sqrt(weight)
        c = np.linalg.lstsq(root[:, None] * A, root * b, rcond=None)[0]
        r = abs(b - A @ c)
        low, high = max(low, np.sqrt(weight @ r**2)), min(high, r.max())
        weight = weight * r
        weight /= weight.sum()
    return low, high


def bounds(runs, size, loads=SHOWN):
    """The best possible approximation of S3 from the solutions of S1 and S2: the projection on the whole mesh, and the least
    error of any coefficients on the unknowns of the paper's RID that its modes describe, and in the cladding's cells that
    depend only on these (the pellet's strains depend on its radius, so that its stresses are not those of the snapshots)."""
    radii = RADII["S1 + S2"]
    (U, s), sigma = basis(snapshots(runs, size, radii, "U")), snapshots(runs, size, radii, "sigma")
    U, (S, t) = U[:, s > SPAN_FLOOR * s[0]], basis(sigma)
    S = S[:, t > SPAN_FLOOR * t[0]]
    with h5py.File(runs.path(f"{name_of(PAPER)}.h5"), "r") as h:
        node, cell = h["mesh/node_whole"][:].ravel(), h["mesh/cell_whole"][:].ravel()
        order_n, order_c = h["whole/node_id"][:].ravel(), h["whole/cell_id"][:].ravel()
        clad = outside(h["whole/xyz"][:][h["whole/cells"][:]])[cell]
        role, full, cells = h["problem/role"][:].ravel(), h["problem/fe_dof"][:].ravel(), h["mesh/cells"][:]
    inside = role > 0  # nodes of the RID; the others only belong to contacts
    modal = np.ones((len(node), 3), bool)
    modal.reshape(-1)[full] = False
    rows = (3 * node[:, None] + np.arange(3))[modal & inside[:, None]]
    own = cell[modal[cells].all(axis=(1, 2)) & clad]
    found = {"dimension": U.shape[1], "dimension_sigma": S.shape[1], "steps": []}
    for load in loads:
        with h5py.File(runs.path(f"{field_name(load)}.h5"), "r") as h:
            u = in_order(h["nodes/displacement"][:], h["mesh/node_id"][:].ravel(), order_n).ravel()
            stress = in_order(h["cells/stress"][:], h["mesh/cell_id"][:].ravel(), order_c)[:, 0]
        of_u, of_s = abs(u.reshape(-1, 3)[node[inside]]).max(), abs(stress[cell]).max()
        u_low = least_maximum(U[rows], u[rows])[0] / of_u
        s_low = least_maximum(S[6 * own], stress[own])[0] / of_s
        found["steps"].append({"load": load, "projection": np.linalg.norm(u - U @ (U.T @ u)) / np.linalg.norm(u),
                               "u": u_low, "sigma": s_low})
    return found


def outside(corners):
    """The cells of the cladding, by their corners: outside radius 4.1 as drawn."""
    middle = corners.mean(axis=1)
    return np.hypot(middle[:, 0], middle[:, 1]) > 4.1


def in_order(values, ids, wanted):
    """Rows with keys of the mesh file, reordered by a list of keys."""
    place = np.argsort(ids)
    return values[place[np.searchsorted(ids, wanted, sorter=place)]]


def contributions(runs, size, model):
    """Cells that each basis adds to the RID (20): those with all nodes in its points' supports."""
    radii, tol, _ = model
    with h5py.File(runs.path(f"{name_of(model)}.h5"), "r") as h:
        cells, group, facet_cell = h["whole/cells"][:], h["whole/facet_group"][:].ravel(), h["whole/facet_cell"][:].ravel()
        names = bytes(h["whole/group_name"][:].ravel().astype(np.uint8)).decode().split("\n")
        rid = h["mesh/cell_whole"][:].ravel()
    found, modes = {}, {}
    for field, width in (("U", 3), ("sigma", 6), ("force", 3)):
        V, s = basis(snapshots(runs, size, RADII[radii], field))
        modes[field] = kept(s, float(tol))
        points = deim(V[:, :modes[field]]) // width
        support = points if field == "sigma" else np.flatnonzero(np.isin(cells, points).any(axis=1))
        found[field] = np.isin(cells, cells[support]).all(axis=1)
    found["top"] = np.isin(np.arange(len(cells)), facet_cell[group == names.index("pellet_top")])
    found["all"] = np.any(list(found.values()), axis=0)
    found["rid"] = np.isin(np.arange(len(cells)), rid)
    return found, modes


def history_of_contact(runs, size):
    """Whether S1 is a multiple of one solution (the second singular value over the first); the steps with contact of S2."""
    s = basis(snapshots(runs, size, (4.10,), "U"))[1]
    touching = (snapshots(runs, size, (4.02,), "lambda") > 0).any(axis=0)
    return s[1] / s[0], int(touching.sum())
