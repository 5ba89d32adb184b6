"""Section 7: the order of the runs, the pictures, and the text. Every number of hyco comes from a run."""

import numpy as np
import pellet
import pellet_pictures as draw
import pellet_text
from rope_report import percent, table, write_csv
from runs import RunError


def run(runs, size):
    """All runs; returns the data for the report."""
    first = pellet.train(runs, size, pellet.FINE, ranks=2)  # alone, on both cores, because the others use its solutions
    full = runs.later(pellet.full_order, runs, size)
    shown = [runs.later(pellet.fields, runs, size, load) for load in pellet.SHOWN]
    entries = {m: runs.later(pellet.judged, runs, size, m, first if m == pellet.FINE else None) for m in size.models}
    found = {"entries": {m: task.result() for m, task in entries.items()}, "ramp": full.result()}
    for task in shown:
        task.result()
    for model, entry in found["entries"].items():
        if "compare" in entry:
            entry["shares"] = pellet.shares(runs, model)
    found["contact"] = found["ramp"]["total_contact_force"] > 0
    found["fields"] = {m: fields_of(runs, m) for m in size.models if "compare" in found["entries"][m]}
    for m in (pellet.PAPER, pellet.FINE):
        if "compare" not in found["entries"][m]:
            raise RunError(f"the model {', '.join(m)} is needed by the pictures", found["entries"][m]["train"]["refused"])
    found["bounds"] = pellet.bounds(runs, size)
    found["history"] = pellet.history_of_contact(runs, size)
    return found


def fields_of(runs, model):
    """Whether S3 at full load was predicted; hyco writes no fields of a prediction that did not converge."""
    try:
        return pellet.predicted(runs, model)
    except RunError:
        return None


# ------------------------------------------------------------------------------------------------ pictures

def pictures(runs, size, found, out):
    parts, modes = pellet.contributions(runs, size, pellet.FINE)
    paper = pellet.contributions(runs, size, pellet.PAPER)
    found["parts"] = {pellet.FINE: (parts, modes), pellet.PAPER: paper}
    draw.figure_13(runs, pellet.FINE, parts, modes, paper[0]["rid"], out)
    draw.figure_14(runs, pellet.FINE, out)
    models = shown_models(found)
    draw.side_by_side(runs, models, "displacement", "x", "displacement $u_1$ [mm]", True, out, "figure-15.png")
    draw.side_by_side(runs, models, "stress", "xx", "stress $\\sigma_{11}$ [MPa]", False, out, "figure-16.png")
    steps = [(m, found["entries"][m]["table"]) for m in ladder(found)]
    draw.errors_by_step(steps, found["contact"], found["ramp"]["load"], out)


def ladder(found):
    """One model for each training set: the paper's, and the most accurate settings of the others that were judged."""
    last = {m[0]: m for m in found["entries"] if m[2] == "paper" and "compare" in found["entries"][m]}
    return list(last.values())


def shown_models(found):
    return [m for m in ladder(found) if found["fields"][m]]


# ------------------------------------------------------------------------------------------------ text

def numbers(found):
    rows = [["**paper**: S1 + S2", "1e-5", "paper", "17 / 20 / 21", "", "1", "5", "", "", "10"]]
    for model, entry in found["entries"].items():
        rows.append([*model, *(refused(entry) if "compare" not in entry else measured(entry, found["contact"]))])
    return ["trained on", "energy left", "RID", "modes u / sigma / F", "RID elements", "displacement", "stress 11",
            "forces in the RID", "RID's share of the force", "speed-up"], rows


def refused(entry):
    return ["", "", "refused: " + entry["train"]["refused"].split(":")[0].split(" (")[0].replace("the model misses its own", "misses its"), "", "", "", ""]


