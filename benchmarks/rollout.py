"""How much of an episode is physics: CPU time of its parts as ratios, in one run, medians over rounds.

Ratios, because they hold on a busy machine; the load is printed beside them.
"""

import argparse
import os
import statistics
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import process_time

from workers import setups
from workers.dataset import schema
from workers.dataset.identity import identity_of
from workers.environments.environment import Environment
from workers.rollout import random_episode
from workers.setups import Setup
from workers.simulation.world import World


@dataclass(frozen=True)
class Target:
    """What a setup is meant to reach, as it is printed; "-" where nothing is asked for."""

    loop: str = "-"
    planning: str = "-"
    reset: str = "-"
    episode: str = "-"
    size: str = "-"


TARGETS = {
    "franka": Target(loop="<= 1.40", planning="<= 6", reset="<= 1", episode="~ 80", size="<= 28"),
    "yumi": Target(loop="<= 1.35"),
    "daisy-27d": Target(loop="<= 1.12"),
}


@dataclass
class Stopwatch:
    """CPU seconds spent in calls of one function, the clock's own cost taken off."""

    seconds: float = 0.0

    def around(self, function: Callable, cost: float) -> Callable:
        """The function, timed; `cost` is what one reading of the clock adds."""

        def timed(*args):
            begin = process_time()
            result = function(*args)
            self.seconds += process_time() - begin - cost
            return result

        return timed


@dataclass(frozen=True)
class Round:
    """CPU seconds of one round: whole episodes, untouched, and the parts of the same episodes."""

    episodes: float
    physics: float
    planning: float
    reset: float

    @property
    def loop(self) -> float:
        """Everything but planning and reset."""
        return self.episodes - self.planning - self.reset


@contextmanager
def timed(owner: object, name: str, cost: float) -> Iterator[Stopwatch]:
    """Times an attribute's calls inside the block."""
    original = getattr(owner, name)
    stopwatch = Stopwatch()
    setattr(owner, name, stopwatch.around(original, cost))
    try:
        yield stopwatch
    finally:
        setattr(owner, name, original)


def clock_cost(calls: int = 20_000) -> float:
    """CPU seconds that one reading of the clock adds to what it measures."""
    return statistics.median(-(process_time() - process_time()) for _ in range(calls))


def measure(setup: Setup, environment: Environment, episodes: range, cost: float) -> Round:
    """Run every episode twice in turn, once untouched and once with its parts timed."""
    whole = physics = planning = reset = 0.0
    for index in episodes:
        begin = process_time()
        random_episode(setup, environment, 0, index)
        whole += process_time() - begin
        with ExitStack() as stack:
            step = stack.enter_context(timed(World, "step", cost))
            start = stack.enter_context(timed(setup.controller, "start", cost))
            restart = stack.enter_context(timed(environment, "reset", cost))
            random_episode(setup, environment, 0, index)
        physics += step.seconds
        planning += start.seconds
        reset += restart.seconds
    return Round(whole, physics, planning, reset)


def bytes_per_episode(setup: Setup, environment: Environment, episodes: int) -> float:
    """Size of one shard, its digest left out, divided by its episodes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "shard.parquet"
        rows = [random_episode(setup, environment, 0, index) for index in range(episodes)]
        schema.write(path, identity_of(setup, seed=0, episodes_per_shard=episodes), 0, rows)
        return path.stat().st_size / episodes


def report(name: str, count: int, episodes: int) -> None:
    """Measure a setup in so many rounds of so many episodes, and print its ratios beside their targets."""
    setup, cost, target = setups.load(name), clock_cost(), TARGETS.get(name, Target())
    with setup.open() as environment:
        random_episode(setup, environment, 0, 0)
        rounds = [
            measure(setup, environment, range(n * episodes, (n + 1) * episodes), cost) for n in range(count)
        ]
        size = bytes_per_episode(setup, environment, 64)
    median = statistics.median
    rows = [
        ("loop / its stepSimulation calls", median(r.loop / r.physics for r in rounds), "x", target.loop),
        ("episode / its stepSimulation calls", median(r.episodes / r.physics for r in rounds), "x", "-"),
        ("planning / episode", 100 * median(r.planning / r.episodes for r in rounds), "%", target.planning),
        ("reset / episode", 100 * median(r.reset / r.episodes for r in rounds), "%", target.reset),
        ("CPU of one episode", 1e3 * median(r.episodes for r in rounds) / episodes, "ms", target.episode),
        ("one trajectory on disk", size / 1e3, "kB", target.size),
    ]
    load = f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    print(f"{setup.name}: {count} rounds x {episodes} episodes, {load}")
    for what, value, unit, aim in rows:
        print(f"  {what:<36}{value:8.2f} {unit:<3} target {aim}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--setup", nargs="+", default=list(TARGETS), help="all three robots by default")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--episodes", type=int, default=10, help="of each round")
    options = parser.parse_args()
    for name in options.setup:
        report(name, options.rounds, options.episodes)


if __name__ == "__main__":
    main()
