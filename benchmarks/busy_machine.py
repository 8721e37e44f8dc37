"""Training beside other work: updates per second of `svaedc train`, quiet and with every core taken.

Collects 512 Franka episodes, then trains on them four times: with one thread, the default, and with all of
them, each on a quiet machine and beside as many busy loops as there are cores. A fair share of one thread
among n loops on n cores is n / (n + 1); the ratios say what is left of it. `--seconds N` measures longer.
"""

import argparse
import os
import re
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

COUNT = re.compile(r"(\d+)/\d+ updates")
SVAEDC = str(Path(sys.executable).with_name("svaedc"))


@contextmanager
def busy(loops):
    processes = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(loops)]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
            process.wait()


def rate(folder, threads, seconds):
    """Updates per second between the first progress line and the last within so many seconds of it."""
    model = Path(tempfile.mkdtemp(dir=folder))
    command = [SVAEDC, "train", "--dataset", str(folder / "data"), "--model", str(model / "model")]
    command += ["--set", "train.updates=100000", *threads]
    process = subprocess.Popen(command, cwd=model, stderr=subprocess.PIPE, text=True)
    seen = []
    for line in process.stderr:
        found = COUNT.search(line)
        if found:
            seen.append((time.monotonic(), int(found[1])))
        if seen and seen[-1][0] - seen[0][0] > seconds:
            break
    process.terminate()
    process.communicate()
    (begin, first), (end, last) = seen[0], seen[-1]
    return (last - first) / (end - begin)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=40.0)
    seconds = parser.parse_args().seconds
    cores = len(os.sched_getaffinity(0))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        collect = [
            SVAEDC,
            "collect",
            "--setup",
            "franka",
            "--episodes",
            "512",
            "--dataset",
            str(folder / "data"),
        ]
        subprocess.run(collect, check=True, cwd=folder, stderr=subprocess.DEVNULL)
        for label, threads in (
            ("one thread, the default", []),
            ("all threads", ["--set", "train.threads=all"]),
        ):
            quiet = rate(folder, threads, seconds)
            with busy(cores):
                beside = rate(folder, threads, seconds)
            share = beside / quiet
            print(
                f"{label}: {quiet:.2f} updates/s quiet, {beside:.2f} beside {cores} busy loops: {share:.2f} "
                f"(fair share of one thread {cores / (cores + 1):.2f})",
                flush=True,
            )


if __name__ == "__main__":
    main()
