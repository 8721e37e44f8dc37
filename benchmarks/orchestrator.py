"""What the orchestrator itself costs: a collection whose rollouts are replaced by constant arrays.

The arrays have the shapes of a Franka episode and everything else is real: every shard is encoded, hashed,
synchronised and published by Ray actors, and the run is recorded in MLflow. Prints one row for each number of
episodes, to show how the cost grows:

    python benchmarks/orchestrator.py --episodes 10000 20000 50000
"""

import argparse
import os
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import psutil

from cluster.config import CollectSettings, RaySettings, TrackingSettings
from cluster.datasets.collect import collect
from cluster.datasets.plan import plan_collection
from cluster.datasets.worker import RolloutActor
from cluster.runtime.session import connect
from cluster.tracking import open_tracker
from workers import setups
from workers.collection.shard import ShardReport, collect_shard
from workers.dataset.folder import Dataset
from workers.dataset.shards import Shard
from workers.episode import Episode
from workers.setups import Setup

SAMPLE_SECONDS = 0.5
WARM_SHARE = 0.1
"""Of the shards, after which the driver's memory is first looked at: by then it has imported all it needs."""


def constant_episodes(setup: Setup, dataset: Dataset, shard: Shard) -> list[Episode]:
    """Episodes of the setup's shapes that cost nothing."""
    episode = Episode(
        x=np.full(setup.dimensions, 0.5, dtype=np.float32),
        xi=np.full((len(setup.observation), setup.horizon), 0.25, dtype=np.float32),
        bad=np.zeros(setup.horizon, dtype=np.uint8),
        y=0.0,
        f=0.0,
        stop="",
        physics={name: low for name, (low, _) in dataset.identity.physics.items()},
    )
    return [episode] * shard.episodes


class ConstantActor(RolloutActor):
    """A rollout process that does everything but the rollouts."""

    def collect(self, shard: Shard) -> ShardReport:
        """One shard of constant episodes."""
        return collect_shard(self._setup, self._dataset, shard, constant_episodes)


class Watch:
    """Memory of this process over the course of a collection, and CPU time of it and of all below it."""

    def __init__(self, folder: Path, shards: int):
        self.process = psutil.Process()
        self.before = self.process.memory_info().rss
        self.warm = self.peak = 0
        self.cpu: dict[int, float] = {}
        self._folder, self._shards = folder, shards
        self._first = self._sampled()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def _watch(self):
        while not self._ended.wait(SAMPLE_SECONDS):
            resident = self.process.memory_info().rss
            self.peak = max(self.peak, resident)
            if not self.warm and len(list(self._folder.glob("*.parquet"))) > WARM_SHARE * self._shards:
                self.warm = resident
            self._sampled()

    def _sampled(self) -> dict[int, float]:
        for process in [self.process, *self.process.children(recursive=True)]:
            try:
                times = process.cpu_times()
                self.cpu[process.pid] = times.user + times.system
            except psutil.NoSuchProcess:
                continue
        return dict(self.cpu)

    def stop(self) -> tuple[float, float]:
        """CPU seconds of the driver, and of everything."""
        self._ended.set()
        self._thread.join()
        spent = {pid: seconds - self._first.get(pid, 0.0) for pid, seconds in self._sampled().items()}
        return spent[self.process.pid], sum(spent.values())


def measured(episodes: int, session, parent: Path) -> str:
    """One collection, in one row."""
    folder = parent / f"dataset-{episodes}"
    tracker = open_tracker(TrackingSettings(uri=f"sqlite:///{parent}/mlflow.db"))
    settings = CollectSettings()
    watch = Watch(folder, episodes // settings.episodes_per_shard)
    begin = time.monotonic()
    dataset = collect(
        plan_collection(
            setup=setups.load("franka"), episodes=episodes, folder=folder, seed=0, settings=settings
        ),
        settings,
        session,
        tracker,
        ConstantActor,
    )
    wall = time.monotonic() - begin
    driver, total = watch.stop()
    complete = dataset.episodes() == episodes and not dataset.missing(episodes)
    return (
        f"{episodes:>9}{len(dataset.shards()):>8}{wall:>10.1f}{1e3 * wall / episodes:>12.3f}{driver:>12.1f}"
        f"{total:>10.1f}{(watch.peak - watch.before) / 1e6:>12.1f}{(watch.peak - watch.warm) / 1e6:>12.1f}"
        f"{'yes' if complete else 'NO':>10}"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--episodes", type=int, nargs="+", default=[10_000, 20_000])
    counts = parser.parse_args().episodes
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores; driver's growth in MB, from its")
    print(" episodes  shards    wall s  ms/episode  driver CPU  all CPU  start: < 50  first 10 %  complete")
    with (
        tempfile.TemporaryDirectory() as name,
        connect(RaySettings(num_cpus=os.cpu_count() or 1), address=None, parts=()) as session,
    ):
        for episodes in counts:
            print(measured(episodes, session, Path(name)), flush=True)
    print(f"load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
