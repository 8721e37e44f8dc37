"""What collecting costs beside the rollouts themselves: CPU of Ray and storage, memory of driver and actors.

Prints the CPU time of one run by what took it, and what each process of Ray takes when nothing is to be done:
the first grows with the episodes, the second with the hours. The start of the cluster is not counted:

    python benchmarks/collection.py --episodes 10240
"""

import argparse
import os
import tempfile
import threading
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import psutil

from cluster.config import CollectSettings, RaySettings, TrackingSettings
from cluster.datasets.collect import collect
from cluster.datasets.plan import plan_collection
from cluster.runtime.session import connect
from cluster.tracking import open_tracker
from workers import setups

SAMPLE_SECONDS = 4.0  # sampling costs CPU time of its own
ACTOR_SECONDS = 0.1  # reading those two processes is cheap, and what they did after the last reading is lost
IDLE_SECONDS = 20.0
KINDS = {
    "RolloutActor": "actors",
    "raylet": "raylet",
    "gcs_server": "GCS",
    "log_monitor": "log monitor",
    "DashboardAgent": "agents",
    "RuntimeEnvAgent": "agents",
    "dashboard": "dashboard",
    "monitor.py": "autoscaler",
}
"""What a process is, by the first of these words in the command it shows; otherwise one of the others."""


class Meter:
    """CPU seconds and memory of this process and all below it, sampled until `stop`; without its own."""

    def __init__(self):
        self.driver = psutil.Process()
        self.cpu: dict[int, float] = {}
        self.kinds = {self.driver.pid: "driver"}
        self.driver_rss: list[int] = []
        self.actor_pss: dict[int, int] = {}
        self.first = self.sample()
        self._own = 0.0
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def sample(self) -> dict[int, float]:
        """CPU seconds of every process seen so far; those that ended keep their last."""
        for process in [self.driver, *self.driver.children(recursive=True)]:
            self.read(process)
        return dict(self.cpu)

    def read(self, process: psutil.Process) -> None:
        """CPU seconds and kind of one process, unless it has ended."""
        with suppress(psutil.NoSuchProcess):
            times = process.cpu_times()
            self.cpu[process.pid] = times.user + times.system
            if process.pid != self.driver.pid:
                self.kinds[process.pid] = kind(" ".join(process.cmdline()))

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
            for pid in [pid for pid, kind in self.kinds.items() if kind == "actors"]:
                with suppress(psutil.NoSuchProcess):
                    pss = psutil.Process(pid).memory_full_info().pss
                    self.actor_pss[pid] = max(pss, self.actor_pss.get(pid, 0))
        self._own = time.thread_time()

    def stop(self) -> dict[str, float]:
        """CPU seconds since the meter began, by kind, of all processes that were seen."""
        self._ended.set()
        self._thread.join()
        spent: dict[str, float] = {}
        for pid, seconds in self.sample().items():
            name = self.kinds[pid]
            spent[name] = spent.get(name, 0.0) + seconds - self.first.get(pid, 0.0)
        spent["driver"] -= self._own
        return spent


@dataclass(frozen=True)
class Costs:
    """CPU seconds of one collection, and what Ray takes meanwhile without any."""

    episodes: int
    wall: float
    spent: dict[str, float]
    idle: dict[str, float]  # CPU seconds per second, by kind
    rollouts: float
    storage: float


def kind(command: str) -> str:
    """What a process is."""
    return next((name for word, name in KINDS.items() if word in command), "others")


def idle() -> dict[str, float]:
    """CPU seconds per second, by kind, while there is nothing to do."""
    meter = Meter()
    time.sleep(IDLE_SECONDS)
    return {name: seconds / IDLE_SECONDS for name, seconds in meter.stop().items()}


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--episodes", type=int, default=4096)
    episodes = parser.parse_args().episodes
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        tracker = open_tracker(TrackingSettings(uri=f"sqlite:///{folder}/mlflow.db"))
        ray = RaySettings(num_cpus=os.cpu_count() or 1)
        with connect(ray, address=None, parts=()) as session:
            at_rest, meter, begin = idle(), Meter(), time.monotonic()
            dataset = collect(
                plan_collection(
                    setup=setups.load("franka"),
                    episodes=episodes,
                    folder=folder / "dataset",
                    seed=0,
                    settings=CollectSettings(),
                ),
                CollectSettings(),
                session,
                tracker,
            )
            wall, spent = time.monotonic() - begin, meter.stop()
        [run] = tracker.client.search_runs([tracker.experiment])
        in_actors = run.data.metrics["core_hours"] * 3600
        storage = in_actors * run.data.metrics["storage_share"]
        report(Costs(episodes, wall, spent, at_rest, in_actors - storage, storage))
        report_memory(meter, dataset.size() / episodes)


def report(costs: Costs) -> None:
    """The shares of all CPU time."""
    total = sum(costs.spent.values())
    print(f"{costs.episodes} episodes in {costs.wall:.0f} s ({costs.episodes / costs.wall:.1f}/s), ", end="")
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    rows = {
        "rollouts": costs.rollouts,
        "everything else (target <= 3 %)": total - costs.rollouts,
        "  storage: Parquet, SHA-256, fsync": costs.storage,
        "  start of the actors, and Ray in them": costs.spent["actors"] - costs.rollouts - costs.storage,
    }
    rows |= {f"  {name}": costs.spent[name] for name in sorted(costs.spent) if name != "actors"}
    print(f"  {'':<40}{'CPU s':>8}{'% of all':>10}{'ms/episode':>12}{'at rest, % of a core':>22}")
    for label, seconds in rows.items():
        rest = costs.idle.get(label.strip())
        print(
            f"  {label:<40}{seconds:8.2f}{100 * seconds / total:10.2f}{1e3 * seconds / costs.episodes:12.3f}"
            + (f"{100 * rest:22.2f}" if rest is not None else "")
        )
    at_rest = sum(costs.idle.values())
    print(f"  {'the cluster at rest, before any actor':<40}{at_rest * costs.wall:8.2f}", end="")
    print(f"{100 * at_rest * costs.wall / total:10.2f}{'':>12}{100 * at_rest:22.2f}")


def report_memory(meter: Meter, size: float) -> None:
    """Memory of driver and actors, and the bytes of an episode."""
    half = len(meter.driver_rss) // 2
    early, late = max(meter.driver_rss[: half or 1]), max(meter.driver_rss[half:])
    pss = max(meter.actor_pss.values()) / 1e6
    print(f"  {'memory of a rollout actor (PSS)':<40}{pss:8.0f} MB  target <= 260")
    print(f"  {'memory of the driver, first half':<40}{early / 1e6:8.0f} MB (RSS)")
    print(f"  {'memory of the driver, second half':<40}{late / 1e6:8.0f} MB (RSS)")
    print(f"  {'one trajectory on disk':<40}{size / 1e3:8.2f} kB  target <= 28")


if __name__ == "__main__":
    main()
