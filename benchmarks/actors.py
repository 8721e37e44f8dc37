"""Rollouts on Ray actors against the same rollouts in plain processes: what the orchestrator costs in speed.

A plain process rolls out shards and does nothing else; an actor stores them as well. Clusters, processes and
imports start before the clock does. The two take turns, each turn of the actors with a cluster of its own, so
that no Ray idles beside the plain processes:

    python benchmarks/actors.py --episodes 4096 --rounds 3
"""

import argparse
import multiprocessing
import os
import tempfile
import time
from functools import partial
from multiprocessing.synchronize import Barrier
from pathlib import Path

from cluster.config import CollectSettings, RaySettings
from cluster.datasets.gather import rollout_pool
from cluster.runtime.session import connect
from workers import setups
from workers.collection.shard import roll_out
from workers.dataset.folder import create, open_dataset
from workers.dataset.identity import identity_of
from workers.dataset.shards import Shard

PER_SHARD = 64
WARM = 10**6
"""Index of the first episode, far from those that are timed, of which one shows that a process is ready."""


def rolled_out(folder: Path, shard: Shard) -> None:
    """The episodes of a shard of a dataset, thrown away."""
    dataset = open_dataset(folder)
    roll_out(setups.load(dataset.identity.setup), dataset, shard)


def begin_plain(folder: Path, barrier: Barrier) -> None:
    """Start of a plain process: everything is imported, and has run once."""
    rolled_out(folder, Shard(WARM, WARM + 1))
    barrier.wait()


def plain(folder: Path, plan: list[Shard], processes: int) -> float:
    """Seconds for a plan in plain processes, each of which takes the next shard when it is done with one."""
    context = multiprocessing.get_context("spawn")
    barrier = context.Barrier(processes + 1)
    with context.Pool(processes, begin_plain, (folder, barrier)) as pool:
        barrier.wait()
        begin = time.monotonic()
        for _ in pool.imap_unordered(partial(rolled_out, folder), plan):
            pass
        return time.monotonic() - begin


def on_actors(folder: Path, plan: list[Shard], actors: int) -> float:
    """Seconds for a plan on Ray actors, with everything that makes and keeps its files."""
    with connect(RaySettings(num_cpus=actors), address=None, parts=()):
        pool = rollout_pool(open_dataset(folder), CollectSettings(actors=actors), actors)
        with pool:
            warm = WARM
            while len(pool.answers) < actors:
                list(pool.run([Shard(warm, warm + 1)]))
                warm += 1
            begin = time.monotonic()
            list(pool.run(plan))
            return time.monotonic() - begin


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--setup", default="franka")
    parser.add_argument("--episodes", type=int, default=1024, help="of each turn")
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    arguments = parser.parse_args()
    identity = identity_of(setups.load(arguments.setup), seed=0, episodes_per_shard=PER_SHARD)
    rates: dict[str, list[float]] = {"actors": [], "plain": []}
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores; {arguments.processes} processes each")
    with tempfile.TemporaryDirectory() as name:
        for turn in range(arguments.rounds):
            dataset = create(Path(name) / f"dataset-{turn}", identity)
            plan = dataset.missing(arguments.episodes)
            for kind, measured in (("actors", on_actors), ("plain", plain)):
                seconds = measured(dataset.folder, plan, arguments.processes)
                rates[kind].append(arguments.episodes / seconds)
                print(f"  {kind:<8}{rates[kind][-1]:8.1f} episodes/s", flush=True)
    # Equal episodes in every turn: the harmonic mean of the rates is that of all of them.
    actors, processes = (len(each) / sum(1 / rate for rate in each) for each in rates.values())
    print(f"Ray actors / plain processes: {actors / processes:.3f}  target >= 0.95")
    print(f"load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
