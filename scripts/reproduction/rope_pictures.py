"""Section 6: the pictures, with functions of scripts/plot."""
import io
import os

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.lines import Line2D
from PIL import Image
from runs import load_script

plot = load_script("plot")
VIOLET, ORANGE = "#7a4fa3", "#e08a1e"
LARGE = 140000                                    # bytes of a picture


class Pictures:
    """PNG pictures in one folder."""

    def __init__(self, folder):
        self.folder = folder
        os.makedirs(folder, exist_ok=True)

    def save(self, fig, name):
        """Large ones in 256 colours, with a third of the bytes."""
        whole = io.BytesIO()
        fig.savefig(whole, format="png", dpi=100)
        plt.close(fig)
        path = os.path.join(self.folder, name)
        if whole.tell() <= LARGE:
            with open(path, "wb") as file:
                file.write(whole.getvalue())
            return
        with Image.open(whole) as picture:
            few = picture.convert("RGB").quantize(256, method=Image.Quantize.MEDIANCUT, kmeans=2, dither=Image.Dither.NONE)
            few.save(path, optimize=True)


def rope_of(runs, name):
    s = plot.Solution(runs.path(f"{name}.h5"))
    along = np.argsort(s.mesh.xyz[:, 0])
    return s, s.mesh.xyz[along, 0], s.u[along, 0], s.nodes["contact_force"][along, 0]


def figure_3(runs, pictures):
    fig, axes = plt.subplots(2, 2, figsize=(11, 7), sharex=True, constrained_layout=True)
    for row, (parameter, held) in zip(axes, (("mu1", "mu2"), ("mu2", "mu1"))):
        for k in range(5):
            s, x, u, force = rope_of(runs, f"{parameter}-{k}")
            colour = plt.cm.viridis(k / 4.5)
            row[0].plot(x, u, color=colour, label=f"{parameter} = {s.mu[parameter]:.3g}")
            row[1].plot(x, force, color=colour)
        row[0].set(ylabel="displacement", title=f"{held} = {s.mu[held]:.3g}")
        row[1].set(ylabel="contact force (nodal)")
        row[0].legend(fontsize=9)
    for ax in axes.ravel():
        ax.grid(alpha=0.3)
    axes[1, 0].set_xlabel("x")
    axes[1, 1].set_xlabel("x")
    pictures.save(fig, "figure-03.png")


def figure_4(curves, pictures):
    """curves: name, k, error, style, colour."""
    fig, ax = plt.subplots(figsize=(8, 5), constrained_layout=True)
    for name, k, left, style, colour in curves:
        ax.semilogy(k, left, style, ms=5, color=colour, label=name)
    ax.set(xlabel="vectors k", ylabel="relative error, squared (1 - E(k))", xlim=(0, 40), ylim=(1e-16, 2))
    ax.grid(alpha=0.3)
    ax.legend()
    pictures.save(fig, "figure-04.png")


def figure_5(runs, pictures):
    m = plot.Model(runs.path("all.h5"))
    order = np.argsort(m.whole.xyz[:, 0])
    fig, ax = plt.subplots(figsize=(8, 5), constrained_layout=True)
    shown = [k for k in (0, 1, 2, 3, 5, 8) if k < m.V.shape[1]]
    for k in shown:
        ax.plot(m.whole.xyz[order, 0], m.V[order, k], lw=1.5, color=plt.cm.viridis(k / 9), label=f"mode {k + 1}")
    ax.set(xlabel="x", ylabel=f"POD modes (of {m.V.shape[1]})")
    ax.grid(alpha=0.3)
    ax.legend(ncol=3, fontsize=9)
    pictures.save(fig, "figure-05.png")


def figure_6(runs, pictures):
    m = plot.Model(runs.path("all.h5"))
    fig, (top, bottom) = plt.subplots(2, 1, figsize=(8, 5), sharex=True, constrained_layout=True,
                                      gridspec_kw={"height_ratios": [1, 3]})
    x = m.whole.xyz[:, 0]
    top.axhline(0, color="k", lw=0.8, zorder=0)
    for role, colour, size, name in ((plot.OUTSIDE, "#aaaaaa", 5, "outside"), (plot.INTERFACE, plot.GREEN, 16, "I"),
                                     (plot.IN_A, plot.RED, 16, "A")):
        at = x[m.role == role]
        top.plot(at, np.zeros(len(at)), "|", ms=size, mew=2 if size > 5 else 1, color=colour, label=name)
    top.set(yticks=[], ylim=(-1, 2.2), title=m.counts())
    top.legend(loc="upper center", ncol=3, fontsize=9, frameon=False)
    s = plot.Solution(runs.path("full-point.h5"))
    inside, ground = plot.obstacle(s)
    bottom.fill_between(inside, ground, ground.min() - 0.05, color="#cfc6b8", lw=0)
    bottom.plot(inside, ground, color="k", lw=1.2)
    bottom.set(xlabel="x", ylabel=f"obstacle, mu2 = {s.mu['mu2']:g}")
    pictures.save(fig, "figure-06.png")


def error_maps(runs, model, pictures, name):
    names, table = plot.read_table(runs.path(f"{model}.csv"))
    units, points = plot.read_parameters(runs.path(f"{model}.h5"))
    fig = plot.errors_map(table, names, ["error_u", "error_lambda_rid", "error_lambda"], units, points, [0, 1])
    pictures.save(fig, name)


def point_solutions(runs, pictures, name, models):
    """models: label, model."""
    solutions = [("full order", plot.Solution(runs.path("full-point.h5")))]
    solutions += [(label, plot.Solution(runs.path(f"{model}-point.h5"))) for label, model in models]
    fig = plot.draw_rope(solutions)
    fig.suptitle(solutions[0][1].title())
    pictures.save(fig, name)


def history(panels, pictures, name):
    """panels: a title and curves (label, iterations, values, style, colour), two panels in a row; optionally one more
    curve with its own axis."""
    rows = (len(panels) + 1) // 2
    fig, axes = plt.subplots(rows, 2, figsize=(12, 4.4 * rows), squeeze=False, constrained_layout=True)
    for ax, (title, curves, *other) in zip(axes.ravel(), panels):
        for label, iterations, values, style, colour in curves:
            ax.semilogy(iterations, 100 * np.array(values), style, ms=4, lw=1.4, color=colour, label=label)
        ax.set(title=title, xlabel="iteration", ylabel="mean relative error [%]")
        ax.grid(alpha=0.3, which="major")
        for label, iterations, values, style, colour in other:
            right = ax.twinx()
            drawn = right.semilogy(iterations, values, style, lw=1.4, color=colour, label=label)
            right.set(ylabel="mean penetration, 2-norm")
            ax.add_line(Line2D([], [], ls=style, color=colour, label=drawn[0].get_label()))
        ax.legend(fontsize=8)
    pictures.save(fig, name)
