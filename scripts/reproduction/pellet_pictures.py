"""Section 7: the pictures, with functions of scripts/plot."""
import matplotlib.pyplot as plt
import numpy as np
import pellet
from matplotlib.colors import Normalize
from rope_pictures import ORANGE, VIOLET, plot

VIEW, OUTSIDE = (22, -125), (22, 40)  # seen from the axis; from outside, where the pressures act
GHOST = {"facecolors": (0.6, 0.6, 0.6, 0.10), "edgecolors": "none"}
COLOURS = {"U": plot.RED, "sigma": plot.BLUE, "force": plot.GREEN, "top": ORANGE}
STYLE = {"S1 + S2": (plot.RED, "o-"), "5 radii": (ORANGE, "s-"), "9 radii": (plot.BLUE, "^-")}


def panels(rows, columns, width=3.0, height=3.5, right=0.98):
    fig, axes = plt.subplots(rows, columns, figsize=(width * columns, height * rows), subplot_kw={"projection": "3d"},
                             squeeze=False)
    fig.subplots_adjust(left=0.0, right=right, bottom=0.0, top=0.94, wspace=0.02, hspace=0.12)
    return fig, axes


def bare(ax, xyz, view=VIEW):
    """The frame of a panel without numbers: only its proportions."""
    plot.frame_3d(ax, xyz, view)
    ax.set_axis_off()
    ax.set_box_aspect(np.ptp(xyz, axis=0), zoom=1.02)


def ghost(ax, mesh, chosen):
    """The surrounding cells, without lines."""
    faces, _ = mesh.skin(chosen)
    plot.draw_faces(ax, mesh.xyz, faces, 3, **GHOST)


def solid(ax, mesh, chosen, colour):
    faces, _ = mesh.skin(chosen)
    if len(faces):
        plot.draw_faces(ax, mesh.xyz, faces, 3, facecolors=colour, edgecolors="k", linewidths=0.15)


def coloured(ax, mesh, chosen, values, on_cells, norm, cmap):
    """Draws values on the skin of chosen cells; returns the object for a colour bar."""
    faces, owner = mesh.skin(chosen)
    shown = plot.face_values(values, on_cells, faces, owner)
    drawn = plot.draw_faces(ax, mesh.xyz, faces, 3, cmap=cmap, norm=norm, edgecolors="none")
    drawn.set_array(shown)
    drawn.set_edgecolor(drawn.to_rgba(shown))     # no white seams between faces
    drawn.set_linewidth(0.2)
    return drawn


def bar(fig, drawn, ax, label):
    place = ax.get_position()
    beside = fig.add_axes([place.x1 - 0.005, place.y0 + 0.25 * place.height, 0.01, 0.5 * place.height])
    colours = fig.colorbar(drawn, cax=beside)
    colours.set_label(label, fontsize=9)
    colours.formatter.set_powerlimits((-2, 3))
    colours.update_ticks()
    beside.tick_params(labelsize=8)
    beside.yaxis.get_offset_text().set_fontsize(8)


def cladding_of(mesh):
    return pellet.outside(mesh.xyz[mesh.cells])


# ------------------------------------------------------------------------------------------------ figure 13

def figure_13(runs, model, parts, modes, other, pictures):
    m = plot.Model(runs.path(f"{pellet.name_of(model)}.h5"))
    mesh = m.whole
    fig, axes = panels(2, 4)
    loads(axes[0, 0], runs, model, mesh)
    shown = [("U", f"$\\Omega_u$: {modes['U']} points"), ("sigma", f"$\\Omega_\\sigma$: {modes['sigma']} points"),
             ("force", f"$\\Omega_F$: {modes['force']} points"), ("top", "$\\Omega_{ROI}$: top of the pellet")]
    for ax, (key, title) in zip([*axes[0, 1:], axes[1, 0]], shown):
        ghost(ax, mesh, None)
        solid(ax, mesh, parts[key], COLOURS[key])
        ax.set_title(f"{title}\n{parts[key].sum()} elements", fontsize=9)
    union(axes[1, 1], mesh, parts, shown)
    for ax, chosen, title in ((axes[1, 2], parts["rid"], "RID: extension and layer added"),
                              (axes[1, 3], other, "RID of S1 + S2")):
        ghost(ax, mesh, ~chosen)
        solid(ax, mesh, chosen, "#e8c9a0")
        ax.set_title(f"{title}\n{chosen.sum()} of {len(chosen)} elements", fontsize=9)
    for ax in axes.ravel():
        bare(ax, mesh.xyz, VIEW if ax is not axes[0, 0] else OUTSIDE)
    pictures.save(fig, "figure-13.png")


def loads(ax, runs, model, mesh):
    """The two bodies and the surfaces under pressure."""
    with plot.open_h5(runs.path(f"{pellet.name_of(model)}.h5"), "model") as h:
        names = bytes(h["whole/group_name"][:].ravel().astype(np.uint8)).decode().split("\n")
        facets, group = h["whole/facets"][:], h["whole/facet_group"][:].ravel()
    clad = cladding_of(mesh)
    ax.computed_zorder = False                    # the loaded surfaces last
    for chosen, colour in ((~clad, "#e9dfd2"), (clad, "#cfd8e3")):
        plot.draw_faces(ax, mesh.xyz, mesh.skin(chosen)[0], 3, facecolors=colour, edgecolors="none")
    for name, colour in (("pellet_top", ORANGE), ("clad_outer_high", VIOLET), ("clad_outer_low", plot.RED)):
        plot.draw_faces(ax, mesh.xyz, facets[group == names.index(name)], 3, facecolors=colour, edgecolors="none")
    ax.set_title("5 MPa on top (orange); outside 50 MPa\n(violet), below 2 mm 250 MPa (red)", fontsize=8)


