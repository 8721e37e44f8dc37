"""Training beside other work: updates per second of `svaedc train`, quiet and with every core taken.

First a plain loop is counted, quiet and beside as many busy loops as there are cores: what it keeps is a fair
share on this machine, n / (n + 1) of n cores if it were ideal. Then 512 Franka episodes are collected, and
trained on twice: with one thread, the default, and with all of them. Each training is measured on a quiet
machine first; then the busy loops are started beside it. The ratios say what is left of the quiet speed.
`--seconds N` measures longer.
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


def plain_loop(seconds):
    """Iterations per second of a process that does nothing but count, in steps that are no system calls."""
    code = (
        "import sys, time\n"
        "end, count = time.monotonic() + float(sys.argv[1]), 0\n"
        "while time.monotonic() < end:\n"
        "    for _ in range(100_000):\n"
        "        count += 1\n"
        "print(count)"
    )
    printed = subprocess.check_output([sys.executable, "-c", code, str(seconds)], encoding="utf-8")
    return float(printed) / seconds


def rates(folder, threads, seconds, cores):
    """Updates per second, quiet and beside busy loops, from one progress line to a later one."""
    model = Path(tempfile.mkdtemp(dir=folder))
    command = [SVAEDC, "train", "--dataset", str(folder / "data"), "--model", str(model / "model")]
    command += ["--set", "train.updates=100000", *threads]
    process = subprocess.Popen(command, cwd=model, stderr=subprocess.PIPE, encoding="utf-8")
    lines = ((time.monotonic(), COUNT.search(line)) for line in process.stderr)
    counts = ((moment, int(found[1])) for moment, found in lines if found)
    quiet = _rate(counts, seconds)
    with busy(cores):
        beside = _rate(counts, seconds)
    process.terminate()
    process.communicate()
    return quiet, beside


def _rate(counts, seconds):
    begin, first = next(counts)
    end, last = next((moment, count) for moment, count in counts if moment - begin > seconds)
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
        alone = plain_loop(seconds / 4)
        with busy(cores):
            share = plain_loop(seconds / 4) / alone
        print(f"a plain loop beside {cores} busy loops keeps {share:.2f} of its speed", flush=True)
        for label, threads in (
            ("one thread, the default", []),
            ("all threads", ["--set", "train.threads=all"]),
        ):
            quiet, beside = rates(folder, threads, seconds, cores)
            print(
                f"{label}: {quiet:.2f} updates/s quiet, {beside:.2f} beside {cores} busy loops: "
                f"{beside / quiet:.2f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
