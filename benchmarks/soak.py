"""Trials for half an hour: memory, open files and the time of a trial must stay what they are.

Campaigns of twelve trials follow each other in one process, on one robot, as a rehearsal that costs next to
nothing; so what grows with the robot's past (its ledger, its journals) is seen, and not the simulation.
"""

import argparse
import os
import statistics
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import psutil

from cluster.hardware.executor import Executor
from cluster.hardware.plan import CampaignPlan, identify
from cluster.hardware.states import Approval
from cluster.hardware.status import Phase

ROBOT = "rehearsal:quadratic-30d"
TRIALS = 10  # after two random ones
PARTS = 10  # lines that are printed


def main() -> None:
    """Run, and print a line for every tenth of the time."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=30.0)
    seconds = 60.0 * parser.parse_args().minutes
    process, began = psutil.Process(), time.monotonic()
    with tempfile.TemporaryDirectory(prefix="svaedc-soak-", ignore_cleanup_errors=True) as name:
        folder, trials, campaigns = Path(name), 0, 0
        for part in range(PARTS):
            taken: list[float] = []
            while time.monotonic() - began < (part + 1) * seconds / PARTS:
                taken += campaign(folder / f"campaign-{campaigns}", folder / "home")
                campaigns += 1
            trials += len(taken)
            megabytes, files = process.memory_info().rss / 1e6, process.num_fds()
            middle, ledger = statistics.median(taken) * 1e3, (folder / "home" / "ledger.jsonl").stat().st_size
            print(
                f"{(time.monotonic() - began) / 60:5.1f} min: {trials} trials in {campaigns} campaigns, "
                f"{megabytes:.0f} MB, {files} open files, {len(process.children())} processes at the robot, "
                f"median trial {middle:.0f} ms, ledger {ledger} bytes, "
                f"load {os.getloadavg()[0]:.1f}",
                flush=True,
            )


def campaign(folder: Path, home: Path) -> Iterator[float]:
    """One campaign; seconds of each of its trials."""
    identity = identify(ROBOT, "random", TRIALS, 3, 20, None, Approval.POLICY)
    executor = Executor(CampaignPlan(identity, folder, None, 0.0, None, home))
    try:
        now = executor.status()
        while now.phase is Phase.READY:
            began = time.monotonic()
            now = executor.advance()
            yield time.monotonic() - began
    finally:
        executor.close()


if __name__ == "__main__":
    main()
