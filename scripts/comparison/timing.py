"""Commands with their time and memory; timed.folder contains their output."""
import os
import signal
import subprocess
import threading
import time


def stop(process, late, done):
    """mpiexec ends its ranks only if it is asked to end; remaining processes are killed."""
    late.set()
    os.killpg(process.pid, signal.SIGTERM)
    if not done.wait(10):
        os.killpg(process.pid, signal.SIGKILL)


def timed(command, timeout, folder=None):
    """Wall and CPU seconds (with child processes), peak MB of the largest one, None or the error."""
    begin = time.monotonic()
    with open(os.path.join(timed.folder, "log"), "wb") as log:
        with subprocess.Popen(command, stdout=log, stderr=log, cwd=folder, start_new_session=True) as process:
            late, done = threading.Event(), threading.Event()
            clock = threading.Timer(timeout, stop, (process, late, done))
            clock.start()
            _, status, usage = os.wait4(process.pid, 0)
            done.set()
            clock.cancel()
            process.returncode = os.waitstatus_to_exitcode(status)
    failure = f"timed out after {timeout:g} s" if late.is_set() else None
    if process.returncode and not failure:
        with open(log.name, encoding="utf-8", errors="replace") as text:
            last = text.read().split("\n")[-3:]
        failure = f"ended with {process.returncode}: {' '.join(last).strip()[-200:]}"
    return time.monotonic() - begin, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, failure
