"""Reduced models of paths on examples/rod: settings of each type, errors at paths that they have not seen, CPU seconds of a path."""
import csv
import json
import os
import statistics
import sys
import time
from dataclasses import dataclass

sys.path.append(os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "comparison"))
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from cases import Setting
from page import machine
from report import COLORS, MARKS, number, percent, seconds, speedup, table
from timing import timed

NAMES = ["gap", "q2", "creep"]
KINDS = {"u": "displacement", "sigma": "stress of the RID's cells", "inelastic": "inelastic strain", "lambda_rid": "forces on the RID's contacts"}
LIMITS = [{"u": 0.002, "sigma": 0.005, "inelastic": 0.005, "lambda_rid": 0.01}, {"u": 0.01, "sigma": 0.03, "inelastic": 0.03, "lambda_rid": 0.05}]
COLOR = COLORS | {"cubature": "#8a4fa3", "regression": "#777777"}
MARK = MARKS | {"cubature": "D", "regression": "x"}
ESTIMATES = ["bounded", "ratio"]
EXTRA = ["times faster than Newton", "than elastic"]

# A plane of symmetry as RID, all of its displacements full order
PLANE = (("rid_groups", "sym_y0"), ("hybrid", "all"), ("rid_modes", "displacement"))
TIGHT = (("pod_tol", "1e-12"),)
LOOSE = ("newton_rtol", "1e-6")  # online, too
# The scene's times, and every 250 h while the gap may close
CLOSE = [0, 1, 10, 100, *range(1000, 7001, 250), 8000, 9000, 10001, 10001.01, 10001.02, 10001.03333, 10001.1, 10002, 10004, 10008, 10016, 10025.03333, 10025.2,
         10025.53333]
LAYER = (("rid_layers", 1), ("rid_contact_extension", 1))  # mm: two and a half edges of the slice's contact


def cubature(tolerance, *contact):
    return Setting("cubature", "", (*TIGHT, ("cubature_tol", tolerance), *contact))


RANK, VECTORS = ("hybrid", "rank"), ("dual", "nnmf")
TRAINING = {name: ["-scatter", "12"] for name in ("", "searched")}
SEARCHED = Setting("hybrid", "searched")  # the settings that train finds for the type
BASELINES = [Setting("projection", "", TIGHT), *(cubature(tol, *contact) for contact in ([], [RANK], [VECTORS]) for tol in ("1e-4", "1e-6"))]
BODIES = [Setting("bodies", "searched")]


@dataclass
class Case:
    name: str
    scene: list
    training: dict    # by a setting's training: arguments of its points
    unseen: list      # paths by NAMES
    settings: list
    references: list  # points of full order


SLICE = [[g, q, c] for g in (0.034, 0.047, 0.058, 0.066) for q in (37.1, 43.3) for c in (0.8, 1.6)]
SOLID = [[0.036, 38.9, 1.2], [0.044, 44.2, 1.7], [0.053, 35.8, 0.7], [0.062, 41.1, 1.05]]
TIMED, ENOUGH = (8, 64, 512), 0.5  # paths of a batch, in turn; until their CPU seconds are far above the noise of a start


