"""The power ramp on a fuel rod: a reduced model of paths compared with full order, and a study of a thousand ramps; its page and pictures."""
import csv
import os
import random
import time

import h5py
import matplotlib.pyplot as plt
import numpy as np
import rope_pictures as draw
from rope_report import percent, table
from runs import SOURCE

RED, GREEN, BLUE, GREY = draw.plot.RED, draw.plot.GREEN, draw.plot.BLUE, "#777777"
NAMES, RANGES = ("gap", "q2", "creep"), ((0.03, 0.07), (35, 45), (0.5, 2))
POINT = (0.047, 41, 0.9)  # the point whose paths are drawn
UNSEEN = {"gap": (0.034, 0.058), "q2": (41,), "creep": (0.8, 1.6)}
RAMP = 10001  # h, start of the ramp
SHOWN = {6000: "6000 h", 10001: "10001 h, the ramp begins", 10001.03333: "2 min later", 10004: "3 h later", 10025.03333: "24 h later"}
SEED = 7
KINDS = (("displacement", "u"), ("stress in the RID", "sigma"), ("contact forces", "lambda"), ("inelastic strain", "inelastic"))


class Size:
    """A slice, or the pellet's mesh A, B or C."""

    def __init__(self, mesh, quick):
        self.mesh, self.points = mesh, 20 if quick else 1000
        self.inside = "contact_clad" if mesh else "ring_inside"
        self.scene = ["-scene", os.path.join("examples", "rod", "3d.yaml" if mesh else "")]
        if mesh:
            self.scene += ["-scene_mesh", os.path.join(SOURCE, "examples", "pellet", f"{mesh}.msh")]
        self.scene += ["-output_hoop_max", "sigma_tt", "-output_hoop_group", self.inside]
        self.training = "2,1,1" if quick else "3,2,2" if mesh else "5,2,2"

    def where(self, xyz):
        """The coordinate along which pressures are drawn."""
        return xyz[:, 2] if self.mesh else np.degrees(np.arctan2(xyz[:, 1], xyz[:, 0]))


def run(runs, size):
    """Runs everything; returns the reports, and the file of the study's points."""
    name = f"rod-{size.mesh or 'slice'}"
    model, mu = runs.path(f"{name}.h5"), ",".join(map(str, POINT))
    found = {"name": name, "train": runs.hyco(f"{name}-train", "train", *size.scene, "-grid", size.training, "-grid_type", "centred", "-model", model,
                                              "-hyco_snapshots", runs.path(f"{name}.snapshots"))}
    found["full"] = runs.hyco(f"{name}-full", "solve", *size.scene, "-mu", mu, "-output", runs.path(f"{name}-full.xdmf"))
    found["reduced"] = runs.hyco(f"{name}-reduced", "predict", "-model", model, "-mu", mu, "-output", runs.path(f"{name}-reduced.xdmf"))
    values = [word for p, v in UNSEEN.items() for word in (f"-values_{p}", ",".join(map(str, v)))]
    found["compare"] = runs.hyco(f"{name}-compare", "compare", *size.scene, "-model", model, *values)
    points, begin = runs.path(f"{name}-ramps.csv"), time.monotonic()
    draw_points(points, size.points)
    runs.hyco(f"{name}-ramps-report", "predict", "-model", model, "-points", points, "-table", runs.path(f"{name}-study.csv"))
    found["seconds"] = time.monotonic() - begin
    with open(runs.path(f"{name}-study.csv"), encoding="utf-8", newline="") as file:
        found["study"] = list(csv.DictReader(file))
    return found


