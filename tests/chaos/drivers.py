"""`svaedc collect` as a process of its own that may be killed, and what its dataset must be in the end."""

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing.process import BaseProcess
from pathlib import Path

import numpy as np

from tests.chaos import victims
from workers import setups
from workers.collection.shard import collect_shard
from workers.dataset import shards
from workers.dataset.folder import MANIFEST, Dataset, create
from workers.dataset.identity import identity_of
from workers.dataset.inventory import sweep_digests
from workers.dataset.shards import Shard, present
from workers.dataset.storage.temporary import WRITING, writer

REPOSITORY = Path(__file__).parents[2]
SETUP = os.environ.get("CHAOS_SETUP", "quadratic-30d")
SEED, PER_SHARD, EPISODES = 11, 4, 2400
"""Rollouts that cost next to nothing, in 600 files: what kills hit is starting, writing and publishing."""
PATIENCE = 600.0
"""Seconds after which something that must end is taken to hang."""
FILES_BETWEEN, SECONDS_BETWEEN = 24, 3.0
"""Fewer files than that are finished between two kills, unless so many seconds pass, as in a start."""


def collected_here(folder: Path, episodes: int = EPISODES) -> Dataset:
    """The dataset as one process makes it, if nobody disturbs it; the shards that are there are kept."""
    setup = setups.load(SETUP)
    dataset = create(folder, identity_of(setup, seed=SEED, episodes_per_shard=PER_SHARD))
    for shard in dataset.missing(episodes):
        collect_shard(setup, dataset, shard)
    return dataset


def collect_and_clean(folder: Path, episodes: int) -> None:
    """What a driver and its rollout processes do to a dataset: sweep, collect what is missing, sweep."""
    shards.sweep(folder)
    dataset = collected_here(folder, episodes)
    shards.sweep(folder)
    sweep_digests(dataset)


def command(folder: Path, store: Path, *options: str) -> list[str]:
    """The command line of a driver."""
    return [
        *(sys.executable, "-m", "cluster", "collect", "--setup", SETUP, "--dataset", str(folder)),
        *("--episodes", str(EPISODES), "--seed", str(SEED)),
        *("--set", f"collect.episodes_per_shard={PER_SHARD}", "--set", "collect.actors=2"),
        *("--set", f"tracking.uri=sqlite:///{store}", "--set", "ray.num_cpus=2", *options),
    ]


class Drivers:
    """The drivers of a test, none of which outlives it."""

    def __init__(self) -> None:
        self._started: list[subprocess.Popen[bytes]] = []

    def start(self, arguments: list[str], log: Path) -> subprocess.Popen[bytes]:
        """A driver, whose words are appended to a log."""
        with log.open("ab") as output:
            process = subprocess.Popen(arguments, cwd=REPOSITORY, stdout=output, stderr=output)
        self._started.append(process)
        return process

    def end(self) -> None:
        """Kill what a failed test left running."""
        for process in self._started:
            if process.poll() is None:
                for pid in [process.pid, *victims.below(process.pid)]:
                    victims.kill(pid)
                process.wait()


@dataclass
class Blows:
    """SIGKILLs that a seed decides: whom and when; and their counts.

    Attributes:
        folder: where the datasets are.
        seed: of all draws.
        dealt: kills by the kind of victim.
        unfinished: kills of an actor that left a file unfinished.
        seen: every process that was below a driver when something was killed, by id and start time.
    """

    folder: Path
    seed: int
    dealt: Counter[str] = field(default_factory=Counter)
    unfinished: int = 0
    seen: set[tuple[int, str]] = field(default_factory=set)

    def __post_init__(self) -> None:
        """Begin the sequence of draws."""
        self.rng = np.random.default_rng(self.seed)

    def wait(self, longest: float) -> None:
        """A random while."""
        time.sleep(self.rng.uniform(0.0, longest))

    def pause(self, folder: Path, is_over: Callable[[], bool]) -> None:
        """Wait for some more files in a folder: a busy machine gets as far between kills as an idle one.

        Args:
            folder: of the dataset.
            is_over: whether there is nothing to wait for any more.
        """
        enough = len(present(folder)) + self.rng.integers(FILES_BETWEEN)
        deadline = time.monotonic() + self.rng.uniform(0.0, SECONDS_BETWEEN)
        while len(present(folder)) < enough and time.monotonic() < deadline and not is_over():
            time.sleep(0.05)

    def actor(self, root: int) -> bool:
        """Kill one of the rollout processes below a process; False when there is none."""
        pids = victims.actors(root)
        draw = self.rng.random()
        if not pids or not victims.kill(pid := sorted(pids)[int(draw * len(pids))]):
            return False
        self.dealt["actor"] += 1
        self.unfinished += bool(list(self.folder.glob(f"*/{WRITING}/*.{pid}_*")))
        return True

    def writer(self, process: BaseProcess) -> None:
        """Kill a process that writes shards itself, unless it has ended."""
        process.kill()
        process.join()
        if process.exitcode == -signal.SIGKILL:
            self.dealt["writer"] += 1
            self.unfinished += bool(list(self.folder.glob(f"*/{WRITING}/*.{process.pid}_*")))

    def driver(self, process: subprocess.Popen[bytes]) -> None:
        """Kill a driver, unless it has ended."""
        self.seen.update(victims.births(victims.below(process.pid)))
        if process.poll() is None:
            process.kill()
            self.dealt["driver"] += 1
        process.wait()

    def raylet(self, process: subprocess.Popen[bytes]) -> None:
        """Kill Ray itself below a driver some time after it began to run, unless the driver ends before."""
        while process.poll() is None and not victims.raylets(process.pid):
            time.sleep(0.02)
        self.wait(SECONDS_BETWEEN)
        self.seen.update(victims.births(victims.below(process.pid)))
        for pid in victims.raylets(process.pid):
            self.dealt["raylet"] += victims.kill(pid)

    def __str__(self) -> str:
        """The counts."""
        kinds = ", ".join(f"{count} of {kind}s" for kind, count in sorted(self.dealt.items()))
        return f"{self.dealt.total()} kills (CHAOS_SEED={self.seed}): {kinds}; {self.unfinished} amid a file"


def seed() -> int:
    """CHAOS_SEED, to deal the blows of an earlier test again; a fresh one otherwise."""
    return int(os.environ.get("CHAOS_SEED", time.time_ns() % 2**32))


def begun(folder: Path) -> Path:
    """A dataset of no episodes in which a living process has an unfinished file: its path."""
    create(folder, identity_of(setups.load(SETUP), seed=SEED, episodes_per_shard=PER_SHARD))
    unfinished = folder / WRITING / f"{Shard(0, PER_SHARD).name}.{writer()}"
    unfinished.write_bytes(b"half")
    return unfinished


def published(folder: Path) -> dict[str, bytes]:
    """Every file of a dataset but those that are unfinished."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def require_same(folder: Path, undisturbed: dict[str, bytes], unfinished: list[Path]) -> None:
    """Nothing lost, doubled or changed, and nothing unfinished but what its living writer left there."""
    assert published(folder) == undisturbed
    assert list((folder / WRITING).iterdir()) == unfinished
    put_aside = folder / "quarantine"
    assert not put_aside.exists() or list(put_aside.iterdir()) == []


def require_part(folder: Path, undisturbed: dict[str, bytes]) -> None:
    """What is published already is as it would be without faults; a digest may be there before its shard."""
    for name, content in published(folder).items():
        assert undisturbed[name] == content, name
    assert (folder / MANIFEST).exists()
