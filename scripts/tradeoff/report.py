"""The sweep's tables and its Pareto diagram."""
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

PLAIN = "a factor per iteration"
LEVELS = [0.1, 0.01, 0.001, 0.0001]
QUANTITIES = [("u", "displacement"), ("sigma", "stress of the RID's cells"), ("lambda_rid", "forces on the RID's contacts"),
              ("lambda", "all contact forces")]
COLORS = {"hybrid": "#2c5aa0", "projection": "#c8352c", "bodies": "#3a9a4e"}
MARKS = {"hybrid": "o", "projection": "s", "bodies": "^"}
SHOWN = 1e-4  # per cent: smaller errors tell nothing
PUBLISHED = ["id", "label", "type", "modes", "rid_fraction", "offline_s", "train_s", "model_bytes", "memory_mb", "path_s",
             *(f"{name}_s{end}" for name in ("batch", "single") for end in ("", "_min", "_max")), "ramp_s", "ramp_n",
             *(f"{name}_{which}" for name in ("u", "sigma", "inelastic", "lambda_rid", "lambda") for which in ("mean", "median", "max")), "bounded", "ratio", "status"]


def kinds(rows):
    """Types with settings, in the order of the tables."""
    return [kind for kind in COLORS if kind in {r["type"] for r in rows}]


def good(rows):
    return [r for r in rows if r["status"] == "ok"]


def pareto(rows, error, time="batch_s"):
    """The rows that no other row dominates in both quantities."""
    front, best = [], float("inf")
    for row in sorted(good(rows), key=lambda r: (r[time], r[error])):
        if row[error] < best:
            front.append(row)
            best = row[error]
    return front


def cheapest(rows, error, level, time="batch_s"):
    return min((r for r in good(rows) if r[error] <= level), key=lambda r: r[time], default=None)


def recommended(rows):
    """(quantity, type, level): the cheapest row whose largest error is within the level, or None."""
    return {(q, kind, level): cheapest([r for r in rows if r["type"] == kind], f"{q}_max", level) for q, _ in QUANTITIES
            for kind in kinds(rows) for level in LEVELS}


def joint(rows, bounds, kind=None):
    """The cheapest row of a type (any: None) within all bounds."""
    return min((r for r in good(rows) if kind in (None, r["type"]) and all(r[e] <= b for e, b in bounds.items())),
               key=lambda r: r["batch_s"], default=None)


def finalists(case, rows):
    """All rows of the tables: the recommended ones, the fronts of the mean errors, the combined requirements. Among rows with equal times in the
    sweep, paired timing may change the order; a row that it has not timed shows a single time."""
    named = [*recommended(rows).values(), *(r for q, _ in QUANTITIES for r in pareto(rows, f"{q}_mean")),
             *(joint(rows, bounds, kind) for _, bounds in case.wanted for kind in kinds(rows))]
    named = [r for r in named if r]
    return list({r["id"]: r for r in named}.values())


def seconds(value):
    if value is None:
        return ""
    unit = next((u for u in ((1, "s"), (1e-3, "ms"), (1e-6, "us")) if value >= u[0]), (1e-6, "us"))
    shown = value / unit[0]
    return f"{shown:.0f} {unit[1]}" if shown >= 100 else f"{shown:.3g} {unit[1]}"


def percent(value):
    return f"{100 * value:.2g}" if value < 1e6 else f"{value:.0e}"


def table(head, lines):
    return ["| " + " | ".join(head) + " |", "|" + "---|" * len(head), *("| " + " | ".join(map(str, line)) + " |" for line in lines)]


def speedup(value):
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"


def answer(rows, full):
    """The speed-ups over the warm full order of the cheapest setting of each type for each accuracy."""
    found = recommended(rows)
    lines = []
    for q, words in QUANTITIES:
        each = [[found[q, kind, level] for kind in kinds(rows)] for level in LEVELS]
        lines.append([words, *(", ".join(speedup(full["batch_s"] / r["batch_s"]) if r else "-" for r in cell) for cell in each)])
    return table(["largest error of", *(f"{100 * level:g} %" for level in LEVELS)], lines)