def measured(entry, contact):
    t, w = entry["train"], pellet.worst(entry, contact)
    note = f" (not converged at {w['failed']} of {contact.sum()} steps)" if w["failed"] else ""
    return [f"{t['n_modes']} / {t['n_stress_modes']} / {t['n_force_modes']}", f"{percent(t['rid_fraction'])} %",
            one(w["error_u_rid"]) + note, one(w["error_sigma_11"]), one(w["error_lambda_rid"]),
            " / ".join(percent(share) for share in entry["shares"]), f"{w['speedup']:.{0 if w['speedup'] > 10 else 1}f}"]


def one(value):
    return "" if value is None else percent(value)


def bound_rows(found):
    rows = [[f"{b['load']:g}", percent(b["projection"]), percent(b["u"]), percent(b["sigma"])]
            for b in found["bounds"]["steps"]]
    return ["load of S3", "projection, 2-norm, whole mesh", "RID, least largest error of displacement",
            "RID, least largest error of stress 11"], rows


def errors_rows(found):
    rows = []
    for model, entry in found["entries"].items():
        for k in range(len(entry["table"]["load"]) if "table" in entry else 0):
            rows.append([*model, *(entry["table"][key][k] for key in ("load", "converged", "error_u_rid", "error_sigma_11",
                                                                        "error_lambda_rid", "covered_force"))])
    return ["trained_on", "energy_left", "rid", "load", "converged", "u_rid", "sigma_11", "forces_rid", "covered_force"], rows


def write_tables(runs, found):
    for name, (head, rows) in (("pellet-numbers", numbers(found)), ("pellet-bounds", bound_rows(found)),
                               ("pellet-steps", errors_rows(found))):
        write_csv(runs.path(f"{name}.csv"), head, rows)


def report(runs, size, found, folder):
    """The Markdown text; `folder` contains its pictures."""
    write_tables(runs, found)
    contact, b = found["contact"], found["bounds"]
    second, touching = found["history"]
    fine = pellet.worst(found["entries"][pellet.FINE], contact)
    values = {"folder": folder, "mesh": size.mesh, "numbers": table(*numbers(found)), "bounds": table(*bound_rows(found)),
              "first": np.flatnonzero(contact)[0] + 1, "contacts": contact.sum(), "second": f"{second:.0e}",
              "touching": touching, "dimension": b["dimension"], "five": radii_of("5 radii"), "nine": radii_of("9 radii"),
              "fine_u": one(fine["error_u_rid"]), "fine_sigma": one(fine["error_sigma_11"]), "ms": f"{fine['ms']:.3g}",
              "full_ms": f"{fine['full_ms']:.3g}",
              "force": f"{found['ramp']['total_contact_force'][-1]:.1f}",
              "shown": "; ".join(", ".join(m[:2]) for m in shown_models(found))}
    values.update(bound_values(b))
    values.update(part_values(found))
    return pellet_text.TEXT.format(**values)


def bound_values(b):
    """The largest bounds over the steps, and which of the paper's numbers they exclude."""
    u, sigma = (max(s[key] for s in b["steps"]) for key in ("u", "sigma"))
    excluded = [name for name, low, paper in (("displacement", u, 0.01), ("stress", sigma, 0.05)) if low > paper]
    return {"least": percent(u), "least_sigma": percent(sigma), "excluded": " and ".join(excluded) or "neither"}


def radii_of(name):
    return ", ".join(f"{r:g}" for r in pellet.RADII[name])


def part_values(found):
    """Sizes of the contributions, and whether the script's elements are part of hyco's RID."""
    parts, modes = found["parts"][pellet.FINE]
    paper_parts, paper_modes = found["parts"][pellet.PAPER]
    outside = int((parts["all"] & ~parts["rid"]).sum() + (paper_parts["all"] & ~paper_parts["rid"]).sum())
    return {"paper_modes": "{U}, {sigma} and {force}".format(**paper_modes),
            "modes": "{U}, {sigma} and {force}".format(**modes), "outside": outside, "union": parts["all"].sum(),
            "rid": parts["rid"].sum(), "all_cells": len(parts["rid"]), "fraction": percent(parts["rid"].mean())}
