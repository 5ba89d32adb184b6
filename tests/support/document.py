"""Runs a document: its fenced blocks, in order, in an empty folder.

  ```sh               commands, by bash; the block must end with status 0, or N after "```sh status N"
  ```LANGUAGE NAME    a file of this name
  ```text             lines that the last commands printed, most of their words, in their order; a line "..." is left out. Numbers may differ by a per cent
                      or one in their last digit; by anything where both are below 1e-5, as counts of iterations, and where the line
                      has seconds, milliseconds, megabytes or a gain.

Blocks without a word after the language, except sh and text, are not run: they are for reading."""
import difflib
import os
import re
import subprocess

from common import PATIENCE

NUMBER = re.compile(r'(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w])')
COUNTED = re.compile(r'\d+ iterations')
TIMED = re.compile(r'seconds|\d m?s\b|\d us\b| MB\b|gain:')


def blocks(page):
    """(language, words after it, text) of each fenced block."""
    with open(page, encoding='utf-8') as f:
        text = f.read()
    for info, body in re.findall(r'^```([^\n]+)\n(.*?)^```$', text, flags=re.M | re.S):
        language, *words = info.split()
        yield language, words, body


def same(expected, found):
    """Whether a printed line is the expected one: most of its words, and its numbers within what is allowed."""
    timed = TIMED.search(expected)
    expected, found = COUNTED.sub('iterations', expected), COUNTED.sub('iterations', found)
    words = [NUMBER.sub('#', line).split() for line in (expected, found)]
    if len(NUMBER.findall(expected)) != len(NUMBER.findall(found)) or difflib.SequenceMatcher(None, *words).ratio() < 0.6:
        return False
    for a, b in zip(NUMBER.findall(expected), NUMBER.findall(found)):
        mantissa, _, power = a.partition('e')
        digit = 10.0 ** (int(power or 0) - len(mantissa.partition('.')[2])) if '.' in mantissa else 0
        a, b = float(a), float(b)
        if not timed and abs(a - b) > max(0.01 * max(abs(a), abs(b)), 1.5 * digit) and max(abs(a), abs(b)) > 1e-5:
            return False
    return True


def compare(expected, printed):
    """Fails unless the expected lines are among the printed ones, in order."""
    lines, at = printed.splitlines(), 0
    for line in expected.splitlines():
        if line.strip() in ('', '...'):
            continue
        found = next((k for k in range(at, len(lines)) if same(line, lines[k])), None)
        assert found is not None, f'not printed: {line}\nprinted were:\n' + '\n'.join(lines[at:])
        at = found + 1


def run(page, folder, environment, skip=lambda body: False):
    """Runs the page; the number of command blocks that ran."""
    printed, ran = '', 0
    for language, words, body in blocks(page):
        if language == 'text':
            compare(body, printed)
        elif language == 'sh':
            status = int(words[1]) if words[:1] == ['status'] else 0
            body = '\n'.join(line for line in body.splitlines() if not skip(line))
            done = subprocess.run(['bash', '-euc', body], cwd=folder, env={**os.environ, **environment}, capture_output=True, text=True,
                                  timeout=100 * PATIENCE, check=False)
            assert done.returncode == status, f'status {done.returncode}, not {status}:\n{body}\n{done.stdout}{done.stderr}'
            printed = done.stdout + done.stderr
            ran += 1
        elif words:
            path = os.path.join(folder, words[0])
            os.makedirs(os.path.dirname(path) or '.', exist_ok=True)
            with open(path, 'w', encoding='utf-8') as f:
                f.write(body)
    return ran