def wanted(case, rows, full):
    """The cheapest row of each type that meets several bounds at once: times and, in brackets, speed-ups over warm full order; the last over the other."""
    lines = []

    def cell(row, name):
        return f"{seconds(row[name])} ({speedup(full['warm'][name] / row[name])})"

    names = ["batch_s", "single_s", *(["ramp_s"] if case.ramp else [])]
    for words, bounds in case.wanted:
        for kind in kinds(rows):
            r = joint(rows, bounds, kind)
            if r:
                lines.append(["" if words in (line[0] for line in lines) else words, f"{kind} {r['id']}", *(cell(r, n) for n in names), speedup(full[PLAIN]["single_s"] / r["single_s"])])
        if not joint(rows, bounds):
            lines.append([words, "none", *[""] * (len(names) + 1)])
    for name, r in full.items():
        lines.append(["full order", name, *(seconds(r[n]) if n in r else "" for n in names), ""])
    return table(["required accuracy", "cheapest setting", "a solve of a set", "a single solve",
                  *([f"a ramp of {full['warm']['ramp_n']:.0f} solves at a new {case.ramp[0]}"] if case.ramp else []), f"speed-up over {PLAIN}"], lines)


def published(rows):
    """The columns of docs/tradeoff/*.csv, with the digits that the measurement has."""
    return [{name: f"{r[name]:.3g}" if isinstance(r[name], float) else r[name] for name in PUBLISHED if name in r} for r in rows]


def shown(row, quantity):
    """A row's mean error in per cent, as the diagram has it."""
    return max(100 * row[quantity + "_mean"], SHOWN)


def number(axis, marks):
    """Numbers beside marks: each at the first of eight places where it touches no other number and no other mark."""
    axis.figure.canvas.draw()
    at = {label: axis.transData.transform((x, y)) for x, y, label in marks}
    taken = [(x - 5, y - 5, x + 5, y + 5) for x, y in at.values()]
    for x, y, label in marks:
        px, py = at[label]
        wide = 7 * len(label)
        for dx, dy in ((6, 3), (6, -12), (-6 - wide, 3), (-6 - wide, -12), (-wide / 2, 8), (-wide / 2, -18), (14, 14), (-14 - wide, 14)):
            box = (px + dx, py + dy, px + dx + wide, py + dy + 10)
            if not any(box[0] < b[2] and b[0] < box[2] and box[1] < b[3] and b[1] < box[3] for b in taken):
                break
        taken.append(box)
        axis.annotate(label, (x, y), xytext=((box[0] - px) * 72 / axis.figure.dpi, (box[1] - py) * 72 / axis.figure.dpi), textcoords="offset points", fontsize=8)


def plot(case, rows, full, path):
    figure, axes = plt.subplots(2, 2, figsize=(11, 8.2), layout="constrained", sharex=True)
    for axis, (q, words) in zip(axes.flat, QUANTITIES):
        for kind in kinds(rows):
            mine = [r for r in good(rows) if r["type"] == kind]
            axis.scatter([r["batch_s"] for r in mine], [shown(r, q) for r in mine], s=22, alpha=0.55,
                         marker=MARKS[kind], color=COLORS[kind], label=kind if mine else None)
        front = pareto(rows, q + "_mean")
        axis.step([r["batch_s"] for r in front], [shown(r, q) for r in front], where="post", color="k", lw=1, label="Pareto front")
        for name, style in (("warm", "-"), (PLAIN, "--")):
            if name in full:
                axis.axvline(full[name]["batch_s"], color="0.4", ls=style, label=f"full order, {name}")
        for level in LEVELS:
            axis.axhline(100 * level, color="0.85", lw=0.8, zorder=0)
        axis.set(xscale="log", yscale="log", title=f"{words}", ylabel="mean relative error, %")
        number(axis, [(r["batch_s"], shown(r, q), str(r["id"])) for r in front])
    for axis in axes[1]:
        axis.set_xlabel("seconds a solve, in a set")
    axes[0, 0].legend(fontsize=8, framealpha=0.9)
    figure.suptitle(f"{case}: error against online time (numbers: settings; errors below {SHOWN:g} % are drawn there)")
    figure.savefig(path, dpi=110)
    plt.close(figure)


def section(case, rows, full, words, picture):
    """The text of docs/tradeoff/settings.md for one case."""
    failed = [r for r in rows if r["status"] != "ok"]
    return [words, "", f"![error against online time, {case.name}]({picture})", "",
            f"{len(rows)} settings ([csv]({picture.removesuffix('.png')}.csv)" + (f"; {len(failed)} of them gave no model or no converged solution" if failed else "")
            + "):", "", *answer(rows, full["warm"]), "", *wanted(case, rows, full)]
