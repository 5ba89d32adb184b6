"""Runs hyco for the sweep: the offline and online cost of each setting, and its errors."""
import csv
import json
import os
import statistics
import subprocess

HYCO = os.environ.get("HYCO", "build/hyco")
ERRORS = {"u": "error_u", "u_rid": "error_u_rid", "sigma": "error_sigma", "sigma_11": "error_sigma_11",
          "lambda_rid": "error_lambda_rid", "lambda": "error_lambda"}


class Refused(Exception):
    """hyco ended with an error: its message."""


class Bench:
    """One case, its folder for models and solutions."""

    def __init__(self, case, folder, timeout):
        self.case, self.folder, self.timeout, self.paid = case, folder, timeout, {}
        self.points = self.path("points.csv")
        with open(self.points, "w", encoding="utf-8", newline="") as file:
            csv.writer(file).writerows([case.names, *case.single])

    def path(self, name):
        return os.path.join(self.folder, name)

    def hyco(self, *arguments, table=True):
        """The report, and the table's rows."""
        report, rows = self.path("report.json"), self.path("table.csv")
        words = [HYCO, *map(str, arguments), "-report", report, *(["-table", rows] if table else [])]
        try:
            done = subprocess.run(words, capture_output=True, text=True, timeout=self.timeout, check=False)
        except subprocess.TimeoutExpired:
            raise Refused(f"no end after {self.timeout:g} s") from None
        if done.returncode:
            raise Refused((done.stderr.strip().splitlines() or ["no word"])[-1])
        with open(report, encoding="utf-8") as file:
            found = json.load(file)
        if not table:
            return found, []
        with open(rows, encoding="utf-8", newline="") as file:
            return found, list(csv.DictReader(file))

    def train(self, setting, model):
        """Trains; offline seconds count shared solutions for each setting."""
        kind = "bodies" if setting.type == "bodies" else "solutions"
        key = (setting.training, kind)
        folder = self.path("-".join(key).replace(" ", ""))
        r, _ = self.hyco("train", *self.case.scene, *self.case.training[setting.training], *setting.arguments(), "-model", model,
                         "-hyco_snapshots", folder, "-hyco_search", "false", "-hyco_validation", "0", table=False)
        self.paid.setdefault(key, r["seconds"]["snapshots"])
        return {"modes": r["n_modes"], "rid_fraction": r["rid_fraction"], "rid_nodes": r["rid_nodes"],
                "snapshots": r["n_samples"], "offline_s": self.paid[key] + r["seconds"]["reduction"],
                "model_bytes": os.path.getsize(model)}

    def errors(self, model):
        r, rows = self.hyco("compare", *self.case.scene, "-model", model, *self.case.test)
        out = {"not_converged": r["not_converged"], "covered_force": r["covered_force"]["mean"]}
        for name, column in ERRORS.items():
            out[f"{name}_mean"], out[f"{name}_max"] = r[column]["mean"], r[column]["max"]
        return out

    def online(self, model):
        """Seconds per solve: points that share their stiffness as a set, and points that do not, one by one."""
        r, batch = self.hyco("predict", "-model", model, *(self.case.batch or self.case.test))
        _, rows = self.hyco("predict", "-model", model, "-points", self.points)
        return {"batch_s": r["seconds_total"] / r["n_points"],
                "single_s": statistics.median(float(row["seconds"]) for row in rows), "memory_mb": r["memory_mb"],
                **self.ramp(batch)}

    def ramp(self, rows):
        """Seconds of all solves at the ramp's value."""
        if not self.case.ramp:
            return {}
        name, value = self.case.ramp
        mine = [float(row["seconds"]) for row in rows if abs(float(row[name]) - value) < 1e-9]
        return {"ramp_s": sum(mine), "ramp_n": len(mine)} if len(mine) > 1 else {}

    def full(self, *options, ramps=True):
        """The same for full order, in a process that has already read and paired its mesh. Without ramps: only single points."""
        r, rows = self.hyco("solve", *self.case.scene, *(self.case.batch or self.case.test if ramps else ["-points", self.points]), *options)
        _, single = self.hyco("solve", *self.case.scene, "-points", self.points, *options) if ramps else (r, rows)
        return {"batch_s": sum(float(row["seconds"]) for row in rows) / len(rows),
                "single_s": statistics.median(float(row["seconds"]) for row in single), "memory_mb": r["memory_mb"], **self.ramp(rows)}

    def setting(self, setting, model):
        row = {"type": setting.type, "label": setting.label, "status": "ok"}
        try:
            row |= self.train(setting, model)
            row |= self.errors(model)
            row |= self.online(model)
            if row["not_converged"]:
                row["status"] = f"{row['not_converged']} points not converged"
        except Refused as error:
            row["status"] = str(error)
        return row


def middle(each):
    """Medians of several measurements, with the extremes of the seconds."""
    out = {name: statistics.median(e[name] for e in each) for name in each[0]}
    for name in ("batch_s", "single_s"):
        out[name + "_min"], out[name + "_max"] = min(e[name] for e in each), max(e[name] for e in each)
    return out
