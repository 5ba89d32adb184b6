"""Section 6: the runs. Each function returns reports; other files make pictures and text from them."""
import csv
import os

import h5py
import numpy as np

SCENE = ("-scene", os.path.join("examples", "rope", "paper.yaml"))
POINT = (0.07, 0.17)
# the paper's greedy thresholds (6.6.2); the paper does not say which displacements are full order there
THRESHOLDS = ("-hyco_pod_tol", "1e-10", "-hyco_rid_dual_tol", "5e-2")
PAPER_GREEDY = (*THRESHOLDS, "-hyco_hybrid", "all")
FINE_GREEDY = ("-hyco_pod_tol", "1e-14", "-hyco_rid_dual_tol", "5e-2", "-hyco_hybrid", "all", "-hyco_rid_layers", 1)
FINE_GRID = ("-hyco_pod_tol", "1e-11", "-hyco_deim_type", "qdeim", "-hyco_rid_layers", 1, "-hyco_hybrid", "all")
PROJECTION = ("-hyco_model_type", "projection")

# name: options of train on the 10 x 12 grid
REGULAR = {"rank": ("-hyco_hybrid", "rank"), "all": ("-hyco_hybrid", "all"), "fine": FINE_GRID, "pb9": PROJECTION,
           "pb14": (*PROJECTION, "-hyco_pod_tol", "6e-9"), "pb-dual": (*PROJECTION, "-hyco_dual", "snapshots")}
GREEDY = {"greedy-paper": PAPER_GREEDY, "greedy-1e-12": (*PAPER_GREEDY, "-hyco_pod_tol", "1e-12"),
          "greedy-fine": FINE_GREEDY,
          "greedy-pb": (*PROJECTION, "-hyco_pod_tol", "1e-10", "-hyco_greedy_indicator", "penetration")}


class Size:
    """The extent of the runs: the paper's sizes, or a few seconds as a test."""

    def __init__(self, quick):
        self.test_grid = "10,12" if quick else "100,120"
        self.training_grid = "5,6" if quick else "20,24"
        self.history_grid = "5,6" if quick else "20,24"
        self.iterations = 4 if quick else 50
        self.every = 4 if quick else 5
        self.vectors = [1, 5, 9] if quick else [1, 2, 3, 5, 7, 9, 12, 14, 18, 22, 26, 30]
        self.slow_vectors = [2] if quick else [2, 5, 9, 14, 22, 30]
        self.slow_its = 200 if quick else 10000

    def kept(self):
        """The iterations whose models are judged for the histories."""
        return sorted({*range(0, self.iterations + 1, self.every), self.iterations})


def train_regular(runs, name):
    return runs.hyco(f"{name}-train", "train", *SCENE, "-grid", "10,12", "-grid_type", "centred", "-hyco_snapshots", runs.path("grid.snapshots"),
                     "-model", runs.path(f"{name}.h5"), *REGULAR[name])


def compare(runs, name, grid):
    return runs.hyco(f"{name}-compare", "compare", *SCENE, "-model", runs.path(f"{name}.h5"), "-grid", grid, "-table",
                     runs.path(f"{name}.csv"))


def at_point(runs, name):
    """Fields and the report of a prediction at mu = (0.07, 0.17), and its errors there."""
    predicted = runs.hyco(f"{name}-point", "predict", "-model", runs.path(f"{name}.h5"), "-mu", "%g,%g" % POINT, "-output",
                          runs.path(f"{name}-point.xdmf"))
    errors = runs.hyco(f"{name}-point-errors", "compare", *SCENE, "-model", runs.path(f"{name}.h5"), "-values_mu1", POINT[0],
                       "-values_mu2", POINT[1])
    return predicted, errors


def regular(runs, name, size):
    train = train_regular(runs, name)
    return {"train": train, "compare": compare(runs, name, size.test_grid), "point": at_point(runs, name)}