def case_of(mesh):
    if mesh == "slice":
        return Case("rod, a slice", ["-scene", "examples/rod"], TRAINING | {"grid 5,2,2": ["-grid", "5,2,2", "-grid_type", "centred"]}, SLICE,
                    [SEARCHED, Setting("hybrid", "grid 5,2,2", (*TIGHT, *LAYER)), Setting("hybrid", "", (("pod_tol", "1e-9"), *LAYER)), Setting("hybrid", "", (*TIGHT, *LAYER)), *BASELINES,
                     *BODIES, Setting("regression", "", (*TIGHT, ("rid_layers", 1)))], SLICE[::7])
    scene = ["-scene", "examples/rod/3d.yaml", "-scene_mesh", f"examples/pellet/{mesh}.msh"]
    planes = [Setting("hybrid", "", (("pod_tol", tol), *PLANE)) for tol in ("1e-8", "1e-10", "1e-12", "1e-14")]
    if mesh == "C":  # half an hour for the references, ten minutes for each setting
        scene += ["-history_times", ",".join(map(str, CLOSE))]
        planes = [Setting("hybrid", "", (("pod_tol", tol), *PLANE, LOOSE)) for tol in ("1e-10", "1e-12", "1e-14")]
        return Case("rod, mesh C", scene, TRAINING | {"grid 3,2,2": ["-grid", "3,2,2", "-grid_type", "centred"]}, SOLID, [*planes, cubature("1e-4", RANK)], SOLID[1:2])
    return Case(f"rod, mesh {mesh}", scene, TRAINING | {"grid 3,2,2": ["-grid", "3,2,2", "-grid_type", "centred"]}, SOLID,
                [SEARCHED, *planes, Setting("hybrid", "grid 3,2,2", (*TIGHT, *PLANE)), Setting("hybrid", "", (*TIGHT, *PLANE, ("rid_layers", 1))), *BASELINES[:4], BASELINES[5],
                 *BODIES, Setting("regression", "", (*TIGHT, PLANE[0], PLANE[2]))], SOLID[:3])


