"""Runs of hyco in a folder, several at a time, and their reports."""
import concurrent.futures
import importlib.machinery
import importlib.util
import json
import os
import subprocess

SOURCE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
HYCO = os.environ.get("HYCO", os.path.join(SOURCE, "build", "hyco"))
MPIEXEC = os.environ.get("MPIEXEC", "mpiexec")
ENVIRONMENT = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMPI_ALLOW_RUN_AS_ROOT": "1",
               "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}


class RunError(Exception):
    """A run without a report, in one line; `reason` is hyco's message."""

    def __init__(self, what, reason):
        super().__init__(f"{what}: {reason}")
        self.reason = reason


def reason_of(stderr):
    """The message with which hyco ended; without one the last line."""
    lines = stderr.strip().splitlines() or ["no message"]
    own = [line.split("hyco: error: ", 1)[1] for line in lines if "hyco: error: " in line]
    return (own or lines)[-1]


class Runs:
    """All files of hyco are written to a folder; reports are returned as dictionaries."""

    def __init__(self, folder, workers=2):
        self.folder = folder
        self.pool = concurrent.futures.ThreadPoolExecutor(workers)
        os.makedirs(folder, exist_ok=True)

    def path(self, *names):
        return os.path.join(self.folder, *names)

    def hyco(self, name, command, *options, ranks=1):
        """The report NAME.json of one run. A comparison with points that did not converge ends with an error and still has a report, which counts
        them; any other command must succeed, or write a model that misses its target (status 3), which is measured here."""
        report = self.path(f"{name}.json")
        if os.path.exists(report):
            os.remove(report)
        words = [HYCO, command, *(str(o) for o in options), "-report", report]
        if ranks > 1:
            words = [MPIEXEC, "--oversubscribe", "-n", str(ranks), *words]
        run = subprocess.run(words, cwd=SOURCE, env=ENVIRONMENT, capture_output=True, text=True, check=False)
        if not os.path.exists(report) or (run.returncode not in (0, 3) and command != "compare"):
            raise RunError(f"hyco {command} ({name}) ended with {run.returncode}", reason_of(run.stderr))
        with open(report, encoding="utf-8") as file:
            return json.load(file)

    def later(self, function, *arguments):
        return self.pool.submit(function, *arguments)

    def close(self):
        """Cancels runs that have not started, so that an error ends the script soon."""
        self.pool.shutdown(cancel_futures=True)


def load_script(name):
    """A script of scripts/ without the ending .py, as a module."""
    loader = importlib.machinery.SourceFileLoader(name, os.path.join(SOURCE, "scripts", name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(name, loader))
    loader.exec_module(module)
    return module
