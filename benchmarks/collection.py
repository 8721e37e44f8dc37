"""What collecting costs beside the rollouts themselves: CPU of Ray and storage, memory of driver and actors.

Prints shares of one run; `--episodes N` changes its length.
"""

import argparse
import os
import tempfile
import threading
import time
from contextlib import suppress
from pathlib import Path

import psutil

from cluster.collect import collect
from cluster.config import CollectSettings, RaySettings, TrackingSettings
from cluster.session import connect
from cluster.tracking import open_tracker
from workers import setups

SAMPLE_SECONDS = 4.0  # sampling costs CPU time of its own
ACTOR_SECONDS = 0.1  # reading those two processes is cheap, and what they did after the last reading is lost


class Meter:
    """CPU seconds and memory of this process and all below it, sampled until `stop`."""

    def __init__(self):
        self.driver = psutil.Process()
        self.cpu: dict[int, float] = {}
        self.first = self.sample()
        self.driver_rss: list[int] = []
        self.actor_pss: dict[int, int] = {}
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def sample(self) -> dict[int, float]:
        """CPU seconds of every process seen so far; those that ended keep their last."""
        for process in [self.driver, *self.driver.children(recursive=True)]:
            self.read(process)
        return dict(self.cpu)

    def read(self, process: psutil.Process) -> None:
        """CPU seconds of one process, unless it has ended."""
        with suppress(psutil.NoSuchProcess):
            times = process.cpu_times()
            self.cpu[process.pid] = times.user + times.system

    def _watch(self):
        due = time.monotonic()
        while not self._ended.wait(ACTOR_SECONDS):
            for pid in self.actor_pss:
                with suppress(psutil.NoSuchProcess):
                    self.read(psutil.Process(pid))
            if time.monotonic() < due:
                continue
            due = time.monotonic() + SAMPLE_SECONDS
            self.sample()
            self.driver_rss.append(self.driver.memory_info().rss)
            for process in self.driver.children(recursive=True):
                try:
                    if "RolloutActor" in " ".join(process.cmdline()):
                        pss = process.memory_full_info().pss
                        self.actor_pss[process.pid] = max(pss, self.actor_pss.get(process.pid, 0))
                except psutil.NoSuchProcess:
                    continue

    def stop(self) -> float:
        """CPU seconds since the meter began, of all processes that were seen."""
        self._ended.set()
        self._thread.join()
        last = self.sample()
        return sum(seconds - self.first.get(pid, 0.0) for pid, seconds in last.items())


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--episodes", type=int, default=4096)
    episodes = parser.parse_args().episodes
    setup = setups.load("franka")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        tracker = open_tracker(TrackingSettings(uri=f"sqlite:///{folder}/mlflow.db"))
        with connect(RaySettings(num_cpus=os.cpu_count() or 1), address=None) as session:
            meter = Meter()
            begin = time.monotonic()
            dataset = collect(
                setup=setup,
                episodes=episodes,
                folder=folder / "dataset",
                seed=0,
                settings=CollectSettings(),
                session=session,
                tracker=tracker,
            )
            seconds, total = time.monotonic() - begin, meter.stop()
        [run] = tracker.client.search_runs([tracker.experiment])
        metrics = run.data.metrics
        report(episodes, seconds, total, metrics, meter, dataset.size() / episodes)


def report(episodes, seconds, total, metrics, meter, size):
    all_seconds = metrics["core_hours"] * 3600
    storage = all_seconds * metrics["storage_share"]
    rollouts = all_seconds - storage
    half = len(meter.driver_rss) // 2
    early, late = max(meter.driver_rss[: half or 1]), max(meter.driver_rss[half:])
    rows = [
        ("rollouts / all CPU", rollouts / total, "%", "-"),
        ("Ray and storage / all CPU", 1 - rollouts / total, "%", "<= 5"),
        ("storage / all CPU", storage / total, "%", "-"),
    ]
    print(f"{episodes} episodes in {seconds:.0f} s, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    for label, share, unit, target in rows:
        print(f"  {label:<36}{100 * share:8.2f} {unit:<3} target {target}")
    print(f"  {'CPU of one episode in a rollout':<36}{1e3 * rollouts / episodes:8.2f} ms")
    pss = max(meter.actor_pss.values()) / 1e6
    print(f"  {'memory of a rollout actor (PSS)':<36}{pss:8.0f} MB  target <= 260")
    print(f"  {'memory of the driver, first half':<36}{early / 1e6:8.0f} MB (RSS)")
    print(f"  {'memory of the driver, second half':<36}{late / 1e6:8.0f} MB (RSS)")
    print(f"  {'one trajectory on disk':<36}{size / 1e3:8.2f} kB  target <= 28")


if __name__ == "__main__":
    main()
