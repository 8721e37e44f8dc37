"""Simulated runs on Ray Tune against the same runs in plain processes: what a second slot brings.

A plain process does one run after the other and nothing else. Trials are timed from the first report of each
worker, so that starting workers and importing PyTorch do not count; `with start` counts them too:

    python benchmarks/slots.py --runs 12 --rounds 2
"""

import argparse
import multiprocessing
import os
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import torch

from cluster.comparison.folder import ComparisonFolder
from cluster.comparison.records import RunKey
from cluster.comparison.tune import BestSoFar, Watch, submit
from cluster.comparison.worker import ComparisonJob
from cluster.config import RaySettings
from cluster.progress import ProgressLine
from cluster.runtime.session import connect
from workers import setups

METHOD = "se"


@dataclass(frozen=True, order=True)
class Report:
    """A worker has ended trials.

    Attributes:
        at: seconds of the monotonic clock.
        trials: since its last report.
    """

    at: float
    trials: int


@dataclass
class Clock(Watch):
    """Notes when workers report."""

    reports: list[Report] = field(default_factory=list)

    def on_trial_result(self, *_: Any, result: dict[str, Any], **__: Any) -> None:
        """Trials ended."""
        self.reports.append(Report(time.monotonic(), result.get("trials", 0)))


@dataclass(frozen=True)
class Rates:
    """Trials per second, once workers run and with their start."""

    running: float
    with_start: float

    @classmethod
    def of(cls, begin: float, reports: list[Report], workers: int) -> "Rates":
        """The first report of each worker begins the clock, so its trials are not counted."""
        first, later = sorted(reports)[:workers], sorted(reports)[workers:]
        known, end = sum(each.trials for each in later), later[-1].at
        of_first = sum(each.trials for each in first)
        return cls(known / (end - first[-1].at), (known + of_first) / (end - begin))


def on_tune(job: ComparisonJob, keys: list[RunKey], slots: int) -> Rates:
    """As `svaedc compare` does it."""
    with connect(RaySettings(num_cpus=slots), address=None, parts=()):
        progress = ProgressLine("trials", len(keys) * job.length, 0)
        clock = Clock(progress, BestSoFar((METHOD,)), lambda _: None)
        begin = time.monotonic()
        submit(job, keys, slots, clock)
        return Rates.of(begin, clock.reports, slots)


def one_after_the_other(job: ComparisonJob, keys: list[RunKey]) -> list[Report]:
    """Runs in this process, with a report of each trial."""
    torch.set_num_threads(1)
    setup, reports = setups.load(job.setup), []
    with setup.open() as environment:
        for key in keys:
            reports += [Report(time.monotonic(), 1) for _ in job.run(key, setup, environment)]
    return reports


def plain(job: ComparisonJob, keys: list[RunKey], processes: int) -> Rates:
    """The runs dealt out to processes that know nothing of each other."""
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        begin = time.monotonic()
        reports = pool.starmap(one_after_the_other, [(job, keys[i::processes]) for i in range(processes)])
        return Rates.of(begin, [report for each in reports for report in each], processes)


WAYS: dict[str, Callable[[ComparisonJob, list[RunKey]], Rates]] = {
    "one slot": lambda job, keys: on_tune(job, keys, 1),
    "two slots": lambda job, keys: on_tune(job, keys, 2),
    "one process": lambda job, keys: plain(job, keys, 1),
    "two processes": lambda job, keys: plain(job, keys, 2),
}
RATIOS = (
    ("two slots", "one slot", "  target >= 1.7"),
    ("two processes", "one process", ""),
    ("two slots", "two processes", ""),
)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--setup", default="franka")
    parser.add_argument("--runs", type=int, default=12, help="of each turn; an even number")
    parser.add_argument("--rounds", type=int, default=2)
    arguments = parser.parse_args()
    keys = [RunKey(METHOD, 1000 + run) for run in range(arguments.runs)]
    rates: dict[str, list[Rates]] = {way: [] for way in WAYS}
    print(
        f"{arguments.setup}, {METHOD}, {len(keys)} runs; "
        f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    )
    for _ in range(arguments.rounds):
        for way, measured in WAYS.items():
            with tempfile.TemporaryDirectory() as name:
                (Path(name) / "runs").mkdir()
                job = ComparisonJob(
                    ComparisonFolder(Path(name)),
                    arguments.setup,
                    "paper",
                    (),
                    pool_size=5000,
                    initial=2,
                    trials=20,
                )
                rate = measured(job, keys)
            rates[way].append(rate)
            print(f"  {way:<14}{rate.running:7.2f} trials/s, with start {rate.with_start:.2f}", flush=True)
    for label, part in (("running", "running"), ("with start", "with_start")):
        # Equal trials in every turn: the harmonic mean of the rates is that of all of them.
        mean = {way: len(each) / sum(1 / getattr(one, part) for one in each) for way, each in rates.items()}
        print(f"{label}:")
        for top, bottom, target in RATIOS:
            print(f"  {top} / {bottom}: {mean[top] / mean[bottom]:.2f}{target if part == 'running' else ''}")
    print(f"load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