def union(ax, mesh, parts, order):
    ghost(ax, mesh, None)
    left = np.ones(len(mesh.cells), bool)
    for key, _ in order[::-1]:
        solid(ax, mesh, parts[key] & left, COLOURS[key])
        left &= ~parts[key]
    ax.set_title(f"$\\Omega_A$: their union\n{parts['all'].sum()} elements", fontsize=9)


# ------------------------------------------------------------------------------------------------ figure 14

def figure_14(runs, model, pictures):
    m = plot.Model(runs.path(f"{pellet.name_of(model)}.h5"))
    clad = cladding_of(m.whole)
    numbers = [*range(6), m.V.shape[1] - 1]
    fig, axes = panels(2, 4)
    for ax, k in zip(axes.ravel(), numbers):
        values = m.V[:, k].reshape(-1, 3)[:, 0]
        largest = np.percentile(abs(values[np.unique(m.whole.cells[clad])]), 99)
        coloured(ax, m.whole, clad, values / largest, False, Normalize(-1, 1), "RdBu_r")
        ax.set_title(f"mode {k + 1} of {m.V.shape[1]}", fontsize=9)
        bare(ax, m.whole.xyz)
    spectrum(fig, axes[1, 3], runs)
    pictures.save(fig, "figure-14.png")


def spectrum(fig, ax, runs):
    """In the place of the last panel: the singular values of the modes."""
    place = ax.get_position()
    ax.remove()
    flat = fig.add_axes([place.x0 + 0.05, place.y0 + 0.1, place.width - 0.06, place.height - 0.14])
    for model in (pellet.PAPER, pellet.FINE):
        with plot.open_h5(runs.path(f"{pellet.name_of(model)}.h5"), "model") as h:
            s = h["problem/singular_values"][:].ravel()
        colour, style = STYLE[model[0]]
        flat.semilogy(np.arange(len(s)) + 1, s / s[0], style, ms=4, color=colour, label=f"{model[0]}, {model[1]}")
    flat.set_title("singular values, displacement", fontsize=9)
    flat.grid(alpha=0.3)
    flat.tick_params(labelsize=8)
    flat.legend(fontsize=8)


# ------------------------------------------------------------------------------------------------ figures 15 and 16

def side_by_side(runs, models, field, component, label, cladding, pictures, name):
    """Full order, and each model on its RID; below each model its difference from full order."""
    full = plot.Solution(runs.path(f"{pellet.field_name(1.0)}.h5"))
    reduced = [(m, plot.Solution(runs.path(f"{pellet.name_of(m)}-S3.h5"))) for m in models]
    a, on_cells, _ = full.field(field, component)
    part = cladding_of(full.mesh) if cladding else np.ones(len(full.mesh.cells), bool)
    fig, axes = panels(2, 1 + len(models), 3.6, 3.5, right=0.93)
    norm = Normalize(*limits(full.mesh, part, a, on_cells))
    drawn = coloured(axes[0, 0], full.mesh, part, a, on_cells, norm, "viridis")
    axes[0, 0].set_title("full order (FOM)", fontsize=9)
    axes[1, 0].set_visible(False)
    shown = [(ax, s, s.field(field, component)[0], part & (s.cells["rid"][:, 0] > 0.5), m)
             for ax, (m, s) in zip(axes[:, 1:].T, reduced)]
    for ax, s, b, chosen, m in shown:
        for row in (0, 1):
            ghost(ax[row], full.mesh, part & ~chosen)
        coloured(ax[0], full.mesh, chosen, b, on_cells, norm, "viridis")
        far, most = (abs(inside(full.mesh, chosen, v, on_cells)).max() for v in (b - a, a))
        bar(fig, coloured(ax[1], full.mesh, chosen, b - a, on_cells, Normalize(-far, far), "RdBu_r"), ax[1], "")
        ax[0].set_title(f"reduced (HROM), {m[0]}, {m[1]}", fontsize=9)
        ax[1].set_title(f"HROM - FOM, at most {100 * far / most:.2g} % of the largest", fontsize=9)
    for ax in axes.ravel():
        bare(ax, full.mesh.xyz)
    bar(fig, drawn, axes[0, -1], label)
    pictures.save(fig, name)


def inside(mesh, chosen, values, on_cells):
    return values[chosen] if on_cells else values[np.unique(mesh.cells[chosen])]


def limits(mesh, chosen, values, on_cells):
    shown = inside(mesh, chosen, values, on_cells)
    return shown.min(), shown.max()


def errors_by_step(entries, contact, load, pictures):
    """entries: model, its table. Errors over the RID by load, from the first contact on."""
    fig, axes = plt.subplots(1, 2, figsize=(11, 4.2), sharex=True, constrained_layout=True)
    for (radii, tol, _), table in entries:
        colour, style = STYLE[radii]
        for ax, key in zip(axes, ("error_u_rid", "error_sigma_11")):
            value = np.where(contact & (table["converged"] > 0.5), 100 * table[key], np.nan)
            ax.semilogy(load, value, style, ms=4, color=colour, label=f"{radii}, {tol}")
            failed = load[contact & (table["converged"] < 0.5)]
            ax.plot(failed, np.full(len(failed), 0.02), "x", color=colour, transform=ax.get_xaxis_transform())
    for ax, title, paper in zip(axes, ("displacement", "stress 11"), (1, 5)):
        ax.axhline(paper, color="k", lw=1, ls="--", label=f"the paper's {paper} %")
        ax.set(title=title, xlabel="load", ylabel="largest error over the RID [%]")
        ax.grid(alpha=0.3, which="both")
        ax.legend(fontsize=8)
    pictures.save(fig, "pellet-errors.png")
