#!/usr/bin/python3
"""Every command of the README and of docs/commands.md works as written: the indented lines that call what is built, in order."""
import os
import shlex
import subprocess
import sys
import tempfile

from common import PATIENCE

SOURCE = os.environ["HYCO_SOURCE"]
BUILD = os.path.dirname(os.environ["HYCO"])


def commands():
    for page in ("README.md", "docs/commands.md"):
        with open(f"{SOURCE}/{page}", encoding="utf-8") as file:
            for line in file:
                words = line.split()
                if line.startswith("    ") and any(w in ("build/hyco", "build/embed") or w.startswith("build/ladder/") for w in words[:5]) and "..." not in words:
                    yield line.strip()


def main():
    listed = list(commands())
    if len(listed) < 15:
        sys.exit(f"the pages list {len(listed)} commands; at least 15 were expected")
    with tempfile.TemporaryDirectory() as folder:
        os.symlink(f"{SOURCE}/examples", f"{folder}/examples")
        os.symlink(BUILD, f"{folder}/build")
        for command in listed:
            run = subprocess.run(shlex.split(command), cwd=folder, capture_output=True, text=True, timeout=120 * PATIENCE, check=False)
            print(f"{run.returncode}  {command}")
            if run.returncode:
                sys.exit(run.stdout + run.stderr)


if __name__ == "__main__":
    main()