class Bench:
    """Runs hyco in timed.folder."""

    def __init__(self, case, snapshots, timeout):
        self.case, self.timeout = case, timeout
        self.snapshots = snapshots or os.path.join(timed.folder, "snapshots")
        self.points = os.path.join(timed.folder, "unseen.csv")
        with open(self.points, "w", encoding="utf-8", newline="") as file:
            csv.writer(file).writerows([NAMES, *case.unseen])

    def hyco(self, *arguments, ends=(0,)):
        """CPU seconds and the report. A model that misses ends with 3."""
        report = os.path.join(timed.folder, "report.json")
        _, cpu, megabytes, failure = timed([os.environ.get("HYCO", "build/hyco"), *map(str, arguments), "-report", report], self.timeout)
        if failure and not any(failure.startswith(f"ended with {code}:") for code in ends):
            raise RuntimeError(failure)
        with open(report, encoding="utf-8") as file:
            return cpu, json.load(file) | {"peak_mb": megabytes}

    def full_order(self, newton):
        """The median CPU seconds of a path."""
        return statistics.median(self.hyco("solve", *self.case.scene, "-mu", ",".join(map(str, p)), "-hyco_newton", newton)[0]
                                 for p in self.case.references)

    def train(self, setting, model):
        """CPU seconds and the report, of a model that stands there already those of its training."""
        report = os.path.splitext(model)[0] + ".json"
        if not (os.path.exists(model) and os.path.exists(report)):
            known = [] if setting.training == "searched" else ["-hyco_search", "false", "-validation_points", self.points]
            cpu, trained = self.hyco("train", *self.case.scene, "-model", model, *self.case.training[setting.training], "-hyco_snapshots", self.snapshots,
                                     *setting.arguments(), *known, ends=(0, 3))
            with open(report, "w", encoding="utf-8") as file:
                json.dump(trained | {"cpu": cpu}, file)
        with open(report, encoding="utf-8") as file:
            trained = json.load(file)
        return trained["cpu"], trained

    def path_seconds(self, online):
        """CPU seconds of a path in a batch, without those of the start; MB."""
        cpu = self.hyco("predict", *online, "-values_gap", "0.041", "-values_q2", "38.5", "-values_creep", "0.7")[0]
        for n in TIMED:
            gaps = ",".join(f"{0.041 + 0.012 * k / (n / 4 - 1):.6g}" for k in range(n // 4))
            every, predicted = self.hyco("predict", *online, "-values_gap", gaps, "-values_q2", "38.5,44", "-values_creep", "0.7,1.3")
            if every - cpu > ENOUGH:
                break
        return (every - cpu) / (n - 1), predicted["peak_mb"]

    def setting(self, setting, model):
        row = {"type": setting.type, "label": setting.label, "status": "ok"}
        online = ["-model", model, *(word for name, value in setting.options if name.startswith("newton") for word in ("-hyco_" + name, value))]
        try:
            cpu, trained = self.train(setting, model)
            held = self.compare(model) if setting.training == "searched" else trained["held_out"]
            path_s, megabytes = self.path_seconds(online)
        except RuntimeError as error:
            return row | {"status": str(error)}
        if held["not_converged"]:
            return row | {"status": f"{held['not_converged']} of {held['n']} paths did not reach their end"}
        row |= {"modes": trained["n_modes"], "rid_fraction": trained["rid_fraction"], "train_s": cpu,
                "path_s": path_s, "memory_mb": megabytes, "model_bytes": os.path.getsize(model)}
        for kind in KINDS:
            row |= {f"{kind}_median": held[kind]["median"], f"{kind}_max": held[kind]["largest"]} if kind in held else {}
        return row | {name: value for name, value in held.items() if name in ESTIMATES}

    def table(self, *arguments):
        path = os.path.join(timed.folder, "table.csv")
        self.hyco(*arguments, "-table", path)
        with open(path, encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file))

    def compare(self, model):
        """Of a training whose held-out paths chose its settings: errors, and how the estimates bound them."""
        true = self.table("compare", *self.case.scene, "-model", model, "-points", self.points)
        guess = self.table("predict", "-model", model, "-points", self.points)
        found = {"n": len(true), "not_converged": 0}
        for kind in KINDS:
            errors = [float(row[f"worst_{kind}"]) for row in true]
            found[kind] = {"median": statistics.median(errors), "largest": max(errors)}
        ratios = [float(g[f"estimated_error_{kind}"]) / float(t[f"worst_{kind}"]) for kind in ("u", "sigma", "lambda") for t, g in zip(true, guess)]
        return found | {"bounded": sum(r >= 1 for r in ratios) / len(ratios), "ratio": statistics.median(ratios)}


def full_orders(bench, arguments):
    """Their rows; `status` says where and how all was measured."""
    words = (f"{machine()}, {time.strftime('%Y-%m-%d')}; "
             f"judged on {len(bench.case.unseen)} unseen paths." + (" Full order: `scripts/bench history`, at the scene's listed times." if arguments.full_order else ""))
    known = map(float, arguments.full_order.split(",")) if arguments.full_order else map(bench.full_order, ("tangent", "elastic"))
    return [{"id": 0, "type": "full", "label": name, "status": words, "path_s": cpu}
            for name, cpu in zip(("full order, Newton", "full order, the elastic factor kept"), known)]


def measure(mesh, arguments, before):
    """Rows of the settings, then those of full order. before: rows of the last run, which stay where only some settings are asked for."""
    case = case_of(mesh)
    if arguments.quick:
        case.unseen, case.references = case.unseen[:1], case.references[:1]
    chosen = [int(k) for k in arguments.settings.split(",")] if arguments.settings else [4] if arguments.quick else range(1, len(case.settings) + 1)
    names = [setting.label for setting in case.settings]
    rows = {row["label"]: row | {"id": names.index(row["label"]) + 1} for row in before if arguments.settings and row["label"] in names}
    bench = Bench(case, arguments.snapshots, arguments.timeout)
    models = arguments.models or timed.folder
    os.makedirs(models, exist_ok=True)
    for k in chosen:
        row = bench.setting(case.settings[k - 1], os.path.join(models, f"{mesh}-{k}.h5")) | {"id": k}
        rows[row["label"]] = row
        print(f"{k}/{len(names)} {row['label']}: {row['status']}" +
              (f", {seconds(row['path_s'])}, " + ", ".join(f"{kind} {percent(row[kind + '_max'])} %" for kind in KINDS if kind + "_max" in row)
               if row["status"] == "ok" else ""), flush=True)
    full = [row for row in before if arguments.settings and row["type"] == "full"]
    return sorted(rows.values(), key=lambda row: row["id"]) + (full or full_orders(bench, arguments))


def split(rows):
    """Those that gave a model, those that did not, the two full orders."""
    return ([r for r in rows if r["status"] == "ok"], [r for r in rows if r["type"] != "full" and r["status"] != "ok"],
            [r for r in rows if r["type"] == "full"])


def within(row, limits):
    return all(row.get(f"{kind}_max", float("inf")) <= limit for kind, limit in limits.items())


def line_of(words, row, full):
    errors = [percent(row[k + "_max"]) if k + "_max" in row else "" for k in KINDS]
    return [words, f"{row['id']}: {row['label'] if words else row['type']}", f"{100 * row['rid_fraction']:.1f}", *errors, seconds(row["path_s"]),
            *(speedup(f["path_s"] / row["path_s"]) for f in full)]


def accurate(rows):
    """Of rows, that with the smallest errors."""
    return min(rows, key=lambda r: sum(r.get(k + "_median", 1) for k in KINDS))


def section(mesh, rows, picture):
    ok, failed, full = split(rows)
    lines = [line_of("", accurate([r for r in ok if r["type"] == kind]), full) for kind in dict.fromkeys(r["type"] for r in ok)]
    for limits in reversed(LIMITS):
        words = "cheapest within " + ", ".join(f"{100 * limit:g}" for limit in limits.values())
        best = min((r for r in ok if within(r, limits)), key=lambda r: r["path_s"], default=None)
        lines.append(line_of(words, best, full) if best else [words, "none", *[""] * (len(KINDS) + 4)])
    notes = [f"- Estimates of number {r['id']}: {100 * r['bounded']:.0f} % bound the error; median of estimate / error {r['ratio']:.2g}." for r in ok if "bounded" in r]
    notes += [f"- No model, or a path that does not reach its end: {r['label']}: {r['status']}" for r in failed]
    return [full[0]["status"], "", f"![error against online time, {case_of(mesh).name}]({picture})", "",
            f"Full order takes {' and '.join(seconds(f['path_s']) for f in full)} ({', '.join(f['label'].removeprefix('full order, ') for f in full)}) for a path. "
            f"Of {len(ok) + len(failed)} settings ([csv]({picture.removesuffix('.png')}.csv)):", "",
            *table(["", "setting", "cells %", *(f"{words.split(' of the')[0].split(' on the')[0]} %" for words in KINDS.values()), "a path", *EXTRA], lines),
            *([""] if notes else []), *notes]


def plot(mesh, rows, path):
    ok, _, full = split(rows)
    figure, axes = plt.subplots(2, 2, figsize=(11, 8.6), sharex=True)
    figure.set_layout_engine("constrained", rect=(0, 0.06, 1, 0.94))  # the legend below
    for axis, (kind, words) in zip(axes.flat, KINDS.items()):
        for type_ in dict.fromkeys(r["type"] for r in ok):
            mine = [r for r in ok if r["type"] == type_ and kind + "_max" in r]
            x, low, high = ([r["path_s"] for r in mine], *([max(100 * r[f"{kind}_{which}"], 1e-6) for r in mine] for which in ("median", "max")))
            axis.vlines(x, low, high, color=COLOR[type_], lw=1.2, alpha=0.6)
            axis.scatter(x, high, s=30, marker=MARK[type_], color=COLOR[type_], label=type_)
        for f, style in zip(full, ("--", "-")):
            axis.axvline(f["path_s"], color="0.4", ls=style, label=f["label"])
        for limits in LIMITS:
            axis.axhline(100 * limits[kind], color="0.8", lw=0.9, zorder=0)
            axis.annotate(f"{100 * limits[kind]:g} %", (1, 100 * limits[kind]), xycoords=("axes fraction", "data"), xytext=(3, 0),
                          textcoords="offset points", fontsize=8, color="0.4", va="center")
        axis.set(xscale="log", yscale="log", title=words, ylabel="error, % (line: from the median)")
        number(axis, [(r["path_s"], max(100 * r[kind + "_max"], 1e-6), str(r["id"])) for r in ok if kind + "_max" in r])
    for axis in axes[1]:
        axis.set_xlabel("CPU seconds of a path")
    handles, words = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, words, loc="lower center", ncol=4, fontsize=9)
    figure.suptitle(f"{case_of(mesh).name}: error at unseen paths, each at its worst time, against online time (numbers: settings)")
    figure.savefig(path, dpi=100)
    plt.close(figure)
