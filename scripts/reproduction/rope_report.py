"""Section 6: the order of the runs, the pictures, and the text. Every number of hyco comes from a run."""
import csv

import numpy as np
import rope
import rope_pictures as draw
import rope_text

BLUE, RED, GREEN = draw.plot.BLUE, draw.plot.RED, draw.plot.GREEN


def percent(value):
    return f"{100 * value:.2g}" if value < 0.995 else f"{100 * value:.0f}"


def spread(report, key):
    return f"{percent(report[key]['mean'])} / {percent(report[key]['max'])}"


def table(head, rows):
    lines = ["| " + " | ".join(str(v) for v in row) + " |" for row in [head, ["---"] * len(head), *rows]]
    return "\n".join(lines) + "\n"


def write_csv(path, head, rows):
    with open(path, "w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([head, *rows])


# ------------------------------------------------------------------------------------------------ runs

def run(runs, size):
    """All runs; returns the data for the report."""
    said = rope.train_regular(runs, "rank")  # first and alone, because the others use its snapshots
    trained = {name: runs.later(rope.greedy, runs, name, size) for name in reversed(rope.GREEDY)}
    slow = [runs.later(rope.left_by_nnmf, runs, k, size.slow_its) for k in reversed(size.slow_vectors)]
    grid = {name: runs.later(rope.regular, runs, name, size) for name in rope.REGULAR}
    fast = [runs.later(rope.left_by_nnmf, runs, k, 100) for k in size.vectors]
    full = runs.later(rope.solutions, runs)
    found = {"greedy": {name: task.result() for name, task in trained.items()}}
    tasks = history_tasks(runs, size)
    found["histories"] = {name: [(k, task.result()) for k, task in some] for name, some in tasks.items()}
    found["grid"] = {name: task.result() for name, task in grid.items()}
    found["nnmf"] = {100: [t.result() for t in fast], size.slow_its: sorted(t.result() for t in slow)}
    full.result()
    assert found["grid"]["rank"]["train"]["n_samples"] == said["n_samples"]
    return found


def history_tasks(runs, size):
    """Mean errors of the stored models, and of the other method's models from the same solutions."""
    def kept(name):
        return [(k, runs.later(rope.judge_kept, runs, name, k, size)) for k in size.kept()]

    def other(name, options):
        return [(k, runs.later(rope.judge_other, runs, name, k, options, size)) for k in size.kept()]

    projection = (*rope.PROJECTION, "-hyco_pod_tol", "1e-10")
    return {"greedy-paper": kept("greedy-paper"), "greedy-fine": kept("greedy-fine"), "greedy-pb": kept("greedy-pb"),
            "pb-on-paper": other("greedy-paper", projection), "hr-on-pb": other("greedy-pb", rope.PAPER_GREEDY)}


# ------------------------------------------------------------------------------------------------ pictures

def pictures(runs, size, found, out):
    draw.figure_3(runs, out)
    draw.figure_4(curves(runs, size, found), out)
    draw.figure_5(runs, out)
    draw.figure_6(runs, out)
    draw.error_maps(runs, "all", out, "figure-07.png")
    draw.error_maps(runs, "fine", out, "figure-07-fine.png")
    draw.point_solutions(runs, out, "figure-08.png", [("hybrid, 9 modes", "all")])
    draw.point_solutions(runs, out, "figure-09.png", [("projection-based, 9 modes", "pb9"),
                                                      ("projection-based, 14 modes", "pb14")])
    draw.history(figure_10(runs, found), out, "figure-10.png")
    draw.history(figure_11(runs, found), out, "figure-11.png")
    draw.error_maps(runs, "greedy-paper", out, "figure-12.png")
    draw.error_maps(runs, "greedy-fine", out, "figure-12-fine.png")


def curves(runs, size, found):
    U, forces = rope.grid_snapshots(runs)
    primal, dual = rope.left_by_pod(U), rope.left_by_pod(forces)
    write_csv(runs.path("figure-04.csv"), ["k", "pod_displacements", "pod_forces"],
              [[k + 1, p, d] for k, (p, d) in enumerate(zip(primal, dual))])
    fast, slow = found["nnmf"][100], found["nnmf"][size.slow_its]
    k = range(1, 41)
    return [("POD, displacements", k, primal[:40], "-", BLUE), ("POD, contact forces", k, dual[:40], "-", RED),
            ("NNMF, 100 iterations", *zip(*fast), "o-", GREEN),
            (f"NNMF, {size.slow_its} iterations", *zip(*slow), "x--", draw.ORANGE)]


def line(found, name, key, label, style, colour):
    points = [(k, v[key]) for k, v in found["histories"][name] if v.get(key) is not None]
    return (label, [k for k, _ in points], [v for _, v in points], style, colour)


def figure_10(runs, found):
    table_of = rope.indicators(runs, "greedy-paper")

    def panel(title, error, rebuilt, indicator):
        lines = [line(found, "greedy-paper", error, "hybrid, eps 1e-10", "o-", BLUE),
                 line(found, "greedy-fine", error, "hybrid, eps 1e-14 and a layer", "s-", draw.VIOLET),
                 line(found, "pb-on-paper", error, "projection-based", "^-", RED)]
        if rebuilt:
            lines.insert(1, line(found, "greedy-paper", rebuilt, "hybrid, eps 1e-10, reconstructed", "o--", draw.ORANGE))
        if indicator:
            lines.append(("indicator, eps 1e-10", table_of["iteration"], table_of[indicator], "--", "#777777"))
        return title, lines

    return [panel("A: displacement, H1", "error_u_h1", None, "mean_eta_u"),
            panel("B: contact forces, dual of H1", "error_lambda_rid_dual", "error_lambda_dual", "mean_eta_lambda"),
            panel("C: displacement, 2-norm", "error_u", None, None),
            panel("D: contact forces, 2-norm", "error_lambda_rid", "error_lambda", None)]


def figure_11(runs, found):
    def panel(title, error, rebuilt):
        lines = [line(found, "greedy-pb", error, "projection-based", "^-", RED),
                 line(found, "hr-on-pb", error, "hybrid, eps 1e-10", "o-", BLUE)]
        if rebuilt:
            lines.append(line(found, "hr-on-pb", rebuilt, "hybrid, eps 1e-10, reconstructed", "o--", draw.ORANGE))
        return title, lines

    table_of = rope.indicators(runs, "greedy-pb")
    shown = ("indicator (45), a length (right)", table_of["iteration"], table_of["mean_eta_u"], "--", "#777777")
    return [(*panel("A: displacement, 2-norm", "error_u", None), shown),
            panel("B: contact forces, 2-norm", "error_lambda_rid", "error_lambda")]


# ------------------------------------------------------------------------------------------------ text

def numbers(found):
    """The table of numbers: mean / max in percent over the test grid, the paper's in separate rows."""
    rows = []

    def ours(label, r):
        c, t = r["compare"], r["train"]
        rows.append([label, t["n_samples"], t["n_modes"], t["rid_nodes"], spread(c, "error_u"), spread(c, "error_lambda_rid"),
                     spread(c, "error_lambda"), c["not_converged"], c["fallback"]])

    grid, greedy = found["grid"], found["greedy"]
    rows.append(["**paper**, regular grid", 120, 9, 28, "0.34 / 1.13", "24 / 148", "39 / 127", "", ""])
    ours("its settings, fewest full-order unknowns (`-hyco_hybrid rank`)", grid["rank"])
    ours("its settings, all of A full order (`-hyco_hybrid all`)", grid["all"])
    ours("`" + words(rope.FINE_GRID) + "`", grid["fine"])
    ours("projection-based", grid["pb9"])
    ours("projection-based, `-hyco_pod_tol 6e-9`", grid["pb14"])
    ours("projection-based, `-hyco_dual snapshots`", grid["pb-dual"])
    rows.append(["**paper**, greedy, 50 iterations", 54, "", "", "0.004 / 0.077", "0.34 / 10", "1.3 / 18", "", ""])
    ours("its thresholds: `" + words(rope.PAPER_GREEDY) + "`", greedy["greedy-paper"])
    ours("the same with `-hyco_pod_tol 1e-12`", greedy["greedy-1e-12"])
    ours("`" + words(rope.FINE_GREEDY) + "`", greedy["greedy-fine"])
    ours("projection-based, indicator (45)", greedy["greedy-pb"])
    return ["model", "snapshots", "modes", "RID nodes", "displacement", "forces in the RID", "forces everywhere",
            "not converged", "by the fallback solver"], rows


def words(options):
    return " ".join(str(o) for o in options)


def table_1(found):
    """Ours, and the paper's in brackets."""
    columns = [found["grid"][name] for name in ("all", "rank", "pb9", "pb14")]
    paper = {"unknowns": ["28", "", "18", "28"], "speed": ["8.5 / 5.9", "", "8.4", "9.1"], "its": ["4", "", "6", "5"],
             "u": ["0.15", "", "0.32", "0.04"], "forces": ["13 / 12", "", "44", "23"]}

    def forces(r):
        e, t = r["point"][1], r["train"]
        both = [percent(e["error_lambda_rid"]["mean"]), percent(e["error_lambda"]["mean"])]
        return " / ".join(both) if t["model_type"] == "hybrid" else both[1]

    def unknowns(r):
        p = r["point"][0]
        return p["n_dof"] + p["n_multipliers"]

    ours = {"unknowns": [unknowns(r) for r in columns],
            "speed": [f"{r['compare']['gain']['times']:.2g}" for r in columns],
            "its": [r["point"][0]["active_set_iterations"] for r in columns],
            "u": [percent(r["point"][1]["error_u"]["mean"]) for r in columns], "forces": [forces(r) for r in columns]}
    titles = {"unknowns": "unknowns", "speed": "speed-up", "its": "active-set iterations", "u": "displacement error, 2-norm [%]",
              "forces": "force error, 2-norm, without / with reconstruction [%]"}
    rows = [[title, *(f"{o} ({p})" if p else o for o, p in zip(ours[key], paper[key]))] for key, title in titles.items()]
    return ["", "hybrid, all of A full order", "hybrid, rank", "projection-based, 9", "projection-based, 14"], rows


def figure_4_rows(runs, size, found):
    dual = rope.left_by_pod(rope.grid_snapshots(runs)[1])
    fast, slow = dict(found["nnmf"][100]), dict(found["nnmf"][size.slow_its])
    rows = [[k, f"{dual[k - 1]:.2g}" if dual[k - 1] > 1e-25 else "round-off", f"{fast[k]:.2g}" if k in fast else "", f"{slow[k]:.2g}" if k in slow else ""]
            for k in sorted({*fast, *slow})]
    return ["vectors", "POD", "NNMF, 100 iterations", f"NNMF, {size.slow_its} iterations"], rows


def write_tables(runs, size, found):
    for name, (head, rows) in (("numbers", numbers(found)), ("table-1", table_1(found)),
                               ("figure-04-nnmf", figure_4_rows(runs, size, found))):
        write_csv(runs.path(f"{name}.csv"), head, rows)
    rows = [[name, k, v["failed"], v["error_u_h1"], v["error_u"], v["error_lambda_rid_dual"], v["error_lambda_rid"],
             v["error_lambda_dual"], v["error_lambda"]] for name, some in found["histories"].items() for k, v in some]
    write_csv(runs.path("histories.csv"), ["run", "iteration", "not_converged", "u_h1", "u", "forces_rid_dual", "forces_rid",
                                           "forces_dual", "forces"], rows)


def report(runs, size, found, folder):
    """The Markdown text; `folder` contains its pictures."""
    write_tables(runs, size, found)
    values = {"folder": folder, "test_grid": size.test_grid.replace(",", " x "), "iterations": size.iterations,
              "history_grid": size.history_grid.replace(",", " x "), "numbers": table(*numbers(found)),
              "table_1": table(*table_1(found)),
              "failed": sum(v["failed"] for some in found["histories"].values() for _, v in some), "slow": size.slow_its}
    values.update(regular_values(found))
    values.update(greedy_values(runs, found))
    return rope_text.TEXT.format(**values)


def regular_values(found):
    grid = found["grid"]
    t, c, p = grid["all"]["train"], grid["all"]["compare"], grid["pb14"]["compare"]

    def at(name, key):
        return percent(grid[name]["point"][1][key]["mean"])

    return {"modes": t["n_modes"], "a": t["rid_a_nodes"], "nodes": t["rid_nodes"], "dual": t["n_dual_modes"],
            "pb14": grid["pb14"]["train"]["n_modes"], "pb_dual_modes": grid["pb-dual"]["train"]["n_modes"],
            "pb_dual_vectors": grid["pb-dual"]["train"]["n_dual_modes"], "covered": percent(c["covered_force"]["mean"]),
            "least": percent(c["covered_force"]["min"]), "rank_fe": grid["rank"]["train"]["n_fe_dofs"],
            "point_covered": percent(grid["all"]["point"][0]["covered_force"]), "rid_force": percent(c["error_lambda_rid"]["mean"]),
            "all_force": percent(c["error_lambda"]["mean"]), "pb_force": percent(p["error_lambda"]["mean"]),
            "pb_u": percent(p["error_u"]["mean"]), "all_u": percent(c["error_u"]["mean"]),
            "at_rid": at("all", "error_lambda_rid"), "at_pb14": at("pb14", "error_lambda"), "at_all": at("all", "error_lambda")}


def greedy_values(runs, found):
    """The final values of the histories, how often the indicator is above the error, where the last models have the largest errors."""
    last = {name: some[-1][1] for name, some in found["histories"].items()}
    values = {f"{key}_{name.replace('-', '_')}": percent(v[f"error_{key}"])
              for name, v in last.items() for key in ("u_h1", "u", "lambda_rid", "lambda_rid_dual")}
    rows, judged = rope.indicators(runs, "greedy-paper"), found["histories"]["greedy-paper"]
    values["judged"] = len(judged)
    values["above_u"] = sum(rows["mean_eta_u"][k] > v["error_u_h1"] for k, v in judged)
    values["above_lambda"] = sum(rows["mean_eta_lambda"][k] > v["error_lambda_rid_dual"] for k, v in judged)
    for name in ("greedy-paper", "greedy-fine"):
        _, errors = draw.plot.read_table(runs.path(f"{name}.csv"))
        worst = np.argmax(errors["error_u"])
        values[f"worst_{name[7:]}"] = f"({errors['mu1'][worst]:.2f}, {errors['mu2'][worst]:.2f})"
    return values