def draw_points(path, n):
    rng = random.Random(SEED)
    with open(path, "w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([NAMES, *([rng.uniform(*r) for r in RANGES] for _ in range(n))])


class Series:
    """The fields of a series on the contact surface: the pressure and the gap of its nodes by listed time."""

    def __init__(self, path, size):
        with h5py.File(path) as file:
            self.t, xyz = file["t"][:, 0], file["mesh/xyz"][:]
            steps = sorted(k for k in file if k.startswith("step-"))
            pressure = np.array([file[f"{k}/nodes/contact_pressure"][:, 0] for k in steps])
            gap = np.array([file[f"{k}/nodes/gap"][:, 0] for k in steps])
        on = np.isfinite(gap[0]) & (pressure.max(axis=0) > 0) if pressure.max() > 0 else np.isfinite(gap[0])
        self.at, self.pressure, self.gap = size.where(xyz[on]), pressure[:, on], gap[:, on]
        order = np.argsort(self.at, kind="stable")
        self.at, self.pressure, self.gap = self.at[order], self.pressure[:, order], self.gap[:, order]

    def mean_along(self, k):
        """Pressure over the coordinate, averaged over nodes with the same one."""
        places = np.unique(np.round(self.at, 6))
        return places, np.array([self.pressure[k][np.abs(self.at - p) < 1e-5].mean() for p in places])


def pictures(runs, size, found, out):
    both = {word: Series(runs.path(f"{found['name']}-{word}.h5"), size) for word in ("full", "reduced")}
    history(found, both, out)
    if size.mesh:  # on a slice it is uniform
        pressures(size, both, out)
    study(found, out)


def history(found, both, out):
    """Gap, force and hoop stress: the year before the ramp, and the day after its start."""
    rows = (("smallest gap, mm", lambda word: both[word].gap.min(axis=1)),
            ("contact force, N", lambda word: np.array(found[word]["history"]["total_contact_force"])),
            ("largest hoop stress, MPa", lambda word: np.array(found[word]["history"]["outputs"]["hoop"])))
    fig, axes = plt.subplots(3, 2, figsize=(11, 9), sharey="row", constrained_layout=True)
    for row, (label, values) in zip(axes, rows):
        for word, style in (("full", {"color": GREY, "lw": 3, "label": "full order"}),
                            ("reduced", {"color": RED, "lw": 0, "marker": "o", "ms": 4, "label": "reduced"})):
            t, v = both[word].t, values(word)
            before = t <= RAMP + 1e-9
            row[0].plot(t[before], v[before], **style)
            row[1].plot(t[t >= RAMP] - RAMP, v[t >= RAMP], **style)
        row[0].set_ylabel(label)
        row[1].set_xscale("symlog", linthresh=0.05)
        row[1].set_xticks([0, 0.05, 0.5, 5, 24], ["0", "0.05", "0.5", "5", "24"])
        row[1].minorticks_off()
        for ax in row:
            ax.grid(alpha=0.3)
    axes[0, 0].legend()
    axes[2, 0].set_xlabel("t, h")
    axes[2, 1].set_xlabel("h since the ramp began")
    out.save(fig, "paths.png")


def pressures(size, both, out):
    fig, ax = plt.subplots(figsize=(9, 5), constrained_layout=True)
    for i, (t, words) in enumerate(SHOWN.items()):
        colour = plt.cm.viridis(i / (len(SHOWN) - 0.5))
        for word, style in (("full", {"lw": 1.6}), ("reduced", {"lw": 0, "marker": "o", "ms": 4})):
            k = int(np.argmin(np.abs(both[word].t - t)))
            at, p = both[word].mean_along(k)
            ax.plot(at, p, color=colour, label=words if word == "full" else None, **style)
    ax.set(xlabel="z, mm" if size.mesh else "angle, degrees", ylabel="contact pressure, MPa", title="full order: lines; reduced: dots")
    ax.grid(alpha=0.3)
    ax.legend(fontsize=9)
    out.save(fig, "pressure.png")


def study(found, out):
    rows = converged(found)
    fig, axes = plt.subplots(1, 2, figsize=(11, 4.2), constrained_layout=True)
    for ax, column, label, factor in ((axes[0], "path_hoop", "largest hoop stress of a ramp, MPa", 1),
                                      (axes[1], "largest_rid_inelastic", "largest inelastic strain, %", 100)):
        values = factor * np.array([float(r[column]) for r in rows])
        ax.hist(values, bins=30, color=BLUE)
        for q in (0.5, 0.95):
            ax.axvline(np.quantile(values, q), color=RED, lw=1.2, ls="-" if q == 0.5 else "--", label=f"{100 * q:.0f} % of the ramps are below")
        ax.set(xlabel=label, ylabel="ramps")
        ax.grid(alpha=0.3)
    axes[0].legend(fontsize=9)
    out.save(fig, "study.png")


def converged(found):
    return [r for r in found["study"] if float(r["converged"]) > 0.5]


def quantiles(rows, column, factor=1.0):
    values = factor * np.array([float(r[column]) for r in rows])
    return [f"{np.quantile(values, q):.3g}" for q in (0.05, 0.5, 0.95, 1)]


def report(found, size, folder):
    """The page; `folder` contains its pictures."""
    train, compare, rows = found["train"], found["compare"], converged(found)
    seconds = {"full": sum(found["full"]["history"]["seconds"]), "reduced": sum(found["reduced"]["history"]["seconds"])}
    errors = table(["largest error over four unseen paths and their listed times", "%"],
                   [(label, percent(compare[f"worst_{kind}"]["max"])) for label, kind in KINDS])
    spread = table(["not exceeded in this share of the ramps", "5 %", "50 %", "95 %", "all"],
                   [("largest hoop stress inside the cladding, MPa", *quantiles(rows, "path_hoop")),
                    ("largest inelastic strain, %", *quantiles(rows, "largest_rid_inelastic", 100)),
                    ("largest contact force, N", *quantiles(rows, "largest_contact_force"))])
    where = f"`examples/rod/3d.yaml` on mesh {size.mesh} of the pellet" if size.mesh else "`examples/rod`, a slice of the rod"
    pressure = f"![contact pressure at five times]({folder}/pressure.png)\n\n" if size.mesh else ""
    command = f"scripts/reproduce rod{' --mesh ' + size.mesh if size.mesh else ''}"
    return f"""# A power ramp on a fuel rod, a thousand times

Written by `{command}`, with the numbers of its runs. The scene is {where}. In a year of constant power the cladding creeps onto the
pellet. A ramp to the power q2 in two minutes follows, then a day at this power and a return to zero. The parameters are the cold gap, q2, and a factor of the creep rate.

{found['full']['n_dof']} unknowns, {found['full']['n_contacts']} contacts; {train['n_samples']} training paths, {train['n_modes']} modes, an RID of {percent(train['rid_fraction'])} % of
the cells. The time steps of a path take {seconds['full']:.3g} s at full order and {seconds['reduced']:.3g} s with the reduced model (one core of a machine that ran other programs too).

{errors}
## One ramp: gap {POINT[0]} mm, q2 {POINT[1]} kW/m, creep {POINT[2]}

![gap, force and hoop stress over time]({folder}/paths.png)

The curves begin at a smaller gap than the cold one, since the temperatures and pressures of the first time act at once.

{pressure}## The study

    build/hyco predict -model rod.h5 -points ramps.csv -table study.csv

{len(found['study'])} ramps, with parameters distributed uniformly in their ranges, take {found['seconds']:.0f} s, the whole command with outputs and contact results; {len(found['study']) - len(rows)} did not converge (`-scatter 1000` gives
points without a file). The hoop stress, negative where contact does not outweigh the outer pressure, is an output
that is named in the training (`-output_hoop_max sigma_tt -output_hoop_group {size.inside}`); `path_hoop` in the table is its largest value over a path.

{spread}
![distribution of the largest stress and strain]({folder}/study.png)
"""
