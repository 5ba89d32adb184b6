"""Sections of a document that scripts write: between `<!-- NAME: written by ... -->` and `<!-- end NAME -->`, and all rows behind them, in .csv files."""
import csv
import os
import re


def machine():
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        names = [line.split(":")[1].strip() for line in file if line.startswith("model name")]
    return f"{names[0] if names else os.uname().machine}, {os.cpu_count()} cores"


def machines(rows):
    """On which machine each task was measured; rows of a task and its machine."""
    found = {}
    for task, where in rows:
        found.setdefault(where, []).append(task)
    return "One core of " + " and ".join(f"{where} ({'; '.join(dict.fromkeys(tasks))})" if len(found) > 1 else where for where, tasks in found.items())


def write_section(path, name, lines):
    with open(path, encoding="utf-8") as file:
        text = file.read()
    found = re.compile(rf"(<!-- {re.escape(name)}: [^\n]*-->\n).*?(<!-- end {re.escape(name)} -->)", re.S)
    if not found.search(text):
        raise SystemExit(f"{path} has no section {name}")
    with open(path, "w", encoding="utf-8") as file:
        file.write(found.sub(lambda m: m[1] + "\n" + "\n".join(lines) + "\n\n" + m[2], text))


def write_rows(page, name, head, rows):
    """All columns of a page's table, in NAME.csv in the folder of the page's name."""
    folder = os.path.splitext(page)[0]
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(folder, name + ".csv"), "w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([head, *rows])