def solutions(runs):
    """Full order at the point of figures 8 and 9, and over each parameter for figure 3."""
    where = {"full-point": POINT}
    where.update({f"mu1-{k}": (mu1, 0.225) for k, mu1 in enumerate(np.linspace(0.05, 0.25, 5))})
    where.update({f"mu2-{k}": (0.15, mu2) for k, mu2 in enumerate(np.linspace(-0.05, 0.5, 5))})
    for name, mu in where.items():
        runs.hyco(name, "solve", *SCENE, "-mu", "%.17g,%.17g" % mu, "-output", runs.path(f"{name}.xdmf"))
    return list(where)


# ------------------------------------------------------------------------------------------------ figure 4

def grid_snapshots(runs):
    """Displacements and forces of the grid's solutions, one in each row."""
    folder = runs.path("grid.snapshots")
    U, forces = [], []
    for name in sorted(os.listdir(folder)):
        if name.endswith(".h5"):
            with h5py.File(os.path.join(folder, name), "r") as h:
                U.append(h["U"][:].ravel())
                forces.append(h["lambda"][:].ravel())
    return np.array(U), np.array(forces)


def left_by_pod(rows):
    """1 - E(k) of (18) for k = 1, 2, ..."""
    s2 = np.linalg.svd(rows, compute_uv=False)**2
    return np.append(np.cumsum(s2[::-1])[::-1][1:], 0) / s2.sum()


def left_by_nnmf(runs, k, its):
    name = f"nnmf-{its}-{k}"
    report = runs.hyco(name, "train", *SCENE, "-grid", "10,12", "-grid_type", "centred", "-hyco_snapshots", runs.path("grid.snapshots"), "-model",
                       runs.path(f"{name}.h5"), *PROJECTION, "-hyco_nnmf_vectors", k, "-hyco_nnmf_max_its", its)
    return k, report["dual_misfit"]


# ------------------------------------------------------------------------------------------------ greedy

def greedy(runs, name, size):
    """A greedy training that stores the model of each iteration, and the comparison of the last one."""
    train = runs.hyco(f"{name}-train", "train", *SCENE, "-greedy", "-training_grid", size.training_grid, "-max_snapshots",
                      4 + size.iterations, "-target", "1e-30", "-hyco_greedy_keep", "-model", runs.path(f"{name}.h5"),
                      "-table", runs.path(f"{name}-history.csv"), *GREEDY[name])
    return {"train": train, "compare": compare(runs, name, size.test_grid)}


def kept_model(runs, name, iteration):
    return runs.path(f"{name}.h5.snapshots", f"greedy-{iteration:03d}.h5")


def judge(runs, name, model, size):
    report = runs.hyco(name, "compare", *SCENE, "-model", model, "-grid", size.history_grid)
    return {"failed": report["not_converged"], **{key: value["mean"] for key, value in report.items()
                                                  if isinstance(value, dict) and "mean" in value}}


def judge_kept(runs, name, iteration, size):
    """The mean errors of the stored model of an iteration."""
    return judge(runs, f"{name}-{iteration:03d}", kept_model(runs, name, iteration), size)


def judge_other(runs, name, iteration, options, size):
    """The mean errors of a model of another type from the solutions of an iteration."""
    this = f"{name}-other-{iteration:03d}"
    with h5py.File(kept_model(runs, name, iteration), "r") as h:
        points = h["training/points"][:]
    with open(runs.path(f"{this}.csv"), "w", newline="", encoding="ascii") as file:
        csv.writer(file).writerows([["mu1", "mu2"], *[["%.17g" % v for v in p] for p in points]])
    runs.hyco(f"{this}-train", "train", *SCENE, "-points", runs.path(f"{this}.csv"), "-hyco_keep_singular", "-model",
              runs.path(f"{this}.h5"), *options)
    return judge(runs, this, runs.path(f"{this}.h5"), size)


def indicators(runs, name):
    """The table of a greedy training by columns; empty entries are NaN."""
    with open(runs.path(f"{name}-history.csv"), newline="", encoding="ascii") as file:
        rows = list(csv.reader(file))
    return {key: np.array([float(row[k] or "nan") for row in rows[1:]]) for k, key in enumerate(rows[0])}
