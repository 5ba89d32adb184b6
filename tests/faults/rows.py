"""Rows of docs/limits/faults.csv: a test leaves faults/NAME.csv under the folder where it runs; table.py reads them."""
import csv
import os

FOLDER = 'faults'


class Rows:
    """The rows of one test program, begun anew."""

    def __init__(self, name):
        os.makedirs(FOLDER, exist_ok=True)
        self.path = os.path.abspath(os.path.join(FOLDER, name + '.csv'))
        self.mode = 'w'  # for the first row: other programs may import this one

    def add(self, fault, what):
        mode, self.mode = self.mode, 'a'
        with open(self.path, mode, encoding='utf-8', newline='') as f:
            csv.writer(f).writerow((fault, what))
